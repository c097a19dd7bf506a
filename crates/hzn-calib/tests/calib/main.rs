//! Tests of the conversion of lenses.

mod conversion;
