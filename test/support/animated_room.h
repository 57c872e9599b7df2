// A random room from frame to frame, its camera rays, and every shadow that they ask for.
#pragma once
#include "core/geometry/camera.h"
#include "support/random_rooms.h"
#include "wisp/settings.h"
#include <functional>

namespace wisp::WISP_ARITH {

// Shadows that are heard of as they are asked.
struct HeardShadows : Shadows {
    std::function<void(const ShadowQuery &, bool)> heard;
};
// The shading that asks them.
Color trace_heard(const Whitted &tracer, const Ray &ray);

// Bodies move, vanish and come back, morphs change their form, lights move, turn and stay.
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
        settings.check_shadows = true;
        const uint64_t bytes = surface_bytes(scene) + shadow_bytes(scene, settings);
        kept_.resize(static_cast<size_t>(bytes));
        frame_.resize(static_cast<size_t>(placement_bytes(scene) + shadow_bytes(scene, settings) +
                                          Arena::bytes<Light>(light_count)));
        Arena arena(kept_.data(), kept_.size());
        surfaces = make_surfaces(scene, arena);
        REQUIRE(make_shadow_memory(scene, settings, arena, memory_));
        heard.method = shadow_method(scene, settings);
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
        heard.scene = &scene;
        heard.surfaces = &surfaces;
        heard.lights = placed;
        heard.statistics = &statistics;
        heard.memory = memory_;
        REQUIRE(begin_frame(heard, settings, arena));
        Whitted whitted = tracer;
        whitted.surfaces = &surfaces;
        whitted.lights = placed;
        whitted.shadows = &heard;
        const View view(scene.camera);
        for (int y = 0; y < room_pixels; ++y)
            for (int x = 0; x < room_pixels; ++x) {
                const Ray ray = view.ray_through(Real(x) + Real(0.5), Real(y) + Real(0.5));
                before(x, y, ray);
                begin_sample(heard, x, y, 0);
                trace_heard(whitted, ray);
            }
        end_frame(heard);
    }
    bool blocked(const ShadowQuery &query) {
        TreeCounts unused = {};
        return is_blocked(surfaces, query.ray, surfaces.ray_epsilon, query.end, query.triangle, unused);
    }

    Settings settings = {};
    HeardShadows heard = {};

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
