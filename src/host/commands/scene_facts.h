// What a scene holds, and how it is rendered where no option is given.
#pragma once
#include "host/commands/facts.h"
#include "host/commands/request.h"

namespace wisp {

// Adds the facts of its first frame. A scene without a view, as a file that others include, is not prepared, and its
// particles and grids are not read. Throws Error as `wisp plan` does, but not for want of memory.
void add_scene_file(Facts &facts, const std::string &path);

// Adds the optical depths of the first frame's camera rays that meet smoke, in smoke as it is rendered.
void add_optical_depth(Facts &facts, Request request);

} // namespace wisp
