// Shadow queries by the thousand, frame after frame, answered by a technique and by tracing.
#pragma once
#include "core/shadows/visibility_cells.h"
#include "host/base/double3_algebra.h"
#include "support/built_surfaces.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"

namespace wisp::WISP_ARITH {

constexpr ShadowMethod equivalent_methods[] = {ShadowMethod::cache, ShadowMethod::exact, ShadowMethod::voxel,
                                               ShadowMethod::lightbuffer, ShadowMethod::lie};

inline std::vector<float> picture(const Scene &scene, const Settings &settings, std::vector<unsigned char> &block,
                                  Statistics &statistics, FrameCache &cache) {
    const Crop &crop = settings.crop;
    std::vector<float> rgb(static_cast<size_t>(crop.width()) * static_cast<size_t>(crop.height()) * 3);
    Arena arena(block.data(), block.size());
    REQUIRE(renderer.render({scene, settings, arena, statistics, {}, rgb.data(), nullptr, &cache}) == Status::done);
    return rgb;
}

// The box from middle - half to middle + half.
inline void add_box(Room &room, const Double3 &middle, const Double3 &half, uint32_t material) {
    for (int a = 0; a < 3; ++a)
        for (const double side : {-1.0, 1.0}) {
            Double3 corner[4];
            for (int i = 0; i < 4; ++i) {
                double at[3];
                at[a] = side;
                at[(a + 1) % 3] = i == 0 || i == 3 ? -1 : 1;
                at[(a + 2) % 3] = i < 2 ? -1 : 1;
                corner[i] = middle + Double3{at[0] * half.x, at[1] * half.y, at[2] * half.z};
            }
            room.add(corner[0], corner[1], corner[2], corner[3], material);
        }
}

// The shadow query of a point of a static triangle, as shading makes it.
inline ShadowQuery query_at(const Room &room, uint32_t triangle, uint32_t light, Real u, Real v) {
    const Double3 *c = room.triangles[triangle].corner;
    const Vec3 corner = vec_of(c[0]), edge1 = vec_of(c[1]) - corner, edge2 = vec_of(c[2]) - corner;
    const Vec3 position = corner + edge1 * u + edge2 * v;
    const Illumination from = illuminate(room.tracer.lights[light], position, position, position);
    return make_shadow_query(room.surfaces, position, light, from, triangle, u, v, room.surfaces.instance_count);
}

inline CellPlace random_cell(Sequence &next) {
    CellPlace place = {0, 0, finest_cell};
    for (int depth = static_cast<int>(next() * 9); depth > 0; --depth) {
        const int part = place.size / 2, child = static_cast<int>(next() * 4);
        if (child == 1 || child == 3) place.u += part;
        if (child == 2 || child == 3) place.v += part;
        place.size = child == 3 ? -part : part;
    }
    return place;
}

// Of a cell: its corners, its edges, its inside.
inline void random_weights(const CellPlace &cell, Sequence &next, Real &u, Real &v) {
    double s = next(), t = next();
    if (s + t > 1) s = 1 - s, t = 1 - t;
    const int kind = static_cast<int>(next() * 8);
    if (kind == 0) s = 0, t = 0;
    if (kind == 1) s = 1, t = 0;
    if (kind == 2) s = 0, t = 1;
    if (kind == 3) s = 0;
    if (kind == 4) t = 0;
    if (kind == 5) t = 1 - s;
    u = real((cell.u + s * cell.size) / finest_cell);
    v = real((cell.v + t * cell.size) / finest_cell);
    // What intersect() gives: each is 0 or more, and their sum exceeds 1 by no more than their rounding.
    u = max(u, Real(0));
    v = max(v, Real(0));
}

// The query of a point of a moving triangle, where it is in this frame.
inline ShadowQuery moving_query_at(const Room &room, uint32_t triangle, uint32_t light, Real u, Real v) {
    const Double3 *c = room.triangles[triangle].corner;
    Vec3 corner = vec_of(c[0]), edge1 = vec_of(c[1]) - corner, edge2 = vec_of(c[2]) - corner;
    uint32_t instance = 0;
    while (instance < room.instances.size() &&
           triangle - room.instances[instance].first >= room.instances[instance].count)
        ++instance;
    if (instance < room.instances.size()) {
        const PlacedInstance &placed = room.surfaces.instances[instance];
        const auto applied = [&placed](const Vec3 &x) {
            return placed.axis[0] * x.x + placed.axis[1] * x.y + placed.axis[2] * x.z;
        };
        corner = placed.origin + applied(corner);
        edge1 = applied(edge1);
        edge2 = applied(edge2);
    }
    const Vec3 position = corner + edge1 * u + edge2 * v;
    const Illumination from = illuminate(room.tracer.lights[light], position, position, position);
    return make_shadow_query(room.surfaces, position, light, from, triangle, u, v, instance);
}

class ShadowQueries {
  public:
    // The room has its triangles, instances, and as many lights as there will be.
    ShadowQueries(Room &room, ShadowMethod method) : room_(room) {
        room_.build();
        settings_ = small_settings(512);
        settings_.shadows = method;
        kept_.resize(static_cast<size_t>(shadow_bytes(room.scene, settings_)));
        frame_.resize(kept_.size());
        Arena arena(kept_.data(), kept_.size());
        REQUIRE(make_shadow_memory(room.scene, settings_, arena, memory_));
        room_.statistics = {};
    }
    // The room is as it is now.
    void begin() {
        room_.build();
        room_.shadows.technique = shadow_technique(room_.scene, settings_);
        room_.shadows.memory = memory_;
        Arena arena(frame_.data(), frame_.size());
        REQUIRE(begin_frame(room_.shadows, settings_, arena));
    }
    void ask(const ShadowQuery &query) {
        TreeCounts unused = {};
        const bool right =
            is_blocked(room_.surfaces, query.ray, room_.surfaces.ray_epsilon, query.end, query.triangle, unused);
        ++queries;
        shadowed += right;
        wrong += is_shadowed(room_.shadows, query) != right;
    }
    // Around `spots` points of the triangle, most of them where the shadow of something begins: `rays` each.
    void query_triangle(uint32_t triangle, uint32_t light, int spots, int rays, Sequence &next) {
        Double3 corner[3], other[3];
        load(triangle, corner);
        if (!has_area(vec_of(corner[0]), vec_of(corner[1]), vec_of(corner[2]))) return;
        for (const Instance &instance : room_.instances)
            if (triangle - instance.first < instance.count && !instance.visible) return;
        for (int spot = 0; spot < spots; ++spot) {
            double u = 0, v = 0;
            bool aimed = false;
            for (int tries = 0; !aimed && tries < 4; ++tries) {
                load(static_cast<uint32_t>(next() * static_cast<double>(room_.triangles.size())), other);
                const double s = next(), t = next();
                const int i = static_cast<int>(s * 3), j = static_cast<int>(t * 3);
                aimed = aim(corner, room_.lights[light], other[i] + (other[j] - other[i]) * (s * 3 - i), u, v);
            }
            const CellPlace cell = aimed ? CellPlace{} : random_cell(next);
            for (int ray = 0; ray < rays; ++ray) {
                Real s = Real(0), t = Real(0);
                if (aimed) { // from all around to right there
                    const double near = std::pow(10.0, -1 - 8 * next()), x = next(), y = next();
                    const double a = std::min(std::max(u + near * (2 * x - 1), 0.0), 1.0);
                    s = real(a);
                    t = real(std::min(std::max(v + near * (2 * y - 1), 0.0), 1 - a));
                } else {
                    random_weights(cell, next, s, t);
                }
                ask(triangle < room_.scene.static_count ? query_at(room_, triangle, light, s, t)
                                                        : moving_query_at(room_, triangle, light, s, t));
            }
        }
    }
    void query_everywhere(int spots, int rays, Sequence &next) {
        for (uint32_t light = 0; light < room_.lights.size(); ++light)
            for (uint32_t i = 0; i < room_.triangles.size(); ++i) query_triangle(i, light, spots, rays, next);
    }
    uint64_t known() const { return room_.statistics.rays.shadow_culled + room_.statistics.rays.shadow_dynamic_only; }

    uint64_t queries = 0, shadowed = 0, wrong = 0;

  private:
    void load(uint32_t triangle, Double3 (&corner)[3]) const { // in the world
        std::copy(room_.triangles[triangle].corner, room_.triangles[triangle].corner + 3, corner);
        for (const Instance &instance : room_.instances)
            if (triangle - instance.first < instance.count)
                for (Double3 &c : corner)
                    c = instance.axis[0] * c.x + instance.axis[1] * c.y + instance.axis[2] * c.z + instance.origin;
    }
    // Where the light throws the shadow of p on the triangle; false: beside it.
    static bool aim(const Double3 (&corner)[3], const LightSource &light, const Double3 &p, double &u, double &v) {
        const Double3 way = light.kind == LightKind::parallel ? light.direction : p - light.position;
        const Double3 edge1 = corner[1] - corner[0], edge2 = corner[2] - corner[0], normal = cross(edge1, edge2);
        const double sine = dot(way, normal);
        if (sine == 0) return false;
        const Double3 at = p + way * (dot(corner[0] - p, normal) / sine) - corner[0];
        u = dot(cross(at, edge2), normal) / dot(normal, normal);
        v = dot(cross(edge1, at), normal) / dot(normal, normal);
        return u >= 0 && v >= 0 && u + v <= 1;
    }

    Room &room_;
    Settings settings_ = {};
    std::vector<unsigned char> kept_, frame_;
    void *memory_ = nullptr;
};

} // namespace wisp::WISP_ARITH
