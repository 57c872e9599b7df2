// Where points are in a drawing: a point of a camera ray is in that ray's pixel, and the section of a cube is a square.
#include "host/commands/projection.h"
#include <doctest/doctest.h>

namespace wisp {

namespace {

// Oblique, 40 x 30 pixels.
const Camera camera = {{1, 2, 3}, {-0.5, 0.4, -1}, {0.025, 0.001, 0.002}, {0.001, -0.0275, 0.003}};

Double3 on_ray(double column, double row, double depth) {
    return camera.origin + (camera.corner + camera.right * column + camera.down * row) * depth;
}

// A cube of 12 triangles around the origin, half of whose edge is 1.
std::vector<Triangle> cube() {
    std::vector<Triangle> triangles;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) {
            const auto corner = [&](double u, double v) {
                const double at[3] = {side, u, v};
                return Double3{at[(3 - axis) % 3], at[(4 - axis) % 3], at[(5 - axis) % 3]};
            };
            triangles.push_back({{corner(-1, -1), corner(1, -1), corner(1, 1)}, {}, {}, 0, -1});
            triangles.push_back({{corner(-1, -1), corner(1, 1), corner(-1, 1)}, {}, {}, 0, -1});
        }
    return triangles;
}

} // namespace

TEST_CASE("projection: points of camera rays are in their pixels, at their depth") {
    const Crop crop = {4, 6, 30, 20};
    const Projection projection(camera, crop);
    for (const double column : {0.0, 12.25, 40.0})
        for (const double row : {0.0, 17.5, 30.0})
            for (const double depth : {0.01, 1.0, 70.0}) {
                const Double3 point = on_ray(column, row, depth);
                const PicturePoint at = projection.place(point);
                CHECK(at.x == doctest::Approx(column - 4));
                CHECK(at.y == doctest::Approx(row - 6));
                CHECK(projection.depth(point) == doctest::Approx(depth));
            }
    CHECK(projection.depth(on_ray(5, 5, -2)) == doctest::Approx(-2)); // behind the eye
    const std::vector<Double3> plane = projection.plane(3);
    REQUIRE(plane.size() == crop.pixels());
    CHECK(projection.place(plane[0]).x == doctest::Approx(0.5));
    CHECK(projection.place(plane.back()).y == doctest::Approx(13.5));
    const Double3 beside = on_ray(7, 7, 2) + unit(camera.right) * 0.3;
    CHECK(projection.place(beside).x - projection.place(on_ray(7, 7, 2)).x == doctest::Approx(projection.size(0.3, 2)));
    const Double3 axis = unit(cross(camera.right, camera.down));
    CHECK(projection.distance(4) == doctest::Approx(std::fabs(dot(on_ray(3, 9, 4) - camera.origin, axis))));
}

TEST_CASE("projection: a section shows a cube as a square, and its pixels are in its plane") {
    const std::vector<Triangle> triangles = cube();
    Scene scene = {};
    scene.triangles = triangles.data();
    scene.static_count = static_cast<uint32_t>(triangles.size());
    const Camera level = {{0, 0.3, 6}, {-0.5, 0.5, -1}, {0.01, 0, 0}, {0, -0.01, 0}};
    Section section(level, 49); // half a pixel above the middle
    const Crop whole = {0, 0, 200, 100};
    REQUIRE(section.fit(scene, 200, 100, whole));
    CHECK(section.segments().size() == 8); // two triangles a side
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (const Section::Segment &segment : section.segments())
        for (const PicturePoint &end : {segment.from, segment.to}) {
            left = std::min(left, end.x), right = std::max(right, end.x);
            top = std::min(top, end.y), bottom = std::max(bottom, end.y);
        }
    CHECK(right - left == doctest::Approx(100 / 1.06).epsilon(0.001));
    CHECK(bottom - top == doctest::Approx(right - left).epsilon(0.001));
    CHECK((left + right) / 2 == doctest::Approx(100));
    CHECK((top + bottom) / 2 == doctest::Approx(50));

    const std::vector<Double3> points = section.points(whole);
    REQUIRE(points.size() == whole.pixels());
    const Double3 normal = unit(cross(level.right, level.corner + level.down * 49.5));
    for (const Double3 &point : points) CHECK(std::fabs(dot(point - level.origin, normal)) < 1e-9);
    CHECK(points.front().z < points.back().z); // the eye looks upwards
    CHECK(points.front().x < points.back().x);
    // A crop shows the same places.
    Section part(level, 49);
    const Crop crop = {30, 20, 60, 50};
    REQUIRE(part.fit(scene, 200, 100, crop));
    CHECK(length(part.points(crop)[0] - points[20 * 200 + 30]) < 1e-12);
    CHECK(part.segments()[0].from.x == doctest::Approx(section.segments()[0].from.x - 30));

    Section beside({{0, 5, 6}, {-0.5, 0, -1}, {0.01, 0, 0}, {0, -0.01, 0}}, 0);
    CHECK(!beside.fit(scene, 200, 100, whole));
}

TEST_CASE("projection: a section has instances where they stand") {
    const std::vector<Triangle> triangles = cube();
    Instance instance = {
        0, static_cast<uint32_t>(triangles.size()), {{0, 0, 2}, {0, 1, 0}, {-2, 0, 0}}, {10, 0, 0}, {}, true};
    Scene scene = {};
    scene.triangles = triangles.data();
    scene.instance_triangle_count = instance.count;
    scene.instances = &instance;
    scene.instance_count = 1;
    const Camera camera_there = {{10, 0.01, 6}, {-0.5, 0.005, -1}, {0.01, 0, 0}, {0, -0.01, 0}};
    Section section(camera_there, 0);
    const Crop crop = {0, 0, 100, 100};
    REQUIRE(section.fit(scene, 100, 100, crop));
    const std::vector<Double3> points = section.points(crop);
    CHECK((points.front().x + points.back().x) / 2 == doctest::Approx(10));
    CHECK(points.back().x - points.front().x == doctest::Approx(4 * 1.06 * 0.99)); // twice as wide as the cube
    instance.visible = false;
    CHECK(!Section(camera_there, 0).fit(scene, 100, 100, crop));
}

} // namespace wisp
