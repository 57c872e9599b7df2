// The functions of a recorder: numbers of the arithmetic become events in double.
#include "core/march/pixel_recorder.h"

namespace wisp::WISP_ARITH {

namespace {

// One overload for each member of TraceEvent.
#define WISP_SEND(Type, name)                                                                                          \
    void send(const PixelRecorder &recorder, const TraceEvent::Type &name) {                                           \
        TraceEvent event = {};                                                                                         \
        event.kind = TraceEvent::Kind::name;                                                                           \
        event.name = name;                                                                                             \
        recorder.trace.on_event(recorder.trace.context, event);                                                        \
    }
WISP_SEND(Sample, sample)
WISP_SEND(Ray, ray)
WISP_SEND(March, march)
WISP_SEND(Light, light)
WISP_SEND(Step, step)
WISP_SEND(MarchEnd, march_end)
WISP_SEND(Hit, hit)
WISP_SEND(DirectLight, direct_light)
WISP_SEND(Unsent, unsent)
WISP_SEND(RayEnd, ray_end)
WISP_SEND(SampleEnd, sample_end)
WISP_SEND(Pixel, pixel)
#undef WISP_SEND

void sample(PixelRecorder &recorder, uint32_t index, Real column, Real row) {
    send(recorder, TraceEvent::Sample{index, to_double(column), to_double(row)});
}
void sample_end(PixelRecorder &recorder, uint32_t index, Color radiance) {
    send(recorder, TraceEvent::SampleEnd{index, to_double3(radiance)});
}
void pixel(PixelRecorder &recorder, uint32_t samples, Color mean, const float *value) {
    send(recorder, TraceEvent::Pixel{samples, to_double3(mean), {value[0], value[1], value[2]}});
}

void ray(PixelRecorder &recorder, RayKind kind, uint32_t level, const Ray &ray, Color factor, Real weight) {
    send(recorder, TraceEvent::Ray{kind, level, to_double3(ray.origin), to_double3(ray.direction), to_double3(factor),
                                   to_double(weight)});
}
void ray_end(PixelRecorder &recorder, const RayEndRecord &end) {
    send(recorder, TraceEvent::RayEnd{end.hit, to_double3(end.smoke), to_double(end.transmittance),
                                      to_double3(end.behind), to_double3(end.radiance)});
}
void unsent(PixelRecorder &recorder, RayKind kind, Color factor, Real weight, bool too_deep) {
    send(recorder, TraceEvent::Unsent{kind, to_double3(factor), to_double(weight), too_deep});
}

void hit(PixelRecorder &recorder, const HitRecord &hit) {
    send(recorder,
         TraceEvent::Hit{to_double(hit.distance), hit.triangle, hit.instance, hit.is_static, hit.material, hit.texture,
                         to_double(hit.u), to_double(hit.v), to_double3(hit.point), to_double3(hit.plane),
                         to_double3(hit.normal), hit.entered, to_double3(hit.texture_color), to_double3(hit.ambient)});
}
void direct_light(PixelRecorder &recorder, Color radiance) {
    send(recorder, TraceEvent::DirectLight{to_double3(radiance)});
}

void march(PixelRecorder &recorder, Real begin, Real end, Real step, int32_t steps) {
    send(recorder, TraceEvent::March{to_double(begin), to_double(end), to_double(step), steps});
}
void march_end(PixelRecorder &recorder, Color radiance, Real optical_depth, Real transmittance) {
    send(recorder, TraceEvent::MarchEnd{to_double3(radiance), to_double(optical_depth), to_double(transmittance)});
}
void step(PixelRecorder &recorder, const StepRecord &step) {
    send(recorder,
         TraceEvent::Step{step.step, to_double(step.distance), to_double(step.length), to_double(step.extinction),
                          to_double(step.optical_depth), to_double(exp(-step.optical_depth)), to_double3(step.single),
                          to_double3(step.multiple), to_double3(step.emission), to_double3(step.radiance)});
}

void light(PixelRecorder &recorder, const LightRecord &record) {
    TraceEvent::Light &light = recorder.shadow[0];
    light.step = record.step;
    light.light = record.light;
    light.faces = record.faces;
    light.direction = to_double3(record.from.direction);
    light.distance = to_double(record.from.distance);
    light.irradiance = to_double3(record.from.irradiance);
    light.optical_depth = to_double(record.optical_depth);
    light.transmittance = to_double(record.transmittance);
    light.contribution = to_double3(record.contribution);
    send(recorder, light);
    light = {};
}

void shadow_begin(PixelRecorder &recorder, const Statistics &statistics) { recorder.before = statistics; }
void shadow_end(PixelRecorder &recorder, uint32_t lane, const Statistics &after, Real lit) {
    const Statistics &before = recorder.before;
    TraceEvent::Light &light = recorder.shadow[lane];
    light.lit = to_double(lit);
    light.node_visits = after.shadow.traced.node_visits - before.shadow.traced.node_visits;
    light.triangle_tests = after.shadow.traced.triangle_tests - before.shadow.traced.triangle_tests;
    light.extra_tests = after.shadow.extra_tests - before.shadow.extra_tests;
    light.decision = after.rays.shadow_culled > before.rays.shadow_culled               ? ShadowDecision::culled
                     : after.rays.shadow_dynamic_only > before.rays.shadow_dynamic_only ? ShadowDecision::culled_static
                     : light.extra_tests > 0 && light.node_visits == 0                  ? ShadowDecision::tested
                                                                                        : ShadowDecision::traced;
}

void lane_lights(PixelRecorder &recorder) {
    const LaneLightRecord &record = recorder.lane_light;
    for (uint32_t l = 0; l < lanes; ++l) {
        TraceEvent::Light &light = recorder.shadow[l];
        if (record.extinction[l] > Real(0)) {
            const Vec3 &x = record.middle[l];
            const Real depth = max(Real(0), record.optical_depth[l]);
            light.step = record.step[l];
            light.smoke = record.smoke;
            light.light = record.light;
            light.faces = true;
            light.direction = to_double3(record.direction[l]);
            light.distance = to_double(illuminate(*record.source, x, x, x).distance);
            light.irradiance = to_double3(record.color * record.irradiance[l]);
            light.optical_depth = to_double(depth);
            light.transmittance = to_double(exp(-depth));
            light.contribution =
                to_double3(record.albedo * record.color * (record.extinction[l] * record.scattered[l]));
            send(recorder, light);
        }
        light = {};
    }
}

} // namespace

PixelRecorder make_recorder(const PixelTrace &trace) {
    PixelRecorder recorder = {};
    recorder.trace = trace;
    recorder.sample = sample;
    recorder.sample_end = sample_end;
    recorder.pixel = pixel;
    recorder.ray = ray;
    recorder.ray_end = ray_end;
    recorder.unsent = unsent;
    recorder.hit = hit;
    recorder.direct_light = direct_light;
    recorder.march = march;
    recorder.march_end = march_end;
    recorder.step = step;
    recorder.light = light;
    recorder.shadow_begin = shadow_begin;
    recorder.shadow_end = shadow_end;
    recorder.lanes_begin = begin_lanes;
    recorder.lane_lights = lane_lights;
    recorder.lane_sources = add_lane_sources;
    recorder.lane_steps = end_lanes;
    return recorder;
}

} // namespace wisp::WISP_ARITH
