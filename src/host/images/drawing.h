// Numbers as colours, and shapes drawn into a picture. Positions are in pixels from the top left corner of the top left
// pixel. All is computed by sums, products and roots, so that drawings have the same bits on every machine.
#pragma once
#include "host/images/picture.h"
#include "wisp/double3.h"

namespace wisp {

// Linear light of the map "magma", from 0 to 1: black, purple, red, orange, light yellow.
Double3 heat_color(double value);

// The heat_color() of one number a pixel, rows from the top, as a part of `most`. A NaN has the colour `none`.
Picture heat_picture(int width, int height, const std::vector<double> &values, double most, const Double3 &none);

// A point and a line of light, a pixel wide, added to the picture. What lies outside is left out.
void add_point(Picture &picture, double x, double y, const Double3 &light);
void add_line(Picture &picture, double x0, double y0, double x1, double y1, const Double3 &light);

// A disc in front of the picture, with a soft edge.
void draw_disc(Picture &picture, double x, double y, double radius, const Double3 &color);

// Pixels that differ in `cells` from the next one to the right or below get `fraction` of the colour.
void draw_borders(Picture &picture, const std::vector<uint64_t> &cells, const Double3 &color, double fraction);

} // namespace wisp
