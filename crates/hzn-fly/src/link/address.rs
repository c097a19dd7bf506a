//! The address of a line, as a user writes it.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// The other end of a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Address {
    /// Datagrams. With a remote address, only datagrams from there are taken.
    Udp {
        /// Host and port of this computer.
        local: String,
        /// Host and port of the other computer; without it, nothing can be sent.
        remote: Option<String>,
    },
    /// Connections that others make to this host and port.
    TcpListen(String),
    /// A connection to this host and port.
    Tcp(String),
    /// A serial port.
    Serial {
        /// The device.
        device: PathBuf,
        /// Bits a second.
        baud: u32,
    },
}

/// The forms of an address, for messages.
pub const FORMS: &str = "udp:LOCAL[,REMOTE], tcp:HOST:PORT, tcp-listen:HOST:PORT or serial:DEVICE[:BAUD]; \
                         LOCAL and REMOTE are HOST:PORT; LOCAL may be a PORT, which only this computer reaches";
/// Speed of a serial line whose address names none.
const BAUD: u32 = 115_200;

impl Address {
    /// Returns whether a text begins like an address. It could also be the name of a file.
    pub fn is_address(text: &str) -> bool {
        ["udp:", "tcp:", "tcp-listen:", "serial:"].iter().any(|kind| text.starts_with(kind))
    }
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some((kind, rest)) = text.split_once(':') else { return Err(format!("it must be {FORMS}")) };
        match kind {
            "udp" => {
                let (local, remote) = match rest.split_once(',') {
                    Some((local, remote)) => (local, Some(host_and_port(remote)?)),
                    None => (rest, None),
                };
                Ok(Self::Udp { local: own_port(local)?, remote })
            }
            "tcp" => Ok(Self::Tcp(host_and_port(rest)?)),
            "tcp-listen" => Ok(Self::TcpListen(own_port(rest)?)),
            "serial" => {
                let (device, baud) = match rest.rsplit_once(':') {
                    Some((device, baud)) => (device, baud.parse().ok().filter(|&b| b > 0)),
                    None => (rest, Some(BAUD)),
                };
                let baud = baud.ok_or("the speed of a serial line must be a number, as in serial:/dev/ttyS0:115200")?;
                if device.is_empty() {
                    return Err("a serial line needs a device, as in serial:/dev/ttyS0:115200".into());
                }
                Ok(Self::Serial { device: device.into(), baud })
            }
            _ => Err(format!("it must be {FORMS}")),
        }
    }
}

/// Returns the address of a port of this computer. Without a host it is that of the loopback, so that no other computer
/// reaches it unless the user says so.
fn own_port(text: &str) -> Result<String, String> {
    match text.parse::<u16>() {
        Ok(port) => Ok(format!("127.0.0.1:{port}")),
        Err(_) => host_and_port(text),
    }
}

fn host_and_port(text: &str) -> Result<String, String> {
    let port = text.rsplit_once(':').filter(|(host, _)| !host.is_empty()).map(|(_, port)| port.parse::<u16>());
    match port {
        Some(Ok(_)) => Ok(text.to_owned()),
        _ => Err(format!("{text:?} must be HOST:PORT, for example 127.0.0.1:5000")),
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Udp { local, remote: None } => write!(f, "udp:{local}"),
            Self::Udp { local, remote: Some(remote) } => write!(f, "udp:{local},{remote}"),
            Self::TcpListen(at) => write!(f, "tcp-listen:{at}"),
            Self::Tcp(to) => write!(f, "tcp:{to}"),
            Self::Serial { device, baud } => write!(f, "serial:{}:{baud}", device.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_survives_a_round_trip() {
        for text in [
            "udp:0.0.0.0:5001",
            "udp:0.0.0.0:5001,ground:5000",
            "tcp:[::1]:80",
            "tcp-listen:0.0.0.0:5000",
            "serial:/dev/ttyS0:9600",
        ] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), text);
        }
        let default: Address = "serial:/dev/ttyUSB0".parse().unwrap();
        assert_eq!(default.to_string(), "serial:/dev/ttyUSB0:115200");
        // A port alone is one of the loopback.
        for (text, whole) in [("udp:5001", "udp:127.0.0.1:5001"), ("tcp-listen:5000", "tcp-listen:127.0.0.1:5000")] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), whole);
        }
    }

    #[test]
    fn a_wrong_address_says_what_is_right() {
        let error = |text: &str| text.parse::<Address>().unwrap_err();
        assert!(error("ground").contains("tcp:HOST:PORT"));
        assert!(error("http:ground:80").contains("tcp:HOST:PORT"));
        for text in
            ["udp:", "udp::5000", "udp:70000", "tcp:ground", "tcp:ground:99999", "udp:a:1,b", "udp:1,2", "tcp:5000"]
        {
            assert!(error(text).contains("must be HOST:PORT"), "{text}");
        }
        assert!(error("serial:").contains("needs a device"));
        assert!(error("serial:/dev/ttyS0:fast").contains("must be a number"));
    }
}
