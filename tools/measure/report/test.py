"""How targets are judged, by tables made up here: met, missed, at the bound, not known, not measured."""
import math, unittest
from unittest.mock import patch

from tables import Table
from targets import TARGETS, judge, met

SMOKE, FRONT, MAP, THREE, ONE, ZERO, FORWARD, SINGLE, TREE, SPH, RAYS, SHADOW_RAYS, SHADOW_TIME, KITCHEN, ROBOTS, FIXED = (
    target[0] for target in TARGETS)


def judged(source, header, *rows):
    """The targets by what they are, where one table was made: the lines of its CSV."""
    table = Table(header.split(","), [row.split(",") for row in rows])
    return {target.what: target for target in judge({source: table})}


class Targets(unittest.TestCase):
    def test_without_tables_nothing_is_measured(self):
        for target in judge({}):
            self.assertEqual((target.figure, target.met), ("not measured", None))

    def test_one_that_is_missed_decides(self):
        self.assertIs(met(1, math.nan, -1), False)
        self.assertIsNone(met(1, math.nan))
        self.assertIs(met(1, 0), True)

    def test_gain_and_error(self):
        for gain, error, right in (("25", "0.01", True), ("24.9", "0.01", False), ("25", "0.0101", False),
                                   ("25", "-", None), ("24.9", "-", False), ("-", "0.01", None)):
            found = judged("table_2", "way,gain,RMSE", "direct,1,0.001", f"default,{gain},{error}")
            self.assertIs(found[SMOKE].met, right, (gain, error))

    def test_quick_is_not_judged(self):
        table = Table(["arithmetic", "ratio to f32", "relative RMSE"], [["fixed", "2", "0.1"]], machine={"quick": True})
        found = {target.what: target for target in judge({"arithmetics": table})}[FIXED]
        self.assertEqual((found.figure, found.met), ("2x", "quick"))
        del table.rows[0]
        found = {target.what: target for target in judge({"arithmetics": table})}[FIXED]
        self.assertEqual((found.figure, found.met), ("not measured", None))

    def test_the_soonest_that_errs_by_one_percent_at_most(self):
        table = Table(["family", "what", "s", "RMSE"], [
            ["method", "direct, 4100000 photons", "100", "0.1"], ["photons", "a", "2", "0.02"],
            ["photons", "b", "5", "0.01"], ["photons", "c", "8", "0.005"]])
        found = {target.what: target for target in judge({"front": table})}[FRONT]
        self.assertEqual((found.figure, found.met), ("20x (b, 5 s)", False))
        table.rows[2][2] = "4"
        found = {target.what: target for target in judge({"front": table})}[FRONT]
        self.assertEqual((found.figure, found.met), ("25x (b, 4 s)", True))
        del table.rows[2:]
        found = {target.what: target for target in judge({"front": table})}[FRONT]
        self.assertEqual((found.error, found.met), ("2\u00a0% at best", False))

    def test_equal_error(self):
        rows = ("grid_g05,1 photons,1,0.05", "grid_g05,2 photons,4.5,0.03", "grid_g05,3 photons,9,0.011", "grid_g0,1 photons,0.1,0.009",
                "grid_g05,pbrt,450,0.03", "grid_g05,pbrt,2000,0.01", "grid_g0,pbrt,20,0.01")
        found = judged("grid", "scene,what,s,RMSE", *rows)
        self.assertEqual((found[THREE].figure, found[THREE].met), ("100x (2 photons, 4.5 s)", True))
        self.assertEqual((found[ONE].error, found[ONE].met), ("1.1\u00a0% at best", False))
        self.assertEqual((found[ZERO].figure, found[ZERO].met), ("200x (1 photons, 0.1 s)", True))

    def test_forward(self):
        for seconds, met in ((8, True), (9, False)):
            found = judged("grid", "scene,what,s,RMSE", "grid_g05,1000000 photons,4,0.02", "grid_g09,1 photons,1,0.04",
                           f"grid_g09,2 photons,{seconds},0.03")
            self.assertIs(found[FORWARD].met, met)

    def test_single_scattering_beside_the_step_that_is_near_enough(self):
        for own, figure, met in ((0.5, "4x (0.5 s; b: 2 s)", True), (4, "0.5x (4 s; b: 2 s)", False)):
            found = judged("grid_single", "what,s,RMSE", f"wisp,{own},0.0009", "a,1,0.002", "b,2,0.001", "c,9,0.0001")
            self.assertEqual((found[SINGLE].figure, found[SINGLE].met), (figure, met))
        self.assertIs(judged("grid_single", "what,s,RMSE", "wisp,0.1,0.0011", "b,2,0.001")[SINGLE].met, False)

    def test_one_slow_row_misses(self):
        def of(ratio):
            return judged("rays", "arithmetic,scene,rays,what,who,ratio,visits",
                          "f32,kitchen.aff,primary,Mrays/s,Embree sse2,1.2,3 differ",
                          f"f32,kitchen.aff,shadow,Mrays/s,Embree sse2,{ratio},0 differ",
                          "f32,kitchen.aff,shadow,Mrays/s,Embree,0.5,",
                          "fixed,kitchen.aff,shadow,Mrays/s,Embree sse2,0.4,")[RAYS]
        self.assertIs(of("1").met, True)
        self.assertIs(of("0.99").met, False)
        self.assertEqual(of("0.99").figure, "0.99x in the worst row (kitchen.aff, shadow), 1 at least in 1 of 2")
        self.assertEqual(of("1").error, "3 hits differ at most")

    def test_only_nanoflann_is_the_trees_rival(self):
        found = judged("point_tree", "what,queries,way,ratio", "build ms,tree,wisp,0.9",
                       "build ms,tree,nanoflann leaf 10,1.1", "SPH sum 64 ns,tree,nanoflann leaf 10,0.5",
                       "SPH sum 64 ns,tree,cell list,0.5")
        self.assertEqual((found[TREE].met, found[SPH].met), (True, False))

    def test_each_bound(self):
        """The last value that meets a target, one that does not, and none, in the place of {}."""
        culling = "method,visits saved %,best,tests saved %,best,wrong pixels"
        shadow = "arithmetic,scene,way,over trace,over Embree,over Embree sse2"
        for what, source, header, row, good, bad in (
                (KITCHEN, "shadows_kitchen", culling, "exact,{},99,68,99,0", "80", "79.9"),
                (KITCHEN, "shadows_kitchen", culling, "exact,80,99,{},99,0", "68", "67.9"),
                (KITCHEN, "shadows_kitchen", culling, "exact,80,99,68,99,{}", "0", "1"),
                (ROBOTS, "shadows_robots", culling, "exact,{},99,68,99,0", "78", "77.9"),
                (SHADOW_RAYS, "shadow_rays", shadow, "f32,kitchen.aff,exact,1,{},9", "1", "0.99"),
                (SHADOW_TIME, "shadow_rays", shadow, "f32,kitchen.aff,exact,{},9,9", "2", "1.99"),
                (FIXED, "arithmetics", "arithmetic,ratio to f32,relative RMSE", "fixed,{},0.1", "3", "3.01"),
                (MAP, "table_2", "way,gain,RMSE,irradiance map", "map + irradiance,1,0,{}", "4194304", "4194305")):
            with patch("targets.compare", lambda *_: 0.005):
                for value, met in ((good, True), (bad, False), ("-", None)):
                    self.assertIs(judged(source, header, row.format(value))[what].met, met, (what, value))
        with patch("targets.compare", lambda *_: 0.0051):
            self.assertIs(judged("table_2", "way,gain,RMSE,irradiance map", "map + irradiance,1,0,1")[MAP].met, False)


if __name__ == "__main__":
    unittest.main()
