// The paper's shadow culling against a second implementation, by hand, and where it is wrong.
#include "core/shadows/mode_word.h"
#include "core/shadows/nah_culling.h"
#include "support/animated_room.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"

namespace wisp::WISP_ARITH {

namespace {

// C2 to C5 once more: whole frame buffers, and a record for everything.
class ReferenceCulling {
  public:
    enum Occlusion { init, partially, fully, dynamic };
    struct Record {
        Occlusion occlusion = init;
        bool hit[15] = {}, missed[15] = {};
        uint64_t now = 0, most = 0;
    };

    explicit ReferenceCulling(RoomFrames &room) : room_(room), records(room.triangles.size()) {}

    void begin() {
        seen_.assign(static_cast<size_t>(room_pixels) * room_pixels, no_triangle);
        for (Record &r : records) {
            r.now = 0;
            if (r.occlusion == partially) r.occlusion = init;
        }
        for (size_t l = 0; l < lights_.size() && l < 15; ++l) {
            const LightSource &a = lights_[l], &b = room_.lights[l];
            if (length(a.position - b.position) > 0 || length(a.direction - b.direction) > 0)
                for (Record &r : records) {
                    r.hit[l] = r.missed[l] = false;
                    if (r.occlusion == fully) r.occlusion = init;
                }
        }
        lights_ = room_.lights;
    }
    void see(int x, int y, const Ray &ray) {
        TreeCounts unused = {};
        const Hit hit = nearest_hit(room_.surfaces, ray, Real(0), infinite_distance, no_triangle, unused);
        if (!hit.found) return;
        seen_[at(x, y)] = hit.triangle;
        Record &mine = records[hit.triangle];
        ++mine.now;
        if (hit.triangle >= room_.scene.static_count) {
            mine.occlusion = dynamic;
            return;
        }
        if (x == 0 || y == 0 || x == room_pixels - 1 || y == room_pixels - 1) {
            mine.occlusion = partially;
            return;
        }
        for (const size_t place : {at(x - 1, y), at(x, y - 1)}) {
            const uint32_t other = seen_[place];
            if (other == no_triangle || records[other].occlusion != init || other == hit.triangle) continue;
            ++tests;
            const Double3 *c = room_.triangles[other].corner;
            TriangleHit met;
            if (intersect(TriangleRay(ray.origin, ray.direction), vec_of(c[0]), vec_of(c[1]), vec_of(c[2]), met) &&
                met.distance > Real(0))
                records[other].occlusion = partially;
        }
    }
    bool shadowed(const ShadowQuery &query) {
        const bool blocked = room_.blocked(query);
        if (query.light >= 15) return blocked;
        Record &r = records[query.triangle];
        bool &hit = r.hit[query.light], &missed = r.missed[query.light];
        if (r.occlusion == fully && hit && !missed) {
            ++culled;
            return true;
        }
        if (r.occlusion == fully && missed && !hit) {
            ++moving;
            TreeCounts unused = {};
            return is_blocked_by_moving(room_.surfaces, query.ray, query.begin, query.end, query.triangle, unused);
        }
        (blocked ? hit : missed) = true;
        return blocked;
    }
    void end() {
        for (Record &r : records) {
            if (r.now == 0) continue;
            if (r.occlusion == init)
                r.occlusion = fully;
            else if (r.occlusion == fully && r.now > 4 * r.most)
                r.occlusion = init;
            r.most = std::max(r.most, r.now);
        }
    }

  private:
    static size_t at(int x, int y) { return static_cast<size_t>(y * room_pixels + x); }
    RoomFrames &room_;
    std::vector<uint32_t> seen_;
    std::vector<LightSource> lights_;

  public:
    std::vector<Record> records;
    uint64_t tests = 0, culled = 0, moving = 0;
};

// A picture of 16 x 16 pixels, by render().
struct Shot {
    std::vector<float> rgb;
    Statistics statistics;
};
class Frames {
  public:
    Frames(const Scene &scene, ShadowMethod method, uint32_t samples = 1, Crop crop = {0, 0, room_pixels, room_pixels})
        : scene_(scene) {
        settings_.crop = crop;
        settings_.samples = samples;
        settings_.shadows = method;
        settings_.check_shadows = true;
        block_.resize(static_cast<size_t>(renderer.plan(scene, settings_).arena_bytes));
    }
    Shot next() {
        Shot r = {std::vector<float>(settings_.crop.pixels() * 3), {}};
        Arena arena(block_.data(), block_.size());
        REQUIRE(renderer.render({scene_, settings_, arena, r.statistics, {}, r.rgb.data(), nullptr, &cache_}) ==
                Status::done);
        return r;
    }

  private:
    const Scene &scene_;
    Settings settings_ = {};
    std::vector<unsigned char> block_;
    FrameCache cache_ = {};
};

// Looks down from (x, 8, z) on a square of half-width 4 on the floor.
void look_down(Scene &scene, double x, double z) { scene.camera = {{x, 8, z}, {-4, -8, -4}, {0.5, 0, 0}, {0, 0, 0.5}}; }

uint64_t different_pixels(const Shot &a, const Shot &b) {
    uint64_t count = 0;
    for (size_t i = 0; i < a.rgb.size(); i += 3)
        count += a.rgb[i] != b.rgb[i] || a.rgb[i + 1] != b.rgb[i + 1] || a.rgb[i + 2] != b.rgb[i + 2];
    return count;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": a mode word has two bits of occlusion and two for each of 15 lights") {
    ModeWord word;
    CHECK(word.bits() == 0);
    CHECK(word.occlusion() == OcclusionMode::init);
    for (uint32_t l = 0; l < 15; ++l) CHECK(word.shadow(l) == ShadowMode::init);
    word.set_occlusion(OcclusionMode::fully_rendered);
    CHECK(word.bits() == 2);
    word.add_shadow(0, true);
    CHECK(word.bits() == 0x6);
    word.add_shadow(14, false);
    CHECK(word.bits() == 0x80000006);
    word.add_shadow(14, true);
    CHECK(word.bits() == 0xc0000006);
    CHECK(word.shadow(0) == ShadowMode::full);
    CHECK(word.shadow(1) == ShadowMode::init);
    CHECK(word.shadow(14) == ShadowMode::partial);
    word.add_shadow(1, false);
    CHECK(word.shadow(1) == ShadowMode::none);
    word.set_occlusion(OcclusionMode::dynamic);
    CHECK(word.occlusion() == OcclusionMode::dynamic);
    word.set_occlusion(OcclusionMode::partially_occluded);
    CHECK(word.bits() == 0xc0000025);
    word.forget_shadow(14);
    CHECK(word.bits() == 0x25);
    word.forget_shadow(0);
    CHECK(word.bits() == 0x21);
}

TEST_CASE(WISP_ARITH_NAME ": the paper's shadows are those of a second implementation, in every frame") {
    uint64_t queries = 0, different = 0, culled = 0, moving = 0, tests = 0, wrong = 0;
    for (uint64_t seed = 0; seed < 150; ++seed) {
        const double sizes[] = {1, 16, 1024};
        const uint32_t light_counts[] = {2, 1, 3, 15, 16, 40};
        RoomFrames room(seed, sizes[seed % 3], light_counts[seed / 3 % 6], ShadowMethod::paper, seed % 2 == 0);
        ReferenceCulling reference(room);
        std::vector<bool> wrong_here;
        size_t pixel = 0;
        room.recorded.on_query = [&](const ShadowQuery &query, bool found) {
            ++queries;
            different += found != reference.shadowed(query);
            if (found != room.blocked(query)) wrong_here[pixel] = true;
        };
        for (int frame = 0; frame < 5; ++frame) {
            reference.begin();
            wrong_here.assign(static_cast<size_t>(room_pixels) * room_pixels, false);
            room.statistics.shadow.wrong_pixels = 0;
            room.render_frame([&](int x, int y, const Ray &ray) {
                pixel = static_cast<size_t>(y * room_pixels + x);
                reference.see(x, y, ray);
            });
            reference.end();
            const auto count = static_cast<uint64_t>(std::count(wrong_here.begin(), wrong_here.end(), true));
            CHECK(room.statistics.shadow.wrong_pixels == count);
            wrong += count;
            room.change();
        }
        CHECK(room.statistics.rays.shadow_culled == reference.culled);
        CHECK(room.statistics.rays.shadow_dynamic_only == reference.moving);
        CHECK(room.statistics.shadow.extra_tests == reference.tests);
        culled += reference.culled;
        moving += reference.moving;
        tests += reference.tests;
    }
    CHECK(different == 0);
    CHECK(queries > 200000);
    CHECK(culled > 1000);
    CHECK(moving > 1000);
    CHECK(tests > 1000);
    CHECK(wrong > 100);
}

TEST_CASE(WISP_ARITH_NAME ": what was wholly seen in the light asks moving triangles alone, in shadow none") {
    for (const uint32_t lights : {0u, 1u, 15u, 16u, 40u})
        for (const bool shadowed : {false, true}) {
            CAPTURE(lights);
            CAPTURE(shadowed);
            Room room;
            const uint32_t white = room.material(matte({0.5, 0.5, 0.5}));
            room.add({-3, 0, 3}, {3, 0, 3}, {0, 0, -3}, white);
            if (shadowed) room.add({-90, 12, 90}, {90, 12, 90}, {0, 12, -90}, white);
            for (uint32_t l = 0; l < lights; ++l) room.light(LightKind::constant, {0, 16, 0}, {0.01, 0.01, 0.01});
            room.build();
            look_down(room.scene, 0, 0);
            Frames paper(room.scene, ShadowMethod::paper), plain(room.scene, ShadowMethod::trace);
            const Shot traced = plain.next(), first = paper.next(), second = paper.next();
            CHECK(first.rgb == traced.rgb);
            CHECK(second.rgb == traced.rgb);
            const uint64_t rays = traced.statistics.rays.shadow;
            CHECK((rays > 0) == (lights > 0));
            CHECK(first.statistics.rays.shadow_culled + first.statistics.rays.shadow_dynamic_only == 0);
            CHECK(first.statistics.shadow.traced.node_visits == traced.statistics.shadow.traced.node_visits);
            const uint64_t known = lights ? rays / lights * std::min(lights, 15u) : 0;
            CHECK(second.statistics.rays.shadow_culled == (shadowed ? known : 0));
            CHECK(second.statistics.rays.shadow_dynamic_only == (shadowed ? 0 : known));
            const uint64_t visits = traced.statistics.shadow.traced.node_visits;
            CHECK(second.statistics.shadow.traced.node_visits == (lights > 15 ? visits / lights * (lights - 15) : 0));
            CHECK(second.statistics.shadow.extra_tests == 0); // one triangle, seen whole
            CHECK(second.statistics.shadow.checked == (lights > 0));
            CHECK(second.statistics.shadow.wrong_pixels == 0);
            // A light goes elsewhere: all is traced again.
            if (lights == 0) continue;
            room.lights[0].position.x = 1;
            const Shot moved = paper.next();
            CHECK(moved.statistics.rays.shadow_culled + moved.statistics.rays.shadow_dynamic_only == 0);
        }
}

TEST_CASE(WISP_ARITH_NAME ": a crop is a screen of its own") {
    uint64_t culled = 0, tests = 0;
    for (uint64_t seed = 0; seed < 20; ++seed) {
        RandomRoom room(seed, 4);
        look_down(room.scene, 0, 0);
        Scene shifted = room.scene; // by two columns and four rows
        shifted.camera.corner = {-3, -8, -2};
        Frames part(room.scene, ShadowMethod::paper, 1, {2, 4, 13, 14}),
            whole(shifted, ShadowMethod::paper, 1, {0, 0, 11, 10});
        for (int frame = 0; frame < 3; ++frame) {
            const Shot a = part.next(), b = whole.next();
            CHECK(a.rgb == b.rgb);
            CHECK(a.statistics.rays.shadow_culled == b.statistics.rays.shadow_culled);
            CHECK(a.statistics.shadow.extra_tests == b.statistics.shadow.extra_tests);
            CHECK(a.statistics.shadow.wrong_pixels == b.statistics.shadow.wrong_pixels);
            culled += b.statistics.rays.shadow_culled;
            tests += b.statistics.shadow.extra_tests;
        }
    }
    CHECK(culled > 20);
    CHECK(tests > 100);
}

TEST_CASE(WISP_ARITH_NAME ": a triangle that the screen or another cuts off is traced until it is seen whole") {
    Room room;
    const uint32_t white = room.material(matte({0.5, 0.5, 0.5}));
    room.add({-3, 0, 3}, {3, 0, 3}, {0, 0, -3}, white);
    room.light(LightKind::constant, {0, 16, 0}, {1, 1, 1});
    room.build();
    look_down(room.scene, 3, 0); // half of it
    Frames paper(room.scene, ShadowMethod::paper);
    const auto unasked = [&paper] {
        const Statistics s = paper.next().statistics;
        CHECK(s.rays.shadow > 0);
        return s.rays.shadow_dynamic_only;
    };
    CHECK(unasked() == 0);
    CHECK(unasked() == 0);
    look_down(room.scene, 0, 0);
    CHECK(unasked() == 0); // whole for the first time
    CHECK(unasked() > 0);
    look_down(room.scene, 3, 0);
    // Until its first pixel at the edge of the screen is met, it is taken for whole: part of the first row's rays.
    CHECK(unasked() < 16 * 8);
    look_down(room.scene, 0, 0);
    CHECK(unasked() == 0);
    CHECK(unasked() > 0);
}

TEST_CASE(WISP_ARITH_NAME ": zooming in by more than four times the pixels begins anew") {
    Room room;
    const uint32_t white = room.material(matte({0.5, 0.5, 0.5}));
    room.add({-3, 0, 3}, {3, 0, 3}, {0, 0, -3}, white);
    room.light(LightKind::constant, {0, 64, 0}, {1, 1, 1});
    room.build();
    look_down(room.scene, 0, 0);
    const Double3 near = room.scene.camera.origin;
    Frames paper(room.scene, ShadowMethod::paper);
    room.scene.camera.origin.y = 24;
    const Shot first = paper.next();
    CHECK(paper.next().statistics.rays.shadow_dynamic_only == first.statistics.rays.shadow);
    room.scene.camera.origin = near;
    const Shot zoomed = paper.next(); // still by what is known
    CHECK(zoomed.statistics.rays.shadow > 4 * first.statistics.rays.shadow);
    CHECK(zoomed.statistics.rays.shadow_dynamic_only == zoomed.statistics.rays.shadow);
    CHECK(paper.next().statistics.rays.shadow_dynamic_only == 0);
    CHECK(paper.next().statistics.rays.shadow_dynamic_only == zoomed.statistics.rays.shadow);
}

TEST_CASE(WISP_ARITH_NAME ": the shadow of an occluder between the pixels is missed, and counted") {
    for (const uint32_t samples : {1u, 4u}) {
        Room room;
        const uint32_t white = room.material(matte({0.5, 0.5, 0.5}));
        room.add({-3, 0, 3}, {3, 0, 3}, {0, 0, -3}, white);
        // Above the eye. Its shadow is twice its size, 0.25 wide about (0.5, 0, 0.5): a corner of four pixels.
        room.add({0.19, 16, 0.31}, {0.31, 16, 0.31}, {0.25, 16, 0.19}, white);
        room.light(LightKind::constant, {0, 32, 0}, {1, 1, 1});
        room.build();
        look_down(room.scene, 0, 0);
        Frames paper(room.scene, ShadowMethod::paper, samples), plain(room.scene, ShadowMethod::trace, samples);
        const Shot first = paper.next();
        CHECK(first.rgb == plain.next().rgb);
        CHECK(first.statistics.shadow.wrong_pixels == 0);
        // Half a pixel aside a camera ray meets the shadow.
        const double aside = samples == 1 ? 0.25 : 0.125;
        look_down(room.scene, aside, aside);
        const Shot second = paper.next(), right = plain.next();
        CHECK(different_pixels(second, right) > 0);
        CHECK(second.statistics.shadow.wrong_pixels == different_pixels(second, right));
        CHECK(!right.statistics.shadow.checked);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the shadow of an instance that has moved on stays") {
    Room room;
    const uint32_t white = room.material(matte({0.5, 0.5, 0.5}));
    room.add({-3, 0, 3}, {3, 0, 3}, {0, 0, -3}, white);
    room.add({-90, 0, 90}, {90, 0, 90}, {0, 0, -90}, white);
    room.scene.static_count = 1;
    room.scene.instance_triangle_count = 1;
    Instance instance = {};
    instance.first = instance.count = 1;
    instance.axis[0].x = instance.axis[1].y = instance.axis[2].z = 1;
    instance.inverse[0].x = instance.inverse[1].y = instance.inverse[2].z = 1;
    instance.origin = {0, 12, 0};
    instance.visible = true;
    room.instances.push_back(instance);
    room.light(LightKind::constant, {0, 16, 0}, {1, 1, 1});
    room.build();
    look_down(room.scene, 0, 0);
    Frames paper(room.scene, ShadowMethod::paper), plain(room.scene, ShadowMethod::trace);
    CHECK(paper.next().rgb == plain.next().rgb);
    room.instances[0].origin.y = 20;
    const Shot second = paper.next(), right = plain.next();
    CHECK(second.statistics.rays.shadow_culled == right.statistics.rays.shadow);
    CHECK(second.statistics.shadow.wrong_pixels == right.statistics.rays.shadow);
    CHECK(different_pixels(second, right) == right.statistics.rays.shadow);
}

} // namespace wisp::WISP_ARITH
