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
void gather_particles(const K &kernel, const ParticleField &field, const Color *source, const Ray &ray,
                      const Window &window) {
    const Real first_middle = window.middle[0], last_middle = window.middle[window.count - 1];
    for_each_leaf_on_segment(field, ray, first_middle, last_middle, [&](uint32_t leaf) {
        const uint32_t first = leaf * leaf_points;
        Real b_squared[leaf_points], along[leaf_points];
        for (uint32_t l = 0; l < leaf_points; ++l) {
            const Passage passed = passage(field, first + l, ray);
            b_squared[l] = passed.b_squared;
            along[l] = passed.along;
        }
        for (uint32_t l = 0; l < leaf_points; ++l) {
            if (!(b_squared[l] < kernel.support_squared)) continue;
            const uint32_t i = first + l;
            const Real h = field.inverse_h[i], scale = field.scale[i] * h;
            if (scale == Real(0)) continue;
            // The steps whose middles lie on the ray's chord through the support, and one more at each end for
            // rounding.
            const Real half = sqrt(kernel.support_squared - b_squared[l]) / h, middle = along[l];
            const int32_t low = max(floor_to_int((middle - half - window.start) * window.inverse_step), 0);
            const int32_t high =
                min(floor_to_int((middle + half - window.start) * window.inverse_step) + 1, window.count - 1);
            const Color color = source[i];
            for (int32_t step = low; step <= high; step += static_cast<int32_t>(lanes)) {
                const size_t at = static_cast<size_t>(step);
                for (size_t lane = 0; lane < lanes; ++lane) {
                    const Real t = (window.middle[at + lane] - middle) * h;
                    const Real w = scale * kernel.value(b_squared[l] + t * t);
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
    with_kernel(field.kernel, [&](const auto &kernel) { gather_particles(kernel, field, source, ray, window); });
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

namespace {

constexpr uint32_t units_of_window = 1 << 12; // of work
constexpr Real most_in_rim = Real(0.25) * max_step_depth;

// Steps of the same length, or equal parts of one step.
struct Stretch {
    Real begin;        // where the ray starts, for the record
    Real from, length; // along the ray
    Real step;         // the last step may be shorter
    int32_t steps;
    Real most; // a deeper step is divided
};

// Gathers the particles for `count` steps from step `first` on, and for the middle of the next or the stretch's end.
void gather_window(ParticleMarcher &marcher, const Ray &ray, const Stretch &stretch, int32_t first, int32_t count) {
    const Medium &medium = *marcher.medium;
    for (uint32_t i = 0; i < padded_steps; ++i) {
        const Real covered = Real(first + static_cast<int32_t>(i)) * stretch.step;
        marcher.middle[i] =
            stretch.from + covered + Real(0.5) * max(Real(0), min(stretch.step, stretch.length - covered));
        marcher.red[i] = marcher.green[i] = marcher.blue[i] = Real(0);
    }
    for (uint32_t s = 0; s < medium.count; ++s) {
        Real *sigma = marcher.sigma + size_t{s} * padded_steps;
        for (uint32_t i = 0; i < padded_steps; ++i) sigma[i] = Real(0);
        const Window window = {
            marcher.middle,         sigma,        marcher.red,
            marcher.green,          marcher.blue, stretch.from + Real(first) * stretch.step + Real(0.5) * stretch.step,
            Real(1) / stretch.step, count + 1};
        const DensityField &field = medium.smokes[s].field;
        if (field.is_grid())
            gather(field.grid, marcher.sources[s], ray, window);
        else
            gather(field.particles, marcher.sources[s], ray, window);
    }
    marcher.statistics->smoke.march_samples += static_cast<uint64_t>(count);
}

// sigma_t of all smoke in the middle of a step of the window.
Real gathered_extinction(const ParticleMarcher &marcher, int32_t step) {
    Real sum = Real(0);
    for (uint32_t s = 0; s < marcher.medium->count; ++s)
        sum += marcher.sigma[s * size_t{padded_steps} + static_cast<size_t>(step)];
    return sum;
}

// Adds step `at` of the window, of length dx at distance `from`, whose extinctions are in marcher.extinctions.
void add_step(ParticleMarcher &marcher, const Ray &ray, const Stretch &stretch, size_t at, Real from, Real dx,
              Real sigma, MarchProgress &so_far, PixelRecorder *recorder) {
    const Medium &medium = *marcher.medium;
    const int32_t number = so_far.number++;
    const Step step = make_step(ray, number, from, dx);
    const Color sent = Color(marcher.red[at], marcher.green[at], marcher.blue[at]);
    const Color single = single_scattering(medium, marcher.lights, step, -ray.direction, marcher.extinctions,
                                           *marcher.statistics, recorder);
    Color source = sent + single, multiple(Real(0));
    if (marcher.irradiance) {
        multiple = scattered_by_map(medium, marcher.lights, *marcher.irradiance, step, -ray.direction,
                                    marcher.extinctions, *marcher.statistics);
        source += multiple;
    }
    const Real s = sigma * dx;
    const Real weight = exp(-so_far.depth.value) * mean_transmittance(s) * dx;
    const Color arriving = source * weight;
    if (marcher.irradiance) so_far.again += all_channels(multiple) * weight;
    if (is_recording(recorder)) {
        const Color emission = emitted_radiance(medium, marcher.extinctions);
        if (!marcher.irradiance) multiple = max(sent - emission, Color(Real(0))); // the sources hold both
        recorder->step(*recorder, {number, stretch.begin + from + Real(0.5) * dx, dx, sigma, so_far.depth.value, single,
                                   multiple, emission, arriving});
    }
    so_far.radiance += arriving;
    so_far.depth.add(s);
}

// Adds the steps of a stretch. A step that is too deep is added in equal parts: a stretch of their own, after which the
// window is gathered anew.
void add_stretch(ParticleMarcher &marcher, const Ray &ray, const Stretch &stretch, MarchProgress &so_far,
                 PixelRecorder *recorder) {
    const auto begin_of = [&](int32_t step) { return stretch.from + Real(step) * stretch.step; };
    const auto length_of = [&](int32_t step) { return min(stretch.step, stretch.length - Real(step) * stretch.step); };
    const auto parts_of = [&](int32_t step) -> int32_t {
        if (!(stretch.most < any_depth)) return 1;
        const Real from = begin_of(step), dx = length_of(step);
        return max(max(parts_among_unlike(*marcher.medium, marcher.steps, ray, from, dx),
                       parts_between_nodes(*marcher.medium, ray, from, dx)),
                   parts_near_lights(marcher.lights, *marcher.medium, marcher.steps, ray, from, dx));
    };
    Real before = Real(0); // sigma_t in the middle of the step before
    for (int32_t first = 0; first < stretch.steps && !so_far.opaque() && marcher.watch.go_on(units_of_window);) {
        if (const int32_t parts = parts_of(first); parts > 1) {
            const Real from = begin_of(first), dx = length_of(first);
            add_stretch(marcher, ray, {stretch.begin, from, dx, dx / Real(parts), parts, stretch.most}, so_far,
                        recorder);
            ++first;
            continue;
        }
        int32_t count = 1;
        while (count < min(static_cast<int32_t>(window_steps), stretch.steps - first) && parts_of(first + count) == 1)
            ++count;
        gather_window(marcher, ray, stretch, first, count);
        int32_t next = first + count;
        for (int32_t i = 0; first + i < next && !so_far.opaque(); ++i) {
            if (!marcher.watch.go_on(1 + 128 * marcher.lights.light_count)) return;
            const Real from = begin_of(first + i), dx = length_of(first + i);
            if (!(dx > Real(0))) continue;
            const Real sigma = gathered_extinction(marcher, i), behind = gathered_extinction(marcher, i + 1);
            int32_t parts = parts_of_step(sigma * dx, stretch.most);
            Real most = any_depth;
            if (parts == 1 && stretch.most < any_depth && max(before, behind) * dx > Real(4) * stretch.most) {
                parts = 2; // the rim of what is like a solid: its middle tells little
                most = min(stretch.most, most_in_rim);
            }
            before = sigma;
            if (parts > 1) {
                add_stretch(marcher, ray, {stretch.begin, from, dx, dx / Real(parts), parts, most}, so_far, recorder);
                next = first + i + 1;
            } else if (sigma > Real(0)) {
                for (uint32_t s = 0; s < marcher.medium->count; ++s)
                    marcher.extinctions[s] = marcher.sigma[s * size_t{padded_steps} + static_cast<size_t>(i)];
                add_step(marcher, ray, stretch, static_cast<size_t>(i), from, dx, sigma, so_far, recorder);
            }
        }
        first = next;
    }
}

} // namespace

Segment march(ParticleMarcher &marcher, const Ray &ray, Real end, PixelRecorder *recorder) {
    const Medium &medium = *marcher.medium;
    Real begin = Real(0);
    if (medium.empty() || !clip(medium.bounds, ray, begin, end)) return empty_segment();

    const Ray inside = {ray.origin + ray.direction * begin, ray.direction};
    const Real length = end - begin, step = marcher.steps.longest;
    if (is_recording(recorder)) recorder->march(*recorder, begin, end, step, floor_to_int(length / step) + 1);
    const Real most = max_exact_step_depth(medium);
    MarchProgress so_far;
    for_each_part_between_faces(medium, inside, length, step, [&](Real from, Real part, int32_t steps) {
        add_stretch(marcher, inside, {begin, from, part, step, steps, most}, so_far, recorder);
        return !so_far.opaque();
    });
    return so_far.finish(marcher.irradiance, *marcher.statistics, recorder);
}

} // namespace wisp::WISP_ARITH
