//! Embree 4, loaded at run time, in every mode: packets of 1, 4, 8 and 16, with and without the coherent flag.
//!
//! Build quality HIGH, scene flags none (`embree`) or ROBUST (`embree-robust`), one triangle geometry over a shared
//! vertex buffer of 16-byte stride; objects that are placed several times are scenes of their own under instances. Rays
//! are packed before the clock starts; t, u, v, primitive and instance are copied out after each call, under the clock.
//!
//! Source: I. Wald, S. Woop, C. Benthin, G. Johnson, M. Ernst, "Embree: A Kernel Framework for Efficient CPU Ray
//! Tracing", TOG 33(4), 2014, and the manual of Embree 4.
#![allow(unsafe_code, reason = "calls a C library; each call says why it is sound")]

mod api;
mod layout;
mod probe;
mod session;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::triangles::PlacedTriangles;
use super::{Facts, Packed, Peer, rename};
use crate::lanes::compiled_isa;
use crate::measure::raysets::Query;
use crate::ray::{Hits, INVALID_ID, Rays};
use api::Arguments;
use layout::{INST, PRIM, Packets, RAY_ROWS, T_FAR, U, V, row};
use session::Session;

/// Environment variable that names the library.
pub const VARIABLE: &str = "LANECAST_EMBREE";

/// Names that are looked for on the system's library path. Embree 3 is looked for to say that it is too old.
const USUAL: [&str; 8] = [
    "libembree4.so.4",
    "libembree4.so",
    "libembree4.4.dylib",
    "libembree4.dylib",
    "embree4.dll",
    "libembree3.so.3",
    "libembree3.so",
    "libembree3.dylib",
];

/// Width, coherent flag, name.
const MODES: [(usize, bool, &str); 8] = [
    (1, true, "1 coherent"),
    (1, false, "1 incoherent"),
    (4, true, "4 coherent"),
    (4, false, "4 incoherent"),
    (8, true, "8 coherent"),
    (8, false, "8 incoherent"),
    (16, true, "16 coherent"),
    (16, false, "16 incoherent"),
];

/// Libraries to try in turn: `path` alone if there is one, else the one that [`VARIABLE`] names, else the usual names.
pub fn candidates(path: Option<&Path>) -> Vec<PathBuf> {
    let named = path.map(PathBuf::from).or_else(|| std::env::var_os(VARIABLE).map(PathBuf::from));
    named.map_or_else(|| USUAL.map(PathBuf::from).into(), |path| vec![path])
}

/// Builds Embree's scene and gives it in all eight modes.
///
/// # Errors
/// Why there is no usable Embree.
pub fn open(
    path: Option<&Path>,
    triangles: Arc<PlacedTriangles>,
    threads: usize,
    robust: bool,
) -> Result<Vec<Box<dyn Peer<f32>>>, String> {
    let mut reasons = Vec::new();
    for candidate in candidates(path) {
        match Session::open(&candidate, triangles.clone(), threads, robust) {
            Ok(session) => return Ok(modes(session, &triangles, robust)),
            Err(why) => reasons.push(format!("{}: {why}", candidate.display())),
        }
    }
    // Of many names that are not there, one reason is enough; one that is there and does not fit says so.
    let telling = reasons.iter().find(|r| r.contains("it is Embree")).or(reasons.first()).cloned().unwrap_or_default();
    Err(format!("no Embree 4 (give --embree PATH or set {VARIABLE}): {telling}"))
}

/// What keeps Embree's kernels from being wider than those of this build: in words, and for its device. Nothing, if ours
/// are as wide as it knows.
fn widest() -> (&'static str, &'static str) {
    match compiled_isa() {
        "avx2" => (", max_isa avx2", ",max_isa=avx2"),
        "avx" => (", max_isa avx", ",max_isa=avx"),
        "sse2" => (", max_isa sse4.2", ",max_isa=sse4.2"),
        _ => ("", ""),
    }
}

fn modes(session: Session, triangles: &Arc<PlacedTriangles>, robust: bool) -> Vec<Box<dyn Peer<f32>>> {
    let [major, minor, patch] = session.version;
    let flags = if robust { "ROBUST" } else { "none" };
    let more = if session.hit_rows > layout::HIT_ROWS + 1 { ", instPrimID in hits" } else { "" };
    let mut description = format!("Embree {major}.{minor}.{patch}, quality HIGH, scene flags {flags}{more}");
    description += widest().0;
    if !triangles.instances.is_empty() {
        let (instances, objects) = (triangles.instances.len(), triangles.objects.len());
        description += &format!(", {instances} instances of {objects} objects");
    }
    let session = Arc::new(session);
    let one = |(width, coherent, mode)| {
        let facts = Facts {
            name: if robust { "embree-robust" } else { "embree" },
            mode,
            description: description.clone(),
            build_seconds: session.build_seconds,
            bytes: session.bytes(),
        };
        let mode = Mode { session: session.clone(), triangles: triangles.clone(), facts, width, coherent };
        Box::new(mode) as Box<dyn Peer<f32>>
    };
    MODES.into_iter().map(one).collect()
}

struct Mode {
    session: Arc<Session>,
    triangles: Arc<PlacedTriangles>,
    facts: Facts,
    width: usize,
    coherent: bool,
}

impl Peer<f32> for Mode {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn pack<'a>(&'a self, rays: &Rays<f32>, query: Query) -> Box<dyn Packed<f32> + 'a> {
        match self.width {
            1 => Box::new(Batch::<1>::new(self, rays, query)),
            4 => Box::new(Batch::<4>::new(self, rays, query)),
            8 => Box::new(Batch::<8>::new(self, rays, query)),
            _ => Box::new(Batch::<16>::new(self, rays, query)),
        }
    }

    fn rename(&self, hits: &mut Hits<f32>) {
        let PlacedTriangles { world, objects, instances } = &*self.triangles;
        rename(hits, |prim, inst| match instances.get(inst as usize) {
            None => world.ids.get(prim as usize).copied(),
            Some(placed) => {
                let [prim, _] = *objects[placed.object as usize].ids.get(prim as usize)?;
                Some([prim, placed.inst])
            }
        });
    }
}

/// A batch as packets of `N`. A call uses them up: Embree writes hits where the ends of the segments were.
struct Batch<'a, const N: usize> {
    session: &'a Session,
    coherent: bool,
    rays: Packets<N>,
    valid: Packets<N>,
    /// Packets with a live ray; the others are not traced.
    live: Vec<bool>,
    len: usize,
}

impl<'a, const N: usize> Batch<'a, N> {
    fn new(mode: &'a Mode, rays: &Rays<f32>, query: Query) -> Self {
        let count = rays.len().div_ceil(N);
        let rows = if query == Query::Any { RAY_ROWS } else { mode.session.hit_rows };
        let mut batch = Self {
            session: &mode.session,
            coherent: mode.coherent,
            rays: Packets::new(count, rows),
            valid: Packets::new(count, 1),
            live: Vec::with_capacity(count),
            len: rays.len(),
        };
        for k in 0..count {
            let live = layout::fill::<N>(batch.rays.get_mut(k), batch.valid.get_mut(k), rays, k * N);
            batch.live.push(live);
        }
        batch
    }

    /// Traces every live packet and hands it to `take` with the number of its first ray.
    #[inline(always)]
    fn trace<const ANY: bool>(&mut self, mut take: impl FnMut(&[u32], usize)) {
        let mut arguments = Arguments::new(self.coherent);
        for k in (0..self.live.len()).filter(|&k| self.live[k]) {
            let packet = self.rays.get_mut(k);
            self.session.query::<N, ANY>(self.valid.get(k), packet, &mut arguments);
            take(packet, k * N);
        }
    }
}

impl<const N: usize> Packed<f32> for Batch<'_, N> {
    fn intersect(&mut self, hits: &mut Hits<f32>) {
        hits.reset(self.len);
        self.trace::<false>(|packet, at| {
            let (t, u, v) = (row::<N>(packet, T_FAR), row::<N>(packet, U), row::<N>(packet, V));
            let (prim, inst) = (row::<N>(packet, PRIM), row::<N>(packet, INST));
            let each = at..at + N;
            // Hits are padded to a multiple of every N.
            let (to_t, to_u, to_v) = (&mut hits.t[each.clone()], &mut hits.u[each.clone()], &mut hits.v[each.clone()]);
            let (to_prim, to_inst) = (&mut hits.prim[each.clone()], &mut hits.inst[each]);
            for i in 0..N {
                let hit = prim[i] != INVALID_ID;
                to_t[i] = if hit { f32::from_bits(t[i]) } else { f32::INFINITY };
                to_u[i] = f32::from_bits(u[i]);
                to_v[i] = f32::from_bits(v[i]);
                to_prim[i] = prim[i];
                to_inst[i] = inst[i];
            }
        });
    }

    fn occluded(&mut self, out: &mut Vec<u8>) {
        out.clear();
        out.resize(self.len, 0);
        self.trace::<true>(|packet, at| {
            let t = row::<N>(packet, T_FAR);
            let last = out.len().min(at + N);
            for (out, &bits) in out[at..last].iter_mut().zip(t) {
                *out = u8::from(f32::from_bits(bits) == f32::NEG_INFINITY);
            }
        });
    }
}
