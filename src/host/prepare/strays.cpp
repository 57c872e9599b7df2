#include "host/base/double3_algebra.h"
#include "host/prepare/frustum.h"
#include "host/prepare/strays.h"

namespace wisp {

namespace {

constexpr double far_out_of_view = 0x1p13, far_in_view = 0x1p16;     // in smoothing lengths
constexpr double most_out_of_view = 0x1p-13, most_in_view = 0x1p-28; // steradians

constexpr double Double3::*axes[] = {&Double3::x, &Double3::y, &Double3::z};

struct Bounds {
    Double3 low, high;

    void add(const Double3 &p, double radius) {
        const Double3 reach = {radius, radius, radius}, least = p - reach, most = p + reach;
        low = {std::min(low.x, least.x), std::min(low.y, least.y), std::min(low.z, least.z)};
        high = {std::max(high.x, most.x), std::max(high.y, most.y), std::max(high.z, most.z)};
    }
    // The largest distance along an axis.
    double distance(const Double3 &p) const {
        double farthest = 0;
        for (const auto axis : axes) farthest = std::max({farthest, low.*axis - p.*axis, p.*axis - high.*axis});
        return farthest;
    }
    // Whether a ray comes within `radius` of the box.
    bool is_met(const Double3 &origin, const Double3 &direction, double radius) const {
        const Double3 reach = {radius, radius, radius};
        return meets_box(low - reach, high + reach, origin, direction, 1e300);
    }
};

// The box that leaves out a tenth of the particles on each side.
std::optional<Bounds> bounds_of_most(const std::vector<std::vector<Particle>> &particles) {
    Bounds bounds = {};
    for (const auto axis : axes) {
        std::vector<double> x;
        for (const auto &smoke : particles)
            for (const Particle &p : smoke) x.push_back(p.position.*axis);
        if (x.empty()) return std::nullopt;
        const size_t tenth = std::min(std::max<size_t>(x.size() / 10, 1), (x.size() - 1) / 2);
        const auto at = [&x](size_t i) {
            std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(i), x.end());
            return x[i];
        };
        bounds.low.*axis = at(tenth);
        bounds.high.*axis = at(x.size() - 1 - tenth);
    }
    return bounds;
}

} // namespace

std::optional<Double3> middle_of_most(const std::vector<std::vector<Particle>> &particles) {
    const std::optional<Bounds> bounds = bounds_of_most(particles);
    if (!bounds) return std::nullopt;
    return (bounds->low + bounds->high) * 0.5;
}

std::vector<Stray> remove_strays(std::vector<std::vector<Particle>> &particles, const Surroundings &around) {
    const Frustum view(around.camera, around.width, around.height);
    const auto is_in_view = [&](const Particle &p) { return around.mirrors || !view.misses({p.position}, 2 * p.h); };
    // What is near the rest belongs to it, until nothing is left that does. The order does not matter: the rest only
    // grows.
    const std::optional<Bounds> most = bounds_of_most(particles);
    if (!most) return {};
    Bounds rest = *most;
    for (const Double3 &point : around.points) rest.add(point, 0);
    const auto joins_rest = [&](const Particle &p) {
        const double distance = rest.distance(p.position) / p.h;
        const bool is_far = distance >= far_out_of_view && (distance >= far_in_view || !is_in_view(p)) &&
                            std::none_of(around.beams.begin(), around.beams.end(),
                                         [&](const Double3 &beam) { return rest.is_met(p.position, beam, 2 * p.h); });
        if (!is_far) rest.add(p.position, 2 * p.h);
        return !is_far;
    };
    std::vector<Stray> strays;
    for (size_t smoke = 0; smoke < particles.size(); ++smoke)
        for (size_t i = 0; i < particles[smoke].size(); ++i)
            if (!joins_rest(particles[smoke][i])) strays.push_back({smoke, i, particles[smoke][i].position, 0});
    const auto joined = [&](const Stray &stray) { return joins_rest(particles[stray.smoke][stray.index]); };
    for (size_t before = strays.size() + 1; before != strays.size();) {
        before = strays.size();
        strays.erase(std::remove_if(strays.begin(), strays.end(), joined), strays.end());
    }

    double covered = 0;
    for (Stray &stray : strays) {
        const Particle &p = particles[stray.smoke][stray.index];
        stray.distance = rest.distance(p.position) / p.h;
        covered += 4 * 3.15 / (stray.distance * stray.distance) / (is_in_view(p) ? most_in_view : most_out_of_view);
    }
    if (covered > 1) return {};
    auto stray = strays.begin();
    for (size_t smoke = 0; smoke < particles.size(); ++smoke) {
        auto &of = particles[smoke];
        size_t kept = 0;
        for (size_t i = 0; i < of.size(); ++i)
            if (stray != strays.end() && stray->smoke == smoke && stray->index == i)
                ++stray;
            else
                of[kept++] = of[i];
        of.resize(kept);
    }
    return strays;
}

} // namespace wisp
