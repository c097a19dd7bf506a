//! A camera of Video4Linux 2. This file has not been run with a camera: the tests have none.
//!
//! `linuxvideo` speaks to the kernel itself; the better known `v4l` links or generates bindings of C.
//!
//! The time of a picture is the time when the driver delivers it, because `linuxvideo` does not pass on the driver's
//! own.

use std::io;
use std::path::{Path, PathBuf};

use hzn_run::source::raw::{Format, Raw};
use linuxvideo::format::{PixFormat, PixelFormat};
use linuxvideo::stream::ReadStream;

use super::device::{Device, OpenDevice};
use super::samples::Samples;

/// The pixel formats that are asked for, in this order.
const FORMATS: [(&[u8; 4], Option<Format>); 5] = [
    (b"GREY", Some(Format::Mono8)),
    (b"YUYV", None),
    (b"Y10 ", Some(Format::Words(10))),
    (b"Y12 ", Some(Format::Words(12))),
    (b"Y16 ", Some(Format::Words(16))),
];

/// A camera by the path of its device.
#[derive(Debug, Clone)]
pub struct V4l2 {
    path: PathBuf,
    width: u32,
    height: u32,
}

impl V4l2 {
    /// Makes the camera of a device, with pictures of this size.
    pub fn new(path: &Path, width: u32, height: u32) -> Self {
        Self { path: path.to_owned(), width, height }
    }

    fn samples(&self, format: Option<Format>) -> Samples {
        let (width, height) = (self.width, self.height);
        match format {
            Some(format) => Samples::Raw(Raw { width, height, format }),
            None => Samples::Yuyv { width, height },
        }
    }
}

impl OpenDevice for V4l2 {
    fn name(&self) -> String {
        self.path.display().to_string()
    }

    fn open(&self) -> io::Result<Box<dyn Device>> {
        let mut offered = String::new();
        for (code, format) in FORMATS {
            let device = linuxvideo::Device::open(&self.path)?;
            let wanted = PixFormat::new(self.width, self.height, PixelFormat::from_fourcc(*code));
            let Ok(capture) = device.video_capture(wanted) else { continue };
            let got = capture.format();
            if (got.width(), got.height(), got.pixel_format().as_fourcc()) == (self.width, self.height, *code) {
                let samples = self.samples(format);
                let stride = got.bytes_per_line() as usize;
                return Ok(Box::new(Stream { samples, stride, stream: capture.into_stream()? }));
            }
            let code = String::from_utf8_lossy(&got.pixel_format().as_fourcc()).into_owned();
            offered = format!("; it offers {}x{} {code}", got.width(), got.height());
        }
        let what = format!("no picture of {}x{} as GREY, YUYV, Y10, Y12 or Y16{offered}", self.width, self.height);
        Err(io::Error::new(io::ErrorKind::Unsupported, what))
    }
}

struct Stream {
    samples: Samples,
    stride: usize,
    stream: ReadStream,
}

impl Device for Stream {
    fn samples(&self) -> Samples {
        self.samples
    }
    fn stride(&self) -> usize {
        self.stride
    }
    fn wait(&mut self, take: &mut dyn FnMut(&[u8])) -> io::Result<()> {
        self.stream.dequeue(|view| {
            // The driver marks pictures with transmission errors; an empty picture counts as lost.
            take(if view.is_error() { &[] } else { &view });
            Ok(())
        })
    }
}
