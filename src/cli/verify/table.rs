//! The report of `verify` for people: a line per precision, ray class and query, with the engines behind it where
//! something is wrong or where all are asked for.

use std::collections::BTreeMap;

use crate::measure::verify::Line;

/// The table; with `all`, a line for every engine.
pub fn table(lines: &[Line], all: bool) -> String {
    let mut text = format!(
        "{:<4} {:<8} {:<7} {:<10} {:>9} {:>9} {:>9} {:>11} {:>9} {:>9} {:>9}  {}\n",
        "", "rays", "query", "engine", "answers", "hits", "agree", "unexplained", "bits", "order", "own", "explained"
    );
    for group in lines.chunk_by(|a, b| (a.precision, a.class, a.query) == (b.precision, b.class, b.query)) {
        text.push_str(&summary(group));
        for line in group.iter().filter(|line| all || !line.passes()) {
            text.push_str(&engine(line));
        }
    }
    text
}

/// What one row shows.
#[derive(Default)]
struct Row<'a> {
    answers: u64,
    hits: u64,
    agree: u64,
    unexplained: u64,
    bits: u64,
    order: u64,
    own: u64,
    explained: BTreeMap<&'a str, u64>,
}

impl<'a> Row<'a> {
    fn add(&mut self, line: &'a Line) {
        self.answers += line.rays;
        self.hits += line.hits;
        self.agree += line.oracle.agree;
        self.unexplained += line.oracle.unexplained;
        self.bits += line.bit_differences.unwrap_or(0);
        self.own += line.own_differences.unwrap_or(0);
        self.order += line.order_differences;
        for (why, count) in &line.oracle.explained {
            *self.explained.entry(why).or_default() += count;
        }
    }

    fn text(&self) -> String {
        let Self { answers, hits, agree, unexplained, bits, order, own, .. } = self;
        let share = |count: &u64| 100.0 * *count as f64 / (*answers).max(1) as f64;
        let reasons = self.explained.iter().map(|(why, count)| format!("{why} {:.2} %", share(count)));
        let reasons = reasons.collect::<Vec<_>>().join(", ");
        let reasons = if reasons.is_empty() { "-".into() } else { reasons };
        format!("{answers:>9} {hits:>9} {agree:>9} {unexplained:>11} {bits:>9} {order:>9} {own:>9}  {reasons}")
    }
}

/// One line for engines that answered the same rays.
fn summary(group: &[Line]) -> String {
    let mut row = Row::default();
    let ran: Vec<_> = group.iter().filter(|line| line.skipped.is_none()).collect();
    ran.iter().for_each(|line| row.add(line));
    let names = match (ran.len(), group.len()) {
        (ran, all) if ran == all => format!("{all} engines"),
        (ran, all) => format!("{ran} of {all}"),
    };
    let head = group.first().map_or(("", "", ""), |line| (line.precision, line.class, line.query));
    format!("{:<4} {:<8} {:<7} {names:<10} {}\n", head.0, head.1, head.2, row.text())
}

/// One line for one engine, and the first faults below it.
fn engine(line: &Line) -> String {
    let mut row = Row::default();
    row.add(line);
    let rest = line.skipped.as_ref().map_or_else(|| row.text(), |why| format!("skipped: {why}"));
    let mut text = format!("{:<4} {:<8} {:<7} {:<10} {rest}\n", "", "", "", line.engine);
    for wrong in line.oracle.samples.iter().take(1).chain(&line.first_difference) {
        text.push_str(&format!("     WRONG {wrong}\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::truth::Counts;

    fn line(engine: &'static str, query: &'static str) -> Line {
        let explained = BTreeMap::from([("edge".to_string(), 3), ("tangent".to_string(), 1)]);
        Line {
            precision: "f32",
            class: "scatter",
            query,
            engine,
            rays: 200,
            hits: 150,
            oracle: Counts { agree: 196, explained, unexplained: 0, samples: Vec::new() },
            bit_differences: Some(0),
            first_difference: None,
            own_differences: None,
            order_differences: 0,
            skipped: None,
        }
    }

    #[test]
    fn engines_of_a_class_are_one_line() {
        let mut lines = vec![line("scalar", "closest"), line("packet4", "closest"), line("brute", "any")];
        lines[2].skipped = Some("too many tests".into());
        let text = table(&lines, false);
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows.len(), 3, "{text}");
        let words: Vec<&str> = rows[1].split_whitespace().collect();
        assert_eq!(words[..6], ["f32", "scatter", "closest", "2", "engines", "400"]);
        assert_eq!(words[6..].join(" "), "300 392 0 0 0 0 edge 1.50 %, tangent 0.50 %");
        assert!(rows[2].contains("any") && rows[2].contains("0 of 1"), "{text}");
        assert_eq!(table(&lines, true).lines().count(), 6);
    }

    #[test]
    fn what_is_wrong_is_shown_with_its_engine() {
        let mut lines = vec![line("scalar", "closest"), line("packet4", "closest")];
        lines[1].bit_differences = Some(7);
        lines[1].first_difference = Some("ray 5: t 1 against t 2".into());
        let text = table(&lines, false);
        assert!(text.contains("packet4") && !text.contains("scalar"), "{text}");
        assert!(text.contains("WRONG ray 5: t 1 against t 2"), "{text}");
    }

    #[test]
    fn an_arithmetic_of_its_own_is_counted_and_no_fault() {
        let mut lines = vec![line("scalar", "closest"), line("tile", "closest")];
        (lines[1].bit_differences, lines[1].own_differences) = (None, Some(90));
        let text = table(&lines, false);
        let rows: Vec<&str> = text.lines().collect();
        assert_eq!(rows.len(), 2, "{text}");
        assert!(rows[0].contains("bits     order       own") && rows[1].contains(" 0         0        90 "), "{text}");
        assert!(lines.iter().all(Line::passes));
    }
}
