// Columns of light: lines along which a light shines through resampled smoke, so close together that the depths along
// them give those of any point between. A node then costs an interpolation in place of a ray of its own: where smoke is
// many nodes deep, columns are few.
//
// The lines of a parallel light are parallel; those of other lights leave its position through six faces around it.
// They meet a plane across the axis of their face in a lattice, and keep the depths at the borders of layers, which are
// no thicker along a line than a cell.
#pragma once
#include "core/lights/light.h"
#include "core/smoke/medium.h"

namespace wisp::WISP_ARITH {

constexpr uint32_t light_faces = 6;

// The face of the light's lines on which x lies: twice an axis, and 1 where the lines go down along it.
uint32_t light_face(const Light &light, const Vec3 &x);

// Whether there is smoke at the medium's bounds.
bool is_cut_off(const Medium &medium);

class DeepShadowMap {
  public:
    // Those of one face through all of `bounds`, 1.5 times a cell of the medium's bricks from each other where they are
    // farthest apart. `cut_off`: is_cut_off() of the medium.
    DeepShadowMap(const Medium &medium, bool cut_off, const Light &light, uint32_t face, const Box &bounds);

    // How many there may be; none where the face is not towards the bounds, or there would be beyond 2^28.
    uint64_t count() const { return uint64_t{count_[0]} * count_[1]; }
    uint32_t rows() const { return count_[1]; }
    // Values of the rows that are in memory at a time.
    uint64_t room() const { return uint64_t{kept_rows} * count_[0] * (layers_ + 1); }

    // The row of lines before x, at least 1 and below rows() - 2; x on the face and in the bounds.
    uint32_t row_of(const Vec3 &x) const { return static_cast<uint32_t>(truncate(place_of(x).v)); }
    // `kept` has room() values, in which the last four rows are that were begun. Lines are found when they are asked
    // for, which `found` counts.
    void begin_row(uint32_t row, Real *kept) const;
    // Between the light and x, of whose rows the one before, its own and two behind are kept: cubic across lines,
    // linear along them.
    Real depth(const Vec3 &x, Real *kept, uint64_t &found) const;

  private:
    static constexpr uint32_t kept_rows = 4;
    struct Place {
        Real u, v, layer; // across lines and along them, in their own distances
    };
    Place place_of(const Vec3 &x) const;
    Real *line(Real *kept, uint32_t row, uint32_t column) const {
        return kept + (size_t{row % kept_rows} * count_[0] + column) * (layers_ + 1);
    }
    void find_line(uint32_t row, uint32_t column, Real *depth) const;

    const Medium *medium_;
    bool cut_off_, fans_;
    int32_t axis_, side_[2];
    Vec3 from_;     // where height is 0: the light, or the middle of the bounds
    Real slope_[2]; // of a parallel light's lines: how far they go aside for each unit of height
    Real sign_;     // whither height grows along the axis
    Real begin_, layer_, inverse_layer_;
    uint32_t layers_ = 0;
    Real low_[2], distance_[2], inverse_distance_[2];
    uint32_t count_[2] = {0, 0};
};

} // namespace wisp::WISP_ARITH
