//! How an image was made, as attributes of EXR files. The names of the attributes are in
//! docs/guide/reference/output.md.

use super::exr_text::{exr_text, text_attribute};
use crate::camera::{CameraAttributes, ScreenWindow};
use crate::color::Tone;
use crate::compare::CommonErrors;
use crate::film::{Aov, Backing, Image, metered};
use crate::math::{UVec2, encode_fields};
use crate::options::{DrawingScale, Finish, Print, Value, backing_of, name_of, view_size_of};
use ::exr::prelude as exr;
use serde::{Deserialize, Serialize};

// Names of attributes
const VERSION: &str = "embrasure.version";
const BUILD: &str = "embrasure.build";
const SCENE_HASH: &str = "embrasure.sceneHash";
pub(super) const SETTINGS: &str = "embrasure.settings";
pub(super) const COMMON_ERRORS: &str = "embrasure.commonErrors";
const SAMPLES: &str = "embrasure.samples";
const TOTAL: &str = "embrasure.totalSamples";
const SEED: &str = "embrasure.seed";
const BACKEND: &str = "embrasure.backend";
const BACKEND_VERSION: &str = "embrasure.backendVersion";
const COMPLETE: &str = "embrasure.complete";
pub(super) const FEATURES: &str = "embrasure.features";
pub(super) const DENOISER: &str = "embrasure.denoiser";
pub(super) const FINISH: &str = "embrasure.finish";
pub(super) const TONE: &str = "embrasure.tone";
pub(super) const BIAS: &str = "embrasure.bias";
const ORIGIN: &str = "embrasure.origin";
const SCALE: &str = "embrasure.scale";
const RENDER_TIME: &str = "renderTime";

// Standard attributes of the camera for which the crate exr has no fields
const FOCAL_LENGTH: &str = "pinholeFocalLength";
const SENSOR: &str = "sensorOverallDimensions";

/// How an image was made, written with its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Metadata {
    /// Name and version of this program.
    pub version: String,
    /// Name of the build of this program: results are bit-identical only within one build. Empty in
    /// files without this attribute.
    pub build: String,
    /// Hash of the frozen scene and the camera.
    pub scene_hash: String,
    /// Method of the render: integrator, sampler, depth and others, as `key=value` pairs.
    pub settings: String,
    /// Kind of sampling error that several pixels have in common. `None` in files of earlier
    /// builds.
    pub common_errors: Option<CommonErrors>,
    /// Index of the first sample.
    pub first_sample: u32,
    /// End of the range of requested sample indices, exclusive.
    pub end_sample: u32,
    /// Samples per pixel of the whole picture. The file may hold only some of these samples.
    pub total_samples: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Name of the ray-tracing backend.
    pub backend: String,
    /// Version and instruction set of the backend.
    pub backend_version: String,
    /// Wall-clock time of rendering in seconds.
    pub render_seconds: f64,
    /// True if the render took all its samples.
    pub complete: bool,
    /// Names of additional channels, objects, parts and materials. `None` if there are no
    /// additional channels.
    pub features: Option<FeatureNames>,
    /// Requested denoiser, exposure and tone curve of the render ([`Finish`]). Empty in files
    /// without this attribute.
    pub finish: String,
    /// Denoiser that was applied to the picture, if any.
    pub denoiser: Option<String>,
    /// Tone curve and exposure of the picture's PNG files, `tone=NAME exposure=STOPS`, if the
    /// exposure was automatic. They do not affect the values in the EXR file.
    pub tone: Option<String>,
    /// Setting that biases the mean of the picture, as `key=value`. `None` if the picture is not
    /// biased.
    pub bias: Option<String>,
    /// Origin of the positions in the picture, `x,y,z` in coordinates of the OBJ file. `None` if it
    /// is the origin of the file.
    pub origin: Option<String>,
    /// The camera; `None` in files without its attributes.
    pub camera: Option<CameraAttributes>,
    /// Scale of the picture on paper, if any.
    pub print: Option<Print>,
}

encode_fields!(Metadata {
    version,
    build,
    scene_hash,
    settings,
    common_errors,
    first_sample,
    end_sample,
    total_samples,
    seed,
    backend,
    backend_version,
    render_seconds,
    complete,
    features,
    finish,
    denoiser,
    tone,
    bias,
    origin,
    camera,
    print,
});

/// Requested channels, and the names that belong to ids.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FeatureNames {
    /// Channels by the names in [`Aov::NAMES`](crate::film::Aov::NAMES).
    pub aovs: Vec<String>,
    /// Objects of the scene, in the order of their ids.
    pub objects: Vec<String>,
    /// Parts of the scene that are not objects. [`Scene::part`](crate::scene::Scene::part) numbers
    /// them after the objects.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts_of_objects: Vec<String>,
    /// Materials of the scene, in the order of their ids.
    pub materials: Vec<String>,
    /// Light groups, if they have separate layers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<String>,
    /// Strategies of a bidirectional method, `sS_tT`, if they have separate layers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub strategies: Vec<String>,
    /// Layers of light path expressions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paths: Vec<String>,
}

impl FeatureNames {
    /// Names for the numbers 1, 2, … of the channel `channel`, such as `id.material`. `None` if
    /// its numbers have no names.
    pub fn of_ids(&self, channel: &str) -> Option<Vec<&str>> {
        let names: Vec<&String> = match channel {
            "id.object" => self.objects.iter().collect(),
            "id.part" => self.objects.iter().chain(&self.parts_of_objects).collect(),
            "id.material" => self.materials.iter().collect(),
            _ => return None,
        };
        Some(names.into_iter().map(String::as_str).collect())
    }
}

encode_fields!(FeatureNames {
    aovs,
    objects,
    parts_of_objects,
    materials,
    lights,
    strategies,
    paths,
});

impl FeatureNames {
    /// Names of the layers of light that a film sums separately (light groups, strategies and light
    /// path expressions), in the order of the film.
    pub fn parts(&self) -> Vec<String> {
        let lights = self.lights.iter().map(|name| format!("light_{name}"));
        let of_strategy = |name| [format!("strategy_{name}"), format!("unweighted_{name}")];
        let strategies = self.strategies.iter().flat_map(of_strategy);
        lights.chain(strategies).chain(self.paths.iter().cloned()).collect()
    }

    /// Requested channels.
    pub fn aovs(&self) -> Vec<Aov> {
        let known = Aov::NAMES
            .iter()
            .filter(|(name, _)| self.aovs.iter().any(|aov| aov == name));
        known.map(|&(_, aov)| aov).collect()
    }
}

impl Metadata {
    /// Name and version of the program, for image files.
    pub fn software(&self) -> String {
        format!("embrasure {}", self.version)
    }

    /// Stores the exposure of `image` if `tone` has an automatic exposure.
    pub fn note_exposure(&mut self, tone: Tone, image: &Image) {
        self.tone = tone
            .exposure
            .stops()
            .is_none()
            .then(|| metered(tone, image).to_string());
    }

    /// Reads the attributes that [`Metadata`] wrote. `None` if a required attribute is missing or
    /// invalid.
    pub(super) fn of_attributes(attributes: &exr::LayerAttributes) -> Option<Self> {
        let text = |name: &str| text_attribute(attributes, name);
        let (first, end) = {
            let range = text(SAMPLES)?;
            let (first, end) = range.split_once("..")?;
            (first.parse().ok()?, end.parse().ok()?)
        };
        let seconds = attributes.other.get(&exr::Text::from(RENDER_TIME))?;
        Some(Self {
            version: text(VERSION)?,
            build: text(BUILD).unwrap_or_default(),
            scene_hash: text(SCENE_HASH)?,
            settings: text(SETTINGS)?,
            common_errors: text(COMMON_ERRORS).and_then(|name| CommonErrors::of_text(&name)),
            first_sample: first,
            end_sample: end,
            total_samples: text(TOTAL)?.parse().ok()?,
            seed: text(SEED)?.parse().ok()?,
            backend: text(BACKEND)?,
            backend_version: text(BACKEND_VERSION)?,
            render_seconds: match seconds {
                exr::AttributeValue::F32(seconds) => *seconds as f64,
                _ => return None,
            },
            complete: text(COMPLETE)? == "yes",
            features: match text(FEATURES) {
                Some(json) => Some(serde_json::from_str(&json).ok()?),
                None => None,
            },
            finish: text(FINISH).unwrap_or_default(),
            denoiser: text(DENOISER),
            tone: text(TONE),
            bias: text(BIAS),
            origin: text(ORIGIN),
            camera: CameraAttributes::of_attributes(attributes),
            print: text(SCALE)
                .and_then(|scale| DrawingScale::of_text(&scale))
                .zip(attributes.horizontal_density)
                .map(|(scale, dpi)| Print { scale, dpi }),
        })
    }

    /// Text for a message that says why two files do not belong to one picture: the first
    /// difference of their metadata, with the value in `self`, then the value in `other`. `None` if
    /// the files belong to one picture.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let pairs = [
            ("version", &self.version, &other.version),
            ("build", &self.build, &other.build),
            ("scene hash", &self.scene_hash, &other.scene_hash),
            ("backend", &self.backend, &other.backend),
            ("version of the backend", &self.backend_version, &other.backend_version),
        ];
        let differs = |(name, a, b): (&str, &str, &str)| (a != b).then(|| format!("{name} {a} and {b}"));
        let (seed, other_seed) = (self.seed.to_string(), other.seed.to_string());
        let words = pairs.into_iter().find_map(|(name, a, b)| differs((name, a, b)));
        words
            .or_else(|| differs(("seed", &seed, &other_seed)))
            .or_else(|| setting_that_differs(&self.settings, &other.settings))
    }

    /// Requested denoiser, exposure and tone curve of the render.
    pub fn finish(&self) -> Finish {
        Finish::of_text(&self.finish)
    }

    /// Background of pictures for display: transparent, or a colour that is shown unchanged. `None`
    /// for other backgrounds.
    pub fn backing(&self) -> Option<Backing> {
        backing_of(&self.settings)
    }

    /// Size in pixels of one view of a picture of `resolution` pixels. A picture of several views,
    /// such as the faces of a cube map, is a grid of views. With one view, the size is
    /// `resolution`.
    pub fn view_size(&self, resolution: UVec2) -> UVec2 {
        view_size_of(&self.settings, resolution)
    }

    /// Attributes of the EXR header, by name.
    pub(super) fn attributes(&self) -> Vec<(&'static str, exr::AttributeValue)> {
        let text = |s: &str| exr::AttributeValue::Text(exr_text(s));
        // Serialization of names cannot fail.
        let features = self.features.as_ref();
        let features = features.map(|names| serde_json::to_string(names).unwrap_or_default());
        let mut attributes = vec![
            (VERSION, text(&self.version)),
            (BUILD, text(&self.build)),
            (SCENE_HASH, text(&self.scene_hash)),
            (SETTINGS, text(&self.settings)),
            // Counts have 32 unsigned bits, and the seed has 64. The integer attribute of EXR has
            // 32 signed bits, so counts and the seed are written as text.
            (SAMPLES, text(&format!("{}..{}", self.first_sample, self.end_sample))),
            (TOTAL, text(&self.total_samples.to_string())),
            (SEED, text(&self.seed.to_string())),
            (BACKEND, text(&self.backend)),
            (BACKEND_VERSION, text(&self.backend_version)),
            (COMPLETE, text(if self.complete { "yes" } else { "no" })),
            (RENDER_TIME, exr::AttributeValue::F32(self.render_seconds as f32)),
        ];
        let common = self.common_errors.map(|common| name_of(CommonErrors::NAMES, common));
        attributes.extend(common.map(|name| (COMMON_ERRORS, text(name))));
        attributes.extend(features.map(|names| (FEATURES, text(&names))));
        attributes.push((FINISH, text(&self.finish)));
        attributes.extend(self.denoiser.as_ref().map(|denoiser| (DENOISER, text(denoiser))));
        attributes.extend(self.tone.as_ref().map(|tone| (TONE, text(tone))));
        attributes.extend(self.bias.as_ref().map(|bias| (BIAS, text(bias))));
        attributes.extend(self.origin.as_ref().map(|origin| (ORIGIN, text(origin))));
        attributes.extend(self.print.map(|print| (SCALE, text(&print.scale.text()))));
        attributes
    }
}

impl CameraAttributes {
    /// Sets the attributes of a header. The exr crate has fields for some attributes. Other
    /// attributes are added by name.
    pub(super) fn write_to(&self, attributes: &mut exr::LayerAttributes) {
        attributes.world_to_camera = Some(self.world_to_camera);
        attributes.world_to_normalized_device = self.world_to_ndc;
        if let Some(ScreenWindow { center: [x, y], width }) = self.screen_window {
            attributes.screen_window_center = exr::Vec2(x, y);
            attributes.screen_window_width = width;
        }
        attributes.aperture = self.f_number;
        attributes.focus = self.focus;
        let further = [
            (FOCAL_LENGTH, self.focal_length.map(exr::AttributeValue::F32)),
            (
                SENSOR,
                self.sensor
                    .map(|[x, y]| exr::AttributeValue::FloatVec2(exr::Vec2(x, y))),
            ),
        ];
        let further = further
            .into_iter()
            .filter_map(|(name, value)| Some((exr_text(name), value?)));
        attributes.other.extend(further);
    }

    /// The camera of a header; `None` if the header has none.
    pub(super) fn of_attributes(attributes: &exr::LayerAttributes) -> Option<Self> {
        let other = |name: &str| attributes.other.get(&exr::Text::from(name));
        Some(Self {
            world_to_camera: attributes.world_to_camera?,
            world_to_ndc: attributes.world_to_normalized_device,
            // Every header has a screen window. It describes the projection only if the header has
            // the matrix of the projection, too
            screen_window: attributes.world_to_normalized_device.map(|_| {
                let exr::Vec2(x, y) = attributes.screen_window_center;
                let width = attributes.screen_window_width;
                ScreenWindow { center: [x, y], width }
            }),
            focal_length: match other(FOCAL_LENGTH) {
                Some(exr::AttributeValue::F32(value)) => Some(*value),
                _ => None,
            },
            sensor: match other(SENSOR) {
                Some(exr::AttributeValue::FloatVec2(exr::Vec2(x, y))) => Some([*x, *y]),
                _ => None,
            },
            f_number: attributes.aperture,
            focus: attributes.focus,
        })
    }
}

/// Text with the first setting `key=value` that differs, as in `ours` and as in `theirs`. `None` if
/// no setting differs.
fn setting_that_differs(ours: &str, theirs: &str) -> Option<String> {
    let pair = |text: &'_ str, i: usize| text.split(' ').nth(i).unwrap_or("nothing").to_string();
    (ours != theirs).then(|| {
        let count = ours.split(' ').count().max(theirs.split(' ').count());
        let first = (0..count).find(|&i| pair(ours, i) != pair(theirs, i)).unwrap_or(0);
        format!("settings {} and {}", pair(ours, first), pair(theirs, first))
    })
}
