// Local illumination environments.
#include "core/shadows/rivals/local_illumination.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t max_blockers = 8;    // of a cell, or it is cut
constexpr uint32_t max_depth = 9;       // of the octrees
constexpr uint32_t max_cells = 1 << 20; // beside the roots
constexpr uint32_t max_words = 1 << 21; // of lists
constexpr int64_t rim = 1 << 9;          // steps around the bounds, for points that are rounded

LocalCell cell_of(LocalCell::Kind kind, uint32_t place = 0) { return {static_cast<uint32_t>(kind) << 29 | place}; }

void forget(LocalShadows &local) {
    std::fill(local.cells, local.cells + local.light_count, cell_of(LocalCell::unknown));
    local.cell_count = local.light_count;
    local.list_words = 0;
    local.wasteful = false;
}

// What is known of a cell after a ray from it has been traced; `occluder` stopped it, if anything did.
LocalCell look(LocalShadows &local, const Shadows &shadows, const ShaftLight &light, const LatticeBounds &box,
               bool may_cut, bool blocked, uint32_t occluder) {
    const BoxShaft shaft(light.lattice, box, light.light);
    if (blocked && is_cut_by(shadows, light.lattice, shaft, occluder)) return cell_of(LocalCell::full);
    uint32_t blocker[max_blockers], count;
    if (find_blockers(shadows, light.lattice, shaft, max_blockers, blocker, count)) {
        if (count == 0) return cell_of(LocalCell::null);
        if (max_words - local.list_words > count) {
            const uint32_t place = local.list_words;
            local.lists[place] = count;
            std::copy(blocker, blocker + count, local.lists + place + 1);
            local.list_words += count + 1;
            return cell_of(LocalCell::list, place);
        }
    } else if (may_cut && local.light_count + max_cells - local.cell_count >= 8) {
        const uint32_t first = local.cell_count;
        std::fill(local.cells + first, local.cells + first + 8, cell_of(LocalCell::unknown));
        local.cell_count += 8;
        return cell_of(LocalCell::cut, first);
    }
    return cell_of(LocalCell::complicated);
}

} // namespace

uint64_t local_shadow_bytes(const Scene &scene) {
    return Arena::bytes<LocalShadows>(1) + Arena::bytes<ShaftLight>(scene.light_count) +
           Arena::bytes<LocalCell>(uint64_t{scene.light_count} + max_cells) + Arena::bytes<uint32_t>(max_words);
}

LocalShadows *make_local_shadows(const Scene &scene, Arena &arena) {
    LocalShadows *local = arena.make<LocalShadows>(1);
    ShaftLight *lights = arena.make<ShaftLight>(scene.light_count);
    LocalCell *cells = arena.make<LocalCell>(size_t{scene.light_count} + max_cells);
    uint32_t *lists = arena.make<uint32_t>(max_words);
    if (!local || !lights || !cells || !lists) return nullptr;
    *local = {};
    local->light_count = scene.light_count;
    local->lights = lights;
    local->cells = cells;
    local->lists = lists;
    return local;
}

void begin_frame(LocalShadows &local, const Shadows &shadows) {
    const TriangleTree &still = shadows.surfaces->still;
    if (still.triangle_count == 0) return;
    const bool first = local.edge == 0;
    if (first) {
        local.exponent = static_exponent(still);
        const LatticePoint high = lattice_point(still.bounds.high, local.exponent);
        local.low = lattice_point(still.bounds.low, local.exponent);
        local.edge = int64_t{1} << max_depth;
        for (int a = 0; a < 3; ++a) {
            local.low.x[a] -= rim;
            while (local.low.x[a] + local.edge <= high.x[a] + rim) local.edge *= 2;
        }
        forget(local);
    }
    for (uint32_t l = 0; l < local.light_count; ++l) {
        if (!follow_light(local.lights[l], shadows, l, !first)) continue;
        local.wasteful = local.wasteful || local.cells[l].kind() == LocalCell::cut;
        local.cells[l] = cell_of(LocalCell::unknown);
    }
    const bool scarce = local.cell_count - local.light_count > max_cells / 2 || local.list_words > max_words / 2;
    if (scarce && local.wasteful) forget(local);
}

bool is_shadowed(LocalShadows &local, Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    Statistics &statistics = *shadows.statistics;
    if (surfaces.still.triangle_count == 0) return is_blocked_by_moving(shadows, query);
    const ShaftLight &light = local.lights[query.light];
    const Vec3 &from = query.ray.origin;
    bool within = is_on_lattice(surfaces.still, from);
    LatticePoint at = local.low, low = local.low;
    if (within) at = lattice_point(from, local.exponent);
    for (int a = 0; a < 3; ++a) within = within && at.x[a] >= low.x[a] && at.x[a] < low.x[a] + local.edge;
    LocalCell outside = cell_of(LocalCell::complicated), *cell = within ? &local.cells[query.light] : &outside;
    int64_t edge = local.edge;
    uint32_t depth = 0;
    while (cell->kind() == LocalCell::cut) {
        edge /= 2;
        ++depth;
        uint32_t child = 0;
        for (int a = 0; a < 3; ++a) {
            if (at.x[a] < low.x[a] + edge) continue;
            low.x[a] += edge;
            child |= 1u << a;
        }
        cell = &local.cells[cell->place() + child];
    }
    switch (cell->kind()) {
    case LocalCell::full: ++statistics.rays.shadow_culled; return true;
    case LocalCell::null: return is_shadowed_by_moving_alone(shadows, query);
    case LocalCell::list: {
        uint32_t *list = local.lists + cell->place() + 1;
        const TriangleRay ray(query.ray.origin, query.ray.direction);
        bool asked = false;
        for (uint32_t i = 0; i < list[-1]; ++i) {
            if (list[i] == query.triangle) continue;
            asked = true;
            ++statistics.shadow.extra_tests;
            if (!intersects(*shadows.scene, list[i], ray, surfaces.ray_epsilon, query.end)) continue;
            std::swap(list[0], list[i]); // it will stop others, too
            return true;
        }
        return asked ? is_blocked_by_moving(shadows, query) : is_shadowed_by_moving_alone(shadows, query);
    }
    default: break;
    }
    uint32_t occluder;
    const bool blocked = is_blocked_by_static(shadows, query, occluder);
    if (cell->kind() == LocalCell::unknown) {
        LatticeBounds box;
        const int shift = light.lattice.exponent - local.exponent; // to longer steps
        for (int a = 0; a < 3; ++a) {
            box.low.x[a] = low.x[a] >> shift;
            box.high.x[a] = ((low.x[a] + edge) >> shift) + 1;
        }
        *cell = look(local, shadows, light, box, depth < max_depth, blocked, occluder);
    }
    return blocked || is_blocked_by_moving(shadows, query);
}

} // namespace wisp::WISP_ARITH
