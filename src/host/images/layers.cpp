#include "host/images/layers.h"

namespace wisp {

namespace {

LayerNames color(const std::string &word) { return {word, {word + ".R", word + ".G", word + ".B"}}; }

} // namespace

// Z, A, N.X ... are the names that other programs know.
const std::vector<LayerNames> &layer_names() {
    static const std::vector<LayerNames> names = {
        color("emission"),        color("single"),  color("multiple"),      color("surfaces"),
        color("background"),      color("direct"),  color("albedo"),        {"normal", {"N.X", "N.Y", "N.Z"}},
        {"depth", {"Z"}},         {"alpha", {"A"}}, {"shadow", {"shadow"}}, {"visits", {"visits"}},
        {"samples", {"samples"}}, color("error")};
    return names;
}

std::string layer_path(const std::string &pfm, const std::string &word) {
    return pfm.substr(0, pfm.rfind('.')) + "." + word + ".pfm";
}

} // namespace wisp
