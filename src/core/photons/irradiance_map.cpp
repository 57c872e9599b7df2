// The irradiance map: made from what photons left, and read.
#include "core/photons/irradiance_map.h"

namespace wisp::WISP_ARITH {

namespace {

// Whether a brick's light at every `fine` cells lies within `most` of that between every `coarse` cells.
bool suffices(const Color *light, int32_t fine, int32_t coarse, Real most) {
    const int32_t n = nodes_along(fine), ratio = coarse / fine;
    for (int32_t z = 0; z < n; ++z)
        for (int32_t y = 0; y < n; ++y)
            for (int32_t x = 0; x < n; ++x) {
                const Color &here = light[(z * n + y) * n + x];
                const GridPlace at = place_of(Vec3(Real(x * fine), Real(y * fine), Real(z * fine)), coarse);
                const int32_t m = nodes_along(coarse);
                for (int32_t c = 0; c < 3; ++c) {
                    const Real between = between_nodes(at, coarse, [&](uint32_t node) {
                        const int32_t i = static_cast<int32_t>(node);
                        const int32_t cx = i % m * ratio, cy = i / m % m * ratio, cz = i / m / m * ratio;
                        return light[(cz * n + cy) * n + cx][c];
                    });
                    if (abs(between - here[c]) > most) return false;
                }
            }
    return true;
}

// The points of all bricks before they are packed, at every `stride` cells.
struct Points {
    const SparseGrid *bricks;
    int32_t stride, along;
    uint32_t nodes; // of a brick
    uint64_t count;
    int32_t *first, *strides, *exponent; // of the map
    uint32_t *value, *flux;              // of the map; flux may be nullptr
    bool *known;
    Color *radiance;
};
bool make_points(const SparseGrid &bricks, int32_t stride, bool flux, Arena &arena, Points &points) {
    points = {};
    points.bricks = &bricks;
    points.stride = stride;
    points.along = nodes_along(stride);
    points.nodes = nodes_of(stride);
    points.count = uint64_t{bricks.count} * points.nodes;
    points.first = arena.make<int32_t>(bricks.count);
    points.strides = arena.make<int32_t>(bricks.count);
    points.exponent = arena.make<int32_t>(bricks.count);
    points.value = arena.make<uint32_t>(points.count);
    points.flux = flux ? arena.make<uint32_t>(points.count) : nullptr;
    points.known = arena.make<bool>(points.count);
    points.radiance = arena.make<Color>(points.count);
    return points.first && points.strides && points.exponent && points.value && (points.flux || !flux) &&
           points.known && points.radiance;
}

// Trilinear interpolation spreads the light of nodes, by the variance cell^2 / 6 along every axis; a second difference
// is twice what a variance of cell^2 adds to a value. Taken from the nodes that share of it leaves the right mean.
constexpr double interpolated = 1.0 / 12, scattered_and_interpolated = 1.0 / 6;

// Whether photons tell what light there is at a node: where hardly any of its tent lies in the smoke's bounds they do
// not.
bool tells(const SparseGrid &bricks, uint32_t brick, const Cell &node, int32_t stride) {
    const Vec3 x = node_of(bricks, brick, {node.x * stride, node.y * stride, node.z * stride});
    const Vec3 reach = bricks.cell * (Real(stride) * Real(15.0 / 16));
    const Vec3 low = x - reach, high = x + reach;
    const Box &box = bricks.bounds;
    return high.x > box.low.x && high.y > box.low.y && high.z > box.low.z && low.x < box.high.x && low.y < box.high.y &&
           low.z < box.high.z;
}

// visit(point) for the neighbours of a node along those axes on which both are known: beyond others light is taken to
// go on as it comes.
template <class Visit> void for_each_neighbour(const Points &points, uint64_t i, Visit &&visit) {
    const SparseGrid &bricks = *points.bricks;
    const Cell &place = bricks.place[i / points.nodes];
    const Cell node = cell_of_index(points.along, static_cast<uint32_t>(i % points.nodes));
    const auto beside = [&](int32_t axis, int32_t step) {
        const Cell at = {node.x + (axis == 0 ? step : 0), node.y + (axis == 1 ? step : 0),
                         node.z + (axis == 2 ? step : 0)};
        uint64_t found = points.count;
        for_each_holder(bricks, place, at, points.along, [&](uint32_t other, uint32_t there) {
            const uint64_t its = uint64_t{other} * points.nodes + there;
            if (points.known[its]) found = its;
        });
        return found;
    };
    for (int32_t axis = 0; axis < 3; ++axis) {
        const uint64_t before = beside(axis, -1), behind = beside(axis, 1);
        if (before == points.count || behind == points.count) continue;
        visit(before);
        visit(behind);
    }
}

// All known nodes without `share` of their second differences: the darker of two neighbours gives that share of their
// difference to the brighter, or less where it has not as much, so that no light is lost inside and none is below 0.
// False: the arena was too small.
bool sharpen(Points &points, double share_, Arena &arena) {
    const Real share = Real(share_);
    Color *sharp = arena.make<Color>(points.count), *given = arena.make<Color>(points.count);
    if (!sharp || !given) return false;
    for (uint64_t i = 0; i < points.count; ++i) { // which part of what it should give a node can
        given[i] = Color(Real(1));
        if (!points.known[i]) continue;
        const Color &here = points.radiance[i];
        Color wanted(Real(0));
        for_each_neighbour(points, i, [&](uint64_t other) {
            wanted += max(points.radiance[other] - here, Color(Real(0))) * share;
        });
        for (int32_t c = 0; c < 3; ++c)
            if (wanted[c] > here[c]) given[i][c] = here[c] / wanted[c];
    }
    for (uint64_t i = 0; i < points.count; ++i) {
        sharp[i] = points.radiance[i];
        if (!points.known[i]) continue;
        for_each_neighbour(points, i, [&](uint64_t other) {
            const Color less = (points.radiance[other] - points.radiance[i]) * share;
            for (int32_t c = 0; c < 3; ++c)
                sharp[i][c] -= less[c] * (less[c] > Real(0) ? given[i][c] : given[other][c]);
        });
        sharp[i] = max(sharp[i], Color(Real(0))); // rounding
    }
    points.radiance = sharp;
    return true;
}

// The points of each brick, as few as the tolerance allows.
//
// The thinner a brick's smoke, the less its light matters: what may be lost is that of a brick of depth 1, divided by
// the brick's own.
void pack_points(const Medium &medium, Points &points, Real tolerance, Irradiance &map) {
    const int32_t n = points.along;
    const SparseGrid &bricks = *points.bricks;
    for (uint32_t b = 0; b < bricks.count; ++b) {
        const Color *light = points.radiance + uint64_t{b} * points.nodes;
        Real greatest = Real(0);
        for (uint32_t i = 0; i < points.nodes; ++i) greatest = max(greatest, largest(light[i]));
        int32_t stride = points.stride;
        if (tolerance > Real(0)) {
            const Vec3 low = low_of(bricks, b);
            Real depth = Real(0);
            for (uint32_t i = 0; i < medium.count; ++i)
                depth += majorant(medium.smokes[i].field, {low, low + bricks.lattice.edge});
            depth = max(min(depth * largest(bricks.lattice.edge), Real(1)), tolerance);
            while (stride < brick_cells && suffices(light, points.stride, 2 * stride, greatest * tolerance / depth))
                stride *= 2;
        }
        points.first[b] = static_cast<int32_t>(map.points);
        points.strides[b] = stride;
        points.exponent[b] = exponent_for(greatest);
        const int32_t ratio = stride / points.stride, m = nodes_along(stride), unit = single_channel_bits - points.exponent[b];
        for (uint32_t k = 0; k < nodes_of(stride); ++k) {
            const Cell node = cell_of_index(m, k);
            const size_t from = static_cast<size_t>((node.z * ratio * n + node.y * ratio) * n + node.x * ratio);
            points.value[map.points] = map.single_channel
                                           ? static_cast<uint32_t>(round_to_int(scale_pow2(largest(light[from]), unit)))
                                           : pack_color(light[from], points.exponent[b]);
            // What is read never lies behind what is written.
            if (points.flux) points.flux[map.points] = points.flux[uint64_t{b} * points.nodes + from];
            ++map.points;
        }
    }
    map.first = points.first;
    map.stride = points.strides;
    map.exponent = points.exponent;
    map.value = points.value;
    map.flux = points.flux;
    map.ready = true;
}

// Points that no smoke is near enough to tell take the mean of their neighbours in the brick.
void fill_unknown(Points &points, uint32_t brick) {
    const int32_t n = points.along;
    Color *radiance = points.radiance + uint64_t{brick} * points.nodes;
    const bool *known = points.known + uint64_t{brick} * points.nodes;
    for (uint32_t k = 0; k < points.nodes; ++k) {
        if (known[k]) continue;
        const Cell node = cell_of_index(n, k);
        Color sum(Real(0));
        int32_t count = 0;
        for (int32_t z = max(node.z - 1, 0); z <= min(node.z + 1, n - 1); ++z)
            for (int32_t y = max(node.y - 1, 0); y <= min(node.y + 1, n - 1); ++y)
                for (int32_t x = max(node.x - 1, 0); x <= min(node.x + 1, n - 1); ++x) {
                    const size_t i = static_cast<size_t>((z * n + y) * n + x);
                    if (!known[i]) continue;
                    sum += radiance[i];
                    ++count;
                }
        if (count > 0) radiance[k] = sum / Real(count);
    }
}

// From what is known to the map; not ready where the arena was too small.
void finish(const Medium &medium, Points &points, double share, Real tolerance, Arena &arena, Irradiance &map) {
    if (!sharpen(points, share, arena)) return;
    for (uint32_t b = 0; b < points.bricks->count; ++b) fill_unknown(points, b);
    pack_points(medium, points, tolerance, map);
}

// False: the arena was too small.
bool pack_harmonics(const FluenceSums &deposits, Arena &arena, Irradiance &map) {
    map.harmonic_spacing = harmonic_spacing(deposits.stride);
    const uint32_t nodes = nodes_of(map.harmonic_spacing);
    const uint64_t count = uint64_t{deposits.bricks->count} * nodes;
    uint32_t *packed = arena.make<uint32_t>(count * harmonic_words);
    if (!packed) return false;
    map.harmonics = packed;
    for (uint64_t i = 0; i < count; ++i) {
        const Cell node = cell_of_index(nodes_along(map.harmonic_spacing), static_cast<uint32_t>(i % nodes));
        const SphericalHarmonics harmonics = harmonics_at_node(deposits, static_cast<uint32_t>(i / nodes), node);
        for (const Real *m = harmonics.of; m < harmonics.of + harmonic_count; m += 3)
            *packed++ = pack_flux(Vec3(m[0], m[1], m[2]));
    }
    return true;
}

// estimate(x, light), from nothing: whether it is known there. Asked around smoke and in view only, and once of a node
// that several bricks hold.
template <class Estimate>
Irradiance make_irradiance_of(const IrradianceRequest &request, Arena &arena, Estimate &&estimate) {
    const SparseGrid &bricks = *request.bricks;
    const int32_t stride = request.stride;
    Irradiance map = {};
    map.bricks = &bricks;
    Points points;
    if (!make_points(bricks, stride, request.flux, arena, points)) return map;
    for (uint64_t i = 0; i < points.count; ++i) points.known[i] = false;
    // Sharpening reads two nodes beyond what is seen: where those are known must not depend on the crop.
    const Vec3 reach = bricks.cell * Real(3 * stride);
    for (uint32_t b = 0; b < bricks.count; ++b) {
        const Vec3 low = low_of(bricks, b);
        const bool seen = request.view.may_see({low - reach, low + bricks.lattice.edge + reach});
        for (uint32_t k = 0; k < points.nodes; ++k) {
            const Cell at = cell_of_index(points.along, k), node = {at.x * stride, at.y * stride, at.z * stride};
            const uint64_t here = uint64_t{b} * points.nodes + k;
            points.radiance[here] = Color(Real(0));
            if (points.flux) points.flux[here] = 0;
            if (!seen || !meets_smoke(*request.medium, bricks, b, node, stride)) continue;
            uint64_t before = here;
            for_each_holder(bricks, bricks.place[b], at, points.along, [&](uint32_t other, uint32_t there) {
                const uint64_t its = uint64_t{other} * points.nodes + there;
                if (other < b && points.known[its]) before = its;
            });
            points.known[here] = before != here;
            if (before != here) {
                points.radiance[here] = points.radiance[before];
                if (points.flux) points.flux[here] = points.flux[before];
                continue;
            }
            FluenceAndFlux light = {Color(Real(0)), Vec3(Real(0))};
            points.known[here] = estimate(node_of(bricks, b, node), light);
            points.radiance[here] = light.radiance;
            if (points.flux) points.flux[here] = pack_flux(light.flux);
        }
    }
    finish(*request.medium, points, interpolated, request.tolerance, arena, map);
    return map;
}

} // namespace

uint64_t irradiance_bytes(const Scene &scene, uint64_t bricks, int32_t stride, bool flux, bool harmonics) {
    const uint64_t points = bricks * nodes_of(stride);
    uint64_t bytes = 3 * Arena::bytes<int32_t>(bricks) + (flux ? 2 : 1) * Arena::bytes<uint32_t>(points) +
                     Arena::bytes<bool>(points) + 3 * Arena::bytes<Color>(points);
    if (harmonics) bytes += Arena::bytes<uint32_t>(bricks * nodes_of(harmonic_spacing(stride)) * harmonic_words);
    bytes += Arena::bytes<FluenceAndFlux *>(scene.smoke_count);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) bytes += Arena::bytes<FluenceAndFlux>(elements_of(scene.smokes[i]));
    return bytes;
}

Irradiance make_irradiance(const Medium &medium, const FluenceSums &deposits, Real tolerance, Arena &arena) {
    Irradiance map = {};
    map.bricks = deposits.bricks;
    map.of_light = true;
    map.single_channel = deposits.channels == 1;
    map.color = deposits.photon_color;
    Points points;
    if (!make_points(*deposits.bricks, deposits.stride, deposits.flux != nullptr, arena, points)) return map;
    for (uint64_t i = 0; i < points.count; ++i) {
        const Cell node = cell_of_index(points.along, static_cast<uint32_t>(i % points.nodes));
        const FluenceAndFlux light = light_at_node(deposits, static_cast<uint32_t>(i / points.nodes), node);
        points.radiance[i] = light.radiance;
        if (points.flux) points.flux[i] = pack_flux(light.flux);
        points.known[i] = tells(*deposits.bricks, static_cast<uint32_t>(i / points.nodes), node, deposits.stride);
    }
    if (deposits.harmonics && !pack_harmonics(deposits, arena, map)) return map;
    finish(medium, points, scattered_and_interpolated, tolerance, arena, map);
    return map;
}

Irradiance make_irradiance(const IrradianceRequest &request, const PhotonMap *maps, const Real *radius, Gather &gather,
                           Arena &arena, Statistics &statistics) {
    const Medium &medium = *request.medium;
    return make_irradiance_of(request, arena, [&](const Vec3 &x, FluenceAndFlux &light) {
        Vec3 flux(Real(0));
        for (uint32_t s = 0; s < medium.count; ++s) {
            const FluenceAndFlux there = estimate_fluence(maps[s], x, radius[s], gather, statistics);
            const Color scattered = medium.smokes[s].albedo * there.radiance;
            light.radiance += scattered;
            flux += there.flux * (scattered.x + scattered.y + scattered.z);
        }
        const Real all = light.radiance.x + light.radiance.y + light.radiance.z;
        if (all > Real(0)) light.flux = flux / all;
        return true;
    });
}

Irradiance make_irradiance(const IrradianceRequest &request, const PackedMap &packed, Arena &arena) {
    const Medium &medium = *request.medium;
    FluenceAndFlux **lights = arena.make<FluenceAndFlux *>(medium.count);
    if (!lights) return {};
    for (uint32_t s = 0; s < medium.count; ++s) {
        const uint32_t count = packed.per_smoke[s].count;
        lights[s] = arena.make<FluenceAndFlux>(count);
        if (!lights[s]) return {};
        for (uint32_t i = 0; i < count; ++i) lights[s][i] = light_of_element(packed, medium.smokes[s], s, i);
    }
    Irradiance map = make_irradiance_of(request, arena, [&](const Vec3 &x, FluenceAndFlux &light) {
        Real sigma = Real(0);
        Vec3 flux(Real(0));
        for (uint32_t s = 0; s < medium.count; ++s)
            for_each_extinction(medium.smokes[s].field, x, [&](uint32_t element, Real part) {
                const FluenceAndFlux &there = lights[s][element];
                sigma += part;
                light.radiance += there.radiance * part;
                flux += there.flux * (part * (there.radiance.x + there.radiance.y + there.radiance.z));
            });
        const Real all = light.radiance.x + light.radiance.y + light.radiance.z;
        if (all > Real(0)) light.flux = flux / all;
        if (sigma > Real(0)) light.radiance = light.radiance / sigma;
        return sigma > Real(0);
    });
    map.of_light = true;
    return map;
}

FluenceAndFlux light_at(const Irradiance &irradiance, uint32_t brick, const Vec3 &p) {
    const int32_t stride = irradiance.stride[brick], first = irradiance.first[brick];
    const int32_t exponent = irradiance.exponent[brick];
    const GridPlace at = place_of(p, stride);
    const uint32_t *value = irradiance.value + first;
    FluenceAndFlux light = {Color(Real(0)), Vec3(Real(0))};
    if (irradiance.single_channel) {
        const Real single_channel =
            between_nodes(at, stride, [value](uint32_t node) { return Real(static_cast<int32_t>(value[node])); });
        light.radiance = irradiance.color * scale_pow2(single_channel, exponent - single_channel_bits);
    } else {
        for (int32_t c = 0; c < 3; ++c)
            light.radiance[c] =
                between_nodes(at, stride, [&](uint32_t node) { return unpack_color(value[node], exponent)[c]; });
    }
    if (!irradiance.flux) return light;
    const uint32_t *flux = irradiance.flux + first;
    for (int32_t c = 0; c < 3; ++c)
        light.flux[c] = between_nodes(at, stride, [&](uint32_t node) { return unpack_flux(flux[node])[c]; });
    return light;
}

Color scattered_light(const Irradiance &irradiance, const Medium &medium, const Vec3 &x, const Vec3 &out,
                      const Real *extinctions) {
    Color sum(Real(0));
    const SparseGrid &bricks = *irradiance.bricks;
    const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
    if (brick == no_brick) return sum;
    const FluenceAndFlux light = light_at(irradiance, brick, position_in(bricks, brick, x));
    Color weight(Real(0)), uneven(Real(0)); // sum of sigma_s, and of sigma_s p 4 pi
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (!(extinctions[i] > Real(0))) continue;
        const SmokeVolume &smoke = medium.smokes[i];
        const Real p = irradiance.flux ? phase_of_flux(smoke.phase, light.flux, out) * four_pi<Real> : Real(1);
        weight += smoke.albedo * extinctions[i];
        uneven += smoke.albedo * (extinctions[i] * p);
    }
    if (irradiance.of_light) return light.radiance * uneven;
    for (int32_t c = 0; c < 3; ++c)
        if (weight[c] > Real(0)) sum[c] = light.radiance[c] * (uneven[c] / weight[c]);
    return sum;
}

} // namespace wisp::WISP_ARITH
