//! NumPy arrays as pictures.

use hzn_core::config::Input;
use hzn_core::image::{Channel, ImageView, Layout, Pixels};
use hzn_mcap::{doubt_scale, words_from_floats};
use hzn_run::source::{Levels, picture};
use numpy::ndarray::{Array3, ArrayD, ArrayView3, ArrayViewD, Axis, Ix2, Ix3};
use numpy::{
    IntoPyArray, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::intern;
use pyo3::prelude::*;

use crate::errors;

/// The samples of an array, borrowed.
pub(crate) enum Array<'py> {
    /// uint8.
    Bytes(PyReadonlyArrayDyn<'py, u8>),
    /// uint16.
    Words(PyReadonlyArrayDyn<'py, u16>),
    /// Numbers with a fraction as 16 bits, see [`words_from_floats`].
    Floats(PyReadonlyArrayDyn<'py, u16>),
}

impl<'py> Array<'py> {
    /// Takes an array of uint8, uint16 or floats with the shape (height, width) or (height, width, 1 to 4).
    pub(crate) fn from_object(object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let Ok(untyped) = object.cast::<PyUntypedArray>() else {
            if object.is_none() {
                let what = "the picture is None: cv2.imread returns None for a file that it cannot read";
                return Err(errors::image(what));
            }
            let name = object.get_type().name().map(|n| n.to_string()).unwrap_or_default();
            return Err(errors::image(format!("a numpy array is expected, not {name}: numpy.asarray(...) makes one")));
        };
        if object.hasattr(intern!(object.py(), "mask"))? {
            return Err(errors::image(
                "the array is masked, and its mask would be ignored: leave areas out with mask.polygons_px of the \
                 sensor, and pass image.data",
            ));
        }
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
        if untyped.dtype().kind() == b'f' {
            return Self::from_floats(object);
        }
        let dtype = untyped.dtype().to_string();
        Err(errors::image(format!(
            "dtype {dtype}: uint8, uint16 or floats are expected; scale to counts and convert with astype(numpy.uint16)"
        )))
    }

    /// Takes an array of floats, such as temperatures, as a file of them is taken.
    fn from_floats(object: &Bound<'py, PyAny>) -> PyResult<Self> {
        let numbers = object.call_method1("astype", ("float64",))?;
        let numbers = numbers.cast::<PyArrayDyn<f64>>()?.try_readonly().map_err(errors::image)?;
        let numbers = numbers.as_array();
        let values: Vec<f64> = numbers.iter().copied().collect();
        let words = ArrayD::from_shape_vec(numbers.raw_dim(), words_from_floats(&values).map_err(errors::image)?);
        let words = words.map_err(errors::image)?.into_pyarray(object.py());
        Ok(Self::Floats(words.try_readonly().map_err(errors::image)?))
    }

    fn shape(&self) -> &[usize] {
        match self {
            Self::Bytes(a) => a.shape(),
            Self::Words(a) | Self::Floats(a) => a.shape(),
        }
    }

    /// Returns width and height in pixels.
    pub(crate) fn size(&self) -> (usize, usize) {
        (self.shape()[1], self.shape()[0])
    }

    /// Returns the layout of the samples in C order. `bits` is the number of significant bits of uint16.
    pub(crate) fn layout(&self, bits: Option<u8>) -> PyResult<Layout> {
        let side = |n: usize| u32::try_from(n).map_err(errors::image);
        let (width, height) = self.size();
        let channels = self.shape().get(2).map_or(1, |&c| c as u8);
        let bits = match (self, bits) {
            (Self::Bytes(_), None | Some(8)) => 8,
            (Self::Bytes(_), Some(_)) => return Err(errors::image("bits: must be 8 for an array of uint8")),
            (Self::Floats(_), Some(_)) => {
                return Err(errors::image("bits: must be left out for an array of floats"));
            }
            (Self::Words(_) | Self::Floats(_), None) => 16,
            (Self::Words(_), Some(n @ 8..=16)) => n,
            (Self::Words(_), Some(n)) => return Err(errors::image(format!("bits: {n} is refused: must be 8 to 16"))),
        };
        Ok(Layout::packed(side(width)?, side(height)?, channels, bits))
    }

    /// Returns the number of significant bits: the given one, or for uint16 the one of the sensor.
    pub(crate) fn bits(&self, given: Option<u8>, input: &Input) -> Option<u8> {
        given.or(input.bits.filter(|_| matches!(self, Self::Words(_))))
    }

    /// Returns advice for a picture without an answer: the number of bits is not given, or does not fit the samples, or
    /// few numbers set the scale of floats.
    pub(crate) fn doubt_samples(&self, bits: Option<u8>) -> Option<String> {
        match self {
            Self::Words(a) => {
                let levels: Levels = a.as_array().iter().copied().collect();
                bits.map_or_else(|| levels.advice(), |bits| levels.exceed(bits))
            }
            Self::Floats(a) => doubt_scale(a.as_array().as_slice()?),
            Self::Bytes(_) => None,
        }
    }

    /// Returns the picture for the pipeline, without a copy.
    pub(crate) fn view(&self, bits: Option<u8>, channel: Channel) -> PyResult<View<'_>> {
        let layout = self.layout(bits)?;
        let packed = match self {
            Self::Bytes(a) => a.as_array().to_slice().map(|d| ImageView::from_bytes(d, layout, channel)),
            Self::Words(a) | Self::Floats(a) => {
                a.as_array().to_slice().map(|d| ImageView::from_words(d, layout, channel))
            }
        };
        match packed {
            Some(view) => Ok(View::Packed(view.map_err(errors::image)?)),
            None => Ok(View::Strided(Strided::try_new(self, layout, channel)?)),
        }
    }

    /// Returns a copy of the samples to draw on.
    pub(crate) fn to_samples(&self) -> picture::Samples {
        match self {
            Self::Bytes(a) => picture::Samples::Bytes(a.as_array().iter().copied().collect()),
            Self::Words(a) | Self::Floats(a) => picture::Samples::Words(a.as_array().iter().copied().collect()),
        }
    }
}

/// A picture in Python's memory.
pub(crate) enum View<'a> {
    /// Samples in C order, which are read fastest.
    Packed(ImageView<'a>),
    /// Samples in any other order.
    Strided(Strided<'a>),
}

enum Samples<'a> {
    Bytes(ArrayView3<'a, u8>),
    Words(ArrayView3<'a, u16>),
}

/// A picture with any strides: part of an array, transposed, upside down, or a single colour. A pixel costs more than
/// in a packed picture, but few pixels are read.
pub(crate) struct Strided<'a> {
    samples: Samples<'a>,
    layout: Layout,
    /// Channels that the brightness is computed from.
    channels: std::ops::Range<usize>,
}

/// Index distance between rows, larger than the width of any picture.
const DOWN: usize = 1 << 16;

impl<'a> Strided<'a> {
    fn try_new(array: &'a Array<'_>, layout: Layout, channel: Channel) -> PyResult<Self> {
        // The rules for channels are the same as for a packed picture.
        let pixel = [0u8; 4];
        let one = Layout { bits: 8, ..Layout::packed(1, 1, layout.channels, 8) };
        ImageView::from_bytes(&pixel, one, channel).map_err(errors::image)?;
        if layout.width > u32::from(u16::MAX) || layout.height > u32::from(u16::MAX) {
            return Err(errors::image("width and height must be 1 to 65535 pixels"));
        }
        let samples = match array {
            Array::Bytes(a) => Samples::Bytes(to_three_axes(a.as_array())?),
            Array::Words(a) | Array::Floats(a) => Samples::Words(to_three_axes(a.as_array())?),
        };
        let channels = match channel {
            Channel::Mean if layout.channels >= 3 => 0..3,
            Channel::Green => 1..2,
            Channel::Blue => 2..3,
            _ => 0..1,
        };
        Ok(Self { samples, layout, channels })
    }
}

fn to_three_axes<T>(array: ArrayViewD<'_, T>) -> PyResult<ArrayView3<'_, T>> {
    match array.ndim() {
        2 => array.into_dimensionality::<Ix2>().map(|a| a.insert_axis(Axis(2))),
        _ => array.into_dimensionality::<Ix3>(),
    }
    .map_err(errors::image)
}

impl Pixels for Strided<'_> {
    fn width(&self) -> u16 {
        self.layout.width as u16
    }
    fn height(&self) -> u16 {
        self.layout.height as u16
    }
    fn full_scale(&self) -> u16 {
        ((1u32 << self.layout.bits) - 1) as u16
    }
    fn index(&self, x: u16, y: u16) -> usize {
        usize::from(y) * DOWN + usize::from(x)
    }
    fn across(&self) -> usize {
        1
    }
    fn down(&self) -> usize {
        DOWN
    }
    fn read(&self, index: usize) -> u16 {
        let (y, x) = (index / DOWN, index % DOWN);
        let of = |c: usize| match &self.samples {
            Samples::Bytes(a) => a.get((y, x, c)).copied().map(u32::from),
            Samples::Words(a) => a.get((y, x, c)).copied().map(u32::from),
        };
        let sum: u32 = self.channels.clone().filter_map(of).sum();
        (sum / self.channels.len() as u32) as u16
    }
}

/// Returns a decoded picture as an array: (height, width), or (height, width, channels) with several channels.
pub(crate) fn to_array(py: Python<'_>, picture: picture::Picture) -> PyResult<Bound<'_, PyAny>> {
    let l = picture.layout;
    let shape = (l.height as usize, l.width as usize, usize::from(l.channels));
    let array = match picture.samples {
        picture::Samples::Bytes(d) => {
            Array3::from_shape_vec(shape, d).map_err(errors::image)?.into_pyarray(py).into_any()
        }
        picture::Samples::Words(d) => {
            Array3::from_shape_vec(shape, d).map_err(errors::image)?.into_pyarray(py).into_any()
        }
    };
    if l.channels == 1 { array.call_method1("reshape", (shape.0, shape.1)) } else { Ok(array) }
}
