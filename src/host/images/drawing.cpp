#include "host/images/drawing.h"
#include "core/numbers/elementary.h"
#include <algorithm>
#include <cmath>

namespace wisp {

namespace {

// Five colours of the map, in 8-bit sRGB.
constexpr double magma[5][3] = {{0, 0, 0}, {81, 18, 124}, {183, 55, 121}, {252, 137, 97}, {252, 253, 191}};

float *pixel_of(Picture &picture, int x, int y) {
    return &picture.rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(picture.width) + static_cast<size_t>(x))];
}

void add(Picture &picture, int x, int y, const Double3 &light, double fraction) {
    if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) return;
    float *rgb = pixel_of(picture, x, y);
    rgb[0] += static_cast<float>(light.x * fraction);
    rgb[1] += static_cast<float>(light.y * fraction);
    rgb[2] += static_cast<float>(light.z * fraction);
}

void blend(float *rgb, const Double3 &color, double fraction) {
    const double of[3] = {color.x, color.y, color.z};
    for (int c = 0; c < 3; ++c) rgb[c] = static_cast<float>(rgb[c] + fraction * (of[c] - static_cast<double>(rgb[c])));
}

// Keeps of the part [from, to] of a line where start + part * step is from 0 to `end`.
void clip(double start, double step, double end, double &from, double &to) {
    if (step == 0) {
        if (!(start >= 0 && start <= end)) to = -1;
        return;
    }
    const double a = -start / step, b = (end - start) / step;
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
}

} // namespace

Double3 heat_color(double value) {
    const double position = 4 * std::clamp(value, 0.0, 1.0);
    const int low = std::min(static_cast<int>(position), 3);
    const auto channel = [&](int c) {
        return srgb_to_linear((magma[low][c] + (position - low) * (magma[low + 1][c] - magma[low][c])) / 255);
    };
    return {channel(0), channel(1), channel(2)};
}

Picture heat_picture(int width, int height, const std::vector<double> &values, double most, const Double3 &none) {
    Picture picture{width, height, {}};
    picture.rgb.reserve(3 * values.size());
    for (const double value : values) {
        const Double3 color = value != value ? none : heat_color(most > 0 ? value / most : 0);
        for (const double channel : {color.x, color.y, color.z}) picture.rgb.push_back(static_cast<float>(channel));
    }
    return picture;
}

void add_point(Picture &picture, double x, double y, const Double3 &light) {
    if (!(x > -1 && y > -1 && x < picture.width + 1 && y < picture.height + 1)) return;
    const int i = floor_to_int(x - 0.5), j = floor_to_int(y - 0.5);
    const double u = x - 0.5 - i, v = y - 0.5 - j;
    add(picture, i, j, light, (1 - u) * (1 - v));
    add(picture, i + 1, j, light, u * (1 - v));
    add(picture, i, j + 1, light, (1 - u) * v);
    add(picture, i + 1, j + 1, light, u * v);
}

void add_line(Picture &picture, double x0, double y0, double x1, double y1, const Double3 &light) {
    const double dx = x1 - x0, dy = y1 - y0;
    double from = 0, to = 1;
    clip(x0, dx, picture.width, from, to);
    clip(y0, dy, picture.height, from, to);
    if (!(from < to)) return;
    const double length = std::max(std::fabs(dx), std::fabs(dy)) * (to - from);
    const int points = static_cast<int>(length) + 1;
    for (int i = 0; i < points; ++i) {
        const double at = from + (to - from) * (i + 0.5) / points;
        add_point(picture, x0 + at * dx, y0 + at * dy, light);
    }
}

void draw_disc(Picture &picture, double x, double y, double radius, const Double3 &color) {
    const auto within = [](double at, int end) { return static_cast<int>(std::clamp(at, 0.0, end * 1.0)); };
    const int right = within(x + radius + 1, picture.width), bottom = within(y + radius + 1, picture.height);
    for (int j = within(y - radius, picture.height); j < bottom; ++j)
        for (int i = within(x - radius, picture.width); i < right; ++i) {
            const double u = i + 0.5 - x, v = j + 0.5 - y;
            const double covered = std::clamp(radius + 0.5 - std::sqrt(u * u + v * v), 0.0, 1.0);
            blend(pixel_of(picture, i, j), color, covered);
        }
}

void draw_borders(Picture &picture, const std::vector<uint64_t> &cells, const Double3 &color, double fraction) {
    const auto cell = [&](int x, int y) {
        return cells[static_cast<size_t>(y) * static_cast<size_t>(picture.width) + static_cast<size_t>(x)];
    };
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x)
            if ((x + 1 < picture.width && cell(x, y) != cell(x + 1, y)) ||
                (y + 1 < picture.height && cell(x, y) != cell(x, y + 1)))
                blend(pixel_of(picture, x, y), color, fraction);
}

} // namespace wisp
