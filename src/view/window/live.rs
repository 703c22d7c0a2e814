//! A window that only shows a picture while another part of the program makes it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use winit::application::ApplicationHandler;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop, EventLoopProxy};
use winit::keyboard::{Key, NamedKey};
use winit::window::WindowId;

use super::screen::Screen;
use super::surface::Surface;
use crate::error::locked;
use crate::film::{Film, Window};
use crate::render::progressive::{Framebuffer, Step, Viewer};
use crate::view::levels::Levels;

/// Time between two pictures.
const PERIOD: Duration = Duration::from_millis(50);
/// How long a display may take to show a window.
const PATIENCE: Duration = Duration::from_secs(5);
/// Time between two looks at whether to stop waiting.
const POLL: Duration = Duration::from_millis(50);

/// What the window's thread is told.
#[derive(Debug)]
enum Call {
    Redraw,
    Close,
}

/// What the window's thread answers once: how to call it, or why there is no window.
type Answer = Result<EventLoopProxy<Call>, String>;

/// A window on its own thread.
pub struct Live {
    exposure: f32,
    levels: Levels,
    screen: Arc<Mutex<Screen>>,
    last: Mutex<Option<Instant>>,
    closed: Arc<AtomicBool>,
    proxy: Mutex<EventLoopProxy<Call>>,
    thread: JoinHandle<()>,
}

impl Live {
    /// Opens a window of `size` pixels; colours are shown times 2^`exposure`.
    ///
    /// # Errors
    /// Why there is no window: no display for example.
    pub fn open(title: &str, size: (u32, u32), exposure: f32) -> Result<Self, String> {
        let screen = Arc::new(Mutex::new(Screen::default()));
        let closed = Arc::new(AtomicBool::new(false));
        let (sender, answer) = channel();
        let (title, shared, is_closed) = (title.to_string(), screen.clone(), closed.clone());
        let thread = std::thread::spawn(move || {
            let mut app = App { title, size, screen: shared, shown: None, proxy: None, answer: Some(sender) };
            if let Err(error) = app.run()
                && let Some(answer) = app.answer.take()
            {
                // Nobody waits any longer: the window came too late.
                let _late = answer.send(Err(error));
            }
            is_closed.store(true, Ordering::SeqCst);
        });
        let proxy = answer.recv_timeout(PATIENCE).unwrap_or_else(|_| Err("the display does not answer".into()))?;
        let (levels, last, proxy) = (Levels::default(), Mutex::default(), Mutex::new(proxy));
        Ok(Self { exposure, levels, screen, last, closed, proxy, thread })
    }

    fn call(&self, call: Call) {
        // A closed window hears nothing.
        let _closed = locked(&self.proxy).send_event(call);
    }

    fn show(&self, film: &Film, shown: impl Fn(u32, u32) -> Option<usize>) {
        locked(&self.screen).show(film, self.exposure, &self.levels, shown);
        self.call(Call::Redraw);
    }

    /// Shows the finished picture.
    pub fn finish(&self, film: &Film) {
        self.show(film, |x, y| film.window.index(x, y));
    }

    /// Waits until a person closes the window, or `stopped` says so.
    pub fn wait(self, stopped: impl Fn() -> bool) {
        while !self.closed.load(Ordering::SeqCst) && !stopped() {
            std::thread::sleep(POLL);
        }
        self.call(Call::Close);
        // A window that failed is gone: that is what was waited for.
        let _failed = self.thread.join();
    }
}

impl Viewer for Live {
    fn painted(&self, frame: &Framebuffer, _: Window) {
        let mut last = locked(&self.last);
        if last.is_none_or(|last| last.elapsed() >= PERIOD) && !self.closed.load(Ordering::Relaxed) {
            self.show(frame.film(), |x, y| frame.shown(x, y));
            *last = Some(Instant::now());
        }
    }

    fn step_done(&self, frame: &Framebuffer, _: Step) {
        self.show(frame.film(), |x, y| frame.shown(x, y));
    }
}

struct App {
    title: String,
    size: (u32, u32),
    screen: Arc<Mutex<Screen>>,
    shown: Option<Surface>,
    proxy: Option<EventLoopProxy<Call>>,
    answer: Option<Sender<Answer>>,
}

impl App {
    #[cfg(target_os = "linux")]
    fn run(&mut self) -> Result<(), String> {
        use winit::platform::x11::EventLoopBuilderExtX11;
        let event_loop = EventLoop::with_user_event().with_any_thread(true).build().map_err(|e| e.to_string())?;
        self.proxy = Some(event_loop.create_proxy());
        event_loop.run_app(self).map_err(|e| e.to_string())
    }

    #[cfg(not(target_os = "linux"))]
    fn run(&mut self) -> Result<(), String> {
        let _: Option<EventLoop<Call>> = None;
        Err("this system wants windows on the main thread, which renders; `lanecast view` has one".into())
    }
}

impl ApplicationHandler<Call> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_some() {
            return;
        }
        let made = Surface::open(event_loop, &self.title, self.size);
        let answer = made.and_then(|shown| {
            self.shown = Some(shown);
            self.proxy.clone().ok_or_else(|| "the window cannot be called".into())
        });
        if answer.is_err() {
            event_loop.exit();
        }
        if let Some(sender) = self.answer.take() {
            // Nobody waits any longer: the window came too late and will not be drawn to.
            let _late = sender.send(answer);
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, call: Call) {
        match (call, &self.shown) {
            (Call::Redraw, Some(surface)) => surface.request_redraw(),
            (Call::Redraw, None) => {}
            (Call::Close, _) => event_loop.exit(),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let is_quit = |key: &Key| match key {
            Key::Named(NamedKey::Escape) => true,
            Key::Character(text) => text.eq_ignore_ascii_case("q"),
            _ => false,
        };
        match event {
            WindowEvent::CloseRequested => event_loop.exit(),
            WindowEvent::KeyboardInput { event, .. }
                if event.state == ElementState::Pressed && is_quit(&event.logical_key) =>
            {
                event_loop.exit();
            }
            WindowEvent::RedrawRequested => {
                let screen = locked(&self.screen);
                if self.shown.as_mut().is_some_and(|surface| surface.show(&screen).is_err()) {
                    event_loop.exit();
                }
            }
            _ => {}
        }
    }
}
