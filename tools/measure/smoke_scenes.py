"""Smoke scenes drawn from a seed, for random_smoke.py: boxes, grids and particles, thin and thick, in all kinds of light."""
import math, struct
from random import Random

AXES = range(3)


class Draw:
    """Numbers of one scene. What deals() picks is stratified: each N scenes in a row have each of N options once."""

    def __init__(self, seed, scene):
        self.seed, self.scene, self.next = seed, scene, Random(f"{seed} {scene}").random

    def deals(self, name, *options):
        turn, place = divmod(self.scene, len(options))
        shuffled = Random(f"{self.seed} {name} {turn}")
        return sorted(options, key=lambda _: shuffled.random())[place]

    def pick(self, *options):
        return options[int(self.next() * len(options))]

    def within(self, low, high):
        return low + (high - low) * self.next()

    def log_within(self, low, high):
        return low * (high / low) ** self.next()

    def stratified_log(self, name, low, high, strata):
        stratum = self.deals(name, *range(strata))
        return low * (high / low) ** ((stratum + self.next()) / strata)

    def normal(self):
        return math.sqrt(-2 * math.log(1 - self.next())) * math.cos(2 * math.pi * self.next())

    def direction(self):
        v = [self.normal() for _ in AXES]
        return [x / math.hypot(*v) for x in v]

    def color(self, low=0.0, high=1.0):
        return [self.within(low, high) for _ in AXES]

    def inside(self, box, part=1.0):
        return [m + part * self.within(-r, r) for m, r in zip(*box)]


def words(*values):
    return " ".join(words(*v) if isinstance(v, (list, tuple)) else v if isinstance(v, str) else f"{v:.9g}" for v in values)


class Scene:
    """`texts[kind]` is the scene's text: kind `all` is the scene, `single` that whose reference has single scattering alone."""

    # The reference has all orders. With albedos times WEAK and lights over WEAK, one order is as bright and each further one fades.
    WEAK = 1e-5

    def __init__(self, seed, number, folder):
        self.draw = draw = Draw(seed, number)
        self.folder, self.files = folder, 0
        self.elements = 0  # particles and cells
        self.unit = draw.deals("unit", 1, 1, 1, draw.log_within(1e-2, 1), draw.log_within(1, 1e2))
        self.smokes, self.boxes, self.said = [], [], []
        self.thickest = 0  # the largest optical depth across a smoke
        self.depth = 0  # across all, where they lie in each other
        self.grain = 0  # and within a smoothing length, for which a grid has its cells, a box a twentieth
        count = draw.deals("smokes", 1, 1, 1, 1, 1, 2, 2, 3)
        for i in range(count):
            self.add_smoke(i)
        self.surfaces = self.draw_surfaces()
        self.lights = self.draw_lights()
        self.view = self.draw_view()
        dark = not any(any(albedo) or any(emission) for *_, albedo, emission in self.smokes)
        self.background = draw.deals("background", *[[0.2] * 3 if dark else [0] * 3] * 3, draw.color(0, 0.3))
        self.has_single = not self.surfaces
        folder.mkdir(parents=True, exist_ok=True)
        for kind, weak in (("all", 1), ("single", self.WEAK)):
            (folder / f"{kind}.aff").write_text(self.text(weak))

    def text(self, weak):
        lines = [self.view, words("b", self.background), *self.surfaces]
        lines += [words(kind, place, [c / weak for c in color]) for kind, place, color in self.lights]
        for head, lines_of_smoke, albedo, emission in self.smokes:
            glow = [e * (1 - a) / (1 - a * weak) if a < 1 else 0 for e, a in zip(emission, albedo)]
            lines += [f"smoke {head} {{", *(f"  {line}" for line in lines_of_smoke), words("  albedo", [a * weak for a in albedo]),
                      words("  emission", glow), "}"]
        return "\n".join(lines) + "\n"

    # ---- smoke
    def add_smoke(self, i):
        draw = self.draw
        name = f"smoke {min(i, 1)}"
        kind = draw.deals(name + " kind", *["box"] * 3, *["grid"] * 3, *["particles"] * 4)
        long, aspect = self.unit * draw.within(0.5, 1), draw.deals(name + " aspect", 1, 1, draw.log_within(1, 10),
                                                                  draw.log_within(10, 100), draw.log_within(100, 1000))
        short = long / aspect
        half = draw.deals(name + " form", [long, long, short], [long, short, short], [long, draw.log_within(short, long), short])
        half = sorted(half, key=lambda _: draw.next())
        middle = [self.unit * draw.within(-2, 2) for _ in AXES] if i == 0 else draw.inside(self.boxes[0], 1.2)
        box = middle, half
        if i and draw.pick(True, False):  # shares a face with the first
            axis = draw.pick(0, 1, 2)
            middle[axis] = self.boxes[0][0][axis] + self.boxes[0][1][axis] + half[axis]
        depth = draw.stratified_log(name + " depth", 1e-3, 1e4, 14)
        self.depth_across = 2 * draw.deals(name + " across", max(half), max(half), min(half))
        depth = min(depth, 1e5 * self.depth_across / (2 * max(half)))
        head, lines, box = getattr(self, "draw_" + kind)(name, box, depth)
        albedo = draw.deals(name + " albedo", [0] * 3, [1] * 3, [0.9] * 3, [0.99] * 3, [1, 0.5, 0], draw.color(), draw.color(0.5))
        # A path in deeper smoke that absorbs nothing has as many collisions as the square of its depth.
        self.thickest = max(self.thickest, depth)
        self.depth += depth
        if depth > 30:
            albedo = [min(a, 0.99) for a in albedo]
        emission = draw.deals(name + " emission", *[[0] * 3] * 5, [1] * 3, draw.color())
        g = draw.deals(name + " g", 0, 0, 0, 0.5, -0.5, 0.95, -0.95, draw.within(-0.95, 0.95))
        lines.append(words("phase", g))
        self.smokes.append((head, lines, albedo, emission))
        self.boxes.append(box)
        self.said.append(f"{kind} depth {depth:.2g} aspect {aspect:.3g} g {g:.2g} albedo {words([float(f'{a:.2g}') for a in albedo])}"
                         + (" glows" if any(emission) else ""))

    def draw_box(self, name, box, depth):
        density = self.draw.log_within(0.1, 10)
        self.grain = max(self.grain, depth / self.depth_across * min(box[1]) / 10)
        ends = [m - r for m, r in zip(*box)] + [m + r for m, r in zip(*box)]
        return words("box", ends, density), [words("extinction", depth / (density * self.depth_across))], box

    def draw_grid(self, name, box, depth):
        draw = self.draw
        cells = [draw.pick(1, 2, 3, 5, 8, 13, 20) for _ in AXES]
        if draw.pick(True, False):  # cells as long as wide
            edge = max(max(box[1]) / 10, min(box[1]))
            cells = [max(1, round(2 * r / edge)) for r in box[1]]
        self.elements += math.prod(cells)
        form = draw.deals(name + " values", "random", "soft", "hard", "hollow", "constant", "single")
        last = [draw.pick(0, n - 1, n // 2) for n in cells]

        def value(*cell):
            r = [2 * (c + 0.5) / n - 1 for c, n in zip(cell, cells)]
            return {"random": draw.next(), "soft": max(0, 1 - math.hypot(*r)) ** 2, "hard": float(draw.next() < 0.4),
                    "hollow": float(max(map(abs, r)) > 0.6), "constant": 1, "single": list(cell) == last}[form]
        samples = [float(value(x, y, z)) for z in range(cells[2]) for y in range(cells[1]) for x in range(cells[0])]
        if not any(samples):
            samples[0] = 1.0
        file = self.file("vol")
        ends = [m - r for m, r in zip(*box)] + [m + r for m, r in zip(*box)]
        file.write_bytes(b"VOL\3" + struct.pack("<5i6f", 1, *cells, 1, *ends) + struct.pack(f"<{len(samples)}f", *samples))
        filled = sum(samples) / sum(s > 0 for s in samples)
        lines = [words("extinction", depth / (filled * self.depth_across))]
        self.grain = max(self.grain, depth / self.depth_across * min(2 * r / n for r, n in zip(box[1], cells)) * max(samples) / filled)
        turned = draw.deals(name + " transform", False, False, False, True)
        self.said.append(f"{form} {'x'.join(map(str, cells))}{' turned' if turned else ''}")
        if turned:
            return file.name, [*lines, self.turn(box)], (box[0], [max(box[1])] * 3)
        return file.name, lines, box

    def draw_particles(self, name, box, depth):
        draw = self.draw
        count = max(1, round(draw.stratified_log(name + " count", 1, 2000, 5)))
        self.elements += count
        form = draw.deals(name + " places", "ball", "cluster", "sheet", "line", "stray", "one place")
        middle, half = box
        flat = {"sheet": 1, "line": 2}.get(form, 0)
        points = []
        for i in range(count):
            r = draw.inside(([0] * 3, half))
            if form in ("ball", "stray") and max(half) == min(half):
                while math.hypot(*r) > half[0]:
                    r = draw.inside(([0] * 3, half))
            if form == "cluster":
                r = [h * draw.normal() / 2 for h in half]
            r[:flat] = [0] * flat
            if form == "one place":
                r = [0] * 3
            points.append([m + x for m, x in zip(middle, r)])
        # About 30 neighbours in a support, if they fill the box.
        spread = half[flat:]
        h = (math.prod(2 * x for x in spread) / count) ** (1 / len(spread))
        h = min(max(h, max(half) / 300), 0.5 * max(half))
        if form == "stray":
            for i in range(max(1, count // 100)):
                points[i] = [m + 30 * max(half) * x for m, x in zip(middle, draw.direction())]
        ratio = draw.deals(name + " ratio", 1, 1, 3, 30, 1000)
        upward = draw.pick(0, 0.3, 1)
        lengths = [h * ratio ** (upward - draw.next()) for _ in points]
        mass = draw.deals(name + " masses", lambda _: 1, lambda h: h ** 3, lambda _: draw.log_within(0.01, 1))
        masses = [mass(x / h) for x in lengths]
        area = (self.depth_across + 2 * math.sqrt(sum(x * x for x in lengths) / count)) ** 2
        extinction = depth * area / sum(masses)
        deepest = max(extinction * m / (x * x) for m, x in zip(masses, lengths))  # of one particle
        extinction *= min(1, 1e4 / deepest)
        for i in range(0, count, 1 + count // 40):
            kernels = (m / x ** 3 / math.pi for p, x, m in zip(points, lengths, masses) if math.dist(p, points[i]) < x)
            self.grain = max(self.grain, extinction * sum(kernels) * lengths[i])
        file = self.file("ply")
        file.write_text("\n".join(["ply", "format ascii 1.0", f"element vertex {count}",
                                   *(f"property double {p}" for p in "x y z h mass".split()), "end_header",
                                   *(words(p, x, m) for p, x, m in zip(points, lengths, masses))]) + "\n")
        self.said.append(f"{count} {form} h 1:{max(lengths) / min(lengths):.3g}")
        lines = [words("kernel", draw.deals(name + " kernel", "spline", "poly6")), words("extinction", extinction)]
        if draw.deals(name + " transform", False, False, False, True):
            lines.append(self.turn(box))
            half = [max(half)] * 3
        return file.name, lines, (middle, [x + (h if x < h else 0) for x in half])

    def turn(self, box):
        """A transform that turns about the middle of the box."""
        draw = self.draw
        a, degrees, m = draw.direction(), draw.within(-180, 180), box[0]
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        along = sum(x * y for x, y in zip(a, m))
        cross = [a[1] * m[2] - a[2] * m[1], a[2] * m[0] - a[0] * m[2], a[0] * m[1] - a[1] * m[0]]
        return words("transform 1 1 1", a, degrees, [x - c * x - s * y - (1 - c) * along * z for x, y, z in zip(m, cross, a)])

    def file(self, kind):
        self.files += 1
        self.folder.mkdir(parents=True, exist_ok=True)
        return self.folder / f"{self.files}.{kind}"

    # ---- what is around it
    def is_dark(self):
        """Whether what is in the smoke does not see, or is not seen from, outside: kept in one of four scenes."""
        return self.thickest > 10 and self.draw.pick(True, True, True, False)

    def on_face(self, box, reach):
        """A point in the plane of a face: within the face for reach 1, beside it beyond."""
        point = self.draw.inside(box, 0.95)
        axis, other = self.draw.pick((0, 1), (1, 2), (2, 0))
        point[axis] = box[0][axis] + box[1][axis] * self.draw.pick(-1, 1)
        if reach > 1:
            point[other] = box[0][other] + self.draw.pick(-1, 1) * (box[1][other] + reach * self.unit)
        return point

    def draw_lights(self):
        draw, box = self.draw, self.boxes[0]
        lights = []
        count = draw.deals("lights", 1, 1, 1, 2, 3)
        # Smoke that only scatters emits nothing, and with no light at all the program chooses two.
        if any(e and a < 1 for *_, albedo, emission in self.smokes for a, e in zip(albedo, emission)):
            count = draw.pick(0, count)
        for i in range(count):
            name = f"light {min(i, 1)}"
            kind = draw.deals(name, "l", "lp", "ls", "ld")
            color = [10 * c for c in draw.pick([1, 1, 1], draw.color(0.1))]
            way = draw.direction()
            place = draw.deals(name + " place", "inside", "near", "far", "face", "along")
            if place == "inside" and self.is_dark():
                place = "near"
            reach = max(box[1])
            point = {"inside": lambda: draw.inside(box, 0.9), "face": lambda: self.on_face(box, 1),
                     "along": lambda: self.on_face(box, draw.log_within(1.01, 10)),
                     "near": lambda: [m + 1.8 * reach * x for m, x in zip(box[0], way)],
                     "far": lambda: [m + reach * 300 * x for m, x in zip(box[0], way)]}[place]()
            if kind == "ld" and place in ("face", "along"):
                way[draw.pick(0, 1, 2)] = 0
                if place == "along":
                    way = [float(a == draw.scene % 3) * draw.pick(-1, 1) for a in AXES]
            distance = max(math.dist(point, draw.inside(box)), reach / 3)
            if kind in ("lp", "ls"):
                color = [c * distance * distance for c in color]
            aim = [t - p for t, p in zip(draw.inside(box, 0.5), point)]
            lights.append((kind, {"l": point, "lp": point, "ld": way,
                                  "ls": [*point, *aim, draw.within(3, 30) if place == "far" else draw.log_within(10, 180)]}[kind],
                           color))
            self.said.append(f"{kind} {place}")
        return lights

    def draw_view(self):
        draw, box = self.draw, self.boxes[0]
        reach = math.hypot(*box[1])
        place = draw.deals("eye", "outside", "outside", "far", "close", "inside", "face", "along")
        if place == "inside" and self.is_dark():
            place = "close"
        way = draw.direction()
        aim = draw.inside(box, 0.3)
        eye = {"outside": lambda: [m + 2.5 * reach * x for m, x in zip(box[0], way)],
               "far": lambda: [m + 40 * reach * x for m, x in zip(box[0], way)],
               "close": lambda: [m + 1.05 * h * x / max(map(abs, way)) for m, h, x in zip(*box, way)],
               "inside": lambda: draw.inside(box, 0.8), "face": lambda: self.on_face(box, 1),
               "along": lambda: self.on_face(box, draw.within(1.01, 3))}[place]()
        if place == "along":
            aim = [e if abs(abs(e - m) - h) < 1e-9 * h else a for e, m, h, a in zip(eye, *box, aim)]
        angle = {"outside": 30, "far": 2.5}.get(place, draw.within(20, 100))
        up = sorted(AXES, key=lambda a: abs(eye[a] - aim[a]))[0]
        self.said.append(f"eye {place}")
        return words("v from", eye, "at", aim, "up", [float(a == up) for a in AXES], "angle", angle, "hither", 1e-4 * self.unit,
                     "resolution", draw.pick(8, 12, 16), draw.pick(8, 12, 16)) + f"\nrender spp {draw.pick(1, 4)}"

    def draw_surfaces(self):
        draw, box = self.draw, self.boxes[0]
        kind = draw.deals("surfaces", *[None] * 6, "floor", "ball", "glass", "mirror")
        if not kind:
            return []
        self.said.append(kind)
        reach = max(box[1])
        material = words("f", draw.color(0.2), {"glass": "0 0.1 20 0.8 1.3", "mirror": "0.2 0.7 20 0 1"}.get(kind, "0.7 0 0 0 1"))
        lines = ["am 0.1 0.1 0.1", material]
        if kind in ("ball", "glass"):
            return [*lines, words("s", draw.inside(box, 1.2), reach * draw.within(0.1, 0.4))]
        # A little off the face: an eye or a light in the plane itself would be on a side that rounding chooses.
        height = box[0][2] + box[1][2] * draw.pick(-1.1, -1.003, -0.303)
        corners = [[box[0][0] + x * 3 * reach, box[0][1] + y * 3 * reach, height] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        return [*lines, "p 4", *map(words, corners)]
