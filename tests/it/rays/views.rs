//! Pictures of several views: cube maps and stereo pictures.

use crate::support::program::*;
use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::{read_channel, read_rgb};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const CONSTANT: &str = "[[light]]\ntype = \"constant\"\nradiance = 1\n";
const OCTAHEDRON: &str = "v 0 1 0\nv 0 -1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nv 0 0 -1\n\
    f 1 5 3\nf 1 3 6\nf 1 6 4\nf 1 4 5\nf 2 3 5\nf 2 6 3\nf 2 4 6\nf 2 5 4\n";
/// A closed room around the origin, seen from inside, with a lamp below its ceiling.
const ROOM: &str = "v -3 -2 -4\nv 3 -2 -4\nv 3 2 -4\nv -3 2 -4\nv -3 -2 4\nv 3 -2 4\nv 3 2 4\nv -3 2 4\n\
    f 1 2 3 4\nf 6 5 8 7\nf 5 1 4 8\nf 2 6 7 3\nf 5 6 2 1\nf 4 3 7 8\n\
    v -0.7 1.9 0.7\nv -0.7 1.9 -0.7\nv 0.7 1.9 -0.7\nv 0.7 1.9 0.7\nusemtl lamp\nf -4 -3 -2 -1\n";
/// View direction and up direction of the right, left, upper, lower, front and back face of a cube
/// map, for a camera that views along −z.
const FACES: [([i32; 3], [i32; 3]); 6] = [
    ([1, 0, 0], [0, 1, 0]),
    ([-1, 0, 0], [0, 1, 0]),
    ([0, 1, 0], [0, 0, 1]),
    ([0, -1, 0], [0, 0, -1]),
    ([0, 0, -1], [0, 1, 0]),
    ([0, 0, 1], [0, 1, 0]),
];
/// Integrators that connect paths to the lens, or are otherwise unbiased.
const UNBIASED: [&str; 4] = ["bdpt", "light", "pssmlt", "mlt"];
/// Integrators with a bias of a few percent.
const BIASED: [&str; 4] = ["vcm", "sppm", "photon-map", "irradiance-cache"];

fn scene(obj: &str, more: &str) -> TempDir {
    folder(&[
        ("a.obj", &format!("mtllib a.mtl\nusemtl m\n{obj}")),
        ("a.mtl", "newmtl m\nKd 0.7 0.6 0.5\nnewmtl lamp\nKd 0 0 0\nKe 6 6 6\n"),
        (
            "s.toml",
            &format!(
                "version = 1\n[render]\nsamples = 4\n[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, -1]\n\
                 [[object]]\nobj = \"a.obj\"\n{more}"
            ),
        ),
    ])
}

fn render(folder: &TempDir, name: &str, flags: &str) {
    let args = format!("render s.toml -q --denoise=off -o {name} {flags}");
    done(folder.path(), &split(&args));
}

fn green(folder: &TempDir, flags: &str) -> Vec<f32> {
    render(folder, "t.exr", flags);
    let [_, green, _] = read_rgb(&folder.path().join("t.exr"));
    green
}

/// Bits of the channel `name` in the rectangle of `size` pixels at `corner` of a picture `width`
/// pixels wide.
fn bits(path: &Path, name: &str, width: usize, corner: [usize; 2], size: [usize; 2]) -> Vec<u32> {
    let values = read_channel(path, name);
    let rows = corner[1]..corner[1] + size[1];
    let row = |y: usize| &values[y * width + corner[0]..][..size[0]];
    rows.flat_map(row).map(|value| value.to_bits()).collect()
}

/// Asserts that the view of `size` pixels at `corner` of the picture `whole` is bit-identical to
/// the picture `alone`, in all channels.
fn assert_view(folder: &TempDir, whole: (&str, usize), corner: [usize; 2], alone: (&str, [usize; 2]), what: &str) {
    let [of_whole, of_alone] = [whole.0, alone.0].map(|name| folder.path().join(name));
    for channel in CHANNELS {
        let view = bits(&of_whole, channel, whole.1, corner, alone.1);
        let expected = bits(&of_alone, channel, alone.1[0], [0, 0], alone.1);
        assert!(view == expected, "{what}: channel {channel}");
    }
}

/// Faces of a cube map are bit-identical to perspectives of 90°. This also holds if the borders of
/// faces cut tiles, for wide filters, and for integrators whose light can fall on any pixel.
#[test]
fn six_faces_equal_six_perspectives() {
    const SIDE: usize = 20;
    let folder = scene(ROOM, "");
    let position = [0.25, -0.5, 0.75];
    let at = |axis: [i32; 3]| {
        let sum = [0, 1, 2].map(|i| position[i] + f64::from(axis[i]));
        sum.map(|x| x.to_string()).join(",")
    };
    for (method, columns) in [
        ("path --spp 70", 3),
        ("path --spp 4 --filter gaussian --light-selection visibility", 6),
        ("bdpt --filter mitchell", 1),
        ("light", 3),
        ("pssmlt", 3),
        ("mlt", 3),
        ("vcm", 3),
        ("sppm", 3),
        ("photon-map --photons 10000", 3),
        ("irradiance-cache", 3),
    ] {
        let flags = format!("--position 0.25,-0.5,0.75 --spp 2 --integrator {method}");
        let flags = flags.replace("--spp 2 --integrator path", "--integrator path");
        let width = columns * SIDE;
        let size = format!("{width}x{}", 6 / columns * SIDE);
        let front = at([0, 0, -1]);
        render(
            &folder,
            "cube.exr",
            &format!("{flags} --projection cubemap --look-at {front} --size {size}"),
        );
        for (i, (axis, up)) in FACES.into_iter().enumerate() {
            let up = up.map(|x| x.to_string()).join(",");
            let face = format!("--look-at {} --up {up} --fov 90 --size {SIDE}x{SIDE}", at(axis));
            render(&folder, "face.exr", &format!("{flags} {face}"));
            let corner = [SIDE * (i % columns), SIDE * (i / columns)];
            let what = format!("{method}, face {i}");
            assert_view(&folder, ("cube.exr", width), corner, ("face.exr", [SIDE; 2]), &what);
        }
    }
}

/// Crops, interrupted renders and merged parts of a cube map are bit-identical to the whole
/// picture.
#[test]
fn parts_of_cube_maps_have_the_bits_of_the_whole() {
    let folder = scene(ROOM, "");
    let flags = "--projection cubemap --size 60x40 --spp 128";
    let whole = |name: &str, more: &str| render(&folder, name, &format!("{flags} {more}"));
    whole("whole.exr", "");
    let path = |name: &str| folder.path().join(name);
    // The crop has pixels of four faces
    whole("crop.exr", "--crop 5,13,33,31");
    let crop = read_channel(&path("crop.exr"), "G");
    let expected = bits(&path("whole.exr"), "G", 60, [5, 13], [28, 18]);
    assert_eq!(crop.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), expected);
    let resumed = "--checkpoint state.exr --resume";
    render(
        &folder,
        "first.exr",
        &format!("--projection cubemap --size 60x40 --spp 70 {resumed}"),
    );
    whole("resumed.exr", resumed);
    whole("a.exr", "--samples 0..64");
    whole("b.exr", "--samples 64..128");
    done(folder.path(), &split("merge a.exr b.exr -q -o merged.exr"));
    for name in ["resumed.exr", "merged.exr"] {
        assert_same_bits(&path("whole.exr"), &path(name));
    }
    // Each face is denoised separately.
    done(
        folder.path(),
        &split("develop whole.exr --denoise=atrous -o denoised.exr"),
    );
    done(
        folder.path(),
        &split(&format!("render s.toml -q {flags} --denoise=atrous -o at-once.exr")),
    );
    assert_eq!(
        read_channel(&path("denoised.exr"), "G"),
        read_channel(&path("at-once.exr"), "G")
    );
}

/// A cube map shows the environment: each pixel has the light of the texel in its direction.
#[test]
fn cube_map_gives_the_environment_back() {
    const SIDE: usize = 16;
    let folder = scene("v 0 9 0\nv 1e-3 9 0\nv 0 9 1e-3\nf 1 2 3\n", "");
    // Texels of a grid of 32 × 16, each of a different light
    let light = |x: usize, y: usize| 0.25 + (x + 32 * y) as f32 / 256.0;
    let texels: Vec<_> = (0..16 * 32).map(|i| image::Rgb([light(i % 32, i / 32); 3])).collect();
    let file = fs::File::create(folder.path().join("sky.hdr")).unwrap();
    image::codecs::hdr::HdrEncoder::new(file)
        .encode(&texels, 32, 16)
        .unwrap();
    let text = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    let sky = "[[light]]\ntype = \"environment\"\nimage = \"sky.hdr\"\n";
    fs::write(folder.path().join("s.toml"), text + sky).unwrap();
    // The panorama of the same camera gives the light of each direction.
    let panorama = green(&folder, "--projection panorama --size 512x256 --spp 4");
    let cube = green(&folder, "--projection cubemap --size 96x16 --spp 64");
    let mut compared = 0;
    for (i, value) in cube.iter().enumerate() {
        let (x, y) = (i % (6 * SIDE), i / (6 * SIDE));
        let on_face = |i: usize| (i as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0;
        let (u, v) = (on_face(x % SIDE), on_face(y));
        // Right, up, and forward of the camera
        let to = match x / SIDE {
            0 => [1.0, -v, -u],
            1 => [-1.0, -v, u],
            2 => [u, 1.0, v],
            3 => [u, -1.0, -v],
            4 => [u, -v, 1.0],
            _ => [-u, -v, -1.0],
        };
        let column = (to[0].atan2(to[2]) / std::f64::consts::TAU + 0.5) * 512.0;
        let row = (0.5 - to[1].atan2(to[0].hypot(to[2])) / std::f64::consts::PI) * 256.0;
        let at = |dx: f64, dy: f64| panorama[(row + dy) as usize * 512 + (column + dx) as usize];
        if !(12.0..244.0).contains(&row) || !(12.0..500.0).contains(&column) {
            continue;
        }
        // Leave out pixels at a border of texels
        let around = [(0.0, 0.0), (12.0, 0.0), (-12.0, 0.0), (0.0, 12.0), (0.0, -12.0)].map(|(x, y)| at(x, y));
        let spread = around.iter().fold(0f32, |max, v| max.max((v - around[0]).abs()));
        if spread < 0.2 {
            compared += 1;
            assert!((value - around[0]).abs() < 0.05 + spread, "{x},{y}: {value} {around:?}");
        }
    }
    assert!(compared > 500, "{compared}");
}

/// Mean green light of each of the `views` views, which are side by side, over `seeds` renders.
fn regions(folder: &TempDir, flags: &str, (width, views): (usize, usize), seeds: u32) -> Vec<Mean> {
    let of_seed = |seed| {
        let green = green(folder, &format!("{flags} --seed {seed}"));
        let mut sums = vec![[0.0; 2]; views];
        for (i, value) in green.iter().enumerate() {
            let view = i % width * views / width;
            sums[view][0] += f64::from(*value);
            sums[view][1] += 1.0;
        }
        sums.into_iter().map(|[sum, count]| sum / count).collect()
    };
    Mean::of_each(&(1..=seeds).map(of_seed).collect::<Vec<_>>())
}

/// Flags of pictures with several views, width of the picture, and number of views side by side.
const VIEWS: [(&str, usize, usize); 6] = [
    (
        "--stereo side-by-side --eye-distance 0.5 --intrinsics 10,9,6.5,5.5 --distortion=-0.1,0.01,0.01,0 --size 24x12",
        24,
        2,
    ),
    (
        "--stereo side-by-side --eye-distance 0.5 --projection fisheye --intrinsics 6,6,6,6 --size 24x12",
        24,
        2,
    ),
    ("--projection cubemap --size 48x8", 48, 6),
    ("--stereo side-by-side --eye-distance 0.5 --size 24x12", 24, 2),
    (
        "--stereo side-by-side --eye-distance 0.5 --convergence 2 --filter tent --size 24x12",
        24,
        2,
    ),
    (
        "--stereo side-by-side --eye-distance 0.5 --projection panorama --size 32x8",
        32,
        2,
    ),
];

/// In a lit room, integrators agree with path tracing in each view.
#[test]
fn methods_agree_in_every_view() {
    let folder = scene(ROOM, "");
    for (views, width, count) in VIEWS {
        let flags = format!("{views} --max-depth 4 --position 0.3,0.1,0.5 --look-at 0,0,-1");
        let shape = (width, count);
        let expected = regions(&folder, &format!("{flags} --spp 128"), shape, 8);
        for method in UNBIASED {
            let found = regions(&folder, &format!("{flags} --integrator {method} --spp 16"), shape, 8);
            for (view, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert_same_mean(format!("{views}, {method}, view {view}"), *found, *expected);
            }
        }
        for method in BIASED {
            let found = regions(&folder, &format!("{flags} --integrator {method} --spp 64"), shape, 2);
            for (view, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let ratio = found.value / expected.value;
                // Faces have few pixels, so search radii are large and the bias is larger
                assert!((ratio - 1.0).abs() < 0.12, "{views}, {method}, view {view}: {ratio}");
            }
        }
    }
}

/// A white convex body in light of radiance 1 is invisible in each view, with each integrator.
#[test]
fn furnace_is_even_in_every_view() {
    let folder = scene(OCTAHEDRON, CONSTANT);
    fs::write(folder.path().join("a.mtl"), "newmtl m\nKd 1 1 1\n").unwrap();
    for (views, width, count) in VIEWS {
        let flags = format!("{views} --position 0.3,0.5,2 --look-at 0,0,0");
        let shape = (width, count);
        let exact = green(&folder, &format!("{flags} --direct none --reuse none"));
        // The weights of a few samples of a tent filter do not sum to 1.
        let allowed = if views.contains("tent") { 0.1 } else { 1e-4 };
        assert!(exact.iter().all(|value| (value - 1.0).abs() < allowed), "{views}");
        for method in UNBIASED.into_iter().chain(BIASED) {
            let found = regions(&folder, &format!("{flags} --integrator {method} --spp 64"), shape, 4);
            for (view, found) in found.iter().enumerate() {
                let error = (found.value - 1.0).abs();
                assert!(
                    error < 0.05 + 4.0 * found.error(),
                    "{views}, {method}, view {view}: {found}"
                );
            }
        }
    }
}

/// Centroid of the light of a row, in pixels from its left end.
fn middle(row: &[f32]) -> f64 {
    let sum: f64 = row.iter().map(|&v| f64::from(v)).sum();
    assert!(sum > 0.0, "the lamp is not in the view");
    let moment = |(x, &v): (usize, &f32)| (x as f64 + 0.5) * f64::from(v);
    row.iter().enumerate().map(moment).sum::<f64>() / sum
}

/// Without a convergence distance, a lamp at the depth z has the disparity f b / z, where f is the
/// focal length in pixels and b is the distance of the eyes. With a convergence distance z₀, it has
/// the disparity f b (1/z − 1/z₀). There is no vertical disparity.
#[test]
fn disparity_of_a_plane_is_focal_length_times_base_over_depth() {
    let corners = "usemtl lamp\nv -0.3 -0.3 0\nv 0.3 -0.3 0\nv 0.3 0.3 0\nv -0.3 0.3 0\nf 1 2 3 4\n";
    let folder = scene(corners, "");
    const SIDE: usize = 200;
    let (base, fov) = (0.25, 50f64);
    let focal = 0.5 * SIDE as f64 / (0.5 * fov.to_radians()).tan();
    for (layout, size) in [("side-by-side", [2 * SIDE, SIDE]), ("top-bottom", [SIDE, 2 * SIDE])] {
        for depth in [2.0, 4.0, 7.5] {
            for (convergence, infinity) in [("", 0.0), ("--convergence 4", focal * base / 4.0)] {
                let flags = format!(
                    "--stereo {layout} --eye-distance {base} {convergence} --fov {fov} --size {}x{} --spp 16 \
                     --position 0,0,{depth} --look-at 0,0,0",
                    size[0], size[1]
                );
                let picture = green(&folder, &flags);
                let corners = [[0, 0], [size[0] - SIDE, size[1] - SIDE]];
                let view = |[x, y]: [usize; 2]| {
                    let row = |row: usize| &picture[(y + row) * size[0] + x..][..SIDE];
                    (0..SIDE).map(row).collect::<Vec<_>>()
                };
                let [left, right] = corners.map(view);
                let [a, b] = [&left, &right].map(|view| middle(view[SIDE / 2]));
                let expected = focal * base / depth - infinity;
                assert!((a - b - expected).abs() < 0.05, "{flags}: {} {expected}", a - b);
                let heights = [&left, &right].map(|view| {
                    let lit = |row: &&&[f32]| row.iter().any(|&v| v > 0.0);
                    view.iter().filter(lit).count()
                });
                assert_eq!(heights[0], heights[1], "{flags}");
            }
        }
    }
}

/// The views of the eyes are bit-identical to pictures from the positions of the eyes.
#[test]
fn eyes_are_pictures_from_their_positions() {
    let folder = scene(ROOM, "");
    for projection in [
        "",
        "--projection fisheye",
        "--projection fisheye --fisheye-fov 220 --fisheye-mapping equisolid",
        "--intrinsics 20,21,14,11 --distortion=-0.2,0.03,0.01,0.02",
        "--projection fisheye --intrinsics 12,12,15,9 --distortion 0.05,-0.01,0,0",
    ] {
        let flags = format!("--spp 66 --look-at 0.25,-0.5,-0.25 {projection}");
        let eyes = "--position 0.25,-0.5,0.75 --stereo side-by-side --eye-distance 0.5 --size 60x20";
        render(&folder, "pair.exr", &format!("{flags} {eyes}"));
        for (corner, x) in [(0, 0.0), (30, 0.5)] {
            let place = format!("--position {x},-0.5,0.75 --size 30x20 --spp 66 --look-at {x},-0.5,-0.25");
            let eye = format!("{place} {projection}");
            render(&folder, "eye.exr", &eye);
            assert_view(&folder, ("pair.exr", 60), [corner, 0], ("eye.exr", [30, 20]), &eye);
        }
    }
}

/// In the view of each eye, a small lamp is at the pixel of its model: a pinhole with and without
/// distortion, and a fisheye. Without distortion the disparity is f b (1/z − 1/z₀).
#[test]
fn disparity_of_calibrated_cameras_and_fisheyes_is_that_of_their_models() {
    let corners = "usemtl lamp\nv -0.02 -0.2 0\nv 0.02 -0.2 0\nv 0.02 0.2 0\nv -0.02 0.2 0\nf 1 2 3 4\n";
    let folder = scene(corners, "");
    const SIDE: usize = 200;
    let (base, focal, center) = (0.5, 150.0, 95.5);
    type Model = fn(f64) -> f64;
    let plain: Model = |x| x;
    let distorted: Model = |x| x * (1.0 - 0.2 * x * x + 0.05 * x.powi(4));
    let lens = format!("--intrinsics {focal},{focal},{center},100");
    let bent = format!("{lens} --distortion=-0.2,0.05,0,0");
    let circle = "--projection fisheye --fisheye-fov 180";
    let angles: Model = |x| x.atan();
    // Flags, mapping from x/z to the position on the film, focal length in pixels, and centre
    let cameras: [(&str, Model, f64, f64, f64); 4] = [
        (&lens, plain, focal, center, f64::INFINITY),
        (&format!("{lens} --convergence 3"), plain, focal, center, 3.0),
        (&bent, distorted, focal, center, f64::INFINITY),
        (circle, angles, SIDE as f64 / std::f64::consts::PI, 100.0, f64::INFINITY),
    ];
    for (flags, model, focal, center, convergence) in cameras {
        for depth in [1.0, 2.5] {
            let flags = format!(
                "{flags} --stereo side-by-side --eye-distance {base} --size {}x{SIDE} --spp 64 --position 0,0,{depth} \
                 --look-at 0,0,0",
                2 * SIDE
            );
            let picture = green(&folder, &flags);
            let row = &picture[SIDE / 2 * 2 * SIDE..][..2 * SIDE];
            for (view, eye) in row.chunks(SIDE).zip([-0.5 * base, 0.5 * base]) {
                let expected = focal * (model(-eye / depth) + eye / convergence) + center;
                let found = middle(view);
                assert!((found - expected).abs() < 0.1, "{flags}: {found} {expected}");
            }
        }
    }
}

/// The picture of a camera of a file is the picture of each view. The stereo picture is twice as
/// large.
#[test]
fn cameras_of_files_have_two_eyes() {
    let folder = scene(ROOM, "");
    let json = "{\"w\": 30, \"h\": 20, \"fl_x\": 20, \"fl_y\": 21, \"cx\": 14, \"cy\": 11, \"frames\": [{\"file_path\": \"a\", \
                \"transform_matrix\": [[1,0,0,X],[0,1,0,-0.5],[0,0,1,0.75],[0,0,0,1]]}]}";
    for (name, x) in [("middle.json", "0.25"), ("left.json", "0"), ("right.json", "0.5")] {
        fs::write(folder.path().join(name), json.replace('X', x)).unwrap();
    }
    let pair = "--stereo top-bottom --eye-distance 0.5";
    render(&folder, "pair.exr", &format!("--cameras middle.json {pair}"));
    render(
        &folder,
        "large.exr",
        &format!("--cameras middle.json {pair} --size 60x80"),
    );
    for (name, corner) in [("left", 0), ("right", 20)] {
        let flags = format!("--cameras {name}.json");
        render(&folder, "eye.exr", &flags);
        assert_view(&folder, ("pair.exr", 30), [0, corner], ("eye.exr", [30, 20]), &flags);
        let flags = format!("--cameras {name}.json --size 60x40");
        render(&folder, "eye.exr", &flags);
        assert_view(
            &folder,
            ("large.exr", 60),
            [0, 2 * corner],
            ("eye.exr", [60, 40]),
            &flags,
        );
    }
}

/// A render that is stopped before it reaches its noise level has two blocks of samples in each
/// view.
#[test]
fn noise_levels_begin_with_samples_in_each_view() {
    let folder = scene(ROOM, "");
    for views in ["--projection cubemap --size 36x6", "--stereo side-by-side --size 24x12"] {
        let flags = format!("{views} --noise 0.000001 --spp 10000000 --time-limit 5s");
        render(&folder, "t.exr", &flags);
        let samples = read_channel(&folder.path().join("t.exr"), "samples");
        let fewest = samples.iter().copied().fold(f32::INFINITY, f32::min);
        assert!(fewest >= 128.0, "{views}: {fewest}");
    }
}

/// In a stereo panorama, a lamp at the horizontal distance d has the disparity 2 asin(b / 2d) in
/// every direction. b is the distance of the eyes.
#[test]
fn disparity_of_a_panorama_is_equal_in_all_directions() {
    const WIDTH: usize = 720;
    let lamps = |x: f64, z: f64| {
        // A square that faces the origin
        let (tx, tz) = (-z * 0.05, x * 0.05);
        format!(
            "usemtl lamp\nv {} -0.3 {}\nv {} -0.3 {}\nv {} 0.3 {}\nv {} 0.3 {}\nf -4 -3 -2 -1\n",
            x - tx,
            z - tz,
            x + tx,
            z + tz,
            x + tx,
            z + tz,
            x - tx,
            z - tz
        )
    };
    for [x, z] in [[0.0, -3.0], [3.0, 0.0], [-2.0, -2.0], [1.0, 2.5]] {
        let folder = scene(&lamps(x, z), "");
        let flags = format!("--projection panorama --stereo top-bottom --eye-distance 0.3 --size {WIDTH}x90 --spp 64");
        let picture = green(&folder, &flags);
        let row = |row: usize| middle(&picture[row * WIDTH..][..WIDTH]);
        let disparity = (row(22) - row(45 + 22)) / WIDTH as f64 * std::f64::consts::TAU;
        let expected = 2.0 * (0.15 / x.hypot(z)).asin();
        assert!((disparity - expected).abs() < 2e-3, "{x},{z}: {disparity} {expected}");
    }
}

/// In a stereo panorama, light paths that are connected to the eyes show a surface at the pixels of
/// the tangents of the circle. The lamp is a point, so that no camera ray hits it.
#[test]
fn light_paths_have_the_disparity_of_a_panorama() {
    const WIDTH: usize = 720;
    const ROWS: usize = 45;
    let (x, z) = (-2.0, -2.0);
    let corner = |a: f64, y: f64| format!("v {} {y} {}\n", x - a * z, z + a * x);
    let corners = [(-0.05, -0.3), (0.05, -0.3), (0.05, 0.3), (-0.05, 0.3)].map(|(a, y)| corner(a, y));
    let lamp = "[[light]]\ntype = \"point\"\nposition = [0, 0, 0]\nintensity = 9\n";
    let folder = scene(&format!("{}f 1 2 3 4\n", corners.concat()), lamp);
    let flags = format!(
        "--projection panorama --stereo top-bottom --eye-distance 0.3 --size {WIDTH}x{} --max-depth 1",
        2 * ROWS
    );
    let light_of = |flags: &str| {
        let picture = green(&folder, flags);
        let view = |rows: &[f32]| -> Vec<f32> {
            let column = |x: usize| rows.iter().skip(x).step_by(WIDTH).sum();
            (0..WIDTH).map(column).collect()
        };
        let [left, right] = [0, ROWS].map(|row| view(&picture[row * WIDTH..][..ROWS * WIDTH]));
        (middle(&left), middle(&right), left.iter().chain(&right).sum::<f32>())
    };
    let (left, right, light) = light_of(&format!("{flags} --spp 64"));
    let expected = 2.0 * (0.15 / x.hypot(z)).asin() * WIDTH as f64 / std::f64::consts::TAU;
    assert!((left - right - expected).abs() < 0.1, "path: {left} {right} {expected}");
    for method in [
        "light",
        "bdpt",
        "vcm",
        "pssmlt --metropolis-direct metropolis",
        "mlt --metropolis-direct metropolis",
    ] {
        let found = light_of(&format!("{flags} --spp 64 --integrator {method}"));
        let errors = [found.0 - left, found.1 - right].map(f64::abs);
        assert!(
            errors[0].max(errors[1]) < 0.25,
            "{method}: {found:?}, path: {left} {right}"
        );
        assert!(
            (found.2 / light - 1.0).abs() < 0.05,
            "{method}: {found:?}, path: {light}"
        );
    }
}

/// In a stereo panorama, things nearer to the axis than the eyes are not seen, but cast light and
/// shadows.
#[test]
fn methods_agree_on_lamps_between_the_eyes() {
    let lamp = "v -0.2 0.2 -0.2\nv 0.2 0.2 -0.2\nv 0.2 0.2 0.2\nv -0.2 0.2 0.2\nusemtl lamp\nf -4 -3 -2 -1\n";
    let point = "[[light]]\ntype = \"point\"\nposition = [0, -0.1, 0]\nintensity = 5\n";
    let folder = scene(&format!("{ROOM}{lamp}"), point);
    let flags = "--projection panorama --stereo side-by-side --eye-distance 1.2 --size 32x8 --max-depth 3";
    let shape = (32, 2);
    let expected = regions(&folder, &format!("{flags} --spp 128"), shape, 8);
    // Without the lamps between the eyes, the room is darker
    let dark = scene(ROOM, "");
    let of_dark = regions(&dark, &format!("{flags} --spp 128"), shape, 2);
    assert!(of_dark[0].value < 0.95 * expected[0].value, "{of_dark:?} {expected:?}");
    for method in UNBIASED {
        let found = regions(&folder, &format!("{flags} --integrator {method} --spp 32"), shape, 8);
        for (view, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert_same_mean(format!("{method}, view {view}"), *found, *expected);
        }
    }
}

#[test]
fn scene_files_keep_views() {
    let folder = scene(ROOM, "");
    for flags in [
        "--projection cubemap --size 48x8",
        "--stereo side-by-side --eye-distance 0.5 --convergence 2 --size 24x12",
        "--stereo top-bottom --projection panorama --size 24x24",
    ] {
        let at = |name: &str| folder.path().join(name);
        render(&folder, "t.exr", &format!("{flags} --dump-scene d.toml"));
        done(folder.path(), &split("render d.toml -q --denoise=off -o d.exr"));
        assert_same_bits(&at("t.exr"), &at("d.exr"));
    }
}

/// For a stereo picture, commands that trace the rays of a single camera report that they do not
/// trace the views of the eyes.
#[test]
fn commands_of_one_camera_tell_that_they_have_no_eyes() {
    let folder = scene(ROOM, "");
    let text = fs::read_to_string(folder.path().join("s.toml")).unwrap();
    let text = text.replace("[camera]\n", "[camera]\nstereo = \"side-by-side\"\n");
    fs::write(folder.path().join("stereo.toml"), text).unwrap();
    for (name, is_told) in [("stereo.toml", true), ("s.toml", false)] {
        for command in ["bench", "audit", "lab"] {
            let flags = match command {
                "bench" => "--repeat 1 --size 8x8 --backend embree",
                "audit" => "--rays 1000 --size 8x8",
                _ => "--spp 1 --size 8x8 --methods path -o lab",
            };
            let told = words(&run(folder.path(), &split(&format!("{command} {name} {flags}"))));
            let note = "note: stereo: the rays start at one camera, in the middle of both eyes";
            assert_eq!(told.contains(note), is_told, "{command}: {told}");
        }
    }
}

#[test]
fn impossible_views_are_errors() {
    let folder = scene(ROOM, "");
    for (flags, expected) in [
        ("--projection cubemap --size 512x512", "3072x512, 512x3072, 1536x1024"),
        ("--projection cubemap --size 61x10", "61x10"),
        (
            "--projection cubemap --size 60x10 --lens-radius 0.1",
            "must be 0, not 0.1",
        ),
        ("--projection cubemap --size 60x10 --shift 0,1", "`cubemap`"),
        ("--projection cubemap --size 60x10 --write-cameras c.json", "`cubemap`"),
        (
            "--projection cubemap --size 60x10 --pixel 3,4",
            "6 views of 10x10 pixels",
        ),
        (
            "--projection cubemap --size 60x10 --crop 0,0,61,10",
            "leaves the image of 60x10",
        ),
        (
            "--projection cubemap --size 60x10 --stereo side-by-side",
            "use --projection panorama",
        ),
        (
            "--projection orthographic --stereo top-bottom",
            "both eyes would see one picture",
        ),
        (
            "--intrinsics 50,50,32,24 --distortion 0.1,0,0,0 --stereo top-bottom --convergence 2",
            "needs a perspective without distortion",
        ),
        (
            "--projection fisheye --stereo side-by-side --convergence 2",
            "needs a perspective without distortion",
        ),
        ("--stereo side-by-side --size 61x40", "61 pixels"),
        ("--stereo top-bottom --size 40x61", "61 pixels"),
        ("--stereo side-by-side --eye-distance 0", "--eye-distance"),
        ("--stereo side-by-side --eye-distance=-1", "-1"),
        ("--stereo side-by-side --eye-distance NaN", "NaN"),
        ("--stereo side-by-side --convergence 0", "--convergence"),
        ("--stereo cross", "side-by-side"),
        ("--eye-distance 0.1", "is 0.1, but the picture has no `stereo`"),
        ("--convergence 2", "is 2, but the picture has no `stereo`"),
        (
            "--stereo top-bottom --projection panorama --convergence 2",
            "needs a perspective without distortion",
        ),
        ("--stereo side-by-side --write-cameras c.json", "stereo `side-by-side`"),
    ] {
        let output = run(folder.path(), &split(&format!("render s.toml -q -o t.png {flags}")));
        assert_ne!(code(&output), 0, "{flags}");
        let said = words(&output);
        assert!(said.contains(expected), "{flags}: {said}");
    }
}
