// Settings, plan and picture of a frame.
#include "c_api/frame.h"
#include "c_api/refusal.h"
#include "c_api/settings.h"
#include "core/numbers/random.h"
#include "core/numbers/self_test.h"
#include "core/smoke/grid_samples.h"
#include "host/base/renderers.h"
#include "host/base/version.h"
#include "host/images/layer_words.h"
#include "host/images/picture_digest.h"
#include "host/prepare/core_units.h"
#include "host/results/counters.h"
#include "wisp/wisp.h"
#include <cstring>

namespace wisp::c_api {

namespace {

// ---- What is kept from frame to frame

// A fingerprint of 64 bits.
class Hash {
  public:
    template <class Number> void add(const Number &number) {
        uint64_t word = 0;
        static_assert(sizeof number <= sizeof word, "one word at a time");
        std::memcpy(&word, &number, sizeof number);
        const Event mixed = photon_event(word, hash_);
        hash_ = uint64_t{mixed.high} << 32 | mixed.low;
    }
    void add(const Double3 &v) { add(v.x), add(v.y), add(v.z); }
    uint64_t value() const { return hash_; }

  private:
    uint64_t hash_ = 0;
};

// Of what must be the same for anything to be kept: where the memory and the frame are, the triangles that stand still,
// those of instances in their own space, and materials. The core looks at the settings itself.
uint64_t hash_of_shapes(const wisp_frame &frame, const wisp_job &job) {
    const Scene &scene = frame.scene;
    Hash hash;
    hash.add(job.memory), hash.add(job.memory_bytes), hash.add(scene.triangles), hash.add(scene.instances);
    hash.add(frame.width), hash.add(frame.height), hash.add(scene.light_count);
    hash.add(scene.static_count), hash.add(scene.instance_triangle_count), hash.add(scene.deforming_count);
    for (uint32_t i = 0; i < scene.static_count + scene.instance_triangle_count; ++i) {
        const Triangle &triangle = scene.triangles[i];
        for (const Double3 &corner : triangle.corner) hash.add(corner);
        for (const Double3 &normal : triangle.normal) hash.add(normal);
        hash.add(triangle.material);
    }
    for (uint32_t i = 0; i < scene.instance_count; ++i) hash.add(scene.instances[i].count);
    for (uint32_t i = 0; i < scene.material_count; ++i) {
        const Material &m = scene.materials[i];
        hash.add(m.ambient), hash.add(m.diffuse), hash.add(m.specular);
        hash.add(m.shininess), hash.add(m.transmission), hash.add(m.index);
    }
    return hash.value();
}

// Of smoke and lights.
uint64_t hash_of_smoke(const Scene &scene) {
    Hash hash;
    hash.add(scene.radiance_exponent), hash.add(scene.light_count), hash.add(scene.smoke_count);
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        const LightSource &light = scene.lights[i];
        hash.add(light.kind), hash.add(light.position), hash.add(light.direction);
        hash.add(light.one_minus_cosine), hash.add(light.color);
    }
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        const GridDescription &grid = smoke.grid;
        hash.add(smoke.particles), hash.add(smoke.count), hash.add(smoke.kernel), hash.add(smoke.albedo);
        hash.add(smoke.asymmetry), hash.add(smoke.emission);
        for (const Particle *p = smoke.particles; p < smoke.particles + smoke.count; ++p)
            hash.add(p->position), hash.add(p->h), hash.add(p->area);
        hash.add(grid.nx), hash.add(grid.ny), hash.add(grid.nz), hash.add(grid.density), hash.add(grid.extinction);
        hash.add(grid.center), hash.add(grid.half);
        for (uint64_t k = 0; grid.density && k < samples_of_box(grid); ++k) hash.add(grid.density[k]);
    }
    return hash.value();
}

// wisp_cache::words.
enum Word { word_frame, word_shapes, word_smoke };

// The core's cache of what is left of the frames before, where it fits this one. The words become this frame's.
FrameCache take_cache(const wisp_frame &frame, const wisp_job &job) {
    FrameCache cache = {};
    if (!job.cache) return cache;
    uint64_t *words = job.cache->words;
    const uint64_t shapes = hash_of_shapes(frame, job), smoke = hash_of_smoke(frame.scene);
    if (words[word_shapes] == shapes) {
        cache.frame = reinterpret_cast<CachedFrame *>(static_cast<uintptr_t>(words[word_frame]));
        cache.same_smoke = words[word_smoke] == smoke;
    }
    words[word_shapes] = shapes;
    words[word_smoke] = smoke;
    return cache;
}

// ---- The plan

// Everything that is to be refused of a frame's settings, and the core's plan.
wisp_status plan_of(const wisp_frame *frame, const wisp_settings *settings, Settings &of_core, Plan &plan,
                    wisp_error *error) {
    if (!frame) return refuse(error, WISP_WRONG_USAGE, "frame: found NULL, expected one of wisp_prepare()");
    if (const wisp_status status = read_settings(settings, *frame, of_core, error)) return status;
    if (const char *fault = arithmetic_fault())
        return refuse(error, WISP_WRONG_USAGE, "this process does not compute as wisp needs it: ", fault,
                      "; a library in it that is built for 'fast math' may have switched the processor's mode");
    const RangeFault fault = find_range_fault(frame->scene, static_cast<Arithmetic>(settings->arithmetic),
                                              of_core.gather_radius, of_core.lights);
    if (fault.what && fault.smoke >= 0)
        return refuse(error, WISP_BAD_SCENE, "smokes[", static_cast<uint64_t>(fault.smoke), "]: ", fault.what,
                      ", expected one that fits");
    if (fault.what) return refuse(error, WISP_BAD_SCENE, "scene: ", fault.what, ", expected one that fits");
    plan = renderer_of(static_cast<Arithmetic>(settings->arithmetic)).plan(frame->scene, of_core);
    if (of_core.method == Method::map && plan.photons && of_core.photons > plan.max_photons)
        return refuse(error, WISP_WRONG_USAGE, "photons: found ", of_core.photons, ", expected at most ",
                      plan.max_photons, ", which the particle map's sums can hold");
    return WISP_DONE;
}

void count(const Statistics &statistics, wisp_statistics &to) {
    static_assert(sizeof counters / sizeof *counters <= WISP_MOST_COUNTERS, "there is room for all");
    to = {};
    for (const Counter &counter : counters)
        to.counters[to.count++] = {counter.group, counter.name, counter.value(statistics)};
}

struct Progress {
    const wisp_job &job;
    const Plan &plan;
};

bool on_progress(void *context, Stage stage, uint64_t done, uint64_t total) {
    const Progress &progress = *static_cast<const Progress *>(context);
    return progress.job.progress(progress.job.context, progress.plan[stage].name, done, total) == 0;
}

wisp_status status_of(Status status, wisp_error *error) {
    switch (status) {
    case Status::done: return WISP_DONE;
    case Status::stopped: return refuse(error, WISP_STOPPED, "stopped by the caller");
    case Status::overflow:
        return refuse(error, WISP_WRONG_USAGE,
                      "photons: they collide so often that the particle map's sums might "
                      "overflow, expected fewer, or thinner smoke");
    case Status::out_of_memory:
    case Status::missing_part: // the library has all
    case Status::size_mismatch: break;
    }
    return refuse(error, WISP_NO_MEMORY, "memory: the plan's bytes do not suffice");
}

} // namespace

} // namespace wisp::c_api

using namespace wisp;
using namespace wisp::c_api;

uint32_t wisp_c_api_version(void) { return WISP_C_API_VERSION; }
const char *wisp_version(void) { return version; }

wisp_status wisp_plan_frame(const wisp_frame *frame, const wisp_settings *settings, wisp_plan *plan,
                            wisp_error *error) {
    static_assert(stage_count <= WISP_MOST_STAGES && layer_count <= WISP_MOST_LAYERS, "there is room for all");
    if (!plan) return refuse(error, WISP_WRONG_USAGE, "plan: found NULL, expected where to put it");
    *plan = {};
    Settings of_core;
    Plan found;
    if (const wisp_status status = plan_of(frame, settings, of_core, found, error)) return status;
    plan->bytes = found.arena_bytes;
    plan->width = static_cast<uint32_t>(of_core.crop.width());
    plan->height = static_cast<uint32_t>(of_core.crop.height());
    plan->stage_count = stage_count;
    for (uint32_t i = 0; i < stage_count; ++i) {
        const PlanRow &row = found.rows[i];
        plan->stages[i] = {row.name, row.room, row.reason, row.needed, row.bytes};
    }
    plan->plane_count = planes_of(found.layers);
    for (uint32_t i = 0; i < layer_count; ++i)
        if (has_layer(found.layers, static_cast<Layer>(i)))
            plan->layers[plan->layer_count++] = {layer_words[i], channels_of(static_cast<Layer>(i))};
    return done(error);
}

wisp_status wisp_render(const wisp_frame *frame, const wisp_settings *settings, const wisp_job *job,
                        wisp_error *error) {
    if (!job) return refuse(error, WISP_WRONG_USAGE, "job: found NULL, expected a wisp_job");
    Settings of_core;
    Plan plan;
    if (const wisp_status status = plan_of(frame, settings, of_core, plan, error)) return status;
    if (!job->rgb) return refuse(error, WISP_WRONG_USAGE, "job.rgb: found NULL, expected room for the picture");
    if (of_core.layers != (job->layers != nullptr))
        return refuse(error, WISP_WRONG_USAGE, "job.layers: expected planes with wisp_settings::layers, and only then");
    if (!job->memory)
        return refuse(error, WISP_NO_MEMORY, "job.memory: found NULL, expected ", plan.arena_bytes, " bytes");
    if (job->memory_bytes < plan.arena_bytes)
        return refuse(error, WISP_NO_MEMORY, "job.memory: found ", uint64_t{job->memory_bytes}, " bytes, expected ",
                      plan.arena_bytes);
    Arena arena(job->memory, job->memory_bytes);
    FrameCache cache = take_cache(*frame, *job);
    Statistics statistics;
    Progress progress = {*job, plan};
    Job of_frame = {frame->scene, of_core, arena, statistics};
    if (job->progress) of_frame.observer = {&progress, on_progress};
    of_frame.rgb = job->rgb;
    of_frame.layers = job->layers;
    of_frame.cache = job->cache ? &cache : nullptr;
    const Status status = renderer_of(static_cast<Arithmetic>(settings->arithmetic)).render(of_frame);
    if (job->cache) job->cache->words[word_frame] = reinterpret_cast<uintptr_t>(cache.frame);
    if (job->statistics) count(statistics, *job->statistics);
    if (status == Status::done) return done(error);
    return status_of(status, error);
}

void wisp_digest(const float *rgb, uint32_t width, uint32_t height, char digest[65]) {
    digest[0] = 0;
    constexpr uint32_t most = 1000000;
    if (!rgb || width < 1 || width > most || height < 1 || height > most) return;
    std::memcpy(digest, digest_of_picture(rgb, static_cast<int32_t>(width), static_cast<int32_t>(height)).text, 65);
}
