// Lengths and radiances are scaled by powers of two, so that only subtractions of the centre round, in double. The
// result is the same for every arithmetic; what depends on the arithmetic is done by the core.
#include "core/numbers/elementary.h"
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

// The particles of one smoke in the units of the scene, in the order of the file.
std::vector<Particle> load_particles(const std::vector<Node> &nodes, const SceneFile::SmokeVolume &smoke,
                                     const std::string &path, const Bytes &bytes, std::vector<std::string> &notes) {
    const Particles table = named_at(smoke.where, [&] { return parse_particles(path, bytes.data(), bytes.size()); });
    if (table.has_particle_radius)
        notes.push_back(path + ": its particle radii are not smoothing lengths and are not used");
    if (table.has_faces)
        notes.push_back(path +
                        ": its vertices are taken for particles of smoke, and its faces are left out; meshes stand "
                        "in scenes, as statements 'm'");
    if (!smoke.radius && table.smoothing_length.empty() && !table.position.empty())
        throw InputError(smoke.where, "no smoothing length, expected a line 'radius H' or an attribute 'h' in " + path);
    if (!smoke.mass && table.mass.empty() && !table.position.empty())
        throw InputError(smoke.where, "no mass, expected a line 'mass M' or an attribute 'mass' in " + path);

    const bool overrides_radius = smoke.chosen_radius && !table.smoothing_length.empty();
    if (overrides_radius || (smoke.chosen_mass && !table.mass.empty()))
        throw InputError(smoke.where,
                         path + " has what the file of the first frame leaves out, expected files alike, or a line '" +
                             (overrides_radius ? "radius H" : "mass M") + "' for all of them");

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
    const std::string path = smoke.path(frame);
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

void sort(std::vector<Particle> &particles) { sort_canonically(particles.data(), particles.data() + particles.size()); }

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
        sort(prepared.particles[i]); // receivers have another mass
    }
}

// Removes strays (strays.h), and warns of them.
void leave_out_strays(const SceneFile &file, const SceneFile::View &view, double time, int64_t frame,
                      PreparedScene &prepared) {
    Surroundings around = {};
    around.width = prepared.width;
    around.height = prepared.height;
    around.camera = make_camera(view.from, view.at, view.up, view.angle, around.width, around.height, {{0, 0, 0}, 1});
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
             " of " + smoke.path(frame) + " is at " + two_digits(p.x) + " " + two_digits(p.y) + " " + two_digits(p.z) +
             ", " + two_digits(stray.distance) + " smoothing lengths away"});
}

// Refuses a scene with a number beyond the range of the arithmetic.
void check_range(const std::string &name, const SceneFile &file, const Scene &scene, const Options &options) {
    const RangeFault fault = find_range_fault(scene, options.arithmetic, options.gather_radius, options.lights);
    if (!fault.what) return;
    const std::string where = fault.smoke < 0 ? name + ":1" : file.smokes[static_cast<size_t>(fault.smoke)].where;
    throw InputError(where, std::string(fault.what) + ", expected a scene that fits");
}

} // namespace

std::vector<SmokeExtent> extents_of(const PreparedScene &prepared) {
    std::vector<SmokeExtent> extents(prepared.smokes.size());
    for (size_t i = 0; i < extents.size(); ++i)
        extents[i] = extent_of(prepared.particles[i].data(), prepared.particles[i].size(), prepared.smokes[i]);
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
    prepared.particles.clear();
    prepared.volumes.clear();
    prepared.smokes.clear();
    prepared.lights.clear();
    prepared.notes.clear();
    prepared.warnings.clear();
    prepared.scene = {};
    const size_t smokes = file.smokes.size();
    prepared.particles.resize(smokes);
    prepared.volumes.resize(smokes);
    prepared.smokes.resize(smokes);
    for (size_t i = 0; i < smokes; ++i) {
        load(file.graph.nodes, file.smokes[i], frame, prepared.smokes[i], prepared.particles[i], prepared.volumes[i],
             prepared.notes);
    }
    // After the smoke: where it can be read, it has chosen a view.
    if (!file.view) throw InputError(name + ":1", "there is no view, expected a statement 'v from ...'");
    const double time = time_of(file, options, frame);
    const SceneFile::View view = view_at(*file.view, file.graph, time);
    prepared.width = options.width.value_or(file.view->width);
    prepared.height = options.height.value_or(file.view->height);
    // Until the unit is found particles are in the order of their files, so that errors can name them.
    const auto sort_all = [&] {
        for (std::vector<Particle> &particles : prepared.particles) sort(particles);
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
    const Unit unit = extent.any() ? find_unit(file, extents, prepared.particles, surfaces, options.arithmetic)
                      : surfaces   ? surfaces->own_unit()
                                   : Unit{view.from, 1};
    sort_all();
    if (surfaces) {
        surfaces->change_unit(unit);
        surfaces->pose(name, file, time);
    }
    const double radius = radius_of(extent, surfaces != nullptr, surfaces ? surfaces->radius() : 0, unit);

    prepared.center = unit.center;
    prepared.scale = unit.scale;
    for (size_t i = 0; i < smokes; ++i)
        normalize(prepared.smokes[i], prepared.particles[i].data(), prepared.particles[i].size(),
                  prepared.volumes[i].density.data(), unit);

    for (const SceneFile::Light &light : file.lights) {
        const Double3 position = light_position_at(light.position, light.name, file.graph, time);
        prepared.lights.push_back(make_light(light.kind, position, light.direction, light.degrees, light.color, unit));
    }

    Scene &scene = prepared.scene;
    scene.camera = make_camera(view.from, view.at, view.up, view.angle, prepared.width, prepared.height, unit);
    scene.background = file.background;
    scene.lights = prepared.lights.data();
    scene.light_count = static_cast<uint32_t>(prepared.lights.size());
    scene.smokes = prepared.smokes.data();
    scene.smoke_count = static_cast<uint32_t>(prepared.smokes.size());
    const double dim = dim_radiances(scene, prepared.lights.data(), prepared.smokes.data(),
                                     surfaces ? &file.ambient : nullptr, radius);
    if (prepared.surfaces) prepared.surfaces->show(scene, file, dim);
    check_range(name, file, scene, options);
}

} // namespace wisp
