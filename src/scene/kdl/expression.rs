//! Arithmetic in scene files: `radius * 2 + sin(30)`.
//!
//! ```text
//! sum     = product (("+" | "-") product)*
//! product = factor (("*" | "/") factor)*
//! factor  = ("+" | "-") factor | number | name | name "(" sum ("," sum)* ")" | "(" sum ")"
//! ```
//! Angles are degrees. Recursive descent, depth limited, no allocation on the good path.

use super::source::{near, quote};
use super::{hash, hints};

/// Deepest nesting of parentheses, calls and signs.
const MAX_DEPTH: u32 = 64;

/// Functions with their least and greatest number of arguments.
const FUNCTIONS: [(&str, usize, usize); 9] = [
    ("sqrt", 1, 1),
    ("sin", 1, 1),
    ("cos", 1, 1),
    ("tan", 1, 1),
    ("abs", 1, 1),
    ("floor", 1, 1),
    ("min", 2, MAX_ARGUMENTS),
    ("max", 2, MAX_ARGUMENTS),
    ("random", 1, 3),
];
const MAX_ARGUMENTS: usize = 8;

/// What is wrong with an expression and where.
#[derive(Debug, PartialEq, Eq)]
pub struct Fault {
    /// Byte offset in the expression.
    pub at: usize,
    /// What is wrong, what was expected.
    pub what: String,
    /// A name that is spelt alike, or what else may be meant.
    pub help: Option<String>,
}

/// The names an expression may use.
pub trait Names {
    /// The value of `name`.
    fn value(&self, name: &str) -> Option<f64>;
    /// A known name spelt like `name`.
    fn near(&self, name: &str) -> Option<String>;
}

/// Whether `name` may be given to a parameter or an index.
pub fn is_free_name(name: &str) -> bool {
    let letter = |c: char| c.is_alphabetic() || c == '_';
    let word = |word: &str| word.starts_with(letter) && word.chars().all(|c| letter(c) || c.is_ascii_digit());
    name.split('.').all(word) && name != "pi" && FUNCTIONS.iter().all(|f| f.0 != name)
}

/// The finite value of `text`.
///
/// # Errors
/// The first thing that does not fit the grammar, an unknown name, or a value that is not finite.
pub fn evaluate(text: &str, names: &dyn Names) -> Result<f64, Fault> {
    let mut parser = Parser { text, at: 0, depth: 0, names };
    let value = parser.sum()?;
    if parser.peek().is_some() {
        let fault = parser.unexpected("an operator or the end of the expression");
        return Err(Fault { help: hints::several(text), ..fault });
    }
    if !value.is_finite() {
        let what = format!("the value of {} is not finite", quote(text));
        return Err(Fault { at: 0, what, help: Some("is there a division by zero?".into()) });
    }
    Ok(value)
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    depth: u32,
    names: &'a dyn Names,
}

impl<'a> Parser<'a> {
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        let trimmed = rest.trim_start();
        self.at += rest.len() - trimmed.len();
        trimmed.chars().next()
    }

    fn eat(&mut self, c: char) -> bool {
        let found = self.peek() == Some(c);
        self.at += if found { c.len_utf8() } else { 0 };
        found
    }

    fn unexpected(&mut self, wanted: &str) -> Fault {
        let found = match self.peek() {
            None => "the end".to_string(),
            Some(c) => quote(&c.to_string()),
        };
        self.fault(self.at, format!("expected {wanted}, found {found}"))
    }

    fn fault(&self, at: usize, what: String) -> Fault {
        Fault { at, what, help: None }
    }

    fn sum(&mut self) -> Result<f64, Fault> {
        let mut value = self.product()?;
        loop {
            if self.eat('+') {
                value += self.product()?;
            } else if self.eat('-') {
                value -= self.product()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn product(&mut self) -> Result<f64, Fault> {
        let mut value = self.factor()?;
        loop {
            if self.eat('*') {
                value *= self.factor()?;
            } else if self.eat('/') {
                value /= self.factor()?;
            } else {
                return Ok(value);
            }
        }
    }

    fn factor(&mut self) -> Result<f64, Fault> {
        if self.depth >= MAX_DEPTH {
            return Err(self.fault(self.at, format!("the expression nests deeper than {MAX_DEPTH} levels")));
        }
        self.depth += 1;
        let value = self.operand();
        self.depth -= 1;
        value
    }

    fn operand(&mut self) -> Result<f64, Fault> {
        match self.peek() {
            Some('-') => {
                self.at += 1;
                Ok(-self.factor()?)
            }
            Some('+') => {
                self.at += 1;
                self.factor()
            }
            Some('(') => {
                self.at += 1;
                let value = self.sum()?;
                if !self.eat(')') {
                    return Err(self.unexpected("`)`"));
                }
                Ok(value)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.name(),
            _ => Err(self.unexpected("a number, a name or `(`")),
        }
    }

    fn number(&mut self) -> Result<f64, Fault> {
        let start = self.at;
        let bytes = self.text.as_bytes();
        let mut end = start;
        while end < bytes.len() {
            let after_exponent = end > start && matches!(bytes[end - 1], b'e' | b'E');
            match bytes[end] {
                b'0'..=b'9' | b'.' | b'e' | b'E' => end += 1,
                b'+' | b'-' if after_exponent => end += 1,
                _ => break,
            }
        }
        self.at = end;
        let word = &self.text[start..end];
        word.parse().map_err(|_| self.fault(start, format!("expected a number, found {}", quote(word))))
    }

    fn name(&mut self) -> Result<f64, Fault> {
        let start = self.at;
        let rest = &self.text[start..];
        let word = |from: usize| {
            let end = rest[from..].find(|c: char| !(c.is_alphanumeric() || c == '_'));
            end.map_or(rest.len(), |end| from + end)
        };
        let mut end = word(0);
        // Words joined by dots are one name: hole.radius.
        while rest[end..].strip_prefix('.').is_some_and(|r| r.starts_with(|c: char| c.is_alphabetic() || c == '_')) {
            end = word(end + 1);
        }
        let name = &rest[..end];
        self.at += end;
        if self.eat('(') {
            return self.call(name, start);
        }
        if name == "pi" {
            return Ok(std::f64::consts::PI);
        }
        self.names.value(name).ok_or_else(|| Fault {
            at: start,
            what: format!("expected a number or a parameter, found {}", quote(name)),
            help: self.names.near(name).map(|n| format!("did you mean `{n}`?")),
        })
    }

    fn call(&mut self, name: &str, start: usize) -> Result<f64, Fault> {
        let Some(&(name, least, most)) = FUNCTIONS.iter().find(|f| f.0 == name) else {
            let help = near(name, FUNCTIONS.iter().map(|f| f.0)).map(|n| format!("did you mean `{n}`?"));
            let all: Vec<&str> = FUNCTIONS.iter().map(|f| f.0).collect();
            let what = format!("unknown function {}: expected one of {}", quote(name), all.join(", "));
            return Err(Fault { at: start, what, help });
        };
        let mut arguments = [0.0; MAX_ARGUMENTS];
        let mut count = 0;
        loop {
            let value = self.sum()?;
            if let Some(slot) = arguments.get_mut(count) {
                *slot = value;
            }
            count += 1;
            if !self.eat(',') {
                break;
            }
        }
        if !self.eat(')') {
            return Err(self.unexpected("`,` or `)`"));
        }
        if count < least || count > most {
            let range = if least == most { least.to_string() } else { format!("{least} to {most}") };
            return Err(self.fault(start, format!("`{name}` takes {range} arguments, found {count}")));
        }
        Ok(apply(name, &arguments[..count]))
    }
}

fn apply(name: &str, arguments: &[f64]) -> f64 {
    // `f64::min` and `f64::max` prefer numbers, and casts to integers make NaN 0: what is undefined would be lost.
    if arguments.iter().any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let x = arguments[0];
    match name {
        "sqrt" => x.sqrt(),
        "sin" => sin_degrees(x),
        "cos" => sin_degrees(x + 90.0),
        "tan" => sin_degrees(x) / sin_degrees(x + 90.0),
        "abs" => x.abs(),
        "floor" => x.floor(),
        "min" => arguments.iter().copied().fold(x, f64::min),
        "max" => arguments.iter().copied().fold(x, f64::max),
        _ => random(arguments),
    }
}

/// Sine of an angle in degrees, exact at multiples of 30 and 90 degrees where the sine is 0, 1/2 or 1.
pub fn sin_degrees(degrees: f64) -> f64 {
    let turn = degrees.rem_euclid(360.0);
    let (sign, half) = if turn >= 180.0 { (-1.0, turn - 180.0) } else { (1.0, turn) };
    let quarter = if half > 90.0 { 180.0 - half } else { half };
    let sine = match quarter {
        0.0 => 0.0,
        30.0 => 0.5,
        90.0 => 1.0,
        q => q.to_radians().sin(),
    };
    sign * sine
}

/// A number in 0..1 that depends only on the arguments, rounded down to integers.
fn random(arguments: &[f64]) -> f64 {
    let key = |i: usize| arguments.get(i).map_or(0, |&x| x.floor() as i64 as u32);
    hash::unit(hash::mix3(key(0), key(1), key(2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct One;
    impl Names for One {
        fn value(&self, name: &str) -> Option<f64> {
            (name == "radius").then_some(1.5)
        }
        fn near(&self, name: &str) -> Option<String> {
            near(name, ["radius"]).map(String::from)
        }
    }

    #[test]
    fn values_match_hand_computation() {
        for (text, value) in [
            ("1", 1.0),
            ("1 + 2 * 3", 7.0),
            ("(1 + 2) * 3", 9.0),
            ("10 - 4 - 3", 3.0),
            ("16 / 4 / 2", 2.0),
            ("-2 * -3", 6.0),
            ("--2", 2.0),
            ("+.5e1", 5.0),
            ("1e-2*100", 1.0),
            ("radius*2+1", 4.0),
            ("sqrt(16)", 4.0),
            ("sin(30) + sin(90) + sin(-90) + sin(180)", 0.5),
            ("cos(0) + cos(90) + cos(60)", 1.5),
            ("tan(45)", 1.0),
            ("abs(3 - 5)", 2.0),
            ("min(3, 1, 2) + max(3, 1, 2)", 4.0),
            ("floor(-0.5)", -1.0),
            ("2 * pi", std::f64::consts::TAU),
        ] {
            let got = evaluate(text, &One).unwrap();
            assert!((got - value).abs() <= 4.0 * f64::EPSILON * value.abs(), "{text}: {got} is not {value}");
        }
        let r = evaluate("random(3, 1)", &One).unwrap();
        assert!((0.0..1.0).contains(&r) && r != evaluate("random(4, 1)", &One).unwrap());
    }

    #[test]
    fn sines_agree_with_radians() {
        for i in -100..100 {
            let d = f64::from(i) * 7.3;
            assert!((sin_degrees(d) - d.to_radians().sin()).abs() < 1e-14, "{d}");
        }
    }

    #[test]
    fn faults_say_where() {
        for (text, at, phrase) in [
            ("", 0, "expected a number"),
            ("1 +", 3, "found the end"),
            ("1 2", 2, "expected an operator"),
            ("(1", 2, "expected `)`"),
            ("1 / 0", 0, "not finite"),
            ("sqrt(0-1)", 0, "not finite"),
            ("min(sqrt(0-1), 0.5)", 0, "not finite"),
            ("max(0.5, 1, sqrt(0-1))", 0, "not finite"),
            ("random(1, sqrt(0-1))", 0, "not finite"),
            ("2 * radios", 4, "found `radios`"),
            ("sqr(2)", 0, "unknown function"),
            ("sqrt(1, 2)", 0, "takes 1 arguments, found 2"),
            ("min(1)", 0, "takes 2 to 8"),
            ("1..2", 0, "expected a number"),
            ("2 % 3", 2, "found `%`"),
        ] {
            let fault = evaluate(text, &One).unwrap_err();
            assert_eq!(fault.at, at, "{text}: {fault:?}");
            assert!(fault.what.contains(phrase), "{text}: {fault:?}");
        }
        assert_eq!(evaluate("radios", &One).unwrap_err().help.unwrap(), "did you mean `radius`?");
    }

    #[test]
    fn deep_and_long_expressions_end() {
        for deep in ["(".repeat(1_000_000), "-".repeat(1_000_000), "sqrt(".repeat(1_000_000)] {
            assert!(evaluate(&deep, &One).unwrap_err().what.contains("deeper than"));
        }
        let long = "1".to_string() + &"+1".repeat(1_000_000);
        assert_eq!(evaluate(&long, &One).unwrap(), 1_000_001.0);
    }
}
