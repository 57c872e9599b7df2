// Small rooms of triangles for tests, and rays through them.
#pragma once
#include "wisp/wisp.h"
#include "core/render/whitted.h"
#include "support/built_smoke.h"
#include <doctest/doctest.h>

namespace wisp::WISP_ARITH {

struct Room {
    Room() { scene.ray_epsilon = 1e-3; }

    uint32_t material(const Material &m) {
        materials.push_back(m);
        return static_cast<uint32_t>(materials.size() - 1);
    }
    // Flat, without texture.
    static Triangle triangle(const Double3 &a, const Double3 &b, const Double3 &c, uint32_t material) {
        return {{a, b, c}, {}, {}, material, -1};
    }
    void add(const Double3 &a, const Double3 &b, const Double3 &c, uint32_t material) {
        triangles.push_back(triangle(a, b, c, material));
    }
    // Counter-clockwise seen from its front.
    void add(const Double3 &a, const Double3 &b, const Double3 &c, const Double3 &d, uint32_t material) {
        add(a, b, c, material);
        add(a, c, d, material);
    }
    void light(LightKind kind, const Double3 &position, const Double3 &color, const Double3 &direction = {0, 0, -1}) {
        lights.push_back({kind, position, direction, 2, color});
    }
    // All triangles are static unless counts say otherwise.
    void build() {
        scene.triangles = triangles.data();
        if (scene.triangle_count() == 0) scene.static_count = static_cast<uint32_t>(triangles.size());
        REQUIRE(scene.triangle_count() == triangles.size());
        scene.materials = materials.data();
        scene.material_count = static_cast<uint32_t>(materials.size());
        scene.lights = lights.data();
        scene.light_count = static_cast<uint32_t>(lights.size());
        scene.instances = instances.data();
        scene.instance_count = static_cast<uint32_t>(instances.size());
        scene.textures = textures.data();
        scene.texture_count = static_cast<uint32_t>(textures.size());
        memory.resize(surface_bytes(scene, TreeKind::bvh) + placement_bytes(scene, TreeKind::bvh) +
                      Arena::bytes<SurfaceMaterial>(materials.size()) + Arena::bytes<Light>(lights.size()) +
                      ray_level_bytes(depth));
        Arena arena(memory.data(), memory.size());
        surfaces = make_surfaces(scene, TreeKind::bvh, arena);
        REQUIRE(surfaces.ready);
        place_surfaces(scene, arena, surfaces);
        REQUIRE(surfaces.ready);
        tracer = {&scene,
                  &surfaces,
                  make_surface_materials(scene, arena),
                  make_lights(scene, arena),
                  &shadows,
                  vec_of(scene.background),
                  depth,
                  real(spread),
                  &statistics,
                  arena.make<RayLevel>(depth + 1)};
        shadows = {&scene, &surfaces, tracer.lights, &statistics};
        REQUIRE(tracer.materials);
        REQUIRE(tracer.lights);
        REQUIRE(tracer.levels);
    }
    Color look(const Double3 &from, const Double3 &at) const {
        return trace(tracer, {vec_of(from), normalize(vec_of(at) - vec_of(from))});
    }

    Scene scene = {};
    std::vector<Material> materials;
    std::vector<Triangle> triangles;
    std::vector<Instance> instances;
    std::vector<LightSource> lights;
    std::vector<Texture> textures;
    uint32_t depth = 10;
    double spread = 0;
    std::vector<unsigned char> memory;
    Surfaces surfaces;
    Statistics statistics;
    Shadows shadows;
    Whitted tracer;
};

inline Material matte(const Double3 &color) { return {{0, 0, 0}, color, {0, 0, 0}, 1, 0, 1}; }
inline Material mirror(double strength) { return {{0, 0, 0}, {0, 0, 0}, {strength, strength, strength}, 1, 0, 1}; }
inline Material glass(double index) { return {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 1, 1, index}; }

// A floor at height y, of half-width `half`, its front upwards.
inline void add_floor(Room &room, double y, double half, uint32_t material) {
    room.add({-half, y, half}, {half, y, half}, {half, y, -half}, {-half, y, -half}, material);
}

} // namespace wisp::WISP_ARITH
