// `--stats`: the counters, seconds and bytes of a run as one JSON object.
#pragma once
#include "wisp/wisp.h"
#include <string>
#include <vector>

namespace wisp {

struct FrameReport {
    int64_t frame;
    bool kept; // the files are those of an earlier run: nothing was counted
    struct {
        double read, trees, photons, irradiance, render, total;
    } seconds;
    Statistics statistics;
    Plan plan;
};

struct RunReport {
    std::string version, arithmetic, digest;
    std::vector<FrameReport> frames;
};

std::string statistics_json(const RunReport &report);

} // namespace wisp
