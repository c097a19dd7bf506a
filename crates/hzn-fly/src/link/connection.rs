//! One connection of a line: a part that reads and a part that writes.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs, UdpSocket};
use std::path::Path;
use std::time::Duration;

use serial2::SerialPort;

use super::address::Address;
use crate::tell::{Rarely, Tell};

/// Longest wait for a connection over TCP.
const CONNECT: Duration = Duration::from_secs(3);
/// Longest wait of a write. A receiver that takes nothing for so long is gone.
const WRITE: Duration = Duration::from_secs(10);

/// A connection that is open.
pub(super) struct Connection {
    pub(super) reader: Box<dyn Read + Send>,
    pub(super) writer: Box<dyn Write + Send>,
}

impl Connection {
    /// Opens a connection to an address that does not listen.
    pub(super) fn open(address: &Address, tell: &Tell) -> io::Result<Self> {
        match address {
            Address::Udp { local, remote } => udp(local, remote.as_deref(), tell),
            Address::Tcp(to) => Self::from_stream(connect(to)?),
            Address::Serial { device, baud } => serial(device, *baud),
            Address::TcpListen(_) => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    pub(super) fn from_stream(stream: TcpStream) -> io::Result<Self> {
        // A packet must not wait for the next one.
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE))?;
        let writer = stream.try_clone()?;
        Ok(Self { reader: Box::new(stream), writer: Box::new(writer) })
    }
}

fn connect(to: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for address in to.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT) {
            Ok(stream) => return Ok(stream),
            Err(e) => last = e,
        }
    }
    Err(last)
}

fn udp(local: &str, remote: Option<&str>, tell: &Tell) -> io::Result<Connection> {
    let socket = UdpSocket::bind(local)?;
    if let Some(remote) = remote {
        let of_family = |a: &SocketAddr| socket.local_addr().is_ok_and(|l| l.is_ipv4() == a.is_ipv4());
        let address = remote.to_socket_addrs()?.find(of_family);
        // The socket then takes datagrams from there only.
        socket.connect(address.ok_or_else(|| io::Error::new(io::ErrorKind::NotFound, "the name has no address"))?)?;
    }
    let writer =
        Datagrams { socket: socket.try_clone()?, remote: remote.map(str::to_owned), tell: Rarely::new(tell.clone()) };
    let reader = Datagrams { socket, remote: None, tell: Rarely::new(tell.clone()) };
    Ok(Connection { reader: Box::new(reader), writer: Box::new(writer) })
}

/// A socket for datagrams. It does not end when the other computer is away.
struct Datagrams {
    socket: UdpSocket,
    remote: Option<String>,
    tell: Rarely,
}

impl Read for Datagrams {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.socket.recv(into) {
                // An empty datagram is not the end.
                Ok(0) => {}
                // The other computer has said that nobody listens there now.
                Err(e) if is_away(&e) => {}
                other => return other,
            }
        }
    }
}

impl Write for Datagrams {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let Some(remote) = &self.remote else { return Ok(bytes.len()) };
        match self.socket.send(bytes) {
            Err(e) if is_away(&e) => self.tell.line(&format!("{remote} does not receive the packets: {e}")),
            other => return other,
        }
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Returns whether an error says that the other computer cannot be reached now.
fn is_away(e: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, HostUnreachable, Interrupted, NetworkDown, NetworkUnreachable};
    matches!(e.kind(), ConnectionRefused | HostUnreachable | NetworkUnreachable | NetworkDown | Interrupted)
}

/// Opens a serial port with 8 bits, no parity, one stop bit and no flow control.
fn serial(device: &Path, baud: u32) -> io::Result<Connection> {
    let mut port = SerialPort::open(device, baud)?;
    port.set_write_timeout(WRITE)?;
    let writer = port.try_clone()?;
    Ok(Connection { reader: Box::new(Serial(port)), writer: Box::new(writer) })
}

/// A serial port that waits for bytes for ever.
struct Serial(SerialPort);

impl Read for Serial {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.0.read(into) {
                Err(e) if matches!(e.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {}
                // A port that was unplugged has an end.
                other => return other,
            }
        }
    }
}
