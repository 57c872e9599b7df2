// A random room from frame to frame, its camera rays, and every shadow query that shading makes for them.
#pragma once
#include "core/geometry/camera.h"
#include "support/random_rooms.h"
#include "wisp/settings.h"
#include <functional>

namespace wisp::WISP_ARITH {

// Shadows that report each query and its answer to a callback.
struct RecordedShadows {
    Shadows inner = {}; // which answer

    static const ShadowTechnique technique;
    Shadows recorder() { return {inner.scene, inner.surfaces, inner.lights, &unused, &technique, this}; }

    std::function<void(const ShadowQuery &, bool)> on_query;

  private:
    Statistics unused; // `inner` counts
};
inline const ShadowTechnique RecordedShadows::technique = {
    [](Shadows &shadows, const ShadowQuery &query) {
        RecordedShadows &recorded = memory_of<RecordedShadows>(shadows);
        const bool shadowed = is_shadowed(recorded.inner, query);
        recorded.on_query(query, shadowed);
        return shadowed;
    },
    nullptr,
    nullptr,
    nullptr,
    nullptr,
    nullptr,
    [](Shadows &shadows, const Ray &ray, const Hit &hit) {
        record_primary_hit(memory_of<RecordedShadows>(shadows).inner, ray, hit);
    }};

// Instances move, vanish and come back; deforming triangles change; lights move, turn and stay.
class RoomFrames : public RandomRoom {
  public:
    RoomFrames(uint64_t seed, double size_, uint32_t light_count, ShadowMethod method, bool moving_camera = true)
        : RandomRoom(seed, size_), next_{seed * 31 + 7}, moving_camera_(moving_camera) {
        lights.clear();
        for (uint32_t i = 0; i < light_count; ++i) {
            const LightKind kinds[] = {LightKind::point, LightKind::constant, LightKind::parallel, LightKind::spot};
            const bool strong = i % 4 == 0 || i % 4 == 3;
            light(kinds[i % 4], somewhere(1.5), Double3{1, 1, 1} * (strong ? size * size : 1), some_direction());
            lights.back().one_minus_cosine = 0.3 + next_();
        }
        scene.lights = lights.data();
        scene.light_count = light_count;
        settings.crop = {0, 0, room_pixels, room_pixels};
        settings.samples = 1;
        settings.depth = depth;
        settings.shadows = method;
        settings.tree = seed / 4 % 2 == 0 ? TreeKind::bvh : TreeKind::kd;
        settings.check_shadows = true;
        const uint64_t bytes = surface_bytes(scene, settings.tree) + shadow_bytes(scene, settings);
        kept_.resize(static_cast<size_t>(bytes));
        frame_.resize(static_cast<size_t>(placement_bytes(scene, settings.tree) + shadow_bytes(scene, settings) +
                                          Arena::bytes<Light>(light_count)));
        Arena arena(kept_.data(), kept_.size());
        surfaces = make_surfaces(scene, settings.tree, arena);
        REQUIRE(make_shadow_memory(scene, settings, arena, memory_));
        recorded.inner.technique = shadow_technique(scene, settings);
    }

    void change() {
        if (moving_camera_) scene.camera.origin = scene.camera.origin + somewhere(0.05);
        for (Instance &instance : instances) {
            if (next_() < 0.5) instance.origin = somewhere(0.7);
            if (next_() < 0.2) instance.visible = !instance.visible;
        }
        for (size_t i = triangles.size() - scene.deforming_count; i < triangles.size(); ++i)
            for (Double3 &corner : triangles[i].corner)
                if (next_() < 0.5) corner = somewhere(1);
        if (next_() < 0.6) return;
        for (LightSource &l : lights) {
            if (next_() < 0.15) l.position = somewhere(1.5);
            if (next_() < 0.15) l.direction = some_direction();
        }
    }

    // Every camera ray of a frame: before(x, y, ray), then the shadows that it asks for.
    template <class Before> void render_frame(Before &&before) {
        Arena arena(frame_.data(), frame_.size());
        place_surfaces(scene, arena, surfaces);
        REQUIRE(surfaces.ready);
        const Light *placed = make_lights(scene, arena);
        Shadows &inner = recorded.inner;
        inner = {&scene, &surfaces, placed, &statistics, inner.technique, memory_};
        REQUIRE(begin_frame(inner, settings, arena));
        Shadows recorder = recorded.recorder();
        Whitted whitted = tracer;
        whitted.surfaces = &surfaces;
        whitted.lights = placed;
        whitted.shadows = &recorder;
        const View view(scene.camera);
        for (int y = 0; y < room_pixels; ++y)
            for (int x = 0; x < room_pixels; ++x) {
                const Ray ray = view.ray_through(Real(x) + Real(0.5), Real(y) + Real(0.5));
                before(x, y, ray);
                begin_sample(inner, x, y, 0);
                trace(whitted, ray);
            }
        end_frame(inner);
    }
    bool blocked(const ShadowQuery &query) {
        TreeCounts unused = {};
        return is_blocked(surfaces, query.ray, surfaces.ray_epsilon, query.end, query.triangle, unused);
    }

    Settings settings = {};
    RecordedShadows recorded;

  private:
    Double3 somewhere(double part) {
        const double x = 2 * next_() - 1, y = 2 * next_() - 1, z = 2 * next_() - 1;
        return Double3{x, y, z} * (part * size);
    }
    Double3 some_direction() {
        Double3 v = somewhere(1);
        while (length(v) < 0.1 * size) v = somewhere(1);
        return unit(v);
    }

    Sequence next_;
    bool moving_camera_;
    std::vector<unsigned char> kept_, frame_;
    void *memory_ = nullptr;
};

} // namespace wisp::WISP_ARITH
