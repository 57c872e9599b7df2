// render() of the door, with a recorder of one pixel.
#pragma once
#include "core/march/pixel_recorder.h"
#include "wisp/wisp.h"

namespace wisp::WISP_ARITH {

// `recorder` may be nullptr: then no pixel is recorded.
Status render_traced(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,
                     Statistics &statistics, PhotonSums *sums, FrameCache *kept, PixelRecorder *recorder);

} // namespace wisp::WISP_ARITH
