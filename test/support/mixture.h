// A scene of all kinds of smoke at once.
#pragma once
#include "support/built_smoke.h"

namespace wisp::WISP_ARITH {

// Two overlapping smokes with different kernels and sizes, and a rotated grid; two lights, one inside the smoke.
struct Mixture {
    Mixture() : big(cloud(150, 2.5, 1.5, 0.6, 3)), small(cloud(300, 2, 1, 0.25, 4)), density(4 * 3 * 5) {
        Sequence next{11};
        for (float &d : density) d = static_cast<float>(next());
        GridDescription grid = {4, 3, 5, density.data(), 0.4, {1, 0.5, 0}, {2, 1.5, 2.5}, {}};
        grid.axis[0] = {0.6, 0, -0.8};
        grid.axis[1] = {0, 1, 0};
        grid.axis[2] = {0.8, 0, 0.6};
        smokes = {smoke_of(big, Kernel::poly6), smoke_of(small), grid_smoke_of(grid)};
        smokes[0].albedo = {0.9, 0.5, 0.2};
        smokes[1].asymmetry = 0.5;
        smokes[2].emission = {0.1, 0.2, 0};
        lights = {{LightKind::point, {0.5, 0.25, 0.5}, {0, 0, 1}, 2, {4, 5, 6}},
                  {LightKind::parallel, {}, {-0.6, -0.8, 0}, 2, {3, 2, 1}}};
        scene.camera = look_at_origin(12, 8, 6);
        scene.background = {0.5, 0.25, 0.125};
        scene.lights = lights.data();
        scene.light_count = 2;
        scene.smokes = smokes.data();
        scene.smoke_count = 3;
    }
    std::vector<Particle> big, small;
    std::vector<float> density;
    std::vector<SmokeDescription> smokes;
    std::vector<LightSource> lights;
    Scene scene = {};
};

} // namespace wisp::WISP_ARITH
