// Cortex-M: the table of exceptions, Arm's semihosting, a timer of the MPS2 boards.
#include "board.h"
#include "processor.h"

extern "C" {
extern uint32_t stack_end[];
[[noreturn]] void reset();
}

namespace {

// Of a CMSDK timer: it counts down from `value`, and from `reload` again.
struct Timer {
    volatile uint32_t control, value, reload;
};
Timer &timer() { return *reinterpret_cast<Timer *>(0x40000000); }

} // namespace

namespace processor {

uint32_t ask(uint32_t call, const void *arguments) {
    register uint32_t r0 __asm__("r0") = call;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void begin() {
    timer().reload = UINT32_MAX;
    timer().value = UINT32_MAX;
    timer().control = 1;
}

} // namespace processor

// qemu counts 40 to a tick of the board's clock of 25 MHz, which it advances by one nanosecond an instruction (-icount
// shift=0). The timer runs over after 40 * 2^32, so it is read before.
uint64_t board::instructions() {
    static uint64_t ticks = 0;
    ticks += static_cast<uint32_t>(UINT32_MAX - static_cast<uint32_t>(ticks) - timer().value);
    return 40 * ticks;
}

// What a Cortex-M looks at when it is switched on: where the stack begins, and what to call.
using Handler = void (*)();
__attribute__((section(".vectors"), used)) const Handler vectors[16] = {reinterpret_cast<Handler>(stack_end),
                                                                        reset,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault,
                                                                        fault};

void reset() {
#if defined(__ARM_FP)
    *reinterpret_cast<volatile uint32_t *>(0xe000ed88) |= 0xf << 20; // switches the FPU on
#endif
    start();
}
