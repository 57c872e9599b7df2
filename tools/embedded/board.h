// What a board gives to a program: here one in qemu, whose debugger prints and keeps files for it (semihosting).
// For a board of your own, write these again.
#pragma once
#include <cstddef>
#include <cstdint>

namespace board {

void print(const char *text);

// A file that is written anew. close() says whether all of it is there.
class File {
  public:
    explicit File(const char *name);
    void write(const void *bytes, size_t size);
    void go_to(size_t position); // of the byte that is written next
    bool close();

  private:
    uint32_t handle_;
    bool good_;
};

[[noreturn]] void leave(int status);

// Since the program began. Of the Cortex-M it is asked at least once in 40 * 2^32 of them.
uint64_t instructions();

// Bytes of the stack that have been in use at most since begin_stack_peak(); and all that there are.
void begin_stack_peak();
size_t stack_peak();
size_t stack_size();

} // namespace board
