/* The example on a Cortex-M7 in QEMU: vector table, FPU on, output and end by semihosting. */
#include <stdint.h>

int example(void);
extern uint32_t stack_top, data_start, data_end, data_load, bss_start, bss_end;

static long semihosting(long operation, const void *argument) {
    register long r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void print(const char *text) {
    semihosting(0x04, text); /* SYS_WRITE0 */
}

static void leave(long status) {
    const long block[2] = { 0x20026, status }; /* ADP_Stopped_ApplicationExit */
    semihosting(0x20, block);                  /* SYS_EXIT_EXTENDED */
    for (;;) {
    }
}

void fault(void) {
    leave(102);
}

void reset(void) {
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20; /* CPACR: the FPU */
    __asm__ volatile("dsb\nisb" ::: "memory");
    for (uint32_t *to = &data_start, *from = &data_load; to < &data_end; to++, from++) {
        *to = *from;
    }
    for (uint32_t *at = &bss_start; at < &bss_end; at++) {
        *at = 0;
    }
    leave(example());
}

__attribute__((section(".vectors"), used)) static void *const vectors[] = { &stack_top, reset, fault, fault };
