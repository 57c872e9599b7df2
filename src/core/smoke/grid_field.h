// Smoke as a density grid. Samples lie at the centres of a box's cells. sigma_t is trilinear between them, constant
// over the outer half of the border cells, and zero outside the box. A single sample gives a box of constant density.
//
// Along a ray, trilinear interpolation in one cell is a cubic polynomial. Two-point Gauss-Legendre quadrature
// integrates it exactly, so optical depths and collisions have no step error.
#pragma once
#include "core/geometry/lattice.h"
#include "core/numbers/random.h"
#include "core/smoke/collision.h"
#include "core/smoke/grid_samples.h"
#include "wisp/arena.h"
#include "wisp/scene.h"

namespace wisp::WISP_ARITH {

struct GridField {
    const Real *extinction; // sigma_t by sample: of the box, x fastest, or of the blocks, and of one more that is empty
    Real largest;           // of all samples
    Cell samples;
    // The grid's frame: a point p of the scene has the coordinates dot(axis[i], p - center). Lengths are the scene's.
    Vec3 center, axis[3];
    Box box;         // in the frame
    Lattice between; // in the frame: cell (x, y, z) lies between the samples x - 1 and x, y - 1 and y, z - 1 and z
    Box bounds;      // of the rotated box, in the scene
    const uint32_t *blocks; // nullptr: all samples of the box are there. Else, by place: the block's number
    const uint32_t *place;  // by block
    Cell block_lattice;     // blocks along each edge of the box
    Cell skipped;           // samples of the first block that lie before the box
    uint32_t block_count;   // without the empty one, whose number this is
    uint32_t dimension;     // the first of a photon's two draws (random.h): free path, sample
    bool ready;             // false: the arena was too small

    bool constant() const { return !blocks && samples.x == 1 && samples.y == 1 && samples.z == 1; }
};

// The number of sample (x, y, z) of the box.
inline uint32_t number_of_sample(const GridField &field, const Cell &at) {
    if (!field.blocks) return static_cast<uint32_t>(index_of(field.samples, at));
    const int32_t x = at.x + field.skipped.x, y = at.y + field.skipped.y, z = at.z + field.skipped.z;
    const uint32_t block =
        field.blocks[index_of(field.block_lattice, {x >> log_block_edge, y >> log_block_edge, z >> log_block_edge})];
    constexpr int32_t in_block = block_edge - 1;
    const int32_t row = (z & in_block) << log_block_edge | (y & in_block);
    return min(block, field.block_count) * samples_of_block +
           static_cast<uint32_t>(row << log_block_edge | (x & in_block));
}

// The field without its samples: not ready.
GridField grid_frame(const GridDescription &source);
// The field with its samples, which are made from the arena.
GridField make_grid_field(const GridDescription &source, uint32_t dimension, Arena &arena, Watch watch = {});
uint64_t grid_field_bytes(const GridDescription &source);

// sigma_t at x, per unit of length.
Real extinction(const GridField &field, const Vec3 &x);

// The integral of sigma_t over the ray's distances 0 to `end`.
Real optical_depth(const GridField &field, const Ray &ray, Real end);

// An upper bound of sigma_t in the box: the largest sample that can contribute.
Real majorant(const GridField &field, const Box &box);

// The first collision of a photon that flies along the ray, if there is one before `end` (regular tracking, N-E3): the
// optical depth has grown to -ln(1 - xi). The sample is drawn with probability tent value * sample / sigma_t.
Collision first_collision(const GridField &field, const Ray &ray, Real end, Event event);

// The eight samples around a point, and their trilinear weights (the values of their tents).
struct Corners {
    uint32_t sample[8];
    Real weight[8];
};
// p: a point of the frame in `cell` of GridField::between.
void find_corners(const GridField &field, const Cell &cell, const Vec3 &p, Corners &corners);
// x: a point of the scene. Returns false if it is outside the box.
bool find_corners(const GridField &field, const Vec3 &x, Corners &corners);

// The ray in the field's frame, with its origin moved to its entry into the box. `entry` is the distance skipped, `end`
// becomes the distance left. Returns false if the ray misses the box.
bool enter(const GridField &field, const Ray &ray, Ray &inside, Real &entry, Real &end);

constexpr Real gauss_node = Real(0.57735026918962576451); // 1 / sqrt(3): the nodes of two-point Gauss-Legendre

// The optical depth by sample: visit(sample, its contribution). A sample may be visited more than once.
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
                const Real depth = corners.weight[i] * field.extinction[corners.sample[i]] * half;
                if (depth > Real(0)) visit(corners.sample[i], depth);
            }
        }
        return true;
    });
}

// sigma_t at x by sample: visit(sample, its contribution), unless that is 0. A sample may be visited more than once.
template <class Visit> void for_each_extinction(const GridField &field, const Vec3 &x, Visit &&visit) {
    Corners corners;
    if (!find_corners(field, x, corners)) return;
    for (int i = 0; i < 8; ++i) {
        const Real sigma = corners.weight[i] * field.extinction[corners.sample[i]];
        if (sigma > Real(0)) visit(corners.sample[i], sigma);
    }
}

// Sets sigma to sigma_t at x. Returns the sum over samples of their contribution to it times their source function.
Color radiated(const GridField &field, const Vec3 &x, const Color *source, Real &sigma);

Vec3 position_of_sample(const GridField &field, uint32_t sample);

// A random point around a sample, distributed as the sample's tent; `uniform` holds three numbers from (0, 1).
Vec3 point_of_sample(const GridField &field, uint32_t sample, const Vec3 &uniform);

} // namespace wisp::WISP_ARITH
