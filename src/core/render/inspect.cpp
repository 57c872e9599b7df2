// The pixel inspector. Nothing else names the functions that record: a program that does not inspect does not link them.
#include "core/render/traced_render.h"

namespace wisp::WISP_ARITH {

Status inspect(const Scene &scene, const Settings &settings, Arena &arena, const Observer &observer, float *rgb,
               Statistics &statistics, PhotonSums *sums, const PixelTrace &trace) {
    PixelRecorder recorder = make_recorder(trace);
    return render_traced(scene, settings, arena, observer, rgb, statistics, sums, nullptr, &recorder);
}

} // namespace wisp::WISP_ARITH
