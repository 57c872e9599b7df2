#include "host/images/layers.h"
#include "host/images/layer_words.h"

namespace wisp {

namespace {

LayerNames color(const std::string &word) { return {word, {word + ".R", word + ".G", word + ".B"}}; }

} // namespace

// Z, A, N.X ... are the names that other programs know.
const std::vector<LayerNames> &layer_names() {
    static const std::vector<LayerNames> names = [] {
        std::vector<LayerNames> made;
        for (uint32_t i = 0; i < layer_count; ++i) made.push_back(color(layer_words[i]));
        const auto name = [&made](Layer layer, const std::vector<std::string> &channels) {
            made[static_cast<uint32_t>(layer)].channels = channels;
        };
        name(Layer::normal, {"N.X", "N.Y", "N.Z"});
        name(Layer::depth, {"Z"});
        name(Layer::alpha, {"A"});
        name(Layer::shadow, {"shadow"});
        name(Layer::node_visits, {"visits"});
        made.push_back({"samples", {"samples"}});
        made.push_back(color("error"));
        return made;
    }();
    return names;
}

std::string layer_path(const std::string &pfm, const std::string &word) {
    return pfm.substr(0, pfm.rfind('.')) + "." + word + ".pfm";
}

} // namespace wisp
