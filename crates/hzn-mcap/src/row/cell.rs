//! The types of cells.

use hzn_core::status::Status;

/// The type of a cell.
#[cfg_attr(not(feature = "recordings"), allow(dead_code, reason = "only recordings have a schema"))]
pub(super) trait Cell {
    /// Type of the cell in JSON.
    const JSON: &'static str;
    /// Whether every row has a value in this cell.
    const ALWAYS: bool = true;
    fn empty() -> Self;
    /// Returns the text, if the cell has one that is not chosen from a list.
    fn text(&self) -> Option<&str> {
        None
    }
    fn text_mut(&mut self) -> Option<&mut String> {
        None
    }
}

macro_rules! cells {
    ($($ty:ty, $json:literal, $empty:expr;)+) => {$(
        impl Cell for $ty {
            const JSON: &'static str = $json;
            fn empty() -> Self {
                $empty
            }
        }
    )+};
}
cells! {
    f64, "number", 0.0;
    u16, "integer", 0;
    u32, "integer", 0;
    u64, "integer", 0;
    bool, "boolean", false;
    Status, "string", Status::Rejected;
}

impl Cell for String {
    const JSON: &'static str = "string";
    fn empty() -> Self {
        Self::new()
    }
    fn text(&self) -> Option<&str> {
        Some(self)
    }
    fn text_mut(&mut self) -> Option<&mut String> {
        Some(self)
    }
}

impl<T: Cell> Cell for Option<T> {
    const JSON: &'static str = T::JSON;
    const ALWAYS: bool = false;
    fn empty() -> Self {
        None
    }
    fn text(&self) -> Option<&str> {
        self.as_ref().and_then(T::text)
    }
    fn text_mut(&mut self) -> Option<&mut String> {
        self.as_mut().and_then(T::text_mut)
    }
}
