// The smoke of a scene, block by block.
#include "core/numbers/double_bits.h"
#include "core/smoke/medium.h"
#include "core/smoke/resampling.h"

namespace wisp::WISP_ARITH {

namespace {

bool any(const Color &c) { return largest(c) > Real(0); }

// For each particle, the fraction of the whole cross-section that lies before it, in units of 2^-32. The samples of a
// grid have tents of equal volume: for these it is the fraction of the density. The sums are integers, so the choice of
// a particle is the same in every arithmetic.
const uint32_t *area_fractions_before(const SmokeDescription &source, Arena &arena, Watch watch) {
    const uint32_t count = elements_of(source);
    uint32_t *before = arena.make<uint32_t>(count);
    if (!before) return nullptr;
    const GridDescription &grid = source.grid;
    const auto area = [&](uint32_t i) {
        return !source.is_grid() ? to_real<Real>(source.particles[i].area)
               : grid.density    ? to_real<Real>(grid.density[i])
                                 : Real(1);
    };
    Real largest_area = Real(0);
    watch.expect(uint64_t{count} / 4);
    for (uint32_t i = 0; i < count && watch.done_round(i, 16); ++i) largest_area = max(largest_area, area(i));
    uint64_t total = 0;
    const auto units = [&](uint32_t i) { // an area, in units of 2^-16 of the largest
        return static_cast<uint64_t>(floor_to_int(scale_pow2(area(i) / largest_area, 16)));
    };
    for (uint32_t i = 0; i < count && watch.done_round(i, 48); ++i) total += units(i);
    // sum / total as a fraction of 2^32, by long division in two halves of 16 bits: total < 2^47.
    uint64_t sum = 0;
    if (total == 0) total = 1; // all areas are too small for the arithmetic: all fractions are 0
    for (uint32_t i = 0; i < count; ++i) {
        if (!watch.done_round(i, 192)) return nullptr;
        const uint64_t high = (sum << 16) / total, rest = (sum << 16) % total;
        const uint64_t fraction = (high << 16) + (rest << 16) / total; // 2^32 behind the last area
        before[i] = static_cast<uint32_t>(min<uint64_t>(fraction, UINT32_MAX));
        sum += units(i);
    }
    return before;
}

} // namespace

uint64_t medium_bytes(const Scene &scene, double density_step) {
    uint64_t bytes = Arena::bytes<SmokeVolume>(scene.smoke_count);
    const bool resampled = total_order_key(density_step) > 0 && can_resample(scene);
    const SparseGridPlan bricks = resampled ? plan_sparse_grid(scene, density_step) : SparseGridPlan{};
    if (resampled) bytes += bricks.bytes + Arena::bytes<SparseGrid>(1);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &source = scene.smokes[i];
        bytes +=
            resampled && !source.empty() ? resampled_field_bytes(source, bricks.count) : density_field_bytes(source);
        const bool emits = any_above_zero(source.emission);
        if (emits) bytes += Arena::bytes<uint32_t>(elements_of(source));
    }
    return bytes;
}

Medium make_medium(const Scene &scene, double density_step, Arena &arena, Watch watch) {
    Medium medium = {};
    if (total_order_key(density_step) > 0 && can_resample(scene)) {
        SparseGrid *bricks = arena.make<SparseGrid>(1);
        if (!bricks) return medium;
        *bricks = make_sparse_grid(scene, density_step, arena, watch);
        if (!bricks->ready) return medium;
        medium.bricks = bricks;
    }
    SmokeVolume *smokes = arena.make<SmokeVolume>(scene.smoke_count);
    if (!smokes) return medium;
    medium.smokes = smokes;
    medium.count = scene.smoke_count;
    uint32_t dimensions = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &source = scene.smokes[i];
        SmokeVolume smoke = {};
        smoke.source = &source;
        smoke.albedo = vec_of(source.albedo);
        smoke.phase = Phase(to_real<Real>(source.asymmetry));
        smoke.emission = vec_of(source.emission);
        smoke.field = make_density_field(source, medium.bricks, dimensions, arena, watch);
        if (!smoke.field.ready()) return medium;
        if (!source.empty() && any(smoke.emission * (Color(Real(1)) - smoke.albedo))) {
            smoke.emitted_power =
                smoke.emission * (Color(Real(1)) - smoke.albedo) * (four_pi<Real> * to_real<Real>(source.total_area));
            if (any(smoke.emitted_power)) {
                smoke.area_fraction_before = area_fractions_before(source, arena, watch);
                if (!smoke.area_fraction_before) return medium;
            }
        }
        if (!source.empty()) {
            const bool first = medium.empty();
            const Box &bounds = smoke.field.bounds();
            medium.bounds.low = first ? bounds.low : min(medium.bounds.low, bounds.low);
            medium.bounds.high = first ? bounds.high : max(medium.bounds.high, bounds.high);
        }
        dimensions += dimensions_of(source);
        smokes[i] = smoke;
    }
    if (!medium.empty()) {
        medium.sphere.center = (medium.bounds.low + medium.bounds.high) * Real(0.5);
        Real radius_squared = Real(0), support = Real(0);
        for (uint32_t i = 0; i < medium.count; ++i) {
            const SmokeDescription &source = scene.smokes[i];
            if (!find_reach(source, medium.sphere.center, watch, radius_squared)) return medium;
            if (source.count > 0) support = max(support, Real(2) * to_real<Real>(source.largest_h));
        }
        medium.sphere.radius = sqrt(radius_squared) + support;
        for (uint32_t i = 0; i < medium.count; ++i) {
            const GridDescription &grid = scene.smokes[i].grid;
            if (scene.smokes[i].is_grid())
                medium.sphere.radius = max(medium.sphere.radius, length(vec_of(grid.center) - medium.sphere.center) +
                                                                     length(vec_of(grid.half)));
        }
    }
    medium.ready = true;
    return medium;
}

bool find_reach(const SmokeDescription &smoke, const Vec3 &from, Watch watch, Real &squared) {
    for (uint32_t i = 0; i < smoke.count; ++i) {
        if (!watch.done_round(i, 32)) return false;
        const Vec3 d = vec_of(smoke.particles[i].position) - from;
        squared = max(squared, dot(d, d));
    }
    return true;
}

Real optical_depth(const Medium &medium, const Ray &ray, Real end) {
    Real depth = Real(0);
    for (uint32_t i = 0; i < medium.count; ++i) depth += optical_depth(medium.smokes[i].field, ray, end);
    return depth;
}

MediumCollision first_collision(const Medium &medium, const Ray &ray, Real end, Event event) {
    MediumCollision nearest = {false, end, 0, 0};
    for (uint32_t i = 0; i < medium.count; ++i) {
        const Collision collision = first_collision(medium.smokes[i].field, ray, nearest.distance, event);
        if (collision.found) nearest = {true, collision.distance, i, collision.element};
    }
    return nearest;
}

bool meets_smoke(const Medium &medium, const SparseGrid &bricks, uint32_t brick, const Cell &node, int32_t spacing) {
    const Cell low = {max(node.x - spacing, 0), max(node.y - spacing, 0), max(node.z - spacing, 0)};
    const Cell high = {min(node.x + spacing, brick_cells), min(node.y + spacing, brick_cells),
                       min(node.z + spacing, brick_cells)};
    if (!medium.bricks) return majorant(medium, {node_of(bricks, brick, low), node_of(bricks, brick, high)}) > Real(0);
    const Cell count = {nodes_along(1), nodes_along(1), nodes_along(1)};
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (!medium.smokes[i].field.is_resampled) continue;
        const Real *sigma = medium.smokes[i].field.resampled.nodes(brick);
        for (int32_t z = low.z; z <= high.z; ++z)
            for (int32_t y = low.y; y <= high.y; ++y)
                for (int32_t x = low.x; x <= high.x; ++x)
                    if (sigma[index_of(count, {x, y, z})] > Real(0)) return true;
    }
    return false;
}

bool may_bend_in(const Medium &medium, int32_t spacing, uint32_t brick) {
    const Real change = sum_of_resampled(
        medium, [brick](const ResampledField &field) { return field.majorants[brick] - field.minorants[brick]; });
    return change * (largest(medium.bricks->cell) * Real(spacing * spacing)) > max_bend;
}

Bend bend_of_cell(const Medium &medium, int32_t spacing, uint32_t brick, uint32_t node) {
    constexpr int32_t n = nodes_along(1);
    Real least = Real(0), greatest = Real(0);
    for (uint32_t i = 0; i < medium.count; ++i) {
        const DensityField &field = medium.smokes[i].field;
        if (!field.is_resampled) continue;
        Real low, high;
        range_of_corners(field.resampled.nodes(brick) + node, n, n * n, low, high);
        least += low;
        greatest += high;
    }
    const Real change = greatest - least, cell = largest(medium.bricks->cell);
    return {change * (cell * Real(spacing * spacing)) > max_bend, change * cell > max_bend ? greatest : Real(0)};
}

Bend bend_at(const Medium &medium, int32_t spacing, const Vec3 &x) {
    const uint32_t brick = medium.bricks ? brick_at(*medium.bricks, cell_at(medium.bricks->lattice, x)) : no_brick;
    if (brick == no_brick || !may_bend_in(medium, spacing, brick)) return {false, Real(0)};
    return bend_of_cell(medium, spacing, brick, find_cell(position_in(*medium.bricks, brick, x), 1).node);
}

} // namespace wisp::WISP_ARITH
