//! Estimates of the irradiance from a light in a region, without visibility. `light_sampling`
//! chooses lights by these estimates.

use crate::math::Vec3;

/// Position, size and emission of one finite light, or of several finite lights treated as one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    /// Middle of the bounding sphere, world space.
    pub center: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// Luminance of the maximum radiant intensity over all directions, W/sr.
    pub intensity: f32,
    /// Mean of the directions of maximum emission, weighted by intensity. The mean is shorter if
    /// the directions differ.
    pub axis: Vec3,
    /// Bound on the error of a cosine if `axis` replaces the direction of a single light.
    pub spread: f32,
}

impl LightBounds {
    /// A light with equal emission in all directions. With its `axis` and `spread`, [`soft_cosine`]
    /// is 1 for every direction.
    pub fn isotropic(center: Vec3, intensity: f32) -> Self {
        Self {
            center,
            radius: 0.0,
            intensity,
            axis: Vec3::ZERO,
            spread: 4.0,
        }
    }

    /// Bounds of both sources together.
    pub fn and(&self, other: &Self) -> Self {
        let intensity = self.intensity + other.intensity;
        let t = if intensity > 0.0 {
            other.intensity / intensity
        } else {
            0.5
        };
        let mean = |a: Vec3, b: Vec3| a * (1.0 - t) + b * t;
        let center = mean(self.center, other.center);
        let reach = |s: &Self| s.center.distance(center) + s.radius;
        let axis = mean(self.axis, other.axis);
        // If the axis of one source is replaced by the mean axis, the error of a cosine is at most
        // the distance between both vectors.
        let spread = |s: &Self| s.spread + s.axis.distance(axis);
        Self {
            center,
            radius: reach(self).max(reach(other)),
            intensity,
            axis,
            spread: (1.0 - t) * spread(self) + t * spread(other),
        }
    }
}

/// Receiving points in a ball, with normals near one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceiverRegion {
    /// Centre of the bounding sphere of the points, in world space.
    pub center: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// Unit direction near the normals of the points. Zero if both sides of the surface receive
    /// light.
    pub normal: Vec3,
}

/// Bound on the error of the cosine if [`ReceiverRegion::normal`] replaces the true normal.
const NORMAL_SPREAD: f32 = 0.25;

impl ReceiverRegion {
    /// Mean of max(cos θ, 0). θ is the angle between `wi` and the normal of a point of the region.
    /// Different positions of points and light change cos θ by up to `spread`. Returns 1/2 if both
    /// sides receive light.
    pub fn cosine(&self, wi: Vec3, spread: f32) -> f32 {
        if self.normal == Vec3::ZERO {
            return 0.5;
        }
        soft_cosine(wi.dot(self.normal), spread + NORMAL_SPREAD)
    }

    /// Estimate of the mean irradiance from `source`, without shadows.
    pub fn irradiance(&self, source: &LightBounds) -> f32 {
        self.irradiance_by(source.center, source.radius, |wi, spread| {
            source.intensity * soft_cosine(-wi.dot(source.axis), spread + source.spread)
        })
    }

    /// Estimate of the mean irradiance from a spherical source with the given `center` and
    /// `radius`. The function `intensity` returns the intensity towards the region. It takes the
    /// direction to the source, and a bound on the error of a cosine with this direction.
    pub fn irradiance_by(&self, center: Vec3, radius: f32, intensity: impl FnOnce(Vec3, f32) -> f32) -> f32 {
        // The mean squared distance between points of two balls is larger than the squared distance
        // of their centres. `d` is divided by the square root of this mean. So `wi` is shorter than
        // 1, and near 0 if the centres are close.
        let d = center - self.center;
        let squared = d.length_squared() + 0.5 * (self.radius * self.radius + radius * radius);
        let inverse = 1.0 / squared.sqrt();
        let (wi, spread) = (d * inverse, (self.radius + radius) * inverse);
        intensity(wi, spread) * self.cosine(wi, spread) / squared
    }

    /// Angular radius of `source` as seen from the region, approximately: radius divided by
    /// distance.
    pub fn angle(&self, source: &LightBounds) -> f32 {
        let distance = self.center.distance(source.center).max(self.radius);
        if source.radius > 0.0 {
            source.radius / distance
        } else {
            0.0
        }
    }
}

/// Mean of `max(cos + x, 0)` for x uniform in [−spread, spread]: a clamped cosine with an uncertain
/// angle.
pub(crate) fn soft_cosine(cos: f32, spread: f32) -> f32 {
    if cos >= spread {
        cos
    } else if cos <= -spread {
        0.0
    } else {
        let x = cos + spread;
        x * x / (4.0 * spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn soft_cosines_are_means() {
        for (cos, spread) in [(0.7, 0.2), (0.1, 0.3), (-0.1, 0.3), (-0.5, 0.4), (0.0, 4.0), (0.3, 0.0)] {
            const N: u32 = 100_000;
            let x = |i| cos + spread * (2.0 * (i as f32 + 0.5) / N as f32 - 1.0);
            let mean = (0..N).map(|i| x(i).max(0.0) as f64).sum::<f64>() / N as f64;
            let got = soft_cosine(cos, spread) as f64;
            assert!((got - mean).abs() < 1e-4, "{cos} {spread}: {got} {mean}");
        }
    }
}
