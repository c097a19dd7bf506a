//! A camera that may be unplugged. The device itself is behind a trait, so that the tests have a camera without one.

use std::io;
use std::thread;
use std::time::Duration;

use super::samples::Samples;
use super::{Camera, Next};
use crate::tell::Tell;

/// A camera device that is open.
pub trait Device: Send {
    /// Returns the arrangement of the samples.
    fn samples(&self) -> Samples;
    /// Returns the bytes from the start of a row to the start of the next one.
    fn stride(&self) -> usize;
    /// Waits for a picture and passes its bytes on.
    ///
    /// # Errors
    /// The device fails, for example because it was unplugged.
    fn wait(&mut self, take: &mut dyn FnMut(&[u8])) -> io::Result<()>;
}

/// Opens a camera device.
pub trait OpenDevice: Send {
    /// Returns the name of the device for messages.
    fn name(&self) -> String;
    /// Opens the device.
    ///
    /// # Errors
    /// The device does not exist, or has no pictures of the wanted size and format. The error says which.
    fn open(&self) -> io::Result<Box<dyn Device>>;
}

/// Time between two attempts to open the device.
const AGAIN: Duration = Duration::from_secs(1);

/// A camera: a device that is opened again when it fails.
pub struct DeviceCamera {
    opener: Box<dyn OpenDevice>,
    device: Option<Box<dyn Device>>,
    again: Duration,
    /// Pictures that were lost since the last one.
    lost: u32,
    packed: Vec<u8>,
    tell: Tell,
}

impl DeviceCamera {
    /// Opens the camera.
    ///
    /// # Errors
    /// The device cannot be opened.
    pub fn open(opener: Box<dyn OpenDevice>, tell: Tell) -> io::Result<Self> {
        let device = Some(opener.open()?);
        Ok(Self { opener, device, again: AGAIN, lost: 0, packed: Vec::new(), tell })
    }

    fn take(&mut self, into: Option<&mut Vec<u8>>) -> io::Result<Next> {
        let Some(device) = &mut self.device else { return Ok(Next::Nothing) };
        let (samples, stride) = (device.samples(), device.stride());
        let Some(into) = into else {
            device.wait(&mut |_| ())?;
            self.lost = self.lost.saturating_add(1);
            return Ok(Next::Nothing);
        };
        let (packed, mut outcome) = (&mut self.packed, Ok(()));
        device.wait(&mut |bytes| {
            outcome = unpad(bytes, samples, stride, packed).and_then(|bytes| samples.convert(bytes, into));
        })?;
        match outcome {
            Ok(()) => Ok(Next::Picture { lost: std::mem::take(&mut self.lost) }),
            // A picture with a transmission error is shorter; the next one may be whole.
            Err(_) => {
                self.lost = self.lost.saturating_add(1);
                Ok(Next::Nothing)
            }
        }
    }
}

/// Removes the bytes after each row that belong to no pixel, and those after the picture.
fn unpad<'a>(bytes: &'a [u8], samples: Samples, stride: usize, packed: &'a mut Vec<u8>) -> Result<&'a [u8], String> {
    let row = samples.row_bytes();
    if stride <= row {
        return Ok(bytes.get(..samples.bytes()).unwrap_or(bytes));
    }
    packed.clear();
    bytes.chunks(stride).filter_map(|padded| padded.get(..row)).for_each(|row| packed.extend_from_slice(row));
    packed.truncate(samples.bytes());
    Ok(packed)
}

impl Camera for DeviceCamera {
    fn next(&mut self, into: Option<&mut Vec<u8>>) -> Next {
        if self.device.is_none() {
            thread::sleep(self.again);
            self.device = self.opener.open().ok();
            if self.device.is_some() {
                (self.tell)(&format!("{}: the camera is back", self.opener.name()));
            }
        }
        self.take(into).unwrap_or_else(|e| {
            let name = self.opener.name();
            (self.tell)(&format!("{name}: the camera has failed: {e}; it is opened again every second"));
            self.device = None;
            Next::Nothing
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;

    /// A camera with three pictures of 3×2 pixels in rows of four bytes, which is then unplugged.
    struct Fake {
        left: u8,
    }
    impl Device for Fake {
        fn samples(&self) -> Samples {
            Samples::Raw("3x2:mono8".parse().unwrap())
        }
        fn stride(&self) -> usize {
            4
        }
        fn wait(&mut self, take: &mut dyn FnMut(&[u8])) -> io::Result<()> {
            self.left = self.left.checked_sub(1).ok_or_else(|| io::Error::other("No such device"))?;
            let n = self.left;
            // The second picture is cut off.
            let whole = [n, n + 1, n + 2, 99, n, n + 1, n + 2, 99, 99];
            take(if n == 1 { &whole[..5] } else { &whole });
            Ok(())
        }
    }
    struct Opener;
    impl OpenDevice for Opener {
        fn name(&self) -> String {
            "fake".into()
        }
        fn open(&self) -> io::Result<Box<dyn Device>> {
            Ok(Box::new(Fake { left: 3 }))
        }
    }

    #[test]
    fn a_camera_may_be_unplugged() {
        let told = Arc::new(Mutex::new(Vec::<String>::new()));
        let list = Arc::clone(&told);
        let tell: Tell = Arc::new(move |line: &str| list.lock().unwrap().push(line.to_owned()));
        let mut camera = DeviceCamera::open(Box::new(Opener), tell).unwrap();
        camera.again = Duration::ZERO;
        let mut pixels = Vec::new();
        for _ in 0..2 {
            assert_eq!(camera.next(Some(&mut pixels)), Next::Picture { lost: 0 });
            assert_eq!(pixels, [2, 3, 4, 2, 3, 4]);
            assert_eq!(camera.next(Some(&mut pixels)), Next::Nothing);
            assert_eq!(camera.next(Some(&mut pixels)), Next::Picture { lost: 1 });
            assert_eq!(camera.next(Some(&mut pixels)), Next::Nothing);
        }
        // Without a buffer the picture is lost.
        assert_eq!(camera.next(None), Next::Nothing);
        camera.next(Some(&mut pixels));
        assert_eq!(camera.next(Some(&mut pixels)), Next::Picture { lost: 2 });
        let told = told.lock().unwrap();
        assert!(told[0].contains("fake: the camera has failed: No such device"), "{told:?}");
        assert!(told[1].contains("the camera is back"));
    }
}
