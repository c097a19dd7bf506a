// Sends the sample a picture with a limb and one that is cut off, changes a bit of its memory, and checks the answers.
#include <cmath>
#include <cstdio>

#include "Components/HznSensor/HznSensor.hpp"
#include "picture.h"

namespace Hzn {

// The component has it as a friend, as the unit test in F´.
class HznSensorTester {
  public:
    static void change_bit(HznSensor& component) { component.m_memory[1000] ^= 4; }
};

}  // namespace Hzn

// Sends the first bytes of the picture, and prints the answer.
static void send(Hzn::HznSensor& component, std::size_t bytes, U32 context) {
    Fw::Buffer buffer(picture, bytes, context);
    component.pictureIn(buffer);
    std::printf("status %d, axis %.4f %.4f %.4f, %u inliers\n", component.status, component.axis[0], component.axis[1],
                component.axis[2], component.inliers);
}

static bool is_limb(const Hzn::HznSensor& component) {
    return component.status == HZN_OK && std::fabs(component.axis[1] - LIMB_SIN) < 0.002F &&
           component.telemetry_axis[1] == component.axis[1] && component.covariance[0] > 0.0F;
}

int main() {
    static Hzn::HznSensor component("hzn");
    draw_picture();
    send(component, sizeof picture, 1);
    if (component.status != HZN_NULL || component.refused != 1) {
        return 1;
    }
    component.configure();
    send(component, sizeof picture, 2);
    if (!is_limb(component) || component.context != 2 || component.cleared != 1) {
        return 2;
    }
    send(component, 100, 3);
    if (component.status != HZN_PICTURE || !std::isnan(component.axis[0]) || component.refused != 2) {
        return 3;
    }
    Hzn::HznSensorTester::change_bit(component);
    send(component, sizeof picture, 4);
    if (!is_limb(component) || component.reopened != 1) {
        return 4;
    }
    return component.returned == 4 && component.pictures == 4 && component.pictures_refused == 2 ? 0 : 5;
}
