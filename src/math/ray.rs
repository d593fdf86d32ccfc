use super::Vec3;

/// A ray segment: the points `origin + t · direction` with `t` in the open interval `(t_min, t_max)`.
///
/// `direction` need not be a unit vector; `t` counts in its lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in world space.
    pub origin: Vec3,
    /// Where it goes, in world space.
    pub direction: Vec3,
    /// Lower end of the open interval of `t`, ≥ 0.
    pub t_min: f32,
    /// Upper end of the open interval of `t`, possibly infinite.
    pub t_max: f32,
}

impl Ray {
    /// The unbounded ray from `origin` along `direction`.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min: 0.0,
            t_max: f32::INFINITY,
        }
    }
}
