"""The shared library beside this file, and the structures of wisp/c_api.h, which says what each member means."""
import ctypes
from ctypes import POINTER, Structure, c_char, c_char_p, c_double, c_int32, c_int64, c_size_t, c_uint32, c_uint64, c_void_p
from pathlib import Path

VERSION = 1  # WISP_C_API_VERSION
DONE, STOPPED, WRONG_USAGE, BAD_SCENE, NO_MEMORY = range(5)

library = ctypes.CDLL(str(Path(__file__).with_name("libwisp.so")))

Vector = c_double * 3
Progress = ctypes.CFUNCTYPE(ctypes.c_int, c_void_p, c_char_p, c_uint64, c_uint64)


class Error(Structure):
    _fields_ = [("text", c_char * 256)]


class Array(Structure):
    _fields_ = [("data", c_void_p), ("number", c_int32), ("stride", c_int64), ("step", c_int64)]


class Camera(Structure):
    _fields_ = [("from", Vector), ("at", Vector), ("up", Vector), ("angle", c_double)]


class Light(Structure):
    _fields_ = [("kind", c_int32), ("position", Vector), ("direction", Vector), ("degrees", c_double), ("color", Vector)]


class Smoke(Structure):
    _fields_ = [("kind", c_int32), ("extinction", c_double), ("albedo", Vector), ("phase", c_double), ("emission", Vector),
                ("count", c_uint64), ("positions", Array), ("radii", Array), ("masses", Array), ("radius", c_double),
                ("mass", c_double), ("kernel", c_int32), ("cells", c_uint32 * 3), ("density", Array), ("low", Vector),
                ("high", Vector)]


class Material(Structure):
    _fields_ = [("ambient", Vector), ("diffuse", Vector), ("specular", Vector), ("shininess", c_double),
                ("transmission", c_double), ("index", c_double)]


class Mesh(Structure):
    _fields_ = [("triangle_count", c_uint64), ("indices", c_void_p), ("vertex_count", c_uint64), ("positions", Array),
                ("normals", Array), ("material", c_uint32), ("motion", c_int32), ("transform", c_double * 12)]


class Scene(Structure):
    _fields_ = [("version", c_uint32), ("width", c_uint32), ("height", c_uint32), ("camera", Camera), ("background", Vector),
                ("ambient", Vector), ("lights", POINTER(Light)), ("light_count", c_uint32), ("smokes", POINTER(Smoke)),
                ("smoke_count", c_uint32), ("meshes", POINTER(Mesh)), ("mesh_count", c_uint32),
                ("materials", POINTER(Material)), ("material_count", c_uint32)]


class Settings(Structure):
    _fields_ = [("version", c_uint32), ("arithmetic", c_int32), ("crop", c_uint32 * 4), ("samples", c_uint32),
                ("seed", c_uint64), ("photons", c_uint64), ("method", c_int32), ("irradiance", c_int32),
                ("estimate", c_int32), ("deposit", c_int32), ("direction", c_int32), ("gather", c_uint32),
                ("gather_radius", c_double), ("step", c_double), ("density_step", c_double), ("light_step", c_double),
                ("irradiance_step", c_double), ("paths", c_uint32), ("depth", c_uint32), ("shadows", c_int32),
                ("lights", c_int32), ("tree", c_int32), ("layers", c_int32)]


class Stage(Structure):
    _fields_ = [("name", c_char_p), ("room", c_char_p), ("reason", c_char_p), ("needed", c_int32), ("bytes", c_uint64)]


class Layer(Structure):
    _fields_ = [("name", c_char_p), ("channels", c_uint32)]


class Plan(Structure):
    _fields_ = [("bytes", c_uint64), ("width", c_uint32), ("height", c_uint32), ("stage_count", c_uint32),
                ("layer_count", c_uint32), ("plane_count", c_uint32), ("stages", Stage * 32), ("layers", Layer * 16)]


class Cache(Structure):
    _fields_ = [("words", c_uint64 * 8)]


class Counter(Structure):
    _fields_ = [("group", c_char_p), ("name", c_char_p), ("value", c_uint64)]


class Statistics(Structure):
    _fields_ = [("count", c_uint32), ("counters", Counter * 64)]


class Job(Structure):
    _fields_ = [("memory", c_void_p), ("memory_bytes", c_size_t), ("rgb", c_void_p), ("layers", c_void_p),
                ("cache", POINTER(Cache)), ("statistics", POINTER(Statistics)), ("progress", Progress), ("context", c_void_p)]


Frame = c_void_p
for _name, _result, *_arguments in (
        ("c_api_version", c_uint32),
        ("version", c_char_p),
        ("default_settings", Settings),
        ("prepared_bytes", c_size_t, POINTER(Scene)),
        ("prepare", c_int32, POINTER(Scene), c_void_p, c_size_t, POINTER(Frame), POINTER(Error)),
        ("choose_settings", c_int32, Frame, POINTER(Settings), POINTER(Error)),
        ("plan_frame", c_int32, Frame, POINTER(Settings), POINTER(Plan), POINTER(Error)),
        ("render", c_int32, Frame, POINTER(Settings), POINTER(Job), POINTER(Error)),
        ("digest", None, c_void_p, c_uint32, c_uint32, c_char * 65)):
    _function = getattr(library, "wisp_" + _name)
    _function.restype, _function.argtypes = _result, _arguments

if library.wisp_c_api_version() != VERSION:
    raise ImportError(f"libwisp.so: found version {library.wisp_c_api_version()} of the C interface, expected {VERSION}")


def check(status: int, error: Error) -> None:
    """Raises what a status of the library stands for, with its line."""
    text = error.text.decode(errors="replace")
    if status == NO_MEMORY:
        raise MemoryError(text)
    if status != DONE:
        raise ValueError(text)
