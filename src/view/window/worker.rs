//! The thread that makes a window's pictures.
//!
//! While the view changes, a frame is given a thirtieth of a second: it is then shown as far as it got, in blocks where it
//! got no further, and the next one starts. Once nothing changes the frame goes on until it is finished.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use super::screen::Screen;
use crate::error::locked;
use crate::film::Window;
use crate::render::progressive::{Framebuffer, Step, Viewer};
use crate::render::{Progress, RenderOutput};
use crate::view::action::View;
use crate::view::levels::Levels;
use crate::view::shot::Shot;
use crate::view::stage::Stage;

/// Time of a frame while the view changes, and between two looks at one that goes on.
const FRAME: Duration = Duration::from_millis(33);

/// What is to be shown.
#[derive(Clone)]
pub struct Wanted {
    /// The scene.
    pub stage: Arc<dyn Stage>,
    /// From where, and how.
    pub view: View,
}

/// What was made of it so far.
#[derive(Clone, Default)]
pub struct Shown {
    /// The picture.
    pub screen: Screen,
    /// What is saved of it, once it is as finished as it gets.
    pub shot: Option<Arc<Shot>>,
    /// Share of the batches that are done.
    pub progress: f64,
    /// Million rays per second of the last frame, shading included.
    pub mrays_per_s: f64,
    /// Seconds to the first blocks of the last frame.
    pub first_seconds: f64,
    /// What went wrong with the view, if anything.
    pub error: Option<String>,
}

/// What the window and the worker share.
pub struct Shared {
    wanted: Mutex<Wanted>,
    changed: Condvar,
    /// Counts changes of what is wanted.
    generation: AtomicU64,
    quit: AtomicBool,
    shown: Mutex<Shown>,
    /// Called when there is something new to see.
    wake: Box<dyn Fn() + Send + Sync>,
    levels: Levels,
}

impl Shared {
    /// Nothing is shown yet; `wake` is called from the worker's threads.
    pub fn new(wanted: Wanted, wake: Box<dyn Fn() + Send + Sync>) -> Self {
        Self {
            wanted: Mutex::new(wanted),
            changed: Condvar::new(),
            generation: AtomicU64::new(1),
            quit: AtomicBool::new(false),
            shown: Mutex::default(),
            wake,
            levels: Levels::default(),
        }
    }

    /// What is wanted now.
    pub fn wanted(&self) -> Wanted {
        locked(&self.wanted).clone()
    }

    /// Changes what is wanted; the worker starts anew.
    pub fn change<R>(&self, how: impl FnOnce(&mut Wanted) -> R) -> R {
        let mut wanted = locked(&self.wanted);
        let result = how(&mut wanted);
        self.generation.fetch_add(1, Ordering::SeqCst);
        self.changed.notify_all();
        result
    }

    /// Ends the worker.
    pub fn quit(&self) {
        self.quit.store(true, Ordering::SeqCst);
        let _held = locked(&self.wanted);
        self.changed.notify_all();
    }

    /// Whether the window is closing.
    pub fn is_quitting(&self) -> bool {
        self.quit.load(Ordering::SeqCst)
    }

    /// Looks at what is shown.
    pub fn look<R>(&self, eye: impl FnOnce(&Shown) -> R) -> R {
        eye(&locked(&self.shown))
    }

    /// Makes pictures of what is wanted until [`Self::quit`], on `pool`.
    pub fn work(&self, pool: &rayon::ThreadPool) {
        let mut done = 0;
        loop {
            let (wanted, generation) = {
                let mut wanted = locked(&self.wanted);
                while self.generation.load(Ordering::SeqCst) == done && !self.is_quitting() {
                    wanted = self.changed.wait(wanted).unwrap_or_else(|poisoned| poisoned.into_inner());
                }
                (wanted.clone(), self.generation.load(Ordering::SeqCst))
            };
            if self.is_quitting() {
                return;
            }
            done = generation;
            let frame = Frame::new(self, generation, wanted.view.exposure);
            match pool.install(|| wanted.stage.render(&wanted.view.look, &frame, &frame)) {
                Ok(output) => self.finished(output, &wanted, &frame),
                Err(error) => locked(&self.shown).error = Some(error.to_string()),
            }
            (self.wake)();
        }
    }

    fn finished(&self, output: RenderOutput, wanted: &Wanted, frame: &Frame<'_>) {
        let progress = output.tiles_done as f64 / output.tiles_total.max(1) as f64;
        let shot = Arc::new(Shot::new(output, &wanted.view.look, &*wanted.stage));
        let shown = &mut *locked(&self.shown);
        let window = shot.film.window;
        shown.screen.show(&shot.film, frame.exposure, &self.levels, |x, y| window.index(x, y));
        shown.progress = progress;
        shown.mrays_per_s = shot.rays as f64 / shot.seconds.max(f64::MIN_POSITIVE) / 1e6;
        shown.shot = Some(shot);
        shown.error = None;
    }
}

/// One picture in the making.
struct Frame<'a> {
    shared: &'a Shared,
    generation: u64,
    exposure: f32,
    start: Instant,
    has_first: AtomicBool,
    done: AtomicU64,
    total: AtomicU64,
    last_look: Mutex<Instant>,
}

impl<'a> Frame<'a> {
    fn new(shared: &'a Shared, generation: u64, exposure: f32) -> Self {
        let start = Instant::now();
        let (done, total) = (AtomicU64::new(0), AtomicU64::new(0));
        let last_look = Mutex::new(start);
        Self { shared, generation, exposure, start, has_first: AtomicBool::new(false), done, total, last_look }
    }

    /// Whether something else is wanted by now.
    fn is_outdated(&self) -> bool {
        self.shared.generation.load(Ordering::Relaxed) != self.generation
    }

    /// Shows the picture as it is.
    fn publish(&self, frame: &Framebuffer) {
        let shown = &mut *locked(&self.shared.shown);
        shown.screen.show(frame.film(), self.exposure, &self.shared.levels, |x, y| frame.shown(x, y));
        let total = self.total.load(Ordering::Relaxed).max(1);
        shown.progress = self.done.load(Ordering::Relaxed) as f64 / total as f64;
        (self.shared.wake)();
    }
}

impl Progress for Frame<'_> {
    fn tile_done(&self, total: u64) {
        self.total.store(total, Ordering::Relaxed);
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    fn stopped(&self) -> bool {
        let late = self.is_outdated() && self.has_first.load(Ordering::Relaxed) && self.start.elapsed() >= FRAME;
        late || self.shared.is_quitting()
    }
}

impl Viewer for Frame<'_> {
    fn painted(&self, frame: &Framebuffer, _: Window) {
        if !self.has_first.load(Ordering::Relaxed) {
            return;
        }
        let mut last = locked(&self.last_look);
        if last.elapsed() >= FRAME {
            self.publish(frame);
            *last = Instant::now();
        }
    }

    fn step_done(&self, frame: &Framebuffer, _: Step) {
        if !self.has_first.swap(true, Ordering::Relaxed) {
            locked(&self.shared.shown).first_seconds = self.start.elapsed().as_secs_f64();
            // While one moves, the frame's end is seen soon enough.
            if !self.is_outdated() {
                self.publish(frame);
            }
        }
    }
}
