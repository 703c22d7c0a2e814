//! Triangles: an independent f64 solution, shared edges, degenerate ones, extreme sizes, lane masks.

use glam::DVec3;

use super::super::{Block, Degenerate, Triangle};
use super::{Random, Ray, exact, packet};
use crate::lanes::{Lanes, Pair, Real, f32x4, f32x8, f32x16, f64x2, f64x4, f64x8};
use crate::ray::{HitPacket, INVALID_ID};

/// Bits of `t`, `u`, `v` (widened) and the primitive of one lane.
type Found = ([u64; 3], u32);

/// Commits a block of triangles to a packet of rays through `active`.
fn traced<V: Lanes>(rays: &[Ray], block: &Block<V::Scalar, 9>, count: usize, active: u32, t_max: f64) -> Vec<Found> {
    let packet = packet::<V>(rays);
    let mut hits = HitPacket::new(V::constant(t_max));
    Triangle::intersect(&packet, hits.t, block, (1 << count) - 1, active, |found, lanes, prim| {
        hits.commit(lanes, found, prim, 3);
    });
    (0..V::N).map(|i| ([hits.t, hits.u, hits.v].map(|x| x.lane(i).to_f64().to_bits()), hits.prim[i])).collect()
}

/// The same for a block of one.
fn lanes<V: Lanes>(rays: &[Ray], n: &[V::Scalar; 9], active: u32, t_max: f64) -> Vec<Found> {
    let mut block = Block::empty();
    block.set(0, *n, 7);
    traced::<V>(rays, &block, 1, active, t_max)
}

/// `(t, u, v)` of one ray at width 1 (that the widths agree is tested below).
fn hit<S: Real>(ray: Ray, n: &[S; 9]) -> Option<[f64; 3]> {
    let found = lanes::<S>(&[ray], n, 1, f64::INFINITY)[0];
    (found.1 != INVALID_ID).then(|| found.0.map(f64::from_bits))
}

fn record<S: Real>(corners: [DVec3; 3]) -> [S; 9] {
    Triangle::record(corners).expect("a proper triangle")
}

/// Cramer's rule in f64 on the corners as stored.
fn closed_form(ray: Ray, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (e1, e2, s) = (b - a, c - a, ray.0 - a);
    let det = ray.1.cross(e2).dot(e1);
    [s.cross(e1).dot(e2) / det, ray.1.cross(e2).dot(s) / det, s.cross(e1).dot(ray.1) / det]
}

/// Rays in the planes of triangles that lie beside them.
fn beside_in_their_plane<S: Real>() {
    let mut r = Random(17);
    for i in 0..20_000 {
        let (org, dir) = exact((r.cube(), r.cube().normalize()));
        let aside = dir.any_orthonormal_pair();
        let turn = r.cube().x * std::f64::consts::PI;
        let aside = aside.0 * turn.cos() + aside.1 * turn.sin();
        let corners = [0; 3].map(|_| {
            let place = r.cube();
            org + dir * (2.0 * place.x) + aside * (0.55 + 0.5 * place.y)
        });
        let Ok(record) = Triangle::record::<S>(corners) else { continue };
        let found = hit::<S>((org, dir), &record);
        assert!(found.is_none(), "ray {i}: {found:?} of {corners:?} from {org} along {dir}");
    }
}

#[test]
fn triangles_beside_a_ray_in_their_plane_are_missed() {
    beside_in_their_plane::<f32>();
    beside_in_their_plane::<f64>();
}

fn random_corners(r: &mut Random) -> [DVec3; 3] {
    loop {
        let corners = [r.cube(), r.cube(), r.cube()].map(|p| (p * 2.0).as_vec3().as_dvec3());
        let [a, b, c] = corners;
        let longest = (b - a).length().max((c - a).length()).max((c - b).length());
        if (b - a).cross(c - a).length() > 0.2 * longest * longest {
            return corners;
        }
    }
}

fn closed_form_in<S: Real>(bound: f64) {
    let mut r = Random(11);
    let (mut hits, mut misses) = (0, 0);
    while hits < 20_000 {
        let corners = random_corners(&mut r);
        let (u, v) = (r.unit() * 1.4 - 0.2, r.unit() * 1.4 - 0.2);
        let target = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
        let org = r.cube() * 6.0;
        let ray = exact((org, (target - org) * (0.2 + 3.0 * r.unit())));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let cosine = ray.1.normalize().dot(normal).abs();
        if cosine < 0.1 {
            continue;
        }
        let want = closed_form(ray, corners);
        let least = want[1].min(want[2]).min(1.0 - want[1] - want[2]);
        // Both windings: both sides are hit, with the same weights for the same corners.
        for flip in [false, true] {
            let [a, b, c] = corners;
            let got = hit::<S>(ray, &record(if flip { [a, c, b] } else { [a, b, c] }));
            let got = got.map(|[t, u, v]| if flip { [t, v, u] } else { [t, u, v] });
            // An error in the plane seen at a slant is magnified by 1 / cosine; edges are at least 0.3 long.
            let tolerance = bound / cosine;
            match got {
                Some(got) => {
                    assert!(least > -tolerance, "{got:?} outside {want:?}");
                    assert!((got[0] - want[0]).abs() * ray.1.length() < tolerance, "{got:?} {want:?}");
                    assert!((got[1] - want[1]).abs() < tolerance && (got[2] - want[2]).abs() < tolerance);
                    hits += 1;
                }
                None => {
                    assert!(least < tolerance, "missed {want:?}");
                    misses += 1;
                }
            }
        }
    }
    assert!(misses > 5000);
}

#[test]
fn t_u_v_are_those_of_cramers_rule() {
    closed_form_in::<f32>(1e-5);
    closed_form_in::<f64>(2e-14);
}

fn shared_edges<S: Real>() {
    let mut r = Random(12);
    let mut tested = 0;
    while tested < 100_000 {
        let [a, b, c] = random_corners(&mut r);
        let d = (r.cube() * 2.0).as_vec3().as_dvec3();
        let org = r.cube() * 4.0;
        // Seen from the eye, c and d must lie on two sides of the edge a b.
        let edge = (a - org).cross(b - org);
        if edge.dot(c - org) * edge.dot(d - org) > -1e-3 {
            continue;
        }
        // Also the edge's ends, where the fan around a vertex is not closed here but the edge still is.
        let s = 0.001 + 0.998 * r.unit();
        let target = (a + (b - a) * s).as_vec3().as_dvec3();
        let ray = exact((org, target - org));
        let found = [[a, b, c], [b, a, d]].map(|t| hit::<S>(ray, &record(t)).is_some());
        assert!(found[0] || found[1], "{ray:?} slips through {a} {b} ({c}, {d})");
        tested += 1;
    }
}

#[test]
fn shared_edges_are_never_missed() {
    shared_edges::<f32>();
    shared_edges::<f64>();
}

#[test]
fn degenerate_triangles_are_told_apart() {
    let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let single = |c: [DVec3; 3]| Triangle::record::<f32>(c).err();
    let double = |c: [DVec3; 3]| Triangle::record::<f64>(c).err();
    let both = |c: [DVec3; 3], want: Option<Degenerate>| assert_eq!((single(c), double(c)), (want, want), "{c:?}");
    let (zero, infinite) = (Some(Degenerate::ZeroArea), Some(Degenerate::NonFinite));
    both([p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 1.0, 0.0)], None);
    both([p(1.0, 2.0, 3.0); 3], zero);
    both([p(0.0, 0.0, 0.0); 3], zero);
    both([p(0.0, 0.0, 0.0), p(1.0, 2.0, 3.0), p(0.0, 0.0, 0.0)], zero);
    both([p(0.0, 0.0, 0.0), p(1.0, 2.0, 3.0), p(-2.0, -4.0, -6.0)], zero);
    both([p(f64::NAN, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 1.0, 0.0)], infinite);
    both([p(0.0, 0.0, 0.0), p(1.0, f64::INFINITY, 0.0), p(0.0, 1.0, 0.0)], infinite);
    both([p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 1.0, f64::NEG_INFINITY)], infinite);
    // Tiny, huge, needle: small is not degenerate.
    both([p(0.0, 0.0, 0.0), p(1e-41, 0.0, 0.0), p(0.0, 1e-41, 0.0)], None);
    both([p(-3e38, 0.0, 0.0), p(3e38, 0.0, 0.0), p(0.0, 3e38, 0.0)], None);
    both([p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.5, 1e-30, 0.0)], None);
    // What one precision holds and the other does not.
    let beyond = [p(0.0, 0.0, 0.0), p(1e39, 0.0, 0.0), p(0.0, 1.0, 0.0)];
    assert_eq!((single(beyond), double(beyond)), (infinite, None));
    let close = [p(1.0, 0.0, 0.0), p(1.0 + 1e-12, 0.0, 0.0), p(1.0, 1.0, 0.0)];
    assert_eq!((single(close), double(close)), (zero, None));
    // On a line as they are, but not after rounding to f32.
    let line = [p(1.44, -2.75, 2.49), p(1.9, -3.71, 2.13), p(1.67, -3.23, 2.31)];
    both(line, zero);
    assert_eq!(Triangle::check(&Triangle::rounded::<f32>(line)), Ok(()));
}

fn near(got: Option<[f64; 3]>, want: [f64; 3], relative: f64) {
    let got = got.unwrap_or_else(|| panic!("missed {want:?}"));
    for (got, want) in got.into_iter().zip(want) {
        assert!((got - want).abs() <= relative * want.abs(), "{got:?} {want:?}");
    }
}

fn extreme_sizes<S: Real>(tiny: f64, huge: f64) {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    // All products underflow: only the restart can tell. (The eye is as near as the speck is small: from afar the
    // box test, whose reciprocals are finite, cannot see a box this thin.)
    let speck = record::<S>([at(0.0, 0.0, 0.0), at(tiny, 0.0, 0.0), at(0.0, tiny, 0.0)]);
    let down = at(0.0, 0.0, 1.0);
    near(hit((at(0.25, 0.5, -1.0) * tiny, down), &speck), [tiny, 0.25, 0.5], 1e-3);
    near(hit((at(0.5, 0.75, -1.0) * tiny, at(-0.25, -0.25, 1.0)), &speck), [tiny, 0.25, 0.5], 1e-3);
    assert_eq!(hit((at(0.75, 0.5, -1.0) * tiny, down), &speck), None);
    assert_eq!(hit((at(-0.25, 0.5, -1.0) * tiny, down), &speck), None);
    // All products overflow.
    let sail = record::<S>([at(-huge, -huge, 1.0), at(huge, -huge, 1.0), at(0.0, huge, 1.0)]);
    near(hit((at(0.0, 0.0, 0.0), down), &sail), [1.0, 0.25, 0.5], 1e-6);
    near(hit((at(0.0, 0.0, 0.0), down * 1e-3), &sail), [1e3, 0.25, 0.5], 1e-6);
    assert_eq!(hit((at(0.9 * huge, 0.5 * huge, 0.0), down), &sail), None);
    // Far away: `t` is the largest number there is, or beyond it and then nothing is hit.
    let wall = record::<S>([at(-huge, -huge, huge), at(huge, -huge, huge), at(0.0, huge, huge)]);
    near(hit((at(0.0, 0.0, 0.0), down), &wall), [huge, 0.25, 0.5], 1e-6);
    assert_eq!(hit((at(0.0, 0.0, 0.0), down * 1e-3), &wall), None, "t overflows");
}

#[test]
fn tiny_and_huge_triangles_take_the_restart() {
    extreme_sizes::<f32>(f64::from(1e-41f32), f64::from(3e38f32));
    extreme_sizes::<f64>(1e-310, 1e307);
}

/// Whatever lanes are active, they get what the scalar gets and the others keep what they had.
fn masks<V: Lanes>(subsets: impl Iterator<Item = u32>) {
    let mut r = Random(13);
    let corners = random_corners(&mut r);
    let n = record::<V::Scalar>(corners);
    // Lanes with different dominant axes and fates.
    let rays: Vec<Ray> = (0..V::N)
        .map(|i| {
            let org = r.cube() * 6.0;
            let target = if i % 3 == 0 { r.cube() * 4.0 } else { (corners[0] + corners[1] + corners[2]) / 3.0 };
            exact((org, target - org))
        })
        .collect();
    let t_max = 50.0;
    let untouched = ([t_max, 0.0, 0.0].map(f64::to_bits), INVALID_ID);
    let want: Vec<Found> = rays.iter().map(|&ray| lanes::<V::Scalar>(&[ray], &n, 1, t_max)[0]).collect();
    assert!(want.iter().any(|w| *w != untouched));
    for active in subsets {
        let got = lanes::<V>(&rays, &n, active, t_max);
        for i in 0..V::N {
            let want = if active >> i & 1 != 0 { want[i] } else { untouched };
            assert_eq!(got[i], want, "lane {i} of {} with {active:b}", V::N);
        }
    }
}

#[test]
fn every_subset_of_lanes() {
    masks::<f32x4>(0..1 << 4);
    masks::<f32x8>(0..1 << 8);
    masks::<f32x16>(0..1 << 16);
    masks::<f64x2>(0..1 << 2);
    masks::<f64x4>(0..1 << 4);
    masks::<f64x8>(0..1 << 8);
    masks::<Pair<f64x8>>((0..1 << 16).step_by(7));
}

/// A block is its triangles: the nearest of them wins, and slots from `count` on are not looked at.
fn blocks_of<V: Lanes>() {
    let mut r = Random(14);
    for count in (1..=8).cycle().take(80) {
        let mut block = Block::empty();
        let triangles: Vec<[V::Scalar; 9]> = (0..8).map(|_| record(random_corners(&mut r))).collect();
        for (i, n) in triangles.iter().enumerate() {
            block.set(i, *n, i as u32);
        }
        let rays: Vec<Ray> = (0..V::N)
            .map(|_| {
                let org = r.cube() * 6.0;
                exact((org, r.cube() - org))
            })
            .collect();
        let got = traced::<V>(&rays, &block, count, V::ALL, f64::INFINITY);
        for (ray, got) in rays.iter().zip(got) {
            let each = (0..count).filter_map(|i| hit(*ray, &triangles[i]).map(|h| (h[0], i as u32, h)));
            let nearest = each.min_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(got.1, nearest.map_or(INVALID_ID, |n| n.1));
            assert!(nearest.is_none_or(|n| n.2.map(f64::to_bits) == got.0));
        }
    }
}

#[test]
fn a_block_is_its_triangles() {
    blocks_of::<f32>();
    blocks_of::<f32x4>();
    blocks_of::<f32x8>();
    blocks_of::<f32x16>();
    blocks_of::<f64>();
    blocks_of::<f64x2>();
    blocks_of::<f64x4>();
    blocks_of::<f64x8>();
    blocks_of::<Pair<f64x8>>();
}

#[test]
fn blocks_give_back_what_was_put_in() {
    let mut block = Block::<f32, 9>::empty();
    assert!(block.is_empty());
    for i in 0..8 {
        let numbers = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|f| (10 * i + f) as f32);
        block.set(i, numbers, 100 + i as u32);
        assert_eq!((block.len(), block.get(i), block.prim[i]), (i + 1, numbers, 100 + i as u32));
    }
    assert_eq!(block.fields[4][6], 64.0);
}

/// A ray from inside the triangle's box, in its upper face x = 1, to the edge from (1, 2, 2) to (1, -2, -1) at
/// (1, -1, -0.25): 3 units of t away, not 0, where `0 * rcp` lets the box end. Seen the other way the triangle lies
/// behind the ray; in the lower face `0 * rcp` lets the box begin at 0.
#[test]
fn a_ray_in_a_face_of_the_box_gets_its_own_t() {
    fn check<S: Real>() {
        let corners = [DVec3::new(1.0, 2.0, 2.0), DVec3::new(0.25, -1.5, 0.5), DVec3::new(1.0, -2.0, -1.0)];
        for x in [0.0, -0.0] {
            let ray = (DVec3::new(1.0, -0.25, -1.0), DVec3::new(x, -0.25, 0.25));
            near(hit::<S>(ray, &record(corners)), [3.0, 0.0, 0.75], 1e-6);
            let mirrored = |p: DVec3| DVec3::new(-p.x, p.y, p.z);
            near(hit::<S>((mirrored(ray.0), ray.1), &record(corners.map(mirrored))), [3.0, 0.0, 0.75], 1e-6);
            assert_eq!(hit::<S>((ray.0, -ray.1), &record(corners)), None);
            assert_eq!(hit::<S>((mirrored(ray.0), -ray.1), &record(corners.map(mirrored))), None);
        }
    }
    check::<f32>();
    check::<f64>();
}
