// Particles that are far from everything else: which are left out, which stay, and which scene is refused.
#include "host/prepare/prepare.h"
#include "host/prepare/scene_warnings.h"
#include "support/refusal.h"
#include "support/temporary_folder.h"
#include <doctest/doctest.h>
#include <fstream>

using namespace wisp;

namespace {

// A cloud of 200 particles with smoothing lengths of 0.25 in a cube with edge 4, seen from z = 8, and others.
struct StrayTest : TemporaryFolder {
    explicit StrayTest(const std::vector<Double3> &others, const std::string &more = "") {
        std::ofstream out(file("p.vtk"));
        out << "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS " << 200 + others.size() << " double\n";
        for (const Double3 &p : others) out << p.x << " " << p.y << " " << p.z << "\n"; // before the cloud
        for (int i = 0; i < 600; ++i) out << 4 * ((i * 37 % 101) / 100.0 - 0.5) << " ";
        scene = parse_scene(file("s.aff"), "v from 0 0 8 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 40 40\n"
                                           "lp 6 8 5 400 380 340\n" +
                                               more + "smoke p.vtk {\n radius 0.25\n mass 0.01\n}\n");
    }
    std::string prepare(Arithmetic arithmetic = Arithmetic::f32) {
        Options options;
        options.arithmetic = arithmetic;
        return refusal_of([&] { prepare_scene(file("s.aff"), scene, options, 0, prepared); });
    }
    size_t left() const { return prepared.particles[0].size(); }

    SceneFile scene;
    PreparedScene prepared;
};

constexpr Arithmetic arithmetics[] = {Arithmetic::f32, Arithmetic::f64, Arithmetic::fixed};

} // namespace

TEST_CASE("strays: one that no picture shows is left out, with a warning, and the rest is as without it") {
    StrayTest alone({});
    for (const Arithmetic arithmetic : arithmetics) {
        REQUIRE(alone.prepare(arithmetic) == "no error");
        for (const Double3 &far : {Double3{1e7, 0, 0}, Double3{-3e3, 4e3, 5e3}, Double3{1e7, 1e7, -1e7}}) {
            StrayTest test({{0.5, 0.5, 0.5}, far});
            REQUIRE(test.prepare(arithmetic) == "no error");
            REQUIRE(test.left() == 201);
            CHECK(test.prepared.scale == alone.prepared.scale);
            CHECK(test.prepared.center.x == alone.prepared.center.x);
            REQUIRE(test.prepared.warnings.size() == 1);
            const Warning &warning = test.prepared.warnings[0];
            CHECK(warning.place == test.file("s.aff") + ":3");
            CHECK(warning.text.rfind("1 particle is left out, too far from everything else for a picture to show: "
                                     "point 1 of " +
                                         test.file("p.vtk") + " is at ",
                                     0) == 0);
        }
    }
    CHECK(alone.prepared.warnings.empty());
}

TEST_CASE("strays: what is in view, or may shade the rest, or is many, stays") {
    const double ahead = 65537 * 0.25, aside = 8193 * 0.25; // from the middle of the picture; out of it
    const auto left = [](const Double3 &p, const std::string &more = "", int copies = 1) {
        StrayTest test(std::vector<Double3>(static_cast<size_t>(copies), p), more);
        const std::string refused = test.prepare();
        return refused == "no error" ? static_cast<int>(test.left()) - 200 : -1;
    };
    // In view, behind the cloud. The unit holds it to 65,536 smoothing lengths and more.
    CHECK(left({0, 0, -0.9 * ahead}) == 1);
    CHECK(left({0, 0, -1.1 * ahead}) == 0);
    // Out of view. Nearer ones are in the unit anyway.
    CHECK(left({2 * aside + 10, 0, 0}) == 0);
    CHECK(left({2 * aside - 10, 0, 0}) == 1);
    // A mirror shows everything.
    CHECK(left({2 * aside, 0, 0}, "f 1 1 1 0.5 0.5 9 0 1\ns 0 0 0 1\n") == 1);
    CHECK(left({1e7, 0, 0}, "f 1 1 1 0.5 0.5 9 0 1\ns 0 0 0 1\n") == 0);
    CHECK(left({40 * aside, 0, 0}, "f 1 1 1 0.5 0 9 0 1\ns 0 0 0 1\n") == 0);
    // A parallel light that shines past it on the cloud, and one that does not.
    CHECK(left({3 * aside, 0, 0}, "ld -1 0 0 1 1 1\n") == 1);
    CHECK(left({3 * aside, 0, 0}, "ld 1 0 0 1 1 1\n") == 0);
    // Many of them: as a cloud they can be seen.
    CHECK(left({0, 0, -1.1 * ahead}, "", 3) == 3);
    CHECK(left({0, 0, -2.5 * ahead}, "", 3) == 0);
    CHECK(left({0, 0, -2.5 * ahead}, "", 15) == -1);
    CHECK(left({0, 0, -1e7}, "", 15) == 0);
}

TEST_CASE("strays: a scene that cannot be held names its farthest particle, and what would be held") {
    StrayTest test({{0, 0, 0}, {0, 0, 0}, {1e7, 0, 0}}, "ld -1 0 0 1 1 1\n");
    const std::string line = test.file("s.aff") +
                             ":4: point 2 is at 1e+07 0 0, 1e+07 from the middle, too far beside a "
                             "smoothing length of 0.25, expected at most 3.3e+04";
    for (const Arithmetic arithmetic : arithmetics) CHECK(test.prepare(arithmetic) == line);
    StrayTest beside({{2e4, 0, 0}, {2e5, 0, 0}}, "ld -1 0 0 1 1 1\ns 0 0 0 4\n");
    CHECK(beside.prepare(Arithmetic::f32) == "no error");
    CHECK(beside.prepare(Arithmetic::fixed) ==
          beside.file("s.aff") +
              ":5: point 1 is at 2e+05 0 0, 2e+05 from the middle, too far beside a smoothing length "
              "of 0.25, expected at most 3.3e+04, or --arith f32");
}

TEST_CASE("strays: two clouds of like size that are far apart are no strays") {
    std::vector<Double3> other;
    for (int i = 0; i < 200; ++i) other.push_back({1e6 + i % 7, i % 5 * 1.0, i % 3 * 1.0});
    StrayTest test(other);
    CHECK(test.prepare().find(" from the middle, too far beside a smoothing length of 0.25") != std::string::npos);
}
