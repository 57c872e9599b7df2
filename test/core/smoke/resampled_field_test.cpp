// Smoke resampled to a sparse grid, against the exact fields: values, optical depths, mass, majorants and collisions.
#include "support/built_sparse_grid.h"
#include <algorithm>

using namespace wisp;
using namespace wisp::WISP_ARITH;

TEST_CASE(WISP_ARITH_NAME ": a grid that is not rotated keeps its values, up to its closed border") {
    const SmokeLists all;
    const Resampled built(all.lists[2], 1);
    const BuiltGrid exact(all.aligned);
    const Box &box = built.bricks().bounds;
    const Vec3 size = box.high - box.low;
    Sequence next{7};
    int met = 0;
    for (int i = 0; i < 8000; ++i) {
        Vec3 x = box.low + vec(next(), next(), next()) * size;
        if (i % 4 == 0) x[i / 4 % 3] = i % 8 ? box.low[i / 4 % 3] : box.high[i / 4 % 3];
        const double sigma = at(extinction(exact.field, x));
        met += sigma > 0 ? 1 : 0;
        // The position in a cell has the rounding of x, here up to 12, in each.
        CHECK(std::fabs(at(extinction(built.field(), x)) - sigma) <= 60 * unit_error);
    }
    CHECK(met > 1000);
    for (int k = 0; k < 3; ++k) {
        Vec3 x = (box.low + box.high) * Real(0.5);
        x[k] = box.high[k] + Real(1e-3);
        CHECK(extinction(built.field(), x) == Real(0));
        x[k] = box.low[k] - Real(1e-3);
        CHECK(extinction(built.field(), x) == Real(0));
    }
}

TEST_CASE(WISP_ARITH_NAME ": optical depths of resampled grids: exact where the density is linear, close elsewhere") {
    std::vector<float> linear(20 * 18 * 16);
    for (size_t i = 0; i < linear.size(); ++i)
        linear[i] = float(1 + 0.125 * double(i % 20) + 0.0625 * double(i / 20 % 18) + 0.25 * double(i / 360));
    GridDescription source = {20,    18,        16,         linear.data(),
                              0.125, {0, 0, 0}, {10, 9, 8}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Sequence next{4};
    for (bool even : {true, false}) {
        if (!even)
            for (float &d : linear) d = float(next());
        const Resampled built({grid_smoke_of(source)}, 1);
        const BuiltGrid exact(source);
        double sum = 0, difference = 0, squares = 0;
        for (int i = 0; i < 300; ++i) {
            const auto inside = [&] { return vec(19 * next() - 9.5, 17 * next() - 8.5, 15 * next() - 7.5); };
            const Vec3 from = inside(), to = inside();
            const Real distance = length(to - from);
            const Ray ray = {from, (to - from) / distance};
            const double depth = at(optical_depth(exact.field, ray, distance));
            const double error = at(optical_depth(built.field(), ray, distance)) - depth;
            if (even) CHECK(std::fabs(error) <= 100 * unit_error * (1 + depth));
            sum += depth;
            difference += error;
            squares += error * error;
        }
        if (even) continue;
        // Independent samples: the midpoint rule has random errors.
        CHECK(std::sqrt(squares * 300) < 0.06 * sum);
        CHECK(std::fabs(difference) < 0.01 * sum);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a box is resampled exactly") {
    const Resampled built({box_smoke({4, 6, 3}, 0.75, 20)}, 1);
    const BuiltGrid exact(built.sources[0].grid);
    Sequence next{4};
    for (int i = 0; i < 2000; ++i) {
        const Vec3 x = vec(9 * next() - 4.5, 13 * next() - 6.5, 7 * next() - 3.5);
        CHECK(extinction(built.field(), x) == extinction(exact.field, x));
    }
    CHECK(extinction(built.field(), vec(4, 6, 3)) == Real(0.75));
    CHECK(extinction(built.field(), vec(-4, -6, -3)) == Real(0.75));
    for (int i = 0; i < 300; ++i) {
        const Ray ray = {vec(20 * next() - 10, 20 * next() - 10, 20 * next() - 10),
                         normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375))};
        const Real end = real(i % 3 ? 50 : 5);
        CHECK(std::fabs(at(optical_depth(built.field(), ray, end)) - at(optical_depth(exact.field, ray, end))) <
              400 * unit_error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": resampled particles keep their mass; depths converge with the square of the cell") {
    const std::vector<Particle> particles = different_sizes(80, 3, 0.5);
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const SmokeDescription source = smoke_of(particles, kernel);
        const BuiltField exact(source);
        double errors[2];
        for (int fine = 0; fine < 2; ++fine) {
            const Resampled built({source}, fine ? 0.25 : 0.5);
            const SparseGrid &bricks = built.bricks();
            const double cell = at(bricks.cell.x);
            // Trilinear between nodes: each node stands for a cell. A node on a face is divided among its holders.
            double mass = 0;
            for (uint32_t b = 0; b < bricks.count; ++b)
                for (uint32_t k = 0; k < nodes_of(1); ++k) {
                    const Cell in = cell_of_index(nodes_along(1), k);
                    uint32_t holders = 0;
                    for_each_holder(bricks, bricks.position[b], in, nodes_along(1),
                                    [&](uint32_t, uint32_t) { ++holders; });
                    mass += at(built.field().nodes(b)[k]) / holders;
                }
            mass *= cell * cell * cell;
            CHECK(std::fabs(mass / source.total_area - 1) < (fine ? 1e-4 : 1e-3));

            Sequence next{6};
            double squares = 0, sum = 0, bias = 0;
            for (int i = 0; i < 1500; ++i) {
                const Vec3 aim = vec(6 * next() - 3, 6 * next() - 3, 6 * next() - 3);
                const Vec3 direction = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375));
                const Ray ray = {aim - direction * Real(9), direction};
                const double depth = at(optical_depth(exact.field, ray, Real(20)));
                const double error = at(optical_depth(built.field(), ray, Real(20))) - depth;
                squares += error * error;
                bias += error;
                sum += depth;
            }
            errors[fine] = std::sqrt(squares * 1500) / sum;
            CHECK(std::fabs(bias) < 0.002 * sum);
        }
        CAPTURE(errors[0]);
        CAPTURE(errors[1]);
        CHECK(errors[0] < 0.01);
        CHECK(errors[1] < 0.3 * errors[0]);
    }
}

TEST_CASE(WISP_ARITH_NAME ": no resampled density lies above its brick's majorant, nor above that of a box") {
    const SmokeLists all;
    for (size_t i = 0; i < resampled_lists; ++i) {
        const Resampled built(all.lists[i], 0.6);
        const SparseGrid &bricks = built.bricks();
        const Vec3 size = bricks.bounds.high - bricks.bounds.low;
        for (uint32_t s = 0; s < built.medium.count; ++s) {
            const ResampledField &field = built.field(s);
            for (uint32_t b = 0; b < bricks.count; ++b) {
                const Real *nodes = field.nodes(b);
                CHECK(field.majorants[b] == *std::max_element(nodes, nodes + nodes_of(1)));
            }
            Sequence next{8};
            double tightest = 0;
            for (int round = 0; round < 2000; ++round) {
                const Vec3 low = bricks.bounds.low + vec(next(), next(), next()) * size;
                const Vec3 high = low + vec(next(), next(), next()) * size * Real(0.2);
                const double bound = at(majorant(field, {low, high}));
                for (int k = 0; k < 4; ++k) {
                    const Vec3 x = low + vec(next(), next(), next()) * (high - low);
                    const double sigma = at(extinction(field, x));
                    CHECK(sigma <= bound * (1 + 20 * unit_error) + 20 * unit_error);
                    if (bound > 0) tightest = std::max(tightest, sigma / bound);
                }
            }
            CHECK(tightest > 0.5);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": through resampled smoke of extreme density a flight ends") {
    const std::vector<Particle> one = {{{0, 0, 0}, 1, std::is_same_v<Real, Fixed> ? 1e6 : 1e9}};
    const Resampled built({smoke_of(one)}, 0.5);
    const Ray past = {vec(-5, 1.5, 1.5), vec(1, 0, 0)}; // through the empty corners of its brick
    CHECK(!first_collision(built.medium, past, real(10), photon_event(7, 1)).found);
}

TEST_CASE(WISP_ARITH_NAME
          ": the fraction that passes resampled smoke is that of its optical depth, the rest collides inside") {
    const SmokeLists all;
    for (size_t i = 0; i < resampled_lists; ++i) {
        const Resampled built(all.lists[i], 0.5);
        const Box &bounds = built.medium.bounds;
        const Vec3 middle = (bounds.low + bounds.high) * Real(0.5);
        for (const Vec3 &direction : {normalize(vec(1, 0.2, -0.1)), normalize(vec(0.1, -1, 0.4)), vec(0, 0, 1)}) {
            // From inside and from far outside.
            for (double back : {1.0, 40.0}) {
                const Ray ray = {middle + vec(0.3, 0.2, 0.4) - direction * real(back), direction};
                const Real end = real(back + 60);
                const double depth = at(optical_depth(built.medium, ray, end)), expected = std::exp(-depth);
                const int n = 3000;
                int through = 0, outside = 0;
                std::vector<double> depths;
                for (int k = 0; k < n; ++k) {
                    const MediumCollision hit =
                        first_collision(built.medium, ray, end, photon_event(uint64_t(k) * 7919 + 1, 1));
                    if (!hit.found) {
                        ++through;
                        continue;
                    }
                    const Vec3 x = ray.origin + direction * hit.distance;
                    if (!(extinction(built.medium.smokes[hit.smoke].field, x) > Real(0)) || hit.distance > end)
                        ++outside;
                    if (k % 3 == 0) depths.push_back(at(optical_depth(built.medium, ray, hit.distance)));
                }
                CAPTURE(i);
                CAPTURE(depth);
                CHECK(std::fabs(double(through) / n - expected) < 4 * std::sqrt(expected * (1 - expected) / n) + 0.003);
                CHECK(outside == 0);
                if (depths.size() > 100) CHECK(distance_from_exponential(depths, depth) < 1.95);
            }
        }
    }
}
