//! The rays of a chunk that go together whatever their octants, against the boxes of a node: what [`super::node`] has for those of
//! one octant.

use super::chunk::{Chunk, RAYS, Set};
use super::node::{Met, dense, exact, loosened, one_by_one, planes, quick};
use super::region::Region;
use crate::bvh::Node;
use crate::lanes::{Lanes, map3};

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
        return dense::<V, W, true, true>(node, chunk, t, rays, (0, children));
    }
    sparse::<E, W, true>(node, chunk, t, rays)
}

/// One ray after the other against all children.
#[inline(always)]
pub fn sparse<E: Lanes, const W: usize, const ANY: bool>(
    node: &Node<E::Scalar, W>,
    chunk: &Chunk<E::Scalar>,
    t: &[E::Scalar; RAYS],
    rays: Set,
) -> Met<E::Scalar, W> {
    let boxes = |ray: usize| map3(planes(node, chunk.octant[ray].into()), |(near, far)| (E::load(near), E::load(far)));
    if chunk.steep {
        return one_by_one::<E, W, ANY>(rays, |ray| exact(&boxes(ray), chunk, t, ray));
    }
    let mut met = one_by_one::<E, W, ANY>(rays, |ray| quick(&boxes(ray), chunk, t, ray));
    if !ANY {
        loosened(E::load(&met.near)).store(&mut met.near);
    }
    met
}
