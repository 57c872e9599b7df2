"""Rays and shadows beside Embree, and what each way to find shadows saves beside the paper's figures (C6)."""
import os, re, shutil
from pathlib import Path

from harness import DATA, OUT, WISP, Job, median, quick, ratio, render, skipped, spread, table

BART = DATA / "bart"
KITCHEN, ROBOTS = BART / "kitchen/kitchen.aff", BART / "robots/Robot.aff"


def rays():
    if not Path("build/peers/rays_f32").exists():
        skipped("Rays", "install libembree-dev")
        return
    places = ["room", *(scene for scene in quick([], [KITCHEN, ROBOTS]) if scene.exists())]
    jobs = [Job(f"rays_{arithmetic}", [f"build/peers/rays_{arithmetic}", *places])
            for arithmetic in ("f32", "f64", "fixed")]
    yield
    cells = [job.csv() for job in jobs if job.good()]
    if cells:
        table("rays", "Rays beside Embree, one at a time", cells[0][0], [row for rows in cells for row in rows[1:]],
              "ratio: wisp over Embree; above 1 wisp is sooner. Each run the median of 5 in turn.")


def shadow_rays():
    if not Path("build/peers/shadow_rays_f32").exists() or not KITCHEN.exists():
        skipped("Shadow rays", "needs libembree-dev and BART's scenes")
        return
    jobs = [Job("shadow_rays_kitchen", ["build/peers/shadow_rays_f32", KITCHEN, quick(2, 22)]),
            Job("shadow_rays_robots", ["build/peers/shadow_rays_f32", ROBOTS, 52, quick(26, 4)])]
    yield
    cells = [job.csv() for job in jobs if job.good()]
    if cells:
        table("shadow_rays", "Shadow rays of animations, resolved a second by each way and by Embree", cells[0][0],
              [row for rows in cells for row in rows[1:]])


def povray_surfaces():
    scenes = [DATA / f"nff/{name}.nff" for name in ("gears", "teapot", "tetra")]
    if not shutil.which("povray") or not all(scene.exists() for scene in scenes):
        skipped("POV-Ray's surfaces", f"needs povray and {DATA}/nff")
        return
    script = "tools/peers/povray_surfaces.py"
    options = quick(["--size", 128, "--runs", 1], [])
    jobs = [Job(f"povray_{scene.stem}", ["python3", script, OUT / "povray_surfaces", scene, *options],
                reads=(script, WISP, scene)) for scene in scenes]
    yield
    cells = [job.csv() for job in jobs if job.good()]
    if cells:
        table("povray_surfaces", "Polygons, lights and mirrors beside POV-Ray: one ray a pixel, one thread", cells[0][0],
              [row for rows in cells for row in rows[1:]], "Seconds without reading the scene, and without POV-Ray's trees.")


def point_tree():
    import smoke
    if not Path("build/peers/point_tree_f32").exists():
        skipped("Point tree", "install libnanoflann-dev")
        return
    # The peer reads raw little-endian coordinates; VTK holds them big-endian behind the line POINTS.
    source = smoke.particles(quick(100, 400), 275)
    raw = source.read_bytes()
    found = re.search(rb"POINTS (\d+) float\n", raw)
    points = raw[found.end():found.end() + 12 * int(found[1])]
    file = source.with_suffix(".xyz")
    file.write_bytes(b"".join(points[i:i + 4][::-1] for i in range(0, len(points), 4)))
    job = Job("point_tree", ["build/peers/point_tree_f32", file], reads=(file,))
    yield
    if job.good():
        table("point_tree", "Point tree beside nanoflann and a cell list", job.csv()[0], job.csv()[1:],
              "ratio: a rival's time over wisp's; in wisp's own row that of the best rival.")


# ----------------------------------------------------------------------------------------------------------------- culling
WAYS = {"trace": "trace", "exact": "exact", "exact each frame alone": "alone", "cache": "cache", "lightbuffer": "lightbuffer",
        "voxel": "voxel", "lie": "lie", "paper": "paper"}


def work(frame):
    """Node visits and triangle tests with all that proofs, lists and first occluders take. A visit is a node of a tree, leaf or
    not, of its walk by a proof, or a box of a body; a leaf's eight triangles are eight tests."""
    shadow = frame["shadow"]
    return (shadow["node_visits"] + shadow["proof_node_visits"],
            shadow["triangle_tests"] + shadow["proof_triangle_tests"] + shadow["extra_tests"])


def culling(name, scene, count, title, notes=""):
    arithmetic = os.environ.get("ARITH") or "f32"
    tree = os.environ.get("TREE") or "box"
    size = quick("96x96", "512x512")
    same = f"--frame-count {count} --size {size} --spp 1 --arith {arithmetic} --tree {tree} --digest -v"

    def job(way, frames="", key=""):
        # Pictures are their digests.
        return render(f"shadows_{name}_{way}{key}", scene, same, frames, f"--shadows {'exact' if way == 'alone' else way}",
                      makes=(), runs=None if way in ("trace", "exact") else 1)

    jobs = {label: [job(way, f"--frames {i}", f"_{i}") for i in range(count)] if way == "alone" else [job(way)]
            for label, way in WAYS.items()}

    def tables():
        traced = jobs["trace"][0]
        if not traced.good():
            return
        base = [work(frame) for frame in traced.frames()]
        rows, per_frame = [], [[i] for i in range(len(base))]
        header = ["frame"]
        for label, parts in jobs.items():
            frames = [frame for part in parts for frame in part.frames()]
            if len(frames) != len(base):
                continue
            own = [work(frame) for frame in frames]
            rays = sum(frame["rays"]["shadow"] for frame in frames)
            saved = [[100 * (1 - ours[k] / theirs[k]) if theirs[k] else 0 for ours, theirs in zip(own, base)] for k in (0, 1)]
            sums = [(sum(ours[k] for ours in own), sum(theirs[k] for theirs in base)) for k in (0, 1)]
            digests = [digest for part in parts for digest in part.digests()]
            right = sum(a == b for a, b in zip(digests, traced.digests()))
            seconds = [sum(run) for run in zip(*(part.seconds("render") for part in parts))]
            rows.append([label, sums[0][0] / rays if rays else None, sums[1][0] / rays if rays else None,
                         *(cell for k in (0, 1) for cell in (100 * (1 - sums[k][0] / sums[k][1]), max(saved[k]))),
                         median(seconds), spread(seconds), ratio(traced.seconds("render"), seconds),
                         sum(frame["shadow"].get("wrong_pixels", 0) for frame in frames),
                         frames[0]["stages"]["shadows"]["used"] / 1e6, f"{right} of {len(base)}"])
            header += [f"{label}: visits saved %", f"{label}: tests saved %"]
            for i, row in enumerate(per_frame):
                row += [saved[0][i], saved[1][i]]
        table(f"shadows_{name}", f"{title}, {count} frames, {size}, {arithmetic}, tree {tree}",
              ["method", "visits a ray", "tests a ray", "visits saved %", "best", "tests saved %", "best", "seconds", "spread %",
               "trace / this", "wrong pixels", "MB", "frames that are right"], rows, notes)
        table(f"frames_{name}", f"{title}, frame by frame", header, per_frame, printed=False)
    return tables


def culling_section(name, title, count, notes="", file=None):
    def section():
        scene = file() if callable(file) else file
        if not KITCHEN.exists():
            skipped(title, f"no {KITCHEN}")
            return
        tables = culling(name, scene, count, title, notes)
        yield
        tables()
    section.__name__ = name
    return section


def still(name, change=lambda text: text):
    """Kitchen without its car, in the animation's own time."""
    def make():
        if not KITCHEN.exists():
            return None
        text = re.sub(r"^(x|k) toycar\s*\{.*?^\}", "", KITCHEN.read_text(), flags=re.M | re.S)
        text = re.sub(r"^(\s*i \S+) (\S+\.aff)", rf"\1 {KITCHEN.parent}/\2", text, flags=re.M)
        file = OUT / f"{name}.aff"
        file.write_text(change(text))
        return file
    return make


NEARER = """
k camera
{
  transl 9
 -1.0  3.75  2.30  3.60   0 0 0
  0.0  3.75  2.30  3.60   0 0 0
  1.0  2.9   1.6   2.5    0 0 0
  2.0  2.5   1.28  2.0    0 0 0
  3.0  2.3   1.12  1.75   0 0 0
  4.0  2.2   1.04  1.63   0 0 0
  5.0  2.15  1.0   1.57   0 0 0
  6.0  2.125 0.98  1.54   0 0 0
  7.0  2.125 0.98  1.54   0 0 0
  rot 4
 -1.0  0.54 -0.83 -0.13  50  0 0 0
  0.0  0.54 -0.83 -0.13  50  0 0 0
  3.0  0.54 -0.83 -0.13  50  0 0 0
  7.0  0.54 -0.83 -0.13  50  0 0 0
}
"""


def nearer(text):
    """The camera comes nearer by half and more a frame."""
    text = re.sub(r"^k camera\s*\{.*?^\}", "", text, flags=re.M | re.S)
    return re.sub(r"^a .*$", "a 0 6 7", text, count=1, flags=re.M) + NEARER


kitchen = culling_section("kitchen", "BART Kitchen", quick(5, 22), "The paper: 19.8 % of visits (59.5 % in the best frame), "
                          "24.5 % (59.8 %) of tests; wrong pixels not counted.", KITCHEN)
robots = culling_section("robots", "BART Robots", quick(13, 52),
                         "The paper: 7.4 % of visits (19.5 % in the best frame), 9.5 % (29.6 %) of tests.", ROBOTS)
walk = culling_section("walk", "Kitchen, nothing moves but the camera", quick(5, 22), file=still("walk"))
zoom = culling_section("zoom", "Kitchen, the camera comes nearer", 7, file=still("zoom", nearer))
