//! Primary rays of a tile.
//!
//! A pixel's ray is a function of camera, picture size, pixel and sample alone: f64 arithmetic in one fixed order,
//! rounded once to the engine's precision. Tile size, crop and thread do not enter.

use super::filter::Filter;
use super::model::Camera;
use super::sampling::PixelRandom;
use super::sobol::PixelPoints;
use super::tiles::{FILE_TILE, PixelRect, Tiling, morton_decode};
use crate::lanes::Real;
use crate::ray::Rays;

/// Name of the sub-pixel offsets among the random dimensions of a pixel.
const DIMENSION: u32 = 0;
/// Rays of the largest tile.
const LARGEST_BATCH: usize = (FILE_TILE * FILE_TILE) as usize;

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
    #[inline]
    pub(super) fn offset(self, anchor: [f64; 2], x: u32, y: u32) -> [f64; 2] {
        match self {
            Self::Anchor => anchor,
            Self::Sample { sample, seed } => PixelRandom::new(x, y, seed).spread(sample, DIMENSION),
            Self::Filtered { sample, seed, filter } => {
                PixelPoints::new(x, y, seed).point(sample, DIMENSION).map(|u| 0.5 + filter.place(u))
            }
        }
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
    let count = tiling.rays_per_tile() as usize;
    let (x0, y0) = tiling.origin(tile);
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
    rays.prepare(count);
    if sub_pixel == SubPixel::Anchor {
        // One place in all pixels: a column's pixels have one a, a row's one b.
        let edge = tiling.edge() as usize;
        let (mut a, mut b) = ([0.0; FILE_TILE as usize], [0.0; FILE_TILE as usize]);
        for k in 0..edge {
            a[k] = across(x0 + k as u32, camera.anchor[0]);
            b[k] = up(y0 + k as u32, camera.anchor[1]);
        }
        for axis in 0..3 {
            let (au, bv) = (a.map(|a| a * camera.u[axis]), b.map(|b| b * camera.v[axis]));
            let (org, dir) = (&mut rays.org[axis][..count], &mut rays.dir[axis][..count]);
            let (eye, n) = (camera.eye[axis], camera.n[axis]);
            if camera.parallel {
                blocks(&au, &bv, org, |au, bv| eye + (au + bv));
                dir.fill(S::from_f64(-n));
            } else {
                org.fill(S::from_f64(eye));
                blocks(&au, &bv, dir, |au, bv| au + bv - n);
            }
        }
    } else {
        let mut a = [0.0; LARGEST_BATCH];
        let mut b = [0.0; LARGEST_BATCH];
        for i in 0..count {
            let (dx, dy) = morton_decode(i as u32);
            let [sx, sy] = sub_pixel.offset(camera.anchor, x0 + dx, y0 + dy);
            (a[i], b[i]) = (across(x0 + dx, sx), up(y0 + dy, sy));
        }
        for axis in 0..3 {
            let (eye, u, v, n) = (camera.eye[axis], camera.u[axis], camera.v[axis], camera.n[axis]);
            let (org, dir) = (&mut rays.org[axis][..count], &mut rays.dir[axis][..count]);
            if camera.parallel {
                org.iter_mut()
                    .zip(a.iter().zip(&b))
                    .for_each(|(org, (a, b))| *org = S::from_f64(eye + (a * u + b * v)));
                dir.fill(S::from_f64(-n));
            } else {
                org.fill(S::from_f64(eye));
                dir.iter_mut().zip(a.iter().zip(&b)).for_each(|(dir, (a, b))| *dir = S::from_f64(a * u + b * v - n));
            }
        }
    }
    rays.t_min[..count].fill(S::ZERO);
    rays.t_max[..count].fill(S::INFINITY);
    kill_outside(tiling, (x0, y0), rect, rays);
}

/// Sixteen rays that follow each other are a square of 4 x 4 pixels: `value` of what each one's column and row have.
#[inline(always)]
fn blocks<S: Real>(
    of_column: &[f64; FILE_TILE as usize],
    of_row: &[f64; FILE_TILE as usize],
    to: &mut [S],
    value: impl Fn(f64, f64) -> f64,
) {
    const X: [usize; 16] = [0, 1, 0, 1, 2, 3, 2, 3, 0, 1, 0, 1, 2, 3, 2, 3];
    const Y: [usize; 16] = [0, 0, 1, 1, 0, 0, 1, 1, 2, 2, 3, 3, 2, 2, 3, 3];
    for (block, to) in to.chunks_exact_mut(16).enumerate() {
        let (x, y) = morton_decode(block as u32);
        let (Some(columns), Some(rows)) =
            (of_column[4 * x as usize..].first_chunk::<4>(), of_row[4 * y as usize..].first_chunk::<4>())
        else {
            return;
        };
        for (k, to) in to.iter_mut().enumerate() {
            *to = S::from_f64(value(columns[X[k]], rows[Y[k]]));
        }
    }
}

/// Makes the rays dead whose pixel lies outside the picture or outside `rect`.
fn kill_outside<S: Real>(tiling: &Tiling, (x0, y0): (u32, u32), rect: PixelRect, rays: &mut Rays<S>) {
    let wanted = PixelRect { x1: rect.x1.min(tiling.width()), y1: rect.y1.min(tiling.height()), ..rect };
    let last = tiling.edge() - 1;
    if wanted.contains(x0, y0) && wanted.contains(x0 + last, y0 + last) {
        return;
    }
    for i in 0..rays.len() {
        let (dx, dy) = morton_decode(i as u32);
        if !wanted.contains(x0 + dx, y0 + dy) {
            rays.kill(i);
        }
    }
}
