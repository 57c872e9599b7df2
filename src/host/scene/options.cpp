#include "host/base/error.h"
#include "host/scene/options.h"
#include "wisp/settings.h"
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <functional>

namespace wisp {

namespace {

struct OptionError {
    std::string text; // what was expected
};

int64_t integer_in(const std::string &value, int64_t low, int64_t high) {
    const auto number = to_integer(value);
    if (!number || *number < low || *number > high)
        throw OptionError{"expected a whole number from " + std::to_string(low) + " to " + std::to_string(high)};
    return *number;
}

double positive(const std::string &value, double high) {
    const auto number = to_number(value);
    if (!number || !(*number > 0) || *number > high)
        throw OptionError{"expected a number above 0, at most " + std::to_string(high)};
    return *number;
}

// The distance of a kept field's points, in smoothing lengths; 0, where it may be: nothing is kept.
double step_of(const std::string &value, bool may_be_zero) {
    const auto number = to_number(value);
    if (may_be_zero && number == 0.0) return 0;
    if (!number || !(*number >= 0.01 && *number <= 1000))
        throw OptionError{std::string(may_be_zero ? "expected 0, or a number" : "expected a number") + " from 0.01 to 1000"};
    return *number;
}

std::vector<std::string> split(const std::string &text, char separator) {
    std::vector<std::string> parts(1);
    for (char c : text)
        if (c == separator)
            parts.emplace_back();
        else
            parts.back() += c;
    return parts;
}

// One of several words; of those only the first `supported` are built yet.
size_t one_of(const std::string &value, const std::vector<std::string> &words, size_t supported) {
    std::string expected;
    for (size_t i = 0; i < words.size(); ++i) {
        if (value == words[i] && i < supported) return i;
        if (value == words[i]) throw OptionError{"this version does not support it yet"};
        if (i < supported) expected += (i ? ", " : "") + words[i];
    }
    throw OptionError{"expected " + expected};
}

void set_output(Options &options, const std::string &value) {
    if (!ends_in(value, ".png") && !ends_in(value, ".pfm") && !ends_in(value, ".passes") && !ends_in(value, ".map"))
        throw OptionError{"expected a file name that ends in .png, .pfm, .passes or .map"};
    options.outputs.push_back(value);
}

Options::Range range_of(const std::string &value) {
    const auto parts = split(value, ':');
    if (parts.size() != 2) throw OptionError{"expected A:B"};
    Options::Range range;
    range.first = static_cast<uint32_t>(integer_in(parts[0], 0, INT32_MAX - 1));
    range.last = static_cast<uint32_t>(integer_in(parts[1], range.first + int64_t{1}, INT32_MAX));
    return range;
}

void set_size(Options &options, const std::string &value) {
    const auto parts = split(value, 'x');
    if (parts.size() != 2) throw OptionError{"expected WIDTHxHEIGHT"};
    options.width = static_cast<int>(integer_in(parts[0], 1, 65536));
    options.height = static_cast<int>(integer_in(parts[1], 1, 65536));
}

void set_frames(Options &options, const std::string &value) {
    const auto parts = split(value, ':');
    if (parts.size() > 3) throw OptionError{"expected A, A:B or A:B:STEP"};
    const int64_t first = integer_in(parts[0], 0, 1000000000);
    const int64_t last = parts.size() > 1 ? integer_in(parts[1], first, 1000000000) : first;
    const int64_t step = parts.size() > 2 ? integer_in(parts[2], 1, 1000000000) : 1;
    options.frames = Options::Frames{first, last, step};
}

void set_crop(Options &options, const std::string &value) {
    const auto parts = split(value, ',');
    if (parts.size() != 4) throw OptionError{"expected X0,Y0,X1,Y1"};
    int at[4];
    for (size_t i = 0; i < 4; ++i) at[i] = static_cast<int>(integer_in(parts[i], 0, 65536));
    if (at[0] >= at[2] || at[1] >= at[3]) throw OptionError{"expected X0 < X1 and Y0 < Y1"};
    options.crop = Options::Pixels{at[0], at[1], at[2], at[3]};
}

void set_memory(Options &options, const std::string &value) {
    static const std::string units = "kMG";
    std::string digits = value;
    int shift = 0;
    if (!value.empty() && units.find(value.back()) != std::string::npos) {
        shift = 10 * static_cast<int>(units.find(value.back()) + 1);
        digits.pop_back();
    }
    const auto number = to_integer(digits);
    if (!number || *number < 1 || *number > INT64_MAX >> shift) throw OptionError{"expected bytes, with k, M or G behind"};
    options.memory = static_cast<uint64_t>(*number) << shift;
}

struct Entry {
    const char *name;
    const char *value; // what help shows for it; nullptr for a switch
    const char *help;
    std::function<void(Options &, const std::string &)> set; // empty: in the contract, not built yet
};

const std::vector<Entry> &table() {
    static const std::vector<Entry> entries = {
        {"output", "FILE", ".png (8-bit sRGB), .pfm (linear float), .passes, .map; repeatable; %04d = frame number",
         set_output},
        {"arith", "f32|f64|fixed", "number system (f32)",
         [](Options &o, const std::string &v) {
             o.arithmetic = static_cast<Arithmetic>(one_of(v, {"f32", "f64", "fixed"}, 3));
         }},
        {"size", "WxH", "pixels (the scene's resolution)", set_size},
        {"spp", "N", "rays a pixel (4)",
         [](Options &o, const std::string &v) { o.samples = static_cast<uint32_t>(integer_in(v, 1, 65536)); }},
        {"seed", "N", "of the photons (1)",
         [](Options &o, const std::string &v) { o.seed = static_cast<uint64_t>(integer_in(v, 0, INT64_MAX)); }},
        {"smoke", "direct|map|volume",
         "photon map; particle map; photon map of resampled smoke (map, direct where smoke cannot be)",
         [](Options &o, const std::string &v) {
             o.method = static_cast<Method>(one_of(v, {"direct", "map", "volume"}, 3));
         }},
        {"irradiance", "none|uniform|adaptive",
         "multiple scattering at points of bricks, as many in each or as needed (uniform)",
         [](Options &o, const std::string &v) {
             o.irradiance = static_cast<IrradianceMap>(one_of(v, {"none", "uniform", "adaptive"}, 3));
         }},
        {"irradiance-step", "S", "distance of those points at most, in smoothing lengths (two cells)",
         [](Options &o, const std::string &v) { o.irradiance_step = step_of(v, false); }},
        {"density-step", "S", "cells of resampled smoke, in smoothing lengths; 0: exact (0.22 to 0.55, direct 0)",
         [](Options &o, const std::string &v) { o.density_step = step_of(v, true); }},
        {"estimate", "knn|kernel",
         "radiance from the nearest photons or particles (direct), or of the particles' kernels (map)",
         [](Options &o, const std::string &v) {
             o.estimate = static_cast<Estimate>(one_of(v, {"kernel", "knn"}, 2));
         }},
        {"deposit", "exact|path|kernel",
         "of a photon on particles: that of the collision, all of its flight, or all around",
         [](Options &o, const std::string &v) {
             o.deposit = static_cast<Deposit>(one_of(v, {"exact", "path", "kernel"}, 3));
         }},
        {"direction", "flux|mean", "what is kept of the photons' directions: their flux, or their mean (flux)",
         [](Options &o, const std::string &v) {
             o.direction = static_cast<Direction>(one_of(v, {"flux", "mean"}, 2));
         }},
        {"photons", "N", "photons emitted (1000000)",
         [](Options &o, const std::string &v) { o.photons = static_cast<uint64_t>(integer_in(v, 0, INT64_MAX)); }},
        {"gather", "K", "most photons or particles in an estimate by knn (500)",
         [](Options &o, const std::string &v) { o.gather = static_cast<uint32_t>(integer_in(v, 2, 1000000)); }},
        {"gather-radius", "R", "largest radius of an estimate, in smoothing lengths (2)",
         [](Options &o, const std::string &v) { o.gather_radius = positive(v, 1000); }},
        {"step", "S", "marching step, in smoothing lengths (0.5; map of resampled smoke two cells)",
         [](Options &o, const std::string &v) {
             o.step = positive(v, 1000);
             if (*o.step < 1e-4) throw OptionError{"expected a number of at least 0.0001"};
         }},
        {"reference", nullptr, "unbiased path tracing instead: slow, for measuring error",
         [](Options &o, const std::string &) { o.reference = true; }},
        {"passes", "A:B", "of --reference, half-open (0:16): so many times --spp rays a pixel",
         [](Options &o, const std::string &v) { o.passes = range_of(v); }},
        {"error-out", "FILE", "of --reference: the standard error of each value, as .pfm",
         [](Options &o, const std::string &v) {
             if (!ends_in(v, ".pfm")) throw OptionError{"expected a file name that ends in .pfm"};
             o.error_out = v;
         }},
        {"map-out", "FILE", "of --smoke map: saves the particle map",
         [](Options &o, const std::string &v) { o.map_out = v; }},
        {"map-in", "FILE", "a saved particle map, for other views without tracing again",
         [](Options &o, const std::string &v) { o.map_in = v; }},
        {"batches", "A:B", "with --map-out: traces only these of the batches of 4096 photons, half-open; no picture",
         [](Options &o, const std::string &v) { o.batches = range_of(v); }},
        {"remap", nullptr, "traces the particle map anew for every frame",
         [](Options &o, const std::string &) { o.remap = true; }},
        {"light-step", "S",
         "of points whose depth to the lights is kept; 0: exact, of resampled smoke every node (a cell, else 0)",
         [](Options &o, const std::string &v) { o.light_step = step_of(v, true); }},
        {"thin", "EPS",
         "render without the particles that take no more than this off any ray's opacity; 0: with all (0)",
         [](Options &o, const std::string &v) {
             const auto number = to_number(v);
             if (!number || !(*number >= 0 && *number <= 0.99)) throw OptionError{"expected a number from 0 to 0.99"};
             o.decimate = *number;
         }},
        {"exposure", "EV", "of .png, in stops (0)",
         [](Options &o, const std::string &v) {
             const auto number = to_number(v);
             if (!number || !(std::fabs(*number) <= 100)) throw OptionError{"expected a number from -100 to 100"};
             o.exposure = *number;
         }},
        {"frames", "A[:B[:STEP]]", "frames A to B, both included (all of the scene's animation)", set_frames},
        {"crop", "X0,Y0,X1,Y1", "pixels, half-open, from the top left", set_crop},
        {"memory", "BYTES", "a ceiling (k/M/G): a plan or a picture that does not fit is refused", set_memory},
        {"stats", "FILE", "counters, seconds and bytes as JSON", [](Options &o, const std::string &v) { o.stats = v; }},
        {"digest", nullptr, "print the SHA-256 of each frame's .pfm",
         [](Options &o, const std::string &) { o.digest = true; }},
        {"progress", "auto|always|never", "on standard error (auto: on a terminal)",
         [](Options &o, const std::string &v) {
             o.progress = static_cast<Options::Progress>(one_of(v, {"auto", "always", "never"}, 3));
         }},
        {"quiet", nullptr, "no word but errors", [](Options &o, const std::string &) { o.quiet = true; }},
        {"verbose", nullptr, "say more", [](Options &o, const std::string &) { o.verbose = true; }},
        {"lights", "all|cuts",
         "which lights a point of a surface asks: all; clusters of them, split where they may err by 2 % (all)",
         [](Options &o, const std::string &v) {
             o.lights = static_cast<LightChoice>(one_of(v, {"all", "cuts"}, 2));
         }},
        {"depth", "N", "longest chain of reflected and refracted rays behind a camera ray (10)",
         [](Options &o, const std::string &v) { o.depth = static_cast<uint32_t>(integer_in(v, 0, 64)); }},
        {"shadows", "trace|cache|paper|exact|voxel|lightbuffer|lie",
         "how shadows of surfaces are found: by rays; the last occluder first; by what was met before; without rays "
         "where proved, of cells, of voxels; by lists of what a light sees, of what may be in the way (exact)",
         [](Options &o, const std::string &v) {
             o.shadows = static_cast<ShadowMethod>(
                 one_of(v, {"trace", "cache", "paper", "exact", "voxel", "lightbuffer", "lie"}, 7));
         }},
        {"frame-count", "N", "divide the animation's time into N frames instead of the scene's own number",
         [](Options &o, const std::string &v) { o.frame_count = integer_in(v, 1, 1000000000); }},
    };
    return entries;
}

const Entry *find(const std::string &name) {
    for (const Entry &entry : table())
        if (name == entry.name) return &entry;
    return nullptr;
}

} // namespace

bool ends_in(const std::string &text, const std::string &suffix) {
    return text.size() > suffix.size() && text.compare(text.size() - suffix.size(), suffix.size(), suffix) == 0;
}

std::optional<double> to_number(std::string_view text) {
    double number = 0;
    const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
    const char *begin = text.data() + (plus ? 1 : 0), *last = text.data() + text.size();
    const auto [end, error] = std::from_chars(begin, last, number);
    if (error != std::errc() || end != last || !std::isfinite(number)) return std::nullopt;
    return number;
}

std::optional<int64_t> to_integer(std::string_view text) {
    int64_t number = 0;
    const char *last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, number);
    if (error != std::errc() || end != last) return std::nullopt;
    return number;
}

void set_option(Options &options, const std::string &name, const std::string &value, const std::string &where) {
    const Entry *entry = find(name);
    if (!entry) throw Error(exit_usage, where + "there is no option '" + name + "'; 'wisp help' lists them");
    if (!entry->set) throw Error(exit_usage, where + "option '" + name + "' is not supported yet by this version");
    if (!entry->value && value != "1")
        throw Error(exit_usage, where + "option '" + name + "': found '" + value + "', expected 1");
    try {
        entry->set(options, value);
    } catch (const OptionError &fault) {
        throw Error(exit_usage, where + "option '" + name + "': found '" + value + "', " + fault.text);
    }
}

CommandLine parse_arguments(const std::vector<std::string> &arguments) {
    CommandLine line;
    for (size_t i = 0; i < arguments.size(); ++i) {
        std::string name = arguments[i];
        if (name.size() < 2 || name[0] != '-') {
            line.files.push_back(name);
            continue;
        }
        if (name == "-o" || name.compare(0, 3, "-o=") == 0) name.replace(0, 2, "--output");
        if (name == "-q") name = "--quiet";
        if (name == "-v") name = "--verbose";
        if (name.compare(0, 2, "--") != 0)
            throw Error(exit_usage, "there is no option '" + name + "'; 'wisp help' lists them");
        name.erase(0, 2);
        const size_t equals = name.find('=');
        const std::string key = name.substr(0, equals);
        const Entry *entry = find(key);
        if (!entry) throw Error(exit_usage, "there is no option '--" + key + "'; 'wisp help' lists them");
        std::string value = "1"; // of a switch
        if (!entry->value) {
            if (equals != std::string::npos) throw Error(exit_usage, "option '--" + key + "' takes no value");
        } else if (equals != std::string::npos) {
            value = name.substr(equals + 1);
        } else if (++i < arguments.size()) {
            value = arguments[i];
        } else {
            throw Error(exit_usage, "option '--" + key + "' needs a value: " + entry->value);
        }
        line.options.emplace_back(key, value);
    }
    return line;
}

std::string help_text() {
    std::string text = "wisp render SCENE [options]     pictures, one per frame\n"
                       "wisp plan SCENE [options]       the stages that this scene needs, and the bytes of each\n"
                       "wisp inspect SCENE X Y [options] a pixel explained: its rays, hits, shadows, smoke and sums\n"
                       "wisp compare A B [options]      how two .pfm pictures differ; exit 1 when they do\n"
                       "wisp merge A B [...] -o FILE    the picture of several .passes together, or .map as one .map\n"
                       "wisp stitch A B [...] -o FILE   the picture of parts rendered with --crop, as .pfm\n"
                       "wisp help | version\n\n"
                       "Options, written --x V or --x=V; -o is --output, -q --quiet, -v --verbose:\n";
    for (const Entry &entry : table()) {
        if (!entry.set) continue;
        std::string left = std::string("  --") + entry.name + (entry.value ? std::string(" ") + entry.value : "");
        if (left.size() < 30) left.resize(30, ' ');
        text += left + " " + entry.help + "\n";
    }
    text +=
        "\nOptions of inspect: those of render but files, --reference and --shadows paper; --sample I tells the rays "
        "of\n"
        "that sample alone, --json writes JSON; with --crop what is before the pixel in the crop is rendered first, "
        "so\n"
        "that shadows are decided by what was learnt there, else the pixel alone\n"
        "Options of compare: --tolerance REL allows that relative RMSE, --error FILE.pfm are B's standard errors,\n"
        "--json FILE, --diff FILE.png\n"
        "Exit: 0 done, 1 pictures differ, 2 wrong usage, 3 bad input, 4 does not fit in memory, 5 could not write,\n"
        "128 + N stopped by signal N; frames that are there already as they would be made are kept\n";
    return text;
}

namespace {

// Where `%d` or `%04d` stands in a pattern: begin, end, and the digits wanted.
bool find_number(const std::string &pattern, size_t &begin, size_t &end, size_t &digits) {
    for (begin = pattern.find('%'); begin != std::string::npos; begin = pattern.find('%', begin + 1)) {
        end = begin + 1;
        while (end < pattern.size() && pattern[end] >= '0' && pattern[end] <= '9') ++end;
        if (end >= pattern.size() || pattern[end] != 'd' || end - begin > 3) continue;
        digits = end > begin + 1 ? static_cast<size_t>(std::atoi(pattern.c_str() + begin + 1)) : 0;
        ++end;
        return true;
    }
    return false;
}

} // namespace

std::string numbered(const std::string &pattern, int64_t number) {
    size_t begin, end, digits;
    if (!find_number(pattern, begin, end, digits)) return pattern;
    std::string text = std::to_string(number < 0 ? -number : number);
    if (text.size() < digits) text.insert(0, digits - text.size(), '0');
    return pattern.substr(0, begin) + (number < 0 ? "-" : "") + text + pattern.substr(end);
}

bool has_number(const std::string &pattern) {
    size_t begin, end, digits;
    return find_number(pattern, begin, end, digits);
}

} // namespace wisp
