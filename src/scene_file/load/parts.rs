//! Patches of parts of OBJ files: materials of parts, and errors of patterns that match no part.

use super::materials::help_of_names;
use super::{Loader, SubdividedFile};
use crate::math::excerpt_of_name;
use crate::scene_file::FileError;
use crate::scene_file::obj::{Group, ObjFile};
use std::collections::BTreeMap;
use toml::Spanned;

impl Loader<'_> {
    /// Material that patches assign to the parts of a group, and the indices of the patches that
    /// change this material. If several patches have the key `material`, patches before the last of
    /// them have no effect.
    pub(super) fn material_of_parts(&self, group: &Group) -> (Option<Spanned<String>>, Vec<u32>) {
        let section = |&rule: &u32| self.parts.get(rule as usize).map(|patch| &*patch.section);
        let other = |rule: &u32| section(rule).and_then(|section| section.keys.material.clone());
        let last = group.rules.iter().rposition(|rule| other(rule).is_some());
        let changes = |rule: &u32| section(rule).is_some_and(|section| section.changes_material());
        let rules = group.rules.iter().skip(last.unwrap_or(0)).copied();
        (
            last.and_then(|last| other(&group.rules[last])),
            rules.filter(changes).collect(),
        )
    }

    /// Reports an error: a patch of parts names a material that neither the scene file nor the
    /// libraries of `obj` have.
    pub(super) fn refuse_material(&mut self, name: &Spanned<String>, obj: &ObjFile) {
        let known = obj.materials.iter().map(|found| found.material.name.as_str());
        let replaced = self.file.material.keys().map(|key| key.get_ref().as_str());
        let help = help_of_names("materials", name.get_ref(), known.chain(replaced));
        let message = format!("there is no material `{}`", excerpt_of_name(name.get_ref()));
        let error = self.file.error(name.span(), message).help(help);
        self.wrong("wrong-part", error);
    }

    /// Reports patterns that match no part of any file. Also reports a scene if all its parts are
    /// hidden.
    pub(super) fn check_parts(&mut self, objs: &BTreeMap<SubdividedFile, ObjFile>) {
        let filter = &self.load.parts;
        if filter.is_empty() || objs.is_empty() && !self.files.is_empty() {
            return;
        }
        let names = self.builder.part_names();
        let names: Vec<&str> = (names.parts())
            .flat_map(|part| [names.object(part), names.groups(part)])
            .filter(|name| !name.is_empty())
            .collect();
        let unfit = (filter.globs().zip(&self.part_fits).enumerate()).filter(|(_, (_, fits))| !**fits);
        let first_rule = filter.hide.len() + filter.only.len();
        let mut errors: Vec<FileError> = unfit
            .map(|(index, (glob, _))| {
                let literal = glob.literal();
                let message = if glob.is_exact() {
                    format!("no part of the scene has the name `{}`", excerpt_of_name(&literal))
                } else {
                    format!(
                        "no part of the scene fits the pattern `{}`",
                        excerpt_of_name(&glob.text(0))
                    )
                };
                let rule = index.checked_sub(first_rule).and_then(|rule| self.parts.get(rule));
                let error = match rule {
                    Some(patch) => self.file.error(patch.span.clone(), message),
                    None => self.file.whole(message),
                };
                error.help(help_of_names("parts", &literal, names.iter().copied()))
            })
            .collect();
        let is_empty = objs.values().all(|obj| obj.groups.is_empty()) && self.file.made.is_empty();
        if errors.is_empty() && is_empty && self.findings.first_error().is_none() {
            let error = self.file.whole("all parts of the scene are hidden");
            errors.push(error.help(help_of_names("parts", "", names.iter().copied())));
        }
        for error in errors {
            self.wrong("unused-part", error);
        }
    }
}
