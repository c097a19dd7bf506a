//! Schemas and channels, as a recording declares them.

use std::collections::BTreeMap;

use super::op::{Fields, Op};

/// A channel of any kind of messages.
#[derive(Debug, Clone)]
pub(crate) struct Channel {
    pub(crate) topic: String,
    pub(crate) schema: String,
    pub(crate) encoding: String,
}

/// The names of the schemas that a recording has declared so far, by their ids.
#[derive(Debug, Default)]
pub(crate) struct Schemas(BTreeMap<u16, String>);

impl Schemas {
    /// Reads a record. Returns id and channel if the record declares a channel.
    pub(crate) fn declare(&mut self, op: u8, content: &[u8]) -> Option<(u16, Channel)> {
        let mut f = Fields(content);
        match op {
            Op::SCHEMA => {
                let (id, name) = (f.u16()?, f.text()?.to_owned());
                self.0.insert(id, name);
                None
            }
            Op::CHANNEL => {
                let (id, schema, topic) = (f.u16()?, f.u16()?, f.text()?.to_owned());
                let encoding = f.text().unwrap_or_default().to_owned();
                Some((id, Channel { topic, schema: self.0.get(&schema).cloned().unwrap_or_default(), encoding }))
            }
            _ => None,
        }
    }
}
