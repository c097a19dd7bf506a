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
    Buffer(U8* data, std::size_t size, U32 context) : m_data(data), m_size(size), m_context(context) {}
    U8* getData() const { return m_data; }
    std::size_t getSize() const { return m_size; }
    U32 getContext() const { return m_context; }

  private:
    U8* m_data;
    std::size_t m_size;
    U32 m_context;
};
}  // namespace Fw

namespace Hzn {

template <std::size_t SIZE>
class Numbers {
  public:
    F32& operator[](std::size_t i) { return m_numbers[i]; }
    F32 operator[](std::size_t i) const { return m_numbers[i]; }

  private:
    F32 m_numbers[SIZE] = {};
};
using Vector = Numbers<3>;
using Covariance = Numbers<6>;

class HznSensorComponentBase {
  public:
    explicit HznSensorComponentBase(const char*) {}
    virtual ~HznSensorComponentBase() = default;
    // A picture that arrives at the port.
    void pictureIn(Fw::Buffer& picture) { this->pictureIn_handler(0, picture); }

    // The last answer and telemetry, and how often a picture was returned and an event was sent.
    I32 status = 99;
    U32 context = 0;
    Vector axis, telemetry_axis;
    Covariance covariance;
    U32 inliers = 0, pictures = 0, pictures_refused = 0;
    int returned = 0, refused = 0, reopened = 0, cleared = 0;

  protected:
    virtual void pictureIn_handler(FwIndexType portNum, Fw::Buffer& picture) = 0;
    void pictureOut_out(FwIndexType, Fw::Buffer&) { returned++; }
    bool isConnected_answerOut_OutputPort(FwIndexType) const { return true; }
    void answerOut_out(FwIndexType, U32 picture, I32, const Hzn::Vector& a, const Hzn::Covariance& c, U32, F32, F32);
    void tlmWrite_Status(I32 value) { status = value; }
    void tlmWrite_Axis(const Hzn::Vector& value) { telemetry_axis = value; }
    void tlmWrite_Inliers(U32 value) { inliers = value; }
    void tlmWrite_Pictures(U32 value) { pictures = value; }
    void tlmWrite_Refused(U32 value) { pictures_refused = value; }
    void log_WARNING_HI_NotConfigured(U16, I32) { refused++; }
    void log_WARNING_LO_PictureRefused(I32) { refused++; }
    void log_WARNING_LO_PictureRefused_ThrottleClear() { cleared++; }
    void log_WARNING_HI_Reopened() { reopened++; }
};

inline void HznSensorComponentBase::answerOut_out(FwIndexType,
                                                  U32 picture,
                                                  I32,
                                                  const Hzn::Vector& a,
                                                  const Hzn::Covariance& c,
                                                  U32,
                                                  F32,
                                                  F32) {
    context = picture;
    axis = a;
    covariance = c;
}
}  // namespace Hzn

#endif
