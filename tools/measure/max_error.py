#!/usr/bin/env python3
"""Whether `wisp render --max-error E` keeps what it promises: twelve scenes, each rendered so that it errs by E at most, and then
held against passes of the reference that the choice did not see. Says how many err by more, and how many by less than a third.

    tools/measure/max_error.py [--wisp build/wisp] [--error 0.05] [--seconds 60]

The reference has a noise of half the error, unless that takes more seconds a scene; noisier than the error it tells nothing.
"""
import argparse
import json
import subprocess
import time
from pathlib import Path

VIEW = "v from 0 0 6 at 0 0 0 up 0 1 0 angle 26 hither 0.1 resolution 32 32\n"
LIGHT = "lp 3 4 3 40 40 40\n"
FIRST = 1 << 23  # passes that no choice takes


def box(extinction, phase, look=" albedo 0.9 0.9 0.9\n", light=LIGHT):
    return VIEW + light + f"smoke box -1 -1 -1 1 1 1 {extinction} {{\n{look} phase {phase}\n}}\n"


# Of fixtures, and boxes.
SCENES = {
    "demo": "demo.aff",
    "small": "small.aff",
    "wake": "wake.aff --frames 0",
    "glow": "glow.aff",
    "forward": "forward.aff",
    "grid": "grid.aff",
    "box at a triangle": box(3, 0.3) + "f 0.5 0.5 0.5 1 0 0 0 1\np 3  -1 -2 -1  1 -2 -1  1 2 -1\n",
    "thin box": box(0.2, 0),
    "box": box(3, 0.5),
    "dense box": box(20, 0),
    "box lit from behind": box(2, 0.7, light="lp 1 0.5 -3 40 30 20\n"),
    "black glowing box": box(2, 0, " albedo 0 0 0\n emission 1 0.5 0.2\n"),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wisp", default="build/wisp")
    parser.add_argument("--error", type=float, default=0.05)
    parser.add_argument("--seconds", type=float, default=60)
    options = parser.parse_args()
    folder = Path("build/max_error")
    folder.mkdir(parents=True, exist_ok=True)

    def wisp(*words):
        return subprocess.run([options.wisp, *map(str, words)], capture_output=True, text=True)

    more = less = unknown = 0
    for name, source in SCENES.items():
        if "\n" in source:
            scene = [folder / "scene.aff"]
            scene[0].write_text(source)
        else:
            scene = ["fixtures/" + source.split()[0], *source.split()[1:], "--size", "32x24"]
        picture, truth, errors = (folder / f"{part}.pfm" for part in ("picture", "truth", "errors"))
        begin = time.monotonic()
        ran = wisp("render", *scene, "--max-error", options.error, "-o", picture)
        seconds = time.monotonic() - begin
        said = [line for line in ran.stderr.splitlines() if line.startswith("max-error:")]
        if ran.returncode or not said:
            print(f"{name}: status {ran.returncode}: {ran.stderr}")
            more += 1
            continue
        passes = 500
        while True:
            begin = time.monotonic()
            wisp("render", *scene, "--reference", "--passes", f"{FIRST}:{FIRST + passes}", "-q", "-o", truth, "--error-out", errors)
            took = time.monotonic() - begin
            ran = wisp("compare", picture, truth, "--error", errors, "--tolerance", 1e9, "--json", "-")
            figures = json.loads(ran.stdout)
            if figures["relative_noise"] <= options.error / 2 or 4 * took > options.seconds:
                break
            passes *= 4
        error, noise = figures["relative_rmse_beyond_noise"], figures["relative_noise"]
        if noise > options.error:
            unknown += 1
        else:
            more += error > options.error
            less += error < options.error / 3
        print(f"{name}: {error:.2%} beyond noise of {noise:.2%}, {seconds:.1f} s; {said[-1]}", flush=True)
    print(f"\n{len(SCENES)} scenes, asked for {options.error:.1%}: {more} err by more, {less} by less than a third, "
          f"{unknown} are not known: the reference is noisier")
    return 0 if more <= 1 else 1


if __name__ == "__main__":
    raise SystemExit(main())
