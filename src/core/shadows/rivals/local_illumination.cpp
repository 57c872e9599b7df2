// `lie`: local illumination environments (Fernandez, Bala & Greenberg 2002) (C7). Each light has an octree over the
// static triangles. A cell knows whether all of it is in the light's shadow, none of it, or which few triangles may
// block rays from it to the light.
//
// A cell's state is computed when the first ray from it asks, and only by proof (box_shaft.h): first whether the
// triangle that blocked that ray blocks all rays from the cell; then which triangles may block any. If those are more
// than max_blockers the cell is divided into eight, as far as depth and memory go; otherwise its rays are traced. The
// triangles of a list are tested one by one, as their tree tests them. So the answers are those of `trace`. Octrees are
// per light because lights need different divisions.
#include "core/shadows/box_shaft.h"
#include <algorithm>
#include <utility>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t max_blockers = 8;    // of a cell; with more it is divided
constexpr uint32_t max_depth = 9;       // of the octrees
constexpr uint32_t max_cells = 1 << 20; // beside the roots
constexpr uint32_t max_words = 1 << 21; // of lists
constexpr int64_t rim = 1 << 9;         // lattice steps around the bounds, for points that are rounded

// 31    29 28                0
// | state | index            |
//
// index: the first of eight children (divided), or of a list's words (listed), whose first word is its length.
struct LocalCell {
    enum State : uint32_t { unresolved, shadowed, lit, listed, divided, mixed };
    State state() const { return static_cast<State>(word >> 29); }
    uint32_t index() const { return word & 0x1fffffff; }

    uint32_t word;
};
LocalCell cell_of(LocalCell::State state, uint32_t index = 0) { return {static_cast<uint32_t>(state) << 29 | index}; }

struct Octrees {
    uint32_t light_count;
    int exponent; // of the lattice's steps
    LatticePoint low;
    int64_t edge; // of the root in steps; 0: before the first frame
    ShaftLight *lights;
    LocalCell *cells; // the lights' roots, then children by eights
    uint32_t *lists;
    uint32_t cell_count, list_words; // in use
    bool wasteful;                   // some of those belong to lights that have changed
};

void clear(Octrees &octrees) {
    std::fill(octrees.cells, octrees.cells + octrees.light_count, cell_of(LocalCell::unresolved));
    octrees.cell_count = octrees.light_count;
    octrees.list_words = 0;
    octrees.wasteful = false;
}

// The state of a cell after a ray from it has been traced; `occluder` blocked it, if anything did.
LocalCell resolve(Octrees &octrees, const Shadows &shadows, const ShaftLight &light, const LatticeBounds &box,
                  bool may_divide, bool blocked, uint32_t occluder) {
    const BoxShaft shaft(light.lattice, box, light.light);
    if (blocked && is_shaft_shadowed(shadows, light.lattice, shaft, occluder)) return cell_of(LocalCell::shadowed);
    uint32_t blocker[max_blockers], count;
    if (find_blockers(shadows, light.lattice, shaft, max_blockers, blocker, count)) {
        if (count == 0) return cell_of(LocalCell::lit);
        if (max_words - octrees.list_words > count) {
            const uint32_t first = octrees.list_words;
            octrees.lists[first] = count;
            std::copy(blocker, blocker + count, octrees.lists + first + 1);
            octrees.list_words += count + 1;
            return cell_of(LocalCell::listed, first);
        }
    } else if (may_divide && octrees.light_count + max_cells - octrees.cell_count >= 8) {
        const uint32_t first = octrees.cell_count;
        std::fill(octrees.cells + first, octrees.cells + first + 8, cell_of(LocalCell::unresolved));
        octrees.cell_count += 8;
        return cell_of(LocalCell::divided, first);
    }
    return cell_of(LocalCell::mixed);
}

uint64_t octree_bytes(const Scene &scene, const Settings &) {
    return Arena::bytes<Octrees>(1) + Arena::bytes<ShaftLight>(scene.light_count) +
           Arena::bytes<LocalCell>(uint64_t{scene.light_count} + max_cells) + Arena::bytes<uint32_t>(max_words);
}

void *make_octrees(const Scene &scene, const Settings &, Arena &arena, Watch) {
    Octrees *octrees = arena.make<Octrees>(1);
    ShaftLight *lights = arena.make<ShaftLight>(scene.light_count);
    LocalCell *cells = arena.make<LocalCell>(size_t{scene.light_count} + max_cells);
    uint32_t *lists = arena.make<uint32_t>(max_words);
    if (!octrees || !lights || !cells || !lists) return nullptr;
    *octrees = {};
    octrees->light_count = scene.light_count;
    octrees->lights = lights;
    octrees->cells = cells;
    octrees->lists = lists;
    return octrees;
}

bool begin_octree_frame(Shadows &shadows, const Settings &, Arena &) {
    Octrees &octrees = memory_of<Octrees>(shadows);
    const TriangleTree &tree = shadows.surfaces->static_tree;
    if (tree.triangle_count == 0) return true;
    const bool first = octrees.edge == 0;
    if (first) {
        octrees.exponent = static_exponent(tree);
        const LatticePoint high = lattice_point(tree.bounds.high, octrees.exponent);
        octrees.low = lattice_point(tree.bounds.low, octrees.exponent);
        octrees.edge = int64_t{1} << max_depth;
        for (int a = 0; a < 3; ++a) {
            octrees.low.x[a] -= rim;
            while (octrees.low.x[a] + octrees.edge <= high.x[a] + rim) octrees.edge *= 2;
        }
        clear(octrees);
    }
    for (uint32_t l = 0; l < octrees.light_count; ++l) {
        if (!update_light(octrees.lights[l], shadows, l, first)) continue;
        octrees.wasteful = octrees.wasteful || octrees.cells[l].state() == LocalCell::divided;
        octrees.cells[l] = cell_of(LocalCell::unresolved);
    }
    const bool scarce = octrees.cell_count - octrees.light_count > max_cells / 2 || octrees.list_words > max_words / 2;
    if (scarce && octrees.wasteful) clear(octrees);
    return true;
}

bool is_shadowed_by_octrees(Shadows &shadows, const ShadowQuery &query) {
    Octrees &octrees = memory_of<Octrees>(shadows);
    const Surfaces &surfaces = *shadows.surfaces;
    Statistics &statistics = *shadows.statistics;
    if (surfaces.static_tree.triangle_count == 0) return is_blocked_by_moving(shadows, query);
    const ShaftLight &light = octrees.lights[query.light];
    const Vec3 &from = query.ray.origin;
    bool within = is_on_lattice(surfaces.static_tree, from);
    LatticePoint at = octrees.low, low = octrees.low;
    if (within) at = lattice_point(from, octrees.exponent);
    for (int a = 0; a < 3; ++a) within = within && at.x[a] >= low.x[a] && at.x[a] < low.x[a] + octrees.edge;
    LocalCell outside = cell_of(LocalCell::mixed), *cell = within ? &octrees.cells[query.light] : &outside;
    int64_t edge = octrees.edge;
    uint32_t depth = 0;
    while (cell->state() == LocalCell::divided) {
        edge /= 2;
        ++depth;
        uint32_t child = 0;
        for (int a = 0; a < 3; ++a) {
            if (at.x[a] < low.x[a] + edge) continue;
            low.x[a] += edge;
            child |= 1u << a;
        }
        cell = &octrees.cells[cell->index() + child];
    }
    switch (cell->state()) {
    case LocalCell::shadowed: ++statistics.rays.shadow_culled; return true;
    case LocalCell::lit: return is_shadowed_by_moving_alone(shadows, query);
    case LocalCell::listed: {
        uint32_t *list = octrees.lists + cell->index() + 1;
        const TriangleRay ray(query.ray.origin, query.ray.direction);
        bool tested = false;
        for (uint32_t i = 0; i < list[-1]; ++i) {
            if (list[i] == query.triangle) continue;
            tested = true;
            ++statistics.shadow.extra_tests;
            if (!intersects(*shadows.scene, list[i], ray, query.begin, query.end)) continue;
            std::swap(list[0], list[i]); // it will block other rays, too
            return true;
        }
        return tested ? is_blocked_by_moving(shadows, query) : is_shadowed_by_moving_alone(shadows, query);
    }
    default: break;
    }
    uint32_t occluder;
    const bool blocked = is_blocked_by_static(shadows, query, occluder);
    if (cell->state() == LocalCell::unresolved) {
        LatticeBounds box;
        const int shift = light.lattice.exponent - octrees.exponent; // to longer steps
        for (int a = 0; a < 3; ++a) {
            box.low.x[a] = low.x[a] >> shift;
            box.high.x[a] = ((low.x[a] + edge) >> shift) + 1;
        }
        *cell = resolve(octrees, shadows, light, box, depth < max_depth, blocked, occluder);
    }
    return blocked || is_blocked_by_moving(shadows, query);
}

} // namespace

const ShadowTechnique lie_technique = {is_shadowed_by_octrees, octree_bytes, make_octrees, begin_octree_frame};

} // namespace wisp::WISP_ARITH
