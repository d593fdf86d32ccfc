//! Camera attributes of EXR files. Their matrices project the point that a pixel sees to the centre
//! of the pixel.

use super::calibrated::room;
use crate::support::program::*;
use crate::support::read_channel;
use exr::prelude::{AttributeValue, LayerAttributes, Text, Vec2, read_first_flat_layer_from_file};
use std::path::Path;

const SIZE: [usize; 2] = [64, 48];
/// Maximum distance of a projected point from the centre of its pixel, in pixels.
const TOLERANCE: f64 = 1e-3;
/// Flags for samples at pixel centres.
const CENTERS: &str = "--aov P --filter box --filter-radius 1e-5";

fn attributes(path: &Path) -> LayerAttributes {
    read_first_flat_layer_from_file(path).unwrap().layer_data.attributes
}

fn number(attributes: &LayerAttributes, name: &str) -> Option<f32> {
    match attributes.other.get(&Text::from(name))? {
        AttributeValue::F32(value) => Some(*value),
        other => panic!("{name}: {other:?}"),
    }
}

/// Point as a row vector times the matrix, divided by the last component.
fn times(p: [f64; 3], m: [f32; 16]) -> [f64; 3] {
    let of = |column: usize| {
        let row = |row: usize, x: f64| x * f64::from(m[4 * row + column]);
        row(0, p[0]) + row(1, p[1]) + row(2, p[2]) + row(3, 1.0)
    };
    [0, 1, 2].map(|column| of(column) / of(3))
}

fn assert_points_lead_back(file: &Path, size: [usize; 2], flags: &str) {
    let attributes = attributes(file);
    let to_ndc = attributes.world_to_normalized_device.unwrap();
    let [px, py, pz] = ["P.X", "P.Y", "P.Z"].map(|name| read_channel(file, name));
    for i in 0..size[0] * size[1] {
        let [x, y, _] = times([px[i], py[i], pz[i]].map(f64::from), to_ndc);
        let center = [(i % size[0]) as f64 + 0.5, (i / size[0]) as f64 + 0.5];
        let distance = (size[0] as f64 * x - center[0]).hypot(size[1] as f64 * y - center[1]);
        assert!(
            distance < TOLERANCE,
            "{flags}: pixel {center:?} is {distance} pixels off"
        );
    }
}

#[test]
fn world_to_ndc_maps_points_to_their_pixels() {
    let folder = room();
    let place = "--position 1,2,3 --look-at -2,1,-4 --up 0.1,1,0.2";
    for flags in [
        format!("{place} --fov 70"),
        format!("{place} --fov 50 --shift 0.2,-0.3"),
        format!("{place} --projection orthographic --ortho-height 3 --shift 0.1,0.2"),
        format!("{place} --intrinsics 50,45,30,27"),
        "--pose opencv:1,0,0,1,0,-1,0,2,0,0,-1,3 --fov 60".to_string(),
    ] {
        let args = format!("render s.toml -q -o t.exr {CENTERS} {flags}");
        done(folder.path(), &split(&args));
        let file = folder.path().join("t.exr");
        assert_points_lead_back(&file, SIZE, &flags);
        assert_window_is_that_of_matrices(&attributes(&file), &flags);
    }
}

/// The screen window of the file is the rectangle that its matrices map to the picture.
fn assert_window_is_that_of_matrices(attributes: &LayerAttributes, flags: &str) {
    let (Vec2(x, y), width) = (attributes.screen_window_center, attributes.screen_window_width);
    let to_ndc = attributes.world_to_normalized_device.unwrap();
    let to_camera = attributes.world_to_camera.unwrap();
    // The matrix from world to camera is a rotation and a translation, so its inverse is transposed
    let world = |p: [f64; 3]| {
        let m = |row: usize, column: usize| f64::from(to_camera[4 * row + column]);
        let local = [0, 1, 2].map(|i| p[i] - m(3, i));
        [0, 1, 2].map(|row| (0..3).map(|column| m(row, column) * local[column]).sum())
    };
    let [x, y, width] = [x, y, width].map(f64::from);
    let at = |x: f64| times(world([x, y, 1.0]), to_ndc);
    for (x, expected) in [(x - 0.5 * width, 0.0), (x, 0.5), (x + 0.5 * width, 1.0)] {
        let [u, v, _] = at(x);
        assert!(
            (u - expected).abs() < 1e-5 && (v - 0.5).abs() < 1e-5,
            "{flags}: {u} {v} {expected}"
        );
    }
}

/// The files of the faces of a cube map have the cameras of their faces, from `render` and from
/// `develop`.
#[test]
fn faces_have_cameras_of_their_own() {
    let folder = room();
    let at = folder.path();
    let place = "--projection cubemap --size 48x32 --position 1,2,3 --look-at -2,1,-4 --up 0.1,1,0.2";
    let args = format!("render s.toml -q -o c.exr -o c_{{face}}.exr {CENTERS} {place}");
    done(at, &split(&args));
    done(at, &split("develop -q c.exr -o d_{face}.exr"));
    for face in ["right", "left", "up", "down", "front", "back"] {
        let file = at.join(format!("c_{face}.exr"));
        assert_points_lead_back(&file, [16, 16], face);
        assert_window_is_that_of_matrices(&attributes(&file), face);
        let [rendered, developed] = ["c", "d"].map(|name| attributes(&at.join(format!("{name}_{face}.exr"))));
        assert_eq!(
            rendered.world_to_normalized_device,
            developed.world_to_normalized_device
        );
        assert_eq!(rendered.world_to_camera, developed.world_to_camera);
        assert_eq!(number(&rendered, "pinholeFocalLength"), Some(12.0));
    }
}

/// Parts and their merged image have the same camera.
#[test]
fn lens_attributes_survive_a_merge() {
    let folder = room();
    let camera = "--position 1,2,3 --look-at 1,2,-4 --fov 50 --f-stop 2.8 --focus-distance 5";
    for (crop, name) in [("0,0,64,24", "a.exr"), ("0,24,64,48", "b.exr")] {
        let args = format!("render s.toml -q --crop {crop} -o {name} {CENTERS} {camera}");
        done(folder.path(), &split(&args));
    }
    done(folder.path(), &split("merge -q a.exr b.exr -o c.exr"));
    let [a, c] = ["a.exr", "c.exr"].map(|name| attributes(&folder.path().join(name)));
    assert_eq!(a.world_to_camera, c.world_to_camera);
    assert_eq!(a.world_to_normalized_device, c.world_to_normalized_device);
    assert_eq!(a.screen_window_width, c.screen_window_width);
    assert!((c.screen_window_width - 128.0 / 48.0 * 25f32.to_radians().tan()).abs() < 1e-6);
    // The space is left-handed: z is the depth.
    let [x, y, z] = times([2.0, 4.0, -7.0], c.world_to_camera.unwrap());
    assert!((x - 1.0).abs() + (y - 2.0).abs() + (z - 10.0).abs() < 1e-5);
    let focal = 12.0 / 25f32.to_radians().tan();
    assert!((number(&c, "pinholeFocalLength").unwrap() - focal).abs() < 1e-4);
    assert!((c.aperture.unwrap() - 2.8).abs() < 1e-4);
    assert!((c.focus.unwrap() - 5.0).abs() < 1e-5);
}

/// Developed files have the camera of their input, except if a crop is scaled.
#[test]
fn developed_files_keep_the_camera() {
    let folder = room();
    let camera = "--position 1,2,3 --look-at 1,2,-4 --fov 50";
    done(
        folder.path(),
        &split(&format!("render s.toml -q -o a.exr {CENTERS} {camera}")),
    );
    let of = |flags: &str| {
        done(folder.path(), &split(&format!("develop a.exr -q -o b.exr {flags}")));
        attributes(&folder.path().join("b.exr")).world_to_normalized_device
    };
    let own = attributes(&folder.path().join("a.exr")).world_to_normalized_device;
    assert!(own.is_some());
    for flags in ["--channel albedo", "--crop 8,8,40,40", "--scale 0.5"] {
        assert_eq!(of(flags), own, "{flags}");
    }
    assert_eq!(of("--crop 8,8,40,40 --scale 2"), None);
}

/// A panorama has no projection matrix. It has the attributes for the position and the axes of the
/// camera.
#[test]
fn panoramas_have_no_projection_matrix() {
    let folder = room();
    let flags = "--projection panorama --position 1,2,3 --look-at 1,2,-4";
    let args = format!("render s.toml -q -o t.exr {CENTERS} {flags}");
    done(folder.path(), &split(&args));
    let attributes = attributes(&folder.path().join("t.exr"));
    assert_eq!(attributes.world_to_normalized_device, None);
    assert_eq!(attributes.focus, None);
    // OpenEXR's values for pictures that are not perspectives
    let window = (attributes.screen_window_center, attributes.screen_window_width);
    assert_eq!(window, (Vec2(0.0, 0.0), 1.0));
    let origin = times([1.0, 2.0, 3.0], attributes.world_to_camera.unwrap());
    assert!(origin.iter().all(|x| x.abs() < 1e-6), "{origin:?}");
}
