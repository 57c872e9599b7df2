// Lanes of steps become single ones, whatever a recorder does with them.
#include "core/march/pixel_recorder.h"

namespace wisp::WISP_ARITH {

namespace {

void add(LaneColor &sum, const Real (&extinction)[lanes], const LaneColor &scattered, const Color &albedo) {
    for (uint32_t l = 0; l < lanes; ++l) {
        sum.red[l] += extinction[l] * (albedo.x * scattered.red[l]);
        sum.green[l] += extinction[l] * (albedo.y * scattered.green[l]);
        sum.blue[l] += extinction[l] * (albedo.z * scattered.blue[l]);
    }
}

Color color_of(const LaneColor &color, uint32_t l) { return Color(color.red[l], color.green[l], color.blue[l]); }

} // namespace

void begin_lanes(PixelRecorder &recorder) { recorder.single = recorder.multiple = recorder.emission = {}; }

void add_lane_sources(PixelRecorder &recorder) {
    const LaneSourceRecord &record = recorder.lane_source;
    add(recorder.single, record.extinction, record.single, record.albedo);
    add(recorder.multiple, record.extinction, record.multiple, record.albedo);
    for (uint32_t l = 0; l < lanes; ++l) {
        recorder.emission.red[l] += record.extinction[l] * record.emission.x;
        recorder.emission.green[l] += record.extinction[l] * record.emission.y;
        recorder.emission.blue[l] += record.extinction[l] * record.emission.z;
    }
}

void end_lanes(PixelRecorder &recorder) {
    const LaneStepRecord &record = recorder.lane_step;
    for (uint32_t l = 0; l < lanes; ++l)
        if (record.extinction[l] > Real(0))
            recorder.step(recorder,
                          {record.step[l], record.distance[l], record.length[l], record.extinction[l],
                           record.optical_depth[l], color_of(recorder.single, l), color_of(recorder.multiple, l),
                           color_of(recorder.emission, l), color_of(record.radiance, l)});
}

} // namespace wisp::WISP_ARITH
