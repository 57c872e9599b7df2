#include "host/base/error.h"
#include "host/base/files.h"
#include "host/base/interrupt.h"
#include "host/base/sha256.h"
#include "host/base/version.h"
#include "host/commands/commands.h"
#include "host/commands/core.h"
#include "host/commands/progress.h"
#include "host/commands/request.h"
#include "host/images/picture.h"
#include "host/prepare/particle_report.h"
#include "host/results/fingerprint.h"
#include "host/results/map_file.h"
#include "host/results/passes.h"
#include "host/results/picture_record.h"
#include "host/results/statistics_json.h"
#include "host/results/stitch.h"
#include <cstdio>
#include <memory>
#include <new>
#include <optional>

namespace wisp {

namespace {

// The name behind a digest: that of the .pfm that was written, so that `sha256sum -c` finds it.
std::string digest_name(const Options &options, int64_t frame) {
    for (const std::string &output : options.outputs)
        if (ends_in(output, ".pfm")) return numbered(output, frame);
    return "-";
}

void write_output(const Options &options, const std::string &path, const Bytes &bytes) {
    write_file(path, bytes);
    if (options.verbose) std::fprintf(stderr, "wrote %s\n", path.c_str());
}

// Whether a later run, or `wisp stitch`, can tell what this output is: one of several frames, or a part. Pictures of
// the paper's shadows depend on the frames before them, and are never kept.
bool carries_record(const Options &options, const std::string &output) {
    return (options.crop || has_number(output)) && !ends_in(output, ".passes") &&
           options.shadows != ShadowMethod::paper;
}

// Whether all that is asked for of a frame can be had from files of an earlier run. Only a .pfm tells the digest.
bool can_keep(const Options &options) {
    if (options.outputs.empty() || !options.error_out.empty() || !options.map_out.empty()) return false;
    bool exact = false;
    for (const std::string &output : options.outputs) {
        if (!carries_record(options, output)) return false;
        exact = exact || ends_in(output, ".pfm");
    }
    return exact || (!options.digest && options.stats.empty());
}

void print_digest(const Options &options, const Bytes &pfm, int64_t frame) {
    std::printf("%s  %s\n", sha256(pfm.data(), pfm.size()).text, digest_name(options, frame).c_str());
}

// What its proof says of an output.
PictureRecord record_of(const Options &options, const std::string &output, const PictureRecord &picture) {
    PictureRecord proof = picture;
    if (ends_in(output, ".png")) proof.exposure = options.exposure;
    return proof;
}

// All that was asked for of a picture, the digest included. `passes`: of --reference, else nullptr.
void write_outputs(const Options &options, const Picture &picture, const Bytes &pfm, const Passes *passes,
                   int64_t frame, const std::optional<PictureRecord> &proof = std::nullopt) {
    for (const std::string &output : options.outputs) {
        const std::string path = numbered(output, frame);
        if (ends_in(output, ".passes")) {
            write_output(options, path, passes_bytes(*passes));
            continue;
        }
        const Bytes bytes = ends_in(output, ".png") ? png_bytes(picture, options.exposure) : pfm;
        if (!proof || !carries_record(options, output)) {
            write_output(options, path, bytes);
            continue;
        }
        write_recorded(path, bytes, record_of(options, output, *proof));
        if (options.verbose) std::fprintf(stderr, "wrote %s\n", path.c_str());
    }
    if (!options.error_out.empty())
        write_output(options, numbered(options.error_out, frame), pfm_bytes(error_picture(*passes)));
    if (options.digest) print_digest(options, pfm, frame);
}

// The sums of `--reference`, empty as yet.
Passes make_passes(const Request &request, const PreparedScene &prepared, const Settings &settings) {
    Passes passes;
    passes.scene = fingerprint_of_samples(prepared.scene, settings, core(request.options.arithmetic).name);
    passes.width = settings.crop.x1 - settings.crop.x0;
    passes.height = settings.crop.y1 - settings.crop.y0;
    passes.samples = settings.samples;
    passes.exponent = prepared.scene.radiance_exponent;
    passes.ranges = {{settings.first_pass, settings.last_pass}};
    passes.pixels.resize(static_cast<size_t>(passes.width) * static_cast<size_t>(passes.height));
    return passes;
}

Batches batches_of(const Options &options, const Settings &settings) {
    return options.batches ? Batches{options.batches->first, options.batches->last} : all_batches(settings);
}

// Makes `map`, which holds that of the frame before, this frame's: from the file of --map-in, the same where nothing
// has changed, or an empty one. True when it is still to be traced.
bool load_or_reset_map(const Request &request, int64_t frame, const PreparedScene &prepared, const Settings &settings,
              const Plan &plan, MapFile &map) {
    const Options &options = request.options;
    std::string scene; // hashing all particles takes a while: not for a map that nobody else will see
    if (!options.map_in.empty() || !options.map_out.empty() || several_frames(request))
        scene = fingerprint_of_map(prepared.scene, settings, core(options.arithmetic).name);
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

// What lives from frame to frame.
struct Sequence {
    PreparedScene prepared;
    std::string shapes; // fingerprint_of_shapes(), where it was asked for
    std::unique_ptr<unsigned char[]> block;
    uint64_t bytes = 0; // of the block
    FrameCache kept = {};     // in it
    std::string smoke;  // fingerprint_of_smoke() of what is kept
    MapFile map;        // the particle map of the frame before
    Sha256 digest;
};

std::optional<PictureRecord> find_record(const Options &options, const Settings &settings, Sequence &sequence) {
    bool asked = false;
    for (const std::string &output : options.outputs) asked = asked || carries_record(options, output);
    if (!asked) return std::nullopt;
    const PreparedScene &prepared = sequence.prepared;
    if (sequence.shapes.empty()) sequence.shapes = fingerprint_of_shapes(prepared.scene);
    const std::string scene = fingerprint_of_picture(prepared.scene, sequence.shapes, settings, prepared.width,
                                                  prepared.height, core(options.arithmetic).name);
    return PictureRecord{scene, prepared.width, prepared.height, settings.crop};
}

// True when every output of the frame is there already, as it would be made; then its digest is told.
bool keep_frame(const Options &options, const PictureRecord &proof, int64_t frame, Sequence &sequence) {
    Bytes pfm;
    for (const std::string &output : options.outputs) {
        auto bytes = recorded_bytes(numbered(output, frame), record_of(options, output, proof));
        if (!bytes) return false;
        if (ends_in(output, ".pfm")) pfm = std::move(*bytes);
    }
    sequence.digest.update(pfm.data(), pfm.size());
    if (options.digest) print_digest(options, pfm, frame);
    for (const std::string &output : options.outputs) {
        const std::string path = numbered(output, frame);
        for (const std::string &file : {path, record_path(path)}) tidy_up(file);
        if (options.verbose) std::fprintf(stderr, "kept %s\n", path.c_str());
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
    prepare_scene(request.name, request.file, options, frame, prepared);
    if (options.verbose)
        for (const std::string &note : prepared.notes) std::fprintf(stderr, "%s\n", note.c_str());
    const Settings settings = settings_of(options, prepared);
    const std::optional<PictureRecord> proof = find_record(options, settings, sequence);
    report.kept = can_keep(options) && keep_frame(options, *proof, frame, sequence);
    if (report.kept) return report;
    const Plan plan = checked_plan(request, prepared.scene, settings);
    check_picture(request, settings, plan);
    const bool mapped = uses_map(settings);
    const bool traced = mapped && load_or_reset_map(request, frame, prepared, settings, plan, map);
    if (sequence.bytes < plan.bytes.arena) {
        sequence.block = make_block(request.name, plan.bytes.arena);
        sequence.bytes = plan.bytes.arena;
        sequence.kept = {};
    }
    report.seconds.read = now() - start;

    Picture picture;
    Passes passes;
    Arena arena(sequence.block.get(), plan.bytes.arena);
    Progress watch(options, frame);
    Status status = Status::done;
    PhotonSums sums = {map.sums.data(), map.sums.size(), traced ? 0 : map.sums.size()};
    if (options.batches) {
        if (traced)
            status = core(options.arithmetic)
                         .trace_map(prepared.scene, settings, batches_of(options, settings), arena, watch.observer(),
                                    sums, report.statistics);
    } else if (settings.reference) {
        passes = make_passes(request, prepared, settings);
        status = core(options.arithmetic)
                     .render_reference(prepared.scene, settings, arena, watch.observer(), passes.pixels.data(),
                                       report.statistics);
        picture = mean_picture(passes);
    } else {
        picture.width = settings.crop.x1 - settings.crop.x0;
        picture.height = settings.crop.y1 - settings.crop.y0;
        picture.rgb.resize(static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height) * 3);
        if (plan.smoke && several_frames(request)) {
            const std::string smoke = fingerprint_of_smoke(prepared.scene, settings, core(options.arithmetic).name);
            sequence.kept.same_smoke = smoke == sequence.smoke;
            sequence.smoke = smoke;
        }
        status = core(options.arithmetic)
                     .render(prepared.scene, settings, arena, watch.observer(), picture.rgb.data(), report.statistics,
                             mapped ? &sums : nullptr, &sequence.kept);
    }
    watch.finish();
    if (status == Status::stopped) stop(request, frame);
    if (status != Status::done) fail(request, plan, frame, status);
    if (report.statistics.photons.store_full && !options.quiet)
        std::fprintf(stderr, "%s: the photon store was full after %llu of %llu photons; power is divided by those\n",
                     request.name.c_str(), static_cast<unsigned long long>(report.statistics.photons.emitted),
                     static_cast<unsigned long long>(settings.photons));

    if (traced) {
        map.sums.resize(sums.count);
        map.counts = report.statistics.photons;
    } else if (mapped) {
        report.statistics.photons = map.counts;
        if (options.verbose && options.map_in.empty())
            std::fprintf(stderr, "the particle map is that of the frame before\n");
    }
    if (!options.map_out.empty()) write_output(options, numbered(options.map_out, frame), map_bytes(map));
    if (!options.batches) {
        const Bytes pfm = pfm_bytes(picture);
        write_outputs(options, picture, pfm, settings.reference ? &passes : nullptr, frame, proof);
        sequence.digest.update(pfm.data(), pfm.size());
    }
    report.seconds.trees = watch.seconds(Stage::trees);
    report.seconds.photons = watch.seconds(Stage::photons);
    report.seconds.irradiance = watch.seconds(Stage::irradiance);
    report.seconds.render = watch.seconds(Stage::render);
    report.seconds.total = now() - start;
    return report;
}

void print_stage(const char *name, bool needed, uint64_t bytes, const std::string &why) {
    std::printf("%-14s %-4s %14llu bytes  %s\n", name, needed ? "yes" : "no", static_cast<unsigned long long>(bytes),
                why.c_str());
}

std::string how_shadows(ShadowMethod method) {
    switch (method) {
    case ShadowMethod::trace: return "a ray for each";
    case ShadowMethod::cache: return "the last occluder first, then a ray";
    case ShadowMethod::paper: return "by what rays met before, else a ray";
    case ShadowMethod::exact: return "no ray where proved for a cell of a still triangle";
    case ShadowMethod::voxel: return "no ray where proved for a voxel";
    case ShadowMethod::lightbuffer: return "lists of what each light sees";
    case ShadowMethod::lie: return "lists for the cells of an octree";
    }
    return "";
}

// What a scene of triangles needs.
void print_surface_stages(const Request &request, const Scene &scene, const Plan &plan) {
    const auto number = [](uint64_t n) { return std::to_string(n); };
    uint64_t visible = 0;
    for (uint32_t i = 0; i < scene.instance_count; ++i) visible += scene.instances[i].visible;
    bool mirrors = false, passes = false;
    for (uint32_t i = 0; i < scene.material_count; ++i) {
        const Material &m = scene.materials[i];
        mirrors |= m.specular.x > 0 || m.specular.y > 0 || m.specular.z > 0;
        passes |= m.transmission > 0;
    }
    uint64_t texels = 0;
    for (uint32_t i = 0; i < scene.texture_count; ++i)
        texels += static_cast<uint64_t>(scene.textures[i].width) * static_cast<uint64_t>(scene.textures[i].height);
    print_stage("triangle trees", true, plan.bytes.triangle_trees,
                number(scene.static_count) + " triangles in one tree, built once" +
                    (scene.instance_count
                         ? "; " + number(scene.instance_triangle_count) + " in those of " + number(scene.instance_count) +
                               " bodies (" + number(visible) + " visible), built once and placed in each frame"
                         : "") +
                    (scene.deforming_count ? "; " + number(scene.deforming_count) + " in one for each frame" : ""));
    print_stage("textures", scene.texture_count > 0, 0,
                scene.texture_count ? number(scene.texture_count) + " of " + number(texels) + " texels" : "none");
    print_stage("shadows", scene.light_count > 0, plan.bytes.shadows,
                scene.light_count ? how_shadows(request.options.shadows) + ", " + number(scene.light_count) + " lights"
                                  : "there is no light");
    if (request.options.lights == LightChoice::cuts)
        print_stage("light cuts", scene.light_count > 1, plan.bytes.light_cuts,
                    scene.light_count > 1 ? "a tree of the lights; rays to clusters that err by less than 2 %"
                                          : "of no use: there are not several lights");
    print_stage("recursion", (mirrors || passes) && request.options.depth > 0, 0,
                !mirrors && !passes ? "nothing mirrors or lets light through"
                                    : std::string(mirrors ? "reflected" : "") + (mirrors && passes ? " and " : "") +
                                          (passes ? "refracted" : "") + " rays, at most " +
                                          number(request.options.depth) + " in a chain");
}

void print_notes(const Options &options, const PreparedScene &prepared) {
    if (!options.verbose) return;
    for (const std::string &note : prepared.notes) std::printf("%s\n", note.c_str());
}

} // namespace

int render_command(const std::vector<std::string> &arguments) {
    const Request request = read_request(parse_arguments(arguments));
    const Options &options = request.options;
    check_options(request);
    Sequence sequence;
    RunReport report;
    report.version = version;
    report.arithmetic = core(options.arithmetic).name;
    install_signal_handlers();
    size_t kept = 0;
    for (int64_t frame = request.frames.first; frame <= request.frames.last; frame += request.frames.step) {
        if (received_signal()) stop(request, frame);
        report.frames.push_back(render_frame(request, frame, sequence));
        kept += report.frames.back().kept;
    }
    if (kept > 0 && !options.quiet)
        std::fprintf(stderr, "kept %zu of %zu frames, which were there already\n", kept, report.frames.size());
    report.digest = sequence.digest.finish().text;
    if (!options.stats.empty()) write_file(options.stats, statistics_json(report));
    return exit_done;
}

namespace {

int merge_maps(const std::vector<std::string> &files, const Options &options) {
    if (options.outputs.size() > 1 || !options.error_out.empty() || options.digest || options.exposure != 0)
        throw Error(exit_usage, "maps are merged to a map, expected one --output and no other option with it");
    MapFile map = parse_map(read_file(files[0]), files[0]);
    for (size_t i = 1; i < files.size(); ++i) add_map(map, parse_map(read_file(files[i]), files[i]), files[i]);
    write_output(options, options.outputs[0], map_bytes(map));
    return exit_done;
}

} // namespace

int merge_command(const std::vector<std::string> &arguments) {
    const CommandLine line = parse_arguments(arguments);
    Options options;
    for (const auto &[name, value] : line.options) {
        if (name != "output" && name != "error-out" && name != "exposure" && name != "digest" && name != "quiet" &&
            name != "verbose")
            throw Error(exit_usage, "option '--" + name +
                                        "' is none of merge, expected --output, --error-out, --exposure or --digest");
        set_option(options, name, value, "");
    }
    if (line.files.empty()) throw Error(exit_usage, "found no file to merge, expected some .passes or .map");
    for (const std::string &output : options.outputs)
        if (ends_in(output, ".map")) return merge_maps(line.files, options);
    if (options.outputs.empty() && options.error_out.empty() && !options.digest)
        throw Error(exit_usage, "found nothing to make of the passes, expected --output, --error-out or --digest");
    Passes passes = parse_passes(read_file(line.files[0]), line.files[0]);
    for (size_t i = 1; i < line.files.size(); ++i)
        add_passes(passes, parse_passes(read_file(line.files[i]), line.files[i]), line.files[i]);
    const Picture picture = mean_picture(passes);
    write_outputs(options, picture, pfm_bytes(picture), &passes, 0);
    return exit_done;
}

int stitch_command(const std::vector<std::string> &arguments) {
    const CommandLine line = parse_arguments(arguments);
    Options options;
    for (const auto &[name, value] : line.options) {
        if (name != "output" && name != "exposure" && name != "digest" && name != "quiet" && name != "verbose")
            throw Error(exit_usage,
                        "option '--" + name + "' is none of stitch, expected --output, --exposure or --digest");
        set_option(options, name, value, "");
    }
    if (line.files.empty()) throw Error(exit_usage, "found no part to stitch, expected .pfm files of --crop");
    for (const std::string &part : line.files)
        if (!ends_in(part, ".pfm"))
            throw Error(exit_usage, "found '" + part + "' to stitch, expected a .pfm file of --crop");
    for (const std::string &output : options.outputs)
        if (!ends_in(output, ".pfm") && !ends_in(output, ".png"))
            throw Error(exit_usage, "option 'output': found '" + output + "', expected .pfm or .png of stitch");
    if (options.outputs.empty() && !options.digest)
        throw Error(exit_usage, "found nothing to make of the parts, expected --output or --digest");
    const Picture picture = stitch(line.files);
    write_outputs(options, picture, pfm_bytes(picture), nullptr, 0);
    return exit_done;
}

int plan_command(const std::vector<std::string> &arguments) {
    const Request request = read_request(parse_arguments(arguments));
    check_options(request);
    PreparedScene prepared;
    prepare_scene(request.name, request.file, request.options, request.frames.first, prepared);
    const Settings settings = settings_of(request.options, prepared);
    const Plan plan = checked_plan(request, prepared.scene, settings);
    check_picture(request, settings, plan);
    const Options &options = request.options;
    MapFile map;
    if (!options.map_in.empty()) load_or_reset_map(request, request.frames.first, prepared, settings, plan, map);

    const auto print_arena = [&] {
        print_stage("arena", true, plan.bytes.arena, std::string("all of it, in ") + core(options.arithmetic).name);
        print_stage("picture", !options.batches, picture_bytes(options, settings),
                    std::to_string(settings.crop.x1 - settings.crop.x0) + " x " +
                        std::to_string(settings.crop.y1 - settings.crop.y0) + " pixels, beside the arena");
        print_notes(options, prepared);
    };
    if (plan.surfaces) print_surface_stages(request, prepared.scene, plan);
    if (plan.surfaces && !plan.smoke) {
        print_stage("smoke", false, 0, "there is none: no particle tree, photon or march");
        print_arena();
        return exit_done;
    }
    uint64_t particles = 0;
    for (const auto &smoke : prepared.particles) particles += smoke.size();
    bool black = true;
    for (const SmokeDescription &smoke : prepared.smokes)
        if (smoke.albedo.x > 0 || smoke.albedo.y > 0 || smoke.albedo.z > 0) black = false;
    const std::string why_no_photons = !plan.smoke             ? "there is no smoke"
                                       : black                 ? "the albedo is 0: nothing scatters"
                                       : settings.photons == 0 ? "--photons 0"
                                                               : "nothing lights the smoke";
    uint64_t samples = 0;
    for (const SmokeDescription &smoke : prepared.smokes) samples += smoke.grid.count();
    const std::string density = (particles ? std::to_string(particles) + " particles" : std::string()) +
                                (particles && samples ? ", " : "") +
                                (samples ? std::to_string(samples) + " samples of grids" : std::string());
    if (plan.bricks > 0)
        print_stage("bricks", true, plan.bytes.particle_tree,
                    density + " resampled to " + std::to_string(plan.bricks) + " bricks of 8 x 8 x 8 cells");
    else
        print_stage("particle tree", plan.smoke, plan.bytes.particle_tree,
                    plan.smoke ? density : "there are no particles");
    if (settings.reference) {
        print_stage("majorants", plan.smoke,
                    plan.bytes.arena - plan.bytes.particle_tree - plan.bytes.triangle_trees - plan.bytes.shadows -
                        plan.bytes.light_cuts,
                    plan.smoke ? "bounds of the density, for free paths" : "there is no smoke");
        print_stage("paths", true, 0,
                    std::to_string(uint64_t{settings.last_pass - settings.first_pass} * settings.samples) + " a pixel");
    } else if (settings.method == Method::map) {
        std::string origin = " photons to emit";
        if (options.batches) {
            const auto &[first, last] = *options.batches;
            origin += ", of them batches " + std::to_string(first) + ":" + std::to_string(last);
        }
        if (!options.map_in.empty()) origin = " photons of " + numbered(options.map_in, request.frames.first);
        const std::string where = plan.bricks > 0 ? ", kept at the bricks' nodes: " : ", kept on the particles: ";
        const std::string packed = plan.bricks > 0          ? ""
                                   : plan.photon_directions ? ": packed to 8 bytes each"
                                                            : ": packed to 4 bytes each";
        print_stage("particle map", plan.photons, plan.bytes.particle_map,
                    !plan.photons ? why_no_photons
                                  : std::to_string(settings.photons) + origin + where +
                                        (plan.photon_powers ? "power in R G B" : "one power (all are equal)") +
                                        (!plan.photon_directions                 ? ", no flux (isotropic)"
                                         : settings.direction == Direction::mean ? ", mean direction"
                                         : plan.photon_harmonics                   ? ", flux and moments of directions"
                                                                                 : ", flux") +
                                        packed);
        if (settings.estimate == Estimate::knn)
            print_stage("gather", plan.photons, plan.bytes.gather,
                        plan.photons ? "up to " + std::to_string(settings.gather) + " nearest particles"
                                     : "there are no photons");
        else if (plan.bricks == 0)
            print_stage("sources", plan.smoke, plan.bytes.sources,
                        plan.smoke ? "what each sends to the eye" : "there is no smoke");
    } else {
        print_stage("photons", plan.photons, plan.bytes.photon_map,
                    !plan.photons ? why_no_photons
                                  : std::to_string(settings.photons) + " to emit, at most " +
                                        std::to_string(plan.photon_capacity) + " stored: positions" +
                                        (plan.photon_directions ? ", directions" : ", no directions (isotropic)") +
                                        (plan.photon_powers ? ", powers" : ", no powers (all are equal)"));
        print_stage("gather", plan.photons, plan.bytes.gather,
                    plan.photons ? "up to " + std::to_string(settings.gather) + " nearest photons"
                                 : "there are no photons");
    }
    if (!settings.reference) {
        const bool irradiance = settings.irradiance != IrradianceMap::none;
        print_stage("irradiance", plan.bytes.irradiance > 0, plan.bytes.irradiance,
                    plan.bytes.irradiance > 0 ? "at most, and what making it takes; bricks around smoke"
                    : irradiance              ? "nothing scatters twice"
                                              : "--irradiance none: estimated at every step");
        print_stage("light depths", plan.bytes.light_depths > 0, plan.bytes.light_depths,
                    plan.bytes.light_depths > 0 ? "at most; around smoke"
                    : settings.light_step > 0   ? "no light is scattered by any smoke"
                                                : "--light-step 0: every depth is found exactly");
        print_stage("march", plan.smoke, 0,
                    !plan.smoke     ? "rays see the background alone"
                    : plan.surfaces ? "all rays through the smoke, up to what they hit"
                                    : "camera rays through the smoke");
    }
    if (options.lights == LightChoice::cuts && !plan.surfaces)
        print_stage("light cuts", false, 0, "of no use: there is no surface");
    print_arena();
    if (request.options.verbose)
        for (const std::string &line : particle_report(prepared, core(request.options.arithmetic)))
            std::printf("%s\n", line.c_str());
    return exit_done;
}

} // namespace wisp
