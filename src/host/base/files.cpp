// Plain C streams: they give errno, which is the reason that the user sees.
#include "host/base/error.h"
#include "host/base/files.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace wisp {
namespace {

std::string reason() { return std::strerror(errno); }

[[noreturn]] void fail_output(const std::string &path) {
    throw Error(exit_output, path, "could not be written: " + reason());
}

// Opened with `mode`, written and closed without an error; errno says why not.
bool write_whole(const std::string &path, const char *mode, const void *data, size_t size) {
    std::FILE *file = std::fopen(path.c_str(), mode);
    if (!file) return false;
    const bool written = size == 0 || std::fwrite(data, 1, size, file) == size; // of nothing, data may be null
    const int why = errno;
    const bool closed = std::fclose(file) == 0; // buffered bytes meet a full disk only here
    if (!written) errno = why;
    return written && closed;
}

// A device, a pipe or a folder, which a rename must not or cannot replace.
bool is_special(const std::string &path) {
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
}

// The name under which a file is written before it is renamed: always the same, so that the file of a killed process is
// found.
std::string aside_of(const std::string &path) { return path + ".part"; }

bool is_open_at(int file, const std::string &path) {
    struct stat open, there;
    return fstat(file, &open) == 0 && stat(path.c_str(), &there) == 0 && open.st_dev == there.st_dev &&
           open.st_ino == there.st_ino;
}

// Opens `aside` for this process alone: of several processes that write the same file, each waits for the one before.
// On a file system without locks they do not wait. -1 with errno if it cannot be opened.
int claim(const std::string &aside) {
    for (;;) {
        const int file = open(aside.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
        if (file < 0) return file;
        while (flock(file, LOCK_EX) != 0 && errno == EINTR) {
        }
        if (is_open_at(file, aside)) return file;
        close(file); // the process before has renamed it
    }
}

// Blocks the signals that end the process for the life of this object, so that no PATH.part is left.
class Uninterrupted {
  public:
    Uninterrupted() {
        sigset_t held;
        sigemptyset(&held);
        for (int signal : {SIGHUP, SIGINT, SIGTERM}) sigaddset(&held, signal);
        sigprocmask(SIG_BLOCK, &held, &before_);
    }
    ~Uninterrupted() { sigprocmask(SIG_SETMASK, &before_, nullptr); }
    Uninterrupted(const Uninterrupted &) = delete;
    Uninterrupted &operator=(const Uninterrupted &) = delete;

  private:
    sigset_t before_;
};

void write_bytes(const std::string &path, const void *data, size_t size) {
    if (is_special(path)) {
        if (!write_whole(path, "wb", data, size)) fail_output(path);
        return;
    }
    const std::string aside = aside_of(path);
    const Uninterrupted uninterrupted;
    const int claimed = claim(aside);
    if (claimed < 0) fail_output(path);
    const bool done = write_whole(aside, "wb", data, size) && std::rename(aside.c_str(), path.c_str()) == 0;
    const int why = errno;
    if (!done) std::remove(aside.c_str());
    close(claimed);
    errno = why;
    if (!done) fail_output(path);
}

// Removes PATH.part, opened with the further `flags`, unless another process is writing it. False with errno if it
// cannot be opened.
bool remove_aside(const std::string &path, int flags) {
    const std::string aside = aside_of(path);
    const int file = open(aside.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC | flags, 0666);
    if (file < 0) return false;
    if (flock(file, LOCK_EX | LOCK_NB) == 0 && is_open_at(file, aside)) std::remove(aside.c_str());
    close(file);
    return true;
}

} // namespace

Bytes read_file(const std::string &path) {
    std::FILE *file = std::fopen(path.c_str(), "rb");
    if (!file) throw InputError(path, "cannot be opened: " + reason());
    const std::unique_ptr<std::FILE, int (*)(std::FILE *)> closed_at_end(file, std::fclose);
    Bytes bytes;
    const auto reserve = [&](uint64_t size) {
        require_memory(path, "the file", size);
        bytes.reserve(size);
    };
    struct stat status;
    if (fstat(fileno(file), &status) == 0 && S_ISREG(status.st_mode)) reserve(static_cast<uint64_t>(status.st_size));
    uint8_t block[65536];
    size_t count;
    while ((count = std::fread(block, 1, sizeof block, file)) > 0) {
        if (bytes.capacity() - bytes.size() < count)
            reserve(2 * bytes.capacity() + sizeof block); // a pipe, or it grows
        bytes.insert(bytes.end(), block, block + count);
    }
    if (std::ferror(file)) throw InputError(path, "cannot be read: " + reason());
    return bytes;
}

Bytes read_plain_file(const std::string &path) {
    if (is_special(path)) throw InputError(path, "cannot be read: not a plain file");
    return read_file(path);
}

void write_file(const std::string &path, const Bytes &bytes) { write_bytes(path, bytes.data(), bytes.size()); }
void write_file(const std::string &path, const std::string &text) { write_bytes(path, text.data(), text.size()); }

void check_writable(const std::string &path) {
    if (!is_special(path)) {
        const Uninterrupted uninterrupted;
        if (!remove_aside(path, O_CREAT)) fail_output(path);
        return;
    }
    if (std::filesystem::is_directory(path))
        errno = EISDIR;
    else if (access(path.c_str(), W_OK) == 0)
        return;
    fail_output(path);
}

void tidy_up(const std::string &path) { remove_aside(path, 0); }

std::vector<int64_t> numbers_of_files(const std::string &pattern) {
    const std::filesystem::path path = pattern;
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
    std::vector<int64_t> numbers;
    std::error_code error;
    for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
        if (const auto number = number_in(path.filename().string(), entry->path().filename().string()))
            numbers.push_back(*number);
    std::sort(numbers.begin(), numbers.end());
    return numbers;
}

} // namespace wisp
