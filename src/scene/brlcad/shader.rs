//! Shader strings: a name and parameters, in the old form or as a Tcl list.
//!
//! Old: `plastic sh=50 di=.3`, `stack checker; plastic sh=20`, `envmap cloud`. Tcl: `plastic {sh 50 di .3}`,
//! `stack {{checker {}} {plastic {sh 20}}}`, `envmap {cloud {}}`.

use std::path::Path;

use super::tcl::Words;
use crate::error::Result;

/// Deepest nesting of shaders in shaders; below it the text is a name.
const MAX_DEPTH: usize = 4;

/// A shader by name. Which names and parameters mean something is the renderer's business.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shader {
    /// Its name, `plastic` for example.
    pub name: String,
    /// Parameters, in order.
    pub parameters: Vec<(String, String)>,
    /// The shaders that `stack` applies in order, or the one that `envmap` looks into.
    pub layers: Vec<Shader>,
}

impl Shader {
    /// Reads a shader string; any text gives a shader.
    pub fn parse(text: &str) -> Self {
        Self::tcl(text, MAX_DEPTH).ok().flatten().unwrap_or_else(|| Self::old(text, MAX_DEPTH))
    }

    /// The last value of the first of `names` that is given, as a number.
    pub fn number(&self, names: &[&str]) -> Option<f64> {
        self.text(names)?.parse().ok().filter(|v: &f64| v.is_finite())
    }

    /// The last value given to any of `names`.
    pub fn text(&self, names: &[&str]) -> Option<&str> {
        self.parameters.iter().rev().find(|(key, _)| names.contains(&key.as_str())).map(|(_, value)| value.as_str())
    }

    /// `NAME {...}`; `None` if the text is no such list.
    fn tcl(text: &str, depth: usize) -> Result<Option<Self>> {
        if !text.contains('{') {
            return Ok(None);
        }
        let mut words = Words::new(Path::new("shader"), text.as_bytes());
        let Some(name) = words.next()? else { return Ok(None) };
        let name = name.text().into_owned();
        if name.contains('{') || name.contains(char::is_whitespace) {
            // The whole was in braces once more.
            return if depth == 0 { Ok(None) } else { Self::tcl(&name, depth - 1) };
        }
        let Some(list) = words.next()? else { return Ok(Some(Self { name, ..Self::default() })) };
        let mut inside = words.inside(list);
        let mut shader = Self { name, ..Self::default() };
        match shader.name.as_str() {
            "stack" if depth > 0 => {
                while let Some(layer) = inside.next()? {
                    let text = layer.text();
                    shader.layers.push(Self::tcl(&text, depth - 1)?.unwrap_or_else(|| Self::old(&text, depth - 1)));
                }
            }
            "envmap" if depth > 0 => {
                let text = list.text();
                shader.layers.push(Self::tcl(&text, depth - 1)?.unwrap_or_else(|| Self::old(&text, depth - 1)));
            }
            _ => {
                while let Some(key) = inside.next()? {
                    let value = inside.next()?.map(|word| word.text().into_owned()).unwrap_or_default();
                    shader.parameters.push((key.text().into_owned(), value));
                }
            }
        }
        Ok(Some(shader))
    }

    /// `NAME KEY=VALUE ...`; `stack` separates its shaders by semicolons.
    fn old(text: &str, depth: usize) -> Self {
        let text = text.trim();
        let (name, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let mut shader = Self { name: name.into(), ..Self::default() };
        match name {
            "stack" if depth > 0 => {
                let layers = rest.split(';').map(str::trim).filter(|layer| !layer.is_empty());
                shader.layers = layers.map(|layer| Self::old(layer, depth - 1)).collect();
            }
            "envmap" if depth > 0 => shader.layers.push(Self::old(rest, depth - 1)),
            _ => {
                let words = rest.split(|c: char| c.is_whitespace() || c == ';').filter(|word| !word.is_empty());
                shader.parameters = words
                    .map(|word| word.split_once('=').unwrap_or((word, "")))
                    .map(|(key, value)| (key.into(), value.trim_matches('"').into()))
                    .collect();
            }
        }
        shader
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(name: &str, parameters: &[(&str, &str)]) -> Shader {
        let parameters = parameters.iter().map(|&(key, value)| (key.into(), value.into())).collect();
        Shader { name: name.into(), parameters, layers: Vec::new() }
    }

    #[test]
    fn old_and_tcl_forms_say_the_same() {
        let plastic = plain("plastic", &[("re", ".3"), ("sp", "0.2")]);
        for text in
            ["plastic re=.3 sp=0.2", "plastic {re .3 sp 0.2}", "{plastic {re .3 sp 0.2}}", " plastic re=.3  sp=0.2"]
        {
            assert_eq!(Shader::parse(text), plastic, "{text}");
        }
        assert_eq!(plastic.number(&["re", "reflect"]), Some(0.3));
        assert_eq!(plastic.number(&["di"]), None);
        assert_eq!(Shader::parse("glass"), plain("glass", &[]));
        assert_eq!(Shader::parse("{glass}"), plain("glass", &[]));
    }

    #[test]
    fn stacks_and_environments_hold_shaders() {
        let layers = vec![plain("checker", &[]), plain("plastic", &[("sh", "20"), ("di", ".9")])];
        let stack = Shader { name: "stack".into(), parameters: vec![], layers };
        assert_eq!(Shader::parse("stack checker; plastic sh=20 di=.9"), stack);
        assert_eq!(Shader::parse("stack {{checker {}} {plastic {sh 20 di .9}}}"), stack);
        let map = Shader { name: "envmap".into(), parameters: vec![], layers: vec![plain("cloud", &[])] };
        assert_eq!(Shader::parse("envmap cloud"), map);
        assert_eq!(Shader::parse("envmap {cloud {}}"), map);
    }

    #[test]
    fn any_text_gives_a_shader() {
        for text in ["", "{", "{{{{{{{{{{", "stack {{", "a {b", "stack stack stack stack stack stack stack a"] {
            Shader::parse(text);
        }
        let deep = "{".repeat(100_000) + &"}".repeat(100_000);
        Shader::parse(&deep);
        Shader::parse(&format!("stack {}", deep));
    }
}
