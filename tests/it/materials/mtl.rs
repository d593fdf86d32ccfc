//! Dialects of material libraries, and textures that are not at their paths, tested with the
//! program.

use crate::support::program::{done, folder, json, read_json, refused, run, split, words, write_grey_png};
use serde_json::Value;
use std::fs;
use std::path::Path;

const SQUARE: &str =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n";
/// A material of roughness 0.3 and specular level 0.5, as Blender 4 writes it.
const OF_BLENDER: &str = "# Blender 4.1.1 MTL File: 'a.blend'\n# www.blender.org\n\nnewmtl m\nNs 490.000000\nKa 1.000000 1.000000 1.000000\n\
                          Kd 0.800000 0.100000 0.100000\nKs 0.500000 0.500000 0.500000\nKe 0.000000 0.000000 0.000000\nNi 1.500000\nd 1.000000\nillum 2\n";

fn material(at: &Path, flags: &[&str]) -> Value {
    json(&done(at, &[&["explain", "a.obj", "m", "--json"], flags].concat()))
}

#[test]
fn dialect_is_detected_from_the_header() {
    let obj = format!("mtllib a.mtl\n{SQUARE}");
    let scene = "version = 1\n[render]\nsamples = 1\nmtl_dialect = \"spec\"\n[image]\nwidth = 8\nheight = 8\n[[object]]\nobj = \"a.obj\"\n";
    let folder = folder(&[("a.obj", &obj), ("a.mtl", OF_BLENDER), ("s.toml", scene)]);
    let at = folder.path();

    let meant = material(at, &[]);
    assert_eq!(meant["gloss"], "metallic-roughness model, metallic 0");
    assert_eq!(meant["roughness"].as_f64(), Some(0.3));
    let ior = meant["ior"].as_f64().unwrap();
    assert!((1.5..1.6).contains(&ior), "{ior}");
    assert_eq!(material(at, &["--mtl-dialect", "blender"]), meant);
    let letter = material(at, &["--mtl-dialect", "spec"]);
    assert_eq!(letter["gloss"], "Phong, exponent 490");

    // A note names the detected dialect once. There is no note if the user set the dialect.
    let render = |flags: &[&str]| {
        let flags = [
            flags,
            &["--spp", "1", "--size", "8x8", "-o", "x.exr", "--stats", "x.json"],
        ]
        .concat();
        let out = done(at, &[&["render"], flags.as_slice()].concat());
        let hash = read_json(&at.join("x.json"))["scene_hash"]
            .as_str()
            .unwrap()
            .to_string();
        (words(&out), hash)
    };
    let guess = "a.mtl:1: written by Blender 4.1.1; Ks and Ns are read as specular level and roughness";
    let (said, meant) = render(&["a.obj"]);
    assert_eq!(said.matches(guess).count(), 1, "{said}");
    assert!(said.contains("--mtl-dialect spec"), "{said}");
    let (said, chosen) = render(&["a.obj", "--mtl-dialect", "blender"]);
    assert!(!said.contains("written by"), "{said}");
    assert_eq!(chosen, meant);
    let (said, letter) = render(&["a.obj", "--mtl-dialect", "spec"]);
    assert!(!said.contains("written by") && letter != meant, "{said}");

    // The key of the scene file sets the dialect, and the flag overrides the key
    let letter = render(&["s.toml"]).1;
    let meant = render(&["s.toml", "--mtl-dialect", "auto"]).1;
    assert_ne!(meant, letter);
    assert_eq!(render(&["s.toml", "--set", "render.mtl_dialect=blender"]).1, meant);
    fs::write(at.join("s.toml"), scene.replace("spec", "zbrush")).unwrap();
    let said = refused(at, &["render", "s.toml"], 1);
    assert!(
        said.contains("s.toml:4") && said.contains("maya, sketchup, cinema4d"),
        "{said}"
    );

    let checked = run(at, &["check", "a.obj"]);
    let said = String::from_utf8_lossy(&checked.stdout).into_owned();
    assert!(
        said.contains("note: written by Blender 4.1.1") && said.contains("[mtl-dialect]"),
        "{said}"
    );
}

#[test]
fn each_dialect_maps_to_its_material() {
    let mtl = "newmtl m\nillum 4\nKd 0.25 0.25 0.25\nKs 1 1 1\nNs 0\nTf 0.75 0.75 0.75\nNi 1.5\nPc 0.5\n";
    let obj = format!("mtllib a.mtl\n{SQUARE}");
    let folder = folder(&[("a.obj", &obj), ("a.mtl", mtl)]);
    let told = |dialect| {
        let m = material(folder.path(), &["--mtl-dialect", dialect]);
        let gloss = m["gloss"].as_str().unwrap().to_string();
        (
            gloss,
            m["transmission"][0].as_f64().unwrap(),
            m["opacity"].as_f64().unwrap(),
        )
    };
    for (dialect, gloss, transmission, opacity) in [
        ("auto", "mirror", 0.75, 1.0),
        ("spec", "mirror", 0.75, 1.0),
        ("blender", "metallic-roughness model, metallic 1", 0.0, 1.0),
        ("max", "mirror", 0.75, 1.0),
        ("maya", "metallic-roughness model, metallic 0", 0.0, 0.75),
        ("sketchup", "mirror", 0.75, 1.0),
        ("cinema4d", "mirror", 0.75, 1.0),
        ("meshlab", "mirror", 0.75, 1.0),
        ("rhino", "mirror", 0.8, 1.0),
        ("wings3d", "mirror", 0.75, 1.0),
        ("3dfier", "mirror", 0.75, 1.0),
        ("assimp", "mirror", 0.8, 1.0),
        ("highlight", "mirror", 0.75, 1.0),
    ] {
        let (found, passes, covers) = told(dialect);
        assert!(found.starts_with(gloss), "{dialect}: {found}");
        assert_eq!((passes, covers), (transmission, opacity), "{dialect}");
    }
}

/// A texture path of another machine is found by its base name. One message reports it for all
/// materials. Folders of `--texture-dir` are searched first.
#[test]
fn textures_are_found_elsewhere() {
    let mtl = "newmtl m\nKd 1 1 1\nmap_Kd C:\\Users\\bob\\Textures\\Wall.PNG\nnewmtl n\nmap_Kd C:\\Users\\bob\\Textures\\Wall.PNG\n";
    let obj = format!("mtllib lib/a.mtl\n{SQUARE}usemtl n\nf 1/1 2/2 3/3\n");
    let scene = "version = 1\n[render]\ntexture_dir = [\"given\"]\n[image]\nwidth = 8\nheight = 8\n[[object]]\nobj = \"a.obj\"\n";
    // The parent folder is searched too, so it must have no folders of other tests.
    let folder = folder(&[]);
    let at = &folder.path().join("scene");
    fs::create_dir(at).unwrap();
    fs::write(at.join("a.obj"), obj).unwrap();
    fs::write(at.join("s.toml"), scene).unwrap();
    for name in ["lib", "lib/textures", "maps", "given"] {
        fs::create_dir(at.join(name)).unwrap();
    }
    fs::write(at.join("lib/a.mtl"), mtl).unwrap();
    let render = |flags: &[&str]| {
        let out = done(
            at,
            &[
                &["render"],
                flags,
                &["--spp", "1", "--size", "8x8", "-o", "x.exr", "--warnings", "all"],
            ]
            .concat(),
        );
        words(&out)
    };

    let said = render(&["a.obj"]);
    assert!(
        said.contains("lib/a.mtl:3: texture `C:\\Users\\bob\\Textures\\Wall.PNG` is missing"),
        "{said}"
    );
    assert!(
        said.contains(
            "searched for Users/bob/Textures/Wall.PNG, bob/Textures/Wall.PNG, Textures/Wall.PNG and Wall.PNG in lib, ., .., \
             in their subfolders textures, maps, texture, images and tex, and one level deep in lib, .; put the file into \
             one of these folders, or name its folder with --texture-dir"
        ),
        "{said}"
    );
    let said = refused(at, &["render", "a.obj", "--strict"], 1);
    assert!(said.contains("is missing"), "{said}");

    // Textures are searched beside the OBJ file, beside the library, and in the given folder. If
    // several of these files exist, the last place in this list takes precedence.
    for (file, flags, found) in [
        ("maps/wall.png", &["a.obj"][..], "maps/wall.png is used"),
        ("lib/textures/Wall.PNG", &["a.obj"], "lib/textures/Wall.PNG is used"),
        (
            "given/wall.png",
            &["a.obj", "--strict", "--texture-dir", "maps", "--texture-dir", "given"],
            "maps/wall.png is used",
        ),
        (
            "given/wall.png",
            &["a.obj", "--texture-dir", "given"],
            "given/wall.png is used",
        ),
        ("given/wall.png", &["s.toml"], "given/wall.png is used"),
        (
            "given/wall.png",
            &["a.obj", "--set", "render.texture_dir=given"],
            "given/wall.png is used",
        ),
        (
            "given/wall.png",
            &["s.toml", "--texture-dir", "maps"],
            "maps/wall.png is used",
        ),
    ] {
        write_grey_png(&at.join(file), &[100]);
        let said = render(flags);
        assert_eq!(said.matches("is used").count(), 1, "{flags:?}: {said}");
        assert!(
            said.contains(found) && !said.contains("is missing;"),
            "{flags:?}: {said}"
        );
    }
    let checked = run(at, &["check", "a.obj"]);
    assert!(String::from_utf8_lossy(&checked.stdout).contains("[found-elsewhere]"));

    for (value, word) in [
        ("3", "texture_dir is not the name of a folder"),
        ("[\"given\", 3]", "texture_dir is not the name of a folder"),
        ("\"gone\"", "texture_dir: there is no folder gone"),
    ] {
        fs::write(at.join("s.toml"), scene.replace("[\"given\"]", value)).unwrap();
        let said = refused(at, &["render", "s.toml"], 1);
        assert!(
            said.contains("s.toml:3") && said.contains(word) && said.contains("help: "),
            "{said}"
        );
    }
    fs::write(at.join("s.toml"), scene.replace("texture_dir", "texture_dirs")).unwrap();
    let said = refused(at, &["render", "s.toml"], 1);
    assert!(said.contains("texture_dir"), "{said}");
}

/// Most downloads have `source/x.obj` beside a folder `textures`. One message reports the textures
/// of each folder.
#[test]
fn textures_beside_the_source_folder_are_found() {
    let mtl =
        "newmtl m\nmap_Kd a.png\nmap_Ks C:\\tex\\b.png\nnewmtl n\nmap_Kd a.png\nmap_d \"c d.png\"\nmap_Ke e #1.png\n";
    let obj = format!("mtllib x.mtl\n{SQUARE}usemtl n\nf 1/1 2/2 3/3\n");
    let folder = folder(&[]);
    let at = folder.path();
    for name in ["source", "textures"] {
        fs::create_dir(at.join(name)).unwrap();
    }
    fs::write(at.join("source/x.obj"), obj).unwrap();
    fs::write(at.join("source/x.mtl"), mtl).unwrap();
    for name in [
        "textures/a.png",
        "textures/b.png",
        "source/c_d.png",
        "textures/e #1.png",
    ] {
        write_grey_png(&at.join(name), &[100]);
    }
    for (inside, obj) in [(at.to_path_buf(), "source/x.obj"), (at.join("source"), "x.obj")] {
        let checked = run(&inside, &["check", obj]);
        let said = String::from_utf8_lossy(&checked.stdout).into_owned();
        let told: Vec<&str> = said.lines().filter(|line| line.contains("[found-elsewhere]")).collect();
        assert_eq!(told.len(), 2, "{said}");
        assert!(
            said.contains("note: texture `a.png` is not where this file says; "),
            "{said}"
        );
        assert!(said.contains("a.png is used, and 2 others in that folder"), "{said}");
        assert!(said.contains("c_d.png is used [found-elsewhere]"), "{said}");
        assert!(!said.contains("missing-texture"), "{said}");
    }
    // The scene file of `init` has the real paths of the textures.
    done(at, &split("init source/x.obj -o x.toml"));
    let text = fs::read_to_string(at.join("x.toml")).unwrap();
    assert!(
        text.contains("\"textures/e #1.png\"") && !text.contains("is missing"),
        "{text}"
    );
}
