//! The first boundary found directly is the first one of the whole sweep, bit by bit.

use glam::{DAffine3, DQuat, DVec3};

use super::*;
use crate::bvh::Preset;
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Pair, Real, f32x4, f32x16, f64x8};
use crate::math::Random;
use crate::ray::Packet;
use crate::ray::slab::Interval;

/// A leaf: often with faces in the planes of others. `once`: lines pass through it at most once.
fn leaf(r: &mut Random, size: f64, once: bool) -> LeafInput<'static> {
    let convex = [Form::Cuboid, Form::Sphere, Form::Cylinder, Form::Cone(0.5), Form::Cuboid];
    let others =
        [Form::Torus(0.4), Form::EllipticTorus([0.5, 0.2]), Form::Round([0.1, -0.5, 1.0]), Form::Taper([0.5, 1.5])];
    let form = if r.below(4) == 0 && !once { others[r.below(4)] } else { convex[r.below(5)] };
    let snapped = r.below(2) == 0;
    let snap = |v: DVec3| if snapped { (v * 4.0).round() / 4.0 } else { v };
    let scale = snap(DVec3::splat(0.25) + r.cube().abs() * size).max(DVec3::splat(0.25));
    let turn = if snapped { DQuat::IDENTITY } else { DQuat::from_euler(glam::EulerRot::XYZ, r.unit(), r.unit(), 0.0) };
    let to_tree = DAffine3::from_scale_rotation_translation(scale, turn, snap(r.cube() * 1.5));
    let (lo, hi) = match form {
        Form::Cylinder | Form::Cone(_) => (DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE),
        Form::Torus(_) | Form::EllipticTorus(_) => (DVec3::splat(-1.6), DVec3::splat(1.6)),
        Form::Round(_) | Form::Taper(_) => (DVec3::new(-1.6, -1.6, 0.0), DVec3::new(1.6, 1.6, 1.0)),
        _ => (DVec3::NEG_ONE, DVec3::ONE),
    };
    LeafInput { form, lo, hi, to_tree }
}

/// One operation over `count` leaves, each as it is or its outside.
fn solid<S: Real>(r: &mut Random, count: usize) -> Vec<Solid<S>> {
    // Among many leaves first boundaries are found directly only if lines pass through all at most once.
    let many = count > 20;
    let mut leaves: Vec<_> = (0..count).map(|_| leaf(r, if many { 0.4 } else { 1.5 }, many)).collect();
    let op = if r.below(3) == 0 { Op::Union } else { Op::Intersection };
    // Without these most would be nothing, or everything.
    let whole = if op == Op::Union { 0 } else { 1 + r.below(2) };
    leaves.iter_mut().take(whole).for_each(|leaf| leaf.to_tree.matrix3 *= 4.0);
    let mut program = Vec::new();
    for i in 0..count {
        program.push(Token::Leaf(i as u32));
        let plain = if op == Op::Union { r.below(8) > 0 } else { i < whole };
        if !plain {
            program.push(Token::Op(Op::Complement, 1));
        }
    }
    program.push(Token::Op(op, count as u32));
    build(&Input { leaves: &leaves, program: &program, tolerance: 0.0 }, Preset::Fast).solids
}

/// Groups of leaves, each one operation, in another one.
fn nested<S: Real>(r: &mut Random, count: usize) -> Vec<Solid<S>> {
    let mut leaves: Vec<_> = (0..count).map(|_| leaf(r, 1.5, false)).collect();
    let ops = [Op::Union, Op::Intersection, Op::Difference];
    let (mut program, mut in_group, mut groups) = (Vec::new(), 0, 0);
    for i in 0..count {
        // The first of a group is large.
        if in_group == 0 {
            leaves[i].to_tree.matrix3 *= 3.0;
        }
        program.push(Token::Leaf(i as u32));
        in_group += 1;
        if i + 1 == count || r.below(2) == 0 {
            program.push(Token::Op(ops[r.below(3)], in_group));
            (in_group, groups) = (0, groups + 1);
        }
    }
    program.push(Token::Op(ops[r.below(3)], groups));
    if r.below(4) == 0 {
        program.push(Token::Op(Op::Complement, 1));
    }
    build(&Input { leaves: &leaves, program: &program, tolerance: 0.0 }, Preset::Fast).solids
}

/// Lane by lane: t, face, leaf, whether the solid is entered, whether the leaf is turned.
type Firsts<S> = [Option<(S, S, u32, bool, bool)>; MAX_LANES];

fn firsts<V: Lanes>(
    solid: &Solid<V::Scalar>,
    packet: &Packet<V>,
    lanes: u32,
    limit: V,
    depth: Depth,
) -> (Firsts<V::Scalar>, Effort) {
    let interval = Interval::of(packet, solid.bounds.lo, solid.bounds.hi);
    let lanes = interval.meets(packet.t_min, limit).bits() & lanes;
    let mut firsts = [None; MAX_LANES];
    if lanes == 0 {
        return (firsts, Effort::default());
    }
    let effort = sweep(solid, packet, (lanes, &interval), limit, depth, &mut Scratch::default(), |boundary| {
        let t = packet.t_floor.fast_max(interval.clamp(boundary.t));
        let finite = boundary.t.abs().cmp_le(V::splat(V::Scalar::MAX));
        let counts = (packet.t_min.cmp_le(t) & finite & t.cmp_le(limit)).bits() & boundary.lanes;
        for lane in (0..V::N).filter(|lane| counts >> lane & 1 != 0) {
            let bit = |mask: u32| mask >> lane & 1 != 0;
            let found = (boundary.t.lane(lane), boundary.face.lane(lane), boundary.leaf);
            firsts[lane].get_or_insert((found.0, found.1, found.2, bit(boundary.enters), bit(boundary.turned)));
        }
        counts
    });
    (firsts, effort)
}

/// Some lines, many along axes and in the planes of faces, from outside and from inside.
fn packet<V: Lanes>(r: &mut Random) -> (Packet<V>, V) {
    let (mut org, mut dir) = ([[V::Scalar::ZERO; MAX_LANES]; 3], [[V::Scalar::ZERO; MAX_LANES]; 3]);
    let base = r.cube() * if r.below(2) == 0 { 1.0 } else { 6.0 };
    let towards = r.cube() * 1.5 - base;
    let along = [DVec3::X, DVec3::NEG_Y, DVec3::Z][r.below(3)];
    let kind = r.below(3);
    for lane in 0..V::N {
        let (o, d) = match kind {
            0 => (base, towards + r.cube() * 0.3),
            1 => ((r.cube() * 8.0).round() / 4.0 - along * 4.0 * r.unit().round(), along),
            _ => (r.cube() * 2.0, r.cube()),
        };
        for axis in 0..3 {
            (org[axis][lane], dir[axis][lane]) = (V::Scalar::from_f64(o[axis]), V::Scalar::from_f64(d[axis]));
        }
    }
    let t_min = if r.below(4) == 0 { 0.5 } else { 0.0 };
    let limit = if r.below(4) == 0 { V::constant(1.0) } else { V::splat(V::Scalar::INFINITY) };
    (Packet::unsheared(org.map(|x| V::load(&x)), dir.map(|x| V::load(&x)), V::constant(t_min)), limit)
}

fn check<V: Lanes>(seed: u64) {
    let mut r = Random(seed);
    let (mut hits, mut direct, mut searched) = (0, 0, 0);
    for round in 0..3600 {
        // So many leaves that only a share of each line is looked at first.
        let many = if round % 4 == 0 { 300 } else { 40 };
        let count = [2, 2, 3, 4, 7, many, 4, 6, 9][round % 9];
        let solids = if round % 9 < 6 { solid::<V::Scalar>(&mut r, count) } else { nested(&mut r, count) };
        for solid in solids {
            for _ in 0..20 {
                let (packet, limit) = packet::<V>(&mut r);
                let live = if r.below(2) == 0 { V::ALL } else { r.below(1 << V::N) as u32 };
                let (all, _) = firsts(&solid, &packet, live, limit, Depth::Whole);
                let (first, effort) = firsts(&solid, &packet, live, limit, Depth::FrontFirst);
                assert_eq!(first, all, "{round}: {count} leaves, {packet:?}, to {limit:?}");
                hits += all.iter().flatten().count();
                direct += usize::from(solid.operation.is_some() && effort.steps == 1 && effort.events > 0);
                searched += usize::from(solid.operation.is_some() && solid.search.is_some() && effort.events > 0);
            }
        }
    }
    assert!(hits > 3000 && direct > 1000, "{hits} hits, {direct} packets without a sweep");
    assert!(searched > 1000, "{searched} packets among many leaves");
}

#[test]
fn first_boundaries_are_those_of_the_sweep() {
    check::<f32x16>(1);
    check::<f32x4>(2);
    check::<f64x8>(3);
    check::<Pair<f64x8>>(4);
    check::<f64>(5);
}

#[test]
fn groups_of_one_are_what_they_hold() {
    for group in [Op::Union, Op::Intersection, Op::Difference, Op::Xor] {
        for complements in 0..3 {
            let mut program = vec![Token::Leaf(0), Token::Leaf(1)];
            for _ in 0..complements {
                program.extend([Token::Op(group, 1), Token::Op(Op::Complement, 1)]);
            }
            program.extend([Token::Op(group, 1), Token::Op(Op::Intersection, 2)]);
            let tree = tree::Tree::new(&program, 2);
            assert_eq!(tree.nodes.len(), 1, "{program:?}");
            let negated: Vec<bool> = tree.leaves.iter().map(|leaf| leaf.negated).collect();
            assert_eq!(negated, [false, complements == 1], "{program:?}");
        }
    }
}
