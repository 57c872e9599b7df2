"""wisp renders smoke of particles and density grids, and triangles, with the same bits on every machine.

    import numpy, wisp
    points = numpy.random.default_rng(1).normal(size=(5000, 3))
    picture = wisp.render(wisp.Particles(points, radius=0.3, extinction=0.01),
                          camera=wisp.Camera((0, 1, 12), (0, 0, 0), angle=30),
                          lights=[wisp.Parallel((-1, -1, -1), (8, 8, 7))], size=(320, 240), photons=100_000)
    picture.rgb         # float32 (240, 320, 3): linear radiance, top row first
    picture.digest      # SHA-256, the same everywhere: compare it in a golden test

Arrays of float32 or float64 of any strides are read where they are, and pictures are written where they stay. Lengths are
in any unit, directions of any length, colours and radiances linear R G B. What is wrong raises ValueError with a line that
says what was expected; what does not fit raises MemoryError. Methods and steps that are not given are those that
`wisp render` would choose, so the same numbers in a scene file give the same digest.
"""
from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import tempfile
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Iterable, Mapping, Optional, Sequence, Union

import numpy
from numpy.typing import ArrayLike, NDArray

from . import _library as c

__all__ = ["Box", "Cache", "Camera", "Constant", "Grid", "Material", "Mesh", "Parallel", "Particles", "Picture", "Point",
           "Spot", "plan", "render", "render_scene", "version"]
version: str = c.library.wisp_version().decode()

Color = Union[float, Sequence[float]]  # R G B, or one number for all three
Words = Mapping[str, Sequence[str]]
WORDS: Words = {  # of settings, in the order of the values
    "arithmetic": ("f32", "f64", "fixed"),
    "method": ("direct", "map", "volume"),
    "irradiance": ("none", "uniform", "adaptive"),
    "estimate": ("kernel", "knn"),
    "deposit": ("exact", "path", "kernel", "nodes"),
    "direction": ("flux", "mean"),
    "shadows": ("trace", "cache", "paper", "exact", "voxel", "lightbuffer", "lie"),
    "light_choice": ("all", "cuts"),
    "tree": ("box", "kd"),
}
OPTIONS = {"spp": "samples", "smoke": "method"}  # of the command line, and their settings here


# ---- What a scene consists of

@dataclass
class Camera:
    """At `eye`, looking to `at`. `angle`: degrees from the centre of the top row of pixels to that of the bottom one."""
    eye: Sequence[float]
    at: Sequence[float]
    up: Sequence[float] = (0, 1, 0)
    angle: float = 30


@dataclass
class Point:
    """A light of radiant intensity `color`; irradiance falls off with the squared distance."""
    position: Sequence[float]
    color: Color


@dataclass
class Spot:
    """A Point inside a cone of `degrees`, the whole angle, above 0, at most 360, about `direction`."""
    position: Sequence[float]
    direction: Sequence[float]
    degrees: float
    color: Color


@dataclass
class Parallel:
    """Light that travels along `direction`, of irradiance `color`."""
    direction: Sequence[float]
    color: Color


@dataclass
class Constant:
    """Light from `position` of irradiance `color` at any distance."""
    position: Sequence[float]
    color: Color


@dataclass
class Particles:
    """Smoke of density sum_i mass_i W(|x - x_i|, radius_i); a kernel reaches two radii.

    positions: (n, 3), in any order. radius: smoothing lengths, above 0, one or (n,). mass: 0 or more, one or (n,).
    extinction: area per mass. albedo: 0 to 1. phase: g of Henyey and Greenstein, between -1 and 1. emission: radiance.
    kernel: "spline" or "poly6". Arrays are those of the caller, not copies.
    """
    positions: ArrayLike
    radius: ArrayLike
    mass: ArrayLike = 1.0
    extinction: float = 1.0
    albedo: Color = 0.9
    phase: float = 0.0
    emission: Color = 0.0
    kernel: str = "spline"


@dataclass
class Grid:
    """Smoke of densities (nz, ny, nx), 0 or more, at the centres of the cells of the box from `low` to `high`, x y z.

    extinction: per density and length. The rest is as in Particles.
    """
    density: ArrayLike
    low: Sequence[float]
    high: Sequence[float]
    extinction: float = 1.0
    albedo: Color = 0.9
    phase: float = 0.0
    emission: Color = 0.0


@dataclass
class Box:
    """Smoke of one extinction, per length, between `low` and `high`. The rest is as in Particles."""
    low: Sequence[float]
    high: Sequence[float]
    extinction: float = 1.0
    albedo: Color = 0.9
    phase: float = 0.0
    emission: Color = 0.0


@dataclass
class Material:
    """Whitted's shading. `ambient` is `diffuse` where it is None. transmission: 0 to 1; above 0: casts no shadow."""
    diffuse: Color = 0.5
    specular: Color = 0.0
    shininess: float = 0.0
    transmission: float = 0.0
    index: float = 1.0
    ambient: Optional[Color] = None


@dataclass
class Mesh:
    """Triangles.

    positions: (v, 3). indices: (t, 3) of uint32, or None: (0, 1, 2), (3, 4, 5), ... normals: (v, 3), or None: flat.
    transform: (3, 4), rows of the matrix from the mesh's own space to the world's, of a mesh that moves from frame to
    frame; None: it stands still. deforming: its positions change from frame to frame.
    """
    positions: ArrayLike
    indices: Optional[ArrayLike] = None
    normals: Optional[ArrayLike] = None
    material: Material = field(default_factory=Material)
    transform: Optional[ArrayLike] = None
    deforming: bool = False


SmokeOrMesh = Union[Particles, Grid, Box, Mesh]
Light = Union[Point, Spot, Parallel, Constant]


# ---- Into the structures of C

def _number(value: Any, what: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{what}: found {value!r}, expected a number") from None


def _vector(values: Color, what: str) -> Any:
    try:
        numbers = numpy.asarray(values, float)
    except (TypeError, ValueError):
        raise TypeError(f"{what}: found {values!r}, expected 3 numbers") from None
    if numbers.ndim == 0:
        numbers = numpy.broadcast_to(numbers, 3)
    if numbers.shape != (3,):
        raise ValueError(f"{what}: found shape {numbers.shape}, expected 3 numbers")
    return c.Vector(*numbers)


class _Arrays:
    """Descriptions of arrays, and the arrays themselves, for as long as C may read them."""

    def __init__(self) -> None:
        self.kept: list[Any] = []

    def describe(self, values: ArrayLike, shape: Sequence[int], what: str) -> Any:
        """An array of that shape; -1: any number. float32 and float64 are not copied, whatever their strides."""
        if isinstance(values, numpy.ma.MaskedArray):
            raise ValueError(f"{what}: found a masked array, expected one without a mask")
        array = numpy.asarray(values)
        if array.dtype not in (numpy.float32, numpy.float64) or not array.dtype.isnative:
            if array.dtype.kind not in "fiu":
                raise ValueError(f"{what}: found numbers of type {array.dtype}, expected float32 or float64")
            array = array.astype(numpy.float64)
        if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape)):
            words = ", ".join("n" if n < 0 else str(n) for n in shape)
            raise ValueError(f"{what}: found shape {array.shape}, expected ({words})")
        if any(stride == 0 and n > 1 for stride, n in zip(array.strides, array.shape)):
            array = numpy.ascontiguousarray(array)  # in C a stride of 0 means that there are no gaps
        self.kept.append(array)
        strides = [stride if n > 1 else 0 for stride, n in zip(array.strides, array.shape)] + [0]
        return c.Array(array.ctypes.data, int(array.dtype == numpy.float64), strides[0], strides[1])

    def list_of(self, kind: Any, items: Iterable[Any]) -> tuple[Any, int]:
        made = list(items)
        self.kept.append((kind * len(made))(*made))
        return self.kept[-1], len(made)

    def light(self, light: Light) -> Any:
        kinds = (Point, Spot, Parallel, Constant)
        if not isinstance(light, kinds):
            raise TypeError(f"lights: found {type(light).__name__}, expected Point, Spot, Parallel or Constant")
        made = c.Light(kind=kinds.index(type(light)), color=_vector(light.color, "color"))
        for name in ("position", "direction"):
            if hasattr(light, name):
                setattr(made, name, _vector(getattr(light, name), name))
        made.degrees = _number(getattr(light, "degrees", 0), "degrees")
        return made

    def smoke(self, smoke: Union[Particles, Grid, Box]) -> Any:
        made = c.Smoke(extinction=_number(smoke.extinction, "extinction"), albedo=_vector(smoke.albedo, "albedo"),
                       phase=_number(smoke.phase, "phase"), emission=_vector(smoke.emission, "emission"))
        if isinstance(smoke, Particles):
            made.positions = self.describe(smoke.positions, (-1, 3), "positions")
            made.count = len(self.kept[-1])
            made.kernel = _word("kernel", smoke.kernel, ("spline", "poly6"))
            for one, all_of, values in (("radius", "radii", smoke.radius), ("mass", "masses", smoke.mass)):
                if numpy.ndim(values) == 0:
                    setattr(made, one, _number(values, one))
                else:
                    setattr(made, all_of, self.describe(values, (made.count,), one))
            return made
        made.low, made.high = _vector(smoke.low, "low"), _vector(smoke.high, "high")
        made.kind = 2
        if isinstance(smoke, Grid):
            made.kind = 1
            cells = numpy.shape(smoke.density)
            if len(cells) != 3:
                raise ValueError(f"density: found shape {cells}, expected (nz, ny, nx)")
            made.cells[:] = cells[::-1]
            made.density = self.describe(numpy.ravel(smoke.density), (-1,), "density")  # a copy where there are gaps
        return made

    def mesh(self, mesh: Mesh, material: int) -> Any:
        made = c.Mesh(positions=self.describe(mesh.positions, (-1, 3), "positions"), material=material)
        made.vertex_count = len(self.kept[-1])
        made.triangle_count = made.vertex_count // 3
        if mesh.indices is not None:
            indices = numpy.asarray(mesh.indices)
            if indices.ndim != 2 or indices.shape[1] != 3 or indices.dtype.kind not in "iu":
                raise ValueError(f"indices: found {indices.dtype} of shape {indices.shape}, expected integers (n, 3)")
            if indices.size and (indices.min() < 0 or indices.max() >= made.vertex_count):
                raise ValueError(f"indices: found {indices.min()} to {indices.max()}, expected 0 to {made.vertex_count - 1}")
            self.kept.append(numpy.ascontiguousarray(indices, numpy.uint32))
            made.indices, made.triangle_count = self.kept[-1].ctypes.data, len(indices)
        elif made.vertex_count % 3:
            raise ValueError(f"positions: found {made.vertex_count} without indices, expected three a triangle")
        if mesh.normals is not None:
            made.normals = self.describe(mesh.normals, (made.vertex_count, 3), "normals")
        if mesh.transform is not None:
            matrix = numpy.asarray(mesh.transform, float)
            if matrix.shape != (3, 4) or mesh.deforming:
                raise ValueError(f"transform: found shape {matrix.shape}, expected (3, 4), of a mesh that is not deforming")
            made.transform[:] = matrix.T.ravel()
        made.motion = 2 if mesh.deforming else 0 if mesh.transform is None else 1
        return made


def _material(material: Material) -> Any:
    ambient = material.diffuse if material.ambient is None else material.ambient
    return c.Material(_vector(ambient, "ambient"), _vector(material.diffuse, "diffuse"),
                      _vector(material.specular, "specular"), _number(material.shininess, "shininess"),
                      _number(material.transmission, "transmission"), _number(material.index, "index"))


def _word(name: str, word: str, words: Sequence[str]) -> int:
    if word not in words:
        raise ValueError(f"{name}: found {word!r}, expected {', '.join(words)}")
    return words.index(word)


def _scene(things: Sequence[SmokeOrMesh], camera: Camera, lights: Sequence[Light], size: tuple[int, int], background: Color,
           ambient: Color) -> tuple[Any, _Arrays]:
    arrays = _Arrays()
    if not isinstance(camera, Camera):
        raise TypeError(f"camera: found {type(camera).__name__}, expected Camera")
    if not hasattr(lights, "__iter__"):
        raise TypeError(f"lights: found {type(lights).__name__}, expected a list of lights")
    for thing in things:
        if not isinstance(thing, (Particles, Grid, Box, Mesh)):
            raise TypeError(f"scene: found {type(thing).__name__}, expected Particles, Grid, Box or Mesh")
    meshes = [thing for thing in things if isinstance(thing, Mesh)]
    scene = c.Scene(version=c.VERSION, background=_vector(background, "background"), ambient=_vector(ambient, "ambient"))
    if not hasattr(size, "__len__") or len(size) != 2:
        raise TypeError(f"size: found {size!r}, expected (width, height)")
    scene.width, scene.height = (_whole("size", n, 65536) for n in size)
    scene.camera = c.Camera(_vector(camera.eye, "eye"), _vector(camera.at, "at"), _vector(camera.up, "up"),
                            _number(camera.angle, "angle"))
    scene.lights, scene.light_count = arrays.list_of(c.Light, map(arrays.light, lights))
    scene.smokes, scene.smoke_count = arrays.list_of(c.Smoke, (arrays.smoke(s) for s in things if not isinstance(s, Mesh)))
    scene.meshes, scene.mesh_count = arrays.list_of(c.Mesh, (arrays.mesh(mesh, i) for i, mesh in enumerate(meshes)))
    scene.materials, scene.material_count = arrays.list_of(c.Material, (_material(mesh.material) for mesh in meshes))
    return scene, arrays


def _whole(name: str, number: Any, most: int) -> int:
    """ctypes would cut off what is too large."""
    if not isinstance(number, (int, numpy.integer)) or isinstance(number, bool) or not 0 <= number <= most:
        raise ValueError(f"{name}: found {number!r}, expected a whole number from 0 to {most}")
    return int(number)


def _settings(given: Mapping[str, Any]) -> Any:
    settings = c.library.wisp_default_settings()
    for name in ("method", "irradiance", "estimate", "deposit", "step", "density_step", "light_step", "irradiance_step"):
        setattr(settings, name, -1)  # to be chosen
    kinds = dict(c.Settings._fields_)
    for name, value in given.items():
        if value is None:
            continue
        if name in WORDS:
            setattr(settings, "lights" if name == "light_choice" else name, _word(name, value, WORDS[name]))
        elif name == "layers":
            settings.layers = bool(value)
        elif name == "crop":
            settings.crop[:] = [_whole(name, n, 65536) for n in value]
        elif name not in kinds or name in ("version", "paths", "lights"):
            raise TypeError(f"there is no setting {name!r}" + (f"; --{name} is {OPTIONS[name]!r}" if name in OPTIONS else ""))
        elif kinds[name] is ctypes.c_double:
            number = _number(value, name)
            if not number >= 0:
                raise ValueError(f"{name}: found {value!r}, expected a number of 0 or more")
            setattr(settings, name, number)
        else:
            setattr(settings, name, _whole(name, value, 2**63 - 1 if kinds[name] is ctypes.c_uint64 else 2**31 - 1))
    return settings


# ---- Rendering

@dataclass
class Picture:
    """rgb: float32 (height, width, 3), linear radiance, top row first. statistics: exact counters by group and name, as
    `wisp render --stats`. layers: float32 (height, width) or (height, width, 3) by name, with layers=True."""
    rgb: NDArray[numpy.float32]
    statistics: dict[str, dict[str, int]]
    layers: dict[str, NDArray[numpy.float32]] = field(default_factory=dict)

    @property
    def digest(self) -> str:
        """The SHA-256 of the picture as .pfm: what `wisp render --digest` prints."""
        rgb = numpy.ascontiguousarray(self.rgb)
        text = (ctypes.c_char * 65)()
        c.library.wisp_digest(rgb.ctypes.data, rgb.shape[1], rgb.shape[0], text)
        return text.value.decode()


class Cache:
    """What is kept from one frame of a sequence to the next: memory, trees and shadows of meshes that stand still, smoke
    that is the same. Hand it to each render(); pictures are the same without it."""

    def __init__(self) -> None:
        self._words = c.Cache()
        self._scene = self._work = numpy.empty(0, numpy.uint8)


class _Interrupts:
    """As long as it lives, a signal that raises an exception stops the work, and the exception is raised at its end."""

    def __init__(self) -> None:
        self.raised: Optional[BaseException] = None

    def __enter__(self) -> _Interrupts:
        self.before: Any = None
        if threading.current_thread() is threading.main_thread() and callable(signal.getsignal(signal.SIGINT)):
            self.before = signal.signal(signal.SIGINT, self.note)
        return self

    def note(self, number: int, frame: Any) -> None:
        try:
            self.before(number, frame)
        except BaseException as exception:
            self.raised = exception

    def __exit__(self, *_: Any) -> None:
        if self.before is not None:
            signal.signal(signal.SIGINT, self.before)


def _grown(memory: NDArray[numpy.uint8], count: int) -> NDArray[numpy.uint8]:
    return memory if memory.size >= count else numpy.empty(count, numpy.uint8)


def _prepared(scene: Any, cache: Cache) -> Any:
    error, frame = c.Error(), c.Frame()
    cache._scene = _grown(cache._scene, c.library.wisp_prepared_bytes(scene))
    c.check(c.library.wisp_prepare(scene, cache._scene.ctypes.data, cache._scene.size, frame, error), error)
    return frame


def _planned(frame: Any, settings: Any) -> Any:
    error, plan = c.Error(), c.Plan()
    c.check(c.library.wisp_choose_settings(frame, settings, error), error)
    c.check(c.library.wisp_plan_frame(frame, settings, plan, error), error)
    return plan


def plan(*things: SmokeOrMesh, camera: Camera, lights: Sequence[Light] = (), size: tuple[int, int] = (512, 512),
         background: Color = 0.0, ambient: Color = 1.0, **settings: Any) -> dict[str, dict[str, Any]]:
    """The stages of a render by name: `needed`, `reason` and `bytes` of each. Nothing is rendered. As render() otherwise."""
    scene, arrays = _scene(things, camera, lights, size, background, ambient)
    cache = Cache()
    found = _planned(_prepared(scene, cache), _settings(settings))
    return {stage.name.decode(): {"needed": bool(stage.needed), "reason": stage.reason.decode(), "bytes": stage.bytes}
            for stage in found.stages[:found.stage_count]}


def render(*things: SmokeOrMesh, camera: Camera, lights: Sequence[Light] = (), size: tuple[int, int] = (512, 512),
           background: Color = 0.0, ambient: Color = 1.0, out: Optional[NDArray[numpy.float32]] = None,
           cache: Optional[Cache] = None, progress: Optional[Callable[[str, int, int], Any]] = None,
           **settings: Any) -> Picture:
    """Renders a scene of Particles, Grid, Box and Mesh.

    size: (width, height) in pixels. background: radiance that a ray sees which meets nothing. ambient: what materials'
    ambient colours are multiplied by. out: float32 (height, width, 3) without gaps, to be filled in place of a new one.
    cache: of a sequence. progress: is called as progress(stage, done, total); what it raises stops the work, and Ctrl-C
    does, too.

    settings are the options of `wisp render`: arithmetic ("f32", "f64", "fixed"), photons, seed, samples (--spp), depth,
    crop (x0, y0, x1, y1), layers (True: Picture.layers), method ("direct", "map", "volume": --smoke), irradiance, estimate,
    deposit, direction, gather, gather_radius, step, density_step, light_step, irradiance_step, shadows, tree and
    light_choice (--lights).
    """
    kept = cache or Cache()
    scene, arrays = _scene(things, camera, lights, size, background, ambient)
    frame, chosen = _prepared(scene, kept), _settings(settings)
    del arrays  # the frame has what it needs
    plan = _planned(frame, chosen)
    rgb = numpy.empty((plan.height, plan.width, 3), numpy.float32) if out is None else out
    if rgb.shape != (plan.height, plan.width, 3) or rgb.dtype != numpy.float32 or not rgb.flags.c_contiguous \
            or not rgb.flags.writeable:
        found = f"{rgb.dtype} of shape {rgb.shape}" + ("" if rgb.flags.writeable else ", read-only") + \
            ("" if rgb.flags.c_contiguous else ", with gaps")
        raise ValueError(f"out: found {found}, expected float32 of shape {(plan.height, plan.width, 3)}, writable and without gaps")
    planes = numpy.empty((plan.plane_count, plan.height, plan.width), numpy.float32)
    kept._work = _grown(kept._work, plan.bytes)
    statistics, error = c.Statistics(), c.Error()

    with _Interrupts() as interrupts:
        def on_progress(_: Any, stage: bytes, done: int, total: int) -> int:
            if progress and not interrupts.raised:
                try:
                    progress(stage.decode(), done, total)
                except BaseException as exception:
                    interrupts.raised = exception
            return interrupts.raised is not None

        job = c.Job(kept._work.ctypes.data, kept._work.size, rgb.ctypes.data, planes.ctypes.data if chosen.layers else None,
                    ctypes.pointer(kept._words), ctypes.pointer(statistics), c.Progress(on_progress))
        status = c.library.wisp_render(frame, chosen, job, error)
    if interrupts.raised:
        raise interrupts.raised
    c.check(status, error)

    picture = Picture(rgb, {})
    for counter in statistics.counters[:statistics.count]:
        picture.statistics.setdefault(counter.group.decode(), {})[counter.name.decode()] = counter.value
    first = 0
    for layer in plan.layers[:plan.layer_count]:
        of_layer = planes[first:first + layer.channels]
        picture.layers[layer.name.decode()] = of_layer[0] if layer.channels == 1 else of_layer.transpose(1, 2, 0)
        first += layer.channels
    return picture


def render_scene(scene: Union[str, os.PathLike[str]], *, program: str = "wisp", **options: Any) -> Picture:
    """Renders one frame of a scene file, or of a file of smoke by itself, by the program `wisp`, which reads all formats and
    chooses what is left out. options are those of `wisp render`: photons="4M", frames=7, spp=16, reference=True.
    statistics are those of --stats. Of an animation it is frame 0 where `frames` does not name another."""
    import json
    if not str(options.setdefault("frames", 0)).isdecimal():
        raise ValueError(f"frames: found {options['frames']!r}, expected the number of one frame")
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder, "stats.json")
        words = [program, "render", os.fspath(scene), "--output", "-", "--stats", str(stats)]
        for name, value in options.items():
            if value is not False:
                words.append(f"--{name.replace('_', '-')}" + ("" if value is True else f"={value}"))
        run = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        if run.returncode:
            lines = run.stderr.decode(errors="replace").strip().splitlines() or [f"{program} ended with {run.returncode}"]
            raise {4: MemoryError, 5: OSError}.get(run.returncode, ValueError)(lines[-1])
        kind, size, scale, pixels = run.stdout.split(b"\n", 3)
        width, height = map(int, size.split())
        rgb = numpy.frombuffer(pixels, "<f4", 3 * width * height).reshape(height, width, 3)[::-1]
        frame = json.loads(stats.read_text())["frames"][0]
        groups = {name: group for name, group in frame.items() if isinstance(group, dict)}
        return Picture(numpy.ascontiguousarray(rgb, numpy.float32), groups)
