#include "host/base/error.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <algorithm>
#include <fstream>
#include <optional>
#include <sys/resource.h>
#include <unistd.h>

namespace wisp {
namespace {

uint64_t difference(uint64_t a, uint64_t b) { return a > b ? a - b : 0; }

// The number behind the word `key` of a file of text; without a key, its first word.
std::optional<uint64_t> number_in(const std::string &path, const std::string &key = "") {
    std::ifstream file(path);
    std::string word;
    while (!key.empty() && file >> word && word != key) continue;
    if (!(file >> word)) return std::nullopt;
    const std::optional<int64_t> number = to_integer(word);
    return number && *number >= 0 ? std::optional<uint64_t>(*number) : std::nullopt;
}

// Of the machine: free, or held for files that can be read again, or free for pages that are swapped out.
uint64_t left_on_machine(const std::string &proc) {
    constexpr uint64_t unit = 1024;
    const std::string file = proc + "/meminfo";
    if (const auto left = number_in(file, "MemAvailable:"))
        return (*left + number_in(file, "SwapFree:").value_or(0)) * unit;
    return static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

// Of one control group. Pages of files that have not been read of late are given back.
uint64_t left_in_group(const std::string &folder, const char *limit, const char *usage, const char *reclaimable) {
    const auto most = number_in(folder + limit), used = number_in(folder + usage);
    if (!most || !used) return UINT64_MAX;
    return difference(*most, difference(*used, number_in(folder + "/memory.stat", reclaimable).value_or(0)));
}

// Of the process's control groups and those around them, of both versions. In a container the names may be those
// outside, whose folders are not there: the outermost then is the container's.
uint64_t left_in_groups(const std::string &proc, const std::string &groups) {
    uint64_t left = UINT64_MAX;
    std::ifstream file(proc + "/self/cgroup");
    for (std::string line; std::getline(file, line);) { // NUMBER:CONTROLLERS:PATH
        const std::vector<std::string> parts = split(line, ':');
        if (parts.size() != 3) continue;
        const std::vector<std::string> controllers = split(parts[1], ',');
        const bool second = parts[1].empty();
        if (!second && std::find(controllers.begin(), controllers.end(), "memory") == controllers.end()) continue;
        for (std::string path = parts[2] == "/" ? "" : parts[2];; path.erase(path.rfind('/'))) {
            left =
                std::min(left, second ? left_in_group(groups + path, "/memory.max", "/memory.current", "inactive_file")
                                      : left_in_group(groups + "/memory" + path, "/memory.limit_in_bytes",
                                                      "/memory.usage_in_bytes", "total_inactive_file"));
            if (path.rfind('/') == std::string::npos) break;
        }
    }
    return left;
}

// Of the addresses that the process may map (ulimit -v).
uint64_t left_of_addresses(const std::string &proc) {
    struct rlimit limit;
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return UINT64_MAX;
    const uint64_t mapped = number_in(proc + "/self/statm").value_or(0) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
    return difference(limit.rlim_cur, mapped);
}

} // namespace

uint64_t available_memory(const std::string &proc, const std::string &groups) {
    return std::min({left_on_machine(proc), left_in_groups(proc, groups), left_of_addresses(proc)});
}

void require_memory(const std::string &place, const std::string &what, uint64_t bytes) {
    constexpr uint64_t small = 1 << 20; // not worth asking the system
    const uint64_t available = bytes <= small ? small : available_memory();
    if (bytes <= available) return;
    throw Error(exit_memory, place,
                what + " needs " + std::to_string(bytes) + " bytes, expected at most the " + std::to_string(available) +
                    " that are available here");
}

} // namespace wisp
