"""Every row of test/physics/transport.csv that can be measured, by photon walks and by the reference, each to a standard error of
ERROR (0.003) of its value; and the slabs of it as pictures by photons, in which no error is noise alone. In three arithmetics. As
tables, and as build/physics*.csv; walks by row as build/transport_*.csv.

    [ERROR=0.003] [JOBS=2] python3 tools/measure/physics.py

from the top folder, after `make build/tests`: three quarters of an hour.
"""
import csv, math, os, statistics, subprocess, sys, tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from hard_cases import ARITHMETICS
from harness import OUT, read_pfm, table

TESTS = {"photons": "walks reproduce published transport values", "reference": "the reference reproduces published transport values"}
SLABS = ("0.5", "0", "1"), ("1", "0", "1"), ("0.9", "-0.5", "1"), ("0.9", "0.75", "2")
METHODS = {"lines": [], "nearest photons": ["--smoke", "direct"]}
PHOTONS = 1000000


def chi_square_band(n):
    """The middle 99 %, by Wilson and Hilferty's approximation."""
    return [n * (1 - 2 / (9 * n) + side * 2.576 * math.sqrt(2 / (9 * n))) ** 3 for side in (-1, 1)]


def walk(name, arithmetic):
    """The rows of one test: name, value, measured, standard error, deviation, samples; and whether the test passed."""
    ran = subprocess.run(["build/tests", f"-tc={arithmetic}: {TESTS[name]}"], stdout=subprocess.DEVNULL,
                         env={**os.environ, "WISP_ROW_ERROR": os.environ.get("ERROR") or "0.003"})
    with open(f"build/transport_{name}_{arithmetic}.csv") as file:
        return [[row[0], *map(float, row[1:])] for row in list(csv.reader(file))[1:]], ran.returncode == 0


def slab(albedo, g, depth, cosine, reflected):
    """A slab that is lit along its normal by irradiance pi, and seen far from its rims at a cosine: its mean is R or T."""
    half, away = 20, 1000
    side, eye = math.sqrt(1 - cosine * cosine), 1 if reflected else -1
    angle = 2 * math.degrees(math.atan(6 * cosine / away))
    return (f"v from {away * side} 0 {eye * (away * cosine + depth / 2)} at 0 0 {eye * depth / 2} up 0 1 0 angle {angle} "
            f"hither 0.01 resolution 16 16\nld 0 0 -1 {math.pi} {math.pi} {math.pi}\n"
            f"smoke box {-half} {-half} {-depth / 2} {half} {half} {depth / 2} 1 {{\n albedo {albedo} {albedo} {albedo}\n phase {g}\n}}\n")


def pictures(name, arithmetic):
    """For each function of a slab: its row, its value and what pictures give."""
    with open("test/physics/transport.csv") as file:
        value = {row[0]: row[3] for row in csv.reader(file)}
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for albedo, g, depth in SLABS:
            for cosine in "1", ".5", ".1":
                for way in "RT":
                    row = f"slab_a{albedo}_g{g}_t{depth}_{way}({cosine},1)"
                    Path(folder, "s.aff").write_text(slab(albedo, g, float(depth), float(cosine), way == "R"))
                    subprocess.run(["build/wisp", "render", f"{folder}/s.aff", "-q", "-o", f"{folder}/s.pfm", "--spp", "1", "--arith",
                                    arithmetic, "--photons", str(PHOTONS), *METHODS[name]], check=True)
                    *_, pixels = read_pfm(f"{folder}/s.pfm")
                    found.append([row, float(value[row]), sum(pixels) / len(pixels)])
    return found


def main():
    with ThreadPoolExecutor(int(os.environ.get("JOBS") or 2)) as jobs:
        # The longest first.
        walks = {(name, arithmetic): jobs.submit(walk, name, arithmetic)
                 for name in ("reference", "photons") for arithmetic in reversed(ARITHMETICS)}
        seen = {(name, arithmetic): jobs.submit(pictures, name, arithmetic) for name in METHODS for arithmetic in ARITHMETICS}
    passed, of_walks, of_pictures, each = True, [], [], []
    for (name, arithmetic), job in walks.items():
        rows, held = job.result()
        passed = passed and held
        low, high = chi_square_band(len(rows))
        worst = max(rows, key=lambda row: abs(row[4]))
        of_walks.append([name, arithmetic, len(rows), f"{100 * statistics.median(row[3] / row[1] for row in rows):.2f}",
                         f"{sum(row[4] ** 2 for row in rows):.1f}", f"{low:.0f} to {high:.0f}", f"{worst[0]} {worst[4]:+.1f}"])
    for (name, arithmetic), job in seen.items():
        deviation = {row: 100 * (measured / value - 1) for row, value, measured in job.result()}
        worst = max(deviation, key=lambda row: abs(deviation[row]))
        of_pictures.append([name, arithmetic, len(deviation), f"{math.sqrt(statistics.fmean(d * d for d in deviation.values())):.2f}",
                            f"{worst} {deviation[worst]:+.1f}"])
        each += [[name, arithmetic, row, f"{value:.8g}", f"{measured:.6g}"] for row, value, measured in job.result()]
    OUT.mkdir(parents=True, exist_ok=True)  # where table() keeps titles
    build = Path("build")
    table("physics", "Published values of light transport", ["by", "arithmetic", "rows", "standard error %, median", "chi-square",
                                                             "99 % of such are", "largest deviation, standard errors"],
          of_walks, folder=build)
    table("physics_pictures", "Pictures of slabs by photons", ["by", "arithmetic", "rows", "deviation %, root mean square",
                                                               "largest %"], of_pictures, folder=build)
    table("physics_picture_rows", "Pictures of slabs by photons, each", ["by", "arithmetic", "row", "value", "measured"], each,
          printed=False, folder=build)
    sys.exit(0 if passed else 1)


main()
