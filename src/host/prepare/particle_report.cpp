// The error of a density that is made of particles. Take the particles as drawn independently of each other from the
// smoke that they stand for (a Poisson process of intensity n); then at any point (Campbell's theorem; Chiu, Stoyan,
// Kendall and Mecke, "Stochastic Geometry and its Applications", 2013)
//
//     E sum_i a_i W_i = int n a W,     Var sum_i a_i W_i = int n a^2 W^2:
//
// the first is the density, smoothed by the kernel; the second is noise. The relative error of the field is the root of
// int Var dV / int rho^2 dV. Of its two integrals
// - the first is sum_i a_i^2 int W_i^2, closed form;
// - the second is sum_i a_i rho_i, rho_i the density that the *others* have at particle i: others are as independent
//   of it as of any point (Slivnyak and Mecke), so this is unbiased, and the particle's own a_i W(0) is not in it
//   (leave-one-out, as in cross-validation: Silverman, "Density Estimation", 1986, 3.4).
// In even smoke this is int W^2 / (n (int W)^2), 1 / number. The difference of two halves of the particles estimates
// the same error, with the noise of the halving added. Particles that keep their distance (SPH) err less than
// independent ones. The blur of the kernel is not in it: more particles with the same smoothing length do not reduce
// the blur.
#include "host/prepare/decimate.h"
#include "host/prepare/particle_report.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace wisp {

namespace {

constexpr double pi = 3.14159265358979323846;

// h^3 int W^2, h of the scene: half of the support, for both kernels.
double square_integral(Kernel kernel) { return kernel == Kernel::spline ? 25 / (56 * pi) : 315 / (1144 * pi); }

std::string formatted(const char *format, double x) {
    char text[64];
    std::snprintf(text, sizeof text, format, x);
    return text;
}

// The number of particles that gives a density error, as a multiple of what there is.
std::string multiple(double error, double wanted) {
    const double factor = error / wanted * (error / wanted);
    return formatted(factor < 9.95 ? "%.1f" : "%.0f", factor);
}

std::string resampling_line(size_t number, const SmokeDescription &smoke,
                            const std::vector<DensityStatistics> &statistics) {
    std::vector<uint32_t> counts;
    uint64_t sum = 0;
    for (const DensityStatistics &n : statistics) {
        counts.push_back(n.neighbours);
        sum += n.neighbours;
    }
    std::sort(counts.begin(), counts.end());
    const std::string line = "smoke " + std::to_string(number) + ": a particle has " +
                             formatted("%.1f", static_cast<double>(sum) / static_cast<double>(counts.size())) +
                             " neighbours, one in twenty no more than " + std::to_string(counts[counts.size() / 20]) +
                             "; ";
    const double error = density_error(smoke, statistics);
    if (!(error < 10)) return line + "they are too few for a density";
    return line + "the density errs by " + formatted("%.1f", 100 * error) + " %; for 5 % it takes " +
           multiple(error, 0.05) + " times as many, for 1 % " + multiple(error, 0.01) + " times";
}

} // namespace

double density_error(const SmokeDescription &smoke, const std::vector<DensityStatistics> &statistics) {
    double variance = 0, square = 0;
    for (size_t i = 0; i < statistics.size(); ++i) {
        const Particle &p = smoke.particles[i];
        variance += p.area * p.area / (p.h * p.h * p.h) * square_integral(smoke.kernel);
        square += p.area * statistics[i].density;
    }
    return square > 0 ? std::sqrt(variance / square) : std::numeric_limits<double>::infinity();
}

namespace {

std::vector<DensityStatistics> density_statistics(const SmokeDescription &smoke, Arithmetic arithmetic) {
    constexpr decltype(&f32::density_statistics_bytes) bytes[] = {
        f32::density_statistics_bytes, f64::density_statistics_bytes, fixed::density_statistics_bytes};
    constexpr decltype(&f32::find_density_statistics) find[] = {
        f32::find_density_statistics, f64::find_density_statistics, fixed::find_density_statistics};
    std::vector<DensityStatistics> statistics(smoke.count);
    std::vector<unsigned char> memory(bytes[static_cast<int>(arithmetic)](smoke.count));
    Arena arena(memory.data(), memory.size());
    find[static_cast<int>(arithmetic)](smoke, arena, statistics.data());
    return statistics;
}

} // namespace

std::vector<std::string> particle_report(const PreparedScene &prepared, Arithmetic arithmetic) {
    std::vector<std::string> lines;
    const double epsilons[] = {0.001, 0.01, 0.1};
    std::vector<std::vector<Removal>> removable[3];
    for (int e = 0; e < 3; ++e)
        removable[e] = find_negligible(prepared.particles, prepared.smokes, prepared.scene.camera.origin,
                                       prepared.lights, epsilons[e]);
    for (size_t i = 0; i < prepared.smokes.size(); ++i) {
        const SmokeDescription &smoke = prepared.smokes[i];
        if (smoke.count == 0) continue;
        lines.push_back(resampling_line(i + 1, smoke, density_statistics(smoke, arithmetic)));
        std::string line = "smoke " + std::to_string(i + 1) + ": particles that no ray would miss:";
        for (int e = 0; e < 3; ++e)
            line += (e ? ", " : " ") + std::to_string(removable[e][i].size()) + " with --thin " +
                    (e == 0   ? "0.001"
                     : e == 1 ? "0.01"
                              : "0.1");
        lines.push_back(line);
    }
    return lines;
}

} // namespace wisp
