// Where photons start in resampled smoke (S2).
#include "core/photons/photon_starts.h"
#include "core/photons/photon_tracing.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr int32_t weight_bits = 30; // of a node's weight: 2^30 for the brightest node
constexpr int32_t brick_nodes = nodes_along(1), cells_of_brick = brick_cells * brick_cells * brick_cells;
constexpr uint32_t units_of_source_brick = 128; // of work
// The least number of tentative collisions along a brick's edge: they sample the fluence in thin smoke too.
constexpr Real min_collisions_per_brick = Real(0.5);

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
            max(densest, sum_of_resampled(medium, [&x](const ResampledField &field) { return extinction(field, x); }));
    }
    return densest > most / (largest(cell) * Real(128));
}

// sigma_t of all smokes at a node of a brick, index_of() its cell.
Real extinction_at(const PhotonSources &in, uint32_t brick, int64_t node) {
    return sum_of_resampled(in.medium, [&](const ResampledField &field) { return field.nodes(brick)[node]; });
}

// The optical depth from a node to a light, of whose depths in this brick `depth` is the first.
Real depth_at(const PhotonSources &in, const Cell &node, const Real *depth) {
    const CellPosition at = find_cell(Vec3(Real(node.x), Real(node.y), Real(node.z)), in.depths.spacing);
    return max(Real(0), between_nodes(at, in.depths.spacing, [depth](uint32_t n) { return depth[n]; }));
}

const Real *depths_of(const PhotonSources &in, const PhotonSource &source, uint32_t brick) {
    return depths_of_brick(in.depths, brick) + size_t{source.light} * nodes_of(in.depths.spacing);
}

// The brightness of a node: the power that starts around it, per unit of volume, in the largest channel.
Real brightness_at(const PhotonSources &in, const PhotonSource &source, uint32_t brick, const Cell &node,
                   const Real *depth) {
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

Real depth_by_ray(const PhotonSources &in, const PhotonSource &source, const Vec3 &x) {
    const Illumination from = illuminate(in.depths.lights[source.light], x, x, x);
    return optical_depth(in.medium, {x, -from.direction}, from.distance);
}

// Calls visit(node, brightness) for the nodes of a brick where the source is bright. Nodes on the border to the next
// place of the lattice are left to the brick there. What starts at a light counts as if it were spread evenly.
template <class Visit> void for_each_source_node(const PhotonSources &in, uint32_t s, uint32_t brick, Visit &&visit) {
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

uint32_t weight_of(const PhotonSources &in, Real brightness) {
    return static_cast<uint32_t>(
        floor_to_int(scale_pow2(min(brightness / in.distribution.max_brightness, Real(1)), weight_bits)));
}

uint32_t source_limit(const Scene &scene) { return scene.light_count + scene.smoke_count; }

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

} // namespace

uint64_t emission_bytes(const Scene &scene, uint64_t bricks) {
    return Arena::bytes<PhotonSource>(source_limit(scene)) + Arena::bytes<Real>(bricks) +
           Arena::bytes<uint64_t>(source_limit(scene) * bricks + 1);
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
        const Real greatest = sum_of_resampled(medium, [b](const ResampledField &field) { return field.majorants[b]; });
        rate[b] = max(greatest, min_rate);
        densest = max(densest, greatest);
        likeliest = max(likeliest, greatest / rate[b]);
    }
    if (likeliest > Real(0))
        while (scale_pow2(likeliest, distribution.deposit_shift) < Real(0.5) && distribution.deposit_shift < 20)
            ++distribution.deposit_shift;
    distribution.shift = sigma_shift_for(densest);

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

    const PhotonSources in = {medium, bricks, depths, distribution};
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
Real emitted_power(const EmissionDistribution &distribution, const SparseGrid &bricks) {
    const Real volume = bricks.cell.x * bricks.cell.y * bricks.cell.z;
    return scaled_integer<Real>(static_cast<int64_t>(sum_of_weights(distribution, bricks)), -weight_bits) *
           scale_pow2(distribution.max_brightness * volume, -distribution.shift);
}

void seek(const PhotonSources &in, uint64_t target, StartCursor &cursor) {
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

Vec3 draw_start(const PhotonSources &in, const StartCursor &cursor, Pcg32 &generator) {
    const Vec3 node =
        node_of(in.bricks, static_cast<uint32_t>(cursor.entry % in.bricks.count), cursor.node[cursor.next]);
    const Box &box = in.bricks.bounds;
    Vec3 x;
    for (int axis = 0; axis < 3; ++axis) // the draws are in a fixed order
        x[axis] = draw_tent(node[axis], in.bricks.cell[axis], box.low[axis], box.high[axis], generator);
    return x;
}

Real power_between_nodes(const PhotonSources &in, const PhotonSource &source, const Vec3 &x) {
    constexpr Real even = Real(0.125), steep = Real(1), most = Real(1.25);
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

} // namespace wisp::WISP_ARITH
