// What photons are needed for, and the unit of their power (S2).
#include "core/numbers/double_bits.h"
#include "core/photons/photon_tracing.h"
#include "core/photons/spherical_harmonics.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

double largest_of(const Double3 &c) {
    const auto larger = [](double a, double b) { return total_order_key(a) < total_order_key(b) ? b : a; };
    return larger(c.x, larger(c.y, c.z));
}
bool same(double a, double b) { return total_order_key(a) == total_order_key(b); }

} // namespace

bool is_stopped_before(const Surfaces *surfaces, const Emission &emission) {
    const Light *light = emission.emitter->light;
    if (!has(parts::surfaces) || !surfaces || !light || light->kind != LightKind::parallel) return false;
    const Ray &ray = emission.photon.ray;
    TreeCounts unused = {};
    return is_blocked(*surfaces, {ray.origin, -ray.direction}, Real(0), infinite_distance, no_triangle, unused);
}

PhotonUnit photon_unit(Real power, uint64_t emitted) {
    if (emitted == 0 || !(power > Real(0))) return {Real(1), 0};
    int32_t shift = 0; // emitted / 2^shift in [2^29, 2^30)
    while (emitted >> (29 + shift) > 1) ++shift;
    while (shift <= 0 && (emitted << -shift) >> 29 == 0) --shift;
    const uint64_t mantissa = shift > 0 ? emitted >> shift : emitted << -shift;
    Real unit = power / scale_pow2(Real(static_cast<int32_t>(mantissa)), -29);
    int32_t exponent = -29 - shift;
    for (; unit >= Real(2); ++exponent) unit = scale_pow2(unit, -1);
    for (; unit < Real(1); --exponent) unit = scale_pow2(unit, 1);
    return {unit, exponent};
}

int32_t sigma_shift_for(Real densest) {
    int32_t shift = 0;
    if (densest > Real(0))
        while (scale_pow2(densest, shift) < Real(0x1p11) && shift < 31) ++shift;
    return shift;
}

PhotonNeeds photon_needs(const Scene &scene, const Settings &settings) {
    PhotonNeeds needs = {};
    bool scatters = false, glows = false, single_channel = true;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &smoke = scene.smokes[i];
        if (smoke.empty()) continue;
        if (any_above_zero(smoke.albedo)) scatters = true;
        if (any_above_zero(smoke.emission)) glows = true;
        const int64_t g = total_order_key(smoke.asymmetry), size = max(g, -g);
        if (size > 0) needs.directions = true;
        if (size > 0 && size <= total_order_key(max_asymmetry_of_harmonics)) needs.harmonics = true;
        if (!same(smoke.albedo.x, smoke.albedo.y) || !same(smoke.albedo.y, smoke.albedo.z)) single_channel = false;
    }
    needs.traced = scatters && (glows || scene.light_count > 0) && settings.photons > 0 && settings.paths == 0;
    if (!needs.traced) return {};
    // All photons carry the same power if all lights have one hue and no albedo has a hue.
    needs.powers = !single_channel || glows;
    const Double3 *color = nullptr; // of the first light that is not black
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        const Double3 &c = scene.lights[i].color;
        const double brightest = largest_of(c);
        if (!any_above_zero(c)) continue;
        if (!color) color = &c;
        const double first = largest_of(*color); // compare the ratios without a division
        const auto same_hue = [&](double mine, double other) {
            return same(rounded_product(mine, first), rounded_product(other, brightest));
        };
        if (!same_hue(c.x, color->x) || !same_hue(c.y, color->y) || !same_hue(c.z, color->z) ||
            scene.lights[i].kind == LightKind::constant)
            needs.powers = true;
    }
    return needs;
}

} // namespace wisp::WISP_ARITH
