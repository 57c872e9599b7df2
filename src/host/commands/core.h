// The core in the arithmetic that the user chose.
#pragma once
#include "core/smoke/density_statistics.h"
#include "host/scene/options.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"

namespace wisp {

struct Core {
    const char *name;
    Plan (*plan)(const Scene &, const Settings &);
    Status (*render)(const Scene &, const Settings &, Arena &, const Observer &, float *, Statistics &, PhotonSums *,
                     FrameCache *);
    Status (*inspect)(const Scene &, const Settings &, Arena &, const Observer &, float *, Statistics &, PhotonSums *,
                      const PixelTrace &);
    Status (*trace_map)(const Scene &, const Settings &, const Batches &, Arena &, const Observer &, PhotonSums &,
                        Statistics &);
    Status (*render_reference)(const Scene &, const Settings &, Arena &, const Observer &, PixelSums *, Statistics &);
    uint64_t (*density_statistics_bytes)(uint32_t);
    bool (*find_density_statistics)(const SmokeDescription &, Arena &, DensityStatistics *);
};

inline const Core &core(Arithmetic arithmetic) {
#define WISP_CORE(arithmetic)                                                                                          \
    {                                                                                                                  \
#arithmetic, arithmetic::plan, arithmetic::render, arithmetic::inspect, arithmetic::trace_map,                 \
            arithmetic::render_reference, arithmetic::density_statistics_bytes,                       \
            arithmetic::find_density_statistics                                                                        \
    }
    static constexpr Core cores[] = {WISP_CORE(f32), WISP_CORE(f64), WISP_CORE(fixed)};
#undef WISP_CORE
    return cores[static_cast<int>(arithmetic)];
}

} // namespace wisp
