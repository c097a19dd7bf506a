//! Campaigns. The gate runs a small one; `cargo xtask campaign` sets the numbers of a large one.

use crate::common::{Place, without_time};

/// Returns the number that an environment variable gives, or else `default`.
pub(crate) fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Starts a run, kills it after `wait_us`, and returns the number of pictures that are finished in the unfinished file.
/// Returns `None` if the run ended before.
#[cfg(unix)]
fn kill(place: &Place, args: &[&str], out: &str, wait_us: u64) -> Option<u64> {
    let mut child = place.command(args).stderr(std::process::Stdio::null()).spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_micros(wait_us));
    child.kill().unwrap();
    let killed = child.wait().unwrap().code().is_none();
    // The run may have ended just before, and the name is given at its very end.
    if !killed || place.path(out).exists() {
        return None;
    }
    let part = format!("{out}.part");
    if std::fs::metadata(place.path(&part)).map_or(0, |info| info.len()) == 0 {
        return Some(0);
    }
    let said = place.run(&["info", &part]).out;
    let pictures = said.lines().find_map(|line| line.strip_prefix("pictures"));
    Some(pictures.map_or(0, |text| text.trim().parse().unwrap()))
}

/// Kills runs at random moments, some of them again while they are continued. Every finished picture is kept, and the
/// continued run gives the same results as a run that was not killed.
#[cfg(unix)]
#[test]
fn killed_at_random_moments() {
    let runs = number("HZN_KILLS", 12);
    let place = Place::with_pictures(300);
    let begin = std::time::Instant::now();
    place.run(&["run", "in", "-o", "whole.csv", "-q", "-j", "1"]).expect(0);
    let whole = without_time(&place.read("whole.csv"));
    let mut longest_us = begin.elapsed().as_micros() as u64;
    let mut state = 7u64;
    let mut draw = |below: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % below.max(1)
    };
    // Kills before the end, kills of a continued run, and pictures that were finished when their run was killed.
    let (mut early, mut again, mut kept) = (0u64, 0u64, 0u64);
    for n in 0..runs {
        let (out, durable) = (["a.csv", "a.jsonl", "a.mcap"][n as usize % 3], n / 3 % 2 == 1);
        let mut finished = 0;
        for attempt in 0..1 + draw(2) {
            let mut args = vec!["run", "in", "-o", out, "-q", "-j", "1"];
            args.extend(durable.then_some("--durable"));
            args.extend((attempt > 0).then_some("--resume"));
            let Some(now) = kill(&place, &args, out, draw(longest_us)) else {
                // The moments follow the speed of the machine, which other programs use too.
                longest_us -= longest_us / 4;
                break;
            };
            longest_us += longest_us / 8;
            (early, again) = (early + 1, again + u64::from(attempt > 0));
            assert!(now >= finished, "{n}: {now} of {finished} pictures are left");
            finished = now;
        }
        kept += finished;
        if !place.path(out).exists() {
            let ran = place.run(&["run", "in", "-o", out, "--resume"]).expect(0);
            let before = ran.err.split("(after ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<u64>().ok());
            assert!(before.unwrap_or(0) >= finished, "{n}: {before:?} of {finished} pictures were continued");
        }
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0);
        assert!(without_time(&place.read("rows.csv")) == whole, "{n}: {out} differs");
        std::fs::remove_file(place.path(out)).unwrap();
    }
    println!("{runs} runs: {early} kills, {again} of them of a continued run; {kept} finished pictures, none lost");
    assert!(early * 3 > runs, "{early} of {runs} runs were killed before their end");
}

/// Returns the processor time of a process in ticks, from its file `stat`.
#[cfg(target_os = "linux")]
pub(crate) fn processor_ticks(stat: &str) -> Option<u64> {
    let text = std::fs::read_to_string(stat).ok()?;
    // The name of the program is in parentheses; utime and stime are the 12th and 13th field after it.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    Some(fields.next()?.parse::<u64>().ok()? + fields.next()?.parse::<u64>().ok()?)
}

/// Runs many pictures: the memory does not grow, the answers repeat, and the rate is steady.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "takes minutes; `cargo xtask campaign long` runs it"]
fn a_long_run() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let pictures = number("HZN_PICTURES", 100_000) as usize;
    let place = Place::with_pictures(pictures);
    for out in ["a.csv", "a.mcap"] {
        let mut child =
            place.command(&["run", "in", "-o", out, "--durable", "-q"]).stderr(Stdio::null()).spawn().unwrap();
        let (status, stat) = ["status", "stat"].map(|name| format!("/proc/{}/{name}", child.id())).into();
        let begin = Instant::now();
        // Time in seconds, resident memory in kB, bytes of the unfinished file, processor time in ticks.
        let mut samples = Vec::new();
        while child.try_wait().unwrap().is_none() {
            let text = std::fs::read_to_string(&status).unwrap_or_default();
            let kb =
                text.lines().find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB")?.parse().ok());
            let size = std::fs::metadata(place.path(&format!("{out}.part"))).map_or(0, |meta| meta.len());
            if let (Some(kb), Some(ticks)) = (kb, processor_ticks(&stat))
                && size > 0
            {
                samples.push((begin.elapsed().as_secs_f64(), kb, size, ticks));
            }
            std::thread::sleep(Duration::from_millis(200));
        }
        assert!(child.wait().unwrap().success());
        let seconds = begin.elapsed().as_secs_f64();
        let memory = |from: f64, to: f64| {
            let part = samples.iter().filter(|(t, ..)| (from..to).contains(&(t / seconds))).map(|(_, kb, ..)| *kb);
            part.max().unwrap_or(0u64)
        };
        let at = |share: f64| samples.iter().rfind(|(t, ..)| t / seconds <= share).unwrap();
        // Bytes per tick of processor time, which other programs on the machine hardly change.
        let rate = |from: f64, to: f64| {
            let (a, b) = (at(from), at(to));
            (b.2 - a.2) as f64 / (b.3 - a.3) as f64
        };
        let (early, late) = (memory(0.1, 0.3), memory(0.8, 1.0));
        let steady = rate(0.7, 0.95) / rate(0.1, 0.35);
        println!(
            "{out}: {pictures} pictures in {seconds:.0} s, {:.0} a second; memory {early} kB early, {late} kB late; \
             pictures per processor second late {steady:.2} of early",
            pictures as f64 / seconds
        );
        assert!((0.8..1.25).contains(&steady), "{out}: the rate is not steady: {steady:.2}");
        // The index of a recording's chunks grows, with a hundred bytes for each flush.
        assert!(late < early + early / 10 + 4096, "{out}: the memory grows from {early} to {late} kB");
        place.run(&["export", out, "-o", "rows.csv", "--force"]).expect(0);
        let rows = without_time(&place.read("rows.csv"));
        assert_eq!(rows.len(), pictures);
        let answer = |i: usize| {
            let own = ["index", "file", "time_s", "crc32"];
            rows[i].iter().filter(|(name, _)| !own.contains(&name.as_str())).collect::<Vec<_>>()
        };
        assert!((40..pictures).all(|i| answer(i) == answer(i % 40)), "{out}: the answers are those of the first pass");
    }
}
