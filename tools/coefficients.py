#!/usr/bin/env python3
"""Writes src/core/numbers/elementary_coefficients.h: the polynomials and split constants of elementary.h.

    python3 tools/coefficients.py > src/core/numbers/elementary_coefficients.h

Run by hand only, when a fit changes; the header is kept in the repository, so builds need neither Python nor mpmath
(Debian: python3-mpmath). Each polynomial is a minimax fit by Remez exchange in 60 digits. Floating coefficients are
rounded to their type one after the other, lowest order first, and the rest is fitted again around each rounded one.
"""
import mpmath as mp

mp.mp.dps = 60
TINY = mp.mpf(10) ** -20  # below this argument a fitted quotient is replaced by the start of its series


def solve_alternation(f, weight, points, first, count):
    """Coefficients of x^first ... whose weighted error is +-E, alternating over the points."""
    n = count + 1
    matrix, right = mp.matrix(n, n), mp.matrix(n, 1)
    for i, x in enumerate(points):
        for k in range(count):
            matrix[i, k] = weight(x) * x ** (first + k)
        matrix[i, count] = (-1) ** i
        right[i] = weight(x) * f(x)
    return list(mp.lu_solve(matrix, right))[:count]


def parabola_vertex(xs, es, i):
    """Where the parabola through three neighbouring samples of the error has its extremum."""
    x0, x1, x2 = xs[i - 1 : i + 2]
    e0, e1, e2 = es[i - 1 : i + 2]
    d = (x1 - x0) * (e1 - e2) - (x1 - x2) * (e1 - e0)
    if d == 0:
        return x1
    x = x1 - ((x1 - x0) ** 2 * (e1 - e2) - (x1 - x2) ** 2 * (e1 - e0)) / (2 * d)
    return x if x0 < x < x2 else x1


def extrema(error, low, high, samples):
    """The place of the largest error within each run of one sign."""
    xs = [(low + high) / 2 - (high - low) / 2 * mp.cos(mp.pi * i / samples) for i in range(samples + 1)]
    es = [error(x) for x in xs]
    runs = [[0]]
    for i in range(1, samples + 1):
        if (es[i] >= 0) == (es[runs[-1][0]] >= 0):
            runs[-1].append(i)
        else:
            runs.append([i])
    peaks = [max(run, key=lambda j: abs(es[j])) for run in runs]
    return [parabola_vertex(xs, es, i) if 0 < i < samples else xs[i] for i in peaks]


def remez(f, weight, low, high, degree, fixed=()):
    """Minimise max |weight (f - p)| over p of this degree whose first coefficients are given."""
    low, high = mp.mpf(low), mp.mpf(high)
    first, count = len(fixed), degree + 1 - len(fixed)

    def rest(x):
        return f(x) - sum(c * x**k for k, c in enumerate(fixed))

    if count == 0:
        xs = [low + (high - low) * i / 2000 for i in range(2001)]
        return list(fixed), max(abs(weight(x) * rest(x)) for x in xs)
    points = [
        (low + high) / 2 - (high - low) / 2 * mp.cos(mp.pi * (2 * i + 1) / (2 * (count + 1))) for i in range(count + 1)
    ]
    best, best_error = None, mp.inf
    for _ in range(30):
        found = solve_alternation(rest, weight, points, first, count)

        def error(x):
            return weight(x) * (rest(x) - sum(c * x ** (first + k) for k, c in enumerate(found)))

        peaks = extrema(error, low, high, 16 * (count + 2))
        largest = max(abs(error(x)) for x in peaks)
        if largest < best_error:
            best, best_error = found, largest
        if len(peaks) < count + 1:
            break
        while len(peaks) > count + 1:
            peaks.pop(0 if abs(error(peaks[0])) < abs(error(peaks[-1])) else -1)
        if max(abs(p - q) for p, q in zip(points, peaks)) < mp.mpf(10) ** -12 * (high - low):
            break
        points = peaks
    return list(fixed) + best, best_error


def rounded(x, bits):
    mantissa, exponent = mp.frexp(mp.mpf(x))
    return mp.nint(mp.ldexp(mantissa, bits)) * mp.mpf(2) ** (exponent - bits)


def fit_float(f, weight, low, high, degree, bits, fixed=()):
    kept = list(fixed)
    found, error = remez(f, weight, low, high, degree, kept)
    while len(kept) <= degree:
        kept.append(rounded(found[len(kept)], bits))
        found, error = remez(f, weight, low, high, degree, kept)
    return kept, error


# The fitted functions: each is smooth at 0, where the quotient itself would be 0/0.
ln2, two_pi, half_pi = mp.log(2), 2 * mp.pi, mp.pi / 2
ln2_half = ln2 / 2 * mp.mpf("1.0001")
log_end = ((mp.sqrt(2) - 1) / (mp.sqrt(2) + 1)) ** 2 * mp.mpf("1.0001")


def from_root(quotient, start):
    """A function of z = x^2 given by a quotient in x and z; `start` is its series to first order."""
    return lambda z: start(z) if z < TINY else quotient(mp.sqrt(z), z)


def one(_):
    return mp.mpf(1)


def exp_tail(r):
    return (mp.exp(r) - 1 - r) / r**2 if abs(r) > mp.mpf(10) ** -12 else mp.mpf(1) / 2 + r / 6


log_tail = from_root(lambda s, z: (2 * mp.atanh(s) - 2 * s) / (s * z), lambda z: mp.mpf(2) / 3 + 2 * z / 5)
sin_tail = from_root(
    lambda r, z: (mp.sin(two_pi * r) / r - two_pi) / z, lambda z: -(two_pi**3) / 6 + two_pi**5 / 120 * z
)
cos_tail = from_root(lambda r, z: (mp.cos(two_pi * r) - 1) / z, lambda z: -(two_pi**2) / 2 + two_pi**4 / 24 * z)
asin_tail = from_root(lambda x, z: (mp.asin(x) - x) / (x * z), lambda z: mp.mpf(1) / 6 + 3 * z / 40)
atan_tail = from_root(lambda t, z: (mp.atan(t) - t) / (t * z), lambda z: -mp.mpf(1) / 3 + z / 5)
log_ratio = from_root(lambda s, z: 2 * mp.atanh(s) / s, lambda z: 2 + 2 * z / 3)
sin_ratio = from_root(lambda y, z: mp.sin(half_pi * y) / y, lambda z: half_pi - half_pi**3 / 6 * z)
cos_ratio = from_root(lambda y, z: mp.cos(half_pi * y), one)
atan_ratio = from_root(lambda t, z: mp.atan(t) / t, lambda z: 1 - z / 3)


class Format:
    """How a type is written, and the sizes of its fits."""

    def __init__(self, name, bits, suffix, degrees, high_bits):
        self.name, self.bits, self.suffix, self.degrees, self.high_bits = name, bits, suffix, degrees, high_bits

    def literal(self, x):
        mantissa, exponent = float(x).hex().split("p")
        mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        return (mantissa if mantissa not in ("0x", "-0x") else mantissa + "0") + "p" + exponent + self.suffix


FLOAT = Format("float", 24, "f", dict(exp=5, log=3, sin=2, cos=3, asin=5, atan=5), dict(ln2=14, two_pi=12))
DOUBLE = Format("double", 53, "", dict(exp=10, log=6, sin=5, cos=6, asin=12, atan=12), dict(ln2=32, two_pi=26))


def power_of_two(error):
    return "2^%.1f" % float(mp.log(error, 2))


def print_array(declaration, values):
    print("    static constexpr %s[] = {" % declaration)
    for value in values:
        print("        %s," % value)
    print("    };")


def print_fit(form, name, meaning, f, weight, low, high, fixed=()):
    values, error = fit_float(f, weight, low, high, form.degrees[name], form.bits, fixed)
    print("    // %s, relative error %s" % (meaning, power_of_two(error)))
    print_array("%s %s" % (form.name, name), [form.literal(v) for v in values])


def print_split(form, name, x):
    high = rounded(x, form.high_bits[name])
    print("    static constexpr %s %s_high = %s;" % (form.name, name, form.literal(high)))
    print("    static constexpr %s %s_low = %s;" % (form.name, name, form.literal(rounded(x - high, form.bits))))


def print_floating(form):
    print("template <> struct Coefficients<%s> {" % form.name)
    print_fit(form, "exp", "e^r = 1 + r + r^2 P(r), |r| <= ln(2)/2", exp_tail, lambda r: r * r / mp.exp(r),
              -ln2_half, ln2_half, [mp.mpf(1) / 2])
    print_fit(form, "log", "ln((1+s)/(1-s)) = 2s + s^3 P(s^2), |s| <= 0.1716", log_tail, lambda z: z / 2, 0, log_end)
    eighth = mp.mpf(1) / 64  # squared
    print_fit(form, "sin", "sin(2 pi r) = 2 pi r + r^3 P(r^2), |r| <= 1/8", sin_tail, lambda z: z / two_pi, 0, eighth)
    print_fit(form, "cos", "cos(2 pi r) = 1 + r^2 P(r^2), |r| <= 1/8", cos_tail, lambda z: z, 0, eighth)
    print_fit(form, "asin", "asin(x) = x + x^3 P(x^2), |x| <= 1/2", asin_tail, lambda z: z, 0, mp.mpf("0.2501"))
    print_fit(form, "atan", "atan(t) = t + t^3 P(t^2), |t| <= 1/2", atan_tail, lambda z: z, 0, mp.mpf("0.2501"))
    print("    // x = x_high + x_low; few bits in x_high, so that its product with a short number is exact")
    print_split(form, "ln2", ln2)
    print_split(form, "two_pi", two_pi)
    print("    static constexpr %s inv_ln2 = %s;" % (form.name, form.literal(rounded(1 / ln2, form.bits))))
    quarters = [k * mp.pi / 4 for k in range(5)]
    high = [rounded(q, form.bits) for q in quarters]
    low = [rounded(q - h, form.bits) for q, h in zip(quarters, high)]
    print("    // k pi/4, k = 0 ... 4")
    print_array("%s quarter_pi_high" % form.name, [form.literal(v) for v in high])
    print_array("%s quarter_pi_low" % form.name, [form.literal(v) for v in low])
    print("};")
    print()


def print_fixed_fit(name, meaning, f, low, high, degree):
    found, error = remez(f, one, low, high, degree)
    print("    // %s, absolute error %s" % (meaning, power_of_two(error)))
    print_array("int64_t " + name, [int(mp.nint(mp.ldexp(v, 61))) for v in found])


def print_fixed():
    print("// All in units of 2^-61.")
    print("template <> struct Coefficients<Fixed> {")
    half, quarter = mp.mpf(1) / 2, mp.mpf(1) / 4
    print_fixed_fit("exp2", "2^f = P(f), |f| <= 1/2", lambda f: mp.mpf(2) ** f, -half, half, 9)
    print_fixed_fit("log", "ln((1+s)/(1-s)) = s P(s^2), |s| <= 0.1716", log_ratio, 0, log_end, 6)
    print_fixed_fit("sin", "sin(pi/2 y) = y P(y^2), |y| <= 1/2", sin_ratio, 0, quarter, 6)
    print_fixed_fit("cos", "cos(pi/2 y) = P(y^2), |y| <= 1/2", cos_ratio, 0, quarter, 6)
    print_fixed_fit("atan", "atan(t) = t P(t^2), |t| <= 1/2", atan_ratio, 0, mp.mpf("0.2501"), 9)
    print("    static constexpr int64_t quarter_pi = %d;" % int(mp.nint(mp.ldexp(mp.pi / 4, 61))))
    print("    static constexpr int64_t inv_ln2 = %d;" % int(mp.nint(mp.ldexp(1 / ln2, 61))))
    print("    static constexpr int64_t ln2 = %d;" % int(mp.nint(mp.ldexp(ln2, 61))))
    print("};")


print("""\
// Minimax polynomials (lowest order first) and constants of elementary.h. Written by tools/coefficients.py: edit that.
#pragma once
#include <cstdint>

// clang-format off
namespace wisp {
struct Fixed;
}
namespace wisp::detail {

template <class T> struct Coefficients;
""")
print_floating(FLOAT)
print_floating(DOUBLE)
print_fixed()
print("""
} // namespace wisp::detail""")
