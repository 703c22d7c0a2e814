//! What a window shows: a picture as display levels, with a few lines of text over it.

use std::convert::Infallible;

use embedded_graphics::Drawable;
use embedded_graphics::Pixel;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::iso_8859_1::FONT_7X13;
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::text::{Baseline, Text};

use crate::film::Film;
use crate::view::levels::Levels;

/// Height of a line of text, pixels.
pub const LINE: u32 = 15;
/// Width of a character, pixels.
const CHARACTER: u32 = 7;
/// Space left of the text, pixels.
pub const MARGIN: u32 = 4;

/// A picture ready for a display: rows from the top, 0x00RRGGBB.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Screen {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The pixels.
    pub pixels: Vec<u32>,
}

impl Screen {
    /// Shows `film` over black, times 2^`exposure`: of pixel (x, y) the plane's sample at `shown(x, y)`.
    pub fn show(&mut self, film: &Film, exposure: f32, levels: &Levels, shown: impl Fn(u32, u32) -> Option<usize>) {
        (self.width, self.height) = (film.width, film.height);
        self.pixels.clear();
        let Ok([red, green, blue]) = film.color() else {
            self.pixels.resize((self.width * self.height) as usize, 0);
            return;
        };
        let gain = exposure.exp2();
        let level = |plane: &[f32], i: usize| u32::from(levels.level(plane[i] * gain));
        for y in 0..film.height {
            self.pixels.extend((0..film.width).map(|x| match shown(x, y) {
                Some(i) => level(red, i) << 16 | level(green, i) << 8 | level(blue, i),
                None => 0,
            }));
        }
    }

    /// Writes lines of text on a darkened ground, from row `top` on; what does not fit is cut off.
    pub fn write(&mut self, top: u32, lines: &[&str]) {
        let style = MonoTextStyle::new(&FONT_7X13, Rgb888::WHITE);
        for (i, line) in lines.iter().enumerate() {
            let y0 = top + LINE * i as u32;
            let width = (2 * MARGIN + CHARACTER * line.chars().count() as u32).min(self.width);
            for y in y0.min(self.height)..(y0 + LINE).min(self.height) {
                let start = (y * self.width) as usize;
                // A quarter as bright.
                self.pixels[start..start + width as usize].iter_mut().for_each(|p| *p = *p >> 2 & 0x003f_3f3f);
            }
            let place = Point::new(MARGIN as i32, y0 as i32 + 1);
            let Ok(_) = Text::with_baseline(line, place, style, Baseline::Top).draw(self);
        }
    }

    /// Fills the rectangle of `size` = (width, height) at `corner` = (x, y); what does not fit is cut off.
    pub fn fill(&mut self, corner: (u32, u32), size: (u32, u32), color: u32) {
        let [x0, x1] = [corner.0, corner.0 + size.0].map(|x| x.min(self.width));
        for y in corner.1.min(self.height)..(corner.1 + size.1).min(self.height) {
            self.pixels[(y * self.width + x0) as usize..(y * self.width + x1) as usize].fill(color);
        }
    }

    /// The same picture for a place of another size: the nearest pixels.
    pub fn copy_to(&self, width: u32, height: u32, out: &mut [u32]) {
        if (width, height) == (self.width, self.height) && out.len() == self.pixels.len() {
            out.copy_from_slice(&self.pixels);
        } else if self.pixels.is_empty() {
            out.fill(0);
        } else {
            for (i, pixel) in out.iter_mut().enumerate() {
                let (x, y) = (i as u64 % u64::from(width), i as u64 / u64::from(width));
                let x = x * u64::from(self.width) / u64::from(width);
                let y = (y * u64::from(self.height) / u64::from(height)).min(u64::from(self.height) - 1);
                *pixel = self.pixels[(y * u64::from(self.width) + x) as usize];
            }
        }
    }
}

impl OriginDimensions for Screen {
    fn size(&self) -> Size {
        Size::new(self.width, self.height)
    }
}

impl DrawTarget for Screen {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(place, color) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(place.x), u32::try_from(place.y)) else { continue };
            if x < self.width && y < self.height {
                let [r, g, b] = [color.r(), color.g(), color.b()].map(u32::from);
                self.pixels[(y * self.width + x) as usize] = r << 16 | g << 8 | b;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PlaneData;

    fn gray(width: u32, height: u32, value: f32) -> Screen {
        let mut film = Film::full(width, height).unwrap();
        for name in ["R", "G", "B"] {
            film.push(name, PlaneData::F32(vec![value; (width * height) as usize])).unwrap();
        }
        let mut screen = Screen::default();
        screen.show(&film, 0.0, &Levels::default(), |x, y| (x > 0).then_some((y * width + x) as usize));
        screen
    }

    #[test]
    fn pixels_are_display_levels() {
        // Linear 0.5 is level 188.
        assert_eq!(gray(2, 1, 0.5).pixels, [0, 0x00bc_bcbc]);
    }

    #[test]
    fn text_is_white_on_dark_and_stays_inside() {
        let mut screen = gray(40, 30, 1.0);
        screen.write(20, &["Hi \u{e9}, this is longer than the picture", "and below it"]);
        assert_eq!(screen.pixels.len(), 1200);
        let row = |y: usize| &screen.pixels[y * 40..][..40];
        assert!((0..20).all(|y| row(y)[1..].iter().all(|&p| p == 0x00ff_ffff)));
        let ink = (20..30).flat_map(row).filter(|&&p| p == 0x00ff_ffff).count();
        let ground = (20..30).flat_map(row).filter(|&&p| p == 0x003f_3f3f).count();
        assert!(ink > 20 && ground > ink, "{ink} {ground}");
        screen.write(4000, &["far below"]);
        Screen::default().write(0, &["nothing to write on"]);
    }

    #[test]
    fn other_sizes_take_the_nearest_pixels() {
        let screen = Screen { width: 2, height: 1, pixels: vec![1, 2] };
        let mut out = vec![9; 8];
        screen.copy_to(4, 2, &mut out);
        assert_eq!(out, [1, 1, 2, 2, 1, 1, 2, 2]);
        screen.copy_to(2, 1, &mut out[..2]);
        assert_eq!(out[..2], [1, 2]);
        Screen::default().copy_to(4, 2, &mut out);
        assert_eq!(out, [0; 8]);
    }
}
