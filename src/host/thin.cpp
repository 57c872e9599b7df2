// What a set of particles may take from a ray. The line through the middle of particle i has the optical depth
// tau_i = area_i C h_i^-2 K(0) (numerics L); one that passes it at distance b has at most tau_i (1 - (b / 2h)^2)^3, for
// both kernels. A set may go when these add up to no more than D = -ln(1 - epsilon) on any ray that leaves the eye or a
// light. Then, for a picture of single scattering, emission and background, with L before and L' after,
//
//     L - epsilon S  <=  L'  <=  L / (1 - epsilon)^2,
//
// where S is the greatest radiance that smoke adds per unit of opacity. Above: transmittances, from the eye and from
// the light, rise by at most e^D each, and no density is added. Below: only what the removed particles sent is missing,
// int sigma_i S T dt <= S (1 - e^-D); all else is lit and seen no worse.
//
// Light that was scattered before crosses the smoke on other lines too: of that nothing is promised.
//
// Rays are looked at in bundles: the cells of a plane before the eye or light (six planes, where that is in the smoke),
// each with the sum of what any ray of it may lose. One view after the other, each strikes from the list what it cannot
// spare: what is left of a list that a view could spare, it can spare too. All of it in double, before any arithmetic
// has a say, so that the set is the same in all three.
//
// Mass that goes is gone: given to neighbours it would have to stay within the same bounds on their rays.
#include "host/thin.h"
#include "wisp/elementary.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace wisp {

namespace {

Double3 operator-(const Double3 &a, const Double3 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Double3 operator*(const Double3 &a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(const Double3 &a, const Double3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(const Double3 &a) { return std::sqrt(dot(a, a)); }

struct Candidate {
    uint32_t block, index;
    Double3 position;
    double support, depth; // tau_i
    size_t crowd;          // how many particles there are about it
};

constexpr double pi = 3.14159265358979323846, rounding = 1 + 1e-9,
                 slack = 1e-12; // more than any of the sums below are off by

// numerics L: 15 / (64 pi) K(0) with K(0) = 8; poly6's own h is 2 h.
double depth_through_middle(const Particle &p, Kernel kernel) {
    return (kernel == Kernel::spline ? 15 : 9) / (8 * pi) * (p.area / (p.h * p.h)) * rounding;
}

// The particles of one block counted in cells as wide as a support.
class Crowds {
  public:
    explicit Crowds(const std::vector<Particle> &particles) {
        for (const Particle &p : particles) edge_ = std::max(edge_, 2 * p.h);
        for (const Particle &p : particles) cells_.push_back(cell_of(p.position));
        std::sort(cells_.begin(), cells_.end());
    }
    // In the particle's cell and those that touch it.
    size_t about(const Particle &p) const {
        const Cell at = cell_of(p.position);
        size_t count = 0;
        for (double x : {at[0] - 1, at[0], at[0] + 1})
            for (double y : {at[1] - 1, at[1], at[1] + 1})
                count += static_cast<size_t>(std::upper_bound(cells_.begin(), cells_.end(), Cell{x, y, at[2] + 1}) -
                                             std::lower_bound(cells_.begin(), cells_.end(), Cell{x, y, at[2] - 1}));
        return count;
    }

  private:
    using Cell = std::array<double, 3>; // whole numbers
    Cell cell_of(const Double3 &x) const { return {whole(x.x), whole(x.y), whole(x.z)}; }
    // Numbers too large for an int64 have no fraction.
    double whole(double x) const {
        const double q = x / edge_;
        if (!(std::fabs(q) < 0x1p60)) return q;
        const double cut = static_cast<double>(static_cast<int64_t>(q));
        return cut > q ? cut - 1 : cut;
    }

    double edge_ = 0;
    std::vector<Cell> cells_;
};

// Those that alone are within the bound. Least visible first; of equals, strays before those in a crowd.
std::vector<Candidate> find_candidates(const std::vector<std::vector<Particle>> &particles,
                                       const std::vector<SmokeSource> &smokes, double most) {
    std::vector<Candidate> candidates;
    for (uint32_t block = 0; block < particles.size(); ++block) {
        const size_t before = candidates.size();
        for (uint32_t i = 0; i < particles[block].size(); ++i) {
            const Particle &p = particles[block][i];
            const double depth = depth_through_middle(p, smokes[block].kernel);
            const bool far =
                std::max({std::fabs(p.position.x), std::fabs(p.position.y), std::fabs(p.position.z)}) > 1e100;
            if (depth <= most && !far) candidates.push_back({block, i, p.position, 2 * p.h, depth, 0});
        }
        if (candidates.size() == before) continue;
        const Crowds crowds(particles[block]);
        for (size_t c = before; c < candidates.size(); ++c)
            candidates[c].crowd = crowds.about(particles[block][candidates[c].index]);
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate &a, const Candidate &b) {
        return std::make_tuple(a.depth, a.crowd, a.block, a.index) <
               std::make_tuple(b.depth, b.crowd, b.block, b.index);
    });
    return candidates;
}

// A ball around all supports.
struct Ball {
    Double3 middle;
    double radius;
};
Ball ball_around(const std::vector<Candidate> &candidates) {
    Double3 low = candidates[0].position, high = low;
    double support = 0;
    for (const Candidate &c : candidates) {
        low = {std::min(low.x, c.position.x), std::min(low.y, c.position.y), std::min(low.z, c.position.z)};
        high = {std::max(high.x, c.position.x), std::max(high.y, c.position.y), std::max(high.z, c.position.z)};
        support = std::max(support, c.support);
    }
    const Double3 half = (high - low) * 0.5;
    return {high - half, (length(half) + support) * rounding};
}

// Rays through the square |a| <= width, |b| <= width of a plane: parallel ones pass origin + a right + b up along
// `forward`, others leave the origin along forward + a right + b up.
class Bundles {
  public:
    Bundles(const Double3 &forward, bool parallel, double width, int32_t cells)
        : forward_(forward), parallel_(parallel), width_(width), cells_(cells),
          lost_(static_cast<size_t>(cells) * static_cast<size_t>(cells), 0.0) {
        // Any two axes at right angles to it will do.
        const Double3 f = forward, other = std::fabs(f.x) < 0.6 ? Double3{1, 0, 0} : Double3{0, 1, 0};
        const Double3 r = other - f * dot(other, f);
        right_ = r * (1 / length(r));
        up_ = {f.y * right_.z - f.z * right_.y, f.z * right_.x - f.x * right_.z, f.x * right_.y - f.y * right_.x};
    }

    // visit(what the bundle's rays have lost, what they lose by the particle at most), for each bundle that it meets;
    // `way` leads to it from the origin.
    template <class Visit> void for_each_bundle(const Double3 &way, double support, double depth, Visit &&visit) {
        const double x = dot(way, right_), y = dot(way, up_), z = dot(way, forward_), distance = length(way);
        double a0, a1, b0, b1;
        // The ball of the support, as a unit vector's neighbourhood when rays spread: within `reach` of the direction.
        double reach = support + slack * width_;
        Double3 u = {x, y, 0};
        if (parallel_) {
            a0 = x - reach, a1 = x + reach, b0 = y - reach, b1 = y + reach;
        } else {
            const double sine_squared = (support / distance) * (support / distance);
            reach = std::sqrt(2 * sine_squared / (1 + std::sqrt(1 - sine_squared))) + slack;
            u = Double3{x, y, z} * (1 / distance);
            const double nearest = std::max(u.z - reach, 0.5), farthest = std::min(u.z + reach, 1.0);
            if (u.z + reach < 0.5) return; // the plane's rays have a third component of at least 1 / sqrt(3)
            const auto low = [&](double v) { return v / (v < 0 ? nearest : farthest); };
            const auto high = [&](double v) { return v / (v < 0 ? farthest : nearest); };
            a0 = low(u.x - reach), a1 = high(u.x + reach), b0 = low(u.y - reach), b1 = high(u.y + reach);
        }
        const double cell = 2 * width_ / cells_;
        const double to_corner = 0.70711 * cell * rounding; // from a cell's middle; normalising brings points nearer
        const int32_t j0 = index(b0, cell), j1 = index(b1, cell), i0 = index(a0, cell), i1 = index(a1, cell);
        for (int32_t j = j0; j <= j1; ++j)
            for (int32_t i = i0; i <= i1; ++i) {
                Double3 middle = {(i + 0.5) * cell - width_, (j + 0.5) * cell - width_, parallel_ ? 0.0 : 1.0};
                if (!parallel_) middle = middle * (1 / length(middle));
                const double apart = std::max(length(middle - u) * (1 / rounding) - to_corner, 0.0);
                if (!(apart < reach)) continue;
                // The distance of the bundle's nearest ray from the particle's middle.
                const double b = parallel_ ? apart : distance * apart * std::sqrt(1 - 0.25 * apart * apart);
                const double q = std::min(b / support, 1.0), c = 1 - q * q;
                visit(lost_[static_cast<size_t>(j) * static_cast<size_t>(cells_) + static_cast<size_t>(i)],
                      depth * (c * c * c));
            }
    }

  private:
    int32_t index(double a, double cell) const {
        const double i = (a + width_) / cell;
        return i < 1 ? 0 : i < cells_ ? static_cast<int32_t>(i) : cells_ - 1;
    }

    Double3 forward_, right_, up_;
    bool parallel_;
    double width_;
    int32_t cells_;
    std::vector<double> lost_; // of each bundle, so far
};

// The planes for rays from (or, parallel, along) `source`, with cells that the supports cover several of.
std::vector<Bundles> bundles_of(const Double3 &source, bool parallel, const Ball &ball, double mean_support) {
    const double wanted = std::min(std::max(8 * ball.radius / mean_support, 32.0), 1024.0);
    const int32_t cells = static_cast<int32_t>(wanted);
    std::vector<Bundles> planes;
    if (parallel) {
        const double size = std::max({std::fabs(source.x), std::fabs(source.y), std::fabs(source.z)});
        const Double3 d = {source.x / size, source.y / size, source.z / size};
        planes.emplace_back(d * (1 / length(d)), true, ball.radius, cells);
        return planes;
    }
    const Double3 way = ball.middle - source;
    const double distance = length(way);
    if (distance > 1.5 * ball.radius) {
        // The ball's tangents from the source: tan = r / sqrt(d^2 - r^2).
        const double r = ball.radius / distance;
        planes.emplace_back(way * (1 / distance), false, r / std::sqrt(1 - r * r) * rounding, cells);
        return planes;
    }
    for (int axis = 0; axis < 6; ++axis) {
        const double sign = axis % 2 ? -1 : 1;
        planes.emplace_back(Double3{axis / 2 == 0 ? sign : 0, axis / 2 == 1 ? sign : 0, axis / 2 == 2 ? sign : 0},
                            false, 1.0, cells);
    }
    return planes;
}

// Leaves of the candidates those that rays from the source can spare together.
void spare(std::vector<Candidate> &candidates, const Double3 &source, bool parallel, double most) {
    if (candidates.empty()) return;
    const Ball ball = ball_around(candidates);
    double mean_support = 0;
    for (const Candidate &c : candidates) mean_support += c.support / static_cast<double>(candidates.size());
    std::vector<Bundles> planes = bundles_of(source, parallel, ball, mean_support);
    const Double3 origin = parallel ? ball.middle : source;
    const auto needed = [&](const Candidate &c) {
        const Double3 way = c.position - origin;
        if (!parallel && !(length(way) > c.support * rounding)) return true; // it is all around
        bool fits = true;
        for (Bundles &plane : planes)
            plane.for_each_bundle(way, c.support, c.depth,
                                  [&](double &lost, double part) { fits = fits && lost + part <= most; });
        if (!fits) return true;
        for (Bundles &plane : planes)
            plane.for_each_bundle(way, c.support, c.depth, [](double &lost, double part) { lost += part; });
        return false;
    };
    // Not remove_if, which need not ask in order.
    size_t kept = 0;
    for (const Candidate &c : candidates)
        if (!needed(c)) candidates[kept++] = c;
    candidates.resize(kept);
}

} // namespace

std::vector<std::vector<uint32_t>> find_noise(const std::vector<std::vector<Particle>> &particles,
                                              const std::vector<SmokeSource> &smokes, const Double3 &eye,
                                              const std::vector<LightSource> &lights, double epsilon) {
    const double most = -log1p(-epsilon);
    std::vector<Candidate> candidates = find_candidates(particles, smokes, most);
    spare(candidates, eye, false, most);
    for (const LightSource &light : lights) {
        const bool parallel = light.kind == LightKind::parallel;
        spare(candidates, parallel ? light.direction : light.position, parallel, most);
    }
    std::vector<std::vector<uint32_t>> noise(particles.size());
    for (const Candidate &c : candidates) noise[c.block].push_back(c.index);
    for (auto &indices : noise) std::sort(indices.begin(), indices.end());
    return noise;
}

void remove_particles(std::vector<Particle> &particles, const std::vector<uint32_t> &indices) {
    size_t kept = 0, next = 0;
    for (size_t i = 0; i < particles.size(); ++i) {
        if (next < indices.size() && indices[next] == i)
            ++next;
        else
            particles[kept++] = particles[i];
    }
    particles.resize(kept);
}

} // namespace wisp
