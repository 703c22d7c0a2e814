//! Polygons with notches, holes and none of either: area and sense of what they are cut into.

use super::*;

/// The triangles of a polygon, however it is turned: as many as it has, all of its sense, with its area.
fn triangles_of(outline: &[DVec2]) -> Vec<[u32; 3]> {
    let first: Vec<[u32; 3]> = (2..outline.len() as u32).map(|i| [0, i - 1, i]).collect();
    let mut seen = None;
    for (u, v) in [(DVec3::X, DVec3::Y), (DVec3::new(0.5, 0.0, 2.0), DVec3::new(0.25, 1.0, 0.0)), (DVec3::Z, -DVec3::X)]
    {
        let positions: Vec<DVec3> = outline.iter().map(|p| DVec3::new(8.0, -4.0, 2.0) + p.x * u + p.y * v).collect();
        let mut fan = first.clone();
        if let Some(cut) = Polygons::default().cut(&fan, &positions) {
            assert_eq!(cut.len(), fan.len());
            apply(&cut, &mut fan);
        }
        let doubled: f64 = outline.iter().zip(outline.iter().cycle().skip(1)).map(|(a, b)| a.perp_dot(*b)).sum();
        let normal = u.cross(v) * doubled.signum();
        let areas = fan.iter().map(|t| {
            let [a, b, c] = t.map(|i| positions[i as usize]);
            (b - a).cross(c - a).dot(normal) / normal.length_squared()
        });
        let areas: Vec<f64> = areas.collect();
        let sum: f64 = areas.iter().sum();
        assert!((sum - doubled.abs()).abs() <= 1e-9 * sum, "{sum} is not {doubled}");
        assert!(areas.iter().all(|&area| area >= -1e-9 * sum), "{areas:?}");
        assert!(fan.iter().flatten().all(|&i| (i as usize) < outline.len()));
        // One that is seen from its back begins with the other neighbour.
        seen.get_or_insert(fan);
    }
    seen.unwrap()
}

fn outline(corners: &[[i32; 2]]) -> Vec<DVec2> {
    corners.iter().map(|&[x, y]| DVec2::new(f64::from(x), f64::from(y))).collect()
}

#[test]
fn fans_that_are_right_stay() {
    for corners in [
        &[[0, 0], [2, 0], [2, 2], [0, 2]][..],
        &[[0, 0], [1, 0], [2, 0], [2, 2], [2, 2], [1, 2], [0, 2]],
        // A notch that sees all of it.
        &[[1, 1], [0, 4], [0, 0], [4, 0]],
        &[[1, 1], [1, 2], [0, 2], [0, 0], [2, 0], [2, 1]],
    ] {
        let fan: Vec<[u32; 3]> = (2..corners.len() as u32).map(|i| [0, i - 1, i]).collect();
        assert_eq!(triangles_of(&outline(corners)), fan, "{corners:?}");
    }
}

#[test]
fn notches_are_left_out() {
    let arrow = [[2, 0], [0, 2], [-2, 0], [0, 1]];
    assert_eq!(triangles_of(&outline(&arrow)), [[1, 2, 3], [3, 0, 1]]);
    for corners in [
        &[[1, 2], [1, 1], [0, 1], [0, 0], [2, 0], [2, 2]][..],
        // A comb with corners on its edges, some of them twice.
        &[[0, 0], [1, 0], [2, 0], [6, 0], [6, 3], [5, 1], [4, 3], [3, 1], [3, 1], [2, 3], [1, 1], [0, 3], [0, 1]],
        // A hole, reached by an edge that is gone along twice; two holes from one corner.
        &[[0, 0], [1, 1], [1, 3], [3, 3], [3, 1], [1, 1], [0, 0], [4, 0], [4, 4], [0, 4]],
        &[
            [0, 0],
            [1, 2],
            [1, 3],
            [2, 3],
            [1, 2],
            [0, 0],
            [3, 1],
            [3, 2],
            [5, 2],
            [3, 1],
            [0, 0],
            [9, 0],
            [9, 9],
            [0, 9],
        ],
    ] {
        let mut outline = outline(corners);
        for _ in 0..outline.len() {
            triangles_of(&outline);
            outline.rotate_left(1);
        }
        outline.reverse();
        triangles_of(&outline);
    }
}

#[test]
fn random_stars_and_spirals_keep_their_area() {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1 << 24) as f64
    };
    for count in (5..60).chain([300, 1000]) {
        let at = |angle: f64, radius: f64| DVec2::from_angle(angle) * radius;
        let step = std::f64::consts::TAU / count as f64;
        let star: Vec<DVec2> = (0..count).map(|i| at(step * f64::from(i), 0.1 + random())).collect();
        triangles_of(&star);
        // Three turns outwards and back, closer to the middle.
        let arm =
            |i: i32, inside: f64| at(3.0 * step * f64::from(i), 0.5 + 3.0 * f64::from(i) / f64::from(count) - inside);
        let mut spiral: Vec<DVec2> = (0..count).map(|i| arm(i, 0.0)).collect();
        spiral.extend((0..count).rev().map(|i| arm(i, 0.2 + 0.2 * random())));
        if count > 20 {
            triangles_of(&spiral);
        }
    }
}

#[test]
fn what_no_polygon_is_ends_all_the_same() {
    let mut random = 7_u32;
    let mut next = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(random >> 29)
    };
    let start = std::time::Instant::now();
    for count in [4, 5, 6, 9, 30, MAX_CORNERS as u32, MAX_CORNERS as u32 + 1] {
        let positions: Vec<DVec3> = (0..count).map(|_| DVec3::new(next(), next(), next())).collect();
        let fan: Vec<[u32; 3]> = (2..count).map(|i| [0, i - 1, i]).collect();
        let mut polygons = Polygons::default();
        for scale in [1.0, 0.0, 1e-300, 1e200, f64::INFINITY, f64::NAN] {
            let scaled: Vec<DVec3> = positions.iter().map(|&p| p * scale).collect();
            let cut = polygons.cut(&fan, &scaled);
            assert!(cut.is_none_or(|cut| cut.len() == fan.len()));
        }
        assert_eq!(polygons.large > 0, count > MAX_CORNERS as u32);
    }
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}

/// Against integers: of points near a line the rounded area says nothing.
#[test]
fn turns_are_exact() {
    let whole = |p: [i64; 2]| DVec2::new(p[0] as f64, p[1] as f64);
    let large = 1_i64 << 52;
    for (dx, dy) in (-3..=3).flat_map(|dx| (-3..=3).map(move |dy| (dx, dy))) {
        let [a, b, c] = [[large + 1, large + 3], [1 - large, 5 - large], [large / 3 + dx, large / 3 + dy + 2]];
        let [ux, uy, vx, vy] = [b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]].map(i128::from);
        assert_eq!(turn(whole(a), whole(b), whole(c)), (ux * vy - uy * vx).cmp(&0));
    }
    assert_eq!(turn(DVec2::ZERO, DVec2::new(1.0, -0.0), DVec2::new(-0.0, 0.0)), Ordering::Equal);
}
