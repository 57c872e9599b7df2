// The light buffer.
#include "wisp/light_buffer.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr int64_t cells = 128; // along an edge of a face
constexpr uint32_t faces = 6, cell_count = faces * cells * cells;
constexpr uint64_t most_entries = 1u << 23; // of all lights

uint64_t capacity_for(const Scene &scene) {
    return std::min(most_entries, uint64_t{scene.light_count} * (64 * uint64_t{scene.still_count} + cell_count));
}

// Faces 0, 1 look along +x, -x and so on; across a face's axis a are b = a + 1 and c = a + 2.
struct Face {
    explicit Face(uint32_t face)
        : index(face), a(static_cast<int>(face / 2)), b(a == 2 ? 0 : a + 1), c(b == 2 ? 0 : b + 1),
          sign(face % 2 ? -1 : 1) {}
    uint32_t index;
    int a, b, c, sign;
};
uint32_t index_of(const Face &face, int64_t i, int64_t j) {
    return static_cast<uint32_t>((face.index * cells + j) * cells + i);
}
// Of a direction across / along, both from the light: -1 to 1 for what is seen through the face.
int64_t cell_of(int64_t across, int64_t along) {
    const int64_t n = (across + along) * cells, d = 2 * along; // d > 0
    const int64_t floor = n >= 0 ? n / d : -((-n + d - 1) / d);
    return std::min(std::max(floor, int64_t{0}), cells - 1);
}

// The cells of a row that points within `margin` of the triangle may be seen through; first > last: none.
struct Row {
    int64_t first, last;
};
Row row_of(const LatticePoint (&t)[3], const Face &face, int axis, int64_t margin) {
    Row row = {cells, -1};
    bool left = true, right = true;
    for (const LatticePoint &p : t) {
        const int64_t along = face.sign * p.x[face.a], across = p.x[axis];
        if (along <= margin) return {0, cells - 1}; // some of it is beside the light or behind
        for (const int64_t side : {-margin, margin})
            for (const int64_t end : {-margin, margin}) {
                const int64_t at_across = across + side, at_along = along + end;
                left = left && at_across < -at_along;
                right = right && at_across > at_along;
                const int64_t cell = cell_of(at_across, at_along);
                row.first = std::min(row.first, cell);
                row.last = std::max(row.last, cell);
            }
    }
    return left || right ? Row{cells, -1} : row;
}

// visit(cell, depth) of each cell that the triangle may be seen through; its corners are relative to the light.
template <class Visit> void for_each_cell_of(const LatticePoint (&t)[3], int64_t margin, Visit &&visit) {
    for (uint32_t f = 0; f < faces; ++f) {
        const Face face(f);
        int64_t nearest = face.sign * t[0].x[face.a], farthest = nearest;
        for (const LatticePoint &p : t) {
            nearest = std::min(nearest, face.sign * p.x[face.a]);
            farthest = std::max(farthest, face.sign * p.x[face.a]);
        }
        if (farthest < -margin) continue;
        const Row across = row_of(t, face, face.b, margin), down = row_of(t, face, face.c, margin);
        const int32_t depth = static_cast<int32_t>(nearest - margin);
        for (int64_t j = down.first; j <= down.last; ++j)
            for (int64_t i = across.first; i <= across.last; ++i) visit(index_of(face, i, j), depth);
    }
}

// The light's lists, from entry `used` on; false: there is no room.
bool make_lists(LightBuffer &buffer, BufferLight &light, const Shadows &shadows, uint64_t &used) {
    const Scene &scene = *shadows.scene;
    const auto for_each_entry = [&](auto &&visit) {
        for (uint32_t i = 0; i < scene.still_count; ++i) {
            const Triangle &triangle = scene.triangles[i];
            if (scene.materials[triangle.material].transmission > 0 ||
                !has_area(vec_of(triangle.corner[0]), vec_of(triangle.corner[1]), vec_of(triangle.corner[2])))
                continue;
            ++shadows.statistics->shadow.proofs.triangle_tests;
            LatticePoint corner[3];
            for (int c = 0; c < 3; ++c) {
                corner[c] = lattice_point(vec_of(triangle.corner[c]), light.lattice.exponent);
                for (int a = 0; a < 3; ++a) corner[c].x[a] -= light.at.x[a];
            }
            for_each_cell_of(corner, light.lattice.margin + 1, [&](uint32_t cell, int32_t depth) {
                visit(cell, BufferEntry{i, depth});
            });
        }
    };
    uint32_t *const first = light.first;
    std::fill(first, first + cell_count + 1, 0);
    uint64_t count = 0;
    for_each_entry([&](uint32_t cell, const BufferEntry &) {
        ++first[cell];
        ++count;
    });
    if (count > buffer.capacity - used) return false;
    uint32_t end = static_cast<uint32_t>(used);
    for (uint32_t cell = 0; cell <= cell_count; ++cell) { // ends, which go down to begins
        end += first[cell];
        first[cell] = end;
    }
    for_each_entry([&](uint32_t cell, const BufferEntry &entry) { buffer.entries[--first[cell]] = entry; });
    for (uint32_t cell = 0; cell < cell_count; ++cell)
        std::sort(buffer.entries + first[cell], buffer.entries + first[cell + 1],
                  [](const BufferEntry &a, const BufferEntry &b) {
                      return a.depth < b.depth || (a.depth == b.depth && a.triangle < b.triangle);
                  });
    used += count;
    return true;
}

} // namespace

uint64_t light_buffer_bytes(const Scene &scene) {
    return Arena::bytes<LightBuffer>(1) + Arena::bytes<BufferLight>(scene.light_count) +
           Arena::bytes<BufferEntry>(capacity_for(scene)) + scene.light_count * Arena::bytes<uint32_t>(cell_count + 1);
}

LightBuffer *make_light_buffer(const Scene &scene, Arena &arena) {
    LightBuffer *buffer = arena.make<LightBuffer>(1);
    BufferLight *lights = arena.make<BufferLight>(scene.light_count);
    BufferEntry *entries = arena.make<BufferEntry>(static_cast<size_t>(capacity_for(scene)));
    if (!buffer || !lights || !entries) return nullptr;
    *buffer = {scene.light_count, false, capacity_for(scene), entries, lights};
    for (uint32_t l = 0; l < scene.light_count; ++l) {
        lights[l].first = arena.make<uint32_t>(cell_count + 1);
        if (!lights[l].first) return nullptr;
    }
    return buffer;
}

void begin_frame(LightBuffer &buffer, const Shadows &shadows) {
    bool same = buffer.made;
    for (uint32_t l = 0; l < buffer.light_count; ++l)
        same = same && same_shadows(buffer.lights[l].light, shadows.lights[l]);
    if (same) return;
    buffer.made = true;
    uint64_t used = 0;
    for (uint32_t l = 0; l < buffer.light_count; ++l) {
        BufferLight &light = buffer.lights[l];
        light.light = shadows.lights[l];
        light.ready = false;
        const TriangleTree &still = shadows.surfaces->still;
        if (light.light.kind == LightKind::parallel || still.triangle_count == 0) continue;
        light.lattice = make_shaft_lattice(*shadows.surfaces, light_exponent(still, light.light));
        light.at = lattice_point(light.light.position, light.lattice.exponent);
        light.ready = make_lists(buffer, light, shadows, used);
    }
}

bool is_shadowed(LightBuffer &buffer, Shadows &shadows, const ShadowQuery &query) {
    const Surfaces &surfaces = *shadows.surfaces;
    Statistics &statistics = *shadows.statistics;
    const BufferLight &light = buffer.lights[query.light];
    const Vec3 &from = query.ray.origin;
    // Points as far as the lattice reaches.
    const Real farthest = light.ready ? surfaces.still.largest * Real(2) : Real(0);
    if (!(abs(from.x) <= farthest && abs(from.y) <= farthest && abs(from.z) <= farthest))
        return is_blocked(surfaces, query.ray, surfaces.skin, query.end, query.triangle, statistics.shadow.traced);
    LatticePoint way = lattice_point(from, light.lattice.exponent);
    uint32_t axis = 0;
    const auto size = [&way](uint32_t a) { return way.x[a] < 0 ? -way.x[a] : way.x[a]; };
    for (uint32_t a = 0; a < 3; ++a) {
        way.x[a] -= light.at.x[a];
        if (size(a) > size(axis)) axis = a;
    }
    const int64_t along = std::max(size(axis), int64_t{1});
    const Face face(2 * axis + (way.x[axis] < 0 ? 1 : 0));
    const uint32_t cell = index_of(face, cell_of(way.x[face.b], along), cell_of(way.x[face.c], along));
    const TriangleRay ray(query.ray.origin, query.ray.direction);
    const BufferEntry *const end = buffer.entries + light.first[cell + 1];
    for (const BufferEntry *entry = buffer.entries + light.first[cell]; entry != end && entry->depth <= along;
         ++entry) {
        if (entry->triangle == query.triangle) continue;
        ++statistics.shadow.extra_tests;
        if (is_met(*shadows.scene, entry->triangle, ray, surfaces.skin, query.end)) return true;
    }
    return is_blocked_by_moving(surfaces, query.ray, surfaces.skin, query.end, query.triangle,
                                statistics.shadow.traced);
}

} // namespace wisp::WISP_ARITH
