// Lightcuts: trees of lights, bounds of what their nodes give, cuts, and pictures by them.
#include "support/animated_room.h"
#include "wisp/settings.h"
#include "wisp/wisp.h"
#include <memory>

namespace wisp::WISP_ARITH {

namespace {

constexpr LightKind kinds[] = {LightKind::point, LightKind::spot, LightKind::parallel, LightKind::constant};
constexpr double eps = std::is_same_v<Real, double> ? 0x1p-53 : std::is_same_v<Real, float> ? 0x1p-24 : 0x1p-32;

struct Numbers {
    Sequence next;
    double within(double limit) { return (2 * next() - 1) * limit; }
    int pick(int count) { return static_cast<int>(next() * count); }
    Double3 vector(double limit) {
        const double x = within(limit), y = within(limit), z = within(limit);
        return {x, y, z};
    }
    Double3 direction() {
        Double3 v = vector(1);
        while (length(v) < 0.1 || length(v) > 1) v = vector(1);
        return unit(v);
    }
};

// Lights of some kinds, in lumps of all sizes, and their trees.
struct Lamps {
    Lamps(uint64_t seed, uint32_t count, double size, const std::vector<LightKind> &some = {kinds, kinds + 4}) {
        Numbers numbers{{seed * 31 + 11}};
        Double3 lump = {0, 0, 0}, axis = {0, 0, -1};
        double width = size;
        for (uint32_t i = 0; i < count; ++i) {
            if (numbers.pick(8) == 0) {
                lump = numbers.vector(size);
                axis = numbers.direction();
                width = size / (1 << (2 * numbers.pick(5)));
            }
            LightSource source = {};
            source.kind = some[static_cast<size_t>(numbers.pick(static_cast<int>(some.size())))];
            source.position = numbers.pick(5) ? lump + numbers.vector(width) : lump;
            source.direction = numbers.pick(5) ? unit(axis + numbers.direction() * (width / size)) : axis;
            source.one_minus_cosine = source.kind == LightKind::spot ? numbers.next() * numbers.next() : 2;
            const bool falls_off = source.kind == LightKind::point || source.kind == LightKind::spot;
            const double r = numbers.next(), g = numbers.next(), b = numbers.pick(4) ? numbers.next() : 0;
            source.color = Double3{r, g, b} * (falls_off ? size * size / count : 1.0 / count);
            if (numbers.pick(20) == 0) source.color = {0, 0, 0};
            lights.push_back(make_light(source));
        }
        make();
    }
    explicit Lamps(const std::vector<LightSource> &sources) {
        for (const LightSource &source : sources) lights.push_back(make_light(source));
        make();
    }
    void make() {
        Scene scene = {};
        scene.light_count = static_cast<uint32_t>(lights.size());
        memory.resize(static_cast<size_t>(light_cut_bytes(scene)));
        Arena arena(memory.data(), memory.size());
        REQUIRE(make_light_cuts(lights.data(), scene.light_count, arena, cuts));
    }
    std::vector<uint32_t> lights_of(uint32_t node) const {
        const LightNode &n = cuts.nodes[node];
        if (n.children == 0) return {n.light};
        std::vector<uint32_t> all = lights_of(n.children), more = lights_of(n.children + 1);
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }

    std::vector<Light> lights;
    std::vector<unsigned char> memory;
    LightCuts cuts;
};

// A point of a surface, and how it is shaded as in whitted.h.
struct Spot {
    Spot(Numbers &numbers, double size, const Lamps &lamps) {
        const std::vector<Light> &lights = lamps.lights;
        lit.position = vec_of(numbers.vector(numbers.pick(3) ? size : 3 * size));
        if (numbers.pick(6) == 0 && !lights.empty()) // near a light
            lit.position = lights[static_cast<size_t>(numbers.pick(static_cast<int>(lights.size())))].position +
                           vec_of(numbers.direction() * (numbers.pick(2) ? size * 1e-4 : size * 0.02));
        const Double3 n = numbers.direction();
        lit.normal = vec_of(n);
        lit.plane = vec_of(numbers.pick(2) ? n : unit(n + numbers.vector(0.3)));
        look = vec_of(numbers.direction());
        lit.mirrored = look - lit.normal * (Real(2) * dot(look, lit.normal));
        const bool matt = numbers.pick(3) == 0, shiny = numbers.pick(3) == 0;
        lit.diffuse = shiny ? Color(Real(0)) : vec_of({numbers.next(), 0.5, 0.25});
        lit.specular = matt ? Color(Real(0)) : vec_of({0.25, 0.5, numbers.next()});
        const double shininess[] = {0, 0.5, 1, 12, 400};
        lit.shininess = real(shininess[numbers.pick(5)]);
    }
    Color factor(const Light &light, const Illumination &from) const {
        const Vec3 to_light = -from.direction;
        const Real cosine = dot(lit.normal, to_light);
        if (!(dot(lit.plane, to_light) > Real(0)) || !(cosine > Real(0)) || !(largest(from.irradiance) > Real(0)))
            return Color(Real(0));
        const Vec3 off = -to_light + lit.normal * (Real(2) * cosine);
        const Real lambert = light.kind == LightKind::constant ? cosine : cosine * inv_pi<Real>;
        return lit.diffuse * lambert + lit.specular * power(dot(off, -look), lit.shininess);
    }
    Color reflected(const Light &light) const {
        const Illumination from = illuminate(light, lit.position, lit.position, lit.position);
        return from.irradiance * factor(light, from);
    }

    LitPoint lit;
    Vec3 look;
};

bool is_visible(uint64_t seed, uint32_t light) { return draw(photon_event(seed, 5), light) % 3 != 0; }

double max_channel(const Double3 &c) { return std::max({c.x, c.y, c.z}); }
Double3 added(const Double3 &sum, const Color &c) { return sum + Double3{at(c.x), at(c.y), at(c.z)}; }

bool contains(const Box &a, const Box &b) { return min(a.low, b.low) == a.low && max(a.high, b.high) == a.high; }

std::vector<float> picture(const Scene &scene, const Settings &settings, Statistics &statistics) {
    std::vector<float> rgb(static_cast<size_t>(settings.crop.width()) * static_cast<size_t>(settings.crop.height()) *
                           3);
    std::vector<unsigned char> block(static_cast<size_t>(renderer.plan(scene, settings).arena_bytes));
    Arena arena(block.data(), block.size());
    REQUIRE(renderer.render({scene, settings, arena, statistics, {}, rgb.data()}) == Status::done);
    return rgb;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": every light is in one leaf; nodes contain their children") {
    for (const uint32_t count : {0u, 1u, 2u, 3u, 17u, 100u, 1000u}) {
        CAPTURE(count);
        const Lamps lamps(count, count, 64);
        const LightCuts &cuts = lamps.cuts;
        CHECK(cuts.node_count == 2 * count - cuts.root_count);
        std::vector<int> met(count, 0);
        uint64_t kinds_met = 0;
        for (uint32_t r = 0; r < cuts.root_count; ++r) {
            const LightKind kind = cuts.lights[cuts.nodes[cuts.roots[r]].light].kind;
            kinds_met |= uint64_t{1} << static_cast<int>(kind);
            for (const uint32_t light : lamps.lights_of(cuts.roots[r])) {
                ++met[light];
                CHECK(lamps.lights[light].kind == kind);
            }
        }
        CHECK(static_cast<uint32_t>(__builtin_popcountll(kinds_met)) == cuts.root_count);
        CHECK(std::count(met.begin(), met.end(), 1) == count);
        std::vector<uint32_t> depth(cuts.node_count, 0);
        for (uint32_t n = 0; n < cuts.node_count; ++n) {
            const LightNode &node = cuts.nodes[n];
            const Light &light = lamps.lights[node.light];
            const std::vector<uint32_t> below = lamps.lights_of(n);
            CHECK(std::count(below.begin(), below.end(), node.light) == 1);
            CHECK(node.count == below.size());
            CHECK(depth[n] <= 64);
            if (node.children == 0) {
                CHECK(node.color == light.color);
                CHECK(node.box.low == (light.kind == LightKind::parallel ? -light.direction : light.position));
                CHECK(node.box.low == node.box.high);
                if (light.kind == LightKind::spot) CHECK(node.directions.low == light.direction);
                continue;
            }
            CHECK(node.children > n);
            Color sum(Real(0));
            for (const uint32_t child : {node.children, node.children + 1}) {
                const LightNode &child_node = cuts.nodes[child];
                CHECK(contains(node.box, child_node.box));
                CHECK(contains(node.directions, child_node.directions));
                CHECK(!(node.max_one_minus_cosine < child_node.max_one_minus_cosine));
                sum += child_node.color;
                depth[child] = depth[n] + 1;
            }
            CHECK(node.color == sum);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": near lights are together, and bright ones stand for their cluster") {
    std::vector<LightSource> sources;
    for (int i = 0; i < 40; ++i) // two lumps in turn, and one light is most of the brightness
        sources.push_back({LightKind::constant,
                           {i % 2 ? 50.0 + i : -50.0 - i, 0, 0},
                           {},
                           2,
                           Double3{1, 1, 1} * (i == 7 ? 1000.0 : 0.001)});
    const Lamps lamps(sources);
    const LightNode &root = lamps.cuts.nodes[lamps.cuts.roots[0]];
    CHECK(root.light == 7);
    uint32_t lump = root.children; // the bright light's side is split first, the rest by lumps below
    while (lamps.cuts.nodes[lump].children && lamps.cuts.nodes[lump].count != 20) ++lump;
    const std::vector<uint32_t> together = lamps.lights_of(lump);
    REQUIRE(together.size() == 20);
    for (const uint32_t light : together) CHECK(light % 2 == together[0] % 2);
}

TEST_CASE(WISP_ARITH_NAME ": no cluster is brighter than its bound") {
    uint64_t known = 0, near = 0, dark = 0, wrong = 0, tight = 0, leaves = 0;
    for (uint64_t seed = 0; seed < 60; ++seed) {
        const double size = seed % 3 == 0 ? 1 : seed % 3 == 1 ? 30 : 1000;
        const Lamps lamps(seed, 120, size, {kinds[seed % 4]});
        Numbers numbers{{seed + 900}};
        for (int i = 0; i < 40; ++i) {
            const Spot spot(numbers, size, lamps);
            std::vector<Double3> sum(lamps.cuts.node_count);
            for (uint32_t n = lamps.cuts.node_count; n-- > 0;) {
                const LightNode &node = lamps.cuts.nodes[n];
                const Real bound = max_light(lamps.cuts, node, spot.lit);
                if (node.children)
                    sum[n] = sum[node.children] + sum[node.children + 1];
                else
                    sum[n] = added({0, 0, 0}, spot.reflected(lamps.lights[node.light]));
                if (bound == no_bound) {
                    ++near;
                    continue;
                }
                const double alone = max_channel(added({0, 0, 0}, spot.reflected(representative(lamps.cuts, node))));
                wrong += !(max_channel(sum[n]) <= at(bound)) || !(alone <= at(bound));
                ++known;
                dark += !(bound > Real(0));
                if (node.children || !(max_channel(sum[n]) > 1e-4)) continue;
                ++leaves; // whose box is a point
                tight += at(bound) <= max_channel(sum[n]) * 1.02 + 1e-6;
            }
        }
    }
    CHECK(wrong == 0);
    CHECK(known > 100000);
    CHECK(near > 1000);
    CHECK(dark > known / 10);
    CHECK(dark < known);
    CHECK(leaves > 10000);
    CHECK(tight > leaves - leaves / 20);
}

TEST_CASE(WISP_ARITH_NAME ": a spot's cone that excludes the point is dark, one that does not is not") {
    std::vector<LightSource> sources;
    for (int i = 0; i < 9; ++i)
        sources.push_back({LightKind::spot, {i % 3 - 1.0, 10, i / 3 - 1.0}, {0, -1, 0}, 0.1, {100, 100, 100}});
    const Lamps lamps(sources);
    const Vec3 up = vec_of({0, 1, 0});
    const auto bound = [&](const Double3 &at) {
        const LitPoint point = {vec_of(at), up, up, up, Color(Real(1)), Color(Real(0)), Real(1)};
        return max_light(lamps.cuts, lamps.cuts.nodes[lamps.cuts.roots[0]], point);
    };
    CHECK(bound({0, 0, 0}) > Real(0));
    CHECK(bound({4, 0, 0}) > Real(0));
    CHECK(bound({20, 0, 0}) == Real(0));
    CHECK(bound({0, 11, 0}) == Real(0));
}

TEST_CASE(WISP_ARITH_NAME ": no node of a cut errs by more than 2 % of the sum") {
    uint64_t clusters = 0, lights = 0, asked = 0;
    for (uint64_t seed = 0; seed < 60; ++seed) {
        const double size = seed % 3 == 0 ? 1 : seed % 3 == 1 ? 30 : 1000;
        Lamps lamps(seed, 1 + 16 * static_cast<uint32_t>(seed), size);
        Numbers numbers{{seed + 500}};
        for (int i = 0; i < 20; ++i) {
            const Spot spot(numbers, size, lamps);
            if (!(largest(spot.lit.diffuse + spot.lit.specular) > Real(0))) continue;
            std::vector<int> times(lamps.lights.size(), 0);
            const auto shade_light = [&](uint32_t light, const Illumination &from) {
                ++times[light];
                return is_visible(seed, light) ? spot.factor(lamps.lights[light], from) : Color(Real(0));
            };
            const LightOfCut cut = light_of_cut(lamps.cuts, spot.lit, shade_light);
            for (const int t : times) CHECK(t <= 1);
            asked += static_cast<uint64_t>(std::count(times.begin(), times.end(), 1));
            lights += times.size();
            clusters += cut.clusters;
            const auto seen = [&](uint32_t light) {
                return is_visible(seed, light) ? spot.reflected(lamps.lights[light]) : Color(Real(0));
            };
            Color exactly(Real(0));
            for (uint32_t l = 0; l < lamps.lights.size(); ++l) exactly += seen(l);
            const Double3 all = added({0, 0, 0}, exactly);
            // Half a last place for each light, and relative to the sum where those are of floats.
            const double rounding =
                4 * static_cast<double>(lamps.lights.size()) * eps * std::max(1.0, max_channel(all));
            const double largest_error = 0.02 * at(largest(cut.sum)) + rounding;
            double error = rounding;
            for (uint32_t c = 0; c < cut.clusters; ++c) {
                const CutNode &node = lamps.cuts.heap[c];
                Double3 right = {0, 0, 0};
                for (const uint32_t light : lamps.lights_of(node.node)) right = added(right, seen(light));
                const Double3 wrong = added(right, -node.contribution);
                CHECK(std::max(max_channel(wrong), max_channel(wrong * -1.0)) <= largest_error);
                CHECK(at(node.bound) <= largest_error);
                error += at(node.bound);
            }
            const Double3 wrong = added(all, -cut.sum);
            CHECK(std::max(max_channel(wrong), max_channel(wrong * -1.0)) <= error);

            // With no error allowed every light is asked, but for those that cannot be seen.
            LightCuts every = lamps.cuts;
            every.error = Real(0);
            every.max_nodes = ~0u;
            const LightOfCut exact = light_of_cut(every, spot.lit, shade_light);
            CHECK(exact.clusters == 0);
            const Double3 none = added(all, -exact.sum);
            CHECK(std::max(max_channel(none), max_channel(none * -1.0)) <= rounding);
            if (std::is_same_v<Real, Fixed>) CHECK(exact.sum == exactly);
        }
    }
    CHECK(clusters > 10000);
    CHECK(asked < lights / 2);
}

TEST_CASE(WISP_ARITH_NAME ": a cut has no more nodes than it may, but where it is near") {
    Lamps lamps(3, 1000, 100, {LightKind::point});
    lamps.cuts.error = Real(0);
    lamps.cuts.max_nodes = 50;
    const auto asked = [&](const Double3 &at) {
        const Vec3 up = vec_of({0, 1, 0});
        const LitPoint point = {vec_of(at), up, up, up, Color(Real(1)), Color(Real(0)), Real(1)};
        uint32_t times = 0;
        light_of_cut(lamps.cuts, point, [&](uint32_t, const Illumination &) {
            ++times;
            return Color(Real(1));
        });
        return times;
    };
    CHECK(asked({0, -150, 0}) <= 51);
    CHECK(asked({0, -150, 0}) >= 40);
    std::vector<LightSource> same(200, {LightKind::point, {1, 2, 3}, {}, 2, {1, 2, 3}});
    lamps.lights.clear();
    for (const LightSource &source : same) lamps.lights.push_back(make_light(source));
    lamps.make();
    lamps.cuts.error = Real(0);
    lamps.cuts.max_nodes = 50;
    CHECK(asked({1, 2, 3}) == 200);
    CHECK(asked({1, -2, 3}) <= 51);
}

TEST_CASE(WISP_ARITH_NAME ": pictures of surfaces differ from those of all lights by no more than their errors") {
    for (uint64_t seed = 0; seed < 12; ++seed) {
        RoomFrames room(seed, 16, 500, ShadowMethod::trace);
        std::vector<unsigned char> block(static_cast<size_t>(placement_bytes(room.scene, TreeKind::bvh)));
        Arena arena(block.data(), block.size());
        place_surfaces(room.scene, arena, room.surfaces);
        const uint64_t &rays = room.statistics.rays.shadow;
        Lamps lamps(room.lights);
        room.tracer.lights = lamps.lights.data();
        lamps.cuts.error = Real(0.01 / 500); // of 500 clusters at most
        const View view(room.scene.camera);
        room.tracer.depth = 0;
        uint64_t by_all = 0, by_cuts = 0;
        for (int y = 0; y < room_pixels; y += 3)
            for (int x = 0; x < room_pixels; ++x) {
                const Ray ray = view.ray_through(Real(x) + Real(0.5), Real(y) + Real(0.5));
                uint64_t before = rays;
                room.tracer.cuts = nullptr;
                const Color all = trace(room.tracer, ray);
                by_all += rays - before;
                before = rays;
                room.tracer.cuts = &lamps.cuts;
                const Color some = trace(room.tracer, ray);
                by_cuts += rays - before;
                const double right = at(largest(all)), error = 0.01 / 0.99 * right + 2000 * eps * std::max(1.0, right);
                CHECK(at(largest(all - some)) <= error);
                CHECK(at(largest(some - all)) <= error);
            }
        CHECK(by_cuts <= by_all);
    }
}

TEST_CASE(WISP_ARITH_NAME ": pictures by cuts take fewer shadow rays, are the same by every shadow method" *
          doctest::test_suite("long")) {
    uint64_t by_all = 0, by_cuts = 0;
    for (uint64_t seed = 40; seed < 44; ++seed) {
        RoomFrames room(seed, 16, 500, ShadowMethod::trace);
        Settings settings = room.settings;
        Statistics all = {}, cuts = {}, unused = {};
        const std::vector<float> right = picture(room.scene, settings, all);
        settings.lights = LightChoice::cuts;
        const std::vector<float> whole = picture(room.scene, settings, cuts);
        by_all += all.rays.shadow;
        by_cuts += cuts.rays.shadow;
        CHECK(whole != right);
        for (const ShadowMethod method : {ShadowMethod::cache, ShadowMethod::exact, ShadowMethod::voxel}) {
            settings.shadows = method;
            CHECK(picture(room.scene, settings, unused) == whole);
        }
        settings.shadows = ShadowMethod::trace;
        settings.crop = {3, 5, 14, 9};
        const std::vector<float> cropped = picture(room.scene, settings, unused);
        for (size_t y = 0; y < 4; ++y)
            CHECK(std::equal(cropped.begin() + static_cast<int64_t>(33 * y),
                             cropped.begin() + static_cast<int64_t>(33 * y + 33),
                             whole.begin() + static_cast<int64_t>(3 * (room_pixels * (y + 5) + 3))));
    }
    CHECK(by_cuts < by_all); // most points of these rooms are dark, and there no light can be left out
}

TEST_CASE(WISP_ARITH_NAME ": where there is light a few clusters of many lights do") {
    Room room;
    const uint32_t single_channel = room.material(matte({0.5, 0.5, 0.5}));
    add_floor(room, 0, 200, single_channel);
    add_floor(room, 10, 20, single_channel); // all that the middle of the other one sees of the lights
    Numbers numbers{{1}};
    for (int i = 0; i < 500; ++i)
        room.light(kinds[i % 2 ? 0 : 3], numbers.vector(50) + Double3{0, 100, 0},
                   Double3{1, 1, 1} * (i % 2 ? 20.0 : 0.002));
    room.build();
    const Lamps lamps(room.lights);
    const uint64_t &rays = room.statistics.rays.shadow;
    for (const double x : {-80.0, -25.0, 0.0, 40.0}) {
        room.tracer.cuts = nullptr;
        const Color all = room.look({x, 5, 10}, {x, 0, 0});
        const uint64_t by_all = rays;
        CHECK(by_all == 500);
        room.tracer.cuts = &lamps.cuts;
        const Color cuts = room.look({x, 5, 10}, {x, 0, 0});
        const bool dark = x == 0;
        CHECK((at(all.x) == 0) == dark);
        CHECK((cuts == all) == dark);
        CHECK(rays - by_all <= (dark ? 500 : 250));
        room.statistics.rays.shadow = 0;
    }
}

TEST_CASE(WISP_ARITH_NAME ": cuts of no light and of one are the picture of all, within the planned bytes") {
    for (const uint32_t count : {0u, 1u, 30u}) {
        RoomFrames room(5, 16, count, ShadowMethod::trace);
        Settings settings = room.settings;
        Statistics unused = {};
        const uint64_t before = renderer.plan(room.scene, settings).arena_bytes;
        const std::vector<float> all = picture(room.scene, settings, unused);
        settings.lights = LightChoice::cuts;
        const Plan cut = renderer.plan(room.scene, settings);
        CHECK(cut.arena_bytes == before + cut[Stage::light_cuts].bytes);
        CHECK(cut[Stage::light_cuts].bytes == (count > 0 ? light_cut_bytes(room.scene) : 0));
        const std::vector<float> cuts = picture(room.scene, settings, unused);
        if (count < 2) CHECK(cuts == all);
        std::vector<unsigned char> block(static_cast<size_t>(cut.arena_bytes));
        for (size_t eighths = 0; eighths < 8; ++eighths) { // too little is said, or it suffices
            Arena small(block.data(), block.size() * eighths / 8);
            std::vector<float> rgb(all.size());
            const Status status = renderer.render({room.scene, settings, small, unused, {}, rgb.data()});
            CHECK((status == Status::out_of_memory || (status == Status::done && rgb == cuts)));
            CHECK((status == Status::out_of_memory || eighths > 0));
        }
    }
}

} // namespace wisp::WISP_ARITH
