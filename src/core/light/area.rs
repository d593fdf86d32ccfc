//! Lights with a surface that rays can hit: shapes that emit on their front.

use super::bounds::{LightBounds, ReceiverRegion};
use super::irradiance::{of_disk, of_polygon, of_triangle};
use super::textured::UniformTriangle;
use super::{
    DiskLight, Emission, Light, LightSample, MovingTriangle, RectangleLight, SphereLight, TexturedTriangle,
    TriangleLight, Variation,
};
use crate::color::Spectrum;
use crate::math::{Encode, Ray, Vec2, Vec3};
use crate::texture::Texture;

/// A light with a surface.
#[derive(Clone, Debug)]
pub enum AreaLight {
    /// An emitting triangle.
    Triangle(TriangleLight),
    /// A moving triangle that emits.
    MovingTriangle(Box<MovingTriangle>),
    /// A triangle with an emission texture, or with opacity below 1.
    Textured(Box<TexturedTriangle>),
    /// A sphere.
    Sphere(SphereLight),
    /// A disk.
    Disk(DiskLight),
    /// A rectangle.
    Rectangle(RectangleLight),
}

/// A light whose mesh in the scene is a hull, larger than the light (`scene/lamp_hulls.rs`).
#[derive(Clone, Copy, Debug)]
pub enum RoundLight<'a> {
    /// A sphere.
    Sphere(&'a SphereLight),
    /// A disk.
    Disk(&'a DiskLight),
}

impl RoundLight<'_> {
    /// Returns true if `ray`, which hits the hull, misses the light.
    pub fn is_missed(self, ray: &Ray) -> bool {
        match self {
            Self::Sphere(light) => light.is_missed(ray),
            Self::Disk(light) => light.is_missed(ray),
        }
    }

    /// Returns true if points of the light are not points of the hull.
    pub fn is_curved(self) -> bool {
        match self {
            Self::Sphere(_) => true,
            // The square lies in the plane of the disk.
            Self::Disk(_) => false,
        }
    }
}

/// Implements the conversions of a shape to [`AreaLight`] and [`Light`].
macro_rules! conversions {
    ($($kind:ident($shape:ty)),* $(,)?) => {
        $(
            impl From<$shape> for AreaLight {
                fn from(shape: $shape) -> Self {
                    Self::$kind(shape)
                }
            }

            impl From<$shape> for Light {
                fn from(shape: $shape) -> Self {
                    Self::Area(AreaLight::$kind(shape))
                }
            }
        )*
    };
}

conversions! {
    Triangle(TriangleLight),
    MovingTriangle(Box<MovingTriangle>),
    Textured(Box<TexturedTriangle>),
    Sphere(SphereLight),
    Disk(DiskLight),
    Rectangle(RectangleLight),
}

impl From<AreaLight> for Light {
    fn from(light: AreaLight) -> Self {
        Self::Area(light)
    }
}

/// For a triangle of a mesh, only the kind of the light is encoded. All other data follow from the
/// mesh, its material and its placement, which the scene encodes.
impl Encode for AreaLight {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        match self {
            Self::Triangle(_) => sink(&[0]),
            Self::MovingTriangle(_) => sink(&[1]),
            Self::Textured(_) => sink(&[2]),
            Self::Sphere(light) => {
                sink(&[9]);
                light.encode(sink);
            }
            Self::Disk(light) => {
                sink(&[10]);
                light.encode(sink);
            }
            Self::Rectangle(light) => {
                sink(&[11]);
                light.encode(sink);
            }
        }
    }
}

impl AreaLight {
    /// If this light is a triangle, multiplies its emission by the textures and the opacity of
    /// `variation`. A triangle that emits nowhere gets radiance 0.
    pub fn varied(self, variation: Variation, textures: &[Texture]) -> Self {
        let (even, black) = match self {
            Self::Triangle(light) => {
                let black = light.emitting(Spectrum::ZERO);
                (UniformTriangle::Still(light), Self::Triangle(black))
            }
            Self::MovingTriangle(light) => {
                let black = Box::new(light.emitting(Spectrum::ZERO));
                (UniformTriangle::Moving(light), Self::MovingTriangle(black))
            }
            other => return other,
        };
        let textured = TexturedTriangle::new(even, variation, textures);
        textured.map_or(black, |light| Self::Textured(Box::new(light)))
    }

    /// Samples light that arrives at `p`, like [`Light::sample`].
    #[inline(always)]
    pub(super) fn sample(&self, p: Vec3, time: f32, u: Vec2, textures: &[Texture]) -> Option<LightSample> {
        match self {
            Self::Triangle(light) => light.sample(p, u),
            Self::MovingTriangle(light) => light.at(time).sample(p, u),
            Self::Textured(light) => light.sample(p, time, u, textures),
            Self::Sphere(light) => light.sample(p, u),
            Self::Disk(light) => light.sample(p, u),
            Self::Rectangle(light) => light.sample(p, u),
        }
    }

    /// Density per solid angle of the direction `wi` at `p`, like [`Light::pdf`].
    pub(super) fn pdf(&self, p: Vec3, q: Vec3, wi: Vec3, time: f32) -> f32 {
        match self {
            Self::Triangle(light) => light.pdf(p, q, wi),
            Self::MovingTriangle(light) => light.at(time).pdf(p, q, wi),
            Self::Textured(light) => light.at(time).pdf(p, q, wi),
            Self::Sphere(light) => light.pdf(p),
            Self::Disk(light) => light.pdf(p, q, wi),
            Self::Rectangle(light) => light.pdf(p, q, wi),
        }
    }

    /// Radiance that the point `q` of the light sends to `p` along −`wi` at `time`, W·sr⁻¹·m⁻², and
    /// the density [`Light::pdf`]. `barycentrics` belong to `q` if the light is a triangle.
    #[inline(always)]
    pub fn incident(
        &self,
        p: Vec3,
        q: Vec3,
        wi: Vec3,
        barycentrics: [f32; 2],
        time: f32,
        textures: &[Texture],
    ) -> (Spectrum, f32) {
        // Most lights are triangles, so only their code is inlined.
        match self {
            Self::Triangle(light) => (light.emitted(-wi), light.pdf(p, q, wi)),
            _ => self.incident_otherwise(p, q, wi, barycentrics, time, textures),
        }
    }

    /// Like [`AreaLight::incident`], for every kind of light.
    #[inline(never)]
    fn incident_otherwise(
        &self,
        p: Vec3,
        q: Vec3,
        wi: Vec3,
        barycentrics: [f32; 2],
        time: f32,
        textures: &[Texture],
    ) -> (Spectrum, f32) {
        let of_triangle = |light: &TriangleLight| (light.emitted(-wi), light.pdf(p, q, wi));
        match self {
            Self::Triangle(light) => of_triangle(light),
            Self::MovingTriangle(light) => of_triangle(&light.at(time)),
            Self::Textured(light) => {
                let (radiance, pdf) = of_triangle(&light.at(time));
                (radiance * light.color(barycentrics[0], barycentrics[1], textures), pdf)
            }
            Self::Sphere(light) => (light.radiance_at(p), light.pdf(p)),
            Self::Disk(light) => (light.emitted(-wi), light.pdf(p, q, wi)),
            Self::Rectangle(light) => (light.emitted(-wi), light.pdf(p, q, wi)),
        }
    }

    /// Unit normal of the emitting side at the point `q` at `time`.
    pub(super) fn normal(&self, q: Vec3, time: f32) -> Vec3 {
        match self {
            Self::Triangle(light) => light.normal(),
            Self::MovingTriangle(light) => light.at(time).normal(),
            Self::Textured(light) => light.at(time).normal(),
            Self::Sphere(light) => light.normal_at(q),
            Self::Disk(light) => light.normal(),
            Self::Rectangle(light) => light.normal(),
        }
    }

    /// Returns true if the light moves.
    pub(super) fn is_moving(&self) -> bool {
        match self {
            Self::MovingTriangle(_) => true,
            Self::Textured(light) => light.is_moving(),
            Self::Triangle(_) | Self::Sphere(_) | Self::Disk(_) | Self::Rectangle(_) => false,
        }
    }

    /// The light as a round light; `None` if its mesh in the scene is its surface.
    pub fn round(&self) -> Option<RoundLight<'_>> {
        match self {
            Self::Sphere(light) => Some(RoundLight::Sphere(light)),
            Self::Disk(light) => Some(RoundLight::Disk(light)),
            Self::Triangle(_) | Self::MovingTriangle(_) | Self::Textured(_) | Self::Rectangle(_) => None,
        }
    }

    /// Type of the light, as users write it.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Triangle(_) | Self::MovingTriangle(_) | Self::Textured(_) => "triangle",
            Self::Sphere(_) => "sphere",
            Self::Disk(_) => "disk",
            Self::Rectangle(_) => "rectangle",
        }
    }

    /// Emitted power in watts, luminance-weighted.
    pub(super) fn power(&self) -> f64 {
        match self {
            Self::Triangle(light) => light.power(),
            Self::MovingTriangle(light) => light.power(),
            Self::Textured(light) => light.power(),
            Self::Sphere(light) => light.power(),
            Self::Disk(light) => light.power(),
            Self::Rectangle(light) => light.power(),
        }
    }

    /// Emitting area in square scene units, at the middle of the shutter interval.
    pub(super) fn area(&self) -> f64 {
        match self {
            Self::Triangle(light) => light.area(),
            Self::MovingTriangle(light) => light.at(0.5).area(),
            Self::Textured(light) => light.at(0.5).area(),
            Self::Sphere(light) => light.area(),
            Self::Disk(light) => light.area(),
            Self::Rectangle(light) => light.area(),
        }
    }

    /// Bounding sphere and emission of the light.
    pub(super) fn bounds(&self) -> LightBounds {
        match self {
            Self::Triangle(light) => light.bounds(),
            Self::MovingTriangle(light) => light.at(0.5).bounds(),
            Self::Textured(light) => light.bounds(),
            Self::Sphere(light) => light.bounds(),
            Self::Disk(light) => light.bounds(),
            Self::Rectangle(light) => light.bounds(),
        }
    }

    /// Estimate of the mean irradiance in `region`, without shadows.
    pub(super) fn irradiance(&self, region: &ReceiverRegion) -> f32 {
        match self {
            Self::Triangle(light) => light.irradiance(region),
            Self::MovingTriangle(light) => light.irradiance(region),
            Self::Textured(light) => light.irradiance(region),
            Self::Rectangle(light) => light.irradiance(region),
            Self::Sphere(_) | Self::Disk(_) => region.irradiance(&self.bounds()),
        }
    }

    /// Irradiance of a plane, like [`Light::irradiance_at`].
    pub(super) fn irradiance_at(&self, p: Vec3, n: Vec3, time: f32) -> Option<Spectrum> {
        match self {
            Self::Triangle(light) => Some(of_triangle(light, p, n)),
            Self::MovingTriangle(light) => Some(of_triangle(&light.at(time), p, n)),
            // The irradiance by a texture has no closed form.
            Self::Textured(light) => Some(of_triangle(&light.without_textures(time)?, p, n)),
            Self::Sphere(light) => Some(light.irradiance_at(p, n)),
            Self::Disk(light) => Some(of_disk(light, p, n)),
            Self::Rectangle(light) => Some(light.radiance() * of_polygon(&light.corners(), light.normal(), p, n)),
        }
    }

    /// Samples emitted light, like [`Light::sample_emission`].
    pub(super) fn sample_emission(
        &self,
        time: f32,
        u_position: Vec2,
        u_direction: Vec2,
        textures: &[Texture],
    ) -> Emission {
        match self {
            Self::Triangle(light) => light.sample_emission(u_position, u_direction),
            Self::MovingTriangle(light) => light.at(time).sample_emission(u_position, u_direction),
            Self::Textured(light) => light.sample_emission(time, u_position, u_direction, textures),
            Self::Sphere(light) => light.sample_emission(u_position, u_direction),
            Self::Disk(light) => light.sample_emission(u_position, u_direction),
            Self::Rectangle(light) => light.sample_emission(u_position, u_direction),
        }
    }

    /// Densities of [`Light::sample_emission`], like [`Light::emission_pdfs`].
    pub(super) fn emission_pdfs(&self, ng: Vec3, w: Vec3, time: f32) -> [f32; 2] {
        match self {
            Self::Triangle(light) => light.emission_pdfs(ng, w),
            Self::MovingTriangle(light) => light.at(time).emission_pdfs(ng, w),
            Self::Textured(light) => light.at(time).emission_pdfs(ng, w),
            Self::Sphere(light) => light.emission_pdfs(ng, w),
            Self::Disk(light) => light.emission_pdfs(ng, w),
            Self::Rectangle(light) => light.emission_pdfs(ng, w),
        }
    }
}
