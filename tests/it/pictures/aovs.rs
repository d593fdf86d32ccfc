//! Additional channels: their values. Their bits are the same for any number of threads, for merged
//! parts of a render, and after interruptions.

use crate::support::program::{assert_same_bits, done, folder, joined, refused, split};
use crate::support::{matte, read_channel, read_rgb};
use std::path::Path;
use tempfile::TempDir;

const WIDTH: usize = 48;
const HEIGHT: usize = 32;

/// Camera at (0, 0, 10) with a vertical field of 2 units in the plane z = 0: pixels are 1/16 wide
/// there. In the background is a wall with texture coordinates. A card at z = 1 in its right half
/// moves by (0.5, 0.25, 0). A second copy of the card is far to the left.
fn scene() -> TempDir {
    let fov = 2.0 * (1.0f64 / 10.0).atan().to_degrees();
    folder(&[
        (
            "a.mtl",
            "newmtl stone\nKd 0.5 0.5 0.5\nnewmtl \"paper\"\nKd 0.2 0.3 0.2\n",
        ),
        (
            "wall.obj",
            "mtllib a.mtl\nv -3 -2 0\nv 3 -2 0\nv 3 2 0\nv -3 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl stone\nf 1/1 2/2 3/3 4/4\n",
        ),
        (
            "card.obj",
            "v 0 -2 0\nv 0.9 -2 0\nv 0.9 2 0\nv 0 2 0\nusemtl \"paper\"\nmtllib a.mtl\nf 1 2 3 4\n",
        ),
        (
            "s.toml",
            &format!(
                "version = 1\n[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nvertical_fov = {fov}\n\
                 [image]\nwidth = {WIDTH}\nheight = {HEIGHT}\n[[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n\
                 [[object]]\nobj = \"wall.obj\"\n\
                 [[object]]\nname = \"card of \\\"paper\\\"\"\nobj = \"card.obj\"\ntransform = {{ translate = [0, 0, 1] }}\n\
                 transform_close = {{ translate = [0.5, 0.25, 1] }}\n\
                 [[object]]\nobj = \"card.obj\"\ntransform = {{ translate = [-1.4, 0, 0.5] }}\n"
            ),
        ),
    ])
}

/// Value of a channel at column `x` and row `y`.
fn at(path: &Path, channel: &str, x: usize, y: usize) -> f32 {
    read_channel(path, channel)[y * WIDTH + x]
}

/// In a white sky, the radiance of a single surface is its reflectance.
#[test]
fn albedo_equals_radiance_in_a_white_furnace() {
    let gold = "specular = 1.0\neta = [0.2, 0.4, 1.4]\nk = [3.9, 2.4, 1.6]\n";
    let materials = [
        (format!("{gold}model = \"mirror\""), [0.952, 0.793, 0.327]),
        (format!("{gold}roughness = 0.3"), [0.951, 0.791, 0.326]),
        ("specular = 1.0\nmodel = \"ggx\"\nior = 1.5".into(), [0.04; 3]),
        ("diffuse = 0.2\nclearcoat = 1.0".into(), [0.232; 3]),
    ];
    for (material, expected) in materials {
        let scene = format!(
            "version = 1\n[camera]\nposition = [0, 0, 40]\nlook_at = [0, 0, 0]\nvertical_fov = 2\n\
             [image]\nwidth = 8\nheight = 8\n[[object]]\nobj = \"o.obj\"\n[material.m]\n{material}\n\
             [[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n"
        );
        let quad = "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nusemtl m\nf 1 2 3 4\n";
        let folder = folder(&[("o.obj", quad), ("s.toml", &scene)]);
        done(folder.path(), &split("render s.toml -q --spp 256 -o a.exr"));
        let file = folder.path().join("a.exr");
        let mean = |name: &str| {
            let values = read_channel(&file, name);
            values.iter().sum::<f32>() / values.len() as f32
        };
        for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
            let (light, albedo) = (mean(channel), mean(&format!("albedo.{channel}")));
            assert!((albedo - expected[c]).abs() < 2e-3, "{material}: {albedo}");
            assert!((light - albedo).abs() < 5e-3, "{material}: {light}, albedo {albedo}");
        }
    }
}

/// Mirrors and clear glass have the albedo, times their tint, and the normal of the surface that
/// they show. Depth and position are those of the mirror and the glass.
#[test]
fn albedo_and_normal_are_of_the_surface_behind_mirrors_and_glass() {
    let wall = "v -9 -9 -5\nv 9 -9 -5\nv 9 9 -5\nv -9 9 -5\nusemtl paint\nf 1 2 3 4\n";
    let side = "v -5 -9 9\nv -5 -9 -9\nv -5 9 -9\nv -5 9 9\nusemtl paint\nf 1 2 3 4\n";
    // Turned by 45° between the camera and the side
    let mirror = "v -1 -1 -1\nv 1 -1 1\nv 1 1 1\nv -1 1 -1\nusemtl m\nf 4 3 2 1\n";
    let slab = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nusemtl m\n\
                f 5 6 7 8\nf 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    let sheet = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nusemtl m\nf 1 2 3 4\n";
    let silver = "model = \"mirror\"\nspecular = [0.9, 0.8, 0.7]";
    let glass = "transmission = 1\nior = 1.5\nroughness = 0";
    let half = 0.5f32.sqrt();
    let (paint, toward) = ([0.2, 0.4, 0.6], [0.0, 0.0, 1.0]);
    let painted = [0.9 * 0.2, 0.8 * 0.4, 0.7 * 0.6];
    let blue = [0.16, 0.32, 0.58];
    // Two surfaces reflect 0.04 each.
    let paint_behind = paint.map(|albedo: f32| 0.04 + 0.96 * (0.04 + 0.96 * albedo));
    for (name, thing, other, material, albedo, normal) in [
        ("mirror", mirror, side, silver, painted, [1.0, 0.0, 0.0]),
        (
            "mirror of nothing",
            mirror,
            wall,
            silver,
            [0.9, 0.8, 0.7],
            [-half, 0.0, half],
        ),
        // The diffuse rest of the mirror adds its own albedo.
        (
            "blue mirror",
            mirror,
            side,
            "model = \"mirror\"\nspecular = 0.8\ndiffuse = [0, 0, 0.1]",
            blue,
            [1.0, 0.0, 0.0],
        ),
        (
            "glazed",
            sheet,
            wall,
            "diffuse = 0.5\nspecular = 0.04\nmodel = \"mirror\"",
            [0.54; 3],
            toward,
        ),
        ("glass", slab, wall, glass, paint_behind, toward),
        (
            "rough mirror",
            sheet,
            wall,
            "specular = 0.5\nroughness = 0.4",
            [0.5; 3],
            toward,
        ),
    ] {
        let scene = format!(
            "version = 1\n[camera]\nposition = [0, 0, 40]\nlook_at = [0, 0, 0]\nvertical_fov = 1\n\
             [image]\nwidth = 8\nheight = 8\n[[object]]\nobj = \"thing.obj\"\n[[object]]\nobj = \"other.obj\"\n\
             [material.m]\n{material}\n[material.paint]\ndiffuse = [0.2, 0.4, 0.6]\n\
             [[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n"
        );
        let folder = folder(&[("thing.obj", thing), ("other.obj", other), ("s.toml", &scene)]);
        for integrator in ["path", "bdpt", "photon-map"] {
            let flags = [
                "render",
                "s.toml",
                "-q",
                "--spp",
                "4",
                "--integrator",
                integrator,
                "-o",
                "a.exr",
            ];
            done(folder.path(), &flags);
            let file = folder.path().join("a.exr");
            for (c, [of_albedo, of_normal]) in [["R", "X"], ["G", "Y"], ["B", "Z"]].into_iter().enumerate() {
                let mean = |channel: String| read_channel(&file, &channel).iter().sum::<f32>() / 64.0;
                let found = [mean(format!("albedo.{of_albedo}")), mean(format!("N.{of_normal}"))];
                let expected = [albedo[c], normal[c]];
                assert!(
                    found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 6e-3),
                    "{name}, {integrator}, {c}: {found:?}, not {expected:?}"
                );
            }
            let depth = read_channel(&file, "Z").iter().sum::<f32>() / 64.0;
            assert!((depth - 40.0).abs() < 0.6, "{name}, {integrator}: {depth}");
        }
    }
}

#[test]
fn channels_have_position_uv_motion_and_id() {
    let folder = scene();
    let path = folder.path().join("o.exr");
    done(folder.path(), &split("render s.toml -q --spp 64 --aov all -o o.exr"));

    // A pixel of the wall, in the middle of the left half, with nothing else in it.
    let (x, y) = (18, 9);
    let (px, py) = ((x as f32 + 0.5 - 24.0) / 16.0, (16.0 - y as f32 - 0.5) / 16.0);
    let near = |a: f32, b: f32| assert!((a - b).abs() < 2e-3, "{a} is not {b}");
    near(at(&path, "P.X", x, y), px);
    near(at(&path, "P.Y", x, y), py);
    near(at(&path, "P.Z", x, y), 0.0);
    near(at(&path, "uv.U", x, y), (px + 3.0) / 6.0);
    near(at(&path, "uv.V", x, y), (py + 2.0) / 4.0);
    assert_eq!((at(&path, "motion.X", x, y), at(&path, "motion.Y", x, y)), (0.0, 0.0));
    assert_eq!(
        (at(&path, "id.object", x, y), at(&path, "id.material", x, y)),
        (1.0, 1.0)
    );

    // The moving card at distance 9 moves by 0.5 and 0.25. Its pixels are 0.9 / 16 wide.
    let (x, y) = (24 + 13, 20);
    near(at(&path, "motion.X", x, y) / (0.5 * 16.0 / 0.9), 1.0);
    near(at(&path, "motion.Y", x, y) / (0.25 * 16.0 / 0.9), 1.0);
    near(at(&path, "P.Z", x, y), 1.0);
    assert_eq!(
        (at(&path, "id.object", x, y), at(&path, "id.material", x, y)),
        (2.0, 2.0)
    );
    // The second card does not move
    assert_eq!(
        (at(&path, "id.object", 5, y), at(&path, "id.material", 5, y)),
        (3.0, 2.0)
    );
    assert_eq!(at(&path, "motion.X", 5, y), 0.0);
}

#[test]
fn mattes_are_read_back() {
    let folder = scene();
    let path = folder.path().join("o.exr");
    done(
        folder.path(),
        &split("render s.toml -q --spp 256 --aov cryptomatte -o o.exr"),
    );
    let area = |share: &[f32]| share.iter().sum::<f32>();
    let wall = matte(&path, "CryptoObject", "wall");
    let moving = matte(&path, "CryptoObject", "card of \"paper\"");
    let standing = matte(&path, "CryptoObject", "card");
    for ((w, m), s) in wall.iter().zip(&moving).zip(&standing) {
        assert!((w + m + s - 1.0).abs() < 1e-5, "{w} + {m} + {s}");
    }
    // Each card is 0.9 wide and covers all rows. At the distance 9.5 of the still card, pixels are
    // 0.95 / 16 wide, and the left edge is at -24.6 pixels.
    let (left, right): (f32, f32) = (-1.4 * 16.0 / 0.95, -0.5 * 16.0 / 0.95);
    let expected = HEIGHT as f32 * (right - left);
    assert!(
        (area(&standing) / expected - 1.0).abs() < 0.01,
        "{} {expected}",
        area(&standing)
    );
    // The moving card is 16 pixels wide. It covers columns 0 to 16 at first and 8.9 to 24.9 at the
    // end, but the image ends at 24. The expected coverage is the average over time.
    let expected = HEIGHT as f32 * 0.9 * 16.0 / 0.9;
    assert!(
        (area(&moving) / expected - 1.0).abs() < 0.02,
        "{} {expected}",
        area(&moving)
    );
    let row = &moving[10 * WIDTH + 24..11 * WIDTH];
    assert!(row[0] < 0.2 && row[12] > 0.99 && row[23] < 0.2, "{row:?}");
    // The two cards have the same material, so the layer of materials has both.
    let paper = matte(&path, "CryptoMaterial", "\"paper\"");
    for ((p, m), s) in paper.iter().zip(&moving).zip(&standing) {
        assert!((p - m - s).abs() < 1e-5);
    }
}

#[test]
fn aovs_and_parts_change_no_bit() {
    let folder = scene();
    let usual = split("render s.toml -q --spp 160");
    let render = |more: &[&str]| done(folder.path(), &joined(&usual, more));
    let path = |name: &str| folder.path().join(name);
    render(&["-o", "plain.exr"]);
    render(&["-o", "all.exr", "--aov", "all", "--threads", "1"]);
    assert_eq!(read_rgb(&path("plain.exr")), read_rgb(&path("all.exr")));
    render(&["-o", "a.exr", "--aov", "all", "--samples", "0..64"]);
    render(&split("-o b.exr --aov all --samples 64..160 --threads 3"));
    done(folder.path(), &["merge", "-q", "b.exr", "a.exr", "-o", "merged.exr"]);
    // Resume a render that ended in the middle of a block of 64 samples
    let state = ["--aov", "all", "--checkpoint", "c.exr", "--resume", "-o", "resumed.exr"];
    done(
        folder.path(),
        &[&["render", "s.toml", "-q", "--spp", "100"], &state[..]].concat(),
    );
    render(&state);
    for other in ["merged.exr", "resumed.exr"] {
        assert_same_bits(&path("all.exr"), &path(other));
    }
}

/// There is a dot for each photon. The fraction of a pixel that dots cover follows the local photon
/// density. Records of the irradiance cache also have dots, and paths have none.
#[test]
fn points_are_as_dense_as_photons() {
    let folder = folder(&[("a.txt", "")]);
    let (at, path) = (folder.path(), folder.path().join("o.exr"));
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
    let render = |more: &str| {
        let command = format!(
            "render {} -q --size 48x48 --aov P,points -o o.exr {more}",
            scene.display()
        );
        done(at, &split(&command));
        ["dots", "radius", "count", "caustics"].map(|name| read_channel(&path, &format!("points.{name}")))
    };
    let [dots, radii, counts, caustics] = render("--integrator photon-map --photons 4000 --spp 16");
    let width = 2.0 * (0.5 * 39.3f32.to_radians()).tan() / 48.0;
    let (mut found, mut expected) = (0.0, 0.0);
    let position = ["P.X", "P.Y", "P.Z"].map(|name| read_channel(&path, name));
    for i in (0..dots.len()).filter(|&i| counts[i] > 0.0) {
        let camera = [278.0, 273.0, -800.0];
        let squares = [0, 1, 2].map(|axis| (position[axis][i] - camera[axis]).powi(2));
        let dot = 0.5 * width * squares.iter().sum::<f32>().sqrt();
        found += dots[i];
        expected += 1.0 - (-counts[i] * (dot / radii[i]).powi(2)).exp();
    }
    println!("{found} pixels of dots, {expected} expected");
    assert!(
        expected > 50.0 && (found / expected - 1.0).abs() < 0.15,
        "{found}, {expected}"
    );
    assert!(caustics.iter().all(|light| *light == 0.0));

    // A ring casts its caustic on the floor around it. The photon map has this light near the ring,
    // and no light at the far edge.
    let ring = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/ring-caustic.toml");
    let more = "--integrator photon-map --photons 20000 --spp 4 --size 64x48 --aov points -q -o r.exr";
    done(at, &split(&format!("render {} {more}", ring.display())));
    let caustics = read_channel(&at.join("r.exr"), "points.caustics");
    let lit = caustics.iter().filter(|light| **light > 0.0).count();
    assert!((100..1200).contains(&lit), "{lit} of 3072 pixels");
    assert!(caustics[..64].iter().all(|light| *light == 0.0));

    let [dots, radii, counts, _] = render("--integrator irradiance-cache --spp 16");
    // The irradiance in a room varies everywhere. Its change across the room is about as large as
    // the irradiance itself.
    let gradient = read_channel(&path, "points.gradient");
    let known: Vec<f32> = gradient
        .into_iter()
        .zip(&counts)
        .filter(|(_, count)| **count > 0.9)
        .map(|(g, _)| g)
        .collect();
    let mean = known.iter().sum::<f32>() / known.len() as f32;
    let across = 555.0 * mean;
    assert!(
        known.iter().all(|g| *g > 0.0 && g.is_finite()) && (0.05..1.0).contains(&across),
        "{across}"
    );
    let max = dots.iter().filter(|share| **share > 0.0).count();
    assert!(max > 20 && max < 48 * 48 / 2, "{max}");
    assert!(
        counts
            .iter()
            .zip(&radii)
            .filter(|(n, r)| **n >= 1.0 && **r > 0.0)
            .count()
            > 1000
    );
    let message = refused(
        at,
        &split(&format!("render {} --aov points -o p.exr", scene.display())),
        2,
    );
    assert!(
        message.contains("use --integrator photon-map or irradiance-cache"),
        "{message}"
    );
}
