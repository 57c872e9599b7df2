#include "core/numbers/sample_sums.h"
#include "core/photons/direction_limits.h"
#include "core/render/kept_at_nodes.h"
#include "host/base/double3_algebra.h"
#include "host/base/text.h"
#include "host/commands/defaults.h"
#include "host/commands/run_warnings.h"
#include "host/prepare/extinction.h"
#include "host/prepare/scene_warnings.h"
#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

// Why an option is idle; empty: it is not.
using Reason = std::string;

Reason unless(bool used, const char *reason) { return used ? "" : reason; }

// Options of one stage: they are idle where it is not needed.
constexpr struct {
    const char *option;
    Stage stage;
} options_of_stages[] = {
    {"smoke", Stage::march},           {"step", Stage::march},
    {"photons", Stage::photons},       {"deposit", Stage::photons},
    {"direction", Stage::photons},     {"estimate", Stage::photons},
    {"remap", Stage::photons},         {"gather", Stage::gather},
    {"gather-radius", Stage::gather},  {"light-step", Stage::light_depths},
    {"irradiance", Stage::irradiance}, {"irradiance-step", Stage::irradiance},
    {"shadows", Stage::shadows},       {"lights", Stage::light_cuts},
    {"depth", Stage::shading},         {"tree", Stage::triangle_trees},
};

class Idle {
  public:
    Idle(const Request &request, const PreparedScene &prepared, const Settings &settings, const Plan &plan)
        : request_(request), options_(request.options), prepared_(prepared), settings_(settings), plan_(plan) {}

    Reason of(const std::string &option) const {
        if (switches_off(option)) return "";
        for (const auto &row : options_of_stages)
            if (option == row.option && !plan_[row.stage].needed) return plan_[row.stage].reason;
        if (option == "seed") // of photons, and of the reference's paths
            return unless(plan_[Stage::photons].needed || plan_[Stage::majorants].needed, plan_[Stage::photons].reason);
        if (option == "density-step") return of_resampling();
        if (option == "deposit" || option == "direction" ||
            (option == "estimate" && settings_.estimate == Estimate::kernel))
            return unless(settings_.method == Method::map, "photons are kept, not power on particles");
        if (option == "remap") return unless(several_frames(request_), "there is one frame, and no map before it");
        if (option == "max-error") return unless(plan_.smoke, "there is no smoke");
        if (option == "thin") return unless(has_particles(prepared_.scene), "there are no particles");
        if (option == "exposure") return unless(writes_png() || !makes_picture(), "no .png is written");
        if (option == "frames")
            return unless(!several_frames(request_) || moves(), "nothing differs from frame to frame");
        return "";
    }

  private:
    // What is given so that a stage is not needed does something, as do photons whose place paths take.
    bool switches_off(const std::string &option) const {
        return (option == "photons" && settings_.photons == 0) || (option == "photons" && settings_.paths > 0) ||
               (option == "irradiance" && settings_.irradiance == IrradianceMap::none) ||
               (option == "light-step" && settings_.light_step == 0) ||
               (option == "density-step" && settings_.density_step == 0) ||
               (option == "lights" && settings_.lights == LightChoice::all) ||
               (option == "thin" && options_.decimate == 0) || (option == "exposure" && options_.exposure == 0);
    }
    Reason of_resampling() const {
        if (plan_.bricks > 0) return "";
        const PlanRow &bricks = plan_[Stage::bricks];
        return bricks.needed || settings_.goal != Goal::picture ? "densities are exact" : bricks.reason;
    }
    bool makes_picture() const { return !options_.outputs.empty() || options_.digest; } // plan and inspect do not
    bool writes_png() const {
        return std::any_of(options_.outputs.begin(), options_.outputs.end(),
                           [](const std::string &output) { return ends_in(output, ".png"); });
    }
    bool moves() const {
        const auto &smokes = request_.file.smokes;
        return request_.file.animation || std::any_of(smokes.begin(), smokes.end(), [](const auto &smoke) {
                   return has_number(smoke.file) && smoke.frame_step != 0;
               });
    }

    const Request &request_;
    const Options &options_;
    const PreparedScene &prepared_;
    const Settings &settings_;
    const Plan &plan_;
};

// Options of the command line that change nothing of what is made, or are taken for others.
std::vector<Warning> idle_options(const Request &request, const PreparedScene &prepared, const Settings &settings,
                                  const Plan &plan) {
    std::vector<Warning> warnings;
    if (settings.goal == Goal::photons) return warnings; // their pictures are made elsewhere, with the same options
    const Idle idle(request, prepared, settings, plan);
    for (const std::string &option : request.given) {
        const Reason reason = idle.of(option);
        if (!reason.empty())
            warnings.push_back({"option " + option, "", "option '" + option + "' does nothing here: " + reason});
    }
    const double asked = settings.density_step, cell = cell_of_bricks(prepared.scene, asked);
    if (is_given(request, "density-step") && plan.bricks > 0 && cell != asked)
        warnings.push_back({"option density-step", "",
                            "option 'density-step': found " + six_digits(asked) + ", taken for " + six_digits(cell) +
                                ": the cells of a density grid are 1, 0.5, 0.25 or 0.125 samples"});
    return warnings;
}

// Of a ball of that volume; at most `widest`.
double ball_radius(double volume, double widest) {
    double low = 0, high = widest;
    for (int i = 0; i < 50; ++i) {
        const double middle = 0.5 * (low + high);
        (volume_of_unit_ball * middle * middle * middle < volume ? low : high) = middle;
    }
    return high;
}

// What the nearest photons' estimate depends on, in smoothing lengths of the finest smoke: the mean radius of their
// ball, if photons were spread evenly over all smoke, and the mean free path in the densest; and how many photons the
// largest ball would hold.
struct Gather {
    double radius, free_path, most;
};
Gather gather_of(const Scene &scene, const Settings &settings, uint64_t photons) {
    const SmokeDensity density = density_of(scene);
    double widest = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        if (!scene.smokes[i].empty()) widest = std::max(widest, settings.gather_radius * scene.smokes[i].largest_h);
    const double of_photon = density.volume / static_cast<double>(std::max<uint64_t>(photons, 1));
    return {ball_radius(of_photon * settings.gather, widest) / density.length, 1 / density.mean_depth,
            volume_of_unit_ball * widest * widest * widest / of_photon};
}

double greatest_albedo(const Scene &scene) {
    double most = 0;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        if (!smoke.empty()) most = std::max({most, smoke.albedo.x, smoke.albedo.y, smoke.albedo.z});
    }
    return most;
}

// Relative RMSE. Of a ball of 400 particles (extinction 0.3 to 40, 20,000 to 1,000,000 photons, the nearest 500),
// fixtures/demo.aff and small.aff it was 0.4 to 1.1 times this from 0.1 on, and the mean a third of it too bright. Boxes
// had 0.6 to 0.9 times it, without an irradiance map too dark; with one, which allows for their faces, 0.3 to 1.
double error_of_gather(const Gather &gather, const Scene &scene, const Settings &settings) {
    const double part = has_particles(scene) ? 1 : settings.irradiance == IrradianceMap::none ? 0.5 : 0.25;
    return part * greatest_albedo(scene) * std::min(gather.radius, gather.radius / gather.free_path);
}

// The root mean square noise of a picture relative to its mean, where its values have variances of that sum.
double relative_noise(double sum_of_variances, const Picture &picture) {
    double sum = 0;
    for (float value : picture.rgb) sum += static_cast<double>(value);
    return sum > 0 ? std::sqrt(sum_of_variances * static_cast<double>(picture.rgb.size())) / sum : 0;
}

// By random paths in place of photons. The mean of n paths from a ray has the variance
// (sum of their squares - n mean^2) / (n (n - 1)), as their sample variance has no bias. Of one path the square alone is
// known, which is more.
double noise_of_paths(const Scene &scene, const Settings &settings, const Statistics &statistics,
                      const Picture &picture) {
    const double n = settings.paths, each = to_double(statistics.paths.each.square),
                 of_rays = to_double(statistics.paths.of_rays.square),
                 of_means = n > 1 ? std::max(0.0, each - n * of_rays) / (n * (n - 1)) : each,
                 unit = scale_pow2(1.0, scene.radiance_exponent - 32) / settings.samples;
    return relative_noise(of_means * unit * unit, picture);
}

// By photons at nodes, at most: the rays of a pixel see the same nodes.
double noise_of_photons(const Scene &scene, const Settings &settings, const Statistics &statistics,
                        const Picture &picture) {
    const double unit = scale_pow2(1.0, 2 * scene.radiance_exponent - 32) / settings.samples;
    return relative_noise(to_double(statistics.photons.variance) * unit, picture);
}

// The largest factor between two particles' smoothing lengths in one smoke.
double unlike_lengths(const Scene &scene) {
    double most = 1;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        if (!smoke.empty() && !smoke.is_grid()) most = std::max(most, smoke.largest_h / smoke.smallest_h);
    }
    return most;
}

std::string percent(double error) { // rounded up
    return std::to_string(1 + static_cast<int>(99.99 * std::min(error, 1.0))) + " %";
}

bool scatters_much(const Scene &scene) { return greatest_albedo(scene) >= 0.5; }

// Of the options that were given, those that keep wisp from choosing finer cells, or paths in place of photons.
std::string options_of_cells(const Request &request, const Scene &scene) {
    std::string list = request.options.method.value_or(Method::map) != Method::map ? "--smoke" : "";
    const auto add = [&](const char *option) {
        if (is_given(request, option)) list += (list.empty() ? "--" : ", --") + std::string(option);
    };
    if (can_resample(scene)) add("density-step");
    for (const char *option :
         {"irradiance-step", "irradiance", "deposit", "direction", "estimate", "map-in", "map-out", "batches"})
        add(option);
    return list;
}

} // namespace

// The limits hold for the random smokes of tools/measure/random_smoke.py.
void RunWarnings::of_light(const PreparedScene &prepared, const Settings &settings, const Plan &plan) {
    const Scene &scene = prepared.scene;
    // What returns along a ray from a lamp at its start, as 1 / distance^2, has no limit. Distances to lights count as
    // 2^-10 at least.
    const bool at_eye = greatest_albedo(scene) > 0 && holds_light_at_eye(scene, 0x1p-10);
    if (at_eye)
        print({"light at the eye", "",
               "no picture of this is right: a light in the smoke stands in the eye, and what is scattered back from "
               "next to it has no limit; a little way off it has"});
    if (!plan.photons || !scatters_much(scene)) return;
    if (request_.options.max_error) return; // the error is estimated, and was said
    const bool map = settings.method == Method::map; // of_photons() warns of the others' light
    PhotonCells cells = {0, 1, 0};
    if (map) cells = photon_cells(scene, density_of(scene), settings);
    const double error_of_cells = cells.fit() ? 0 : cells.error();
    const std::string options = options_of_cells(request_, scene);
    const double of_flux = error_of_flux(scene, settings, plan);
    const std::string otherwise = options.empty()
                                      ? "; as many paths instead would be noisier, and --max-error E bounds all errors"
                                      : "; without " + options + " wisp chooses what errs by less";
    if (!keeps_light_at_nodes(scene, settings) && stands_in_smoke(scene)) // else there are cut cells
        print({"surfaces in smoke", "",
               "light that is scattered more than once passes through the surfaces in the smoke here, as far as its "
               "estimate reaches" +
                   (options.empty() ? "; --reference stops it there" : "; without " + options + " it stops there")});
    // Light of a lamp at the eye is spread over cells that lie behind it. A box of g = 0.5 is 9 % too dark, one lit by
    // a spot 5 %, a ball of particles 2.5 %; for g = 0 the peak around a point light leaves 0.4 %.
    if (!at_eye && holds_light_at_eye(scene, width_of_photon_cells(scene, settings)))
        print({"light at the eye", "",
               "light that is scattered more than once is likely up to 10 % too dark here: a light in the smoke is as "
               "near to the eye as photons tell places apart; --reference is right there"});
    // A ball of particles before a point light: the root mean square is 3 to 4 % of the mean at 0.9, 7 to 10 at 0.95,
    // 80 at 0.98.
    const double phase = most_forward(scene);
    if (takes_peaks_off(scene, settings, plan) && phase > 0.93 && shows_light_through_smoke(prepared))
        print({"narrow peak", "",
               "pixels around a light that is seen through the smoke are likely 10 % wrong or more: a phase of " +
                   six_digits(phase) + " scatters light by less than photons tell; --reference is right there"});
    if (map && scatters_far_backward(scene))
        print({"backward", "",
               "light that is scattered more than once is likely 50 % wrong here, or more: where the phase is below "
               "-0.6 photons do not tell whence it comes" +
                   (options.empty() ? "" : "; without " + options + " it is not")});
    else if (of_flux > error_of_cells)
        print({"directions", "",
               "light that is scattered more than once is likely up to " + percent(of_flux) +
                   " wrong here: beside mirrors and glass, in smoke of several phases, and in smoke that is not "
                   "resampled, photons tell whence light comes by a mean direction or a few numbers, of all channels "
                   "together, which is too little for this phase" +
                   otherwise});
    else if (error_of_cells > 0)
        print({"photon cells", "",
               "light that is scattered more than once is likely up to " + percent(error_of_cells) +
                   " wrong here: photons leave it in places that are up to " + two_digits(cells.depth) +
                   " mean free paths wide" + otherwise});
}

void RunWarnings::of_photons(const Scene &scene, const Settings &settings, const Plan &plan,
                             const Statistics &statistics) {
    if (!plan.photons || !scatters_much(scene)) return;
    const auto &photons = statistics.photons;
    // The noise of what is scattered more than once, relative to all light. Thin smoke has little of that.
    const double noise = std::sqrt(static_cast<double>(photons.stored) + 1) /
                         static_cast<double>(std::max<uint64_t>(photons.collisions, 1));
    // Photons that start in the smoke miss it only where surfaces keep all light off.
    const bool start_in_smoke = is_resampled(scene, settings) && keeps_light_at_nodes(scene, settings);
    const bool asks_otherwise = settings.method != Method::map || is_given(request_, "deposit");
    if (!start_in_smoke && noise > 0.02 && photons.collisions < photons.emitted / 100 &&
        density_of(scene).mean_depth > 0.02)
        print({"few photons", "",
               "light that is scattered more than once is noise here: of " + std::to_string(photons.emitted) +
                   " photons " + std::to_string(photons.collisions) +
                   " met the smoke, as they fly into the ball around each smoke; " +
                   (can_resample(scene) && asks_otherwise ? "--smoke map without --deposit starts them in the smoke"
                                                          : "--reference has no such photons")});
    if (!plan[Stage::gather].needed || settings.method == Method::map) return;
    const std::string method = std::string("--smoke ") + (settings.method == Method::direct ? "direct" : "volume");
    // 300 particles in a ball, 200,000 photons: 14 % too bright where all radii are alike, 18, 34, 70 and 100 % where
    // they differ by factors of 2, 4, 8 and 16.
    const double unlike = unlike_lengths(scene);
    if (unlike > 3 && photons.stored > photons.collisions / 10)
        return print({"nearest photons", "",
                      method + " is likely 30 % wrong here, or more: smoothing lengths differ by a factor of " +
                          two_digits(unlike) +
                          ", and the nearest photons are those in the smallest; --smoke map errs by less"});
    const Gather gather = gather_of(scene, settings, statistics.photons.stored);
    if (is_given(request_, "gather-radius") && gather.most < 10)
        return print(
            {"few nearest photons", "",
             "light that is scattered more than once is noise or missing here: within --gather-radius there are "
             "about " +
                 two_digits(gather.most) + " photons; more --photons or a larger --gather-radius find more"});
    const double error = error_of_gather(gather, scene, settings);
    if (error < 0.1) return;
    print({"nearest photons", "",
           method + " is likely up to " + percent(error) + " wrong here: the nearest " +
               std::to_string(settings.gather) + " photons reach " + two_digits(gather.radius) +
               " smoothing lengths, " + two_digits(gather.radius / gather.free_path) +
               " mean free paths; more --photons or a smaller --gather bring it nearer to --reference, as does --smoke "
               "map"});
}

void RunWarnings::of_noise(const Scene &scene, const Settings &settings, const Statistics &statistics,
                           const Picture &picture) {
    if (request_.options.max_error) return; // the error is estimated, and was said
    const bool paths = settings.paths > 0;
    const double noise = paths ? noise_of_paths(scene, settings, statistics, picture)
                               : noise_of_photons(scene, settings, statistics, picture);
    if (!(noise > 0.05)) return;
    print({paths ? "few paths" : "noise of photons", "",
           "the picture is likely up to " + percent(noise) + " wrong here, by noise" +
               (paths ? ": " + std::to_string(settings.paths) + " random paths from each ray take the place of photons"
                      : " of " + std::to_string(settings.photons) + " photons") +
               "; four times the --photons halve that"});
}

void RunWarnings::of_radiances(const Statistics &statistics) {
    if (statistics.rays.saturated == 0) return;
    print(
        {"saturated", request_.name,
         "fixed point has cut off the radiance of " + std::to_string(statistics.rays.saturated) +
             " rays, as between mirrors that send more light than they receive: the picture is too dark there; --arith "
             "f32 or f64 hold it, or a smaller --depth"});
}

void RunWarnings::of_frame(int64_t frame, const PreparedScene &prepared, const Settings &settings, const Plan &plan) {
    for (const Warning &warning : scene_warnings(request_.name, request_.file, request_.options, frame, prepared))
        print(warning);
    // A ball of particles, against --reference: 4, 9, 12 and 22 % in cells of 1, 1.5, 2 and 3.
    if (plan.bricks > 0 && has_particles(prepared.scene) && settings.density_step > 1 && !request_.options.max_error)
        print({"density cells", "",
               "the picture is likely up to " +
                   std::to_string(static_cast<int>(std::min(8 * settings.density_step, 100.0))) +
                   " % wrong: --density-step " + two_digits(settings.density_step) +
                   " keeps the particles' density in cells wider than a smoothing length; 0.5 errs by less than 1 %"});
    std::vector<Warning> idle = idle_options(request_, prepared, settings, plan);
    const auto is_old = [this](const Warning &warning) {
        return !idle_ ||
               std::any_of(idle_->begin(), idle_->end(), [&](const Warning &old) { return old.kind == warning.kind; });
    };
    idle.erase(std::partition(idle.begin(), idle.end(), is_old), idle.end());
    idle_ = std::move(idle);
    if (frame + request_.frames.step <= request_.frames.last) return;
    for (const Warning &warning : *idle_) print(warning);
}

} // namespace wisp
