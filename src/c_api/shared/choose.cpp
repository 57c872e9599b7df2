// What `wisp render` chooses of the settings. It takes heap, so it is in the shared library alone.
#include "c_api/frame.h"
#include "c_api/refusal.h"
#include "c_api/settings.h"
#include "host/base/error.h"
#include "host/commands/defaults.h"
#include <algorithm>
#include <new>

using namespace wisp;
using namespace wisp::c_api;

namespace {

// A setting that is not left open.
template <class Enumeration> std::optional<Enumeration> given(int32_t word) {
    return word < 0 ? std::nullopt : std::optional(static_cast<Enumeration>(word));
}
std::optional<double> given(double number) { return number < 0 ? std::nullopt : std::optional(number); }

} // namespace

wisp_status wisp_choose_settings(const wisp_frame *frame, wisp_settings *settings, wisp_error *error) try {
    if (!frame) return refuse(error, WISP_WRONG_USAGE, "frame: found NULL, expected one of wisp_prepare()");
    if (!settings) return refuse(error, WISP_WRONG_USAGE, "settings: found NULL, expected wisp_settings");
    if (const wisp_status status = check_version("settings", settings->version, error)) return status;
    wisp_settings closed = *settings; // with anything in place of what is open
    const wisp_settings any = wisp_default_settings();
    for (const auto word :
         {&wisp_settings::method, &wisp_settings::irradiance, &wisp_settings::estimate, &wisp_settings::deposit})
        if (closed.*word < 0) closed.*word = any.*word;
    for (const auto step : {&wisp_settings::step, &wisp_settings::density_step, &wisp_settings::light_step,
                            &wisp_settings::irradiance_step})
        if (closed.*step < 0) closed.*step = any.*step;
    if (const wisp_status status = check_numbers(closed, error)) return status;

    Options options;
    options.method = given<Method>(settings->method);
    options.irradiance = given<IrradianceMap>(settings->irradiance);
    options.estimate = given<Estimate>(settings->estimate);
    options.deposit = given<Deposit>(settings->deposit);
    options.direction = static_cast<Direction>(settings->direction);
    options.step = given(settings->step);
    options.density_step = given(settings->density_step);
    options.light_step = given(settings->light_step);
    options.irradiance_step = given(settings->irradiance_step);
    Settings chosen = {};
    chosen.photons = settings->photons;
    chosen.samples = settings->samples;
    chosen.goal = Goal::picture;
    const uint64_t rays = uint64_t{frame->width} * frame->height * settings->samples;
    choose_defaults(options, frame->scene, paths_for(settings->photons, rays), chosen);
    settings->method = static_cast<int32_t>(chosen.method);
    settings->irradiance = static_cast<int32_t>(chosen.irradiance);
    settings->estimate = static_cast<int32_t>(chosen.estimate);
    settings->deposit = static_cast<int32_t>(chosen.deposit);
    settings->step = chosen.step;
    settings->density_step = chosen.density_step;
    settings->light_step = chosen.light_step;
    settings->irradiance_step = chosen.irradiance_step;
    settings->paths = chosen.paths;
    return done(error);
} catch (const Error &fault) {
    return refuse(error, WISP_WRONG_USAGE, fault.text.c_str());
} catch (const std::bad_alloc &) {
    return refuse(error, WISP_NO_MEMORY, "the choice of settings does not fit in memory");
}
