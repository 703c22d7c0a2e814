//! lanecast traces rays in SIMD lanes: coherent tiles of rays, packets of 4, 8 or 16 lanes, a flattened 8- and 16-wide BVH
//! over structure-of-arrays primitives, HDR output, and a measuring bench that checks every hit before it is timed.
//!
//! # Building with it
//! Widths are chosen when the crate is compiled, not when it runs: what the target's features allow is what the kernels use. The
//! `.cargo/config.toml` of this repository asks for the machine's own (`target-cpu=native`), but cargo reads it for builds inside of
//! the repository only, not for crates that depend on this one. Without such a line of their own they get the baseline of x86-64, SSE2:
//! the same answers within rounding, but slower. Put into your crate's `.cargo/config.toml`:
//!
//! ```toml
//! [build]
//! rustflags = ["-C", "target-cpu=native"]
//! ```
//!
//! or name a CPU that all machines have, such as `x86-64-v3`. [`lanes::compiled_isa`] says what a build uses. Trees and kernels also
//! want optimisation: set `opt-level = 3` for this crate in profiles that you trace with.
//!
//! # The house
//! Each floor uses only those below it; `tests/layers.rs` refuses an upward edge.
//!
//! | floor | modules | what lives there |
//! |---|---|---|
//! | 8 | [`cli`] | arguments, commands, progress, exit codes |
//! | 7 | [`measure`], [`view`] | ray sets, timing, statistics, verification, reports; terminal, viewers, windows |
//! | 6 | [`render`], [`convert`], [`mod@reference`] | tile scheduler, blocks; solids as meshes; the f64 oracle (floors 0, 3, 5) |
//! | 5 | [`film`], [`shade`] | framebuffer and image files; materials, lights, integrators |
//! | 4 | [`trace`] | the engines behind one trait |
//! | 3 | [`scene`], [`camera`] | description, importers, world; cameras, tiles, ray generation |
//! | 2 | [`bvh`], [`shape`], [`csg`] | trees over boxes; primitives: storage, bounds, kernels; solids made of solids |
//! | 1 | [`ray`] | rays, hits, packets, commit, counters |
//! | 0 | [`lanes`], [`math`], [`error`] | SIMD lanes, affine maps and boxes, the error type |
//!
//! # Conventions
//! Right-handed space, scene units, radians. Directions need not be unit: `t` is parametric, the same number in
//! world and local space. Ray segments are closed: `t_min <= t <= t_max`.

pub mod bvh;
pub mod camera;
pub mod cli;
pub mod convert;
pub mod csg;
pub mod error;
pub mod film;
pub mod lanes;
pub mod math;
pub mod measure;
pub mod ray;
pub mod reference;
pub mod render;
pub mod scene;
pub mod shade;
pub mod shape;
pub mod trace;
pub mod view;
