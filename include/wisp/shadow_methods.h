// The techniques that find hard shadows of surfaces: one line each, with the name that users type and how it works.
// A technique `NAME` is the object NAME_technique of one file in src/core/shadows; adding one takes that file and a
// line here. All but `paper` make the pictures of `trace`.
#pragma once
#include <cstdint>

#define WISP_SHADOW_METHODS(METHOD)                                                                                    \
    METHOD(trace, "a ray for each")                                                                                    \
    METHOD(cache, "the last occluder first, then a ray")                                                               \
    METHOD(paper, "by what rays met before, else a ray")                                                               \
    METHOD(exact, "no ray where proved for a cell of a still triangle")                                                \
    METHOD(voxel, "no ray where proved for a voxel")                                                                   \
    METHOD(lightbuffer, "lists of what each light sees")                                                               \
    METHOD(lie, "lists for the cells of an octree")

namespace wisp {

#define METHOD(name, how) name,
enum class ShadowMethod : uint8_t { WISP_SHADOW_METHODS(METHOD) };
#undef METHOD

} // namespace wisp
