#include "host/base/double3_algebra.h"
#include "host/base/text.h"
#include "host/commands/file_facts.h"
#include "host/commands/memory_check.h"
#include "host/commands/plan_lines.h"
#include "host/commands/scene_facts.h"
#include "host/commands/show_stages.h"
#include "host/results/picture_bytes.h"

namespace wisp {

namespace {

void add_lights(Facts &facts, const std::vector<SceneFile::Light> &lights) {
    uint64_t counts[4] = {};
    for (const SceneFile::Light &light : lights) ++counts[static_cast<int>(light.kind)];
    std::string text;
    Object json;
    constexpr const char *kinds[] = {"point", "spot", "parallel", "constant"}; // by LightKind
    for (size_t i = 0; i < 4; ++i) {
        json.add(kinds[i], counts[i]);
        if (counts[i] > 0) text += (text.empty() ? "" : ", ") + std::to_string(counts[i]) + " " + kinds[i];
    }
    facts.add("lights", text.empty() ? "none" : text, json.text());
}

uint64_t triangles_of(const SceneGraph &graph) {
    uint64_t triangles = graph.deforming.size();
    for (const Mesh &mesh : graph.meshes) triangles += mesh.rows.size();
    return triangles;
}

// The file, or that it is a box.
Facts source_of(const SceneFile::SmokeVolume &smoke, int64_t frame) {
    Facts facts;
    return smoke.box ? facts.flag("box", true) : facts.word("file", smoke.path(frame));
}

std::vector<Facts> sources_of(const SceneFile &file, int64_t frame) {
    std::vector<Facts> sources;
    for (const SceneFile::SmokeVolume &smoke : file.smokes) sources.push_back(source_of(smoke, frame));
    return sources;
}

std::vector<Facts> smokes_of(const SceneFile &file, int64_t frame, const PreparedScene &prepared) {
    std::vector<Facts> smokes = sources_of(file, frame);
    const std::vector<SmokeExtent> extents = extents_of(prepared);
    for (size_t i = 0; i < smokes.size(); ++i) {
        const GridDescription &grid = prepared.smokes[i].grid;
        if (!prepared.smokes[i].is_grid()) {
            add_particles(smokes[i], prepared.particles[i], prepared.center, prepared.scale);
            continue;
        }
        if (grid.density) smokes[i].integers("cells", {grid.nx, grid.ny, grid.nz});
        smokes[i].point("low", extents[i].low * (1 / prepared.scale) + prepared.center);
        smokes[i].point("high", extents[i].high * (1 / prepared.scale) + prepared.center);
    }
    return smokes;
}

Facts rendering_of(const Request &request, const PreparedScene &prepared) {
    const Settings settings = settings_of(request.options, prepared);
    const Plan plan = checked_plan(request, prepared.scene, settings);
    Facts facts;
    facts.word("arith", renderer_of(request.options.arithmetic).name);
    facts.count("bytes", needed_bytes(settings, plan));
    Facts stages;
    for (const PlanLine &line : plan_lines(request, prepared, settings, plan))
        if (line.needed) stages.word(line.name.c_str(), line.reason);
    return facts.group("stages", stages);
}

} // namespace

void add_optical_depth(Facts &facts, Request request) {
    request.options.quiet = true;
    try {
        SingleFrame frame(request);
        frame.make_plan();
        Spread depths;
        if (frame.plan[Stage::march].needed)
            for (const double depth : optical_depths(request, frame))
                if (depth > 0) depths.add(depth);
        if (depths.any())
            facts.spread("optical_depth", depths);
        else
            facts.none("optical_depth", "no ray of the camera meets smoke");
    } catch (const Error &error) {
        if (error.status >= exit_signal) throw;
        facts.none("optical_depth", error.text);
    }
}

void add_scene_file(Facts &facts, const std::string &path) {
    const Request request = read_request({{path}, {}});
    check_options(request);
    const SceneFile &file = request.file;
    const int64_t frame = request.frames.first;
    std::optional<EndAtOnce> at_once;
    end_at_once(request, frame, at_once);
    facts.count("frames", static_cast<uint64_t>(frame_count_of(file, request.options)));
    facts.count("triangles", triangles_of(file.graph)).count("textures", file.graph.textures.size());
    add_lights(facts, file.lights);
    if (!file.view) {
        facts.none("size", "there is no view, statement 'v from ...'");
        facts.list("smokes", "smoke", sources_of(file, frame));
        return;
    }
    PreparedScene prepared;
    prepare_scene(request.name, file, request.options, frame, prepared);
    facts.integers("size", {prepared.width, prepared.height});
    facts.list("smokes", "smoke", smokes_of(file, frame, prepared));
    facts.group("rendering", rendering_of(request, prepared));
    if (prepared.scene.smoke_count > 0) add_optical_depth(facts, request);
}

} // namespace wisp
