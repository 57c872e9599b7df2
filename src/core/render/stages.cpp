// The table of stages. Read it from top to bottom: it is the shape of the whole renderer.
#include "core/render/stages.h"
#include "core/numbers/double_bits.h"
#include <new>

namespace wisp::WISP_ARITH {

namespace {

using namespace stages;
using namespace parts;

constexpr const char *no_smoke = "there is no smoke", *no_surface = "there is no triangle",
                     *no_light = "there is no light", *photons_alone = "photons are traced, no picture is made",
                     *by_paths = "the reference follows random paths instead", *no_photons = "there are no photons",
                     *by_rays = "paths from rays instead";

// Whether the stage is needed: `reasons` are why not, the first that holds.
struct WhyNot {
    bool holds;
    const char *reason;
};
template <size_t n> Need need_unless(const WhyNot (&reasons)[n], const char *why) {
    for (const WhyNot &not_needed : reasons)
        if (not_needed.holds) return {false, not_needed.reason};
    return {true, why};
}

Need need_frame_cache(const Scene &, const Settings &, const Decisions &) {
    return {true, "what lives from frame to frame"};
}
uint64_t frame_cache_bytes(const Scene &, const Settings &, const Decisions &, const Sizes &) {
    return Arena::bytes<FrameState>(1) + Arena::bytes<Frame>(1);
}

Need need_triangle_trees(const Scene &, const Settings &, const Decisions &d) {
    return {d.surfaces, d.surfaces ? "rays meet triangles" : no_surface};
}
uint64_t triangle_tree_bytes(const Scene &scene, const Settings &settings, const Decisions &, const Sizes &) {
    return surface_bytes(scene, settings.tree) + placement_bytes(scene, settings.tree);
}

Need need_lights(const Scene &scene, const Settings &, const Decisions &) {
    return {scene.light_count > 0, scene.light_count > 0 ? "what shines" : no_light};
}
uint64_t light_bytes(const Scene &scene, const Settings &, const Decisions &, const Sizes &) {
    return Arena::bytes<Light>(scene.light_count);
}

Need need_shadows(const Scene &scene, const Settings &, const Decisions &d) {
    return need_unless({{!d.surfaces, no_surface}, {!d.shaded, photons_alone}, {scene.light_count == 0, no_light}},
                       "surfaces stand in the way of lights");
}
uint64_t shadow_technique_bytes(const Scene &scene, const Settings &settings, const Decisions &, const Sizes &) {
    return shadow_bytes(scene, settings);
}

Need need_light_cuts(const Scene &scene, const Settings &settings, const Decisions &d) {
    return need_unless({{settings.lights != LightChoice::cuts, "--lights all: every light is asked"},
                        {!d.surfaces, "of no use: there is no surface"},
                        {!d.shaded, photons_alone},
                        {scene.light_count == 0, no_light}},
                       "clusters of lights that err by less than 2 % are asked as one");
}
uint64_t light_cut_bytes(const Scene &scene, const Settings &, const Decisions &, const Sizes &) {
    return WISP_ARITH::light_cut_bytes(scene);
}

Need need_shading(const Scene &, const Settings &, const Decisions &d) {
    return need_unless({{!d.surfaces, no_surface}, {!d.shaded, photons_alone}}, "rays see triangles");
}
uint64_t shading_bytes(const Scene &scene, const Settings &settings, const Decisions &, const Sizes &) {
    return Arena::bytes<SurfaceMaterial>(scene.material_count) + ray_level_bytes(settings.depth);
}

Need need_particle_tree(const Scene &, const Settings &, const Decisions &d) {
    return need_unless({{!d.smoke, no_smoke}, {d.resampled, "the smoke is resampled to bricks"}},
                       "densities are exact");
}
uint64_t exact_density_bytes(const Scene &scene, const Settings &, const Decisions &, const Sizes &) {
    return medium_bytes(scene, 0);
}

Need need_bricks(const Scene &, const Settings &, const Decisions &d) {
    return need_unless(
        {{!d.smoke, no_smoke}, {!d.resampled && !d.march_grid, "densities are exact, and no field over them is kept"}},
        d.resampled ? "densities are resampled" : "fields over the smoke are kept at their nodes");
}
uint64_t brick_bytes(const Scene &scene, const Settings &settings, const Decisions &d, const Sizes &sizes) {
    return d.resampled ? medium_bytes(scene, settings.density_step) : sizes.grid.bytes;
}

Need need_light_depths(const Scene &scene, const Settings &settings, const Decisions &d) {
    return need_unless({{!d.smoke, no_smoke},
                        {d.goal == Goal::reference, by_paths},
                        {scene.light_count == 0, no_light},
                        {d.lights_in_smoke == 0, "no light is scattered by any smoke"},
                        {d.goal == Goal::photons && !d.light_depths, photons_alone},
                        {!d.light_depths && !(total_order_key(settings.light_step) > 0),
                         "--light-step 0: every depth is found exactly"}},
                       "depths to the lights are interpolated");
}
uint64_t light_depth_bytes(const Scene &, const Settings &, const Decisions &d, const Sizes &sizes) {
    return optical_depth_grid_bytes(sizes.grid.count, d.lights_in_smoke, d.spacing.light);
}

Need need_photons(const Scene &, const Settings &settings, const Decisions &d) {
    return need_unless({{!d.smoke, no_smoke},
                        {d.goal == Goal::reference, by_paths},
                        {!d.scatters, "the albedo is 0: nothing scatters"},
                        {settings.photons == 0, "--photons 0"},
                        {settings.paths > 0, by_rays},
                        {d.photons == PhotonStore::none, "nothing lights the smoke"}},
                       "light is scattered more than once");
}

Need need_gather(const Scene &, const Settings &, const Decisions &d) {
    return need_unless({{!d.smoke, no_smoke},
                        {d.goal == Goal::reference, by_paths},
                        {d.goal == Goal::photons, photons_alone},
                        {d.photons == PhotonStore::none, no_photons},
                        {!d.nearest, "no nearest photons are looked up"}},
                       "the nearest are looked up");
}

Need need_irradiance(const Scene &, const Settings &settings, const Decisions &d) {
    return need_unless({{!d.smoke, no_smoke},
                        {d.goal == Goal::reference, by_paths},
                        {d.goal == Goal::photons, photons_alone},
                        {d.scatters && settings.paths > 0, by_rays},
                        {d.photons == PhotonStore::none, "nothing scatters twice"},
                        {!d.irradiance, "--irradiance none: estimated at every step"}},
                       d.sweeps ? "kept at points around the smoke, and gathered along lines unless it is sparse"
                                : "estimates are kept at points around the smoke");
}
uint64_t irradiance_map_bytes(const Scene &scene, const Settings &, const Decisions &d, const Sizes &sizes) {
    const bool of_fluence = d.photons == PhotonStore::fluence_grid;
    const bool lines = d.sweeps && suits_lines(sizes.grid.places, sizes.grid.count);
    return irradiance_bytes(scene, sizes.grid.count, d.spacing.irradiance, d.photon_needs.directions, of_fluence,
                            of_fluence && d.photon_needs.harmonics, lines ? sizes.grid.of_line : 0);
}

Need need_sources(const Scene &, const Settings &, const Decisions &d) {
    return need_unless({{!d.smoke, no_smoke}, {d.march != MarchKind::particles, "rays do not add up particles"}},
                       "what each particle sends to the eye");
}
uint64_t source_bytes(const Scene &scene, const Settings &, const Decisions &, const Sizes &) {
    return WISP_ARITH::source_bytes(scene);
}

Need need_majorants(const Scene &, const Settings &, const Decisions &d) {
    return need_unless({{!d.smoke, no_smoke}, {d.march != MarchKind::paths && !d.paths, "no random path is followed"}},
                       "bounds of the density, for free paths");
}
uint64_t majorant_bytes(const Scene &scene, const Settings &, const Decisions &, const Sizes &) {
    return WISP_ARITH::majorant_bytes(scene);
}

Need need_march(const Scene &, const Settings &, const Decisions &d) {
    return need_unless(
        {{!d.smoke, no_smoke}, {d.goal == Goal::reference, by_paths}, {d.goal == Goal::photons, photons_alone}},
        d.surfaces ? "all rays through the smoke, up to what they hit" : "camera rays through the smoke");
}

Need need_layers(const Scene &, const Settings &settings, const Decisions &d) {
    return need_unless({{!settings.layers, "not asked for"}, {d.goal == Goal::photons, photons_alone}},
                       "what the picture consists of is kept apart");
}
uint64_t layer_bytes(const Scene &, const Settings &settings, const Decisions &, const Sizes &) {
    return WISP_ARITH::layer_bytes(settings.depth);
}

Need need_camera_rays(const Scene &, const Settings &, const Decisions &d) {
    return need_unless({{d.goal == Goal::photons, photons_alone}}, "the picture");
}

// The function, or nullptr in a program without the part.
using Bytes = uint64_t(const Scene &, const Settings &, const Decisions &, const Sizes &);
template <Part part> constexpr Bytes *only(Bytes *bytes) { return has(part) ? bytes : nullptr; }
using Work = Status(Frame &);
template <Part part> constexpr Work *only(Work *work) { return has(part) ? work : nullptr; }

} // namespace

// Each row: the stage and its name; the room of its method; its seconds; whether and why it is needed; its bytes; what
// it makes for the whole animation, while the smoke is the same, and for one frame.
// clang-format off
const StageRow stage_rows[stage_count] = {
    // What lives from frame to frame
    {Stage::frame_cache, "frame cache", "render", StageGroup::trees, need_frame_cache, frame_cache_bytes,
        {nullptr, nullptr, nullptr}},

    // Surfaces: trees, shadows, shading (C)
    {Stage::triangle_trees, "triangle trees", "surfaces", StageGroup::trees, need_triangle_trees,
        only<surfaces>(triangle_tree_bytes),
        {only<surfaces>(build_triangle_trees), nullptr, only<surfaces>(place_triangle_trees)}},
    {Stage::lights, "lights", "lights", StageGroup::trees, need_lights, light_bytes,
        {make_lights, nullptr, nullptr}},
    {Stage::shadows, "shadows", "shadows", StageGroup::trees, need_shadows, only<surfaces>(shadow_technique_bytes),
        {only<surfaces>(make_shadow_memory), nullptr, only<surfaces>(begin_shadows)}},
    {Stage::light_cuts, "light cuts", "lights", StageGroup::trees, need_light_cuts, only<light_cuts>(light_cut_bytes),
        {nullptr, nullptr, only<light_cuts>(build_light_cuts)}},
    {Stage::shading, "shading", "render", StageGroup::trees, need_shading, only<surfaces>(shading_bytes),
        {nullptr, nullptr, only<surfaces>(make_shading)}},

    // Density of the smoke (S3, S4-1), and its depths to the lights
    {Stage::particle_tree, "particle tree", "smoke", StageGroup::trees, need_particle_tree,
        only<any_smoke>(exact_density_bytes),
        {nullptr, only<any_smoke>(build_exact_density), nullptr}},
    {Stage::bricks, "bricks", "smoke", StageGroup::trees, need_bricks, only<any_smoke>(brick_bytes),
        {nullptr, only<any_smoke>(build_sparse_grid), nullptr}},
    {Stage::light_depths, "light depths", "lights", StageGroup::trees, need_light_depths,
        only<any_smoke>(light_depth_bytes),
        {nullptr, only<any_smoke>(find_light_depths), nullptr}},

    // Photons (S2), and how they are read (S4-2, S4-3, S4-4)
    {Stage::photons, "photons", "photons", StageGroup::photons, need_photons, only<any_photons>(photon_bytes),
        {nullptr, only<photons>(distribute_emission), only<any_photons>(trace_photons)}},
    {Stage::gather, "gather", "photons", StageGroup::render, need_gather, only<exact_photons>(stages::gather_bytes),
        {nullptr, nullptr, only<exact_photons>(stages::make_gather)}},
    {Stage::irradiance, "irradiance", "photons", StageGroup::irradiance, need_irradiance,
        only<any_photons>(irradiance_map_bytes),
        {nullptr, nullptr, only<any_photons>(stages::make_irradiance)}},
    {Stage::sources, "sources", "photons", StageGroup::render, need_sources, only<exact>(source_bytes),
        {nullptr, nullptr, only<exact>(stages::make_sources)}},

    // The picture (S1)
    {Stage::majorants, "majorants", "render", StageGroup::trees, need_majorants, only<paths>(majorant_bytes),
        {nullptr, nullptr, only<paths>(find_majorants)}},
    {Stage::march, "march", "march", StageGroup::render, need_march, only<any_smoke>(march_bytes),
        {nullptr, nullptr, only<any_smoke>(make_march)}},
    {Stage::layers, "layers", "render", StageGroup::render, need_layers, only<layers>(layer_bytes),
        {nullptr, nullptr, only<layers>(make_layers)}},
    {Stage::camera_rays, "camera rays", "render", StageGroup::render, need_camera_rays, nullptr,
        {nullptr, nullptr, trace_camera_rays}},
};
// clang-format on

namespace {

Sizes find_sizes(const Scene &scene, const Decisions &d) {
    Sizes sizes = {};
    if (d.resampled || d.march_grid) sizes.grid = plan_sparse_grid(scene, d.spacing.cell);
    return sizes;
}

PlanRow plan_row(const StageRow &row, const Scene &scene, const Settings &settings, const Decisions &d,
                 const Sizes &sizes) {
    const Need need = row.need(scene, settings, d);
    return {row.name,    row.room,    row.group,
            need.needed, need.reason, need.needed && row.bytes ? row.bytes(scene, settings, d, sizes) : 0};
}

} // namespace

Plan plan(const Scene &scene, const Settings &settings) {
    const Decisions d = decide(scene, settings);
    const Sizes sizes = find_sizes(scene, d);
    Plan plan = {};
    for (uint32_t i = 0; i < stage_count; ++i) {
        plan.rows[i] = plan_row(stage_rows[i], scene, settings, d, sizes);
        plan.arena_bytes += plan.rows[i].bytes;
    }
    plan.smoke = d.smoke;
    plan.surfaces = d.surfaces;
    plan.photons = d.photons != PhotonStore::none;
    plan.photon_directions = d.photon_needs.towards_eye   ? Plan::Directions::to_eye
                             : !d.photon_needs.directions ? Plan::Directions::none
                             : d.photons == PhotonStore::fluence_grid && d.photon_needs.harmonics
                                 ? Plan::Directions::harmonics
                                 : Plan::Directions::flux;
    plan.layers = d.layers;
    plan.missing = d.missing;
    plan.photon_powers = d.photon_needs.powers;
    plan.bricks = d.resampled ? sizes.grid.count : 0;
    if (has(parts::exact_photons) && d.photons == PhotonStore::photon_map)
        plan.photon_capacity = plan_photons(scene, settings).capacity;
    if (d.at_nodes) {
        plan.map_sums = sums_of_fluence(d.photon_needs, sizes.grid.count, d.spacing.irradiance);
        plan.max_photons = max_fluence_flights;
    } else if (has(parts::exact_photons) && d.particle_map) {
        plan.map_sums = plan_particle_map(scene, settings).sums;
        plan.max_photons = max_deposits(settings);
    }
    return plan;
}

namespace {

// Runs stages, and counts the bytes that each holds.
class Runner {
  public:
    Runner(Frame &frame, Stage last) : frame_(frame) {
        for (uint32_t i = 0; i <= static_cast<uint32_t>(last); ++i)
            needed_[i] = stage_rows[i].need(frame.scene, frame.settings, frame.decisions).needed;
    }

    // The stages that make something of this lifetime, in the order of the table, as far as they are needed.
    Status run(Lifetime lifetime) {
        for (const StageRow &row : stage_rows) {
            const auto work = lifetime == Lifetime::sequence ? row.run.sequence
                              : lifetime == Lifetime::smoke  ? row.run.smoke
                                                             : row.run.frame;
            if (!work) continue;
            uint64_t &bytes = used(lifetime, row.stage);
            bytes = 0;
            if (!needed_[static_cast<uint32_t>(row.stage)]) continue;
            if (!frame_.watch.begin(row.stage)) return Status::stopped;
            Arena &arena = frame_.arena;
            const size_t before = arena.mark();
            arena.begin_stage();
            const Status status = work(frame_);
            bytes = arena.stage_peak() - before;
            if (frame_.watch.stopped()) return Status::stopped; // what it has made is of no use
            if (status != Status::done) return status;
        }
        return Status::done;
    }

    // The bytes that a stage has held, of all lifetimes.
    uint64_t used(Stage stage) {
        return used(Lifetime::sequence, stage) + used(Lifetime::smoke, stage) + used(Lifetime::frame, stage);
    }

  private:
    uint64_t &used(Lifetime lifetime, Stage stage) {
        const uint32_t i = static_cast<uint32_t>(stage);
        return lifetime == Lifetime::frame ? of_frame_[i] : frame_.state.used[static_cast<uint32_t>(lifetime)][i];
    }

    Frame &frame_;
    bool needed_[stage_count] = {}; // and to be run
    uint64_t of_frame_[stage_count] = {};
};

// Whether what lives as long as the animation can be what was made before: by the same techniques, for a picture that
// was no larger, as what shadows may learn grows with it.
bool keeps_sequence(const FrameState &state, const Scene &scene, const Settings &settings) {
    const auto rays = [](const Settings &of) { return of.crop.pixels() * of.samples; };
    return state.renderer == &renderer && state.light_count == scene.light_count &&
           state.static_count == scene.static_count && state.settings.shadows == settings.shadows &&
           state.settings.tree == settings.tree && rays(state.settings) <= rays(settings);
}

// Whether the structures of the same smoke are the same by these settings.
bool keeps_smoke(const Settings &a, const Settings &b) {
    const auto same = [](double x, double y) { return total_order_key(x) == total_order_key(y); };
    return same(a.density_step, b.density_step) && same(a.light_step, b.light_step) &&
           same(a.irradiance_step, b.irradiance_step) && a.irradiance == b.irradiance && a.method == b.method &&
           a.deposit == b.deposit && a.direction == b.direction && a.estimate == b.estimate && a.photons == b.photons &&
           a.paths == b.paths && a.goal == b.goal;
}

// The state of the frames before, or a new one. nullptr: the arena was too small.
FrameState *find_state(const Job &job, FrameCache &cache, bool &made) {
    FrameState *state = static_cast<FrameState *>(cache.frame);
    made = !state || !keeps_sequence(*state, job.scene, job.settings);
    if (!made) return state;
    cache.frame = nullptr;
    const size_t before = job.arena.mark();
    state = job.arena.make<FrameState>(1);
    Frame *frame = job.arena.make<Frame>(1);
    if (!state || !frame) {
        job.arena.rewind(before);
        return nullptr;
    }
    *state = {};
    state->frame = frame;
    state->renderer = &renderer;
    state->light_count = job.scene.light_count;
    state->static_count = job.scene.static_count;
    state->settings = job.settings;
    state->used[0][static_cast<uint32_t>(Stage::frame_cache)] = job.arena.mark() - before;
    return state;
}

// What is kept of the frames before is this frame's: its lights, and its smoke's descriptions.
void refresh(Frame &frame, bool same_smoke) {
    for (uint32_t i = 0; i < frame.scene.light_count; ++i) frame.state.lights[i] = make_light(frame.scene.lights[i]);
    if (!frame.state.has_smoke || !same_smoke) return; // another smoke may have more descriptions than the kept one
    for (uint32_t i = 0; i < frame.scene.smoke_count; ++i)
        frame.state.smoke.medium.smokes[i].source = &frame.scene.smokes[i];
}

Status run_frame(Frame &frame, FrameCache &cache, bool made, Runner &runner) {
    FrameState &state = frame.state;
    Arena &arena = frame.arena;
    Status status;
    if (made) {
        status = runner.run(Lifetime::sequence);
        if (status != Status::done) return status;
        state.sequence_end = arena.mark();
        cache.frame = &state;
    } else {
        refresh(frame, cache.same_smoke);
    }
    arena.rewind(state.sequence_end);
    if (!state.has_smoke || !cache.same_smoke || !keeps_smoke(state.settings, frame.settings)) {
        state.has_smoke = false;
        state.smoke = {}; // nothing of another smoke is left, where this frame has none
        status = runner.run(Lifetime::smoke);
        if (status != Status::done) return status;
        state.has_smoke = frame.decisions.smoke;
        state.smoke_end = arena.mark();
        state.settings = frame.settings;
    }
    arena.rewind(state.smoke_end);
    // Sums that no stage will read would be lost without a word.
    if (frame.decisions.particle_map && frame.decisions.photons == PhotonStore::none && frame.job.photons &&
        frame.job.photons->count != 0)
        return Status::size_mismatch;
    status = runner.run(Lifetime::frame);
    if (status == Status::done && frame.shadows.scene) end_frame(frame.shadows);
    return status;
}

void count_bytes(const Frame &frame, Runner &runner) {
    Statistics &statistics = frame.statistics;
    auto &bytes = statistics.bytes;
    for (uint32_t i = 0; i < stage_count; ++i) bytes.stages[i] = runner.used(static_cast<Stage>(i));
    if (frame.job.photons && frame.decisions.photons != PhotonStore::none)
        bytes.stages[static_cast<uint32_t>(Stage::photons)] += frame.job.photons->count * sizeof(int64_t);
    bytes.particle_tree = runner.used(Stage::particle_tree) + runner.used(Stage::bricks);
    bytes.triangle_trees = runner.used(Stage::triangle_trees);
    bytes.mode_words = frame.settings.shadows == ShadowMethod::paper ? runner.used(Stage::shadows) : 0;
    bytes.arena_peak = frame.arena.peak();
}

#ifdef WISP_TRAP
// The test build ends where a stage has taken more than its row says, or anything although its row says no.
void check_rows(const Job &job, Runner &runner) {
    const Plan planned = plan(job.scene, job.settings);
    for (uint32_t i = 0; i < stage_count; ++i)
        if (runner.used(static_cast<Stage>(i)) > planned.rows[i].bytes) __builtin_trap();
}
#endif

} // namespace

Status run_stages(const Job &job, const Observation &observation) {
    const Decisions decisions = decide(job.scene, job.settings);
    if (decisions.missing) return Status::missing_part;
    FrameCache none = {}, &cache = job.cache ? *job.cache : none;
    job.statistics.bytes.arena_size = job.arena.size();
    const size_t before = job.arena.mark();
    bool made;
    FrameState *state = find_state(job, cache, made);
    if (!state) return Status::out_of_memory;
    Frame &frame = *new (state->frame) Frame{job, decisions, *state, observation.pixel, observation.flights};
    for (uint32_t i = 0; decisions.smoke && i < job.scene.smoke_count; ++i)
        job.statistics.smoke.particles += job.scene.smokes[i].count;
    Runner runner(frame, observation.last);
    Status status = run_frame(frame, cache, made, runner);
    if (status == Status::done && observation.on_frame) status = observation.on_frame(observation.context, frame);
    count_bytes(frame, runner);
    if (status != Status::done) { // something may be half made
        cache.frame = nullptr;
        job.arena.rewind(before);
    }
#ifdef WISP_TRAP
    check_rows(job, runner);
#endif
    return status;
}

namespace {

Status render(const Job &job) { return run_stages(job, {}); }

} // namespace

extern const Renderer renderer = {WISP_ARITH_NAME, plan, render};

} // namespace wisp::WISP_ARITH
