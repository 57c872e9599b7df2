// What stages have made, for a probe (wisp/probe.h). Nothing else names these functions: a program that does not show
// stages does not link them.
#include "core/geometry/camera.h"
#include "core/render/stages.h"
#include "core/shadows/proved_shadows.h"
#include "core/surfaces/tree_cells.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t units_of_point = 64; // of work

bool is_between(double x, Real low, Real high) { return to_double(low) <= x && x <= to_double(high); }
bool holds(const Box &box, const Double3 &x) {
    return is_between(x.x, box.low.x, box.high.x) && is_between(x.y, box.low.y, box.high.y) &&
           is_between(x.z, box.low.z, box.high.z);
}

// A number, and the cell in which it is found.
struct Found {
    float value = __builtin_nanf("");
    uint64_t cell = 0;
};

// Of points of smoke: value(x) and the brick.
template <class Value> Found in_smoke(const Frame &frame, const Double3 &point, Value &&value) {
    const SparseGrid *bricks = frame.state.smoke.bricks;
    if (!holds(frame.medium().bounds, point)) return {};
    const Vec3 x = vec_of(point);
    const uint32_t brick = bricks ? brick_at(*bricks, cell_at(bricks->lattice, x)) : no_brick;
    return {to_float(value(x)), brick == no_brick ? 0 : uint64_t{brick} + 1};
}

Found density(const Frame &frame, const Double3 &point) {
    return in_smoke(frame, point, [&](const Vec3 &x) { return extinction(frame.medium(), x); });
}

Found light_depth(const Frame &frame, uint32_t light, const Double3 &point) {
    return in_smoke(frame, point,
                    [&](const Vec3 &x) { return optical_depth_to_light(frame.state.smoke.depths, light, x); });
}

Found tree_cells(const Frame &frame, const Double3 &point) {
    const Real most = frame.state.surfaces.largest;
    if (!holds({Vec3(-most), Vec3(most)}, point)) return {};
    const TreeCells cells = cells_at(frame.state.surfaces, vec_of(point));
    if (!cells.found) return {};
    return {to_float(Real(static_cast<int32_t>(cells.triangles))), cells.nodes};
}

Hit first_hit(const Frame &frame, const Ray &ray) {
    TreeCounts unused = {};
    return frame.decisions.surfaces
               ? nearest_hit(frame.state.surfaces, ray, Real(0), infinite_distance, no_triangle, unused)
               : Hit{false, infinite_distance, Real(0), Real(0), no_triangle, 0};
}

Found depth_along(const Frame &frame, const Ray &ray) {
    return {to_float(optical_depth(frame.medium(), ray, first_hit(frame, ray).distance)), 0};
}

// Cells that no ray has asked for are left out: of triangles that face away from the light, or move.
Found proof(const Frame &frame, uint32_t light, const Ray &ray) {
    const Hit hit = first_hit(frame, ray);
    const bool proves = frame.shadows.technique == &exact_technique;
    if (!hit.found || hit.triangle >= frame.scene.static_count || !proves) return {};
    ShadowCells &cells = memory_of<ProvedShadows>(frame.shadows).cells;
    CellPlace place;
    const ShadowCell *cell = find_shadow_cell(cells, light, hit.triangle, hit.u, hit.v, place);
    if (!cell || (cell->rays() == 0 && cell->state() == CellState::unresolved)) return {};
    return {to_float(Real(static_cast<int32_t>(cell->state()))), static_cast<uint64_t>(cell - cells.blocks[0])};
}

void send_nodes(const Frame &frame, const Probe &probe) {
    const Irradiance &map = frame.irradiance;
    const SparseGrid &bricks = *map.bricks;
    for (uint32_t b = 0; frame.has_irradiance && b < bricks.count; ++b) {
        const int32_t spacing = map.spacing[b];
        for (uint32_t k = 0; k < nodes_of(spacing) && frame.watch.go_on(units_of_point); ++k) {
            const Cell at = cell_of_index(nodes_along(spacing), k),
                       node = {at.x * spacing, at.y * spacing, at.z * spacing};
            const Color light = light_at(map, b, Vec3(Real(node.x), Real(node.y), Real(node.z))).radiance;
            const Double3 x = to_double3(node_of(bricks, b, node));
            if (largest(light) > Real(0))
                probe.on_mark(probe.context,
                              {x, x, to_double(largest(light)), spacing * to_double(largest(bricks.cell)), 0});
        }
    }
}

// A flight that leaves the smoke ends at its bounds.
void send_flight(void *context, const FlightRecord &flight) {
    const Probe &probe = *static_cast<const Probe *>(context);
    const bool points = probe.quantity == Quantity::photons;
    if (points && !flight.collides) return;
    Real begin = Real(0), end = flight.end;
    if (!flight.collides && !clip(flight.medium.bounds, flight.ray, begin, end)) return;
    const Double3 to = to_double3(flight.ray.origin + flight.ray.direction * end);
    probe.on_mark(probe.context, {points ? to : to_double3(flight.ray.origin), to, to_double(largest(flight.power)), 0,
                                  flight.photon});
}

template <class Find> Status send_points(const Frame &frame, const Probe &probe, Find &&find) {
    for (uint64_t i = 0; i < probe.count; ++i) {
        if (!frame.watch.go_on(units_of_point)) return Status::stopped;
        const Found found = find(probe.points[i]);
        probe.values[i] = found.value;
        probe.cells[i] = found.cell;
    }
    return Status::done;
}

template <class Find> Status send_rays(const Frame &frame, const Probe &probe, Find &&find) {
    const Crop &crop = frame.settings.crop;
    const View view(frame.scene.camera);
    uint64_t i = 0;
    for (int32_t y = crop.y0; y < crop.y1; y += crop.step)
        for (int32_t x = crop.x0; x < crop.x1; x += crop.step, ++i) {
            if (!frame.watch.go_on(units_of_point)) return Status::stopped;
            const Found found = find(view.ray_through(Real(x) + Real(0.5), Real(y) + Real(0.5)));
            probe.values[i] = found.value;
            probe.cells[i] = found.cell;
        }
    return Status::done;
}

Status send(void *context, Frame &frame) {
    const Probe &probe = *static_cast<const Probe *>(context);
    switch (probe.quantity) {
    case Quantity::density: return send_points(frame, probe, [&](const Double3 &x) { return density(frame, x); });
    case Quantity::light_depth:
        return send_points(frame, probe, [&](const Double3 &x) { return light_depth(frame, probe.light, x); });
    case Quantity::tree: return send_points(frame, probe, [&](const Double3 &x) { return tree_cells(frame, x); });
    case Quantity::optical_depth:
        return send_rays(frame, probe, [&](const Ray &ray) { return depth_along(frame, ray); });
    case Quantity::proofs:
        return send_rays(frame, probe, [&](const Ray &ray) { return proof(frame, probe.light, ray); });
    case Quantity::nodes: send_nodes(frame, probe); break;
    case Quantity::photons:
    case Quantity::flights: break; // they were sent
    }
    return frame.watch.stopped() ? Status::stopped : Status::done;
}

Stage last_stage(Quantity quantity) {
    switch (quantity) {
    case Quantity::density:
    case Quantity::optical_depth: return Stage::bricks;
    case Quantity::light_depth: return Stage::light_depths;
    case Quantity::tree: return Stage::triangle_trees;
    case Quantity::photons:
    case Quantity::flights: return Stage::photons;
    case Quantity::nodes: return Stage::irradiance;
    case Quantity::proofs: break; // which are learnt from the rays of the picture
    }
    return Stage::camera_rays;
}

} // namespace

Status show(const Job &job, const Probe &probe) {
    Probe asked = probe; // the pointers to it are not constant
    const FlightRecorder flights = {&asked, send_flight};
    Observation observation;
    if (probe.quantity == Quantity::photons || probe.quantity == Quantity::flights) observation.flights = &flights;
    observation.last = last_stage(probe.quantity);
    observation.context = &asked;
    observation.on_frame = send;
    return run_stages(job, observation);
}

} // namespace wisp::WISP_ARITH
