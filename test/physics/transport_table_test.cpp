// The table of transport values against closed forms, and its rows against each other: a number that was changed or
// copied wrongly is found. The formulas are in README.md here.
#include "physics/adding_doubling.h"
#include "physics/transport_rows.h"
#include <map>

using namespace wisp;

namespace {

constexpr double pi = 3.14159265358979323846;

// The integral of f(x, 1 - x) over 0 < x < 1 by the tanh-sinh rule, which bears logarithmic singularities at both ends.
template <class Function> double integral(Function f) {
    double sum = 0;
    const double step = 0.02;
    for (int i = -220; i <= 220; ++i) {
        const double t = i * step, u = pi / 2 * std::sinh(t), x = 1 / (1 + std::exp(-2 * u)),
                     rest = 1 / (1 + std::exp(2 * u));
        sum += pi * std::cosh(t) * x * rest * f(x, rest);
    }
    return sum * step;
}

// Chandrasekhar's H function for isotropic scattering.
double h_function(double albedo, double mu) {
    const double value = integral([=](double x, double rest) {
        const double angle = x * pi / 2, sine = std::sin(angle), cosine = std::sin(rest * pi / 2);
        // 1 - x cot x = x^2 / 3 + ...
        const double dispersion = 1 - albedo + albedo * (angle > 1e-4 ? 1 - angle * cosine / sine : angle * angle / 3);
        return std::log(dispersion) / (cosine * cosine + mu * mu * sine * sine);
    });
    return std::exp(-mu / 2 * value);
}

// Fluence at r mean free paths from an isotropic point source of power 1 in an infinite medium, isotropic scattering.
double point_source_fluence(double albedo, double r) {
    double low = 1e-9, high = 1; // atanh(k) / k grows with k
    for (int i = 0; i < 100; ++i) {
        const double middle = (low + high) / 2;
        (albedo * std::atanh(middle) < middle ? low : high) = middle;
    }
    const double k2 = low * low, weight = 2 * k2 * (1 - k2) / (albedo * (k2 + albedo - 1));
    const double transient = integral([=](double x, double rest) {
        const double a = 1 - albedo * x * std::log((1 + x) / rest) / 2, b = pi * albedo * x / 2;
        return std::exp(-r / x) / (x * x * (a * a + b * b));
    });
    return (weight * std::exp(-low * r) + transient) / (4 * pi * r);
}

} // namespace

TEST_CASE("the table of transport values agrees with closed forms") {
    std::map<std::string, double> value;
    for (const Row &row : transport_rows()) CHECK(value.emplace(row.id, row.value).second);
    int checked = 0;
    const auto agrees = [&](double found, double expected, double relative) {
        ++checked;
        return std::fabs(found - expected) < relative * expected;
    };
    for (const auto &[id, found] : value) {
        CAPTURE(id);
        double c, g, x, y;
        char word[8] = "";
        int end = 0;
        const auto matches = [&](int fields, int expected) { return fields == expected && id.c_str()[end] == 0; };
        const char *text = id.c_str();
        if (matches(std::sscanf(text, "H_c%lf_mu%lf%n", &c, &x, &end), 2))
            CHECK(agrees(found, h_function(c, x), 5e-8));
        else if (matches(std::sscanf(text, "semi_c%lf_UR(%lf)%n", &c, &x, &end), 2))
            CHECK(agrees(found, 1 - h_function(c, x) * std::sqrt(1 - c), 5e-8));
        else if (matches(std::sscanf(text, "semi_c%lf_R(%lf,%lf)%n", &c, &x, &y, &end), 3))
            CHECK(agrees(found, c / 4 * h_function(c, x) * h_function(c, y) / (x + y), 5e-8));
        else if (matches(std::sscanf(text, "inf_c%lf_r%lf%n", &c, &x, &end), 2))
            CHECK(agrees(found, point_source_fluence(c, x), 5e-8));
        else if (matches(std::sscanf(text, "inf_c%lf_g%lf_%7[r2ncol]%n", &c, &g, word, &end), 3))
            CHECK(agrees(found, word[0] == 'r' ? 2 / ((1 - c) * (1 - c * g)) : 1 / (1 - c), 5e-8));
        else if (matches(std::sscanf(text, "sph_R5_c%lf_coll_%3[unictr]%n", &c, word, &end), 2)) {
            // A photon is absorbed at a fraction 1 - c of its collisions, or escapes.
            const std::string escapes = id.substr(0, id.find("coll")) + "Pesc_" + word;
            CHECK(agrees(found, (1 - value.at(escapes)) / (1 - c), 5e-7));
        } else if (matches(std::sscanf(text, "slab_a%lf_g%lf_t%lf_UTd1%n", &c, &g, &x, &end), 3))
            // All that is transmitted is direct or diffuse; both values are rounded to eight digits.
            CHECK(agrees(found + std::exp(-x), value.at(id.substr(0, id.find("UTd1")) + "UT1"), 1e-7));
    }
    CHECK(checked == 80 + 16 + 42 + 18 + 2 + 11);
}

TEST_CASE("the table's slabs agree with the doubling method") {
    const std::vector<Row> rows = transport_rows();
    struct Series {
        double albedo, g;
        size_t points;
    };
    int checked = 0;
    for (const Series &of :
         {Series{0.5, 0, 32}, {1, 0, 64}, {0.9, 0.75, 80}, {1, 0.75, 80}, {0.9, -0.5, 48}, {0.9, 0.95, 220}})
        for (DoubledSlab slab(of.albedo, of.g, 0x1p-5, of.points, {1, 0.5, 0.1}); slab.depth() <= 16; slab.twice())
            for (const Row &row : rows) {
                double albedo, g, depth, out, in;
                int end = 0;
                char way;
                if (std::sscanf(row.id.c_str(), "slab_a%lf_g%lf_t%lf_%n", &albedo, &g, &depth, &end) != 3 ||
                    albedo != of.albedo || g != of.g || depth != slab.depth())
                    continue;
                const std::string what = row.id.substr(static_cast<size_t>(end));
                const double found = what == "UR1"      ? slab.reflected(1)
                                     : what == "UR(.5)" ? slab.reflected(0.5)
                                     : what == "URU"    ? slab.reflected_of_diffuse()
                                     : what == "UTd1"   ? slab.transmitted(1)
                                     : what == "UT1"    ? slab.transmitted(1) + std::exp(-depth)
                                     : what == "UT(.5)" ? slab.transmitted(0.5) + std::exp(-depth / 0.5)
                                     : what == "UTU"    ? slab.transmitted_of_diffuse()
                                     : std::sscanf(what.c_str(), "%c(%lf,%lf)", &way, &out, &in) < 3 ? 0
                                     : way == 'R' ? slab.reflection(out, in)
                                                  : slab.transmission(out, in);
                CAPTURE(row.id);
                CHECK(std::fabs(found - row.value) < 2e-6 * row.value);
                ++checked;
            }
    CHECK(checked == 11 * 13);
}
