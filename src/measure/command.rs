//! What the command of a row says beside the row's own columns.

/// Options that choose rays: values of which the last counts, those of points and angles as numbers.
const OF_RAYS: [&str; 9] = ["camera", "eye", "look-at", "up", "fov", "view", "az", "el", "seed"];

/// The words of a command as a shell splits them: `'...'` as it stands, `\` before a letter that is one.
pub fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut quoted) = (Vec::new(), None::<String>, false);
    let mut letters = command.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\'' => {
                quoted = !quoted;
                word.get_or_insert_default();
            }
            c if c.is_whitespace() && !quoted => words.extend(word.take()),
            '\\' if !quoted => word.get_or_insert_default().extend(letters.next()),
            c => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

/// The values of `--name`.
pub fn values<'a>(words: &'a [String], name: &str) -> Vec<&'a str> {
    let (mut words, mut values) = (words.iter(), Vec::new());
    while let Some(word) = words.next() {
        match word.strip_prefix("--").and_then(|word| word.strip_prefix(name)) {
            Some("") => values.extend(words.next().map(String::as_str)),
            Some(rest) => values.extend(rest.strip_prefix('=')),
            None => {}
        }
    }
    values
}

/// What two rows must have in common, and have no column for, to be about the same rays in the same scene: camera, seed, objects
/// shown and whether meshes are left apart, in one order and spelling; empty for a command that leaves all that as it is.
pub fn settings(words: &[String]) -> String {
    let mut said = Vec::new();
    for name in OF_RAYS {
        let value = values(words, name).last().map(|value| spelt(value));
        // Experiments name the seed that there is without one.
        said.extend(value.filter(|value| name != "seed" || value != "1").map(|value| format!("--{name} {value}")));
    }
    said.extend(values(words, "top").into_iter().map(|object| format!("--top {object}")));
    said.extend(words.iter().any(|word| word == "--apart").then(|| "--apart".to_string()));
    said.join(" ")
}

/// Numbers in one spelling: `0.0,1e1` is `0,10`.
fn spelt(value: &str) -> String {
    let one = |text: &str| text.parse::<f64>().map_or_else(|_| text.to_string(), |x| (x + 0.0).to_string());
    // A seed is a whole number of more digits than those of an f64.
    if value.bytes().all(|b| b.is_ascii_digit()) {
        return value.into();
    }
    value.split(',').map(one).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read_as_they_are_quoted() {
        let said = words(r"lanecast bench 'a b' 'it'\''s' '' --set x=1 --set='y= 2'  --leaf 4");
        assert_eq!(said, ["lanecast", "bench", "a b", "it's", "", "--set", "x=1", "--set=y= 2", "--leaf", "4"]);
        assert_eq!((values(&said, "set"), values(&said, "leaf")), (vec!["x=1", "y= 2"], vec!["4"]));
        assert!(values(&said, "le").is_empty() && words("").is_empty());
    }

    #[test]
    fn settings_are_spelt_in_one_way() {
        let of = |command: &str| settings(&words(command));
        assert_eq!(of("lanecast bench a --threads 1 --seed 1 --size 9x9 --set n=3 --preset fast"), "");
        let one = "--eye 1,-2,10 --look-at 0,0,0 --fov 60 --seed 7 --top a --top b --apart";
        assert_eq!(of("x --fov 60.0 --apart --top a --top b --eye=1,-2.0,1e1 --look-at 0,-0,0 --seed 7"), one);
        assert_eq!(
            of("x --seed=9007199254740993 --view 'a b.rt' --az -35.0"),
            "--view a b.rt --az -35 --seed 9007199254740993"
        );
    }
}
