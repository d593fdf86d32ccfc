use super::Vec3;

/// A ray segment: the points `origin + t · direction` with `t` in the open interval `(t_min, t_max)`.
///
/// `direction` need not be a unit vector; `t` counts in its lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in world space.
    pub origin: Vec3,
    /// Direction, in world space.
    pub direction: Vec3,
    /// Lower end of the open interval of `t`, ≥ 0.
    pub t_min: f32,
    /// Upper end of the open interval of `t`, possibly infinite.
    pub t_max: f32,
    /// Time, from 0 to 1, at which the ray meets moving objects.
    pub time: f32,
    /// The body that the ray starts in, where light is absorbed: a number by which the scene knows it, 0 outside.
    pub body: u32,
}

impl Ray {
    /// The unbounded ray from `origin` along `direction`, at time 0.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min: 0.0,
            t_max: f32::INFINITY,
            time: 0.0,
            body: 0,
        }
    }

    /// The ray at another time.
    #[inline(always)]
    pub fn when(self, time: f32) -> Self {
        Self { time, ..self }
    }

    /// The ray from within a body.
    #[inline(always)]
    pub fn within(self, body: u32) -> Self {
        Self { body, ..self }
    }

    /// The point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }

    /// The bits of origin, direction, `t_min`, `t_max` and time: a ray that is written down must come back as it was. What it meets depends on nothing else.
    pub fn bits(&self) -> [u32; 9] {
        let ([a, b, c], [d, e, f]) = (self.origin.to_array(), self.direction.to_array());
        [a, b, c, d, e, f, self.t_min, self.t_max, self.time].map(f32::to_bits)
    }

    /// The ray whose [`Ray::bits`] these are.
    pub fn from_bits(bits: [u32; 9]) -> Self {
        let [a, b, c, d, e, f, t_min, t_max, time] = bits.map(f32::from_bits);
        Self {
            origin: Vec3::new(a, b, c),
            direction: Vec3::new(d, e, f),
            t_min,
            t_max,
            time,
            body: 0,
        }
    }
}
