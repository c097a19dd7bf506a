//! Sequences of pictures, with a tracker, and pictures that come row by row.

use hzn_core::pipeline::{ROWS_HELD, RowBuffers};
use hzn_core::{FlightHorizon, FlightWorkspace, HostHorizon, Observer, Prior, Sensor, Sequence, Step, Tracker};

use super::journal::Journal;
use super::limbs::Scene;
use super::options::{self, Told};
use super::{Dice, Table, grey};

/// Adds the pictures of a sequence to a table.
fn follow(table: &mut Table, seed: u64, is_calm: bool) {
    let mut dice = Dice::new(seed);
    let field_rad = dice.pick(&[0.4, 0.8, 1.3]);
    let mut scene = Scene::new(&mut dice, [256, 192], field_rad);
    if !is_calm && dice.one_in(2) {
        options::stages(&mut dice, &mut scene.config);
    }
    scene.config.track.full_every = dice.pick(&[3, 25]);
    scene.config.track.normals = dice.pick(&[32, 64, 128, 500]);
    let mut light = Dice::new(dice.number().into());
    let px = 2.0 / (scene.config.camera.fx_px + scene.config.camera.fy_px);
    let reach_px = dice.pick(&[1.0, 4.0, 8.0, 20.0]);
    let turn = [0; 3].map(|_| dice.between(-1.0, 1.0) * reach_px * px);
    let is_told = dice.one_in(2);
    let made: Option<Box<HostHorizon>> = table.sensor(&seed.to_string(), &scene.config);
    let Some(mut horizon) = made else { return };
    let (mut tracker, mut sequence) = (Tracker::default(), Sequence::default());
    for i in 0..5 {
        if dice.one_in(6) {
            light = Dice::new(dice.number().into());
        }
        let drawn = &mut Dice(light.0);
        let data = if is_calm { scene.calm_day(drawn) } else { scene.day(drawn) };
        let rate = turn.map(|x| -x / 0.5);
        let mut prior = Prior { rate_rad_s: is_told.then_some(rate), ..scene.told.prior };
        if dice.one_in(9) {
            // The predicted limb is then out of the picture, or in another part of it.
            (prior.position_m, prior.altitude_m) = (None, Some(dice.pick(&[450e3, 3e6, 4e7])));
        }
        let step = Step::from_prior(&prior, dice.pick(&[Some(0.5), Some(0.5), None]));
        let Ok(expected) = horizon.expect(&prior) else { continue };
        let journal = Journal::default();
        let picture = grey(&scene.config, &data);
        let mut report =
            horizon.track_observed(&mut tracker, &picture, (&expected, &step), &(&journal as &dyn Observer<_>));
        let is_fixed = sequence.judge(&step, &mut report, &scene.config.gates);
        table.add(&format!("{seed} {i} {is_fixed} {:?}", report.next_level), &report, &journal);
        scene.move_by(turn);
    }
}

#[test]
fn of_sequences() {
    let mut table = Table::new("sequences");
    (2000..2020).for_each(|seed| follow(&mut table, seed, false));
    table.check();
}

#[test]
fn of_more_sequences() {
    let mut table = Table::new("more_sequences");
    (2100..2120).for_each(|seed| follow(&mut table, seed, false));
    table.check();
}

#[test]
fn of_calm_sequences() {
    let mut table = Table::new("calm_sequences");
    (2400..2425).for_each(|seed| follow(&mut table, seed, true));
    table.check();
}

const W: usize = 160;
const H: usize = 120;

#[test]
fn of_pictures_that_come_row_by_row() {
    let mut table = Table::new("rows");
    for seed in 2200..2260 {
        let mut dice = Dice::new(seed);
        let mut scene = Scene::new(&mut dice, [W as u16, H as u16], 0.8);
        let data = scene.day(&mut dice);
        if dice.one_in(2) {
            options::stages(&mut dice, &mut scene.config);
        }
        scene.config.edge_points.min_points = 12;
        let Ok(sensor) = Sensor::<f32>::new(&scene.config) else { continue };
        let mut level = None;
        let mut rows = Box::new(RowBuffers::<u8, { ROWS_HELD as usize * W }, H, 3000, 1500>::new());
        for look in 0..2 {
            let Ok(expected) = sensor.expect(&Prior { level, ..scene.told.single() }) else { break };
            let mut stream = match sensor.rows(&mut rows, 8, &expected) {
                Ok(stream) => stream,
                Err(error) => {
                    table.lines += &format!("{seed},{error}\n");
                    break;
                }
            };
            data.chunks(W).for_each(|row| stream.push_row(row).unwrap());
            let journal = Journal::default();
            let report = stream.finish(&mut Box::new(FlightWorkspace::new()), &journal);
            level = report.next_level;
            table.add(&format!("{seed} {look} {level:?} {}", report.counters.cut_points), &report, &journal);
        }
    }
    table.check();
}

#[test]
fn of_a_known_rate_of_the_vehicle() {
    let mut table = Table::new("last");
    for seed in 2300..2330 {
        let mut dice = Dice::new(seed);
        let mut scene = Scene::new(&mut dice, [160, 120], 0.8);
        scene.config.gates.max_rate_deg_s = Some(dice.pick(&[0.5, 5.0]));
        let made: Option<Box<FlightHorizon>> = table.sensor(&seed.to_string(), &scene.config);
        let Some(mut horizon) = made else { continue };
        let mut last = None;
        for i in 0..3 {
            let data = scene.day(&mut Dice::new(seed));
            let prior = Prior { last, ..Told::default().single() };
            let expected = horizon.expect(&prior).unwrap();
            let journal = Journal::default();
            let report =
                horizon.process_observed(&grey(&scene.config, &data), &expected, &(&journal as &dyn Observer<_>));
            table.add(&format!("{seed} {i}"), &report, &journal);
            last = report.solution.map(|found| hzn_core::body::Last {
                axis: found.axis,
                sigma_rad: found.covariance.sigma_max_rad(),
                age_s: dice.pick(&[0.1f32, 1.0, 10.0]),
            });
            scene.move_by([0.004 * f64::from(i), 0.002, 0.01]);
        }
    }
    table.check();
}
