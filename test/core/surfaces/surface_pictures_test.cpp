// Pictures of surfaces through the core's door: crops, frames in any order, memory, scenes that show nothing; hard
// cases E6 and E15 of surfaces.
#include "core/geometry/camera.h"
#include "support/random_rooms.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"
#include <cstring>

namespace wisp::WISP_ARITH {

namespace {

Settings settings_of(const RandomRoom &room) {
    Settings settings = small_settings(room_pixels);
    settings.depth = room.depth;
    return settings;
}

bool same(const std::vector<float> &a, const std::vector<float> &b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// The room as it is in a frame: instances and deforming triangles elsewhere, some hidden, other lights and another
// view.
struct Animation {
    explicit Animation(uint64_t seed) : room(seed, 16), triangles(room.triangles), instances(room.instances) {}
    const Scene &at(int frame) {
        room.triangles = triangles;
        room.instances = instances;
        const Double3 shift = {0.75 * frame, -0.5 * frame, 0.25 * frame};
        const size_t first_deforming = room.scene.static_count + room.scene.instance_triangle_count;
        for (size_t i = first_deforming; i < triangles.size(); ++i) room.triangles[i].corner[i % 3] = shift;
        for (size_t b = 0; b < instances.size(); ++b) {
            room.instances[b].origin = instances[b].origin + shift;
            room.instances[b].visible = (static_cast<size_t>(frame) + b) % 3 != 0;
        }
        for (LightSource &light : room.lights) light.position = light.position + Double3{0.1, 0, 0};
        room.scene.triangles = room.triangles.data();
        room.scene.instances = room.instances.data();
        return room.scene;
    }
    RandomRoom room;
    const std::vector<Triangle> triangles;
    const std::vector<Instance> instances;
};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a picture of surfaces is that of its rays, and a crop a part of it") {
    for (uint64_t seed = 3000; seed < 3020; ++seed) {
        RandomRoom room(seed, 16);
        room.tracer.spread = length(vec_of(room.scene.camera.down));
        Settings settings = settings_of(room);
        const Rendered whole = render_in_memory(room.scene, settings);
        REQUIRE(whole.status == Status::done);
        const View view(room.scene.camera);
        bool equal = true;
        for (int y = 0, i = 0; y < room_pixels; ++y)
            for (int x = 0; x < room_pixels; ++x) {
                const Color c = trace(room.tracer, view.ray_through(Real(x) + Real(0.5), Real(y) + Real(0.5)));
                for (const Real value : {c.x, c.y, c.z})
                    equal = equal && whole.rgb[static_cast<size_t>(i++)] == to_float_scaled(value, 0);
            }
        CHECK(equal);
        const auto &a = whole.statistics, &b = room.statistics;
        CHECK(a.rays.primary == room_pixels * room_pixels);
        CHECK(a.rays.reflected == b.rays.reflected);
        CHECK(a.rays.refracted == b.rays.refracted);
        CHECK(a.rays.shadow == b.rays.shadow);

        settings.crop = {3, 5, 12, 9};
        const Rendered part = render_in_memory(room.scene, settings);
        std::vector<float> expected;
        for (int y = 5; y < 9; ++y)
            expected.insert(expected.end(), whole.rgb.begin() + (y * room_pixels + 3) * 3,
                            whole.rgb.begin() + (y * room_pixels + 12) * 3);
        CHECK(same(part.rgb, expected));
    }
}

TEST_CASE(WISP_ARITH_NAME ": frames of surfaces are the same alone, in order and backwards") {
    int moving = 0;
    for (uint64_t seed = 3100; seed < 3110; ++seed) {
        constexpr int frames = 4;
        Animation animation(seed);
        const Settings settings = settings_of(animation.room);
        const std::vector<LightSource> lights = animation.room.lights;
        std::vector<Rendered> alone;
        for (int frame = 0; frame < frames; ++frame) {
            animation.room.lights = lights;
            alone.push_back(render_in_memory(animation.at(frame), settings));
            REQUIRE(alone.back().status == Status::done);
            moving += frame > 0 && !same(alone[0].rgb, alone.back().rgb);
        }
        for (const bool backwards : {false, true}) {
            std::vector<unsigned char> memory(renderer.plan(animation.room.scene, settings).arena_bytes);
            FrameCache cache = {};
            for (int i = 0; i < frames; ++i) {
                const int frame = backwards ? frames - 1 - i : i;
                animation.room.lights = lights;
                const Rendered kept = render_in({memory.data(), memory.size()}, animation.at(frame), settings, &cache);
                const Statistics &statistics = kept.statistics;
                CHECK(kept.status == Status::done);
                CHECK(cache.frame != nullptr);
                CHECK(statistics.bytes.arena_peak <= memory.size());
                const Rendered &expected = alone[static_cast<size_t>(frame)];
                CHECK(same(kept.rgb, expected.rgb));
                CHECK(statistics.rays.shadow == expected.statistics.rays.shadow);
                CHECK(statistics.shadow.traced.node_visits == expected.statistics.shadow.traced.node_visits);
                CHECK(statistics.shadow.traced.triangle_tests == expected.statistics.shadow.traced.triangle_tests);
            }
        }
    }
    CHECK(moving > 20);
}

TEST_CASE(WISP_ARITH_NAME ": surfaces keep to their plan; with less there is no picture, and nothing is written") {
    for (uint64_t seed = 3200; seed < 3240; ++seed) {
        const RandomRoom room(seed, 1);
        const Settings settings = settings_of(room);
        const uint64_t planned = renderer.plan(room.scene, settings).arena_bytes;
        std::vector<unsigned char> memory(planned);
        const auto draw = [&](size_t bytes) { return render_in({memory.data(), bytes}, room.scene, settings); };
        const Rendered whole = draw(planned);
        REQUIRE(whole.status == Status::done);
        CHECK(whole.statistics.bytes.arena_size == planned);
        CHECK(whole.statistics.bytes.arena_peak <= planned);
        CHECK(*std::min_element(whole.rgb.begin(), whole.rgb.end()) >= 0);
        const size_t peak = whole.statistics.bytes.arena_peak;
        for (const size_t bytes : {size_t{0}, size_t{100}, peak / 4, peak / 2, peak - 1})
            CHECK(is_untouched(draw(bytes)));
    }
}

TEST_CASE(WISP_ARITH_NAME ": room for lights, materials and instances is planned, and missed") {
    for (const int many : {0, 1, 2}) {
        Room room;
        for (int i = 0; i < (many == 0 ? 3000 : 1); ++i) room.material(matte({1, 1, 1}));
        for (int i = 0; i < (many == 1 ? 3000 : 1); ++i) room.light(LightKind::constant, {0, 0, 9}, {1, 1, 1});
        for (int i = 0; i < 9; ++i) room.add({-9, -9, 0}, {9, -9, 0}, {0, 9, 0}, 0);
        room.scene.static_count = 8;
        room.scene.instance_triangle_count = 1;
        room.instances.resize(many == 2 ? 3000 : 1);
        for (Instance &instance : room.instances) instance = {8, 1, {}, {}, {}, false};
        room.scene.camera = look_at_origin(12, 8, 4);
        room.build();
        const Settings settings = small_settings(4);
        const Rendered whole = render_in_memory(room.scene, settings);
        REQUIRE(whole.status == Status::done);
        std::vector<unsigned char> memory(whole.statistics.bytes.arena_peak - 64);
        CHECK(is_untouched(render_in({memory.data(), memory.size()}, room.scene, settings)));
    }
}

TEST_CASE(WISP_ARITH_NAME ": surfaces without lights, unseen ones, hidden ones and none are pictures") { // E15
    RandomRoom room(3300, 16);
    Settings settings = settings_of(room);
    const auto all_background = [&](const Scene &scene) {
        const Rendered picture = render_in_memory(scene, settings);
        REQUIRE(picture.status == Status::done);
        CHECK(picture.statistics.rays.primary == room_pixels * room_pixels);
        CHECK(picture.statistics.rays.shadow + picture.statistics.rays.reflected == 0);
        bool same = true;
        for (size_t i = 0; i < picture.rgb.size(); i += 3)
            same = same && picture.rgb[i] == 0.125f && picture.rgb[i + 1] == 0.25f && picture.rgb[i + 2] == 0.5f;
        return same;
    };
    Scene scene = room.scene;
    scene.camera.origin = {100, 0, 0}; // looks away
    scene.camera.corner = {1, -0.1, -0.1};
    scene.camera.right = {0, 0, 0.01};
    scene.camera.down = {0, 0.01, 0};
    CHECK(all_background(scene));
    scene = room.scene;
    scene.static_count = scene.instance_triangle_count = scene.deforming_count = scene.instance_count = 0;
    CHECK(all_background(scene)); // lights alone
    scene.light_count = scene.material_count = scene.texture_count = 0;
    CHECK(all_background(scene)); // nothing
    Room hidden;
    hidden.material(matte({1, 1, 1}));
    hidden.add({-9, -9, 0}, {9, -9, 0}, {0, 9, 0}, 0);
    hidden.scene.instance_triangle_count = 1;
    hidden.instances = {{0, 1, {}, {}, {}, false}};
    hidden.scene.background = room.scene.background;
    hidden.scene.camera = look_at_origin(12, 8, room_pixels);
    hidden.build();
    CHECK(all_background(hidden.scene)); // an instance alone, hidden
    Room flat;
    flat.material(matte({1, 1, 1}));
    for (int i = 0; i < 5; ++i) flat.add({0, 0, 0}, {1, 1, 1}, {2, 2, 2}, 0);
    flat.scene.background = room.scene.background;
    flat.scene.camera = hidden.scene.camera;
    flat.build();
    CHECK(all_background(flat.scene)); // without an area

    // Without lights there is ambient light, without depth nothing is mirrored.
    scene = room.scene;
    scene.light_count = 0;
    const Rendered dim = render_in_memory(scene, settings);
    CHECK(dim.status == Status::done);
    CHECK(dim.statistics.rays.shadow == 0);
    CHECK(*std::max_element(dim.rgb.begin(), dim.rgb.end()) > 0);
    settings.depth = 0;
    const Rendered shallow = render_in_memory(room.scene, settings);
    CHECK(shallow.status == Status::done);
    CHECK(shallow.statistics.rays.reflected + shallow.statistics.rays.refracted == 0);
}

TEST_CASE(WISP_ARITH_NAME ": hard case E6: a light in a triangle's plane, inside it or on its corner is not shaded by "
                          "it, and coplanar points have nothing of it") {
    const double slack = std::is_same_v<Real, float> ? 1e-4 : 1e-6;
    for (const LightKind kind : {LightKind::constant, LightKind::point}) {
        for (const Double3 &where : {Double3{0, 2, 0}, Double3{-1, 2, 1}, Double3{0, 2, -1}}) {
            // A lamp in a small panel, at its middle, at a corner and on an edge, above a floor and below a ceiling.
            Room room;
            const uint32_t white = room.material(matte({1, 1, 1}));
            add_floor(room, 0, 50, white);
            room.add({-1, 2, 1}, {1, 2, 1}, {1, 2, -1}, {-1, 2, -1}, white);
            room.add({-50, 4, -50}, {50, 4, -50}, {50, 4, 50}, {-50, 4, 50}, white);
            room.light(kind, where, {1, 1, 1});
            room.build();
            const auto expected = [&](const Double3 &p, double height) {
                const double x = p.x - where.x, z = p.z - where.z, far2 = x * x + z * z + height * height;
                const double cosine = height / std::sqrt(far2);
                return kind == LightKind::constant ? cosine : cosine / far2 / 3.14159265358979323846;
            };
            for (const double x : {-3.0, -0.7, 0.0, 0.4, 2.5}) {
                const Double3 below = {x, 0, 0.3}, above = {x, 4, 0.3}, panel = {x / 4, 2, 0.3};
                CHECK(at(room.look({6, 1, 0.5}, below).x) == doctest::Approx(expected(below, 2)).epsilon(slack));
                CHECK(at(room.look({6, 3, 0.5}, above).x) == doctest::Approx(expected(above, 2)).epsilon(slack));
                const double along = at(room.look({0.5, 3, 0.5}, panel).x);
                CHECK(along >= 0);
                CHECK(along < 1e-3);
            }
            // Where the lamp itself is.
            CHECK(std::isfinite(at(room.look({0.3, 1, 0.2}, where).x)));
            CHECK(std::isfinite(at(room.look({0.3, 3, 0.2}, where).x)));
        }
    }
}

} // namespace wisp::WISP_ARITH
