// The density of one smoke, in one of three representations: particles, a density grid, or a sparse grid to which
// either was resampled. The functions below dispatch to the representation.
#pragma once
#include "core/numbers/parts.h"
#include "core/smoke/resampled_field.h"

namespace wisp::WISP_ARITH {

struct DensityField {
    bool is_of_grid;
    Needs<parts::resampled> is_resampled; // neither: particles
    ParticleField particles;              // empty for the other representations
    GridField grid;                       // for a resampled grid: its frame only, without samples
    ResampledField resampled;

    bool is_grid() const { return is_grid_of_program(is_of_grid); }
    const Box &bounds() const {
        return is_resampled ? resampled.bricks->bounds : is_grid() ? grid.bounds : particles.bounds;
    }
    bool ready() const { return is_resampled ? resampled.ready : is_grid() ? grid.ready : particles.ready; }
};

inline uint64_t density_field_bytes(const SmokeDescription &source) {
    return source.is_grid() ? grid_field_bytes(source.grid) : particle_field_bytes(source.count);
}

// `bricks` is the sparse grid to resample to, or nullptr. The field takes dimensions_of(source) dimensions of a
// photon's draws (random.h), from `first_dimension` on.
inline DensityField make_density_field(const SmokeDescription &source, const SparseGrid *bricks,
                                       uint32_t first_dimension, Arena &arena, Watch watch = {}) {
    DensityField field = {};
    field.is_resampled = bricks && !source.empty();
    field.is_of_grid = source.is_grid() && !field.is_resampled;
    if (source.is_grid()) field.grid = grid_frame(source.grid);
    if (field.is_resampled)
        field.resampled = resample(source, *bricks, first_dimension, arena, watch);
    else if (field.is_grid())
        field.grid = make_grid_field(source.grid, first_dimension, arena, watch);
    else
        field.particles = make_particle_field(source, first_dimension, arena, watch);
    return field;
}
inline uint32_t dimensions_of(const SmokeDescription &source) { return source.is_grid() ? 2 : source.count; }

// The number of elements that the density is a sum of: particles, which are numbered by slot, or samples.
inline uint32_t elements_of(const SmokeDescription &source) {
    return source.is_grid() ? static_cast<uint32_t>(stored_samples(source.grid)) : source.count;
}

// sigma_t at x, per unit of length.
inline Real extinction(const DensityField &field, const Vec3 &x) {
    if (field.is_resampled) return extinction(field.resampled, x);
    return field.is_grid() ? extinction(field.grid, x) : extinction(field.particles, x);
}

// The integral of sigma_t over the ray's distances 0 to `end`; exact, except for resampled smoke.
inline Real optical_depth(const DensityField &field, const Ray &ray, Real end) {
    if (field.is_resampled) return optical_depth(field.resampled, ray, end);
    return field.is_grid() ? optical_depth(field.grid, ray, end) : optical_depth(field.particles, ray, end);
}

// The optical depth by element, in a fixed order: visit(element, its contribution). An element may be visited more than
// once. Resampled smoke has no elements.
template <class Visit> void for_each_depth(const DensityField &field, const Ray &ray, Real end, Visit &&visit) {
    if (field.is_grid())
        for_each_depth(field.grid, ray, end, visit);
    else
        for_each_depth(field.particles, ray, end, visit);
}

// sigma_t at x by element, in a fixed order: visit(element, its contribution). An element may be visited more than
// once.
template <class Visit> void for_each_extinction(const DensityField &field, const Vec3 &x, Visit &&visit) {
    if (field.is_grid())
        for_each_extinction(field.grid, x, visit);
    else
        for_each_extinction(field.particles, x, visit);
}

// An upper bound of sigma_t in the box.
inline Real majorant(const DensityField &field, const Box &box) {
    if (field.is_resampled) return majorant(field.resampled, box);
    return field.is_grid() ? majorant(field.grid, box) : majorant(field.particles, box);
}

// The first collision of a photon that flies along the ray, if there is one before `end`.
inline Collision first_collision(const DensityField &field, const Ray &ray, Real end, Event event) {
    if (field.is_resampled) return first_collision(field.resampled, ray, end, event);
    return field.is_grid() ? first_collision(field.grid, ray, end, event)
                           : first_collision(field.particles, ray, end, event);
}

} // namespace wisp::WISP_ARITH
