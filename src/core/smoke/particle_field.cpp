// Density from particles (S3), its line integrals (N-L), and exact collisions (N-X).
//
// Every function visits leaves in ascending order and adds lane l of each leaf to lane l of the sum. At the end the
// lanes are added in one order (sum_of_lanes). A leaf that is visited although it is too far away adds zeros. So the
// bits do not depend on how tightly the kd-tree culls.
#include "core/smoke/particle_field.h"

namespace wisp::WISP_ARITH {

namespace {

template <class K> Real extinction_of(const K &kernel, const ParticleField &field, const Vec3 &x) {
    const PointTree &tree = field.tree;
    Real sum[lanes] = {};
    for_each_leaf_near(field, x, Real(0), [&](uint32_t leaf) {
        for (uint32_t first = leaf * leaf_points; first < (leaf + 1) * leaf_points; first += lanes)
            for (uint32_t l = 0; l < lanes; ++l) {
                const uint32_t i = first + l;
                const Real dx = tree.x[i] - x.x, dy = tree.y[i] - x.y, dz = tree.z[i] - x.z;
                const Real h = field.inverse_h[i];
                sum[l] += (field.scale[i] * h) * kernel.value(sum_of_products(dx, dx, dy, dy, dz, dz) * (h * h)); // S3
            }
    });
    return sum_of_lanes(sum);
}

template <class K> Real finest_of(const K &kernel, const ParticleField &field, const Ray &ray, Real from, Real to) {
    Real most = Real(0);
    for_each_leaf_on_segment(field, ray, from, to, [&](uint32_t leaf) {
        for (uint32_t i = leaf * leaf_points; i < (leaf + 1) * leaf_points; ++i) {
            const Real h = field.inverse_h[i];
            if (!(most < h)) continue;
            const Passage passed = passage(field, i, ray);
            if (!(passed.b_squared < kernel.support_squared)) continue;
            const Real half = sqrt(kernel.support_squared - passed.b_squared) / h;
            if (passed.along - half < to && from < passed.along + half) most = h;
        }
    });
    return most;
}

template <class K> Real majorant_of(const K &kernel, const ParticleField &field, const Box &box) {
    const PointTree &tree = field.tree;
    const Vec3 middle = (box.low + box.high) * Real(0.5), half = (box.high - box.low) * Real(0.5);
    Real sum[lanes] = {};
    for_each_leaf_near(field, middle, length(half), [&](uint32_t leaf) {
        for (uint32_t first = leaf * leaf_points; first < (leaf + 1) * leaf_points; first += lanes)
            for (uint32_t l = 0; l < lanes; ++l) {
                const uint32_t i = first + l;
                const Real dx = max(abs(tree.x[i] - middle.x) - half.x, Real(0));
                const Real dy = max(abs(tree.y[i] - middle.y) - half.y, Real(0));
                const Real dz = max(abs(tree.z[i] - middle.z) - half.z, Real(0));
                const Real h = field.inverse_h[i];
                sum[l] += (field.scale[i] * h) * kernel.value(sum_of_products(dx, dx, dy, dy, dz, dz) * (h * h));
            }
    });
    return sum_of_lanes(sum);
}

// All lanes do the same work, so that each loop is a vector loop: a particle that the line misses adds 0. A whole chord
// is cheaper than the difference of two line integrals, which only particles near an end of the segment need.
template <class K> Real optical_depth_of(const K &kernel, const ParticleField &field, const Ray &ray, Real end) {
    Real sum[lanes] = {};
    for_each_leaf_on_segment(field, ray, Real(0), end, [&](uint32_t leaf) {
        for (uint32_t first = leaf * leaf_points; first < (leaf + 1) * leaf_points; first += lanes) {
            Real b_squared[lanes], middle[lanes];
            uint32_t any_hit = 0, any_cut = 0; // particles that the line crosses; of those, near an end of the segment
            for (uint32_t l = 0; l < lanes; ++l) {
                const Passage passed = passage(field, first + l, ray);
                b_squared[l] = passed.b_squared;
                middle[l] = passed.along;
                const uint32_t hit = b_squared[l] < kernel.support_squared ? 1u : 0u;
                any_hit |= hit;
                any_cut |= middle[l] < field.support ? hit : 0u;
                any_cut |= end - middle[l] < field.support ? hit : 0u;
            }
            if (!any_hit) continue;
            if (!any_cut) {
                for (uint32_t l = 0; l < lanes; ++l) sum[l] += field.scale[first + l] * kernel.chord(b_squared[l]);
                continue;
            }
            for (uint32_t l = 0; l < lanes; ++l) {
                const Real h = field.inverse_h[first + l],
                           half = sqrt(max(Real(0), kernel.support_squared - b_squared[l]));
                const Real from = min(max(-half, -middle[l] * h), half),
                           to = max(from, min(half, (end - middle[l]) * h));
                const Real b2 = min(b_squared[l], kernel.support_squared);
                sum[l] += field.scale[first + l] * max(Real(0), kernel.line(b2, to) - kernel.line(b2, from));
            }
        }
    });
    return sum_of_lanes(sum);
}

struct Chord {
    Real b_squared, from, to; // in units of h^2 and h
};

// The position t on a chord where the kernel's integral from `from` to t equals `goal`.
template <class K> Real distance_of_depth(const K &kernel, const Chord &chord, Real goal) {
    const Real start = kernel.line(chord.b_squared, chord.from);
    return increasing_root(chord.from, chord.to, [&](Real t, Real &slope) {
        slope = kernel.value(chord.b_squared + t * t);
        return kernel.line(chord.b_squared, t) - start - goal;
    });
}

// Replaces `nearest` if the photon collides with particle `slot` before it. xi is the photon's draw for the particle:
// the optical depth to the collision is -ln(1 - xi) (N-X).
template <class K>
void collide(const K &kernel, const ParticleField &field, const Ray &ray, uint32_t slot, Real xi, Collision &nearest) {
    const PointTree &tree = field.tree;
    const Vec3 to_particle = Vec3(tree.x[slot], tree.y[slot], tree.z[slot]) - ray.origin;
    const Vec3 across = cross(ray.direction, to_particle);
    const Real inverse_h = field.inverse_h[slot], scale = field.scale[slot];
    const Real b_squared = dot(across, across) * (inverse_h * inverse_h);
    if (!(b_squared < kernel.support_squared) || scale == Real(0)) return;

    // The interval of the chord between the ray's origin and `nearest`, in units of h from the closest approach.
    const Real middle = dot(to_particle, ray.direction), half = sqrt(kernel.support_squared - b_squared);
    const Real from = max(-half, -middle * inverse_h), to = min(half, (nearest.distance - middle) * inverse_h);
    if (!(from < to)) return;
    const Chord chord = {b_squared, from, to};
    const Real goal = -log1p(-xi) / scale;
    if (kernel.line(b_squared, to) - kernel.line(b_squared, from) < goal) return;
    const Real distance = middle + distance_of_depth(kernel, chord, goal) / inverse_h;
    nearest = {true, min(max(Real(0), distance), nearest.distance), slot};
}

template <class K>
Collision first_collision_of(const K &kernel, const ParticleField &field, const Ray &ray, Real end, Event event) {
    const PointTree &tree = field.tree;
    constexpr Real rounding = Real(0x1p-20);
    Collision nearest = {false, end, 0};
    for_each_leaf_on_segment(tree, ray.origin, ray.direction, Real(0), end, field.support, [&](uint32_t leaf) {
        for (uint32_t first = leaf * leaf_points; first < (leaf + 1) * leaf_points; first += lanes) {
            // A collision needs xi <= 1 - e^-depth <= depth. Two tests on whole vectors bound the depth: first by that
            // of the line through the particle's centre, then by an upper bound of this line's chord.
            uint32_t bits[lanes], candidates = 0;
            for (uint32_t l = 0; l < lanes; ++l) {
                bits[l] = draw(event, field.first_dimension + tree.id[first + l]);
                candidates |= bits[l] <= field.max_draw[first + l] ? 1u : 0u;
            }
            if (!candidates) continue;
            Real xi[lanes], bound[lanes];
            uint32_t likely = 0;
            for (uint32_t l = 0; l < lanes; ++l) {
                bound[l] =
                    field.scale[first + l] * chord_bound(kernel, passage(field, first + l, ray).b_squared) + rounding;
                xi[l] = unit_open<Real>(bits[l]);
                likely |= xi[l] <= bound[l] ? 1u : 0u;
            }
            if (!likely) continue;
            for (uint32_t l = 0; l < lanes; ++l)
                if (xi[l] <= bound[l]) collide(kernel, field, ray, first + l, xi[l], nearest);
        }
    });
    return nearest;
}

// An optical depth as a fraction of 2^32, rounded up. A draw that collides within depth x is at most 1 - e^-x <= x.
template <class T> uint32_t fraction_above(T x) {
    if (!(x < T(1))) return 0xffffffffu;
    uint32_t bits;
    if constexpr (std::is_same_v<T, Fixed>)
        bits = static_cast<uint32_t>(x.raw());
    else
        bits = static_cast<uint32_t>(x * T(0x1p32));
    return bits < 0xffffffffu ? bits + 1 : bits;
}

} // namespace

bool enter(const ParticleField &field, Ray &ray, Real &entry, Real &end) {
    entry = Real(0);
    if (field.tree.count == 0 || !clip(field.bounds, ray, entry, end)) return false;
    if (entry > Real(0)) ray.origin += ray.direction * entry;
    end -= entry;
    return true;
}

WISP_MULTIVERSIONED Real extinction(const ParticleField &field, const Vec3 &x) {
    if (field.tree.count == 0) return Real(0);
    return with_kernel(field.kernel, [&](const auto &kernel) { return extinction_of(kernel, field, x); });
}

WISP_MULTIVERSIONED Real finest_on_segment(const ParticleField &field, const Ray &ray, Real from, Real to) {
    if (field.tree.count == 0) return Real(0);
    return with_kernel(field.kernel, [&](const auto &kernel) {
        return finest_of(kernel, field, ray, from, to) * (Real(2) / kernel.support); // that of poly6 is 2 H
    });
}

WISP_MULTIVERSIONED Real majorant(const ParticleField &field, const Box &box) {
    if (field.tree.count == 0) return Real(0);
    return with_kernel(field.kernel, [&](const auto &kernel) { return majorant_of(kernel, field, box); });
}

WISP_MULTIVERSIONED Real optical_depth(const ParticleField &field, const Ray &ray, Real end) {
    Ray near = ray;
    Real entry;
    if (!enter(field, near, entry, end)) return Real(0);
    return with_kernel(field.kernel, [&](const auto &kernel) { return optical_depth_of(kernel, field, near, end); });
}

WISP_MULTIVERSIONED Collision first_collision(const ParticleField &field, const Ray &ray, Real end, Event event) {
    Ray near = ray;
    Real entry;
    if (!enter(field, near, entry, end)) return {false, end, 0};
    Collision collision = with_kernel(
        field.kernel, [&](const auto &kernel) { return first_collision_of(kernel, field, near, end, event); });
    collision.distance += entry;
    return collision;
}

uint64_t particle_field_bytes(uint32_t particles) {
    const uint64_t slots = point_tree_slots(particles);
    return Arena::bytes<Vec3>(particles) + point_tree_bytes(particles) + 2 * Arena::bytes<Real>(slots) +
           Arena::bytes<uint32_t>(slots);
}

ParticleField make_particle_field(const SmokeDescription &source, uint32_t first_dimension, Arena &arena, Watch watch) {
    ParticleField field = {};
    field.first_dimension = first_dimension;
    field.kernel = source.kernel;
    const AnyKernel kernel = {source.kernel == Kernel::spline};
    field.support = Real(2) * to_real<Real>(source.largest_h);

    const uint32_t slots = point_tree_slots(source.count);
    Real *inverse_h = arena.make<Real>(slots), *scale = arena.make<Real>(slots);
    uint32_t *max_draw = arena.make<uint32_t>(slots);
    Vec3 *points = arena.make<Vec3>(source.count);
    if (!inverse_h || !scale || !max_draw || !points) return field;

    watch.expect(uint64_t{source.count} / 2);
    for (uint32_t i = 0; i < source.count; ++i) {
        if (!watch.done_round(i, 256)) return field;
        points[i] = vec_of(source.particles[i].position);
        inverse_h[i] = Real(2) * to_real<Real>(source.particles[i].h); // the support, until there are slots
        field.bounds.low = i == 0 ? points[i] : min(field.bounds.low, points[i]);
        field.bounds.high = i == 0 ? points[i] : max(field.bounds.high, points[i]);
    }
    field.bounds.low -= Vec3(field.support);
    field.bounds.high += Vec3(field.support);
    field.tree = build_point_tree(points, source.count, arena, watch, inverse_h);
    if (!field.tree.ready) return field;

    for (uint32_t slot = 0; slot < slots; ++slot) {
        if (!watch.done_round(slot, 256)) return field;
        if (slot >= source.count) { // an empty slot
            inverse_h[slot] = scale[slot] = Real(0);
            max_draw[slot] = 0;
            continue;
        }
        const Particle &particle = source.particles[field.tree.id[slot]];
        const Real h = to_real<Real>(particle.h) * (Real(2) / kernel.support); // the h of poly6 is its support
        inverse_h[slot] = Real(1) / h;
        scale[slot] = to_real<Real>(particle.area) * kernel.constant * inverse_h[slot] * inverse_h[slot];
        max_draw[slot] = fraction_above(scale[slot] * kernel.line_maximum);
    }
    field.inverse_h = inverse_h;
    field.scale = scale;
    field.max_draw = max_draw;
    field.ready = true;
    return field;
}

} // namespace wisp::WISP_ARITH
