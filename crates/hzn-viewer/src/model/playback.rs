//! The picture that is shown, and playing.

use std::time::Duration;

/// Speeds that can be chosen, as multiples of the speed of the sequence.
pub const SPEEDS: [f64; 9] = [0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 20.0, 100.0, 1000.0];
/// Time that a picture is shown at the speed 1 if the sequence has no times, in seconds.
const WITHOUT_TIMES_S: f64 = 1.0;
/// Lowest rate that a sequence begins with, in pictures per second. A recording with a picture every 16 s would
/// otherwise seem to stand still.
pub const LEAST_FPS: f64 = 2.0;
/// Highest rate of playing in pictures per second; a higher rate cannot be seen.
const FASTEST_FPS: f64 = 60.0;

/// The picture that is shown, and the state of playing.
#[derive(Debug, Clone, PartialEq)]
pub struct Playback {
    frame: usize,
    playing: bool,
    speed: f64,
    /// Time for which the picture has been shown, in seconds of the sequence.
    spent_s: f64,
}

impl Default for Playback {
    fn default() -> Self {
        Self { frame: 0, playing: false, speed: 1.0, spent_s: 0.0 }
    }
}

impl Playback {
    /// Returns the index of the picture, from 0.
    pub fn frame(&self) -> usize {
        self.frame
    }
    /// Returns true while the sequence is played.
    pub fn is_playing(&self) -> bool {
        self.playing
    }
    /// Returns the speed, as a multiple of the speed of the sequence.
    pub fn speed(&self) -> f64 {
        self.speed
    }
    /// Goes to a picture. An index beyond the end goes to the last of `count` pictures.
    pub fn go(&mut self, frame: usize, count: usize) {
        self.frame = frame.min(count.saturating_sub(1));
        self.spent_s = 0.0;
    }
    /// Steps by some pictures, backwards with a negative number, and stops playing.
    pub fn step(&mut self, frames: isize, count: usize) {
        self.playing = false;
        self.go(self.frame.saturating_add_signed(frames), count);
    }
    /// Starts or stops playing. At the end of the sequence it starts again at the first picture.
    pub fn toggle(&mut self, count: usize) {
        self.playing = !self.playing && count > 1;
        if self.playing && self.frame + 1 >= count {
            self.go(0, count);
        }
    }
    /// Sets the next faster or slower speed of [`SPEEDS`].
    pub fn change_speed(&mut self, faster: bool) {
        let mut speeds = SPEEDS.iter().copied();
        let next = if faster { speeds.find(|s| *s > self.speed) } else { speeds.rfind(|s| *s < self.speed) };
        self.speed = next.unwrap_or(self.speed);
    }
    /// Sets the lowest speed of [`SPEEDS`], 1 or more, that shows at least [`LEAST_FPS`] pictures per second.
    /// `interval_s` is the usual time between two pictures.
    pub fn set_usual_speed(&mut self, interval_s: Option<f64>) {
        let least = interval_s.unwrap_or(0.0) * LEAST_FPS;
        let fitting = SPEEDS.into_iter().find(|speed| *speed >= least.max(1.0));
        self.speed = fitting.unwrap_or(SPEEDS[SPEEDS.len() - 1]);
    }
    /// Sets the speed.
    pub fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
    }

    /// Returns how long the picture is shown, in seconds of the sequence.
    fn time_shown_s(&self, duration_s: impl Fn(usize) -> Option<f64>) -> f64 {
        let known = duration_s(self.frame).filter(|d| *d > 0.0 && d.is_finite());
        known.unwrap_or(WITHOUT_TIMES_S).max(self.speed / FASTEST_FPS)
    }

    /// Returns the time until the next picture is due; `None` if the sequence is not played.
    pub fn due(&self, duration_s: impl Fn(usize) -> Option<f64>) -> Option<Duration> {
        let left_s = (self.time_shown_s(duration_s) - self.spent_s).max(0.0);
        self.playing.then(|| Duration::from_secs_f64(left_s / self.speed))
    }

    /// Advances the time by `elapsed` and returns true if the next picture is shown. `duration_s` returns the duration
    /// of a picture in seconds of the sequence, if it is known. A call advances by at most one picture, so a slow
    /// computer plays more slowly and still shows every picture.
    pub fn advance(&mut self, elapsed: Duration, count: usize, duration_s: impl Fn(usize) -> Option<f64>) -> bool {
        if !self.playing {
            return false;
        }
        let shown_s = self.time_shown_s(duration_s);
        self.spent_s += elapsed.as_secs_f64() * self.speed;
        if self.spent_s < shown_s {
            return false;
        }
        // At most the duration of one picture is carried over to the next one.
        let rest = (self.spent_s - shown_s).min(shown_s);
        if self.frame + 1 >= count {
            self.playing = false;
            return false;
        }
        self.go(self.frame + 1, count);
        self.spent_s = rest;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(n: u64) -> Duration {
        Duration::from_millis(n)
    }

    #[test]
    fn frames_last_as_long_as_they_did() {
        let mut p = Playback::default();
        p.toggle(10);
        // The sequence has 25 pictures per second.
        let frames = (0..100).filter(|_| p.advance(ms(10), 100, |_| Some(0.04))).count();
        assert_eq!(frames, 25);
        p.set_speed(0.5);
        let frames = (0..100).filter(|_| p.advance(ms(10), 1000, |_| Some(0.04))).count();
        assert!((12..=13).contains(&frames), "{frames}");
    }

    #[test]
    fn slow_recordings_play_in_real_time_and_missing_times_do_not_hold_it_up() {
        let mut p = Playback::default();
        p.toggle(10);
        // One picture in five seconds.
        let frames = (0..1100).filter(|_| p.advance(ms(10), 10, |_| Some(5.0))).count();
        assert_eq!(frames, 2);
        p.set_speed(1000.0);
        assert!((0..501).any(|_| p.advance(ms(10), 10, |_| Some(3600.0))), "an hour takes 3.6 s at the speed 1000");
        p.set_speed(1.0);
        assert!((0..101).any(|_| p.advance(ms(10), 10, |_| None)));
        assert!((0..101).any(|_| p.advance(ms(10), 10, |_| Some(-5.0))));
        // At thousands of pictures per second, a call advances by one picture, and a slow call does not catch up.
        p.go(0, 1000);
        p.advance(ms(5000), 1000, |_| Some(1e-6));
        assert_eq!(p.frame(), 1);
    }

    #[test]
    fn it_ends_at_the_end_and_starts_over() {
        let mut p = Playback::default();
        p.step(-1, 3);
        assert_eq!(p.frame(), 0);
        p.step(100, 3);
        assert_eq!(p.frame(), 2);
        p.toggle(3);
        assert_eq!((p.frame(), p.is_playing()), (0, true));
        for _ in 0..1000 {
            p.advance(ms(10), 3, |_| Some(0.1));
        }
        assert_eq!((p.frame(), p.is_playing()), (2, false));
        p.toggle(1);
        assert!(!p.is_playing(), "a single picture does not play");
    }

    #[test]
    fn it_tells_when_the_next_frame_is_due() {
        let mut p = Playback::default();
        let half = |_| Some(0.5);
        assert_eq!(p.due(half), None, "nothing is played");
        p.toggle(10);
        assert_eq!(p.due(half), Some(ms(500)));
        p.advance(ms(250), 10, half);
        assert_eq!((p.frame(), p.due(half)), (0, Some(ms(250))));
        p.set_speed(2.0);
        assert_eq!(p.due(half), Some(ms(125)));
        p.advance(p.due(half).unwrap(), 10, half);
        assert_eq!((p.frame(), p.due(half)), (1, Some(ms(250))));
    }

    #[test]
    fn a_slow_recording_begins_with_a_speed_that_shows_something() {
        let speed = |interval_s| {
            let mut p = Playback::default();
            p.set_usual_speed(interval_s);
            p.speed()
        };
        assert_eq!([None, Some(0.04), Some(0.5), Some(1.0), Some(16.0)].map(speed), [1.0, 1.0, 1.0, 2.0, 100.0]);
        assert_eq!(speed(Some(1e9)), 1000.0);
    }

    #[test]
    fn speeds_end_too() {
        let mut p = Playback::default();
        (0..20).for_each(|_| p.change_speed(true));
        assert_eq!(p.speed(), 1000.0);
        (0..20).for_each(|_| p.change_speed(false));
        assert_eq!(p.speed(), 0.1);
    }
}
