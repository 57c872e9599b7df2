// Whether the observer wants the work to stop: long loops count their work, and the observer is asked from time to
// time.
#pragma once
#include "wisp/progress.h"

namespace wisp {

// The work of a frame, in units of about a tenth of a microsecond. What may take long, where many particles overlap,
// counts as more. No result depends on it.
struct Work {
    Observer observer;
    Stage stage = Stage::frame_cache;
    uint64_t done = 0, total = 0; // units of the stage; `total` grows as loops say what they will do
    uint64_t shown = 0;           // `done` as the observer was told last
    uint32_t left = 0;            // units before it is asked again
    bool stopped = false;         // by the observer; it is not asked any more

    [[gnu::cold, gnu::noinline]] bool ask() {
        constexpr uint32_t between = 1 << 15;
        shown = done;
        stopped = stopped || !observer(stage, done < total ? done : total, total);
        left = stopped ? 0 : between;
        return !stopped;
    }
};

// What a loop counts its work with. Without a frame nothing stops it.
class Watch {
  public:
    Watch() = default;
    explicit Watch(Work &work) : work_(&work) {}

    // A stage begins.
    bool begin(Stage stage) const {
        *work_ = {work_->observer, stage};
        return work_->ask();
    }
    // So much work of the stage will be done().
    void expect(uint64_t units) const {
        if (work_) work_->total += units;
    }
    // False: stop. So much work went on, whose end is not near.
    bool go_on(uint32_t units) const {
        if (!work_) return true;
        if (units < work_->left) {
            work_->left -= units;
            return true;
        }
        return work_->ask();
    }
    // The same. So much of what was expected is done; the observer sees at least each sixteenth of it.
    bool done(uint64_t units) const {
        if (!work_) return true;
        work_->done += units;
        if (work_->done - work_->shown > work_->total / 16) return work_->ask();
        return go_on(static_cast<uint32_t>(units < UINT32_MAX ? units : UINT32_MAX));
    }
    // done() for the rounds of a short loop: `units` for 1024 of them.
    bool done_round(uint64_t round, uint32_t units) const { return round % 1024 != 1023 || done(units); }
    bool stopped() const { return work_ && work_->stopped; }

  private:
    Work *work_ = nullptr;
};

// Sets an array to a value. False: stop.
template <class T> bool fill(T *values, uint64_t count, const T &value, Watch watch) {
    constexpr uint64_t at_once = 4096;
    for (uint64_t first = 0; first < count; first += at_once) {
        if (!watch.go_on(at_once / 64)) return false;
        const uint64_t end = count - first < at_once ? count : first + at_once;
        for (uint64_t i = first; i < end; ++i) values[i] = value;
    }
    return true;
}

} // namespace wisp
