// Photons from the first collisions of light in resampled smoke, and their fluence (S2, S4-3).
#include "core/photons/fluence_grid.h"
#include "wisp/photon_sums.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr int32_t weight_bits = 30; // of a node's weight: 2^30 for the brightest node
constexpr int32_t brick_nodes = nodes_along(1), cells_of_brick = brick_cells * brick_cells * brick_cells;
constexpr uint32_t asked_after = 1 << 12;                          // tentative collisions of a flight
constexpr uint32_t units_of_source_brick = 128, units_of_tent = 2; // of work
// The least number of tentative collisions along a brick's edge: they sample the fluence in thin smoke too.
constexpr Real min_collisions_per_brick = Real(0.5);

// The sum of density(field) over the smokes.
template <class Density> Real sum_of_smokes(const Medium &medium, Density &&density) {
    Real sum = Real(0);
    for (uint32_t i = 0; i < medium.count; ++i)
        if (medium.smokes[i].field.is_resampled) sum += density(medium.smokes[i].field.resampled);
    return sum;
}

// The power that smoke emits per unit of volume and sigma_t.
Color emission_of(const SmokeVolume &smoke) { return (Color(Real(1)) - smoke.albedo) * smoke.emission * four_pi<Real>; }

// The fraction of the tent around x, of half-width `cell`, that lies between low and high.
Real tent_fraction(Real x, Real cell, Real low, Real high) {
    const auto below = [](Real t) { // the integral of the tent 1 - |t| up to t
        if (t < Real(0)) {
            const Real u = max(Real(0), t + Real(1));
            return Real(0.5) * u * u;
        }
        const Real u = max(Real(0), Real(1) - t);
        return Real(1) - Real(0.5) * u * u;
    };
    return below((high - x) / cell) - below((low - x) / cell);
}
Real tent_volume(const Box &box, const Vec3 &node, const Vec3 &cell) {
    return tent_fraction(node.x, cell.x, box.low.x, box.high.x) * tent_fraction(node.y, cell.y, box.low.y, box.high.y) *
           tent_fraction(node.z, cell.z, box.low.z, box.high.z);
}

// Whether some point of a ball meets the cone of a spot. `offset`: from the light to the middle of the ball.
bool meets_cone(const Light &spot, const Vec3 &offset, Real radius) {
    const Real cosine = Real(1) - spot.one_minus_cosine;
    const Real sine = sqrt(spot.one_minus_cosine * (Real(2) - spot.one_minus_cosine));
    const Real along = dot(offset, spot.direction);
    return length(offset - spot.direction * along) * cosine - along * sine <= radius;
}

// The irradiance at a node x of a light with that brightness. The brightness is divided first: in fixed point 1/r^2 of
// a distant light has no digits left. A spot counts as a point light where the node's tent meets its cone: photons
// that start outside of the cone are dropped.
Real irradiance_at(const Light &light, Real brightness, const Vec3 &x, const Vec3 &cell) {
    if (!has_falloff(light.kind)) return brightness;
    const Vec3 offset = x - light.position;
    if (light.kind == LightKind::spot && !meets_cone(light, offset, length(cell))) return Real(0);
    // Nearer than a cell the mean of 1/r^2 over a ball counts.
    const Real distance = max(length(offset), largest(cell) * Real(0.57735026918962576451));
    return brightness / distance / distance;
}

// Whether a light stands in smoke, or less than half a cell from it, and more than about 1/64 of its photons collide
// within 2 cells. There its light varies within a cell. `most`: at least the probability that one collides.
bool collides_near(const Medium &medium, const Light &light, Real most) {
    const Vec3 &cell = medium.bricks->cell;
    Real densest = Real(0);
    for (int32_t corner = 0; has_falloff(light.kind) && corner < 8; ++corner) { // of a cell around the light
        const Vec3 side(Real(corner & 1), Real(corner >> 1 & 1), Real(corner >> 2));
        const Vec3 x = light.position + (side - Vec3(Real(0.5))) * cell;
        densest =
            max(densest, sum_of_smokes(medium, [&x](const ResampledField &field) { return extinction(field, x); }));
    }
    return densest > most / (largest(cell) * Real(128));
}

// The light that photons start from.
struct Sources {
    const Medium &medium;
    const SparseGrid &bricks;
    const OpticalDepthGrid &depths;
    const EmissionDistribution &distribution;
};
// What is scattered widely towards the eye.
struct TowardsEye {
    Vec3 eye;
    ForwardPeak peak;
    int32_t shift; // 4 pi times the wide part is scaled by 2^shift, to at most 1

    TowardsEye(const Vec3 &of_camera, const ForwardPeak &of_smoke) : eye(of_camera), peak(of_smoke), shift(0) {
        while (scale_pow2(peak.largest * four_pi<Real>, shift) > Real(1)) --shift;
        while (shift < 20 && scale_pow2(peak.largest * four_pi<Real>, shift) < Real(0.5)) ++shift;
    }
    Real operator()(const Vec3 &x, const Vec3 &direction) const {
        return scale_pow2(peak.wide(direction, direction_between(x, eye)) * four_pi<Real>, shift);
    }
};
// All that tracing needs.
struct Tracer : Sources {
    const Surfaces *surfaces; // nullptr: there are none
    Statistics &statistics;
    const TowardsEye *eye; // nullptr: what is deposited does not depend on directions
    const FlightRecorder *flights;
    Watch watch;
};

// sigma_t of all smokes at a node of a brick, index_of() its cell.
Real extinction_at(const Sources &in, uint32_t brick, int64_t node) {
    return sum_of_smokes(in.medium, [&](const ResampledField &field) { return field.nodes(brick)[node]; });
}

// The optical depth from a node to a light, of whose depths in this brick `depth` is the first.
Real depth_at(const Sources &in, const Cell &node, const Real *depth) {
    const CellPosition at = find_cell(Vec3(Real(node.x), Real(node.y), Real(node.z)), in.depths.spacing);
    return max(Real(0), between_nodes(at, in.depths.spacing, [depth](uint32_t n) { return depth[n]; }));
}

const Real *depths_of(const Sources &in, const PhotonSource &source, uint32_t brick) {
    return depths_of_brick(in.depths, brick) + size_t{source.light} * nodes_of(in.depths.spacing);
}

// The brightness of a node: the power that starts around it, per unit of volume, in the largest channel.
Real brightness_at(const Sources &in, const PhotonSource &source, uint32_t brick, const Cell &node, const Real *depth) {
    const Cell count = {brick_nodes, brick_nodes, brick_nodes};
    const int64_t at = index_of(count, node);
    const Real sigma = source.light >= in.depths.light_count
                           ? in.medium.smokes[source.smoke].field.resampled.nodes(brick)[at]
                           : extinction_at(in, brick, at);
    if (!(sigma > Real(0))) return Real(0);
    const Vec3 x = node_of(in.bricks, brick, node), &cell = in.bricks.cell;
    const Real density = scale_pow2(sigma, in.distribution.shift) * tent_volume(in.bricks.bounds, x, cell);
    if (!depth) return density * source.max_channel;
    return density * irradiance_at(in.depths.lights[source.light], source.max_channel, x, cell) *
           exp(-depth_at(in, node, depth));
}

Real depth_by_ray(const Sources &in, const PhotonSource &source, const Vec3 &x) {
    const Illumination from = illuminate(in.depths.lights[source.light], x, x, x);
    return optical_depth(in.medium, {x, -from.direction}, from.distance);
}

// A photon's power at its start is at most so much of those that start at a node.
constexpr double most_power_between_nodes = 1.25;

// Between nodes the power that starts falls exponentially with the depth to the light, while photons are drawn by
// linear interpolation. The quotient of the two at x (README). The depth is interpolated linearly; where it is nearly
// the same at all corners of the cell, the quotient counts as 1. In cells of smoke with hard faces where it differs
// much, or bends, a ray finds it.
Real power_between_nodes(const Sources &in, const PhotonSource &source, const Vec3 &x) {
    constexpr Real even = Real(0.125), steep = Real(1), most = Real(most_power_between_nodes);
    const uint32_t brick = brick_at(in.bricks, cell_at(in.bricks.lattice, x));
    if (brick == no_brick) return Real(0);
    const Real *depth = depths_of(in, source, brick);
    const CellPosition at = find_cell(position_in(in.bricks, brick, x), 1);
    const Cell low = cell_of_index(brick_nodes, at.node), count = {brick_nodes, brick_nodes, brick_nodes};
    Cell node[8];
    Real tau[8], power[8]; // power: without what smoke takes from the light
    const auto of_corner = [](const Real(&values)[8]) {
        return [&values](int32_t dx, int32_t dy, int32_t dz) { return values[dx + 2 * (dy + 2 * dz)]; };
    };
    Real least = Real(0), greatest = Real(0);
    for (int32_t i = 0; i < 8; ++i) {
        node[i] = {low.x + (i & 1), low.y + (i >> 1 & 1), low.z + (i >> 2)};
        tau[i] = depth_at(in, node[i], depth);
        least = i == 0 ? tau[0] : min(least, tau[i]);
        greatest = i == 0 ? tau[0] : max(greatest, tau[i]);
    }
    if (greatest - least < even) return Real(1);
    const bool bends =
        in.depths.cut_off && (greatest - least > steep ||
                              has_crease(in.bricks.bounds, in.depths.lights[source.light],
                                         {node_of(in.bricks, brick, node[0]), node_of(in.bricks, brick, node[7])}));
    const Real here = bends ? depth_by_ray(in, source, x) : trilinear(at.t, of_corner(tau));
    for (int32_t i = 0; i < 8; ++i)
        power[i] = scale_pow2(extinction_at(in, brick, index_of(count, node[i])), in.distribution.shift) *
                   irradiance_at(in.depths.lights[source.light], source.max_channel, node_of(in.bricks, brick, node[i]),
                                 in.bricks.cell);
    const Real light_here = exp(least - here) * trilinear(at.t, of_corner(power));
    for (int32_t i = 0; i < 8; ++i) power[i] *= exp(least - tau[i]);
    const Real drawn = trilinear(at.t, of_corner(power));
    return light_here < most * drawn ? light_here / drawn : most;
}

// Calls visit(node, brightness) for the nodes of a brick where the source is bright. Nodes on the border to the next
// place of the lattice are left to the brick there. What starts at a light counts as if it were spread evenly.
template <class Visit> void for_each_source_node(const Sources &in, uint32_t s, uint32_t brick, Visit &&visit) {
    const PhotonSource &source = in.distribution.sources[s];
    if (source.starts_at_light()) {
        for (int32_t k = 0; k < cells_of_brick && source.brightness > Real(0); ++k) visit(Cell{}, source.brightness);
        return;
    }
    const OpticalDepthGrid &depths = in.depths;
    const Real *depth = source.light < depths.light_count ? depths_of(in, source, brick) : nullptr;
    const Cell &at = in.bricks.position[brick], &count = in.bricks.lattice.count;
    const auto last = [](int32_t i, int32_t n) { return i + 1 < n ? brick_cells : brick_nodes; };
    for (int32_t z = 0; z < last(at.z, count.z); ++z)
        for (int32_t y = 0; y < last(at.y, count.y); ++y)
            for (int32_t x = 0; x < last(at.x, count.x); ++x) {
                const Cell node = {x, y, z};
                const Real brightness = brightness_at(in, source, brick, node, depth);
                if (brightness > Real(0)) visit(node, brightness);
            }
}

uint32_t weight_of(const Sources &in, Real brightness) {
    return static_cast<uint32_t>(
        floor_to_int(scale_pow2(min(brightness / in.distribution.max_brightness, Real(1)), weight_bits)));
}

// The node where the last photon started, and the weights of the nodes of its source and brick. Photons are placed in
// ascending order of weight, so the next one is near.
struct Cursor {
    uint64_t entry = UINT64_MAX; // source * bricks + brick
    uint32_t count, next;
    uint64_t end; // the sum of all weights of the distribution up to node `next`, included
    Cell node[brick_nodes * brick_nodes * brick_nodes];
    uint32_t weight[brick_nodes * brick_nodes * brick_nodes];
};

// Moves the cursor to the node that holds `target`, a number below the sum of all weights.
void seek(const Sources &in, uint64_t target, Cursor &cursor) {
    const uint64_t entries = uint64_t{in.distribution.source_count} * in.bricks.count;
    uint64_t entry = cursor.entry;
    if (entry == UINT64_MAX || !(target < in.distribution.cumulative_weight[entry + 1]) ||
        target < in.distribution.cumulative_weight[entry]) {
        uint64_t low = 0, high = entries; // cumulative_weight[low] <= target < cumulative_weight[high]
        while (high - low > 1) {
            const uint64_t middle = low + (high - low) / 2;
            (in.distribution.cumulative_weight[middle] <= target ? low : high) = middle;
        }
        entry = low;
    }
    if (entry != cursor.entry) {
        cursor.entry = entry;
        cursor.count = cursor.next = 0;
        for_each_source_node(in, static_cast<uint32_t>(entry / in.bricks.count),
                             static_cast<uint32_t>(entry % in.bricks.count), [&](const Cell &node, Real brightness) {
                                 cursor.node[cursor.count] = node;
                                 cursor.weight[cursor.count++] = weight_of(in, brightness);
                             });
        cursor.end = in.distribution.cumulative_weight[entry] + cursor.weight[0];
    }
    while (!(target < cursor.end) && cursor.next + 1 < cursor.count) cursor.end += cursor.weight[++cursor.next];
}

// A random number with the density of the tent around x, between low and high.
Real draw_tent(Real x, Real cell, Real low, Real high, Pcg32 &generator) {
    for (int i = 0; i < 64; ++i) {
        const Real a = unit_open<Real>(generator());
        const Real b = unit_open<Real>(generator());
        const Real drawn = x + (a + b - Real(1)) * cell;
        if (drawn > low && drawn < high) return drawn;
    }
    return min(max(x, low), high);
}

Real exponential(Pcg32 &generator) { return -log(unit_open<Real>(generator())); }

// How a flight ends.
struct FlightEnd {
    bool collides, stopped; // by a surface
    uint32_t smoke;         // with which it collides
    Vec3 position;
};

// Draws the smoke that a photon collides with, in proportion to density(field).
template <class Density> uint32_t smoke_at(const Medium &medium, Pcg32 &generator, Density &&density) {
    if (medium.count == 1) return 0;
    Real rest = unit_half_open<Real>(generator()) * sum_of_smokes(medium, density);
    uint32_t chosen = 0;
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (!medium.smokes[i].field.is_resampled) continue;
        chosen = i;
        rest -= density(medium.smokes[i].field.resampled);
        if (rest < Real(0)) break;
    }
    return chosen;
}

// Whether a surface stands between x and the light.
bool is_blocked(const Surfaces *surfaces, const Vec3 &x, const Illumination &from) {
    if (!has(parts::surfaces) || !surfaces) return false;
    const Real ray_epsilon = surfaces->ray_epsilon;
    TreeCounts unused = {};
    return is_blocked(*surfaces, {x, -from.direction}, ray_epsilon, from.distance - ray_epsilon, no_triangle, unused);
}

// A collision that is real with a probability of sigma_t / rate.
struct Tentative {
    uint32_t brick;
    Vec3 at; // in the brick, in cells
    Real distance, extinction, rate, probability;
};

// Calls visit(tentative collision) for those of a flight, until it returns false.
template <class Visit>
void for_each_tentative(const Tracer &tracer, const Ray &ray, Real end, Pcg32 &generator, Visit &&visit) {
    const SparseGrid &bricks = tracer.bricks;
    Real begin = Real(0);
    if (!clip(bricks.bounds, ray, begin, end)) return;
    Real rest = exponential(generator);
    uint32_t count = 0;
    for_each_brick(bricks, ray, begin, end, [&](uint32_t brick, Real from, Real to) {
        const Real rate = tracer.distribution.rate[brick], inverse_rate = Real(1) / rate;
        const Vec3 start = position_in(bricks, brick, ray.origin), step = ray.direction * bricks.inverse_cell;
        for (Real t = from;;) {
            const Real depth = rate * (to - t);
            if (!(rest < depth)) {
                rest -= depth;
                return true;
            }
            if (++count % asked_after == 0 && !tracer.watch.go_on(asked_after)) return false;
            if (count == max_tentative) {
                ++tracer.statistics.photons.capped;
                return false;
            }
            t += rest * inverse_rate;
            rest = exponential(generator);
            const Vec3 at = start + step * t;
            const Real sigma =
                sum_of_smokes(tracer.medium, [&](const ResampledField &field) { return extinction(field, brick, at); });
            if (!visit(Tentative{brick, at, t, sigma, rate, min(sigma * inverse_rate, Real(1))})) return false;
        }
    });
}

// The smoke that a photon collides with.
uint32_t smoke_at(const Medium &medium, const Tentative &collision, Pcg32 &generator) {
    return smoke_at(medium, generator,
                    [&](const ResampledField &field) { return extinction(field, collision.brick, collision.at); });
}

// One flight. Calls visit(tentative collision). By delta tracking; or, where `taken` is given, from a light: of all of
// a photon each collision takes its probability of what is left, and the flight ends at one that is chosen in
// proportion to that.
template <class Visit>
FlightEnd fly(const Tracer &tracer, const Ray &ray, Pcg32 &generator, Real *taken, Visit &&visit) {
    constexpr Real least_left = Real(0x1p-20); // less of a photon goes on unseen
    // A light may stand on a surface: its photons begin beyond that.
    const Real begin = taken && tracer.surfaces ? tracer.surfaces->ray_epsilon : Real(0);
    const Real end = distance_to_surface(tracer.surfaces, ray, begin);
    FlightEnd flight = {false, end < infinite_distance, 0, ray.origin};
    for_each_tentative(tracer, ray, end, generator, [&](const Tentative &collision) {
        visit(collision);
        const Real xi = unit_half_open<Real>(generator());
        bool collides, goes_on;
        if (taken) {
            const Real here = (Real(1) - *taken) * collision.probability;
            *taken += here;
            collides = xi * *taken < here;
            goes_on = Real(1) - *taken > least_left;
        } else {
            collides = xi * collision.rate < collision.extinction;
            goes_on = !collides;
        }
        if (collides)
            flight = {true, false, smoke_at(tracer.medium, collision, generator),
                      ray.origin + ray.direction * collision.distance};
        return goes_on;
    });
    return flight;
}

// A fraction of a number of units of 2^-24, rounded to nearest.
int64_t units_of(Real weight, Real units) { return truncate(weight * units + Real(0.5)); }

// Deposits harmonics at the nearest node only: they vary little between nodes, and twelve numbers at eight corners
// would take long.
void deposit_harmonics(const FluenceSums &fluence, uint32_t brick, const Vec3 &p, Real power,
                       const SphericalHarmonics &halves) {
    const int32_t spacing = harmonic_spacing(fluence.spacing), n = nodes_along(spacing);
    const Vec3 q = p * (Real(n - 1) * Real(1.0 / brick_cells)) + Vec3(Real(0.5));
    const auto nearest = [n](Real x) { return min(truncate(max(x, Real(0))), n - 1); };
    const int32_t node = (nearest(q.z) * n + nearest(q.y)) * n + nearest(q.x);
    int64_t *sum =
        fluence.harmonics + (size_t{brick} * nodes_of(spacing) + static_cast<uint32_t>(node)) * harmonic_numbers;
    const Real units = scale_pow2(power, deposit_bits); // below 2^27: power is at most 3.75
    sum[0] += truncate(units);
    for (uint32_t i = 0; i < harmonic_count; ++i) sum[1 + i] += truncate(halves.value[i] * units);
}

// (1 + m) / 2 for each harmonic m of a direction: not below 0.
SphericalHarmonics halves_of(const Vec3 &direction) {
    SphericalHarmonics halves = harmonics_of(direction);
    for (Real &m : halves.value) m = max(Real(0), Real(0.5) * m + Real(0.5));
    return halves;
}

// Deposits a photon that flies along `direction` at a place in a brick.
void deposit(const FluenceSums &fluence, uint32_t brick, const Vec3 &p, const Color &power, const Vec3 &direction,
             const SphericalHarmonics &halves) {
    const int32_t spacing = fluence.spacing;
    const int32_t n = nodes_along(spacing);
    const CellPosition at = find_cell(p, spacing);
    const size_t first = size_t{brick} * nodes_of(spacing) + at.node;
    Real weight[8];
    for (uint32_t corner = 0; corner < 8; ++corner) weight[corner] = corner_weight(at.t, corner);
    const auto node = [&](uint32_t corner) { return first + offset_of_corner(corner, n); };
    for (uint32_t c = 0; c < fluence.channels; ++c) {
        const Real units = scale_pow2(power[static_cast<int>(c)], deposit_bits);
        for (uint32_t corner = 0; corner < 8; ++corner)
            fluence.power[node(corner) * fluence.channels + c] += units_of(weight[corner], units);
    }
    if (!fluence.flux) return;
    const Vec3 flux = direction * (power.x + power.y + power.z);
    for (uint32_t corner = 0; corner < 8; ++corner)
        for (uint32_t c = 0; c < 3; ++c) {
            const Real units = scale_pow2(flux[static_cast<int>(c)], deposit_bits);
            const int64_t amount = units_of(weight[corner], abs(units));
            fluence.flux[node(corner) * 3 + c] += units < Real(0) ? -amount : amount;
        }
    if (fluence.harmonics) deposit_harmonics(fluence, brick, p, power.x + power.y + power.z, halves);
}

void record_flight(const Tracer &tracer, const Ray &ray, Real end, bool collides, const Color &power) {
    tracer.flights->on_flight(tracer.flights->context,
                              {tracer.medium, tracer.statistics.photons.emitted - 1, ray, end, collides, power});
}

// A photon where its path starts.
struct Start {
    Color power; // 0: there is none
    Vec3 direction;
    FlightEnd collision; // the first; from where smoke glows, or from a light, there is none yet
};

Start start_at_light(const Tracer &tracer, const PhotonSource &source, const Color &color, uint64_t key) {
    const Photon photon = emit(source.emitter, tracer.medium.sphere, photon_event(key, 0));
    if (!photon.emitted) ++tracer.statistics.photons.escaped;
    return {photon.emitted ? color : Color(Real(0)), photon.ray.direction, {false, false, 0, photon.ray.origin}};
}

// A photon that starts around a node: where light first collides, or where smoke glows.
Start start_at_node(const Tracer &tracer, const PhotonSource &source, const Color &color, const Vec3 &node,
                    Pcg32 &generator) {
    const Start nowhere = {Color(Real(0)), {}, {}};
    const SparseGrid &bricks = tracer.bricks;
    const Box &box = bricks.bounds;
    Vec3 x;
    for (int axis = 0; axis < 3; ++axis) // the draws are in a fixed order
        x[axis] = draw_tent(node[axis], bricks.cell[axis], box.low[axis], box.high[axis], generator);
    auto &counts = tracer.statistics.photons;
    const bool glows = source.light >= tracer.depths.light_count;
    const Real here = glows ? Real(1) : power_between_nodes(tracer, source, x);
    if (!(here > Real(0))) { // outside of the smoke
        ++counts.escaped;
        return nowhere;
    }
    Start start = {color * here, {}, {!glows, false, 0, x}};
    if (glows) {
        const Phase::Cosine angle = Phase(Real(0)).sample(unit_open<Real>(generator()));
        const Real turns = unit_half_open<Real>(generator());
        start.direction = deflect(Vec3(Real(0), Real(0), Real(1)), angle, turns);
        return start;
    }
    const Light &light = tracer.depths.lights[source.light];
    const Illumination from = illuminate(light, x, x, x);
    if (light.kind == LightKind::spot && !in_cone(from.direction, light.direction, light.one_minus_cosine)) {
        ++counts.escaped;
        return nowhere;
    }
    if (is_blocked(tracer.surfaces, x, from)) {
        ++counts.blocked;
        return nowhere;
    }
    start.direction = from.direction;
    start.collision.smoke =
        smoke_at(tracer.medium, generator, [&](const ResampledField &field) { return extinction(field, x); });
    ++counts.collisions;
    if (is_recording(tracer.flights)) {
        const Real reach = light.kind == LightKind::parallel ? length(box.high - box.low) : from.distance;
        record_flight(tracer, {x - from.direction * reach, from.direction}, reach, true, start.power);
    }
    return start;
}

// `target`: a number below the sum of all weights, which chooses the source and the node.
void trace_photon(const Tracer &tracer, const FluenceSums &fluence, uint64_t target, uint64_t key, Pcg32 &generator,
                  Cursor &cursor) {
    seek(tracer, target, cursor);
    const SparseGrid &bricks = tracer.bricks;
    const Medium &medium = tracer.medium;
    const PhotonSource &source = tracer.distribution.sources[cursor.entry / bricks.count];
    auto &counts = tracer.statistics.photons;
    ++counts.emitted;
    const Color color = fluence.channels == 1 ? Color(Real(1)) : source.color / source.max_channel;
    bool from_light = source.starts_at_light(); // and has not collided yet
    const Start start = from_light ? start_at_light(tracer, source, color, key)
                                   : start_at_node(tracer, source, color,
                                                   node_of(bricks, static_cast<uint32_t>(cursor.entry % bricks.count),
                                                           cursor.node[cursor.next]),
                                                   generator);
    if (!(largest(start.power) > Real(0))) return;
    Color power = start.power;
    FlightEnd at = start.collision;
    Ray ray = {at.position, start.direction};
    for (uint32_t number = 0;; ++number) {
        if (at.collides) {
            // The photon survives if xi < q. The comparison is strict: an albedo of 0 never survives, and 1 always
            // does.
            const SmokeVolume &smoke = medium.smokes[at.smoke];
            const Color scattered = power * smoke.albedo;
            const Real q = largest(scattered) / largest(power);
            if (!(unit_half_open<Real>(generator()) < q)) {
                ++counts.absorbed;
                return;
            }
            power = scattered / q;
            ray.origin = at.position;
            const Phase::Cosine angle = smoke.phase.sample(unit_open<Real>(generator()));
            ray.direction = deflect(ray.direction, angle, unit_half_open<Real>(generator()));
        }
        const uint64_t capped = counts.capped;
        const SphericalHarmonics halves = fluence.harmonics ? halves_of(ray.direction) : SphericalHarmonics{};
        Real taken = Real(0);
        at = fly(tracer, ray, generator, from_light ? &taken : nullptr, [&](const Tentative &collision) {
            if (from_light) return; // its light is single scattering
            Real part = scale_pow2(collision.probability, tracer.distribution.deposit_shift);
            if (tracer.eye)
                part *= (*tracer.eye)(low_of(bricks, collision.brick) + collision.at * bricks.cell, ray.direction);
            deposit(fluence, collision.brick, collision.at, power * part, ray.direction, halves);
        });
        if (counts.capped != capped || !tracer.watch.go_on(units_of_flight)) return;
        if (from_light) power = power * (taken / source.most_power);
        if (is_recording(tracer.flights))
            record_flight(tracer, ray,
                          at.collides ? length(at.position - ray.origin)
                                      : distance_to_surface(tracer.surfaces, ray, Real(0)),
                          at.collides, power);
        if (!at.collides) {
            ++(at.stopped ? counts.blocked : counts.escaped);
            return;
        }
        ++counts.collisions;
        if (!from_light) ++counts.stored;
        from_light = false;
        if (number == max_collisions) {
            ++counts.capped;
            return;
        }
    }
}

detail::Wide whole_product(uint64_t a, uint64_t b) { // both below 2^63
    return detail::product<detail::Wide>(static_cast<int64_t>(a), static_cast<int64_t>(b));
}

uint32_t source_limit(const Scene &scene) { return scene.light_count + scene.smoke_count; }

// `total`: the sum of all weights.
Status trace_batches(const PhotonTracing &tracing, const OpticalDepthGrid &depths,
                     const EmissionDistribution &distribution, const TowardsEye *eye, uint64_t total,
                     FluenceSums &fluence) {
    const Settings &settings = tracing.settings;
    Arena &arena = tracing.arena;
    Statistics &statistics = tracing.statistics;
    const size_t mark = arena.mark();
    Cursor *cursor = arena.make<Cursor>(1);
    if (!cursor) return Status::out_of_memory;
    const Tracer tracer = {{tracing.medium, *fluence.bricks, depths, distribution},
                           tracing.surfaces,
                           statistics,
                           eye,
                           tracing.flights,
                           tracing.watch};
    cursor->entry = UINT64_MAX;
    const auto first_weight = [&](uint64_t photon) {
        return detail::divide(whole_product(photon, total), settings.photons).quotient;
    };
    const auto &counts = statistics.photons;
    bool fits = true;
    const Status status = for_each_batch(tracing, [&](Mt19937 &keys, uint64_t batch, uint64_t photons) {
        uint64_t photon = batch * batch_photons;
        return for_each_photon(tracing, keys, photons, [&](uint64_t key) {
            // Stratification: photon i takes the i-th of `settings.photons` equal intervals of all weights, and a
            // random place in that interval.
            Pcg32 generator(key);
            const uint64_t from = first_weight(photon), width = first_weight(photon + 1) - from;
            const detail::Wide place = whole_product(width, generator());
            const uint64_t offset =
                static_cast<uint64_t>(detail::high_word(place)) << 32 | detail::low_word(place) >> 32;
            trace_photon(tracer, fluence, from + offset, key, generator, *cursor);
            ++photon;
            return fits = counts.stored + counts.emitted <= max_fluence_flights;
        });
    });
    arena.rewind(mark);
    return fits ? status : Status::overflow;
}

} // namespace

FluencePlan plan_fluence(const Scene &scene, const PhotonNeeds &needs, uint64_t bricks, int32_t spacing) {
    FluencePlan plan = {0, 0};
    if (!needs.traced) return plan;
    plan.sums = bricks * nodes_of(spacing) * ((needs.powers ? 3 : 1) + (needs.directions ? 3 : 0)) +
                (needs.harmonics ? bricks * nodes_of(harmonic_spacing(spacing)) * harmonic_numbers : 0);
    plan.bytes = Arena::bytes<int64_t>(plan.sums) + Arena::bytes<PhotonSource>(source_limit(scene)) +
                 Arena::bytes<Real>(bricks) + Arena::bytes<uint64_t>(source_limit(scene) * bricks + 1) +
                 Arena::bytes<Cursor>(1) + batch_bytes;
    return plan;
}

bool make_emission_distribution(const Scene &scene, const Medium &medium, const OpticalDepthGrid &depths, Arena &arena,
                                EmissionDistribution &distribution, Watch watch) {
    const SparseGrid &bricks = *medium.bricks;
    distribution = {};
    PhotonSource *sources = arena.make<PhotonSource>(source_limit(scene));
    Real *rate = arena.make<Real>(bricks.count);
    uint64_t *cumulative_weight = arena.make<uint64_t>(uint64_t{source_limit(scene)} * bricks.count + 1);
    if (!sources || !rate || !cumulative_weight) return false;
    const Vec3 &edge = bricks.lattice.edge;
    const Real min_rate = max(min_collisions_per_brick / largest(edge), Real(1.0 / 32));
    Real densest = Real(0), likeliest = Real(0); // likeliest: the greatest probability that a collision is real
    for (uint32_t b = 0; b < bricks.count; ++b) {
        const Real greatest = sum_of_smokes(medium, [b](const ResampledField &field) { return field.majorants[b]; });
        rate[b] = max(greatest, min_rate);
        densest = max(densest, greatest);
        likeliest = max(likeliest, greatest / rate[b]);
    }
    if (likeliest > Real(0))
        while (scale_pow2(likeliest, distribution.deposit_shift) < Real(0.5) && distribution.deposit_shift < 20)
            ++distribution.deposit_shift;
    if (densest > Real(0))
        while (scale_pow2(densest, distribution.shift) < Real(0x1p11) && distribution.shift < 31) ++distribution.shift;

    // The longest way of a ray through the smoke, or what one tentative collision stands for.
    const Real longest = max(length(bricks.bounds.high - bricks.bounds.low), Real(1) / min_rate);
    const bool is_deep = densest > Real(1) / longest;
    const Real of_brick = bricks.cell.x * bricks.cell.y * bricks.cell.z * Real(cells_of_brick);
    uint32_t &count = distribution.source_count;
    const auto add = [&](uint32_t light, uint32_t smoke, const Color &color) {
        if (largest(color) > Real(0)) sources[count++] = {light, smoke, color, largest(color), {}, Real(0), Real(0)};
    };
    for (uint32_t l = 0; l < depths.light_count; ++l) {
        const Light &light = depths.lights[l];
        const uint32_t before = count;
        add(l, 0, light.color);
        const Real most_power = is_deep ? Real(1) : densest * longest;
        if (count == before || !collides_near(medium, light, most_power)) continue;
        PhotonSource &source = sources[before];
        source.emitter = make_emitter(light, medium.sphere);
        source.most_power = most_power;
        source.brightness = scale_pow2(most_power, distribution.shift) / of_brick /
                            Real(static_cast<int32_t>(bricks.count)) * largest(source.emitter.power);
    }
    for (uint32_t i = 0; i < medium.count; ++i)
        if (medium.smokes[i].field.is_resampled) add(depths.light_count, i, emission_of(medium.smokes[i]));
    distribution.sources = sources;
    distribution.rate = rate;
    distribution.cumulative_weight = cumulative_weight;

    const Sources in = {medium, bricks, depths, distribution};
    watch.expect(uint64_t{count} * bricks.count * units_of_source_brick * 2);
    for (uint32_t s = 0; s < count; ++s)
        for (uint32_t b = 0; b < bricks.count && watch.done(units_of_source_brick); ++b)
            for_each_source_node(in, s, b, [&](const Cell &, Real brightness) {
                distribution.max_brightness = max(distribution.max_brightness, brightness);
            });
    uint64_t total = 0;
    for (uint32_t s = 0; s < count; ++s)
        for (uint32_t b = 0; b < bricks.count && watch.done(units_of_source_brick); ++b) {
            cumulative_weight[uint64_t{s} * bricks.count + b] = total;
            for_each_source_node(in, s, b, [&](const Cell &, Real brightness) { total += weight_of(in, brightness); });
        }
    cumulative_weight[uint64_t{count} * bricks.count] = total;
    return !watch.stopped();
}

Status trace_fluence(const PhotonTracing &tracing, const OpticalDepthGrid &depths,
                     const EmissionDistribution &distribution, int32_t spacing, PhotonSums &sums,
                     FluenceSums &fluence) {
    const SparseGrid &bricks = *tracing.medium.bricks;
    const Settings &settings = tracing.settings;
    const PhotonNeeds &needs = tracing.needs;
    const uint64_t nodes = uint64_t{bricks.count} * nodes_of(spacing);
    fluence = {&tracing.medium,        &bricks,        spacing,      sums.values,        nullptr, nullptr,
               needs.powers ? 3u : 1u, Color(Real(1)), {Real(1), 0}, distribution.shift, nullptr};
    const uint64_t powers = nodes * fluence.channels, with_flux = powers + (needs.directions ? nodes * 3 : 0);
    const uint64_t harmonic_nodes = uint64_t{bricks.count} * nodes_of(harmonic_spacing(spacing));
    const uint64_t numbers = with_flux + (needs.harmonics ? harmonic_nodes * harmonic_numbers : 0);
    if (needs.directions) fluence.flux = sums.values + powers;
    if (needs.harmonics) fluence.harmonics = sums.values + with_flux;
    if (sums.count != 0 && sums.count != numbers) return Status::size_mismatch;
    if (numbers > sums.capacity) return Status::out_of_memory;
    if (sums.count == 0 && !fill(sums.values, numbers, int64_t{0}, tracing.watch)) return Status::stopped;
    sums.count = numbers;
    tracing.statistics.bytes.particle_map = numbers * sizeof(int64_t);

    const uint64_t total = distribution.cumulative_weight[uint64_t{distribution.source_count} * bricks.count];
    if (total == 0) return Status::done;
    fluence.photon_color = distribution.sources[0].color / distribution.sources[0].max_channel;
    const Real volume = bricks.cell.x * bricks.cell.y * bricks.cell.z;
    const Real power = scaled_integer<Real>(static_cast<int64_t>(total), -weight_bits) *
                       scale_pow2(distribution.max_brightness * volume, -distribution.shift);
    fluence.unit = photon_unit(power, settings.photons);
    fluence.unit.exponent -= distribution.deposit_shift;
    if (!needs.towards_eye) return trace_batches(tracing, depths, distribution, nullptr, total, fluence);
    const TowardsEye eye(tracing.eye, forward_peak(tracing.medium, depths.lights, depths.light_count, tracing.eye));
    fluence.unit.exponent -= eye.shift;
    fluence.straight = eye.peak.narrow;
    return trace_batches(tracing, depths, distribution, &eye, total, fluence);
}

namespace {

// What the nodes of a brick along one axis give to the integral of sigma_t times the tent of a node: weights of nodes
// `first` to `last`, in sixths of a cell. In whole cells these are exact.
struct AxisWeights {
    int32_t first, last;
    Real weight[brick_nodes];
};

// The tent of node `at` is `spacing` cells wide to either side; smoke lies between `low` and `high`; all in cells from
// the low corner of the brick.
AxisWeights weights_along(int32_t at, int32_t spacing, Real low, Real high) {
    AxisWeights axis = {max(at - spacing, 0), min(at + spacing, brick_cells), {}};
    const auto tent = [&](int32_t t) { return Real(1) - Real(t < at ? at - t : t - at) / Real(spacing); };
    for (int32_t c = axis.first; c < axis.last; ++c) {
        const Real a = min(max(low - Real(c), Real(0)), Real(1)), b = min(max(high - Real(c), Real(0)), Real(1));
        if (!(a < b)) continue;
        // Between nodes c and c + 1, at u from a to b, the tent is p + q u and sigma_t is linear.
        const Real p = tent(c), q = tent(c + 1) - p;
        const Real one = Real(6) * (b - a), two = Real(3) * (b * b - a * a), three = Real(2) * (b * b * b - a * a * a);
        const Real above = p * two + q * three;
        axis.weight[c + 1] += above;
        axis.weight[c] += p * one + q * two - above;
    }
    return axis;
}

// The integrals of sigma_t 2^sigma_shift times the tents of a brick's nodes over that brick, in units of 1/216 of a
// cell.
void find_tents_of_brick(const FluenceSums &fluence, uint32_t brick, Real *tents) {
    const SparseGrid &bricks = *fluence.bricks;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    const Vec3 low = (bricks.bounds.low - low_of(bricks, brick)) * bricks.inverse_cell,
               high = (bricks.bounds.high - low_of(bricks, brick)) * bricks.inverse_cell;
    AxisWeights along[3][brick_nodes];
    for (int axis = 0; axis < 3; ++axis)
        for (int32_t i = 0; i < n; ++i) along[axis][i] = weights_along(i * spacing, spacing, low[axis], high[axis]);
    for (uint32_t node = 0; node < nodes_of(spacing); ++node) {
        const Cell at = cell_of_index(n, node);
        const AxisWeights &x = along[0][at.x], &y = along[1][at.y], &z = along[2][at.z];
        Real sum = Real(0);
        for (uint32_t s = 0; s < fluence.medium->count; ++s) {
            if (!fluence.medium->smokes[s].field.is_resampled) continue;
            const Real *sigma = fluence.medium->smokes[s].field.resampled.nodes(brick);
            for (int32_t k = z.first; k <= z.last; ++k)
                for (int32_t j = y.first; j <= y.last; ++j) {
                    Real row = Real(0);
                    for (int32_t i = x.first; i <= x.last; ++i)
                        row += x.weight[i] *
                               scale_pow2(sigma[(k * brick_nodes + j) * brick_nodes + i], fluence.sigma_shift);
                    sum += y.weight[j] * z.weight[k] * row;
                }
        }
        tents[node] = sum;
    }
}

} // namespace

bool find_tents(FluenceSums &fluence, Arena &arena, Watch watch) {
    const uint32_t nodes = nodes_of(fluence.spacing);
    Real *tents = arena.make<Real>(uint64_t{fluence.bricks->count} * nodes);
    if (!tents) return false;
    for (uint32_t b = 0; b < fluence.bricks->count; ++b) {
        if (!watch.go_on(nodes * units_of_tent)) return false;
        find_tents_of_brick(fluence, b, tents + size_t{b} * nodes);
    }
    fluence.tents = tents;
    return true;
}

bool light_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node, FluenceAndFlux &light) {
    constexpr Real least = Real(0x1p-10);
    const SparseGrid &bricks = *fluence.bricks;
    const int32_t spacing = fluence.spacing, n = nodes_along(spacing);
    int64_t power[3] = {0, 0, 0}, flux[3] = {0, 0, 0};
    Real integral = Real(0), densest = Real(0); // of sigma_t times the node's tent; of all holders
    for_each_holder(bricks, bricks.position[brick], node, n, [&](uint32_t other, uint32_t there) {
        densest = max(densest, sum_of_smokes(*fluence.medium,
                                             [other](const ResampledField &field) { return field.majorants[other]; }));
        const size_t k = size_t{other} * nodes_of(spacing) + there;
        integral += fluence.tents[k];
        for (uint32_t c = 0; c < fluence.channels; ++c)
            power[c] = wrapped_sum(power[c], fluence.power[k * fluence.channels + c]);
        for (uint32_t c = 0; fluence.flux && c < 3; ++c) flux[c] = wrapped_sum(flux[c], fluence.flux[k * 3 + c]);
    });
    integral *= Real(1.0 / 216);
    light = {Color(Real(0)), Vec3(Real(0))};
    if (!(integral > scale_pow2(densest, fluence.sigma_shift) * (least * Real(spacing * spacing * spacing))))
        return false;
    const Color sum = fluence.channels == 1 ? fluence.photon_color * photons_of(power[0])
                                            : Color(photons_of(power[0]), photons_of(power[1]), photons_of(power[2]));
    const Real all = sum.x + sum.y + sum.z;
    if (fluence.flux && all > Real(0))
        light.flux = Vec3(photons_of(flux[0]), photons_of(flux[1]), photons_of(flux[2])) / all;
    // sum / integral * unit * 2^exponent; half of the scaling comes before the division.
    const Vec3 &cell = bricks.cell;
    const int32_t exponent = fluence.unit.exponent + fluence.sigma_shift, half = exponent / 2;
    const Color scaled = scale_pow2(sum * (inv_four_pi<Real> * fluence.unit.unit), half);
    light.radiance = scale_pow2(scaled / (cell.x * cell.y * cell.z * integral), exponent - half);
    return true;
}

SphericalHarmonics harmonics_at_node(const FluenceSums &fluence, uint32_t brick, const Cell &node) {
    const int32_t spacing = harmonic_spacing(fluence.spacing);
    int64_t sum[harmonic_numbers] = {};
    for_each_holder(*fluence.bricks, fluence.bricks->position[brick], node, nodes_along(spacing),
                    [&](uint32_t other, uint32_t there) {
                        const size_t k = size_t{other} * nodes_of(spacing) + there;
                        for (uint32_t i = 0; i < harmonic_numbers; ++i)
                            sum[i] = wrapped_sum(sum[i], fluence.harmonics[k * harmonic_numbers + i]);
                    });
    SphericalHarmonics harmonics = {};
    const Real all = photons_of(sum[0]);
    for (uint32_t i = 0; all > Real(0) && i < harmonic_count; ++i) // (1 + m) / 2 minus (1 - m) / 2
        harmonics.value[i] = photons_of(wrapped_difference(sum[1 + i], wrapped_difference(sum[0], sum[1 + i]))) / all;
    return harmonics;
}

} // namespace wisp::WISP_ARITH
