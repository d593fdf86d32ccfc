//! `[[light]]`: its keys, and conversion of the section to a light.

use super::environment::{BYTES_OF_A_NEW_TEXEL, Environment, environment_bytes, read_environment};
use super::key_schema::{either, list, number};
use super::light_group_section::{group_name, light_group};
use super::memory::Allowance;
use super::section::{Section, key_types, section, value};
use super::source::Source;
use super::{ColorValue, FileError, Findings, Severity};
use crate::color::Spectrum;
use crate::light::sky::{DEFAULT_TURBIDITY, SKY_SIZE};
use crate::light::{LatLongImage, STUDIO_SIZE};
use crate::math::{Quat, Vec3, excerpt, excerpt_of_path, rotation_from_degrees};
use crate::options::{Parameter, Range as Numbers};
use crate::scene::{
    BuildError, DiskParameters, RectangleParameters, SceneBuilder, SkyParameters, SphereParameters, StudioParameters,
};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

section! {
    /// `[[light]]`. The key `type` decides which other keys are valid.
    #[derive(PartialEq)]
    pub struct LightSection {
        required {
            /// Type of the light
            kind as "type": String, schema json!({ "enum": LightType::names() });
        }
        /// Name of the light group
        group: String, default "none", schema group_name();
        /// Position of a point or spot light; middle of a sphere, a disk or a rectangle
        position: [f32; 3], in Numbers::FromTo(-1e15, 1e15);
        /// Intensity of a point or spot light, W/sr
        intensity: ColorValue, in Numbers::AtLeast(0.0);
        /// Direction in which a directional or spot light travels; normal of the side of a disk or
        /// a rectangle that emits
        direction: [f32; 3];
        /// Point that a spot light shines at
        look_at: [f32; 3];
        /// Half-angle of a spot light's cone, or diameter of a directional light's disc, degrees
        angle: f32;
        /// Half-angle from which a spot light falls off, degrees
        falloff: f32, default "0.8 times angle", in Numbers::AtLeast(0.0);
        /// Irradiance of a directional light on a surface that faces it, W·m⁻²
        irradiance: ColorValue, in Numbers::AtLeast(0.0);
        /// Radiance of a constant environment, a sphere, a disk or a rectangle, W·sr⁻¹·m⁻²
        radiance: ColorValue, in Numbers::AtLeast(0.0);
        /// Picture of an environment, .hdr or .exr, latitude and longitude
        image: PathBuf;
        /// Factor of the radiance of an environment, a sky or a studio
        scale: f32, default "1", in Numbers::AtLeast(0.0);
        /// Rotation of an environment: degrees about +y, or about the fixed x, y and z axes
        rotate: Rotation, default "0";
        /// Azimuth and elevation of a sky's sun, degrees
        sun: [f32; 2], default "-45 45", schema azimuth_and_elevation();
        /// Haze of a sky
        turbidity: f32, default "3", in Numbers::FromTo(2.0, 10.0);
        /// Up in a sky or a studio, and along the height of a rectangle
        up: [f32; 3], default "0 1 0";
        /// Azimuth of the front of a studio, where the camera stands, degrees
        front: f32, default "0";
        /// Width and height of a rectangle
        size: [f32; 2], in Numbers::Above(0.0);
        /// Radius of a sphere or a disk
        radius: f32, in Numbers::Above(0.0);
    }
}

/// Valid keys of a light type, in addition to `type` and `group`.
pub(crate) struct LightType {
    pub name: &'static str,
    pub required: &'static [&'static str],
    pub optional: &'static [&'static str],
    /// Keys of which exactly one must be given.
    pub one_of: &'static [&'static str],
    /// Meaning and schema of the key `angle`, if the type has it.
    pub angle: Option<Angle>,
}

/// Meaning and schema of the key `angle` for a light type.
#[derive(Clone, Copy)]
pub(crate) struct Angle {
    help: &'static str,
    schema: fn() -> Value,
}

impl LightType {
    /// All light types.
    pub const ALL: &'static [Self] = &[
        Self::new("point", &["position", "intensity"], &[]),
        Self::new("directional", &["direction", "irradiance"], &["angle"]).with_angle(
            "Diameter of the disc, degrees; 0 is parallel light, the sun has 0.53",
            || either(&[json!({ "enum": [0] }), number(Numbers::FromTo(0.01, 180.0))]),
        ),
        Self {
            one_of: &["direction", "look_at"],
            ..Self::new(
                "spot",
                &["position", "intensity", "angle"],
                &["direction", "look_at", "falloff"],
            )
        }
        .with_angle("Half-angle of the cone, degrees", || {
            number(Numbers::AboveTo(0.0, 90.0))
        }),
        Self::new("constant", &["radiance"], &[]),
        Self::new("environment", &["image"], &["scale", "rotate"]),
        Self::new("sky", &[], &["sun", "turbidity", "up", "scale"]),
        Self::new("studio", &[], &["up", "front", "scale"]),
        Self::new("rectangle", &["position", "direction", "size", "radiance"], &["up"]),
        Self::new("sphere", &["position", "radius", "radiance"], &[]),
        Self::new("disk", &["position", "direction", "radius", "radiance"], &[]),
    ];

    const fn new(name: &'static str, required: &'static [&'static str], optional: &'static [&'static str]) -> Self {
        Self {
            name,
            required,
            optional,
            one_of: &[],
            angle: None,
        }
    }

    const fn with_angle(self, help: &'static str, schema: fn() -> Value) -> Self {
        Self {
            angle: Some(Angle { help, schema }),
            ..self
        }
    }

    /// The light type with the name `name`.
    pub fn of_name(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|kind| kind.name == name)
    }

    /// Names of all light types.
    pub fn names() -> Vec<&'static str> {
        Self::ALL.iter().map(|kind| kind.name).collect()
    }

    /// All keys of the type. Required keys are first.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> {
        self.required.iter().chain(self.optional).copied()
    }

    /// Schema of the key `angle`, with its help.
    pub fn angle_schema(&self) -> Option<Value> {
        self.angle.map(|Angle { help, schema }| {
            let mut schema = schema();
            schema["description"] = json!(help);
            schema
        })
    }
}

/// Schema of azimuth and elevation of a sun.
fn azimuth_and_elevation() -> Value {
    let elevation = number(Numbers::FromTo(-90.0, 90.0));
    json!({ "type": "array", "items": [number(Numbers::Any), elevation], "additionalItems": false, "minItems": 2 })
}

/// Rotation in degrees, about +y or about the fixed x, y and z axes in this order.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "rotate must be a number or three numbers")]
pub enum Rotation {
    /// Rotation about +y.
    Up(f32),
    /// Rotations about x, y and z.
    Axes([f32; 3]),
}

key_types! {
    Rotation: |number| either(&[number.clone(), list(3, number)]);
}

/// Default half-angle at which a spot light begins to fall off, as a fraction of `angle`.
const DEFAULT_FALLOFF: f32 = 0.8;
/// Default azimuth and elevation of the sun of a sky, in degrees. The sun is to the left of a
/// camera at azimuth 0, half way between horizon and zenith.
pub const DEFAULT_SUN: [f32; 2] = [-45.0, 45.0];

impl LightSection {
    /// A light of the type `kind` without any other key. Errors about the light point to the bytes
    /// `span` of the scene file ([`flag_span`](super::SceneFile::flag_span)).
    pub fn of_type(kind: &str, span: Range<usize>) -> Self {
        Self::new(Spanned::new(span, kind.to_string()))
    }

    /// Returns true if the light is an environment: it has radiance in every direction.
    pub fn is_environment(&self) -> bool {
        matches!(
            self.kind.get_ref().as_str(),
            "constant" | "environment" | "sky" | "studio"
        )
    }

    /// Adds the light to `builder`. If a value is invalid, the error points to it in `file`.
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
        self.check_keys(file)?;
        // `check_keys` has checked that the required keys exist.
        let vector = |key: &Option<Spanned<[f32; 3]>>| value(key).map(Vec3::from).unwrap_or_default();
        let color = |key: &Option<Spanned<ColorValue>>| value(key).map(Spectrum::from).unwrap_or_default();
        let number = |key: &Option<Spanned<f32>>| value(key).unwrap_or_default();
        let scale = value(&self.scale).unwrap_or(1.0);
        let up = value(&self.up).map(Vec3::from);
        let added = match self.kind.get_ref().as_str() {
            "point" => builder.add_point_light(vector(&self.position), color(&self.intensity)),
            "directional" => builder.add_sun(vector(&self.direction), color(&self.irradiance), number(&self.angle)),
            "spot" => {
                let position = vector(&self.position);
                let direction = match value(&self.look_at) {
                    Some(at) => Vec3::from(at) - position,
                    None => vector(&self.direction),
                };
                let angle = number(&self.angle);
                let falloff = value(&self.falloff).unwrap_or(DEFAULT_FALLOFF * angle);
                builder.add_spot_light(position, direction, color(&self.intensity), angle, falloff)
            }
            "constant" => builder.add_constant_light(color(&self.radiance)),
            "environment" => {
                let image = self.image(file, allowance, findings)?;
                builder.add_environment(image, scale, self.rotation())
            }
            "sky" => {
                self.reserve(file, SKY_SIZE, allowance)?;
                builder.add_sky(&SkyParameters {
                    sun: value(&self.sun).unwrap_or(DEFAULT_SUN),
                    turbidity: value(&self.turbidity).unwrap_or(DEFAULT_TURBIDITY),
                    up: up.unwrap_or(Vec3::Y),
                    scale,
                })
            }
            "studio" => {
                self.reserve(file, STUDIO_SIZE, allowance)?;
                builder.add_studio(&StudioParameters {
                    up: up.unwrap_or(Vec3::Y),
                    front: number(&self.front),
                    scale,
                })
            }
            "rectangle" => builder.add_rectangle(&RectangleParameters {
                position: vector(&self.position),
                direction: vector(&self.direction),
                size: value(&self.size).unwrap_or_default(),
                up,
                radiance: color(&self.radiance),
            }),
            "sphere" => builder.add_sphere(&SphereParameters {
                position: vector(&self.position),
                radius: number(&self.radius),
                radiance: color(&self.radiance),
            }),
            "disk" => builder.add_disk(&DiskParameters {
                position: vector(&self.position),
                direction: vector(&self.direction),
                radius: number(&self.radius),
                radiance: color(&self.radiance),
            }),
            _ => return Err(self.unknown_type(file)),
        };
        added.map_err(|error| {
            let span = self.place_of(&error).unwrap_or(self.kind.span());
            file.error(span, error.to_string()).help("correct the value")
        })
    }

    /// Reads the image of an environment.
    fn image(
        &self,
        file: &Source,
        allowance: &mut Allowance,
        findings: &mut Findings,
    ) -> Result<LatLongImage, FileError> {
        let Some(name) = &self.image else {
            return Err(self.missing(file, "image"));
        };
        let path = file.resolve(name.get_ref());
        let Environment { image, repairs } = read_environment(&path, *allowance).map_err(|error| {
            let message = format!(
                "environment {}: {}",
                excerpt_of_path(&path.to_string_lossy()),
                error.message
            );
            let place = file.error(name.span(), message);
            let help = "name a picture of latitude and longitude, .hdr or .exr; the path is relative to the scene file";
            place.help(error.help.as_deref().unwrap_or(help))
        })?;
        for repair in repairs {
            let message = format!("environment {}: {repair}", path.display());
            findings.add(Severity::Warning, "bad-texels", file.error(name.span(), message));
        }
        allowance.kept += environment_bytes(image.texels.len() as u64);
        Ok(image)
    }

    /// Reserves memory for a generated environment image of `size` texels.
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

    fn rotation(&self) -> Quat {
        match value(&self.rotate) {
            None => Quat::IDENTITY,
            Some(Rotation::Up(degrees)) => rotation_from_degrees(Vec3::new(0.0, degrees, 0.0)),
            Some(Rotation::Axes(degrees)) => rotation_from_degrees(degrees.into()),
        }
    }

    /// Span of the key that causes `error`, if the section has the key.
    fn place_of(&self, error: &BuildError) -> Option<Range<usize>> {
        match error {
            BuildError::BadLight { key, .. } => self.span_of(key),
            _ => None,
        }
    }

    /// Checks that the type exists, that all required keys are given, and that no key belongs to
    /// another type.
    fn check_keys(&self, file: &Source) -> Result<(), FileError> {
        let name = self.kind.get_ref();
        let kind = LightType::of_name(name).ok_or_else(|| self.unknown_type(file))?;
        let given = self.given();
        let is_common = |key: &str| ["type", "group"].contains(&key);
        if let Some(other) = given
            .iter()
            .find(|given| !is_common(given.key) && kind.keys().all(|key| key != given.key))
        {
            let message = format!("a {name} light has no `{}`", other.key);
            let help = format!("its keys are {}", kind.keys().collect::<Vec<_>>().join(", "));
            return Err(file.error(other.span.clone(), message).help(help));
        }
        let mut of_choice = given.iter().filter(|given| kind.one_of.contains(&given.key));
        if let (Some(first), Some(second)) = (of_choice.next(), of_choice.next()) {
            let error = file.error(
                second.span.clone(),
                format!("both `{}` and `{}` are given", first.key, second.key),
            );
            return Err(error.help("keep one of them"));
        }
        let has = |key: &&&str| given.iter().any(|given| given.key == **key);
        let has_choice = kind.one_of.iter().any(|key| has(&key));
        let choice = kind.one_of.first().filter(|_| !has_choice);
        match kind.required.iter().find(|key| !has(key)).or(choice) {
            Some(key) => Err(self.missing(file, key)),
            None => Ok(()),
        }
    }

    /// Error for an unknown type.
    fn unknown_type(&self, file: &Source) -> FileError {
        let message = format!("unknown type of light `{}`", excerpt(self.kind.get_ref()));
        let names = LightType::names();
        let (last, others) = names.split_last().unwrap_or((&"", &[]));
        let error = file.error(self.kind.span(), message);
        error.help(format!("choose from {} and {last}", others.join(", ")))
    }

    /// Error for a missing required key.
    fn missing(&self, file: &Source, key: &str) -> FileError {
        let schema = Self::KEYS.iter().find(|known| known.key == key).map(Parameter::schema);
        let schema = schema.unwrap_or_default();
        let example = if schema["type"] == "string" {
            "\"FILE.hdr\""
        } else if schema["type"] == "number" {
            "NUMBER"
        } else if schema["minItems"] == 2 {
            "[ , ]"
        } else {
            "[ , , ]"
        };
        let message = format!("a {} light needs `{key}`", self.kind.get_ref());
        file.error(self.kind.span(), message)
            .help(format!("add {key} = {example} to this [[light]]"))
    }
}
