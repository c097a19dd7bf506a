//! Numbers into bytes and back, most significant byte first as in every CCSDS packet. A writer that is full and a
//! reader that is empty say so; nothing is written or read in part.

/// Writes into a slice.
#[derive(Debug)]
pub struct Writer<'a> {
    out: &'a mut [u8],
    len: usize,
    full: bool,
}

impl<'a> Writer<'a> {
    /// An empty writer over `out`.
    pub fn new(out: &'a mut [u8]) -> Self {
        Self { out, len: 0, full: false }
    }
    /// Appends bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        match self.out.get_mut(self.len..).and_then(|rest| rest.get_mut(..bytes.len())) {
            Some(room) if !self.full => {
                room.copy_from_slice(bytes);
                self.len += bytes.len();
            }
            _ => self.full = true,
        }
    }
    /// Appends a byte.
    pub fn u8(&mut self, x: u8) {
        self.bytes(&[x]);
    }
    /// Appends two bytes.
    pub fn u16(&mut self, x: u16) {
        self.bytes(&x.to_be_bytes());
    }
    /// Appends four bytes.
    pub fn u32(&mut self, x: u32) {
        self.bytes(&x.to_be_bytes());
    }
    /// Appends eight bytes.
    pub fn u64(&mut self, x: u64) {
        self.bytes(&x.to_be_bytes());
    }
    /// Appends a single, IEEE 754.
    pub fn f32(&mut self, x: f32) {
        self.u32(x.to_bits());
    }
    /// Appends a double, IEEE 754.
    pub fn f64(&mut self, x: f64) {
        self.u64(x.to_bits());
    }
    /// How many bytes were written; `None` when something did not fit.
    pub fn finish(self) -> Option<usize> {
        (!self.full).then_some(self.len)
    }
}

/// Reads from a slice.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// A reader at the start of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }
    /// What was not read yet.
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*first)
    }
    /// The next byte.
    pub fn u8(&mut self) -> Option<u8> {
        self.array().map(|[b]| b)
    }
    /// The next two bytes.
    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_be_bytes)
    }
    /// The next four bytes.
    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_be_bytes)
    }
    /// The next eight bytes.
    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_be_bytes)
    }
    /// The next single.
    pub fn f32(&mut self) -> Option<f32> {
        self.u32().map(f32::from_bits)
    }
    /// The next double.
    pub fn f64(&mut self) -> Option<f64> {
        self.u64().map(f64::from_bits)
    }
}
