// Optical depths from points of a lattice to every light, kept once found: what lies between is interpolated, so that a
// march need not ask for a shadow at every step.
//
// A node's value does not depend on who asked first. Only bricks that a ray came near exist, and in them only the nodes
// that were needed are found.
#pragma once
#include "wisp/smoke.h"

namespace wisp::WISP_ARITH {

constexpr int32_t brick_edge = 8; // nodes

struct LightDepths {
    const Medium *medium;
    const Light *lights;
    uint32_t light_count;
    Lattice lattice; // its cells lie between the nodes
    Cell bricks;     // how many there can be
    Real **of_brick; // by brick: light_count values of each node, below 0 where not found yet; nullptr: no brick yet
    Arena *arena;    // for the bricks to come
    uint64_t *shadow_rays;
};

// Nodes are `spacing` apart. False: the arena was too small.
bool make_light_depths(const Medium &medium, const Light *lights, uint32_t light_count, Real spacing, Arena &arena,
                       uint64_t *shadow_rays, LightDepths &depths);

// The depth between x, in the medium's bounds, and light l: trilinear.
Real light_depth(const LightDepths &depths, uint32_t l, const Vec3 &x);

// At most, for nodes `lengths` smoothing lengths of the finest smoke apart; 0 for 0.
uint64_t light_depth_bytes(const Scene &scene, double lengths);

} // namespace wisp::WISP_ARITH
