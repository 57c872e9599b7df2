// Cells that surfaces cut: which there are, and between which corners their points interpolate.
#include "core/photons/cut_cells.h"
#include "host/base/double3_algebra.h"
#include "support/built_sparse_grid.h"
#include "support/built_surfaces.h"

namespace wisp::WISP_ARITH {

namespace {

// A cube of fog, of 16 cells along each edge, with triangles in it.
struct Cut : Room {
    explicit Cut(int32_t spacing)
        : grid({box_smoke({2, 2, 2}, 1, 16)}, 1), memory(cut_cell_bytes(grid.plan.count, spacing)) {}
    const CutCells &find(int32_t spacing) {
        scene.static_count = static_cast<uint32_t>(triangles.size());
        build();
        Arena arena(memory.data(), memory.size());
        REQUIRE(find_cut_cells(surfaces, grid.bricks, spacing, arena, {}, cells));
        return cells;
    }
    BuiltSparseGrid grid;
    std::vector<unsigned char> memory;
    CutCells cells;
};

// Through `through`, across the unit vector `normal`.
void add_wall(Room &room, const Double3 &through, const Double3 &normal, uint32_t material) {
    const Double3 some = std::fabs(normal.x) < 0.5 ? Double3{1, 0, 0} : Double3{0, 1, 0};
    const Double3 u = unit(cross(normal, some)) * 40.0, v = cross(normal, u);
    room.add(through - u - v, through + u - v, through + u + v, through - u + v, material);
}

Double3 double_of(const Vec3 &v) { return {at(v.x), at(v.y), at(v.z)}; }

} // namespace

TEST_CASE(WISP_ARITH_NAME ": points of a cell that a wall cuts interpolate between the corners on their own side") {
    Sequence next{7};
    const auto number = [&] { return 2 * next() - 1; };
    uint32_t cut_points = 0;
    for (const int32_t spacing : {1, 2})
        for (int wall = 0; wall < 24; ++wall) {
            CAPTURE(spacing);
            CAPTURE(wall);
            // Every other wall is across an axis, half of these in a plane of nodes.
            Double3 normal = unit({number(), number(), number()}), through = {number(), number(), number()};
            if (wall % 2 == 0) {
                normal = {wall / 2 % 3 == 0 ? 1.0 : 0.0, wall / 2 % 3 == 1 ? 1.0 : 0.0, wall / 2 % 3 == 2 ? 1.0 : 0.0};
                if (wall % 4 == 0) through = {0.5, 0.5, 0.5};
            }
            Cut cut(spacing);
            add_wall(cut, through, normal, cut.material(matte({1, 1, 1})));
            const CutCells &cells = cut.find(spacing);
            const SparseGrid &bricks = cut.grid.bricks;
            for (int i = 0; i < 1000; ++i) {
                const Vec3 x = vec_of(Double3{2 * number(), 2 * number(), 2 * number()});
                const double side = dot(double_of(x) - through, normal);
                const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
                const CellPosition at_cell = find_cell(position_in(bricks, brick, x), spacing);
                const Cell lowest = cell_of_index(nodes_along(spacing), at_cell.node);
                // A node counts as beside its place: on one side, also of a wall in a plane of nodes.
                const double aside = at(bricks.cell.x) * spacing / 256;
                double weight[8], sum = 0;
                uint32_t on_its_side = 0, seen = 0;
                bool is_close = std::fabs(side) < 1e-4; // to the wall: roundings decide
                for (uint32_t corner = 0; corner < 8; ++corner) {
                    const int32_t c = static_cast<int32_t>(corner);
                    const Cell node = {(lowest.x + (c & 1)) * spacing, (lowest.y + (c >> 1 & 1)) * spacing,
                                       (lowest.z + (c >> 2)) * spacing};
                    const Double3 place =
                        double_of(node_of(bricks, brick, node)) + Double3{aside, 3 * aside, 9 * aside};
                    const double there = dot(place - through, normal);
                    is_close = is_close || std::fabs(there) < 1e-5;
                    weight[corner] = at(corner_weight(at_cell.t, corner)) + 0x1p-10;
                    if ((there > 0) != (side > 0)) continue;
                    on_its_side |= 1u << corner;
                    sum += weight[corner];
                }
                if (is_close) continue;
                const bool is_cut = cells.is_cut(brick, at_cell.node);
                if (on_its_side != 0xff) CHECK(is_cut);
                if (std::fabs(side) > 4 * at(bricks.cell.x) * spacing) CHECK(!is_cut);
                if (!is_cut) continue;
                CornerWeights weights;
                CHECK(find_weights_in_cut_cell(cells, brick, at_cell, x, weights) == (on_its_side != 0));
                for (uint32_t corner = 0; corner < 8; ++corner) {
                    if (weights.of[corner] > Real(0)) seen |= 1u << corner;
                    if ((seen >> corner & 1) != 0)
                        CHECK(at(weights.of[corner]) == doctest::Approx(weight[corner] / sum).epsilon(1e-4));
                }
                CHECK(seen == on_its_side);
                ++cut_points;
            }
        }
    CHECK(cut_points > 2000);
}

} // namespace wisp::WISP_ARITH
