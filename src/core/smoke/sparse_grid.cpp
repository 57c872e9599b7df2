// Which bricks exist: those that touch a particle's support, or the tent of a grid's sample that is not 0.
#include "core/smoke/sparse_grid.h"
#include "core/numbers/double_bits.h"
#include "core/smoke/grid_samples.h"
#include "core/smoke/resampling.h"

namespace wisp::WISP_ARITH {

namespace {

// Up to so large a lattice a plan counts the bricks one by one; above it the plan assumes all of them.
constexpr uint64_t max_counted = uint64_t{1} << 19;
// So many are counted at a time, with a bit each on the stack: it may be a board's.
constexpr int32_t most_marked = 1 << 15;
// More bricks than any memory holds, so few that their bytes do not overflow.
constexpr uint64_t most_planned = uint64_t{1} << 40;

// The lattice before any brick exists.
struct Layout {
    Lattice bricks;
    Vec3 cell;
    Box bounds;
};

int32_t bricks_for(Real size, Real edge) { return floor_to_int(size / edge) + 1; }

Layout layout_of(const Vec3 &low, const Vec3 &cell, const Box &bounds) {
    const Vec3 edge = cell * Real(brick_cells), size = bounds.high - low;
    const Cell count = {bricks_for(size.x, edge.x), bricks_for(size.y, edge.y), bricks_for(size.z, edge.z)};
    return {make_lattice(low, edge, count), cell, bounds};
}

// Half the edges of the axis-aligned box around a density grid that may be rotated.
Vec3 reach_of(const GridDescription &grid) {
    const auto along = [&grid](double x, double y, double z) {
        return abs(to_real<Real>(rounded_product(x, grid.half.x))) +
               abs(to_real<Real>(rounded_product(y, grid.half.y))) +
               abs(to_real<Real>(rounded_product(z, grid.half.z)));
    };
    const Double3 *axis = grid.axis;
    return Vec3(along(axis[0].x, axis[1].x, axis[2].x), along(axis[0].y, axis[1].y, axis[2].y),
                along(axis[0].z, axis[1].z, axis[2].z));
}

Layout around_grid(const GridDescription &grid, Real cell, int32_t subdivision) {
    const Vec3 center = vec_of(grid.center), half = vec_of(grid.half);
    const Box box = {center - half, center + half};
    if (!grid.density) { // constant density: a whole number of cells
        const auto fit = [cell](Real size) { return size / Real(floor_to_int(size / cell) + 1); };
        const Vec3 size = half * Real(2);
        return layout_of(box.low, Vec3(fit(size.x), fit(size.y), fit(size.z)), box);
    }
    // Node `subdivision` i is sample i - 1.
    const Vec3 edge(Real(2) * half.x / Real(grid.nx), Real(2) * half.y / Real(grid.ny),
                    Real(2) * half.z / Real(grid.nz));
    return layout_of(box.low - edge * Real(0.5), edge * (Real(1) / Real(subdivision)), box);
}

Layout layout_of(const Scene &scene, double lengths) {
    const Real cell = smallest_smoothing_length(scene) * to_real<Real>(lengths);
    const SmokeDescription *const only = aligned_grid(scene);
    if (only) return around_grid(only->grid, cell, subdivision_for(lengths));
    const Box bounds = box_around_smoke(scene);
    return layout_of(bounds.low, Vec3(cell), bounds);
}

// The distance of x from the interval [low, low + edge].
Real gap(Real x, Real low, Real edge) { return max(max(low - x, x - (low + edge)), Real(0)); }

// Along an axis, the first and the last of `count` bricks that a sample of an aligned grid touches. Its tent covers the
// cells before and after it, at the border one more.
int32_t first_touched(int32_t sample, int32_t subdivision) { return max(sample - 1, 0) * subdivision / brick_cells; }
int32_t last_touched(int32_t sample, int32_t subdivision, int32_t count) {
    return min((sample + 3) * subdivision / brick_cells, count - 1);
}

// Bricks from first to last, both included.
struct Part {
    Cell first, last;
};
Part all_of(const Cell &count) { return {{0, 0, 0}, {count.x - 1, count.y - 1, count.z - 1}}; }
Part overlap(const Part &a, const Part &b) {
    return {{max(a.first.x, b.first.x), max(a.first.y, b.first.y), max(a.first.z, b.first.z)},
            {min(a.last.x, b.last.x), min(a.last.y, b.last.y), min(a.last.z, b.last.z)}};
}

// Calls visit(cell) for each brick of a part of the lattice that may hold smoke, perhaps more than once.
template <class Visit>
void for_each_touched(const Scene &scene, const Layout &layout, const Part &part, int32_t subdivision, Watch watch,
                      Visit &&visit) {
    const Lattice &lattice = layout.bricks;
    const auto visit_range = [&](const Cell &low, const Cell &high, auto &&touched) {
        const auto [first, last] = overlap({low, high}, part);
        if (first.x > last.x || first.y > last.y) return;
        const uint32_t units = static_cast<uint32_t>((last.x - first.x + 1) * (last.y - first.y + 1)) / 16;
        for (int32_t z = first.z; z <= last.z && (units == 0 || watch.go_on(units)); ++z)
            for (int32_t y = first.y; y <= last.y; ++y)
                for (int32_t x = first.x; x <= last.x; ++x)
                    if (touched(Vec3(Real(x), Real(y), Real(z)) * lattice.edge + lattice.low)) visit(Cell{x, y, z});
    };
    const auto layer_of = [&lattice](Real z) {
        return cell_of(z, lattice.low.z, lattice.inverse_edge.z, lattice.count.z);
    };
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        for (uint32_t k = 0; k < smoke.count && watch.done_round(k, 1024); ++k) {
            const Real reach = Real(2) * to_real<Real>(smoke.particles[k].h), reach_squared = reach * reach;
            const Real z = to_real<Real>(smoke.particles[k].position.z);
            if (layer_of(z + reach) < part.first.z || layer_of(z - reach) > part.last.z) continue;
            const Vec3 x = vec_of(smoke.particles[k].position);
            visit_range(cell_at(lattice, x - Vec3(reach)), cell_at(lattice, x + Vec3(reach)), [&](const Vec3 &low) {
                const Vec3 apart(gap(x.x, low.x, lattice.edge.x), gap(x.y, low.y, lattice.edge.y),
                                 gap(x.z, low.z, lattice.edge.z));
                return dot(apart, apart) <= reach_squared;
            });
        }
        if (!smoke.is_grid()) continue;
        const GridDescription &grid = smoke.grid;
        const auto always = [](const Vec3 &) { return true; };
        if (!grid.density) {
            visit_range(part.first, part.last, always);
            continue;
        }
        if (!aligned_grid(scene)) {
            const Vec3 center = vec_of(grid.center), reach = reach_of(grid);
            visit_range(cell_at(lattice, center - reach), cell_at(lattice, center + reach), always);
            continue;
        }
        const Cell &n = lattice.count;
        for_each_run(grid, [&](int32_t x, int32_t y, int32_t z, const float *densities, int32_t count) {
            const auto touched = [&](int32_t sample) {
                return Part{
                    {first_touched(sample, subdivision), first_touched(y, subdivision), first_touched(z, subdivision)},
                    {last_touched(sample, subdivision, n.x), last_touched(y, subdivision, n.y),
                     last_touched(z, subdivision, n.z)}};
            };
            const auto [first, last] = overlap(touched(x), part);
            if (first.y > last.y || first.z > last.z) return true;
            for (int32_t k = 0; k < count; ++k)
                if (total_order_key(densities[k]) > 0) {
                    const Part bricks = touched(x + k);
                    visit_range(bricks.first, bricks.last, always);
                }
            return watch.go_on(8);
        });
    }
}

// Marks of the bricks of a part of most_marked bricks at most, which are counted.
struct Marks {
    Part part;
    uint64_t count = 0;
    uint8_t bits[most_marked / 8] = {};

    void mark(const Cell &brick) {
        const Cell edges = {part.last.x - part.first.x + 1, part.last.y - part.first.y + 1, 0};
        const int64_t i = index_of(edges, {brick.x - part.first.x, brick.y - part.first.y, brick.z - part.first.z});
        uint8_t &byte = bits[i / 8];
        const uint8_t bit = static_cast<uint8_t>(1u << (i % 8));
        count += byte & bit ? 0 : 1;
        byte |= bit;
    }
};

// The number of bricks that mark_bricks(marks) marks, of a lattice whose rows are of most_marked at most: counted in
// parts, of whole layers where there is room for one, else of whole rows.
template <class Mark> uint64_t count_bricks(const Cell &n, Mark &&mark_bricks) {
    const int32_t rows = min(n.y, most_marked / n.x);
    const int32_t layers = rows < n.y ? 1 : min(n.z, most_marked / (n.x * n.y));
    uint64_t count = 0;
    for (int32_t z = 0; z < n.z; z += layers)
        for (int32_t y = 0; y < n.y; y += rows) {
            Marks marks = {overlap(all_of(n), {{0, y, z}, {n.x, y + rows - 1, z + layers - 1}})};
            mark_bricks(marks);
            count += marks.count;
        }
    return count;
}

// Marks the bricks that touch blocks of an aligned sparse grid.
void mark_around_blocks(const GridDescription &grid, const Cell &bricks, int32_t subdivision, Marks &marks) {
    const int32_t nx = blocks_along(grid, 0), ny = blocks_along(grid, 1), nz = blocks_along(grid, 2);
    struct Range {
        int32_t first, last;
    };
    const auto range = [subdivision](int32_t block, int32_t skipped, int32_t samples, int32_t count) {
        const int32_t low = block * block_edge - skipped, high = min(low + block_edge, samples) - 1;
        return Range{first_touched(max(low, 0), subdivision), last_touched(high, subdivision, count)};
    };
    for (int32_t bz = 0; bz < nz; ++bz) {
        const Range z = range(bz, grid.skipped[2], grid.nz, bricks.z);
        if (z.last < marks.part.first.z || z.first > marks.part.last.z) continue;
        for (int32_t by = 0; by < ny; ++by) {
            const Range y = range(by, grid.skipped[1], grid.ny, bricks.y);
            if (y.last < marks.part.first.y || y.first > marks.part.last.y) continue;
            for (int32_t bx = 0; bx < nx; ++bx) {
                if (number_of_block(grid, bx, by, bz) == no_block) continue;
                const Range x = range(bx, grid.skipped[0], grid.nx, bricks.x);
                const auto [first, last] = overlap({{x.first, y.first, z.first}, {x.last, y.last, z.last}}, marks.part);
                for (int32_t k = first.z; k <= last.z; ++k)
                    for (int32_t j = first.y; j <= last.y; ++j)
                        for (int32_t i = first.x; i <= last.x; ++i) marks.mark({i, j, k});
            }
        }
    }
}

uint64_t bytes_of(uint64_t lattice, uint64_t count) {
    return Arena::bytes<uint32_t>(lattice) + Arena::bytes<Cell>(count);
}

} // namespace

Box box_around_smoke(const Scene &scene) {
    Box bounds = {Vec3(Real(0)), Vec3(Real(0))};
    bool any = false;
    const auto add = [&](const Vec3 &x, const Vec3 &reach) {
        bounds.low = any ? min(bounds.low, x - reach) : x - reach;
        bounds.high = any ? max(bounds.high, x + reach) : x + reach;
        any = true;
    };
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        const Vec3 reach = Vec3(Real(2) * to_real<Real>(smoke.largest_h));
        for (uint32_t k = 0; k < smoke.count; ++k) add(vec_of(smoke.particles[k].position), reach);
        if (smoke.is_grid()) add(vec_of(smoke.grid.center), reach_of(smoke.grid));
    }
    return bounds;
}

Real smallest_smoothing_length(const Scene &scene) {
    Real finest = Real(0);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        if (scene.smokes[i].empty()) continue;
        const Real h = to_real<Real>(scene.smokes[i].smallest_h);
        finest = finest == Real(0) ? h : min(finest, h);
    }
    return finest;
}

SparseGrid make_sparse_grid(const Scene &scene, double lengths, Arena &arena, Watch watch) {
    SparseGrid bricks = {};
    if (!has_smoke(scene)) {
        bricks.ready = true;
        return bricks;
    }
    const Layout layout = layout_of(scene, lengths);
    bricks.subdivision = subdivision_for(lengths);
    bricks.lattice = layout.bricks;
    bricks.cell = layout.cell;
    bricks.inverse_cell = Vec3(Real(1) / layout.cell.x, Real(1) / layout.cell.y, Real(1) / layout.cell.z);
    bricks.bounds = layout.bounds;

    const uint64_t all = number_of(layout.bricks.count);
    uint32_t *index = arena.make<uint32_t>(all);
    if (!index) return bricks;
    if (!fill(index, all, no_brick, watch)) return bricks;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) watch.expect(scene.smokes[i].count);
    const Cell &n = layout.bricks.count;
    for_each_touched(scene, layout, all_of(n), bricks.subdivision, watch,
                     [index, &n](const Cell &brick) { index[index_of(n, brick)] = 0; });
    if (watch.stopped()) return bricks;
    for (uint64_t i = 0; i < all; ++i)
        if (index[i] != no_brick) index[i] = bricks.count++;
    Cell *position = arena.make<Cell>(bricks.count);
    if (!position) return bricks;
    for (int32_t z = 0; z < n.z; ++z)
        for (int32_t y = 0; y < n.y; ++y) {
            if (!watch.go_on(8)) return bricks;
            for (int32_t x = 0; x < n.x; ++x) {
                const uint32_t brick = index[index_of(n, {x, y, z})];
                if (brick != no_brick) position[brick] = {x, y, z};
            }
        }
    bricks.index = index;
    bricks.position = position;
    bricks.ready = true;
    return bricks;
}

SparseGridPlan plan_sparse_grid(const Scene &scene, double lengths) {
    if (!has_smoke(scene)) return {};
    const Layout layout = layout_of(scene, lengths);
    const Cell &n = layout.bricks.count;
    const uint64_t layer = static_cast<uint64_t>(n.x) * static_cast<uint64_t>(n.y), layers = static_cast<uint64_t>(n.z);
    const uint64_t all = layer > most_planned / layers ? most_planned : layer * layers;
    const SmokeDescription *const only = aligned_grid(scene);
    const bool by_blocks = only && only->grid.blocks && layer <= max_counted;
    const int32_t subdivision = subdivision_for(lengths);
    uint64_t count = all;
    if (n.x <= most_marked && (by_blocks || all <= max_counted))
        count = count_bricks(n, [&](Marks &marks) {
            if (by_blocks)
                mark_around_blocks(only->grid, n, subdivision, marks);
            else
                for_each_touched(scene, layout, marks.part, subdivision, {},
                                 [&marks](const Cell &brick) { marks.mark(brick); });
        });
    return {count, min(count, places_of_line(n)), bytes_of(all, count), all, layout.bounds, layout.cell};
}

} // namespace wisp::WISP_ARITH
