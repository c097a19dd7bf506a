/* A picture of a limb through hzn, from C: on a workstation (gcc) and on a Cortex-M (arm-none-eabi-gcc, with startup.c).
   Prints the bits of the answer, so that both can be compared. */
#include <stddef.h>
#include <stdint.h>

#include "hzn.h"
#include "hzn_parameters.h"
#include "hzn_verdicts.h"
#include "picture.h"

void print(const char *text);

static _Alignas(HZN_WORKSPACE_ALIGN) uint8_t memory[HZN_WORKSPACE_SIZE_608];
static _Alignas(HZN_WORKSPACE_ALIGN) uint8_t rows_memory[HZN_ROWS_SIZE];

static void print_hex(uint32_t word) {
    char text[12];
    for (int i = 0; i < 8; i++) {
        text[i] = "0123456789abcdef"[word >> (28 - 4 * i) & 15];
    }
    text[8] = ' ';
    text[9] = 0;
    print(text);
}

static void print_floats(const char *name, const float *x, size_t n) {
    print(name);
    for (size_t i = 0; i < n; i++) {
        union { float f; uint32_t u; } bits = { .f = x[i] };
        print_hex(bits.u);
    }
    print("\n");
}

/* Gives the rows of the picture, one after the other. */
static int32_t next_row(void *context, uint8_t *row, size_t width) {
    int *y = context;
    for (size_t x = 0; x < width; x++) {
        row[x] = picture[*y * PICTURE_WIDTH + (int)x];
    }
    *y += 1;
    return 0;
}

int example(void) {
    HznSensor *sensor = NULL;
    HznAnswer answer;
    /* Memory that was never opened is no sensor, whatever it holds. */
    for (size_t i = 0; i < sizeof memory; i++) {
        memory[i] = 0xFF;
    }
    if (hzn_apply((HznSensor *)memory) != HZN_NOT_OPEN || hzn_apply((HznSensor *)(memory + 1)) != HZN_MEMORY) {
        return 1;
    }
    if (hzn_open(memory, sizeof memory, HZN_INTERFACE + 1, &sensor) != HZN_OTHER_INTERFACE ||
        hzn_open(memory, sizeof memory, HZN_INTERFACE, &sensor) != 0) {
        return 2;
    }
    /* Numbers of parameters: book/reference/telemetry.md. */
    const struct { uint16_t number; double value; } parameters[] = {
        { HZN_CAMERA_WIDTH, PICTURE_WIDTH }, { HZN_CAMERA_HEIGHT, PICTURE_HEIGHT }, { HZN_CAMERA_FX_PX, 300 },
        { HZN_CAMERA_FY_PX, 300 },           { HZN_CAMERA_CX_PX, 159.5 },           { HZN_CAMERA_CY_PX, 119.5 },
        { HZN_BODY_ALTITUDE_KM, 400 },
    };
    for (size_t i = 0; i < sizeof parameters / sizeof *parameters; i++) {
        if (hzn_set(sensor, parameters[i].number, parameters[i].value) != 0) {
            return 3;
        }
    }
    if (hzn_set(sensor, 9999, 1) != HZN_UNKNOWN_PARAMETER || hzn_apply(sensor) != 0) {
        return 4;
    }
    /* What is refused is named, and nothing changes. */
    if (hzn_set(sensor, HZN_CAMERA_FX_PX, -1) != 0 || hzn_apply(sensor) != HZN_REFUSED ||
        hzn_refused(sensor) != HZN_CAMERA_FX_PX) {
        return 7;
    }
    draw_picture();
    HznPicture frame = { picture, sizeof picture, PICTURE_WIDTH, PICTURE_HEIGHT, PICTURE_WIDTH };
    int32_t status = hzn_process(sensor, &frame, NULL, &answer);
    print("status ");
    print_hex((uint32_t)status);
    print("\n");
    print_floats("axis ", answer.axis, 3);
    print_floats("covariance ", answer.cov_rad2, 6);
    print_floats("rms ", &answer.rms_px, 1);
    print("inliers ");
    print_hex(answer.inliers);
    print("\n");
    if (status != HZN_OK || answer.inliers < 100 || answer.listed != 1 || answer.edges[0].verdict != HZN_VERDICT_CHOSEN) {
        return 6;
    }
    /* The same picture, row by row, with a threshold that is known before. */
    int y = 0;
    HznAnswer by_rows;
    if (hzn_set(sensor, HZN_THRESHOLD_METHOD, 1) != 0 || hzn_set(sensor, HZN_THRESHOLD_LEVEL, 110) != 0 ||
        hzn_apply(sensor) != 0 || hzn_process(sensor, &frame, NULL, &answer) != HZN_OK ||
        hzn_process_rows(sensor, rows_memory, sizeof rows_memory, next_row, &y, NULL, &by_rows) != HZN_OK) {
        return 8;
    }
    print_floats("by rows ", by_rows.axis, 3);
    for (int i = 0; i < 3; i++) {
        if (by_rows.axis[i] != answer.axis[i]) {
            return 9;
        }
    }
    /* A mistake gets an error code, changes nothing, and leaves no older answer. */
    frame.bytes = 100;
    if (hzn_process(sensor, &frame, NULL, &answer) != HZN_PICTURE || hzn_process(NULL, NULL, NULL, NULL) != HZN_NULL ||
        answer.status != 255 || answer.axis[0] == answer.axis[0]) {
        return 5;
    }
    frame.bytes = sizeof picture;
    frame.width = PICTURE_WIDTH / 2;
    return hzn_process(sensor, &frame, NULL, &answer) == HZN_PICTURE ? 0 : 10;
}
