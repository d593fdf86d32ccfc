//! Environments: latitude-longitude images as lights.

use super::{Emission, LightSample};
use crate::color::Spectrum;
use crate::math::{Ball, Encode, Quat, Vec2, Vec3, atan2, encode_fields, float::ALMOST_ONE, sin_cos_turns};
use crate::sampling::distribution::Distribution2D;
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

/// Colours on the sphere of directions as a latitude-longitude image.
///
/// The top row is +y. The middle of the image is −z, the view direction of a camera without
/// rotation, and +x is to the right of −z.
#[derive(Clone, Debug, PartialEq)]
pub struct LatLongImage {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Row by row from the top, `width · height` colours.
    pub texels: Vec<Spectrum>,
}

/// Environment light: radiance from infinitely far away, given by a latitude-longitude image.
#[derive(Clone, Debug)]
pub struct EnvironmentLight {
    /// Image, shared by lights with the same image.
    image: Arc<LatLongImage>,
    /// Factor from the image's colours to radiance, W·sr⁻¹·m⁻².
    scale: f32,
    /// Rotation from the image's frame to world space.
    rotation: Quat,
    /// Distribution over the image, shared like the image.
    distribution: Arc<Distribution2D>,
    /// Mean colour of the image over the sphere.
    mean: Spectrum,
    /// Source of the image. It does not affect the light.
    kind: EnvironmentKind,
}

/// Source of the image of an environment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EnvironmentKind {
    /// Picture from a file or from the program's own code.
    #[default]
    Picture,
    /// A model of the daylight sky.
    Sky,
    /// The lamps of a studio.
    Studio,
}

impl EnvironmentKind {
    /// Type of the light, as users write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Picture => "environment",
            Self::Sky => "sky",
            Self::Studio => "studio",
        }
    }
}

encode_fields!(LatLongImage { width, height, texels });

impl Encode for EnvironmentLight {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        // Leave out fields that follow from the encoded fields, or do not affect the light.
        let Self {
            image,
            scale,
            rotation,
            distribution: _,
            mean: _,
            kind: _,
        } = self;
        image.encode(sink);
        scale.encode(sink);
        rotation.encode(sink);
    }
}

impl EnvironmentLight {
    /// The light of `image` times `scale`, rotated by `rotation`.
    ///
    /// # Panics
    /// If the image is empty or incomplete; image readers check this.
    pub fn new(image: LatLongImage, scale: f32, rotation: Quat) -> Self {
        assert_eq!(image.texels.len(), image.width * image.height);
        // The distribution is proportional to luminance × sin θ. The weight of a texel is the mean
        // of the interpolated image over the texel, so that no direction with light has density 0.
        let (width, height) = (image.width, image.height);
        let mut weights = Vec::with_capacity(image.texels.len());
        let (mut sum, mut total) = ([0.0f64; 3], 0.0);
        for y in 0..height {
            let sin = (PI * (y as f32 + 0.5) / height as f32).sin();
            for x in 0..width {
                let texel = image.smoothed(x, y);
                weights.push(texel.luminance() * sin);
                for (s, v) in sum.iter_mut().zip(texel.to_array()) {
                    *s += v as f64 * sin as f64;
                }
                total += sin as f64;
            }
        }
        Self {
            distribution: Arc::new(Distribution2D::new(&weights, width)),
            mean: Spectrum::from(sum.map(|s| (s / total) as f32)),
            image: Arc::new(image),
            scale,
            rotation,
            kind: EnvironmentKind::Picture,
        }
    }

    /// A light with the same image, times `scale`, rotated by `rotation`. Both lights share the
    /// image and its distribution.
    pub(crate) fn placed(&self, scale: f32, rotation: Quat) -> Self {
        Self {
            scale,
            rotation,
            ..self.clone()
        }
    }

    /// Returns the light with the source of its image set to `kind`.
    pub fn of_kind(self, kind: EnvironmentKind) -> Self {
        Self { kind, ..self }
    }

    /// Source of the image.
    pub fn kind(&self) -> EnvironmentKind {
        self.kind
    }

    /// The image.
    pub fn image(&self) -> &LatLongImage {
        &self.image
    }

    /// Factor from the image's colours to radiance, and rotation from the image's frame to world
    /// space.
    pub fn placement(&self) -> (f32, Quat) {
        (self.scale, self.rotation)
    }

    /// Radiance from the unit direction `wi`.
    pub fn radiance(&self, wi: Vec3) -> Spectrum {
        self.image.interpolated(place(self.rotation.inverse() * wi)) * self.scale
    }

    /// Columns and rows of the image.
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.image.width, self.image.height]
    }

    /// Unit direction at the image coordinates `s` (0 at the left, 1 at the right) and `t` (0 at
    /// the top, 1 at the bottom), and the radiance from this direction.
    pub(crate) fn at(&self, s: f64, t: f64) -> (Vec3, Spectrum) {
        let st = Vec2::new(s as f32, t as f32);
        (self.rotation * direction(st), self.image.interpolated(st) * self.scale)
    }

    /// Image coordinates, in [0, 1)², of the unit direction `wi`.
    pub(crate) fn place_of(&self, wi: Vec3) -> Vec2 {
        place(self.rotation.inverse() * wi)
    }

    /// Distribution over the image from which directions are sampled.
    pub(crate) fn distribution(&self) -> &Distribution2D {
        &self.distribution
    }

    /// Samples a direction in proportion to its luminance.
    pub(super) fn sample(&self, u: Vec2) -> Option<LightSample> {
        let (st, pdf) = self.distribution.sample(u);
        self.sample_at(st, pdf)
    }

    /// Light from the image point `st`, sampled with the density `pdf` over the image.
    pub(crate) fn sample_at(&self, st: Vec2, pdf: f32) -> Option<LightSample> {
        let w = direction(st);
        let wi = self.rotation * w;
        let pdf = pdf * solid_angle_jacobian(w);
        (pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            wi,
            radiance: self.image.interpolated(st) * self.scale,
            pdf,
            is_delta: false,
            target: None,
        })
    }

    /// Samples the start of a light path that enters `world`, the ball around the scene. The
    /// direction is sampled in proportion to its luminance.
    pub(super) fn sample_emission(&self, u_position: Vec2, u_direction: Vec2, world: &Ball) -> Option<Emission> {
        let LightSample { wi, radiance, pdf, .. } = self.sample(u_direction)?;
        Some(Emission::from_infinity(-wi, radiance, pdf, u_position, world))
    }

    /// Density per solid angle with which the direction `wi` is sampled.
    pub fn pdf(&self, wi: Vec3) -> f32 {
        let w = self.rotation.inverse() * wi;
        let pdf = self.distribution.pdf(place(w)) * solid_angle_jacobian(w);
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// Power in watts through a sphere of the scene's radius: `4π · π r² L`. L is the mean radiance
    /// over the sphere of directions.
    pub(super) fn power(&self, scene_radius: f32) -> f64 {
        let r = scene_radius as f64;
        4.0 * (std::f64::consts::PI * r).powi(2) * (self.mean * self.scale).luminance() as f64
    }

    /// Bytes of image and distribution.
    pub fn bytes(&self) -> usize {
        size_of_val(self.image.texels.as_slice()) + self.distribution.bytes()
    }
}

/// Direction at `st` in [0, 1)² of the image.
fn direction(st: Vec2) -> Vec3 {
    // The azimuth from −z is `st.x` − ½ turns. The half turn flips the signs of sine and cosine.
    let (sin_phi, cos_phi) = sin_cos_turns(st.x);
    let (sin_theta, cos_theta) = sin_cos_turns(0.5 * st.y);
    Vec3::new(-sin_theta * sin_phi, cos_theta, sin_theta * cos_phi)
}

/// Image coordinates, in [0, 1)², of the direction `w` in the image's frame.
fn place(w: Vec3) -> Vec2 {
    let s = 0.5 + atan2(w.x, -w.z) * (0.5 * FRAC_1_PI);
    // `atan2` is accurate near the poles, unlike an arc cosine.
    let t = atan2((w.x * w.x + w.z * w.z).sqrt(), w.y) * FRAC_1_PI;
    Vec2::new(if s >= 1.0 { 0.0 } else { s.max(0.0) }, t.min(ALMOST_ONE))
}

/// Factor from density over the image to density over solid angle, at the direction `w` in the
/// image's frame: `1 / (2 π² sin θ)`.
fn solid_angle_jacobian(w: Vec3) -> f32 {
    1.0 / (2.0 * PI * PI * w.x.hypot(w.z))
}

impl LatLongImage {
    /// The texel in column `x` and row `y`. Columns wrap around, and rows are clamped.
    fn texel(&self, x: isize, y: isize) -> Spectrum {
        let x = x.rem_euclid(self.width as isize) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self.texels[y * self.width + x]
    }

    /// Bilinear interpolation between texel centres.
    fn interpolated(&self, st: Vec2) -> Spectrum {
        let p = st * Vec2::new(self.width as f32, self.height as f32) - 0.5;
        let base = p.floor();
        let (x, y, f) = (base.x as isize, base.y as isize, p - base);
        let row = |y| self.texel(x, y) * (1.0 - f.x) + self.texel(x + 1, y) * f.x;
        row(y) * (1.0 - f.y) + row(y + 1) * f.y
    }

    /// Mean of the interpolated image over a texel. Along each axis, the weight is 6/8 for the
    /// texel and 1/8 for each of its two neighbours.
    fn smoothed(&self, x: usize, y: usize) -> Spectrum {
        let (x, y) = (x as isize, y as isize);
        let row = |y| (self.texel(x - 1, y) + self.texel(x + 1, y)) * 0.125 + self.texel(x, y) * 0.75;
        (row(y - 1) + row(y + 1)) * 0.125 + row(y) * 0.75
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    /// An image of 8 × 4 texels: white in column 2, the left quarter of the front half, and black
    /// elsewhere.
    fn stripe() -> LatLongImage {
        let (width, height) = (8, 4);
        let texels = (0..width * height).map(|i| if i % width == 2 { Spectrum::ONE } else { Spectrum::ZERO });
        LatLongImage {
            width,
            height,
            texels: texels.collect(),
        }
    }

    #[test]
    fn directions_and_places_agree() {
        for st in [Vec2::new(0.1, 0.2), Vec2::new(0.5, 0.5), Vec2::new(0.93, 0.8)] {
            assert!(place(direction(st)).distance(st) < 1e-5, "{st}");
        }
        assert!(direction(Vec2::new(0.5, 0.5)).distance(Vec3::NEG_Z) < 1e-6);
        assert!(direction(Vec2::new(0.75, 0.5)).distance(Vec3::X) < 1e-6);
        assert!(direction(Vec2::new(0.3, 0.0)).distance(Vec3::Y) < 1e-6);
    }

    #[test]
    fn rotation_moves_the_image() {
        // Column 2 of 8 has its centre at s = 2.5 / 8: 67.5° left of −z.
        let angle = (0.5 - 2.5 / 8.0) * TAU;
        let seen = |rotation, towards: Vec3| {
            EnvironmentLight::new(stripe(), 2.0, rotation)
                .radiance(towards)
                .max_component()
        };
        let at = |angle: f32| Vec3::new(-angle.sin(), 0.0, -angle.cos());
        assert!((seen(Quat::IDENTITY, at(angle)) - 2.0).abs() < 1e-5);
        assert_eq!(seen(Quat::IDENTITY, at(-angle)), 0.0);
        // A quarter turn about +y takes −z to −x: further left.
        let quarter = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
        assert!((seen(quarter, at(angle + std::f32::consts::FRAC_PI_2)) - 2.0).abs() < 1e-5);
    }

    #[test]
    fn the_mean_of_a_constant_image_is_its_value() {
        let image = LatLongImage {
            texels: vec![Spectrum::splat(0.5); 32],
            ..stripe()
        };
        let light = EnvironmentLight::new(image, 3.0, Quat::IDENTITY);
        assert!(((light.mean * light.scale).max_component() - 1.5).abs() < 1e-5);
        let constant = super::super::ConstantLight {
            radiance: Spectrum::splat(1.5),
        };
        assert!((light.power(2.0) / constant.power(2.0) - 1.0).abs() < 1e-5);
    }
}
