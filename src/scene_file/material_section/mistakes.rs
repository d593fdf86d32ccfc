//! Errors about keys of a material.

use super::{MaterialSection, preset_names};
use crate::color::Spectrum;
use crate::math::{excerpt, excerpt_of_name};
use crate::scene_file::FileError;
use crate::scene_file::section::Section;
use crate::scene_file::source::Source;
use crate::scene_file::unknown_key::nearest_names;
use std::ops::Range;

/// Name of a material and the file of its section, for messages.
pub(super) struct NamedMaterial<'a> {
    pub name: &'a str,
    pub file: &'a Source,
}

impl NamedMaterial<'_> {
    pub fn error(&self, span: Range<usize>, message: &str, help: &str) -> FileError {
        let message = format!("material `{}`: {message}", excerpt_of_name(self.name));
        self.file.error(span, message).help(help)
    }

    /// Returns an error if a number of `section` is out of its range.
    pub fn check(&self, section: &MaterialSection) -> Result<(), FileError> {
        for given in section.given() {
            if let Some((value, rule)) = given.range.violation(given.numbers) {
                let message = format!("{} is {value}", given.key);
                return Err(self.error(given.span, &message, &format!("write {rule}")));
            }
        }
        Ok(())
    }
}

/// Errors about keys that cannot be combined.
impl NamedMaterial<'_> {
    pub fn half_a_metal(&self, given: &str, place: Range<usize>) -> FileError {
        let missing = if given == "eta" { "k" } else { "eta" };
        let message = format!("`{given}` without `{missing}`");
        self.error(place, &message, "give both, or neither")
    }

    pub fn metallic_with_others(&self, place: Range<usize>) -> FileError {
        let message = "`metallic` cannot be combined with `eta`, `k` or a `model` other than \"ggx\"";
        self.error(place, message, "leave these keys out")
    }

    pub fn fresnel_of_phong(&self, place: Range<usize>) -> FileError {
        let help = "use model = \"ggx\" or \"blinn\", or model = \"mirror\" for a smooth metal";
        self.error(place, "a Phong lobe has no Fresnel term", help)
    }

    pub fn exponent_of(&self, model: &str, place: Range<usize>) -> FileError {
        let help = "leave `exponent` out, or use model = \"phong\" or \"blinn\"";
        self.error(place, &format!("model \"{}\" has no exponent", excerpt(model)), help)
    }

    pub fn unknown_model(&self, model: &str, place: Range<usize>) -> FileError {
        let message = format!("unknown model `{}`", excerpt(model));
        self.error(place, &message, "choose among phong, blinn, ggx, mirror")
    }

    pub fn unknown_preset(&self, preset: &str, place: Range<usize>) -> FileError {
        let all = preset_names();
        let near = nearest_names(preset, all.iter().copied());
        let meant = near
            .first()
            .map_or(String::new(), |near| format!("did you mean {near}? "));
        let is_number = preset.parse::<f32>().is_ok();
        let help = match Spectrum::of_text(preset) {
            Some(_) if !is_number => {
                format!(
                    "a colour is a value of `diffuse`, as in --material 'NAME.diffuse={preset}' or --part 'NAME.diffuse={preset}'"
                )
            }
            _ => format!("{meant}presets are {}", all.join(", ")),
        };
        self.error(place, &format!("there is no preset `{}`", excerpt(preset)), &help)
    }

    pub fn disperses_nothing(&self, place: Range<usize>) -> FileError {
        let message = "`abbe` needs smooth glass that only reflects and refracts";
        let help =
            "remove `abbe`, or set `transmission` with thin = false, without roughness, other colours or textures";
        self.error(place, message, help)
    }

    pub fn no_facets_for(&self, key: &str, place: Range<usize>) -> FileError {
        let help = "set model = \"ggx\", or `transmission` with thin = false";
        self.error(place, &format!("`{key}` has no effect on this material"), help)
    }
}
