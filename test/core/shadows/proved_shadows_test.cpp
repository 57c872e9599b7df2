// Shadows without rays where proved: every answer and every picture is that of tracing.
#include "core/geometry/camera.h"
#include "support/proved_memory.h"
#include "support/random_rooms.h"
#include "support/shadow_queries.h"
#include "wisp/wisp.h"
#include <cstring>

namespace wisp::WISP_ARITH {

namespace {

constexpr double room_sizes[] = {1, 16, 1024};

} // namespace

TEST_CASE(WISP_ARITH_NAME
          ": shadows are those of rays, frame after frame, while instances, deforming triangles and lights move") {
    uint64_t culled = 0, moving_alone = 0;
    int wrong = 0;
    for (uint64_t seed = 0; seed < 150; ++seed) {
        RandomRoom room(seed, room_sizes[seed % 3]);
        if (room.lights.empty()) continue;
        for (LightSource &light : room.lights) light.color = {1, 1, 1}; // at its very corners
        room.build();
        ProvedMemory memory(room.scene);
        if (seed % 5 == 0) memory.proved->cells.block_count = 1 + static_cast<uint32_t>(seed % 40); // they run out
        Sequence next{seed};
        const auto below = [&next](size_t count) { return static_cast<uint32_t>(next() * static_cast<double>(count)); };
        for (int frame = 0; frame < 5; ++frame) {
            memory.begin(room);
            for (int spot = 0; spot < 50; ++spot) {
                const uint32_t triangle = below(frame % 2 ? 8 : room.scene.static_count),
                               light = below(room.lights.size());
                const CellPlace cell = random_cell(next);
                for (int i = 0; i < 60; ++i) {
                    Real u, v;
                    random_weights(cell, next, u, v);
                    const ShadowQuery query = query_at(room, triangle, light, u, v);
                    room.shadows.technique = &trace_technique;
                    const bool shadowed = is_shadowed(room.shadows, query);
                    room.shadows.technique = &exact_technique;
                    wrong += is_shadowed(room.shadows, query) != shadowed;
                }
            }
            for (Instance &instance : room.instances) {
                if (next() < 0.2) instance.visible = !instance.visible;
                instance.origin = instance.origin + Double3{next() - 0.5, next() - 0.5, next() - 0.5} * room.size;
            }
            for (uint32_t i = room.scene.static_count + room.scene.instance_triangle_count; i < room.triangles.size();
                 ++i)
                room.triangles[i].corner[frame % 3].x *= 0.5;
            const uint32_t moved = below(room.lights.size());
            room.lights[moved].position = Double3{next() - 0.5, next() - 0.5, next() - 0.5} * (3 * room.size);
            room.lights[moved].direction = unit(Double3{next() - 0.5, next() - 0.5, next() + 0.1});
            room.build();
        }
        culled += room.statistics.rays.shadow_culled;
        moving_alone += room.statistics.rays.shadow_dynamic_only;
    }
    CHECK(wrong == 0);
    CHECK(culled > 50000);
    CHECK(moving_alone > 20000);
}

TEST_CASE(WISP_ARITH_NAME ": exact shadows make the pictures of traced ones, in any order of frames, of any crop") {
    int wrong = 0;
    uint64_t culled = 0, moving_alone = 0;
    for (uint64_t seed = 0; seed < 40; ++seed) {
        RandomRoom room(seed + 500, room_sizes[seed % 3]);
        const size_t light_counts[] = {0, 1, 15, 16, 40};
        while (seed % 4 == 0 && !room.lights.empty() && room.lights.size() < light_counts[seed / 4 % 5]) {
            room.lights.push_back(room.lights.front());
            room.lights.back().position = room.lights.back().position + Double3{0.01, 0.02, 0.03} * room.size;
        }
        if (seed % 20 == 0) room.lights.clear();
        room.build();
        Settings settings = {};
        settings.samples = 9;
        settings.depth = 3;
        settings.shadows = ShadowMethod::exact;
        settings.crop = {0, 0, 16, 16}; // the largest
        std::vector<unsigned char> memory(renderer.plan(room.scene, settings).arena_bytes), own(memory.size());
        FrameCache cache = {};
        const std::vector<Instance> instances = room.instances;
        const std::vector<LightSource> lights = room.lights;
        for (const int frame : {0, 3, 2, 1, 0, 3}) {
            settings.crop = frame == 2 ? Crop{3, 5, 16, 11} : Crop{0, 0, 16, 16};
            for (size_t i = 0; i < instances.size(); ++i)
                room.instances[i].origin = instances[i].origin + Double3{0.1, 0.05, 0} * (frame * room.size);
            if (!lights.empty())
                room.lights[0].position = lights[0].position + Double3{0, 0.1, 0} * (frame / 2 * room.size);
            std::vector<float> exact(16 * 16 * 3), traced = exact;
            Statistics with, without;
            Arena arena(memory.data(), memory.size()), fresh(own.data(), own.size());
            settings.shadows = ShadowMethod::exact;
            REQUIRE(renderer.render({room.scene, settings, arena, with, {}, exact.data(), nullptr, &cache}) ==
                    Status::done);
            settings.shadows = ShadowMethod::trace;
            REQUIRE(renderer.render({room.scene, settings, fresh, without, {}, traced.data()}) == Status::done);
            wrong += std::memcmp(exact.data(), traced.data(), exact.size() * sizeof(float)) != 0;
            CHECK(with.rays.shadow == without.rays.shadow);
            CHECK(without.rays.shadow_culled == 0);
            culled += with.rays.shadow_culled;
            moving_alone += with.rays.shadow_dynamic_only;
        }
    }
    CHECK(wrong == 0);
    CHECK(culled > 5000);
    CHECK(moving_alone > 5000);
}

} // namespace wisp::WISP_ARITH
