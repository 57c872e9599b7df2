// Shadows proved for the cells and instances that many rays ask about.
#include "core/shadows/proved_shadows.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t rays_before_proof = 8; // of a cell
static_assert(rays_before_proof < rays_before_split && rays_before_split < 64, "ShadowCell counts to 63");

void load(const Triangle &triangle, Vec3 (&corner)[3]) {
    for (int i = 0; i < 3; ++i) corner[i] = vec_of(triangle.corner[i]);
}

// The state of a cell from which all rays so far had one answer.
void prove_visibility(const Shadows &shadows, const ShadowQuery &query, const CellPlace &place, ShadowCell &cell) {
    Vec3 receiver[3], occluder[3];
    load(shadows.scene->triangles[query.triangle], receiver);
    const TriangleTree &tree = shadows.surfaces->static_tree;
    const TriangleShaft shaft =
        make_triangle_shaft(tree, receiver, place, shadows.lights[query.light], shadows.surfaces->ray_epsilon);
    TreeCounts &proofs = shadows.statistics->shadow.proofs;
    cell.set_state(CellState::mixed);
    if (!cell.has_shadowed_ray()) {
        const uint64_t visits = proofs.node_visits;
        if (is_shaft_lit(tree, shaft, query.triangle, proofs)) cell.set_state(CellState::lit);
        shadows.watch.go_on(static_cast<uint32_t>(proofs.node_visits - visits));
    } else {
        load(shadows.scene->triangles[cell.occluder], occluder);
        ++proofs.triangle_tests;
        if (is_shaft_shadowed(shaft, occluder)) cell.set_state(CellState::shadowed);
    }
}

// Traces a ray from a cell that is neither lit nor shadowed against static triangles: the cell's last occluder first,
// then the tree. The cell learns from the answer.
bool trace_from_cell(ShadowCells &cells, ShadowCell &cell, const CellPlace &place, Shadows &shadows,
                     const ShadowQuery &query) {
    bool blocked = false;
    if (cell.occluder != no_triangle) {
        ++shadows.statistics->shadow.extra_tests;
        blocked = intersects(*shadows.scene, cell.occluder, TriangleRay(query.ray.origin, query.ray.direction),
                             query.begin, query.end);
    }
    if (!blocked) blocked = is_blocked_by_static(shadows, query, cell.occluder);
    cell.count_ray(blocked, rays_before_split);
    if (cell.state() == CellState::unresolved && cell.has_lit_ray() && cell.has_shadowed_ray())
        cell.set_state(CellState::mixed);
    if (cell.state() == CellState::unresolved && cell.rays() == rays_before_proof)
        prove_visibility(shadows, query, place, cell);
    if (cell.state() == CellState::mixed && cell.rays() == rays_before_split) split(cells, cell, place);
    return blocked;
}

uint64_t proved_bytes(const Scene &scene, const Settings &settings) {
    return Arena::bytes<ProvedShadows>(1) + shadow_cell_bytes(scene, settings) + instance_shadow_bytes(scene);
}

void *make_proved(const Scene &scene, const Settings &settings, Arena &arena, Watch watch) {
    ProvedShadows *proved = arena.make<ProvedShadows>(1);
    if (!proved) return nullptr;
    proved->cells = make_shadow_cells(scene, settings, arena, watch);
    return proved->cells.ready ? proved : nullptr;
}

bool begin_proved_frame(Shadows &shadows, const Settings &, Arena &arena) {
    ProvedShadows &proved = memory_of<ProvedShadows>(shadows);
    update_shadow_cells(proved.cells, shadows.lights, shadows.scene->light_count);
    proved.instances = make_instance_shadows(shadows, arena);
    return proved.instances.ready;
}

bool is_shadowed_by_proof(Shadows &shadows, const ShadowQuery &query) {
    ProvedShadows &proved = memory_of<ProvedShadows>(shadows);
    auto &rays = shadows.statistics->rays;
    CellPlace place;
    ShadowCell *cell = nullptr;
    InstanceLight *instance = nullptr;
    if (query.is_static)
        cell = find_shadow_cell(proved.cells, query.light, query.triangle, query.u, query.v, place);
    else
        instance = find_instance_light(proved.instances, shadows, query);
    if (cell && cell->state() == CellState::shadowed) {
        ++rays.shadow_culled;
        return true;
    }
    const bool lit =
        cell ? cell->state() == CellState::lit : instance && instance->blocker_count == 0; // of static ones
    if (!lit) {
        uint32_t occluder;
        if (cell                                ? trace_from_cell(proved.cells, *cell, place, shadows, query)
            : instance && instance->is_listed() ? is_blocked_by_listed(*instance, shadows, query)
                                                : is_blocked_by_static(shadows, query, occluder))
            return true;
    }
    bool tested;
    const bool blocked = is_blocked_by_moving(proved.instances, shadows, query, tested);
    if (lit) ++(tested ? rays.shadow_dynamic_only : rays.shadow_culled);
    return blocked;
}

} // namespace

const ShadowTechnique exact_technique = {is_shadowed_by_proof, proved_bytes, make_proved, begin_proved_frame};

} // namespace wisp::WISP_ARITH
