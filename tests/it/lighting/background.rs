//! Backgrounds and alpha: coverage, compositing, and all flags and keys through the real program.
//! Also invalid values of the ground.

use crate::support::program::{INTEGRATORS, assert_same_bits, done, folder, joined, json, refused, split};
use crate::support::*;
use embrasure::color::srgb;
use std::path::Path;
use tempfile::TempDir;

/// A card whose left edge is at the middle of the image, a card of opacity 0.25 below it, a square
/// of glass and a lamp.
pub fn stage(more: &str) -> TempDir {
    let fov = 2.0 * (1.0f64 / 10.0).atan().to_degrees();
    folder(&[
        (
            "a.mtl",
            "newmtl paper\nKd 0.5 0.5 0.5\nnewmtl veil\nKd 0.5 0.5 0.5\nd 0.25\nnewmtl glass\nTf 1 1 1\nNi 1.5\nillum 4\n\
             newmtl lamp\nKe 2 2 2\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nusemtl paper\nf 1 2 3 4\n\
             v 0 -2 0\nv 2 -2 0\nusemtl veil\nf 5 6 2 1\n\
             v -0.8 0.2 0\nv -0.2 0.2 0\nv -0.2 0.8 0\nv -0.8 0.8 0\nusemtl glass\nf 7 8 9 10\n\
             v -0.8 -0.8 0\nv -0.5 -0.8 0\nv -0.5 -0.5 0\nusemtl lamp\nf 11 12 13\n",
        ),
        (
            "s.toml",
            &format!(
                "version = 1\n[camera]\nposition = [0, 0, 10]\nlook_at = [0, 0, 0]\nvertical_fov = {fov}\n\
                 [image]\nwidth = 31\nheight = 31\n{more}\n[[light]]\ntype = \"constant\"\nradiance = [0.6, 0.6, 0.6]\n\
                 [[object]]\nobj = \"a.obj\"\n"
            ),
        ),
    ])
}

/// Value of a channel at column `x` and row `y` of the image of the stage.
pub fn at(path: &Path, channel: &str, x: usize, y: usize) -> f32 {
    read_channel(path, channel)[y * 31 + x]
}

#[test]
fn alpha_is_coverage() {
    let folder = stage("background = \"transparent\"");
    let path = folder.path().join("o.exr");
    done(folder.path(), &split("render s.toml -q --spp 256 -o o.exr -o o.png"));
    let alpha = |x, y| at(&path, "A", x, y);
    // Alpha is 1 in a covered pixel, 0 in an empty pixel, and 1 on glass and lamps. It is 0.5 in a
    // half covered pixel, 0.25 on a surface of opacity 0.25, and 0.125 in a pixel that this surface
    // half covers.
    assert_eq!((alpha(25, 5), alpha(2, 15), alpha(8, 8)), (1.0, 0.0, 1.0));
    assert!((alpha(15, 5) - 0.5).abs() < 0.01, "{}", alpha(15, 5));
    assert!((alpha(25, 25) - 0.25).abs() < 0.06, "{}", alpha(25, 25));
    assert!((alpha(15, 25) - 0.125).abs() < 0.05, "{}", alpha(15, 25));
    // Colours are premultiplied. The radiance of the paper is 0.3, so the value of a pixel is 0.3
    // times its alpha.
    let red = |x, y| at(&path, "R", x, y);
    assert!((red(25, 5) - 0.3).abs() < 0.02 && (red(15, 5) - 0.3 * alpha(15, 5)).abs() < 0.02);
    assert_eq!(red(2, 15), 0.0);

    // Browsers blend the 8-bit codes of a PNG over a page. The result equals a blend of linear
    // light.
    let (channels, bytes) = read_codes(&folder.path().join("o.png"));
    assert_eq!(channels, 4);
    let pixel = |x: usize, y: usize| &bytes[4 * (y * 31 + x)..][..4];
    assert_eq!((pixel(2, 15), pixel(25, 5)[3]), (&[0, 0, 0, 0][..], 255));
    for (x, y) in [(15, 5), (25, 25), (15, 25)] {
        for behind in [0.0, 1.0] {
            let [grey, a] = [pixel(x, y)[0], pixel(x, y)[3]].map(|code| f32::from(code) / 255.0);
            let blended = a * grey + (1.0 - a) * behind;
            let expected = srgb::encode(red(x, y) + (1.0 - alpha(x, y)) * behind);
            assert!(
                (blended - expected).abs() < 1.5 / 255.0,
                "{x} {y}: {blended}, not {expected}"
            );
        }
    }
    // Other images have no alpha channel.
    done(
        folder.path(),
        &split("render s.toml -q --spp 4 --background light -o l.exr"),
    );
    let said = std::fs::read(folder.path().join("l.exr")).unwrap();
    assert!(!String::from_utf8_lossy(&said[..2000]).contains("background=transparent"));
}

/// A transparent image over a constant background is the opaque image, for all integrators and
/// filters that support alpha.
#[test]
fn transparent_over_a_color_is_the_opaque_image() {
    let color = [0.3f32, 0.5, 0.7];
    let folder = stage("[ground]\npoint = [0, -0.3, 0]");
    let mut kinds = 0;
    let ways = INTEGRATORS.iter().map(|name| format!("--integrator {name}"));
    let filters = ["tent", "gaussian", "mitchell", "blackman-harris"].map(|name| format!("--filter {name}"));
    let more = [
        "--reuse none",
        "--backend brute",
        "--sampler independent",
        "--spp 3",
        "--aov lights",
    ]
    .map(String::from);
    for way in ways.chain(filters).chain(more) {
        let has_background = !["light", "bdpt", "pssmlt", "mlt", "vcm"]
            .iter()
            .any(|name| way.ends_with(name));
        if !has_background || way.ends_with("lights") {
            continue;
        }
        // Integrators that do not support a shadow-catching ground render without it
        let has_ground = !["ao", "debug", "sppm", "photon-map", "irradiance-cache"]
            .iter()
            .any(|name| way.ends_with(name));
        let ground = if has_ground { "--ground" } else { "--no-ground" };
        let render = |background: &str, name: &str| {
            let line = format!("render s.toml -q --spp 8 {ground} {way} --background {background} -o {name}");
            let line = if way.starts_with("--spp") {
                line.replacen("--spp 8 ", "", 1)
            } else {
                line
            };
            done(folder.path(), &split(&line));
            folder.path().join(name)
        };
        let (clear, opaque) = (render("transparent", "t.exr"), render("0.3,0.5,0.7", "c.exr"));
        let alpha = read_channel(&clear, "A");
        let [clear, opaque] = [clear, opaque].map(|path| read_rgb(&path));
        let mut compared = 0;
        for (i, &a) in alpha.iter().enumerate() {
            // Skip pixels with an alpha of 0 or 1, which may be clamped. On a ground, light from
            // the scene may make such a pixel brighter than its background. With some filters, the
            // weights do not sum to 1.
            if (a == 0.0 || a == 1.0) && (has_ground || way.starts_with("--filter")) {
                continue;
            }
            for c in 0..3 {
                let over = clear[c][i] + (1.0 - a) * color[c];
                assert!(
                    (over - opaque[c][i]).abs() < 3e-6,
                    "{way}: pixel {i} is {over}, not {}",
                    opaque[c][i]
                );
            }
            compared += 1;
        }
        assert!(compared > 100, "{way}: {compared}");
        kinds += 1;
    }
    assert_eq!(kinds, 20);
}

/// 8-bit codes of a PNG file, and its number of channels.
fn read_codes(path: &Path) -> (usize, Vec<u8>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info.color_type.samples(), bytes)
}

/// Tone curve, exposure and denoiser change the image in front of a background, but not the
/// background colour. The image equals the transparent image over this colour, and `develop` makes
/// the same image.
#[test]
fn tone_mapping_keeps_the_background_color() {
    let folder = stage("[ground]\npoint = [0, -0.3, 0]");
    let file = |name: &str| folder.path().join(name);
    for (flags, color, code) in [
        ("--tone agx --exposure 2", "#ffffff", [255; 3]),
        (
            "--tone reinhard --exposure auto --denoise=atrous",
            "#ffc356",
            [255, 195, 86],
        ),
        ("--tone aces-hill --exposure=-1 --denoise=gaussian", "0.18", [118; 3]),
    ] {
        let render = |background: &str, name: &str| {
            let line =
                format!("render s.toml -q --spp 64 {flags} --background {background} -o {name}.png -o {name}.exr");
            done(folder.path(), &split(&line));
        };
        render(color, "c");
        let (channels, shown) = read_codes(&file("c.png"));
        // The left half of the top row is empty.
        assert_eq!((channels, &shown[..6]), (3, &[code, code].concat()[..]), "{flags}");
        done(folder.path(), &split("develop c.exr -q -o d.png"));
        assert_eq!(read_codes(&file("d.png")).1, shown, "{flags}");

        render("transparent", "t");
        let over_light = |name: &str| {
            let a = read_channel(&file("t.exr"), "A");
            let light = read_channel(&file("t.exr"), name);
            let opaque = read_channel(&file("c.exr"), name);
            let behind = opaque[0];
            // Leave out pixels with a coverage of 0 or 1, because it may be clamped: to 0 where the
            // ground receives more light than it would without the objects.
            let pixels = light
                .into_iter()
                .zip(a)
                .zip(opaque)
                .filter(|((_, a), _)| (0.001..0.999).contains(a));
            pixels.map(move |((light, a), opaque)| (light + (1.0 - a) * behind - opaque).abs())
        };
        let largest = ["R", "G", "B"].into_iter().flat_map(over_light).fold(0.0, f32::max);
        // Denoisers filter grey coverage and coloured coverage a little differently.
        assert!(largest < 4e-3, "{flags}: {largest}");
        if color == "#ffffff" {
            let (_, clear) = read_codes(&file("t.png"));
            for (i, (clear, shown)) in clear.chunks(4).zip(shown.chunks(3)).enumerate() {
                let a = f32::from(clear[3]) / 255.0;
                let over = |c: usize| a * f32::from(clear[c]) + (1.0 - a) * 255.0;
                assert!((over(1) - f32::from(shown[1])).abs() < 2.0, "{i}: {clear:?} {shown:?}");
            }
        }
    }
}

/// In a transparent image, `--noise` measures the noise of a shadow as if the background were
/// white.
#[test]
fn noise_of_shadows_counts_without_background() {
    let folder = stage("[ground]\npoint = [0, -0.3, 0]");
    let error = |background: &str| {
        let line = format!("render s.toml -q --noise 1% --spp 256 --reuse none --background {background} -o o.exr");
        done(folder.path(), &split(&line));
        let errors = read_channel(&folder.path().join("o.exr"), "error");
        errors.iter().map(|error| error * error).sum::<f32>().sqrt()
    };
    let (clear, white) = (error("transparent"), error("white"));
    assert!(clear > 0.5 * white && white > 0.0, "{clear} {white}");
}

/// Crops, resumed and merged renders are bit-identical to a single render, also in the channel `A`.
#[test]
fn crops_resume_and_merge_keep_alpha_bits() {
    let folder = stage("background = \"transparent\"\n[ground]\npoint = [0, -0.5, 0]");
    let run = |line: &str| done(folder.path(), &split(&format!("render s.toml -q {line}")));
    let file = |name: &str| folder.path().join(name);
    run("--spp 128 -o whole.exr --threads 1");
    run("--spp 128 -o again.exr --threads 2 --background transparent");
    assert_same_bits(&file("whole.exr"), &file("again.exr"));

    run("--spp 40 --checkpoint c.exr -o part.exr");
    run("--spp 128 --checkpoint c.exr --resume -o resumed.exr");
    assert_same_bits(&file("whole.exr"), &file("resumed.exr"));

    run("--spp 128 --samples 0..64 -o a.exr");
    run("--spp 128 --samples 64..128 --crop 0,0,31,17 -o b.exr");
    run("--spp 128 --samples 64..128 --crop 0,17,31,31 -o c.exr");
    done(
        folder.path(),
        &split("merge a.exr b.exr c.exr -q -o merged.exr -o merged.png"),
    );
    assert_same_bits(&file("whole.exr"), &file("merged.exr"));

    // Parts with another background cannot be merged.
    run("--spp 128 --samples 64..128 --background white -o d.exr");
    let said = refused(folder.path(), &split("merge a.exr d.exr -q -o no.exr"), 1);
    assert!(said.contains("background=transparent"), "{said}");
    run("--spp 40 --checkpoint e.exr -o part.exr");
    let said = refused(
        folder.path(),
        &split("render s.toml -q --spp 64 --checkpoint e.exr --resume --no-ground -o no.exr"),
        1,
    );
    assert!(said.contains("scene hash"), "{said}");

    // Denoisers keep alpha. Noise levels, half floats and readers work with such images.
    run("--spp 128 --denoise gaussian -o soft.exr");
    assert_eq!(
        read_channel(&file("soft.exr"), "raw.A"),
        read_channel(&file("whole.exr"), "A")
    );
    run("--noise 50% --half picture -o n.exr");
    assert!(read_channel(&file("n.exr"), "A").contains(&1.0));
    let compared = json(&done(folder.path(), &split("compare whole.exr merged.exr --json")));
    assert_eq!(compared["mse"].as_f64(), Some(0.0), "{compared}");
    done(folder.path(), &split("compare merged.png merged.png"));
}

/// The default background is `light`. The image is bit-identical to an image with the flag.
#[test]
fn default_background_is_light() {
    let folder = stage("");
    done(folder.path(), &split("render s.toml -q --spp 16 -o a.exr"));
    done(
        folder.path(),
        &split("render s.toml -q --spp 16 --background light --no-ground -o b.exr"),
    );
    let [a, b] = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
    assert_same_bits(&a, &b);
    assert_eq!(at(&a, "R", 2, 15), 0.6);
}

/// Flags, keys and `--set` accept the same backgrounds. Light that the camera does not see directly
/// is unchanged.
#[test]
fn background_is_visible_to_the_camera_only() {
    let folder = stage("background = [0.1, 0.2, 0.3]");
    let shown = |flags: &str| {
        done(
            folder.path(),
            &joined(&split("render s.toml -q --spp 16 -o o.exr"), &split(flags)),
        );
        let path = folder.path().join("o.exr");
        ["R", "G", "B"].map(|name| at(&path, name, 2, 15))
    };
    assert_eq!(shown(""), [0.1, 0.2, 0.3]);
    assert_eq!(shown("--background white"), [1.0; 3]);
    assert_eq!(shown("--background black"), [0.0; 3]);
    assert_eq!(shown("--background 0.25"), [0.25; 3]);
    assert_eq!(shown("--background 1,2,3"), [1.0, 2.0, 3.0]);
    assert_eq!(shown("--background light"), [0.6; 3]);
    assert_eq!(shown("--background transparent"), [0.0; 3]);
    assert_eq!(shown("--set image.background=[0,1,0]"), [0.0, 1.0, 0.0]);
    assert_eq!(shown("--set image.background=0.5"), [0.5; 3]);
    let sixth = shown("--background #ff8000");
    assert!(
        sixth[0] == 1.0 && (sixth[1] - 0.215_86).abs() < 1e-4 && sixth[2] == 0.0,
        "{sixth:?}"
    );
    // The sheet of glass reflects and refracts the sky of radiance 0.6, for any background.
    let path = folder.path().join("o.exr");
    let glass = at(&path, "R", 8, 8);
    shown("--background white");
    assert_eq!(at(&path, "R", 8, 8), glass);
    shown("--background light");
    assert_eq!(at(&path, "R", 8, 8), glass);

    // A gradient is brighter below than above.
    let wide = split("--background gradient --position 0,0,100 --look-at 0,0,200 --fov 100");
    let gradient = |flags: &[&str]| {
        let all = [&split("render s.toml -q --spp 4 -o o.exr")[..], flags].concat();
        done(folder.path(), &all);
        [0, 15, 30].map(|y| at(&path, "R", 15, y))
    };
    let [top, middle, bottom] = gradient(&wide);
    assert!(
        top < 0.5 * middle && middle < bottom && bottom == 0.8,
        "{top} {middle} {bottom}"
    );
    let [top, _, bottom] = gradient(&joined(&wide, &["--up", "0,-1,0"]));
    assert!(bottom == 0.8 && top < 0.4, "{top} {bottom}");
    let dark = joined(&wide, &["--background", "gradient:0.1"]);
    assert_eq!(gradient(&dark[2..])[2], 0.1);
}

#[test]
fn invalid_backgrounds_and_grounds_are_errors() {
    let run = |more: &str, flags: &str, expected: i32| {
        let folder = stage(more);
        refused(
            folder.path(),
            &joined(&split("render s.toml -q -o o.exr"), &split(flags)),
            expected,
        )
    };
    for value in ["greyish", "-1", "1,2", "#12345", "gradient:x", "nan"] {
        let said = run("", &format!("--background {value}"), 2);
        assert!(
            said.contains(&format!("--background {value}")) && said.contains("transparent, gradient"),
            "{said}"
        );
    }
    for value in ["\"greyish\"", "[1, 2]", "[1, -2, 3]", "true", "[[1]]", "{}"] {
        let said = run(&format!("background = {value}"), "", 1);
        assert!(
            said.contains("s.toml:9:14: background = ") && said.contains("transparent, gradient"),
            "{said}"
        );
    }
    let said = run("filter_radius = [1, 2]", "", 1);
    assert!(
        said.contains("filter_radius = [1, 2]") && said.contains("use a number"),
        "{said}"
    );

    // Integrators whose light can fall on any pixel
    for name in ["light", "bdpt", "pssmlt", "vcm", "mlt"] {
        let said = run("", &format!("--integrator {name} --background white"), 2);
        assert!(
            said.contains("shows only the background `light`")
                && said.contains("path, naive, one-sample, area, whitted"),
            "{said}"
        );
        let said = run("", &format!("--integrator {name} --ground"), 2);
        assert!(said.contains("--no-ground") && said.contains("path, naive"), "{said}");
    }
    for flags in [
        "--integrator photon-map",
        "--integrator sppm",
        "--integrator irradiance-cache",
        "--max-depth 0",
    ] {
        let said = run("[ground]", flags, 2);
        assert!(
            said.contains("ground") && said.contains("help: use --no-ground"),
            "{said}"
        );
    }
    let said = run(
        "[[light]]\ntype = \"point\"\nposition = [0, 5, 0]\nintensity = [1, 1, 1]",
        "--ground --integrator naive",
        2,
    );
    assert!(said.contains("point light") && said.contains("--no-ground"), "{said}");

    for (key, rule) in [
        ("point = [0, nan, 0]", "finite"),
        ("point = [0, 2e10, 0]", "1e10"),
        ("normal = [0, 0, 0]", "not zero"),
        ("up = [0, inf, 0]", "finite"),
        ("radius = 0", "from 1e-9 to 1e10"),
        ("radius = -1", "from 1e-9 to 1e10"),
        ("radius = 1e-30", "from 1e-9 to 1e10"),
        ("albedo = 0", "from 0.01 to 1"),
        ("albedo = [0.5, 0.5, 1.5]", "from 0.01 to 1"),
        ("albedo = \"whitish\"", "unknown colour"),
        ("radios = 3", "did you mean `radius`"),
    ] {
        let more = format!("[ground]\npoint = [0, 1, 0]\n{key}");
        let more = if key.starts_with("point") {
            format!("[ground]\n{key}")
        } else {
            more
        };
        let said = run(&more, "", 1);
        assert!(said.contains("s.toml:") && said.contains(rule), "{key}: {said}");
    }
    let said = run("", "--ground --no-ground", 2);
    assert!(said.contains("--no-ground"), "{said}");

    // A lamp with an emission texture, and no other light
    let folder = stage("");
    let path = folder.path().join("s.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("radiance = [0.6, 0.6, 0.6]", "radiance = 0")).unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl lamp\nKe 2 2 2\nmap_Ke t.png\n").unwrap();
    crate::support::program::write_grey_png(&folder.path().join("t.png"), &[0, 200]);
    let said = refused(folder.path(), &split("render s.toml -q --ground -o o.exr"), 1);
    assert!(said.contains("texture") && said.contains("--no-ground"), "{said}");
}
