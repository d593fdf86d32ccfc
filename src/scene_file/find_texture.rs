//! Search for texture files. MTL files often name textures with paths on the modeller's computer,
//! such as `C:\\Users\\bob\\Textures\\a.png`.

use super::find_file::{FileFinder, base_name, folder_above, unquoted};
use crate::math::excerpt_of_path;
use std::path::{Path, PathBuf};

/// Usual names of texture folders. They lie in the folder of a material library, or in its parent
/// folder.
const USUAL_FOLDERS: [&str; 5] = ["textures", "maps", "texture", "images", "tex"];
/// Maximum number of folders in an end of a path. An end is a file name with the folders directly
/// before it: `c/d/file.png` is an end of `a/b/c/d/file.png` with two folders. The search looks for
/// the ends of a written path.
const MAX_FOLDERS_OF_NAME: usize = 3;

/// Returns true if `name` is a usual name of a texture folder. Case does not matter.
pub(super) fn is_texture_folder(name: &str) -> bool {
    USUAL_FOLDERS.iter().any(|usual| name.eq_ignore_ascii_case(usual))
}

/// Folders in which the textures of a material are searched.
pub(super) struct TextureSearch<'a> {
    /// Folder of the material library, or of the scene file, that names the textures.
    folder: &'a Path,
    /// Folders that the user gave, in their order.
    given: &'a [PathBuf],
    /// Folder of the OBJ file.
    obj: &'a Path,
}

/// A texture found by the search.
#[derive(Debug, PartialEq)]
pub(super) enum FoundTexture {
    /// The texture was found at the path as written.
    AsNamed(PathBuf),
    /// The texture was found under its file name only, or in another folder.
    Elsewhere(PathBuf),
}

impl<'a> TextureSearch<'a> {
    /// Search for textures that the material library `library` names, for the OBJ file `obj`.
    /// `given` are folders that the user gave.
    pub fn new(library: &'a Path, given: &'a [PathBuf], obj: &'a Path) -> Self {
        let folder = |file: &'a Path| file.parent().unwrap_or(Path::new(""));
        Self {
            folder: folder(library),
            given,
            obj: folder(obj),
        }
    }

    /// Finds the first of `names` that exists as a file. If there is none, searches for the ends of
    /// the name ([`ends_of`], the longest end first) in these places:
    ///
    /// - the folders that the user gave;
    /// - the resources of Minecraft, if the name has the form of a resource name;
    /// - the folders of the library and the OBJ file, their parent folders, and usual texture
    ///   folders within them;
    /// - all folders within these folders, as [`FileFinder::folders_within`] lists them, if exactly
    ///   one of them has the file.
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
        let ends = ends_of(name);
        if ends.is_empty() {
            return None;
        }
        let in_folder = |folder: &Path, finder: &mut FileFinder| ends.iter().find_map(|end| finder.find(folder, end));
        let given = self.given.iter();
        let given = given
            .flat_map(|folder| finder.find(folder, name).or_else(|| in_folder(folder, finder)))
            .next();
        let found = given
            .or_else(|| finder.find(self.folder, name))
            .or_else(|| {
                self.resource(name)
                    .and_then(|path| finder.find(Path::new(""), &path.to_string_lossy()))
            })
            .or_else(|| self.usual_folders().find_map(|folder| in_folder(&folder, finder)))
            .or_else(|| ends.iter().find_map(|end| self.find_within(end, finder)));
        found.map(FoundTexture::Elsewhere)
    }

    /// Folders of the library and of the OBJ file, their parent folders, and the usual texture
    /// folders within them.
    fn usual_folders(&self) -> impl Iterator<Item = PathBuf> {
        self.places().into_iter().flat_map(|place| {
            let usual = USUAL_FOLDERS.map(|folder| place.join(folder));
            std::iter::once(place).chain(usual)
        })
    }

    /// Path of the file `name`, if exactly one folder has it. Searches all folders within the
    /// folders of [`Self::places`].
    fn find_within(&self, name: &str, finder: &mut FileFinder) -> Option<PathBuf> {
        let mut folders: Vec<PathBuf> = Vec::new();
        for place in self.places() {
            folders.extend_from_slice(finder.folders_within(&place));
        }
        folders.sort_unstable();
        folders.dedup();
        let mut found = folders.iter().filter_map(|folder| finder.find(folder, name));
        found.next().filter(|_| found.next().is_none())
    }

    /// Path of a resource of Minecraft. The resource `domain:block/a` is the file
    /// `assets/domain/textures/block/a.png`, if the OBJ file lies within the folder `assets`.
    fn resource(&self, name: &str) -> Option<PathBuf> {
        let (domain, path) = name.split_once(':')?;
        let is_plain = |c: char| matches!(c, 'a'..='z' | '0'..='9' | '_' | '-' | '.');
        let is_domain = domain.len() > 1 && domain.chars().all(is_plain);
        let is_path = !path.is_empty() && !path.starts_with('/') && path.chars().all(|c| is_plain(c) || c == '/');
        if !is_domain || !is_path {
            return None;
        }
        let assets = [self.folder, self.obj].into_iter().find_map(|folder| {
            let folder = if folder.as_os_str().is_empty() {
                Path::new(".")
            } else {
                folder
            };
            let folder = folder.canonicalize().ok()?;
            let mut above = folder.ancestors();
            above.find(|above| above.ends_with("assets")).map(Path::to_path_buf)
        })?;
        let file = format!("{}.png", path.strip_suffix(".png").unwrap_or(path));
        Some(assets.join(domain).join("textures").join(file))
    }

    /// Folders of the library and of the OBJ file, and their parent folders.
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

    /// Help text for a missing texture, with the folders and names that were searched.
    pub fn help(&self, name: &str, finder: &mut FileFinder) -> String {
        // Show the folder without a `/` at its end
        let shown = |folder: &Path| match folder.components().as_path() {
            folder if folder.as_os_str().is_empty() => ".".to_string(),
            folder => folder.display().to_string(),
        };
        let name = unquoted(name);
        let ends: Vec<String> = ends_of(name).iter().map(|end| excerpt_of_path(end).into()).collect();
        let wanted = match ends.as_slice() {
            [others @ .., last] if !others.is_empty() => format!("for {} and {last} ", others.join(", ")),
            _ => String::new(),
        };
        let places = self.places();
        let names: Vec<String> = self.given.iter().chain(&places).map(|folder| shown(folder)).collect();
        let mut has_few = |place: &&PathBuf| !finder.folders_within(place).is_empty();
        let within: Vec<String> = places
            .iter()
            .filter(|place| has_few(place))
            .map(|place| shown(place))
            .collect();
        let [others @ .., last] = USUAL_FOLDERS;
        let usual = format!("in their subfolders {} and {last}", others.join(", "));
        let folders = match within.as_slice() {
            [] => format!("and {usual}"),
            within => format!("{usual}, and one level deep in {}", within.join(", ")),
        };
        let resource = self.resource(name);
        let resource = resource.map_or(String::new(), |path| {
            format!(", and as {}", excerpt_of_path(&path.to_string_lossy()))
        });
        format!(
            "searched {wanted}in {}, {folders}{resource}; put the file into one of these folders, or name its folder with --texture-dir",
            names.join(", ")
        )
    }
}

/// Ends of a path, which any operating system may have written. The longest end, with up to
/// [`MAX_FOLDERS_OF_NAME`] folders, comes first. The last end is the file name only.
fn ends_of(name: &str) -> Vec<String> {
    let Some(base) = base_name(name) else {
        return Vec::new();
    };
    let folders = name[..name.len() - base.len()].rsplit(['/', '\\']);
    let is_folder = |part: &&str| !matches!(*part, "." | "..") && !part.contains(':');
    let folders = folders.filter(|part| !part.is_empty()).take_while(is_folder);
    let mut ends = vec![base.to_string()];
    for folder in folders.take(MAX_FOLDERS_OF_NAME) {
        let longer = ends.last().map(|end| format!("{folder}/{end}"));
        ends.extend(longer);
    }
    ends.reverse();
    ends
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
            "textures/car/k.png",
            "static/l.png",
            "static/twice.png",
            "other/twice.png",
            "model/o.png",
            "model/other.OBJ",
            "lib/tex/n.png",
        ] {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), name).unwrap();
        }
        // Files of the same name in the given folder and beside the library
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
            ("car/k.png", Some("textures/car/k.png")),
            ("..\\old\\car\\k.png", Some("textures/car/k.png")),
            ("l.png", Some("static/l.png")),
            ("n.png", Some("lib/tex/n.png")),
            ("twice.png", None),
            ("o.png", None),
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
        let help = search.help("C:\\x\\y.png", &mut FileFinder::default());
        for part in [
            "given, ",
            "lib, ",
            "textures, ",
            "maps",
            "obj, ",
            ", and one level deep in ",
            "searched for x/y.png and y.png in ",
            "--texture-dir",
        ] {
            assert!(help.contains(part), "{help}");
        }
        // If there are too many folders, they are not searched.
        for i in 0..32 {
            fs::create_dir(at(&format!("more{i}"))).unwrap();
        }
        let found = search.find(std::iter::once("l.png"), &mut FileFinder::default());
        assert_eq!(found, None);
    }

    #[test]
    fn resources_of_minecraft_have_a_folder_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join("assets").join(name);
        for name in ["mod1/textures/block/a.png", "mod_2/textures/b.png"] {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), name).unwrap();
        }
        let obj = at("mod1/models/item/m.obj");
        fs::create_dir_all(obj.parent().unwrap()).unwrap();
        let search = TextureSearch::new(&obj, &[], &obj);
        for (name, expected) in [
            ("mod1:block/a", Some("mod1/textures/block/a.png")),
            ("mod_2:b.png", Some("mod_2/textures/b.png")),
            ("mod1:block/gone", None),
            ("m:block/a", None),
        ] {
            let found = search.find(std::iter::once(name), &mut FileFinder::default());
            let content = found.map(|found| match found {
                FoundTexture::AsNamed(path) | FoundTexture::Elsewhere(path) => fs::read_to_string(path).unwrap(),
            });
            assert_eq!(content.as_deref(), expected, "{name}");
        }
        let help = search.help("mod1:block/gone", &mut FileFinder::default());
        assert!(help.contains("gone.png; put the file into"), "{help}");
    }

    #[test]
    fn folders_of_one_place_are_named_once() {
        let folder = tempfile::tempdir().unwrap();
        let [library, obj] = ["x/a.mtl", "x/a.obj"].map(|name| folder.path().join(name));
        let search = TextureSearch::new(&library, &[], &obj);
        let folder = folder.path().display();
        let help = format!(
            "searched in {folder}/x, {folder}, and in their subfolders textures, maps, texture, images and tex; put the \
             file into one of these folders, or name its folder with --texture-dir"
        );
        assert_eq!(search.help("b.png", &mut FileFinder::default()), help);
    }
}
