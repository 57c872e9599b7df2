"""What --thin leaves out, how much sooner the picture is there, and how far off it is: a plume (frame 100 at rate 400), the same
with masses that halve every 10 frames, and that with one particle in 200 strayed."""
import random, re, struct

import smoke
from harness import OUT, compare, median, picture, render, table


def faded(plume, stray):
    """A VTK file of the plume with masses; of every `stray` particles one is anywhere in a larger box."""
    data = plume.read_bytes()
    points = re.search(rb"POINTS (\d+) float\n", data)
    n, at = int(points[1]), points.end()
    x = list(struct.unpack_from(f">{3 * n}f", data, at))
    if stray:
        drawn = random.Random(1)
        for i in range(0, n, stray):
            x[3 * i:3 * i + 3] = drawn.uniform(-10, 70), drawn.uniform(-20, 40), drawn.uniform(-20, 40)
    masses = struct.pack(f">{n}f", *(0.5 ** ((n - i) / 4000) for i in range(1, n + 1)))
    return data[:at] + struct.pack(f">{3 * n}f", *x) + data[at + 12 * n:] + b"SCALARS mass float 1\nLOOKUP_TABLE default\n" + masses + b"\n"


def thin():
    plume, jobs = smoke.particles(400, 100), []
    text = re.sub(r"^smoke .*", "smoke FILE {", open("fixtures/table2.aff").read(), flags=re.M)
    for name, stray in (("plume", None), ("faded", 0), ("strayed", 200)):
        file, scene = plume, OUT / f"thin_{name}.aff"
        if stray is not None:
            file, text = OUT / f"thin_{name}.vtk", re.sub(r"^  mass.*\n", "", text, flags=re.M)
            file.write_bytes(faded(plume, stray))
        scene.write_text(text.replace("FILE", file.name))
        same = "--size 250x250 --smoke map --deposit path --photons"
        other = render(f"thin_{name}_seed", scene, same, "1000000 --seed 2", runs=1, reads=(file,))
        jobs.append((name, other, [(epsilon, *(render(f"thin_{name}_{n}_{epsilon}", scene, same, f"{n} --thin {epsilon}", reads=(file,))
                                               for n in (0, 1000000))) for epsilon in (0, 0.001, 0.01, 0.1)]))
    yield
    rows = []
    for name, other, steps in jobs:
        _, exact, bright = steps[0]
        whole = exact.number("smoke", "particles")
        for epsilon, single, full in steps:
            rows.append([name, epsilon, f"{whole - single.number('smoke', 'particles')} of {whole}", median(single.processor()),
                         median(full.processor()), compare(picture(single), picture(exact)), compare(picture(full), picture(bright)),
                         compare(picture(other), picture(full))])
    table("thin", "What --thin leaves out: particle map, 250 x 250, seconds of the processor",
          ["smoke", "EPS", "left out", "seconds", "with photons", "RMSE", "RMSE with photons", "another seed"], rows)
