/* What a program needs on Arm's MPS2 boards without an operating system: start-up, and text by semihosting (Arm, "Semihosting for AArch32 and
 * AArch64": operation 4 writes a text, 0x18 ends the program). */
#include "platform.h"
#include <stdint.h>

extern uint32_t stack_top, data_source, data_start, data_end, bss_start, bss_end;
int main(void);

static void semihost(uint32_t operation, uintptr_t argument) {
    register uint32_t r0 __asm__("r0") = operation;
    register uintptr_t r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void put(const char *text) { semihost(4, (uintptr_t)text); }

/* Also what the library calls where Rust would panic. */
void abort(void) {
    put("abort\n");
    semihost(0x18, 0x20024);
    for (;;) {}
}

void reset(void) {
    *(volatile uint32_t *)0xe000ed88 |= 0xf << 20; /* the floating-point unit */
    __asm__ volatile("dsb; isb");
    for (uint32_t *to = &data_start, *from = &data_source; to < &data_end;) *to++ = *from++;
    for (uint32_t *to = &bss_start; to < &bss_end;) *to++ = 0;
    if (main() != 0) abort();
    semihost(0x18, 0x20026);
    for (;;) {}
}

__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    (void (*)(void))&stack_top, reset, abort, abort, abort, abort, abort,
};
