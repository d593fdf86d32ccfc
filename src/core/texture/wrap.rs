use crate::math::encode_variants;

/// Extension of a picture beyond the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Repeats the picture.
    #[default]
    Repeat,
    /// Repeats the border texels.
    Clamp,
    /// Mirrors the picture at each edge, as `GL_MIRRORED_REPEAT`.
    Mirror,
}

encode_variants!(Wrap {
    0 => Repeat,
    1 => Clamp,
    2 => Mirror,
});

/// Numbers of this absolute value or more have no fraction in `f32`.
const WHOLE: f32 = 8_388_608.0;

impl Wrap {
    /// Position in the picture, in [0, 1], of the coordinate `x`. Arbitrary if `x` is not finite.
    pub(super) fn fold(self, x: f32) -> f32 {
        match self {
            Self::Repeat => fraction(x),
            // Use `max`, which returns 0 if x is NaN. `clamp` would return NaN.
            Self::Clamp => f32::max(x, 0.0).min(1.0),
            Self::Mirror => 1.0 - (1.0 - 2.0 * fraction(0.5 * x)).abs(),
        }
    }

    /// Returns the indices of the two texels whose centres are the neighbours of the folded
    /// coordinate `s`, in a row of `n` texels with centres at (i + ½) / n. The third value is the
    /// position of `s` between both centres, in [0, 1).
    pub(super) fn neighbors(self, s: f32, n: u32) -> (usize, usize, f32) {
        // Measure the position from the centre of the texel before the first texel. All positions
        // are then positive, so truncation equals the floor.
        let p = s * n as f32 + 0.5;
        let (high, last) = (p as i32, n as i32 - 1);
        let f = p - high as f32;
        // Beyond an edge of the picture, the neighbour is the texel at the opposite edge
        // (`Repeat`), or else the texel at the same edge.
        let (left, right) = if self == Self::Repeat { (last, 0) } else { (0, last) };
        let low = if high == 0 { left } else { last.min(high - 1) };
        let high = if high > last { right } else { high };
        (low as usize, high as usize, f)
    }
}

/// `x` minus its floor, in [0, 1]; 0 if `x` is too large to have a fraction, or not finite.
fn fraction(x: f32) -> f32 {
    if x.abs() < WHOLE {
        // Do not use `f32::floor`, which is a function call unless the target has SSE4.1.
        let rest = x - x as i32 as f32;
        if rest < 0.0 { rest + 1.0 } else { rest }
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folding_equals_its_definition() {
        for i in -4000..4000 {
            let x = i as f32 * 0.003_91;
            let wide = x as f64;
            let near = |wrap: Wrap, expected: f64| {
                let got = wrap.fold(x) as f64;
                assert!(
                    (got - expected).abs() < 1e-6,
                    "{wrap:?} of {x} is {got}, not {expected}"
                );
            };
            near(Wrap::Repeat, wide - wide.floor());
            near(Wrap::Clamp, wide.clamp(0.0, 1.0));
            near(Wrap::Mirror, (wide - 2.0 * (wide / 2.0).round()).abs());
        }
        let odd = [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            3e38,
            -3e38,
            3e9,
            -3e9,
            -1e-30,
            8_388_607.5,
        ];
        for x in odd {
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                let s = wrap.fold(x);
                assert!((0.0..=1.0).contains(&s), "{wrap:?} of {x} is {s}");
            }
        }
    }

    #[test]
    fn neighbors_are_within_any_width() {
        let wraps = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
        for n in [1, 2, 3, 1000, 1 << 24, (1 << 28) - 1, 1 << 28] {
            for s in [0.0, 1e-9, 0.25, 0.5, 0.999_999_94, 1.0] {
                for wrap in wraps {
                    let (low, high, f) = wrap.neighbors(s, n);
                    assert!(
                        low < n as usize && high < n as usize,
                        "{wrap:?} {s} of {n}: {low} {high}"
                    );
                    assert!((0.0..1.0).contains(&f), "{wrap:?} {s} of {n}: {f}");
                }
            }
        }
        assert_eq!(Wrap::Repeat.neighbors(0.0, 4), (3, 0, 0.5));
        assert_eq!(Wrap::Repeat.neighbors(1.0, 4), (3, 0, 0.5));
        assert_eq!(Wrap::Clamp.neighbors(0.0, 4), (0, 0, 0.5));
        assert_eq!(Wrap::Mirror.neighbors(1.0, 4), (3, 3, 0.5));
        assert_eq!(Wrap::Clamp.neighbors(0.5, 4), (1, 2, 0.5));
    }
}
