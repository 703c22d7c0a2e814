//! What a figure was measured with: revision, compiler, instruction set, machine and its load.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::Path;

use crate::lanes::compiled_isa;
use crate::measure::explain::Ports;

/// Git revision of the build, 12 digits, with `-dirty` if files differed from it; `unknown` outside git.
pub const REVISION: &str = concat!(env!("LANECAST_REVISION"), env!("LANECAST_DIRTY"));
/// The compiler: `rustc --version`.
pub const RUSTC: &str = env!("LANECAST_RUSTC");
/// The compiler flags of the build (RUSTFLAGS and the cargo configuration).
pub const FLAGS: &str = env!("LANECAST_FLAGS");
/// Cargo's profile directory: `release` or `debug`.
pub const PROFILE: &str = env!("LANECAST_PROFILE");

/// CPU model in the vendor's words, `unknown` where nothing tells.
pub fn cpu_model() -> String {
    brand_string().unwrap_or_else(|| "unknown".into())
}

#[cfg(target_arch = "x86_64")]
fn brand_string() -> Option<String> {
    let brand = raw_cpuid::CpuId::new().get_processor_brand_string()?;
    let words: Vec<&str> = brand.as_str().split_whitespace().collect();
    (!words.is_empty()).then(|| words.join(" "))
}

#[cfg(not(target_arch = "x86_64"))]
fn brand_string() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name") || l.starts_with("Model"))?;
    line.split_once(':').map(|(_, name)| name.trim().to_string())
}

/// The load averages over 1, 5 and 15 minutes as the system writes them, or `unknown`.
pub fn load_average() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let averages: Vec<&str> = text.split_whitespace().take(3).collect();
    if averages.len() == 3 { averages.join(" ") } else { "unknown".into() }
}

/// Today's date and the time, UTC, as `2026-01-31T23:59:59Z`.
pub fn now() -> String {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    date_text(since.map_or(0, |d| d.as_secs()))
}

/// Seconds since 1970 as a calendar date. Source: H. Hinnant, "chrono-Compatible Low-Level Date Algorithms", 2013
/// (`civil_from_days`).
fn date_text(seconds: u64) -> String {
    let (days, clock) = (seconds / 86_400 + 719_468, seconds % 86_400);
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let (hour, minute, second) = (clock / 3600, clock / 60 % 60, clock % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// The command line of this process as a shell would take it, of the program no more than its name.
pub fn command_line() -> String {
    quoted(std::env::args_os())
}

/// The words of a command line, quoted where a shell needs it; the first without its folder.
pub fn quoted(words: impl Iterator<Item = OsString>) -> String {
    let words = words.enumerate().map(|(k, word)| {
        let name = Path::new(&word).file_name().filter(|_| k == 0).unwrap_or(&word);
        let word = name.to_string_lossy();
        let plain = !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || "-_./:=,+@%".contains(c));
        if plain { word.into_owned() } else { format!("'{}'", word.replace('\'', r"'\''")) }
    });
    words.collect::<Vec<_>>().join(" ")
}

/// The facts as lines `name: value`, for the file beside the rows.
pub fn facts(threads: usize, ports: &Ports) -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let from_cpuinfo = |name: &str| {
        let line = cpuinfo.lines().find(|l| l.split(':').next().is_some_and(|n| n.trim() == name));
        line.and_then(|l| l.split_once(':')).map_or("unknown", |(_, v)| v.trim()).to_string()
    };
    let read = |path: &str| std::fs::read_to_string(path).map_or("unknown".into(), |s| s.trim().to_string());
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    let lines = [
        ("command", command_line()),
        ("date", now()),
        ("revision", REVISION.into()),
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("rustc", RUSTC.into()),
        ("rustflags", FLAGS.into()),
        ("profile", PROFILE.into()),
        ("isa compiled", compiled_isa().into()),
        ("cpu", cpu_model()),
        ("cpu family", from_cpuinfo("cpu family")),
        ("cpu model number", from_cpuinfo("model")),
        ("stepping", from_cpuinfo("stepping")),
        ("microcode", from_cpuinfo("microcode")),
        ("MHz now", from_cpuinfo("cpu MHz")),
        ("cache", from_cpuinfo("cache size")),
        ("cpu flags", from_cpuinfo("flags")),
        ("ports", ports.words()),
        ("cores available", cores.to_string()),
        ("threads", threads.to_string()),
        ("governor", read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")),
        ("kernel", read("/proc/sys/kernel/osrelease")),
        ("load average", load_average()),
    ];
    let mut text = String::new();
    for (name, value) in lines {
        // Writing to a String cannot fail.
        let _infallible = writeln!(text, "{name}: {value}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dates from `date -u -d @SECONDS`, with a leap day and a century that is a leap year.
    #[test]
    fn dates_follow_the_calendar() {
        assert_eq!(date_text(0), "1970-01-01T00:00:00Z");
        assert_eq!(date_text(951_782_400), "2000-02-29T00:00:00Z");
        assert_eq!(date_text(951_868_799), "2000-02-29T23:59:59Z");
        assert_eq!(date_text(1_735_689_599), "2024-12-31T23:59:59Z");
        assert_eq!(date_text(4_107_542_400), "2100-03-01T00:00:00Z");
    }

    #[test]
    fn commands_are_quoted_and_name_no_folder_of_the_program() {
        let words = ["../bin/lanecast", "bench", "a b", "it's", "", "../scenes/x.ply"];
        let line = quoted(words.iter().map(OsString::from));
        assert_eq!(line, r"lanecast bench 'a b' 'it'\''s' '' ../scenes/x.ply");
    }

    #[test]
    fn facts_name_the_build() {
        let ports = Ports::measure();
        let text = facts(3, &ports);
        assert!(text.contains(&format!("revision: {REVISION}\n")) && text.contains("threads: 3\n"), "{text}");
        assert!(text.contains(&format!("ports: {}\n", ports.words())), "{text}");
        assert!(REVISION == "unknown" || REVISION.trim_end_matches("-dirty").chars().all(|c| c.is_ascii_hexdigit()));
    }
}
