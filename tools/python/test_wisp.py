"""Tests of the Python package, which is unpacked in a folder of PYTHONPATH, against the program `wisp` of PATH.
CC names the compiler of C.

    make python-test
"""
import ctypes, itertools, os, re, signal, subprocess, sys, threading
from pathlib import Path

import numpy
import pytest

import wisp
from wisp import _library

TOP = Path(__file__).resolve().parents[2]
BALL = numpy.array([p for p in itertools.product(range(-3, 4), repeat=3) if numpy.dot(p, p) <= 9], numpy.float32)
GROUND = wisp.Mesh([[-8, -3, 8], [8, -3, 8], [8, -3, -8], [-8, -3, -8]], [[0, 1, 2], [0, 2, 3]])
AROUND = dict(camera=wisp.Camera((0, 2, 14), (0, -1, 0), angle=40), size=(160, 120), background=(0.5, 0.6, 0.9), ambient=0.25,
              lights=[wisp.Parallel((-0.6, -0.8, 0), (12, 11, 9)), wisp.Point((5, 1, 5), (20, 30, 60))])
STEPS = dict(density_step=0.5, light_step=0.5, irradiance_step=1, step=1)


def ball(positions=BALL, radius=1, **more):
    return wisp.Particles(positions, radius, phase=0.5, **more)


def small(*things, **more):
    """A quick picture."""
    return wisp.render(*(things or (ball(), GROUND)), **{**AROUND, "size": (40, 30), "photons": 2000, **more})


def digest_of_program(scene, *words):
    run = subprocess.run(["wisp", "render", scene, "--digest", *words], stdout=subprocess.PIPE, check=True)
    return run.stdout.split()[0].decode()


# ---- The same bits as the program's

@pytest.mark.parametrize("arithmetic", ["f32", "f64", "fixed"])
def test_digest_is_that_of_the_program(arithmetic):
    picture = wisp.render(ball(), GROUND, arithmetic=arithmetic, photons=40000, **STEPS, **AROUND)
    scene = TOP / "tools/examples/scene.aff"
    assert picture.digest == digest_of_program(scene, "--arith", arithmetic)
    assert picture.rgb.shape == (120, 160, 3) and picture.rgb.dtype == numpy.float32
    # A seed, photons and rays of their own.
    picture = wisp.render(ball(), GROUND, arithmetic=arithmetic, photons=5000, seed=7, samples=1, **STEPS, **AROUND)
    assert picture.digest == digest_of_program(scene, "--arith", arithmetic, "--photons", "5000", "--seed", "7", "--spp", "1")


@pytest.mark.parametrize("more", ["extinction 1", "extinction 40", "emission 1 2 3", "kernel poly6", "phase -0.7"])
def test_what_is_not_given_is_what_the_program_chooses(tmp_path, more):
    text = (TOP / "tools/examples/scene.aff").read_text()
    text = re.sub("render .*step .*\n", "", text).replace("smoke.vtk", str(TOP / "tools/examples/smoke.vtk"))
    word, *numbers = more.split()
    text = re.sub(f"  {word} .*\n", "", text)
    (tmp_path / "s.aff").write_text(text.replace("  mass 1\n", f"  mass 1\n  {more}\n"))
    value = numbers[0] if word == "kernel" else [float(x) for x in numbers]
    smoke = ball()
    setattr(smoke, word, value if word in ("kernel", "emission") else value[0])
    picture = wisp.render(smoke, GROUND, photons=40000, **AROUND)
    assert picture.digest == digest_of_program(tmp_path / "s.aff")


def test_grid_and_box_are_those_of_the_program(tmp_path):
    density = numpy.random.default_rng(3).random((5, 4, 3), numpy.float32)
    (tmp_path / "g.vol").write_bytes(b"VOL\3" + numpy.int32([1, 3, 4, 5, 1]).tobytes()
                                     + numpy.float32([-1, -2, -3, 1, 2, 3]).tobytes() + density.tobytes())
    head = ("v from 0 2 14 at 0 -1 0 up 0 1 0 angle 40 hither 1 resolution 40 30\nb 0.5 0.6 0.9\n"
            "ld -0.6 -0.8 0  12 11 9\nlp 5 1 5  20 30 60\nrender photons 2000\n")
    (tmp_path / "s.aff").write_text(head + "smoke g.vol {\n  extinction 2\n}\n")
    grid = wisp.Grid(density, (-1, -2, -3), (1, 2, 3), extinction=2)
    assert small(grid).digest == digest_of_program(tmp_path / "s.aff")
    grid.density = numpy.asfortranarray(density.astype(float))
    assert small(grid).digest == digest_of_program(tmp_path / "s.aff")
    (tmp_path / "s.aff").write_text(head + "smoke box -1 -1 -1 1 2 1 0.5 {\n  albedo 0.9 0.5 0.1\n}\n")
    box = wisp.Box((-1, -1, -1), (1, 2, 1), extinction=0.5, albedo=(0.9, 0.5, 0.1))
    assert small(box).digest == digest_of_program(tmp_path / "s.aff")


@pytest.mark.parametrize("reach", [10, 100, 4000])
def test_smoke_far_around_a_mesh_is_that_of_the_program(tmp_path, reach):
    points = numpy.random.default_rng(2).uniform(-reach, reach, (200, 3)).astype("<f4")
    (tmp_path / "p.ply").write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 200\nproperty float x\n"
                                     b"property float y\nproperty float z\nend_header\n" + points.tobytes())
    (tmp_path / "s.aff").write_text(
        "v from 0 2 14 at 0 -1 0 up 0 1 0 angle 40 hither 1 resolution 40 30\nb 0.5 0.6 0.9\n"
        "ld -0.6 -0.8 0  12 11 9\nlp 5 1 5  20 30 60\nrender photons 2000\n"
        "am 0.25 0.25 0.25\nsmoke p.ply { radius 0.5 mass 1 extinction 0.5 }\np 3  -1 -0.3 1  1 -0.3 1  0 -0.3 -1\n")
    mesh = wisp.Mesh(numpy.array([[-1, -0.3, 1], [1, -0.3, 1], [0, -0.3, -1]]))
    smoke = wisp.Particles(points, radius=0.5, extinction=0.5)
    assert small(smoke, mesh).digest == digest_of_program(tmp_path / "s.aff")


def test_scene_files_have_the_digests_of_the_goldens():
    goldens = [line.split() for line in (TOP / "fixtures/goldens.txt").read_text().splitlines()]
    digest, = (digest for digest, arithmetic, *words in goldens if (arithmetic, words) == ("f32", ["glow.aff"]))
    picture = wisp.render_scene(TOP / "fixtures/glow.aff")
    assert picture.digest == digest
    assert picture.statistics["rays"]["primary"] == 3 * picture.rgb.shape[0] * picture.rgb.shape[1]  # render spp 3
    with pytest.raises(ValueError, match="none.aff"):
        wisp.render_scene("none.aff")
    with pytest.raises(ValueError, match="option 'photons'"):
        wisp.render_scene(TOP / "fixtures/glow.aff", photons=-1)


def test_one_frame_of_an_animation_is_rendered():
    for given, frame in (({}, 0), ({"frames": 2}, 2)):
        picture = wisp.render_scene(TOP / "fixtures/wake.aff", size="16x12", spp=1, **given)
        assert picture.digest == digest_of_program(TOP / "fixtures/wake.aff", "--size=16x12", "--spp=1", f"--frames={frame}")
    with pytest.raises(ValueError, match="frames: found '0:2', expected the number of one frame"):
        wisp.render_scene(TOP / "fixtures/wake.aff", frames="0:2")


def test_a_golden_as_a_user_keeps_it():
    """What the manual shows: any other picture than this is a failure."""
    picture = small(arithmetic="fixed")
    assert picture.digest == "0dc750007ec1821c2435aefc10729ac763bfee07888338116a2bc85d5eb1c27e"


# ---- Arrays

def test_arrays_are_read_where_they_are():
    digest = small().digest
    rows = numpy.zeros((2 * len(BALL), 5))
    rows[::2, 1:4] = BALL
    for positions in (BALL, BALL.astype(float), numpy.asfortranarray(BALL), rows[::2, 1:4], BALL[::-1], BALL[:, ::-1]):
        arrays = wisp._Arrays()
        described = arrays.describe(positions, (-1, 3), "positions")
        assert described.data == positions.ctypes.data
        assert (described.stride, described.step) == positions.strides
        assert small(ball(positions), GROUND).digest == digest  # the ball is the same from all sides
    radius = numpy.ones(len(BALL))[::-1]
    assert small(ball(radius=radius, mass=radius.astype(numpy.float32)), GROUND).digest == digest
    assert small(ball(radius=numpy.broadcast_to(1.0, len(BALL))), GROUND).digest == digest
    assert small(ball(BALL.astype(int)), GROUND).digest == digest
    swapped = BALL.astype(BALL.dtype.newbyteorder())
    assert small(ball(swapped), GROUND).digest == digest


def test_the_picture_is_written_where_it_stays():
    out = numpy.full((30, 40, 3), -1, numpy.float32)
    picture = small(out=out)
    assert picture.rgb is out and (out >= 0).all()
    for wrong in (numpy.empty((40, 30, 3), numpy.float32), numpy.empty((30, 40, 3)),
                  numpy.empty((30, 40, 6), numpy.float32)[:, :, ::2]):
        with pytest.raises(ValueError, match="out: found"):
            small(out=wrong)
    out.flags.writeable = False
    with pytest.raises(ValueError, match=r"out: found float32 of shape \(30, 40, 3\), read-only, expected"):
        small(out=out)


def test_layers_add_up_to_the_picture():
    picture = small(layers=True, crop=(3, 2, 30, 20))
    assert picture.rgb.shape == (18, 27, 3)
    parts = sum(picture.layers[name] for name in ("single", "multiple", "surfaces", "background"))
    assert (parts == picture.rgb).all()
    assert picture.layers["depth"].shape == (18, 27) and picture.layers["normal"].shape == (18, 27, 3)
    assert small().layers == {}


def test_sequence_with_a_cache_proves_less_and_shows_the_same():
    roof = numpy.array([[-1, 0, -1], [1, 0, -1], [0, 2, 0]], float)
    cache, proofs = wisp.Cache(), []
    for x in (0.0, 0.5, 1.0):
        mesh = wisp.Mesh(roof, transform=[[1, 0, 0, x], [0, 1, 0, -2], [0, 0, 1, 0]])
        picture = small(mesh, GROUND, cache=cache)
        assert picture.digest == small(mesh, GROUND).digest
        proofs.append(picture.statistics["shadow"]["proof_node_visits"])
    assert proofs[0] > proofs[1] >= proofs[2]


# ---- What is refused

@pytest.mark.parametrize("line, wrong", [
    (r"smokes\[0\].positions\[4\]: expected numbers within", lambda: small(ball(with_nan()))),
    (r"smokes\[0\].radius: expected a number from 1e-30", lambda: small(ball(radius=-1.0))),
    (r"smokes\[0\].radii\[2\]: expected", lambda: small(ball(radius=numpy.where(numpy.arange(len(BALL)) == 2, 0.0, 1.0)))),
    (r"radius: found shape \(2,\), expected \(123\)", lambda: small(ball(radius=[1.0, 2.0]))),
    (r"positions: found shape \(123, 2\), expected \(n, 3\)", lambda: small(ball(BALL[:, :2]))),
    (r"positions: found numbers of type complex128", lambda: small(ball(BALL.astype(complex)))),
    (r"smokes\[0\].albedo: expected numbers from 0 to 1", lambda: small(ball(albedo=2))),
    (r"albedo: found shape \(2,\), expected 3 numbers", lambda: small(ball(albedo=(1, 1)))),
    (r"kernel: found 'cubic', expected spline, poly6", lambda: small(ball(kernel="cubic"))),
    (r"indices: found 0 to 4, expected 0 to 3", lambda: small(wisp.Mesh(GROUND.positions, [[0, 1, 4]]))),
    (r"positions: found 4 without indices", lambda: small(wisp.Mesh(GROUND.positions))),
    (r"transform: found shape \(4, 4\)", lambda: small(wisp.Mesh(GROUND.positions, GROUND.indices, transform=numpy.eye(4)))),
    (r"lights\[0\].direction: expected a direction", lambda: small(lights=[wisp.Parallel((0, 0, 0), 1)])),
    (r"camera.from, camera.at: found one point", lambda: small(camera=wisp.Camera((0, 0, 0), (0, 0, 0)))),
    (r"size: found -1, expected a whole number", lambda: small(size=(-1, 9))),
    (r"positions: found a masked array", lambda: small(wisp.Particles(numpy.ma.masked_less(BALL, 0), radius=0.1))),
    (r"width, height: found 0 x 9", lambda: small(size=(0, 9))),
    (r"arithmetic: found 'f16', expected f32, f64, fixed", lambda: small(arithmetic="f16")),
    (r"photons: found -1, expected a whole number", lambda: small(photons=-1)),
    (r"photons: found 1.5, expected a whole number", lambda: small(photons=1.5)),
    (r"settings.samples: found 0", lambda: small(samples=0)),
    (r"step: found -1, expected a number of 0 or more", lambda: small(step=-1)),
    (r"settings.step: expected 0.0001 to 1000", lambda: small(step=0)),
    (r"option 'density-step': found 0, expected cells", lambda: small(method="volume", density_step=0)),
    (r"settings.crop: found 0,0,41,30", lambda: small(crop=(0, 0, 41, 30))),
])
def test_wrong_values_raise_value_error_with_a_line(line, wrong):
    with pytest.raises(ValueError, match=line):
        wrong()


def with_nan():
    positions = BALL.copy()
    positions[4, 1] = numpy.nan
    return positions


@pytest.mark.parametrize("line, wrong", [
    (r"scene: found ndarray, expected Particles, Grid, Box or Mesh", lambda: small(BALL)),
    (r"there is no setting 'photon'", lambda: small(photon=3)),
    (r"there is no setting 'spp'; --spp is 'samples'", lambda: small(spp=3)),
    (r"there is no setting 'version'", lambda: small(version=3)),
    (r"lights: found Mesh, expected Point", lambda: small(lights=[GROUND])),
    (r"lights: found Parallel, expected a list of lights", lambda: small(lights=wisp.Parallel((0, -1, 0), 1))),
    (r"camera: found tuple, expected Camera", lambda: small(camera=(0, 0, 9))),
    (r"angle: found '30 degrees', expected a number", lambda: small(camera=wisp.Camera((0, 0, 9), (0, 0, 0), angle="30 degrees"))),
    (r"eye: found 'here', expected 3 numbers", lambda: small(camera=wisp.Camera("here", (0, 0, 0)))),
    (r"extinction: found None, expected a number", lambda: small(ball(extinction=None))),
    (r"radius: found 'large', expected a number", lambda: small(ball(radius="large"))),
    (r"index: found 'glass', expected a number",
     lambda: small(wisp.Mesh(GROUND.positions, GROUND.indices, material=wisp.Material(index="glass")))),
    (r"step: found 'fine', expected a number", lambda: small(step="fine")),
    (r"size: found 16, expected \(width, height\)", lambda: small(size=16)),
    (r"size: found \(16, 16, 3\), expected \(width, height\)", lambda: small(size=(16, 16, 3))),
    (r"camera", lambda: wisp.render(ball())),
])
def test_wrong_words_and_kinds_raise_type_error(line, wrong):
    with pytest.raises(TypeError, match=line):
        wrong()


def test_what_does_not_fit_raises_memory_error():
    with pytest.raises(MemoryError):
        small(wisp.Grid(numpy.broadcast_to(numpy.float32(1), (1, 1, 1)), (0, 0, 0), (1, 1, 1)), ball(), density_step=0.01,
              size=(65536, 65536), samples=1)


# ---- Progress, signals, threads

def test_progress_names_stages_of_the_plan_and_stops_by_an_exception():
    stages = []
    small(progress=lambda stage, done, total: stages.append(stage) if not stages or stages[-1] != stage else None)
    needed = {name for name, row in wisp.plan(ball(), GROUND, **AROUND, photons=2000).items() if row["needed"]}
    assert set(stages) <= needed and stages[-1] == "camera rays"

    class Enough(Exception):
        pass

    calls = []

    def stop(stage, done, total):
        calls.append(stage)
        raise Enough

    with pytest.raises(Enough):
        small(progress=stop)
    assert len(calls) == 1


@pytest.fixture
def interruptible():
    """Ctrl-C raises, also in a process that a shell runs in the background, where SIGINT is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_stops_a_render_and_the_next_one_is_whole(interruptible):
    digest = small().digest
    before = signal.getsignal(signal.SIGINT)
    seen = []

    def interrupt(stage, done, total):
        seen.append(stage)
        if stage == "photons" and seen.count("photons") == 1:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        small(progress=interrupt)
    assert "camera rays" not in seen
    assert signal.getsignal(signal.SIGINT) is before
    # Without a progress of the caller: a render that would take hours ends by a signal.
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        small(size=(4000, 4000), samples=65536)
    assert small().digest == digest


def test_threads_render_at_once():
    digests = []
    threads = [threading.Thread(target=lambda: digests.append(small().digest)) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert digests == [small().digest] * 3


# ---- The mirror of the header

def test_structures_and_words_are_those_of_the_header(tmp_path):
    kinds = {name: kind for name, kind in vars(_library).items()
             if isinstance(kind, type) and issubclass(kind, ctypes.Structure) and kind is not ctypes.Structure}
    assert len(kinds) >= 15
    places = []  # C's expression, and what it is here
    for name, kind in kinds.items():
        of_c = "wisp_" + name.lower()
        places.append((f"sizeof({of_c})", ctypes.sizeof(kind)))
        places += [(f"offsetof({of_c}, {field})", getattr(kind, field).offset) for field, *_ in kind._fields_]
    for setting, words in wisp.WORDS.items():
        prefix = {"arithmetic": "WISP_", "light_choice": "WISP_LIGHTS_"}.get(setting, f"WISP_{setting.upper()}_")
        places += [(prefix + word.upper(), number) for number, word in enumerate(words)]
    places += [(f"WISP_{word}", number) for words in ("POINT SPOT PARALLEL CONSTANT", "PARTICLES GRID BOX", "SPLINE POLY6",
                                                      "STILL MOVING DEFORMING", "FLOAT32 FLOAT64",
                                                      "DONE STOPPED WRONG_USAGE BAD_SCENE NO_MEMORY")
               for number, word in enumerate(words.split())]
    source = tmp_path / "places.c"
    source.write_text('#include "wisp/c_api.h"\n#include <stdio.h>\nint main(void) {\n' +
                      "".join(f'printf("%d\\n", (int)({c}));\n' for c, _ in places) + "return 0;\n}\n")
    program = tmp_path / "places"
    subprocess.run([os.environ.get("CC", "cc"), "-std=c99", "-I", TOP / "include", source, "-o", program], check=True)
    found = map(int, subprocess.run([program], stdout=subprocess.PIPE, check=True).stdout.split())
    for (expression, here), there in zip(places, found):
        assert here == there, expression


def code_blocks(text):
    """Lines that are indented by four, and begin with an import; as code of its own."""
    blocks = re.findall(r"(?m)^    (?:import|from) .*\n(?:(?:    .*)?\n)*", text)
    return [re.sub("(?m)^    ", "", block) for block in blocks]


def test_the_code_of_the_documents_runs(monkeypatch):
    monkeypatch.chdir(TOP)
    picture, = code_blocks(wisp.__doc__)
    space = {}
    exec(picture, space)
    assert space["picture"].rgb.shape == (240, 320, 3) and len(space["picture"].digest) == 64
    sequence, golden = code_blocks((TOP / "tools/python/README.md").read_text())
    exec(sequence, space)
    assert len(space["digests"]) == 3 == len(set(space["digests"]))
    exec(golden, space)
    space["test_smoke_is_as_it_was"]()
