#include "host/base/files.h"
#include "host/base/text.h"
#include "host/commands/defaults.h"
#include "host/commands/request.h"
#include "host/commands/output.h"
#include "host/prepare/chosen_scene.h"
#include "host/results/fingerprint.h"
#include "host/results/picture_bytes.h"
#include "wisp/photon_sums.h"
#include "wisp/pixel_sums.h"
#include "wisp/settings.h"
#include <algorithm>
#include <filesystem>

namespace wisp {

namespace {

// The frames to render: those of --frames, else all of the animation, else frame 0.
Options::Frames frames_of(const Request &request) {
    const Options &options = request.options;
    if (!request.file.animation) {
        if (options.frame_count)
            throw Error(exit_usage, request.name, "option 'frame-count': there is no animation (statement 'a')");
        return options.frames.value_or(Options::Frames());
    }
    const int64_t last = frame_count_of(request.file, options) - 1;
    if (!options.frames) return {0, last, 1};
    if (options.frames->last > last)
        throw Error(exit_usage, request.name,
                    "option 'frames': found frame " + std::to_string(options.frames->last) + ", expected 0 to " +
                        std::to_string(last));
    return *options.frames;
}

// Options that only a command line has: of a file of smoke by itself, and of any scene.
constexpr const char *options_of_smoke_files[] = {"up", "ground", "grid", "write-scene"};
constexpr const char *options_of_runs[] = {"output", "stats", "error-out", "map-out", "map-in", "max-error", "layers"};

template <class Names> bool is_among(const std::string &name, const Names &names) {
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

void write_scene(const std::string &path, const std::string &smoke, const ChosenScene &chosen) {
    namespace fs = std::filesystem;
    std::error_code fault;
    const fs::path folder = fs::absolute(path, fault).parent_path();
    const fs::path whole = fault ? fs::path() : fs::absolute(smoke, fault);
    const fs::path named = fault ? fs::path() : fs::proximate(whole, folder, fault);
    if (fault == std::errc::not_enough_memory) throw std::bad_alloc();
    if (fault) throw Error(exit_output, path, "cannot name " + smoke + " from its folder: " + fault.message());
    write_file(path, chosen.text(named.string()));
}

// The scene file, with what it leaves out, of which `notes` say what was chosen; or the scene that is `chosen` for a
// file of smoke.
SceneFile scene_of(const std::string &name, const Options &options, const CommandLine &line,
                   std::optional<ChosenScene> &chosen, std::vector<std::string> &notes) {
    if (is_smoke_file(name)) return chosen.emplace(name, options).scene();
    SceneFile scene = read_scene(name); // first: it may be no scene either
    for (const auto &[option, value] : line.options)
        if (is_among(option, options_of_smoke_files))
            throw Error(exit_usage, name, "option '" + option + "' is for a file of smoke by itself, found a scene");
    notes = complete_scene(scene);
    return scene;
}

std::string stopped(const std::string &name) { return name + ": stopped by "; }
std::string in_frame(int64_t frame) { return " in frame " + std::to_string(frame); }

} // namespace

Request read_request(const CommandLine &line) {
    if (line.files.size() != 1)
        throw Error(exit_usage,
                    "found " + std::to_string(line.files.size()) + " scene files, expected one; see 'wisp help'");
    Request request;
    for (const auto &[name, value] : line.options) set_option(request.options, name, value); // usage before input
    request.name = line.files[0];
    install_signal_handlers();
    const EndAtOnce at_once(printable("wisp: error: " + stopped(request.name)), "");
    std::vector<std::string> notes;
    std::optional<ChosenScene> chosen;
    request.file = scene_of(request.name, request.options, line, chosen, notes);
    request.options = Options();
    for (const SceneFile::Default &setting : request.file.defaults) try {
            if (is_among(setting.option, options_of_runs) || is_among(setting.option, options_of_smoke_files))
                throw InputError(setting.where,
                                 "option '" + setting.option + "' in a scene, expected it on the command line");
            set_option(request.options, setting.option, setting.value, setting.where);
        } catch (const Error &error) {
            throw InputError(error.place, error.text);
        }
    for (const auto &[name, value] : line.options) {
        set_option(request.options, name, value);
        if (!is_given(request, name)) request.given.push_back(name);
    }
    if (!request.options.quiet)
        for (const std::string &note : notes) print_note(note);
    if (chosen && !chosen->left_out().empty())
        Warnings(request.options.quiet).print({"sequence", request.name, chosen->left_out()});
    request.frames = frames_of(request);
    if (chosen && !request.options.write_scene.empty()) {
        check_not_read("write-scene", request.options.write_scene, files_read(request));
        write_scene(request.options.write_scene, request.name, *chosen);
    }
    return request;
}

std::vector<std::string> files_read(const Request &request) {
    std::vector<std::string> files = request.file.included;
    files.push_back(request.name);
    for (const auto &texture : request.file.graph.textures) files.push_back(texture.path);
    for (const auto &smoke : request.file.smokes) {
        if (smoke.box) continue;
        for (int64_t frame = request.frames.first; frame <= request.frames.last; frame += request.frames.step) {
            files.push_back(smoke.path(frame));
            std::error_code fault; // a frame without its file is the last, and a file without a number is that of all
            if (!has_number(smoke.file) || !std::filesystem::exists(files.back(), fault)) break;
        }
    }
    return files;
}

Settings settings_of(const Options &options, const PreparedScene &prepared, const char **why_paths) {
    const int width = options.width.value_or(prepared.width), height = options.height.value_or(prepared.height);
    Settings settings = {};
    settings.crop = {0, 0, width, height};
    if (options.crop) {
        const auto &c = *options.crop;
        if (c.x1 > width || c.y1 > height)
            throw Error(exit_usage, "option 'crop': found " + std::to_string(c.x0) + "," + std::to_string(c.y0) + "," +
                                        std::to_string(c.x1) + "," + std::to_string(c.y1) +
                                        ", expected pixels of the " + std::to_string(width) + " x " +
                                        std::to_string(height) + " picture");
        settings.crop = {c.x0, c.y0, c.x1, c.y1};
    }
    settings.samples = options.samples;
    settings.depth = options.depth;
    settings.shadows = options.shadows.value_or(ShadowMethod::exact);
    settings.lights = options.lights;
    settings.tree = options.tree;
    settings.check_shadows = options.verbose && settings.shadows == ShadowMethod::paper;
    settings.photons = options.photons;
    settings.seed = options.seed;
    settings.gather = options.gather;
    settings.gather_radius = options.gather_radius;
    settings.goal = options.reference ? Goal::reference : options.batches ? Goal::photons : Goal::picture;
    settings.layers = options.layers;
    const uint64_t rays = static_cast<uint64_t>(width) * static_cast<uint64_t>(height) * settings.samples;
    const char *why = choose_defaults(options, prepared.scene, paths_for(settings.photons, rays), settings);
    if (why_paths) *why_paths = why;
    const Options::Range passes = options.passes.value_or(Options::Range{0, 16});
    settings.first_pass = passes.first;
    settings.last_pass = passes.last;
    // Traced shadows are the same, and nothing is kept for them.
    if (options.memory && !options.shadows &&
        needed_bytes(settings, renderer_of(options.arithmetic).plan(prepared.scene, settings)) > *options.memory)
        settings.shadows = ShadowMethod::trace;
    return settings;
}

Plan checked_plan(const Request &request, const Scene &scene, const Settings &settings) {
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (scene.smokes[i].is_grid() && settings.method == Method::map && settings.estimate == Estimate::knn)
            throw Error(exit_usage, request.name,
                        "option 'estimate': found 'knn' with --smoke map for a grid or a "
                        "box, expected kernel, or particles alone");
    const Plan plan = renderer_of(request.options.arithmetic).plan(scene, settings);
    if (!plan.smoke && uses_map(settings)) {
        const char *option = is_given(request, "map-in")    ? "map-in"
                             : is_given(request, "map-out") ? "map-out"
                                                            : "batches";
        throw Error(exit_usage, request.name,
                    std::string("option '") + option +
                        "': found a scene without smoke, expected smoke, of whose photons a map is");
    }
    if (uses_map(settings) && settings.photons > plan.max_photons)
        throw Error(exit_usage, "option 'photons': found " + std::to_string(settings.photons) + ", expected at most " +
                                    std::to_string(plan.max_photons) + " that the particle map's sums can hold");
    return plan;
}

namespace {

bool is_map_of_one_view(const Plan &plan) { return plan.photon_directions == Plan::Directions::to_eye; }

} // namespace

std::string fingerprint_of_map(const Request &request, const PreparedScene &prepared, const Settings &settings,
                               const Plan &plan) {
    return fingerprint_of_map(prepared.scene, settings, is_map_of_one_view(plan),
                              renderer_of(request.options.arithmetic).name);
}

MapFile saved_map(const Request &request, int64_t frame, const std::string &scene, const Plan &plan) {
    const std::string path = numbered(request.options.map_in, frame);
    MapFile map = parse_map(read_file(path), path);
    check_map(map, scene, is_map_of_one_view(plan), plan.map_sums, path);
    return map;
}

void fail(const Request &request, const Plan &plan, int64_t frame, Status status) {
    if (status == Status::size_mismatch)
        throw InputError(numbered(request.options.map_in, frame), "not as many sums as this scene's map has");
    if (status == Status::overflow)
        throw InputError(request.name, "photons collide so often that the particle map's sums might overflow, "
                                       "expected fewer --photons or thinner smoke");
    throw Error(exit_memory, request.name, "the plan's " + std::to_string(plan.arena_bytes) + " bytes do not suffice");
}

void stop(const Request &request, int64_t frame) {
    const int signal = received_signal();
    throw Error(static_cast<Exit>(exit_signal + signal), stopped(request.name) + signal_name(signal) + in_frame(frame));
}

void end_at_once(const Request &request, int64_t frame, std::optional<EndAtOnce> &life) {
    life.emplace(printable("wisp: error: " + stopped(request.name)), in_frame(frame));
}

namespace {

void check_map_options(const Options &options, bool several) {
    const struct {
        const char *name;
        bool given;
    } of_map[] = {{"map-out", !options.map_out.empty()},
                  {"map-in", !options.map_in.empty()},
                  {"batches", options.batches.has_value()},
                  {"remap", options.remap}};
    for (const auto &option : of_map)
        if (option.given && (options.reference || options.method.value_or(Method::map) != Method::map))
            throw Error(exit_usage, std::string("option '") + option.name + "' belongs to --smoke map");
    for (size_t i : {0, 2, 3})
        if (!options.map_in.empty() && of_map[i].given)
            throw Error(exit_usage,
                        std::string("option '") + of_map[i].name + "' does not go with --map-in: nothing is traced");
    if (several && !options.map_out.empty() && !has_number(options.map_out))
        throw Error(exit_usage,
                    "option 'map-out': found '" + options.map_out + "' for several frames, expected a name with %04d");
    if (!options.batches) return;
    if (options.map_out.empty())
        throw Error(exit_usage, "option 'batches' makes no picture, expected --map-out with it");
    const struct {
        const char *name;
        bool given;
    } of_picture[] = {{"digest", options.digest}, {"output", !options.outputs.empty()}, {"layers", options.layers}};
    for (const auto &option : of_picture)
        if (option.given)
            throw Error(exit_usage,
                        std::string("option '") + option.name + "' does not go with --batches: they make no picture");
    const uint64_t batches = batch_count(options.photons);
    if (options.batches->last > batches)
        throw Error(exit_usage, "option 'batches': found '" + std::to_string(options.batches->first) + ":" +
                                    std::to_string(options.batches->last) + "', expected batches below " +
                                    std::to_string(batches) + ": those of " + std::to_string(options.photons) +
                                    " photons");
}

} // namespace

void check_options(const Request &request) {
    const Options &options = request.options;
    const bool several = several_frames(request);
    check_map_options(options, several);
    for (const std::string &output : options.outputs) {
        if (several && !has_number(output))
            throw Error(exit_usage,
                        "option 'output': found '" + output + "' for several frames, expected a name with %04d");
        if (ends_in(output, ".map"))
            throw Error(exit_usage, "option 'output': found '" + output + "', expected --map-out for the particle map");
        if (!options.reference && ends_in(output, ".passes"))
            throw Error(exit_usage, "option 'output': found '" + output + "', expected .passes only with --reference");
    }
    if (options.shadows == ShadowMethod::paper) {
        const auto refuse = [](const char *option, const char *expected) {
            throw Error(exit_usage,
                        std::string("option '") + option + "' does not go with --shadows paper: " + expected);
        };
        if (options.crop) refuse("crop", "it learns from whole pictures");
        if (options.reference) refuse("reference", "its pixels would be wrong");
        if (request.frames.first != 0 || request.frames.step != 1)
            refuse("frames", "it learns from frame to frame, expected all from 0 on");
    }
    if (options.method == Method::direct && options.estimate == Estimate::kernel)
        throw Error(exit_usage, "option 'estimate': found 'kernel', expected knn with --smoke direct");
    if (several && !options.error_out.empty() && !has_number(options.error_out))
        throw Error(exit_usage, "option 'error-out': found '" + options.error_out +
                                    "' for several frames, expected a name with %04d");
    if (!options.reference && options.passes) throw Error(exit_usage, "option 'passes' belongs to --reference");
    if (!options.reference && !options.error_out.empty())
        throw Error(exit_usage, "option 'error-out' belongs to --reference");
}

bool is_given(const Request &request, const std::string &option) { return is_among(option, request.given); }

bool several_frames(const Request &request) { return request.frames.count() > 1; }

} // namespace wisp
