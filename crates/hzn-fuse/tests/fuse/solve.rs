//! The whole flight at once: the numbers of the sparse equations, the derivatives, and flights whose errors are drawn.
//!
//! `HZN_FLIGHTS=40 cargo test --test fuse solve:: -- --nocapture` flies 40 flights; without the variable a few of them.

use crate::common::{Draws, Slow, scene};
use hzn_core::body::Kind as BodyKind;
use hzn_fuse::finding::Level;
use hzn_fuse::flight::{Wanted, with_problem};
use hzn_fuse::input::{Attitude, Body, Inputs};
use hzn_fuse::results::{Epoch, Kind};
use hzn_fuse::simulated::{Errors, inputs};
use hzn_fuse::solve::{Estimates, Loss, Problem, Role};
use hzn_fuse::sparse::{Factor, Linear, Marginals, Normal, Pattern};
use hzn_fuse::{Fused, Settings, fuse, truth};
use hzn_nav::frames::{Rotation, Vector};
use hzn_sim::Scenario;
use nalgebra::{DMatrix, DVector};

/// First seed of the flights: no setting of the solve was looked at with them.
const FIRST_SEED: u64 = 83_000;
/// Time of the tables of Braun & Barf 2022, s.
const TIME_S: f64 = 300.0;

/// A chain of blocks with a border, as a flight has it.
#[test]
fn marginals_are_those_of_the_dense_inverse() {
    let mut draws = Draws(11);
    for blocks in [1, 2, 7, 120] {
        let mut sizes = vec![4; blocks];
        sizes.extend([2, 2, 5]);
        let border = blocks + 2;
        let mut joined: Vec<Vec<usize>> = (0..sizes.len()).map(|i| vec![i]).collect();
        joined.extend((1..blocks).map(|i| vec![border, i, i - 1]));
        joined.extend([vec![0, blocks, border], vec![blocks / 2, blocks + 1, border], vec![blocks, blocks + 1]]);
        let errors: Vec<Linear> = joined
            .iter()
            .map(|all| {
                let rows = all.iter().map(|b| sizes[*b]).max().unwrap();
                let mut dense = |r, c| DMatrix::from_fn(r, c, |_, _| draws.normal());
                let derivatives: Vec<_> = all.iter().map(|b| (*b, dense(rows, sizes[*b]))).collect();
                Linear { error: dense(rows, 1).column(0).into_owned(), derivatives }
            })
            .collect();
        let pattern = Pattern::new(&sizes, joined.iter().map(Vec::as_slice)).unwrap();
        let n = pattern.len();
        let (mut normal, mut full, mut gradient) = (Normal::new(&pattern), DMatrix::zeros(n, n), DVector::zeros(n));
        for error in &errors {
            normal.add(error);
            let mut row = DMatrix::zeros(error.error.len(), n);
            for (b, matrix) in &error.derivatives {
                row.view_mut((0, pattern.start(*b)), matrix.shape()).copy_from(matrix);
            }
            full += row.tr_mul(&row);
            gradient += row.tr_mul(&error.error);
        }
        let mut factor = Factor::new(&pattern).unwrap();
        factor.compute(&normal, 0.0).unwrap();
        let inverse = full.try_inverse().unwrap();
        let step = factor.step(&normal);
        assert!((&step + &inverse * gradient).amax() < 1e-9 * step.amax(), "{blocks}");
        let marginals = Marginals::new(&pattern, &factor);
        for all in &joined {
            for (a, b) in all.iter().flat_map(|a| all.iter().map(move |b| (*a, *b))) {
                let dense = inverse.view((pattern.start(a), pattern.start(b)), (sizes[a], sizes[b])).into_owned();
                let off = (marginals.block(a, b).unwrap() - &dense).amax() / inverse.amax();
                assert!(off < 1e-9, "{blocks} {a} {b}: {off}");
            }
        }
        assert!(blocks < 100 || 10 * factor.len() < n * n, "{} of {}", factor.len(), n * n);
    }
}

/// Returns the inputs of a flight whose mounts, biases, clocks and limb height are drawn from the settings.
pub(crate) fn drawn(seed: u64) -> (Scenario, Inputs) {
    drawn_with(seed, &mut Slow::new(seed, 0.1))
}

/// Returns the same with other errors of the directions.
pub(crate) fn drawn_with(seed: u64, errors: &mut dyn Errors) -> (Scenario, Inputs) {
    let mut scene = scene(seed);
    let mut draws = Draws(seed ^ 0x501e);
    for camera in &mut scene.cameras {
        camera.clock.latency_s = 0.03;
        camera.clock.offset_s = 0.2 * draws.normal() - 0.03;
    }
    let height_km = 7.0 * draws.normal();
    let drawn = inputs(&scene, errors, height_km).unwrap();
    (scene, drawn)
}

/// The settings of the scene: smaller shares for vibration and delays, which a simulated flight does not have.
pub(crate) fn own() -> Settings {
    let mut own = Settings::default();
    own.imu.gyro_noise_deg_rth[1] = 0.6;
    own.imu.accel_noise_mg_rthz[1] = 0.5;
    own.camera.white_rad = 5e-4;
    own
}

pub(crate) fn solved() -> Wanted {
    Wanted { solved: true, rate_hz: Some(2.0), ..Wanted::default() }
}

/// Every derivative against differences, at estimates away from the solution.
#[test]
fn derivatives_are_those_of_differences() {
    let (_, mut inputs) = drawn(1);
    inputs.imu.retain(|s| s.imu.time_s < 150.0);
    let mut settings = own();
    settings.limb_height.latitude_sigma_km = 2.0;
    let worst = with_problem(&inputs, &settings, false, differences).unwrap();
    // The prior of a mount neglects that its axes turn by half of its error, here 0.3°: the largest difference.
    assert!(worst < 6e-3, "{worst}");
}

/// Returns the largest difference of a derivative over the size of the derivatives of its error and block.
pub(crate) fn differences(problem: &Problem<'_>, first: &Estimates) -> f64 {
    let places = problem.places();
    let mut draws = Draws(7);
    let sizes = first.sizes(places);
    // Biases, scales and knots are moved, so that no derivative is taken where its error is 0.
    let scale = |block: usize, i: usize| match block {
        b if b == first.shared_block() => 0.3 * problem.known()[i],
        b if b < first.knots.len() => [1e-4, 1e-2, 1.0][i / 3],
        _ => 1.0,
    };
    let off: Vec<DVector<f64>> =
        sizes.iter().enumerate().map(|(b, n)| DVector::from_fn(*n, |i, _| scale(b, i) * draws.normal())).collect();
    let at = first.moved(places, |block| off[block].clone());
    let errors = problem.errors(&at, Loss::Bounded).unwrap();
    let (middle, slow) = (first.knots.len() / 2, first.slow_block(first.slow.len() / 2));
    let mut worst: f64 = 0.0;
    for block in [middle, middle + 1, slow, first.shared_block()] {
        for i in 0..sizes[block] {
            // Positions of millions of metres are rounded to nanometres, and a step over 0.05 s has a sigma of
            // micrometres.
            let h = if block < first.knots.len() { 1.0 } else { 1e-2 } * scale(block, i);
            let moved = |sign: f64| {
                let step =
                    |b: usize| DVector::from_fn(sizes[b], |j, _| if (b, j) == (block, i) { sign * h } else { 0.0 });
                problem.errors(&at.moved(places, step), Loss::Bounded).unwrap()
            };
            for ((error, plus), minus) in errors.iter().zip(moved(1.0)).zip(moved(-1.0)) {
                let numeric = (plus.linear.error - minus.linear.error) / (2.0 * h) * scale(block, i);
                let own = error.linear.derivatives.iter().find(|(b, _)| *b == block);
                let analytic =
                    own.map_or_else(|| DVector::zeros(numeric.len()), |(_, m)| m.column(i) * scale(block, i));
                let size = own.map_or(1.0, |(b, m)| {
                    m.column_iter().enumerate().map(|(j, c)| c.norm() * scale(*b, j)).fold(1.0, f64::max)
                });
                let off = (&numeric - &analytic).amax() / size;
                assert!(off < 6e-3, "{:?} block {block} of {} column {i}: {off}", error.role, first.knots.len());
                worst = worst.max(off);
            }
        }
    }
    worst
}

/// The error of a solution and its sigmas about each axis at a time, degrees, and its NEES.
pub(crate) fn at_time(epochs: &[Epoch], scene: &Scenario, time_s: f64) -> Option<([f64; 3], [f64; 3], f64)> {
    let rows: Vec<_> = scene.path().unwrap().vehicle_rows([0.0, 430.0], 20.0).collect();
    let epoch =
        epochs.iter().min_by(|a, b| (a.state.time_s - time_s).abs().total_cmp(&(b.state.time_s - time_s).abs()))?;
    let miss = truth::compare(std::slice::from_ref(epoch), &rows).pop()?;
    let sigma = epoch.attitude_sigma_rad();
    Some((miss.attitude_rad.xyz().map(f64::to_degrees), [0, 1, 2].map(|i| sigma[i].to_degrees()), miss.nees))
}

fn flights() -> usize {
    std::env::var("HZN_FLIGHTS").map_or(3, |n| n.parse().expect("HZN_FLIGHTS is a number"))
}

/// Root mean square over flights and axes.
#[derive(Default)]
pub(crate) struct Table {
    pub(crate) filter: Vec<f64>,
    pub(crate) solve: Vec<f64>,
    pub(crate) bound: Vec<f64>,
    pub(crate) nees: Vec<f64>,
    levels: [usize; 3],
    longest_s: f64,
}

pub(crate) fn rms(all: &[f64]) -> f64 {
    (all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64).sqrt()
}

impl Table {
    pub(crate) fn len(&self) -> usize {
        self.nees.len()
    }

    pub(crate) fn add(&mut self, scene: &Scenario, fused: &Fused) {
        let (Some(filter), Some(solve)) =
            (at_time(&fused.epochs, scene, TIME_S), at_time(&fused.smoothed, scene, TIME_S))
        else {
            return;
        };
        self.filter.extend(filter.0);
        self.solve.extend(solve.0);
        self.bound.extend(solve.1);
        self.nees.push(solve.2);
        self.levels[fused.verdict.level() as usize] += 1;
    }

    pub(crate) fn print(&self, name: &str) {
        let nees = self.nees.iter().sum::<f64>() / self.nees.len() as f64;
        println!(
            "{name}: {} flights, T+{TIME_S} s: filter {:.3} deg, solve {:.3} deg RMS per axis, bound {:.3}, NEES \
             {nees:.2}, consistent, doubtful, contradicts {:?}, longest {:.2} s",
            self.nees.len(),
            rms(&self.filter),
            rms(&self.solve),
            rms(&self.bound),
            self.levels,
            self.longest_s
        );
    }
}

/// Flies flights with a first attitude before T+200 s, and returns their table.
fn fly(settings: &Settings, change: impl Fn(&Scenario, &mut Inputs)) -> Table {
    let mut table = Table::default();
    for seed in FIRST_SEED.. {
        if table.nees.len() >= flights() {
            break;
        }
        let (scene, mut inputs) = drawn(seed);
        change(&scene, &mut inputs);
        let began = std::time::Instant::now();
        let Ok(fused) = fuse(&inputs, settings, solved()) else { continue };
        let own_s = began.elapsed().as_secs_f64();
        if fused.begin.is_none_or(|begin| begin.time_s > 200.0) {
            continue;
        }
        table.longest_s = table.longest_s.max(own_s);
        let solved = fused.solved.as_ref().unwrap();
        assert!(solved.is_converged && solved.cost[1] <= solved.cost[0], "{seed}: {} {:?}", solved.steps, solved.cost);
        for finding in &fused.verdict.findings {
            println!("    {seed} {:?}: {}", finding.level, finding.what);
        }
        table.add(&scene, &fused);
    }
    table
}

#[test]
fn flights_with_mounts_to_a_degree() {
    for (name, settings) in [("defaults", Settings::default()), ("scene", own())] {
        let table = fly(&settings, |_, _| ());
        table.print(name);
        assert!(rms(&table.solve) < rms(&table.filter) * 1.05, "{name}");
        assert_eq!(table.levels[Level::Contradicts as usize], 0, "{name}");
        assert!(rms(&table.solve) < 2.0 * rms(&table.bound), "{name}");
    }
}

/// The true mounts with errors of 0.1° about each axis.
#[test]
fn flights_with_calibrated_mounts() {
    let mut settings = own();
    settings.camera.misalignment_deg.sigma = 0.1;
    let table = fly(&settings, |scene, inputs| {
        let mut draws = Draws(scene.seed);
        for (one, recording) in scene.by_camera().iter().zip(&mut inputs.recordings) {
            let error = Vector::from([0, 1, 2].map(|_| 0.1f64.to_radians() * draws.normal()));
            let mount = Rotation::assume_from_quaternion(one.true_q_vehicle_from_camera_wxyz()).unwrap();
            recording.mount = Some(mount * Rotation::from_scaled_axis(error));
        }
    });
    table.print("calibrated mounts");
    assert!(rms(&table.solve) < 0.15, "{}", rms(&table.solve));
}

/// One limb in 25 is 52° wrong: all of them count less, and the solution is as good as without them.
#[test]
fn false_directions_count_less() {
    let (scene, clean) = drawn(1);
    let mut inputs = clean.clone();
    let mut times = Vec::new();
    for recording in &mut inputs.recordings {
        for seen in recording.seen.iter_mut().filter(|s| s.body == Body::Limb && s.time_s > 115.0).step_by(25) {
            let across = seen.axis.cross(&Vector::new(0.0, 0.0, 1.0)).normalize();
            seen.axis = Rotation::from_scaled_axis(across * 52f64.to_radians()) * seen.axis;
            times.push(seen.time_s);
        }
    }
    let [with, without] = [&inputs, &clean].map(|inputs| fuse(inputs, &own(), solved()).unwrap());
    let lowered = &with.solved.as_ref().unwrap().lowered;
    let limbs = lowered.iter().filter(|l| l.kind == Kind::Direction(Body::Limb) && l.weight < 1e-3).count();
    assert!(times.len() > 5 && limbs == times.len(), "{limbs} of {}", times.len());
    let [a, b] = [&with, &without].map(|fused| at_time(&fused.smoothed, &scene, TIME_S).unwrap());
    let apart = (0..3).map(|i| (a.0[i] - b.0[i]) / b.1[i]).fold(0.0, |x: f64, y| x.max(y.abs()));
    assert!(apart < 0.5, "{apart} sigmas: {a:?} {b:?}");
    assert_eq!(with.verdict.level(), Level::Consistent);
}

/// Without a receiver the position is not known, and the attitude of star tracker and directions is all the same.
#[test]
fn a_star_tracker_needs_no_receiver() {
    let (scene, mut inputs) = drawn(1);
    inputs.gnss.clear();
    let (path, mut draws) = (scene.path().unwrap(), Draws(5));
    let sigma_rad = 0.05f64.to_radians();
    inputs.attitudes = (0..15)
        .map(|k| {
            let time_s = 110.0 + 20.0 * f64::from(k);
            let error = Rotation::from_scaled_axis(Vector::from([0, 1, 2].map(|_| sigma_rad * draws.normal())));
            let attitude: Rotation<_, _> = path.state(time_s).fixed_from_vehicle.into();
            Attitude { time_s, fixed_from_vehicle: Some(attitude * error), sigma_rad }
        })
        .collect();
    let fused = fuse(&inputs, &own(), solved()).unwrap();
    assert!(fused.solved.as_ref().unwrap().is_converged);
    for time_s in [150.0, 300.0, 400.0] {
        let (error, sigma, nees) = at_time(&fused.smoothed, &scene, time_s).unwrap();
        assert!(nees < 16.0 && sigma.iter().all(|s| *s < 0.06), "{time_s}: {error:?} {sigma:?} {nees}");
    }
    assert!(fused.smoothed[50].position_covariance_m2.as_inner().trace().sqrt() > 1e6);
}

/// A tumbling satellite with the instruments and the two cameras of the rocket, for a time.
fn orbit(to_s: f64) -> (Scenario, Inputs) {
    let (mut scene, rocket) = (Scenario::builtin("tumble").unwrap(), scene(FIRST_SEED));
    scene.seed = FIRST_SEED;
    scene.bodies = vec![BodyKind::Earth, BodyKind::Sun];
    scene.capture.to_s = to_s;
    scene.capture.frames = (to_s / 2.0) as u32 + 1;
    scene.exposure = Default::default();
    (scene.imu, scene.gnss) = (rocket.imu, rocket.gnss);
    (scene.camera, scene.cameras) = (rocket.camera, rocket.cameras);
    let drawn = inputs(&scene, &mut Slow::new(FIRST_SEED, 0.1), 0.0).unwrap();
    (scene, drawn)
}

/// Returns the processor time of this process, s; 0 where the system does not tell it. Other programs do not change it.
fn processor_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = text.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2).filter_map(|word| word.parse::<f64>().ok());
    // A tick is a hundredth of a second on every Linux.
    ticks.sum::<f64>() * 0.01
}

/// Returns unknowns and the numbers of the factor, and prints the processor time.
fn size(to_s: f64) -> [f64; 2] {
    let (scene, inputs) = orbit(to_s);
    let times = [Wanted { rate_hz: Some(0.1), ..Wanted::default() }, Wanted { rate_hz: Some(0.1), ..solved() }];
    let [filter, solve] = times.map(|wanted| {
        let began_s = processor_s();
        (fuse(&inputs, &own(), wanted).unwrap(), processor_s() - began_s)
    });
    let solved = solve.0.solved.as_ref().unwrap();
    let rows: Vec<_> = scene.path().unwrap().vehicle_rows([0.0, to_s], 20.0).collect();
    let misses = truth::compare(&solve.0.smoothed, &rows);
    let nees = misses.iter().map(|m| m.nees).sum::<f64>() / misses.len() as f64;
    println!(
        "{to_s} s: {} unknowns, {} numbers in the factor, {} steps, {:.2} s more than {:.2} s without; NEES {nees:.2}",
        solved.unknowns,
        solved.factor_numbers,
        solved.steps,
        solve.1 - filter.1,
        filter.1
    );
    assert!(solved.is_converged && (0.1..12.0).contains(&nees), "{nees}");
    [solved.unknowns as f64, solved.factor_numbers as f64]
}

/// Time and memory grow with the number of numbers in the factor, and that with the time of the flight.
#[test]
fn the_factor_grows_with_the_length_of_the_flight() {
    let [short, long] = [300.0, 1200.0].map(size);
    let grown = [long[0] / short[0], long[1] / short[1]];
    assert!((3.5..4.3).contains(&grown[0]) && grown[1] < 1.1 * grown[0], "{grown:?}");
}

#[test]
#[ignore = "an hour of flight; it prints times"]
fn an_hour_is_solved() {
    let sizes = [300.0, 1200.0, 3600.0].map(|to_s| {
        let size = size(to_s);
        // The largest memory of this process so far; each flight needs more than the one before.
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        println!("    {}", status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("unknown"));
        size
    });
    assert!(sizes[2][1] < 3.4 * sizes[1][1], "{sizes:?}");
}

/// What is not measured stays as it was known; what is measured becomes better known.
#[test]
fn what_was_determined_is_told() {
    let (_, inputs) = drawn(1);
    let fused = fuse(&inputs, &own(), solved()).unwrap();
    let solved = fused.solved.as_ref().unwrap();
    for one in &solved.determined {
        for i in 0..one.sigma.len() {
            assert!(one.sigma[i] > 0.0 && one.sigma[i] <= one.before[i] * (1.0 + 1e-6), "{one:?}");
            assert!(one.estimate[i].abs() < 4.5 * one.before[i], "{one:?}");
        }
    }
    let share = |name: &str| {
        let one = solved.determined.iter().find(|d| d.name == name).unwrap();
        one.sigma.iter().zip(&one.before).map(|(a, b)| a / b).fold(1.0, f64::min)
    };
    for one in &solved.determined {
        println!("{one:?}");
    }
    // Free fall shows the biases of the accelerometers and not their scales; slow turns show the clocks a little.
    assert!(share("clock of left") < 0.7 && share("mount of left") < 0.4, "{:?}", solved.determined);
    assert!(share("accel bias") < 0.05 && share("accel scale") > 0.99 && share("gyro axes") > 0.9);
    assert!(solved.sources.keys().any(|(camera, kind)| camera.is_none() && *kind == Kind::Velocity));
    let model = with_problem(&inputs, &own(), false, |problem, first| {
        problem.errors(first, Loss::Bounded).unwrap().iter().filter(|e| e.role == Role::Model).count()
    });
    assert!(model.unwrap() > solved.knots);
}
