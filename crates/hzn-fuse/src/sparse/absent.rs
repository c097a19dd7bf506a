//! Stands for `cholesky` where faer is left out, because it takes a quarter of the time to compile `hzn`: nothing can
//! be solved, and whoever asks is told.

use std::convert::Infallible;

use super::Places;
use crate::error::Error;

pub(super) fn order(_: Places<'_>) -> Result<Vec<usize>, Error> {
    Err(Error::without_solver())
}

/// Does not exist here.
#[derive(Debug)]
pub(super) struct Lower(Infallible);

impl Lower {
    pub(super) fn new(_: Places<'_>) -> Result<Self, Error> {
        Err(Error::without_solver())
    }

    pub(super) fn places(&self) -> Places<'_> {
        match self.0 {}
    }

    pub(super) fn compute(&self, _: Places<'_>, _: &[f64], _: &mut [f64]) -> Option<()> {
        match self.0 {}
    }

    pub(super) fn solve(&self, _: &[f64], _: &mut [f64]) {
        match self.0 {}
    }
}
