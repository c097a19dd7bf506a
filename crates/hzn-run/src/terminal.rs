//! Text that may reach a terminal.
//!
//! A text from a file, a name or a recording can contain characters that a terminal obeys: they move the cursor, write
//! the clipboard, or reverse the order of reading. Every program that prints such a text makes these characters visible
//! first, as `\x1b` or `\u{202e}`.

use std::fmt::{Display, Write as _};
use std::io::{self, IsTerminal, Write};

/// Returns a text as one line: line breaks and tabs become visible too.
pub fn one_line(text: impl Display) -> String {
    escape(&text.to_string(), is_obeyed)
}

/// Returns a text of several lines. Its line breaks and tabs stay.
pub fn lines(text: impl Display) -> String {
    escape(&text.to_string(), |c| is_obeyed(c) && !matches!(c, '\n' | '\t'))
}

/// Returns whether a terminal obeys a character instead of showing it: the control characters, and those that change
/// the direction of writing.
pub(crate) fn is_obeyed(c: char) -> bool {
    c.is_control() || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

fn escape(text: &str, is_escaped: impl Fn(char) -> bool) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        // A String takes every write.
        let _ = match c {
            c if !is_escaped(c) => out.write_char(c),
            '\n' => out.write_str(r"\n"),
            '\r' => out.write_str(r"\r"),
            '\t' => out.write_str(r"\t"),
            c if u32::from(c) < 0x100 => write!(out, r"\x{:02x}", u32::from(c)),
            c => write!(out, r"\u{{{:x}}}", u32::from(c)),
        };
    }
    out
}

/// stdout for the content of a file, such as a table. The bytes stay as they are, unless stdout is a terminal.
#[derive(Debug)]
pub struct FileOnStdout<W = io::Stdout> {
    out: W,
    is_terminal: bool,
}

impl FileOnStdout {
    /// Makes a writer to stdout.
    pub fn new() -> Self {
        let out = io::stdout();
        Self { is_terminal: out.is_terminal(), out }
    }
}

impl<W> FileOnStdout<W> {
    /// Returns whether stdout is a terminal.
    pub fn is_terminal(&self) -> bool {
        self.is_terminal
    }
}

impl Default for FileOnStdout {
    fn default() -> Self {
        Self::new()
    }
}

impl<W: Write> Write for FileOnStdout<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !self.is_terminal {
            return self.out.write(bytes);
        }
        // Whoever writes passes whole lines, so that no character is cut.
        self.out.write_all(lines(String::from_utf8_lossy(bytes)).as_bytes()).map(|()| bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns every character that a terminal must not get, written down independently of the code above.
    fn obeyed() -> impl Iterator<Item = char> {
        let each = (0..0x20).chain(0x7f..=0x9f).chain(0x202a..=0x202e).chain(0x2066..=0x2069);
        each.filter_map(char::from_u32)
    }

    #[test]
    fn what_a_terminal_obeys_becomes_visible() {
        for c in obeyed() {
            let shown = one_line(format!("a{c}b"));
            assert!(
                shown.starts_with("a\\") && shown.ends_with('b') && !obeyed().any(|c| shown.contains(c)),
                "{shown}"
            );
        }
        assert_eq!(
            one_line("\x1b]52;c;aGk=\x07\u{9b}31m\u{202e}\u{2066}"),
            r"\x1b]52;c;aGk=\x07\x9b31m\u{202e}\u{2066}"
        );
        assert_eq!(one_line("a\nb\tc\r\0\x7f"), r"a\nb\tc\r\x00\x7f");
        assert_eq!(lines("a\nb\tc\r\x1b"), "a\nb\tc\\r\\x1b");
        // Everything else stays, also letters of other scripts and what is written from right to left by nature.
        for same in ["C:\\x1b", "±0.1°", "شمس", "日没.png", "a\u{a0}b", "\u{2029}", "👨\u{200d}🚀"] {
            assert_eq!(one_line(same), same);
        }
    }

    #[test]
    fn only_a_terminal_gets_another_table() {
        let table = "file,detail\n\x1b[2J.png,\u{202e}gnp\n";
        let written = |is_terminal| {
            let mut out = FileOnStdout { out: Vec::new(), is_terminal };
            out.write_all(table.as_bytes()).unwrap();
            String::from_utf8(out.out).unwrap()
        };
        assert_eq!(written(false), table);
        assert_eq!(written(true), "file,detail\n\\x1b[2J.png,\\u{202e}gnp\n");
    }
}
