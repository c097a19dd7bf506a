//! The line between the flight computer and the ground. Both ends use it.
//!
//! Threads read and write, so that a slow line never holds up the flight loop. A packet for which the line has no room
//! is dropped and counted.

mod address;
mod connection;

use std::io::{self, Read, Write};
use std::net::TcpListener;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};

pub use address::{Address, FORMS};

use crate::latency::Latency;
use crate::tell::Tell;
use connection::Connection;

/// Packets that wait for a slow line. At 115 200 baud they are five seconds of telemetry.
const WAITING: usize = 256;
/// Pieces of received bytes that wait for the flight loop. Then the line has to wait.
const PIECES: usize = 64;
/// Most bytes of such a piece: more than the longest packet.
const PIECE: usize = 2048;
/// Most connections at a time.
const CONNECTIONS: usize = 8;
/// Time between two attempts to open a line.
const AGAIN: Duration = Duration::from_secs(1);

/// What happens if the other end cannot be reached at first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Patience {
    /// It is an error: somebody waits for the answer.
    Fails,
    /// It is tried again for ever: a flight computer may start before the ground does.
    Waits,
}

/// A packet on its way out, and the time since when its latency counts.
struct Outgoing {
    bytes: Arc<[u8]>,
    since: Option<Instant>,
}

type Output = (u64, Sender<Outgoing>);

/// What all threads of a line share.
struct Shared {
    address: Address,
    outputs: Mutex<Vec<Output>>,
    received: Sender<Vec<u8>>,
    latency: Arc<Latency>,
    dropped: AtomicU64,
    number: AtomicU64,
    /// The program has no more use for the line.
    is_closed: AtomicBool,
    tell: Tell,
}

/// A line that is open. When it is dropped, it is not opened again after its end.
pub struct Link {
    shared: Arc<Shared>,
}

impl Drop for Link {
    fn drop(&mut self) {
        self.shared.is_closed.store(true, Ordering::Relaxed);
    }
}

impl Link {
    /// Opens a line. The second value gives the bytes that arrive.
    ///
    /// # Errors
    /// The port is in use, the device does not exist, or, if `patience` says so, the other end cannot be reached. The
    /// error names the address.
    pub fn open(
        address: &Address,
        patience: Patience,
        latency: Arc<Latency>,
        tell: Tell,
    ) -> io::Result<(Self, Receiver<Vec<u8>>)> {
        let (received, receiver) = bounded(PIECES);
        let shared = Arc::new(Shared {
            address: address.clone(),
            outputs: Mutex::default(),
            received,
            latency,
            dropped: AtomicU64::new(0),
            number: AtomicU64::new(0),
            is_closed: AtomicBool::new(false),
            tell,
        });
        let named = |e: io::Error| io::Error::new(e.kind(), explain(address, &e));
        let of_thread = Arc::clone(&shared);
        match address {
            Address::TcpListen(at) => {
                let listener = TcpListener::bind(at).map_err(named)?;
                thread::Builder::new().name("listen".into()).spawn(move || of_thread.accept(&listener))?;
            }
            _ => {
                let first = match (Connection::open(address, &shared.tell), patience, address) {
                    (Ok(connection), ..) => Some(connection),
                    // The other computer may come later; a device of this one must be there.
                    (Err(e), Patience::Waits, Address::Tcp(_)) => {
                        (shared.tell)(&format!("{}; it is tried again every second", explain(address, &e)));
                        None
                    }
                    (Err(e), ..) => return Err(named(e)),
                };
                thread::Builder::new().name("line".into()).spawn(move || of_thread.keep_open(first))?;
            }
        }
        Ok((Self { shared }, receiver))
    }

    /// Sends a packet to every connection, without waiting. `since` is the time from which its latency counts.
    pub fn send(&self, bytes: &[u8], since: Option<Instant>) {
        let mut outputs = self.shared.outputs.lock().unwrap_or_else(PoisonError::into_inner);
        if outputs.is_empty() {
            return;
        }
        let bytes: Arc<[u8]> = bytes.into();
        outputs.retain(|(_, output)| {
            let packet = Outgoing { bytes: Arc::clone(&bytes), since };
            match output.try_send(packet) {
                Ok(()) => true,
                Err(TrySendError::Full(_)) => {
                    if self.shared.dropped.fetch_add(1, Ordering::Relaxed) == 0 {
                        (self.shared.tell)("the line is slower than the telemetry: packets are dropped");
                    }
                    true
                }
                Err(TrySendError::Disconnected(_)) => false,
            }
        });
    }

    /// Returns whether there is a connection.
    pub fn is_connected(&self) -> bool {
        !self.shared.outputs.lock().unwrap_or_else(PoisonError::into_inner).is_empty()
    }

    /// Returns the number of packets for which the line had no room.
    pub fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }

    /// Waits until the packets that were sent are on the line, at most this long.
    pub fn drain(&self, longest: Duration) {
        let end = Instant::now() + longest;
        let is_empty = || {
            let outputs = self.shared.outputs.lock().unwrap_or_else(PoisonError::into_inner);
            outputs.iter().all(|(_, output)| output.is_empty())
        };
        while !is_empty() && Instant::now() < end {
            thread::sleep(Duration::from_millis(5));
        }
        // The last packet has left the queue, but perhaps not yet the thread.
        thread::sleep(Duration::from_millis(20));
    }
}

impl Shared {
    /// Takes connections until the line is closed.
    fn accept(self: &Arc<Self>, listener: &TcpListener) {
        while !self.is_closed() {
            let Ok((stream, from)) = listener.accept() else {
                thread::sleep(AGAIN);
                continue;
            };
            let count = self.outputs.lock().unwrap_or_else(PoisonError::into_inner).len();
            if count >= CONNECTIONS {
                (self.tell)(&format!("{}: {from} is refused: there are {count} connections", self.address));
                continue;
            }
            let of_thread = Arc::clone(self);
            let serve = move || {
                if let Ok(connection) = Connection::from_stream(stream) {
                    (of_thread.tell)(&format!("{}: {from} is connected", of_thread.address));
                    let end = of_thread.serve(connection);
                    (of_thread.tell)(&format!("{}: {from} is gone: {end}", of_thread.address));
                }
            };
            let _ = thread::Builder::new().name("connection".into()).spawn(serve);
        }
    }

    fn is_closed(&self) -> bool {
        self.is_closed.load(Ordering::Relaxed)
    }

    /// Keeps the line open until it is closed.
    fn keep_open(self: &Arc<Self>, mut connection: Option<Connection>) {
        let mut is_again = connection.is_none();
        loop {
            if let Some(connection) = connection.take() {
                if is_again {
                    (self.tell)(&format!("{}: connected", self.address));
                }
                let end = self.serve(connection);
                if self.is_closed() {
                    return;
                }
                (self.tell)(&format!("{}: {end}; it is opened again every second", self.address));
            }
            is_again = true;
            thread::sleep(AGAIN);
            if self.is_closed() {
                return;
            }
            connection = Connection::open(&self.address, &self.tell).ok();
        }
    }

    /// Serves a connection until it ends. Returns why.
    fn serve(self: &Arc<Self>, connection: Connection) -> String {
        let Connection { mut reader, writer } = connection;
        let (output, packets) = bounded(WAITING);
        let number = self.number.fetch_add(1, Ordering::Relaxed);
        self.outputs.lock().unwrap_or_else(PoisonError::into_inner).push((number, output));
        let latency = Arc::clone(&self.latency);
        let writing = thread::Builder::new().name("send".into()).spawn(move || write_out(writer, &packets, &latency));
        let mut piece = [0; PIECE];
        let end = loop {
            match reader.read(&mut piece) {
                Ok(0) => break "the line has ended".to_owned(),
                Ok(n) => {
                    if self.received.send(piece.get(..n).unwrap_or_default().to_vec()).is_err() {
                        break "nobody reads it".to_owned();
                    }
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => break format!("the line has failed: {e}"),
            }
        };
        // Without its output, the writing thread ends.
        self.outputs.lock().unwrap_or_else(PoisonError::into_inner).retain(|(n, _)| *n != number);
        drop(writing);
        end
    }
}

/// Writes packets until there are no more, or until the line fails. The reading thread then notices it too.
fn write_out(mut writer: Box<dyn Write + Send>, packets: &Receiver<Outgoing>, latency: &Latency) {
    for packet in packets {
        if writer.write_all(&packet.bytes).and_then(|()| writer.flush()).is_err() {
            return;
        }
        if let Some(since) = packet.since {
            latency.add(since.elapsed());
        }
    }
}

/// Returns the meaning of an error of an address, with advice.
fn explain(address: &Address, e: &io::Error) -> String {
    let advice = match (e.kind(), address) {
        (io::ErrorKind::AddrInUse, _) => "another program uses the port; end it, or choose another port".to_owned(),
        (io::ErrorKind::AddrNotAvailable, _) => "this computer has no such address; 0.0.0.0 means all".to_owned(),
        (io::ErrorKind::NotFound, Address::Serial { device, .. }) => {
            format!("there is no device {}; is the line plugged in?", device.display())
        }
        (io::ErrorKind::PermissionDenied, Address::Serial { device, .. }) => {
            format!("no permission for {}; the user must be in its group (often dialout)", device.display())
        }
        (io::ErrorKind::PermissionDenied, _) => "no permission; ports below 1024 need it".to_owned(),
        (io::ErrorKind::ConnectionRefused, _) => "nobody listens there".to_owned(),
        (io::ErrorKind::TimedOut, _) => "no answer; is the address right?".to_owned(),
        _ => e.to_string(),
    };
    format!("{address}: {advice}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(text: &str, patience: Patience) -> io::Result<(Link, Receiver<Vec<u8>>)> {
        Link::open(&text.parse().unwrap(), patience, Arc::default(), Arc::new(|_: &str| ()))
    }
    fn port() -> u16 {
        TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
    }
    /// Sends from one end until the other has it, because the connection may not be there yet.
    fn passes(from: &Link, to: &Receiver<Vec<u8>>) -> bool {
        (0..200).any(|_| {
            from.send(b"packet", Some(Instant::now()));
            to.recv_timeout(Duration::from_millis(20)).is_ok_and(|bytes| bytes.starts_with(b"packet"))
        })
    }

    #[test]
    fn bytes_pass_in_both_directions() {
        let (a, b) = (port(), port());
        for (here, there) in [
            (format!("tcp-listen:127.0.0.1:{a}"), format!("tcp:127.0.0.1:{a}")),
            (format!("udp:127.0.0.1:{a},127.0.0.1:{b}"), format!("udp:127.0.0.1:{b},127.0.0.1:{a}")),
        ] {
            let (flight, commands) = open(&here, Patience::Waits).unwrap();
            let (ground, telemetry) = open(&there, Patience::Fails).unwrap();
            assert!(passes(&flight, &telemetry), "{here}");
            assert!(passes(&ground, &commands), "{there}");
            assert!(flight.shared.latency.count() > 0);
        }
    }

    #[test]
    fn two_listeners_hear_the_same() {
        let at = port();
        let (flight, commands) = open(&format!("tcp-listen:127.0.0.1:{at}"), Patience::Waits).unwrap();
        let [(_a, first), (b, second)] = [0, 1].map(|_| open(&format!("tcp:127.0.0.1:{at}"), Patience::Fails).unwrap());
        assert!(passes(&flight, &first) && passes(&flight, &second) && passes(&b, &commands));
    }

    #[test]
    fn a_line_comes_back() {
        let at = port();
        let (ground, telemetry) = open(&format!("tcp:127.0.0.1:{at}"), Patience::Waits).unwrap();
        for _ in 0..2 {
            let listener = TcpListener::bind(format!("127.0.0.1:{at}")).unwrap();
            let (mut stream, _) = listener.accept().unwrap();
            stream.write_all(b"packet").unwrap();
            assert_eq!(telemetry.recv_timeout(Duration::from_secs(5)).unwrap(), b"packet");
            let mut there = [0; 6];
            let read = (0..100).any(|_| {
                ground.send(b"packet", None);
                stream.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
                stream.read(&mut there).is_ok_and(|n| n > 0)
            });
            assert!(read);
        }
    }

    #[test]
    fn an_address_that_cannot_be_used_says_why() {
        let error = |text: &str| open(text, Patience::Fails).err().unwrap().to_string();
        let taken = TcpListener::bind("127.0.0.1:0").unwrap();
        let at = taken.local_addr().unwrap().port();
        assert!(error(&format!("tcp-listen:127.0.0.1:{at}")).contains("another program uses the port"));
        let (_udp, socket) = (0, std::net::UdpSocket::bind("127.0.0.1:0").unwrap());
        assert!(error(&format!("udp:{}", socket.local_addr().unwrap())).contains("another program uses the port"));
        assert!(error("serial:/dev/no-such-port").contains("is the line plugged in?"));
        assert!(error("udp:192.0.2.1:5000").contains("no such address"));
        assert!(error(&format!("tcp:127.0.0.1:{}", port())).contains("nobody listens there"));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_serial_line_passes_bytes_and_may_be_unplugged() {
        let told = Arc::new(Mutex::new(Vec::<String>::new()));
        let (near, far) = serial2::SerialPort::pair().unwrap();
        let device = {
            use std::os::fd::AsRawFd;
            std::fs::read_link(format!("/proc/self/fd/{}", far.as_raw_fd())).unwrap()
        };
        let list = Arc::clone(&told);
        let tell: Tell = Arc::new(move |line: &str| list.lock().unwrap().push(line.to_owned()));
        let address = Address::Serial { device, baud: 115_200 };
        let (link, commands) = Link::open(&address, Patience::Waits, Arc::default(), tell).unwrap();
        drop(far);
        near.write_all(b"command").unwrap();
        assert_eq!(commands.recv_timeout(Duration::from_secs(5)).unwrap(), b"command");
        assert!((0..100).any(|_| {
            link.send(b"packet", None);
            let mut piece = [0; 64];
            near.read(&mut piece).is_ok_and(|n| n > 0)
        }));
        drop(near);
        let is_told = || told.lock().unwrap().iter().any(|line| line.contains("it is opened again every second"));
        assert!((0..200).any(|_| {
            thread::sleep(Duration::from_millis(20));
            is_told()
        }));
    }
}
