// All memory of the core comes from one Arena over a block that the caller hands in (design: no heap).
// Invariant: base <= used <= peak <= size; what lies below `used` belongs to live arrays, in the order they were made.
#pragma once
#include <cstddef>
#include <cstdint>

namespace wisp {

class Arena {
  public:
    // `block` of `size` bytes stays the caller's; it must outlive every array made from it. Any alignment will do.
    Arena(void *block, size_t size) : base_(static_cast<unsigned char *>(block)), size_(size) {}

    // `count` uninitialised objects of a trivial type, aligned to a cache line; nullptr when they do not fit.
    // A count of 0 gives a valid pointer to nothing.
    template <class T> T *make(size_t count) {
        const size_t start = aligned(used_);
        if (start > size_ || count > (size_ - start) / sizeof(T)) return nullptr;
        used_ = start + count * sizeof(T);
        if (used_ > peak_) peak_ = used_;
        if (used_ > stage_peak_) stage_peak_ = used_;
        return reinterpret_cast<T *>(base_ + start);
    }

    // A place to return to: `rewind(mark())` frees everything that was made in between.
    size_t mark() const { return used_; }
    void rewind(size_t mark) { used_ = mark; }
    size_t size() const { return size_; }
    size_t peak() const { return peak_; }
    void begin_stage() { stage_peak_ = used_; }
    size_t stage_peak() const { return stage_peak_; } // the most that was in use since then

    // The bytes that make<T>(count) takes at most, for plans: the objects and the gap before them.
    template <class T> static constexpr uint64_t bytes(uint64_t count) { return count * sizeof(T) + alignment; }

  private:
    static constexpr size_t alignment = 64;
    size_t aligned(size_t offset) const {
        const uintptr_t address = reinterpret_cast<uintptr_t>(base_) + offset;
        return offset + static_cast<size_t>((alignment - address % alignment) % alignment);
    }

    unsigned char *base_;
    size_t size_, used_ = 0, peak_ = 0, stage_peak_ = 0;
};

} // namespace wisp
