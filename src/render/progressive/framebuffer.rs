//! A film that remembers which of its pixels are set, and what stands for those that are not.

use super::super::patch::Patch;
use crate::film::{Film, PlaneData, Window};

/// Pixels of a picture in the making.
pub struct Framebuffer {
    film: Film,
    /// By pixel of the window, row by row.
    set: Vec<bool>,
    /// Edge of the first blocks, pixels.
    start: u32,
    /// Pixels not set.
    left: u64,
}

impl Framebuffer {
    pub(super) fn new(film: Film, start: u32) -> Self {
        let left = film.window.area();
        Self { film, set: vec![false; left as usize], start, left }
    }

    /// The planes. Pixels that are not set are misses in a black world here; [`Self::shown`] says what stands for them.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The part of the picture that the planes cover.
    pub fn window(&self) -> Window {
        self.film.window
    }

    /// Whether pixel (x, y) of the picture is set; false outside of the window.
    pub fn is_set(&self, x: u32, y: u32) -> bool {
        self.window().index(x, y).is_some_and(|index| self.set[index])
    }

    /// Number of pixels that are not set.
    pub fn left(&self) -> u64 {
        self.left
    }

    /// Index (in the planes) of the pixel shown at (x, y): its own if it is set, else that of the smallest block around it
    /// that has a colour. `None` outside of the window, and where nothing is set yet.
    #[inline]
    pub fn shown(&self, x: u32, y: u32) -> Option<usize> {
        let window = self.window();
        let own = window.index(x, y)?;
        if self.set[own] {
            return Some(own);
        }
        let (dx, dy) = (x - window.x0, y - window.y0);
        let mut block = 2;
        while block <= self.start {
            let corner = (dy & !(block - 1)) as usize * window.width() as usize + (dx & !(block - 1)) as usize;
            if self.set[corner] {
                return Some(corner);
            }
            block *= 2;
        }
        None
    }

    /// Sets pixels; a later call changes their values (further samples).
    pub(super) fn paint(&mut self, patch: &Patch) {
        for place in patch.places() {
            self.left -= u64::from(!self.set[place]);
            self.set[place] = true;
        }
        patch.paint(&mut self.film);
    }

    /// The picture as it is shown: pixels that are not set get the planes of their block.
    pub(super) fn into_film(mut self) -> Film {
        if self.left > 0 {
            let window = self.window();
            let shown: Vec<(usize, usize)> = (window.y0..window.y1)
                .flat_map(|y| (window.x0..window.x1).map(move |x| (x, y)))
                .enumerate()
                .filter(|(own, _)| !self.set[*own])
                .filter_map(|(own, (x, y))| Some((own, self.shown(x, y)?)))
                .collect();
            for plane in &mut self.film.planes {
                // Sources are set, destinations are not: the order does not matter.
                match &mut plane.data {
                    PlaneData::F32(data) => shown.iter().for_each(|&(to, from)| data[to] = data[from]),
                    PlaneData::U32(data) => shown.iter().for_each(|&(to, from)| data[to] = data[from]),
                    PlaneData::U8(data) => shown.iter().for_each(|&(to, from)| data[to] = data[from]),
                }
            }
        }
        self.film
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::super::patch::{Channels, Layout, empty_film};
    use super::super::super::sums::Finished;
    use super::*;
    use crate::shade::{Rgba, Samples};

    #[test]
    fn the_smallest_block_with_a_colour_is_shown() {
        let window = Window { x0: 3, y0: 5, x1: 12, y1: 14 };
        let channels = Channels::new(&Default::default());
        let mut frame = Framebuffer::new(empty_film((20, 20), window, &channels), 8);
        let mut patch = Patch::default();
        let mut put = |frame: &mut Framebuffer, pixel, value| {
            let gray = Rgba { radiance: DVec3::splat(value), alpha: 1.0 };
            let samples = Samples { colors: [gray].into_iter().collect(), hits: Vec::new() };
            patch.fill(&channels, window, Layout::Listed(&[pixel]), Finished::Samples(&samples));
            frame.paint(&patch);
        };
        assert_eq!((frame.shown(3, 5), frame.left()), (None, 81));
        put(&mut frame, (3, 5), 1.0);
        put(&mut frame, (7, 5), 2.0);
        put(&mut frame, (8, 6), 3.0);
        // Row of the window: dx = 0..8 belong to the first block of 8; the block of 4 at dx = 4 is set.
        let at = |x: u32, y: u32| frame.shown(x, y).map(|i| frame.film().f32_plane("R").unwrap()[i]);
        assert_eq!([at(3, 5), at(6, 12), at(7, 5), at(10, 8)], [Some(1.0), Some(1.0), Some(2.0), Some(2.0)]);
        assert_eq!(
            [at(8, 6), at(9, 6), at(11, 5), at(3, 13), at(12, 5), at(2, 5)],
            [Some(3.0), Some(2.0), None, None, None, None]
        );
        assert!(frame.is_set(8, 6) && !frame.is_set(9, 6) && !frame.is_set(0, 0));
        assert_eq!(frame.left(), 78);
        let red = frame.into_film();
        let red = red.f32_plane("R").unwrap();
        assert_eq!((red[0], red[8], red[3], red[4], red[9 + 5]), (1.0, 0.0, 1.0, 2.0, 3.0));
    }
}
