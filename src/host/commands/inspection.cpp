#include "host/base/double3_algebra.h"
#include "host/base/json_object.h"
#include "host/base/text.h"
#include "host/base/version.h"
#include "host/commands/inspection.h"
#include <cstdarg>

namespace wisp {

PixelTrace Inspection::trace() {
    return {x, y, this, [](void *self, const TraceEvent &event) { static_cast<Inspection *>(self)->record(event); }};
}

void Inspection::add_light(const TraceEvent::Light &light) {
    if (light.step >= 0)
        pending_.push_back(light);
    else
        open_.back()->lights.push_back(light);
}

void Inspection::record(const TraceEvent &event) {
    const double bright = std::ldexp(1.0, radiance_exponent);
    const auto place = [this](Double3 &p) { p = p * (1 / scale) + center; };
    const auto length = [this](auto &...lengths) { ((lengths /= scale), ...); };
    const auto radiance = [bright](auto &...radiances) { ((radiances = radiances * bright), ...); };
    using Kind = TraceEvent::Kind;
    switch (event.kind) {
    case Kind::sample: samples.push_back({event.sample, nullptr, {}}); break;
    case Kind::ray: {
        auto ray = std::make_unique<Ray>();
        ray->ray = event.ray;
        place(ray->ray.origin);
        Ray *const opened = ray.get();
        if (open_.empty())
            samples.back().ray = std::move(ray);
        else
            open_.back()->rays.push_back(std::move(ray));
        open_.push_back(opened);
        break;
    }
    case Kind::march: {
        TraceEvent::March march = event.march;
        length(march.begin, march.end, march.step);
        open_.back()->march = march;
        break;
    }
    case Kind::light: {
        TraceEvent::Light light = event.light;
        length(light.distance);
        radiance(light.irradiance, light.contribution);
        if (light.step >= 0) light.contribution = light.contribution * scale;
        add_light(light);
        break;
    }
    case Kind::step: {
        Step step = {event.step, {}};
        length(step.step.distance, step.step.length);
        step.step.extinction *= scale;
        radiance(step.step.single, step.step.multiple, step.step.emission, step.step.radiance);
        for (Double3 *source : {&step.step.single, &step.step.multiple, &step.step.emission}) *source = *source * scale;
        std::vector<TraceEvent::Light> later;
        for (const TraceEvent::Light &light : pending_)
            (light.step == event.step.step ? step.lights : later).push_back(light);
        pending_ = std::move(later);
        open_.back()->steps.push_back(std::move(step));
        break;
    }
    case Kind::march_end:
        open_.back()->march_end = event.march_end;
        radiance(open_.back()->march_end.radiance);
        break;
    case Kind::hit: {
        TraceEvent::Hit hit = event.hit;
        length(hit.distance);
        place(hit.point);
        radiance(hit.ambient);
        open_.back()->hit = hit;
        break;
    }
    case Kind::direct_light:
        open_.back()->direct_light = event.direct_light;
        radiance(open_.back()->direct_light.radiance);
        break;
    case Kind::unsent: open_.back()->unsent.push_back(event.unsent); break;
    case Kind::ray_end: {
        TraceEvent::RayEnd &end = open_.back()->end = event.ray_end;
        radiance(end.smoke, end.behind, end.radiance);
        open_.pop_back();
        break;
    }
    case Kind::sample_end:
        samples.back().end = event.sample_end;
        radiance(samples.back().end.radiance);
        break;
    case Kind::pixel:
        pixel = event.pixel;
        radiance(pixel.mean);
        break;
    }
}

namespace {

const char *name_of(RayKind kind) {
    switch (kind) {
    case RayKind::camera: return "camera";
    case RayKind::reflected: return "reflected";
    case RayKind::refracted: return "refracted";
    }
    return "";
}

const char *name_of(ShadowDecision decision) {
    switch (decision) {
    case ShadowDecision::none: return "unasked";
    case ShadowDecision::culled: return "known";
    case ShadowDecision::culled_static: return "known_still";
    case ShadowDecision::tested: return "tried";
    case ShadowDecision::traced: return "traced";
    }
    return "";
}

bool is_shown(const Inspection &inspection, const Inspection::Sample &sample) {
    return !inspection.only || *inspection.only == sample.sample.index;
}

// Text ----------------------------------------------------------------------------------------------------------------

class Text {
  public:
    __attribute__((format(printf, 3, 4))) void line(int depth, const char *format, ...) {
        char buffer[1000];
        std::va_list values;
        va_start(values, format);
        std::vsnprintf(buffer, sizeof buffer, format, values);
        va_end(values);
        text_ += std::string(2 * static_cast<size_t>(depth), ' ') + buffer + '\n';
    }
    const std::string &text() const { return text_; }

  private:
    std::string text_;
};

std::string triple(const Double3 &v) {
    char digits[100];
    std::snprintf(digits, sizeof digits, "%.6g %.6g %.6g", v.x, v.y, v.z);
    return digits;
}

std::string shadow_text(const TraceEvent::Light &light) {
    const std::string counts = " (" + std::to_string(light.node_visits) + " nodes, " +
                               std::to_string(light.triangle_tests) + " triangles of trees, " +
                               std::to_string(light.extra_tests) + " others)";
    const bool blocked = light.lit == 0;
    std::string found = blocked ? "in shadow, " : "not in shadow, ";
    if (light.step >= 0 && light.lit < 1 && !blocked) found = exact(light.lit) + " of the step lit, ";
    switch (light.decision) {
    case ShadowDecision::none: return blocked ? "in shadow" : "no shadow asked for";
    case ShadowDecision::culled: return found + "known without asking any triangle";
    case ShadowDecision::culled_static: return found + "known of what is still; asked of what moves" + counts;
    case ShadowDecision::tested: return found + "of still triangles some were tried" + counts;
    case ShadowDecision::traced:
        return found + (light.step >= 0 ? "asked by all rays to it" : "asked by a ray") + counts;
    }
    return "";
}

void print_light(Text &text, int depth, const TraceEvent::Light &light) {
    const std::string head = "light " + std::to_string(light.light) + ": ";
    if (!light.faces) {
        const bool reaches = largest(light.irradiance) > 0;
        text.line(depth, "%s%s", head.c_str(), reaches ? "behind the surface" : "does not reach it");
        return;
    }
    text.line(depth, "%sirradiance %s from %.6g away along %s; %s; smoke of depth %.6g passes %.6g; gives %s",
              head.c_str(), triple(light.irradiance).c_str(), light.distance, triple(light.direction).c_str(),
              shadow_text(light).c_str(), light.optical_depth, light.transmittance, triple(light.contribution).c_str());
}

void print_march(Text &text, int depth, const Inspection::Ray &ray) {
    text.line(depth, "smoke may be from %.6g to %.6g: %d steps of %.6g; %zu of them, or of their parts, in smoke",
              ray.march->begin, ray.march->end, ray.march->steps, ray.march->step, ray.steps.size());
    for (const Inspection::Step &step : ray.steps) {
        const TraceEvent::Step &s = step.step;
        text.line(depth + 1,
                  "step %d at %.6g, %.6g long: extinction %.6g, behind depth %.6g passes %.6g; per length single %s, "
                  "multiple %s, emission %s; arrives %s",
                  s.step, s.distance, s.length, s.extinction, s.optical_depth, s.transmittance,
                  triple(s.single).c_str(), triple(s.multiple).c_str(), triple(s.emission).c_str(),
                  triple(s.radiance).c_str());
        for (const TraceEvent::Light &light : step.lights) print_light(text, depth + 2, light);
    }
    text.line(depth, "smoke sends %s; its depth %.6g passes %.6g", triple(ray.march_end.radiance).c_str(),
              ray.march_end.optical_depth, ray.march_end.transmittance);
}

std::string instance_text(const TraceEvent::Hit &hit) {
    return hit.instance >= 0 ? "of body " + std::to_string(hit.instance)
           : hit.is_static   ? "still"
                             : "that changes its form";
}

void print_ray(Text &text, int depth, const Inspection::Ray &ray) {
    text.line(depth, "%s ray from %s along %s, share %s, weight %.6g", name_of(ray.ray.kind),
              triple(ray.ray.origin).c_str(), triple(ray.ray.direction).c_str(), triple(ray.ray.factor).c_str(),
              ray.ray.weight);
    ++depth;
    if (ray.march) print_march(text, depth, ray);
    if (ray.hit) {
        const TraceEvent::Hit &hit = *ray.hit;
        text.line(depth, "hits triangle %u (%s) at %.6g from %s: point %s, u v %.6g %.6g, plane %s, normal %s",
                  hit.triangle, instance_text(hit).c_str(), hit.distance, hit.entered ? "outside" : "inside",
                  triple(hit.point).c_str(), hit.u, hit.v, triple(hit.plane).c_str(), triple(hit.normal).c_str());
        text.line(depth, "material %u, %s %s; ambient %s", hit.material,
                  hit.texture < 0 ? "no texture:" : ("texture " + std::to_string(hit.texture) + ":").c_str(),
                  triple(hit.texture_color).c_str(), triple(hit.ambient).c_str());
        for (const TraceEvent::Light &light : ray.lights) print_light(text, depth + 1, light);
        text.line(depth, "lights together %s", triple(ray.direct_light.radiance).c_str());
        for (const auto &next : ray.rays) print_ray(text, depth + 1, *next);
        for (const TraceEvent::Unsent &unsent : ray.unsent)
            text.line(depth + 1, "%s ray not sent: %s (share %s, weight %.6g)", name_of(unsent.kind),
                      unsent.too_deep ? "the chain is as long as --depth" : "too light", triple(unsent.factor).c_str(),
                      unsent.weight);
    } else {
        text.line(depth, "hits nothing");
    }
    text.line(depth, "radiance %s = %s of smoke + %.6g x %s of %s", triple(ray.end.radiance).c_str(),
              triple(ray.end.smoke).c_str(), ray.end.transmittance, triple(ray.end.behind).c_str(),
              ray.end.hit ? "the surface" : "the background");
}

// JSON ----------------------------------------------------------------------------------------------------------------

using wisp::exact;
std::string exact(const Double3 &v) { return "[" + exact(v.x) + ", " + exact(v.y) + ", " + exact(v.z) + "]"; }
std::string whole(int64_t n) { return std::to_string(n); }

template <class Items, class Json> std::string list(const Items &items, Json &&json) {
    std::string text;
    for (const auto &item : items) {
        const std::string one = json(item);
        if (!one.empty()) text += (text.empty() ? "" : ",\n") + one;
    }
    return "[" + text + "]";
}

std::string light_json(const TraceEvent::Light &light) {
    return Object()
        .add("light", whole(light.light))
        .add("smoke", whole(light.smoke))
        .add_flag("faces", light.faces)
        .add("direction", exact(light.direction))
        .add("distance", exact(light.distance))
        .add("irradiance", exact(light.irradiance))
        .add("lit", exact(light.lit))
        .add("answer", quoted(name_of(light.decision)))
        .add("node_visits", light.node_visits)
        .add("triangle_tests", light.triangle_tests)
        .add("extra_tests", light.extra_tests)
        .add("optical_depth", exact(light.optical_depth))
        .add("transmittance", exact(light.transmittance))
        .add("contribution", exact(light.contribution))
        .text();
}

std::string step_json(const Inspection::Step &step) {
    const TraceEvent::Step &s = step.step;
    return Object()
        .add("step", whole(s.step))
        .add("distance", exact(s.distance))
        .add("length", exact(s.length))
        .add("extinction", exact(s.extinction))
        .add("optical_depth", exact(s.optical_depth))
        .add("transmittance", exact(s.transmittance))
        .add("single", exact(s.single))
        .add("multiple", exact(s.multiple))
        .add("emission", exact(s.emission))
        .add("radiance", exact(s.radiance))
        .add("lights", list(step.lights, light_json))
        .text();
}

std::string march_json(const Inspection::Ray &ray) {
    if (!ray.march) return "null";
    return Object()
        .add("begin", exact(ray.march->begin))
        .add("end", exact(ray.march->end))
        .add("step", exact(ray.march->step))
        .add("steps", whole(ray.march->steps))
        .add("samples", list(ray.steps, step_json))
        .add("radiance", exact(ray.march_end.radiance))
        .add("optical_depth", exact(ray.march_end.optical_depth))
        .add("transmittance", exact(ray.march_end.transmittance))
        .text();
}

std::string unsent_json(const TraceEvent::Unsent &unsent) {
    return Object()
        .add("kind", quoted(name_of(unsent.kind)))
        .add("share", exact(unsent.factor))
        .add("weight", exact(unsent.weight))
        .add_flag("too_deep", unsent.too_deep)
        .text();
}

std::string ray_json(const Inspection::Ray &ray);

std::string hit_json(const Inspection::Ray &ray) {
    if (!ray.hit) return "null";
    const TraceEvent::Hit &hit = *ray.hit;
    return Object()
        .add("distance", exact(hit.distance))
        .add("triangle", whole(hit.triangle))
        .add("body", hit.instance >= 0 ? whole(hit.instance) : "null")
        .add_flag("still", hit.is_static)
        .add("material", whole(hit.material))
        .add("texture", hit.texture >= 0 ? whole(hit.texture) : "null")
        .add("u", exact(hit.u))
        .add("v", exact(hit.v))
        .add("point", exact(hit.point))
        .add("plane", exact(hit.plane))
        .add("normal", exact(hit.normal))
        .add_flag("entered", hit.entered)
        .add("texture_color", exact(hit.texture_color))
        .add("ambient", exact(hit.ambient))
        .add("lights", list(ray.lights, light_json))
        .add("lit", exact(ray.direct_light.radiance))
        .add("rays", list(ray.rays, [](const auto &next) { return ray_json(*next); }))
        .add("unsent", list(ray.unsent, unsent_json))
        .text();
}

std::string ray_json(const Inspection::Ray &ray) {
    return Object()
        .add("kind", quoted(name_of(ray.ray.kind)))
        .add("level", whole(ray.ray.level))
        .add("origin", exact(ray.ray.origin))
        .add("direction", exact(ray.ray.direction))
        .add("share", exact(ray.ray.factor))
        .add("weight", exact(ray.ray.weight))
        .add("march", march_json(ray))
        .add("hit", hit_json(ray))
        .add("smoke", exact(ray.end.smoke))
        .add("transmittance", exact(ray.end.transmittance))
        .add("behind", exact(ray.end.behind))
        .add("radiance", exact(ray.end.radiance))
        .text();
}

} // namespace

std::string inspection_text(const Inspection &inspection) {
    Text text;
    const TraceEvent::Pixel &pixel = inspection.pixel;
    text.line(0, "%s, frame %lld, %s: pixel %d %d of %d x %d", printable(inspection.scene).c_str(),
              static_cast<long long>(inspection.frame), inspection.arithmetic.c_str(), inspection.x, inspection.y,
              inspection.width, inspection.height);
    for (const Inspection::Sample &sample : inspection.samples) {
        text.line(0, "sample %u of %u at %.6g %.6g: radiance %s", sample.sample.index, pixel.samples,
                  sample.sample.column, sample.sample.row, triple(sample.end.radiance).c_str());
        if (is_shown(inspection, sample)) print_ray(text, 1, *sample.ray);
    }
    text.line(0, "pixel %.9g %.9g %.9g", static_cast<double>(pixel.value[0]), static_cast<double>(pixel.value[1]),
              static_cast<double>(pixel.value[2]));
    return text.text();
}

std::string inspection_json(const Inspection &inspection) {
    const TraceEvent::Pixel &pixel = inspection.pixel;
    const auto sample_json = [&inspection](const Inspection::Sample &sample) {
        Object object;
        object.add("index", whole(sample.sample.index))
            .add("column", exact(sample.sample.column))
            .add("row", exact(sample.sample.row))
            .add("radiance", exact(sample.end.radiance));
        if (is_shown(inspection, sample)) object.add("ray", ray_json(*sample.ray));
        return object.text();
    };
    const Double3 value = {static_cast<double>(pixel.value[0]), static_cast<double>(pixel.value[1]),
                           static_cast<double>(pixel.value[2])};
    return Object()
               .add("wisp", quoted(version))
               .add("scene", quoted(inspection.scene))
               .add("arith", quoted(inspection.arithmetic))
               .add("frame", whole(inspection.frame))
               .add("x", whole(inspection.x))
               .add("y", whole(inspection.y))
               .add("width", whole(inspection.width))
               .add("height", whole(inspection.height))
               .add("samples", list(inspection.samples, sample_json))
               .add("mean", exact(pixel.mean))
               .add("value", exact(value))
               .text() +
           "\n";
}

} // namespace wisp
