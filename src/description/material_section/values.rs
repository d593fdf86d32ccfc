//! Values of the keys of a material, each in its range, and errors of keys that cannot be combined.

use super::{ChannelValues, ColorValue, Material, MaterialSection};
use crate::color::Spectrum;
use crate::description::FileError;
use crate::description::PRESETS;
use crate::description::source::Source;
use crate::description::unknown_key::nearest_names;
use crate::math::{excerpt, list};
use std::ops::Range;
use toml::Spanned;

/// What the keys of a section say, each in its range; `None` where a key is left out.
pub(super) struct Values {
    pub diffuse: Option<Spectrum>,
    pub specular: Option<Spectrum>,
    pub sheen: Option<Spectrum>,
    pub transmission: Option<Spectrum>,
    pub emission: Option<Spectrum>,
    pub eta: Option<[f32; 3]>,
    pub k: Option<[f32; 3]>,
    pub exponent: Option<f32>,
    pub roughness: Option<f32>,
    pub metallic: Option<f32>,
    pub anisotropy: Option<f32>,
    pub anisotropy_rotation: Option<f32>,
    pub clearcoat: Option<f32>,
    pub clearcoat_roughness: Option<f32>,
    pub ior: Option<f32>,
    pub abbe: Option<f32>,
    pub absorption: Option<Spectrum>,
    pub absorption_depth: Option<f32>,
    pub opacity: Option<f32>,
}

/// Minimum share of the light that a body is taken to leave on its depth: what leaves nothing has no coefficient.
const MIN_TRANSMISSION: f32 = 1e-6;

impl Values {
    /// Sets the absorption of `material`. With a depth its transmission is what light keeps on that way, and no colour of its surface any more.
    pub fn set_absorption(&self, material: &mut Material) {
        material.absorption = self.absorption.unwrap_or(material.absorption);
        if let Some(depth) = self.absorption_depth {
            let kept = material.transmission.to_array();
            if kept != [1.0; 3] && !material.transmission.is_black() {
                let coefficient = |kept: f32| -kept.clamp(MIN_TRANSMISSION, 1.0).ln() / depth;
                material.absorption = kept.map(coefficient).into();
                material.transmission = Spectrum::ONE;
            }
        }
    }
}

impl MaterialSection {
    /// The values of the keys; an error at the first that is out of its range.
    pub(super) fn values(&self, section: &Named) -> Result<Values, FileError> {
        let share = |n: f32| (0.0..=1.0).contains(&n);
        let share = |key, value| section.number(key, value, share, "a number from 0 to 1");
        let indices = |key, value: &Option<Spanned<ChannelValues>>, is_good: fn(f32) -> bool, rule| {
            let checked = value
                .as_ref()
                .map(|value| section.check(key, &value.get_ref().0, value.span(), is_good, rule));
            checked.transpose()?;
            Ok::<_, FileError>(value.as_ref().map(|value| value.get_ref().0))
        };
        let sheen = section.color("sheen", &self.sheen)?;
        if let Some(sheen) = &self.sheen {
            section.check(
                "sheen",
                &sheen.get_ref().0,
                sheen.span(),
                |n| n <= 1.0,
                "three numbers from 0 to 1",
            )?;
        }
        let turn = &self.anisotropy_rotation;
        Ok(Values {
            diffuse: section.color("diffuse", &self.diffuse)?,
            specular: section.color("specular", &self.specular)?,
            sheen,
            transmission: section.color("transmission", &self.transmission)?,
            emission: section.color("emission", &self.emission)?,
            eta: indices("eta", &self.eta, |n| n.is_finite() && n > 0.0, "finite numbers above 0")?,
            k: indices("k", &self.k, |n| n.is_finite() && n >= 0.0, "finite numbers, 0 or more")?,
            exponent: section.number("exponent", &self.exponent, |n| n >= 0.0, "a finite number, 0 or more")?,
            roughness: share("roughness", &self.roughness)?,
            metallic: share("metallic", &self.metallic)?,
            anisotropy: share("anisotropy", &self.anisotropy)?,
            anisotropy_rotation: section.number("anisotropy_rotation", turn, |_| true, "a finite number")?,
            clearcoat: share("clearcoat", &self.clearcoat)?,
            clearcoat_roughness: share("clearcoat_roughness", &self.clearcoat_roughness)?,
            ior: section.number("ior", &self.ior, |n| n > 0.0, "a finite number above 0")?,
            abbe: section.number("abbe", &self.abbe, |n| n >= 5.0, "a finite number, 5 or more")?,
            absorption: indices(
                "absorption",
                &self.absorption,
                |n| n.is_finite() && n >= 0.0,
                "three finite numbers, 0 or more",
            )?
            .map(Spectrum::from),
            absorption_depth: section.number(
                "absorption_depth",
                &self.absorption_depth,
                |n| n > 0.0,
                "a finite number above 0",
            )?,
            opacity: share("opacity", &self.opacity)?,
        })
    }
}

/// Errors of keys that do not go together, which `replace` and `patch` share.
impl Named<'_> {
    pub fn half_a_metal(&self, given: &str, place: Range<usize>) -> FileError {
        let missing = if given == "eta" { "k" } else { "eta" };
        let message = format!("`{given}` without `{missing}`");
        self.error(place, &message, "give both, or neither")
    }

    pub fn metallic_with_others(&self, place: Range<usize>) -> FileError {
        let message = "`metallic` cannot be combined with `eta`, `k` or a `model` other than \"ggx\"";
        self.error(place, message, "leave them out")
    }

    pub fn fresnel_of_phong(&self, place: Range<usize>) -> FileError {
        let help = "use model = \"ggx\" or \"blinn\", or model = \"mirror\" for a smooth metal";
        self.error(place, "a Phong lobe has no Fresnel term", help)
    }

    pub fn exponent_of(&self, model: &str, place: Range<usize>) -> FileError {
        let help = "leave it out, or use model = \"phong\" or \"blinn\"";
        self.error(place, &format!("model \"{}\" has no exponent", excerpt(model)), help)
    }

    pub fn unknown_model(&self, model: &str, place: Range<usize>) -> FileError {
        let message = format!("unknown model `{}`", excerpt(model));
        self.error(place, &message, "choose among phong, blinn, ggx, mirror")
    }

    pub fn unknown_preset(&self, preset: &str, place: Range<usize>) -> FileError {
        let names = || PRESETS.iter().map(|preset| preset.name);
        let all: Vec<&str> = names().collect();
        let near = nearest_names(preset, names());
        let meant = near
            .first()
            .map_or(String::new(), |near| format!("did you mean {near}? "));
        let help = format!("{meant}presets are {}", all.join(", "));
        self.error(place, &format!("there is no preset `{}`", excerpt(preset)), &help)
    }

    pub fn disperses_nothing(&self, place: Range<usize>) -> FileError {
        let message = "`abbe` needs smooth glass without other lobes";
        let help = "remove it, or use a transmission that is not thin, without roughness, other lobes or textures";
        self.error(place, message, help)
    }

    pub fn nothing_has(&self, what: &str, place: Range<usize>) -> FileError {
        let help = "use model = \"ggx\", or a transmission that is not thin";
        self.error(place, &format!("nothing here has {what}"), help)
    }
}

/// A material's name and file, for messages.
pub(super) struct Named<'a> {
    pub name: &'a str,
    pub file: &'a Source,
}

impl Named<'_> {
    pub fn error(&self, span: Range<usize>, message: &str, help: &str) -> FileError {
        let message = format!("material `{}`: {message}", excerpt(self.name));
        self.file.error(span, message).help(help)
    }

    /// An error unless each of the three numbers is good.
    fn check(
        &self,
        key: &str,
        numbers: &[f32; 3],
        place: Range<usize>,
        is_good: impl Fn(f32) -> bool,
        rule: &str,
    ) -> Result<(), FileError> {
        match numbers.iter().all(|&n| is_good(n)) {
            true => Ok(()),
            false => Err(self.wrong(key, place, &list(numbers), rule)),
        }
    }

    /// The error of a key that has the wrong `value`.
    fn wrong(&self, key: &str, span: Range<usize>, value: &str, rule: &str) -> FileError {
        self.error(span, &format!("{key} is {value}"), &format!("write {rule}"))
    }

    fn number(
        &self,
        key: &str,
        value: &Option<Spanned<f32>>,
        is_good: impl Fn(f32) -> bool,
        rule: &str,
    ) -> Result<Option<f32>, FileError> {
        let Some(value) = value else { return Ok(None) };
        let n = *value.get_ref();
        match n.is_finite() && is_good(n) {
            true => Ok(Some(n)),
            false => Err(self.wrong(key, value.span(), &n.to_string(), rule)),
        }
    }

    fn color(&self, key: &str, value: &Option<Spanned<ColorValue>>) -> Result<Option<Spectrum>, FileError> {
        let Some(value) = value else { return Ok(None) };
        let rule = "three finite numbers, 0 or more";
        self.check(
            key,
            &value.get_ref().0,
            value.span(),
            |n| Spectrum::splat(n).is_valid(),
            rule,
        )?;
        Ok(Some(value.get_ref().0.into()))
    }
}
