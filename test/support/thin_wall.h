// A wall of smoke that is thinner than a step, for every march.
#pragma once
#include "support/built_smoke.h"
#include <doctest/doctest.h>

namespace wisp::WISP_ARITH {

// Samples at x = -8, -7, ..., 8. The wall is that at 0: sigma_t rises from 0 at x = -1, where a brick begins, to 1000.
// The ray enters the smoke at x = -8.5, so one of its steps of length 1 has its middle at x = -1.
struct ThinWall {
    static constexpr double sigma = 1000, step = 1;
    ThinWall() : samples(17 * 4 * 4, 0) {
        for (size_t i = 8; i < samples.size(); i += 17) samples[i] = 1;
        const Double3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
        smoke = grid_smoke_of({17, 4, 4, samples.data(), sigma, {0, 0, 0}, {8.5, 2, 2}, {x, y, z}});
        smoke.albedo = {0, 0, 0};
        smoke.emission = {1, 0.5, 0.25};
    }
    ThinWall(const ThinWall &) = delete;

    std::vector<float> samples;
    SmokeDescription smoke;
    Ray ray = {vec(-10, 0.25, 0.5), vec(1, 0, 0)};
};

// march_to(end) marches the ray up to a distance that lies in the wall.
template <class March> void check_thin_wall(March &&march_to) {
    for (const double x : {-1.0, -0.98, -0.95, -0.9, -0.75, -0.5, -0.25, 0.0}) {
        CAPTURE(x);
        const auto seen = march_to(real(10 + x));
        // The one kink of sigma_t costs less than 1/8 of depth.
        CHECK(std::fabs(at(seen.transmittance) - std::exp(-ThinWall::sigma * (x + 1) * (x + 1) / 2)) < 0.125);
        CHECK(std::fabs(at(seen.radiance.x) - (1 - at(seen.transmittance))) < 2000 * unit_error + 1e-6);
    }
}

} // namespace wisp::WISP_ARITH
