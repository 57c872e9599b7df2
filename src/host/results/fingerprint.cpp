#include "core/render/kept_at_nodes.h"
#include "core/smoke/grid_samples.h"
#include "host/base/sha256.h"
#include "host/base/version.h"
#include "host/results/fingerprint.h"
#include "wisp/settings.h"

namespace wisp {

namespace {

// Hashes numbers value by value, because the padding of structures has no certain value.
class Digest {
  public:
    template <class... Numbers> void add(const Numbers &...numbers) { (add_one(numbers), ...); }
    void add_array(const void *data, size_t size) { sha_.update(data, size); }
    std::string finish() { return sha_.finish().text; }

  private:
    void add_one(const std::string &text) { sha_.update(text.c_str(), text.size() + 1); }
    void add_one(const Double3 &v) { add(v.x, v.y, v.z); }
    template <class Number> void add_one(const Number &number) { sha_.update(&number, sizeof number); }

    Sha256 sha_;
};

void add(Digest &digest, const SmokeDescription &smoke) {
    static_assert(sizeof(Particle) == 5 * sizeof(double), "particles are hashed as an array");
    digest.add(smoke.count, smoke.kernel, smoke.albedo, smoke.asymmetry, smoke.emission, smoke.total_area);
    if (smoke.count > 0) digest.add_array(smoke.particles, smoke.count * sizeof(Particle));
    const GridDescription &grid = smoke.grid;
    digest.add(grid.nx, grid.ny, grid.nz, grid.extinction, grid.center, grid.half);
    for (const Double3 &axis : grid.axis) digest.add(axis);
    if (grid.density) digest.add_array(grid.density, stored_samples(grid) * sizeof(float));
    if (!grid.blocks) return;
    digest.add_array(grid.blocks, block_places(grid) * sizeof(uint32_t));
    digest.add_array(grid.skipped, sizeof grid.skipped);
}

void add_lights_and_smokes(Digest &digest, const Scene &scene) {
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        const LightSource &light = scene.lights[i];
        digest.add(light.kind, light.position, light.direction, light.one_minus_cosine, light.color);
    }
    for (uint32_t i = 0; i < scene.smoke_count; ++i) add(digest, scene.smokes[i]);
}

void add_triangles(Digest &digest, const Scene &scene, uint32_t first, uint32_t count) {
    static_assert(sizeof(Triangle) == 24 * sizeof(double) + 2 * sizeof(uint32_t), "triangles are hashed as an array");
    if (count > 0) digest.add_array(scene.triangles + first, count * sizeof(Triangle));
}

void add_instances(Digest &digest, const Scene &scene) {
    digest.add(scene.instance_count, scene.deforming_count, scene.ray_epsilon);
    for (uint32_t i = 0; i < scene.instance_count; ++i) {
        const Instance &instance = scene.instances[i];
        digest.add(instance.first, instance.count, instance.origin, instance.visible);
        for (int k = 0; k < 3; ++k) digest.add(instance.axis[k], instance.inverse[k]);
    }
}

// What photons depend on of surfaces: where triangles are, and whether they let light through.
void add_walls(Digest &digest, const Scene &scene) {
    digest.add(scene.static_count, scene.instance_triangle_count);
    for (uint32_t i = 0; i < scene.triangle_count(); ++i) {
        const Triangle &triangle = scene.triangles[i];
        for (const Double3 &corner : triangle.corner) digest.add(corner);
        digest.add(scene.materials[triangle.material].transmission > 0);
    }
    add_instances(digest, scene);
}

// Where instances are, and deforming triangles. The rest is in fingerprint_of_shapes().
void add_moving(Digest &digest, const Scene &scene) {
    add_instances(digest, scene);
    add_triangles(digest, scene, scene.static_count + scene.instance_triangle_count, scene.deforming_count);
}

} // namespace

std::string fingerprint_of_smoke(const Scene &scene, const Settings &settings, const std::string &arithmetic) {
    Digest digest;
    digest.add(std::string(version), arithmetic, scene.radiance_exponent, scene.light_count, scene.smoke_count);
    add_lights_and_smokes(digest, scene);
    for (uint32_t i = 0; i < scene.smoke_count; ++i) digest.add(scene.smokes[i].smallest_h, scene.smokes[i].largest_h);
    digest.add(settings.method, settings.paths, settings.density_step, settings.light_step, settings.irradiance,
               settings.irradiance_step);
    return digest.finish();
}

std::string fingerprint_of_map(const Scene &scene, const Settings &settings, bool to_eye,
                               const std::string &arithmetic) {
    Digest digest;
    digest.add(std::string(version), arithmetic, scene.radiance_exponent, scene.light_count, scene.smoke_count);
    add_lights_and_smokes(digest, scene);
    digest.add(settings.photons, settings.seed, settings.deposit, settings.direction, settings.density_step);
    if (keeps_light_at_nodes(scene, settings)) digest.add(settings.light_step, settings.irradiance_step);
    if (scene.triangle_count() > 0) add_walls(digest, scene);
    if (to_eye) digest.add(scene.camera.origin);
    return digest.finish();
}

std::string fingerprint_of_samples(const Scene &scene, const Settings &settings, const std::string &arithmetic) {
    Digest digest;
    const Camera &camera = scene.camera;
    digest.add(std::string(version), arithmetic, camera.origin, camera.corner, camera.right, camera.down,
               scene.background, scene.radiance_exponent, scene.light_count, scene.smoke_count);
    add_lights_and_smokes(digest, scene);
    const Crop &crop = settings.crop;
    digest.add(crop.x0, crop.y0, crop.x1, crop.y1, settings.samples, settings.seed);
    if (scene.triangle_count() > 0) {
        digest.add(fingerprint_of_shapes(scene), settings.depth, settings.lights);
        add_moving(digest, scene);
    }
    return digest.finish();
}

std::string fingerprint_of_shapes(const Scene &scene) {
    static_assert(sizeof(Material) == 12 * sizeof(double), "materials are hashed as an array");
    Digest digest;
    digest.add(scene.static_count, scene.instance_triangle_count, scene.material_count, scene.texture_count);
    add_triangles(digest, scene, 0, scene.static_count + scene.instance_triangle_count);
    if (scene.material_count > 0) digest.add_array(scene.materials, scene.material_count * sizeof(Material));
    for (uint32_t i = 0; i < scene.texture_count; ++i) { // the other levels are averages of the first
        const Texture &texture = scene.textures[i];
        digest.add(texture.width, texture.height);
        const size_t texels = static_cast<size_t>(texture.width) * static_cast<size_t>(texture.height);
        digest.add_array(texture.texels, texels * 3 * sizeof(uint16_t));
    }
    return digest.finish();
}

std::string fingerprint_of_picture(const Scene &scene, const std::string &shapes, const Settings &settings, int width,
                                   int height, const std::string &arithmetic) {
    Digest digest;
    const Camera &camera = scene.camera;
    digest.add(std::string(version), arithmetic, width, height, camera.origin, camera.corner, camera.right, camera.down,
               scene.background, scene.radiance_exponent, scene.light_count, scene.smoke_count);
    add_lights_and_smokes(digest, scene);
    digest.add(shapes);
    add_moving(digest, scene);
    const Settings &s = settings;
    digest.add(s.samples, s.depth, s.shadows, s.photons, s.seed, s.gather, s.gather_radius, s.step, s.deposit,
               s.direction, s.estimate, s.density_step, s.light_step, s.irradiance, s.irradiance_step, s.method,
               s.paths, s.lights, s.goal == Goal::reference);
    if (s.goal == Goal::reference) digest.add(s.first_pass, s.last_pass);
    if (s.layers) digest.add(s.layers); // an .exr has them in it
    return digest.finish();
}

} // namespace wisp
