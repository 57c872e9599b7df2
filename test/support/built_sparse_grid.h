// Bricks, resampled smoke, and what photons leave in it, over memory of the test's own.
#pragma once
#include "core/photons/irradiance_map.h"
#include "support/built_smoke.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <doctest/doctest.h>

namespace wisp::WISP_ARITH {

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

// The photons of a scene, traced through resampled smoke: nodes every `stride` cells.
struct TracedFluence {
    TracedFluence(const Scene &scene, const Settings &settings, int32_t stride = 1)
        : count(plan_sparse_grid(scene, settings.density_step).count),
          plan(plan_fluence(scene, settings, count, stride)),
          memory(medium_bytes(scene, settings.density_step) + optical_depth_grid_bytes(count, scene.light_count, 1) +
                 plan.bytes),
          arena(memory.data(), memory.size()), medium(make_medium(scene, settings.density_step, arena)) {
        REQUIRE(medium.ready);
        for (uint32_t i = 0; i < scene.light_count; ++i) lights.push_back(make_light(scene.lights[i]));
        REQUIRE(make_optical_depth_grid(medium, lights.data(), scene.light_count, *medium.bricks, 1, arena,
                                  &statistics.rays.shadow, depths));
        sums = {arena.make<int64_t>(plan.sums), plan.sums, 0};
        REQUIRE(make_emission_distribution(scene, medium, depths, arena, starts));
        REQUIRE(trace_fluence(medium, nullptr, depths, starts, settings, plan.needs, stride, all_batches(settings),
                                    Observer{}, arena, sums, statistics, deposits) == Status::done);
    }
    uint64_t count;
    FluencePlan plan;
    std::vector<unsigned char> memory;
    Arena arena;
    Medium medium;
    std::vector<Light> lights;
    OpticalDepthGrid depths;
    EmissionDistribution starts;
    PhotonSums sums;
    Statistics statistics;
    FluenceSums deposits;
};

// A node's place in the lattice of all nodes, which has no bricks.
inline Cell place_of_node(const SparseGrid &bricks, uint32_t brick, uint32_t node, int32_t stride = 1) {
    const Cell in = cell_of_index(nodes_along(stride), node), &at = bricks.position[brick];
    const int32_t cells = brick_cells / stride;
    return {at.x * cells + in.x, at.y * cells + in.y, at.z * cells + in.z};
}

// A box from -half to half, of `cells` cells of `density_step` 1 along its shortest edge.
inline SmokeDescription box_smoke(const Double3 &half, double sigma, double cells) {
    SmokeDescription box = grid_smoke_of({1, 1, 1, nullptr, sigma, {0, 0, 0}, half, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
    // As many fit, and a little: the plan takes the next smaller cell.
    box.smallest_h = box.largest_h = 2 * std::min({half.x, half.y, half.z}) / (cells - 0.5);
    return box;
}

} // namespace wisp::WISP_ARITH
