"""The targets, and whether what was measured meets them."""
import math
from collections import namedtuple
from contextlib import suppress

import tables  # noqa: F401: it says where harness is
from harness import OUT, compare, plain

Judged = namedtuple("Judged", "what against target figure error met")  # met: None, not known; "quick", not judged


def percent(error):
    return f"{100 * error:.2g}\u00a0%" if math.isfinite(error) else "not known"


def times(ratio):
    return f"{ratio:.3g}x" if math.isfinite(ratio) else "not known"


def met(*margins):
    """Each margin is to be 0 at least, and is NaN where it is not known. One that is missed decides."""
    return False if any(margin < 0 for margin in margins) else None if any(map(math.isnan, margins)) else True


def soonest(points, most):
    """The soonest of the points (seconds, error, what) that err by `most` at most; where none does, the nearest."""
    return min((point for point in points if math.isfinite(point[0] + point[1])),
               key=lambda point: (0, point[0]) if point[1] <= most else (1, point[1]))


def sooner(table, most, gain, **rival):
    """The soonest of our settings that err by `most` at most, against the seconds of a rival's row."""
    seconds = table.row(**rival)["s"]
    own, error, what = soonest([(row["s"], row["RMSE"], row["what"]) for row in table.records
                                if not row["what"].startswith(("pbrt", "0 photons"))], most)
    if error > most:
        return f"not reached in {own:.3g} s", f"{percent(error)} at best", False
    return f"{times(seconds / own)} ({what}, {own:.3g} s)", percent(error), met(seconds / own - gain)


def sooner_than_pbrt(table, scene, most, gain):
    return sooner(table._replace(rows=[row for row in table.rows if row[0] == scene]), most, gain, what="pbrt", RMSE=most)


def forward(table):
    """The soonest of g = 0.9 that errs by 3 % at most, against the default of g = 0.5."""
    own, error, what = soonest([(row["s"], row["RMSE"], row["what"]) for row in table.records if row["scene"] == "grid_g09"], 0.03)
    times_of = own / table.row(scene="grid_g05", what="1000000 photons")["s"]
    return f"{times(times_of)} ({what}, {own:.3g} s)", percent(error), met(2 - times_of, 0.03 - error)


def single_scattering(table):
    own = table.row(what="wisp")
    seconds, error, what = soonest([(row["s"], row["RMSE"], row["what"]) for row in table.records if row["what"] != "wisp"], 0.001)
    return f"{times(seconds / own['s'])} ({own['s']:.3g} s; {what}: {seconds:.3g} s)", percent(own["RMSE"]), \
        met(seconds / own["s"] - 1, 0.001 - own["RMSE"], 0.001 - error)


def worst(rows, what, error="same results"):
    """The least ratio of rows, which are all to be 1 at least; WHAT names a row."""
    ratios = [(row["ratio"], what.format(**row)) for row in rows if math.isfinite(row["ratio"])]
    ratio, row = min(ratios)
    good = sum(ratio >= 1 for ratio, _ in ratios)
    return f"{times(ratio)} in the worst row ({row}), 1 at least in {good} of {len(ratios)}", error, met(ratio - 1)


def rays(table):
    rows = [row for row in table.records if row["who"] == "Embree sse2" and row["arithmetic"] == "f32"]
    differ = max((int(row["visits"].split()[0]) for row in rows), default=0)  # that column has, for Embree, "N differ"
    return worst(rows, "{scene}, {rays}", f"{differ} hits differ at most")


def saved(row, least_visits, least_tests):
    visits, tests, wrong = row["visits saved %"], row["tests saved %"], row["wrong pixels"]
    return (f"{visits:.3g} % / {tests:.3g} %", f"{plain(wrong)} wrong pixels",
            met(visits - least_visits, tests - least_tests, -wrong))


def irradiance_map(row):
    size, error = row["irradiance map"], compare(OUT / "table2_map_irr.pfm", OUT / "table2_map.pfm")
    return f"{size / 2**20:.2f} MB", percent(error), met(4 * 2**20 - size, 0.005 - error)


# What, against what, the target, the tables that it needs or may have, of the first the cells of a row if it is of one,
# and what makes of those tables, or of that row, the figure, its error, and whether the target is met.
TARGETS = [
    ("Smoke, the paper's Table 2", "our own direct without irradiance map; the paper gains 4.9x",
     "25x at relative RMSE of 1 % at most", "table_2", {"way": "default"},
     lambda row: (times(row["gain"]), percent(row["RMSE"]), met(row["gain"] - 25, 0.01 - row["RMSE"]))),
    ("... the soonest setting that errs by 1 % at most", "the same direct", "25x", "front", {},
     lambda table: sooner(table, 0.01, 25, what="direct, 4100000 photons")),
    ("Its irradiance map (map + irradiance)", "the paper's 48.2 MB; the same without one", "4 MB and 0.5 % at most",
     "table_2", {"way": "map + irradiance"}, irradiance_map),
    ("Smoke, g = 0.5, at 3 %", "pbrt-v4 volpath on the same grid, one thread", "100x sooner", "grid", {},
     lambda table: sooner_than_pbrt(table, "grid_g05", 0.03, 100)),
    ("Smoke, g = 0.5, at 1 %", "pbrt-v4 volpath on the same grid, one thread", "50x sooner", "grid", {},
     lambda table: sooner_than_pbrt(table, "grid_g05", 0.01, 50)),
    ("Smoke, g = 0, at 1 %", "pbrt-v4 volpath on the same grid, one thread", "200x sooner", "grid", {},
     lambda table: sooner_than_pbrt(table, "grid_g0", 0.01, 200)),
    ("Smoke, g = 0.9, at 3 %", "g = 0.5 by default", "twice its time at most", "grid", {}, forward),
    ("Single scattering at 0.1 %", "a plain marcher in C", "no slower", "grid_single", {}, single_scattering),
    ("Point tree: build, nearest, radius", "nanoflann, same points", "faster in each row", "point_tree", {},
     lambda table: worst([row for row in table.records if row["way"].startswith("nanoflann")
                          and not row["what"].startswith("SPH")], "{what}, {queries} order")),
    ("SPH sums of 64 neighbours", "a plain cell list", "1x at least", "point_tree", {},
     lambda table: worst([row for row in table.records if row["way"] == "cell list"], "{what}, {queries} order")),
    ("Rays: closest hit, any hit", "Embree 3 ROBUST with sse2, one ray at a time", "1x at least", "rays", {}, rays),
    ("Shadow rays resolved a second, Kitchen", "Embree 3 with its widest vectors, tracing all", "1x at least",
     "shadow_rays", {"arithmetic": "f32", "scene": "kitchen.aff", "way": "exact"},
     lambda row: (times(row["over Embree"]), "same bits", met(row["over Embree"] - 1))),
    ("Shadow time, Kitchen", "our own tracing of every shadow ray", "halved: 2x at least",
     "shadow_rays", {"arithmetic": "f32", "scene": "kitchen.aff", "way": "exact"},
     lambda row: (times(row["over trace"]), "same bits", met(row["over trace"] - 2))),
    ("Culling, Kitchen: visits / tests saved", "tracing; the paper 19.8 % / 24.5 %", "80 % / 68 %, no wrong pixel",
     "shadows_kitchen", {"method": "exact"}, lambda row: saved(row, 80, 68)),
    ("Culling, Robots: visits / tests saved", "tracing; the paper 7.4 % / 9.5 %", "78 % / 68 %, no wrong pixel",
     "shadows_robots", {"method": "exact"}, lambda row: saved(row, 78, 68)),
    ("Fixed point", "f32, the same picture", "3x the time at most", "arithmetics", {"arithmetic": "fixed"},
     lambda row: (times(row["ratio to f32"]), f"{percent(row['relative RMSE'])} to f64", met(3 - row["ratio to f32"])))]


def judge(tables):
    for what, against, target, sources, where, measure in TARGETS:
        figure, error, met = "not measured", "–", None
        table, *others = map(tables.get, sources.split())
        if table:
            with suppress(StopIteration, ValueError, FileNotFoundError):  # no such row, none to choose from, no wisp
                figure, error, met = measure(table.row(**where) if where else table, *others)
                met = "quick" if table.machine.get("quick") else met
        yield Judged(what, against, target, figure, error, met)
