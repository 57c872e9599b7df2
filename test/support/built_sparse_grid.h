// Sparse grids, resampled smoke, and the fluence in it, each with memory of its own.
#pragma once
#include "core/photons/fluence_grid.h"
#include "core/photons/irradiance_map.h"
#include "support/built_smoke.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <doctest/doctest.h>

namespace wisp::WISP_ARITH {

// A box from -half to half, of `cells` cells of `density_step` 1 along its shortest edge.
inline SmokeDescription box_smoke(const Double3 &half, double sigma, double cells) {
    SmokeDescription box = grid_smoke_of({1, 1, 1, nullptr, sigma, {0, 0, 0}, half, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
    // The shortest edge is cells - 0.5 lengths, which the plan rounds up to `cells` cells.
    box.smallest_h = box.largest_h = 2 * std::min({half.x, half.y, half.z}) / (cells - 0.5);
    return box;
}

inline std::vector<Particle> different_sizes(uint32_t count, double extent, double area) {
    std::vector<Particle> particles = cloud(count, extent, 1, area);
    for (size_t i = 0; i < particles.size(); ++i) particles[i].h = 1 + 0.25 * static_cast<double>(i % 5);
    return particles;
}

// Lists of smokes of all kinds, alone and together. All but the last two lists can be resampled.
struct SmokeLists {
    SmokeLists()
        : mixed(different_sizes(60, 4, 1)), apart(cloud(6, 14, 1, 1, 5)), sparse(20 * 6 * 11), full(9 * 12 * 5) {
        Sequence next{3};
        for (size_t i = 0; i < sparse.size(); ++i) sparse[i] = i % 20 < 3 || i % 97 == 0 ? float(next()) : 0.0f;
        for (float &d : full) d = float(next());
        const Double3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
        aligned = {20, 6, 11, sparse.data(), 0.7, {0.3, -2, 1}, {10, 3, 5.5}, {x, y, z}};
        GridDescription rotated = {9, 12, 5, full.data(), 0.7, {3, -2, 1}, {4.5, 6, 2.5}, {}};
        rotated.axis[0] = {0.6, 0.8, 0};
        rotated.axis[1] = {-0.8, 0.6, 0};
        rotated.axis[2] = z;
        const GridDescription block = {1, 1, 1, nullptr, 0.7, {3, -2, 1}, {4, 6, 3}, {x, y, z}};
        lists = {{smoke_of(mixed)},        {smoke_of(apart, Kernel::poly6), smoke_of(mixed)},
                 {grid_smoke_of(aligned)}, {box_smoke({4, 6, 3}, 0.7, 20)},
                 {grid_smoke_of(rotated)}, {smoke_of(apart), grid_smoke_of(rotated), grid_smoke_of(block)}};
    }
    std::vector<Particle> mixed, apart;
    std::vector<float> sparse, full;
    GridDescription aligned;
    std::vector<std::vector<SmokeDescription>> lists;
};
constexpr size_t resampled_lists = 4;

struct BuiltSparseGrid {
    BuiltSparseGrid(const std::vector<SmokeDescription> &sources_, double lengths) : sources(sources_) {
        scene.smokes = sources.data();
        scene.smoke_count = static_cast<uint32_t>(sources.size());
        plan = plan_sparse_grid(scene, lengths);
        memory.resize(plan.bytes);
        Arena arena(memory.data(), memory.size());
        bricks = make_sparse_grid(scene, lengths, arena);
        REQUIRE(bricks.ready);
    }
    std::vector<SmokeDescription> sources;
    Scene scene = {};
    SparseGridPlan plan;
    std::vector<unsigned char> memory;
    SparseGrid bricks;
};

struct Resampled {
    Resampled(const std::vector<SmokeDescription> &sources_, double density_step) : sources(sources_) {
        scene.smokes = sources.data();
        scene.smoke_count = static_cast<uint32_t>(sources.size());
        memory.resize(medium_bytes(scene, density_step));
        Arena arena(memory.data(), memory.size());
        medium = make_medium(scene, density_step, arena);
        REQUIRE(medium.ready);
        REQUIRE(medium.bricks);
    }
    const SparseGrid &bricks() const { return *medium.bricks; }
    const ResampledField &field(uint32_t smoke = 0) const { return medium.smokes[smoke].field.resampled; }
    std::vector<SmokeDescription> sources;
    Scene scene = {};
    std::vector<unsigned char> memory;
    Medium medium;
};

inline Settings brick_settings(int pixels, double density_step, uint64_t photons = 0) {
    Settings settings = small_settings(pixels);
    settings.method = Method::map;
    settings.density_step = settings.light_step = density_step;
    settings.photons = photons;
    return settings;
}
inline const std::vector<LightSource> sun_along_z = {{LightKind::parallel, {}, {0, 0, -1}, 2, {1, 1, 1}}};

// The photons of a scene, traced through resampled smoke: nodes every `spacing` cells.
struct TracedFluence {
    TracedFluence(const Scene &scene, const Settings &settings, int32_t spacing = 1,
                  const FlightRecorder *flights = nullptr)
        : count(plan_sparse_grid(scene, settings.density_step).count), needs(photon_needs(scene, settings)),
          sum_count(sums_of_fluence(needs, count, spacing)),
          memory(medium_bytes(scene, settings.density_step) + optical_depth_grid_bytes(count, scene.light_count, 1) +
                 fluence_bytes(scene, needs, count, spacing) + tent_bytes(count, spacing)),
          arena(memory.data(), memory.size()), medium(make_medium(scene, settings.density_step, arena)) {
        REQUIRE(medium.ready);
        for (uint32_t i = 0; i < scene.light_count; ++i) lights.push_back(make_light(scene.lights[i]));
        REQUIRE(make_optical_depth_grid(medium, lights.data(), scene.light_count, *medium.bricks, 1, arena,
                                        &statistics.rays.shadow, depths));
        sums = {arena.make<int64_t>(sum_count), sum_count, 0};
        REQUIRE(make_emission_distribution(scene, medium, depths, arena, distribution));
        const PhotonTracing tracing = {medium, nullptr, settings,   needs,         all_batches(settings),
                                       {},     arena,   statistics, Vec3(Real(0)), flights};
        REQUIRE(trace_fluence(tracing, depths, distribution, spacing, sums, deposits) == Status::done);
    }
    uint64_t count;
    PhotonNeeds needs;
    uint64_t sum_count;
    std::vector<unsigned char> memory;
    Arena arena;
    Medium medium;
    std::vector<Light> lights;
    OpticalDepthGrid depths;
    EmissionDistribution distribution;
    PhotonSums sums;
    Statistics statistics;
    FluenceSums deposits;
};

// The coordinates of a node in the lattice of all nodes.
inline Cell lattice_coordinates(const SparseGrid &bricks, uint32_t brick, uint32_t node, int32_t spacing = 1) {
    const Cell in = cell_of_index(nodes_along(spacing), node), &at = bricks.position[brick];
    const int32_t cells = brick_cells / spacing;
    return {at.x * cells + in.x, at.y * cells + in.y, at.z * cells + in.z};
}

} // namespace wisp::WISP_ARITH
