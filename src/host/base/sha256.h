// SHA-256 (FIPS 180-4). Needs no heap and nothing of the standard library but fixed-width integers.
#pragma once
#include <cstddef>
#include <cstdint>

namespace wisp {

// A digest as 64 lower-case hexadecimal digits and a final 0, as sha256sum prints it.
struct HexDigest {
    char text[65];
};

// The digest of a message that arrives in pieces: update() any number of times, then finish() once.
class Sha256 {
  public:
    void update(const void *data, size_t size);
    HexDigest finish();

  private:
    void compress(); // folds the full block into the state

    uint32_t state_[8] = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                          0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    uint64_t length_ = 0;     // bytes seen so far
    uint8_t block_[64] = {0}; // its first length_ % 64 bytes wait for the rest of their block
};

// The digest of `size` bytes.
HexDigest sha256(const void *data, size_t size);

} // namespace wisp
