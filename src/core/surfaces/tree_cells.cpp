#include "core/surfaces/tree_cells.h"
#include "core/surfaces/triangle_bvh.h"
#include "core/surfaces/triangle_kdtree.h"

namespace wisp::WISP_ARITH {

namespace {

inline Parameter box_plane(float plane, int) { return plane; }
inline Parameter box_plane(int32_t plane, int shift) { return position_of_steps(plane, shift); }

void add_node(TreeCells &cells, uint32_t node) { cells.nodes = (cells.nodes ^ node) * 0x9e3779b97f4a7c15u; }

void add_leaf_of_kdtree(const TriangleTree &tree, const Parameter (&x)[3], TreeCells &cells) {
    const TriangleNode *node = tree.nodes;
    while (node->axis() != leaf_axis) {
        const bool above = x[node->axis()] > plane_of(node->value, plane_shift(tree), Parameter());
        node = tree.nodes + node->first() + (above ? 1 : 0);
    }
    cells.triangles += node->value;
    add_node(cells, static_cast<uint32_t>(node - tree.nodes));
}

bool holds(const BoxNode &node, uint32_t lane, int shift, const Parameter (&x)[3]) {
    for (int axis = 0; axis < 3; ++axis)
        if (x[axis] < box_plane(node.plane[0][axis][lane], shift) ||
            box_plane(node.plane[1][axis][lane], shift) < x[axis])
            return false;
    return true;
}

void add_boxes(const TriangleTree &tree, const Parameter (&x)[3], TreeCells &cells) {
    uint32_t stack[bvh_stack], stack_size = 0;
    stack[stack_size++] = tree.root;
    while (stack_size > 0) {
        const uint32_t child = stack[--stack_size];
        add_node(cells, child);
        if (is_leaf(child)) {
            cells.triangles += triangles_in(child);
            continue;
        }
        const BoxNode &node = tree.boxes[child];
        for (uint32_t lane = 0; lane < lanes; ++lane)
            if (holds(node, lane, plane_shift(tree), x)) stack[stack_size++] = node.child[lane];
    }
}

void add_tree(const TriangleTree &tree, const Vec3 &at, TreeCells &cells) {
    const Box &box = tree.bounds;
    if (tree.triangle_count == 0 || min(at, box.low) != box.low || max(at, box.high) != box.high) return;
    const Parameter x[3] = {position_of(at.x), position_of(at.y), position_of(at.z)};
    cells.found = true;
    if (tree.kind == TreeKind::kd)
        add_leaf_of_kdtree(tree, x, cells);
    else
        add_boxes(tree, x, cells);
}

} // namespace

TreeCells cells_at(const Surfaces &surfaces, const Vec3 &x) {
    TreeCells cells = {false, 0, 1};
    add_tree(surfaces.static_tree, x, cells);
    for (uint32_t i = 0; i < surfaces.instance_count; ++i) {
        const PlacedInstance &instance = surfaces.instances[i];
        const Vec3 offset = x - instance.origin, *inverse = instance.inverse;
        if (!surfaces.placed[i].visible) continue;
        add_node(cells, i);
        add_tree(instance.tree, inverse[0] * offset.x + inverse[1] * offset.y + inverse[2] * offset.z, cells);
    }
    add_tree(surfaces.deforming_tree, x, cells);
    return cells;
}

} // namespace wisp::WISP_ARITH
