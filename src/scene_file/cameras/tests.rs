use super::*;
use crate::camera::{Camera, CameraParameters, FisheyeMapping, Projection};
use crate::math::{Vec3, hash};
use crate::session::CameraSettings;
use std::fs;

const SIZE: UVec2 = UVec2::new(120, 80);
const ORIGIN: DVec3 = DVec3::new(1000.0, -2000.0, 0.5);

fn description(projection: Projection) -> CameraDescription {
    let parameters = CameraParameters {
        position: Vec3::new(1.0, 2.0, 3.0),
        look_at: Vec3::new(-2.0, 1.0, -4.0),
        up: Vec3::new(0.3, 1.0, 0.0),
        vertical_fov: 50.0,
        lens_radius: 0.0,
        focus_distance: 1.0,
    };
    CameraDescription {
        projection,
        stereo: None,
        ..CameraDescription::still(parameters)
    }
}

/// The camera from a file, in a scene whose origin is at [`ORIGIN`].
fn camera(file: &FileCamera, size: UVec2) -> Camera {
    let options = file.options(size).placed();
    let settings = CameraSettings {
        options: CameraOptions {
            position: options.position.map(|position| position - ORIGIN),
            look_at: options.look_at.map(|look_at| look_at - ORIGIN),
            ..options
        },
        ..CameraSettings::default()
    };
    settings.found(None, size).unwrap().camera
}

/// Largest difference between the rays of two cameras, at several points of a picture. The size of
/// the picture of `a` is `factor` times the size of the picture of `b`.
fn difference(a: &Camera, b: &Camera, factor: f32) -> f32 {
    let places = [[0.5, 0.5], [60.0, 40.0], [100.5, 20.0], [30.0, 77.0]].map(Vec2::from);
    let of = |place: Vec2| {
        let [first, second] = [
            a.ray(place * factor, Vec2::splat(0.5), 0.0),
            b.ray(place, Vec2::splat(0.5), 0.0),
        ];
        (first.origin - second.origin)
            .length()
            .max((first.direction - second.direction).length())
    };
    let seen = places.into_iter().filter(|place| b.sees(*place));
    seen.map(of).fold(0.0, f32::max)
}

fn projections() -> Vec<Projection> {
    let intrinsics = Intrinsics {
        focal: [90.0, 100.0],
        center: [50.0, 47.0],
    };
    vec![
        Projection::default(),
        Projection::Perspective {
            shift: Vec2::new(0.2, -0.3),
        },
        Projection::Calibrated {
            intrinsics,
            distortion: Distortion::Pinhole([-0.1, 0.02, 0.003, -0.004, 0.01]),
        },
        Projection::Calibrated {
            intrinsics,
            distortion: Distortion::Fisheye([0.05, -0.02, 0.01, 0.002]),
        },
        Projection::Fisheye {
            mapping: FisheyeMapping::Equidistant,
            fov: 180.0,
        },
        Projection::Panorama,
    ]
}

#[test]
fn written_cameras_have_the_same_rays_when_read() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["transforms.json", "sparse"] {
        let path = folder.path().join(name);
        let mut count = 0;
        for projection in projections() {
            let description = description(projection);
            let own = description.camera(SIZE).unwrap();
            let picture = format!("images/picture of {count}.png");
            let file = FileCamera::of(picture.clone(), &description, SIZE, ORIGIN);
            if let Err(error) = file.write(&path) {
                assert!(name == "sparse" && projection == Projection::Panorama, "{error}");
                continue;
            }
            // Write again: a camera of the same name is replaced
            file.write(&path).unwrap();
            count += 1;
            assert_eq!(FileCamera::read_all(&path).unwrap().len(), count);
            for asked in [picture.clone(), format!("picture of {}", count - 1)] {
                let read = FileCamera::read(&path, Some(&asked)).unwrap();
                assert_eq!((read.name.as_str(), read.size), (picture.as_str(), Some(SIZE)));
                let off = difference(&camera(&read, SIZE), &own, 1.0);
                assert!(off < 3e-4, "{name}: {projection:?} is off by {off}");
                let twice = difference(&camera(&read, 2 * SIZE), &own, 2.0);
                assert!(
                    twice < 3e-4,
                    "{name}: {projection:?}, twice as large, is off by {twice}"
                );
            }
        }
        assert!(count >= 5);
    }
}

/// All formats describe one camera at (1, 2, 3) that views along −x, with z up. Its picture is
/// square, with a field of view of 90°.
#[test]
fn cameras_of_all_formats_have_one_pose() {
    let folder = tempfile::tempdir().unwrap();
    let text = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        path
    };
    let half = 0.5;
    text("text/cameras.txt", "# comment\n7 SIMPLE_PINHOLE 40 40 20 20 20\n");
    let images = format!("# comment\n1 {half} {half} {half} -{half} -2 3 1 7 a picture.png\n10 20 -1 30 40 5\n");
    let model = text("text/images.txt", &images);
    let mut bytes = [1u64.to_le_bytes()].concat();
    bytes.extend([7u32, 0].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend([40u64, 40].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend([20.0f64; 3].iter().flat_map(|n| n.to_le_bytes()));
    fs::create_dir(folder.path().join("binary")).unwrap();
    fs::write(folder.path().join("binary/cameras.bin"), &bytes).unwrap();
    let mut bytes = [1u64.to_le_bytes()].concat();
    bytes.extend(1u32.to_le_bytes());
    bytes.extend(
        [half, half, half, -half, -2.0, 3.0, 1.0f64]
            .iter()
            .flat_map(|n| n.to_le_bytes()),
    );
    bytes.extend(7u32.to_le_bytes());
    bytes.extend(b"a picture.png\0");
    bytes.extend(1u64.to_le_bytes());
    bytes.extend([0; 24]);
    fs::write(folder.path().join("binary/images.bin"), &bytes).unwrap();
    let json = r#"{"camera_angle_x": 1.5707963267948966, "frames": [{"file_path": "./train/a picture",
        "transform_matrix": [[0, 0, 1, 1], [1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 0, 1]]}]}"#;
    let gltf = format!(
        r#"{{"asset": {{"version": "2.0"}}, "cameras": [{{"type": "perspective", "perspective": {{"yfov": 1.5707963267948966, "znear": 1}}}}],
        "nodes": [{{"name": "empty", "children": [1], "translation": [1, 2, 3], "scale": [3, 3, 3]}},
        {{"name": "a picture", "camera": 0, "rotation": [{half}, {half}, {half}, {half}]}}]}}"#
    );
    let mut binary = b"glTF".to_vec();
    let padded = format!("{gltf:width$}", width = gltf.len().next_multiple_of(4));
    for n in [2, 20 + padded.len(), padded.len()] {
        binary.extend((n as u32).to_le_bytes());
    }
    binary.extend(b"JSON");
    binary.extend(padded.as_bytes());
    fs::write(folder.path().join("scene.glb"), &binary).unwrap();
    let toml = "[[camera]]\nname = \"a picture\"\nposition = [1, 2, 3]\nlook_at = [0, 2, 3]\nup = [0, 0, 1]\nvertical_fov = 90\n";
    let csv = "name,position.x,position.y,position.z,look_at,up.x,up.y,up.z,vertical_fov\na picture,1,2,3,\"0,2,3\",0,0,1,90\n";
    let paths = [
        model.clone(),
        model.parent().unwrap().into(),
        folder.path().join("binary"),
        folder.path().join("scene.glb"),
        text("transforms.json", json),
        text("scene.gltf", &gltf),
        text("list.toml", toml),
        text("list.csv", csv),
    ];
    let parameters = CameraParameters {
        position: (DVec3::new(1.0, 2.0, 3.0) - ORIGIN).as_vec3a(),
        look_at: (DVec3::new(0.0, 2.0, 3.0) - ORIGIN).as_vec3a(),
        up: Vec3::Z,
        vertical_fov: 90.0,
        lens_radius: 0.0,
        focus_distance: 1.0,
    };
    let own = CameraDescription::still(parameters).camera(UVec2::splat(120)).unwrap();
    for path in paths {
        for name in [None, Some("a picture")] {
            let read = FileCamera::read(&path, name).unwrap();
            let off = difference(&camera(&read, UVec2::splat(120)), &own, 1.0);
            assert!(off < 2e-6, "{}: off by {off}", path.display());
        }
    }
}

#[test]
fn wrong_files_are_errors_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let matrix = r#"[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]"#;
    let two = format!(
        r#"{{"camera_angle_x": 1, "frames": [{{"file_path": "left.png", "transform_matrix": {matrix}}}, {{"file_path": "right.png", "transform_matrix": {matrix}}}]}}"#
    );
    let frame = |keys: &str, matrix: &str| format!(r#"{{{keys} "frames": [{{"transform_matrix": {matrix}}}]}}"#);
    for (name, text, camera, expected) in [
        ("a.json", "{\"frames\": [1]}".to_string(), None, "a.json:1"),
        ("a.json", "{\"frames\": []}".into(), None, "has no cameras"),
        (
            "a.json",
            two.clone(),
            None,
            "choose one with --camera: left.png, right.png",
        ),
        ("a.json", two, Some("lefft.png"), "did you mean left.png?"),
        ("a.json", frame("", matrix), None, "`w` and `h` are missing"),
        (
            "a.json",
            frame("\"w\": 10, \"h\": 10,", matrix),
            None,
            "`fl_x` and `camera_angle_x` are missing",
        ),
        ("a.json", frame("\"w\": 10.5, \"h\": 10,", matrix), None, "`w` is 10.5"),
        (
            "a.json",
            frame("\"w\": 9, \"h\": 9, \"fl_x\": -4,", matrix),
            None,
            "two focal lengths above 0",
        ),
        (
            "a.json",
            frame("\"camera_model\": \"FOV\",", matrix),
            None,
            "possible are OPENCV",
        ),
        (
            "a.json",
            frame("\"camera_angle_x\": 1,", "[[1, 0], [0, 1]]"),
            None,
            "rows of 4 numbers",
        ),
        (
            "a.json",
            frame("\"camera_angle_x\": 1,", "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0]]"),
            None,
            "singular",
        ),
        ("a.toml", "[[camera]]\nfocal = 3".into(), None, "a.toml:2"),
        ("a.toml", "[[camera]]\nvertical_fov = 300".into(), None, "a.toml:2"),
        ("a.toml", "[[camera]]\nname = 3".into(), None, "`name` is not a string"),
        ("a.toml", "[camera]\n".into(), None, "a.toml:1"),
        ("a.csv", "name,positoin\na,1".into(), None, "did you mean `position`?"),
        ("a.csv", "name,position\na,\"1,2\"".into(), None, "a.csv:2"),
        ("a.csv", "name,up\na,1,2,3".into(), None, "a.csv:2"),
        (
            "a.gltf",
            r#"{"nodes": [{"camera": 0}]}"#.into(),
            None,
            "there is no camera 0",
        ),
        (
            "a.gltf",
            r#"{"nodes": [{"camera": 0}], "cameras": [{}]}"#.into(),
            None,
            "neither a perspective",
        ),
        ("a.glb", "glTF".into(), None, "a.glb:1"),
        ("a.png", String::new(), None, "this is no camera file"),
        (
            "images.txt",
            "1 1 0 0 0 0 0 0 1 a.png\n\n".into(),
            None,
            "no COLMAP model",
        ),
        (
            "cameras.txt",
            "1 FOV 9 9 1 1 1 1 1".into(),
            None,
            "possible are SIMPLE_PINHOLE",
        ),
        (
            "cameras.txt",
            "1 PINHOLE 9 9 1 1 1".into(),
            None,
            "PINHOLE has 4 parameters, not 3",
        ),
        (
            "cameras.txt",
            "1 PINHOLE 9 x 1 1 1 1".into(),
            None,
            "`x` is not a whole number",
        ),
        (
            "cameras.txt",
            "# one\n2 PINHOLE 9 9 1 1 1 1".into(),
            None,
            "there is no camera 1",
        ),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, &text).unwrap();
        let error = FileCamera::read(&path, camera).unwrap_err();
        let words = error.to_string();
        assert!(words.contains(expected), "{text}: {words}");
        assert!(error.help.is_some(), "{words}");
    }
}

#[test]
fn formats_without_a_projection_refuse_it() {
    let folder = tempfile::tempdir().unwrap();
    let orthographic = Projection::Orthographic {
        height: 2.0,
        shift: Vec2::ZERO,
    };
    let file = FileCamera::of("a".into(), &description(orthographic), SIZE, DVec3::ZERO);
    for name in ["a.json", "folder"] {
        let error = file.write(&folder.path().join(name)).unwrap_err().to_string();
        assert!(
            error.contains("`orthographic`") && error.contains("--dump-scene"),
            "{error}"
        );
    }
    assert!(FileCamera::files(Path::new("a.txt")).is_err());
}

/// Files of every format with changed bytes give cameras or errors, but never a panic.
#[test]
fn damaged_files_are_cameras_or_errors() {
    let folder = tempfile::tempdir().unwrap();
    let file = FileCamera::of("a.png".into(), &description(Projection::default()), SIZE, ORIGIN);
    let json = folder.path().join("a.json");
    let model = folder.path().join("model");
    file.write(&json).unwrap();
    file.write(&model).unwrap();
    let gltf = folder.path().join("a.gltf");
    fs::write(
        &gltf,
        r#"{"cameras": [{"orthographic": {"ymag": 1}}], "nodes": [{"children": [1]}, {"camera": 0, "children": [0]}]}"#,
    )
    .unwrap();
    let csv = folder.path().join("a.csv");
    fs::write(&csv, "name,position.x,position.y,position.z\na,1,2,3\n").unwrap();
    for (path, changed) in [
        (&json, json.clone()),
        (&model, model.join("cameras.txt")),
        (&model, model.join("images.txt")),
        (&gltf, gltf.clone()),
        (&csv, csv.clone()),
    ] {
        let whole = fs::read(&changed).unwrap();
        assert!(FileCamera::read_all(path).is_ok());
        for seed in 0..300u64 {
            let mut bytes = whole.clone();
            let random = |n: u64| hash::mix(seed * 8 + n) as usize;
            bytes[random(0) % whole.len()] = b"\0\xff-9.e[]{},\" \n"[random(1) % 14];
            bytes.truncate(if seed % 4 == 0 {
                random(2) % whole.len()
            } else {
                whole.len()
            });
            fs::write(&changed, &bytes).unwrap();
            for camera in FileCamera::read_all(path).unwrap_or_default() {
                camera.options(SIZE);
            }
        }
        fs::write(&changed, &whole).unwrap();
    }
}
