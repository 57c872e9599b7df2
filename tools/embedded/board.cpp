// Cortex-M: the table of exceptions, what happens before main(), semihosting.
#include "board.h"

int main();

// Where things are: an385.ld.
extern "C" {
extern uint32_t data_begin[], data_end[], data_image[], bss_begin[], bss_end[], stack_begin[], stack_end[];
extern void (*const constructors_begin[])(), (*const constructors_end[])();
[[noreturn]] void reset();
}

namespace board {

namespace {

constexpr uint32_t unused = 0xdeadbeef; // words of the stack that nobody has written

// Of a CMSDK timer: it counts down from `value`, and from `reload` again.
struct Timer {
    volatile uint32_t control, value, reload;
};
Timer &timer() { return *reinterpret_cast<Timer *>(0x40000000); }

enum Call : uint32_t { open_file = 1, close_file = 2, write_text = 4, write_bytes = 5, exit_with = 0x20 };

// What the debugger answers.
uint32_t ask(Call call, const void *arguments) {
    register uint32_t r0 __asm__("r0") = call;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

[[noreturn]] void fault() {
    print("a fault of the processor\n");
    leave(2);
}

} // namespace

void print(const char *text) { ask(write_text, text); }

File::File(const char *name) {
    uint32_t length = 0;
    while (name[length]) ++length;
    const struct { // mode 5: "wb"
        const char *name;
        uint32_t mode, length;
    } arguments = {name, 5, length};
    handle_ = ask(open_file, &arguments);
    good_ = handle_ != UINT32_MAX;
}
void File::write(const void *bytes, size_t size) {
    const struct {
        uint32_t handle;
        const void *bytes;
        size_t size;
    } arguments = {handle_, bytes, size};
    good_ = good_ && ask(write_bytes, &arguments) == 0; // so many are missing
}
bool File::close() { return good_ && ask(close_file, &handle_) == 0; }

void leave(int status) {
    const struct {
        uint32_t reason;
        int status;
    } exit = {0x20026, status}; // the application's own exit
    ask(exit_with, &exit);
    for (;;) {
    }
}

uint64_t instructions() { return uint64_t{40} * (UINT32_MAX - timer().value); }

size_t stack_size() { return reinterpret_cast<uintptr_t>(stack_end) - reinterpret_cast<uintptr_t>(stack_begin); }
size_t stack_peak() {
    const uint32_t *word = stack_begin;
    while (*word == unused) ++word;
    return reinterpret_cast<uintptr_t>(stack_end) - reinterpret_cast<uintptr_t>(word);
}

} // namespace board

// What a Cortex-M looks at when it is switched on: where the stack begins, and what to call.
using Handler = void (*)();
__attribute__((section(".vectors"), used)) const Handler vectors[16] = {reinterpret_cast<Handler>(stack_end),
                                                                        reset,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault,
                                                                        board::fault};

// C++ begins with its variables set: those with values copied from the code, the others 0, constructors run.
void reset() {
#if defined(__ARM_FP)
    *reinterpret_cast<volatile uint32_t *>(0xe000ed88) |= 0xf << 20; // switches the FPU on
#endif
    uint32_t *top;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    for (uint32_t *word = stack_begin; word < top; ++word) *word = board::unused;
    for (uint32_t *to = data_begin, *from = data_image; to < data_end;) *to++ = *from++;
    for (uint32_t *word = bss_begin; word < bss_end;) *word++ = 0;
    board::timer().reload = UINT32_MAX;
    board::timer().value = UINT32_MAX;
    board::timer().control = 1;
    for (auto make = constructors_begin; make < constructors_end;) (*make++)();
    board::leave(main());
}
