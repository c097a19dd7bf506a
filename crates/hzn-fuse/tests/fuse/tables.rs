//! Tables that others wrote: names and units of columns, latitudes and longitudes, NMEA 0183.

use std::path::PathBuf;

use hzn_fuse::input::{Map, Receiver, attitudes, gnss, imu};
use tempfile::TempDir;

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }
    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

fn map(entries: &[&str]) -> Map {
    Map::parse(entries.iter().copied()).unwrap()
}

fn refused(entries: &[&str]) -> String {
    Map::parse(entries.iter().copied()).unwrap_err().to_string()
}

const LOG: &str = "t_us,wx,wy,wz,ax,ay,az,temp\n1500000,0,-90,45,0,0.5,1,20\n1600000,1,2,3,-1,0,0,21\n";
const AXES: [&str; 3] = ["imu:time=t_us,us", "imu:gyro=wx:wy:wz,deg/s", "imu:accel=ax:ay:az,g"];

#[test]
fn a_map_gives_names_and_units() {
    let folder = Folder::new();
    let path = folder.write("log.csv", LOG);
    let samples = imu(&path, &map(&AXES)).unwrap();
    let first = samples[0].imu;
    assert_eq!((samples.len(), first.time_s), (2, 1.5));
    let [x, y, z] = first.gyro_rad_s.xyz();
    assert!(
        x == 0.0 && (y + std::f64::consts::FRAC_PI_2).abs() < 1e-12 && (z - 0.25 * std::f64::consts::PI).abs() < 1e-12
    );
    let [x, y, z] = first.accel_m_s2.xyz();
    assert!(x == 0.0 && (y - 4.903_325).abs() < 1e-12 && (z - 9.80665).abs() < 1e-12);
    // One axis at a time, under the column's own name too, in another order.
    let single = ["imu:gyro_z=wz", "imu:gyro_y_radps=wy", "imu:gyro_x=wx", "imu:time=t_us,ms", AXES[2]];
    let samples = imu(&path, &map(&single)).unwrap();
    assert!(samples[0].imu.time_s == 1500.0 && samples[0].imu.gyro_rad_s.xyz() == [0.0, -90.0, 45.0]);
    // A star tracker.
    let path = folder.write("st.csv", "t,a,b,c,d,err\n1,1,0,0,0,0.001\n");
    let one = attitudes(&path, &map(&["attitude:time=t", "attitude:q=a:b:c:d", "attitude:sigma=err,rad"])).unwrap();
    assert!(one[0].fixed_from_vehicle.is_some() && (one[0].sigma_rad - 0.001).abs() < 1e-15);
}

#[test]
fn a_wrong_map_is_refused_with_what_is_right() {
    for (entries, words) in [
        (&["imy:time=t"][..], "--map imy:time=t: there is no table imy; did you mean imu?"),
        (&["imu:tme=t"], "imu has no tme; did you mean time?"),
        (&["imu:brightness=t"], "imu has no brightness; valid here: time, gyro_x,"),
        (&["imu:time=t,min"], "the unit \"min\" is unknown; time can be in s, ms, us, ns"),
        (&["imu:gyro=a:b:c,g"], "the unit \"g\" is unknown; gyro can be in rad/s, deg/s"),
        (&["imu:gyro=a:b"], "gyro has 3 columns (gyro_x, gyro_y, gyro_z), but 2 are given; write them as A:B:C"),
        (&["imu:gyro=wx"], "but 1 is given"),
        (&["imu:gyro_x=a", "imu:gyro=x:y:z"], "gyro_x was mapped before, to a"),
        (&["imu:gyro=a:b:a"], "the column a was mapped before, to gyro_x_radps"),
        (&["imu:time="], "the column of time is left out"),
        (&["imu:saturated=s,m"], "saturated has no unit"),
        (&["time=t"], "TABLE:NAME=COLUMN"),
        (&["imu:time"], "for example imu:time=t_us,us"),
    ] {
        let told = refused(entries);
        assert!(told.contains(words), "{entries:?}: {told}");
    }
}

#[test]
fn a_column_that_is_missing_or_doubled_is_named_with_its_file() {
    let folder = Folder::new();
    let path = folder.write("log.csv", LOG);
    let told = |entries: &[&str]| imu(&path, &map(entries)).unwrap_err().to_string();
    let missing = told(&["imu:time=t_us,us", "imu:gyro=wx:wy:ww,deg/s", AXES[2]]);
    assert!(missing.contains("log.csv: there is no column ww for gyro_z; did you mean w"), "{missing}");
    assert!(missing.ends_with("the file has t_us, wx, wy, wz, ax, ay, az, temp"), "{missing}");
    let without = told(&AXES[1..]);
    assert!(without.contains("the column time_s is missing; the file has t_us, wx"), "{without}");
    assert!(without.ends_with("--map imu:time=COLUMN says which one it is"), "{without}");
    // A column of the file that has one of our names, and is used for something else.
    let path = folder.write("same.csv", &LOG.replace("t_us", "gyro_x_radps"));
    let twice = imu(&path, &map(&["imu:time=gyro_x_radps", AXES[2]])).unwrap_err().to_string();
    assert!(twice.contains("the column gyro_x_radps is used twice, for time and gyro_x"), "{twice}");
    let path = folder.write("double.csv", &LOG.replace("temp", "wx"));
    let double = imu(&path, &map(&AXES)).unwrap_err().to_string();
    assert!(double.contains("double.csv: the column wx is there twice"), "{double}");
    let path = folder.write("word.csv", &LOG.replace("-90", "fast"));
    let word = imu(&path, &map(&AXES)).unwrap_err().to_string();
    assert!(word.contains("word.csv:2: wy: \"fast\" is not a number"), "{word}");
}

fn receiver(folder: &Folder, text: &str, entries: &[&str]) -> Receiver {
    gnss(&folder.write("gnss.csv", text), &map(entries), None).unwrap()
}

/// Values from the definition of WGS-84, and a point of the examples of NGA.STND.0036.
#[test]
fn latitudes_and_longitudes_become_ecef() {
    let folder = Folder::new();
    let text = "time_s,lat_deg,lon_deg,height_m,v_north_mps,v_east_mps,v_down_mps,horizontal_sigma_m,vertical_sigma_m\n\
                0,0,0,0,1,2,3,2,5\n1,90,0,100,1,2,3,,\n2,0,-90,0,1,2,3,,\n3,,,,,,,,\n";
    let read = receiver(&folder, text, &[]);
    let near = |fix: usize, position: [f64; 3], velocity: [f64; 3]| {
        let (p, v) = (read.fixes[fix].position_m.xyz(), read.fixes[fix].velocity_m_s.xyz());
        let off = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
        assert!(off(p, position) < 1e-3 && off(v, velocity) < 1e-9, "{p:?} {v:?}");
    };
    near(0, [6_378_137.0, 0.0, 0.0], [-3.0, 2.0, 1.0]);
    near(1, [0.0, 0.0, 6_356_752.314_2 + 100.0], [-1.0, 2.0, -3.0]);
    near(2, [0.0, -6_378_137.0, 0.0], [2.0, 3.0, 1.0]);
    assert!(!read.fixes[3].position_m.is_finite());
    // No axis is surer than the worst.
    assert!(read.fixes[0].position_sigma_m == 5.0 && read.fixes[1].position_sigma_m.is_nan());
    assert!(read.notes.is_empty());
    // The same in other units, upwards, and without velocities.
    let text = "t,La,Lo,Alt,ve,vn,vu\n0,0,-1.5707963267948966,0,7.2,3.6,-10.8\n";
    let units = ["gnss:time=t", "gnss:lat=La,rad", "gnss:lon=Lo,rad", "gnss:height=Alt,ft"];
    let up = receiver(&folder, text, &[&units[..], &["gnss:velocity_enu=ve:vn:vu,km/h"]].concat());
    let (a, b) = (up.fixes[0].velocity_m_s.xyz(), read.fixes[2].velocity_m_s.xyz());
    assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-9), "{a:?} {b:?}");
    let without = receiver(&folder, text, &units);
    assert!(without.notes[0].contains("there are no velocities") && !without.fixes[0].velocity_m_s.is_finite());
}

#[test]
fn a_receiver_without_a_position_is_refused_in_words() {
    let folder = Folder::new();
    let told = |text: &str, entries: &[&str]| {
        gnss(&folder.write("gnss.csv", text), &map(entries), None).unwrap_err().to_string()
    };
    let none = told("time_s,Latitude\n0,1\n", &[]);
    assert!(
        none.contains("x_m, y_m, z_m (ECEF) or lat_deg, lon_deg, height_m (WGS-84); the file has time_s, Latitude")
    );
    assert!(told("time_s,lat_deg,lon_deg\n0,1,2\n", &[]).contains("the column height_m is missing"));
    assert!(told("time_s,x_m,y_m\n0,1,2\n", &[]).contains("the column z_m is missing"));
    let half = told("time_s,lat_deg,lon_deg,height_m,v_north_mps,v_east_mps\n0,1,2,3,4,5\n", &[]);
    assert!(half.contains("the column v_down_mps is missing"), "{half}");
    let minutes = told("time_s,lat_deg,lon_deg,height_m\n0,1,2,3\n1,4807.038,1131.0,545\n", &[]);
    assert!(minutes.contains("gnss.csv:3: 4807.038, 1131 is no latitude and longitude in degrees"), "{minutes}");
    let mixed = told("time_s,x_m,y_m,z_m,v_north_mps,v_east_mps,v_up_mps\n0,1,2,3,4,5,6\n", &[]);
    assert!(mixed.contains("velocities to north, east and down need lat_deg"), "{mixed}");
}

/// Returns the lines with their checksums.
fn nmea(sentences: &[&str]) -> String {
    let line = |s: &&str| format!("${s}*{:02X}\r\n", s.bytes().fold(0, |sum, byte| sum ^ byte));
    sentences.iter().map(line).collect()
}

/// Sentences of the manuals of receivers, with the checksums that are printed there.
#[test]
fn nmea_gives_positions_dates_and_sigmas() {
    let folder = Folder::new();
    let text = "$GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,*5B\r\n\
                $GPRMC,083559.00,A,4717.11437,N,00833.91522,E,0.004,77.52,091202,,,A*57\r\n\
                $GPZDA,082710.00,16,09,2002,00,00*64\r\n";
    let path = folder.write("log.nmea", text);
    let read = gnss(&path, &Map::default(), None).unwrap();
    // 2002-12-09T09:27:25 is an earlier time of day than that of the RMC: the same day.
    assert_eq!(read.fixes.len(), 1);
    let fix = read.fixes[0];
    let (lat, lon) = ((47.0f64 + 17.11399 / 60.0).to_radians(), (8.0f64 + 33.91590 / 60.0).to_radians());
    let [x, y, z] = fix.position_m.xyz();
    assert!((y.atan2(x) - lon).abs() < 1e-12);
    let (height, latitude) =
        hzn_core::ellipsoid::geodetic([x, y, z], hzn_core::ellipsoid::WGS84_A_M, hzn_core::ellipsoid::WGS84_B_M);
    assert!((latitude - lat).abs() < 1e-9 && (height - 547.6).abs() < 1e-3, "{height}");
    assert!(!fix.velocity_m_s.is_finite() && fix.position_sigma_m.is_nan());

    // Over midnight, with several talkers, sigmas, a sentence without a fix and a damaged one.
    let mut log = nmea(&[
        "GNGNS,235959.00,4717.11399,S,00833.91590,W,AAN,08,1.0,500.0,48.0,,",
        "GNGST,235959.00,1.0,,,,3.0,4.0,9.0",
        "GPGGA,235959.00,4717.11399,S,00833.91590,W,1,08,1.0,500.0,M,48.0,M,,",
        "GNRMC,000000.50,A,4717.11399,N,00833.91590,E,0.0,0.0,010120,,,A",
        "GNGGA,000000.50,4717.11399,N,00833.91590,E,1,08,1.0,500.0,M,,,,",
        "GNGGA,000001.00,,,,,0,00,99.9,,M,,M,,",
        "PUBX,00,1",
        "GNGSV,1,1,00",
    ]);
    log += "$GNGGA,000002.00,4717.11399,N,00833.91590,E,1,08,1.0,500.0,M,48.0,M,,*00\r\nno sentence\r\n";
    let path = folder.write("night.nmea", &log);
    // `date -u -d 2020-01-01 +%s`
    let midnight = 1_577_836_800.0;
    let read = gnss(&path, &Map::default(), Some(midnight - 10.0)).unwrap();
    let times: Vec<f64> = read.fixes.iter().map(|fix| fix.time_s).collect();
    assert_eq!(times, [9.0, 10.5]);
    // The largest of the sigmas; and that of the geoid, whose height is left out.
    assert_eq!(read.fixes.iter().map(|fix| fix.position_sigma_m).collect::<Vec<_>>(), [9.0, 31.0]);
    let [x, y, z] = read.fixes[0].position_m.xyz();
    assert!(x > 0.0 && y < 0.0 && z < 0.0);
    let notes = read.notes.join("\n");
    for words in
        ["2 positions", "count from --utc", "1 positions do not say the height of the geoid", "2 lines have no"]
    {
        assert!(notes.contains(words), "{words} in {notes}");
    }
    // Without a date the day is that of time 0, and without that the first one.
    let path = folder.write("day.nmea", &log.replace("$GNRMC", "$GNXXX"));
    let at = |utc: Option<f64>| gnss(&path, &Map::default(), utc).unwrap().fixes[0].time_s;
    assert_eq!((at(Some(midnight + 100.0)), at(None)), (-101.0, 86_399.0));
}

#[test]
fn nmea_without_a_fix_or_with_a_map_is_refused() {
    let folder = Folder::new();
    let path = folder.write("none.nmea", &nmea(&["GPGGA,000001.00,,,,,0,00,99.9,,M,,M,,"]));
    let told = gnss(&path, &Map::default(), None).unwrap_err().to_string();
    assert!(told.contains("no sentence GGA or GNS has a position: 1 sentences have a right checksum"), "{told}");
    let told = gnss(&path, &map(&["gnss:time=t"]), None).unwrap_err().to_string();
    assert!(told.contains("none.nmea: is NMEA 0183, which has no columns"), "{told}");
}
