//! Files that are neither pictures nor tables, by their content.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use hzn_files::{camera_file, limited};
use hzn_flight::packet::{MAX_BYTES, SYNC};
use hzn_run::source::{decode, ending};

/// A file that hzn writes, or that a program around it writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Content {
    /// The kind, as a word for programs.
    pub(crate) kind: &'static str,
    /// What the file is.
    pub(crate) what: &'static str,
    /// Which command or program reads it.
    pub(crate) command: &'static str,
}

/// Content of a prepared sensor.
pub(crate) const PREPARED: Content = Content {
    kind: "prepared-sensor",
    what: "a prepared sensor of `hzn prepare`",
    command: "a flight computer reads it with Sensor::from_prepared or FlightHorizon::load",
};
/// Content of a stream that a flight computer sends.
pub(crate) const TELEMETRY: Content = Content {
    kind: "telemetry",
    what: "a stream of telemetry of a flight computer",
    command: "hzn telemetry FILE -o answers.csv decodes it",
};
/// Content of a stream that is sent to a flight computer.
pub(crate) const TELECOMMANDS: Content = Content {
    kind: "telecommands",
    what: "a stream of telecommands for a flight computer",
    command: "send it over its line; hzn telecommand writes and sends them",
};

/// Kinds of files by the bytes at their beginning.
const BEGINNINGS: [(&[u8], Content); 9] = [
    (b"hzns", PREPARED),
    // An attitude of 504.0-B and an orbit of 502.0-B as text.
    (
        b"CCSDS_AEM_VERS",
        content("aem", "a CCSDS AEM, which has attitudes", "hzn fuse --aem writes it for other programs"),
    ),
    (b"CCSDS_OEM_VERS", content("oem", "a CCSDS OEM, which has an orbit", "hzn fuse --gnss reads it as a receiver")),
    // The first word of a binary kernel of SPICE, and of its text kernels.
    (b"DAF/CK", content("ck", "a CK of SPICE, which has attitudes", "hzn fuse --ck writes it for other programs")),
    (b"DAF/SPK", content("spk", "an SPK of SPICE, which has positions", "other programs read it")),
    (b"KPL/", content("spice-text", "a text kernel of SPICE", "hzn fuse --ck writes .tsc and .tf beside a CK")),
    (
        b"HZNP",
        content(
            "parameters",
            "a copy of the parameters that a flight computer keeps",
            "hzn fly --state FOLDER reads them",
        ),
    ),
    (b"HZNK", content("key", "a key for telecommands", "hzn key FILE shows what it is for")),
    (b"<!doctype html", content("page", "a page of HTML", "a browser shows it")),
];

const fn content(kind: &'static str, what: &'static str, command: &'static str) -> Content {
    Content { kind, what, command }
}

const COUNTER: Content =
    content("key-counter", "the counter of a key for telecommands", "hzn key FILE shows the key beside it");
const FUSE: Content = content("fuse", "a fuse.toml", "hzn fuse --config reads it");
pub(crate) const CAMERA_FILE: Content = content(
    "camera",
    "a camera file",
    "`hzn camera convert FILE -o sensor.toml` makes a sensor.toml of it, or the section [camera] of one names it",
);
/// What an existing picture is where something else is needed.
const PICTURE: Content = content("picture", "a picture", "hzn run reads it");

/// Kinds of TOML files by keys that they must have, in this order: a fuse.toml may have the tables [camera] and
/// [mount], and a sensor.toml the table [mount].
const SETTINGS: [(&[&str], Content); 10] = [
    (&["trajectory", "capture"], content("scene", "a scene.toml", "hzn simulate reads it")),
    (&["head"], content("rig", "a rig.toml", "hzn run rig.toml reads it")),
    (&["imu"], FUSE),
    (&["gnss"], FUSE),
    (&["start"], FUSE),
    (&["orbit"], FUSE),
    (&["limb_height"], FUSE),
    (&["cameras"], FUSE),
    (&["camera"], content("sensor", "a sensor.toml", "hzn run PICTURES --sensor reads it")),
    (&["mount"], content("mount", "a mount of a camera", "hzn fuse --mount CAMERA=FILE reads it")),
];

/// Number of bytes that say what a file is.
const HEAD: u64 = 64 << 10;
/// Bytes of the primary header of a packet.
const HEADER: usize = 6;
/// Largest distance of the first packet from the beginning of a stream: noise of a line comes first.
const NOISE: usize = 4096;

/// Returns what a file is by its content; `None` if hzn does not know it, if it is a picture, a table, or no file.
pub(crate) fn of_file(path: &Path) -> Option<Content> {
    // A pipe or a device gives its bytes only once.
    let head = path.is_file().then(|| head(path)).flatten()?;
    match ending(path).as_str() {
        "toml" => of_settings(&limited::read_text(path, limited::SETTINGS_BYTES).ok()?),
        "yaml" | "yml" | "json" | "xml" => of_bytes(&head).or_else(|| of_camera_file(path)),
        "counter" if head.len() < 64 && head.first().is_some_and(u8::is_ascii_digit) => Some(COUNTER),
        _ => of_bytes(&head),
    }
}

/// Returns what a file is, as [`of_file`] does, or that it is a picture.
pub(crate) fn of_file_or_picture(path: &Path) -> Option<Content> {
    let is_picture = || path.is_file() && head(path).is_some_and(|head| decode::guess_format(&head).is_some());
    of_file(path).or_else(|| is_picture().then_some(PICTURE))
}

fn of_camera_file(path: &Path) -> Option<Content> {
    camera_file::load_any(path, Default::default()).ok().map(|_| CAMERA_FILE)
}

fn head(path: &Path) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path).ok()?.take(HEAD).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

/// Returns what bytes from the beginning of a file are.
fn of_bytes(bytes: &[u8]) -> Option<Content> {
    let known = BEGINNINGS.iter().find(|(first, _)| bytes.starts_with(first)).map(|(_, content)| *content);
    known.or_else(|| of_packets(bytes)).or_else(|| of_text(bytes))
}

/// Returns what a stream of packets is. The first packet must be as `hzn_flight::packet` describes it, so that bytes of
/// a picture are no packet by chance.
fn of_packets(bytes: &[u8]) -> Option<Content> {
    let is_packet = |window: &&[u8]| {
        let Some(&[first, _, flags, _, high, low]) = window.strip_prefix(&SYNC) else { return false };
        let length = usize::from(u16::from_be_bytes([high, low]));
        first & 0xE8 == 0x08 && flags & 0xC0 == 0xC0 && length < MAX_BYTES
    };
    let packet = bytes.windows(SYNC.len() + HEADER).take(NOISE).find(is_packet)?;
    let is_command = packet.get(SYNC.len())? & 0x10 != 0;
    Some(if is_command { TELECOMMANDS } else { TELEMETRY })
}

/// Returns what XML or JSON is.
fn of_text(bytes: &[u8]) -> Option<Content> {
    let text = String::from_utf8_lossy(bytes.get(..bytes.len().min(2048))?);
    let trimmed = text.trim_start();
    if trimmed.starts_with('<') && text.contains("omg.org/spec/XTCE") {
        return Some(content("xtce", "the dictionary of the packets, as XTCE", "ground systems read it"));
    }
    (trimmed.starts_with('{') && text.contains("json-schema.org"))
        .then(|| content("schema", "a JSON schema", "editors complete keys with it"))
}

fn of_settings(text: &str) -> Option<Content> {
    let table: toml::Table = text.parse().ok()?;
    let fits = |keys: &[&str]| keys.iter().all(|key| table.contains_key(*key));
    SETTINGS.iter().find(|(keys, _)| fits(keys)).map(|(_, content)| *content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_their_first_bytes() {
        let kind = |bytes: &[u8]| of_bytes(bytes).map(|content| content.kind);
        assert_eq!(kind(b"hzns\xff\xfe"), Some("prepared-sensor"));
        assert_eq!(kind(b"noise\x1a\xcf\xfc\x1d\x09\x02\xc0\x00\x00\x14"), Some("telemetry"));
        assert_eq!(kind(b"\x1a\xcf\xfc\x1d\x19\xc0\xc0\x00\x00\x0a"), Some("telecommands"));
        assert_eq!(kind(b"DAF/CK  hzn"), Some("ck"));
        for unknown in
            [b"".as_slice(), b"\x1a\xcf\xfc\x1d\x19\xc0\x00\x00\x00\x0a", b"\x89PNG\r\n\x1a\n", b"{}", b"<a/>"]
        {
            assert_eq!(kind(unknown), None, "{unknown:?}");
        }
        let kind = |text: &str| of_settings(text).map(|content| content.kind);
        assert_eq!(kind("[camera]\n[mount]\n"), Some("sensor"));
        assert_eq!(kind("[[head]]\n"), Some("rig"));
        assert_eq!(kind("[tool]\n"), None);
    }
}
