//! Other OBJ files in the folder of the scene. They are evidence for the upright axis of the scene,
//! because most files of a folder have the same axis. The selection of files depends only on names,
//! sizes and first lines.

use crate::files::memory::Allowance;
use crate::guess::{CameraFinder, CameraRequest, SiblingFiles};
use crate::io::load_obj::load_obj;
use crate::io::obj::{file_axes, first_comment};
use crate::io::{Findings, LoadOptions};
use crate::material::Material;
use crate::options::Backend;
use crate::scene::{Scene, SceneBuilder};
use std::fs;
use std::path::{Path, PathBuf};

/// Maximum number of files that are read, and maximum size of each file in bytes.
const MAX_FILES: usize = 8;
const MAX_BYTES: u64 = 1 << 20;
/// Maximum number of files whose size and first line are compared.
const MAX_COMPARED: usize = 64;

/// Evidence about the upright axis, from OBJ files in the folder of `obj` that the same program
/// wrote. Interiors and unreadable files give no evidence.
pub(super) fn siblings(obj: &Path, backend: Backend, pool: &rayon::ThreadPool) -> SiblingFiles {
    let mut siblings = SiblingFiles::default();
    for path in beside(obj) {
        let Some(scene) = pool.install(|| shape(&path)) else {
            continue;
        };
        let Ok(accel) = backend.for_guesses().build(&scene, pool) else {
            continue;
        };
        let request = CameraRequest {
            axes: file_axes(&path),
            ..CameraRequest::default()
        };
        let survey = pool.install(|| *CameraFinder::new(&scene, accel.as_dyn(), request, 1.0).survey());
        if let (Some(scores), false) = (survey.up_scores, survey.is_interior) {
            siblings.add(&scores);
        }
    }
    siblings
}

/// OBJ files beside `obj` that the same program wrote, according to their first comment. The files
/// are sorted by name.
fn beside(obj: &Path) -> Vec<PathBuf> {
    let folder = obj.parent().filter(|folder| *folder != Path::new(""));
    let Ok(entries) = fs::read_dir(folder.unwrap_or(Path::new("."))) else {
        return Vec::new();
    };
    let is_obj = |name: &Path| name.extension().is_some_and(|ext| ext.eq_ignore_ascii_case("obj"));
    let mut paths: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| is_obj(path) && path.file_name() != obj.file_name())
        .collect();
    paths.sort();
    let comment = first_comment(obj);
    let is_alike = |path: &PathBuf| {
        let is_small = fs::metadata(path).is_ok_and(|file| file.is_file() && file.len() <= MAX_BYTES);
        is_small && first_comment(path) == comment
    };
    let alike: Vec<PathBuf> = spread(&paths, MAX_COMPARED).into_iter().filter(is_alike).collect();
    spread(&alike, MAX_FILES)
}

/// Selects evenly spaced paths: `max` paths, or all if there are fewer.
fn spread(paths: &[PathBuf], max: usize) -> Vec<PathBuf> {
    let (len, count) = (paths.len(), paths.len().min(max));
    (0..count).map(|i| paths[i * len / count].clone()).collect()
}

/// Scene with the meshes of an OBJ file. The materials of the scene have only names.
fn shape(path: &Path) -> Option<Scene> {
    let options = LoadOptions::default();
    let file = load_obj(path, &options, Allowance::of_system(), &(), &mut Findings::default()).ok()?;
    let mut builder = SceneBuilder::new();
    for group in file.groups {
        let material = Material {
            name: group.material.unwrap_or_default(),
            ..Material::default()
        };
        let material = builder.add_material(material).ok()?;
        builder.add_mesh(group.mesh, material).ok()?;
    }
    Some(builder.build().ok()?.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_spread_evenly() {
        let paths: Vec<PathBuf> = (0..11).map(|i| PathBuf::from(i.to_string())).collect();
        let chosen = |max| spread(&paths, max).len();
        assert_eq!([0, 1, 8, 11, 20].map(chosen), [0, 1, 8, 11, 11]);
        assert_eq!(spread(&paths, 3), ["0", "3", "7"].map(PathBuf::from));
        assert!(spread(&[], 3).is_empty());
    }
}
