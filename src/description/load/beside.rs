//! Search for pictures near an OBJ file: in its folder, in texture folders within or beside this
//! folder, and in folders within those texture folders that have the name of the OBJ file.

use crate::description::find_texture::is_texture_folder;
use crate::description::texture::texture_size;
use std::borrow::Cow;
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
/// Words that show that a picture is not a colour texture: words for views of a model, or for
/// textures of other properties.
const OTHER_WORDS: [&str; 27] = [
    "beauty",
    "bump",
    "curvature",
    "env",
    "cover",
    "icon",
    "image",
    "img",
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
/// Maximum number of pictures in a folder in which the only texture is searched.
const MAX_HERE: usize = 64;
/// Minimum length of an OBJ file's name, or of the first word of this name, to match pictures by
/// it.
const MIN_NAME: usize = 3;

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
        self.words.iter().any(|word| OTHER_WORDS.contains(&word.as_str()))
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

    /// The picture that is the colour texture of all materials of an OBJ file without a material
    /// library. `may_be` returns true for possible colour textures. The rules below are tried in
    /// order. The first rule that any picture fulfils decides: if exactly one picture fulfils this
    /// rule, the picture is returned, else `None`.
    ///
    /// 1. The picture has the name of the OBJ file.
    /// 2. The name of the picture begins with the name of the OBJ file, and not with a longer name
    ///    of another OBJ file in the folder. If pictures differ only by a number, the first of them
    ///    is taken.
    /// 3. The first word of the picture's name is the first word of the OBJ file's name, and its
    ///    other words are texture words: `cup_tex` for `cup_small`.
    /// 4. The picture is the only picture in the folder, and its width and height are powers of
    ///    two. In addition, either the folder has no other OBJ file, or it has no library and the
    ///    picture's name has a texture word.
    pub fn picture_of_file(&self, may_be: impl Fn(&Image) -> bool) -> Option<PathBuf> {
        let file = self.file.concat();
        let found = |rule: &dyn Fn(&Image) -> bool| -> Vec<&Image> {
            let images = self.images.iter().filter(|image| rule(image));
            images.filter(|image| !self.is_rendering(image)).collect()
        };
        match found(&|image| image.words.concat() == file).as_slice() {
            [] => {}
            [one] => return Some(one.path.clone()),
            _ => return None,
        }
        let claimed = self.claimed(&[]);
        let is_candidate =
            |image: &Image| may_be(image) && !image.is_other() && !claimed.contains(&*name_of(&image.path));
        let begins = |image: &Image| file.len() >= MIN_NAME && self.begins_with_file(image, &file);
        let shares = |image: &Image| self.shares_first_word(image);
        let rules: [&dyn Fn(&Image) -> bool; 2] = [&begins, &shares];
        for rule in rules {
            let found = found(&|image| is_candidate(image) && rule(image));
            let families: BTreeSet<String> = found.iter().map(|image| image.family()).collect();
            if let Some(first) = found.first() {
                return (families.len() == 1).then(|| first.path.clone());
            }
        }
        if self.images.iter().filter(|image| image.is_here).count() > MAX_HERE {
            return None;
        }
        let here = found(&|image| image.is_here);
        let &[only] = here.as_slice() else { return None };
        let has_word = || is_texture_name(&only.words);
        let is_of_other = || self.objs.iter().any(|obj| *obj == only.words.concat());
        let may_be_shared = || self.libraries.is_empty() && has_word() && !is_of_other();
        let is_texture = || {
            let size = texture_size(&self.here.join(&only.path));
            size.is_some_and(|(width, height)| width.is_power_of_two() && height.is_power_of_two())
        };
        (is_candidate(only) && (self.is_alone() || may_be_shared()) && is_texture()).then(|| only.path.clone())
    }

    /// Returns true if the name of a picture begins with `file`, the name of the OBJ file, and does
    /// not begin with a longer name of another OBJ file.
    fn begins_with_file(&self, image: &Image, file: &str) -> bool {
        let name = image.words.concat();
        let Some(rest) = name.strip_prefix(file) else {
            return false;
        };
        let mut length = 0;
        let ends_word = image.words.iter().any(|word| {
            length += word.len();
            length == file.len()
        });
        let rest = rest.trim_end_matches(|c: char| c.is_ascii_digit());
        let is_word = rest.is_empty() || TEXTURE_WORDS.contains(&rest);
        (ends_word || is_word) && !self.is_of_longer(&name, file)
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
        let is_free = !claimed.contains(&name_of(&only.path)) && !self.is_rendering(only);
        is_free.then(|| self.here.join(&only.path))
    }

    /// Pictures that a user may want to use as textures of the OBJ file, and the number of further
    /// pictures. Pictures whose names share a word with the OBJ file come first. Pictures of other
    /// models are left out: pictures that libraries other than `own` name, and pictures with the
    /// name of another OBJ file.
    pub fn offers(&self, own: &[&Path]) -> (Vec<PathBuf>, usize) {
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
            let is_near = image.is_here || shares(image);
            is_near && !image.is_other() && !claimed.contains(&*name_of(&image.path)) && !is_of_other(image)
        });
        offered.sort_by_key(|image| (!shares(image), !image.is_here));
        let count = offered.len();
        let own = offered.into_iter().filter(|image| !self.is_rendering(image));
        let shown: Vec<PathBuf> = own.take(SHOWN).map(|image| self.here.join(&image.path)).collect();
        let more = if shown.len() == SHOWN { count - SHOWN } else { 0 };
        (shown, more)
    }
}

/// Returns true if the last word of a name, except numbers, is a texture word.
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
