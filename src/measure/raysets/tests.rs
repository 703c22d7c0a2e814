use super::*;

fn at(position: [f64; 3], normal: [f64; 3], dir: [f64; 3]) -> Start {
    Start { position: position.into(), normal: normal.into(), dir: dir.into() }
}

fn setting() -> Setting {
    Setting { light: DVec3::new(0.0, 5.0, 0.0), diagonal: 20.0, seed: 1 }
}

#[test]
fn names_parse_back_and_misspellings_are_helped() {
    for kind in RayKind::ALL {
        assert_eq!(kind.name().parse::<RayKind>().unwrap(), kind);
    }
    let text = "primry".parse::<RayKind>().unwrap_err().to_string();
    assert!(text.contains("did you mean `primary`"), "{text}");
}

#[test]
fn splitting_keeps_every_ray_in_order() {
    let mut rays = Rays::<f32>::new(2 * BATCH + 7);
    for i in 0..rays.len() {
        rays.set(i, [i as f32, 0.5, -1.0], [0.1, 0.2, 0.3], 0.0, f32::INFINITY);
    }
    let batches = split::<f64>(&rays);
    assert_eq!(batches.iter().map(Rays::len).collect::<Vec<_>>(), [BATCH, BATCH, 7]);
    for i in 0..rays.len() {
        let (batch, slot) = (&batches[i / BATCH], i % BATCH);
        assert_eq!(batch.org(slot), rays.org(i).map(f64::from));
        assert_eq!(batch.dir(slot), [0.1f32, 0.2, 0.3].map(f64::from));
        assert_eq!((batch.t_min[slot], batch.t_max[slot]), (0.0, f64::INFINITY));
    }
    assert_eq!(split::<f32>(&Rays::new(0)).len(), 0);
}

#[test]
fn shadow_rays_end_in_the_light() {
    let (org, dir, t_max) =
        secondary(RayKind::Shadow, &at([1.0, 0.0, 2.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]), &setting(), [0.0; 2])
            .unwrap();
    assert_eq!(t_max, 1.0);
    let end: [f32; 3] = std::array::from_fn(|a| org[a] + dir[a]);
    for (got, want) in end.iter().zip([0.0, 5.0, 0.0]) {
        assert!((got - want).abs() < 1e-6, "{end:?}");
    }
    assert!(org[1] > 0.0, "the origin leaves the surface on the light's side");
}

/// A ray going down at 45 degrees onto a floor leaves up at 45 degrees.
#[test]
fn mirror_rays_leave_at_the_angle_they_came() {
    let (_, dir, t_max) =
        secondary(RayKind::Reflect, &at([0.0; 3], [0.0, 1.0, 0.0], [3.0, -3.0, 0.0]), &setting(), [0.0; 2]).unwrap();
    let half = 0.5f32.sqrt();
    assert!((dir[0] - half).abs() < 1e-7 && (dir[1] - half).abs() < 1e-7 && dir[2] == 0.0, "{dir:?}");
    assert_eq!(t_max, f32::INFINITY);
}

#[test]
fn occlusion_rays_are_a_twentieth_of_the_diagonal_long() {
    let (_, dir, t_max) =
        secondary(RayKind::Ao, &at([0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]), &setting(), [0.3, 0.6]).unwrap();
    assert_eq!(t_max, 1.0);
    assert!((dir.iter().map(|d| d * d).sum::<f32>() - 1.0).abs() < 1e-6);
}

/// For a cosine density cos(theta)/pi, the mean of cos(theta) is 2/3 and of its square 1/2; tangents average to 0.
#[test]
fn cosine_directions_have_the_moments_of_a_cosine() {
    let normal = DVec3::new(1.0, -2.0, 0.5).normalize();
    let count = 20_000;
    let (mut first, mut second, mut sum) = (0.0, 0.0, DVec3::ZERO);
    for slot in 0..count {
        let dir = cosine_direction(normal, random_pair(7, RayKind::Diffuse, slot));
        assert!((dir.length() - 1.0).abs() < 1e-12);
        let cosine = dir.dot(normal);
        assert!(cosine >= 0.0);
        first += cosine;
        second += cosine * cosine;
        sum += dir - normal * cosine;
    }
    let count = count as f64;
    assert!((first / count - 2.0 / 3.0).abs() < 0.01, "{}", first / count);
    assert!((second / count - 0.5).abs() < 0.01, "{}", second / count);
    assert!(sum.length() / count < 0.01, "{sum}");
}

#[test]
fn random_numbers_depend_on_seed_class_and_slot() {
    let one = random_pair(1, RayKind::Ao, 5);
    assert_eq!(one, random_pair(1, RayKind::Ao, 5));
    for other in [random_pair(2, RayKind::Ao, 5), random_pair(1, RayKind::Diffuse, 5), random_pair(1, RayKind::Ao, 6)] {
        assert_ne!(one, other);
    }
    assert!(one.iter().all(|x| (0.0..1.0).contains(x)));
}

/// 256 ulps of 1000 (ulp 2^-14) are 1/64; near 0 the step is 1/65536.
#[test]
fn origins_leave_along_the_normal_by_a_step_that_grows_with_the_coordinate() {
    let moved = offset_origin(DVec3::new(1000.0, -1000.0, 0.0), DVec3::new(1.0, 1.0, 1.0));
    assert_eq!(moved, [1000.0 + 1.0 / 64.0, -1000.0 + 1.0 / 64.0, 1.0 / 65536.0]);
    let back = offset_origin(DVec3::new(1000.0, 0.0, 0.0), DVec3::new(-1.0, 0.0, 0.0));
    assert_eq!(back, [1000.0 - 1.0 / 64.0, 0.0, 0.0]);
}

#[test]
fn a_start_that_f32_cannot_hold_makes_no_ray() {
    let far = at([1e300, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    for kind in RayKind::ALL {
        assert_eq!(secondary(kind, &far, &setting(), [0.5; 2]), None, "{}", kind.name());
    }
}

#[test]
fn the_light_is_the_scenes_or_near_the_eye_but_not_in_the_ceiling() {
    let directional = Light::Directional { direction: DVec3::X, irradiance: DVec3::ONE };
    let point = Light::Point { position: DVec3::new(1.0, 2.0, 3.0), intensity: DVec3::ONE };
    let light = |lights: &[Light], clearance| light_for(lights, DVec3::ZERO, DVec3::Y, 20.0, clearance);
    assert_eq!(light(&[directional, point], 9.0), DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(light(&[directional], f64::INFINITY), DVec3::Y);
    assert_eq!(light(&[], 0.5), DVec3::Y * 0.25);
}
