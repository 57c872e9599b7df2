// Density grids: trilinear extinction, and its exact line integrals cell by cell.
#include "core/smoke/grid_field.h"
#include "core/numbers/increasing_root.h"
#include "core/numbers/simd.h"

namespace wisp::WISP_ARITH {

namespace {

Vec3 to_frame(const GridField &field, const Vec3 &d) {
    return Vec3(dot(field.axis[0], d), dot(field.axis[1], d), dot(field.axis[2], d));
}

// The number of the sample at a corner of a cell of GridField::between. Beyond the border the outermost sample repeats.
uint32_t sample_beside(const GridField &field, const Cell &cell, int32_t dx, int32_t dy, int32_t dz) {
    const Cell &n = field.samples;
    return number_of_sample(field, {min(max(cell.x - 1 + dx, 0), n.x - 1), min(max(cell.y - 1 + dy, 0), n.y - 1),
                                    min(max(cell.z - 1 + dz, 0), n.z - 1)});
}

// The samples at the corners of a cell of GridField::between: bit 0 of the number is dx, bit 1 dy, bit 2 dz.
struct CellSamples {
    CellSamples(const GridField &field, const Cell &cell) {
        const Cell &n = field.samples;
        if (!field.blocks && cell.x > 0 && cell.y > 0 && cell.z > 0 && cell.x < n.x && cell.y < n.y && cell.z < n.z) {
            const ptrdiff_t row = n.x, slice = row * n.y;
            const Real *first = field.extinction + index_of(n, {cell.x - 1, cell.y - 1, cell.z - 1});
            for (int i = 0; i < 8; ++i) at[i] = first[(i & 1) + (i >> 1 & 1) * row + (i >> 2) * slice];
        } else {
            for (int i = 0; i < 8; ++i) at[i] = field.extinction[sample_beside(field, cell, i & 1, i >> 1 & 1, i >> 2)];
        }
    }
    bool empty() const {
        bool all = true;
        for (const Real &sigma : at) all &= sigma == Real(0);
        return all;
    }
    // sigma_t where the cell's coordinates are t.
    Real value(const Vec3 &t) const {
        return max(Real(0),
                   trilinear(t, [&](int32_t dx, int32_t dy, int32_t dz) { return at[dx | dy << 1 | dz << 2]; }));
    }
    Real at[8];
};

// sigma_t at p, a point of the frame in or next to a cell of GridField::between.
Real value_in_cell(const GridField &field, const Cell &cell, const Vec3 &p) {
    return CellSamples(field, cell).value(position_in(field.between, cell, p));
}

// The integral of sigma_t over the distances [from, to] inside one cell. Gauss-Legendre is exact for this cubic.
Real depth_in_cell(const GridField &field, const Cell &cell, const Ray &ray, Real from, Real to) {
    const CellSamples samples(field, cell);
    if (samples.empty()) return Real(0);
    const Real half = (to - from) * Real(0.5), middle = from + half;
    const auto value = [&](Real t) {
        return samples.value(position_in(field.between, cell, ray.origin + ray.direction * t));
    };
    return half * (value(middle - gauss_node * half) + value(middle + gauss_node * half));
}

bool contains(const Box &box, const Vec3 &p) {
    return !(p.x < box.low.x || p.y < box.low.y || p.z < box.low.z || p.x > box.high.x || p.y > box.high.y ||
             p.z > box.high.z);
}

// A random offset from sample i along one axis, in cell edges, distributed as the sample's tent. The tents of border
// samples are constant over the outer half of the border cell.
Real tent_offset(int32_t i, int32_t count, Real u) {
    const bool below = u < Real(0.5);
    const Real v = below ? Real(2) * u : Real(2) * u - Real(1); // uniform again, for one side of the tent
    if (below ? i == 0 : i == count - 1) return below ? -v * Real(0.5) : v * Real(0.5);
    const Real inward = Real(1) - sqrt(v);
    return below ? -inward : inward;
}

Cell cell_of_number(const Cell &count, uint32_t number) {
    const uint32_t nx = static_cast<uint32_t>(count.x), ny = static_cast<uint32_t>(count.y);
    return {static_cast<int32_t>(number % nx), static_cast<int32_t>(number / nx % ny),
            static_cast<int32_t>(number / nx / ny)};
}

Cell cell_of_sample(const GridField &field, uint32_t sample) {
    if (!field.blocks) return cell_of_number(field.samples, sample);
    const Cell block = cell_of_number(field.block_lattice, field.place[sample / samples_of_block]),
               in_block = cell_of_number({block_edge, block_edge, block_edge}, sample % samples_of_block);
    return {block.x * block_edge + in_block.x - field.skipped.x, block.y * block_edge + in_block.y - field.skipped.y,
            block.z * block_edge + in_block.z - field.skipped.z};
}

// The point of the scene at the centre of a cell plus `offset` cell edges.
Vec3 point_near_sample(const GridField &field, const Cell &cell, const Vec3 &offset) {
    const Vec3 in_cells = Vec3(Real(cell.x), Real(cell.y), Real(cell.z)) + offset + Vec3(Real(0.5));
    const Vec3 p = field.box.low + in_cells * field.between.edge;
    return field.center + field.axis[0] * p.x + field.axis[1] * p.y + field.axis[2] * p.z;
}

// The index of a sparse grid. The description may be gone when the field is still used. False: the arena was too small.
bool copy_blocks(const GridDescription &source, Arena &arena, GridField &field, Watch watch) {
    const uint64_t places = block_places(source);
    uint32_t *blocks = arena.make<uint32_t>(places), *place = arena.make<uint32_t>(source.block_count);
    if (!blocks || !place) return false;
    for (uint64_t i = 0; i < places && watch.done_round(i, 1024); ++i) {
        blocks[i] = source.blocks[i];
        if (blocks[i] != no_block) place[blocks[i]] = static_cast<uint32_t>(i);
    }
    field.blocks = blocks;
    field.place = place;
    field.block_lattice = {blocks_along(source, 0), blocks_along(source, 1), blocks_along(source, 2)};
    field.skipped = {source.skipped[0], source.skipped[1], source.skipped[2]};
    field.block_count = source.block_count;
    return true;
}

} // namespace

void find_corners(const GridField &field, const Cell &cell, const Vec3 &p, Corners &corners) {
    const Vec3 t = position_in(field.between, cell, p);
    for (int i = 0; i < 8; ++i) {
        const int dx = i & 1, dy = i >> 1 & 1, dz = i >> 2;
        corners.sample[i] = sample_beside(field, cell, dx, dy, dz);
        const Real wx = max(Real(0), dx ? t.x : Real(1) - t.x), wy = max(Real(0), dy ? t.y : Real(1) - t.y);
        corners.weight[i] = wx * wy * max(Real(0), dz ? t.z : Real(1) - t.z);
    }
}

bool find_corners(const GridField &field, const Vec3 &x, Corners &corners) {
    const Vec3 p = to_frame(field, x - field.center);
    if (!contains(field.box, p)) return false;
    find_corners(field, cell_at(field.between, p), p, corners);
    return true;
}

bool enter(const GridField &field, const Ray &ray, Ray &inside, Real &entry, Real &end) {
    inside = {to_frame(field, ray.origin - field.center), to_frame(field, ray.direction)};
    entry = Real(0);
    if (!clip(field.box, inside, entry, end)) return false;
    inside.origin += inside.direction * entry;
    end -= entry;
    return true;
}

Real extinction(const GridField &field, const Vec3 &x) {
    const Vec3 p = to_frame(field, x - field.center);
    if (!contains(field.box, p)) return Real(0);
    if (field.constant()) return field.extinction[0];
    return value_in_cell(field, cell_at(field.between, p), p);
}

Color radiated(const GridField &field, const Vec3 &x, const Color *source, Real &sigma) {
    sigma = Real(0);
    Color sum(Real(0));
    for_each_extinction(field, x, [&](uint32_t sample, Real here) {
        sigma += here;
        sum += source[sample] * here;
    });
    return sum;
}

WISP_MULTIVERSIONED Real optical_depth(const GridField &field, const Ray &ray, Real end) {
    Ray inside;
    Real entry, depth = Real(0);
    if (!enter(field, ray, inside, entry, end)) return Real(0);
    if (field.constant()) return end * field.extinction[0];
    for_each_cell(field.between, inside, Real(0), end, [&](const Cell &cell, Real from, Real to) {
        depth += depth_in_cell(field, cell, inside, from, to);
        return true;
    });
    return depth;
}

Real majorant(const GridField &field, const Box &box) {
    const Vec3 middle = to_frame(field, (box.low + box.high) * Real(0.5) - field.center);
    const Vec3 reach = (box.high - box.low) * Real(0.5);
    const Vec3 half(dot(absolute(field.axis[0]), reach), dot(absolute(field.axis[1]), reach),
                    dot(absolute(field.axis[2]), reach));
    const Vec3 low = middle - half, high = middle + half;
    if (high.x < field.box.low.x || high.y < field.box.low.y || high.z < field.box.low.z || low.x > field.box.high.x ||
        low.y > field.box.high.y || low.z > field.box.high.z)
        return Real(0);
    // The samples at the corners of all cells of `between` that the box touches.
    const Cell first = cell_at(field.between, low), last = cell_at(field.between, high), &n = field.samples;
    Real largest = Real(0);
    for (int32_t z = max(first.z - 1, 0); z <= min(last.z, n.z - 1); ++z)
        for (int32_t y = max(first.y - 1, 0); y <= min(last.y, n.y - 1); ++y)
            for (int32_t x = max(first.x - 1, 0); x <= min(last.x, n.x - 1); ++x)
                largest = max(largest, field.extinction[number_of_sample(field, {x, y, z})]);
    return largest;
}

Collision first_collision(const GridField &field, const Ray &ray, Real end, Event event) {
    Collision collision = {false, end, 0};
    Ray inside;
    Real entry;
    if (!enter(field, ray, inside, entry, end)) return collision;
    Real rest = -log1p(-unit_open<Real>(draw(event, field.dimension))); // the optical depth that is left
    if (field.constant()) {
        const Real sigma = field.extinction[0];
        if (rest < end * sigma) collision = {true, entry + rest / sigma, 0};
        return collision;
    }
    for_each_cell(field.between, inside, Real(0), end, [&](const Cell &cell, Real from, Real to) {
        const Real depth = depth_in_cell(field, cell, inside, from, to);
        if (!(rest < depth)) {
            rest -= depth;
            return true;
        }
        const Real t = increasing_root(from, to, [&](Real at, Real &slope) {
            slope = value_in_cell(field, cell, inside.origin + inside.direction * at);
            return depth_in_cell(field, cell, inside, from, at) - rest;
        });
        Corners corners;
        find_corners(field, cell, inside.origin + inside.direction * t, corners);
        Real total = Real(0);
        for (int i = 0; i < 8; ++i) total += corners.weight[i] * field.extinction[corners.sample[i]];
        Real rest_of_sum = unit_half_open<Real>(draw(event, field.dimension + 1)) * total;
        int chosen = 0; // rounding may leave a rest: then the last one with smoke
        for (int i = 0; i < 8; ++i) {
            const Real here = corners.weight[i] * field.extinction[corners.sample[i]];
            if (!(here > Real(0))) continue;
            chosen = i;
            if (rest_of_sum < here) break;
            rest_of_sum -= here;
        }
        collision = {true, entry + t, corners.sample[chosen]};
        return false;
    });
    return collision;
}

Vec3 position_of_sample(const GridField &field, uint32_t sample) {
    return point_near_sample(field, cell_of_sample(field, sample), Vec3(Real(0)));
}

Vec3 point_of_sample(const GridField &field, uint32_t sample, const Vec3 &uniform) {
    const Cell &n = field.samples, at = cell_of_sample(field, sample);
    return point_near_sample(
        field, at,
        Vec3(tent_offset(at.x, n.x, uniform.x), tent_offset(at.y, n.y, uniform.y), tent_offset(at.z, n.z, uniform.z)));
}

uint64_t grid_field_bytes(const GridDescription &source) {
    if (!source.blocks) return Arena::bytes<Real>(samples_of_box(source));
    return Arena::bytes<Real>(stored_samples(source) + samples_of_block) +
           Arena::bytes<uint32_t>(block_places(source)) + Arena::bytes<uint32_t>(source.block_count);
}

GridField grid_frame(const GridDescription &source) {
    GridField field = {};
    field.samples = {source.nx, source.ny, source.nz};
    field.center = vec_of(source.center);
    for (int i = 0; i < 3; ++i) field.axis[i] = vec_of(source.axis[i]);
    const Vec3 half = vec_of(source.half);
    field.box = {-half, half};
    const Vec3 edge(Real(2) * half.x / Real(source.nx), Real(2) * half.y / Real(source.ny),
                    Real(2) * half.z / Real(source.nz));
    field.between = make_lattice(-half - edge * Real(0.5), edge, {source.nx + 1, source.ny + 1, source.nz + 1});
    const Vec3 reach =
        absolute(field.axis[0]) * half.x + absolute(field.axis[1]) * half.y + absolute(field.axis[2]) * half.z;
    field.bounds = {field.center - reach, field.center + reach};
    return field;
}

GridField make_grid_field(const GridDescription &source, uint32_t dimension, Arena &arena, Watch watch) {
    GridField field = grid_frame(source);
    field.dimension = dimension;
    const uint64_t count = stored_samples(source);
    Real *values = arena.make<Real>(count + (source.blocks ? samples_of_block : 0));
    if (!values || (source.blocks && !copy_blocks(source, arena, field, watch))) return field;
    const Real sigma = to_real<Real>(source.extinction);
    watch.expect(count / 64);
    for (uint64_t i = 0; i < count; ++i) {
        values[i] = source.density ? sigma * to_real<Real>(source.density[i]) : sigma;
        field.largest = max(field.largest, values[i]);
        if (!watch.done_round(i, 16)) return field;
    }
    for (uint32_t i = 0; source.blocks && i < samples_of_block; ++i) values[count + i] = Real(0);
    field.extinction = values;
    field.ready = true;
    return field;
}

} // namespace wisp::WISP_ARITH
