//! Cameras inside: detection of interiors, `--view inside`, `--stand`, the plan of `views`, and
//! warnings about cameras behind walls.

use super::guess::{Boxes, camera, room, turned, vector};
use crate::support::program::{done, folder, json, printed, refused, split, words};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A house of thick walls with two rooms, a door, windows and furniture.
fn house() -> Boxes {
    Boxes::default()
        .add([-5.0, 0.0, -4.0], [5.0, 0.2, 4.0])
        .add([-5.0, 0.2, -4.0], [5.0, 2.9, -3.75])
        .add([-5.0, 0.2, 3.75], [-3.5, 2.9, 4.0])
        .add([-3.5, 0.2, 3.75], [-1.5, 1.1, 4.0])
        .add([-3.5, 2.2, 3.75], [-1.5, 2.9, 4.0])
        .add([-1.5, 0.2, 3.75], [1.0, 2.9, 4.0])
        .add([1.0, 2.3, 3.75], [2.0, 2.9, 4.0])
        .add([2.0, 0.2, 3.75], [5.0, 2.9, 4.0])
        .add([-5.0, 0.2, -3.75], [-4.75, 2.9, 3.75])
        .add([4.75, 0.2, -3.75], [5.0, 2.9, 3.75])
        .add([0.0, 0.2, -3.75], [0.15, 2.9, 1.0])
        .add([0.0, 2.2, 1.0], [0.15, 2.9, 2.0])
        .add([0.0, 0.2, 2.0], [0.15, 2.9, 3.75])
        .add([-5.3, 2.9, -4.3], [5.3, 3.1, 4.3])
        .add([-3.2, 0.9, -0.4], [-1.8, 0.95, 0.4])
}

/// A room without furniture, with thick walls and a window.
fn plain_room() -> String {
    Boxes::default()
        .add([-2.2, -0.2, -3.2], [2.2, 0.0, 3.2])
        .add([-2.2, 2.6, -3.2], [2.2, 2.8, 3.2])
        .add([-2.2, 0.0, -3.2], [-2.0, 2.6, 3.2])
        .add([2.0, 0.0, -3.2], [2.2, 2.6, 3.2])
        .add([-2.0, 0.0, -3.2], [2.0, 2.6, -3.0])
        .add([-2.0, 0.0, 3.0], [-0.6, 2.6, 3.2])
        .add([0.6, 0.0, 3.0], [2.0, 2.6, 3.2])
        .add([-0.6, 0.0, 3.0], [0.6, 0.9, 3.2])
        .add([-0.6, 2.0, 3.0], [0.6, 2.6, 3.2])
        .text
}

/// A plain room with thick walls looks alike from inside and from outside. It is an interior if
/// the file has the name of rooms.
#[test]
fn plain_rooms_with_a_name_are_interiors() {
    for (name, is_interior) in [("room.obj", true), ("crate.obj", false)] {
        let folder = folder(&[(name, &plain_room())]);
        let camera = camera(folder.path(), name);
        let words = camera["guess"].as_str().unwrap();
        assert_eq!(words.starts_with("an interior"), is_interior, "{name}: {words}");
    }
}

/// A table: two corners in the plane of the floor, and its height.
type Table = ([f32; 2], [f32; 2], f32);

/// The camera of an interior has free floor before it: no table covers the lower half of the image.
#[test]
fn cameras_inside_do_not_look_over_a_table() {
    let rooms: [[Table; 3]; 2] = [
        [
            ([-0.7, 1.1], [1.0, 2.8], 0.9),
            ([-1.7, -2.1], [-0.7, -0.5], 1.0),
            ([0.5, 1.3], [2.2, 2.7], 0.8),
        ],
        [
            ([-0.6, -1.8], [0.8, -0.9], 1.0),
            ([-2.1, -1.7], [-0.7, -0.1], 0.8),
            ([0.9, 0.0], [2.3, 1.5], 0.9),
        ],
    ];
    for tables in rooms {
        let mut room = Boxes::default().room([-2.5, 0.0, -3.5], [2.5, 2.7, 3.5], &[]);
        for ([x0, z0], [x1, z1], height) in tables {
            room = room.add([x0, 0.0, z0], [x1, height, z1]);
        }
        let folder = folder(&[("room.obj", &room.text)]);
        let camera = camera(folder.path(), "room.obj");
        let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
        let way = [target[0] - eye[0], target[2] - eye[2]];
        let length = way[0].hypot(way[1]);
        for step in 0..10 {
            let ahead = 0.1 * f64::from(step) / length;
            let (x, z) = ((eye[0] + ahead * way[0]) as f32, (eye[2] + ahead * way[1]) as f32);
            let is_above = |&([x0, z0], [x1, z1], _): &Table| (x0..x1).contains(&x) && (z0..z1).contains(&z);
            assert!(!tables.iter().any(is_above), "{eye:.2?} {target:.2?}");
        }
    }
}

fn on_a_lawn(scene: Boxes) -> String {
    scene.add([-40.0, -0.2, -40.0], [40.0, 0.0, 40.0]).text
}

/// Messages of a small render: guesses and warnings.
fn said(folder: &Path, args: &str) -> String {
    let args = split(args);
    let small = ["--size", "8x8", "--spp", "1", "-o", "x.png"];
    words(&done(folder, &[&["render"][..], &args, &small].concat()))
}

/// Position of the camera that the messages print.
fn position(words: &str) -> [f64; 3] {
    numbers(words, "--position ")
}

fn numbers(words: &str, flag: &str) -> [f64; 3] {
    let list = words.split(flag).nth(1).unwrap().split(' ').next().unwrap();
    let numbers: Vec<f64> = list.trim().split(',').map(|x| x.parse().unwrap()).collect();
    numbers.try_into().unwrap()
}

fn assert_near(found: [f64; 3], expected: [f64; 3]) {
    let is_near = found
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() < 2e-3 * b.abs().max(1.0));
    assert!(is_near, "{found:?} instead of {expected:?}");
}

#[test]
fn view_inside_shows_a_room_of_the_house() {
    let folder = folder(&[("house.obj", &house().text), ("lawn.obj", &on_a_lawn(house()))]);
    for scene in ["house.obj", "lawn.obj"] {
        let at = folder.path();
        assert!(said(at, scene).contains("camera: an object"), "{scene}");
        let words = said(at, &format!("{scene} --view inside"));
        let [x, y, z] = position(&words);
        assert!(
            x.abs() < 4.75 && (0.5..2.9).contains(&y) && z.abs() < 3.75,
            "{scene}: {words}"
        );
        assert!(words.contains("an interior, from inside"), "{words}");
        assert!(words.contains("sky and sun through the openings"), "{words}");
        // If flags give the camera position as numbers, the light is the same.
        let words = said(at, &format!("{scene} --position {x},{y},{z} --look-at 0,1,0"));
        assert!(words.contains("sky and sun through the openings"), "{words}");
    }
}

#[test]
fn view_inside_without_a_room_is_an_error() {
    let sheet = "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n";
    let cube = Boxes::default().add([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]).text;
    let folder = folder(&[("sheet.obj", sheet), ("cube.obj", &cube)]);
    for (scene, reason) in [
        ("sheet.obj", "there is no floor with room above it"),
        (
            "cube.obj",
            "the scene is a closed body, and shows the backs of its surfaces inside",
        ),
    ] {
        let words = refused(folder.path(), &["render", scene, "--view", "inside"], 2);
        let expected =
            format!("error: camera view `inside` has no place for the camera: {reason}\n  help: leave --view out");
        assert!(words.starts_with(&expected), "{words}");
    }
    // Errors of scene files refer to the key.
    let toml = "version = 1\n[[object]]\nobj = \"cube.obj\"\n[camera]\nview = \"inside\"\n";
    std::fs::write(folder.path().join("s.toml"), toml).unwrap();
    let words = refused(folder.path(), &["render", "s.toml"], 1);
    assert!(
        words.contains("s.toml:5:8: camera view `inside` has no place"),
        "{words}"
    );
}

/// Hidden furniture and walls leave camera and light of a room where they are, in contrast to
/// furniture that the file does not have.
#[test]
fn hidden_parts_do_not_move_camera_of_a_room() {
    // A name before the vertices of each box
    let mut text = String::new();
    let mut was_face = true;
    for line in room(&["+z"]).lines() {
        if was_face && line.starts_with('v') {
            writeln!(text, "o box{}", text.matches("o box").count()).unwrap();
        }
        was_face = line.starts_with('f');
        writeln!(text, "{line}").unwrap();
    }
    let scene = |render: &str| format!("version = 1\n[render]\n{render}\n[[object]]\nobj = \"room.obj\"\n");
    let report = |render: &str| {
        let folder = folder(&[("room.obj", &*text), ("s.toml", &scene(render))]);
        let report = json(&done(folder.path(), &["info", "s.toml", "--json"]));
        (report["camera"].clone(), report["light_guess"].clone())
    };
    let whole = report("");
    let guess = whole.0["guess"].as_str().unwrap();
    assert!(guess.starts_with("an interior"), "{guess}");
    for box_name in ["box1", "box2", "box3"] {
        assert_eq!(report(&format!("hide = \"{box_name}\"")), whole, "{box_name}");
    }
    assert_eq!(report("hide = [\"box1\", \"box2\", \"box3\"]"), whole);
    // `only` shows the parts alone, and leaves the others out of the guess.
    assert_ne!(report("only = [\"box0\", \"box1\", \"box2\"]").0, whole.0);
}

#[test]
fn rooms_with_ground_or_outliers_are_interiors() {
    let with = |more: &str| {
        let mut text = room(&[]);
        let corners = text.lines().filter(|line| line.starts_with("v ")).count();
        for line in more.lines() {
            match line.strip_prefix("f ") {
                Some(face) => {
                    let face: Vec<String> = face
                        .split(' ')
                        .map(|i| (i.parse::<usize>().unwrap() + corners).to_string())
                        .collect();
                    writeln!(text, "f {}", face.join(" ")).unwrap();
                }
                None => writeln!(text, "{line}").unwrap(),
            }
        }
        text
    };
    let ground = Boxes::default().add([-60.0, -0.5, -60.0], [60.0, -0.1, 60.0]).text;
    let sheet = "v -60 -0.1 -60\nv -60 -0.1 60\nv 60 -0.1 60\nv 60 -0.1 -60\nf 1 2 3 4\n";
    let posts = Boxes::default()
        .add([20.0, 0.0, 20.0], [20.4, 3.0, 20.4])
        .add([-18.0, 0.0, 8.0], [-17.6, 1.0, 8.4])
        .text;
    let faces = "v 14 1 1\nv 14 1 2\nv 14 2 2\nf 1 2 3\nv 0 30 0\nv 0 30 1\nv 1 30 1\nf 4 5 6\n";
    for (name, more) in [
        ("ground", &*ground),
        ("sheet", sheet),
        ("posts", &posts),
        ("faces", faces),
    ] {
        let folder = folder(&[("room.obj", &with(more))]);
        let camera = camera(folder.path(), "room.obj");
        let guess = camera["guess"].as_str().unwrap();
        assert!(guess.starts_with("an interior, from inside"), "{name}: {guess}");
        let [x, y, z] = vector(&camera["position"]);
        assert!(
            x.abs() < 2.0 && (0.0..2.6).contains(&y) && z.abs() < 3.0,
            "{name}: {x} {y} {z}"
        );
    }
}

/// A pipe along x that faces inwards.
fn pipe() -> String {
    let mut text = String::new();
    for i in 0..32 {
        let (sin, cos) = (f64::from(i) / 32.0 * std::f64::consts::TAU).sin_cos();
        writeln!(text, "v -2 {sin:.5} {cos:.5}\nv 2 {sin:.5} {cos:.5}").unwrap();
    }
    for i in 0..32 {
        let [a, b] = [2 * i + 1, 2 * ((i + 1) % 32) + 1];
        writeln!(text, "f {a} {b} {} {}", b + 1, a + 1).unwrap();
    }
    text
}

#[test]
fn narrow_floors_make_no_interior() {
    let shaft = Boxes::default().room([-0.1, 0.0, -0.1], [0.1, 5.0, 0.1], &[]).text;
    let bottomless = Boxes::default().room([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0], &["-y"]).text;
    let inwards = pipe();
    let outwards = turned(&inwards, |[x, y, z]| [x, z, y]);
    for (name, text) in [
        ("shaft", shaft),
        ("bottomless", bottomless),
        ("pipe", inwards),
        ("hose", outwards),
    ] {
        let folder = folder(&[("a.obj", &text)]);
        let guess = camera(folder.path(), "a.obj")["guess"].to_string();
        assert!(guess.contains("an object"), "{name}: {guess}");
    }
}

/// If each face has a copy with reversed winding, all rays hit the fronts of faces, as in a room.
/// Such hits alone do not make an interior.
#[test]
fn doubled_faces_make_no_interior() {
    let doubled = |scene: Boxes| {
        let text = scene.text;
        let backs = text.lines().filter_map(|line| {
            let mut corners: Vec<&str> = line.strip_prefix("f ")?.split(' ').collect();
            corners.reverse();
            Some(format!("f {}\n", corners.join(" ")))
        });
        let backs: String = backs.collect();
        text + &backs
    };
    let open = |side| doubled(Boxes::default().room([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0], &[side]));
    let pipe = doubled(Boxes {
        text: pipe(),
        ..Boxes::default()
    });
    for (name, text) in [("side", open("+z")), ("top", open("+y")), ("pipe", pipe)] {
        let folder = folder(&[("a.obj", &text)]);
        let guess = camera(folder.path(), "a.obj")["guess"].to_string();
        assert!(guess.contains("an object"), "{name}: {guess}");
    }
}

#[test]
fn stand_puts_the_camera_at_eye_height() {
    let metres = room(&[]);
    let scaled = |scale: f32| turned(&metres, |p| p.map(|x| x * scale));
    let files = [
        ("m.obj", metres.clone()),
        ("cm.obj", scaled(100.0)),
        ("mm.obj", scaled(1000.0)),
        ("in.obj", format!("# File units = inches\n{}", scaled(39.37))),
        ("any.obj", scaled(0.1)),
        ("up.obj", turned(&metres, |[x, y, z]| [x, -z, y])),
    ];
    let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let folder = folder(&files);
    for (args, expected, unit) in [
        (
            "m.obj --stand 0.5,1.5",
            [0.5, 1.6, 1.5],
            "(1.6 m; the unit is the metre",
        ),
        ("m.obj --stand 0.5,1.5,0.9", [0.5, 0.9, 1.5], "eyes 0.9 above it"),
        // A box of table height is at this position. The camera height is still measured from the
        // floor.
        ("m.obj --stand 0,-1.1", [0.0, 1.6, -1.1], "metre"),
        (
            "cm.obj --stand 50,150",
            [50.0, 160.0, 150.0],
            "the unit is the centimetre, as the height",
        ),
        ("mm.obj --stand 500,-2500", [500.0, 1600.0, -2500.0], "millimetre"),
        (
            "in.obj --stand 20,60",
            [20.0, 62.99, 60.0],
            "the unit is the inch, as the file or --unit names it",
        ),
        ("any.obj --stand 0.05,0.15", [0.05, 0.156, 0.15], "no unit is known"),
        ("up.obj --up 0,0,1 --stand 0.5,-1.5", [0.5, -1.5, 1.6], "metre"),
    ] {
        let words = said(folder.path(), args);
        assert_near(position(&words), expected);
        assert!(
            words.contains("camera: stands on the floor") && words.contains(unit),
            "{words}"
        );
    }
    // The camera faces the direction with the longest free distance, unless flags set the
    // direction.
    let at = folder.path();
    let target = |args: &str| numbers(&said(at, &format!("m.obj --stand 0.5,2 {args}")), "--look-at ");
    let [_, y, z] = target("");
    assert!((y - 1.6).abs() < 1e-3 && z < 0.0, "{y} {z}");
    let [x, y, z] = target("--yaw 90");
    assert!(
        (y - 1.6).abs() < 1e-3 && (z - 2.0).abs() < 1e-3 && x > 1.0,
        "{x} {y} {z}"
    );
    assert_near(target("--look-at 0,0.5,-1"), [0.0, 0.5, -1.0]);
}

#[test]
fn stand_works_on_storeys_and_far_away() {
    let house = Boxes::default()
        .room([-4.0, 0.0, -3.0], [4.0, 2.7, 3.0], &[])
        .room([-4.0, 3.0, -3.0], [4.0, 5.7, 3.0], &[])
        .add([1.0, 0.0, 1.0], [2.0, 1.0, 2.0])
        .add([-2.0, 0.0, -2.0], [-1.0, 1.5, -1.0])
        .text;
    let far = house.lines().map(|line| match line.strip_prefix("v ") {
        Some(v) => {
            let v: Vec<f64> = v.split(' ').map(|x| x.parse().unwrap()).collect();
            format!("v {} {} {}\n", v[0] + 350_000.0, v[2] + 5_600_000.0, v[1])
        }
        None => format!("{line}\n"),
    });
    // Two axes are swapped, which mirrors the model, so the winding of faces is reversed.
    let far: String = far
        .map(|line| match line.strip_prefix("f ") {
            Some(face) => {
                let corners: Vec<&str> = face.trim().split(' ').rev().collect();
                format!("f {}\n", corners.join(" "))
            }
            None => line,
        })
        .collect();
    let folder = folder(&[("house.obj", &house), ("far.obj", &far)]);
    let at = folder.path();
    let [x, y, z] = position(&said(at, "house.obj --stand 0,0"));
    assert_near([x, 0.0, z], [0.0, 0.0, 0.0]);
    assert!((y - 1.6).abs() < 1e-3 || (y - 4.6).abs() < 1e-3, "{y}");
    let [x, y, z] = position(&said(at, "far.obj --stand 350000.5,5600001"));
    assert_near([x - 350_000.0, y - 5_600_000.0, 0.0], [0.5, 1.0, 0.0]);
    assert!((z - 1.6).abs() < 1e-3 || (z - 4.6).abs() < 1e-3, "{z}");
}

#[test]
fn places_without_a_floor_are_refused() {
    let folder = folder(&[("room.obj", &room(&[]))]);
    let at = folder.path();
    let refused = |args: &str| refused(at, &[&["render", "room.obj"][..], &split(args)].concat(), 2);
    let words = refused("--stand 9,0");
    assert!(
        words.starts_with("error: camera stand 9,0: this place has no floor\n"),
        "{words}"
    );
    // The middle of the nearest of 24 x 24 cells of the room, which is 4 x 6 units wide
    assert!(
        words.contains("help: --stand 1.9") && words.contains(" is the nearest floor; or choose"),
        "{words}"
    );
    // Outside of the room, below the eaves, there is no floor. The roof is not a floor.
    let eaves = Boxes::default()
        .room([-4.0, 0.0, -3.0], [4.0, 2.7, 3.0], &[])
        .add([-4.4, 2.7, -3.4], [4.4, 3.0, 3.4])
        .text;
    fs::write(at.join("eaves.obj"), eaves).unwrap();
    let words = crate::support::program::refused(at, &split("render eaves.obj --stand 4.2,0"), 2);
    assert!(words.contains("no floor with room for a camera"), "{words}");
    let words = refused("--stand 0,0,2.59");
    assert!(words.contains("no floor with room for a camera"), "{words}");
    for (args, expected) in [
        ("--stand 0,0 --view top", "error: --stand cannot be used with --view\n"),
        (
            "--stand 0,0 --orbit 1,2",
            "error: --stand cannot be used with --orbit\n",
        ),
        (
            "--stand 0,0 --position 1,1,1",
            "error: --stand cannot be used with --position\n",
        ),
        (
            "--stand 0,0 --yaw 9 --look-at 1,1,1",
            "error: --yaw cannot be used with --look-at\n",
        ),
        ("--yaw 9", "error: render needs --stand X,Z[,HEIGHT]\n"),
        (
            "--stand 1",
            "error: --stand 1\n  help: use the two horizontal coordinates",
        ),
        (
            "--stand 0,0,-1",
            "error: --stand 0,0,-1\n  help: use the two horizontal coordinates",
        ),
    ] {
        let words = refused(args);
        assert!(words.starts_with(expected), "{args}: {words}");
    }
}

#[test]
fn stand_is_a_key_of_scene_files() {
    let scene = |camera: &str| format!("version = 1\n[[object]]\nobj = \"room.obj\"\n[camera]\n{camera}\n");
    let folder = folder(&[
        ("room.obj", &room(&[])),
        ("a.toml", &scene("stand = [0.5, 1.5]\nyaw = 180")),
        ("b.toml", &scene("stand = [0.5, 1.5, 1.2]\nlook_at = [0, 1, 0]")),
        ("both.toml", &scene("stand = [0, 0]\nview = \"top\"")),
        ("placed.toml", &scene("stand = [0, 0]\nposition = [0, 1, 0]")),
        ("turned.toml", &scene("yaw = 9")),
        ("short.toml", &scene("stand = [0]")),
    ]);
    let at = folder.path();
    let words = said(at, "a.toml --dump-scene dumped.toml");
    assert_near(position(&words), [0.5, 1.6, 1.5]);
    let dumped = std::fs::read_to_string(at.join("dumped.toml")).unwrap();
    assert!(
        dumped.contains("position = [0.5, 1.6, 1.5]") && !dumped.contains("stand"),
        "{dumped}"
    );
    assert_near(position(&said(at, "b.toml")), [0.5, 1.2, 1.5]);
    // The flag overrides the position in the scene file.
    assert_near(position(&said(at, "b.toml --stand 1,0 --yaw 0")), [1.0, 1.6, 0.0]);
    for (scene, expected) in [
        ("both.toml", "both `view` and `stand`"),
        ("placed.toml", "both `position` and `stand`"),
        ("turned.toml", "`yaw` needs `stand`"),
        ("short.toml", "use the two horizontal coordinates"),
    ] {
        let words = refused(at, &["render", scene], 1);
        assert!(words.contains(expected), "{scene}: {words}");
    }
}

/// Width and height of a PNG file.
fn size_of(png: &Path) -> [u32; 2] {
    let bytes = std::fs::read(png).unwrap();
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

#[test]
fn views_of_an_interior_have_a_plan() {
    let statue = Boxes::default().add([-1.0, 0.0, -1.0], [1.0, 3.0, 1.0]).text;
    let folder = folder(&[
        ("room.obj", &room(&["-x"])),
        ("house.obj", &house().text),
        ("statue.obj", &statue),
    ]);
    let at = folder.path();
    let sheet = |args: &str| {
        let small = ["-o", "sheet.png", "--size", "16x16", "--spp", "1"];
        let listed = printed(&done(at, &[&["views"][..], &split(args), &small].concat()));
        (listed, size_of(&at.join("sheet.png")))
    };
    let (listed, [_, high]) = sheet("room.obj");
    assert!(listed.contains("--position"), "{listed}");
    let (listed, [_, low]) = sheet("statue.obj");
    assert!(!listed.contains("--position") && high > low + 300, "{high} {low}");
    let (listed, [_, in_house]) = sheet("house.obj --view inside");
    assert!(listed.starts_with(" 1  --position") && in_house > low + 300, "{listed}");
}

#[test]
fn cameras_behind_walls_cause_warnings() {
    let folder = folder(&[("room.obj", &room(&[]))]);
    let at = folder.path();
    let warned = |camera: &str| said(at, &format!("room.obj {camera}"));
    for (camera, code) in [
        ("--position 0,1.5,6 --look-at 0,1,0", "camera-behind"),
        ("--position 1.5,1,-2.2 --look-at 1.6,1,-2.3", "camera-"),
        ("--position 0,1.5,2.97 --look-at 0,1,0", "camera-near"),
        ("--position 0,1.5,2 --look-at 0,1.5,3 --fov 20", "single-surface"),
    ] {
        let words = warned(camera);
        assert!(
            words.contains(&format!("[{code}")) && words.contains("`embrasure views SCENE"),
            "{camera}: {words}"
        );
    }
    let words = warned("--position 0,1.5,2.5 --look-at 0,1,0");
    assert!(!words.contains("warning"), "{words}");
    // `check` gives the same warning for a scene file.
    let toml = "version = 1\n[[object]]\nobj = \"room.obj\"\n[camera]\nposition = [0, 1.5, 6]\nlook_at = [0, 1, 0]\n";
    std::fs::write(at.join("s.toml"), toml).unwrap();
    let report: Value = json(&done(at, &["check", "s.toml", "--json"]));
    let codes: Vec<&str> = report["findings"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|f| f["code"].as_str())
        .collect();
    assert!(codes.contains(&"camera-behind"), "{codes:?}");
}

/// A closed room of thick walls with furniture is seen from inside if the file has the name of
/// rooms. A body whose faces are all turned over is seen from outside.
#[test]
fn names_of_rooms_and_things_decide_about_inside() {
    let office = Boxes::default()
        .add([-5.0, 0.0, -4.0], [5.0, 0.2, 4.0])
        .add([-5.0, 0.2, -4.0], [5.0, 2.9, -3.75])
        .add([-5.0, 0.2, 3.75], [5.0, 2.9, 4.0])
        .add([-5.0, 0.2, -3.75], [-4.75, 2.9, 3.75])
        .add([4.75, 0.2, -3.75], [5.0, 2.9, 3.75])
        .add([-5.0, 2.9, -4.0], [5.0, 3.1, 4.0])
        .add([-3.2, 0.9, -0.4], [-1.8, 0.95, 0.4])
        .add([-3.0, 0.2, -0.3], [-2.9, 0.9, -0.2])
        .add([2.0, 0.2, 2.0], [4.0, 1.0, 3.0])
        .add([1.0, 0.2, -3.7], [3.0, 2.2, -3.2])
        .text;
    let bench =
        Boxes::default()
            .room([-1.0, 0.0, -0.5], [1.0, 0.5, 0.5], &[])
            .room([-1.0, 0.5, -0.5], [1.0, 1.2, -0.3], &[]);
    let folder = folder(&[
        ("office.obj", &office),
        ("block.obj", &office),
        ("body.obj", &bench.text),
        ("sofa.obj", &room(&[])),
    ]);
    for (scene, expected) in [
        ("office.obj", "an interior, from inside"),
        ("block.obj", "an object"),
        ("body.obj", "an object"),
        ("sofa.obj", "an object"),
    ] {
        let camera = camera(folder.path(), scene);
        let guess = camera["guess"].as_str().unwrap();
        assert!(guess.starts_with(expected), "{scene}: {guess}");
    }
}

/// Open rooms with high walls are seen from higher above if the file has their name.
#[test]
fn open_rooms_with_high_walls_are_seen_from_high_above() {
    let walls = Boxes::default()
        .add([-2.0, -0.2, -2.0], [2.0, 0.0, 2.0])
        .add([-2.0, 0.0, -2.0], [2.0, 3.0, -1.9])
        .add([-2.0, 0.0, 1.9], [2.0, 3.0, 2.0])
        .add([-2.0, 0.0, -1.9], [-1.9, 3.0, 1.9])
        .add([1.9, 0.0, -1.9], [2.0, 3.0, 1.9])
        .text;
    let folder = folder(&[("roomWalls.obj", &walls), ("crate.obj", &walls)]);
    for (scene, is_high) in [("roomWalls.obj", true), ("crate.obj", false)] {
        let camera = camera(folder.path(), scene);
        let guess = camera["guess"].as_str().unwrap();
        assert_eq!(guess.contains("elevation 55°"), is_high, "{scene}: {guess}");
    }
}
