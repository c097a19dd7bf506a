//! Arrays as pictures.

use hzn_core::image::{Channel, ImageView, Layout};
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors;

/// The samples of an array: borrowed when it is C-contiguous, else copied row by row.
pub(crate) enum Array<'py> {
    /// uint8.
    Bytes(PyReadonlyArrayDyn<'py, u8>),
    /// uint16.
    Words(PyReadonlyArrayDyn<'py, u16>),
}

impl<'py> Array<'py> {
    /// Takes an array of uint8 or uint16, height x width or height x width x 1 to 4.
    pub(crate) fn of(object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let Ok(untyped) = object.cast::<PyUntypedArray>() else {
            let name = object.get_type().name().map(|n| n.to_string()).unwrap_or_default();
            return Err(errors::image(format!("a numpy array is expected, not {name}: numpy.asarray(...) makes one")));
        };
        let shape = untyped.shape().to_vec();
        if !matches!(shape[..], [_, _] | [_, _, 1..=4]) {
            return Err(errors::image(format!(
                "shape {shape:?}: a picture is (height, width) or (height, width, channels) with 1 to 4 channels"
            )));
        }
        if shape.contains(&0) {
            return Err(errors::image(format!("shape {shape:?}: the picture is empty")));
        }
        if let Ok(bytes) = object.cast::<PyArrayDyn<u8>>() {
            return Ok(Self::Bytes(bytes.try_readonly().map_err(errors::image)?));
        }
        if let Ok(words) = object.cast::<PyArrayDyn<u16>>() {
            return Ok(Self::Words(words.try_readonly().map_err(errors::image)?));
        }
        let dtype = untyped.dtype().to_string();
        Err(errors::image(format!(
            "dtype {dtype}: uint8 or uint16 is expected; scale to counts and convert with astype(numpy.uint16)"
        )))
    }

    fn shape(&self) -> &[usize] {
        match self {
            Self::Bytes(a) => a.shape(),
            Self::Words(a) => a.shape(),
        }
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> (usize, usize) {
        (self.shape()[1], self.shape()[0])
    }

    /// The layout of the samples, packed. `bits` are the significant ones of uint16.
    pub(crate) fn layout(&self, bits: Option<u8>) -> PyResult<Layout> {
        let side = |n: usize| u32::try_from(n).map_err(errors::image);
        let (width, height) = self.size();
        let channels = self.shape().get(2).map_or(1, |&c| c as u8);
        let bits = match (self, bits) {
            (Self::Bytes(_), None | Some(8)) => 8,
            (Self::Bytes(_), Some(_)) => return Err(errors::image("bits: an array of uint8 has 8")),
            (Self::Words(_), None) => 16,
            (Self::Words(_), Some(n @ 8..=16)) => n,
            (Self::Words(_), Some(n)) => return Err(errors::image(format!("bits: {n} is not within 8 to 16"))),
        };
        Ok(Layout::packed(side(width)?, side(height)?, channels, bits))
    }

    /// Its samples in C order.
    pub(crate) fn samples(&self) -> Samples<'_> {
        match self {
            Self::Bytes(a) => match a.as_array().to_slice() {
                Some(slice) => Samples::Bytes(slice),
                None => Samples::OwnBytes(a.as_array().iter().copied().collect()),
            },
            Self::Words(a) => match a.as_array().to_slice() {
                Some(slice) => Samples::Words(slice),
                None => Samples::OwnWords(a.as_array().iter().copied().collect()),
            },
        }
    }
}

/// Samples in C order.
pub(crate) enum Samples<'a> {
    Bytes(&'a [u8]),
    Words(&'a [u16]),
    OwnBytes(Vec<u8>),
    OwnWords(Vec<u16>),
}

impl Samples<'_> {
    /// The picture for the pipeline.
    pub(crate) fn view(&self, layout: Layout, channel: Channel) -> PyResult<ImageView<'_>> {
        let view = match self {
            Self::Bytes(d) => ImageView::from_bytes(d, layout, channel),
            Self::OwnBytes(d) => ImageView::from_bytes(d, layout, channel),
            Self::Words(d) => ImageView::from_words(d, layout, channel),
            Self::OwnWords(d) => ImageView::from_words(d, layout, channel),
        };
        view.map_err(errors::image)
    }

    /// A copy, for drawing on.
    pub(crate) fn into_owned(self) -> hzn_cli::input::picture::Samples {
        use hzn_cli::input::picture::Samples as Own;
        match self {
            Self::Bytes(d) => Own::Bytes(d.to_vec()),
            Self::OwnBytes(d) => Own::Bytes(d),
            Self::Words(d) => Own::Words(d.to_vec()),
            Self::OwnWords(d) => Own::Words(d),
        }
    }
}
