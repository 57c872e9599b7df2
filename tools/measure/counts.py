"""What does not depend on the machine: instructions, counted by valgrind."""
import re, shutil, subprocess

from harness import OUT, WISP, Job, failed, skipped, table
import smoke

# The function that a stage is.
STAGES = {"trees and resampling": "make_medium", "light depths": "make_optical_depth_grid", "photons": "trace_fluence",
          "irradiance": "make_irradiance", "march": "march"}


def callgrind(name, scene, *options):
    """A job whose instructions valgrind counts, and the file that holds them."""
    file = OUT / f"{name}.callgrind"
    words = [word for option in options for word in option.split()]
    return Job(name, ["valgrind", "--tool=callgrind", f"--callgrind-out-file={file}", WISP, "render", scene, *words,
                      "-o", OUT / f"{name}.pfm", "-q"], reads=(WISP, scene), makes=(file,), runs=1), file


def instructions():
    if not shutil.which("valgrind"):
        skipped("Instructions", "install valgrind")
        return
    n = smoke.photons(100000)
    job, file = callgrind("instructions", smoke.scene(smoke.SHORTCUTS), "--size 64x64", smoke.DEFAULT, smoke.UNIFORM, n)
    yield
    if not job.good():
        return
    text = subprocess.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", file], capture_output=True,
                          text=True).stdout
    everything, most = 0, dict.fromkeys(STAGES, 0)
    for line in text.splitlines():
        count = re.match(r"\s*([\d,]+)", line)
        count = int(count[1].replace(",", "") or 0) if count else 0
        if "PROGRAM TOTALS" in line:
            everything = count
        # Inclusive, so that the largest of a name holds the others: its clones, and what it calls. Where callgrind takes a
        # jump for a call of itself ('2 behind the name), it counts that again and again.
        for stage, function in STAGES.items():
            if f"::{function}(" in line and not re.search(r"'\d+ ", line):
                most[stage] = max(most[stage], count)
    failed.extend(f"instructions: there is no {STAGES[stage]}()" for stage, count in most.items() if count == 0)
    most["all else"] = everything - sum(most.values())
    table("instructions", f"Instructions by stage: {smoke.SHORTCUTS} at 64 x 64, {n}", ["stage", "million", "% of all"],
          [[stage, count / 1e6, 100 * count / everything] for stage, count in most.items()])


# ------------------------------------------------------------------------------------------------- what small scenes need
VIEW = "v from 0 2 7 at 0 1 0 up 0 1 0 angle 40 hither 0.1 resolution 48 36\nb 0.1 0.1 0.2\n"
LIGHT = "lp 3 5 3  50 50 50\n"
FLOOR = "p 4  -4 0 4  4 0 4  4 0 -4  -4 0 -4\n"
MATTE, MIRROR = "fm 0 0 0  0.7 0.7 0.7  0 0 0  1 0 1\n", "fm 0 0 0  0.4 0.4 0.4  0.5 0.5 0.5  20 0 1\n"
BALL = "s 0 1 0 0.6\n"
MOVING = ("a 0 1 2\nx thing { " + BALL + " }\n"
          "k thing { transl 4  0 0 0 0 0 0 0  0 0 0 0 0 0 0  1 1 0 0 0 0 0  1 1 0 0 0 0 0 }\n")


def fog(albedo, phase=0):
    return f"smoke box -1.5 0.5 -1.5 1.5 2 1.5 0.4 {{ albedo {albedo} {albedo} {albedo} phase {phase} }}\n"


NEEDS = [("background alone", ""), ("a light", LIGHT), ("floor and ball without a light", MATTE + FLOOR + BALL),
         ("floor and ball", LIGHT + MATTE + FLOOR + BALL), ("... the floor mirrors", LIGHT + MIRROR + FLOOR + MATTE + BALL),
         ("... the ball moves", LIGHT + MATTE + FLOOR + MOVING), ("black smoke", LIGHT + fog(0)), ("smoke", LIGHT + fog(0.9)),
         ("smoke without a light", fog(0.9)), ("... of phase 0.5", LIGHT + fog(0.9, 0.5)),
         ("smoke beside floor and ball", LIGHT + MATTE + FLOOR + BALL + fog(0.9)),
         ("black smoke beside floor and ball", LIGHT + MATTE + FLOOR + BALL + fog(0)),
         ("smoke beside mirroring floor and moving ball", LIGHT + MIRROR + FLOOR + MATTE + MOVING + fog(0.9))]


def needs():
    """Model only what a scene needs: scenes that differ by one thing each."""
    if not shutil.which("valgrind"):
        skipped("Needs", "install valgrind")
        return
    same, jobs = "--spp 1 --photons 20000 --frames 0", []
    for i, (name, statements) in enumerate(NEEDS):
        scene = OUT / f"needs_{i}.aff"
        scene.write_text(VIEW + statements)
        jobs.append((name, scene, callgrind(f"needs_{i}", scene, same)))
    yield
    rows = []
    for name, scene, (job, file) in jobs:
        plan = subprocess.run([WISP, "plan", scene, "--photons", "20000", "--frames", "0"], capture_output=True, text=True).stdout
        stages = re.findall(r"^(?!arena|picture)(\S.*?)  +yes ", plan, re.M)
        arena = re.search(r"^arena\s+yes\s+(\d+)", plan, re.M)
        total = re.search(r"^(?:summary|totals): (\d+)", file.read_text(), re.M) if job.good() else None
        rows.append([name, int(arena[1]) if arena else None, int(total[1]) / 1e6 if total else None, "; ".join(stages)])
    table("needs", "What small scenes that differ by one thing need: 48 x 36, 1 ray a pixel, 20,000 photons",
          ["scene", "arena bytes", "million instructions", "stages"], rows)
