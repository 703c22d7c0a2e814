//! `lanecast view` in a real window on a virtual display (Xvfb): what it shows is the rendered picture, and keys, pointer
//! and edits of the scene's file do what they should.
#![cfg(target_os = "linux")]

mod binary;

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use binary::lanecast;
use lanecast::film::{Film, exr, srgb};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, ConnectionExt, ImageFormat, InputFocus, KEY_PRESS_EVENT,
    KEY_RELEASE_EVENT, MOTION_NOTIFY_EVENT, MapState,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

const WIDTH: u32 = 180;
const HEIGHT: u32 = 120;
/// Rows that the status line covers.
const STATUS: u32 = 15;
const PATIENCE: Duration = Duration::from_secs(30);

/// A virtual display that ends with the test.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn start() -> Option<Self> {
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp"]);
        let Ok(mut server) = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn() else {
            println!("SKIPPED: no Xvfb");
            return None;
        };
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).expect("a display's number");
        assert!(!number.trim().is_empty(), "Xvfb did not start");
        Some(Self { server, name: format!(":{}", number.trim()) })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        self.server.kill().expect("the server ends");
        self.server.wait().expect("the server ended");
    }
}

/// The view and a person in front of it.
struct Person {
    x: RustConnection,
    root: u32,
    window: u32,
    child: Child,
}

impl Person {
    fn sit_down(display: &Display, dir: &Path, arguments: &str) -> Self {
        let size = format!("{WIDTH}x{HEIGHT}");
        let child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
            .args(arguments.split(' '))
            .args(["--size", &size])
            .current_dir(dir)
            .env("DISPLAY", &display.name)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary");
        let (x, screen) = x11rb::connect(Some(&display.name)).expect("the display");
        let root = x.setup().roots[screen].root;
        let mut person = Self { x, root, window: 0, child };
        let window = person.until("a window", |p| {
            let title = |&w: &u32| {
                let name = p.x.get_property(false, w, AtomEnum::WM_NAME, AtomEnum::ANY, 0, 64).ok()?.reply().ok()?;
                let mapped = p.x.get_window_attributes(w).ok()?.reply().ok()?.map_state == MapState::VIEWABLE;
                (mapped && String::from_utf8_lossy(&name.value).starts_with("lanecast")).then_some(w)
            };
            p.x.query_tree(p.root).ok()?.reply().ok()?.children.iter().find_map(title)
        });
        person.window = window;
        // Without a window manager nobody else gives it the keys.
        person.x.set_input_focus(InputFocus::PARENT, window, x11rb::CURRENT_TIME).unwrap().check().unwrap();
        person
    }

    fn until<T>(&mut self, what: &str, mut look: impl FnMut(&Self) -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(found) = look(self) {
                return found;
            }
            if let Some(status) = self.child.try_wait().unwrap() {
                panic!("waiting for {what}: the view ended with {status}: {}", self.said());
            }
            assert!(start.elapsed() < PATIENCE, "waited in vain for {what}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn said(&mut self) -> String {
        let mut said = String::new();
        self.child.stderr.take().map(|mut err| err.read_to_string(&mut said).unwrap());
        said
    }

    /// Red, green, blue of all pixels, row by row.
    fn screenshot(&self) -> Vec<[u8; 3]> {
        let (w, h) = (WIDTH as u16, HEIGHT as u16);
        let image = self.x.get_image(ImageFormat::Z_PIXMAP, self.window, 0, 0, w, h, !0).unwrap().reply().unwrap();
        image.data.chunks(4).map(|p| [p[2], p[1], p[0]]).collect()
    }

    /// Waits until the window shows `want` in all rows above `below`.
    fn sees(&mut self, what: &str, want: &[[u8; 3]], below: u32) {
        let pixels = (WIDTH * (HEIGHT - below)) as usize;
        self.until(what, |p| (p.screenshot()[..pixels] == want[..pixels]).then_some(()));
    }

    fn send(&self, kind: u8, detail: u8, x: i16, y: i16) {
        self.x.xtest_fake_input(kind, detail, x11rb::CURRENT_TIME, self.root, x, y, 0).unwrap().check().unwrap();
    }

    fn key(&self, keysym: u32) {
        let setup = self.x.setup();
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let mapping = self.x.get_keyboard_mapping(first, last - first + 1).unwrap().reply().unwrap();
        let per_key = usize::from(mapping.keysyms_per_keycode);
        let place = mapping.keysyms.chunks(per_key).position(|syms| syms[0] == keysym).expect("a key");
        let code = first + place as u8;
        self.send(KEY_PRESS_EVENT, code, 0, 0);
        self.send(KEY_RELEASE_EVENT, code, 0, 0);
    }

    /// q quits.
    fn quits(&mut self) {
        self.key(0x71);
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(start.elapsed() < PATIENCE, "q does not quit");
            std::thread::sleep(Duration::from_millis(20));
        };
        assert_eq!(status.code(), Some(0), "{}", self.said());
    }

    fn drag(&self, from: (i16, i16), to: (i16, i16)) {
        self.send(MOTION_NOTIFY_EVENT, 0, from.0, from.1);
        // The window must have seen the pointer before the button.
        std::thread::sleep(Duration::from_millis(100));
        self.send(BUTTON_PRESS_EVENT, 1, 0, 0);
        self.send(MOTION_NOTIFY_EVENT, 0, to.0, to.1);
        self.send(BUTTON_RELEASE_EVENT, 1, 0, 0);
    }
}

impl Drop for Person {
    fn drop(&mut self) {
        // Ended already, unless the test fails.
        let _ended = self.child.kill();
        let _ended = self.child.wait();
    }
}

/// Display levels of a film over black.
fn levels(film: &Film) -> Vec<[u8; 3]> {
    let planes = film.color().unwrap();
    (0..film.pixels()).map(|i| planes.map(|plane| srgb::encode_level(f64::from(plane[i])))).collect()
}

/// What a scripted view shows.
fn scripted(dir: &Path, scene: &str, script: &str) -> Vec<[u8; 3]> {
    std::fs::write(dir.join("script.txt"), format!("{script}wait\nsave want.exr\n")).unwrap();
    let line = format!("view {scene} --size {WIDTH}x{HEIGHT} --headless-script script.txt");
    let ended = lanecast(dir, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    levels(&exr::read(&dir.join("want.exr")).unwrap())
}

const SCENE: &str = "camera \"c\" { eye 2 3 6; look-at 0 0 0; up 0 1 0; fov 40 }\nbackground 0.1 0.2 0.4\n\
    light directional { direction -1 -2 -1.5; irradiance 2 2 2 }\n\
    difference { box { size 2 2 2 }; sphere radius=RADIUS }\n";

#[test]
fn the_window_shows_what_is_rendered_and_follows_keys_pointer_and_edits() {
    let Some(display) = Display::start() else { return };
    let dir = tempfile::tempdir().unwrap();
    // What scripts render lies elsewhere: the view watches the scene's folder.
    let aside = tempfile::tempdir().unwrap();
    let write = |radius: &str| {
        let text = SCENE.replace("RADIUS", radius);
        std::fs::write(dir.path().join("scene.kdl"), &text).unwrap();
        std::fs::write(aside.path().join("scene.kdl"), &text).unwrap();
    };
    write("1.2");
    let mut person = Person::sit_down(&display, dir.path(), "view scene.kdl");
    let start = scripted(aside.path(), "scene.kdl", "");
    let rendered = lanecast(aside.path(), &["render", "scene.kdl", "-o", "r.exr", "--size", "180x120", "--exact"]);
    assert_eq!(rendered.code, Some(0), "{}", rendered.err);
    assert!(start == levels(&exr::read(&aside.path().join("r.exr")).unwrap()));
    person.sees("the rendered picture", &start, STATUS);
    let status = &person.screenshot()[(WIDTH * (HEIGHT - STATUS)) as usize..];
    assert!(status.iter().filter(|p| **p == [255; 3]).count() > 50, "a status line is written below");
    // Tab takes the text away: now all rows are the picture.
    person.key(0xff09);
    person.sees("the picture without text", &start, 0);

    // A drag of 40 of 120 pixels is 60 degrees to the right, 10 pixels down 15 degrees up.
    person.drag((60, 50), (100, 60));
    let turned = scripted(aside.path(), "scene.kdl", "orbit 60 15\n");
    assert!(turned != start);
    person.sees("the orbit", &turned, 0);

    // Key 3 shows normals, p writes the picture.
    person.key(0x33);
    let normals = scripted(aside.path(), "scene.kdl", "orbit 60 15\nintegrator normals\n");
    person.sees("normals", &normals, 0);
    person.key(0x70);
    let saved = dir.path().join("scene-001.png");
    person.until("the saved picture", |_| saved.exists().then_some(()));
    person.key(0x31);
    person.sees("the orbit again", &turned, 0);

    // An edit is seen, a mistake leaves the last good picture and says where it is.
    write("1.35");
    let edited = scripted(aside.path(), "scene.kdl", "orbit 60 15\n");
    assert!(edited != turned);
    person.sees("the edit", &edited, 0);
    std::fs::write(dir.path().join("scene.kdl"), SCENE.replace("RADIUS", "oops")).unwrap();
    person.key(0xff09);
    // The message has three lines, the status one: all is dark but the letters.
    let rows = 4 * STATUS;
    person.until("the message", |p| {
        let shot = p.screenshot();
        let text = |y: u32| (0..WIDTH).filter(|x| shot[(y * WIDTH + x) as usize] == [255; 3]).count() > 0;
        (HEIGHT - rows..HEIGHT).filter(|&y| text(y)).count().ge(&20).then_some(())
    });
    person.sees("the last good picture", &edited, rows);

    person.quits();
    let png = lanecast::film::png::read(&saved).unwrap();
    assert_eq!((png.width, png.height), (WIDTH, HEIGHT));
}

/// A slider gives a parameter another value while it is dragged.
#[test]
fn sliders_change_the_scene() {
    let Some(display) = Display::start() else { return };
    let dir = tempfile::tempdir().unwrap();
    let aside = tempfile::tempdir().unwrap();
    let text = format!("parameter hole 1.2 from=1 to=1.5\n{}", SCENE.replace("RADIUS", "\"hole\""));
    std::fs::write(dir.path().join("scene.kdl"), &text).unwrap();
    std::fs::write(aside.path().join("scene.kdl"), &text).unwrap();
    let mut person = Person::sit_down(&display, dir.path(), "view scene.kdl");
    let start = scripted(aside.path(), "scene.kdl", "");
    person.sees("the picture", &start, STATUS);
    // Tab hides the status line, v shows the slider: its bar is 200 pixels long from the fourth on, below its name.
    person.key(0xff09);
    person.key(0x76);
    let bar = |p: &Person, x: u32| p.screenshot()[(20 * WIDTH + x) as usize];
    person.until("the slider", |p| (bar(p, 80) != bar(p, 90)).then_some(()));
    person.drag((84, 20), (104, 20));
    person.until("the slider where it was dragged", |p| (bar(p, 103) != bar(p, 104)).then_some(()));
    person.key(0x76);
    let wider = scripted(aside.path(), "scene.kdl", "set hole 1.25\n");
    assert!(wider != start);
    person.sees("the wider hole", &wider, 0);
    // r puts it back.
    person.key(0x72);
    person.sees("the first picture", &start, 0);
    person.quits();
}

/// `render --preview window` shows what it writes and stays until it is closed.
#[test]
fn a_render_can_be_watched() {
    let Some(display) = Display::start() else { return };
    let dir = tempfile::tempdir().unwrap();
    let mut person = Person::sit_down(&display, dir.path(), "render builtin:die -o out.exr --preview window");
    let file = dir.path().join("out.exr");
    person.until("the file", |_| file.exists().then_some(()));
    let want = levels(&exr::read(&file).unwrap());
    person.sees("the picture that was written", &want, 0);
    person.quits();
}

/// Exit code and standard error of a command where there is no display.
fn without_display(dir: &Path, line: &str) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(line.split(' '))
        .current_dir(dir)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .expect("the binary");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn without_a_display_a_render_goes_on_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let (code, said) = without_display(dir.path(), "render builtin:die -o out.png --size 20x20 --preview window");
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("preview: no window") && said.contains("going on without"), "{said}");
    assert!(dir.path().join("out.png").exists());
}

#[test]
fn without_a_display_there_is_a_clear_message() {
    let (code, said) = without_display(Path::new("."), "view builtin:die");
    assert_eq!(code, Some(2), "{said}");
    assert!(said.starts_with("error: no window") && said.contains("--headless-script"), "{said}");
    assert!(!said.contains("panicked"), "{said}");
}
