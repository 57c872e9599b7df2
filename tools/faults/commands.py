"""The commands that are disturbed, the files that they read, and what an undisturbed run makes of them."""
import os, re, shutil, subprocess, time
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

TOP = Path(__file__).resolve().parents[2]
OLD = b"what was there before\n"
SECONDS = 60  # a run that takes longer hangs


def puff(seed):
    numbers = []
    for _ in range(120):
        seed = (seed * 1664525 + 1013904223) % 2**32
        numbers.append(f"{(seed >> 8) * 2**-24 - 0.5:.9f}")
    return "# vtk DataFile Version 3.0\npuff\nASCII\nDATASET POLYDATA\nPOINTS 40 float\n" + " ".join(numbers) + "\n"


VIEW = "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 16 12\nb 0.1 0.1 0.2\nlp 3 3 3 40 40 40\n"
SMOKE = "smoke puff_%04d.vtk {\n radius 0.2\n mass 1\n extinction 0.02\n}\nrender photons 3000\n"
SURFACES = ("f 0.9 0.8 0.7 0.6 0.3 10 0 0\np 4  -2 -1 2  2 -1 2  2 -1 -2  -2 -1 -2\n"
            "tt checker.ppm  -1 -1 -1 0 0  1 -1 -1 1 0  0 1 -1 0 1\ntt 2.png  -1 -1 1 0 0  1 -1 1 1 0  0 0 1 0 1\n")

# Name, words, status. `../inputs` has what is read; what is made is in the folder where the command runs.
COMMANDS = [
    ("picture", "render ../inputs/smoke.aff -o a.png -o a.pfm -o a.exr --digest --stats a.json", 0),
    ("layers", "render ../inputs/both.aff --layers -o a.pfm -o a.exr", 0),
    ("sequence", "render ../inputs/frames.aff -o a_%04d.pfm -o a_%04d.png -o a_%04d.exr", 0),
    ("kept sequence", "render ../inputs/frames.aff -o a_%04d.pfm -o a_%04d.png -o a_%04d.exr", 0),
    ("map out", "render ../inputs/smoke.aff --smoke map --map-out a.map -o a.pfm", 0),
    ("map in", "render ../inputs/smoke.aff --smoke map --map-in ../inputs/whole.map -o a.pfm", 0),
    ("passes", "render ../inputs/smoke.aff --reference --passes 0:2 -o a.passes --error-out e.pfm", 0),
    ("merge passes", "merge ../inputs/0.passes ../inputs/1.passes -o a.pfm --error-out e.pfm --digest", 0),
    ("merge maps", "merge ../inputs/0.map ../inputs/1.map -o a.map", 0),
    ("stitch", "stitch ../inputs/left.pfm ../inputs/right.pfm -o a.png -o a.exr", 0),
    ("compare", "compare ../inputs/0.pfm ../inputs/1.exr --diff a.png --json a.json", 1),
    ("plan", "plan ../inputs/packed.bgeo --write-scene a.aff", 0),
    ("info", "info ../inputs/1.exr --json", 0),
    ("numbered smoke", "render ../inputs/puff_%04d.vtk --size 8x6 --photons 500 -q -o a_%04d.png", 0),
]
INPUTS = [
    "render smoke.aff -o 0.pfm",
    "render smoke.aff --seed 2 -o 1.exr -o 2.png",
    "render smoke.aff --smoke map --map-out whole.map --stats - -q",
    "render smoke.aff --smoke map --photons 9000 --batches 0:1 --map-out 0.map",
    "render smoke.aff --smoke map --photons 9000 --batches 1:3 --map-out 1.map",
    "render smoke.aff --reference --passes 0:1 -o 0.passes",
    "render smoke.aff --reference --passes 1:2 -o 1.passes",
    "render smoke.aff --crop 0,0,7,12 -o left.pfm",
    "render smoke.aff --crop 7,0,16,12 -o right.pfm",
]


class Ran:
    """What came of a run: status below 0 where a signal ended it, None where it hung."""

    def __init__(self, words, folder, environment={}, before=None):
        with subprocess.Popen(words, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              env={**os.environ, **environment}, preexec_fn=before) as process:
            self.take(process)

    @classmethod
    def of(cls, process):
        ran = cls.__new__(cls)
        ran.take(process)
        return ran

    def take(self, process):
        self.wrong = []
        try:
            out, err = process.communicate(timeout=SECONDS)
            self.status = process.returncode
        except subprocess.TimeoutExpired:
            process.kill()
            out, err = process.communicate()
            self.status = None
        self.out, self.err = out or b"", (err or b"").decode(errors="replace")


@dataclass
class Trial:
    kind: str
    what: str  # repeats it
    allowed: set  # exit statuses
    run: Callable  # (command, folder): Ran
    parts: bool = False  # FILE.part may be left


def without_seconds(content):
    return re.sub(rb'"seconds": *\{[^}]*\}', b"", content)


class Command:
    def __init__(self, name, words, status, wisp, place):
        self.name, self.status, self.place = name, status, place
        self.words = [str(wisp)] + words.split()
        folder = self.new_folder("undisturbed", {})
        began = time.monotonic()
        ran = Ran(self.words, folder)
        self.seconds = time.monotonic() - began
        assert ran.status == status, f"{name}: {ran.err}"
        self.out, self.right = ran.out, self.contents(folder)
        self.before = self.right if name.startswith("kept") else dict.fromkeys(self.right, OLD)

    def new_folder(self, name, files=None):
        folder = self.place / f"{self.name} {name}".replace(" ", "_")
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for file, content in (self.before if files is None else files).items():
            (folder / file).write_bytes(content)
        return folder

    @staticmethod
    def contents(folder):
        return {path.name: without_seconds(path.read_bytes()) for path in folder.iterdir()}

    @staticmethod
    def remove(folder):
        shutil.rmtree(folder)

    def wrong(self, ran, folder, trial):
        """What is wrong with what a disturbed run has left, as a list of sentences."""
        wrong, contents = [], self.contents(folder)
        if ran.status is None:
            return ["it hangs"]
        if ran.status not in trial.allowed:
            wrong.append(f"status {ran.status}, expected one of {sorted(trial.allowed)}: {ran.err[-200:]!r}")
        if ran.status == self.status:
            wrong += [f"{name} is wrong though the status is {ran.status}"
                      for name, right in self.right.items() if contents.get(name) != right]
            if without_seconds(ran.out) != without_seconds(self.out):
                wrong.append("standard output is another")
        elif ran.status > 0 and not re.fullmatch(r"(kept [^\n]+\n)?[^\n]+: error: [^\n]+\n", ran.err):
            wrong.append(f"standard error is {ran.err!r}, expected one line")
        for name, content in contents.items():
            if name.endswith(".part"):
                wrong += [] if trial.parts else [f"{name} is left"]
            elif content not in (self.right.get(name), self.before.get(name)):
                wrong.append(f"{name} is neither as before nor right")
        wrong += [f"{name} is gone" for name in self.before if name not in contents]
        return wrong

    def wrong_again(self, folder):
        """What is wrong after an undisturbed run in a folder that a disturbed one has left."""
        return ["then undisturbed: " + what for what in self.wrong(Ran(self.words, folder), folder, Trial("", "", {self.status}, None))]


def make_commands(wisp, place, wanted):
    shutil.rmtree(place, ignore_errors=True)
    inputs = place / "inputs"
    inputs.mkdir(parents=True)
    for frame in range(2):
        (inputs / f"puff_{frame:04d}.vtk").write_text(puff(9 + frame))
    shutil.copy(TOP / "fixtures/checker.ppm", inputs)
    shutil.copy(TOP / "test/corpus/particles/bgeo_gzip.bgeo", inputs / "packed.bgeo")
    (inputs / "smoke.aff").write_text(VIEW + SMOKE)
    (inputs / "frames.aff").write_text(VIEW + "a 0 1 2\n" + SMOKE)
    (inputs / "both.aff").write_text(VIEW + SURFACES + SMOKE)
    for words in INPUTS:
        ran = Ran([str(wisp)] + words.split(), inputs)
        assert ran.status == 0, f"{words}: {ran.err}"
    return [Command(name, words, status, wisp, place) for name, words, status in COMMANDS if wanted in (None, name)]
