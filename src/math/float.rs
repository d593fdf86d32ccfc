//! Bounds on rounding errors (Higham 2002, ch. 3; in rendering: PBR4 §6.8).

/// Largest relative error of one correctly rounded `f32` operation, 2⁻²⁴.
pub const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// `γₙ = n u / (1 − n u)`: bounds the relative error of `n` chained roundings.
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * UNIT_ROUNDOFF;
    nu / (1.0 - nu)
}

/// The largest `f32` below 1: what a uniform variate is clamped to where it must stay under 1.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - UNIT_ROUNDOFF;

/// The next `f32` above a finite `x`.
pub fn next_up(x: f32) -> f32 {
    let bits = x.to_bits();
    if x == 0.0 {
        f32::from_bits(1)
    } else if x.is_sign_positive() {
        f32::from_bits(bits + 1)
    } else {
        f32::from_bits(bits - 1)
    }
}

/// The next `f32` below a finite `x`.
pub fn next_down(x: f32) -> f32 {
    -next_up(-x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_enclose_the_number() {
        for x in [0.0, -0.0, 1.0, -1.0, 1e-40, -1e-40, 3.4e38, -0.5] {
            assert!(next_up(x) > x && next_down(x) < x, "{x}");
            assert_eq!(next_down(next_up(x)), x);
        }
        assert_eq!(next_down(1.0), ONE_MINUS_EPSILON);
    }

    #[test]
    fn gamma_is_just_over_n_roundings() {
        assert!(gamma(3) > 3.0 * UNIT_ROUNDOFF);
        assert!(gamma(3) < 3.001 * UNIT_ROUNDOFF);
    }
}
