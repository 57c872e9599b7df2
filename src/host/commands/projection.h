// Where points of a scene are in a drawing: as the camera sees them, or on a section through the scene.
#pragma once
#include "host/base/double3_algebra.h"
#include "wisp/settings.h"
#include <vector>

namespace wisp {

struct PicturePoint { // in pixels from the top left corner
    double x, y;
};

// The camera's picture. A depth is the distance from the eye along the camera's axis, in units of that of the plane
// where Camera::corner lies.
class Projection {
  public:
    Projection(const Camera &camera, const Crop &crop);

    double depth(const Double3 &point) const { return dot(point - camera_.origin, axis_) / to_plane_; }
    // Of a point in front of the eye.
    PicturePoint place(const Double3 &point) const;
    // In pixels, of a length at a depth.
    double size(double length_there, double depth) const { return length_there / (depth * length(camera_.right)); }
    // The distance of the points of a depth from the eye, along the camera's axis.
    double distance(double depth) const { return depth * std::fabs(to_plane_) / length(axis_); }
    // What the pixels' middles show at a depth.
    std::vector<Double3> plane(double depth) const;

  private:
    const Camera &camera_;
    const Crop &crop_;
    Double3 axis_;    // at right angles to the picture; of any length
    double to_plane_; // from the eye, in units of that length
};

// A plane seen from above: that of the eye and of a row of the picture. The eye looks upwards.
class Section {
  public:
    Section(const Camera &camera, int row);

    // Moves the picture to where the section meets the scene's triangles. It has that many pixels, of which the crop is
    // drawn. False: it meets none.
    bool fit(const Scene &scene, int width, int height, const Crop &crop);

    struct Segment {
        PicturePoint from, to;
    };
    // Where it meets triangles, in pixels of the crop.
    const std::vector<Segment> &segments() const { return segments_; }
    // What the middles of the crop's pixels show.
    std::vector<Double3> points(const Crop &crop) const;

  private:
    void add_triangle(const Double3 (&corner)[3]);
    void add_triangles(const Scene &scene);

    Double3 eye_, right_, ahead_, normal_; // unit vectors
    PicturePoint corner_ = {0, 0};         // the crop's top left one, in lengths along right_ and against ahead_
    double pixel_ = 1;                     // length of its sides
    std::vector<Segment> segments_;        // before fit(): in lengths from the eye
};

} // namespace wisp
