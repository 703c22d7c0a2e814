//! Pixels into planes.

use std::ops::Range;

use super::aov::{Aov, COLOR, Channel, Get, LEVELS};
use super::options::RenderOptions;
use super::pixels::Pixel;
use super::sums::Finished;
use crate::camera::morton_encode;
use crate::film::pix::{level, levels};
use crate::film::{Film, Plane, PlaneData, Window};
use crate::lanes::ask_for_large_pages;

/// Pixels whose colours become planes together.
const ROW: usize = 32;

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
    /// Those of a square in Morton order: its upper left pixel and its edge.
    Square((u32, u32), u32),
}

/// What the planes get from a batch of pixels: worked out before the film is locked, which is then a matter of copying.
#[derive(Default)]
pub(super) struct Patch {
    /// Places in the planes, one after the other as far as they are neighbours.
    runs: Vec<Range<usize>>,
    /// Numbers of the pixels that have one.
    kept: Vec<u32>,
    /// Those pixels, if there are planes besides colours.
    pixels: Vec<Pixel>,
    /// Numbers of the pixels of a square's first row.
    columns: Vec<u32>,
    /// By channel: the value of each place.
    values: Vec<PlaneData>,
}

impl Patch {
    /// Takes the planes' values of those pixels of `layout` that lie in `window` from `finished`, parallel to them, and forgets
    /// earlier ones; `channels` are the same each time.
    pub fn fill(&mut self, channels: &Channels, window: Window, layout: Layout<'_>, finished: Finished<'_>) {
        self.lay_out(window, layout);
        if self.values.is_empty() {
            self.values.extend(channels.data(|_| Vec::new(), |_| Vec::new(), |_| Vec::new()));
        }
        let (colors, further) = self.values.split_at_mut(channels.colors);
        take_colors(channels.gain, &self.kept, finished, colors);
        if further.is_empty() {
            return;
        }
        self.pixels.clear();
        self.pixels.extend(self.kept.iter().map(|&number| finished.pixel(number as usize)));
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

    /// Places and numbers of the pixels of `layout` in `window`, neighbours together.
    fn lay_out(&mut self, window: Window, layout: Layout<'_>) {
        self.runs.clear();
        self.kept.clear();
        match layout {
            Layout::Listed(pixels) => {
                for (number, &(x, y)) in pixels.iter().enumerate() {
                    if let Some(place) = window.index(x, y) {
                        self.kept.push(number as u32);
                        self.runs.push(place..place + 1);
                    }
                }
            }
            Layout::Square((left, top), edge) => {
                let columns = left.max(window.x0)..(left + edge).min(window.x1);
                self.columns.clear();
                self.columns.extend(columns.clone().map(|x| morton_encode(x - left, 0)));
                for y in top.max(window.y0)..(top + edge).min(window.y1) {
                    let Some(place) = window.index(columns.start, y) else { continue };
                    let row = morton_encode(0, y - top);
                    self.kept.extend(self.columns.iter().map(|column| column | row));
                    self.runs.push(place..place + columns.len());
                }
            }
        }
    }

    /// Places in the planes that it covers.
    pub fn places(&self) -> impl Iterator<Item = usize> {
        self.runs.iter().cloned().flatten()
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

/// Makes `planes` the colours of the pixels `kept` of `finished`, as floats or as levels of `gain` times as much.
fn take_colors(gain: f64, kept: &[u32], finished: Finished<'_>, planes: &mut [PlaneData]) {
    for plane in &mut *planes {
        match plane {
            PlaneData::F32(values) => values.clear(),
            PlaneData::U32(values) => values.clear(),
            PlaneData::U8(values) => values.clear(),
        }
    }
    let mut rows = [[0.0; ROW]; 4];
    for numbers in kept.chunks(ROW) {
        finished.colors(numbers, &mut rows);
        for (row, plane) in rows.iter().zip(&mut *planes) {
            match plane {
                PlaneData::F32(values) => values.extend_from_slice(&row[..numbers.len()]),
                PlaneData::U8(values) => {
                    let mut of_row = [0; ROW];
                    levels(row, gain, &mut of_row);
                    values.extend_from_slice(&of_row[..numbers.len()]);
                }
                PlaneData::U32(_) => unreachable!("colours are no numbers"),
            }
        }
    }
}

fn copy<T: Copy>(runs: &[Range<usize>], values: &[T], data: &mut [T]) {
    let mut rest = values;
    for run in runs {
        let (values, others) = rest.split_at(run.len());
        rest = others;
        match values {
            // Blocks of pixels are far from each other: no call for each.
            [value] => data[run.start] = *value,
            _ => data[run.clone()].copy_from_slice(values),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::camera::morton_decode;
    use crate::shade::{FirstHit, Rgba, Samples};

    #[test]
    fn planes_are_named_and_row_major_over_the_window() {
        let window = Window { x0: 4, y0: 2, x1: 7, y1: 4 };
        let channels = Channels::new(&RenderOptions { aovs: vec![Aov::Primitive, Aov::Z], ..Default::default() });
        let mut film = empty_film((10, 10), window, &channels);
        let color = Rgba { radiance: DVec3::new(1.0, 2.0, 3.0), alpha: 1.0 };
        let hit = FirstHit { distance: 4.0, prim: 9, ..FirstHit::NONE };
        let samples = |count| Samples { colors: vec![color; count], hits: vec![hit; count] };
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
        let (runs, red) = paint((0, 0), 2);
        assert_eq!((runs, red), (vec![0..1, 3..4], PlaneData::F32(vec![1.0, 0.0, 0.0, 11.0, 0.0, 0.0, 0.0, 0.0, 0.0])));
        let (runs, red) = paint((2, 1), 4);
        let expected = vec![0.0, 0.0, 0.0, 0.0, 12.0, 13.0, 0.0, 22.0, 23.0];
        assert_eq!((runs, red), (vec![4..6, 7..9], PlaneData::F32(expected)));
        assert!(paint((4, 0), 8).0.is_empty() && paint((0, 8), 8).0.is_empty());
    }
}
