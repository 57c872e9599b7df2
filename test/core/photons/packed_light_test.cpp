// Light in 32 bits: layout, rounding, range. The expected bits are found in double, or written out.
#include "core/photons/packed_light.h"
#include "support/built_smoke.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

uint32_t word(uint32_t shift, uint32_t red, uint32_t green, uint32_t blue) {
    return shift << 27 | blue << 18 | green << 9 | red;
}

Color color(double red, double green, double blue) { return vec(red, green, blue); }

// The definition, in double: the least shift with which the largest mantissa fits.
uint32_t packed_by_definition(const double (&channel)[3], int exponent) {
    for (int shift = 0; shift < 32; ++shift) {
        double m[3];
        for (int i = 0; i < 3; ++i) m[i] = std::floor(std::ldexp(channel[i], 40 - exponent - shift) + 0.5);
        if (std::max({m[0], m[1], m[2]}) > 511) continue;
        return word(static_cast<uint32_t>(shift), static_cast<uint32_t>(m[0]), static_cast<uint32_t>(m[1]),
                    static_cast<uint32_t>(m[2]));
    }
    return 0;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": packed colours have their layout, 0 and the ends of their range") {
    CHECK(pack_color(color(0, 0, 0), 0) == 0);
    CHECK(pack_color(color(0.5, 0.25, 0.125), 0) == word(31, 256, 128, 64));
    CHECK(pack_color(color(0.5, 0.25, 0.125), 2) == word(29, 256, 128, 64));
    CHECK(pack_color(color(511.0 / 512, 1.0 / 512, 0), 0) == word(31, 511, 1, 0));
    CHECK(pack_color(color(0x1p-12, 0, 0x1p-12), 0) == word(20, 256, 0, 256));
    CHECK(pack_color(color(511.5 / 1024, 0, 0), 0) == word(31, 256, 0, 0)); // the mantissa rounds up to 512
    CHECK(pack_color(color(3, 0.5, 1000), 0) == word(31, 511, 256, 511));
    CHECK(pack_color(color(3, 0.5, 1000), -30) == word(31, 511, 511, 511));
    CHECK(pack_color(color(-3, -0x1p-30, 0.5), 0) == word(31, 0, 0, 256));
    // Below the last shift there are units of 2^(exponent - 40).
    CHECK(pack_color(color(0x1p-30, 0, 0), 10) == word(0, 1, 0, 0));
    CHECK(pack_color(color(0x1p-31, 0, 0), 10) == word(0, 1, 0, 0)); // a half, rounded up
    CHECK(pack_color(color(0x1p-32, 0, 0), 10) == 0);
    if (std::is_floating_point_v<Real>) CHECK(pack_color(color(NAN, 0, 0.5), 0) == word(31, 0, 0, 256));
}

TEST_CASE(WISP_ARITH_NAME ": packed colours are the nearest, in the same bits everywhere") {
    Sequence next{7};
    for (int i = 0; i < 4000; ++i) {
        // 16 bits a channel down to 2^-28: numbers that every arithmetic holds.
        const int exponent = i % 9 - 4;
        double channel[3];
        for (double &c : channel)
            c = std::ldexp(std::floor(next() * 65536), exponent - 16 - static_cast<int>(8 * next()));
        if (std::max({channel[0], channel[1], channel[2]}) > std::ldexp(511.0 / 512, exponent)) continue;
        const uint32_t packed = pack_color(color(channel[0], channel[1], channel[2]), exponent);
        CHECK(packed == packed_by_definition(channel, exponent));
        const Color back = unpack_color(packed, exponent);
        const double largest_channel = std::max({channel[0], channel[1], channel[2]}),
                     found[3] = {at(back.x), at(back.y), at(back.z)};
        for (int c = 0; c < 3; ++c) CHECK(std::fabs(found[c] - channel[c]) <= largest_channel / 512);
        CHECK(pack_color(back, exponent) == packed);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the exponent of an array is the least that holds its largest channel") {
    CHECK(exponent_for(Real(0)) == 0);
    for (double x : {1.0, 0.998046875, 0.9980468751, 0.5, 0.3, 3.0, 1000.0, 1e6, 1e-6, 0x1p-31}) {
        const int32_t exponent = exponent_for(real(x));
        const double value = at(real(x));
        CAPTURE(x);
        CHECK(value <= std::ldexp(511.0 / 512, exponent));
        CHECK(value > std::ldexp(511.0 / 512, exponent - 1));
        const double back = at(unpack_color(pack_color(Color(real(x)), exponent), exponent).y);
        CHECK(std::fabs(back / value - 1) < 1.0 / 512);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a channel that is weaker than another keeps seven bits of its largest value") {
    Sequence next{11};
    for (int i = 0; i < 400; ++i) {
        // Down to 2^-14 of the strongest channel, the first of each color.
        const double most[3] = {1 + 100 * next(), std::ldexp(1 + next(), -static_cast<int>(15 * next())), 0};
        const ColorScale scale = scale_for(color(most[0], most[1], most[2]));
        CHECK(scale.strongest() == exponent_for(real(most[0])));
        CHECK(scale.exponent[0] == scale.strongest());
        const Color packed = unpack_color(pack_color(color(most[0], most[1], most[2]), scale), scale);
        CHECK(std::fabs(at(packed.x) / most[0] - 1) <= 1.0 / 512);
        CHECK(std::fabs(at(packed.y) / most[1] - 1) <= 1.0 / 128);
        CHECK(at(packed.z) == 0);
        const Color tenth = unpack_color(pack_color(color(most[0], most[1] / 10, 0), scale), scale, 2);
        CHECK(std::fabs(at(tenth.y) * 4 - most[1] / 10) <= most[1] / 128);
    }
    // Channels in proportion share the strongest one's scale.
    const ColorScale near = scale_for(color(0.9, 0.5, 0.25));
    for (const int32_t exponent : near.exponent) CHECK(exponent == near.strongest());
}

TEST_CASE(WISP_ARITH_NAME ": a packed flux has its layout, and its ends and 0 are exact") {
    CHECK(pack_flux(vec(0, 0, 0)) == 0);
    CHECK(pack_flux(vec(1, 0, 0)) == 511);
    CHECK(pack_flux(vec(0, 1, 0)) == 511u << 10);
    CHECK(pack_flux(vec(0, 0, 1)) == 511u << 20);
    CHECK(pack_flux(vec(-1, 0, 0)) == 0x201);
    CHECK(pack_flux(vec(-5, 7, -1.5)) == (0x201u << 20 | 511u << 10 | 0x201u));
    CHECK(unpack_flux(pack_flux(vec(-1, 0, 1))) == vec(-1, 0, 1));
    Sequence next{3};
    for (int i = 0; i < 1000; ++i) {
        const double x = 2 * next() - 1, y = 2 * next() - 1, z = 2 * next() - 1;
        const uint32_t packed = pack_flux(vec(x, y, z));
        const Vec3 back = unpack_flux(packed);
        CHECK(std::fabs(at(back.x) - x) < 0.50001 / 511);
        CHECK(std::fabs(at(back.y) - y) < 0.50001 / 511);
        CHECK(std::fabs(at(back.z) - z) < 0.50001 / 511);
        CHECK(pack_flux(back) == packed);
    }
}
