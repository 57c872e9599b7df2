// How much memory this process can still take. A system that has promised more than it has ends a process without an
// error, so this is asked before every large allocation.
#pragma once
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>

namespace wisp {

// The least of what the machine has left, of what the process's control groups leave it, and of the address space that
// it may still map. `proc` and `groups` are the folders in which a Linux kernel says so; elsewhere, the machine's
// memory.
uint64_t available_memory(const std::string &proc = "/proc", const std::string &groups = "/sys/fs/cgroup");

// Throws Error(exit_memory) `PLACE: WHAT needs BYTES bytes, ...` if that is more than is available.
void require_memory(const std::string &place, const std::string &what, uint64_t bytes);

// For C libraries that use memory without a look at whether they got it: throw std::bad_alloc where they did not.
inline void *malloc_or_throw(size_t size) {
    if (void *memory = std::malloc(size)) return memory;
    throw std::bad_alloc();
}
inline void *realloc_or_throw(void *old, size_t size) {
    if (void *memory = std::realloc(old, size)) return memory;
    throw std::bad_alloc();
}

} // namespace wisp
