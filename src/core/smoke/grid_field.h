// Smoke as a density grid: trilinear between samples at the centres of the cells of a box, constant over the outer half
// of the border cells, zero outside. With a single sample it is a box of constant density.
//
// Along a ray a trilinear cell is a cubic polynomial, which two points of Gauss and Legendre integrate exactly: optical
// depths and collisions have no step.
#pragma once
#include "core/geometry/lattice.h"
#include "core/numbers/random.h"
#include "core/smoke/collision.h"
#include "wisp/arena.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

struct GridField {
    const Real *extinction; // sigma_t of sample (x, y, z) at [(z * samples.y + y) * samples.x + x]
    Cell samples;
    // The grid's own frame: p is at (dot(axis[0], p - center), ...), lengths are the scene's.
    Vec3 center, axis[3];
    Box box;            // in that frame
    Lattice between;    // in that frame: cell (x, y, z) lies between the samples x - 1 and x, y - 1 and y, z - 1 and z
    Box bounds;         // of the turned box, in the scene
    uint32_t dimension; // of a photon's draws: free path, sample
    bool ready;         // false: the arena was too small

    bool constant() const { return samples.x == 1 && samples.y == 1 && samples.z == 1; }
};

GridField grid_frame(const GridDescription &source); // all but the samples: not ready
GridField make_grid_field(const GridDescription &source, uint32_t dimension, Arena &arena);
uint64_t grid_field_bytes(const GridDescription &source);

// As for particles: sigma_t at x; its integral over the ray's distances 0 to `end`; an upper bound in a box.
Real extinction(const GridField &field, const Vec3 &x);
Real optical_depth(const GridField &field, const Ray &ray, Real end);
Real majorant(const GridField &field, const Box &box);

// Where a photon that starts along the ray collides, if before `end`: where the optical depth has grown to -ln xi. The
// sample is drawn with its tent's share of the density there.
Collision first_collision(const GridField &field, const Ray &ray, Real end, Event event);

// The samples around a point of a cell of the field's frame, and the tents' values there.
struct Corners {
    uint32_t sample[8];
    Real weight[8];
};
void find_corners(const GridField &field, const Cell &cell, const Vec3 &p, Corners &corners);
bool find_corners(const GridField &field, const Vec3 &x, Corners &corners); // of a point of the scene; false: outside

// The ray in the field's frame from where it enters the box, as for particles: `entry` was skipped, `end` is left.
bool enter(const GridField &field, const Ray &ray, Ray &inside, Real &entry, Real &end);

constexpr Real gauss_node = Real(0.57735026918962576451); // 1 / sqrt(3): two such points integrate a cubic

// The optical depth sample by sample: visit(sample, its part of it), a sample more than once.
template <class Visit> void for_each_depth(const GridField &field, const Ray &ray, Real end, Visit &&visit) {
    Ray inside;
    Real entry;
    if (!enter(field, ray, inside, entry, end)) return;
    for_each_cell(field.between, inside, Real(0), end, [&](const Cell &cell, Real from, Real to) {
        const Real half = (to - from) * Real(0.5), middle = from + half;
        for (int point = 0; point < 2; ++point) {
            const Real t = middle + (point ? gauss_node : -gauss_node) * half;
            Corners corners;
            find_corners(field, cell, inside.origin + inside.direction * t, corners);
            for (int i = 0; i < 8; ++i) {
                const Real part = corners.weight[i] * field.extinction[corners.sample[i]] * half;
                if (part > Real(0)) visit(corners.sample[i], part);
            }
        }
        return true;
    });
}

// sigma_t at x sample by sample: visit(sample, its part of it) where that is not 0, a sample more than once.
template <class Visit> void for_each_extinction(const GridField &field, const Vec3 &x, Visit &&visit) {
    Corners corners;
    if (!find_corners(field, x, corners)) return;
    for (int i = 0; i < 8; ++i) {
        const Real part = corners.weight[i] * field.extinction[corners.sample[i]];
        if (part > Real(0)) visit(corners.sample[i], part);
    }
}

// sigma_t at x, and the sum of what each sample has in it times the sample's source function.
Color radiated(const GridField &field, const Vec3 &x, const Color *source, Real &sigma);

Vec3 position_of_sample(const GridField &field, uint32_t sample);

// A point of the density around a sample: uniform draws become an offset with the density of the sample's tent.
Vec3 point_of_sample(const GridField &field, uint32_t sample, const Vec3 &uniform);

} // namespace wisp::WISP_ARITH
