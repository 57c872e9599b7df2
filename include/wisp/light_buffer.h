// The light buffer (Haines, Greenberg 1986): a cube of cells around each light, each with the opaque still triangles
// that may be seen through it from the light, nearest first.
//
// A shadow ray asks the triangles of the cell that it arrives through, one by one, as far as its own point; each is met
// as its tree meets it. Lists hold all that rays through the cell may hit, by the margin of shaft.h and a step: on the
// cube's lattice a ray is the segment from the light to the ray's point, both rounded down. So shadows are those of
// tracing. They are made when the light is first seen, and all anew when a light has changed. Rays to parallel lights
// are traced, and those to lights whose lists have no room.
#pragma once
#include "wisp/shaft.h"

namespace wisp::WISP_ARITH {

struct BufferEntry {
    uint32_t triangle;
    int32_t depth; // no point of it that is hit is nearer to the light, in steps along the face's axis
};

struct BufferLight {
    Light light; // as it was when its lists were made
    ShaftLattice lattice;
    LatticePoint at;
    uint32_t *first; // of each cell's entries, and behind the last
    bool ready;
};

struct LightBuffer {
    uint32_t light_count;
    bool made;
    uint64_t capacity; // of ...
    BufferEntry *entries;
    BufferLight *lights;
};

uint64_t light_buffer_bytes(const Scene &scene);
LightBuffer *make_light_buffer(const Scene &scene, Arena &arena); // nullptr: the arena was too small
void begin_frame(LightBuffer &buffer, const Shadows &shadows);
bool is_shadowed(LightBuffer &buffer, Shadows &shadows, const ShadowQuery &query);

} // namespace wisp::WISP_ARITH
