use crate::color::Spectrum;
use crate::math::{Frame, Vec3};
use std::array::from_fn;

/// Irradiance record: the irradiance of indirect light at a point, with its gradients (Ward,
/// Rubinstein and Clear 1988; Ward and Heckbert 1992, "Irradiance Gradients").
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// Position in world space.
    pub p: Vec3,
    /// Unit normal, on the side of the incident light.
    pub n: Vec3,
    /// Distance at which the estimated relative error is 100 %, in scene units.
    pub radius: f32,
    /// Irradiance, W·m⁻².
    pub irradiance: Spectrum,
    /// Gradients of the irradiance.
    pub gradients: Gradients,
    /// Number of effective rays: `(Σ L)² / Σ L²` with the luminance L of each ray (Kish 1965). This
    /// number of rays with equal weights would have the same variance as the traced rays.
    pub effective_rays: f32,
}

/// Minimum number of effective rays of a reliable record. With fewer effective rays, the relative
/// standard error of the irradiance is above 1/6.
const FEW_RAYS: f32 = 36.0;

/// Gradients of irradiance, for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gradients {
    /// Gradients for rotations of the normal, per radian. The dot product with the axis of rotation
    /// is the change of irradiance.
    pub rotational: [Vec3; 3],
    /// Gradients for translations in the tangent plane, per scene unit. The dot product with the
    /// translation is the change of irradiance.
    pub translational: [Vec3; 3],
}

/// Maximum distance of a lookup point behind the surface of a record, relative to the reach of the
/// record. It is above 0 because curved surfaces consist of flat triangles.
const BEHIND: f32 = 0.1;

impl Record {
    /// Returns `true` if few of the record's rays found most of its light. These rays may have
    /// found a caustic that other records missed.
    pub fn is_doubtful(&self) -> bool {
        self.effective_rays < FEW_RAYS
    }

    /// Estimated relative error of the record at the point `p` with normal `n`. It is the distance
    /// divided by the radius, plus the square root of 1 minus the cosine of the angle between the
    /// normals (Ward et al. 1988, the bound of the split sphere model). `None` if the error is more
    /// than `max`. Also `None` if the point lies behind the record, because it then possibly sees
    /// other surfaces than the record.
    #[inline(always)]
    // ANCHOR: error
    pub fn error(&self, p: Vec3, n: Vec3, max: f32) -> Option<f32> {
        let d = p - self.p;
        let reach = max * self.radius;
        let squared = d.length_squared();
        if squared > reach * reach {
            return None;
        }
        let turn = (1.0 - n.dot(self.n)).max(0.0).sqrt();
        let error = squared.sqrt() / self.radius + turn;
        let is_behind = d.dot(n + self.n) < -2.0 * BEHIND * reach;
        (error < max && !is_behind).then_some(error)
    }
    // ANCHOR_END: error

    /// Irradiance of the record at the point `p` with normal `n`, extrapolated by its gradients
    /// (Ward and Heckbert 1992). May be negative.
    #[inline(always)]
    pub fn at(&self, p: Vec3, n: Vec3) -> Spectrum {
        let (axis, d) = (self.n.cross(n), p - self.p);
        let Gradients {
            rotational,
            translational,
        } = &self.gradients;
        let change = from_fn(|c| axis.dot(rotational[c]) + d.dot(translational[c]));
        self.irradiance + Spectrum::from(change)
    }
}

impl Gradients {
    /// Gradients in world space, from gradients in the local frame `frame`.
    pub fn to_world(self, frame: &Frame) -> Self {
        Self {
            rotational: self.rotational.map(|g| frame.to_world(g)),
            translational: self.translational.map(|g| frame.to_world(g)),
        }
    }

    /// Gradients with the translational gradients multiplied by `factor`.
    pub fn with_translation_scaled(self, factor: f32) -> Self {
        Self {
            translational: self.translational.map(|g| g * factor),
            ..self
        }
    }

    /// Maximum change of luminance by a translation, per scene unit.
    pub fn steepness(&self) -> f32 {
        self.of_luminance().length()
    }

    /// Translational gradient of the luminance of the irradiance, per scene unit.
    pub fn of_luminance(&self) -> Vec3 {
        let along = |axis: Vec3| Spectrum::from(self.translational.map(|g| g.dot(axis))).luminance();
        Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z))
    }
}
