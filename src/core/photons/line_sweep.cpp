// Light along parallel lines through the bricks (S4-5): long characteristics (Askew 1972).
#include "core/photons/line_sweep.h"
#include "core/photons/packed_light.h"
#include "core/photons/spherical_harmonics.h"
#include "core/smoke/sparse_grid_lanes.h"
#include "core/smoke/transmittance.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint64_t places_of_brick = 32; // of the lattice, for each brick: where there are more, lines do not pay
constexpr uint32_t units_of_sample = 4, units_of_node = 1, units_of_direction = 4; // of work

// Each line is followed both ways.
enum { onward, back, both_ways };

// Radiances R are colours, or one number where all lights and smokes are grey: a third of the work, with the same bits.
// Where code is to be small, greys are swept as colours.
#ifdef __OPTIMIZE_SIZE__
constexpr bool sweeps_greys = false;
#else
constexpr bool sweeps_greys = true;
#endif
template <class R> constexpr int32_t channels_of = std::is_same_v<R, Color> ? 3 : 1;
template <class R> R radiance_of(const Color &color) {
    if constexpr (std::is_same_v<R, Color>)
        return color;
    else
        return color.x;
}
Real channel_of(const Color &color, int32_t channel) { return color[channel]; }
Real channel_of(Real grey, int32_t) { return grey; }
template <class R> struct LaneRadiance { Lanes channel[channels_of<R>]; };

// A step of a line in smoke.
template <class R> struct Sample {
    uint64_t node; // the lowest corner of its cell, in the field
    Vec3 at;       // 0 to 1 along each edge of the cell
    Real weight, transmittance, mean_transmittance;
    R source[both_ways];         // radiance that the step tends to, if it is deep
    Real towards_eye[both_ways]; // 4 pi p from each way
    R mean;                      // the sum over both ways of that times what flies along the line in the step
};

// Steps of a line that are computed side by side.
struct Group {
    uint32_t count;
    LanePoints points;
    Lanes middle, length; // along the line
};

// At a node: the sums of weights, and of weights times radiance, which become the mean radiance.
template <class R> struct Arrived {
    R radiance;
    Real weight;
};

template <class R> struct Sweeper : LineSweep {
    const SparseGrid &bricks;
    const LightOfPhotons &photons;
    const R *radiance;       // of photons at the nodes, sharpened
    R *scattered[both_ways]; // at the nodes: that along the lines, 4 pi p times
    Arrived<R> *arrived;
    Sample<R> *samples; // of one line
    Watch watch;
    Real gap = largest(bricks.cell) * Real(2 * spacing); // between neighbouring lines
    Real near = gap * Real(2);                           // to a light: the smoke that a line stands for is lit unevenly
    Real weight = Real(1);                               // of the axis that is followed
};

// A line's direction, and two more that span the plane across it.
struct Frame {
    Vec3 along, across, up;
};

// Lebedev's rule of degree 11 (1976) for integrals over the sphere, which is McLaren's (1963): axes, which are followed
// both ways, and weights relative to their mean.
constexpr int32_t axis_count = 25;
constexpr int8_t rule_axes[axis_count][3] = {
    {1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {0, 1, 1},  {0, 1, -1}, {1, 0, 1},  {-1, 0, 1}, {1, 1, 0},  {1, -1, 0},
    {1, 1, 1},  {-1, 1, 1}, {1, -1, 1}, {1, 1, -1}, {1, 1, 3},  {-1, 1, 3}, {1, -1, 3}, {1, 1, -3}, {1, 3, 1},
    {-1, 3, 1}, {1, -3, 1}, {1, 3, -1}, {3, 1, 1},  {-3, 1, 1}, {3, -1, 1}, {3, 1, -1}};
Real weight_of_axis(int32_t k) {
    return Real(50 * (k < 3 ? 4.0 / 315 : k < 9 ? 64.0 / 2835 : k < 13 ? 27.0 / 1280 : 14641.0 / 725760));
}

// Turns of the rule: rows at right angles to each other, of one length. None is the rule as it is, whose symmetry is
// that of a box.
constexpr struct {
    int32_t rows[3][3], length;
} turns[] = {{{{2, 3, 6}, {3, -6, 2}, {6, 2, -3}}, 7},
             {{{8, 4, 1}, {-4, 7, 4}, {1, -4, 8}}, 9},
             {{{9, 6, 2}, {-6, 7, 6}, {2, -6, 9}}, 11},
             {{{12, 4, 3}, {-3, 12, -4}, {-4, 3, 12}}, 13},
             {{{14, 5, 2}, {-5, 10, 10}, {2, -10, 11}}, 15}};
constexpr uint64_t turn_count = sizeof turns / sizeof *turns;

// A set of lines: along the axes of the rule, turned by turns[first_turn], turns[first_turn + 2], ...
struct LineSet {
    int32_t first_turn, count;
};

Frame axis_of_set(const LineSet &set, int32_t turn, int32_t k) {
    const auto &turned = turns[set.first_turn + 2 * turn];
    const int8_t(&axis)[3] = rule_axes[k];
    const auto dot_row = [&](int32_t i) {
        const int32_t(&row)[3] = turned.rows[i];
        return Real(row[0] * axis[0] + row[1] * axis[1] + row[2] * axis[2]);
    };
    Frame frame;
    frame.along = normalize(Vec3(dot_row(0), dot_row(1), dot_row(2)));
    make_frame(frame.along, frame.across, frame.up);
    return frame;
}

// 4 pi times the mean of the phase function towards `out` over the light of photons at a node.
Real scattered_towards(const LineSweep &sweep, const LightOfPhotons &light, uint64_t brick, uint32_t node,
                       const Vec3 &out, const SphericalHarmonics &seen) {
    const Vec3 flux = unpack_flux(light.flux[brick * nodes_of(sweep.spacing) + node]);
    const Cell cell = cell_of_index(nodes_along(sweep.spacing), node);
    const CellPosition at =
        find_cell(Vec3(Real(cell.x), Real(cell.y), Real(cell.z)) * Real(sweep.spacing), light.harmonic_spacing);
    const uint32_t *first = light.harmonics + brick * nodes_of(light.harmonic_spacing) * harmonic_words;
    const Real more = between_nodes(at, light.harmonic_spacing, [&](uint32_t there) {
        return packed_sum(seen, first + there * harmonic_words, 0, harmonic_count);
    });
    return phase_of_moments(sweep.phase, flux, more * Real(1.0 / max_component), out);
}

// Sets what photons say of the light that is scattered along an axis, both ways: the series of harmonics up to order 3,
// whose odd orders change sign with the way. Lines need no more: they themselves are weighted by the phase function.
// False: the work is stopped.
template <class R> bool scatter_along(const Sweeper<R> &in, const Vec3 &axis) {
    if (in.phase.isotropic()) return true;
    constexpr int32_t most = nodes_along(2);
    const LightOfPhotons &light = in.photons;
    const SphericalHarmonics seen = phase_harmonics(in.phase, axis);
    const Vec3 first_order = axis * (Real(3) * in.phase.asymmetry() * Real(1.0 / max_component));
    const uint32_t nodes = nodes_of(in.spacing), coarse = nodes_of(light.harmonic_spacing);
    Real even[most * most * most], odd[most * most * most];
    for (uint64_t brick = 0; brick < in.bricks.count; ++brick) {
        if (!in.watch.done(nodes * units_of_direction)) return false;
        const uint32_t *packed = light.harmonics + brick * coarse * harmonic_words;
        for (uint32_t k = 0; k < coarse; ++k) {
            const uint32_t *here = packed + k * harmonic_words;
            even[k] = packed_sum(seen, here, 0, 5) * Real(1.0 / max_component);
            odd[k] = packed_sum(seen, here, 5, harmonic_count) * Real(1.0 / max_component);
        }
        for (uint32_t k = 0; k < nodes; ++k) {
            const uint64_t node = brick * nodes + k;
            const Cell at = cell_of_index(nodes_along(in.spacing), k);
            const CellPosition p =
                find_cell(Vec3(Real(at.x), Real(at.y), Real(at.z)) * Real(in.spacing), light.harmonic_spacing);
            const uint32_t flux = light.flux[node];
            const Real same = Real(1) + between_nodes(p, light.harmonic_spacing, [&](uint32_t n) { return even[n]; });
            const Real other = first_order.x * Real(flux_units(flux, 0)) + first_order.y * Real(flux_units(flux, 1)) +
                               first_order.z * Real(flux_units(flux, 2)) +
                               between_nodes(p, light.harmonic_spacing, [&](uint32_t n) { return odd[n]; });
            const R radiance = in.radiance[node];
            in.scattered[onward][node] = radiance * max(Real(0), same + other);
            in.scattered[back][node] = radiance * max(Real(0), same - other);
        }
    }
    return true;
}

// Turns the light of photons to the eye. False: the work is stopped.
bool turn_to_eye(const LineSweep &sweep, const LightOfPhotons &light, Watch watch) {
    if (sweep.phase.isotropic()) return true;
    const SparseGrid &bricks = *sweep.depths->bricks;
    const uint32_t nodes = nodes_of(sweep.spacing);
    for (uint32_t brick = 0; brick < bricks.count; ++brick) {
        if (!watch.go_on(nodes * units_of_direction)) return false;
        for (uint32_t k = 0; k < nodes; ++k) {
            const Cell at = cell_of_index(nodes_along(sweep.spacing), k);
            const Cell node = {at.x * sweep.spacing, at.y * sweep.spacing, at.z * sweep.spacing};
            const Vec3 out = direction_between(node_of(bricks, brick, node), sweep.eye);
            Color &radiance = light.radiance[uint64_t{brick} * nodes + k];
            radiance = radiance * scattered_towards(sweep, light, brick, k, out, phase_harmonics(sweep.phase, out));
        }
    }
    return true;
}

// What a light sends to each step, without smoke in between: the mean along the step. Next to a light also the mean
// across the smoke that a line stands for, a square as wide as lines are apart: one line in many meets the light.
template <class R>
WISP_INLINE void illuminate_steps(const Sweeper<R> &in, const Light &light, const Ray &ray, const Group &group,
                                  LaneRadiance<R> &irradiance) {
    constexpr int32_t most_across = 4;
    Frame line = {ray.direction, {}, {}};
    make_frame(line.along, line.across, line.up);
    for (uint32_t l = 0; l < lanes; ++l) {
        const Real middle = group.middle[l], half = group.length[l] * Real(0.5);
        const bool is_near =
            has_falloff(light.kind) && length(ray.origin + line.along * middle - light.position) < in.near;
        const int32_t across = is_near ? most_across : 1;
        const Real part = is_near ? Real(1.0 / most_across) : Real(1), width = in.gap * part;
        Color mean(Real(0));
        for (int32_t i = 0; i < across * across; ++i) {
            const Vec3 from = ray.origin + line.across * (width * (Real(i % across) - Real(across - 1) * Real(0.5))) +
                              line.up * (width * (Real(i / across) - Real(across - 1) * Real(0.5)));
            const auto at = [&](Real t) { return from + line.along * t; };
            mean += illuminate(light, at(middle), at(middle - half), at(middle + half)).irradiance * (part * part);
        }
        for (int32_t c = 0; c < channels_of<R>; ++c) irradiance.channel[c][l] = mean[c];
    }
}

// The same of a point light. Where it is 16 steps and two distances of lines away, its inverse square distance from
// the middle is taken for the mean; the relative error is below 1e-3.
template <class R>
WISP_INLINE void illuminate_from_point(const Sweeper<R> &in, const Light &light, const Ray &ray, const Group &group,
                                       LaneRadiance<R> &irradiance) {
    const Vec3 from = ray.origin - light.position;
    bool is_near = false;
    for (uint32_t l = 0; l < lanes; ++l) {
        const Real x = from.x + ray.direction.x * group.middle[l], y = from.y + ray.direction.y * group.middle[l],
                   z = from.z + ray.direction.z * group.middle[l];
        const Real distance = sqrt(x * x + y * y + z * z), far = max(Real(16) * group.length[l], in.near);
        const Real inverse = Real(1) / max(max(distance, far), Real(least_light_distance));
        is_near |= distance < far;
        for (int32_t c = 0; c < channels_of<R>; ++c) irradiance.channel[c][l] = light.color[c] * inverse * inverse;
    }
    if (is_near) illuminate_steps(in, light, ray, group, irradiance);
}

// The phase function from a light to each way of a line, in each step, or 1 / (4 pi).
WISP_INLINE void find_phases(const LineSweep &in, const Light &light, const Ray &ray, const Group &group,
                             Lanes (&p)[both_ways]) {
    for (uint32_t l = 0; l < lanes; ++l) {
        p[onward][l] = p[back][l] = inv_four_pi<Real>;
        if (in.phase.isotropic()) continue;
        const Vec3 there = ray.origin + ray.direction * group.middle[l];
        const Vec3 from =
            light.kind == LightKind::parallel ? light.direction : direction_between(light.position, there);
        p[onward][l] = in.phase(from, ray.direction);
        p[back][l] = in.phase(from, -ray.direction);
    }
}

// Makes samples of the steps of a group that lie in smoke. Returns their number.
template <class R>
WISP_INLINE uint32_t make_samples(const Sweeper<R> &in, const Ray &ray, const Group &group, Sample<R> *samples) {
    constexpr int32_t channels = channels_of<R>;
    const int32_t ways = in.phase.isotropic() ? 1 : both_ways; // that differ
    LaneCells at;
    find_cells(group.points, 1, 1, at);
    Lanes depth = {}, scaled = {};
    LaneRadiance<R> scattered = {}, emitted = {}, arriving[both_ways] = {}, irradiance;
    for (uint32_t s = 0; s < in.medium->count; ++s) {
        const SmokeVolume &smoke = in.medium->smokes[s];
        if (!smoke.field.is_resampled) continue;
        const Color glow = (Color(Real(1)) - smoke.albedo) * smoke.emission;
        Lanes sigma, weight;
        interpolate(at, smoke.field.resampled.extinction, sigma);
        for (uint32_t l = 0; l < lanes; ++l) {
            weight[l] = scale_pow2(sigma[l], in.sigma_shift);
            depth[l] += sigma[l] * group.length[l];
            scaled[l] += weight[l];
        }
        for (int32_t c = 0; c < channels; ++c)
            for (uint32_t l = 0; l < lanes; ++l) {
                scattered.channel[c][l] += weight[l] * smoke.albedo[c];
                emitted.channel[c][l] += weight[l] * glow[c];
            }
    }
    const OpticalDepthGrid &depths = *in.depths;
    find_cells(group.points, depths.spacing, static_cast<int32_t>(depths.light_count), at);
    for (uint32_t light = 0; light < depths.light_count; ++light) {
        Lanes tau;
        interpolate(at, depths.depth, tau);
        if (depths.lights[light].kind == LightKind::point)
            illuminate_from_point(in, depths.lights[light], ray, group, irradiance);
        else
            illuminate_steps(in, depths.lights[light], ray, group, irradiance);
        Lanes p[both_ways];
        find_phases(in, depths.lights[light], ray, group, p);
        for (uint32_t l = 0; l < lanes; ++l) tau[l] = exp(-max(tau[l], Real(0)));
        for (int32_t way = 0; way < ways; ++way)
            for (uint32_t l = 0; l < lanes; ++l) {
                const Real part = tau[l] * p[way][l];
                for (int32_t c = 0; c < channels; ++c) arriving[way].channel[c][l] += irradiance.channel[c][l] * part;
            }
        for (uint32_t l = 0; l < lanes; ++l) at.node[l] += static_cast<int32_t>(nodes_of(depths.spacing));
    }
    find_cells(group.points, in.spacing, 1, at);
    LaneRadiance<R> source[both_ways];
    for (int32_t way = 0; way < ways; ++way)
        for (int32_t c = 0; c < channels; ++c) {
            const R *light = in.scattered[way];
            Lanes here;
            interpolate(
                at, [light, c](int32_t node) { return channel_of(light[node], c); }, here);
            for (uint32_t l = 0; l < lanes; ++l) {
                const Real weight = scaled[l] > Real(0) ? scaled[l] : Real(1);
                const Real arrives = arriving[way].channel[c][l] + here[l];
                source[way].channel[c][l] = (scattered.channel[c][l] * arrives + emitted.channel[c][l]) / weight;
            }
        }
    Lanes transmittance, mean;
    for (uint32_t l = 0; l < lanes; ++l) transmittance[l] = exp(-depth[l]);
    for (uint32_t l = 0; l < lanes; ++l) mean[l] = mean_transmittance_of(depth[l], transmittance[l]);
    uint32_t count = 0;
    for (uint32_t l = 0; l < group.count; ++l) {
        if (!(scaled[l] > Real(0))) continue;
        Sample<R> &sample = samples[count++];
        sample.node = static_cast<uint64_t>(at.node[l]);
        sample.at = Vec3(at.x[l], at.y[l], at.z[l]);
        sample.weight = scaled[l] * group.length[l] * in.weight;
        sample.transmittance = transmittance[l];
        sample.mean_transmittance = mean[l];
        sample.mean = R(Real(0));
        const Vec3 out = direction_between(ray.origin + ray.direction * group.middle[l], in.eye);
        for (int32_t way = 0; way < both_ways; ++way) {
            const LaneRadiance<R> &of_way = source[way < ways ? way : 0];
            if constexpr (channels == 3)
                sample.source[way] = Color(of_way.channel[0][l], of_way.channel[1][l], of_way.channel[2][l]);
            else
                sample.source[way] = of_way.channel[0][l];
            sample.towards_eye[way] =
                ways == 1 ? Real(1) : four_pi<Real> * in.phase(way == onward ? ray.direction : -ray.direction, out);
        }
    }
    return count;
}

WISP_MULTIVERSIONED uint32_t sample_group(const Sweeper<Color> &in, const Ray &ray, const Group &group,
                                          Sample<Color> *samples) {
    return make_samples(in, ray, group, samples);
}
WISP_MULTIVERSIONED uint32_t sample_group(const Sweeper<Real> &in, const Ray &ray, const Group &group,
                                          Sample<Real> *samples) {
    return make_samples(in, ray, group, samples);
}

// Passes a sample one way, and adds to it what flies through: of a source that is even in it, the mean of
// S + (L - S) e^-s over the step.
template <class R> void pass(Sample<R> &sample, int32_t way, R &radiance) {
    const R above = radiance - sample.source[way];
    sample.mean += (sample.source[way] + above * sample.mean_transmittance) * sample.towards_eye[way];
    radiance = sample.source[way] + above * sample.transmittance;
}

template <class R> void deposit(const Sweeper<R> &in, const Sample<R> &sample) {
    const int32_t n = nodes_along(in.spacing);
    const Vec3 &t = sample.at;
    const Real both = Real(0.5) * (sample.towards_eye[onward] + sample.towards_eye[back]);
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const Real weight = sample.weight * (corner & 1 ? t.x : Real(1) - t.x) * (corner & 2 ? t.y : Real(1) - t.y) *
                            (corner & 4 ? t.z : Real(1) - t.z);
        const uint64_t node = sample.node + offset_of_corner(corner, n);
        in.arrived[node].radiance += sample.mean * weight;
        in.arrived[node].weight += weight * both;
    }
}

// Steps of a line in a brick, before they are divided: the way is at most sqrt(3) brick_cells of the longest edge.
constexpr int32_t most_steps(int32_t spacing) { return 14 / spacing + 2; }
// The number of parts of the steps in a brick: so many that none is deeper than 1/4, but at most 4. The source of light
// counts as even within a part.
constexpr int32_t most_parts = 4;
int32_t parts_in_brick(const LineSweep &in, uint32_t brick, Real longest) {
    const Real sigma =
        sum_of_resampled(*in.medium, [brick](const ResampledField &field) { return field.majorants[brick]; });
    return min(floor_to_int(min(sigma * longest * Real(4), Real(most_parts))) + 1, most_parts);
}

// Asks for the memory of so many values: it is read soon. A third of a sweep's time would be waiting for it.
template <class T> void prefetch(const T *first, uint64_t count) {
#if defined(__GNUC__) && !defined(__OPTIMIZE_SIZE__)
    constexpr uint64_t line_of_cache = 64;
    const char *begin = reinterpret_cast<const char *>(first);
    for (uint64_t i = 0; i < count * sizeof(T); i += line_of_cache) __builtin_prefetch(begin + i, 0, 2);
#else
    static_cast<void>(first), static_cast<void>(count);
#endif
}

// Asks for all that samples in a brick read and write.
template <class R> void prefetch_brick(const Sweeper<R> &in, uint32_t brick) {
    for (uint32_t s = 0; s < in.medium->count; ++s) {
        const DensityField &field = in.medium->smokes[s].field;
        if (field.is_resampled) prefetch(field.resampled.nodes(brick), nodes_of(1));
    }
    prefetch(depths_of_brick(*in.depths, brick), uint64_t{in.depths->light_count} * nodes_of(in.depths->spacing));
    const uint64_t nodes = nodes_of(in.spacing), first = brick * nodes;
    for (int32_t way = 0; way < (in.phase.isotropic() ? 1 : both_ways); ++way)
        prefetch(in.scattered[way] + first, nodes);
    prefetch(in.arrived + first, nodes);
}

// Makes samples of a line: of each brick in equal steps, at most `spacing` cells long. Returns their number.
template <class R> uint32_t sample_line(const Sweeper<R> &in, const Ray &ray, Real begin, Real end) {
    const Vec3 step = ray.direction * in.bricks.inverse_cell;
    const Real longest = largest(in.bricks.cell) * Real(in.spacing);
    Group group;
    uint32_t count = 0;
    group.count = 0;
    const auto finish = [&] {
        for (uint32_t l = group.count; l < lanes; ++l) { // these are computed in vain
            group.points.brick[l] = group.points.brick[0];
            group.points.x[l] = group.points.x[0], group.points.y[l] = group.points.y[0];
            group.points.z[l] = group.points.z[0];
            group.middle[l] = group.middle[0], group.length[l] = group.length[0];
        }
        count += sample_group(in, ray, group, in.samples + count);
        group.count = 0;
    };
    for_each_brick(in.bricks, ray, begin, end, [&](uint32_t brick, Real from, Real to) {
        if (!(from < to)) return true;
        prefetch_brick(in, brick);
        const Vec3 start = position_in(in.bricks, brick, ray.origin);
        const int32_t steps =
            min(floor_to_int((to - from) / longest) + 1, most_steps(in.spacing)) * parts_in_brick(in, brick, longest);
        const Real length = (to - from) / Real(steps);
        for (int32_t i = 0; i < steps; ++i) {
            const uint32_t l = group.count++;
            const Real middle = from + (Real(i) + Real(0.5)) * length;
            const Vec3 p = max(start + step * middle, Vec3(Real(0)));
            group.points.brick[l] = static_cast<int32_t>(brick);
            group.points.x[l] = p.x, group.points.y[l] = p.y, group.points.z[l] = p.z;
            group.middle[l] = middle, group.length[l] = length;
            if (group.count == lanes) finish();
        }
        return true;
    });
    if (group.count > 0) finish();
    return count;
}

// One line, both ways. False: the work is stopped.
template <class R> bool follow(const Sweeper<R> &in, const Ray &ray) {
    Real begin = Real(0), end = infinite_distance;
    if (!clip(in.bricks.bounds, ray, begin, end)) return true;
    const uint32_t count = sample_line(in, ray, begin, end);
    R radiance(Real(0));
    for (uint32_t i = 0; i < count; ++i) pass(in.samples[i], onward, radiance);
    radiance = R(Real(0));
    for (uint32_t i = count; i-- > 0;) {
        pass(in.samples[i], back, radiance);
        deposit(in, in.samples[i]);
    }
    return in.watch.done((count + 1) * units_of_sample);
}

// Lines along one axis, from a place that differs from axis to axis and from seed to seed.
template <class R> bool sweep_axis(const Sweeper<R> &in, const Frame &frame, Pcg32 &generator) {
    const Box &box = in.bricks.bounds;
    const Vec3 middle = (box.low + box.high) * Real(0.5), half = (box.high - box.low) * Real(0.5);
    const auto reach = [&half](const Vec3 &d) { return abs(d.x) * half.x + abs(d.y) * half.y + abs(d.z) * half.z; };
    const Real wide = reach(frame.across), high = reach(frame.up);
    const Real x0 = -wide + in.gap * unit_open<Real>(generator());
    const Real y0 = -high + in.gap * unit_open<Real>(generator());
    const Vec3 back = middle - frame.along * reach(frame.along);
    // Tiles of lines as wide as a brick: what one line reads is near for the next.
    const int32_t tile = max(brick_cells / (2 * in.spacing), 1);
    const int32_t columns = floor_to_int((wide - x0) / in.gap) + 1, rows = floor_to_int((high - y0) / in.gap) + 1;
    for (int32_t column = 0; column < columns; column += tile)
        for (int32_t row = 0; row < rows; row += tile)
            for (int32_t i = column; i < min(column + tile, columns); ++i)
                for (int32_t j = row; j < min(row + tile, rows); ++j) {
                    const Vec3 from =
                        back + frame.across * (x0 + Real(i) * in.gap) + frame.up * (y0 + Real(j) * in.gap);
                    if (!follow(in, {from, frame.along})) return false;
                }
    return true;
}

// Adds the sums of all bricks that hold a node. False: the work is stopped.
template <class R> bool add_over_holders(const SparseGrid &bricks, int32_t spacing, Arrived<R> *sums, Watch watch) {
    const int32_t n = nodes_along(spacing);
    const uint32_t nodes = nodes_of(spacing);
    for (uint64_t brick = 0; brick < bricks.count; ++brick) {
        if (!watch.go_on(nodes * units_of_node)) return false;
        for (uint32_t k = 0; k < nodes; ++k) {
            const Cell node = cell_of_index(n, k);
            if (min(node.x, min(node.y, node.z)) > 0 && max(node.x, max(node.y, node.z)) < n - 1) continue;
            Arrived<R> sum = {R(Real(0)), Real(0)};
            bool first = true; // of the holders
            for_each_holder(bricks, bricks.position[brick], node, n, [&](uint32_t other, uint32_t there) {
                first = first && other >= brick;
                const Arrived<R> &here = sums[uint64_t{other} * nodes + there];
                sum = {sum.radiance + here.radiance, sum.weight + here.weight};
            });
            if (!first) continue;
            for_each_holder(bricks, bricks.position[brick], node, n,
                            [&](uint32_t other, uint32_t there) { sums[uint64_t{other} * nodes + there] = sum; });
        }
    }
    return true;
}

// Makes means of the sums: the same at a node in every brick that holds it. False: the work is stopped.
template <class R> bool average(const Sweeper<R> &in) {
    if (!add_over_holders(in.bricks, in.spacing, in.arrived, in.watch)) return false;
    const uint64_t nodes = nodes_of(in.spacing);
    // Each sample holds what flies along its line both ways.
    for (Arrived<R> *i = in.arrived; i < in.arrived + uint64_t{in.bricks.count} * nodes; ++i)
        if (i->weight > Real(0)) i->radiance = i->radiance / (i->weight * Real(2));
    return true;
}

template <class R> bool sweep_set(Sweeper<R> in, const LineSet &set) {
    const uint64_t count = uint64_t{in.bricks.count} * nodes_of(in.spacing);
    if (!fill(in.arrived, count, Arrived<R>{R(Real(0)), Real(0)}, in.watch)) return false;
    // No set of any seed has the numbers of another.
    Pcg32 generator((in.seed - 1) * turn_count + static_cast<uint64_t>(set.first_turn));
    for (int32_t turn = 0; turn < set.count; ++turn)
        for (int32_t k = 0; k < axis_count; ++k) {
            const Frame frame = axis_of_set(set, turn, k);
            in.weight = weight_of_axis(k);
            if (!scatter_along(in, frame.along) || !sweep_axis(in, frame, generator)) return false;
        }
    return average(in);
}

// What the nodes of a brick say of both ways.
struct Disagreement {
    Real of_sets; // the sum of |A - B| / 2: what the mean of two sets errs by
    Real of_ways; // the sum of |photons - mean of the sets|
};

// The share of the photons around a node of the lattice of bricks: V / (V + P), where the sets have the variance V and
// the photons P; what both ways differ by has the variance V + P.
Real share_of_photons(const SparseGrid &bricks, const Disagreement *disagreement, const Cell &position,
                      const Cell &corner) {
    Real of_sets = Real(0), of_ways = Real(0);
    for_each_holder(bricks, position, corner, 2, [&](uint32_t brick, uint32_t) {
        of_sets += disagreement[brick].of_sets;
        of_ways += disagreement[brick].of_ways;
    });
    if (!(of_sets < of_ways)) return Real(1);
    const Real share = of_sets / of_ways;
    return share * share;
}

// Both ways of finding the light at the nodes.
template <class R> struct Ways {
    const bool *known;
    Color *photons;             // replaced by what both say
    Arrived<R> *first, *second; // of the sets of lines

    bool both(uint64_t i) const { return known[i] && first[i].weight > Real(0) && second[i].weight > Real(0); }
    R of_lines(uint64_t i) const { return (first[i].radiance + second[i].radiance) * Real(0.5); }
};

// The light of a brick's nodes, each by the weight of what lines left there.
struct BrickLight {
    Real photons, lines;
};
template <class R> BrickLight light_in(const Ways<R> &ways, uint64_t begin, uint64_t end) {
    BrickLight sum = {Real(0), Real(0)};
    for (uint64_t i = begin; i < end; ++i) {
        if (!ways.both(i)) continue;
        const Real weight = ways.first[i].weight + ways.second[i].weight;
        const R lines = ways.of_lines(i);
        for (int32_t c = 0; c < channels_of<R>; ++c) {
            sum.photons += weight * channel_of(ways.photons[i], c);
            sum.lines += weight * channel_of(lines, c);
        }
    }
    return sum;
}

// What the light of lines is multiplied by, so that there is as much of it as photons say. Few directions miss much of
// it where most flies within a thin layer. Let e be the photons' excess in a brick, relative to all light of lines.
// The variance of the whole excess E = sum e is between N = sum e^2 and about 16 N, as the collisions of a path lie in
// several bricks. Of E counts E (1 - 16 N / E^2), or nothing where that has the other sign: what may be noise is left
// out (James, Stein 1961).
template <class R> Real level_of_lines(const Ways<R> &ways, uint32_t bricks, uint32_t nodes) {
    const auto light_of = [&](uint32_t brick) {
        return light_in(ways, uint64_t{brick} * nodes, (uint64_t{brick} + 1) * nodes);
    };
    const Real per_brick = Real(1) / Real(static_cast<int32_t>(bricks)); // means stay small in fixed point
    Real photons = Real(0), lines = Real(0), squares = Real(0);
    for (uint32_t brick = 0; brick < bricks; ++brick) {
        const BrickLight light = light_of(brick);
        photons += light.photons * per_brick;
        lines += light.lines * per_brick;
    }
    if (!(photons > Real(0) && lines > Real(0))) return Real(1);
    for (uint32_t brick = 0; brick < bricks; ++brick) {
        const BrickLight light = light_of(brick);
        const Real e = (light.photons - light.lines) / lines;
        squares += e * e * per_brick;
    }
    const Real excess = (photons - lines) / lines, noise = Real(16) * squares * per_brick;
    return excess * excess > noise ? Real(1) + excess - noise / excess : Real(1);
}
template <class R> void level_lines(const Ways<R> &ways, uint32_t bricks, uint32_t nodes) {
    const Real level = level_of_lines(ways, bricks, nodes);
    for (uint64_t i = 0; i < uint64_t{bricks} * nodes; ++i) {
        ways.first[i].radiance = ways.first[i].radiance * level;
        if (ways.second != ways.first) ways.second[i].radiance = ways.second[i].radiance * level;
    }
}

template <class R> Disagreement disagreement_in(const Ways<R> &ways, uint64_t begin, uint64_t end) {
    Disagreement sum = {Real(0), Real(0)};
    for (uint64_t i = begin; i < end; ++i) {
        if (!ways.both(i)) continue;
        const R lines = ways.of_lines(i);
        for (int32_t c = 0; c < 3; ++c) {
            sum.of_sets += abs(channel_of(ways.first[i].radiance, c) - channel_of(lines, c));
            sum.of_ways += abs(ways.photons[i][c] - channel_of(lines, c));
        }
    }
    return sum;
}

// Mixes both ways at the nodes of a brick.
template <class R>
void mix_ways(const LineSweep &sweep, const Ways<R> &ways, const Disagreement *disagreement, uint32_t brick) {
    const SparseGrid &bricks = *sweep.depths->bricks;
    Real share[8];
    for (int32_t corner = 0; corner < 8; ++corner)
        share[corner] =
            share_of_photons(bricks, disagreement, bricks.position[brick], {corner & 1, corner >> 1 & 1, corner >> 2});
    for (uint32_t k = 0; k < nodes_of(sweep.spacing); ++k) {
        const uint64_t i = uint64_t{brick} * nodes_of(sweep.spacing) + k;
        if (!ways.both(i)) continue;
        const Cell node = cell_of_index(nodes_along(sweep.spacing), k);
        const Vec3 t = Vec3(Real(node.x), Real(node.y), Real(node.z)) * (Real(sweep.spacing) * Real(1.0 / brick_cells));
        Real photons = Real(0); // products that are 0 on a face: every brick that holds the node finds the same
        for (uint32_t corner = 0; corner < 8; ++corner) photons += share[corner] * corner_weight(t, corner);
        const R lines = ways.of_lines(i);
        ways.photons[i] = Color(lines + (radiance_of<R>(ways.photons[i]) - lines) * photons);
    }
}

// A line crosses a brick once at most, on a way of at most sqrt(3) brick_cells.
uint64_t samples_of_line(uint64_t bricks, int32_t spacing) {
    return bricks * static_cast<uint64_t>(most_parts * most_steps(spacing));
}

// The mean of sigma_t over the corners of one of the finest cells.
Real mean_extinction(const Medium &medium, uint32_t brick, const Cell &cell) {
    Real sum = Real(0);
    for (uint32_t s = 0; s < medium.count; ++s) {
        if (!medium.smokes[s].field.is_resampled) continue;
        const Real *nodes = medium.smokes[s].field.resampled.nodes(brick);
        constexpr int32_t n = nodes_along(1);
        for (uint32_t corner = 0; corner < 8; ++corner)
            sum += nodes[static_cast<uint32_t>((cell.z * n + cell.y) * n + cell.x) + offset_of_corner(corner, n)];
    }
    return sum * Real(1.0 / 8);
}

// Along an edge of a node's cell, from its places a to b of 0 to 1: the integrals of (1 - t)^2, t (1 - t) and t^2, and
// of 1 - t and t.
struct TentIntegrals {
    Real low_low, low_high, high_high, low, high;

    TentIntegrals() = default;
    TentIntegrals(Real a, Real b) {
        const Real first = b - a, second = (b * b - a * a) * Real(0.5), third = (b * b * b - a * a * a) * Real(1.0 / 3);
        low_low = first - Real(2) * second + third;
        low_high = second - third;
        high_high = third;
        low = first - second;
        high = second;
    }
};

// Sets the integrals over each of the finest cells of a brick, along each axis. They end where the smoke does, which
// may have a hard face there.
void find_integrals(const SparseGrid &bricks, uint32_t brick, int32_t spacing, TentIntegrals (&along)[3][brick_cells]) {
    const Vec3 low = position_in(bricks, brick, bricks.bounds.low),
               high = position_in(bricks, brick, bricks.bounds.high);
    const Real inverse = Real(1) / Real(spacing);
    for (int axis = 0; axis < 3; ++axis)
        for (int32_t cell = 0; cell < brick_cells; ++cell) {
            const auto place = [&](Real t) {
                return (min(max(t, Real(cell)), Real(cell + 1)) - Real(cell - cell % spacing)) * inverse;
            };
            along[axis][cell] = TentIntegrals(place(low[axis]), place(high[axis]));
        }
}

// Takes away the blur of the tents: nodes hold D_n = sum_m M_nm R_m / sum_m M_nm of the light R that is sought, where
// M_nm is the integral of sigma_t t_n t_m. One step of Van Cittert (1931): R = D + (D - M D / sum M). Sigma_t is the
// mean of its nodes in each of the finest cells. `blurred` is room for as many nodes. False: the work is stopped.
template <class R> bool sharpen(const LineSweep &sweep, const bool *known, R *light, Arrived<R> *blurred, Watch watch) {
    const SparseGrid &bricks = *sweep.depths->bricks;
    const int32_t n = nodes_along(sweep.spacing);
    const uint32_t nodes = nodes_of(sweep.spacing);
    TentIntegrals integrals[3][brick_cells];
    if (!fill(blurred, uint64_t{bricks.count} * nodes, Arrived<R>{R(Real(0)), Real(0)}, watch)) return false;
    for (uint32_t brick = 0; brick < bricks.count; ++brick) {
        if (!watch.go_on(nodes_of(1) * units_of_node)) return false;
        const R *from = light + uint64_t{brick} * nodes;
        Arrived<R> *to = blurred + uint64_t{brick} * nodes;
        find_integrals(bricks, brick, sweep.spacing, integrals);
        for (uint32_t k = 0; k < brick_cells * brick_cells * brick_cells; ++k) {
            const Cell cell = cell_of_index(brick_cells, k);
            const Real sigma = mean_extinction(*sweep.medium, brick, cell);
            if (!(sigma > Real(0))) continue;
            const Real weight = scale_pow2(sigma, sweep.sigma_shift);
            const Cell lowest = {cell.x / sweep.spacing, cell.y / sweep.spacing, cell.z / sweep.spacing};
            const TentIntegrals along[3] = {integrals[0][cell.x], integrals[1][cell.y], integrals[2][cell.z]};
            const uint32_t first = static_cast<uint32_t>((lowest.z * n + lowest.y) * n + lowest.x);
            R corners[8];
            for (uint32_t i = 0; i < 8; ++i) corners[i] = from[first + offset_of_corner(i, n)];
            for (uint32_t axis = 0; axis < 3; ++axis)
                for (uint32_t i = 0; i < 8; ++i) {
                    if (i >> axis & 1) continue;
                    const R low = corners[i], high = corners[i | 1u << axis];
                    corners[i] = low * along[axis].low_low + high * along[axis].low_high;
                    corners[i | 1u << axis] = low * along[axis].low_high + high * along[axis].high_high;
                }
            for (uint32_t i = 0; i < 8; ++i) {
                Arrived<R> &node = to[first + offset_of_corner(i, n)];
                node.radiance += corners[i] * weight;
                node.weight += weight * (i & 1 ? along[0].high : along[0].low) *
                               (i & 2 ? along[1].high : along[1].low) * (i & 4 ? along[2].high : along[2].low);
            }
        }
    }
    if (!add_over_holders(bricks, sweep.spacing, blurred, watch)) return false;
    for (uint64_t i = 0; i < uint64_t{bricks.count} * nodes; ++i)
        if (known[i] && blurred[i].weight > Real(0))
            light[i] = max(light[i] + (light[i] - blurred[i].radiance / blurred[i].weight), R(Real(0)));
    return true;
}

bool is_grey(const Color &color) { return color.x == color.y && color.y == color.z; }
bool is_grey(const LineSweep &sweep, const LightOfPhotons &light) {
    for (uint32_t l = 0; l < sweep.depths->light_count; ++l)
        if (!is_grey(sweep.depths->lights[l].color)) return false;
    for (uint32_t s = 0; s < sweep.medium->count; ++s) {
        const SmokeVolume &smoke = sweep.medium->smokes[s];
        if (!is_grey(smoke.albedo) || !is_grey(smoke.emission)) return false;
    }
    const uint64_t points = uint64_t{sweep.depths->bricks->count} * nodes_of(sweep.spacing);
    return std::all_of(light.radiance, light.radiance + points, [](const Color &color) { return is_grey(color); });
}

// Replaces the light of photons by what they and both sets say. False: the work is stopped.
template <class R> bool mix_sets(const LineSweep &sweep, const Ways<R> &ways, Disagreement *disagreement, Watch watch) {
    const uint32_t bricks = sweep.depths->bricks->count, nodes = nodes_of(sweep.spacing);
    for (uint32_t brick = 0; brick < bricks; ++brick) {
        disagreement[brick] = disagreement_in(ways, uint64_t{brick} * nodes, (uint64_t{brick} + 1) * nodes);
        if (!watch.go_on(nodes * units_of_node)) return false;
    }
    for (uint32_t brick = 0; brick < bricks; ++brick) {
        mix_ways(sweep, ways, disagreement, brick);
        if (!watch.go_on(nodes * units_of_node)) return false;
    }
    return true;
}

template <class R> bool sweep_all(const LineSweep &sweep, const LightOfPhotons &light, Arena &arena, Watch watch) {
    const SparseGrid &bricks = *sweep.depths->bricks;
    const uint32_t nodes = nodes_of(sweep.spacing);
    const uint64_t points = uint64_t{bricks.count} * nodes;
    Arrived<R> *first = arena.make<Arrived<R>>(points), *second = arena.make<Arrived<R>>(points);
    Disagreement *disagreement = arena.make<Disagreement>(bricks.count);
    Sample<R> *samples = arena.make<Sample<R>>(
        samples_of_line(min(uint64_t{bricks.count}, places_of_line(bricks.lattice.count)), sweep.spacing));
    const bool isotropic = sweep.phase.isotropic();
    R *sharp = arena.make<R>(points), *onward_light = isotropic ? sharp : arena.make<R>(points),
      *back_light = isotropic ? sharp : arena.make<R>(points);
    if (!first || !second || !disagreement || !samples || !sharp || !onward_light || !back_light) return false;
    const auto sweep_lines_of = [&](const LineSet &set, Arrived<R> *arrived) {
        const uint64_t axes = static_cast<uint64_t>(axis_count * set.count);
        watch.expect(points * units_of_sample * axes + (isotropic ? 0 : 2 * points * units_of_direction * axes));
        return sweep_set<R>({sweep, bricks, light, sharp, {onward_light, back_light}, arrived, samples, watch}, set);
    };
    const auto sharpen_light = [&] {
        for (uint64_t i = 0; i < points; ++i) sharp[i] = radiance_of<R>(light.radiance[i]);
        return sharpen(sweep, light.known, sharp, first, watch);
    };
    if (!sharpen_light()) return false;
    if (isotropic) { // a gather before the last, so that this gathers what has hardly any noise
        if (!sweep_lines_of({4, 1}, first)) return false;
        level_lines(Ways<R>{light.known, light.radiance, first, first}, bricks.count, nodes);
        for (uint64_t i = 0; i < points; ++i)
            sharp[i] =
                light.known[i] && first[i].weight > Real(0) ? first[i].radiance : radiance_of<R>(light.radiance[i]);
        if (!sharpen(sweep, light.known, sharp, first, watch)) return false;
    }
    if (!sweep_lines_of({0, sweep.turns}, first) || !sweep_lines_of({1, sweep.turns}, second)) return false;
    if (!turn_to_eye(sweep, light, watch)) return false;
    const Ways<R> ways = {light.known, light.radiance, first, second};
    // The photons of other phases do not know all that is scattered towards the eye.
    if (isotropic) level_lines(ways, bricks.count, nodes);
    if (!mix_sets(sweep, ways, disagreement, watch)) return false;
    if (!sharpen_light()) return false;
    for (uint64_t i = 0; i < points; ++i) light.radiance[i] = Color(sharp[i]);
    return true;
}

} // namespace

bool suits_lines(uint64_t places, uint64_t bricks) { return places <= places_of_brick * bricks; }

uint64_t line_sweep_bytes(uint64_t bricks, uint64_t of_line, int32_t spacing, bool isotropic) {
    const uint64_t points = bricks * nodes_of(spacing);
    return (isotropic ? 1 : 3) * Arena::bytes<Color>(points) + 2 * Arena::bytes<Arrived<Color>>(points) +
           Arena::bytes<Disagreement>(bricks) + Arena::bytes<Sample<Color>>(samples_of_line(of_line, spacing));
}

bool sweep_lines(const LineSweep &sweep, const LightOfPhotons &light, Arena &arena, Watch watch) {
    const size_t mark = arena.mark();
    const bool done = sweeps_greys && is_grey(sweep, light) ? sweep_all<Real>(sweep, light, arena, watch)
                                                            : sweep_all<Color>(sweep, light, arena, watch);
    arena.rewind(mark);
    return done;
}

} // namespace wisp::WISP_ARITH
