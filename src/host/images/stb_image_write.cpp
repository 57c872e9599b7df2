// The one place where stb_image_write is compiled. Only what goes to memory: files are written by files.h.
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
