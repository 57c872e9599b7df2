// The one place where tinyexr is compiled: with zlib, without the packings that are not read. It does not look for
// memory that it, or zlib, was not given, so a lack of it is an exception.
#include "host/base/memory.h"
#include <algorithm>
#include <cassert>
#include <cstdio>
#include <cstring>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <vector>
#include <zlib.h>

namespace {

int with_memory(int status) {
    if (status == Z_MEM_ERROR) throw std::bad_alloc();
    return status;
}

} // namespace

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wstringop-overflow" // g++ 12, of a vector that grows from nothing
#endif
#define TINYEXR_IMPLEMENTATION
#define TINYEXR_USE_PIZ 0
#define malloc(size)    wisp::malloc_or_throw(size)
#define compress(...)   with_memory(compress(__VA_ARGS__))
#define uncompress(...) with_memory(uncompress(__VA_ARGS__))
#include <tinyexr.h>
