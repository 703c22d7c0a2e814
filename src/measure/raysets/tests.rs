use super::*;

fn at(position: [f64; 3], normal: [f64; 3], dir: [f64; 3]) -> Start {
    Start { position: position.into(), normal: normal.into(), dir: dir.into(), is_mapped: false }
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
    let batches = split::<f64>(&rays, 1);
    assert_eq!(batches.iter().map(Rays::len).collect::<Vec<_>>(), [BATCH, BATCH, 7]);
    for i in 0..rays.len() {
        let (batch, slot) = (&batches[i / BATCH], i % BATCH);
        assert_eq!(batch.org(slot), rays.org(i).map(f64::from));
        assert_eq!(batch.dir(slot), [0.1f32, 0.2, 0.3].map(f64::from));
        assert_eq!((batch.t_min[slot], batch.t_max[slot]), (0.0, f64::INFINITY));
    }
    assert_eq!(split::<f32>(&Rays::new(0), 1).len(), 0);
}

#[test]
fn calls_keep_every_ray_in_order_and_are_shared_fairly() {
    let mut next = 0.0;
    let mut batch = |len: usize| {
        let mut rays = Rays::<f32>::new(len);
        (0..len).for_each(|i| {
            next += 1.0;
            rays.set(i, [next, 0.0, 0.0], [0.0, 0.0, 1.0], 0.0, 1.0);
        });
        rays
    };
    let mut batches: Vec<_> = (0..200).map(|_| batch(BATCH)).collect();
    batches.push(batch(5));
    for (threads, most) in [(1, 4 * BATCH), (2, 3 * BATCH), (64, BATCH)] {
        let calls = calls::<f32>(&batches, threads);
        assert!(calls.iter().all(|rays| rays.len() <= most) && calls[0].len() == most, "{threads}");
        let numbers: Vec<f32> = calls.iter().flat_map(|rays| rays.org[0][..rays.len()].to_vec()).collect();
        assert_eq!(numbers, (1..=200 * BATCH + 5).map(|i| i as f32).collect::<Vec<_>>());
    }
    assert!(calls::<f32>(&[], 1).is_empty());
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

/// Starts on a floor, all seen from above.
fn floor(batches: usize) -> Starts {
    let one = at([1.0, 0.0, 2.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]);
    Starts { batches: vec![vec![Some(one); BATCH]; batches] }
}

/// For a cosine density cos(theta)/pi, the mean of cos(theta) is 2/3 and of its square 1/2.
#[test]
fn diffuse_rays_have_the_moments_of_a_cosine() {
    let batches = floor(8).rays(RayKind::Diffuse, &setting());
    let cosines: Vec<f64> = batches.iter().flat_map(|b| &b.dir[1][..b.len()]).map(|&c| f64::from(c)).collect();
    let mean = |power| cosines.iter().map(|c| c.powi(power)).sum::<f64>() / cosines.len() as f64;
    assert!((mean(1) - 2.0 / 3.0).abs() < 0.01, "{}", mean(1));
    assert!((mean(2) - 0.5).abs() < 0.01, "{}", mean(2));
}

#[test]
fn random_directions_depend_on_seed_class_and_slot() {
    let rays = |kind, seed| floor(2).rays(kind, &Setting { seed, ..setting() });
    let one = rays(RayKind::Ao, 1);
    assert_eq!(one[1].dir(5), rays(RayKind::Ao, 1)[1].dir(5));
    for other in [rays(RayKind::Ao, 2)[1].dir(5), rays(RayKind::Diffuse, 1)[1].dir(5), one[0].dir(5), one[1].dir(6)] {
        assert_ne!(one[1].dir(5), other);
    }
}

#[test]
fn a_miss_makes_a_dead_ray() {
    let mut starts = floor(1);
    starts.batches[0][3] = None;
    assert_eq!(starts.count(), BATCH - 1);
    for kind in RayKind::ALL.into_iter().filter(|kind| kind.parent().is_some()) {
        let rays = &starts.rays(kind, &setting())[0];
        assert_eq!((rays.len(), rays.live_count(), rays.is_live(3)), (BATCH, BATCH - 1, false), "{}", kind.name());
    }
}

/// 256 ulps of 1000 (ulp 2^-14) are 1/64; near 0 the step is 1/65536.
#[test]
fn origins_leave_along_the_normal_by_a_step_that_grows_with_the_coordinate() {
    let moved = offset_origin(DVec3::new(1000.0, -1000.0, 0.0), DVec3::new(1.0, 1.0, 1.0));
    assert_eq!(moved, [1000.0 + 1.0 / 64.0, -1000.0 + 1.0 / 64.0, 1.0 / 65536.0]);
    let back = offset_origin(DVec3::new(1000.0, 0.0, 0.0), DVec3::new(-1.0, 0.0, 0.0));
    assert_eq!(back, [1000.0 - 1.0 / 64.0, 0.0, 0.0]);
}

/// On an instance 1000 moves y as far as x: its map may turn one into the other.
#[test]
fn origins_on_instances_leave_by_the_largest_coordinate() {
    let start = Start { is_mapped: true, ..at([1000.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]) };
    let step = 256.0 * f64::from(f32::EPSILON) * 1000.0;
    assert_eq!(start.origin(start.normal, &setting()), [1000.0, step as f32, 0.0]);
    let (org, ..) = secondary(RayKind::Diffuse, &start, &setting(), [0.5; 2]).unwrap();
    assert_eq!(org, start.origin(start.normal, &setting()));
}

/// A scene 8e-6 wide: a step of 1/65536 would leave all of it behind. Others keep theirs to the bit.
#[test]
fn origins_in_small_scenes_stay_in_them() {
    let of = |diagonal: f64| Setting { diagonal, ..setting() };
    for is_mapped in [false, true] {
        let start = Start { is_mapped, ..at([2e-6, 0.0, 1e-6], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]) };
        let [x, y, z] = start.origin(start.normal, &of(8e-6));
        assert!((x, z) == (2e-6, 1e-6) && y > 1e-12 && y < 1e-3 * 8e-6, "{x} {y} {z}");
    }
    for (position, normal) in [([0.0, 0.01, -3.0], [0.6, 0.8, 0.0]), ([1e4, 0.0, 1e-3], [0.0, 0.6, -0.8])] {
        let start = at(position, normal, [0.0, -1.0, 0.0]);
        for diagonal in [1.0 / 16.0, 1.0, 1e6, f64::INFINITY] {
            let (org, want) = (start.origin(start.normal, &of(diagonal)), offset_origin(start.position, start.normal));
            assert_eq!(org.map(f32::to_bits), want.map(f32::to_bits), "{diagonal}");
        }
    }
    // A floor without bounds under a speck is rounded like what it is, far away.
    let far = at([30.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]);
    assert!(far.origin(far.normal, &of(8e-6))[1] > 30.0 * f32::EPSILON);
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
