//! Writes and reads a status by its name.

use hzn_core::status::Status;
use serde::{Deserialize, Deserializer, Serializer, de};

pub(crate) fn serialize<S: Serializer>(status: &Status, s: S) -> Result<S::Ok, S::Error> {
    s.serialize_str(status.name())
}
pub(crate) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Status, D::Error> {
    let name = String::deserialize(d)?;
    Status::ALL
        .into_iter()
        .find(|s| s.name() == name)
        .ok_or_else(|| de::Error::invalid_value(de::Unexpected::Str(&name), &"the name of a status, for example ok"))
}
