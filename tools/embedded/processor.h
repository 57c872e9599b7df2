// What differs from processor to processor: cortex_m.cpp and riscv.cpp have it. For one of your own, write it again.
#pragma once
#include <cstdint>

namespace processor {

// What the debugger answers to a call of semihosting, whose arguments are words of 32 bits.
uint32_t ask(uint32_t call, const void *arguments);

// Before anything is computed: switches on what it needs.
void begin();

} // namespace processor

// In board.cpp. A processor that is switched on has a stack, and calls start(); after a fault it calls fault().
extern "C" {
[[noreturn]] void start();
[[noreturn]] void fault();
}
