//! The thread that waits for pictures.

use std::thread;
use std::time::Instant;

use crossbeam_channel::{Receiver, Sender, bounded};

use super::{Camera, Ended, Next};

/// Buffers for pictures: one is processed, one waits, one is filled.
const BUFFERS: usize = 3;

/// A picture with its place in the sequence.
#[derive(Debug)]
pub struct Shot {
    /// One byte for each pixel, row by row.
    pub pixels: Vec<u8>,
    /// Number of the picture since the start, from 0, with those that were lost.
    pub number: u64,
    /// Pictures that were lost since the one before.
    pub lost: u32,
    /// Time when the last byte came.
    pub ready: Instant,
    /// Time and name, if the picture was taken before the flight.
    pub recorded: Option<Recorded>,
}

/// What a recording says about a picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recorded {
    /// Time of the middle of the exposure on the clock of the flight, µs.
    pub exposure_us: u64,
    /// Its name.
    pub name: String,
}

/// What the thread sends.
#[derive(Debug)]
pub enum FromCamera {
    /// A picture.
    Shot(Shot),
    /// There are no more pictures.
    End(Ended),
}

/// Both ends of the way from the camera to the flight loop.
#[derive(Debug)]
pub struct Capture {
    /// The pictures.
    pub pictures: Receiver<FromCamera>,
    /// Takes the buffers of pictures that are no longer needed.
    pub spare: Sender<Vec<u8>>,
}

impl Capture {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system has no thread.
    pub fn start(camera: Box<dyn Camera>) -> std::io::Result<Self> {
        let (spare, empty) = bounded(BUFFERS);
        let (sender, pictures) = bounded(BUFFERS);
        for _ in 0..BUFFERS {
            // There is room for all of them.
            let _ = spare.try_send(Vec::new());
        }
        thread::Builder::new().name("camera".into()).spawn(move || run(camera, &empty, &sender))?;
        Ok(Self { pictures, spare })
    }
}

fn run(mut camera: Box<dyn Camera>, empty: &Receiver<Vec<u8>>, sender: &Sender<FromCamera>) {
    let mut number = 0;
    let mut buffer = None;
    loop {
        buffer = buffer.or_else(|| empty.try_recv().ok());
        if buffer.is_none() && camera.next(None) == Next::Nothing {
            // A pipe has not read anything, so there is time to wait for a buffer; a camera has lost a picture.
            buffer = empty.recv_timeout(std::time::Duration::from_millis(1)).ok();
            continue;
        }
        let Some(mut pixels) = buffer.take() else { return };
        match camera.next(Some(&mut pixels)) {
            Next::Picture { lost } => {
                let ready = Instant::now();
                number += u64::from(lost);
                let shot = Shot { pixels, number, lost, ready, recorded: None };
                number += 1;
                if sender.send(FromCamera::Shot(shot)).is_err() {
                    return;
                }
            }
            Next::Nothing => buffer = Some(pixels),
            Next::End(why) => {
                let _ = sender.send(FromCamera::End(why));
                return;
            }
        }
    }
}
