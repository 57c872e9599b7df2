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

TEST_CASE(WISP_ARITH_NAME ": without lights every technique gives way to tracing") {
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
}

} // namespace wisp::WISP_ARITH
