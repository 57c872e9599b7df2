// Whether the settings keep a scene's densities and photons at nodes (S4-1, S4-3). The host, which chooses settings,
// asks the same.
#pragma once
#include "core/smoke/resampling.h"
#include "wisp/settings.h"

namespace wisp {

// Whether densities are kept at the nodes of bricks.
inline bool is_resampled(const Scene &scene, const Settings &settings) {
    return total_order_key(settings.density_step) > 0 && can_resample(scene);
}

// Whether photons leave their power at the nodes of bricks, be the densities resampled to these or exact.
inline bool keeps_light_at_nodes(const Scene &scene, const Settings &settings) {
    const bool of_map = settings.method == Method::map || settings.goal == Goal::photons,
               keeps_map = settings.irradiance != IrradianceMap::none && settings.estimate != Estimate::knn;
    return of_map && (is_resampled(scene, settings) || (keeps_map && settings.deposit == Deposit::nodes));
}

} // namespace wisp
