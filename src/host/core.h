// The core in the arithmetic that the user chose.
#pragma once
#include "host/options.h"
#include "wisp/render.h"

namespace wisp {

struct Core {
    const char *name;
    Plan (*plan)(const Scene &, const Settings &);
    Status (*render)(const Scene &, const Settings &, Arena &, const Observer &, float *, Statistics &, MapSums *);
    Status (*trace_map)(const Scene &, const Settings &, const Batches &, Arena &, const Observer &, MapSums &,
                        Statistics &);
    Status (*render_reference)(const Scene &, const Settings &, Arena &, const Observer &, PixelSums *, Statistics &);
};

inline const Core &core(Arithmetic arithmetic) {
    static constexpr Core cores[] = {{"f32", f32::plan, f32::render, f32::trace_map, f32::render_reference},
                                     {"f64", f64::plan, f64::render, f64::trace_map, f64::render_reference},
                                     {"fixed", fixed::plan, fixed::render, fixed::trace_map, fixed::render_reference}};
    return cores[static_cast<int>(arithmetic)];
}

} // namespace wisp
