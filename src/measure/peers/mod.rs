//! Peers: other ray tracers on the same triangles, the same rays and the same threads as our engines.
//!
//! A peer gets every advantage its authors ask for: its best tree, its own ray layout filled before the clock starts,
//! denormals flushed, and of its modes the best one is quoted. What the clock covers is the same as for an engine:
//! traversal of packed rays and the writing of t, u, v and primitive. A peer's own primitive numbers become ours after
//! the clock has stopped, so that no look-up of ours is counted against it.

#[cfg(feature = "peers")]
pub mod bvh_crate;
pub mod embree;
pub mod obvhs;
#[cfg(feature = "peers")]
pub mod parry;
#[cfg(feature = "peers")]
mod singles;
pub mod triangles;

use std::any::Any;
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::{Error, Result, nearest_name};
use crate::lanes::Real;
use crate::measure::raysets::Query;
use crate::measure::timing::Workers;
use crate::ray::{Hits, Rays};
use crate::scene::world::World;
use triangles::{PlacedTriangles, Triangles};

/// What `--peers` takes.
pub const NAMES: [&str; 6] = ["obvhs", "embree", "embree-robust", "bvh", "parry", TINYBVH];

/// A peer that no build has: its rows say so.
pub const TINYBVH: &str = "tinybvh";

/// Why there is none of it.
const NO_TINYBVH: &str =
    "not in any build: a C++ header, of which there is neither a packaged library to load nor a crate to build in";

/// What a row says about a peer.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Its family: rows with one name and different modes are one peer, and the best of them is quoted.
    pub name: &'static str,
    /// How it is called, empty if there is one way only.
    pub mode: &'static str,
    /// Version, tree and settings, in words.
    pub description: String,
    /// Wall-clock seconds of building its tree from triangles in memory.
    pub build_seconds: f64,
    /// Bytes of its tree and triangles after the build.
    pub bytes: u64,
}

/// Another tracer in one mode, with its scene built.
pub trait Peer<S>: Send + Sync {
    /// What it is.
    fn facts(&self) -> &Facts;
    /// The rays of one batch in the peer's own layout, ready for `query`; not under the clock.
    fn pack<'a>(&'a self, rays: &Rays<S>, query: Query) -> Box<dyn Packed<S> + 'a>;
    /// Turns the peer's own numbers of hits into our primitive and instance numbers; not under the clock.
    fn rename(&self, hits: &mut Hits<S>);
}

/// One batch in a peer's own ray layout. Rays may be used up by a call, as Embree's are: one call per packing.
pub trait Packed<S>: Send {
    /// Closest hits, with the peer's own numbers in `prim` and `inst`; see [`Peer::rename`].
    fn intersect(&mut self, hits: &mut Hits<S>);
    /// 1 for each ray whose segment holds something, else 0.
    fn occluded(&mut self, out: &mut Vec<u8>);
}

/// Gives each hit the primitive and instance number that `ours` says, from the peer's own two.
fn rename<S: Real>(hits: &mut Hits<S>, ours: impl Fn(u32, u32) -> Option<[u32; 2]>) {
    for i in 0..hits.len() {
        if hits.is_hit(i)
            && let Some([prim, inst]) = ours(hits.prim[i], hits.inst[i])
        {
            (hits.prim[i], hits.inst[i]) = (prim, inst);
        }
    }
}

/// A peer that was asked for: its modes, or why there are none.
pub struct Guest<S> {
    /// Family, for the row that says what is missing.
    pub name: &'static str,
    /// One peer per mode.
    pub modes: std::result::Result<Vec<Box<dyn Peer<S>>>, String>,
}

/// Peers to invite.
#[derive(Clone, Debug, Default)]
pub struct Invitation {
    /// Names from [`NAMES`].
    pub names: Vec<String>,
    /// Embree's shared library; `None`: see [`embree::candidates`].
    pub embree: Option<PathBuf>,
}

impl Invitation {
    /// # Errors
    /// A usage error for an unknown name.
    pub fn check(&self) -> Result<()> {
        let unknown = self.names.iter().find(|name| !NAMES.contains(&name.as_str()));
        unknown.map_or(Ok(()), |name| {
            let near = nearest_name(name, NAMES).map(|n| format!(" (did you mean `{n}`?)")).unwrap_or_default();
            Err(Error::Usage(format!("no peer `{name}`{near}; there are: {}", NAMES.join(", "))))
        })
    }

    /// Builds every peer's scene from the triangles of `world` (and its instances, those that are instances to our engines too, if
    /// it knows them), with as many threads as `workers` has. To be called from a thread that is not pinned to a core: Embree's build threads inherit where they may run.
    ///
    /// # Errors
    /// Those of [`Invitation::check`]. A peer that cannot take part is no error but a [`Guest`] that says why.
    pub fn open<S: Real>(&self, world: &World<S>, workers: &Workers) -> Result<Vec<Guest<S>>> {
        self.check()?;
        if self.names.is_empty() {
            return Ok(Vec::new());
        }
        let wanted =
            |embree: bool| self.names.iter().any(|name| name != TINYBVH && name.starts_with("embree") == embree);
        let flat = if wanted(false) { Triangles::flatten(&world.assembly) } else { Ok(Triangles::default()) };
        let of_world = || PlacedTriangles::of(&world.traced, world.names.as_ref());
        let placed = if wanted(true) { of_world() } else { Ok(PlacedTriangles::default()) };
        let placed = placed.map(Arc::new);
        let with = |build: &(dyn Fn(&Triangles) -> Modes + Sync)| {
            let triangles = flat.as_ref().map_err(Clone::clone)?;
            workers.install(|| build(triangles))
        };
        let mut guests = Vec::new();
        let mut add = |name, modes: Modes| guests.push(Guest { name, modes: modes.and_then(of_precision) });
        // Twice would be two rows about the same.
        let once = (0..self.names.len()).filter(|&i| !self.names[..i].contains(&self.names[i]));
        for name in once.filter_map(|i| NAMES.into_iter().find(|known| *known == self.names[i])) {
            match name {
                "obvhs" => obvhs::NAMES.into_iter().for_each(|family| {
                    add(family, with(&|triangles| obvhs::build(family, triangles).map(|peer| vec![peer])));
                }),
                "embree" | "embree-robust" => {
                    let (library, robust) = (self.embree.as_deref(), name != "embree");
                    let open = |triangles| embree::open(library, triangles, workers.threads(), robust);
                    add(name, placed.clone().and_then(open));
                }
                TINYBVH => add(name, Err(NO_TINYBVH.into())),
                _ => add(name, with(&|triangles| of_feature(name, triangles))),
            }
        }
        Ok(guests)
    }
}

/// The modes of a peer, or why there are none.
type Modes = std::result::Result<Vec<Box<dyn Peer<f32>>>, String>;

/// A peer of the cargo feature `peers`.
#[cfg(feature = "peers")]
fn of_feature(name: &str, triangles: &Triangles) -> Modes {
    if name == bvh_crate::NAME { bvh_crate::build(triangles) } else { parry::build(triangles) }
}

#[cfg(not(feature = "peers"))]
fn of_feature(_: &str, _: &Triangles) -> Modes {
    Err("not in this build: cargo build --features peers".into())
}

/// Peers compute in f32: as peers of precision `S`, if `S` is that.
fn of_precision<S: Real>(peers: Vec<Box<dyn Peer<f32>>>) -> std::result::Result<Vec<Box<dyn Peer<S>>>, String> {
    let any: Box<dyn Any> = Box::new(peers);
    any.downcast().map(|peers| *peers).map_err(|_| "computes in f32 only (--precision f32)".into())
}

#[cfg(test)]
mod tests;
