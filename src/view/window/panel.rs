//! Sliders for a scene's parameters, in the upper left corner of a window.

use super::screen::{LINE, MARGIN, Screen};
use crate::scene::parameter::Parameter;

/// Length of a slider, pixels.
const LENGTH: u32 = 200;
/// Thickness of a slider, pixels.
const THICKNESS: u32 = 9;
/// Space below a slider, pixels.
const GAP: u32 = 4;
/// Rows of a parameter: its name and value, its slider, the space below.
const ROW: u32 = LINE + THICKNESS + GAP;
/// What is set, 0x00RRGGBB.
const FILLED: u32 = 0x00e0_a040;
/// What is not.
const EMPTY: u32 = 0x0040_4040;

/// Draws names, values and sliders; those that do not fit are left out.
pub fn draw(screen: &mut Screen, parameters: &[Parameter]) {
    for (i, parameter) in (0..).zip(parameters) {
        let top = i * ROW;
        if top + ROW > screen.height {
            return;
        }
        screen.write(top, &[&format!("{} {}", parameter.name, parameter.value)]);
        let filled = (parameter.share() * f64::from(LENGTH)).round() as u32;
        screen.fill((MARGIN, top + LINE), (filled, THICKNESS), FILLED);
        screen.fill((MARGIN + filled, top + LINE), (LENGTH - filled, THICKNESS), EMPTY);
    }
}

/// Number of the slider under (x, y), pixels, of `count` sliders; its name counts too.
pub fn slider_at(x: f64, y: f64, count: usize) -> Option<usize> {
    let inside = x >= 0.0 && y >= 0.0 && x < f64::from(LENGTH + 2 * MARGIN);
    let row = (y / f64::from(ROW)) as usize;
    let in_gap = y - row as f64 * f64::from(ROW) >= f64::from(ROW - GAP);
    (inside && !in_gap && row < count).then_some(row)
}

/// The share of a slider's length at `x`, pixels.
pub fn share_at(x: f64) -> f64 {
    ((x - f64::from(MARGIN)) / f64::from(LENGTH)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sliders_are_hit_where_they_are_drawn() {
        let parameters = [Parameter::new("a", 1.0), Parameter { value: 1.5, ..Parameter::new("b", 1.0) }];
        let (width, height) = (300, 2 * ROW + 3);
        let mut screen = Screen { width, height, pixels: vec![0; (width * height) as usize] };
        draw(&mut screen, &parameters);
        let mut ends = [0; 2];
        for y in 0..height {
            for x in 0..width {
                let color = screen.pixels[(y * width + x) as usize];
                if color == FILLED || color == EMPTY {
                    let row = slider_at(f64::from(x), f64::from(y), 2).expect("a slider");
                    assert_eq!(row as u32, y / ROW);
                    ends[row] = ends[row].max(if color == FILLED { x + 1 } else { 0 });
                }
            }
        }
        assert_eq!(ends, [MARGIN + LENGTH / 2, MARGIN + 3 * LENGTH / 4]);
        assert_eq!(ends.map(|x| share_at(f64::from(x))), [0.5, 0.75]);
        assert_eq!([slider_at(5.0, 60.0, 2), slider_at(250.0, 5.0, 2), slider_at(-1.0, 5.0, 2)], [None; 3]);
        draw(&mut Screen::default(), &parameters);
    }
}
