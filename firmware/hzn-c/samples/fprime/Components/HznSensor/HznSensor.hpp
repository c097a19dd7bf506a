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
    void pictureIn_handler(FwIndexType portNum, Fw::Buffer& picture) override;

    alignas(HZN_WORKSPACE_ALIGN) U8 m_memory[HZN_WORKSPACE_SIZE];
    ::HznSensor* m_sensor;
};

}  // namespace Hzn

#endif
