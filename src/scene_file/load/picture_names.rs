//! Names of pictures: their words, and the words that show whether a picture is the colour texture
//! of a model.

use std::borrow::Cow;
use std::path::Path;

/// File extensions of pictures, the usual formats of textures first.
const EXTENSIONS: [&str; 13] = [
    "png", "jpg", "jpeg", "tga", "tif", "tiff", "webp", "bmp", "exr", "hdr", "dds", "gif", "jfif",
];
/// Words that often appear in names of colour textures.
pub(super) const TEXTURE_WORDS: [&str; 18] = [
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
const OTHER_WORDS: [&str; 36] = [
    "ad",
    "advert",
    "banner",
    "beauty",
    "bump",
    "curvature",
    "env",
    "cover",
    "highlight",
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
    "product",
    "promo",
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
/// Names of things that are seldom a whole model. A picture of leaves is the texture of the leaves
/// of a tree, and not of its trunk.
const PIECE_WORDS: [&str; 14] = [
    "bark", "branch", "branches", "eye", "eyes", "foliage", "glass", "grass", "hair", "leaf", "leaves", "needles",
    "tire", "wheel",
];
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
/// Minimum length of an OBJ file's name, or of the first word of this name, to match pictures by
/// it.
pub(super) const MIN_NAME: usize = 3;

/// Returns true if pictures with the word in their names are not colour textures of a model.
pub(super) fn is_other_word(word: &str) -> bool {
    OTHER_WORDS.contains(&word)
}

/// Returns true if a word, without numbers at its end, names no model.
pub(super) fn is_generic_word(word: &str) -> bool {
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
pub(super) fn words_after(words: &[String], length: usize) -> Option<&[String]> {
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

/// Returns true if `long` has all words of `short` in their order, and `short` has at least two
/// words that name a thing: `mining_boot_left` has the words of `boot_left`.
pub(super) fn has_words_of(long: &[String], short: &[String]) -> bool {
    let mut words = long.iter();
    let telling = short
        .iter()
        .filter(|word| word.len() >= MIN_NAME && !is_generic_word(word));
    telling.count() >= 2 && short.iter().all(|word| words.any(|other| other == word))
}

/// Returns true if the words of a picture's name say that the picture belongs to a piece of the
/// model, and the words of the model's name do not: `wheel` is the texture of `car_wheel`.
pub(super) fn is_piece_name(words: &[String], model: &[String]) -> bool {
    let mut pieces = words.iter().filter(|word| PIECE_WORDS.contains(&&***word));
    pieces.any(|word| !model.contains(word))
}

/// Returns true if the last word of a name, without numbers, is a texture word.
pub(super) fn is_texture_name(words: &[String]) -> bool {
    let last = without_sizes(words).last();
    last.is_some_and(|word| TEXTURE_WORDS.contains(&word.trim_end_matches(|c: char| c.is_ascii_digit())))
}

/// Name of a file or folder, in lower case.
pub(super) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Returns true if a name has a file extension of a picture.
pub(super) fn has_extension(name: &str) -> bool {
    let extension = Path::new(name).extension().and_then(|e| e.to_str());
    extension.is_some_and(|extension| EXTENSIONS.contains(&&*extension.to_lowercase()))
}

/// Position of the file extension of a picture in [`EXTENSIONS`].
pub(super) fn rank_of_extension(path: &Path) -> usize {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
    let rank = EXTENSIONS.iter().position(|known| *known == extension);
    rank.unwrap_or(EXTENSIONS.len())
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
    fn names_have_the_words_of_shorter_names() {
        let has = |long: &str, short: &str| has_words_of(&words_of(long), &words_of(short));
        assert!(has("STC_mining_boot", "STC_Boot") && has("old red car", "OldCar"));
        for (long, short) in [
            ("red_car", "car"),
            ("car_red_old", "old_car"),
            ("material_boot", "material_boot_left"),
            ("mesh_boot_low", "mesh_low"),
        ] {
            assert!(!has(long, short), "{long} {short}");
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
