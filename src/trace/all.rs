//! All stretches of rays inside solids: `trace --query all`.
//!
//! Every tree of solids is one solid, and so is every sphere, box, cylinder, cone and half-space that stands alone; they are
//! swept from end to end. Surfaces without an inside (meshes, discs) have no stretches.

use super::{Engines, Scratch};
use crate::csg::{self, Depth};
use crate::lanes::{LaneMask, Lanes, MAX_LANES, Real};
use crate::ray::slab::Interval;
use crate::ray::{INVALID_ID, Packet, Rays};
use crate::scene::world::{Class, Object, PlacedSolid, World};
use crate::shape::{Block, Cone, Cuboid, Cylinder, HalfSpace, Placed, Solid, Span, Sphere, WorldSphere};

/// A stretch of one ray inside one solid, cut to the ray's segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Number of the ray.
    pub ray: u32,
    /// Instance of the solid.
    pub inst: u32,
    /// Where it begins.
    pub t_in: f64,
    /// Where it ends, not before it begins.
    pub t_out: f64,
    /// Primitive that is entered through; [`INVALID_ID`] where the segment begins inside.
    pub prim_in: u32,
    /// Primitive that is left through; [`INVALID_ID`] where the segment ends inside.
    pub prim_out: u32,
    /// u and v of the hit where it is entered: the face's number, and 1 where the leaf was subtracted.
    pub uv_in: [f64; 2],
    /// The same where it is left.
    pub uv_out: [f64; 2],
}

/// All stretches of the rays of a batch, `V::N` rays at a time, in order of ray, `t_in`, instance and primitive.
pub fn stretches<V: Lanes>(world: &World<V::Scalar>, rays: &Rays<V::Scalar>, scratch: &mut Scratch) -> Vec<Stretch>
where
    V::Scalar: Engines,
{
    let mut list = Vec::new();
    let solids = &mut V::Scalar::memory(scratch).stack.solids;
    for first in (0..rays.len()).step_by(V::N) {
        let (packet, t_max, live) = Packet::<V>::load(rays, first);
        let start = list.len();
        let mut job = Job { packet, t_max, live, first: first as u32, list: &mut list, solids };
        if live != 0 {
            job.world(world);
        }
        let key = |s: &Stretch| (s.ray, s.inst, s.prim_in, s.prim_out);
        list[start..]
            .sort_by(|a, b| a.ray.cmp(&b.ray).then(a.t_in.total_cmp(&b.t_in)).then_with(|| key(a).cmp(&key(b))));
    }
    list
}

/// One packet's search.
struct Job<'a, V: Lanes> {
    packet: Packet<V>,
    t_max: V,
    live: u32,
    first: u32,
    list: &'a mut Vec<Stretch>,
    solids: &'a mut Option<Box<csg::Scratch<V::Scalar>>>,
}

/// What a lane is in the middle of.
#[derive(Clone, Copy)]
struct Open {
    t_in: f64,
    prim_in: u32,
    uv_in: [f64; 2],
}

/// Where a stretch ends.
#[derive(Clone, Copy)]
struct Close {
    t_out: f64,
    prim_out: u32,
    uv_out: [f64; 2],
}

impl Close {
    /// The surface as the other end of a stretch.
    fn opens(self) -> Open {
        Open { t_in: self.t_out, prim_in: self.prim_out, uv_in: self.uv_out }
    }
}

impl<V: Lanes> Job<'_, V> {
    fn world(&mut self, world: &World<V::Scalar>) {
        for (inst, instance) in world.instances.iter().enumerate() {
            let interval = Interval::of(&self.packet, instance.bounds.lo, instance.bounds.hi);
            let lanes = interval.meets(self.packet.t_min, self.t_max).bits() & self.live;
            if lanes == 0 {
                continue;
            }
            let packet = match instance.identity {
                true => self.packet,
                false => self.packet.into_local(&instance.to_local, interval.near),
            };
            let inst = inst as u32;
            // Meshes alone are traced as one object with others.
            let inst = world.names.as_ref().map_or(inst, |names| names.of(0, inst)[1]);
            self.object(&world.objects[instance.object as usize], &packet, lanes, inst);
        }
    }

    fn object(&mut self, object: &Object<V::Scalar>, packet: &Packet<V>, lanes: u32, inst: u32) {
        for placed in &object.solids {
            let bounds = &placed.solid.bounds;
            let interval = Interval::of(packet, bounds.lo, bounds.hi);
            let lanes = interval.meets(packet.t_min, self.t_max).bits() & lanes;
            if lanes != 0 {
                self.solid(placed, packet, &interval, lanes, inst);
            }
        }
        for block in &object.spheres {
            for i in 0..block.len() {
                let numbers = block.get(i);
                let span = WorldSphere::span(packet.org, packet.dir, &numbers);
                self.span(packet, &span, lanes, block.prim[i], inst);
            }
        }
        let placed = |class: Class| &object.placed[class as usize][..];
        self.blocks::<Sphere>(placed(Class::Sphere), packet, lanes, inst);
        self.blocks::<Cuboid>(placed(Class::Cuboid), packet, lanes, inst);
        self.blocks::<Cylinder>(placed(Class::Cylinder), packet, lanes, inst);
        self.blocks::<Cone>(placed(Class::Cone), packet, lanes, inst);
        self.blocks::<HalfSpace>(&object.unbounded, packet, lanes, inst);
    }

    fn blocks<K: Solid>(&mut self, blocks: &[Block<V::Scalar, 19>], packet: &Packet<V>, lanes: u32, inst: u32) {
        for block in blocks {
            for i in 0..block.len() {
                let span = Placed::span::<V, K>(packet, &block.get(i));
                self.span(packet, &span, lanes, block.prim[i], inst);
            }
        }
    }

    fn span(&mut self, packet: &Packet<V>, span: &Span<V>, lanes: u32, prim: u32, inst: u32) {
        let mut hit = span.hit.bits() & lanes;
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize;
            hit &= hit - 1;
            let end = |t: V, face: V| Close {
                t_out: t.lane(lane).to_f64(),
                prim_out: prim,
                uv_out: [face.lane(lane).to_f64(), 0.0],
            };
            let (enter, leave) = (end(span.t_in, span.face_in), end(span.t_out, span.face_out));
            self.close(packet, lane, enter.opens(), leave, inst);
        }
    }

    fn solid(
        &mut self,
        placed: &PlacedSolid<V::Scalar>,
        packet: &Packet<V>,
        interval: &Interval<V>,
        lanes: u32,
        inst: u32,
    ) {
        let endless = Open { t_in: f64::NEG_INFINITY, prim_in: INVALID_ID, uv_in: [0.0; 2] };
        let mut open = [placed.solid.reaches_everywhere().then_some(endless); MAX_LANES];
        let mut scratch = self.solids.take().unwrap_or_default();
        csg::sweep(&placed.solid, packet, (lanes, interval), self.t_max, Depth::Whole, &mut scratch, |boundary| {
            let t = packet.t_floor.fast_max(interval.clamp(boundary.t));
            let prim = placed.first_prim + placed.solid.number(boundary.leaf);
            let mut rest = boundary.lanes;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let turned = f64::from(boundary.turned >> lane & 1);
                let uv_out = [boundary.face.lane(lane).to_f64(), turned];
                let end = Close { t_out: t.lane(lane).to_f64(), prim_out: prim, uv_out };
                match open[lane].take() {
                    Some(entered) => self.close(packet, lane, entered, end, inst),
                    None => open[lane] = Some(end.opens()),
                }
            }
            0
        });
        *self.solids = Some(scratch);
        for lane in (0..V::N).filter(|lane| lanes >> lane & 1 != 0) {
            if let Some(entered) = open[lane] {
                let end = Close { t_out: f64::INFINITY, prim_out: INVALID_ID, uv_out: [0.0; 2] };
                self.close(packet, lane, entered, end, inst);
            }
        }
    }

    /// Adds a stretch, cut to the segment; a stretch of no length is none.
    fn close(&mut self, packet: &Packet<V>, lane: usize, open: Open, end: Close, inst: u32) {
        let Close { t_out, prim_out, uv_out } = end;
        let (t_min, t_max) = (packet.t_min.lane(lane).to_f64(), self.t_max.lane(lane).to_f64());
        let starts_inside = open.t_in < t_min || open.t_in == f64::NEG_INFINITY;
        let ends_inside = t_out > t_max || t_out == f64::INFINITY;
        let stretch = Stretch {
            ray: self.first + lane as u32,
            inst,
            t_in: if starts_inside { t_min } else { open.t_in },
            t_out: if ends_inside { t_max } else { t_out },
            prim_in: if starts_inside { INVALID_ID } else { open.prim_in },
            prim_out: if ends_inside { INVALID_ID } else { prim_out },
            uv_in: if starts_inside { [0.0; 2] } else { open.uv_in },
            uv_out: if ends_inside { [0.0; 2] } else { uv_out },
        };
        if stretch.t_in < stretch.t_out {
            self.list.push(stretch);
        }
    }
}
