// Making the irradiance map, and interpolating in it (S4-4).
#include "core/photons/irradiance_map.h"

namespace wisp::WISP_ARITH {

namespace {

// Of work: a point that is sharpened or packed, one that is read from the fluence grid, one that is estimated.
constexpr uint32_t units_of_point = 4, units_of_light = 8, units_of_estimate = 256;

// Whether a brick's nodes at every `coarse` cells suffice: interpolated, they are within `tolerance` of its nodes at
// every `fine` cells.
bool suffices(const Color *light, int32_t fine, int32_t coarse, const Color &tolerance) {
    const int32_t n = nodes_along(fine), ratio = coarse / fine;
    for (int32_t z = 0; z < n; ++z)
        for (int32_t y = 0; y < n; ++y)
            for (int32_t x = 0; x < n; ++x) {
                const Color &here = light[(z * n + y) * n + x];
                const CellPosition at = find_cell(Vec3(Real(x * fine), Real(y * fine), Real(z * fine)), coarse);
                const int32_t m = nodes_along(coarse);
                for (int32_t c = 0; c < 3; ++c) {
                    const Real between = between_nodes(at, coarse, [&](uint32_t node) {
                        const int32_t i = static_cast<int32_t>(node);
                        const int32_t cx = i % m * ratio, cy = i / m % m * ratio, cz = i / m / m * ratio;
                        return light[(cz * n + cy) * n + cx][c];
                    });
                    if (abs(between - here[c]) > tolerance[c]) return false;
                }
            }
    return true;
}

// By which fluxes are weighted when they are added.

// The points of all bricks before they are packed, at every `spacing` cells.
struct Points {
    const SparseGrid *bricks;
    int32_t spacing, along;
    uint32_t nodes; // of a brick
    uint64_t count;
    int32_t *first, *spacings; // of the map
    ColorScale *scale;         // of the map
    uint32_t *value, *flux;    // of the map; flux may be nullptr
    bool *known;
    Color *radiance;
    Watch watch;
};
// `units`: the work on a point.
bool make_points(const SparseGrid &bricks, int32_t spacing, bool flux, uint32_t units, Arena &arena, Watch watch,
                 Points &points) {
    points = {};
    points.watch = watch;
    watch.expect(uint64_t{bricks.count} * nodes_of(spacing) * units);
    points.bricks = &bricks;
    points.spacing = spacing;
    points.along = nodes_along(spacing);
    points.nodes = nodes_of(spacing);
    points.count = uint64_t{bricks.count} * points.nodes;
    points.first = arena.make<int32_t>(bricks.count);
    points.spacings = arena.make<int32_t>(bricks.count);
    points.scale = arena.make<ColorScale>(bricks.count);
    points.value = arena.make<uint32_t>(points.count);
    points.flux = flux ? arena.make<uint32_t>(points.count) : nullptr;
    points.known = arena.make<bool>(points.count);
    points.radiance = arena.make<Color>(points.count);
    return points.first && points.spacings && points.scale && points.value && (points.flux || !flux) && points.known &&
           points.radiance;
}

// Calls visit(brick, node of it, point), of so many units of work, for all points. False: the work is stopped.
template <class Visit> bool for_each_point(const Points &points, uint32_t units, Visit &&visit) {
    for (uint32_t brick = 0; brick < points.bricks->count; ++brick) {
        if (!points.watch.done(points.nodes * units)) return false;
        for (uint32_t k = 0; k < points.nodes; ++k) visit(brick, k, uint64_t{brick} * points.nodes + k);
    }
    return true;
}

// Trilinear interpolation blurs the nodes by a variance of cell^2 / 6 along every axis. A blur of variance v adds v / 2
// times the second derivative to a value. So 1/12 of the second difference, taken from the nodes, restores the mean.
constexpr Real interpolation_blur = Real(1.0 / 12);

// Calls visit(point) for both neighbours of a node along each axis on which both are known. On other axes the second
// difference counts as 0.
template <class Visit> void for_each_neighbour(const Points &points, uint32_t brick, uint32_t k, Visit &&visit) {
    const SparseGrid &bricks = *points.bricks;
    const Cell &place = bricks.position[brick];
    const int32_t n = points.along;
    const Cell node = cell_of_index(n, k);
    const auto neighbour = [&](int32_t axis, int32_t step) {
        const Cell at = {node.x + (axis == 0 ? step : 0), node.y + (axis == 1 ? step : 0),
                         node.z + (axis == 2 ? step : 0)};
        if (min(at.x, min(at.y, at.z)) > 0 && max(at.x, max(at.y, at.z)) < n - 1) { // no other brick holds it
            const uint64_t point = uint64_t{brick} * points.nodes + static_cast<uint32_t>((at.z * n + at.y) * n + at.x);
            return points.known[point] ? point : points.count;
        }
        uint64_t found = points.count;
        for_each_holder(bricks, place, at, n, [&](uint32_t other, uint32_t there) {
            const uint64_t point = uint64_t{other} * points.nodes + there;
            if (points.known[point]) found = point;
        });
        return found;
    };
    for (int32_t axis = 0; axis < 3; ++axis) {
        const uint64_t before = neighbour(axis, -1), behind = neighbour(axis, 1);
        if (before == points.count || behind == points.count) continue;
        visit(before);
        visit(behind);
    }
}

// Subtracts 1/12 of its second differences from each known node. This is an exchange between neighbours: the darker of
// two passes 1/12 of their difference to the brighter one. A node that should pass more than it has
// passes less, the same fraction to each neighbour. So no light is lost inside, and no value falls below 0. False: the
// arena was too small.
bool sharpen(Points &points, Arena &arena) {
    Color *sharp = arena.make<Color>(points.count), *fraction = arena.make<Color>(points.count);
    if (!sharp || !fraction) return false;
    const bool found = for_each_point(points, units_of_point, [&](uint32_t brick, uint32_t k, uint64_t i) {
        fraction[i] = Color(Real(1)); // what the node can pass, of what it should
        if (!points.known[i]) return;
        const Color &here = points.radiance[i];
        Color wanted(Real(0));
        for_each_neighbour(points, brick, k, [&](uint64_t other) {
            wanted += max(points.radiance[other] - here, Color(Real(0))) * interpolation_blur;
        });
        for (int32_t c = 0; c < 3; ++c)
            if (wanted[c] > here[c]) fraction[i][c] = here[c] / wanted[c];
    });
    if (!found) return false;
    const bool sharpened = for_each_point(points, units_of_point, [&](uint32_t brick, uint32_t k, uint64_t i) {
        sharp[i] = points.radiance[i];
        if (!points.known[i]) return;
        for_each_neighbour(points, brick, k, [&](uint64_t other) {
            const Color loss = (points.radiance[other] - points.radiance[i]) * interpolation_blur;
            for (int32_t c = 0; c < 3; ++c)
                sharp[i][c] -= loss[c] * (loss[c] > Real(0) ? fraction[i][c] : fraction[other][c]);
        });
        sharp[i] = max(sharp[i], Color(Real(0))); // rounding may leave less than 0
    });
    points.radiance = sharp;
    return sharpened;
}

// Packs the points of each brick, as few as the tolerance allows. The thinner the smoke of a brick, the less its light
// matters: the tolerance is divided by the brick's optical depth, if that is below 1.
void pack_points(const Medium &medium, Points &points, Real tolerance, Irradiance &map) {
    const int32_t n = points.along;
    const SparseGrid &bricks = *points.bricks;
    for (uint32_t b = 0; b < bricks.count; ++b) {
        if (!points.watch.go_on(points.nodes * units_of_point)) return;
        const Color *light = points.radiance + uint64_t{b} * points.nodes;
        Color greatest(Real(0));
        for (uint32_t i = 0; i < points.nodes; ++i) greatest = max(greatest, light[i]);
        int32_t spacing = points.spacing;
        if (tolerance > Real(0) && !has_cut_cell(map.cut, b)) {
            const Vec3 low = low_of(bricks, b);
            const Real most = majorant(medium, {low, low + bricks.lattice.edge});
            const Real depth = max(min(most * largest(bricks.lattice.edge), Real(1)), tolerance);
            while (spacing < brick_cells && suffices(light, points.spacing, 2 * spacing, greatest * tolerance / depth))
                spacing *= 2;
        }
        points.first[b] = static_cast<int32_t>(map.points);
        points.spacings[b] = spacing;
        points.scale[b] = scale_for(map.single_channel ? Color(largest(greatest)) : greatest);
        const int32_t ratio = spacing / points.spacing, m = nodes_along(spacing),
                      unit = single_channel_bits - points.scale[b].exponent[0];
        for (uint32_t k = 0; k < nodes_of(spacing); ++k) {
            const Cell node = cell_of_index(m, k);
            const size_t from = static_cast<size_t>((node.z * ratio * n + node.y * ratio) * n + node.x * ratio);
            points.value[map.points] = map.single_channel
                                           ? static_cast<uint32_t>(round_to_int(scale_pow2(largest(light[from]), unit)))
                                           : pack_color(light[from], points.scale[b]);
            // Fluxes are packed in place: no value is overwritten before it is read.
            if (points.flux) points.flux[map.points] = points.flux[uint64_t{b} * points.nodes + from];
            ++map.points;
        }
    }
    map.first = points.first;
    map.spacing = points.spacings;
    map.scale = points.scale;
    map.value = points.value;
    map.flux = points.flux;
    map.ready = true;
}

// Gives unknown points the mean of their known neighbours in the brick, and its flux. A node on a hard face is unknown
// where rounding puts it outside.
void fill_unknown(Points &points, const CutCells &cut, uint32_t brick) {
    const bool parted = has_cut_cell(cut, brick);
    const int32_t n = points.along;
    Color *radiance = points.radiance + uint64_t{brick} * points.nodes;
    const bool *known = points.known + uint64_t{brick} * points.nodes;
    uint32_t *flux = points.flux ? points.flux + uint64_t{brick} * points.nodes : nullptr;
    for (uint32_t k = 0; k < points.nodes; ++k) {
        if (known[k]) continue;
        const Cell node = cell_of_index(n, k);
        Color sum(Real(0));
        Vec3 sum_of_fluxes(Real(0));
        int32_t count = 0;
        for (int32_t z = max(node.z - 1, 0); z <= min(node.z + 1, n - 1); ++z)
            for (int32_t y = max(node.y - 1, 0); y <= min(node.y + 1, n - 1); ++y)
                for (int32_t x = max(node.x - 1, 0); x <= min(node.x + 1, n - 1); ++x) {
                    const size_t i = static_cast<size_t>((z * n + y) * n + x);
                    if (!known[i] || (parted && are_parted(cut, brick, node, {x, y, z}))) continue;
                    sum += radiance[i];
                    if (flux) sum_of_fluxes += unpack_flux(flux[i]) * all_channels(radiance[i]);
                    ++count;
                }
        if (count > 0) radiance[k] = sum / Real(count);
        const Real all = all_channels(sum);
        if (flux && all > Real(0)) flux[k] = pack_flux(sum_of_fluxes / all);
    }
}

bool fill_all_unknown(Points &points, const CutCells &cut) {
    for (uint32_t b = 0; b < points.bricks->count; ++b) {
        if (!points.watch.go_on(points.nodes)) return false;
        fill_unknown(points, cut, b);
    }
    return true;
}

// Makes the map of the known points; it is not ready if the work is stopped.
void finish(const Medium &medium, Points &points, Real tolerance, Irradiance &map) {
    if (fill_all_unknown(points, map.cut)) pack_points(medium, points, tolerance, map);
}

// False: the arena was too small.
bool pack_harmonics(const FluenceSums &fluence, Arena &arena, Watch watch, Irradiance &map) {
    map.harmonic_spacing = harmonic_spacing(fluence.spacing);
    const uint32_t nodes = nodes_of(map.harmonic_spacing);
    uint32_t *packed = arena.make<uint32_t>(uint64_t{fluence.bricks->count} * nodes * harmonic_words);
    if (!packed) return false;
    map.harmonics = packed;
    for (uint32_t brick = 0; brick < fluence.bricks->count; ++brick) {
        if (!watch.go_on(nodes * 4 * units_of_point)) return false;
        for (uint32_t k = 0; k < nodes; ++k) {
            const SphericalHarmonics harmonics =
                harmonics_at_node(fluence, brick, cell_of_index(nodes_along(map.harmonic_spacing), k));
            for (const Real *m = harmonics.value; m < harmonics.value + harmonic_count; m += 3)
                *packed++ = pack_flux(Vec3(m[0], m[1], m[2]));
        }
    }
    return true;
}

// A function (x, light), which adds to a light of 0 and returns whether the light is known at x.
struct Estimate {
    template <class Function>
    explicit Estimate(const Function &function)
        : function_(&function), call_([](const void *estimate, const Vec3 &x, FluenceAndFlux &light) {
              return (*static_cast<const Function *>(estimate))(x, light);
          }) {}
    bool operator()(const Vec3 &x, FluenceAndFlux &light) const { return call_(function_, x, light); }

  private:
    const void *function_;
    bool (*call_)(const void *, const Vec3 &, FluenceAndFlux &);
};

// Makes a map of an estimate, which is called only for nodes around smoke and in view, and once for a node that several
// bricks hold.
Irradiance make_irradiance_of(const IrradianceRequest &request, Arena &arena, Watch watch, const Estimate &estimate) {
    const SparseGrid &bricks = *request.bricks;
    const int32_t spacing = request.spacing;
    Irradiance map = {};
    map.bricks = &bricks;
    Points points;
    if (!make_points(bricks, spacing, request.flux, 3 * units_of_point, arena, watch, points)) return map;
    for (uint64_t i = 0; i < points.count; ++i) points.known[i] = false;
    // Sharpening reads two nodes beyond the view. Whether these are known must not depend on the crop.
    const Vec3 reach = bricks.cell * Real(3 * spacing);
    for (uint32_t b = 0; b < bricks.count; ++b) {
        const Vec3 low = low_of(bricks, b);
        const bool in_view = request.view.may_see({low - reach, low + bricks.lattice.edge + reach});
        if (!watch.done(points.nodes * units_of_point)) return map;
        for (uint32_t k = 0; k < points.nodes; ++k) {
            const Cell at = cell_of_index(points.along, k), node = {at.x * spacing, at.y * spacing, at.z * spacing};
            const uint64_t here = uint64_t{b} * points.nodes + k;
            points.radiance[here] = Color(Real(0));
            if (points.flux) points.flux[here] = 0;
            if (!in_view || !meets_smoke(*request.medium, bricks, b, node, spacing)) continue;
            uint64_t before = here;
            for_each_holder(bricks, bricks.position[b], at, points.along, [&](uint32_t other, uint32_t there) {
                const uint64_t point = uint64_t{other} * points.nodes + there;
                if (other < b && points.known[point]) before = point;
            });
            points.known[here] = before != here;
            if (before != here) {
                points.radiance[here] = points.radiance[before];
                if (points.flux) points.flux[here] = points.flux[before];
                continue;
            }
            FluenceAndFlux light = {Color(Real(0)), Vec3(Real(0))};
            if (!watch.go_on(units_of_estimate)) return map;
            points.known[here] = estimate(node_of(bricks, b, node), light);
            points.radiance[here] = light.radiance;
            if (points.flux) points.flux[here] = pack_flux(light.flux);
        }
    }
    if (sharpen(points, arena)) finish(*request.medium, points, request.tolerance, map);
    return map;
}

} // namespace

uint64_t irradiance_bytes(const Scene &scene, uint64_t bricks, int32_t spacing, bool flux, bool of_fluence,
                          bool harmonics, uint64_t of_line) {
    const uint64_t points = bricks * nodes_of(spacing);
    uint64_t bytes = 2 * Arena::bytes<int32_t>(bricks) + Arena::bytes<ColorScale>(bricks) +
                     (flux ? 2 : 1) * Arena::bytes<uint32_t>(points) + Arena::bytes<bool>(points) +
                     (of_fluence ? 1 : 3) * Arena::bytes<Color>(points);
    if (of_fluence) bytes += tent_bytes(bricks, spacing);
    if (of_line > 0) bytes += line_sweep_bytes(bricks, of_line, spacing, !flux);
    if (harmonics) bytes += Arena::bytes<uint32_t>(bricks * nodes_of(harmonic_spacing(spacing)) * harmonic_words);
    if (of_fluence) return bytes;
    bytes += Arena::bytes<FluenceAndFlux *>(scene.smoke_count);
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        bytes += Arena::bytes<FluenceAndFlux>(elements_of(scene.smokes[i]));
    return bytes;
}

namespace {

// Irradiance::variance of light that is not gathered along lines (README, Noise).
Real relative_variance(const FluenceSums &fluence) {
    constexpr Real of_tents = Real(151.0 / 315 * 151 / 315) * inv_four_pi<Real>;
    Real scattered = Real(0);
    for (uint32_t s = 0; s < fluence.medium->count; ++s) {
        const SmokeVolume &smoke = fluence.medium->smokes[s];
        const Real g = smoke.phase.asymmetry(), narrow = (Real(1) - g) * (Real(1) + g);
        const Real uneven = (Real(1) + g * g) / narrow / narrow;
        scattered =
            max(scattered, largest(smoke.albedo) * (fluence.largest > Real(0) ? min(uneven, fluence.largest) : uneven));
    }
    const Vec3 cell = fluence.bricks->cell * Real(fluence.spacing);
    const Real least_area = cell.x * cell.y * cell.z / largest(cell);
    return scale_pow2(fluence.photon.unit * of_tents * scattered / least_area, fluence.photon.exponent);
}
// What lines leave of it: more where they gather once (README, Twice).
Real left_by_lines(const Phase &phase) { return phase.isotropic() ? Real(0.1) : Real(0.4); }

} // namespace

Irradiance make_irradiance(const Medium &medium, const FluenceSums &sums, const LineGather &gather, Real tolerance,
                           Arena &arena, Watch watch) {
    Irradiance map = {};
    FluenceSums fluence = sums;
    map.bricks = fluence.bricks;
    map.incident = true;
    map.single_channel = fluence.channels == 1;
    map.color = fluence.photon_color;
    map.cut = fluence.cut;
    map.one_eye = fluence.one_eye;
    map.variance = relative_variance(fluence);
    Points points;
    if (!make_points(*fluence.bricks, fluence.spacing, fluence.flux != nullptr, units_of_light, arena, watch, points))
        return map;
    if (!find_tents(fluence, arena, watch)) return map;
    const bool read = for_each_point(points, units_of_light, [&](uint32_t brick, uint32_t k, uint64_t i) {
        const Cell node = cell_of_index(points.along, k);
        FluenceAndFlux light;
        points.known[i] = light_at_node(fluence, brick, node, light);
        points.radiance[i] = light.radiance;
        if (points.flux) points.flux[i] = pack_flux(light.flux);
    });
    if (!read) return map;
    if (fluence.harmonics && !pack_harmonics(fluence, arena, watch, map)) return map;
    const LineSweep sweep = {&medium,    gather.depths, fluence.spacing, fluence.sigma_shift, common_phase(medium),
                             gather.eye, gather.turns,  gather.seed};
    if (has(parts::photons) && gather.depths &&
        suits_lines(number_of(fluence.bricks->lattice.count), fluence.bricks->count)) {
        if (!fill_all_unknown(points, map.cut)) return map;
        const LightOfPhotons light = {points.known, points.radiance, points.flux, map.harmonics, map.harmonic_spacing};
        if (!sweep_lines(sweep, light, arena, watch)) return map;
        map.variance *= left_by_lines(sweep.phase);
        points.flux = nullptr;
        map.harmonics = nullptr;
    }
    finish(medium, points, tolerance, map);
    return map;
}

namespace {

// The mean of sigma_t over a ball, by points on a lattice.
Real mean_extinction(const DensityField &field, const Vec3 &middle, Real radius) {
    constexpr int32_t along = 6; // points across the ball
    Real sum = Real(0);
    int32_t count = 0;
    for (int32_t i = 0; i < along * along * along; ++i) {
        const Cell at = cell_of_index(along, static_cast<uint32_t>(i));
        const Vec3 x =
            (Vec3(Real(2 * at.x), Real(2 * at.y), Real(2 * at.z)) - Vec3(Real(along - 1))) * (Real(1) / Real(along));
        if (dot(x, x) > Real(1)) continue;
        sum += extinction(field, middle + x * radius);
        ++count;
    }
    return sum / Real(count);
}

bool is_of_grids(const Medium &medium) {
    for (uint32_t s = 0; s < medium.count; ++s)
        if (!medium.smokes[s].field.is_grid()) return false;
    return true;
}

} // namespace

// Photon maps estimate collisions, not fluence. In density grids, which may have hard faces, these are divided by the
// mean of sigma_t over their ball: so a ball that reaches out of the smoke has no less light.
Irradiance make_irradiance(const IrradianceRequest &request, const PhotonMap *maps, const Real *radius, Gather &gather,
                           Arena &arena, Statistics &statistics, Watch watch) {
    const Medium &medium = *request.medium;
    const bool incident = is_of_grids(medium);
    const auto estimate = [&](const Vec3 &x, FluenceAndFlux &light) {
        Vec3 flux(Real(0));
        Real sigma = Real(0), reach;
        for (uint32_t s = 0; s < medium.count; ++s) {
            const FluenceAndFlux of_smoke = estimate_fluence(maps[s], x, radius[s], gather, statistics, reach);
            const Color here = incident ? of_smoke.radiance : medium.smokes[s].albedo * of_smoke.radiance;
            if (incident && reach > Real(0)) sigma += mean_extinction(medium.smokes[s].field, x, reach);
            light.radiance += here;
            flux += of_smoke.flux * all_channels(here);
        }
        const Real all = all_channels(light.radiance);
        if (all > Real(0)) light.flux = flux / all;
        if (!incident) return true;
        if (sigma > Real(0)) light.radiance = light.radiance / sigma;
        return sigma > Real(0);
    };
    Irradiance map = make_irradiance_of(request, arena, watch, Estimate(estimate));
    map.incident = incident;
    return map;
}

Irradiance make_irradiance(const IrradianceRequest &request, const PackedMap &packed, Arena &arena, Watch watch) {
    const Medium &medium = *request.medium;
    FluenceAndFlux **lights = arena.make<FluenceAndFlux *>(medium.count);
    if (!lights) return {};
    for (uint32_t s = 0; s < medium.count; ++s) {
        const uint32_t count = packed.per_smoke[s].count;
        lights[s] = arena.make<FluenceAndFlux>(count);
        if (!lights[s]) return {};
        for (uint32_t i = 0; i < count && (i % 1024 != 0 || watch.go_on(2048)); ++i)
            lights[s][i] = light_of_element(packed, medium.smokes[s], s, i);
    }
    const auto estimate = [&](const Vec3 &x, FluenceAndFlux &light) {
        Real sigma = Real(0);
        Vec3 flux(Real(0));
        for (uint32_t s = 0; s < medium.count; ++s)
            for_each_extinction(medium.smokes[s].field, x, [&](uint32_t element, Real weight) {
                const FluenceAndFlux &there = lights[s][element];
                sigma += weight;
                light.radiance += there.radiance * weight;
                flux += there.flux * (weight * all_channels(there.radiance));
            });
        const Real all = all_channels(light.radiance);
        if (all > Real(0)) light.flux = flux / all;
        if (sigma > Real(0)) light.radiance = light.radiance / sigma;
        return sigma > Real(0);
    };
    Irradiance map = make_irradiance_of(request, arena, watch, Estimate(estimate));
    map.incident = true;
    return map;
}

Real nearest_read(const Irradiance &irradiance, const Ray &from_eye, Real distance) {
    const Real near = irradiance.one_eye.near;
    if (!(near > Real(0) && distance < near)) return Real(0);
    const CutCells &cut = irradiance.cut;
    TreeCounts unused = {};
    return cut.any() && is_blocked(*cut.surfaces, from_eye, Real(0), near, no_triangle, unused) ? Real(0) : near;
}

FluenceAndFlux light_at(const Irradiance &irradiance, uint32_t brick, const Vec3 &p) {
    const SparseGrid &bricks = *irradiance.bricks;
    const CutCells &cut = irradiance.cut;
    const int32_t spacing = irradiance.spacing[brick], first = irradiance.first[brick];
    const ColorScale &scale = irradiance.scale[brick];
    const CellPosition at = find_cell(p, spacing);
    CornerWeights weights;
    const bool is_cut = cut.any() && spacing == cut.spacing && cut.is_cut(brick, at.node) &&
                        find_weights_in_cut_cell(cut, brick, at, low_of(bricks, brick) + p * bricks.cell, weights);
    const auto interpolate = [&](auto &&value) {
        if (!is_cut) return between_nodes(at, spacing, value);
        Real sum = Real(0);
        for (uint32_t corner = 0; corner < 8; ++corner)
            sum += weights.of[corner] * value(at.node + offset_of_corner(corner, nodes_along(spacing)));
        return sum;
    };
    const uint32_t *value = irradiance.value + first;
    FluenceAndFlux light = {Color(Real(0)), Vec3(Real(0))};
    if (irradiance.single_channel) {
        const Real units = interpolate([value](uint32_t node) { return Real(static_cast<int32_t>(value[node])); });
        light.radiance = irradiance.color * scale_pow2(units, scale.exponent[0] - single_channel_bits);
    } else {
        for (int32_t c = 0; c < 3; ++c)
            light.radiance[c] =
                interpolate([&](uint32_t node) { return unpack_color(value[node], scale.exponent[c])[c]; });
    }
    if (!irradiance.flux) return light;
    const uint32_t *flux = irradiance.flux + first;
    for (int32_t c = 0; c < 3; ++c)
        light.flux[c] = interpolate([&](uint32_t node) { return unpack_flux(flux[node])[c]; });
    return light;
}

Color scattered_light(const Irradiance &irradiance, const Medium &medium, const Vec3 &x, const Vec3 &out,
                      const Real *extinctions) {
    Color sum(Real(0));
    const SparseGrid &bricks = *irradiance.bricks;
    Vec3 place = x;
    uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
    if (brick == no_brick) return sum;
    const Vec3 &eye = irradiance.one_eye.eye;
    if (const Real from = nearest_read(irradiance, {eye, -out}, dot(eye - x, out)); from > Real(0)) {
        const Vec3 beyond = eye - out * from;
        const uint32_t there = brick_at(bricks, cell_at(bricks.lattice, beyond));
        if (there != no_brick) place = beyond, brick = there;
    }
    const FluenceAndFlux light = light_at(irradiance, brick, position_in(bricks, brick, place));
    Color sigma_s(Real(0)), towards_out(Real(0)); // the sums of sigma_s, and of 4 pi p sigma_s
    for (uint32_t i = 0; i < medium.count; ++i) {
        if (!(extinctions[i] > Real(0))) continue;
        const SmokeVolume &smoke = medium.smokes[i];
        const Real p = irradiance.flux ? phase_of_flux(smoke.phase, light.flux, out) * four_pi<Real> : Real(1);
        sigma_s += smoke.albedo * extinctions[i];
        towards_out += smoke.albedo * (extinctions[i] * p);
    }
    if (irradiance.incident) return light.radiance * towards_out;
    for (int32_t c = 0; c < 3; ++c)
        if (sigma_s[c] > Real(0)) sum[c] = light.radiance[c] * (towards_out[c] / sigma_s[c]);
    return sum;
}

} // namespace wisp::WISP_ARITH
