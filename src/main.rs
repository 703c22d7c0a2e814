//! The `lanecast` binary: parse, run, exit code.
fn main() -> std::process::ExitCode {
    lanecast::cli::main()
}
