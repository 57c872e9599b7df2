// Scenes that are chosen for files of smoke: their numbers against closed forms, and what they frame.
#include "host/prepare/chosen_scene.h"
#include "host/base/double3_algebra.h"
#include "host/scene/scene_file.h"
#include "support/refusal.h"
#include "support/temporary_folder.h"
#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>
#include <fstream>
#include <vector>

using namespace wisp;

namespace {

constexpr double pi_ = 3.14159265358979323846;

struct ChosenSceneTest : TemporaryFolder {
    void write(const std::string &name, const std::vector<Double3> &points) const {
        std::ofstream out(file(name));
        out.precision(17);
        out << "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS " << points.size() << " double\n";
        for (const Double3 &p : points) out << p.x << " " << p.y << " " << p.z << "\n";
    }
    SceneFile choose(const std::string &name, const Options &options = {}) const {
        return parse_scene(file("s.aff"), ChosenScene(file(name), options).text(name));
    }
};

// n x n x n points, so far apart.
std::vector<Double3> cube(int n, double spacing, const Double3 &low = {0, 0, 0}) {
    std::vector<Double3> points;
    for (int i = 0; i < n * n * n; ++i)
        points.push_back(low + Double3{double(i % n), double(i / n % n), double(i / n / n)} * spacing);
    return points;
}

// Where p is in the picture: -1 to 1 from edge to edge.
std::pair<double, double> in_picture(const SceneFile::View &view, const Double3 &p) {
    const Double3 back = unit(view.from - view.at), right = unit(cross(view.up, back)), up = cross(back, right);
    const double depth = dot(view.from - p, back), half = std::tan(view.angle * pi_ / 360);
    REQUIRE(depth > 0);
    return {dot(p - view.from, right) / (depth * half) * view.height / view.width,
            dot(p - view.from, up) / (depth * half)};
}

} // namespace

TEST_CASE_FIXTURE(ChosenSceneTest, "chosen scene: the smoothing length is 1.2 times the spacing, whatever the shape") {
    write("cube.vtk", cube(20, 0.1));
    CHECK(*choose("cube.vtk").smokes[0].radius == doctest::Approx(0.12).epsilon(0.1));
    write("small.vtk", cube(20, 1e-5, {3, 4, 5}));
    CHECK(*choose("small.vtk").smokes[0].radius == doctest::Approx(1.2e-5).epsilon(0.1));
    // Two cubes far apart: the volume is theirs, not that of the box around both.
    std::vector<Double3> both = cube(20, 0.1), other = cube(20, 0.1, {100, 50, 0});
    both.insert(both.end(), other.begin(), other.end());
    write("both.vtk", both);
    CHECK(*choose("both.vtk").smokes[0].radius == doctest::Approx(0.12).epsilon(0.15));
    // Few points, which one cube of any size holds.
    write("few.vtk", {{0, 0, 0}, {0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}, {0.3, 0.3, 0.3}, {0.4, 0.4, 0.4}});
    CHECK(*choose("few.vtk").smokes[0].radius == doctest::Approx(1.2 * 0.4 / std::cbrt(5)));
    // On a plane cubes hold points in one layer: the edge is sqrt(2) times their spacing.
    std::vector<Double3> plane;
    for (int i = 0; i < 10000; ++i) plane.push_back({0.1 * (i % 100), 0.1 * (i / 100), 0});
    write("plane.vtk", plane);
    CHECK(*choose("plane.vtk").smokes[0].radius == doctest::Approx(0.12 * std::sqrt(2)).epsilon(0.1));
}

TEST_CASE_FIXTURE(ChosenSceneTest, "chosen scene: rays that meet smoke have a mean depth of 2") {
    // A ball, whose supports reach a known radius: it covers the area of a circle.
    std::vector<Double3> ball;
    for (const Double3 &p : cube(60, 0.1, {-2.95, -2.95, -2.95}))
        if (length(p) < 2.5) ball.push_back(p);
    write("ball.vtk", ball);
    const SceneFile scene = choose("ball.vtk");
    const SceneFile::SmokeVolume &smoke = scene.smokes[0];
    CHECK(*smoke.mass == 1);
    const double covered = 2.5 + 2 * *smoke.radius, area = pi_ * covered * covered;
    CHECK(*smoke.extinction * double(ball.size()) / area == doctest::Approx(2).epsilon(0.03));
    // What is so far apart would need more than a scene may say.
    std::vector<Double3> far;
    for (const Double3 &p : cube(3, 1e16)) far.push_back(p);
    write("far.vtk", far);
    CHECK(*choose("far.vtk").smokes[0].extinction == 1e30);
}

TEST_CASE_FIXTURE(ChosenSceneTest, "chosen scene: all smoke is in the picture, and fills most of it") {
    for (const double scale : {1e-3, 1.0, 1e4})
        for (const bool z_up : {false, true})
            for (const Double3 &stretch : {Double3{1, 1, 1}, Double3{4, 0.5, 1}, Double3{0.3, 5, 0.3}}) {
                std::vector<Double3> points = cube(12, scale, {scale, 7 * scale, -5 * scale});
                for (Double3 &p : points) p = {p.x * stretch.x, p.y * stretch.y, p.z * stretch.z};
                write("c.vtk", points);
                Options options;
                options.up = z_up ? Options::Up::z : Options::Up::y;
                for (const int width : {0, 100}) {
                    if (width) options.width = width, options.height = 70;
                    const SceneFile scene = choose("c.vtk", options);
                    CHECK((z_up ? scene.view->up.z : scene.view->up.y) == 1);
                    double widest = 0;
                    for (const Double3 &p : points) {
                        const auto [x, y] = in_picture(*scene.view, p);
                        widest = std::max({widest, std::fabs(x), std::fabs(y)});
                    }
                    CHECK(widest < 0.98);
                    CHECK(widest > 0.4);
                }
            }
}

TEST_CASE_FIXTURE(ChosenSceneTest, "chosen scene: a few strays do not make the smoke a dot") {
    std::vector<Double3> points = cube(20, 0.1);
    const SceneFile::View alone = [&] { return write("c.vtk", points), *choose("c.vtk").view; }();
    for (int i = 0; i < 5; ++i) points.push_back({1000.0 * (i + 1), -500.0 * i, 300});
    write("c.vtk", points);
    const SceneFile scene = choose("c.vtk");
    CHECK(length(scene.view->from - scene.view->at) < 1.3 * length(alone.from - alone.at));
    CHECK(*scene.smokes[0].radius == doctest::Approx(0.12).epsilon(0.1));
    CHECK(length(scene.view->at - alone.at) < 0.3);
}

TEST_CASE_FIXTURE(ChosenSceneTest, "chosen scene: a sequence has one frame for each file, and one framing of all") {
    for (const int i : {3, 5, 7}) write("s_00" + std::to_string(i) + ".vtk", cube(12, 0.1, {i - 3.0, 0, 0}));
    write("s_0011.vtk", cube(12, 0.1, {50, 0, 0})); // another name: four digits
    write("s_012.vtk", cube(12, 0.1, {50, 0, 0}));  // behind a gap
    const SceneFile scene = choose("s_%03d.vtk");
    CHECK(scene.animation->frames == 3);
    CHECK(scene.smokes[0].first_frame == 3);
    CHECK(scene.smokes[0].frame_step == 2);
    for (const double x : {0.0, 5.1}) {
        const auto [across, down] = in_picture(*scene.view, {x, 0.5, 0.5});
        CHECK(std::fabs(across) < 0.98);
        CHECK(std::fabs(across) > 0.4);
        CHECK(std::fabs(down) < 0.98);
    }
}

TEST_CASE_FIXTURE(ChosenSceneTest, "chosen scene: the order of the particles does not matter, nor does their place") {
    std::vector<Double3> points = cube(9, 0.25);
    write("c.vtk", points);
    const std::string text = ChosenScene(file("c.vtk"), {}).text("c.vtk");
    std::reverse(points.begin(), points.end());
    write("c.vtk", points);
    CHECK(ChosenScene(file("c.vtk"), {}).text("c.vtk") == text);
}

TEST_CASE_FIXTURE(ChosenSceneTest, "chosen scene: one particle, equal ones, and none") {
    write("one.vtk", {{1, 2, 3}});
    CHECK(*choose("one.vtk").smokes[0].radius == 1);
    write("equal.vtk", std::vector<Double3>(10, {1, 2, 3}));
    CHECK(*choose("equal.vtk").smokes[0].extinction > 0);
    write("none.vtk", {});
    CHECK(refusal_of([&] { choose("none.vtk"); }) ==
          file("none.vtk") + ": no smoke, expected particles, or a density grid with samples above 0");
    CHECK(refusal_of([&] { choose("x_%d.vtk"); }) ==
          file("x_%d.vtk") + ": no file has a name like this, expected some with numbers in it");
    write("far.vtk", {{0, 0, 0}, {1e31, 0, 0}});
    CHECK(refusal_of([&] { choose("far.vtk"); }).rfind(file("far.vtk") + ": a particle is outside +-1e30", 0) == 0);
}

TEST_CASE_FIXTURE(ChosenSceneTest, "chosen scene: a ground lies right below the smoke, unless it is not wanted") {
    write("c.vtk", cube(10, 0.1, {0, 5, 0}));
    Options options;
    const std::string with = ChosenScene(file("c.vtk"), options).text("c.vtk");
    options.ground = false;
    const std::string without = ChosenScene(file("c.vtk"), options).text("c.vtk");
    CHECK(with.find("\np 4") != std::string::npos);
    CHECK(with.rfind(without, 0) == 0); // it is added behind
    CHECK(without.find("\np 4") == std::string::npos);
}

TEST_CASE_FIXTURE(ChosenSceneTest,
                  "complete scene: only what is left out is chosen, from the first file of a sequence") {
    write("s_1.vtk", cube(20, 0.1));
    write("s_2.vtk", cube(20, 0.5));
    const auto completed = [&](const std::string &more, bool with_view = true) {
        const std::string view = "v from 0 0 9 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 4 3\n";
        SceneFile scene = parse_scene(
            file("s.aff"), (with_view ? view : "") + "l 9 9 9 1 1 1\nsmoke s_%d.vtk {\n frames 1 1\n" + more + "}\n");
        const std::vector<std::string> lines = complete_scene(scene);
        return std::pair(scene, lines);
    };
    const auto [all, lines] = completed("");
    CHECK(*all.smokes[0].radius == doctest::Approx(0.12).epsilon(0.1));
    CHECK(*all.smokes[0].mass == 1);
    CHECK(*all.smokes[0].extinction > 0);
    CHECK(all.view->from.z == 9);
    CHECK(lines.size() == 1);
    const auto [thin, thin_lines] = completed(" mass 2\n");
    CHECK(*thin.smokes[0].radius == *all.smokes[0].radius);
    CHECK(*thin.smokes[0].mass == 2);
    CHECK_FALSE(thin.smokes[0].extinction); // 1, as ever
    const auto [given, nothing] = completed(" radius 0.3\n mass 2\n");
    CHECK(*given.smokes[0].radius == 0.3);
    CHECK(nothing.empty());
    // A larger radius covers more, so that the same mean depth takes more extinction.
    CHECK(*completed(" radius 0.3\n").first.smokes[0].extinction > 1.1 * *all.smokes[0].extinction);
    // The camera frames the smoke where its transform puts it.
    const SceneFile moved = completed(" transform 2 2 2 0 0 1 0 50 60 70\n", false).first;
    for (const Double3 &p : cube(20, 0.2, {50, 60, 70})) {
        const auto [x, y] = in_picture(*moved.view, p);
        CHECK(std::max(std::fabs(x), std::fabs(y)) < 0.98);
    }
}
