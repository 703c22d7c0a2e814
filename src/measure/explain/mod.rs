//! Why one engine beats another: what each did per packet and per pixel, where its time goes, and what the tree is worth.
//!
//! Counts come from the counting builds of the same kernels, one packet at a time: an engine that traces n rays together gets
//! n aligned consecutive rays, a square block of pixels. (`tile` chooses what to do by what its last tiles showed, so a
//! block alone may be treated a little differently than in a stream.)

mod divergence;
mod limit;
mod ports;
mod share;
mod spread;
mod tree;

use std::time::Instant;

use rayon::prelude::*;

use crate::bvh::{Node, WIDE};
use crate::camera::{FILE_TILE, Tiling};
use crate::error::{Error, Result};
use crate::measure::raysets::{Query, RayKind};
use crate::ray::{Counters, Hits, Rays};
use crate::scene::world::World;
use crate::trace::{Engine, Engines, Scratch, engine};

pub use limit::{Costs, Limit, costs, is_of_triangles};
pub use ports::{Ports, Rate};
pub use share::Shares;
pub use spread::Spread;
pub use tree::{Quality, quality};

/// Times each batch is traced by the clock; the fastest counts.
const REPEATS: usize = 5;

/// What one engine did with one class of rays.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Work {
    /// The engine.
    pub engine: &'static str,
    /// Rays traced together.
    pub lanes: usize,
    /// Lanes of the vectors that they are traced in.
    pub width: usize,
    /// Packets with a live ray.
    pub packets: u64,
    /// Live rays.
    pub rays: u64,
    /// Per packet.
    pub per_packet: PerPacket,
    /// Per live ray, over all: node visits.
    pub nodes_per_ray: f64,
    /// Box tests.
    pub boxes_per_ray: f64,
    /// Leaf visits.
    pub leaves_per_ray: f64,
    /// Primitive tests.
    pub prims_per_ray: f64,
    /// Bytes of nodes and leaf blocks that were looked at.
    pub bytes_per_ray: f64,
    /// Of packets with two or more live rays, the share whose rays stay together down to the leaves; `None` for single rays.
    pub together: Option<f64>,
    /// Of the boxes of visited nodes, the share that met the packet's bounds and was tested; 0 for engines that test no box against a
    /// packet, as those of single rays.
    pub boxes_passed: f64,
    /// Of the lanes paid for in node visits of all packets, the share that was wanted, per cent; 0 without a visit.
    pub node_lanes: f64,
    /// The same of primitive tests.
    pub prim_lanes: f64,
    /// Million rays per second of the fastest passes, one thread, live rays only.
    pub mrays_per_s: f64,
    /// The time its tests would take alone; `None` if there are other primitives than triangles.
    pub limit: Option<Limit>,
    /// Where the time goes, by a fit; `None` if there are too few batches or the fit says nothing.
    pub shares: Option<Shares>,
    /// Node visits and primitive tests per ray of each pixel, if the rays belong to pixels.
    #[serde(skip)]
    pub maps: Option<Maps>,
}

/// Distributions over packets.
#[derive(Clone, Debug, serde::Serialize)]
pub struct PerPacket {
    /// Node visits.
    pub nodes: Spread,
    /// Box tests.
    pub boxes: Spread,
    /// Leaf visits.
    pub leaves: Spread,
    /// Primitive tests.
    pub prims: Spread,
    /// Share of lanes that wanted a node visit, per cent; packets without a visit are left out.
    pub node_lanes: Spread,
    /// Share of lanes that wanted a primitive test, per cent; packets without a test are left out.
    pub prim_lanes: Spread,
    /// Bytes of nodes and leaf blocks that were looked at, again and again if need be.
    pub bytes: Spread,
    /// Depth in the tree at which some, but not all rays of a packet go on (1: the root's children); packets that stay
    /// together are left out.
    pub divergence: Spread,
}

/// Values per pixel, row-major.
#[derive(Clone, Debug)]
pub struct Maps {
    /// Width and height.
    pub size: (u32, u32),
    /// Node visits per live ray of the pixel's packet.
    pub nodes: Vec<f32>,
    /// Primitive tests per live ray of the pixel's packet.
    pub prims: Vec<f32>,
}

/// Counts and times `engine` on `batches` of the class `kind`, made for a picture of `size`. Counting runs on the current
/// rayon pool, the clock on one thread. `costs`: what [`costs()`] measured.
///
/// # Errors
/// [`Error::Interrupted`] when `stop` says so.
pub fn work<S: Engines>(
    engine: &dyn Engine<S>,
    world: &World<S>,
    batches: &[Rays<S>],
    kind: RayKind,
    size: (u32, u32),
    costs: &Costs,
    stop: &dyn Fn() -> bool,
) -> Result<Work> {
    let lanes = engine.lanes().max(1);
    let query = kind.query();
    let counted: Vec<Vec<Counters>> = batches
        .par_iter()
        .map(|batch| packets(batch, lanes).map(|p| count(engine, world, &p, query)).collect())
        .collect();
    let all: Vec<&Counters> = counted.iter().flatten().filter(|c| c.rays > 0).collect();
    let mut total = Counters::default();
    all.iter().for_each(|c| total += **c);
    let spread = |value: &dyn Fn(&Counters) -> f64| Spread::of(all.iter().map(|c| value(c)).collect());
    let share = |[active, lanes]: [u64; 2]| 100.0 * active as f64 / lanes.max(1) as f64;
    let node_lanes = |c: &Counters| [c.node_lanes_active, c.node_lanes_total];
    let prim_lanes = |c: &Counters| [c.prim_lanes_active, c.prim_lanes_total];
    // A packet without a test has wasted no lane on one.
    let shares_of = |lanes: &dyn Fn(&Counters) -> [u64; 2]| {
        Spread::of(all.iter().map(|c| lanes(c)).filter(|[_, total]| *total > 0).map(share).collect())
    };
    let leaf_bytes = bytes_of_leaf(world);
    let rays = total.rays.max(1) as f64;
    let bytes = |c: &Counters| bytes_of_nodes::<S>(c) + c.leaves as f64 * leaf_bytes;
    let (depths, packets_of_many) = divergence(world, batches, lanes)?;
    let (seconds, shares) = clock(engine, world, batches, query, stop)?;
    Ok(Work {
        engine: engine.name(),
        lanes,
        width: engine.width(),
        packets: all.len() as u64,
        rays: total.rays,
        per_packet: PerPacket {
            nodes: spread(&|c| c.nodes as f64),
            boxes: spread(&|c| c.boxes as f64),
            leaves: spread(&|c| c.leaves as f64),
            prims: spread(&|c| c.prims as f64),
            node_lanes: shares_of(&node_lanes),
            prim_lanes: shares_of(&prim_lanes),
            bytes: spread(&bytes),
            divergence: Spread::of(depths.iter().map(|&depth| f64::from(depth)).collect()),
        },
        nodes_per_ray: total.nodes as f64 / rays,
        boxes_per_ray: total.boxes as f64 / rays,
        leaves_per_ray: total.leaves as f64 / rays,
        prims_per_ray: total.prims as f64 / rays,
        bytes_per_ray: bytes(&total) / rays,
        together: (packets_of_many > 0).then(|| 1.0 - depths.len() as f64 / packets_of_many as f64),
        boxes_passed: total.boxes as f64 / total.node_boxes.max(1) as f64,
        node_lanes: share(node_lanes(&total)),
        prim_lanes: share(prim_lanes(&total)),
        mrays_per_s: if seconds > 0.0 { total.rays as f64 / seconds / 1e6 } else { 0.0 },
        limit: if is_of_triangles(world) { Limit::of(costs, &total, seconds) } else { None },
        shares,
        maps: (kind != RayKind::Scatter).then(|| maps(&counted, lanes, size)).transpose()?,
    })
}

/// Aligned consecutive rays, `lanes` at a time.
fn packets<S: Engines>(batch: &Rays<S>, lanes: usize) -> impl Iterator<Item = Rays<S>> {
    (0..batch.len()).step_by(lanes).map(move |first| {
        let count = lanes.min(batch.len() - first);
        let mut rays = Rays::new(count);
        for slot in 0..count {
            let i = first + slot;
            rays.set(slot, batch.org(i), batch.dir(i), batch.t_min[i], batch.t_max[i]);
        }
        rays
    })
}

fn count<S: Engines>(engine: &dyn Engine<S>, world: &World<S>, rays: &Rays<S>, query: Query) -> Counters {
    let (mut counters, mut scratch) = (Counters::default(), Scratch::default());
    match query {
        Query::Closest => engine.intersect(world, rays, &mut Hits::new(0), &mut scratch, Some(&mut counters)),
        Query::Any => engine.occluded(world, rays, &mut Vec::new(), &mut scratch, Some(&mut counters)),
    }
    counters
}

/// Of all packets of `lanes` rays, where their rays part (those that do), and how many have two or more live rays.
fn divergence<S: Engines>(world: &World<S>, batches: &[Rays<S>], lanes: usize) -> Result<(Vec<u32>, usize)> {
    if lanes < 2 {
        return Ok((Vec::new(), 0));
    }
    let scalar = engine::<S>("scalar")?;
    let of_batch = |rays: &Rays<S>| {
        let mut hits = Hits::new(0);
        scalar.intersect(world, rays, &mut hits, &mut Scratch::default(), None);
        let ends: Vec<S> = (0..rays.len()).map(|i| if hits.is_hit(i) { hits.t[i] } else { rays.t_max[i] }).collect();
        let firsts = (0..rays.len()).step_by(lanes);
        let live = |first: usize| (first..rays.len().min(first + lanes)).filter(|&i| rays.is_live(i)).count();
        let many = firsts.clone().filter(|&first| live(first) > 1).count();
        let depth = |first| divergence::depth(world, rays, &ends, first, lanes);
        (firsts.filter_map(depth).collect::<Vec<_>>(), many)
    };
    let found: Vec<_> = batches.par_iter().map(of_batch).collect();
    let many = found.iter().map(|(_, many)| many).sum();
    Ok((found.into_iter().flat_map(|(depths, _)| depths).collect(), many))
}

/// Bytes of the nodes visited.
fn bytes_of_nodes<S: Engines>(counters: &Counters) -> f64 {
    let wide = counters.wide_nodes as f64;
    (counters.nodes as f64 - wide) * size_of::<Node<S>>() as f64 + wide * size_of::<Node<S, WIDE>>() as f64
}

/// Bytes of a leaf block on average.
fn bytes_of_leaf<S: Engines>(world: &World<S>) -> f64 {
    let stats = world.stats();
    stats.prim_bytes as f64 / stats.leaves.max(1) as f64
}

/// Seconds for all batches at their fastest, and the fit of the batches' times to their counts.
fn clock<S: Engines>(
    engine: &dyn Engine<S>,
    world: &World<S>,
    batches: &[Rays<S>],
    query: Query,
    stop: &dyn Fn() -> bool,
) -> Result<(f64, Option<Shares>)> {
    let (mut hits, mut flags, mut scratch) = (Hits::new(0), Vec::new(), Scratch::default());
    let mut fastest = vec![f64::INFINITY; batches.len()];
    for _ in 0..REPEATS {
        if stop() {
            return Err(Error::Interrupted);
        }
        for (rays, fastest) in batches.iter().zip(&mut fastest) {
            let start = Instant::now();
            match query {
                Query::Closest => engine.intersect(world, rays, &mut hits, &mut scratch, None),
                Query::Any => engine.occluded(world, rays, &mut flags, &mut scratch, None),
            }
            *fastest = fastest.min(start.elapsed().as_secs_f64());
        }
    }
    let whole: Vec<Counters> = batches.iter().map(|rays| count(engine, world, rays, query)).collect();
    let seconds = fastest.iter().zip(&whole).filter(|(_, c)| c.rays > 0).map(|(s, _)| s).sum();
    Ok((seconds, share::fit(&fastest, &whole)))
}

fn maps(counted: &[Vec<Counters>], lanes: usize, (width, height): (u32, u32)) -> Result<Maps> {
    let tiling = Tiling::new(width, height, FILE_TILE)?;
    let pixels = width as usize * height as usize;
    let (mut nodes, mut prims) = (vec![0.0; pixels], vec![0.0; pixels]);
    let per_batch = u64::from(tiling.rays_per_tile());
    for (batch, packets) in counted.iter().enumerate() {
        for (packet, c) in packets.iter().enumerate() {
            let rays = c.rays.max(1) as f32;
            for lane in 0..lanes as u64 {
                let slot = packet as u64 * lanes as u64 + lane;
                let index = batch as u64 * per_batch + slot;
                let Some((x, y)) = tiling.pixel(index).filter(|_| slot < per_batch) else { continue };
                let at = y as usize * width as usize + x as usize;
                nodes[at] = c.nodes as f32 / rays;
                prims[at] = c.prims as f32 / rays;
            }
        }
    }
    Ok(Maps { size: (width, height), nodes, prims })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::eye::{Eye, View};
    use crate::scene::description::{Description, Projection};
    use crate::scene::load::{LoadOptions, load};
    use crate::scene::world::Preset;

    const COSTS: Costs = Costs { lanes: 16, ns_box: 1.0, ns_triangle: 2.0, ns_linear: 0.5 };

    fn cornell() -> (World<f32>, Vec<Rays<f32>>, Description) {
        let scene = load("builtin:cornell", &LoadOptions::default()).unwrap();
        let world = World::<f32>::compile(&scene, Preset::Fast).unwrap();
        let framing = |_, size| Eye::new(&scene.cameras[0], size);
        let view = View::new(&world, &scene, &framing, (64, 40), 1).unwrap();
        let rays = view.rays(&world, RayKind::Primary).unwrap();
        (world, rays, scene)
    }

    /// What is counted packet by packet adds up to what one pass over everything counts; maps hold the same sum.
    #[test]
    fn packets_add_up_to_the_whole() {
        let (world, batches, scene) = cornell();
        assert!(matches!(scene.cameras[0].projection, Projection::Perspective { .. }), "a camera with one origin");
        for name in ["scalar", "packet16"] {
            let engine = engine::<f32>(name).unwrap();
            let work = work(engine, &world, &batches, RayKind::Primary, (64, 40), &COSTS, &|| false).unwrap();
            let mut whole = Counters::default();
            batches.iter().for_each(|rays| whole += count(engine, &world, rays, Query::Closest));
            assert_eq!((work.rays, work.packets), (whole.rays, 2560 / work.lanes as u64), "{name}");
            let sum = work.per_packet.nodes.mean * work.packets as f64;
            assert!((sum - whole.nodes as f64).abs() < 1e-6 * sum, "{name}: {sum} {}", whole.nodes);
            let maps = work.maps.unwrap();
            let mapped: f64 = maps.nodes.iter().map(|&x| f64::from(x)).sum();
            assert!((mapped - whole.nodes as f64).abs() < 1e-3 * mapped, "{name}: {mapped} {}", whole.nodes);
            assert!(work.mrays_per_s > 0.0 && work.per_packet.node_lanes.max <= 100.0);
            // Every node visit tests eight boxes against bounds, every box that is met is tested against all lanes.
            let lanes = if name == "scalar" { 0 } else { work.lanes as u64 * whole.boxes };
            assert_eq!(whole.box_lanes, 8 * whole.nodes + lanes, "{name}");
            // Places of a node may be empty.
            let boxes = whole.nodes..=8 * whole.nodes;
            assert!(boxes.contains(&whole.node_boxes) && whole.boxes <= whole.node_boxes, "{name}: {whole:?}");
            assert_eq!(work.boxes_passed, whole.boxes as f64 / whole.node_boxes as f64);
            let share = 100.0 * whole.prim_lanes_active as f64 / whole.prim_lanes_total as f64;
            assert_eq!(work.prim_lanes, share, "{name}");
            assert_eq!(work.together.is_some(), work.lanes > 1, "single rays have nobody to part from");
            let limit = work.limit.unwrap();
            let tests = whole.box_lanes as f64 + 2.0 * whole.prim_lanes_total as f64;
            assert!((limit.ns_per_ray * whole.rays as f64 - tests).abs() < 1e-9 * tests, "{name}: {limit:?}");
        }
    }

    /// Packets that meet no leaf have no lanes in primitives: of single rays all lanes that are paid for are wanted.
    #[test]
    fn packets_without_a_test_have_no_share_of_lanes() {
        let (world, batches, _) = cornell();
        let some = batches[0].len();
        let mut rays = Rays::new(some + 1);
        (0..some).for_each(|i| rays.set(i, batches[0].org(i), batches[0].dir(i), 0.0, f32::INFINITY));
        rays.set(some, [1e6; 3], [1.0; 3], 0.0, f32::INFINITY);
        let scalar = engine::<f32>("scalar").unwrap();
        let work = work(scalar, &world, &[rays], RayKind::Scatter, (some as u32 + 1, 1), &COSTS, &|| false).unwrap();
        let Spread { mean, p10, .. } = work.per_packet.prim_lanes;
        assert_eq!((mean, p10, work.prim_lanes, work.packets), (100.0, 100.0, 100.0, some as u64 + 1));
    }

    #[test]
    fn wider_packets_visit_fewer_nodes_per_ray() {
        let (world, batches, _) = cornell();
        let nodes = |name| {
            let engine = engine::<f32>(name).unwrap();
            work(engine, &world, &batches, RayKind::Primary, (64, 40), &COSTS, &|| false).unwrap().nodes_per_ray
        };
        assert!(nodes("packet16") < 0.3 * nodes("scalar"));
        let stopped =
            work(engine::<f32>("scalar").unwrap(), &world, &batches, RayKind::Primary, (64, 40), &COSTS, &|| true);
        assert!(matches!(stopped, Err(Error::Interrupted)));
    }
}
