// Ray marching through the bricks of resampled smoke (S1), in groups of `lanes` steps.
#include "core/march/grid_march.h"
#include "core/smoke/sparse_grid_lanes.h"

namespace wisp::WISP_ARITH {

namespace {

// A group of steps of one ray, or of parts of steps. A lane has length 0 where its step lies outside of all bricks, or
// behind the last step.
struct Group {
    int32_t step[lanes];
    Real begin;  // of the march, from the ray's origin
    Lanes t, dx; // the middle of each step, as a distance from `begin`, and its length
    LanePoints points;
    bool divided; // these are parts of steps
    Real near;    // what scatters more than once is read from this distance on (nearest_read)
};

} // namespace

struct GridMarchRoom {
    Group steps, parts;                // that wait
    Lanes again;                       // what is scattered more than once
    CornerWeights seen_corners[lanes]; // in cut cells: the same for all smokes
};

GridMarchRoom *make_march_room(Arena &arena) { return arena.make<GridMarchRoom>(1); }
uint64_t march_room_bytes() { return Arena::bytes<GridMarchRoom>(1); }

namespace {

// Moves the points of steps near the eye to where the map is read for them; those of no smoke stay. Returns whether any
// is moved. `t`: where they are then.
WISP_INLINE bool move_from_eye(const SparseGrid &bricks, const GridRay &ray, Group &group, Lanes &t) {
    for (uint32_t l = 0; l < lanes; ++l) t[l] = max(group.t[l], group.near - group.begin);
    if (!(group.begin + group.t[0] < group.near)) return false;
    find_points(bricks, ray, t, group.points);
    for (uint32_t l = 0; l < lanes; ++l) t[l] = group.points.inside[l] ? t[l] : group.t[l];
    find_points(bricks, ray, t, group.points);
    return true;
}

// The light that arrives at each step without smoke in between.
struct LaneLight {
    Lanes irradiance; // of the light's brightest channel
    Lanes x, y, z;    // the direction in which the light travels
    bool is_near;     // its direction may turn within a step
};

WISP_INLINE void illuminate_each(const Light &light, const Ray &ray, const Group &group, LaneLight &lit) {
    lit.is_near = light.kind != LightKind::parallel;
    Light unit = light;
    unit.color = Color(largest(light.color));
    for (uint32_t l = 0; l < lanes; ++l) {
        const Step step = make_step(ray, group.step[l], group.t[l] - Real(0.5) * group.dx[l], group.dx[l]);
        const Illumination here = illuminate(unit, step.middle, step.begin, step.end);
        lit.irradiance[l] = here.irradiance.x;
        lit.x[l] = here.direction.x;
        lit.y[l] = here.direction.y;
        lit.z[l] = here.direction.z;
    }
}

// If a point light is at least 16 steps away, its inverse square distance from the step's middle is taken for the mean
// over the step. The relative error is below 1e-3.
WISP_INLINE void illuminate_group(const Light &light, const Ray &ray, const Group &group, Real step, LaneLight &lit) {
    if (light.kind != LightKind::point) return illuminate_each(light, ray, group, lit);
    const Vec3 from = ray.origin - light.position;
    const Real near = Real(16) * step, brightest = largest(light.color);
    Real nearest = infinite_distance;
    for (uint32_t l = 0; l < lanes; ++l) {
        const Real x = from.x + ray.direction.x * group.t[l], y = from.y + ray.direction.y * group.t[l],
                   z = from.z + ray.direction.z * group.t[l];
        const Real distance = sqrt(x * x + y * y + z * z), inverse = Real(1) / max(distance, near);
        lit.irradiance[l] = brightest * inverse * inverse;
        lit.x[l] = x * inverse;
        lit.y[l] = y * inverse;
        lit.z[l] = z * inverse;
        nearest = min(nearest, distance);
    }
    lit.is_near = false;
    if (nearest < near) illuminate_each(light, ray, group, lit);
}

// The phase function towards the eye in each step: its mean over the step where the light is near.
WISP_INLINE void find_phases(const Light &light, const Phase &phase, const Ray &ray, const Group &group,
                             const LaneLight &lit, Lanes &p) {
    const Vec3 out = -ray.direction;
    for (uint32_t l = 0; l < lanes; ++l) p[l] = phase(Vec3(lit.x[l], lit.y[l], lit.z[l]), out);
    if (!lit.is_near) return;
    for (uint32_t l = 0; l < lanes; ++l) {
        const Step step = make_step(ray, group.step[l], group.t[l] - Real(0.5) * group.dx[l], group.dx[l]);
        p[l] = mean_phase(light, phase, Vec3(lit.x[l], lit.y[l], lit.z[l]), step.begin, step.end, out);
    }
}

// What a point light near each step adds to multiple scattering (LightPeak). Returns whether there may be any. `sigma`
// is that of all smoke.
WISP_INLINE bool find_peaks(const GridMarcher &marcher, const Light &light, const Phase &phase, const Ray &ray,
                            const Group &group, const Lanes &sigma, const LaneLight &lit, const Lanes &tau,
                            Lanes &peak) {
    for (uint32_t l = 0; l < lanes; ++l) peak[l] = Real(0);
    if (!marcher.irradiance || !lit.is_near || light.kind != LightKind::point) return false;
    const LightPeak peak_of(phase);
    for (uint32_t l = 0; l < lanes; ++l) {
        if (!(sigma[l] > Real(0))) continue;
        const Real cell =
            largest(marcher.depths->bricks->cell) * Real(marcher.irradiance->spacing[group.points.brick[l]]);
        const Real here =
            peak_of(largest(light.color), lit.irradiance[l], cell, Vec3(lit.x[l], lit.y[l], lit.z[l]), -ray.direction);
        if (here > Real(0)) peak[l] = sigma[l] * here * exp(-max(Real(0), tau[l]));
    }
    return true;
}

// Takes off the scattered radiance of a light in each step, and its peak, the part that lies in the shadow of surfaces.
void shade(const GridMarcher &marcher, uint32_t light, const Ray &ray, const Group &group, Lanes &scattered,
           Lanes &peak, PixelRecorder *recorder) {
    Lanes length, lit;
    for (uint32_t l = 0; l < lanes; ++l) length[l] = scattered[l] > Real(0) ? group.dx[l] : Real(0);
    record_lit_parts(*marcher.shadows, light, ray, lanes, group.t, length, lit, recorder);
    for (uint32_t l = 0; l < lanes; ++l) scattered[l] *= lit[l], peak[l] *= lit[l];
}

// The depth from the point at distance t of the ray to the light, by a ray.
Real depth_at(const GridMarcher &marcher, const Light &light, const Ray &ray, Real t) {
    const Vec3 x = ray.origin + ray.direction * t;
    const Illumination from = illuminate(light, x, x, x);
    ++marcher.statistics->rays.shadow;
    return optical_depth(*marcher.medium, {x, -from.direction}, from.distance);
}

// Returns the mask of the steps in cells in which depths to lights bend. `rate`: sigma_t of each step; it becomes what
// steps are divided by.
uint32_t find_bends(const GridMarcher &marcher, const LaneCells &at, const Group &group, Lanes &rate) {
    const Medium &medium = *marcher.medium;
    const int32_t spacing = max(marcher.depths->spacing, 1); // 0: there is no light
    const Real most = sum_of_resampled(medium, [](const ResampledField &field) { return field.largest; });
    if (!(most * largest(medium.bricks->cell) * Real(spacing * spacing) > max_bend)) return 0;
    uint32_t mask = 0, brick = no_brick;
    bool may_bend = false; // in this brick
    for (uint32_t l = 0; l < lanes; ++l) {
        if (!(rate[l] > Real(0))) continue;
        if (const uint32_t here = static_cast<uint32_t>(group.points.brick[l]); here != brick) {
            brick = here;
            may_bend = may_bend_in(medium, spacing, brick);
        }
        if (!may_bend) continue;
        const Bend bend = bend_of_cell(medium, spacing, brick, static_cast<uint32_t>(at.node[l]) - brick * nodes_of(1));
        if (bend.of_depths) mask |= 1u << l;
        rate[l] = max(rate[l], bend.densest);
    }
    return mask;
}

// Replaces the depths of the steps in whose cells they are not interpolated: among others, those in the mask `bends`.
// `sigma` is that of all smoke.
WISP_INLINE void find_depths_by_rays(const GridMarcher &marcher, const Light &light, const Ray &ray, const Group &group,
                                     const Lanes &sigma, uint32_t bends, Lanes &tau) {
    const OpticalDepthGrid &depths = *marcher.depths;
    const bool in_smoke = stands_near(light, depths.bricks->bounds, reach_of_peak(depths));
    for (uint32_t l = 0; l < lanes; ++l)
        if (sigma[l] > Real(0) && (is_dense(depths, sigma[l]) || (bends >> l & 1) != 0 ||
                                   (in_smoke && has_peak(depths, light, ray.origin + ray.direction * group.t[l]))))
            tau[l] = depth_at(marcher, light, ray, group.t[l]);
}

// Within a step of depth s the depth to a light changes by c, which is taken to be linear. The light that leaves the
// step is then shc((s + c) / 2) / shc(s / 2) times as much as if all of it were scattered in the middle, where shc(u)
// is sinh(u) / u (README). That is for smoke with hard faces. Smoke that fades to 0 at both ends of a ray is better off
// without: errors of the middles cancel.
WISP_INLINE void vary_in_steps(const LaneCells &at, const OpticalDepthGrid &depths, const GridRay &in_bricks,
                               const Group &group, const Lanes &sigma, Lanes &scattered) {
    const auto shc = [](Real double_u) { // by its series: it errs by less than 2e-4
        const Real square = Real(0.25) * double_u * double_u;
        return Real(1) + square * (Real(1.0 / 6) + square * Real(1.0 / 120));
    };
    Lanes change; // of the depth, per unit of length
    change_along(at, depths.depth, in_bricks.direction * (Real(1) / Real(depths.spacing)), change);
    for (uint32_t l = 0; l < lanes; ++l) {
        const Real s = sigma[l] * group.dx[l], c = change[l] * group.dx[l];
        scattered[l] *= shc(min(max(s + c, Real(-2)), Real(2))) / shc(s);
    }
}

// A stretch of a ray through smoke of one sigma, and the depths to a light where it begins and ends.
struct Stretch {
    Real begin, end, first, last;
};

// The mean over a stretch of e^-(sigma (t - begin) + depth to the light at t). The stretch is halved, at most so many
// times, until the depth in its middle is what it would be if the depth were linear.
Real mean_arriving(const GridMarcher &marcher, const Light &light, const Ray &ray, Real sigma, const Stretch &part,
                   int32_t halvings) {
    const Real middle = Real(0.5) * (part.begin + part.end), linear = Real(0.5) * (part.first + part.last);
    const Real s = sigma * (part.end - part.begin);
    if (halvings > 0 && min(part.first, part.last) < opaque_depth) {
        const Real depth = depth_at(marcher, light, ray, middle);
        if (abs(depth - linear) > depth_tolerance) {
            const Stretch near = {part.begin, middle, part.first, depth}, far = {middle, part.end, depth, part.last};
            return Real(0.5) * (mean_arriving(marcher, light, ray, sigma, near, halvings - 1) +
                                exp(Real(-0.5) * s) * mean_arriving(marcher, light, ray, sigma, far, halvings - 1));
        }
    }
    const Real more = s + (part.last - part.first); // of depth, on both ways, where the stretch ends
    return more < Real(0) ? exp(-(part.last + s)) * mean_transmittance(-more)
                          : exp(-part.first) * mean_transmittance(more);
}

// The cell of the depths in which the middle of a step lies.
Box cell_around(const GridMarcher &marcher, const Ray &ray, const LaneCells &at, const Group &group, uint32_t l) {
    const Vec3 size = marcher.depths->bricks->cell * Real(marcher.depths->spacing);
    const Vec3 low = ray.origin + ray.direction * group.t[l] - Vec3(at.x[l], at.y[l], at.z[l]) * size;
    return {low, low + size};
}

// Where the depth to a light differs by more than 1 between the corners of a cell, as where light grazes a hard face,
// or bends within the cell, it is not interpolated: rays find it within the step (README). `lit` is the scattered light
// without what smoke takes from it.
WISP_INLINE void vary_in_steep_cells(const GridMarcher &marcher, const Light &light, const Ray &ray,
                                     const LaneCells &at, const Group &group, const Lanes &sigma, const Lanes &lit,
                                     Lanes &tau, Lanes &scattered) {
    constexpr int32_t halvings = 8;
    Real end = Real(-1), depth_of_end = Real(0); // of the last step whose depths were found
    for (uint32_t l = 0; l < lanes; ++l) {
        Real least, greatest;
        range_of_corners(marcher.depths->depth + at.node[l], at.row[l], at.layer[l], least, greatest);
        if (!(greatest - least > depth_tolerance) || !(least < opaque_depth) || !(sigma[l] > Real(0))) continue;
        if (!(greatest - least > Real(1)) &&
            !has_crease(marcher.depths->bricks->bounds, light, cell_around(marcher, ray, at, group, l)))
            continue;
        const Real half = Real(0.5) * group.dx[l], from = group.t[l] - half, to = group.t[l] + half;
        const Real first = abs(from - end) < half * Real(0x1p-8) ? depth_of_end : depth_at(marcher, light, ray, from);
        end = to;
        depth_of_end = depth_at(marcher, light, ray, to);
        const Real arriving = mean_arriving(marcher, light, ray, sigma[l], {from, to, first, depth_of_end}, halvings);
        tau[l] = Real(0.5) * (first + depth_of_end);
        scattered[l] = lit[l] * arriving / mean_transmittance(sigma[l] * group.dx[l]);
    }
}

// Adds the single scattering of one smoke in each step: irradiance of each light, attenuated by all smoke between light
// and step, times the phase function. Albedo and extinction are left to the caller. `sigma` is the extinction of all
// smoke; that of this one, `extinction`, is recorded only. What lights add to multiple scattering goes there.
WISP_INLINE void gather_lights(const GridMarcher &marcher, const SmokeVolume &smoke, const Ray &ray,
                               const GridRay &in_bricks, const Group &group, const Lanes &sigma, uint32_t bends,
                               const Lanes &extinction, LaneColor &scattered, LaneColor &multiple,
                               PixelRecorder *recorder) {
    const OpticalDepthGrid &depths = *marcher.depths;
    if (depths.light_count == 0) return;
    LaneCells at;
    find_cells(group.points, depths.spacing, static_cast<int32_t>(depths.light_count), at);
    const int32_t nodes = static_cast<int32_t>(nodes_of(depths.spacing));
    for (uint32_t light = 0; light < depths.light_count; ++light) {
        LaneLight lit;
        const Light &from = depths.lights[light];
        const Real brightest = largest(from.color);
        illuminate_group(from, ray, group, marcher.step, lit);
        Lanes tau, p, unattenuated;
        interpolate(at, depths.depth, tau);
        find_depths_by_rays(marcher, from, ray, group, sigma, bends, tau);
        if (smoke.phase.isotropic())
            for (uint32_t l = 0; l < lanes; ++l) p[l] = inv_four_pi<Real>;
        else
            find_phases(from, smoke.phase, ray, group, lit, p);
        for (uint32_t l = 0; l < lanes; ++l) unattenuated[l] = p[l] * lit.irradiance[l];
        for (uint32_t l = 0; l < lanes; ++l) p[l] *= lit.irradiance[l] * exp(-max(Real(0), tau[l]));
        if (depths.cut_off) {
            vary_in_steps(at, depths, in_bricks, group, sigma, p);
            vary_in_steep_cells(marcher, from, ray, at, group, sigma, unattenuated, tau, p);
        }
        Lanes peak;
        const bool has_peaks = find_peaks(marcher, from, smoke.phase, ray, group, sigma, lit, tau, peak);
        if (has(parts::surfaces) && marcher.shadows) shade(marcher, light, ray, group, p, peak, recorder);
        if (brightest > Real(0)) add(scattered, p, from.color / brightest);
        if (has_peaks && brightest > Real(0)) add(multiple, peak, from.color / brightest * smoke.albedo);
        if (is_recording(recorder) && brightest > Real(0)) {
            LaneLightRecord &record = recorder->lane_light;
            record.light = light;
            record.smoke = static_cast<uint32_t>(&smoke - marcher.medium->smokes);
            record.source = &from;
            record.color = from.color / brightest;
            record.albedo = smoke.albedo;
            for (uint32_t l = 0; l < lanes; ++l) {
                record.step[l] = group.step[l];
                record.middle[l] = ray.origin + ray.direction * group.t[l];
                record.direction[l] = Vec3(lit.x[l], lit.y[l], lit.z[l]);
                record.irradiance[l] = lit.irradiance[l];
                record.optical_depth[l] = tau[l];
                record.extinction[l] = extinction[l];
                record.scattered[l] = p[l];
            }
            recorder->lane_lights(*recorder);
        }
        for (uint32_t l = 0; l < lanes; ++l) at.node[l] += nodes;
    }
}

// The light's spherical harmonics with l = 2 and 3, each times the phase function's harmonic towards `out`, summed. The
// terms of a node are summed before they are interpolated.
WISP_INLINE void gather_harmonics(const Irradiance &map, const Phase &phase, const Group &group, const Vec3 &out,
                                  Lanes &sent) {
    LaneCells at;
    find_cells(group.points, map.harmonic_spacing, 1, at);
    const SphericalHarmonics seen = phase_harmonics(phase, out);
    const auto sum = [&](int32_t node) {
        const uint32_t *packed = map.harmonics + node * static_cast<int32_t>(harmonic_words);
        return packed_sum(seen, packed, 0, harmonic_count);
    };
    interpolate(at, sum, sent);
    for (uint32_t l = 0; l < lanes; ++l) sent[l] *= Real(1.0 / max_component);
}

// Returns the mask of the steps in cut cells that see corners of these.
uint32_t find_cut_steps(const CutCells &cut, const Ray &ray, const Group &group, const Lanes &t,
                        CornerWeights (&weights)[lanes]) {
    uint32_t mask = 0;
    LaneCells at;
    find_cells(group.points, cut.spacing, 1, at);
    for (uint32_t l = 0; l < lanes; ++l) {
        const uint32_t brick = static_cast<uint32_t>(group.points.brick[l]),
                       node = static_cast<uint32_t>(at.node[l]) - static_cast<uint32_t>(cut.first(brick));
        if (!(group.dx[l] > Real(0)) || !cut.is_cut(brick, node)) continue;
        if (find_weights_in_cut_cell(cut, brick, {node, Vec3(at.x[l], at.y[l], at.z[l])},
                                     ray.origin + ray.direction * t[l], weights[l]))
            mask |= 1u << l;
    }
    return mask;
}

struct CutLanes {
    uint32_t mask; // of steps in cut cells
    const CornerWeights *weights;
};

// Trilinear interpolation as in `interpolate`, but within cut cells by their weights.
template <class Value>
WISP_INLINE void interpolate_seen(const LaneCells &at, const CutLanes &cut, Value &&value, Lanes &result) {
    interpolate(at, value, result);
    for (uint32_t rest = cut.mask; rest != 0; rest &= rest - 1) {
        const uint32_t l = static_cast<uint32_t>(__builtin_ctz(rest));
        result[l] = Real(0);
        for (uint32_t corner = 0; corner < 8; ++corner)
            result[l] += cut.weights[l].of[corner] * value(node_of_corner(at, l, corner));
    }
}

// Adds the multiple scattering of one smoke in each step, from the irradiance map (S4-4).
WISP_INLINE void gather_scattered(const GridMarcher &marcher, const SmokeVolume &smoke, const Ray &ray,
                                  const Group &group, const CutLanes &cut, LaneColor &scattered) {
    const Vec3 out = -ray.direction;
    if (!marcher.irradiance) return;
    const Irradiance &map = *marcher.irradiance;
    int32_t first[lanes], spacing[lanes], exponent[3][lanes];
    for (uint32_t l = 0; l < lanes; ++l) {
        first[l] = map.first[group.points.brick[l]];
        spacing[l] = map.spacing[group.points.brick[l]];
        for (int32_t c = 0; c < 3; ++c) exponent[c][l] = map.scale[group.points.brick[l]].exponent[c];
    }
    LaneCells at;
    find_cells(group.points, first, spacing, at);
    Lanes p;
    for (uint32_t l = 0; l < lanes; ++l) p[l] = Real(1);
    if (map.flux && !smoke.phase.isotropic()) {
        Lanes flux[3];
        for (int32_t c = 0; c < 3; ++c)
            interpolate_seen(
                at, cut, [&map, c](int32_t node) { return unpack_flux(map.flux[node])[c]; }, flux[c]);
        const auto there = [&flux](uint32_t l) { return Vec3(flux[0][l], flux[1][l], flux[2][l]); };
        if (map.harmonics && uses_harmonics(smoke.phase.asymmetry())) {
            Lanes more;
            gather_harmonics(map, smoke.phase, group, out, more);
            for (uint32_t l = 0; l < lanes; ++l) p[l] = phase_of_moments(smoke.phase, there(l), more[l], out);
        } else {
            for (uint32_t l = 0; l < lanes; ++l) p[l] = phase_of_flux(smoke.phase, there(l), out) * four_pi<Real>;
        }
    }
    if (map.single_channel) {
        Lanes value;
        const uint32_t *values = map.value;
        interpolate_seen(
            at, cut, [values](int32_t node) { return Real(static_cast<int32_t>(values[node])); }, value);
        for (uint32_t l = 0; l < lanes; ++l) p[l] *= scale_pow2(value[l], exponent[0][l] - single_channel_bits);
        add(scattered, p, map.color);
        return;
    }
    Lanes channel[3];
    for (int32_t c = 0; c < 3; ++c) {
        interpolate_seen(
            at, cut, [&map, c](int32_t node) { return unpack_color(map.value[node], 0)[c]; }, channel[c]);
        for (uint32_t l = 0; l < lanes; ++l) channel[c][l] = scale_pow2(channel[c][l], exponent[c][l]);
    }
    for (uint32_t l = 0; l < lanes; ++l) {
        scattered.red[l] += p[l] * channel[0][l];
        scattered.green[l] += p[l] * channel[1][l];
        scattered.blue[l] += p[l] * channel[2][l];
    }
}

constexpr uint32_t units_of_brick = 8; // of work

// The length of step i of a march of this length. 0: the step begins behind the end.
Real length_of_step(int32_t i, Real step, Real length) { return max(Real(0), min(step, length - Real(i) * step)); }

// The number of equal parts of each step in a brick. 1: no step in it can be deeper than opaque_depth.
int32_t parts_in_brick(const GridMarcher &marcher, const GridRay &in_bricks, uint32_t brick) {
    Real least = Real(0), most = Real(0);
    for (uint32_t s = 0; s < marcher.medium->count; ++s) {
        const DensityField &field = marcher.medium->smokes[s].field;
        if (!field.is_resampled) continue;
        least += field.resampled.minorants[brick];
        most += field.resampled.majorants[brick];
    }
    if (!(most * marcher.step > opaque_depth)) return 1;
    const Vec3 &cells = in_bricks.direction; // in a unit of length
    return parts_of_dense_step((most - least) * marcher.step,
                               marcher.step * (abs(cells.x) + abs(cells.y) + abs(cells.z)));
}

// Lanes from `count` on have no step.
void pad(Group &group, uint32_t count, Real t) {
    for (uint32_t l = count; l < lanes; ++l) group.step[l] = group.step[0], group.t[l] = t, group.dx[l] = Real(0);
}

// sigma_t of a resampled smoke in each step.
WISP_INLINE void find_extinctions(const SmokeVolume &smoke, const LaneCells &at, const Group &group, Lanes &sigma) {
    interpolate(at, smoke.field.resampled.extinction, sigma);
    for (uint32_t l = 0; l < lanes; ++l) sigma[l] = group.dx[l] > Real(0) ? sigma[l] : Real(0);
}

// The weights of the steps' sources: the transmittance of the smoke in front of each step, times the mean transmittance
// within it, times its length. `before`: the sums of the depths before each. Returns the sum of all.
WISP_INLINE Real find_weights(const Lanes &depth, const Group &group, Real so_deep, Lanes &before, Lanes &weight) {
    Real sum = Real(0);
    for (uint32_t l = 0; l < lanes; ++l) {
        before[l] = sum;
        sum += depth[l];
    }
    for (uint32_t l = 0; l < lanes; ++l)
        weight[l] = exp(-(so_deep + before[l])) * mean_transmittance_of(depth[l], exp(-depth[l])) * group.dx[l];
    return sum;
}

// Multiplies one channel of the sources by weights of less depth. `straight`: what to take from each depth; `so_far`:
// the sum of that so far.
WISP_INLINE void weigh_straight(const Lanes &depth, const Lanes &straight, const Group &group, Real so_deep,
                                Real &so_far, Lanes &source) {
    Lanes less, before, weight;
    for (uint32_t l = 0; l < lanes; ++l) less[l] = depth[l] - straight[l] * group.dx[l];
    find_weights(less, group, so_deep - so_far, before, weight);
    for (uint32_t l = 0; l < lanes; ++l) {
        source[l] *= weight[l];
        so_far += straight[l] * group.dx[l];
    }
}

// Marches through the steps of a group. False: one is deeper than max_step_depth, and they are not divided yet; sigma
// is sigma_t of all smoke in each.
WISP_MULTIVERSIONED bool march_group(const GridMarcher &marcher, const Ray &ray, const GridRay &in_bricks, Group &group,
                                     Lanes &sigma, MarchProgress &so_far, PixelRecorder *recorder) {
    const Medium &medium = *marcher.medium;
    const SparseGrid &bricks = *medium.bricks;
    find_points(bricks, in_bricks, group.t, group.points);
    for (uint32_t l = 0; l < lanes; ++l) group.dx[l] = group.points.inside[l] ? group.dx[l] : Real(0);
    LaneCells at;
    find_cells(group.points, 1, 1, at);
    Lanes here;
    for (uint32_t l = 0; l < lanes; ++l) sigma[l] = Real(0);
    for (uint32_t s = 0; s < medium.count; ++s) {
        if (!medium.smokes[s].field.is_resampled) continue;
        find_extinctions(medium.smokes[s], at, group, here);
        for (uint32_t l = 0; l < lanes; ++l) sigma[l] += here[l];
    }
    Lanes rate;
    for (uint32_t l = 0; l < lanes; ++l) rate[l] = sigma[l];
    const uint32_t bends = find_bends(marcher, at, group, rate);
    Real deepest = Real(0);
    for (uint32_t l = 0; l < lanes; ++l) deepest = max(deepest, rate[l] * group.dx[l]);
    if (!(deepest > Real(0))) return true;
    if (deepest > max_step_depth && !group.divided) {
        for (uint32_t l = 0; l < lanes; ++l) sigma[l] = rate[l];
        return false;
    }

    CutLanes cut = {0, marcher.room->seen_corners};
    Lanes read; // where the map is read
    const bool is_near = move_from_eye(bricks, in_bricks, group, read);
    if (marcher.irradiance && marcher.irradiance->cut.any())
        cut.mask = find_cut_steps(marcher.irradiance->cut, ray, group, read, marcher.room->seen_corners);
    LaneColor source, straight; // straight: sigma_s of all smoke, of what only goes straight on
    set(source, Color(Real(0)));
    set(straight, Color(Real(0)));
    Lanes &again = marcher.room->again;
    for (uint32_t l = 0; l < lanes; ++l) again[l] = Real(0);
    if (is_recording(recorder)) recorder->lanes_begin(*recorder);
    for (uint32_t s = 0; s < medium.count; ++s) {
        const SmokeVolume &smoke = medium.smokes[s];
        if (!smoke.field.is_resampled) continue;
        if (medium.count > 1) find_extinctions(smoke, at, group, here); // else `here` holds them still
        Real any = Real(0);
        for (uint32_t l = 0; l < lanes; ++l) any = max(any, here[l]);
        if (!(any > Real(0))) continue;
        const Color glow = (Color(Real(1)) - smoke.albedo) * smoke.emission;
        LaneColor single, multiple;
        set(single, Color(Real(0)));
        set(multiple, Color(Real(0)));
        if (is_near) find_points(bricks, in_bricks, group.t, group.points);
        gather_lights(marcher, smoke, ray, in_bricks, group, sigma, bends, here, single, multiple, recorder);
        if (is_near) find_points(bricks, in_bricks, read, group.points);
        gather_scattered(marcher, smoke, ray, group, cut, multiple);
        if (is_recording(recorder)) {
            LaneSourceRecord &record = recorder->lane_source;
            for (uint32_t l = 0; l < lanes; ++l) record.extinction[l] = here[l];
            record.single = single;
            record.multiple = multiple;
            record.albedo = smoke.albedo;
            record.emission = glow;
            recorder->lane_sources(*recorder);
        }
        if (marcher.straight > Real(0)) add(straight, here, smoke.albedo * marcher.straight);
        if (has(parts::photons) && marcher.irradiance)
            for (uint32_t l = 0; l < lanes; ++l)
                again[l] += here[l] * (smoke.albedo.x * multiple.red[l] + smoke.albedo.y * multiple.green[l] +
                                       smoke.albedo.z * multiple.blue[l]);
        for (uint32_t l = 0; l < lanes; ++l) {
            source.red[l] += here[l] * (smoke.albedo.x * (single.red[l] + multiple.red[l]) + glow.x);
            source.green[l] += here[l] * (smoke.albedo.y * (single.green[l] + multiple.green[l]) + glow.y);
            source.blue[l] += here[l] * (smoke.albedo.z * (single.blue[l] + multiple.blue[l]) + glow.z);
        }
    }

    Lanes depth, before, weight;
    for (uint32_t l = 0; l < lanes; ++l) depth[l] = sigma[l] * group.dx[l];
    const Real so_deep = so_far.depth.value;
    const Real sum = find_weights(depth, group, so_deep, before, weight);
    if (marcher.straight > Real(0)) {
        weigh_straight(depth, straight.red, group, so_deep, so_far.straight.x, source.red);
        weigh_straight(depth, straight.green, group, so_deep, so_far.straight.y, source.green);
        weigh_straight(depth, straight.blue, group, so_deep, so_far.straight.z, source.blue);
    } else {
        for (uint32_t l = 0; l < lanes; ++l) {
            source.red[l] *= weight[l];
            source.green[l] *= weight[l];
            source.blue[l] *= weight[l];
        }
    }
    if (is_recording(recorder)) {
        LaneStepRecord &record = recorder->lane_step;
        for (uint32_t l = 0; l < lanes; ++l) {
            record.step[l] = group.step[l];
            record.distance[l] = group.begin + group.t[l];
            record.length[l] = group.dx[l];
            record.extinction[l] = sigma[l];
            record.optical_depth[l] = so_deep + before[l];
        }
        record.radiance = source;
        recorder->lane_steps(*recorder);
    }
    if (has(parts::photons) && marcher.irradiance) {
        for (uint32_t l = 0; l < lanes; ++l) again[l] *= weight[l];
        so_far.again += sum_of_lanes(again);
    }
    so_far.radiance += Color(sum_of_lanes(source.red), sum_of_lanes(source.green), sum_of_lanes(source.blue));
    so_far.depth.add(sum);
    return true;
}

// Marches through the steps of a group in equal parts, each not deeper than max_step_depth.
void march_divided(const GridMarcher &marcher, const Ray &ray, const GridRay &in_bricks, const Group &group,
                   const Lanes &sigma, MarchProgress &so_far, PixelRecorder *recorder) {
    Group &parts = marcher.room->parts;
    parts.begin = group.begin;
    parts.divided = true;
    parts.near = group.near;
    uint32_t waiting = 0;
    const auto march_parts = [&] {
        marcher.statistics->smoke.march_samples += waiting;
        Lanes of_parts;
        march_group(marcher, ray, in_bricks, parts, of_parts, so_far, recorder);
        waiting = 0;
        return !so_far.opaque() && marcher.watch.go_on(units_of_brick * (1 + marcher.depths->light_count));
    };
    for (uint32_t l = 0; l < lanes; ++l) {
        const int32_t count = group.dx[l] > Real(0) ? parts_of_step(sigma[l] * group.dx[l], max_step_depth) : 0;
        const Real dx = count > 0 ? group.dx[l] / Real(count) : Real(0), from = group.t[l] - Real(0.5) * group.dx[l];
        for (int32_t i = 0; i < count; ++i) {
            parts.step[waiting] = so_far.number++;
            parts.dx[waiting] = dx;
            parts.t[waiting++] = from + (Real(i) + Real(0.5)) * dx;
            if (waiting == lanes && !march_parts()) return;
        }
    }
    if (waiting == 0) return;
    pad(parts, waiting, Real(0));
    march_parts();
}

// Marches through the steps of a group, divided where that is needed.
void march_steps(const GridMarcher &marcher, const Ray &ray, const GridRay &in_bricks, Group &group,
                 MarchProgress &so_far, PixelRecorder *recorder) {
    Lanes sigma;
    if (!march_group(marcher, ray, in_bricks, group, sigma, so_far, recorder))
        march_divided(marcher, ray, in_bricks, group, sigma, so_far, recorder);
}

} // namespace

Segment march(GridMarcher &marcher, const Ray &ray, Real end, PixelRecorder *recorder) {
    const Medium &medium = *marcher.medium;
    Real begin = Real(0);
    if (medium.empty() || !clip(medium.bounds, ray, begin, end)) return empty_segment();
    const Ray inside = {ray.origin + ray.direction * begin, ray.direction};
    const Real length = end - begin, inverse_step = Real(1) / marcher.step;
    const int32_t steps = floor_to_int(length * inverse_step) + 1;
    const GridRay in_bricks(*medium.bricks, inside);
    if (is_recording(recorder)) recorder->march(*recorder, begin, end, marcher.step, steps);
    MarchProgress so_far;
    Group &group = marcher.room->steps;
    group.begin = begin;
    group.divided = false;
    group.near = marcher.irradiance ? nearest_read(*marcher.irradiance, ray, begin) : Real(0);
    uint32_t waiting = 0; // steps that are in `group` already
    const OpticalDepthGrid &depths = *marcher.depths;
    const bool passes_light = is_light_near(depths.lights, depths.light_count, inside, Real(0), length, marcher.step);
    // Adds a part of a step, or its halves where a light is near. Returns whether to continue.
    const auto add_part = [&](auto &&add_half, Real from, Real dx) -> bool {
        if (passes_light && parts_near_lights(depths.lights, depths.light_count, inside, from, dx, marcher.step) > 1) {
            const Real half = Real(0.5) * dx;
            return add_half(add_half, from, half) && add_half(add_half, from + half, half);
        }
        ++marcher.statistics->smoke.march_samples;
        group.step[waiting] = so_far.number++;
        group.dx[waiting] = dx;
        group.t[waiting] = from + Real(0.5) * dx;
        if (++waiting < lanes) return true;
        march_steps(marcher, inside, in_bricks, group, so_far, recorder);
        waiting = 0;
        return !so_far.opaque();
    };
    // Adds step i in equal parts. Returns whether to continue.
    const auto add_step = [&](int32_t i, int32_t parts) {
        const Real whole = length_of_step(i, marcher.step, length), dx = parts > 1 ? whole / Real(parts) : whole;
        for (int32_t part = 0; part < parts; ++part)
            if (!add_part(add_part, Real(i) * marcher.step + Real(part) * dx, dx)) return false;
        return true;
    };
    int32_t next = 0;                 // the first step that no brick has taken yet
    int32_t held = 0, held_parts = 0; // the last one taken, which may reach into the next brick; in 0 parts: none
    for_each_brick(*medium.bricks, inside, Real(0), length, [&](uint32_t brick, Real from, Real to) {
        // This brick takes the steps whose middles lie in it; if it has dense walls, all that meet it.
        const int32_t parts = parts_in_brick(marcher, in_bricks, brick);
        const Real shift = parts > 1 ? Real(0) : Real(0.5);
        const int32_t first = max(next, floor_to_int(from * inverse_step + shift));
        const int32_t last = to < length ? min(floor_to_int(to * inverse_step + (Real(1) - shift)), steps) : steps;
        if (held_parts > 0 && from < Real(held + 1) * marcher.step) held_parts = max(held_parts, parts);
        if (first < last) {
            if (!add_step(held, held_parts)) return false;
            for (int32_t i = first; i < last - 1; ++i)
                if (!add_step(i, parts)) return false;
            held = last - 1;
            held_parts = parts;
        }
        next = max(next, last);
        return marcher.watch.go_on(units_of_brick * static_cast<uint32_t>(parts) * (1 + marcher.depths->light_count));
    });
    if (!so_far.opaque() && add_step(held, held_parts) && waiting > 0) {
        pad(group, waiting, Real(steps) * marcher.step);
        march_steps(marcher, inside, in_bricks, group, so_far, recorder);
    }
    return so_far.finish(marcher.irradiance, *marcher.statistics, recorder);
}

} // namespace wisp::WISP_ARITH
