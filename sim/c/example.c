/* The forces of one frame: of the floating-point model, of the integers of the hardware, and of a board.
 *
 *     example SCENE FRAME.csv [PORT]
 *
 * SCENE is a built-in scene or a file, FRAME.csv the stress on every taxel in MPa, a line per row. With PORT, a serial port
 * in raw mode at the board's bit rate (stty -F PORT raw -echo 1000000), the frame is sent to the board too.
 */
#define _POSIX_C_SOURCE 200809L

#include "dermis.h"

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* Milliseconds without a byte after which a request is made again, and how often. */
#define TIMEOUT_MS 1000
#define ATTEMPTS 8
#define MOST_CONTACTS 8

static int failed(const char *what)
{
    fprintf(stderr, "%s: %s\n", what, dermis_last_error());
    return EXIT_FAILURE;
}

/* Reads count numbers, separated by commas and ends of lines; 0 if there are fewer. */
static int read_frame(const char *path, double *stress_MPa, size_t count)
{
    FILE *file = fopen(path, "r");
    size_t have = 0;
    if (!file)
        return 0;
    while (have < count && fscanf(file, " %lf%*[, ]", &stress_MPa[have]) == 1)
        have++;
    fclose(file);
    return have == count;
}

/* Prints a result: its flags, the force of each taxel, and each contact with its error bars. */
static int print(const char *engine, const dermis_result *result, size_t rows, size_t cols)
{
    const size_t taxels = rows * cols;
    double *force_N = malloc(3 * taxels * sizeof *force_N);
    double sum_N[3];
    dermis_contact contacts[MOST_CONTACTS];
    size_t count = 0;
    uint32_t flags = 0;
    int done = 0;

    if (!force_N)
        return 0;
    if (dermis_result_resultant(result, sum_N) == DERMIS_STATUS_OK
        && dermis_result_flags(result, &flags) == DERMIS_STATUS_OK
        && dermis_result_forces(result, force_N, force_N + taxels, force_N + 2 * taxels, taxels) == DERMIS_STATUS_OK) {
        printf("%s resultant %.17g %.17g %.17g\n", engine, sum_N[0], sum_N[1], sum_N[2]);
        printf("%s flags %u%s\n", engine, (unsigned)flags, flags & DERMIS_FLAG_MISFIT ? " misfit" : "");
        for (size_t at = 0; at < taxels; at++)
            printf("%s force %zu %zu %.17g %.17g %.17g\n", engine, at / cols, at % cols, force_N[at],
                   force_N[taxels + at], force_N[2 * taxels + at]);
        done = 1;
    }
    free(force_N);
    switch (dermis_result_contacts(result, contacts, MOST_CONTACTS, &count)) {
    case DERMIS_STATUS_OK:
        for (size_t k = 0; k < count && k < MOST_CONTACTS; k++) {
            const dermis_contact *one = &contacts[k];
            printf("%s contact %.17g %.17g %.17g", engine, one->force_N[0], one->force_N[1], one->force_N[2]);
            if (one->has_shear_sigma_N)
                printf(" +- %.17g %.17g", one->shear_sigma_N[0], one->shear_sigma_N[1]);
            if (one->has_normal_sigma_N)
                printf(" %.17g", one->normal_sigma_N);
            printf("\n");
        }
        break;
    case DERMIS_STATUS_ABSENT:
        printf("%s contacts absent\n", engine);
        break;
    default:
        done = 0;
    }
    return done;
}

static int write_all(int port, const uint8_t *bytes, size_t count)
{
    while (count > 0) {
        const ssize_t written = write(port, bytes, count);
        if (written <= 0)
            return 0;
        bytes += written;
        count -= (size_t)written;
    }
    return 1;
}

/* Reads until the answer of the wanted kind is complete; 0 after the timeout, a damaged answer or another board. */
static int answered(dermis_link *link, int port, dermis_answer wanted, dermis_result **result)
{
    struct pollfd ready = {port, POLLIN, 0};
    while (poll(&ready, 1, TIMEOUT_MS) > 0) {
        uint8_t bytes[512];
        const ssize_t count = read(port, bytes, sizeof bytes);
        if (count <= 0)
            return 0;
        for (size_t at = 0, used; at < (size_t)count; at += used) {
            dermis_answer answer;
            if (dermis_link_receive(link, bytes + at, (size_t)count - at, &used, &answer, result) != DERMIS_STATUS_OK)
                return 0;
            if (answer == wanted)
                return 1;
            dermis_result_free(*result);
        }
    }
    return 0;
}

/* Sends the frame to the board behind a port; NULL if it does not answer. */
static dermis_result *ask(dermis_link *link, int port, const double *stress_MPa, size_t count)
{
    const size_t capacity = dermis_link_capacity(link);
    uint8_t *wire = malloc(capacity);
    dermis_result *result = NULL;
    int identified = 0;
    for (int attempt = 0; wire && !result && attempt < ATTEMPTS; attempt++) {
        size_t size;
        if (!identified) {
            if (dermis_link_identify(link, wire, capacity, &size) != DERMIS_STATUS_OK || !write_all(port, wire, size))
                break;
            identified = answered(link, port, DERMIS_ANSWER_IDENTITY, &result);
            if (!identified)
                continue;
        }
        if (dermis_link_frame(link, stress_MPa, count, true, wire, capacity, &size) != DERMIS_STATUS_OK
            || !write_all(port, wire, size))
            break;
        if (!answered(link, port, DERMIS_ANSWER_RESULT, &result))
            result = NULL;
    }
    free(wire);
    return result;
}

int main(int argc, char **argv)
{
    static const char *const engines[] = {"golden", "fixed"};
    dermis_scene *scene = NULL;
    dermis_result *result = NULL;
    int status = EXIT_FAILURE;

    if (argc != 3 && argc != 4) {
        fprintf(stderr, "usage: example SCENE FRAME.csv [PORT]   (dermis %s)\n", dermis_version());
        return EXIT_FAILURE;
    }
    if (dermis_scene_load(argv[1], &scene) != DERMIS_STATUS_OK)
        return failed(argv[1]);

    const size_t rows = dermis_scene_rows(scene), cols = dermis_scene_cols(scene), taxels = rows * cols;
    double *stress_MPa = malloc(taxels * sizeof *stress_MPa);
    if (!stress_MPa || !read_frame(argv[2], stress_MPa, taxels)) {
        fprintf(stderr, "%s: wanted %zu lines of %zu numbers\n", argv[2], rows, cols);
        goto end;
    }
    for (size_t k = 0; k < sizeof engines / sizeof *engines; k++) {
        if (dermis_reconstruct(scene, engines[k], stress_MPa, taxels, true, &result) != DERMIS_STATUS_OK
            || !print(engines[k], result, rows, cols)) {
            failed(engines[k]);
            goto end;
        }
        dermis_result_free(result);
        result = NULL;
    }
    if (argc == 4) {
        dermis_link *link = NULL;
        const int port = open(argv[3], O_RDWR | O_NOCTTY);
        if (port >= 0 && dermis_link_new(scene, 1, &link) == DERMIS_STATUS_OK)
            result = ask(link, port, stress_MPa, taxels);
        if (port >= 0)
            close(port);
        dermis_link_free(link);
        if (!result || !print("board", result, rows, cols)) {
            failed(argv[3]);
            goto end;
        }
    }
    status = EXIT_SUCCESS;
end:
    dermis_result_free(result);
    dermis_scene_free(scene);
    free(stress_MPa);
    return status;
}
