//! The part of a board that belongs to one head.

use hzn_core::rig::MOST_HEADS;
use hzn_core::status::Status;
use hzn_core::{Config, Report, Solution};

use crate::board::{Board, Image, Picture, RETAINED_WORDS};
use crate::joint::RigAnswer;
use crate::messages::Exposure;
use crate::packet::ApidBase;
use crate::view::Viewer;

/// A board with several cameras.
pub trait RigBoard: Board {
    /// Says which head the functions of the camera and of the memory mean from now on: [`Board::camera_answers`],
    /// [`Board::next_picture`], [`Board::show`], the copies of the parameters, the words that a reset leaves unchanged,
    /// [`Board::note_sensor`] and [`Board::keep_answer`]. Each head has its own.
    fn select_head(&mut self, head: u8);
    /// Returns a checksum of the picture that was shown last, such as [`fingerprint`]; `None` if the board has none.
    /// The noise of a camera never repeats, so a head whose checksum repeats is frozen.
    fn picture_checksum(&mut self) -> Option<u32> {
        None
    }
    /// Keeps a joint answer, whose packet was sent just now. Most boards keep nothing.
    fn keep_joint(&mut self, _answer: &RigAnswer) {}
}

/// Returns a checksum of about 4000 pixels of a picture. The noise of fewer pixels than these never repeats.
pub fn fingerprint(pixels: &[u8]) -> u32 {
    // An odd step does not stay in one column. The checksum is FNV-1a.
    let step = (pixels.len() / 4096) | 1;
    pixels.iter().step_by(step).fold(0x811C_9DC5, |sum, &pixel| (sum ^ u32::from(pixel)).wrapping_mul(0x0100_0193))
}

/// The answer of a head to a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeadAnswer {
    pub(super) picture: u32,
    pub(super) exposure_us: u64,
    pub(super) status: Status,
    pub(super) solution: Option<Solution<f32>>,
    pub(super) checksum: Option<u32>,
    /// Rate of rotation of the camera in its own axes, rad/s.
    pub(super) rate_rad_s: Option<[f32; 3]>,
}

/// The board, as the loop of one head sees it.
#[derive(Debug)]
pub struct HeadBoard<'a, B> {
    /// The board, while the rig lends it: for a turn of the head, or for a telecommand.
    pub(super) lent: Option<&'a mut B>,
    head: u8,
    /// The answer of this turn.
    pub(super) answer: Option<HeadAnswer>,
    /// The bases of the rig and of the other heads, which a telecommand to this head must not set.
    pub(super) taken_bases: [Option<ApidBase>; 1 + MOST_HEADS],
}

impl<'a, B: RigBoard> HeadBoard<'a, B> {
    pub(super) fn new(head: u8, lent: Option<&'a mut B>) -> Self {
        Self { lent, head, answer: None, taken_bases: [None; 1 + MOST_HEADS] }
    }

    /// Calls a function of the board for this head. Without the board, which a loop always has, it returns `otherwise`.
    fn with<R>(&mut self, otherwise: R, call: impl FnOnce(&mut B) -> R) -> R {
        let Some(board) = self.lent.as_deref_mut() else { return otherwise };
        board.select_head(self.head);
        call(board)
    }
}

impl<B: RigBoard> Board for HeadBoard<'_, B> {
    fn now_us(&mut self) -> u64 {
        self.with(0, B::now_us)
    }
    fn pulse_us(&mut self) -> Option<u64> {
        self.with(None, B::pulse_us)
    }
    /// The rig listens for all heads.
    fn receive(&mut self) -> Option<u8> {
        None
    }
    fn send(&mut self, bytes: &[u8]) {
        self.with((), |board| board.send(bytes));
    }
    fn lift_off(&mut self) -> bool {
        self.with(false, B::lift_off)
    }
    fn power_fails(&mut self) -> bool {
        self.with(false, B::power_fails)
    }
    fn was_watchdog_reset(&mut self) -> bool {
        self.with(false, B::was_watchdog_reset)
    }
    fn feed_watchdog(&mut self) {
        self.with((), B::feed_watchdog);
    }
    fn camera_answers(&mut self) -> bool {
        self.with(false, B::camera_answers)
    }
    fn next_picture(&mut self) -> Option<Picture> {
        self.with(None, B::next_picture)
    }
    fn show(&mut self, viewer: &mut Viewer<'_>) {
        self.with((), |board| board.show(viewer));
    }
    fn read_copy(&mut self, copy: u8, into: &mut [u8]) {
        self.with((), |board| board.read_copy(copy, into));
    }
    fn write_copy(&mut self, copy: u8, bytes: &[u8]) -> bool {
        self.with(false, |board| board.write_copy(copy, bytes))
    }
    fn is_base_taken(&mut self, base: ApidBase) -> bool {
        self.taken_bases.contains(&Some(base))
    }
    fn note_sensor(&mut self, config: &Config) {
        self.with((), |board| board.note_sensor(config));
    }
    fn stack_bytes(&mut self) -> u32 {
        self.with(0, B::stack_bytes)
    }
    fn image(&mut self) -> Image {
        self.with(Image::default(), B::image)
    }
    fn read_retained(&mut self) -> [u32; RETAINED_WORDS] {
        self.with([0; RETAINED_WORDS], B::read_retained)
    }
    fn write_retained(&mut self, words: [u32; RETAINED_WORDS]) {
        self.with((), |board| board.write_retained(words));
    }
    fn keep_answer(&mut self, exposure: &Exposure, report: &Report<f32>) -> bool {
        let (is_kept, checksum) =
            self.with((true, None), |board| (board.keep_answer(exposure, report), board.picture_checksum()));
        self.answer = Some(HeadAnswer {
            picture: exposure.picture,
            exposure_us: exposure.exposure_us,
            status: report.status,
            solution: report.solution.filter(|_| report.status == Status::Ok),
            checksum,
            rate_rad_s: None,
        });
        is_kept
    }
}
