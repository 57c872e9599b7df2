// The mode word of a triangle, 32 bits (C1): its occlusion mode, and its shadow mode for each of 15 lights.
//
//   31 30 29                   4 3   2 1         0
//  | l14 | l13 | ... | l2 | l1 |  l0  | occlusion |
//
// The shadow mode of light i has bits 2 i + 3 and 2 i + 2. Lights beyond the fifteenth have none.
#pragma once
#include <cstdint>

namespace wisp {

enum class OcclusionMode : uint32_t { init, partially_occluded, fully_rendered, dynamic };

// Two bits: some ray was blocked (full); some ray reached the light (none); both (partial).
enum class ShadowMode : uint32_t { init, full, none, partial };
static_assert(static_cast<uint32_t>(ShadowMode::partial) ==
                  (static_cast<uint32_t>(ShadowMode::full) | static_cast<uint32_t>(ShadowMode::none)),
              "answers of rays are or-ed together (C4)");

class ModeWord {
  public:
    static constexpr uint32_t lights = 15;

    constexpr OcclusionMode occlusion() const { return static_cast<OcclusionMode>(bits_ & 3); }
    constexpr void set_occlusion(OcclusionMode mode) { bits_ = (bits_ & ~3u) | static_cast<uint32_t>(mode); }
    constexpr ShadowMode shadow(uint32_t light) const { return static_cast<ShadowMode>((bits_ >> place(light)) & 3); }
    constexpr void add_shadow(uint32_t light, bool hit) {
        bits_ |= static_cast<uint32_t>(hit ? ShadowMode::full : ShadowMode::none) << place(light);
    }
    constexpr void forget_shadow(uint32_t light) { bits_ &= ~(3u << place(light)); }
    constexpr uint32_t bits() const { return bits_; }

  private:
    static constexpr uint32_t place(uint32_t light) { return 2 + 2 * light; }
    uint32_t bits_ = 0;
};
static_assert(sizeof(ModeWord) == 4, "one word");
static_assert(2 + 2 * ModeWord::lights == 32, "no bit is left over");

} // namespace wisp
