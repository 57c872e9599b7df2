// Reflection and transmission of a slab by the doubling method (Hansen and Travis 1974, section 3.1): light is followed
// from layer to layer by matrices over cosines. No random numbers, and nothing in common with the renderer.
#pragma once
#include <cmath>
#include <cstddef>
#include <vector>

namespace wisp {

// A slab of extinction 1 with Henyey-Greenstein scattering. Its reflection function R(out, in) and the diffuse part of
// its transmission function T(out, in) are means over the azimuth: light of irradiance pi, normal to its direction,
// that comes at the cosine `in` leaves as radiance R(out, in) * in.
class DoubledSlab {
  public:
    // A layer of depth `thinnest`. `points` Gauss points stand for all cosines of a side: the phase function must be a
    // polynomial of a degree below 2 `points`, nearly. Functions can be read at the cosines `read`.
    DoubledSlab(double albedo, double g, double thinnest, size_t points, std::vector<double> read)
        : read_(std::move(read)) {
        gauss(points);
        for (const double mu : read_) {
            mu_.push_back(mu);
            weight_.push_back(0);
        }
        const size_t n = mu_.size();
        reflection_ = transmission_ = Matrix(n * n);
        // Single scattering of a layer so thin that light is scattered once; then doubled.
        constexpr int doublings = 42;
        depth_ = std::ldexp(thinnest, -doublings);
        for (size_t i = 0; i < n; ++i)
            for (size_t j = 0; j < n; ++j) {
                const double sigma = albedo * depth_ / (4 * mu_[i] * mu_[j]);
                reflection_[i * n + j] = sigma * phase(g, -mu_[i], mu_[j], 2 * points);
                transmission_[i * n + j] = sigma * phase(g, mu_[i], mu_[j], 2 * points);
            }
        for (int i = 0; i < doublings; ++i) twice();
    }

    // Doubles the depth.
    void twice() {
        const size_t n = mu_.size();
        std::vector<double> direct(n);
        for (size_t i = 0; i < n; ++i) direct[i] = std::exp(-depth_ / mu_[i]);
        const Matrix &r = reflection_, &t = transmission_;
        // Light at the middle: between both halves it is reflected any number of times.
        const Matrix between = all_orders(product(r, r));
        Matrix down = sum(t, sum(with_columns(between, direct), product(between, t)));
        Matrix up = sum(with_columns(r, direct), product(r, down));
        Matrix out = sum(r, sum(with_rows(up, direct), product(t, up)));
        transmission_ = sum(with_rows(down, direct), sum(with_columns(t, direct), product(t, down)));
        reflection_ = std::move(out);
        depth_ *= 2;
    }

    double depth() const { return depth_; }
    double reflection(double out, double in) const { return reflection_[index(out) * mu_.size() + index(in)]; }
    double transmission(double out, double in) const { return transmission_[index(out) * mu_.size() + index(in)]; }
    // Fractions of the light of one cosine that are reflected and diffusely transmitted; of diffuse light.
    double reflected(double in) const { return flux(reflection_, index(in)); }
    double transmitted(double in) const { return flux(transmission_, index(in)); }
    double reflected_of_diffuse() const { return flux_of_diffuse(reflection_); }
    double transmitted_of_diffuse() const {
        double direct = 0;
        for (size_t i = 0; i < mu_.size(); ++i) direct += 2 * mu_[i] * weight_[i] * std::exp(-depth_ / mu_[i]);
        return direct + flux_of_diffuse(transmission_);
    }

  private:
    using Matrix = std::vector<double>;

    // Gauss-Legendre points and weights of (0, 1).
    void gauss(size_t points) {
        const double n = static_cast<double>(points);
        for (size_t i = 0; i < points; ++i) {
            double x = std::cos(pi_ * (static_cast<double>(i) + 0.75) / (n + 0.5)), slope = 1;
            for (int step = 0; step < 20; ++step) {
                double p = 1, before = 0;
                for (size_t l = 1; l <= points; ++l) {
                    const double d = static_cast<double>(l), next = ((2 * d - 1) * x * p - (d - 1) * before) / d;
                    before = p;
                    p = next;
                }
                slope = n * (x * p - before) / (x * x - 1);
                x -= p / slope;
            }
            mu_.push_back((1 + x) / 2);
            weight_.push_back(1 / ((1 - x * x) * slope * slope));
        }
    }
    // The Henyey-Greenstein function's mean over the azimuth, of mean 1 over the sphere.
    static double phase(double g, double a, double b, size_t terms) {
        double sum = 0, power = 1, pa = 1, pb = 1, before_a = 0, before_b = 0;
        for (size_t l = 0; l < terms; ++l) {
            const double d = static_cast<double>(l);
            sum += (2 * d + 1) * power * pa * pb;
            const double next_a = ((2 * d + 1) * a * pa - d * before_a) / (d + 1),
                         next_b = ((2 * d + 1) * b * pb - d * before_b) / (d + 1);
            before_a = pa, before_b = pb;
            pa = next_a, pb = next_b;
            power *= g;
        }
        return sum;
    }

    // (A B)(i, j) = 2 int A(i, mu) B(mu, j) mu dmu.
    Matrix product(const Matrix &a, const Matrix &b) const {
        const size_t n = mu_.size();
        Matrix c(n * n);
        for (size_t i = 0; i < n; ++i)
            for (size_t k = 0; k < n; ++k) {
                const double factor = a[i * n + k] * 2 * mu_[k] * weight_[k];
                for (size_t j = 0; j < n; ++j) c[i * n + j] += factor * b[k * n + j];
            }
        return c;
    }
    // Q + Q Q + Q Q Q + ... = S where S - Q S = Q, by Gauss elimination; rows and columns of cosines that are only read
    // have no weight.
    Matrix all_orders(const Matrix &q) const {
        const size_t n = mu_.size();
        Matrix a(n * n), s = q;
        for (size_t i = 0; i < n; ++i)
            for (size_t j = 0; j < n; ++j) a[i * n + j] = (i == j ? 1 : 0) - q[i * n + j] * 2 * mu_[j] * weight_[j];
        for (size_t k = 0; k < n; ++k) { // the diagonal is large: Q is a small part of 1
            for (size_t i = 0; i < n; ++i) {
                const double factor = a[i * n + k] / a[k * n + k];
                if (i == k || factor == 0) continue;
                for (size_t j = k; j < n; ++j) a[i * n + j] -= factor * a[k * n + j];
                for (size_t j = 0; j < n; ++j) s[i * n + j] -= factor * s[k * n + j];
            }
        }
        for (size_t i = 0; i < n; ++i)
            for (size_t j = 0; j < n; ++j) s[i * n + j] /= a[i * n + i];
        return s;
    }
    Matrix with_rows(Matrix a, const std::vector<double> &factor) const {
        for (size_t i = 0; i < a.size(); ++i) a[i] *= factor[i / mu_.size()];
        return a;
    }
    Matrix with_columns(Matrix a, const std::vector<double> &factor) const {
        for (size_t i = 0; i < a.size(); ++i) a[i] *= factor[i % mu_.size()];
        return a;
    }
    static Matrix sum(Matrix a, const Matrix &b) {
        for (size_t i = 0; i < a.size(); ++i) a[i] += b[i];
        return a;
    }
    double flux(const Matrix &a, size_t in) const {
        double sum = 0;
        for (size_t i = 0; i < mu_.size(); ++i) sum += 2 * mu_[i] * weight_[i] * a[i * mu_.size() + in];
        return sum;
    }
    double flux_of_diffuse(const Matrix &a) const {
        double sum = 0;
        for (size_t j = 0; j < mu_.size(); ++j) sum += 2 * mu_[j] * weight_[j] * flux(a, j);
        return sum;
    }
    size_t index(double mu) const {
        size_t i = 0;
        while (read_[i] != mu) ++i;
        return mu_.size() - read_.size() + i;
    }

    static constexpr double pi_ = 3.14159265358979323846;
    std::vector<double> read_, mu_, weight_;
    Matrix reflection_, transmission_;
    double depth_;
};

} // namespace wisp
