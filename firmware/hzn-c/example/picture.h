/* The picture of the examples: a bright body below a limb of the Earth, 17 km high and seen from 400 km. */
#include <stdint.h>

enum { PICTURE_WIDTH = 320, PICTURE_HEIGHT = 240 };
/* Sine of the angle from the optical axis to the axis of the cone: the limb crosses the middle column 19.5 px above the centre,
   at a focal length of 300 px, so the angle is 70.64° - 3.72°. */
#define LIMB_SIN 0.9200f
static uint8_t picture[PICTURE_WIDTH * PICTURE_HEIGHT];

/* The cone of 70.64° as a series in x, to 0.01 px, in sixteenths of a pixel and with integers alone. */
static void draw_picture(void) {
    for (int y = 0; y < PICTURE_HEIGHT; y++) {
        for (int x = 0; x < PICTURE_WIDTH; x++) {
            int dx = x - PICTURE_WIDTH / 2;
            int dx2 = dx * dx, dx4 = (dx2 / 64) * (dx2 / 64);
            int depth = 16 * (y - 100) - dx2 * 100 / 10692 + dx4 / 13035;
            int v = 110 + 6 * depth;
            picture[y * PICTURE_WIDTH + x] = (uint8_t)(v < 10 ? 10 : v > 210 ? 210 : v);
        }
    }
}
