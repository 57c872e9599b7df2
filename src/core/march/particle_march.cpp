// Ray marching over a particle map (S4-3). The ray is marched in windows of 64 steps. Each particle is visited once a
// window, and adds to the steps that its kernel reaches.
//
// Leaves of the tree are visited in ascending order, so the order of each step's sum does not depend on the hardware's
// vector width.
#include "core/march/particle_march.h"

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t padded_steps = window_steps + lanes;

// `count` consecutive steps of the ray, with their sums over the particles visited so far.
struct Window {
    const Real *middle;               // of each step, as a distance on the ray
    Real *sigma, *red, *green, *blue; // extinction, and extinction times the particles' sources
    Real start, inverse_step;         // step i, if it has the full length, has its middle at start + i step
    int32_t count;
};

template <class K>
void gather_particles(const ParticleField &field, const Color *source, const Ray &ray, const Window &window) {
    const Real first_middle = window.middle[0], last_middle = window.middle[window.count - 1];
    for_each_leaf_on_segment(
        field.tree, ray.origin, ray.direction, first_middle, last_middle, field.support, [&](uint32_t leaf) {
            const uint32_t first = leaf * leaf_points;
            Real b_squared[leaf_points], along[leaf_points];
            for (uint32_t l = 0; l < leaf_points; ++l) {
                const Passage passed = passage(field, first + l, ray);
                b_squared[l] = passed.b_squared;
                along[l] = passed.along;
            }
            for (uint32_t l = 0; l < leaf_points; ++l) {
                if (!(b_squared[l] < K::support_squared)) continue;
                const uint32_t i = first + l;
                const Real h = field.inverse_h[i], scale = field.scale[i] * h;
                if (scale == Real(0)) continue;
                // The steps whose middles lie on the ray's chord through the support, and one more at each end for
                // rounding.
                const Real half = sqrt(K::support_squared - b_squared[l]) / h, middle = along[l];
                const int32_t low = max(floor_to_int((middle - half - window.start) * window.inverse_step), 0);
                const int32_t high =
                    min(floor_to_int((middle + half - window.start) * window.inverse_step) + 1, window.count - 1);
                const Color color = source[i];
                for (int32_t step = low; step <= high; step += static_cast<int32_t>(lanes)) {
                    const size_t at = static_cast<size_t>(step);
                    for (size_t lane = 0; lane < lanes; ++lane) {
                        const Real t = (window.middle[at + lane] - middle) * h;
                        const Real w = scale * K::value(b_squared[l] + t * t);
                        window.sigma[at + lane] += w;
                        window.red[at + lane] += w * color.x;
                        window.green[at + lane] += w * color.y;
                        window.blue[at + lane] += w * color.z;
                    }
                }
            }
        });
}

WISP_MULTIVERSIONED void gather(const ParticleField &field, const Color *source, const Ray &ray, const Window &window) {
    if (field.tree.count == 0) return;
    if (field.kernel == Kernel::spline)
        gather_particles<Spline>(field, source, ray, window);
    else
        gather_particles<Poly6>(field, source, ray, window);
}

void gather(const GridField &field, const Color *source, const Ray &ray, const Window &window) {
    for (int32_t i = 0; i < window.count; ++i) {
        Real sigma;
        const Color sum = radiated(field, ray.origin + ray.direction * window.middle[i], source, sigma);
        window.sigma[i] += sigma;
        window.red[i] += sum.x;
        window.green[i] += sum.y;
        window.blue[i] += sum.z;
    }
}

} // namespace

uint64_t window_bytes(const Scene &scene) {
    return 4 * Arena::bytes<Real>(padded_steps) + Arena::bytes<Real>(scene.smoke_count * uint64_t{padded_steps}) +
           Arena::bytes<Real>(scene.smoke_count);
}

bool make_window(const Scene &scene, Arena &arena, ParticleMarcher &marcher) {
    marcher.middle = arena.make<Real>(padded_steps);
    marcher.red = arena.make<Real>(padded_steps);
    marcher.green = arena.make<Real>(padded_steps);
    marcher.blue = arena.make<Real>(padded_steps);
    marcher.sigma = arena.make<Real>(scene.smoke_count * size_t{padded_steps});
    marcher.extinctions = arena.make<Real>(scene.smoke_count);
    return marcher.middle && marcher.red && marcher.green && marcher.blue && marcher.sigma && marcher.extinctions;
}

Segment march(ParticleMarcher &marcher, const Ray &ray, Real end, PixelRecorder *recorder) {
    const Medium &medium = *marcher.medium;
    Real begin = Real(0);
    if (medium.empty() || !clip(medium.bounds, ray, begin, end)) return empty_segment();

    const Ray inside = {ray.origin + ray.direction * begin, ray.direction};
    const Real length = end - begin, step = marcher.step, inverse_step = Real(1) / step;
    const int32_t steps = floor_to_int(length / step) + 1;
    if (is_recording(recorder)) recorder->march(*recorder, begin, end, step, steps);
    Color radiance(Real(0));
    Depth depth;
    for (int32_t first = 0; first < steps && depth.value < opaque_depth; first += window_steps) {
        const int32_t count = min(static_cast<int32_t>(window_steps), steps - first);
        for (uint32_t i = 0; i < padded_steps; ++i) {
            const Real from = Real(first + static_cast<int32_t>(i)) * step;
            marcher.middle[i] = from + Real(0.5) * max(Real(0), min(step, length - from));
            marcher.red[i] = marcher.green[i] = marcher.blue[i] = Real(0);
        }
        for (uint32_t s = 0; s < medium.count; ++s) {
            Real *sigma = marcher.sigma + size_t{s} * padded_steps;
            for (uint32_t i = 0; i < padded_steps; ++i) sigma[i] = Real(0);
            const Window window = {marcher.middle, sigma,        marcher.red,
                                   marcher.green,  marcher.blue, Real(first) * step + Real(0.5) * step,
                                   inverse_step,   count};
            const DensityField &field = medium.smokes[s].field;
            if (field.is_grid)
                gather(field.grid, marcher.sources[s], inside, window);
            else
                gather(field.particles, marcher.sources[s], inside, window);
        }
        marcher.statistics->smoke.march_samples += static_cast<uint64_t>(count);

        for (int32_t i = 0; i < count && depth.value < opaque_depth; ++i) {
            const size_t at = static_cast<size_t>(i);
            Real sigma = Real(0);
            for (uint32_t s = 0; s < medium.count; ++s) {
                marcher.extinctions[s] = marcher.sigma[s * size_t{padded_steps} + at];
                sigma += marcher.extinctions[s];
            }
            const Real from = Real(first + i) * step, dx = min(step, length - from);
            if (!(sigma > Real(0)) || !(dx > Real(0))) continue;
            const Step step_here = make_step(inside, first + i, from, dx);
            const Color sent = Color(marcher.red[at], marcher.green[at], marcher.blue[at]);
            const Color single = single_scattering(medium, marcher.lights, step_here, -ray.direction,
                                                   marcher.extinctions, *marcher.statistics, recorder);
            Color source = sent + single, multiple(Real(0));
            if (marcher.irradiance) {
                multiple =
                    scattered_light(*marcher.irradiance, medium, step_here.middle, -ray.direction, marcher.extinctions);
                source += multiple;
            }
            const Real s = sigma * dx;
            const Color arriving = source * (exp(-depth.value) * mean_transmittance(s) * dx);
            if (is_recording(recorder)) {
                const Color emission = emitted_radiance(medium, marcher.extinctions);
                if (!marcher.irradiance) multiple = max(sent - emission, Color(Real(0))); // the sources hold both
                recorder->step(*recorder, {first + i, begin + from + Real(0.5) * dx, dx, sigma, depth.value, single,
                                           multiple, emission, arriving});
            }
            radiance += arriving;
            depth.add(s);
        }
    }
    const Segment seen = {radiance, exp(-depth.value)};
    if (is_recording(recorder)) recorder->march_end(*recorder, seen.radiance, depth.value, seen.transmittance);
    return seen;
}

} // namespace wisp::WISP_ARITH
