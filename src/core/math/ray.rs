use super::Vec3;

/// A ray segment: the points `origin + t · direction` with `t` in the open interval `(t_min,
/// t_max)`.
///
/// `direction` need not be a unit vector; `t` is in lengths of `direction`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start of the ray in world space.
    pub origin: Vec3,
    /// Direction, in world space.
    pub direction: Vec3,
    /// Lower end of the open interval of `t`, ≥ 0.
    pub t_min: f32,
    /// Upper end of the open interval of `t`, possibly infinite.
    pub t_max: f32,
    /// Time, from 0 to 1, which sets the positions of moving objects.
    pub time: f32,
    /// Index, in the scene, of the absorbing body in which the ray starts; 0 outside of all bodies.
    pub body: u32,
}

impl Ray {
    /// Unbounded ray from `origin` along `direction`, at time 0.
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

    /// Returns this ray with the time `time`.
    #[inline(always)]
    pub fn when(self, time: f32) -> Self {
        Self { time, ..self }
    }

    /// Returns this ray with a start inside the absorbing body `body`.
    #[inline(always)]
    pub fn within(self, body: u32) -> Self {
        Self { body, ..self }
    }

    /// Point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }

    /// Bits of origin, direction, `t_min`, `t_max` and time, to store a ray exactly. The hits of
    /// the ray depend on nothing else.
    pub fn bits(&self) -> [u32; 9] {
        let ([a, b, c], [d, e, f]) = (self.origin.to_array(), self.direction.to_array());
        [a, b, c, d, e, f, self.t_min, self.t_max, self.time].map(f32::to_bits)
    }

    /// Ray with these [`Ray::bits`].
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
