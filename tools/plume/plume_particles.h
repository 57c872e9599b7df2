// The smoke that the air carries: particles of equal mass, born at a steady rate in a small ball above the heat.
// Optionally they interact by SPH, which evens out their spacing.
//
// Invariants:
// * after frame f there are rate (f + 1) + 1 particles: one from the start and `rate` from each frame since. A
//   particle's number is the order of birth, and its birth depends on (seed, rate, number) alone;
// * all lie in the box;
// * sums over neighbours run by cell, then by number.
#pragma once
#include "plume_flow.h"

namespace wisp::plume {

// Finds the points within `reach` of a place: counting sort into cubes of that edge.
class CellList {
  public:
    CellList(const std::vector<Vec3> &points, double reach)
        : reach_(reach), nx_(cubes(box_size.x)), ny_(cubes(box_size.y)), nz_(cubes(box_size.z)),
          first_(static_cast<size_t>(nx_) * ny_ * nz_ + 1), sorted_(points.size()) {
        for (const Vec3 &p : points) ++first_[cube_of(p) + 1];
        for (size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
        std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
        for (uint32_t i = 0; i < points.size(); ++i) sorted_[next[cube_of(points[i])]++] = {points[i], i};
    }

    // action(j, p - points[j], their distance) for all points nearer to p than reach, that at p itself included.
    template <class Action> void for_each_near(const Vec3 &p, Action action) const {
        const int x = cube(p.x, nx_), y = cube(p.y, ny_), z = cube(p.z, nz_);
        const int low_z = max(z - 1, 0), high_z = min(z + 1, nz_ - 1);
        for (int i = max(x - 1, 0); i <= min(x + 1, nx_ - 1); ++i)
            for (int j = max(y - 1, 0); j <= min(y + 1, ny_ - 1); ++j)
                for (uint32_t s = first_[index(i, j, low_z)]; s < first_[index(i, j, high_z) + 1]; ++s) {
                    const Vec3 d = p - sorted_[s].point;
                    const double squared = d.x * d.x + d.y * d.y + d.z * d.z;
                    if (squared < reach_ * reach_) action(sorted_[s].number, d, sqrt(squared));
                }
    }

  private:
    struct Entry {
        Vec3 point;
        uint32_t number;
    };

    int cubes(double edge) const { return static_cast<int>(edge / reach_) + 1; }
    int cube(double x, int count) const { return min(static_cast<int>(x / reach_), count - 1); }
    size_t index(int i, int j, int k) const { return (static_cast<size_t>(i) * ny_ + j) * nz_ + k; }
    size_t cube_of(const Vec3 &p) const { return index(cube(p.x, nx_), cube(p.y, ny_), cube(p.z, nz_)); }

    double reach_;
    int nx_, ny_, nz_;
    std::vector<uint32_t> first_; // cube c holds sorted_[first_[c] .. first_[c + 1])
    std::vector<Entry> sorted_;
};

class SmokeVolume {
  public:
    SmokeVolume(uint32_t rate, uint64_t seed, bool interact)
        : rate_(rate), seed_(seed), interact_(interact), mass_(1.0 / rate), h_(0.2 * cbrt(400.0 / rate)),
          kernel_(15 / (64 * pi<double> * h_ * h_ * h_)) {
        emit(0);
    }

    // One frame further, in air that moves with `air`.
    void step(const Velocity &air) {
        if (interact_) push();
        for (size_t i = 0; i < position_.size(); ++i) carry(i, air, 1);
        for (uint32_t i = 0; i < rate_; ++i) {
            const size_t number = position_.size();
            emit(number);
            carry(number, air, 1 - (i + random(number, channel_birth)) / rate_);
        }
    }

    const std::vector<Vec3> &position() const { return position_; }
    // Of particle i in `air`, cells a frame.
    Vec3 velocity(size_t i, const Velocity &air) const { return air.at(position_[i]) + drift_[i]; }
    // S3 at each particle, with the spline kernel and h = 0.2 cbrt(400 / rate) cells; the smoke of one frame has
    // mass 1.
    std::vector<double> density() const { return density(CellList(position_, 2 * h_)); }

  private:
    static constexpr double nozzle_radius = 1.5;
    static constexpr Vec3 nozzle_centre{4, 0.5 * cells_y, 0.5 * cells_z};
    // Pressure is `stiffness` times density. With this drag it spreads smoke as a diffusion of 0.002 cells^2 a frame
    // would: enough to part neighbours, too little to blur an eddy.
    static constexpr double stiffness = 4e-4, drag = 0.2, viscosity = 0.1;

    double random(uint64_t number, uint32_t channel) const {
        return unit_half_open<double>(draw(photon_event(seed_, number), channel));
    }

    // Anywhere in the ball alike.
    void emit(uint64_t number) {
        const double r = nozzle_radius * cbrt(random(number, channel_radius));
        const double x = 2 * random(number, channel_height) - 1, across = sqrt(1 - x * x);
        double sine, cosine;
        sincos_turns(random(number, channel_angle), sine, cosine);
        position_.push_back(nozzle_centre + r * Vec3(x, across * cosine, across * sine));
        drift_.push_back(Vec3(0));
    }

    // The air never crosses a wall; a step of finite length or a drift may.
    static double reflect(double x, double edge) {
        const double reflected = x < 0 ? -x : x > edge ? 2 * edge - x : x;
        return min(max(reflected, 0.0), edge);
    }

    void carry(size_t i, const Velocity &air, double time) {
        const Vec3 p = position_[i];
        const Vec3 q = p + displacement(air, p, air.at(p), time) + time * drift_[i];
        position_[i] = {reflect(q.x, box_size.x), reflect(q.y, box_size.y), reflect(q.z, box_size.z)};
    }

    std::vector<double> density(const CellList &cells) const {
        std::vector<double> result(position_.size());
        for (size_t i = 0; i < result.size(); ++i) {
            double sum = 0;
            cells.for_each_near(position_[i], [&](uint32_t, const Vec3 &, double r) {
                const double u = 2 - r / h_;
                sum += u * u * u;
            });
            result[i] = mass_ * kernel_ * sum; // S3, spline
        }
        return result;
    }

    // Pressure and viscosity of SPH (Desbrun and Cani 1996) act on the drift, a particle's velocity relative to the
    // air; drag wears it off.
    void push() {
        const CellList cells(position_, 2 * h_);
        std::vector<double> volume = density(cells); // of a unit of mass, once inverted
        for (double &v : volume) v = 1 / v;
        std::vector<Vec3> next(drift_.size());
        for (size_t i = 0; i < next.size(); ++i) {
            Vec3 pressure(0), friction(0);
            cells.for_each_near(position_[i], [&](uint32_t j, const Vec3 &d, double r) {
                if (r == 0) return; // itself
                const double u = 2 - r / h_;
                pressure +=
                    (volume[i] + volume[j]) * (3 * u * u / (h_ * r)) * d; // p / rho^2 = stiffness / rho; -grad W
                friction += volume[j] * u * u * u * (drift_[j] - drift_[i]);
            });
            next[i] = (1 - drag) * drift_[i] + mass_ * kernel_ * (stiffness * pressure + viscosity * friction);
        }
        drift_.swap(next);
    }

    uint32_t rate_;
    uint64_t seed_;
    bool interact_;
    double mass_, h_;
    double kernel_; // W = kernel_ (2 - r / h)^3
    std::vector<Vec3> position_, drift_;
};

} // namespace wisp::plume
