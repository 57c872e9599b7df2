// Distances along a ray at which a light beside it is likely to be scattered back along the ray (README, Equi-angular
// samples).
#pragma once
#include "core/geometry/ray.h"
#include "core/lights/least_distance.h"
#include "core/numbers/random.h"
#include "core/smoke/phase.h"

namespace wisp::WISP_ARITH {

// The sine and the cosine of half an angle of [0, pi], both times the same number.
struct HalfAngle {
    Real sine, cosine;

    Phase::Cosine doubled() const {
        const Real square = sine * sine + cosine * cosine;
        return {(cosine - sine) * (cosine + sine) / square, Real(2) * sine * cosine / square};
    }
};

// (1 - k^2) / (1 + k^2 - 2 k cos), -1 < k < 1. Its integral over the angles 0 to pi is pi.
class PoissonKernel {
  public:
    explicit PoissonKernel(Real k = Real(0)) : ahead_(Real(1) - k), back_(Real(1) + k) {}

    Real operator()(const HalfAngle &half) const {
        const Real sine = back_ * half.sine, cosine = ahead_ * half.cosine;
        return ahead_ * back_ * (half.sine * half.sine + half.cosine * half.cosine) / (sine * sine + cosine * cosine);
    }
    // Half of its integral from the angle 0 on: 0 to pi / 2.
    Real integral(const HalfAngle &half) const { return angle_between(back_ * half.sine, ahead_ * half.cosine); }
    HalfAngle inverse(Real integral) const {
        HalfAngle half;
        sincos_turns(integral * inv_two_pi<Real>, half.sine, half.cosine);
        return {ahead_ * half.sine, back_ * half.cosine};
    }

  private:
    Real ahead_, back_;
};

// Distances from `begin` to `end` in proportion to 1 / r^2 from the light's position times Poisson's kernel of the
// angle by which the light is scattered back along the ray: half of them with k = `least`, half with k = `greatest`, of
// the smokes' g.
class EquiAngular {
  public:
    EquiAngular(const Vec3 &light, const Ray &ray, Real begin, Real end, Real least, Real greatest)
        : begin_(begin), end_(end), count_(least < greatest ? 2 : 1) {
        const Vec3 to_light = light - ray.origin;
        middle_ = dot(to_light, ray.direction);
        distance_ = max(length(cross(to_light, ray.direction)), Real(least_light_distance));
        for (int32_t i = 0; i < count_; ++i) {
            const PoissonKernel kernel(i == 0 ? least : greatest);
            const Real low = kernel.integral(half_angle(begin));
            parts_[i] = {kernel, low, kernel.integral(half_angle(end)) - low};
        }
    }

    Real sample(Pcg32 &generator) const {
        const Part &part = parts_[count_ > 1 ? generator() >> 31 : 0];
        const HalfAngle half = part.kernel.inverse(part.low + unit_half_open<Real>(generator()) * part.spread);
        const Real along = distance_ * ((half.sine - half.cosine) * (half.sine + half.cosine));
        return min(max(begin_, middle_ + bounded_quotient(along, Real(2) * half.sine * half.cosine)), end_);
    }
    // Per unit of length; its integral from `begin` to `end` is 1.
    Real density(Real t) const {
        const HalfAngle half = half_angle(t);
        const Real u = t - middle_;
        Real sum = Real(0);
        for (int32_t i = 0; i < count_; ++i) sum += parts_[i].kernel(half) / parts_[i].spread;
        return distance_ * sum / (Real(2 * count_) * (distance_ * distance_ + u * u));
    }

  private:
    // Of the angle between the light that arrives at the distance t and the way back along the ray.
    HalfAngle half_angle(Real t) const {
        const Real u = t - middle_, quotient = distance_ / (sqrt(distance_ * distance_ + u * u) + abs(u));
        return u < Real(0) ? HalfAngle{quotient, Real(1)} : HalfAngle{Real(1), quotient};
    }

    struct Part {
        PoissonKernel kernel;
        Real low, spread; // of half the kernel's integral
    };
    Real begin_, end_, middle_, distance_;
    int32_t count_;
    Part parts_[2];
};

} // namespace wisp::WISP_ARITH
