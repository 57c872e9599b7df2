"""The paper's Tables 1 to 4 (S6) beside ours, speed against error of every way, what each shortcut costs, and a density grid
beside pbrt and POV-Ray."""
import math, os, re, shutil, subprocess, sys
from pathlib import Path

from harness import (DATA, OUT, QUICK, WISP, Job, compare, median, picture, plain, quick, ratio, read_pfm, render, skipped,
                     spread, table)

TRUTH = Path("build/truth")
SIZE, HALF = quick("50x50", "500x500"), quick("30x30", "250x250")


def photons(n):
    return f"--photons {n // quick(20, 1)}"


# All options are said, so that rows keep their meaning when a default changes. Only the density grid is rendered by
# default.
EXACT = "--density-step 0 --light-step 0 --step 0.5 --deposit exact"
DIRECT = "--smoke direct " + EXACT
MAP = "--smoke map " + EXACT
VOLUME = "--smoke volume --density-step 0.55 --light-step 0 --step 0.5 --deposit exact"
DEFAULT = "--smoke map --density-step 0.55 --light-step 0.55 --irradiance-step 1.1 --step 1"
NONE, UNIFORM, ADAPTIVE = (f"--irradiance {way}" for way in ("none", "uniform", "adaptive"))
ALL, MANY = photons(4100000), photons(1000000)


# ----------------------------------------------------------------------------------------------------------------- scenes
def particles(rate, frame):
    """The file of a simulated plume, made where it is missing."""
    file = OUT / f"plume_{rate}_{frame}.vtk"
    if not file.exists():
        OUT.mkdir(parents=True, exist_ok=True)
        subprocess.run(["build/plume", "--rate", str(rate), "--frame", str(frame), "-o", file], check=True)
    return file


# The smoke of Table 2, the same at other times, and seen by fewer and by more particles: rate, frame, radius, mass.
SMOKES = {"table2": (400, 275, 0.2035, 1), "frame_200": (400, 200, 0.2035, 1), "frame_225": (400, 225, 0.2035, 1),
          "frame_250": (400, 250, 0.2035, 1), "rate_100": (100, 275, 0.32304, 4), "rate_1500": (1500, 275, 0.13098, 0.266666667)}


# The same density grid with three phases.
GRIDS = {"grid_g0": 0, "grid_g05": 0.5, "grid_g09": 0.9}
# pbrt-v4's volpath on it, one thread: RMSE of the pixels that see smoke is so much / sqrt(seconds).
PBRT = {"grid_g0": 0.45, "grid_g05": 0.77}


def grid_scene(name):
    """Density, light and view of DATA/volumes."""
    file = OUT / f"{name}.aff"
    file.write_text(f"""v from 0 1 4.5 at 0 1 0 up 0 1 0 angle 29.885378 hither 0.1 resolution 250 250
lp 1.5 2.5 1.5  10 10 10
smoke {DATA}/volumes/plume.vol {{
  extinction 60
  albedo 0.9 0.9 0.9
  phase {GRIDS[name]}
}}
""")
    return file


def has_grid():
    return (DATA / "volumes/plume.vol").exists()


def scene(name, view=None):
    """A file like fixtures/table2.aff with this smoke, perhaps seen from elsewhere."""
    if name in GRIDS:
        return grid_scene(name)
    rate, frame, radius, mass = SMOKES[name]
    text = Path("fixtures/table2.aff").read_text()
    text = re.sub(r"^smoke .*", f"smoke {particles(rate, frame).name} {{", text, flags=re.M)
    text = re.sub(r"^  radius .*", f"  radius {radius}", text, flags=re.M)
    text = re.sub(r"^  mass .*", f"  mass {mass}", text, flags=re.M)
    if view:
        text = re.sub(r"^v from .* at", f"v from {view} at", text, flags=re.M)
    file = OUT / (f"{name}_{view.replace(' ', '_')}.aff" if view else f"{name}.aff")
    file.write_text(text)
    return file


# -------------------------------------------------------------------------------------------------------------- references
# Rays of a pixel are a fixed pattern, so errors are compared at one size and --spp: 32 x 32 and 4.
def truth():
    """5,000 passes a file, 2 to 3 minutes each; what is there is kept. CHUNKS of each scene, five times as many of Table 2 and
    of the grid that scatters forward."""
    chunks = int(os.environ.get("CHUNKS") or 4)
    TRUTH.mkdir(parents=True, exist_ok=True)
    for name in [*SMOKES, *(GRIDS if has_grid() else [])]:
        for i in range(chunks * 5 if name in ("table2", "grid_g09") else chunks):
            file = TRUTH / f"{name}.{i}.passes"
            passes = f"{5000 * i}:{5000 * (i + 1)}"
            Job(f"truth_{name}_{i}", [WISP, "render", scene(name), "--size", "32x32", "--reference", "--passes", passes,
                "-o", file], makes=(file,), runs=1, lasting=True)
    yield


def merged(name):
    """The mean of all passes that there are, and its standard error."""
    parts = sorted(TRUTH.glob(f"{name}.*.passes"))
    mean, error = TRUTH / f"{name}.pfm", TRUTH / f"{name}.error.pfm"
    if parts and (not mean.exists() or mean.stat().st_mtime < max(part.stat().st_mtime for part in parts)):
        subprocess.run([WISP, "merge", *parts, "-o", mean, "--error-out", error], check=True)
    return mean, error


def small(name, key, *options):
    """The picture that is held against the reference, where there is one or will be."""
    if QUICK and not any(TRUTH.glob(f"{name}.*.passes")):
        return None
    return render(f"{name}_small_{key}", scene(name), "--size 32x32", *options, runs=1)


def true_error(name, job, figure="beyond the noise of B"):
    mean, error = merged(name)
    return compare(picture(job), mean, figure, "--error", error) if job else math.nan


# ------------------------------------------------------------------------------------------------------------------ tables
HEADER = ["way", "particles", "stored", "trees", "photons", "irradiance", "march", "total s", "spread %", "gain", "ratio",
          "RMSE", "photon map", "particle map", "irradiance map", "trees and bricks"]


def group(prefix, rows, smaller=None):
    """Rows of a table, whose gains are over the first: (label, key, smoke, options, paper), where paper is its stored
    photons, seconds of photons, irradiance, march and in all, and bytes of photon map, particle map and irradiance map."""
    jobs = [(render(f"{prefix}_{key}", scene(smoke), f"--size {SIZE}", options, makes=("pfm", "png")),
             small(smoke, f"{prefix}_{key}", options)) for _, key, smoke, options, _ in rows]

    def cells():
        for (label, _, smoke, _, paper), (job, little) in zip(rows, jobs):
            gain = ratio(jobs[0][0].seconds(), job.seconds())
            paper_gain = rows[0][4][4] / paper[4] if paper else math.nan
            yield [label, job.number("smoke", "particles"), job.number("photons", "stored"),
                   *(median(job.seconds(stage)) for stage in ("trees", "photons", "irradiance", "render")),
                   median(job.seconds()), spread(job.seconds()), gain, gain / paper_gain, true_error(smoke, little),
                   *(job.number("bytes", kind) for kind in ("photon_map", "particle_map", "irradiance", "particle_tree"))]
            if paper:
                yield ["  the paper", None, paper[0], None, *paper[1:5], None, paper_gain, None, None, *paper[5:8], None]
    return cells


def paper(stored, photons, irradiance, march, total, photon_map=None, particle_map=None, irradiance_map=None):
    return stored, photons, irradiance, march, total, photon_map, particle_map, irradiance_map


def table_2():
    best = paper(640000, 234.8, 229.4, 659.5, 1123.6, None, 747213, 50504704)
    cells = group("table2", [
        ("direct", "direct", "table2", f"{DIRECT} {NONE} {ALL}", paper(640000, 38.0, None, 5512.4, 5550.4, 42523034, 373555)),
        ("direct + irradiance", "direct_irr", "table2", f"{DIRECT} {UNIFORM} {ALL}",
         paper(640000, 36.9, 778.7, 686.6, 1502.2, 42778010, 373555, 50504704)),
        ("map", "map", "table2", f"{MAP} {NONE} {ALL}", paper(640000, 234.8, None, 4456.7, 4691.5, None, 747213)),
        ("map + irradiance", "map_irr", "table2", f"{MAP} {UNIFORM} {ALL}", best),
        ("volume", "volume", "table2", f"{VOLUME} {NONE} {ALL}", None),
        ("volume + irradiance", "volume_irr", "table2", f"{VOLUME} {UNIFORM} {ALL}", None),
        ("default", "default", "table2", f"{DEFAULT} {UNIFORM} {MANY}", best),
        ("default + adaptive", "adaptive", "table2", f"{DEFAULT} {ADAPTIVE} {MANY}", best)])
    seeds = [render(f"table2_seed{seed}", scene("table2"), f"--size {SIZE}", DEFAULT, UNIFORM, MANY, f"--seed {seed}", runs=1)
             for seed in (2, 3)]
    yield
    noise = compare(*map(picture, seeds)) / math.sqrt(2)
    mean, error = merged("table2")
    table("table_2", f"Table 2: fixtures/table2.aff at {SIZE}", HEADER, cells(),
          "Bytes; RMSE at 32 x 32 beyond the reference's noise, which is "
          f"{plain(compare(mean, mean, 'relative noise of B', '--error', error))}. Noise of the default, of two seeds: {plain(noise)}.")


def methods():
    """README's table: what a user would choose from, all by default but for what a row says."""
    rows = [("default, 1,000,000 photons", "default", photons(1000000)),
            ("`--photons 250k`", "few", photons(250000)),
            ("`--photons 4M --density-step 0.275 --irradiance-step 0.55 --step 0.25`", "fine",
             f"{photons(4000000)} --density-step 0.275 --light-step 0.275 --irradiance-step 0.55 --step 0.25"),
            ("`--smoke direct --irradiance none`, 4,100,000 photons: the paper's method", "direct",
             f"--smoke direct --irradiance none {ALL}")]
    jobs = [(said, render(f"methods_{key}", scene("table2"), f"--size {SIZE}", options), small("table2", f"methods_{key}", options))
            for said, key, options in rows]
    few = quick(10, 200)  # passes
    passes = OUT / "methods_reference.passes"
    reference = Job("methods_reference", [WISP, "render", scene("table2"), "--size", "32x32", "--reference", "--passes", f"0:{few}",
                                          "-q", "-o", passes], makes=(passes,))
    yield
    mean, error = OUT / "methods_reference.pfm", OUT / "methods_reference.error.pfm"
    subprocess.run([WISP, "merge", passes, "-o", mean, "--error-out", error], check=True)
    noise = lambda mean, error: compare(mean, mean, "relative noise of B", "--error", error)  # noqa: E731
    most = 5000 * len(list(TRUTH.glob("table2.*.passes")))
    seconds = median(reference.clock())
    table("methods", f"Which method: fixtures/table2.aff at {SIZE}, error at 32 x 32", ["method", "s", "spread %", "RMSE", "noise"],
          [[said, median(job.seconds()), spread(job.seconds()), true_error("table2", little), None] for said, job, little in jobs]
          + [[f"`--reference`, 32 x 32 pixels, {few:,} passes", seconds, spread(reference.clock()), None, noise(mean, error)],
             *([[f"`--reference`, 32 x 32 pixels, {most:,} passes", most / few * seconds, None, None, noise(*merged("table2"))]]
               if most else [])],
          "Seconds of the last row are those of the row before, times the passes.")


def table_3():
    """As many photons emitted as leave the paper's number in the photon map."""
    jobs = []
    for frame, smoke, emitted, stored, without, with_irradiance in [
            (200, "frame_200", 2488000, 392403, 3567.4, 1001.4), (225, "frame_225", 3246000, 481333, 4271.3, 1171.3),
            (250, "frame_250", 3693000, 550099, 4981.3, 1349.4), (275, "table2", 4153000, 650125, 5607.8, 1502.4)]:
        if QUICK and frame in (225, 250):
            continue
        theirs = [paper(stored, None, None, None, total) for total in (without, with_irradiance, with_irradiance)]
        ways = [("direct", "direct", f"{DIRECT} {NONE}"), ("direct + irradiance", "direct_irr", f"{DIRECT} {UNIFORM}"),
                ("default", "default", f"{DEFAULT} {UNIFORM}")]
        jobs.append(group("table3", [(f"{frame} {label}", f"{frame}_{key}", smoke, f"{way} {photons(emitted)}", of)
                                     for (label, key, way), of in zip(ways, theirs)]))
    yield
    table("table_3", f"Table 3: frames 200 to 275 at {SIZE}; gains over direct in the same frame", HEADER,
          [row for cells in jobs for row in cells()])


def table_4():
    rows = []
    for rate, smoke, lines in [
            (100, "rate_100", [(0, 0, None, None, 443.6, 443.6), (1000, 443, 0.1, 99.6, 447.2, 546.9),
                               (1000000, 465883, 80.5, 99.5, 443.1, 623.1)]),
            (400, "table2", [(0, 0, None, None, 883.7, 883.7), (1000, 486, 0.2, 228.5, 888.9, 1117.6),
                             (1000000, 518735, 186.6, 227.2, 884.5, 1298.3)]),
            (1500, "rate_1500", [(0, 0, None, None, 2026.4, 2026.4), (1000, 607, 0.3, 345.7, 2023.7, 2369.7),
                                 (1000000, 545887, 261.6, 342.7, 2020.1, 2624.4)])]:
        if QUICK and rate == 1500:
            continue
        rows += [(f"rate {rate} and {n} photons", f"{rate}_{n}", smoke, f"{DEFAULT} {UNIFORM} {photons(n)}", paper(*theirs))
                 for n, *theirs in lines]
    cells = group("table4", rows)
    yield
    table("table_4", f"Table 4: the default way, the paper's map + irradiance, at {SIZE}; gains over the first row", HEADER,
          cells())


# A quarter turn each, about the axis on which the camera's target lies.
VIEWS = ["-14 -16 30", "52.5 -29.5 30", "66 37 30", "-0.5 50.5 30"][:quick(2, 4)]


def table_1():
    """Every view from one particle map, and traced for each view."""
    ways = {"particle map": (f"{MAP} {NONE} {ALL}", "map"), "default": (f"{DEFAULT} {UNIFORM} {MANY}", "default")}
    jobs = {}
    for way, (options, key) in ways.items():
        scenes = [scene("table2", view) for view in VIEWS]
        file = OUT / f"table1_{key}.map"
        size = f"--size {SIZE}"
        traced = [render(f"table1_traced_{key}_1", scenes[0], size, options, f"--remap --map-out {file}")]
        traced += [render(f"table1_traced_{key}_{i}", view, size, options, "--remap") for i, view in enumerate(scenes[1:], 2)]
        reused = [render(f"table1_view_{key}_{i}", view, size, options, f"--map-in {file}", makes=("pfm", "png"),
                         after=traced[:1]) for i, view in enumerate(scenes, 1)]
        jobs[way] = traced, reused
    yield
    rows, paper_views = [], (451.40, 453.73, 459.01, 449.63)
    for way, (traced, reused) in jobs.items():
        rows.append([way, "the map", median(traced[0].seconds("photons")), None, 289.12, None, None])
        for i, (alone, job) in enumerate(zip(traced, reused)):
            same = picture(alone).read_bytes() == picture(job).read_bytes() if alone.good() and job.good() else None
            rows.append([way, f"view {i + 1}", median(job.seconds()), median(alone.seconds()), paper_views[i],
                         paper_views[i] + 289.12, {True: "yes", False: "NO"}.get(same)])
        once = [sum(s) for s in zip(traced[0].seconds("photons"), *(job.seconds() for job in reused))]
        each = [sum(s) for s in zip(*(job.seconds() for job in traced))]
        theirs = sum(paper_views[:len(VIEWS)])
        rows.append([way, "all", median(once), median(each), theirs + 289.12, theirs + 289.12 * len(VIEWS), None])
        rows.append([way, "gain", ratio(each, once), None, (theirs + 289.12 * len(VIEWS)) / (theirs + 289.12), None, None])
    table("table_1", f"Table 1: one particle map, {len(VIEWS)} cameras, {SIZE}",
          ["way", "what", "s from one map", "s traced for each", "the paper's", "traced for each", "same bits"], rows)


# -------------------------------------------------------------------------------------------------------- speed and error
SHORTCUTS = quick("rate_100", "table2")


def front():
    """Every method, arithmetic, step, number of photons and grid: seconds at one size, error at the size of the references."""
    points = []  # family, what, options
    for n in quick((100000,), (100000, 1000000, 4100000)):
        for name, way in (("direct", f"{DIRECT} {NONE}"), ("direct + irradiance", f"{DIRECT} {UNIFORM}"),
                          ("map", f"{MAP} {NONE}"), ("map + irradiance", f"{MAP} {UNIFORM}"), ("volume", f"{VOLUME} {NONE}"),
                          ("volume + irradiance", f"{VOLUME} {UNIFORM}")):
            points.append(("method", f"{name}, {n} photons", f"{way} {photons(n)}"))
    for n in quick((100000, 1000000, 10000000), (10000, 30000, 100000, 300000, 1000000, 3000000, 10000000, 30000000)):
        points.append(("photons", f"{n} photons", f"{DEFAULT} {UNIFORM} {photons(n)}"))
    for n in (100000, 1000000):
        for arithmetic in ("f32", "f64", "fixed"):
            points.append(("arithmetic", f"{arithmetic}, {n} photons", f"{DEFAULT} {UNIFORM} {photons(n)} --arith {arithmetic}"))
    for option, values in (("density-step", (0.35, 0.45, 0.7, 1)), ("light-step", (0, 1.1, 2.2)),
                           ("irradiance-step", (0.55, 2.2)), ("step", (0.25, 0.5, 2))):
        for value in values:
            family = "step" if option == "step" else "grid"
            points.append((family, f"--{option} {value}", f"{DEFAULT} {UNIFORM} {MANY} --{option} {value}"))
    points.append(("grid", "--irradiance adaptive", f"{DEFAULT} {ADAPTIVE} {MANY}"))
    points.append(("grid", "--density-step 0.35, 10000000 photons",
                   f"{DEFAULT} {UNIFORM} {photons(10000000)} --density-step 0.35"))
    jobs = []
    for i, (family, what, options) in enumerate(points):
        key = re.sub(r"\W+", "_", f"{family}_{what}")
        jobs.append((family, what, render(f"front_{key}", scene(SHORTCUTS), f"--size {HALF}", options),
                     small(SHORTCUTS, f"front_{key}", options)))
    yield
    rows = [[family, what, median(job.seconds()), spread(job.seconds()), true_error(SHORTCUTS, little),
             job.number("bytes", "arena_peak")] for family, what, job, little in jobs]
    known = [(row[2], row[4]) for row in rows if math.isfinite(row[2]) and math.isfinite(row[4])]
    for row in rows:
        worse = any(s < row[2] and e <= row[4] for s, e in known)
        row.append("yes" if math.isfinite(row[4]) and not worse else "no")
    table("front", f"Speed against error: {SHORTCUTS} at {HALF}, error at 32 x 32",
          ["family", "what", "s", "spread %", "RMSE", "bytes", "front"], rows,
          "front: nothing else is both sooner and nearer to the reference.")


def shortcuts():
    """Without photons, against exact sums in steps of 0.125."""
    way = f"{DEFAULT} {UNIFORM} --photons 0"
    exact = render("shortcut_exact", scene(SHORTCUTS), f"--size {HALF} {DIRECT} {NONE} --step 0.125 --photons 0", runs=1)
    options = ["", "--density-step 0 --light-step 0", "--density-step 0", "--density-step 1", "--light-step 1.1",
               "--light-step 2.2", "--step 0.25", "--step 0.5"]
    jobs = [(said, render(f"shortcut_{i}", scene(SHORTCUTS), f"--size {HALF} {way} {said}")) for i, said in enumerate(options)]
    yield
    table("shortcuts", f"Shortcuts of single scattering: the default changed, without photons, {SHORTCUTS} at {HALF}",
          ["options", "s", "spread %", "RMSE to no shortcuts"],
          [[said or "default", median(job.seconds()), spread(job.seconds()), compare(picture(job), picture(exact))]
           for said, job in jobs])


def arithmetics():
    size, n = quick("50x50", "200x200"), quick(30000, 300000)
    same = f"--size {size} --spp 1"
    jobs = {a: render(f"arith_{a}", "fixtures/demo.aff", same, f"--photons {n} --arith {a}") for a in ("f32", "f64", "fixed")}
    dark = {a: render(f"arith_single_{a}", "fixtures/demo.aff", same, f"--photons 0 --arith {a}", runs=1) for a in jobs}
    other = render("arith_seed2", "fixtures/demo.aff", same, f"--photons {n} --arith f64 --seed 2", runs=1)
    yield
    rows = [[a, median(job.seconds()), spread(job.seconds()), ratio(job.seconds(), jobs["f32"].seconds()),
             compare(picture(job), picture(jobs["f64"])), compare(picture(dark[a]), picture(dark["f64"]))]
            for a, job in jobs.items()]
    rows.append(["f64 with another seed", None, None, None, compare(picture(other), picture(jobs["f64"])), None])
    table("arithmetics", f"Arithmetics: fixtures/demo.aff at {size}, 1 ray a pixel, {n} photons; errors against f64",
          ["arithmetic", "s", "spread %", "ratio to f32", "relative RMSE", "without photons"], rows)


# ------------------------------------------------------------------------------------------------------------------ a grid
def share_of_lit(pfm):
    """The part of the pixels that are not black. RMSE over these alone has the square root of so much of that over all."""
    width, height, channels, values = read_pfm(pfm)
    return sum(any(values[i:i + channels]) for i in range(0, len(values), channels)) / (width * height)


def grid():
    if not has_grid():
        skipped("Density grid", f"no {DATA / 'volumes/plume.vol'}")
        return
    jobs = []
    for name in GRIDS:
        for n in quick((1000000,), (60000, 250000, 1000000, 4000000)):
            options = f"{UNIFORM} {photons(n)}"
            jobs.append((name, f"{n // quick(20, 1)} photons", render(f"{name}_{n}", scene(name), "--size 250x250", options,
                                                                     makes=("pfm", "png")), small(name, n, options)))
    yield
    rows = []
    for name, what, job, little in jobs:
        error = true_error(name, little) * math.sqrt(share_of_lit(merged(name)[0])) if little else math.nan
        pbrt = (PBRT[name] / error) ** 2 if name in PBRT and error > 0 else math.nan
        rows.append([name, what, median(job.seconds()), spread(job.seconds()), error, pbrt, pbrt / median(job.seconds())])
    rows += [[name, "pbrt", (fit / error) ** 2, None, error, None, None]
             for name, fit in PBRT.items() for error in (0.03, 0.01)]
    table("grid", "Density grid, 64 x 128 x 64, at 250 x 250, beside pbrt-v4; g = 0, 0.5, 0.9",
          ["scene", "what", "s", "spread %", "RMSE", "s of pbrt for that RMSE", "gain"], rows,
          "RMSE of the pixels that see smoke, at 32 x 32 beyond the noise of --reference; pixels of 250 x 250 err by 1.2 to 1.5 times as "
          "much. pbrt's by a fit to its own runs, of such pixels: 0.45 / sqrt(seconds) for g = 0, 0.77 / sqrt(seconds) for g = 0.5.")


def grid_single():
    """Single scattering beside a marcher that keeps nothing; DATA/volumes has the truth, by steps of 1/4 cell and finer."""
    if not has_grid():
        skipped("Single scattering in a density grid", f"no {DATA / 'volumes/plume.vol'}")
        return
    truth = DATA / "volumes/single_g05.pfm"
    jobs = [("wisp", render("grid_single", scene("grid_g05"), "--size 250x250 --photons 0"))]
    for step in quick((2,), (1, 0.5, 0.25)):
        out = OUT / f"marcher_{step}.pfm"
        jobs.append((f"marcher, steps of {step} cells", Job(f"marcher_{step}", ["build/peers/marcher", DATA / "volumes/plume.vol", out,
                     250, step, step], reads=(DATA / "volumes/plume.vol",), makes=(out,))))
    yield
    lit = math.sqrt(share_of_lit(truth))
    rows = []
    for what, job in jobs:
        seconds = job.seconds() if what == "wisp" else job.clock()
        rows.append([what, median(seconds), spread(seconds), lit * compare(picture(job), truth) if job.good() else math.nan])
    table("grid_single", "Single scattering in that grid, g = 0.5, at 250 x 250, beside a plain marcher in C", ["what", "s", "spread %", "RMSE"],
          rows, "RMSE of the pixels that see smoke.")


def povray():
    volume = DATA / "volumes/plume.vol"
    if not shutil.which("povray") or not volume.exists():
        skipped("POV-Ray", f"needs povray and {volume}")
        return
    script = "tools/peers/povray.py"
    job = Job("povray", ["python3", script, OUT / "povray", volume, *quick(["--quick"], [])], reads=(script, WISP, volume))
    yield
    if job.good():
        table("povray", "Single scattering in a density grid, beside POV-Ray's media: 250 x 250, one thread", job.csv()[0],
              job.csv()[1:])


# ------------------------------------------------------------------------------------------------------------------ figures
def sheets():
    """Contact sheets of the paper's figures, by ImageMagick."""
    if not shutil.which("montage"):
        skipped("Contact sheets", "install imagemagick")
        return
    ways = {"direct": f"{DIRECT} {NONE}", "direct_irr": f"{DIRECT} {UNIFORM}", "map": f"{MAP} {NONE}",
            "default": f"{DEFAULT} {UNIFORM}"}
    # Particles that interact.
    for key, way in ways.items():
        render(f"figure_9_{key}", "fixtures/demo.aff", f"--size {HALF} {way} {MANY}", makes=("pfm", "png"), runs=1)
    yield
    sheet("figure_4", "4x1", [f"table1_view_map_{i}" for i in (1, 2, 3, 4)])
    sheet("figure_9", "4x1", [f"figure_9_{key}" for key in ways])
    sheet("figure_10", "4x1", [f"table2_{key}" for key in ("direct", "direct_irr", "map", "map_irr")])
    sheet("figure_11", "2x4", [f"table3_{frame}_{key}" for frame in (200, 225, 250, 275) for key in ("direct", "direct_irr")])
    # More particles to the right, more photons down.
    sheet("figure_12", "3x3", [f"table4_{rate}_{n}" for n in (0, 1000, 1000000) for rate in (100, 400, 1500)])


def sheet(figure, tiles, names):
    files = [OUT / f"{name}.png" for name in names]
    subprocess.run(["montage", *(file if file.exists() else "null:" for file in files), "-resize", "250x250", "-tile", tiles,
                    "-geometry", "+2+2", "-background", "black", OUT / f"{figure}.png"], check=True)
    print(OUT / f"{figure}.png")
