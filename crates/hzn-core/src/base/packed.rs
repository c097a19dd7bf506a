//! Values as bytes in a fixed order, for a sensor that is prepared on another computer.
//!
//! Numbers are little-endian on every machine. Each type writes its parts one after the other, without names. Reading
//! never panics: bytes that cannot be right mark the reader as refused, and the caller asks for this once, at the end.

/// A value that can be written as bytes and read back.
pub trait Packed: Sized {
    /// Writes the value.
    fn pack(&self, to: &mut Packer<'_>);
    /// Reads a value. What it returns has no meaning if the reader has [`Unpacker::refused`] the bytes.
    // There is no `Result` of a value: each part is made where it stays, and not on the stack first.
    fn unpack(from: &mut Unpacker<'_>) -> Self;
}

/// Writes bytes one after the other. Bytes behind the end of the buffer are only counted.
#[derive(Debug)]
pub struct Packer<'a> {
    bytes: &'a mut [u8],
    length: usize,
}

impl<'a> Packer<'a> {
    /// Begins at the start of the buffer.
    pub(crate) fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes, length: 0 }
    }

    /// Returns the number of bytes that the values take, which may be more than the buffer has.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    pub(crate) fn put(&mut self, bytes: &[u8]) {
        let place = self.bytes.get_mut(self.length..).and_then(|rest| rest.get_mut(..bytes.len()));
        if let Some(place) = place {
            place.copy_from_slice(bytes);
        }
        self.length = self.length.saturating_add(bytes.len());
    }
}

/// Reads bytes one after the other.
#[derive(Debug)]
pub struct Unpacker<'a> {
    rest: &'a [u8],
    refused: bool,
}

impl<'a> Unpacker<'a> {
    /// Begins at the start of the bytes.
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, refused: false }
    }

    /// Returns whether any value was not right.
    pub(crate) fn refused(&self) -> bool {
        self.refused
    }

    /// Returns whether all bytes were read.
    pub(crate) fn is_at_end(&self) -> bool {
        self.rest.is_empty()
    }

    /// Refuses the bytes unless a condition holds.
    #[inline]
    pub(crate) fn require(&mut self, holds: bool) {
        self.refused |= !holds;
    }

    /// Refuses the bytes unless a number lies within limits.
    // One copy in flash for all keys.
    #[inline(never)]
    pub(crate) fn limit(&mut self, x: f64, low: f64, above: bool, high: f64) {
        self.require(x >= low && x <= high && !(above && x == low));
    }

    /// Returns the next bytes; zeros behind the end, which also refuses them.
    #[inline(never)]
    pub(crate) fn take<const N: usize>(&mut self) -> [u8; N] {
        match self.rest.split_first_chunk::<N>() {
            Some((taken, rest)) => {
                self.rest = rest;
                *taken
            }
            None => {
                (self.rest, self.refused) = (&[], true);
                [0; N]
            }
        }
    }
}

macro_rules! numbers {
    ($($t:ty, $x:ident => $is_right:expr;)+) => {$(
        impl Packed for $t {
            fn pack(&self, to: &mut Packer<'_>) {
                to.put(&self.to_le_bytes());
            }
            #[inline(never)]
            fn unpack(from: &mut Unpacker<'_>) -> Self {
                let $x = Self::from_le_bytes(from.take());
                from.require($is_right);
                $x
            }
        }
    )+};
}
// No number of a sensor is infinite, so that one that is not finite was not written by us.
numbers! {
    u8, x => true;
    u16, x => true;
    u32, x => true;
    f32, x => x.is_finite();
    f64, x => x.is_finite();
}

impl Packed for bool {
    fn pack(&self, to: &mut Packer<'_>) {
        to.put(&[u8::from(*self)]);
    }
    #[inline(never)]
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        let [byte] = from.take();
        from.require(byte <= 1);
        byte == 1
    }
}

impl<P: Packed> Packed for Option<P> {
    fn pack(&self, to: &mut Packer<'_>) {
        self.is_some().pack(to);
        if let Some(value) = self {
            value.pack(to);
        }
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        bool::unpack(from).then(|| P::unpack(from))
    }
}

impl<P: Packed, const N: usize> Packed for [P; N] {
    fn pack(&self, to: &mut Packer<'_>) {
        self.iter().for_each(|value| value.pack(to));
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        core::array::from_fn(|_| P::unpack(from))
    }
}

impl<P: Packed, const N: usize> Packed for heapless::Vec<P, N> {
    fn pack(&self, to: &mut Packer<'_>) {
        // Every list of a configuration has fewer than 256 elements.
        (self.len() as u8).pack(to);
        self.iter().for_each(|value| value.pack(to));
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        let mut list = Self::new();
        unpack_list(&mut list, from);
        list
    }
}

/// Reads the elements of a list to its end.
// A list that a function returns is on the stack twice; one that is filled in its place is not.
pub(crate) fn unpack_list<P: Packed, const N: usize>(list: &mut heapless::Vec<P, N>, from: &mut Unpacker<'_>) {
    for _ in 0..u8::unpack(from) {
        let taken = list.push(P::unpack(from)).is_ok();
        from.require(taken);
    }
}

/// Reads a list of at most `N` elements, and drops it.
#[inline(never)]
pub(crate) fn check_list<P: Packed, const N: usize>(from: &mut Unpacker<'_>) {
    let length = usize::from(u8::unpack(from));
    from.require(length <= N);
    for _ in 0..length.min(N) {
        let _ = P::unpack(from);
    }
}
