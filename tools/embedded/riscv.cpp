// RISC-V: where it begins, its semihosting, its counter of instructions.
#include "board.h"
#include "processor.h"

// Of this file: the instructions for counters and traps, which every processor with traps has.
__asm__(".option arch, +zicsr");

namespace processor {

uint32_t ask(uint32_t call, const void *arguments) {
    register uint32_t a0 __asm__("a0") = call;
    register const void *a1 __asm__("a1") = arguments;
    // These three instructions, none of them compressed, are a call and no breakpoint.
    __asm__ volatile(".option push\n.option norvc\n.balign 16\n"
                     "slli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop"
                     : "+r"(a0)
                     : "r"(a1)
                     : "memory");
    return a0;
}

void begin() {}

} // namespace processor

uint64_t board::instructions() {
    uint32_t high, low, again;
    do
        __asm__ volatile("csrr %0, minstreth\ncsrr %1, minstret\ncsrr %2, minstreth"
                         : "=r"(high), "=r"(low), "=r"(again));
    while (high != again);
    return uint64_t{high} << 32 | low;
}

// A fault leads to where mtvec says, at an address that 4 divides.
extern "C" __attribute__((aligned(4), noreturn)) void trap() { fault(); }

__asm__(".section .vectors, \"ax\"\n.globl reset\nreset:\n"
        ".option push\n.option norelax\nla gp, __global_pointer$\n.option pop\n"
        "la sp, stack_end\nla t0, trap\ncsrw mtvec, t0\nj start\n.text\n");
