//! Channels that are rendered only while a page shows them: ids and light groups. Pages can change
//! the strength and the colour of a light group without a render. If the scene file has no groups,
//! each light of the file and each emitting material becomes a group. Lights that flags add stay in
//! the default group.

use super::{Change, Engine};
use crate::film::Aov;
use crate::io::half_picture::IDS;
use crate::light::LightGroups;
use crate::material::Material;
use crate::scene::{Ground, LAMP_KINDS, Scene, lamp_name};
use crate::scene_file::SceneFile;
use crate::session::Settings;
use crate::view::FileLight;
use crate::view::frame::LIGHTS;
use std::collections::BTreeSet;

impl Engine<'_> {
    /// Renders the channels that pages show, and no others.
    pub(super) fn follow_pages(&mut self) -> Change {
        let channels = self.hub.channels();
        let shown = (self.shows_groups, self.shows_ids);
        (self.shows_groups, self.shows_ids) = (channels.contains(LIGHTS), channels.contains(IDS));
        if shown == (self.shows_groups, self.shows_ids) {
            return Change::Nothing;
        }
        let before = self.settings.aovs.clone();
        let mut settings = self.settings.clone();
        self.set_aovs(&mut settings);
        self.settings = settings;
        if shown.0 != self.shows_groups && !self.has_own_groups {
            self.edits.groups = if self.shows_groups {
                group_keys(&self.lights, &self.emitting)
            } else {
                Vec::new()
            };
            return Change::Scene;
        }
        if self.settings.aovs == before {
            Change::Nothing
        } else {
            Change::Picture
        }
    }

    /// Stores whether `file` defines light groups. Does nothing if the groups of `file` come from
    /// the viewer.
    pub(super) fn note_groups(&mut self, file: &SceneFile) {
        if self.edits.groups.is_empty() {
            self.has_own_groups = file.has_light_groups();
        }
    }

    /// Sets the channels of `settings`: the user's channels, and the channels that pages show.
    pub(super) fn set_aovs(&self, settings: &mut Settings) {
        settings.aovs.clone_from(&self.requested_aovs);
        for (is_shown, aov) in [(self.shows_groups, Aov::Lights), (self.shows_ids, Aov::Ids)] {
            if is_shown && !settings.aovs.contains(&aov) {
                settings.aovs.push(aov);
            }
        }
    }
}

/// Returns true if a `[[light]]` makes materials of this name.
pub(super) fn is_of_light(name: &str) -> bool {
    LAMP_KINDS.iter().any(|kind| lamp_name(kind) == name)
}

/// Materials of `scene` that come from files, without the materials that the program makes for
/// lights and for the ground.
pub(super) fn of_users(scene: &Scene) -> Vec<&Material> {
    let mut materials: Vec<&Material> = scene.materials().iter().collect();
    let ground = materials.iter().rposition(|material| material.name == Ground::NAME);
    if let Some(ground) = ground.filter(|_| scene.ground().is_some()) {
        materials.remove(ground);
    }
    materials.retain(|material| !is_of_light(&material.name));
    materials
}

/// Names of the materials of `scene` whose surfaces emit.
pub(super) fn emitting(scene: &Scene) -> Vec<String> {
    let materials = of_users(scene).into_iter();
    let emits = materials.filter(|material| !material.emission_factor().is_black());
    let mut names: Vec<String> = emits.map(|material| material.name.clone()).collect();
    names.sort();
    names.dedup();
    names
}

/// Keys of the scene file, as `KEY=VALUE`, that make each light and each emitting material a group,
/// up to the maximum number of groups.
fn group_keys(lights: &[FileLight], materials: &[String]) -> Vec<String> {
    let max_groups = LightGroups::MAX_GROUPS - 1;
    let lights = &lights[..lights.len().min(max_groups)];
    let key = |light: &FileLight| format!("light.{}.group=light{}", light.index, light.index + 1);
    let mut keys: Vec<String> = lights.iter().map(key).collect();
    let mut names = BTreeSet::from([LightGroups::DEFAULT.to_string()]);
    let group = |material: &String| {
        let mut group = toml::Table::new();
        group.insert("name".into(), group_name(material, &mut names).into());
        group.insert("materials".into(), vec![material.as_str()].into());
        toml::Value::from(group)
    };
    let groups: Vec<toml::Value> = materials.iter().take(max_groups - lights.len()).map(group).collect();
    if !groups.is_empty() {
        keys.push(format!("light_group={}", toml::Value::from(groups)));
    }
    keys
}

/// A valid group name for a material, different from all `names`. The new name is added to `names`.
fn group_name(material: &str, names: &mut BTreeSet<String>) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let plain: String = material.chars().filter(|c| is_plain(*c)).take(19).collect();
    let numbered = (2..).map(|i| format!("{plain}_{i}"));
    let mut candidates = [plain.clone()]
        .into_iter()
        .chain(numbered)
        .filter(|name| !name.is_empty());
    let name = candidates.find(|name| !names.contains(name)).unwrap_or_default();
    names.insert(name.clone());
    name
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene_file::LightSection;

    fn lights(indices: impl IntoIterator<Item = usize>) -> Vec<FileLight> {
        let section = LightSection::of_type("point", 0..0);
        let light = |index| FileLight {
            index,
            section: section.clone(),
        };
        indices.into_iter().map(light).collect()
    }

    #[test]
    fn each_light_is_a_group() {
        let materials = ["ä".to_string(), "Schirm\"ä".into()];
        let keys = group_keys(&lights([0, 2]), &materials);
        assert_eq!(keys[..2], ["light.0.group=light1", "light.2.group=light3"]);
        let table: toml::Table = keys[2].parse().unwrap();
        assert_eq!(table["light_group"][1]["name"].as_str(), Some("Schirm"));
        assert_eq!(table["light_group"][0]["name"].as_str(), Some("_2"));
        assert_eq!(table["light_group"][1]["materials"][0].as_str(), Some("Schirm\"ä"));
        assert!(group_keys(&[], &[]).is_empty());
        let many = vec!["m".to_string(); 40];
        assert_eq!(group_keys(&lights(0..40), &many).len(), LightGroups::MAX_GROUPS - 1);
        let table: toml::Table = group_keys(&lights(0..3), &many)[3].parse().unwrap();
        assert_eq!(
            table["light_group"].as_array().map(Vec::len),
            Some(LightGroups::MAX_GROUPS - 4)
        );
    }
}
