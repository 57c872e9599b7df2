// The system's own calls: they give errno, which is the reason that the user sees.
#include "host/base/error.h"
#include "host/base/files.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <dirent.h>
#include <fcntl.h>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace wisp {
namespace {

// Of errno. A lack of memory is one, whatever lacks it.
std::string reason() {
    if (errno == ENOMEM) throw std::bad_alloc();
    return std::strerror(errno);
}

[[noreturn]] void fail_output(const std::string &path) {
    throw Error(exit_output, path, "could not be written: " + reason());
}

[[noreturn]] void fail_opening(const std::string &path) { throw InputError(path, "cannot be opened: " + reason()); }
[[noreturn]] void fail_reading(const std::string &path) { throw InputError(path, "cannot be read: " + reason()); }

// Calls again where a signal that did not end the process has interrupted the call.
template <class Call> auto uninterrupted(Call &&call) {
    auto result = call();
    while (result < 0 && errno == EINTR) result = call();
    return result;
}

// A file that is closed at the end; below 0 with errno if it could not be opened.
class File {
  public:
    File(const std::string &path, int flags)
        : number_(uninterrupted([&] { return open(path.c_str(), flags | O_CLOEXEC, 0666); })) {}
    ~File() {
        const int why = errno;
        if (number_ >= 0) close(number_);
        errno = why;
    }
    File(const File &) = delete;
    File &operator=(const File &) = delete;
    operator int() const { return number_; }

  private:
    int number_;
};

// False with errno if not all of it was written.
bool write_all(int file, const void *data, size_t size) {
    for (const char *next = static_cast<const char *>(data); size > 0;) {
        const ssize_t count = uninterrupted([&] { return write(file, next, size); });
        if (count == 0) errno = EIO; // a device that takes nothing
        if (count <= 0) return false;
        next += count;
        size -= static_cast<size_t>(count);
    }
    return true;
}

// Waits until the file's bytes are on the disk: a power cut after a rename must not leave the new name of an empty
// file. Some file systems cannot tell.
bool reach_disk(int file) {
    return uninterrupted([&] { return fsync(file); }) == 0 || errno == EINVAL;
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

// Whether that is the file of this name. If not, errno is ENOENT, or why it cannot be told.
bool is_open_at(int file, const std::string &path) {
    struct stat open, there;
    if (fstat(file, &open) != 0 || stat(path.c_str(), &there) != 0) return false;
    errno = ENOENT;
    return open.st_dev == there.st_dev && open.st_ino == there.st_ino;
}

// Blocks the signals that end the process for the life of this object, so that no PATH.part is left.
class SignalsHeld {
  public:
    SignalsHeld() {
        sigset_t held;
        sigemptyset(&held);
        for (int signal : {SIGHUP, SIGINT, SIGTERM}) sigaddset(&held, signal);
        sigprocmask(SIG_BLOCK, &held, &before_);
    }
    ~SignalsHeld() { sigprocmask(SIG_SETMASK, &before_, nullptr); }
    SignalsHeld(const SignalsHeld &) = delete;
    SignalsHeld &operator=(const SignalsHeld &) = delete;

  private:
    sigset_t before_;
};

// Writes the file `aside` and renames it. Several processes that write the same file do so one after another; on a file
// system without locks they do not wait. False with errno if it fails, and then nothing is left aside.
bool write_and_rename(const std::string &aside, const std::string &path, const void *data, size_t size) {
    for (;;) {
        const File file(aside, O_WRONLY | O_CREAT);
        if (file < 0) return false;
        uninterrupted([&] { return flock(file, LOCK_EX); });
        const bool mine = is_open_at(file, aside);
        if (!mine && errno == ENOENT) continue; // the process before has renamed it
        if (mine && uninterrupted([&] { return ftruncate(file, 0); }) == 0 && write_all(file, data, size) &&
            reach_disk(file) && std::rename(aside.c_str(), path.c_str()) == 0)
            return true;
        const int why = errno;
        std::remove(aside.c_str());
        errno = why;
        return false;
    }
}

void write_bytes(const std::string &path, const void *data, size_t size) {
    if (is_special(path)) {
        const File file(path, O_WRONLY);
        if (file < 0 || !write_all(file, data, size)) fail_output(path);
        return;
    }
    const SignalsHeld held;
    if (!write_and_rename(aside_of(path), path, data, size)) fail_output(path);
}

// Removes PATH.part, opened with the further `flags`, unless another process is writing it. What O_EXCL has made here
// goes on a file system without locks, too. False with errno if it cannot be opened.
bool remove_aside(const std::string &path, int flags) {
    const std::string aside = aside_of(path);
    const File file(aside, O_WRONLY | O_NONBLOCK | flags);
    if (file < 0) return false;
    const bool made = flags & O_EXCL, locked = uninterrupted([&] { return flock(file, LOCK_EX | LOCK_NB); }) == 0;
    if (!locked && (!made || errno == EWOULDBLOCK)) return true;
    if (is_open_at(file, aside) || (made && errno != ENOENT)) std::remove(aside.c_str());
    return true;
}

} // namespace

Bytes read_file(const std::string &path) {
    const File file(path, O_RDONLY);
    if (file < 0) fail_opening(path);
    Bytes bytes;
    const auto reserve = [&](uint64_t size) {
        require_memory(path, "the file", size);
        bytes.reserve(size);
    };
    struct stat status;
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode)) reserve(static_cast<uint64_t>(status.st_size));
    uint8_t block[65536];
    ssize_t count;
    while ((count = uninterrupted([&] { return read(file, block, sizeof block); })) > 0) {
        if (bytes.capacity() - bytes.size() < static_cast<size_t>(count))
            reserve(2 * bytes.capacity() + sizeof block); // a pipe, or it grows
        bytes.insert(bytes.end(), block, block + count);
    }
    if (count < 0) fail_reading(path);
    return bytes;
}

Bytes read_beginning(const std::string &path, size_t most) {
    const File file(path, O_RDONLY);
    if (file < 0) fail_opening(path);
    Bytes bytes(most);
    size_t size = 0;
    ssize_t count = 1;
    for (; size < most && count > 0; size += static_cast<size_t>(count)) {
        count = uninterrupted([&] { return read(file, bytes.data() + size, most - size); });
        if (count < 0) fail_reading(path);
    }
    bytes.resize(size);
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
        const SignalsHeld held;
        if (!remove_aside(path, O_CREAT | O_EXCL) && (errno != EEXIST || !remove_aside(path, 0))) fail_output(path);
        return;
    }
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        errno = EISDIR;
    else if (access(path.c_str(), W_OK) == 0)
        return;
    fail_output(path);
}

void tidy_up(const std::string &path) { remove_aside(path, 0); }

std::vector<int64_t> numbers_of_files(const std::string &pattern) {
    const std::filesystem::path path = pattern;
    const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
    std::vector<int64_t> numbers;
    DIR *opened;
    do opened = opendir(folder.c_str());
    while (!opened && errno == EINTR);
    const std::unique_ptr<DIR, int (*)(DIR *)> entries(opened, closedir);
    if (!entries && errno == ENOENT) return numbers;
    const auto next = [&] {
        errno = 0;
        return readdir(entries.get());
    };
    while (const dirent *entry = entries ? next() : nullptr)
        if (const auto number = number_in(path.filename().string(), entry->d_name)) numbers.push_back(*number);
    // A part of a sequence would be taken for all of it.
    if (errno != 0) fail_reading(folder);
    std::sort(numbers.begin(), numbers.end());
    return numbers;
}

} // namespace wisp
