// Triangles in memory, three frames out: what stands still is prepared once, and kept in a FrameCache.
//
//     c++ -std=c++17 triangles.cpp $(pkg-config --cflags --libs wisp) -o triangles
//     ./triangles frame_        frame_0.pfm, frame_1.pfm, frame_2.pfm
//
// The pictures are those of `wisp render triangles.aff`, bit for bit.
#include "example.h"
#include <cmath>
#include <string>
#include <vector>

namespace {

using wisp::Double3;

// With the normal of its plane, without a texture.
wisp::Triangle triangle(Double3 a, Double3 b, Double3 c, uint32_t material) {
    wisp::Triangle made = {};
    made.corner[0] = a, made.corner[1] = b, made.corner[2] = c;
    made.material = material;
    made.texture = -1;
    return made;
}

wisp::Material material(Double3 color, double diffuse, double mirror, double shininess) {
    const auto times = [&color](double x) { return Double3{color.x * x, color.y * x, color.z * x}; };
    return {times(0.3), times(diffuse), {mirror, mirror, mirror}, shininess, 0, 1}; // 0.3: the ambient light
}

} // namespace

int main(int count, char **words) {
    if (count != 2) return std::fputs("usage: triangles BEGINNING_OF_NAMES\n", stderr), 2;
    // The core wants what stands still to reach 1024 to 2048 from the origin: scale and move triangles of your own.
    const Double3 a = {-1024, 0, -1024}, b = {1024, 0, -1024}, c = {1024, 0, 1024}, d = {-1024, 0, 1024};
    const Double3 left = {-256, -128, -256}, right = {256, -128, -256}, front = {256, -128, 256}, top = {0, 128, 0};
    const std::vector<wisp::Triangle> triangles = {
        triangle(a, c, b, 0),          triangle(a, d, c, 0),                                          // the floor
        triangle(left, top, right, 1), triangle(right, top, front, 1), triangle(front, top, left, 1), // a roof, moving
    };
    const wisp::Material materials[] = {material({0.5, 0.5, 0.5}, 1, 0.3, 40), material({0.9, 0.3, 0.2}, 1, 0, 1)};
    wisp::Instance roof = {2, 3, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, true};
    wisp::LightSource lamp = {};
    lamp.kind = wisp::LightKind::constant;
    lamp.position = {1000, 3000, 2000};
    lamp.color = {0.8, 0.8, 0.7};
    constexpr int size = 129;
    wisp::Scene scene = {};
    scene.camera = camera_at({0, 512, 3000}, size);
    scene.background = {0.3, 0.4, 0.6};
    scene.lights = &lamp;
    scene.light_count = 1;
    scene.triangles = triangles.data();
    scene.static_count = 2;
    scene.instance_triangle_count = 3;
    scene.instances = &roof;
    scene.instance_count = 1;
    scene.materials = materials;
    scene.material_count = 2;
    scene.ray_epsilon = 2e-6 * std::sqrt(2.0 * 1024 * 1024);

    wisp::Settings settings = {};
    settings.crop = {0, 0, size, size};
    settings.samples = 4;
    settings.depth = 10;
    settings.shadows = wisp::ShadowMethod::exact;

    const wisp::Renderer &renderer = wisp::f32::renderer; // or f64, fixed
    std::vector<unsigned char> block;
    wisp::FrameCache cache = {};
    std::vector<float> picture(size_t{3} * size * size);
    const Double3 places[] = {{-512, 256, 0}, {0, 384, 0}, {512, 256, 0}};
    for (int frame = 0; frame < 3; ++frame) {
        roof.origin = places[frame];
        const wisp::Plan plan = renderer.plan(scene, settings);
        if (plan.arena_bytes > block.size()) {
            block.resize(static_cast<size_t>(plan.arena_bytes));
            cache = {}; // it was in the old block
        }
        wisp::Arena arena(block.data(), block.size());
        wisp::Statistics statistics;
        wisp::Job job = {scene, settings, arena, statistics};
        job.rgb = picture.data();
        job.cache = &cache;
        if (const wisp::Status status = renderer.render(job); status != wisp::Status::done)
            return std::fprintf(stderr, "not rendered: status %d\n", static_cast<int>(status)), 1;
        const std::string path = words[1] + std::to_string(frame) + ".pfm";
        if (!write_pfm(path.c_str(), picture.data(), size)) return std::perror(path.c_str()), 5;
        // Fewer from frame to frame: the cache keeps what was proved of shadows.
        std::fprintf(stderr, "%s: %llu nodes visited to prove shadows\n", path.c_str(),
                     static_cast<unsigned long long>(statistics.shadow.proofs.node_visits));
    }
    return 0;
}
