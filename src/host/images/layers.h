// Layers of a picture (wisp/layers.h) on their way into files: their names there, and planes of floats.
#pragma once
#include "host/images/picture.h"
#include "wisp/layers.h"

namespace wisp {

struct LayerNames {
    std::string word;                  // of the file beside a .pfm
    std::vector<std::string> channels; // in an .exr
};

// Those of the core's layers, in the order of Layer, and behind them the ones that the host adds.
const std::vector<LayerNames> &layer_names();
constexpr size_t samples_layer = layer_count, error_layer = layer_count + 1;

struct PictureLayers {
    std::vector<LayerNames> names; // of those that there are
    std::vector<float> values;     // their planes, layer by layer, channel by channel: rows from the top
};

// FILE.WORD.pfm, beside FILE.pfm.
std::string layer_path(const std::string &pfm, const std::string &word);

// Calls visit(names, first plane of the layer) for each layer of a picture.
template <class Visit> void for_each_layer(const Picture &picture, const PictureLayers &layers, Visit &&visit) {
    const float *plane = layers.values.data();
    for (const LayerNames &names : layers.names) {
        visit(names, plane);
        plane += names.channels.size() * (picture.rgb.size() / 3);
    }
}

} // namespace wisp
