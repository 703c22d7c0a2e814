//! `lanecast info`: counts, bounds, memory, tree quality, degenerates, warnings.

use std::fmt::Write as _;

use super::common::{OutputArgs, SceneArgs, ThreadArgs, with_pool};
use super::output::{json_to_stdout, to_stdout};
use crate::error::Result;
use crate::scene::description::{Description, Precision};
use crate::scene::world::World;
use crate::trace::Engines;

const EXAMPLES: &str = "\
Examples:
  lanecast info builtin:sphere-flake
  lanecast info model.ply --preset best --json
  lanecast info scene.kdl --set depth=5";

/// Arguments of `lanecast info`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct InfoArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    pub(super) output: OutputArgs,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    scene: &'a str,
    name: &'a str,
    hash: &'a str,
    precision: &'static str,
    counts: Counts,
    bounds: Option<Bounds>,
    bytes: Bytes,
    tree: Tree,
    build_seconds: f64,
    cameras: Vec<&'a str>,
    warnings: &'a [String],
}

#[derive(serde::Serialize)]
struct Counts {
    objects: u64,
    instances: u64,
    joined: u64,
    primitives: u64,
    instanced_primitives: u64,
    dropped_nonfinite: u64,
    dropped_degenerate: u64,
    dropped_singular: u64,
    materials: usize,
    emissive_materials: usize,
    lights: usize,
    environment: bool,
    textures: usize,
    texture_bytes: u64,
    meshes: usize,
    meshes_with_normals: usize,
    meshes_with_coordinates: usize,
}

#[derive(serde::Serialize)]
struct Bounds {
    lower: [f64; 3],
    upper: [f64; 3],
    diagonal: f64,
}

#[derive(serde::Serialize)]
struct Bytes {
    nodes: u64,
    primitives: u64,
    total: u64,
    per_primitive: f64,
}

#[derive(serde::Serialize)]
struct Tree {
    nodes: u64,
    leaves: u64,
    depth: u32,
    sah_cost: f64,
}

/// Runs `lanecast info`.
///
/// # Errors
/// Bad input.
pub fn run(args: &InfoArgs) -> Result<()> {
    let description = args.scene.load(&args.output)?;
    with_pool(args.threads.count(), || match args.scene.options.precision(&description) {
        Precision::F32 => info::<f32>(args, &description),
        Precision::F64 => info::<f64>(args, &description),
    })
}

fn info<S: Engines>(args: &InfoArgs, description: &Description) -> Result<()> {
    let world = World::<S>::compile(description, args.scene.options.build())?;
    let report = report(&args.scene.scene, description, &world);
    if args.output.json {
        return json_to_stdout(&report);
    }
    to_stdout(&text(&report))
}

fn report<'a, S: Engines>(scene: &'a str, description: &'a Description, world: &World<S>) -> Report<'a> {
    let stats = world.stats();
    let total = stats.node_bytes + stats.prim_bytes;
    let meshes = &description.meshes;
    let textures = description.textures.iter().chain(description.environment.as_ref().map(|e| &e.texture));
    Report {
        scene,
        name: &description.name,
        hash: &description.hash,
        precision: S::PRECISION,
        counts: Counts {
            objects: stats.objects,
            instances: stats.instances,
            joined: stats.joined,
            primitives: stats.prims,
            instanced_primitives: stats.instanced_prims,
            dropped_nonfinite: stats.dropped_nonfinite,
            dropped_degenerate: stats.dropped_degenerate,
            dropped_singular: stats.dropped_singular,
            materials: description.materials.len(),
            emissive_materials: description.materials.iter().filter(|m| m.emission.max_element() > 0.0).count(),
            lights: description.lights.len(),
            environment: description.environment.is_some(),
            textures: textures.clone().count(),
            texture_bytes: textures.map(|t| t.bytes()).sum(),
            meshes: meshes.len(),
            meshes_with_normals: meshes.iter().filter(|m| !m.normals.values.is_empty()).count(),
            meshes_with_coordinates: meshes.iter().filter(|m| m.uvs.iter().any(|uv| !uv.values.is_empty())).count(),
        },
        bounds: world.bounds().map(|(lo, hi)| Bounds {
            lower: lo.to_array(),
            upper: hi.to_array(),
            diagonal: (hi - lo).length(),
        }),
        bytes: Bytes {
            nodes: stats.node_bytes,
            primitives: stats.prim_bytes,
            total,
            per_primitive: total as f64 / stats.prims.max(1) as f64,
        },
        tree: Tree { nodes: stats.nodes, leaves: stats.leaves, depth: stats.depth, sah_cost: stats.sah_cost },
        build_seconds: stats.build_seconds,
        cameras: description.cameras.iter().map(|c| c.name.as_str()).collect(),
        warnings: &description.warnings,
    }
}

fn text(report: &Report<'_>) -> String {
    let (counts, bytes, tree) = (&report.counts, &report.bytes, &report.tree);
    let mib = |bytes: u64| format!("{:.2} MiB", bytes as f64 / f64::from(1 << 20));
    let point = |p: [f64; 3]| format!("{:.6} {:.6} {:.6}", p[0], p[1], p[2]);
    let mut lines = vec![
        ("scene", format!("{} ({})", report.scene, report.name)),
        ("hash", report.hash.into()),
        ("precision", report.precision.into()),
        ("objects", {
            let joined =
                if counts.joined > 0 { format!(", {} traced as one mesh", counts.joined) } else { String::new() };
            format!("{}, placed {} times{joined}", counts.objects, counts.instances)
        }),
        ("primitives", format!("{}, {} counting every instance", counts.primitives, counts.instanced_primitives)),
        ("dropped", {
            let of_triangles =
                format!("{} not finite, {} without area", counts.dropped_nonfinite, counts.dropped_degenerate);
            match counts.dropped_singular {
                0 => of_triangles,
                // Their maps have no inverse, or overflow.
                shapes => format!("{of_triangles}, {shapes} shapes too thin or too large for {}", report.precision),
            }
        }),
        ("materials", format!("{}, {} of them emit light", counts.materials, counts.emissive_materials)),
        ("lights", format!("{}{}", counts.lights, if counts.environment { " and an environment" } else { "" })),
        ("textures", format!("{}, {}", counts.textures, mib(counts.texture_bytes))),
        ("meshes", {
            let (normals, coordinates) = (counts.meshes_with_normals, counts.meshes_with_coordinates);
            format!("{}, {normals} with shading normals, {coordinates} with texture coordinates", counts.meshes)
        }),
        ("cameras", if report.cameras.is_empty() { "none".into() } else { report.cameras.join(", ") }),
    ];
    match &report.bounds {
        Some(bounds) => lines.extend([
            ("lower corner", point(bounds.lower)),
            ("upper corner", point(bounds.upper)),
            ("diagonal", format!("{:.6}", bounds.diagonal)),
        ]),
        None => lines.push(("bounds", "none".into())),
    }
    lines.extend([
        ("tree", format!("{} nodes, {} leaves, depth {}", tree.nodes, tree.leaves, tree.depth)),
        ("SAH cost", format!("{:.2} (node 1, leaf ceil(n/8), largest object)", tree.sah_cost)),
        ("memory", format!("{} nodes, {} primitives", mib(bytes.nodes), mib(bytes.primitives))),
        ("per primitive", format!("{:.1} bytes", bytes.per_primitive)),
        ("build", format!("{:.3} s", report.build_seconds)),
    ]);
    let mut text = String::new();
    for (name, value) in lines {
        // Writing to a String cannot fail.
        let _infallible = writeln!(text, "{name:<14} {value}");
    }
    text
}
