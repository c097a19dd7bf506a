//! Tests of a run over a sequence.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use hzn_core::image::Layout;
use hzn_core::{Config, camera};

use super::{End, Finished, Plan, Sink, Turns, run};
use crate::error::Error;
use crate::source::{Item, Payload, Picture, Source, TimeSource, picture::Samples};

/// A source that counts the pictures that were handed out but not yet written.
struct Counted<'a> {
    left: u64,
    pending: &'a AtomicU64,
    largest: &'a AtomicU64,
}

impl Source for Counted<'_> {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        self.left = self.left.checked_sub(1)?;
        let pending = self.pending.fetch_add(1, Ordering::SeqCst) + 1;
        self.largest.fetch_max(pending, Ordering::SeqCst);
        let layout = Layout::packed(32, 24, 1, 8);
        let picture = Picture::new(Samples::Bytes(vec![7; 32 * 24]), layout);
        Some(Ok(Item {
            name: self.left.to_string(),
            time: TimeSource::Count,
            stamp: None,
            data: None,
            payload: Payload::Decoded(picture),
        }))
    }
    fn total(&self) -> Option<u64> {
        None
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        Box::new(std::iter::empty())
    }
    fn folder(&self) -> std::path::PathBuf {
        Default::default()
    }
}

struct Slow<'a>(&'a AtomicU64);

impl Sink for Slow<'_> {
    fn write(&mut self, _frame: &mut Finished) -> Result<(), Error> {
        std::thread::sleep(Duration::from_millis(1));
        self.0.fetch_sub(1, Ordering::SeqCst);
        Ok(())
    }
    fn flush(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

#[test]
fn a_slow_disk_does_not_fill_the_memory() {
    let mut config = Config::new(camera::Config::ideal(camera::Model::Pinhole, 32, 24, 30.0));
    config.body.altitude_km = Some(400.0);
    let plan = Plan {
        config,
        flight: true,
        threads: 3,
        frames: None,
        fps: 1.0,
        trace: false,
        keep_traces: false,
        keep_picture: false,
        overlay: None,
        masks: None,
        last: Vec::new(),
        turns: Turns::default(),
    };
    let (pending, largest) = (AtomicU64::new(0), AtomicU64::new(0));
    let mut source = Counted { left: 200, pending: &pending, largest: &largest };
    let mut written = 0;
    let stop = AtomicBool::new(false);
    let end = run(&plan, &mut source, 0, &stop, &mut Slow(&pending), &mut |_| written += 1).unwrap();
    assert_eq!((end, written, pending.into_inner()), (End::Complete, 200, 0));
    let largest = largest.into_inner();
    assert!((3..=2 * 3 + 3).contains(&largest), "{largest} pictures at once");
}
