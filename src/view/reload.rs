//! Scenes that are opened anew when one of their files changes.
//!
//! A scene refers to files of its own folder, so that folder is watched as a whole; whether a change matters is told by the
//! scene's hash, which covers every file that determines it.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher};

use super::stage::Stage;
use crate::error::{Error, Result};

/// A save is over when nothing happened for so long: editors write in several steps.
const QUIET: Duration = Duration::from_millis(5);
/// Time between two looks at whether to stop.
const POLL: Duration = Duration::from_millis(20);

/// Opens the scene, with the one before to build upon; `None` if it is the same.
pub type Open = Box<dyn Fn(Option<&dyn Stage>) -> Result<Option<Arc<dyn Stage>>> + Send + Sync>;

/// Where a scene comes from.
pub struct Source {
    open: Open,
    watch: Option<Watch>,
}

struct Watch {
    /// Kept alive: it ends with this.
    _watcher: RecommendedWatcher,
    events: Mutex<Receiver<Instant>>,
    file: PathBuf,
}

impl Source {
    /// A scene that `open` opens; `file` is its file, if it has one that can change.
    ///
    /// # Errors
    /// What the system says if it cannot watch the file's folder.
    pub fn new(open: Open, file: Option<&Path>) -> Result<Self> {
        Ok(Self { open, watch: file.map(watch).transpose()? })
    }

    /// Opens the scene, reusing what it can of `before`; `None` if it has not changed.
    ///
    /// # Errors
    /// Those of opening.
    pub fn open(&self, before: Option<&dyn Stage>) -> Result<Option<Arc<dyn Stage>>> {
        (self.open)(before)
    }

    /// Waits until a file in the scene's folder has changed: when it was noticed first, or `None` at `limit` or when
    /// `stopped` says so.
    ///
    /// # Errors
    /// A usage error if the scene has no file.
    pub fn wait(&self, limit: Instant, stopped: fn() -> bool) -> Result<Option<Instant>> {
        let Some(watch) = &self.watch else {
            return Err(Error::Usage("the scene has no file that could change".into()));
        };
        let events = watch.events.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        loop {
            let left = limit.saturating_duration_since(Instant::now());
            match events.recv_timeout(left.min(POLL)) {
                Ok(first) => {
                    while events.recv_timeout(QUIET).is_ok() {}
                    return Ok(Some(first));
                }
                Err(RecvTimeoutError::Timeout) if left > Duration::ZERO && !stopped() => {}
                Err(RecvTimeoutError::Timeout) => return Ok(None),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Error::io(&watch.file, std::io::Error::other("the system watches it no longer")));
                }
            }
        }
    }

    /// Whether the scene can change.
    pub fn is_watched(&self) -> bool {
        self.watch.is_some()
    }
}

fn watch(file: &Path) -> Result<Watch> {
    let failed = |e: notify::Error| Error::io(file, std::io::Error::other(e));
    let (sender, events) = channel();
    let changed = move |event: notify::Result<Event>| {
        let matters = |event: &Event| {
            matches!(event.kind, EventKind::Create(_) | EventKind::Modify(_) | EventKind::Remove(_) | EventKind::Any)
        };
        if event.as_ref().is_ok_and(matters) {
            // Nobody listens any more: the view is closing.
            let _closed = sender.send(Instant::now());
        }
    };
    let mut watcher = notify::recommended_watcher(changed).map_err(failed)?;
    let folder = match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    watcher.watch(folder, RecursiveMode::Recursive).map_err(failed)?;
    Ok(Watch { _watcher: watcher, events: Mutex::new(events), file: file.into() })
}
