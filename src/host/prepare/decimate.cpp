// What a set of particles may take from a ray. The line through the middle of particle i has the optical depth
// tau_i = area_i C h_i^-2 K(0) (numerics L); one that passes it at distance b has at most tau_i (1 - (b / 2h)^2)^3, for
// both kernels. A set may go when these add up to no more than D = -ln(1 - epsilon) on any ray that leaves the eye or a
// light. Its mass goes to the nearest neighbours that stay, as far as that adds no more than D to any such ray, and
// else is lost. (Pictures err by a third or a quarter of what they do when all of it is lost.) Then, for a picture of
// single scattering, emission and background, with L before and L' after,
//
//     (1 - epsilon)^2 (L - epsilon S)  <=  L'  <=  L / (1 - epsilon)^2 + epsilon S,
//
// S the greatest radiance that smoke sends per unit of opacity, lit by unattenuated light. For transmittances, from the
// eye and from the light, change by factors of e^-D to e^D; what the removed particles sent was no more than
// int sigma_i S T dt <= S (1 - e^-D) = epsilon S, and what is sent in place of it no more than that either.
//
// Light that was scattered before crosses the smoke on other lines too: of that nothing is promised.
//
// Rays are looked at in bundles: the cells of a plane before the eye or light (six planes where that is in the smoke),
// each with the sum of what any ray of it may lose. One view after the other, each strikes from the list what it cannot
// bear: what is left of a list that a view could bear, it can bear too. All of it in double, before any arithmetic has
// a say, so that the set is the same in all three.
#include "core/numbers/elementary.h"
#include "host/base/double3.h"
#include "host/prepare/decimate.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace wisp {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double rounding = 1 + 1e-9, slack = 1e-12; // more than rounding changes a length, or a part of the whole

// Optical depth that rays lose with a particle, or gain where its mass goes.
struct Change {
    uint32_t block;
    Removal removal;
    Double3 position; // of the loss or gain
    double support, depth;
    size_t crowd; // how many particles are near
};

// Least visible first; of equals, strays before those in a crowd.
bool goes_first(const Change &a, const Change &b) {
    return std::make_tuple(a.depth, a.crowd, a.block, a.removal.index) <
           std::make_tuple(b.depth, b.crowd, b.block, b.removal.index);
}

// numerics L: 15 / (64 pi) K(0) with K(0) = 8; poly6's own h is 2 h.
double depth_through_middle(double area, double h, Kernel kernel) {
    return (kernel == Kernel::spline ? 15 : 9) / (8 * pi) * (area / (h * h)) * rounding;
}

// The particles of one block in cells that are as wide as the median support.
class Crowds {
  public:
    using Cell = std::array<double, 3>; // whole numbers
    using Member = std::pair<Cell, uint32_t>;

    explicit Crowds(const std::vector<Particle> &particles) {
        std::vector<double> h;
        for (const Particle &p : particles) h.push_back(p.h);
        const auto median = h.begin() + static_cast<std::ptrdiff_t>(h.size() / 2);
        std::nth_element(h.begin(), median, h.end());
        edge_ = 2 * *median;
        for (uint32_t i = 0; i < particles.size(); ++i) members_.push_back({cell_of(particles[i].position), i});
        std::sort(members_.begin(), members_.end());
    }

    // visit(first, last) for ranges of the members of the cell around x and of those that touch it.
    template <class Visit> void for_each_range(const Double3 &x, Visit &&visit) const {
        const Cell at = cell_of(x);
        for (double i : {at[0] - 1, at[0], at[0] + 1})
            for (double j : {at[1] - 1, at[1], at[1] + 1}) {
                const Member first = {{i, j, at[2] - 1}, 0}, last = {{i, j, at[2] + 1}, UINT32_MAX};
                visit(std::lower_bound(members_.begin(), members_.end(), first),
                      std::upper_bound(members_.begin(), members_.end(), last));
            }
    }

  private:
    Cell cell_of(const Double3 &x) const { return {whole(x.x), whole(x.y), whole(x.z)}; }
    double whole(double x) const {
        const double q = x / edge_;
        if (!(std::fabs(q) < 0x1p60)) return q; // it has no fraction
        const double cut = static_cast<double>(static_cast<int64_t>(q));
        return cut > q ? cut - 1 : cut;
    }

    double edge_;
    std::vector<Member> members_;
};

// Those that alone are within the bound.
std::vector<Change> find_candidates(const std::vector<std::vector<Particle>> &particles,
                                    const std::vector<SmokeDescription> &smokes, double most) {
    std::vector<Change> candidates;
    for (uint32_t block = 0; block < particles.size(); ++block) {
        const size_t before = candidates.size();
        for (uint32_t i = 0; i < particles[block].size(); ++i) {
            const Particle &p = particles[block][i];
            const double depth = depth_through_middle(p.area, p.h, smokes[block].kernel);
            const bool far = largest_component(p.position) > 1e100; // its square is out of range
            if (depth <= most && !far) candidates.push_back({block, {i, i}, p.position, 2 * p.h, depth, 0});
        }
        if (candidates.size() == before) continue;
        const Crowds crowds(particles[block]);
        for (size_t c = before; c < candidates.size(); ++c)
            crowds.for_each_range(candidates[c].position, [&](auto first, auto last) {
                candidates[c].crowd += static_cast<size_t>(last - first);
            });
    }
    return candidates;
}

// Where the mass of those that go may go: the nearest neighbours of theirs that stay.
std::vector<Change> find_gifts(const std::vector<std::vector<Particle>> &particles,
                               const std::vector<SmokeDescription> &smokes,
                               const std::vector<std::vector<Removal>> &removals) {
    std::vector<Change> gifts;
    for (uint32_t block = 0; block < particles.size(); ++block) {
        if (removals[block].empty()) continue;
        const std::vector<Particle> &all = particles[block];
        std::vector<bool> goes(all.size(), false);
        for (const Removal &removal : removals[block]) goes[removal.index] = true;
        const Crowds crowds(all);
        for (const Removal &removal : removals[block]) {
            const Particle &p = all[removal.index];
            uint32_t mass_receiver = removal.index;
            double nearest = 2 * p.h;
            crowds.for_each_range(p.position, [&](auto first, auto last) {
                for (; first != last; ++first) {
                    if (goes[first->second]) continue;
                    const double distance = length(all[first->second].position - p.position);
                    if (distance < nearest) nearest = distance, mass_receiver = first->second;
                }
            });
            if (mass_receiver == removal.index) continue;
            const double depth = depth_through_middle(p.area, all[mass_receiver].h, smokes[block].kernel);
            gifts.push_back({block, {removal.index, mass_receiver}, all[mass_receiver].position, 2 * all[mass_receiver].h, depth, 0});
        }
    }
    return gifts;
}

struct Ball {
    Double3 middle;
    double radius;
};

Ball ball_around_supports(const std::vector<Change> &changes) {
    Double3 low = changes[0].position, high = low;
    double support = 0;
    for (const Change &c : changes) {
        low = {std::min(low.x, c.position.x), std::min(low.y, c.position.y), std::min(low.z, c.position.z)};
        high = {std::max(high.x, c.position.x), std::max(high.y, c.position.y), std::max(high.z, c.position.z)};
        support = std::max(support, c.support);
    }
    const Double3 half = (high - low) * 0.5;
    return {high - half, (length(half) + support) * rounding};
}

// Rays through the square |a| <= width, |b| <= width of a plane: parallel ones pass origin + a right + b up along
// `forward`, others leave the origin along forward + a right + b up; then width <= 1.
class Bundles {
  public:
    Bundles(const Double3 &forward, bool parallel, double width, int32_t cells)
        : forward_(forward), parallel_(parallel), width_(width), cells_(cells), edge_(2 * width / cells),
          depth_(static_cast<size_t>(cells) * static_cast<size_t>(cells), 0.0) {
        // Any two axes at right angles to it will do.
        const Double3 f = forward, other = std::fabs(f.x) < 0.6 ? Double3{1, 0, 0} : Double3{0, 1, 0};
        const Double3 r = other - f * dot(other, f);
        right_ = r * (1 / length(r));
        up_ = {f.y * right_.z - f.z * right_.y, f.z * right_.x - f.x * right_.z, f.x * right_.y - f.y * right_.x};
    }

    // visit(sum so far, the change's part of it at most) for each bundle that passes its support; `way` leads to the
    // change from the origin.
    template <class Visit> void for_each_passed(const Change &change, const Double3 &way, Visit &&visit) {
        // The way as the rays see it, and how far from it in their plane, or among their directions, they pass the
        // support.
        const double distance = parallel_ ? 1 : length(way);
        const Double3 seen = {dot(way, right_) / distance, dot(way, up_) / distance,
                              parallel_ ? 0 : dot(way, forward_) / distance};
        double reach = change.support + slack * width_, nearest = 1, farthest = 1;
        if (!parallel_) {
            const double sine = change.support / distance, x = sine * sine;
            reach = std::sqrt(2 * x / (1 + std::sqrt(1 - x))) + slack; // 2 sin(angle / 2)
            if (seen.z + reach < 0.5) return;                          // rays rise by 1 / sqrt(3) at least
            nearest = std::max(seen.z - reach, 0.5), farthest = std::min(seen.z + reach, 1.0);
        }
        const auto low = [&](double v) { return cell_of((v - reach) / (v - reach < 0 ? nearest : farthest)); };
        const auto high = [&](double v) { return cell_of((v + reach) / (v + reach < 0 ? farthest : nearest)); };
        const double to_corner = 0.70711 * edge_ * rounding; // of a cell; directions are no farther apart
        const int32_t i0 = low(seen.x), i1 = high(seen.x), j0 = low(seen.y), j1 = high(seen.y);
        for (int32_t j = j0; j <= j1; ++j)
            for (int32_t i = i0; i <= i1; ++i) {
                Double3 middle = {(i + 0.5) * edge_ - width_, (j + 0.5) * edge_ - width_, parallel_ ? 0.0 : 1.0};
                if (!parallel_) middle = middle * (1 / length(middle));
                const double apart = std::max(length(middle - seen) / rounding - to_corner, 0.0);
                if (!(apart < reach)) continue;
                // The nearest ray's distance from the particle's middle.
                const double b = parallel_ ? apart : distance * apart * std::sqrt(1 - 0.25 * apart * apart);
                const double q = std::min(b / change.support, 1.0), c = 1 - q * q;
                visit(depth_[static_cast<size_t>(j) * static_cast<size_t>(cells_) + static_cast<size_t>(i)],
                      change.depth * (c * c * c));
            }
    }

  private:
    int32_t cell_of(double a) const {
        const double i = (a + width_) / edge_;
        return i < 1 ? 0 : i < cells_ ? static_cast<int32_t>(i) : cells_ - 1;
    }

    Double3 forward_, right_, up_;
    bool parallel_;
    double width_;
    int32_t cells_;
    double edge_;
    std::vector<double> depth_; // that the changes so far add up to, in each cell
};

// The planes of the rays from (parallel: along) `source`. Their cells are small beside the supports.
std::vector<Bundles> planes_of(const Double3 &source, bool parallel, const Ball &ball, double mean_support) {
    const auto cells = static_cast<int32_t>(std::min(std::max(8 * ball.radius / mean_support, 32.0), 1024.0));
    std::vector<Bundles> planes;
    if (parallel) {
        const Double3 along = source * (1 / largest_component(source)); // so that no square underflows
        planes.emplace_back(along * (1 / length(along)), true, ball.radius, cells);
        return planes;
    }
    const Double3 way = ball.middle - source;
    const double distance = length(way);
    if (distance > 1.5 * ball.radius) {
        const double sine = ball.radius / distance;
        planes.emplace_back(way * (1 / distance), false, sine / std::sqrt(1 - sine * sine) * rounding, cells);
        return planes;
    }
    for (double sign : {-1.0, 1.0})
        for (const Double3 &forward : {Double3{sign, 0, 0}, Double3{0, sign, 0}, Double3{0, 0, sign}})
            planes.emplace_back(forward, false, 1.0, cells);
    return planes;
}

// Leaves of the changes those that rays from the source can bear together.
void bear(std::vector<Change> &changes, const Double3 &source, bool parallel, double most) {
    if (changes.empty()) return;
    const Ball ball = ball_around_supports(changes);
    double sum = 0;
    for (const Change &c : changes) sum += c.support;
    std::vector<Bundles> planes = planes_of(source, parallel, ball, sum / static_cast<double>(changes.size()));
    const auto bears = [&](const Change &change) {
        const Double3 way = change.position - (parallel ? ball.middle : source);
        if (!parallel && !(length(way) > change.support * rounding)) return false; // it is all around the source
        bool fits = true;
        for (Bundles &plane : planes)
            plane.for_each_passed(change, way, [&](double &depth, double part) { fits &= depth + part <= most; });
        for (Bundles &plane : planes)
            if (fits) plane.for_each_passed(change, way, [](double &depth, double part) { depth += part; });
        return fits;
    };
    size_t left = 0;
    for (const Change &change : changes)
        if (bears(change)) changes[left++] = change;
    changes.resize(left);
}

void bear_all(std::vector<Change> &changes, const Double3 &eye, const std::vector<LightSource> &lights, double most) {
    std::sort(changes.begin(), changes.end(), goes_first);
    bear(changes, eye, false, most);
    for (const LightSource &light : lights) {
        const bool parallel = light.kind == LightKind::parallel;
        bear(changes, parallel ? light.direction : light.position, parallel, most);
    }
}

} // namespace

std::vector<std::vector<Removal>> find_negligible(const std::vector<std::vector<Particle>> &particles,
                                             const std::vector<SmokeDescription> &smokes, const Double3 &eye,
                                             const std::vector<LightSource> &lights, double epsilon) {
    const double most = -log1p(-epsilon);
    std::vector<Change> noise = find_candidates(particles, smokes, most);
    bear_all(noise, eye, lights, most);
    const auto by_index = [](const Removal &a, const Removal &b) { return a.index < b.index; };
    std::vector<std::vector<Removal>> removals(particles.size());
    for (const Change &c : noise) removals[c.block].push_back(c.removal);
    for (auto &of_block : removals) std::sort(of_block.begin(), of_block.end(), by_index);

    std::vector<Change> gifts = find_gifts(particles, smokes, removals);
    bear_all(gifts, eye, lights, most);
    for (const Change &gift : gifts) {
        auto &of_block = removals[gift.block];
        *std::lower_bound(of_block.begin(), of_block.end(), gift.removal, by_index) = gift.removal;
    }
    return removals;
}

void remove_particles(std::vector<Particle> &particles, const std::vector<Removal> &removals) {
    for (const Removal &r : removals)
        if (r.mass_receiver != r.index) particles[r.mass_receiver].area += particles[r.index].area;
    size_t left = 0, next = 0;
    for (size_t i = 0; i < particles.size(); ++i) {
        if (next < removals.size() && removals[next].index == i)
            ++next;
        else
            particles[left++] = particles[i];
    }
    particles.resize(left);
}

} // namespace wisp
