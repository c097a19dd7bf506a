@ Just enough of F´ to check HznSensor.fpp without it: the ports that it uses, as version 4 has them.
type FwChanIdType = U32
type FwDpIdType = U32
type FwDpPriorityType = U32
type FwEventIdType = U32
type FwIndexType = I16
type FwOpcodeType = U32
type FwPacketDescriptorType = U16
type FwPrmIdType = U32
type FwSignedSizeType = I64
type FwSizeStoreType = U16
type FwSizeType = U64
type FwTimeBaseStoreType = U16
type FwTimeContextStoreType = U8
type FwTlmPacketizeIdType = U16
type FwTraceIdType = U32

module Fw {

  type Buffer
  type LogBuffer
  type TextLogString
  type Time
  type TlmBuffer

  enum LogSeverity { FATAL, WARNING_HI, WARNING_LO, COMMAND, ACTIVITY_HI, ACTIVITY_LO, DIAGNOSTIC }

  port BufferSend(ref fwBuffer: Buffer)
  port Time(ref $time: Fw.Time)
  port Tlm($id: FwChanIdType, ref timeTag: Fw.Time, ref val: TlmBuffer)
  port Log($id: FwEventIdType, ref timeTag: Fw.Time, $severity: LogSeverity, ref args: LogBuffer)
  port LogText($id: FwEventIdType, ref timeTag: Fw.Time, $severity: LogSeverity, ref $text: TextLogString)
}
