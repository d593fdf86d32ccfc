use crate::math::Encode;
use glam::Vec3A;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

/// A spectral quantity (radiance, reflectance, throughput) as three linear Rec.709 values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spectrum(Vec3A);

impl Spectrum {
    /// Black.
    pub const ZERO: Self = Self(Vec3A::ZERO);
    /// White: 1 in every channel.
    pub const ONE: Self = Self(Vec3A::ONE);

    /// Spectrum of linear Rec.709 red, green and blue.
    pub const fn rgb(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3A::new(r, g, b))
    }

    /// Spectrum with `value` in all channels.
    pub const fn splat(value: f32) -> Self {
        Self(Vec3A::splat(value))
    }

    /// Linear Rec.709 red, green and blue.
    pub fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }

    /// Maximum of `self` and `other`, by channel.
    pub fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// Maximum over the channels.
    pub fn max_component(self) -> f32 {
        self.0.max_element()
    }

    /// Mean of the channels.
    pub fn mean(self) -> f32 {
        self.0.element_sum() * (1.0 / 3.0)
    }

    /// Relative luminance Y of Rec.709 primaries (ITU-R BT.709).
    pub fn luminance(self) -> f32 {
        self.0.dot(Vec3A::new(0.2126, 0.7152, 0.0722))
    }

    /// Returns true if every channel is exactly zero.
    pub fn is_black(self) -> bool {
        self.0 == Vec3A::ZERO
    }

    /// Returns true if no channel is NaN, infinite or negative.
    pub fn is_valid(self) -> bool {
        self.0.is_finite() && self.0.min_element() >= 0.0
    }
}

impl Encode for Spectrum {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.to_array().encode(sink);
    }
}

impl From<[f32; 3]> for Spectrum {
    fn from(rgb: [f32; 3]) -> Self {
        Self(Vec3A::from_array(rgb))
    }
}

impl Add for Spectrum {
    type Output = Self;
    fn add(self, rhs: Self) -> Self {
        Self(self.0 + rhs.0)
    }
}

impl AddAssign for Spectrum {
    fn add_assign(&mut self, rhs: Self) {
        self.0 += rhs.0;
    }
}

impl Sub for Spectrum {
    type Output = Self;
    fn sub(self, rhs: Self) -> Self {
        Self(self.0 - rhs.0)
    }
}

impl Mul for Spectrum {
    type Output = Self;
    fn mul(self, rhs: Self) -> Self {
        Self(self.0 * rhs.0)
    }
}

impl Mul<f32> for Spectrum {
    type Output = Self;
    fn mul(self, rhs: f32) -> Self {
        Self(self.0 * rhs)
    }
}

impl MulAssign for Spectrum {
    fn mul_assign(&mut self, rhs: Self) {
        self.0 *= rhs.0;
    }
}

impl MulAssign<f32> for Spectrum {
    fn mul_assign(&mut self, rhs: f32) {
        self.0 *= rhs;
    }
}

impl Div<f32> for Spectrum {
    type Output = Self;
    fn div(self, rhs: f32) -> Self {
        Self(self.0 / rhs)
    }
}

/// Relative luminance Y of linear Rec.709 `rgb` in double precision (ITU-R BT.709).
pub fn luminance(rgb: [f64; 3]) -> f64 {
    rgb.iter()
        .zip([0.2126, 0.7152, 0.0722])
        .map(|(value, weight)| value * weight)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn validity_is_per_channel() {
        assert!(Spectrum::rgb(0.0, 1.0, 2.0).is_valid());
        assert!(!Spectrum::rgb(0.0, -1.0, 2.0).is_valid());
        assert!(!Spectrum::rgb(f32::NAN, 1.0, 2.0).is_valid());
        assert!(!Spectrum::rgb(0.0, 1.0, f32::INFINITY).is_valid());
    }

    #[test]
    fn white_has_unit_luminance() {
        assert!((Spectrum::ONE.luminance() - 1.0).abs() < 1e-6);
    }
}
