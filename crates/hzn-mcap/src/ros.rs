//! Answers as messages of ROS 2, for programs that do not know the schemas of hzn.

/// The schema of `geometry_msgs/msg/Vector3Stamped`, with the types that it contains.
pub(crate) const VECTOR: &str = "\
std_msgs/Header header
geometry_msgs/Vector3 vector
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
";

/// The schema of `std_msgs/msg/Float64MultiArray`, with the types that it contains.
pub(crate) const MATRIX: &str = "\
std_msgs/MultiArrayLayout layout
float64[] data
================================================================================
MSG: std_msgs/MultiArrayLayout
std_msgs/MultiArrayDimension[] dim
uint32 data_offset
================================================================================
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
";

/// Writes fields of CDR, lower byte first. Alignment is counted from the end of the four encapsulation bytes.
struct Cdr<'a> {
    out: &'a mut Vec<u8>,
    start: usize,
}

impl<'a> Cdr<'a> {
    fn new(out: &'a mut Vec<u8>) -> Self {
        out.extend_from_slice(&[0, 1, 0, 0]);
        let start = out.len();
        Self { out, start }
    }
    fn align(&mut self, bytes: usize) {
        let length = (self.out.len() - self.start).next_multiple_of(bytes);
        self.out.resize(self.start + length, 0);
    }
    fn u32(&mut self, value: u32) {
        self.align(4);
        self.out.extend_from_slice(&value.to_le_bytes());
    }
    fn f64(&mut self, value: f64) {
        self.align(8);
        self.out.extend_from_slice(&value.to_le_bytes());
    }
    /// Writes a text: its length with a final zero byte, then the bytes.
    fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.out.extend_from_slice(text.as_bytes());
        self.out.push(0);
    }
}

/// Appends an axis as `geometry_msgs/msg/Vector3Stamped`.
pub(crate) fn vector(axis: [f64; 3], frame_id: &str, ns: u64, out: &mut Vec<u8>) {
    let mut cdr = Cdr::new(out);
    // The log time ends in 2106, and ROS counts seconds with a sign until 2038.
    cdr.u32(u32::try_from(ns / 1_000_000_000).unwrap_or(u32::MAX).min(i32::MAX as u32));
    cdr.u32((ns % 1_000_000_000) as u32);
    cdr.text(frame_id);
    axis.into_iter().for_each(|value| cdr.f64(value));
}

/// Appends a covariance (xx, xy, xz, yy, yz, zz) as `std_msgs/msg/Float64MultiArray` of three rows and columns.
pub(crate) fn matrix([xx, xy, xz, yy, yz, zz]: [f64; 6], out: &mut Vec<u8>) {
    let mut cdr = Cdr::new(out);
    cdr.u32(2);
    for (label, size, stride) in [("row", 3, 9), ("column", 3, 3)] {
        cdr.text(label);
        cdr.u32(size);
        cdr.u32(stride);
    }
    cdr.u32(0);
    cdr.u32(9);
    [xx, xy, xz, xy, yy, yz, xz, yz, zz].into_iter().for_each(|value| cdr.f64(value));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_byte_by_byte() {
        let mut out = vec![9];
        vector([1.0, 2.0, 3.0], "cam", 5_000_000_007, &mut out);
        let head = [9, 0, 1, 0, 0, 5, 0, 0, 0, 7, 0, 0, 0, 4, 0, 0, 0, b'c', b'a', b'm', 0];
        // After 16 bytes of fields the numbers are aligned already.
        assert_eq!(out[..21], head);
        assert_eq!(out[21..], [1.0f64, 2.0, 3.0].map(f64::to_le_bytes).concat());
    }
}
