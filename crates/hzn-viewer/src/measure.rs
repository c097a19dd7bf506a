//! Measures the speed and the memory of the real window: `hzn-viewer --measure`, for book/guide/viewer.md.

use std::time::{Duration, Instant, SystemTime};

use clap::ValueEnum;

use crate::model::{Look, Place};
use crate::ui::{Command, Viewer};

/// Time from the start until a window has nothing to do any more.
const SETTLED: Duration = Duration::from_secs(15);
/// Number of parameter changes that are timed.
const CHANGES: usize = 200;
/// Number of pictures that arrive and are timed.
const ARRIVALS: usize = 40;

/// The quantity to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Time from the start of the program to the first picture on the screen, and until all pictures are known.
    Start,
    /// Time from a change of a parameter to the new picture.
    Tune,
    /// Memory while all pictures are played at the highest speed.
    Play,
    /// Processor time while pictures are played at the speed of the sequence.
    RealTime,
    /// Time from a picture that arrives in the folder to the picture on the screen; needs --follow.
    Follow,
}

/// Times of one parameter change. `answer` counts from the request, all others count from the change.
#[derive(Debug, Clone, Copy, Default)]
struct Times {
    /// From the request to the answer, on the engine's thread.
    answer: Duration,
    /// Until the window with the new picture is laid out and goes to the painter.
    handed: Duration,
    /// Until the window with the new picture is on the screen.
    screen: Duration,
    /// Frames of the window that still showed the previous answer.
    late: u32,
    /// Processor time of the window's thread until it is laid out.
    layout_work: Duration,
    /// Processor time of the window's thread until it is on the screen.
    screen_work: Duration,
}

/// A measurement under way.
#[derive(Debug)]
pub struct Measure {
    kind: Kind,
    began: Instant,
    look: Look,
    changed: Option<Instant>,
    /// Processor time of the window's thread at the change.
    worked: Duration,
    /// True if this pass of the window shows the answer; the pass is not on the screen yet.
    seen: bool,
    times: Vec<Times>,
    /// Times of the change that is on its way to the screen, as far as they are known.
    handed: Times,
    late: u32,
    frames: usize,
    shown: Option<usize>,
    /// Frames of the window that were drawn.
    passes: usize,
}

impl Measure {
    /// Begins a measurement. `began` is the start of the program.
    pub fn new(kind: Kind, began: Instant) -> Self {
        let (look, times) = (Look::Colour, Vec::new());
        let (worked, handed) = (Duration::ZERO, Times::default());
        let shown = None;
        Self {
            kind,
            began,
            look,
            changed: None,
            worked,
            seen: false,
            times,
            handed,
            late: 0,
            frames: 0,
            shown,
            passes: 0,
        }
    }

    /// Runs before the window is drawn, when the last drawing is on the screen. Returns true when the measurement is
    /// finished.
    pub fn before_pass(&mut self, viewer: &mut Viewer, ctx: &egui::Context) -> bool {
        match self.kind {
            Kind::Start => self.start(viewer),
            Kind::Tune => self.tune(viewer),
            Kind::Play => self.play(viewer, ctx),
            Kind::RealTime => self.real_time(viewer, ctx),
            Kind::Follow => self.follow(viewer),
        }
    }

    /// Runs after the window is drawn.
    pub fn after_pass(&mut self, viewer: &Viewer, ctx: &egui::Context) {
        self.seen = match self.kind {
            // A recording is on the screen before all of its pictures are known.
            Kind::Start => viewer.frame_view().is_some(),
            _ => viewer.is_settled(),
        };
        if !self.seen {
            self.late += 1;
        } else if let (Some(changed), Some(frame_view)) = (self.changed, viewer.frame_view()) {
            self.handed = Times {
                late: std::mem::take(&mut self.late),
                answer: frame_view.latency,
                handed: changed.elapsed(),
                layout_work: processor_time().saturating_sub(self.worked),
                ..Times::default()
            };
        }
        self.passes += 1;
        if self.kind == Kind::RealTime && self.changed.is_some() && !viewer.is_playing() {
            // The end of the sequence is the end of the measurement.
            ctx.request_repaint();
        }
        if self.kind == Kind::Follow && newest(viewer).is_some_and(|shown| self.shown != Some(shown)) {
            // The next pass comes when this one is on the screen.
            ctx.request_repaint();
        }
        if self.seen && !matches!(self.kind, Kind::RealTime | Kind::Follow) {
            // The next pass comes when this one is on the screen.
            ctx.request_repaint();
        }
    }

    fn start(&mut self, viewer: &Viewer) -> bool {
        let ms = self.began.elapsed().as_secs_f64() * 1e3;
        if self.seen && self.changed.is_none() {
            println!("start to the first picture on the screen: {ms:.0} ms");
            self.changed = Some(self.began);
        }
        let is_finished = self.changed.is_some() && viewer.sequence().complete;
        if is_finished {
            println!("until all {} pictures are known: {ms:.0} ms", viewer.sequence().len());
        }
        is_finished
    }

    fn tune(&mut self, viewer: &mut Viewer) -> bool {
        if !self.seen {
            return false;
        }
        if let Some(changed) = self.changed.take() {
            let screen_work = processor_time().saturating_sub(self.worked);
            self.times.push(Times { screen: changed.elapsed(), screen_work, ..self.handed });
        }
        if self.times.len() == CHANGES {
            println!("parameter to new picture, {}:", self.look.name());
            for (what, part) in [
                ("from the request to the answer", (|t| t.answer) as fn(&Times) -> Duration),
                ("from the change to the frame that shows it, laid out", |t| t.handed),
                ("from the change to the screen, with tessellation and OpenGL", |t| t.screen),
            ] {
                let mut each: Vec<Duration> = self.times.iter().map(part).collect();
                each.sort();
                let quantile = |part: f64| each[(part * (CHANGES - 1) as f64) as usize].as_secs_f64() * 1e3;
                println!("  {what}: median {:.1} ms, 95 % {:.1} ms", quantile(0.5), quantile(0.95));
            }
            let in_time = self.times.iter().filter(|t| t.late == 0).count();
            let latest = self.times.iter().map(|t| t.late).max().unwrap_or(0);
            println!("  in the frame of the change: {in_time} of {CHANGES}, {latest} frames later at most");
            // The system counts processor time in steps of about a frame, so only the mean over many changes is exact.
            let mean = |part: fn(&Times) -> Duration| {
                self.times.iter().map(part).sum::<Duration>().as_secs_f64() * 1e3 / CHANGES as f64
            };
            println!(
                "  processor time of the window's thread: laid out {:.1} ms, to the screen {:.1} ms (mean)",
                mean(|t| t.layout_work),
                mean(|t| t.screen_work)
            );
            self.times.clear();
            if self.look == Look::Level {
                return true;
            }
            self.look = Look::Level;
            viewer.settings_mut().look = Look::Level;
            self.seen = false;
            return false;
        }
        (self.changed, self.late) = (Some(Instant::now()), 0);
        self.worked = processor_time();
        // Every step sets another scale, so that every step is a change.
        let scale = 1.0 + 0.002 * (self.times.len() % 100) as f64 + 0.001;
        if let Some(session) = viewer.session_mut() {
            session.set("threshold", "scale", 0, Some(scale.into()));
            session.end_step();
        }
        self.seen = false;
        false
    }

    /// Waits until the window has nothing to do, plays the sequence once, and counts the processor time.
    fn real_time(&mut self, viewer: &mut Viewer, ctx: &egui::Context) -> bool {
        if !viewer.is_playing() && self.changed.is_none() {
            // All work in the background, and all messages of the beginning, end before the measurement.
            if !self.seen || viewer.is_working() || self.began.elapsed() < SETTLED {
                ctx.request_repaint_after(Duration::from_millis(200));
                return false;
            }
            viewer.set_speed(1.0);
            viewer.run(Command::Play, ctx);
            (self.changed, self.worked, self.passes) = (Some(Instant::now()), process_time(), 0);
        }
        let index = viewer.frame_view().map(|s| s.index);
        if index != self.shown {
            (self.shown, self.frames) = (index, self.frames + 1);
        }
        let Some(began) = self.changed.filter(|_| !viewer.is_playing()) else { return false };
        let (worked, took) = (process_time().saturating_sub(self.worked), began.elapsed());
        println!(
            "{} pictures in {:.1} s, drawn {} times: processor time {:.2} s, {:.1} % of a core",
            self.frames,
            took.as_secs_f64(),
            self.passes,
            worked.as_secs_f64(),
            100.0 * worked.as_secs_f64() / took.as_secs_f64()
        );
        true
    }

    /// Compares the time of each new picture that is on the screen with that of its file.
    fn follow(&mut self, viewer: &Viewer) -> bool {
        let on_screen = newest(viewer).filter(|_| self.seen);
        if on_screen.is_none() || on_screen == self.shown {
            return false;
        }
        // The first picture was there before the measurement.
        let is_first = self.shown.is_none();
        self.shown = on_screen;
        if !is_first && let Some(screen) = age_of_shown(viewer) {
            self.times.push(Times { screen, ..Times::default() });
        }
        if self.times.len() < ARRIVALS {
            return false;
        }
        let mut each: Vec<Duration> = self.times.iter().map(|t| t.screen).collect();
        each.sort();
        let quantile = |part: f64| each[(part * (ARRIVALS - 1) as f64) as usize].as_secs_f64() * 1e3;
        println!(
            "{ARRIVALS} pictures, from the folder to the screen: median {:.0} ms, 95 % {:.0} ms, at most {:.0} ms",
            quantile(0.5),
            quantile(0.95),
            quantile(1.0)
        );
        true
    }

    fn play(&mut self, viewer: &mut Viewer, ctx: &egui::Context) -> bool {
        let count = viewer.sequence().len();
        if self.changed.is_none() {
            if !self.seen {
                return false;
            }
            (0..8).for_each(|_| viewer.run(Command::Faster, ctx));
            viewer.run(Command::Play, ctx);
            self.changed = Some(Instant::now());
        }
        let index = viewer.frame_view().map(|s| s.index);
        if index != self.shown {
            (self.shown, self.frames) = (index, self.frames + 1);
            if self.frames.is_power_of_two() || index == Some(count - 1) {
                println!(
                    "{} pictures played: {} MB resident, {} MB at most",
                    self.frames,
                    memory("VmRSS"),
                    memory("VmHWM")
                );
            }
        }
        let is_finished = index == Some(count - 1);
        if let (true, Some(began)) = (is_finished, self.changed) {
            println!("{:.1} pictures a second", self.frames as f64 / began.elapsed().as_secs_f64());
        }
        is_finished
    }
}

/// Returns the number of the picture that is shown, if it is the newest one with its result.
fn newest(viewer: &Viewer) -> Option<usize> {
    let index = viewer.frame_view().filter(|_| viewer.is_settled())?.index;
    (index + 1 == viewer.sequence().len()).then_some(index)
}

/// Returns the time since the file of the shown picture got its name; `None` if the system does not know it.
fn age_of_shown(viewer: &Viewer) -> Option<Duration> {
    let entry = viewer.sequence().entries.get(viewer.frame_view()?.index)?;
    let Place::File(path) = &entry.place else { return None };
    let data = std::fs::metadata(path).ok()?;
    #[cfg(unix)]
    let arrived = {
        use std::os::unix::fs::MetadataExt;
        let whole = Duration::from_secs(u64::try_from(data.ctime()).ok()?);
        SystemTime::UNIX_EPOCH + whole + Duration::from_nanos(u64::try_from(data.ctime_nsec()).ok()?)
    };
    #[cfg(not(unix))]
    let arrived = data.modified().ok()?;
    arrived.elapsed().ok()
}

/// Returns the processor time of all threads of this process so far, or zero if the system does not report it.
fn process_time() -> Duration {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the program, in parentheses, may contain spaces. User and system time are the fields 14 and 15, in
    // hundredths of a second.
    let fields = text.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace();
    Duration::from_millis(10 * fields.skip(11).take(2).filter_map(|n| n.parse::<u64>().ok()).sum::<u64>())
}

/// Returns the processor time of this thread so far, or zero if the system does not report it.
fn processor_time() -> Duration {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse().ok()).map_or(Duration::ZERO, Duration::from_nanos)
}

/// Returns a memory size of this process in megabytes, or 0 if the system does not report it.
fn memory(field: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix(field)?.strip_prefix(':'));
    line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<u64>().ok()).unwrap_or(0) / 1024
}
