// Photons through exact smoke, and their deposits at nodes (S2, S4-3).
#include "core/photons/exact_fluence.h"
#include "core/lights/forward_peak.h"

namespace wisp::WISP_ARITH {

namespace {

// What smoke scatters towards the eye.
struct TowardsEye {
    const Medium &medium;
    Vec3 eye;
    int32_t shift; // 4 pi times the phase function is scaled by 2^shift, to at most 1

    TowardsEye(const Medium &of, const Vec3 &of_camera) : medium(of), eye(of_camera), shift(0) {
        for (uint32_t i = 0; i < medium.count; ++i) {
            const Real largest = ForwardPeak(medium.smokes[i].phase).largest * four_pi<Real>;
            while (scale_pow2(largest, shift) > Real(1)) --shift;
        }
    }
    // Of a photon that collides with a smoke.
    Color operator()(uint32_t smoke, const Ray &arrived) const {
        const Vec3 &x = arrived.origin, out = direction_between(x, eye);
        const Real unit = scale_pow2(four_pi<Real>, shift);
        const Real of_smoke = medium.smokes[smoke].phase(arrived.direction, out) * unit;
        if (medium.count == 1) return Color(of_smoke);
        Color scattered(Real(0)), to_eye(Real(0));
        for (uint32_t i = 0; i < medium.count; ++i) {
            const Color sigma_s = medium.smokes[i].albedo * extinction(medium.smokes[i].field, x);
            scattered += sigma_s;
            to_eye += sigma_s * (medium.smokes[i].phase(arrived.direction, out) * unit);
        }
        for (int32_t c = 0; c < 3; ++c)
            to_eye[c] = scattered[c] > Real(0) ? min(to_eye[c] / scattered[c], Real(1)) : of_smoke;
        return to_eye;
    }
};

} // namespace

uint64_t exact_fluence_bytes(const Scene &scene, const PhotonNeeds &needs, uint64_t bricks, int32_t spacing) {
    return Arena::bytes<int64_t>(sums_of_fluence(needs, bricks, spacing)) + emitter_bytes(scene) + batch_bytes;
}

Status trace_exact_fluence(const PhotonTracing &tracing, const SparseGrid &bricks, int32_t spacing, const Light *lights,
                           uint32_t light_count, PhotonSums &sums, FluenceSums &fluence) {
    const Medium &medium = tracing.medium;
    const Status laid_out = lay_out_sums(tracing, bricks, spacing, sums, fluence);
    if (laid_out != Status::done) return laid_out;
    fluence.sigma_shift = sigma_shift_for(majorant(medium, medium.bounds));
    const Emitters emitters = find_emitters(medium, lights, light_count, tracing.arena);
    if (!emitters.list) return Status::out_of_memory;
    if (emitters.count == 0) return Status::done;
    const TowardsEye eye(medium, tracing.eye);
    fluence.photon_color = emitters.list[0].photon_color;
    fluence.unit = fluence.photon = photon_unit(emitters.power, tracing.settings.photons);
    if (tracing.needs.towards_eye) {
        fluence.unit.exponent -= eye.shift;
        fluence.one_eye = one_eye(fluence, tracing.eye);
    }
    auto &counts = tracing.statistics.photons;
    bool fits = true;
    const auto on_collision = [&](const MediumCollision &at, const Photon &arrived, const Color &power) {
        const Ray &ray = arrived.ray;
        const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, ray.origin));
        ++(brick == no_brick ? counts.lost : counts.stored); // by rounding, at the border of the smoke
        if (brick == no_brick) return;
        const Color kept = tracing.needs.towards_eye ? power * eye(at.smoke, ray) : power;
        deposit(fluence, brick, position_in(bricks, brick, ray.origin),
                fluence.channels == 1 ? Color(largest(kept)) : kept, ray.direction, {});
    };
    const Status status = for_each_batch(tracing, [&](Mt19937 &generator, uint64_t, uint64_t photons) {
        return for_each_photon(tracing, generator, photons, [&](uint64_t key) {
            trace_photon(tracing, emitters, key, on_collision);
            return fits = counts.stored + counts.emitted <= max_fluence_flights;
        });
    });
    return fits ? status : Status::overflow;
}

} // namespace wisp::WISP_ARITH
