//! The screen of the ground station: the terminal, the keys, and the loop.

use std::time::{Duration, Instant};

use hzn_ground::{Came, Commander, Incoming, Station};
use hzn_mcap::LogLevel;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::view::View;
use crate::exit::Stop;

/// Shortest time between two drawings.
const REDRAW: Duration = Duration::from_millis(100);

/// What a key asks for.
#[derive(Debug, PartialEq, Eq)]
enum Wish {
    Nothing,
    Quit,
    Send(String),
}

/// Shows the screen until the bytes end or the user quits. Returns the bytes after the last packet.
pub(crate) fn show(incoming: Incoming, station: &mut Station, mut commander: Commander) -> Result<Vec<u8>, Stop> {
    let mut terminal = ratatui::try_init()?;
    let outcome = run(&incoming, station, &mut commander, &mut terminal);
    ratatui::restore();
    outcome
}

fn run(
    incoming: &Incoming,
    station: &mut Station,
    commander: &mut Commander,
    terminal: &mut ratatui::DefaultTerminal,
) -> Result<Vec<u8>, Stop> {
    station.mute();
    let mut view = View::new(incoming.name());
    let (mut rest, mut heard, mut drawn) = (Vec::new(), None::<Instant>, None::<Instant>);
    loop {
        match incoming.wait(&mut rest) {
            Came::Bytes => {
                let before = station.counts().packets;
                station.take(&mut rest)?;
                if station.counts().packets > before {
                    heard = Some(Instant::now());
                }
            }
            Came::Nothing => {}
            Came::End => return Ok(rest),
        }
        let seen = station.take_seen();
        for answered in incoming.command_next(commander, &seen)? {
            let level = if answered.is_done() { LogLevel::Info } else { LogLevel::Error };
            view.tell(level, format!("{:10}  {answered}", ""));
        }
        incoming.take_notices().iter().for_each(|text| view.tell(LogLevel::Warning, format!("{:10}  {text}", "")));
        view.take(seen);
        station.flush_if_due()?;
        view.silent = heard.map(|at| at.elapsed());
        while event::poll(Duration::ZERO)? {
            let Event::Key(key) = event::read()? else { continue };
            match press(&mut view.typed, key) {
                Wish::Nothing => {}
                Wish::Quit => return Ok(rest),
                Wish::Send(text) => {
                    if let Some(last) = view.last_sequence().filter(|_| commander.is_idle()) {
                        commander.continue_after(last);
                    }
                    if let Err(error) = commander.add(&text) {
                        view.tell(LogLevel::Error, format!("{:10}  {error}", ""));
                    }
                }
            }
            drawn = None;
        }
        if drawn.is_none_or(|at| at.elapsed() >= REDRAW) {
            terminal.draw(|frame| view.draw(frame, station.counts()))?;
            drawn = Some(Instant::now());
        }
    }
}

/// Takes a key. `typed` is the command that is being typed.
fn press(typed: &mut Option<String>, key: KeyEvent) -> Wish {
    if key.kind == KeyEventKind::Release {
        return Wish::Nothing;
    }
    // In this mode of the terminal Ctrl-C is a key like any other.
    if key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL) {
        return Wish::Quit;
    }
    match (&mut *typed, key.code) {
        (None, KeyCode::Char('q')) => return Wish::Quit,
        (None, KeyCode::Char('c' | ':')) => *typed = Some(String::new()),
        (None, _) => {}
        (Some(_), KeyCode::Esc) => *typed = None,
        (Some(_), KeyCode::Enter) => {
            let text = typed.take().unwrap_or_default();
            if !text.trim().is_empty() {
                return Wish::Send(text);
            }
        }
        (Some(text), KeyCode::Backspace) => drop(text.pop()),
        (Some(text), KeyCode::Char(c)) => text.push(c),
        (Some(_), _) => {}
    }
    Wish::Nothing
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_typed() {
        let mut typed = None;
        let mut keys = |codes: &[KeyCode]| {
            let press = |code: &KeyCode| press(&mut typed, KeyEvent::new(*code, KeyModifiers::NONE));
            codes.iter().map(press).last().unwrap()
        };
        let text = |text: &str| text.chars().map(KeyCode::Char).collect::<Vec<_>>();
        assert_eq!(keys(&text("xc")), Wish::Nothing);
        assert_eq!(keys(&text("pinqg")), Wish::Nothing);
        assert_eq!(keys(&[KeyCode::Backspace, KeyCode::Backspace]), Wish::Nothing);
        assert_eq!(keys(&[KeyCode::Char('g'), KeyCode::Enter]), Wish::Send("ping".into()));
        // An empty command is none, and Esc leaves the command.
        assert_eq!(keys(&[KeyCode::Char(':'), KeyCode::Enter]), Wish::Nothing);
        assert_eq!(keys(&[KeyCode::Char(':'), KeyCode::Char('q'), KeyCode::Esc]), Wish::Nothing);
        assert_eq!(keys(&text("q")), Wish::Quit);
        let ctrl_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(press(&mut Some("pi".into()), ctrl_c), Wish::Quit);
    }
}
