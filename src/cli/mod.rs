//! The command line: arguments, commands, progress, exit codes.

pub mod common;
pub mod output;

mod bench;
mod compare;
mod convert;
mod explain;
mod info;
mod interrupt;
mod isa;
mod live;
mod picture;
mod preview;
mod rays;
mod render;
mod report;
mod trace;
mod verify;
mod view;

use std::process::ExitCode;
use std::sync::OnceLock;

use clap::{Parser, Subcommand};

use crate::error::Result;
use crate::lanes::compiled_isa;
use crate::measure::env::{PROFILE, REVISION, RUSTC};

/// Exit code for bad usage or input, and for a CPU that cannot run the binary.
const BAD_USAGE: u8 = 2;

const EXAMPLES: &str = "\
Examples:
  lanecast render builtin:sphere-flake -o flake.png    what it looks like
  lanecast info builtin:sphere-flake                   what is in a scene
  lanecast bench                                       how fast, on small built-in scenes
  lanecast bench model.ply --rays primary,shadow       how fast, on a model of yours
  lanecast verify builtin:sphere-flake                 do all engines agree with the f64 oracle
  lanecast compare a.exr b.exr -o heat.png             how far are two pictures apart, and where
  lanecast explain model.ply --engine scalar,packet16  why one engine beats another
  lanecast report out -o report.html                   results as one page to show to others
  lanecast convert builtin:bolt --solid bolt -o b.stl  solids as a closed mesh, or as voxels
  lanecast rays model.ply --kind ao -o ao.npy          rays for this and other programs
  lanecast trace model.ply --rays ao.npy --query any   trace a file of rays

A SCENE is a file (.kdl .gltf .glb .asc .g .csg .obj .ply .stl) or builtin:NAME.
Exit codes: 0 success, 1 a comparison fails, 2 bad usage or input, 130 Ctrl-C.";

/// Traces rays in SIMD lanes: how fast, how right, and what it looks like
#[derive(Parser)]
#[command(name = "lanecast", version = version(), after_help = EXAMPLES, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a picture: EXR, PNG or NPY
    Render(render::RenderArgs),
    /// Walk around in a scene; it is opened anew when its files change
    View(live::ViewArgs),
    /// Measure engines on ray classes: million rays per second, checked before timed
    Bench(bench::BenchArgs),
    /// Trace a file of rays and time it
    Trace(trace::TraceArgs),
    /// Write a file of rays of one class
    Rays(rays::RaysArgs),
    /// Why one engine beats another: distributions of work, cost maps, tree quality
    Explain(explain::ExplainArgs),
    /// A folder of results as one page with plots, tables and pictures
    Report(report::ReportArgs),
    /// Compare two pictures, or two files of hits: errors, what a person sees, classes, heat maps
    Compare(compare::CompareArgs),
    /// Solids as a closed triangle mesh (STL, OBJ, PLY) or as voxels (NPY)
    Convert(convert::ConvertArgs),
    /// Compare every engine with the f64 oracle, and bit for bit with each other
    Verify(verify::VerifyArgs),
    /// Counts, bounds, memory, tree quality and warnings of a scene
    Info(info::InfoArgs),
}

/// Entry point of the binary.
pub fn main() -> ExitCode {
    if let Some(line) = isa::missing() {
        output::to_stderr(&format!("error: {line}"));
        return ExitCode::from(BAD_USAGE);
    }
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help piped into a reader that has gone away is no failure.
            let _closed = error.print();
            return ExitCode::from(if error.use_stderr() { BAD_USAGE } else { 0 });
        }
    };
    interrupt::install();
    match run(&cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::to_stderr(&format!("error: {error}"));
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(command: &Command) -> Result<()> {
    let output = match command {
        Command::Render(args) => &args.output,
        Command::View(args) => &args.output,
        Command::Bench(args) => &args.output,
        Command::Trace(args) => &args.output,
        Command::Rays(args) => &args.output,
        Command::Compare(args) => &args.output,
        Command::Explain(args) => &args.output,
        Command::Report(args) => &args.output,
        Command::Convert(args) => &args.output,
        Command::Verify(args) => &args.output,
        Command::Info(args) => &args.output,
    };
    if let Some(hint) = isa::hint() {
        output.detail(&hint);
    }
    match command {
        Command::Render(args) => render::run(args),
        Command::View(args) => live::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Trace(args) => trace::run(args),
        Command::Rays(args) => rays::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Explain(args) => explain::run(args),
        Command::Report(args) => report::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Info(args) => info::run(args),
    }
}

/// Version, revision and instruction set: what a figure needs to be repeated.
fn version() -> &'static str {
    static TEXT: OnceLock<String> = OnceLock::new();
    TEXT.get_or_init(|| {
        let (version, isa) = (env!("CARGO_PKG_VERSION"), compiled_isa());
        format!("{version} (revision {REVISION}, isa {isa}, {PROFILE}, {RUSTC})")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn the_version_says_what_was_built() {
        assert!(version().contains(REVISION) && version().contains(compiled_isa()), "{}", version());
    }

    /// Every command teaches by example.
    #[test]
    fn every_command_has_examples() {
        for command in Cli::command().get_subcommands() {
            let text = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(text.contains(&format!("lanecast {}", command.get_name())), "{}", command.get_name());
        }
    }
}
