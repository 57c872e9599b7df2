// OpenVDB files, through the program vdb_to_nvdb (tools/vdb).
#include "host/base/error.h"
#include "host/base/memory.h"
#include "host/formats/volume_readers.h"
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/wait.h>
#include <unistd.h>

namespace wisp {
namespace {

constexpr unsigned char magic[] = {0x20, 0x42, 0x44, 0x56, 0, 0, 0, 0};

// Beside this program where both were built, or where `make install` puts it.
std::string converter() {
    std::error_code fault;
    const auto folder = std::filesystem::read_symlink("/proc/self/exe", fault).parent_path();
    const auto installed = folder.parent_path() / "libexec/wisp/vdb_to_nvdb";
    return (std::filesystem::exists(installed, fault) ? installed : folder / "vdb_to_nvdb").string();
}

// What the program writes about the file to its standard output, and its status. Its standard error is this process's.
int output_of(const std::string &program, const std::string &path, Bytes &output) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw InputError(path, "no pipe to vdb_to_nvdb, expected one");
    const pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDOUT_FILENO);
        execl(program.c_str(), program.c_str(), path.c_str(), static_cast<char *>(nullptr));
        _exit(127);
    }
    close(ends[1]);
    if (child < 0) {
        close(ends[0]);
        throw InputError(path, "no process for vdb_to_nvdb, expected one");
    }
    constexpr size_t at_once = 1 << 20;
    for (ssize_t got = 1; got > 0;) {
        const size_t size = output.size();
        output.resize(size + at_once);
        do got = read(ends[0], output.data() + size, at_once);
        while (got < 0 && errno == EINTR);
        output.resize(size + static_cast<size_t>(got > 0 ? got : 0));
    }
    close(ends[0]);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return status;
}

} // namespace

bool is_vdb(const unsigned char *data, size_t size) {
    return size >= sizeof magic && std::memcmp(data, magic, sizeof magic) == 0;
}

Bytes nvdb_of_vdb(const std::string &path) {
    const std::string program = converter();
    if (access(program.c_str(), X_OK) != 0)
        throw InputError(path, "an OpenVDB file, expected " + program +
                                   " to read it: install libopenvdb-dev and libboost-dev, then run make; or convert "
                                   "it to .nvdb");
    Bytes bytes;
    const int status = output_of(program, path, bytes);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return bytes;
    if (WIFEXITED(status) && WEXITSTATUS(status) == exit_input)
        throw InputError(path, std::string(bytes.begin(), bytes.end()));
    throw InputError(path, "OpenVDB's library cannot read it and ends the process, expected a sound .vdb file");
}

} // namespace wisp
