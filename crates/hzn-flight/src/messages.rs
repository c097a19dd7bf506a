//! What stands in packets: telecommands, and telemetry besides the answers. Numbers are frozen.

use crate::bytes::{Reader, Writer};
use crate::numbered::numbered;

numbered! {
    /// Modes, after HORACE (Barf 2014).
    pub enum Mode: u8 {
        /// Checked and waiting for lift-off or a command; pictures are processed on command.
        Standby = 0 => "standby",
        /// Every picture is processed.
        Flight = 1 => "flight",
        /// No picture is processed; commands are answered. Entered when a self-check fails.
        Safe = 2 => "safe",
        /// Nothing is written any more: power may be cut. Left by a reset only.
        ShutDown = 3 => "shut-down",
    }
}

numbered! {
    /// What became of a telecommand.
    pub enum Code: u8 {
        /// Done.
        Done = 0 => "done",
        /// The packet was broken or cut off.
        Broken = 1 => "packet broken or cut off",
        /// The arguments are too short, too long, or not of this function.
        Arguments = 2 => "wrong arguments",
        /// There is no such function, or the packet is no telecommand.
        Unknown = 3 => "no such function",
        /// Not in this mode.
        Mode = 4 => "not in this mode",
        /// No parameter has this number.
        UnknownParameter = 5 => "no such parameter",
        /// A parameter, or all together, was refused; nothing changed.
        Refused = 6 => "value refused, nothing changed",
        /// The memory did not keep the parameters; they hold until the next reset.
        NotStored = 7 => "in force, but not stored",
    }
}

numbered! {
    /// Functions of telecommands: the first byte of the user data.
    pub enum Function: u8 {
        /// A mode (u8).
        SetMode = 1 => "mode",
        /// How many (u8), then number (u16) and value (f64) of each: all or none, then stored.
        SetParameters = 2 => "set",
        /// How many (u8), then the number (u16) of each.
        ReadParameters = 3 => "read",
        /// Processes the next picture, in standby.
        ProcessOnce = 4 => "process-once",
        /// Sends the edges of the next picture that is processed.
        DumpEdges = 5 => "dump-edges",
        /// Sets the counters of housekeeping to zero.
        ResetCounters = 6 => "reset-counters",
        /// What navigation knows, for the pictures to come: altitude in metres, ECEF position in metres (4 × f32, NaN:
        /// not known), and, if they follow, the camera's rate of rotation in its own axes in rad/s (3 × f32).
        SetKnown = 7 => "known",
    }
}

numbered! {
    /// How bad an event is.
    pub enum Severity: u8 {
        /// As it should be.
        Information = 0 => "information",
        /// Something was wrong and was dealt with.
        Warning = 1 => "warning",
        /// Something is wrong.
        Error = 2 => "error",
    }
}

numbered! {
    /// Something that happened, with two numbers that say more.
    pub enum Event: u16 {
        /// Started. Copy of the parameters that was taken (1, 2; 0 defaults), their generation.
        Started = 1 => "started",
        /// A copy of the parameters cannot be used. Copy (1, 2); 1 no table, 2 checksum, 3 refused.
        CopyBroken = 2 => "a copy of the parameters cannot be used",
        /// No copy can be used: the defaults hold. 0, 0.
        Defaults = 3 => "no copy of the parameters can be used: defaults",
        /// The mode changed. From, to.
        ModeChanged = 4 => "mode changed",
        /// A telecommand was rejected. [`Code`], function.
        CommandRejected = 5 => "telecommand rejected",
        /// A picture has the wrong size. Bytes, expected bytes.
        WrongSize = 6 => "picture of wrong size",
        /// Pictures were lost because the processing was not done. How many, 0.
        Overrun = 7 => "pictures lost",
        /// The parameters were stored. Copy (1, 2), generation.
        Stored = 8 => "parameters stored",
        /// A self-check failed. Bits: 1 camera, 2 memory, 4 parameters; 0.
        SelfCheck = 9 => "self-check failed",
        /// The last reset was the watchdog's. 0, 0.
        Watchdog = 10 => "reset by the watchdog",
        /// The memory did not keep the parameters. Copy (1, 2), 0.
        StoreFailed = 11 => "parameters not stored",
        /// What navigation told cannot be. 0, 0.
        KnownRefused = 12 => "what navigation told cannot be",
    }
}

impl Event {
    /// How bad it is.
    pub const fn severity(self) -> Severity {
        match self {
            Self::Started | Self::ModeChanged | Self::Stored => Severity::Information,
            Self::CopyBroken | Self::CommandRejected | Self::WrongSize | Self::Overrun | Self::KnownRefused => {
                Severity::Warning
            }
            Self::Defaults | Self::SelfCheck | Self::Watchdog | Self::StoreFailed => Severity::Error,
        }
    }
}

macro_rules! record {
    ($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $t:ident,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $t,)*
        }
        impl $name {
            /// The names of the fields, in the order in which they stand in the packet.
            pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),*];
            /// Appends the fields.
            pub fn write(&self, out: &mut Writer<'_>) {
                $(out.$t(self.$field);)*
            }
            /// Reads the fields; `None` when they are cut off.
            pub fn read(from: &mut Reader<'_>) -> Option<Self> {
                Some(Self { $($field: from.$t()?,)* })
            }
            /// Every field as a number.
            pub fn values(&self) -> [f64; Self::FIELDS.len()] {
                [$(self.$field as f64),*]
            }
        }
    };
}

record! {
    /// User data of a housekeeping packet. Counters stop at their largest value.
    Housekeeping {
        /// [`Mode`].
        mode: u8,
        /// Self-checks that failed: 1 camera, 2 memory, 4 parameters.
        self_check: u8,
        /// Copy of the parameters in use: 1, 2, or 0 for the defaults.
        parameter_copy: u8,
        /// Status of the last picture; 255 before the first.
        last_status: u8,
        /// Generation of the parameters.
        parameter_generation: u32,
        /// Pictures processed.
        pictures: u32,
        /// Of them with status `ok`.
        answers: u32,
        /// Pictures lost by overrun.
        lost: u32,
        /// Pictures refused for their size.
        refused: u32,
        /// Telecommands done.
        commands: u16,
        /// Telecommands rejected.
        rejected: u16,
        /// Calculation of the last picture, µs.
        last_us: u32,
        /// Longest calculation, µs.
        longest_us: u32,
        /// Most bytes of stack since the start.
        stack_bytes: u32,
    }
}

record! {
    /// What stands before the answer in the user data of a science packet.
    Exposure {
        /// Number of the picture since the start, from 1.
        picture: u32,
        /// Exposure, µs since the start.
        exposure_us: u64,
        /// End of the calculation, µs since the start.
        done_us: u64,
        /// Calculation, µs.
        calculation_us: u32,
        /// The body that was looked for, as parameter 30.
        body: u8,
        /// Altitude that navigation told or the parameters say, m; NaN when none is known.
        altitude_m: f32,
    }
}

record! {
    /// User data of an acknowledgement.
    Acknowledge {
        /// Function, 0 when it could not be read.
        function: u8,
        /// Sequence count of the telecommand.
        sequence: u16,
        /// [`Code`].
        code: u8,
    }
}

record! {
    /// User data of an event.
    EventRecord {
        /// [`Event`].
        number: u16,
        /// [`Severity`].
        severity: u8,
        /// First number.
        a: u32,
        /// Second number.
        b: u32,
    }
}

record! {
    /// What stands before the pixels (x, y as u16 each) of a part of an edge.
    EdgePart {
        /// Number of the picture.
        picture: u32,
        /// Candidate, from 0.
        candidate: u32,
        /// Every how many border pixels one is given.
        stride: u32,
        /// Place of the first pixel within the candidate's list.
        first: u16,
        /// Pixels of the candidate's list in all.
        total: u16,
        /// Pixels in this packet.
        count: u16,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_frozen() {
        for (n, f) in Function::ALL.iter().enumerate() {
            assert_eq!(*f as usize, n + 1);
        }
        for (n, e) in Event::ALL.iter().enumerate() {
            assert_eq!(*e as usize, n + 1);
        }
        for (n, c) in Code::ALL.iter().enumerate() {
            assert_eq!(*c as usize, n);
        }
        for (n, m) in Mode::ALL.iter().enumerate() {
            assert_eq!(*m as usize, n);
        }
    }

    #[test]
    fn records_survive() {
        let h = Housekeeping { mode: 1, pictures: 70_000, longest_us: 9, stack_bytes: 5, ..Housekeeping::default() };
        let mut bytes = [0; 64];
        let mut out = Writer::new(&mut bytes);
        h.write(&mut out);
        assert_eq!(out.finish(), Some(40));
        assert_eq!(Housekeeping::read(&mut Reader::new(&bytes)), Some(h));
        assert_eq!(Housekeeping::read(&mut Reader::new(&bytes[..39])), None);
    }
}
