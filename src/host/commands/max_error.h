// --max-error: the photons and cells, or the passes of the reference, that keep a picture's error below what is asked
// for.
#pragma once
#include "host/commands/request.h"

namespace wisp {

// If options.max_error is given, sets the photons and, where it takes others, the spacings of cells and steps, or
// --reference and its passes, for all frames. Some pixels of the first frame are rendered in several ways, in f32: so
// the choice depends neither on the arithmetic nor on the machine. Says what was chosen, the estimated error, and about
// how long a frame takes. Throws Error.
void choose_for_error(Request &request);

// Throws Error(exit_usage) for options that choose the same as --max-error, and for commands that make no picture.
void check_max_error(const Request &request, bool makes_picture);

} // namespace wisp
