#!/usr/bin/env python3
"""A scene of polygons, lights and mirrors by POV-Ray and by wisp: seconds, shadow rays and how far the pictures are apart, as CSV.

    python3 tools/peers/povray_surfaces.py FOLDER SCENE.nff [--size N] [--depth D] [--runs R]

SCENE has statements `p`, `pp`, `l`, `f`, `b` and `v`. FOLDER takes the scene as POV-Ray reads it, and pictures. From the top
folder, after `make`. Each sends one ray a pixel through its middle, with one thread. Seconds are those of POV-Ray's rays alone,
and those of wisp's trees and rays, the median of R runs in turn. Light that is reflected totally POV-Ray sends on whole, wisp
with the surface's transmission.
"""
import argparse
import math
import statistics
from pathlib import Path

from povray import comparison, fail, read_ppm, trace_povray, trace_wisp, vector, write_pfm

SCALE = 0.125  # of radiance in POV-Ray's picture, which ends at 1
LEAST_WEIGHT = 0.01  # of a ray that wisp follows (min_ray_weight)


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(a):
    return [x / math.sqrt(dot(a, a)) for x in a]


def triangles_of(corners):
    """Numbers of a polygon's corners, three by three: an ear that holds no other corner is cut off until three are left."""
    points = [corner[:3] for corner in corners]
    normal = [0, 0, 0]
    for a, b in zip(points, points[1:] + points[:1]):
        normal = [x + y for x, y in zip(normal, cross(a, b))]

    def area(a, b, c):
        return dot(cross(minus(points[b], points[a]), minus(points[c], points[a])), normal)

    def is_ear(a, b, c):
        return area(a, b, c) > 0 and not any(area(a, b, k) >= 0 and area(b, c, k) >= 0 and area(c, a, k) >= 0
                                             for k in left if k not in (a, b, c))

    left, found = list(range(len(points))), []
    while len(left) > 3:
        i = next((i for i in range(len(left)) if is_ear(left[i - 1], left[i], left[(i + 1) % len(left)])), 0)
        found.append((left[i - 1], left[i], left[(i + 1) % len(left)]))
        del left[i]
    return found + [tuple(left)]


def read_nff(path: Path):
    """Camera, lights, and for each `f` its numbers and its triangles: three corners of 3 or, with normals, 6 numbers."""
    view, lights, groups = {}, [], []
    lines = iter(path.read_text().splitlines())
    for line in lines:
        key, *words = line.split() or [""]
        numbers = [float(word) for word in words]
        if key in ("b", "from", "at", "up", "angle"):
            view[key] = numbers
        elif key == "l":
            lights.append(numbers[:3])
        elif key == "f":
            groups.append((numbers, []))
        elif key in ("p", "pp"):
            corners = [[float(word) for word in next(lines).split()] for _ in range(int(words[0]))]
            groups[-1][1].extend([corners[k] for k in triangle] for triangle in triangles_of(corners))
        elif key not in ("", "v", "hither", "resolution"):
            fail(f"{path}: expected p, pp, l, f, b or v, found {key}")
    return view, lights, groups


def write_pov(path: Path, scene, size: int, depth: int):
    view, lights, groups = scene
    # wisp's `angle` spans the middles of the first and the last row.
    half = math.tan(math.radians(view["angle"][0]) / 2) * size / (size - 1)
    front = unit(minus(view["at"], view["from"]))
    right = unit(cross(front, view["up"]))
    light = SCALE * math.sqrt(len(lights)) / (2 * len(lights))  # also of the light that is everywhere
    out = ["#version 3.7;",
           f"global_settings {{ assumed_gamma 1 ambient_light 1 max_trace_level {depth + 1} adc_bailout {LEAST_WEIGHT} }}",
           f"background {{ rgb {vector(SCALE * x for x in view['b'])} }}",
           f"camera {{ location {vector(view['from'])} direction {vector(front)} right {vector(2 * half * x for x in right)} "
           f"up {vector(2 * half * x for x in cross(right, front))} }}"]
    out += [f"light_source {{ {vector(position)} rgb {light} }}" for position in lights]
    for (red, green, blue, diffuse, specular, shine, passing, index), triangles in groups:
        # POV-Ray takes what passes off the colour; wisp does not.
        colour = diffuse / (1 - passing)
        out.append("mesh {")
        for triangle in triangles:
            kind = "triangle" if len(triangle[0]) == 3 else "smooth_triangle"
            out.append(f"  {kind} {{ "
                       + ", ".join(vector(c[i:i + 3]) for c in triangle for i in range(0, len(c), 3)) + " }")
        out.append(f"  texture {{ pigment {{ rgbt <{red}, {green}, {blue}, {passing}> }} finish {{ ambient {colour * light} "
                   f"diffuse {colour} phong {specular} phong_size {shine} reflection {specular} }} }}")
        if passing > 0:
            out.append(f"  interior {{ ior {index} }} no_shadow")
        out.append("}")
    path.write_text("\n".join(out) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--depth", type=int, default=10)
    parser.add_argument("--runs", type=int, default=5)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    write_pov(args.folder / "scene.pov", read_nff(args.scene), args.size, args.depth)
    povray, wisp = [], []
    for _ in range(args.runs):
        povray.append(trace_povray(args.folder, "scene.pov", args.size))
        seconds, frame = trace_wisp(args.folder, args.scene, "--size", f"{args.size}x{args.size}", "--spp", "1", "--depth",
                                    str(args.depth))
        wisp.append(seconds)
    write_pfm(args.folder / "povray.pfm", args.size, SCALE, *read_ppm(args.folder / "povray.ppm"))
    apart = comparison(args.folder / "picture.pfm", args.folder / "povray.pfm")
    print("scene,side,wisp's shadow rays,POV-Ray s,wisp s,times sooner,relative RMSE between them")
    print(f"{args.scene.stem},{args.size},{frame['rays']['shadow']},{statistics.median(povray):.3f},{statistics.median(wisp):.3f},"
          f"{statistics.median(p / w for p, w in zip(povray, wisp)):.2f},{apart['relative_rmse']:.4f}")


try:
    main()
except OSError as error:
    fail(str(error))
