// From which g on photons at nodes keep what of their directions. The host, which says how they err, asks the same.
#pragma once

namespace wisp {

// Above this |g|, the first order that harmonics leave out would weigh more than isotropic light: (2 l + 1) g^l > 1 for
// l = 4. A series that ends at l = 3 is then worse than the flux alone.
constexpr double max_asymmetry_of_harmonics = 0.577;

// Up to this g lines err by no more than photons that are kept as scattered to the eye (photons/README, Towards the
// eye). Flux and harmonics are those of all channels together: where light of several hues comes from several sides,
// they err from less g on.
constexpr double max_asymmetry_of_lines = 0.3, max_asymmetry_of_hues = 0.1;

} // namespace wisp
