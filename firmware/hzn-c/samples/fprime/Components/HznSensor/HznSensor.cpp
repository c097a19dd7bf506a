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

HznSensor::HznSensor(const char* name)
    : HznSensorComponentBase(name), m_memory{}, m_sensor(nullptr), m_pictures(0), m_refused(0) {}

void HznSensor::configure() {
    I32 code = hzn_open(m_memory, sizeof m_memory, HZN_INTERFACE, &m_sensor);
    for (const auto& parameter : PARAMETERS) {
        if (code == HZN_OK) {
            code = hzn_set(m_sensor, parameter.number, parameter.value);
        }
    }
    if (code == HZN_OK) {
        code = hzn_apply(m_sensor);
    }
    if (code != HZN_OK) {
        this->log_WARNING_HI_NotConfigured(hzn_refused(m_sensor), code);
        // Without its parameters, the sensor would give directions for another camera.
        m_sensor = nullptr;
    }
}

void HznSensor::pictureIn_handler(FwIndexType portNum, Fw::Buffer& picture) {
    const HznPicture pixels = {picture.getData(), static_cast<size_t>(picture.getSize()), WIDTH, HEIGHT, WIDTH};
    HznAnswer answer;
    const I32 status = this->find(pixels, answer);
    m_pictures++;
    if (status < 0) {
        m_refused++;
        this->log_WARNING_LO_PictureRefused(status);
    } else {
        this->log_WARNING_LO_PictureRefused_ThrottleClear();
    }
    this->send(picture.getContext(), status, answer);
    this->pictureOut_out(portNum, picture);
}

I32 HznSensor::find(const HznPicture& picture, HznAnswer& answer) {
    I32 status = hzn_process(m_sensor, &picture, nullptr, &answer);
    if (status == HZN_NOT_OPEN) {
        this->log_WARNING_HI_Reopened();
        this->configure();
        status = hzn_process(m_sensor, &picture, nullptr, &answer);
    }
    return status;
}

void HznSensor::send(U32 picture, I32 status, const HznAnswer& answer) {
    // Without an answer these are NaN, so that no older direction is taken for a new one.
    Vector axis;
    for (U32 i = 0; i < 3; i++) {
        axis[i] = answer.axis[i];
    }
    Covariance covariance;
    for (U32 i = 0; i < 6; i++) {
        covariance[i] = answer.cov_rad2[i];
    }
    this->tlmWrite_Status(status);
    this->tlmWrite_Axis(axis);
    this->tlmWrite_Inliers(answer.inliers);
    this->tlmWrite_Pictures(m_pictures);
    this->tlmWrite_Refused(m_refused);
    if (this->isConnected_answerOut_OutputPort(0)) {
        this->answerOut_out(0, picture, status, axis, covariance, answer.inliers, answer.p_limb, answer.protection_rad);
    }
}

}  // namespace Hzn
