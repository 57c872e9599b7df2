"""How `direct` converges to `--reference`: relative RMSE beyond the reference's own noise against photons, K, step and gather
radius, for a plume and a dense ball, four phase functions and three albedos (the colour channels of one picture)."""
import os

from harness import OUT, WISP, Job, channel, compare, median, picture, render, table

PASSES = int(os.environ.get("PASSES") or 6400)
ALBEDOS = "0.5", "0.9", "1"
OBJECTS = {"plume": ("v from 10 -45 30 at 26 10 13 up 1 0 0 angle 40", "lp 60 -20 40  9000 9000 9000", "plume.vtk", 0.65, 1, 0.6),
           "ball": ("v from 0 -6 1 at 0 0 0 up 0 0 1 angle 20", "lp 3 -4 3  30 30 30", "ball.ply", 0.18, 0.01, 6)}
# Photons, K, step and gather radius.
SETTINGS = [(20000, 50, 0.5, 2), (80000, 50, 0.5, 2), (320000, 50, 0.5, 2), (1280000, 50, 0.5, 2), (320000, 10, 0.5, 2),
            (320000, 500, 0.5, 2), (320000, 50, 1, 2), (320000, 50, 0.25, 2), (320000, 500, 0.5, 1), (1280000, 500, 0.5, 0.5)]


def convergence():
    cases = []
    for name, (view, light, file, radius, mass, extinction) in OBJECTS.items():
        for g in (0, 0.5, -0.5, 0.9):
            scene = OUT / f"convergence_{name}_{g}.aff"
            scene.write_text(f"{view} hither 0.1 resolution 16 16\n{light}\nsmoke ../../fixtures/{file} {{\n  radius {radius}\n"
                             f"  mass {mass}\n  extinction {extinction}\n  albedo {' '.join(ALBEDOS)}\n  phase {g}\n}}\n")
            passes = scene.with_suffix(f".{PASSES}.passes")
            reference = Job(f"convergence_reference_{name}_{g}_{PASSES}", [WISP, "render", scene, "--reference", "--passes",
                            f"0:{PASSES}", "-o", passes], reads=(scene,), makes=(passes,), runs=1, lasting=True)
            truth, error = (passes.with_suffix(f".{kind}.pfm") for kind in ("mean", "error"))
            merged = Job(f"convergence_merged_{name}_{g}_{PASSES}", [WISP, "merge", passes, "-o", truth, "--error-out", error],
                         makes=(truth, error), runs=1, after=(reference,))
            jobs = [(setting, render(f"convergence_{name}_{g}_{i}", scene, "--smoke direct --photons {} --gather {} --step {} "
                                     "--gather-radius {}".format(*setting), runs=1)) for i, setting in enumerate(SETTINGS)]
            cases.append((name, g, merged, truth, error, jobs))
    yield
    rows = []
    for name, g, merged, truth, error, jobs in cases:
        if not merged.good():
            continue
        greys = [(channel(truth, c), channel(error, c)) for c in range(3)]
        for setting, job in jobs:
            for albedo, c, (grey, noise) in zip(ALBEDOS, range(3), greys):
                figures = [compare(channel(picture(job), c), grey, figure, "--error", noise) if job.good() else None
                           for figure in ("beyond the noise of B", "relative noise of B")]
                rows.append([name, g, albedo, *setting, *figures, median(job.seconds("total"))])
    table("convergence", f"direct against {PASSES} passes of the reference, 16 x 16",
          ["object", "g", "albedo", "photons", "K", "step", "radius", "relative RMSE beyond noise", "noise of the reference",
           "seconds"], rows)
