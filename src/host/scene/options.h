// How a scene is to be rendered: the options of `wisp render`, `plan` and `inspect`, which the scene's `render KEY
// VALUE` statements set as well.
#pragma once
#include "host/base/option_table.h"
#include "host/base/renderers.h"
#include "wisp/scene.h"
#include "wisp/settings.h"
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace wisp {

// What is not given is left to the scene, or to choose_defaults() (commands/defaults.h). Lengths called steps and radii
// are in units of the smoothing length.
struct Options {
    struct Frames { // first, first + step, ... up to last
        int64_t first = 0, last = 0, step = 1;
        int64_t count() const { return (last - first) / step + 1; }
    };
    struct Range { // half-open
        uint32_t first, last;
    };
    struct Pixels { // half-open
        int x0, y0, x1, y1;
    };

    std::vector<std::string> outputs; // .png, .pfm, .exr, .passes or .map; `%04d` = frame number
    Arithmetic arithmetic = Arithmetic::f32;
    std::optional<int> width, height;
    uint32_t samples = 4; // rays per pixel, or per pixel and pass
    uint64_t seed = 1;
    uint64_t photons = 1000000;
    std::optional<double> max_error; // of the picture, relative to its mean
    uint32_t gather = 500;           // most neighbours in an estimate
    double gather_radius = 2;
    std::optional<double> step; // of the march
    double exposure = 0;        // of .png, in stops
    double decimate = 0;        // the most opacity that a ray may lose with the particles that are left out
    std::optional<Frames> frames;
    std::optional<int64_t> frame_count;
    uint32_t depth = 10; // longest chain of reflected and refracted rays
    std::optional<ShadowMethod> shadows;
    LightChoice lights = LightChoice::all;
    TreeKind tree = TreeKind::bvh;
    std::optional<Method> method;
    std::optional<Estimate> estimate;
    std::optional<Deposit> deposit;
    Direction direction = Direction::flux;
    std::optional<double> density_step; // 0: the density is not resampled
    std::optional<IrradianceMap> irradiance;
    std::optional<double> irradiance_step;
    std::optional<double> light_step; // 0: no optical depths to the lights are kept
    bool layers = false;
    bool reference = false;
    std::optional<Range> passes;
    std::string error_out, map_out, map_in; // files; empty: none
    std::optional<Range> batches;
    bool remap = false;
    std::optional<Pixels> crop;
    std::optional<uint64_t> memory; // bytes
    std::string stats;              // file; empty: none
    bool digest = false;
    enum class Progress { automatic, always, never } progress = Progress::automatic;
    bool quiet = false, verbose = false;
    // Of a file of smoke by itself: the scene that is chosen for it, and the file that it is written to.
    enum class Up { y, z } up = Up::y;
    bool ground = true;
    std::string write_scene, grid;
};

// The table of them.
const OptionTable<Options> &scene_options();

// Sets one of them, as set_option() of option_table.h does.
void set_option(Options &options, const std::string &name, const std::string &value, const std::string &where = "");

} // namespace wisp
