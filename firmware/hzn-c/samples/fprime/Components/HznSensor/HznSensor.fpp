module Hzn {

  @ The horizon sensor: a picture comes in, a direction goes out as telemetry.
  passive component HznSensor {

    @ A picture of one byte per pixel, in the size of the camera
    sync input port pictureIn: Fw.BufferSend

    @ The picture goes back to its owner
    output port pictureOut: Fw.BufferSend

    @ Status of the last picture: 0 ok to 7 truncated, or an error below 0
    telemetry Status: I32

    @ Unit vector to the body, camera frame
    telemetry AxisX: F32
    telemetry AxisY: F32
    telemetry AxisZ: F32

    @ Edge points that carry the answer
    telemetry Inliers: U32

    @ A parameter was refused at the start
    event ParameterRefused(number: U16, code: I32) severity warning high format "parameter {} refused: {}"

    @ A picture was refused
    event PictureRefused(code: I32) severity warning low format "picture refused: {}"

    time get port timeCaller
    event port logOut
    text event port logTextOut
    telemetry port tlmOut
  }
}
