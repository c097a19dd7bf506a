// F´ looks for headers from the root of the project on.
#include "Components/HznSensor/HznSensor.hpp"

#include "hzn_parameters.h"

namespace Hzn {

namespace {

constexpr U32 WIDTH = 320;
constexpr U32 HEIGHT = 240;

// The camera of this mission; parameters of the component could hold it.
constexpr struct {
    U16 number;
    F64 value;
} PARAMETERS[] = {
    {HZN_CAMERA_WIDTH, WIDTH}, {HZN_CAMERA_HEIGHT, HEIGHT}, {HZN_CAMERA_FX_PX, 300.0},    {HZN_CAMERA_FY_PX, 300.0},
    {HZN_CAMERA_CX_PX, 159.5}, {HZN_CAMERA_CY_PX, 119.5},   {HZN_BODY_ALTITUDE_KM, 400.0},
};

}  // namespace

HznSensor::HznSensor(const char* name) : HznSensorComponentBase(name), m_memory{}, m_sensor(nullptr) {}

void HznSensor::configure() {
    I32 code = hzn_open(m_memory, sizeof m_memory, HZN_INTERFACE, &m_sensor);
    for (const auto& parameter : PARAMETERS) {
        if (code == 0) {
            code = hzn_set(m_sensor, parameter.number, parameter.value);
        }
    }
    if (code == 0) {
        code = hzn_apply(m_sensor);
    }
    if (code != 0) {
        this->log_WARNING_HI_ParameterRefused(hzn_refused(m_sensor), code);
    }
}

void HznSensor::pictureIn_handler(FwIndexType portNum, Fw::Buffer& picture) {
    const HznPicture pixels = {picture.getData(), picture.getSize(), WIDTH, HEIGHT, WIDTH};
    HznAnswer answer;
    const I32 status = hzn_process(m_sensor, &pixels, nullptr, &answer);
    if (status < 0) {
        this->log_WARNING_LO_PictureRefused(status);
    }
    this->tlmWrite_Status(status);
    // Without an answer these are NaN, so that no older direction is taken for a new one.
    this->tlmWrite_AxisX(answer.axis[0]);
    this->tlmWrite_AxisY(answer.axis[1]);
    this->tlmWrite_AxisZ(answer.axis[2]);
    this->tlmWrite_Inliers(answer.inliers);
    this->pictureOut_out(portNum, picture);
}

}  // namespace Hzn
