//! Quotes of input files in errors, and repaired or ignored content: images, repeated geometry,
//! libraries.

use crate::support::program::{code, done, folder, json, lit_floor, printed, refused, run, split, words};
use crate::support::{read_rgb, rel_mse, write_png as write_rgb_png};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const SCENE: &str = "version = 1\n[[object]]\nobj = 'a.obj'\n";

/// A scene file can name any file. Errors quote at most 40 characters of the content of a file, and
/// at most 120 characters of a name.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn errors_quote_at_most_40_characters() {
    let long = "Q".repeat(300);
    let obj = |line: &str| (SCENE.to_string(), format!("{TRIANGLE}{line}\nf 1 2 3\n"), String::new());
    let mtl = |line: &str| {
        let obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n");
        (SCENE.to_string(), obj, format!("newmtl a\n{line}\n"))
    };
    let toml = |lines: &str| {
        let obj = format!("{TRIANGLE}usemtl a\nf 1 2 3\n");
        (format!("{SCENE}{lines}\n"), obj, String::new())
    };
    let mut cases = vec![toml("instances = 'i.txt'")];
    for keyword in [
        "v", "v 0 0", "vt", "vn", "f", "f 1 2", "usemtl", "mtllib", "s", "call", "g", "o",
    ] {
        cases.push(obj(&format!("{keyword} {long}")));
    }
    cases.push(obj(&long));
    cases.push(obj(&format!("f 1 2 {}", "9".repeat(300))));
    for key in [
        "Kd",
        "Kd 1 1",
        "Ns",
        "illum",
        "d",
        "Tr",
        "Pr",
        "map_Kd",
        "map_Kd -o",
        "map_Kd -clamp",
        "map_Kd -imfchan",
        "bump",
        "newmtl",
        "Kd spectral",
    ] {
        cases.push(mtl(&format!("{key} {long} a")));
        cases.push(mtl(&format!("{key} {long}")));
    }
    cases.push(mtl(&long));
    cases.push(mtl(&format!("map_Kd -{long} x.png")));
    cases.push(mtl(&format!("newmtl {long}\nKd 2 2 2\nNs x")));
    for lines in [
        "Q = 1",
        "width = 'Q'",
        "[Q]\nx = 1",
        "[camera]\nposition = 'Q'",
        "[camera]\nQ = 1",
        "[camera]\nview = 'Q'",
        "[render]\nintegrator = 'Q'",
        "[render]\nQ = 1",
        "[image]\nwidth = 'Q'",
        "[material.Q]\ndiffuse = 1",
        "[material.a]\nQ = 1",
        "[material.a]\nmodel = 'Q'",
        "[material.a]\ndiffuse = 'Q'",
        "[material.a]\ndiffuse = { texture = 'a.png', Q = 1 }",
        "[material.a]\ndiffuse = { texture = 'a.png', channel = 'Q' }",
        "[[light]]\ntype = 'Q'",
        "[[light]]\ntype = 'sky'\nQ = 1",
        "[[light]]\ntype = 'sky'\ngroup = 'Q'",
        "[[light]]\ntype = 'environment'\nimage = 'Q'",
        "[[light_group]]\nname = 'Q'\nmaterials = ['a']",
        "[[light_group]]\nname = 'a'\nmaterials = ['Q']",
        "[patch.'Q']\ndiffuse = 1",
        "[ground]\nQ = 1",
    ] {
        cases.push(toml(&lines.replace('Q', &long)));
    }
    for (toml, obj, mtl) in &cases {
        let folder = folder(&[
            ("s.toml", toml),
            ("a.obj", obj),
            ("a.mtl", mtl),
            ("i.txt", &format!("{long} {long}\n")),
        ]);
        for command in [
            "check s.toml",
            "info s.toml --json",
            "render s.toml --size 2x2 --spp 1 -q -o x.exr",
        ] {
            let output = run(folder.path(), &split(command));
            assert!(matches!(code(&output), 0..=2), "{command}: {}", words(&output));
            // `info` prints the names of the files.
            let text = if command.starts_with("info") {
                words(&output)
            } else {
                words(&output) + &printed(&output)
            };
            for longest in ["Q", "9"].map(|letter| letter.repeat(121)) {
                assert!(!text.contains(&longest), "{command} {toml} {obj} {mtl}: {text}");
            }
            let is_file = text.contains("missing") || text.contains("environment") || text.contains("no such");
            let of_material = ["usemtl Q", "newmtl Q", "[material.Q", "[patch.'Q", "materials = ['Q"];
            let is_material = |name: &&str| [toml, obj, mtl].iter().any(|text| text.contains(*name));
            let is_name = is_file || of_material.iter().any(is_material);
            for longest in ["Q", "9"].map(|letter| letter.repeat(41)) {
                assert!(
                    is_name || !text.contains(&longest),
                    "{command} {toml} {obj} {mtl}: {text}"
                );
            }
        }
    }
}

fn write_environment(folder: &Path, texel: [f32; 3]) {
    let color = |x: usize, y: usize| if (x, y) == (3, 1) { texel } else { [0.5; 3] };
    exr::prelude::write_rgb_file(folder.join("sky.exr"), 8, 4, |x, y| {
        <(f32, f32, f32)>::from(color(x, y))
    })
    .unwrap();
}

#[test]
fn bad_environment_texels_are_repaired() {
    let toml = format!(
        "{SCENE}[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\nvertical_fov = 20\n\
         [image]\nwidth = 8\nheight = 8\n[[light]]\ntype = 'environment'\nimage = 'sky.exr'\n"
    );
    let folder = folder(&[("s.toml", &toml), ("a.obj", &format!("{TRIANGLE}f 1 2 3\n"))]);
    let picture = |texel: [f32; 3]| {
        write_environment(folder.path(), texel);
        let output = done(folder.path(), &split("render s.toml --spp 4 -o x.exr"));
        (words(&output), read_rgb(&folder.path().join("x.exr")))
    };
    let (_, black) = picture([0.0; 3]);
    let (_, bright) = picture([65504.0; 3]);
    for (texel, right, told) in [
        (
            [-1e-5; 3],
            &black,
            "1 texel with negative channels (-0.00001 at column 3, row 1), which counts as 0",
        ),
        (
            [f32::NAN; 3],
            &black,
            "1 texel with NaN channels (at column 3, row 1), which counts as 0",
        ),
        (
            [f32::NEG_INFINITY; 3],
            &black,
            "1 texel with negative channels (-inf at column 3, row 1), which counts as 0",
        ),
        (
            [f32::INFINITY; 3],
            &bright,
            "1 texel with infinite channels (at column 3, row 1), which counts as 65504, the largest 16-bit float",
        ),
    ] {
        let (text, found) = picture(texel);
        assert!(text.contains(told), "{texel:?}: {text}");
        assert_eq!(&found, right, "{texel:?}");
        let check = printed(&done(folder.path(), &split("check s.toml")));
        assert!(
            check.contains("[bad-texels]") && check.contains("0 errors, 1 warning"),
            "{check}"
        );
    }
}

/// Writes a JPEG file of 8 × 8 pixels with an EXIF orientation.
fn write_jpeg(path: &Path, orientation: u8) {
    let mut bytes = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new(&mut bytes);
    image::ImageEncoder::write_image(encoder, &[128; 192], 8, 8, image::ExtendedColorType::Rgb8).unwrap();
    let mut exif = b"\xff\xe1\0\x22Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
    drop(bytes.splice(2..2, exif));
    fs::write(path, bytes).unwrap();
}

fn write_png(path: &Path, gamma: Option<f32>) {
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    if let Some(gamma) = gamma {
        encoder.set_source_gamma(png::ScaledFloat::new(gamma));
    }
    encoder.write_header().unwrap().write_image_data(&[128; 3]).unwrap();
}

#[test]
fn ignored_texture_metadata_is_reported() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}vt 0 0\nusemtl a\nf 1/1 2/1 3/1\n");
    let folder = folder(&[("s.toml", SCENE), ("a.obj", &obj), ("a.mtl", "")]);
    let told = |key: &str, file: &str| {
        fs::write(
            folder.path().join("a.mtl"),
            format!("newmtl a\nKd 1 1 1\n{key} {file}\n"),
        )
        .unwrap();
        let check = printed(&done(folder.path(), &split("check s.toml")));
        let render = words(&done(
            folder.path(),
            &split("render s.toml --size 2x2 --spp 1 -o x.exr"),
        ));
        let count = |text: &str| text.matches(" is ignored: ").count();
        assert_eq!(count(&check), count(&render), "{check} {render}");
        assert_eq!(check.matches("[ignored-metadata]").count(), count(&check), "{check}");
        check
    };
    write_jpeg(&folder.path().join("turned.jpg"), 6);
    write_jpeg(&folder.path().join("upright.jpg"), 1);
    write_png(&folder.path().join("linear.png"), Some(1.0));
    write_png(&folder.path().join("srgb.png"), Some(0.45455));
    write_png(&folder.path().join("plain.png"), None);
    assert!(told("map_Kd", "turned.jpg").contains("EXIF orientation 6 is ignored"));
    assert!(told("map_Kd", "linear.png").contains("the exponent 1 in gAMA is ignored"));
    for (key, file) in [
        ("map_Kd", "upright.jpg"),
        ("map_Kd", "srgb.png"),
        ("map_Kd", "plain.png"),
        // Textures of numbers are read as linear. The gAMA chunk of this file says the same, so
        // nothing is ignored.
        ("map_Pr", "linear.png"),
    ] {
        assert!(!told(key, file).contains("ignored"), "{key} {file}");
    }
}

#[test]
fn repeated_geometry_is_skipped_and_reported() {
    let mut obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl a\n");
    (0..20_000).for_each(|_| obj += "f 1 2 3\n");
    let toml = format!("{SCENE}instances = 'i.txt'\n");
    let folder = folder(&[
        ("s.toml", SCENE),
        ("i.toml", &toml),
        ("i.txt", &"1 0 0 0 0 1 0 0 0 0 1 0\n".repeat(20_000)),
        ("a.obj", &obj),
        ("a.mtl", "newmtl a\nKd 0.5 0.5 0.5\nKe 1 1 1\n"),
    ]);
    let info = json(&done(folder.path(), &split("info s.toml --json")));
    assert_eq!([&info["triangles"], &info["lights"]["triangle"]], [1, 1], "{info}");
    let render = words(&done(
        folder.path(),
        &split("render i.toml --size 4x4 --spp 1 -o x.exr"),
    ));
    for told in [
        "triangles that repeat others at the same place, skipped: 19999",
        "instances that repeat others at the same place, skipped: 19999",
    ] {
        assert!(render.contains(told), "{told}: {render}");
    }
}

/// Two coincident lamps with different materials.
#[test]
fn coincident_lamps_are_reported() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    let mtl = "newmtl a\nKe 1 1 1\nnewmtl b\nKe 2 2 2\n";
    let folder = folder(&[("s.toml", SCENE), ("a.obj", &obj), ("a.mtl", mtl)]);
    let check = printed(&done(folder.path(), &split("check s.toml")));
    let told = "1 emitting triangle lies on others, up to 2 at one place: light sampling counts all of them";
    assert!(
        check.contains(told) && check.contains("[coincident-emitters]"),
        "{check}"
    );
}

#[test]
fn many_missing_libraries_are_one_warning() {
    let mut obj = String::new();
    (0..20_000).for_each(|i| writeln!(obj, "mtllib missing{i}.mtl").unwrap());
    obj += TRIANGLE;
    obj += "f 1 2 3\n";
    let folder = folder(&[("s.toml", SCENE), ("a.obj", &obj)]);
    let check = printed(&done(folder.path(), &split("check s.toml")));
    assert!(check.contains("and 19999 more findings of this kind"), "{check}");
}

/// Messages of a render of `count` coincident triangles, each with its own material.
fn coincident(count: usize) -> String {
    let library: String = (0..count).map(|i| format!("newmtl m{i}\nKd 0.5 0.5 0.5\n")).collect();
    let faces: String = (0..count).map(|i| format!("usemtl m{i}\nf 1 2 3\n")).collect();
    let mesh = format!("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}");
    let folder = folder(&[("a.mtl", &library), ("a.obj", &mesh)]);
    words(&run(folder.path(), &split("render a.obj --size 4x4 --spp 1 -o a.png")))
}

#[test]
fn many_coincident_triangles_are_reported() {
    let said = coincident(40);
    assert!(
        said.contains("up to 40 triangles") && said.contains("[coincident-triangles]"),
        "{said}"
    );
    let said = coincident(31);
    assert!(!said.contains("coincident-triangles"), "{said}");
}

#[test]
fn filter_with_negative_lobes_is_noted() {
    let folder = lit_floor();
    let said = |filter: &str| {
        let line = format!("render s.toml --size 4x4 --spp 1 --filter {filter} -o a.exr");
        words(&done(folder.path(), &split(&line)))
    };
    assert!(said("mitchell").contains("note: the mitchell filter has negative lobes"));
    assert!(!said("gaussian").contains("negative lobes"));
}

/// Exporters write invalid numbers. Each is a warning, and the render continues.
#[test]
fn wrong_material_values_are_warnings() {
    let square = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3 4\n";
    let wrong = "newmtl red\nNs -1.960784\nKd 0.8 0.2 0.1\nKs -1 0 0\nNi -1.0\nd 1.000001\nillum 2.0\nmap_Kd\n";
    let right = "newmtl red\nNs 0\nKd 0.8 0.2 0.1\nKs 0 0 0\nd 1\nillum 2\n";
    let render = |mtl: &str| {
        let folder = folder(&[("a.obj", square), ("a.mtl", mtl)]);
        let args = split("render a.obj -q --size 16x16 --spp 4 -o x.exr");
        let said = words(&done(folder.path(), &args));
        let checked = printed(&run(folder.path(), &split("check a.obj")));
        let strict = code(&run(
            folder.path(),
            &split("render a.obj -q --strict --size 4x4 -o y.exr"),
        ));
        (read_rgb(&folder.path().join("x.exr")), said, checked, strict)
    };
    let (picture, said, checked, strict) = render(wrong);
    let (expected, .., strict_of_right) = render(right);
    assert!(picture == expected, "the nearest right values count");
    assert!(
        said.contains("a.mtl:2:4: material `red`: Ns is `-1.960784`; 0 is used"),
        "{said}"
    );
    for line in [2, 4, 5, 6, 7, 8] {
        assert!(checked.contains(&format!("a.mtl:{line}:")), "line {line}: {checked}");
    }
    assert_eq!((strict, strict_of_right), (1, 0));
}

/// Wrong texture coordinates become 0 0, and a face with a wrong vertex is skipped.
#[test]
fn wrong_face_indices_are_warnings() {
    let corners = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n";
    let render = |faces: &str| {
        let obj = format!("{corners}{faces}");
        let folder = folder(&[("a.obj", &obj), ("a.mtl", "newmtl a\nmap_Kd a.png\n")]);
        crate::support::write_png(
            &folder.path().join("a.png"),
            2,
            &[[255, 0, 0], [0, 255, 0], [0, 0, 255], [9, 9, 9]],
        );
        let args = split("render a.obj -q --size 16x16 --spp 4 -o x.exr");
        let said = words(&done(folder.path(), &args));
        let strict = split("render a.obj -q --strict --size 4x4 -o y.exr");
        let strict = code(&run(folder.path(), &strict));
        (read_rgb(&folder.path().join("x.exr")), said, strict)
    };
    let (picture, said, strict) = render("f 1/1 2/2 3/3\nf 1/3 3/2 4/7\nf 1 2 9\n");
    let (expected, _, strict_of_right) = render("f 1/1 2/2 3/3\nf 1/3 3/2 4/1\n");
    assert!(picture == expected, "wrong texture coordinates count as 0 0");
    let (other, ..) = render("f 1/1 2/2 3/3\nf 1/3 3/2 4/3\n");
    assert!(picture != other, "texture coordinates are seen");
    let first =
        "a.obj:11:11: texture coordinate index 7 in `4/7` is out of range; its texture coordinates count as 0 0";
    assert!(said.contains(first) && said.contains("(and 1 more"), "{said}");
    assert_eq!((strict, strict_of_right), (1, 0));
    // Without any face, the render is an error.
    let folder = folder(&[("a.obj", &format!("{corners}f 1 2 9\n")), ("a.mtl", "newmtl a\n")]);
    let said = refused(folder.path(), &split("render a.obj -q -o x.exr"), 1);
    let only = "a.obj:10:7: vertex index 9 in `9` is out of range; the face is left out";
    assert!(said.contains(only), "{said}");
}

/// Writes an image of 16 × 16 texels.
fn write_texels(path: &Path, texel: impl Fn(f32, f32) -> [f32; 3]) {
    let at = |i: usize| texel((i % 16) as f32 / 15.0 - 0.5, (i / 16) as f32 / 15.0 - 0.5);
    let texels: Vec<[u8; 3]> = (0..256).map(|i| at(i).map(|c| (c * 255.0).round() as u8)).collect();
    write_rgb_png(path, 16, &texels);
}

/// Exporters write normal maps as `map_Bump`. In libraries the texels decide if a map has normals
/// or heights. In scene files the key decides.
#[test]
fn normal_and_height_maps_are_detected() {
    let square = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\n\
                  f 1/1 2/2 3/3 4/4\n";
    let folder = folder(&[("a.obj", square)]);
    let at = folder.path();
    write_texels(&at.join("normals.png"), |x, y| {
        [x, y, (1.0 - x * x - y * y).sqrt()].map(|c| 0.5 * c + 0.5)
    });
    write_texels(&at.join("heights.png"), |x, y| [1.0 - 4.0 * x * x * y * y; 3]);
    write_texels(&at.join("colours.png"), |x, y| [0.5 + x, 0.5 + y, 0.2]);
    let render = |scene: &str| {
        let line = format!("render {scene} --size 12x12 --spp 4 -o x.exr");
        let output = done(at, &split(&line));
        (read_rgb(&at.join("x.exr")), words(&output))
    };
    let of = |maps: &str| {
        fs::write(at.join("a.mtl"), format!("newmtl m\nKd 0.8\n{maps}\n")).unwrap();
        render("a.obj")
    };
    let [flat, normals, heights, colours, weak] = [
        "",
        "norm normals.png",
        "map_Bump heights.png",
        "bump colours.png",
        "norm -bm 0.5 normals.png",
    ]
    .map(|maps| {
        let (picture, said) = of(maps);
        assert!(!said.contains("heights-or-normals"), "{maps}: {said}");
        picture
    });
    let all = [&flat, &normals, &heights, &colours, &weak];
    for (i, one) in all.iter().enumerate() {
        assert!(all[..i].iter().all(|other| other != one), "picture {i}");
    }
    for (maps, right, told) in [
        (
            "map_Bump normals.png",
            &normals,
            "a.mtl:3: texture `normals.png` is a normal map where heights are expected, and is used as a normal map",
        ),
        ("bump -imfchan l normals.png", &normals, "is used as a normal map"),
        ("map_Bump -bm 0.5 normals.png", &weak, "is used as a normal map"),
        (
            "norm heights.png",
            &heights,
            "a.mtl:3: texture `heights.png` is grey where a normal map is expected, and is used as heights",
        ),
        (
            "map_Bump normals.png\nnorm normals.png",
            &normals,
            "has no effect beside `norm`",
        ),
        (
            "map_Bump heights.png\nnorm heights.png",
            &heights,
            "has no effect beside `map_Bump`",
        ),
    ] {
        let (picture, said) = of(maps);
        assert!(
            said.contains(told) && said.contains("[heights-or-normals]"),
            "{maps}: {said}"
        );
        assert!(&picture == right, "{maps}");
    }
    // If the images of `map_Bump` and `norm` are swapped, each image is read as what it is, with
    // the options of its own statement.
    let (right, _) = of("map_Bump heights.png\nnorm -bm 0.5 normals.png");
    assert!(right != heights);
    for maps in [
        "map_Bump -bm 0.5 normals.png\nnorm heights.png",
        "norm heights.png\nmap_Bump -bm 0.5 normals.png",
    ] {
        let (picture, said) = of(maps);
        let all = printed(&run(at, &split("check a.obj")));
        for told in ["is used as a normal map", "and is used as heights"] {
            assert!(all.contains(told), "{maps}: {all}");
        }
        assert!(!all.contains("has no effect"), "{said} {all}");
        assert!(picture == right, "{maps}");
    }
    // A strength of 0 gives a flat surface, up to rounding.
    let (none, _) = of("map_Bump -bm 0 normals.png");
    assert!(rel_mse(&none, &flat) < 1e-6 * rel_mse(&normals, &flat));
    // A normal map that is encoded with the sRGB curve, like a picture of colours, is decoded.
    let encode = |c: f32| {
        if c <= 0.0031308 {
            12.92 * c
        } else {
            1.055 * c.powf(1.0 / 2.4) - 0.055
        }
    };
    write_texels(&at.join("encoded.png"), |x, y| {
        [x, y, (1.0 - x * x - y * y).sqrt()].map(|c| encode(0.5 * c + 0.5))
    });
    let (by_norm, said) = of("norm encoded.png");
    assert!(
        said.contains("is a normal map that is sRGB-encoded: it is decoded"),
        "{said}"
    );
    let (by_bump, said) = of("map_Bump encoded.png");
    assert!(said.contains("it is decoded, and used as a normal map"), "{said}");
    assert!(by_bump == by_norm && rel_mse(&by_norm, &normals) < 0.01 * rel_mse(&flat, &normals));

    // If a statement selects one channel of a normal map, this channel is read as a height map.
    let (picture, said) = of("bump -imfchan r normals.png");
    assert!(picture != normals && !said.contains("heights-or-normals"), "{said}");

    // A written scene file has the detected kind, and keeps it.
    of("map_Bump normals.png");
    done(at, &split("init a.obj -o a.toml"));
    let text = fs::read_to_string(at.join("a.toml")).unwrap();
    assert!(text.contains("#normal_map = \"normals.png\""), "{text}");
    let scene = |map: &str| {
        let text = format!("{SCENE}[material.m]\ndiffuse = 0.8\n{map}\n[[light]]\ntype = 'constant'\nradiance = 1\n");
        fs::write(at.join("s.toml"), text).unwrap();
        words(&done(at, &split("render s.toml --size 4x4 --spp 1 -o y.exr")))
    };
    for map in ["bump_map = 'normals.png'", "normal_map = 'heights.png'"] {
        assert!(!scene(map).contains("heights-or-normals"), "{map}");
    }

    // Many normal maps of one library cause a single note.
    let mtl = "newmtl m\nmap_Bump normals.png\nnewmtl n\nmap_Bump -bm 1 other.png\n";
    fs::copy(at.join("normals.png"), at.join("other.png")).unwrap();
    fs::write(at.join("a.mtl"), mtl).unwrap();
    fs::write(at.join("a.obj"), format!("{square}usemtl n\nf 1/1 2/2 3/3\n")).unwrap();
    let said = printed(&run(at, &split("check a.obj")));
    assert_eq!(said.matches("[heights-or-normals]").count(), 1, "{said}");
    assert!(said.contains("and another one of this file"), "{said}");
}

/// Exporters write `d 0` for opaque surfaces: a scene without any visible surface becomes opaque.
#[test]
fn fully_invisible_scene_is_made_opaque() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}o p\nusemtl m\nf 1 2 3\nusemtl n\nf 1 3 2\n");
    let mtl = "newmtl m\nKd 0.8 0.1 0.1\nd 0\nnewmtl n\nKd 0.1 0.8 0.1\nTr 1\nd 0\nnewmtl spare\nd 1\n";
    let folder = folder(&[("a.obj", &obj), ("a.mtl", mtl)]);
    let at = folder.path();
    let picture = |flags: &str| {
        let said = words(&done(
            at,
            &split(&format!("render a.obj --size 16x16 --spp 1 -o x.exr {flags}")),
        ));
        (read_rgb(&at.join("x.exr")), said)
    };
    let (opaque, said) = picture("");
    let told = "a.mtl:3: all materials of the scene (`m` and another one) have the opacity 0";
    assert!(said.contains(told) && said.contains("[invisible-scene]"), "{said}");
    assert!(!said.contains("the picture shows nothing"), "{said}");
    // If a flag sets the opacity, or requests the literal reading of the file, the scene stays
    // invisible.
    for flags in ["--strict", "--mtl-dialect spec", "--material '*.opacity=0'"] {
        let flags = flags.replace('\'', "");
        let (invisible, said) = picture(&flags);
        assert!(
            invisible != opaque && !said.contains("[invisible-scene]"),
            "{flags}: {said}"
        );
        let end = "warning: the picture shows nothing: all surfaces in the picture are invisible";
        assert!(said.contains(end), "{flags}: {said}");
    }
    fs::write(at.join("a.mtl"), mtl.replace("\nd 0", "\nd 1")).unwrap();
    assert!(picture("").0 == opaque);
    // If one material is visible, invisible materials stay.
    fs::write(at.join("a.mtl"), mtl.replacen("\nd 0", "\nd 1", 1)).unwrap();
    let (_, said) = picture("");
    assert!(
        said.contains("[invisible-material]") && !said.contains("[invisible-scene]"),
        "{said}"
    );
    // A camera that faces away sees only the ground, or nothing, which is reported once.
    let away = "--position 0,0,3 --look-at 0,0,9";
    let said = picture(away).1;
    assert!(
        said.contains("the picture shows nothing: the camera sees none of the scene's surfaces"),
        "{said}"
    );
    let said = picture(&format!("{away} --no-ground")).1;
    assert!(
        said.contains("[empty-view]") && !said.contains("the picture shows nothing"),
        "{said}"
    );
}

/// Invisible materials of a library cause one warning, with the flag that reads them otherwise.
#[test]
fn invisible_materials_are_one_warning() {
    let materials: String = (0..5)
        .map(|i| format!("newmtl m{i}\nTr {}\n", u8::from(i < 2)))
        .collect();
    let faces: String = (0..5).map(|i| format!("usemtl m{i}\nf 1 2 3\n")).collect();
    let folder = folder(&[
        ("a.obj", &format!("mtllib a.mtl\n{TRIANGLE}{faces}")),
        ("a.mtl", &materials),
    ]);
    let said = printed(&run(folder.path(), &split("check a.obj")));
    let told = "a.mtl:2: warning: 2 materials are invisible, since their opacity is 0: `m0`, `m1` [invisible-material]";
    assert!(said.contains(told), "{said}");
    assert_eq!(said.matches("[invisible-material]").count(), 1, "{said}");
    let help = "set their `opacity` with --material; --mtl-dialect meshlab reads `Tr` as opacity";
    assert!(said.contains(help), "{said}");
    // The opacity also makes a picture of the opacity invisible.
    write_rgb_png(&folder.path().join("x.png"), 1, &[[255; 3]]);
    let materials = materials.replacen("Tr 1\n", "d 0\nmap_d x.png\n", 1);
    std::fs::write(folder.path().join("a.mtl"), materials).unwrap();
    let said = printed(&run(folder.path(), &split("check a.obj --mtl-dialect spec")));
    let told = "material `m0` is invisible, since its opacity is 0, which multiplies the texture of its opacity";
    assert!(said.contains(told) && said.contains("`map_d` alone"), "{said}");
    let said = printed(&run(folder.path(), &split("check a.obj")));
    assert!(
        !said.contains("`m0` is invisible") && said.contains("[opacity-of-map]"),
        "{said}"
    );
}

/// Messages of one kind are grouped, and so are the messages about unused materials.
#[test]
fn material_messages_are_grouped() {
    let materials: String = (0..9)
        .map(|i| format!("newmtl m{i}\nKs 0.5 0.5 0.5\nNs -1.960784\nNi 0\n"))
        .collect();
    let faces: String = (0..4).map(|i| format!("usemtl m{i}\nf 1 2 3\n")).collect();
    let glass = "newmtl glass\nillum 7\nNi 0\n";
    let folder = folder(&[
        ("a.obj", &format!("mtllib a.mtl\n{TRIANGLE}{faces}")),
        ("a.mtl", &format!("{materials}{glass}")),
    ]);
    let at = folder.path();
    let said = printed(&run(at, &split("check a.obj")));
    assert!(
        said.contains("a.mtl:3:4: warning: material `m0` and 3 others: Ns is `-1.960784`; 0 is used [wrong-statement]"),
        "{said}"
    );
    assert!(said.contains("also: lines 7, 11, 15\n"), "{said}");
    assert!(
        said.contains("Ni of 4 materials has no effect, the first in this line: nothing refracts"),
        "{said}"
    );
    assert!(!said.contains("[no-effect]") && !said.contains("[illum]"), "{said}");
    // If faces use the glass, its index of refraction causes a warning. Errors list all materials.
    fs::write(
        at.join("a.obj"),
        format!("mtllib a.mtl\n{TRIANGLE}{faces}usemtl glass\nf 1 2 3\n"),
    )
    .unwrap();
    let said = printed(&run(at, &split("check a.obj")));
    assert!(said.contains("material `glass`: Ni 0 has no effect"), "{said}");
    let said = refused(at, &split("render a.obj --strict -o x.exr"), 1);
    assert!(said.contains("material `m0` and 8 others: Ns is"), "{said}");
}

/// All materials without a definition cause a single message, with one cause.
#[test]
fn missing_library_is_one_note() {
    let faces = "usemtl default\nf 1 2 3\nusemtl b\nf 1 2 3\n";
    let folder = folder(&[("a.obj", &format!("{TRIANGLE}{faces}"))]);
    let at = folder.path();
    let said = || words(&done(at, &split("render a.obj --size 4x4 --spp 1 -o x.exr")));
    let none = said();
    let told = "note: a.obj:4: the file names no material library; materials `default`, `b` are rendered in a plain grey \
                (diffuse 0.8) [no-library]";
    assert!(none.contains(told) && !none.contains("missing-material"), "{none}");
    fs::write(at.join("a.obj"), format!("mtllib gone.mtl\n{TRIANGLE}{faces}")).unwrap();
    let missing = said();
    assert!(missing.contains("[missing-library]"), "{missing}");
    assert!(
        !missing.contains("not defined") && !missing.contains("no-library"),
        "{missing}"
    );
    fs::write(at.join("gone.mtl"), "newmtl b\n").unwrap();
    let one = said();
    let told = "warning: a.obj:5: material `default` is not defined; it is rendered in a plain grey (diffuse 0.8)";
    assert!(one.contains(told), "{one}");
    // Long names are not cut.
    let long = format!("World_{}_01", "a".repeat(100));
    fs::write(
        at.join("a.obj"),
        format!("mtllib gone.mtl\n{TRIANGLE}usemtl {long}\nf 1 2 3\n"),
    )
    .unwrap();
    let said = said();
    assert!(said.contains(&format!("[material.\"{long}\"]")), "{said}");
}

/// If a material has no definition, the message proposes a defined material with a similar name. A
/// patch that defines the material ends the message.
#[test]
fn missing_material_has_a_proposal() {
    let folder = folder(&[
        ("a.mtl", "newmtl windmill\nKd 0.5 0.5 0.5\n"),
        ("a.obj", &format!("mtllib a.mtl\n{TRIANGLE}usemtl Windmil\nf 1 2 3\n")),
    ]);
    let said = |more: &str| {
        let line = format!("render a.obj --size 4x4 --spp 1 -o x.exr {more}");
        words(&done(folder.path(), &split(&line)))
    };
    let unknown = said("");
    assert!(
        unknown.contains("material `Windmil` is not defined")
            && unknown.contains("help: does `usemtl Windmil` mean `windmill`?"),
        "{unknown}"
    );
    let patched = said("--material Windmil.diffuse=0.1,0.2,0.3");
    assert!(!patched.contains("not defined"), "{patched}");
}

/// A render reports the reason for an empty image.
#[test]
fn scenes_without_a_visible_face_have_a_reason() {
    let face = |vertices: &str, face: &str| format!("mtllib a.mtl\n{vertices}usemtl m\n{face}\n");
    let plain = "newmtl m\nKd 0.5\n";
    let folder = folder(&[]);
    let at = folder.path();
    write_rgb_png(&at.join("black.png"), 2, &[[0; 3]; 4]);
    let cases = [
        (
            "newmtl m\nKd 0.8\nd 0\n",
            "f 1 2 3",
            "a.mtl:3: no face can be seen: material `m` is invisible, since its opacity is 0",
        ),
        (
            "newmtl m\nd 1\nd 0\nmap_Kd black.png\n",
            "f 1 2 3",
            "a.mtl:3: no face can be seen",
        ),
        (
            "newmtl m\nmap_d black.png\n",
            "f 1 2 3",
            "a.mtl:1: no face can be seen: material `m` is invisible, since the texture",
        ),
        (
            "newmtl m\nd 0\nnewmtl n\nd 0\n",
            "f 1 2 3\nusemtl n\nf 1 2 3",
            "since its opacity is 0, and so is another material",
        ),
        ("newmtl m\nd 0\nKe 1\n", "f 1 2 3", "since its opacity is 0"),
        (
            "newmtl m\nTf 1 1 1\n",
            "f 1 2 3",
            "since all light passes straight through it",
        ),
        (
            plain,
            "f 1 2 1",
            "a.obj: no face can be seen: the only triangle has no area",
        ),
        (plain, "f 1 2 1\nf 1 1 3", "none of the 2 triangles has an area"),
    ];
    for (mtl, faces, told) in cases {
        fs::write(at.join("a.obj"), face(TRIANGLE, faces)).unwrap();
        fs::write(at.join("a.mtl"), mtl).unwrap();
        let flags = "render a.obj --mtl-dialect spec --size 4x4 --spp 1 -o x.exr";
        let said = words(&done(at, &split(flags)));
        assert!(
            said.contains(told) && said.contains("[no-visible-face]"),
            "{mtl} {faces}: {said}"
        );
    }
    // No reason is reported if a face or a light is visible.
    for (mtl, faces) in [
        ("newmtl m\nd 0\nnewmtl n\nd 0.1\n", "f 1 2 3\nusemtl n\nf 1 2 3"),
        ("newmtl m\nd 0.1\nKd 0\nKe 1\n", "f 1 2 3"),
        ("newmtl m\nTf 1 1 0.9\n", "f 1 2 3"),
        ("newmtl m\nTf 1 1 1\nNi 1.5\n", "f 1 2 3"),
    ] {
        fs::write(at.join("a.obj"), face(TRIANGLE, faces)).unwrap();
        fs::write(at.join("a.mtl"), mtl).unwrap();
        let said = words(&done(at, &split("render a.obj --size 4x4 --spp 1 -o x.exr")));
        assert!(!said.contains("[no-visible-face]"), "{mtl} {faces}: {said}");
    }
    for (obj, told) in [
        (TRIANGLE.to_string(), "the file is a point cloud of 3 vertices"),
        (
            format!("{TRIANGLE}l 1 2 3\np 1\n"),
            "its 1 line (`l`) and 1 point (`p`) are skipped",
        ),
    ] {
        fs::write(at.join("a.obj"), obj).unwrap();
        let said = refused(at, &split("render a.obj -o x.exr"), 1);
        assert!(
            said.contains("a.obj: no faces in this OBJ file: ") && said.contains(told),
            "{said}"
        );
    }
}

#[test]
fn names_in_other_encodings_match() {
    let folder = folder(&[]);
    let at = folder.path();
    let latin = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    let utf8 = |text: &str| text.as_bytes().to_vec();
    let names = ["Käbel", "Kübel", "Kabel", "Straße"];
    let mut obj = format!("mtllib größe.mtl\n{TRIANGLE}vt 0 0\n");
    let mut mtl = String::new();
    for name in names {
        obj += &format!("usemtl {name}\nf 1/1 2/1 3/1\n");
        mtl += &format!("newmtl {name}\nKd 0.5 0.5 0.5\nmap_Kd Holztür.png\n");
    }
    fs::create_dir(at.join("textures")).unwrap();
    write_rgb_png(&at.join("textures/Holztür.png"), 1, &[[9; 3]]);
    for (of_obj, of_mtl) in [
        (latin(&obj), latin(&mtl)),
        (latin(&obj), utf8(&mtl)),
        (utf8(&obj), latin(&mtl)),
        (utf8(&obj), utf8(&mtl)),
    ] {
        fs::write(at.join("a.obj"), of_obj).unwrap();
        fs::write(at.join("größe.mtl"), of_mtl).unwrap();
        let checked = printed(&run(at, &split("check a.obj")));
        assert!(
            checked.contains("4 materials") && checked.contains(" 0 errors"),
            "{checked}"
        );
        for code in ["missing-", "duplicate-material", "unused-definition"] {
            assert!(!checked.contains(code), "{checked}");
        }
    }
    let facts = json(&run(at, &["explain", "a.obj", "Käbel", "--json"]));
    assert_eq!(
        facts["textures"]["diffuse"]["file"], "textures/Holztür.png",
        "{facts:#}"
    );

    // A file name in Latin-1, as in old archives
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::ffi::OsStringExt;
        let name = std::ffi::OsString::from_vec(latin("Holztür.png"));
        fs::rename(at.join("textures/Holztür.png"), at.join("textures").join(name)).unwrap();
        let checked = printed(&run(at, &split("check a.obj")));
        assert!(!checked.contains("missing-texture"), "{checked}");
    }
}

/// Exporters write `Kd 0` for a colour that a texture gives: a scene that reflects nothing is grey.
#[test]
fn scene_without_any_reflection_is_grey() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}o p\nusemtl m\nf 1 2 3\nusemtl n\nf 1 3 2\n");
    let mtl = "newmtl m\nKd 0 0 0\nnewmtl n\nKd 0 0 0\n";
    let folder = folder(&[("a.obj", &obj), ("a.mtl", mtl)]);
    let at = folder.path();
    let picture = |flags: &str| {
        let args = format!("render a.obj --size 16x16 --spp 1 -o x.exr {flags}");
        let said = words(&done(at, &split(&args)));
        (read_rgb(&at.join("x.exr")), said)
    };
    let (grey, said) = picture("");
    let told = "a.mtl:1: no material of the scene (`m` and another one) reflects light or has a texture";
    assert!(said.contains(told) && said.contains("[black-scene]"), "{said}");
    for flags in [
        "--strict",
        "--mtl-dialect spec",
        "--material m.roughness=0.5",
        "--part p.diffuse=0",
    ] {
        let (black, said) = picture(flags);
        assert!(black != grey && !said.contains("[black-scene]"), "{flags}: {said}");
    }
    fs::write(at.join("a.mtl"), mtl.replace("Kd 0 0 0", "Kd 0.8 0.8 0.8")).unwrap();
    assert!(picture("").0 == grey);
    // If one material reflects light, black materials stay.
    fs::write(at.join("a.mtl"), mtl.replacen("Kd 0 0 0", "Kd 0.8 0.8 0.8", 1)).unwrap();
    assert!(!picture("").1.contains("[black-scene]"));
}
