#include "host/base/option_table.h"
#include "host/scene/options.h"
#include "host/scene/shadow_words.h"
#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

// The spacing of samples that are kept, in smoothing lengths; 0, where it is allowed: none are kept.
auto to_spacing(std::optional<double> Options::*member, bool may_be_zero) {
    return [=](Options &options, const std::string &value) {
        options.*member = number_that(
                              value, [=](double x) { return (may_be_zero && x == 0) || (x >= 0.01 && x <= 1000); },
                              std::string(may_be_zero ? "0, or a number" : "a number") + " from 0.01 to 1000") +
                          0.0; // -0 is 0
    };
}

// A half-open range, of what is counted from 0.
auto to_range(std::optional<Options::Range> Options::*member) {
    return [=](Options &options, const std::string &value) {
        const auto parts = split(value, ':');
        if (parts.size() != 2) throw OptionError{"A:B"};
        const int64_t first = count_in(parts[0], 0, INT32_MAX - 1);
        const int64_t last = count_in(parts[1], 1, INT32_MAX);
        if (!(first < last)) throw OptionError{"A:B with A < B"};
        options.*member = Options::Range{static_cast<uint32_t>(first), static_cast<uint32_t>(last)};
    };
}

void set_output(Options &options, const std::string &value) {
    if (value == "-") return options.outputs.push_back("-.pfm");
    const std::string kinds[] = {".png", ".pfm", ".exr", ".passes", ".map"};
    if (std::none_of(std::begin(kinds), std::end(kinds), [&](const std::string &kind) { return ends_in(value, kind); }))
        throw OptionError{"a file name that ends in .png, .pfm, .exr, .passes or .map, or -"};
    options.outputs.push_back(value);
}

void set_size(Options &options, const std::string &value) {
    const auto parts = split(value, 'x');
    if (parts.size() != 2) throw OptionError{"WIDTHxHEIGHT"};
    options.width = static_cast<int>(integer_in(parts[0], 1, 65536));
    options.height = static_cast<int>(integer_in(parts[1], 1, 65536));
}

void set_frames(Options &options, const std::string &value) {
    const auto parts = split(value, ':');
    if (parts.size() > 3) throw OptionError{"A, A:B or A:B:STEP"};
    const int64_t first = integer_in(parts[0], 0, 1000000000);
    const int64_t last = parts.size() > 1 ? integer_in(parts[1], 0, 1000000000) : first;
    if (last < first) throw OptionError{"A:B, B not below A"};
    const int64_t step = parts.size() > 2 ? integer_in(parts[2], 1, 1000000000) : 1;
    options.frames = Options::Frames{first, last, step};
}

void set_crop(Options &options, const std::string &value) {
    const auto parts = split(value, ',');
    if (parts.size() != 4) throw OptionError{"X0,Y0,X1,Y1"};
    int at[4];
    for (size_t i = 0; i < 4; ++i) at[i] = static_cast<int>(integer_in(parts[i], 0, 65536));
    if (at[0] >= at[2] || at[1] >= at[3]) throw OptionError{"X0 < X1 and Y0 < Y1"};
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
    const auto number = to_number(digits);
    const double bytes = number ? std::ldexp(*number, shift) : 0;
    if (!(bytes >= 1 && bytes < 0x1p63)) throw OptionError{"bytes, with k, M or G behind"};
    options.memory = static_cast<uint64_t>(bytes);
}

} // namespace

const OptionTable<Options> &scene_options() {
    static const OptionTable<Options> table = {
        {"output", "FILE",
         ".png (8-bit sRGB), .pfm or .exr (linear float); of --reference and merge .passes; of merge .map; repeatable; "
         "%04d = frame number; - or -.png: "
         "standard output, as .pfm or as .png",
         set_output},
        {"arith", "f32|f64|fixed", "number system (f32)", to_word(&Options::arithmetic, {"f32", "f64", "fixed"})},
        {"size", "WxH", "pixels (the scene's resolution)", set_size},
        {"spp", "N", "rays a pixel (4)", to_count_in(&Options::samples, 1, 65536)},
        {"seed", "N", "of photons, of lines through smoke and of paths (1)", to_count_in(&Options::seed, 0, INT64_MAX)},
        {"smoke", "direct|map|volume",
         "photon map, whose estimate from the nearest photons is the paper's, and too bright where they are far; "
         "particle map; photon map of resampled smoke (map)",
         to_word(&Options::method, {"direct", "map", "volume"})},
        {"irradiance", "none|uniform|adaptive",
         "multiple scattering at points of bricks, as many in each or as needed (uniform)",
         to_word(&Options::irradiance, {"none", "uniform", "adaptive"})},
        {"irradiance-step", "S",
         "distance of those points at most, in smoothing lengths (two cells or more, of density grids one)",
         to_spacing(&Options::irradiance_step, false)},
        {"density-step", "S",
         "cells of resampled smoke, in smoothing lengths; 0: exact (0.1 to 0.55, of density grids 1 or half a sample, "
         "direct 0)",
         to_spacing(&Options::density_step, true)},
        {"estimate", "knn|kernel",
         "radiance from the nearest photons or particles (direct), or of the particles' kernels (map)",
         to_word(&Options::estimate, {"kernel", "knn"})},
        {"deposit", "exact|path|kernel|nodes",
         "of a photon on particles: that of the collision, all of its flight, or all around; or at the nodes around it "
         "(nodes, on particles exact)",
         to_word(&Options::deposit, {"exact", "path", "kernel", "nodes"})},
        {"direction", "flux|mean", "what is kept of the photons' directions: their flux, or their mean (flux)",
         to_word(&Options::direction, {"flux", "mean"})},
        {"photons", "N", "photons emitted (1000000)", to_count_in(&Options::photons, 0, INT64_MAX)},
        {"max-error", "E",
         "chooses photons and cells, or the reference where these do not suffice, for a relative RMSE of at most E: "
         "some pixels of the first frame are measured before, for about as long as ten or twenty frames take; of "
         "render alone",
         [](Options &options, const std::string &value) {
             options.max_error = number_that(
                 value, [](double x) { return x >= 0.001 && x <= 1; }, "a number from 0.001 to 1");
         }},
        {"gather", "K", "most photons or particles in an estimate by knn (500)",
         to_count_in(&Options::gather, 2, 1000000)},
        {"gather-radius", "R", "largest radius of an estimate, in smoothing lengths (2)",
         [](Options &options, const std::string &value) {
             options.gather_radius = number_that(
                 value, [](double x) { return x > 0 && x <= 1000; }, "a number above 0, at most 1000");
         }},
        {"step", "S",
         "marching step, in smoothing lengths (0.5; map of resampled smoke two cells or more, of density grids "
         "half a sample at most)",
         [](Options &options, const std::string &value) {
             options.step = number_that(
                 value, [](double x) { return x >= 1e-4 && x <= 1000; }, "a number from 0.0001 to 1000");
         }},
        {"layers", nullptr,
         "what the picture consists of, too: emission, single and multiple scattering, surfaces, background, which add "
         "up to it to the bit; direct light, albedo, normal, depth, alpha, shadow, node visits, samples, of "
         "--reference its standard error; as channels of an .exr, or as FILE.WORD.pfm beside a FILE.pfm",
         to_switch(&Options::layers)},
        {"reference", nullptr, "unbiased path tracing instead: slow, for measuring error",
         to_switch(&Options::reference)},
        {"passes", "A:B", "of --reference, half-open (0:16): so many times --spp rays a pixel",
         to_range(&Options::passes)},
        {"error-out", "FILE", "of --reference: the standard error of each value, as .pfm",
         [](Options &options, const std::string &value) {
             if (!ends_in(value, ".pfm")) throw OptionError{"a file name that ends in .pfm"};
             options.error_out = value;
         }},
        {"map-out", "FILE", "of --smoke map: saves the particle map", to_text(&Options::map_out)},
        {"map-in", "FILE",
         "a saved particle map, for other views without tracing again (where `wisp plan` says that photons are kept as "
         "scattered to the eye, only for the same place of the eye)",
         to_text(&Options::map_in)},
        {"batches", "A:B", "with --map-out: traces only these of the batches of 4096 photons, half-open; no picture",
         to_range(&Options::batches)},
        {"remap", nullptr, "traces the particle map anew for every frame", to_switch(&Options::remap)},
        {"light-step", "S",
         "of points whose depth to the lights is kept; 0: exact, of resampled smoke every node (a cell, else 0)",
         to_spacing(&Options::light_step, true)},
        {"thin", "EPS",
         "render without the particles that take no more than this off any ray's opacity; 0: with all (0)",
         [](Options &options, const std::string &value) {
             options.decimate = number_that(
                 value, [](double x) { return x >= 0 && x <= 0.99; }, "a number from 0 to 0.99");
         }},
        {"exposure", "EV", "of .png, in stops (0)",
         [](Options &options, const std::string &value) {
             options.exposure = number_that(
                 value, [](double x) { return std::fabs(x) <= 100; }, "a number from -100 to 100");
         }},
        {"frames", "A[:B[:STEP]]", "frames A to B, both included (all of the scene's animation)", set_frames},
        {"crop", "X0,Y0,X1,Y1", "pixels, half-open, from the top left", set_crop},
        {"memory", "BYTES",
         "a ceiling (k/M/G) below what is available: a plan and a picture that need more are refused", set_memory},
        {"stats", "FILE", "counters, seconds and bytes as JSON; -: on standard output", to_text(&Options::stats)},
        {"digest", nullptr, "print the SHA-256 of each frame's .pfm", to_switch(&Options::digest)},
        {"progress", "auto|always|never", "on standard error (auto: on a terminal)",
         to_word(&Options::progress, {"auto", "always", "never"})},
        {"quiet", nullptr, "no word but errors: no warnings", to_switch(&Options::quiet)},
        {"verbose", nullptr, "say more", to_switch(&Options::verbose)},
        {"lights", "all|cuts",
         "which lights a point of a surface asks: all; clusters of them, split where they may err by 2 % (all)",
         to_word(&Options::lights, {"all", "cuts"})},
        {"tree", "box|kd",
         "over triangles: of boxes, or a kd-tree as in the papers; pictures are the same, --stats counts differ (box)",
         to_word(&Options::tree, {"box", "kd"})},
        {"depth", "N", "longest chain of reflected and refracted rays behind a camera ray, 0 to 64 (10)",
         to_count_in(&Options::depth, 0, 64)},
        {"shadows", shadow_method_choices + 1,
         "how shadows of surfaces are found: by rays; the last occluder first; by what was met before; without rays "
         "where proved, of cells, of voxels; by lists of what a light sees, of what may be in the way (exact; trace, "
         "the same picture, where --memory is less)",
         to_word(&Options::shadows, {std::begin(shadow_method_names), std::end(shadow_method_names)})},
        {"up", "y|z", "of a file of smoke by itself: the axis that points up (y)", to_word(&Options::up, {"y", "z"})},
        {"ground", "yes|no", "of a file of smoke by itself: whether it has a ground that catches its shadow (yes)",
         [](Options &options, const std::string &value) {
             options.ground = one_of(value, {"yes", "no"}) == 0;
         }},
        {"grid", "NAME", "of a .vdb or .nvdb by itself: which of its grids (density, or the only one)",
         to_text(&Options::grid)},
        {"write-scene", "FILE", "of a file of smoke by itself: saves the scene that was chosen for it, to go on from",
         to_text(&Options::write_scene)},
        {"frame-count", "N", "divide the animation's time into N frames instead of the scene's own number",
         to_count_in(&Options::frame_count, 1, 1000000000)},
    };
    return table;
}

void set_option(Options &options, const std::string &name, const std::string &value, const std::string &where) {
    set_option(scene_options(), options, name, value, where);
}

} // namespace wisp
