#include "host/base/json_object.h"
#include "host/results/statistics_json.h"

namespace wisp {

namespace {

std::string frame_json(const FrameReport &report) {
    if (report.kept)
        return Object().add("frame", static_cast<uint64_t>(report.frame)).add("kept", std::string("true")).text();
    const Statistics &s = report.statistics;
    Object seconds, rays, shadow, photons, smoke, bytes;
    seconds.add("read", report.seconds.read).add("trees", report.seconds.trees).add("photons", report.seconds.photons);
    seconds.add("irradiance", report.seconds.irradiance)
        .add("render", report.seconds.render)
        .add("total", report.seconds.total);
    rays.add("primary", s.rays.primary).add("reflected", s.rays.reflected).add("refracted", s.rays.refracted);
    rays.add("shadow", s.rays.shadow);
    rays.add("shadow_culled", s.rays.shadow_culled).add("shadow_dynamic_only", s.rays.shadow_dynamic_only);
    shadow.add("node_visits", s.shadow.traced.node_visits).add("triangle_tests", s.shadow.traced.triangle_tests);
    shadow.add("extra_tests", s.shadow.extra_tests).add("proof_node_visits", s.shadow.proofs.node_visits);
    shadow.add("proof_triangle_tests", s.shadow.proofs.triangle_tests);
    if (s.shadow.checked) shadow.add("wrong_pixels", s.shadow.wrong_pixels);
    photons.add("emitted", s.photons.emitted).add("collisions", s.photons.collisions).add("stored", s.photons.stored);
    photons.add("absorbed", s.photons.absorbed).add("escaped", s.photons.escaped).add("blocked", s.photons.blocked);
    photons.add("unclaimed", s.photons.lost).add("capped", s.photons.capped);
    smoke.add("particles", s.smoke.particles).add("density_evaluations", s.smoke.density_evaluations);
    smoke.add("march_samples", s.smoke.march_samples).add("gathers", s.smoke.gathers).add("gathered", s.smoke.gathered);
    bytes.add("particle_tree", s.bytes.particle_tree)
        .add("photon_map", s.bytes.photon_map)
        .add("particle_map", s.bytes.particle_map);
    bytes.add("irradiance", s.bytes.irradiance)
        .add("triangle_trees", s.bytes.triangle_trees)
        .add("mode_words", s.bytes.mode_words);
    bytes.add("arena_peak", s.bytes.arena_peak).add("arena_size", s.bytes.arena_size);
    Object stages;
    for (uint32_t i = 0; i < stage_count; ++i)
        stages.add(report.plan.rows[i].name,
                   Object().add("planned", report.plan.rows[i].bytes).add("used", s.bytes.stages[i]));
    Object frame;
    frame.add("frame", static_cast<uint64_t>(report.frame)).add("seconds", seconds).add("rays", rays);
    frame.add("shadow", shadow).add("photons", photons).add("smoke", smoke).add("bytes", bytes).add("stages", stages);
    return frame.text();
}

} // namespace

std::string statistics_json(const RunReport &report) {
    std::string text = "{ \"wisp\": " + quoted(report.version) + ", \"arith\": " + quoted(report.arithmetic) +
                       ", \"digest\": " + quoted(report.digest) + ",\n  \"frames\": [";
    for (size_t i = 0; i < report.frames.size(); ++i) text += (i ? ",\n    " : "\n    ") + frame_json(report.frames[i]);
    return text + " ] }\n";
}

} // namespace wisp
