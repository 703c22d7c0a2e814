//! Parameters that change with the frame of an animation: `parameter angle { key 0 0; key 48 360 }`.

use super::fields::{Fields, numbers_of};
use super::scope::Scope;
use super::settings::NO_NUMBER;
use super::syntax::Node;
use crate::error::Result;

/// Name of the frame's number: a parameter of every scene that has none of that name, 0 unless set.
pub const FRAME: &str = "frame";
/// What a keyed parameter holds.
const KEY: &[&str] = &["key"];

/// Makes [`FRAME`] known, unless the scene defines it itself.
///
/// # Errors
/// A `--set` value that is no number.
pub fn define_frame(scope: &mut Scope<'_>, nodes: &[Node<'_>], set: &[(String, String)]) -> Result<()> {
    let is_own = |node: &Node<'_>| node.name == "parameter" && node.title().is_some_and(|(name, _)| name == FRAME);
    if !nodes.iter().any(is_own) {
        let number = super::settings::set_value(scope, FRAME, set)?.unwrap_or(0.0);
        scope.parameters.insert(FRAME.into(), number);
    }
    Ok(())
}

/// The value of keyed parameter `node` at the scene's frame: that of its keys, straight between them, that of the first or
/// last one outside.
///
/// # Errors
/// Anything but `key FRAME VALUE` in the block, frames that do not grow.
pub fn value(scope: &Scope<'_>, node: &Node<'_>) -> Result<f64> {
    let fields = Fields::collect(scope, node, &[], KEY)?;
    let mut keys: Vec<(f64, f64)> = Vec::with_capacity(fields.rest.len());
    for child in &fields.rest {
        if child.name != KEY[0] {
            return Err(fields.unknown_child(child, KEY));
        }
        let numbers = numbers_of(scope, &child.entries)?;
        let &[frame, value] = numbers.as_slice() else {
            return Err(scope.source.error(child.span, "expected `key FRAME VALUE`"));
        };
        if keys.last().is_some_and(|(last, _)| *last >= frame) {
            return Err(scope.source.error(child.span, "the frames of keys must grow"));
        }
        keys.push((frame, value));
    }
    let (Some(first), Some(last)) = (keys.first(), keys.last()) else {
        return Err(fields.error(NO_NUMBER));
    };
    let frame = scope.parameters.get(FRAME).copied().unwrap_or(0.0).clamp(first.0, last.0);
    let after = keys.partition_point(|(at, _)| *at <= frame).clamp(1, keys.len().max(2) - 1);
    Ok(match (keys[after - 1], keys.get(after)) {
        ((start, from), Some(&(end, to))) => from + (to - from) * ((frame - start) / (end - start)),
        ((_, only), None) => only,
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::error::Result;
    use crate::scene::description::Description;
    use crate::scene::kdl::meshes::MeshFiles;

    fn scene(text: &str, frame: Option<&str>) -> Result<Description> {
        let set: Vec<_> = frame.iter().map(|value| ("frame".to_string(), value.to_string())).collect();
        let read = |_: &Path| unreachable!("no meshes");
        let files = MeshFiles { folder: None, allow_outside: false, found: None, read: &read };
        crate::scene::kdl::parse(Path::new("s.kdl"), "s", text.as_bytes(), &set, &files)
    }

    /// The ambient light's red: set from the parameter.
    fn at(text: &str, frame: Option<&str>) -> f64 {
        scene(text, frame).unwrap().ambient.x
    }

    #[test]
    fn keys_by_hand() {
        let keys = "parameter a { key 10 1; key 20 3; key 24 0 }\nambient \"a\"";
        for (frame, want) in [("0", 1.0), ("10", 1.0), ("15", 2.0), ("20", 3.0), ("23", 0.75), ("24", 0.0), ("99", 0.0)]
        {
            assert_eq!(at(keys, Some(frame)), want, "frame {frame}");
        }
        assert_eq!(at(keys, None), 1.0, "frame 0 unless set");
        assert_eq!(at("parameter a { key 5 7 }\nambient \"a\"", Some("80")), 7.0);
        assert_eq!(at("ambient \"frame / 4\"", Some("10")), 2.5);
        assert_eq!(at("parameter frame 3\nambient \"frame\"", None), 3.0);
        assert_eq!(at("parameter frame 3\nparameter a { key 0 0; key 8 4 }\nambient \"a\"", Some("6")), 3.0);
    }

    #[test]
    fn faults_have_a_place() {
        for (text, want) in [
            ("parameter a {}", "1:1: expected `parameter name value`"),
            ("parameter a { key 1 }", "1:15: expected `key FRAME VALUE`"),
            ("parameter a { key 1 2; key 1 3 }", "1:24: the frames of keys must grow"),
            ("parameter a { kez 1 2 }", "1:15: unknown `kez`"),
            ("parameter a 1 { key 1 2 }", "1:1: expected `parameter name value`"),
        ] {
            let error = scene(text, None).unwrap_err().to_string();
            assert!(error.starts_with(&format!("s.kdl:{want}")), "{text}: {error}");
        }
        let error = scene("parameter a 1", Some("x")).unwrap_err().to_string();
        assert!(error.contains("--set frame=x"), "{error}");
    }
}
