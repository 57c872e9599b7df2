#include "host/results/render_layers.h"
#include <algorithm>

namespace wisp {

namespace {

size_t pixels_of(const Settings &settings) {
    return static_cast<size_t>(settings.crop.width()) * static_cast<size_t>(settings.crop.height());
}
bool has_error(const Settings &settings) { return settings.goal == Goal::reference; }

} // namespace

uint32_t layer_planes(const Settings &settings, const Plan &plan) {
    return settings.layers ? plan.layer_planes + 1 + (has_error(settings) ? 3 : 0) : 0;
}

PictureLayers make_layers(const Settings &settings, const Plan &plan) {
    const std::vector<LayerNames> &all = layer_names();
    PictureLayers layers;
    for (size_t i = 0; i < layer_count; ++i)
        if (plan.layers[i]) layers.names.push_back(all[i]);
    layers.names.push_back(all[samples_layer]);
    if (has_error(settings)) layers.names.push_back(all[error_layer]);
    layers.values.resize(layer_planes(settings, plan) * pixels_of(settings));
    return layers;
}

void finish_layers(PictureLayers &layers, double scale, const Settings &settings, const Plan &plan,
                   const Passes &passes) {
    const size_t pixels = pixels_of(settings);
    const auto depth = static_cast<size_t>(Layer::depth);
    if (plan.layers[depth]) {
        size_t before = 0;
        for (size_t i = 0; i < depth; ++i) before += plan.layers[i] ? channels_of(static_cast<Layer>(i)) : 0;
        float *plane = layers.values.data() + before * pixels;
        for (size_t i = 0; i < pixels; ++i) plane[i] = static_cast<float>(plane[i] / scale);
    }
    float *const own = layers.values.data() + plan.layer_planes * pixels;
    const uint64_t passed = has_error(settings) ? settings.last_pass - settings.first_pass : 1;
    std::fill(own, own + pixels, static_cast<float>(settings.samples * passed));
    if (!has_error(settings)) return;
    const Picture error = error_picture(passes);
    for (size_t i = 0; i < error.rgb.size(); ++i) own[(1 + i % 3) * pixels + i / 3] = error.rgb[i];
}

} // namespace wisp
