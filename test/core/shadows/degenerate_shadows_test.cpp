// Shadows where it is hard to prove any: what is tiny, what touches, what lies in a plane with the light, what comes
// and goes. All exact methods against tracing, with so many rays that proofs are made.
#include "wisp/wisp.h"
#include "support/animated_room.h"
#include "support/shadow_queries.h"
#include "wisp/settings.h"
#include <cstdlib>

namespace wisp::WISP_ARITH {

namespace {

// Half an edge. Scenes are prepared so that they are no smaller than the second: what is tiny is right, if slow.
constexpr double room_sizes[] = {1.0 / 64, 16, 2000};
constexpr double least_size = 16;

struct DegenerateRoom : Room {
    DegenerateRoom(double size_, uint64_t seed) : size(size_), next{seed * 331 + 11} {
        scene.ray_epsilon = size * 4e-6;
        white = material(matte({1, 1, 1}));
        scene.background = {0.25, 0.5, 0.75};
    }
    Double3 point(double part) {
        const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
        return Double3{x, y, z} * (part * size);
    }
    Double3 at(double x, double y, double z) const { return {x * size, y * size, z * size}; }
    void sun(const Double3 &way) { light(LightKind::parallel, {0, 0, 0}, {1, 1, 1}, unit(way)); }
    void lamp(const Double3 &where) { // of one kind or another
        const LightKind kinds[] = {LightKind::constant, LightKind::point, LightKind::spot};
        const LightKind kind = kinds[lights.size() % 3];
        light(kind, where, Double3{1, 1, 1} * (kind == LightKind::constant ? 1 : size), {0, -1, 0});
    }
    // All triangles added from here to the end are one more instance, with its space where it is.
    void instance_from(size_t first) {
        Instance instance = {};
        instance.first = static_cast<uint32_t>(first);
        instance.count = static_cast<uint32_t>(triangles.size() - first);
        instance.axis[0].x = instance.axis[1].y = instance.axis[2].z = 1;
        instance.inverse[0].x = instance.inverse[1].y = instance.inverse[2].z = 1;
        instance.visible = true;
        instances.push_back(instance);
        scene.instance_triangle_count += instance.count;
    }
    void look_down() {
        scene.camera.origin = at(0.2, 2, 1.9);
        const Double3 forward = unit(at(0, 0, 0) - scene.camera.origin), right = {1, 0, 0};
        const double pixel = 0.04;
        scene.camera.right = right * pixel;
        scene.camera.down = cross(forward, right) * pixel;
        scene.camera.corner = forward - scene.camera.right * (room_pixels / 2) - scene.camera.down * (room_pixels / 2);
    }

    double size;
    uint32_t white;
    Sequence next;
};

Settings picture_settings(ShadowMethod method) {
    Settings settings = {};
    settings.crop = {0, 0, room_pixels, room_pixels};
    settings.samples = 9;
    settings.depth = 2;
    settings.shadows = method;
    return settings;
}

// Pictures of one method, frame after frame with one cache.
struct CachedPictures {
    explicit CachedPictures(ShadowMethod method) : settings(picture_settings(method)) {}
    std::vector<float> operator()(const Scene &scene) {
        block.resize(std::max(block.size(), static_cast<size_t>(renderer.plan(scene, settings).arena_bytes)));
        return picture(scene, settings, block, statistics, cache);
    }
    Settings settings;
    std::vector<unsigned char> block;
    Statistics statistics;
    FrameCache cache = {};
};
std::vector<float> traced_picture(const Scene &scene) { return CachedPictures(ShadowMethod::trace)(scene); }

// Smaller than a pixel, down to a ten millionth; thin as a hair; without an area.
void fill_with_dust(DegenerateRoom &room) {
    add_floor(room, 0, room.size, room.white);
    for (int i = 0; i < 60; ++i) {
        const double part = std::pow(10.0, -2 - i % 6);
        const Double3 middle = room.at(0, 0.5, 0) + room.point(0.49), a = middle + room.point(part),
                      b = middle + room.point(part), c = middle + room.point(part);
        switch (i % 5) {
        case 3: room.add(a, a + room.point(0.3), a + room.point(1e-6), room.white); break; // a sliver
        case 4: room.add(a, i % 2 ? a : (a + b) * 0.5, b, room.white); break;              // no area
        default: room.add(a, b, c, room.white);
        }
    }
    room.lamp(room.at(0.1, 1.5, 0.2));
    room.lamp(room.at(-3, 0.5, 2));
    room.sun({0.1, -1, 0.2});
}

// On the floor, in it, folded along its edges, at its corners, and half a skin and some skins above.
void fill_with_touching(DegenerateRoom &room) {
    add_floor(room, 0, room.size, room.white);
    add_box(room, room.at(0.3, 0.25, -0.4), room.at(0.1, 0.25, 0.1), room.white); // its bottom lies in the floor
    room.add(room.at(-0.9, 0, 0.1), room.at(-0.2, 0, 0.3), room.at(-0.5, 0.4, 0.2), room.white);  // a wall on it
    room.add(room.at(-0.4, 0, -0.4), room.at(-0.1, 0, -0.6), room.at(-0.2, 0, -0.1), room.white); // in it
    for (const double skins : {0.5, 1.0, 1.5, 3.0}) {
        const double y = room.scene.ray_epsilon / room.size * skins, x = 0.2 * skins - 0.9;
        room.add(room.at(x, y, 0.5), room.at(x + 0.15, y, 0.5), room.at(x, y, 0.7), room.white);
    }
    const Double3 a = room.at(-0.8, 0, -0.8), b = room.at(-0.6, 0, -0.7);
    for (const double degrees : {0.0, 1e-3, 5.0, 90.0, 175.0, 180.0}) // at an edge of one another
        room.add(a, b, a + rotate(room.at(0.1, 0, 0.2), unit(b - a), degrees), room.white);
    const Double3 corner = room.at(0.6, 0, 0.6);
    for (int i = 0; i < 4; ++i) // at a corner of one another, and at one of the floor
        room.add(corner, corner + room.at(0.1, 0.05 * i, 0.1), corner + room.at(-0.1, 0.05 * i, 0.2), room.white);
    room.add(room.at(1, 0, 1), room.at(0.9, 0.2, 0.9), room.at(0.8, 0.2, 1), room.white);
    room.lamp(room.at(0, 1, 0));
    room.lamp(room.at(1.5, 1e-3, 0.4)); // grazing
    room.lamp(room.at(-0.5, 0.3, 0.9));
    room.sun({0.4, -1, -0.3});
    room.sun({1, -1e-3, 0.1});
}

// Lights in planes of receivers and of occluders, at corners, on edges, amid triangles, in a closed box.
void fill_with_lights(DegenerateRoom &room) {
    add_floor(room, 0, room.size, room.white);
    room.add(room.at(-0.5, 0, 0.25), room.at(0.5, 0, 0.25), room.at(0.125, 0.75, 0.25), room.white);
    room.add(room.at(-0.5, 0.5, -0.5), room.at(0.5, 0.5, -0.5), room.at(0, 0.5, 0.125), room.white);
    add_box(room, room.at(0.5, 0.5, 0.5), room.at(0.125, 0.25, 0.125), room.white);
    room.lamp(room.at(0.5, 0.5, 0.5));     // in the box
    room.lamp(room.at(3, 0, 0.25));        // in the planes of floor and wall
    room.lamp(room.at(0.25, 0, 0.125));    // in the floor
    room.lamp(room.at(0.125, 0.75, 0.25)); // at a corner
    room.lamp(room.at(0, 0.5, -0.5));      // on an edge
    room.lamp(room.at(0, 0.5, -0.25));     // amid a triangle
    room.lamp(room.at(-1, 0, 1));          // at a corner of the floor
    room.lamp(room.at(-0.75, 0.5, 0));     // in the plane of the roof
    room.sun({1, 0, 0});                   // along floor and roof
    room.sun({0, -1, 0});                  // along the wall
    room.sun({0.6, 0, -0.8});
}

// Of a hundred shadows exact knows `least_culled` without a ray.
void check_answers(void (*fill)(DegenerateRoom &), uint64_t least_culled) {
    for (const ShadowMethod method : equivalent_methods) {
        CAPTURE(static_cast<int>(method));
        uint64_t queries = 0, known = 0, shadowed = 0;
        for (const double size : room_sizes)
            for (uint64_t seed = 0; seed < 2; ++seed) {
                CAPTURE(size);
                CAPTURE(seed);
                DegenerateRoom room(size, seed);
                fill(room);
                room.look_down();
                ShadowQueries shadows(room, method);
                shadows.begin();
                Sequence next{seed + 77};
                for (uint32_t light = 0; light < room.lights.size(); ++light)
                    for (const uint32_t floor : {0u, 1u}) shadows.query_triangle(floor, light, 60, 50, next);
                shadows.query_everywhere(2, 50, next);
                CHECK(shadows.wrong == 0);
                CHECK(CachedPictures(method)(room.scene) == traced_picture(room.scene));
                if (size < least_size) continue;
                queries += shadows.queries;
                known += shadows.known();
                shadowed += shadows.shadowed;
            }
        if (method == ShadowMethod::exact) CHECK(known > queries * least_culled / 100);
        if (method != ShadowMethod::cache) CHECK(known > 1000);
        CHECK(shadowed > queries / 40);
        CHECK(shadowed < queries);
    }
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": the shadows of dust, of hairs and of what has no area") {
    check_answers(fill_with_dust, 50);
}

TEST_CASE(WISP_ARITH_NAME ": the shadows of what touches, lies in a plane, or a skin above it") {
    check_answers(fill_with_touching, 20);
}

TEST_CASE(WISP_ARITH_NAME ": shadows from lights in planes, at corners, on edges, amid triangles and in boxes") {
    check_answers(fill_with_lights, 12);
}

namespace {

// A slab that flies through the light, and vanishes there for a frame; a plate that flies under a roof; a triangle that
// changes its form into the light.
struct Flight : DegenerateRoom {
    explicit Flight(double size_) : DegenerateRoom(size_, 5) {
        add_floor(*this, 0, size, white);                                                             // 0, 1
        add(at(-0.9, 0.6, -0.2), at(-0.3, 0.6, -0.2), at(-0.3, 0.6, 0.4), at(-0.9, 0.6, 0.4), white); // 2, 3
        scene.static_count = 4;
        add_box(*this, {0, 0, 0}, at(0.2, 0.02, 0.2), white); // 4 ... 15
        instance_from(4);
        add(at(-0.1, 0, 0.1), at(0.1, 0, 0.1), at(0.1, 0, -0.1), at(-0.1, 0, -0.1), white); // 16, 17
        instance_from(16);
        add(at(0, 0.3, 0), at(0.2, 0.3, 0), at(0, 0.3, 0.2), white);
        scene.deforming_count = 1;
        lamp(at(0, 2, 0));
        sun({0.2, -1, 0.1});
        lamp(at(0.3, 1.2, 0.4));
        look_down();
        show(0);
    }
    static constexpr int frames = 6;
    void show(int frame) {
        const double slab[frames] = {4, 0.5, 0.5, 0.5, 0.55, -4}, plate[frames] = {0.2, -0.6, -0.6, 0.2, -0.7, 0.7};
        instances[0].origin = at(slab[frame], 0.4, 0.3);
        instances[0].visible = frame != 2;
        instances[1].origin = at(plate[frame], 0.2, 0.1);
        triangles.back().corner[2] = frame == 4 ? at(-0.3, 0.3, 0.6) : at(0, 0.3, 0);
        build();
    }
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": what flies through the light, vanishes and comes back: frames in any order are the same") {
    for (const double size : room_sizes) {
        CAPTURE(size);
        Flight room(size);
        std::vector<float> right[Flight::frames];
        for (int i = 0; i < Flight::frames; ++i) {
            room.show(i);
            right[i] = traced_picture(room.scene);
            for (int k = 0; k < i; ++k) CHECK(right[i] != right[k]);
        }
        for (const ShadowMethod method : equivalent_methods) {
            CAPTURE(static_cast<int>(method));
            for (const std::vector<int> &order :
                 {std::vector<int>{0, 1, 2, 3, 4, 5}, {5, 4, 3, 2, 1, 0}, {2, 2, 1, 3, 1, 0, 4, 5, 2}, {3}}) {
                CachedPictures pictures(method);
                for (const int i : order) {
                    CAPTURE(i);
                    room.show(i);
                    CHECK(pictures(room.scene) == right[i]);
                }
            }
            ShadowQueries shadows(room, method);
            Sequence next{9};
            for (const int i : {0, 1, 2, 3, 4, 5, 3, 0}) {
                CAPTURE(i);
                room.show(i);
                shadows.begin();
                shadows.query_everywhere(6, 60, next);
                CHECK(shadows.wrong == 0);
            }
            CHECK(shadows.shadowed > shadows.queries / 10);
            if (method == ShadowMethod::exact && size >= least_size) CHECK(shadows.known() > shadows.queries / 2);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": no light, one, as many as the paper has room for, one more, and 200") {
    for (const size_t count : {0, 1, 15, 16, 200}) {
        CAPTURE(count);
        Flight room(1);
        room.lights.clear();
        while (room.lights.size() < count) {
            const double turn = 2.4 * static_cast<double>(room.lights.size()), far = room.lights.size() % 5 * 0.3;
            if (room.lights.size() % 4 == 3)
                room.sun({far * std::cos(turn), -1, far * std::sin(turn)});
            else
                room.lamp(room.at(far * std::cos(turn), 0.7 + far, far * std::sin(turn)));
        }
        room.show(1);
        const uint32_t samples = count > 16 ? 1 : 9;
        CachedPictures traced(ShadowMethod::trace);
        traced.settings.samples = samples;
        std::vector<float> right[2];
        for (const int i : {0, 1}) {
            room.show(1 + i);
            right[i] = traced(room.scene);
        }
        CHECK(traced.statistics.rays.shadow >= 300 * samples * count);
        for (const ShadowMethod method : equivalent_methods) {
            CAPTURE(static_cast<int>(method));
            CachedPictures pictures(method);
            pictures.settings.samples = samples;
            for (const int i : {0, 1}) {
                room.show(1 + i);
                CHECK(pictures(room.scene) == right[i]);
            }
            const auto &rays = pictures.statistics.rays;
            CHECK(rays.shadow == traced.statistics.rays.shadow);
            if (method == ShadowMethod::exact)
                CHECK(rays.shadow_culled + rays.shadow_dynamic_only >= rays.shadow / (count > 16 ? 10 : 4));
            if (count > 16) continue; // that much memory once is enough
            ShadowQueries shadows(room, method);
            Sequence next{count};
            for (const int i : {1, 4}) {
                room.show(i);
                shadows.begin();
                shadows.query_everywhere(4, 60, next);
                CHECK(shadows.wrong == 0);
            }
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a light that moves, turns, is of another kind, or of another colour alone") {
    for (const double size : room_sizes)
        for (const ShadowMethod method : equivalent_methods) {
            CAPTURE(size);
            CAPTURE(static_cast<int>(method));
            DegenerateRoom room(size, 3);
            fill_with_touching(room);
            room.lights.clear();
            room.light(LightKind::constant, room.at(0.25, 1, 0.5), {1, 1, 1}, unit({0.3, -1, 0.1}));
            room.light(LightKind::constant, room.at(-0.75, 0.5, 0.5), {1, 1, 1}, unit({0.5, -1, -0.7}));
            room.look_down();
            ShadowQueries shadows(room, method);
            CachedPictures pictures(method);
            LightSource &light = room.lights[0];
            for (int change = 0; change < 9; ++change) {
                CAPTURE(change);
                switch (change) {
                case 1: light.color = {0.5, 0.25, 0.125}; break;
                case 2: light.kind = LightKind::parallel; break;
                case 3: light.direction = unit({-0.4, -1, 0.6}); break;
                case 4: light.kind = LightKind::spot; break;
                case 5: light.one_minus_cosine = 0.2; break;
                case 6: light.direction = unit({0.1, -1, 0.2}); break;
                case 7: light.position.x += room.scene.ray_epsilon; break; // hardly
                case 8: light.position = room.at(-0.5, 0.75, -0.75); break;
                default: break;
                }
                const auto proofs = [&] {
                    const TreeCounts &counts = room.statistics.shadow.proofs;
                    return counts.node_visits + counts.triangle_tests;
                };
                const uint64_t known = shadows.known(), proved = proofs();
                shadows.begin();
                Sequence next{4};
                shadows.query_everywhere(3, 60, next);
                CHECK(shadows.wrong == 0);
                CHECK(pictures(room.scene) == traced_picture(room.scene));
                if (change != 1 || method == ShadowMethod::cache || size < least_size) continue;
                CHECK(shadows.known() - known >= known); // nothing has been forgotten
                CHECK(proofs() - proved < proved);
            }
            if (method == ShadowMethod::exact && size >= least_size) CHECK(shadows.known() > shadows.queries / 5);
        }
}

// As many as WISP_SCENES says, or a few.
TEST_CASE(WISP_ARITH_NAME ": random scenes, whose every shadow is asked of exact and of tracing") {
    const char *words = std::getenv("WISP_SCENES");
    const uint64_t scenes = words ? std::strtoull(words, nullptr, 10) : 60;
    uint64_t queries = 0, shadowed = 0, known = 0, wrong = 0;
    for (uint64_t seed = 0; seed < scenes; ++seed) {
        const double sizes[] = {1, 16, 1024, 0.1};
        const uint32_t light_counts[] = {1, 2, 3, 5, 16};
        RoomFrames room(seed + 10000, sizes[seed % 4], light_counts[seed % 5], ShadowMethod::exact);
        ShadowQueries shadows(room, ShadowMethod::exact);
        Sequence next{seed + 1};
        const auto below = [&next](size_t count) { return static_cast<uint32_t>(next() * static_cast<double>(count)); };
        for (int frame = 0; frame < 3; ++frame) {
            shadows.begin();
            for (int i = 0; i < 40; ++i)
                shadows.query_triangle(below(i % 2 ? 8 : room.triangles.size()), below(room.lights.size()), 3, 50,
                                       next);
            room.change();
        }
        if (shadows.wrong > 0) MESSAGE("scene " << seed << ": " << shadows.wrong << " shadows wrong");
        queries += shadows.queries;
        shadowed += shadows.shadowed;
        known += shadows.known();
        wrong += shadows.wrong;
    }
    if (words)
        MESSAGE(scenes << " scenes, " << queries << " shadows, " << shadowed << " dark, " << known << " known without "
                       << "asking static triangles, " << wrong << " wrong");
    CHECK(wrong == 0);
    CHECK(queries > 10000 * scenes);
    CHECK(shadowed > queries / 10);
    CHECK(known > queries / 10);
}

} // namespace wisp::WISP_ARITH
