//! Leaves: one block of primitives against a packet.

use super::query::Query;
use super::solids;
use crate::bvh::Child;
use crate::lanes::Lanes;
use crate::ray::{Packet, slab::Interval};
use crate::scene::world::{Class, Object, World};
use crate::shape::{Block, Cone, Cuboid, Cylinder, Disc, HalfSpace, Placed, Solid, Sphere, Triangle, WorldSphere};

/// Tests the block a leaf refers to.
#[inline(always)]
pub fn block<V: Lanes, const ANY: bool, const COUNT: bool>(
    object: &Object<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    leaf: Child,
    lanes: u32,
) {
    let (at, count) = (leaf.index as usize, usize::from(leaf.count));
    if leaf.class == Class::Solids as u8 {
        return solids::block(object, &object.solid_blocks[at], inst, packet, query, lanes);
    }
    query.count_leaf(lanes, count);
    match Class::ALL[usize::from(leaf.class)] {
        Class::Triangle => {
            let block = &object.triangles[at];
            Triangle::intersect(packet, query.hit.t, block, (1 << count) - 1, lanes, |found, lanes, prim| {
                query.take(lanes, found, prim, inst)
            });
        }
        Class::WorldSphere => spheres(&object.spheres[at], count, inst, packet, query, lanes),
        class => {
            let block = &object.placed[class as usize][at];
            match class {
                Class::Sphere => placed::<V, Sphere, ANY, COUNT>(block, count, inst, packet, query, lanes),
                Class::Disc => placed::<V, Disc, ANY, COUNT>(block, count, inst, packet, query, lanes),
                Class::Cuboid => placed::<V, Cuboid, ANY, COUNT>(block, count, inst, packet, query, lanes),
                Class::Cylinder => placed::<V, Cylinder, ANY, COUNT>(block, count, inst, packet, query, lanes),
                _ => placed::<V, Cone, ANY, COUNT>(block, count, inst, packet, query, lanes),
            }
        }
    }
}

/// Tests an object's half-spaces and endless solids, which no tree can hold.
#[inline(always)]
pub fn unbounded<V: Lanes, const ANY: bool, const COUNT: bool>(
    object: &Object<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    for block in &object.unbounded {
        query.count_leaf(lanes, block.len());
        placed::<V, HalfSpace, ANY, COUNT>(block, block.len(), inst, packet, query, lanes);
    }
    solids::block(object, &object.unbounded_solids, inst, packet, query, lanes);
}

/// Takes a packet into an instance: the lanes that meet the instance's box, and the packet in its space.
#[inline(always)]
pub fn enter<V: Lanes, const ANY: bool, const COUNT: bool>(
    world: &World<V::Scalar>,
    inst: u32,
    packet: &Packet<V>,
    query: &Query<V, ANY, COUNT>,
    lanes: u32,
) -> (Packet<V>, u32) {
    let instance = &world.instances[inst as usize];
    if instance.identity {
        return (*packet, lanes);
    }
    let interval = Interval::of(packet, instance.bounds.lo, instance.bounds.hi);
    let meets = crate::lanes::LaneMask::bits(interval.meets(packet.t_min, query.hit.t));
    let local = packet.into_local(&instance.to_local, interval.near);
    // A direction may overflow on the way in.
    let live = lanes & meets & local.finite_lanes();
    (local, live)
}

#[inline(always)]
fn spheres<V: Lanes, const ANY: bool, const COUNT: bool>(
    block: &Block<V::Scalar, 4>,
    count: usize,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    for i in 0..count {
        let numbers = block.get(i);
        let span = WorldSphere::span(packet.org, packet.dir, &numbers);
        let found = span.nearest(packet, &WorldSphere::bounds(&numbers));
        query.take(lanes, &found, block.prim[i], inst);
    }
}

#[inline(always)]
fn placed<V: Lanes, K: Solid, const ANY: bool, const COUNT: bool>(
    block: &Block<V::Scalar, 19>,
    count: usize,
    inst: u32,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    for i in 0..count {
        let numbers = block.get(i);
        let span = Placed::span::<V, K>(packet, &numbers);
        let found = span.nearest(packet, &Placed::bounds(&numbers));
        query.take(lanes, &found, block.prim[i], inst);
    }
}
