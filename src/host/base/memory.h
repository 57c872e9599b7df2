// How much memory this process can still take. A system that has promised more than it has ends a process without an
// error, so this is asked before every large allocation.
#pragma once
#include <cstdint>
#include <string>

namespace wisp {

// The least of what the machine has left, of what the process's control groups leave it, and of the address space that
// it may still map. `proc` and `groups` are the folders in which a Linux kernel says so; elsewhere, the machine's
// memory.
uint64_t available_memory(const std::string &proc = "/proc", const std::string &groups = "/sys/fs/cgroup");

// Throws Error(exit_memory) `PLACE: WHAT needs BYTES bytes, ...` if that is more than is available.
void require_memory(const std::string &place, const std::string &what, uint64_t bytes);

} // namespace wisp
