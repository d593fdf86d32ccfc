//! Limits of `f32`, and bounds on rounding errors (Higham 2002, ch. 3; in rendering: PBR4 §6.8).

/// Maximum relative error of one correctly rounded `f32` operation, 2⁻²⁴.
pub const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// Largest `f32` below 1, 1 − 2⁻²⁴: the maximum of random numbers in [0, 1).
pub const ALMOST_ONE: f32 = 1.0 - UNIT_ROUNDOFF;

/// `γₙ = n u / (1 − n u)`: bound on the relative error of `n` chained roundings.
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * UNIT_ROUNDOFF;
    nu / (1.0 - nu)
}

/// Smooth step: 0 for `t` below 0, 1 for `t` above 1, and `3 t² − 2 t³` in between.
pub fn smooth_step(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gamma_is_just_over_n_roundings() {
        assert!(gamma(3) > 3.0 * UNIT_ROUNDOFF);
        assert!(gamma(3) < 3.001 * UNIT_ROUNDOFF);
    }
}
