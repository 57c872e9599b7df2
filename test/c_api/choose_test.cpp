// What is left open of the settings is chosen to fit the smoke, and what is given stays. `make python-test` holds the
// pictures against those of the program, which chooses for itself.
#include "support/c_scene.h"
#include <cmath>
#include <doctest/doctest.h>
#include <vector>

using namespace wisp;

namespace {

wisp_settings open_settings() {
    wisp_settings settings = wisp_default_settings();
    settings.method = settings.irradiance = settings.estimate = settings.deposit = -1;
    settings.step = settings.density_step = settings.light_step = settings.irradiance_step = -1;
    return settings;
}

std::string refused(const wisp_frame *frame, const wisp_settings &given) {
    wisp_settings settings = given;
    wisp_error error;
    CHECK(wisp_choose_settings(frame, &settings, &error) == WISP_WRONG_USAGE);
    return error.text;
}

} // namespace

TEST_CASE("c_api: open settings are chosen by the smoke, and rendered") {
    CScene thin, dense;
    dense.smokes[0].extinction = 2;
    const CFrame thin_frame(thin.scene), dense_frame(dense.scene);
    wisp_settings of_thin = open_settings(), of_dense = open_settings();
    wisp_error error;
    REQUIRE(wisp_choose_settings(thin_frame.frame, &of_thin, &error) == WISP_DONE);
    REQUIRE(wisp_choose_settings(dense_frame.frame, &of_dense, &error) == WISP_DONE);
    CHECK(std::string(error.text) == "");
    CHECK(of_thin.method == WISP_METHOD_MAP);
    CHECK(of_thin.irradiance == WISP_IRRADIANCE_UNIFORM);
    CHECK(of_thin.density_step < 0.3); // the cells of 40 particles
    CHECK(of_thin.irradiance_step == of_thin.density_step); // few cells of many photons
    CHECK(of_thin.step == 0.55);
    CHECK(of_dense.density_step == 0.55 * 0.4);
    CHECK(of_dense.step == 2 * of_dense.density_step);
    CHECK(of_thin.photons == 1000000);
    CPicture picture;
    picture.settings = of_thin;
    picture.settings.photons = 2000;
    CHECK_MESSAGE(picture.render(thin_frame.frame) == WISP_DONE, picture.error.text);
}

TEST_CASE("c_api: few particles are resampled to finer cells, and one to the finest") {
    std::vector<float> positions;
    for (int z = 0; z < 20; ++z)
        for (int y = 0; y < 20; ++y)
            for (int x = 0; x < 20; ++x)
                for (int k : {x, y, z}) positions.push_back(static_cast<float>(k) * 0.25f);
    CScene from;
    from.smokes[0].positions.data = positions.data();
    from.smokes[0].extinction = 1e-4;
    double before = 0;
    for (const uint64_t count : {1, 20, 400, 8000}) {
        CAPTURE(count);
        from.smokes[0].count = count;
        const CFrame frame(from.scene);
        wisp_settings settings = open_settings();
        REQUIRE(wisp_choose_settings(frame.frame, &settings, nullptr) == WISP_DONE);
        CHECK(settings.density_step > before);
        before = settings.density_step;
        if (count == 1) CHECK(settings.density_step == 0.1);
    }
    CHECK(before == 0.55);
}

TEST_CASE("c_api: settings that are given stay, or are refused with the program's line") {
    CScene from;
    const CFrame frame(from.scene);
    wisp_settings settings = open_settings();
    settings.density_step = 0.25;
    settings.irradiance_step = 0.75;
    REQUIRE(wisp_choose_settings(frame.frame, &settings, nullptr) == WISP_DONE);
    CHECK(settings.density_step == 0.25);
    CHECK(settings.irradiance_step == 0.75);
    CHECK(settings.light_step == 0.25);
    settings = open_settings();
    settings.method = WISP_METHOD_VOLUME;
    settings.density_step = 0;
    CHECK(refused(frame.frame, settings) == "option 'density-step': found 0, expected cells with --smoke volume");
    settings = open_settings();
    settings.step = std::nan("");
    CHECK(refused(frame.frame, settings) == "settings.step: expected 0.0001 to 1000");
    settings = open_settings();
    settings.samples = 0;
    CHECK(refused(frame.frame, settings) == "settings.samples: found 0, expected 1 to 65536");
    settings.version = 9;
    CHECK(refused(frame.frame, settings).rfind("settings.version: found 9", 0) == 0);
    CHECK(refused(nullptr, settings).rfind("frame: found NULL", 0) == 0);
    CHECK(wisp_choose_settings(frame.frame, nullptr, nullptr) == WISP_WRONG_USAGE);
}
