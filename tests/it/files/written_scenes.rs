//! Scene files that the program writes: `render --dump-scene` and `init`.

use crate::support::program::*;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Renders with the arguments, and then with the scene file that the first render dumps into
/// another folder. Asserts that both images have the same bits, and returns the text of the scene
/// file.
fn dumped(at: &Path, args: &[&str], of_run: &[&str]) -> String {
    fs::create_dir_all(at.join("other/place")).unwrap();
    let line = [
        &["render"],
        args,
        of_run,
        &["-q", "--dump-scene", "other/place/d.toml", "-o", "a.exr", "-o", "a.png"],
    ]
    .concat();
    let said = words(&done(at, &line));
    done(
        at,
        &joined(
            &["render", "other/place/d.toml", "-q", "-o", "b.exr", "-o", "b.png"],
            of_run,
        ),
    );
    assert_same_bits(&at.join("a.exr"), &at.join("b.exr"));
    let [a, b] = ["a.png", "b.png"].map(|name| fs::read(at.join(name)).unwrap());
    assert!(a == b, "{args:?}: {said}");
    // If the dumped file is rendered from its own folder and dumped again, its text does not
    // change.
    done(
        &at.join("other/place"),
        &split("render d.toml -q --spp 1 --size 4x4 --dump-scene e.toml -o e.png"),
    );
    done(
        at,
        &split("render other/place/e.toml -q --dump-scene other/f.toml -o e.png"),
    );
    let text = fs::read_to_string(at.join("other/place/d.toml")).unwrap();
    assert!(text.starts_with("# Written by embrasure "), "{text}");
    text
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn dumped_project_scenes_render_the_same_bits() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut scenes: Vec<PathBuf> = fs::read_dir(root.join("scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml" || e == "obj"))
        .collect();
    scenes.sort();
    assert!(scenes.len() > 10);
    let folder = folder(&[]);
    for scene in scenes {
        let scene = scene.to_str().unwrap();
        let text = dumped(folder.path(), &[scene, "--size", "16x12", "--spp", "1"], &[]);
        assert!(
            text.contains("vertical_fov = ") && text.contains("width = 16"),
            "{text}"
        );
    }
}

const MTL: &str = "newmtl Wood\nKd 0.4 0.4 0.4\nKs 0.5 0.5 0.5\nNs 200\nmap_Kd -s 2 2 -mm 0.1 0.8 textures/wood.png\n\
    newmtl Glass.001\nKs 0.2 0.2 0.2\nTf 0.9 1 0.9\nNi 1.45\nPr 0.25\nillum 7\n\
    newmtl a*b\nKd 0.8 0.6 0.2\nPr 0.4\nPm 1\nPc 0.3\nmap_Pr textures/wood.png\n\
    newmtl Leaf\nKd 0.1 0.5 0.1\nd 0.5\nmap_Ks gone.png\n\
    newmtl Unused\nKd 1 0 0\n";

fn obj() -> String {
    let mut text = String::from("mtllib lib/a.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n");
    for (i, name) in ["Wood", "Glass.001", "a*b", "Leaf", "none"].iter().enumerate() {
        let (x, v) = (2.0 * i as f32, 4 * i + 1);
        text += &format!(
            "v {x} 0 0\nv {} 0 0.1\nv {} 1 0.2\nv {x} 1 0.3\nusemtl {name}\n",
            x + 1.5,
            x + 1.5
        );
        text += &format!("f {v}/1 {}/2 {}/3 {}/4\n", v + 1, v + 2, v + 3);
    }
    text
}

fn model() -> TempDir {
    let folder = folder(&[]);
    let at = folder.path();
    fs::create_dir_all(at.join("models/lib/textures")).unwrap();
    fs::write(at.join("models/a.obj"), obj()).unwrap();
    fs::write(at.join("models/lib/a.mtl"), MTL).unwrap();
    write_grey_png(&at.join("models/lib/textures/wood.png"), &[40, 200, 90, 255]);
    write_grey_png(&at.join("models/b.png"), &[255, 10]);
    folder
}

#[test]
fn flags_are_written_with_the_scene() {
    let folder = model();
    let at = folder.path();
    let small = ["models/a.obj", "--size", "20x10", "--spp", "2"];
    dumped(at, &small, &["--crop", "2,2,18,8"]);
    let flags = [
        &small[..],
        &[
            "--fov",
            "50.3",
            "--position",
            "3.3,1,9",
            "--seed",
            "18446744073709551615",
            "--tone",
            "agx",
            "--exposure",
            "0.3",
        ],
        &[
            "--max-depth",
            "none",
            "--filter",
            "gaussian",
            "--smooth",
            "40.5",
            "--sampler",
            "halton",
        ],
        &[
            "--material",
            "Wood.roughness=0.3",
            "--material",
            "W*.diffuse_map=b.png",
            "--material",
            "Wood.specular=0.1",
        ],
        &[
            "--set",
            "light.0.type=point",
            "--set",
            "light.0.position=[0,2,3]",
            "--set",
            "light.0.intensity=[9,9,9]",
        ],
    ];
    let text = dumped(at, &flags.concat(), &[]);
    for expected in [
        "seed = 18446744073709551615",
        "max_depth = \"none\"",
        "[patch.Wood]\n",
        "diffuse_map = \"../../models/b.png\"",
        "obj = \"../../models/a.obj\"",
        "vertical_fov = 50.3\n",
        "exposure = 0.3\n",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }

    // Test names and globs that both the scene file and a flag patch. The OBJ file, its instances
    // and a texture are in other folders.
    let scene = "version = 1\n[camera]\nposition = [3, 1, 9]\nlook_at = [4, 0.5, 0]\nlens_radius = 0.1\nshutter = [0.1, 0.9]\nposition_close = [3.1, 1, 9]\n\
        [[object]]\nobj = \"../models/a.obj\"\ninstances = \"places.txt\"\n\
        [[object]]\nobj = \"../models/a.obj\"\ntransform = { translate = [0, -1.1, 0], scale = 0.9 }\n\
        [patch.Wood]\nroughness = 0.3\n[patch.\"*\"]\nroughness = 0.9\n[material.Wood]\npatch = true\ndiffuse_map = \"../models/b.png\"\n\
        [material.Leaf]\ndiffuse = 0.3\nopacity_map = { file = \"../models/b.png\", channel = \"r\" }\n";
    fs::create_dir_all(at.join("scenes")).unwrap();
    fs::write(at.join("scenes/s.toml"), scene).unwrap();
    fs::write(at.join("scenes/places.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n").unwrap();
    let args = ["scenes/s.toml", "--size", "20x10", "--spp", "2"];
    let text = dumped(
        at,
        &joined(
            &args,
            &["--material", "Wood.roughness=0.1", "--material", "*.clearcoat=0.2"],
        ),
        &[],
    );
    assert_eq!(text.matches("[patch.").count(), 5, "{text}");
    assert!(text.contains("instances = \"../../scenes/places.txt\""), "{text}");
    // The scene has no light, so the written file names the default light.
    assert!(text.contains("radiance = [1.0, 1.0, 1.0]"), "{text}");
}

#[test]
fn dump_does_not_overwrite_input_files() {
    let folder = model();
    let at = folder.path();
    fs::write(at.join("s.toml"), "version = 1\n[[object]]\nobj = \"models/a.obj\"\n").unwrap();
    let line = "render s.toml -q --size 4x4 --spp 1 -o a.png --dump-scene";
    for (name, expected) in [
        ("s.toml", "would overwrite"),
        ("./models/../s.toml", "would overwrite"),
        ("a.png", "the name of a .toml scene file is expected"),
        ("gone/a.toml", "does not exist"),
        ("models", "the name of a .toml scene file is expected"),
    ] {
        let out = run(at, &split(&format!("{line} {name}")));
        assert!(
            code(&out) != 0 && words(&out).contains(expected),
            "{name}: {}",
            words(&out)
        );
    }
    let said = refused(at, &split(&format!("{line} t.toml --stats t.toml")), 2);
    assert!(said.contains("same file"), "{said}");
    // The scene file is complete even if the render ends early.
    run(
        at,
        &split("render s.toml -q --size 4x4 --pixel 1,1 --dump-scene p.toml"),
    );
    assert!(at.join("p.toml").is_file());
}

/// The text of a scene file with its commented settings enabled.
fn uncommented(text: &str) -> String {
    let line = |line: &str| match line.strip_prefix('#') {
        Some(setting) if !setting.starts_with(' ') => format!("{setting}\n"),
        _ => format!("{line}\n"),
    };
    text.lines().map(line).collect()
}

#[test]
fn init_scene_renders_the_same_bits() {
    let folder = model();
    let at = folder.path();
    fs::create_dir_all(at.join("scenes")).unwrap();
    let small = "--size 16x16 --spp 2 -q --warnings none";
    done(at, &split(&format!("render models/a.obj {small} -o a.exr -o a.png")));
    let bits = |scene: &str| {
        done(at, &split(&format!("render {scene} {small} -o b.exr -o b.png")));
        assert_same_bits(&at.join("a.exr"), &at.join("b.exr"));
        assert!(fs::read(at.join("a.png")).unwrap() == fs::read(at.join("b.png")).unwrap());
    };
    let out = done(at, &split("init models/a.obj -o scenes/a.toml"));
    assert!(
        printed(&out).contains("scenes/a.toml: 5 materials"),
        "{}",
        printed(&out)
    );
    bits("scenes/a.toml");
    let text = fs::read_to_string(at.join("scenes/a.toml")).unwrap();
    for expected in [
        "obj = \"../models/a.obj\"",
        "quality = \"good\"\n",
        "exposure = \"studio\"\ntone = \"agx\"",
        "\nwidth = 512\nheight = 512\n",
        "#max_depth = 16\n",
        "type = \"studio\"",
        "# Wood: 2 triangles, a.mtl:1\n#[patch.Wood]\n#diffuse = [0.4, 0.4, 0.4]\n#specular = [0.5, 0.5, 0.5]\n#model = \"phong\"\n#exponent = 200.0\n",
        "#file = \"../models/lib/textures/wood.png\"",
        "#[patch.\"Glass.001\"]",
        "# Its texture gone.png is missing.",
        "# Defined, but not used by any face: Unused",
        "# Camera: ",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    // With all settings enabled, nothing changes either.
    fs::write(at.join("scenes/all.toml"), uncommented(&text)).unwrap();
    assert!(uncommented(&text).contains("\n[patch.'a\\*b']"), "{text}");
    bits("scenes/all.toml");
    let said = words(&done(
        at,
        &split("render scenes/all.toml --size 4x4 --spp 1 -q -o c.png"),
    ));
    assert!(!said.contains("no face uses"), "{said}");

    // `init` replaces its own scene file only with `--force`, and never replaces other files.
    let said = refused(at, &split("init models/a.obj -o scenes/a.toml"), 2);
    assert!(
        said.contains("scenes/a.toml already exists") && said.contains("--force"),
        "{said}"
    );
    done(
        at,
        &split("init models/a.obj -o scenes/a.toml --force --material Wood.roughness=0.2 --set render.samples=8"),
    );
    let text = fs::read_to_string(at.join("scenes/a.toml")).unwrap();
    assert!(
        text.contains("\n[patch.Wood]\nroughness = 0.2\n") && text.contains("\nsamples = 8\n"),
        "{text}"
    );
    fs::write(at.join("scenes/all.toml"), uncommented(&text)).unwrap();
    done(at, &split(&format!("render scenes/all.toml {small} -o c.png")));
    done(at, &split("init models/a.obj"));
    assert!(at.join("a.toml").is_file());
    for (line, expected) in [
        ("init scenes/a.toml", "this is already a scene file"),
        (
            "init models/a.obj -o x.obj",
            "the name of a .toml scene file is expected",
        ),
        ("init models/gone.obj", "no such file"),
        ("init models/lib/a.mtl", "the name of a scene ends in .toml or .obj"),
    ] {
        let out = run(at, &split(line));
        assert!(
            code(&out) != 0 && words(&out).contains(expected),
            "{line}: {}",
            words(&out)
        );
    }
}

/// Camera flags appear in the scene file of `init`.
#[test]
fn init_takes_the_camera_flags_of_render() {
    let folder = model();
    let at = folder.path();
    let picture = "--size 16x16 --spp 2 -q --warnings none";
    for (flags, expected) in [
        (
            "--position 3,2,4 --look-at 0.5,0,0 --up 0,0,1 --fov 33",
            "position = [3, 2, 4]\nlook_at = [0.5, 0, 0]\nup = [0, 0, 1]\nvertical_fov = 33\n",
        ),
        ("--orbit 40,20 --f-stop 2 --sensor-height 0.5", "\nlens_radius = "),
        (
            "--view top --lens-radius 0.1 --focus-distance 2.5",
            "\nfocus_distance = 2.5\n",
        ),
    ] {
        done(
            at,
            &split(&format!("render models/a.obj {picture} {flags} -o a.exr -o a.png")),
        );
        done(at, &split(&format!("init models/a.obj --force -o a.toml {flags}")));
        let text = fs::read_to_string(at.join("a.toml")).unwrap();
        assert!(text.contains(expected), "{flags}: {text}");
        done(at, &split(&format!("render a.toml {picture} -o b.exr -o b.png")));
        assert_same_bits(&at.join("a.exr"), &at.join("b.exr"));
        assert!(
            fs::read(at.join("a.png")).unwrap() == fs::read(at.join("b.png")).unwrap(),
            "{flags}"
        );
    }
    let said = refused(at, &split("init models/a.obj -o b.toml --view top --orbit 1,2"), 2);
    assert!(said.contains("cannot be used with"), "{said}");
}

/// The OBJ files of the project have no camera and no light. The scene file that `init` makes from
/// an OBJ file renders the same image as the OBJ file.
#[test]
fn init_of_project_scenes_renders_the_same() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let folder = folder(&[]);
    let at = folder.path();
    for name in ["cornell-box", "furnace", "spheres", "pool"] {
        let obj = root.join(name).with_extension("obj");
        let obj = obj.to_str().unwrap();
        let toml = format!("{name}.toml");
        done(at, &["init", obj]);
        for scene in [obj, &toml] {
            done(
                at,
                &[
                    "render",
                    scene,
                    "-q",
                    "--size",
                    "16x16",
                    "--spp",
                    "1",
                    "-o",
                    if scene == obj { "a.exr" } else { "b.exr" },
                ],
            );
        }
        assert_same_bits(&at.join("a.exr"), &at.join("b.exr"));
        let all = uncommented(&fs::read_to_string(at.join(&toml)).unwrap());
        fs::write(at.join("all.toml"), all).unwrap();
        done(at, &split("render all.toml -q --size 16x16 --spp 1 -o b.exr"));
        assert_same_bits(&at.join("a.exr"), &at.join("b.exr"));
    }
}
