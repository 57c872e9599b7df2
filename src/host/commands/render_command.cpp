#include "host/base/files.h"
#include "host/base/sha256.h"
#include "host/base/version.h"
#include "host/commands/commands.h"
#include "host/commands/max_error.h"
#include "host/commands/memory_check.h"
#include "host/commands/output.h"
#include "host/commands/progress_meter.h"
#include "host/commands/request.h"
#include "host/commands/run_warnings.h"
#include "host/results/fingerprint.h"
#include "host/results/render_layers.h"
#include "host/results/statistics_json.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

namespace wisp {

namespace {

// Whether the files of an earlier run can be all that the options want of a frame. The digest is that of a .pfm.
bool can_keep(const Options &options) {
    if (options.outputs.empty() || !options.error_out.empty() || !options.map_out.empty()) return false;
    bool exact = false;
    for (const std::string &output : options.outputs) {
        if (!carries_record(options, output)) return false;
        if (options.layers && ends_in(output, ".pfm")) return false; // files of layers beside it carry no record
        exact = exact || ends_in(output, ".pfm");
    }
    return exact || (!options.digest && options.stats.empty());
}

// The sums of `--reference`, all 0.
Passes make_passes(const Request &request, const PreparedScene &prepared, const Settings &settings) {
    Passes passes;
    passes.scene = fingerprint_of_samples(prepared.scene, settings, renderer_of(request.options.arithmetic).name);
    passes.width = settings.crop.width();
    passes.height = settings.crop.height();
    passes.samples = settings.samples;
    passes.exponent = prepared.scene.radiance_exponent;
    passes.ranges = {{settings.first_pass, settings.last_pass}};
    passes.pixels.resize(static_cast<size_t>(passes.width) * static_cast<size_t>(passes.height));
    return passes;
}

Batches batches_of(const Options &options, const Settings &settings) {
    return options.batches ? Batches{options.batches->first, options.batches->last} : all_batches(settings);
}

// `map` is the particle map of the frame before, and becomes that of this frame: the file of --map-in; the same map,
// where nothing that it depends on has changed; or an empty one, which is then to be traced: the result is true.
bool load_or_reset_map(const Request &request, int64_t frame, const PreparedScene &prepared, const Settings &settings,
                       const Plan &plan, MapFile &map) {
    const Options &options = request.options;
    std::string scene; // hashing all particles takes time, so only for a map that is compared with another
    if (!options.map_in.empty() || !options.map_out.empty() || several_frames(request))
        scene = fingerprint_of_map(request, prepared, settings, plan);
    if (!options.map_in.empty()) {
        map = saved_map(request, frame, scene, plan);
        return false;
    }
    if (!options.remap && !scene.empty() && map.scene == scene) return false;
    map = {};
    map.scene = scene;
    map.photons = settings.photons;
    const Batches batches = batches_of(options, settings);
    if (batches.first < batches.last)
        map.batches = {{static_cast<uint32_t>(batches.first), static_cast<uint32_t>(batches.last)}};
    map.sums.resize(plan.map_sums);
    return true;
}

// What is kept from frame to frame.
struct Sequence {
    explicit Sequence(const Request &request) : warnings(request), progress(request.frames.count()) {}

    RunWarnings warnings;
    RunProgress progress;
    PreparedScene prepared;
    std::string shapes; // fingerprint_of_shapes(); empty until it is needed
    Block block;
    FrameCache cache = {}; // in the block
    std::string smoke;     // fingerprint_of_smoke() of the cache
    MapFile map;           // the particle map of the frame before
    Sha256 digest;
};

std::optional<PictureRecord> find_record(const Options &options, const Settings &settings, Sequence &sequence) {
    bool needed = false;
    for (const std::string &output : options.outputs) needed = needed || carries_record(options, output);
    if (!needed) return std::nullopt;
    const PreparedScene &prepared = sequence.prepared;
    if (sequence.shapes.empty()) sequence.shapes = fingerprint_of_shapes(prepared.scene);
    const std::string scene = fingerprint_of_picture(prepared.scene, sequence.shapes, settings, prepared.width,
                                                     prepared.height, renderer_of(options.arithmetic).name);
    return PictureRecord{scene, prepared.width, prepared.height, settings.crop};
}

// True when every output of the frame is there already, as it would be made. Then its digest is printed.
bool keep_frame(const Options &options, const PictureRecord &record, int64_t frame, Sequence &sequence) {
    Bytes pfm;
    for (const std::string &output : options.outputs) {
        auto bytes = recorded_bytes(numbered(output, frame), record_of(options, output, record));
        if (!bytes) return false;
        if (ends_in(output, ".pfm")) pfm = std::move(*bytes);
    }
    sequence.digest.update(pfm.data(), pfm.size());
    if (options.digest) print_digest(options, pfm, frame);
    for (const std::string &output : options.outputs) {
        const std::string path = numbered(output, frame);
        for (const std::string &file : {path, record_path(path)}) tidy_up(file);
        if (options.verbose) print_note("kept " + path);
    }
    return true;
}

FrameReport render_frame(const Request &request, int64_t frame, Sequence &sequence) {
    FrameReport report = {};
    report.frame = frame;
    const double start = now();
    const Options &options = request.options;
    PreparedScene &prepared = sequence.prepared;
    MapFile &map = sequence.map;
    std::optional<EndAtOnce> at_once;
    end_at_once(request, frame, at_once);
    const double scale = prepared.scale;
    prepare_scene(request.name, request.file, options, frame, prepared);
    if (prepared.surfaces && prepared.scale != scale) { // what is known of triangles is in another unit
        sequence.shapes.clear();
        sequence.cache = {};
    }
    if (options.verbose)
        for (const std::string &note : prepared.notes) print_note(note);
    const Settings settings = settings_of(options, prepared);
    const std::optional<PictureRecord> record = find_record(options, settings, sequence);
    at_once.reset(); // what is kept is printed
    report.kept = can_keep(options) && keep_frame(options, *record, frame, sequence);
    if (report.kept) {
        --sequence.progress.frames;
        return report;
    }
    end_at_once(request, frame, at_once);
    const Plan plan = checked_plan(request, prepared.scene, settings);
    if (sequence.block.fit(request, prepared, settings, plan)) sequence.cache = {};
    sequence.warnings.of_light(prepared, settings, plan);
    sequence.warnings.of_frame(frame, prepared, settings, plan);
    const bool mapped = uses_map(settings);
    const bool traced = mapped && load_or_reset_map(request, frame, prepared, settings, plan, map);
    report.seconds.read = now() - start;

    Picture picture;
    PictureLayers layers;
    Passes passes;
    Arena arena(sequence.block.get(), plan.arena_bytes);
    ProgressMeter progress(options, frame, plan, sequence.progress);
    Status status = Status::done;
    PhotonSums sums = {map.sums.data(), map.sums.size(), traced ? 0 : map.sums.size()};
    Job job = {prepared.scene, settings, arena, report.statistics, progress.observer()};
    if (mapped) job.photons = &sums;
    if (settings.goal == Goal::photons) {
        job.batches = batches_of(options, settings);
    } else if (settings.goal == Goal::reference) {
        passes = make_passes(request, prepared, settings);
        job.pixels = passes.pixels.data();
    } else {
        picture.width = settings.crop.width();
        picture.height = settings.crop.height();
        picture.rgb.resize(static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height) * 3);
        job.rgb = picture.rgb.data();
        job.cache = &sequence.cache;
        if (plan.smoke && several_frames(request)) {
            const std::string smoke =
                fingerprint_of_smoke(prepared.scene, settings, renderer_of(options.arithmetic).name);
            sequence.cache.same_smoke = smoke == sequence.smoke;
            sequence.smoke = smoke;
        }
    }
    if (settings.layers) {
        layers = make_layers(settings, plan);
        job.layers = layers.values.data();
    }
    at_once.reset();
    // Batches of photons that a map has already are not traced again.
    if (settings.goal != Goal::photons || traced) status = renderer_of(options.arithmetic).render(job);
    if (settings.goal == Goal::reference) picture = mean_picture(passes);
    progress.finish();
    if (status == Status::stopped) stop(request, frame);
    if (status != Status::done) fail(request, plan, frame, status);
    sequence.warnings.of_photons(prepared.scene, settings, plan, report.statistics);
    if (job.rgb) sequence.warnings.of_noise(prepared.scene, settings, report.statistics, picture);
    sequence.warnings.of_radiances(report.statistics);
    if (report.statistics.photons.thinning > 0 && options.verbose)
        print_note(request.name + ": the photon map keeps one of " +
                   std::to_string(1u << report.statistics.photons.thinning) + " collisions, so that they fit");

    if (traced) {
        map.sums.resize(sums.count);
        map.counts = report.statistics.photons;
    } else if (mapped) {
        report.statistics.photons = map.counts;
        if (options.verbose && options.map_in.empty()) print_note("the particle map is that of the frame before");
    }
    if (!options.map_out.empty()) write_output(options, numbered(options.map_out, frame), map_bytes(map));
    if (!options.batches) {
        if (settings.layers) finish_layers(layers, prepared.scale, settings, plan, passes);
        const Bytes pfm = pfm_bytes(picture);
        write_outputs(options, picture, pfm, settings.goal == Goal::reference ? &passes : nullptr, frame, record,
                      layers);
        sequence.digest.update(pfm.data(), pfm.size());
    }
    report.seconds.trees = progress.seconds(StageGroup::trees);
    report.seconds.photons = mapped && !traced ? 0 : progress.seconds(StageGroup::photons);
    report.seconds.irradiance = progress.seconds(StageGroup::irradiance);
    report.seconds.render = progress.seconds(StageGroup::render);
    report.plan = plan;
    report.seconds.total = now() - start;
    return report;
}

// Throws Error(exit_usage) for options that make nothing: the work would be lost.
void check_purpose(const Options &options) {
    if (options.outputs.empty() && options.map_out.empty() && options.error_out.empty() && options.stats.empty() &&
        !options.digest)
        throw Error(exit_usage, "found nothing to make of the scene, expected --output, --digest, --stats, --map-out "
                                "or --error-out");
    if (options.layers && std::none_of(options.outputs.begin(), options.outputs.end(), holds_layers))
        throw Error(exit_usage, "option 'layers': found no output that holds them, expected a .exr, or a .pfm with "
                                "files beside it");
}

} // namespace

int render_command(const std::vector<std::string> &arguments) {
    Request request = read_request(parse_arguments("render", scene_options(), arguments));
    const Options &options = request.options;
    check_options(request);
    check_purpose(options);
    check_max_error(request, true);
    check_outputs(options, request.frames, files_read(request));
    choose_for_error(request);
    Sequence sequence(request);
    RunReport report;
    report.version = version;
    report.arithmetic = renderer_of(options.arithmetic).name;
    size_t kept = 0;
    for (int64_t frame = request.frames.first; frame <= request.frames.last; frame += request.frames.step) {
        if (received_signal()) stop(request, frame);
        report.frames.push_back(render_frame(request, frame, sequence));
        kept += report.frames.back().kept;
    }
    if (kept > 0 && !options.quiet)
        print_note("kept " + std::to_string(kept) + " of " + std::to_string(report.frames.size()) +
                   " frames, which were there already");
    report.digest = sequence.digest.finish().text;
    if (!options.stats.empty()) {
        const std::string json = statistics_json(report);
        write_output(options, options.stats, Bytes(json.begin(), json.end()));
    }
    return exit_done;
}

} // namespace wisp
