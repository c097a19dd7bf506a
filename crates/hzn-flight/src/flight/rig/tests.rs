use std::boxed::Box;

use hzn_core::status::Status;

use super::*;
use crate::board::Picture;
use crate::view::Viewer;

/// A board without cameras and memory.
struct Silent(u64);

impl Board for Silent {
    fn now_us(&mut self) -> u64 {
        self.0 += 10;
        self.0
    }
    fn receive(&mut self) -> Option<u8> {
        None
    }
    fn send(&mut self, _bytes: &[u8]) {}
    fn lift_off(&mut self) -> bool {
        false
    }
    fn power_fails(&mut self) -> bool {
        false
    }
    fn was_watchdog_reset(&mut self) -> bool {
        false
    }
    fn feed_watchdog(&mut self) {}
    fn camera_answers(&mut self) -> bool {
        true
    }
    fn next_picture(&mut self) -> Option<Picture> {
        None
    }
    fn show(&mut self, _viewer: &mut Viewer<'_>) {}
    fn read_copy(&mut self, _copy: u8, _into: &mut [u8]) {}
    fn write_copy(&mut self, _copy: u8, _bytes: &[u8]) -> bool {
        false
    }
    fn stack_bytes(&mut self) -> u32 {
        0
    }
}

impl RigBoard for Silent {
    fn select_head(&mut self, _head: u8) {}
}

fn answer(exposure_us: u64, checksum: u32) -> head_board::HeadAnswer {
    let checksum = Some(checksum);
    head_board::HeadAnswer {
        picture: 1,
        exposure_us,
        status: Status::NoLimb,
        solution: None,
        checksum,
        rate_rad_s: None,
    }
}

#[test]
fn a_flipped_bit_costs_the_epoch() {
    let (mut board, setup) = (Silent(0), Setup::new(ApidBase::DEFAULT));
    let (mut buffers, mut lists) = (RigBuffers::new(), Box::new(Lists::new()));
    let mut own = Box::new([const { HeadBuffers::new() }; 2]);
    let (mut heads, checked) = (Box::new(Heads::new()), setup.check().unwrap());
    let mut rig = Rig::new(&mut board, checked, &mut heads, (&mut buffers, &mut own), &mut lists);
    rig.turn();
    rig.add(0, answer(1000, 1));
    rig.pending.value_mut().repeated ^= 1;
    rig.turn();
    assert_eq!((rig.repairs, rig.number, rig.pending.get().seen()), (1, 0, 0));
    rig.joining.value_mut().common.sigma_rad = 1.0;
    rig.turn();
    assert_eq!((rig.repairs, rig.joining.get().common.sigma_rad), (2, 0.0));
    // Without a flip, the epoch ends at once, because no head is in flight mode.
    rig.add(0, answer(2000, 2));
    rig.turn();
    assert_eq!((rig.repairs, rig.number), (2, 1));
}

#[test]
fn exposures_find_their_epoch() {
    let mut pending = Pending::NONE;
    assert_eq!(pending.place(0, 1000, 100), Place::Here);
    pending.add(0, answer(1000, 1));
    let places = [(1, 1100), (1, 900), (1, 1101), (1, 899), (0, 1000)].map(|(k, us)| pending.place(k, us, 100));
    assert_eq!(places, [Place::Here, Place::Here, Place::Next, Place::Late, Place::Next]);
    // The checksum of another head, and that of the epoch before.
    pending.add(1, answer(1010, 1));
    assert_eq!((pending.repeated, pending.seen()), (0b10, 0b11));
    pending.close();
    assert_eq!([1010, 1011].map(|us| pending.place(2, us, 100)), [Place::Late, Place::Here]);
    pending.add(0, answer(2000, 1));
    assert_eq!(pending.repeated, 0b01);
}
