// Sends the sample a picture with a limb and one that is cut off, and checks what comes back.
#include <cmath>
#include <cstdio>

#include "Components/HznSensor/HznSensor.hpp"
#include "picture.h"

int main() {
    static Hzn::HznSensor component("hzn");
    component.configure();
    draw_picture();
    Fw::Buffer whole(picture, sizeof picture);
    component.pictureIn(whole);
    std::printf("status %d, axis %.4f %.4f %.4f, %u inliers\n", component.status, component.axis[0], component.axis[1],
                component.axis[2], component.inliers);
    const bool is_found = component.status == 0 && std::fabs(component.axis[1] - LIMB_SIN) < 0.002F;
    Fw::Buffer cut(picture, 100);
    component.pictureIn(cut);
    std::printf("cut off: status %d\n", component.status);
    const bool is_refused = component.status == HZN_PICTURE && std::isnan(component.axis[0]);
    return is_found && is_refused && component.returned == 2 && component.refused == 1 ? 0 : 1;
}
