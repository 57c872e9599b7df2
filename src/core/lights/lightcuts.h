// Lightcuts (Walter et al. 2005, README): surfaces lit by many lights, most of which are grouped in clusters.
//
// The lights of each kind are the leaves of a binary tree. A node is a cluster of the lights below it: it has the
// colour of all of them together, at the position of one of them, the representative. For a point, a cut through the
// trees approximates the light of all lights by that of its nodes; one shadow ray per node, towards the representative,
// decides whether the node is visible. A cut begins with the roots. The node with the largest error bound is replaced
// by its children, until no bound exceeds `error` times the sum over the cut, or the cut has `max_nodes` nodes. Leaves
// are exact.
//
// Both the light of a cluster and its approximation lie between 0 and max_light(), which therefore bounds the error. So
// in a cut with fewer than `max_nodes` nodes, no node errs by more than `error` of the largest channel of the sum.
#pragma once
#include "core/geometry/ray.h"
#include "core/lights/light.h"
#include <limits>

namespace wisp::WISP_ARITH {

// A node of a tree. Children come after their parents in the array.
struct LightNode {
    Box box;                         // of the lights' positions; parallel: of the unit vectors towards them
    Box directions;                  // of the axes of spots
    Real max_one_minus_cosine;       // of the widest spot
    Color color;                     // the sum of the lights' colours
    uint32_t count, light, children; // number of lights; the representative; the first of two children, 0: a leaf
};

// A point of a surface with its material, and the ray that hit it.
struct LitPoint {
    Vec3 position;
    Vec3 plane, normal, mirrored; // unit vectors: the geometric and the shading normal; the reflected direction
    Color diffuse, specular;
    Real shininess;
};

// The factor from a light's irradiance to the radiance that the point reflects: 0 where the light is behind the surface
// or in shadow.
struct Response {
    bool known; // false: not computed yet
    Color factor;
};

// A node of a cut that has children.
struct CutNode {
    Real bound;
    uint32_t node;
    Response response; // of its representative
    Color contribution;
};

struct LightCuts {
    const Light *lights;
    const LightNode *nodes;
    uint32_t node_count, root_count;
    uint32_t roots[4]; // one per kind of light
    CutNode *heap;     // workspace
    Real error;
    uint32_t max_nodes;
};

uint64_t light_cut_bytes(const Scene &scene);

// False: the arena was too small, or the work is stopped. In fixed point the sum of the lights' colours must stay below
// 2^30.
bool make_light_cuts(const Light *lights, uint32_t count, Arena &arena, LightCuts &cuts, Watch watch = {});

// An upper bound of the largest channel of the reflected radiance from the node's lights, or from its representative in
// their place; `no_bound` where the point is too near to the node's box. The derivation is in the source file.
constexpr Real no_bound = std::numeric_limits<Real>::max();
Real max_light(const LightCuts &cuts, const LightNode &node, const LitPoint &point);

// The light that stands for a node: the representative with the colour of all lights.
inline Light representative(const LightCuts &cuts, const LightNode &node) {
    Light light = cuts.lights[node.light];
    light.color = node.color;
    return light;
}

// A heap of `size` nodes: the largest bound comes first; of equal ones, the lowest node.
void push(CutNode *heap, uint32_t &size, const CutNode &node);
CutNode pop(CutNode *heap, uint32_t &size);

// base^exponent for 0 <= base <= 1, as in Phong's highlight.
inline Real power(Real base, Real exponent) {
    if (exponent == Real(0)) return Real(1);
    return base > Real(0) ? exp(exponent * log(min(base, Real(1)))) : Real(0);
}

struct LightOfCut {
    Color sum;
    uint32_t clusters; // nodes of the cut with children; they are the heap's. The other nodes are single lights
};

// The radiance that the point reflects from all lights. shade_light(light, illumination) computes the factor of one
// light, its shadow included.
template <class ShadeLight>
LightOfCut light_of_cut(const LightCuts &cuts, const LitPoint &point, ShadeLight &&shade_light) {
    CutNode *const heap = cuts.heap;
    uint32_t size = 0, lights = 0; // nodes of the cut with children, and leaves
    Color leaf_sum(Real(0)), estimate(Real(0));
    const auto add = [&](uint32_t index, uint32_t known_light, const Response &known) {
        const LightNode &node = cuts.nodes[index];
        const bool leaf = node.children == 0;
        CutNode cut = {leaf ? Real(0) : max_light(cuts, node, point), index, {}, Color(Real(0))};
        if (!leaf && !(cut.bound > Real(0))) return;
        if (cut.bound < no_bound) {
            const Light light = representative(cuts, node);
            const Illumination from = illuminate(light, point.position, point.position, point.position);
            const bool same = known.known && node.light == known_light;
            cut.response = {true, same ? known.factor : shade_light(node.light, from)};
            cut.contribution = from.irradiance * cut.response.factor;
            estimate += cut.contribution;
        }
        if (leaf) {
            ++lights;
            leaf_sum += cut.contribution;
        } else {
            push(heap, size, cut);
        }
    };
    const auto is_fine = [&] { // heap[0] has the largest bound
        return heap[0].bound < no_bound &&
               (size + lights >= cuts.max_nodes || heap[0].bound <= cuts.error * largest(estimate));
    };
    for (uint32_t i = 0; i < cuts.root_count; ++i) add(cuts.roots[i], 0, {});
    for (;;) {
        if (size == 0 || is_fine()) {
            // Replaced nodes have left their rounding errors in the estimate: add it up anew.
            estimate = leaf_sum;
            for (uint32_t i = 0; i < size; ++i) estimate += heap[i].contribution;
            if (size == 0 || is_fine()) return {estimate, size};
        }
        const CutNode cut = pop(heap, size);
        const LightNode &node = cuts.nodes[cut.node];
        estimate -= cut.contribution;
        for (uint32_t child = node.children; child < node.children + 2; ++child) add(child, node.light, cut.response);
    }
}

} // namespace wisp::WISP_ARITH
