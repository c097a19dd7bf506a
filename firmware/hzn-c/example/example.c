/* A picture of a limb through hzn, from C: on a workstation (gcc) and on a Cortex-M (arm-none-eabi-gcc, with startup.c).
   Prints the bits of the answer, so that both can be compared. */
#include <stddef.h>
#include <stdint.h>

#include "hzn.h"

void print(const char *text);

enum { WIDTH = 320, HEIGHT = 240 };
static uint8_t picture[WIDTH * HEIGHT];
static _Alignas(16) uint8_t memory[128 * 1024];

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

/* A bright body below a limb of the Earth, 17 km high and seen from 400 km: the cone of 70.64° as a series in x, to 0.01 px,
   in sixteenths of a pixel and with integers alone. */
static void draw(void) {
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            int dx = x - WIDTH / 2;
            int dx2 = dx * dx, dx4 = (dx2 / 64) * (dx2 / 64);
            int depth = 16 * (y - 100) - dx2 * 100 / 10692 + dx4 / 13035;
            int v = 110 + 6 * depth;
            picture[y * WIDTH + x] = (uint8_t)(v < 10 ? 10 : v > 210 ? 210 : v);
        }
    }
}

int example(void) {
    HznSensor *sensor = NULL;
    if (hzn_workspace_size() > sizeof memory || hzn_workspace_align() > 16) {
        print("the memory is too small\n");
        return 1;
    }
    if (hzn_open(memory, sizeof memory, &sensor) != 0) {
        return 2;
    }
    /* Numbers of parameters: book/reference/telemetry.md. */
    const struct { uint16_t number; double value; } parameters[] = {
        { 1, WIDTH }, { 2, HEIGHT }, { 4, 300 }, { 5, 300 }, { 6, 159.5 }, { 7, 119.5 }, /* the camera */
        { 32, 400 },                                                                    /* body.altitude_km */
    };
    for (size_t i = 0; i < sizeof parameters / sizeof *parameters; i++) {
        if (hzn_set(sensor, parameters[i].number, parameters[i].value) != 0) {
            return 3;
        }
    }
    if (hzn_set(sensor, 9999, 1) != HZN_UNKNOWN_PARAMETER || hzn_apply(sensor) != 0) {
        return 4;
    }
    draw();
    HznPicture frame = { picture, sizeof picture, WIDTH, HEIGHT, WIDTH };
    HznAnswer answer;
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
    /* A mistake gets an error code and changes nothing. */
    frame.bytes = 100;
    if (hzn_process(sensor, &frame, NULL, &answer) != HZN_PICTURE || hzn_process(NULL, NULL, NULL, NULL) != HZN_NULL) {
        return 5;
    }
    return status == 0 && answer.inliers > 100 ? 0 : 6;
}
