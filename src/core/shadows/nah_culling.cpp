// Shadow culling by mode words.
#include "core/shadows/nah_culling.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

uint64_t culling_bytes(const Scene &scene, const Settings &settings) {
    return Arena::bytes<NahCulling>(1) + Arena::bytes<CulledTriangle>(scene.triangle_count()) +
           Arena::bytes<uint32_t>(static_cast<uint64_t>(settings.crop.width()));
}

void *make_culling(const Scene &scene, const Settings &, Arena &arena, Watch) {
    NahCulling *culling = arena.make<NahCulling>(1);
    CulledTriangle *triangles = arena.make<CulledTriangle>(scene.triangle_count());
    if (!culling || !triangles) return nullptr;
    std::fill(triangles, triangles + scene.triangle_count(), CulledTriangle{});
    *culling = {};
    culling->triangles = triangles;
    culling->triangle_count = scene.triangle_count();
    return culling;
}

bool begin_culling_frame(Shadows &shadows, const Settings &settings, Arena &arena) {
    NahCulling &culling = memory_of<NahCulling>(shadows);
    const Scene &scene = *shadows.scene;
    const uint32_t lights = std::min(scene.light_count, ModeWord::lights);
    culling.crop = settings.crop;
    culling.width = settings.crop.width();
    culling.height = settings.crop.height();
    culling.row = arena.make<uint32_t>(static_cast<size_t>(culling.width));
    if (!culling.row) return false;
    for (uint32_t i = 0; i < culling.triangle_count; ++i) {
        CulledTriangle &triangle = culling.triangles[i];
        triangle.pixels = 0;
        if (triangle.mode.occlusion() == OcclusionMode::partially_occluded)
            triangle.mode.set_occlusion(OcclusionMode::init);
    }
    for (uint32_t l = 0; l < lights; ++l) {
        if (!shadows.watch.go_on(culling.triangle_count)) return false;
        if (culling.any_frame && !same_shadows(culling.lights[l], shadows.lights[l]))
            for (uint32_t i = 0; i < culling.triangle_count; ++i) {
                ModeWord &mode = culling.triangles[i].mode;
                mode.forget_shadow(l);
                if (mode.occlusion() == OcclusionMode::fully_rendered) mode.set_occlusion(OcclusionMode::init);
            }
        culling.lights[l] = shadows.lights[l];
    }
    culling.any_frame = true;
    shadows.statistics->shadow.checked = settings.check_shadows;
    return true;
}

void begin_culling_sample(Shadows &shadows, int32_t x, int32_t y, uint32_t sample) {
    NahCulling &culling = memory_of<NahCulling>(shadows);
    culling.x = (x - culling.crop.x0) / culling.crop.step;
    culling.y = (y - culling.crop.y0) / culling.crop.step;
    culling.first_sample = sample == 0;
    if (culling.first_sample) culling.wrong = false;
}

// The occlusion test (C2).
void record_culling_hit(Shadows &shadows, const Ray &ray, const Hit &hit) {
    NahCulling &culling = memory_of<NahCulling>(shadows);
    if (!culling.first_sample) return;
    const int32_t x = culling.x, y = culling.y;
    uint32_t &above = culling.row[x];
    const uint32_t references[] = {x > 0 ? culling.row[x - 1] : no_triangle, y > 0 ? above : no_triangle};
    above = hit.found ? hit.triangle : no_triangle;
    if (!hit.found) return;
    CulledTriangle &triangle = culling.triangles[hit.triangle];
    ++triangle.pixels;
    if (hit.triangle >= shadows.surfaces->static_count) {
        triangle.mode.set_occlusion(OcclusionMode::dynamic);
    } else if (x == 0 || y == 0 || x == culling.width - 1 || y == culling.height - 1) {
        triangle.mode.set_occlusion(OcclusionMode::partially_occluded);
    } else {
        for (const uint32_t reference : references) {
            if (reference == no_triangle || reference == hit.triangle) continue;
            ModeWord &mode = culling.triangles[reference].mode;
            if (mode.occlusion() != OcclusionMode::init) continue; // a moving triangle is never INIT here
            ++shadows.statistics->shadow.extra_tests;
            if (intersects(*shadows.scene, reference, TriangleRay(ray.origin, ray.direction), Real(0),
                           infinite_distance))
                mode.set_occlusion(OcclusionMode::partially_occluded);
        }
    }
}

// The shadow test (C3), and what it adds to the mode (C4). As C3's erratum says, FULL_SHADOW is a hit.
bool is_shadowed_by_culling(Shadows &shadows, const ShadowQuery &query) {
    NahCulling &culling = memory_of<NahCulling>(shadows);
    Statistics &statistics = *shadows.statistics;
    const auto traced = [&](TreeCounts &counts) {
        return is_blocked(*shadows.surfaces, query.ray, query.begin, query.end, query.triangle, counts);
    };
    if (query.light >= ModeWord::lights) return traced(statistics.shadow.traced);
    ModeWord &mode = culling.triangles[query.triangle].mode;
    const ShadowMode reused =
        mode.occlusion() == OcclusionMode::fully_rendered ? mode.shadow(query.light) : ShadowMode::init;
    bool shadowed;
    if (reused == ShadowMode::full) {
        ++statistics.rays.shadow_culled;
        shadowed = true;
    } else if (reused == ShadowMode::none) {
        ++statistics.rays.shadow_dynamic_only;
        shadowed = is_blocked_by_moving(shadows, query);
    } else {
        shadowed = traced(statistics.shadow.traced);
        mode.add_shadow(query.light, shadowed);
        return shadowed;
    }
    TreeCounts unused = {};
    if (statistics.shadow.checked && !culling.wrong && traced(unused) != shadowed) {
        culling.wrong = true;
        ++statistics.shadow.wrong_pixels;
    }
    return shadowed;
}

// Occlusion modes for the next frame (C5).
void end_culling_frame(Shadows &shadows) {
    NahCulling &culling = memory_of<NahCulling>(shadows);
    for (uint32_t i = 0; i < culling.triangle_count; ++i) {
        CulledTriangle &triangle = culling.triangles[i];
        if (triangle.pixels == 0) continue;
        if (triangle.mode.occlusion() == OcclusionMode::init)
            triangle.mode.set_occlusion(OcclusionMode::fully_rendered);
        else if (triangle.mode.occlusion() == OcclusionMode::fully_rendered &&
                 triangle.pixels > 4 * uint64_t{triangle.max_pixels})
            triangle.mode.set_occlusion(OcclusionMode::init);
        triangle.max_pixels = std::max(triangle.max_pixels, triangle.pixels);
    }
}

} // namespace

const ShadowTechnique paper_technique = {is_shadowed_by_culling, culling_bytes,     make_culling,
                                         begin_culling_frame,    end_culling_frame, begin_culling_sample,
                                         record_culling_hit};

} // namespace wisp::WISP_ARITH
