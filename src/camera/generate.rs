//! Primary rays of a tile.
//!
//! A pixel's ray is a function of camera, picture size, pixel and sample alone: f64 arithmetic in one fixed order,
//! rounded once to the engine's precision. Tile size, crop and thread do not enter.

use super::filter::Filter;
use super::model::Camera;
use super::passes::Passes;
use super::sampling::PixelRandom;
use super::sobol::{PixelPoints, fraction};
use super::tiles::{FILE_TILE, PixelRect, Tiling, morton_decode};
use crate::lanes::{Real, f64x8};
use crate::ray::Rays;
use crate::ray::pencil::{Pencil, Places};

/// Name of the sub-pixel offsets among the random dimensions of a pixel.
const DIMENSION: u32 = 0;

/// Tiles and samples reach less than so many times half the picture from its middle.
const PLACES: f64 = 1e3;

/// Pixels that are looked at together.
const BLOCK: usize = 16;

/// Where in its pixel a ray goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubPixel {
    /// Where the camera says: [`Camera::anchor`], the centre of most.
    Anchor,
    /// Through point `sample` of the pixel's own evenly spread sequence (see [`PixelRandom::spread`]).
    Sample {
        /// Number of the sample.
        sample: u32,
        /// Seed of the picture.
        seed: u64,
    },
    /// Where a filter puts point `sample` of the pixel's Sobol points.
    Filtered {
        /// Number of the sample.
        sample: u32,
        /// Seed of the picture.
        seed: u64,
        /// The filter.
        filter: Filter,
    },
}

impl SubPixel {
    /// Whether it is sure to lie in its pixel.
    pub fn is_in_pixel(&self) -> bool {
        !matches!(self, Self::Filtered { .. })
    }

    #[inline]
    pub(super) fn offset(self, anchor: [f64; 2], x: u32, y: u32) -> [f64; 2] {
        self.offsets(anchor, &[[x], [y]]).map(|[offset]| offset)
    }

    /// Those of pixels given as columns and rows, as such.
    #[inline]
    fn offsets<const N: usize>(self, anchor: [f64; 2], [x, y]: &[[u32; N]; 2]) -> [[f64; N]; 2] {
        let mut offsets = anchor.map(|a| [a; N]);
        match self {
            Self::Anchor => {}
            Self::Sample { sample, seed } => {
                for k in 0..N {
                    [offsets[0][k], offsets[1][k]] = PixelRandom::new(x[k], y[k], seed).spread(sample, DIMENSION);
                }
            }
            Self::Filtered { sample, seed, filter } => {
                let mut bits = [[0; N]; 2];
                for k in 0..N {
                    [bits[0][k], bits[1][k]] = PixelPoints::new(x[k], y[k], seed).bits(sample, DIMENSION);
                }
                offsets = bits.map(|bits| bits.map(|bits| 0.5 + filter.place(fraction(bits))));
            }
        }
        offsets
    }
}

/// Makes `rays` the primary rays of tile number `tile`, in Morton order; rays of pixels outside the picture or
/// outside `rect` are dead. Segments are [0, infinity]; directions are not unit (see [`Camera`]).
pub fn fill_tile<S: Real>(
    camera: &Camera,
    tiling: &Tiling,
    tile: u32,
    rect: PixelRect,
    sub_pixel: SubPixel,
    rays: &mut Rays<S>,
) {
    fill_passes(camera, tiling, tile, rect, &[sub_pixel], rays);
}

/// The same with a ray of each pixel for each of `sub_pixels`, in the order of [`Passes`]. Returns how many are live.
pub fn fill_passes<S: Real>(
    camera: &Camera,
    tiling: &Tiling,
    tile: u32,
    rect: PixelRect,
    sub_pixels: &[SubPixel],
    rays: &mut Rays<S>,
) -> u64 {
    let mut pencil = Pencil::default();
    if aim_passes(camera, tiling, tile, rect, sub_pixels, &mut pencil) {
        pencil.fill(rays);
    } else {
        let count = pencil.len();
        rays.prepare(count);
        for axis in 0..3 {
            let [eye, u, v] = [camera.eye, camera.u, camera.v].map(|of| f64x8::splat(of[axis]));
            pencil.places.combine(&mut rays.org[axis][..count], |a| a * u, |b| b * v, |au, bv| eye + (au + bv));
            rays.dir[axis][..count].fill(S::from_f64(-camera.n[axis]));
        }
        rays.t_min[..count].fill(S::ZERO);
        rays.t_max[..count].fill(S::INFINITY);
        pencil.kill(rays);
    }
    // Only numbers that are not finite make others dead: nobody need read the rays to count them.
    if is_within::<S>(camera) { pencil.live_count() } else { rays.live_count() as u64 }
}

/// Whether the numbers of all rays are finite in `S`.
fn is_within<S: Real>(camera: &Camera) -> bool {
    let largest = camera.eye.abs().max_element() + PLACES * (camera.half_width + camera.half_height) + 1.0;
    largest < S::MAX.to_f64()
}

/// Where the rays of [`fill_tile`] go. False for a parallel camera, whose rays have no point in common: places are then
/// on its image plane.
pub fn aim_tile(
    camera: &Camera,
    tiling: &Tiling,
    tile: u32,
    rect: PixelRect,
    sub_pixel: SubPixel,
    pencil: &mut Pencil,
) -> bool {
    aim_passes(camera, tiling, tile, rect, &[sub_pixel], pencil)
}

/// The same for [`fill_passes`].
fn aim_passes(
    camera: &Camera,
    tiling: &Tiling,
    tile: u32,
    rect: PixelRect,
    sub_pixels: &[SubPixel],
    pencil: &mut Pencil,
) -> bool {
    let passes = Passes::new(tiling, sub_pixels.len() as u32);
    let (x0, y0) = tiling.origin(tile);
    pencil.origin = camera.eye.to_array();
    pencil.axes = [camera.u, camera.v, -camera.n].map(|axis| axis.to_array());
    // Places on the image plane in units of u and v: Hill's W (2c / nCols - 1) and H (2r / nRows - 1).
    let (columns, rows) = (f64::from(tiling.width()), f64::from(tiling.height()));
    let across = |x: u32, sx: f64| {
        let c = f64::from(x) + sx;
        camera.half_width * (2.0 * c / columns - 1.0)
    };
    let up = |y: u32, sy: f64| {
        let r = rows - (f64::from(y) + sy);
        camera.half_height * (2.0 * r / rows - 1.0)
    };
    if sub_pixels == [SubPixel::Anchor] {
        let mut lines = [[0.0; FILE_TILE as usize]; 2];
        for k in 0..tiling.edge() {
            lines[0][k as usize] = across(x0 + k, camera.anchor[0]);
            lines[1][k as usize] = up(y0 + k, camera.anchor[1]);
        }
        pencil.places = Places::Grid(lines);
    } else {
        let mut lists = match std::mem::take(&mut pencil.places) {
            Places::Each(lists) => lists,
            Places::Grid(_) => Default::default(),
        };
        lists.iter_mut().for_each(|list| list.resize(passes.rays(), 0.0));
        for run in passes.runs() {
            for (pixel, ray) in run.pixels.step_by(BLOCK).zip(run.rays.step_by(BLOCK)) {
                let mut pixels = [[0; BLOCK]; 2];
                for k in 0..BLOCK {
                    let (dx, dy) = morton_decode((pixel + k) as u32);
                    (pixels[0][k], pixels[1][k]) = (x0 + dx, y0 + dy);
                }
                let offsets = sub_pixels[run.pass as usize].offsets(camera.anchor, &pixels);
                let [a, b] = &mut lists;
                for (k, (a, b)) in a[ray..].iter_mut().zip(&mut b[ray..]).enumerate().take(BLOCK) {
                    (*a, *b) = (across(pixels[0][k], offsets[0][k]), up(pixels[1][k], offsets[1][k]));
                }
            }
        }
        pencil.places = Places::Each(lists);
    }
    live_pixels(tiling, passes, (x0, y0), rect, &mut pencil.live);
    !camera.parallel
}

/// The rays whose pixels lie in the picture and in `rect`, bit by ray.
fn live_pixels(tiling: &Tiling, passes: Passes, (x0, y0): (u32, u32), rect: PixelRect, live: &mut Vec<u16>) {
    let wanted = PixelRect { x1: rect.x1.min(tiling.width()), y1: rect.y1.min(tiling.height()), ..rect };
    let last = tiling.edge() - 1;
    live.clear();
    live.resize(passes.rays() / 16, u16::MAX);
    if wanted.contains(x0, y0) && wanted.contains(x0 + last, y0 + last) {
        return;
    }
    for run in passes.runs() {
        for (live, pixel) in live[run.rays.start / 16..].iter_mut().zip(run.pixels.step_by(16)) {
            let is_wanted = |i: &u32| {
                let (dx, dy) = morton_decode(pixel as u32 + i);
                wanted.contains(x0 + dx, y0 + dy)
            };
            *live = (0..16).filter(is_wanted).fold(0, |live, i| live | 1 << i);
        }
    }
}
