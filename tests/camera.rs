//! The camera against closed forms and hand-worked rays.

use glam::{DVec3, DVec4};
use lanecast::camera::{Camera, CameraOverrides, PixelRect, SubPixel, Tiling, fill_tile, framing};
use lanecast::ray::Rays;
use lanecast::scene::description::{CameraDescription, Projection};

const ALL: PixelRect = PixelRect { x0: 0, y0: 0, x1: u32::MAX, y1: u32::MAX };

fn description(eye: DVec3, look_at: DVec3, projection: Projection) -> CameraDescription {
    CameraDescription { name: "test".into(), eye, look_at, up: DVec3::Y, projection }
}

/// 90 degrees, at (0, 0, 5), looking along -z: H = 1, W = aspect, u = x, v = y, n = z.
fn simple(aspect: f64) -> Camera {
    let theta = std::f64::consts::FRAC_PI_2;
    let d = description(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, Projection::Perspective { theta });
    Camera::new(&d, aspect).unwrap()
}

fn close(got: DVec3, want: DVec3) {
    assert!((got - want).abs().max_element() < 1e-12, "got {got}, want {want}");
}

#[test]
fn corner_and_centre_rays_of_hills_formula() {
    let camera = simple(2.0);
    let (org, centre) = camera.ray(200, 100, 100.0, 50.0);
    close(org, DVec3::new(0.0, 0.0, 5.0));
    close(centre, -DVec3::Z);
    // y is down in pictures: the upper left corner is r = nRows in the formula, hence +H.
    close(camera.ray(200, 100, 0.0, 0.0).1, DVec3::new(-2.0, 1.0, -1.0));
    close(camera.ray(200, 100, 200.0, 100.0).1, DVec3::new(2.0, -1.0, -1.0));
    // Centre of pixel (0, 0): c = 0.5, r = 99.5.
    close(camera.ray(200, 100, 0.5, 0.5).1, DVec3::new(2.0 * (1.0 / 200.0 - 1.0), 2.0 * 99.5 / 100.0 - 1.0, -1.0));
}

#[test]
fn theta_is_vertical_and_aspect_widens() {
    let d = description(DVec3::ZERO, DVec3::X, Projection::Perspective { theta: 0.6 });
    let camera = Camera::new(&d, 1.5).unwrap();
    assert!((camera.half_height - 0.3f64.tan()).abs() < 1e-15);
    assert!((camera.half_width - 1.5 * 0.3f64.tan()).abs() < 1e-15);
    close(camera.n, -DVec3::X);
    close(camera.u, DVec3::Z);
    close(camera.v, DVec3::Y);
    let top = camera.ray(3, 2, 1.5, 0.0).1;
    assert!((top.angle_between(DVec3::X) - 0.3).abs() < 1e-12);
}

#[test]
fn parallel_rays_start_apart_and_run_together() {
    let d = description(DVec3::new(0.0, 10.0, 0.0), DVec3::ZERO, Projection::Parallel { height: 4.0 });
    let camera = Camera::new(&CameraDescription { up: -DVec3::Z, ..d }, 2.0).unwrap();
    let (org, dir) = camera.ray(8, 4, 0.0, 0.0);
    close(dir, -DVec3::Y);
    close(org, DVec3::new(-4.0, 10.0, -2.0));
    close(camera.ray(8, 4, 8.0, 4.0).0, DVec3::new(4.0, 10.0, 2.0));
}

#[test]
fn tiles_hold_the_formulas_rays_whatever_the_tile_size() {
    let camera = simple(17.0 / 31.0);
    for sub_pixel in [SubPixel::Anchor, SubPixel::Sample { sample: 3, seed: 9 }] {
        let mut first: Vec<Option<[u64; 6]>> = vec![None; 17 * 31];
        for edge in [8, 16, 32] {
            let tiling = Tiling::new(17, 31, edge).unwrap();
            let mut rays = Rays::<f64>::default();
            let mut live = 0;
            for tile in 0..tiling.tiles() {
                fill_tile(&camera, &tiling, tile, ALL, sub_pixel, &mut rays);
                for i in 0..rays.len() {
                    let index = u64::from(tile) * u64::from(tiling.rays_per_tile()) + i as u64;
                    assert_eq!(rays.is_live(i), tiling.pixel(index).is_some());
                    let Some((x, y)) = tiling.pixel(index) else { continue };
                    live += 1;
                    let (o, d) = (rays.org(i), rays.dir(i));
                    let bits = [o[0], o[1], o[2], d[0], d[1], d[2]].map(f64::to_bits);
                    assert_eq!(*first[(y * 17 + x) as usize].get_or_insert(bits), bits);
                    let (ulo, uhi) = (
                        camera.ray(17, 31, x.into(), y.into()).1,
                        camera.ray(17, 31, (x + 1).into(), (y + 1).into()).1,
                    );
                    assert!(d[0] >= ulo.x && d[0] < uhi.x && d[1] <= ulo.y && d[1] > uhi.y && d[2] == -1.0);
                    if sub_pixel == SubPixel::Anchor {
                        close(DVec3::from(d), camera.ray(17, 31, f64::from(x) + 0.5, f64::from(y) + 0.5).1);
                    }
                }
            }
            assert_eq!(live, 17 * 31);
        }
    }
}

#[test]
fn f32_rays_are_the_f64_rays_rounded_and_crops_are_dead_outside() {
    let camera = simple(1.3);
    let tiling = Tiling::new(64, 64, 32).unwrap();
    let rect = PixelRect { x0: 3, y0: 5, x1: 20, y1: 31 };
    let (mut single, mut double) = (Rays::<f32>::default(), Rays::<f64>::default());
    fill_tile(&camera, &tiling, 0, ALL, SubPixel::Anchor, &mut double);
    fill_tile(&camera, &tiling, 0, rect, SubPixel::Anchor, &mut single);
    assert_eq!(single.live_count(), 17 * 26);
    for i in 0..single.len() {
        let (x, y) = tiling.pixel(i as u64).unwrap();
        assert_eq!(single.is_live(i), rect.contains(x, y));
        if single.is_live(i) {
            assert_eq!(single.dir(i), double.dir(i).map(|d| d as f32));
            assert_eq!((single.t_min[i], single.t_max[i]), (0.0, f32::INFINITY));
        }
    }
}

#[test]
fn matrices_put_points_where_the_rays_go() {
    let eye = DVec3::new(1.0, 2.0, 3.0);
    for projection in [Projection::Perspective { theta: 0.9 }, Projection::Parallel { height: 7.0 }] {
        let camera = Camera::new(&description(eye, DVec3::new(-2.0, 0.5, -4.0), projection), 1.6).unwrap();
        let (org, dir) = camera.ray(160, 100, 37.0, 81.0);
        let point = (org + dir * 4.5).extend(1.0);
        let in_camera = camera.world_to_camera() * point;
        assert!((in_camera.z - 4.5).abs() < 1e-12, "N = 1: t is the depth");
        let ndc = camera.world_to_ndc() * point;
        let ndc: DVec4 = ndc / ndc.w;
        assert!((ndc.x - 37.0 / 160.0).abs() < 1e-12 && (ndc.y - 0.81).abs() < 1e-12, "{ndc}");
        assert!(camera.world_to_ndc().determinant().abs() > 1e-6);
    }
    // Row vectors, row by row: the translation is in elements 12 to 14, as OpenEXR writes it.
    let stored = simple(1.0).world_to_camera().to_cols_array();
    assert_eq!(stored, [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 5.0, 1.0]);
}

#[test]
fn framing_shows_all_corners_of_any_box() {
    let boxes = [
        (DVec3::splat(-1.0), DVec3::splat(1.0)),
        (DVec3::new(-5.0, 0.0, 2.0), DVec3::new(80.0, 1.0, 2.5)),
        (DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 0.0)),
        (DVec3::new(3.0, 0.0, 3.0), DVec3::new(9.0, 0.0, 9.0)),
        (DVec3::splat(-1e-200), DVec3::splat(1e-200)),
        (DVec3::splat(-1e308), DVec3::splat(1e308)),
        (DVec3::splat(1e6), DVec3::splat(1e6)),
    ];
    for (lo, hi) in boxes {
        for aspect in [0.2, 1.0, 5.0] {
            let d = framing(Some((lo, hi)), aspect);
            let camera = Camera::new(&d, aspect).unwrap();
            assert!(camera.eye.is_finite());
            if hi.abs().max_element() > 1e100 || hi.max_element() < 1e-100 && hi != lo {
                continue; // visible too, but a matrix product would overflow: the next test covers the scaling
            }
            for corner in 0..8 {
                let pick = |bit: usize| if corner >> bit & 1 == 0 { lo[bit] } else { hi[bit] };
                let ndc = camera.world_to_ndc() * DVec4::new(pick(0), pick(1), pick(2), 1.0);
                assert!(ndc.w > 0.0);
                let (x, y) = (ndc.x / ndc.w, ndc.y / ndc.w);
                assert!((0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y), "{lo} {hi} {aspect}: {x} {y}");
            }
        }
    }
    for bad in [None, Some((DVec3::NAN, DVec3::ONE)), Some((DVec3::splat(f64::NEG_INFINITY), DVec3::INFINITY))] {
        assert!(Camera::new(&framing(bad, f64::NAN), 1.0).is_ok());
    }
}

#[test]
fn framing_scales_with_the_scene() {
    let unit = framing(Some((-DVec3::ONE, DVec3::ONE)), 1.5);
    for scale in [1e-200, 1e200] {
        let scaled = framing(Some((-DVec3::ONE * scale, DVec3::ONE * scale)), 1.5);
        close(scaled.eye / scale, unit.eye);
    }
}

#[test]
fn overrides_and_degenerate_cameras() {
    let base = description(DVec3::Z, DVec3::ZERO, Projection::Parallel { height: 1.0 });
    assert_eq!(CameraOverrides::default().apply(&base), base);
    let changed = CameraOverrides { eye: Some(DVec3::X), theta: Some(1.0), ..Default::default() }.apply(&base);
    assert_eq!((changed.eye, changed.look_at), (DVec3::X, DVec3::ZERO));
    assert_eq!(changed.projection, Projection::Perspective { theta: 1.0 });
    // Looking straight along up still gives an orthonormal frame.
    let down = Camera::new(&CameraDescription { eye: DVec3::Y, ..base.clone() }, 1.0).unwrap();
    close(down.u.cross(down.v), DVec3::Y);
    let with = |projection| Camera::new(&CameraDescription { projection, ..base.clone() }, 1.0);
    assert!(Camera::new(&CameraDescription { look_at: DVec3::Z, ..base.clone() }, 1.0).is_err());
    assert!(Camera::new(&CameraDescription { eye: DVec3::NAN, ..base.clone() }, 1.0).is_err());
    assert!(Camera::new(&base, 0.0).is_err());
    assert!(with(Projection::Perspective { theta: 0.0 }).is_err());
    assert!(with(Projection::Perspective { theta: 3.2 }).is_err());
    assert!(with(Projection::Perspective { theta: f64::NAN }).is_err());
    assert!(with(Projection::Parallel { height: -1.0 }).is_err());
}
