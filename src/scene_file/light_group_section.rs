use super::FileError;
use super::section::{key_types, section};
use super::source::Source;
use crate::light::{LightGroupId, LightGroups};
use crate::math::excerpt_of_name;
use crate::scene::{BuildError, SceneBuilder};
use serde_json::{Value, json};
use std::collections::HashMap;
use toml::Spanned;

section! {
    /// `[[light_group]]`: materials whose emission is separated from other light.
    pub struct LightGroupSection {
        required {
            /// Name of the group, which lights may name too
            name: String, schema group_name();
            /// Names of materials that emit, of MTL files or of the scene file
            materials: Vec<Spanned<String>>;
        }
    }
}

key_types! {
    Vec<Spanned<String>>: |_number| json!({ "type": "array", "items": { "type": "string" }, "minItems": 1 });
}

/// Schema of the name of a light group. The name becomes a part of channel names.
pub(super) fn group_name() -> Value {
    json!({ "type": "string", "pattern": "^[A-Za-z0-9_]{1,23}$", "not": { "enum": ["default"] } })
}

impl LightGroupSection {
    /// Stores the group of each material in `groups`. If the group is invalid, the error points to
    /// it in `file`.
    pub(super) fn add_to(
        &self,
        builder: &mut SceneBuilder,
        file: &Source,
        groups: &mut HashMap<String, LightGroupId>,
    ) -> Result<(), FileError> {
        let group = light_group(builder, file, &self.name)?;
        if self.materials.get_ref().is_empty() {
            let error = file.error(self.materials.span(), "a light group without materials");
            return Err(error.help("name materials that emit; lights join a group by `group` of their [[light]]"));
        }
        for material in self.materials.get_ref() {
            if groups.insert(material.get_ref().clone(), group).is_some() {
                let message = format!(
                    "material `{}` is in a light group already",
                    excerpt_of_name(material.get_ref())
                );
                return Err(file.error(material.span(), message).help("name each material once"));
            }
        }
        Ok(())
    }
}

/// Light group with the name `name`. If the name is invalid, the error points to it in `file`.
pub(super) fn light_group(
    builder: &mut SceneBuilder,
    file: &Source,
    name: &Spanned<String>,
) -> Result<LightGroupId, FileError> {
    builder.light_group(name.get_ref()).map_err(|error| {
        let help = match error {
            BuildError::TooManyLightGroups => format!(
                "use at most {} groups, including `{}` for lights without a group",
                LightGroups::MAX_GROUPS,
                LightGroups::DEFAULT
            ),
            _ => "choose a name like `key_light`: it becomes a part of channel names".into(),
        };
        file.error(name.span(), error.to_string()).help(help)
    })
}

/// Names in light groups that have no effect, each with the reason: the material emits nothing, or
/// no face uses the material. `emits` has the names of used materials. The value is true if a used
/// material of this name emits.
pub(super) fn idle_members<'a>(
    groups: &'a [LightGroupSection],
    emits: &HashMap<String, bool>,
) -> Vec<(&'a Spanned<String>, &'static str)> {
    let names = groups.iter().flat_map(|section| section.materials.get_ref());
    let idle = names.filter_map(|name| match emits.get(name.get_ref()) {
        Some(true) => None,
        Some(false) => Some((name, "emits nothing")),
        None => Some((name, "is used by no face")),
    });
    idle.collect()
}
