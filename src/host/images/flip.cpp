// Two pipelines of the paper meet in one error: colours filtered as the eye does, and edges and points ("features") of
// the unfiltered luminance. All filters are separable; beyond the border the nearest pixel is repeated. Double
// throughout, sums in a fixed order, wisp's own exp, log and cbrt: the same figures on every machine.
#include "core/numbers/elementary.h"
#include "host/images/flip.h"
#include <algorithm>
#include <array>
#include <cmath>

namespace wisp {
namespace {

constexpr double pi_squared = pi<double> * pi<double>;
constexpr double pixels_per_degree = 3840 * pi<double> / 180; // 3840 pixels on 0.7 m, seen from 0.7 m

// The paper's q_c, q_f: exponents of colour and features; p_c, p_t: where the knee of the colour error is.
constexpr double q_c = 0.7, q_f = 0.5, p_c = 0.4, p_t = 0.95;

using Triple = std::array<double, 3>;
using Plane = std::vector<double>; // one value a pixel, rows from the top

// ---- Colour spaces

// Linear sRGB to CIE XYZ divided by that of white, so that white is (1, 1, 1), and back. The fractions are exact: the
// primaries of sRGB with D65 at (0.31271, 0.32902).
constexpr double xyz_of_rgb[3][3] = {{10135552. / 23359437, 8788810. / 23359437, 4435075. / 23359437},
                                     {2613072. / 12288897, 8788810. / 12288897, 887015. / 12288897},
                                     {1425312. / 80288307, 8788810. / 80288307, 70074185. / 80288307}};
constexpr double rgb_of_xyz[3][3] = {{3.080341988280461, -1.5373989694887855, -0.5429430187916751},
                                     {-0.9211783961651236, 1.875929983695176, 0.04524841246994758},
                                     {0.05288129287554325, -0.20401120612390997, 1.1511299132483668}};

constexpr bool are_inverse(const double (&m)[3][3], const double (&n)[3][3]) {
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            const double error = m[i][0] * n[0][j] + m[i][1] * n[1][j] + m[i][2] * n[2][j] - (i == j ? 1 : 0);
            if (error > 1e-15 || error < -1e-15) return false;
        }
    }
    return true;
}
static_assert(are_inverse(xyz_of_rgb, rgb_of_xyz), "rgb_of_xyz is the inverse of xyz_of_rgb");

Triple multiply(const double (&m)[3][3], const Triple &v) {
    Triple product;
    for (int i = 0; i < 3; ++i) product[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
    return product;
}

// YCxCz, the linear opponent space in which the eye's filters act, and back.
Triple ycxcz_of_rgb(const Triple &rgb) {
    const Triple xyz = multiply(xyz_of_rgb, rgb);
    return {116 * xyz[1] - 16, 500 * (xyz[0] - xyz[1]), 200 * (xyz[1] - xyz[2])};
}
Triple rgb_of_ycxcz(const Triple &c) {
    const double y = (c[0] + 16) / 116;
    return multiply(rgb_of_xyz, {y + c[1] / 500, y, y - c[2] / 200});
}

// CIE L*a*b*, a* and b* scaled by 0.01 L*: chroma counts less in the dark (Hunt effect).
Triple hunt_lab_of_rgb(const Triple &rgb) {
    Triple f = multiply(xyz_of_rgb, rgb);
    constexpr double delta = 6. / 29;
    for (double &t : f) t = t > delta * delta * delta ? cbrt(t) : t / (3 * delta * delta) + 4. / 29;
    const double lightness = 116 * f[1] - 16;
    return {lightness, 0.01 * lightness * 500 * (f[0] - f[1]), 0.01 * lightness * 200 * (f[1] - f[2])};
}

// ---- Filters

// Weights at -radius .. radius.
using Filter = std::vector<double>;

// Divides the positive weights by their sum, and the negative ones by theirs: they sum to 1 and -1.
Filter normalized(Filter filter) {
    double positive = 0, negative = 0;
    for (double weight : filter) (weight > 0 ? positive : negative) += weight;
    for (double &weight : filter) weight /= weight > 0 ? positive : -negative;
    return filter;
}

// Contrast sensitivity, spatial filtering: exp(-pi^2 x^2 / b), x in degrees.
constexpr int spatial_radius = 10; // three standard deviations of the widest, rounded up: 3 sqrt(b / (2 pi^2)) = 9.05
double spatial_weight(int offset, double b) {
    const double x = offset / pixels_per_degree;
    return exp(-pi_squared * x * x / b);
}
Filter spatial_filter(double b) {
    Filter filter;
    for (int i = -spatial_radius; i <= spatial_radius; ++i) filter.push_back(spatial_weight(i, b));
    return normalized(filter);
}

// Gaussian and its derivatives, feature detection: the standard deviation is half of an edge's width, 0.082 degrees.
constexpr double feature_sigma = 0.5 * 0.082 * pixels_per_degree;
constexpr int feature_radius = 9; // 3 feature_sigma = 8.24, rounded up
Filter feature_filter(int derivative) {
    Filter filter;
    for (int i = -feature_radius; i <= feature_radius; ++i) {
        const double x = i / feature_sigma, g = exp(-x * x / 2);
        filter.push_back(derivative == 0 ? g : derivative == 1 ? -x * g : (x * x - 1) * g);
    }
    return normalized(filter);
}

Plane filter_rows(const Plane &in, int width, const Filter &filter) {
    const int radius = static_cast<int>(filter.size() / 2);
    Plane out(in.size()), padded(width + 2 * radius);
    for (size_t row = 0; row < in.size(); row += width) {
        for (int x = 0; x < width + 2 * radius; ++x) padded[x] = in[row + std::clamp(x - radius, 0, width - 1)];
        for (size_t k = 0; k < filter.size(); ++k)
            for (int x = 0; x < width; ++x) out[row + x] += filter[k] * padded[x + k];
    }
    return out;
}

Plane filter_columns(const Plane &in, int width, const Filter &filter) {
    const int radius = static_cast<int>(filter.size() / 2), height = static_cast<int>(in.size() / width);
    Plane out(in.size());
    for (int y = 0; y < height; ++y) {
        double *to = &out[size_t(y) * width];
        for (int k = 0; k <= 2 * radius; ++k) {
            const double *from = &in[size_t(std::clamp(y + k - radius, 0, height - 1)) * width];
            for (int x = 0; x < width; ++x) to[x] += filter[k] * from[x];
        }
    }
    return out;
}

Plane filtered(const Plane &in, int width, const Filter &along_x, const Filter &along_y) {
    return filter_columns(filter_rows(in, width, along_x), width, along_y);
}

// ---- One picture

// What an observer sees of each pixel.
struct Percept {
    std::vector<Triple> color; // L*a*b* after the filters, with the Hunt effect
    Plane edges, points;       // strength of an edge and of a point, 0 to sqrt(2)
};

// The picture in YCxCz, as PNG shows it.
std::array<Plane, 3> shown_ycxcz(const Picture &picture) {
    double linear[256];
    for (int k = 0; k < 256; ++k) linear[k] = srgb_to_linear(k / 255.);
    const Bytes bytes = srgb_bytes(picture);
    std::array<Plane, 3> planes;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        const Triple c = ycxcz_of_rgb({linear[bytes[i]], linear[bytes[i + 1]], linear[bytes[i + 2]]});
        for (int k = 0; k < 3; ++k) planes[k].push_back(c[k]);
    }
    return planes;
}

// Spatial filtering: one Gaussian each for Y (b = 0.0047) and Cx (0.0053), the sum of two for Cz: a = 34.1, b = 0.04
// and a = 13.5, b = 0.025, each a sqrt(pi / b) exp(-pi^2 x^2 / b).
std::vector<Triple> filtered_colors(const std::array<Plane, 3> &ycxcz, int width) {
    const Filter y_filter = spatial_filter(0.0047), cx_filter = spatial_filter(0.0053);
    const Plane y = filtered(ycxcz[0], width, y_filter, y_filter), cx = filtered(ycxcz[1], width, cx_filter, cx_filter);

    const Filter wide_filter = spatial_filter(0.04), narrow_filter = spatial_filter(0.025);
    const Plane wide = filtered(ycxcz[2], width, wide_filter, wide_filter);
    const Plane narrow = filtered(ycxcz[2], width, narrow_filter, narrow_filter);
    // The filters above sum to 1; the weight of each is its sum before that, which follows from its value at 0.
    const double wide_peak = wide_filter[spatial_radius], narrow_peak = narrow_filter[spatial_radius];
    const double wide_sum = 34.1 * std::sqrt(pi<double> / 0.04) / (wide_peak * wide_peak);
    const double narrow_sum = 13.5 * std::sqrt(pi<double> / 0.025) / (narrow_peak * narrow_peak);
    const double wide_weight = wide_sum / (wide_sum + narrow_sum);

    std::vector<Triple> colors(y.size());
    for (size_t i = 0; i < colors.size(); ++i) {
        const double cz = wide_weight * wide[i] + (1 - wide_weight) * narrow[i];
        Triple rgb = rgb_of_ycxcz({y[i], cx[i], cz});
        for (double &c : rgb) c = std::clamp(c, 0.0, 1.0);
        colors[i] = hunt_lab_of_rgb(rgb);
    }
    return colors;
}

// The length of the filter's answers along x and along y.
Plane feature_strength(const Plane &luminance, int width, int derivative) {
    const Filter smooth = feature_filter(0), detector = feature_filter(derivative);
    Plane along_x = filtered(luminance, width, detector, smooth);
    const Plane along_y = filtered(luminance, width, smooth, detector);
    for (size_t i = 0; i < along_x.size(); ++i)
        along_x[i] = std::sqrt(along_x[i] * along_x[i] + along_y[i] * along_y[i]);
    return along_x;
}

Percept perceive(const Picture &picture) {
    const std::array<Plane, 3> ycxcz = shown_ycxcz(picture);
    Plane luminance = ycxcz[0];
    for (double &y : luminance) y = (y + 16) / 116; // 0 to 1
    return {filtered_colors(ycxcz, picture.width), feature_strength(luminance, picture.width, 1),
            feature_strength(luminance, picture.width, 2)};
}

// ---- Two pictures

// x^y for x >= 0 and y > 0.
double power(double x, double y) { return x > 0 ? exp(y * log(x)) : 0; }

// HyAB distance to the power q_c.
double color_distance(const Triple &a, const Triple &b) {
    const double da = a[1] - b[1], db = a[2] - b[2];
    return power(std::abs(a[0] - b[0]) + std::sqrt(da * da + db * db), q_c);
}

// Error redistribution: distances up to p_c of the largest one, green to blue, fill 0 to p_t, the others p_t to 1.
double color_error(double distance, double largest) {
    const double knee = p_c * largest;
    if (distance < knee) return p_t * distance / knee;
    return p_t + (1 - p_t) * (distance - knee) / (largest - knee);
}

} // namespace

std::vector<double> flip(const Picture &a, const Picture &b) {
    const Percept pa = perceive(a), pb = perceive(b);
    const double largest = color_distance(hunt_lab_of_rgb({0, 1, 0}), hunt_lab_of_rgb({0, 0, 1}));
    std::vector<double> errors(pa.color.size());
    for (size_t i = 0; i < errors.size(); ++i) {
        const double color = color_error(color_distance(pa.color[i], pb.color[i]), largest);
        const double edge = std::abs(pa.edges[i] - pb.edges[i]), point = std::abs(pa.points[i] - pb.points[i]);
        const double feature = power(std::max(edge, point) / std::sqrt(2.0), q_f);
        errors[i] = power(color, 1 - feature); // features raise the colour error
    }
    return errors;
}

} // namespace wisp
