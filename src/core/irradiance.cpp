// The irradiance map: made from what photons left, and read.
#include "wisp/irradiance.h"

namespace wisp::WISP_ARITH {

namespace {

// Whether a brick's light at every `fine` cells lies within `most` of that between every `coarse` cells.
bool suffices(const Color *light, int32_t fine, int32_t coarse, Real most) {
    const int32_t n = nodes_along(fine), ratio = coarse / fine;
    for (int32_t z = 0; z < n; ++z)
        for (int32_t y = 0; y < n; ++y)
            for (int32_t x = 0; x < n; ++x) {
                const Color &here = light[(z * n + y) * n + x];
                const BrickPlace at = place_of(Vec3(Real(x * fine), Real(y * fine), Real(z * fine)), coarse);
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

// Photons leave light at the nodes around them, and it is interpolated between nodes: each spreads it along every axis
// by the variance cell^2 / 6. A second difference is twice what a variance of cell^2 adds to the value, so a sixth of
// it is taken back.
Color sharpened(const BrickDeposits &deposits, const Color *radiance, uint64_t i) {
    const Bricks &bricks = *deposits.bricks;
    const int32_t n = nodes_along(deposits.stride);
    const uint32_t nodes = nodes_of(deposits.stride), brick = static_cast<uint32_t>(i / nodes);
    const Cell node = cell_of_index(n, static_cast<uint32_t>(i % nodes));
    const Color here = radiance[i];
    const Real stride = Real(deposits.stride);
    const auto beside = [&](int32_t axis, int32_t step) {
        const Color *found = nullptr;
        const Cell at = {node.x + (axis == 0 ? step : 0), node.y + (axis == 1 ? step : 0),
                         node.z + (axis == 2 ? step : 0)};
        // Where hardly any of the tent lies in the smoke's bounds no photon tells what light there is.
        const Real x = low_of(bricks, brick)[axis] + Real(axis == 0   ? at.x
                                                          : axis == 1 ? at.y
                                                                      : at.z) *
                                                         stride * bricks.cell[axis];
        const Real reach = bricks.cell[axis] * (stride * Real(15.0 / 16));
        if (x + reach < bricks.bounds.low[axis] || x - reach > bricks.bounds.high[axis]) return found;
        for_each_holder(bricks, bricks.place[brick], at, n,
                        [&](uint32_t other, uint32_t there) { found = radiance + uint64_t{other} * nodes + there; });
        return found;
    };
    Color bend(Real(0));
    for (int32_t axis = 0; axis < 3; ++axis) {
        const Color *before = beside(axis, -1), *behind = beside(axis, 1);
        if (before && behind) bend += (*before - here) + (*behind - here);
    }
    return highest(Color(Real(0)), here - bend * Real(1.0 / 6));
}

} // namespace

uint64_t irradiance_bytes(uint64_t bricks, int32_t stride, bool flux) {
    const uint64_t points = bricks * nodes_of(stride);
    return 2 * Arena::bytes<int32_t>(bricks) + (flux ? 2 : 1) * Arena::bytes<uint32_t>(points) +
           2 * Arena::bytes<Color>(points);
}

Irradiance make_irradiance(const BrickDeposits &deposits, Real tolerance, Arena &arena) {
    const Bricks &bricks = *deposits.bricks;
    const int32_t fine = deposits.stride, n = nodes_along(fine);
    const uint32_t nodes = nodes_of(fine);
    const uint64_t most = uint64_t{bricks.count} * nodes;
    Irradiance map = {};
    map.bricks = &bricks;
    map.grey = deposits.channels == 1;
    int32_t *first = arena.make<int32_t>(bricks.count), *strides = arena.make<int32_t>(bricks.count);
    uint32_t *value = arena.make<uint32_t>(most), *flux = deposits.flux ? arena.make<uint32_t>(most) : nullptr;
    const size_t mark = arena.mark();
    Color *radiance = arena.make<Color>(most), *sharp = arena.make<Color>(most);
    if (!first || !strides || !value || (deposits.flux && !flux) || !radiance || !sharp) return map;

    Real brightest = Real(0);
    for (uint64_t i = 0; i < most; ++i) {
        const NodeLight light = light_at_node(deposits, static_cast<uint32_t>(i / nodes),
                                              cell_of_index(n, static_cast<uint32_t>(i % nodes)));
        radiance[i] = light.radiance;
        brightest = max(brightest, largest(light.radiance));
        if (flux) flux[i] = pack_flux(light.flux);
    }
    for (uint64_t i = 0; i < most; ++i) sharp[i] = sharpened(deposits, radiance, i);
    radiance = sharp;
    map.exponent = exponent_for(brightest * Real(2));
    const int32_t unit = grey_bits - map.exponent;
    map.color = deposits.photon_color;
    for (uint32_t b = 0; b < bricks.count; ++b) {
        const Color *light = radiance + uint64_t{b} * nodes;
        int32_t stride = fine;
        if (tolerance > Real(0)) {
            Real greatest = Real(0);
            for (uint32_t i = 0; i < nodes; ++i) greatest = max(greatest, largest(light[i]));
            while (stride < brick_cells && suffices(light, fine, 2 * stride, greatest * tolerance)) stride *= 2;
        }
        first[b] = static_cast<int32_t>(map.points);
        strides[b] = stride;
        const int32_t ratio = stride / fine, m = nodes_along(stride);
        for (int32_t z = 0; z < m; ++z)
            for (int32_t y = 0; y < m; ++y)
                for (int32_t x = 0; x < m; ++x) {
                    const size_t from = static_cast<size_t>((z * ratio * n + y * ratio) * n + x * ratio);
                    const Color &here = light[from];
                    value[map.points] = map.grey ? static_cast<uint32_t>(round_to_int(scale_pow2(largest(here), unit)))
                                                 : pack_color(here, map.exponent);
                    if (flux) flux[map.points] = flux[uint64_t{b} * nodes + from]; // from never lies behind
                    ++map.points;
                }
    }
    arena.rewind(mark);
    map.first = first;
    map.stride = strides;
    map.value = value;
    map.flux = flux;
    map.ready = true;
    return map;
}

NodeLight light_at(const Irradiance &irradiance, uint32_t brick, const Vec3 &p) {
    const int32_t stride = irradiance.stride[brick];
    const BrickPlace at = place_of(p, stride);
    const int32_t first = irradiance.first[brick];
    const uint32_t *value = irradiance.value + first;
    NodeLight light = {Color(Real(0)), Vec3(Real(0))};
    if (irradiance.grey) {
        const Real grey =
            between_nodes(at, stride, [value](uint32_t node) { return Real(static_cast<int32_t>(value[node])); });
        light.radiance = irradiance.color * scale_pow2(grey, irradiance.exponent - grey_bits);
    } else {
        for (int32_t c = 0; c < 3; ++c)
            light.radiance[c] = between_nodes(
                at, stride, [&](uint32_t node) { return unpack_color(value[node], irradiance.exponent)[c]; });
    }
    if (!irradiance.flux) return light;
    const uint32_t *flux = irradiance.flux + first;
    for (int32_t c = 0; c < 3; ++c)
        light.flux[c] = between_nodes(at, stride, [&](uint32_t node) { return unpack_flux(flux[node])[c]; });
    return light;
}

} // namespace wisp::WISP_ARITH
