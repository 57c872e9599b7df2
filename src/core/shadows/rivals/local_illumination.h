// Local illumination environments (Fernandez, Bala, Greenberg 2002): an octree over what never moves, whose cells know
// of each light whether all of them lies in its shadow, none of them, or which few triangles may be in the way.
//
// A cell is looked at when the first ray asks, and only what is proved is taken for known (shaft.h): of what stopped
// that ray whether it stops all; then which triangles may stop any. If they are more than eight the cell is cut into
// eight, as far as depth and memory go, else its rays are traced. A list of triangles is asked one by one, each as its
// tree meets it. So shadows are those of tracing. Lights have an octree each: what is worth cutting for one is not for
// another.
#pragma once
#include "core/shadows/box_shaft.h"

namespace wisp::WISP_ARITH {

// 31    29 28                0
// | kind  | first child, or place of a list, whose first word is its length |
struct LocalCell {
    enum Kind : uint32_t { unknown, full, null, list, cut, complicated };
    Kind kind() const { return static_cast<Kind>(word >> 29); }
    uint32_t place() const { return word & 0x1fffffff; }

    uint32_t word;
};

struct LocalShadows {
    uint32_t light_count;
    int exponent; // of the octrees' steps
    LatticePoint low;
    int64_t edge; // of the root; 0: before the first frame
    ShaftLight *lights;
    LocalCell *cells; // the roots of the lights, then eights
    uint32_t *lists;
    uint32_t cell_count, list_words;
    bool wasteful; // some are of lights that have changed
};

uint64_t local_shadow_bytes(const Scene &scene);
LocalShadows *make_local_shadows(const Scene &scene, Arena &arena); // nullptr: the arena was too small
void begin_frame(LocalShadows &local, const Shadows &shadows);
bool is_shadowed(LocalShadows &local, Shadows &shadows, const ShadowQuery &query);

} // namespace wisp::WISP_ARITH
