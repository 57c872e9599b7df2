"""How time and bytes grow with particles, photons, triangles, lights and pixels, and what ends that.

    scaling_particles    1e3 to 1e7 particles, evenly spread, 30 of them in a support, the same optical depth
    scaling_photons      1e3 to 1e8 photons into 1e4 of them, by the default way; 1e3 to 1e6 by `--smoke direct`
    scaling_triangles    1e2 to 1e7 triangles, a mesh of hills, one light
    scaling_lights       1 to 1,000 point lights above hills, by `--lights all` and `cuts`, and about smoke
    scaling_pixels       32^2 to 4096^2 pixels of hills, and to 2048^2 of smoke
    scaling              the exponents of stages and of bytes, beside those of their algorithms
    limits               what is asked beyond what memory or numbers hold, and how it is refused

The columns of the sweeps are alike: what it is of, `n`, the median seconds of each stage, of all of them and, by the clock, of
the process, which reads the scene's file first, the spread of those in percent, the most bytes that the arena had in use, those
per n, and the most that the process had (no less than Python, which starts it). An exponent is the slope of a straight
line through the logarithms, by least squares, over the upper half of the range of n on its scale, where what does not grow no
longer matters; stages that last less than 0.01 seconds have none.

A row of `limits` is one thing that is too much, in one arithmetic: some that are absurd, and the smallest power of two at which
a quantity is refused. It must be refused by one line, with the status that is right for it, without work or memory; what ends
otherwise is listed as failed.
"""
import gzip, math, shlex, struct, sys
from array import array

from harness import *

SCENES = OUT / "scaling"
STAGES = ["read", "trees", "photons", "irradiance", "render"]
LAMP = "lp 2 -2 4  40 40 40\n"


def decades(low, high, parts=1):
    """Whole numbers from 10^low to 10^high, `parts` a decade."""
    return [round(10 ** (low + i / parts)) for i in range((high - low) * parts + 1)]


# ---------------------------------------------------------------------------------------------------------------- scenes
def made(name, write):
    """A file that `write` makes where it is missing; its name says all that it depends on."""
    SCENES.mkdir(parents=True, exist_ok=True)
    path = SCENES / name
    if not path.exists():
        with open(path.with_suffix(".part"), "wb") as file:
            write(file)
        path.with_suffix(".part").rename(path)
    return path


def scene(name, text):
    """A scene of this text under a usual view, written anew only where it differs."""
    SCENES.mkdir(parents=True, exist_ok=True)
    path = SCENES / name
    text = "v from 1.6 -2.6 1.5 at 0 0 -0.1 up 0 0 1 angle 40 hither 0.01 resolution 64 64\nb 0.02 0.03 0.05\n" + text
    if not path.exists() or path.read_text() != text:
        path.write_text(text)
    return path


def write_ball(file, n):
    """Legacy VTK: the first n points of an R3 sequence, evenly spread at any n, in the ball of radius 1."""
    file.write(f"# vtk DataFile Version 3.0\nball\nBINARY\nDATASET POLYDATA\nPOINTS {n} float\n".encode())
    x = y = z = 0.5
    while n > 0:
        xyz = array("f")
        while len(xyz) < 3 * min(n, 100000):
            x, y, z = (x + 0.8191725133961645) % 1, (y + 0.6710436067037893) % 1, (z + 0.5497004779019703) % 1
            u, v, w = 2 * x - 1, 2 * y - 1, 2 * z - 1
            if u * u + v * v + w * w < 1:
                xyz.extend((u, v, w))
        n -= len(xyz) // 3
        if sys.byteorder == "little":
            xyz.byteswap()
        file.write(xyz.tobytes())


def ball(n):
    """Smoke of n particles, 30 in a support of two smoothing lengths, with a depth of 4 along a diameter."""
    path = made(f"ball_{n}.vtk", lambda file: write_ball(file, n))
    h, area = 0.5 * (30 / n) ** (1 / 3), 2 * (4 / 3 * math.pi) / n
    return f"smoke {path.name} {{\n  radius {h:.6g}\n  mass 1\n  extinction {area:.6g}\n}}\n", (path,)


def write_hills(file, side):
    steps = [2 * i / side - 1 for i in range(side + 1)]
    along = [(math.sin(5 * x), 0.03 * math.cos(37 * x)) for x in steps]
    file.write(f"f 0.8 0.7 0.6 1 0 0 0 1\nm vertices {(side + 1) ** 2}\n".encode())
    for y, (far, near) in zip(steps, along):
        rows = [f"{x:.5f} {y:.5f} {0.2 * a * far + b + near:.5f}\n" for x, (a, b) in zip(steps, along)]
        file.write("".join(rows).encode())
    file.write(f"triangles {2 * side * side}\n".encode())
    for low in range(0, side * (side + 1), side + 1):
        high = low + side + 1
        rows = [f"{low + i} {low + i + 1} {high + i + 1}\n{low + i} {high + i + 1} {high + i}\n" for i in range(side)]
        file.write("".join(rows).encode())


def hills(n):
    """A mesh of about n triangles over the square from -1 to 1, and how many it has."""
    side = round(math.sqrt(n / 2))
    path = made(f"hills_{side}.aff", lambda file: write_hills(file, side))
    return f"i 0 {path.name}\n", (path,), 2 * side * side


def lamps(n):
    """Point lights above it all, which together are as bright as one; a spiral, in which they are evenly spread."""
    def at(i):
        r, turn = 2.5 * math.sqrt((i + 0.5) / n), 2.399963229728653 * i
        return f"lp {r * math.cos(turn):.5f} {r * math.sin(turn):.5f} 2  {30 / n:.6g} {30 / n:.6g} {30 / n:.6g}\n"
    return "".join(at(i) for i in range(n))


# ---------------------------------------------------------------------------------------------------------------- sweeps
def sweep_jobs():
    """(sweep, of, [(n, job)], {what: the exponent of its algorithm})."""
    sweeps = []

    def sweep(name, of, expected, steps):
        """`steps`: (n, text, files, options) of each; the largest are run once."""
        jobs = []
        for n, text, files, options, heavy in steps:
            label = f"scaling_{name}_{of.replace(' ', '_')}_{n}"
            jobs.append((n, render(label, scene(f"{label}.aff", text), "--spp 1", options, makes=(), reads=files,
                                   runs=1 if heavy else None)))
        sweeps.append((name, of, jobs, expected))

    def of_ball(n, options, heavy=False, lights=LAMP, size=10000):
        text, files = ball(size)
        return n, lights + text, files, options, heavy

    def of_hills(n, options, heavy=False, lights=LAMP, size=20000):
        text, files, count = hills(size)
        return n or count, lights + text, files, options, heavy

    # Cells are as many as particles. A ray passes the cube root of that: one from each of them, to the light, before photons,
    # and those of a fixed number of photons and pixels.
    sweep("particles", "smoke",
          {"read": 1, "trees": "1 to 4/3", "photons": 1 / 3, "irradiance": 1, "render": 1 / 3, "bytes": 1},
          [of_ball(n, "--photons 100000", n > 1e6, size=n) for n in decades(3, quick(4, 7), quick(1, 2))])
    sweep("photons", "map", {"photons": 1, "bytes": 0},
          [of_ball(n, f"--photons {n}", n > 1e6) for n in decades(3, quick(5, 8), quick(1, 2))])
    sweep("photons", "direct", {"photons": 1, "irradiance": 0, "bytes": 1},
          [of_ball(n, f"--smoke direct --photons {n}", n > 1e5, size=1000) for n in decades(3, quick(4, 6), quick(1, 2))])
    sweep("triangles", "hills", {"read": 1, "trees": 1, "render": 0, "process": 1, "bytes": 1},
          [of_hills(0, "--size 256x256", n > 1e6, size=n) for n in decades(2, quick(4, 7), quick(1, 2))])
    for choice in ("all", "cuts"):
        sweep("lights", choice, {"render": {"all": "1", "cuts": "< 1"}[choice]},
              [of_hills(n, f"--size 128x128 --lights {choice}", lights=lamps(n)) for n in decades(0, quick(2, 3), quick(1, 2))])
    sweep("lights", "smoke", {"trees": 1, "render": 1, "bytes": 1},
          [of_ball(n, "--photons 100000", n > 100, lights=lamps(n)) for n in decades(0, quick(1, 3), quick(1, 2))])
    sides = [2 ** e for e in range(5, quick(9, 13))]
    sweep("pixels", "hills", {"render": 1, "bytes": 0},
          [of_hills(s * s, f"--size {s}x{s}", s > 1000) for s in sides])
    sweep("pixels", "smoke", {"render": 1, "bytes": 0},
          [of_ball(s * s, f"--size {s}x{s} --photons 100000", s > 1000) for s in sides if s <= 2048])
    return sweeps


def exponent(points):
    """The slope of log y against log n; NaN where less than two points are left."""
    points = [(math.log(n), math.log(y)) for n, y in points]
    if len(points) < 2:
        return math.nan
    mean_x, mean_y = (sum(axis) / len(points) for axis in zip(*points))
    return sum((x - mean_x) * (y - mean_y) for x, y in points) / sum((x - mean_x) ** 2 for x, _ in points)


def tables_of(sweeps):
    fits, rows = [], {}
    for name, of, jobs, expected in sweeps:
        half = math.sqrt(jobs[0][0] * jobs[-1][0]) * 0.99
        seen = [(n, job) for n, job in jobs if job.good() and n >= half]
        for n, job in jobs:
            peak = job.number("bytes", "arena_peak")
            rows.setdefault(name, []).append(
                [of, n, *[median(job.seconds(stage)) for stage in STAGES], median(job.seconds("total")),
                 median(job.clock()), spread(job.clock()), peak, peak / n, job.resident()])
        for what, theory in expected.items():
            if what == "bytes":
                points = [(n, job.number("bytes", "arena_peak")) for n, job in seen]
            else:
                points = [(n, median(job.clock() if what == "process" else job.seconds(what))) for n, job in seen]
                points = [(n, seconds) for n, seconds in points if seconds >= 0.01]
            theory = theory if isinstance(theory, str) else f"{theory:.2g}"
            fits.append([name, of, what, *[points[i][0] if points else math.nan for i in (0, -1)], exponent(points), theory])
    header = ["of", "n", *STAGES, "total", "process", "spread %", "bytes", "bytes/n", "process bytes"]
    for name, cells in rows.items():
        table(f"scaling_{name}", f"Seconds and bytes against the number of {name}", header, cells)
    table("scaling", "Exponents of seconds and bytes against n, over the upper half of its range",
          ["sweep", "of", "what", "from", "to", "exponent", "of the algorithm"], fits,
          "Of the algorithm: without logarithms, n log n being 1 and log n 0.")


# ---------------------------------------------------------------------------------------------------------------- limits
ONE = struct.pack("<3f", 1, 2, 3)
# Files that claim more than they have, by what they claim.
CLAIMS = {
    "2^40.ply": lambda: b"ply\nformat binary_little_endian 1.0\nelement vertex 1099511627776\nproperty float x\n"
                        b"property float y\nproperty float z\nend_header\n" + ONE,
    "2^40.vtk": lambda: b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET POLYDATA\nPOINTS 1099511627776 float\n" + ONE,
    "2^31.bgeo": lambda: b"BgeoV" + struct.pack(">9I", 5, 2 ** 31 - 1, *[0] * 7) + ONE,
    "2^60.vol": lambda: b"VOL\x03" + struct.pack("<5i6f", 1, *[2 ** 20] * 3, 1, -1, -1, -1, 1, 1, 1),
    "zeros.bgeo": lambda: b"".join(gzip.compress(bytes(2 ** 20), mtime=0) for _ in range(256)),  # a thousandth
}


def claim(name):
    made(name, lambda file: file.write(CLAIMS[name]()))
    return LAMP + f"smoke {name} {{\n" + ("" if name.endswith(".vol") else "  radius 1\n  mass 1\n") + "}\n"


TRIANGLE = "p 3\n-1 -1 0\n1 -1 0\n0 1 0\n"


def smoke(**lines):
    """A ball of 1,000 particles; `lines` replace its own."""
    lines = {"radius": 0.155, "mass": 1, "extinction": 0.00838, **lines}
    path = made("ball_1000.vtk", lambda file: write_ball(file, 1000))
    return f"smoke {path.name} {{\n" + "".join(f"  {key} {value}\n" for key, value in lines.items()) + "}\n"


def absurd():
    """(what, text of the scene, options, status)."""
    lit, surface = LAMP + smoke(), LAMP + TRIANGLE
    yield "1,000,000 x 1,000,000 pixels", surface, "--size 1000000x1000000", 2
    yield "65,536 x 65,536 pixels in 64 GB", surface, "--size 65536x65536 --memory 64G", 4
    yield "65,536 x 65,536 pixels of smoke in 64 GB", lit, "--size 65536x65536 --memory 64G", 4
    yield "16,384 x 16,384 pixels in 1 GB", surface, "--size 16384x16384 --memory 1G", 4
    yield "1e15 photons", lit, "--photons 1000000000000000", 2
    yield "1e20 photons", lit, "--photons 100000000000000000000", 2
    yield "1e15 photons in a photon map of 1 GB", lit, "--smoke direct --photons 1000000000000000 --memory 1G", 4
    yield "1,000,000 rays a pixel", lit, "--spp 1000000", 2
    yield "1e12 passes", lit, "--reference --passes 0:1000000000000", 2
    yield "cells of 0.01 smoothing lengths in 1 GB", lit, "--density-step 0.01 --memory 1G", 4
    yield "a chain of 1,000 reflections", surface, "--depth 1000", 2
    yield "1e18 frames", surface, "--frames 0:1000000000000000000", 2
    for name in CLAIMS:
        yield f"{name}, which claims so many" if "^" in name else f"{name}, gzip a thousand times as large", claim(name), "", 3
    yield "mesh that claims 2^40 vertices", "m vertices 1099511627776\n0 0 0\n", "", 3
    yield "mesh that claims 67,108,865 triangles", "m vertices 3\n0 0 0\n1 0 0\n0 1 0\ntriangles 67108865\n0 1 2\n", "", 3
    yield "372,831 spheres of 180 triangles", "s 1 2 3 1\n" * 372831, "", 3
    yield "polygon that claims 2^40 corners", "p 1099511627776\n0 0 0\n", "", 3


def growing():
    """(what grows, x -> (text of the scene, options), status): where it is refused first, if it is."""
    def lamp(distance=4, power=40):
        return f"lp {distance} 0 {distance}  {power} {power} {power}\n"
    yield "photons, kept at nodes", lambda x: (LAMP + smoke(), f"--photons {x:.0f}"), 2
    yield "photons, stored, in 1 GB", lambda x: (LAMP + smoke(), f"--smoke direct --photons {x:.0f} --memory 1G"), 4
    yield "pixels along an edge, in 1 GB", lambda x: (LAMP + TRIANGLE, f"--size {x:.0f}x{x:.0f} --memory 1G"), (2, 4)
    yield "lights about smoke, in 1 GB", lambda x: (lamps(round(min(x, 2 ** 17))) + smoke(), "--memory 1G"), 4
    yield "lights on surfaces, in 1 MB", lambda x: (lamps(round(min(x, 2 ** 17))) + TRIANGLE, "--memory 1M"), 4
    yield "distance of a light from smoke", lambda x: (lamp(distance=x) + smoke(), ""), 3
    yield "distance of a light from surfaces", lambda x: (lamp(distance=x) + TRIANGLE, ""), 3
    yield "intensity of a light in smoke", lambda x: (lamp(power=x) + smoke(), ""), 3
    yield "intensity of a light on surfaces", lambda x: (lamp(power=x) + TRIANGLE, ""), 3
    yield "intensity of 16 lights, by cuts", lambda x: (16 * lamp(power=x) + TRIANGLE, "--lights cuts"), 3
    yield "width of smoke over its smoothing length", lambda x: (LAMP + smoke(radius=f"{2 / x:.9g}"), ""), 3
    yield "area of a particle", lambda x: (LAMP + smoke(extinction=f"{x:.9g}"), ""), 3
    yield "emission", lambda x: (LAMP + smoke(emission=f"{x:.9g} 0 0"), ""), 3
    yield "1 / (1 - phase)", lambda x: (LAMP + smoke(phase=f"{1 - 1 / x:.17g}"), ""), 3
    yield "extinction of a box", lambda x: (LAMP + f"smoke box -1 -1 -1 1 1 1 {x:.9g} {{\n}}\n", ""), 3
    yield "length of a box over its width", lambda x: (LAMP + f"smoke box -1 -1 {-x:.9g} 1 1 {x:.9g} 1 {{\n}}\n", ""), 3
    yield "extent of surfaces over that of another", lambda x: (LAMP + TRIANGLE + f"p 3\n0 0 0\n{x:.9g} 0 1\n0 1 1\n", ""), 3
    yield "diffuse part", lambda x: (LAMP + f"fm 0 0 0 {x:.9g} 0 0 0 0 0 1 0 1\n" + TRIANGLE, ""), 3


def ask(command, text, options, arithmetic):
    """(status, seconds, bytes of the process, lines on standard error); status None: it hung."""
    words = [WISP, command, scene("limit.aff", text), "--arith", arithmetic, *shlex.split(options), "-o", OUT / "limit.pfm", "-q"]
    status, seconds, _, resident, _, error = run_process(words, 20)
    return status, seconds, resident, error.splitlines()


def first_refused(make, arithmetic):
    """The least power of two that `wisp plan` refuses; None: none up to 2^99."""
    low, high = 0, 100  # of the exponents low is taken, high refused or out of question
    while high - low > 1:
        middle = (low + high) // 2
        text, options = make(2.0 ** middle)
        low, high = (middle, high) if ask("plan", text, options, arithmetic)[0] == 0 else (low, middle)
    return high if high < 100 else None


def refusals():
    rows = []
    for arithmetic in ("f32", "f64", "fixed"):
        asked = [(what, text, options, (status,)) for what, text, options, status in absurd()]
        for what, make, status in growing():
            exponent = first_refused(make, arithmetic)
            if exponent is None:
                rows.append([what, "any up to 2^99", arithmetic, 0, math.nan, math.nan, "-"])
            else:
                asked.append((what, *make(2.0 ** exponent), status if isinstance(status, tuple) else (status,), exponent))
        for what, text, options, right, *exponent in asked:
            status, seconds, size, lines = ask("render", text, options, arithmetic)
            message = lines[0].replace(str(SCENES) + "/", "") if lines else "hangs" if status is None else "-"
            rows.append([what, f"2^{exponent[0]}" if exponent else options or "-", arithmetic,
                         -1 if status is None else status, seconds, size, message])
            if status not in right or len(lines) != 1 or size > 2 ** 29:
                failed.append(f"limits, {what}, {arithmetic}: status {status}, {len(lines)} lines, {size} bytes: {message}")
    return sorted(rows, key=lambda row: row[0])


def scaling():
    sweeps = sweep_jobs()
    yield
    tables_of(sweeps)
    table("limits", "What is refused: absurd requests, and the smallest power of two of what grows",
          ["what", "asked", "arithmetic", "status", "seconds", "process bytes", "message"], refusals())
