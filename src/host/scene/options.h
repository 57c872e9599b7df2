// Every long option of `wisp render` and `wisp plan` in one table: the command line and the scene's `render KEY VALUE`
// statements both go through it.
#pragma once
#include "wisp/scene.h"
#include "wisp/settings.h"
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace wisp {

enum class Arithmetic { f32, f64, fixed };

struct Options {
    std::vector<std::string> outputs; // .png, .pfm, .passes or .map, `%04d` = frame
    Arithmetic arithmetic = Arithmetic::f32;
    std::optional<int> width, height; // else the scene's resolution
    uint32_t samples = 4;
    uint64_t seed = 1;
    uint64_t photons = 1000000;
    uint32_t gather = 500;
    double gather_radius = 2;   // in units of the smoothing length
    std::optional<double> step; // the same; what is not given follows from the rest
    double exposure = 0;        // of .png, in stops
    double decimate = 0;            // the most opacity that a ray may lose with particles that are left out
    struct Frames {
        int64_t first = 0, last = 0, step = 1;
    };
    std::optional<Frames> frames;       // all
    std::optional<int64_t> frame_count; // that of the scene
    uint32_t depth = 10;
    ShadowMethod shadows = ShadowMethod::exact;
    LightChoice lights = LightChoice::all;
    std::optional<Method> method;
    std::optional<Estimate> estimate;
    std::optional<Deposit> deposit;
    Direction direction = Direction::flux;
    std::optional<double> density_step; // cells of resampled smoke, in units of the smoothing length; 0: exact
    std::optional<IrradianceMap> irradiance;
    std::optional<double> irradiance_step;
    std::optional<double> light_step; // distance of kept depths to the lights, in units of the smoothing length
    bool reference = false;
    struct Range {
        uint32_t first, last; // half-open
    };
    std::optional<Range> passes;
    std::string error_out;       // file, empty for none
    std::string map_out, map_in; // the same
    std::optional<Range> batches;
    bool remap = false;
    struct Pixels {
        int x0, y0, x1, y1;
    };
    std::optional<Pixels> crop;
    std::optional<uint64_t> memory; // bytes
    std::string stats;              // file, empty for none
    bool digest = false;
    enum class Progress { automatic, always, never } progress = Progress::automatic;
    bool quiet = false, verbose = false;
};

// Sets the option `name` (without dashes). Throws Error(exit_usage) with `where` in front when there is no such
// option, when it is not supported yet, or when the value is not what it expects.
void set_option(Options &options, const std::string &name, const std::string &value, const std::string &where);

// `arguments` behind the command's name: the scene file, and options written `--x V` or `--x=V`. The options are
// returned as (name, value) pairs, so that those of the scene can be set first.
struct CommandLine {
    std::vector<std::string> files;
    std::vector<std::pair<std::string, std::string>> options;
};
CommandLine parse_arguments(const std::vector<std::string> &arguments);

// The text of `wisp help`.
std::string help_text();

// Whether a file name is of this kind, `.png` for instance, and more than the kind.
bool ends_in(const std::string &text, const std::string &suffix);

// Text to number, whole and finite; empty when it is not one.
std::optional<double> to_number(std::string_view text);
std::optional<int64_t> to_integer(std::string_view text);

// The number in place of `%04d` or `%d`; the name itself where there is none.
std::string numbered(const std::string &pattern, int64_t number);
bool has_number(const std::string &pattern);

} // namespace wisp
