//! A binary call under watch: how long it took and the most memory it held.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::Ended;

/// A call that ended, with what it took.
pub struct Watched {
    /// What it said.
    pub ended: Ended,
    /// Wall clock, seconds.
    pub seconds: f64,
    /// Largest resident memory, bytes; `None` where the system does not tell.
    pub peak: Option<u64>,
}

/// A running binary whose output is read as it comes.
pub struct Running {
    child: Child,
    out: JoinHandle<String>,
    err: JoinHandle<String>,
    start: Instant,
    peak: Option<u64>,
}

impl Running {
    /// Starts `lanecast` with `arguments` in `folder`.
    pub fn start(folder: &Path, arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lanecast"));
        command.args(arguments).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the binary runs");
        let (out, err) = (reader(child.stdout.take().expect("piped")), reader(child.stderr.take().expect("piped")));
        Self { child, out, err, start: Instant::now(), peak: None }
    }

    /// Process number.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits for the end; a process that takes longer than `limit` is killed and fails the test.
    pub fn wait(mut self, limit: Duration) -> Watched {
        let status = loop {
            // The peak is gone with the process: the last look before its end counts.
            self.peak = peak(self.id()).max(self.peak);
            if let Some(status) = self.child.try_wait().expect("a child") {
                break status;
            }
            if self.start.elapsed() > limit {
                self.child.kill().expect("a child");
                self.child.wait().expect("a child");
                panic!("not done after {limit:?}: {}", self.err.join().expect("stderr"));
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        let seconds = self.start.elapsed().as_secs_f64();
        let (out, err) = (self.out.join().expect("stdout"), self.err.join().expect("stderr"));
        Watched { ended: Ended { code: status.code(), out, err }, seconds, peak: self.peak }
    }
}

/// Waits until process `id` takes Ctrl-C itself, where the system tells, so that an interruption does not come before the program
/// has begun.
pub fn until_it_listens(id: u32) {
    // Signals taken are the bits of a number in hexadecimal; 2 is Ctrl-C.
    let listens = |status: &str| {
        let taken = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        taken.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok()).is_some_and(|bits| bits & 2 != 0)
    };
    let start = Instant::now();
    while std::fs::read_to_string(format!("/proc/{id}/status")).is_ok_and(|status| !listens(&status)) {
        assert!(start.elapsed() < Duration::from_secs(30), "Ctrl-C is not taken");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Runs `lanecast` to its end.
pub fn watch(folder: &Path, arguments: &[&str], limit: Duration) -> Watched {
    Running::start(folder, arguments).wait(limit)
}

fn reader(mut pipe: impl Read + Send + 'static) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        pipe.read_to_end(&mut bytes).expect("a pipe");
        String::from_utf8(bytes).expect("UTF-8")
    })
}

/// `VmHWM` of a process, bytes.
fn peak(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? << 10)
}
