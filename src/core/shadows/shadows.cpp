// Hard shadows: by a ray to the light, or by one of the ways to save it.
#include "core/shadows/nah_culling.h"
#include "core/shadows/proved_shadows.h"
#include "core/shadows/rivals/light_buffer.h"
#include "core/shadows/rivals/local_illumination.h"
#include "core/shadows/rivals/occluder_cache.h"
#include "core/shadows/rivals/voxel_occlusion.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

uint64_t shadow_bytes(const Scene &scene, const Settings &settings) {
    switch (shadow_method(scene, settings)) {
    case ShadowMethod::cache: return shadow_cache_bytes(scene);
    case ShadowMethod::paper: return paper_bytes(scene, settings);
    case ShadowMethod::exact: return proved_shadow_bytes(scene);
    case ShadowMethod::voxel: return voxel_bytes(scene);
    case ShadowMethod::lightbuffer: return light_buffer_bytes(scene);
    case ShadowMethod::lie: return local_shadow_bytes(scene);
    default: return 0;
    }
}

bool make_shadow_memory(const Scene &scene, const Settings &settings, Arena &arena, void *&memory) {
    memory = nullptr;
    switch (shadow_method(scene, settings)) {
    case ShadowMethod::cache: memory = make_shadow_cache(scene, arena); break;
    case ShadowMethod::paper: memory = make_paper_shadows(scene, arena); break;
    case ShadowMethod::exact: memory = make_proved_shadows(scene, arena); break;
    case ShadowMethod::voxel: memory = make_voxel_shadows(scene, arena); break;
    case ShadowMethod::lightbuffer: memory = make_light_buffer(scene, arena); break;
    case ShadowMethod::lie: memory = make_local_shadows(scene, arena); break;
    default: return true;
    }
    return memory != nullptr;
}

bool begin_frame(Shadows &shadows, const Settings &settings, Arena &arena) {
    void *memory = shadows.memory;
    switch (shadows.method) {
    case ShadowMethod::paper: return begin_frame(*static_cast<PaperShadows *>(memory), shadows, settings, arena);
    case ShadowMethod::voxel: begin_frame(*static_cast<VoxelShadows *>(memory), shadows); return true;
    case ShadowMethod::exact: return begin_frame(*static_cast<ProvedShadows *>(memory), shadows, arena);
    case ShadowMethod::lightbuffer: begin_frame(*static_cast<LightBuffer *>(memory), shadows); return true;
    case ShadowMethod::lie: begin_frame(*static_cast<LocalShadows *>(memory), shadows); return true;
    default: return true;
    }
}

void begin_sample(Shadows &shadows, int32_t x, int32_t y, uint32_t sample) {
    if (shadows.method == ShadowMethod::paper) begin_sample(*static_cast<PaperShadows *>(shadows.memory), x, y, sample);
}

void see(Shadows &shadows, const Ray &ray, const Hit &hit) {
    if (shadows.method == ShadowMethod::paper) see(*static_cast<PaperShadows *>(shadows.memory), shadows, ray, hit);
}

void end_frame(Shadows &shadows) {
    if (shadows.method == ShadowMethod::paper) end_frame(*static_cast<PaperShadows *>(shadows.memory));
}

bool is_shadowed(Shadows &shadows, const ShadowQuery &query) {
    void *memory = shadows.memory;
    ++shadows.statistics->rays.shadow;
    switch (shadows.method) {
    case ShadowMethod::cache: return is_shadowed(*static_cast<ShadowCache *>(memory), shadows, query);
    case ShadowMethod::paper: return is_shadowed(*static_cast<PaperShadows *>(memory), shadows, query);
    case ShadowMethod::voxel: return is_shadowed(*static_cast<VoxelShadows *>(memory), shadows, query);
    case ShadowMethod::exact: return is_shadowed(*static_cast<ProvedShadows *>(memory), shadows, query);
    case ShadowMethod::lightbuffer: return is_shadowed(*static_cast<LightBuffer *>(memory), shadows, query);
    case ShadowMethod::lie: return is_shadowed(*static_cast<LocalShadows *>(memory), shadows, query);
    default: break;
    }
    return is_blocked(shadows, query);
}

bool is_shadowed_by_moving_alone(Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    Statistics &statistics = *shadows.statistics;
    if (surfaces.deforming_count == 0 && surfaces.group_count == 0) {
        ++statistics.rays.shadow_culled;
        return false;
    }
    ++statistics.rays.shadow_dynamic_only;
    return is_blocked_by_moving(shadows, query);
}

} // namespace wisp::WISP_ARITH
