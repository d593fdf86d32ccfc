//! Search for pictures near an OBJ file: in its folder, in texture folders within or beside this
//! folder, and in subfolders of these texture folders. A subfolder must have the name of the OBJ
//! file.

use super::picture_names::{
    MIN_NAME, TEXTURE_WORDS, are_alike, has_extension, has_words_of, is_generic, is_generic_word, is_other_word,
    is_piece_name, is_texture_name, name_of, rank_of_extension, stem_of, with_extensions, without_sizes, words_after,
    words_of,
};
use super::picture_roles::{Role, role_of};
use super::preview::Background;
use crate::geometry::Mesh;
use crate::scene_file::find_file::FileFinder;
use crate::scene_file::find_texture::is_texture_folder;
use crate::scene_file::texture::{is_normal_map, texture_size};
use std::cell::OnceCell;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Maximum number of files that are listed for a folder.
const MAX_FILES: usize = 10_000;
/// Maximum number of material libraries of a folder that are searched for names of textures, and
/// maximum size of each library in bytes.
const MAX_LIBRARIES: usize = 64;
const MAX_LIBRARY_BYTES: u64 = 1 << 20;
/// Prefix of metadata that this program writes into pictures.
const METADATA: &[u8] = b"embrasure.";
/// Number of bytes at the beginning of a picture in which the prefix is searched.
const METADATA_BYTES: u64 = 1 << 16;
/// Texts in names of folders with pictures, other than [`is_texture_folder`].
const FOLDER_WORDS: [&str; 9] = ["bitmap", "gfx", "image", "img", "map", "material", "pic", "skin", "tex"];
/// Maximum number of pictures in a folder in which the only texture is searched for.
const MAX_HERE: usize = 64;
/// Minimum length of a word within the name of a picture to find the picture by the word.
const MIN_WORD_WITHIN: usize = 4;

/// Picture that a rule selects, if it selects exactly one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum PictureMatch {
    /// The rule holds for no picture.
    Nothing,
    /// The rule holds for pictures of several kinds.
    Several,
    /// The rule selects one picture, or pictures of one kind. The path is relative to the folder of
    /// the OBJ file.
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
    /// Cached result of the search in other folders for a picture with the name of the OBJ file.
    distant: OnceCell<PictureMatch>,
    /// Cached background of the picture with the name of the OBJ file.
    background: OnceCell<Option<Background>>,
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
                    _ if has_extension(&name.to_string_lossy()) => found.images.push(Image {
                        path: folder.join(&name),
                        words,
                        is_here,
                    }),
                    _ => {}
                }
            }
        }
        found.leave_one_format();
        found
    }

    /// Leaves one of the pictures in a folder whose names differ only in the extension: a picture
    /// in the usual format of textures, and no picture that this program wrote.
    fn leave_one_format(&mut self) {
        let key = |image: &Image| {
            let stem = stem_of(&image.path).to_lowercase();
            (image.path.parent().map(Path::to_path_buf), stem)
        };
        let mut copies: HashMap<_, Vec<&Image>> = HashMap::new();
        for image in &self.images {
            copies.entry(key(image)).or_default().push(image);
        }
        let best = |copies: &Vec<&Image>| {
            let rank = |image: &&&Image| (self.is_rendering(image), rank_of_extension(&image.path));
            copies.iter().min_by_key(rank).map(|image| image.path.clone())
        };
        let several = copies.values().filter(|copies| copies.len() > 1);
        let left: HashSet<PathBuf> = several.clone().filter_map(best).collect();
        let all: HashSet<PathBuf> = several.flatten().map(|image| image.path.clone()).collect();
        self.images
            .retain(|image| !all.contains(&image.path) || left.contains(&image.path));
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

    /// Returns true if the picture lies in a folder `images` and its sides are not powers of two.
    /// Folders of this name have the pictures of pages and programs, too: previews of models.
    fn may_be_view(&self, image: &Image) -> bool {
        let folder = image.path.parent().map(name_of);
        folder.is_some_and(|folder| folder == "images") && !self.has_power_of_two_sides(image)
    }

    /// Returns true if the picture with the name of the OBJ file shows the model before a
    /// background, and is not the texture of `mesh`.
    pub fn is_preview(&self, picture: &Path, mesh: &Mesh) -> bool {
        let find = || Background::of(&self.here.join(picture));
        let background = self.background.get_or_init(find).as_ref();
        background.is_some_and(|background| background.is_used_by(mesh))
    }

    /// Pictures for which `rule` holds, except pictures that this program wrote.
    fn found(&self, rule: impl Fn(&Image) -> bool) -> Vec<&Image> {
        let images = self.images.iter().filter(|image| rule(image));
        images.filter(|image| !self.is_rendering(image)).collect()
    }

    /// The picture that has the name of the OBJ file, unless it [may be a view](Self::may_be_view).
    /// Its own folder and its texture folders are searched first, then other folders beside the
    /// file and beside its folder.
    pub fn picture_of_name(&self) -> PictureMatch {
        let file = self.file.concat();
        let is_of_name = |image: &Image| image.words.concat() == file && !self.may_be_view(image);
        match self.found(is_of_name).as_slice() {
            [] => self.distant.get_or_init(|| self.distant_picture(&file)).clone(),
            [one] => PictureMatch::One(one.path.clone()),
            _ => PictureMatch::Several,
        }
    }

    /// The only picture with the name `file` in folders of pictures within the OBJ file's folder
    /// and beside this folder. The sides of the picture must be powers of two, because these
    /// folders may also have previews.
    fn distant_picture(&self, file: &str) -> PictureMatch {
        if file.len() < MIN_NAME {
            return PictureMatch::Nothing;
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
        found.retain(|image| self.has_power_of_two_sides(image) && !self.is_rendering(image));
        match found.as_slice() {
            [] => PictureMatch::Nothing,
            [one] => PictureMatch::One(one.path.clone()),
            _ => PictureMatch::Several,
        }
    }

    /// The picture whose name is like the name of the OBJ file. `may_be` returns true for possible
    /// colour textures, and `is_single` is true if the file has one material. The first rule that
    /// any picture fulfils decides. If the pictures of this rule differ in more than a number, the
    /// result is [`PictureMatch::Several`].
    ///
    /// 1. Its name begins with the name of the file, and not with a longer name of another OBJ file
    ///    of the folder. If the file has several materials, the other words are texture words. Of
    ///    pictures that differ by a number, the first is taken.
    /// 2. Its first word is the first word of the file, and its other words are texture words:
    ///    `cup_tex` for `cup_small`.
    pub fn picture_like_name(&self, may_be: impl Fn(&Image) -> bool, is_single: bool) -> PictureMatch {
        let file = self.file.concat();
        let claimed = self.claimed(&[]);
        let is_candidate = |image: &Image| {
            let is_free = may_be(image) && !image.is_other() && !is_claimed(&claimed, &image.path);
            is_free && !self.may_be_view(image)
        };
        let begins = |image: &Image| file.len() >= MIN_NAME && self.begins_with_file(image, &file, is_single);
        let shares = |image: &Image| self.shares_first_word(image);
        let rules: [&dyn Fn(&Image) -> bool; 2] = [&begins, &shares];
        for rule in rules {
            let found = self.found(|image| is_candidate(image) && rule(image));
            let families: BTreeSet<String> = found.iter().map(|image| image.family()).collect();
            if let Some(first) = found.first() {
                return match families.len() {
                    1 => PictureMatch::One(first.path.clone()),
                    _ => PictureMatch::Several,
                };
            }
        }
        PictureMatch::Nothing
    }

    /// The only picture of the folder, if its sides are powers of two and one of these rules holds.
    /// `parts` are names of parts of the OBJ file.
    ///
    /// 1. The folder has no other OBJ file, no library names the picture, and its name is not that
    ///    of another piece of a model, such as leaves.
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
        if !may_be(only) || only.is_other() || !self.has_power_of_two_sides(only) {
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
        let is_of_all = self.is_alone() && !is_piece_name(&only.words, &self.file);
        (is_of_all || may_be_shared() || is_of_kind()).then(|| only.path.clone())
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
    fn has_power_of_two_sides(&self, image: &Image) -> bool {
        let size = texture_size(&self.here.join(&image.path));
        size.is_some_and(|(width, height)| width.is_power_of_two() && height.is_power_of_two())
    }

    /// Returns true if `set`, the name of a set of textures, is like the name of the OBJ file: one
    /// name begins with the other, or one has all words of the other. Names of other OBJ files of
    /// the folder have priority.
    pub fn is_like_file(&self, set: &[String]) -> bool {
        let (name, file) = (set.concat(), self.file.concat());
        let is_of_other = || self.objs.iter().any(|obj| *obj == name && *obj != file);
        let is_like = are_alike(set, &self.file) || has_words_of(set, &self.file) || has_words_of(&self.file, set);
        is_like && !self.is_of_longer(&name, &file) && !is_of_other()
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

    /// The only picture in the folder of the OBJ file, if the folder has only this OBJ file.
    /// `claimed` has names of pictures that material libraries use; such a picture is not returned.
    pub fn only_here(&self, claimed: &HashSet<String>) -> Option<PathBuf> {
        let mut here = self.images.iter().filter(|image| image.is_here && !image.is_other());
        let only = here.next().filter(|_| here.next().is_none() && self.is_alone())?;
        let is_free = !is_claimed(claimed, &only.path) && !self.is_rendering(only);
        is_free.then(|| self.here.join(&only.path))
    }

    /// Pictures to suggest to the user as textures of the file, and the number of further pictures.
    /// Pictures that share a word with the file come first, and pictures of other properties than
    /// colour come last. Pictures of other models are left out: pictures that libraries other than
    /// `own` name, and pictures with the name of another OBJ file. `rejected` is a picture of
    /// another name that is listed, too.
    pub fn offers(&self, own: &[&Path], rejected: Option<&Path>) -> Offers {
        const SHOWN: usize = 3;
        let claimed = self.claimed(own);
        let shares = |image: &Image| shares_word(&image.words, &self.file);
        let is_of_other = |image: &Image| {
            let name = image.words.concat();
            self.objs.contains(&name) && name != self.file.concat()
        };
        let mut offered: Vec<&Image> = self.images.iter().collect();
        offered.retain(|image| {
            let is_near = image.is_here || shares(image) || rejected == Some(&*image.path);
            is_near && !image.is_other() && !is_claimed(&claimed, &image.path) && !is_of_other(image)
        });
        offered.sort_by_key(|image| {
            let is_rejected = rejected == Some(&*image.path);
            (!may_be_color(&image.path), !shares(image), !is_rejected, !image.is_here)
        });
        let count = offered.len();
        let own = offered.into_iter().filter(|image| !self.is_rendering(image));
        let shown: Vec<PathBuf> = own.take(SHOWN).map(|image| self.here.join(&image.path)).collect();
        let more = if shown.len() == SHOWN { count - SHOWN } else { 0 };
        Offers {
            shown,
            more,
            file: self.file.clone(),
        }
    }
}

/// Pictures to suggest to the user as colour textures.
pub(super) struct Offers {
    /// Paths of the first pictures.
    shown: Vec<PathBuf>,
    /// Number of further pictures.
    more: usize,
    /// Words of the name of the OBJ file.
    file: Vec<String>,
}

/// Returns true if the name of a picture does not say that it is a texture of another property
/// than colour.
fn may_be_color(path: &Path) -> bool {
    role_of(&stem_of(path)).is_none_or(|(_, role)| role == Role::Color)
}

/// Returns true if the name of a picture and another name share a word that names a thing.
fn shares_word(picture: &[String], name: &[String]) -> bool {
    let mut words = picture.iter().filter(|word| word.len() >= MIN_NAME);
    words.any(|word| name.contains(word) && !is_generic_word(word))
}

/// Returns true if the name of the picture `path` is like one of the other names: they share a word
/// that names a thing, and the picture has no other such word. `cat_portrait` is not like `cat`.
fn is_like_any(path: &Path, names: [&[String]; 2]) -> bool {
    let words = words_of(&stem_of(path));
    let set = role_of(&stem_of(path)).map_or(words, |(set, _)| set);
    let is_known = |word: &String| is_generic_word(word) || names.iter().any(|name| name.contains(word));
    names.iter().any(|name| shares_word(&set, name)) && without_sizes(&set).iter().all(is_known)
}

/// Returns true if libraries of other models name the picture: `claimed` has its name.
pub(super) fn is_claimed(claimed: &HashSet<String>, picture: &Path) -> bool {
    claimed.contains(&name_of(picture))
}

/// Text that lists pictures, and advice with a flag that makes a picture the colour of `material`:
/// the first picture whose name is like the name of the OBJ file or of the material, if it is no
/// normal map. `None` if there are no pictures.
pub(super) fn offer_in_words(material: &str, offers: Offers) -> Option<(String, String)> {
    let Offers { shown, more, file } = offers;
    let names: Vec<String> = shown.iter().map(|path| name_of_shown(path)).collect();
    let (one, more) = match (names.len(), more) {
        (0, _) => return None,
        (1, 0) => ("it", String::new()),
        (_, 0) => ("one of them", String::new()),
        (_, n) => ("one of them", format!(" and {n} more")),
    };
    let words = words_of(material);
    let is_like = |path: &&PathBuf| is_like_any(path, [&file, &words]) && may_be_color(path);
    let proposed = shown.iter().find(is_like).filter(|path| !is_normal_map(path));
    let advice = match proposed {
        Some(path) => {
            let flag = format!("--material '{material}.diffuse_map={}'", path.display());
            format!("to use {}, add {flag}", name_of_shown(path))
        }
        None => format!("if {one} is the texture, add --material '{material}.diffuse_map=FILE'"),
    };
    Some((names.join(", ") + &more, advice))
}

/// Name of a file for messages.
fn name_of_shown(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
