//! Numbers of records, and fields to and from little-endian bytes.

use std::collections::BTreeMap;

/// Numbers of the record kinds.
#[non_exhaustive]
pub(crate) struct Op;

impl Op {
    pub(crate) const HEADER: u8 = 0x01;
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const MESSAGE_INDEX: u8 = 0x07;
    pub(crate) const CHUNK_INDEX: u8 = 0x08;
    pub(crate) const ATTACHMENT: u8 = 0x09;
    pub(crate) const ATTACHMENT_INDEX: u8 = 0x0A;
    pub(crate) const STATISTICS: u8 = 0x0B;
    pub(crate) const METADATA: u8 = 0x0C;
    pub(crate) const METADATA_INDEX: u8 = 0x0D;
    pub(crate) const SUMMARY_OFFSET: u8 = 0x0E;
    pub(crate) const DATA_END: u8 = 0x0F;
}

/// Appends fields in MCAP's encoding.
pub(crate) trait Put {
    fn u8(&mut self, x: u8) -> &mut Self;
    fn u16(&mut self, x: u16) -> &mut Self;
    fn u32(&mut self, x: u32) -> &mut Self;
    fn u64(&mut self, x: u64) -> &mut Self;
    /// Appends a text: a length of four bytes, then the bytes.
    fn text(&mut self, x: &str) -> &mut Self;
    /// Appends a table: its length in bytes, then keys and values.
    fn map(&mut self, x: &BTreeMap<String, String>) -> &mut Self;
}

impl Put for Vec<u8> {
    fn u8(&mut self, x: u8) -> &mut Self {
        self.push(x);
        self
    }
    fn u16(&mut self, x: u16) -> &mut Self {
        self.extend_from_slice(&x.to_le_bytes());
        self
    }
    fn u32(&mut self, x: u32) -> &mut Self {
        self.extend_from_slice(&x.to_le_bytes());
        self
    }
    fn u64(&mut self, x: u64) -> &mut Self {
        self.extend_from_slice(&x.to_le_bytes());
        self
    }
    fn text(&mut self, x: &str) -> &mut Self {
        self.u32(x.len() as u32).extend_from_slice(x.as_bytes());
        self
    }
    fn map(&mut self, x: &BTreeMap<String, String>) -> &mut Self {
        let bytes: usize = x.iter().map(|(k, v)| 8 + k.len() + v.len()).sum();
        self.u32(bytes as u32);
        for (key, value) in x {
            self.text(key).text(value);
        }
        self
    }
}

/// Reads fields from the front of a record; `None` if it ends too early.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl<'a> Fields<'a> {
    pub(crate) fn bytes(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(n)?;
        self.0 = tail;
        Some(head)
    }
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.0.split_first_chunk::<N>()?;
        self.0 = tail;
        Some(*head)
    }
    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[x]| x)
    }
    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }
    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }
    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }
    pub(crate) fn text(&mut self) -> Option<&'a str> {
        let n = self.u32()?;
        std::str::from_utf8(self.bytes(n as usize)?).ok()
    }
    pub(crate) fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let n = self.u32()?;
        let mut inner = Fields(self.bytes(n as usize)?);
        let mut map = BTreeMap::new();
        while !inner.0.is_empty() {
            let key = inner.text()?.to_owned();
            map.insert(key, inner.text()?.to_owned());
        }
        Some(map)
    }
    /// Returns the data of an attachment if it has this name.
    pub(crate) fn attached(self, name: &str) -> Option<&'a [u8]> {
        self.attachment().filter(|(own, _)| *own == name).map(|(_, data)| data)
    }

    /// Reads an attachment: its name and its data.
    pub(crate) fn attachment(mut self) -> Option<(&'a str, &'a [u8])> {
        // An attachment begins with two times.
        self.bytes(16)?;
        let name = self.text()?;
        let (_media, size) = (self.text()?, self.u64()?);
        Some((name, self.bytes(usize::try_from(size).ok()?)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_come_back_and_short_ones_do_not() {
        let map = BTreeMap::from([("a".to_owned(), "1".to_owned()), ("bb".to_owned(), String::new())]);
        let mut bytes = Vec::new();
        bytes.u8(1).u16(2).u32(3).u64(4).text("µ").map(&map);
        let mut f = Fields(&bytes);
        assert_eq!((f.u8(), f.u16(), f.u32(), f.u64()), (Some(1), Some(2), Some(3), Some(4)));
        assert_eq!(f.text(), Some("µ"));
        assert_eq!(f.map(), Some(map));
        assert!(f.0.is_empty());
        for n in 0..bytes.len() {
            let mut f = Fields(&bytes[..n]);
            let all = (|| {
                f.u8()?;
                f.u16()?;
                f.u32()?;
                f.u64()?;
                f.text()?;
                f.map()
            })();
            assert!(all.is_none(), "{n}");
        }
    }
}
