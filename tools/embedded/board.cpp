// A board in qemu: what happens before main(), semihosting, the stack.
#include "board.h"
#include "processor.h"

int main();

// Where things are: the linker scripts.
extern "C" {
extern uint32_t data_begin[], data_end[], data_image[], bss_begin[], bss_end[], stack_begin[], stack_end[];
extern void (*const constructors_begin[])(), (*const constructors_end[])();
}

namespace board {

namespace {

constexpr uint32_t unused = 0xdeadbeef; // words of the stack that nobody has written

enum Call : uint32_t { open_file = 1, close_file = 2, write_text = 4, write_bytes = 5, seek = 10, exit_with = 0x20 };

} // namespace

void print(const char *text) { processor::ask(write_text, text); }

File::File(const char *name) {
    uint32_t length = 0;
    while (name[length]) ++length;
    const struct { // mode 5: "wb"
        const char *name;
        uint32_t mode, length;
    } arguments = {name, 5, length};
    handle_ = processor::ask(open_file, &arguments);
    good_ = handle_ != UINT32_MAX;
}
void File::write(const void *bytes, size_t size) {
    const struct {
        uint32_t handle;
        const void *bytes;
        size_t size;
    } arguments = {handle_, bytes, size};
    good_ = good_ && processor::ask(write_bytes, &arguments) == 0; // so many are missing
}
void File::go_to(size_t position) {
    const struct {
        uint32_t handle;
        size_t position;
    } arguments = {handle_, position};
    good_ = good_ && processor::ask(seek, &arguments) == 0;
}
bool File::close() { return good_ && processor::ask(close_file, &handle_) == 0; }

void leave(int status) {
    const struct {
        uint32_t reason;
        int status;
    } exit = {0x20026, status}; // the application's own exit
    processor::ask(exit_with, &exit);
    for (;;) {
    }
}

size_t stack_size() { return reinterpret_cast<uintptr_t>(stack_end) - reinterpret_cast<uintptr_t>(stack_begin); }
__attribute__((noinline)) void begin_stack_peak() {
    uint32_t *const top = static_cast<uint32_t *>(__builtin_frame_address(0)) - 32; // below what this function has
    for (uint32_t *word = stack_begin; word < top; ++word) *word = unused;
}
size_t stack_peak() {
    const uint32_t *word = stack_begin;
    while (*word == unused) ++word;
    return reinterpret_cast<uintptr_t>(stack_end) - reinterpret_cast<uintptr_t>(word);
}

} // namespace board

void fault() {
    board::print("a fault of the processor\n");
    board::leave(2);
}

// C++ begins with its variables set: those with values copied from the code, the others 0, constructors run.
void start() {
    for (uint32_t *to = data_begin, *from = data_image; to < data_end;) *to++ = *from++;
    for (uint32_t *word = bss_begin; word < bss_end;) *word++ = 0;
    processor::begin();
    for (auto make = constructors_begin; make < constructors_end;) (*make++)();
    board::leave(main());
}
