//! The search for textures. Libraries name them as they lay on the machine of the modeller, such as `C:\\Users\\bob\\Textures\\a.png`.

use super::find_file::{FileFinder, base_name, folder_above, unquoted};
use std::path::{Path, PathBuf};

/// Folders beside a library, or beside its folder, in which textures lie.
const USUAL_FOLDERS: [&str; 4] = ["textures", "maps", "texture", "images"];

/// Folders, relative to that of an OBJ file, in which its textures usually lie: that one, the usual ones
/// within it, and those beside it.
pub(super) fn texture_folders() -> impl Iterator<Item = PathBuf> {
    let beside = USUAL_FOLDERS.iter().map(|folder| Path::new("..").join(folder));
    let within = USUAL_FOLDERS.iter().map(PathBuf::from);
    std::iter::once(PathBuf::new()).chain(within).chain(beside)
}

/// The folders in which the textures of a material are looked for.
pub(super) struct TextureSearch<'a> {
    /// Folder of the file that names the textures.
    folder: &'a Path,
    /// Folders that the user gave, in their order.
    given: &'a [PathBuf],
    /// Folder of the OBJ file.
    obj: &'a Path,
}

/// A texture that was found.
#[derive(Debug, PartialEq)]
pub(super) enum FoundTexture {
    /// Under the name that was written.
    AsNamed(PathBuf),
    /// Under its base name, or in another folder.
    Elsewhere(PathBuf),
}

impl<'a> TextureSearch<'a> {
    /// Textures named in `library` for the OBJ file `obj`; `given` are folders that the user gave.
    pub fn new(library: &'a Path, given: &'a [PathBuf], obj: &'a Path) -> Self {
        let folder = |file: &'a Path| file.parent().unwrap_or(Path::new(""));
        Self {
            folder: folder(library),
            given,
            obj: folder(obj),
        }
    }

    /// The file of the first of these `names` that is there. Else it is looked for in the folders
    /// that the user gave, by the whole name and by the base name, then by the base name beside the
    /// library, the OBJ file and their folders, and in the usual folders there.
    pub fn find<'n>(
        &self,
        names: impl Iterator<Item = &'n str> + Clone,
        finder: &mut FileFinder,
    ) -> Option<FoundTexture> {
        let as_named = names.clone().find_map(|name| finder.find(self.folder, name));
        as_named
            .map(FoundTexture::AsNamed)
            .or_else(|| names.map(unquoted).find_map(|name| self.find_elsewhere(name, finder)))
    }

    fn find_elsewhere(&self, name: &str, finder: &mut FileFinder) -> Option<FoundTexture> {
        let base = base_name(name)?;
        let given = self.given.iter().flat_map(|folder| [(folder, name), (folder, base)]);
        let given = given.map(|(folder, name)| (folder.clone(), name.to_string()));
        let unquoted = std::iter::once((self.folder.to_path_buf(), name.to_string()));
        let beside = self.places().into_iter().flat_map(|place| {
            let usual = USUAL_FOLDERS.map(|folder| (place.clone(), format!("{folder}/{base}")));
            std::iter::once((place, base.to_string())).chain(usual)
        });
        let mut all = given.chain(unquoted).chain(beside);
        all.find_map(|(folder, name)| finder.find(&folder, &name))
            .map(FoundTexture::Elsewhere)
    }

    /// The folders of the library and of the OBJ file, and those that they lie in.
    fn places(&self) -> Vec<PathBuf> {
        let here = [self.folder, self.obj];
        let mut places: Vec<PathBuf> = Vec::with_capacity(4);
        for place in here.map(Path::to_path_buf).into_iter().chain(here.map(folder_above)) {
            if !places.contains(&place) {
                places.push(place);
            }
        }
        places
    }

    /// What to do about a texture that is nowhere.
    pub fn help(&self) -> String {
        let folders = self.given.iter().cloned().chain(self.places());
        // Without a trailing `/`
        let names = folders.map(|folder| match folder.components().as_path() {
            folder if folder.as_os_str().is_empty() => ".".to_string(),
            folder => folder.display().to_string(),
        });
        let names: Vec<String> = names.collect();
        let [others @ .., last] = USUAL_FOLDERS;
        format!(
            "searched in {}, and in the folders {} and {last} there; put it there, or name its folder with --texture-dir",
            names.join(", "),
            others.join(", ")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn textures_are_found_by_their_base_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in [
            "lib/a.png",
            "lib/Textures/B.png",
            "obj/c.png",
            "obj/maps/d.png",
            "given/e.png",
            "given/x/f.png",
            "textures/g.png",
            "h.png",
            "obj/i j.png",
        ] {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), name).unwrap();
        }
        // One that is in the folder given as well as beside the library
        fs::write(at("given/a.png"), "given/a.png").unwrap();
        let (library, obj, given) = (at("lib/m.mtl"), at("obj/m.obj"), [at("given")]);
        let search = TextureSearch::new(&library, &given, &obj);
        for (name, expected) in [
            ("a.png", Some("lib/a.png")),
            ("C:\\Users\\bob\\a.png", Some("given/a.png")),
            ("C:\\Users\\bob\\b.png", Some("lib/Textures/B.png")),
            ("/home/bob/c.png", Some("obj/c.png")),
            ("old/d.png", Some("obj/maps/d.png")),
            ("e.png", Some("given/e.png")),
            ("x/f.png", Some("given/x/f.png")),
            ("g.png", Some("textures/g.png")),
            ("D:/h.png", Some("h.png")),
            ("\"i j.png\"", Some("obj/i j.png")),
            ("gone.png", None),
            ("lib/", None),
            ("..", None),
            ("a/..", None),
            ("\\", None),
        ] {
            let found = search.find(std::iter::once(name), &mut FileFinder::default());
            let is_named = matches!(found, Some(FoundTexture::AsNamed(_)));
            let content = found
                .map(|(FoundTexture::AsNamed(path) | FoundTexture::Elsewhere(path))| fs::read_to_string(path).unwrap());
            assert_eq!(content.as_deref(), expected, "{name}");
            assert_eq!(is_named, name == "a.png", "{name}");
        }
        let help = search.help();
        for part in ["given, ", "lib, ", "textures, ", "maps", "obj, ", "--texture-dir"] {
            assert!(help.contains(part), "{help}");
        }
    }

    #[test]
    fn folders_of_one_place_are_named_once() {
        let search = TextureSearch::new(Path::new("a.mtl"), &[], Path::new("a.obj"));
        let help = "searched in ., .., and in the folders textures, maps, texture and images there; put it there, or name its \
                    folder with --texture-dir";
        assert_eq!(search.help(), help);
    }
}
