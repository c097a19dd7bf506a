//! The contents of packets: telecommands, and telemetry other than the answers. The numbers are frozen.

pub use crate::navigation::{Attitude, AttitudeState, Navigation, NavigationState};
use crate::numbered::numbered_enum;
use crate::record::record;

numbered_enum! {
    /// Modes, as in HORACE (Barf 2014).
    pub enum Mode: u8 {
        /// The self-checks are done, and the computer waits for lift-off or a command. A picture is processed on
        /// command only.
        Standby = 0 => "standby",
        /// Every picture is processed.
        Flight = 1 => "flight",
        /// No picture is processed; commands are answered. The computer enters this mode when a self-check fails.
        Safe = 2 => "safe",
        /// The loop does nothing more, so power may be cut. Only a reset ends this mode.
        ShutDown = 3 => "shut-down",
    }
}

numbered_enum! {
    /// The outcome of a telecommand.
    pub enum Code: u8 {
        /// The telecommand was carried out.
        Done = 0 => "done",
        /// The packet was broken or cut off.
        Broken = 1 => "packet broken or cut off",
        /// The arguments are too short, too long, or do not belong to this function.
        Arguments = 2 => "wrong arguments",
        /// There is no such function, or the packet is no telecommand.
        Unknown = 3 => "unknown function",
        /// The function is not allowed in this mode.
        Mode = 4 => "not allowed in this mode",
        /// No parameter has this number.
        UnknownParameter = 5 => "unknown parameter",
        /// A parameter, or the combination of all, was refused. Nothing changed.
        Refused = 6 => "value refused; nothing changed",
        /// The parameters are in use, but the memory did not keep them: they are lost at the next reset.
        NotStored = 7 => "in use, but not stored",
        /// The shut-down was not armed within the last ten seconds.
        NotArmed = 8 => "shut-down is not armed",
        /// The sequence count is not within the window: the telecommand is a replay, or earlier ones were lost.
        Sequence = 9 => "sequence count outside of the window",
        /// A number is missing: all three of a vector are needed, or none.
        Missing = 10 => "a number of a vector is missing",
        /// No pulse came within the last 1.5 seconds.
        NoPulse = 11 => "no pulse within the last 1.5 s",
        /// The time is TAI, and the clock is not correlated.
        NoClock = 12 => "the clock is not correlated",
        /// The computer has keys, and the telecommand has no trailer ([`crate::authentication`]).
        NoTrailer = 13 => "not authenticated",
        /// No key of the computer gives the code of the trailer.
        Stranger = 14 => "the code of the trailer is wrong",
        /// The counter of the trailer is not above the last one, or not above those that were reserved before a reset.
        Replay = 15 => "the counter of the trailer was used or reserved before",
        /// The keys or a counter in the memory of the computer cannot be used.
        Closed = 16 => "the keys of the computer cannot be used",
        /// The function is for one head of a rig, and the telecommand is to the rig.
        OneHead = 17 => "for one head: send it to the APID base of the head",
    }
}

numbered_enum! {
    /// Functions of telecommands: the first byte of the user data.
    pub enum Function: u8 {
        /// Changes the mode (u8).
        SetMode = 1 => "mode",
        /// Sets parameters: their count (u8), then number (u16) and value (f64) of each. All are set and then stored,
        /// or none.
        SetParameters = 2 => "set",
        /// Reads parameters: their count (u8, at most 96), then the number (u16) of each.
        ReadParameters = 3 => "read",
        /// Processes the next picture; only in standby.
        ProcessOnce = 4 => "process-once",
        /// Sends the edges of the next picture that is processed.
        DumpEdges = 5 => "dump-edges",
        /// Sets the counters of housekeeping to zero.
        ResetCounters = 6 => "reset-counters",
        /// Sets the prior of the pictures that follow: altitude in metres and ECEF position in metres (4 × f32, NaN if
        /// not known). The rate of rotation of the camera may follow (3 × f32, rad/s, camera frame).
        SetKnown = 7 => "known",
        /// Sets parameters as [`Self::SetParameters`], without storing them: a reset brings the stored ones back.
        TryParameters = 8 => "try",
        /// Keeps parameters for [`Self::CommitParameters`], after those that are kept already. A count of 0 removes all
        /// that are kept.
        StageParameters = 9 => "stage",
        /// Sets and stores all parameters that are kept, or none. The argument is their number (u16), so that a lost
        /// packet is noticed.
        CommitParameters = 10 => "commit",
        /// Does nothing, and is acknowledged.
        Ping = 11 => "ping",
        /// Sends a housekeeping packet.
        Report = 12 => "report",
        /// Allows the mode shut-down for ten seconds.
        ArmShutDown = 13 => "arm",
        /// Sets the values from navigation as [`Self::SetKnown`], with their time, velocity and expiry: [`Navigation`].
        Navigate = 14 => "navigate",
        /// Correlates the clock: the time was (time code, 8 bytes, TAI) when the telecommand arrived (u8: 0) or at the
        /// last pulse (u8: 1).
        SetTime = 15 => "time",
        /// Sets the attitude of the camera and the direction to the Sun, with their time and expiry: [`Attitude`].
        SetAttitude = 16 => "attitude",
    }
}

numbered_enum! {
    /// Severity of an event.
    pub enum Severity: u8 {
        /// Everything is as it should be.
        Information = 0 => "information",
        /// Something was wrong, and the computer dealt with it.
        Warning = 1 => "warning",
        /// Something is wrong.
        Error = 2 => "error",
    }
}

numbered_enum! {
    /// Something that happened, with two numbers, a and b, that say more.
    pub enum Event: u16 {
        /// The computer started. a: copy of the parameters in use (1 or 2; 0 for the defaults). b: their generation.
        Started = 1 => "started",
        /// A copy of the parameters cannot be used. a: copy (1 or 2). b: 1 no table, 2 wrong checksum, 3 values
        /// refused.
        CopyBroken = 2 => "a copy of the parameters cannot be used",
        /// No copy can be used, so the defaults apply. a: 0. b: 0.
        Defaults = 3 => "no copy of the parameters can be used; the defaults are in use",
        /// The mode changed. a: mode before. b: mode now.
        ModeChanged = 4 => "mode changed",
        /// A telecommand was rejected. a: [`Code`]. b: function.
        CommandRejected = 5 => "telecommand rejected",
        /// A picture has the wrong size. a: bytes. b: expected bytes.
        WrongSize = 6 => "picture of wrong size",
        /// Pictures were lost because the processing was not finished. a: number of pictures. b: 0.
        Overrun = 7 => "pictures lost",
        /// The parameters were stored. a: copy (1 or 2). b: generation.
        Stored = 8 => "parameters stored",
        /// A self-check failed. a: bits, 1 camera, 2 memory, 4 parameters. b: 0.
        SelfCheck = 9 => "self-check failed",
        /// The watchdog caused the last reset. a: 0. b: 0.
        Watchdog = 10 => "reset by the watchdog",
        /// The memory did not keep the parameters. a: copy (1 or 2). b: 0.
        StoreFailed = 11 => "parameters not stored",
        /// The sensor refused the prior. a: 0 the altitude, position or attitude is missing or impossible, and the
        /// picture has no answer; 1 the lens cannot have the temperature of the camera that the board gives, and the
        /// picture has the lens of the reference. b: 0.
        KnownRefused = 12 => "the altitude, position or temperature is missing or impossible",
        /// The camera sends no pictures. a: time since the last one, ms. b: number of the last one.
        CameraSilent = 13 => "the camera sends no pictures",
        /// A bit of the sensor, of the values from navigation or of the parameters of the flight software changed in
        /// memory. a: 1 sensor, which was made anew from the stored parameters; 2 values from navigation, which were
        /// removed; 3 parameters of the flight software, which were read again. b: how often since the start.
        Repaired = 14 => "a memory error was repaired",
        /// The watchdog reset the computer several times in a row, so the older parameters are in use. a: their copy
        /// (0: there is none). b: number of resets.
        OlderParameters = 15 => "the older parameters are in use after resets by the watchdog",
        /// The watchdog reset the computer also with the older parameters, so it stays in safe mode. a: number of
        /// resets. b: 0.
        SafeAfterResets = 16 => "safe mode after resets by the watchdog",
        /// The values from navigation have expired and are not used. a: their age, ms. b: 0 position, velocity, rate;
        /// 1 attitude and Sun.
        KnownExpired = 17 => "the values from navigation have expired",
        /// The clock was correlated. a: seconds of the time, TAI since 1958. b: change of the correlation, ms;
        /// 4294967295 at the first time and if it is larger.
        ClockSet = 18 => "clock correlated",
        /// An answer was not sent, because pixels at its limb do not change from one to the next: the readout was
        /// stuck. a: number of such places along the edge. b: number of places that were looked at.
        StuckPixels = 19 => "stuck pixels at the limb",
        /// The picture comes row by row, and was refused. a: 1 a method of the parameters needs the whole picture, 2
        /// the board has too little memory for the rows. b: 0.
        RowsRefused = 20 => "the picture cannot be processed row by row",
        /// The computer can no longer keep the answers that it sends: the disk of the log is full or fails. Sent again
        /// only when it could be written meanwhile. a: number of the picture. b: 0.
        AnswersNotKept = 21 => "the answers are no longer kept",
        /// The edge of an answer stays in the picture while the vehicle turns. a: picture. b: 1 if the answer was sent.
        FixedEdge = 22 => "fixed in the picture while the vehicle turns",
    }
}

impl Event {
    /// Returns the severity of the event.
    pub const fn severity(self) -> Severity {
        // Only warnings are limited (`flight::reports`), because they can come with every picture or every few bytes.
        // The others follow a start, a change or a telecommand, so that they cannot flood the line.
        match self {
            Self::Started | Self::ModeChanged | Self::Stored | Self::ClockSet => Severity::Information,
            Self::CopyBroken
            | Self::CommandRejected
            | Self::WrongSize
            | Self::Overrun
            | Self::KnownRefused
            | Self::CameraSilent
            | Self::KnownExpired
            | Self::StuckPixels
            | Self::FixedEdge
            | Self::RowsRefused
            | Self::Repaired => Severity::Warning,
            Self::Defaults
            | Self::SelfCheck
            | Self::Watchdog
            | Self::StoreFailed
            | Self::AnswersNotKept
            | Self::OlderParameters
            | Self::SafeAfterResets => Severity::Error,
        }
    }
}

record! {
    /// User data of a housekeeping packet. Counters stop at their largest value.
    Housekeeping {
        /// [`Mode`] as a number.
        mode: u8,
        /// Self-checks that failed: 1 camera, 2 memory, 4 parameters.
        self_check: u8,
        /// Copy of the parameters in use: 1, 2, or 0 for the defaults.
        parameter_copy: u8,
        /// Status of the last picture; 255 before the first.
        // Not 0, because 0 is the status `ok`.
        last_status: u8,
        /// Generation of the parameters; 0 for the defaults.
        parameter_generation: u32,
        /// Pictures processed.
        pictures: u32,
        /// Pictures with the status `ok`.
        answers: u32,
        /// Pictures lost by overrun.
        lost: u32,
        /// Pictures without an answer, which `pictures` does not count: of wrong size or incomplete, refused row by
        /// row, with an impossible prior, or lost to a memory error. `stuck` counts other pictures.
        refused: u32,
        /// Telecommands that were carried out.
        commands: u16,
        /// Telecommands that were rejected.
        rejected: u16,
        /// Calculation time of the last picture, µs.
        last_us: u32,
        /// Longest calculation time, µs.
        longest_us: u32,
        /// Largest use of the stack since the start, bytes.
        stack_bytes: u32,
        /// Version of the flight software: major, minor and patch in one byte each, from the second byte on.
        version: u32,
        /// Number of the build; 0 if unknown.
        build: u32,
        /// CRC-32 of the program image in memory, as zlib computes it; 0 if unknown.
        image_crc: u32,
        /// Number of starts since power came on; 0 if unknown.
        starts: u16,
        /// Number of resets by the watchdog in a row.
        watchdog_resets: u8,
        /// Bits: 1 the parameters in use are not stored, 2 the shut-down is armed, 4 lift-off was seen, 8 the camera is
        /// silent, 16 parameters are kept for a commit.
        flags: u8,
        /// Number of memory errors that were repaired.
        repairs: u16,
        /// Sequence count of the last telecommand that was taken; 65535 before the first.
        // A count has 14 bits, so that 65535 cannot be one.
        last_sequence: u16,
        /// Packets on the line that are no telecommands for this computer.
        foreign: u32,
        /// Broken packets on the line.
        broken: u32,
        /// Events and acknowledgements that were not sent, because there were too many.
        withheld: u32,
        /// Time since lift-off, s; 4294967295 before it.
        since_lift_off_s: u32,
        /// Clock of the packets: 0 since the start of the computer, 1 TAI by a command, 2 TAI kept by pulses.
        clock: u8,
        /// Pictures whose packets were not sent, because of `telemetry.science_bits_s`.
        decimated: u32,
        /// Answers that were not sent, because the pixels at their limb do not change: the readout was stuck.
        stuck: u32,
    }
}

record! {
    /// The data before the answer in the user data of a science packet.
    Exposure {
        /// Number of the picture since the start, from 1.
        picture: u32,
        /// Time of the exposure, µs since the start.
        exposure_us: u64,
        /// End of the calculation, µs since the start.
        done_us: u64,
        /// Calculation time, µs.
        calculation_us: u32,
        /// Body that the sensor looks for, as in parameter 30.
        body: u8,
        /// Altitude from navigation or else from the parameters, m; NaN if neither has one.
        altitude_m: f32,
    }
}

record! {
    /// User data of an acknowledgement.
    Acknowledge {
        /// Function; 0 if it could not be read.
        function: u8,
        /// Sequence count of the telecommand.
        sequence: u16,
        /// [`Code`] as a number.
        code: u8,
        /// What was refused: the number of a parameter, or, after `known` and `navigate`, the place of a number in
        /// [`Navigation`], and after `attitude` in [`Attitude`], from 1; 0: not said. After code 9, the sequence count
        /// of the last telecommand that was taken.
        detail: u16,
    }
}

record! {
    /// User data of an event.
    EventRecord {
        /// [`Event`] as a number.
        number: u16,
        /// [`Severity`] as a number.
        severity: u8,
        /// First number of the event.
        a: u32,
        /// Second number of the event.
        b: u32,
    }
}

record! {
    /// User data of a packet with the value of a parameter.
    ParameterValue {
        /// Number of the parameter.
        number: u16,
        /// Its value; NaN: not set.
        // A double holds the values of all parameters exactly, so that one form serves all.
        value: f64,
    }
}

/// Most parameters that are read by one telecommand.
// Their packets take a quarter of a second of a line with 115 200 baud, and the loop waits for them.
pub const MAX_READ: u8 = 96;

/// Number of pixels in a packet with a part of an edge. Those after [`EdgePart::count`] are 0.
// The number is fixed, because ground systems decode packets by tables without counts.
pub const EDGE_PIXELS: usize = 64;

record! {
    /// A pixel of an edge.
    EdgePixel {
        /// Column.
        x: u16,
        /// Row.
        y: u16,
    }
}

record! {
    /// The data before the pixels of a part of an edge.
    EdgePart {
        /// Number of the picture.
        picture: u32,
        /// Number of the candidate, from 0.
        candidate: u32,
        /// Distance in border pixels from one listed pixel to the next.
        stride: u32,
        /// Index of the first pixel in the candidate's list.
        first: u16,
        /// Number of pixels in the candidate's list.
        total: u16,
        /// Number of pixels in this packet.
        count: u16,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bytes::{Reader, Writer};

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
        let mut bytes = [0; 128];
        let mut out = Writer::new(&mut bytes);
        h.write(&mut out);
        assert_eq!(out.finish(), Some(Housekeeping::BYTES));
        assert_eq!(Housekeeping::read(&mut Reader::new(&bytes)), Some(h));
        for length in 0..Housekeeping::BYTES {
            assert_eq!(Housekeeping::read(&mut Reader::new(&bytes[..length])), None);
        }
    }
}
