//! Light groups for pages that change each of them without a render. Where the scene file has none, each light and each emitting material is one.

use super::{Change, Engine};
use crate::description::SceneFile;
use crate::film::Aov;
use crate::light::LightGroups;
use crate::scene::{DISK_NAME, RECTANGLE_NAME, SPHERE_NAME, Scene};
use crate::session::Settings;
use crate::view::frame::LIGHTS;
use std::collections::BTreeSet;

/// Key of the scene file that has groups of materials.
const GROUPS: &str = "light_group=";

impl Engine<'_> {
    /// Separates groups if a page shows them, and only then.
    pub(super) fn follow_pages(&mut self) -> Change {
        let is_wanted = self.hub.channels().contains(LIGHTS);
        if is_wanted == self.tells_groups {
            return Change::Nothing;
        }
        self.tells_groups = is_wanted;
        let mut settings = self.settings.clone();
        self.tell_groups(&mut settings);
        self.settings = settings;
        if self.has_own_groups {
            return Change::Picture;
        }
        let keys = &mut self.edits.keys;
        keys.retain(|key| !key.starts_with(GROUPS) && !is_group_of_light(key));
        if is_wanted {
            keys.extend(group_keys(self.file.light.len(), &self.emitting));
        }
        Change::Scene
    }

    /// Notes whether `file` has groups that are not made here.
    pub(super) fn note_groups(&mut self, file: &SceneFile) {
        let is_made = |key: &String| key.starts_with(GROUPS) || is_group_of_light(key);
        if !self.edits.keys.iter().any(is_made) {
            self.has_own_groups = file.has_light_groups();
        }
    }

    /// Makes `settings` separate groups, or not.
    pub(super) fn tell_groups(&self, settings: &mut Settings) {
        settings.aovs.retain(|aov| *aov != Aov::Lights);
        if self.tells_groups {
            settings.aovs.push(Aov::Lights);
        }
    }
}

/// Names of the materials of `scene` whose surfaces emit, those aside that are made for a `[[light]]`.
pub(super) fn emitting(scene: &Scene) -> Vec<String> {
    let emits = scene.materials().iter().filter(|m| !m.emission_factor().is_black());
    let mut names: Vec<String> = emits.map(|material| material.name.clone()).collect();
    names.retain(|name| ![DISK_NAME, RECTANGLE_NAME, SPHERE_NAME].contains(&name.as_str()));
    names.sort();
    names.dedup();
    names
}

/// Whether `KEY=VALUE` is the group of a light.
pub(super) fn is_group_of_light(key: &str) -> bool {
    let mut parts = key.splitn(3, '.');
    parts.next() == Some("light") && parts.nth(1).is_some_and(|rest| rest.starts_with("group="))
}

/// `KEY=VALUE` of the scene file for a group of each light and each emitting material, as many as there may be.
fn group_keys(lights: usize, materials: &[String]) -> Vec<String> {
    let most = LightGroups::MOST - 1;
    let lights = lights.min(most);
    let mut keys: Vec<String> = (0..lights).map(|i| format!("light.{i}.group=light{}", i + 1)).collect();
    let mut names = BTreeSet::from([LightGroups::DEFAULT.to_string()]);
    let group = |material: &String| {
        let mut group = toml::Table::new();
        group.insert("name".into(), group_name(material, &mut names).into());
        group.insert("materials".into(), vec![material.as_str()].into());
        toml::Value::from(group)
    };
    let groups: Vec<toml::Value> = materials.iter().take(most - lights).map(group).collect();
    if !groups.is_empty() {
        keys.push(format!("{GROUPS}{}", toml::Value::from(groups)));
    }
    keys
}

/// A name that groups may have for a material, other than the `names` that there are, which it joins.
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

    #[test]
    fn each_light_is_a_group() {
        let materials = ["ä".to_string(), "Schirm\"ä".into()];
        let keys = group_keys(2, &materials);
        assert_eq!(keys[..2], ["light.0.group=light1", "light.1.group=light2"]);
        assert!(keys[..2].iter().all(|key| is_group_of_light(key)) && !is_group_of_light("light.0.scale=2"));
        let table: toml::Table = keys[2].parse().unwrap();
        assert_eq!(table["light_group"][1]["name"].as_str(), Some("Schirm"));
        assert_eq!(table["light_group"][0]["name"].as_str(), Some("_2"));
        assert_eq!(table["light_group"][1]["materials"][0].as_str(), Some("Schirm\"ä"));
        assert!(group_keys(0, &[]).is_empty());
        let many = vec!["m".to_string(); 40];
        assert_eq!(group_keys(40, &many).len(), LightGroups::MOST - 1);
        let table: toml::Table = group_keys(3, &many)[3].parse().unwrap();
        assert_eq!(
            table["light_group"].as_array().map(Vec::len),
            Some(LightGroups::MOST - 4)
        );
    }
}
