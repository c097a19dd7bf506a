//! Makes the report: instructions and memory of both boards, as Markdown.

use std::process::Command;

use hzn_core::status::Stage;
use hzn_flight::answer::PictureAnswer;
use hzn_tests::emulated::{
    Board, Case, Measured, answer_bytes, chain_page, measure, measure_rows, measure_sequence, run_chain,
};
use hzn_tests::flight_image::Bench;
use hzn_tests::stack_bound::stack_bound;

use crate::pictures::{Pictures, Sequence};

const HEAD: &str = "# What the firmware costs

`cargo xtask firmware --write` writes this page. `cargo xtask test --all` fails if a figure (instructions, flash, static
RAM, stack) grows by more than 5 %; of the rows *worst found* it compares the most expensive one of each board.
`cargo xtask test` looks at flash and static RAM only, of the sensor alone on the Cortex-M4F and of the flight image on
the Cortex-M7. Instructions are exact (QEMU 7.2, `-icount`); they are not cycles. The sensor computes in
f32 and keeps 600 points, unless a row names another number. A row is the worst of its pictures. Every answer has the
same bits as on the host. The bound of the stack comes from the disassembly: it is the deepest path of calls, with an
exception on top, so no picture can need more.

The goals are for a Cortex-M7. For the sensor alone, they are 125 KiB (128000 bytes) of flash, 16 KiB (16384 bytes) of
stack with the start-up, 96 KiB of RAM in addition to the picture, and these instructions: 0.60 million for a clean
picture of 1920×1080, 0.43 million for one in a sequence, 2 million for a cloudy one, 20 million for the worst, with and
without tracking. Flash and the clean picture, alone (also with 200 points kept) and in a sequence, miss their goals;
[speed.md](speed.md#missed-goals) says why, and [porting.md](../guide/porting.md) what fewer points cost.

With tracking, 18 expensive pictures are counted: seeds 24 to 35, each after a clear limb and with the sensor of that
flight, and seeds 52 to 57 with the sensor for the Moon, each after a picture of it. The most expensive picture of the
table (seed 55) is among them. The flight image takes fewer instructions for it than the sensor alone; why is not known.
The instructions for a unit of `limits.max_work` are in [reliability.md](reliability.md#the-most-expensive-pictures).

On the Cortex-M4F, double-precision arithmetic in software takes about 9 KB more flash and nearly all of the time of
`expect`: `expect` calculates the cone of an altitude or a position in double precision, once per picture. No other code
that runs per picture uses it (`cargo xtask test` checks this).

The tables *in a sequence* are with `track.full_every`. The rows of the flight image count from the picture to its
answer, with the search for stuck pixels and the comparison of memory; those of the sensor alone count the call
`Sensor::track`.
";

/// Returns the whole report.
pub(crate) fn report() -> Result<String, String> {
    let pictures = Pictures::new();
    let mut out = HEAD.to_owned();
    for board in Board::with_pictures() {
        out += &Measurement::new(board, &pictures).section()?;
    }
    Ok(out)
}

/// Measurements of one board.
struct Measurement<'a> {
    board: Board,
    pictures: &'a Pictures,
    usual: Vec<Measured>,
    expensive: [Vec<Measured>; 4],
    by_rows: [(&'static str, Vec<Measured>); 2],
}

impl<'a> Measurement<'a> {
    fn new(board: Board, pictures: &'a Pictures) -> Self {
        Self {
            board,
            pictures,
            usual: measure(board, &pictures.usual),
            expensive: pictures.expensive.each_ref().map(|(cases, _)| measure(board, cases)),
            by_rows: pictures.by_rows.each_ref().map(|(kind, cases)| (*kind, measure_rows(board, cases))),
        }
    }

    /// Returns the section of the board.
    fn section(&self) -> Result<String, String> {
        self.check_answers()?;
        let mut out = format!("\n## {} ({})\n\n", self.board.core(), self.board.name());
        out += &self.picture_table();
        out += &self.preparation_table();
        out += &self.row_table();
        out += &sequence_table(self.board, &self.pictures.sequences);
        out += &self.memory_table()?;
        Ok(out)
    }

    /// Checks that every answer has the bits of the same sensor on this machine.
    fn check_answers(&self) -> Result<(), String> {
        let cases = self.pictures.usual.iter().chain(self.pictures.expensive.iter().flat_map(|(cases, _)| cases));
        for (case, m) in cases.zip(self.usual.iter().chain(self.expensive.iter().flatten())) {
            if answer_bytes(&case.answer_on_host()) != answer_bytes(&m.answer) {
                let core = self.board.core();
                return Err(format!("{} on {core}: the bits differ from those on this machine", case.name));
            }
        }
        Ok(())
    }

    /// Returns the instructions and the work of each picture.
    fn picture_table(&self) -> String {
        let mut out = String::from("| picture | process, thousand | work, thousand |");
        Stage::ALL.iter().for_each(|s| out += &format!(" {} |", s.name()));
        out += &format!("\n|---|---|---|{}\n", "---|".repeat(Stage::ALL.len()));
        let worst = self.pictures.expensive.iter().zip(&self.expensive).flat_map(|((cases, shown), measured)| {
            let mut hardest = lines(cases, measured);
            hardest.sort_by(|a, b| b.total.total_cmp(&a.total));
            hardest.into_iter().take(*shown).map(|l| Line { name: format!("worst found: {}", l.name), ..l })
        });
        for line in lines(&self.pictures.usual, &self.usual).into_iter().chain(worst) {
            out += &format!("| {} | {:.0} | {:.0} |", line.name, line.total, line.work);
            line.stages.iter().for_each(|n| out += &format!(" {n:.0} |"));
            out += "\n";
        }
        out
    }

    /// Returns the instructions that are needed before a picture.
    fn preparation_table(&self) -> String {
        let first = &self.usual[0];
        let mut out = String::from("\n| before the pictures | thousand |\n|---|---|\n");
        out += &format!("| making a sensor | {:.0} |\n", first.calls[0] as f64 / 1e3);
        out += &format!("| `expect` | {:.1} |\n", first.calls[1] as f64 / 1e3);
        out
    }

    /// Returns the instructions of pictures that come row by row.
    fn row_table(&self) -> String {
        let head = "| row by row | taking the rows, thousand | the end of the picture, thousand |";
        let mut out = format!("\n{head}\n|---|---|---|\n");
        for (kind, measured) in &self.by_rows {
            let max = |call: usize| measured.iter().map(|m| m.calls[call]).max().unwrap_or(0) as f64 / 1e3;
            out += &format!("| 640×480 {kind} by rows | {:.0} | {:.0} |\n", max(1), max(2));
        }
        out
    }

    /// Returns flash, RAM and stack of each image.
    fn memory_table(&self) -> Result<String, String> {
        let max = |measured: &mut dyn Iterator<Item = &Measured>| measured.map(|m| m.stack_bytes).max().unwrap_or(0);
        let usual = &self.pictures.usual;
        let all = &mut self.usual.iter().chain(self.expensive.iter().flatten());
        let stacks = [
            ("chain", "the sensor alone, 600 points", run_chain(self.board, &usual[usual.len() - 2].bytes)[10]),
            ("measure", "the sensor alone, all points", max(all)),
            ("rows", "row by row, 640×480", max(&mut self.by_rows.iter().flat_map(|(_, measured)| measured))),
        ];
        let sizes = |image: &str| sizes(self.board, image).ok_or("arm-none-eabi-size cannot be run");
        let mut out =
            String::from("\n| image | flash, bytes | static RAM, bytes | stack, bytes | bound of the stack, bytes |\n");
        out += "|---|---|---|---|---|\n";
        for (image, what, stack) in stacks {
            let [flash, ram] = sizes(image)?;
            let bound = stack_bound(&self.board.image(image))?.bytes;
            if stack > bound {
                return Err(format!("{image}: {stack} bytes of stack were used, and the bound is {bound}"));
            }
            out += &format!("| {what} | {flash} | {ram} | {stack} | {bound} |\n");
        }
        let [flash, ram] = sizes("flight")?;
        let stack = "as the sensor with 600 points, plus the loop; a test limits the total to 96 KiB";
        let bound = stack_bound(&self.board.image("flight"))?.bytes;
        out += &format!("| flight | {flash} | {ram} | {stack} | {bound} |\n");
        out += &format!(
            "\nThe first image reads a prepared sensor, whose {} bytes are not in its flash.\n",
            chain_page().1
        );
        Ok(out)
    }
}

/// Returns the instructions of a picture with `track.full_every`: of the flight image from the picture to its answer,
/// and of the sensor alone.
pub(crate) fn sequence_table(board: Board, sequences: &[Sequence]) -> String {
    let head =
        "| in a sequence | full searches, mean, thousand | full searches, worst | tracked, mean | tracked, worst |";
    let mut out = format!("\n{head}\n|---|---|---|---|---|\n");
    for Sequence { name, sensor, pictures } in sequences {
        let flown = Bench::new(board).fly(sensor, pictures);
        out += &sequence_row(&format!("{name}, flight image"), &flown);
        let alone = measure_sequence(board, sensor, pictures).into_iter().map(|m| (m.answer, m.calls[2]));
        out += &sequence_row(&format!("{name}, sensor alone"), &alone.collect::<Vec<_>>());
    }
    out
}

fn sequence_row(name: &str, answers: &[(PictureAnswer, u64)]) -> String {
    let mut out = format!("| {name} |");
    for wanted in [false, true] {
        let is_tracked = |(answer, _): &&(PictureAnswer, u64)| answer.solved == 1 && answer.looks == 0;
        let counts: Vec<u64> = answers.iter().filter(|a| is_tracked(a) == wanted).map(|a| a.1).collect();
        let (sum, worst) = (counts.iter().sum::<u64>() as f64, counts.iter().max());
        out += &match worst {
            Some(&worst) => format!(" {:.0} | {:.0} |", sum / counts.len() as f64 / 1e3, worst as f64 / 1e3),
            None => " none | none |".to_owned(),
        };
    }
    out + "\n"
}

/// Line of the table, with instructions and work in thousands.
pub(crate) struct Line {
    pub(crate) name: String,
    pub(crate) total: f64,
    pub(crate) work: f64,
    pub(crate) stages: Vec<f64>,
}

/// Returns a line for each name: the most expensive of its pictures.
pub(crate) fn lines(cases: &[Case], measured: &[Measured]) -> Vec<Line> {
    let mut out: Vec<Line> = Vec::new();
    for (case, m) in cases.iter().zip(measured) {
        let line = Line {
            name: case.name.clone(),
            total: m.calls[2] as f64 / 1e3,
            work: f64::from(m.answer.work) / 1e3,
            stages: m.stages.iter().map(|&n| n as f64 / 1e3).collect(),
        };
        match out.iter_mut().find(|l| l.name == line.name) {
            Some(same) if same.total < line.total => *same = line,
            Some(_) => {}
            None => out.push(line),
        }
    }
    out
}

/// Returns flash and static RAM of the images that are built in every check, with the keys of [`read_figures`].
pub(crate) fn sizes_of_every_check() -> Result<Vec<(String, f64)>, String> {
    let images = [(Board::An386, "chain", "the sensor alone, 600 points"), (Board::An500, "flight", "flight")];
    let mut out = Vec::new();
    for (board, image, row) in images {
        let bytes = sizes(board, image).ok_or("arm-none-eabi-size cannot be run")?;
        for (column, bytes) in ["flash, bytes", "static RAM, bytes"].iter().zip(bytes) {
            out.push((format!("{} ({}), {row}, {column}", board.core(), board.name()), bytes as f64));
        }
    }
    Ok(out)
}

/// Returns text + data, and data + bss, of an image in bytes.
fn sizes(board: Board, image: &str) -> Option<[u64; 2]> {
    let out = Command::new("arm-none-eabi-size").arg(board.image(image)).output().ok()?;
    let text = String::from_utf8(out.stdout).ok()?;
    let numbers: Vec<u64> = text.lines().nth(1)?.split_whitespace().take(3).filter_map(|n| n.parse().ok()).collect();
    let [text, data, bss] = numbers[..] else { return None };
    Some([text + data, data + bss])
}

/// Returns the figures of a report. The key of each figure is the heading, the first cell of its row, and the column.
pub(crate) fn read_figures(text: &str) -> Vec<(String, f64)> {
    let mut out: Vec<(String, f64)> = Vec::new();
    let (mut heading, mut columns) = ("", Vec::new());
    for line in text.lines() {
        if let Some(h) = line.strip_prefix("## ") {
            heading = h;
        }
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, name, values @ .., _] = &cells[..] else {
            columns.clear();
            continue;
        };
        if columns.is_empty() {
            columns = values.to_vec();
        }
        // Of the worst pictures only the most expensive one counts, because another one may become the worst.
        let name = name.split(": ").next().unwrap_or(name);
        for (value, column) in values.iter().zip(&columns) {
            let key = format!("{heading}, {name}, {column}");
            // Only the total of a picture is compared; its work and its stages are for information.
            let read_only = *column == "work, thousand" || Stage::ALL.iter().any(|s| s.name() == *column);
            let Some(n) = value.parse::<f64>().ok().filter(|_| !read_only) else { continue };
            match out.iter_mut().find(|(k, _)| *k == key) {
                Some((_, most)) => *most = most.max(n),
                None => out.push((key, n)),
            }
        }
    }
    out
}
