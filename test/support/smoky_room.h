// Smoke among surfaces of every kind, and the ways to render it.
#pragma once
#include "support/built_surfaces.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {

constexpr int pixels = 6;
constexpr double plate_height = 2.5, plate_half = 1.2;

// Smoke between a mirroring floor and a plate, beside a pane of glass, under lights of every kind.
struct Scenery : Room {
    explicit Scenery(bool surfaces_ = true, bool glows = true) : particles(cloud(150, 1.2, 0.5, 0.1)) {
        const uint32_t floor = material({{0.1, 0.1, 0.1}, {0.6, 0.5, 0.4}, {0.3, 0.3, 0.3}, 8, 0, 1}),
                       single_channel = material(matte({0.5, 0.5, 0.5})),
                       pane = material({{0, 0, 0}, {0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}, 20, 0.7, 1.5});
        scene.background = {0.25, 0.5, 0.125};
        if (surfaces_) {
            add_floor(*this, -2, 9, floor);
            add_floor(*this, plate_height, plate_half, single_channel);
            add({-1.5, -2, 2}, {1.5, -2, 2}, {1.5, 1, 2}, {-1.5, 1, 2}, pane);
        }
        light(LightKind::point, {1, 5, 1}, {20, 20, 15});
        light(LightKind::spot, {-3, 6, 0}, {30, 20, 40}, Double3{0.447213595499958, -0.894427190999916, 0});
        lights.back().one_minus_cosine = 0.2;
        light(LightKind::parallel, {}, {0.5, 0.25, 0.75}, {0, -0.8, -0.6});
        light(LightKind::constant, {0, 8, 0.5}, {0.25, 0.5, 0.5});
        build();
        smokes = {smoke_of(particles)};
        smokes[0].asymmetry = 0.3;
        if (glows) smokes[0].emission = {0.5, 0.25, 0.125};
        scene.smokes = smokes.data();
        scene.smoke_count = 1;
        const double step = 1.0 / pixels;
        scene.camera = {{0.3, 0.6, 7}, {-0.5, 0.45, -1}, {step, 0, 0}, {0, -step, 0}};
    }
    std::vector<Particle> particles;
    std::vector<SmokeDescription> smokes;
};

struct Way {
    Method method;
    bool resampled;
    IrradianceMap irradiance;
    Estimate estimate = Estimate::kernel;
};
constexpr Way ways[] = {
    {Method::direct, false, IrradianceMap::none},    {Method::direct, false, IrradianceMap::uniform},
    {Method::volume, true, IrradianceMap::adaptive}, {Method::map, true, IrradianceMap::uniform},
    {Method::map, true, IrradianceMap::adaptive},    {Method::map, false, IrradianceMap::none},
    {Method::map, false, IrradianceMap::uniform},    {Method::map, false, IrradianceMap::none, Estimate::knn}};

inline Settings settings_of(const Way &way, ShadowMethod shadows = ShadowMethod::exact, uint32_t samples = 2) {
    Settings settings = small_settings(pixels);
    settings.samples = samples;
    settings.photons = 1000;
    settings.depth = 4;
    settings.shadows = shadows;
    settings.method = way.method;
    settings.irradiance = way.irradiance;
    settings.estimate = way.estimate;
    settings.irradiance_step = 1;
    if (way.resampled) settings.density_step = settings.light_step = 1;
    return settings;
}

} // namespace wisp::WISP_ARITH
