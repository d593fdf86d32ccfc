//! Colour textures that are normal maps by their names and by their pixels. Exporters write them as
//! `map_Kd` if the last texture of a material is its normal map.

use super::Loader;
use super::picture_names::{has_extension, stem_of};
use super::picture_roles::{Role, role_of};
use crate::scene_file::Severity;
use crate::scene_file::mtl::{MapRequest, MapSlot};
use crate::scene_file::texture::is_normal_map;
use std::fs;
use std::path::{Path, PathBuf};

/// Maximum number of files of a folder that are searched for the colour texture.
const MAX_FILES: usize = 10_000;

impl Loader<'_> {
    /// Replaces the path of a colour texture that is a normal map by the path of the colour texture
    /// of the same set. If there is no such texture, the path becomes `None`. Libraries that are
    /// read literally, and textures of scene files, do not change.
    pub(super) fn replace_normals_as_color(&mut self, request: &mut MapRequest) {
        let may_be = request.statement.slot == MapSlot::Diffuse && !request.is_literal;
        let Some(path) = request.path.clone().filter(|_| may_be && !self.file.load.is_literal()) else {
            return;
        };
        let known = self.normals_as_color.entry(path);
        let find = |path: &PathBuf| (is_named_normals(path) && is_normal_map(path)).then(|| color_beside(path));
        let Some(color) = known.or_insert_with_key(find).clone() else {
            return;
        };
        let instead = match &color {
            Some(color) => format!("{} is used", color.display()),
            None => "the material has no colour texture".into(),
        };
        let note = request.remark(&format!("is a normal map where a colour is expected; {instead}"));
        let note = note.help("name the colour texture in `map_Kd`; --mtl-dialect spec uses the named picture");
        if self.findings.iter().all(|known| known.error.message != note.message) {
            self.findings.add(Severity::Note, "normals-as-color", note);
        }
        request.path = color;
    }
}

/// Returns true if the name of a picture says that it is a normal map.
fn is_named_normals(path: &Path) -> bool {
    let role = role_of(&stem_of(path)).map(|(_, role)| role);
    matches!(role, Some(Role::Normal | Role::DirectXNormal))
}

/// The only colour texture in the folder of the normal map `path` whose name differs from that of
/// the normal map only by the role.
fn color_beside(path: &Path) -> Option<PathBuf> {
    let (set, _) = role_of(&stem_of(path))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let listed = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let entries = fs::read_dir(listed).into_iter().flatten().flatten().take(MAX_FILES);
    let names = entries.map(|entry| PathBuf::from(entry.file_name()));
    let is_color = |name: &PathBuf| {
        let role = role_of(&stem_of(name));
        has_extension(&name.to_string_lossy()) && role.is_some_and(|role| role == (set.clone(), Role::Color))
    };
    let mut colors = names.filter(is_color);
    let only = colors.next().filter(|_| colors.next().is_none())?;
    Some(folder.join(only))
}
