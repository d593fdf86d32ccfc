//! Emission sampling: starts of light paths on each kind of light, and their densities.

use super::Light;
use crate::color::Spectrum;
use crate::math::{Ball, Frame, Vec2, Vec3};
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf, uniform_disk};
use crate::texture::Texture;

/// Start of a light path on a light source (Pharr, Jakob and Humphreys 2016, §16.1.2).
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Start point, world space. For lights at infinity, the point lies on a disk in front of the
    /// scene. The disk has the scene's radius and is perpendicular to `w`.
    pub p: Vec3,
    /// Origin of the ray, moved a little off the light's surface.
    pub origin: Vec3,
    /// Unit normal of the light at `p`. Zero for point and spot lights, `w` for lights at infinity.
    pub ng: Vec3,
    /// Unit direction of travel, world space.
    pub w: Vec3,
    /// Radiance, W·sr⁻¹·m⁻². Intensity, W/sr, for point and spot lights. Irradiance, W·m⁻², for
    /// parallel light.
    pub radiance: Spectrum,
    /// Opacity of the light's surface at `p`. It is already a factor of `radiance`.
    pub opacity: f32,
    /// Density of `p` per area of the light, or of the disk for lights at infinity; 1 for point and
    /// spot lights.
    pub pdf_position: f32,
    /// Density of `w` per solid angle, given `p`; 1 for parallel light.
    pub pdf_direction: f32,
    /// True if the light is infinitely far away.
    pub is_infinite: bool,
    /// True if the position has a delta distribution.
    pub is_delta_position: bool,
    /// True if the direction has a delta distribution.
    pub is_delta_direction: bool,
}

impl Emission {
    /// Emission from the point `p` of a surface with unit normal `ng`. The direction is sampled
    /// with the random numbers `u` and a density proportional to the cosine. The origin of the ray
    /// is `offset` scene units off the surface. `pdf_position` is the density of `p` per area.
    pub(super) fn of_surface(p: Vec3, ng: Vec3, offset: f32, radiance: Spectrum, pdf_position: f32, u: Vec2) -> Self {
        let w = Frame::from_z(ng).to_world(cosine_hemisphere(u));
        Self {
            p,
            origin: p + ng * offset,
            ng,
            w,
            radiance,
            opacity: 1.0,
            pdf_position,
            pdf_direction: cosine_hemisphere_pdf(w.dot(ng)),
            is_infinite: false,
            is_delta_position: false,
            is_delta_direction: false,
        }
    }

    /// Emission from a point with intensity `intensity`, W/sr, towards `w`.
    pub(super) fn of_point(position: Vec3, w: Vec3, intensity: Spectrum, pdf_direction: f32) -> Self {
        Self {
            p: position,
            origin: position,
            ng: Vec3::ZERO,
            w,
            radiance: intensity,
            opacity: 1.0,
            pdf_position: 1.0,
            pdf_direction,
            is_infinite: false,
            is_delta_position: true,
            is_delta_direction: false,
        }
    }

    /// Emission from infinity in the direction `w` into `world`. The ray starts at a point of a
    /// disk in front of `world`, which is sampled with `u`.
    pub(super) fn from_infinity(w: Vec3, radiance: Spectrum, pdf_direction: f32, u: Vec2, world: &Ball) -> Self {
        let p = world.before(w, uniform_disk(u));
        Self {
            p,
            origin: p,
            ng: w,
            w,
            radiance,
            opacity: 1.0,
            pdf_position: 1.0 / world.disk_area(),
            pdf_direction,
            is_infinite: true,
            is_delta_position: false,
            is_delta_direction: false,
        }
    }

    /// Cosine between the light's normal and the direction; 1 for point and spot lights, and for
    /// lights at infinity.
    pub fn cos(&self) -> f32 {
        if self.is_infinite || self.is_delta_position {
            1.0
        } else {
            self.ng.dot(self.w).abs()
        }
    }

    /// Flux of the path, W. The mean flux over all samples is the light's power.
    pub fn weight(&self) -> Spectrum {
        // Divide by each density separately: for a tiny light their product may overflow.
        self.radiance * (self.cos() / self.pdf_direction / self.pdf_position)
    }

    /// Returns true if the light is not black and the densities are positive and finite.
    fn is_some(&self) -> bool {
        let is_density = |pdf: f32| pdf > 0.0 && pdf < f32::INFINITY;
        is_density(self.pdf_position) && is_density(self.pdf_direction) && !self.radiance.is_black()
    }
}

impl Light {
    /// Samples emitted light at `time`; `None` if the light is black for this sample. `textures`
    /// are the textures of the scene, and `world` encloses all geometry of the scene.
    ///
    /// Triangles and other lights with a size emit from points uniform over their area, in
    /// directions with a density proportional to the cosine. Light from infinity starts at points
    /// uniform over a disk in front of `world`.
    pub fn sample_emission(
        &self,
        time: f32,
        u_position: Vec2,
        u_direction: Vec2,
        textures: &[Texture],
        world: &Ball,
    ) -> Option<Emission> {
        let emission = match self {
            Self::Area(light) => light.sample_emission(time, u_position, u_direction, textures),
            Self::Point(light) => light.sample_emission(u_direction),
            Self::Constant(light) => light.sample_emission(u_position, u_direction, world),
            Self::Directional(light) => light.sample_emission(u_position, world),
            Self::Sun(light) => light.sample_emission(u_position, u_direction, world),
            Self::Spot(light) => light.sample_emission(u_direction),
            Self::Environment(light) => light.sample_emission(u_position, u_direction, world)?,
        };
        Some(emission).filter(Emission::is_some)
    }

    /// Densities of [`Light::sample_emission`]: [`Emission::pdf_position`] of a point of the light,
    /// where the normal is `ng`, and [`Emission::pdf_direction`] of the direction of travel `w`
    /// from this point. The first density is 1 for point and spot lights. The second density is 1
    /// for parallel light, even if `w` is not its direction.
    pub fn emission_pdfs(&self, ng: Vec3, w: Vec3, time: f32, world: &Ball) -> [f32; 2] {
        let of_disk = |pdf_direction: f32| [1.0 / world.disk_area(), pdf_direction];
        match self {
            Self::Area(light) => light.emission_pdfs(ng, w, time),
            Self::Point(light) => [1.0, light.emission_pdf()],
            Self::Constant(light) => of_disk(light.pdf()),
            Self::Directional(_) => of_disk(1.0),
            Self::Sun(light) => of_disk(light.pdf(-w)),
            Self::Spot(light) => [1.0, light.emission_pdf(w)],
            Self::Environment(light) => of_disk(light.pdf(-w)),
        }
    }
}
