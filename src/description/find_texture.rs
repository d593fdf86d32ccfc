//! The search for textures. Libraries name them as they lay on the machine of the modeller, such as `C:\\Users\\bob\\Textures\\a.png`.

use super::find_file::find_file;
use std::path::{Path, PathBuf};

/// Folders beside a library in which textures lie.
const USUAL_FOLDERS: [&str; 2] = ["textures", "maps"];

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

    /// The file that is called `name`: where that says, then in the folders that the user gave, by the whole name and by the base name, then by the
    /// base name beside the library and the OBJ file and in the usual folders there.
    pub fn find(&self, name: &str) -> Option<FoundTexture> {
        if let Some(path) = find_file(self.folder, name) {
            return Some(FoundTexture::AsNamed(path));
        }
        // Drives and folders of other systems end in `/` or `\`.
        let base = name
            .rsplit(['/', '\\'])
            .next()
            .filter(|base| !base.is_empty() && *base != "..")?;
        let given = self.given.iter();
        let given = given.flat_map(|folder| [(folder.as_path(), name.to_string()), (folder, base.to_string())]);
        let beside = self.beside().map(|(folder, usual)| match usual {
            Some(usual) => (folder, format!("{usual}/{base}")),
            None => (folder, base.to_string()),
        });
        let found = given.chain(beside).find_map(|(folder, name)| find_file(folder, &name));
        found.map(FoundTexture::Elsewhere)
    }

    /// The folders of the library and of the OBJ file, each alone and with the usual folders in it.
    fn beside(&self) -> impl Iterator<Item = (&'a Path, Option<&'static str>)> {
        let obj = (self.obj != self.folder).then_some(self.obj);
        let places = [Some(self.folder), obj].into_iter().flatten();
        places.flat_map(|place| {
            let usual = USUAL_FOLDERS.map(|name| (place, Some(name)));
            std::iter::once((place, None)).chain(usual)
        })
    }

    /// What to do about a texture that is nowhere.
    pub fn help(&self) -> String {
        let beside = self.beside().map(|(place, usual)| place.join(usual.unwrap_or("")));
        let folders = self.given.iter().cloned().chain(beside);
        // Without a trailing `/`
        let names = folders.map(|folder| match folder.components().as_path() {
            folder if folder.as_os_str().is_empty() => ".".to_string(),
            folder => folder.display().to_string(),
        });
        let names: Vec<String> = names.collect();
        format!(
            "searched in {}; put it there, or name its folder with --texture-dir",
            names.join(", ")
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
            ("gone.png", None),
            ("lib/", None),
            ("..", None),
            ("a/..", None),
            ("\\", None),
        ] {
            let found = search.find(name);
            let is_named = matches!(found, Some(FoundTexture::AsNamed(_)));
            let content = found
                .map(|(FoundTexture::AsNamed(path) | FoundTexture::Elsewhere(path))| fs::read_to_string(path).unwrap());
            assert_eq!(content.as_deref(), expected, "{name}");
            assert_eq!(is_named, name == "a.png", "{name}");
        }
        let help = search.help();
        for part in ["given, ", "lib, ", "textures, ", "maps", "obj", "--texture-dir"] {
            assert!(help.contains(part), "{help}");
        }
    }

    #[test]
    fn folders_of_one_place_are_named_once() {
        let search = TextureSearch::new(Path::new("a.mtl"), &[], Path::new("a.obj"));
        let help = "searched in ., textures, maps; put it there, or name its folder with --texture-dir";
        assert_eq!(search.help(), help);
    }
}
