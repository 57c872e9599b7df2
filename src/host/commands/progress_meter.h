// How far a frame is, and the seconds of its stages.
#pragma once
#include "host/base/interrupt.h"
#include "host/scene/options.h"
#include "wisp/wisp.h"
#include <chrono>
#include <cstdio>
#include <unistd.h>

namespace wisp {

inline double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// An observer of the core: measures the seconds of stages and, where it is wanted, shows how much of a stage is done.
class ProgressMeter {
  public:
    ProgressMeter(const Options &options, int64_t frame, const Plan &plan) : frame_(frame), plan_(plan) {
        using Show = Options::Progress;
        shown_ = !options.quiet &&
                 (options.progress == Show::always || (options.progress == Show::automatic && isatty(STDERR_FILENO)));
    }
    Observer observer() {
        return {this, [](void *self, Stage stage, uint64_t done, uint64_t total) {
                    static_cast<ProgressMeter *>(self)->update(stage, done, total);
                    return received_signal() == 0;
                }};
    }
    void finish() {
        close(now());
        if (shown_) std::fprintf(stderr, "\r%-40s\r", "");
    }
    double seconds(StageGroup group) const { return seconds_[static_cast<int>(group)]; }

  private:
    void update(Stage stage, uint64_t done, uint64_t total) {
        const double time = now();
        const bool begins = group_ < 0 || stage != stage_;
        if (begins) {
            close(time);
            stage_ = stage;
            group_ = static_cast<int>(plan_[stage].group);
            began_ = time;
        }
        if (!shown_ || (!begins && time < next_)) return;
        next_ = time + 0.2;
        std::fprintf(stderr, "\rframe %lld: %s %3d %%", static_cast<long long>(frame_), plan_[stage].name,
                     static_cast<int>(total ? 100 * done / total : 0));
        std::fflush(stderr);
    }
    void close(double time) {
        if (group_ >= 0) seconds_[group_] += time - began_;
        group_ = -1;
    }

    int64_t frame_;
    bool shown_;
    const Plan &plan_;
    int group_ = -1;
    Stage stage_ = Stage::frame_cache;
    double began_ = 0, next_ = 0, seconds_[4] = {};
};

} // namespace wisp
