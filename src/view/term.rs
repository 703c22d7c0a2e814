//! A picture in a terminal: two pixels per character cell, the upper one as the colour of a half block, the lower one as
//! its background, in 24-bit colours.

use std::io::Write;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crossterm::cursor::MoveToPreviousLine;
use crossterm::style::{Color, Colors, Print, ResetColor, SetColors};
use crossterm::terminal::{Clear, ClearType};
use crossterm::{QueueableCommand, terminal};

use crate::error::locked;
use crate::film::{Film, Window, srgb};
use crate::render::progressive::{Framebuffer, Step, Viewer};

/// Time between two pictures.
const PERIOD: Duration = Duration::from_millis(100);
/// Cells of a terminal that does not say its size.
const DEFAULT_CELLS: (u16, u16) = (80, 24);
/// Rows kept free: the bar, and the cursor's.
const OTHER_ROWS: u32 = 2;
/// Characters of the bar.
const BAR: u64 = 32;
/// Points per cell half and axis whose mean it shows.
const POINTS: u32 = 3;

/// A picture drawn over itself again and again at the cursor's place.
pub struct Terminal<W> {
    /// Brightness: 2^exposure.
    gain: f64,
    columns: u32,
    rows: u32,
    state: Mutex<State<W>>,
}

struct State<W> {
    out: W,
    /// When the last picture was drawn; nothing is drawn yet if `None`.
    drawn: Option<Instant>,
    steps_done: u64,
    total: u64,
    /// A terminal that is gone is left alone.
    broken: bool,
}

impl<W: Write + Send> Terminal<W> {
    /// A terminal of `cells` (columns, rows; `None` asks the system) behind `out`. Colours are shown times 2^`exposure`.
    pub fn new(out: W, cells: Option<(u16, u16)>, picture: Window, exposure: f32) -> Self {
        let (columns, rows) = cells.or_else(|| terminal::size().ok()).unwrap_or(DEFAULT_CELLS);
        let (columns, rows) = fit(picture, u32::from(columns), u32::from(rows).saturating_sub(OTHER_ROWS));
        let state = State { out, drawn: None, steps_done: 0, total: 0, broken: false };
        Self { gain: f64::from(exposure).exp2(), columns, rows, state: Mutex::new(state) }
    }

    /// One more of `total` batches is done: for the bar under the picture.
    pub fn batch_done(&self, total: u64) {
        let mut state = locked(&self.state);
        state.steps_done += 1;
        state.total = total;
    }

    /// Draws the finished picture; the bar goes, and the cursor stays below.
    pub fn finish(&self, film: &Film) {
        let mut state = locked(&self.state);
        self.draw(&mut state, film, |x, y| film.window.index(x, y), false);
    }

    fn draw_frame(&self, frame: &Framebuffer, at_once: bool) {
        // Who draws already draws for all.
        let Ok(mut state) = self.state.try_lock() else { return };
        if at_once || state.drawn.is_none_or(|last| last.elapsed() >= PERIOD) {
            self.draw(&mut state, frame.film(), |x, y| frame.shown(x, y), true);
        }
    }

    fn draw(&self, state: &mut State<W>, film: &Film, shown: impl Fn(u32, u32) -> Option<usize>, bar: bool) {
        if state.broken {
            return;
        }
        let bytes = self.picture(state, film, shown, bar);
        let written = bytes.and_then(|bytes| state.out.write_all(&bytes).and_then(|()| state.out.flush()));
        state.broken = written.is_err();
        state.drawn = Some(Instant::now());
    }

    /// The bytes that draw one picture.
    fn picture(
        &self,
        state: &State<W>,
        film: &Film,
        shown: impl Fn(u32, u32) -> Option<usize>,
        bar: bool,
    ) -> std::io::Result<Vec<u8>> {
        let mut out = Vec::new();
        if state.drawn.is_some() {
            out.queue(MoveToPreviousLine(self.rows as u16 + 1))?;
        }
        for row in 0..self.rows {
            for column in 0..self.columns {
                let [upper, lower] = [2 * row, 2 * row + 1].map(|half| self.color(film, &shown, column, half));
                out.queue(SetColors(Colors::new(upper, lower)))?.queue(Print('\u{2580}'))?;
            }
            out.queue(ResetColor)?.queue(Print("\r\n"))?;
        }
        out.queue(Clear(ClearType::CurrentLine))?;
        if bar {
            let filled = (BAR * state.steps_done).checked_div(state.total).unwrap_or(0) as usize;
            let line =
                format!("[{:<width$}] {}/{}", "=".repeat(filled), state.steps_done, state.total, width = BAR as usize);
            out.queue(Print(line))?.queue(Print("\r\n"))?;
        } else {
            out.queue(Print("\r\n"))?;
        }
        Ok(out)
    }

    /// The colour of half a cell: the mean of a few points, in linear light.
    fn color(&self, film: &Film, shown: &impl Fn(u32, u32) -> Option<usize>, column: u32, half: u32) -> Color {
        let Ok(planes) = film.color() else { return Color::Black };
        let window = film.window;
        let place = |cell: u32, point: u32, cells: u32, pixels: u32| {
            let at = u64::from(2 * (cell * POINTS + point) + 1) * u64::from(pixels) / u64::from(2 * cells * POINTS);
            at as u32
        };
        let mut sum = [0.0; 3];
        for i in 0..POINTS * POINTS {
            let x = window.x0 + place(column, i % POINTS, self.columns, window.width());
            let y = window.y0 + place(half, i / POINTS, 2 * self.rows, window.height());
            if let Some(index) = shown(x, y) {
                sum.iter_mut().zip(planes).for_each(|(sum, plane)| *sum += f64::from(plane[index]));
            }
        }
        let [r, g, b] = sum.map(|sum| srgb::encode_level(sum * self.gain / f64::from(POINTS * POINTS)));
        Color::Rgb { r, g, b }
    }
}

impl<W: Write + Send> Viewer for Terminal<W> {
    fn painted(&self, frame: &Framebuffer, _: Window) {
        self.draw_frame(frame, false);
    }

    fn step_done(&self, frame: &Framebuffer, _: Step) {
        self.draw_frame(frame, true);
    }
}

/// Columns and rows of cells, at least one, for a picture in at most `columns` x `rows`. A cell is two pixels high.
fn fit(picture: Window, columns: u32, rows: u32) -> (u32, u32) {
    let (columns, rows) = (columns.max(1), rows.max(1));
    let aspect = f64::from(picture.width()) / f64::from(picture.height());
    let width = (f64::from(2 * rows) * aspect).round().clamp(1.0, f64::from(columns));
    let height = (width / aspect / 2.0).round().clamp(1.0, f64::from(rows));
    (width as u32, height as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PlaneData;

    #[test]
    fn pictures_fit_and_keep_their_shape() {
        assert_eq!(fit(Window::full(160, 90), 80, 100), (80, 23));
        assert_eq!(fit(Window::full(100, 100), 80, 22), (44, 22));
        assert_eq!(fit(Window::full(65536, 1), 80, 24), (80, 1));
        assert_eq!(fit(Window::full(1, 65536), 80, 24), (1, 24));
        assert_eq!(fit(Window::full(1, 1), 0, 0), (1, 1));
    }

    /// Two pixels in one cell, byte by byte: red above (linear 1), middle gray below (linear 0.5 is level 188).
    #[test]
    fn a_cell_is_two_pixels() {
        let mut film = Film::full(1, 2).unwrap();
        for (name, plane) in [("R", [1.0, 0.5]), ("G", [0.0, 0.5]), ("B", [0.0, 0.5])] {
            film.push(name, PlaneData::F32(plane.to_vec())).unwrap();
        }
        let terminal = Terminal::new(Vec::new(), Some((1, 3)), film.window, 0.0);
        terminal.finish(&film);
        let state = terminal.state.into_inner().unwrap();
        let text = String::from_utf8(state.out).unwrap();
        assert_eq!(text, "\u{1b}[38;2;255;0;0;48;2;188;188;188m\u{2580}\u{1b}[0m\r\n\u{1b}[2K\r\n");
    }
}
