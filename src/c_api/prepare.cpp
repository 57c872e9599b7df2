// From a caller's scene to the core's, in the caller's memory.
#include "c_api/frame.h"
#include "c_api/refusal.h"
#include "core/smoke/grid_samples.h"
#include "host/prepare/core_units.h"
#include "wisp/arena.h"
#include <cstring>

namespace wisp::c_api {

namespace {

constexpr double largest_number = 1e30, smallest_length = 1e-30;

// ---- Pointers and counts

// What a scene has of everything.
struct Counts {
    uint64_t particles, samples, triangles, moving_meshes;
};

// Whether `count` elements of an array can be addressed.
bool is_addressable(const wisp_array &array, uint64_t count) {
    constexpr int64_t farthest = int64_t{1} << 62;
    const auto size = [](int64_t x) {
        return x < 0 ? uint64_t{0} - static_cast<uint64_t>(x) : static_cast<uint64_t>(x);
    };
    if (size(array.step) >= uint64_t{1} << 60) return false;
    return count == 0 || size(array.stride) <= static_cast<uint64_t>(farthest) / count;
}

// `i` is the index of the smoke or mesh in `list`; `required`: the array is.
wisp_status check_array(const wisp_array &array, uint64_t count, bool required, const char *list, uint32_t i,
                        const char *member, wisp_error *error) {
    const auto fault = [&](const char *what) {
        return refuse(error, WISP_BAD_SCENE, list, "[", uint64_t{i}, "].", member, what);
    };
    if (!array.data) return required && count > 0 ? fault(".data: found NULL, expected numbers") : WISP_DONE;
    if (array.number != WISP_FLOAT32 && array.number != WISP_FLOAT64)
        return fault(".number: found none of wisp_number, expected WISP_FLOAT32 or WISP_FLOAT64");
    if (!is_addressable(array, count)) return fault(": stride times count is more than can be addressed");
    return WISP_DONE;
}

wisp_status count_smoke(const wisp_smoke &smoke, uint32_t i, Counts &counts, wisp_error *error) {
    const auto fault = [&](const char *what) {
        return refuse(error, WISP_BAD_SCENE, "smokes[", uint64_t{i}, "]", what);
    };
    if (smoke.kind == WISP_BOX) return WISP_DONE;
    if (smoke.kind == WISP_GRID) {
        uint64_t samples = 1;
        for (const uint32_t cells : smoke.cells) {
            if (cells == 0 || cells > INT32_MAX) return fault(".cells: expected 1 to 2147483647 along each axis");
            if (samples > (uint64_t{1} << 40) / cells) return fault(".cells: found more than 2^40, expected fewer");
            samples *= cells;
        }
        counts.samples += samples;
        return check_array(smoke.density, samples, true, "smokes", i, "density", error);
    }
    if (smoke.kind != WISP_PARTICLES)
        return fault(".kind: found none of wisp_smoke_kind, expected WISP_PARTICLES, WISP_GRID or WISP_BOX");
    if (smoke.count > UINT32_MAX) return fault(".count: found 2^32 particles or more, expected fewer");
    counts.particles += smoke.count;
    const struct {
        const char *name;
        const wisp_array &array;
        bool required;
    } arrays[] = {{"positions", smoke.positions, true}, {"radii", smoke.radii, false}, {"masses", smoke.masses, false}};
    for (const auto &of : arrays)
        if (const wisp_status status = check_array(of.array, smoke.count, of.required, "smokes", i, of.name, error))
            return status;
    return WISP_DONE;
}

wisp_status count_mesh(const wisp_mesh &mesh, uint32_t i, Counts &counts, wisp_error *error) {
    const auto fault = [&](const char *what) {
        return refuse(error, WISP_BAD_SCENE, "meshes[", uint64_t{i}, "]", what);
    };
    if (mesh.motion != WISP_STILL && mesh.motion != WISP_MOVING && mesh.motion != WISP_DEFORMING)
        return fault(".motion: found none of wisp_motion, expected WISP_STILL, WISP_MOVING or WISP_DEFORMING");
    if (mesh.triangle_count > UINT32_MAX || counts.triangles + mesh.triangle_count > UINT32_MAX)
        return fault(".triangle_count: found 2^32 triangles or more in all, expected fewer");
    counts.triangles += mesh.triangle_count;
    counts.moving_meshes += mesh.motion == WISP_MOVING && mesh.triangle_count > 0;
    if (!mesh.indices && mesh.vertex_count < 3 * mesh.triangle_count)
        return fault(".vertex_count: found fewer than 3 vertices a triangle, expected as many, or indices");
    if (const wisp_status status =
            check_array(mesh.positions, mesh.vertex_count, mesh.triangle_count > 0, "meshes", i, "positions", error))
        return status;
    return check_array(mesh.normals, mesh.vertex_count, false, "meshes", i, "normals", error);
}

wisp_status count_scene(const wisp_scene *scene, Counts &counts, wisp_error *error) {
    counts = {};
    if (!scene) return refuse(error, WISP_WRONG_USAGE, "scene: found NULL, expected a wisp_scene");
    if (const wisp_status status = check_version("scene", scene->version, error)) return status;
    const struct {
        const char *name;
        const void *first;
        uint32_t count;
    } lists[] = {{"lights", scene->lights, scene->light_count},
                 {"smokes", scene->smokes, scene->smoke_count},
                 {"meshes", scene->meshes, scene->mesh_count},
                 {"materials", scene->materials, scene->material_count}};
    for (const auto &list : lists)
        if (!list.first && list.count > 0)
            return refuse(error, WISP_BAD_SCENE, list.name, ": found NULL, expected ", uint64_t{list.count},
                          " of them");
    for (uint32_t i = 0; i < scene->smoke_count; ++i)
        if (const wisp_status status = count_smoke(scene->smokes[i], i, counts, error)) return status;
    for (uint32_t i = 0; i < scene->mesh_count; ++i)
        if (const wisp_status status = count_mesh(scene->meshes[i], i, counts, error)) return status;
    return WISP_DONE;
}

// The memory of a frame. What stands still in a sequence comes first: it is then where it was in the frame before, and
// what is kept of it fits (wisp_cache).
struct Arrays {
    wisp_frame *frame;
    Triangle *triangles;
    Material *materials;
    Instance *instances;
    Unit *spaces; // of instances
    LightSource *lights;
    SmokeDescription *smokes;
    Particle *particles;
    float *samples;
};

uint64_t bytes_of(const wisp_scene &scene, const Counts &counts) {
    return Arena::bytes<wisp_frame>(1) + Arena::bytes<Triangle>(counts.triangles) +
           Arena::bytes<Material>(scene.material_count) + Arena::bytes<Instance>(counts.moving_meshes) +
           Arena::bytes<Unit>(counts.moving_meshes) + Arena::bytes<LightSource>(scene.light_count) +
           Arena::bytes<SmokeDescription>(scene.smoke_count) + Arena::bytes<Particle>(counts.particles) +
           Arena::bytes<float>(counts.samples);
}

// Whether `bytes` of memory hold them all.
bool make_arrays(const wisp_scene &scene, const Counts &counts, Arena &arena, Arrays &arrays) {
    arrays.frame = arena.make<wisp_frame>(1);
    arrays.triangles = arena.make<Triangle>(counts.triangles);
    arrays.materials = arena.make<Material>(scene.material_count);
    arrays.instances = arena.make<Instance>(counts.moving_meshes);
    arrays.spaces = arena.make<Unit>(counts.moving_meshes);
    arrays.lights = arena.make<LightSource>(scene.light_count);
    arrays.smokes = arena.make<SmokeDescription>(scene.smoke_count);
    arrays.particles = arena.make<Particle>(static_cast<size_t>(counts.particles));
    arrays.samples = arena.make<float>(static_cast<size_t>(counts.samples));
    return arrays.frame && arrays.triangles && arrays.materials && arrays.instances && arrays.spaces && arrays.lights &&
           arrays.smokes && arrays.particles && arrays.samples;
}

// ---- Numbers

// The caller's numbers, of any alignment.
class Numbers {
  public:
    explicit Numbers(const wisp_array &array, int64_t per_element)
        : data_(static_cast<const unsigned char *>(array.data)), wide_(array.number == WISP_FLOAT64) {
        const int64_t size = wide_ ? sizeof(double) : sizeof(float);
        step_ = array.step ? array.step : size;
        stride_ = array.stride ? array.stride : (array.step ? per_element * array.step : per_element * size);
    }
    double at(uint64_t i, int64_t k = 0) const {
        const unsigned char *from = data_ + static_cast<int64_t>(i) * stride_ + k * step_;
        double wide;
        float narrow;
        if (!wide_) return std::memcpy(&narrow, from, sizeof narrow), static_cast<double>(narrow);
        return std::memcpy(&wide, from, sizeof wide), wide;
    }
    Double3 vector(uint64_t i) const { return {at(i, 0), at(i, 1), at(i, 2)}; }

  private:
    const unsigned char *data_;
    bool wide_;
    int64_t stride_, step_;
};

Double3 vector(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

// False for NaN, too.
bool is_within(double x, double least, double most) { return x >= least && x <= most; }
bool is_within(const Double3 &v, double least, double most) {
    return is_within(v.x, least, most) && is_within(v.y, least, most) && is_within(v.z, least, most);
}
bool is_number(double x) { return is_within(x, -largest_number, largest_number); }
bool is_number(const Double3 &v) { return is_within(v, -largest_number, largest_number); }
bool is_amount(double x) { return is_within(x, 0, largest_number); }
bool is_amount(const Double3 &v) { return is_within(v, 0, largest_number); }
bool is_direction(const Double3 &v) { return is_number(v) && largest_component(v) > 0; }

constexpr const char *numbers = ": expected numbers within +-1e30", *amounts = ": expected numbers from 0 to 1e30";

wisp_status check_camera(const wisp_scene &scene, wisp_error *error) {
    const auto fault = [&](const char *what) { return refuse(error, WISP_BAD_SCENE, what); };
    if (scene.width < 1 || scene.width > 65536 || scene.height < 1 || scene.height > 65536)
        return refuse(error, WISP_BAD_SCENE, "width, height: found ", uint64_t{scene.width}, " x ",
                      uint64_t{scene.height}, ", expected 1 to 65536 each");
    const wisp_camera &camera = scene.camera;
    const Double3 from = vector(camera.from), at = vector(camera.at), up = vector(camera.up);
    if (!is_number(from) || !is_number(at)) return refuse(error, WISP_BAD_SCENE, "camera.from, camera.at", numbers);
    if (!is_direction(up)) return fault("camera.up: expected a direction, not 0 0 0, within +-1e30");
    if (largest_component(at - from) == 0) return fault("camera.from, camera.at: found one point, expected two");
    if (are_parallel(at - from, up)) return fault("camera.up: found the direction of view, expected another");
    if (!(camera.angle > 0 && camera.angle < 180)) return fault("camera.angle: expected above 0 and below 180 degrees");
    if (!is_amount(vector(scene.background))) return refuse(error, WISP_BAD_SCENE, "background", amounts);
    if (!is_amount(vector(scene.ambient))) return refuse(error, WISP_BAD_SCENE, "ambient", amounts);
    return WISP_DONE;
}

wisp_status check_light(const wisp_light &light, uint32_t i, wisp_error *error) {
    const auto fault = [&](const char *member, const char *expected) {
        return refuse(error, WISP_BAD_SCENE, "lights[", uint64_t{i}, "].", member, expected);
    };
    if (light.kind < WISP_POINT || light.kind > WISP_CONSTANT)
        return fault("kind", ": found none of wisp_light_kind, expected WISP_POINT to WISP_CONSTANT");
    const bool spot = light.kind == WISP_SPOT, parallel = light.kind == WISP_PARALLEL;
    if (!parallel && !is_number(vector(light.position))) return fault("position", numbers);
    if ((spot || parallel) && !is_direction(vector(light.direction)))
        return fault("direction", ": expected a direction, not 0 0 0, within +-1e30");
    if (spot && !(light.degrees > 0 && light.degrees <= 360))
        return fault("degrees", ": expected above 0, at most 360 degrees");
    return is_amount(vector(light.color)) ? WISP_DONE : fault("color", amounts);
}

// ---- Smoke

// In the units of the caller. `particles` and `samples` are where its arrays go, and then where they end.
wisp_status read_smoke(const wisp_smoke &from, uint32_t i, SmokeDescription &smoke, Particle *&particles,
                       float *&samples, wisp_error *error) {
    const auto fault = [&](const char *member, const char *expected) {
        return refuse(error, WISP_BAD_SCENE, "smokes[", uint64_t{i}, "].", member, expected);
    };
    if (!is_amount(from.extinction)) return fault("extinction", amounts);
    if (!is_within(vector(from.albedo), 0, 1)) return fault("albedo", ": expected numbers from 0 to 1");
    if (!(from.phase > -1 && from.phase < 1)) return fault("phase", ": expected a number above -1 and below 1");
    if (!is_amount(vector(from.emission))) return fault("emission", amounts);
    smoke = {};
    smoke.albedo = vector(from.albedo);
    smoke.asymmetry = from.phase;
    smoke.emission = vector(from.emission);
    if (from.kind != WISP_PARTICLES) {
        const Double3 low = vector(from.low), high = vector(from.high);
        GridDescription &grid = smoke.grid;
        grid.center = (low + high) * 0.5;
        grid.half = (high - low) * 0.5;
        if (!is_number(low) || !is_number(high) || !is_within(grid.half, smallest_length, largest_number))
            return fault("low, high", ": expected corners within +-1e30, low < high by 2e-30 or more");
        const bool box = from.kind == WISP_BOX;
        grid.nx = box ? 1 : static_cast<int32_t>(from.cells[0]);
        grid.ny = box ? 1 : static_cast<int32_t>(from.cells[1]);
        grid.nz = box ? 1 : static_cast<int32_t>(from.cells[2]);
        grid.extinction = from.extinction;
        grid.axis[0] = {1, 0, 0}, grid.axis[1] = {0, 1, 0}, grid.axis[2] = {0, 0, 1};
        if (box) return WISP_DONE;
        grid.density = samples;
        const Numbers density(from.density, 1);
        for (uint64_t k = 0; k < samples_of_box(grid); ++k) {
            if (!is_amount(density.at(k)))
                return refuse(error, WISP_BAD_SCENE, "smokes[", uint64_t{i}, "].density[", k, "]", amounts);
            *samples++ = static_cast<float>(density.at(k));
        }
        return WISP_DONE;
    }
    if (from.kernel != WISP_SPLINE && from.kernel != WISP_POLY6)
        return fault("kernel", ": found none of wisp_kernel, expected WISP_SPLINE or WISP_POLY6");
    smoke.kernel = from.kernel == WISP_SPLINE ? Kernel::spline : Kernel::poly6;
    if (!from.radii.data && from.count > 0 && !is_within(from.radius, smallest_length, largest_number))
        return fault("radius", ": expected a number from 1e-30 to 1e30, or radii");
    if (!from.masses.data && !is_amount(from.mass))
        return fault("mass", ": expected a number from 0 to 1e30, or masses");
    if (from.radii.data && from.radius != 0) return fault("radius", ": found one beside radii, expected 0");
    if (from.masses.data && from.mass != 0) return fault("mass", ": found one beside masses, expected 0");
    const Numbers positions(from.positions, 3), radii(from.radii, 1), masses(from.masses, 1);
    for (uint64_t k = 0; k < from.count; ++k) {
        const auto fault_of = [&](const char *array, const char *expected) {
            return refuse(error, WISP_BAD_SCENE, "smokes[", uint64_t{i}, "].", array, "[", k, "]", expected);
        };
        Particle &particle = *particles++;
        particle.position = positions.vector(k);
        particle.h = from.radii.data ? radii.at(k) : from.radius;
        const double mass = from.masses.data ? masses.at(k) : from.mass;
        particle.area = from.extinction * mass;
        if (!is_number(particle.position)) return fault_of("positions", numbers);
        if (!is_within(particle.h, smallest_length, largest_number))
            return fault_of("radii", ": expected a number from 1e-30 to 1e30");
        if (!is_amount(mass)) return fault_of("masses", amounts);
    }
    return WISP_DONE;
}

// ---- Surfaces

// All triangles in the units of the caller, each mesh at `next` of its motion. Moving ones are in a space of their own.
wisp_status read_triangles(const wisp_mesh &mesh, uint32_t i, uint32_t material_count, Triangle *next,
                           wisp_error *error) {
    const auto fault = [&](const char *member, uint64_t k, const char *expected) {
        return refuse(error, WISP_BAD_SCENE, "meshes[", uint64_t{i}, "].", member, "[", k, "]", expected);
    };
    if (mesh.material >= material_count)
        return refuse(error, WISP_BAD_SCENE, "meshes[", uint64_t{i}, "].material: found ", uint64_t{mesh.material},
                      ", expected below ", uint64_t{material_count});
    const Numbers positions(mesh.positions, 3), normals(mesh.normals, 3);
    for (uint64_t k = 0; k < mesh.triangle_count; ++k) {
        Triangle &triangle = *next++;
        triangle = {};
        triangle.material = mesh.material;
        triangle.texture = -1;
        Double3 of_corners[3] = {};
        for (uint64_t corner = 0; corner < 3; ++corner) {
            const uint64_t place = 3 * k + corner, vertex = mesh.indices ? mesh.indices[place] : place;
            if (vertex >= mesh.vertex_count) return fault("indices", place, ": expected one below vertex_count");
            triangle.corner[corner] = positions.vector(vertex);
            if (!is_number(triangle.corner[corner])) return fault("positions", vertex, numbers);
            if (!mesh.normals.data) continue;
            of_corners[corner] = normals.vector(vertex);
            if (!is_number(of_corners[corner])) return fault("normals", vertex, numbers);
        }
        set_normals(triangle, of_corners);
    }
    return WISP_DONE;
}

wisp_status read_instance(const wisp_mesh &mesh, uint32_t i, uint64_t first, Instance &instance, wisp_error *error) {
    const double *m = mesh.transform;
    for (int k = 0; k < 12; ++k)
        if (!is_number(m[k])) return refuse(error, WISP_BAD_SCENE, "meshes[", uint64_t{i}, "].transform", numbers);
    instance = {};
    instance.first = static_cast<uint32_t>(first);
    instance.count = static_cast<uint32_t>(mesh.triangle_count);
    for (int k = 0; k < 3; ++k) instance.axis[k] = {m[3 * k], m[3 * k + 1], m[3 * k + 2]};
    instance.origin = {m[9], m[10], m[11]};
    instance.visible = has_inverse(instance.axis);
    return WISP_DONE;
}

// The triangles of each motion behind one another, and the instances, in the units of the caller.
wisp_status read_surfaces(const wisp_scene &from, const Arrays &arrays, Scene &scene, wisp_error *error) {
    uint64_t counts[3] = {}; // by wisp_motion
    for (uint32_t i = 0; i < from.mesh_count; ++i) counts[from.meshes[i].motion] += from.meshes[i].triangle_count;
    uint64_t next[3] = {0, counts[WISP_STILL], counts[WISP_STILL] + counts[WISP_MOVING]};
    scene.triangles = arrays.triangles;
    scene.static_count = static_cast<uint32_t>(counts[WISP_STILL]);
    scene.instance_triangle_count = static_cast<uint32_t>(counts[WISP_MOVING]);
    scene.deforming_count = static_cast<uint32_t>(counts[WISP_DEFORMING]);
    scene.instances = arrays.instances;
    scene.instance_count = 0;
    for (uint32_t i = 0; i < from.mesh_count; ++i) {
        const wisp_mesh &mesh = from.meshes[i];
        if (mesh.triangle_count == 0) continue;
        uint64_t &first = next[mesh.motion];
        if (const wisp_status status = read_triangles(mesh, i, from.material_count, arrays.triangles + first, error))
            return status;
        if (mesh.motion == WISP_MOVING)
            if (const wisp_status status =
                    read_instance(mesh, i, first, arrays.instances[scene.instance_count++], error))
                return status;
        first += mesh.triangle_count;
    }
    return WISP_DONE;
}

wisp_status read_materials(const wisp_scene &from, Material *materials, wisp_error *error) {
    for (uint32_t i = 0; i < from.material_count; ++i) {
        const wisp_material &m = from.materials[i];
        const auto fault = [&](const char *member, const char *expected) {
            return refuse(error, WISP_BAD_SCENE, "materials[", uint64_t{i}, "].", member, expected);
        };
        for (const auto *color : {&m.ambient, &m.diffuse, &m.specular})
            if (!is_amount(vector(*color))) return fault("ambient, diffuse, specular", amounts);
        if (!is_amount(m.shininess)) return fault("shininess", amounts);
        if (!is_within(m.transmission, 0, 1)) return fault("transmission", ": expected a number from 0 to 1");
        if (!is_within(m.index, 0, 1000)) return fault("index", ": expected a number from 0 to 1000");
        materials[i] = {vector(m.ambient), vector(m.diffuse), vector(m.specular), m.shininess, m.transmission, m.index};
    }
    return WISP_DONE;
}

// How far surfaces reach: the size of a component, and the radius of a sphere, about the middle, in the units of the
// caller; and their own unit.
struct Reach {
    double reach = 0, radius = 0;
    Unit own = {{0, 0, 0}, 1};
};

// Of still triangles; without any, of all others.
Reach reach_of_surfaces(const wisp_scene &from, const Scene &scene) {
    Extent extent;
    extent.add(scene.triangles, scene.static_count);
    if (!extent.any()) {
        for (uint32_t i = 0; i < scene.instance_count; ++i) {
            const Instance &instance = scene.instances[i];
            for (uint32_t k = instance.first; k < instance.first + instance.count; ++k)
                for (const Double3 &corner : scene.triangles[k].corner) extent.add(transformed_point(instance, corner));
        }
        extent.add(scene.triangles + scene.instance_triangle_count, scene.deforming_count);
    }
    const Double3 half = (extent.high - extent.low) * 0.5, middle = extent.middle();
    double farthest = largest_component(vector(from.camera.from) - middle);
    for (uint32_t i = 0; i < from.light_count; ++i)
        if (from.lights[i].kind != WISP_PARALLEL)
            farthest = std::max(farthest, largest_component(vector(from.lights[i].position) - middle));
    return {largest(half), length(half), unit_of_surfaces(middle, largest(half), farthest)};
}

// To the core's units, and each instance to a space of its own.
wisp_status normalize_surfaces(const Arrays &arrays, const Reach &reach, const Unit &unit, Scene &scene,
                               wisp_error *error) {
    const auto moves_far = [&] {
        return refuse(error, WISP_BAD_SCENE,
                      "meshes: something moves more than four times as far as what is still reaches, expected less");
    };
    for (uint32_t i = 0; i < scene.static_count; ++i) normalize(arrays.triangles[i], unit);
    for (uint32_t i = 0; i < scene.instance_count; ++i) {
        Instance &instance = arrays.instances[i];
        Extent own;
        own.add(arrays.triangles + instance.first, instance.count);
        Unit space = space_of(instance, own, reach.own);
        space.scale *= unit.scale / reach.own.scale;
        if (instance.visible) normalize(instance, space, unit);
        for (uint32_t k = instance.first; k < instance.first + instance.count; ++k) {
            normalize(arrays.triangles[k], space);
            for (const Double3 &corner : arrays.triangles[k].corner)
                if (instance.visible && !(largest_component(transformed_point(instance, corner)) <= coordinate_limit))
                    return moves_far();
        }
    }
    for (uint32_t i = scene.static_count + scene.instance_triangle_count; i < scene.triangle_count(); ++i) {
        normalize(arrays.triangles[i], unit);
        for (const Double3 &corner : arrays.triangles[i].corner)
            if (!(largest_component(corner) <= coordinate_limit)) return moves_far();
    }
    scene.ray_epsilon = ray_epsilon_of(reach.radius * unit.scale);
    return WISP_DONE;
}

// ---- All of it

wisp_status prepare(const wisp_scene &from, const Counts &counts, const Arrays &arrays, wisp_error *error) {
    wisp_frame &frame = *arrays.frame;
    frame.scene = {};
    frame.width = from.width;
    frame.height = from.height;
    Scene &scene = frame.scene;
    if (const wisp_status status = check_camera(from, error)) return status;
    for (uint32_t i = 0; i < from.light_count; ++i)
        if (const wisp_status status = check_light(from.lights[i], i, error)) return status;
    if (const wisp_status status = read_materials(from, arrays.materials, error)) return status;
    if (const wisp_status status = read_surfaces(from, arrays, scene, error)) return status;
    Particle *particles = arrays.particles;
    float *samples = arrays.samples;
    SmokeExtent extent;
    for (uint32_t i = 0; i < from.smoke_count; ++i) {
        const Particle *first = particles;
        SmokeDescription &smoke = arrays.smokes[i];
        if (const wisp_status status = read_smoke(from.smokes[i], i, smoke, particles, samples, error)) return status;
        extent.add(extent_of(first, static_cast<size_t>(particles - first), smoke));
    }

    const bool surfaces = counts.triangles > 0;
    const Reach reach = surfaces ? reach_of_surfaces(from, scene) : Reach{};
    Unit unit = surfaces ? reach.own : extent.any() ? unit_of_smoke(extent) : Unit{vector(from.camera.from), 1};
    if (extent.any()) {
        const double of_h = surfaces ? 1 / extent.smallest_h : unit.scale;
        if (!(reach_of(extent, unit.center) * of_h <= coordinate_limit))
            return refuse(error, WISP_BAD_SCENE,
                          "smokes: they reach more than 8192 of their smallest radii or cells from ",
                          surfaces ? "the meshes' middle" : "their middle",
                          ", expected at most that; is a point far away from all others?");
        unit.scale = scale_of(extent, unit, surfaces, reach.reach);
        // Scales are halved, so half of that suffices.
        constexpr uint64_t sure = static_cast<uint64_t>(coordinate_limit / least_size) / 2;
        if (!keeps_surfaces(reach.reach, unit.scale))
            return refuse(error, WISP_BAD_SCENE, "smokes: they reach too far beside the meshes, expected at most ",
                          sure, " times as far");
    }
    if (surfaces)
        if (const wisp_status status = normalize_surfaces(arrays, reach, unit, scene, error)) return status;
    particles = arrays.particles;
    samples = arrays.samples;
    for (uint32_t i = 0; i < from.smoke_count; ++i) {
        const bool of_particles = from.smokes[i].kind == WISP_PARTICLES;
        const size_t count = of_particles ? static_cast<size_t>(from.smokes[i].count) : 0;
        SmokeDescription &smoke = arrays.smokes[i];
        sort_canonically(particles, particles + count);
        normalize(smoke, particles, count, smoke.grid.density ? samples : nullptr, unit);
        particles += count;
        if (smoke.grid.density) samples += samples_of_box(smoke.grid);
    }

    for (uint32_t i = 0; i < from.light_count; ++i) {
        const wisp_light &light = from.lights[i];
        arrays.lights[i] = make_light(static_cast<LightKind>(light.kind), vector(light.position),
                                      vector(light.direction), light.degrees, vector(light.color), unit);
    }
    const wisp_camera &camera = from.camera;
    scene.camera = make_camera(vector(camera.from), vector(camera.at), vector(camera.up), camera.angle,
                               static_cast<int>(from.width), static_cast<int>(from.height), unit);
    scene.background = vector(from.background);
    scene.lights = arrays.lights;
    scene.light_count = from.light_count;
    scene.smokes = arrays.smokes;
    scene.smoke_count = from.smoke_count;
    const Double3 ambient = vector(from.ambient);
    const double dim = dim_radiances(scene, arrays.lights, arrays.smokes, surfaces ? &ambient : nullptr,
                                     radius_of(extent, surfaces, reach.radius * unit.scale, unit));
    for (uint32_t i = 0; i < from.material_count; ++i)
        arrays.materials[i] = make_material(arrays.materials[i], ambient, dim);
    scene.materials = arrays.materials;
    scene.material_count = from.material_count;
    return done(error);
}

} // namespace

} // namespace wisp::c_api

using namespace wisp;
using namespace wisp::c_api;

size_t wisp_prepared_bytes(const wisp_scene *scene) {
    Counts counts;
    if (count_scene(scene, counts, nullptr) != WISP_DONE) return 0;
    const uint64_t bytes = bytes_of(*scene, counts);
    return bytes <= SIZE_MAX ? static_cast<size_t>(bytes) : SIZE_MAX;
}

wisp_status wisp_prepare(const wisp_scene *scene, void *memory, size_t bytes, wisp_frame **frame, wisp_error *error) {
    if (!frame) return refuse(error, WISP_WRONG_USAGE, "frame: found NULL, expected where to put it");
    *frame = nullptr;
    Counts counts;
    if (const wisp_status status = count_scene(scene, counts, error)) return status;
    const uint64_t needed = bytes_of(*scene, counts);
    if (!memory) return refuse(error, WISP_NO_MEMORY, "memory: found NULL, expected ", needed, " bytes");
    if (bytes < needed)
        return refuse(error, WISP_NO_MEMORY, "memory: found ", uint64_t{bytes}, " bytes, expected ", needed);
    Arena arena(memory, bytes);
    Arrays arrays;
    if (!make_arrays(*scene, counts, arena, arrays))
        return refuse(error, WISP_NO_MEMORY, "memory: the scene is larger than can be addressed");
    if (const wisp_status status = prepare(*scene, counts, arrays, error)) return status;
    *frame = arrays.frame;
    return WISP_DONE;
}
