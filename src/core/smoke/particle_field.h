// Smoke as a density field of particles (S3): extinction at a point, optical depth of a segment in closed form
// (numerics L), and a photon's next collision (numerics X).
#pragma once
#include "core/geometry/point_kdtree.h"
#include "core/numbers/random.h"
#include "core/smoke/collision.h"
#include "core/smoke/kernel.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

// sigma_t(x) = sum_i scale_i / h_i f(|x - x_i|^2 / h_i^2). All arrays are indexed by the slots of the tree; the empty
// slots of the last leaf weigh nothing.
struct ParticleField {
    PointTree tree;
    Kernel kernel;
    const Real *inverse_h; // 1 / h_i, the kernel's own h
    const Real *scale;     // area_i C h_i^-2: the optical depth of a line is this times the kernel's line integral
    // The optical depth of the line through the particle's middle as a fraction of 2^32: a photon whose draw for the
    // particle lies above it cannot collide there, wherever it passes.
    const uint32_t *reach;
    uint32_t first_dimension; // of its draws: the particles of all smokes share one photon's dimensions
    Real support;             // the largest
    Box bounds;               // of all supports
    bool ready;               // false: the arena was too small
};

// How the ray's line passes the particle in a slot: its squared distance from the middle in units of h, and how far
// along the ray that is.
struct Passage {
    Real b_squared, along;
};
WISP_INLINE Passage passage(const ParticleField &field, uint32_t slot, const Ray &ray) {
    const PointTree &tree = field.tree;
    const Vec3 &o = ray.origin, &d = ray.direction;
    const Real px = tree.x[slot] - o.x, py = tree.y[slot] - o.y, pz = tree.z[slot] - o.z, h = field.inverse_h[slot];
    const Real cx = d.y * pz - py * d.z, cy = d.z * px - pz * d.x, cz = d.x * py - px * d.y;
    return {sum_of_products(cx, cx, cy, cy, cz, cz) * (h * h), sum_of_products(px, d.x, py, d.y, pz, d.z)};
}

// The field of `source`; everything is made from the arena.
ParticleField make_particle_field(const SmokeDescription &source, uint32_t first_dimension, Arena &arena);
uint64_t particle_field_bytes(uint32_t particles);

// sigma_t at x, per unit of length.
Real extinction(const ParticleField &field, const Vec3 &x);

// int sigma_t over the ray's distances 0 to `end`. It has no step, hence no step error.
Real optical_depth(const ParticleField &field, const Ray &ray, Real end);

// The same particle by particle, in a fixed order: visit(slot, its part of the integral) where the ray meets it.
template <class Visit> void for_each_depth(const ParticleField &field, const Ray &ray, Real end, Visit &&visit);

// sigma_t at x particle by particle, in a fixed order: visit(slot, its part of it) where that is not 0.
template <class Visit> void for_each_extinction(const ParticleField &field, const Vec3 &x, Visit &&visit);

// An upper bound of sigma_t in the box: the sum of what each particle has at its nearest point.
Real majorant(const ParticleField &field, const Box &box);

// Where a photon that starts along the ray collides first, if before `end`: each particle on the way is an
// independent Poisson process with the rate of its own density, so draw each one's depth, invert its line integral,
// and take the nearest. No majorant, no null collisions, no step. (numerics X)
Collision first_collision(const ParticleField &field, const Ray &ray, Real end, Event event);

// The ray from where it enters the field's bounds: kernels are measured from its origin, so that should be near.
// `entry` is the distance that was skipped; `end` becomes the distance left. False when the ray misses.
bool enter(const ParticleField &field, Ray &ray, Real &entry, Real &end);

template <class K, class Visit>
void for_each_depth_of(const ParticleField &field, const Ray &ray, Real end, Visit &&visit) {
    for_each_leaf_on_segment(field.tree, ray.origin, ray.direction, Real(0), end, field.support, [&](uint32_t leaf) {
        Passage passed[leaf_points];
        for (uint32_t l = 0; l < leaf_points; ++l) passed[l] = passage(field, leaf * leaf_points + l, ray);
        for (uint32_t l = 0; l < leaf_points; ++l) {
            const Real b_squared = passed[l].b_squared, along = passed[l].along;
            if (!(b_squared < K::support_squared)) continue;
            const uint32_t slot = leaf * leaf_points + l;
            const Real h = field.inverse_h[slot], half = sqrt(K::support_squared - b_squared);
            const Real from = max(-half, -along * h), to = min(half, (end - along) * h);
            if (!(from < to)) continue;
            const Real line =
                from == -half && to == half ? K::chord(b_squared) : K::line(b_squared, to) - K::line(b_squared, from);
            if (line > Real(0)) visit(slot, field.scale[slot] * line);
        }
    });
}

template <class Visit> void for_each_depth(const ParticleField &field, const Ray &ray, Real end, Visit &&visit) {
    Ray near = ray;
    Real entry;
    if (!enter(field, near, entry, end)) return;
    if (field.kernel == Kernel::spline)
        for_each_depth_of<Spline>(field, near, end, visit);
    else
        for_each_depth_of<Poly6>(field, near, end, visit);
}

template <class K, class Visit> void for_each_extinction_of(const ParticleField &field, const Vec3 &x, Visit &&visit) {
    const PointTree &tree = field.tree;
    for_each_leaf_near(tree, x, field.support, [&](uint32_t leaf) {
        for (uint32_t slot = leaf * leaf_points; slot < (leaf + 1) * leaf_points; ++slot) {
            const Real dx = tree.x[slot] - x.x, dy = tree.y[slot] - x.y, dz = tree.z[slot] - x.z;
            const Real h = field.inverse_h[slot];
            const Real part =
                (field.scale[slot] * h) * K::value(sum_of_products(dx, dx, dy, dy, dz, dz) * (h * h)); // S3
            if (part > Real(0)) visit(slot, part);
        }
    });
}

template <class Visit> void for_each_extinction(const ParticleField &field, const Vec3 &x, Visit &&visit) {
    if (field.tree.count == 0) return;
    if (field.kernel == Kernel::spline)
        for_each_extinction_of<Spline>(field, x, visit);
    else
        for_each_extinction_of<Poly6>(field, x, visit);
}

} // namespace wisp::WISP_ARITH
