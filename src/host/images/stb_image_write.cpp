// The one place where stb_image_write is compiled. Only what goes to memory: files are written by files.h. It writes to
// memory that it was not given, so a lack of it is an exception.
#include "host/base/memory.h"
#define STBIW_MALLOC  wisp::malloc_or_throw
#define STBIW_REALLOC wisp::realloc_or_throw
#define STBIW_FREE    std::free
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
