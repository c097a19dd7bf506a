//! Runs the OpenCV recipe, a Python process that takes turns with this program.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde::Deserialize;
use serde_json::json;

use crate::state::State;

/// How the recipe solves its least squares; also the names in its requests and stages. The last one is another recipe,
/// which looks at every 8th pixel first.
pub(crate) const SOLVERS: [&str; 3] = ["lstsq", "normal equations", "every 8th pixel"];

/// Running process of the recipe.
pub(crate) struct Recipe {
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    /// Versions of OpenCV and NumPy.
    pub(crate) versions: String,
}

/// Answer of the recipe to one frame.
#[derive(Debug, Deserialize)]
pub(crate) struct Answer {
    pub(crate) stages_us: BTreeMap<String, f64>,
    pub(crate) total_us: f64,
    pub(crate) axis: Option<[f64; 3]>,
    pub(crate) points: u32,
    /// Memory of the case's frames and of the binary picture that lies on pages of 2 MiB, in MiB.
    pub(crate) large_pages_mib: f64,
}

#[derive(Deserialize)]
struct Versions {
    opencv: String,
    numpy: String,
}

impl Recipe {
    pub(crate) fn start(python: &Path, folder: &Path) -> Result<Self, String> {
        let mut child = Command::new(python)
            .arg("benches/opencv_recipe.py")
            .arg(folder)
            // The linear algebra uses one thread as well.
            .envs(["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"].map(|name| (name, "1")))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| format!("{}: {e}", python.display()))?;
        let requests = child.stdin.take();
        let out = child.stdout.take().ok_or("the OpenCV recipe has no standard output")?;
        let mut recipe = Self { child, requests, answers: BufReader::new(out), versions: String::new() };
        let v: Versions = recipe.read()?;
        recipe.versions = format!("OpenCV {}, NumPy {}", v.opencv, v.numpy);
        Ok(recipe)
    }

    fn read<A: for<'de> Deserialize<'de>>(&mut self) -> Result<A, String> {
        let mut line = String::new();
        self.answers.read_line(&mut line).map_err(|e| e.to_string())?;
        serde_json::from_str(&line).map_err(|e| format!("the OpenCV recipe ended or gave an invalid answer: {e}"))
    }

    /// Measures one frame with the caches in a state.
    pub(crate) fn measure(
        &mut self,
        case: &str,
        frame: usize,
        level: u16,
        solver: &str,
        state: State,
    ) -> Result<Answer, String> {
        let requests = self.requests.as_mut().ok_or("the OpenCV recipe has no standard input")?;
        let request = json!({
            "case": case, "frame": frame, "level": level, "solver": solver, "state": state.name(),
        });
        writeln!(requests, "{request}").map_err(|e| e.to_string())?;
        requests.flush().map_err(|e| e.to_string())?;
        self.read()
    }
}

impl Drop for Recipe {
    fn drop(&mut self) {
        // The recipe ends by itself when it gets no more requests.
        self.requests = None;
        let _ = self.child.wait();
    }
}
