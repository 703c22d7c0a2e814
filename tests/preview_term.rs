//! `render --preview term` in a pseudo-terminal: an emulator takes the bytes and shows what a person would see.
#![cfg(unix)]

mod binary;

use std::io::Read;
use std::path::Path;

use binary::lanecast;
use lanecast::film::{exr, srgb};
use portable_pty::{CommandBuilder, PtySize, native_pty_system};

const COLUMNS: u16 = 42;
const ROWS: u16 = 18;
/// Rows of cells of a picture that fills the terminal: the bar and the cursor need one each.
const PICTURE_ROWS: u16 = ROWS - 2;

/// Runs the binary in a terminal: exit code and all bytes it wrote there.
fn in_terminal(dir: &Path, arguments: &[&str]) -> (u32, Vec<u8>) {
    let size = PtySize { rows: ROWS, cols: COLUMNS, pixel_width: 0, pixel_height: 0 };
    let pair = native_pty_system().openpty(size).expect("a pseudo-terminal");
    let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_lanecast"));
    command.args(arguments);
    command.cwd(dir);
    let mut reader = pair.master.try_clone_reader().expect("its output");
    let mut child = pair.slave.spawn_command(command).expect("the binary");
    drop(pair.slave);
    let mut bytes = Vec::new();
    let mut buffer = [0; 4096];
    // The end of a pseudo-terminal is an error on some systems, no bytes on others.
    while let Ok(n @ 1..) = reader.read(&mut buffer) {
        bytes.extend_from_slice(&buffer[..n]);
    }
    (child.wait().expect("an end").exit_code(), bytes)
}

#[test]
fn the_terminal_shows_the_picture() {
    let dir = tempfile::tempdir().unwrap();
    // Three pixels per half cell each way.
    let size = format!("{}x{}", 3 * COLUMNS, 6 * PICTURE_ROWS);
    let line = format!("render builtin:die -o out.exr --size {size} --preview term --exposure 0.5");
    let (code, bytes) = in_terminal(dir.path(), &line.split(' ').collect::<Vec<_>>());
    let mut screen = vt100::Parser::new(ROWS, COLUMNS, 10);
    screen.process(&bytes);
    let text = screen.screen().contents();
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("rays in") && text.contains("out.exr"), "what was done is said below: {text}");
    assert!(!text.contains("===="), "the bar is gone: {text}");
    // Drawn over itself for each of the five steps and at the end.
    let again = format!("\u{1b}[{}F", PICTURE_ROWS + 1);
    let drawn = 1 + String::from_utf8_lossy(&bytes).matches(&again).count();
    assert!(drawn >= 6, "{drawn} pictures");

    let film = exr::read(&dir.path().join("out.exr")).expect("the picture");
    let planes = film.color().unwrap();
    let want = |column: u16, half: u16| {
        planes.map(|plane| {
            let pixel = |i: usize| {
                let (x, y) = (3 * usize::from(column) + i % 3, 3 * usize::from(half) + i / 3);
                f64::from(plane[y * 3 * usize::from(COLUMNS) + x])
            };
            srgb::encode_level((0..9).map(pixel).sum::<f64>() / 9.0 * 2f64.sqrt())
        })
    };
    // The lines below the picture have pushed its first rows out: look where it is now.
    let first = (0..ROWS).find(|&row| screen.screen().cell(row, 0).is_some_and(|c| c.contents() == "\u{2580}"));
    let shown: Vec<u16> = (first.expect("a row of the picture")..ROWS)
        .take_while(|&row| screen.screen().cell(row, 0).is_some_and(|c| c.contents() == "\u{2580}"))
        .collect();
    assert!(shown.len() >= 8, "{} rows of the picture are left: {text}", shown.len());
    let gone = PICTURE_ROWS - shown.len() as u16;
    let mut colors = std::collections::BTreeSet::new();
    for (i, &row) in shown.iter().enumerate() {
        for column in 0..COLUMNS {
            let cell = screen.screen().cell(row, column).expect("a cell");
            let line = gone + i as u16;
            for (got, half) in [(cell.fgcolor(), 2 * line), (cell.bgcolor(), 2 * line + 1)] {
                let vt100::Color::Rgb(r, g, b) = got else { panic!("{got:?} at {column},{row}") };
                let want = want(column, half);
                let near = [r, g, b].iter().zip(want).all(|(a, b)| a.abs_diff(b) <= 1);
                assert!(near, "cell {column},{row}: {:?}, expected {want:?}", [r, g, b]);
                colors.insert([r, g, b]);
            }
        }
    }
    assert!(colors.len() > 20, "a picture with something in it: {} colours", colors.len());
}

#[test]
fn without_a_terminal_the_render_goes_on_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let ended =
        lanecast(dir.path(), &["render", "builtin:die", "-o", "out.png", "--size", "20x20", "--preview", "term"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert!(ended.err.contains("stderr is no terminal; going on without"), "{}", ended.err);
    assert!(dir.path().join("out.png").exists());
}
