// Files are read whole, and written whole or not at all.
#include "host/base/error.h"
#include "host/base/files.h"
#include "support/data.h"
#include "support/temporary_folder.h"
#include <cerrno>
#include <csignal>
#include <cstring>
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace wisp;

namespace {

// The status and the line of the error that `action` throws; status -1 when it throws none.
template <class Action> Error error_of(Action action) {
    try {
        action();
    } catch (const Error &error) {
        return error;
    }
    return Error(static_cast<Exit>(-1), "no error");
}

Bytes all_byte_values(size_t count) {
    Bytes bytes(count);
    for (size_t i = 0; i < count; ++i) bytes[i] = static_cast<uint8_t>(i * 7);
    return bytes;
}

} // namespace

TEST_CASE("files: what is written is read back, byte for byte") {
    TemporaryFolder folder;
    for (const size_t size : {0, 1, 65535, 65536, 65537, 200000}) {
        const Bytes bytes = all_byte_values(size);
        write_file(folder.file("data"), bytes);
        CHECK(read_file(folder.file("data")) == bytes);
        CHECK(read_beginning(folder.file("data"), 65536) ==
              Bytes(bytes.begin(), bytes.begin() + std::min<long>(size, 65536)));
        CHECK(folder.entries() == 1);
    }
    write_file(folder.file("data"), std::string("text\n"));
    CHECK(read_file(folder.file("data")) == Bytes{'t', 'e', 'x', 't', '\n'});
}

TEST_CASE("files: what cannot be read is an input error with the reason") {
    TemporaryFolder folder;
    const Error missing = error_of([&] { read_file(folder.file("none")); });
    CHECK(missing.status == exit_input);
    CHECK(missing.what() == folder.file("none") + ": cannot be opened: " + std::strerror(ENOENT));

    const Error is_folder = error_of([&] { read_file(folder.file(".")); });
    CHECK(is_folder.status == exit_input);
    CHECK(is_folder.what() == folder.file(".") + ": cannot be read: " + std::strerror(EISDIR));
}

TEST_CASE("files: a folder that cannot be written to is an output error, and nothing is left") {
    TemporaryFolder folder;
    const Error missing = error_of([&] { write_file(folder.file("none/out.png"), Bytes{1, 2, 3}); });
    CHECK(missing.status == exit_output);
    CHECK(missing.what() == folder.file("none/out.png") + ": could not be written: " + std::strerror(ENOENT));
    CHECK(folder.entries() == 0);

    write_file(folder.file("plain"), Bytes{1});
    const Error not_folder = error_of([&] { write_file(folder.file("plain/out.png"), Bytes{1, 2, 3}); });
    CHECK(not_folder.status == exit_output);
    CHECK(not_folder.what() == folder.file("plain/out.png") + ": could not be written: " + std::strerror(ENOTDIR));

    const Error is_folder = error_of([&] { write_file(folder.file("."), Bytes{1, 2, 3}); });
    CHECK(is_folder.what() == folder.file(".") + ": could not be written: " + std::strerror(EISDIR));
    CHECK(folder.entries() == 1);
}

TEST_CASE("files: when writing fails half way, the old file stays and nothing is left aside") {
    TemporaryFolder folder;
    const std::string path = folder.file("picture.pfm");
    write_file(path, Bytes{1, 2, 3});

    rlimit old_limit;
    REQUIRE(getrlimit(RLIMIT_FSIZE, &old_limit) == 0);
    const auto old_handler = std::signal(SIGXFSZ, SIG_IGN); // then write() fails with EFBIG, like a full disk
    rlimit limit = old_limit;
    limit.rlim_cur = 10000;
    REQUIRE(setrlimit(RLIMIT_FSIZE, &limit) == 0);
    const Error large = error_of([&] { write_file(path, all_byte_values(20000)); });
    setrlimit(RLIMIT_FSIZE, &old_limit);
    std::signal(SIGXFSZ, old_handler);

    CHECK(large.status == exit_output);
    CHECK(large.what() == path + ": could not be written: " + std::strerror(EFBIG));
    CHECK(read_file(path) == Bytes{1, 2, 3});
    CHECK(folder.entries() == 1);
}

TEST_CASE("files: a device is written to, not replaced") {
    TemporaryFolder folder;
    const std::string null = folder.file("null"), full = folder.file("full");
    std::filesystem::create_symlink("/dev/null", null); // links: a mistake shall not cost the machine its devices
    write_file(null, Bytes{1, 2, 3});
    CHECK(std::filesystem::is_symlink(null));
    if (!std::filesystem::is_character_file("/dev/full")) return skip_case("there is no /dev/full");
    std::filesystem::create_symlink("/dev/full", full);
    const Error error = error_of([&] { write_file(full, Bytes{1, 2, 3}); });
    CHECK(error.status == exit_output);
    CHECK(error.what() == full + ": could not be written: " + std::strerror(ENOSPC));
}

TEST_CASE("files: a trial says what writing would, and leaves nothing") {
    TemporaryFolder folder;
    write_file(folder.file("plain"), Bytes{1});
    for (const std::string name : {"none/out.png", "plain/out.png", "."}) {
        CAPTURE(name);
        const Error written = error_of([&] { write_file(folder.file(name), Bytes{1, 2, 3}); });
        const Error tried = error_of([&] { check_writable(folder.file(name)); });
        CHECK(tried.status == exit_output);
        CHECK(std::string(tried.what()) == written.what());
    }
    check_writable(folder.file("plain"));
    check_writable(folder.file("new"));
    check_writable("/dev/null");
    CHECK(folder.entries() == 1);
    CHECK(read_file(folder.file("plain")) == Bytes{1});
    write_file(folder.file("new.part"), Bytes{2}); // of a killed process
    check_writable(folder.file("new"));
    CHECK(folder.entries() == 1);
}

TEST_CASE("files: a signal that ends nothing interrupts neither reading nor writing") {
    TemporaryFolder folder;
    const std::string pipe = folder.file("pipe");
    REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
    const Bytes bytes = all_byte_values(200000); // more than the pipe holds
    // While the other end of the pipe waits, this process waits, and is interrupted.
    const auto interrupted = [&](int other_end, auto &&action) {
        const pid_t child = fork();
        if (child == 0) {
            const int file = open(pipe.c_str(), other_end);
            usleep(30000);
            Bytes moved = bytes;
            ssize_t count = 0;
            for (size_t at = 0; at < moved.size(); at += static_cast<size_t>(count)) {
                const size_t left = moved.size() - at;
                count = other_end == O_RDONLY ? read(file, &moved[at], left) : write(file, &moved[at], left);
                if (count <= 0) _exit(1);
            }
            _exit(moved != bytes);
        }
        struct sigaction tick = {}, old;
        tick.sa_handler = [](int) {}; // without SA_RESTART
        sigaction(SIGALRM, &tick, &old);
        const itimerval often = {{0, 1000}, {0, 1000}}, never = {};
        setitimer(ITIMER_REAL, &often, nullptr);
        const Error error = error_of(action);
        setitimer(ITIMER_REAL, &never, nullptr);
        sigaction(SIGALRM, &old, nullptr);
        int status = -1;
        waitpid(child, &status, 0);
        CHECK(error.what() == std::string("no error"));
        CHECK(status == 0);
    };
    Bytes got;
    interrupted(O_WRONLY, [&] { got = read_file(pipe); });
    CHECK(got == bytes);
    interrupted(O_RDONLY, [&] { write_file(pipe, bytes); });
}

TEST_CASE("files: a folder that cannot be listed is an error, one that is not there has no files") {
    TemporaryFolder folder;
    CHECK(numbers_of_files(folder.file("none/a_%04d.vtk")).empty());
    write_file(folder.file("plain"), Bytes{1});
    const Error error = error_of([&] { numbers_of_files(folder.file("plain/a_%04d.vtk")); });
    CHECK(error.status == exit_input);
    CHECK(error.what() == folder.file("plain") + ": cannot be read: " + std::strerror(ENOTDIR));
}
