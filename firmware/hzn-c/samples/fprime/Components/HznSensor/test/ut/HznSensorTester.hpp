// The unit test of the component.
#ifndef HZN_HZNSENSORTESTER_HPP
#define HZN_HZNSENSORTESTER_HPP

#include "Components/HznSensor/HznSensor.hpp"
#include "HznSensorGTestBase.hpp"

namespace Hzn {

class HznSensorTester final : public HznSensorGTestBase {
  public:
    // Events and telemetry that are kept.
    static const FwSizeType MAX_HISTORY_SIZE = 100;
    static const FwEnumStoreType TEST_INSTANCE_ID = 0;

    HznSensorTester();

    void test_limb();
    void test_refused();
    void test_changed_bit();
    void test_without_sensor();

  private:
    void connectPorts();
    void initComponents();
    // Sends the first bytes of the picture, and takes it back.
    void send(FwSizeType bytes);

    HznSensor component;
    U8 m_picture[320 * 240];
};

}  // namespace Hzn

#endif
