//! What `lanecast render` says when it is done.

use serde::Serialize;
use serde_json::Value;

use super::RenderArgs;
use crate::cli::output::json_to_stdout;
use crate::error::{Error, Result};
use crate::lanes::compiled_isa;
use crate::render::{RenderOptions, RenderOutput};
use crate::scene::description::Description;
use crate::scene::world::WorldStats;
use crate::shade::BounceStats;

/// The object of `--json`.
#[derive(Serialize)]
pub(super) struct Report<'a> {
    scene: &'a str,
    file: String,
    size: (u32, u32),
    window: (u32, u32, u32, u32),
    planes: Vec<&'a str>,
    integrator: &'static str,
    engine: &'static str,
    precision: &'static str,
    isa: &'static str,
    threads: usize,
    spp: u32,
    samples_per_pixel: f64,
    seed: u64,
    complete: bool,
    written: bool,
    tiles: (u64, u64),
    rays: Rays,
    holds: Holds,
    build_seconds: f64,
    seconds: f64,
    mrays_per_s: f64,
    bounces: Vec<Bounce>,
}

#[derive(Serialize)]
struct Rays {
    primary: u64,
    shadow: u64,
    occlusion: u64,
    mirror: u64,
    refracted: u64,
    scattered: u64,
    total: u64,
}

/// What made a picture, and whether there are files of it.
pub(super) struct Made {
    pub engine: &'static str,
    pub precision: &'static str,
    pub build_seconds: f64,
    pub holds: Holds,
    pub written: bool,
}

/// What a scene holds in memory.
#[derive(Clone, Copy, Serialize)]
pub(super) struct Holds {
    objects: u64,
    placements: u64,
    primitives: u64,
    instanced_primitives: u64,
    world_bytes: u64,
    textures: usize,
    texture_bytes: u64,
}

impl Holds {
    pub fn new(stats: &WorldStats, description: &Description) -> Self {
        Self {
            objects: stats.objects,
            placements: stats.instances,
            primitives: stats.prims,
            instanced_primitives: stats.instanced_prims,
            world_bytes: stats.node_bytes + stats.prim_bytes,
            textures: description.textures.len(),
            texture_bytes: description.textures.iter().map(|t| t.bytes()).sum(),
        }
    }
}

/// Samples that were taken of a pixel, on average.
pub(super) fn samples_per_pixel(output: &RenderOutput) -> f64 {
    output.rays.primary as f64 / output.film.window.area().max(1) as f64
}

/// What `--json` says about a render.
pub(super) fn report<'a>(
    args: &'a RenderArgs,
    options: &RenderOptions,
    output: &'a RenderOutput,
    made: &Made,
) -> Report<'a> {
    let (film, rays) = (&output.film, output.rays);
    let samples_per_pixel = samples_per_pixel(output);
    Report {
        scene: &args.scene.scene,
        file: args.file(),
        size: (film.width, film.height),
        window: (film.window.x0, film.window.y0, film.window.x1, film.window.y1),
        planes: film.planes.iter().map(|plane| plane.name.as_str()).collect(),
        integrator: options.integrator.name(),
        engine: made.engine,
        precision: made.precision,
        isa: compiled_isa(),
        threads: rayon::current_num_threads(),
        spp: options.spp,
        samples_per_pixel,
        seed: options.seed,
        complete: output.is_complete(),
        written: made.written,
        tiles: (output.tiles_done, output.tiles_total),
        rays: Rays {
            primary: rays.primary,
            shadow: rays.shadow,
            occlusion: rays.occlusion,
            mirror: rays.mirror,
            refracted: rays.refracted,
            scattered: rays.scattered,
            total: rays.total(),
        },
        holds: made.holds,
        build_seconds: made.build_seconds,
        seconds: output.seconds,
        mrays_per_s: rays.total() as f64 / output.seconds.max(f64::MIN_POSITIVE) / 1e6,
        bounces: output.paths.bounces.iter().map(Bounce::new).collect(),
    }
}

/// What `--json` says about an animation, when it is done or stopped.
#[derive(Serialize)]
pub(super) struct Frames<'a> {
    pub scene: &'a str,
    /// Files of frames that were there already.
    pub kept: &'a [String],
    /// What was said of each of the others.
    pub frames: &'a [Value],
}

/// What was done: a few lines on stderr and one JSON object, on stdout or, of a frame, in the list of all.
pub(super) fn tell(
    args: &RenderArgs,
    report: &Report<'_>,
    output: &RenderOutput,
    frames: Option<&mut Vec<Value>>,
) -> Result<()> {
    let (file, (width, height), rays) = (&report.file, report.size, &report.rays);
    let (done, total) = report.tiles;
    let part = match (report.complete, done) {
        (true, _) => String::new(),
        (false, 0) => format!(", none of {total} tiles was finished, nothing is written"),
        (false, _) if done == total => ", stopped before the samples sufficed".into(),
        (false, _) => format!(", only {done} of {total} tiles"),
    };
    // Without a finished tile, that is said already.
    let unwritten = if report.written || done == 0 { "" } else { ", not written" };
    args.output.say(&format!(
        "{file}: {width}x{height}{part}{unwritten}, {} rays in {:.3} s with {} ({:.1} Mrays/s, shading included)",
        rays.total, report.seconds, report.engine, report.mrays_per_s
    ));
    let (h, mib) = (&report.holds, |bytes: u64| bytes as f64 / f64::from(1 << 20));
    args.output.say(&format!(
        "the scene holds {} objects placed {} times, {} primitives ({} counting every instance) in {:.1} MiB, {} \
         textures in {:.1} MiB",
        h.objects,
        h.placements,
        h.primitives,
        h.instanced_primitives,
        mib(h.world_bytes),
        h.textures,
        mib(h.texture_bytes)
    ));
    args.output.detail(&format!(
        "rays: {} primary, {} shadow, {} occlusion, {} mirror, {} refracted, {} scattered; build {:.3} s",
        rays.primary, rays.shadow, rays.occlusion, rays.mirror, rays.refracted, rays.scattered, report.build_seconds
    ));
    let c = &output.counters;
    args.output.detail(&format!(
        "visits: {} nodes, {} leaves, {} primitive tests (counting kernels)",
        c.nodes, c.leaves, c.prims
    ));
    if args.stats {
        bounces(report).iter().for_each(|line| args.output.say(line));
    }
    match frames {
        _ if !args.output.json => {}
        None => json_to_stdout(report)?,
        Some(all) => all.push(serde_json::to_value(report).map_err(|e| Error::io("stdout", e.into()))?),
    }
    Ok(())
}

/// One bounce of the paths; times are sums over threads.
#[derive(Serialize)]
struct Bounce {
    rays: u64,
    shadow_rays: u64,
    lane_use: Option<f64>,
    trace_seconds: f64,
    shadow_seconds: f64,
    shade_seconds: f64,
}

impl Bounce {
    fn new(stats: &BounceStats) -> Self {
        Self {
            rays: stats.rays,
            shadow_rays: stats.shadows,
            lane_use: (stats.lanes > 0).then(|| stats.points as f64 / stats.lanes as f64),
            trace_seconds: stats.tracing.as_secs_f64(),
            shadow_seconds: stats.shadowing.as_secs_f64(),
            shade_seconds: stats.shading.as_secs_f64(),
        }
    }
}

/// The table of `--stats`: rays by depth (bounce of a path, level of recursion), lanes in use while shading, and where the time goes.
fn bounces(report: &Report<'_>) -> Vec<String> {
    let all = &report.bounces;
    let sum = |get: fn(&Bounce) -> f64| all.iter().map(get).sum::<f64>();
    let tracing = sum(|b| b.trace_seconds) + sum(|b| b.shadow_seconds);
    let shading = sum(|b| b.shade_seconds);
    let total = (tracing + shading).max(f64::MIN_POSITIVE);
    let share = |x: f64| 100.0 * x / total;
    let mut lines = vec!["bounce        rays      shadow  lane use  closest %  shadow %  shading %".into()];
    lines.extend(all.iter().enumerate().map(|(i, b)| {
        format!(
            "{i:>6} {:>11} {:>11} {:>9} {:>9.1} {:>9.1} {:>10.1}",
            b.rays,
            b.shadow_rays,
            b.lane_use.map_or("-".into(), |share| format!("{:.1}%", 100.0 * share)),
            share(b.trace_seconds),
            share(b.shadow_seconds),
            share(b.shade_seconds)
        )
    }));
    lines.push(format!(
        "intersection {:.1} %, shading and the rest {:.1} % of {total:.3} s over all threads",
        share(tracing),
        share(shading)
    ));
    lines
}
