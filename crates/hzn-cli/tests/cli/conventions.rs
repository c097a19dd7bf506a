//! Tables whose attitudes, positions or rates are in another convention or unit: the run names it.

use crate::common::{Place, limb};

type Matrix = [[f64; 3]; 3];

const PICTURES: u32 = 10;
const RADIUS_KM: f64 = 6771.0;

fn product(a: Matrix, b: Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[j][i]))
}

/// Returns the rotation about an axis of the frame.
fn about(axis: usize, rad: f64) -> Matrix {
    let (sin, cos) = rad.sin_cos();
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut m = [[0.0; 3]; 3];
    m[axis][axis] = 1.0;
    (m[i][i], m[j][j], m[i][j], m[j][i]) = (cos, cos, -sin, sin);
    m
}

/// Returns the quaternion of a rotation, scalar first.
fn wxyz(m: Matrix) -> [f64; 4] {
    let trace = m[0][0] + m[1][1] + m[2][2];
    let size = |i: usize| (1.0 + 2.0 * m[i][i] - trace).max(0.0).sqrt() / 2.0;
    let w = (1.0 + trace).max(0.0).sqrt() / 2.0;
    let [x, y, z] = [(0, 2, 1), (1, 0, 2), (2, 1, 0)].map(|(i, a, b)| size(i).copysign(m[a][b] - m[b][a]));
    [w, x, y, z]
}

/// How far the body's centre is below the optical axis in a picture, rad.
fn below_rad(i: u32) -> f64 {
    (62.0 + 1.5 * f64::from(i)).to_radians()
}

/// Returns a folder of pictures of a camera that nods and looks at the limb.
fn place() -> Place {
    let place = Place::new();
    for i in 0..PICTURES {
        let shift = (below_rad(i).to_degrees() - 68.0) / 0.05;
        limb(320, 240, shift).save(place.path(&format!("in/{i:04}.png"))).unwrap();
    }
    place
}

/// Returns the attitude of a picture and the position: the camera also turns about the direction to the Earth.
fn truth(i: u32) -> (Matrix, [f64; 3]) {
    let local = product(about(2, 0.8), about(1, 0.5));
    // The third axis of the local frame points down.
    let position = [0, 1, 2].map(|k| -RADIUS_KM * local[k][2]);
    let attitude = product(product(local, about(2, 0.3 * f64::from(i))), about(0, below_rad(i)));
    (attitude, position)
}

/// Returns what the run says if the table has what a change makes of the truth.
fn said(place: &Place, change: impl Fn(Matrix, [f64; 3]) -> ([f64; 4], [f64; 3])) -> String {
    let mut table = String::from("file,time_s,x_km,y_km,z_km,qw,qx,qy,qz,attitude_sigma_deg\n");
    for i in 0..PICTURES {
        let (attitude, position) = truth(i);
        let (q, p) = change(attitude, position);
        let numbers: Vec<String> = p.iter().chain(&q).map(f64::to_string).collect();
        table += &format!("{i:04}.png,{i},{},1\n", numbers.join(","));
    }
    place.write("in/frames.csv", table.as_bytes());
    place.run(&["run", "in", "-o", "a.csv", "--force"]).expect(0).err
}

#[test]
fn attitudes_in_another_convention_are_named() {
    let place = place();
    let right = said(&place, |a, p| (wxyz(a), p));
    assert!(!right.contains("warning") && !right.contains("refused"), "{right}");
    let named = |words: &str, err: String| {
        assert!(err.contains("the refused pictures agree with each other if") && err.contains(words), "{words}: {err}");
    };
    let last = |[w, x, y, z]: [f64; 4]| [x, y, z, w];
    named("have the scalar last (x, y, z, w)", said(&place, |a, p| (last(wxyz(a)), p)));
    named("the quaternions are inverted: ", said(&place, |a, p| (wxyz(transposed(a)), p)));
    named("inverted and have the scalar last", said(&place, |a, p| (last(wxyz(transposed(a))), p)));
    named("the positions have the opposite sign", said(&place, |a, p| (wxyz(a), p.map(|x| -x))));
    let mount = product(about(0, 1.0), about(1, 0.7));
    let of_vehicle = |a: Matrix, p: [f64; 3]| (wxyz(product(a, transposed(mount))), p);
    named("those of other axes on the vehicle, turned by", said(&place, of_vehicle));
    named("inertial axes (ECI), 63 deg", said(&place, |a, p| (wxyz(product(about(2, 1.1), a)), p)));
    let local = transposed(product(about(2, 0.8), about(1, 0.5)));
    named("relative to local axes with z down", said(&place, |a, p| (wxyz(product(local, a)), p)));
    // With the mount in sensor.toml, the vehicle's attitudes are known as such.
    let [w, x, y, z] = wxyz(mount);
    let sensor = place.read("in/sensor.toml");
    let with_mount = format!("{sensor}\n[mount]\nq_vehicle_from_camera_wxyz = [{w}, {x}, {y}, {z}]\n");
    place.write("in/sensor.toml", with_mount.as_bytes());
    named("the attitudes are those of the vehicle", said(&place, of_vehicle));
}

/// A camera that nods by 1.5 degrees a second.
#[test]
fn rates_of_another_unit_or_about_other_axes_are_named() {
    let place = place();
    let said = |rate: [f64; 3]| {
        let [x, y, z] = rate;
        let row = |i: u32| format!("{i:04}.png,{i},{x},{y},{z}\n");
        let rows: String = (0..PICTURES).map(row).collect();
        place.write("in/frames.csv", format!("file,time_s,rate_x,rate_y,rate_z\n{rows}").as_bytes());
        place.run(&["run", "in", "-o", "a.csv", "--force"]).expect(0)
    };
    let right = said([1.5f64.to_radians(), 0.0, 0.0]).err;
    assert!(!right.contains("the rates miss"), "{right}");
    let degrees = said([1.5, 0.0, 0.0]).err;
    assert!(degrees.contains("are they in degrees per second?"), "{degrees}");
    let vehicle = said([0.0, 0.0, 1.5f64.to_radians()]).err;
    assert!(vehicle.contains("about axes that are turned by"), "{vehicle}");
}
