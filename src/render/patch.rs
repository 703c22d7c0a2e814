//! Pixels into planes.

use std::ops::Range;

use super::aov::{Aov, COLOR, Channel, Get, LEVELS};
use super::options::RenderOptions;
use super::pixels::Pixel;
use super::sums::Finished;
use crate::camera::{morton_decode, morton_encode};
use crate::film::pix::{level, levels};
use crate::film::{Film, Plane, PlaneData, Window};
use crate::lanes::ask_for_large_pages;

/// Pixels of a block of 4 x 4.
const BLOCK: usize = 16;
/// Numbers of the pairs of pixels that make up its rows, in Morton order.
const BLOCK_ROWS: [[usize; 2]; 4] = [[0, 2], [1, 3], [4, 6], [5, 7]];
/// Pixels of the rows of most tiles.
const TILE: usize = 32;

/// The planes of a picture: its colours, and those of its AOVs.
pub(super) struct Channels {
    list: Vec<Channel>,
    /// How many of them are colours.
    colors: usize,
    /// What radiance is multiplied by before it becomes levels.
    gain: f64,
}

impl Channels {
    /// Those that `options` ask for.
    pub fn new(options: &RenderOptions) -> Self {
        let colors = if options.levels.is_some() { &LEVELS[..] } else { &COLOR };
        let extra = Aov::ALL.into_iter().filter(|aov| options.aovs.contains(aov)).flat_map(Aov::channels);
        let gain = f64::from(options.levels.unwrap_or(0.0)).exp2();
        Self { list: colors.iter().chain(extra).copied().collect(), colors: colors.len(), gain }
    }

    /// A list for each plane, made of `f32`s, `u32`s or `u8`s.
    fn data(
        &self,
        f32s: impl Fn(fn(&Pixel) -> f64) -> Vec<f32>,
        u32s: impl Fn(fn(&Pixel) -> u32) -> Vec<u32>,
        u8s: impl Fn(fn(&Pixel) -> f64) -> Vec<u8>,
    ) -> impl Iterator<Item = PlaneData> {
        self.list.iter().map(move |channel| match channel.get {
            Get::F32(get) => PlaneData::F32(f32s(get)),
            Get::U32(get) => PlaneData::U32(u32s(get)),
            Get::U8(get) => PlaneData::U8(u8s(get)),
        })
    }
}

/// A film of misses in a black world.
pub(super) fn empty_film(size: (u32, u32), window: Window, channels: &Channels) -> Film {
    let area = window.area() as usize;
    let data = channels.data(
        |get| vec![get(&Pixel::EMPTY) as f32; area],
        |get| vec![get(&Pixel::EMPTY); area],
        |get| vec![level(get(&Pixel::EMPTY)); area],
    );
    let plane = |(channel, data): (&Channel, _)| Plane { name: channel.name.to_string(), data };
    let planes: Vec<Plane> = channels.list.iter().zip(data).map(plane).collect();
    for plane in &planes {
        match &plane.data {
            PlaneData::F32(values) => ask_for_large_pages(values),
            PlaneData::U32(values) => ask_for_large_pages(values),
            PlaneData::U8(values) => ask_for_large_pages(values),
        }
    }
    Film { width: size.0, height: size.1, window, planes, texts: Vec::new() }
}

/// Which pixels a batch has, in the order of their values.
#[derive(Clone, Copy)]
pub(super) enum Layout<'a> {
    /// These.
    Listed(&'a [(u32, u32)]),
    /// Those of a square in Morton order: its upper left pixel and its edge, a multiple of 4.
    Square((u32, u32), u32),
}

/// What the planes get from a batch of pixels: worked out before the film is locked, which is then a matter of copying.
#[derive(Default)]
pub(super) struct Patch {
    /// Numbers of first values, and the places in the planes where they and those behind them go.
    runs: Vec<(usize, Range<usize>)>,
    /// Numbers of pixels in the order of their values, if there are planes besides colours.
    order: Vec<u32>,
    /// Those pixels.
    pixels: Vec<Pixel>,
    /// By channel: the value of each pixel, of squares row by row.
    values: Vec<PlaneData>,
    /// By channel: the colour of each pixel, rounded.
    colors: [Vec<f32>; 4],
    /// One channel, row by row.
    rows: Vec<f32>,
    square: Square,
}

impl Patch {
    /// Takes the planes' values of the pixels of `layout` from `finished`, parallel to them, and forgets earlier ones; those in
    /// `window` are painted. `channels` are the same each time.
    pub fn fill(&mut self, channels: &Channels, window: Window, layout: Layout<'_>, finished: Finished<'_>) {
        self.lay_out(window, layout);
        if self.values.is_empty() {
            self.values.extend(channels.data(|_| Vec::new(), |_| Vec::new(), |_| Vec::new()));
        }
        let (colors, further) = self.values.split_at_mut(channels.colors);
        let (count, square) = match layout {
            Layout::Listed(pixels) => (pixels.len(), None),
            Layout::Square(_, edge) => {
                self.square.resize(edge as usize);
                ((edge * edge) as usize, Some(&self.square))
            }
        };
        let of_colors = &mut self.colors[..channels.colors];
        of_colors.iter_mut().for_each(|channel| channel.resize(count, 0.0));
        finished.colors(of_colors);
        take_colors(channels.gain, of_colors, square, colors, &mut self.rows);
        if further.is_empty() {
            return;
        }
        self.order.clear();
        match layout {
            Layout::Listed(pixels) => self.order.extend(0..pixels.len() as u32),
            Layout::Square(_, edge) => {
                self.order.extend((0..edge * edge).map(|place| morton_encode(place % edge, place / edge)));
            }
        }
        self.pixels.clear();
        self.pixels.extend(self.order.iter().map(|&number| finished.pixel(number as usize)));
        for (channel, values) in channels.list[channels.colors..].iter().zip(further) {
            match (channel.get, values) {
                (Get::F32(get), PlaneData::F32(values)) => {
                    values.clear();
                    values.extend(self.pixels.iter().map(|pixel| get(pixel) as f32));
                }
                (Get::U32(get), PlaneData::U32(values)) => {
                    values.clear();
                    values.extend(self.pixels.iter().map(get));
                }
                _ => unreachable!("values are made from the channels"),
            }
        }
    }

    /// Where the values of those pixels of `layout` go that lie in `window`, neighbours together.
    fn lay_out(&mut self, window: Window, layout: Layout<'_>) {
        self.runs.clear();
        match layout {
            Layout::Listed(pixels) => {
                for (number, &(x, y)) in pixels.iter().enumerate() {
                    self.runs.extend(window.index(x, y).map(|place| (number, place..place + 1)));
                }
            }
            Layout::Square((left, top), edge) => {
                let columns = left.max(window.x0)..(left + edge).min(window.x1);
                for y in top.max(window.y0)..(top + edge).min(window.y1) {
                    let Some(place) = window.index(columns.start, y) else { continue };
                    let number = (y - top) * edge + (columns.start - left);
                    self.runs.push((number as usize, place..place + columns.len()));
                }
            }
        }
    }

    /// Places in the planes that it covers.
    pub fn places(&self) -> impl Iterator<Item = usize> {
        self.runs.iter().flat_map(|(_, places)| places.clone())
    }

    /// Copies the values to `film`, which has the planes of the channels and the window that they were taken for.
    pub fn paint(&self, film: &mut Film) {
        for (plane, values) in film.planes.iter_mut().zip(&self.values) {
            match (&mut plane.data, values) {
                (PlaneData::F32(data), PlaneData::F32(values)) => copy(&self.runs, values, data),
                (PlaneData::U32(data), PlaneData::U32(values)) => copy(&self.runs, values, data),
                (PlaneData::U8(data), PlaneData::U8(values)) => copy(&self.runs, values, data),
                _ => unreachable!("planes are made from the channels"),
            }
        }
    }
}

/// Makes `planes` the `colors` of pixels, as floats or as levels of `gain` times as much; of a square if it has an edge.
fn take_colors(gain: f64, colors: &[Vec<f32>], square: Option<&Square>, planes: &mut [PlaneData], rows: &mut Vec<f32>) {
    for (colors, plane) in colors.iter().zip(planes) {
        match plane {
            PlaneData::F32(values) => in_rows(colors, square, values),
            PlaneData::U8(values) => {
                in_rows(colors, square, rows);
                values.resize(rows.len(), 0);
                levels(rows, gain, values);
            }
            PlaneData::U32(_) => unreachable!("colours are no numbers"),
        }
    }
}

/// Writes the values of pixels where they belong: in a square row by row.
fn in_rows(values: &[f32], square: Option<&Square>, to: &mut Vec<f32>) {
    to.resize(values.len(), 0.0);
    let Some(Square { edge, blocks }) = square else { return to.copy_from_slice(values) };
    for (values, &first) in values.as_chunks::<BLOCK>().0.iter().zip(blocks) {
        let pairs = values.as_chunks::<2>().0;
        for (row, [left, right]) in BLOCK_ROWS.iter().enumerate() {
            let to = &mut to[first + row * edge..][..4];
            to[..2].copy_from_slice(&pairs[*left]);
            to[2..].copy_from_slice(&pairs[*right]);
        }
    }
}

/// Where the blocks of a square begin, in rows of pixels.
#[derive(Default)]
struct Square {
    edge: usize,
    blocks: Vec<usize>,
}

impl Square {
    /// Makes it one of `edge` pixels on a side.
    fn resize(&mut self, edge: usize) {
        if self.edge != edge {
            let place = |(x, y): (u32, u32)| y as usize * edge + x as usize;
            self.edge = edge;
            self.blocks.clear();
            self.blocks.extend((0..edge * edge).step_by(BLOCK).map(|pixel| place(morton_decode(pixel as u32))));
        }
    }
}

fn copy<T: Copy>(runs: &[(usize, Range<usize>)], values: &[T], data: &mut [T]) {
    for (first, places) in runs {
        let values = &values[*first..][..places.len()];
        match (values, values.first_chunk::<TILE>()) {
            // Blocks of pixels are far from each other, rows of tiles short: no call for each.
            ([value], _) => data[places.start] = *value,
            (_, Some(row)) if values.len() == TILE => data[places.clone()].copy_from_slice(row),
            _ => data[places.clone()].copy_from_slice(values),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::shade::{FirstHit, Rgba, Samples};

    #[test]
    fn planes_are_named_and_row_major_over_the_window() {
        let window = Window { x0: 4, y0: 2, x1: 7, y1: 4 };
        let channels = Channels::new(&RenderOptions { aovs: vec![Aov::Primitive, Aov::Z], ..Default::default() });
        let mut film = empty_film((10, 10), window, &channels);
        let color = Rgba { radiance: DVec3::new(1.0, 2.0, 3.0), alpha: 1.0 };
        let hit = FirstHit { distance: 4.0, prim: 9, ..FirstHit::NONE };
        let samples = |count| Samples { colors: std::iter::repeat_n(color, count).collect(), hits: vec![hit; count] };
        let mut patch = Patch::default();
        patch.fill(&channels, window, Layout::Listed(&[(4, 2)]), Finished::Samples(&samples(1)));
        let pixels = [(5, 3), (7, 3), (5, 4)];
        patch.fill(&channels, window, Layout::Listed(&pixels), Finished::Samples(&samples(3)));
        patch.paint(&mut film);
        assert_eq!(patch.places().collect::<Vec<_>>(), [4]);
        let names: Vec<&str> = film.planes.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["R", "G", "B", "A", "Z", "id.primitive"]);
        let (inf, none) = (f32::INFINITY, u32::MAX);
        assert_eq!(film.planes[2].data, PlaneData::F32(vec![0.0, 0.0, 0.0, 0.0, 3.0, 0.0]));
        assert_eq!(film.planes[4].data, PlaneData::F32(vec![inf, inf, inf, inf, 4.0, inf]));
        assert_eq!(film.planes[5].data, PlaneData::U32(vec![none, none, none, none, 9, none]));
    }

    #[test]
    fn squares_are_painted_row_by_row() {
        let window = Window { x0: 1, y0: 0, x1: 4, y1: 3 };
        let channels = Channels::new(&RenderOptions::default());
        let shown = |(x, y): (u32, u32)| Rgba { radiance: DVec3::splat(f64::from(10 * y + x)), alpha: 1.0 };
        let paint = |corner: (u32, u32), edge: u32| {
            let mut film = empty_film((5, 5), window, &channels);
            let pixels: Vec<_> =
                (0..edge * edge).map(morton_decode).map(|(x, y)| (corner.0 + x, corner.1 + y)).collect();
            let samples = Samples { colors: pixels.iter().copied().map(shown).collect(), hits: Vec::new() };
            let mut patch = Patch::default();
            patch.fill(&channels, window, Layout::Square(corner, edge), Finished::Samples(&samples));
            patch.paint(&mut film);
            (patch.runs, film.planes[0].data.clone())
        };
        let (runs, red) = paint((0, 0), 4);
        assert_eq!(runs, [(1, 0..3), (5, 3..6), (9, 6..9)]);
        assert_eq!(red, PlaneData::F32(vec![1.0, 2.0, 3.0, 11.0, 12.0, 13.0, 21.0, 22.0, 23.0]));
        let (runs, red) = paint((2, 1), 8);
        let expected = vec![0.0, 0.0, 0.0, 0.0, 12.0, 13.0, 0.0, 22.0, 23.0];
        assert_eq!((runs, red), (vec![(0, 4..6), (8, 7..9)], PlaneData::F32(expected)));
        assert!(paint((4, 0), 8).0.is_empty() && paint((0, 8), 8).0.is_empty());
    }
}
