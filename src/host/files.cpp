// Plain C streams: they give errno, which is the reason that the user sees.
#include "host/files.h"
#include "host/error.h"
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <unistd.h>

namespace wisp {
namespace {

std::string reason() { return std::strerror(errno); }

[[noreturn]] void fail_output(const std::string &path) {
    throw Error(exit_output, path + ": could not be written: " + reason());
}

// Opened with `mode`, written and closed without an error; errno says why not.
bool write_whole(const std::string &path, const char *mode, const void *data, size_t size) {
    std::FILE *file = std::fopen(path.c_str(), mode);
    if (!file) return false;
    const bool written = size == 0 || std::fwrite(data, 1, size, file) == size; // of nothing, data may be null
    const int why = errno;
    const bool closed = std::fclose(file) == 0; // what was buffered meets a full disk only here
    if (!written) errno = why;
    return written && closed;
}

// A device, a pipe, a folder: something that a rename would replace or cannot replace.
bool is_special(const std::string &path) {
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
}

void write_bytes(const std::string &path, const void *data, size_t size) {
    if (is_special(path)) {
        if (!write_whole(path, "wb", data, size)) fail_output(path);
        return;
    }
    const std::string aside = path + "." + std::to_string(getpid()) + ".part";
    if (write_whole(aside, "wb", data, size) && std::rename(aside.c_str(), path.c_str()) == 0) return;
    const int why = errno;
    std::remove(aside.c_str());
    errno = why;
    fail_output(path);
}

} // namespace

Bytes read_file(const std::string &path) {
    std::FILE *file = std::fopen(path.c_str(), "rb");
    if (!file) throw InputError(path + ": cannot be opened: " + reason());
    Bytes bytes;
    uint8_t block[65536];
    size_t count;
    while ((count = std::fread(block, 1, sizeof block, file)) > 0) bytes.insert(bytes.end(), block, block + count);
    const bool failed = std::ferror(file) != 0;
    const std::string why = reason();
    std::fclose(file);
    if (failed) throw InputError(path + ": cannot be read: " + why);
    return bytes;
}

Bytes read_plain_file(const std::string &path) {
    if (is_special(path)) throw InputError(path + ": cannot be read: not a plain file");
    return read_file(path);
}

void write_file(const std::string &path, const Bytes &bytes) { write_bytes(path, bytes.data(), bytes.size()); }
void write_file(const std::string &path, const std::string &text) { write_bytes(path, text.data(), text.size()); }

} // namespace wisp
