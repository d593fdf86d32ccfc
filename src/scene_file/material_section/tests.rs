use super::*;
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::io::Findings;
use crate::math::Vec2;
use crate::scene_file::FileError;
use crate::scene_file::SceneFile;
use crate::scene_file::mtl::{LibraryOptions, ObjContext, load_mtl};
use crate::texture::{Channel, Mapping, Wrap};
use std::collections::BTreeMap;

/// Material of a scene file whose section has `keys`.
fn material(keys: &str) -> Result<Material, FileError> {
    textured(keys).map(|found| found.material)
}

fn textured(keys: &str) -> Result<FileMaterial, FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    let text = format!("version = 1\n[[object]]\nobj = \"a.obj\"\n[material.m]\n{keys}\n");
    std::fs::write(&path, text).unwrap();
    let file = SceneFile::load(&path)?;
    file.material.values().next().unwrap().material("m", &file.source)
}

#[test]
fn keys_make_rough_materials() {
    let gold = "eta = [0.1, 0.4, 1.4]\nk = [4, 2.4, 1.6]";
    let rough = material(&format!("roughness = 0.5\n{gold}")).unwrap();
    assert!(matches!(rough.gloss, Gloss::Ggx(Fresnel::Conductor { .. })));
    assert_eq!((rough.roughness, rough.specular), (0.5, Spectrum::ONE));
    let smooth = material("model = \"ggx\"\nspecular = [1, 1, 1]\nior = 1.8").unwrap();
    assert_eq!(smooth.gloss, Gloss::Ggx(Fresnel::Dielectric { eta: 1.8 }));
    assert_eq!(smooth.roughness, 0.0);
    let plastic = material("diffuse = [0.5, 0.2, 0.1]\nmetallic = 0.25\nroughness = 0.3").unwrap();
    let same = Material::metallic_roughness(Spectrum::rgb(0.5, 0.2, 0.1), 0.25, 0.3);
    assert_eq!(
        plastic,
        Material {
            name: "m".into(),
            ..same
        }
    );
    let brushed = "roughness = 0.5\nanisotropy = 0.75\nanisotropy_rotation = 30\nspecular = [1, 1, 1]";
    let brushed = material(&format!(
        "{brushed}\nclearcoat = 0.5\nclearcoat_roughness = 0.25\nsheen = [0.1, 0.2, 0.3]"
    ));
    let brushed = brushed.unwrap();
    assert_eq!((brushed.anisotropy, brushed.anisotropy_rotation), (0.75, 30.0));
    assert_eq!((brushed.clearcoat, brushed.clearcoat_roughness), (0.5, 0.25));
    assert_eq!(brushed.sheen, Spectrum::rgb(0.1, 0.2, 0.3));
    let glass = material("transmission = [1, 1, 1]\nroughness = 0.2").unwrap();
    assert_eq!((glass.roughness, glass.specular), (0.2, Spectrum::ZERO));
}

#[test]
fn textures_are_files_or_tables() {
    let keys = r#"opacity = 0.5
diffuse_map = "wood.png"
specular = [0.1, 0.2, 0.3]
specular_map = { file = "gloss/a b.png", scale = [2, 3], offset = [0.5, 0], wrap = "mirror", base = 0.1, gain = 2.0 }
exponent_map = "n.png"
emission_map = { file = "e.exr", wrap = "clamp" }
opacity_map = { file = "a.png", channel = "g" }
bump_map = { file = "b.png", height = 0.25 }
normal_map = "n.png""#;
    let FileMaterial { material, maps, .. } = textured(keys).unwrap();
    assert_eq!((material.opacity, material.diffuse), (0.5, Spectrum::ONE));
    assert_eq!(material.specular, Spectrum::rgb(0.1, 0.2, 0.3));
    assert_eq!((material.gloss, material.emission), (Gloss::Phong(1.0), Spectrum::ZERO));
    let plain = Mapping::default();
    let mirrored = Mapping {
        scale: Vec2::new(2.0, 3.0),
        offset: Vec2::new(0.5, 0.0),
        wrap: Wrap::Mirror,
        base: 0.1,
        gain: 2.0,
        ..plain
    };
    let clamped = Mapping {
        wrap: Wrap::Clamp,
        ..plain
    };
    let green = Mapping {
        channel: Some(Channel::Green),
        ..plain
    };
    let low = Mapping { bump: 0.25, ..plain };
    // Expect the slots in their order, each with its line in the file
    let expected = [
        (MapSlot::Diffuse, "wood.png", plain, 6),
        (MapSlot::Specular, "gloss/a b.png", mirrored, 8),
        (MapSlot::Emission, "e.exr", clamped, 10),
        (MapSlot::Exponent, "n.png", plain, 9),
        (MapSlot::Opacity, "a.png", green, 11),
        (MapSlot::Bump, "b.png", low, 12),
        (MapSlot::Normal, "n.png", plain, 13),
    ];
    assert_eq!(maps.len(), expected.len());
    for (map, (slot, file, mapping, line)) in maps.iter().zip(expected) {
        let statement = &map.statement;
        assert_eq!((statement.slot, statement.file.as_str()), (slot, file));
        assert_eq!(statement.mapping, mapping, "{file}");
        assert_eq!(map.place.position.map(|p| p.line), Some(line), "{file}");
    }
    let plastic = textured("diffuse = [1, 1, 1]\nroughness_map = \"r.png\"\nmetallic_map = \"m.png\"").unwrap();
    assert_eq!(
        (plastic.material.gloss, plastic.material.roughness),
        (Gloss::Metallic(1.0), 1.0)
    );
    assert_eq!(plastic.material.specular, Spectrum::ONE);
}

#[test]
fn mistakes_of_textures_are_named_with_their_line() {
    for (keys, word) in [
        ("diffuse_map = 3", "picture"),
        ("diffuse_map = { scale = [1, 1] }", "file"),
        ("diffuse_map = { file = \"a.png\", skale = [1, 1] }", "skale"),
        (
            "diffuse_map = { file = \"a.png\", scale = 2 }",
            "expected a list of 2 values",
        ),
        ("diffuse_map = { file = \"a.png\", scale = [1, inf] }", "inf"),
        ("diffuse_map = { file = \"a.png\", gain = nan }", "NaN"),
        (
            "diffuse_map = { file = \"a.png\", wrap = \"tile\" }",
            "unknown wrap `tile`",
        ),
        (
            "opacity_map = { file = \"a.png\", channel = \"q\" }",
            "unknown channel `q`",
        ),
        ("opacity = 1.5", "opacity is 1.5"),
        (
            "roughness_map = \"a.png\"\nmodel = \"blinn\"",
            "`roughness` has no effect on this material",
        ),
        (
            "metallic_map = \"a.png\"\nmodel = \"mirror\"",
            "`metallic` cannot be combined with",
        ),
        ("exponent_map = \"a.png\"\nmodel = \"ggx\"", "has no exponent"),
        ("colour_map = \"a.png\"", "colour_map"),
    ] {
        let error = textured(keys).unwrap_err();
        assert!(error.message.contains(word), "{keys}: {error}");
        assert_eq!(error.position.map(|p| p.line), Some(5), "{keys}: {error}");
        assert!(error.help.is_some(), "{keys}: {error}");
    }
}

#[test]
fn keys_that_do_not_go_together_are_errors() {
    for (keys, word) in [
        ("roughness = 1.5", "roughness is 1.5"),
        ("roughness = nan", "roughness is"),
        ("clearcoat = 2.0", "clearcoat is 2"),
        ("clearcoat_roughness = -1.0", "clearcoat_roughness is -1"),
        ("sheen = [0, 0, 1.5]", "sheen is"),
        ("roughness = 0.5\nanisotropy = 1.5", "anisotropy is 1.5"),
        ("anisotropy = 0.5", "`anisotropy` has no effect on this material"),
        ("anisotropy_rotation = inf", "anisotropy_rotation is"),
        ("metallic = -0.1", "metallic is -0.1"),
        (
            "model = \"blinn\"\nroughness = 0.5",
            "`roughness` has no effect on this material",
        ),
        (
            "model = \"phong\"\ntransmission = [1, 1, 1]\nthin = true\nroughness = 0.5",
            "`roughness` has no effect",
        ),
        (
            "model = \"mirror\"\nmetallic = 1.0",
            "`metallic` cannot be combined with",
        ),
        (
            "metallic = 1.0\neta = [1, 1, 1]\nk = [1, 1, 1]",
            "`metallic` cannot be combined with",
        ),
        ("roughness = 0.5\nexponent = 10.0", "\"ggx\" has no exponent"),
        ("transmission = 1.0\nabbe = 2.0", "abbe is 2"),
        (
            "transmission = 1.0\nroughness = 0.5\nabbe = 30.0",
            "`abbe` needs smooth glass",
        ),
        ("diffuse = 1.0\nabbe = 30.0", "`abbe` needs smooth glass"),
        ("transmission = 1.0\nabsorption = [0, -1, 0]", "absorption is"),
        ("transmission = 1.0\nabsorption_depth = 0", "absorption_depth is 0"),
    ] {
        let error = material(keys).unwrap_err();
        assert!(error.message.contains(word), "{keys}: {error}");
        assert!(error.position.is_some_and(|p| p.line > 4), "{keys}: {error}");
    }
}

/// If the absorption depth is set, the transmission becomes the transmittance of a body of this
/// depth, instead of a tint of the surface. Setting the same depth a second time has no effect.
#[test]
fn absorption_depth_turns_transmission_into_absorption() {
    let glass = material("transmission = [0.5, 1.0, 0.1]\nabsorption_depth = 2.0").unwrap();
    assert_eq!(glass.transmission, Spectrum::ONE);
    let kept = glass.absorption.to_array().map(|absorption| (-2.0 * absorption).exp());
    for (kept, expected) in kept.into_iter().zip([0.5, 1.0, 0.1]) {
        assert!((kept - expected).abs() < 1e-6, "{kept}, not {expected}");
    }
    let given = material("transmission = 1.0\nabsorption = 0.25\nabbe = 30.0").unwrap();
    assert_eq!((given.absorption, given.abbe), (Spectrum::splat(0.25), Some(30.0)));
    let tinted = &library("newmtl g\nillum 7\nKd 0 0 0\nKs 1 1 1\nTf 0.5 0.5 0.5\nNi 1.5\n")[0];
    let once = patched(tinted, "absorption_depth = 1.0").unwrap();
    assert!(
        (once.material.absorption.mean() - 2f32.ln()).abs() < 1e-6,
        "{:?}",
        once.material
    );
    let twice = patched(&once, "absorption_depth = 5.0").unwrap();
    assert_eq!(twice.material.absorption, once.material.absorption);
}

/// Materials of an MTL file with the contents `text`.
fn library(text: &str) -> Vec<FileMaterial> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.mtl");
    std::fs::write(&path, text).unwrap();
    let mut findings = Findings::default();
    let materials = load_mtl(&path, &ObjContext::default(), LibraryOptions::default(), &mut findings);
    assert!(findings.first_error().is_none(), "{:?}", findings.first_error());
    materials
}

/// Scene file with a patch that has `keys`, and the section of the patch.
fn patch(keys: &str) -> (SceneFile, MaterialSection) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    let header = if keys.starts_with('[') { "" } else { "[patch.\"*\"]\n" };
    let text = format!("version = 1\n[[object]]\nobj = \"a.obj\"\n{header}{keys}\n");
    std::fs::write(&path, text).unwrap();
    let file = SceneFile::load(&path).unwrap();
    let section = file.patch.0[0].1.clone();
    (file, section)
}

/// `base` patched by a section with `keys`.
fn patched(base: &FileMaterial, keys: &str) -> Result<FileMaterial, FileError> {
    let (file, section) = patch(keys);
    section.patched(base, &file.source).map(|(patched, _)| patched)
}

/// Materials of all kinds that material libraries define.
const LIBRARY: &str = "newmtl matte\nKd 0.5 0.4 0.3\nmap_Kd -s 2 2 -o 0.5 0 -clamp on wood.png\n\
    newmtl glossy\nKd 0.4 0.4 0.4\nKs 0.5 0.5 0.5\nNs 250\nmap_Ns n.png\nmap_Bump -bm 0.2 -imfchan g -mm 0.1 2 b.png\n\
    newmtl mirror\nKs 0.9 0.9 0.9\nillum 3\n\
    newmtl glass\nKs 0 0 0\nTf 0.9 1 0.9\nNi 1.45\nillum 7\n\
    newmtl frosted\nTf 1 1 1\nNi 1.3\nPr 0.3\naniso 0.5\nanisor 0.25\nillum 7\n\
    newmtl bright_glass\nKs 0.1 0.1 0.1\nTf 0.5 0.5 0.5\nPr 0.3\nillum 4\n\
    newmtl metal\nKd 0.9 0.6 0.2\nPr 0.3\nPm 1\nNi 1.6\naniso 0.5\nmap_Pr r.png\nmap_Pm m.png\n\
    newmtl painted\nKd 0.2 0 0\nPr 0.4\nPc 0.5\nPcr 0.1\nPs 0.2\n\
    newmtl leaf\nKd 0.1 0.5 0.1\nd 0.5\nmap_d a.png\nnorm nn.png\n\
    newmtl filter\nKd 0.1 0.5 0.1\nd 0.5\nTf 1 0.5 0.5\n\
    newmtl filter\nTf 0.5 0.5 0.5\n\
    newmtl lamp\nKe 5 4 3\nmap_Ke e.png\n";

/// A material is unchanged after a patch with its own section.
#[test]
fn material_is_unchanged_by_its_own_section() {
    let materials = library(LIBRARY);
    assert_eq!(materials.len(), 12);
    for found in &materials {
        let name = &found.material.name;
        let section = MaterialSection::of(found, &|request| Some(request.statement.file.clone().into()));
        let keys = toml::to_string(&BTreeMap::from([("patch", BTreeMap::from([("*", section)]))])).unwrap();
        let again = patched(found, &keys).unwrap_or_else(|error| panic!("{name}: {error}\n{keys}"));
        assert_eq!(again.material, found.material, "{keys}");
        let maps = |found: &FileMaterial| {
            let mut maps: Vec<_> = found.maps.iter().map(|m| m.statement.clone()).collect();
            maps.sort_by_key(|map| map.slot as u8);
            maps
        };
        assert_eq!(maps(&again), maps(found), "{keys}");
        assert!(keys.contains("diffuse = ["), "{keys}");
    }
}

#[test]
fn patches_change_what_they_say() {
    let materials = library(LIBRARY);
    let of = |name: &str| materials.iter().find(|m| m.material.name == name).unwrap();
    // A colour given as one number is a grey. All other properties are kept, including textures.
    let matte = patched(of("matte"), "diffuse = 0.5").unwrap();
    assert_eq!(matte.maps.len(), 1);
    let expected = Material {
        diffuse: Spectrum::splat(0.5),
        ..of("matte").material.clone()
    };
    assert_eq!(matte.material, expected);

    // A roughness changes a glossy lobe to GGX microfacets, and removes the exponent and the map of
    // the exponent.
    let glossy = of("glossy");
    let rough = patched(glossy, "roughness = 0.2").unwrap();
    assert_eq!(
        (rough.material.gloss, rough.material.roughness),
        (Gloss::Ggx(Fresnel::Full), 0.2)
    );
    assert_eq!(rough.material.specular, glossy.material.specular);
    assert!(!rough.has_map(MapSlot::Exponent) && rough.has_map(MapSlot::Bump));
    let gold = patched(glossy, "eta = [0.1, 0.4, 1.4]\nk = [4, 2.4, 1.6]\ndiffuse = 0").unwrap();
    assert!(matches!(gold.material.gloss, Gloss::Ggx(Fresnel::Conductor { .. })));
    assert_eq!(gold.material.specular, Spectrum::ONE);
    // The highlight keeps its width: the roughness is the fourth root of 2 / (4 · 250 + 2).
    assert!(
        (gold.material.roughness - 0.211_4).abs() < 1e-3,
        "{}",
        gold.material.roughness
    );
    let metal = patched(glossy, "metallic = 0.5").unwrap();
    assert_eq!(
        (metal.material.gloss, metal.material.specular),
        (Gloss::Metallic(0.5), Spectrum::ONE)
    );
    let dull = patched(glossy, "metallic = 1\nspecular = 0.5\nroughness = 0.7").unwrap();
    assert_eq!(
        (dull.material.specular, dull.material.roughness),
        (Spectrum::splat(0.5), 0.7)
    );
    let phong = patched(of("metal"), "model = \"phong\"\nexponent = 30").unwrap();
    assert_eq!(phong.material.gloss, Gloss::Phong(30.0));
    assert!(!phong.has_map(MapSlot::Metallic) && phong.has_map(MapSlot::Roughness));
    let coated = patched(of("metal"), "roughness = 0.1\nclearcoat = 1").unwrap();
    assert_eq!(
        (coated.material.gloss, coated.material.roughness),
        (Gloss::Metallic(1.0), 0.1)
    );
    // The roughness of glass applies to its refraction.
    let glass = patched(of("glass"), "roughness = 0.4\nior = 1.2").unwrap();
    let expected = Material {
        roughness: 0.4,
        ior: 1.2,
        ..of("glass").material.clone()
    };
    assert_eq!(glass.material, expected);

    // A new texture replaces the constant. If a texture is replaced, the constant is kept. `false`
    // removes a texture.
    let new = patched(glossy, "diffuse_map = \"a.png\"\nroughness_map = \"r.png\"").unwrap();
    assert_eq!((new.material.diffuse, new.material.roughness), (Spectrum::ONE, 1.0));
    let both = patched(glossy, "diffuse_map = \"a.png\"\ndiffuse = 0.25").unwrap();
    assert_eq!(both.material.diffuse, Spectrum::splat(0.25));
    let replaced = patched(of("matte"), "diffuse_map = \"b.png\"").unwrap();
    assert_eq!(replaced.material.diffuse, of("matte").material.diffuse);
    assert_eq!(replaced.maps[0].statement.file, "b.png");
    assert!(patched(of("matte"), "diffuse_map = false").unwrap().maps.is_empty());
    assert!(material("diffuse_map = false").unwrap().diffuse.is_black());
    let bright = patched(of("matte"), "emission = 2\nemission_map = \"e.png\"").unwrap();
    assert_eq!(bright.material.emission, Spectrum::splat(2.0));

    // A roughness on a material without reflection is a warning.
    let (file, section) = patch("roughness = 0.2");
    let warning = section.patched(of("matte"), &file.source).unwrap().1.unwrap();
    assert!(warning.message.contains("roughness has no effect"), "{warning}");
    assert!(section.patched(glossy, &file.source).unwrap().1.is_none());
}

#[test]
fn mistakes_of_patches_are_named() {
    let materials = library(LIBRARY);
    let glossy = &materials[1];
    for (keys, word) in [
        ("roughness = 2", "roughness is 2"),
        (
            "model = \"phong\"\nroughness = 0.5",
            "`roughness` has no effect on this material",
        ),
        ("roughness = 0.5\nexponent = 3", "model \"ggx\" has no exponent"),
        ("model = \"phong\"\neta = 1.5\nk = 1", "no Fresnel term"),
        ("eta = 1.5", "`eta` without `k`"),
        ("k = 1.5", "`k` without `eta`"),
        ("model = \"shiny\"", "unknown model `shiny`"),
        ("metallic = 1\nmodel = \"mirror\"", "`metallic` cannot be combined"),
        ("diffuse = -0.5", "diffuse is [-0.5, -0.5, -0.5]"),
    ] {
        let error = patched(glossy, keys).unwrap_err();
        assert!(error.message.contains(word), "{keys}: {error}");
        assert!(error.message.contains("glossy") && error.help.is_some(), "{error}");
        assert!(error.position.is_some_and(|p| p.line > 4), "{keys}: {error}");
    }
}
