//! Keys and the pointer, and what they mean.

use winit::event::{ElementState, MouseButton, MouseScrollDelta};
use winit::keyboard::{Key, NamedKey};

use crate::view::action::Action;

/// Degrees of an orbit per window height that the pointer moves.
const DRAG_DEGREES: f64 = 180.0;
/// Degrees of an orbit per press of an arrow key.
const KEY_DEGREES: f64 = 5.0;
/// Distances flown per press of a key.
const KEY_FLIGHT: f64 = 0.05;
/// Zoom of one step of the wheel.
const WHEEL_ZOOM: f64 = 1.1;
/// Pixels of a trackpad that are one step of a wheel.
const WHEEL_PIXELS: f64 = 40.0;
/// A press that moves no farther than this is a click, pixels.
const CLICK: f64 = 3.0;

/// The keys, for the help over the picture.
pub const HELP: [&str; 12] = [
    "drag: orbit    right drag: turn    middle or shift drag: pan    wheel: zoom    click: what is there",
    "arrows: orbit    W A S D, page up, page down: fly    [ ]: field of view    Home: back",
    "I: next integrator, also path and rt (1 whitted, 2 ao, 3 normals, 4 depth, 5 cost)",
    "E: engine",
    "H: map of node visits, primitive tests, lane use",
    "C: next camera",
    "+ -: exposure",
    ", .: fewer, more samples per pixel",
    "V: sliders for the scene's parameters    R: all as the file says",
    "P: save PNG    X: save EXR",
    "Tab: text on and off    F1: this help",
    "Q or Escape: quit",
];

/// What the window itself does.
#[derive(Clone, Debug, PartialEq)]
pub enum Request {
    /// Change the view.
    Do(Action),
    /// Twice (true) or half as many samples.
    MoreSamples(bool),
    /// Tell what lies under a pixel.
    Pick(f64, f64),
    /// Write the picture: the extension.
    Save(&'static str),
    /// Sliders on or off.
    Sliders,
    /// All parameters as the scene says.
    Unset,
    /// Text on or off.
    Text,
    /// Help on or off.
    Help,
    /// Close.
    Quit,
}

/// What pressing `key` asks for.
pub fn key(key: &Key) -> Option<Request> {
    let act = |action| Some(Request::Do(action));
    let fly = |right, up, forward| act(Action::Fly(right * KEY_FLIGHT, up * KEY_FLIGHT, forward * KEY_FLIGHT));
    let named = |name: &str| act(Action::Integrator(name.into()));
    match key {
        Key::Named(NamedKey::Escape) => Some(Request::Quit),
        Key::Named(NamedKey::Tab) => Some(Request::Text),
        Key::Named(NamedKey::F1) => Some(Request::Help),
        Key::Named(NamedKey::Home) => act(Action::Reset),
        Key::Named(NamedKey::ArrowLeft) => act(Action::Orbit(-KEY_DEGREES, 0.0)),
        Key::Named(NamedKey::ArrowRight) => act(Action::Orbit(KEY_DEGREES, 0.0)),
        Key::Named(NamedKey::ArrowUp) => act(Action::Orbit(0.0, KEY_DEGREES)),
        Key::Named(NamedKey::ArrowDown) => act(Action::Orbit(0.0, -KEY_DEGREES)),
        Key::Named(NamedKey::PageUp) => fly(0.0, 1.0, 0.0),
        Key::Named(NamedKey::PageDown) => fly(0.0, -1.0, 0.0),
        Key::Character(text) => match text.to_lowercase().as_str() {
            "w" => fly(0.0, 0.0, 1.0),
            "s" => fly(0.0, 0.0, -1.0),
            "a" => fly(-1.0, 0.0, 0.0),
            "d" => fly(1.0, 0.0, 0.0),
            "[" => act(Action::Widen(1.0 / WHEEL_ZOOM)),
            "]" => act(Action::Widen(WHEEL_ZOOM)),
            "1" => named("whitted"),
            "2" => named("ao"),
            "3" => named("normals"),
            "4" => named("depth"),
            "5" => named("cost"),
            "i" => act(Action::NextIntegrator),
            "e" => act(Action::NextEngine),
            "h" => act(Action::NextHeat),
            "c" => act(Action::NextCamera),
            "+" | "=" => act(Action::Exposure(0.5)),
            "-" => act(Action::Exposure(-0.5)),
            "," => Some(Request::MoreSamples(false)),
            "." => Some(Request::MoreSamples(true)),
            "v" => Some(Request::Sliders),
            "r" => Some(Request::Unset),
            "p" => Some(Request::Save("png")),
            "x" => Some(Request::Save("exr")),
            "q" => Some(Request::Quit),
            _ => None,
        },
        _ => None,
    }
}

/// The pointer over a window.
#[derive(Debug, Default)]
pub struct Pointer {
    place: (f64, f64),
    /// The button held down, and where that began.
    held: Option<(MouseButton, (f64, f64))>,
    /// Whether it has moved too far for a click.
    dragged: bool,
    /// Whether shift is held down.
    pub shift: bool,
}

impl Pointer {
    /// The pointer is at (x, y), pixels, in a window of `height` pixels.
    pub fn moved(&mut self, x: f64, y: f64, height: f64) -> Option<Request> {
        let (dx, dy) = (x - self.place.0, y - self.place.1);
        self.place = (x, y);
        let (button, (x0, y0)) = self.held?;
        self.dragged |= (x - x0).hypot(y - y0) > CLICK;
        if !self.dragged {
            return None;
        }
        let (right, down) = (dx / height.max(1.0), dy / height.max(1.0));
        Some(Request::Do(match button {
            MouseButton::Left if !self.shift => Action::Orbit(right * DRAG_DEGREES, down * DRAG_DEGREES),
            MouseButton::Right => Action::Turn(right * DRAG_DEGREES * 0.5, -down * DRAG_DEGREES * 0.5),
            _ => Action::Pan(right, -down),
        }))
    }

    /// Where the pointer is, pixels.
    pub fn place(&self) -> (f64, f64) {
        self.place
    }

    /// A button goes down or up.
    pub fn button(&mut self, button: MouseButton, state: ElementState) -> Option<Request> {
        if state == ElementState::Pressed {
            self.held = Some((button, self.place));
            self.dragged = false;
            return None;
        }
        let is_click = !self.dragged && self.held.take().is_some_and(|(held, _)| held == button);
        self.held = None;
        (is_click && button == MouseButton::Left).then_some(Request::Pick(self.place.0, self.place.1))
    }
}

/// The wheel turns.
pub fn wheel(delta: MouseScrollDelta) -> Request {
    let steps = match delta {
        MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
        MouseScrollDelta::PixelDelta(pixels) => pixels.y / WHEEL_PIXELS,
    };
    Request::Do(Action::Zoom(WHEEL_ZOOM.powf(steps.clamp(-20.0, 20.0))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_press_is_a_click_a_long_one_a_drag() {
        let mut pointer = Pointer::default();
        assert_eq!(pointer.moved(10.0, 20.0, 100.0), None);
        assert_eq!(pointer.button(MouseButton::Left, ElementState::Pressed), None);
        assert_eq!(pointer.moved(12.0, 21.0, 100.0), None);
        assert_eq!(pointer.button(MouseButton::Left, ElementState::Released), Some(Request::Pick(12.0, 21.0)));
        pointer.button(MouseButton::Left, ElementState::Pressed);
        let drag = pointer.moved(22.0, 16.0, 100.0);
        assert_eq!(drag, Some(Request::Do(Action::Orbit(0.1 * DRAG_DEGREES, -0.05 * DRAG_DEGREES))));
        assert_eq!(pointer.button(MouseButton::Left, ElementState::Released), None);
        assert_eq!(pointer.moved(90.0, 90.0, 100.0), None);
        pointer.button(MouseButton::Middle, ElementState::Pressed);
        assert_eq!(pointer.moved(100.0, 80.0, 100.0), Some(Request::Do(Action::Pan(0.1, 0.1))));
    }

    #[test]
    fn keys_and_wheel() {
        assert_eq!(key(&Key::Character("W".into())), Some(Request::Do(Action::Fly(0.0, 0.0, KEY_FLIGHT))));
        assert_eq!(key(&Key::Named(NamedKey::Escape)), Some(Request::Quit));
        assert_eq!(key(&Key::Character("z".into())), None);
        assert_eq!(wheel(MouseScrollDelta::LineDelta(0.0, 2.0)), Request::Do(Action::Zoom(WHEEL_ZOOM * WHEEL_ZOOM)));
    }
}
