//! Sine, cosine and arc tangent of `f32` by Taylor series over short intervals.
//!
//! The results are bit-identical on all machines, unlike the results of the system's mathematical
//! library. The series also need no branches. For random angles, the processor could not predict
//! branches.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_8, PI};

/// Sine and cosine of `x`, for `|x| ≤ π/4`. The error is one or two units in the last place.
#[inline(always)]
pub fn sin_cos_eighth_turn(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = x * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362_880.0)))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    (sin, cos)
}

/// Sine and cosine of an angle of `turns` full turns, at most 10⁶. The error is below 1.5e-7.
#[inline(always)]
pub fn sin_cos_turns(turns: f32) -> (f32, f32) {
    /// 1.5 · 2²³. If a small number is added to this constant, the sum is rounded to a whole
    /// number.
    const WHOLE: f32 = 12_582_912.0;
    // Split the angle into a whole number of quarter turns and a rest. The whole number is the
    // nearest one; it is in the lowest bits of `shifted`. The rest is computed exactly, as a
    // fraction of a quarter turn.
    let quarters = 4.0 * turns;
    let shifted = quarters + WHOLE;
    let (sin, cos) = sin_cos_eighth_turn(FRAC_PI_2 * (quarters - (shifted - WHOLE)));
    // A quarter turn maps (cos, sin) to (−sin, cos).
    let quarter = shifted.to_bits();
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swapped = (sin ^ cos) & (quarter & 1).wrapping_neg();
    let sin = sin ^ swapped ^ ((quarter & 2) << 30);
    let cos = cos ^ swapped ^ ((quarter.wrapping_add(1) & 2) << 30);
    (f32::from_bits(sin), f32::from_bits(cos))
}

/// Angle of the point `(x, y)` from the x axis, in [−π, π], as in `f32::atan2` for finite numbers.
/// The error is below 4e-7, and below 2e-7 for angles under π/8. The angle of the origin is 0.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    /// Tangents of π/16, π/8 and 3π/16.
    const TAN: [f32; 3] = [0.198_912_37, 0.414_213_57, 0.668_178_6];
    let (across, along) = (y.abs(), x.abs());
    let (less, more) = (across.min(along), across.max(along));
    // Rotate back by the nearest multiple of π/8. The absolute value of the remaining angle is at
    // most π/16.
    let eighths = usize::from(less > TAN[0] * more) + usize::from(less > TAN[2] * more);
    let tan = [0.0, TAN[1], 1.0][eighths];
    let t = (less - tan * more) / (more + tan * less).max(f32::MIN_POSITIVE);
    let t2 = t * t;
    let series = 1.0 + t2 * (-1.0 / 3.0 + t2 * (1.0 / 5.0 + t2 * (-1.0 / 7.0 + t2 * (1.0 / 9.0))));
    let angle = t * series + FRAC_PI_8 * eighths as f32;
    // If |y| > |x|, replace the angle by π/2 − angle. Then, if x < 0, replace the angle by π −
    // angle.
    let mirrored = |angle: f32, is_past: bool, whole: f32| {
        let sign = u32::from(is_past) << 31;
        [0.0, whole][usize::from(is_past)] + f32::from_bits(angle.to_bits() ^ sign)
    };
    let angle = mirrored(angle, across > along, FRAC_PI_2);
    let angle = mirrored(angle, x < 0.0, PI);
    angle.copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_4;
    use std::f64::consts::TAU;

    fn differ(found: (f32, f32), angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        (f64::from(found.0) - sin).abs().max((f64::from(found.1) - cos).abs())
    }

    #[test]
    fn sines_and_cosines() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as f32 / 1000.0;
            assert!(differ(sin_cos_eighth_turn(x), x.into()) < 1.2e-7, "{x}");
        }
        for i in -20_000..=40_000 {
            let turns = i as f32 / 10_000.0;
            let error = differ(sin_cos_turns(turns), TAU * f64::from(turns));
            assert!(error < 1.5e-7, "{turns}: {error}");
        }
        assert_eq!(sin_cos_turns(0.0), (0.0, 1.0));
        assert_eq!(sin_cos_turns(0.25), (1.0, 0.0));
    }

    #[test]
    fn arc_tangents() {
        for i in 0..=80_000 {
            let (sin, cos) = (TAU * f64::from(i) / 80_000.0).sin_cos();
            for scale in [1e-18, 0.3, 1e18] {
                let (y, x) = ((scale * sin) as f32, (scale * cos) as f32);
                let expected = f64::from(y).atan2(f64::from(x));
                let error = (f64::from(atan2(y, x)) - expected).abs();
                assert!(error < 4e-7, "{y} {x}: {error}");
                if expected.abs() < 0.39 {
                    assert!(error <= 2e-7 * expected.abs(), "{y} {x}: {error}");
                }
            }
        }
        for (y, x, expected) in [
            (0.0, 1.0, 0.0),
            (0.0, -1.0, PI),
            (-2.0, 0.0, -FRAC_PI_2),
            (0.0, 0.0, 0.0),
        ] {
            assert_eq!(atan2(y, x), expected, "{y} {x}");
        }
    }
}
