// Cells of static triangles: where they are, and how their memory is taken and returned.
#include "core/shadows/visibility_cells.h"
#include "support/proved_memory.h"
#include "support/shadow_queries.h"

namespace wisp::WISP_ARITH {

namespace {

// So many floors, one above the other, and three lights.
struct Floors : Room {
    explicit Floors(int count) {
        for (int i = 0; i < count; ++i) add_floor(*this, i, 1, material(matte({1, 1, 1})));
        for (int i = 0; i < 3; ++i) light(LightKind::point, {0, 30.0 + i, 0}, {1, 1, 1});
        build();
    }
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": the cell of a point holds it, however often cells are divided") {
    const Floors room(6);
    const Settings settings = small_settings(256);
    std::vector<unsigned char> block(static_cast<size_t>(shadow_cell_bytes(room.scene, settings)));
    Arena arena(block.data(), block.size());
    ShadowCells cells = make_shadow_cells(room.scene, settings, arena);
    REQUIRE(cells.ready);
    CHECK(arena.peak() <= block.size());
    update_shadow_cells(cells, room.tracer.lights, room.scene.light_count);
    Sequence next{77};
    int finest = 0;
    for (int i = 0; i < 4000; ++i) {
        const auto light = static_cast<uint32_t>(3 * next()), triangle = static_cast<uint32_t>(12 * next());
        double u = next() * 0.02, v = next() * 0.02; // few cells, divided often
        if (i % 3 == 0) u = 1 - u - v;
        CellPlace place;
        ShadowCell *cell = find_shadow_cell(cells, light, triangle, real(u), real(v), place);
        REQUIRE(cell);
        CHECK(cell->children() == 0);
        const double s = (u * finest_cell - place.u) / place.size, t = (v * finest_cell - place.v) / place.size;
        constexpr double rounding = 1e-4;
        CHECK(s >= -rounding);
        CHECK(t >= -rounding);
        CHECK(s + t <= 1 + rounding);
        const bool is_finest = place.size == 1 || place.size == -1;
        finest += is_finest;
        split(cells, *cell, place);
        CHECK((cell->children() == 0) == is_finest);
    }
    CHECK(finest > 100);
    CellPlace unused;
    CHECK(find_shadow_cell(cells, 3, 0, Real(0), Real(0), unused) == nullptr); // there are three lights
}

TEST_CASE(WISP_ARITH_NAME ": the memory of cells is in proportion to what rays can teach, and ends") {
    const Floors room(1000);
    Settings settings = {};
    const auto bytes = [&](int32_t width, uint32_t samples) {
        settings.crop = {0, 0, width, 48, 1};
        settings.samples = samples;
        return shadow_cell_bytes(room.scene, settings);
    };
    const uint64_t one = bytes(64, 1), two = bytes(64, 2), three = bytes(192, 1);
    CHECK(bytes(64, 4) < 1 << 20);
    CHECK(two - one == doctest::Approx(64 * 48 * 3 * 6.0 / 24 * sizeof(ShadowCell[4])).epsilon(1e-3));
    CHECK(three - one == 2 * (two - one));
    CHECK(bytes(1 << 20, 0x7fffffff) <= (uint64_t{1} << 24) + (1 << 16));
    CHECK(bytes(0, 1) > 0);
}

TEST_CASE(WISP_ARITH_NAME ": cells are given back when their light moves, and taken anew") {
    Room room;
    add_floor(room, 0, 50, room.material(matte({1, 1, 1})));
    room.add({-10, 5, -3}, {10, 5, -3}, {0, 5, 12}, 0);
    for (int i = 0; i < 2; ++i) room.light(LightKind::point, {3, 30, 0}, {1, 1, 1});
    room.build();
    ProvedMemory memory(room.scene);
    uint32_t used = 0;
    for (int frame = 0; frame < 20; ++frame) {
        room.lights[0].position.x = frame;
        room.build();
        memory.begin(room);
        const uint64_t before = room.statistics.rays.shadow_culled;
        for (uint32_t light = 0; light < 2; ++light)
            for (int x = 0; x < 128; ++x)
                for (int y = 0; y < 128 - x; ++y)
                    is_shadowed(room.shadows, query_at(room, 0, light, Real(x) / Real(128), Real(y) / Real(128)));
        // Most rays to the one that stands are known from the second frame on.
        const uint64_t culled = room.statistics.rays.shadow_culled - before;
        CHECK(culled > (frame == 0 ? 4000 : 12000));
        if (frame == 3) used = memory.proved->cells.used;
    }
    CHECK(memory.proved->cells.used < 3 * used);
}

} // namespace wisp::WISP_ARITH
