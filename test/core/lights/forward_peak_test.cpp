// The two parts of a phase function against numerical integrals, and the angle between them.
#include "core/lights/forward_peak.h"
#include "support/built_sparse_grid.h"
#include <cmath>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

Vec3 at_angle(double degrees) {
    const double angle = degrees * pi_ / 180;
    return vec(std::sin(angle), 0, std::cos(angle));
}

// A lit box, seen by an eye in front of it along z. It is not about the origin, so that a difference is not a sum.
struct LitBox {
    explicit LitBox(double g = 0.9) : built({source(g)}, 1) {}
    static SmokeDescription source(double g) {
        SmokeDescription smoke = box_smoke({1, 1, 1}, 2, 2);
        smoke.asymmetry = g;
        smoke.grid.center = {3, -2, 1};
        return smoke;
    }
    // The light travels at that angle to the direction of the eye from the middle.
    static Light parallel(double degrees, double color = 1) {
        return {LightKind::parallel, vec(0, 0, 0), at_angle(degrees), Real(0), Color(real(color))};
    }
    static Light point(double z, double color = 1) {
        return {LightKind::point, vec(3, -2, 1 + z), vec(0, 0, 1), Real(0), Color(real(color))};
    }
    // Its axis is at that angle to the direction of the eye.
    static Light spot(double degrees, double cone) {
        return {LightKind::spot, vec(3, -1.5, 1), at_angle(degrees), real(1 - std::cos(cone * pi_ / 180)),
                Color(Real(1))};
    }
    double narrow(const std::vector<Light> &lights) const {
        return to_double(
            forward_peak(built.medium, lights.data(), static_cast<uint32_t>(lights.size()), vec(3, -2, 1 + 9)).narrow);
    }
    Resampled built;
};

double narrow_at(double degrees, double g = 0.9) {
    return to_double(ForwardPeak(Phase(real(g)), real(1 - std::cos(degrees * pi_ / 180))).narrow);
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": the narrow and the wide part are the whole phase function") {
    for (double g : {0.58, 0.7, 0.9, 0.99})
        for (double degrees : {5.0, 14.0, 30.0}) {
            CAPTURE(g);
            CAPTURE(degrees);
            const Phase phase(real(g));
            const ForwardPeak peak(phase, real(1 - std::cos(degrees * pi_ / 180)));
            const Vec3 in = at_angle(0);
            double wide = 0;
            const int n = 20000;
            for (int i = 0; i < n; ++i) { // over the square of the angle: the peak is at 0
                const double angle = pi_ * (i + 0.5) * (i + 0.5) / n / n, width = 2 * pi_ * (i + 0.5) / n / n;
                wide += to_double(peak.wide(in, at_angle(angle * 180 / pi_))) * 2 * pi_ * std::sin(angle) * width;
            }
            CHECK(wide + to_double(peak.narrow) == doctest::Approx(1).epsilon(2e-4));
            CHECK(peak.narrow > Real(0));
            for (double beyond : {1.01, 2.0, 5.0}) {
                const Vec3 out = at_angle(beyond * degrees);
                CHECK(peak.wide(in, out) == phase(in, out));
            }
            CHECK(peak.wide(in, at_angle(0.9 * degrees)) == peak.largest);
            CHECK(to_double(peak.largest) == doctest::Approx(to_double(phase(in, at_angle(degrees)))).epsilon(1e-4));
        }
}

TEST_CASE(WISP_ARITH_NAME ": what counts as straight on is a third of the way to the eye, from 5 to 30 degrees") {
    const LitBox box;
    const auto like = [](double degrees) { return doctest::Approx(narrow_at(degrees)).epsilon(0.02); };
    CHECK(box.narrow({}) == like(30)); // what glows is seen from all sides
    CHECK(box.narrow({box.parallel(180)}) == like(30));
    CHECK(box.narrow({box.parallel(95)}) == like(30));
    CHECK(box.narrow({box.parallel(60)}) == like(20));
    CHECK(box.narrow({box.parallel(24)}) == like(8));
    CHECK(box.narrow({box.parallel(0)}) == like(5));
    // A narrow peak is known by its own width.
    const LitBox narrow_peak(0.97);
    CHECK(narrow_peak.narrow({box.parallel(0)}) == doctest::Approx(narrow_at(0.03 * 180 / pi_, 0.97)).epsilon(0.02));
    CHECK(narrow_peak.narrow({box.parallel(24)}) == doctest::Approx(narrow_at(8, 0.97)).epsilon(0.02));
    // The least of lights that matter.
    CHECK(box.narrow({box.parallel(180), box.parallel(24, 0.2)}) == like(8));
    CHECK(box.narrow({box.parallel(180), box.parallel(24, 0.1)}) == like(30));
    CHECK(box.narrow({box.parallel(24, 0), box.parallel(60)}) == like(20));
    // A point light behind the smoke, and one in it, whose light flies to the eye from any place around it.
    CHECK(box.narrow({box.point(-5)}) == like(5));
    CHECK(box.narrow({box.point(-0.5)}) == like(5));
    CHECK(box.narrow({box.point(0.5)}) == like(5));
    CHECK(box.narrow({box.parallel(180), box.point(0.5, 0.01)}) == like(30)); // it hardly matters
    // A spot in the smoke: the edge of its cone counts, wherever the middle of the smoke is.
    CHECK(box.narrow({box.spot(90, 12)}) == like(24.3)); // chords of 1.414 - 0.209
    CHECK(box.narrow({box.spot(60, 20)}) == like(12.4));
    CHECK(box.narrow({box.spot(10, 20)}) == like(5));
    CHECK(box.narrow({box.spot(180, 20)}) == like(30));
}
