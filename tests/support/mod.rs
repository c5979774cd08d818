//! What the tests through the real binary share: running it, and captures to run it on.
#![allow(dead_code, unreachable_pub)] // each test program uses its part

pub mod capture;
pub mod kitchen;

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// How a run of the binary ended.
pub struct Run {
    /// The exit code; `None` when a signal ended it.
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

/// The binary in `folder`, with an environment that no test depends on by accident.
pub fn command<A: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshloom"));
    command.current_dir(folder).args(args).stdin(Stdio::null());
    for variable in ["SLURM_CPUS_PER_TASK", "RAYON_NUM_THREADS", "NO_COLOR"] {
        command.env_remove(variable);
    }
    command
}

/// Runs the binary in `folder` with arguments separated by blanks.
pub fn meshloom(folder: &Path, args: &str) -> Run {
    run(command(folder, args.split_whitespace()))
}

/// Runs a command to its end.
pub fn run(mut command: Command) -> Run {
    Run::of(command.output().expect("the binary starts"))
}

impl Run {
    pub fn of(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("output is Unicode");
        Run {
            code: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// The run has to have ended well.
    #[track_caller]
    pub fn done(self) -> Self {
        assert_eq!(self.code, Some(0), "stderr: {}", self.stderr);
        self
    }

    /// The one JSON object on stdout.
    #[track_caller]
    pub fn object(&self) -> Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("{error} in {:?}, stderr: {}", self.stdout, self.stderr))
    }

    /// The run has to have failed with exit code 1 and a message with all these parts.
    #[track_caller]
    pub fn fails_with_any(&self, parts: &[&str]) {
        assert_eq!(self.code, Some(1), "stderr: {}", self.stderr);
        for part in parts {
            assert!(
                self.stderr.contains(part),
                "no {part:?} in: {}",
                self.stderr
            );
        }
        assert!(
            self.stderr.contains("error: "),
            "no error in: {}",
            self.stderr
        );
    }

    /// The run has to have failed with exit code 1, a message with all these parts, and a hint.
    #[track_caller]
    pub fn fails_with(&self, parts: &[&str]) {
        self.fails_with_any(parts);
        assert!(
            self.stderr.contains("\n  hint: "),
            "no hint in: {}",
            self.stderr
        );
    }
}

/// The subcommands that the help lists, `help` apart.
pub fn subcommands() -> Vec<String> {
    let help = meshloom(Path::new("."), "--help").done().stdout;
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    commands
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(String::from)
        .collect()
}

/// A run that goes on, its JSON lines one by one. It ends with the value.
pub struct Lines {
    child: std::process::Child,
    lines: std::sync::mpsc::Receiver<Value>,
}

impl Lines {
    /// Starts the command.
    pub fn of(mut command: Command) -> Self {
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the binary starts");
        let stdout = child.stdout.take().expect("a pipe");
        let (sender, lines) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            for line in
                std::io::BufRead::lines(std::io::BufReader::new(stdout)).map_while(Result::ok)
            {
                let value = serde_json::from_str(&line)
                    .unwrap_or_else(|error| panic!("{error} in {line:?}"));
                if sender.send(value).is_err() {
                    return;
                }
            }
        });
        Lines { child, lines }
    }

    /// The next line; `None` when none comes for a long time or the run has ended.
    pub fn next(&mut self) -> Option<Value> {
        self.lines
            .recv_timeout(std::time::Duration::from_secs(60))
            .ok()
    }

    /// The next line, if it comes soon.
    pub fn soon(&mut self) -> Option<Value> {
        let soon = std::time::Duration::from_millis(500);
        self.lines.recv_timeout(soon).ok()
    }

    /// The next line that `wanted` accepts.
    pub fn find(&mut self, wanted: impl Fn(&Value) -> bool) -> Option<Value> {
        std::iter::from_fn(|| self.next()).find(|line| wanted(line))
    }

    /// Whether the run has ended by itself.
    pub fn ended(&mut self) -> bool {
        self.child.try_wait().expect("the child is ours").is_some()
    }

    /// The most memory that the run has held so far, in bytes; 0 where the system does not say.
    pub fn peak_memory(&self) -> usize {
        let status = format!("/proc/{}/status", self.child.id());
        let text = std::fs::read_to_string(status).unwrap_or_default();
        let peak = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = peak.map(|peak| peak.trim().trim_end_matches(" kB").parse());
        kilobytes
            .and_then(Result::ok)
            .map_or(0, |peak: usize| 1024 * peak)
    }

    /// Asks the run to end and waits until it has.
    pub fn terminate(mut self) {
        let id = self.child.id().to_string();
        let asked = Command::new("kill").args(["-TERM", &id]).status();
        assert!(asked.is_ok_and(|status| status.success()));
        let _ = self.child.wait();
    }

    /// Ends the run without a warning, as a power cut would.
    pub fn kill(mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The names of an object's entries, sorted.
pub fn keys(object: &Value) -> Vec<&str> {
    let map = object.as_object().expect("an object");
    let mut keys: Vec<&str> = map.keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

/// Every file below `folder` with its content, hidden ones too: what has to be the same before and after
/// a run that fails.
pub fn everything(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        for entry in entries {
            let path = entry.expect("an entry").path();
            if path.is_dir() && !path.is_symlink() {
                found.push((path.clone(), b"folder".to_vec()));
                folders.push(path);
            } else {
                found.push((path.clone(), std::fs::read(&path).unwrap_or_default()));
            }
        }
    }
    found.sort();
    found
}

/// The folder of real captures beside the checkout, if it is there.
pub fn real_captures() -> Option<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    if folder.is_dir() {
        return Some(folder.to_path_buf());
    }
    println!("skipped: no real captures");
    None
}
