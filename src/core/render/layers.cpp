#include "core/render/layers.h"
#include "core/geometry/camera.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t index_of(Layer layer) { return static_cast<uint32_t>(layer); }
LayerRecorder &layers_of(PixelRecorder &recorder) { return static_cast<LayerRecorder &>(recorder); }
Color &light_of(LayerRecorder &of, Layer layer) { return of.sample_sums.light[index_of(layer)]; }

// Where the camera looks: at right angles to the picture, whose pixels may be too small for their squares in Fixed.
Vec3 axis_of(const View &view) {
    const auto scaled = [](const Vec3 &v) { return v / largest(absolute(v)); };
    const Vec3 axis = normalize(cross(scaled(view.right), scaled(view.down)));
    return dot(axis, view.corner) < Real(0) ? -axis : axis;
}

Real quotient_or_0(Real a, Real b) { return b > Real(0) ? a / b : Real(0); }

void sample(PixelRecorder &recorder, uint32_t, Real, Real) {
    LayerRecorder &of = layers_of(recorder);
    of.sample_sums = {};
    of.irradiance = of.unshadowed = Real(0);
}

void ray(PixelRecorder &recorder, RayKind, uint32_t level, const Ray &ray, Color factor, Real) {
    LayerRecorder &of = layers_of(recorder);
    of.level = level;
    const Color whole = level == 0 ? factor : of.levels[level - 1].behind * factor;
    of.levels[level] = {whole, whole, Color(Real(0))};
    if (level == 0) of.along = dot(ray.direction, of.axis);
}

// What arrives of a step is divided as its sources are.
void step(PixelRecorder &recorder, const StepRecord &step) {
    LayerRecorder &of = layers_of(recorder);
    const Color whole = step.single + step.multiple + step.emission, &arriving = step.radiance;
    const Color factor =
        of.levels[of.level].factor * Color(quotient_or_0(arriving.x, whole.x), quotient_or_0(arriving.y, whole.y),
                                           quotient_or_0(arriving.z, whole.z));
    light_of(of, Layer::single) += step.single * factor;
    light_of(of, Layer::multiple) += step.multiple * factor;
    light_of(of, Layer::emission) += step.emission * factor;
}

void march_end(PixelRecorder &recorder, Color radiance, Real, Real transmittance) {
    LayerRecorder &of = layers_of(recorder);
    LayerRecorder::Level &level = of.levels[of.level];
    level.marched = radiance;
    level.behind = level.factor * transmittance;
}

void hit(PixelRecorder &recorder, const HitRecord &hit) {
    LayerRecorder &of = layers_of(recorder);
    light_of(of, Layer::surfaces) += of.levels[of.level].behind * hit.ambient;
    if (of.level > 0) return;
    ++of.hits;
    of.shading_normal = hit.normal;
    of.sample_sums.depth = hit.distance * of.along;
    of.sample_sums.normal = hit.normal;
    of.sample_sums.albedo = of.materials[hit.material].diffuse * hit.texture_color;
}

void shadow_begin(PixelRecorder &, const Statistics &) {}
void shadow_end(PixelRecorder &recorder, uint32_t, const Statistics &, Real lit) { layers_of(recorder).lit = lit; }

void light(PixelRecorder &recorder, const LightRecord &light) {
    LayerRecorder &of = layers_of(recorder);
    if (light.step >= 0 || !light.faces || of.level > 0) return; // of a surface, of the camera ray
    const Real full = largest(light.from.irradiance) * dot(of.shading_normal, -light.from.direction);
    of.unshadowed += full;
    of.irradiance += full * (of.lit * light.transmittance);
}

void direct_light(PixelRecorder &recorder, Color radiance) {
    LayerRecorder &of = layers_of(recorder);
    const Color seen = of.levels[of.level].behind * radiance;
    light_of(of, Layer::surfaces) += seen;
    of.sample_sums.direct += seen;
}

void ray_end(PixelRecorder &recorder, const RayEndRecord &end) {
    LayerRecorder &of = layers_of(recorder);
    const LayerRecorder::Level &level = of.levels[of.level];
    light_of(of, Layer::multiple) += level.factor * (end.smoke - level.marched); // by random paths, beside the march
    if (!end.hit) light_of(of, Layer::background) += level.behind * end.behind;
    of.node_visits += end.node_visits;
    if (of.level == 0)
        of.sample_sums.alpha = end.hit ? Real(1) : Real(1) - end.transmittance;
    else
        --of.level;
}

void sample_end(PixelRecorder &recorder, uint32_t, Color) {
    LayerRecorder &of = layers_of(recorder);
    LayerRecorder::Sums &sum = of.pixel_sums, &more = of.sample_sums;
    if (of.unshadowed > Real(0)) more.shadow = Real(1) - of.irradiance / of.unshadowed;
    for (uint32_t i = 0; i < summed_layers; ++i) sum.light[i] += more.light[i];
    sum.direct += more.direct;
    sum.albedo += more.albedo;
    sum.normal += more.normal;
    sum.depth += more.depth;
    sum.alpha += more.alpha;
    sum.shadow += more.shadow;
}

// A float as a whole number of its unit in the last place, 2^exponent.
struct Units {
    bool finite;
    int32_t count, exponent;
};
Units units_of(float value) {
    using Format = detail::FloatFormat<float>;
    const uint32_t bits = detail::to_bits(value);
    const auto field = static_cast<int32_t>(bits >> Format::fraction_bits & 255);
    const auto fraction = static_cast<int32_t>(bits & ((1u << Format::fraction_bits) - 1));
    const int32_t hidden = field > 0 ? 1 << Format::fraction_bits : 0, count = fraction + hidden;
    return {field < 255, bits >> 31 ? -count : count, max(field, 1) - Format::bias - Format::fraction_bits};
}
float value_of(int32_t count, int32_t exponent) {
    return detail::nearest_float<float>(count < 0, static_cast<uint64_t>(count < 0 ? -count : count), exponent);
}

// Writes the layers that add up to `value`, one channel (wisp/layers.h): in units of its last place, and the largest
// with what is left over. `mean`: the channel in the arithmetic, with the scene's exponent.
void write_parts(const LayerRecorder &of, uint64_t channel, const Real (&parts)[summed_layers], Real mean,
                 float value) {
    const Units whole = units_of(value);
    int32_t counts[summed_layers] = {}, rest = whole.count;
    uint32_t largest = summed_layers;
    for (uint32_t i = 0; i < summed_layers; ++i) {
        if (!of.plane[i]) continue;
        if (whole.finite && whole.count > 0)
            counts[i] =
                round_to_int(scale_pow2(max(Real(0), min(parts[i], mean)), of.radiance_exponent - whole.exponent));
        rest -= counts[i];
        if (largest == summed_layers || counts[i] > counts[largest]) largest = i;
    }
    for (uint32_t i = 0; i < summed_layers; ++i)
        if (of.plane[i])
            of.plane[i][channel * of.plane_size] = i != largest   ? value_of(counts[i], whole.exponent)
                                                   : whole.finite ? value_of(counts[i] + rest, whole.exponent)
                                                                  : value;
}

void pixel(PixelRecorder &recorder, uint32_t samples, Color mean, const float *value) {
    LayerRecorder &of = layers_of(recorder);
    const Real count = Real(static_cast<int32_t>(samples));
    const LayerRecorder::Sums &sum = of.pixel_sums;
    for (int c = 0; c < 3; ++c) {
        Real parts[summed_layers];
        for (uint32_t i = 0; i < summed_layers; ++i) parts[i] = sum.light[i][c] / count;
        write_parts(of, static_cast<uint64_t>(c), parts, mean[c], value[c]);
    }
    const auto write = [&of](Layer layer, uint64_t channel, float written) {
        if (float *plane = of.plane[index_of(layer)]) plane[channel * of.plane_size] = written;
    };
    for (int c = 0; c < 3; ++c) {
        const auto channel = static_cast<uint64_t>(c);
        write(Layer::direct, channel, to_float_scaled(sum.direct[c] / count, of.radiance_exponent));
        write(Layer::albedo, channel, to_float(sum.albedo[c] / count));
        write(Layer::normal, channel, to_float(sum.normal[c] / count));
    }
    write(Layer::depth, 0, of.hits > 0 ? to_float(sum.depth / Real(of.hits)) : __builtin_inff());
    write(Layer::alpha, 0, to_float(sum.alpha / count));
    write(Layer::shadow, 0, to_float(sum.shadow / count));
    write(Layer::node_visits, 0, detail::nearest_float<float>(false, of.node_visits, 0));
    for (float *&plane : of.plane)
        if (plane) ++plane;
    of.pixel_sums = {};
    of.hits = 0;
    of.node_visits = 0;
}

// What no layer asks for.
void unsent(PixelRecorder &, RayKind, Color, Real, bool) {}
void march(PixelRecorder &, Real, Real, Real, int32_t) {}
void lane_lights(PixelRecorder &) {}

} // namespace

uint64_t layer_bytes(uint32_t depth) {
    return Arena::bytes<LayerRecorder>(1) + Arena::bytes<LayerRecorder::Level>(uint64_t{depth} + 1);
}

LayerRecorder *make_layer_recorder(const Scene &scene, uint32_t there, const SurfaceMaterial *materials, uint32_t depth,
                                   float *planes, uint64_t plane_size, Arena &arena) {
    LayerRecorder *made = arena.make<LayerRecorder>(1);
    LayerRecorder::Level *levels = arena.make<LayerRecorder::Level>(size_t{depth} + 1);
    if (!made || !levels) return nullptr;
    LayerRecorder &of = *made;
    of = {};
    of.every_pixel = true;
    of.sample = sample;
    of.sample_end = sample_end;
    of.pixel = pixel;
    of.ray = ray;
    of.ray_end = ray_end;
    of.unsent = unsent;
    of.hit = hit;
    of.direct_light = direct_light;
    of.march = march;
    of.march_end = march_end;
    of.step = step;
    of.light = light;
    of.shadow_begin = shadow_begin;
    of.shadow_end = shadow_end;
    of.lanes_begin = begin_lanes;
    of.lane_lights = lane_lights;
    of.lane_sources = add_lane_sources;
    of.lane_steps = end_lanes;
    of.materials = materials;
    of.axis = axis_of(View(scene.camera));
    of.radiance_exponent = scene.radiance_exponent;
    of.plane_size = plane_size;
    of.levels = levels;
    for (uint32_t i = 0; i < layer_count; ++i)
        if (has_layer(there, static_cast<Layer>(i))) of.plane[i] = planes + planes_before(there, i) * plane_size;
    return made;
}

} // namespace wisp::WISP_ARITH
