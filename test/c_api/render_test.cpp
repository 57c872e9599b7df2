// Pictures through the C interface: those of the core, what is refused, what is kept from frame to frame.
#include "c_api/frame.h"
#include "host/base/sha256.h"
#include "host/images/picture.h"
#include "support/c_scene.h"
#include "wisp/wisp.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>

using namespace wisp;

namespace {

// What the core makes of the frame with the settings that the C interface has by default.
std::vector<float> rendered_by_core(const Renderer &renderer, const wisp_frame &frame) {
    Settings settings = {};
    settings.crop = {0, 0, static_cast<int32_t>(frame.width), static_cast<int32_t>(frame.height)};
    settings.samples = 4;
    settings.depth = 10;
    settings.shadows = ShadowMethod::exact;
    settings.photons = 2000;
    settings.seed = 1;
    settings.gather = 500;
    settings.gather_radius = 2;
    settings.method = Method::map;
    settings.irradiance = IrradianceMap::uniform;
    settings.density_step = settings.light_step = 0.5;
    settings.step = settings.irradiance_step = 1;
    const Plan plan = renderer.plan(frame.scene, settings);
    std::vector<unsigned char> block(static_cast<size_t>(plan.arena_bytes));
    Arena arena(block.data(), block.size());
    Statistics statistics;
    std::vector<float> rgb(size_t{3} * frame.width * frame.height);
    Job job = {frame.scene, settings, arena, statistics};
    job.rgb = rgb.data();
    REQUIRE(renderer.render(job) == Status::done);
    return rgb;
}

bool same_bits(const std::vector<float> &a, const std::vector<float> &b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

} // namespace

TEST_CASE("c_api: the picture of a frame is the core's in each arithmetic, and its digest that of the .pfm") {
    CScene from;
    const CFrame frame(from.scene);
    const Renderer *renderers[] = {&f32::renderer, &f64::renderer, &fixed::renderer};
    std::vector<std::vector<float>> pictures;
    for (int32_t arithmetic : {WISP_F32, WISP_F64, WISP_FIXED}) {
        CPicture picture;
        picture.settings.arithmetic = arithmetic;
        REQUIRE_MESSAGE(picture.render(frame.frame) == WISP_DONE, picture.error.text);
        CHECK(std::string(picture.error.text) == "");
        CHECK(same_bits(picture.rgb, rendered_by_core(*renderers[arithmetic], *frame.frame)));
        for (const float x : picture.rgb) CHECK(x >= 0);
        char digest[65];
        wisp_digest(picture.rgb.data(), 12, 9, digest);
        const Bytes pfm = pfm_bytes({12, 9, picture.rgb});
        CHECK(std::string(digest) == sha256(pfm.data(), pfm.size()).text);
        CHECK(picture.counter("rays", "primary") == 12 * 9 * 4);
        CHECK(picture.counter("smoke", "particles") == 40);
        CHECK(picture.counter("photons", "emitted") == 2000);
        CHECK(picture.counter("bytes", "arena_size") == picture.plan.bytes);
        pictures.push_back(picture.rgb);
    }
    CHECK(!same_bits(pictures[0], pictures[1]));
    CHECK(!same_bits(pictures[1], pictures[2]));
}

TEST_CASE("c_api: the plan says what memory is for, and a byte fewer is refused before the picture is touched") {
    CScene from;
    const CFrame frame(from.scene);
    CPicture picture;
    REQUIRE(picture.render(frame.frame) == WISP_DONE);
    uint64_t sum = 0;
    CHECK(picture.plan.stage_count == stage_count);
    for (uint32_t i = 0; i < picture.plan.stage_count; ++i) {
        const wisp_stage &stage = picture.plan.stages[i];
        CHECK(std::string(stage.name) != "");
        CHECK(std::string(stage.reason) != "");
        CHECK((stage.needed || stage.bytes == 0));
        sum += stage.bytes;
    }
    CHECK(sum == picture.plan.bytes);
    picture.rgb.assign(picture.rgb.size(), -1);
    picture.job.memory_bytes = static_cast<size_t>(picture.plan.bytes) - 1;
    CHECK(wisp_render(frame.frame, &picture.settings, &picture.job, &picture.error) == WISP_NO_MEMORY);
    CHECK(std::string(picture.error.text) == "job.memory: found " + std::to_string(picture.plan.bytes - 1) +
                                                 " bytes, expected " + std::to_string(picture.plan.bytes));
    for (const float x : picture.rgb) CHECK(x == -1);
}

TEST_CASE("c_api: layers of a crop add up to its pixels of the whole picture") {
    CScene from;
    const CFrame frame(from.scene);
    CPicture whole, part;
    REQUIRE(whole.render(frame.frame) == WISP_DONE);
    CHECK(whole.plan.layer_count == 0);
    CHECK(whole.plan.plane_count == 0);
    part.settings.layers = 1;
    const uint32_t crop[] = {3, 2, 9, 8};
    std::memcpy(part.settings.crop, crop, sizeof crop);
    REQUIRE_MESSAGE(part.render(frame.frame) == WISP_DONE, part.error.text);
    CHECK(part.plan.width == 6);
    CHECK(part.plan.height == 6);
    uint32_t planes = 0;
    std::vector<std::string> names;
    for (uint32_t i = 0; i < part.plan.layer_count; ++i) {
        names.push_back(part.plan.layers[i].name);
        planes += part.plan.layers[i].channels;
    }
    CHECK(planes == part.plan.plane_count);
    CHECK(names == std::vector<std::string>{"single", "multiple", "surfaces", "background", "direct", "albedo",
                                            "normal", "depth", "alpha", "shadow", "visits"}); // nothing glows
    const auto plane = [&part](uint32_t i, uint32_t pixel) { return part.layers[i * 36 + pixel]; };
    for (uint32_t y = 0; y < 6; ++y)
        for (uint32_t x = 0; x < 6; ++x)
            for (uint32_t c = 0; c < 3; ++c) {
                const uint32_t pixel = y * 6 + x;
                const float value = part.rgb[3 * pixel + c];
                CHECK(value == whole.rgb[3 * ((y + 2) * 12 + x + 3) + c]);
                CHECK(value == plane(c, pixel) + plane(3 + c, pixel) + plane(6 + c, pixel) + plane(9 + c, pixel));
            }
}

TEST_CASE("c_api: settings that are wrong or exclude each other are refused with a line") {
    CScene from;
    const CFrame frame(from.scene);
    struct Case {
        const char *line;
        void (*spoil)(wisp_settings &s);
    };
    const Case cases[] = {
        {"settings.version: found 0, expected 1", [](wisp_settings &s) { s.version = 0; }},
        {"settings.arithmetic: found 3, expected 0 to 2", [](wisp_settings &s) { s.arithmetic = 3; }},
        {"settings.arithmetic: found -1, expected 0 to 2", [](wisp_settings &s) { s.arithmetic = -1; }},
        {"settings.samples: found 0, expected 1 to 65536", [](wisp_settings &s) { s.samples = 0; }},
        {"settings.seed: found 18446744073709551615, expected below 2^63",
         [](wisp_settings &s) { s.seed = UINT64_MAX; }},
        {"settings.photons: found 9223372036854775808", [](wisp_settings &s) { s.photons = uint64_t{1} << 63; }},
        {"photons: found 9223372036854775807, expected at most ", [](wisp_settings &s) { s.photons = INT64_MAX; }},
        {"settings.method", [](wisp_settings &s) { s.method = 3; }},
        {"settings.irradiance", [](wisp_settings &s) { s.irradiance = 3; }},
        {"settings.estimate", [](wisp_settings &s) { s.estimate = 2; }},
        {"settings.deposit", [](wisp_settings &s) { s.deposit = 4; }},
        {"settings.direction", [](wisp_settings &s) { s.direction = 2; }},
        {"settings.gather: found 1, expected 2", [](wisp_settings &s) { s.gather = 1; }},
        {"settings.gather_radius", [](wisp_settings &s) { s.gather_radius = std::nan(""); }},
        {"settings.step", [](wisp_settings &s) { s.step = 0; }},
        {"settings.density_step", [](wisp_settings &s) { s.density_step = 0.001; }},
        {"settings.light_step", [](wisp_settings &s) { s.light_step = -1; }},
        {"settings.irradiance_step", [](wisp_settings &s) { s.irradiance_step = 1001; }},
        {"settings.depth", [](wisp_settings &s) { s.depth = 65; }},
        {"settings.shadows", [](wisp_settings &s) { s.shadows = 7; }},
        {"settings.lights", [](wisp_settings &s) { s.lights = 2; }},
        {"settings.tree", [](wisp_settings &s) { s.tree = 2; }},
        {"settings.layers", [](wisp_settings &s) { s.layers = 2; }},
        {"settings.crop: found 0,0,13,9", [](wisp_settings &s) { s.crop[2] = 13, s.crop[3] = 9; }},
        {"settings.crop: found 5,0,5,9", [](wisp_settings &s) { s.crop[0] = s.crop[2] = 5, s.crop[3] = 9; }},
        {"settings.crop: found one with paper", [](wisp_settings &s) { s.crop[2] = s.crop[3] = 5, s.shadows = 2; }},
        {"settings.density_step: found 0, expected cells",
         [](wisp_settings &s) { s.method = WISP_METHOD_VOLUME, s.density_step = 0; }},
        {"settings.irradiance: found a map, expected none", [](wisp_settings &s) { s.estimate = WISP_ESTIMATE_KNN; }},
        {"settings.density_step: found resampled smoke", [](wisp_settings &s) { s.deposit = WISP_DEPOSIT_PATH; }},
        {"settings.irradiance: found none, expected a map beside surfaces",
         [](wisp_settings &s) { s.irradiance = WISP_IRRADIANCE_NONE, s.density_step = 0; }},
    };
    for (const Case &c : cases) {
        CPicture picture;
        c.spoil(picture.settings);
        CHECK(picture.render(frame.frame) == WISP_WRONG_USAGE);
        const std::string line = picture.error.text;
        CHECK_MESSAGE(line.rfind(c.line, 0) == 0, line);
        CHECK(line.find("expected") != std::string::npos);
        CHECK(wisp_render(frame.frame, &picture.settings, &picture.job, nullptr) == WISP_WRONG_USAGE);
    }
    const wisp_settings settings = wisp_default_settings();
    wisp_plan plan;
    const wisp_job job = {};
    CHECK(wisp_plan_frame(nullptr, &settings, &plan, nullptr) == WISP_WRONG_USAGE);
    CHECK(wisp_plan_frame(frame.frame, nullptr, &plan, nullptr) == WISP_WRONG_USAGE);
    CHECK(wisp_plan_frame(frame.frame, &settings, nullptr, nullptr) == WISP_WRONG_USAGE);
    CHECK(wisp_render(nullptr, &settings, &job, nullptr) == WISP_WRONG_USAGE);
    CHECK(wisp_render(frame.frame, &settings, nullptr, nullptr) == WISP_WRONG_USAGE);
    CHECK(wisp_render(frame.frame, &settings, &job, nullptr) == WISP_WRONG_USAGE); // no picture
    CPicture picture;
    REQUIRE(picture.render(frame.frame) == WISP_DONE);
    picture.settings.layers = 1; // no planes
    CHECK(wisp_render(frame.frame, &picture.settings, &picture.job, nullptr) == WISP_WRONG_USAGE);
    char digest[65] = "x";
    wisp_digest(nullptr, 1, 1, digest);
    CHECK(std::string(digest) == "");
}

TEST_CASE("c_api: what the arithmetic cannot hold is refused, with the smoke where it is") {
    CScene from;
    from.smokes[0].phase = 1 - 1e-9;
    const CFrame frame(from.scene);
    REQUIRE(frame.status == WISP_DONE);
    CPicture picture;
    CHECK(picture.render(frame.frame) == WISP_BAD_SCENE);
    CHECK(std::string(picture.error.text) ==
          "smokes[0]: the phase is nearer to 1 or -1 than this arithmetic can tell, expected one that fits");
    picture.settings.arithmetic = WISP_F64;
    CHECK_MESSAGE(picture.render(frame.frame) == WISP_DONE, picture.error.text);
    CScene far;
    far.lights[0].position[0] = 1e9;
    const CFrame far_frame(far.scene);
    CHECK(picture.render(far_frame.frame) == WISP_BAD_SCENE);
    CHECK(std::string(picture.error.text) ==
          "scene: a light is too far from the surfaces; a parallel light has no distance, expected one that fits");
    // Fixed point has less room for smoke beside surfaces.
    CScene coarse;
    std::vector<double> radii(40, 0.2);
    radii[7] = 600;
    coarse.smokes[0].radii = {radii.data(), WISP_FLOAT64, 0, 0};
    coarse.smokes[0].radius = 0;
    const CFrame coarse_frame(coarse.scene);
    REQUIRE_MESSAGE(coarse_frame.status == WISP_DONE, coarse_frame.error.text);
    picture.settings.arithmetic = WISP_FIXED;
    CHECK(picture.render(coarse_frame.frame) == WISP_BAD_SCENE);
    CHECK(std::string(picture.error.text) ==
          "smokes[0]: a smoothing length is too coarse for fixed point beside the surfaces, expected one that fits");
}

TEST_CASE("c_api: progress names each stage that runs, and stops the work") {
    CScene from;
    const CFrame frame(from.scene);
    struct Seen {
        std::vector<std::string> stages;
        std::string stop_at;
    } seen;
    CPicture picture;
    picture.job.context = &seen;
    picture.job.progress = [](void *context, const char *stage, uint64_t done, uint64_t total) {
        Seen &of = *static_cast<Seen *>(context);
        CHECK(done <= total);
        if (of.stages.empty() || of.stages.back() != stage) of.stages.push_back(stage);
        return of.stop_at == stage ? 7 : 0;
    };
    REQUIRE(picture.render(frame.frame) == WISP_DONE);
    const std::vector<float> rgb = picture.rgb;
    std::vector<std::string> needed;
    for (uint32_t i = 0; i < picture.plan.stage_count; ++i)
        if (picture.plan.stages[i].needed) needed.push_back(picture.plan.stages[i].name);
    for (const std::string &stage : seen.stages)
        CHECK_MESSAGE(std::find(needed.begin(), needed.end(), stage) != needed.end(), stage);
    CHECK(seen.stages.back() == "camera rays");
    for (const std::string &stage : std::vector<std::string>(seen.stages)) {
        seen.stop_at = stage;
        CHECK(picture.render(frame.frame) == WISP_STOPPED);
        CHECK(std::string(picture.error.text) == "stopped by the caller");
        CHECK(seen.stages.back() == stage);
    }
    seen.stop_at = "";
    REQUIRE(picture.render(frame.frame) == WISP_DONE); // nothing is left of those that were stopped
    CHECK(same_bits(picture.rgb, rgb));
}

TEST_CASE("c_api: with a cache the pictures of a sequence are the same, and less is proved and built") {
    CScene from;
    CPicture kept;
    wisp_cache cache = {};
    kept.job.cache = &cache;
    std::vector<unsigned char> memory(wisp_prepared_bytes(&from.scene));
    kept.memory.resize(1 << 24);
    uint64_t proofs = 0;
    const auto step = [&](int i, bool fresh) {
        CAPTURE(i);
        wisp_frame *frame;
        REQUIRE(wisp_prepare(&from.scene, memory.data(), memory.size(), &frame, nullptr) == WISP_DONE);
        REQUIRE_MESSAGE(kept.render(frame) == WISP_DONE, kept.error.text);
        const CFrame alone(from.scene);
        CPicture picture;
        picture.settings = kept.settings;
        REQUIRE(picture.render(alone.frame) == WISP_DONE);
        CHECK(same_bits(kept.rgb, picture.rgb));
        const uint64_t now = kept.counter("shadow", "proof_node_visits");
        const bool anew = now == picture.counter("shadow", "proof_node_visits");
        CHECK(anew == fresh);
        proofs += now;
    };
    step(0, true);
    from.meshes[1].transform[9] += 0.25; // what moves
    step(1, false);
    from.folding[1] = 0.25; // what deforms
    from.scene.camera.from[0] = 1;
    step(2, false);
    from.lights[1].color[0] = 2; // the lights: all that was proved is of others
    step(3, true);
    from.positions[5] += 0.125f; // the smoke
    step(4, false);
    CHECK(proofs > 0);
    // What does not fit is made anew: other shapes, materials, settings.
    from.ground[1] = 0.125;
    step(5, true);
    from.corners[1] = 0.125;
    step(6, true);
    from.materials[0].diffuse[1] = 0.75;
    step(7, true);
    kept.settings.tree = WISP_TREE_KD;
    step(8, true);
    kept.settings.arithmetic = WISP_FIXED;
    step(9, true);
    from.smokes[0].count = 39; // arrays of the smoke end elsewhere
    step(10, false);
    kept.memory.resize(kept.memory.size() + 64);
    step(11, true);
}

TEST_CASE("c_api: the version of the interface and of the pictures") {
    CHECK(wisp_c_api_version() == WISP_C_API_VERSION);
    CHECK(wisp_default_settings().version == WISP_C_API_VERSION);
    CHECK(std::string(wisp_version()).size() > 2);
}
