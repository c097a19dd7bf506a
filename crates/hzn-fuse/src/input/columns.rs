//! The columns of the tables, what they measure, and the units in which others write them.

/// Standard gravity, m/s².
const G_M_S2: f64 = 9.80665;

/// What a column measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Measure {
    Time,
    Rate,
    Force,
    Length,
    Speed,
    Angle,
    /// A number without a unit.
    Number,
}

impl Measure {
    /// Returns the units by name, each with its size in the first one, which is the unit of the column.
    pub(super) fn units(self) -> &'static [(&'static str, f64)] {
        const DEG: f64 = std::f64::consts::PI / 180.0;
        match self {
            Self::Time => &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)],
            Self::Rate => &[("rad/s", 1.0), ("deg/s", DEG), ("mrad/s", 1e-3), ("deg/h", DEG / 3600.0)],
            Self::Force => &[("m/s2", 1.0), ("g", G_M_S2), ("mg", 1e-3 * G_M_S2)],
            Self::Length => &[("m", 1.0), ("km", 1e3), ("cm", 1e-2), ("mm", 1e-3), ("ft", 0.3048)],
            Self::Speed => &[
                ("m/s", 1.0),
                ("km/s", 1e3),
                ("km/h", 1.0 / 3.6),
                ("cm/s", 1e-2),
                ("mm/s", 1e-3),
                ("kn", 1852.0 / 3600.0),
            ],
            Self::Angle => &[("deg", 1.0), ("rad", 1.0 / DEG), ("1e-7deg", 1e-7)],
            Self::Number => &[],
        }
    }
}

/// A column of a table.
#[derive(Debug)]
pub(super) struct Column {
    /// Its name in a table that needs no map; the unit is part of it.
    pub(super) name: &'static str,
    /// Its name in a map, without the unit.
    pub(super) quantity: &'static str,
    pub(super) measure: Measure,
}

/// The columns of a kind of table.
#[derive(Debug)]
pub(super) struct Columns {
    /// The word for the table, which is that of the option.
    pub(super) table: &'static str,
    pub(super) columns: &'static [Column],
    /// Names in a map for several columns at once.
    pub(super) groups: &'static [(&'static str, &'static [&'static str])],
}

const fn column(name: &'static str, quantity: &'static str, measure: Measure) -> Column {
    Column { name, quantity, measure }
}

/// The inertial unit.
pub(super) const IMU: Columns = Columns {
    table: "imu",
    columns: &[
        column("time_s", "time", Measure::Time),
        column("gyro_x_radps", "gyro_x", Measure::Rate),
        column("gyro_y_radps", "gyro_y", Measure::Rate),
        column("gyro_z_radps", "gyro_z", Measure::Rate),
        column("accel_x_mps2", "accel_x", Measure::Force),
        column("accel_y_mps2", "accel_y", Measure::Force),
        column("accel_z_mps2", "accel_z", Measure::Force),
        column("saturated", "saturated", Measure::Number),
    ],
    groups: &[("gyro", &["gyro_x", "gyro_y", "gyro_z"]), ("accel", &["accel_x", "accel_y", "accel_z"])],
};

/// The receiver.
pub(super) const GNSS: Columns = Columns {
    table: "gnss",
    columns: &[
        column("time_s", "time", Measure::Time),
        column("x_m", "x", Measure::Length),
        column("y_m", "y", Measure::Length),
        column("z_m", "z", Measure::Length),
        column("vx_mps", "vx", Measure::Speed),
        column("vy_mps", "vy", Measure::Speed),
        column("vz_mps", "vz", Measure::Speed),
        column("position_sigma_m", "position_sigma", Measure::Length),
        column("velocity_sigma_mps", "velocity_sigma", Measure::Speed),
        column("lat_deg", "lat", Measure::Angle),
        column("lon_deg", "lon", Measure::Angle),
        column("height_m", "height", Measure::Length),
        column("v_north_mps", "v_north", Measure::Speed),
        column("v_east_mps", "v_east", Measure::Speed),
        column("v_down_mps", "v_down", Measure::Speed),
        column("v_up_mps", "v_up", Measure::Speed),
        column("horizontal_sigma_m", "horizontal_sigma", Measure::Length),
        column("vertical_sigma_m", "vertical_sigma", Measure::Length),
    ],
    groups: &[
        ("position", &["x", "y", "z"]),
        ("velocity", &["vx", "vy", "vz"]),
        ("velocity_ned", &["v_north", "v_east", "v_down"]),
        ("velocity_enu", &["v_east", "v_north", "v_up"]),
    ],
};

/// The star tracker.
pub(super) const ATTITUDE: Columns = Columns {
    table: "attitude",
    columns: &[
        column("time_s", "time", Measure::Time),
        column("qw", "qw", Measure::Number),
        column("qx", "qx", Measure::Number),
        column("qy", "qy", Measure::Number),
        column("qz", "qz", Measure::Number),
        column("sigma_deg", "sigma", Measure::Angle),
    ],
    groups: &[("q", &["qw", "qx", "qy", "qz"])],
};

/// A sensor of a direction.
pub(super) const DIRECTION: Columns = Columns {
    table: "direction",
    columns: &[
        column("time_s", "time", Measure::Time),
        column("x", "x", Measure::Number),
        column("y", "y", Measure::Number),
        column("z", "z", Measure::Number),
        column("ref_x", "ref_x", Measure::Number),
        column("ref_y", "ref_y", Measure::Number),
        column("ref_z", "ref_z", Measure::Number),
        column("sigma_deg", "sigma", Measure::Angle),
        column("noise_deg", "noise", Measure::Angle),
    ],
    groups: &[("measured", &["x", "y", "z"]), ("reference", &["ref_x", "ref_y", "ref_z"])],
};

/// All tables.
pub(super) const TABLES: [&Columns; 4] = [&IMU, &GNSS, &ATTITUDE, &DIRECTION];

impl Columns {
    /// Returns the columns that a name in a map means: one, those of a group, or none.
    pub(super) fn meant_by(&self, name: &str) -> Vec<&'static Column> {
        let group = self.groups.iter().find(|(group, _)| *group == name).map(|(_, members)| *members);
        let is_meant = |c: &&Column| group.map_or(c.quantity == name || c.name == name, |g| g.contains(&c.quantity));
        let mut meant: Vec<&Column> = self.columns.iter().filter(is_meant).collect();
        // In the order of the group.
        meant.sort_by_key(|c| group.and_then(|g| g.iter().position(|q| *q == c.quantity)));
        meant
    }

    /// Returns all names that a map may use.
    pub(super) fn names(&self) -> Vec<&'static str> {
        self.columns.iter().map(|c| c.quantity).chain(self.groups.iter().map(|(group, _)| *group)).collect()
    }
}
