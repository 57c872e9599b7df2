// Layers: they add up to the picture to the bit, which is the same without them; each is the picture of its part alone;
// what is met first is where it is; and a crop's are part of the whole.
#include "support/smoky_room.h"
#include "wisp/layers.h"
#include <cmath>
#include <cstring>

namespace wisp::WISP_ARITH {

namespace {

using Plane = std::vector<float>;

struct Layered {
    Plan plan;
    Plane rgb, planes;
    size_t size; // of a plane
    std::vector<PixelSums> sums;

    bool has(Layer layer) const { return has_layer(plan.layers, layer); }
    // R G B or X Y Z of all pixels, or their one number; 0 where the layer is not there.
    Plane operator[](Layer layer) const {
        const size_t channels = channels_of(layer);
        if (!has(layer)) return Plane(channels * size);
        const size_t first = planes_before(plan.layers, static_cast<uint32_t>(layer));
        Plane values;
        for (size_t i = 0; i < channels * size; ++i)
            values.push_back(planes[(first + i % channels) * size + i / channels]);
        return values;
    }
};

// In exactly the arena and the planes that are planned: the test build ends where a stage takes more.
Layered render_layers(const Scene &scene, Settings settings) {
    settings.layers = true;
    Layered made = {renderer.plan(scene, settings), {}, {}, 0, {}};
    made.size = static_cast<size_t>(settings.crop.width() * settings.crop.height());
    made.rgb.resize(3 * made.size);
    made.planes.resize(planes_of(made.plan.layers) * made.size, -7);
    made.sums.resize(made.size);
    std::vector<unsigned char> memory(made.plan.arena_bytes);
    Arena arena(memory.data(), memory.size());
    Statistics statistics;
    Job job = {scene, settings, arena, statistics, {}, made.rgb.data()};
    job.layers = made.planes.data();
    job.pixels = made.sums.data();
    REQUIRE(renderer.render(job) == Status::done);
    return made;
}

constexpr Layer summed[] = {Layer::emission, Layer::single, Layer::multiple, Layer::surfaces, Layer::background};

bool same_bits(const Plane &a, const Plane &b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// In float, in any order, and in double.
void check_sums(const Layered &made) {
    std::vector<Plane> parts;
    for (const Layer layer : summed) parts.push_back(made[layer]);
    int order[] = {0, 1, 2, 3, 4};
    do {
        for (size_t i = 0; i < made.rgb.size(); ++i) {
            float sum = 0;
            for (const int part : order) sum += parts[part][i];
            REQUIRE(sum == made.rgb[i]);
        }
    } while (std::next_permutation(order, order + 5));
    for (size_t i = 0; i < made.rgb.size(); ++i) {
        double sum = 0;
        for (const Plane &part : parts) {
            CHECK(part[i] >= 0);
            sum += double{part[i]};
        }
        CHECK(sum == double{made.rgb[i]});
    }
}

// The largest difference, relative to the brightest of b.
double difference(const Plane &a, const Plane &b) {
    REQUIRE(a.size() == b.size());
    double most = 0, brightest = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        most = worst_of(most, std::fabs(double{a[i]} - double{b[i]}));
        brightest = std::max(brightest, double{b[i]});
    }
    REQUIRE(brightest > 0);
    return most / brightest;
}
Plane less(const Plane &a, const Plane &b) {
    Plane rest;
    for (size_t i = 0; i < a.size(); ++i) rest.push_back(a[i] - b[i]);
    return rest;
}
Plane sum(const Plane &a, const Plane &b) {
    Plane all;
    for (size_t i = 0; i < a.size(); ++i) all.push_back(a[i] + b[i]);
    return all;
}

// Two sums of the same some hundred terms, rounded in another order, and differences of pictures in float.
constexpr double rounding = (std::is_same_v<Real, float> ? 64 : 16) * 6e-8;

} // namespace

TEST_CASE(WISP_ARITH_NAME ": layers add up to the picture to the bit, which is the same without them") {
    for (const bool surfaces : {false, true})
        for (const bool glows : {false, true})
            for (const uint32_t paths : {0, 3})
                for (const Way &way : ways) {
                    if (paths > 0 && way.irradiance != IrradianceMap::uniform) continue;
                    const Scenery room(surfaces, glows);
                    Settings settings = settings_of(way);
                    settings.paths = paths;
                    const Layered made = render_layers(room.scene, settings);
                    CHECK(same_bits(made.rgb, render_in_memory(room.scene, settings).rgb));
                    check_sums(made);
                    CHECK(made.has(Layer::emission) == glows);
                    CHECK(made.has(Layer::surfaces) == surfaces);
                    CHECK(made.has(Layer::depth) == surfaces);
                    for (const Layer layer : {Layer::single, Layer::multiple, Layer::background, Layer::alpha})
                        CHECK(made.has(layer));
                    for (const float value : made.planes) REQUIRE(value != -7);
                }
}

TEST_CASE(WISP_ARITH_NAME ": layers of very bright, very dark and black pixels add up, too") {
    for (const int exponent : {-140, -120, 0, 120}) { // down to floats that have lost digits
        Scenery room;
        room.scene.radiance_exponent = exponent;
        check_sums(render_layers(room.scene, settings_of(ways[3])));
    }
    LitSmoke dark(cloud(50, 1, 1, 0.1));
    dark.scene.background = {0, 0, 0};
    const Layered made = render_layers(dark.scene, small_settings(3));
    for (const Layer layer : summed) CHECK(!made.has(layer));
    CHECK(planes_of(made.plan.layers) == 1);
}

TEST_CASE(WISP_ARITH_NAME ": each layer of light is the picture of that light alone") {
    const auto check = [](const Way &way, uint32_t paths) {
        Settings settings = settings_of(way);
        settings.paths = paths;
        Settings once = settings;
        once.photons = once.paths = 0;
        const auto picture = [](Scenery &room, const Settings &how) {
            room.scene.background = {0, 0, 0};
            return render_in_memory(room.scene, how).rgb;
        };
        Scenery lit(false, false);
        const Layered made = render_layers(lit.scene, settings);
        const Plane single = picture(lit, once), both = picture(lit, settings);
        CHECK(difference(made[Layer::single], single) < rounding);
        CHECK(difference(made[Layer::multiple], less(both, single)) < rounding);

        Scenery absorbing(false, false);
        absorbing.smokes[0].albedo = {0, 0, 0};
        CHECK(difference(made[Layer::background], render_in_memory(absorbing.scene, settings).rgb) < rounding);

        Scenery glowing(false, true);
        const Layered glow = render_layers(glowing.scene, settings);
        glowing.scene.light_count = 0;
        CHECK(difference(glow[Layer::emission], picture(glowing, once)) < rounding);
    };
    for (const Way &way : ways) check(way, 0);
    for (const Way &way : {ways[0], ways[3], ways[5]}) check(way, 3);
}

TEST_CASE(WISP_ARITH_NAME ": among mirrors and glass layers of smoke are what the picture has more than without it") {
    for (const Way &way : ways) {
        const Settings settings = settings_of(way);
        Scenery room;
        const Layered made = render_layers(room.scene, settings);
        room.smokes[0].albedo = room.smokes[0].emission = {0, 0, 0}; // it still absorbs 1 - albedo, but sends nothing
        const Plane behind = render_in_memory(room.scene, settings).rgb;
        const Plane smoke = sum(sum(made[Layer::emission], made[Layer::single]), made[Layer::multiple]);
        CHECK(difference(sum(made[Layer::surfaces], made[Layer::background]), behind) < rounding);
        CHECK(difference(smoke, less(made.rgb, behind)) < rounding);
        room.scene.background = {0, 0, 0};
        CHECK(difference(made[Layer::surfaces], render_in_memory(room.scene, settings).rgb) < rounding);
        for (Material &material : room.materials) material.ambient = {0, 0, 0};
        CHECK(difference(made[Layer::direct], render_in_memory(room.scene, settings).rgb) < rounding);
    }
}

TEST_CASE(WISP_ARITH_NAME ": depth, normal, albedo, alpha and shadow are those of what is met first") {
    // The eye looks down upon a grey floor at y = 0, whose right half a plate hides from the lamp far above.
    Room room;
    const uint32_t grey = room.material(matte({0.25, 0.5, 0.75}));
    add_floor(room, 0, 2, grey);
    room.add({0, 40, 9}, {9, 40, 9}, {9, 40, -9}, {0, 40, -9}, grey);
    room.light(LightKind::constant, {0, 80, 0}, {1, 1, 1});
    room.build();
    // 8 x 8 pixels see the floor and what is around it from a height of 6, at depths 1 / cosine to each other.
    room.scene.camera = {{0, 6, 0}, {-0.5, -1, -0.5}, {0.125, 0, 0}, {0, 0, 0.125}};
    room.scene.background = {0.5, 0.5, 0.5};
    Settings settings = small_settings(8);
    settings.samples = 4;
    const Layered made = render_layers(room.scene, settings);
    const Plane depth = made[Layer::depth], normal = made[Layer::normal], albedo = made[Layer::albedo],
                alpha = made[Layer::alpha], shadow = made[Layer::shadow], visits = made[Layer::node_visits];
    CHECK(!made.has(Layer::single));
    for (size_t y = 0; y < 8; ++y)
        for (size_t x = 0; x < 8; ++x) {
            const size_t i = 8 * y + x;
            const auto inside = [](size_t at) { return at >= 2 && at < 6; }; // the floor reaches to 2 / 6 of the depth
            CHECK(visits[i] >= 4);
            if (inside(x) && inside(y)) {
                CHECK(depth[i] == doctest::Approx(6).epsilon(1e-6));
                CHECK(normal[3 * i + 1] == doctest::Approx(1).epsilon(1e-6));
                CHECK(std::fabs(normal[3 * i]) + std::fabs(normal[3 * i + 2]) < 1e-6f);
                CHECK(albedo[3 * i] == 0.25f);
                CHECK(albedo[3 * i + 2] == 0.75f);
                CHECK(alpha[i] == 1);
                CHECK(shadow[i] == (x < 4 ? 0.0f : 1.0f));
            } else if (x == 0 || x == 7 || y == 0 || y == 7) {
                CHECK(std::isinf(depth[i]));
                CHECK(depth[i] > 0);
                for (size_t c = 0; c < 3; ++c) {
                    CHECK(normal[3 * i + c] == 0);
                    CHECK(albedo[3 * i + c] == 0);
                }
                CHECK(alpha[i] == 0);
                CHECK(shadow[i] == 0);
            } else { // an edge: the mean over all samples, but depths over those that hit
                CHECK(depth[i] == doctest::Approx(6).epsilon(1e-6));
                CHECK(albedo[3 * i] == doctest::Approx(0.25 * double{alpha[i]}).epsilon(1e-6));
                CHECK(normal[3 * i + 1] == doctest::Approx(double{alpha[i]}).epsilon(1e-6));
            }
        }
}

TEST_CASE(WISP_ARITH_NAME ": alpha is 1 less the smoke's transmittance, and smoke before a lamp is shadow") {
    Scenery air(false);
    Settings settings = settings_of(ways[3]);
    const Plane alpha = render_layers(air.scene, settings)[Layer::alpha];
    air.smokes[0].albedo = air.smokes[0].emission = {0, 0, 0};
    const Plane behind = render_in_memory(air.scene, settings).rgb; // background 0.25 0.5 0.125
    bool seen = false;
    for (size_t i = 0; i < alpha.size(); ++i) {
        CHECK(1 - double{alpha[i]} == doctest::Approx(double{behind[3 * i + 1]} / 0.5).epsilon(1e-6));
        seen = seen || (alpha[i] > 0.1f && alpha[i] < 0.9f);
    }
    CHECK(seen);

    // One lamp straight above, and one that the floor does not face: what arrives is e^-depth of what would.
    Scenery room;
    room.light(LightKind::parallel, {}, {9, 9, 9}, {0, 1, 0});
    room.scene.lights = room.lights.data() + 3; // `constant` at 0 8 0.5, and this one
    room.scene.light_count = 2;
    bool partly = false;
    for (const float part : render_layers(room.scene, settings)[Layer::shadow]) {
        CHECK(part >= 0);
        CHECK(part <= 1);
        partly = partly || (part > 0.05f && part < 0.95f);
    }
    CHECK(partly);
}

TEST_CASE(WISP_ARITH_NAME ": layers of a crop are part of the whole") {
    const Scenery room;
    for (const Way &way : {ways[0], ways[3], ways[5]}) {
        Settings settings = settings_of(way);
        const Layered whole = render_layers(room.scene, settings);
        settings.crop = {2, 1, 5, 6};
        const Layered crop = render_layers(room.scene, settings);
        CHECK(planes_of(crop.plan.layers) == planes_of(whole.plan.layers));
        for (size_t plane = 0; plane < planes_of(whole.plan.layers); ++plane)
            for (size_t y = 0; y < 5; ++y)
                CHECK(std::memcmp(&crop.planes[plane * crop.size + 3 * y],
                                  &whole.planes[plane * whole.size + pixels * (y + 1) + 2], 3 * sizeof(float)) == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME
          ": the reference has the layers of what is met first, and its samples are the same with them") {
    for (const bool surfaces : {false, true}) {
        const Scenery room(surfaces);
        Settings settings = settings_of(ways[0]);
        settings.step = 0.03125;
        const Layered marched = render_layers(room.scene, settings);
        settings.goal = Goal::reference;
        settings.last_pass = 3;
        const Layered made = render_layers(room.scene, settings);
        for (const Layer layer : summed) CHECK(!made.has(layer));
        for (const Layer layer : {Layer::albedo, Layer::normal, Layer::depth, Layer::node_visits}) {
            CHECK(made.has(layer) == surfaces);
            CHECK(same_bits(made[layer], marched[layer]));
        }
        CHECK(difference(made[Layer::alpha], marched[Layer::alpha]) < 1e-3); // there by steps
        std::vector<unsigned char> memory(renderer.plan(room.scene, settings).arena_bytes);
        Arena arena(memory.data(), memory.size());
        Statistics statistics;
        std::vector<PixelSums> sums(made.size);
        Job job = {room.scene, settings, arena, statistics};
        job.pixels = sums.data();
        REQUIRE(renderer.render(job) == Status::done);
        CHECK(std::memcmp(sums.data(), made.sums.data(), sums.size() * sizeof(PixelSums)) == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": without room for layers nothing is drawn, and without planes for them nothing is kept") {
    const Scenery room;
    Settings settings = settings_of(ways[3]);
    settings.layers = true;
    const Plan plan = renderer.plan(room.scene, settings);
    CHECK(plan[Stage::layers].needed);
    CHECK(plan[Stage::layers].bytes > 0);
    CHECK(same_bits(render_in_memory(room.scene, settings).rgb, render_layers(room.scene, settings).rgb));
    settings.layers = false;
    const Plan without = renderer.plan(room.scene, settings);
    CHECK(!without[Stage::layers].needed);
    CHECK(without.layers == 0);
    CHECK(without.arena_bytes + plan[Stage::layers].bytes == plan.arena_bytes);
}

} // namespace wisp::WISP_ARITH
