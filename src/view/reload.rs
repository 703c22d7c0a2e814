//! Scenes that are opened anew when one of their files changes, or one of their parameters is set.
//!
//! A scene refers to files of its own folder, so that folder is watched as a whole; whether a change matters is told by the
//! scene's hash, which covers every file that determines it.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use notify::event::{AccessKind, AccessMode, ModifyKind};
use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher};

use super::stage::Stage;
use crate::error::{Error, Result, locked};
use crate::scene::parameter::Parameter;

/// A save is over when nothing happened for so long: editors write in several steps.
const QUIET: Duration = Duration::from_millis(5);
/// Changes that do not end (a slider is dragged) are taken up after so long.
const PATIENCE: Duration = Duration::from_millis(30);
/// A file that is being written is waited for so long, where the system tells when it is closed. Many editors empty a file
/// before they write it, and an empty scene is a scene.
const CLOSING: Duration = Duration::from_secs(1);
/// Whether the system tells when a file that was written is closed.
const CLOSES_ARE_TOLD: bool = cfg!(any(target_os = "linux", target_os = "android"));
/// Time between two looks at whether to stop.
const POLL: Duration = Duration::from_millis(20);

/// Name and value of a parameter, as `--set` gives them.
pub type Setting = (String, String);

/// Opens the scene with the parameters set, and the one before to build upon; `None` if it is the same.
pub type Open = Box<dyn Fn(&[Setting], Option<&dyn Stage>) -> Result<Option<Arc<dyn Stage>>> + Send + Sync>;

/// What has happened.
enum Change {
    /// A parameter was set, or a file is there, gone, or another.
    Made,
    /// Something was written to a file, and more may follow.
    Written(PathBuf),
    /// A file that could be written was closed.
    Closed(PathBuf),
}

/// Where a scene comes from.
pub struct Source {
    open: Open,
    settings: Mutex<Vec<Setting>>,
    changed: Sender<(Instant, Change)>,
    changes: Mutex<Receiver<(Instant, Change)>>,
    /// Watches the files; it ends with this.
    watcher: Option<RecommendedWatcher>,
}

impl Source {
    /// A scene that `open` opens; `file` is its file, if it has one that can change.
    ///
    /// # Errors
    /// What the system says if it cannot watch the file's folder.
    pub fn new(open: Open, file: Option<&Path>) -> Result<Self> {
        let (changed, changes) = channel();
        let watcher = file.map(|file| watch(file, changed.clone())).transpose()?;
        Ok(Self { open, settings: Mutex::default(), changed, changes: Mutex::new(changes), watcher })
    }

    /// Opens the scene, reusing what it can of `before`; `None` if it has not changed.
    ///
    /// # Errors
    /// Those of opening.
    pub fn open(&self, before: Option<&dyn Stage>) -> Result<Option<Arc<dyn Stage>>> {
        let settings = locked(&self.settings).clone();
        (self.open)(&settings, before)
    }

    /// Gives parameter `name` another value, which counts as a change.
    pub fn set(&self, name: &str, value: f64) {
        let mut settings = locked(&self.settings);
        settings.retain(|(known, _)| known != name);
        settings.push((name.into(), value.to_string()));
        // The receiver lives as long as the sender.
        let _always = self.changed.send((Instant::now(), Change::Made));
    }

    /// Takes back what was set.
    pub fn unset(&self) {
        locked(&self.settings).clear();
        let _always = self.changed.send((Instant::now(), Change::Made));
    }

    /// The parameters of `stage` as they are wanted by now.
    pub fn parameters(&self, stage: &dyn Stage) -> Vec<Parameter> {
        let settings = locked(&self.settings);
        let wanted = |parameter: &Parameter| {
            let set = settings.iter().find(|(name, _)| *name == parameter.name);
            let value = set.and_then(|(_, text)| text.parse().ok()).unwrap_or(parameter.value);
            Parameter { value, ..parameter.clone() }
        };
        stage.description().parameters.iter().map(wanted).collect()
    }

    /// Waits until a file in the scene's folder has changed or a parameter is set: when that was noticed first, or `None`
    /// at `limit` or when `stopped` says so.
    pub fn wait(&self, limit: Instant, stopped: fn() -> bool) -> Option<Instant> {
        let changes = locked(&self.changes);
        loop {
            let left = limit.saturating_duration_since(Instant::now());
            match changes.recv_timeout(left.min(POLL)) {
                Ok((first, change)) => {
                    let mut unfinished = HashSet::new();
                    change.note(&mut unfinished);
                    loop {
                        let (patience, quiet) =
                            if unfinished.is_empty() { (PATIENCE, QUIET) } else { (CLOSING, CLOSING) };
                        let left = patience.saturating_sub(first.elapsed());
                        let Ok((_, change)) = changes.recv_timeout(left.min(quiet)) else { break };
                        change.note(&mut unfinished);
                    }
                    return Some(first);
                }
                Err(RecvTimeoutError::Timeout) if left > Duration::ZERO && !stopped() => {}
                Err(_) => return None,
            }
        }
    }

    /// Whether the scene has a file that can change.
    pub fn is_watched(&self) -> bool {
        self.watcher.is_some()
    }
}

impl Change {
    /// Keeps the files that are being written.
    fn note(self, unfinished: &mut HashSet<PathBuf>) {
        match self {
            Self::Written(file) if CLOSES_ARE_TOLD => unfinished.insert(file),
            Self::Closed(file) => unfinished.remove(&file),
            Self::Made | Self::Written(_) => false,
        };
    }
}

fn watch(file: &Path, sender: Sender<(Instant, Change)>) -> Result<RecommendedWatcher> {
    let failed = |e: notify::Error| Error::io(file, std::io::Error::other(e));
    let changed = move |event: notify::Result<Event>| {
        let Ok(event) = event else { return };
        let change: fn(PathBuf) -> Change = match event.kind {
            EventKind::Modify(ModifyKind::Data(_)) => Change::Written,
            EventKind::Access(AccessKind::Close(AccessMode::Write)) => Change::Closed,
            EventKind::Create(_) | EventKind::Modify(_) | EventKind::Remove(_) | EventKind::Any => |_| Change::Made,
            EventKind::Access(_) | EventKind::Other => return,
        };
        for path in event.paths {
            // Nobody listens any more: the view is closing.
            let _closed = sender.send((Instant::now(), change(path)));
        }
    };
    let mut watcher = notify::recommended_watcher(changed).map_err(failed)?;
    let folder = match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    watcher.watch(folder, RecursiveMode::Recursive).map_err(failed)?;
    Ok(watcher)
}
