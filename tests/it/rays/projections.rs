//! Camera projections: known sizes and directions, and constant light in each of them.

use crate::support::program::*;
use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::{read_channel, read_rgb};
use std::fs;
use tempfile::TempDir;

const HEAD: &str =
    "version = 1\n[image]\nwidth = 60\nheight = 60\n[render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\n";
const CONSTANT: &str = "[[light]]\ntype = \"constant\"\nradiance = 1\n";

fn scene(obj: &str, mtl: &str, more: &str) -> TempDir {
    folder(&[
        ("a.obj", &format!("mtllib a.mtl\nusemtl m\n{obj}")),
        ("a.mtl", &format!("newmtl m\n{mtl}\n")),
        ("s.toml", &format!("{HEAD}{more}")),
    ])
}

fn picture(folder: &TempDir, flags: &str) -> [Vec<f32>; 3] {
    let args = format!("render s.toml -q -o t.exr {flags}");
    done(folder.path(), &split(&args));
    read_rgb(&folder.path().join("t.exr"))
}

/// A lamp of 2 × 3 units covers 20 × 30 pixels if pixels are 0.1 units wide, at every distance.
#[test]
fn orthographic_rectangle_has_its_size() {
    let corners = "v -1 -1.5 0\nv 1 -1.5 0\nv 1 1.5 0\nv -1 1.5 0\nf 1 2 3 4\n";
    let folder = scene(corners, "Kd 0 0 0\nKe 1 1 1", "[camera]\nlook_at = [0, 0, 0]\n");
    for position in ["0,0,3", "0,0,50"] {
        let flags = format!("--projection orthographic --ortho-height 6 --position {position}");
        let [red, ..] = picture(&folder, &flags);
        for (i, value) in red.iter().enumerate() {
            let (x, y) = (i % 60, i / 60);
            let is_inside = (20..40).contains(&x) && (15..45).contains(&y);
            assert_eq!(*value, if is_inside { 1.0 } else { 0.0 }, "pixel {x},{y}");
        }
    }
    // A shift of a quarter of the height moves the image plane up, and the image of the lamp down.
    let flags = "--projection orthographic --ortho-height 6 --position 0,0,3 --shift 0,0.25";
    let [red, ..] = picture(&folder, flags);
    assert_eq!(
        (red[44 * 60 + 30], red[29 * 60 + 30], red[59 * 60 + 30]),
        (1.0, 0.0, 1.0)
    );
}

#[test]
fn constant_light_is_even_in_every_projection() {
    let ball = "v 0 1 0\nv 0 -1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nv 0 0 -1\n\
        f 1 5 3\nf 1 3 6\nf 1 6 4\nf 1 4 5\nf 2 3 5\nf 2 6 3\nf 2 4 6\nf 2 5 4\n";
    let camera = "[camera]\nposition = [0.3, 0.5, 4]\nlook_at = [0, 0, 0]\n";
    let folder = scene(ball, "Kd 1 1 1", &format!("{camera}{CONSTANT}"));
    for projection in [
        "perspective --shift 0.3,-0.2",
        "orthographic",
        "panorama --size 64x32",
        "fisheye",
        "fisheye --fisheye-fov 360 --fisheye-mapping equisolid",
        "fisheye --fisheye-fov 250 --fisheye-mapping stereographic",
        "fisheye --fisheye-mapping orthographic",
    ] {
        for backend in ["embree", "brute"] {
            let [red, ..] = picture(
                &folder,
                &format!("--projection {projection} --backend {backend} --direct none --reuse none"),
            );
            let width = if projection.starts_with("panorama") { 64 } else { 60 };
            for (i, value) in red.iter().enumerate() {
                let (x, y) = ((i % width) as f32 + 0.5 - 30.0, (i / width) as f32 + 0.5 - 30.0);
                let radius = x.hypot(y);
                if projection.starts_with("fisheye") && radius > 29.2 {
                    // Pixels on the rim are partly black.
                    assert!(radius < 30.8 || *value == 0.0, "{projection}, pixel {i}: {value}");
                    continue;
                }
                assert!(
                    (value - 1.0).abs() < 1e-4,
                    "{projection} by {backend}, pixel {i}: {value}"
                );
            }
        }
    }
}

/// A panorama shows the environment: the brightest pixel is at the brightest texel.
#[test]
fn panorama_gives_the_environment_back() {
    let folder = scene("v 0 0 0\nv 1e-3 0 0\nv 0 1e-3 0\nf 1 2 3\n", "Kd 0 0 0", "");
    let mut texels = vec![image::Rgb([0.5f32; 3]); 32 * 16];
    texels[5 * 32 + 21] = image::Rgb([40.0; 3]);
    let file = fs::File::create(folder.path().join("sky.hdr")).unwrap();
    image::codecs::hdr::HdrEncoder::new(file)
        .encode(&texels, 32, 16)
        .unwrap();
    let text = format!(
        "{HEAD}[camera]\nposition = [0, 5, 0]\nlook_at = [0, 5, -1]\nprojection = \"panorama\"\n\
         [[light]]\ntype = \"environment\"\nimage = \"sky.hdr\"\n"
    );
    fs::write(folder.path().join("s.toml"), text).unwrap();
    let brightest = |pixels: &[f32]| pixels.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
    let columns: Vec<usize> = ["0,5,-1", "1,5,0", "0,5,1", "-1,5,0"]
        .iter()
        .map(|look_at| {
            let [red, ..] = picture(&folder, &format!("--size 32x16 --spp 64 --look-at {look_at}"));
            let i = brightest(&red);
            assert_eq!(i / 32, 5, "row of the brightest pixel");
            assert!((red.iter().sum::<f32>() - (511.0 * 0.5 + 40.0)).abs() < 3.0);
            i % 32
        })
        .collect();
    // Each quarter turn of the camera to the right moves the image by a quarter of its width to the
    // left
    for pair in columns.windows(2) {
        assert_eq!((pair[0] + 32 - 8) % 32, pair[1], "{columns:?}");
    }
    assert!(columns.contains(&21), "{columns:?}");
}

#[test]
fn depth_is_along_the_axis_or_along_the_ray() {
    let wall = "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nf 1 2 3 4\n";
    let camera = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n";
    let folder = scene(wall, "Kd 1 1 1", &format!("{camera}{CONSTANT}"));
    for (projection, corner) in [
        ("perspective --fov 90", 4.0),
        ("orthographic --ortho-height 8", 4.0),
        // The direction is 45° to the left of the axis
        ("fisheye", 4.0 * 2f32.sqrt()),
    ] {
        picture(&folder, &format!("--projection {projection} --size 61x61 --spp 16"));
        let depth = read_channel(&folder.path().join("t.exr"), "Z");
        assert!((depth[30 * 61 + 30] - 4.0).abs() < 0.01, "{projection}");
        assert!(
            (depth[30 * 61 + 15] - corner).abs() < 0.12,
            "{projection}: {}",
            depth[30 * 61 + 15]
        );
    }
}

#[test]
fn scene_files_keep_the_projection() {
    let ball = "v 0 1 0\nv -1 -1 0\nv 1 -1 0\nf 1 2 3\n";
    let folder = scene(
        ball,
        "Kd 0.5 0.5 0.5",
        &format!("[camera]\nposition = [1, 2, 4]\nlook_at = [0, 0, 0]\n{CONSTANT}"),
    );
    for projection in [
        "perspective --shift 0.1,0.2",
        "orthographic --shift 0.1,0.2",
        "panorama",
        "fisheye --fisheye-fov 200 --fisheye-mapping equisolid",
    ] {
        let at = |name: &str| folder.path().join(name);
        picture(&folder, &format!("--projection {projection} --dump-scene d.toml"));
        done(folder.path(), &split("render d.toml -q -o d.exr"));
        assert_same_bits(&at("t.exr"), &at("d.exr"));
    }
}

#[test]
fn bare_objects_are_framed_by_parallel_rays() {
    let folder = scene(
        "v -3 -2 -1\nv 3 -2 -1\nv 0 2 1\nf 1 2 3\nf 3 2 1\n",
        "Kd 0.5 0.5 0.5",
        "",
    );
    let flags = "render a.obj --view front --projection orthographic --no-ground --background transparent --size 48x48 --spp 4 -q -o t.exr --denoise=off";
    done(folder.path(), &split(flags));
    let alpha = read_channel(&folder.path().join("t.exr"), "A");
    let border = (0..48).flat_map(|i| [i, 47 * 48 + i, 48 * i, 48 * i + 47]);
    assert!(border.into_iter().all(|i| alpha[i] == 0.0));
    let seen: f32 = alpha.iter().sum();
    assert!(seen > 0.15 * 48.0 * 48.0, "{seen}");
}

#[test]
fn impossible_projections_are_errors() {
    let folder = scene(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "Kd 1 1 1",
        &format!("[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n{CONSTANT}"),
    );
    for (flags, words) in [
        ("--ortho-height 3", "has no meaning in the projection `perspective`"),
        (
            "--projection panorama --shift 0,1",
            "has no meaning in the projection `panorama`",
        ),
        (
            "--projection panorama --lens-radius 0.1",
            "panoramas, cubemaps and fisheyes have no lens",
        ),
        (
            "--projection fisheye --fisheye-fov 200 --fisheye-mapping orthographic",
            "180",
        ),
        ("--projection fisch", "fisheye"),
        ("--shift 3,0", "use an X from -"),
        ("--shift 0,-3", "moves the whole scene out of the picture"),
        (
            "--projection orthographic --ortho-height 3 --shift 0,2",
            "and a Y from -",
        ),
    ] {
        let output = run(folder.path(), &split(&format!("render s.toml -q -o t.png {flags}")));
        assert_ne!(code(&output), 0, "{flags}");
        let said = crate::support::program::words(&output);
        assert!(said.contains(words), "{flags}: {said}");
    }
    // The scene is at the border of the picture
    let shown = run(folder.path(), &split("render s.toml -q --spp 1 -o t.png --shift 0.6,0"));
    assert_eq!(code(&shown), 0, "{}", crate::support::program::words(&shown));
}

/// Projections whose lens light paths can hit.
const PROJECTIONS: [&str; 9] = [
    "perspective --shift 0.3,-0.2",
    "orthographic --ortho-height 5",
    "orthographic --ortho-height 5 --lens-radius 0.4 --focus-distance 4 --shift 0.1,0.2",
    "panorama",
    "panorama --filter tent",
    "fisheye",
    "fisheye --fisheye-fov 360 --fisheye-mapping equisolid",
    "fisheye --fisheye-fov 250 --fisheye-mapping stereographic",
    "fisheye --fisheye-mapping orthographic",
];
/// Integrators that connect paths to the lens, or are otherwise unbiased.
const UNBIASED: [&str; 4] = ["bdpt", "light", "pssmlt", "mlt"];
/// Integrators with a bias of a few percent.
const BIASED: [&str; 4] = ["vcm", "sppm", "photon-map", "irradiance-cache"];
/// A convex body: no light is scattered from one face to another.
const OCTAHEDRON: &str = "v 0 1 0\nv 0 -1 0\nv 1 0 0\nv -1 0 0\nv 0 0 1\nv 0 0 -1\n\
    f 1 5 3\nf 1 3 6\nf 1 6 4\nf 1 4 5\nf 2 3 5\nf 2 6 3\nf 2 4 6\nf 2 5 4\n";
const SIZE: [usize; 2] = [20, 10];

/// Mean green light of the quarters, the border and the whole image, over `seeds` renders.
fn regions(folder: &TempDir, flags: &str, seeds: u32) -> Vec<Mean> {
    let [width, height] = SIZE;
    let of_seed = |seed| {
        let flags = format!("{flags} --size {width}x{height} --seed {seed} --denoise=off");
        let [_, green, _] = picture(folder, &flags);
        let mut sums = [[0.0; 2]; 6];
        for (i, value) in green.iter().enumerate() {
            let (x, y) = (i % width, i / width);
            let is_border = x == 0 || y == 0 || x == width - 1 || y == height - 1;
            let quarter = usize::from(2 * x >= width) + 2 * usize::from(2 * y >= height);
            for region in [0, 1 + quarter].into_iter().chain(is_border.then_some(5)) {
                sums[region][0] += f64::from(*value);
                sums[region][1] += 1.0;
            }
        }
        sums.map(|[sum, count]| sum / count).to_vec()
    };
    Mean::of_each(&(1..=seeds).map(of_seed).collect::<Vec<_>>())
}

/// A lamp above an octahedron and a floor, in dim light. The integrators agree with path tracing in
/// the whole image and in each part of the image.
#[test]
fn methods_agree_in_every_projection() {
    let floor = "v -3 -1 3\nv 3 -1 3\nv 3 -1 -3\nv -3 -1 -3\nf 1 2 3 4\n";
    let lamp = "v -0.7 2.5 0.7\nv -0.7 2.5 -0.7\nv 0.7 2.5 -0.7\nv 0.7 2.5 0.7\nusemtl lamp\nf -4 -3 -2 -1\n";
    let folder = folder(&[
        (
            "a.obj",
            &format!(
                "mtllib a.mtl\nusemtl m\n{OCTAHEDRON}{}{lamp}",
                floor.replace("1 2 3 4", "-4 -3 -2 -1")
            ),
        ),
        ("a.mtl", "newmtl m\nKd 0.7 0.6 0.5\nnewmtl lamp\nKd 0 0 0\nKe 6 6 6\n"),
        (
            "s.toml",
            &format!(
                "{HEAD}[camera]\nposition = [0.3, 0.5, 3]\nlook_at = [0, 0, 0]\n{}",
                CONSTANT.replace("= 1", "= 0.2")
            ),
        ),
    ]);
    for projection in PROJECTIONS {
        let flags = format!("--projection {projection} --max-depth 4");
        let expected = regions(&folder, &format!("{flags} --spp 256"), 8);
        for method in UNBIASED {
            let found = regions(&folder, &format!("{flags} --integrator {method} --spp 64"), 8);
            for (region, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert_same_mean(format!("{projection}, {method}, region {region}"), *found, *expected);
            }
        }
        for method in BIASED {
            let found = regions(&folder, &format!("{flags} --integrator {method} --spp 64"), 2);
            for (region, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let ratio = found.value / expected.value;
                assert!(
                    (ratio - 1.0).abs() < 0.04,
                    "{projection}, {method}, region {region}: {ratio}"
                );
            }
        }
    }
}

/// A white convex body in light of radiance 1 is invisible with each integrator.
#[test]
fn furnace_is_even_in_every_projection() {
    let camera = "[camera]\nposition = [0.3, 0.5, 2]\nlook_at = [0, 0, 0]\n";
    let folder = scene(OCTAHEDRON, "Kd 1 1 1", &format!("{camera}{CONSTANT}"));
    for projection in PROJECTIONS {
        let flags = format!("--projection {projection}");
        // The border of the circle of a fisheye is in the image, so these means are not 1.
        let expected = regions(&folder, &format!("{flags} --direct none --reuse none --spp 1024"), 8);
        if !projection.starts_with("fisheye") {
            assert!(
                expected.iter().all(|mean| (mean.value - 1.0).abs() < 1e-4),
                "{projection}: {expected:?}"
            );
        }
        for method in UNBIASED {
            let found = regions(&folder, &format!("{flags} --integrator {method} --spp 64"), 8);
            for (region, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert_same_mean(format!("{projection}, {method}, region {region}"), *found, *expected);
            }
        }
        for method in BIASED {
            let found = regions(&folder, &format!("{flags} --integrator {method} --spp 64"), 2);
            for (region, (found, expected)) in found.iter().zip(&expected).enumerate() {
                assert!(
                    (found.value - expected.value).abs() < 0.05,
                    "{projection}, {method}, region {region}: {found}"
                );
            }
        }
    }
}

/// Without a size, panoramas are twice as wide as high, and cube maps have two rows of three faces.
/// A panorama with another shape causes a warning.
#[test]
fn pictures_of_all_directions_have_their_shape() {
    let folder = folder(&[
        ("a.obj", "v -9 -1 -9\nv 9 -1 -9\nv 0 -1 9\nf 1 2 3\n"),
        (
            "s.toml",
            "version = 1\n[camera]\nprojection = \"panorama\"\n[[object]]\nobj = \"a.obj\"\n\
             [[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n",
        ),
    ]);
    let at = folder.path();
    let words = |line: &str| words(&run(at, &split(line)));
    let place = "--position 0,1,0 --look-at 0,1,1 --spp 1 --denoise=off -o a.exr";
    for (scene, expected) in [
        ("s.toml", "1024x512"),
        ("s.toml --projection cubemap", "1536x1024"),
        ("s.toml --projection perspective", "512x512"),
        ("a.obj --projection panorama", "1024x512"),
    ] {
        let words = words(&format!("render {scene} {place}"));
        assert!(
            words.contains(expected) && !words.contains("squeezed"),
            "{scene}: {words}"
        );
    }
    let words = words(&format!("render s.toml --size 64x64 {place}"));
    assert!(words.contains("64x32"), "{words}");
}
