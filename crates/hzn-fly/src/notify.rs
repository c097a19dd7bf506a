//! Messages to systemd over its socket, if the program was started by a unit of `Type=notify`.

use std::env;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::{Duration, Instant};

/// The connection to systemd.
#[derive(Debug, Default)]
pub(crate) struct Notify {
    socket: Option<(UnixDatagram, SocketAddr)>,
    /// Time between two messages to the watchdog; `None` without a watchdog.
    every: Option<Duration>,
    last: Option<Instant>,
}

impl Notify {
    /// Reads `NOTIFY_SOCKET` and `WATCHDOG_USEC` of the environment. `WATCHDOG_PID` does not count: in a pipe it is the
    /// number of the shell.
    pub(crate) fn from_environment() -> Self {
        let usec = env::var("WATCHDOG_USEC").ok().and_then(|text| text.parse().ok());
        Self::new(env::var("NOTIFY_SOCKET").ok().as_deref(), usec)
    }

    fn new(path: Option<&str>, watchdog_usec: Option<u64>) -> Self {
        let address = |path: &str| match path.strip_prefix('@') {
            Some(name) => SocketAddr::from_abstract_name(name),
            None => SocketAddr::from_pathname(path),
        };
        let socket = path.and_then(|path| Some((UnixDatagram::unbound().ok()?, address(path).ok()?)));
        if let Some((socket, _)) = &socket {
            // A full queue of systemd must not stop the loop.
            let _ = socket.set_nonblocking(true);
        }
        // Half of the time is what systemd recommends; a quarter forgives a late turn.
        Self { socket, every: watchdog_usec.map(|usec| Duration::from_micros(usec / 4)), last: None }
    }

    fn send(&self, message: &str) {
        if let Some((socket, address)) = &self.socket {
            let _ = socket.send_to_addr(message.as_bytes(), address);
        }
    }

    /// Says that the flight loop runs.
    pub(crate) fn ready(&self) {
        self.send("READY=1");
    }
    /// Says that the flight loop ends.
    pub(crate) fn stopping(&self) {
        self.send("STOPPING=1");
    }
    /// Shows a line of text in `systemctl status`.
    pub(crate) fn status(&self, text: &str) {
        self.send(&format!("STATUS={text}"));
    }
    /// Feeds the watchdog, if its time has come.
    pub(crate) fn feed(&mut self) {
        let Some(every) = self.every else { return };
        if self.last.is_none_or(|last| last.elapsed() >= every) {
            self.last = Some(Instant::now());
            self.send("WATCHDOG=1");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systemd_hears_of_the_loop() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("notify");
        let systemd = UnixDatagram::bind(&path).unwrap();
        let mut notify = Notify::new(path.to_str(), Some(40_000));
        notify.ready();
        for _ in 0..3 {
            notify.feed();
        }
        std::thread::sleep(Duration::from_millis(15));
        notify.feed();
        notify.stopping();
        let mut heard = Vec::new();
        systemd.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        let mut room = [0; 64];
        while let Ok(n) = systemd.recv(&mut room) {
            heard.push(String::from_utf8_lossy(&room[..n]).into_owned());
        }
        assert_eq!(heard, ["READY=1", "WATCHDOG=1", "WATCHDOG=1", "STOPPING=1"]);
        // Without systemd nothing happens.
        let mut alone = Notify::new(None, None);
        alone.ready();
        alone.feed();
    }

    #[test]
    fn the_abstract_socket_works_too() {
        let name = format!("hzn-fly-test-{}", std::process::id());
        let systemd = UnixDatagram::bind_addr(&SocketAddr::from_abstract_name(&name).unwrap()).unwrap();
        Notify::new(Some(&format!("@{name}")), None).ready();
        let mut room = [0; 16];
        assert_eq!(systemd.recv(&mut room).unwrap(), 7);
    }
}
