// The bar, and when it is drawn anew.
#include "host/commands/progress_meter.h"
#include "host/base/interrupt.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <unistd.h>

namespace wisp {

namespace {

constexpr int columns = 100;
constexpr double seconds_between_bars = 0.2, seconds_between_lines = 60;
// The remaining time is said when so much of the run is done, of the first frame's stage at hand, in so many seconds.
constexpr double least_part = 0.05, least_seconds = 1;

std::string minutes(double seconds) {
    const auto whole = static_cast<int64_t>(std::llround(seconds));
    char text[40];
    if (whole >= 3600)
        std::snprintf(text, sizeof text, "%lld:%02lld:%02lld", static_cast<long long>(whole / 3600),
                      static_cast<long long>(whole / 60 % 60), static_cast<long long>(whole % 60));
    else
        std::snprintf(text, sizeof text, "%lld:%02lld", static_cast<long long>(whole / 60),
                      static_cast<long long>(whole % 60));
    return text;
}

// Before any frame was measured: photons and rays take most of the time.
double assumed_share(StageGroup group) {
    switch (group) {
    case StageGroup::photons:
    case StageGroup::render: return 4;
    default: return 1;
    }
}

} // namespace

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double part_done(const RunProgress &run, Stage stage, double of_stage) {
    double all = 0, done = 0;
    for (uint32_t i = 0; i < stage_count; ++i) {
        all += run.shares[i];
        if (i < static_cast<uint32_t>(stage)) done += run.shares[i];
    }
    done += of_stage * run.shares[static_cast<uint32_t>(stage)];
    return (static_cast<double>(run.done) + (all > 0 ? done / all : 0)) / static_cast<double>(run.frames);
}

double seconds_left(const RunProgress &run, Stage stage, double of_stage, const double (&seconds)[stage_count]) {
    const auto at = static_cast<uint32_t>(stage);
    double spent = 0, shares_so_far = 0, shares = 0;
    for (uint32_t i = 0; i < stage_count; ++i) {
        shares += run.shares[i];
        if (i > at) continue;
        shares_so_far += run.shares[i];
        spent += seconds[i];
    }
    const double so_far = spent + seconds[at] * (1 / of_stage - 1); // once this stage is done
    return so_far * (shares_so_far > 0 ? shares / shares_so_far : 1) * static_cast<double>(run.frames) - spent;
}

ProgressMeter::ProgressMeter(const Options &options, int64_t frame, const Plan &plan, RunProgress &run)
    : frame_(frame), plan_(plan), run_(run) {
    using Show = Options::Progress;
    bar_ = !options.quiet &&
           (options.progress == Show::always || (options.progress == Show::automatic && isatty(STDERR_FILENO)));
    lines_ = !bar_ && !options.quiet && options.progress == Show::automatic;
    next_ = bar_ ? 0 : now() + seconds_between_lines;
    for (uint32_t i = 0; i < stage_count && !run_.measured; ++i)
        run_.shares[i] = plan.rows[i].needed ? assumed_share(plan.rows[i].group) : 0;
}

Observer ProgressMeter::observer() {
    return {this, [](void *self, Stage stage, uint64_t done, uint64_t total) {
                static_cast<ProgressMeter *>(self)->update(stage, done, total);
                return received_signal() == 0;
            }};
}

void ProgressMeter::finish() {
    close(now());
    if (bar_) std::fprintf(stderr, "\r%*s\r", columns, "");
    ++run_.done;
    std::copy(seconds_, seconds_ + stage_count, run_.shares);
    run_.measured = true;
}

double ProgressMeter::seconds(StageGroup group) const {
    double sum = 0;
    for (uint32_t i = 0; i < stage_count; ++i) sum += plan_.rows[i].group == group ? seconds_[i] : 0;
    return sum;
}

void ProgressMeter::update(Stage stage, uint64_t done, uint64_t total) {
    const double time = now();
    const bool begins = !running_ || stage != stage_;
    if (begins) {
        close(time);
        running_ = true;
        stage_ = stage;
        began_ = time;
    }
    if (!(bar_ || lines_) || (time < next_ && !(bar_ && begins))) return;
    next_ = time + (bar_ ? seconds_between_bars : seconds_between_lines);
    const std::string line = text(total ? static_cast<double>(done) / static_cast<double>(total) : 0, time);
    if (bar_)
        std::fprintf(stderr, "\r%-*.*s", columns, columns, line.c_str());
    else
        std::fprintf(stderr, "%s\n", line.c_str());
    std::fflush(stderr);
}

std::string ProgressMeter::text(double of_stage, double time) {
    const double elapsed = time - run_.began,
                 part = part_ = std::clamp(part_done(run_, stage_, of_stage), part_, 1.0); // stages may come again
    std::string line;
    if (bar_) {
        constexpr int width = 20;
        const auto filled = static_cast<size_t>(part * width);
        line = "[" + std::string(filled, '#') + std::string(width - filled, '.') + "] ";
    }
    line += std::to_string(static_cast<int>(100 * part)) + " %, frame " + std::to_string(frame_);
    if (run_.frames > 1) line += " (" + std::to_string(run_.done + 1) + " of " + std::to_string(run_.frames) + ")";
    line += std::string(": ") + plan_[stage_].name + ", " + minutes(elapsed);
    if ((run_.measured ? part : of_stage) >= least_part && elapsed >= least_seconds) {
        double so_far[stage_count];
        std::copy(seconds_, seconds_ + stage_count, so_far);
        so_far[static_cast<uint32_t>(stage_)] += time - began_;
        const double left = run_.measured ? elapsed * (1 - part) / part : seconds_left(run_, stage_, of_stage, so_far);
        line += ", about " + minutes(left) + " left";
    }
    return line;
}

void ProgressMeter::close(double time) {
    if (running_) seconds_[static_cast<uint32_t>(stage_)] += time - began_;
    running_ = false;
}

} // namespace wisp
