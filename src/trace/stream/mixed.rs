//! The rays of a chunk that go together whatever their octants, against the boxes of a node: what [`super::node`] has for those of
//! one octant, any-hit only.

use super::chunk::{Chunk, RAYS, Set};
use super::node::{Met, exact, one_by_one, planes, quick};
use super::region::Region;
use crate::bvh::Node;
use crate::lanes::{LaneMask, Lanes, Real, each, map3};
use crate::ray::slab::{Interval, pad};

/// How many rays' tests of a node take as long as a vector's test of one box.
const BOX: u32 = 1;

/// Tests `rays` of a chunk whose segments lie in `region` and end at `t`; adds to `tests` what it took, as tests of
/// one ray. `V`: vectors of rays; `E`: of a node's children.
#[inline(always)]
pub fn meet<V: Lanes, E: Lanes<Scalar = V::Scalar>, const W: usize>(
    node: &Node<V::Scalar, W>,
    chunk: &Chunk<V::Scalar>,
    region: &Region<V::Scalar>,
    t: &[V::Scalar; RAYS],
    rays: Set,
    tests: &mut u64,
) -> Met<V::Scalar, W> {
    let children = region.children::<E, W>(node);
    let (few, many) = (BOX * children.count_ones() * chunk.len.div_ceil(V::N) as u32, rays.count_ones());
    *tests += u64::from(few.min(many));
    if few <= many {
        return dense::<V, W>(node, chunk, t, rays, children);
    }
    let boxes = |ray: usize| map3(planes(node, chunk.octant[ray].into()), |(near, far)| (E::load(near), E::load(far)));
    match chunk.steep {
        true => one_by_one::<E, W, true>(rays, |ray| exact(&boxes(ray), chunk, t, ray)),
        false => one_by_one::<E, W, true>(rays, |ray| quick(&boxes(ray), chunk, t, ray)),
    }
}

/// One child of `children` after the other against vectors of rays.
#[inline(never)]
fn dense<V: Lanes, const W: usize>(
    node: &Node<V::Scalar, W>,
    chunk: &Chunk<V::Scalar>,
    t: &[V::Scalar; RAYS],
    rays: Set,
    children: u32,
) -> Met<V::Scalar, W> {
    let mut met = Met { children: 0, halves: [[0; W]; 2], near: [V::Scalar::ZERO; W], bound: false };
    let mut rest = children;
    while rest != 0 {
        let child = rest.trailing_zeros() as usize & (W - 1);
        rest &= rest - 1;
        let corners = map3([0, 1, 2], |a: usize| map2(&node.bounds[a], child));
        let mut meeting = [0u64; 2];
        for (half, meeting) in meeting.iter_mut().enumerate() {
            for at in (64 * half..chunk.len.min(64 * half + 64)).step_by(V::N) {
                let [x, y, z] = each(|a| {
                    let (org, rcp) = (V::load(&chunk.org[a][at..]), V::load(&chunk.rcp[a][at..]));
                    let [t0, t1] = corners[a].map(|plane: V| (plane - org) * rcp);
                    (t0.fast_min(t1), t0.fast_max(t1))
                });
                let near = x.0.fast_max(y.0).fast_max(z.0);
                let interval = Interval { near, far: pad(x.1.fast_min(y.1).fast_min(z.1)) };
                let meets = interval.meets(V::load(&chunk.t_min[at..]), V::load(&t[at..]));
                *meeting |= u64::from(meets.bits()) << (at % 64);
            }
        }
        let meeting = [meeting[0] & rays as u64, meeting[1] & (rays >> 64) as u64];
        (met.halves[0][child], met.halves[1][child]) = (meeting[0], meeting[1]);
        met.children |= u32::from(meeting[0] | meeting[1] != 0) << child;
    }
    met
}

/// The planes of a child that bound it along one axis.
#[inline(always)]
fn map2<V: Lanes, const W: usize>(planes: &[[V::Scalar; W]; 2], child: usize) -> [V; 2] {
    [V::splat(planes[0][child]), V::splat(planes[1][child])]
}
