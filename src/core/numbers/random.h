// Reproducible random numbers. A batch of photons owns an MT19937 that is seeded from (seed, batch). The generator
// gives each photon a 64-bit key and nothing else. Every draw of the photon is a hash of (key, event, dimension). So a
// batch can be traced on any machine, and rounding in one photon's path does not change the draws of another.
#pragma once
#include <cstdint>

namespace wisp {

// MT19937 (Matsumoto, Nishimura 1998). It is seeded as the C++ standard seeds mt19937{seed_seq{s0, s1, s2, s3}}
// ([rand.util.seedseq]), but without the heap of that class.
class Mt19937 {
  public:
    Mt19937(uint32_t s0, uint32_t s1, uint32_t s2, uint32_t s3) { seed(s0, s1, s2, s3); }

    void seed(uint32_t s0, uint32_t s1, uint32_t s2, uint32_t s3) {
        const uint32_t seeds[4] = {s0, s1, s2, s3};
        generate_seed_sequence(seeds, 4);
    }

    uint32_t operator()() {
        if (next_ == n) refill();
        uint32_t y = state_[next_++];
        y ^= y >> 11;
        y ^= (y << 7) & 0x9d2c5680u;
        y ^= (y << 15) & 0xefc60000u;
        return y ^ (y >> 18);
    }

  private:
    static constexpr uint32_t n = 624, middle = 397;

    void generate_seed_sequence(const uint32_t *seed, uint32_t seeds) {
        // The standard's formulas for n words: t = 11, p = (n - t) / 2, q = p + t, m = max(seeds + 1, n) = n.
        constexpr uint32_t t = 11, p = (n - t) / 2, q = p + t;
        for (uint32_t &word : state_) word = 0x8b8b8b8bu;
        for (uint32_t k = 0; k < n; ++k) {
            uint32_t r = mix(1664525u, k, p);
            state_[(k + p) % n] += r;
            r += k == 0 ? seeds : k % n + (k <= seeds ? seed[k - 1] : 0);
            state_[(k + q) % n] += r;
            state_[k % n] = r;
        }
        for (uint32_t k = n; k < 2 * n; ++k) {
            uint32_t x = state_[k % n] + state_[(k + p) % n] + state_[(k - 1) % n];
            x = 1566083941u * (x ^ (x >> 27));
            state_[(k + p) % n] ^= x;
            x -= k % n;
            state_[(k + q) % n] ^= x;
            state_[k % n] = x;
        }
        // The standard replaces a state that is 0, except for 31 bits of the first word that the generator ignores, by
        // 2^31. No seed is known to give such a state, but the rule costs only one pass.
        uint32_t any = state_[0] & 0x80000000u;
        for (uint32_t k = 1; k < n; ++k) any |= state_[k];
        if (any == 0) state_[0] = 0x80000000u;
        next_ = n;
    }
    uint32_t mix(uint32_t factor, uint32_t k, uint32_t p) const {
        const uint32_t x = state_[k % n] ^ state_[(k + p) % n] ^ state_[(k + n - 1) % n];
        return factor * (x ^ (x >> 27));
    }
    void refill() {
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t y = (state_[i] & 0x80000000u) | (state_[(i + 1) % n] & 0x7fffffffu);
            state_[i] = state_[(i + middle) % n] ^ (y >> 1) ^ ((y & 1) ? 0x9908b0dfu : 0);
        }
        next_ = 0;
    }

    uint32_t state_[n], next_ = n;
};

// PCG-XSH-RR 64/32 (O'Neill 2014): a sequence from 64 bits of state, for the path tracer (`--reference`) and for delta
// tracking.
class Pcg32 {
  public:
    explicit Pcg32(uint64_t seed) : state_(seed) { (*this)(); }

    uint32_t operator()() {
        const uint64_t old = state_;
        state_ = old * 6364136223846793005u + 1442695040888963407u;
        const uint32_t x = static_cast<uint32_t>(((old >> 18) ^ old) >> 27), turn = static_cast<uint32_t>(old >> 59);
        return x >> turn | x << (-turn & 31);
    }

  private:
    uint64_t state_;
};

// The random bits of one event of a photon: its emission is event 0, its first flight event 1, and so on. draw() turns
// them into a 32-bit number for each dimension.
struct Event {
    uint32_t low, high;
};

// splitmix64's finaliser (Steele, Lea, Flood 2014; Vigna's constants) of the event's number and the key. The key is
// scrambled first. If it were only added, keys that differ by a multiple of the increment would share events.
inline Event photon_event(uint64_t key, uint64_t event) {
    uint64_t x = key * 0xd6e8feb86659fd93u;
    x = (x ^ (x >> 32)) + (event + 1) * 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    return {static_cast<uint32_t>(x), static_cast<uint32_t>(x >> 32)};
}

// 32 uniform bits for one dimension. In exact collisions (N-X, smoke) the dimension is a particle's canonical index;
// the named dimensions below lie above every index. Only 32-bit operations are used, so that eight particles are one
// vector loop.
inline uint32_t draw(Event event, uint32_t dimension) {
    uint32_t x = (dimension * 0x9e3779b9u) ^ event.low;
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) + event.high;
    x = (x ^ (x >> 16)) * 0x846ca68bu;
    x = (x ^ (x >> 15)) * 0x9e3779b1u;
    return x ^ (x >> 16);
}

enum Dimension : uint32_t {
    dimension_light = 0x80000000u, // the choice of the light, then position and direction of the emission
    dimension_position_1,
    dimension_position_2,
    dimension_direction_1,
    dimension_direction_2,
    dimension_radius,
    dimension_survival, // Russian roulette, then the new direction
    dimension_phase,
    dimension_azimuth,
    dimension_rank, // in a photon map that is thinned out
};

} // namespace wisp
