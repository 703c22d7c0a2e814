//! Brute force: every primitive of every instance. The oldest baseline, and the proof that trees lose nothing.

use super::leaf;
use super::query::Query;
use crate::bvh::Child;
use crate::lanes::Lanes;
use crate::ray::Packet;
use crate::scene::world::{Class, Object, SolidBlock, World};
use crate::shape::Block;

/// Tests everything in the world.
#[inline(always)]
pub fn world<V: Lanes, const ANY: bool, const COUNT: bool>(
    world: &World<V::Scalar>,
    packet: &Packet<V>,
    query: &mut Query<V, ANY, COUNT>,
    lanes: u32,
) {
    for (inst, instance) in world.instances.iter().enumerate() {
        let inst = inst as u32;
        let (local, inside) = leaf::enter(world, inst, packet, query, lanes);
        if inside == 0 {
            continue;
        }
        let object = &world.objects[instance.object as usize];
        leaf::unbounded(object, inst, &local, query, inside);
        for (class, blocks) in blocks_by_class(object) {
            for (index, count) in blocks.into_iter().enumerate() {
                let child = Child { index: index as u32, count: count as u8, class: class as u8 };
                leaf::block(object, inst, &local, query, child, inside);
                if ANY && query.done & lanes == lanes {
                    return;
                }
            }
        }
    }
}

/// Sizes of an object's blocks, class by class.
fn blocks_by_class<S: crate::lanes::Real>(object: &Object<S>) -> impl Iterator<Item = (Class, Vec<usize>)> {
    Class::ALL.into_iter().map(|class| {
        let sizes = match class {
            Class::Triangle => object.triangles.iter().map(Block::len).collect(),
            Class::WorldSphere => object.spheres.iter().map(Block::len).collect(),
            Class::Solids => object.solid_blocks.iter().map(SolidBlock::len).collect(),
            _ => object.placed[class as usize].iter().map(Block::len).collect(),
        };
        (class, sizes)
    })
}
