// LDR-FLIP: how different two pictures look to an observer who flips between them. Andersson, Nilsson, Akenine-Moeller,
// Oskarsson, Astrom, Fairchild, "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM
// CGIT 3(2), 2020.
#pragma once
#include "host/images/picture.h"
#include <vector>

namespace wisp {

// The FLIP error of each pixel, 0 (equal) to 1, rows from the top, of the pictures as PNG shows them at exposure 0: a
// display of 3840 pixels and 0.7 m seen from 0.7 m, 67 pixels per degree. Symmetric in a and b, which have equal sizes.
std::vector<double> flip(const Picture &a, const Picture &b);

} // namespace wisp
