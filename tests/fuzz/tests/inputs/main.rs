//! Tests of the readers with the corpora of the fuzzer, of the licences and of the case for trust.

mod assurance;
mod replay;
mod supply;
