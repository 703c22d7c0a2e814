//! What the attributes of combinations mean, alike in both forms of version 5.

use super::model::Combination;
use crate::scene::text::shown;

/// The attribute that makes a combination a region. It is applied before all others: numbers of regions mean nothing
/// without it.
pub(super) const REGION: &str = "region";

/// Sets what `key` with the value `text` means for `combination`; false if it means nothing here. Of `rgb` and `color`
/// and of `oshader` and `shader`, the later one counts, as both are names of one thing.
///
/// # Errors
/// In words, what was expected.
pub(super) fn set(combination: &mut Combination, key: &str, text: &str) -> Result<bool, String> {
    let text = text.trim();
    match key {
        // Whatever else it says, 0 too: that is the kind of region, no number of any.
        REGION if !matches!(text, "" | "no" | "false" | "N" | "n") => _ = combination.region.get_or_insert_default(),
        REGION => {}
        "rgb" | "color" => combination.rgb = Some(rgb(text)?),
        "oshader" | "shader" => combination.shader = (!text.is_empty()).then(|| text.to_owned()),
        "inherit" => combination.inherit = !matches!(text, "" | "0" | "no" | "false" | "N" | "n"),
        _ => {
            let Some(region) = &mut combination.region else { return Ok(false) };
            let number = match key {
                "region_id" => &mut region.id,
                "aircode" => &mut region.air,
                "los" => &mut region.los,
                "material_id" => &mut region.material,
                _ => return Ok(false),
            };
            *number = text.parse().map_err(|_| format!("expected a whole number, found {}", shown(text.as_bytes())))?;
        }
    }
    Ok(true)
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
