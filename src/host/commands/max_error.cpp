#include "host/commands/max_error.h"
#include "core/smoke/resampling.h"
#include "host/base/json_object.h"
#include "host/base/messages.h"
#include "host/base/text.h"
#include "host/commands/defaults.h"
#include "host/commands/memory_check.h"
#include "host/commands/progress_meter.h"
#include "host/results/passes.h"
#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

// Pixels that are measured, about, and the share of the error asked for that their estimate may take: they are few.
constexpr double measured_pixels = 600, safe_share = 0.85;
// The same for random paths, a few of which are so bright that an estimate may miss them.
constexpr double safe_share_of_paths = 0.7;
constexpr uint64_t fewest_photons = uint64_t{1} << 12, first_photons = uint64_t{1} << 16,
                   most_photons = uint64_t{1} << 24;
constexpr uint64_t most_paths = uint64_t{1} << 14;
constexpr uint32_t first_passes = 64, first_checking_passes = 16, most_checking_passes = 128;
constexpr double most_passes = 0x1p30;
// The noise of a choice is measured by so many more seeds: by few where it is that of many independent numbers.
constexpr size_t most_seeds = 4, few_seeds = 2;
constexpr double many_numbers = 16;
// Of more photons than so many a quarter is measured: noise goes with their number.
constexpr uint64_t all_photons = uint64_t{1} << 20;
constexpr double small_share = 0.1;               // cells that take no more of the error are not measured again
constexpr double deviate_of_nine_in_ten = 1.2816; // of the standard normal distribution
// Cells are made finer up to so many times, where all stages then take no more memory.
constexpr int finest_level = 2;
constexpr uint64_t most_bytes = uint64_t{2} << 30;

// Errors of cells go with their size to the power of 1 (hard faces) to 2 (smooth smoke). So they are 4/3 to 2 times
// what halving the cells changes, and half the cells err by 1/3 to 1 times that.
constexpr double error_of_coarse = 5.0 / 3, error_of_fine = 2.0 / 3;

using Values = std::vector<float>; // red, green and blue of the pixels

double mean_of(const Values &values) {
    double sum = 0;
    for (float value : values) sum += static_cast<double>(value);
    return sum / static_cast<double>(values.size());
}

double sum_of_squares(const Values &values) {
    double sum = 0;
    for (float value : values) sum += static_cast<double>(value) * static_cast<double>(value);
    return sum;
}

// The mean of (a - b) (c - d).
double mean_product(const Values &a, const Values &b, const Values &c, const Values &d) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i)
        sum += (static_cast<double>(a[i]) - static_cast<double>(b[i])) *
               (static_cast<double>(c[i]) - static_cast<double>(d[i]));
    return sum / static_cast<double>(a.size());
}

// The same pixels of two seeds, and the seconds that the whole picture takes, about: with as many photons, and of these
// those that go with the number of photons.
struct Pair {
    Values a, b;
    double seconds, photon_seconds;

    double noise() const { return mean_product(a, b, a, b) / 2; } // the variance of one picture
    double mean() const { return (mean_of(a) + mean_of(b)) / 2; }
};

// What differs between pictures by two cells, of the same seeds, beyond the noise of their difference, and how far that
// may be off, if all pixels err together: mean squares.
struct Difference {
    double square, uncertainty;
};
Difference difference(const std::vector<Values> &p, const std::vector<Values> &q) {
    double products = 0, squares = 0;
    for (size_t i = 0; i < p.size(); ++i) {
        squares += mean_product(p[i], q[i], p[i], q[i]);
        for (size_t j = 0; j < i; ++j) products += mean_product(p[i], q[i], p[j], q[j]);
    }
    const double count = static_cast<double>(p.size()), couples = count * (count - 1) / 2,
                 square = std::max(0.0, products / couples);
    return {square, std::max(0.0, squares / count - square) / std::sqrt(couples)};
}

// The noise of one picture, as a mean square, and how many independent numbers it is made of: pixels that err together
// are one.
struct Noise {
    double square, degrees;
};

// Independent errors, as large as those of one picture, of pictures of several seeds: one less than the pictures, whose
// mean is not known.
std::vector<Values> errors_of(const std::vector<Values> &pictures) {
    std::vector<Values> errors;
    Values sum = pictures[0];
    for (size_t k = 1; k < pictures.size(); ++k) { // Helmert's contrasts
        const double count = static_cast<double>(k), scale = 1 / std::sqrt(count * (count + 1));
        Values error(sum.size());
        for (size_t i = 0; i < sum.size(); ++i) {
            const double value = static_cast<double>(pictures[k][i]);
            error[i] = static_cast<float>((static_cast<double>(sum[i]) - count * value) * scale);
            sum[i] += pictures[k][i];
        }
        errors.push_back(std::move(error));
    }
    return errors;
}

// From independent errors of the same pixels. The mean square of an error is the sum of the eigenvalues of its
// covariance, the mean square of the product of two that of their squares.
Noise noise_of(const std::vector<Values> &errors) {
    double square = 0, lengths = 0, products = 0;
    const double n = static_cast<double>(errors[0].size());
    std::vector<double> squares;
    for (const Values &error : errors) squares.push_back(sum_of_squares(error) / n);
    for (size_t i = 0; i < errors.size(); ++i) {
        square += squares[i] / static_cast<double>(errors.size());
        for (size_t j = 0; j < i; ++j) {
            double product = 0;
            for (size_t k = 0; k < errors[i].size(); ++k)
                product += static_cast<double>(errors[i][k]) * static_cast<double>(errors[j][k]) / n;
            products += product * product;
            lengths += squares[i] * squares[j];
        }
    }
    return {square, products < lengths ? lengths / products : 1};
}

// The mean square of nine in ten errors, where their expected one was measured on `measured` errors, relative to it:
// the quantile of the F distribution. Paulson, An approximate normalization of the analysis of variance distribution,
// 1942.
double largest_of_nine_in_ten(double degrees, size_t measured) {
    const double z = deviate_of_nine_in_ten, error = 2 / (9 * degrees),
                 error_of_measured = error / static_cast<double>(measured), b = 1 - error, a = 1 - error_of_measured;
    // (a x - b)^2 = z^2 (error_of_measured x^2 + error), the larger root; its cube is the quantile.
    const double square = a * a - z * z * error_of_measured,
                 x = (a * b + z * std::sqrt(b * b * error_of_measured + error * square)) / square;
    return x * x * x;
}

// What a picture is rendered by.
struct Choice {
    Options options;
    double error, seconds; // relative to the mean, as `wisp compare` has it; of a frame; both estimated
    double mean = 0;       // of the pixels that were measured with its cells
    bool told = true;      // the frame tells what others need: light that photons leave, or cells change, is seen
};

class MeasuredPixels {
  public:
    explicit MeasuredPixels(const Request &request) : request_(request) {
        request_.options.arithmetic = Arithmetic::f32;
        prepare_scene(request_.name, request_.file, request_.options, request_.frames.first, prepared_);
    }

    const Scene &scene() const { return prepared_.scene; }
    // Of the whole picture: without a crop it shares photons out among them where paths take their place.
    uint64_t rays() const {
        return static_cast<uint64_t>(request_.options.width.value_or(prepared_.width)) *
               static_cast<uint64_t>(request_.options.height.value_or(prepared_.height)) * request_.options.samples;
    }
    Settings settings_of(Options options) const {
        options.crop.reset();                  // crops of a picture are rendered alike
        options.shadows = ShadowMethod::exact; // the same picture, and of any pixels
        Settings settings = wisp::settings_of(options, prepared_);
        const double pixels = static_cast<double>(settings.crop.width()) * settings.crop.height();
        settings.crop.step = std::max(1, static_cast<int32_t>(std::sqrt(pixels / measured_pixels)));
        return settings;
    }
    Plan plan_of(const Settings &settings) const { return renderer_of(Arithmetic::f32).plan(scene(), settings); }
    bool is_random(const Settings &settings) const { return settings.paths > 0 || plan_of(settings).photons; }

    Pair pair(const Options &options, uint64_t photons) const {
        Pair pair;
        std::vector<Values> two = pictures(options, photons, 0, 2, pair);
        pair.a = std::move(two[0]), pair.b = std::move(two[1]);
        return pair;
    }
    // Of so many seeds, from the request's own (0) on.
    std::vector<Values> pictures(Options options, uint64_t photons, size_t first_seed, size_t count,
                                 Pair &times) const {
        options.photons = photons;
        Settings settings = settings_of(options);
        settings.seed += first_seed * between_seeds;
        std::vector<Values> pictures(count);
        for (size_t i = 0; i < count; ++i, settings.seed += between_seeds)
            if (i == 0 || is_random(settings))
                render(settings, pictures[i], nullptr, times);
            else
                pictures[i] = pictures[0];
        return pictures;
    }
    // Without what is scattered more than once.
    Values without_photons(const Options &options) const {
        Settings settings = settings_of(options);
        settings.photons = settings.paths = 0;
        Values values;
        Pair times;
        render(settings, values, nullptr, times);
        return values;
    }

    // Adds the passes of the reference below `last` that `passes` has not yet. The seconds that they take for the whole
    // picture.
    double add(Passes &passes, uint32_t last) const {
        if (passes.ranges.empty()) passes.ranges = {{0, 0}};
        Options options = request_.options;
        options.reference = true;
        options.passes = Options::Range{passes.ranges[0].second, last};
        const Settings settings = settings_of(options);
        passes.width = settings.crop.width(), passes.height = settings.crop.height();
        passes.samples = settings.samples;
        passes.exponent = scene().radiance_exponent;
        passes.ranges[0].second = last;
        passes.pixels.resize(static_cast<size_t>(passes.width) * static_cast<size_t>(passes.height));
        Values none;
        Pair times;
        render(settings, none, passes.pixels.data(), times);
        return times.seconds;
    }

  private:
    static constexpr uint64_t between_seeds = 0x9e3779b97f4a7c15; // leads far from the seeds that people choose

    void render(const Settings &settings, Values &values, PixelSums *sums, Pair &times) const {
        const int64_t frame = request_.frames.first;
        const Plan plan = checked_plan(request_, scene(), settings);
        Block block;
        block.fit(request_, prepared_, settings, plan);
        Arena arena(block.get(), plan.arena_bytes);
        Statistics statistics = {};
        RunProgress run;
        ProgressMeter progress(request_.options, frame, plan, run);
        Job job = {scene(), settings, arena, statistics, progress.observer()};
        const size_t pixels = settings.crop.pixels();
        if (!sums) values.resize(3 * pixels);
        job.rgb = sums ? nullptr : values.data();
        job.pixels = sums;
        const Status status = renderer_of(Arithmetic::f32).render(job);
        progress.finish();
        if (status == Status::stopped) stop(request_, frame);
        if (status != Status::done) fail(request_, plan, frame, status);
        const Crop &crop = settings.crop;
        const double of_one =
            static_cast<double>(crop.x1 - crop.x0) * (crop.y1 - crop.y0) / static_cast<double>(pixels);
        times.photon_seconds = progress.seconds(StageGroup::photons);
        times.seconds = progress.seconds(StageGroup::trees) + times.photon_seconds +
                        progress.seconds(StageGroup::irradiance) + progress.seconds(StageGroup::render) * of_one;
        say_once_a_minute();
    }
    // Many short pictures take long, of which the progress meter says nothing.
    void say_once_a_minute() const {
        ++pictures_;
        const double time = now();
        if (request_.options.quiet || request_.options.progress == Options::Progress::never || time - said_ < 60)
            return;
        said_ = time;
        print_note("max-error: " + std::to_string(pictures_) + " pictures were measured in " +
                   std::to_string(static_cast<int>(time - began_)) + " s; the choice is not known yet");
    }

    Request request_;
    PreparedScene prepared_;
    mutable int pictures_ = 0;
    mutable double began_ = now(), said_ = began_;
};

// The spacings of level 0, those of the defaults or of the options, halved so many times; doubled where `level` is -1.
// What the options say stays.
Options at_level(int level, const Options &options, const Settings &defaults, const Scene &scene) {
    Options result = options;
    const double factor = level < 0 ? 2 : 1.0 / (1 << level), cell = defaults.density_step;
    // For people: the lengths are said.
    const auto in_thousandths = [](double length) {
        return std::max(1, static_cast<int>(length * 1000 + 0.5)) / 1000.0;
    };
    const auto scale = [&](std::optional<double> &option, double length) {
        if (option || !(length > 0)) return;
        // A little less than a multiple of a cell counts as half of it.
        const bool is_multiple = cell > 0 && length / cell == static_cast<int>(length / cell);
        option = is_multiple ? length / cell * in_thousandths(cell * factor) : in_thousandths(length * factor);
    };
    scale(result.density_step, defaults.density_step);
    if (!options.density_step && result.density_step) {
        result.density_step = cell_of_bricks(scene, *result.density_step);
        if (keeps_samples(scene)) // quarters of many samples take 64 times their memory
            result.density_step = std::max(*result.density_step, std::min(cell, 0.5));
    }
    scale(result.light_step, defaults.light_step);
    scale(result.irradiance_step, defaults.irradiance_step);
    scale(result.step, defaults.step);
    return result;
}

// What the light that is scattered more than once errs by, whatever the photons and cells, relative to its root mean
// square: see the READMEs of photons and lights. On particles that keep their power themselves, by their depth. From
// the nearest photons, the most that run_warnings.cpp knows.
double error_of_way(const Scene &scene, const Plan &plan, const Settings &settings) {
    if (settings.paths > 0) return 0.005;
    if (settings.method != Method::map) return 0.43;
    if (settings.irradiance == IrradianceMap::none) return photon_cells(scene, density_of(scene), settings).error();
    switch (plan.photon_directions) {
    case Plan::Directions::none: return 0.005;
    case Plan::Directions::to_eye: return takes_peaks_off(scene, settings, plan) ? 0.03 : 0.012;
    case Plan::Directions::harmonics:
    case Plan::Directions::flux: break;
    }
    const double known = error_of_flux(scene, settings, plan);
    return known > 0 ? known : plan.photon_directions == Plan::Directions::harmonics ? 0.012 : 0.04;
}

uint64_t within_photons(double wanted) {
    return static_cast<uint64_t>(
        std::clamp(wanted, static_cast<double>(fewest_photons), static_cast<double>(most_photons)));
}

uint64_t measured_of(uint64_t photons) { return std::max(std::min(photons, all_photons), photons / 4); }

// How the error of a picture comes about, as mean squares.
struct Errors {
    double noise, cells, way;
    double uncertainty_of_cells; // cells err by more than so much more in one of ten
};

// Where cells and the way leave less of the error, as a mean square, finer cells take less time than more photons.
constexpr double least_for_noise = 0.25;

// The fewest photons with which such a picture errs by `goal` at most, as a mean square, given the noise of `photons`.
std::optional<uint64_t> enough_photons(const Errors &errors, uint64_t photons, double goal) {
    const double rest = goal - errors.cells - errors.way;
    if (rest < least_for_noise * goal) return std::nullopt;
    const double wanted = static_cast<double>(photons) * errors.noise / rest;
    if (wanted > static_cast<double>(most_photons)) return std::nullopt;
    return within_photons(wanted);
}

class Search {
  public:
    Search(const MeasuredPixels &pixels, const Options &options)
        : pixels_(pixels), options_(options), settings_(pixels.settings_of(options)),
          random_(pixels.is_random(settings_)) {}

    // The first choice that errs by no more than is asked for, from coarse cells to fine ones.
    std::optional<Choice> choose() {
        if (settings_.paths > 0) return choose_paths();
        photons_ = options_.photons;
        // Coarse cells are soon rendered, and about as noisy as fine ones.
        Pair times = {};
        const Options coarsest = options_at(-1, photons_);
        const std::vector<Values> first = pixels_.pictures(coarsest, photons_, 0, most_seeds, times);
        const Noise noise = noise_of(errors_of(first));
        set_goal(first[0], coarsest, settings_);
        if (!(goal_ > 0)) return Choice{options_, 0, times.seconds, 0, false}; // a black picture
        if (goal_ - way_ < least_for_noise * goal_) return std::nullopt;
        // As much noise as is asked for: there are hundreds of pixels, so cells that matter show in spite of it.
        if (random_) photons_ = measured_of(within_photons(static_cast<double>(photons_) * noise.square / goal_));
        seeds_ = noise.degrees < many_numbers ? most_seeds : few_seeds;
        const double deviate = deviate_of_nine_in_ten / std::sqrt(noise.degrees);
        Pair coarse = photons_ == options_.photons ? Pair{first[0], first[1], times.seconds, times.photon_seconds}
                                                   : pixels_.pair(coarsest, photons_),
             pair = pixels_.pair(options_at(0, photons_), photons_);
        for (int level = 0;; ++level) {
            const Difference change = difference({coarse.a, coarse.b}, {pair.a, pair.b});
            told_ = random_ ? first[0] != first[1] : change.square > 0;
            for (int of : {level - 1, level}) {
                const Pair &of_pair = of < level ? coarse : pair;
                const double factor = of < level ? error_of_coarse : error_of_fine;
                // Two seeds may show cells as too coarse that are not: those of the choice are measured again.
                const double unsure = deviate * change.uncertainty, least = std::max(0.0, change.square - unsure);
                const Errors errors = {of_pair.noise(), factor * factor * least, way_,
                                       factor * factor * (change.square + unsure - least)};
                const std::optional<uint64_t> photons = enough_photons(errors, photons_, goal_);
                if (!photons) continue;
                const std::optional<Choice> found =
                    measured_again(of, of < level ? level : level - 1, factor, of_pair, errors, *photons);
                if (found) return found;
            }
            const Options finer = options_at(level + 1, photons_);
            if (level == finest_level || !fits(finer)) return std::nullopt;
            coarse = std::move(pair);
            pair = pixels_.pair(finer, photons_);
        }
    }

  private:
    Settings settings_for(uint64_t photons) const {
        Options options = options_;
        options.photons = photons;
        return pixels_.settings_of(options);
    }
    // With the defaults' own spacings, if these still mean photons: where they would err by more than as many paths,
    // the defaults take paths. What cells err by is measured here.
    Options options_at(int level, uint64_t photons) const {
        if (level == 0 && settings_for(photons).paths == 0) return options_;
        return at_level(level, options_, settings_, pixels_.scene());
    }
    // From a picture by those cells.
    void set_goal(const Values &picture, const Options &cells, const Settings &settings) {
        mean_ = mean_of(picture);
        const double asked = (settings.paths > 0 ? safe_share_of_paths : safe_share) * *options_.max_error * mean_;
        goal_ = asked * asked;
        if (!random_) return;
        if (once_.empty()) once_ = pixels_.without_photons(cells);
        const double share = error_of_way(pixels_.scene(), pixels_.plan_of(settings), settings);
        way_ = share * share * mean_product(picture, once_, picture, once_);
    }
    bool fits(const Options &options) const {
        const Plan plan = pixels_.plan_of(pixels_.settings_of(options));
        return plan.arena_bytes <= most_bytes && photons_ <= plan.max_photons;
    }
    Choice choice(const Options &cells, const Pair &pair, const Errors &errors, uint64_t photons) const {
        const double more = static_cast<double>(photons) / static_cast<double>(photons_);
        Choice result = {cells, std::sqrt(errors.noise / more + errors.cells + errors.way) / mean_,
                         pair.seconds + (more - 1) * pair.photon_seconds, pair.mean(), told_};
        if (random_) result.options.photons = photons;
        return result;
    }
    // A choice with as many photons as nine in ten pictures need. Two seeds do not tell: where an error near the eye is
    // that of all pixels, their difference is one number. Nothing where these are too many. Cells err by `factor` times
    // what those of `other_level` change.
    std::optional<Choice> measured_again(int level, int other_level, double factor, const Pair &pair, Errors errors,
                                         uint64_t photons) {
        if (!random_) return choice(options_at(level, photons), pair, errors, photons);
        for (int tries = 0; tries < 3; ++tries, photons = std::min(4 * photons, most_photons)) {
            const uint64_t measured = measured_of(photons);
            Pair times, times_of_other;
            const std::vector<Values> pictures =
                pixels_.pictures(options_at(level, measured), measured, 2, seeds_, times);
            std::vector<Values> all = errors_of(pictures);
            all.push_back(errors_of({pair.a, pair.b})[0]);
            const double scale = std::sqrt(static_cast<double>(photons_) / static_cast<double>(measured));
            for (float &value : all.back()) value = static_cast<float>(static_cast<double>(value) * scale);
            const Noise noise = noise_of(all);
            const double margin = largest_of_nine_in_ten(noise.degrees, all.size()) * safe_share * safe_share,
                         deviate = deviate_of_nine_in_ten / std::sqrt(noise.degrees);
            if (errors.cells + errors.uncertainty_of_cells > small_share * goal_) {
                const Difference change = difference(
                    pictures, pixels_.pictures(options_at(other_level, measured), measured, 2, seeds_, times_of_other));
                errors.cells = factor * factor * change.square;
                errors.uncertainty_of_cells = factor * factor * deviate * change.uncertainty;
            }
            errors.noise = std::max(margin, 1.0) * noise.square;
            if (!enough_photons(errors, measured, goal_)) return std::nullopt;
            Errors most = errors;
            most.cells += errors.uncertainty_of_cells;
            const std::optional<uint64_t> enough = enough_photons(most, measured, goal_);
            if (!enough) continue; // more photons tell what cells err by
            most.noise = noise.square;
            photons_ = measured;
            Choice found = choice(options_at(level, *enough),
                                  {pictures[0], pictures[1], times.seconds, times.photon_seconds}, most, *enough);
            found.mean = 0;
            for (const Values &picture : pictures) found.mean += mean_of(picture) / static_cast<double>(seeds_);
            return found;
        }
        return std::nullopt;
    }
    // Random paths, where these take the place of photons. Nothing where so many do not suffice.
    std::optional<Choice> choose_paths() {
        uint64_t fewest = 1; // fewer are noisier than photons, which err by what pairs do not show
        while (settings_for(fewest * pixels_.rays()).paths == 0) fewest *= 2;
        uint64_t measured = 0, paths = fewest;
        for (;;) { // few paths hardly show what is rare and bright
            measured = std::max(fewest, paths / 4);
            photons_ = measured * pixels_.rays();
            const Pair pair = pixels_.pair(options_, photons_);
            set_goal(pair.a, options_, settings_for(photons_));
            const double rest = goal_ - way_;
            if (!(rest > 0)) return std::nullopt;
            const double wanted = pair.noise() / rest * static_cast<double>(measured);
            paths = std::max(fewest, static_cast<uint64_t>(std::min(wanted, 0x1p40)) + 1);
            if (paths > most_paths) return std::nullopt;
            if (paths <= 4 * measured + 3)
                return choice(options_, pair, {pair.noise(), 0, way_, 0}, paths * pixels_.rays());
        }
    }

    const MeasuredPixels &pixels_;
    const Options &options_;
    const Settings settings_;
    const bool random_;                    // there are photons, or paths in their place
    uint64_t photons_ = 0;                 // of the pairs
    size_t seeds_ = most_seeds;            // of a choice that is measured again
    bool told_ = true;                     // as Choice has it
    Values once_;                          // the light that is scattered once at most
    double mean_ = 0, goal_ = 0, way_ = 0; // the error asked for, and error_of_way(), as mean squares
};

// How much the mean of a choice's pixels differs from that of the reference, relative to it, less three times the
// standard error: a picture errs by no less. So what all choices err by alike is found where it is much. Passes are
// added until it is known, to three standard errors, on which side of `asked` the difference is.
double error_by_reference(const MeasuredPixels &pixels, double mean_of_choice, double asked) {
    Passes passes;
    for (uint32_t last = first_checking_passes;; last *= 2) {
        pixels.add(passes, last);
        const double mean = mean_of(mean_picture(passes).rgb);
        // Channels err together.
        const Values errors = error_picture(passes).rgb;
        const double unsure = 3 * std::sqrt(3 * sum_of_squares(errors)) / static_cast<double>(errors.size()),
                     difference = std::fabs(mean_of_choice - mean);
        if (last == most_checking_passes || std::fabs(difference - asked * mean) > unsure)
            return mean > 0 ? std::max(0.0, difference - unsure) / mean : 0;
    }
}

// Passes of the reference whose noise is `goal`, relative to the mean.
Choice choose_passes(const MeasuredPixels &pixels, Options options, double goal) {
    Choice choice = {std::move(options), goal, 0};
    choice.options.reference = true;
    Passes passes;
    double seconds = 0;
    for (uint32_t measured = 0, wanted = first_passes; measured < wanted / 4 || measured == 0;) {
        measured = std::max(first_passes, wanted / 4); // few passes hardly show what is rare and bright
        seconds += pixels.add(passes, measured);
        const Values errors = error_picture(passes).rgb;
        const double mean = mean_of(mean_picture(passes).rgb);
        const double noise = std::sqrt(sum_of_squares(errors) / static_cast<double>(errors.size()));
        const double ratio = mean > 0 ? noise / mean / goal : 0;
        wanted = static_cast<uint32_t>(std::min(measured * ratio * ratio, most_passes)) + 1;
        choice.options.passes = Options::Range{0, wanted};
        choice.seconds = seconds / measured * wanted;
    }
    return choice;
}

std::string percent(double x) { return two_digits(100 * x) + " %"; }

std::string described(const Choice &choice, const Options &before) {
    const Options &chosen = choice.options;
    std::string text;
    if (chosen.photons != before.photons) text += " --photons " + std::to_string(chosen.photons);
    const std::tuple<const char *, const std::optional<double> &, const std::optional<double> &> spacings[] = {
        {"density-step", chosen.density_step, before.density_step},
        {"light-step", chosen.light_step, before.light_step},
        {"irradiance-step", chosen.irradiance_step, before.irradiance_step},
        {"step", chosen.step, before.step}};
    for (const auto &[name, spacing, old] : spacings)
        if (spacing && !old) text += std::string(" --") + name + " " + exact(*spacing);
    return text.empty() ? " the defaults" : text;
}

} // namespace

void check_max_error(const Request &request, bool makes_picture) {
    if (!request.options.max_error) return;
    if (!makes_picture)
        throw Error(exit_usage,
                    "option 'max-error' belongs to render: what it chooses is found by rendering, and said there");
    for (const char *other : {"photons", "reference", "passes", "smoke", "map-in", "map-out", "batches", "estimate",
                              "deposit", "direction", "irradiance"})
        if (is_given(request, other))
            throw Error(exit_usage,
                        std::string("option '") + other + "' does not go with --max-error, which chooses it");
}

void choose_for_error(Request &request) {
    Options &options = request.options;
    if (!options.max_error) return;
    const MeasuredPixels pixels(request);
    if (pixels.scene().smoke_count == 0) return;
    const Options defaults = options;
    const std::string frame = several_frames(request) ? " in frame " + std::to_string(request.frames.first) : "";
    options.photons = first_photons;
    const auto say = [&options](const std::string &text) {
        if (!options.quiet) print_note("max-error: " + text);
    };
    const std::string of = options.crop ? ": the whole frame errs by about " : ": errs by about ";
    if (std::optional<Choice> choice = Search(pixels, options).choose()) {
        if (!choice->told && several_frames(request)) {
            say("by the defaults: no light is seen" + frame +
                " that more photons or finer cells change, so it does not tell what other frames need");
            options = defaults;
            return;
        }
        if (!pixels.is_random(pixels.settings_of(choice->options))) choice->options.photons = defaults.photons;
        const double found = error_by_reference(pixels, choice->mean, *options.max_error);
        if (found <= *options.max_error) {
            say("by" + described(*choice, defaults) + of + percent(choice->error) + frame + "; a frame takes about " +
                two_digits(choice->seconds) + " s");
            options = choice->options;
            return;
        }
        say("by" + described(*choice, defaults) + " it would err by " + percent(found) +
            " or more, says the reference");
    } else
        say("photons would err by more: the noise of --reference is measured");
    const Choice choice = choose_passes(pixels, options, safe_share_of_paths * *options.max_error);
    say("by --reference --passes 0:" + std::to_string(choice.options.passes->last) + of + percent(choice.error) +
        frame + "; a frame takes about " + two_digits(choice.seconds) + " s");
    options = choice.options;
}

} // namespace wisp
