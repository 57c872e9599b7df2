// A deep shadow map (Lokovic & Veach 2000): optical depths along lines that start at a light and cross resampled smoke.
// The lines are so close together that the depth at any point is interpolated between them. Finding the depth of a node
// is then an interpolation instead of a ray: where smoke is many nodes deep, there are far fewer lines than nodes.
//
// The lines of a parallel light are parallel. The lines of other lights leave its position through the six faces of a
// cube around it; each face has a map of its own. The lines meet any plane across the axis of their face in a regular
// lattice of rows and columns. Each line stores its depth at the borders of layers; along the line a layer is no
// thicker than a cell of the sparse grid.
#pragma once
#include "core/lights/light.h"
#include "core/smoke/medium.h"

namespace wisp::WISP_ARITH {

constexpr uint32_t light_faces = 6;

// The face of the light whose lines reach x: 2 axis if they ascend along the axis, 2 axis + 1 if they descend.
uint32_t light_face(const Light &light, const Vec3 &x);

// Whether the smoke is cut off: its density is above 0 at the faces of a grid. The medium's density then jumps there.
bool is_cut_off(const Medium &medium);

class DeepShadowMap {
  public:
    // The map of one face of the light, for all points of `bounds`. The medium is resampled. Where the lines are
    // farthest apart, their distance is 1.5 cells of the medium's bricks. `cut_off` is is_cut_off(medium).
    DeepShadowMap(const Medium &medium, bool cut_off, const Light &light, uint32_t face, const Box &bounds);

    // The number of lines; 0 where the face looks away from the bounds, or has 2^14 rows, columns or layers and more.
    uint64_t count() const { return uint64_t{count_[0]} * count_[1]; }
    uint32_t rows() const { return count_[1]; }
    // The number of values of the rows that are in memory at a time.
    uint64_t cache_size() const { return uint64_t{cached_rows} * count_[0] * (layers_ + 1); }

    // The row of lines before x, from 1 to rows() - 3; x lies on the face and in the bounds.
    uint32_t row_of(const Vec3 &x) const { return static_cast<uint32_t>(truncate(place_of(x).v)); }
    // A box around all of the lines from which the depth of x is interpolated, as far as they are in the layer of x. It
    // reaches out of the smoke's bounds to the sides only.
    Box lines_around(const Vec3 &x) const;
    // Makes room for a row in `cache`, which has cache_size() values and holds the last four rows that were begun. The
    // depths of a line are found when they are first needed.
    void begin_row(uint32_t row, Real *cache) const;
    // The optical depth between the light and x: cubic across lines, linear along them. The rows row_of(x) - 1 to
    // row_of(x) + 2 are in the cache. Adds the lines that it had to find to `found`. Below 0: a line nearby misses
    // smoke that is cut off, and the depth cannot be interpolated.
    Real depth(const Vec3 &x, Real *cache, uint64_t &found) const;

  private:
    static constexpr uint32_t cached_rows = 4;
    struct Place {
        Real u, v, layer; // column, row and layer, with fractions
    };
    Place place_of(const Vec3 &x) const;
    Real *line(Real *cache, uint32_t row, uint32_t column) const {
        return cache + (size_t{row % cached_rows} * count_[0] + column) * (layers_ + 1);
    }
    void find_line(uint32_t row, uint32_t column, Real *depth) const;

    const Medium *medium_;
    bool cut_off_, fans_; // fans_: the lines leave one point
    int32_t axis_, side_[2];
    Vec3 from_;                          // where height is 0: the light's position, or the middle of the bounds
    Real slope_[2];                      // of a parallel light's lines: offset to each side per unit of height
    Real sign_;                          // of the direction along the axis in which height grows
    Real begin_, layer_, inverse_layer_; // the height of the first layer; the thickness of a layer
    uint32_t layers_ = 0;
    Real low_[2], distance_[2], inverse_distance_[2]; // of the lines to each side; fans: as slopes
    uint32_t count_[2] = {0, 0};
};

} // namespace wisp::WISP_ARITH
