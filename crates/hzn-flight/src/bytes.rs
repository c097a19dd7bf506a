//! Converts numbers to bytes and back, most significant byte first as in every CCSDS packet. A full writer and an empty
//! reader report this. No number is written or read in part.

/// Writes into a slice.
#[derive(Debug)]
pub struct Writer<'a> {
    out: &'a mut [u8],
    len: usize,
    // It stays set. Otherwise a shorter number that still fits would follow a gap.
    full: bool,
}

impl<'a> Writer<'a> {
    /// Makes an empty writer over `out`.
    pub fn new(out: &'a mut [u8]) -> Self {
        Self { out, len: 0, full: false }
    }
    /// Appends bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        // `get_mut`, because an index out of bounds would be a panic path of the flight image.
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
    /// Appends a single-precision number, IEEE 754.
    pub fn f32(&mut self, x: f32) {
        // The bits are sent, so that the ground gets every bit of an answer, and NaN for what is not known.
        self.u32(x.to_bits());
    }
    /// Appends a double-precision number, IEEE 754.
    pub fn f64(&mut self, x: f64) {
        self.u64(x.to_bits());
    }
    /// Returns the number of bytes written; `None` if something did not fit.
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
    /// Makes a reader at the start of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }
    /// Returns the bytes that were not read yet.
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        // `rest` moves only if the whole number is there, so that a number that is cut off is not read in part.
        let (first, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*first)
    }
    /// Reads a byte; `None` at the end.
    pub fn u8(&mut self) -> Option<u8> {
        self.array().map(|[b]| b)
    }
    /// Reads two bytes; `None`, without a change, if fewer are left.
    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_be_bytes)
    }
    /// Reads four bytes; `None`, without a change, if fewer are left.
    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_be_bytes)
    }
    /// Reads eight bytes; `None`, without a change, if fewer are left.
    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_be_bytes)
    }
    /// Reads a single-precision number, as [`Self::u32`] does.
    pub fn f32(&mut self) -> Option<f32> {
        self.u32().map(f32::from_bits)
    }
    /// Reads a double-precision number, as [`Self::u64`] does.
    pub fn f64(&mut self) -> Option<f64> {
        self.u64().map(f64::from_bits)
    }
    /// Reads `N` single-precision numbers; `None` if fewer are left.
    pub(crate) fn floats<const N: usize>(&mut self) -> Option<[f32; N]> {
        let mut out = [0.0; N];
        for x in &mut out {
            *x = self.f32()?;
        }
        Some(out)
    }
}
