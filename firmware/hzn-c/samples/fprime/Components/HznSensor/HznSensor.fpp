module Hzn {

  @ A vector
  array Vector = [3] F32

  @ A covariance: xx, xy, xz, yy, yz, zz
  array Covariance = [6] F32

  @ The answer to a picture
  port AnswerSend(
    picture: U32 @< Context of the buffer, by which the owner of the picture knows its exposure
    status: I32 @< 0 ok to 7 truncated, or an error below 0; without 0 the other numbers are NaN or 0
    axis: Vector @< Unit vector to the body, camera frame
    covariance: Covariance @< Covariance of axis, rad²
    inliers: U32 @< Edge points that carry the answer
    pLimb: F32 @< Probability that the edge is the limb
    protection: F32 @< Angle that the error exceeds with the probability of parameter 105, rad
  )

  @ The horizon sensor: a picture comes in, a direction goes out to its users and as telemetry.
  passive component HznSensor {

    @ A picture of one byte per pixel, in the size of the camera. It is guarded, because calls with one sensor must not
    @ overlap.
    guarded input port pictureIn: Fw.BufferSend

    @ The picture goes back to its owner
    output port pictureOut: Fw.BufferSend

    @ The answer, for example to the filter of the attitude. It need not be connected.
    output port answerOut: AnswerSend

    @ Status of the last picture: 0 ok to 7 truncated, or an error below 0
    telemetry Status: I32

    @ Unit vector to the body, camera frame
    telemetry Axis: Vector

    @ Edge points that carry the answer
    telemetry Inliers: U32

    @ Pictures since the start
    telemetry Pictures: U32

    @ Pictures that were refused with an error
    telemetry Refused: U32

    @ The sensor could not be opened, or a parameter was refused. All pictures are refused.
    event NotConfigured(number: U16, code: I32) severity warning high format "parameter {}: error {}, no sensor"

    @ Pictures are refused. The next one that is not lets these events through again.
    event PictureRefused(code: I32) severity warning low format "picture refused: {}" throttle 16

    @ Bits of the sensor's memory had changed
    event Reopened severity warning high format "memory has changed, opened again"

    time get port timeCaller
    event port logOut
    text event port logTextOut
    telemetry port tlmOut
  }
}
