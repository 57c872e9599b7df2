// The layout of the sums that photons leave at nodes, and the fluence that is read from them.
#include "core/photons/fluence_sums.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr int32_t brick_nodes = nodes_along(1);
constexpr uint32_t units_of_tent = 2;      // of work
constexpr int32_t points_of_hard_cell = 4; // along an edge: where a surface or a hard face may cut a cell

// A fraction of a number of units of 2^-24, rounded to nearest.
int64_t units_of(Real weight, Real units) { return truncate(weight * units + Real(0.5)); }

// Deposits harmonics at the nearest node only: they vary little between nodes, and twelve numbers at eight corners
// would take long.
void deposit_harmonics(const FluenceSums &fluence, uint32_t brick, const Vec3 &p, Real power,
                       const SphericalHarmonics &halves) {
    const int32_t spacing = harmonic_spacing(fluence.spacing), n = nodes_along(spacing);
    const Vec3 q = p * (Real(n - 1) * Real(1.0 / brick_cells)) + Vec3(Real(0.5));
    const auto nearest = [n](Real x) { return min(truncate(max(x, Real(0))), n - 1); };
    const int32_t node = (nearest(q.z) * n + nearest(q.y)) * n + nearest(q.x);
    int64_t *sum =
        fluence.harmonics + (size_t{brick} * nodes_of(spacing) + static_cast<uint32_t>(node)) * harmonic_numbers;
    const Real units = scale_pow2(power, deposit_bits); // below 2^27: power is at most 3.75
    sum[0] += truncate(units);
    for (uint32_t i = 0; i < harmonic_count; ++i) sum[1 + i] += truncate(halves.value[i] * units);
}

// How a deposit at x, at `at` in the brick, is shared among the corners of its cell.
CornerWeights weights_of_corners(const FluenceSums &fluence, uint32_t brick, const CellPosition &at, const Vec3 &x) {
    CornerWeights weights;
    if (fluence.cut.any() && fluence.cut.is_cut(brick, at.node))
        find_weights_in_cut_cell(fluence.cut, brick, at, x, weights);
    else
        for (uint32_t corner = 0; corner < 8; ++corner) weights.of[corner] = corner_weight(at.t, corner);
    return weights;
}

} // namespace

uint64_t sums_of_fluence(const PhotonNeeds &needs, uint64_t bricks, int32_t spacing) {
    if (!needs.traced) return 0;
    return bricks * nodes_of(spacing) * ((needs.powers ? 3 : 1) + (needs.directions ? 3 : 0)) +
           (needs.harmonics ? bricks * nodes_of(harmonic_spacing(spacing)) * harmonic_numbers : 0);
}

Status lay_out_sums(const PhotonTracing &tracing, const SparseGrid &bricks, int32_t spacing, PhotonSums &sums,
                    FluenceSums &fluence) {
    const PhotonNeeds &needs = tracing.needs;
    const uint64_t nodes = uint64_t{bricks.count} * nodes_of(spacing);
    fluence = {&tracing.medium, &bricks,      spacing,      sums.values, nullptr, nullptr, needs.powers ? 3u : 1u,
               Color(Real(1)),  {Real(1), 0}, {Real(0), 0}, 0,           nullptr, nullptr};
    const uint64_t powers = nodes * fluence.channels, with_flux = powers + (needs.directions ? nodes * 3 : 0);
    const uint64_t numbers = sums_of_fluence(needs, bricks.count, spacing);
    if (needs.directions) fluence.flux = sums.values + powers;
    if (needs.harmonics) fluence.harmonics = sums.values + with_flux;
    if (sums.count != 0 && sums.count != numbers) return Status::size_mismatch;
    if (numbers > sums.capacity) return Status::out_of_memory;
    if (tracing.surfaces &&
        !find_cut_cells(*tracing.surfaces, bricks, spacing, tracing.arena, tracing.watch, fluence.cut))
        return Status::out_of_memory;
    if (sums.count == 0 && !fill(sums.values, numbers, int64_t{0}, tracing.watch)) return Status::stopped;
    sums.count = numbers;
    tracing.statistics.bytes.particle_map = numbers * sizeof(int64_t);
    return Status::done;
}

SphericalHarmonics halves_of(const Vec3 &direction) {
    SphericalHarmonics halves = harmonics_of(direction);
    for (Real &m : halves.value) m = max(Real(0), Real(0.5) * m + Real(0.5));
    return halves;
}

void deposit(const FluenceSums &fluence, uint32_t brick, const Vec3 &p, const Color &power, const Vec3 &direction,
             const SphericalHarmonics &halves) {
    const int32_t spacing = fluence.spacing;
    const int32_t n = nodes_along(spacing);
    const CellPosition at = find_cell(p, spacing);
    const size_t first = size_t{brick} * nodes_of(spacing) + at.node;
    const CornerWeights weight =
        weights_of_corners(fluence, brick, at, low_of(*fluence.bricks, brick) + p * fluence.bricks->cell);
    const auto node = [&](uint32_t corner) { return first + offset_of_corner(corner, n); };
    for (uint32_t c = 0; c < fluence.channels; ++c) {
        const Real units = scale_pow2(power[static_cast<int>(c)], deposit_bits);
        for (uint32_t corner = 0; corner < 8; ++corner)
            fluence.power[node(corner) * fluence.channels + c] += units_of(weight.of[corner], units);
    }
    if (!fluence.flux) return;
    const Vec3 flux = direction * (power.x + power.y + power.z);
    for (uint32_t corner = 0; corner < 8; ++corner)
        for (uint32_t c = 0; c < 3; ++c) {
            const Real units = scale_pow2(flux[static_cast<int>(c)], deposit_bits);
            const int64_t amount = units_of(weight.of[corner], abs(units));
            fluence.flux[node(corner) * 3 + c] += units < Real(0) ? -amount : amount;
        }
    if (fluence.harmonics) deposit_harmonics(fluence, brick, p, power.x + power.y + power.z, halves);
}

namespace {

// What the nodes of a brick along one axis give to the integral of sigma_t times the tent of a node: weights of nodes
// `first` to `last`, in sixths of a cell. In whole cells these are exact.
struct AxisWeights {
    int32_t first, last;
    Real weight[brick_nodes];
};

// The tent of node `at` is `spacing` cells wide to either side; smoke lies between `low` and `high`; all in cells from
// the low corner of the brick.
AxisWeights weights_along(int32_t at, int32_t spacing, Real low, Real high) {
    AxisWeights axis = {max(at - spacing, 0), min(at + spacing, brick_cells), {}};
    const auto tent = [&](int32_t t) { return Real(1) - Real(t < at ? at - t : t - at) / Real(spacing); };
    for (int32_t c = axis.first; c < axis.last; ++c) {
        const Real a = min(max(low - Real(c), Real(0)), Real(1)), b = min(max(high - Real(c), Real(0)), Real(1));
        if (!(a < b)) continue;
        // Between nodes c and c + 1, at u from a to b, the tent is p + q u and sigma_t is linear.
        const Real p = tent(c), q = tent(c + 1) - p;
        const Real one = Real(6) * (b - a), two = Real(3) * (b * b - a * a), three = Real(2) * (b * b * b - a * a * a);
        const Real above = p * two + q * three;
        axis.weight[c + 1] += above;
        axis.weight[c] += p * one + q * two - above;
    }
    return axis;
}

// The integrals of sigma_t 2^sigma_shift times the tents of a brick's nodes over that brick, in units of 1/216 of a
// cell.
__attribute__((noinline)) void find_tents_of_brick(const FluenceSums &fluence, uint32_t brick, Real *tents) {
    const SparseGrid &bricks = *fluence.bricks;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    const Vec3 low = position_in(bricks, brick, bricks.bounds.low),
               high = position_in(bricks, brick, bricks.bounds.high);
    AxisWeights along[3][brick_nodes];
    for (int axis = 0; axis < 3; ++axis)
        for (int32_t i = 0; i < n; ++i) along[axis][i] = weights_along(i * spacing, spacing, low[axis], high[axis]);
    for (uint32_t node = 0; node < nodes_of(spacing); ++node) {
        const Cell at = cell_of_index(n, node);
        const AxisWeights &x = along[0][at.x], &y = along[1][at.y], &z = along[2][at.z];
        Real sum = Real(0);
        for (uint32_t s = 0; s < fluence.medium->count; ++s) {
            if (!fluence.medium->smokes[s].field.is_resampled) continue;
            const Real *sigma = fluence.medium->smokes[s].field.resampled.nodes(brick);
            for (int32_t k = z.first; k <= z.last; ++k)
                for (int32_t j = y.first; j <= y.last; ++j) {
                    Real row = Real(0);
                    for (int32_t i = x.first; i <= x.last; ++i)
                        row += x.weight[i] *
                               scale_pow2(sigma[(k * brick_nodes + j) * brick_nodes + i], fluence.sigma_shift);
                    sum += y.weight[j] * z.weight[k] * row;
                }
        }
        tents[node] = sum;
    }
}

// Adds the integral of sigma_t over a cell, shared among its corners, by along^3 points: Gauss's for 2 along an edge,
// which suit smooth densities; else random ones, each in an equal part of the cell.
//   extinction_at(point in the brick, the same in the world)
//   share(its place in the cell, in the world, weights)       sets the weights
template <class Extinction, class Share>
void add_cell(const FluenceSums &fluence, uint32_t brick, uint32_t node, int32_t along, Pcg32 &generator, Real *tents,
              Extinction &&extinction_at, Share &&share) {
    constexpr Real gauss[2] = {Real(0.2113248654), Real(0.7886751346)};
    const int32_t points = along * along * along;
    const SparseGrid &bricks = *fluence.bricks;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    const Cell lowest = cell_of_index(n, node);
    const Real part = Real(1) / Real(along), of_point = Real(216 * spacing * spacing * spacing) / Real(points);
    for (int32_t point = 0; point < points; ++point) {
        const Cell in = cell_of_index(along, static_cast<uint32_t>(point));
        Vec3 t(gauss[in.x & 1], gauss[in.y & 1], gauss[in.z & 1]);
        if (along > 2) {
            t = Vec3(Real(in.x), Real(in.y), Real(in.z));
            for (int axis = 0; axis < 3; ++axis) t[axis] = (t[axis] + unit_half_open<Real>(generator())) * part;
        }
        const Vec3 p = (Vec3(Real(lowest.x), Real(lowest.y), Real(lowest.z)) + t) * Real(spacing);
        const Vec3 x = low_of(bricks, brick) + p * bricks.cell;
        if (!is_strictly_inside(bricks.bounds, x)) continue;
        const Real sigma = extinction_at(p, x);
        if (!(sigma > Real(0))) continue;
        CornerWeights weights;
        share(t, x, weights);
        const Real amount = scale_pow2(sigma, fluence.sigma_shift) * of_point;
        for (uint32_t corner = 0; corner < 8; ++corner)
            tents[node + offset_of_corner(corner, n)] += weights.of[corner] * amount;
    }
}

// Within cut cells the corners' weights are others: adds the integrals of what these differ by from tents.
void restrict_tents_of_brick(const FluenceSums &fluence, uint32_t brick, Real *tents) {
    Pcg32 generator(brick);
    for (uint32_t node = 0; node < nodes_of(fluence.spacing); ++node) {
        if (!fluence.cut.is_cut(brick, node)) continue;
        add_cell(
            fluence, brick, node, points_of_hard_cell, generator, tents,
            [&](const Vec3 &p, const Vec3 &) {
                return sum_of_resampled(*fluence.medium,
                                        [&](const ResampledField &field) { return extinction(field, brick, p); });
            },
            [&](const Vec3 &t, const Vec3 &x, CornerWeights &weights) {
                find_weights_in_cut_cell(fluence.cut, brick, {node, t}, x, weights);
                for (uint32_t corner = 0; corner < 8; ++corner) weights.of[corner] -= corner_weight(t, corner);
            });
    }
}

// Exact densities of grids may end at a hard face within a cell.
void find_exact_tents_of_brick(const FluenceSums &fluence, uint32_t brick, Real *tents) {
    const SparseGrid &bricks = *fluence.bricks;
    const Medium &medium = *fluence.medium;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    Pcg32 generator(brick);
    bool has_grids = false;
    for (uint32_t i = 0; i < medium.count; ++i) has_grids = has_grids || medium.smokes[i].field.is_grid();
    for (uint32_t node = 0; node < nodes_of(spacing); ++node) tents[node] = Real(0);
    for (uint32_t node = 0; node < nodes_of(spacing); ++node) {
        const Cell at = cell_of_index(n, node);
        if (max(at.x, max(at.y, at.z)) == n - 1) continue; // the lowest corner of no cell
        const Vec3 low = node_of(bricks, brick, {at.x * spacing, at.y * spacing, at.z * spacing});
        if (!(majorant(medium, {low, low + bricks.cell * Real(spacing)}) > Real(0))) continue;
        const bool is_smooth = !has_grids && !(fluence.cut.any() && fluence.cut.is_cut(brick, node));
        add_cell(
            fluence, brick, node, is_smooth ? 2 : points_of_hard_cell, generator, tents,
            [&](const Vec3 &, const Vec3 &x) { return extinction(medium, x); },
            [&](const Vec3 &t, const Vec3 &x, CornerWeights &weights) {
                weights = weights_of_corners(fluence, brick, {node, t}, x);
            });
    }
}

} // namespace

bool find_tents(FluenceSums &fluence, Arena &arena, Watch watch) {
    const uint32_t nodes = nodes_of(fluence.spacing);
    Real *tents = arena.make<Real>(uint64_t{fluence.bricks->count} * nodes);
    Real *densest = arena.make<Real>(fluence.bricks->count);
    if (!tents || !densest) return false;
    for (uint32_t b = 0; b < fluence.bricks->count; ++b) {
        if (!watch.go_on(nodes * units_of_tent)) return false;
        Real *of_brick = tents + size_t{b} * nodes;
        const Vec3 low = low_of(*fluence.bricks, b);
        if (has(parts::resampled) && fluence.medium->bricks) {
            densest[b] =
                sum_of_resampled(*fluence.medium, [b](const ResampledField &field) { return field.majorants[b]; });
            find_tents_of_brick(fluence, b, of_brick);
            if (fluence.cut.any()) restrict_tents_of_brick(fluence, b, of_brick);
        } else if (has(parts::exact)) {
            densest[b] = majorant(*fluence.medium, {low, low + fluence.bricks->lattice.edge});
            find_exact_tents_of_brick(fluence, b, of_brick);
        }
    }
    fluence.tents = tents;
    fluence.densest = densest;
    return true;
}

bool light_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node, FluenceAndFlux &light) {
    constexpr Real least = Real(0x1p-10);
    const SparseGrid &bricks = *fluence.bricks;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    const bool one_channel = fluence.channels == 1;
    const uint32_t channels = one_channel ? 1 : 3;
    int64_t power[3] = {0, 0, 0}, flux[3] = {0, 0, 0};
    Real integral = Real(0), densest = Real(0); // of sigma_t times the node's tent; of all holders
    for_each_holder(bricks, bricks.position[brick], node, n, [&](uint32_t other, uint32_t there) {
        densest = max(densest, fluence.densest[other]);
        const size_t k = size_t{other} * nodes_of(spacing) + there;
        integral += fluence.tents[k];
        for (uint32_t c = 0; c < channels; ++c) power[c] = wrapped_sum(power[c], fluence.power[k * channels + c]);
        for (uint32_t c = 0; fluence.flux && c < 3; ++c) flux[c] = wrapped_sum(flux[c], fluence.flux[k * 3 + c]);
    });
    integral *= Real(1.0 / 216);
    light = {Color(Real(0)), Vec3(Real(0))};
    if (!(integral > scale_pow2(densest, fluence.sigma_shift) * (least * Real(spacing * spacing * spacing))))
        return false;
    const Color deposited = one_channel ? Color(photons_of(power[0]))
                                        : Color(photons_of(power[0]), photons_of(power[1]), photons_of(power[2]));
    const Color sum = one_channel ? fluence.photon_color * deposited : deposited;
    const Real all = deposited.x + deposited.y + deposited.z;
    if (fluence.flux && all > Real(0))
        light.flux = Vec3(photons_of(flux[0]), photons_of(flux[1]), photons_of(flux[2])) / all;
    // sum / integral * unit * 2^exponent; half of the scaling comes before the division.
    const Vec3 &cell = bricks.cell;
    const int32_t exponent = fluence.unit.exponent + fluence.sigma_shift, half = exponent / 2;
    const Color scaled = scale_pow2(sum * (inv_four_pi<Real> * fluence.unit.unit), half);
    light.radiance = scale_pow2(scaled / (cell.x * cell.y * cell.z * integral), exponent - half);
    return true;
}

SphericalHarmonics harmonics_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node) {
    const int32_t spacing = harmonic_spacing(fluence.spacing);
    int64_t sum[harmonic_numbers] = {};
    for_each_holder(*fluence.bricks, fluence.bricks->position[brick], node, nodes_along(spacing),
                    [&](uint32_t other, uint32_t there) {
                        const size_t k = size_t{other} * nodes_of(spacing) + there;
                        for (uint32_t i = 0; i < harmonic_numbers; ++i)
                            sum[i] = wrapped_sum(sum[i], fluence.harmonics[k * harmonic_numbers + i]);
                    });
    SphericalHarmonics harmonics = {};
    const Real all = photons_of(sum[0]);
    for (uint32_t i = 0; all > Real(0) && i < harmonic_count; ++i) // (1 + m) / 2 minus (1 - m) / 2
        harmonics.value[i] = photons_of(wrapped_difference(sum[1 + i], wrapped_difference(sum[0], sum[1 + i]))) / all;
    return harmonics;
}

} // namespace wisp::WISP_ARITH
