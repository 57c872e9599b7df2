// Lightcuts (Walter, Fernandez, Arbree, Bala, Donikian, Greenberg 2005): surfaces lit by many lights, most of them in
// clusters that one light of theirs stands for.
//
// The lights of each kind are the leaves of a binary tree. For a point, a cut through the trees gives its light: each
// of its nodes all that its lights emit together, as if that came from the node's representative, in whose shadow the
// point may be. A cut begins with the roots, and the node that may err most is replaced by its children until none may
// err by more than `error` of what the cut gives, or the cut has `most` nodes. Lights themselves are exact.
//
// What a node's lights give, and what it gives for them, lies between 0 and max_light(): so no node of a cut that is
// below `most` errs by more than `error` of the largest channel of the cut's sum.
#pragma once
#include "core/geometry/ray.h"
#include "core/lights/light.h"
#include <limits>

namespace wisp::WISP_ARITH {

// Children lie behind their parents.
struct LightNode {
    Box box;                         // of the lights' positions; parallel: of the unit vectors towards them
    Box directions;                  // of what they travel along
    Real widest;                     // one_minus_cosine of the widest of them
    Color color;                     // of all together
    uint32_t count, light, children; // lights in it; the representative; the first of two, 0: it is a light
};

// A point of a surface, and the ray that sees it: what light becomes there.
struct LitPoint {
    Vec3 position, plane, normal, mirrored; // unit vectors; the last: the ray's direction off the normal's mirror
    Color diffuse, specular;
    Real shininess;
};

// What a light's irradiance is multiplied by; all 0 where the light is behind the surface or in shadow.
struct Response {
    bool known;
    Color factor;
};

// A node of a cut that has children.
struct CutNode {
    Real bound;
    uint32_t node;
    Response response; // of its representative
    Color given;
};

struct LightCuts {
    const Light *lights;
    const LightNode *nodes;
    uint32_t node_count, root_count;
    uint32_t roots[4]; // one for each kind that there is
    CutNode *heap;     // room for a cut
    Real error;
    uint32_t most;
};

uint64_t light_cut_bytes(const Scene &scene);

// False: the arena was too small. In fixed point the lights' colors together must stay below 2^30.
bool make_light_cuts(const Light *lights, uint32_t count, Arena &arena, LightCuts &cuts);

// An upper bound of the largest channel of what the node's lights, or its representative for them, may give to the
// point; `no_bound` where the point is so near that none is known.
constexpr Real no_bound = std::numeric_limits<Real>::max();
Real max_light(const LightCuts &cuts, const LightNode &node, const LitPoint &point);

// A light as bright as a node, where its representative is.
inline Light representative(const LightCuts &cuts, const LightNode &node) {
    Light light = cuts.lights[node.light];
    light.color = node.color;
    return light;
}

// The heap of `size` nodes has the largest bound first, of equal ones the first node.
void push(CutNode *heap, uint32_t &size, const CutNode &node);
CutNode pop(CutNode *heap, uint32_t &size);

// base^exponent for 0 <= base <= 1: Phong's highlight.
inline Real power(Real base, Real exponent) {
    if (exponent == Real(0)) return Real(1);
    return base > Real(0) ? exp(exponent * log(min(base, Real(1)))) : Real(0);
}

struct LightOfCut {
    Color sum;
    uint32_t clusters; // of the cut, left in the heap; all else are lights themselves
};

// What the lights give to the point. respond(light, illumination) tells the factor of one.
template <class Respond> LightOfCut light_of_cut(const LightCuts &cuts, const LitPoint &point, Respond &&respond) {
    CutNode *const heap = cuts.heap;
    uint32_t size = 0, lights = 0; // of the cut: nodes with children, and without
    Color of_lights(Real(0)), estimate(Real(0));
    const auto add = [&](uint32_t index, uint32_t known_light, const Response &known) {
        const LightNode &node = cuts.nodes[index];
        const bool leaf = node.children == 0;
        CutNode cut = {leaf ? Real(0) : max_light(cuts, node, point), index, {}, Color(Real(0))};
        if (!leaf && !(cut.bound > Real(0))) return;
        if (cut.bound < no_bound) {
            const Light light = representative(cuts, node);
            const Illumination from = illuminate(light, point.position, point.position, point.position);
            const bool same = known.known && node.light == known_light;
            cut.response = {true, same ? known.factor : respond(node.light, from)};
            cut.given = from.irradiance * cut.response.factor;
            estimate += cut.given;
        }
        if (leaf) {
            ++lights;
            of_lights += cut.given;
        } else {
            push(heap, size, cut);
        }
    };
    const auto is_fine = [&] { // the node that may err most
        return heap[0].bound < no_bound &&
               (size + lights >= cuts.most || heap[0].bound <= cuts.error * largest(estimate));
    };
    for (uint32_t i = 0; i < cuts.root_count; ++i) add(cuts.roots[i], 0, {});
    for (;;) {
        if (size == 0 || is_fine()) {
            // What has come and gone has left its rounding in the estimate: it is added up anew.
            estimate = of_lights;
            for (uint32_t i = 0; i < size; ++i) estimate += heap[i].given;
            if (size == 0 || is_fine()) return {estimate, size};
        }
        const CutNode cut = pop(heap, size);
        const LightNode &node = cuts.nodes[cut.node];
        estimate -= cut.given;
        for (uint32_t child = node.children; child < node.children + 2; ++child) add(child, node.light, cut.response);
    }
}

} // namespace wisp::WISP_ARITH
