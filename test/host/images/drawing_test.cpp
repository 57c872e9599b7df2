// Drawings: the ends of the colours, and shapes that add as much light as they should, where they should.
#include "host/images/drawing.h"
#include <cmath>
#include <doctest/doctest.h>

namespace wisp {

namespace {

Picture blank(int width, int height) {
    return {width, height, std::vector<float>(3 * static_cast<size_t>(width) * static_cast<size_t>(height))};
}
float red(const Picture &picture, int x, int y) {
    return picture.rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(picture.width) + static_cast<size_t>(x))];
}
double sum(const Picture &picture) {
    double sum = 0;
    for (size_t i = 0; i < picture.rgb.size(); i += 3) sum += static_cast<double>(picture.rgb[i]);
    return sum;
}
constexpr Double3 one = {1, 1, 1};

} // namespace

TEST_CASE("drawing: heat goes from black to light yellow, and grows brighter all the way") {
    CHECK(heat_color(0).x == 0);
    CHECK(heat_color(-1).y == 0);
    CHECK(heat_color(1).x == doctest::Approx(srgb_to_linear(252 / 255.)));
    CHECK(heat_color(2).z == heat_color(1).z);
    const auto brightness = [](const Double3 &c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; };
    for (int i = 0; i < 100; ++i) CHECK(brightness(heat_color(i / 100.)) < brightness(heat_color((i + 1) / 100.)));

    const Picture picture = heat_picture(2, 2, {0, 3, std::nan(""), 6}, 6, {0.5, 0.25, 0.125});
    CHECK(picture.rgb[0] == 0);
    CHECK(double{picture.rgb[3]} == doctest::Approx(heat_color(0.5).x));
    CHECK(picture.rgb[6] == 0.5f);
    CHECK(double{picture.rgb[9]} == doctest::Approx(heat_color(1).x));
    CHECK(heat_picture(1, 1, {0}, 0, one).rgb[0] == 0); // all are 0
}

TEST_CASE("drawing: a point's light is divided among four pixels, and a line's along its length") {
    Picture picture = blank(8, 8);
    add_point(picture, 3.5, 2.5, one);
    CHECK(red(picture, 3, 2) == 1);
    CHECK(sum(picture) == 1);
    add_point(picture, 4, 5, one);
    CHECK(red(picture, 3, 4) == 0.25f);
    CHECK(red(picture, 4, 5) == 0.25f);
    add_point(picture, -5, 3, one);
    add_point(picture, 3, 1e300, one);
    add_point(picture, std::nan(""), 3, one);
    CHECK(sum(picture) == 2);

    Picture lines = blank(64, 48);
    add_line(lines, 10, 20.5, 30, 20.5, one);
    CHECK(sum(lines) == doctest::Approx(20).epsilon(0.06));
    CHECK(red(lines, 20, 20) == doctest::Approx(1).epsilon(0.06));
    CHECK(red(lines, 20, 30) == 0);
    const double before = sum(lines);
    add_line(lines, -1e6, -10, 1e6, -10, one); // outside
    add_line(lines, 70, 0, 70, 48, one);
    CHECK(sum(lines) == before);
    add_line(lines, 5.5, -1e6, 5.5, 1e6, one); // the part inside alone
    CHECK(sum(lines) - before == doctest::Approx(48).epsilon(0.06));
}

TEST_CASE("drawing: a disc covers its area, and borders stand between cells") {
    Picture picture = blank(40, 40);
    draw_disc(picture, 20, 20, 8, one);
    CHECK(sum(picture) == doctest::Approx(3.14159 * 64).epsilon(0.02));
    CHECK(red(picture, 20, 20) == 1);
    CHECK(red(picture, 20, 30) == 0);
    draw_disc(picture, -100, 20, 8, one);
    draw_disc(picture, 20, 1e9, 8, one);
    CHECK(sum(picture) == doctest::Approx(3.14159 * 64).epsilon(0.02));

    Picture cells = blank(4, 3);
    draw_borders(cells, {1, 1, 2, 2, 1, 1, 2, 2, 3, 3, 3, 3}, one, 0.5);
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 4; ++x) CHECK(red(cells, x, y) == ((x == 1 && y < 2) || y == 1 ? 0.5f : 0));
}

} // namespace wisp
