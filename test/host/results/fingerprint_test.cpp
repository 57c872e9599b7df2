// The names of a picture, of its samples, and of a particle map, change with everything that they depend on, and with
// nothing else.
#include "host/results/fingerprint.h"
#include "wisp/settings.h"
#include <doctest/doctest.h>
#include <functional>
#include <set>
#include <vector>

using namespace wisp;

namespace {

// A scene of particles, a grid, a box and triangles under two lights, and the memory behind it.
struct Whole {
    std::vector<Particle> particles = {{{1, 2, 3}, 0.5, 0.25}, {{2, 2, 3}, 0.75, 0.125}};
    std::vector<float> density = {0.5f, 1, 1.5f, 2};
    LightSource lights[2] = {{LightKind::spot, {1, 2, 3}, {0, 0, 1}, 0.5, {4, 5, 6}},
                             {LightKind::parallel, {0, 0, 0}, {0, 1, 0}, 2, {1, 1, 1}}};
    SmokeDescription smokes[3] = {};
    Triangle triangles[3] = {}; // still, of a body, of changing form
    Instance instance = {1, 1, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 2, 3}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, true};
    Material materials[2] = {};
    uint16_t texels[5 * 3] = {}; // 2 x 2 and 1
    Texture texture = {2, 2, 2, texels};
    Scene scene = {};
    Settings settings = {};
    std::string arithmetic = "f32";

    Whole() {
        scene.static_count = scene.instance_triangle_count = scene.deforming_count = scene.instance_count = 1;
        scene.material_count = 2;
        scene.texture_count = 1;
        for (SmokeDescription &smoke : smokes) {
            smoke.albedo = {0.5, 0.25, 0.125};
            smoke.asymmetry = 0.5;
            smoke.emission = {1, 2, 3};
            smoke.total_area = 7;
        }
        for (SmokeDescription *smoke : {&smokes[1], &smokes[2]})
            smoke->grid = {1, 1, 1, nullptr, 2, {1, 2, 3}, {4, 5, 6}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        smokes[1].grid.nx = smokes[1].grid.ny = 2;
        scene.camera = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}};
        scene.background = {1, 2, 3};
        scene.light_count = 2;
        scene.smoke_count = 3;
        scene.radiance_exponent = 4;
        settings.crop = {1, 2, 30, 40};
        settings.samples = 4;
        settings.seed = 5;
        settings.goal = Goal::reference;
        settings.last_pass = 16;
        settings.photons = 100;
        settings.gather = 50;
        settings.gather_radius = 2;
        settings.step = 0.5;
    }
    using Identity = std::string (*)(const Scene &, const Settings &, const std::string &);
    std::string name(Identity identity = fingerprint_of_samples) {
        smokes[0].particles = particles.data();
        smokes[0].count = static_cast<uint32_t>(particles.size());
        smokes[1].grid.density = density.data();
        scene.lights = lights;
        scene.smokes = smokes;
        scene.triangles = triangles;
        scene.instances = &instance;
        scene.materials = materials;
        scene.textures = &texture;
        return identity(scene, settings, arithmetic);
    }
};

std::string of_picture(const Scene &scene, const Settings &settings, const std::string &arithmetic) {
    return fingerprint_of_picture(scene, fingerprint_of_shapes(scene), settings, 30, 40, arithmetic);
}

using Change = std::function<void(Whole &)>;

std::string name_after(const Change &change, Whole::Identity identity = fingerprint_of_samples) {
    Whole whole;
    change(whole);
    return whole.name(identity);
}

void add_vector(std::vector<Change> &changes, const std::function<Double3 &(Whole &)> &vector) {
    changes.push_back([=](Whole &w) { vector(w).x += 0x1p-40; });
    changes.push_back([=](Whole &w) { vector(w).y += 0x1p-40; });
    changes.push_back([=](Whole &w) { vector(w).z += 0x1p-40; });
}

// Of the arithmetic, the smokes and the lights.
std::vector<Change> changes_of_contents() {
    std::vector<Change> changes = {
        [](Whole &w) { w.arithmetic = "f64"; },
        [](Whole &w) { w.scene.radiance_exponent += 1; },
        [](Whole &w) { w.scene.light_count = 1; },
        [](Whole &w) { w.scene.smoke_count = 2; },
        [](Whole &w) { w.lights[0].kind = LightKind::point; },
        [](Whole &w) { w.lights[0].one_minus_cosine += 0x1p-40; },
        [](Whole &w) { std::swap(w.lights[0], w.lights[1]); },
        [](Whole &w) { w.particles.pop_back(); },
        [](Whole &w) { w.particles[1].h += 0x1p-40; },
        [](Whole &w) { w.particles[1].area += 0x1p-40; },
        [](Whole &w) { w.smokes[0].kernel = Kernel::poly6; },
        [](Whole &w) { std::swap(w.smokes[0].albedo, w.smokes[2].emission); },
        [](Whole &w) { w.density[3] += 0x1p-20f; },
        [](Whole &w) { std::swap(w.density[0], w.density[3]); },
        [](Whole &w) { std::swap(w.smokes[1].grid.nx, w.smokes[1].grid.nz); },
        [](Whole &w) { std::swap(w.smokes[1].grid.ny, w.smokes[1].grid.nz); },
    };
    for (int i = 0; i < 3; ++i) {
        changes.push_back([=](Whole &w) { w.smokes[i].asymmetry += 0x1p-40; });
        changes.push_back([=](Whole &w) { w.smokes[i].total_area += 0x1p-40; });
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.smokes[i].albedo; });
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.smokes[i].emission; });
        if (i == 0) continue;
        changes.push_back([=](Whole &w) { w.smokes[i].grid.extinction += 0x1p-40; });
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.smokes[i].grid.center; });
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.smokes[i].grid.half; });
        for (int k = 0; k < 3; ++k)
            add_vector(changes, [=](Whole &w) -> Double3 & { return w.smokes[i].grid.axis[k]; });
    }
    for (int i = 0; i < 2; ++i) {
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.lights[i].position; });
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.lights[i].direction; });
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.lights[i].color; });
    }
    for (size_t i = 0; i < 2; ++i) add_vector(changes, [=](Whole &w) -> Double3 & { return w.particles[i].position; });
    return changes;
}

// Names before and after each change: all differ.
void check_changes(const std::vector<Change> &changes, Whole::Identity identity) {
    std::set<std::string> names = {Whole().name(identity)};
    for (size_t i = 0; i < changes.size(); ++i) {
        CAPTURE(i);
        CHECK(names.insert(name_after(changes[i], identity)).second);
    }
}

std::string of_map(const Scene &scene, const Settings &settings, const std::string &arithmetic) {
    return fingerprint_of_map(scene, settings, false, arithmetic);
}
std::string of_map_to_eye(const Scene &scene, const Settings &settings, const std::string &arithmetic) {
    return fingerprint_of_map(scene, settings, true, arithmetic);
}

} // namespace

TEST_CASE("identity: it is a SHA-256, the same for the same scene wherever that lies") {
    Whole a, b;
    CHECK(a.name() == b.name());
    CHECK(a.name().size() == 64);
    CHECK(a.name().find_first_not_of("0123456789abcdef") == std::string::npos);
}

TEST_CASE("identity: it changes with every number that samples depend on") {
    std::vector<Change> changes = changes_of_contents();
    const std::vector<Change> more = {
        [](Whole &w) { w.settings.crop.x0 += 1; }, [](Whole &w) { w.settings.crop.y0 += 1; },
        [](Whole &w) { w.settings.crop.x1 += 1; }, [](Whole &w) { w.settings.crop.y1 += 1; },
        [](Whole &w) { w.settings.samples += 1; }, [](Whole &w) { w.settings.seed += uint64_t{1} << 40; },
    };
    changes.insert(changes.end(), more.begin(), more.end());
    add_vector(changes, [](Whole &w) -> Double3 & { return w.scene.background; });
    for (Double3 Camera::*field : {&Camera::origin, &Camera::corner, &Camera::right, &Camera::down})
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.scene.camera.*field; });
    check_changes(changes, fingerprint_of_samples);
    CHECK(changes.size() > 100);
}

TEST_CASE("identity: passes, and what only photons and marching use, leave it alone") {
    const std::string name = Whole().name();
    CHECK(name_after([](Whole &w) { w.settings.first_pass = 3; }) == name);
    CHECK(name_after([](Whole &w) { w.settings.last_pass = 99; }) == name);
    CHECK(name_after([](Whole &w) { w.settings.photons = 1; }) == name);
    CHECK(name_after([](Whole &w) { w.settings.gather = 1; }) == name);
    CHECK(name_after([](Whole &w) { w.settings.gather_radius = 1; }) == name);
    CHECK(name_after([](Whole &w) { w.settings.step = 1; }) == name);
}

TEST_CASE("identity: that of a map changes with every number that photons depend on") {
    std::vector<Change> changes = changes_of_contents();
    changes.push_back([](Whole &w) { w.settings.seed += uint64_t{1} << 40; });
    changes.push_back([](Whole &w) { w.settings.photons += uint64_t{1} << 40; });
    changes.push_back([](Whole &w) { w.settings.deposit = Deposit::path; });
    check_changes(changes, of_map);
}

TEST_CASE("identity: that of kept smoke changes with smoke, lights and steps, and with nothing else") {
    std::vector<Change> changes = changes_of_contents();
    const std::vector<Change> more = {[](Whole &w) { w.smokes[0].smallest_h += 0x1p-40; },
                                      [](Whole &w) { w.smokes[2].largest_h += 0x1p-40; },
                                      [](Whole &w) { w.settings.method = Method::map; },
                                      [](Whole &w) { w.settings.density_step += 0x1p-40; },
                                      [](Whole &w) { w.settings.light_step += 0x1p-40; },
                                      [](Whole &w) { w.settings.irradiance = IrradianceMap::uniform; },
                                      [](Whole &w) { w.settings.irradiance_step += 0x1p-40; }};
    changes.insert(changes.end(), more.begin(), more.end());
    check_changes(changes, fingerprint_of_smoke);
    const std::string name = Whole().name(fingerprint_of_smoke);
    CHECK(name_after([](Whole &w) { w.scene.camera.origin.x += 1; }, fingerprint_of_smoke) == name);
    CHECK(name_after([](Whole &w) { w.instance.origin.x += 1; }, fingerprint_of_smoke) == name);
    CHECK(name_after([](Whole &w) { w.settings.photons += 1; }, fingerprint_of_smoke) == name);
}

TEST_CASE("identity: views, steps and pictures leave that of a map alone") {
    const std::string name = Whole().name(of_map);
    std::vector<Change> changes = {
        [](Whole &w) { w.settings.crop.x0 += 1; },     [](Whole &w) { w.settings.crop.y1 += 1; },
        [](Whole &w) { w.settings.samples += 1; },     [](Whole &w) { w.settings.step = 1; },
        [](Whole &w) { w.settings.gather = 1; },       [](Whole &w) { w.settings.gather_radius = 1; },
        [](Whole &w) { w.settings.light_step = 0.5; }, [](Whole &w) { w.settings.last_pass = 99; },
    };
    add_vector(changes, [](Whole &w) -> Double3 & { return w.scene.background; });
    for (Double3 Camera::*field : {&Camera::origin, &Camera::corner, &Camera::right, &Camera::down})
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.scene.camera.*field; });
    for (const Change &change : changes) CHECK(name_after(change, of_map) == name);
    std::vector<Change> places;
    add_vector(places, [](Whole &w) -> Double3 & { return w.scene.camera.origin; });
    check_changes(places, of_map_to_eye);
    CHECK(name != Whole().name());
}

TEST_CASE(
    "identity: with surfaces both change with where those are and whether light passes, samples with their looks") {
    std::vector<Change> places = {
        [](Whole &w) { w.materials[0].transmission = 0.5; }, [](Whole &w) { w.scene.ray_epsilon += 0x1p-40; },
        [](Whole &w) { w.scene.deforming_count = 0; }, [](Whole &w) { w.instance.visible = false; },
        [](Whole &w) { w.scene.instance_triangle_count = 2, w.scene.deforming_count = 0; }};
    for (size_t i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) add_vector(places, [=](Whole &w) -> Double3 & { return w.triangles[i].corner[k]; });
    add_vector(places, [](Whole &w) -> Double3 & { return w.instance.origin; });
    for (int k = 0; k < 3; ++k) add_vector(places, [=](Whole &w) -> Double3 & { return w.instance.axis[k]; });
    check_changes(places, of_map);
    check_changes(places, fingerprint_of_samples);

    std::vector<Change> looks = {
        [](Whole &w) { w.materials[0].index += 0x1p-40; }, [](Whole &w) { w.materials[0].shininess += 0x1p-40; },
        [](Whole &w) { w.settings.depth += 1; }, [](Whole &w) { w.settings.lights = LightChoice::cuts; }};
    for (Double3 Material::*field : {&Material::ambient, &Material::diffuse, &Material::specular})
        add_vector(looks, [=](Whole &w) -> Double3 & { return w.materials[0].*field; });
    add_vector(looks, [](Whole &w) -> Double3 & { return w.triangles[2].normal[1]; });
    const std::string map = Whole().name(of_map);
    for (const Change &change : looks) CHECK(name_after(change, of_map) == map);
    check_changes(looks, fingerprint_of_samples);
    // However shadows are found, they are the same.
    CHECK(name_after([](Whole &w) { w.settings.shadows = ShadowMethod::exact; }) == Whole().name());
}

TEST_CASE("identity: that of a picture changes with every number that a pixel may depend on, not with the crop") {
    std::vector<Change> changes = changes_of_contents();
    const std::vector<Change> more = {
        [](Whole &w) { w.settings.samples += 1; },
        [](Whole &w) { w.settings.depth += 1; },
        [](Whole &w) { w.settings.shadows = ShadowMethod::exact; },
        [](Whole &w) { w.settings.lights = LightChoice::cuts; },
        [](Whole &w) { w.settings.photons += uint64_t{1} << 40; },
        [](Whole &w) { w.settings.seed += uint64_t{1} << 40; },
        [](Whole &w) { w.settings.gather += 1; },
        [](Whole &w) { w.settings.gather_radius = 1; },
        [](Whole &w) { w.settings.step = 1; },
        [](Whole &w) { w.settings.deposit = Deposit::path; },
        [](Whole &w) { w.settings.direction = Direction::mean; },
        [](Whole &w) { w.settings.estimate = Estimate::knn; },
        [](Whole &w) { w.settings.density_step = 1; },
        [](Whole &w) { w.settings.light_step = 1; },
        [](Whole &w) { w.settings.irradiance = IrradianceMap::adaptive; },
        [](Whole &w) { w.settings.irradiance_step = 1; },
        [](Whole &w) { w.settings.method = Method::map; },
        [](Whole &w) { w.settings.goal = Goal::picture; },
        [](Whole &w) { w.settings.first_pass = 1; },
        [](Whole &w) { w.settings.last_pass += 1; },
        [](Whole &w) { w.scene.ray_epsilon = 1; },
        [](Whole &w) { w.scene.material_count = 1; },
        [](Whole &w) { w.scene.texture_count = 0; },
        [](Whole &w) { w.scene.instance_count = 0; },
        [](Whole &w) { w.scene.deforming_count = 0; },
        [](Whole &w) { w.texture.width = 1; },
        [](Whole &w) { w.texture.height = 1; },
        [](Whole &w) { w.texels[11] = 1; },
        [](Whole &w) { w.instance.first = 0; },
        [](Whole &w) { w.instance.count = 0; },
        [](Whole &w) { w.instance.visible = false; },
    };
    changes.insert(changes.end(), more.begin(), more.end());
    add_vector(changes, [](Whole &w) -> Double3 & { return w.scene.background; });
    add_vector(changes, [](Whole &w) -> Double3 & { return w.instance.origin; });
    for (Double3 Camera::*field : {&Camera::origin, &Camera::corner, &Camera::right, &Camera::down})
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.scene.camera.*field; });
    for (Double3 Material::*field : {&Material::ambient, &Material::diffuse, &Material::specular})
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.materials[1].*field; });
    for (double Material::*field : {&Material::shininess, &Material::transmission, &Material::index})
        changes.push_back([=](Whole &w) { w.materials[1].*field = 1; });
    for (int i = 0; i < 3; ++i) {
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.instance.axis[i]; });
        add_vector(changes, [=](Whole &w) -> Double3 & { return w.instance.inverse[i]; });
        for (int k = 0; k < 3; ++k) { // of the i-th triangle
            add_vector(changes, [=](Whole &w) -> Double3 & { return w.triangles[i].corner[k]; });
            add_vector(changes, [=](Whole &w) -> Double3 & { return w.triangles[i].normal[k]; });
            for (int u : {0, 1}) changes.push_back([=](Whole &w) { w.triangles[i].texel[k][u] = 0.5; });
        }
        changes.push_back([=](Whole &w) { w.triangles[i].material = 1; });
        changes.push_back([=](Whole &w) { w.triangles[i].texture = -1; });
    }
    check_changes(changes, of_picture);
    CHECK(name_after([](Whole &w) { w.settings.crop = {0, 0, 1, 1}; }, of_picture) == Whole().name(of_picture));
    CHECK(name_after([](Whole &w) { w.settings.check_shadows = true; }, of_picture) == Whole().name(of_picture));
    Whole whole;
    whole.name();
    std::set<std::string> sizes;
    for (int width : {30, 40})
        for (int height : {30, 40})
            sizes.insert(fingerprint_of_picture(whole.scene, "", whole.settings, width, height, "f32"));
    CHECK(sizes.size() == 4);
}
