// How far a run is, and the seconds of a frame's stages.
#pragma once
#include "host/scene/options.h"
#include "wisp/wisp.h"
#include <string>

namespace wisp {

// Seconds of a clock that never goes back.
double now();

// How far a run of several frames is.
struct RunProgress {
    explicit RunProgress(int64_t frames_ = 1) : frames(frames_), began(now()) {}

    int64_t frames, done = 0;
    double began;
    // The shares of stages in the time of a frame: measured in the last one that was rendered, assumed before.
    double shares[stage_count] = {};
    bool measured = false;
};

// What part of the run is done, 0 to 1: whole frames, and of the frame at hand the stages before `stage` and `of_stage`
// (0 to 1) of that.
double part_done(const RunProgress &run, Stage stage, double of_stage);

// Seconds that the run still takes while its first frame is rendered: `seconds` is what its stages took so far. The
// stage at hand, of which `of_stage` (0 to 1, not 0) is done, goes on as fast; those after it take their shares.
double seconds_left(const RunProgress &run, Stage stage, double of_stage, const double (&seconds)[stage_count]);

// An observer of the core for one frame: measures the seconds of stages. Where it is wanted it shows on standard error
// how much of the run is done: as a bar on a terminal, as a line each minute elsewhere.
class ProgressMeter {
  public:
    ProgressMeter(const Options &options, int64_t frame, const Plan &plan, RunProgress &run);
    Observer observer();
    void finish(); // the frame is rendered, or given up
    double seconds(StageGroup group) const;

  private:
    void update(Stage stage, uint64_t done, uint64_t total);
    void close(double time);
    std::string text(double of_stage, double time);

    int64_t frame_;
    const Plan &plan_;
    RunProgress &run_;
    bool bar_, lines_, running_ = false;
    Stage stage_ = Stage::frame_cache;
    double began_ = 0, next_, seconds_[stage_count] = {};
    double part_ = 0; // of the run, as was said last
};

} // namespace wisp
