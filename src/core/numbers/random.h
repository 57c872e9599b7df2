// Random numbers that any machine can draw again. A batch of photons owns an MT19937 seeded from (seed, batch) which
// gives each photon a 64-bit key and nothing else; every draw of the photon is a hash of (key, event, dimension).
// So a batch can be traced anywhere, and a photon that rounds otherwise leaves all other photons untouched.
#pragma once
#include <cstdint>

namespace wisp {

// The generator of Matsumoto and Nishimura, seeded as the C++ standard's mt19937{seed_seq{s0, s1, s2, s3}} is
// ([rand.util.seedseq]), without that class's heap.
class Mt19937 {
  public:
    Mt19937(uint32_t s0, uint32_t s1, uint32_t s2, uint32_t s3) {
        const uint32_t seed[4] = {s0, s1, s2, s3};
        generate_seed_sequence(seed, 4);
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
        // n words wanted: t = 11, p = (n - t) / 2, q = p + t, m = max(seeds + 1, n) = n.
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
        // The standard replaces a state of zeros (but for the top bit) by 2^31; the hash above never gives one for
        // four seeds that a test has not seen, yet the rule costs one pass.
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

// O'Neill's PCG-XSH-RR 64/32: numbers in sequence from a small state, for the paths of `--reference`.
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

// One event of a photon (its emission is event 0, its first flight event 1, ...): 64 bits from which `draw` makes the
// 32-bit numbers of any dimension.
struct Event {
    uint32_t low, high;
};

// splitmix64's finaliser over the event's number and the key. The key is scrambled first: were it only added, keys that
// differ by a multiple of the increment would share the events of one another.
inline Event photon_event(uint64_t key, uint64_t event) {
    uint64_t x = key * 0xd6e8feb86659fd93u;
    x = (x ^ (x >> 32)) + (event + 1) * 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    return {static_cast<uint32_t>(x), static_cast<uint32_t>(x >> 32)};
}

// 32 uniform bits of one dimension. In exact collisions (numerics X) the dimension is a particle's canonical index;
// the named ones below lie above every index. 32-bit operations only, so that a leaf of particles is one vector loop.
inline uint32_t draw(Event event, uint32_t dimension) {
    uint32_t x = (dimension * 0x9e3779b9u) ^ event.low;
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) + event.high;
    x = (x ^ (x >> 16)) * 0x846ca68bu;
    x = (x ^ (x >> 15)) * 0x9e3779b1u;
    return x ^ (x >> 16);
}

enum Dimension : uint32_t {
    dimension_light = 0x80000000u, // which light, then where and whither
    dimension_position_1,
    dimension_position_2,
    dimension_direction_1,
    dimension_direction_2,
    dimension_radius,
    dimension_survival, // roulette, then the new direction
    dimension_phase,
    dimension_azimuth,
};

} // namespace wisp
