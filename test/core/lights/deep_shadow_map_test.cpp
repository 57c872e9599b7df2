// Deep shadow maps: depths along lines of light, against rays.
#include "core/lights/deep_shadow_map.h"
#include "core/lights/optical_depth_grid.h"
#include "support/built_sparse_grid.h"
#include <cmath>

using namespace wisp;
using namespace wisp::WISP_ARITH;

TEST_CASE(WISP_ARITH_NAME ": a point lies on the face whose axis its direction follows most") {
    const Light lamp = {LightKind::point, vec(1, 2, 3), Vec3(Real(0)), Real(2), Color(Real(1))};
    for (uint32_t face = 0; face < light_faces; ++face) {
        const int axis = static_cast<int>(face / 2);
        Vec3 offset = vec(0.5, -0.25, 0.75);
        offset[axis] = real(face % 2 ? -4 : 4);
        CHECK(light_face(lamp, lamp.position + offset) == face);
        const Light sun = {LightKind::parallel, Vec3(Real(0)), normalize(offset), Real(0), Color(Real(1))};
        CHECK(light_face(sun, vec(7, -8, 9)) == face);
    }
}

TEST_CASE(WISP_ARITH_NAME ": in a box of even density a line's depth is its length, and other faces have no lines") {
    const double sigma = 0.75;
    const Resampled built({box_smoke({4, 6, 3}, sigma, 20)}, 1);
    const Box &box = built.bricks().bounds;
    CHECK(is_cut_off(built.medium));
    const Light sun = {LightKind::parallel, Vec3(Real(0)), vec(0, 0, -1), Real(0), Color(Real(1))};
    const DeepShadowMap map(built.medium, true, sun, 5, box);
    REQUIRE(map.count() > 0);
    for (uint32_t face = 0; face < 5; ++face) CHECK(DeepShadowMap(built.medium, true, sun, face, box).count() == 0);
    std::vector<Real> cache(map.cache_size());
    Sequence next{4};
    uint64_t found = 0;
    for (int i = 0; i < 50; ++i) {
        const double x = 6 * next() - 3, y = 9 * next() - 4.5, z = 6 * next() - 3;
        const Vec3 p = vec(x, y, z);
        const uint32_t row = map.row_of(p);
        REQUIRE(row >= 1);
        REQUIRE(row + 2 < map.rows());
        for (uint32_t r = row - 1; r <= row + 2; ++r) map.begin_row(r, cache.data());
        CHECK(at(map.depth(p, cache.data(), found)) == doctest::Approx(sigma * (3 - z)).epsilon(1e-4));
    }
    CHECK(found == 50 * 16);
}

TEST_CASE(WISP_ARITH_NAME ": along lines of a deep shadow map depths are those of rays, wherever the light is") {
    const std::vector<Particle> particles = cloud(500, 6, 1, 0.3);
    std::vector<float> samples(24 * 30 * 20);
    Sequence random{11};
    for (float &sample : samples) sample = 0.05f + 0.1f * float(random());
    const GridDescription grid = {24, 30,         20,           samples.data(),
                                  1,  {2, -1, 3}, {12, 15, 10}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (const std::vector<SmokeDescription> &list :
         {std::vector<SmokeDescription>{smoke_of(particles)}, {grid_smoke_of(grid)}}) {
        const Resampled built(list, 0.5);
        const SparseGrid &bricks = built.bricks();
        const Box &box = bricks.bounds;
        const auto in_box = [&](double x, double y, double z) {
            const Vec3 size = box.high - box.low;
            return box.low + Vec3(to_real<Real>(x) * size.x, to_real<Real>(y) * size.y, to_real<Real>(z) * size.z);
        };
        std::vector<Light> lights;
        for (const Vec3 &position :
             {in_box(5, 3, -4), in_box(0.4, 0.3, 1.02), in_box(0.45, 0.6, 0.52), in_box(0, 0, 0)})
            lights.push_back({LightKind::point, position, Vec3(Real(0)), Real(2), Color(Real(1))});
        for (const Vec3 &way : {vec(0, 0, -1), vec(-0.6, 0.64, 0.48)})
            lights.push_back({LightKind::parallel, Vec3(Real(0)), way, Real(0), Color(Real(1))});
        for (size_t l = 0; l < lights.size(); ++l) {
            CAPTURE(l);
            std::vector<unsigned char> memory(optical_depth_grid_bytes(bricks.count, 1, 1));
            Arena arena(memory.data(), memory.size());
            OpticalDepthGrid depths;
            uint64_t lines = 0;
            REQUIRE(make_optical_depth_grid(built.medium, &lights[l], 1, bricks, 1, arena, &lines, depths));
            CHECK(lines < uint64_t{bricks.count} * nodes_of(1) / 3);
            double squares = 0, sum = 0, deepest = 0;
            int count = 0;
            while (count < 2000) {
                const Vec3 x = in_box(random(), random(), random());
                if (!(extinction(built.field(), x) > Real(0))) continue; // only points in smoke are asked for
                ++count;
                const Illumination from = illuminate(lights[l], x, x, x);
                const double exact = at(optical_depth(built.medium, {x, -from.direction}, from.distance));
                const double error = at(optical_depth_to_light(depths, 0, x)) - exact;
                squares += error * error;
                sum += error;
                deepest = std::max(deepest, exact);
            }
            CAPTURE(deepest);
            CHECK(std::sqrt(squares / count) < 0.015 * deepest);
            CHECK(std::fabs(sum / count) < 0.002 * deepest);
        }
    }
}
