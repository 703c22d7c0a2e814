//! Primary rays of any list of pixels.

use super::generate::SubPixel;
use super::model::Camera;
use crate::lanes::Real;
use crate::ray::Rays;

/// Makes ray `i` of `rays` the primary ray of `pixels[i]` of a picture of `size` = (width, height) pixels: bit for bit the
/// ray that [`super::fill_tile`] makes of that pixel. Segments are [0, infinity]; directions are not unit.
pub fn fill_pixels<S: Real>(
    camera: &Camera,
    size: (u32, u32),
    pixels: &[(u32, u32)],
    sub_pixel: SubPixel,
    rays: &mut Rays<S>,
) {
    let (columns, rows) = (f64::from(size.0), f64::from(size.1));
    rays.reset(pixels.len());
    let (zero, infinity) = (S::from_f64(0.0), S::from_f64(f64::INFINITY));
    for (i, &(x, y)) in pixels.iter().enumerate() {
        let [sx, sy] = sub_pixel.offset(camera.anchor, x, y);
        // Hill's W (2c / nCols - 1) and H (2r / nRows - 1), in the order of operations of `fill_tile`.
        let c = f64::from(x) + sx;
        let r = rows - (f64::from(y) + sy);
        let a = camera.half_width * (2.0 * c / columns - 1.0);
        let b = camera.half_height * (2.0 * r / rows - 1.0);
        let place = |axis: usize| a * camera.u[axis] + b * camera.v[axis];
        let (org, dir) = if camera.parallel {
            (std::array::from_fn(|axis| camera.eye[axis] + place(axis)), (-camera.n).to_array())
        } else {
            (camera.eye.to_array(), std::array::from_fn(|axis| place(axis) - camera.n[axis]))
        };
        rays.set(i, org.map(S::from_f64), dir.map(S::from_f64), zero, infinity);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::camera::{PixelRect, Tiling, fill_tile, morton_decode};
    use crate::scene::description::{CameraDescription, Projection};

    fn camera(projection: Projection, aspect: f64) -> Camera {
        let (eye, look_at) = (DVec3::new(1.7, -0.3, 4.1), DVec3::new(0.2, 0.1, -0.7));
        Camera::new(&CameraDescription { name: "c".into(), eye, look_at, up: DVec3::Y, projection }, aspect).unwrap()
    }

    /// All bits of a batch: origins, directions, segments.
    fn bits<S: Real>(rays: &Rays<S>) -> Vec<Vec<u64>> {
        let arrays = rays.org.iter().chain(&rays.dir).chain([&rays.t_min, &rays.t_max]);
        arrays.map(|array| array[..rays.len()].iter().map(|x| x.to_f64().to_bits()).collect()).collect()
    }

    fn same_rays_as_a_tile<S: Real>() {
        let (width, height) = (37, 35);
        let tiling = Tiling::new(width, height, 32).unwrap();
        let all = PixelRect { x0: 0, y0: 0, x1: width, y1: height };
        for projection in [Projection::Perspective { theta: 0.9 }, Projection::Parallel { height: 3.3 }] {
            let camera = camera(projection, f64::from(width) / f64::from(height));
            for sub_pixel in [SubPixel::Anchor, SubPixel::Sample { sample: 3, seed: 9 }] {
                // The first tile lies inside the picture: all its rays are live.
                let pixels: Vec<_> = (0..1024).map(morton_decode).collect();
                let (mut tile, mut list) = (Rays::<S>::new(0), Rays::<S>::new(0));
                fill_tile(&camera, &tiling, 0, all, sub_pixel, &mut tile);
                fill_pixels(&camera, (width, height), &pixels, sub_pixel, &mut list);
                assert!(bits(&tile) == bits(&list), "{projection:?}, {sub_pixel:?}");
            }
        }
    }

    #[test]
    fn rays_are_those_of_a_tile_to_the_last_bit() {
        same_rays_as_a_tile::<f32>();
        same_rays_as_a_tile::<f64>();
    }
}
