// Minimax polynomials (lowest order first) and constants of elementary.h. Written by tools/coefficients.py: edit that.
#pragma once
#include <cstdint>

// clang-format off
namespace wisp {
struct Fixed;
}
namespace wisp::detail {

template <class T> struct Coefficients;

template <> struct Coefficients<float> {
    // e^r = 1 + r + r^2 P(r), |r| <= ln(2)/2, relative error 2^-31.2
    static constexpr float exp[] = {
        0x1p-1f,
        0x1.55553cp-3f,
        0x1.5554f2p-5f,
        0x1.113726p-7f,
        0x1.6d4138p-10f,
        0x1.6b8ae6p-13f,
    };
    // ln((1+s)/(1-s)) = 2s + s^3 P(s^2), |s| <= 0.1716, relative error 2^-35.2
    static constexpr float log[] = {
        0x1.555554p-1f,
        0x1.999c26p-2f,
        0x1.23d3ep-2f,
        0x1.f13b1ep-3f,
    };
    // sin(2 pi r) = 2 pi r + r^3 P(r^2), |r| <= 1/8, relative error 2^-28.0
    static constexpr float sin[] = {
        -0x1.4abbcp+5f,
        0x1.46607ep+6f,
        -0x1.2ddcecp+6f,
    };
    // cos(2 pi r) = 1 + r^2 P(r^2), |r| <= 1/8, relative error 2^-31.2
    static constexpr float cos[] = {
        -0x1.3bd3ccp+4f,
        0x1.03c1aep+6f,
        -0x1.55b146p+6f,
        0x1.d47d4ap+5f,
    };
    // asin(x) = x + x^3 P(x^2), |x| <= 1/2, relative error 2^-31.7
    static constexpr float asin[] = {
        0x1.55554cp-3f,
        0x1.3338aap-4f,
        0x1.6ca7dcp-5f,
        0x1.04cd0cp-5f,
        0x1.d589f4p-7f,
        0x1.349e46p-5f,
    };
    // atan(t) = t + t^3 P(t^2), |t| <= 1/2, relative error 2^-31.8
    static constexpr float atan[] = {
        -0x1.555552p-2f,
        0x1.999746p-3f,
        -0x1.24506ap-3f,
        0x1.c076dep-4f,
        -0x1.481f7p-4f,
        0x1.400a0ep-5f,
    };
    // x = x_high + x_low; few bits in x_high, so that its product with a short number is exact
    static constexpr float ln2_high = 0x1.62e8p-1f;
    static constexpr float ln2_low = -0x1.e8082ep-16f;
    static constexpr float two_pi_high = 0x1.922p+2f;
    static constexpr float two_pi_low = -0x1.2aeef4p-16f;
    static constexpr float inv_ln2 = 0x1.715476p+0f;
    // k pi/4, k = 0 ... 4
    static constexpr float quarter_pi_high[] = {
        0x0p+0f,
        0x1.921fb6p-1f,
        0x1.921fb6p+0f,
        0x1.2d97c8p+1f,
        0x1.921fb6p+1f,
    };
    static constexpr float quarter_pi_low[] = {
        0x0p+0f,
        -0x1.777a5cp-26f,
        -0x1.777a5cp-25f,
        -0x1.99bc5cp-28f,
        -0x1.777a5cp-24f,
    };
};

template <> struct Coefficients<double> {
    // e^r = 1 + r + r^2 P(r), |r| <= ln(2)/2, relative error 2^-61.1
    static constexpr double exp[] = {
        0x1p-1,
        0x1.555555555555dp-3,
        0x1.555555555556cp-5,
        0x1.111111110e549p-7,
        0x1.6c16c16c0a3f1p-10,
        0x1.a01a01b5f5325p-13,
        0x1.a01a01e8cebf7p-16,
        0x1.71ddeaa0c20c2p-19,
        0x1.27e44a3031b21p-22,
        0x1.af74a7165b3f8p-26,
        0x1.20544560c9123p-29,
    };
    // ln((1+s)/(1-s)) = 2s + s^3 P(s^2), |s| <= 0.1716, relative error 2^-59.5
    static constexpr double log[] = {
        0x1.5555555555592p-1,
        0x1.999999997ff04p-2,
        0x1.24924941e33bep-2,
        0x1.c71c521253a35p-3,
        0x1.74663d6907536p-3,
        0x1.39a1daab591adp-3,
        0x1.2f04574f7e5b8p-3,
    };
    // sin(2 pi r) = 2 pi r + r^3 P(r^2), |r| <= 1/8, relative error 2^-58.0
    static constexpr double sin[] = {
        -0x1.4abbce625be47p+5,
        0x1.466bc67758dfap+6,
        -0x1.32d2cce33a56p+6,
        0x1.50783021c7559p+5,
        -0x1.e300abb1bcc5ap+3,
        0x1.e40581dc1ea6ap+1,
    };
    // cos(2 pi r) = 1 + r^2 P(r^2), |r| <= 1/8, relative error 2^-61.5
    static constexpr double cos[] = {
        -0x1.3bd3cc9be45dep+4,
        0x1.03c1f081b5a4fp+6,
        -0x1.55d3c7e3bf5abp+6,
        0x1.e1f506749a431p+5,
        -0x1.a6d1e138cee42p+4,
        0x1.f9c3d3cad5a2ap+2,
        -0x1.afee49d8ee0ap+0,
    };
    // asin(x) = x + x^3 P(x^2), |x| <= 1/2, relative error 2^-59.8
    static constexpr double asin[] = {
        0x1.5555555555578p-3,
        0x1.333333332df17p-4,
        0x1.6db6db722b568p-5,
        0x1.f1c71a8ba1c36p-6,
        0x1.6e8bdfe6101d3p-6,
        0x1.1c49de0ab3687p-6,
        0x1.ca21437413c5ep-7,
        0x1.7577940171ce5p-7,
        0x1.618a939389bfdp-7,
        0x1.e15d9ca1e2afep-9,
        0x1.6501453bab616p-6,
        -0x1.59f571b71ebc6p-6,
        0x1.0be40e5f1fda8p-5,
    };
    // atan(t) = t + t^3 P(t^2), |t| <= 1/2, relative error 2^-62.1
    static constexpr double atan[] = {
        -0x1.5555555555552p-2,
        0x1.99999999990e5p-3,
        -0x1.2492492453eb8p-3,
        0x1.c71c71ab2b9d1p-4,
        -0x1.745d1396808aap-4,
        0x1.3b1361380c95ep-4,
        -0x1.110c77a55d30fp-4,
        0x1.e183436d258e7p-5,
        -0x1.ac750fb0f801cp-5,
        0x1.780519f7b47eep-5,
        -0x1.3032d7d073d37p-5,
        0x1.83e5833017c7cp-6,
        -0x1.1287b8ad04e3fp-7,
    };
    // x = x_high + x_low; few bits in x_high, so that its product with a short number is exact
    static constexpr double ln2_high = 0x1.62e42ffp-1;
    static constexpr double ln2_low = -0x1.718432a1b0e26p-35;
    static constexpr double two_pi_high = 0x1.921fb58p+2;
    static constexpr double two_pi_low = -0x1.dde973dcb3b3ap-25;
    static constexpr double inv_ln2 = 0x1.71547652b82fep+0;
    // k pi/4, k = 0 ... 4
    static constexpr double quarter_pi_high[] = {
        0x0p+0,
        0x1.921fb54442d18p-1,
        0x1.921fb54442d18p+0,
        0x1.2d97c7f3321d2p+1,
        0x1.921fb54442d18p+1,
    };
    static constexpr double quarter_pi_low[] = {
        0x0p+0,
        0x1.1a62633145c07p-55,
        0x1.1a62633145c07p-54,
        0x1.a79394c9e8a0ap-54,
        0x1.1a62633145c07p-53,
    };
};

// All in units of 2^-61.
template <> struct Coefficients<Fixed> {
    // 2^f = P(f), |f| <= 1/2, absolute error 2^-46.1
    static constexpr int64_t exp2[] = {
        2305843009213725057,
        1598288580650351557,
        553924611693246777,
        127983760946083398,
        22177895963563897,
        3074509210073478,
        355179000227709,
        35170196974128,
        3057466237945,
        235460622480,
    };
    // ln((1+s)/(1-s)) = s P(s^2), |s| <= 0.1716, absolute error 2^-51.4
    static constexpr int64_t log[] = {
        4611686018427388703,
        1537228672806479135,
        922337205120060077,
        658811997359715933,
        512437617406103496,
        417860146053709284,
        388286681239056198,
    };
    // sin(pi/2 y) = y P(y^2), |y| <= 1/2, absolute error 2^-57.5
    static constexpr int64_t sin[] = {
        3622009729038561410,
        -1489491798437806414,
        183758685115318179,
        -10795390036918727,
        369952105851949,
        -8297906699435,
        129909776656,
    };
    // cos(pi/2 y) = P(y^2), |y| <= 1/2, absolute error 2^-54.2
    static constexpr int64_t cos[] = {
        2305843009213693843,
        -2844719788994532954,
        584922061441582881,
        -48107911200573178,
        2119669129700942,
        -58107556609502,
        1073439389130,
    };
    // atan(t) = t P(t^2), |t| <= 1/2, absolute error 2^-45.0
    static constexpr int64_t atan[] = {
        2305843009213630441,
        -768614336352679298,
        461168594843839722,
        -329405777163619764,
        256194964730616209,
        -209470276098444176,
        175925184151296539,
        -144990155595176632,
        102333488148838217,
        -43087552443220163,
    };
    static constexpr int64_t quarter_pi = 1811004864519280711;
    static constexpr int64_t inv_ln2 = 3326628274461080623;
    static constexpr int64_t ln2 = 1598288580650331957;
};

} // namespace wisp::detail
