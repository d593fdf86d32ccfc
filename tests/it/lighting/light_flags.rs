//! Skies, studios, suns and rectangles, as scene files and as flags of the real program.

use crate::support::program::{
    INTEGRATORS, assert_same_bits, code, done, folder, json, printed, refused, run, split, words,
};
use crate::support::{read_channel, read_rgb};
use embrasure::light::LatLongImage;
use embrasure::light::sky::Sky;
use embrasure::light::studio_image;
use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const OBJECT: &str = "version = 1\n[camera]\nposition = [0, 2, 0]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov = 40\n\
                      [image]\nwidth = 8\nheight = 8\n[render]\nsamples = 64\n[[object]]\nobj = 'a.obj'\n";
/// A floor of albedo 0.5 in the plane y = 0. It fills the view from above. Tests append lights to
/// the scene file.
const FLOOR: &str = "mtllib a.mtl\nusemtl grey\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nf 1 2 3 4\n";
const GREY: &str = "newmtl grey\nKd 0.5 0.5 0.5\n";

/// A folder with the floor under `lights`, as `s.toml`.
fn floor(lights: &str) -> TempDir {
    let toml = format!("{OBJECT}{lights}");
    folder(&[("a.obj", FLOOR), ("a.mtl", GREY), ("s.toml", &toml)])
}

/// Mean of each channel of `s.toml`, rendered with `flags`.
fn means(folder: &Path, flags: &str) -> [f64; 3] {
    let args = [&split("render s.toml -q -o x.exr")[..], &split(flags)].concat();
    done(folder, &args);
    let mean = |values: Vec<f32>| values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
    read_rgb(&folder.join("x.exr")).map(mean)
}

fn assert_close(what: &str, got: [f64; 3], expected: [f64; 3], tolerance: f64) {
    for (got, expected) in got.into_iter().zip(expected) {
        assert!(
            (got / expected - 1.0).abs() < tolerance,
            "{what}: {got}, expected {expected}"
        );
    }
}

/// Irradiance on a surface that faces up, from the upper half of a latitude-longitude image.
fn irradiance(image: &LatLongImage) -> [f64; 3] {
    let (width, height) = (image.width, image.height);
    let mut sums = [0.0; 3];
    for (i, texel) in image.texels[..width * height / 2].iter().enumerate() {
        let (sin, cos) = (PI * ((i / width) as f64 + 0.5) / height as f64).sin_cos();
        let weight = cos * sin * (PI / height as f64) * (TAU / width as f64);
        sums.iter_mut()
            .zip(texel.to_array())
            .for_each(|(sum, v)| *sum += f64::from(v) * weight);
    }
    sums
}

#[test]
fn sky_and_studio_light_a_floor_as_their_images() {
    let expected = |image: &LatLongImage| irradiance(image).map(|e| 0.5 * e / PI);
    let sky = floor("[[light]]\ntype = 'sky'\nsun = [30, 25]\nturbidity = 4\n");
    let flags = "--spp 1024 --max-depth 1";
    let image = Sky::new(25.0, 4.0).image();
    assert_close("sky", means(sky.path(), flags), expected(&image), 0.01);
    let scaled = floor("[[light]]\ntype = 'sky'\nsun = [-130, 25]\nturbidity = 4\nscale = 2\n");
    assert_close(
        "scaled",
        means(scaled.path(), flags),
        expected(&image).map(|e| 2.0 * e),
        0.01,
    );
    let studio = floor("[[light]]\ntype = 'studio'\nfront = 70\n");
    assert_close("studio", means(studio.path(), flags), expected(&studio_image()), 0.01);
    // Without a flag and without a key, the documented defaults are used.
    let bare = floor("[[light]]\ntype = 'sky'\n");
    let stated = floor("[[light]]\ntype = 'sky'\nsun = [-45, 45]\nturbidity = 3\nup = [0, 2, 0]\nscale = 1\n");
    means(bare.path(), "");
    means(stated.path(), "");
    assert_same_bits(&bare.path().join("x.exr"), &stated.path().join("x.exr"));
}

/// Under the disc of a sun, a Lambertian floor has the radiance E ρ cos / π. This holds for every
/// integrator and light sampling strategy.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn every_integrator_finds_the_sun() {
    let folder = floor("[[light]]\ntype = 'directional'\ndirection = [1, -1, 0]\nirradiance = [4, 2, 1]\nangle = 20\n");
    let expected = [4.0, 2.0, 1.0].map(|e| 0.5 * e * 0.5f64.sqrt() / PI);
    for integrator in INTEGRATORS.iter().filter(|name| !matches!(**name, "ao" | "debug")) {
        let (samples, tolerance) = match *integrator {
            // The tolerance is at least four standard errors. A wrong factor for the disc or for
            // the cosine would cause a far larger error.
            "naive" => (4096, 0.06),
            "light" | "pssmlt" | "mlt" => (256, 0.04),
            "sppm" | "photon-map" | "vcm" => (16, 0.06),
            _ => (256, 0.03),
        };
        let radius = match *integrator {
            "sppm" | "vcm" | "photon-map" => "--photon-radius 0.02 --photons 100000",
            _ => "",
        };
        let radius = if *integrator == "photon-map" { "" } else { radius };
        let flags = format!("--integrator {integrator} --spp {samples} {radius}");
        assert_close(integrator, means(folder.path(), &flags), expected, tolerance);
    }
}

#[test]
fn a_sun_of_angle_0_is_parallel_light() {
    let light = "[[light]]\ntype = 'directional'\ndirection = [1, -1, 0]\nirradiance = [4, 2, 1]\n";
    let [plain, zero] = [floor(light), floor(&format!("{light}angle = 0\n"))];
    for folder in [&plain, &zero] {
        means(folder.path(), "");
    }
    assert_same_bits(&plain.path().join("x.exr"), &zero.path().join("x.exr"));
    // Rays can hit a disc, but not a single direction.
    let wide = floor(&format!("{light}angle = 10\n"));
    let refusal = refused(plain.path(), &split("render s.toml --integrator naive"), 2);
    assert!(refusal.contains("no ray can hit a directional light"), "{refusal}");
    done(wide.path(), &split("render s.toml --integrator naive --spp 1"));
}

/// The visible disc has the right position, size and radiance.
#[test]
fn sun_disc_has_its_size_and_radiance() {
    let light = "[[light]]\ntype = 'directional'\ndirection = [0, 0, 1]\nirradiance = [3, 3, 3]\nangle = 10\n";
    let folder = floor(light);
    let camera = "--position 0,1,0 --look-at 0,1,-1 --up 0,1,0 --fov 20 --size 64x64 --spp 16";
    let half = 5f64.to_radians();
    let mean = means(folder.path(), camera)[0];
    // Fraction of the film covered by the image of the disc
    let share = PI * (half.tan() / 10f64.to_radians().tan()).powi(2) / 4.0;
    let expected = share * 3.0 / (PI * half.sin().powi(2));
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean} {expected}");
}

#[test]
fn the_sky_turns_with_its_sun_and_its_up() {
    // The camera faces azimuth 180, the direction −z. The sun is first behind the camera, then in
    // front of it.
    let camera = "--position 0,1,0 --look-at 0,1.5,-1 --up 0,1,0 --fov 30 --spp 16";
    let light = |sun: &str| format!("[[light]]\ntype = 'sky'\nsun = {sun}\n");
    let [behind, before] = ["[0, 30]", "[180, 30]"].map(|sun| {
        let folder = floor(&light(sun));
        means(folder.path(), camera)[1]
    });
    assert!(before > 3.0 * behind, "{before} {behind}");
    // With z up, azimuth 0 is −y, and the sky is above +z.
    let z_up = |at: &str| {
        let folder = floor("[[light]]\ntype = 'sky'\nsun = [0, 30]\nup = [0, 0, 1]\n");
        means(
            folder.path(),
            &format!("--position 5,1,0 --look-at {at} --up 1,0,0 --fov 30 --spp 16"),
        )[1]
    };
    let [towards, away, ground] = ["5,0.134,0.5", "5,1.866,0.5", "5,1.5,-1"].map(z_up);
    assert!(towards > 3.0 * away && ground < away, "{towards} {away} {ground}");
}

#[test]
fn a_rectangle_lights_one_side() {
    let lamp = |direction: &str| {
        floor(&format!(
            "[[light]]\ntype = 'rectangle'\nposition = [0, 1, 0]\ndirection = {direction}\nsize = [1, 0.5]\nradiance = [9, 9, 9]\ngroup = 'lamp'\n"
        ))
    };
    let down = lamp("[0, -1, 0]");
    let expected = {
        let (a, b) = (0.5, 0.25);
        let (ra, rb) = (1f64.hypot(a), 1f64.hypot(b));
        let quarter = (a / ra * f64::atan(b / ra) + b / rb * f64::atan(a / rb)) / (2.0 * PI);
        0.5 * 9.0 * 4.0 * quarter
    };
    let flags = "--spp 256 --max-depth 1 --position 0,0.5,0 --fov 1 --aov lights";
    assert_close("rectangle", means(down.path(), flags), [expected; 3], 0.02);
    // All light belongs to the group of the lamp.
    let [grouped, whole] = ["light_lamp.R", "R"].map(|name| read_channel(&down.path().join("x.exr"), name));
    assert_eq!(grouped, whole);
    // The lamp hides objects behind it, and emits to one side only.
    let up = lamp("[0, 1, 0]");
    assert_eq!(means(up.path(), "--spp 16 --max-depth 1 --position 0,0.5,0"), [0.0; 3]);
    let info = json(&done(down.path(), &split("info s.toml --json")));
    assert_eq!(info["lights"]["rectangle"], 1);
    assert_eq!(info["materials"][1]["name"], "rectangle light");
    let check = printed(&done(down.path(), &split("check s.toml")));
    assert!(check.contains("0 errors, 0 warnings"), "{check}");
}

#[test]
fn invalid_light_keys_are_errors() {
    let sky = "[[light]]\ntype = 'sky'\n";
    let studio = "[[light]]\ntype = 'studio'\n";
    let sun = "[[light]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n";
    let rectangle = "[[light]]\ntype = 'rectangle'\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nsize = [1, 1]\nradiance = [1, 1, 1]\n";
    let line = OBJECT.lines().count() + 3;
    for (light, key, words) in [
        (sky, "sun = [0, 91]", ["sky light: sun is [0, 91]", "-90 and 90"]),
        (sky, "sun = [nan, 5]", ["sky light: sun is [NaN, 5]", "finite"]),
        (sky, "sun = 5", ["found `5`", "a list of 2 values"]),
        (sky, "turbidity = 1", ["turbidity is 1", "2 (very clear) and 10"]),
        (sky, "turbidity = 11", ["turbidity is 11", "2 (very clear) and 10"]),
        (sky, "up = [0, 0, 0]", ["sky light: up is [0, 0, 0]", "not zero"]),
        (sky, "scale = -1", ["sky light: scale is -1", "0 or more"]),
        (
            sky,
            "front = 1",
            ["a sky light has no `front`", "its keys are sun, turbidity, up, scale"],
        ),
        (
            studio,
            "up = [0, inf, 0]",
            ["studio light: up is [0, inf, 0]", "finite"],
        ),
        (studio, "front = inf", ["studio light: front is inf", "finite"]),
        (studio, "scale = nan", ["studio light: scale is NaN", "0 or more"]),
        (
            studio,
            "sun = [0, 1]",
            ["a studio light has no `sun`", "its keys are up, front, scale"],
        ),
        (
            sun,
            "angle = -1",
            ["directional light: angle is -1", "0.01 to 180 degrees"],
        ),
        (
            sun,
            "angle = 181",
            ["directional light: angle is 181", "0.01 to 180 degrees"],
        ),
        (
            sun,
            "angle = 0.001",
            ["directional light: angle is 0.001", "0.01 to 180 degrees"],
        ),
        (
            sun,
            "angle = nan",
            ["directional light: angle is NaN", "0.01 to 180 degrees"],
        ),
        (
            sun,
            "size = [1, 1]",
            [
                "a directional light has no `size`",
                "its keys are direction, irradiance, angle",
            ],
        ),
        (
            rectangle,
            "up = [0, 1, 0]",
            ["rectangle light: up is [0, 1, 0]", "along the direction"],
        ),
        (
            rectangle,
            "scale = 1",
            [
                "a rectangle light has no `scale`",
                "position, direction, size, radiance, up",
            ],
        ),
    ] {
        let folder = floor(&format!("{light}{key}\n"));
        let said = refused(folder.path(), &split("render s.toml --spp 1"), 1);
        let line = line + light.lines().count() - 2;
        assert!(said.contains(&format!("s.toml:{line}:")), "{key}: {said}");
        assert!(words.iter().all(|word| said.contains(word)), "{key}: {said}");
    }
    for (from, to, word) in [
        ("size = [1, 1]", "size = [1, 0]", "size is [1, 0]"),
        ("size = [1, 1]", "size = [nan, 1]", "size is [NaN, 1]"),
        ("size = [1, 1]\n", "", "a rectangle light needs `size`"),
        (
            "position = [0, 1, 0]",
            "position = [0, 1e11, 0]",
            "position is [0, 100000000000, 0]",
        ),
        ("position = [0, 1, 0]\n", "", "a rectangle light needs `position`"),
        (
            "direction = [0, -1, 0]",
            "direction = [0, 0, 0]",
            "direction is [0, 0, 0]",
        ),
        (
            "radiance = [1, 1, 1]",
            "radiance = [1, 1, -1]",
            "radiance is [1, 1, -1]",
        ),
        ("'rectangle'", "'square'", "sky, studio, rectangle, sphere and disk"),
    ] {
        let folder = floor(&rectangle.replace(from, to));
        let said = refused(folder.path(), &split("render s.toml --spp 1"), 1);
        assert!(said.contains(word), "{to}: {said}");
    }
    // A sun below the horizon is a sky at night, and not an error.
    let night = floor("[[light]]\ntype = 'sky'\nsun = [0, -90]\nup = [0.1, -1, 0]\n");
    assert!(means(night.path(), "--spp 1").iter().all(|v| *v >= 0.0));
}

#[test]
fn env_flag_equals_the_environment_section() {
    let light = "[[light]]\ntype = 'constant'\nradiance = [1, 0, 0]\n[[light]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = [0, 0, 1]\n";
    let folder = floor(light);
    let directional = "[[light]]\ntype = 'directional'\ndirection = [0, -1, 0]\nirradiance = [0, 0, 1]\n";
    ::exr::prelude::write_rgb_file(folder.path().join("e.exr"), 8, 4, |x, y| (x as f32, y as f32, 1.0f32)).unwrap();
    for (flag, section) in [
        ("sky", "type = 'sky'"),
        ("studio", "type = 'studio'"),
        ("white", "type = 'constant'\nradiance = [1, 1, 1]"),
        ("black", "type = 'constant'\nradiance = [0, 0, 0]"),
        ("0.5", "type = 'constant'\nradiance = [0.5, 0.5, 0.5]"),
        ("0.5,1,2", "type = 'constant'\nradiance = [0.5, 1, 2]"),
        ("#ff00ff", "type = 'constant'\nradiance = [1, 0, 1]"),
        ("e.exr", "type = 'environment'\nimage = 'e.exr'"),
    ] {
        means(folder.path(), &format!("--env {flag}"));
        let said = floor(&format!("{directional}[[light]]\n{section}\n"));
        fs::copy(folder.path().join("e.exr"), said.path().join("e.exr")).unwrap();
        means(said.path(), "");
        assert_same_bits(&folder.path().join("x.exr"), &said.path().join("x.exr"));
    }
    // Paths in a scene file are relative to the file; paths on the command line, to the current
    // folder.
    let above = tempfile::tempdir().unwrap();
    fs::create_dir(above.path().join("scene")).unwrap();
    for name in ["a.obj", "a.mtl", "s.toml"] {
        fs::copy(folder.path().join(name), above.path().join("scene").join(name)).unwrap();
    }
    fs::copy(folder.path().join("e.exr"), above.path().join("e.exr")).unwrap();
    done(above.path(), &split("render scene/s.toml --env e.exr --spp 1"));
    let said = refused(above.path(), &split("render scene/s.toml --env scene/e.exr --spp 1"), 2);
    assert!(
        said.contains("--env scene/e.exr: environment") && said.contains("no such"),
        "{said}"
    );
    // The output may not overwrite the environment image.
    let said = refused(
        above.path(),
        &split("render scene/s.toml --env e.exr --spp 1 -o e.exr"),
        2,
    );
    assert!(said.contains("e.exr"), "{said}");
    let bare = refused(folder.path(), &split("render a.obj --env none.hdr --spp 1"), 2);
    assert!(bare.contains("--env none.hdr: environment"), "{bare}");
}

#[test]
fn suns_and_key_lights_are_added() {
    let folder = floor("[[light]]\ntype = 'sky'\nturbidity = 5\n");
    let kinds = |flags: &str| {
        let args = [&split("info s.toml --json")[..], &split(flags)].concat();
        json(&done(folder.path(), &args))["lights"].clone()
    };
    assert_eq!(kinds("")["sky"], 1);
    let lights = kinds("--env studio --sun 10,20 --key-light");
    assert_eq!(
        (&lights["studio"], &lights["sky"], &lights["directional"]),
        (&1.into(), &0.into(), &2.into())
    );
    // The third number of `--sun` is the luminance of the irradiance of the sun. This light is
    // added to the light of the sky, whose sun moves to the same direction.
    let luminance = |[r, g, b]: [f64; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let flags = "--spp 1024 --max-depth 1";
    let both = luminance(means(folder.path(), &format!("--sun -30,30,2 {flags}")));
    let moved = floor("[[light]]\ntype = 'sky'\nturbidity = 5\nsun = [-30, 30]\n");
    let sky = luminance(means(moved.path(), flags));
    let sun = 0.5 * 2.0 * 0.5 / PI;
    assert!((both - sky - sun).abs() < 0.01 * both, "{both} {sky} {sun}");
    // The sun without the sky has a colour that depends on its elevation
    let dark = floor("");
    let alone = means(dark.path(), &format!("--sun 120,30 {flags}"));
    assert!(
        (luminance(alone) / (0.5 * 3.0 * 0.5 / PI) - 1.0).abs() < 0.01,
        "{alone:?}"
    );
    assert!(alone[0] > alone[2]);
    // The key light of a camera that faces down comes from its upper left. Its irradiance depends
    // on its angle to the floor.
    for (flag, strength) in [("--key-light", 2.0), ("--key-light=3", 3.0), ("--key-light 3", 3.0)] {
        let key = means(dark.path(), &format!("{flag} {flags}"));
        let cosine = 40f64.to_radians().cos().powi(2);
        assert!(
            (key[0] / (0.5 * strength * cosine / PI) - 1.0).abs() < 0.01,
            "{flag}: {key:?}"
        );
        assert_eq!(key[0], key[1]);
    }
    // If the camera has +z up, the sky has +z up too.
    let z_up = |env: &str| luminance(means(dark.path(), &format!("{env} --up 0,0.1,1 {flags}")));
    let said = floor("[[light]]\ntype = 'sky'\nup = [0, 0, 1]\n");
    assert_eq!(
        z_up("--env sky"),
        luminance(means(said.path(), &format!("--up 0,0.1,1 {flags}")))
    );
    // Flags of the camera rotate the key light.
    let side = means(dark.path(), &format!("--key-light --position 0,0.5,0.5 {flags}"));
    assert!(side != means(dark.path(), &format!("--key-light {flags}")));
}

#[test]
fn invalid_light_flags_are_errors() {
    let folder = floor("");
    for (flags, parts) in [
        (
            "--env sunset",
            [
                "--env",
                "studio, sky, none, an .hdr or .exr file or a colour is expected: #ffc356 (sRGB), a CSS name",
            ],
        ),
        ("--env stduio", ["--env", "did you mean studio"]),
        ("--env 1,2", ["--env", "linear numbers: 0.5 or 0.2,0.3,0.4"]),
        ("--env -1", ["--env", "0 or more"]),
        ("--env nan", ["--env", "finite"]),
        ("--env #ff", ["--env", "a colour is expected"]),
        ("--sun 10", ["--sun", "azimuth and elevation"]),
        ("--sun 10,0", ["--sun", "above 0 and at most 90"]),
        ("--sun 10,-5", ["--sun", "above 0 and at most 90"]),
        ("--sun 10,91", ["--sun", "above 0 and at most 90"]),
        ("--sun inf,9", ["--sun", "azimuth must be finite"]),
        ("--sun 10,9,-1", ["--sun", "strength must be finite and 0 or more"]),
        ("--key-light=-1", ["--key-light", "0 or more"]),
        ("--key-light=x", ["--key-light", "0 or more"]),
    ] {
        for command in ["render", "info", "check"] {
            let args = [&[command, "s.toml"][..], &split(flags)].concat();
            let out = run(folder.path(), &args);
            assert_eq!(code(&out), 2, "{flags}: {}", words(&out));
            assert!(
                parts.iter().all(|part| words(&out).contains(part)),
                "{flags}: {}",
                words(&out)
            );
        }
    }
    let png = folder.path().join("e.png");
    fs::write(png, "no").unwrap();
    let said = refused(folder.path(), &split("render s.toml --env e.png --spp 1"), 2);
    assert!(said.contains(".hdr or .exr"), "{said}");
}

/// Skies and studios are bit-identical for any number of threads.
#[test]
fn threads_change_no_bit_of_skies() {
    let folder = floor("");
    for env in ["sky --sun -60,35 --key-light", "studio"] {
        let render = |name: &str, threads: u32| {
            let line = format!("render s.toml -q --env {env} --threads {threads} -o {name}");
            done(folder.path(), &split(&line));
            folder.path().join(name)
        };
        assert_same_bits(&render("a.exr", 1), &render("b.exr", 3));
    }
}

#[test]
fn check_reports_the_light_power() {
    let folder = floor("[[light]]\ntype = 'sky'\n");
    let report = json(&done(folder.path(), &split("check s.toml --json --sun 10,20")));
    let power = &report["light_power_w"];
    assert!(power["sky"].as_f64().unwrap() > 0.0 && power["directional"].as_f64().unwrap() > 0.0);
    let report = printed(&done(folder.path(), &split("check s.toml --env studio")));
    assert!(report.contains("studio"), "{report}");
    let info = printed(&done(folder.path(), &split("info s.toml")));
    assert!(info.contains("1 sky"), "{info}");
}
