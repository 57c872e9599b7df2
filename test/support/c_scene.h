// A scene for the C interface with its arrays: particles, a grid, triangles that stand, move and deform, two lights.
#pragma once
#include "wisp/c_api.h"
#include <string>
#include <vector>

namespace wisp {

struct CScene {
    // x y z of 40 particles in a cube about 0 1 0, as 32-bit numbers.
    std::vector<float> positions = [] {
        std::vector<float> made;
        uint32_t state = 9;
        for (int i = 0; i < 120; ++i) {
            state = state * 1664525u + 1013904223u;
            made.push_back(static_cast<float>(state >> 8) * 0x1p-24f - 0.5f + (i % 3 == 1 ? 1 : 0));
        }
        return made;
    }();
    std::vector<float> density = {0.25f, 0.5f, 1, 3, 0, 0.125f, 2, 1}; // 2 x 2 x 2
    std::vector<double> ground = {-3, 0, 3, 3, 0, 3, 3, 0, -3, -3, 0, -3};
    std::vector<uint32_t> halves = {0, 1, 2, 0, 2, 3};
    std::vector<double> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0.5}, folding = {0, 0, 1, 1, 0, 1, 0, 0.5, 1};
    std::vector<double> upward = {0, 1, 0, 0, 2, 0, 0.5, 1, 0}, forward = {0, 0, 1, 0, 0, 1, 0, 0, 1};
    wisp_light lights[2] = {};
    wisp_smoke smokes[1] = {};
    wisp_mesh meshes[3] = {};
    wisp_material materials[2] = {};
    wisp_scene scene = {};

    CScene() {
        scene.version = WISP_C_API_VERSION;
        scene.width = 12;
        scene.height = 9;
        scene.camera = {{0, 2, 9}, {0, 1, 0}, {0, 1, 0}, 40};
        for (int k = 0; k < 3; ++k) scene.background[k] = 0.25, scene.ambient[k] = 0.5;
        lights[0].kind = WISP_POINT;
        set(lights[0].position, 3, 4, 5), set(lights[0].color, 30, 20, 10);
        lights[1].kind = WISP_PARALLEL;
        set(lights[1].direction, 1, -2, 0), set(lights[1].color, 1, 2, 3);
        scene.lights = lights;
        scene.light_count = 2;
        for (wisp_smoke &smoke : smokes) {
            smoke.extinction = 0.02;
            set(smoke.albedo, 0.9, 0.8, 0.7);
            smoke.phase = 0.25;
        }
        smokes[0].positions.data = positions.data();
        smokes[0].count = 40;
        smokes[0].radius = 0.2;
        smokes[0].mass = 1;
        scene.smokes = smokes;
        scene.smoke_count = 1;
        for (wisp_mesh &mesh : meshes) mesh.positions.number = mesh.normals.number = WISP_FLOAT64;
        meshes[0].positions.data = ground.data();
        meshes[0].vertex_count = 4;
        meshes[0].indices = halves.data();
        meshes[0].triangle_count = 2;
        meshes[1].positions.data = corners.data();
        meshes[1].normals.data = upward.data();
        meshes[1].motion = WISP_MOVING;
        meshes[1].transform[0] = meshes[1].transform[4] = meshes[1].transform[8] = 0.5; // a scale, then a way
        meshes[1].transform[9] = -1, meshes[1].transform[10] = 0.25, meshes[1].transform[11] = 1;
        meshes[2].positions.data = folding.data();
        meshes[2].normals.data = forward.data();
        meshes[2].motion = WISP_DEFORMING;
        for (int i : {1, 2}) meshes[i].vertex_count = 3, meshes[i].triangle_count = 1, meshes[i].material = 1;
        scene.meshes = meshes;
        scene.mesh_count = 3;
        for (wisp_material &m : materials) {
            set(m.ambient, 0.5, 0.25, 0.125), set(m.diffuse, 0.5, 0.25, 0.125);
            m.shininess = 10;
        }
        set(materials[1].specular, 0.25, 0.25, 0.25);
        scene.materials = materials;
        scene.material_count = 2;
    }
    CScene(const CScene &) = delete; // it points into itself

    // The same scene as text, whose smoke is in the file `particles`.
    static std::string text(const std::string &particles) {
        return "v from 0 2 9 at 0 1 0 up 0 1 0 angle 40 hither 1 resolution 12 9\nb 0.25 0.25 0.25\nam 0.5 0.5 0.5\n"
               "lp 3 4 5  30 20 10\nld 1 -2 0  1 2 3\n"
               "smoke " +
               particles +
               " {\n  radius 0.2\n  mass 1\n  extinction 0.02\n  albedo 0.9 0.8 0.7\n  phase 0.25\n}\n"
               "fm 0.5 0.25 0.125  0.5 0.25 0.125  0 0 0  10 0 0\n"
               "m vertices 4  -3 0 3  3 0 3  3 0 -3  -3 0 -3\n  triangles 2  0 1 2  0 2 3\n"
               "fm 0.5 0.25 0.125  0.5 0.25 0.125  0.25 0.25 0.25  10 0 0\n"
               "x a { m vertices 3  0 0 0  1 0 0  0 1 0.5  normals 3  0 1 0  0 2 0  0.5 1 0  triangles 1  0 1 2 0 1 2 "
               "}\n"
               "k a { transl 4  0 -1 0.25 1 0 0 0  0 -1 0.25 1 0 0 0  1 -1 0.25 1 0 0 0  1 -1 0.25 1 0 0 0\n"
               "  scale 4  0 0.5 0.5 0.5 0 0 0  0 0.5 0.5 0.5 0 0 0  1 0.5 0.5 0.5 0 0 0  1 0.5 0.5 0.5 0 0 0 }\n"
               "tpa 1 0  0 0 1 0 0 1  1 0 1 0 0 1  0 0.5 1 0 0 1\n";
    }

    static void set(double (&v)[3], double x, double y, double z) { v[0] = x, v[1] = y, v[2] = z; }
};

// A frame and its memory.
struct CFrame {
    std::vector<unsigned char> memory;
    wisp_frame *frame = nullptr;
    wisp_error error = {};
    wisp_status status;

    explicit CFrame(const wisp_scene &scene) : memory(wisp_prepared_bytes(&scene)) {
        status = wisp_prepare(&scene, memory.data(), memory.size(), &frame, &error);
    }
};

// A picture of a frame, of few photons.
struct CPicture {
    wisp_settings settings = wisp_default_settings();
    wisp_job job = {};
    wisp_plan plan = {};
    wisp_error error = {};
    wisp_statistics statistics = {};
    std::vector<unsigned char> memory;
    std::vector<float> rgb, layers;

    CPicture() { settings.photons = 2000; }
    wisp_status render(const wisp_frame *frame) {
        const wisp_status status = wisp_plan_frame(frame, &settings, &plan, &error);
        if (status != WISP_DONE) return status;
        if (memory.size() < plan.bytes) memory.resize(static_cast<size_t>(plan.bytes));
        const size_t pixels = size_t{plan.width} * plan.height;
        rgb.assign(3 * pixels, -1);
        layers.assign(plan.plane_count * pixels, -1);
        job.memory = memory.data();
        job.memory_bytes = memory.size();
        job.rgb = rgb.data();
        job.layers = settings.layers ? layers.data() : nullptr;
        job.statistics = &statistics;
        return wisp_render(frame, &settings, &job, &error);
    }
    uint64_t counter(const std::string &group, const std::string &name) const {
        for (uint32_t i = 0; i < statistics.count; ++i)
            if (statistics.counters[i].group == group && statistics.counters[i].name == name)
                return statistics.counters[i].value;
        return UINT64_MAX;
    }
};

} // namespace wisp
