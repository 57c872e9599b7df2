// What marching, shadows and photons ask of smoke, whatever its density is made of: particles, a grid, or bricks to
// which either was resampled.
#pragma once
#include "core/smoke/resampled_field.h"

namespace wisp::WISP_ARITH {

struct DensityField {
    bool is_grid, is_bricks; // or neither: particles
    ParticleField particles; // empty where they are not
    GridField grid;          // of one that is resampled its frame
    ResampledField bricks;

    const Box &bounds() const { return is_bricks ? bricks.bricks->bounds : is_grid ? grid.bounds : particles.bounds; }
    bool ready() const { return is_bricks ? bricks.ready : is_grid ? grid.ready : particles.ready; }
};

inline uint64_t density_field_bytes(const SmokeDescription &source) {
    return source.is_grid() ? grid_field_bytes(source.grid) : particle_field_bytes(source.count);
}

// `bricks`: to resample to, or nullptr. `first_dimension`: of a photon's draws; those of one field are `dimensions_of`
// it.
inline DensityField make_density_field(const SmokeDescription &source, const SparseGrid *bricks, uint32_t first_dimension,
                                       Arena &arena) {
    DensityField field = {};
    field.is_bricks = bricks && !source.empty();
    field.is_grid = source.is_grid() && !field.is_bricks;
    if (source.is_grid()) field.grid = grid_frame(source.grid);
    if (field.is_bricks)
        field.bricks = resample(source, *bricks, first_dimension, arena);
    else if (field.is_grid)
        field.grid = make_grid_field(source.grid, first_dimension, arena);
    else
        field.particles = make_particle_field(source, first_dimension, arena);
    return field;
}
inline uint32_t dimensions_of(const SmokeDescription &source) { return source.is_grid() ? 2 : source.count; }

// What the density is made of: particles by slot, or samples.
inline uint32_t elements_of(const SmokeDescription &source) {
    return source.is_grid() ? static_cast<uint32_t>(source.grid.count()) : source.count;
}

// sigma_t at x, per unit of length.
inline Real extinction(const DensityField &field, const Vec3 &x) {
    if (field.is_bricks) return extinction(field.bricks, x);
    return field.is_grid ? extinction(field.grid, x) : extinction(field.particles, x);
}

// int sigma_t over the ray's distances 0 to `end`, in closed form but for bricks.
inline Real optical_depth(const DensityField &field, const Ray &ray, Real end) {
    if (field.is_bricks) return optical_depth(field.bricks, ray, end);
    return field.is_grid ? optical_depth(field.grid, ray, end) : optical_depth(field.particles, ray, end);
}

// The optical depth element by element, in a fixed order: visit(element, its part), an element perhaps more than once.
// Bricks have no elements.
template <class Visit> void for_each_depth(const DensityField &field, const Ray &ray, Real end, Visit &&visit) {
    if (field.is_grid)
        for_each_depth(field.grid, ray, end, visit);
    else
        for_each_depth(field.particles, ray, end, visit);
}

// sigma_t at x element by element, in a fixed order: visit(element, its part), an element perhaps more than once.
template <class Visit> void for_each_extinction(const DensityField &field, const Vec3 &x, Visit &&visit) {
    if (field.is_grid)
        for_each_extinction(field.grid, x, visit);
    else
        for_each_extinction(field.particles, x, visit);
}

// An upper bound of sigma_t in the box.
inline Real majorant(const DensityField &field, const Box &box) {
    if (field.is_bricks) return majorant(field.bricks, box);
    return field.is_grid ? majorant(field.grid, box) : majorant(field.particles, box);
}

// Where a photon that starts along the ray collides first, if before `end`.
inline Collision first_collision(const DensityField &field, const Ray &ray, Real end, Event event) {
    if (field.is_bricks) return first_collision(field.bricks, ray, end, event);
    return field.is_grid ? first_collision(field.grid, ray, end, event)
                         : first_collision(field.particles, ray, end, event);
}

} // namespace wisp::WISP_ARITH
