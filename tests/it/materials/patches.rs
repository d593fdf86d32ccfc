//! Changes to materials without their library: patches in scene files and `--material`, and grouped
//! warnings.

use crate::support::program::*;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const MTL: &str = "newmtl Floor.001\nKd 0.4 0.4 0.4\nKs 0.5 0.5 0.5\nNs 200\nmap_Kd a.png\n\
    newmtl Floor.002\nKd 0.2 0.6 0.2\nillum 1\n\
    newmtl Metal\nKd 0.8 0.6 0.2\nPr 0.4\nPm 1\n";

/// Three squares side by side, with three materials.
const OBJ: &str = "mtllib a.mtl\nv -3 -1 0\nv -1 -1 0\nv -1 1 0\nv -3 1 0\nv 1 -1 0\nv 1 1 0\nv 3 -1 0\nv 3 1 0\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl Floor.001\nf 1/1 2/2 3/3 4/4\nusemtl Floor.002\nf 2/1 5/2 6/3 3/4\nusemtl Metal\nf 5/1 7/2 8/3 6/4\n";

const HEADER: &str = "version = 1\n[camera]\nposition = [0, 1, 8]\nlook_at = [0, 0, 0]\nvertical_fov = 45\n\
    [image]\nwidth = 24\nheight = 12\n[render]\nsamples = 2\n[[object]]\nobj = \"a.obj\"\n\
    [[light]]\ntype = \"directional\"\ndirection = [0.2, -0.5, -1]\nirradiance = [3, 3, 3]\n\
    [[light]]\ntype = \"constant\"\nradiance = [0.5, 0.6, 0.7]\n";

fn scene() -> TempDir {
    let folder = folder(&[("a.mtl", MTL), ("a.obj", OBJ), ("s.toml", HEADER)]);
    write_grey_png(&folder.path().join("a.png"), &[40, 200, 90, 255]);
    write_grey_png(&folder.path().join("b.png"), &[255, 10]);
    folder
}

/// The image of the scene with `text` appended and with `flags`.
fn picture(at: &Path, text: &str, flags: &[&str]) -> Vec<u8> {
    fs::write(at.join("t.toml"), format!("{HEADER}{text}")).unwrap();
    done(at, &joined(&["render", "t.toml", "-q", "-o", "t.png"], flags));
    fs::read(at.join("t.png")).unwrap()
}

#[test]
fn patch_keeps_other_keys() {
    let folder = scene();
    let at = folder.path();
    let plain = picture(at, "", &[]);
    // Patches that repeat the existing values change nothing, and the texture stays.
    let same = "[patch.\"Floor.001\"]\nspecular = [0.5, 0.5, 0.5]\nexponent = 200\n";
    assert_eq!(picture(at, same, &[]), plain);
    let rough = picture(at, "[patch.\"Floor.001\"]\nroughness = 0.2\n", &[]);
    assert_ne!(rough, plain);
    for same in [
        "[material.\"Floor.001\"]\npatch = true\nroughness = 0.2\n",
        "[material.\"Floor.001\"]\nmodel = \"ggx\"\nroughness = 0.2\ndiffuse = 0.4\nspecular = 0.5\ndiffuse_map = \"a.png\"\n",
        // Patches apply in the order of the file, so the second patch takes precedence.
        "[patch.\"Z*\"]\n[patch.\"F*1\"]\nroughness = 0.9\n[patch.\"?loor.001\"]\nroughness = 0.2\n",
        "[patch.\"F*1\"]\nroughness = 0.9\n[patch.\"A\"]\n[material.\"Floor.001\"]\npatch = true\nroughness = 0.2\n",
    ] {
        assert_eq!(picture(at, same, &[]), rough, "{same}");
    }
    // A section without `patch` replaces the material.
    let replaced = picture(at, "[material.\"Floor.001\"]\nroughness = 0.2\n", &[]);
    assert!(replaced != rough && replaced != plain);
    assert_eq!(
        picture(at, "[material.\"Floor.001\"]\npatch = false\nroughness = 0.2\n", &[]),
        replaced
    );
    // Replace the texture by another texture, and remove it.
    let other = picture(at, "[patch.\"Floor.001\"]\ndiffuse_map = \"b.png\"\n", &[]);
    let none = picture(at, "[patch.\"Floor.001\"]\ndiffuse_map = false\n", &[]);
    assert!(other != plain && none != plain && other != none);
    // A single number is a grey colour
    let grey = picture(at, "[patch.Metal]\ndiffuse = 0.5\n", &[]);
    assert_eq!(picture(at, "[patch.Metal]\ndiffuse = [0.5, 0.5, 0.5]\n", &[]), grey);
    assert_ne!(grey, plain);
    // Materials of the scene file are patched too.
    let own = "[material.Metal]\ndiffuse = 0.5\n[patch.\"Me*\"]\nemission = 2\n";
    assert_eq!(
        picture(at, own, &[]),
        picture(at, "[material.Metal]\ndiffuse = 0.5\nemission = 2\n", &[])
    );
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn flags_patch_after_the_file() {
    let folder = scene();
    let at = folder.path();
    let rough = picture(at, "[patch.\"Floor.001\"]\nroughness = 0.2\n", &[]);
    for flags in [
        &["--material", "Floor.001.roughness=0.2"][..],
        &["--material", "F*1.roughness=0.2"],
        &["--material", "\"Floor.001\".roughness = 0.2"],
        &["--material", "*1.roughness=0.7", "--material", "F*1.roughness=0.2"],
        &["--material", "*1.model=ggx", "--material", "*1.roughness=0.2"],
    ] {
        assert_eq!(picture(at, "", flags), rough, "{flags:?}");
    }
    let file = "[patch.\"Floor.001\"]\nroughness = 0.7\n";
    assert_eq!(picture(at, file, &["--material", "Floor.001.roughness=0.2"]), rough);
    // The last value for one glob and key is used. Keys of one glob form one patch, in either
    // order.
    let last = ["--material", "F*1.roughness=0.7", "--material", "F*1.roughness=0.2"];
    assert_eq!(picture(at, "", &last), rough);
    let gold = |first, second| picture(at, "", &["--material", first, "--material", second]);
    let (metallic, specular) = ("Floor.001.metallic=1", "Floor.001.specular=0.5");
    assert_eq!(gold(metallic, specular), gold(specular, metallic));

    // Patch a bare OBJ, with and without a library. Textures are in the folder of the OBJ file.
    let bare = |flags: &[&str]| {
        let line = ["render", "a.obj", "-q", "-o", "o.png", "--size", "24x12", "--spp", "2"];
        let out = done(at, &joined(&line, flags));
        (fs::read(at.join("o.png")).unwrap(), words(&out))
    };
    let (plain, _) = bare(&[]);
    assert_ne!(bare(&["--material", "Floor*.diffuse=[0.9,0,0]"]).0, plain);
    let (mapped, said) = bare(&["--material", "Metal.diffuse_map=b.png"]);
    assert!(mapped != plain && !said.contains("missing"), "{said}");
    let text = OBJ.replace("mtllib a.mtl\n", "").replace("usemtl", "#");
    fs::write(at.join("n.obj"), text).unwrap();
    let line = "render n.obj -q --size 8x8 --spp 1 -o n.png";
    done(at, &split(line));
    let plain = fs::read(at.join("n.png")).unwrap();
    done(at, &joined(&split(line), &["--material", "default.diffuse=0.1"]));
    assert_ne!(fs::read(at.join("n.png")).unwrap(), plain);

    // Other commands accept the flag too.
    let explained = printed(&done(
        at,
        &["explain", "s.toml", "Metal", "--material", "Metal.roughness=0.125"],
    ));
    assert!(explained.contains("0.125"), "{explained}");
    let checked = printed(&run(at, &["check", "s.toml", "--material", "Metla.roughness=0.1"]));
    assert!(checked.contains("did you mean `Metal`?"), "{checked}");
}

#[test]
fn wrong_patch_error_has_the_correction() {
    let folder = scene();
    let at = folder.path();
    for (value, expected) in [
        ("Metal", &["expected NAME.KEY=VALUE", "'Floor*.roughness=0.2'"][..]),
        ("Metal=1", &["there is no preset `1`", "frosted-glass"]),
        (".roughness=1", &["expected NAME.KEY=VALUE"]),
        ("Metal.roughness=2", &["roughness is 2", "a number from 0 to 1"]),
        (
            "Metal.roughnes=0.2",
            &["unknown key `roughnes`", "did you mean `roughness`?"],
        ),
        ("Metal.roughness=rough", &["expected a number, found"]),
        ("Metal.diffuse=redd", &["unknown colour", "did you mean"]),
        ("Metal.diffuse=[1,2]", &["found 2"]),
        ("Metal.diffuse_map=true", &["false for no texture"]),
        ("Metal.patch=true", &["`patch` belongs in [material.NAME] only"]),
        (
            "Metal.model=shiny",
            &["unknown model `shiny`", "phong, blinn, ggx, mirror"],
        ),
        (
            "Metal.exponent=5",
            &["model \"ggx\" has no exponent", "model = \"phong\""],
        ),
        ("Metal.eta=1.5", &["`eta` without `k`"]),
    ] {
        let said = refused(at, &["render", "s.toml", "-q", "--material", value], 2);
        assert!(
            said.contains(&format!("--material {value}: ")) && said.contains("help: "),
            "{value}: {said}"
        );
        for words in expected {
            assert!(said.contains(words), "{value}: {said}");
        }
    }
    for (text, expected) in [
        (
            "[material.Floor.001]\ndiffuse = 1\n",
            &[
                "t.toml:20:",
                "[material.Floor.001]",
                "quote a name with dots: [material.\"Floor.001\"]",
            ][..],
        ),
        (
            "[patch.Floor.001]\ndiffuse = 1\n",
            &["quote a name with dots: [patch.\"Floor.001\"]"],
        ),
        ("[material.a.b.c]\ndiffuse = 1\n", &["[material.\"a.b.c\"]"]),
        (
            "[material.Wood.diffuse]\nroughness = 1\n",
            &["[material.\"Wood.diffuse\"]"],
        ),
        (
            "[patch.Metal]\npatch = true\n",
            &["t.toml:21:", "`patch` belongs in [material.NAME] only"],
        ),
        ("[patch.Metal]\nroughness = 2\n", &["t.toml:21:13", "roughness is 2"]),
        (
            "[patch.Metal]\nroughnes = 2\n",
            &["t.toml:21:", "did you mean `roughness`?"],
        ),
        (
            "[material.Metal]\npatch = 1\n",
            &["t.toml:21:", "expected true or false"],
        ),
        ("[patch]\nMetal = 1\n", &["t.toml:21:"]),
    ] {
        fs::write(at.join("t.toml"), format!("{HEADER}{text}")).unwrap();
        let said = refused(at, &["render", "t.toml", "-q"], 1);
        for words in expected {
            assert!(said.contains(words), "{text}: {said}");
        }
        let checked = run(at, &["check", "t.toml"]);
        assert!(
            code(&checked) == 1 && printed(&checked).contains(expected[0]),
            "{}",
            printed(&checked)
        );
    }
    let said = refused(
        at,
        &["render", "s.toml", "-q", "--set", "material.Floor.001.diffuse=1"],
        2,
    );
    assert!(said.contains("[material.\"Floor.001\"]"), "{said}");
}

#[test]
fn unused_material_warning_has_the_nearest_name() {
    let folder = scene();
    let at = folder.path();
    for (text, expected) in [
        (
            "[patch.\"Flor*\"]\nroughness = 0.1\n",
            "did you mean `Floor.001` or `Floor.002`?",
        ),
        ("[patch.metal]\nroughness = 0.1\n", "did you mean `Metal`?"),
        ("[material.Metall]\nroughness = 0.1\n", "did you mean `Metal`?"),
        ("[material.xyz]\npatch = true\n", "a name from a `usemtl` line"),
    ] {
        fs::write(at.join("t.toml"), format!("{HEADER}{text}")).unwrap();
        let said = words(&done(at, &split("render t.toml -q -o t.png")));
        assert!(
            said.contains("t.toml:20:") && said.contains("no face uses the material"),
            "{text}: {said}"
        );
        assert!(said.contains(expected), "{text}: {said}");
    }
    // A roughness without effect causes a warning. A missing texture of a patch causes a warning
    // too.
    let said = words(&done(
        at,
        &[
            "render",
            "s.toml",
            "-q",
            "-o",
            "t.png",
            "--material",
            "Floor.002.roughness=0.2",
        ],
    ));
    assert!(said.contains("`Floor.002`: roughness has no effect"), "{said}");
    let said = words(&done(
        at,
        &[
            "render",
            "s.toml",
            "-q",
            "-o",
            "t.png",
            "--material",
            "Metal.diffuse_map=gone.png",
        ],
    ));
    assert!(said.contains("texture `gone.png` is missing"), "{said}");
}

#[test]
fn warnings_of_one_kind_are_one_line() {
    let folder = scene();
    let at = folder.path();
    let text = "[patch.a]\n[patch.b]\n[patch.c]\n[patch.Metal]\ndiffuse_map = \"gone.png\"\n";
    fs::write(at.join("t.toml"), format!("{HEADER}{text}")).unwrap();
    let said = |flags: &str| words(&done(at, &split(&format!("render t.toml -q -o t.png {flags}"))));
    for flags in ["", "--warnings summary"] {
        let said = said(flags);
        assert_eq!(said.matches("no face uses").count(), 1, "{said}");
        assert!(
            said.contains("t.toml:20:8: no face uses the material `a` (and 2 more [unused-material]"),
            "{said}"
        );
        assert!(said.contains("see `embrasure check t.toml`)"), "{said}");
        // A single warning is printed in full, with its help.
        assert!(
            said.contains("texture `gone.png` is missing")
                && said.contains("put the file into one of these folders, or name its folder with --texture-dir"),
            "{said}"
        );
    }
    let all = said("--warnings all");
    assert_eq!(all.matches("no face uses").count(), 3, "{all}");
    assert_eq!(said("--warnings none"), "");
    for flags in ["none", "summary", "all"] {
        said(&format!("--warnings {flags} --stats s.json"));
        assert_eq!(read_json(&at.join("s.json"))["warnings"].as_array().unwrap().len(), 4);
    }
    assert_eq!(
        printed(&run(at, &["check", "t.toml"]))
            .matches("[unused-material]")
            .count(),
        3
    );
    let said = refused(at, &split("render t.toml -q --warnings some"), 2);
    assert!(
        said.contains("--warnings some") && said.contains("summary, all, none"),
        "{said}"
    );
}

/// A flag whose pattern matches no material is an error that lists the materials. The same pattern
/// in a scene file is a warning.
#[test]
fn a_pattern_without_materials_is_an_error() {
    let folder = scene();
    let at = folder.path();
    for command in ["render", "check"] {
        let out = run(at, &[command, "s.toml", "--material", "Metla*.roughness=0.2"]);
        let said = printed(&out) + &words(&out);
        assert_eq!(code(&out), if command == "check" { 1 } else { 2 }, "{said}");
        assert!(
            said.contains("--material Metla*.roughness=0.2: no face uses a material of this name"),
            "{said}"
        );
        assert!(
            said.contains("did you mean `Metal`") && said.contains("materials are `"),
            "{said}"
        );
    }
}
