// Resampling smoke to a sparse grid, and queries of the result.
#include "core/smoke/resampled_field.h"
#include "core/numbers/parts.h"
#include "core/smoke/sparse_grid_lanes.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr int32_t along = nodes_along(1);
constexpr uint32_t row = 2 * lanes; // a row of nodes, padded to whole vectors while it is summed
constexpr uint32_t rows = static_cast<uint32_t>(along * along);
static_assert(static_cast<uint32_t>(along) <= row, "a row of a brick fits");

// Adds the kernel sum (S3) of all particles to a brick's nodes. Particles are added leaf by leaf in ascending order, so
// a node's sum has the same order in every brick that holds the node.
//
// Trilinear interpolation widens the field: it adds cell^2 / 6 to the variance along each axis. A kernel's own variance
// is kernel.variance h^2. The kernels are narrowed to h'^2 = h^2 - cell^2 / (6 variance), so that the interpolated
// field has the particles' variance. This divides the error of column depths by about six (S4-1).
template <class K>
void sum_particles(const K &kernel, const ParticleField &field, const SparseGrid &bricks, uint32_t brick, Real *sums) {
    const PointTree &tree = field.tree;
    const Vec3 low = low_of(bricks, brick), half = bricks.lattice.edge * Real(0.5);
    const Real widening = bricks.cell.x * bricks.cell.x * kernel.widening;
    Real x[row];
    for (uint32_t l = 0; l < row; ++l) x[l] = node_of(bricks, brick, {static_cast<int32_t>(l), 0, 0}).x;
    for_each_leaf_near(field, low + half, length(half), [&](uint32_t leaf) {
        for (uint32_t i = leaf * leaf_points; i < (leaf + 1) * leaf_points; ++i) {
            const Real inverse_h = field.inverse_h[i];
            if (field.scale[i] == Real(0)) continue;
            // (h / h')^2 = 1 / (1 - cell^2 / (6 variance h^2)), limited to 4. From here on `h` is 1 / h'.
            const Real squared = Real(1) / max(Real(1) - widening * (inverse_h * inverse_h), Real(0.25));
            const Real ratio = sqrt(squared), h = inverse_h * ratio;
            const Real scale = field.scale[i] * inverse_h * (squared * ratio);
            // The rows that the support may touch, and one more on either side for rounding.
            const Real h_squared = h * h, reach = kernel.support / h;
            const Vec3 p = (Vec3(tree.x[i], tree.y[i], tree.z[i]) - low) * bricks.inverse_cell;
            const Vec3 r = bricks.inverse_cell * reach;
            if (p.x + r.x < Real(-1) || p.x - r.x > Real(along)) continue;
            const int32_t first_y = max(floor_to_int(p.y - r.y), 0),
                          last_y = min(floor_to_int(p.y + r.y) + 1, along - 1);
            const int32_t first_z = max(floor_to_int(p.z - r.z), 0),
                          last_z = min(floor_to_int(p.z + r.z) + 1, along - 1);
            const uint32_t first_x = in_vectors ? 0 : static_cast<uint32_t>(max(floor_to_int(p.x - r.x), 0)),
                           end_x = in_vectors ? row : static_cast<uint32_t>(min(floor_to_int(p.x + r.x) + 2, along));
            for (int32_t z = first_z; z <= last_z; ++z)
                for (int32_t y = first_y; y <= last_y; ++y) {
                    const Vec3 node = node_of(bricks, brick, {0, y, z});
                    const Real dy = node.y - tree.y[i], dz = node.z - tree.z[i], across = dy * dy + dz * dz;
                    if (!(across * h_squared < kernel.support_squared)) continue;
                    Real *sum = sums + static_cast<uint32_t>(z * along + y) * row;
                    for (uint32_t l = first_x; l < end_x; ++l) {
                        const Real dx = x[l] - tree.x[i], q_squared = (dx * dx + across) * h_squared;
                        if (!in_vectors && !(q_squared < kernel.support_squared)) continue;
                        sum[l] += scale * kernel.value(q_squared); // S3
                    }
                }
        }
    });
}

// `sums` has room for rows * row numbers.
WISP_MULTIVERSIONED void resample_brick(const ParticleField &field, const SparseGrid &bricks, uint32_t brick,
                                        Real *sums, Real *nodes) {
    for (uint32_t i = 0; i < rows * row; ++i) sums[i] = Real(0);
    with_kernel(field.kernel, [&](const auto &kernel) { sum_particles(kernel, field, bricks, brick, sums); });
    for (uint32_t r = 0; r < rows; ++r)
        for (uint32_t l = 0; l < static_cast<uint32_t>(along); ++l) *nodes++ = sums[r * row + l];
}

void resample_brick(const GridField &grid, const SparseGrid &bricks, uint32_t brick, Real *nodes) {
    const Cell &at = bricks.position[brick], &n = grid.samples;
    const int32_t subdivision = bricks.subdivision;
    const auto sample = [](int32_t i, int32_t count) { return min(max(i, 0), count - 1); };
    const Real fraction = Real(1) / Real(subdivision);
    for (uint32_t k = 0; k < nodes_of(1); ++k) {
        const Cell node = cell_of_index(along, k);
        const Cell in = {at.x * brick_cells + node.x, at.y * brick_cells + node.y, at.z * brick_cells + node.z};
        const Cell before = {in.x / subdivision - 1, in.y / subdivision - 1, in.z / subdivision - 1};
        const Vec3 t = Vec3(Real(in.x % subdivision), Real(in.y % subdivision), Real(in.z % subdivision)) * fraction;
        *nodes++ = trilinear(t, [&](int32_t dx, int32_t dy, int32_t dz) {
            return grid.extinction[number_of_sample(
                grid, {sample(before.x + dx, n.x), sample(before.y + dy, n.y), sample(before.z + dz, n.z)})];
        });
    }
}

// Sets the nodes of all bricks by resample_one(brick, its nodes), and each brick's smallest and largest one.
template <class ResampleOne>
bool resample_all(const SparseGrid &bricks, Real *nodes, Real *minorants, Real *majorants, Watch watch,
                  ResampleOne &&resample_one) {
    constexpr uint32_t units_per_brick = 1 << 13;
    watch.expect(uint64_t{bricks.count} * units_per_brick);
    for (uint32_t brick = 0; brick < bricks.count; ++brick, nodes += nodes_of(1)) {
        if (!watch.done(units_per_brick)) return false;
        resample_one(brick, nodes);
        minorants[brick] = majorants[brick] = nodes[0];
        for (uint32_t i = 1; i < nodes_of(1); ++i) {
            minorants[brick] = min(minorants[brick], nodes[i]);
            majorants[brick] = max(majorants[brick], nodes[i]);
        }
    }
    return true;
}

// Moves the ray's origin to its entry into the smoke's bounds. `entry` is the distance skipped, `end` becomes the
// distance left. Returns false if the ray misses the bounds.
bool enter(const SparseGrid &bricks, const Ray &ray, Ray &inside, Real &entry, Real &end) {
    entry = Real(0);
    if (bricks.count == 0 || !clip(bricks.bounds, ray, entry, end)) return false;
    inside = {ray.origin + ray.direction * entry, ray.direction};
    end -= entry;
    return true;
}

} // namespace

uint64_t resampled_field_bytes(const SmokeDescription &source, uint64_t bricks) {
    return Arena::bytes<Real>(bricks * nodes_of(1)) + 2 * Arena::bytes<Real>(bricks) +
           (source.is_grid() ? grid_field_bytes(source.grid)
                             : particle_field_bytes(source.count) + Arena::bytes<Real>(rows * row));
}

ResampledField resample(const SmokeDescription &source, const SparseGrid &bricks, uint32_t dimension, Arena &arena,
                        Watch watch) {
    ResampledField field = {&bricks, nullptr, nullptr, nullptr, Real(0), dimension, false};
    Real *nodes = arena.make<Real>(size_t{bricks.count} * nodes_of(1));
    Real *minorants = arena.make<Real>(bricks.count);
    Real *majorants = arena.make<Real>(bricks.count);
    if (!nodes || !minorants || !majorants) return field;
    const size_t mark = arena.mark();
    if (is_grid_of_program(source.is_grid())) {
        const GridField grid = make_grid_field(source.grid, dimension, arena, watch);
        const auto resample_one = [&](uint32_t brick, Real *to) { resample_brick(grid, bricks, brick, to); };
        if (!grid.ready || !resample_all(bricks, nodes, minorants, majorants, watch, resample_one)) return field;
    } else {
        const ParticleField particles = make_particle_field(source, dimension, arena, watch);
        Real *sums = arena.make<Real>(rows * row);
        const auto resample_one = [&](uint32_t brick, Real *to) { resample_brick(particles, bricks, brick, sums, to); };
        if (!particles.ready || !sums || !resample_all(bricks, nodes, minorants, majorants, watch, resample_one))
            return field;
    }
    arena.rewind(mark);
    field.extinction = nodes;
    field.minorants = minorants;
    field.majorants = majorants;
    for (uint32_t brick = 0; brick < bricks.count; ++brick) field.largest = max(field.largest, majorants[brick]);
    field.ready = true;
    return field;
}

Real extinction(const ResampledField &field, const Vec3 &x) {
    const SparseGrid &bricks = *field.bricks;
    const Box &box = bricks.bounds;
    if (bricks.count == 0 || x.x < box.low.x || x.y < box.low.y || x.z < box.low.z || x.x > box.high.x ||
        x.y > box.high.y || x.z > box.high.z)
        return Real(0);
    const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
    return brick == no_brick ? Real(0) : extinction(field, brick, position_in(bricks, brick, x));
}

WISP_MULTIVERSIONED void add_depths(const ResampledField &field, const GridRay &ray, const Lanes &t,
                                    const Lanes &length, Lanes &sum) {
    LanePoints points;
    find_points(*field.bricks, ray, t, points);
    LaneCells at;
    find_cells(points, 1, 1, at);
    Lanes sigma;
    interpolate(at, field.extinction, sigma);
    for (uint32_t l = 0; l < lanes; ++l) sum[l] += points.inside[l] ? sigma[l] * length[l] : Real(0);
}

// Midpoint steps are collected until there is one for each lane. None is longer than a cell, or a quarter of one where
// sigma_t changes much.
Real optical_depth(const ResampledField &field, const Ray &ray, Real end) {
    const SparseGrid &bricks = *field.bricks;
    Ray inside;
    Real entry;
    if (!enter(bricks, ray, inside, entry, end)) return Real(0);
    const GridRay in_bricks(bricks, inside);
    const Real cell = min(bricks.cell.x, min(bricks.cell.y, bricks.cell.z)), inverse_cell = Real(1) / cell;
    Lanes t, length, sum = {};
    uint32_t waiting = 0;
    for_each_brick(bricks, inside, Real(0), end, [&](uint32_t brick, Real from, Real to) {
        if (!(field.majorants[brick] > Real(0))) return true;
        const bool constant = field.minorants[brick] == field.majorants[brick];
        const bool bends = (field.majorants[brick] - field.minorants[brick]) * cell > max_bend;
        const int32_t steps = constant ? 1 : floor_to_int((to - from) * inverse_cell * Real(bends ? 4 : 1)) + 1;
        const Real step = (to - from) / Real(steps);
        for (int32_t i = 0; i < steps; ++i) {
            t[waiting] = from + (Real(i) + Real(0.5)) * step;
            length[waiting++] = step;
            if (waiting < lanes) continue;
            add_depths(field, in_bricks, t, length, sum);
            waiting = 0;
        }
        return true;
    });
    if (waiting > 0) {
        for (uint32_t l = waiting; l < lanes; ++l) t[l] = length[l] = Real(0);
        add_depths(field, in_bricks, t, length, sum);
    }
    return sum_of_lanes(sum);
}

Real majorant(const ResampledField &field, const Box &box) {
    const SparseGrid &bricks = *field.bricks;
    if (bricks.count == 0) return Real(0);
    const Cell first = cell_at(bricks.lattice, box.low), last = cell_at(bricks.lattice, box.high);
    Real bound = Real(0);
    for (int32_t z = first.z; z <= last.z; ++z)
        for (int32_t y = first.y; y <= last.y; ++y)
            for (int32_t x = first.x; x <= last.x; ++x) {
                const uint32_t brick = brick_at(bricks, {x, y, z});
                if (brick != no_brick) bound = max(bound, field.majorants[brick]);
            }
    return bound;
}

Collision first_collision(const ResampledField &field, const Ray &ray, Real end, Event event) {
    Collision collision = {false, end, 0};
    Ray inside;
    Real entry;
    if (!enter(*field.bricks, ray, inside, entry, end)) return collision;
    Pcg32 generator(uint64_t{event.high} << 32 | (event.low + field.dimension * 0x9e3779b9u));
    const auto exponential = [&generator] { return -log(unit_open<Real>(generator())); };
    Real rest = exponential();
    uint32_t tentative = 0;
    for_each_brick(*field.bricks, inside, Real(0), end, [&](uint32_t brick, Real from, Real to) {
        const Real bound = field.majorants[brick];
        for (Real t = from;;) {
            const Real depth = bound * (to - t);
            if (!(rest < depth)) {
                rest -= depth;
                return true;
            }
            if (++tentative == max_tentative) return false;
            t += rest / bound;
            rest = exponential();
            const Vec3 p = position_in(*field.bricks, brick, inside.origin + inside.direction * t);
            if (!(unit_half_open<Real>(generator()) * bound < extinction(field, brick, p))) continue;
            collision = {true, entry + t, brick};
            return false;
        }
    });
    return collision;
}

} // namespace wisp::WISP_ARITH
