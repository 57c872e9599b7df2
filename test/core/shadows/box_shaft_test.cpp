// Shafts of boxes: a triangle outside is hit by no ray, one across is hit by every ray, and no blocker is missed.
#include "core/shadows/box_shaft.h"
#include "support/random_rooms.h"

namespace wisp::WISP_ARITH {

TEST_CASE(WISP_ARITH_NAME ": whatever is proved of a box holds for every ray from it") {
    int outside = 0, across = 0, hits = 0, listed = 0, wrong = 0;
    for (uint64_t seed = 0; seed < 600; ++seed) {
        const double sizes[] = {1, 16, 1024};
        RandomRoom room(seed, sizes[seed % 3]);
        if (room.lights.empty() || room.surfaces.static_tree.triangle_count == 0) continue;
        Sequence next{seed * 31 + 9};
        const auto point = [&](double part) {
            const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
            return Double3{x, y, z} * (part * room.size);
        };
        const auto below = [&next](size_t count) { return static_cast<uint32_t>(next() * static_cast<double>(count)); };
        for (int box = 0; box < 12; ++box) {
            const uint32_t number = below(room.lights.size());
            const Light &light = room.tracer.lights[number];
            const LightSource &source = room.lights[number];
            Double3 middle = point(0.9);
            const double half = std::pow(10.0, -1 - 4 * next());
            if (box % 2) { // behind the middle of a triangle, seen from the light
                const Double3 *c = room.triangles[below(room.scene.static_count)].corner;
                const Double3 on = (c[0] + c[1] + c[2]) * (1.0 / 3);
                const Double3 way =
                    source.kind == LightKind::parallel ? source.direction * room.size : on - source.position;
                middle = on + way * (0.3 * next());
            }
            const ShaftLattice lattice =
                make_shaft_lattice(room.surfaces, light_exponent(room.surfaces.static_tree, light));
            if (!is_on_lattice(room.surfaces.static_tree, vec_of(middle))) continue;
            const Double3 reach = Double3{1, 1, 1} * (half * room.size);
            LatticeBounds bounds = {lattice_point(vec_of(middle - reach), lattice.exponent),
                                    lattice_point(vec_of(middle + reach), lattice.exponent)};
            for (int64_t &x : bounds.high.x) ++x;
            const BoxShaft shaft(lattice, bounds, light);
            uint32_t blocker[200], count = 0;
            REQUIRE(find_blockers(room.shadows, lattice, shaft, 200, blocker, count));
            listed += static_cast<int>(count);
            for (uint32_t t = 0; t < room.scene.static_count; ++t) {
                const Triangle &triangle = room.triangles[t];
                LatticePoint corner[3];
                for (int i = 0; i < 3; ++i) corner[i] = lattice_point(vec_of(triangle.corner[i]), lattice.exponent);
                if (!has_area(vec_of(triangle.corner[0]), vec_of(triangle.corner[1]), vec_of(triangle.corner[2])))
                    continue;
                const bool apart = !shaft.may_intersect(corner),
                           shadowed = is_shaft_shadowed(room.shadows, lattice, shaft, t),
                           is_listed = std::find(blocker, blocker + count, t) != blocker + count,
                           opaque = !(room.materials[triangle.material].transmission > 0);
                outside += apart;
                across += shadowed;
                wrong += apart && shadowed;
                for (int ray = 0; ray < 8; ++ray) {
                    Double3 at = middle;
                    at.x += (2 * next() - 1) * reach.x;
                    at.y += (2 * next() - 1) * reach.y;
                    at.z += (2 * next() - 1) * reach.z;
                    const Vec3 from = vec_of(at);
                    const Illumination lit = illuminate(light, from, from, from);
                    const Real end = lit.distance - room.surfaces.ray_epsilon;
                    if (!(end > Real(0))) continue;
                    const bool hit = intersects(room.scene, t, TriangleRay(from, -lit.direction), Real(0), end);
                    hits += hit;
                    wrong += (hit && apart) || (!hit && shadowed) || (hit && opaque && !is_listed);
                }
            }
        }
    }
    CHECK(wrong == 0);
    CHECK(outside > 100000);
    CHECK(across > 200);
    CHECK(hits > 5000);
    CHECK(listed > 2000);
}

} // namespace wisp::WISP_ARITH
