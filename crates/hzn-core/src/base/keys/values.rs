//! The types that a key can have.

use super::{Choice, Form, Value};
use crate::base::error::{ConfigError, Limit, require};
use crate::base::packed::Unpacker;

/// Checks one number. Every key calls this one copy in flash.
#[inline(never)]
pub(crate) fn check_number(path: &'static str, x: f64, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
    require(x.is_finite(), path, x, Limit::Finite)?;
    require(!above || x > low, path, x, Limit::Above(low))?;
    // A limit of infinity would be printed as "between 0 and inf"; "at least" says what is meant.
    let limit = match (above, high.is_finite()) {
        // The lower limit itself is refused, so "between" would be wrong.
        (true, true) => Limit::AtMost(high),
        (false, true) => Limit::Between(low, high),
        (_, false) => Limit::AtLeast(low),
    };
    require(x >= low && x <= high, path, x, limit)
}

impl Value for f64 {
    const FORM: Form = Form::Number;
    fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
        check_number(path, *self, low, above, high)
    }
    fn limit(&self, from: &mut Unpacker<'_>, low: f64, above: bool, high: f64) {
        from.limit(*self, low, above, high);
    }
    fn number(&self, _place: u16) -> f64 {
        *self
    }
    fn set_number(&mut self, _place: u16, number: f64) -> Option<()> {
        // NaN is refused here because it means "left out" for an option, and this number cannot be left out.
        *self = Some(number).filter(|x| x.is_finite())?;
        Some(())
    }
    fn empty() -> Option<Self> {
        Some(0.0)
    }
}

macro_rules! whole {
    ($($t:ty),*) => {$(
        impl Value for $t {
            const FORM: Form = Form::Whole;
            fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
                check_number(path, f64::from(*self), low, above, high)
            }
            fn limit(&self, from: &mut Unpacker<'_>, low: f64, above: bool, high: f64) {
                from.limit(f64::from(*self), low, above, high);
            }
            fn number(&self, _place: u16) -> f64 {
                f64::from(*self)
            }
            fn set_number(&mut self, _place: u16, number: f64) -> Option<()> {
                // The cast saturates and drops the fraction; the comparison afterwards refuses every number that it
                // changed.
                let whole = number as $t;
                *self = (f64::from(whole) == number).then_some(whole)?;
                Some(())
            }
            fn empty() -> Option<Self> {
                Some(0)
            }
        }
    )*};
}
whole!(u8, u16, u32);

impl Value for bool {
    const FORM: Form = Form::Flag;
}

impl<T: Value> Value for Option<T> {
    const FORM: Form = T::FORM;
    const NUMBERS: u16 = T::NUMBERS;
    const CHOICES: &'static [Choice] = T::CHOICES;
    fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
        self.as_ref().map_or(Ok(()), |value| value.check(path, low, above, high))
    }
    fn limit(&self, from: &mut Unpacker<'_>, low: f64, above: bool, high: f64) {
        if let Some(value) = self {
            value.limit(from, low, above, high);
        }
    }
    fn number(&self, place: u16) -> f64 {
        self.as_ref().map_or(f64::NAN, |value| value.number(place))
    }
    /// NaN leaves the value out.
    fn set_number(&mut self, place: u16, number: f64) -> Option<()> {
        if number.is_nan() {
            *self = None;
            return Some(());
        }
        // The numbers of a value arrive one by one, so that the others stay.
        let mut value = self.clone().or_else(T::empty)?;
        value.set_number(place, number)?;
        *self = Some(value);
        Some(())
    }
    fn is_absent(&self) -> bool {
        self.is_none()
    }
}

impl<const N: usize> Value for [f64; N] {
    const FORM: Form = Form::Numbers;
    const NUMBERS: u16 = N as u16;
    fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
        self.iter().try_for_each(|x| check_number(path, *x, low, above, high))
    }
    fn limit(&self, from: &mut Unpacker<'_>, low: f64, above: bool, high: f64) {
        self.iter().for_each(|x| from.limit(*x, low, above, high));
    }
    fn number(&self, place: u16) -> f64 {
        self.get(usize::from(place)).copied().unwrap_or(f64::NAN)
    }
    fn set_number(&mut self, place: u16, number: f64) -> Option<()> {
        *self.get_mut(usize::from(place))? = Some(number).filter(|x| x.is_finite())?;
        Some(())
    }
}

impl<const N: usize> Value for heapless::Vec<f64, N> {
    const FORM: Form = Form::Numbers;
    const NUMBERS: u16 = N as u16;
    fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
        self.iter().try_for_each(|x| check_number(path, *x, low, above, high))
    }
    fn limit(&self, from: &mut Unpacker<'_>, low: f64, above: bool, high: f64) {
        self.iter().for_each(|x| from.limit(*x, low, above, high));
    }
    /// Returns 0 when the list ends before `place`.
    fn number(&self, place: u16) -> f64 {
        self.get(usize::from(place)).copied().unwrap_or(0.0)
    }
    fn set_number(&mut self, place: u16, number: f64) -> Option<()> {
        let place = usize::from(place);
        let number = Some(number).filter(|x| x.is_finite())?;
        // Missing numbers read as 0, so a 0 behind the end needs no element. Otherwise a restored list would be longer
        // than the stored one, and would differ from it.
        while self.len() <= place && number != 0.0 {
            self.push(0.0).ok()?;
        }
        if let Some(value) = self.get_mut(place) {
            *value = number;
        }
        Some(())
    }
}

impl<const N: usize> Value for heapless::Vec<[f64; 2], N> {
    const FORM: Form = Form::Rows;
    fn is_absent(&self) -> bool {
        self.is_empty()
    }
}

impl<const C: usize, const N: usize> Value for heapless::Vec<heapless::Vec<[f64; 2], C>, N> {
    const FORM: Form = Form::Polygons;
}
