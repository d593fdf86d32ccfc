//! Textures that no library names, found by the names of their files.

use crate::support::program::*;
use std::fs;
use tempfile::TempDir;

const OBJ: &str = "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl wood\nf 1/1 2/2 3/3 4/4\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [0.5, 0.3, 2]\nlook_at = [0, 0, 0]\n\
    [image]\nwidth = 24\nheight = 24\n[render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\n\
    [[light]]\ntype = \"directional\"\ndirection = [-0.2, -0.3, -1]\nirradiance = 3\n";

/// A folder with a textured square, its library `mtl` and these pictures.
fn scene(mtl: &str, pictures: &[&str]) -> TempDir {
    let folder = folder(&[("a.obj", OBJ), ("a.mtl", mtl), ("s.toml", SCENE)]);
    fs::create_dir(folder.path().join("textures")).unwrap();
    for (i, name) in pictures.iter().enumerate() {
        let codes: Vec<u8> = (0..9u8).map(|j| (j * 29).wrapping_add(50 * i as u8) | 1).collect();
        write_grey_png(&folder.path().join(name), &codes);
    }
    folder
}

/// The picture of the folder, and the messages.
fn picture(folder: &TempDir, flags: &str) -> (Vec<u8>, String) {
    let output = done(
        folder.path(),
        &joined(&["render", "s.toml", "-o", "t.png"], &split(flags)),
    );
    (fs::read(folder.path().join("t.png")).unwrap(), words(&output))
}

const PLAIN: &str = "newmtl wood\nKd 0.3 0.3 0.3\n";

#[test]
fn textures_of_the_material_s_name_are_used() {
    let names = [
        "textures/Wood_BaseColor.png",
        "textures/Wood_Roughness.png",
        "textures/Wood_AO.png",
    ];
    let named = scene(PLAIN, &names);
    let (got, words) = picture(&named, "");
    assert!(
        words.contains("[maps-by-name]") && words.contains("Wood_AO.png has no effect"),
        "{words}"
    );
    let explicit = scene(
        "newmtl wood\nmap_Kd textures/Wood_BaseColor.png\nmap_Pr textures/Wood_Roughness.png\n",
        &names,
    );
    assert!(got == picture(&explicit, "").0);
    let plain = picture(&scene(PLAIN, &[]), "").0;
    assert!(got != plain);
    assert!(picture(&named, "--maps-by-name off").0 == plain);
}

#[test]
fn sets_of_the_file_or_alone_are_used_and_several_are_not() {
    let plain = picture(&scene(PLAIN, &[]), "").0;
    let of_file = picture(&scene(PLAIN, &["a_albedo.png"]), "").0;
    assert!(of_file != plain);
    let alone = picture(&scene(PLAIN, &["textures/model_diffuse_2k.png"]), "").0;
    assert!(alone == of_file);
    // The set of the file's name wins.
    assert!(picture(&scene(PLAIN, &["a_albedo.png", "textures/model_diffuse.png"]), "").0 == of_file);
    // None of two others fits, and a set without a colour is none.
    for pictures in [
        &["b_albedo.png", "c_albedo.png"][..],
        &["a_roughness.png"],
        &["photo.png"],
    ] {
        assert!(picture(&scene(PLAIN, pictures), "").0 == plain, "{pictures:?}");
    }
    // The set may be that of another OBJ file.
    let other = scene(PLAIN, &["model_albedo.png"]);
    fs::write(other.path().join("b.obj"), OBJ).unwrap();
    assert!(picture(&other, "").0 == plain);
    // A library that names a texture is taken as it is.
    let named = scene("newmtl wood\nmap_Kd x.png\n", &["x.png", "a_albedo.png"]);
    let named_alone = scene("newmtl wood\nmap_Kd x.png\n", &["x.png"]);
    assert!(picture(&named, "").0 == picture(&named_alone, "").0);
}

/// Without a library, the picture of the file's own name is the colour.
#[test]
fn a_picture_of_the_file_s_name_is_used_without_a_library() {
    let pictures = |names: &[&str], mtl: Option<&str>| {
        let folder = scene(mtl.unwrap_or(""), names);
        if mtl.is_none() {
            fs::remove_file(folder.path().join("a.mtl")).unwrap();
        }
        folder
    };
    let grey = picture(&pictures(&[], None), "").0;
    for name in ["a.png", "textures/A.png"] {
        let folder = pictures(&[name], None);
        let (got, words) = picture(&folder, "");
        assert!(
            got != grey && words.contains("by their names it has "),
            "{name}: {words}"
        );
        assert!(words.contains("--maps-by-name off"), "{words}");
        assert!(picture(&folder, "--maps-by-name off").0 == grey, "{name}");
    }
    let plain = picture(&pictures(&[], Some(PLAIN)), "").0;
    for (names, mtl, expected) in [
        (&["a.png", "textures/a.png"][..], None, &grey),
        (&["b.png"], None, &grey),
        (&["a.png"], Some(PLAIN), &plain),
    ] {
        assert!(picture(&pictures(names, mtl), "").0 == *expected, "{names:?}");
    }
    // A picture that this program wrote is no texture, and may be written again.
    let folder = pictures(&[], None);
    let line = split("render a.obj -q --size 8x8 --spp 1 -o a.png");
    let render = || words(&done(folder.path(), &line));
    assert_eq!(render(), render());
    assert!(picture(&folder, "").0 == grey);
    // Sizes of a file's name do not count, as in those of pictures.
    let folder = pictures(&["textures/a_001_dif_2k.png", "textures/c_albedo.png"], None);
    for name in ["a_001_30k", "a_001_100k"] {
        fs::rename(folder.path().join("a.obj"), folder.path().join(format!("{name}.obj"))).unwrap();
        fs::write(folder.path().join("a.obj"), OBJ).unwrap();
        let toml = SCENE.replace("a.obj", &format!("{name}.obj"));
        fs::write(folder.path().join("s.toml"), toml).unwrap();
        assert!(picture(&folder, "").0 != grey, "{name}");
    }
}

#[test]
fn normals_of_directx_are_flipped() {
    let normals = |folder: &TempDir, name: &str, green: u8| {
        let file = fs::File::create(folder.path().join(name)).unwrap();
        let mut encoder = png::Encoder::new(file, 1, 1);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[128, green, 230]).unwrap();
    };
    let up = scene(PLAIN, &["wood_color.png"]);
    normals(&up, "wood_normalgl.png", 188);
    let down = scene(PLAIN, &["wood_color.png"]);
    normals(&down, "wood_normaldx.png", 67);
    let wrong = scene(PLAIN, &["wood_color.png"]);
    normals(&wrong, "wood_normalgl.png", 67);
    assert!(picture(&up, "").0 == picture(&down, "").0);
    assert!(picture(&up, "").0 != picture(&wrong, "").0);
    // A scene file that `init` writes keeps the flip.
    done(down.path(), &split("init a.obj -o i.toml"));
    let written = fs::read_to_string(down.path().join("i.toml")).unwrap();
    assert!(written.contains("flip_green = true"), "{written}");
}
