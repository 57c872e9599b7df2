// Shadow queries of a room, one by one.
#pragma once
#include "core/shadows/shadows.h"
#include "host/base/double3_algebra.h"
#include "support/built_surfaces.h"

namespace wisp::WISP_ARITH {

// A room whose shadow queries come one by one, each compared with tracing.
struct QueriedRoom : Room {
    void use(ShadowMethod method) {
        Settings settings = small_settings(512);
        settings.shadows = method;
        block.resize(static_cast<size_t>(shadow_bytes(scene, settings)));
        Arena arena(block.data(), block.size());
        REQUIRE(make_shadow_memory(scene, settings, arena, shadows.memory));
        shadows.technique = find_technique(method);
        statistics = {};
        queries = shadowed = wrong = 0;
        REQUIRE(begin_frame(shadows, settings, arena));
    }
    void ask(const Vec3 &from, uint32_t light, uint32_t triangle) {
        ask(make_shadow_query(surfaces, from, light, illuminate(tracer.lights[light], from, from, from), triangle, {},
                              {}, 0));
    }
    void ask(const ShadowQuery &query) {
        TreeCounts unused = {};
        const bool right = is_blocked(surfaces, query.ray, query.begin, query.end, query.triangle, unused);
        ++queries;
        shadowed += right;
        wrong += is_shadowed(shadows, query) != right;
    }
    // Points of every triangle, of the space next to it, and everywhere, and of and about the lights.
    void query_everywhere(uint64_t seed, double size) {
        Sequence next{seed};
        const uint32_t other = scene.static_count; // a triangle that moves
        const auto somewhere = [&](double part) {
            const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
            return Double3{x, y, z} * (part * size);
        };
        for (uint32_t l = 0; l < scene.light_count; ++l) {
            for (uint32_t i = 0; i < scene.static_count; ++i) {
                const Double3 *c = triangles[i].corner;
                for (const double u : {0.0, 0.5, 1.0, next()})
                    for (const double v : {0.0, 0.5, next()})
                        if (u + v <= 1) {
                            const Double3 at = c[0] + (c[1] - c[0]) * u + (c[2] - c[0]) * v;
                            ask(vec_of(at), l, i);
                            ask(vec_of(at), l, other);
                            ask(vec_of(at + somewhere(1e-6)), l, other);
                        }
                ask(vec_of(c[0] * 1.25 - lights[l].position * 0.25), l, other); // seen behind its corners
            }
            for (int i = 0; i < 100; ++i) {
                ask(vec_of(somewhere(1.25)), l, other);
                ask(vec_of(lights[l].position + somewhere(1e-6)), l, other);
            }
            ask(vec_of(lights[l].position), l, other);
        }
    }

    std::vector<unsigned char> block;
    uint64_t queries = 0, shadowed = 0, wrong = 0;
};

} // namespace wisp::WISP_ARITH
