// Lengths and radiances are scaled by powers of two, so that only subtractions of the centre round, in double. The
// result is the same for every arithmetic; what depends on the arithmetic is done by the core.
#include "core/numbers/elementary.h"
#include "core/smoke/grid_samples.h"
#include "host/base/double3_algebra.h"
#include "host/base/error.h"
#include "host/base/files.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/formats/particles.h"
#include "host/prepare/decimate.h"
#include "host/prepare/motion.h"
#include "host/prepare/prepare.h"
#include "host/prepare/strays.h"
#include "host/prepare/unit.h"
#include "host/scene/placement.h"
#include "wisp/settings.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace wisp {

namespace {

void sort_canonically(std::vector<Particle> &particles) {
    std::sort(particles.begin(), particles.end(), [](const Particle &a, const Particle &b) {
        return std::make_tuple(a.position.x, a.position.y, a.position.z, a.h, a.area) <
               std::make_tuple(b.position.x, b.position.y, b.position.z, b.h, b.area);
    });
}

// What `read` reads: a fault of a smoke's file is one of the line that names it.
template <class Read> auto named_at(const std::string &where, Read read) {
    try {
        return read();
    } catch (const InputError &error) {
        throw InputError(where, error.what());
    }
}

// The particles of one smoke in the units of the scene, in the order of the file.
std::vector<Particle> load_particles(const std::vector<Node> &nodes, const SceneFile::SmokeVolume &smoke,
                                     const std::string &path, const Bytes &bytes, std::vector<std::string> &notes) {
    const Particles table = named_at(smoke.where, [&] { return parse_particles(path, bytes.data(), bytes.size()); });
    if (table.has_particle_radius)
        notes.push_back(path + ": its particle radii are not smoothing lengths and are not used");
    if (!smoke.radius && table.smoothing_length.empty() && !table.position.empty())
        throw InputError(smoke.where, "no smoothing length, expected a line 'radius H' or an attribute 'h' in " + path);
    if (!smoke.mass && table.mass.empty() && !table.position.empty())
        throw InputError(smoke.where, "no mass, expected a line 'mass M' or an attribute 'mass' in " + path);

    const double scale = scale_in_world(nodes, smoke.node);
    require_memory(smoke.where, "the smoke", table.position.size() * sizeof(Particle));
    std::vector<Particle> particles(table.position.size());
    double farthest = 0, smallest_h = 1e300;
    for (size_t i = 0; i < particles.size(); ++i) {
        const Double3 p = {table.position[i][0], table.position[i][1], table.position[i][2]};
        Particle &particle = particles[i];
        particle.position = placed_in_world(nodes, smoke.node, p);
        particle.h = (smoke.radius ? *smoke.radius : table.smoothing_length[i]) * scale;
        if (!(particle.h >= 1e-100 && particle.h <= 1e100))
            throw InputError(smoke.where, "a smoothing length is outside 1e-100 to 1e100, expected one within");
        particle.area = smoke.extinction.value_or(1) * (smoke.mass ? *smoke.mass : table.mass[i]);
        for (double x : {p.x, p.y, p.z}) farthest = std::max(farthest, std::fabs(x));
        smallest_h = std::min(smallest_h, particle.h);
    }
    // Files hold float32, whose spacing far from 0 may be coarse beside the smoothing length.
    if (!particles.empty() && farthest * scale * 0x1p-24 > 0.01 * smallest_h)
        notes.push_back(path +
                        ": as 32-bit numbers its positions are coarser than a hundredth of the smoothing length");
    return particles;
}

// A box of one cell in the units of the scene, transformed as particles are.
// `low` and `high` are its corners along the axes.
GridDescription place_grid(const std::vector<Node> &nodes, const SceneFile::SmokeVolume &smoke,
                           const std::array<Double3, 3> &axis, const Double3 &low, const Double3 &high) {
    GridDescription grid = {};
    grid.nx = grid.ny = grid.nz = 1;
    grid.extinction = smoke.extinction.value_or(1);
    const Double3 middle = (low + high) * 0.5;
    grid.center = placed_in_world(nodes, smoke.node, axis[0] * middle.x + axis[1] * middle.y + axis[2] * middle.z);
    grid.half = (high - low) * (0.5 * scale_in_world(nodes, smoke.node));
    for (double half : {grid.half.x, grid.half.y, grid.half.z})
        if (!(half >= 1e-100 && half <= 1e100))
            throw InputError(smoke.where, "an edge of the grid is outside 1e-100 to 1e100, expected one within");
    for (size_t i = 0; i < 3; ++i) grid.axis[i] = turned_in_world(nodes, smoke.node, axis[i]);
    return grid;
}

// Loads one smoke, in the units of the scene: into `particles` or `volume`, and the rest into `source`.
void load(const std::vector<Node> &nodes, const SceneFile::SmokeVolume &smoke, int64_t frame, SmokeDescription &source,
          std::vector<Particle> &particles, Volume &volume, std::vector<std::string> &notes) {
    source.kernel = smoke.kernel;
    source.albedo = smoke.albedo;
    source.asymmetry = smoke.phase;
    source.emission = smoke.emission;
    if (smoke.box) {
        source.grid = place_grid(nodes, smoke, Volume().axis, smoke.box->low, smoke.box->high);
        source.grid.extinction *= smoke.box->density;
        return;
    }
    const std::string path = numbered(smoke.file, smoke.first_frame + frame * smoke.frame_step);
    const Bytes bytes = named_at(smoke.where, [&] { return read_file(path); });
    if (!is_volume(bytes.data(), bytes.size())) {
        if (!smoke.grid.empty())
            throw InputError(smoke.where,
                             "found 'grid', expected none for " + path + ": only density grids have names");
        particles = load_particles(nodes, smoke, path, bytes, notes);
        return;
    }
    if (!smoke.of_particles.key.empty())
        throw InputError(smoke.of_particles.where, "found '" + smoke.of_particles.key +
                                                       "', expected none for the density grid " + path +
                                                       ": only particles have it");
    volume = named_at(smoke.where, [&] { return parse_volume(path, bytes.data(), bytes.size(), smoke.grid); });
    source.grid = place_grid(nodes, smoke, volume.axis, {volume.low[0], volume.low[1], volume.low[2]},
                             {volume.high[0], volume.high[1], volume.high[2]});
    volume.describe_samples(source.grid);
}

// --thin: removes negligible particles. This comes first, so that the extent of the smoke is that of the particles that
// stay.
void decimate(const SceneFile &file, double epsilon, PreparedScene &prepared) {
    std::vector<LightSource> lights;
    for (const SceneFile::Light &l : file.lights) lights.push_back({l.kind, l.position, l.direction, 2, l.color});
    const auto removals = find_negligible(prepared.particles, prepared.smokes, file.view->from, lights, epsilon);
    for (size_t i = 0; i < removals.size(); ++i) {
        if (prepared.particles[i].empty()) continue;
        size_t moved = 0;
        for (const Removal &r : removals[i]) moved += r.mass_receiver != r.index;
        prepared.notes.push_back("smoke " + std::to_string(i + 1) + ": --thin leaves out " +
                                 std::to_string(removals[i].size()) + " of " +
                                 std::to_string(prepared.particles[i].size()) + " particles; " + std::to_string(moved) +
                                 " give their mass to a neighbour");
        remove_particles(prepared.particles[i], removals[i]);
        sort_canonically(prepared.particles[i]); // receivers have another mass
    }
}

// The unit of --step for a grid: the shortest edge of its cells. For a box: a twentieth of its shortest edge.
double step_length(const GridDescription &grid) {
    if (!grid.density) return std::min({grid.half.x, grid.half.y, grid.half.z}) * 0.1;
    return 2 * std::min({grid.half.x / grid.nx, grid.half.y / grid.ny, grid.half.z / grid.nz});
}

// Half the edges of the axis-aligned box around a rotated grid.
Double3 aligned_half(const GridDescription &grid) {
    const Double3 *a = grid.axis, &h = grid.half;
    return {std::fabs(a[0].x) * h.x + std::fabs(a[1].x) * h.y + std::fabs(a[2].x) * h.z,
            std::fabs(a[0].y) * h.x + std::fabs(a[1].y) * h.y + std::fabs(a[2].y) * h.z,
            std::fabs(a[0].z) * h.x + std::fabs(a[1].z) * h.y + std::fabs(a[2].z) * h.z};
}

// Scales one smoke to normalised lengths, and sums up its area and range of smoothing lengths. A grid's largest density
// becomes 1 to 2, so that fixed point keeps the digits of every sample.
void normalize(SmokeDescription &source, std::vector<Particle> &particles, std::vector<float> &densities,
               const Double3 &center, double scale) {
    for (Particle &p : particles) {
        p.position = (p.position - center) * scale;
        p.h *= scale;
        p.area *= scale * scale;
        source.smallest_h = source.largest_h == 0 ? p.h : std::min(source.smallest_h, p.h);
        source.largest_h = std::max(source.largest_h, p.h);
        source.total_area += p.area;
    }
    source.particles = particles.data();
    source.count = static_cast<uint32_t>(particles.size());
    if (!source.is_grid()) return;
    GridDescription &grid = source.grid;
    grid.center = (grid.center - center) * scale;
    grid.half = grid.half * scale;
    grid.extinction /= scale;
    float densest = 0;
    for (float density : densities) densest = std::max(densest, density);
    if (densest > 0) {
        const int e = exponent_of(static_cast<double>(densest));
        for (float &density : densities) density = std::ldexp(density, -e);
        grid.extinction = std::ldexp(grid.extinction, e);
    }
    source.smallest_h = source.largest_h = step_length(grid);
    double sum = grid.density ? 0 : 1;
    for (float density : densities) sum += static_cast<double>(density);
    // The integral of a sample's trilinear tent is the volume of a cell.
    source.total_area =
        grid.extinction * sum * (8 * grid.half.x * grid.half.y * grid.half.z / static_cast<double>(samples_of_box(grid)));
}

Camera make_camera(const SceneFile::View &view, int width, int height, const Double3 &center, double scale) {
    double sine, cosine;
    sincos_turns(view.angle / 720, sine, cosine);
    // The angle is between the centres of the first and the last row; of a single row, its height.
    const double pixel = 2 * sine / cosine / std::max(height - 1, 1);
    const Double3 forward = unit(view.at - view.from), right = unit(cross(forward, view.up)),
                  up = cross(right, forward);
    Camera camera;
    camera.origin = (view.from - center) * scale;
    camera.right = right * pixel;
    camera.down = up * -pixel;
    camera.corner = forward - camera.right * (0.5 * width) - camera.down * (0.5 * height);
    return camera;
}

// Removes strays (strays.h), and warns of them.
void leave_out_strays(const SceneFile &file, const SceneFile::View &view, double time, int64_t frame,
                      PreparedScene &prepared) {
    Surroundings around = {};
    around.width = prepared.width;
    around.height = prepared.height;
    around.camera = make_camera(view, around.width, around.height, {0, 0, 0}, 1);
    around.points.push_back(view.from);
    for (const SceneFile::Light &light : file.lights)
        if (light.kind == LightKind::parallel)
            around.beams.push_back(light.direction);
        else
            around.points.push_back(light_position_at(light.position, light.name, file.graph, time));
    if (prepared.surfaces) {
        const Double3 &middle = prepared.surfaces->own_unit().center;
        const double reach = prepared.surfaces->reach();
        for (const double side : {-reach, reach}) around.points.push_back(middle + Double3{side, side, side});
        for (const FileMaterial &m : file.graph.materials)
            around.mirrors |= largest(m.specular) > 0 || m.transmission > 0;
    }
    for (const SmokeDescription &smoke : prepared.smokes)
        if (smoke.is_grid())
            for (const double side : {-1.0, 1.0})
                around.points.push_back(smoke.grid.center + aligned_half(smoke.grid) * side);
    const std::vector<Stray> strays = remove_strays(prepared.particles, around);
    if (strays.empty()) return;
    const Stray &stray = *std::max_element(strays.begin(), strays.end(),
                                           [](const Stray &a, const Stray &b) { return a.distance < b.distance; });
    const SceneFile::SmokeVolume &smoke = file.smokes[stray.smoke];
    const Double3 &p = stray.position;
    prepared.warnings.push_back(
        {"strays", smoke.where,
         std::to_string(strays.size()) + (strays.size() == 1 ? " particle is" : " particles are") +
             " left out, too far from everything else for a picture to show: point " + std::to_string(stray.index) +
             " of " + numbered(smoke.file, smoke.first_frame + frame * smoke.frame_step) + " is at " + two_digits(p.x) +
             " " + two_digits(p.y) + " " + two_digits(p.z) + ", " + two_digits(stray.distance) +
             " smoothing lengths away"});
}

// The largest irradiance of the light in the ball of `radius` around `middle`. Distances below half the radius count as
// that.
double brightness(const LightSource &light, const Double3 &middle, double radius) {
    const double color = largest(light.color);
    if (light.kind == LightKind::parallel || light.kind == LightKind::constant) return color;
    const Double3 to_light = light.position - middle;
    const double distance = std::max(std::sqrt(dot(to_light, to_light)) - radius, std::max(radius, 1.0) * 0.5);
    return color / (distance * distance);
}

// As check_range(), for a scene with surfaces. Their corners are within coordinate_limit already.
void check_surface_range(const std::string &name, const PreparedScene &prepared, const Options &options) {
    const bool fixed = options.arithmetic == Arithmetic::fixed;
    const auto refuse = [&name](const std::string &what) {
        throw InputError(name + ":1", what + ", expected a scene that fits");
    };
    const double farthest = fixed ? 0x1p13 : 0x1p18;
    if (!(largest_component(prepared.scene.camera.origin) <= farthest))
        refuse("the camera is too far from the surfaces for this arithmetic");
    if (fixed && length(prepared.scene.camera.corner) > 0x1p15) refuse("the view is too wide for fixed point");
    double sum = 0;
    for (const LightSource &light : prepared.lights) {
        if (light.kind != LightKind::parallel && !(largest_component(light.position) <= farthest))
            refuse("a light is too far from the surfaces for this arithmetic");
        if (fixed && largest(light.color) > 0x1p30) refuse("a light is too strong for fixed point");
        sum += largest(light.color);
    }
    if (fixed && options.lights == LightChoice::cuts && sum > 0x1p30)
        refuse("the lights together are too strong for cuts in fixed point");
    if (prepared.scene.radiance_exponent > 120) refuse("it is too bright for a picture of 32-bit numbers");
    if (!fixed) return;
    for (uint32_t i = 0; i < prepared.scene.instance_count; ++i) {
        const Instance &instance = prepared.scene.instances[i];
        double largest_stretch = 0;
        for (int k = 0; instance.visible && k < 3; ++k)
            largest_stretch = std::max(
                {largest_stretch, largest_component(instance.axis[k]), largest_component(instance.inverse[k])});
        if (largest_stretch > 0x1p11) refuse("something is stretched more than 2048 times, too much for fixed point");
    }
    for (uint32_t i = 0; i < prepared.scene.material_count; ++i) {
        const Material &m = prepared.scene.materials[i];
        if (std::max({largest(m.ambient), largest(m.diffuse), largest(m.specular)}) > 4)
            refuse("a material is brighter than 4, too much for fixed point");
    }
}

// Refuses a scene with a number beyond the range of the arithmetic: that of float, or of fixed point, which ends at
// 2^31.
void check_range(const std::string &name, const SceneFile &file, const PreparedScene &prepared,
                 const SmokeExtent &extent, const Options &options) {
    if (!extent.any()) return;
    const auto refuse = [](const std::string &where, const std::string &what) {
        throw InputError(where, what + ", expected a scene that fits");
    };
    const std::string scene_line = name + ":1";
    const bool fixed = options.arithmetic == Arithmetic::fixed;
    const auto distance = [](const Double3 &p) { return std::sqrt(dot(p, p)); };
    double radius = 0, power = 0;
    for (size_t i = 0; i < prepared.smokes.size(); ++i) {
        const std::string &where = file.smokes[i].where;
        for (const Particle &p : prepared.particles[i]) {
            radius = std::max(radius, distance(p.position) + 2 * p.h);
            if (!(p.area <= (fixed ? 0x1p20 : 1e30) * p.h * p.h))
                refuse(where, "a particle's optical depth is too large for this arithmetic");
        }
        const SmokeDescription &smoke = prepared.smokes[i];
        const GridDescription &grid = smoke.grid;
        if (smoke.is_grid()) {
            radius = std::max(radius, distance(grid.center) + distance(grid.half));
            double densest = grid.density ? 0 : 1;
            for (float density : prepared.volumes[i].density) densest = std::max(densest, static_cast<double>(density));
            if (!(grid.extinction * densest <= (fixed ? 0x1p15 : 1e30)))
                refuse(where, "the smoke's extinction is too large for this arithmetic");
        }
        // 1 - |g| must keep some digits, and p = (1 + |g|) / (4 pi (1 - |g|)^2) must be in range.
        const double least = fixed ? 0x1p-16 : options.arithmetic == Arithmetic::f32 ? 0x1p-20 : 0x1p-40;
        if (!(1 - std::fabs(smoke.asymmetry) >= least))
            refuse(where, "the phase is nearer to 1 or -1 than this arithmetic can tell");
        power += 4 * 3.15 * largest(smoke.emission) * smoke.total_area;
        if (fixed && !smoke.is_grid() && smoke.total_area > 0x1p26)
            refuse(where, "the smoke's cross-section is too large for fixed point");
        if (fixed && smoke.largest_h * options.gather_radius > 0x1p14)
            refuse(where, "the gather radius is too large for fixed point");
    }
    if (distance(prepared.scene.camera.origin) > 0x1p18)
        refuse(scene_line, "the camera is more than 262144 smoothing lengths from the smoke");
    if (fixed && distance(prepared.scene.camera.corner) > 0x1p15) // the longest ray before it is normalised
        refuse(scene_line, "the view is too wide for fixed point");
    if (fixed && extent.largest_h > 4096 * extent.smallest_h)
        refuse(scene_line, "smoothing lengths differ by more than 4096, too much for fixed point");
    for (const LightSource &light : prepared.lights) {
        const double color = largest(light.color), d = distance(light.position) + radius;
        const bool has_position = light.kind != LightKind::parallel;
        if (has_position && d > (fixed ? 0x1p14 : 0x1p18))
            refuse(scene_line, "a light is more than " + std::to_string(fixed ? 16384 : 262144) +
                                   " smoothing lengths from the smoke, too far for this arithmetic");
        power += color * 4 * 3.15 *
                 (light.kind == LightKind::parallel   ? radius * radius
                  : light.kind == LightKind::constant ? d * d
                                                      : 1);
        if (fixed && color > 0x1p30) refuse(scene_line, "a light is too strong for fixed point");
    }
    if (fixed && power > 0x1p30) refuse(scene_line, "the lights' power is too large for fixed point");
}

} // namespace

std::vector<SmokeExtent> extents_of(const PreparedScene &prepared) {
    std::vector<SmokeExtent> extents(prepared.smokes.size());
    for (size_t i = 0; i < extents.size(); ++i) {
        for (const Particle &p : prepared.particles[i]) extents[i].add(p.position, p.h);
        const GridDescription &grid = prepared.smokes[i].grid;
        if (!prepared.smokes[i].is_grid()) continue;
        extents[i].add(grid.center - aligned_half(grid), step_length(grid));
        extents[i].add(grid.center + aligned_half(grid), step_length(grid));
    }
    return extents;
}

int64_t frame_count_of(const SceneFile &file, const Options &options) {
    return options.frame_count.value_or(file.animation ? file.animation->frames : 1);
}

double time_of(const SceneFile &file, const Options &options, int64_t frame) {
    if (!file.animation) return 0;
    return time_of_frame(file.animation->start, file.animation->end, frame_count_of(file, options), frame);
}

void prepare_scene(const std::string &name, const SceneFile &file, const Options &options, int64_t frame,
                   PreparedScene &prepared) {
    if (!file.view) throw InputError(name + ":1", "there is no view, expected a statement 'v from ...'");
    const double time = time_of(file, options, frame);
    const SceneFile::View view = view_at(*file.view, file.graph, time);
    prepared.particles.clear();
    prepared.volumes.clear();
    prepared.smokes.clear();
    prepared.lights.clear();
    prepared.notes.clear();
    prepared.warnings.clear();
    prepared.scene = {};
    prepared.width = options.width.value_or(file.view->width);
    prepared.height = options.height.value_or(file.view->height);

    const size_t smokes = file.smokes.size();
    prepared.particles.resize(smokes);
    prepared.volumes.resize(smokes);
    prepared.smokes.resize(smokes);
    for (size_t i = 0; i < smokes; ++i) {
        load(file.graph.nodes, file.smokes[i], frame, prepared.smokes[i], prepared.particles[i], prepared.volumes[i],
             prepared.notes);
    }
    // Until the unit is found particles are in the order of their files, so that errors can name them.
    const auto sort_all = [&] {
        for (std::vector<Particle> &particles : prepared.particles) sort_canonically(particles);
    };
    if (options.decimate > 0) {
        sort_all();
        decimate(file, options.decimate, prepared);
    }
    if (file.graph.has_surfaces() && !prepared.surfaces)
        prepared.surfaces.emplace(name, file, file.animation ? file.animation->start : 0);
    PreparedSurfaces *surfaces = prepared.surfaces ? &*prepared.surfaces : nullptr;
    std::vector<SmokeExtent> extents = extents_of(prepared);
    if (is_wide(extent_of_all(extents), surfaces)) {
        leave_out_strays(file, view, time, frame, prepared);
        extents = extents_of(prepared);
    }
    const SmokeExtent extent = extent_of_all(extents);
    const auto [center, scale] = extent.any()
                                     ? find_unit(file, extents, prepared.particles, surfaces, options.arithmetic)
                                 : surfaces ? surfaces->own_unit()
                                            : Unit{view.from, 1};
    sort_all();
    double radius = 0; // around everything
    if (surfaces) {
        surfaces->change_unit({center, scale});
        surfaces->pose(name, file, time);
        radius = surfaces->radius();
        if (extent.any())
            radius = std::max({radius, length(extent.low - center) * scale, length(extent.high - center) * scale});
    } else if (extent.any()) {
        radius = (0.5 * length(extent.high - extent.low) + 2 * extent.largest_h) * scale;
    }

    prepared.center = center;
    prepared.scale = scale;
    for (size_t i = 0; i < smokes; ++i)
        normalize(prepared.smokes[i], prepared.particles[i], prepared.volumes[i].density, center, scale);

    double brightest = std::max(largest(file.background), 0.0);
    for (const SceneFile::SmokeVolume &smoke : file.smokes) brightest = std::max(brightest, largest(smoke.emission));
    if (prepared.surfaces) brightest = std::max(brightest, largest(file.ambient));
    for (const SceneFile::Light &light : file.lights) {
        const Double3 position = light_position_at(light.position, light.name, file.graph, time);
        LightSource source = {light.kind, (position - center) * scale, {0, 0, 1}, 2, light.color};
        if (light.kind == LightKind::spot || light.kind == LightKind::parallel)
            source.direction = unit(light.direction);
        if (light.kind == LightKind::spot) {
            double sine, cosine; // 1 - cos x = 2 sin^2(x / 2), x half of the cone's angle
            sincos_turns(light.degrees / 1440, sine, cosine);
            source.one_minus_cosine = 2 * sine * sine;
        }
        if (light.kind == LightKind::point || light.kind == LightKind::spot)
            source.color = light.color * (scale * scale);
        prepared.lights.push_back(source);
        brightest = std::max(brightest, brightness(source, {0, 0, 0}, radius));
    }

    Scene &scene = prepared.scene;
    scene.camera = make_camera(view, prepared.width, prepared.height, center, scale);
    scene.radiance_exponent = brightest > 0 ? exponent_of(brightest) + 1 : 0;
    const double dim = std::ldexp(1.0, -scene.radiance_exponent);
    scene.background = file.background * dim;
    for (SmokeDescription &smoke : prepared.smokes) smoke.emission = smoke.emission * dim;
    for (LightSource &light : prepared.lights) light.color = light.color * dim;
    scene.lights = prepared.lights.data();
    scene.light_count = static_cast<uint32_t>(prepared.lights.size());
    scene.smokes = prepared.smokes.data();
    scene.smoke_count = static_cast<uint32_t>(prepared.smokes.size());
    if (prepared.surfaces) prepared.surfaces->show(scene, file, dim);
    if (prepared.surfaces) check_surface_range(name, prepared, options);
    check_range(name, file, prepared, extent, options);
}

} // namespace wisp
