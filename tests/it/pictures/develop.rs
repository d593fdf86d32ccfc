//! `embrasure develop`: images from EXR files of this program and of others.

use crate::support::program::{done, folder, json, printed, refused, run, split, words, write_grey_png};
use crate::support::{read_channel, read_rgb};
use ::exr::prelude::{self as exr, WritableImage, f16};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A floor and a wall that emits light. The camera also sees the space beside them.
fn scene() -> TempDir {
    folder(&[
        (
            "a.mtl",
            "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 1 -1\nv 1 1 -1\nusemtl floor\nf 1 2 3 4\nusemtl lamp\nf 4 3 6 5\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 1, 4]\nlook_at = [0, 0.3, 0]\n[image]\nwidth = 40\nheight = 24\n\
             [render]\nsamples = 8\n[[object]]\nobj = \"a.obj\"\n",
        ),
    ])
}

/// Size, samples per pixel, and all codes of a PNG.
fn png_of(path: &Path) -> ([u32; 2], usize, Vec<u8>) {
    let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut codes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut codes).unwrap();
    let info = reader.info();
    ([info.width, info.height], info.color_type.samples(), codes)
}

#[test]
fn develop_gives_the_bytes_of_the_render() {
    let folder = scene();
    let at = folder.path();
    let same = |a: &str, b: &str| {
        assert!(
            fs::read(at.join(a)).unwrap() == fs::read(at.join(b)).unwrap(),
            "{a} and {b}"
        )
    };
    // The EXR file stores the guessed exposure and tone curve, so `develop` makes the same PNG.
    done(at, &split("render a.obj -q --size 48x40 --spp 4 -o a.exr -o a.png"));
    done(at, &split("develop -q a.exr -o again.png"));
    same("a.png", "again.png");
    // With the same flags, `develop` makes the PNG of the render.
    done(
        at,
        &split("render s.toml -q --exposure -1 --tone aces-hill -o s.exr -o s.png"),
    );
    done(
        at,
        &split("develop -q s.exr --exposure -1 --tone aces-hill -o again.png"),
    );
    same("s.png", "again.png");
    done(at, &split("render s.toml -q --exposure auto --tone agx -o auto.png"));
    done(at, &split("develop -q s.exr --exposure auto --tone agx -o again.png"));
    same("auto.png", "again.png");
    // The pixels are the same if the render or `develop` denoises
    done(at, &split("render s.toml -q --denoise=atrous -o then.exr -o then.png"));
    done(
        at,
        &split("develop -q s.exr --exposure 0 --tone srgb --denoise=atrous -o now.exr -o now.png"),
    );
    same("then.png", "now.png");
    assert!(read_rgb(&at.join("then.exr")) == read_rgb(&at.join("now.exr")));
    // The file stores the tone of the render. `--denoise` without a name selects the best available
    // denoiser.
    let said = words(&done(at, &split("develop s.exr --denoise -o best.png")));
    assert!(said.contains("best.png: tone=aces-hill exposure=-1"), "{said}");
}

#[test]
fn channels_are_listed_and_shown() {
    let folder = scene();
    let at = folder.path();
    done(at, &split("render s.toml -q --aov all -o s.exr"));
    let listed = printed(&done(at, &split("develop s.exr --list")));
    for line in [
        "40x24 pixels",
        "RGB (R G B): light, float",
        "albedo (R G B): reflectance",
        "N (X Y Z): directions",
        "Z: depth",
        "id (material object part): ids",
        "CryptoObject00 (R G B A): Cryptomatte",
        "samples: numbers",
        "variance (R G B): magnitudes",
    ] {
        assert!(listed.contains(line), "{line}: {listed}");
    }
    let all = json(&done(at, &split("develop s.exr --list --json")));
    assert_eq!(
        (&all[0]["name"], &all[0]["window"]),
        (&"RGB".into(), &serde_json::json!([0, 0, 40, 24]))
    );

    for layer in all.as_array().unwrap() {
        let name = layer["name"].as_str().unwrap();
        done(
            at,
            &[
                "develop",
                "-q",
                "s.exr",
                "--channel",
                name,
                "-o",
                "x.png",
                "-o",
                "x.exr",
            ],
        );
        let (size, samples, codes) = png_of(&at.join("x.png"));
        assert_eq!((size, samples, codes.len()), ([40, 24], 3, 40 * 24 * 3), "{name}");
    }
    let pixel = |channel: &str, x: usize, y: usize| {
        done(at, &["develop", "-q", "s.exr", "--channel", channel, "-o", "x.png"]);
        let (_, _, codes) = png_of(&at.join("x.png"));
        <[u8; 3]>::try_from(&codes[3 * (y * 40 + x)..][..3]).unwrap()
    };
    // The normal of the floor points up, its albedo equals its material, and the space
    // beside it is empty.
    assert_eq!(pixel("N", 20, 14), [128, 255, 128]);
    assert_eq!(
        pixel("albedo", 20, 14),
        [0.5, 0.4, 0.3].map(embrasure::color::srgb::encode_u8)
    );
    assert_eq!(
        (pixel("Z", 0, 0), pixel("id.object", 0, 0), pixel("N", 0, 0)),
        ([0; 3], [0; 3], [0; 3])
    );
    assert_ne!(pixel("id.material", 20, 14), pixel("id.material", 20, 10));
    // Near pixels are brighter than far pixels.
    let depth = read_channel(&at.join("s.exr"), "Z");
    let met = || (0..depth.len()).filter(|&i| depth[i] < 1e9);
    let near = met().min_by(|&a, &b| depth[a].total_cmp(&depth[b])).unwrap();
    let far = met().max_by(|&a, &b| depth[a].total_cmp(&depth[b])).unwrap();
    let brightness = |i: usize| pixel("Z", i % 40, i / 40).iter().map(|&c| u32::from(c)).sum::<u32>();
    assert!(brightness(near) > brightness(far) + 100);
    // In EXR files, data keep their values and channel names.
    done(at, &split("develop -q s.exr --channel N -o n.exr"));
    assert!(read_channel(&at.join("n.exr"), "N.Y") == read_channel(&at.join("s.exr"), "N.Y"));
    done(at, &split("develop -q s.exr --channel Z -o z.exr"));
    assert!(read_channel(&at.join("z.exr"), "Z") == read_channel(&at.join("s.exr"), "Z"));
}

#[test]
fn crops_and_scales_use_full_image_pixels() {
    let folder = scene();
    let at = folder.path();
    done(at, &split("render s.toml -q -o s.exr"));
    done(at, &split("develop -q s.exr --channel N --scale 3 -o n.png"));
    assert_eq!(png_of(&at.join("n.png")).0, [120, 72]);
    done(at, &split("render s.toml -q --crop 10,4,30,20 -o crop.exr"));
    done(at, &split("develop -q s.exr --crop 10,4,30,20 -o c.exr -o c.png"));
    assert!(read_rgb(&at.join("c.exr")) == read_rgb(&at.join("crop.exr")));
    assert_eq!(png_of(&at.join("c.png")).0, [20, 16]);
    // Crop a cropped file, by coordinates of the full image
    done(at, &split("develop -q crop.exr --crop 12,6,14,9 -o d.exr"));
    assert_eq!(read_channel(&at.join("d.exr"), "R").len(), 6);
    let value = |path: &str, i: usize| read_channel(&at.join(path), "G")[i];
    assert_eq!(value("d.exr", 0), value("s.exr", 6 * 40 + 12));

    for (scale, size) in [
        ("0.5", [20, 12]),
        ("2", [80, 48]),
        ("10x30", [10, 30]),
        ("0.001", [1, 1]),
    ] {
        done(
            at,
            &split(&format!("develop -q s.exr --scale {scale} -o x.png -o x.exr")),
        );
        assert_eq!(png_of(&at.join("x.png")).0, size, "{scale}");
        let mean = |path: &str| {
            let values = read_channel(&at.join(path), "G");
            values.iter().sum::<f32>() / values.len() as f32
        };
        assert!(
            (mean("x.exr") / mean("s.exr") - 1.0).abs() < 0.02,
            "{scale}: {} and {}",
            mean("x.exr"),
            mean("s.exr")
        );
    }
    // Pixels of a reduced image are averages over areas
    done(at, &split("develop -q s.exr --scale 0.5 -o x.exr"));
    let (all, half) = (
        read_channel(&at.join("s.exr"), "R"),
        read_channel(&at.join("x.exr"), "R"),
    );
    let expected = (all[20 * 40 + 8] + all[20 * 40 + 9] + all[21 * 40 + 8] + all[21 * 40 + 9]) / 4.0;
    assert!((half[10 * 20 + 4] - expected).abs() < 1e-5);
}

/// `{face}` in a file name writes the six faces of a cube map as six files. Each file has the
/// pixels of a crop.
#[test]
fn faces_of_cube_maps_are_files() {
    let folder = scene();
    let at = folder.path();
    done(
        at,
        &split("render s.toml -q --projection cubemap --size 30x20 --spp 2 --denoise=off -o c.exr"),
    );
    done(
        at,
        &split("develop -q c.exr -o f_{face}.exr -o f_{face}.png -o whole.png"),
    );
    done(at, &split("develop -q c.exr --channel Z --scale 2 -o z_{face}.exr"));
    let faces = ["right", "left", "up", "down", "front", "back"];
    for (index, face) in faces.iter().enumerate() {
        let corner = [index % 3 * 10, index / 3 * 10];
        let crop = format!("{},{},{},{}", corner[0], corner[1], corner[0] + 10, corner[1] + 10);
        done(
            at,
            &split(&format!("develop -q c.exr --crop {crop} -o crop.exr -o crop.png")),
        );
        assert!(
            read_rgb(&at.join(format!("f_{face}.exr"))) == read_rgb(&at.join("crop.exr")),
            "{face}"
        );
        assert!(
            png_of(&at.join(format!("f_{face}.png"))) == png_of(&at.join("crop.png")),
            "{face}"
        );
        assert_eq!(read_channel(&at.join(format!("z_{face}.exr")), "Z").len(), 400);
    }
    assert_eq!(png_of(&at.join("whole.png")).0, [30, 20]);
    // The file of a face is a whole picture, with its own pixel coordinates.
    done(at, &split("develop -q f_front.exr --crop 0,0,10,10 -o g.exr"));
    done(at, &split("render s.toml -q --spp 1 -o s.exr"));
    // A perspective whose shape is that of a cube map
    done(
        at,
        &split("render s.toml -q --size 30x20 --spp 65 --samples 0..64 -o narrow.exr"),
    );
    done(
        at,
        &split("render s.toml -q --projection cubemap --size 30x20 --crop 0,0,20,20 --spp 1 -o part.exr"),
    );
    for (command, words) in [
        ("develop s.exr -o {face}.png", "40x24 pixels, which are not six squares"),
        ("develop part.exr -o {face}.png", "only a part of the picture"),
        ("develop c.exr --crop 0,0,10,10 -o {face}.png", "--crop or --matte"),
        ("develop c.exr --channel Z -o {face}.png", "write .exr files"),
        ("develop c.exr --scale 99999 -o {face}.png", "--scale"),
        ("render s.toml -o {face}.png", "add --projection cubemap"),
        (
            "render s.toml --projection cubemap --size 30x20 --crop 0,0,20,20 -o {face}.png",
            "merge PART.exr... -o 'cube_{face}.png'",
        ),
        (
            "render s.toml --projection cubemap --size 30x20 --spp 65 --samples 0..64 -o {face}.exr",
            "merge PART.exr... -o 'cube_{face}.png'",
        ),
        ("merge part.exr -o {face}.png", "not the whole picture"),
        ("merge narrow.exr -o {face}.png", "no cube map"),
        ("explain s.toml floor -o {face}.png", "the picture is not a cube map"),
    ] {
        let message = refused(at, &split(command), 2);
        assert!(message.contains(words), "{command}: {message}");
    }
}

/// `render` and `merge` write the files that `develop` makes from the whole picture: denoised, with
/// the exposure of the whole picture, and after a resumed render.
#[test]
fn render_and_merge_write_faces() {
    let folder = scene();
    let at = folder.path();
    let cube = "render s.toml -q --projection cubemap --size 30x20 --exposure auto --denoise=gaussian";
    let files = |name: &str| format!("-o {name}.exr -o {name}_{{face}}.exr -o {name}_{{face}}.png");
    done(at, &split(&format!("{cube} --spp 66 {}", files("c"))));
    done(at, &split("develop -q c.exr -o d_{face}.exr -o d_{face}.png"));
    for (part, range) in [("a", "0..64"), ("b", "64..66")] {
        done(at, &split(&format!("{cube} --spp 66 --samples {range} -o {part}.exr")));
    }
    done(at, &split(&format!("merge -q a.exr b.exr {}", files("m"))));
    let state = "--checkpoint state.exr --resume";
    done(at, &split(&format!("{cube} --spp 1 {state} -o first_{{face}}.png")));
    done(at, &split(&format!("{cube} --spp 66 {state} {}", files("r"))));
    for face in ["right", "left", "up", "down", "front", "back"] {
        let name = |of: &str, extension: &str| at.join(format!("{of}_{face}.{extension}"));
        let [light, picture] = [read_rgb(&name("d", "exr")), read_rgb(&name("c", "exr"))];
        assert_eq!(light[0].len(), 100);
        assert!(light == picture, "{face}");
        for of in ["c", "m", "r"] {
            assert!(read_rgb(&name(of, "exr")) == picture, "{of}, {face}");
            assert!(png_of(&name(of, "png")) == png_of(&name("d", "png")), "{of}, {face}");
        }
        assert!(name("first", "png").is_file());
        assert_eq!(read_channel(&name("c", "exr"), "albedo.R").len(), 100);
    }
}

/// Function that returns the value of a channel at a column and a row.
type Values = fn(usize, usize) -> f32;

/// Writes a file like another renderer: a named part, separate layers, half floats, different
/// windows.
fn write_foreign(path: &Path, channels: &[(&str, Values)]) {
    let (width, height) = (6, 4);
    let list = channels.iter().map(|(name, value)| {
        let values = (0..width * height)
            .map(|i| f16::from_f32(value(i % width, i / width)))
            .collect();
        exr::AnyChannel::new(*name, exr::FlatSamples::F16(values))
    });
    let attributes = exr::LayerAttributes {
        layer_position: exr::Vec2(3, 2),
        ..Default::default()
    };
    let channels = exr::AnyChannels::sort(list.collect());
    let layer = exr::Layer::new((width, height), attributes, exr::Encoding::FAST_LOSSLESS, channels);
    let mut file = exr::Image::from_layer(layer);
    file.attributes.display_window = exr::IntegerBounds {
        position: exr::Vec2(1, 1),
        size: exr::Vec2(10, 8),
    };
    file.write().to_file(path).unwrap();
}

#[test]
fn files_of_other_renderers_are_developed() {
    let folder = folder(&[]);
    let at = folder.path();
    write_foreign(
        &at.join("cycles.exr"),
        &[
            ("ViewLayer.Combined.R", |x, _| x as f32),
            ("ViewLayer.Combined.G", |_, y| y as f32),
            ("ViewLayer.Combined.B", |_, _| 0.5),
            ("ViewLayer.Combined.A", |x, _| if x < 3 { 0.5 } else { 1.0 }),
            ("ViewLayer.Depth.Z", |x, _| 1.0 + x as f32),
            ("ViewLayer.Denoising Albedo.R", |_, _| 0.5),
            ("ViewLayer.Denoising Albedo.G", |_, _| 0.5),
            ("ViewLayer.Denoising Albedo.B", |_, _| 0.5),
        ],
    );
    let listed = printed(&done(at, &split("develop cycles.exr --list")));
    assert!(listed.contains("10x8 pixels, 8 channels"), "{listed}");
    assert!(
        listed.contains("ViewLayer.Combined (R G B A): light, half, 6x4 pixels from 2,1"),
        "{listed}"
    );
    done(at, &split("develop -q cycles.exr -o c.png -o c.exr"));
    let (size, samples, codes) = png_of(&at.join("c.png"));
    // The PNG has straight alpha, the EXR has premultiplied colours
    assert_eq!((size, samples), ([6, 4], 4));
    assert_eq!(&codes[4..8], [255, 0, 255, 128]);
    assert_eq!(read_channel(&at.join("c.exr"), "B")[0], 0.5);
    assert_eq!(read_channel(&at.join("c.exr"), "A")[0], 0.5);
    done(at, &split("develop -q cycles.exr --channel depth -o d.png"));
    assert_eq!(png_of(&at.join("d.png")).1, 3);
    done(
        at,
        &split("develop -q cycles.exr --crop 4,2,6,4 --denoise=gaussian -o g.exr"),
    );
    assert_eq!(read_channel(&at.join("g.exr"), "R").len(), 4);
    // The wavelets need channels that the file lacks.
    let said = refused(at, &split("develop cycles.exr --denoise=atrous -o x.png"), 1);
    assert!(
        said.contains("cycles.exr") && said.contains("no channel N.X") && said.contains("help:"),
        "{said}"
    );

    // A file with luminance only, and a file without colours
    write_foreign(&at.join("grey.exr"), &[("Y", |x, _| x as f32 / 8.0)]);
    done(at, &split("develop -q grey.exr -o y.png"));
    let (_, samples, codes) = png_of(&at.join("y.png"));
    assert!(samples == 3 && codes[3] == codes[4] && codes[4] == codes[5] && codes[3] > 0);
    write_foreign(
        &at.join("depth.exr"),
        &[("Z", |x, _| x as f32), ("odd.name", |_, _| f32::NAN)],
    );
    let said = refused(at, &split("develop depth.exr -o x.png"), 1);
    assert!(
        said.contains("depth.exr: has no layer with colours") && said.contains("--channel: Z, odd"),
        "{said}"
    );
    done(at, &split("develop -q depth.exr --channel odd -o x.png"));
}

#[test]
fn invalid_develop_arguments_are_errors() {
    let folder = scene();
    let at = folder.path();
    done(at, &split("render s.toml -q -o s.exr"));
    fs::write(at.join("text.exr"), "no picture").unwrap();
    write_grey_png(&at.join("grey.png"), &[1, 2, 3]);
    for (line, code, expected) in [
        ("s.exr", 2, &["needs --output FILE", "help:"][..]),
        ("gone.exr -o x.png", 1, &["gone.exr", "help:"]),
        ("text.exr -o x.png", 1, &["text.exr", "EXR", "help:"]),
        (
            "grey.png -o x.png",
            1,
            &["a PNG file has no light to develop", "give an .exr file"],
        ),
        ("s.exr -o x.jpg", 2, &[".jpg", ".png"]),
        ("s.exr -o s.exr", 2, &["would overwrite"]),
        ("s.exr -o x.png -o x.png", 2, &["same file"]),
        (
            "s.exr -o x.png --channel albedos",
            1,
            &["albedos", "did you mean albedo? the file has RGB, N, Z"],
        ),
        (
            "s.exr -o x.png --denoise=median",
            2,
            &["median", "off, oidn, oidn-fast, atrous, gaussian"],
        ),
        (
            "s.exr -o x.png --denoise=atrous --channel N",
            2,
            &["N is not a layer of light"],
        ),
        (
            "s.exr -o x.png --crop 0,0,41,10",
            2,
            &["--crop 0,0,41,10", "inside 0,0,40,24"],
        ),
        ("s.exr -o x.png --crop 5,5,5,10", 2, &["holds no pixel"]),
        ("s.exr -o x.png --scale 0", 2, &["--scale", "0.5"]),
        ("s.exr -o x.png --scale 0x4", 2, &["--scale 0x4", "1 to 65536"]),
        ("s.exr -o x.png --scale 99999", 2, &["--scale 99999", "1 to 65536"]),
        (
            "s.exr -o x.png --exposure much",
            2,
            &["--exposure much", "auto or studio"],
        ),
        ("s.exr -o x.png --tone film", 2, &["--tone film", "agx"]),
    ] {
        let said = refused(at, &split(&format!("develop {line}")), code);
        for words in expected {
            assert!(said.contains(words), "{line}: {said}");
        }
        assert!(!at.join("x.png").exists(), "{line}");
    }
    // `--list` and `--output` exclude each other.
    let out = run(at, &split("develop s.exr --list -o x.png"));
    assert_eq!(out.status.code(), Some(2));
}

/// `{part}` in the name writes a mask for each part. Each mask equals the mask of `--matte`. Parts
/// that no pixel shows have no file, and are named.
#[test]
fn each_part_gets_a_mask_of_its_own() {
    let folder = folder(&[(
        "p.obj",
        "o left/a\nv -1 0 0\nv -0.2 0 0\nv -0.2 1 0\nf 1 2 3\no right\nv 0.2 0 0\nv 1 0 0\nv 1 1 0\nf 4 5 6\n\
         o behind\nv 0.9 0.3 -0.1\nv 0.95 0.3 -0.1\nv 0.95 0.35 -0.1\nf 7 8 9\no away\nv 90 0 0\nv 91 0 0\nv 91 1 0\nf 10 11 12\n",
    )]);
    let at = folder.path();
    let camera = "--position 0,0.5,3 --look-at 0,0.5,0 --up 0,1,0 --fov 40 --no-ground --env white";
    let line = format!("render p.obj -q --size 48x32 --spp 4 --aov cryptomatte {camera} -o p.exr");
    done(at, &split(&line));
    let said = words(&done(at, &["develop", "p.exr", "-o", "masks/{part}.png"]));
    assert!(
        said.contains("2 masks of parts -> masks/left_a.png … masks/right.png"),
        "{said}"
    );
    assert!(
        said.contains("no mask is written for 2 parts that no pixel shows: `away`, `behind`"),
        "{said}"
    );
    assert!(said.contains("help: surfaces are outside of the picture"), "{said}");
    let mut files: Vec<String> = std::fs::read_dir(at.join("masks"))
        .unwrap()
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(files, ["left_a.png", "right.png"]);
    done(at, &split("develop p.exr -q --matte right -o one.png"));
    assert!(png_of(&at.join("one.png")) == png_of(&at.join("masks/right.png")));
    // A pattern selects names, and each kind has a placeholder.
    done(
        at,
        &["develop", "p.exr", "-q", "--matte", "r*", "-o", "some/{part}.exr"],
    );
    assert_eq!(std::fs::read_dir(at.join("some")).unwrap().count(), 1);
    done(
        at,
        &[
            "develop",
            "p.exr",
            "-q",
            "-o",
            "all-{object}.png",
            "-o",
            "all-{object}.exr",
        ],
    );
    assert!(at.join("all-p.png").exists() && at.join("all-p.exr").exists());
    // The mask of a name without a visible pixel is black, with a warning.
    let said = words(&done(at, &split("develop p.exr --matte away -o away.png")));
    assert!(
        said.contains("warning: the mask is empty, because no pixel shows `away`"),
        "{said}"
    );
    assert!(png_of(&at.join("away.png")).2.iter().all(|&code| code == 0));
    for (line, expected) in [
        ("develop p.exr -o {part}.png -o x.png", "by separate commands"),
        ("develop p.exr --channel Z -o {part}.png", "leave these flags out"),
        ("develop p.exr --exposure 1 -o {part}.png", "leave these flags out"),
    ] {
        let said = refused(at, &split(line), 2);
        assert!(said.contains(expected), "{line}: {said}");
    }
    let said = refused(at, &split("develop p.exr --matte q* -o {part}.png"), 1);
    assert!(said.contains("no part, object or material matches `q*`"), "{said}");
    // The list has the flag of each layer and name.
    let listed = printed(&done(at, &split("develop p.exr --list")));
    for line in [
        "  RGB (R G B): light, float; no flag\n",
        "; --channel albedo\n",
        "CryptoPart has 5 names; a file for each name: -o '{part}.png'\n",
        "  left/a; --matte 'left/a'\n",
        "-o '{material}.png'\n",
    ] {
        assert!(listed.contains(line), "{line}: {listed}");
    }
    let all = json(&done(at, &split("develop p.exr --list --json")));
    let layers = all.as_array().unwrap();
    let parts = layers.iter().find(|layer| layer["name"] == "CryptoPart00").unwrap();
    assert_eq!(
        parts["names"],
        serde_json::json!(["away", "behind", "left/a", "p", "right"])
    );
    assert!(layers[0]["names"].is_null());
}

/// The list of layers has the names of the numbers of materials and objects. The channel has these
/// numbers.
#[test]
fn numbers_of_ids_have_names() {
    let folder = scene();
    let at = folder.path();
    done(at, &split("render s.toml -q --spp 4 --aov id -o a.exr"));
    let text = printed(&done(at, &split("develop a.exr --list")));
    assert!(text.contains("numbers of id.material: 1 floor, 2 lamp\n"), "{text}");
    let found = json(&done(at, &split("develop a.exr --list --json")));
    let of_layers = found
        .as_array()
        .unwrap()
        .iter()
        .map(|layer| &layer["numbers"]["id.material"]);
    let names = of_layers.into_iter().find(|names| names.is_array()).unwrap();
    let numbers = read_channel(&at.join("a.exr"), "id.material");
    let largest = numbers.iter().fold(0.0f32, |max, &number| max.max(number));
    assert_eq!(largest as usize, names.as_array().unwrap().len());
}

/// The mask of a material is the coverage of the material in each pixel. The masks of all materials
/// add up to the coverage of all objects.
#[test]
fn mattes_are_the_shares_of_their_names() {
    let folder = scene();
    let at = folder.path();
    done(
        at,
        &split("render s.toml -q --aov cryptomatte --checkpoint c.exr -o a.exr"),
    );
    let mask = |pattern: &str| {
        done(
            at,
            &[
                "develop", "a.exr", "-q", "--matte", pattern, "-o", "m.png", "-o", "m.exr",
            ],
        );
        let (size, samples, codes) = png_of(&at.join("m.png"));
        assert_eq!((size, samples), ([40, 24], 1));
        let values = read_channel(&at.join("m.exr"), "Y");
        for (code, value) in codes.iter().zip(&values) {
            assert_eq!(f32::from(*code), (value * 255.0).round(), "{pattern}");
        }
        values
    };
    let [floor, lamp, both, objects] = ["floor", "CryptoMaterial:lamp", "*l*", "CryptoObject:*"].map(mask);
    let [mut sees_floor, mut sees_edge] = [false; 2];
    for i in 0..floor.len() {
        let sum = floor[i] + lamp[i];
        assert!((sum - both[i]).abs() < 1e-6 && (sum - objects[i]).abs() < 1e-6);
        sees_floor |= floor[i] == 1.0;
        sees_edge |= floor[i] > 0.0 && lamp[i] > 0.0;
    }
    assert!(sees_floor && sees_edge);
    done(at, &split("develop c.exr -q --matte floor -o c.png"));
    done(at, &split("develop a.exr -q --matte floor -o m.png"));
    assert!(png_of(&at.join("c.png")) == png_of(&at.join("m.png")));
    // Other programs may write the manifests into files of their own.
    use ::exr::prelude::{AttributeValue, Text, WritableImage, read_all_flat_layers_from_file};
    let mut image = read_all_flat_layers_from_file(at.join("a.exr")).unwrap();
    let mut count = 0;
    for attributes in image.layer_data.iter_mut().map(|layer| &mut layer.attributes.other) {
        let manifests: Vec<Text> = attributes
            .keys()
            .filter(|key| key.to_string().ends_with("/manifest"))
            .cloned()
            .collect();
        for key in manifests {
            let Some(AttributeValue::Text(manifest)) = attributes.remove(&key) else {
                continue;
            };
            let name = format!("manifest{count}.json");
            std::fs::write(at.join(&name), manifest.to_string()).unwrap();
            let key = key.to_string().replace("/manifest", "/manif_file");
            attributes.insert(key.as_str().into(), AttributeValue::Text(name.as_str().into()));
            count += 1;
        }
    }
    assert_eq!(count, 2);
    image.write().to_file(at.join("sidecar.exr")).unwrap();
    done(at, &split("develop sidecar.exr -q --matte floor -o side.png"));
    done(at, &split("develop a.exr -q --matte floor -o m.png"));
    assert!(png_of(&at.join("side.png")) == png_of(&at.join("m.png")));
    let message = refused(at, &split("develop a.exr --matte flor -o m.png"), 1);
    assert!(message.contains("did you mean `floor`?"), "{message}");
    done(at, &split("render s.toml -q -o plain.exr"));
    let message = refused(at, &split("develop plain.exr --matte floor -o m.png"), 1);
    assert!(message.contains("--aov cryptomatte"), "{message}");
}
