// Decompresses gzip (RFC 1952).
#pragma once
#include "host/base/files.h"
#include <cstddef>
#include <string>

namespace wisp {

// The data may inflate to this many times its size, plus the allowance. Real particle files inflate 1.2 to 6 times;
// deflate could reach 1032 times. So a hostile file takes memory in proportion to its own size.
constexpr size_t gzip_largest_ratio = 256;
constexpr size_t gzip_allowance = 1 << 20;

// Whether the bytes begin as gzip does.
bool is_gzip(const unsigned char *data, size_t size);

// The inflated bytes of one or more gzip members; their check sums and lengths are verified. `name` stands in front of
// errors. Throws InputError `NAME: byte N: ...`, N counted in the gzip file, if the data is damaged, ends early, has
// anything after it, or inflates beyond the limit above.
Bytes gunzip(const std::string &name, const unsigned char *data, size_t size);

} // namespace wisp
