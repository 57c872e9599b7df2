// Cells of the triangle trees at points: those that hold a triangle list it, and outside there are none.
#include "core/surfaces/tree_cells.h"
#include "support/built_surfaces.h"
#include <set>

namespace wisp::WISP_ARITH {

namespace {

// A row of tiles along x, one a unit, and one of them again as an instance, ten units above.
struct Tiles : Room {
    static constexpr int count = 40;

    explicit Tiles(TreeKind kind) {
        const uint32_t grey = material(matte({0.5, 0.5, 0.5}));
        for (int i = 0; i < count; ++i) add({i * 1.0, 0, 0}, {i + 0.75, 0, 0}, {i + 0.75, 0.5, 0.5}, grey);
        add({0, 0, 0}, {1, 0, 0}, {1, 1, 1}, grey);
        scene.static_count = count;
        scene.instance_triangle_count = 1;
        instances = {
            {count, 1, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 10, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, true}};
        build();
        room.resize(surface_bytes(scene, kind) + placement_bytes(scene, kind));
        Arena arena(room.data(), room.size());
        trees = make_surfaces(scene, kind, arena);
        place_surfaces(scene, arena, trees);
        REQUIRE(trees.ready);
    }
    TreeCells at(const Double3 &x) const { return cells_at(trees, vec_of(x)); }

    std::vector<unsigned char> room;
    Surfaces trees;
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": cells that hold a point of a triangle list it, in both trees") {
    for (const TreeKind kind : {TreeKind::bvh, TreeKind::kd}) {
        const Tiles tiles(kind);
        std::set<uint64_t> numbers;
        for (int i = 0; i < Tiles::count; ++i) {
            const TreeCells cells = tiles.at({i + 0.5, 0.125, 0.125});
            CHECK(cells.found);
            CHECK(cells.triangles >= 1);
            CHECK(cells.triangles <= 8); // far fewer than all
            numbers.insert(cells.nodes);
        }
        CHECK(numbers.size() >= 5); // leaves hold up to eight triangles
        CHECK(tiles.at({0.5, 0.125, 0.125}).nodes == tiles.at({0.5, 0.1875, 0.1875}).nodes);
        CHECK(!tiles.at({0.5, 5, 0.25}).found);
        CHECK(!tiles.at({-1, 0, 0}).found);
        const TreeCells above = tiles.at({0.5, 10.25, 0.25}); // in the instance's own tree
        CHECK(above.found);
        CHECK(above.triangles == 1);
    }
}

} // namespace wisp::WISP_ARITH
