// Eight points side by side: what is between nodes, its range and its slope, against the formulas of one point.
#include "core/smoke/sparse_grid_lanes.h"
#include "support/built_sparse_grid.h"
#include <algorithm>
#include <vector>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

// A field of 5 x 4 x 3 nodes, and eight places in its cells.
struct Places {
    static constexpr int32_t row = 5, layer = 20, count = 60;
    std::vector<Real> values;
    LaneCells at;

    explicit Places(Sequence &next) {
        for (int32_t i = 0; i < count; ++i) values.push_back(Real(4 * next() - 1));
        for (uint32_t l = 0; l < lanes; ++l) {
            at.node[l] = static_cast<int32_t>(next() * 2) * layer + static_cast<int32_t>(next() * 3) * row +
                         static_cast<int32_t>(next() * 4);
            at.row[l] = row;
            at.layer[l] = layer;
            at.x[l] = Real(next());
            at.y[l] = Real(next());
            at.z[l] = Real(next());
        }
    }
    double corner(uint32_t l, int x, int y, int z) const {
        return WISP_ARITH::at(values[static_cast<size_t>(at.node[l] + x + y * row + z * layer)]);
    }
    // The weighted mean of the corners, `moved` along a direction.
    double between(uint32_t l, const double (&direction)[3], double moved) const {
        const double p[3] = {WISP_ARITH::at(at.x[l]) + moved * direction[0],
                             WISP_ARITH::at(at.y[l]) + moved * direction[1],
                             WISP_ARITH::at(at.z[l]) + moved * direction[2]};
        double sum = 0;
        for (int i = 0; i < 8; ++i) {
            const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
            sum += (x ? p[0] : 1 - p[0]) * (y ? p[1] : 1 - p[1]) * (z ? p[2] : 1 - p[2]) * corner(l, x, y, z);
        }
        return sum;
    }
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": in lanes values between nodes, their ranges and slopes are those of one point") {
    Sequence next{3};
    for (int i = 0; i < 500; ++i) {
        const Places places(next);
        const double direction[3] = {2 * next() - 1, 2 * next() - 1, 2 * next() - 1};
        const Vec3 along = vec(direction[0], direction[1], direction[2]);
        Lanes values, slopes;
        interpolate(places.at, places.values.data(), values);
        change_along(places.at, places.values.data(), along, slopes);
        for (uint32_t l = 0; l < lanes; ++l) {
            CHECK(at(values[l]) == doctest::Approx(places.between(l, direction, 0)).epsilon(1e-5).scale(4));
            // The cubic along a line has the difference over 2^-10 for its slope but for 2^-20 of its third
            // coefficient.
            const double change = places.between(l, direction, 0x1p-10) - places.between(l, direction, -0x1p-10);
            CHECK(at(slopes[l]) == doctest::Approx(change * 0x1p9).epsilon(1e-4).scale(4));
            std::vector<double> corners;
            for (int k = 0; k < 8; ++k) corners.push_back(places.corner(l, k & 1, k >> 1 & 1, k >> 2));
            Real least, greatest;
            range_of_corners(places.values.data() + places.at.node[l], places.at.row[l], places.at.layer[l], least,
                             greatest);
            CHECK(at(least) == *std::min_element(corners.begin(), corners.end()));
            CHECK(at(greatest) == *std::max_element(corners.begin(), corners.end()));
        }
    }
}
