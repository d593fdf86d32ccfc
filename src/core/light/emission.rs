//! Emission: sampling of light paths at each kind of light, and the densities.

use super::Light;
use crate::color::Spectrum;
use crate::math::{Ball, Frame, Vec2, Vec3};
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf, uniform_disk};
use crate::texture::Texture;

/// Light that sets out from a light source (Pharr, Jakob and Humphreys 2016, §16.1.2).
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Where, world space: on the light; for infinitely distant lights on a disk before the scene, of the scene's radius, perpendicular to `w`.
    pub p: Vec3,
    /// Where its ray starts, clear of the light's own surface.
    pub origin: Vec3,
    /// Unit normal of the light there; zero for points; `w` for infinitely distant lights.
    pub ng: Vec3,
    /// Unit direction in which it travels, world space.
    pub w: Vec3,
    /// Radiance, W·sr⁻¹·m⁻²; of lights at a point intensity, W/sr; of parallel light irradiance, W·m⁻².
    pub radiance: Spectrum,
    /// Opacity of the light's surface at `p`, which `radiance` includes.
    pub opacity: f32,
    /// Density of `p` per area (for infinitely distant lights that of the disk); 1 for lights at a point.
    pub pdf_position: f32,
    /// Density of `w` per solid angle, where `p` is given; 1 for parallel light.
    pub pdf_direction: f32,
    /// Whether it comes from infinitely far away.
    pub is_infinite: bool,
    /// Whether there is no other place for it to come from.
    pub is_delta_position: bool,
    /// Whether there is no other direction for it to go.
    pub is_delta_direction: bool,
}

impl Emission {
    /// Light that sets out from the point `p` of a surface of unit normal `ng`, in a direction that `u` draws with the cosine's density. Paths start `offset`
    /// off the surface; `pdf_position` is the density of `p` per area.
    pub(super) fn of_surface(
        (p, ng): (Vec3, Vec3),
        offset: f32,
        (radiance, pdf_position): (Spectrum, f32),
        u: Vec2,
    ) -> Self {
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

    /// Emission from a point of intensity `intensity`, W/sr, towards `w`.
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

    /// Emission from infinitely far away in the direction `w` into `world`, through a point of the disk drawn with `u`.
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

    /// Cosine between the light's normal and the direction; 1 of points and at infinity.
    pub fn cos(&self) -> f32 {
        match self.is_infinite || self.is_delta_position {
            true => 1.0,
            false => self.ng.dot(self.w).abs(),
        }
    }

    /// What a path that sets out so carries, W: its mean over all draws is the light's power.
    pub fn weight(&self) -> Spectrum {
        // One after the other: of a tiny light the product of both densities may be beyond what numbers hold.
        self.radiance * (self.cos() / self.pdf_direction / self.pdf_position)
    }

    /// Whether there is any light, and its densities are numbers.
    fn is_some(&self) -> bool {
        let is_density = |pdf: f32| pdf > 0.0 && pdf < f32::INFINITY;
        is_density(self.pdf_position) && is_density(self.pdf_direction) && !self.radiance.is_black()
    }
}

impl Light {
    /// Draws light that sets out at `time`; `None` where the light sends none. `textures` are the scene's, and `world` holds all of its geometry.
    ///
    /// Triangles and other lamps with a size emit from points uniform over their area, with the cosine's density; light from infinity passes points uniform over the disk.
    pub fn sample_emission(
        &self,
        time: f32,
        u_position: Vec2,
        u_direction: Vec2,
        textures: &[Texture],
        world: &Ball,
    ) -> Option<Emission> {
        let emission = match self {
            Self::Triangle(light) => light.sample_emission(u_position, u_direction),
            Self::MovingTriangle(light) => light.at(time).sample_emission(u_position, u_direction),
            Self::Textured(light) => light.sample_emission(time, u_position, u_direction, textures),
            Self::Sphere(light) => light.sample_emission(u_position, u_direction),
            Self::Disk(light) => light.sample_emission(u_position, u_direction),
            Self::Rectangle(light) => light.sample_emission(u_position, u_direction),
            Self::Point(light) => light.sample_emission(u_direction),
            Self::Constant(light) => light.sample_emission(u_position, u_direction, world),
            Self::Directional(light) => light.sample_emission(u_position, world),
            Self::Sun(light) => light.sample_emission(u_position, u_direction, world),
            Self::Spot(light) => light.sample_emission(u_direction),
            Self::Environment(light) => light.sample_emission(u_position, u_direction, world)?,
        };
        Some(emission).filter(Emission::is_some)
    }

    /// Densities with which [`Light::sample_emission`] draws a point of the light with normal `ng`, and from there the direction of travel `w`:
    /// those that [`Emission`] has. For lights at a point the first is 1, and for parallel light the second, whatever `w` is: there is no other.
    pub fn emission_pdfs(&self, ng: Vec3, w: Vec3, time: f32, world: &Ball) -> [f32; 2] {
        let of_disk = |pdf_direction: f32| [1.0 / world.disk_area(), pdf_direction];
        match self {
            Self::Triangle(light) => light.emission_pdfs(ng, w),
            Self::MovingTriangle(light) => light.at(time).emission_pdfs(ng, w),
            Self::Textured(light) => light.at(time).emission_pdfs(ng, w),
            Self::Sphere(light) => light.emission_pdfs(ng, w),
            Self::Disk(light) => light.emission_pdfs(ng, w),
            Self::Rectangle(light) => light.emission_pdfs(ng, w),
            Self::Point(light) => [1.0, light.emission_pdf()],
            Self::Constant(light) => of_disk(light.pdf()),
            Self::Directional(_) => of_disk(1.0),
            Self::Sun(light) => of_disk(light.pdf(-w)),
            Self::Spot(light) => [1.0, light.emission_pdf(w)],
            Self::Environment(light) => of_disk(light.pdf(-w)),
        }
    }
}
