// Smoke as a density field of particles (S3): extinction at a point, optical depth of a segment in closed form (N-L),
// and a photon's next collision (N-X).
#pragma once
#include "core/geometry/point_kdtree.h"
#include "core/numbers/random.h"
#include "core/smoke/collision.h"
#include "core/smoke/kernel.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

// sigma_t(x) = sum_i scale_i / h_i f(|x - x_i|^2 / h_i^2). All arrays are indexed by the slots of the tree. In the
// empty slots of the last leaf, inverse_h and scale are 0.
struct ParticleField {
    PointTree tree;
    Kernel kernel;
    const Real *inverse_h; // 1 / h_i, where h_i is the h of the kernel (kernel.h)
    const Real *scale;     // area_i C h_i^-2: times the kernel's line integral, it is the optical depth of a line
    // The optical depth of the line through the particle's centre, as a fraction of 2^32. A photon whose draw for the
    // particle is larger cannot collide with it, wherever its ray runs.
    const uint32_t *max_draw;
    uint32_t first_dimension; // particle i uses dimension first_dimension + i of a photon's draws (random.h)
    Real support;             // the largest support radius
    Box bounds;               // of all supports
    bool ready;               // false: the arena was too small
};

// The point of closest approach of a ray's line to a particle: its squared distance from the centre in units of h^2,
// and its distance along the ray.
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

// The leaves that may hold a particle whose support comes within `distance` of x, in ascending order.
template <class Visit>
WISP_INLINE void for_each_leaf_near(const ParticleField &field, const Vec3 &x, Real distance, Visit &&visit) {
    if (field.tree.has_radii)
        for_each_leaf_reaching(field.tree, x, distance, field.support, visit);
    else
        for_each_leaf_near(field.tree, x, field.support + distance, visit);
}

// The leaves that may hold a particle whose support meets the ray's distances `from` to `to`, in ascending order.
template <class Visit>
WISP_INLINE void for_each_leaf_on_segment(const ParticleField &field, const Ray &ray, Real from, Real to,
                                          Visit &&visit) {
    if (field.tree.has_radii)
        for_each_leaf_reaching_segment(field.tree, ray.origin, ray.direction, from, to, field.support, visit);
    else
        for_each_leaf_on_segment(field.tree, ray.origin, ray.direction, from, to, field.support, visit);
}

// The field of `source`. All arrays are made from the arena.
ParticleField make_particle_field(const SmokeDescription &source, uint32_t first_dimension, Arena &arena,
                                  Watch watch = {});
uint64_t particle_field_bytes(uint32_t particles);

// sigma_t at x, per unit of length.
Real extinction(const ParticleField &field, const Vec3 &x);

// The integral of sigma_t over the ray's distances 0 to `end`, in closed form: there is no step error.
Real optical_depth(const ParticleField &field, const Ray &ray, Real end);

// The same by particle, in a fixed order: visit(slot, its contribution) for each particle that the ray crosses.
template <class Visit> void for_each_depth(const ParticleField &field, const Ray &ray, Real end, Visit &&visit);

// sigma_t at x by particle, in a fixed order: visit(slot, its contribution), unless that is 0.
template <class Visit> void for_each_extinction(const ParticleField &field, const Vec3 &x, Visit &&visit);

// 1 / H of the particle with the smallest smoothing length H whose support meets the ray's distances `from` to `to`; 0
// where there is none.
Real finest_on_segment(const ParticleField &field, const Ray &ray, Real from, Real to);

// An upper bound of sigma_t in the box: the sum of each particle's density at the nearest point of the box.
Real majorant(const ParticleField &field, const Box &box);

// The first collision of a photon that flies along the ray, if there is one before `end` (N-X). Each particle is an
// independent Poisson process with the rate of its own density. So a depth is drawn for each particle, its line
// integral is inverted, and the nearest collision is taken. There are no majorant, no null collisions and no step.
Collision first_collision(const ParticleField &field, const Ray &ray, Real end, Event event);

// Moves the ray's origin to its entry into the field's bounds. Distances from the origin then stay small, which keeps
// their resolution. `entry` is the distance skipped, `end` becomes the distance left. Returns false if the ray misses.
bool enter(const ParticleField &field, Ray &ray, Real &entry, Real &end);

template <class K, class Visit>
void for_each_depth_of(const K &kernel, const ParticleField &field, const Ray &ray, Real end, Visit &&visit) {
    for_each_leaf_on_segment(field, ray, Real(0), end, [&](uint32_t leaf) {
        Passage passed[leaf_points];
        for (uint32_t l = 0; l < leaf_points; ++l) passed[l] = passage(field, leaf * leaf_points + l, ray);
        for (uint32_t l = 0; l < leaf_points; ++l) {
            const Real b_squared = passed[l].b_squared, along = passed[l].along;
            if (!(b_squared < kernel.support_squared)) continue;
            const uint32_t slot = leaf * leaf_points + l;
            const Real h = field.inverse_h[slot], half = sqrt(kernel.support_squared - b_squared);
            const Real from = max(-half, -along * h), to = min(half, (end - along) * h);
            if (!(from < to)) continue;
            const Real line = from == -half && to == half ? kernel.chord(b_squared)
                                                          : kernel.line(b_squared, to) - kernel.line(b_squared, from);
            if (line > Real(0)) visit(slot, field.scale[slot] * line);
        }
    });
}

template <class Visit> void for_each_depth(const ParticleField &field, const Ray &ray, Real end, Visit &&visit) {
    Ray near = ray;
    Real entry;
    if (!enter(field, near, entry, end)) return;
    with_kernel(field.kernel, [&](const auto &kernel) { for_each_depth_of(kernel, field, near, end, visit); });
}

template <class K, class Visit>
void for_each_extinction_of(const K &kernel, const ParticleField &field, const Vec3 &x, Visit &&visit) {
    const PointTree &tree = field.tree;
    for_each_leaf_near(field, x, Real(0), [&](uint32_t leaf) {
        for (uint32_t slot = leaf * leaf_points; slot < (leaf + 1) * leaf_points; ++slot) {
            const Real dx = tree.x[slot] - x.x, dy = tree.y[slot] - x.y, dz = tree.z[slot] - x.z;
            const Real h = field.inverse_h[slot];
            const Real sigma =
                (field.scale[slot] * h) * kernel.value(sum_of_products(dx, dx, dy, dy, dz, dz) * (h * h)); // S3
            if (sigma > Real(0)) visit(slot, sigma);
        }
    });
}

template <class Visit> void for_each_extinction(const ParticleField &field, const Vec3 &x, Visit &&visit) {
    if (field.tree.count == 0) return;
    with_kernel(field.kernel, [&](const auto &kernel) { for_each_extinction_of(kernel, field, x, visit); });
}

} // namespace wisp::WISP_ARITH
