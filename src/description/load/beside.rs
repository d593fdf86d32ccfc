//! Search for pictures near an OBJ file: in its folder, in texture folders within or beside this
//! folder, and in folders within those texture folders that have the name of the OBJ file.

use crate::description::find_file::FileFinder;
use crate::description::find_texture::is_texture_folder;
use crate::description::texture::texture_size;
use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::{BTreeSet, HashSet};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Maximum number of files that are listed for a folder.
const MAX_FILES: usize = 10_000;
/// Maximum number of material libraries of a folder that are searched for names of textures, and
/// maximum size of each library in bytes.
const MAX_LIBRARIES: usize = 64;
const MAX_LIBRARY_BYTES: u64 = 1 << 20;
/// File extensions of pictures.
const EXTENSIONS: [&str; 13] = [
    "png", "jpg", "jpeg", "tga", "tif", "tiff", "webp", "bmp", "exr", "hdr", "dds", "gif", "jfif",
];
/// Prefix of metadata that this program writes into pictures.
const METADATA: &[u8] = b"embrasure.";
/// Number of bytes at the beginning of a picture in which the prefix is searched.
const METADATA_BYTES: u64 = 1 << 16;
/// Words that often appear in names of colour textures.
const TEXTURE_WORDS: [&str; 18] = [
    "albedo",
    "atlas",
    "basecolor",
    "basecolour",
    "col",
    "color",
    "colormap",
    "colour",
    "diff",
    "diffuse",
    "map",
    "palette",
    "skin",
    "tex",
    "texture",
    "textures",
    "uv",
    "uvs",
];
/// Words in names of other pictures: views of a model, or textures of other properties.
const OTHER_WORDS: [&str; 31] = [
    "banner",
    "beauty",
    "bump",
    "curvature",
    "env",
    "cover",
    "hud",
    "icon",
    "image",
    "img",
    "inv",
    "inventory",
    "lightmap",
    "lm",
    "logo",
    "mask",
    "photo",
    "preview",
    "readme",
    "ref",
    "reference",
    "reflection",
    "render",
    "screen",
    "screenshot",
    "shadow",
    "skybox",
    "spec",
    "specular",
    "thumb",
    "thumbnail",
];
/// Texts in names of folders with pictures, other than [`is_texture_folder`].
const FOLDER_WORDS: [&str; 9] = ["bitmap", "gfx", "image", "img", "map", "material", "pic", "skin", "tex"];
/// Words in names that programs give, or that name no model.
const GENERIC_WORDS: &[&str] = &[
    "asset",
    "assets",
    "auv",
    "base",
    "bake",
    "baked",
    "blinn",
    "default",
    "defaultmaterial",
    "export",
    "final",
    "group",
    "high",
    "image",
    "images",
    "initial",
    "lambert",
    "low",
    "lowpoly",
    "main",
    "maps",
    "mat",
    "material",
    "materials",
    "mesh",
    "meshes",
    "model",
    "models",
    "none",
    "null",
    "obj",
    "object",
    "objects",
    "output",
    "phong",
    "poly",
    "scene",
    "shading",
    "source",
    "standard",
    "surface",
    "untitled",
];
/// Maximum number of pictures in a folder in which the only texture is searched for.
const MAX_HERE: usize = 64;
/// Minimum length of an OBJ file's name, or of the first word of this name, to match pictures by
/// it.
const MIN_NAME: usize = 3;
/// Minimum length of a word within the name of a picture to find the picture by the word.
const MIN_WORD_WITHIN: usize = 4;

/// Result of a rule for pictures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Picked {
    /// The rule holds for no picture.
    Nothing,
    /// The rule holds for pictures of several kinds.
    Several,
    /// Path of the picture from the folder of the OBJ file.
    One(PathBuf),
}

/// A picture near an OBJ file.
#[derive(Clone, Debug)]
pub(super) struct Image {
    /// Path of the picture, relative to the folder of the OBJ file.
    pub path: PathBuf,
    /// Words of the picture's name without its extension.
    words: Vec<String>,
    /// True if the picture lies in the folder of the OBJ file.
    is_here: bool,
}

impl Image {
    /// Returns true if a word of the picture's name shows that it is not a colour texture of a
    /// model.
    fn is_other(&self) -> bool {
        self.words.iter().any(|word| is_other_word(word))
    }

    /// Name of the picture without numbers at its end. Variants of a picture, such as `skin1` and
    /// `skin2`, have the same result.
    fn family(&self) -> String {
        let words = without_sizes(&self.words).concat();
        words.trim_end_matches(|c: char| c.is_ascii_digit()).to_string()
    }
}

/// Pictures, OBJ files and material libraries near an OBJ file.
#[derive(Clone, Debug, Default)]
pub(super) struct NearbyFiles {
    /// Folder of the OBJ file.
    here: PathBuf,
    /// Words of the name of the OBJ file.
    file: Vec<String>,
    /// Pictures, ordered by folder and name.
    pub images: Vec<Image>,
    /// Names of all OBJ files in the folder. Each name is its words, joined without separators.
    objs: Vec<String>,
    /// Material libraries in the folder.
    libraries: Vec<PathBuf>,
    /// Picture with the name of the OBJ file in other folders, after the first search.
    distant: OnceCell<Picked>,
}

impl NearbyFiles {
    /// Finds the files near the OBJ file `path`.
    pub fn of(path: &Path) -> Self {
        let mut found = Self {
            here: path.parent().unwrap_or(Path::new("")).to_path_buf(),
            file: words_of(&stem_of(path)),
            ..Self::default()
        };
        let file = found.file.concat();
        let is_of_file = |name: &Path| words_of(&name.to_string_lossy()).concat() == file;
        let within = found.folders_in(Path::new(""));
        let above = found.folders_in(Path::new(".."));
        let usual = |folders: &[PathBuf]| -> Vec<PathBuf> {
            let is_usual = |folder: &&PathBuf| is_texture_folder(&name_of(folder));
            folders.iter().filter(is_usual).cloned().collect()
        };
        let mut folders = vec![PathBuf::new()];
        folders.extend(usual(&within));
        folders.extend(usual(&above));
        for folder in folders.clone() {
            let own = found.folders_in(&folder);
            folders.extend(own.into_iter().filter(|own| is_of_file(Path::new(&*name_of(own)))));
        }
        for folder in folders {
            for name in found.files_in(&folder) {
                let extension = name.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
                let words = words_of(&stem_of(&name));
                let is_here = folder.as_os_str().is_empty();
                match &*extension {
                    "obj" if is_here => found.objs.push(words.concat()),
                    "mtl" if is_here => found.libraries.push(name),
                    extension if EXTENSIONS.contains(&extension) => found.images.push(Image {
                        path: folder.join(&name),
                        words,
                        is_here,
                    }),
                    _ => {}
                }
            }
        }
        found
    }

    /// Sorted entries of `folder` for which `is` returns true.
    fn entries_in(&self, folder: &Path, is: fn(&fs::DirEntry) -> bool) -> Vec<PathBuf> {
        let listed = self.here.join(folder);
        let listed = if listed.as_os_str().is_empty() {
            Path::new(".")
        } else {
            &listed
        };
        let entries = fs::read_dir(listed).into_iter().flatten().flatten().take(MAX_FILES);
        let mut names: Vec<PathBuf> = entries.filter(is).map(|entry| entry.file_name().into()).collect();
        names.sort_unstable();
        names
    }

    /// Folders within `folder`, with paths relative to the folder of the OBJ file.
    fn folders_in(&self, folder: &Path) -> Vec<PathBuf> {
        let names = self.entries_in(folder, |entry| entry.path().is_dir());
        names.into_iter().map(|name| folder.join(name)).collect()
    }

    /// Paths of the files in a folder.
    fn files_in(&self, folder: &Path) -> Vec<PathBuf> {
        self.entries_in(folder, |entry| entry.path().is_file())
    }

    /// Returns true if the folder contains exactly one OBJ file.
    pub fn is_alone(&self) -> bool {
        self.objs.len() == 1
    }

    /// Returns true if this program wrote the picture, such as `model.png` of an earlier render of
    /// `model.obj`. The program writes metadata before the pixels.
    pub fn is_rendering(&self, image: &Image) -> bool {
        let mut begin = Vec::new();
        let file = File::open(self.here.join(&image.path));
        let read = file.and_then(|file| file.take(METADATA_BYTES).read_to_end(&mut begin));
        read.is_ok() && begin.windows(METADATA.len()).any(|window| window == METADATA)
    }

    /// Pictures for which `rule` holds, except those that this program wrote.
    fn found(&self, rule: impl Fn(&Image) -> bool) -> Vec<&Image> {
        let images = self.images.iter().filter(|image| rule(image));
        images.filter(|image| !self.is_rendering(image)).collect()
    }

    /// The picture that has the name of the OBJ file. If neither the folder of the file nor its
    /// texture folders have one, other folders beside the file and beside its folder are searched.
    pub fn picture_of_name(&self) -> Picked {
        let file = self.file.concat();
        match self.found(|image| image.words.concat() == file).as_slice() {
            [] => self.distant.get_or_init(|| self.distant_picture(&file)).clone(),
            [one] => Picked::One(one.path.clone()),
            _ => Picked::Several,
        }
    }

    /// The only picture with the name `file` in picture folders without models, within the folder
    /// of the OBJ file and beside it. Previews lie there too, so its sides must be powers of two.
    fn distant_picture(&self, file: &str) -> Picked {
        if file.len() < MIN_NAME {
            return Picked::Nothing;
        }
        let mut finder = FileFinder::default();
        let mut found = Vec::new();
        for place in [self.here.clone(), self.here.join("..")] {
            for folder in finder.folders_within(&place).to_vec() {
                let name = name_of(&folder);
                let is_of_textures = FOLDER_WORDS.iter().any(|word| name.contains(word));
                let is_views = |word: &String| {
                    let word = word.trim_end_matches('s');
                    is_other_word(word) && !FOLDER_WORDS.contains(&word)
                };
                let is_other = !is_of_textures || words_of(&name).iter().any(is_views);
                let Ok(folder) = folder.strip_prefix(&self.here) else {
                    continue;
                };
                if is_other || is_texture_folder(&name) {
                    continue;
                }
                for name in self.files_in(folder) {
                    let words = words_of(&stem_of(&name));
                    if words.concat() == file && has_extension(&name.to_string_lossy()) {
                        let (path, is_here) = (folder.join(name), false);
                        found.push(Image { path, words, is_here });
                    }
                }
            }
        }
        found.retain(|image| self.is_square_power(image) && !self.is_rendering(image));
        match found.as_slice() {
            [] => Picked::Nothing,
            [one] => Picked::One(one.path.clone()),
            _ => Picked::Several,
        }
    }

    /// The picture whose name is like the name of the OBJ file. `may_be` returns true for possible
    /// colour textures, and `is_single` is true if the file has one material. The first of these
    /// rules that any picture fulfils decides; it must hold for pictures of one kind.
    ///
    /// 1. Its name begins with the name of the file, and not with a longer name of another OBJ file
    ///    of the folder. If the file has several materials, the other words are texture words. Of
    ///    pictures that differ by a number, the first is taken.
    /// 2. Its first word is the first word of the file, and its other words are texture words:
    ///    `cup_tex` for `cup_small`.
    pub fn picture_like_name(&self, may_be: impl Fn(&Image) -> bool, is_single: bool) -> Picked {
        let file = self.file.concat();
        let claimed = self.claimed(&[]);
        let is_candidate = |image: &Image| may_be(image) && !image.is_other() && !is_claimed(&claimed, &image.path);
        let begins = |image: &Image| file.len() >= MIN_NAME && self.begins_with_file(image, &file, is_single);
        let shares = |image: &Image| self.shares_first_word(image);
        let rules: [&dyn Fn(&Image) -> bool; 2] = [&begins, &shares];
        for rule in rules {
            let found = self.found(|image| is_candidate(image) && rule(image));
            let families: BTreeSet<String> = found.iter().map(|image| image.family()).collect();
            if let Some(first) = found.first() {
                return match families.len() {
                    1 => Picked::One(first.path.clone()),
                    _ => Picked::Several,
                };
            }
        }
        Picked::Nothing
    }

    /// The only picture of the folder, if its sides are powers of two and one of these rules holds.
    /// `parts` are names of parts of the OBJ file.
    ///
    /// 1. The folder has no other OBJ file, and no library names the picture.
    /// 2. The folder has no library, and the name of the picture has a texture word.
    /// 3. The name of the file, without numbers, begins or ends a word of the picture: `lunarrock`
    ///    for `rock3`. No library names the picture.
    /// 4. A library whose name has a word of a part names the picture: the library `low_fox` for
    ///    the part `fox1`.
    pub fn only_picture(&self, may_be: impl Fn(&Image) -> bool, parts: &[String]) -> Option<PathBuf> {
        if self.images.iter().filter(|image| image.is_here).count() > MAX_HERE {
            return None;
        }
        let here = self.found(|image| image.is_here);
        let &[only] = here.as_slice() else { return None };
        if !may_be(only) || only.is_other() || !self.is_square_power(only) {
            return None;
        }
        let (all, own) = (self.claimed(&[]), self.libraries_of(parts));
        let own: Vec<&Path> = own.iter().map(PathBuf::as_path).collect();
        let is_of_parts =
            || !own.is_empty() && is_claimed(&all, &only.path) && !is_claimed(&self.claimed(&own), &only.path);
        if is_claimed(&all, &only.path) {
            return is_of_parts().then(|| only.path.clone());
        }
        let is_of_other = || self.objs.iter().any(|obj| *obj == only.words.concat());
        let may_be_shared = || self.libraries.is_empty() && is_texture_name(&only.words) && !is_of_other();
        let file = self.file.concat();
        let kind = file.trim_end_matches(|c: char| c.is_ascii_digit());
        let is_of_kind = || {
            let mut words = only.words.iter();
            let has = words.any(|word| word.starts_with(kind) || word.ends_with(kind));
            has && kind.len() >= MIN_WORD_WITHIN && !is_of_other()
        };
        (self.is_alone() || may_be_shared() || is_of_kind()).then(|| only.path.clone())
    }

    /// Libraries of the folder whose names have a word of a part of the OBJ file.
    fn libraries_of(&self, parts: &[String]) -> Vec<PathBuf> {
        let words = parts.iter().flat_map(|part| words_of(part));
        let words = words.map(|word| word.trim_end_matches(|c: char| c.is_ascii_digit()).to_string());
        let words: HashSet<String> = words
            .filter(|word| word.len() >= MIN_NAME && !is_generic_word(word))
            .collect();
        let is_of = |library: &&PathBuf| words_of(&stem_of(library)).iter().any(|word| words.contains(word));
        let own = self.libraries.iter().filter(is_of);
        own.map(|library| self.here.join(library)).collect()
    }

    /// Returns true if the sides of a picture are powers of two.
    fn is_square_power(&self, image: &Image) -> bool {
        let size = texture_size(&self.here.join(&image.path));
        size.is_some_and(|(width, height)| width.is_power_of_two() && height.is_power_of_two())
    }

    /// Returns true if `set`, the name of a set of textures, is like the name of the OBJ file: one
    /// name begins with the other. Names of other OBJ files of the folder have priority.
    pub fn is_like_file(&self, set: &[String]) -> bool {
        let (name, file) = (set.concat(), self.file.concat());
        let is_of_other = || self.objs.iter().any(|obj| *obj == name && *obj != file);
        are_alike(set, &self.file) && !self.is_of_longer(&name, &file) && !is_of_other()
    }

    /// Returns true if `set`, the name of a set of textures, is like the name of the folder of the
    /// OBJ file, or of the folder above it.
    pub fn is_like_folder(&self, set: &[String]) -> bool {
        let folder = if self.here.as_os_str().is_empty() {
            Path::new(".")
        } else {
            &self.here
        };
        let folder = folder.canonicalize().unwrap_or_default();
        let mut names = folder.ancestors().take(2).map(|folder| words_of(&name_of(folder)));
        names.any(|name| !is_generic(&name) && are_alike(set, &name))
    }

    /// Returns true if the name of a picture begins with `file`, the name of the OBJ file, and not
    /// with a longer name of another OBJ file. The other words can be any words if
    /// `has_any_words`, else they must be texture words.
    fn begins_with_file(&self, image: &Image, file: &str, has_any_words: bool) -> bool {
        let name = image.words.concat();
        let Some(rest) = name.strip_prefix(file) else {
            return false;
        };
        let others = words_after(&image.words, file.len());
        let is_texture = |word: &str| {
            let word = word.trim_end_matches(|c: char| c.is_ascii_digit());
            word.is_empty() || TEXTURE_WORDS.contains(&word)
        };
        let are_right = others.is_some_and(|others| has_any_words || others.iter().all(|word| is_texture(word)));
        (are_right || is_texture(rest)) && !self.is_of_longer(&name, file)
    }

    /// Returns true if `name`, the name of a picture, begins with the name of an OBJ file in the
    /// folder that is longer than `file`.
    fn is_of_longer(&self, name: &str, file: &str) -> bool {
        let mut objs = self.objs.iter();
        objs.any(|obj| obj.len() > file.len() && name.starts_with(obj.as_str()))
    }

    /// Returns true if the name of a picture begins with the first word of the OBJ file's name, and
    /// all its other words are texture words.
    fn shares_first_word(&self, image: &Image) -> bool {
        let [first, others @ ..] = without_sizes(&image.words) else {
            return false;
        };
        let is_first = first.len() >= MIN_NAME && self.file.first() == Some(first);
        let name = image.words.concat();
        is_first
            && !others.is_empty()
            && others.iter().all(|word| TEXTURE_WORDS.contains(&word.as_str()))
            && !self.is_of_longer(&name, first)
            && !self.objs.iter().any(|obj| obj == first)
    }

    /// Names of pictures that material libraries of the folder use. Libraries in `own`, and the
    /// library with the name of the OBJ file, are not read.
    pub fn claimed(&self, own: &[&Path]) -> HashSet<String> {
        let file = self.file.concat();
        let mut claimed = HashSet::new();
        for library in self.libraries.iter().take(MAX_LIBRARIES) {
            let path = self.here.join(library);
            if own.contains(&path.as_path()) || words_of(&stem_of(library)).concat() == file {
                continue;
            }
            let mut text = Vec::new();
            let read = File::open(path).and_then(|file| file.take(MAX_LIBRARY_BYTES).read_to_end(&mut text));
            if read.is_err() {
                continue;
            }
            for line in String::from_utf8_lossy(&text).lines() {
                let line = line.trim();
                let is_map = line.split_whitespace().next().is_some_and(|word| {
                    let word = word.to_lowercase();
                    word.starts_with("map_") || matches!(&*word, "bump" | "norm" | "disp" | "refl" | "decal")
                });
                let name = line.rsplit(['/', '\\', ' ', '\t']).next();
                if let Some(name) = name.filter(|_| is_map).map(str::to_lowercase) {
                    if !has_extension(&name) {
                        claimed.extend(with_extensions(&name));
                    }
                    claimed.insert(name);
                }
            }
        }
        claimed
    }

    /// The only picture in the folder, if the folder has only one OBJ file, and if the picture is
    /// not in `claimed`, the names of pictures that libraries use.
    pub fn only_here(&self, claimed: &HashSet<String>) -> Option<PathBuf> {
        let mut here = self.images.iter().filter(|image| image.is_here && !image.is_other());
        let only = here.next().filter(|_| here.next().is_none() && self.is_alone())?;
        let is_free = !is_claimed(claimed, &only.path) && !self.is_rendering(only);
        is_free.then(|| self.here.join(&only.path))
    }

    /// Pictures that a user may want for the file, and the number of further pictures. Pictures
    /// that share a word with the file come first. Pictures of other models are left out: pictures
    /// that libraries other than `own` name, and pictures with the name of another OBJ file.
    /// `rejected` is a picture of another name that is listed, too.
    pub fn offers(&self, own: &[&Path], rejected: Option<&Path>) -> (Vec<PathBuf>, usize) {
        const SHOWN: usize = 3;
        let claimed = self.claimed(own);
        let shares = |image: &Image| {
            let mut words = image.words.iter().filter(|word| word.len() >= MIN_NAME);
            words.any(|word| self.file.contains(word))
        };
        let is_of_other = |image: &Image| {
            let name = image.words.concat();
            self.objs.contains(&name) && name != self.file.concat()
        };
        let mut offered: Vec<&Image> = self.images.iter().collect();
        offered.retain(|image| {
            let is_near = image.is_here || shares(image) || rejected == Some(&*image.path);
            is_near && !image.is_other() && !is_claimed(&claimed, &image.path) && !is_of_other(image)
        });
        offered.sort_by_key(|image| (!shares(image), rejected != Some(&*image.path), !image.is_here));
        let count = offered.len();
        let own = offered.into_iter().filter(|image| !self.is_rendering(image));
        let shown: Vec<PathBuf> = own.take(SHOWN).map(|image| self.here.join(&image.path)).collect();
        let more = if shown.len() == SHOWN { count - SHOWN } else { 0 };
        (shown, more)
    }
}

/// Returns true if libraries of other models name the picture: `claimed` has its name.
pub(super) fn is_claimed(claimed: &HashSet<String>, picture: &Path) -> bool {
    claimed.contains(&name_of(picture))
}

/// Returns true if pictures with the word in their names are not colour textures of a model.
fn is_other_word(word: &str) -> bool {
    OTHER_WORDS.contains(&word)
}

/// Returns true if a word, without numbers at its end, names no model.
fn is_generic_word(word: &str) -> bool {
    let digits = |c: char| c.is_ascii_digit();
    let word = word.trim_end_matches(digits);
    let word = word.strip_suffix("sg").unwrap_or(word).trim_end_matches(digits);
    word.len() < 2 || GENERIC_WORDS.contains(&word) || TEXTURE_WORDS.contains(&word)
}

/// Returns true if a name has no word that names a model, as in `texture` and `material_0`.
pub(super) fn is_generic(words: &[String]) -> bool {
    words.iter().all(|word| is_generic_word(word))
}

/// The words after the first `length` bytes of the words; `None` if a word does not end there.
fn words_after(words: &[String], length: usize) -> Option<&[String]> {
    let mut end = 0;
    let index = words.iter().position(|word| {
        end += word.len();
        end == length
    });
    words.get(index? + 1..)
}

/// Returns true if one name begins with all words of the other. A number at the end of the shorter
/// name does not count if all other words name no model: `building_output` is like `building2`.
pub(super) fn are_alike(a: &[String], b: &[String]) -> bool {
    let is_digit = |c: char| c.is_ascii_digit();
    let begins = |long: &[String], short: &str, is_whole: bool| {
        let long_name = long.concat();
        let Some(rest) = long_name.strip_prefix(short) else {
            return false;
        };
        let others = words_after(long, short.len());
        let ends_word = others.is_some_and(|others| is_whole || is_generic(others));
        short.len() >= MIN_NAME && (ends_word || rest.chars().all(is_digit))
    };
    [(a, b), (b, a)].into_iter().any(|(long, short)| {
        let short = short.concat();
        begins(long, &short, true) || begins(long, short.trim_end_matches(is_digit), false)
    })
}

/// Returns true if the last word of a name, without numbers, is a texture word.
fn is_texture_name(words: &[String]) -> bool {
    let last = without_sizes(words).last();
    last.is_some_and(|word| TEXTURE_WORDS.contains(&word.trim_end_matches(|c: char| c.is_ascii_digit())))
}

/// Text that lists pictures, and a flag that makes the first picture the colour of `material`.
/// `None` if there are no pictures.
pub(super) fn offer_in_words(material: &str, (shown, more): (Vec<PathBuf>, usize)) -> Option<(String, String)> {
    let first = shown.first()?.display().to_string();
    let names: Vec<String> = shown.iter().map(|path| name_of_shown(path)).collect();
    let more = match more {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    let flag = format!("--material '{material}.diffuse_map={first}'");
    Some((names.join(", ") + &more, flag))
}

/// Name of a file for messages.
fn name_of_shown(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Name of a file or folder, in lower case.
fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Returns true if a name has a file extension of a picture.
pub(super) fn has_extension(name: &str) -> bool {
    let extension = Path::new(name).extension().and_then(|e| e.to_str());
    extension.is_some_and(|extension| EXTENSIONS.contains(&&*extension.to_lowercase()))
}

/// `name` with each file extension of pictures.
pub(super) fn with_extensions(name: &str) -> Vec<String> {
    EXTENSIONS
        .iter()
        .map(|extension| format!("{name}.{extension}"))
        .collect()
}

/// Words of a name in lower case. Separators divide words, and so does a change from a lower-case
/// to an upper-case letter.
pub(super) fn words_of(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut before = ' ';
    for c in name.chars() {
        if c.is_alphanumeric() {
            let begins = !before.is_alphanumeric() || before.is_lowercase() && c.is_uppercase();
            if begins {
                words.push(String::new());
            }
            if let Some(word) = words.last_mut() {
                word.extend(c.to_lowercase());
            }
        }
        before = c;
    }
    words
}

/// Returns true if a word describes the size or the format of a picture, such as `2k`, `1001` or
/// `jpg`.
fn is_about_size(word: &str) -> bool {
    let digits = word.strip_suffix('k').unwrap_or(word);
    (!digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit())) || matches!(word, "jpg" | "png" | "exr")
}

/// The words, except words for size or format at their end.
pub(super) fn without_sizes(words: &[String]) -> &[String] {
    let end = words.iter().rposition(|word| !is_about_size(word));
    &words[..end.map_or(0, |end| end + 1)]
}

/// Name of a file without its extension.
pub(super) fn stem_of(path: &Path) -> Cow<'_, str> {
    path.file_stem().unwrap_or_default().to_string_lossy()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_alike_if_one_begins_with_the_other() {
        let alike = |a: &str, b: &str| are_alike(&words_of(a), &words_of(b));
        for (a, b) in [
            ("chair", "Chair_lowpoly"),
            ("car_red", "CarRed"),
            ("rock", "rock3"),
            ("rock3_big", "rock3"),
            ("building_Output", "building 1"),
        ] {
            assert!(alike(a, b) && alike(b, a), "{a} {b}");
        }
        for (a, b) in [
            ("grassB", "airplane"),
            ("carpet", "car"),
            ("TowelRail", "towel3"),
            ("car_red", "car_blue"),
            ("ab", "ab_c"),
            ("", "car"),
            ("12", "123"),
        ] {
            assert!(!alike(a, b) && !alike(b, a), "{a} {b}");
        }
    }

    #[test]
    fn names_of_programs_are_generic() {
        for name in [
            "",
            "Material_0",
            "lambert2SG",
            "initialShadingGroup",
            "texture",
            "(null)",
            "model 1",
        ] {
            assert!(is_generic(&words_of(name)), "{name}");
        }
        for name in ["shaker_sugar", "Material_fox", "sgt", "wood"] {
            assert!(!is_generic(&words_of(name)), "{name}");
        }
    }

    #[test]
    fn words_end_where_a_name_ends() {
        let words = words_of("CarRed_skin");
        assert_eq!(words_after(&words, 6), Some(&["skin".to_string()][..]));
        assert_eq!(words_after(&words, 10), Some(&[][..]));
        assert_eq!(words_after(&words, 4), None);
    }
}
