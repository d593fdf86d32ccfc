//! Parts of an OBJ file, which have the names of its statements `o` and `g`. Flags and keys hide
//! parts, show only some parts, change their materials, or move them.

use crate::support::program::*;
use crate::support::{matte, read_channel};
use std::fs;
use tempfile::TempDir;

/// Four squares in a row: an object of one group, an object of two groups with two names, and faces
/// of that object without a group.
const PARTS: [(&str, &str); 4] = [
    ("o Chair.001\ng seat\n", "f 1 2 3 4\n"),
    ("o Table\ng top wood\n", "f 2 5 6 3\n"),
    ("g leg wood\n", "f 5 7 8 6\n"),
    ("g\n", "f 7 9 10 8\n"),
];
const VERTICES: &str =
    "v -4 -1 0\nv -2 -1 0\nv -2 1 0\nv -4 1 0\nv 0 -1 0\nv 0 1 0\nv 2 -1 0\nv 2 1 0\nv 4 -1 0\nv 4 1 0\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [0, 0, 8]\nlook_at = [0, 0, 0]\n\
    [image]\nwidth = 32\nheight = 8\n[render]\nsamples = 2\n[[object]]\nobj = \"a.obj\"\n\
    [[light]]\ntype = \"constant\"\nradiance = 0.5\n[[light]]\ntype = \"point\"\nposition = [0, 2, 3]\nintensity = 20\n";

/// A folder whose OBJ file has the faces of the `shown` parts, and the names of all parts.
fn scene(shown: [bool; 4]) -> TempDir {
    let parts = PARTS.iter().zip(shown);
    let parts: String = parts
        .map(|((names, faces), is_shown)| format!("{names}{}", if is_shown { faces } else { "" }))
        .collect();
    folder(&[("a.obj", &format!("{VERTICES}{parts}")), ("s.toml", SCENE)])
}

fn picture(folder: &TempDir, flags: &str) -> Vec<u8> {
    let flags = split(flags);
    done(
        folder.path(),
        &joined(&["render", "s.toml", "-q", "-o", "t.exr"], &flags),
    );
    done(
        folder.path(),
        &joined(&["render", "s.toml", "-q", "-o", "t.png"], &flags),
    );
    fs::read(folder.path().join("t.png")).unwrap()
}

#[test]
fn hiding_a_part_equals_deleting_its_faces() {
    let whole = scene([true; 4]);
    for (flags, shown) in [
        ("--hide Chair.001", [false, true, true, true]),
        ("--hide Chair*", [false, true, true, true]),
        ("--hide seat --hide top", [false, false, true, true]),
        ("--hide wood", [true, false, false, true]),
        ("--only Table", [false, true, true, true]),
        ("--only Table --hide leg", [false, true, false, true]),
        ("--only seat --only leg", [true, false, true, false]),
        ("--hide top?wood", [true, false, true, true]),
    ] {
        let deleted = scene(shown);
        assert!(picture(&whole, flags) == picture(&deleted, ""), "{flags}");
        assert_same_bits(&whole.path().join("t.exr"), &deleted.path().join("t.exr"));
    }
}

#[test]
fn dumped_scene_files_keep_hidden_parts() {
    let folder = scene([true; 4]);
    let expected = picture(&folder, "--hide wood --hide seat");
    assert!(picture(&folder, "--set render.hide=wood --hide seat") == expected);
    let with_keys = SCENE.replace("samples = 2", "samples = 2\nhide = [\"wood\", \"seat\"]");
    fs::write(folder.path().join("s.toml"), with_keys).unwrap();
    assert!(picture(&folder, "--dump-scene d.toml") == expected);
    fs::copy(folder.path().join("d.toml"), folder.path().join("s.toml")).unwrap();
    assert!(picture(&folder, "") == expected);
}

#[test]
fn patterns_without_a_part_are_errors() {
    let folder = scene([true; 4]);
    let error = |flags: &str| {
        refused(
            folder.path(),
            &joined(&["render", "s.toml", "-o", "t.png"], &split(flags)),
            1,
        )
    };
    let words = error("--hide Chiar.001");
    assert!(
        words.contains("no part of the scene has the name `Chiar.001`"),
        "{words}"
    );
    assert!(words.contains("did you mean `Chair.001`?"), "{words}");
    let words = error("--only * --hide *");
    assert!(words.contains("all parts of the scene are hidden"), "{words}");
    assert!(words.contains("`Table`"), "{words}");
    let args = split("render s.toml -o t.png --hide wood --obj-reader tobj");
    let words = refused(folder.path(), &args, 2);
    assert!(words.contains("--obj-reader own"), "{words}");
    let words = refused(folder.path(), &split("render s.toml -o t.png --set render.hide=3"), 2);
    assert!(words.contains("hide is not the name of a part"), "{words}");
}

/// Scene of the squares; each part is an object with its own file.
fn split_scene() -> TempDir {
    let names = ["Chair.001/seat", "Table/top wood", "Table/leg wood", "Table"];
    let objects: String = (0..4)
        .map(|i| format!("[[object]]\nname = \"{}\"\nobj = \"{i}.obj\"\n", names[i]))
        .collect();
    let text = SCENE.replace("[[object]]\nobj = \"a.obj\"\n", &objects);
    let files: Vec<(String, String)> = (0..4)
        .map(|i| (format!("{i}.obj"), format!("{VERTICES}{}", PARTS[i].1)))
        .collect();
    let mut all: Vec<(&str, &str)> = files.iter().map(|(name, text)| (&**name, &**text)).collect();
    all.push(("s.toml", &text));
    folder(&all)
}

#[test]
fn split_objects_have_the_bits_of_one_file() {
    let (whole, split_up) = (scene([true; 4]), split_scene());
    for folder in [&whole, &split_up] {
        done(
            folder.path(),
            &split("render s.toml -q --spp 16 --aov cryptomatte,id -o t.exr"),
        );
    }
    let [whole, split_up] = [&whole, &split_up].map(|folder| folder.path().join("t.exr"));
    let bits = |path: &std::path::Path, channel: &str| -> Vec<u32> {
        read_channel(path, channel)
            .iter()
            .map(|value| value.to_bits())
            .collect()
    };
    for channel in ["R", "G", "B", "N.X", "albedo.G", "Z"] {
        assert_eq!(bits(&whole, channel), bits(&split_up, channel), "{channel}");
    }
    for suffix in ["00.R", "00.G", "00.B", "00.A", "01.R", "01.G", "01.B", "01.A"] {
        let (part, object) = (format!("CryptoPart{suffix}"), format!("CryptoObject{suffix}"));
        assert_eq!(bits(&whole, &part), bits(&split_up, &object), "{part}");
    }
}

#[test]
fn part_mattes_and_background_sum_to_one() {
    let folder = scene([true; 4]);
    let args = "render s.toml -q --spp 64 --background transparent --aov cryptomatte,id -o t.exr --set";
    done(folder.path(), &joined(&split(args), &["camera.position=[1, 3, 6]"]));
    let path = folder.path().join("t.exr");
    let names = ["Chair.001/seat", "Table/top wood", "Table/leg wood", "Table"];
    let mattes = names.map(|name| matte(&path, "CryptoPart", name));
    let alpha = read_channel(&path, "A");
    for i in 0..alpha.len() {
        let sum: f32 = mattes.iter().map(|matte| matte[i]).sum();
        assert!((sum - alpha[i]).abs() < 1e-6, "{sum}, alpha {}", alpha[i]);
    }
    // Each part is visible, and so is the background.
    for (matte, name) in mattes.iter().zip(names) {
        assert!(matte.iter().sum::<f32>() > 1.0, "{name}");
    }
    assert!(alpha.contains(&0.0));
    // The only object has the number 1; parts have the next numbers.
    let ids = read_channel(&path, "id.part");
    let mut seen: Vec<u32> = ids.iter().map(|id| *id as u32).collect();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen, [0, 2, 3, 4, 5]);
    assert!(read_channel(&path, "id.object").iter().all(|id| *id <= 1.0));
}

/// A `[part]` rule with a material gives the same image as a file whose faces have that material.
#[test]
fn part_rules_set_materials() {
    let library = "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl red\nKd 0.8 0.1 0.1\nnewmtl shiny\nKd 0.5 0.5 0.5\nKs 0.4 0.4 0.4\nNs 50\n";
    let with = |materials: [&str; 4], more: &str| {
        let parts: String = PARTS
            .iter()
            .zip(materials)
            .map(|((names, faces), material)| format!("{names}usemtl {material}\n{faces}"))
            .collect();
        let obj = format!("mtllib a.mtl\n{VERTICES}{parts}");
        folder(&[
            ("a.obj", &obj),
            ("a.mtl", library),
            ("s.toml", &format!("{SCENE}{more}")),
        ])
    };
    let grey = || with(["grey"; 4], "");
    let shiny = "specular=[0.4,0.4,0.4]";
    let cases = [
        (
            "--part seat.material=red",
            "[part.seat]\nmaterial = \"red\"\n",
            ["red", "grey", "grey", "grey"],
        ),
        (
            "--part Table.material=red --part top.material=grey",
            "[part.Table]\nmaterial = \"red\"\n[part.top]\nmaterial = \"grey\"\n",
            ["grey", "grey", "red", "red"],
        ),
        (
            "--part *wood.specular=0.4 --part *wood.exponent=50",
            "[part.\"*wood\"]\nspecular = 0.4\nexponent = 50.0\n",
            ["grey", "shiny", "shiny", "grey"],
        ),
    ];
    for (flags, sections, materials) in cases {
        let expected = picture(&with(materials, ""), "");
        assert!(picture(&grey(), "") != expected, "{flags} {shiny}");
        assert!(picture(&grey(), flags) == expected, "{flags}");
        assert!(picture(&with(["grey"; 4], sections), "") == expected, "{sections}");
        // A dumped scene file has the flags as sections.
        let folder = grey();
        picture(&folder, &format!("{flags} --dump-scene d.toml"));
        fs::copy(folder.path().join("d.toml"), folder.path().join("s.toml")).unwrap();
        assert!(picture(&folder, "") == expected, "{flags}, dumped");
    }
}

#[test]
fn parts_are_hidden_by_rules() {
    let whole = scene([true; 4]);
    for (flags, shown) in [
        ("--part Chair*.visible=false", [false, true, true, true]),
        (
            "--part wood.visible=false --part leg.visible=true",
            [true, false, true, true],
        ),
        ("--part Table.visible=true --hide top", [true, false, true, true]),
    ] {
        assert!(picture(&whole, flags) == picture(&scene(shown), ""), "{flags}");
    }
}

/// The image of a moved part is bit-identical to the image of a file with moved vertices.
#[test]
fn moving_a_part_equals_moving_its_vertices() {
    let whole = scene([true; 4]);
    let [chair, top, leg, rest] = PARTS.map(|(names, faces)| (names, faces));
    // The expected file has separate vertices for the table, 0.25 higher and 0.5 nearer.
    let lifted = "v -4 -1 0\nv -2 -1 0\nv -2 1 0\nv -4 1 0\nv 0 -0.75 0.5\nv 0 1.25 0.5\nv 2 -0.75 0.5\nv 2 1.25 0.5\n\
        v 4 -0.75 0.5\nv 4 1.25 0.5\nv -2 -0.75 0.5\nv -2 1.25 0.5\n";
    let lifted = format!(
        "{lifted}{}{}{}f 11 5 6 12\n{}{}{}{}",
        chair.0, chair.1, top.0, leg.0, leg.1, rest.0, rest.1
    );
    // Mirroring a part about its own centre exchanges the corners, and keeps the front.
    let mirrored = format!(
        "{VERTICES}{}f 3 4 1 2\n{}{}{}{}{}{}",
        chair.0, top.0, top.1, leg.0, leg.1, rest.0, rest.1
    );
    for (flags, section, obj) in [
        (
            "--part Table.translate=[0,0.25,0.5]",
            "[part.Table]\ntranslate = [0.0, 0.25, 0.5]\n",
            lifted,
        ),
        (
            "--part Chair*.scale=[-1,1,1]",
            "[part.\"Chair*\"]\nscale = [-1.0, 1.0, 1.0]\n",
            mirrored,
        ),
    ] {
        let by_hand = folder(&[("a.obj", &obj), ("s.toml", SCENE)]);
        let expected = picture(&by_hand, "");
        for backend in ["embree", "brute"] {
            let backend = format!("--backend {backend}");
            let expected = picture(&by_hand, &backend);
            assert!(
                picture(&whole, &format!("{flags} {backend}")) == expected,
                "{flags} {backend}"
            );
            assert_same_bits(&whole.path().join("t.exr"), &by_hand.path().join("t.exr"));
        }
        fs::write(whole.path().join("s.toml"), format!("{SCENE}{section}")).unwrap();
        assert!(picture(&whole, "") == expected, "{section}");
        fs::write(whole.path().join("s.toml"), SCENE).unwrap();
        // A dumped scene file has the flag as a section.
        assert!(picture(&whole, &format!("{flags} --dump-scene d.toml")) == expected);
        let dumped = fs::read_to_string(whole.path().join("d.toml")).unwrap();
        assert!(dumped.contains("[part."), "{dumped}");
    }
}

#[test]
fn wrong_movements_are_errors() {
    let folder = scene([true; 4]);
    for (flag, expected) in [
        ("Chiar.001.translate=[0,1,0]", "did you mean `Chair.001`?"),
        ("seat.scale=0", "`scale` flattens the part"),
        ("seat.scale=[1,0,1]", "`scale` flattens the part"),
        ("seat.rotate=90", "expected a list of 3 values"),
    ] {
        let words = refused(
            folder.path(),
            &joined(&["render", "s.toml", "-o", "t.png", "--part"], &[flag]),
            2,
        );
        assert!(words.contains(expected), "{flag}: {words}");
    }
    // Each key alone is valid, but the sum overflows.
    let flags = "render s.toml --part top.translate=[3e38,0,0] --part top.scale=[9e37,1,1] -o t.png";
    for flags in [flags.to_string(), format!("{flags} --subdivide 1")] {
        let words = run(folder.path(), &split(&flags));
        let words = (code(&words), self::words(&words));
        let expected = "the part `Table/top wood` is moved so far that its coordinates are not finite";
        assert!(words.0 != 0 && words.1.contains(expected), "{words:?}");
    }
}

#[test]
fn wrong_rules_are_errors() {
    let folder = scene([true; 4]);
    let scene = |more: &str| fs::write(folder.path().join("s.toml"), format!("{SCENE}{more}")).unwrap();
    for (more, words) in [
        (
            "[part.Chiar]\nroughness = 0.1\n",
            [
                "s.toml:",
                "no part of the scene has the name `Chiar`",
                "did you mean `Chair.001`?",
            ],
        ),
        (
            "[part.leg]\nmaterial = \"god\"\n[material.gold]\ndiffuse = 1\n",
            ["s.toml:", "there is no material `god`", "`gold`"],
        ),
        (
            "[part.leg]\nrougness = 0.1\n",
            ["s.toml:", "unknown key `rougness`", "`roughness`"],
        ),
        ("[part.leg]\nvisible = 3\n", ["s.toml:", "true or false", ""]),
        ("[part.leg.a]\nvisible = true\n", ["s.toml:", "[part.leg.a]", "quote"]),
        ("[part.leg]\nroughness = 3\n", ["s.toml:", "roughness", ""]),
    ] {
        scene(more);
        let out = run(folder.path(), &split("render s.toml -o t.png"));
        let said = crate::support::program::words(&out);
        assert!(
            code(&out) != 0 && words.iter().all(|words| said.contains(words)),
            "{more}: {said}"
        );
    }
    scene("");
    for (flag, words) in [
        ("Chiar.visible=false", "did you mean `Chair.001`?"),
        ("leg", "--part leg: expected NAME.KEY=VALUE or NAME=PRESET"),
        ("leg.visible=maybe", "true or false"),
    ] {
        let out = run(folder.path(), &["render", "s.toml", "-o", "t.png", "--part", flag]);
        let said = crate::support::program::words(&out);
        assert!(code(&out) != 0 && said.contains(words), "{flag}: {said}");
    }
    done(
        folder.path(),
        &split("render s.toml -q -o t.png --part leg=gold --part Chair.001.roughness=0.2"),
    );
}

#[test]
fn info_lists_parts() {
    let folder = scene([true; 4]);
    let info = json(&run(folder.path(), &split("info s.toml --json")));
    let parts = info["parts"].as_array().unwrap();
    let found: Vec<_> = parts
        .iter()
        .map(|part| {
            (
                part["name"].as_str().unwrap(),
                part["triangles"].as_u64().unwrap(),
                part["area"].as_f64().unwrap(),
            )
        })
        .collect();
    let expected = ["Chair.001/seat", "Table/top wood", "Table/leg wood", "Table"].map(|name| (name, 2, 4.0));
    assert_eq!(found, expected);
    let text = printed(&run(folder.path(), &split("info s.toml")));
    assert!(
        text.contains("Chair.001/seat: 2 triangles, area 4.0, middle "),
        "{text}"
    );
    // The boxes of all parts together are the box of the scene.
    for (end, pick) in [(0, f64::min as fn(f64, f64) -> f64), (1, f64::max)] {
        for axis in 0..3 {
            let of_parts = parts.iter().map(|part| part["bounds"][end][axis].as_f64().unwrap());
            assert_eq!(of_parts.reduce(pick), info["bounds"][end][axis].as_f64());
        }
    }
    // The text of `info` lists only the 100 largest parts.
    let face = |i: usize| format!("v {i} 0 0\nv {i} 1 0\nv {i} 0 1\nv {i} 1 1\ng {i}\nf -4 -3 -2");
    let many: String = (0..130)
        .map(|i| face(i) + if i > 120 { " -1\n" } else { "\n" })
        .collect();
    fs::write(folder.path().join("b.obj"), many).unwrap();
    let text = printed(&run(folder.path(), &split("info b.obj")));
    for (words, is_there) in [
        ("    90: 1 triangle,", true),
        ("    91: 1 triangle,", false),
        ("    121: 2 triangles,", true),
        ("    129: 2 triangles,", true),
        ("and 30 more, none of them with more triangles (--json lists all)", true),
    ] {
        assert_eq!(text.contains(words), is_there, "{words}: {text}");
    }
    assert_eq!(
        json(&run(folder.path(), &split("info b.obj --json")))["parts"]
            .as_array()
            .map(Vec::len),
        Some(130)
    );
    // A file without names has no parts, and only a matte of objects.
    fs::write(folder.path().join("a.obj"), format!("{VERTICES}f 1 2 3 4\nf 2 5 6 3\n")).unwrap();
    assert_eq!(
        json(&run(folder.path(), &split("info s.toml --json")))["parts"],
        serde_json::json!([])
    );
}

/// If an object with a long name has many groups, the name is not stored for each group. The name
/// is cut, with a note.
#[test]
fn long_names_are_cut() {
    let name = "x".repeat(1 << 20);
    let groups: String = (0..20_000)
        .map(|i| format!("g {i}\nv {i} 0 0\nv {i} 1 0\nv {i} 0 1\nf -3 -2 -1\n"))
        .collect();
    let text = format!("o {name}\n{groups}");
    let folder = folder(&[("a.obj", &text), ("s.toml", SCENE)]);
    let info = run(folder.path(), &split("info s.toml --json"));
    let info = json(&info);
    let parts = info["parts"].as_array().unwrap();
    assert_eq!(parts.len(), 20_000);
    let expected = format!("{}/19999", "x".repeat(1000));
    assert_eq!(parts[19_999]["name"], *expected);
    let checked = printed(&run(folder.path(), &split("check a.obj")));
    assert!(
        checked.contains("a.obj:1: warning: 1 name of `o` or `g` is cut to 1000 bytes [long-part-name]"),
        "{checked}"
    );
}
