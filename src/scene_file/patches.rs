//! Patches of materials and of parts in the order in which they apply: first the patches of the
//! scene file in their order, then the patches of flags.

use super::overrides::PatchTarget;
use super::part_section::PartSection;
use super::placement::fault;
use super::presets::Preset;
use super::section::{Section, value};
use super::unknown_key::parser_error;
use super::{FileError, MaterialSection, SceneFile};
use crate::io::{PartFilter, PartRule};
use crate::math::{Glob, Vec3, affine_from_trs};
use crate::options::Parameter;
use serde::Deserialize;
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use toml::Spanned;

/// A patch: keys that replace keys of all items whose names match the glob. `S` is
/// [`MaterialSection`] or [`PartSection`].
pub(super) struct Patch<'a, S: Clone = MaterialSection> {
    pub glob: Glob,
    /// The glob or name as written.
    pub written: &'a str,
    /// Place of the patch in the file.
    pub span: Range<usize>,
    pub section: Cow<'a, S>,
}

/// Glob that matches only the name `name`.
#[cfg(feature = "view")]
pub(crate) fn glob_of_name(name: &str) -> String {
    Glob::exact(name).text(0)
}

/// Patches of materials, with a mark for each patch that has matched a material.
#[derive(Default)]
pub(super) struct PatchList<'a> {
    patches: Vec<(Patch<'a>, bool)>,
    /// Indices of patches that match one name only, by this name. A scene may have very many of
    /// these patches, so a list of them would be slow to search.
    by_name: HashMap<String, Vec<usize>>,
    /// Indices of patches whose globs may match several names.
    by_glob: Vec<usize>,
}

impl<'a> PatchList<'a> {
    /// A list in which each patch applies after the patches before it.
    pub fn new(patches: Vec<Patch<'a>>) -> Self {
        let mut list = Self::default();
        for (index, patch) in patches.into_iter().enumerate() {
            if patch.glob.is_exact() {
                list.by_name.entry(patch.glob.literal()).or_default().push(index)
            } else {
                list.by_glob.push(index)
            }
            list.patches.push((patch, false));
        }
        list
    }

    /// Patches of the material `name`. They are marked as used.
    pub fn of_material(&mut self, name: &str) -> Vec<&Patch<'a>> {
        let matches = |&index: &usize| self.patches[index].0.glob.matches(name);
        let mut indices: Vec<usize> = self.by_glob.iter().copied().filter(matches).collect();
        indices.extend(self.by_name.get(name).into_iter().flatten());
        indices.sort_unstable();
        for &index in &indices {
            self.patches[index].1 = true;
        }
        indices.into_iter().map(|index| &self.patches[index].0).collect()
    }

    /// Patches that match no material.
    pub fn unused(&self) -> impl Iterator<Item = &Patch<'a>> {
        self.patches
            .iter()
            .filter(|(_, is_used)| !is_used)
            .map(|(patch, _)| patch)
    }
}

/// Splits `GLOB.KEY=VALUE` or `GLOB=PRESET` into the glob and the patch `KEY=VALUE`. The last dot
/// before `=` ends the glob if the text after the dot is a key of `known`, or if the value is not
/// the name of a preset. The glob may have quotes.
fn split_patch<'w>(
    written: &'w str,
    mut known: impl Iterator<Item = &'static Parameter>,
) -> Option<(&'w str, Cow<'w, str>)> {
    let (name, value) = written.split_once('=')?;
    let key = name.rsplit_once('.').filter(|(_, key)| {
        // A dot may also be a part of a material's name
        known.any(|known| known.key == key.trim()) || Preset::of_name(value.trim()).is_none()
    });
    let (glob, patch) = match key {
        Some((glob, _)) => (glob, Cow::Borrowed(&written[glob.len() + 1..])),
        None => {
            let preset = value.trim().trim_matches(['"', '\'']);
            (name, Cow::Owned(format!("preset={}", toml::Value::from(preset))))
        }
    };
    let glob = glob.trim();
    let quoted = |quote| glob.strip_prefix(quote).and_then(|glob| glob.strip_suffix(quote));
    Some((quoted('"').or(quoted('\'')).unwrap_or(glob), patch))
}

impl SceneFile {
    /// Adds patches of materials after the patches of the file. Each text is `GLOB.KEY=VALUE` or
    /// `GLOB=PRESET`: a glob of names, a key of `[material.NAME]`, and a TOML value or a plain
    /// string.
    ///
    /// # Errors
    ///
    /// A text that is not a patch. Keys and values are checked when the scene is loaded.
    pub fn patch_materials(&mut self, written: &[String]) -> Result<(), FileError> {
        for written in written {
            let patch = split_patch(written, MaterialSection::KEYS.iter());
            if !self.add_patch(PatchTarget::Materials, patch, written) {
                let error = self.whole(format!("--material {written}: expected NAME.KEY=VALUE or NAME=PRESET"));
                let help = "NAME is a material or a pattern, as in 'Floor*.roughness=0.2' or ring=gold";
                return Err(error.of_flag().help(help));
            }
        }
        Ok(())
    }

    /// Adds patches of parts after the patches of the file. Each text is `GLOB.KEY=VALUE` or
    /// `GLOB=PRESET`: a glob of names, a key of `[part."GLOB"]`, and a TOML value or a plain
    /// string.
    ///
    /// # Errors
    ///
    /// A text that is not a patch. Keys and values are checked when the scene is loaded.
    pub fn patch_parts(&mut self, written: &[String]) -> Result<(), FileError> {
        for written in written {
            if !self.add_patch(
                PatchTarget::Parts,
                split_patch(written, PartSection::all_keys()),
                written,
            ) {
                let error = self.whole(format!("--part {written}: expected NAME.KEY=VALUE or NAME=PRESET"));
                let help = "NAME is a part or a pattern, as in 'Chair*.visible=false' or Ring=gold";
                return Err(error.of_flag().help(help));
            }
        }
        Ok(())
    }

    /// Adds a patch of a flag: the glob and `KEY=VALUE`. Returns false if the patch is invalid.
    fn add_patch(&mut self, target: PatchTarget, patch: Option<(&str, Cow<'_, str>)>, written: &str) -> bool {
        let Some((glob, patch)) = patch else { return false };
        let bytes = self.source.bytes();
        let overrides = &mut self.source.overrides;
        let added = overrides.add_patch_of((target, glob), &patch, written, bytes).is_ok();
        if added {
            // If the flag changes no material, it must be an error
            overrides.require_match();
        }
        added
    }

    /// Adds a patch of the material `name`, which may have any characters. `key` is a key of
    /// `[material.NAME]`, and `value` is a TOML value or a plain string.
    ///
    /// # Errors
    ///
    /// `key` is not a key of TOML. Unknown keys and invalid values are reported when the scene is
    /// loaded.
    #[cfg(feature = "view")]
    pub(crate) fn patch_material(&mut self, name: &str, key: &str, value: &str) -> Result<(), FileError> {
        let (bytes, patch) = (self.source.bytes(), format!("{key}={value}"));
        let written = format!("{name}.{patch}");
        let added =
            self.source
                .overrides
                .add_patch_of((PatchTarget::Materials, &glob_of_name(name)), &patch, &written, bytes);
        added.map_err(|()| {
            self.whole(format!("--material {written}: expected NAME.KEY=VALUE"))
                .of_flag()
        })
    }

    /// Section of the scene file that replaces the material `name`, with the section's key.
    pub(super) fn replacement(&self, name: &str) -> Option<(&Spanned<String>, &MaterialSection)> {
        let section = self.material.get_key_value(name);
        section.filter(|(_, section)| !section.is_patch())
    }

    /// All patches of materials. If a patch is invalid, the error points to it.
    pub(super) fn patches(&self) -> Result<Vec<Patch<'_>>, FileError> {
        let mut patches = Vec::new();
        for (key, section) in self.material.iter().filter(|(_, section)| section.is_patch()) {
            patches.push(Patch {
                glob: Glob::exact(key.get_ref()),
                written: key.get_ref(),
                span: key.span(),
                section: Cow::Borrowed(section),
            });
        }
        for (key, section) in &self.patch.0 {
            self.check_patch(section)?;
            patches.push(Patch {
                glob: Glob::new(key.get_ref()),
                written: key.get_ref(),
                span: key.span(),
                section: Cow::Borrowed(section),
            });
        }
        patches.sort_by_key(|patch| patch.span.start);

        self.add_flags(&mut patches, PatchTarget::Materials, MaterialSection::set_over)?;
        let mut of_flags = patches.iter().filter(|patch| matches!(patch.section, Cow::Owned(_)));
        of_flags.try_for_each(|patch| self.check_patch(&patch.section))?;
        Ok(patches)
    }

    /// All patches of parts. If a patch is invalid, the error points to it.
    pub(super) fn part_patches(&self) -> Result<Vec<Patch<'_, PartSection>>, FileError> {
        let of_file = self.part.0.iter().map(|(key, section)| Patch {
            glob: Glob::new(key.get_ref()),
            written: key.get_ref(),
            span: key.span(),
            section: Cow::Borrowed(section),
        });
        let mut patches = of_file.collect();
        self.add_flags(&mut patches, PatchTarget::Parts, PartSection::set_over)?;
        for patch in &patches {
            self.check_movement(&patch.section)?;
        }
        Ok(patches)
    }

    /// Returns an error if the transform of a part has no inverse: a scale factor is 0, or a number
    /// is not finite.
    fn check_movement(&self, section: &PartSection) -> Result<(), FileError> {
        let of = |key: &str, [translate, rotate]: [Option<Vec3>; 2], scale: Option<Vec3>| {
            let matrix = affine_from_trs(
                translate.unwrap_or_default(),
                rotate.unwrap_or_default(),
                scale.unwrap_or(Vec3::ONE),
            );
            let span = section.keys.span_of(key)?;
            let (message, help) = fault("the part", &matrix)?;
            Some(self.error(span, format!("`{key}` {message}")).help(help))
        };
        let movement = section.movement();
        let wrong = of("translate", [movement.translate, None], None)
            .or_else(|| of("rotate", [None, movement.rotate], None))
            .or_else(|| of("scale", [None; 2], movement.scale));
        wrong.map_or(Ok(()), Err)
    }

    /// Filter that selects the parts of OBJ files, by the keys `visible` of `patches` and by the
    /// patterns of `hide` and `only`.
    pub(super) fn part_filter(&self, patches: &[Patch<PartSection>]) -> PartFilter {
        let [mut hide, only] = self
            .part_patterns()
            .map(|patterns| patterns.iter().map(|pattern| Glob::new(pattern)).collect::<Vec<_>>());
        if self.shows_hidden_parts {
            hide.clear();
        }
        let rule = |patch: &Patch<PartSection>| PartRule {
            glob: patch.glob.clone(),
            visible: value(&patch.section.keys.visible).filter(|visible| *visible || !self.shows_hidden_parts),
            has_material: patch.section.has_material(),
            movement: patch.section.movement(),
        };
        PartFilter {
            hide,
            only,
            rules: patches.iter().map(rule).collect(),
        }
    }

    /// Returns true if a flag or a key hides parts by their names.
    pub(crate) fn hides_parts(&self) -> bool {
        let filter = self.part_filter(&self.part_patches().unwrap_or_default());
        !filter.hide.is_empty() || filter.rules.iter().any(|rule| rule.visible == Some(false))
    }

    /// Returns true if a material section or a patch, or one of the part patches `parts`, sets an
    /// emission.
    pub(super) fn may_emit(&self, parts: &[Patch<PartSection>]) -> bool {
        let emits = |section: &MaterialSection| section.emission.is_some() || section.emission_map.is_some();
        let patches = self.patches().unwrap_or_default();
        self.material.values().any(emits)
            || patches.iter().any(|patch| emits(&patch.section))
            || parts.iter().any(|patch| emits(&patch.section.material))
    }

    /// Adds the patches of flags. Patches with equal globs are joined to one patch. Flags such as
    /// `--material Gold.metallic=1` and `--material Gold.specular=0.5` therefore may be in any
    /// order.
    fn add_flags<'a, S: Clone + for<'de> Deserialize<'de>>(
        &'a self,
        patches: &mut Vec<Patch<'a, S>>,
        target: PatchTarget,
        set_over: impl Fn(&mut S, S),
    ) -> Result<(), FileError> {
        let first = patches.len();
        for (written, line) in self.source.overrides.patches(target) {
            let section: S = toml::from_str(line).map_err(|error| {
                let (message, help) = parser_error(error.message());
                let place = error
                    .span()
                    .map_or(line.len() - 1, |span| span.start.min(line.len() - 1));
                self.error(place..place, message).help(help)
            })?;
            let glob = Glob::new(written);
            match patches[first..].iter_mut().find(|patch| patch.glob == glob) {
                Some(patch) => set_over(patch.section.to_mut(), section),
                None => patches.push(Patch {
                    glob,
                    written,
                    span: line.len() - 1..line.len(),
                    section: Cow::Owned(section),
                }),
            }
        }
        Ok(())
    }

    /// Returns an error if `section`, a section of `[patch]`, has the key `patch`.
    fn check_patch(&self, section: &MaterialSection) -> Result<(), FileError> {
        match &section.patch {
            Some(key) => {
                let error = self.error(key.span(), "`patch` belongs in [material.NAME] only");
                Err(error.help("remove `patch`: this section is already a patch"))
            }
            None => Ok(()),
        }
    }
}
