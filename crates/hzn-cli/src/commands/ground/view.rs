//! What the screen of the ground station shows, and its drawing.

use std::collections::VecDeque;
use std::time::Duration;

use hzn_core::frames::{Cam, Cov3};
use hzn_core::status::Status;
use hzn_flight::assembly::Assembled;
use hzn_flight::messages::{Housekeeping, Mode};
use hzn_ground::{SILENT_AFTER, Seen, StreamCounts, alarms};
use hzn_mcap::LogLevel;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph};

use crate::tell::one_line;

/// Length of the plots, s.
const WINDOW_S: f64 = 60.0;
/// Most pictures of the plots.
const PICTURES: usize = 6000;
/// Most messages that are kept.
const MESSAGES: usize = 200;

/// One answer in the plots.
struct Point {
    time_s: f64,
    /// Angle from the optical axis to the body, degrees.
    nadir_deg: Option<f64>,
    sigma_deg: Option<f64>,
    status: u8,
}

/// The state of the screen.
#[derive(Default)]
pub(super) struct View {
    /// The line.
    name: String,
    points: VecDeque<Point>,
    last: Option<Box<Assembled>>,
    housekeeping: Option<Box<Housekeeping>>,
    messages: VecDeque<(LogLevel, String)>,
    /// Time since the last packet.
    pub(super) silent: Option<Duration>,
    /// The command that is being typed.
    pub(super) typed: Option<String>,
}

impl View {
    pub(super) fn new(name: &str) -> Self {
        Self { name: one_line(name), ..Self::default() }
    }

    /// Takes what was seen.
    pub(super) fn take(&mut self, seen: Vec<Seen>) {
        for seen in seen {
            match seen {
                Seen::Answer(picture) => self.take_answer(picture),
                Seen::Housekeeping(record) => self.housekeeping = Some(record),
                Seen::Acknowledge(_) => {}
                Seen::Value(text) => self.tell(LogLevel::Info, text),
                Seen::Note(level, text) => self.tell(level, text),
            }
        }
    }

    /// Shows a message.
    pub(super) fn tell(&mut self, level: LogLevel, text: String) {
        self.messages.push_back((level, one_line(text)));
        if self.messages.len() > MESSAGES {
            self.messages.pop_front();
        }
    }

    /// Returns the sequence count that the flight computer expects after its last telecommand, if it has told.
    pub(super) fn last_sequence(&self) -> Option<u16> {
        self.housekeeping.as_ref().map(|h| h.last_sequence).filter(|&n| n != u16::MAX)
    }

    fn take_answer(&mut self, picture: Box<Assembled>) {
        let (exposure, answer) = (&picture.exposure, &picture.answer);
        let time_s = exposure.exposure_us as f64 * 1e-6;
        // The clock of the flight computer begins again after a reset.
        if self.points.back().is_some_and(|last| last.time_s > time_s) {
            self.points.clear();
        }
        let direction = answer.direction.as_ref();
        self.points.push_back(Point {
            time_s,
            nadir_deg: direction.map(|d| f64::from(d.axis[2]).clamp(-1.0, 1.0).acos().to_degrees()),
            sigma_deg: direction.map(|d| sigma_deg(d.cov)),
            status: answer.status,
        });
        while self.points.front().is_some_and(|first| first.time_s < time_s - WINDOW_S) || self.points.len() > PICTURES
        {
            self.points.pop_front();
        }
        self.last = Some(picture);
    }

    /// Draws everything.
    pub(super) fn draw(&self, frame: &mut Frame<'_>, counts: &StreamCounts) {
        let rows = Layout::vertical([
            Constraint::Length(1),
            Constraint::Min(12),
            Constraint::Length(8),
            Constraint::Length(1),
        ]);
        let [title, middle, messages, prompt] = rows.areas(frame.area());
        frame.render_widget(self.title(counts), title);
        let [plots, state] = Layout::horizontal([Constraint::Min(40), Constraint::Length(38)]).areas(middle);
        let [nadir, sigma, strip] =
            Layout::vertical([Constraint::Fill(1), Constraint::Fill(1), Constraint::Length(3)]).areas(plots);
        self.plot(frame, nadir, "nadir from the optical axis, deg", Color::Cyan, |p| p.nadir_deg);
        self.plot(frame, sigma, "sigma, deg", Color::Yellow, |p| p.sigma_deg);
        frame.render_widget(self.strip(strip.width), strip);
        frame.render_widget(self.state(), state);
        frame.render_widget(self.messages(messages.height), messages);
        frame.render_widget(self.prompt(), prompt);
    }

    fn title(&self, counts: &StreamCounts) -> Line<'_> {
        let StreamCounts { packets, lost, cut, .. } = counts;
        let mut spans = vec![Span::from(format!(" {}  ", self.name)).bold()];
        spans.push(Span::from(format!("{packets} packets, {lost} lost, {cut} broken  ")));
        spans.push(match self.silent {
            None => Span::from("no packet yet").fg(Color::Yellow),
            Some(t) if t < SILENT_AFTER => Span::from("heard now").fg(Color::Green),
            Some(t) => Span::from(format!("silent for {} s", t.as_secs())).fg(Color::Red).bold(),
        });
        Line::from(spans)
    }

    fn plot(
        &self,
        frame: &mut Frame<'_>,
        area: Rect,
        title: &str,
        color: Color,
        value: impl Fn(&Point) -> Option<f64>,
    ) {
        let end_s = self.points.back().map_or(0.0, |last| last.time_s);
        let places: Vec<(f64, f64)> = self.points.iter().filter_map(|p| Some((p.time_s - end_s, value(p)?))).collect();
        let last = places.last().filter(|(t, _)| *t == 0.0).map_or("–".to_owned(), |(_, v)| format!("{v:.3}"));
        let (low, high) = bounds(places.iter().map(|(_, v)| *v));
        let labels = |a: f64, b: f64| [format!("{a:.3}"), format!("{:.3}", f64::midpoint(a, b)), format!("{b:.3}")];
        let data = Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Style::new().fg(color))
            .data(&places);
        let chart = Chart::new(vec![data])
            .block(Block::bordered().title(format!(" {title}: {last} ")))
            .x_axis(Axis::default().bounds([-WINDOW_S, 0.0]).labels(["-60 s", "-30 s", "now"]))
            .y_axis(Axis::default().bounds([low, high]).labels(labels(low, high)));
        frame.render_widget(chart, area);
    }

    /// Returns the statuses of the last pictures, one character each: a dot is `ok`, others have their number.
    fn strip(&self, width: u16) -> Paragraph<'_> {
        let room = usize::from(width.saturating_sub(2));
        let skip = self.points.len().saturating_sub(room);
        let mark = |p: &Point| match p.status {
            0 => Span::from("·").fg(Color::Green),
            n => Span::from(char::from_digit(n.into(), 36).unwrap_or('?').to_string()).fg(Color::Red),
        };
        let marks: Vec<Span<'_>> = self.points.iter().skip(skip).map(mark).collect();
        let last = self.last.as_ref().and_then(|last| Status::ALL.get(usize::from(last.answer.status)));
        let title = format!(" status of each picture: {} ", last.map_or("–", |status| status.name()));
        Paragraph::new(Line::from(marks)).block(Block::bordered().title(title))
    }

    fn state(&self) -> Paragraph<'_> {
        let block = Block::bordered().title(" flight computer ");
        let Some(h) = &self.housekeeping else { return Paragraph::new("no housekeeping yet").block(block) };
        let mode = Mode::from_number(h.mode).map_or("?", Mode::name);
        let color = if h.mode == Mode::Flight as u8 { Color::Green } else { Color::Yellow };
        let field =
            |name: &str, value: String| Line::from(vec![Span::from(format!("{name:<13}")).dim(), Span::from(value)]);
        let mut lines =
            vec![Line::from(vec![Span::from(format!("{:<13}", "mode")).dim(), Span::from(mode).fg(color).bold()])];
        lines.push(field("pictures", format!("{}, {} with an answer", h.pictures, h.answers)));
        lines.push(field("", format!("{} lost, {} refused", h.lost, h.refused)));
        lines.push(field("calculation", format!("{:.1} ms, {:.1} ms at most", ms(h.last_us), ms(h.longest_us))));
        if let Some(last) = &self.last
            && let Some(d) = &last.answer.direction
        {
            lines.push(field("axis", format!("{:+.4} {:+.4} {:+.4}", d.axis[0], d.axis[1], d.axis[2])));
            if d.altitude_est_m.is_finite() {
                let (h, sigma) = (d.altitude_est_m * 1e-3, d.altitude_est_sigma_m * 1e-3);
                lines.push(field("altitude", format!("{h:.1} ± {sigma:.1} km")));
            }
            if let Some(p_limb) = last.answer.integrity.and_then(|i| i.p_limb()) {
                lines.push(field("p (limb)", format!("{p_limb:.4}")));
            }
            if let Some(level_rad) = last.answer.integrity.and_then(|i| i.protection_rad()) {
                lines.push(field("protection", format!("{:.4} deg", level_rad.to_degrees())));
            }
        }
        lines.push(field("parameters", format!("copy {}, generation {}", h.parameter_copy, h.parameter_generation)));
        lines.push(field("commands", format!("{} done, {} rejected", h.commands, h.rejected)));
        lines.push(field("line", format!("{} foreign, {} broken", h.foreign, h.broken)));
        lines.push(field("starts", format!("{}, {} resets in a row", h.starts, h.watchdog_resets)));
        if h.since_lift_off_s != u32::MAX {
            lines.push(field("lift-off", format!("{} s ago", h.since_lift_off_s)));
        }
        for text in alarms(h) {
            lines.push(Line::from(text).fg(Color::Red));
        }
        Paragraph::new(lines).block(block)
    }

    fn messages(&self, height: u16) -> Paragraph<'_> {
        let room = usize::from(height.saturating_sub(2));
        let skip = self.messages.len().saturating_sub(room);
        let line = |(level, text): &(LogLevel, String)| {
            let line = Line::from(text.clone());
            match level {
                LogLevel::Info => line,
                LogLevel::Warning => line.fg(Color::Yellow),
                LogLevel::Error => line.fg(Color::Red),
            }
        };
        let lines: Vec<Line<'_>> = self.messages.iter().skip(skip).map(line).collect();
        Paragraph::new(lines).block(Block::bordered().title(" messages "))
    }

    fn prompt(&self) -> Line<'_> {
        match &self.typed {
            Some(text) => Line::from(format!(" command: {text}▏")).bold(),
            None => Line::from(" c  command    q  quit").dim(),
        }
    }
}

/// Returns the larger 1-sigma of a direction, degrees.
fn sigma_deg(cov: [f32; 6]) -> f64 {
    Cov3::<Cam, f64>::from_upper(cov.map(f64::from)).sigma_max_rad().to_degrees()
}

fn ms(us: u32) -> f64 {
    f64::from(us) * 1e-3
}

/// Returns limits for an axis that holds all values, with a little room.
fn bounds(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return (0.0, 1.0);
    }
    let room = ((high - low) * 0.1).max(1e-3);
    (low - room, high + room)
}

#[cfg(test)]
mod tests {
    use hzn_flight::answer::{Direction, Outcome, PictureAnswer};
    use hzn_flight::integrity::Integrity;
    use hzn_flight::messages::Exposure;
    use hzn_flight::packet::ApidBase;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;

    /// Returns the answer to picture `n` of a flight that turns slowly; every tenth has no limb.
    fn answer(n: u32) -> Seen {
        let nadir = (68.0 + 4.0 * (f64::from(n) / 60.0).sin()).to_radians();
        let direction = Direction {
            axis: [0.0, nadir.sin() as f32, nadir.cos() as f32],
            cov: [1e-6, 0.0, 0.0, 4e-7 * (1.0 + n as f32 / 300.0), 0.0, 1e-7],
            altitude_est_m: 230_400.0,
            altitude_est_sigma_m: 1200.0,
            ..Direction::default()
        };
        let integrity = Integrity { p_limb: 0.9985, protection_rad: 5e-3, ..Integrity::NONE };
        let is_found = !n.is_multiple_of(10);
        let status = if is_found { Status::Ok } else { Status::NoLimb } as u8;
        let exposure = Exposure { picture: n, exposure_us: u64::from(n) * 100_000, ..Exposure::default() };
        let answer = PictureAnswer {
            outcome: Outcome { status, ..Outcome::default() },
            direction: is_found.then_some(direction),
            position: None,
            integrity: is_found.then_some(integrity),
            edges: Default::default(),
        };
        Seen::Answer(Box::new(Assembled { exposure, answer, navigation: None, attitude: None, missing_candidates: 0 }))
    }

    fn screen(view: &View, counts: &StreamCounts, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| view.draw(frame, counts)).unwrap();
        let text = terminal.backend().to_string();
        // The backend puts every line into quotation marks.
        text.lines().map(|line| line.trim_matches('"').trim_end()).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn what_a_terminal_obeys_is_shown() {
        let mut view = View::new("tcp:\u{202e}h:1");
        view.tell(LogLevel::Error, "load \x1b]52;c;aGk\x07\u{2066}".to_owned());
        let shown = screen(&view, &StreamCounts::new(ApidBase::DEFAULT, None), 100, 30);
        assert!(shown.contains(r"tcp:\u{202e}h:1") && shown.contains(r"load \x1b]52;c;aGk\x07\u{2066}"), "{shown}");
    }

    #[test]
    fn a_flight_is_shown() {
        let mut counts = StreamCounts::new(ApidBase::DEFAULT, None);
        let mut view = View::new("tcp:flight:5000");
        insta::assert_snapshot!("screen_before", screen(&view, &counts, 100, 30));
        view.take((1..=500).map(answer).collect());
        let housekeeping = Housekeeping {
            mode: Mode::Flight as u8,
            parameter_copy: 2,
            parameter_generation: 7,
            pictures: 500,
            answers: 450,
            commands: 3,
            last_us: 1234,
            longest_us: 5678,
            starts: 2,
            watchdog_resets: 1,
            flags: 8,
            since_lift_off_s: 42,
            last_sequence: 11,
            ..Housekeeping::default()
        };
        view.take(vec![
            Seen::Housekeeping(Box::new(housekeeping)),
            Seen::Note(LogLevel::Warning, "  10.000000 s  the camera sends no pictures".into()),
        ]);
        view.silent = Some(Duration::from_secs(12));
        view.typed = Some("mode standby".into());
        counts.packets = 2345;
        insta::assert_snapshot!("screen_in_flight", screen(&view, &counts, 100, 30));
        assert_eq!(view.last_sequence(), Some(11));
        // Only a minute is kept, and a reset of the computer begins it again.
        assert_eq!(view.points.len(), 500);
        view.take(vec![answer(501)]);
        let shown = screen(&view, &counts, 100, 30);
        assert!(shown.contains("p (limb)     0.9985") && shown.contains("protection   0.2865 deg"), "{shown}");
        view.take((502..=700).map(answer).collect());
        assert_eq!(view.points.len(), 601);
        view.take(vec![answer(3)]);
        assert_eq!(view.points.len(), 1);
        // A small terminal shows less, and does not fail.
        for (width, height) in [(1, 1), (20, 5), (60, 20)] {
            screen(&view, &counts, width, height);
        }
    }
}
