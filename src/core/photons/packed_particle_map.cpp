// Packing sums of deposits into entries of 4 or 8 bytes, and making source functions of them (S4-3).
#include "core/numbers/double_bits.h"
#include "core/photons/packed_particle_map.h"

namespace wisp::WISP_ARITH {

namespace {

int32_t length_of(int64_t x) { return x == 0 ? 0 : 64 - detail::leading_zeros(static_cast<uint64_t>(x)); }

// n / 2^shift, rounded to nearest; n >= 0.
uint32_t shifted(int64_t n, int32_t shift) {
    if (shift <= 0) return static_cast<uint32_t>(n << -shift);
    return static_cast<uint32_t>(min(((n >> (shift - 1)) + 1) >> 1, int64_t{0xffffffff}));
}

// The packed direction of an element's light: its flux relative to the power, or its mean direction of length 1.
uint32_t direction_of(const Deposits &deposits, const Color &photon_color, uint32_t element) {
    const int64_t *sum = deposits.power + uint64_t{element} * deposits.channels;
    const int64_t *flux = deposits.flux + uint64_t{element} * 3;
    const bool one_channel = deposits.channels == 1;
    const int64_t power = one_channel ? *sum : wrapped_sum(sum[0], wrapped_sum(sum[1], sum[2]));
    if (power <= 0) return 0;
    const Vec3 sum_of_directions(photons_of(flux[0]), photons_of(flux[1]), photons_of(flux[2]));
    if (deposits.direction_kind == Direction::mean) {
        const Real largest_component = largest(max(sum_of_directions, -sum_of_directions));
        if (!(largest_component > photons_of(power) * Real(0x1p-16)))
            return 0; // a sum of rounding errors: light from all sides
        return pack_flux(normalize(sum_of_directions / largest_component));
    }
    const Real all = photons_of(power) * (one_channel ? photon_color.x + photon_color.y + photon_color.z : Real(1));
    return pack_flux(sum_of_directions / all);
}

bool pack_entries(const Deposits &deposits, const Color &photon_color, MapEntries &entries, Watch watch) {
    int64_t largest_sum[3] = {0, 0, 0};
    watch.expect(deposits.count);
    for (uint64_t i = 0; i < uint64_t{deposits.count} * deposits.channels && (i % 1024 != 0 || watch.go_on(16)); ++i) {
        int64_t &largest_of_channel = largest_sum[i % deposits.channels];
        largest_of_channel = max(largest_of_channel, deposits.power[i]);
    }
    const bool one_channel = deposits.channels == 1;
    const int32_t length = length_of(largest_sum[0]);
    const auto color_of = [](const int64_t *sum) {
        return Color(photons_of(sum[0]), photons_of(sum[1]), photons_of(sum[2]));
    };
    const int32_t of_one = length - deposit_bits;
    entries.scale = one_channel ? ColorScale{{of_one, of_one, of_one}} : scale_for(color_of(largest_sum));
    for (uint32_t i = 0; i < deposits.count; ++i) {
        const int64_t *sum = deposits.power + uint64_t{i} * deposits.channels;
        entries.power[i] = one_channel ? shifted(*sum, length - 32) : pack_color(color_of(sum), entries.scale);
        if (entries.direction) entries.direction[i] = direction_of(deposits, photon_color, i);
        if (!watch.done_round(i, 1024)) return false;
    }
    return true;
}

// The power of an element, in 2^exponent photons.
Color power_of(const PackedMap &map, const MapEntries &entries, uint32_t element, int32_t exponent) {
    const uint32_t power = entries.power[element];
    if (map.one_channel)
        return map.photon_color * scaled_integer<Real>(power, entries.scale.strongest() - exponent - 32);
    return unpack_color(power, entries.scale, exponent);
}

// The flux at an element, relative to its power. A mean direction counts as the whole flux, as in the paper.
Vec3 flux_of(const PackedMap &map, const MapEntries &entries, uint32_t element) {
    const Vec3 flux = unpack_flux(entries.direction[element]);
    return map.direction_kind == Direction::mean && entries.direction[element] != 0 ? normalize(flux) : flux;
}

struct Element {
    Vec3 position;
    Real cross_section; // the integral of its contribution to sigma_t
};
Element element_of(const SmokeVolume &smoke, uint32_t index) {
    if (smoke.field.is_grid()) {
        const GridField &grid = smoke.field.grid;
        const Vec3 &edge = grid.between.edge;
        return {position_of_sample(grid, index), grid.extinction[index] * edge.x * edge.y * edge.z};
    }
    const PointTree &tree = smoke.field.particles.tree;
    return {Vec3(tree.x[index], tree.y[index], tree.z[index]),
            to_real<Real>(smoke.source->particles[tree.id[index]].area)};
}

// power / cross-section * 2^exponent * unit. Half of the scaling comes before the division: in fixed point no
// intermediate result leaves the range.
Color per_cross_section(const Color &power, Real cross_section, const PhotonUnit &unit) {
    const int32_t half = unit.exponent / 2;
    return scale_pow2(scale_pow2(power, half) * unit.unit / cross_section, unit.exponent - half);
}

// The sum of p Phi over the light that was scattered before, towards the eye, per cross-section of an element.
Color multiple_scattering(const PackedMap &map, const SmokeVolume &smoke, uint32_t index, uint32_t i,
                          const Element &element, const Vec3 &eye) {
    if (!map.per_smoke) return Color(Real(0));
    const MapEntries &entries = map.per_smoke[index];
    const Color power = power_of(map, entries, i, 0);
    if (!(largest(power) > Real(0))) return power;
    Real p = inv_four_pi<Real>;
    if (entries.direction) {
        const Vec3 to_eye = eye - element.position;
        const Real distance = length(to_eye);
        if (distance > Real(0)) p = phase_of_flux(smoke.phase, flux_of(map, entries, i), to_eye / distance);
    }
    return per_cross_section(power * p, element.cross_section, map.unit);
}

// Makes a photon map of the elements of one smoke that carry power. False: the arena was too small.
bool make_element_map(const PackedMap &map, const SmokeVolume &smoke, const MapEntries &entries, Arena &arena,
                      Watch watch, PhotonMap &elements) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < entries.count; ++i) count += entries.power[i] != 0 ? 1 : 0;
    const uint32_t slots = point_tree_slots(count);
    Color *power = arena.make<Color>(slots);
    Vec3 *flux = entries.direction ? arena.make<Vec3>(slots) : nullptr;
    Vec3 *points = arena.make<Vec3>(count);
    uint32_t *origin = arena.make<uint32_t>(count);
    if (!power || (entries.direction && !flux) || !points || !origin) return false;
    uint32_t next = 0;
    for (uint32_t i = 0; i < entries.count; ++i) {
        if (i % 1024 == 0 && !watch.go_on(64)) return false;
        if (entries.power[i] == 0) continue;
        origin[next] = i;
        points[next++] = element_of(smoke, i).position;
    }
    elements = {};
    elements.tree = build_point_tree(points, count, arena, watch);
    if (!elements.tree.ready) return false;
    const int32_t strongest = entries.scale.strongest();
    for (uint32_t slot = 0; slot < count; ++slot) {
        if (slot % 1024 == 0 && !watch.go_on(256)) return false;
        const uint32_t i = origin[elements.tree.id[slot]];
        power[slot] = power_of(map, entries, i, strongest);
        if (flux) flux[slot] = flux_of(map, entries, i);
    }
    elements.power = power;
    elements.direction = flux;
    elements.fluxes = true;
    elements.unit = {map.unit.unit, map.unit.exponent + strongest};
    return true;
}

} // namespace

FluenceAndFlux light_of_element(const PackedMap &map, const SmokeVolume &smoke, uint32_t index, uint32_t element) {
    const MapEntries &entries = map.per_smoke[index];
    const Real cross_section = element_of(smoke, element).cross_section;
    if (!(cross_section > Real(0))) return {Color(Real(0)), Vec3(Real(0))};
    const Color power = power_of(map, entries, element, 0) * inv_four_pi<Real>;
    return {per_cross_section(power, cross_section, map.unit),
            entries.direction ? flux_of(map, entries, element) : Vec3(Real(0))};
}

bool make_packed_map(const Scene &scene, const PhotonNeeds &needs, Direction direction_kind, Arena &arena,
                     PackedMap &packed) {
    packed = {};
    if (!needs.traced) return true;
    packed.per_smoke = arena.make<MapEntries>(scene.smoke_count);
    if (!packed.per_smoke) return false;
    packed.count = scene.smoke_count;
    packed.one_channel = !needs.powers;
    packed.direction_kind = direction_kind;
    for (uint32_t i = 0; i < packed.count; ++i) {
        const bool directions = total_order_key(scene.smokes[i].asymmetry) != 0;
        MapEntries &entries = packed.per_smoke[i];
        entries = {};
        entries.count = elements_of(scene.smokes[i]);
        entries.power = arena.make<uint32_t>(entries.count);
        if (directions) entries.direction = arena.make<uint32_t>(entries.count);
        if (!entries.power || (directions && !entries.direction)) return false;
    }
    return true;
}

uint64_t packed_map_bytes(const Scene &scene, const PhotonNeeds &needs) {
    if (!needs.traced) return 0;
    uint64_t bytes = Arena::bytes<MapEntries>(scene.smoke_count);
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        bytes += Arena::bytes<uint32_t>(elements_of(scene.smokes[i])) *
                 (total_order_key(scene.smokes[i].asymmetry) != 0 ? 2 : 1);
    return bytes;
}

uint64_t bytes_of(const PackedMap &map) {
    uint64_t bytes = 0;
    for (uint32_t i = 0; map.per_smoke && i < map.count; ++i)
        bytes += uint64_t{map.per_smoke[i].count} * (map.per_smoke[i].direction ? 8 : 4);
    return bytes;
}

bool pack_map(const ParticleMap &map, PackedMap &packed, Watch watch) {
    packed.photon_color = map.photon_color;
    packed.unit = map.unit;
    if (!map.per_smoke) packed.per_smoke = nullptr;
    for (uint32_t i = 0; packed.per_smoke && i < packed.count; ++i)
        if (!pack_entries(map.per_smoke[i], map.photon_color, packed.per_smoke[i], watch)) return false;
    return true;
}

const Color *const *make_sources(const Scene &scene, const Medium &medium, const PackedMap &map, const Vec3 &eye,
                                 Arena &arena, Watch watch) {
    const Color **sources = arena.make<const Color *>(medium.count);
    if (!sources) return nullptr;
    for (uint32_t s = 0; s < medium.count; ++s) {
        const SmokeVolume &smoke = medium.smokes[s];
        const uint32_t count = elements_of(scene.smokes[s]);
        Color *source = arena.make<Color>(count);
        if (!source) return nullptr;
        sources[s] = source;
        const Color emission = (Color(Real(1)) - smoke.albedo) * smoke.emission;
        watch.expect(uint64_t{count} * 2);
        for (uint32_t i = 0; i < count; ++i) {
            if (i % 64 == 63 && !watch.done(128)) return nullptr;
            const Element element = element_of(smoke, i);
            source[i] = Color(Real(0));
            if (element.cross_section > Real(0))
                source[i] = smoke.albedo * multiple_scattering(map, smoke, s, i, element, eye) + emission;
        }
    }
    return sources;
}

bool make_element_maps(const Medium &medium, const PackedMap &map, Arena &arena, const PhotonMap *&maps, Watch watch) {
    maps = nullptr;
    if (!map.per_smoke) return true;
    PhotonMap *per_smoke = arena.make<PhotonMap>(medium.count);
    if (!per_smoke) return false;
    for (uint32_t i = 0; i < medium.count; ++i)
        if (!make_element_map(map, medium.smokes[i], map.per_smoke[i], arena, watch, per_smoke[i])) return false;
    maps = per_smoke;
    return true;
}

uint64_t element_map_bytes(const Scene &scene) {
    uint64_t bytes = Arena::bytes<PhotonMap>(scene.smoke_count);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const uint32_t count = elements_of(scene.smokes[i]), slots = point_tree_slots(count);
        bytes += 2 * Arena::bytes<Vec3>(slots) + Arena::bytes<Vec3>(count) + Arena::bytes<uint32_t>(count) +
                 point_tree_bytes(count);
    }
    return bytes;
}

uint64_t source_bytes(const Scene &scene) {
    uint64_t bytes = Arena::bytes<const Color *>(scene.smoke_count);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) bytes += Arena::bytes<Color>(elements_of(scene.smokes[i]));
    return bytes;
}

} // namespace wisp::WISP_ARITH
