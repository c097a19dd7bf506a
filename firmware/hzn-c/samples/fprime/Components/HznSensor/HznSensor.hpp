// An F´ component with the horizon sensor; HznSensor.fpp describes its ports.
#ifndef HZN_HZNSENSOR_HPP
#define HZN_HZNSENSOR_HPP

#include "Components/HznSensor/HznSensorComponentAc.hpp"
#include "hzn.h"

namespace Hzn {

class HznSensor : public HznSensorComponentBase {
  public:
    explicit HznSensor(const char* name);
    // Opens the sensor with the parameters of the mission. Call it once, before the first picture.
    void configure();

  private:
    friend class HznSensorTester;

    void pictureIn_handler(FwIndexType portNum, Fw::Buffer& picture) override;
    // Finds the limb. A sensor whose memory has changed is opened again, and gets the picture once more.
    I32 find(const HznPicture& picture, HznAnswer& answer);
    void send(U32 picture, I32 status, const HznAnswer& answer);

    alignas(HZN_WORKSPACE_ALIGN) U8 m_memory[HZN_WORKSPACE_SIZE];
    ::HznSensor* m_sensor;
    U32 m_pictures;
    U32 m_refused;
};

}  // namespace Hzn

#endif
