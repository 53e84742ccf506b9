/*
 * Runs @NAME@ on a simulated board without a library, on the frames in @NAME@_frames.h. For each frame it prints what the
 * call returned, ticks of the timer, bytes of the stack, and the words of forces and status.
 */
#include "@NAME@.h"
#include "@NAME@_frames.h"

/* The 32-bit timer of the board, which counts down. */
#define TIMER_CONTROL (*(volatile uint32_t *)0x40000000U)
#define TIMER_VALUE (*(volatile uint32_t *)0x40000004U)
#define TIMER_RELOAD (*(volatile uint32_t *)0x40000008U)

/* Calls of the debugger. */
#define WRITE_TEXT 4
#define EXIT 0x18
#define EXIT_GOOD ((const void *)0x20026)

/* Words below the caller's that are looked at for the stack. */
#define PAINTED 1024U
#define PAINT 0x5AA55AA5U

extern uint32_t stack_top;
void start(void);

/* What the core reads first. */
struct vectors {
    uint32_t *stack;
    void (*start)(void);
};

__attribute__((section(".vectors"), used)) static const struct vectors vectors = {&stack_top, start};

static struct @NAME@_work work;
static struct @NAME@_result result;

static void debugger(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;

    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

static void print(uint32_t value)
{
    char text[] = "00000000\n";
    int digit;

    for (digit = 7; digit >= 0; digit--) {
        text[digit] = "0123456789abcdef"[value & 15U];
        value >>= 4;
    }
    debugger(WRITE_TEXT, text);
}

/* The compiler may call it. */
void *memset(void *to, int value, unsigned int count);
void *memset(void *to, int value, unsigned int count)
{
    volatile uint8_t *bytes = to;

    while (count-- > 0U) {
        bytes[count] = (uint8_t)value;
    }
    return to;
}

/* The compiler may call it. */
void *memcpy(void *to, const void *from, unsigned int count);
void *memcpy(void *to, const void *from, unsigned int count)
{
    uint32_t *words = to;
    const uint32_t *others = from;

    while (count >= 4U) {
        *words++ = *others++;
        count -= 4U;
    }
    return to;
}

void start(void)
{
    uint32_t frame;
    uint32_t k;

    for (frame = 0U; frame < @MACRO@_FRAMES; frame++) {
        volatile uint32_t *stack = (volatile uint32_t *)__builtin_frame_address(0) - 64 - PAINTED;
        uint32_t ticks;
        int returned;

        /* The engine may not rely on what was there. */
        (void)memset(&work, 0xA5, sizeof(work));
        (void)memset(&result, 0x5A, sizeof(result));
        for (k = 0U; k < PAINTED; k++) {
            stack[k] = PAINT;
        }
        TIMER_CONTROL = 0U;
        TIMER_RELOAD = 0xFFFFFFFFU;
        TIMER_VALUE = 0xFFFFFFFFU;
        TIMER_CONTROL = 1U;
        ticks = TIMER_VALUE;
        returned = @NAME@_reconstruct(&work, &@NAME@_frames[frame * @MACRO@_TAXELS], &result);
        ticks -= TIMER_VALUE;
        k = 0U;
        while ((k < PAINTED) && (stack[k] == PAINT)) {
            k++;
        }
        print((uint32_t)returned);
        print(ticks);
        print(4U * (PAINTED + 64U - k));
        for (k = 0U; k < (3U * @MACRO@_TAXELS); k++) {
            print((uint32_t)result.force[k / 3U][k % 3U]);
        }
        for (k = 0U; k < @STATUS_WORDS@U; k++) {
            print(result.status[k]);
        }
    }
    debugger(EXIT, EXIT_GOOD);
    for (;;) {
    }
}
