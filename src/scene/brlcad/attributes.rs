//! What the attributes of combinations mean, alike in both forms of version 5.

use super::model::Combination;
use crate::scene::text::shown;

/// The attribute that makes a combination a region. It is applied before all others: numbers of regions mean nothing
/// without it.
pub(super) const REGION: &str = "region";

/// Sets what `key` with the value `text` means for `combination`; false if it means nothing here. Of `rgb` and `color`
/// and of `oshader` and `shader`, the later one counts, as both are names of one thing.
///
/// Attributes are whatever somebody typed, and BRL-CAD shows a database whose attributes are odd: a number counts up to
/// its first character that is none, and is 0 without any (C's `atol`); a colour that cannot be read is none. What was
/// not taken as it stands is said to `warn`, in words.
pub(super) fn set(combination: &mut Combination, key: &str, text: &str, mut warn: impl FnMut(String)) -> bool {
    let text = text.trim();
    match key {
        // Whatever else it says, 0 too: that is the kind of region, no number of any.
        REGION if !matches!(text, "" | "no" | "false" | "N" | "n") => _ = combination.region.get_or_insert_default(),
        REGION => {}
        "rgb" | "color" => {
            combination.rgb = rgb(text).inspect_err(|what| warn(format!("{what}; done without a colour"))).ok();
        }
        "oshader" | "shader" => combination.shader = (!text.is_empty()).then(|| text.to_owned()),
        "inherit" => combination.inherit = !matches!(text, "" | "0" | "no" | "false" | "N" | "n"),
        _ => {
            let Some(region) = &mut combination.region else { return false };
            let number = match key {
                "region_id" => &mut region.id,
                "aircode" => &mut region.air,
                "los" => &mut region.los,
                "material_id" => &mut region.material,
                _ => return false,
            };
            *number = match text.parse() {
                Ok(number) => number,
                Err(_) if text.is_empty() => 0,
                Err(_) => {
                    let number = leading_number(text);
                    let found = shown(text.as_bytes());
                    warn(format!("expected a whole number, found {found}, which counts as {number}"));
                    number
                }
            };
        }
    }
    true
}

/// The number with which `text` begins, 0 if it begins with none; one beyond the range is the last one in it.
fn leading_number(text: &str) -> i32 {
    let digits = text.strip_prefix(['-', '+']).unwrap_or(text);
    let count = digits.bytes().take_while(u8::is_ascii_digit).count();
    if count == 0 {
        return 0;
    }
    let number = &text[..text.len() - digits.len() + count];
    number.parse().unwrap_or(if number.starts_with('-') { i32::MIN } else { i32::MAX })
}

/// `r/g/b`, or three numbers with blanks between.
///
/// # Errors
/// In words, what was expected.
pub(super) fn rgb(text: &str) -> Result<[u8; 3], String> {
    let mut channels = text.split(|c: char| c == '/' || c.is_whitespace()).filter(|part| !part.is_empty());
    let mut next = || channels.next().and_then(|part| part.parse::<u8>().ok());
    match (next(), next(), next()) {
        (Some(r), Some(g), Some(b)) => Ok([r, g, b]),
        _ => Err(format!("expected a colour R/G/B, each 0 to 255, found {}", shown(text.as_bytes()))),
    }
}
