// The table of techniques, and what a frame calls.
#include "host/scene/shadow_words.h"
#include "core/shadows/shadows.h"
#include "support/built_surfaces.h"
#include <set>
#include <string>

namespace wisp::WISP_ARITH {

TEST_CASE(WISP_ARITH_NAME ": each shadow method has a name, words and a technique of its own") {
    constexpr size_t count = sizeof shadow_method_names / sizeof *shadow_method_names;
    std::set<const ShadowTechnique *> techniques;
    std::string choices;
    for (size_t i = 0; i < count; ++i) {
        const ShadowTechnique *technique = find_technique(static_cast<ShadowMethod>(i));
        CHECK(bool(technique->is_shadowed));
        CHECK(bool(technique->bytes) == bool(technique->make));
        techniques.insert(technique);
        CHECK(std::string(shadow_method_descriptions[i]) != "");
        choices += std::string("|") + shadow_method_names[i];
    }
    CHECK(techniques.size() == count);
    CHECK(choices == shadow_method_choices);
    CHECK(choices == "|trace|cache|paper|exact|voxel|lightbuffer|lie");
    CHECK(find_technique(ShadowMethod::exact) == &exact_technique);
    CHECK(find_technique(ShadowMethod::lie) == &lie_technique);
}

TEST_CASE(WISP_ARITH_NAME ": without lights, and for points of space, a technique may give way to tracing") {
    Room room;
    room.add({-1, 0, -1}, {1, 0, -1}, {0, 0, 1}, room.material(matte({1, 1, 1})));
    room.build();
    Settings settings = {};
    settings.shadows = ShadowMethod::voxel;
    CHECK(shadow_technique(room.scene, settings) == &trace_technique);
    CHECK(shadow_bytes(room.scene, settings) == 0);
    Arena none(nullptr, 0);
    void *memory = &room;
    CHECK(make_shadow_memory(room.scene, settings, none, memory));
    CHECK(memory == nullptr);

    room.light(LightKind::constant, {0, 2, 0}, {1, 1, 1});
    room.build();
    CHECK(shadow_technique(room.scene, settings) == &voxel_technique);
    CHECK(shadow_bytes(room.scene, settings) > 0);
    CHECK(!make_shadow_memory(room.scene, settings, none, memory)); // too small an arena
    for (const ShadowTechnique *technique : {&exact_technique, &paper_technique}) {
        room.shadows.technique = technique;
        CHECK(shadows_in_space(room.shadows).technique ==
              (technique == &paper_technique ? &trace_technique : technique));
    }
}

TEST_CASE(WISP_ARITH_NAME ": tracing finds what stands between a point and a light, and counts the query") {
    Room room;
    room.add({-1, 1, -1}, {1, 1, -1}, {0, 1, 1}, room.material(matte({1, 1, 1})));
    room.light(LightKind::constant, {0, 2, 0}, {1, 1, 1});
    room.build();
    const auto ask = [&](double x, double y) {
        const Vec3 at = vec_of({x, y, 0});
        return is_shadowed(&room.shadows, 0, at, illuminate(room.tracer.lights[0], at, at, at));
    };
    CHECK(ask(0, 0));
    CHECK(!ask(5, 0));
    CHECK(!ask(0, 1.5)); // above the triangle
    CHECK(!ask(0, 3));   // the triangle lies beyond the light's other side
    CHECK(room.statistics.rays.shadow == 4);
    CHECK(room.statistics.rays.shadow_culled == 0);
    CHECK(room.statistics.shadow.traced.node_visits > 0);
    CHECK(!is_shadowed(nullptr, 0, vec_of({0, 0, 0}), {}));
}

} // namespace wisp::WISP_ARITH
