//! Up axis and front of a model, from the first comments of its OBJ file: axes that the comments
//! declare, and the usual axes of the program that wrote the file.

use super::open_regular;
use crate::guess::{DeclaredAxes, FileAxes, NamedThing};
use crate::io::mtl::{MtlDialect, Signature};
use crate::math::Vec3;
use std::io::Read;
use std::path::Path;

/// Number of bytes that are searched for comments.
const HEAD: u64 = 4096;
/// Programs that usually write models with +y up, as most viewers expect. Programs with an MTL
/// dialect are not listed.
const TURN: [&str; 14] = [
    "sweet home",
    "daz studio",
    "makehuman",
    "jmc2obj",
    "mview obj exporter",
    MAYA,
    "zbrush",
    "art of illusion",
    "magicavoxel",
    "blockbench",
    "kenney",
    "mineways",
    "houdini",
    "probuilder",
];
/// Comment of Maya, which does not name itself.
const MAYA: &str = "units for non-parametric coordinates";
/// Programs of surveyors, scanners and engineers that usually write models with +z up. Programs
/// with an MTL dialect are not listed.
const KEEP: [&str; 10] = [
    "openscad",
    "freecad",
    "ifcconvert",
    "ifcopenshell",
    "cloudcompare",
    "metashape",
    "photoscan",
    "opendronemap",
    "qgis",
    "gdal",
];

/// Programs that always write models with +y up. Sculptris has no other axis: all of 4 public files
/// that name it are upright.
const ONLY_Y: [&str; 2] = ["apple modelio", "sculptris"];
/// Programs that always write models with +z up. Things stand on the work plane of Tinkercad, and
/// all of 6 public files that name it are upright.
const ONLY_Z: [&str; 1] = ["tinkercad"];
/// Text in the names of meshes that were imported from VRML. In VRML, +y is up.
const OF_VRML: &str = "indexedfaceset";
/// Words in file names, by the kind of thing that they name. Words may be in plural.
///
/// 343 public files of 108 repositories, whose upright axis was identified by eye, have these
/// names: 30 files of rooms and land, all wider than high; 14 of tall things, of which 1 is wider
/// than high (a handle of a door); 26 of standing things, none on its wide side; 38 of long things,
/// of which 1 stands on its end (a jellyfish).
const THINGS: [(NamedThing, &[&str]); 6] = [
    (
        NamedThing::Rooms,
        &[
            "apartment",
            "basement",
            "bathroom",
            "bedroom",
            "classroom",
            "corridor",
            "dungeon",
            "floorplan",
            "hall",
            "hallway",
            "hangar",
            "interior",
            "kitchen",
            "lobby",
            "lounge",
            "office",
            "room",
        ],
    ),
    (
        NamedThing::Land,
        &[
            "arena",
            "building",
            "campus",
            "city",
            "floor",
            "garden",
            "ground",
            "house",
            "island",
            "land",
            "landscape",
            "map",
            "park",
            "stadium",
            "street",
            "terrain",
            "town",
        ],
    ),
    (
        NamedThing::Letters,
        &["font", "letter", "logo", "logotype", "text", "title", "wordmark"],
    ),
    (
        NamedThing::Tall,
        &[
            "bottle",
            "boy",
            "child",
            "door",
            "figurine",
            "fridge",
            "girl",
            "guard",
            "human",
            "knight",
            "ladder",
            "lady",
            "lamppost",
            "man",
            "mannequin",
            "person",
            "refrigerator",
            "soldier",
            "statue",
            "streetlamp",
            "tree",
            "warrior",
            "woman",
            "zombie",
        ],
    ),
    (
        NamedThing::Standing,
        &[
            "armoire",
            "armour",
            "bookcase",
            "bookshelf",
            "bust",
            "cabinet",
            "chair",
            "character",
            "cupboard",
            "head",
            "mushroom",
            "people",
            "pillar",
            "portrait",
            "robot",
            "skull",
            "stool",
            "target",
            "tower",
            "vase",
            "wardrobe",
        ],
    ),
    (
        NamedThing::Long,
        &[
            "aeroplane",
            "aircraft",
            "airplane",
            "bed",
            "bench",
            "bicycle",
            "bike",
            "boat",
            "bus",
            "car",
            "cat",
            "couch",
            "cow",
            "desk",
            "dog",
            "dolphin",
            "fish",
            "fox",
            "gun",
            "helicopter",
            "horse",
            "jeep",
            "jet",
            "lion",
            "motorbike",
            "motorcycle",
            "pig",
            "pistol",
            "rifle",
            "shark",
            "sheep",
            "ship",
            "sofa",
            "submarine",
            "tank",
            "tiger",
            "trailer",
            "train",
            "truck",
            "van",
            "vehicle",
            "wagon",
            "whale",
            "wolf",
        ],
    ),
];
/// Minimum length of a word of [`THINGS`] that may be the end of a longer word: `myroom`.
const MIN_END: usize = 4;

/// Programs whose models face −z.
const FACE_BACK: [&str; 1] = ["blockbench"];

/// Axes from the comments at the beginning of a file. There are no axes if the file cannot be read.
pub fn file_axes(path: &Path) -> FileAxes {
    let mut head = Vec::new();
    let file = open_regular(path).map(|file| file.take(HEAD));
    let read = file.and_then(|mut file| file.read_to_end(&mut head).ok());
    let axes = match read {
        Some(_) => axes_of(&String::from_utf8_lossy(&head).to_lowercase()),
        None => FileAxes::default(),
    };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    FileAxes {
        thing: named_thing(&stem),
        ..axes
    }
}

/// Kind of the thing that a file name without its extension names. If the name has several words
/// with a kind, the last one decides: an office chair is a chair.
fn named_thing(stem: &str) -> Option<NamedThing> {
    let mut words: Vec<String> = vec![String::new()];
    let mut was_lower = false;
    for c in stem.chars() {
        if !c.is_alphabetic() || was_lower && c.is_uppercase() {
            words.push(String::new());
        }
        was_lower = c.is_lowercase();
        if let Some(word) = words.last_mut().filter(|_| c.is_alphabetic()) {
            word.extend(c.to_lowercase());
        }
    }
    let kind_of = |word: &str| {
        let singular = word.strip_suffix('s').unwrap_or(word);
        let find = |is: &dyn Fn(&str) -> bool| {
            let mut kinds = THINGS.iter();
            kinds.find_map(|(kind, list)| list.iter().any(|of_kind| is(of_kind)).then_some(*kind))
        };
        let is_end = |of_kind: &str| of_kind.len() >= MIN_END && singular.ends_with(of_kind);
        let kind = find(&|of_kind| of_kind == word || of_kind == singular).or_else(|| find(&is_end));
        match kind {
            // A row or a field of upright things is wider than high
            Some(NamedThing::Tall | NamedThing::Standing) if singular != word => Some(NamedThing::Several),
            _ => kind,
        }
    };
    words.iter().rev().find_map(|word| kind_of(word))
}

/// Axes from the text at the beginning of a file, in lower case.
fn axes_of(head: &str) -> FileAxes {
    let comments = || head.lines().filter_map(|line| line.trim_start().strip_prefix('#'));
    let is_named = |comment: &str, programs: &[&str]| programs.iter().any(|program| comment.contains(program));
    let is_of_vrml = |line: &str| {
        let name = line.strip_prefix("o ").or(line.strip_prefix("g "));
        name.is_some_and(|name| name.contains(OF_VRML))
    };
    let has_only_y = comments().any(|comment| is_named(comment, &ONLY_Y)) || head.lines().any(is_of_vrml);
    let has_only_z = comments().any(|comment| is_named(comment, &ONLY_Z));
    let dialect = Signature::find(head).map(|signature| signature.dialect);
    FileAxes {
        keeps_usual_up: dialect == Some(MtlDialect::Blender),
        only_up: has_only_y.then_some(Vec3::Y).or(has_only_z.then_some(Vec3::Z)),
        declared: comments().find_map(declared_axes),
        usual_up: match dialect {
            Some(MtlDialect::Meshlab | MtlDialect::Threedfier) => Some(Vec3::Z),
            // Assimp keeps the up axis of the file that it converts.
            Some(MtlDialect::Assimp) => None,
            Some(_) => Some(Vec3::Y),
            None => comments().find_map(|comment| match (is_named(comment, &TURN), is_named(comment, &KEEP)) {
                (true, _) => Some(Vec3::Y),
                (false, true) => Some(Vec3::Z),
                (false, false) => None,
            }),
        },
        usual_front: comments()
            .any(|comment| is_named(comment, &FACE_BACK))
            .then_some(Vec3::NEG_Z),
        ..FileAxes::default()
    }
}

/// Axes that a comment such as `CoordSystemRUF: [+X,-Y,+Z]` declares. Each of the three letters is
/// a direction as the viewer sees it: right or left, up or down, forward or back. The axes in
/// brackets belong to the letters, in the same order.
fn declared_axes(comment: &str) -> Option<DeclaredAxes> {
    let (_, declaration) = comment.split_once("coordsystem")?;
    let (letters, axes) = declaration.split_once(':')?;
    let (mut up, mut back) = (None, None);
    let axes = axes.trim().trim_start_matches('[').trim_end_matches(']').split(',');
    for (letter, axis) in letters.trim().chars().zip(axes) {
        let axis = signed_axis(axis.trim())?;
        match letter {
            'u' => up = Some(axis),
            'd' => up = Some(Vec3::ZERO - axis),
            'f' => back = Some(Vec3::ZERO - axis),
            'b' => back = Some(axis),
            _ => {}
        }
    }
    DeclaredAxes::new(up?, back?)
}

/// Unit vector of a text such as `+x` or `-z`.
fn signed_axis(text: &str) -> Option<Vec3> {
    let (sign, name) = match text.strip_prefix('-') {
        Some(name) => (-1.0, name),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let axis = ["x", "y", "z"].iter().position(|axis| *axis == name)?;
    // Adding 0 turns −0 into 0.
    Some(sign * Vec3::AXES[axis] + Vec3::ZERO)
}

/// Name of the program that wrote an OBJ file: the comment in the first line, up to a digit, a
/// quote or a colon. Empty if there is no comment. `None` if the file cannot be read.
pub fn first_comment(path: &Path) -> Option<String> {
    let mut head = Vec::new();
    open_regular(path)?.take(HEAD).read_to_end(&mut head).ok()?;
    let head = String::from_utf8_lossy(&head);
    let line = head.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or("");
    let ends = |c: char| c.is_ascii_digit() || matches!(c, '\'' | '"' | ':');
    let name = line.split(ends).next().unwrap_or("").trim();
    Some(if line.starts_with('#') {
        name.to_lowercase()
    } else {
        String::new()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_axis_follows_from_program_in_comment() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        for (text, expected) in [
            ("# Blender v2.79 (sub 0) OBJ File: 'a'\nv 0 0 0\n", Some(Vec3::Y)),
            ("\n  # OBJ File Generated by MeshLab\n", Some(Vec3::Z)),
            ("# a house\nv 0 0 0\n", None),
            ("v 0 0 0\ng blender\n", None),
            ("", None),
        ] {
            std::fs::write(&path, text).unwrap();
            let axes = file_axes(&path);
            assert_eq!(axes.usual_up, expected, "{text}");
            assert_eq!(axes.keeps_usual_up, text.contains("# Blender"), "{text}");
        }
        assert_eq!(file_axes(&folder.path().join("b.obj")), FileAxes::default());
    }

    #[test]
    fn file_names_name_things() {
        for (name, expected) in [
            ("myRoom2", Some(NamedThing::Rooms)),
            ("livingroom", Some(NamedThing::Rooms)),
            ("mushroom", Some(NamedThing::Standing)),
            ("office_chair", Some(NamedThing::Standing)),
            ("city-map", Some(NamedThing::Land)),
            ("my_text", Some(NamedThing::Letters)),
            ("house_door.001", Some(NamedThing::Tall)),
            ("TwoTrees", Some(NamedThing::Several)),
            ("courtyardStatues", Some(NamedThing::Several)),
            ("carDoor", Some(NamedThing::Tall)),
            ("Bus", Some(NamedThing::Long)),
            ("scar", None),
            ("model", None),
            ("", None),
        ] {
            assert_eq!(named_thing(name), expected, "{name}");
        }
    }

    #[test]
    fn comments_declare_axes() {
        for (text, expected) in [
            (
                "# CoordSystemRUF: [+X,-Y,+Z]\nv 0 0 0\n",
                Some((Vec3::NEG_Y, Vec3::NEG_Z)),
            ),
            ("#\n#CoordSystemRUF: [+X,+Y,-Z]\n", Some((Vec3::Y, Vec3::Z))),
            ("# CoordSystemLBU: X, -y, Z\n", Some((Vec3::Z, Vec3::NEG_Y))),
            ("# CoordSystemRUF: [+X,+Y,+Y]\n", None),
            ("# CoordSystemRUF: [+X,+Y]\n", None),
            ("# CoordSystemRUF: [+X,+Q,+Z]\n", None),
            ("g CoordSystemRUF: [+X,-Y,+Z]\n", None),
        ] {
            let declared = axes_of(&text.to_lowercase()).declared;
            assert_eq!(declared.map(|axes| (axes.up, axes.front)), expected, "{text}");
        }
    }

    #[test]
    fn programs_have_a_usual_front() {
        let front = |text: &str| axes_of(&text.to_lowercase()).usual_front;
        assert_eq!(front("# Made in Blockbench 4.8.1\n"), Some(Vec3::NEG_Z));
        assert_eq!(front("# Blender v2.79\n"), None);
        assert_eq!(front("o blockbench\n"), None);
    }

    #[test]
    fn first_comment_names_the_program() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        for (text, expected) in [
            ("\n# Blender v2.79 (sub 0) OBJ File: 'a'\nv 0 0 0\n", "# blender v"),
            ("# Exported: today\n", "# exported"),
            ("v 0 0 0\n# later\n", ""),
            ("", ""),
        ] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(first_comment(&path).as_deref(), Some(expected), "{text}");
        }
        assert_eq!(first_comment(&folder.path().join("b.obj")), None);
    }
}
