// Small smokes for tests, and core structures that own their memory.
#pragma once
#include "support/worst.h"
#include "wisp/wisp.h"
#include "core/photons/photon_map.h"
#include "wisp/settings.h"
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

namespace wisp::WISP_ARITH {

constexpr double pi_ = 3.14159265358979323846;

inline double at(Real x) { return to_double(x); }
inline Real real(double x) { return to_real<Real>(x); }
inline Vec3 vec(double x, double y, double z) { return Vec3(real(x), real(y), real(z)); }

// Relative error of one rounded operation; in fixed the resolution, relative to 1.
constexpr double unit_error = std::is_same_v<Real, double> ? 2.3e-16 : std::is_same_v<Real, float> ? 6e-8 : 2.4e-10;

// Uniform numbers in [0, 1) for test input, a fixed sequence.
struct Sequence {
    uint64_t state = 1;
    double operator()() {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return static_cast<double>(state >> 40) * 0x1p-24;
    }
};

inline void sort_canonically(std::vector<Particle> &particles) {
    std::sort(particles.begin(), particles.end(), [](const Particle &a, const Particle &b) {
        return std::make_tuple(a.position.x, a.position.y, a.position.z, a.h, a.area) <
               std::make_tuple(b.position.x, b.position.y, b.position.z, b.h, b.area);
    });
}

// `count` particles in a cube of half-width `extent`, all with the same h and cross-section. Coordinates have 24 bits,
// so that all arithmetics hold the same points.
inline std::vector<Particle> cloud(uint32_t count, double extent, double h, double area, uint64_t seed = 1) {
    Sequence next{seed};
    std::vector<Particle> particles(count);
    for (Particle &p : particles) {
        const double x = next(), y = next(), z = next();
        const auto coordinate = [&](double u) { return static_cast<double>(static_cast<float>((2 * u - 1) * extent)); };
        p = {{coordinate(x), coordinate(y), coordinate(z)}, h, area};
    }
    sort_canonically(particles);
    return particles;
}

// The same cloud with unlike smoothing lengths, 1 / 512 of h to h, and the same optical depth through each particle.
inline std::vector<Particle> unlike_cloud(uint32_t count, double extent, double h, double area) {
    std::vector<Particle> particles = cloud(count, extent, h, area);
    Sequence next{5};
    for (Particle &p : particles) {
        const double ratio = static_cast<double>(static_cast<float>(std::exp2(-9 * next())));
        p.h *= ratio;
        p.area *= ratio * ratio;
    }
    return particles;
}

inline SmokeDescription smoke_of(const std::vector<Particle> &particles, Kernel kernel = Kernel::spline) {
    SmokeDescription source = {};
    source.particles = particles.data();
    source.count = static_cast<uint32_t>(particles.size());
    source.kernel = kernel;
    source.smallest_h = source.largest_h = particles.empty() ? 1 : particles[0].h;
    for (const Particle &p : particles) {
        source.smallest_h = std::min(source.smallest_h, p.h);
        source.largest_h = std::max(source.largest_h, p.h);
        source.total_area += p.area;
    }
    source.albedo = {0.9, 0.9, 0.9};
    return source;
}

// The density of all particles in double, from the definition (S3).
inline double brute_density(const std::vector<Particle> &particles, Kernel kernel, double x, double y, double z) {
    double sum = 0;
    for (const Particle &p : particles) {
        const double dx = p.position.x - x, dy = p.position.y - y, dz = p.position.z - z;
        const double r = std::sqrt(dx * dx + dy * dy + dz * dz), h = p.h;
        if (r >= 2 * h) continue;
        if (kernel == Kernel::spline)
            sum += p.area * 15 / (pi_ * std::pow(4 * h, 3)) * std::pow(2 - r / h, 3);
        else
            sum += p.area * 315 / (64 * pi_ * std::pow(2 * h, 3)) * std::pow(1 - r * r / (4 * h * h), 3);
    }
    return sum;
}

struct BuiltField {
    explicit BuiltField(const SmokeDescription &source)
        : memory(particle_field_bytes(source.count)), arena(memory.data(), memory.size()),
          field(make_particle_field(source, 0, arena)) {}
    std::vector<unsigned char> memory;
    Arena arena;
    ParticleField field;
};

inline SmokeDescription grid_smoke_of(const GridDescription &grid) {
    SmokeDescription source = {};
    source.grid = grid;
    const Double3 &half = grid.half;
    source.smallest_h = source.largest_h = 2 * std::min({half.x / grid.nx, half.y / grid.ny, half.z / grid.nz});
    double sum = grid.density ? 0 : 1;
    for (uint64_t i = 0; grid.density && i < stored_samples(grid); ++i) sum += static_cast<double>(grid.density[i]);
    source.total_area = grid.extinction * sum * 8 * half.x * half.y * half.z / static_cast<double>(samples_of_box(grid));
    source.albedo = {0.9, 0.9, 0.9};
    return source;
}

struct BuiltGrid {
    explicit BuiltGrid(const GridDescription &source)
        : memory(grid_field_bytes(source)), arena(memory.data(), memory.size()),
          field(make_grid_field(source, 0, arena)) {}
    std::vector<unsigned char> memory;
    Arena arena;
    GridField field;
};

// The distance of optical depths from the exponential distribution, truncated at `whole`, from which they are drawn:
// the Kolmogorov-Smirnov statistic times the root of their number. It exceeds 1.95 by chance once in a thousand.
inline double distance_from_exponential(std::vector<double> depths, double whole) {
    std::sort(depths.begin(), depths.end());
    const double n = static_cast<double>(depths.size()), all = 1 - std::exp(-whole);
    double worst = 0;
    for (size_t i = 0; i < depths.size(); ++i)
        worst = worst_of(worst, std::fabs((1 - std::exp(-depths[i])) / all - (static_cast<double>(i) + 0.5) / n));
    return worst * std::sqrt(n);
}

struct BuiltMedium {
    explicit BuiltMedium(const std::vector<SmokeDescription> &sources_) : sources(sources_) {
        scene.smokes = sources.data();
        scene.smoke_count = static_cast<uint32_t>(sources.size());
        memory.resize(medium_bytes(scene, 0));
        Arena arena(memory.data(), memory.size());
        medium = make_medium(scene, 0, arena);
    }
    std::vector<SmokeDescription> sources;
    Scene scene = {};
    std::vector<unsigned char> memory;
    Medium medium;
};

// A camera that looks along -z from distance `far`, `width` units wide on the plane through the origin.
inline Camera look_at_origin(double far, double width, int pixels) {
    const double step = width / pixels / far;
    Camera camera;
    camera.origin = {0, 0, far};
    camera.right = {step, 0, 0};
    camera.down = {0, -step, 0};
    camera.corner = {-0.5 * width / far, 0.5 * width / far, -1};
    return camera;
}

// A scene of one smoke, seen by a camera at z = 12. It points to its arguments.
inline Scene scene_of(const SmokeDescription &smoke, const std::vector<LightSource> &lights) {
    Scene scene = {};
    scene.camera = look_at_origin(12, 8, 8);
    scene.smokes = &smoke;
    scene.smoke_count = 1;
    scene.lights = lights.data();
    scene.light_count = static_cast<uint32_t>(lights.size());
    return scene;
}

// A scene of one smoke, and the memory behind it.
struct LitSmoke {
    explicit LitSmoke(const std::vector<Particle> &particles_, Kernel kernel = Kernel::spline) : particles(particles_) {
        smoke = smoke_of(particles, kernel);
        scene.camera = look_at_origin(12, 8, 8);
        scene.background = {1, 0.5, 0.25};
        scene.smokes = &smoke;
        scene.smoke_count = 1;
    }
    void light(const LightSource &source) {
        lights.push_back(source);
        scene.lights = lights.data();
        scene.light_count = static_cast<uint32_t>(lights.size());
    }
    std::vector<Particle> particles;
    SmokeDescription smoke;
    std::vector<LightSource> lights;
    Scene scene = {};
};

// The photon map of a scene, as render() makes it.
struct BuiltPhotons {
    BuiltPhotons(const Scene &scene, const Settings &settings)
        : BuiltPhotons(scene, settings, plan_photons(scene, settings)) {}
    BuiltPhotons(const Scene &scene, const Settings &settings, const PhotonPlan &plan, const Observer &observer = {})
        : memory(medium_bytes(scene, 0) + plan.bytes), arena(memory.data(), memory.size()),
          medium(make_medium(scene, 0, arena)) {
        for (uint32_t i = 0; i < scene.light_count; ++i) lights.push_back(make_light(scene.lights[i]));
        Work work = {observer};
        maps = trace_photons({medium, nullptr, settings, plan, all_batches(settings), Watch(work), arena, statistics},
                             lights.data(), scene.light_count, plan.capacity);
    }
    std::vector<unsigned char> memory;
    Arena arena;
    Medium medium;
    std::vector<Light> lights;
    Statistics statistics;
    PhotonMaps maps;
};

inline bool adds_up(const Statistics::Photons &n) { return n.emitted == n.absorbed + n.escaped + n.blocked + n.capped; }

inline Settings small_settings(int pixels) {
    Settings settings = {};
    settings.crop = {0, 0, pixels, pixels};
    settings.samples = 1;
    settings.photons = 0;
    settings.seed = 1;
    settings.gather = 50;
    settings.gather_radius = 2;
    settings.step = 0.5;
    return settings;
}

// Adds the photons of some batches to the sums.
inline Status trace_batches(const Scene &scene, Settings settings, const Batches &batches, Arena &arena,
                            PhotonSums &sums, Statistics &statistics) {
    settings.goal = Goal::photons;
    Job job = {scene, settings, arena, statistics};
    job.photons = &sums;
    job.batches = batches;
    return renderer.render(job);
}

struct Rendered {
    Status status;
    Statistics statistics = {};
    std::vector<float> rgb;
};

// Renders in an arena; a cache keeps in it what lives from frame to frame. Where nothing is drawn, all stays -7.
inline Rendered render_in(Arena arena, const Scene &scene, const Settings &settings, FrameCache *cache = nullptr) {
    Rendered result;
    const Crop &crop = settings.crop;
    result.rgb.resize(static_cast<size_t>(crop.width() * crop.height() * 3), -7);
    result.status = renderer.render({scene, settings, arena, result.statistics, {}, result.rgb.data(), nullptr, cache});
    return result;
}
inline Rendered render_in_memory(const Scene &scene, const Settings &settings) {
    std::vector<unsigned char> memory(renderer.plan(scene, settings).arena_bytes);
    return render_in({memory.data(), memory.size()}, scene, settings);
}
inline bool is_untouched(const Rendered &picture) {
    return picture.status == Status::out_of_memory && picture.rgb == std::vector<float>(picture.rgb.size(), -7);
}

} // namespace wisp::WISP_ARITH
