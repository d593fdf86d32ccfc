//! `embrasure compare`, and tone curves of PNG files.

use crate::support::program::{code, done, folder, joined, json, printed, refused, run, split, words};
use ::exr::prelude::{self as exr, WritableImage};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Exit code, standard output and standard error.
fn said(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let out = run(folder, args);
    (code(&out), printed(&out), words(&out))
}

fn compare(folder: &Path, args: &[&str]) -> (i32, serde_json::Value) {
    let out = run(folder, &[&["compare", "--json"], args].concat());
    (code(&out), json(&out))
}

/// Two scenes of a floor, a wall and a lamp. The lamp in `brighter.toml` is 2 % brighter than the
/// lamp in `s.toml`.
fn scenes() -> TempDir {
    let scene = |lamp: f64| {
        format!(
            "version = 1\n[camera]\nposition = [0, 1, 4]\nlook_at = [0, 0.8, 0]\n[image]\nwidth = 80\nheight = 64\n\
             [render]\nsamples = 16\n[[object]]\nobj = \"a.obj\"\n[material.lamp]\nemission = [{lamp}, {lamp}, {lamp}]\n"
        )
    };
    folder(&[
        ("a.mtl", "newmtl wall\nKd 0.6 0.5 0.4\nKs 0.2 0.2 0.2\nNs 20\n"),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 2 -1\nv 1 2 -1\nv -0.4 1.9 -0.4\nv 0.4 1.9 -0.4\nv 0.4 1.9 0.4\nv -0.4 1.9 0.4\n\
             usemtl wall\nf 1 2 3 4\nf 4 3 6 5\nusemtl lamp\nf 7 8 9 10\n",
        ),
        ("s.toml", &scene(5.0)),
        ("brighter.toml", &scene(5.1)),
    ])
}

fn render(folder: &Path, scene: &str, flags: &[&str], output: &str) {
    done(folder, &[&["render", "-q", scene, "-o", output], flags].concat());
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn brighter_lamp_differs_and_noise_does_not() {
    let folder = scenes();
    let folder = folder.path();
    let seeds = ["1", "2", "3", "4"];
    for seed in seeds {
        render(folder, "s.toml", &["--seed", seed], &format!("{seed}.exr"));
    }
    let pairs = (0..4).flat_map(|i| (0..i).map(move |j| [seeds[i], seeds[j]]));
    for [a, b] in pairs {
        let (code, found) = compare(folder, &[&format!("{a}.exr"), &format!("{b}.exr")]);
        assert_eq!(
            (code, found["outcome"].as_str()),
            (0, Some("equal within noise")),
            "{found:#}"
        );
        assert!(found["mse"].as_f64().unwrap() > 0.0 && found["flip"]["mean"].as_f64().unwrap() > 0.0);
    }

    render(folder, "brighter.toml", &["--seed", "9", "--spp", "64"], "brighter.exr");
    let (code, found) = compare(folder, &["1.exr", "brighter.exr"]);
    assert_eq!((code, found["outcome"].as_str()), (1, Some("differs")), "{found:#}");
    let percent = 100.0 * found["significance_test"]["worst"]["difference"].as_f64().unwrap();
    assert!((percent - 2.0).abs() < 0.6, "{found:#}");
    let (code, text, _) = said(folder, &["compare", "1.exr", "brighter.exr"]);
    assert!(code == 1 && text.contains("result: differs by +"), "{text}");
    // If a limit is given, only the limit decides the exit code, not the significance test.
    let within = ["compare", "1.exr", "brighter.exr", "--max-relmse", "0.5"];
    let beyond = ["compare", "1.exr", "2.exr", "--max-flip", "1e-4"];
    assert_eq!((said(folder, &within).0, said(folder, &beyond).0), (0, 1));
    assert!(said(folder, &beyond).1.contains("is above --max-flip"));

    let (code, found) = compare(folder, &["1.exr", "1.exr"]);
    assert_eq!((code, found["outcome"].as_str()), (0, Some("identical")));
    assert!(found["psnr_db"].is_null() && found["mse"] == 0.0);

    // Maps have the size of the images.
    for (map, word) in [("error", "luminance"), ("flip", "FLIP"), ("z", "deviation")] {
        let (code, text, errors) = said(folder, &["compare", "1.exr", "2.exr", "-o", "m.png", "--map", map]);
        assert!(
            code == 0 && text.contains("m.png: ") && text.contains(word),
            "{text}{errors}"
        );
        assert_eq!(
            fs::read(folder.join("m.png")).unwrap()[16..24],
            [0, 0, 0, 80, 0, 0, 0, 64]
        );
    }
}

/// `%` is the relative difference of the two values beside it. It is not NaN if both values are 0.
#[test]
fn bias_percentages_match_the_values() {
    let folder = scenes();
    let folder = folder.path();
    let white = fs::read_to_string(folder.join("s.toml")).unwrap();
    fs::write(folder.join("red.toml"), white.replace("[5, 5, 5]", "[5, 0, 0]")).unwrap();
    render(folder, "s.toml", &[], "white.exr");
    render(folder, "red.toml", &["--seed", "1"], "1.exr");
    render(folder, "red.toml", &["--seed", "2"], "2.exr");
    for image in ["1.exr", "2.exr"] {
        let (_, text, _) = said(folder, &["compare", "1.exr", image]);
        assert!(!text.contains("NaN"), "{text}");
        let biases = text.lines().find(|line| line.contains("bias, %")).unwrap();
        let biases: Vec<&str> = biases.split_whitespace().collect();
        assert_eq!(biases[3..], ["0", "0"], "{text}");
        let (_, found) = compare(folder, &["1.exr", image]);
        let tests = found["significance_test"]["tests"].as_array().unwrap();
        assert_eq!(tests.len(), 4, "{found:#}");
        for test in tests {
            let [reference, value, share] = ["reference", "image", "difference"].map(|key| test[key].as_f64().unwrap());
            assert!((reference * (1.0 + share) - value).abs() < 1e-9, "{test:#}");
        }
    }

    // If the reference has no green light, the bias of green has no percentage
    let (_, text, _) = said(folder, &["compare", "1.exr", "white.exr"]);
    let biases = text.lines().find(|line| line.contains("bias, %")).unwrap();
    assert!(biases.ends_with(" -           -"), "{text}");
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    let (_, found) = compare(folder, &["1.exr", "white.exr"]);
    assert!(found["relative_bias"][1].is_null(), "{found:#}");
}

/// Denoised renders with different seeds do not differ: the tests compare the light before the
/// denoiser. A render with other light differs.
#[test]
fn denoised_seeds_agree() {
    let folder = scenes();
    let folder = folder.path();
    let flags = ["--size", "128x128", "--spp", "8", "--denoise=atrous"];
    for seed in ["1", "2"] {
        render(
            folder,
            "s.toml",
            &joined(&flags, &["--seed", seed]),
            &format!("{seed}.exr"),
        );
    }
    render(
        folder,
        "s.toml",
        &joined(&flags, &["--seed", "1", "--max-depth", "1"]),
        "shallow.exr",
    );
    let (code, found) = compare(folder, &["1.exr", "2.exr"]);
    assert_eq!(
        (code, found["outcome"].as_str()),
        (0, Some("equal within noise")),
        "{found:#}"
    );
    assert_eq!(found["significance_test"]["before_denoiser"], true);
    let (code, found) = compare(folder, &["2.exr", "shallow.exr"]);
    assert_eq!((code, found["outcome"].as_str()), (1, Some("differs")), "{found:#}");
    let (_, text, _) = said(folder, &["compare", "1.exr", "2.exr"]);
    assert!(text.contains("before the denoiser"), "{text}");
}

/// Asserts that renders with different seeds do not differ, and that a render with half of the
/// light differs.
fn seeds_agree(methods: &[&str], common: &str, scales: &[&str]) {
    let folder = scenes();
    let folder = folder.path();
    for method in methods {
        let flags = ["--integrator", method, "--size", "128x128", "--spp", "4"];
        for seed in ["1", "2", "3"] {
            render(
                folder,
                "s.toml",
                &joined(&flags, &["--seed", seed]),
                &format!("{seed}.exr"),
            );
        }
        for pair in [["1.exr", "2.exr"], ["1.exr", "3.exr"], ["2.exr", "3.exr"]] {
            let (code, found) = compare(folder, &pair);
            let outcome = found["outcome"].as_str();
            assert_eq!((code, outcome), (0, Some("equal within noise")), "{method}: {found:#}");
            let test = &found["significance_test"];
            assert_eq!(test["common_errors"], common);
            let tests = test["tests"].as_array().unwrap().iter();
            let tested: Vec<&str> = tests.map(|test| test["scale"].as_str().unwrap()).collect();
            assert_eq!(tested, scales, "{method}");
            assert!(test["left_out"].as_str().unwrap().contains("regions"));
        }
        let text = said(folder, &["compare", "1.exr", "2.exr"]).1;
        assert!(text.contains("left out: ") && text.contains("several seeds"), "{text}");
        render(folder, "s.toml", &joined(&flags, &["--max-depth", "1"]), "shallow.exr");
        let (code, found) = compare(folder, &["1.exr", "shallow.exr"]);
        assert_eq!(
            (code, found["outcome"].as_str()),
            (1, Some("differs")),
            "{method}: {found:#}"
        );
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn seeds_agree_if_samples_have_common_errors() {
    seeds_agree(&["pssmlt", "mlt", "sppm"], "sample", &["pixel", "tile", "whole"]);
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn seeds_agree_if_renders_use_maps() {
    seeds_agree(&["photon-map", "irradiance-cache"], "picture", &["whole"]);
    // A few tiles are not enough for a test.
    let folder = scenes();
    let flags = ["--integrator", "irradiance-cache", "--size", "32x32", "--spp", "4"];
    for seed in ["1", "2"] {
        render(
            folder.path(),
            "s.toml",
            &joined(&flags, &["--seed", seed]),
            &format!("{seed}.exr"),
        );
    }
    let (code, text, _) = said(folder.path(), &["compare", "1.exr", "2.exr"]);
    assert!(
        code == 0 && text.contains("not tested: too few samples or pixels"),
        "{text}"
    );
}

/// A plate that reflects a grey sky with a sharp lobe and a diffuse one. The sky in `brighter.toml`
/// is twice as bright.
fn phong(exponent: u32) -> TempDir {
    let mtl = format!("newmtl plate\nKd 0.3 0.3 0.3\nKs 0.6 0.6 0.6\nNs {exponent}\nillum 2\n");
    let scene = |sky: f64| {
        format!(
            "version = 1\n[camera]\nposition = [0, 2, 1]\nlook_at = [0, 0, 0]\nvertical_fov = 50\n[image]\nwidth = 160\nheight = 160\n\
             [[object]]\nobj = \"p.obj\"\n[[light]]\ntype = \"constant\"\nradiance = [{sky}, {sky}, {sky}]\n"
        )
    };
    folder(&[
        ("p.mtl", mtl.as_str()),
        (
            "p.obj",
            "mtllib p.mtl\nv -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nusemtl plate\nf 1 2 3 4\n",
        ),
        ("s.toml", &scene(1.0)),
        ("brighter.toml", &scene(2.0)),
    ])
}

/// Uniform directions hit a sharp lobe once in ten thousand samples. Most tiles have no such
/// sample, so their noise estimate is too small. `compare` must report no difference between two
/// seeds. A difference of the whole image beyond the noise must still be reported.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn rare_samples_are_no_difference() {
    for (exponent, spp, is_testable) in [("100000", "16", false), ("6000", "32", true)] {
        let folder = phong(exponent.parse().unwrap());
        let folder = folder.path();
        render(folder, "s.toml", &["--spp", spp], "path.exr");
        for seed in ["1", "2", "3"] {
            let naive = ["--integrator", "naive", "--spp", spp, "--seed", seed];
            render(folder, "s.toml", &naive, "naive.exr");
            let (code, found) = compare(folder, &["path.exr", "naive.exr"]);
            let outcome = if is_testable {
                "equal within noise"
            } else {
                "not tested"
            };
            assert_eq!((code, found["outcome"].as_str()), (0, Some(outcome)), "{found:#}");
            let words = found["significance_test"]["left_out"].as_str().unwrap_or_default();
            assert!(words.contains("heavy tails"), "{found:#}");
            // Two images with the same kind of noise have symmetric differences, and are compared
            // as usual.
            render(folder, "s.toml", &joined(&naive[..4], &["--seed", "9"]), "other.exr");
            let (code, found) = compare(folder, &["other.exr", "naive.exr"]);
            assert_eq!(
                (code, found["outcome"].as_str()),
                (0, Some("equal within noise")),
                "{found:#}"
            );
            assert_eq!(found["significance_test"]["tests"].as_array().map(Vec::len), Some(4));

            if is_testable {
                render(folder, "brighter.toml", &naive, "brighter.exr");
                let (code, found) = compare(folder, &["path.exr", "brighter.exr"]);
                assert_eq!((code, found["outcome"].as_str()), (1, Some("differs")), "{found:#}");
            }
        }
        let (code, text, _) = said(folder, &["compare", "path.exr", "naive.exr"]);
        assert_eq!(code, 0, "{text}");
        assert!(text.contains("heavy tails") && text.contains("rare samples"), "{text}");
    }
}

#[test]
fn crops_are_compared_on_common_pixels() {
    let folder = scenes();
    let folder = folder.path();
    render(folder, "s.toml", &["--seed", "1"], "full.exr");
    render(folder, "s.toml", &["--seed", "1", "--crop", "20,8,60,50"], "crop.exr");
    render(folder, "s.toml", &["--seed", "1", "--crop", "40,30,80,64"], "other.exr");
    // Pixels of a crop are bit-identical to the whole image.
    for (a, b, window) in [
        ("full.exr", "crop.exr", [20, 8, 60, 50]),
        ("crop.exr", "other.exr", [40, 30, 60, 50]),
    ] {
        let (code, found) = compare(folder, &[a, b]);
        assert_eq!((code, found["outcome"].as_str()), (0, Some("identical")), "{found:#}");
        assert_eq!(
            (&found["window"], &found["resolution"]),
            (&serde_json::json!(window), &serde_json::json!([80, 64]))
        );
    }
    assert!(
        said(folder, &["compare", "full.exr", "crop.exr"])
            .1
            .contains("from 20,8 on")
    );
    render(folder, "s.toml", &["--crop", "0,0,10,10"], "far.exr");
    let errors = refused(folder, &["compare", "far.exr", "other.exr"], 1);
    assert!(errors.contains("no pixel in common"), "{errors}");
    render(folder, "s.toml", &["--size", "40x32"], "small.exr");
    let errors = refused(folder, &["compare", "full.exr", "small.exr"], 1);
    assert!(
        errors.contains("small.exr: has 40x32 pixels, but full.exr has 80x64"),
        "{errors}"
    );
}

/// Writes an EXR file like another program: half floats, other channel order, without noise data.
fn foreign(path: &Path, value: impl Fn(usize, usize) -> [f32; 3]) {
    let size = exr::Vec2(24, 20);
    let channel = |name: &str, c: usize| {
        let values = (0..size.area()).map(|i| exr::f16::from_f32(value(i % 24, i / 24)[c]));
        exr::AnyChannel::new(name, exr::FlatSamples::F16(values.collect()))
    };
    let list = [channel("R", 0), channel("A", 1), channel("G", 1), channel("B", 2)];
    let channels = exr::AnyChannels::sort(list.into_iter().collect());
    let layer = exr::Layer::new(
        size,
        exr::LayerAttributes::default(),
        exr::Encoding::default(),
        channels,
    );
    exr::Image::from_layer(layer).write().to_file(path).unwrap();
}

#[test]
fn images_of_other_programs_are_not_tested() {
    let folder = folder(&[]);
    let folder = folder.path();
    let ramp = |x: usize, y: usize| [x as f32 / 16.0, y as f32 / 16.0, 0.25];
    foreign(&folder.join("a.exr"), ramp);
    foreign(&folder.join("b.exr"), |x, y| ramp(x, y).map(|v| v + 0.25));
    let (code, found) = compare(folder, &["a.exr", "b.exr"]);
    assert_eq!((code, found["outcome"].as_str()), (0, Some("not tested")));
    assert!(found["significance_test"].is_null());
    // The means are the means of 0/16 … 23/16 and of 0/16 … 19/16. All values of `b.exr` are larger
    // by 0.25.
    assert_eq!(
        found["reference_mean"],
        serde_json::json!([11.5 / 16.0, 9.5 / 16.0, 0.25])
    );
    assert_eq!(
        (&found["bias"], &found["mse"]),
        (&serde_json::json!([0.25, 0.25, 0.25]), &serde_json::json!(0.0625))
    );
    assert_eq!(said(folder, &split("compare a.exr b.exr -o m.png --map z")).0, 1);

    foreign(&folder.join("n.exr"), |x, y| {
        if (x, y) == (3, 4) { [f32::NAN; 3] } else { ramp(x, y) }
    });
    let (code, found) = compare(folder, &["a.exr", "n.exr"]);
    assert_eq!((code, found["outcome"].as_str()), (1, Some("differs")));
    assert_eq!(found["not_finite"], serde_json::json!({ "reference": 0, "image": 1 }));
    assert_eq!(found["mse"], 0.0);
    let (code, text, _) = said(folder, &["compare", "a.exr", "n.exr", "--max-relmse", "1"]);
    assert!(
        code == 1 && text.contains("0 pixels of the reference, 1 of the image"),
        "{text}"
    );
}

#[test]
fn png_files_are_decoded() {
    let folder = scenes();
    let folder = folder.path();
    render(folder, "s.toml", &["-o", "x.exr"], "x.png");
    let (code, found) = compare(folder, &["x.exr", "x.png"]);
    assert_eq!(
        (code, found["outcome"].as_str()),
        (0, Some("equal within tolerance")),
        "{found:#}"
    );
    assert!(found["max_levels"].as_f64().unwrap() <= 0.5, "{found:#}");
    // Values between black and clipping have the rounding error of eight bits. Its mean square is
    // (1/255)² / 12.
    let read = embrasure::io::read_exr(&folder.join("x.exr")).unwrap();
    let values = read.pixels.as_flattened();
    let rounded = values.iter().filter(|v| **v > 0.0 && **v < 1.0).count() as f64 / values.len() as f64;
    let expected = -10.0 * (rounded / (255f64.powi(2) * 12.0)).log10();
    let psnr = found["psnr_db"].as_f64().unwrap();
    assert!((psnr - expected).abs() < 0.2, "{psnr}, expected {expected}");
    assert!(found["flip"]["exposures"].is_null() && found["display_values"] == true);
}

/// Writes a grey PNG of 16 × 8 pixels; one pixel has the level `of_one`.
fn grey_png(path: &Path, level: u8, of_one: u8) {
    let file = std::io::BufWriter::new(fs::File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, 16, 8);
    encoder.set_color(png::ColorType::Grayscale);
    let mut levels = [level; 128];
    levels[77] = of_one;
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&levels).unwrap();
}

#[test]
fn png_files_differ_beyond_a_tolerance() {
    let folder = folder(&[]);
    let folder = folder.path();
    grey_png(&folder.join("a.png"), 100, 100);
    grey_png(&folder.join("b.png"), 100, 101);
    grey_png(&folder.join("c.png"), 100, 103);
    for (flags, expected, outcome) in [
        ("a.png a.png", 0, "identical"),
        ("a.png b.png", 0, "equal within tolerance"),
        ("a.png c.png", 1, "differs"),
        ("a.png b.png --tolerance 0", 1, "equal within tolerance"),
        ("a.png c.png --tolerance 2.9", 1, "differs"),
        ("a.png c.png --tolerance 3", 0, "differs"),
        ("a.png c.png --max-flip 0.5", 0, "differs"),
        ("a.png c.png --max-flip 0.5 --tolerance 1", 1, "differs"),
    ] {
        let (code, found) = compare(folder, &split(flags));
        assert_eq!((code, found["outcome"].as_str()), (expected, Some(outcome)), "{flags}");
    }
    let (_, found) = compare(folder, &["a.png", "c.png"]);
    assert_eq!(found["max_levels"].as_f64(), Some(3.0));
    let (code, text, _) = said(folder, &["compare", "a.png", "c.png"]);
    assert!(
        code == 1 && text.contains("more than 1 level of 255; --tolerance"),
        "{text}"
    );
    for (image, expected) in [("b.png", 0), ("c.png", 1)] {
        let (code, text, _) = said(folder, &["compare", "a.png", image, "-q"]);
        assert_eq!((code, text.as_str()), (expected, ""));
    }
    let (_, text, _) = said(folder, &split("compare a.png c.png --tolerance 3"));
    assert!(text.contains("limit: 3.000000 is within --tolerance 3"), "{text}");
}

#[test]
fn wrong_usage_has_code_2() {
    let folder = folder(&[]);
    let folder = folder.path();
    foreign(&folder.join("a.exr"), |_, _| [0.5; 3]);
    for flags in [
        &["--significance", "1"][..],
        &["--max-flip", "-1"],
        &["--tolerance", "-1"],
        &["-o", "x.exr"],
        &["-o", "x.png", "--map", "heat"],
        &["--map", "flip"],
    ] {
        let all = [&["compare", "a.exr", "a.exr"], flags].concat();
        assert_eq!(said(folder, &all).0, 2, "{flags:?}");
    }
    fs::write(folder.join("t.exr"), "no picture").unwrap();
    for wrong in ["nothing.exr", "t.exr", "."] {
        let (code, _, errors) = said(folder, &["compare", "a.exr", wrong]);
        assert!(code == 1 && errors.contains("help:"), "{wrong}: {errors}");
    }
}

/// Codes of the pixels of a PNG, and its texts.
fn png(path: &Path) -> (Vec<u8>, String) {
    let mut reader = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap()))
        .read_info()
        .unwrap();
    let mut codes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut codes).unwrap();
    let texts = &reader.info().uncompressed_latin1_text;
    (
        codes,
        texts.iter().map(|t| format!("{}: {}\n", t.keyword, t.text)).collect(),
    )
}

#[test]
fn tone_curve_is_set_by_flag_or_scene_file() {
    use embrasure::color::{Curve, Exposure, Tone};
    let folder = scenes();
    let folder = folder.path();
    render(folder, "s.toml", &["-o", "x.exr"], "x.png");
    let read = embrasure::io::read_exr(&folder.join("x.exr")).unwrap();
    let expected = |tone: Tone| -> Vec<u8> { read.pixels.iter().flat_map(|p| tone.encode_u8(*p)).collect() };
    let (codes, texts) = png(&folder.join("x.png"));
    assert_eq!(codes, expected(Tone::default()));
    assert!(texts.contains("embrasure.tone: tone=srgb exposure=0\n"), "{texts}");

    let in_file = fs::read_to_string(folder.join("s.toml")).unwrap();
    let toned = in_file.replace("height = 64", "height = 64\ntone = \"agx\"\nexposure = -1.5");
    fs::write(folder.join("toned.toml"), &toned).unwrap();
    for (flags, exposure, curve) in [
        (&[][..], -1.5, Curve::Agx),
        (&["--tone", "aces-hill"], -1.5, Curve::AcesHill),
        (&["--exposure", "-2", "--tone", "reinhard"], -2.0, Curve::Reinhard),
    ] {
        render(folder, "toned.toml", flags, "y.png");
        let (codes, texts) = png(&folder.join("y.png"));
        let exposure = Exposure::Stops(exposure);
        let tone = Tone { exposure, curve };
        assert_eq!(codes, expected(tone), "{flags:?}");
        assert!(texts.contains(&tone.to_string()), "{texts}");
    }
    for flags in [["--tone", "filmic"], ["--exposure", "nan"], ["--exposure", "65"]] {
        let all = [&["render", "s.toml"][..], &flags].concat();
        assert_eq!(said(folder, &all).0, 2, "{flags:?}");
    }
    fs::write(folder.join("wrong.toml"), toned.replace("-1.5", "1e9")).unwrap();
    let errors = refused(folder, &["render", "wrong.toml"], 1);
    assert!(errors.contains("wrong.toml:9:12: exposure = 1000000000"), "{errors}");
}
