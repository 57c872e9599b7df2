"""The targets, and whether what was measured meets them."""
import math
from collections import namedtuple
from contextlib import suppress

from tables import OUT, NotMeasured, compare, number

Judged = namedtuple("Judged", "what against target figure error met source")  # met is None where it is not known


def percent(value):
    return f"{100 * value:.2g}\u00a0%" if math.isfinite(value) else "not known"


def times(value):
    return f"{value:.3g}x" if math.isfinite(value) else "not known"


def at_least(value, bound):
    return value >= bound if math.isfinite(value) else None


def at_most(value, bound):
    return value <= bound if math.isfinite(value) else None


def both(*conditions):
    """One that is not met decides; else one that is not known."""
    return False if False in conditions else None if None in conditions else True


def known(records):
    """(seconds, error, what) of rows that have both."""
    points = [(number(row["s"]), number(row["RMSE"]), row["what"]) for row in records]
    return [point for point in points if math.isfinite(point[0] + point[1])]


def soonest(points, most, seconds, bound):
    """The soonest of the points that err by `most` at most, against another's seconds."""
    if not points:
        raise NotMeasured("RMSE")
    good = [point for point in points if point[1] <= most]
    if not good:
        nearest = min(points, key=lambda point: point[1])
        return f"not reached in {nearest[0]:.3g} s", f"{percent(nearest[1])} at best", False
    own, error, what = min(good)
    return f"{times(seconds / own)} ({what}, {own:.3g} s)", percent(error), at_least(seconds / own, bound)


# Each takes the tables and gives figure, error, and whether the target is met.
def smoke_default(tables):
    row = tables["table_2"].row(way="default")
    gain, error = number(row["gain"]), number(row["RMSE"])
    return times(gain), percent(error), both(at_least(gain, 25), at_most(error, 0.01))


def smoke_at_one_percent(tables):
    direct = tables["front"].row(family="method", what="direct, 4100000 photons")
    return soonest(known(tables["front"].records), 0.01, number(direct["s"]), 25)


def equal_error(level):
    def measure(tables):
        grid = tables["grid"]
        ours = known(row for row in grid.records if row["what"].endswith(" photons"))
        return soonest(ours, level, number(grid.row(what="pbrt", RMSE=f"{level:g}")["s"]), 50)
    return measure


def irradiance_bytes(tables):
    size = number(tables["table_2"].row(way="map + irradiance")["irradiance map"])
    error = compare(OUT / "table2_map_irr.pfm", OUT / "table2_map.pfm")
    return f"{size / 2**20:.2f} MB", percent(error), both(at_most(size, 4 * 2**20), at_most(error, 0.005))


def single_scattering(tables):
    """The soonest setting that is near enough; else the nearest."""
    row = tables["grid"].row(what="0 photons, to single scattering")
    points = [(number(row["s"]), number(row["RMSE"]))]
    if "povray" in tables:  # program, setting, seconds, error
        points += [(number(row[2]), number(row[3])) for row in tables["povray"].rows if row[0] == "wisp"]
    seconds, error = min(points, key=lambda point: (point[0], 0) if point[1] <= 0.001 else (math.inf, point[1]))
    return f"{seconds:.3g} s", percent(error), both(at_most(seconds, 0.1), at_most(error, 0.001))


def worst(rows, error="same results"):
    """The least of ratios that are all to be 1 at least: (ratio, what)."""
    rows = [row for row in rows if math.isfinite(row[0])]
    if not rows:
        raise NotMeasured("ratio")
    ratio, what = min(rows)
    good = sum(ratio >= 1 for ratio, _ in rows)
    return f"{times(ratio)} in the worst row ({what}), 1 at least in {good} of {len(rows)}", error, ratio >= 1


def place(name):
    return name.rsplit("/", 1)[-1].removesuffix(".aff")


def point_tree(rival):
    def measure(tables):
        rows = [row for row in tables["point_tree"].records if row["way"].startswith(rival)]
        return worst([(number(row["ratio"]), f"{row['what'].rsplit(' ', 1)[0]}, {row['queries']} order") for row in rows
                      if rival == "cell list" or not row["what"].startswith("SPH")])
    return measure


def rays(tables):
    rows = [row for row in tables["rays"].records if row["who"] == "Embree sse2" and row["arithmetic"] == "f32"]
    differ = max((int(row["visits"].split()[0]) for row in rows), default=0)  # that column has, for Embree, "N differ"
    return worst([(number(row["ratio"]), f"{place(row['scene'])}, {row['rays']}") for row in rows],
                 f"{differ} hits differ at most")


def kitchen_shadow_rays(column, bound):
    def measure(tables):
        ratio = number(tables["shadow_rays"].row(arithmetic="f32", scene="kitchen.aff", way="exact")[column])
        return times(ratio), "same bits", at_least(ratio, bound)
    return measure


def culling(name, visits, tests):
    def measure(tables):
        row = tables[name].row(method="exact")
        saved = [number(row[f"{what} saved %"]) for what in ("visits", "tests")]
        return f"{saved[0]:.3g} % / {saved[1]:.3g} %", f"{row['wrong pixels']} wrong pixels", \
            both(at_least(saved[0], visits), at_least(saved[1], tests), at_most(number(row["wrong pixels"]), 0))
    return measure


def fixed_time(tables):
    row = tables["arithmetics"].row(arithmetic="fixed")
    ratio = number(row["ratio to f32"])
    return times(ratio), f"{percent(number(row['relative RMSE']))} to f64", at_most(ratio, 3)


TARGETS = [
    ("Smoke, the paper's Table 2", "our own direct without irradiance map; the paper gains 4.9x",
     "25x at relative RMSE of 1 % at most", "table_2", smoke_default),
    ("... the soonest setting that errs by 1 % at most", "the same direct", "25x", "front", smoke_at_one_percent),
    ("Its irradiance map (map + irradiance)", "the paper's 48.2 MB; the same without one",
     "4 MB and 0.5 % at most", "table_2", irradiance_bytes),
    ("Smoke at equal error, 3 %", "pbrt-v4 volpath on the same grid, one thread", "50x sooner", "grid", equal_error(0.03)),
    ("Smoke at equal error, 1 %", "pbrt-v4 volpath on the same grid, one thread", "50x sooner", "grid", equal_error(0.01)),
    ("Single scattering", "POV-Ray 32 s for 4.1 %, pbrt 3.7 s for 20 %, a plain marcher 0.25 s for 0.1 %",
     "0.1 % within 0.1 s", "grid", single_scattering),
    ("Point tree: build, nearest, radius", "nanoflann, same points", "faster in each row", "point_tree", point_tree("nanoflann")),
    ("SPH sums of 64 neighbours", "a plain cell list", "1x at least", "point_tree", point_tree("cell list")),
    ("Rays: closest hit, any hit", "Embree 3 ROBUST with sse2, one ray at a time", "1x at least", "rays", rays),
    ("Shadow rays resolved a second, Kitchen", "Embree 3 with its widest vectors, tracing all", "1x at least", "shadow_rays",
     kitchen_shadow_rays("over Embree", 1)),
    ("Shadow time, Kitchen", "our own tracing of every shadow ray", "halved: 2x at least", "shadow_rays",
     kitchen_shadow_rays("over trace", 2)),
    ("Culling, Kitchen: visits / tests saved", "tracing; the paper 19.8 % / 24.5 %", "80 % / 68 %, no wrong pixel",
     "shadows_kitchen", culling("shadows_kitchen", 80, 68)),
    ("Culling, Robots: visits / tests saved", "tracing; the paper 7.4 % / 9.5 %", "78 % / 68 %, no wrong pixel",
     "shadows_robots", culling("shadows_robots", 78, 68)),
    ("Fixed point", "f32, the same picture", "3x the time at most", "arithmetics", fixed_time),
]


def judge(tables):
    for what, against, target, source, measure in TARGETS:
        figure, error, met = "not measured", "–", None
        if source in tables:
            with suppress(NotMeasured):
                figure, error, met = measure(tables)
        yield Judged(what, against, target, figure, error, met, source)
