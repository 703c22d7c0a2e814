//! Whether there is anything at all where many lines go.

use crate::bvh::{Bundle, Child, Tree, WIDTH};
use crate::lanes::Real;
use crate::scene::world::World;

/// Nodes that are looked at, at most: nearly all bundles that meet nothing leave the tree high up.
const MOST: usize = 32;

/// Whether no line of `bundle` can meet anything in `world`. Where a short look does not tell, it is not.
pub fn is_void<S: Real>(world: &World<S>, bundle: &Bundle<S>) -> bool {
    let tree = if world.is_single_object() { &world.first_object().tree } else { &world.top };
    !world.has_unbounded() && meets_no_leaf(tree, bundle)
}

fn meets_no_leaf<S: Real>(tree: &Tree<S>, bundle: &Bundle<S>) -> bool {
    let mut waiting = [Child::ROOT.index; MOST];
    let (mut seen, mut found) = (0, usize::from(!tree.nodes.is_empty()));
    let mut near = [S::ZERO; WIDTH];
    while seen < found {
        let node = &tree.nodes[waiting[seen] as usize];
        seen += 1;
        let mut met = bundle.children::<S::Wide>(node, &mut near) & ((1 << node.used) - 1);
        while met != 0 {
            let child = node.child(met.trailing_zeros() as usize & (WIDTH - 1));
            met &= met - 1;
            if child.is_leaf() || found == MOST {
                return false;
            }
            waiting[found] = child.index;
            found += 1;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::lanes::each;
    use crate::math::Random;
    use crate::ray::{Hits, Rays};
    use crate::scene::description::{Description, Item, ItemKind, Shape};
    use crate::scene::world::Preset;
    use crate::trace::{Engines, Scratch, engine};

    /// Where there is said to be nothing no line meets anything; and that is said of most bundles that meet nothing.
    fn nothing_is_met_in_the_void<S: Engines>() {
        let mut random = Random(7);
        let mut description = Description::new("dots");
        for _ in 0..200 {
            let place = DAffine3::from_scale_rotation_translation(
                DVec3::splat(0.05),
                glam::DQuat::IDENTITY,
                random.cube() * DVec3::new(4.0, 4.0, 0.5),
            );
            let kind = ItemKind::Shape(Shape::Sphere);
            description.groups[0].items.push(Item { transform: place, material: None, kind });
        }
        let world = World::<S>::compile(&description, Preset::Balanced).unwrap();
        let (mut scratch, mut hits, mut rays) = (Scratch::default(), Hits::new(0), Rays::new(64));
        let (mut void, mut empty) = (0, 0);
        for round in 0..3000 {
            let corner = [random.cube() * 5.0 + DVec3::Z * 6.0, DVec3::new(0.0, 0.0, -1.0) + random.cube() * 0.3];
            let size = [random.cube().abs() * 0.2, random.cube().abs() * 0.02 * f64::from(round % 2)];
            let [org, dir] =
                [0, 1].map(|k| each(|a| [0.0, 1.0].map(|end| S::from_f64(corner[k][a] + end * size[k][a]))));
            for i in 0..rays.len() {
                let mut between = |[low, high]: [S; 2]| {
                    let x = S::from_f64(low.to_f64() + random.unit() * (high.to_f64() - low.to_f64()));
                    if x < low || high < x { low } else { x }
                };
                rays.set(i, org.map(&mut between), dir.map(&mut between), S::ZERO, S::INFINITY);
            }
            engine::<S>("scalar").unwrap().intersect(&world, &rays, &mut hits, &mut scratch, None);
            let pairs = |ends: [[S; 2]; 3]| ends.map(|[low, high]| (low, high));
            let is_void = is_void(&world, &Bundle::spanning(pairs(org), pairs(dir), S::ZERO, S::INFINITY));
            assert!(!is_void || hits.hit_count() == 0, "round {round}");
            void += usize::from(is_void);
            empty += usize::from(hits.hit_count() == 0);
        }
        assert!(empty < 2900 && void > empty / 2, "{void} of {empty}");
    }

    #[test]
    fn nothing_is_met_in_the_void_of_either_precision() {
        nothing_is_met_in_the_void::<f32>();
        nothing_is_met_in_the_void::<f64>();
    }
}
