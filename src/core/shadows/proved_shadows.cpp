// Shadows without rays, proved where many rays ask for them.
#include "core/shadows/proved_shadows.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t rays_before_proof = 8, rays_before_split = 24; // below 64

void load(const Triangle &triangle, Vec3 (&corner)[3]) {
    for (int i = 0; i < 3; ++i) corner[i] = vec_of(triangle.corner[i]);
}

void prove_visibility(const Shadows &shadows, const ShadowQuery &query, const CellPlace &place, ShadowCell &cell) {
    Vec3 receiver[3], occluder[3];
    load(shadows.scene->triangles[query.triangle], receiver);
    const TriangleTree &tree = shadows.surfaces->still;
    const TriangleShaft shaft =
        make_triangle_shaft(tree, receiver, place, shadows.lights[query.light], shadows.surfaces->ray_epsilon);
    TreeCounts &proofs = shadows.statistics->shadow.proofs;
    cell.set_state(CellState::partial);
    if (!cell.shaded()) {
        if (is_shaft_free(tree, shaft, query.triangle, proofs)) cell.set_state(CellState::free);
    } else {
        load(shadows.scene->triangles[cell.occluder], occluder);
        ++proofs.triangle_tests;
        if (is_shaft_blocked(shaft, occluder)) cell.set_state(CellState::blocked);
    }
}

// A ray from a cell of which nothing is proved: its last occluder first, then the tree. Learns from what it meets.
bool ask_static(ShadowCells &cells, ShadowCell &cell, const CellPlace &place, Shadows &shadows,
               const ShadowQuery &query) {
    bool stopped = false;
    if (cell.occluder != no_triangle) {
        ++shadows.statistics->shadow.extra_tests;
        stopped = intersects(*shadows.scene, cell.occluder, TriangleRay(query.ray.origin, query.ray.direction),
                         shadows.surfaces->ray_epsilon, query.end);
    }
    if (!stopped) stopped = is_blocked_by_static(shadows, query, cell.occluder);
    cell.count_ray(stopped, rays_before_split);
    if (cell.state() == CellState::unknown && cell.lit() && cell.shaded()) cell.set_state(CellState::partial);
    if (cell.state() == CellState::unknown && cell.rays() == rays_before_proof) prove_visibility(shadows, query, place, cell);
    if (cell.state() == CellState::partial && cell.rays() == rays_before_split) split(cells, cell, place);
    return stopped;
}

} // namespace

uint64_t proved_shadow_bytes(const Scene &scene) {
    return Arena::bytes<ProvedShadows>(1) + shadow_cell_bytes(scene) + instance_shadow_bytes(scene);
}

ProvedShadows *make_proved_shadows(const Scene &scene, Arena &arena) {
    ProvedShadows *exact = arena.make<ProvedShadows>(1);
    if (!exact) return nullptr;
    exact->cells = make_shadow_cells(scene, arena);
    return exact->cells.ready ? exact : nullptr;
}

bool begin_frame(ProvedShadows &exact, const Shadows &shadows, Arena &arena) {
    update_shadow_cells(exact.cells, shadows.lights, shadows.scene->light_count);
    exact.instances = make_instance_shadows(shadows, arena);
    return exact.instances.ready;
}

bool is_shadowed(ProvedShadows &exact, Shadows &shadows, const ShadowQuery &query) {
    auto &rays = shadows.statistics->rays;
    CellPlace place;
    ShadowCell *cell = nullptr;
    InstanceLight *instance = nullptr;
    if (query.still)
        cell = find_shadow_cell(exact.cells, query.light, query.triangle, query.u, query.v, place);
    else
        instance = find_instance_light(exact.instances, shadows, query);
    if (cell && cell->state() == CellState::blocked) {
        ++rays.shadow_culled;
        return true;
    }
    const bool known = cell ? cell->state() == CellState::free : instance && instance->blocker_count == 0;
    if (!known) {
        uint32_t occluder;
        if (cell                    ? ask_static(exact.cells, *cell, place, shadows, query)
            : instance && instance->known() ? is_blocked_by_listed(*instance, shadows, query)
                                    : is_blocked_by_static(shadows, query, occluder))
            return true;
    }
    bool asked;
    const bool blocked = is_blocked_by_moving(exact.instances, shadows, query, asked);
    if (known) ++(asked ? rays.shadow_dynamic_only : rays.shadow_culled);
    return blocked;
}

} // namespace wisp::WISP_ARITH
