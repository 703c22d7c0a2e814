//! A native window to walk around in a scene.

mod input;
pub mod live;
mod panel;
mod screen;
mod surface;
mod worker;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::WindowId;

use super::action::Action;
use super::reload::Source;
use super::studio::{Save, Studio};
use crate::error::{Error, Result, locked};
use input::{HELP, Pointer, Request};
use screen::{LINE, Screen};
use surface::Surface;
use worker::{Shared, Wanted};

/// Largest side of a window that is rendered at its full size, pixels.
const MAX_SIDE: u32 = 8192;
/// Time that the wait for changed files is asked again whether the window is closing.
const WATCH: Duration = Duration::from_millis(200);

/// Something new is to be seen.
#[derive(Debug)]
struct Wake;

/// Opens a window on what `studio` shows and stays until it is closed. Must run on the main thread; pictures are made on
/// `pool`. Pictures saved by key go to the current folder as `name` with a number.
///
/// # Errors
/// A usage error if there is no display; what the system says if it refuses a window.
pub fn open(studio: Studio<'_>, pool: &rayon::ThreadPool, name: &str) -> Result<()> {
    let refused = |e: &dyn std::fmt::Display| {
        Error::Usage(format!("no window: {e}; --headless-script FILE needs no display, render writes files"))
    };
    let event_loop = EventLoop::<Wake>::with_user_event().build().map_err(|e| refused(&e))?;
    let proxy = event_loop.create_proxy();
    // A closed loop needs no waking.
    let wake = move || drop(proxy.send_event(Wake));
    let wanted = Wanted { stage: studio.stage.clone(), view: studio.view.clone() };
    let shared = Shared::new(wanted, Box::new(wake));
    let message = std::sync::Mutex::new(None);
    let mut app = App {
        shared: &shared,
        source: studio.source,
        save: studio.save,
        name,
        shown: None,
        pointer: Pointer::default(),
        text: true,
        help: false,
        sliders: false,
        sliding: None,
        message: &message,
        failure: None,
    };
    std::thread::scope(|scope| {
        scope.spawn(|| shared.work(pool));
        scope.spawn(|| watch(&studio, &shared, pool, &message));
        let ended = event_loop.run_app(&mut app);
        shared.quit();
        ended.map_err(|e| refused(&e))
    })?;
    app.failure.map_or(Ok(()), |what| Err(refused(&what)))
}

/// Opens the scene anew whenever its files change or a slider moves; an error is shown while the last good scene stays.
fn watch(studio: &Studio<'_>, shared: &Shared, pool: &rayon::ThreadPool, message: &std::sync::Mutex<Option<String>>) {
    let tell = |what: Option<String>| *locked(message) = what;
    while !shared.is_quitting() {
        if studio.source.wait(Instant::now() + WATCH, studio.stopped).is_none() {
            continue;
        }
        let before = shared.wanted().stage;
        match pool.install(|| studio.source.open(Some(&*before))) {
            Ok(Some(stage)) => {
                let shown = shared.change(|wanted| {
                    wanted.view.check(&*stage)?;
                    wanted.stage = stage;
                    Ok::<_, Error>(())
                });
                tell(shown.err().map(|error| error.to_string()));
            }
            // As it was: an error before it is put right.
            Ok(None) => {
                tell(None);
                shared.change(|_| ());
            }
            Err(error) => {
                tell(Some(error.to_string()));
                shared.change(|_| ());
            }
        }
    }
}

struct App<'a> {
    shared: &'a Shared,
    source: &'a Source,
    save: Save<'a>,
    name: &'a str,
    shown: Option<Surface>,
    pointer: Pointer,
    /// Whether the status line is shown, and the help.
    text: bool,
    help: bool,
    sliders: bool,
    /// The slider that is dragged.
    sliding: Option<usize>,
    /// What was said last: a hit, an error.
    message: &'a std::sync::Mutex<Option<String>>,
    failure: Option<String>,
}

impl App<'_> {
    fn say(&self, what: Option<String>) {
        *locked(self.message) = what;
    }

    fn redraw(&self) {
        if let Some(surface) = &self.shown {
            surface.request_redraw();
        }
    }

    fn handle(&mut self, request: Request, event_loop: &ActiveEventLoop) {
        match request {
            Request::Do(action) => {
                let done = self.shared.change(|wanted| wanted.view.apply(&action, &*wanted.stage));
                if let Err(error) = done {
                    self.say(Some(error.to_string()));
                }
            }
            Request::MoreSamples(more) => {
                let now = self.shared.wanted().view.look.options.spp;
                let spp = if more { now.saturating_mul(2) } else { (now / 2).max(1) };
                return self.handle(Request::Do(Action::Samples(spp)), event_loop);
            }
            Request::Pick(x, y) => self.pick(x, y),
            Request::Save(extension) => self.save_as(extension),
            Request::Sliders => self.sliders = !self.sliders,
            Request::Unset => self.source.unset(),
            Request::Text => self.text = !self.text,
            Request::Help => self.help = !self.help,
            Request::Quit => event_loop.exit(),
        }
        self.redraw();
    }

    /// The left button goes down: whether that is on a slider, which then follows the pointer.
    fn grabs_slider(&mut self) -> bool {
        let (x, y) = self.pointer.place();
        let count = self.shared.wanted().stage.description().parameters.len();
        self.sliding = if self.sliders { panel::slider_at(x, y, count) } else { None };
        self.slide();
        self.sliding.is_some()
    }

    /// Sets what the dragged slider sets.
    fn slide(&self) {
        let parameters = self.source.parameters(&*self.shared.wanted().stage);
        if let Some(parameter) = self.sliding.and_then(|slider| parameters.get(slider)) {
            let value = parameter.at(panel::share_at(self.pointer.place().0));
            if value != parameter.value {
                self.source.set(&parameter.name, value);
                self.redraw();
            }
        }
    }

    fn pick(&self, x: f64, y: f64) {
        let Wanted { stage, view } = self.shared.wanted();
        self.say(Some(match stage.pick(&view.look, x.max(0.0) as u32, y.max(0.0) as u32) {
            Ok(Some(hit)) => {
                let [nx, ny, nz] = hit.normal;
                format!(
                    "t {:.6} (distance {:.6}), instance {} `{}`, primitive {}, material `{}`, normal {nx:.4} {ny:.4} \
                     {nz:.4}, {} nodes, {} leaves, {} tests",
                    hit.t,
                    hit.distance,
                    hit.instance,
                    hit.object,
                    hit.primitive,
                    hit.material,
                    hit.nodes,
                    hit.leaves,
                    hit.tests
                )
            }
            Ok(None) => "nothing there".into(),
            Err(error) => error.to_string(),
        }));
    }

    fn save_as(&self, extension: &str) {
        let Some(shot) = self.shared.look(|shown| shown.shot.clone()) else { return };
        let free = |n: u32| PathBuf::from(format!("{}-{n:03}.{extension}", self.name));
        let Some(path) = (1..1000).map(free).find(|path| !Path::exists(path)) else {
            return self.say(Some("999 pictures are saved already".into()));
        };
        let saved = (self.save)(&path, &shot, self.shared.wanted().view.exposure);
        self.say(Some(saved.map_or_else(|e| e.to_string(), |()| format!("{} saved", path.display()))));
    }

    fn resized(&self, size: PhysicalSize<u32>) {
        let sides = (size.width.clamp(1, MAX_SIDE), size.height.clamp(1, MAX_SIDE));
        let options = self.shared.wanted().view.look.options;
        if (options.width, options.height) != sides {
            self.shared.change(|wanted| {
                let options = &mut wanted.view.look.options;
                (options.width, options.height) = sides;
            });
        }
        self.redraw();
    }

    /// The picture with its text.
    fn composed(&self) -> Screen {
        let mut screen = self.shared.look(|shown| shown.screen.clone());
        if self.help {
            screen.write(0, &HELP);
        } else if self.sliders {
            panel::draw(&mut screen, &self.source.parameters(&*self.shared.wanted().stage));
        }
        if !self.text {
            return screen;
        }
        let view = self.shared.wanted().view;
        let (options, heat) = (&view.look.options, view.look.heat.map_or("", super::heat::Heat::name));
        let status = self.shared.look(|shown| {
            let error = shown.error.as_deref().map_or(String::new(), |e| format!("  {e}"));
            format!(
                "{}  {} {heat} {}  {:3.0} %  {:.1} Mrays/s  first {:.0} ms  {} spp  {:+.1} stops  F1: help{error}",
                self.name,
                options.integrator.name(),
                options.engine,
                100.0 * shown.progress,
                shown.mrays_per_s,
                1e3 * shown.first_seconds,
                options.spp,
                view.exposure,
            )
        });
        let message = locked(self.message).clone();
        let mut lines: Vec<&str> = message.iter().flat_map(|text| text.lines()).take(8).collect();
        lines.push(&status);
        let top = screen.height.saturating_sub(LINE * lines.len() as u32);
        screen.write(top, &lines);
        screen
    }
}

impl ApplicationHandler<Wake> for App<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_some() {
            return;
        }
        let options = self.shared.wanted().view.look.options;
        match Surface::open(event_loop, self.name, (options.width, options.height)) {
            Ok(surface) => self.shown = Some(surface),
            Err(error) => {
                self.failure = Some(error);
                event_loop.exit();
            }
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, _: Wake) {
        self.redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let request = match event {
            WindowEvent::CloseRequested => Some(Request::Quit),
            WindowEvent::Resized(size) => {
                self.resized(size);
                None
            }
            WindowEvent::RedrawRequested => {
                let screen = self.composed();
                if let Some(Err(error)) = self.shown.as_mut().map(|surface| surface.show(&screen)) {
                    self.failure = Some(error.to_string());
                    event_loop.exit();
                }
                None
            }
            WindowEvent::ModifiersChanged(now) => {
                self.pointer.shift = now.state().shift_key();
                None
            }
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                input::key(&event.logical_key)
            }
            WindowEvent::CursorMoved { position, .. } => {
                let height = self.shown.as_ref().map_or(1.0, |surface| f64::from(surface.size().1));
                let request = self.pointer.moved(position.x, position.y, height);
                self.slide();
                request
            }
            WindowEvent::MouseInput { state: ElementState::Pressed, button: MouseButton::Left, .. }
                if self.grabs_slider() =>
            {
                None
            }
            WindowEvent::MouseInput { state, button, .. } => {
                self.sliding = None;
                self.pointer.button(button, state)
            }
            WindowEvent::MouseWheel { delta, .. } => Some(input::wheel(delta)),
            _ => None,
        };
        if let Some(request) = request {
            self.handle(request, event_loop);
        }
    }
}
