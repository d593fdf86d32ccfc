//! Guesses of missing settings: the camera of a bare OBJ (an OBJ file without a scene file), and
//! the flags and keys of the camera.

use crate::support::program::{assert_same_bits, done, folder, json, printed, refused, split, words};
use crate::support::{read_channel, read_rgb, rel_mse};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// OBJ text of boxes, each given by two opposite corners. A `room` faces inwards, and lacks the
/// sides in `open`, such as "+z".
#[derive(Default)]
pub(super) struct Boxes {
    pub(super) text: String,
    pub(super) corners: usize,
}

impl Boxes {
    pub(super) fn add(mut self, min: [f32; 3], max: [f32; 3]) -> Self {
        self.push(min, max, false, &[]);
        self
    }

    pub(super) fn room(mut self, min: [f32; 3], max: [f32; 3], open: &[&str]) -> Self {
        self.push(min, max, true, open);
        self
    }

    fn push(&mut self, min: [f32; 3], max: [f32; 3], inwards: bool, open: &[&str]) {
        for i in 0..8 {
            let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
            writeln!(self.text, "v {} {} {}", pick(0), pick(1), pick(2)).unwrap();
        }
        let sides = [
            ("-x", [0, 4, 6, 2]),
            ("+x", [1, 3, 7, 5]),
            ("-y", [0, 1, 5, 4]),
            ("+y", [2, 6, 7, 3]),
            ("-z", [0, 2, 3, 1]),
            ("+z", [4, 5, 7, 6]),
        ];
        for (_, mut side) in sides.into_iter().filter(|(name, _)| !open.contains(name)) {
            if inwards {
                side.reverse();
            }
            let [a, b, c, d] = side.map(|i| i + self.corners + 1);
            writeln!(self.text, "f {a} {b} {c} {d}").unwrap();
        }
        self.corners += 8;
    }

    /// The model after a rotation from +y up to +z up.
    pub(super) fn upended(self) -> String {
        turned(&self.text, |[x, y, z]| [x, -z, y])
    }
}

/// The OBJ `text` with transformed vertices.
pub(super) fn turned(text: &str, turn: impl Fn([f32; 3]) -> [f32; 3]) -> String {
    let line = |line: &str| match line.strip_prefix("v ") {
        Some(v) => {
            let v: Vec<f32> = v.split(' ').map(|x| x.parse().unwrap()).collect();
            let [x, y, z] = turn([v[0], v[1], v[2]]);
            format!("v {x} {y} {z}\n")
        }
        None => format!("{line}\n"),
    };
    text.lines().map(line).collect()
}

/// A column on a plinth. Small boxes on its +z side are a human face.
fn statue() -> Boxes {
    let mut boxes = Boxes::default()
        .add([-0.6, 0.0, -0.6], [0.6, 0.2, 0.6])
        .add([-0.3, 0.2, -0.3], [0.3, 2.2, 0.3]);
    for i in 0..4 {
        for j in 0..4 {
            let (x, y) = (-0.24 + 0.13 * i as f32, 1.5 + 0.15 * j as f32);
            boxes = boxes.add([x, y, 0.28], [x + 0.07, y + 0.08, 0.4]);
        }
    }
    boxes
}

/// A room with three boxes as furniture. The sides in `open` are missing.
pub(super) fn room(open: &[&str]) -> String {
    Boxes::default()
        .room([-2.0, 0.0, -3.0], [2.0, 2.6, 3.0], open)
        .add([-0.8, 0.0, -1.6], [0.4, 0.8, -0.6])
        .add([1.2, 0.0, -2.9], [1.9, 2.0, -1.5])
        .add([-1.9, 0.0, 1.0], [-1.3, 0.6, 2.0])
        .text
}

pub(super) fn camera(folder: &Path, scene: &str) -> Value {
    json(&done(folder, &["info", scene, "--json"]))["camera"].clone()
}

pub(super) fn vector(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|i| value[i].as_f64().unwrap())
}

/// Azimuth of the direction from the target to the camera, in degrees from +z towards +x, and
/// elevation in degrees. +y is up.
fn angles(camera: &Value) -> (f64, f64) {
    let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
    let way = [0, 1, 2].map(|i| eye[i] - target[i]);
    let level = way[0].hypot(way[2]);
    (way[0].atan2(way[2]).to_degrees(), way[1].atan2(level).to_degrees())
}

#[test]
fn camera_is_in_front_and_above_the_object() {
    let folder = folder(&[("statue.obj", &statue().text)]);
    let camera = camera(folder.path(), "statue.obj");
    let (azimuth, elevation) = angles(&camera);
    assert!((10.0..50.0).contains(&azimuth.abs()), "{azimuth}");
    assert!((10.0..30.0).contains(&elevation), "{elevation}");
    assert_eq!(vector(&camera["up"]), [0.0, 1.0, 0.0]);
    assert!(camera["guess"].as_str().unwrap().contains("+y is up (--up 0,0,1"));
}

#[test]
fn object_with_z_up_is_upright() {
    let folder = folder(&[("statue.obj", &statue().upended())]);
    let camera = camera(folder.path(), "statue.obj");
    assert_eq!(vector(&camera["up"]), [0.0, 0.0, 1.0]);
    let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
    assert!(eye[1] < target[1] && eye[2] > target[2], "{eye:.2?} {target:.2?}");
    assert!(camera["guess"].as_str().unwrap().contains("+z is up"));
}

/// A cube around the z axis, from `low` to `low + 1` in height. Its walls have textures with v
/// along z; top and bottom have the materials `top` and `bottom`.
fn cube(low: f32, walls: [[f32; 2]; 4], top: &str, bottom: &str) -> [(&'static str, String); 2] {
    let mut text = "mtllib cube.mtl\n".to_string();
    for i in 0..8 {
        let pick = |bit: usize| (i >> bit & 1) as f32 - 0.5;
        writeln!(text, "v {} {} {}", pick(0), pick(1), low + 0.5 + pick(2)).unwrap();
    }
    for [u, v] in walls {
        writeln!(text, "vt {u} {v}").unwrap();
    }
    for [a, b, c, d] in [[1, 2, 6, 5], [2, 4, 8, 6], [4, 3, 7, 8], [3, 1, 5, 7]] {
        writeln!(text, "usemtl wall\nf {a}/1 {b}/2 {c}/3 {d}/4").unwrap();
    }
    writeln!(text, "usemtl {bottom}\nf 1 3 4 2\nusemtl {top}\nf 5 6 8 7").unwrap();
    let library = ["wall", top, bottom]
        .map(|name| format!("newmtl {name}\nKd 0.5 0.5 0.5\n"))
        .concat();
    [("cube.obj", text), ("cube.mtl", library)]
}

#[test]
fn origin_textures_and_names_raise_an_axis() {
    let blank = [[0.5, 0.5]; 4];
    let upright = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for (name, files, up) in [
        ("nothing", cube(-0.5, blank, "a", "b"), [0.0, 1.0, 0.0]),
        ("origin", cube(0.0, blank, "a", "b"), [0.0, 0.0, 1.0]),
        ("textures", cube(-0.5, upright, "a", "b"), [0.0, 0.0, 1.0]),
        ("names", cube(-0.5, blank, "Roof_tiles", "floor.001"), [0.0, 0.0, 1.0]),
        (
            "names upside down",
            cube(-0.5, blank, "Wheels", "carRoof"),
            [0.0, 0.0, -1.0],
        ),
    ] {
        let folder = folder(&files.each_ref().map(|(name, text)| (*name, text.as_str())));
        let camera = camera(folder.path(), "cube.obj");
        assert_eq!(vector(&camera["up"]), up, "{name}: {}", camera["guess"]);
    }
}

/// A thin plate is seen from +x or −x, where it is wide, although azimuth 0 (+z) is the usual
/// front.
#[test]
fn plates_are_not_seen_from_their_edges() {
    let phone = Boxes::default()
        .add([-0.1, 0.0, -0.8], [0.1, 3.0, 0.8])
        .add([0.1, 0.2, -0.7], [0.12, 2.8, 0.7]);
    let folder = folder(&[("phone.obj", &phone.text)]);
    let (azimuth, _) = angles(&camera(folder.path(), "phone.obj"));
    assert!((45.0..135.0).contains(&azimuth.abs()), "{azimuth}");
}

/// An elevation has the up axis and the front of `--view front`. If `--up` sets another up axis,
/// the front is the usual front for that axis.
#[test]
fn elevations_have_the_guessed_axes() {
    let phone = Boxes::default()
        .add([-0.1, 0.0, -0.8], [0.1, 3.0, 0.8])
        .add([0.1, 0.2, -0.7], [0.12, 2.8, 0.7]);
    let folder = folder(&[("statue.obj", &statue().upended()), ("phone.obj", &phone.text)]);
    for (args, expected) in [
        ("statue.obj --elevation front", "seen from -y, with +z up"),
        ("statue.obj --elevation front --up 0,1,0", "seen from +z, with +y up"),
        ("statue.obj --elevation plan", "seen from +z, with +y up"),
        ("phone.obj --elevation front", "x, with +y up"),
    ] {
        let args = format!("render {args} --size 16x16 --spp 1 -o a.exr");
        let printed = done(folder.path(), &split(&args));
        let words = String::from_utf8(printed.stderr).unwrap();
        assert!(words.contains(expected), "{args}: {words}");
    }
}

/// An up axis, and the transform that turns a model with +y up to this axis.
type Turn = ([f64; 3], fn([f32; 3]) -> [f32; 3]);

const TURNS: [Turn; 4] = [
    ([0.0, 1.0, 0.0], |v| v),
    ([0.0, 0.0, 1.0], |[x, y, z]| [x, -z, y]),
    ([0.0, -1.0, 0.0], |[x, y, z]| [x, -y, -z]),
    ([0.0, 0.0, -1.0], |[x, y, z]| [x, z, -y]),
];

/// A room is upright in each of four orientations. A statue on a plinth is upright with +y up and
/// with +z up.
#[test]
fn rooms_and_objects_are_upright() {
    for (name, text, turns) in [("room", room(&[]), &TURNS[..]), ("statue", statue().text, &TURNS[..2])] {
        for (up, turn) in turns {
            let folder = folder(&[("a.obj", &turned(&text, turn))]);
            let camera = camera(folder.path(), "a.obj");
            assert_eq!(vector(&camera["up"]), *up, "{name}: {}", camera["guess"]);
            let sign = if up.iter().sum::<f64>() < 0.0 { '-' } else { '+' };
            let said = format!("{sign}{} is up (--up ", if up[1] == 0.0 { 'z' } else { 'y' });
            assert!(camera["guess"].as_str().unwrap().contains(&said), "{}", camera["guess"]);
        }
    }
}

/// A mug around the y axis with a handle, open at the top. The centre of the mug is the origin.
fn mug() -> String {
    const SIDES: usize = 24;
    let profile = [
        (0.0, -1.0),
        (1.0, -1.0),
        (1.0, 1.0),
        (0.9, 1.0),
        (0.9, -0.9),
        (0.0, -0.9),
    ];
    let mut text = String::new();
    for (radius, y) in profile {
        for i in 0..SIDES {
            let (sin, cos) = (std::f32::consts::TAU * i as f32 / SIDES as f32).sin_cos();
            writeln!(text, "v {} {y} {}", radius * cos, radius * sin).unwrap();
        }
    }
    for ring in 0..profile.len() - 1 {
        for i in 0..SIDES {
            let [a, b] = [i, (i + 1) % SIDES].map(|i| ring * SIDES + i + 1);
            writeln!(text, "f {a} {} {} {b}", a + SIDES, b + SIDES).unwrap();
        }
    }
    let handle = Boxes {
        corners: profile.len() * SIDES,
        text,
    };
    handle.add([1.0, -0.6, -0.1], [1.6, 0.6, 0.1]).text
}

/// A mug stands on its axis with the opening up, for any axis.
#[test]
fn bodies_of_revolution_stand_on_their_axis() {
    for (up, turn) in TURNS {
        let folder = folder(&[("mug.obj", &turned(&mug(), turn))]);
        let camera = camera(folder.path(), "mug.obj");
        assert_eq!(vector(&camera["up"]), up, "{}", camera["guess"]);
    }
}

/// A cube gets the up axis of the other files in its folder, if the same program wrote them.
#[test]
fn other_files_of_the_folder_raise_an_axis() {
    let blank = [[0.5, 0.5]; 4];
    let [(_, cube), _] = cube(-0.5, blank, "a", "b");
    let statue = statue().upended();
    let by = |program: &str, text: &str| format!("# {program} 1.0\n{text}");
    let (ours, other) = (by("Chisel", &statue), by("Hammer", &statue));
    for (sisters, up, words) in [
        (&[][..], [0.0, 1.0, 0.0], "+y is up (--up"),
        (
            &[("a.obj", &ours), ("b.OBJ", &ours)],
            [0.0, 0.0, 1.0],
            "+z is up as in other files of its folder (--up 0,1,0",
        ),
        (
            &[("a.obj", &other), ("b.obj", &other)],
            [0.0, 1.0, 0.0],
            "+y is up (--up",
        ),
        (&[("a.txt", &ours), ("b.txt", &ours)], [0.0, 1.0, 0.0], "+y is up (--up"),
    ] {
        let folder = folder(&[("cube.obj", &by("Chisel", &cube))]);
        for (name, text) in sisters {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let camera = camera(folder.path(), "cube.obj");
        assert_eq!(vector(&camera["up"]), up, "{}", camera["guess"]);
        assert!(camera["guess"].as_str().unwrap().contains(words), "{}", camera["guess"]);
        // Other views of the scene have the same up axis.
        let views = json(&done(folder.path(), &["views", "cube.obj", "--json"]));
        let is_turned = views[0]["camera"].as_str().unwrap().contains("--up 0,0,1");
        assert_eq!(is_turned, up[2] == 1.0, "{views}");
    }
}

/// A vehicle shows its side as well as its front.
#[test]
fn long_objects_show_their_sides() {
    let car = Boxes::default()
        .add([-0.8, 0.0, -1.8], [0.8, 0.8, 1.8])
        .add([-0.7, 0.8, -1.2], [0.7, 1.4, 0.6])
        .add([-0.6, 0.3, 1.8], [-0.4, 0.5, 1.9])
        .add([0.4, 0.3, 1.8], [0.6, 0.5, 1.9]);
    let folder = folder(&[("car.obj", &car.text)]);
    let (azimuth, _) = angles(&camera(folder.path(), "car.obj"));
    assert!((42.0..70.0).contains(&azimuth.abs()), "{azimuth}");
}

/// A field in the plane of x and y is horizontal, and seen from high above.
#[test]
fn flat_field_is_horizontal() {
    let field = "v -40 -26 0\nv 40 -26 0\nv 40 26 0\nv -40 26 0\nf 1 2 3 4\n";
    let folder = folder(&[("field.obj", field)]);
    let camera = camera(folder.path(), "field.obj");
    assert_eq!(vector(&camera["up"]), [0.0, 0.0, 1.0]);
    let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
    let way = [0, 1, 2].map(|i| eye[i] - target[i]);
    let elevation = way[2].atan2(way[0].hypot(way[1])).to_degrees();
    assert!((elevation - 40.0).abs() < 1.0, "{elevation}");
}

/// A brick with a cavity is an object, although a camera would fit inside.
#[test]
fn hollow_objects_are_seen_from_outside() {
    let brick = Boxes::default()
        .add([0.0, 0.0, 0.0], [16.0, 11.5, 16.0])
        .room([1.2, 1.2, 1.2], [14.8, 10.3, 14.8], &[])
        .add([3.0, 11.5, 3.0], [6.0, 13.0, 6.0])
        .add([10.0, 11.5, 10.0], [13.0, 13.0, 13.0]);
    let folder = folder(&[("brick.obj", &brick.text)]);
    let camera = camera(folder.path(), "brick.obj");
    assert!(
        camera["guess"].as_str().unwrap().starts_with("an object"),
        "{}",
        camera["guess"]
    );
}

/// A stair with coordinates of a national grid, in metres, keeps its steps. Its image equals the
/// image of the stair at the origin with +z up, both with guessed settings and with flags. `info`
/// prints the position of the stair.
#[test]
fn files_far_from_the_origin_are_moved() {
    let place = [512_300.0, 5_412_300.0, 430.0];
    let stair = |place: [f64; 3]| {
        let (mut text, mut count) = (String::new(), 0);
        for step in 0..6 {
            let z = place[2] + 0.25 * f64::from(step);
            let y = place[1] + 0.5 * f64::from(step);
            for (dx, dy, dz) in [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1), (1, 2, 1), (0, 2, 1)] {
                let [x, y, z] = [
                    place[0] + f64::from(dx),
                    y + 0.25 * f64::from(dy),
                    z + 0.25 * f64::from(dz),
                ];
                writeln!(text, "v {x} {y} {z}").unwrap();
            }
            for face in [[1, 2, 3, 4], [4, 3, 5, 6]] {
                let [a, b, c, d] = face.map(|corner| corner + count);
                writeln!(text, "f {a} {b} {c} {d}").unwrap();
            }
            count += 6;
        }
        text
    };
    let folder = folder(&[("far.obj", &stair(place)), ("near.obj", &stair([0.0; 3]))]);
    let at = folder.path();
    let picture = |line: &str| {
        let said = words(&done(
            at,
            &split(&format!("render {line} --size 24x16 --spp 1 -o x.exr")),
        ));
        (read_rgb(&at.join("x.exr")), said)
    };
    let (far, said) = picture("far.obj");
    assert!(said.contains("origin: 512300,5412300,430 is subtracted"), "{said}");
    assert!(!said.contains("far-from-origin"), "{said}");
    // In a national grid, heights are small compared with the other coordinates, so up is known.
    // The stair at the origin could also rise along y, so it needs `--up`.
    assert_eq!(far, picture("near.obj --up 0,0,1").0);
    let camera = "--position {} --look-at {} --up 0,0,1 --fov 40";
    let flags = |places: [&str; 2]| {
        places
            .iter()
            .fold(camera.to_string(), |line, place| line.replacen("{}", place, 1))
    };
    let far = picture(&format!(
        "far.obj {}",
        flags(["512304.5,5412296,433", "512300.5,5412301.5,430.75"])
    ))
    .0;
    assert_eq!(
        far,
        picture(&format!("near.obj {}", flags(["4.5,-4,3", "0.5,1.5,0.75"]))).0
    );

    let info = json(&done(at, &split("info far.obj --json")));
    assert_eq!(vector(&info["origin"]), place);
    assert_eq!(vector(&info["bounds"][1]), [512_301.0, 5_412_303.0, 431.5]);
    // Positions in the channel `P` are relative to the origin, which is in the metadata of the
    // image.
    picture("far.obj --aov P --denoise=off");
    let bytes = std::fs::read(at.join("x.exr")).unwrap();
    let holds = |text: &[u8]| bytes.windows(text.len()).any(|part| part == text);
    assert!(holds(b"embrasure.origin") && holds(b"512300,5412300,430"));
    let [x, y, z] = ["P.X", "P.Y", "P.Z"].map(|name| read_channel(&at.join("x.exr"), name));
    let seen: Vec<[f64; 3]> = (0..x.len())
        .map(|i| [x[i], y[i], z[i]])
        .filter(|p| *p != [0.0; 3])
        .map(|p| [0, 1, 2].map(|axis| f64::from(p[axis]) + place[axis]))
        .collect();
    assert!(seen.len() > 20, "{}", seen.len());
    let (low, high) = (place, [512_301.0, 5_412_303.0, 431.5]);
    let is_in_file = |p: &[f64; 3]| (0..3).all(|axis| (low[axis] - 1e-3..=high[axis] + 1e-3).contains(&p[axis]));
    assert!(seen.iter().all(is_in_file), "{seen:?}");
    let plain = std::fs::read({
        picture("near.obj");
        at.join("x.exr")
    });
    assert!(!plain.unwrap().windows(16).any(|part| part == b"embrasure.origin"));
    // A dumped scene file has the origin of the OBJ file, and renders the same image.
    done(
        at,
        &split("render far.obj --size 8x8 --spp 1 -q -o a.exr --dump-scene d.toml"),
    );
    let text = std::fs::read_to_string(at.join("d.toml")).unwrap();
    assert!(text.contains("origin = \"512300,5412300,430\""), "{text}");
    done(at, &split("render d.toml -q -o b.exr"));
    assert_same_bits(&at.join("a.exr"), &at.join("b.exr"));
    // Without the origin, rounding errors exceed the steps, and a warning reports this.
    let said = picture("far.obj --origin off").1;
    assert!(said.contains("far-from-origin"), "{said}");
}

/// If the faces of a file lie in two places far apart, camera and ground follow the place with most
/// faces.
#[test]
fn few_distant_faces_do_not_set_the_camera() {
    let near = || {
        (0..5).fold(Boxes::default(), |boxes, i| {
            let x = 1.5 * i as f32;
            boxes.add([x, 0.0, 0.0], [x + 1.0, 1.0 + 0.3 * i as f32, 1.0])
        })
    };
    let far = near().add([5e5, -300.0, 5e6], [5e5 + 10.0, -290.0, 5e6 + 10.0]);
    let folder = folder(&[("near.obj", &near().text), ("far.obj", &far.text)]);
    let at = folder.path();
    let [near, far] = ["near", "far"].map(|name| {
        let line = format!("render {name}.obj --up 0,1,0 --size 24x16 --spp 16 --denoise=off -o {name}.exr");
        (
            words(&done(at, &split(&line))),
            read_rgb(&at.join(format!("{name}.exr"))),
        )
    });
    let flags = |said: &str| {
        said.lines()
            .find(|line| line.contains("--position"))
            .unwrap()
            .to_string()
    };
    assert_eq!(flags(&near.0), flags(&far.0));
    let told = "12 triangles far away, around 500000,0,5000000, are left out of the view";
    assert!(far.0.contains(told) && !near.0.contains("left out"), "{}", far.0);
    let error = rel_mse(&far.1, &near.1);
    assert!(error < 0.01, "{error}");
}

/// Light flags refer to the guessed camera and to the up axis of the scene. The model with +y up
/// and the model with +z up therefore give the same image.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn light_flags_use_the_guessed_up_axis() {
    let folder = folder(&[("y.obj", &statue().text), ("z.obj", &statue().upended())]);
    let at = folder.path();
    done(at, &split("render y.obj --size 32x16 --spp 1 -q -o map.exr"));
    for flags in [
        "--env sky",
        "--env sky --sun 60,25",
        "--env studio",
        "--env map.exr",
        "--env black --key-light",
        "--env black --sun -50,30 --no-ground",
        "--env white --ground --orbit 40,20",
        "--env white --ground --set ground.albedo=0.2",
        "--ground --background light",
    ] {
        let [y, z] = ["y", "z"].map(|name| {
            let render = format!("render {name}.obj --size 48x48 --spp 64 --reuse none --denoise=off -q");
            let args = format!("{render} {flags} --dump-scene {name}.toml -o {name}.exr");
            done(at, &split(&args));
            read_rgb(&at.join(format!("{name}.exr")))
        });
        let error = rel_mse(&z, &y);
        assert!(error < 0.01, "{flags}: {error}");
        // The dumped scene file gives the same image.
        done(at, &split("render z.toml --reuse none --denoise=off -q -o again.exr"));
        assert_same_bits(&at.join("z.exr"), &at.join("again.exr"));
        let dump = std::fs::read_to_string(at.join("z.toml")).unwrap();
        assert_eq!(
            dump.contains("[ground]"),
            !flags.contains("--no-ground"),
            "{flags}: {dump}"
        );
    }
    let said = words(&done(at, &split("render y.obj --env sky --size 8x8 --spp 1 -o x.exr")));
    let line = "\nground: catches shadows (--no-ground removes it)\n";
    assert!(said.contains(line), "{said}");

    let dump = |args: &str| {
        let line = format!("render {args} --size 8x8 --spp 1 --dump-scene d.toml -q -o x.exr");
        done(at, &split(&line));
        std::fs::read_to_string(at.join("d.toml")).unwrap()
    };
    // The `up` of a guessed camera can be tilted. The up direction of the scene is the nearest
    // axis. The same holds for a camera that flags define completely.
    for camera in ["--up 0.1,0,1", "--position 0,-9,2 --look-at 0,0,1 --up 0,0,1"] {
        let scene = dump(&format!("z.obj {camera} --env map.exr --sun 20,30 --ground"));
        assert!(scene.contains("rotate = [90.0, 0.0, 0.0]"), "{scene}");
        assert!(scene.contains("[ground]\nup = [0.0, 0.0, 1.0]"), "{scene}");
    }
    // Keys of the ground are kept.
    let scene = dump("z.obj --env white --ground --set ground.albedo=0.2");
    assert!(scene.contains("albedo = [0.2, 0.2, 0.2]"), "{scene}");
    // No ground is added for an object with an emitting surface, or for an interior, which has a
    // floor.
    std::fs::write(at.join("lamp.mtl"), "newmtl lamp\nKe 5 5 5\n").unwrap();
    let lamp = format!("mtllib lamp.mtl\nusemtl lamp\n{}", statue().text);
    std::fs::write(at.join("lamp.obj"), lamp).unwrap();
    std::fs::write(at.join("room.obj"), room(&[])).unwrap();
    for scene in ["lamp.obj", "room.obj"] {
        assert!(!dump(&format!("{scene} --env sky")).contains("[ground]"), "{scene}");
    }
}

#[test]
fn rooms_are_seen_from_inside_and_level() {
    let folder = folder(&[("room.obj", &room(&[]))]);
    let camera = camera(folder.path(), "room.obj");
    let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
    let inside = eye[0].abs() < 1.8 && (0.3..2.3).contains(&eye[1]) && eye[2].abs() < 2.8;
    assert!(inside, "{eye:.2?}");
    assert!((eye[1] - target[1]).abs() < 1e-3);
    let guess = camera["guess"].as_str().unwrap();
    assert!(guess.contains("+y is up (--up 0,0,1 changes that)"), "{guess}");
}

/// No listed camera is near the floor.
#[test]
fn views_of_a_room_are_at_eye_height() {
    let text = Boxes::default()
        .room([-2.0, 0.0, -3.0], [2.0, 2.6, 3.0], &[])
        .add([-2.0, 0.75, 0.0], [2.0, 2.6, 3.0])
        .add([-0.9, 0.0, 1.0], [-0.6, 0.3, 1.3])
        .add([0.5, 0.0, 2.0], [0.8, 0.4, 2.3])
        .add([-0.8, 0.0, -1.6], [0.4, 0.8, -0.6])
        .text;
    let folder = folder(&[("niche.obj", &text)]);
    let list = json(&done(folder.path(), &["views", "niche.obj", "--json"]));
    let height = |view: &Value| {
        let flags = split(view["camera"].as_str().unwrap()).into_iter();
        let position = flags.skip_while(|word| *word != "--position").nth(1).unwrap();
        position.split(',').nth(1).unwrap().parse().unwrap()
    };
    let heights: Vec<f64> = list.as_array().unwrap().iter().map(height).collect();
    assert!(heights.len() > 3 && heights.iter().all(|y| *y > 0.5), "{heights:.2?}");
}

#[test]
fn rooms_without_a_wall_are_seen_through_it() {
    for (side, azimuth) in [("+z", 0.0), ("-z", 180.0), ("+x", 90.0), ("-x", -90.0)] {
        let folder = folder(&[("room.obj", &room(&[side]))]);
        let camera = camera(folder.path(), "room.obj");
        let (seen, elevation) = angles(&camera);
        let turn = (seen - azimuth + 540.0).rem_euclid(360.0) - 180.0;
        assert!(turn.abs() < 0.5 && elevation.abs() < 0.1, "{side}: {seen} {elevation}");
        let words = camera["guess"].as_str().unwrap();
        assert!(words.contains("open side"), "{words}");
    }
}

/// The corner of a room, without a ceiling and without two walls, is seen from outside and above.
#[test]
fn corner_of_a_room_is_an_object() {
    for (open, front) in [(["+z", "+x", "+y"], 45.0), (["+z", "-x", "+y"], -45.0)] {
        let folder = folder(&[("room.obj", &room(&open))]);
        let camera = camera(folder.path(), "room.obj");
        let words = camera["guess"].as_str().unwrap();
        assert!(words.starts_with("an object"), "{words}");
        let (azimuth, elevation) = angles(&camera);
        assert!(
            (azimuth - front).abs() < 50.0 && elevation > 14.0,
            "{azimuth} {elevation}: {words}"
        );
    }
}

/// Lines that a render of `scene` in `folder` prints about the guessed camera and light. The render
/// writes `x.exr` and `x.png`.
fn guessed(folder: &Path, scene: &str, more: &[&str]) -> Vec<String> {
    let args = [
        &[
            "render", scene, "--size", "16x16", "--spp", "1", "-o", "x.exr", "-o", "x.png",
        ],
        more,
    ]
    .concat();
    let said = words(&done(folder, &args));
    let is_guess = |line: &&str| {
        ["camera: ", "  --position", "light: "]
            .iter()
            .any(|start| line.starts_with(start))
    };
    said.lines().filter(is_guess).map(String::from).collect()
}

/// Messages and image are the same in another run, with other thread counts, and from another
/// folder.
#[test]
fn threads_and_folders_change_no_guess() {
    let files = [("statue.obj", statue().text), ("room.obj", room(&[]))];
    let [here, there] = [(); 2].map(|()| folder(&files.each_ref().map(|(name, text)| (*name, text.as_str()))));
    for (scene, _) in &files {
        let first = guessed(here.path(), scene, &[]);
        assert_eq!(first.len(), 3, "{first:?}");
        for [from, to] in [["x.exr", "first.exr"], ["x.png", "first.png"]] {
            std::fs::rename(here.path().join(from), here.path().join(to)).unwrap();
        }
        let path = here.path().join(scene);
        let from_there = path.to_str().unwrap();
        for (folder, scene, more) in [
            (here.path(), *scene, &[][..]),
            (here.path(), *scene, &["--threads", "3"]),
            (there.path(), from_there, &[]),
        ] {
            assert_eq!(guessed(folder, scene, more), first, "{scene} {more:?}");
            assert_same_bits(&here.path().join("first.exr"), &folder.join("x.exr"));
            let [one, other] = [here.path().join("first.png"), folder.join("x.png")].map(|p| std::fs::read(p).unwrap());
            assert!(one == other, "{scene} {more:?}");
        }
    }
}

/// A round mesh without normals causes a note with the smoothing flag.
#[test]
fn facets_cause_a_note_with_a_flag() {
    // Make a tube with 300 sides
    let mut tube = String::new();
    for i in 0..300 {
        let (sin, cos) = (i as f32 / 300.0 * std::f32::consts::TAU).sin_cos();
        writeln!(tube, "v {cos} 0 {sin}\nv {cos} 1 {sin}").unwrap();
    }
    for i in 0..300 {
        let [a, b, c, d] = [1, 2, 4, 3].map(|k| (2 * i + k - 1) % 600 + 1);
        writeln!(tube, "f {a} {b} {c} {d}").unwrap();
    }
    let folder = folder(&[("tube.obj", &tube), ("statue.obj", &statue().text)]);
    let said = |line: &str| {
        words(&done(
            folder.path(),
            &split(&format!("render {line} --size 8x8 --spp 1 -o x.exr")),
        ))
    };
    let line = "shading: triangles without normals look faceted (--smooth 40 rounds them)";
    assert!(said("tube.obj").contains(line));
    assert!(!said("tube.obj --smooth 40").contains(line));
    assert!(!said("statue.obj").contains(line));
}

/// All backends choose the same camera and light for real scenes.
#[test]
#[cfg(all(feature = "embree", feature = "obvhs"))]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn backends_guess_the_same_of_real_scenes() {
    use crate::support::shared;
    let folder = folder(&[]);
    for scene in [
        "meshes/suzanne.obj",
        "meshes/nefertiti.obj",
        "meshes/stanford-bunny.obj",
        "cornell-box-mcguire/CornellBox-Sphere.obj",
        "kitchen-blender/kitchen.obj",
        "sponza-dabrovic/sponza.obj",
    ] {
        let path = shared(&format!("scenes/{scene}"));
        let [embree, obvhs] = ["embree", "obvhs"].map(|backend| {
            let more = ["--backend", backend, "--denoise=off"];
            guessed(folder.path(), path.to_str().unwrap(), &more)
        });
        assert!(embree.len() >= 2, "{embree:?}");
        assert_eq!(embree, obvhs, "{scene}");
    }
}

/// Any thread count and backend chooses the same camera. The printed camera flags give the same
/// image.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn threads_and_backends_change_no_guess() {
    let folder = folder(&[("statue.obj", &statue().text), ("room.obj", &room(&[]))]);
    for scene in ["statue.obj", "room.obj"] {
        let render = |more: &[&str]| {
            let args = [&["render", scene, "--size", "16x16", "--spp", "1", "-o", "x.exr"], more].concat();
            let said = words(&done(folder.path(), &args));
            let line = said.lines().skip_while(|line| !line.starts_with("camera: ")).nth(1);
            let bytes = std::fs::read(folder.path().join("x.exr")).unwrap();
            (line.map(|line| line.trim().to_string()), bytes)
        };
        let (flags, _) = render(&[]);
        let flags = flags.unwrap();
        assert_eq!(render(&["--threads", "1"]).0.unwrap(), flags);
        assert_eq!(render(&["--backend", "brute"]).0.unwrap(), flags);
        // The printed numbers define the camera exactly: the scene has the same hash.
        let said: Vec<&str> = flags.split(' ').collect();
        let hash = |args: &[&str]| {
            let args = [
                &[
                    "render", scene, "--size", "16x16", "--spp", "1", "-o", "x.exr", "--stats", "s.json", "-q",
                ],
                args,
            ]
            .concat();
            done(folder.path(), &args);
            crate::support::program::read_json(&folder.path().join("s.json"))["scene_hash"].clone()
        };
        assert_eq!(hash(&said), hash(&[]));
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn camera_flags_modify_the_guess() {
    let folder = folder(&[("statue.obj", &statue().text)]);
    let folder = folder.path();
    let of = |args: &[&str]| {
        let render = ["render", "statue.obj", "--size", "8x8", "--spp", "1", "-o", "x.exr"];
        let said = words(&done(folder, &[&render, args].concat()));
        let flags = said
            .lines()
            .skip_while(|line| !line.starts_with("camera: "))
            .nth(1)
            .unwrap()
            .trim()
            .to_string();
        let of = |name: &str| {
            let list = flags.split(' ').skip_while(|word| *word != name).nth(1);
            list.map(|list| list.split(',').map(|n| n.parse::<f64>().unwrap()).collect::<Vec<_>>())
        };
        (of("--position").unwrap(), of("--look-at").unwrap(), of("--up"))
    };
    let along = |args: &[&str]| {
        let (eye, target, _) = of(args);
        let way: Vec<f64> = (0..3).map(|i| eye[i] - target[i]).collect();
        let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
        [way[0] / length, way[1] / length, way[2] / length]
    };
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 5e-3);
    for (args, expected) in [
        (["--view", "front"], [0.0, 0.0, 1.0]),
        (["--view", "back"], [0.0, 0.0, -1.0]),
        (["--view", "left"], [-1.0, 0.0, 0.0]),
        (["--view", "right"], [1.0, 0.0, 0.0]),
        (["--view", "top"], [0.0, 1.0, 0.0]),
        (["--view", "iso"], [0.577, 0.577, 0.577]),
        (["--orbit", "90,0"], [1.0, 0.0, 0.0]),
        (["--orbit", "-90,0"], [-1.0, 0.0, 0.0]),
        (["--orbit", "0,90"], [0.0, 1.0, 0.0]),
        (["--orbit", "180,30"], [0.0, 0.5, -0.866]),
    ] {
        let found = along(&args);
        assert!(near(found, expected), "{args:?}: {found:.3?}");
    }
    // At a given distance, cameras of all azimuths orbit one point.
    let (eye, pivot, _) = of(&["--orbit", "0,0,10"]);
    assert!((eye[2] - pivot[2] - 10.0).abs() < 1e-2);
    for azimuth in [40, 75, 170] {
        assert_eq!(of(&["--orbit", &format!("{azimuth},20,10")]).1, pivot);
    }
    // `--up` without other camera flags rotates the guessed camera.
    let (eye, target, up) = of(&["--up", "0,0,1"]);
    assert_eq!(up.unwrap(), [0.0, 0.0, 1.0]);
    assert!(eye[2] > target[2]);
    // With only a position, the camera faces the middle of the scene. With only a target, the
    // camera is on the guessed side.
    let (eye, target, _) = of(&["--position", "0,1,9"]);
    assert_eq!(eye, [0.0, 1.0, 9.0]);
    assert!(
        target
            .iter()
            .zip([0.0, 1.1, 0.0])
            .all(|(a, b): (&f64, f64)| (a - b).abs() < 0.3),
        "{target:.2?}"
    );
    assert_eq!(of(&["--look-at", "0,2,0"]).1, [0.0, 2.0, 0.0]);
}

#[test]
fn camera_keys_modify_the_guess() {
    let scene = |camera: &str| format!("version = 1\n[camera]\n{camera}\n[[object]]\nobj = \"statue.obj\"\n");
    let folder = folder(&[("statue.obj", &statue().text)]);
    let info = |keys: &str| {
        std::fs::write(folder.path().join("s.toml"), scene(keys)).unwrap();
        camera(folder.path(), "s.toml")
    };
    assert_eq!(info("vertical_fov = 20")["vertical_fov"], 20.0);
    assert_eq!(vector(&info("up = [0, 0, 1]")["up"]), [0.0, 0.0, 1.0]);
    assert!((angles(&info("view = \"right\"")).0 - 90.0).abs() < 0.1);
    assert!((angles(&info("orbit = [45, 10]")).0 - 45.0).abs() < 0.1);
    assert_eq!(vector(&info("position = [0, 1, 9]")["position"]), [0.0, 1.0, 9.0]);

    // Invalid keys are errors
    for (keys, expected) in [
        (
            "view = \"side\"",
            "choose among auto, front, back, left, right, top, iso, inside",
        ),
        (
            "orbit = [1]",
            "orbit = [1]\n  help: use an azimuth, an elevation between -90 and 90",
        ),
        ("orbit = [0, 100]", "an elevation between -90 and 90"),
        ("orbit = [0, 10, 0]", "a distance above 0"),
        ("view = \"top\"\norbit = [0, 10]", "both `orbit` and `view`"),
        ("view = \"top\"\nposition = [0, 1, 2]", "both `position` and `view`"),
    ] {
        std::fs::write(folder.path().join("s.toml"), scene(keys)).unwrap();
        let said = refused(folder.path(), &["info", "s.toml"], 1);
        assert!(said.contains(expected) && said.contains("s.toml:"), "{keys}: {said}");
    }
}

#[test]
fn invalid_camera_flags_are_errors() {
    let folder = folder(&[("statue.obj", &statue().text)]);
    let wrong = |args: &[&str]| refused(folder.path(), &[&["render", "statue.obj"], args].concat(), 2);
    assert!(wrong(&["--view", "side"]).contains("front, back, left, right, top, iso, inside"));
    assert!(wrong(&["--orbit", "1"]).contains("--orbit 1\n  help: use an azimuth, an elevation"));
    assert!(wrong(&["--orbit", "0,91"]).contains("between -90 and 90"));
    assert!(wrong(&["--view", "top", "--position", "0,0,1"]).contains("cannot be used with"));
    assert!(wrong(&["--orbit", "0,0", "--view", "top"]).contains("cannot be used with"));
    assert!(wrong(&["--focus-at", "1,1", "--focus-distance", "2"]).contains("cannot be used with"));
}

/// The focus distance at a pixel is the depth of the surface there.
#[test]
fn focus_at_a_pixel() {
    let wall = Boxes::default().add([-9.0, -9.0, -5.0], [9.0, 9.0, -4.0]).text;
    let folder = folder(&[("wall.obj", &wall)]);
    let hash = |args: &[&str]| {
        let base = [
            "render", "wall.obj", "--size", "8x8", "--spp", "1", "-o", "x.exr", "--stats", "s.json", "-q",
        ];
        let lens = ["--position", "0,0,0", "--look-at", "0,0,-1", "--lens-radius", "0.1"];
        done(folder.path(), &[&base[..], &lens, args].concat());
        crate::support::program::read_json(&folder.path().join("s.json"))["scene_hash"].clone()
    };
    assert_eq!(hash(&["--focus-at", "1,6"]), hash(&["--focus-distance", "4"]));
    assert_ne!(hash(&["--focus-distance", "4"]), hash(&[]));
    let outside = "render wall.obj --size 8x8 --spp 1 -o x.exr --focus-at 9,6";
    let said = refused(folder.path(), &split(outside), 2);
    let expected = "--focus-at 9,6\n  help: choose a point inside the image, from 0,0 to 8,8";
    assert!(said.contains(expected), "{said}");

    // The distance is printed, and with `-v` the camera too.
    let lens = "--position 0,0,0 --look-at 0,0,-1 --lens-radius 0.1 --size 8x8 --spp 1 -o x.exr --stats s.json";
    let said = |flags: &str| words(&done(folder.path(), &split(&format!("render wall.obj {lens} {flags}"))));
    let at_pixel = said("--focus-at 1,6 -v");
    for expected in [
        "focus: at a distance of 4, by --focus-at 1,6\n",
        "camera: at [0, 0, 0] towards [0, 0, -1], vertical field of view 40 degrees, lens radius 0.1, in focus at a distance of 4\n",
    ] {
        assert!(at_pixel.contains(expected), "{at_pixel}");
    }
    let stats = crate::support::program::read_json(&folder.path().join("s.json"));
    assert!(
        (stats["focus_distance"].as_f64().unwrap() - 4.0).abs() < 1e-5,
        "{stats}"
    );
    let by_flag = said("--focus-distance 4");
    assert!(
        !by_flag.contains("focus: ") && !by_flag.contains("lens radius"),
        "{by_flag}"
    );
}

/// `info` of a bare OBJ has the light of `render`.
#[test]
fn info_has_the_guessed_light() {
    let folder = folder(&[
        ("statue.obj", &statue().text),
        ("open.obj", &room(&["+z"])),
        ("closed.obj", &room(&[])),
    ]);
    let folder = folder.path();
    for scene in ["statue.obj", "open.obj", "closed.obj"] {
        let line = format!("render {scene} --size 8x8 --spp 1 -o x.exr --dump-scene d.toml");
        let said = words(&done(folder, &split(&line)));
        let light = said.lines().find_map(|line| line.strip_prefix("light: ")).unwrap();
        let info = |scene: &str| json(&done(folder, &["info", scene, "--json"]));
        let [bare, written] = [scene, "d.toml"].map(info);
        assert_eq!(bare["light_guess"], light, "{bare:#}");
        assert_eq!(bare["lights"], written["lights"], "{scene}");
        assert_eq!(bare["lights"]["constant"], 0, "{scene}");
        assert_eq!(
            (&bare["warnings"], &written["light_guess"]),
            (&written["warnings"], &Value::Null)
        );
        let text = printed(&done(folder, &["info", scene]));
        assert!(text.contains(&format!("guessed: {light}\n")), "{text}");
    }
    // If flags define the light, no light is guessed.
    let info = json(&done(folder, &split("info statue.obj --json --env white")));
    assert_eq!(
        (&info["light_guess"], &info["lights"]["constant"]),
        (&Value::Null, &1.into())
    );
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn views_are_listed_and_drawn() {
    let folder = folder(&[("statue.obj", &statue().text), ("room.obj", &room(&[]))]);
    for scene in ["statue.obj", "room.obj"] {
        let args = ["views", scene, "-o", "sheet.png", "--size", "16x16", "--spp", "1"];
        let listed = printed(&done(folder.path(), &args));
        assert!((8..=12).contains(&listed.lines().count()), "{listed}");
        let sheet = std::fs::read(folder.path().join("sheet.png")).unwrap();
        assert!(sheet.starts_with(b"\x89PNG"));
        std::fs::remove_file(folder.path().join("sheet.png")).unwrap();
        // Each printed line of flags can be pasted after `render`. For the second scene, two lines
        // are tested.
        let pasted = if scene == "statue.obj" { usize::MAX } else { 2 };
        for line in listed.lines().take(pasted) {
            let flags: Vec<&str> = line.split_whitespace().skip(1).collect();
            done(
                folder.path(),
                &[
                    &["render", scene, "--size", "8x8", "--spp", "1", "-o", "x.exr"],
                    &flags[..],
                ]
                .concat(),
            );
        }
        let list = json(&done(folder.path(), &["views", scene, "--json"]));
        assert_eq!(list.as_array().unwrap().len(), listed.lines().count());
    }
    assert!(refused(folder.path(), &["views", "none.obj"], 1).contains("none.obj"));
    assert!(refused(folder.path(), &["views", "room.obj", "-o", "room.obj"], 2).contains("would overwrite"));
}

/// Number of blue pixels in each half of the plan of `text`, a room, and number of yellow pixels.
fn signs_of_plan(text: &str) -> ([usize; 2], usize) {
    let folder = folder(&[("room.obj", text)]);
    let line = "views room.obj -q -o sheet.png --size 16x16 --spp 1";
    done(folder.path(), &split(line));
    let decoder = png::Decoder::new(std::io::BufReader::new(
        std::fs::File::open(folder.path().join("sheet.png")).unwrap(),
    ));
    let mut reader = decoder.read_info().unwrap();
    let mut codes = vec![0; reader.output_buffer_size().unwrap()];
    let width = reader.next_frame(&mut codes).unwrap().width as usize;
    // The plan has 452 rows and 312 columns, behind a margin of 12 pixels.
    let plan = (12..464).flat_map(|y| (12..324).map(move |x| (x, y)));
    let (mut blue, mut yellow) = ([0; 2], 0);
    for (x, y) in plan {
        let at = 3 * (y * width + x);
        match codes[at..at + 3] {
            [r, _, b] if b > 230 && r < 90 => blue[usize::from(x >= 168)] += 1,
            [255, _, 0] => yellow += 1,
            _ => {}
        }
    }
    (blue, yellow)
}

/// A room without a wall at +x has an opening at the right edge of its plan, and sunlight. A closed
/// room has neither.
#[test]
fn plan_shows_openings_and_sun() {
    let ([left, right], yellow) = signs_of_plan(&room(&["+x"]));
    assert!(left == 0 && right > 500 && yellow > 200, "{left} {right} {yellow}");
    assert_eq!(signs_of_plan(&room(&[])), ([0; 2], 0));
}

/// Message of a render about its guessed light.
fn light(folder: &Path, args: &[&str]) -> Option<String> {
    let said = words(&done(
        folder,
        &[&["render"], args, &["--size", "8x8", "--spp", "1", "-o", "x.exr"]].concat(),
    ));
    let line = said.lines().find_map(|line| line.strip_prefix("light: "));
    line.map(String::from)
}

#[test]
fn light_is_guessed_for_unlit_scenes() {
    // A room with a window in its wall at x = 2. The wall is made of four slabs around the window.
    let slabs = [
        ([2.0, 0.0, -3.0], [2.1, 2.6, -1.0]),
        ([2.0, 0.0, 1.0], [2.1, 2.6, 3.0]),
        ([2.0, 0.0, -1.0], [2.1, 0.9, 1.0]),
        ([2.0, 2.0, -1.0], [2.1, 2.6, 1.0]),
    ];
    let windowed = slabs.iter().fold(
        Boxes::default()
            .room([-2.0, 0.0, -3.0], [2.0, 2.6, 3.0], &["+x"])
            .add([-0.8, 0.0, -1.6], [0.4, 0.8, -0.6]),
        |boxes, (min, max)| boxes.add(*min, *max),
    );
    // An object with a lamp, and rooms with a lamp below the ceiling and in a cupboard
    let lamp = |boxes: Boxes, min, max| {
        let plain = boxes.text.len();
        let text = boxes.add(min, max).text;
        let (plain, lamp) = text.split_at(plain);
        format!("mtllib lamp.mtl\n{plain}usemtl lamp\n{lamp}")
    };
    let closed = || Boxes::default().room([-2.0, 0.0, -3.0], [2.0, 2.6, 3.0], &[]);
    let eye = lamp(statue(), [-0.05, 1.2, 0.3], [0.05, 1.25, 0.32]);
    let lit = lamp(closed(), [-0.4, 2.5, -0.4], [0.4, 2.55, 0.4]);
    let dark = lamp(
        closed().add([0.5, 0.0, -2.9], [1.9, 2.0, -1.5]),
        [1.0, 0.5, -2.5],
        [1.5, 0.6, -2.0],
    );
    let window_lamp = windowed.text.len();
    let (windowed, glow) = {
        let glowing = windowed.add([-1.99, 1.0, 0.0], [-1.98, 1.02, 0.02]).text;
        let (windowed, glow) = glowing.split_at(window_lamp);
        (
            windowed.to_string(),
            format!("mtllib lamp.mtl\n{windowed}usemtl lamp\n{glow}"),
        )
    };
    let folder = folder(&[
        ("statue.obj", &statue().text),
        ("closed.obj", &room(&[])),
        ("windowed.obj", &windowed),
        ("eye.obj", &eye),
        ("lit.obj", &lit),
        ("dark.obj", &dark),
        ("glow.obj", &glow),
        ("lamp.mtl", "newmtl lamp\nKe 1 1 1\n"),
        ("scene.toml", "version = 1\n[[object]]\nobj = \"statue.obj\"\n"),
    ]);
    let of = |args: &[&str]| light(folder.path(), args);
    assert!(of(&["statue.obj"]).unwrap().starts_with("a studio, and a ground"));
    assert!(of(&["statue.obj", "--no-ground"]).unwrap().starts_with("a studio ("));
    assert!(of(&["closed.obj"]).unwrap().starts_with("a lamp below the ceiling"));
    assert!(of(&["windowed.obj"]).unwrap().starts_with("sky and sun"));
    // If the lamps of a file light only a little of the scene, another light is guessed as well.
    assert!(of(&["eye.obj"]).unwrap().starts_with("a studio, and a ground"));
    let dark = of(&["dark.obj"]).unwrap();
    assert!(dark.starts_with("a lamp below the ceiling") && dark.contains("the lamps of the file light little"));
    assert!(!of(&["closed.obj"]).unwrap().contains("lamps of the file"));
    assert!(of(&["glow.obj"]).unwrap().starts_with("sky and sun"));
    // If an integrator does not support a ground, the scene gets no ground.
    assert!(
        of(&["statue.obj", "--integrator", "bdpt"])
            .unwrap()
            .starts_with("a studio (")
    );
    // Nothing is guessed if a light is given.
    for args in [
        &["lit.obj"][..],
        &["statue.obj", "--env", "white"],
        &["statue.obj", "--sun", "10,40"],
        &["statue.obj", "--key-light"],
        &["statue.obj", "--set", "light.0.type=sky"],
        &["scene.toml"],
    ] {
        assert_eq!(of(args), None, "{args:?}");
    }
}

/// The dumped scene has the guesses, and renders the same bits.
#[test]
fn guesses_are_written_with_the_scene() {
    let folder = folder(&[("statue.obj", &statue().upended()), ("closed.obj", &room(&[]))]);
    for (scene, sections) in [
        (
            "statue.obj",
            &["type = \"studio\"", "[ground]", "background = \"gradient"][..],
        ),
        ("closed.obj", &["type = \"rectangle\""]),
    ] {
        let size = ["--size", "16x16", "--spp", "2", "-q"];
        done(
            folder.path(),
            &[&["render", scene, "--dump-scene", "d.toml", "-o", "a.exr"], &size[..]].concat(),
        );
        let text = std::fs::read_to_string(folder.path().join("d.toml")).unwrap();
        assert!(sections.iter().all(|section| text.contains(section)), "{text}");
        done(
            folder.path(),
            &[&["render", "d.toml", "-o", "b.exr"], &size[..]].concat(),
        );
        let [a, b] = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
        assert_same_bits(&a, &b);
        std::fs::remove_file(folder.path().join("d.toml")).unwrap();
    }
}

/// The lamp of a closed room is not within the gallery that the camera looks at from the side.
#[test]
fn lamp_is_in_the_open_and_not_in_a_gallery() {
    let hall = Boxes::default()
        .room([-3.0, 0.0, -2.0], [9.0, 4.0, 2.0], &[])
        .add([-1.0, 1.95, -2.0], [9.0, 2.05, 2.0])
        .text;
    let folder = folder(&[("hall.obj", &hall)]);
    let line = "render hall.obj --size 8x8 --spp 1 --dump-scene d.toml -q -o x.exr";
    done(folder.path(), &split(line));
    let text = std::fs::read_to_string(folder.path().join("d.toml")).unwrap();
    let (_, light) = text.split_once("type = \"rectangle\"\nposition = [").unwrap();
    let height: f32 = light.split(", ").nth(1).unwrap().parse().unwrap();
    assert!(!(1.9..2.1).contains(&height), "{text}");
    let lit = read_rgb(&folder.path().join("x.exr"));
    assert!(lit.iter().flatten().any(|&x| x > 0.01), "{lit:?}");
}
