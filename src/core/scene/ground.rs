//! The ground: a plane that catches the shadows of the scene.
//!
//! A camera ray that hits the ground returns the background times `E / E₀`. This is the fraction of
//! the light that objects do not block at the hit point: `E` is the irradiance with the scene, and
//! `E₀` the irradiance without the scene. Integrators estimate the radiance that the ground
//! reflects, `ρ E / π` for an albedo ρ. `Ground::shadow` returns the factor from this radiance to
//! the fraction. Far from all objects, the mean fraction is 1 and the ground looks like the
//! background.
//!
//! - The path tracer accumulates the missing direct light, `E − E₀`, instead of the arriving light.
//!   If no object is near a point, the missing light there is 0, so that the background has no
//!   noise. A sample of the fraction can be negative, but the mean of the samples is negative only
//!   because of noise. If the scene has lamps of finite size, the path tracer accumulates the
//!   arriving light instead. The reason: if a ray hits a surface, it is unknown how much light of a
//!   lamp behind this surface is missing.
//! - E₀ cannot include finite lights if one of them has an emission texture, or if there are too
//!   many to be summed at each point. If there are lights at infinity, E₀ then includes only these,
//!   and the ground around finite lights is brighter than the background. If there are no lights at
//!   infinity, building the scene fails.
//! - E₀ of infinitely distant lights is the same everywhere and is computed once. E₀ of finite
//!   lights is computed for each point, without visibility. So the ground is not darker where a
//!   lamp is far away. Both parts of E₀ are computed without noise (`light/irradiance.rs`).
//! - Towards the rim of the ground the fraction approaches 1, so that no edge is visible.
//! - For all other rays the ground is a diffuse surface: it stops light from below, and lights the
//!   undersides of objects on it. Without the ground, the environment would light an object from
//!   below, and the object would seem to float. The default albedo, 0.5, lies between asphalt and
//!   paper.
//! - Camera rays from below pass through the ground.
//! - The scene's bounds do not include the ground, because the bounds are used to frame the image,
//!   and to aim light paths from distant lights.

use super::validate::{BuildError, MAX_COORDINATE, check_mesh, remove_degenerate};
use crate::color::Spectrum;
use crate::geometry::{GeomId, Hit, Mesh};
use crate::light::{Light, LightId};
use crate::material::Material;
use crate::math::float::smooth_step;
use crate::math::{Bounds3, Encode, Frame, Vec3, encode_fields, list};
use std::f32::consts::PI;

/// Default radius of the ground, as a multiple of the scene's radius.
const DEFAULT_RADIUS: f32 = 50.0;
/// Default distance of the ground below the scene's lowest point, as a fraction of the scene's
/// radius. It keeps the ground from coinciding with surfaces at the bottom of the scene.
const GAP: f32 = 1e-4;
/// Distance from the middle of the ground at which shadows begin to fade, as a fraction of the
/// radius at which they end.
const FADE: f32 = 0.5;
/// Minimum albedo of the ground. It is not 0, because the arriving light is estimated as the
/// reflected light divided by the albedo.
const MIN_ALBEDO: f32 = 0.01;
/// Minimum radius of the ground: the extent of the smallest valid scene.
const MIN_RADIUS: f32 = 1e-9;
/// Maximum number of finite lights that are summed at each point of the ground.
const MAX_FINITE_LIGHTS: usize = 256;

/// Settings of a ground plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundPlane {
    /// A point of the plane. If it is `None`, the plane is just below the scene's lowest point
    /// along `up`.
    pub point: Option<Vec3>,
    /// Normal on the visible side, of any length. If it is `None`, the normal is `up`.
    pub normal: Option<Vec3>,
    /// Upward direction, of any length.
    pub up: Vec3,
    /// Radius around the point, in scene units. If it is `None`, the radius is 50 times the radius
    /// of the scene.
    pub radius: Option<f32>,
    /// Radius at which shadows end, in scene units. Shadows never reach beyond `radius`. If it is
    /// `None`, they end at `radius`.
    pub shadow_radius: Option<f32>,
    /// Albedo for all rays except camera rays. Each channel is from 0.01 to 1.
    pub albedo: Spectrum,
}

impl Default for GroundPlane {
    /// A ground below the scene, with +y up and an albedo of 0.5.
    fn default() -> Self {
        Self {
            point: None,
            normal: None,
            up: Vec3::Y,
            radius: None,
            shadow_radius: None,
            albedo: Spectrum::splat(0.5),
        }
    }
}

/// Ground plane whose point, normal and radius are known for a given scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlacedPlane {
    point: Vec3,
    normal: Vec3,
    radius: f32,
    shadow_radius: f32,
    albedo: Spectrum,
}

/// Radius of `bounds`; 1 if the radius is 0.
fn size_of(bounds: Bounds3) -> f32 {
    Some(bounds.radius()).filter(|&r| r > 0.0).unwrap_or(1.0)
}

/// Point below the middle of `bounds`, just below the lowest corner. `up` is the upward unit
/// vector.
fn point_below(bounds: Bounds3, up: Vec3) -> Vec3 {
    let center = bounds.center();
    let half = (0.5 * (bounds.max - bounds.min)).max(Vec3::ZERO);
    let half = if bounds.is_empty() { Vec3::ZERO } else { half };
    center - up * (half.dot(up.abs()) + GAP * size_of(bounds))
}

impl GroundPlane {
    /// Returns an error if a value is invalid.
    pub fn check(&self) -> Result<(), BuildError> {
        let bad = |key, value: String, rule| Err(BuildError::BadGround { key, value, rule });
        for (key, v) in [("normal", self.normal), ("up", Some(self.up))] {
            if let Some(v) = v.filter(|v| v.try_normalize().is_none()) {
                return bad(key, list(&v.to_array()), "finite and not zero");
            }
        }
        let is_far = |p: &Vec3| !p.is_finite() || p.abs().max_element() > MAX_COORDINATE;
        if let Some(point) = self.point.filter(is_far) {
            return bad(
                "point",
                list(&point.to_array()),
                "finite, with coordinates of at most 1e10",
            );
        }
        let is_radius = |r: f32| (MIN_RADIUS..=MAX_COORDINATE).contains(&r);
        for (key, radius) in [("radius", self.radius), ("shadow_radius", self.shadow_radius)] {
            if let Some(radius) = radius.filter(|&r| !is_radius(r)) {
                return bad(key, radius.to_string(), "from 1e-9 to 1e10");
            }
        }
        let albedo = self.albedo.to_array();
        if albedo.iter().any(|v| !(MIN_ALBEDO..=1.0).contains(v)) {
            return bad("albedo", list(&albedo), "from 0.01 to 1 in each channel");
        }
        Ok(())
    }

    /// Settings of a plane below a part of a scene. `bounds` is the box of the part.
    pub fn below(bounds: Bounds3, up: Vec3) -> Self {
        let up = up.normalize_or(Vec3::Y);
        Self {
            point: Some(point_below(bounds, up)),
            up,
            radius: Some(DEFAULT_RADIUS * size_of(bounds)),
            ..Self::default()
        }
    }

    /// Returns the plane for a scene with the box `bounds`. A missing point or radius follows from
    /// `bounds`.
    pub(super) fn place(&self, bounds: Bounds3) -> Result<PlacedPlane, BuildError> {
        self.check()?;
        let up = self.up.normalize_or(Vec3::Y);
        let size = size_of(bounds);
        let point = self.point.unwrap_or_else(|| point_below(bounds, up));
        // If the scene is almost as large as the coordinates that backends can trace, limit the
        // radius to these coordinates
        let room = 0.7 * (MAX_COORDINATE - point.abs().max_element()).max(0.0);
        let radius = self.radius.unwrap_or((DEFAULT_RADIUS * size).min(room));
        let plane = PlacedPlane {
            point,
            normal: self.normal.map_or(up, |n| n.normalize_or(up)),
            radius,
            shadow_radius: self.shadow_radius.map_or(radius, |r| r.min(radius)),
            albedo: self.albedo,
        };
        // Reject a disk that cannot be traced: its corners round to one point, or are out of range
        let mut mesh = plane.mesh();
        if check_mesh(&mut mesh).is_err() || remove_degenerate(&mut mesh) > 0 {
            return Err(BuildError::BadGround {
                key: "radius",
                value: plane.radius.to_string(),
                rule: "such that the corners of the plane differ and have coordinates of at most 1e10",
            });
        }
        Ok(plane)
    }
}

impl PlacedPlane {
    /// Mesh of the ground: a square that contains the disk. Its front faces along the normal.
    pub fn mesh(&self) -> Mesh {
        let frame = Frame::from_z(self.normal);
        let corner = |x: f32, y: f32| self.point + self.radius * frame.to_world(Vec3::new(x, y, 0.0));
        Mesh {
            positions: vec![
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    /// Material of the ground, for all rays except camera rays.
    pub fn material(&self) -> Material {
        Material {
            name: Ground::NAME.into(),
            diffuse: self.albedo,
            ..Material::default()
        }
    }
}

/// The ground of a frozen scene.
#[derive(Clone, Debug)]
pub struct Ground {
    geom: GeomId,
    plane: PlacedPlane,
    /// Irradiance of the plane by infinitely distant lights, as if the scene were absent, W·m⁻².
    irradiance: Spectrum,
    /// Finite lights that are part of E₀. Their irradiance is different at each point.
    finite: Vec<LightId>,
    /// True if rays cannot hit any finite light.
    has_missing_light: bool,
}

encode_fields!(PlacedPlane {
    point,
    normal,
    radius,
    shadow_radius,
    albedo,
});

/// Encodes the mesh and the plane only, because the irradiance follows from the lights.
impl Encode for Ground {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.geom.0.encode(sink);
        self.plane.encode(sink);
    }
}

impl Ground {
    /// Name of the object and of the material of the ground.
    pub const NAME: &str = "ground";

    /// The ground with the mesh `geom` and the plane `plane`, lit by `lights`.
    pub(super) fn new(geom: GeomId, plane: PlacedPlane, lights: &[Light]) -> Result<Self, BuildError> {
        let mut ground = Self {
            geom,
            plane,
            irradiance: Spectrum::ZERO,
            finite: Vec::new(),
            has_missing_light: true,
        };
        let mut is_known = true;
        for (id, light) in (0..).map(LightId).zip(lights) {
            if light.power(1.0) == 0.0 {
                continue;
            }
            let irradiance = light.irradiance_at(plane.point, plane.normal, 0.0);
            is_known &= irradiance.is_some();
            if light.is_infinite() {
                ground.irradiance += irradiance.unwrap_or_default();
            } else {
                ground.finite.push(id);
                ground.has_missing_light &= light.is_delta();
            }
        }
        let count = ground.finite.len();
        if is_known && count <= MAX_FINITE_LIGHTS {
            return Ok(ground);
        }
        // If infinitely distant lights illuminate the ground, leave all finite lights out of E₀.
        // The finite lights then brighten the ground
        if !ground.irradiance.is_black() {
            ground.finite.clear();
            return Ok(ground);
        }
        Err(if is_known {
            BuildError::TooManyLightsOfGround {
                count,
                max: MAX_FINITE_LIGHTS,
            }
        } else {
            BuildError::UnknownIrradiance
        })
    }

    /// Returns true if `hit` is on the ground.
    #[inline(always)]
    pub fn is_at(&self, hit: &Hit) -> bool {
        hit.geom == self.geom
    }

    /// Mesh of the ground.
    pub fn geom(&self) -> GeomId {
        self.geom
    }

    /// Unit normal, on the side that catches shadows.
    pub fn normal(&self) -> Vec3 {
        self.plane.normal
    }

    /// Point in the middle of the ground.
    pub fn point(&self) -> Vec3 {
        self.plane.point
    }

    /// Radius at which shadows have faded completely, in scene units.
    pub fn radius(&self) -> f32 {
        self.plane.radius
    }

    /// Returns true if it is known how much direct light a surface blocks when a ray from the
    /// ground hits the surface. False if there are lamps of finite size, because a ray that hits a
    /// surface does not find the light of a lamp behind the surface.
    pub fn has_missing_light(&self) -> bool {
        self.has_missing_light
    }

    /// Irradiance of the plane by infinitely distant lights, as if the scene were absent, W·m⁻².
    pub fn irradiance(&self) -> Spectrum {
        self.irradiance
    }

    /// Returns a factor and an offset for the point `p` at `time`. The fraction of the light that
    /// arrives is the reflected radiance times the factor, plus the offset. `lights` are all lights
    /// of the scene. In a channel in which no light would arrive without the scene, the fraction is
    /// 1.
    pub fn shadow(&self, p: Vec3, time: f32, lights: &[Light]) -> (Spectrum, Spectrum) {
        let finite = self.finite.iter().filter_map(|id| lights.get(id.0 as usize));
        let unshadowed = finite.fold(self.irradiance, |sum, light| {
            sum + light.irradiance_at(p, self.plane.normal, time).unwrap_or_default()
        });
        let strength = self.strength(p);
        let (albedo, unshadowed) = (self.plane.albedo.to_array(), unshadowed.to_array());
        let factor = [0, 1, 2].map(|c| strength * PI / (albedo[c] * unshadowed[c]));
        let is_known = |c: usize| unshadowed[c] > 0.0 && factor[c].is_finite();
        let pick = |known: [f32; 3], unknown: f32| [0, 1, 2].map(|c| if is_known(c) { known[c] } else { unknown });
        (pick(factor, 0.0).into(), pick([1.0 - strength; 3], 1.0).into())
    }

    /// Strength of shadows at `p`: 1 near the middle, falling to 0 where shadows end.
    fn strength(&self, p: Vec3) -> f32 {
        let r = p.distance(self.plane.point) / self.plane.shadow_radius;
        smooth_step((1.0 - r) / (1.0 - FADE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;

    fn bounds() -> Bounds3 {
        Bounds3 {
            min: Vec3::new(-1.0, 2.0, 0.0),
            max: Vec3::new(3.0, 4.0, 1.0),
        }
    }

    #[test]
    fn the_plane_lies_just_below_the_lowest_point() {
        for (up, height) in [(Vec3::Y, 2.0), (2.0 * Vec3::Z, 0.0), (-Vec3::X, -3.0)] {
            let plane = GroundPlane {
                up,
                ..GroundPlane::default()
            };
            let placed = plane.place(bounds()).unwrap();
            let along = placed.point.dot(up.normalize());
            let gap = GAP * bounds().radius();
            assert!((along - (height - gap)).abs() < 1e-5, "{up}: {along}");
            assert_eq!(
                (placed.normal, placed.radius),
                (up.normalize(), 50.0 * bounds().radius())
            );
            // The front of the mesh faces along the normal.
            let mesh = placed.mesh();
            for triangle in mesh.triangles {
                let [a, b, c]: [DVec3; 3] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
                let n = (b - a).cross(c - a).normalize();
                assert!(n.dot(placed.normal.as_dvec3()) > 0.999_99);
            }
        }
        let tilted = GroundPlane {
            point: Some(Vec3::ONE),
            normal: Some(Vec3::new(3.0, 0.0, 0.0)),
            radius: Some(7.0),
            ..GroundPlane::default()
        };
        let placed = tilted.place(bounds()).unwrap();
        assert_eq!((placed.point, placed.normal, placed.radius), (Vec3::ONE, Vec3::X, 7.0));
        assert!(GroundPlane::default().place(Bounds3::EMPTY).unwrap().radius > 1.0);
    }

    #[test]
    fn invalid_planes_are_errors() {
        let usual = GroundPlane::default;
        let wrong = [
            GroundPlane {
                up: Vec3::ZERO,
                ..usual()
            },
            GroundPlane {
                normal: Some(Vec3::NAN),
                ..usual()
            },
            GroundPlane {
                point: Some(Vec3::splat(1e11)),
                ..usual()
            },
            GroundPlane {
                radius: Some(0.0),
                ..usual()
            },
            GroundPlane {
                radius: Some(f32::INFINITY),
                ..usual()
            },
            GroundPlane {
                shadow_radius: Some(-1.0),
                ..usual()
            },
            GroundPlane {
                albedo: Spectrum::ZERO,
                ..usual()
            },
            GroundPlane {
                albedo: Spectrum::rgb(0.5, 0.5, 1.5),
                ..usual()
            },
        ];
        for plane in wrong {
            let error = plane.check().unwrap_err().to_string();
            assert!(error.starts_with("ground: "), "{error}");
        }
        assert_eq!(usual().check(), Ok(()));
    }

    #[test]
    fn shadows_fade_at_the_rim() {
        let plane = GroundPlane {
            radius: Some(10.0),
            ..GroundPlane::default()
        };
        let ground = Ground::new(GeomId(0), plane.place(bounds()).unwrap(), &[]).unwrap();
        let strength = |r: f32| ground.strength(ground.point() + r * Vec3::X);
        assert_eq!(
            (strength(0.0), strength(4.99), strength(10.0), strength(12.0)),
            (1.0, 1.0, 0.0, 0.0)
        );
        assert!((strength(7.5) - 0.5).abs() < 1e-5);
        let inner = GroundPlane {
            shadow_radius: Some(2.0),
            ..plane
        };
        let placed = inner.place(bounds()).unwrap();
        let inner = Ground::new(GeomId(0), placed, &[]).unwrap();
        let strength = |r: f32| inner.strength(inner.point() + r * Vec3::X);
        assert_eq!((placed.radius, strength(0.9), strength(2.0)), (10.0, 1.0, 0.0));
        // Without any light the ground is invisible.
        assert_eq!(ground.shadow(ground.point(), 0.0, &[]), (Spectrum::ZERO, Spectrum::ONE));
    }
}
