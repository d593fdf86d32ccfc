//! `[[light]]`: its keys, and the light that they make.

use super::color_value::color;
use super::environment::{BYTES_OF_A_NEW_TEXEL, Environment, environment_bytes, read_environment};
use super::exact_list::numbers;
use super::light_group_section::light_group;
use super::memory::Allowance;
use super::source::Source;
use super::{FileError, Findings, Severity};
use crate::light::STUDIO_SIZE;
use crate::light::sky::{DEFAULT_TURBIDITY, SKY_SIZE};
use crate::math::{Quat, Vec3, excerpt, excerpt_of_path, rotation_from_degrees};
use crate::scene::{
    BuildError, DiskParameters, RectangleParameters, SceneBuilder, SkyParameters, SphereParameters, StudioParameters,
};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// `[[light]]`; which keys belong to it depends on its type.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LightSection {
    /// Type: one of [`LightSection::TYPES`].
    #[serde(rename = "type")]
    pub kind: Spanned<String>,
    /// Name of the group that the light is in, if it is in one.
    pub group: Option<Spanned<String>>,
    /// Position of a point or spot light; centre of a sphere, a disk or a rectangle.
    #[serde(default, deserialize_with = "numbers")]
    pub position: Option<Spanned<[f32; 3]>>,
    /// Intensity of a point or spot light, W/sr.
    #[serde(default, deserialize_with = "color")]
    pub intensity: Option<Spanned<[f32; 3]>>,
    /// Direction in which a directional or spot light travels; normal of the side of a disk or a rectangle that emits.
    #[serde(default, deserialize_with = "numbers")]
    pub direction: Option<Spanned<[f32; 3]>>,
    /// What a spot light shines at, in place of `direction`.
    #[serde(default, deserialize_with = "numbers")]
    pub look_at: Option<Spanned<[f32; 3]>>,
    /// Half-angle of a spot light's cone, or diameter of a directional light's disc, degrees.
    pub angle: Option<Spanned<f32>>,
    /// Half-angle at which a spot light begins to fall off, degrees.
    pub falloff: Option<Spanned<f32>>,
    /// Irradiance of a directional light, W·m⁻² on a surface that faces it.
    #[serde(default, deserialize_with = "color")]
    pub irradiance: Option<Spanned<[f32; 3]>>,
    /// Radiance of a constant environment, a sphere, a disk or a rectangle, W·sr⁻¹·m⁻².
    #[serde(default, deserialize_with = "color")]
    pub radiance: Option<Spanned<[f32; 3]>>,
    /// Picture of an environment, latitude and longitude.
    pub image: Option<Spanned<PathBuf>>,
    /// Factor of the radiance of an environment, a sky or a studio.
    pub scale: Option<Spanned<f32>>,
    /// Rotation of an environment, degrees.
    pub rotate: Option<Spanned<Rotation>>,
    /// Azimuth and elevation of a sky's sun, degrees.
    #[serde(default, deserialize_with = "numbers")]
    pub sun: Option<Spanned<[f32; 2]>>,
    /// Haze of a sky.
    pub turbidity: Option<Spanned<f32>>,
    /// Up in a sky or a studio, and along the height of a rectangle.
    #[serde(default, deserialize_with = "numbers")]
    pub up: Option<Spanned<[f32; 3]>>,
    /// Azimuth at which the camera stands in a studio, degrees.
    pub front: Option<Spanned<f32>>,
    /// Width and height of a rectangle.
    #[serde(default, deserialize_with = "numbers")]
    pub size: Option<Spanned<[f32; 2]>>,
    /// Radius of a sphere or a disk.
    pub radius: Option<Spanned<f32>>,
}

/// Degrees about +y, or about the fixed x, y and z axes in this order.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "rotate must be a number or three numbers")]
pub enum Rotation {
    /// About +y.
    Up(f32),
    /// About x, y and z.
    Axes([f32; 3]),
}

/// Where a spot light falls off, as a share of its angle, if it does not say.
const DEFAULT_FALLOFF: f32 = 0.8;
/// Azimuth and elevation of the sun of a sky that does not say, degrees: to the left of a camera at azimuth 0, and half way up.
pub const DEFAULT_SUN: [f32; 2] = [-45.0, 45.0];

impl LightSection {
    /// All types of lights.
    pub const TYPES: [&str; 10] = [
        "point",
        "directional",
        "spot",
        "constant",
        "environment",
        "sky",
        "studio",
        "rectangle",
        "sphere",
        "disk",
    ];

    /// A light of a type, of which nothing else is said yet. Errors that concern it are told at the bytes `span` of its file
    /// ([`flag_span`](super::SceneFile::flag_span)).
    pub fn of_type(kind: &str, span: Range<usize>) -> Self {
        Self {
            kind: Spanned::new(span, kind.to_string()),
            group: None,
            position: None,
            intensity: None,
            direction: None,
            look_at: None,
            angle: None,
            falloff: None,
            irradiance: None,
            radiance: None,
            image: None,
            scale: None,
            rotate: None,
            sun: None,
            turbidity: None,
            up: None,
            front: None,
            size: None,
            radius: None,
        }
    }

    /// Whether the light is an environment: it has a radiance in every direction.
    pub fn is_environment(&self) -> bool {
        matches!(
            self.kind.get_ref().as_str(),
            "constant" | "environment" | "sky" | "studio"
        )
    }

    /// Adds the light to `builder`; what cannot be is an error at its place in `file`.
    pub(super) fn add_to(
        &self,
        builder: &mut SceneBuilder,
        file: &Source,
        allowance: &mut Allowance,
        findings: &mut Findings,
    ) -> Result<(), FileError> {
        let name = self.group.as_ref();
        let group = name.map(|name| light_group(builder, file, name)).transpose()?;
        builder.begin_light_group(group);
        let added = match self.kind.get_ref().as_str() {
            "point" => {
                self.allow(file, &["position", "intensity"])?;
                let position = self.required(file, "position", &self.position)?;
                let intensity = self.required(file, "intensity", &self.intensity)?;
                builder.add_point_light(position.into(), intensity.into())
            }
            "directional" => {
                self.allow(file, &["direction", "irradiance", "angle"])?;
                let direction = self.required(file, "direction", &self.direction)?;
                let irradiance = self.required(file, "irradiance", &self.irradiance)?;
                let angle = self.angle.as_ref().map_or(0.0, |angle| *angle.get_ref());
                builder.add_sun(direction.into(), irradiance.into(), angle)
            }
            "spot" => {
                self.allow(
                    file,
                    &["position", "direction", "look_at", "intensity", "angle", "falloff"],
                )?;
                let position: Vec3 = self.required(file, "position", &self.position)?.into();
                let direction = match (&self.direction, &self.look_at) {
                    (Some(_), Some(at)) => {
                        let error = file.error(at.span(), "both `direction` and `look_at`");
                        return Err(error.help("keep one of them"));
                    }
                    (None, Some(at)) => Vec3::from(*at.get_ref()) - position,
                    (direction, None) => self.required(file, "direction", direction)?.into(),
                };
                let intensity = self.required(file, "intensity", &self.intensity)?;
                let angle = self.required(file, "angle", &self.angle)?;
                let falloff = self.falloff.as_ref().map_or(DEFAULT_FALLOFF * angle, |f| *f.get_ref());
                builder.add_spot_light(position, direction, intensity.into(), angle, falloff)
            }
            "constant" => {
                self.allow(file, &["radiance"])?;
                let radiance = self.required(file, "radiance", &self.radiance)?;
                builder.add_constant_light(radiance.into())
            }
            "environment" => {
                self.allow(file, &["image", "scale", "rotate"])?;
                let Some(name) = &self.image else {
                    return Err(self.missing(file, "image", "\"FILE.hdr\""));
                };
                let path = file.resolve(name.get_ref());
                let Environment { image, repairs } = read_environment(&path, *allowance).map_err(|error| {
                    let message = format!(
                        "environment {}: {}",
                        excerpt_of_path(&path.to_string_lossy()),
                        error.message
                    );
                    let place = file.error(name.span(), message);
                    let help =
                        "name a picture of latitude and longitude, .hdr or .exr; the path is relative to this file";
                    place.help(error.help.as_deref().unwrap_or(help))
                })?;
                for repair in repairs {
                    let message = format!("environment {}: {repair}", path.display());
                    findings.add(Severity::Warning, "bad-texels", file.error(name.span(), message));
                }
                allowance.kept += environment_bytes(image.texels.len() as u64);
                builder.add_environment(image, self.factor(), self.rotation())
            }
            "sky" => {
                self.allow(file, &["sun", "turbidity", "up", "scale"])?;
                self.reserve(file, SKY_SIZE, allowance)?;
                builder.add_sky(&SkyParameters {
                    sun: self.sun.as_ref().map_or(DEFAULT_SUN, |sun| *sun.get_ref()),
                    turbidity: self.turbidity.as_ref().map_or(DEFAULT_TURBIDITY, |t| *t.get_ref()),
                    up: self.up_or_y(),
                    scale: self.factor(),
                })
            }
            "studio" => {
                self.allow(file, &["up", "front", "scale"])?;
                self.reserve(file, STUDIO_SIZE, allowance)?;
                builder.add_studio(&StudioParameters {
                    up: self.up_or_y(),
                    front: self.front.as_ref().map_or(0.0, |front| *front.get_ref()),
                    scale: self.factor(),
                })
            }
            "rectangle" => {
                self.allow(file, &["position", "direction", "size", "up", "radiance"])?;
                builder.add_rectangle(&RectangleParameters {
                    position: self.required(file, "position", &self.position)?.into(),
                    direction: self.required(file, "direction", &self.direction)?.into(),
                    size: self.required(file, "size", &self.size)?,
                    up: self.up.as_ref().map(|up| Vec3::from(*up.get_ref())),
                    radiance: self.required(file, "radiance", &self.radiance)?.into(),
                })
            }
            "sphere" => {
                self.allow(file, &["position", "radius", "radiance"])?;
                builder.add_sphere(&SphereParameters {
                    position: self.required(file, "position", &self.position)?.into(),
                    radius: self.required(file, "radius", &self.radius)?,
                    radiance: self.required(file, "radiance", &self.radiance)?.into(),
                })
            }
            "disk" => {
                self.allow(file, &["position", "direction", "radius", "radiance"])?;
                builder.add_disk(&DiskParameters {
                    position: self.required(file, "position", &self.position)?.into(),
                    direction: self.required(file, "direction", &self.direction)?.into(),
                    radius: self.required(file, "radius", &self.radius)?,
                    radiance: self.required(file, "radiance", &self.radiance)?.into(),
                })
            }
            other => {
                let error = file.error(self.kind.span(), format!("unknown type of light `{}`", excerpt(other)));
                let [types @ .., last] = Self::TYPES;
                return Err(error.help(format!("choose from {} and {last}", types.join(", "))));
            }
        };
        added.map_err(|error| {
            let span = self.span_of(&error).unwrap_or(self.kind.span());
            file.error(span, error.to_string()).help("correct the value")
        })
    }

    /// Sets memory aside for a picture of that size, which is made and not read.
    fn reserve(&self, file: &Source, size: [usize; 2], allowance: &mut Allowance) -> Result<(), FileError> {
        let texels = (size[0] * size[1]) as u64;
        let checked = allowance.check(Path::new(""), texels * BYTES_OF_A_NEW_TEXEL);
        checked.map_err(|error| FileError {
            help: error.help,
            ..file.error(self.kind.span(), error.message)
        })?;
        allowance.kept += environment_bytes(texels);
        Ok(())
    }

    /// Factor of the radiance; 1 if nothing is said.
    fn factor(&self) -> f32 {
        self.scale.as_ref().map_or(1.0, |scale| *scale.get_ref())
    }

    /// Up; +y if nothing is said.
    fn up_or_y(&self) -> Vec3 {
        self.up.as_ref().map_or(Vec3::Y, |up| Vec3::from(*up.get_ref()))
    }

    fn rotation(&self) -> Quat {
        match self.rotate.as_ref().map(Spanned::get_ref) {
            None => Quat::IDENTITY,
            Some(&Rotation::Up(degrees)) => rotation_from_degrees(Vec3::new(0.0, degrees, 0.0)),
            Some(&Rotation::Axes(degrees)) => rotation_from_degrees(degrees.into()),
        }
    }

    /// Every key but `type` and `group`, which all lights may have, with its place if it is there.
    fn keys(&self) -> [(&'static str, Option<Range<usize>>); 17] {
        fn span<T>(value: &Option<Spanned<T>>) -> Option<Range<usize>> {
            value.as_ref().map(Spanned::span)
        }
        [
            ("position", span(&self.position)),
            ("intensity", span(&self.intensity)),
            ("direction", span(&self.direction)),
            ("look_at", span(&self.look_at)),
            ("angle", span(&self.angle)),
            ("falloff", span(&self.falloff)),
            ("irradiance", span(&self.irradiance)),
            ("radiance", span(&self.radiance)),
            ("image", span(&self.image)),
            ("scale", span(&self.scale)),
            ("rotate", span(&self.rotate)),
            ("sun", span(&self.sun)),
            ("turbidity", span(&self.turbidity)),
            ("up", span(&self.up)),
            ("front", span(&self.front)),
            ("size", span(&self.size)),
            ("radius", span(&self.radius)),
        ]
    }

    /// The place of the key that an error is about.
    fn span_of(&self, error: &BuildError) -> Option<Range<usize>> {
        let BuildError::BadLight { key, .. } = error else {
            return None;
        };
        self.keys().into_iter().find(|(name, _)| name == key)?.1
    }

    /// Refuses keys that belong to lights of another type.
    fn allow(&self, file: &Source, allowed: &[&str]) -> Result<(), FileError> {
        for (key, span) in self.keys() {
            if let Some(span) = span.filter(|_| !allowed.contains(&key)) {
                let message = format!("a {} light has no `{key}`", self.kind.get_ref());
                let help = format!("its keys are {}", allowed.join(", "));
                return Err(file.error(span, message).help(help));
            }
        }
        Ok(())
    }

    fn required<T: Copy>(&self, file: &Source, key: &str, value: &Option<Spanned<T>>) -> Result<T, FileError> {
        let example = match size_of::<T>() / size_of::<f32>() {
            1 => "NUMBER",
            2 => "[ , ]",
            _ => "[ , , ]",
        };
        value
            .as_ref()
            .map(|v| *v.get_ref())
            .ok_or_else(|| self.missing(file, key, example))
    }

    fn missing(&self, file: &Source, key: &str, example: &str) -> FileError {
        let message = format!("a {} light needs `{key}`", self.kind.get_ref());
        file.error(self.kind.span(), message)
            .help(format!("add {key} = {example} to this [[light]]"))
    }
}
