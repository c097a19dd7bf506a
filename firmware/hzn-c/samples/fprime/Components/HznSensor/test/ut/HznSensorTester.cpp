// Gives the component pictures, and checks its telemetry, its events and its answers.
#include "HznSensorTester.hpp"

#include <cmath>

namespace Hzn {

namespace {

constexpr U32 CONTEXT = 77;

}  // namespace

HznSensorTester::HznSensorTester()
    : HznSensorGTestBase("HznSensorTester", MAX_HISTORY_SIZE), component("HznSensor"), m_picture{} {
    this->initComponents();
    this->connectPorts();
    component.configure();
    // A bright body below a limb of the Earth, seen from 400 km: the cone of 70.64° as a series in x, in sixteenths of
    // a pixel.
    for (I32 i = 0; i < 320 * 240; i++) {
        const I32 dx = i % 320 - 160, dx2 = dx * dx, dx4 = (dx2 / 64) * (dx2 / 64);
        const I32 value = 110 + 6 * (16 * (i / 320 - 100) - dx2 * 100 / 10692 + dx4 / 13035);
        m_picture[i] = static_cast<U8>(value < 10 ? 10 : value > 210 ? 210 : value);
    }
}

void HznSensorTester::send(FwSizeType bytes) {
    this->clearHistory();
    Fw::Buffer buffer(m_picture, bytes, CONTEXT);
    this->invoke_to_pictureIn(0, buffer);
    ASSERT_from_pictureOut_SIZE(1);
    ASSERT_from_answerOut_SIZE(1);
    ASSERT_EQ(this->fromPortHistory_answerOut->at(0).picture, CONTEXT);
    ASSERT_TLM_SIZE(5);
}

void HznSensorTester::test_limb() {
    this->send(sizeof m_picture);
    ASSERT_EVENTS_SIZE(0);
    ASSERT_TLM_Status(0, HZN_OK);
    ASSERT_TLM_Pictures(0, 1);
    const auto& answer = this->fromPortHistory_answerOut->at(0);
    ASSERT_EQ(answer.status, HZN_OK);
    ASSERT_NEAR(static_cast<F64>(answer.axis[1]), 0.92, 0.002);
    ASSERT_GT(answer.covariance[0], 0.0F);
    ASSERT_GT(answer.inliers, 100U);
}

void HznSensorTester::test_refused() {
    for (U32 i = 1; i <= 20; i++) {
        this->send(100);
        ASSERT_TLM_Status(0, HZN_PICTURE);
        ASSERT_TLM_Refused(0, i);
        ASSERT_TRUE(std::isnan(this->fromPortHistory_answerOut->at(0).axis[0]));
        ASSERT_EVENTS_PictureRefused_SIZE(i <= 16 ? 1 : 0);
    }
    this->send(sizeof m_picture);
    ASSERT_TLM_Status(0, HZN_OK);
    this->send(100);
    ASSERT_EVENTS_PictureRefused_SIZE(1);
}

void HznSensorTester::test_changed_bit() {
    component.m_memory[1000] ^= 4;
    this->send(sizeof m_picture);
    ASSERT_EVENTS_Reopened_SIZE(1);
    ASSERT_TLM_Status(0, HZN_OK);
}

void HznSensorTester::test_without_sensor() {
    component.m_sensor = nullptr;
    this->send(sizeof m_picture);
    ASSERT_TLM_Status(0, HZN_NULL);
    ASSERT_EVENTS_PictureRefused(0, HZN_NULL);
}

}  // namespace Hzn

TEST(HznSensor, Limb) {
    Hzn::HznSensorTester().test_limb();
}
TEST(HznSensor, Refused) {
    Hzn::HznSensorTester().test_refused();
}
TEST(HznSensor, ChangedBit) {
    Hzn::HznSensorTester().test_changed_bit();
}
TEST(HznSensor, WithoutSensor) {
    Hzn::HznSensorTester().test_without_sensor();
}

int main(int argc, char** argv) {
    ::testing::InitGoogleTest(&argc, argv);
    return RUN_ALL_TESTS();
}
