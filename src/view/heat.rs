//! Maps of the engine's work on primary rays: one value per block of 4 x 4 pixels, which is what a packet of 16 sees.

use std::sync::Mutex;
use std::time::Instant;

use rayon::prelude::*;

use crate::camera::{Camera, PixelRect, SubPixel, Tiling, fill_tile, morton_decode};
use crate::error::{Error, Result, by_name, locked};
use crate::film::heat;
use crate::ray::{Counters, Hits, Rays};
use crate::render::{Progress, RenderOptions, RenderOutput};
use crate::scene::world::World;
use crate::shade::Shades;
use crate::trace::{Engine, Scratch};

/// Rays of a block: 16 consecutive ones in Morton order.
const BLOCK: usize = 16;

/// What a map shows. Work is on a fixed logarithmic scale, so that two pictures can be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heat {
    /// Inner nodes visited per block.
    Nodes,
    /// Primitives tested per block.
    Leaves,
    /// Share of lanes that were wanted, of those paid for in node visits and primitive tests.
    Lanes,
}

impl Heat {
    /// All maps.
    pub const ALL: [Self; 3] = [Self::Nodes, Self::Leaves, Self::Lanes];

    /// Name in scripts and the status line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nodes => "nodes",
            Self::Leaves => "leaves",
            Self::Lanes => "lanes",
        }
    }

    /// From 0 (black) to 1 (pale yellow): 1023 visits or tests in a block, or all lanes in use.
    fn value(self, counters: &Counters) -> f64 {
        let log = |count: u64| (1.0 + count as f64).log2() / 10.0;
        match self {
            Self::Nodes => log(counters.nodes),
            Self::Leaves => log(counters.prims),
            Self::Lanes => {
                let total = counters.node_lanes_total + counters.prim_lanes_total;
                (counters.node_lanes_active + counters.prim_lanes_active) as f64 / total.max(1) as f64
            }
        }
    }
}

impl std::str::FromStr for Heat {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        by_name("map", &Self::ALL, Self::name, name)
    }
}

/// The map of a picture's primary rays; tiles not finished are black.
///
/// # Errors
/// Options out of range.
pub(super) fn render<S: Shades>(
    map: Heat,
    engine: &dyn Engine<S>,
    world: &World<S>,
    camera: &Camera,
    options: &RenderOptions,
    progress: &dyn Progress,
) -> Result<RenderOutput> {
    let clock = Instant::now();
    let (tiling, window) = options.check()?;
    let rect = PixelRect { x0: window.x0, y0: window.y0, x1: window.x1, y1: window.y1 };
    let tiles = tiling.tiles_in(rect);
    let values = Mutex::new(vec![0.0; window.area() as usize]);
    let one = |memory: &mut Memory<S>, &tile: &u32| {
        if progress.stopped() {
            return Done::default();
        }
        let found = memory.tile(map, engine, world, (camera, &tiling, rect), tile);
        let (x0, y0) = tiling.origin(tile);
        let values = &mut *locked(&values);
        for (i, value) in memory.values.iter().enumerate() {
            let (dx, dy) = morton_decode(i as u32);
            if let Some(index) = window.index(x0 + dx, y0 + dy) {
                values[index] = *value;
            }
        }
        progress.tile_done(tiles.len() as u64);
        found
    };
    let done = tiles.par_iter().map_init(Memory::default, one).reduce(Done::default, Done::plus);
    let values = values.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    let film = heat::film(options.width, options.height, window, &values, 1.0)?;
    Ok(RenderOutput {
        film,
        rays: crate::shade::RayCounts { primary: done.counters.rays, ..Default::default() },
        seconds: clock.elapsed().as_secs_f64(),
        counters: done.counters,
        paths: Default::default(),
        tiles_done: done.tiles,
        tiles_total: tiles.len() as u64,
        is_cut_short: false,
    })
}

#[derive(Default)]
struct Done {
    tiles: u64,
    counters: Counters,
}

impl Done {
    fn plus(mut self, other: Self) -> Self {
        self.tiles += other.tiles;
        self.counters += other.counters;
        self
    }
}

/// One thread's arrays.
struct Memory<S> {
    rays: Rays<S>,
    block: Rays<S>,
    hits: Hits<S>,
    scratch: Scratch,
    values: Vec<f32>,
}

impl<S: Shades> Default for Memory<S> {
    fn default() -> Self {
        let (rays, block, hits) = (Rays::new(0), Rays::new(0), Hits::new(0));
        Self { rays, block, hits, scratch: Scratch::default(), values: Vec::new() }
    }
}

impl<S: Shades> Memory<S> {
    fn tile(
        &mut self,
        map: Heat,
        engine: &dyn Engine<S>,
        world: &World<S>,
        (camera, tiling, rect): (&Camera, &Tiling, PixelRect),
        tile: u32,
    ) -> Done {
        fill_tile(camera, tiling, tile, rect, SubPixel::Anchor, &mut self.rays);
        self.values.clear();
        let mut all = Counters::default();
        for first in (0..self.rays.len()).step_by(BLOCK) {
            self.block.reset(BLOCK);
            for i in 0..BLOCK {
                let j = first + i;
                let rays = &self.rays;
                self.block.set(i, rays.org(j), rays.dir(j), rays.t_min[j], rays.t_max[j]);
            }
            let mut counters = Counters::default();
            engine.intersect(world, &self.block, &mut self.hits, &mut self.scratch, Some(&mut counters));
            let value = map.value(&counters) as f32;
            self.values.extend([value; BLOCK]);
            all += counters;
        }
        Done { tiles: 1, counters: all }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_by_hand() {
        let counters = Counters {
            nodes: 31,
            prims: 1023,
            node_lanes_active: 30,
            node_lanes_total: 60,
            prim_lanes_active: 10,
            prim_lanes_total: 100,
            ..Default::default()
        };
        assert_eq!(Heat::Nodes.value(&counters), 0.5);
        assert_eq!(Heat::Leaves.value(&counters), 1.0);
        assert_eq!(Heat::Lanes.value(&counters), 0.25);
        assert_eq!(Heat::Lanes.value(&Counters::default()), 0.0);
        assert!("node".parse::<Heat>().unwrap_err().to_string().contains("did you mean `nodes`?"));
    }
}
