//! Defaults of a render of a bare OBJ (an OBJ file without a scene file): files, exposure, tone
//! curve and quality. Also the flags and keys that change the defaults.

use crate::support::program::{assert_same_bits, done, folder, json, printed, read_json, refused, run, split, words};
use crate::support::{read_channel, read_rgb, rel_mse};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const MTL: &str = "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl wall\nKd 0.7 0.2 0.2\nnewmtl lamp\nKd 0 0 0\nKe 50 50 50\n";

/// A floor and a wall with a small bright lamp, as a bare OBJ and as a scene file.
fn scene() -> TempDir {
    folder(&[
        ("a.mtl", MTL),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 1 -1\nv 1 1 -1\nv -0.1 0.9 0\nv 0.1 0.9 0\nv 0.1 0.9 -0.2\n\
             v -0.1 0.9 -0.2\nusemtl floor\nf 1 2 3 4\nusemtl wall\nf 4 3 6 5\nusemtl lamp\nf 7 10 9 8\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 1, 4]\nlook_at = [0, 0.3, 0]\nvertical_fov = 30\n\
             [image]\nwidth = 40\nheight = 24\n[render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\n",
        ),
    ])
}

/// Camera of the scene file, as flags for the bare OBJ.
const BARE: &str = "a.obj --position 0,1,4 --look-at 0,0.3,0 --fov 30 --size 40x24";

fn render(at: &Path, line: &str) -> Value {
    done(at, &split(&format!("render -q --stats s.json {line}")));
    read_json(&at.join("s.json"))
}

/// 8-bit codes of a PNG, and its text chunks.
fn png_of(path: &Path) -> (Vec<u8>, String) {
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut codes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut codes).unwrap();
    let texts = &reader.info().uncompressed_latin1_text;
    (
        codes,
        texts.iter().map(|t| format!("{}: {}\n", t.keyword, t.text)).collect(),
    )
}

/// An attribute of an EXR file.
fn attribute(path: &Path, name: &str) -> Option<String> {
    let meta = exr::meta::MetaData::read_from_file(path, false).unwrap();
    let mut attributes = meta.headers[0].own_attributes.other.iter();
    attributes
        .find(|(key, _)| **key == *name)
        .map(|(_, value)| format!("{value:?}"))
}

#[test]
fn bare_obj_gives_png_and_exr_with_exposure() {
    let folder = scene();
    let at = folder.path();
    let out = done(at, &split(&format!("render {BARE} --stats s.json")));
    let said = words(&out);
    let stats = read_json(&at.join("s.json"));
    let stops = stats["exposure"].as_f64().unwrap();
    assert!(
        said.contains(&format!(
            "exposure {stops:+} (auto; --exposure {:+.2} is brighter)",
            stops + 1.0
        )),
        "{said}"
    );
    assert!(said.contains("-> a.png, a.exr"), "{said}");
    assert!(said.contains("picture: 16 samples per pixel, denoised by "), "{said}");
    assert_eq!(stats["spp"], 16, "{stats}");
    assert_eq!(
        stats["denoise"]["by"].as_str().unwrap().split(' ').next().unwrap(),
        if cfg!(feature = "oidn") { "oidn" } else { "atrous" }
    );
    let tone = format!("tone=agx exposure={stops}");
    assert!(
        png_of(&at.join("a.png"))
            .1
            .contains(&format!("embrasure.tone: {tone}\n"))
    );
    assert!(attribute(&at.join("a.exr"), "embrasure.tone").unwrap().contains(&tone));
    assert!(read_channel(&at.join("a.exr"), "raw.G").iter().all(|v| v.is_finite()));

    // Values in the EXR stay linear and unscaled.
    render(at, &format!("{BARE} --exposure 0 --tone srgb --denoise=off -o b.exr"));
    assert!(attribute(&at.join("b.exr"), "embrasure.tone").is_none());
    let raw = ["raw.R", "raw.G", "raw.B"].map(|name| read_channel(&at.join("a.exr"), name));
    assert!(raw == read_rgb(&at.join("b.exr")));

    // If the metered exposure is given as a number, the PNG has the same bytes.
    let bytes = fs::read(at.join("a.png")).unwrap();
    render(at, &format!("{BARE} --exposure {stops} -o c.png"));
    assert!(fs::read(at.join("c.png")).unwrap() == bytes);
    // The bytes are also the same with one thread, in a second run.
    render(at, &format!("{BARE} --threads 1 -o d.png"));
    assert!(fs::read(at.join("d.png")).unwrap() == bytes);
}

#[test]
fn flags_and_keys_override_each_guess() {
    let folder = scene();
    let at = folder.path();
    let text = |line: &str| {
        render(at, &format!("{BARE} --spp 1 {line} -o x.png"));
        png_of(&at.join("x.png")).1
    };
    assert!(text("--exposure 1.5").contains("tone=agx exposure=1.5\n"));
    assert!(text("--tone srgb --exposure 0").contains("tone=srgb exposure=0\n"));
    assert!(text("--set image.exposure=-2").contains("tone=agx exposure=-2\n"));
    assert!(text("--set image.tone=reinhard").contains("tone=reinhard exposure="));
    // Debug views show numbers as colours, so they keep the neutral tone curve and exposure.
    assert!(text("--integrator debug").contains("tone=srgb exposure=0\n"));

    let stats = render(at, &format!("{BARE} --spp 3 --denoise=off -o x.exr"));
    assert_eq!((&stats["spp"], &stats["denoise"]), (&3.into(), &Value::Null));
    let stats = render(
        at,
        &format!("{BARE} --set render.samples=5 --set render.denoise=gaussian -o x.exr"),
    );
    assert_eq!(
        (&stats["spp"], &stats["denoise"]["by"]),
        (&5.into(), &"gaussian".into())
    );

    // The other defaults of a bare OBJ do not apply to a scene file.
    let stats = render(at, "s.toml -o x.exr -o x.png");
    assert_eq!(
        (&stats["spp"], &stats["denoise"], &stats["exposure"]),
        (&4.into(), &Value::Null, &0.0.into())
    );
    assert!(png_of(&at.join("x.png")).1.contains("tone=srgb exposure=0\n"));
}

#[test]
fn metered_exposure_is_equal_for_resume_and_merge() {
    let folder = scene();
    let at = folder.path();
    let stats = render(at, "s.toml --spp 128 --exposure auto -o whole.png -o whole.exr");
    let stops = &stats["exposure"];
    assert!(stops.as_f64().is_some_and(|stops| stops != 0.0), "{stats}");
    // With the metered exposure, the pixels that show a surface have a median code near the middle
    // of the range from 0 to 255.
    let depth = read_channel(&at.join("whole.exr"), "Z");
    let (codes, _) = png_of(&at.join("whole.png"));
    let met = codes.chunks_exact(3).zip(&depth).filter(|(_, z)| **z < 1e10);
    let mut green: Vec<u8> = met.map(|(rgb, _)| rgb[1]).collect();
    green.sort_unstable();
    let median = green[green.len() / 2];
    assert!((60..180).contains(&median), "{median}");
    assert_eq!(
        render(at, "s.toml --spp 128 --set image.exposure=auto -o x.png")["exposure"],
        *stops
    );

    // Resume the render, and merge it from ranges of samples and from crops
    render(at, "s.toml --spp 64 --checkpoint c.exr -o x.exr");
    render(
        at,
        "s.toml --spp 128 --checkpoint c.exr --resume --exposure auto -o resumed.png",
    );
    for (name, part) in [
        ("a", "--samples 0..64"),
        ("b", "--samples 64..128"),
        ("l", "--crop 0,0,17,24"),
        ("r", "--crop 17,0,40,24"),
    ] {
        render(at, &format!("s.toml --spp 128 {part} -o {name}.exr"));
    }
    done(
        at,
        &split("merge -q a.exr b.exr --exposure auto -o merged.png -o merged.exr"),
    );
    done(at, &split("merge -q l.exr r.exr --exposure auto -o crops.png"));
    for name in ["resumed.png", "merged.png", "crops.png"] {
        assert!(
            fs::read(at.join(name)).unwrap() == fs::read(at.join("whole.png")).unwrap(),
            "{name}"
        );
    }
    assert_eq!(
        attribute(&at.join("merged.exr"), "embrasure.tone"),
        attribute(&at.join("whole.exr"), "embrasure.tone")
    );
}

/// Parts and checkpoints of a bare OBJ store exposure, tone curve and denoiser. `merge` and
/// `develop` use these settings. Their image is byte-identical to the image of a single render.
#[test]
fn merged_parts_of_a_bare_obj_equal_one_render() {
    let folder = scene();
    let at = folder.path();
    let run = |line: &str| done(at, &split(line));
    let bare = "render a.obj -q --size 32x24 --spp 128";
    run(&format!("{bare} -o whole.png -o whole.exr"));
    run(&format!("{bare} --samples 0..64 -o a.exr"));
    run(&format!("{bare} --samples 64..128 --checkpoint b.exr"));
    run(&format!("{bare} --checkpoint all.exr -o x.exr"));
    run("merge -q a.exr b.exr -o merged.png -o merged.exr");
    run("develop -q all.exr -o developed.png");
    let bytes = |name: &str| fs::read(at.join(name)).unwrap();
    assert!(bytes("merged.png") == bytes("whole.png"));
    assert!(png_of(&at.join("developed.png")) == png_of(&at.join("whole.png")));
    for channel in ["R", "raw.R"] {
        let [merged, whole] = ["merged.exr", "whole.exr"].map(|name| read_channel(&at.join(name), channel));
        assert!(merged == whole, "{channel}");
    }
    let finish = format!("{:?}", attribute(&at.join("a.exr"), "embrasure.finish"));
    assert!(finish.contains("tone=agx exposure="), "{finish}");
    // Flags override the stored settings.
    run("merge -q a.exr b.exr --denoise=off --tone srgb --exposure 0 -o raw.png");
    run("develop -q whole.exr --channel raw --tone srgb --exposure 0 -o raw-whole.png");
    assert!(png_of(&at.join("raw.png")) == png_of(&at.join("raw-whole.png")));
}

#[test]
fn invalid_exposure_quality_and_clamp_are_errors() {
    let folder = scene();
    let at = folder.path();
    for (flag, key, value, expected) in [
        (
            "--exposure",
            "image.exposure",
            "automatic",
            "from -64 to 64, auto or studio",
        ),
        ("--exposure", "image.exposure", "65", "from -64 to 64, auto or studio"),
        ("--quality", "render.quality", "best", "choose among draft, good, final"),
        ("--quality", "render.quality", "fnal", "did you mean final?"),
        (
            "--clamp-indirect",
            "render.clamp_indirect",
            "0",
            "a number above 0, or off",
        ),
        (
            "--clamp-indirect",
            "render.clamp_indirect",
            "-1",
            "a number above 0, or off",
        ),
        (
            "--clamp-indirect",
            "render.clamp_indirect",
            "inf",
            "a number above 0, or off",
        ),
        (
            "--clamp-indirect",
            "render.clamp_indirect",
            "much",
            "a number above 0, or off",
        ),
    ] {
        let said = refused(at, &["render", "s.toml", flag, value], 2);
        assert!(
            said.contains(&format!("{flag} {value}")) && said.contains(expected),
            "{said}"
        );
        let set = format!("{key}={value}");
        let said = refused(at, &["render", "s.toml", "--set", &set], 2);
        assert!(said.contains(&set) && said.contains(expected), "{said}");
    }
}

#[test]
fn default_output_names_keep_other_files() {
    let folder = scene();
    let at = folder.path();
    let line = format!("render {BARE} --spp 1 --denoise=off");
    // If a file of another program has the default name, the pictures get other names.
    fs::write(at.join("a.exr"), "no picture").unwrap();
    let said = words(&done(at, &split(&line)));
    assert!(
        said.contains(
            "a.exr exists and was not written by this program, so the pictures are named a.render.png and a.render.exr"
        ),
        "{said}"
    );
    assert_eq!(fs::read(at.join("a.exr")).unwrap(), b"no picture");
    assert!(at.join("a.render.png").exists() && !at.join("a.png").exists());
    fs::remove_file(at.join("a.exr")).unwrap();

    // An image that this program wrote is replaced, unless the scene uses the image as a texture.
    done(at, &split("render s.toml -q --spp 1 -o a.png"));
    let texture = fs::read(at.join("a.png")).unwrap();
    done(at, &split(&format!("{line} -q")));
    assert!(fs::read(at.join("a.png")).unwrap() != texture);
    fs::write(at.join("a.png"), &texture).unwrap();
    fs::write(
        at.join("a.mtl"),
        format!("{MTL}\n").replace("Kd 0.5 0.4 0.3\n", "Kd 0.5 0.4 0.3\nmap_Kd a.png\n"),
    )
    .unwrap();
    let said = words(&done(at, &split(&format!("{line} --stats s.json"))));
    assert!(
        said.contains("a.png is a file that this scene reads, so the pictures are named a.render.png"),
        "{said}"
    );
    assert!(
        read_json(&at.join("s.json"))["warnings"]
            .to_string()
            .contains("a.render.png")
    );
    assert!(fs::read(at.join("a.png")).unwrap() == texture);
    // If `-o` names the texture, the render is still refused.
    let said = refused(at, &split(&format!("{line} -o a.png")), 2);
    assert!(said.contains("would overwrite"), "{said}");

    // Dots in the stem of a name are kept. A range of samples writes no PNG.
    fs::copy(at.join("s.toml"), at.join("x.y.toml")).unwrap();
    done(at, &split("render x.y.toml -q --spp 1"));
    assert!(at.join("x.y.exr").exists() && !at.join("x.exr").exists());
    fs::copy(at.join("a.obj"), at.join("part.v2.obj")).unwrap();
    let stats = render(at, "part.v2.obj --size 8x8 --spp 64 --samples 0..64");
    assert!(at.join("part.v2.exr").exists() && !at.join("part.v2.png").exists());
    assert_eq!(stats["denoise"], Value::Null);
}

#[test]
fn quality_sets_samples_and_denoiser() {
    let folder = scene();
    let at = folder.path();
    let [best, fast] = if cfg!(feature = "oidn") {
        ["oidn", "oidn-fast"]
    } else {
        ["atrous"; 2]
    };
    let of = |line: &str| {
        let stats = render(at, &format!("{line} --size 16x16 -o x.exr"));
        (
            stats["spp"].as_u64().unwrap(),
            stats["denoise"]["by"]
                .as_str()
                .unwrap_or("none")
                .split(' ')
                .next()
                .unwrap()
                .to_string(),
        )
    };
    let [none, best, fast] = ["none", best, fast].map(String::from);
    assert_eq!(of("s.toml --quality draft"), (4, fast.clone()));
    assert_eq!(of("s.toml --quality good"), (16, best.clone()));
    assert_eq!(of("s.toml --quality good --spp 2 --denoise=off"), (2, none));
    // The number of samples in the scene file overrides the quality.
    assert_eq!(of("s.toml --set render.quality=good"), (4, best.clone()));
    assert_eq!(of("a.obj --set render.quality=draft"), (4, fast.clone()));
    assert_eq!(
        of("a.obj --set render.quality=draft --quality good"),
        (16, best.clone())
    );
    // A render of quality `final` ends at a noise level. If the number of samples is given, there
    // is no noise level.
    let line = "s.toml --quality final --size 4x4 --max-depth 0 -o x.exr";
    let stats = render(at, line);
    assert!(stats["noise"]["level"] == 0.01 && stats["spp"] == 2048, "{stats}");
    let stats = render(at, &format!("{line} --noise 0.5"));
    assert_eq!(stats["noise"]["level"], 0.5, "{stats}");
    let stats = render(at, &format!("{line} --spp 3"));
    assert!(stats["noise"].is_null() && stats["spp"] == 3, "{stats}");
}

#[test]
fn clamp_limits_indirect_light_only() {
    let folder = scene();
    let at = folder.path();
    let picture = |name: &str, flags: &str| {
        render(at, &format!("s.toml --spp 64 {flags} -o {name}"));
        read_rgb(&at.join(name))
    };
    let sum = |picture: &[Vec<f32>; 3]| picture.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
    for reuse in ["", "--reuse none"] {
        let plain = picture("plain.exr", reuse);
        let off = picture("off.exr", &format!("{reuse} --clamp-indirect off"));
        let high = picture("high.exr", &format!("{reuse} --clamp-indirect 1e6"));
        let low = picture("low.exr", &format!("{reuse} --clamp-indirect 0.01"));
        let direct = picture("direct.exr", &format!("{reuse} --max-depth 1"));
        assert!(plain == off);
        // A limit above all values changes the image only by rounding errors.
        assert!(rel_mse(&high, &plain) < 1e-10);
        // A low limit removes nearly all indirect light, and nothing else.
        let [plain, low, direct] = [&plain, &low, &direct].map(sum);
        assert!(
            low < 0.97 * plain && low > 0.999 * direct && low < direct + 0.02 * 40.0 * 24.0 * 3.0,
            "{plain}, {low}, {direct}"
        );
    }
    let low = at.join("low.exr");
    assert!(
        attribute(&low, "embrasure.settings")
            .unwrap()
            .contains("clamp_indirect=0.01")
    );
    assert!(
        attribute(&low, "embrasure.bias")
            .unwrap()
            .contains("clamp_indirect=0.01")
    );
    assert!(attribute(&at.join("plain.exr"), "embrasure.bias").is_none());

    // `compare` reports the bias. A checkpoint cannot be resumed with other settings.
    let out = run(at, &split("compare plain.exr low.exr"));
    assert!(
        printed(&out).contains("low.exr is biased by clamp_indirect=0.01"),
        "{}",
        printed(&out)
    );
    let compared = json(&run(at, &split("compare plain.exr low.exr --json")));
    assert_eq!(compared["biased_by"]["image"], "clamp_indirect=0.01");
    assert!(compared["biased_by"]["reference"].is_null());
    render(at, "s.toml --spp 64 --checkpoint c.exr -o x.exr");
    let said = refused(
        at,
        &split("render s.toml --spp 128 --clamp-indirect 5 --checkpoint c.exr --resume -o x.exr"),
        1,
    );
    assert!(said.contains("clamp_indirect=off and clamp_indirect=5"), "{said}");
    for samples in ["0..64", "64..128"] {
        let name = &samples[..1];
        render(
            at,
            &format!("s.toml --spp 128 --clamp-indirect 0.5 --samples {samples} -o part{name}.exr"),
        );
    }
    done(at, &split("merge -q part0.exr part6.exr -o merged.exr"));
    render(at, "s.toml --spp 128 --set render.clamp_indirect=0.5 -o whole.exr");
    assert_same_bits(&at.join("whole.exr"), &at.join("merged.exr"));
    assert!(attribute(&at.join("merged.exr"), "embrasure.bias").is_some());
    // Integrators that do not use the clamp report that the flag has no effect.
    let out = done(
        at,
        &split("render s.toml --spp 1 --integrator direct --clamp-indirect 5 -o x.exr"),
    );
    assert!(
        words(&out).contains("--clamp-indirect: direct does not use it"),
        "{}",
        words(&out)
    );
}

/// A flag of one integrator names this integrator in its warning.
#[test]
fn idle_flag_names_the_integrator_that_uses_it() {
    let folder = scene();
    let line = "render s.toml -q --spp 1 --debug-view normals -o x.png";
    let said = words(&done(folder.path(), &split(line)));
    let expected = "warning: --debug-view: path does not use it\n  help: add --integrator debug, or leave it out\n";
    assert_eq!(said, expected);
}

/// A PNG that is nearly black at the exposure of the scene has a warning with the remedy, but not
/// if an exposure is given.
#[test]
fn low_exposure_is_reported() {
    let folder = scene();
    let at = folder.path();
    let said = |more: &str| {
        let line = format!("render s.toml -q --spp 4 --material lamp.emission=0.01,0.01,0.01 {more}");
        words(&done(at, &split(&line)))
    };
    let dark = said("-o x.png");
    assert!(
        dark.contains("warning: the PNG is nearly black, because its exposure +0 is "),
        "{dark}"
    );
    assert!(
        dark.contains("help: use --exposure auto; `embrasure help black`"),
        "{dark}"
    );
    assert_eq!(said("-o x.png --exposure 0"), "");
    assert_eq!(said("-o x.png --exposure auto"), "");
    assert_eq!(said("-o x.exr"), "");
    // A given exposure that makes the picture white is reported too.
    let white = said("-o x.png --exposure 20");
    assert!(
        white.contains("warning: the PNG is nearly white, because its exposure +20 is "),
        "{white}"
    );
    let page = printed(&done(at, &["help", "black"]));
    assert!(
        page.contains("My picture is black") && page.contains("the PNG is nearly black"),
        "{page}"
    );
}

/// The message about a black image has the reason, and no advice to raise the exposure.
#[test]
fn black_image_has_a_reason() {
    let cube = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n";
    let outwards = "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";
    let inwards = "f 2 3 4 1\nf 8 7 6 5\nf 5 6 2 1\nf 7 8 4 3\nf 6 7 3 2\nf 4 8 5 1\n";
    let floor = "v -9 -2 9\nv 9 -2 9\nv 9 -2 -9\nv -9 -2 -9\nusemtl grey\nf -4 -3 -2 -1\n";
    let folder = folder(&[
        (
            "m.mtl",
            "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\nnewmtl none\nKd 0.5 0.5 0.5\n",
        ),
        (
            "bulb.obj",
            &format!("mtllib m.mtl\n{cube}usemtl lamp\n{inwards}{floor}"),
        ),
        (
            "shown.obj",
            &format!("mtllib m.mtl\n{cube}usemtl lamp\n{outwards}{floor}"),
        ),
        ("none.obj", &format!("mtllib m.mtl\n{cube}usemtl none\n{outwards}")),
    ]);
    let at = folder.path();
    let scene = |name: &str, camera: &str, light: &str| {
        let text = format!(
            "version = 1\n[camera]\n{camera}\nvertical_fov = 20\n[image]\nwidth = 16\nheight = 16\nexposure = \"auto\"\n\
             background = \"black\"\n[render]\nsamples = 4\n[[object]]\nobj = \"{name}.obj\"\n{light}"
        );
        fs::write(at.join("s.toml"), text).unwrap();
        words(&done(at, &split("render s.toml -o o.png")))
    };
    let white = "[[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n";
    let invisible = format!("{white}[patch.none]\nopacity = 0\n");
    let black = format!("{white}[patch.none]\ndiffuse = 0\n");
    let far = "position = [0, 3, 12]\nlook_at = [0, -1, 0]";
    for (name, camera, light, reason) in [
        ("bulb", far, "", "the lamps face inwards"),
        ("none", far, &invisible, "all surfaces are invisible"),
        (
            "none",
            far,
            &black,
            "no light reaches the surfaces that the camera sees",
        ),
        (
            "shown",
            "position = [0, 3, 12]\nlook_at = [0, 99, 0]",
            "",
            "the camera sees nothing",
        ),
    ] {
        let said = scene(name, camera, light);
        assert!(
            said.contains(&format!("the picture is black: {reason}")),
            "{name}: {said}"
        );
        assert!(said.contains("`embrasure check s.toml`"), "{name}: {said}");
        assert!(!said.contains("is brighter"), "{name}: {said}");
    }
    // A little light from another source does not hide the message about the lamps.
    let faint = "[[light]]\ntype = \"constant\"\nradiance = [1e-6, 1e-6, 1e-6]\n";
    let said = scene("bulb", far, faint);
    assert!(
        said.contains("the picture is nearly black: the lamps face inwards") && !said.contains("is brighter"),
        "{said}"
    );
    let said = scene("none", far, &format!("{faint}[patch.none]\ndiffuse = 0\n"));
    assert!(!said.contains("nearly black"), "{said}");
    let said = scene("shown", far, "");
    assert!(
        !said.contains("the picture is black") && said.contains("is brighter"),
        "{said}"
    );
}

/// The steps of the summary line sum to the total time.
#[test]
fn times_of_the_summary_add_up() {
    let folder = scene();
    let said = words(&done(
        folder.path(),
        &split("render a.obj --size 128x96 --spp 64 --quality draft -o o.png"),
    ));
    let (before, steps) = said.split_once(" s in all: ").unwrap();
    let number = |text: &str| text.parse::<f64>().unwrap();
    let all = number(before.rsplit(' ').next().unwrap());
    let steps = steps.split(',').next().unwrap().split(" ->").next().unwrap();
    let (mut sum, mut names) = (0.0, Vec::new());
    for step in steps.split(" + ") {
        let (name, seconds) = step.split_once(' ').unwrap();
        sum += number(seconds);
        names.push(name);
    }
    assert!((sum - all).abs() < 1e-6 && all > 0.0, "{said}");
    assert!(names.contains(&"render") && names.contains(&"denoise"), "{said}");
}

/// A picture that a lamp leaves dark, because it faces a wall, names the lamp.
#[test]
fn lamp_that_faces_a_wall_is_named_by_render() {
    let folder = folder(&[
        ("m.mtl", "newmtl grey\nKd 0.5 0.5 0.5\n"),
        (
            "a.obj",
            "mtllib m.mtl\nusemtl grey\nv -9 -1 9\nv 9 -1 9\nv 9 -1 -9\nv -9 -1 -9\nv 9 9 -9\nv -9 9 -9\n\
             v -9 9 9\nv 9 9 9\nf 1 2 3 4\nf 4 3 5 6\nf 2 1 7 8\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 1, 8]\nlook_at = [0, 0, 0]\n[image]\nwidth = 24\nheight = 16\n\
             exposure = \"auto\"\n[render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\n\
             [[light]]\ntype = \"rectangle\"\nposition = [0, 3, -8.95]\nsize = [1, 1]\nradiance = [0.0001, 0.0001, 0.0001]\n",
        ),
    ]);
    let said = |direction: &str| {
        let text = fs::read_to_string(folder.path().join("s.toml")).unwrap();
        fs::write(folder.path().join("t.toml"), format!("{text}direction = {direction}\n")).unwrap();
        words(&done(folder.path(), &split("render t.toml -q -o x.png")))
    };
    let backward = said("[0, 0, -1]");
    assert!(
        backward.contains("warning: t.toml: lamp `rectangle light` faces a surface that is 0.049 units away"),
        "{backward}"
    );
    let forward = said("[0, 0, 1]");
    assert!(!forward.contains("faces a surface"), "{forward}");
}

/// If a flag leaves a scene without light, the warning names this flag, and the picture is called
/// black.
#[test]
fn environment_without_light_is_named() {
    let folder = folder(&[(
        "a.obj",
        "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv 0 1 0\nf 1 2 3 4\nf 1 2 5\n",
    )]);
    let line = "render a.obj --env none --size 16x12 --spp 2 -o x.png";
    let said = words(&done(folder.path(), &split(line)));
    let named = "warning: a.obj: --env none: no light of the scene emits, so the picture is black";
    assert!(
        said.contains(named) && said.contains("or remove it for the default light"),
        "{said}"
    );
    assert!(
        said.contains("warning: the picture is black: no light of the scene emits") && !said.contains("is brighter"),
        "{said}"
    );
}

/// `-q` prints warnings, but no notes.
#[test]
fn quiet_render_has_no_notes() {
    let folder = folder(&[
        (
            "a.mtl",
            "# Blender 3.6.0 MTL File\nnewmtl m\nKd 0.5 0.5 0.5\nmap_Kd none.png\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl m\nf 1/1 2/1 3/1\n",
        ),
    ]);
    let said = |more: &str| {
        let line = format!("render a.obj --size 16x12 --spp 2 -o x.png {more}");
        words(&done(folder.path(), &split(&line)))
    };
    assert!(said("").contains("note: "));
    let quiet = said("-q");
    assert!(quiet.contains("warning: ") && !quiet.contains("note: "), "{quiet}");
}

/// On a background colour, shadows on the ground end before the border of the picture. The pixels
/// of the border then have exactly this colour.
#[test]
fn shadows_end_inside_the_picture() {
    let cube = "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 2 1\nv 1 2 1\nv 1 2 -1\nv -1 2 -1\n\
                f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\nf 4 3 2 1\n";
    let folder = folder(&[("cube.obj", cube)]);
    let at = folder.path();
    for flags in ["", "--env studio --ground", "--env sky"] {
        let line =
            format!("render cube.obj -q --background white --orbit 30,25,12 --size 48x36 --spp 16 -o w.png {flags}");
        done(at, &split(&line));
        let (codes, _) = png_of(&at.join("w.png"));
        let is_border = |i: usize| i % 48 == 0 || i % 48 == 47 || i / 48 == 0 || i / 48 == 35;
        let pixels: Vec<&[u8]> = codes.chunks_exact(3).collect();
        let border = (0..48 * 36).filter(|&i| is_border(i)).all(|i| pixels[i] == [255; 3]);
        // The ground beside the cube is darker than the background.
        let shadows = pixels
            .iter()
            .filter(|p| p.iter().all(|&c| (180..250).contains(&c)))
            .count();
        assert!(border && shadows > 30, "{flags}: {border}, {shadows}");
    }
}

/// A pattern and a picture are not scenes. The errors name the command that the user needs.
#[test]
fn names_of_other_files_are_refused_with_the_command() {
    let folder = folder(&[("a.obj", "v 0 0 0\n"), ("x.exr", "")]);
    let said = |line: &str| refused(folder.path(), &split(line), 1);
    assert!(said("render *.obj").contains("`embrasure help batch` shows how to render many files"));
    assert!(said("info x.exr").contains("`embrasure develop x.exr --list`"));
}
