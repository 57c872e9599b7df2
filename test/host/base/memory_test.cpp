// What a Linux kernel says of memory in its files, in a folder made up like them.
#include "host/base/error.h"
#include "host/base/memory.h"
#include "support/temporary_folder.h"
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>

using namespace wisp;

namespace {

constexpr uint64_t megabyte = 1 << 20;

struct Kernel : TemporaryFolder {
    void says(const std::string &name, const std::string &text) {
        std::filesystem::create_directories(std::filesystem::path(file(name)).parent_path());
        std::ofstream(file(name)) << text;
    }
    uint64_t available() const { return available_memory(file("proc"), file("groups")); }
};

} // namespace

TEST_CASE("memory: what the machine has left, and swap") {
    Kernel kernel;
    kernel.says("proc/meminfo", "MemTotal:  2048 kB\nMemFree:   5 kB\nMemAvailable:    1024 kB\nSwapFree: 512 kB\n");
    CHECK(kernel.available() == 1536 * 1024);
    kernel.says("proc/meminfo", "MemTotal:  2048 kB\nMemAvailable:    0 kB\n");
    CHECK(kernel.available() == 0);
}

TEST_CASE("memory: without files of a kernel it is all memory of the machine") {
    const Kernel kernel;
    CHECK(kernel.available() > 16 * megabyte);
}

TEST_CASE("memory: the least of the control groups around the process, without pages that can be given back") {
    Kernel kernel;
    kernel.says("proc/meminfo", "MemAvailable: 1048576 kB\n");
    kernel.says("proc/self/cgroup", "0::/jobs/render\n");
    kernel.says("groups/jobs/render/memory.max", "max\n");
    kernel.says("groups/jobs/render/memory.current", "1000000\n");
    CHECK(kernel.available() == 1024 * megabyte);
    kernel.says("groups/jobs/memory.max", "8000000\n");
    kernel.says("groups/jobs/memory.current", "3000000\n");
    CHECK(kernel.available() == 5000000);
    kernel.says("groups/jobs/memory.stat", "anon 7\nfile 2000001\ninactive_file 2000000\n");
    CHECK(kernel.available() == 7000000);
    kernel.says("groups/jobs/render/memory.max", "999999\n");
    CHECK(kernel.available() == 0);
}

TEST_CASE("memory: control groups of version 1, those of a container, whose own name is not there") {
    Kernel kernel;
    kernel.says("proc/meminfo", "MemAvailable: 1048576 kB\n");
    kernel.says("proc/self/cgroup", "5:devices:/\n4:cpu,memory:/docker/7f3a\n0::/\n");
    kernel.says("groups/memory/memory.limit_in_bytes", "6000000\n");
    kernel.says("groups/memory/memory.usage_in_bytes", "2500000\n");
    kernel.says("groups/memory/memory.stat", "total_inactive_file 500000\n");
    CHECK(kernel.available() == 4000000);
}

TEST_CASE("memory: what needs more than there is is refused in one line") {
    require_memory("a.vtk", "the file", megabyte);
    try {
        require_memory("a.vtk", "the file", UINT64_MAX);
        CHECK(false);
    } catch (const Error &error) {
        CHECK(error.status == exit_memory);
        CHECK(error.place == "a.vtk");
        CHECK(error.text.rfind("the file needs 18446744073709551615 bytes, expected at most the ", 0) == 0);
    }
}
