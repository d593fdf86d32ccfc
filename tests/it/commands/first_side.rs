//! Up axis, front and frame of the first image, guessed from the text of a file and from its
//! shapes.

use super::guess::{Boxes, camera, turned, vector};
use crate::support::program::{self, done, folder, split, write_grey_png};
use std::fmt::Write;

/// Azimuth of the camera around its target, in degrees from +z towards +x, and the message of the
/// guess. +y is up.
fn seen(text: &str) -> (f64, String) {
    let folder = folder(&[("a.obj", text)]);
    let camera = camera(folder.path(), "a.obj");
    let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
    let azimuth = (eye[0] - target[0]).atan2(eye[2] - target[2]).to_degrees();
    (azimuth, camera["guess"].as_str().unwrap().into())
}

fn up(text: &str) -> [f64; 3] {
    let folder = folder(&[("a.obj", text)]);
    vector(&camera(folder.path(), "a.obj")["up"])
}

/// Difference of two azimuths in degrees.
fn apart(a: f64, b: f64) -> f64 {
    ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs()
}

/// A solid of revolution around the z axis, scaled in x and y. `radii` has the radius and z of each
/// ring.
fn rings(radii: &[(f32, f32)], [wide, high]: [f32; 2]) -> String {
    const AROUND: usize = 16;
    let mut text = String::new();
    for (radius, z) in radii {
        for i in 0..AROUND {
            let (sin, cos) = (std::f32::consts::TAU * i as f32 / AROUND as f32).sin_cos();
            writeln!(text, "v {} {} {z}", wide * radius * cos, high * radius * sin).unwrap();
        }
    }
    for ring in 1..radii.len() {
        for i in 0..AROUND {
            let corner = |ring: usize, i: usize| ring * AROUND + i % AROUND + 1;
            let (low, high) = (ring - 1, ring);
            let face = [corner(low, i), corner(low, i + 1), corner(high, i + 1), corner(high, i)];
            writeln!(text, "f {} {} {} {}", face[0], face[1], face[2], face[3]).unwrap();
        }
    }
    text
}

/// A chair: seat, back-rest at z = −0.25, and legs.
fn chair() -> Boxes {
    let mut chair = Boxes::default()
        .add([-0.25, 0.4, -0.25], [0.25, 0.46, 0.25])
        .add([-0.25, 0.46, -0.25], [0.25, 1.0, -0.2]);
    for (x, z) in [(-0.25, -0.25), (0.2, -0.25), (-0.25, 0.2), (0.2, 0.2)] {
        chair = chair.add([x, 0.0, z], [x + 0.05, 0.4, z + 0.05]);
    }
    chair
}

/// A figure of boxes with feet that point to +z.
fn figure() -> Boxes {
    let mut figure = Boxes::default()
        .add([-0.25, 0.9, -0.12], [0.25, 1.5, 0.12])
        .add([-0.12, 1.5, -0.12], [0.12, 1.8, 0.12]);
    for x in [-0.22, 0.06] {
        figure = figure
            .add([x, 0.0, -0.08], [x + 0.16, 0.9, 0.08])
            .add([x, 0.0, 0.08], [x + 0.16, 0.07, 0.22]);
    }
    figure
}

/// Declared axes of the file take precedence over its shapes.
#[test]
fn declared_axes_override_shapes() {
    let head = "# CoordSystemRUF: [+X,-Y,+Z]\n";
    let text = format!("{head}{}", turned(&chair().text, |[x, y, z]| [x, -y, -z]));
    assert_eq!(up(&text), [0.0, -1.0, 0.0]);
    let (azimuth, words) = seen(&text);
    // The chair faces −z. `seen` measures azimuths for +y up. If −y is up, −z has the azimuth 0.
    assert!(apart(azimuth, 180.0) < 60.0, "{azimuth}");
    assert!(words.contains("its front is at azimuth 0° as the file says"), "{words}");
    assert!(words.contains("-y is up as the file says"), "{words}");
    // A declared front takes precedence over the back-rest.
    let text = format!("# CoordSystemRUF: [+X,+Y,+Z]\n{}", chair().text);
    assert!(seen(&text).1.contains("its front is at azimuth 180° as the file says"));
}

/// A flat sheet textured as a playing field is horizontal, and one textured as a poster is
/// vertical.
#[test]
fn sheet_with_grass_texture_is_horizontal() {
    let sheet = |material: &str| {
        let corners = "v -40 -25 0\nv 40 -25 0\nv 40 25 0\nv -40 25 0\nvt 0 0\nvt 8 0\nvt 8 5\nvt 0 5\n";
        format!("{corners}usemtl {material}\nf 1/1 2/2 3/3 4/4\n")
    };
    assert_eq!(up(&sheet("field_grass")), [0.0, 0.0, 1.0]);
    assert_eq!(up(&sheet("poster")), [0.0, 1.0, 0.0]);
}

/// A fish along z is horizontal; a tower of the same shape on a wide base is vertical.
#[test]
fn slender_body_without_a_base_is_horizontal() {
    // The fish is not symmetric in height and along z, like real fish.
    let fish = rings(
        &[
            (0.0, -15.0),
            (0.6, -12.0),
            (2.0, -6.0),
            (3.4, 0.0),
            (3.0, 4.0),
            (1.4, 6.5),
            (0.0, 7.0),
        ],
        [0.7, 1.0],
    );
    let fins = "v 0 0 -15\nv 0 4 -17\nv 0 -4 -17\nv 0 3 1\nv 0 6 -2\nv 0 3 -4\nf 113 114 115\nf 116 117 118\n";
    assert_eq!(up(&(fish + fins)), [0.0, 1.0, 0.0]);
    let tower = Boxes::default()
        .add([-2.0, 0.0, -2.0], [2.0, 1.0, 2.0])
        .add([-1.0, 1.0, -1.0], [1.0, 14.0, 1.0])
        .add([-1.5, 14.0, -1.5], [1.5, 15.0, 1.5]);
    assert_eq!(up(&tower.upended()), [0.0, 0.0, 1.0]);
}

/// The front of a chair is the side of its seat. The front of a person is the direction of the
/// feet.
#[test]
fn seats_and_feet_give_the_front() {
    for model in [chair(), figure()] {
        for (turn, front) in [(0.0, 0.0), (180.0, 180.0), (90.0, 90.0)] {
            let (sin, cos) = f32::to_radians(turn).sin_cos();
            let text = turned(&model.text, |[x, y, z]| [cos * x + sin * z, y, cos * z - sin * x]);
            let (azimuth, words) = seen(&text);
            assert!(apart(azimuth, front) <= 75.0, "{azimuth} {front}: {words}");
            assert!(
                words.contains(&format!("; its front is at azimuth {front}°;")),
                "{words}"
            );
        }
    }
}

/// `boxes` with the side at +z turned to the azimuth `front`, in degrees, and the guess for it.
fn faces(text: &str, front: f32) {
    let (sin, cos) = front.to_radians().sin_cos();
    let text = turned(text, |[x, y, z]| [cos * x + sin * z, y, cos * z - sin * x]);
    let (azimuth, words) = seen(&text);
    assert!(apart(azimuth, front.into()) <= 75.0, "{azimuth} {front}: {words}");
    assert!(
        words.contains(&format!("; its front is at azimuth {front}°;")),
        "{front}: {words}"
    );
}

/// The front of an animal with a level back is the end at which its head overhangs its feet.
#[test]
fn head_in_front_of_the_feet_is_the_front() {
    let mut elephant = Boxes::default()
        .add([-0.4, 0.5, -0.9], [0.4, 1.2, 0.9])
        .add([-0.3, 0.6, 0.9], [0.3, 1.2, 1.35])
        .add([-0.08, 0.2, 1.35], [0.08, 1.0, 1.5])
        .add([-0.04, 0.5, -1.0], [0.04, 1.1, -0.9]);
    for (x, z) in [(-0.4, 0.6), (0.15, 0.6), (-0.4, -0.9), (0.15, -0.9)] {
        elephant = elephant.add([x, 0.0, z], [x + 0.25, 0.5, z + 0.3]);
    }
    for front in [0.0, 180.0, 90.0] {
        faces(&elephant.text, front);
    }
}

/// The front of a fish is its blunt end.
#[test]
fn blunt_end_of_a_fish_is_the_front() {
    let body = [
        (0.0, -12.0),
        (0.5, -11.0),
        (1.6, -7.0),
        (3.2, 0.0),
        (3.4, 4.0),
        (2.4, 7.0),
        (0.0, 8.0),
    ];
    let fins = "v 0 0 -11\nv 0 3 -15\nv 0 -2 -15\nv 0 3 3\nv 0 5 0\nv 0 2.5 -3\nf 113 114 115\nf 116 117 118\n";
    let fish = rings(&body, [0.6, 1.0]) + fins;
    for front in [0.0, 180.0, 90.0] {
        faces(&fish, front);
    }
}

/// The front of furniture with a flat back is its open side: a cupboard without doors, a sofa with
/// high arms, and a screen with a keyboard in front of it.
#[test]
fn open_side_is_the_front() {
    let cupboard = Boxes::default()
        .add([-0.5, 0.0, -0.25], [0.5, 2.0, -0.2])
        .add([-0.5, 0.0, -0.2], [-0.45, 2.0, 0.25])
        .add([0.45, 0.0, -0.2], [0.5, 2.0, 0.25])
        .add([-0.45, 0.0, -0.2], [0.45, 0.05, 0.25])
        .add([-0.45, 1.0, -0.2], [0.45, 1.05, 0.25])
        .add([-0.45, 1.95, -0.2], [0.45, 2.0, 0.25]);
    let sofa = Boxes::default()
        .add([-1.0, 0.0, -0.45], [1.0, 0.4, 0.45])
        .add([-1.0, 0.4, -0.45], [1.0, 0.9, -0.3])
        .add([-1.0, 0.4, -0.3], [-0.8, 0.85, 0.45])
        .add([0.8, 0.4, -0.3], [1.0, 0.85, 0.45]);
    let computer = Boxes::default()
        .add([-0.3, 0.12, -0.12], [0.3, 0.5, -0.08])
        .add([-0.04, 0.0, -0.15], [0.04, 0.2, -0.12])
        .add([-0.12, 0.0, -0.2], [0.12, 0.02, -0.02])
        .add([-0.25, 0.0, 0.1], [0.25, 0.03, 0.25]);
    for object in [cupboard, sofa, computer] {
        for front in [0.0, 180.0, 90.0] {
            faces(&object.text, front);
        }
    }
}

/// A leaning bust stands on its only flat end, the cut below its neck.
#[test]
fn cut_base_is_at_the_bottom() {
    let bust = [
        (0.0, -2.5),
        (1.3, -2.5),
        (1.0, -1.6),
        (0.6, -0.9),
        (0.8, -0.3),
        (1.1, 0.6),
        (1.2, 1.6),
        (0.9, 2.3),
        (0.0, 2.5),
    ];
    let leaning = |sign: f32| {
        let lean = move |[x, y, z]: [f32; 3]| [x, y + 0.9 * (z + 1.6).max(0.0), sign * z];
        turned(&rings(&bust, [0.8, 1.0]), lean)
    };
    assert_eq!(up(&leaning(1.0)), [0.0, 0.0, 1.0]);
    assert_eq!(up(&leaning(-1.0)), [0.0, 0.0, -1.0]);
}

/// Models of Blockbench face −z.
#[test]
fn blockbench_models_face_minus_z() {
    let cube = Boxes::default().add([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]).text;
    assert!(seen(&cube).1.contains("probably its front is at azimuth 0° (--orbit "));
    let (azimuth, words) = seen(&format!("# Made in Blockbench 4.8.1\n{cube}"));
    assert!(apart(azimuth, 180.0) < 60.0, "{words}");
    assert!(words.contains("; its front is at azimuth 180°;"), "{words}");
}

/// A ground that is much wider than the object does not set the frame of the image.
#[test]
fn wide_grounds_do_not_frame_the_object() {
    let mut text = String::new();
    let distance = |text: &str| {
        let folder = folder(&[("a.obj", text)]);
        let camera = camera(folder.path(), "a.obj");
        let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
        (0..3).map(|i| (eye[i] - target[i]).powi(2)).sum::<f64>().sqrt()
    };
    let alone = distance(&chair().text);
    for [x, z] in [[-3.0, -3.0], [-3.0, 3.0], [3.0, 3.0], [3.0, -3.0]] {
        writeln!(text, "v {x} -0.001 {z}").unwrap();
    }
    let ground = |size: f32| turned(&text, |[x, y, z]| [size * x, y, size * z]) + "f -4 -3 -2 -1\n";
    let on_ground = |size: f32| distance(&(chair().text + &ground(size)));
    assert!(
        (on_ground(1.0) - alone).abs() < 0.1 * alone,
        "{} {alone}",
        on_ground(1.0)
    );
    // A narrow ground is a base. The base belongs to the object, so the frame includes it.
    assert!(on_ground(0.2) > 1.2 * alone, "{} {alone}", on_ground(0.2));
}

/// A furnished room without a ceiling is seen over the wall that hides least, from 35° above.
#[test]
fn rooms_without_a_ceiling_are_seen_from_above() {
    let house = Boxes::default()
        .add([-4.0, -0.2, -3.0], [4.0, 0.0, 3.0])
        // Add walls on all sides. The wall at −z is low
        .add([-4.0, 0.0, 2.8], [4.0, 3.0, 3.0])
        .add([-4.0, 0.0, -3.0], [-3.8, 3.0, 3.0])
        .add([3.8, 0.0, -3.0], [4.0, 3.0, 3.0])
        .add([-4.0, 0.0, -3.0], [4.0, 0.6, -2.8])
        .add([-2.0, 0.0, -1.0], [0.0, 0.8, 1.0])
        .add([2.0, 0.0, 1.0], [3.0, 2.0, 2.0]);
    let (azimuth, words) = seen(&house.text);
    assert!(apart(azimuth, 180.0) <= 60.0, "{words}");
    assert!(words.contains("elevation 35°"), "{words}");
}

/// Up axis of a file with the name `name`.
fn up_of(name: &str, text: &str) -> [f64; 3] {
    let folder = folder(&[(name, text)]);
    vector(&camera(folder.path(), name)["up"])
}

/// If a program always writes the same up axis, its files have this axis, for any shapes.
#[test]
fn fixed_up_axis_of_a_program_is_used() {
    let text = chair().upended();
    assert_eq!(up(&text), [0.0, 0.0, 1.0]);
    for head in [
        "# Apple ModelIO OBJ File: a\n",
        "# Blender 4.0.2\no Shape_IndexedFaceSet.001\n",
        "# OBJ Exported from DrPetter's Sculptris\n# symmetry 1\n",
        // Names of Google Blocks
        "mtllib materials.mtl\no group134438707\ng mesh134438707\n",
    ] {
        assert_eq!(up(&format!("{head}{text}")), [0.0, 1.0, 0.0], "{head}");
    }
    let head = "# Object Export From Tinkercad Server 2015\n";
    assert_eq!(up(&format!("{head}{}", chair().text)), [0.0, 0.0, 1.0]);
}

/// Low walls stand on the plane of x and y, which is the floor if the file is named after a
/// building. So +z is up.
#[test]
fn walls_of_a_flat_building_are_horizontal() {
    let mut walls = Boxes::default();
    for i in 0..6 {
        let x = 12.0 * i as f32;
        walls = walls
            .add([x, 0.0, 0.0], [x + 0.2, 49.0, 3.4])
            .add([0.0, 9.0 * i as f32, 0.0], [70.0, 9.0 * i as f32 + 0.2, 3.4]);
    }
    assert_eq!(up_of("building.obj", &walls.text), [0.0, 0.0, 1.0]);
    assert_eq!(up_of("floor_2.obj", &walls.text), [0.0, 0.0, 1.0]);
}

/// Letters in the plane of x and y stand if the file has the name of letters. Letters in the plane
/// of x and z were modelled on the ground if the program usually writes +y up. Their tops are then
/// at −z.
#[test]
fn letters_stand() {
    let mut letters = Boxes::default();
    for i in 0..6 {
        for row in [-2.0, 0.2] {
            let x = 1.2 * i as f32 - 3.6;
            letters = letters
                .add([x, row, 0.0], [x + 0.3, row + 1.6, 0.5])
                .add([x + 0.3, row + 1.3, 0.0], [x + 0.9, row + 1.6, 0.5])
                .add([x + 0.3, row + 0.5, 0.0], [x + 0.7, row + 0.8, 0.5]);
        }
    }
    assert_eq!(up_of("my_text.obj", &letters.text), [0.0, 1.0, 0.0]);
    assert_eq!(up_of("keys.obj", &letters.text), [0.0, 0.0, 1.0]);
    let mut row = Boxes::default();
    for i in 0..6 {
        let x = 1.2 * i as f32 - 3.6;
        row = row
            .add([x, 0.0, 0.0], [x + 0.3, 1.6, 0.3])
            .add([x + 0.3, 1.3, 0.0], [x + 0.9, 1.6, 0.3])
            .add([x + 0.3, 0.5, 0.0], [x + 0.7, 0.8, 0.3]);
    }
    let lying = turned(&row.text, |[x, y, z]| [x, z, -y]);
    let lying = format!("# Blender v2.91.0 OBJ File: ''\n{lying}");
    assert_eq!(up_of("my_text.obj", &lying), [0.0, 0.0, -1.0]);
    assert_eq!(up_of("keys.obj", &lying), [0.0, 1.0, 0.0]);
}

/// The front of letters is their broad side, although the first letter is blunt like the head of a
/// fish. Letters are seen within 20 degrees of it.
#[test]
fn broad_side_of_letters_is_the_front() {
    let mut letters = Boxes::default();
    for ([x0, y0], [x1, y1]) in [
        ([0.3, 0.0], [0.4, 0.85]),
        ([0.0, 0.85], [0.7, 1.0]),
        ([0.8, 0.0], [1.15, 0.5]),
        ([1.3, 0.1], [1.6, 0.5]),
        ([1.75, 0.25], [2.0, 0.4]),
    ] {
        letters = letters.add([x0, y0, -0.1], [x1, y1, 0.1]);
    }
    let folder = folder(&[("a_text.obj", &letters.text)]);
    let camera = camera(folder.path(), "a_text.obj");
    let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
    let azimuth = (eye[0] - target[0]).atan2(eye[2] - target[2]).to_degrees();
    let words = camera["guess"].as_str().unwrap();
    assert!(apart(azimuth, 0.0) <= 20.5, "{azimuth}: {words}");
    assert!(words.contains("front is at azimuth 0°"), "{words}");
}

/// A plate with a hole and four similar sides stands, as emblems and windows do, if no program is
/// known.
#[test]
fn plate_with_similar_sides_stands() {
    let ring = Boxes::default()
        .add([-5.0, -5.0, -0.25], [5.0, -4.0, 0.25])
        .add([-5.0, 4.0, -0.25], [5.0, 5.0, 0.25])
        .add([-5.0, -4.0, -0.25], [-4.0, 4.0, 0.25])
        .add([4.0, -4.0, -0.25], [5.0, 4.0, 0.25]);
    assert_eq!(up(&ring.text), [0.0, 1.0, 0.0]);
}

/// A gem whose flat end is up is not turned over if the program usually writes +y up.
#[test]
fn gem_of_a_known_program_is_not_upside_down() {
    let gem = rings(&[(0.0, -0.8), (1.0, 0.0), (0.75, 0.25), (0.0, 0.25)], [1.0, 1.0]);
    let gem = turned(&gem, |[x, y, z]| [x, z, -y]);
    assert_eq!(up(&gem), [0.0, -1.0, 0.0]);
    assert_eq!(up(&format!("# Blender 4.2.8\n{gem}")), [0.0, 1.0, 0.0]);
}

/// The name of a row of statues does not exclude the axis along which the statues stand.
#[test]
fn names_of_several_things_exclude_no_axis() {
    let mut statues = Boxes::default();
    for i in 0..12 {
        let (x, z) = (6.0 * (i % 4) as f32, 6.0 * (i / 4) as f32);
        statues = statues
            .add([x, 0.0, z], [x + 1.5, 0.5, z + 1.5])
            .add([x + 0.4, 0.5, z + 0.4], [x + 1.1, 4.0, z + 1.1]);
    }
    assert_eq!(up_of("courtyardStatues.obj", &statues.text), [0.0, 1.0, 0.0]);
}

/// A few flat triangles far around all others do not set the frame, although they share corners
/// with the scene.
#[test]
fn far_grounds_do_not_frame_the_scene() {
    let town = |river: bool| {
        let mut town = Boxes::default();
        for i in 0..36 {
            let (x, z) = ((i % 6) as f32 * 20.0, (i / 6) as f32 * 20.0);
            town = town.add([x, 0.0, z], [x + 9.0, 6.0 + (i % 5) as f32, z + 9.0]);
        }
        let mut text = town.text;
        if river {
            text += "v -1500 0 -30\nv 0 0 -400\nf 1 -2 -1\n";
        }
        text
    };
    let distance = |text: &str| {
        let folder = folder(&[("a.obj", text)]);
        let camera = camera(folder.path(), "a.obj");
        let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
        (0..3).map(|i| (eye[i] - target[i]).powi(2)).sum::<f64>().sqrt()
    };
    let (alone, with_river) = (distance(&town(false)), distance(&town(true)));
    assert!((with_river - alone).abs() < 0.2 * alone, "{with_river} {alone}");
}

/// Distance of the camera from its target, and the message of the guess.
fn distance(text: &str) -> (f64, String) {
    let folder = folder(&[("a.obj", text)]);
    let camera = camera(folder.path(), "a.obj");
    let (eye, target) = (vector(&camera["position"]), vector(&camera["look_at"]));
    let distance = (0..3).map(|i| (eye[i] - target[i]).powi(2)).sum::<f64>().sqrt();
    (distance, camera["guess"].as_str().unwrap().into())
}

/// Stacks of boxes side by side, with one upright box each.
fn figures() -> Boxes {
    let mut figures = Boxes::default();
    for i in 0..4 {
        let x = 3.0 * i as f32;
        figures = figures
            .add([x, 0.0, 0.0], [x + 1.5, 1.0, 1.5])
            .add([x + 0.4, 1.0, 0.4], [x + 1.1, 3.0, 1.1])
            .add([x + 0.2, 3.0, 0.2], [x + 1.3, 3.5, 1.3]);
    }
    figures
}

/// A sheet that is bent upwards behind the objects does not set the frame. The camera stands at its
/// open side.
#[test]
fn backdrops_do_not_frame_the_scene() {
    let backdrop = |toward: f32| {
        let mut text = figures().text;
        // Profile of the sheet, from the open end to the top of its wall
        let profile = [(40.0, 0.0), (0.0, 0.0), (-18.0, 0.0), (-20.0, 2.0), (-20.0, 30.0)];
        for (z, y) in profile {
            for x in [-35.0, 45.0] {
                writeln!(text, "v {x} {y} {}", toward * z).unwrap();
            }
        }
        let first = text.lines().filter(|line| line.starts_with("v ")).count() - 9;
        for i in 0..4 {
            let a = first + 2 * i;
            writeln!(text, "f {} {} {} {}", a, a + 1, a + 3, a + 2).unwrap();
        }
        text
    };
    let (alone, _) = distance(&figures().text);
    for toward in [1.0, -1.0] {
        let (far, words) = distance(&backdrop(toward));
        assert!((0.6..1.6).contains(&(far / alone)), "{far} {alone}: {words}");
        assert!(words.contains("; its backdrop reaches beyond the view"), "{words}");
        let (azimuth, words) = seen(&backdrop(toward));
        let front = if toward > 0.0 { 0.0 } else { 180.0 };
        assert!(apart(azimuth, front) < 95.0, "{azimuth} {front}: {words}");
    }
}

/// A ground and a paved place on it are much wider than the objects on them.
#[test]
fn ground_below_a_paved_place_does_not_frame_the_scene() {
    let sheet = |text: &mut String, half: f32, y: f32| {
        for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)] {
            writeln!(text, "v {} {y} {}", 5.0 + half * x, half * z).unwrap();
        }
        text.push_str("f -4 -3 -2 -1\n");
    };
    let mut text = figures().text;
    let (alone, _) = distance(&text);
    sheet(&mut text, 20.0, -0.01);
    sheet(&mut text, 50.0, -0.02);
    let (far, words) = distance(&text);
    assert!((0.6..1.6).contains(&(far / alone)), "{far} {alone}: {words}");
    assert!(words.contains("; its ground reaches beyond the view"), "{words}");
}

/// A stray corner far below a wide ground does not move the guessed ground down, and does not hide
/// that the wide ground is low.
#[test]
fn stray_corners_below_a_ground_are_ignored() {
    let mut town = Boxes::default();
    for i in 0..36 {
        let (x, z) = ((i % 6) as f32 * 20.0, (i / 6) as f32 * 20.0);
        town = town.add([x, 0.0, z], [x + 9.0, 6.0 + (i % 5) as f32, z + 9.0]);
    }
    let (alone, _) = distance(&town.text);
    let text = town.text
        + "v -600 -1 -600\nv -600 -1 700\nv 700 -1 700\nv 700 -1 -600\nf -4 -3 -2 -1\n\
                            v 400 -180 400\nv 300 0 100\nv 250 0 100\nf -3 -2 -1\n";
    let (far, words) = distance(&text);
    assert!((0.6..1.6).contains(&(far / alone)), "{far} {alone}: {words}");
    assert!(words.contains("; its ground reaches beyond the view"), "{words}");
    let folder = folder(&[("a.obj", &text)]);
    done(folder.path(), &split("init a.obj -o i.toml"));
    let written = std::fs::read_to_string(folder.path().join("i.toml")).unwrap();
    let (_, ground) = written.split_once("[ground]").unwrap();
    let point = ground
        .lines()
        .find(|line| line.trim_start().starts_with("point"))
        .unwrap();
    let y: f64 = point.split(',').nth(1).unwrap().trim().parse().unwrap();
    assert!((-3.0..-0.9).contains(&y), "{point}");
}

/// Eyes are at the front, and a tail is at the back.
#[test]
fn part_names_give_the_front() {
    for (name, z, front) in [
        ("Eyes", 1.0, 0.0),
        ("Eyes", -1.1, 180.0),
        ("tail_lamp", 1.0, 180.0),
        ("tail_lamp", -1.1, 0.0),
    ] {
        let mut head = Boxes::default().add([-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]);
        head.text += &format!("usemtl {name}\n");
        for x in [-0.6, 0.3] {
            head = head.add([x, 1.2, z], [x + 0.3, 1.5, z + 0.1]);
        }
        let (azimuth, words) = seen(&head.text);
        assert!(apart(azimuth, front) < 60.0, "{name} {z}: {words}");
        let expected = format!("; its front is at azimuth {front}°;");
        assert!(words.contains(&expected), "{name} {z}: {words}");
    }
}

/// The front of an animal on four legs is the side of its head, also with antlers that are wider
/// than its body.
#[test]
fn head_of_an_animal_is_in_front() {
    for (sign, front, has_antlers) in [(1.0, 0.0, false), (-1.0, 180.0, false), (-1.0, 180.0, true)] {
        let mut dog = Boxes::default();
        let mut add = |[x0, y0, z0]: [f32; 3], [x1, y1, z1]: [f32; 3]| {
            let (low, high) = (f32::min(sign * z0, sign * z1), f32::max(sign * z0, sign * z1));
            dog = std::mem::take(&mut dog).add([x0, y0, low], [x1, y1, high]);
        };
        add([-0.4, 0.5, -0.8], [0.4, 1.0, 0.9]);
        add([-0.25, 1.0, 0.6], [0.25, 1.6, 1.2]);
        for (x, z) in [(-0.4, 0.7), (0.2, 0.7), (-0.4, -0.8), (0.2, -0.8)] {
            add([x, 0.0, z], [x + 0.2, 0.5, z + 0.2]);
        }
        if has_antlers {
            for x in [-0.55, 0.25] {
                add([x, 2.0, 0.8], [x + 0.3, 2.05, 0.85]);
                add([x + 0.15, 1.6, 0.8], [x + 0.2, 2.0, 0.85]);
                add([x, 2.0, 0.7], [x + 0.03, 2.4, 1.1]);
            }
        }
        let (azimuth, words) = seen(&dog.text);
        assert!(apart(azimuth, front) <= 75.0, "{azimuth} {front}: {words}");
        assert!(
            words.contains(&format!("; its front is at azimuth {front}°;")),
            "{words}"
        );
    }
}

/// The front of an animal whose head is not higher than its back is the side to which its paws
/// point.
#[test]
fn paws_point_to_the_front() {
    for (sign, front) in [(1.0, 0.0), (-1.0, 180.0)] {
        let mut dog = Boxes::default().add([-0.4, 0.5, -1.0], [0.4, 1.0, 1.0]);
        for (x, z) in [(-0.4, 0.7), (0.2, 0.7), (-0.4, -0.9), (0.2, -0.9)] {
            let toes = if sign > 0.0 { [z, z + 0.32] } else { [z - 0.12, z + 0.2] };
            dog = dog
                .add([x, 0.05, z], [x + 0.2, 0.5, z + 0.2])
                .add([x, 0.0, toes[0]], [x + 0.2, 0.05, toes[1]]);
        }
        // Detail on the back
        for i in 0..12 {
            let (x, y) = (-0.35 + 0.18 * (i % 4) as f32, 0.55 + 0.14 * (i / 4) as f32);
            let z = if sign > 0.0 { [-1.06, -1.0] } else { [1.0, 1.06] };
            dog = dog.add([x, y, z[0]], [x + 0.1, y + 0.08, z[1]]);
        }
        let (azimuth, words) = seen(&dog.text);
        assert!(apart(azimuth, front) <= 75.0, "{azimuth} {front}: {words}");
        assert!(
            words.contains(&format!("; its front is at azimuth {front}°;")),
            "{words}"
        );
    }
}

/// The front of a car is the end with the lower bonnet.
#[test]
fn low_bonnet_is_the_front() {
    for (sign, front) in [(1.0, 0.0), (-1.0, 180.0)] {
        let mut car = Boxes::default();
        let mut add = |[x0, y0, z0]: [f32; 3], [x1, y1, z1]: [f32; 3]| {
            let (low, high) = (f32::min(sign * z0, sign * z1), f32::max(sign * z0, sign * z1));
            car = std::mem::take(&mut car).add([x0, y0, low], [x1, y1, high]);
        };
        add([-0.8, 0.3, -2.0], [0.8, 0.75, 2.0]);
        add([-0.7, 0.75, -1.6], [0.7, 1.4, 0.6]);
        add([-0.8, 0.75, -2.0], [0.8, 1.0, -1.6]);
        for (x, z) in [(-0.85, -1.3), (0.65, -1.3), (-0.85, 1.3), (0.65, 1.3)] {
            // Wheels are wider above the ground.
            add([x, 0.0, z - 0.1], [x + 0.2, 0.07, z + 0.1]);
            add([x, 0.07, z - 0.3], [x + 0.2, 0.6, z + 0.3]);
        }
        let (azimuth, words) = seen(&car.text);
        assert!(apart(azimuth, front) <= 75.0, "{azimuth} {front}: {words}");
        let expected = format!("; its front is at azimuth {front}°;");
        assert!(words.contains(&expected), "{words}");
    }
}

/// The gun of a tank points to its front.
#[test]
fn gun_of_a_tank_is_in_front() {
    let mut tank = Boxes::default();
    for x in [-0.9, 0.5] {
        tank = tank.add([x, 0.0, -1.6], [x + 0.4, 0.5, 1.6]);
    }
    let tank = tank
        .add([-0.8, 0.2, -1.2], [0.8, 0.75, 1.2])
        .add([-0.6, 0.75, -0.8], [0.6, 1.2, 0.5])
        .add([-0.06, 0.9, 0.5], [0.06, 1.0, 2.5]);
    for front in [0.0, 90.0, 180.0] {
        faces(&tank.text, front);
    }
}

/// Two machines with flat backs, which overhang their feet in front, are not a figure with toes at
/// the back. Their detailed side is the front.
#[test]
fn backs_of_machines_are_not_toes() {
    let mut machines = Boxes::default();
    for x in [-0.6, 0.1] {
        machines = machines
            .add([x, 0.0, 0.0], [x + 0.5, 0.08, 0.3])
            .add([x, 0.08, 0.0], [x + 0.5, 1.6, 0.4]);
        for i in 0..24 {
            let (u, v) = (0.12 * (i % 4) as f32, 0.2 * (i / 4) as f32);
            machines = machines.add([x + u, 0.3 + v, 0.4], [x + u + 0.06, 0.4 + v, 0.43]);
        }
    }
    for front in [0.0, 180.0] {
        faces(&format!("# Blender 4.2.8\n{}", machines.text), front);
    }
}

/// Eyes in a scene of several things do not show its front, if its halves differ from there.
#[test]
fn eyes_of_one_of_several_things_are_not_the_front() {
    let things = Boxes::default()
        .add([-5.0, 0.0, -0.5], [-4.0, 1.5, 0.5])
        .add([-1.0, 0.0, -2.5], [0.5, 3.0, -1.0])
        .add([2.0, 0.0, 0.2], [2.5, 2.0, 1.8])
        .add([4.0, 0.0, -1.0], [5.0, 0.8, 0.0]);
    let text = format!("{}g eyes\n", things.text);
    let things = Boxes { text, ..things };
    let text = things.add([-4.8, 1.0, 0.5], [-4.2, 1.2, 0.6]).text;
    let (_, words) = seen(&text);
    assert!(words.contains("front is at azimuth 0°"), "{words}");
}

/// Flat letters on a ground are seen from so far above that they can be read. A sheet without gaps
/// is seen from 40°.
#[test]
fn letters_on_a_ground_can_be_read() {
    let sheet = |gap: f32| {
        let mut letters = Boxes::default();
        for i in 0..6 {
            let x = i as f32 - 3.0;
            letters = letters
                .add([x, 0.0, -0.8], [x + 0.3, 0.02, 0.8])
                .add([x + 0.3, 0.0, 0.4 - gap], [x + 1.0 - gap, 0.02, 0.8])
                .add([x + 0.3, 0.0, -0.8], [x + 1.0 - gap, 0.02, -0.4 + gap]);
        }
        seen(&letters.text)
    };
    let (azimuth, words) = sheet(0.3);
    assert!(apart(azimuth, 0.0) < 1.0, "{azimuth}: {words}");
    assert!(words.contains("elevation 60°"), "{words}");
    let (_, words) = sheet(-0.3);
    assert!(words.contains("elevation 40°"), "{words}");
}

/// A wide and thin object, such as a shelf, is seen from near its front.
#[test]
fn plates_are_seen_from_near_their_front() {
    let mut shelf = Boxes::default()
        .add([-3.0, 0.0, 0.0], [3.0, 2.0, 0.1])
        .add([-3.0, 0.0, 0.1], [-2.9, 2.0, 0.8])
        .add([2.9, 0.0, 0.1], [3.0, 2.0, 0.8]);
    for i in 0..4 {
        let y = 0.6 * i as f32;
        shelf = shelf.add([-2.9, y, 0.1], [2.9, y + 0.1, 0.8]);
    }
    let (azimuth, words) = seen(&shelf.text);
    assert!(apart(azimuth, 0.0) <= 30.0, "{azimuth}: {words}");
    assert!(words.contains("elevation 15°"), "{words}");
}

/// A side that shows the backs of surfaces is not the front.
#[test]
fn side_with_backs_of_surfaces_is_not_the_front() {
    let seen_from = |are_backs: bool| {
        let mut wall = Boxes::default().add([-1.0, 0.0, -0.3], [1.0, 2.0, 0.3]);
        for i in 0..16 {
            let (x, y) = (-0.98 + 0.5 * (i % 4) as f32, 0.02 + 0.5 * (i / 4) as f32);
            wall = wall.add([x, y, -0.5], [x + 0.46, y + 0.46, -0.32]);
            let (min, max) = ([x, y, 0.32], [x + 0.46, y + 0.46, 0.5]);
            wall = match are_backs {
                true => wall.room(min, max, &[]),
                false => wall.add(min, max),
            };
        }
        seen(&wall.text).1
    };
    assert!(seen_from(false).contains("front is at azimuth 0°"));
    let words = seen_from(true);
    assert!(words.contains("front is at azimuth 180°"), "{words}");
}

/// A low body is seen from further above than a high one, so that it shows its top.
#[test]
fn low_bodies_are_seen_from_further_above() {
    let elevation = |height: f32| {
        let mut clock = Boxes::default().add([-1.0, 0.0, -1.0], [1.0, height, 1.0]);
        for i in 0..4 {
            let x = -0.8 + 0.4 * i as f32;
            clock = clock.add([x, height, -0.7], [x + 0.2, height + 0.05, 0.7]);
        }
        let (_, words) = seen(&clock.text);
        let (_, after) = words.split_once("elevation ").unwrap();
        let number: f32 = after.split('°').next().unwrap().parse().unwrap();
        number
    };
    assert!((25.0..=32.0).contains(&elevation(0.4)));
    assert!((18.0..=25.0).contains(&elevation(1.5)));
}

/// The front of a smooth body is the side with the most lively texture.
#[test]
fn texture_of_a_smooth_body_gives_the_front() {
    for (drawn, front) in [(0, 180), (1, 0)] {
        let mut text = String::from("mtllib a.mtl\nusemtl a\nvt 0.05 0.05\nvt 0.6 0.05\nvt 0.6 0.95\nvt 0.05 0.95\n");
        text += "vt 0.9 0.5\n";
        for i in 0..8 {
            let pick = |bit: u32, size: f32| if i >> bit & 1 == 0 { -size } else { size };
            writeln!(text, "v {} {} {}", pick(0, 1.0), pick(1, 2.0) + 2.0, pick(2, 0.4)).unwrap();
        }
        // The sides at −z and +z are first.
        let sides = [
            [1, 3, 4, 2],
            [5, 6, 8, 7],
            [1, 5, 7, 3],
            [2, 4, 8, 6],
            [1, 2, 6, 5],
            [3, 7, 8, 4],
        ];
        for (i, [a, b, c, d]) in sides.into_iter().enumerate() {
            let uvs = if i == drawn { [1, 2, 3, 4] } else { [5; 4] };
            let [e, f, g, h] = uvs;
            writeln!(text, "f {a}/{e} {b}/{f} {c}/{g} {d}/{h}").unwrap();
        }
        let folder = folder(&[("a.obj", &text), ("a.mtl", "newmtl a\nKd 1 1 1\nmap_Kd a.png\n")]);
        write_grey_png(
            &folder.path().join("a.png"),
            &[20, 230, 20, 230, 20, 230, 120, 120, 120],
        );
        let words = camera(folder.path(), "a.obj")["guess"].to_string();
        assert!(words.contains(&format!("front is at azimuth {front}°")), "{words}");
    }
}

/// The front of a car along x is one of its ends, not one of its long sides.
#[test]
fn long_side_is_not_the_front() {
    let mut car = Boxes::default()
        .add([-2.0, 0.3, -0.8], [2.0, 0.8, 0.8])
        .add([-0.4, 0.8, -0.7], [1.6, 1.4, 0.7]);
    for (x, z) in [(-1.5, -0.85), (-1.5, 0.65), (1.0, -0.85), (1.0, 0.65)] {
        car = car.add([x, 0.0, z], [x + 0.6, 0.6, z + 0.2]);
    }
    let (_, words) = seen(&car.text);
    assert!(
        words.contains("front is at azimuth 90°")
            || words.contains("front is at azimuth -90°")
            || words.contains("front is at azimuth 270°"),
        "{words}"
    );
}

/// The name of a file excludes axes: doors do not lie on their wide side, and cars do not stand on
/// their end.
#[test]
fn names_of_files_exclude_axes() {
    // A door with a handle, whose origin is in its middle
    let door = Boxes::default()
        .add([-0.47, -1.05, 0.0], [0.47, 1.05, 0.05])
        .add([0.3, -0.05, 0.05], [0.4, 0.05, 0.1])
        .add([-0.5, -1.1, -0.02], [-0.47, 1.1, 0.07]);
    let body = Boxes::default()
        .add([-0.9, -2.0, 0.0], [0.9, 2.0, 0.7])
        .add([-0.8, -1.2, 0.7], [0.8, 1.2, 1.3]);
    for (name, text, up) in [
        ("front_door.obj", &door.text, [0.0, 1.0, 0.0]),
        ("plate.obj", &door.text, [0.0, 0.0, 1.0]),
        ("racing_car2.obj", &body.text, [0.0, 0.0, 1.0]),
    ] {
        assert_eq!(up_of(name, text), up, "{name}");
    }
}

/// Names of parts raise an axis, as names of materials do. Eyes are in front as often as they are
/// high, so they raise no axis.
#[test]
fn names_of_parts_raise_an_axis() {
    let cube = Boxes::default().add([-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]);
    let with = |name: &str, low: [f32; 3], high: [f32; 3]| {
        let more = Boxes {
            text: format!("{}g {name}\n", cube.text),
            corners: cube.corners,
        };
        more.add(low, high).text
    };
    let on_top = ([-0.4, -0.4, 0.5], [0.4, 0.4, 0.52]);
    assert_eq!(up(&with("roof", on_top.0, on_top.1)), [0.0, 0.0, 1.0]);
    assert_eq!(up(&with("wheels", on_top.0, on_top.1)), [0.0, 0.0, -1.0]);
    assert_eq!(up(&with("eyes", on_top.0, on_top.1)), [0.0, 1.0, 0.0]);
}

/// A doubtful upright axis is printed with the flag for the second best.
#[test]
fn doubtful_axis_is_printed_with_the_next_best() {
    let cube = Boxes::default().add([-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]).text;
    let (_, words) = seen(&cube);
    assert!(words.contains("probably +y is up (--up 0,0,1 changes that)"), "{words}");
    // The last line of a render repeats the flag. It is missing if the flag is given.
    let folder = folder(&[("a.obj", &cube)]);
    let said = |flags: &str| {
        let line = format!("render a.obj --size 16x16 --spp 1 --denoise=off -o a.png {flags}");
        program::words(&done(folder.path(), &split(&line)))
    };
    let last =
        "note: +y is probably up: if the model lies on its side or is upside down, add --up 0,0,1 (or another axis)\n";
    assert!(said("").ends_with(last), "{}", said(""));
    assert!(!said("--up 0,0,1").contains("probably up"));
}
