// Proofs for cells of triangles: whatever is proved holds for every ray, with its roundings.
#include "core/shadows/triangle_shaft.h"
#include "support/random_rooms.h"
#include "support/shadow_queries.h"

namespace wisp::WISP_ARITH {

namespace {

bool stops(const Room &room, uint32_t triangle, const ShadowQuery &query) {
    const Triangle &t = room.triangles[triangle];
    const Vec3 a = vec_of(t.corner[0]), b = vec_of(t.corner[1]), c = vec_of(t.corner[2]);
    TriangleHit hit;
    return triangle != query.triangle && has_area(a, b, c) && !(room.materials[t.material].transmission > 0) &&
           intersect(TriangleRay(query.ray.origin, query.ray.direction), a, b, c, hit) && hit.distance > query.begin &&
           hit.distance < query.end;
}

// A receiver, a light, and what touches the shaft from one of its cells to the light, or nearly.
struct Narrow : Room {
    Narrow(uint64_t seed, double size_) : size(size_), next{seed * 613 + 7} {
        scene.ray_epsilon = size * 4e-6;
        material(matte({1, 1, 1}));
        material(glass(1));
        const auto random = [this] { return point(1); };
        Double3 r[3] = {random(), random(), random()};
        if (pick(4) == 0)
            for (Double3 &p : r) p.z = 0.25 * size; // along the axes, as walls are
        if (pick(8) == 0) r[2] = r[0] + (r[1] - r[0]) * next() + point(1e-3);
        triangles.push_back(triangle(r[0], r[1], r[2], 0));
        cell = random_cell(next);
        const auto at = [&r](double u, double v) { return r[0] + (r[1] - r[0]) * u + (r[2] - r[0]) * v; };
        const double u = double(cell.u) / finest_cell, v = double(cell.v) / finest_cell,
                     part = double(cell.size) / finest_cell;
        for (int i = 0; i < 3; ++i) corner[i] = at(u + (i == 1 ? part : 0), v + (i == 2 ? part : 0));
        Double3 normal = cross(r[1] - r[0], r[2] - r[0]);
        normal = length(normal) > 0 ? unit(normal) : Double3{0, 0, 1};
        Double3 where = point(1.2);
        if (pick(4) == 0) where = at(next() * 3 - 1, next() * 3 - 1) + normal * (jitter() * 1000); // in its plane
        if (pick(16) == 0) where = r[pick(3)] + point(jitter());
        const LightKind kinds[] = {LightKind::point, LightKind::constant, LightKind::spot, LightKind::parallel};
        const LightKind kind = kinds[pick(4)];
        const Double3 way = unit(corner[0] - where + Double3{1e-9, 0, 0});
        light(kind, where, {1, 1, 1}, way);
        for (int i = 0; i < 3; ++i) goal[i] = kind == LightKind::parallel ? corner[i] - way * (2 * size) : where;
        for (int i = 1 + pick(3); i > 0; --i) add_neighbour(r, normal);
        build();
    }

    double size;
    CellPlace cell;
    Sequence next;
    Double3 corner[3], goal[3];

  private:
    int pick(int count) { return static_cast<int>(next() * count); }
    Double3 point(double part) {
        const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
        return Double3{x, y, z} * (part * size);
    }
    // From everything down to nothing, either way.
    double jitter() { return (pick(2) ? 1 : -1) * std::pow(10.0, -1 - 14 * next()) * (pick(6) ? 1 : 0); }

    void add_neighbour(const Double3 (&r)[3], const Double3 &normal) {
        Double3 q[3] = {point(1), point(1), point(1)};
        const double s = pick(3) ? next() : std::pow(10.0, -8 * next());
        Double3 middle = {0, 0, 0}, section[3];
        for (int i = 0; i < 3; ++i) {
            section[i] = corner[i] + (goal[i] - corner[i]) * s;
            middle = middle + section[i] * (1.0 / 3);
        }
        const int i = pick(3), j = (i + 1) % 3;
        switch (pick(9)) {
        case 0: // as wide as the shaft
            for (int k = 0; k < 3; ++k) q[k] = middle + (section[k] - middle) * (1 + jitter());
            break;
        case 1: // wider, and slanted
            for (int k = 0; k < 3; ++k) {
                const double along = s * (0.8 + 0.2 * next());
                q[k] = corner[k] + (goal[k] - corner[k]) * along;
                q[k] = q[k] + (q[k] - middle) * (pick(2) ? jitter() : 0.5 * next());
            }
            break;
        case 2: // beside it
            q[0] = section[i] + (section[i] - middle) * jitter();
            q[1] = section[j] + (section[j] - middle) * jitter();
            q[2] = middle + ((section[i] + section[j]) * 0.5 - middle) * (2 + 4 * next());
            break;
        case 3: // a wall on an edge
            q[0] = r[i] + (r[j] - r[i]) * (next() - 0.5);
            q[1] = r[j] + (r[j] - r[i]) * next();
            q[2] = q[0] + (pick(2) ? normal * size : goal[0] - q[0]) + point(jitter());
            break;
        case 4: // a wall on the cell's edge
            q[0] = corner[i];
            q[1] = corner[j];
            q[2] = q[0] + (goal[0] - q[0]) * next() + (pick(2) ? point(jitter()) : point(0.3));
            break;
        case 5: // in its plane, or close above
            for (int k = 0; k < 3; ++k) q[k] = q[k] - normal * dot(normal, q[k] - r[0]);
            if (pick(2)) q[0] = r[i], q[1] = r[j];
            if (pick(2))
                for (Double3 &p : q) p = p + normal * (scene.ray_epsilon * (pick(2) ? 1 + jitter() : 3 * next()));
            break;
        case 6: // about the light
            for (Double3 &p : q) p = goal[0] + (goal[0] - middle) * jitter() + point(0.1);
            break;
        case 7: // a sliver across
            q[0] = middle + point(1);
            q[1] = middle * 2 - q[0];
            q[2] = q[0] + point(jitter());
            break;
        default: break;
        }
        triangles.push_back(triangle(q[0], q[1], q[2], pick(8) == 0));
    }
};

TriangleTree tree_of(const Room &room) { return room.surfaces.static_tree; }

constexpr double room_sizes[] = {1, 16, 1024};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": whatever is proved of a cell is so for every ray from it") {
    int free = 0, blocked = 0, wrong = 0, grazed = 0;
    for (uint64_t seed = 0; seed < 30000; ++seed) {
        Narrow room(seed, room_sizes[seed % 3]);
        Vec3 receiver[3];
        for (int i = 0; i < 3; ++i) receiver[i] = vec_of(room.triangles[0].corner[i]);
        if (!has_area(receiver[0], receiver[1], receiver[2])) continue;
        TreeCounts counts = {};
        const TriangleShaft shaft =
            make_triangle_shaft(tree_of(room), receiver, room.cell, room.tracer.lights[0], room.surfaces.ray_epsilon);
        const bool is_free = is_shaft_lit(tree_of(room), shaft, 0, counts);
        uint32_t blocker = no_triangle;
        for (uint32_t t = 1; t < room.triangles.size(); ++t) {
            Vec3 occluder[3];
            for (int i = 0; i < 3; ++i) occluder[i] = vec_of(room.triangles[t].corner[i]);
            if (room.triangles[t].material == 0 && has_area(occluder[0], occluder[1], occluder[2]) &&
                is_shaft_shadowed(shaft, occluder))
                blocker = t;
        }
        free += is_free;
        blocked += blocker != no_triangle;
        bool lit = false, shaded = false;
        for (int sample = 0; sample < 40; ++sample) {
            Real u, v;
            random_weights(room.cell, room.next, u, v);
            const ShadowQuery query = query_at(room, 0, 0, u, v);
            bool stopped = false;
            for (uint32_t t = 1; t < room.triangles.size(); ++t) stopped = stopped || stops(room, t, query);
            (stopped ? shaded : lit) = true;
            if (is_free && stopped) ++wrong;
            if (blocker != no_triangle && !stops(room, blocker, query)) ++wrong;
        }
        grazed += lit && shaded;
    }
    CHECK(wrong == 0);
    CHECK(free > 5000);
    CHECK(blocked > 1000);
    CHECK(grazed > 5000);
}

} // namespace wisp::WISP_ARITH
