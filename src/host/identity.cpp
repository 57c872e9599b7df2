#include "host/identity.h"
#include "host/sha256.h"
#include "host/version.h"

namespace wisp {

namespace {

// Numbers into a digest, value by value: structures have gaps.
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

void add(Digest &digest, const SmokeSource &smoke) {
    static_assert(sizeof(Particle) == 5 * sizeof(double), "particles are hashed as an array");
    digest.add(smoke.count, smoke.kernel, smoke.albedo, smoke.asymmetry, smoke.emission, smoke.total_area);
    if (smoke.count > 0) digest.add_array(smoke.particles, smoke.count * sizeof(Particle));
    const GridSource &grid = smoke.grid;
    digest.add(grid.nx, grid.ny, grid.nz, grid.extinction, grid.center, grid.half);
    for (const Double3 &axis : grid.axis) digest.add(axis);
    if (grid.density) digest.add_array(grid.density, grid.count() * sizeof(float));
}

void add_lights_and_smokes(Digest &digest, const Scene &scene) {
    for (uint32_t i = 0; i < scene.light_count; ++i) {
        const LightSource &light = scene.lights[i];
        digest.add(light.kind, light.position, light.direction, light.one_minus_cosine, light.color);
    }
    for (uint32_t i = 0; i < scene.smoke_count; ++i) add(digest, scene.smokes[i]);
}

void add(Digest &digest, const Double3 (&axes)[3]) {
    for (const Double3 &axis : axes) digest.add(axis);
}

// Where triangles are, what they are made of, and what is seen of them.
void add_surfaces(Digest &digest, const Scene &scene, bool looks) {
    digest.add(scene.still_count, scene.body_triangle_count, scene.morph_count, scene.body_count, scene.skin);
    for (uint32_t i = 0; i < scene.triangle_count(); ++i) {
        const Triangle &triangle = scene.triangles[i];
        add(digest, triangle.corner);
        digest.add(scene.materials[triangle.material].transmission > 0);
        if (!looks) continue;
        add(digest, triangle.normal);
        for (const auto &texel : triangle.texel) digest.add(texel[0], texel[1]);
        digest.add(triangle.material, triangle.texture);
    }
    for (uint32_t i = 0; i < scene.body_count; ++i) {
        const Body &body = scene.bodies[i];
        digest.add(body.first, body.count, body.visible, body.origin);
        if (!body.visible) continue;
        add(digest, body.axis);
        add(digest, body.inverse);
    }
    for (uint32_t i = 0; looks && i < scene.material_count; ++i) {
        const Material &m = scene.materials[i];
        digest.add(m.ambient, m.diffuse, m.specular, m.shininess, m.transmission, m.index);
    }
    for (uint32_t i = 0; looks && i < scene.texture_count; ++i) {
        const Texture &texture = scene.textures[i];
        digest.add(texture.width, texture.height);
        digest.add_array(texture.texels, size_t{3} * static_cast<size_t>(texture.width) *
                                             static_cast<size_t>(texture.height) * sizeof(uint16_t));
    }
}

} // namespace

std::string identity_of_map(const Scene &scene, const Settings &settings, const std::string &arithmetic) {
    Digest digest;
    digest.add(std::string(version), arithmetic, scene.radiance_exponent, scene.light_count, scene.smoke_count);
    add_lights_and_smokes(digest, scene);
    digest.add(settings.photons, settings.seed, settings.deposit, settings.direction, settings.density_step);
    if (settings.density_step > 0) digest.add(settings.light_step, settings.irradiance_step);
    if (scene.triangle_count() > 0) add_surfaces(digest, scene, false);
    return digest.finish();
}

std::string identity_of_samples(const Scene &scene, const Settings &settings, const std::string &arithmetic) {
    Digest digest;
    const Camera &camera = scene.camera;
    digest.add(std::string(version), arithmetic, camera.origin, camera.corner, camera.right, camera.down,
               scene.background, scene.radiance_exponent, scene.light_count, scene.smoke_count);
    add_lights_and_smokes(digest, scene);
    const Crop &crop = settings.crop;
    digest.add(crop.x0, crop.y0, crop.x1, crop.y1, settings.samples, settings.seed);
    if (scene.triangle_count() > 0) {
        add_surfaces(digest, scene, true);
        digest.add(settings.depth, settings.lights);
    }
    return digest.finish();
}

} // namespace wisp
