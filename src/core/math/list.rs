/// Numbers in brackets, in their shortest form: `[1, 0.5, NaN]`.
pub fn list(values: &[f32]) -> String {
    let values: Vec<String> = values.iter().map(f32::to_string).collect();
    format!("[{}]", values.join(", "))
}

/// Text of a number with at most six significant digits, without trailing zeros. The text of the
/// `f32` nearest to 0.04 is `0.04`, and that of 1 is `1`.
pub fn rounded(value: f64) -> String {
    significant(value, 6)
}

/// Text of a number with at most `digits` significant digits, without an exponent and without
/// trailing zeros.
pub fn significant(value: f64, digits: usize) -> String {
    let after_first = digits.saturating_sub(1);
    let decimal = format!("{value:.after_first$e}");
    decimal.parse().unwrap_or(value).to_string()
}

/// [`list`] of numbers formatted by [`rounded`].
pub fn rounded_list(values: &[f32]) -> String {
    let values: Vec<String> = values.iter().map(|value| rounded((*value).into())).collect();
    format!("[{}]", values.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, expected) in [
            (f64::from(0.04_f32 + 3e-9), "0.04"),
            (f64::from(0.588_235_3_f32), "0.588235"),
            (1.0, "1"),
            (200.0, "200"),
            (-2.5e-7, "-0.00000025"),
            (0.0, "0"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(rounded(value), expected);
        }
        assert_eq!(significant(4.0213, 4), "4.021");
        assert_eq!(significant(0.000_123_45, 3), "0.000123");
        assert_eq!(significant(1234.5, 2), "1200");
        assert_eq!(rounded_list(&[0.1, 1.0]), "[0.1, 1]");
    }
}
