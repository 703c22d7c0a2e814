//! Numbers by KDL's grammar.

/// Whether `s` begins with a decimal digit.
pub fn starts_with_digit(s: &str) -> bool {
    s.starts_with(|c: char| c.is_ascii_digit())
}

/// The number written as `word`, by KDL's grammar: decimal, `0x`, `0o` or `0b`, with `_` between digits.
pub fn number_from(word: &str) -> Option<f64> {
    let (sign, digits) = match word.as_bytes().first()? {
        b'-' => (-1.0, &word[1..]),
        b'+' => (1.0, &word[1..]),
        _ => (1.0, word),
    };
    for (prefix, radix) in [("0x", 16), ("0o", 8), ("0b", 2)] {
        if let Some(digits) = digits.strip_prefix(prefix) {
            return in_radix(digits, radix).map(|v| sign * v);
        }
    }
    is_decimal(digits).then(|| digits.replace('_', "").parse::<f64>().ok()).flatten().map(|v| sign * v)
}

fn in_radix(digits: &str, radix: u32) -> Option<f64> {
    if digits.starts_with('_') || digits.is_empty() {
        return None;
    }
    let mut value = 0.0;
    for c in digits.chars().filter(|&c| c != '_') {
        value = value * f64::from(radix) + f64::from(c.to_digit(radix)?);
    }
    Some(value)
}

/// `integer ('.' integer)? ([eE] sign? integer)?` with `integer := digit (digit | '_')*`.
fn is_decimal(word: &str) -> bool {
    let integer = |s: &str| starts_with_digit(s) && s.bytes().all(|b| b.is_ascii_digit() || b == b'_');
    let (mantissa, exponent) = match word.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (word, None),
    };
    let exponent_ok = exponent.is_none_or(|e| integer(e.strip_prefix(['+', '-']).unwrap_or(e)));
    let mantissa_ok = match mantissa.split_once('.') {
        Some((whole, fraction)) => integer(whole) && integer(fraction),
        None => integer(mantissa),
    };
    exponent_ok && mantissa_ok
}
