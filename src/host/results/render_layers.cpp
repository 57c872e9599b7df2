#include "host/results/picture_bytes.h"
#include "host/results/render_layers.h"
#include <algorithm>

namespace wisp {

namespace {

bool has_error(const Settings &settings) { return settings.goal == Goal::reference; }

} // namespace

PictureLayers make_layers(const Settings &settings, const Plan &plan) {
    const std::vector<LayerNames> &all = layer_names();
    PictureLayers layers;
    for (uint32_t i = 0; i < layer_count; ++i)
        if (has_layer(plan.layers, static_cast<Layer>(i))) layers.names.push_back(all[i]);
    layers.names.push_back(all[samples_layer]);
    if (has_error(settings)) layers.names.push_back(all[error_layer]);
    layers.values.resize(layer_planes(settings, plan) * settings.crop.pixels());
    return layers;
}

void finish_layers(PictureLayers &layers, double scale, const Settings &settings, const Plan &plan,
                   const Passes &passes) {
    const size_t pixels = settings.crop.pixels();
    if (has_layer(plan.layers, Layer::depth)) {
        float *plane = layers.values.data() + planes_before(plan.layers, static_cast<uint32_t>(Layer::depth)) * pixels;
        for (size_t i = 0; i < pixels; ++i) plane[i] = static_cast<float>(plane[i] / scale);
    }
    float *const own = layers.values.data() + planes_of(plan.layers) * pixels;
    const uint64_t passed = has_error(settings) ? settings.last_pass - settings.first_pass : 1;
    std::fill(own, own + pixels, static_cast<float>(settings.samples * passed));
    if (!has_error(settings)) return;
    const Picture error = error_picture(passes);
    for (size_t i = 0; i < error.rgb.size(); ++i) own[(1 + i % 3) * pixels + i / 3] = error.rgb[i];
}

} // namespace wisp
