// The paper's shadow culling.
#include "core/shadows/nah_culling.h"
#include "wisp/settings.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

uint64_t paper_bytes(const Scene &scene, const Settings &settings) {
    return Arena::bytes<PaperShadows>(1) + Arena::bytes<PaperTriangle>(scene.triangle_count()) +
           Arena::bytes<uint32_t>(static_cast<uint64_t>(settings.crop.x1 - settings.crop.x0));
}

PaperShadows *make_paper_shadows(const Scene &scene, Arena &arena) {
    PaperShadows *paper = arena.make<PaperShadows>(1);
    PaperTriangle *triangles = arena.make<PaperTriangle>(scene.triangle_count());
    if (!paper || !triangles) return nullptr;
    std::fill(triangles, triangles + scene.triangle_count(), PaperTriangle{});
    *paper = {};
    paper->triangles = triangles;
    paper->triangle_count = scene.triangle_count();
    return paper;
}

bool begin_frame(PaperShadows &paper, const Shadows &shadows, const Settings &settings, Arena &arena) {
    const Scene &scene = *shadows.scene;
    const uint32_t lights = std::min(scene.light_count, ModeWord::lights);
    paper.width = settings.crop.x1 - settings.crop.x0;
    paper.height = settings.crop.y1 - settings.crop.y0;
    paper.row = arena.make<uint32_t>(static_cast<size_t>(paper.width));
    if (!paper.row) return false;
    for (uint32_t i = 0; i < paper.triangle_count; ++i) {
        PaperTriangle &triangle = paper.triangles[i];
        triangle.pixels = 0;
        if (triangle.mode.occlusion() == OcclusionMode::partially_occluded)
            triangle.mode.set_occlusion(OcclusionMode::init);
    }
    for (uint32_t l = 0; l < lights; ++l) {
        if (paper.any_frame && !same_shadows(paper.lights[l], shadows.lights[l]))
            for (uint32_t i = 0; i < paper.triangle_count; ++i) {
                ModeWord &mode = paper.triangles[i].mode;
                mode.forget_shadow(l);
                if (mode.occlusion() == OcclusionMode::fully_rendered) mode.set_occlusion(OcclusionMode::init);
            }
        paper.lights[l] = shadows.lights[l];
    }
    paper.any_frame = true;
    shadows.statistics->shadow.checked = settings.check_shadows;
    return true;
}

void begin_sample(PaperShadows &paper, int32_t x, int32_t y, uint32_t sample) {
    paper.x = x;
    paper.y = y;
    paper.first_sample = sample == 0;
    if (paper.first_sample) paper.wrong = false;
}

// C2
void see(PaperShadows &paper, const Shadows &shadows, const Ray &ray, const Hit &hit) {
    if (!paper.first_sample) return;
    const int32_t x = paper.x, y = paper.y;
    uint32_t &above = paper.row[x];
    const uint32_t references[] = {x > 0 ? paper.row[x - 1] : no_triangle, y > 0 ? above : no_triangle};
    above = hit.found ? hit.triangle : no_triangle;
    if (!hit.found) return;
    PaperTriangle &triangle = paper.triangles[hit.triangle];
    ++triangle.pixels;
    if (hit.triangle >= shadows.surfaces->static_count) {
        triangle.mode.set_occlusion(OcclusionMode::dynamic);
    } else if (x == 0 || y == 0 || x == paper.width - 1 || y == paper.height - 1) {
        triangle.mode.set_occlusion(OcclusionMode::partially_occluded);
    } else {
        for (const uint32_t reference : references) {
            if (reference == no_triangle || reference == hit.triangle) continue;
            ModeWord &mode = paper.triangles[reference].mode;
            if (mode.occlusion() != OcclusionMode::init) continue; // nor is it one that moves
            ++shadows.statistics->shadow.extra_tests;
            if (intersects(*shadows.scene, reference, TriangleRay(ray.origin, ray.direction), Real(0), infinite_distance))
                mode.set_occlusion(OcclusionMode::partially_occluded);
        }
    }
}

// C3, C4. As the erratum to Table 2 has it, FULL_SHADOW is a hit.
bool is_shadowed(PaperShadows &paper, Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    Statistics &statistics = *shadows.statistics;
    const auto traced = [&](TreeCounts &counts) {
        return is_blocked(surfaces, query.ray, surfaces.ray_epsilon, query.end, query.triangle, counts);
    };
    if (query.light >= ModeWord::lights) return traced(statistics.shadow.traced);
    ModeWord &mode = paper.triangles[query.triangle].mode;
    const ShadowMode known =
        mode.occlusion() == OcclusionMode::fully_rendered ? mode.shadow(query.light) : ShadowMode::init;
    bool shadowed;
    if (known == ShadowMode::full) {
        ++statistics.rays.shadow_culled;
        shadowed = true;
    } else if (known == ShadowMode::none) {
        ++statistics.rays.shadow_dynamic_only;
        shadowed = is_blocked_by_moving(shadows, query);
    } else {
        shadowed = traced(statistics.shadow.traced);
        mode.add_shadow(query.light, shadowed);
        return shadowed;
    }
    TreeCounts unused = {};
    if (statistics.shadow.checked && !paper.wrong && traced(unused) != shadowed) {
        paper.wrong = true;
        ++statistics.shadow.wrong_pixels;
    }
    return shadowed;
}

// C5
void end_frame(PaperShadows &paper) {
    for (uint32_t i = 0; i < paper.triangle_count; ++i) {
        PaperTriangle &triangle = paper.triangles[i];
        if (triangle.pixels == 0) continue;
        if (triangle.mode.occlusion() == OcclusionMode::init)
            triangle.mode.set_occlusion(OcclusionMode::fully_rendered);
        else if (triangle.mode.occlusion() == OcclusionMode::fully_rendered &&
                 triangle.pixels > 4 * uint64_t{triangle.max_pixels})
            triangle.mode.set_occlusion(OcclusionMode::init);
        triangle.max_pixels = std::max(triangle.max_pixels, triangle.pixels);
    }
}

} // namespace wisp::WISP_ARITH
