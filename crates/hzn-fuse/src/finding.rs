//! What a test found, and what it means for the whole flight.

/// Whether the inputs of a flight agree with each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Level {
    /// They agree within their errors.
    #[default]
    Consistent,
    /// They differ by more than right ones usually do.
    Doubtful,
    /// They contradict each other.
    Contradicts,
}

impl Level {
    /// Returns the word for messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Doubtful => "doubtful",
            Self::Contradicts => "contradicts",
        }
    }
}

/// What is probably wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Cause {
    /// The times of the inertial unit: their unit, or gaps.
    SampleTimes,
    /// The unit of the rates.
    GyroUnit,
    /// Axes or signs of the rates, or all mounts together.
    GyroAxes,
    /// Biases of the gyros.
    GyroBias,
    /// Scale of the gyros.
    GyroScale,
    /// Unit or scale of the specific forces.
    AccelUnit,
    /// Biases of the accelerometers, or gravity in what they show.
    AccelBias,
    /// The unit of positions or velocities.
    ReceiverUnit,
    /// The frame of positions or velocities.
    ReceiverFrame,
    /// The clock of the receiver.
    ReceiverClock,
    /// Positions or velocities as such.
    Receiver,
    /// The mount of a camera.
    Mount,
    /// The clock of a camera, or of all.
    CameraClock,
    /// The clock of the inertial unit.
    ImuClock,
    /// The UTC of the recordings: Sun and Moon are elsewhere.
    Utc,
    /// The lens of a camera.
    Lens,
    /// The told covariances of a camera.
    Covariance,
    /// The limb height.
    LimbHeight,
    /// The altitudes that the answers were made with.
    Altitude,
    /// A recording without a usable measurement.
    Empty,
    /// The frame or the sense of the star tracker's attitudes.
    TrackerFrame,
    /// The inputs as a whole: no single cause explains the contradiction.
    Unknown,
}

/// The input that a finding is about.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Source {
    /// The inertial unit.
    Imu,
    /// The receiver.
    Receiver,
    /// The star tracker.
    StarTracker,
    /// One camera, by its name.
    Camera(String),
    /// All cameras.
    Cameras,
    /// No input more than others.
    All,
}

impl Source {
    /// Returns the word for messages and files; the name of a camera for a camera.
    pub fn name(&self) -> &str {
        match self {
            Self::Imu => "imu",
            Self::Receiver => "gnss",
            Self::StarTracker => "attitude",
            Self::Camera(name) => name,
            Self::Cameras => "cameras",
            Self::All => "all",
        }
    }
}

/// What one test found.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What it means.
    pub level: Level,
    /// What is probably wrong.
    pub cause: Cause,
    /// The input that is probably wrong.
    pub source: Source,
    /// The measured contradiction, and what to check, in words.
    pub what: String,
}

/// The verdict over a flight.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Verdict {
    /// What the tests found; the likeliest cause of the worst level is first.
    pub findings: Vec<Finding>,
}

impl Verdict {
    /// Sorts the findings. Within a level their order stays: a test of an input stands before the tests of what was
    /// computed from it, because a wrong unit is also seen in everything after it.
    pub(crate) fn new(mut findings: Vec<Finding>) -> Self {
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.level));
        Self { findings }
    }

    /// Returns the level of the whole flight.
    pub fn level(&self) -> Level {
        self.findings.first().map_or(Level::Consistent, |first| first.level)
    }

    /// Returns the likeliest cause; `None` if the flight is consistent.
    pub fn likeliest(&self) -> Option<&Finding> {
        self.findings.first()
    }
}
