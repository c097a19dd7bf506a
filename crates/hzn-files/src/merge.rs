//! Merges TOML tables, and takes entries out of them.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// Adds to `table` the entries of `values` that it does not have. The added entries have no place in the file.
pub(crate) fn merge_missing<'i>(table: &mut DeTable<'i>, values: DeTable<'i>) {
    for (key, value) in values {
        match (table.get_mut(key.get_ref().as_ref()), value.into_inner()) {
            (Some(own), value) => {
                if let (DeValue::Table(own), DeValue::Table(values)) = (own.get_mut(), value) {
                    merge_missing(own, values);
                }
            }
            (None, value) => {
                let value = match value {
                    DeValue::Table(values) => {
                        let mut inner = DeTable::new();
                        merge_missing(&mut inner, values);
                        DeValue::Table(inner)
                    }
                    other => other,
                };
                table.insert(toml::Spanned::new(0..0, key.into_inner()), toml::Spanned::new(0..0, value));
            }
        }
    }
}

/// Takes an entry out of a table: its value and the bytes of the value in the file.
pub(crate) fn take<'i>(table: &mut DeTable<'i>, name: &str) -> Option<(DeValue<'i>, Range<usize>)> {
    table.remove(name).map(|value| {
        let span = value.span();
        (value.into_inner(), span)
    })
}
