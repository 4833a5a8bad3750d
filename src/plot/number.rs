//! Numbers as people read them.

/// Significant digits.
const DIGITS: i32 = 3;
/// Numbers in this range are written out, others with a power of ten.
const WRITTEN_OUT: [f64; 2] = [1e-3, 1e5];

/// Three significant digits: `0.00123`, `12.3`, `1234`, `1.2e-7`; `0` only for zero.
pub fn three(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(WRITTEN_OUT[0]..WRITTEN_OUT[1]).contains(&value.abs()) {
        return power(value);
    }
    let whole_digits = libm::floor(libm::log10(value.abs())) as i32 + 1;
    format!("{value:.*}", (DIGITS - whole_digits).max(0) as usize)
}

/// With a power of ten, without trailing zeros in the number before it.
pub(crate) fn power(value: f64) -> String {
    let text = format!("{value:.2e}");
    match text.split_once('e') {
        Some((number, exponent)) => format!("{}e{exponent}", trimmed(number)),
        None => text,
    }
}

/// A number with decimals, without trailing zeros.
pub(crate) fn trimmed(number: &str) -> &str {
    number.trim_end_matches('0').trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_count_at_every_size() {
        let told = [
            0.0,
            0.001_234_9,
            0.5,
            9.876,
            12.34,
            123.4,
            1234.5,
            1e5,
            1.2e-7,
            -0.25,
            f64::INFINITY,
        ]
        .map(three);
        let right = [
            "0", "0.00123", "0.500", "9.88", "12.3", "123", "1234", "1e5", "1.2e-7", "-0.250",
            "inf",
        ];
        assert_eq!(told, right);
    }
}
