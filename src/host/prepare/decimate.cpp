// A set of particles and the optical depth that it takes from a ray. The line through the centre of particle i has the
// optical depth tau_i = area_i C h_i^-2 K(0) (N-L, smoke/README). A line at distance b has at most tau_i (1 - (b /
// 2h)^2)^3, for both kernels. A set is removable when these depths add up to at most D = -ln(1 - epsilon) on every ray
// that leaves the eye or a light. The mass of a removed particle goes to the nearest neighbour that stays, if that adds
// at most D to every such ray, and is lost otherwise. (Pictures then err by a third or a quarter of what they do when
// all mass is lost.) For a picture of single scattering, emission and background, with the radiance L before and L'
// after,
//
//     (1 - epsilon)^2 (L - epsilon S)  <=  L'  <=  L / (1 - epsilon)^2 + epsilon S,
//
// where S is the largest radiance that smoke in unattenuated light sends per unit of opacity. Proof: transmittances, to
// the eye and from the light, change by factors from e^-D to e^D. The removed particles sent at most int sigma_i S T dt
// <= S (1 - e^-D) = epsilon S, and the moved mass sends at most as much.
//
// There is no bound for multiple scattering: light crosses the smoke on other lines too.
//
// Rays are grouped in bundles: the cells of a plane before the eye or light (of six planes where that is in the smoke).
// Each cell holds the sum of the depths that any of its rays may lose. The eye and the lights are taken one after the
// other, and each removes from the list of candidates those that exceed the sum. A subset of a list within the bound is
// within the bound, so the order is safe.
#include "core/numbers/elementary.h"
#include "host/base/double3_algebra.h"
#include "host/prepare/decimate.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace wisp {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double rounding = 1 + 1e-9, slack = 1e-12; // more than rounding changes a length, or an angle

// The optical depth that rays lose with a removed particle, or gain where its mass goes.
struct Change {
    uint32_t smoke; // its index
    Removal removal;
    Double3 position; // of the loss or gain
    double support, depth;
    size_t neighbours; // how many particles are in the cells around
};

// The least visible first; of equals, the one with fewer neighbours.
bool comes_before(const Change &a, const Change &b) {
    return std::make_tuple(a.depth, a.neighbours, a.smoke, a.removal.index) <
           std::make_tuple(b.depth, b.neighbours, b.smoke, b.removal.index);
}

// N-L: 15 / (64 pi) K(0) with K(0) = 8. Poly6 is defined with an h that is twice ours.
double depth_through_middle(double area, double h, Kernel kernel) {
    return (kernel == Kernel::spline ? 15 : 9) / (8 * pi) * (area / (h * h)) * rounding;
}

// The particles of one smoke in cells that are as wide as the median support.
class CellList {
  public:
    using Cell = std::array<double, 3>; // whole numbers
    using Member = std::pair<Cell, uint32_t>;

    explicit CellList(const std::vector<Particle> &particles) {
        std::vector<double> h;
        for (const Particle &p : particles) h.push_back(p.h);
        const auto median = h.begin() + static_cast<std::ptrdiff_t>(h.size() / 2);
        std::nth_element(h.begin(), median, h.end());
        edge_ = 2 * *median;
        for (uint32_t i = 0; i < particles.size(); ++i) members_.push_back({cell_of(particles[i].position), i});
        std::sort(members_.begin(), members_.end());
    }

    // Calls visit(first, last) for ranges of members, which are in the cell of x and in the 26 cells around it.
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
    Cell cell_of(const Double3 &x) const { return {cell_index(x.x), cell_index(x.y), cell_index(x.z)}; }
    double cell_index(double x) const {
        const double q = x / edge_;
        if (!(std::fabs(q) < 0x1p60)) return q; // a double so large is a whole number
        const double cut = static_cast<double>(static_cast<int64_t>(q));
        return cut > q ? cut - 1 : cut;
    }

    double edge_;
    std::vector<Member> members_;
};

// The particles that alone are within the bound.
std::vector<Change> find_candidates(const std::vector<std::vector<Particle>> &particles,
                                    const std::vector<SmokeDescription> &smokes, double max_depth) {
    std::vector<Change> candidates;
    for (uint32_t smoke = 0; smoke < particles.size(); ++smoke) {
        const size_t before = candidates.size();
        for (uint32_t i = 0; i < particles[smoke].size(); ++i) {
            const Particle &p = particles[smoke][i];
            const double depth = depth_through_middle(p.area, p.h, smokes[smoke].kernel);
            const bool far = largest_component(p.position) > 1e100; // its square is out of range
            if (depth <= max_depth && !far) candidates.push_back({smoke, {i, i}, p.position, 2 * p.h, depth, 0});
        }
        if (candidates.size() == before) continue;
        const CellList cells(particles[smoke]);
        for (size_t c = before; c < candidates.size(); ++c)
            cells.for_each_range(candidates[c].position, [&](auto first, auto last) {
                candidates[c].neighbours += static_cast<size_t>(last - first);
            });
    }
    return candidates;
}

// For each removed particle the nearest neighbour that stays, and the depth that its mass would add there.
std::vector<Change> find_transfers(const std::vector<std::vector<Particle>> &particles,
                                   const std::vector<SmokeDescription> &smokes,
                                   const std::vector<std::vector<Removal>> &removals) {
    std::vector<Change> transfers;
    for (uint32_t smoke = 0; smoke < particles.size(); ++smoke) {
        if (removals[smoke].empty()) continue;
        const std::vector<Particle> &all = particles[smoke];
        std::vector<bool> removed(all.size(), false);
        for (const Removal &removal : removals[smoke]) removed[removal.index] = true;
        const CellList cells(all);
        for (const Removal &removal : removals[smoke]) {
            const Particle &p = all[removal.index];
            uint32_t mass_receiver = removal.index;
            double nearest = 2 * p.h;
            cells.for_each_range(p.position, [&](auto first, auto last) {
                for (; first != last; ++first) {
                    if (removed[first->second]) continue;
                    const double distance = length(all[first->second].position - p.position);
                    if (distance < nearest) nearest = distance, mass_receiver = first->second;
                }
            });
            if (mass_receiver == removal.index) continue;
            const double depth = depth_through_middle(p.area, all[mass_receiver].h, smokes[smoke].kernel);
            transfers.push_back({smoke,
                                 {removal.index, mass_receiver},
                                 all[mass_receiver].position,
                                 2 * all[mass_receiver].h,
                                 depth,
                                 0});
        }
    }
    return transfers;
}

struct Ball {
    Double3 center;
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
        // Any two axes at right angles to `forward` serve.
        const Double3 f = forward, other = std::fabs(f.x) < 0.6 ? Double3{1, 0, 0} : Double3{0, 1, 0};
        const Double3 r = other - f * dot(other, f);
        right_ = r * (1 / length(r));
        up_ = {f.y * right_.z - f.z * right_.y, f.z * right_.x - f.x * right_.z, f.x * right_.y - f.y * right_.x};
    }

    // Calls visit(sum so far, what the change adds to it at most) for each bundle that passes its support. `offset` is
    // the change's position relative to the origin.
    template <class Visit> void for_each_passed(const Change &change, const Double3 &offset, Visit &&visit) {
        // The offset in the plane's axes, or its direction; rays within `reach` of it pass the support.
        const double distance = parallel_ ? 1 : length(offset);
        const Double3 target = {dot(offset, right_) / distance, dot(offset, up_) / distance,
                                parallel_ ? 0 : dot(offset, forward_) / distance};
        double reach = change.support + slack * width_, nearest = 1, farthest = 1;
        if (!parallel_) {
            const double sine = change.support / distance, x = sine * sine;
            reach = std::sqrt(2 * x / (1 + std::sqrt(1 - x))) + slack; // 2 sin(angle / 2)
            if (target.z + reach < 0.5) return;                        // rays rise by 1 / sqrt(3) at least
            nearest = std::max(target.z - reach, 0.5), farthest = std::min(target.z + reach, 1.0);
        }
        const auto low = [&](double v) { return cell_of((v - reach) / (v - reach < 0 ? nearest : farthest)); };
        const auto high = [&](double v) { return cell_of((v + reach) / (v + reach < 0 ? farthest : nearest)); };
        const double to_corner = 0.70711 * edge_ * rounding; // of a cell; directions are no farther apart
        const int32_t i0 = low(target.x), i1 = high(target.x), j0 = low(target.y), j1 = high(target.y);
        for (int32_t j = j0; j <= j1; ++j)
            for (int32_t i = i0; i <= i1; ++i) {
                Double3 middle = {(i + 0.5) * edge_ - width_, (j + 0.5) * edge_ - width_, parallel_ ? 0.0 : 1.0};
                if (!parallel_) middle = middle * (1 / length(middle));
                const double apart = std::max(length(middle - target) / rounding - to_corner, 0.0);
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
    std::vector<double> depth_; // sum of the changes so far, in each cell
};

// The planes of the rays from the point `source`, or along the direction `source`. Their cells are small beside the
// supports.
std::vector<Bundles> planes_of(const Double3 &source, bool parallel, const Ball &ball, double mean_support) {
    const auto cells = static_cast<int32_t>(std::min(std::max(8 * ball.radius / mean_support, 32.0), 1024.0));
    std::vector<Bundles> planes;
    if (parallel) {
        const Double3 along = source * (1 / largest_component(source)); // so that no square underflows
        planes.emplace_back(along * (1 / length(along)), true, ball.radius, cells);
        return planes;
    }
    const Double3 offset = ball.center - source;
    const double distance = length(offset);
    if (distance > 1.5 * ball.radius) {
        const double sine = ball.radius / distance;
        planes.emplace_back(offset * (1 / distance), false, sine / std::sqrt(1 - sine * sine) * rounding, cells);
        return planes;
    }
    for (double sign : {-1.0, 1.0})
        for (const Double3 &forward : {Double3{sign, 0, 0}, Double3{0, sign, 0}, Double3{0, 0, sign}})
            planes.emplace_back(forward, false, 1.0, cells);
    return planes;
}

// Keeps the changes that together stay within the bound on all rays from the source.
void keep_within(std::vector<Change> &changes, const Double3 &source, bool parallel, double max_depth) {
    if (changes.empty()) return;
    const Ball ball = ball_around_supports(changes);
    double sum = 0;
    for (const Change &c : changes) sum += c.support;
    std::vector<Bundles> planes = planes_of(source, parallel, ball, sum / static_cast<double>(changes.size()));
    const auto add = [&](const Change &change) {
        const Double3 offset = change.position - (parallel ? ball.center : source);
        if (!parallel && !(length(offset) > change.support * rounding)) return false; // the source is in its support
        bool fits = true;
        for (Bundles &plane : planes)
            plane.for_each_passed(change, offset,
                                  [&](double &depth, double added) { fits &= depth + added <= max_depth; });
        for (Bundles &plane : planes)
            if (fits) plane.for_each_passed(change, offset, [](double &depth, double added) { depth += added; });
        return fits;
    };
    size_t kept = 0;
    for (const Change &change : changes)
        if (add(change)) changes[kept++] = change;
    changes.resize(kept);
}

void keep_within_all(std::vector<Change> &changes, const Double3 &eye, const std::vector<LightSource> &lights,
                     double max_depth) {
    std::sort(changes.begin(), changes.end(), comes_before);
    keep_within(changes, eye, false, max_depth);
    for (const LightSource &light : lights) {
        const bool parallel = light.kind == LightKind::parallel;
        keep_within(changes, parallel ? light.direction : light.position, parallel, max_depth);
    }
}

} // namespace

std::vector<std::vector<Removal>> find_negligible(const std::vector<std::vector<Particle>> &particles,
                                                  const std::vector<SmokeDescription> &smokes, const Double3 &eye,
                                                  const std::vector<LightSource> &lights, double epsilon) {
    const double max_depth = -log1p(-epsilon);
    std::vector<Change> removable = find_candidates(particles, smokes, max_depth);
    keep_within_all(removable, eye, lights, max_depth);
    const auto by_index = [](const Removal &a, const Removal &b) { return a.index < b.index; };
    std::vector<std::vector<Removal>> removals(particles.size());
    for (const Change &c : removable) removals[c.smoke].push_back(c.removal);
    for (auto &of_smoke : removals) std::sort(of_smoke.begin(), of_smoke.end(), by_index);

    std::vector<Change> transfers = find_transfers(particles, smokes, removals);
    keep_within_all(transfers, eye, lights, max_depth);
    for (const Change &transfer : transfers) {
        auto &of_smoke = removals[transfer.smoke];
        *std::lower_bound(of_smoke.begin(), of_smoke.end(), transfer.removal, by_index) = transfer.removal;
    }
    return removals;
}

void remove_particles(std::vector<Particle> &particles, const std::vector<Removal> &removals) {
    for (const Removal &r : removals)
        if (r.mass_receiver != r.index) particles[r.mass_receiver].area += particles[r.index].area;
    size_t kept = 0, next = 0;
    for (size_t i = 0; i < particles.size(); ++i) {
        if (next < removals.size() && removals[next].index == i)
            ++next;
        else
            particles[kept++] = particles[i];
    }
    particles.resize(kept);
}

} // namespace wisp
