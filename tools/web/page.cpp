// What tools/web/page.html calls in WebAssembly: it renders scenes that are compiled in, and inspects their pixels.
// Strings and numbers stay valid until the next call.
#include "host/base/double3_algebra.h"
#include "host/base/json_object.h"
#include "host/base/renderers.h"
#include "host/commands/inspection.h"
#include "portability/compiled_scenes.h"
#include "core/numbers/self_test.h"
#include "wisp/settings.h"
#include <new>

namespace wisp {

namespace {

extern "C" __attribute__((import_module("page"), import_name("progress"))) void page_progress(int group, double done,
                                                                                              double total);
// The page shows the group of a stage, as Plan has it.
Observer observer_of(const Plan &plan) {
    return {const_cast<Plan *>(&plan), [](void *plan, Stage stage, uint64_t done, uint64_t total) {
                page_progress(static_cast<int>((*static_cast<const Plan *>(plan))[stage].group),
                              static_cast<double>(done), static_cast<double>(total));
                return true;
            }};
}

// The last picture, with its photons, which a turned camera or another march reuses.
struct Picture {
    int arithmetic = 0;
    const CompiledScene *compiled = nullptr;
    int32_t width = 0, height = 0;
    Scene scene = {};
    Settings settings = {};
    std::vector<float> rgb;
    std::vector<int64_t> map;
    uint64_t map_count = 0;
} picture;
std::string text, json;

// About the core's origin: the middle of the smoke or, without smoke, of the surfaces.
void turn(Camera &camera, Double3 axis, double degrees) {
    for (Double3 *v : {&camera.origin, &camera.corner, &camera.right, &camera.down}) *v = rotate(*v, axis, degrees);
}

// nullptr, or why there is no picture.
const char *render(const Settings &settings, float *rgb, const PixelTrace *trace) {
    const Renderer &renderer = renderer_of(static_cast<Arithmetic>(picture.arithmetic));
    const Plan plan = renderer.plan(picture.scene, settings);
    const bool mapped = settings.method == Method::map;
    if (mapped && settings.photons > plan.max_photons) return "more photons than the sums of the particle map can hold";
    if (plan.arena_bytes > uint64_t{1} << 31) return "that needs more than 2 GiB";
    const std::unique_ptr<unsigned char[]> block(
        new (std::nothrow) unsigned char[static_cast<size_t>(plan.arena_bytes)]);
    if (!block) return "there is not enough memory";
    Arena arena(block.get(), static_cast<size_t>(plan.arena_bytes));
    if (picture.map_count == 0) picture.map.resize(static_cast<size_t>(plan.map_sums));
    PhotonSums sums = {picture.map.data(), picture.map.size(), picture.map_count};
    Statistics statistics = {};
    Job job = {picture.scene, settings, arena, statistics, observer_of(plan), rgb};
    if (mapped) job.photons = &sums;
    constexpr decltype(&f32::inspect) inspectors[] = {f32::inspect, f64::inspect, fixed::inspect};
    const Status status = trace ? inspectors[picture.arithmetic](job, *trace) : renderer.render(job);
    picture.map_count = status == Status::done && mapped ? sums.count : 0;
    if (status == Status::overflow) return "photons collide so often that the particle map's sums might overflow";
    return status == Status::done ? nullptr : "the core has not rendered";
}

} // namespace

} // namespace wisp

using namespace wisp;

#define PAGE(name) extern "C" __attribute__((export_name(#name)))

// Why this machine cannot give the right bits, or nullptr.
PAGE(page_fault) const char *page_fault() { return arithmetic_fault(); }

PAGE(page_scenes) const char *page_scenes() {
    json.clear();
    for (const CompiledScene *s : scenes)
        json += (json.empty() ? "[" : ", ") + Object()
                                                  .add("name", quoted(s->name))
                                                  .add("width", std::to_string(s->width))
                                                  .add("height", std::to_string(s->height))
                                                  .add("photons", std::to_string(s->settings.photons))
                                                  .add("step", exact(s->settings.step))
                                                  .add_flag("smoke", s->scene.smoke_count > 0)
                                                  .text();
    json += "]";
    return json.c_str();
}

// Renders a scene, its camera turned by `yaw` and `pitch` degrees, `size` times as many pixels each way. Photons and
// step are those of the scene where they are below 0. Returns nullptr, or what is wrong.
PAGE(page_render)
const char *page_render(int arithmetic, int scene, double photons, double step, double yaw, double pitch, int size) {
    const CompiledScene *const compiled = scenes[scene];
    Settings settings = compiled->settings;
    settings.photons = static_cast<uint64_t>(photons);
    settings.step = step;
    const bool same_photons = picture.compiled == compiled && picture.arithmetic == arithmetic &&
                              picture.settings.photons == settings.photons;
    if (!same_photons) picture.map_count = 0;
    picture.arithmetic = arithmetic;
    picture.compiled = compiled;
    picture.width = compiled->width * size;
    picture.height = compiled->height * size;
    picture.scene = compiled->scene;
    Camera &camera = picture.scene.camera;
    turn(camera, compiled->scene.camera.down, yaw);
    turn(camera, camera.right, pitch);
    camera.right = camera.right * (1.0 / size);
    camera.down = camera.down * (1.0 / size);
    settings.crop = {0, 0, picture.width, picture.height};
    picture.settings = settings;
    picture.rgb.assign(static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height) * 3, 0);
    return render(settings, picture.rgb.data(), nullptr);
}

// Linear radiances, top row first: rows come as the observer says.
PAGE(page_picture) const float *page_picture() { return picture.rgb.data(); }

PAGE(page_digest) const char *page_digest() {
    text = digest_of_picture(picture.rgb.data(), picture.width, picture.height).text;
    return text.c_str();
}

// Inspects a pixel of the picture. Afterwards page_text() and page_json() are those of `wisp inspect`. Returns nullptr,
// or what is wrong.
PAGE(page_inspect) const char *page_inspect(int x, int y) {
    Inspection inspection;
    inspection.scene = picture.compiled->name;
    inspection.arithmetic = renderer_of(static_cast<Arithmetic>(picture.arithmetic)).name;
    inspection.frame = picture.compiled->frame;
    inspection.x = x;
    inspection.y = y;
    inspection.width = picture.width;
    inspection.height = picture.height;
    inspection.center = picture.compiled->center;
    inspection.scale = picture.compiled->scale;
    inspection.radiance_exponent = picture.scene.radiance_exponent;
    Settings settings = picture.settings;
    settings.crop = {x, y, x + 1, y + 1};
    float rgb[3];
    const PixelTrace trace = inspection.trace();
    if (const char *fault = render(settings, rgb, &trace)) return fault;
    text = inspection_text(inspection);
    json = inspection_json(inspection);
    return nullptr;
}
PAGE(page_text) const char *page_text() { return text.c_str(); }
PAGE(page_json) const char *page_json() { return json.c_str(); }
