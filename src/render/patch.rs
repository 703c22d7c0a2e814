//! Pixels into planes.

use std::ops::Range;

use super::aov::{Aov, COLOR, Channel, Get};
use super::pixels::Pixel;
use super::sums::Finished;
use crate::film::{Film, Plane, PlaneData, Window};
use crate::shade::Rgba;

/// The planes of a picture: colour, coverage, and those of `aovs`.
pub(super) fn channels(aovs: &[Aov]) -> Vec<Channel> {
    let extra = Aov::ALL.into_iter().filter(|aov| aovs.contains(aov)).flat_map(Aov::channels);
    COLOR.iter().chain(extra).copied().collect()
}

/// A film of misses in a black world.
pub(super) fn empty_film(size: (u32, u32), window: Window, channels: &[Channel]) -> Film {
    let area = window.area() as usize;
    let data = |channel: &Channel| match channel.get {
        Get::F32(get) => PlaneData::F32(vec![get(&Pixel::EMPTY) as f32; area]),
        Get::U32(get) => PlaneData::U32(vec![get(&Pixel::EMPTY); area]),
    };
    let planes = channels.iter().map(|channel| Plane { name: channel.name.to_string(), data: data(channel) }).collect();
    Film { width: size.0, height: size.1, window, planes, texts: Vec::new() }
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
    /// By channel: the value of each place.
    values: Vec<PlaneData>,
}

impl Patch {
    /// Takes the planes' values of those of `pixels` that lie in `window` from `finished`, parallel to them, and forgets
    /// earlier ones; `channels` are the same each time. `order` has the numbers of the pixels, row by row if possible:
    /// neighbours are painted together.
    pub fn fill(
        &mut self,
        channels: &[Channel],
        window: Window,
        pixels: &[(u32, u32)],
        order: impl Iterator<Item = usize>,
        finished: Finished<'_>,
    ) {
        self.runs.clear();
        self.kept.clear();
        for number in order {
            let (x, y) = pixels[number];
            let Some(place) = window.index(x, y) else { continue };
            self.kept.push(number as u32);
            match self.runs.last_mut() {
                Some(run) if run.end == place => run.end += 1,
                _ => self.runs.push(place..place + 1),
            }
        }
        if self.values.is_empty() {
            self.values.extend(channels.iter().map(|channel| match channel.get {
                Get::F32(_) => PlaneData::F32(Vec::new()),
                Get::U32(_) => PlaneData::U32(Vec::new()),
            }));
        }
        let kept = self.kept.iter().map(|&number| number as usize);
        let (color, further) = self.values.split_at_mut(COLOR.len());
        if let [PlaneData::F32(r), PlaneData::F32(g), PlaneData::F32(b), PlaneData::F32(a)] = color {
            for list in [&mut *r, &mut *g, &mut *b, &mut *a] {
                list.resize(self.kept.len(), 0.0);
            }
            let lists = r.iter_mut().zip(g).zip(b.iter_mut().zip(a));
            for (((r, g), (b, a)), number) in lists.zip(kept.clone()) {
                let Rgba { radiance, alpha } = finished.color(number);
                (*r, *g, *b, *a) = (radiance.x as f32, radiance.y as f32, radiance.z as f32, alpha as f32);
            }
        }
        if further.is_empty() {
            return;
        }
        self.pixels.clear();
        self.pixels.extend(kept.map(|number| finished.pixel(number)));
        for (channel, values) in channels[COLOR.len()..].iter().zip(further) {
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
                _ => unreachable!("planes are made from the channels"),
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
    use crate::shade::{FirstHit, Samples};

    #[test]
    fn planes_are_named_and_row_major_over_the_window() {
        let window = Window { x0: 4, y0: 2, x1: 7, y1: 4 };
        let channels = channels(&[Aov::Primitive, Aov::Z]);
        let mut film = empty_film((10, 10), window, &channels);
        let color = Rgba { radiance: DVec3::new(1.0, 2.0, 3.0), alpha: 1.0 };
        let hit = FirstHit { distance: 4.0, prim: 9, ..FirstHit::NONE };
        let samples = |count| Samples { colors: vec![color; count], hits: vec![hit; count] };
        let mut patch = Patch::default();
        patch.fill(&channels, window, &[(4, 2)], 0..1, Finished::Samples(&samples(1)));
        patch.fill(&channels, window, &[(5, 3), (7, 3), (5, 4)], 0..3, Finished::Samples(&samples(3)));
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
    fn neighbours_are_painted_together_and_in_their_places() {
        let window = Window { x0: 1, y0: 0, x1: 4, y1: 3 };
        let channels = channels(&[]);
        let mut film = empty_film((5, 5), window, &channels);
        let pixels = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0), (2, 1), (3, 1), (3, 2)];
        let shown = |&(x, y): &(u32, u32)| Rgba { radiance: DVec3::splat(f64::from(10 * y + x)), alpha: 1.0 };
        let samples = Samples { colors: pixels.iter().map(shown).collect(), hits: Vec::new() };
        let mut patch = Patch::default();
        let rows = [0, 1, 4, 5, 2, 3, 6, 7, 8];
        patch.fill(&channels, window, &pixels, rows.into_iter(), Finished::Samples(&samples));
        patch.paint(&mut film);
        assert_eq!(patch.runs, [0..6, 8..9]);
        assert_eq!(film.planes[0].data, PlaneData::F32(vec![1.0, 2.0, 3.0, 11.0, 12.0, 13.0, 0.0, 0.0, 23.0]));
    }
}
