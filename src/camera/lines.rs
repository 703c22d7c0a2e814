//! Between which numbers the rays of a tile lie.

use super::model::Camera;
use super::tiles::Tiling;
use crate::lanes::{Real, each};

/// Least and largest coordinates of origins and of directions.
pub type Range<S> = [[(S, S); 3]; 2];

/// Roundings by which numbers are taken apart more than they are: those of the rays, and of what makes their directions unit.
const ROUNDINGS: f64 = 16.0;

/// Those of all rays through the pixels of tile number `tile`, wherever in them; also with directions of other lengths.
pub fn range_of_tile<S: Real>(camera: &Camera, tiling: &Tiling, tile: u32) -> Range<S> {
    let (x, y) = tiling.origin(tile);
    let ends = |from: u32| [f64::from(from), f64::from(from + tiling.edge())];
    let (width, height) = (f64::from(tiling.width()), f64::from(tiling.height()));
    let across = ends(x).map(|c| camera.half_width * (2.0 * c / width - 1.0));
    let up = ends(y).map(|r| camera.half_height * (2.0 * (height - r) / height - 1.0));
    // A base and what lies between the ends along the axes of the picture.
    let range = |base: f64, axis: usize, spreads: bool| {
        let (mut low, mut high, mut size) = (base, base, base.abs());
        for (places, along) in [(across, camera.u[axis]), (up, camera.v[axis])] {
            let [a, b] = places.map(|place| if spreads { place * along } else { 0.0 });
            (low, high, size) = (low + a.min(b), high + a.max(b), size + a.abs().max(b.abs()));
        }
        let slack = size * ROUNDINGS * S::EPSILON.to_f64();
        (S::from_f64(low - slack).next_down(), S::from_f64(high + slack).next_up())
    };
    [
        each(|axis| range(camera.eye[axis], axis, camera.parallel)),
        each(|axis| range(-camera.n[axis], axis, !camera.parallel)),
    ]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::camera::{PixelRect, SubPixel, fill_passes};
    use crate::ray::Rays;
    use crate::scene::description::{CameraDescription, Projection};

    fn rays_lie_between<S: Real>() {
        let tiling = Tiling::new(100, 70, 32).unwrap();
        let all = PixelRect { x0: 0, y0: 0, x1: 100, y1: 70 };
        let mut rays = Rays::<S>::new(0);
        for projection in [Projection::Perspective { theta: 0.9 }, Projection::Parallel { height: 3.3 }] {
            let (eye, look_at) = (DVec3::new(1.7, -0.3, 4.1), DVec3::new(0.2, 0.1, -0.7));
            let description = CameraDescription { name: "c".into(), eye, look_at, up: DVec3::Y, projection };
            let camera = Camera::new(&description, 100.0 / 70.0).unwrap();
            for tile in 0..tiling.columns() * tiling.rows() {
                let ranges = range_of_tile::<S>(&camera, &tiling, tile);
                let samples = [SubPixel::Anchor, SubPixel::Sample { sample: 3, seed: 5 }];
                fill_passes(&camera, &tiling, tile, all, &samples, &mut rays);
                for i in (0..rays.len()).filter(|&i| rays.is_live(i)) {
                    for (range, value) in ranges.iter().zip([rays.org(i), rays.dir(i)]) {
                        for ((low, high), x) in range.iter().zip(value) {
                            assert!(*low < x && x < *high, "tile {tile} ray {i}");
                            // No more than what the tile takes.
                            assert!(high.to_f64() - low.to_f64() < 1.6);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn rays_of_a_tile_lie_between_its_ends() {
        rays_lie_between::<f32>();
        rays_lie_between::<f64>();
    }
}
