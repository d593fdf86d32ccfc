use super::*;
use crate::options::MaxDepth;
use std::fs;

fn load(text: &str) -> Result<SceneFile, FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    fs::write(&path, text).unwrap();
    SceneFile::load(&path)
}

const OBJECT: &str = "[[object]]\nobj = \"a.obj\"\n";

#[test]
fn every_key_of_the_format_is_read() {
    let file = load(
        r#"version = 1
[camera]
position = [0, 1, 2.5]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov = 39.3
lens_radius = 0.1
focus_distance = 4
[image]
width = 640
height = 480
filter = "box"
[render]
samples = 64
max_depth = "none"
integrator = "path"
sampler = "independent"
seed = 18446744073709551615
[[object]]
obj = "a b.obj"
transform = { translate = [0, 0, 1], rotate = [0, 90, 0], scale = 2.0 }
[[object]]
obj = "c.obj"
matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[material."tall box"]
diffuse = [0.7, 0.7, 0.7]
specular = [0.2, 0.2, 0.2]
exponent = 90.0
transmission = [0.0, 0.0, 0.0]
ior = 1.5
emission = [0.0, 0.0, 0.0]
[[light]]
type = "point"
position = [0.0, 0.9, 0.0]
intensity = [1.0, 1.0, 1.0]
"#,
    );
    let file = file.unwrap();
    assert_eq!(file.options.camera.position.unwrap().z, 2.5);
    assert_eq!(file.options.integrator.max_depth, Some(MaxDepth(None)));
    assert_eq!(file.object.len(), 2);
    assert_eq!(file.material.keys().next().unwrap().get_ref(), "tall box");
}

#[test]
fn mistakes_are_named_with_their_line() {
    let cases = [
        (format!("version = 1\n{OBJECT}[image]\nwidht = 3\n"), 5, "widht"),
        (format!("version = 1\n{OBJECT}[image]\nwidth = \"a\"\n"), 5, "\"a\""),
        (format!("version = 1\n{OBJECT}[image]\nwidth = -3\n"), 5, "-3"),
        (
            format!("version = 1\n{OBJECT}[render]\nsamples = 3\nspp = 4\n"),
            6,
            "twice",
        ),
        (format!("version = 2\n{OBJECT}"), 1, "version 2"),
        (
            format!("version = 1\n{OBJECT}[render]\nmax_depth = \"deep\"\n"),
            5,
            "deep",
        ),
        ("version = 1\n[[object]\n".into(), 2, "]"),
    ];
    for (text, line, word) in cases {
        let error = load(&text).unwrap_err();
        assert_eq!(error.position.map(|p| p.line), Some(line), "{text}: {error}");
        assert!(error.message.contains(word), "{text}: {error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    fs::write(&path, b"version = 1\n# \xc3\xa4\xc3\nx").unwrap();
    let error = SceneFile::load(&path).unwrap_err();
    assert_eq!(
        error.position.map(|p| (p.line, p.column)),
        Some((2, Some(4))),
        "{error}"
    );
    assert!(load(OBJECT).unwrap_err().message.contains("version"));
    assert!(load("version = 1\n").unwrap_err().message.contains("object"));
}
