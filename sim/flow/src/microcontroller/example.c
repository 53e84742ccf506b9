/*
 * Prints the forces and the status of the frames in @NAME@_frames.h, one line per taxel and one per status, as CSV. A
 * frame with a reading outside its range, or at the end of it, has a line that says so.
 *
 *   cc -std=c99 -O2 -o example @NAME@_example.c @NAME@.c && ./example
 */
#include <inttypes.h>
#include <stdio.h>

#include "@NAME@.h"
#include "@NAME@_frames.h"

int main(void)
{
    static struct @NAME@_work work;
    static struct @NAME@_result result;
    int frame;
    int k;

    for (frame = 0; frame < @MACRO@_FRAMES; frame++) {
        const int returned = @NAME@_reconstruct(&work, &@NAME@_frames[frame * @MACRO@_TAXELS], &result);

        if (returned == @MACRO@_OUTSIDE) {
            printf("%d,outside\n", frame);
            continue;
        }
        if (returned == @MACRO@_SATURATED) {
            printf("%d,saturated\n", frame);
        }
        for (k = 0; k < @MACRO@_TAXELS; k++) {
            const int32_t *force = result.force[k];

            printf("%d,%d,%d,%" PRId32 ",%" PRId32 ",%" PRId32 "\n", frame, k / @MACRO@_COLS, k % @MACRO@_COLS, force[0],
                   force[1], force[2]);
        }
        printf("%d,status", frame);
        for (k = 0; k < @STATUS_WORDS@; k++) {
            printf(",%" PRIu32, result.status[k]);
        }
        printf("\n");
    }
    return 0;
}
