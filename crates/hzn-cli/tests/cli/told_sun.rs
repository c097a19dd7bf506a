//! A Sun whose direction has the wrong sign: the border of the night is answered as the limb.

use image::{GrayImage, Luma};

use crate::common::{Place, cell, rows};

const F_PX: f64 = 1000.0;
const CENTRE_PX: [f64; 2] = [159.5, 119.5];
const SENSOR: &str = "[camera]\nwidth = 320\nheight = 240\nmodel = \"pinhole\"\nfx_px = 1000.0\nfy_px = 1000.0\n\
                      cx_px = 159.5\ncy_px = 119.5\n\n[body]\nkind = \"moon\"\n\n[input]\ntone = \"linear\"\n\n\
                      [fit]\nposition = true\n";

type Vector = [f64; 3];

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn unit(v: Vector) -> Vector {
    v.map(|x| x / dot(v, v).sqrt())
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns a dull sphere as large as the Moon, at a phase of 55 degrees, and the direction to the Sun.
fn moon(i: u32) -> (GrayImage, Vector) {
    let k = f64::from(i);
    let axis = unit([(14.0 - 2.0 * k) / F_PX, (k - 6.0) / F_PX, 1.0]);
    let radius = 1737.4 / (20_000.0 + 500.0 * k);
    let (right, phase, turn) = (unit(cross([0.0, 1.0, 0.0], axis)), 55f64.to_radians(), (40.0 + 3.0 * k).to_radians());
    let down = cross(axis, right);
    let side = [0, 1, 2].map(|j| turn.cos() * right[j] + turn.sin() * down[j]);
    let sun = [0, 1, 2].map(|j| phase.sin() * side[j] - phase.cos() * axis[j]);
    let light = |u: f64, v: f64| {
        let ray = unit([(u - CENTRE_PX[0]) / F_PX, (v - CENTRE_PX[1]) / F_PX, 1.0]);
        let cos = dot(ray, axis);
        let inside = radius * radius - (1.0 - cos * cos);
        if inside < 0.0 {
            return 0.0;
        }
        let distance = cos - inside.sqrt();
        dot([0, 1, 2].map(|j| (distance * ray[j] - axis[j]) / radius), sun).max(0.0)
    };
    let mut state = i.wrapping_mul(2_654_435_761).wrapping_add(7);
    let picture = GrayImage::from_fn(320, 240, |x, y| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let thirds = |j: u32| (f64::from(j) - 1.0) / 3.0;
        let at = |j: u32| light(f64::from(x) + thirds(j % 3), f64::from(y) + thirds(j / 3));
        Luma([(2.0 + 200.0 * (0..9).map(at).sum::<f64>() / 9.0) as u8 + (state >> 24) as u8 % 4])
    });
    (picture, sun)
}

#[test]
fn a_sun_of_the_wrong_sign_makes_the_answers_doubtful() {
    let place = Place::new();
    place.write("in/sensor.toml", SENSOR.as_bytes());
    let mut tables = ["file,sun_x,sun_y,sun_z\n".to_owned(), "file,sun_x,sun_y,sun_z\n".to_owned()];
    for i in 0..4 {
        let (picture, [x, y, z]) = moon(i);
        picture.save(place.path(&format!("in/{i}.png"))).unwrap();
        for (table, sign) in tables.iter_mut().zip([1.0, -1.0]) {
            *table += &format!("{i}.png,{},{},{}\n", sign * x, sign * y, sign * z);
        }
    }
    for (table, is_right) in tables.iter().zip([true, false]) {
        place.write("in/frames.csv", table.as_bytes());
        let run = place.run(&["run", "in", "-q"]).expect(0);
        let answers = rows(&run.out).iter().filter(|row| cell(row, "status") == "ok").count();
        assert!(answers >= if is_right { 4 } else { 1 }, "{is_right}: {answers}");
        assert_eq!(run.err.contains("darker towards the Sun that was told"), !is_right, "{}", run.err);
    }
}
