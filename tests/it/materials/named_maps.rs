//! Textures without a library entry, found by their file names.

use crate::support::program::*;
use crate::support::write_png;
use std::fs;
use tempfile::TempDir;

const OBJ: &str = "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl wood\nf 1/1 2/2 3/3 4/4\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [0.5, 0.3, 2]\nlook_at = [0, 0, 0]\n\
    [image]\nwidth = 24\nheight = 24\n[render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\n\
    [[light]]\ntype = \"directional\"\ndirection = [-0.2, -0.3, -1]\nirradiance = 3\n";

/// Writes a square image of 4 × 4 texels.
fn write_square(folder: &TempDir, name: &str) {
    let path = folder.path().join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), 4, 4);
    encoder.set_color(png::ColorType::Grayscale);
    let codes: Vec<u8> = (0..16u8).map(|j| j * 13 + 7).collect();
    encoder.write_header().unwrap().write_image_data(&codes).unwrap();
}

/// A folder with `files`, without libraries, and square images of 4 × 4 texels.
fn without_library(files: &[(&str, &str)], squares: &[&str]) -> TempDir {
    let mut all = vec![("s.toml", SCENE)];
    all.extend(files);
    let folder = folder(&all);
    squares.iter().for_each(|name| write_square(&folder, name));
    folder
}

/// A folder with a textured square, its library `mtl` and these images.
fn scene(mtl: &str, pictures: &[&str]) -> TempDir {
    let folder = folder(&[("a.obj", OBJ), ("a.mtl", mtl), ("s.toml", SCENE)]);
    fs::create_dir(folder.path().join("textures")).unwrap();
    for (i, name) in pictures.iter().enumerate() {
        let codes: Vec<u8> = (0..9u8).map(|j| (j * 29).wrapping_add(50 * i as u8) | 1).collect();
        write_grey_png(&folder.path().join(name), &codes);
    }
    folder
}

/// The rendered image of the folder, and the messages.
fn picture(folder: &TempDir, flags: &str) -> (Vec<u8>, String) {
    let output = done(
        folder.path(),
        &joined(&["render", "s.toml", "-o", "t.png"], &split(flags)),
    );
    (fs::read(folder.path().join("t.png")).unwrap(), words(&output))
}

const PLAIN: &str = "newmtl wood\nKd 0.3 0.3 0.3\n";

#[test]
fn textures_named_after_the_material_are_used() {
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
fn texture_set_is_used_if_it_is_unambiguous() {
    let plain = picture(&scene(PLAIN, &[]), "").0;
    let of_file = picture(&scene(PLAIN, &["a_albedo.png"]), "").0;
    assert!(of_file != plain);
    let alone = picture(&scene(PLAIN, &["textures/model_diffuse_2k.png"]), "").0;
    assert!(alone == of_file);
    // A texture set is a group of images such as `a_albedo.png` and `a_roughness.png`. The set with
    // the name of the OBJ file takes precedence.
    assert!(picture(&scene(PLAIN, &["a_albedo.png", "textures/model_diffuse.png"]), "").0 == of_file);
    // Two texture sets with other names are ambiguous. A texture set without a colour is not used.
    for pictures in [
        &["b_albedo.png", "c_albedo.png"][..],
        &["a_roughness.png"],
        &["photo.png"],
    ] {
        assert!(picture(&scene(PLAIN, pictures), "").0 == plain, "{pictures:?}");
    }
    // The texture set may belong to another OBJ file of the folder, so it is not used.
    let other = scene(PLAIN, &["model_albedo.png"]);
    fs::write(other.path().join("b.obj"), OBJ).unwrap();
    assert!(picture(&other, "").0 == plain);
    // If a library has a texture, no other textures are used.
    let named = scene("newmtl wood\nmap_Kd x.png\n", &["x.png", "a_albedo.png"]);
    let named_alone = scene("newmtl wood\nmap_Kd x.png\n", &["x.png"]);
    assert!(picture(&named, "").0 == picture(&named_alone, "").0);
}

/// Without a library, the image with the name of the file is the colour.
#[test]
fn image_named_after_the_obj_is_its_color() {
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
            got != grey && words.contains("by the file names it has "),
            "{name}: {words}"
        );
        assert!(words.contains("--maps-by-name off"), "{words}");
        assert!(picture(&folder, "--maps-by-name off").0 == grey, "{name}");
    }
    let plain = picture(&pictures(&[], Some(PLAIN)), "").0;
    for (names, mtl, expected) in [
        (&["a.png", "textures/a.png"][..], None, &grey),
        (&["b.png", "c.png"], None, &grey),
        (&["a.png"], Some(PLAIN), &plain),
    ] {
        assert!(picture(&pictures(names, mtl), "").0 == *expected, "{names:?}");
    }
    // An image written by this program is not a texture, and may be overwritten.
    let folder = pictures(&[], None);
    let line = split("render a.obj -q --size 8x8 --spp 1 -o a.png");
    let render = || words(&done(folder.path(), &line));
    assert_eq!(render(), render());
    assert!(picture(&folder, "").0 == grey);
    // Sizes in names are ignored: 2k in the name of a texture, 30k and 100k in the name of the OBJ
    // file.
    let folder = pictures(&["textures/a_001_dif_2k.png", "textures/c_albedo.png"], None);
    for name in ["a_001_30k", "a_001_100k"] {
        fs::rename(folder.path().join("a.obj"), folder.path().join(format!("{name}.obj"))).unwrap();
        fs::write(folder.path().join("a.obj"), OBJ).unwrap();
        let toml = SCENE.replace("a.obj", &format!("{name}.obj"));
        fs::write(folder.path().join("s.toml"), toml).unwrap();
        assert!(picture(&folder, "").0 != grey, "{name}");
    }
}

/// A copy of a texture in another format, and a library without the materials in use, change
/// nothing. A picture that this program wrote is no copy.
#[test]
fn copies_and_other_libraries_do_not_hide_a_texture() {
    let grey = picture(&scene("", &[]), "").0;
    let expected = picture(&scene("", &["a.png"]), "").0;
    assert!(expected != grey);
    let copied = scene("", &["a.png"]);
    fs::write(copied.path().join("a.dds"), "no picture").unwrap();
    fs::write(copied.path().join("a.bmp"), "no picture").unwrap();
    assert!(picture(&copied, "").0 == expected);
    let other = scene("newmtl stone\nKd 0.2 0.2 0.2\n", &["a.png"]);
    assert!(picture(&other, "").0 == expected);
    // The rendering `a.png` lies beside the texture `a.tga`.
    let rendered = scene("", &["b.png"]);
    let texture = image::open(rendered.path().join("b.png")).unwrap();
    texture.save(rendered.path().join("a.tga")).unwrap();
    fs::remove_file(rendered.path().join("b.png")).unwrap();
    assert!(picture(&rendered, "").0 == expected);
    done(rendered.path(), &split("render s.toml -q -o a.png"));
    assert!(picture(&rendered, "").0 == expected);
}

/// A JPEG that is both colour and opacity texture has no alpha, so the surface stays opaque.
#[test]
fn colors_without_alpha_are_no_opacity() {
    let expected = scene("newmtl wood\nmap_Kd x.jpg\n", &["x.png"]);
    let found = scene("newmtl wood\nmap_Kd x.jpg\nmap_d x.jpg\n", &["x.png"]);
    for folder in [&expected, &found] {
        let texture = image::open(folder.path().join("x.png")).unwrap();
        texture.save(folder.path().join("x.jpg")).unwrap();
        fs::remove_file(folder.path().join("x.png")).unwrap();
    }
    assert!(picture(&found, "").0 == picture(&expected, "").0);
    let words = messages(&found, "check s.toml");
    assert!(words.contains("[color-as-opacity]"), "{words}");
    assert!(picture(&found, "--mtl-dialect spec").0 != picture(&expected, "--mtl-dialect spec").0);
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
    // The scene file of `init` keeps the flipped texture.
    done(down.path(), &split("init a.obj -o i.toml"));
    let written = fs::read_to_string(down.path().join("i.toml")).unwrap();
    assert!(written.contains("flip_green = true"), "{written}");
}

/// Substance Painter names textures after the material set and the material of the file. Exporters
/// put them in a folder with the name of the model.
#[test]
fn textures_in_a_folder_of_the_obj_name_are_found() {
    let obj = OBJ.replace("a.mtl", "SM_Alarm.mtl");
    let named = without_library(&[], &["Textures/A/SM_Alarm_wood_BaseColor.png"]);
    fs::create_dir(named.path().join("models")).unwrap();
    fs::write(named.path().join("models/a.obj"), obj).unwrap();
    let scene = SCENE.replace("a.obj", "models/a.obj");
    fs::write(named.path().join("s.toml"), scene).unwrap();
    let (_, words) = picture(&named, "");
    assert!(words.contains("SM_Alarm_wood_BaseColor.png"), "{words}");
}

/// Without a library, an image is the colour if its name starts like the name of the file, or if it
/// is the only image of the folder.
#[test]
fn single_fitting_image_is_used_without_library() {
    let plain = OBJ.replace("mtllib a.mtl\n", "").replace("usemtl wood\n", "");
    let used = |files: &[&str], squares: &[&str]| {
        let mut all: Vec<(&str, &str)> = files.iter().map(|name| (*name, plain.as_str())).collect();
        all.push(("car_red.obj", &plain));
        let folder = without_library(&all, squares);
        fs::write(folder.path().join("s.toml"), SCENE.replace("a.obj", "car_red.obj")).unwrap();
        let (_, words) = picture(&folder, "");
        let (_, after) = words.split_once("by the file names it probably has ")?;
        after.split_whitespace().next().map(str::to_string)
    };
    let one = |name: &str| Some(name.to_string());
    // The image name starts with the file name. Of several numbered images, the first is used.
    assert_eq!(
        used(&[], &["CarRed_skin2.png", "CarRed_skin1.png", "x.png"]),
        one("CarRed_skin1.png")
    );
    assert_eq!(used(&[], &["carred_on.png", "carred_off.png"]), None);
    assert_eq!(used(&["car_red_big.obj"], &["car_red_big_tex.png", "x.png"]), None);
    assert_eq!(used(&[], &["car_red_preview.png", "x.png"]), None);
    assert_eq!(used(&[], &["car_red_normal.png", "x.png"]), None);
    // The image name has the first word of the file name, and a word for textures.
    assert_eq!(used(&["bus.obj"], &["car_tex.png", "bus_tex.png"]), one("car_tex.png"));
    assert_eq!(used(&["car.obj"], &["car_tex.png", "bus_tex.png"]), None);
    // The only image of the folder is used.
    assert_eq!(used(&[], &["x.png"]), one("x.png"));
    assert_eq!(used(&[], &["x.png", "y.png"]), None);
    assert_eq!(used(&["bus.obj"], &["x.png"]), None);
    assert_eq!(used(&["bus.obj"], &["Street_Atlas.png"]), one("Street_Atlas.png"));
}

/// The texture that the messages for `obj` name, in a folder with the OBJ files `objs`, other
/// `files`, and square images. A `?` marks a probable texture.
fn found_textures(obj: &str, objs: &[(&str, &str)], files: &[(&str, &str)], squares: &[&str]) -> Option<String> {
    let folder = without_library(&[], squares);
    for (name, text) in objs.iter().chain(files) {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    fs::write(folder.path().join("s.toml"), SCENE.replace("a.obj", obj)).unwrap();
    let (_, words) = picture(&folder, "");
    let after = |begin: &str| Some(words.split_once(begin)?.1.split_whitespace().next()?.to_string());
    let likely = || after("by the file names it probably has ").map(|name| format!("{name}?"));
    after("by the file names it has ").or_else(likely)
}

/// A picture with the name of another thing is not a texture of this file, even if its name has a
/// role word such as `diff`.
#[test]
fn names_of_the_file_outweigh_role_words() {
    let plain = OBJ.replace("a.mtl", "gone.mtl");
    let obj = "objects/coaster_car.obj";
    let found = |squares: &[&str]| found_textures(obj, &[(obj, &plain)], &[], squares);
    let is = |name: &str| Some(name.to_string());
    let floor = "textures/brick_floor_diff_4k.jpg";
    // Pictures with the name of the OBJ file
    assert_eq!(
        found(&[floor, "textures/coaster_car.png"]),
        is("../textures/coaster_car.png")
    );
    // Pictures whose names begin like the name of the file or of the material
    for name in [
        "Coaster_Car_smooth_DefaultMaterial_BaseMap.png",
        "CoasterCar_low_albedo.png",
        "wood_old_albedo.png",
    ] {
        let file = format!("objects/{name}");
        let expected = Some(format!("{name}?"));
        assert_eq!(found(&["objects/grassB_albedo.png", &file]), expected, "{name}");
    }
    // Pictures with a foreign name, a generic name, and the name of the folder
    assert_eq!(found(&[floor]), None);
    assert_eq!(found(&["objects/shaker_diff.png"]), None);
    assert_eq!(
        found(&["textures/Material_0_albedo.png"]),
        is("../textures/Material_0_albedo.png?")
    );
    assert_eq!(found(&["objects/maps/diffuse.png"]), is("maps/diffuse.png?"));
    let ship = ("cart/ship/hull.obj", plain.as_str());
    assert_eq!(
        found_textures(ship.0, &[ship], &[], &["cart/textures/ship_diffuse.png"]),
        is("../textures/ship_diffuse.png?")
    );
    // A picture that the library of another model uses
    let library = ("objects/ship.mtl", "newmtl x\nmap_Kd maps\\diffuse.png\n");
    assert_eq!(
        found_textures(obj, &[(obj, &plain)], &[library], &["objects/maps/diffuse.png"]),
        None
    );
    // An icon, and a picture that begins like the file name of an OBJ file with two materials
    assert_eq!(found(&["textures/coaster_car_inv.png"]), None);
    let two = format!("{plain}usemtl b\nf 1/1 3/3 4/4\n");
    let found = |squares: &[&str]| found_textures(obj, &[(obj, &two)], &[], squares);
    assert_eq!(found(&["textures/coaster_car_old.png", "textures/x.png"]), None);
    assert_eq!(
        found(&["textures/coaster_car_skin.png", "textures/x.png"]),
        is("../textures/coaster_car_skin.png?")
    );
}

/// If a folder has one picture and several OBJ files, the picture is the texture of the OBJ files
/// with a similar name. This name may also be the name of a group in the file.
#[test]
fn only_picture_belongs_to_models_with_a_name_like_it() {
    let plain = OBJ.replace("mtllib a.mtl\n", "").replace("usemtl wood\n", "");
    let fox = plain.replace("f 1/1", "g fox1\nf 1/1");
    let objs = [
        ("rock3.obj", plain.as_str()),
        ("Untitled.obj", &fox),
        ("test.obj", &plain),
    ];
    let found = |obj: &str, library: &str, squares: &[&str]| {
        let library = ("low_fox.mtl", library);
        found_textures(obj, &objs, &[library], squares)
    };
    let fox = "newmtl fox\nmap_Kd texture.png\n";
    let is = |name: &str| Some(name.to_string());
    assert_eq!(found("Untitled.obj", fox, &["texture.png"]), is("texture.png?"));
    assert_eq!(found("test.obj", fox, &["texture.png"]), None);
    assert_eq!(found("Untitled.obj", fox, &["texture.png", "x.png"]), None);
    assert_eq!(found("rock3.obj", "", &["lunarrock_s.png"]), is("lunarrock_s.png?"));
    assert_eq!(found("test.obj", "", &["lunarrock_s.png"]), None);
    // A picture of leaves would hide the trunk of a tree.
    let tree = [("tree.obj", plain.as_str())];
    let found = |squares: &[&str]| found_textures("tree.obj", &tree, &[], squares);
    assert_eq!(found(&["leaves.png"]), None);
    assert_eq!(found(&["green.png"]), is("green.png?"));
    let wheel = [("car_wheel.obj", plain.as_str())];
    let found = found_textures("car_wheel.obj", &wheel, &[], &["wheel.png"]);
    assert_eq!(found, is("wheel.png?"));
}

/// Pictures with the name of the OBJ file are also found in picture folders beside the folder of
/// the file.
#[test]
fn picture_named_after_the_obj_is_found_in_other_folders() {
    let plain = OBJ.replace("a.mtl", "gone.mtl");
    let obj = "in/stretcher.obj";
    let found = |squares: &[&str]| found_textures(obj, &[(obj, &plain)], &[], squares);
    let is = |name: &str| Some(name.to_string());
    assert_eq!(found(&["Image/Stretcher.png"]), is("../Image/Stretcher.png"));
    assert_eq!(found(&["in/gfx/stretcher.png"]), is("gfx/stretcher.png"));
    for squares in [
        &["Image/Stretcher2.png"][..],
        &["Image/stretcher.png", "gfx/stretcher.png"],
        &["image_previews/stretcher.png"],
        &["ui/stretcher.png"],
    ] {
        assert_eq!(found(squares), None, "{squares:?}");
    }
    // Folders that contain other models are not searched.
    let other = ("gfx/b.obj", plain.as_str());
    assert_eq!(
        found_textures(obj, &[(obj, &plain), other], &[], &["gfx/stretcher.png"]),
        None
    );
}

/// A folder `images` may have previews of models. Their sides are rarely powers of two.
#[test]
fn views_in_a_folder_of_images_are_no_textures() {
    let plain = OBJ.replace("a.mtl", "gone.mtl");
    let is_used = |name: &str, is_square: bool| {
        let folder = without_library(&[("chair.obj", &plain)], &["other.png"]);
        fs::write(folder.path().join("s.toml"), SCENE.replace("a.obj", "chair.obj")).unwrap();
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        match is_square {
            true => write_square(&folder, name),
            false => write_grey_png(&path, &[9, 40, 70, 99, 120, 150, 180, 200, 220]),
        }
        picture(&folder, "").1.contains(&format!("has {name}"))
    };
    for (name, is_square, expected) in [
        ("images/chair.png", true, true),
        ("images/chair.png", false, false),
        ("Images/chair_big.png", true, true),
        ("Images/chair_big.png", false, false),
        ("textures/chair.png", false, true),
        ("images/chair_ad.png", true, false),
    ] {
        assert_eq!(is_used(name, is_square), expected, "{name} {is_square}");
    }
}

/// A picture with the name of the file replaces the only colour texture of the library, if this
/// texture is missing.
#[test]
fn picture_named_after_the_obj_replaces_its_missing_texture() {
    let library = "newmtl wood\nmap_Kd RockSmooth_4.jpg\n";
    let explicit = picture(&scene("newmtl wood\nmap_Kd x.png\n", &["x.png"]), "").0;
    let folder = scene(library, &["textures/a.png"]);
    let (got, words) = picture(&folder, "");
    assert!(got == explicit, "{words}");
    for part in [
        "`RockSmooth_4.jpg` is missing; textures/a.png has the name",
        "[maps-by-name]",
    ] {
        assert!(words.contains(part), "{words}");
    }
    assert!(!words.contains("[missing-texture]"), "{words}");
    for flags in ["--maps-by-name off", "--mtl-dialect spec"] {
        let (_, words) = picture(&folder, flags);
        assert!(words.contains("[missing-texture]"), "{flags}: {words}");
    }
    // Nothing replaces a missing texture if the library has two textures, or if the picture has
    // only a similar name.
    let two = format!("{library}newmtl b\nmap_Kd leaf.jpg\n");
    for (library, name) in [(two.as_str(), "textures/a.png"), (library, "textures/a_b.png")] {
        let (_, words) = picture(&scene(library, &[name]), "");
        assert!(words.contains("[missing-texture]"), "{name}: {words}");
    }
}

/// Printed lines and messages of a command.
fn messages(folder: &TempDir, line: &str) -> String {
    let output = run(folder.path(), &split(line));
    words(&output) + &printed(&output)
}

/// Exporters replace characters in names of materials.
#[test]
fn materials_are_found_in_other_case_and_with_other_separators() {
    let of = |name: &str, library: &str| {
        let folder = scene(library, &["x.png"]);
        fs::write(folder.path().join("a.obj"), OBJ.replace("wood", name)).unwrap();
        folder
    };
    let expected = picture(&of("Mat_1", "newmtl Mat_1\nmap_Kd x.png\n"), "").0;
    for name in ["Mat.1", "Mat 1", "mat :1", "MAT-1"] {
        let folder = of("Mat_1", &format!("newmtl {name}\nmap_Kd x.png\n"));
        let (got, words) = picture(&folder, "");
        assert!(got == expected, "{name}: {words}");
        let message = format!("there is no material `Mat_1`; `{name}` of the library is used");
        assert!(
            words.contains(&message) && words.contains("[found-elsewhere]"),
            "{words}"
        );
        for flags in ["--mtl-dialect spec", "--strict"] {
            let words = messages(&folder, &format!("render s.toml -o t.png {flags}"));
            assert!(words.contains("[missing-material]"), "{flags}: {words}");
        }
    }
    let folder = of("Mat_1", "newmtl Mat.1\nmap_Kd x.png\n");
    // Flags use the name of the material in the OBJ file. The definition with the other name counts
    // as used.
    let (got, words) = picture(&folder, "--material Mat_1.opacity=0.5");
    assert!(got != expected, "{words}");
    let words = messages(&folder, "check s.toml");
    assert!(!words.contains("[unused-definition]"), "{words}");
    // A name that fits two definitions has none. A separator may differ, but it must not be
    // missing: `Mat1` does not define `Mat_1`.
    for library in [
        "newmtl Mat.1\nmap_Kd x.png\nnewmtl mat 1\n",
        "newmtl Mat1\nmap_Kd x.png\n",
    ] {
        let (_, words) = picture(&of("Mat_1", library), "");
        assert!(words.contains("[missing-material]"), "{words}");
    }
}

/// If an OBJ file has no `usemtl`, and the library with the name of the file has a single material,
/// the faces get this material.
#[test]
fn faces_without_usemtl_get_the_only_material() {
    let plain = OBJ.replace("mtllib a.mtl\n", "").replace("usemtl wood\n", "");
    let of = |obj: &str, mtl: &str| {
        let folder = scene(mtl, &["x.png", "y.png"]);
        fs::write(folder.path().join("a.obj"), obj).unwrap();
        folder
    };
    let library = "newmtl wood\nmap_Kd /home/bob/x.png\n";
    let (expected, _) = picture(&of(OBJ, library), "");
    for obj in [plain.clone(), format!("mtllib a.mtl\n{plain}")] {
        let folder = of(&obj, library);
        let (got, words) = picture(&folder, "");
        assert!(got == expected && words.contains("[only-material]"), "{words}");
        assert!(picture(&folder, "--mtl-dialect spec").0 != expected);
    }
    let two = of(&plain, &format!("{library}newmtl b\nKd 1 0 0\n"));
    let (got, words) = picture(&two, "");
    assert!(got != expected && !words.contains("a.mtl"), "{words}");
}

/// Blockbench writes names without extension.
#[test]
fn textures_without_extension_are_found() {
    let library = "newmtl wood\nmap_Kd texture\n";
    let expected = picture(&scene("newmtl wood\nmap_Kd x.png\n", &["x.png"]), "").0;
    let found = |pictures: &[&str], other: Option<&str>| {
        let folder = scene(library, pictures);
        if let Some(other) = other {
            fs::write(folder.path().join("b.mtl"), other).unwrap();
        }
        picture(&folder, "")
    };
    for name in ["texture.png", "x.png"] {
        let (got, words) = found(&[name], None);
        assert!(got == expected && words.contains("has no extension"), "{name}: {words}");
    }
    // An image used by another library belongs to another model.
    for (pictures, other) in [
        (&["texture.png"][..], Some("map_Kd texture.png\n")),
        (&["x.png", "y.png"], None),
    ] {
        let (got, words) = found(pictures, other);
        assert!(got != expected && words.contains("[missing-texture]"), "{words}");
    }
    let (_, words) = found(&["x.png", "y.png"], None);
    assert!(
        words.contains("x.png, y.png; if one of them is the texture, add --material 'wood.diffuse_map=FILE'"),
        "{words}"
    );
}

#[test]
fn unused_images_are_listed_in_a_warning() {
    let folder = scene(PLAIN, &["b.png", "c.png", "d.png", "e.png"]);
    let (_, words) = picture(&folder, "");
    assert!(words.contains("b.png, c.png, d.png and 1 more"), "{words}");
    assert!(
        words.contains("if one of them is the texture, add --material 'wood.diffuse_map=FILE'"),
        "{words}"
    );
    // A picture is proposed only if its name is like that of the file or of the material, and if it
    // may be a colour.
    for (pictures, proposed) in [
        (["old_wood.png", "c.png"], None),
        (["wood_portrait.png", "c.png"], None),
        (["wood_normal.png", "c.png"], None),
        (["wood_tex.png", "c.png"], Some("wood_tex.png")),
    ] {
        let (_, words) = picture(&scene(PLAIN, &pictures), "");
        let expected = proposed.map_or("if one of them is the texture".into(), |name| {
            format!("to use {name}, add")
        });
        assert!(words.contains(&expected), "{pictures:?}: {words}");
    }
    let (_, words) = picture(&folder, "--material wood.diffuse_map=b.png");
    assert!(!words.contains("[unused-pictures]"), "{words}");
    let (_, words) = picture(&folder, "--maps-by-name off");
    assert!(!words.contains("[unused-pictures]"), "{words}");
}

/// The alpha of a colour image is used as opacity if the image is a cut-out.
#[test]
fn cut_out_alpha_of_a_color_map_is_opacity() {
    let with_alpha = |alphas: &[u8; 16]| {
        let folder = scene("newmtl wood\nKd 1 1 1\nmap_Kd x.png\n", &[]);
        let mut encoder = png::Encoder::new(fs::File::create(folder.path().join("x.png")).unwrap(), 4, 4);
        encoder.set_color(png::ColorType::Rgba);
        let texel = |&alpha: &u8| if alpha == 0 { [0; 4] } else { [200, 90, 40, alpha] };
        let texels: Vec<u8> = alphas.iter().flat_map(texel).collect();
        encoder.write_header().unwrap().write_image_data(&texels).unwrap();
        folder
    };
    let cut: [u8; 16] = std::array::from_fn(|i| if i < 8 { 0 } else { 255 });
    let folder = with_alpha(&cut);
    let (got, words) = picture(&folder, "");
    assert!(
        words.contains("has transparent regions, so its alpha is used as opacity") && words.contains("[cut-out]"),
        "{words}"
    );
    let library = "newmtl wood\nKd 1 1 1\nmap_Kd x.png\nmap_d -imfchan m x.png\n";
    let explicit = with_alpha(&cut);
    fs::write(explicit.path().join("a.mtl"), library).unwrap();
    let (expected, words) = picture(&explicit, "");
    assert!(got == expected && !words.contains("[cut-out]"), "{words}");
    let opaque = picture(&folder, "--mtl-dialect spec").0;
    assert!(got != opaque);
    for flags in ["--material wood.opacity_map=false", "--strict"] {
        assert!(picture(&folder, flags).0 == opaque, "{flags}");
    }
    // Gradual alpha usually is gloss. Alpha 0 in the whole image is an error of the author. Neither
    // is used as opacity.
    for alphas in [std::array::from_fn(|i| 16 * i as u8), [0; 16]] {
        let folder = with_alpha(&alphas);
        let (got, words) = picture(&folder, "");
        assert!(!words.contains("[cut-out]"), "{words}");
        assert!(picture(&folder, "--mtl-dialect spec").0 == got, "{alphas:?}");
    }
    // If transparent texels have different colours, alpha is a mask for another purpose, not
    // opacity.
    let mut encoder = png::Encoder::new(fs::File::create(folder.path().join("x.png")).unwrap(), 4, 4);
    encoder.set_color(png::ColorType::Rgba);
    let texels: Vec<u8> = (0..16u8)
        .flat_map(|i| [15 * i, 240 - 15 * i, 40, cut[i as usize]])
        .collect();
    encoder.write_header().unwrap().write_image_data(&texels).unwrap();
    let (_, words) = picture(&folder, "");
    assert!(!words.contains("[cut-out]"), "{words}");
    let folder = with_alpha(&cut);
    // A scene file of `init` has the opacity.
    done(folder.path(), &split("init a.obj -o i.toml"));
    let written = fs::read_to_string(folder.path().join("i.toml")).unwrap();
    assert!(written.contains("opacity_map"), "{written}");
}

/// A sphere with texture coordinates. `used` scales them around the middle of the picture.
fn sphere(used: f32) -> String {
    use std::fmt::Write;
    const N: usize = 16;
    let mut text = String::new();
    for i in 0..=N {
        for j in 0..=N {
            let [u, v] = [i, j].map(|k| k as f32 / N as f32);
            let [phi, theta] = [u * std::f32::consts::TAU, v * std::f32::consts::PI];
            let [x, y, z] = [theta.sin() * phi.sin(), -theta.cos(), theta.sin() * phi.cos()];
            writeln!(text, "v {x} {y} {z}").unwrap();
            let [u, v] = [u, v].map(|x| 0.5 + used * (x - 0.5));
            writeln!(text, "vt {u} {v}").unwrap();
        }
    }
    for i in 0..N {
        for j in 0..N {
            let a = i * (N + 1) + j + 1;
            let [b, c, d] = [a + N + 1, a + N + 2, a + 1];
            writeln!(text, "f {a}/{a} {b}/{b} {c}/{c} {d}/{d}").unwrap();
        }
    }
    text
}

/// A picture with the name of the OBJ file is a preview, if the model's surfaces use its background
/// as much as the rest. It is the texture, if they do not use its background.
#[test]
fn previews_are_no_textures() {
    // An island at the border is no background
    for (used, has_island, is_texture) in [(1.0, false, false), (0.5, false, true), (1.0, true, true)] {
        let folder = folder(&[("a.obj", &sphere(used)), ("s.toml", SCENE)]);
        let mut encoder = png::Encoder::new(fs::File::create(folder.path().join("a.png")).unwrap(), 64, 64);
        encoder.set_color(png::ColorType::Grayscale);
        let is_island = |x: i32, y: i32| has_island && x > 50 && (20..28).contains(&y);
        let code = |x: i32, y: i32| match (x - 32).abs().max((y - 32).abs()) < 20 || is_island(x, y) {
            true => (60 + 37 * ((x / 3 + y / 3) % 4)) as u8,
            false => 230,
        };
        let codes: Vec<u8> = (0..64 * 64).map(|i| code(i % 64, i / 64)).collect();
        encoder.write_header().unwrap().write_image_data(&codes).unwrap();
        let (_, words) = picture(&folder, "");
        assert_eq!(words.contains("[maps-by-name]"), is_texture, "{used}: {words}");
    }
}

/// Textures with a generic name such as `default` beside several OBJ files belong to one of
/// these files only.
#[test]
fn generic_textures_beside_several_files_are_not_used() {
    let obj = OBJ.replace("wood", "default");
    let library = "newmtl default\nKd 0.3 0.3 0.3\n";
    let used = |set: &str, has_other: bool| {
        let folder = scene(library, &[set]);
        fs::write(folder.path().join("a.obj"), &obj).unwrap();
        if has_other {
            fs::write(folder.path().join("b.obj"), &obj).unwrap();
        }
        picture(&folder, "").1.contains("[maps-by-name]")
    };
    assert!(used("default_diffuse.png", false));
    assert!(!used("default_diffuse.png", true));
    assert!(used("a_default_diffuse.png", true));
}

/// A texture set is used if its name has the words of the name of the file, and if no other set of
/// the folder is like the file.
#[test]
fn texture_set_with_words_of_the_file_is_used() {
    let expected = picture(&without_library(&[("a.obj", OBJ)], &["a.png"]), "").0;
    let picture = |names: &[&str]| {
        let files = [("b_mining_boot.obj", OBJ), ("c.obj", OBJ)];
        let folder = without_library(&files, names);
        let scene = SCENE.replace("a.obj", "b_mining_boot.obj");
        fs::write(folder.path().join("s.toml"), scene).unwrap();
        picture(&folder, "")
    };
    let (got, words) = picture(&["Mining_Old.png", "Boot_Mining_DIF.png", "B_Mining_Boot2_SPEC.png"]);
    assert!(got != expected, "{words}");
    let (got, words) = picture(&["Brick.png", "Mining_Boot_DIF.png"]);
    assert!(
        got == expected && words.contains("probably has Mining_Boot_DIF.png"),
        "{words}"
    );
}

/// A library that names a normal map as colour gets the colour texture of the same set.
#[test]
fn normal_map_is_not_a_color() {
    let library = "newmtl wood\nKd 0.3 0.3 0.3\nmap_Kd oak_NOR.png\n";
    let with = |normals: [u8; 3], colors: &[&str]| {
        let folder = scene(library, &[]);
        write_png(&folder.path().join("oak_NOR.png"), 4, &[normals; 16]);
        let names = colors.iter().map(|name| folder.path().join(name));
        names.for_each(|path| write_png(&path, 4, &[[200, 60, 20]; 16]));
        folder
    };
    let blue = [128, 128, 255];
    let named = scene("newmtl wood\nKd 0.3 0.3 0.3\nmap_Kd oak_COL.png\n", &[]);
    write_png(&named.path().join("oak_COL.png"), 4, &[[200, 60, 20]; 16]);
    let expected = picture(&named, "").0;
    let (got, words) = picture(&with(blue, &["oak_COL.png", "fir_COL.png"]), "");
    let told = "is a normal map where a colour is expected; oak_COL.png is used [normals-as-color]";
    assert!(got == expected && words.contains(told), "{words}");
    // Without one colour texture of this name, the material has its constant.
    let plain = picture(&scene(PLAIN, &[]), "").0;
    for colors in [&[][..], &["oak_COL.png", "oak_diffuse.png"]] {
        let (got, words) = picture(&with(blue, colors), "");
        assert!(got == plain && words.contains("has no colour texture"), "{words}");
    }
    // Other pictures of this name, and the literal reading, show the named picture.
    let literal = picture(&with(blue, &["oak_COL.png"]), "--mtl-dialect spec").0;
    let (wood, words) = picture(&with([180, 90, 40], &["oak_COL.png"]), "");
    assert!(!words.contains("[normals-as-color]") && literal != expected, "{words}");
    assert!(wood != expected && wood != literal);
}
