//! Where bright stars are expected in a picture whose time and attitude are known.

use hzn_core::camera::Camera;
use hzn_core::frames::{Cam, Fixed, Rotation, UnitVec3};
use hzn_files::FrameData;
use hzn_nav::ephemeris;

use super::frame_view::BodyResult;
use crate::model::quantity::angle_deg;
use crate::model::view::Point;

/// 2000 January 1, 12:00 in seconds since 1970, and a Julian century in seconds.
const J2000_S: f64 = 946_728_000.0;
const CENTURY_S: f64 = 86_400.0 * 36_525.0;

/// Stars to magnitude 3 with a name of their own: name, right ascension and declination (J2000, degrees), visual
/// magnitude, the brightest first. Sources: the catalogue of star names of the International Astronomical Union
/// (IAU-CSN, 4 April 2022, Creative Commons Attribution) for the names, the Hipparcos catalogue (ESA 1997) for the
/// rest. A double star has the magnitude of both. Toliman is left out, because it is 0.004° from Rigil Kentaurus. Their
/// own motion is left out: at most 0.03° in 30 years.
const STARS: &[(&str, f64, f64, f64)] = &[
    ("Sirius", 101.2872, -16.7161, -1.44),
    ("Canopus", 95.9880, -52.6957, -0.62),
    ("Arcturus", 213.9153, 19.1824, -0.05),
    ("Rigil Kentaurus", 219.9021, -60.8340, -0.01),
    ("Vega", 279.2347, 38.7837, 0.03),
    ("Capella", 79.1723, 45.9980, 0.08),
    ("Rigel", 78.6345, -8.2016, 0.18),
    ("Procyon", 114.8255, 5.2250, 0.40),
    ("Achernar", 24.4285, -57.2368, 0.45),
    ("Betelgeuse", 88.7929, 7.4071, 0.45),
    ("Hadar", 210.9559, -60.3730, 0.61),
    ("Altair", 297.6958, 8.8683, 0.76),
    ("Acrux", 186.6496, -63.0991, 0.77),
    ("Aldebaran", 68.9802, 16.5093, 0.87),
    ("Spica", 201.2982, -11.1613, 0.98),
    ("Antares", 247.3519, -26.4320, 1.06),
    ("Pollux", 116.3290, 28.0262, 1.16),
    ("Fomalhaut", 344.4127, -29.6222, 1.17),
    ("Deneb", 310.3580, 45.2803, 1.25),
    ("Mimosa", 191.9303, -59.6888, 1.25),
    ("Regulus", 152.0930, 11.9672, 1.36),
    ("Adhara", 104.6565, -28.9721, 1.50),
    ("Castor", 113.6494, 31.8883, 1.58),
    ("Gacrux", 187.7915, -57.1132, 1.59),
    ("Shaula", 263.4022, -37.1038, 1.62),
    ("Bellatrix", 81.2828, 6.3497, 1.64),
    ("Elnath", 81.5730, 28.6075, 1.65),
    ("Miaplacidus", 138.2999, -69.7172, 1.67),
    ("Alnilam", 84.0534, -1.2019, 1.69),
    ("Alnair", 332.0583, -46.9610, 1.73),
    ("Alnitak", 85.1897, -1.9426, 1.74),
    ("Alioth", 193.5073, 55.9598, 1.76),
    ("Kaus Australis", 276.0430, -34.3846, 1.79),
    ("Mirfak", 51.0807, 49.8612, 1.79),
    ("Dubhe", 165.9320, 61.7510, 1.81),
    ("Wezen", 107.0979, -26.3932, 1.83),
    ("Alkaid", 206.8852, 49.3133, 1.85),
    ("Avior", 125.6285, -59.5095, 1.86),
    ("Sargas", 264.3297, -42.9978, 1.86),
    ("Menkalinan", 89.8822, 44.9474, 1.90),
    ("Atria", 252.1662, -69.0277, 1.91),
    ("Alhena", 99.4279, 16.3993, 1.93),
    ("Alsephina", 131.1759, -54.7088, 1.93),
    ("Peacock", 306.4119, -56.7351, 1.94),
    ("Polaris", 37.9545, 89.2641, 1.97),
    ("Mirzam", 95.6749, -17.9559, 1.98),
    ("Alphard", 141.8968, -8.6586, 1.99),
    ("Algieba", 154.9931, 19.8415, 2.01),
    ("Hamal", 31.7934, 23.4624, 2.01),
    ("Diphda", 10.8974, -17.9866, 2.04),
    ("Nunki", 283.8164, -26.2967, 2.05),
    ("Menkent", 211.6706, -36.3700, 2.06),
    ("Alpheratz", 2.0969, 29.0904, 2.07),
    ("Kochab", 222.6764, 74.1555, 2.07),
    ("Mirach", 17.4330, 35.6206, 2.07),
    ("Saiph", 86.9391, -9.6696, 2.07),
    ("Tiaki", 340.6669, -46.8846, 2.07),
    ("Rasalhague", 263.7336, 12.5600, 2.08),
    ("Algol", 47.0422, 40.9556, 2.09),
    ("Almach", 30.9748, 42.3297, 2.10),
    ("Denebola", 177.2649, 14.5721, 2.14),
    ("Aspidiske", 139.2725, -59.2752, 2.21),
    ("Naos", 120.8960, -40.0031, 2.21),
    ("Alphecca", 233.6720, 26.7147, 2.22),
    ("Mizar", 200.9814, 54.9254, 2.23),
    ("Sadr", 305.5571, 40.2567, 2.23),
    ("Suhail", 136.9990, -43.4326, 2.23),
    ("Eltanin", 269.1515, 51.4889, 2.24),
    ("Schedar", 10.1268, 56.5373, 2.24),
    ("Mintaka", 83.0017, -0.2991, 2.25),
    ("Caph", 2.2945, 59.1498, 2.28),
    ("Dschubba", 240.0834, -22.6217, 2.29),
    ("Larawag", 252.5409, -34.2932, 2.29),
    ("Merak", 165.4603, 56.3824, 2.34),
    ("Izar", 221.2467, 27.0742, 2.35),
    ("Enif", 326.0465, 9.8750, 2.38),
    ("Ankaa", 6.5710, -42.3060, 2.40),
    ("Phecda", 178.4577, 53.6948, 2.41),
    ("Sabik", 257.5945, -15.7249, 2.43),
    ("Scheat", 345.9436, 28.0828, 2.44),
    ("Alderamin", 319.6449, 62.5856, 2.45),
    ("Aludra", 111.0238, -29.3031, 2.45),
    ("Markeb", 140.5284, -55.0107, 2.47),
    ("Aljanah", 311.5528, 33.9703, 2.48),
    ("Markab", 346.1902, 15.2053, 2.49),
    ("Menkar", 45.5699, 4.0897, 2.54),
    ("Acrab", 241.3593, -19.8055, 2.56),
    ("Zosma", 168.5271, 20.5237, 2.56),
    ("Arneb", 83.1826, -17.8223, 2.58),
    ("Gienah", 183.9515, -17.5419, 2.58),
    ("Ascella", 285.6530, -29.8801, 2.60),
    ("Zubeneschamali", 229.2517, -9.3829, 2.61),
    ("Unukalhai", 236.0670, 6.4256, 2.63),
    ("Sheratan", 28.6600, 20.8080, 2.64),
    ("Kraz", 188.5968, -23.3968, 2.65),
    ("Mahasim", 89.9303, 37.2126, 2.65),
    ("Phact", 84.9122, -34.0741, 2.65),
    ("Ruchbah", 21.4540, 60.2353, 2.66),
    ("Muphrid", 208.6712, 18.3977, 2.68),
    ("Hassaleh", 74.2484, 33.1661, 2.69),
    ("Lesath", 262.6910, -37.2958, 2.70),
    ("Kaus Media", 275.2485, -29.8281, 2.72),
    ("Tarazed", 296.5649, 10.6133, 2.72),
    ("Athebyne", 245.9979, 61.5142, 2.73),
    ("Yed Prior", 243.5864, -3.6943, 2.73),
    ("Porrima", 190.4152, -1.4494, 2.74),
    ("Hatysa", 83.8583, -5.9099, 2.75),
    ("Zubenelgenubi", 222.7196, -16.0418, 2.75),
    ("Cebalrai", 265.8681, 4.5673, 2.76),
    ("Cursa", 76.9624, -5.0864, 2.78),
    ("Kornephoros", 247.5550, 21.4896, 2.78),
    ("Rasalgethi", 258.6619, 14.3903, 2.78),
    ("Imai", 183.7863, -58.7489, 2.79),
    ("Rastaban", 262.6082, 52.3014, 2.79),
    ("Nihal", 82.0613, -20.7594, 2.81),
    ("Kaus Borealis", 276.9927, -25.4217, 2.82),
    ("Paikauhale", 248.9706, -28.2160, 2.82),
    ("Algenib", 3.3090, 15.1836, 2.83),
    ("Tureis", 121.8860, -24.3043, 2.83),
    ("Alcyone", 56.8712, 24.1051, 2.85),
    ("Deneb Algedi", 326.7602, -16.1273, 2.85),
    ("Vindemiatrix", 195.5442, 10.9592, 2.85),
    ("Fawaris", 296.2437, 45.1308, 2.86),
    ("Tejat", 95.7401, 22.5136, 2.87),
    ("Acamar", 44.5653, -40.3047, 2.88),
    ("Albaldah", 287.4410, -21.0236, 2.88),
    ("Cor Caroli", 194.0069, 38.3184, 2.89),
    ("Fang", 239.7130, -26.1141, 2.89),
    ("Gomeisa", 111.7877, 8.2893, 2.89),
    ("Alniyat", 245.2972, -25.5928, 2.90),
    ("Sadalsuud", 322.8897, -5.5712, 2.90),
    ("Matar", 340.7506, 30.2212, 2.93),
    ("Algorab", 187.4661, -16.5154, 2.94),
    ("Sadalmelik", 331.4460, -0.3199, 2.95),
    ("Tianguan", 84.4112, 21.1425, 2.97),
    ("Zaurak", 59.5074, -13.5085, 2.97),
    ("Alnasl", 271.4520, -30.4241, 2.98),
    ("Okab", 286.3525, 13.8635, 2.99),
    ("Aldhanab", 328.4822, -37.3649, 3.00),
    ("Pherkad", 230.1821, 71.8340, 3.00),
    ("Xamidimura", 252.9676, -38.0474, 3.00),
];

/// The expected place of a star.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StarPlace {
    /// Its name.
    pub name: &'static str,
    /// Its place in the picture, in pixels.
    pub at: Point,
    /// Its visual magnitude.
    pub magnitude: f64,
}

/// Returns the bright stars in the picture that no body hides. There are none without UTC and attitude. Aberration and
/// nutation are left out, which moves a star by up to 0.01°.
pub fn places(data: Option<&FrameData>, bodies: &[impl AsRef<BodyResult>], camera: &Camera<f64>) -> Vec<StarPlace> {
    let attitude = data.and_then(|d| Some((d.utc_s?, d.q_fixed_from_camera_wxyz?)));
    let turn = attitude.and_then(|(utc_s, q)| Some((utc_s, Rotation::<Cam, Fixed, f64>::assume_from_quaternion(q)?)));
    let Some((utc_s, turn)) = turn.map(|(utc_s, turn)| (utc_s, turn.inverse())) else { return Vec::new() };
    let [w, h] = [camera.width(), camera.height()].map(|x| f64::from(x) - 0.5);
    let solutions: Vec<_> = bodies.iter().filter_map(|body| body.as_ref().solution()).collect();
    let place = |(name, ra_deg, dec_deg, magnitude): &(&'static str, f64, f64, f64)| {
        let fixed = UnitVec3::<Fixed, f64>::try_new(fixed_from_j2000(*ra_deg, *dec_deg, utc_s))?;
        let seen = turn.apply(&fixed);
        let p = camera.project(&seen)?;
        let is_inside = (-0.5..w).contains(&p.u) && (-0.5..h).contains(&p.v);
        let is_hidden =
            solutions.iter().any(|s| angle_deg(seen.xyz(), s.axis.xyz()) < s.fused_half_angle_rad.to_degrees());
        (is_inside && !is_hidden).then_some(StarPlace { name, at: [p.u, p.v], magnitude: *magnitude })
    };
    STARS.iter().filter_map(place).collect()
}

/// Returns right ascension and declination of date in radians, from those of J2000 in degrees. Source: Meeus,
/// *Astronomical Algorithms*, equations 21.3 and 21.4 (IAU 1976).
fn of_date(ra_deg: f64, dec_deg: f64, utc_s: f64) -> [f64; 2] {
    let t = (utc_s - J2000_S) / CENTURY_S;
    let angle = |a: f64, b: f64, c: f64| (t * (a + t * (b + t * c)) / 3600.0).to_radians();
    let zeta = angle(2306.2181, 0.301_88, 0.017_998);
    let z = angle(2306.2181, 1.094_68, 0.018_203);
    let (sin, cos) = angle(2004.3109, -0.426_65, -0.041_833).sin_cos();
    let (sin_dec, cos_dec) = dec_deg.to_radians().sin_cos();
    let (sin_ra, cos_ra) = (ra_deg.to_radians() + zeta).sin_cos();
    let a = cos_dec * sin_ra;
    let b = cos * cos_dec * cos_ra - sin * sin_dec;
    let c = sin * cos_dec * cos_ra + cos * sin_dec;
    [a.atan2(b) + z, c.clamp(-1.0, 1.0).asin()]
}

/// Returns the direction to a star in the fixed frame.
fn fixed_from_j2000(ra_deg: f64, dec_deg: f64, utc_s: f64) -> [f64; 3] {
    let [ra, dec] = of_date(ra_deg, dec_deg, utc_s);
    let (sin, cos) = (ra - ephemeris::sidereal_rad(utc_s)).sin_cos();
    [dec.cos() * cos, dec.cos() * sin, dec.sin()]
}

#[cfg(test)]
mod tests {
    use hzn_core::body::Kind;
    use hzn_core::camera::{Config, Model};

    use super::*;
    use crate::work::answers::answer;

    const NONE: &[std::sync::Arc<BodyResult>] = &[];

    /// Meeus, example 21.b: theta Persei on 2028 November 13.19.
    #[test]
    fn precession_agrees_with_the_book() {
        let utc_s = J2000_S + 0.288_670_500 * CENTURY_S;
        let [ra, dec] = of_date(41.054_063, 49.227_750, utc_s).map(f64::to_degrees);
        assert!((ra - 41.547_214).abs() < 1e-5 && (dec - 49.348_483).abs() < 1e-5, "{ra} {dec}");
    }

    #[test]
    fn the_pole_star_is_above_the_pole() {
        let polaris = STARS.iter().find(|star| star.0 == "Polaris").unwrap();
        let [_, _, z] = fixed_from_j2000(polaris.1, polaris.2, 1.8e9);
        assert!((0.0..0.7).contains(&z.acos().to_degrees()));
        assert!(STARS.iter().all(|star| star.3 <= 3.0 && (0.0..360.0).contains(&star.1) && star.2.abs() <= 90.0));
    }

    #[test]
    fn a_camera_towards_the_pole_sees_its_stars() {
        let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 640, 480, 500.0)).unwrap();
        let mut data = FrameData { q_fixed_from_camera_wxyz: Some([1.0, 0.0, 0.0, 0.0]), ..FrameData::default() };
        assert!(places(Some(&data), NONE, &camera).is_empty(), "without a time there are no stars");
        data.utc_s = Some(1.8e9);
        let seen = places(Some(&data), NONE, &camera);
        let polaris = seen.iter().find(|star| star.name == "Polaris").unwrap();
        let centre = [319.5, 239.5];
        assert!((polaris.at[0] - centre[0]).hypot(polaris.at[1] - centre[1]) < 500.0 * 0.7f64.to_radians().tan());
        assert!(seen.iter().any(|star| star.name == "Kochab") && seen.iter().all(|star| star.name != "Sirius"));
    }

    /// The catalogue of names has 142 stars to magnitude 3; Toliman is left out.
    #[test]
    fn the_table_is_complete_and_each_star_has_its_own_name_and_place() {
        assert_eq!(STARS.len(), 141);
        assert!(STARS.is_sorted_by(|a, b| a.3 <= b.3), "the brightest is first");
        let names: std::collections::HashSet<_> = STARS.iter().map(|star| star.0).collect();
        assert_eq!(names.len(), STARS.len());
        let direction = |star: &(&str, f64, f64, f64)| fixed_from_j2000(star.1, star.2, J2000_S);
        for (n, star) in STARS.iter().enumerate() {
            let near = STARS.iter().take(n).find(|other| angle_deg(direction(star), direction(other)) < 0.1);
            assert_eq!(near, None, "{star:?}");
        }
        // The Plough and the Southern Cross are whole.
        for name in ["Dubhe", "Merak", "Phecda", "Alioth", "Mizar", "Alkaid", "Acrux", "Mimosa", "Gacrux", "Imai"] {
            assert!(names.contains(name), "{name}");
        }
    }

    #[test]
    fn a_star_behind_a_body_is_left_out() {
        let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 640, 480, 500.0)).unwrap();
        let (utc_s, q) = (Some(1.8e9), Some([1.0, 0.0, 0.0, 0.0]));
        let data = FrameData { utc_s, q_fixed_from_camera_wxyz: q, ..FrameData::default() };
        let free = places(Some(&data), NONE, &camera);
        let kochab = free.iter().find(|star| star.name == "Kochab").unwrap();
        let ray = camera.unproject(hzn_core::pixel::ImagePoint { u: kochab.at[0], v: kochab.at[1] }).unwrap().xyz();
        // A disc of 4 degrees around Kochab leaves the pole star in view.
        let disc = answer(Kind::EarthSphere, ray, 2f64.to_radians(), 400_000.0);
        let seen = places(Some(&data), &[std::sync::Arc::new(disc)], &camera);
        assert!(seen.iter().all(|star| star.name != "Kochab") && seen.iter().any(|star| star.name == "Polaris"));
        assert_eq!(seen.len() + 1, free.len(), "no other star is there");
    }
}
