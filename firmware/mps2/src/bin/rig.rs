//! A rig of four heads with pictures of 640×480 pixels: the joint answer with every bit, and what a head costs.
//!
//! `cases.bin` has a case for each head ([`hzn_mps2::cases`]); its prior is not used. `results.bin` has five words: the
//! ticks of a turn without a picture, of a turn with a picture of head 0 only, and of a turn with those of all heads;
//! the bytes of a rig with one head and its buffers; and those of each further head. The packets of the last turn
//! follow.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_flight::board::{Board, Picture};
use hzn_flight::flight::rig::{Heads, Rig, RigBoard, RigBuffers, Setup};
use hzn_flight::flight::{HeadBuffers, Lists};
use hzn_flight::packet::ApidBase;
use hzn_flight::view::Viewer;
use hzn_mps2::board::{self, Timer};
use hzn_mps2::cases::CaseHeader;
use hzn_mps2::host::{File, exit};
use static_cell::{ConstStaticCell, StaticCell};

const HEADS: usize = 4;
/// Bytes of packets that are kept.
const SENT: usize = 16_384;

static LOOPS: ConstStaticCell<Heads<'static, Cameras, HEADS>> = ConstStaticCell::new(Heads::new());
static CAMERAS: StaticCell<Cameras> = StaticCell::new();
static RIG_BUFFERS: ConstStaticCell<RigBuffers> = ConstStaticCell::new(RigBuffers::new());
static SETUP: Setup = Setup::new(ApidBase::DEFAULT);

/// Four cameras whose pictures are in memory. The clock is the number of calls, so that packets do not depend on the
/// speed of the board.
struct Cameras {
    now_us: u64,
    head: usize,
    /// Whether the camera of each head has a picture.
    is_ready: [bool; HEADS],
    pictures: [&'static [u8]; HEADS],
    /// Stand for the flash of the board.
    tables: [&'static [u8]; HEADS],
    sent: &'static mut [u8],
    len: usize,
}

impl Board for Cameras {
    fn now_us(&mut self) -> u64 {
        self.now_us += 10;
        self.now_us
    }
    fn receive(&mut self) -> Option<u8> {
        None
    }
    fn send(&mut self, bytes: &[u8]) {
        if let Some(room) = self.sent.get_mut(self.len..self.len + bytes.len()) {
            room.copy_from_slice(bytes);
            self.len += bytes.len();
        }
    }
    fn lift_off(&mut self) -> bool {
        true
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
        let is_ready = self.is_ready.get_mut(self.head)?;
        core::mem::take(is_ready).then_some(())?;
        Some(Picture { bytes: self.pictures.get(self.head)?.len(), exposure_us: self.now_us, lost: 0 })
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        viewer.see(self.pictures.get(self.head).copied().unwrap_or_default());
    }
    fn read_copy(&mut self, _copy: u8, into: &mut [u8]) {
        let table = self.tables.get(self.head).copied().unwrap_or_default();
        into.iter_mut().zip(table).for_each(|(to, from)| *to = *from);
    }
    fn write_copy(&mut self, _copy: u8, _bytes: &[u8]) -> bool {
        false
    }
    fn stack_bytes(&mut self) -> u32 {
        0
    }
}

impl RigBoard for Cameras {
    fn select_head(&mut self, head: u8) {
        self.head = head.into();
    }
}

#[entry]
fn main() -> ! {
    exit(match run() {
        Some(()) => 0,
        None => 1,
    })
}

/// Takes bytes of external memory.
fn take(memory: &mut &'static mut [u8], bytes: usize) -> Option<&'static mut [u8]> {
    let (own, rest) = core::mem::take(memory).split_at_mut_checked(bytes)?;
    *memory = rest;
    Some(own)
}

/// Takes external memory for a value whose bytes may all be zero. The 128 KiB of internal memory are too small for four
/// heads with everything else.
///
/// # Safety
/// Zeros are a valid `T`.
unsafe fn take_zeros<T>(memory: &mut &'static mut [u8]) -> Option<&'static mut T> {
    let before = memory.as_ptr().align_offset(align_of::<T>());
    take(memory, before)?;
    let own = take(memory, size_of::<T>())?;
    own.fill(0);
    // SAFETY: the place is aligned and has the size, nothing else has it, and the caller guarantees that zeros are
    // valid.
    Some(unsafe { &mut *own.as_mut_ptr().cast() })
}

/// Reads the cases. Returns the pictures and the tables of the parameters.
fn read_cases(memory: &mut &'static mut [u8]) -> Option<[[&'static [u8]; HEADS]; 2]> {
    let mut cases = File::open(c"cases.bin")?;
    let (mut pictures, mut tables) = ([&[][..]; HEADS], [&[][..]; HEADS]);
    for (table, picture) in tables.iter_mut().zip(&mut pictures) {
        let header = CaseHeader::read(&mut cases).ok()??;
        let (own_table, own) = (take(memory, header.table_bytes)?, take(memory, header.picture_bytes)?);
        if !cases.read(own_table) || !cases.read(own) {
            return None;
        }
        (*table, *picture) = (own_table, own);
    }
    Some([pictures, tables])
}

fn run() -> Option<()> {
    let board::Board { frames: [mut memory, mut more], timer, .. } = board::Board::take()?;
    let [pictures, tables] = read_cases(&mut memory)?;
    let sent = take(&mut memory, SENT)?;
    // SAFETY: lists and buffers are made as zeros (`Lists::new`, `HeadBuffers::new`).
    let (lists, own) = unsafe { (take_zeros::<Lists>(&mut more)?, take_zeros::<[HeadBuffers; HEADS]>(&mut more)?) };
    let cameras =
        CAMERAS.try_init(Cameras { now_us: 0, head: 0, is_ready: [false; HEADS], pictures, tables, sent, len: 0 })?;
    let (loops, buffers) = (LOOPS.try_take()?, (RIG_BUFFERS.try_take()?, own));
    let mut rig = Rig::new(cameras, SETUP.check().ok()?, loops, buffers, lists);
    rig.turn();
    let mut measure = |is_ready: [bool; HEADS]| {
        let cameras = rig.board()?;
        (cameras.is_ready, cameras.len) = (is_ready, 0);
        // The epoch before ends.
        cameras.now_us += 1_000_000;
        let start = Timer::ticks(&timer);
        rig.turn();
        Some(timer.ticks().wrapping_sub(start))
    };
    let idle = measure([false; HEADS])?;
    let one = measure([true, false, false, false])?;
    measure([false; HEADS])?;
    let all = measure([true; HEADS])?;
    let further = size_of::<Heads<'_, Cameras, 1>>() + size_of::<HeadBuffers>();
    let first = size_of::<Rig<'_, '_, Cameras, 1>>() + size_of::<RigBuffers>() + further;
    let cameras = rig.board()?;
    let mut results = File::create(c"results.bin")?;
    for word in [idle, one, all, first as u32, further as u32] {
        results.write(&word.to_le_bytes()).then_some(())?;
    }
    results.write(cameras.sent.get(..cameras.len)?).then_some(())
}
