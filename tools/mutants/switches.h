// Included before each source of the mutated copy: what stands in place of an operator or a number of the core.
//
// Each place has a number, and a switch. WISP_MUTANT=number turns one on: that place then computes something else.
// WISP_REACHED=FILE adds to the file the numbers of all places that a process has come to.
#pragma once

namespace mutant {

constexpr int places = 1 << 16;
extern unsigned char switches[places]; // 0: as written; 1: mutated; 2: as written, and to be noted
bool note(int place);

constexpr bool on(int place) {
    if (__builtin_is_constant_evaluated()) return false;
    return __builtin_expect(switches[place], 0) && note(place);
}

// clang-format off
#define WISP_MUTATED(name, op, instead) \
    template <int place, class A, class B> constexpr auto name(const A &a, const B &b) -> decltype(a op b) { \
        if (on(place)) return static_cast<decltype(a op b)>(a instead b); \
        return a op b; \
    }
WISP_MUTATED(less, <, <=)
WISP_MUTATED(less_equal, <=, <)
WISP_MUTATED(greater, >, >=)
WISP_MUTATED(greater_equal, >=, >)
WISP_MUTATED(equal, ==, !=)
WISP_MUTATED(not_equal, !=, ==)
WISP_MUTATED(plus, +, -)
WISP_MUTATED(minus, -, +)
WISP_MUTATED(modulo, %, *)
WISP_MUTATED(bit_and, &, |)
WISP_MUTATED(bit_or, |, &)
WISP_MUTATED(shift_left, <<, >>)
WISP_MUTATED(shift_right, >>, <<)
// clang-format on

// Products and quotients are doubled: a type that has one need not have the other.
template <int place, class A, class B> constexpr auto times(const A &a, const B &b) -> decltype(a * b) {
    if (on(place)) return a * b + a * b;
    return a * b;
}
template <int place, class A, class B> constexpr auto divided(const A &a, const B &b) -> decltype(a / b) {
    if (on(place)) return a / b + a / b;
    return a / b;
}
template <int place, class A> constexpr auto negative(const A &a) -> decltype(-a) {
    if (on(place)) return static_cast<decltype(-a)>(a);
    return -a;
}
template <int place, class A> constexpr A number(A a) { return on(place) ? static_cast<A>(a + 1) : a; }

} // namespace mutant
