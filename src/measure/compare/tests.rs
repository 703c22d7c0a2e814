use std::path::Path;

use super::*;
use crate::camera::sampling::pcg4d;

const HEADER: &str = "threads,scene,scene_hash,class,query,engine,precision,rays,status,repeat,median_mrays_per_s,\
    mad_seconds,ratio_to_scalar,peer_mode";

/// A file of an older version: without single passes.
fn parsed(rows: &str) -> Result<Turn> {
    read::parse(Path::new("a.csv"), format!("{HEADER}\n{rows}").as_bytes())
}

fn row(engine: &str, mrays: f64, mad: f64, ratio: &str) -> String {
    format!("1,box,abc,primary,closest,{engine},f32,1000000,ok,9,{mrays},{mad},{ratio},\n")
}

/// Files of this version: `rows` are engine and seconds of a million rays.
fn with_passes(date: &str, rows: &[(&str, &[f64])]) -> Turn {
    let mut text = format!("{HEADER},date,seconds\n");
    for (engine, passes) in rows {
        let mid = crate::measure::stats::median(passes).unwrap();
        let seconds: Vec<String> = passes.iter().map(|s| format!("{s:.9}")).collect();
        let (head, passes) = (row(engine, 1.0 / mid, 0.0, "1"), seconds.join(" "));
        text += &format!("{},{date},{passes}\n", head.trim_end());
    }
    read::parse(Path::new("a.csv"), text.as_bytes()).unwrap()
}

fn find<'a>(changes: &'a [Change], engine: &str) -> &'a Change {
    changes.iter().find(|c| c.engine == engine).unwrap()
}

/// A million rays at 2 Mrays/s take 0.5 s; 0.001 s deviation over 9 rounds: 1.2533 1.4826 0.001 / 0.5 / 3.
#[test]
fn errors_by_hand() {
    let turn = parsed(&row("tile", 2.0, 0.001, "3")).unwrap();
    let figure = turn.figures.values().next().unwrap();
    assert!((figure.error - 1.2533 * 1.4826 * 0.001 / 0.5 / 3.0).abs() < 1e-12, "{figure:?}");
    assert_eq!((figure.mrays, figure.ratio, figure.rates.len()), (2.0, Some(3.0), 0));
}

#[test]
fn what_moved_and_what_did_not() {
    let old = row("scalar", 3.0, 0.0, "1") + &row("tile", 20.0, 0.0, "10") + &row("gone", 1.0, 0.0, "0.5");
    // The machine became a third as fast; tile gained a tenth on top, packet is new.
    let new = row("scalar", 1.0, 0.0, "1") + &row("tile", 11.0, 0.0, "11") + &row("packet", 4.0, 0.0, "4");
    let changes = compare(&[parsed(&old).unwrap()], &[parsed(&new).unwrap()]);
    let verdict = |engine: &str| find(&changes, engine).verdict;
    assert_eq!((verdict("tile"), find(&changes, "tile").factor), ("faster", Some(1.1)));
    assert_eq!((verdict("scalar"), verdict("gone"), verdict("packet")), ("slower", "only old", "only new"));
    let text = table(&Comparison::of(changes).unwrap());
    assert!(text.contains("1.100    1.100 to 1.100     2 %  faster"), "{text}");
    assert!(text.contains("\n2 rows compared: 1 faster, 1 slower; 1 only old; 1 only new\n"), "{text}");
}

/// Runs that took turns with a program that keeps no passes have medians, and these compare.
#[test]
fn turns_without_passes_compare() {
    let header = format!("{HEADER},date\n");
    let turn = |date: u32, mrays: f64| {
        let text = format!("{header}{},{date}\n", row("tile", mrays, 0.0, "").trim_end());
        read::parse(Path::new("a.csv"), text.as_bytes()).unwrap()
    };
    let [old, new] = [(0, 10.0), (1, 20.0)].map(|(at, mrays)| [0, 2, 4].map(|i| turn(i + at, mrays)));
    let change = &compare(&old, &new)[0];
    assert_eq!((change.verdict, change.factor, change.basis), ("faster", Some(2.0), Some("rates")));
}

/// The machine becomes twice as fast from turn to turn; the programs are the same. Rows are paired by their turn, whatever lacks one.
#[test]
fn turns_that_lack_a_row_pair_no_others() {
    let turns = |side: u32, lacking: &[u32]| -> Vec<Turn> {
        let turn = |number: u32| {
            let (date, seconds) = ((2 * number + side).to_string(), [0.5f64.powi(number as i32); 3]);
            let engine = if lacking.contains(&number) { "packet4" } else { "tile" };
            with_passes(&date, &[(engine, &seconds)])
        };
        (0..5).map(turn).collect()
    };
    let tile = |old: &[u32], new: &[u32]| find(&compare(&turns(0, old), &turns(1, new)), "tile").clone();
    let whole = tile(&[1], &[3]);
    assert_eq!((whole.basis, whole.verdict, whole.factor), (Some("turns"), "no difference seen", Some(1.0)));
    // Two turns that have both are too few to be judged as turns.
    assert_eq!(tile(&[1, 2], &[3]).basis, Some("ratios to scalar"));
}

/// `bench a/m.obj b/m.obj` of two equal files: rows of `m` and `m-2` with one hash.
#[test]
fn scenes_of_one_hash_have_each_their_rows() {
    let rows = |names: [&str; 2], mrays: [f64; 2]| {
        let named = |name, mrays| row("tile", mrays, 0.0, "").replace(",box,", &format!(",{name},"));
        [parsed(&(named(names[0], mrays[0]) + &named(names[1], mrays[1]))).unwrap()]
    };
    let old = rows(["m", "m-2"], [10.0, 30.0]);
    // The hash says what is the same, also of a file by another name.
    for names in [["m", "m-2"], ["n", "n-2"]] {
        let factors: Vec<_> = compare(&old, &rows(names, [20.0, 30.0])).iter().map(|c| c.factor.unwrap()).collect();
        assert_eq!(factors, [2.0, 1.0], "{names:?}");
    }
    let scenes: Vec<_> = compare(&old, &old).into_iter().map(|change| change.scene).collect();
    assert_eq!(scenes, ["m", "m-2"]);
}

#[test]
fn runs_without_a_common_row_are_refused() {
    let [old, new] = ["tile", "packet4"].map(|engine| [parsed(&row(engine, 1.0, 0.0, "1")).unwrap()]);
    let refused = Comparison::of(compare(&old, &new)).unwrap_err();
    assert_eq!(refused.exit_code(), 2);
    assert!(refused.to_string().contains("only old: 1, only new: 1"), "{refused}");
}

#[test]
fn noise_is_no_difference() {
    let old = [parsed(&row("tile", 20.0, 0.002, "10")).unwrap()];
    let new = [parsed(&row("tile", 21.0, 0.002, "10.5")).unwrap()];
    assert_eq!(compare(&old, &new)[0].verdict, "no difference seen");
    let same = Comparison::of(compare(&old, &old)).unwrap();
    assert_eq!((same.rows[0].verdict, same.rows[0].factor), ("no difference seen", Some(1.0)));
    assert!(table(&same).contains("no difference seen\n1 rows"), "{}", table(&same));
}

/// Ratios are taken round by round: the second round was disturbed for both.
#[test]
fn passes_make_ratios_round_by_round() {
    let turn = with_passes("d", &[("scalar", &[1.0, 2.0, 1.0]), ("tile", &[0.25, 0.5, 0.2])]);
    let tile = turn.figures.iter().find(|(key, _)| key[3] == "tile").unwrap().1;
    assert!(tile.ratios.iter().zip([4.0, 4.0, 5.0]).all(|(a, b)| (a - b).abs() < 1e-6), "{tile:?}");
    assert!((tile.rates[1] - 2.0).abs() < 1e-6);
}

#[test]
fn faults_say_where() {
    let text = |result: Result<Turn>| result.unwrap_err().to_string();
    assert!(text(read::parse(Path::new("a.csv"), b"threads,scene\n")).contains("`scene_hash`"));
    let word = text(parsed(&row("tile", 1.0, 0.0, "1").replace("ok,9", "ok,nine")));
    assert!(word.contains("a.csv:2:") && word.contains("`nine`"), "{word}");
    let short = text(parsed("1,box\n"));
    assert!(short.contains("a.csv:2:"), "{short}");
    let twice = row("tile", 1.0, 0.0, "1").repeat(2);
    assert!(text(parsed(&twice)).contains("a.csv:3:"));
    assert!(parsed("1,box,abc,primary,closest,brute,f32,1,skipped: why,,,,,\n").unwrap().figures.is_empty());
    let bad = format!("{HEADER},seconds\n{},1.0 -2\n", row("tile", 1.0, 0.0, "1").trim_end());
    assert!(text(read::parse(Path::new("a.csv"), bad.as_bytes())).contains("found `-2`"));
}

/// Simulated timings like those of a shared machine: each run has a mood of its own (10 %), each round another (5 %), each
/// pass noise (1.5 %), and one pass in twenty is disturbed by up to a third.
struct Machine {
    trial: u32,
    drawn: u32,
}

impl Machine {
    fn unit(&mut self) -> f64 {
        self.drawn += 1;
        f64::from(pcg4d([self.trial, self.drawn, 3, 5])[0]) / 4_294_967_296.0
    }

    /// About normal: the sum of twelve uniform numbers has variance 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    /// A run of `rounds` in which `scalar` takes 1 s and `tile` `tile` s on a quiet machine.
    fn run(&mut self, rounds: usize, tile: f64) -> Turn {
        let mood = (0.10 * self.normal()).exp();
        let (mut scalar_seconds, mut tile_seconds) = (Vec::new(), Vec::new());
        for _ in 0..rounds {
            let round = mood * (0.05 * self.normal()).exp();
            for (seconds, quiet) in [(&mut scalar_seconds, 1.0), (&mut tile_seconds, tile)] {
                let disturbed = if self.unit() < 0.05 { 1.0 + self.unit() / 3.0 } else { 1.0 };
                seconds.push(quiet * round * (0.015 * self.normal()).exp() * disturbed);
            }
        }
        with_passes(&format!("{:08}", self.drawn), &[("scalar", &scalar_seconds), ("tile", &tile_seconds)])
    }

    /// `count` runs of either side, taking turns; the new side's tile is `slowdown` times as slow.
    fn turns(&mut self, count: usize, rounds: usize, slowdown: f64) -> [Vec<Turn>; 2] {
        let (mut old, mut new) = (Vec::new(), Vec::new());
        for _ in 0..count {
            old.push(self.run(rounds, 0.1));
            new.push(self.run(rounds, 0.1 * slowdown));
        }
        [old, new]
    }
}

/// How many of a hundred trials end with `verdict` for `tile`.
fn count(turns: usize, rounds: usize, slowdown: f64, verdict: &str) -> usize {
    let judged = (0..100).map(|trial| {
        let [old, new] = Machine { trial, drawn: 0 }.turns(turns, rounds, slowdown);
        find(&compare(&old, &new), "tile").verdict
    });
    judged.filter(|v| *v == verdict).count()
}

#[test]
fn runs_that_took_turns_show_five_per_cent_and_nothing_where_there_is_nothing() {
    let (found, quiet) = (count(6, 10, 1.05, "slower"), count(6, 10, 1.0, "no difference seen"));
    println!("6 turns of 10 rounds: {found} of 100 found, {quiet} of 100 quiet");
    assert!(found >= 95 && quiet >= 95, "{found} found, {quiet} quiet");
}

#[test]
fn two_single_runs_show_five_per_cent_and_nothing_where_there_is_nothing() {
    let (found, quiet) = (count(1, 25, 1.05, "slower"), count(1, 25, 1.0, "no difference seen"));
    println!("2 runs of 25 rounds: {found} of 100 found, {quiet} of 100 quiet");
    assert!(found >= 95 && quiet >= 95, "{found} found, {quiet} quiet");
}

/// Rays of other cameras and seeds are other rays, whatever their number.
#[test]
fn rows_of_other_rays_are_not_compared() {
    let of = |command: &str| {
        let text =
            format!("{HEADER},command\n{},\"lanecast bench box{command}\"\n", row("tile", 2.0, 0.0, "3").trim_end());
        [read::parse(Path::new("a.csv"), text.as_bytes()).unwrap()]
    };
    let compared = |old: &str, new: &str| Comparison::of(compare(&of(old), &of(new))).map(|c| c.compared).ok();
    assert_eq!(compared(" --seed 1 -o a", " --threads 1 -o b"), Some(1));
    assert_eq!(compared(" --eye=1,2,3.0", " --eye 1,2,3"), Some(1));
    for other in ["", " --eye 1,2,4", " --eye 1,2,3 --seed 2", " --eye 1,2,3 --apart", " --eye 1,2,3 --top part"] {
        assert_eq!(compared(" --eye 1,2,3", other), None, "{other}");
    }
}
