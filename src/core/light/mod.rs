//! Light sources: emitted radiance, sampling of incident light and of light paths, and densities.
//! No ray is traced here.
//!
//! Densities of a single light do not include the probability of choosing it (`light_sampling`).
//!
//! How to add a type of light: a light with a surface is a variant of [`AreaLight`], and needs
//! `match` arms in `area.rs` alone. A round light is also a variant of [`RoundLight`], and needs a
//! hull (`scene/lamp_hulls.rs`). A light without surface needs a variant of [`Light`], and a change
//! of `Scene::escaped` (`scene/incident.rs`) if escaped rays can find the light. Both kinds need a
//! module, an encoding for the scene hash (`encode_fields!`), an `add_…` function of
//! `scene/made_lights.rs`, and a section in `scene_file/light_section.rs`. The compiler reports
//! all missing arms of a `match`. The ground needs the irradiance of the light (`irradiance`). A
//! light that can be a latitude-longitude image needs no variant. Like `sky` and `studio`, the
//! module of this light makes a [`LatLongImage`], and `scene/made_lights.rs` makes an
//! [`EnvironmentLight`] with an [`EnvironmentKind`] from this image.
//!
//! Moving lights are moved to their position at the time of each sample. An emitting triangle
//! stores its normal and the largest ray offset of its points, so the end of a shadow ray is
//! computed with one multiplication.

mod area;
pub(crate) mod bounds;
mod constant;
mod directional;
mod disk;
mod emission;
mod environment;
mod groups;
mod irradiance;
mod point;
mod rectangle;
pub mod sky;
mod sphere;
mod spot;
mod studio;
mod sun;
mod sun_position;
mod textured;
mod triangle;

pub use area::{AreaLight, RoundLight};
pub use constant::ConstantLight;
pub use directional::DirectionalLight;
pub use disk::DiskLight;
pub use emission::Emission;
pub use environment::{EnvironmentKind, EnvironmentLight, LatLongImage};
pub use groups::{LightGroupId, LightGroups};
pub use point::PointLight;
pub use rectangle::RectangleLight;
pub use sphere::SphereLight;
pub use spot::SpotLight;
pub use studio::{STUDIO_IRRADIANCE, STUDIO_SIZE, studio_image};
pub use sun::SunLight;
pub use sun_position::sun_position;
pub use textured::{TexturedTriangle, Variation};
pub use triangle::{MovingTriangle, TriangleLight, TriangleSampling};

use crate::color::Spectrum;
use crate::geometry::segment;
use crate::math::{Encode, Ray, Vec2, Vec3};
use crate::texture::Texture;
use bounds::{LightBounds, ReceiverRegion};
use std::f64::consts::PI;

/// Index of a light of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LightId(pub u32);

/// Sample of incident light from a light source.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction from the receiving point to the light, world space.
    pub wi: Vec3,
    /// Unoccluded radiance from `wi`; for delta lights, irradiance on a surface that faces the
    /// light.
    pub radiance: Spectrum,
    /// Density of `wi` per solid angle; 1 for delta lights.
    pub pdf: f32,
    /// True if BSDF sampling cannot find this light, so that MIS does not apply.
    pub is_delta: bool,
    /// End point of the shadow ray, moved a little off the light. `None` if the light is infinitely
    /// far away.
    pub target: Option<Vec3>,
}

impl LightSample {
    /// The segment from `origin`, the receiving point, to a point near the light's surface. The
    /// light is visible if the segment is unoccluded.
    #[inline(always)]
    pub fn shadow_ray(&self, origin: Vec3) -> Ray {
        match self.target {
            Some(target) => segment(origin, target),
            None => Ray::new(origin, self.wi),
        }
    }
}

/// A light source.
#[derive(Clone, Debug)]
pub enum Light {
    /// A light with a surface that rays can hit.
    Area(AreaLight),
    /// A point that emits the same intensity in every direction.
    Point(PointLight),
    /// An environment with the same radiance from every direction.
    Constant(ConstantLight),
    /// Parallel light.
    Directional(DirectionalLight),
    /// Light from a disc at infinity, such as the sun.
    Sun(SunLight),
    /// A cone of light from a point.
    Spot(SpotLight),
    /// An environment image: radiance from infinity for each direction.
    Environment(Box<EnvironmentLight>),
}

/// The first byte is the kind of the light. Area lights have several kinds.
impl Encode for Light {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        match self {
            Self::Area(light) => light.encode(sink),
            Self::Point(light) => {
                sink(&[3]);
                light.encode(sink);
            }
            Self::Constant(light) => {
                sink(&[4]);
                light.encode(sink);
            }
            Self::Directional(light) => {
                sink(&[5]);
                light.encode(sink);
            }
            Self::Spot(light) => {
                sink(&[6]);
                light.encode(sink);
            }
            Self::Environment(light) => {
                sink(&[7]);
                light.encode(sink);
            }
            Self::Sun(light) => {
                sink(&[8]);
                light.encode(sink);
            }
        }
    }
}

impl Light {
    /// Samples light that arrives at `p` at `time`; `None` if no light arrives. `textures` are the
    /// textures of the scene.
    #[inline(always)]
    pub fn sample(&self, p: Vec3, time: f32, u: Vec2, textures: &[Texture]) -> Option<LightSample> {
        match self {
            Self::Area(light) => light.sample(p, time, u, textures),
            Self::Point(light) => light.sample(p),
            Self::Constant(light) => Some(light.sample(u)),
            Self::Directional(light) => Some(light.sample()),
            Self::Sun(light) => Some(light.sample(u)),
            Self::Spot(light) => light.sample(p),
            Self::Environment(light) => light.sample(u),
        }
    }

    /// Density per solid angle with which [`Light::sample`] samples the unit direction `wi` at `p`.
    /// `q` is the point of the light in this direction; infinitely distant lights do not use it. 0
    /// for lights that rays cannot hit.
    pub fn pdf(&self, p: Vec3, q: Vec3, wi: Vec3, time: f32) -> f32 {
        match self {
            Self::Area(light) => light.pdf(p, q, wi, time),
            Self::Constant(light) => light.pdf(),
            Self::Sun(light) => light.pdf(wi),
            Self::Environment(light) => light.pdf(wi),
            Self::Point(_) | Self::Directional(_) | Self::Spot(_) => 0.0,
        }
    }

    /// Unit normal of the emitting side at `time`, at the point `q`; `None` if the light has no
    /// surface.
    pub fn normal(&self, q: Vec3, time: f32) -> Option<Vec3> {
        match self {
            Self::Area(light) => Some(light.normal(q, time)),
            Self::Point(_)
            | Self::Constant(_)
            | Self::Directional(_)
            | Self::Sun(_)
            | Self::Spot(_)
            | Self::Environment(_) => None,
        }
    }

    /// Returns true if the light moves.
    pub fn is_moving(&self) -> bool {
        matches!(self, Self::Area(light) if light.is_moving())
    }

    /// Returns true if rays cannot hit the light.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Point(_) | Self::Directional(_) | Self::Spot(_) => true,
            Self::Area(_) | Self::Constant(_) | Self::Sun(_) | Self::Environment(_) => false,
        }
    }

    /// Type of the light, as users write it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Area(light) => light.kind(),
            Self::Point(_) => "point",
            Self::Constant(_) => "constant",
            Self::Directional(_) | Self::Sun(_) => "directional",
            Self::Spot(_) => "spot",
            Self::Environment(light) => light.kind().name(),
        }
    }

    /// Emitted power in watts, luminance-weighted. For lights at infinity, this is the power
    /// through a disk with the radius `scene_radius` that is perpendicular to the light, integrated
    /// over all directions from which light comes.
    pub fn power(&self, scene_radius: f32) -> f64 {
        match self {
            Self::Area(light) => light.power(),
            Self::Point(light) => light.power(),
            Self::Constant(light) => light.power(scene_radius),
            Self::Directional(light) => light.power(scene_radius),
            Self::Sun(light) => light.power(scene_radius),
            Self::Spot(light) => light.power(),
            Self::Environment(light) => light.power(scene_radius),
        }
    }

    /// Emitting area in square scene units: 0 for points, parallel light and suns, infinite for
    /// environments.
    pub(crate) fn area(&self) -> f64 {
        match self {
            Self::Area(light) => light.area(),
            Self::Point(_) | Self::Spot(_) | Self::Directional(_) | Self::Sun(_) => 0.0,
            Self::Constant(_) | Self::Environment(_) => f64::INFINITY,
        }
    }

    /// Bounding sphere and emission of the light; `None` if the light is at infinity.
    pub(crate) fn bounds(&self) -> Option<LightBounds> {
        match self {
            Self::Area(light) => Some(light.bounds()),
            Self::Point(light) => Some(LightBounds::isotropic(light.position, light.intensity.luminance())),
            Self::Spot(light) => Some(light.bounds()),
            Self::Constant(_) | Self::Directional(_) | Self::Sun(_) | Self::Environment(_) => None,
        }
    }

    /// Estimate of the mean irradiance in `region` by a finite light, without shadows.
    pub(crate) fn irradiance(&self, region: &ReceiverRegion) -> f32 {
        match self {
            Self::Area(light) => light.irradiance(region),
            Self::Spot(light) => light.irradiance(region),
            Self::Point(_) | Self::Constant(_) | Self::Directional(_) | Self::Sun(_) | Self::Environment(_) => {
                self.bounds().map_or(0.0, |bounds| region.irradiance(&bounds))
            }
        }
    }

    /// Irradiance by a light at infinity, in a scene with the radius `scene_radius`.
    pub(crate) fn irradiance_from_infinity(&self, region: &ReceiverRegion, scene_radius: f32) -> f64 {
        // The power is the flux through a disk of the scene's radius. For light from many
        // directions, the power is the integral of this flux over all directions, each with a disk
        // perpendicular to it.
        let disk = PI * (scene_radius as f64).powi(2);
        let irradiance = self.power(scene_radius) / disk;
        match self {
            Self::Directional(light) => irradiance * region.cosine(-light.direction, 0.0) as f64,
            Self::Sun(light) => {
                let (wi, spread) = light.cone();
                irradiance * region.cosine(wi, spread) as f64
            }
            // Only skies remain, because this function is called for lights at infinity only. The
            // mean of max(cos θ, 0) over the sphere is 1/4.
            _ => 0.25 * irradiance,
        }
    }
}

/// Density per solid angle at `p` if points are sampled uniformly over a flat light with the area
/// `area` and the unit normal `normal`: `r² / (A cos θ)`. The point `q` of the light is seen from
/// `p` in the unit direction `wi`. 0 if `p` is behind the light.
fn area_pdf(p: Vec3, q: Vec3, wi: Vec3, normal: Vec3, area: f64) -> f32 {
    let cos = -wi.dot(normal);
    let pdf = p.distance_squared(q) / (cos * area as f32);
    // If the light is seen edge-on, the density can be NaN. There is no sample then.
    if cos > 0.0 && pdf.is_finite() { pdf } else { 0.0 }
}
