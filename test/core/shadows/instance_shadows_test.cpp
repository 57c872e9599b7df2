// Shadows of and on instances: rasters of lights and lists of blockers against tests of every instance and every
// triangle.
#include "core/shadows/instance_shadows.h"
#include "support/random_rooms.h"

namespace wisp::WISP_ARITH {

namespace {

// Instances of four triangles, large and small, in heaps and far apart, above a rough floor; lights of all kinds among
// them, in them, and where they begin.
struct Crowd : Room {
    explicit Crowd(uint64_t seed, int max_instances = 0) : next{seed * 919 + 3} {
        size = seed % 3 == 0 ? 1 : seed % 3 == 1 ? 30 : 1500;
        scene.ray_epsilon = size * 4e-6;
        material(matte({1, 1, 1}));
        material(glass(1));
        for (int i = 0; i < 24; ++i) {
            const Double3 at = point(1);
            add({at.x, -0.2 * size, at.z}, at + point(0.2), at + point(0.2), pick(6) == 0);
        }
        scene.static_count = 24;
        const int count = 1 + pick(max_instances ? max_instances : seed % 5 == 0 ? 200 : 12);
        for (int b = 0; b < count; ++b) {
            Instance instance = {};
            instance.first = static_cast<uint32_t>(triangles.size());
            instance.count = 4;
            const double scale = pick(3) ? 0.05 : 0.5;
            Double3 c[4];
            for (Double3 &p : c) p = point(scale);
            for (int i = 0; i < 4; ++i) add(c[i], c[(i + 1) % 4], c[(i + 2) % 4], pick(6) == 0);
            const Double3 turn = unit(point(1) + Double3{0, 0, 0.01 * size});
            for (int k = 0; k < 3; ++k) {
                const Double3 axis = rotate({double(k == 0), double(k == 1), double(k == 2)}, turn, 360 * next());
                instance.axis[k] = axis;
            }
            // At right angles again.
            instance.axis[0] = unit(instance.axis[0]);
            instance.axis[1] = unit(cross(instance.axis[0], instance.axis[1] + Double3{0.01, 0.02, 0.03}));
            instance.axis[2] = cross(instance.axis[0], instance.axis[1]);
            for (int j = 0; j < 3; ++j)
                instance.inverse[j] = j == 0   ? Double3{instance.axis[0].x, instance.axis[1].x, instance.axis[2].x}
                                      : j == 1 ? Double3{instance.axis[0].y, instance.axis[1].y, instance.axis[2].y}
                                               : Double3{instance.axis[0].z, instance.axis[1].z, instance.axis[2].z};
            instance.origin = point(pick(2) ? 1 : 0.1);
            instance.visible = pick(8) > 0;
            instances.push_back(instance);
        }
        scene.instance_triangle_count = static_cast<uint32_t>(triangles.size()) - scene.static_count;
        const LightKind kinds[] = {LightKind::constant, LightKind::point, LightKind::spot, LightKind::parallel};
        const int lit = pick(seed % 7 == 0 ? 60 : 6);
        for (int i = 0; i <= lit; ++i) {
            const Double3 near = instances[below(instances.size())].origin;
            Double3 way = unit(point(1) + Double3{0, 0.01 * size, 0});
            if (pick(4) == 0) way = {0, pick(2) ? 1.0 : -1.0, 0};
            light(kinds[pick(4)], pick(3) == 0 ? near : pick(2) ? point(1) : point(2.5), {1, 1, 1}, way);
        }
        build();
    }
    int pick(int count) { return static_cast<int>(next() * count); }
    size_t below(size_t count) { return static_cast<size_t>(next() * static_cast<double>(count)); }
    Double3 point(double part) {
        const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
        return Double3{x, y, z} * (part * size);
    }
    ShadowQuery query(const Vec3 &from, uint32_t light) const {
        const Illumination lit = illuminate(tracer.lights[light], from, from, from);
        ShadowQuery any = make_shadow_query(surfaces, from, light, lit, no_triangle, {}, {}, surfaces.instance_count);
        any.begin = Real(0); // a wall at the point shadows it, too
        return any;
    }

    Sequence next;
    double size;
};

struct InstanceMemory {
    explicit InstanceMemory(Room &room) : block(instance_shadow_bytes(room.scene)) {
        Arena arena(block.data(), block.size());
        instances = make_instance_shadows(room.shadows, arena);
        REQUIRE(instances.ready);
    }
    std::vector<unsigned char> block;
    InstanceShadows instances;
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a light's raster has every instance that its rays may hit, and few others") {
    int queries = 0, blocked = 0, wrong = 0, untested = 0;
    uint64_t visits = 0, all_visits = 0;
    for (uint64_t seed = 0; seed < 400; ++seed) {
        Crowd room(seed);
        InstanceMemory memory(room);
        for (int i = 0; i < 600; ++i) {
            const auto light = static_cast<uint32_t>(room.below(room.lights.size()));
            Vec3 from = vec_of(room.point(1.5));
            if (room.pick(2)) { // behind a corner of an instance, seen from the light
                const Instance &instance = room.instances[room.below(room.instances.size())];
                const Double3 p = room.triangles[instance.first + room.below(4)].corner[0];
                const Double3 corner =
                    instance.axis[0] * p.x + instance.axis[1] * p.y + instance.axis[2] * p.z + instance.origin;
                const LightSource &source = room.lights[light];
                const Double3 way =
                    source.kind == LightKind::parallel ? source.direction * room.size : corner - source.position;
                from = vec_of(corner + way * (0.3 * room.next()) + room.point(room.pick(2) ? 0 : 1e-4));
            }
            const ShadowQuery query = room.query(from, light);
            if (!(query.end > Real(0))) continue;
            TreeCounts counts = {};
            const bool right =
                is_blocked_by_moving(room.surfaces, query.ray, query.begin, query.end, query.triangle, counts);
            const uint64_t before = room.statistics.shadow.traced.node_visits;
            bool any;
            wrong += is_blocked_by_moving(memory.instances, room.shadows, query, any) != right;
            visits += room.statistics.shadow.traced.node_visits - before;
            all_visits += counts.node_visits;
            ++queries;
            blocked += right;
            untested += !any;
            if (right) CHECK(any);
        }
    }
    CHECK(wrong == 0);
    CHECK(queries > 200000);
    CHECK(blocked > queries / 10);
    CHECK(untested > queries / 10);
    CHECK(2 * visits < all_visits);
}

TEST_CASE(WISP_ARITH_NAME ": whatever ray passes the box of an instance is tested against it") {
    int passed = 0;
    for (uint64_t seed = 0; seed < 600; ++seed) {
        Crowd room(seed, 1);
        if (!room.instances[0].visible) continue;
        InstanceMemory memory(room);
        const Vec3 box[2] = {room.surfaces.boxes[0].low, room.surfaces.boxes[0].high};
        for (uint32_t light = 0; light < room.lights.size(); ++light)
            for (int corner = 0; corner < 8; ++corner) {
                const Vec3 at(box[corner & 1].x, box[corner >> 1 & 1].y, box[corner >> 2].z);
                const Illumination lit = illuminate(room.tracer.lights[light], at, at, at);
                const Vec3 from = at + lit.direction * real(room.size * (room.pick(2) ? 0.01 : 2) * room.next());
                const ShadowQuery query = room.query(from, light);
                bool tested;
                is_blocked_by_moving(memory.instances, room.shadows, query, tested);
                CHECK(tested);
                ++passed;
            }
    }
    CHECK(passed > 10000);
}

TEST_CASE(WISP_ARITH_NAME ": what stands between an instance and a light is all on its list") {
    int queries = 0, known = 0, free = 0, blocked = 0, wrong = 0;
    for (uint64_t seed = 0; seed < 400; ++seed) {
        Crowd room(seed);
        InstanceMemory memory(room);
        for (int i = 0; i < 60; ++i) {
            const auto b = static_cast<uint32_t>(room.below(room.instances.size())),
                       light = static_cast<uint32_t>(room.below(room.lights.size()));
            const Instance &instance = room.instances[b];
            if (!instance.visible) continue;
            for (int k = 0; k < 40; ++k) {
                const Triangle &t = room.triangles[instance.first + room.below(4)];
                const double u = room.next(), v = room.next() * (1 - u);
                const Double3 p = t.corner[0] * (1 - u - v) + t.corner[1] * u + t.corner[2] * v;
                const Double3 at =
                    instance.axis[0] * p.x + instance.axis[1] * p.y + instance.axis[2] * p.z + instance.origin;
                ShadowQuery query = room.query(vec_of(at), light);
                query.instance = b;
                if (!(query.end > Real(0))) continue;
                ++queries;
                const InstanceLight *found = find_instance_light(memory.instances, room.shadows, query);
                if (!found || !found->is_listed()) continue;
                ++known;
                free += found->blocker_count == 0;
                TreeCounts counts = {};
                uint32_t occluder;
                const bool right = is_blocked_by_static(room.surfaces, query.ray, query.begin, query.end, no_triangle,
                                                        occluder, counts);
                blocked += right;
                wrong += is_blocked_by_listed(*found, room.shadows, query) != right;
            }
        }
    }
    CHECK(wrong == 0);
    CHECK(known > queries / 4);
    CHECK(free > queries / 20);
    CHECK(blocked > queries / 100);
}

} // namespace wisp::WISP_ARITH
