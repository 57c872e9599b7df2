#!/usr/bin/env python3
"""Single scattering in a density grid by POV-Ray's media, beside wisp without photons: seconds against error, as CSV.

    python3 tools/peers/povray.py FOLDER VOL [--quick]

VOL is the grid plume.vol, which has single_g05.pfm beside it: the picture that both are held against. FOLDER takes scenes
and pictures. From the top folder, after `make`. Seconds are what each says of itself, without reading the scene. Single
scattering alone, because POV-Ray scatters again by photons that have no units.

single_g05.pfm has four rays a pixel, as `--spp 4`, and is 0.04 % from `--smoke direct --arith f64 --step 0.125`. One ray a
pixel cannot come nearer to it than 0.6 %.
"""
import json
import math
import re
import struct
import subprocess
import sys
from array import array
from pathlib import Path

WISP = "build/wisp"
SIDE, EXTINCTION, ALBEDO, G, INTENSITY = 250, 60.0, 0.9, 0.5, 10.0
LIGHT = "1.5", "2.5", "1.5"
HALF = math.tan(math.radians(15))  # half of the picture, between its outer edges, at distance 1
SCALE = 16.0  # of radiance in POV-Ray's pictures, which end at 1


def fail(text: str):
    sys.exit(f"povray.py: {text}")


def swapped(values: array, order: str) -> array:
    """Between the machine's byte order and that of a file."""
    if sys.byteorder != order:
        values.byteswap()
    return values


def read_vol(path: Path):
    """Cells along x, y, z, the box's corners, and the density, x fastest."""
    data = path.read_bytes()
    if len(data) < 48 or data[:8] != b"VOL\3\1\0\0\0":
        fail(f"{path}: expected VOL version 3 with float32")
    *n, channels = struct.unpack("<4i", data[8:24])
    if channels != 1 or len(data) != 48 + 4 * math.prod(n):
        fail(f"{path}: {len(data)} bytes and {channels} channels, expected {48 + 4 * math.prod(n)} and 1")
    box = struct.unpack("<6f", data[24:48])
    return n, box[:3], box[3:], swapped(array("f", data[48:]), "little")


def write_df3(path: Path, n, density) -> float:
    """The grid as a df3: big-endian, x fastest, in parts of its largest density, which is returned.

    16 bits err by 2^-17 of the largest density at most: 0.001 in the optical depth of the longest ray. POV-Ray's sample i lies
    at i / n of the unit cube, and the last one's neighbour is the first; a border of repeated samples keeps that outside.
    """
    largest = max(density)
    x, y, z = ([0, *range(count), count - 1] for count in n)
    rows = ((k * n[1] + j) * n[0] for k in z for j in y)
    values = array("H", (round(density[row + i] / largest * 65535) for row in rows for i in x))
    path.write_bytes(struct.pack(">3H", *(count + 2 for count in n)) + swapped(values, "big").tobytes())
    return largest


def parts_around(n, low, cell, density) -> str:
    """Boxes around what is not empty in each quarter of the height: POV-Ray wastes no samples outside."""
    boxes = []
    for quarter in range(4):
        y0, y1 = (n[1] * k // 4 for k in (quarter, quarter + 1))
        filled = [i for j in range(max(y0 - 1, 0), min(y1 + 1, n[1])) for k in range(n[2])
                  for i in range((k * n[1] + j) * n[0], (k * n[1] + j + 1) * n[0]) if density[i] > 0]
        if not filled:
            continue
        x, z = [i % n[0] for i in filled], [i // n[0] // n[1] for i in filled]
        # A sample, in the middle of its cell, reaches to its neighbours. Parts overlap, so that merging leaves no seam.
        first = (max(min(x) - 0.5, 0), y0 - 0.001, max(min(z) - 0.5, 0))
        last = (min(max(x) + 1.5, n[0]), y1 + 0.001, min(max(z) + 1.5, n[2]))
        corners = (vector(low[k] + p[k] * cell[k] for k in range(3)) for p in (first, last))
        boxes.append("box { " + " ".join(corners) + " }")
    return "merge { " + " ".join(boxes)


def vector(values) -> str:
    return "<" + ", ".join("%.9g" % value for value in values) + ">"


def write_pov(path: Path, shape: str, n, low, cell, largest: float, intervals: int):
    """wisp's scene. `intervals` with one sample in the middle of each is the midpoint rule: of POV-Ray's ways to sample media
    the nearest to the truth for its time. Method 1 is noise; method 3, the default, leaves out the end of each interval.
    """
    # POV-Ray's light at distance d is colour 2 / (1 + (d / fade)^2), so colour = I / (2 fade^2) gives I / (d^2 + fade^2):
    # I / d^2 to 1e-6. Its phase function lacks the 1 / 4 pi, and its eccentricity has the sign of g: above 0 is forward.
    fade = 1e-3
    colour = SCALE * INTENSITY / (4 * math.pi) / (2 * fade * fade)
    sigma = EXTINCTION * largest
    path.write_text(f"""#version 3.7;
global_settings {{ assumed_gamma 1 }}
background {{ rgb 0 }}
camera {{ location <0, 1, 4.5> direction <0, 0, -1> right <{2 * HALF}, 0, 0> up <0, {2 * HALF}, 0> }}
light_source {{ <{", ".join(LIGHT)}> rgb {colour} fade_distance {fade} fade_power 2 }}
{shape}
  pigment {{ rgbt 1 }}
  hollow
  interior {{ media {{
    method 2 intervals {intervals} samples 1, 1 jitter 0
    scattering {{ 5, {ALBEDO * sigma} eccentricity {G} extinction 1 }}
    absorption {(1 - ALBEDO) * sigma}
    density {{
      density_file df3 "grid.df3" interpolate 1
      density_map {{ [0 rgb 0] [1 rgb 1] }}
      scale {vector((n[k] + 2) * cell[k] for k in range(3))}
      translate {vector(low[k] - 0.5 * cell[k] for k in range(3))}
    }}
  }} }}
}}
""")


def read_ppm(path: Path):
    """Side and values of POV-Ray's picture, 0 to 65535."""
    data = path.read_bytes()
    head = re.match(rb"P6\s+(?:#.*\n)*(\d+)\s+(\d+)\s+65535\s", data)
    if not head:
        fail(f"{path}: expected a PPM with 16 bits")
    values = swapped(array("H", data[head.end():]), "big")
    if max(values) == 65535:
        fail(f"{path}: clipped at {1 / SCALE}, expected less")
    return int(head.group(1)), values


def write_pfm(path: Path, pixels: int, scale: float, side: int, values):
    """A square of means of rays a pixel, rows from the bottom. 16 bits err by 2^-17 / scale at most."""
    rays = side // pixels
    rows = range(rays)
    means = array("f", (
        sum(values[3 * ((y * rays + j) * side + x * rays + i) + c] for j in rows for i in rows) / (65535 * scale * rays * rays)
        for y in reversed(range(pixels)) for x in range(pixels) for c in range(3)))
    path.write_bytes(b"PF\n%d %d\n-1.0\n" % (pixels, pixels) + swapped(means, "little").tobytes())


def run(command, folder=None) -> str:
    done = subprocess.run([str(word) for word in command], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        fail(f"{command[0]}: status {done.returncode}: {done.stderr.strip()[-500:]}")
    return done.stdout + done.stderr


def trace_povray(folder: Path, scene: str, side: int) -> float:
    """Renders a scene of FOLDER to povray.ppm there; the seconds of its rays."""
    said = run(["povray", f"+I{scene}", "+Opovray.ppm", "+FP", "Bits_Per_Color=16", "File_Gamma=1.0",
                f"+W{side}", f"+H{side}", "+WT1", "-A", "-D", "-V"], folder)
    return float(re.search(r"Trace Time:.*\(([\d.]+) seconds", said).group(1))


def render_povray(folder: Path, setting) -> float:
    rays, intervals = setting
    seconds = trace_povray(folder, f"grid_{intervals}.pov", rays * SIDE)
    write_pfm(folder / "picture.pfm", SIDE, SCALE, *read_ppm(folder / "povray.ppm"))  # 16 bits: 0.03 % of plume.vol's mean
    return seconds


def trace_wisp(folder: Path, scene: Path, *options):
    """Renders a scene to picture.pfm in FOLDER; the seconds of its stages, and the counts of the frame."""
    (folder / "picture.pfm").unlink(missing_ok=True)
    run([WISP, "render", scene, *options, "-o", folder / "picture.pfm", "--stats", folder / "wisp.json", "-q"])
    frame = json.loads((folder / "wisp.json").read_text())["frames"][0]
    return sum(frame["seconds"][stage] for stage in ("trees", "photons", "irradiance", "render")), frame


def render_wisp(folder: Path, setting) -> float:
    return trace_wisp(folder, folder / "grid.aff", "--photons", "0", *setting.split())[0]


def comparison(picture: Path, truth: Path):
    said = subprocess.run([WISP, "compare", picture, truth, "--json", "-"], capture_output=True, text=True)
    if said.returncode > 1:
        fail(said.stderr.strip())
    return json.loads(said.stdout)


def main():
    names = [word for word in sys.argv[1:] if word != "--quick"]
    if len(names) != 2:
        fail("expected FOLDER VOL [--quick]")
    quick, folder, vol = "--quick" in sys.argv, Path(names[0]), Path(names[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    n, low, high, density = read_vol(vol)
    cell = [(high[k] - low[k]) / n[k] for k in range(3)]
    largest = write_df3(folder / "grid.df3", n, density)

    # Rays a pixel along each side, and intervals.
    povray = [(1, 10), (1, 20), (1, 40), (1, 60), (2, 60)]
    wisp = ["--spp 1 --density-step 1", "--density-step 1", "", "--light-step 1.1 --step 0.5", "--step 0.5", "--step 0.25"]
    if quick:
        povray, wisp = povray[:2], wisp[:4]
    shape = parts_around(n, low, cell, density)
    for _, intervals in povray:
        write_pov(folder / f"grid_{intervals}.pov", shape, n, low, cell, largest, intervals)
    # `angle` spans the centres of the first and the last row.
    angle = 2 * math.degrees(math.atan(HALF * (SIDE - 1) / SIDE))
    (folder / "grid.aff").write_text(f"""v from 0 1 4.5 at 0 1 0 up 0 1 0 angle {angle} hither 0.1 resolution {SIDE} {SIDE}
lp {" ".join(LIGHT)}  {INTENSITY} {INTENSITY} {INTENSITY}
smoke {vol} {{
  extinction {EXTINCTION}
  albedo {ALBEDO} {ALBEDO} {ALBEDO}
  phase {G}
}}
""")

    jobs = [(render_povray, "POV-Ray media", s, f"rays {s[0] ** 2} intervals {s[1]}") for s in povray]
    jobs += [(render_wisp, "wisp", s, s or "default") for s in wisp]
    print("program,setting,s,relative RMSE against single_g05.pfm")
    for render, program, options, setting in jobs:
        seconds = render(folder, options)
        print(f"{program},{setting},{seconds:.3f},"
              f"{comparison(folder / 'picture.pfm', vol.with_name('single_g05.pfm'))['relative_rmse']:.5f}")


if __name__ == "__main__":
    try:
        main()
    except OSError as error:
        fail(str(error))
