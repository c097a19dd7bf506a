//! The window on a flight computer, and on pictures that arrive while it is open.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use egui::{Key, Role};
use egui_kittest::kittest::Queryable;
use hzn_core::status::Status;
use hzn_flight::answer::{Direction, Outcome, PictureAnswer};
use hzn_flight::bytes::{Reader, Writer};
use hzn_flight::cuc::Cuc;
use hzn_flight::integrity::Integrity;
use hzn_flight::messages::{Acknowledge, Exposure, Housekeeping, Mode};
use hzn_flight::packet::{Apid, ApidBase, MAX_BYTES, Scan, scan, write};
use hzn_viewer::model::live::{ANSWERS, SentState};
use hzn_viewer::ui::Viewer;
use hzn_viewer::work::open::Request;

use crate::window::{Window, files, flight, folder, run_into, settled, sized_window, until, window, window_on};

/// A flight computer that only talks.
#[derive(Default)]
struct Computer {
    sequences: [u16; 16],
    picture: u32,
}

impl Computer {
    fn packet(&mut self, apid: Apid, user: impl FnOnce(&mut Writer<'_>)) -> Vec<u8> {
        let sequence = &mut self.sequences[apid as usize % 16];
        let mut bytes = [0; MAX_BYTES];
        let time = Some(Cuc::since_start(u64::from(self.picture) * 100_000));
        let n = write(&mut bytes, ApidBase::DEFAULT, apid, *sequence, time, user).unwrap();
        *sequence = (*sequence + 1) & 0x3FFF;
        bytes[..n].to_vec()
    }
    /// Returns the answer to the next picture, at ten pictures a second; every tenth has no limb.
    fn answer(&mut self) -> Vec<u8> {
        self.picture += 1;
        let n = self.picture;
        let nadir = (68.0 + 4.0 * (f64::from(n) / 60.0).sin()).to_radians();
        let direction = Direction {
            axis: [0.0, nadir.sin() as f32, nadir.cos() as f32],
            cov: [1e-6, 0.0, 0.0, 4e-7 * (1.0 + n as f32 / 40_000.0), 0.0, 1e-7],
            altitude_est_m: 230_400.0,
            altitude_est_sigma_m: 1200.0,
            rms_px: 0.21,
            inliers: 512,
            ..Direction::NONE
        };
        let status = if n.is_multiple_of(10) { Status::NoLimb } else { Status::Ok };
        let answer = PictureAnswer {
            outcome: Outcome { status: status as u8, solved: u8::from(status == Status::Ok), ..Outcome::default() },
            direction: (status == Status::Ok).then_some(direction),
            position: None,
            integrity: None,
            edges: Default::default(),
        };
        let exposure_us = u64::from(n) * 100_000;
        let exposure = Exposure { picture: n, exposure_us, calculation_us: 2100, ..Exposure::default() };
        self.packet(Apid::Science, |out| {
            exposure.write(out);
            answer.write_science(out);
        })
    }
    fn housekeeping(&mut self, flags: u8) -> Vec<u8> {
        let state = Housekeeping {
            mode: Mode::Flight as u8,
            pictures: self.picture,
            answers: self.picture - self.picture / 10,
            parameter_copy: 1,
            parameter_generation: 4,
            starts: 1,
            longest_us: 3200,
            flags,
            last_sequence: u16::MAX,
            since_lift_off_s: 42,
            ..Housekeeping::default()
        };
        self.packet(Apid::Housekeeping, |out| state.write(out))
    }
}

fn line(text: String) -> Request {
    Request { inputs: vec![text.into()], ..Request::default() }
}

/// Opens a line on which the test listens.
fn window_on_line(window: &mut Window) -> (TcpListener, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    window.state_mut().open(line(format!("tcp:{}", listener.local_addr().unwrap())));
    let (stream, _) = listener.accept().unwrap();
    window.run_steps(3);
    (listener, stream)
}

fn has<T: PartialEq>(viewer: &Viewer, of: impl FnOnce(&hzn_viewer::model::Live) -> T, wanted: T) -> bool {
    viewer.live(of) == Some(wanted)
}

#[test]
fn the_telemetry_of_a_flight_computer_is_shown() {
    let mut window = window();
    let (_listener, mut stream) = window_on_line(&mut window);
    assert!(window.query_by_label("no answer yet").is_some() && window.query_by_label("no packet yet").is_some());
    let mut computer = Computer::default();
    for _ in 0..300 {
        stream.write_all(&computer.answer()).unwrap();
    }
    stream.write_all(&computer.housekeeping(8)).unwrap();
    until(&mut window, "the packets did not come", |v| has(v, |l| l.housekeeping.is_some(), true));
    assert!(window.query_by_label("connected").is_some());
    assert!(window.query_by_label("301 packets, 300 answers").is_some());
    assert!(window.query_by_label_contains("the camera is silent").is_some());
    assert!(window.query_by_label("42 s ago").is_some() && window.query_by_label("flight").is_some());
    for plot in ["angle from the optical axis, °", "3σ, °", "altitude of the free fit, km"] {
        assert!(window.query_all_by_label(plot).next().is_some(), "{plot}");
    }
    // A gap in the counts of the packets is a loss.
    for n in 0..40 {
        let packet = computer.answer();
        if n % 4 != 1 {
            stream.write_all(&packet).unwrap();
        }
    }
    until(&mut window, "the loss is not counted", |v| has(v, |l| l.counts().lost, 10));
    assert!(window.query_by_label_contains("10 lost, ").is_some());
    // Noise belongs to no packet; the packets after it are found.
    stream.write_all(&[0x1A, 0xCF, 0xFC, 0x1D, 7, 7]).unwrap();
    stream.write_all(&vec![0; 5000]).unwrap();
    stream.write_all(&computer.housekeeping(0)).unwrap();
    until(&mut window, "the packet after noise is lost", |v| has(v, |l| l.housekeeping.as_ref().unwrap().flags, 0));
    assert!(window.query_by_label_contains("the camera is silent").is_none());
    // How far the answer can be trusted comes in a packet of its own, before the answer.
    let picture = computer.picture + 1;
    let integrity = Integrity { p_limb: 0.9985, protection_rad: 5e-3, ..Integrity::NONE };
    let packet = computer.packet(Apid::Integrity, |out| {
        out.u32(picture);
        integrity.write(out);
    });
    assert!(window.query_by_label("p (limb)").is_none());
    stream.write_all(&[packet, computer.answer()].concat()).unwrap();
    until(&mut window, "no answer came", |v| has(v, |l| l.last.as_ref().unwrap().exposure.picture, picture));
    assert!(window.query_by_label("0.9985").is_some() && window.query_by_label("0.2865°").is_some());
}

#[test]
fn plots_without_a_value_say_so() {
    let mut window = window();
    let (_listener, mut stream) = window_on_line(&mut window);
    let mut computer = Computer { picture: 9, ..Computer::default() };
    stream.write_all(&computer.answer()).unwrap();
    until(&mut window, "no answer came", |v| has(v, |l| l.counts().answers, 1));
    assert!(window.query_by_label_contains("No picture of this time has an answer").is_some());
    stream.write_all(&computer.answer()).unwrap();
    until(&mut window, "no answer came", |v| has(v, |l| l.counts().answers, 2));
    assert!(window.query_by_label_contains("No picture of this time has an answer").is_none());
    assert!(window.query_by_label("3σ, °").is_some());
}

#[test]
fn an_hour_at_ten_pictures_a_second_takes_bounded_memory() {
    let mut window = window();
    let (_listener, mut stream) = window_on_line(&mut window);
    let sender = std::thread::spawn(move || {
        let mut computer = Computer::default();
        // Somewhat more than an hour, with the state of the computer every second.
        for _ in 0..37_000 {
            let mut bytes = computer.answer();
            if computer.picture.is_multiple_of(10) {
                bytes.extend(computer.housekeeping(0));
            }
            stream.write_all(&bytes).unwrap();
        }
        stream
    });
    until(&mut window, "an hour of packets did not come", |v| has(v, |l| l.counts().answers, 37_000));
    let _stream = sender.join().unwrap();
    assert!(has(window.state(), |l| (l.points.len(), l.counts().lost), (ANSWERS, 0)));
    let newest_s = |v: &Viewer| v.live(|l| l.points.back().unwrap().time_s).unwrap();
    assert!((newest_s(window.state()) - 3700.0).abs() < 1e-6);
    window.get_by_label("1 h").click();
    window.run_steps(3);
    assert!(window.query_all_by_label("3σ, °").next().is_some());
}

#[test]
fn a_line_that_breaks_comes_back() {
    let mut window = window();
    let (listener, mut stream) = window_on_line(&mut window);
    let mut computer = Computer::default();
    stream.write_all(&computer.answer()).unwrap();
    until(&mut window, "no answer came", |v| has(v, |l| l.counts().answers, 1));
    drop(stream);
    until(&mut window, "the end is not noticed", |v| has(v, |l| l.is_connected, false));
    assert!(window.query_by_label("waits for the other end").is_some());
    let (mut stream, _) = listener.accept().unwrap();
    stream.write_all(&computer.answer()).unwrap();
    until(&mut window, "the line did not come back", |v| has(v, |l| (l.is_connected, l.counts().answers), (true, 2)));
}

#[test]
fn a_telecommand_waits_for_its_acknowledgement() {
    let mut window = window();
    let (_listener, mut stream) = window_on_line(&mut window);
    type_text(&mut window, "pin");
    assert!(window.query_by_label_contains("did you mean \"ping\"?").is_some());
    type_text(&mut window, "g");
    assert!(window.query_by_label_contains("1 packet of ").is_some(), "the packet is shown before it is sent");
    window.get_by_label("Send").click();
    window.run_steps(2);
    assert!(window.query_by_label("ping: waits for the acknowledgement").is_some());
    let mut bytes = [0; 256];
    let n = stream.read(&mut bytes).unwrap();
    let Scan::Packet { packet, .. } = scan(&bytes[..n]) else { panic!("no packet was sent") };
    let function = Reader::new(packet.user).u8().unwrap();
    let done = Acknowledge { function, sequence: packet.sequence, code: 0, detail: 0 };
    stream.write_all(&Computer::default().packet(Apid::Acknowledge, |out| done.write(out))).unwrap();
    let is_done = |l: &hzn_viewer::model::Live| matches!(l.sent[0].state, SentState::Done(_));
    until(&mut window, "the acknowledgement is not shown", |v| has(v, is_done, true));
    assert!(window.query_by_label_contains("ping: done").is_some());
    // Enter sends, too, and a word that is no telecommand is never sent.
    type_text(&mut window, "pign");
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert!(has(window.state(), |l| l.sent.len(), 1));
}

fn type_text(window: &mut Window, text: &str) {
    window.get_by_role_and_label(Role::TextInput, "Telecommand").focus();
    window.run_steps(2);
    window.get_by_role_and_label(Role::TextInput, "Telecommand").type_text(text);
    window.run_steps(2);
}

#[test]
fn a_telecommand_has_the_trailer_of_the_key() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("ground.key");
    let key = hzn_fly::key_file::create(&path, 7, 1).unwrap();
    let base = ApidBase::try_new(0x120).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut window = window();
    let computer = hzn_viewer::work::Computer { base, key: Some(path) };
    let inputs = vec![format!("tcp:{}", listener.local_addr().unwrap()).into()];
    window.state_mut().open(Request { inputs, computer, ..Request::default() });
    let (mut stream, _) = listener.accept().unwrap();
    window.run_steps(3);
    type_text(&mut window, "ping");
    assert!(window.query_by_label_contains(" + a trailer of 25").is_some());
    window.key_press(Key::Enter);
    window.run_steps(2);
    let mut bytes = [0; 256];
    let n = stream.read(&mut bytes).unwrap();
    let Scan::Packet { packet, .. } = scan(&bytes[..n]) else { panic!("no packet was sent") };
    assert_eq!(base.subject(&packet), Some(Apid::Command));
    assert!(key.is_right(base, packet.sequence, packet.user));
}

#[test]
fn only_this_computer_reaches_a_port_without_a_host() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut window = sized_window(1024.0, 768.0);
    window.state_mut().open(line(format!("tcp-listen:{port}")));
    window.run_steps(2);
    assert!(window.query_by_label(&format!("tcp-listen:127.0.0.1:{port}")).is_some());
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.write_all(&Computer::default().answer()).unwrap();
    until(&mut window, "no answer came", |v| has(v, |l| l.counts().answers, 1));
    // The port is taken, so a second window says so and stays as it is.
    let mut second = sized_window(1024.0, 768.0);
    second.state_mut().open(line(format!("tcp-listen:{port}")));
    second.run_steps(2);
    assert!(second.state().messages().any(|m| m.contains("another program uses the port")));
}

/// Returns a window that follows a folder or a recording.
fn window_that_follows(what: &Path) -> Window {
    let mut window = window();
    window.state_mut().open(Request { inputs: vec![what.to_owned()], follow: true, ..Request::default() });
    window
}

/// Moves a picture into a folder at once, as a careful camera program does.
fn arrive(from: &Path, folder: &Path, name: &str) {
    let part = folder.join("arriving.part");
    std::fs::copy(from, &part).unwrap();
    std::fs::rename(part, folder.join(name)).unwrap();
}

#[test]
fn an_empty_folder_that_is_followed_is_waited_for() {
    let (dir, pictures) = folder();
    let inbox = dir.path().join("inbox");
    std::fs::create_dir(&inbox).unwrap();
    std::fs::copy(pictures.join("sensor.toml"), inbox.join("sensor.toml")).unwrap();
    let mut window = window_that_follows(&inbox);
    window.run_steps(3);
    assert!(window.query_by_label_contains("Waiting for the first picture in ").is_some());
    let first = files(&pictures).into_iter().find(|name| name.ends_with(".png")).unwrap();
    arrive(&pictures.join(&first), &inbox, &first);
    until(&mut window, "the first picture is not there", |v| v.sequence().len() == 1 && v.is_settled());
}

#[test]
fn pictures_are_shown_as_they_arrive() {
    let (dir, pictures) = folder();
    let stock = dir.path().join("stock");
    std::fs::create_dir(&stock).unwrap();
    flight(&stock);
    let mut window = window_that_follows(&pictures);
    until(&mut window, "the pictures are not there", |v| v.sequence().len() == 4 && v.is_settled());
    assert!(window.state().is_following());
    let mut longest = Duration::ZERO;
    for n in 0..5 {
        let name = format!("new-{n}.png");
        arrive(&stock.join("1.png"), &pictures, &name);
        let begin = Instant::now();
        while window.state().frame_view().is_none_or(|view| view.name != name) {
            assert!(begin.elapsed() < Duration::from_secs(30), "{name} is not shown");
            std::thread::sleep(Duration::from_millis(2));
            window.step();
        }
        longest = longest.max(begin.elapsed());
    }
    println!("picture to screen: at most {} ms", longest.as_millis());
    window.run_steps(3);
    assert!(window.query_by_label_contains("newest ").is_some());
    // Whoever goes to another picture stays there.
    window.key_press(Key::Home);
    settled(&mut window);
    assert!(!window.state().is_following());
    arrive(&stock.join("2.png"), &pictures, "new-5.png");
    until(&mut window, "the picture did not come", |v| v.sequence().len() == 10);
    assert_eq!(window.state().frame_view().unwrap().name, "0.png");
    window.get_by_label("Follow").click();
    settled(&mut window);
    assert_eq!(window.state().frame_view().unwrap().name, "new-5.png");
    // Pictures that were never shown are processed, too.
    until(&mut window, "not all are processed", |v| v.processed() == 10);
    // The work ends until the next picture comes, so that a picture of the window can be taken.
    until(&mut window, "the work does not end", |v| !v.is_working());
    assert_eq!(files(&pictures).len(), 11);
}

#[test]
fn a_flight_that_is_followed_for_long_keeps_its_newest_pictures() {
    let (dir, pictures) = folder();
    let stock = dir.path().join("stock");
    std::fs::create_dir(&stock).unwrap();
    flight(&stock);
    let mut window = window_that_follows(&pictures);
    window.state_mut().keep_at_most(20);
    until(&mut window, "the pictures are not there", |v| v.sequence().len() == 4 && v.is_settled());
    for n in 0..70 {
        arrive(&stock.join(format!("{}.png", n % 3)), &pictures, &format!("p{n:03}.png"));
    }
    let newest = |v: &Viewer| v.sequence().entries.last().map(|e| e.name.clone());
    until(&mut window, "the pictures did not come", |v| newest(v).as_deref() == Some("p069.png"));
    until(&mut window, "not all are processed", |v| v.processed() == v.sequence().len() && v.is_settled());
    let viewer = window.state();
    assert!(viewer.sequence().len() <= 20, "{}", viewer.sequence().len());
    // The results lie at the pictures that they belong to.
    for (i, entry) in viewer.sequence().entries.iter().enumerate() {
        let row = viewer.results().current(i, 0).unwrap();
        assert_eq!(row.file, entry.name);
    }
    assert_eq!(viewer.frame_view().unwrap().name, "p069.png");
    assert!(window.query_by_label("74 of 74…").is_some());
}

#[test]
fn a_recording_is_shown_while_it_is_written() {
    let (dir, pictures) = folder();
    let whole = dir.path().join("whole.mcap");
    run_into(&mut window_on(&pictures), &whole);
    let bytes = std::fs::read(&whole).unwrap();
    let growing: PathBuf = dir.path().join("growing.mcap");
    let part = dir.path().join("growing.mcap.part");
    std::fs::write(&part, &bytes[..bytes.len() / 3]).unwrap();
    let mut window = window_that_follows(&growing);
    let mut file = std::fs::File::options().append(true).open(&part).unwrap();
    // The recording grows in pieces that end anywhere.
    for piece in bytes[bytes.len() / 3..].chunks(bytes.len() / 13) {
        file.write_all(piece).unwrap();
        window.run_steps(3);
        std::thread::sleep(Duration::from_millis(30));
    }
    std::fs::rename(&part, &growing).unwrap();
    until(&mut window, "the recording is not complete", |v| v.sequence().complete);
    settled(&mut window);
    let viewer = window.state();
    assert_eq!((viewer.sequence().len(), viewer.is_following()), (4, false));
    assert_eq!(viewer.sequence().recording.as_deref(), Some(growing.as_path()));
    assert_eq!(viewer.sequence().title, "growing.mcap", "the title follows the new name");
    assert!(window.query_by_label("growing.mcap   sensor of the recording").is_some());
    let viewer = window.state();
    assert!((0..4).all(|i| viewer.recorded(i).is_some()), "each picture has its result");
    assert!(!viewer.messages().any(|m| m.contains("not closed")));
}
