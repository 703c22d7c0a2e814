//! A view without a place to show it: what scripts drive.

use std::path::Path;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::action::{Action, View};
use super::reload::Source;
use super::script::{Line, Step};
use super::shot::Shot;
use super::stage::Stage;
use crate::error::{Error, Result, locked};
use crate::film::{Window, check_apart};
use crate::render::progressive::{self, Framebuffer, Viewer};
use crate::render::{Progress, RenderOutput};

/// Writes a picture: path, picture, stops by which files of levels are brightened.
pub type Save<'a> = &'a (dyn Fn(&Path, &Shot, f32) -> Result<()> + Sync);

/// A scene, a view of it and the picture made last.
pub struct Studio<'a> {
    /// What is looked at.
    pub stage: Arc<dyn Stage>,
    /// From where, and how.
    pub view: View,
    /// Where the scene came from.
    pub source: &'a Source,
    /// Writes pictures.
    pub save: Save<'a>,
    /// Asked while rendering.
    pub stopped: fn() -> bool,
}

/// Stops after a time, but not before the first blocks are there.
struct Clock {
    start: Instant,
    limit: Option<Duration>,
    /// Seconds to the first blocks.
    first: Mutex<Option<f64>>,
    has_first: AtomicBool,
    stopped: fn() -> bool,
}

impl Clock {
    fn new(limit: Option<Duration>, stopped: fn() -> bool) -> Self {
        Self { start: Instant::now(), limit, first: Mutex::new(None), has_first: AtomicBool::new(false), stopped }
    }
}

impl Progress for Clock {
    fn tile_done(&self, _: u64) {}
    fn stopped(&self) -> bool {
        let late = self.limit.is_some_and(|limit| self.start.elapsed() >= limit);
        (late && self.has_first.load(Ordering::Relaxed)) || (self.stopped)()
    }
}

impl Viewer for Clock {
    fn painted(&self, _: &Framebuffer, _: Window) {}
    fn step_done(&self, _: &Framebuffer, _: progressive::Step) {
        if !self.has_first.swap(true, Ordering::Relaxed) {
            let mut first = locked(&self.first);
            *first = Some(self.start.elapsed().as_secs_f64());
        }
    }
}

/// A picture and when its first blocks were there.
struct Made {
    output: RenderOutput,
    first_seconds: Option<f64>,
}

impl Studio<'_> {
    /// Runs a script on the current rayon pool; `tell` gets an object for each command that has something to say.
    ///
    /// # Errors
    /// The first command that cannot be done, with its line; [`Error::Interrupted`] when stopped.
    pub fn run(&mut self, file: &Path, lines: &[Line], tell: &dyn Fn(&Value) -> Result<()>) -> Result<()> {
        let mut last: Option<Shot> = None;
        for Line { line, step } in lines {
            if (self.stopped)() {
                return Err(Error::Interrupted);
            }
            let placed = |error: Error| match error {
                Error::Usage(what) => Error::at_line(file, *line, 1, what),
                other => other,
            };
            let said = self.step(step, &mut last).map_err(placed)?;
            if let Some(mut said) = said {
                said["line"] = json!(line);
                tell(&said)?;
            }
        }
        Ok(())
    }

    fn step(&mut self, step: &Step, last: &mut Option<Shot>) -> Result<Option<Value>> {
        Ok(match step {
            Step::Do(action) => {
                self.view.apply(action, &*self.stage)?;
                None
            }
            Step::Wait => Some(self.shown("wait", None, last)?),
            Step::Frame(limit) => Some(self.shown("frame", Some(milliseconds(*limit)), last)?),
            Step::Spin(frames, degrees, limit) => Some(self.spin(*frames, *degrees, *limit)?),
            Step::Click(x, y) => {
                let picked = self.stage.pick(&self.view.look, *x, *y)?;
                Some(json!({ "command": "click", "x": x, "y": y, "hit": picked }))
            }
            Step::Save(path) => {
                let Some(shot) = last else {
                    return Err(Error::Usage("nothing to save: expected `wait` or `frame` before".into()));
                };
                check_apart(path, &self.stage.description().inputs())?;
                (self.save)(path, shot, self.view.exposure)?;
                None
            }
            Step::Reload(_) if !self.source.is_watched() => {
                return Err(Error::Usage("the scene has no file that could change".into()));
            }
            Step::Reload(seconds) => Some(self.reload("reload", Duration::from_secs_f64(*seconds), last)?),
            Step::Set(name, value) => {
                self.source.set(name, *value);
                Some(self.reload("set", Duration::ZERO, last)?)
            }
        })
    }

    fn picture(&self, limit: Option<Duration>) -> Result<Made> {
        let clock = Clock::new(limit, self.stopped);
        let output = self.stage.render(&self.view.look, &clock, &clock)?;
        let first = clock.first.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
        Ok(Made { output, first_seconds: first })
    }

    fn shot(&self, output: RenderOutput) -> Shot {
        Shot::new(output, &self.view.look, &*self.stage)
    }

    fn shown(&self, command: &str, limit: Option<Duration>, last: &mut Option<Shot>) -> Result<Value> {
        let Made { output, first_seconds } = self.picture(limit)?;
        let seconds = output.seconds;
        let said = json!({
            "command": command,
            "complete": output.is_complete(),
            "seconds": seconds,
            "first_picture_seconds": first_seconds,
            "rays": output.rays.total(),
            "mrays_per_s": output.rays.total() as f64 / seconds.max(f64::MIN_POSITIVE) / 1e6,
        });
        *last = Some(self.shot(output));
        if (self.stopped)() { Err(Error::Interrupted) } else { Ok(said) }
    }

    fn spin(&mut self, frames: u32, degrees: f64, limit: f64) -> Result<Value> {
        let limit = (limit > 0.0).then(|| milliseconds(limit));
        let (clock, mut complete, mut rays) = (Instant::now(), 0u32, 0);
        for _ in 0..frames {
            self.view.apply(&Action::Orbit(degrees, 0.0), &*self.stage)?;
            let made = self.picture(limit)?;
            complete += u32::from(made.output.is_complete());
            rays += made.output.rays.total();
            if (self.stopped)() {
                return Err(Error::Interrupted);
            }
        }
        let seconds = clock.elapsed().as_secs_f64().max(f64::MIN_POSITIVE);
        Ok(json!({
            "command": "spin",
            "frames": frames,
            "complete_frames": complete,
            "frames_per_second": f64::from(frames) / seconds,
            "mrays_per_s": rays as f64 / seconds / 1e6,
        }))
    }

    /// Waits for a change, opens the scene anew, and makes the first picture of it. An error keeps what there was.
    fn reload(&mut self, command: &str, patience: Duration, last: &mut Option<Shot>) -> Result<Value> {
        let limit = Instant::now() + patience;
        loop {
            let Some(changed) = self.source.wait(limit, self.stopped) else {
                return Ok(json!({ "command": command, "changed": false }));
            };
            let clock = Instant::now();
            let opened = self.source.open(Some(&*self.stage)).and_then(|new| {
                new.iter().try_for_each(|stage| self.view.check(&**stage))?;
                Ok(new)
            });
            let stage = match opened {
                // A file was written, but the scene is what it was.
                Ok(None) => continue,
                Ok(Some(stage)) => stage,
                Err(error) => {
                    return Ok(json!({ "command": command, "changed": false, "error": error.to_string() }));
                }
            };
            self.stage = stage;
            let open_seconds = clock.elapsed().as_secs_f64();
            let made = self.picture(None)?;
            let first = made.first_seconds.unwrap_or(made.output.seconds);
            let since_save = changed.elapsed().as_secs_f64() - (made.output.seconds - first);
            *last = Some(self.shot(made.output));
            return Ok(json!({
                "command": command,
                "changed": true,
                "open_seconds": open_seconds,
                "build_seconds": self.stage.build_seconds(),
                "first_picture_seconds": first,
                "save_to_picture_seconds": since_save,
            }));
        }
    }
}

fn milliseconds(limit: f64) -> Duration {
    Duration::from_secs_f64(limit / 1e3)
}
