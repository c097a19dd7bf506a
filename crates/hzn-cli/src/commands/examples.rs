//! The examples in the help of every command.

use clap::Command;

/// Examples of each command by its words, in the order of the commands. A command that is missing here, or an example
/// that the program does not parse, fails a test.
const EXAMPLES: &[(&str, &str)] = &[
    ("demo", "hzn demo                        40 pictures, their answers and an HTML report, into hzn-demo"),
    (
        "run",
        "hzn run flight/ -o flight.csv                      all pictures of a folder, into a table
hzn run flight/ -o flight.csv -o flight.mcap       the same, and a recording for Foxglove
hzn run flight.mp4 -s sensor.toml --altitude-km 30 a video, all pictures from one altitude
hzn run flight/ -o - --format jsonl | head -1      JSON Lines on standard output
ls flight/*.png | hzn run - -s flight/sensor.toml  the pictures of a list
hzn run inbox/ --watch -o live.csv                 pictures as they arrive, until Ctrl-C
hzn run flight/ -o a.csv --mask-pictures masks/    what hides the stars, for a star tracker
hzn run sun/ -o sun.csv --wcs centred/             FITS files with centre and plate scale
hzn run rig.toml -o rig.csv                        several cameras that are one sensor",
    ),
    (
        "explain",
        "hzn explain flight/0001.png                  each stage of one picture, with advice
hzn explain flight.mcap --index 12           the picture with number 12 of a recording
hzn explain flight/0001.png --overlay a.png  the same, and a drawing
hzn explain rig.toml --index 3               the heads of one epoch, and their joint answer",
    ),
    (
        "info",
        "hzn info flight.mcap           pictures, times, statuses and sigmas of a recording
hzn info sensor.toml --json    the same facts for a program, as one JSON object",
    ),
    (
        "export",
        "hzn export flight.mcap -o flight.csv            the rows of a recording, as a table
hzn export flight.mcap -o - --format jsonl      the same on standard output
hzn export flight.mcap --overlay drawn/         the pictures with edges, points and limb
hzn export bag/ --images pictures/              the pictures of a bag, or of a video
hzn export bag/ --imu imu.csv --gnss gnss.csv   from ROS 2, the tables of `hzn fuse`",
    ),
    ("recover", "hzn recover flight.mcap.part        keeps what is complete, in flight.mcap"),
    (
        "fuse",
        "hzn fuse --nadir flight.mcap --imu imu.csv --gnss gnss.csv -o fused.mcap
hzn fuse --nadir flight.mcap --imu imu.csv --gnss gnss.csv --solve -o f.mcap --report f.html
hzn fuse --nadir flight.mcap --attitude startracker.csv --solve -o orbit.csv
hzn fuse --nadir f.mcap --imu imu.csv --gnss log.nmea --utc 2026-06-13T04:00:00Z -o f2.mcap
hzn fuse --nadir f.mcap --imu log.csv --map imu:gyro=wx:wy:wz,deg/s --gnss gnss.csv -o f2.mcap",
    ),
    (
        "simulate",
        "hzn simulate rocket -o flight              a built-in scene, into a new folder
hzn simulate rocket --show > mine.toml     its text, to be changed
hzn simulate mine.toml -o mine --seed 7    the changed scene, with other random numbers",
    ),
    (
        "init",
        "hzn init                                          every key, into sensor.toml
hzn init flight/ --fov 92 --lens fisheye          a fisheye that sees 92 degrees over the width
hzn init IMG_0001.JPG --altitude 418 -o iss.toml  the lens as EXIF has it, pictures from 418 km
hzn init flight/ --altitude 418                   without EXIF: the field of view from the limb
hzn init bag/ --topic /rear/image_raw             one camera of a bag of ROS 2
hzn init moon/ --fov 40 --body moon --altitude 100   a camera in orbit around the Moon
hzn init --rig left right --mount 1,0,0,0 --mount 0,0,0,1   several heads, into rig.toml",
    ),
    (
        "migrate",
        "hzn migrate sensor.toml            new names for old ones; the rest stays as it is
hzn migrate --dry-run scene.toml   only says what would change",
    ),
    (
        "prepare",
        "hzn prepare sensor.toml                      sensor.bin, for a flight computer
hzn prepare sensor.toml -o camera-1.bin -f   with another name, replaced if it exists",
    ),
    (
        "evaluate",
        "hzn evaluate flight.csv --truth flight            errors, shares and covariances in words
hzn evaluate flight.csv --truth flight -o a.html  the same, and a page with plots
hzn evaluate flight.csv --truth flight --json     everything as JSON, on standard output",
    ),
    (
        "sensitivity",
        "hzn sensitivity --fov 40:120:20 --altitude 500    which field of view is accurate enough
hzn sensitivity -s sensor.toml --altitude 100:900:100   a sensor of yours, by altitude
hzn sensitivity visibility --altitude 500         when an arc or the whole disc is in view
hzn sensitivity rig --fov 20:90:10 --altitude 500 --size 640x480 -o heads.svg   how many heads",
    ),
    ("calibrate", "hzn calibrate noise flight/ -o noise.toml      limb height and edge noise of a flight"),
    (
        "calibrate board",
        "hzn calibrate board board/ --board 9x6 -o camera.toml -o report.html
hzn calibrate board board/ --board 9x6 --square-mm 25 --model brown-conrady",
    ),
    ("calibrate points", "hzn calibrate points stars.csv --size 1920x1080 -o camera.toml"),
    (
        "calibrate sky",
        "hzn calibrate sky flight/ -o sensor-calibrated.toml   focal length and centre from the limb
hzn calibrate sky flight/ --also k1 -o report.html    one more parameter, and a report",
    ),
    ("calibrate check", "hzn calibrate check flight/        whether the calibration still holds"),
    ("calibrate noise", "hzn calibrate noise flight/ -o sensor-calibrated.toml -o noise.html"),
    ("calibrate mount", "hzn calibrate mount flight nav.csv --told left/sensor.toml --name left -o mount.toml"),
    ("calibrate mount kalibr", "hzn calibrate mount kalibr a.yaml b.yaml c.yaml --camera cam0 -o mount.toml"),
    ("calibrate mount flight", "hzn calibrate mount flight nav.csv --told left/sensor.toml -o mount.toml"),
    (
        "calibrate mount board",
        "hzn calibrate mount board tilts/ --board 9x6 --lens sensor.toml --tilt tilt.csv -o mount.toml",
    ),
    (
        "calibrate rig",
        "hzn calibrate rig ring/rig.toml -o ring/calibrated.toml   the mounts of the heads
hzn calibrate rig ring/rig.toml --check                   whether a head has turned",
    ),
    ("camera", "hzn camera show sensor.toml                     lens table and expected limb"),
    (
        "camera show",
        "hzn camera show sensor.toml                     lens table and expected limb
hzn camera show camchain.yaml --picture map.png  a map of the picture",
    ),
    (
        "camera convert",
        "hzn camera convert camera_info.yaml -o camera.toml            from ROS's camera calibrator
hzn camera convert sensor.toml --to opencv -o camera.yaml     into a file of OpenCV",
    ),
    (
        "fly",
        "hzn fly /dev/video0 -s sensor.toml --line udp:0.0.0.0:5005,10.0.0.2:5006
camera | hzn fly - -s sensor.toml --raw 640x480:mono8    pictures of another program",
    ),
    (
        "key",
        "hzn key vehicle.key --spacecraft 42 --number 1   a new key, and its counter
hzn key vehicle.key                              what the key is for, without its secret",
    ),
    (
        "telemetry",
        "hzn telemetry stream.bin -o answers.csv             a received file, as a table
hzn telemetry udp:0.0.0.0:5006,10.0.0.1:5005 --screen   a line, on the whole terminal",
    ),
    ("telecommand", "hzn telecommand report \"set gates.max_rms_px 2.5\" -o commands.bin"),
    (
        "view",
        "hzn view flight/          the pictures of a folder, with their edges and points
hzn view flight.mcap      a recording",
    ),
    (
        "schema",
        "hzn schema sensor.toml > sensor.schema.json   for an editor of sensor.toml
hzn schema scene.toml > scene.schema.json     for one of scene.toml",
    ),
    (
        "completions",
        "source <(hzn completions bash)            in ~/.bashrc
hzn completions zsh > _hzn                into a folder of $fpath",
    ),
    (
        "man",
        "hzn man | man -l -              the page of hzn
hzn man run | man -l -          the page of one command
hzn man -o ~/.local/share/man/man1   the pages of all commands, for `man hzn-run`",
    ),
];

/// Adds the examples to the help of each command.
pub(super) fn add(command: Command) -> Command {
    EXAMPLES.iter().fold(command, |command, (words, lines)| {
        let indented: Vec<String> = lines.lines().map(|line| format!("  {line}")).collect();
        let text = format!("Examples:\n{}", indented.join("\n"));
        add_to(command, &words.split(' ').collect::<Vec<_>>(), text)
    })
}

fn add_to(command: Command, words: &[&'static str], text: String) -> Command {
    match words.split_first() {
        // A command that this computer does not have (`fly`) is no subcommand here.
        Some((first, rest)) if command.find_subcommand(first).is_some() => {
            command.mut_subcommand(first, |subcommand| add_to(subcommand, rest, text))
        }
        Some(_) => command,
        None => command.after_help(text),
    }
}

#[cfg(test)]
mod tests {
    use clap::{Command, CommandFactory};

    use super::super::{Cli, command};
    use super::EXAMPLES;

    /// Splits a line into the words before two spaces, as a shell does; also returns whether the rest is a comment.
    fn words(line: &str) -> Vec<String> {
        let line = line.split(" | head").next().unwrap_or_default();
        let line = line.rsplit(" | hzn").next().map_or(line.to_owned(), |last| match line.contains(" | hzn") {
            true => format!("hzn{last}"),
            false => line.to_owned(),
        });
        let line = line.split(" | man").next().unwrap_or_default().replace("source <(", "").replace(')', "");
        let code = line.split("  ").next().unwrap_or_default().split(" > ").next().unwrap_or_default();
        let mut words = vec![String::new()];
        let mut quoted = false;
        for c in code.chars() {
            match c {
                '"' => quoted = !quoted,
                ' ' if !quoted => words.push(String::new()),
                c => words.last_mut().unwrap().push(c),
            }
        }
        words.retain(|word| !word.is_empty());
        words
    }

    fn names(command: &Command, before: &str) -> Vec<String> {
        let own = command.get_subcommands().filter(|c| c.get_name() != "help");
        own.flat_map(|c| {
            let name = format!("{before} {}", c.get_name()).trim().to_owned();
            let inner = names(c, &name);
            std::iter::once(name).chain(inner)
        })
        .collect()
    }

    #[test]
    fn every_command_has_examples_and_every_example_is_parsed() {
        let listed: Vec<&str> = EXAMPLES.iter().map(|(name, _)| *name).collect();
        #[cfg(target_os = "linux")]
        assert_eq!(listed, names(&Cli::command(), ""));
        for (name, lines) in EXAMPLES {
            let mut found = false;
            for line in lines.lines() {
                assert!(line.len() <= 96, "{name}: a help of 100 columns breaks the line: {line}");
                let words = words(line);
                assert_eq!(words.first().map(String::as_str), Some("hzn"), "{line}");
                found |= words[1..].join(" ").starts_with(name);
                let parsed = command().try_get_matches_from(&words);
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
            }
            assert!(found, "no example of {name}");
        }
    }

    #[test]
    fn help_shows_the_examples() {
        let mut command = command();
        let board = command.find_subcommand_mut("calibrate").unwrap().find_subcommand_mut("board").unwrap();
        assert!(board.render_help().to_string().contains("Examples:\n  hzn calibrate board board/"));
    }
}
