use super::Vec3;

/// An axis-aligned box in world space; empty while `min > max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds3 {
    /// Corner with the smallest coordinates.
    pub min: Vec3,
    /// Corner with the largest coordinates.
    pub max: Vec3,
}

impl Bounds3 {
    /// Empty box; the identity of [`Bounds3::extend`].
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Grows the box to include `p`.
    pub fn extend(&mut self, p: Vec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// Smallest box that contains this box and `other`.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Returns true if the box contains no point.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Centre of the box; the origin for an empty box.
    pub fn center(&self) -> Vec3 {
        if self.is_empty() {
            Vec3::ZERO
        } else {
            // Halve the corners before the sum, so that corners near f32::MAX do not overflow.
            0.5 * self.min + 0.5 * self.max
        }
    }

    /// The eight corners. Bit `axis` of a corner's index selects the minimum (0) or the maximum (1)
    /// coordinate along that axis.
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let [x, y, z] = [0, 1, 2].map(|axis| {
                if i >> axis & 1 == 0 {
                    self.min[axis]
                } else {
                    self.max[axis]
                }
            });
            Vec3::new(x, y, z)
        })
    }

    /// Radius of the sphere around [`Bounds3::center`] that contains the box; 0 for an empty box.
    pub fn radius(&self) -> f32 {
        if self.is_empty() {
            0.0
        } else {
            (0.5 * self.max - 0.5 * self.min).length()
        }
    }
}

impl FromIterator<Vec3> for Bounds3 {
    fn from_iter<I: IntoIterator<Item = Vec3>>(points: I) -> Self {
        let mut bounds = Self::EMPTY;
        for p in points {
            bounds.extend(p);
        }
        bounds
    }
}
