// Just enough of F´ to compile and run the sample without it: what the autocoder makes of HznSensor.fpp; see run.cpp.
#ifndef HZN_HZNSENSORCOMPONENTAC_HPP
#define HZN_HZNSENSORCOMPONENTAC_HPP

#include <cstddef>
#include <cstdint>

using U8 = std::uint8_t;
using U16 = std::uint16_t;
using U32 = std::uint32_t;
using I32 = std::int32_t;
using F32 = float;
using F64 = double;
using FwIndexType = std::int16_t;

namespace Fw {
class Buffer {
  public:
    Buffer(U8* data, std::size_t size) : m_data(data), m_size(size) {}
    U8* getData() const { return m_data; }
    std::size_t getSize() const { return m_size; }

  private:
    U8* m_data;
    std::size_t m_size;
};
}  // namespace Fw

namespace Hzn {
class HznSensorComponentBase {
  public:
    explicit HznSensorComponentBase(const char*) {}
    virtual ~HznSensorComponentBase() = default;
    // A picture that arrives at the port.
    void pictureIn(Fw::Buffer& picture) { this->pictureIn_handler(0, picture); }

    I32 status = 99;
    F32 axis[3] = {};
    U32 inliers = 0;
    int returned = 0;
    int refused = 0;

  protected:
    virtual void pictureIn_handler(FwIndexType portNum, Fw::Buffer& picture) = 0;
    void pictureOut_out(FwIndexType, Fw::Buffer&) { returned++; }
    void tlmWrite_Status(I32 value) { status = value; }
    void tlmWrite_AxisX(F32 value) { axis[0] = value; }
    void tlmWrite_AxisY(F32 value) { axis[1] = value; }
    void tlmWrite_AxisZ(F32 value) { axis[2] = value; }
    void tlmWrite_Inliers(U32 value) { inliers = value; }
    void log_WARNING_HI_ParameterRefused(U16, I32) { refused++; }
    void log_WARNING_LO_PictureRefused(I32) { refused++; }
};
}  // namespace Hzn

#endif
