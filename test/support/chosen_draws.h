// Events and keys that give a chosen draw in one dimension, by inverting the hash of random.h. Tests use them to
// exercise the rarest random numbers.
#pragma once
#include "core/numbers/random.h"

namespace wisp {

// 1 / odd modulo 2^64, by Newton's method: each step doubles the correct bits.
constexpr uint64_t inverse_of(uint64_t odd) {
    uint64_t x = odd;
    for (int i = 0; i < 6; ++i) x *= 2 - odd * x;
    return x;
}
constexpr uint32_t inverse_of_32(uint32_t odd) { return static_cast<uint32_t>(inverse_of(odd)); }

// An event whose draw in `dimension` is `bits`.
inline Event event_with_draw(uint32_t dimension, uint32_t bits, uint32_t low = 0x12345678) {
    uint32_t x = bits ^ bits >> 16;
    x *= inverse_of_32(0x9e3779b1u);
    x ^= x >> 15 ^ x >> 30;
    x *= inverse_of_32(0x846ca68bu);
    x ^= x >> 16;
    uint32_t y = dimension * 0x9e3779b9u ^ low;
    y = (y ^ y >> 16) * 0x7feb352du;
    return {low, x - (y ^ y >> 15)};
}

// A photon's key with photon_event(key, number) = event.
inline uint64_t key_with_event(Event event, uint64_t number) {
    uint64_t x = uint64_t{event.high} << 32 | event.low;
    x ^= x >> 31 ^ x >> 62;
    x *= inverse_of(0x94d049bb133111ebu);
    x ^= x >> 27 ^ x >> 54;
    x *= inverse_of(0xbf58476d1ce4e5b9u);
    x ^= x >> 30 ^ x >> 60;
    x -= (number + 1) * 0x9e3779b97f4a7c15u;
    x ^= x >> 32;
    return x * inverse_of(0xd6e8feb86659fd93u);
}

// A photon's key whose draw in `dimension` of its event `number` is `bits`.
inline uint64_t key_with_draw(uint64_t number, uint32_t dimension, uint32_t bits) {
    return key_with_event(event_with_draw(dimension, bits), number);
}

} // namespace wisp
