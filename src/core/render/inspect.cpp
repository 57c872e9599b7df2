// The pixel inspector. Nothing else names the functions that record: a program that does not inspect does not link
// them.
#include "core/render/stages.h"
#include "wisp/pixel_trace.h"

namespace wisp::WISP_ARITH {

Status inspect(const Job &job, const PixelTrace &trace) {
    PixelRecorder recorder = make_recorder(trace);
    Observation observation;
    observation.pixel = &recorder;
    return run_stages(job, observation);
}

} // namespace wisp::WISP_ARITH
