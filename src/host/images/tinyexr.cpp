// The one place where tinyexr is compiled: with zlib, without the packings that are not read.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wstringop-overflow" // g++ 12, of a vector that grows from nothing
#endif
#define TINYEXR_IMPLEMENTATION
#define TINYEXR_USE_PIZ 0
#include <tinyexr.h>
