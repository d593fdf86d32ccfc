//! Tests of each dialect, with libraries as the program of the dialect writes them.

mod writers;

use super::dialect::TrMeaning;
use super::reflectance::ior_of_dielectric;
use super::section::DEFAULT_IOR;
use super::writer::{BlenderExport, Interpretation, Signature, Signatures, Writer};
use super::*;
use crate::io::statements::statements;
use crate::material::Gloss;

fn in_dialect(dialect: MtlDialect) -> LibraryOptions {
    LibraryOptions {
        dialect,
        ..LibraryOptions::default()
    }
}

type ReadMaterials = (Vec<Material>, Vec<Vec<MapSlot>>, Vec<String>);

/// Materials of a library, the slots of their textures, and messages of a render.
fn read(text: &str, dialect: MtlDialect) -> ReadMaterials {
    read_of(None, text, dialect)
}

/// Reads a library as [`read`] does. `obj` is the text of the OBJ file that names the library.
fn read_of(obj: Option<&str>, text: &str, dialect: MtlDialect) -> ReadMaterials {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.mtl");
    std::fs::write(&path, text).unwrap();
    let mut findings = Findings::default();
    let context = ObjContext {
        signature: obj.and_then(Signature::find),
        ..ObjContext::default()
    };
    let found = load_mtl(&path, &context, in_dialect(dialect), &mut findings);
    assert_eq!(findings.first_error(), None, "{text}");
    let slots = found.iter().map(|m| m.maps.iter().map(|m| m.statement.slot).collect());
    let slots = slots.collect();
    (
        found.into_iter().map(|m| m.material).collect(),
        slots,
        findings.warnings().into_iter().map(|warning| warning.text).collect(),
    )
}

fn auto(text: &str) -> Material {
    read(text, MtlDialect::Auto).0.remove(0)
}

fn is_near(a: f32, b: f32) -> bool {
    (a - b).abs() < 1e-4
}

/// A material as all exporters of Blender write it.
fn blender(ns: f32, ka: f32, ks: f32, ni: f32, d: f32, illum: u32) -> String {
    let grey = |key: &str, n: f32| format!("{key} {n:.6} {n:.6} {n:.6}\n");
    let (ka, ks, ke) = (grey("Ka", ka), grey("Ks", ks), grey("Ke", 0.0));
    format!("newmtl m\nNs {ns:.6}\n{ka}Kd 0.800000 0.400000 0.200000\n{ks}{ke}Ni {ni:.6}\nd {d:.6}\nillum {illum}\n")
}

const NATIVE_3: &str = "# Blender 3.6.0 MTL File: 'a.blend'\n# www.blender.org\n\n";
const NATIVE_5: &str = "# Blender 5.0.1 MTL File: 'a.blend'\n# www.blender.org\n\n";
const PYTHON: &str = "# Blender MTL File: 'a.blend'\n# Material Count: 1\n\n";

#[test]
fn blender_writes_a_principled_surface() {
    let base = Spectrum::rgb(0.8, 0.4, 0.2);
    // Each case has a header and statements, and the expected metallic, roughness, reflectance
    // along the normal and opacity.
    let ior_145 = 2.0 * (0.45f32 / 2.45).powi(2) * 0.5;
    for (header, text, expected) in [
        (NATIVE_3, blender(250.0, 1.0, 0.5, 1.45, 1.0, 2), [0.0, 0.5, 0.04, 1.0]),
        (
            NATIVE_5,
            blender(250.0, 1.0, 0.5, 1.45, 1.0, 2),
            [0.0, 0.5, ior_145, 1.0],
        ),
        (NATIVE_5, blender(250.0, 1.0, 0.25, 1.5, 1.0, 2), [0.0, 0.5, 0.02, 1.0]),
        (NATIVE_3, blender(640.0, 1.0, 0.5, 1.45, 1.0, 3), [1.0, 0.2, 0.04, 1.0]),
        (
            NATIVE_3,
            blender(0.0, 0.25, 0.5, 1.45, 0.75, 6),
            [0.25, 1.0, 0.04, 0.75],
        ),
        (NATIVE_3, blender(1000.0, 1.0, 1.0, 1.45, 0.5, 9), [0.0, 0.0, 0.08, 0.5]),
        (PYTHON, blender(225.0, 1.0, 0.5, 1.45, 1.0, 2), [0.0, 0.5, 0.04, 1.0]),
        (
            PYTHON,
            blender(96.078_43, 1.0, 0.5, 1.0, 1.0, 2),
            [0.0, 0.690_035, 0.04, 1.0],
        ),
    ] {
        let material = auto(&format!("{header}{text}"));
        let [metallic, roughness, f0, opacity] = expected;
        assert_eq!(material.gloss, Gloss::Metallic(metallic), "{header}{text}");
        assert!(is_near(material.roughness, roughness), "{header}{text}: {material:?}");
        assert!(
            is_near(material.ior, ior_of_dielectric(f0, roughness)),
            "{header}{text}: {material:?}"
        );
        assert_eq!((material.opacity, material.diffuse), (opacity, base), "{header}{text}");
        assert_eq!(
            (material.specular, material.transmission),
            (Spectrum::ONE, Spectrum::ZERO)
        );
    }
    let matte = auto(&format!("{NATIVE_3}{}", blender(250.0, 1.0, 0.0, 1.45, 1.0, 1)));
    assert_eq!((matte.diffuse, matte.specular), (base, Spectrum::ZERO));
}

#[test]
fn blender_writes_the_extension_in_its_own_units() {
    let statements = "Kd 0.64 0.64 0.64\nKs 0.5 0.5 0.5\nNi 1.33\nd 1\nillum 2\nPr 0.25\nPm 0\nPs 0.5\nPc 2.4\nPcr 0.1\naniso 0.5\nanisor 0.25";
    let coated = auto(&format!("{NATIVE_5}newmtl m\n{statements}\n"));
    assert!(
        is_near(coated.clearcoat, 0.6) && coated.clearcoat_roughness == 0.1,
        "{coated:?}"
    );
    assert_eq!((coated.roughness, coated.anisotropy), (0.25, 0.5));
    assert_eq!(coated.sheen, Spectrum::splat(0.5));
    // The base colour tints light that enters, and again light that leaves.
    let glass = auto(&format!("{NATIVE_5}newmtl m\n{statements}\nTf 1.0 1.0 1.0\n"));
    assert!(
        is_near(glass.transmission.mean(), 0.8) && glass.ior == 1.33,
        "{glass:?}"
    );
    assert!(glass.diffuse.is_black() && glass.specular.is_black() && !glass.thin);
    let half = auto(&format!("{NATIVE_5}newmtl m\n{statements}\nTf 0.5\n"));
    assert!(
        is_near(half.diffuse.mean(), 0.32) && is_near(half.transmission.mean(), 0.4),
        "{half:?}"
    );
    // Blender writes `Tf` only with the PBR extension. Without the extension, `Tf` is ignored.
    let opaque = blender(250.0, 1.0, 0.5, 1.45, 1.0, 2) + "Tf 1 1 1\n";
    assert!(read(&opaque, MtlDialect::Blender).0[0].transmission.is_black());
}

#[test]
fn pictures_of_blender_replace_numbers() {
    let maps = "map_Kd a.png\nmap_Ns b.png\nmap_refl c.png\nmap_Ks d.png\nmap_Bump -bm 0.7 e.png\n";
    let (materials, slots, _) = read(
        &format!("{NATIVE_5}newmtl m\nNi 1.5\nillum 2\n{maps}"),
        MtlDialect::Auto,
    );
    use MapSlot::*;
    assert_eq!(slots[0], [Diffuse, Roughness, Metallic, Specular, Normal]);
    let material = &materials[0];
    assert_eq!((material.diffuse, material.roughness), (Spectrum::ONE, 1.0));
    assert_eq!(material.gloss, Gloss::Metallic(1.0));
    // Blender Internal wrote height maps as `map_Bump`.
    let internal = format!("{PYTHON}{}{maps}", blender(96.078_43, 1.0, 0.5, 1.0, 1.0, 2));
    assert_eq!(read(&internal, MtlDialect::Auto).1[0][4], Bump);
}

#[test]
fn pictures_scale_the_specular_level_of_blender() {
    let maps = "map_Ks a.png\n";
    // A picture replaces the specular level. In Blender Internal the level multiplies the picture.
    for (text, f0, roughness) in [
        (
            format!("{NATIVE_3}{}{maps}", blender(250.0, 1.0, 0.5, 1.45, 1.0, 2)),
            0.08,
            0.5,
        ),
        (
            format!("{PYTHON}{}{maps}", blender(96.078_43, 1.0, 0.5, 1.0, 1.0, 2)),
            0.04,
            0.690_035,
        ),
    ] {
        let mut findings = Findings::default();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.mtl");
        std::fs::write(&path, &text).unwrap();
        let found = load_mtl(&path, &ObjContext::default(), LibraryOptions::default(), &mut findings).remove(0);
        assert!(found.has_map(MapSlot::Specular), "{text}");
        assert_eq!(found.material.specular, Spectrum::ONE, "the picture's factor");
        assert!(is_near(found.material.ior, ior_of_dielectric(f0, roughness)), "{text}");
        assert!(
            findings.iter().all(|finding| finding.code != "no-effect"),
            "{findings:?}"
        );
    }
    // The model of the extension has no constant `Ks`.
    let (_, _, messages) = read("newmtl m\nPr 0.5\nKs 0.5\nmap_Ks a.png\n", MtlDialect::Auto);
    assert!(
        messages
            .iter()
            .any(|words| words.contains("Ks has no effect with Pr or Pm")),
        "{messages:?}"
    );
    let (_, _, messages) = read("newmtl m\nPr 0.5\nmap_Ks a.png\n", MtlDialect::Auto);
    assert!(messages.is_empty(), "{messages:?}");
}

#[test]
fn max_writes_levels_and_percent() {
    let header = "# 3ds Max Wavefront OBJ Exporter v0.97b - (c)2007 guruware\n# File Created: 01.02.2012 10:00:00\n\nnewmtl m\n\t";
    let end = "\tNi 1.5\n\td 1.0\n\tTr 0.0\n\tTf 1.0 1.0 1.0\n\tillum 2\n\tKa 0.6 0.6 0.6\n\tKd 0.6 0.6 0.6\n";
    let wire = auto(&format!("{header}Ns 32\n{end}\tKs 0.35 0.35 0.35\n"));
    assert_eq!((wire.gloss, wire.diffuse), (Gloss::Metallic(0.0), Spectrum::splat(0.6)));
    assert!(
        is_near(wire.roughness, 0.68) && is_near(wire.ior, ior_of_dielectric(0.028, 0.68)),
        "{wire:?}"
    );
    assert_eq!((wire.opacity, wire.transmission), (1.0, Spectrum::ZERO));
    let plain = auto(&format!("{header}Ns 10\n{end}\tKs 0 0 0\n\tmap_Kd a.jpg\n"));
    assert_eq!((plain.diffuse, plain.specular), (Spectrum::ONE, Spectrum::ZERO));
    let chrome = auto(&format!("{header}Ns 80\nillum 2\nKd 0 0 0\nKs 0.9 0.9 0.8\n"));
    assert_eq!(
        (chrome.gloss, chrome.diffuse),
        (Gloss::Metallic(1.0), Spectrum::rgb(0.9, 0.9, 0.8))
    );
    // A picture of glossiness is an inverted picture of roughness.
    let text = format!("{header}Ns 50\n{end}\tKs 1 1 1\n\tmap_Ns g.png\n");
    let (materials, slots, _) = read(&text, MtlDialect::Auto);
    assert_eq!(
        (&slots[0][..], materials[0].roughness),
        (&[MapSlot::Roughness][..], 1.0)
    );
}

#[test]
fn maya_writes_glass_for_everything() {
    let lambert = |tf: &str| {
        format!("newmtl initialShadingGroup\nillum 4\nKd 0.50 0.50 0.50\nKa 0.00 0.00 0.00\nTf {tf}\nNi 1.00\n")
    };
    let opaque = auto(&lambert("1.00 1.00 1.00"));
    assert_eq!((opaque.diffuse, opaque.opacity), (Spectrum::splat(0.5), 1.0));
    assert!(opaque.transmission.is_black() && opaque.specular.is_black());
    let filter = auto(&lambert("0.25 0.25 0.25"));
    assert_eq!((filter.opacity, filter.transmission), (0.25, Spectrum::ZERO));
    let phong = auto(&(lambert("1.00 1.00 1.00") + "Ks 0.50 0.50 0.50\nNs 20.00\n"));
    assert_eq!(phong.gloss, Gloss::Metallic(0.0));
    assert!(
        (0.3..0.5).contains(&phong.roughness) && is_near(phong.ior, ior_of_dielectric(0.04, phong.roughness)),
        "{phong:?}"
    );
    let textured = auto("# Maya\nnewmtl m\nillum 4\nKd 0.00 0.00 0.00\nTf 1 1 1\nmap_Kd a.png\nNi 1.00\n");
    assert_eq!(textured.diffuse, Spectrum::ONE);
    assert_eq!(
        auto(&lambert("1.00 1.00 1.00").replace("Ni 1.00", "Ni 0.00")).diffuse,
        Spectrum::splat(0.5)
    );
    // Maya is also recognised if the literal reading is glass that scatters more light than it
    // receives, and by the name of a shading group.
    for statements in [
        "newmtl red\nillum 4\nKd 0.66 0.08 0.04\n",
        "newmtl red\nillum 4\nKd 0.66 0.08 0.04\nTf 1 1 1\n",
        "newmtl blackSG\nillum 4\nKd 0 0 0\n",
        "newmtl lambert2SG1\nillum 4\nKd 0 0 0\nTf 1 1 1\n",
    ] {
        let (materials, _, messages) = read(statements, MtlDialect::Auto);
        assert!(materials[0].transmission.is_black(), "{statements}");
        assert!(
            messages[0].contains("a file of Maya by its typical statements")
                && messages[0].contains("--mtl-dialect spec"),
            "{messages:?}"
        );
        assert!(!read(statements, MtlDialect::Spec).0[0].transmission.is_black());
    }
    // One program writes the whole library, so a material without Ni is opaque like the other
    // materials.
    let mixed = lambert("1 1 1") + "newmtl auv\nillum 4\nKd 0 0 0\nTf 1 1 1\nmap_Kd a.png\n";
    assert!(
        read(&mixed, MtlDialect::Auto)
            .0
            .iter()
            .all(|m| m.transmission.is_black())
    );
    // These libraries are not from Maya: glass with an index of refraction, glass that scatters no
    // more light than it receives, glass with `d`, and models other than `illum 4`.
    let glass = auto("newmtl m\nillum 4\nKd 0 0 0\nTf 1 1 1\nNi 1.5\n");
    assert_eq!((glass.transmission, glass.ior), (Spectrum::ONE, DEFAULT_IOR));
    for statements in [
        "illum 4\nKd 0 0 0\nTf 0.9 1 0.9\n",
        "illum 4\nKd 0 0 0\n",
        "illum 4\nKd 0.5\nd 0.5\n",
        "illum 6\nKd 0.5\nTf 1 1 1\n",
    ] {
        let glass = auto(&format!("newmtl m\n{statements}"));
        assert!(!glass.transmission.is_black(), "{statements}");
    }
}

#[test]
fn texture_of_invisible_glass_makes_it_opaque() {
    let ghost = "newmtl m\nillum 4\nKd 1 1 1\nTf 1 1 1\nNi 1.00\nmap_Kd a.png\n";
    let other = "newmtl n\nillum 2\nKd 0.5\n";
    let (materials, _, messages) = read(&format!("{ghost}{other}"), MtlDialect::Auto);
    assert_eq!((materials[0].diffuse, materials[0].opacity), (Spectrum::ONE, 1.0));
    assert!(materials[0].transmission.is_black());
    assert!(
        messages.len() == 1
            && messages[0].contains("t.mtl:2: illum 4 with Ni 1 would make the texture of material `m` invisible"),
        "{messages:?}"
    );
    for change in [
        ["Ni 1.00", "Ni 1.2"],
        ["Tf 1 1 1", "Tf 1 1 0.5"],
        ["map_Kd", "map_Ks"],
        ["Kd 1 1 1", "d 0.5"],
    ] {
        let glass = ghost.replace(change[0], change[1]);
        let material = auto(&format!("{glass}{other}"));
        assert!(!material.transmission.is_black(), "{change:?}");
    }
    assert!(!read(ghost, MtlDialect::Spec).0[0].transmission.is_black());
}

#[test]
fn sketchup_meshlab_and_cinema_4d_write_constants() {
    let sketchup = "newmtl Wood\nKa 0.000000 0.000000 0.000000\nKd 0.6 0.5 0.4\nKs 0.330000 0.330000 0.330000\n";
    for header in [
        "",
        "# Alias OBJ Material File\n# Exported from SketchUp, (c) 2000-2012 Trimble Navigation Limited\n\n",
    ] {
        let material = auto(&format!("{header}{sketchup}"));
        assert_eq!(
            (material.diffuse, material.specular),
            (Spectrum::rgb(0.6, 0.5, 0.4), Spectrum::ZERO)
        );
    }
    let meshlab = "#\n# Wavefront material file\n# Converted by Meshlab Group\n#\n\nnewmtl material_0\nKa 0.2 0.2 0.2\nKd 0.9 0.9 0.9\nKs 1 1 1\nTr 1\nillum 2\nNs 0\n";
    let material = auto(meshlab);
    assert_eq!(
        (material.diffuse, material.specular),
        (Spectrum::splat(0.9), Spectrum::ZERO)
    );
    assert_eq!(material.opacity, 1.0);
    assert_eq!(auto(&meshlab.replace("Tr 1", "Tr 0")).opacity, 1.0);
    assert_eq!(auto(&meshlab.replace("Tr 1", "Tr 0.25")).opacity, 0.25);
    assert_eq!(auto(&meshlab.replace("Ns 0", "Ns 50")).gloss, Gloss::Metallic(0.0));
    let cinema = auto("# Wavefront OBJ, CINEMA 4D\nnewmtl m\nKd 0.5 0.5 0.5\nKs 0.5 0.5 0.5\nNs 50\n");
    assert_eq!(cinema.gloss, Gloss::Metallic(0.0));
    // Cinema 4D writes `illum 7` for every material.
    let header = "# WaveFront *.mtl file (generated by CINEMA 4D)\n\nnewmtl m\nKa 1 1 1\nKd 0.5 0.5 0.5\nillum 7\n";
    let opaque = auto(header);
    assert!(opaque.transmission.is_black() && opaque.diffuse == Spectrum::splat(0.5));
    let glass = auto(&format!("{header}Tf 1 1 1\nNi 1.5\n"));
    assert!(!glass.transmission.is_black());
}

#[test]
fn extension_is_read_in_every_dialect() {
    let text = "newmtl m\nillum 2\nKd 0.5\nKs 1 1 1\nNs 10\nPr 0.3\nPm 1\nTf 1 1 1\nd 1\n";
    for &(name, dialect) in MtlDialect::NAMES {
        let material = &read(text, dialect).0[0];
        let found = (material.gloss, material.roughness, material.transmission.is_black());
        assert_eq!(found, (Gloss::Metallic(1.0), 0.3, true), "{name}");
    }
}

#[test]
fn guess_is_reported_if_it_changes_the_material() {
    let kitchen = format!("{NATIVE_3}{}", blender(250.0, 1.0, 0.5, 1.45, 1.0, 2));
    let (_, _, messages) = read(&kitchen, MtlDialect::Auto);
    assert!(
        messages.len() == 1
            && messages[0]
                .contains("t.mtl:1: written by Blender 3.6.0; Ks and Ns are read as specular level and roughness"),
        "{messages:?}"
    );
    assert!(messages[0].contains("--mtl-dialect spec"), "{messages:?}");
    let (_, _, messages) = read(&blender(250.0, 1.0, 0.5, 1.45, 1.0, 2), MtlDialect::Auto);
    assert!(
        messages[0].contains("recognised as a file of Blender by its typical statements"),
        "{messages:?}"
    );
    for (dialect, count) in [(MtlDialect::Spec, 0), (MtlDialect::Blender, 0)] {
        let (materials, _, messages) = read(&kitchen, dialect);
        assert_eq!(messages.len(), count, "{messages:?}");
        let is_letter = materials[0].gloss == Gloss::Phong(250.0);
        assert_eq!(is_letter, dialect == MtlDialect::Spec);
    }
    // There is no message if the literal reading gives the same material.
    let (_, _, messages) = read(
        "# 3ds Max Wavefront OBJ Exporter\nnewmtl m\nKd 0.5\nNs 10\nKs 0 0 0\n",
        MtlDialect::Auto,
    );
    assert!(messages.is_empty(), "{messages:?}");
    // In the literal reading, nothing would be visible.
    let (materials, _, messages) = read("newmtl m\nTr 1\n", MtlDialect::Auto);
    assert!(
        materials[0].opacity == 1.0 && messages[0].contains("`Tr` is read as opacity"),
        "{messages:?}"
    );
}

/// All these dialects read `Ks` as a highlight that reflects only lamps.
#[test]
fn rhino_wings_3d_3dfier_and_assimp_write_highlights() {
    let wood = "Kd 0.45 0.33 0.19\nKs 1.0 1.0 1.0\nd 0.5\n";
    for (header, filter) in [
        ("# Rhino\n", "Tf 0.0 0.0 0.0\n"),
        ("# Exported from Wings 3D 2.2.9\n", ""),
        ("# 3dfier\n", ""),
        (
            "# File produced by Open Asset Import Library (http://www.assimp.sf.net)\n",
            "Tf 0.0 0.0 0.0\n",
        ),
    ] {
        let shiny = auto(&format!("{header}newmtl oak\n{wood}{filter}Ns 60\n"));
        assert_eq!(shiny.gloss, Gloss::Metallic(0.0), "{header}");
        assert!(
            is_near(shiny.ior, ior_of_dielectric(0.08, shiny.roughness)),
            "{header}{shiny:?}"
        );
        let matte = auto(&format!("{header}newmtl oak\n{wood}{filter}Ns 0\n"));
        assert_eq!(matte.specular, Spectrum::ZERO, "{header}");
        assert_eq!((matte.opacity, matte.transmission), (0.5, Spectrum::ZERO), "{header}");
    }
    // 3dfier writes no comment, and one colour for all statements.
    let (materials, _, messages) = read(
        "newmtl Forest\nKa 0.3 0.4 0.3\nKd 0.3 0.4 0.3\nKs 0.3 0.4 0.3\nillum 2\nNs 60.0000\n",
        MtlDialect::Auto,
    );
    assert_eq!(materials[0].gloss, Gloss::Metallic(0.0));
    assert!(
        messages[0].contains("a file of 3dfier by its typical statements"),
        "{messages:?}"
    );
}

#[test]
fn ks_is_a_highlight_if_kd_and_ks_exceed_1() {
    let material = |name: &str, statements: &str| format!("newmtl {name}\n{statements}\n");
    let bright = material("roof", "Kd 0.87 0.26 0.28\nKs 0.87 0.26 0.28\nNs 60\nillum 2");
    let dark = material("rubber", "Kd 0.1\nKs 0.2\nNs 20");
    let (materials, _, messages) = read(&format!("{dark}{bright}"), MtlDialect::Auto);
    // All materials of a library have one writer, so one material determines the dialect of the
    // library.
    assert!(
        materials.iter().all(|m| m.gloss == Gloss::Metallic(0.0)),
        "{materials:?}"
    );
    assert!(
        messages.len() == 1 && messages[0].contains("t.mtl:7: Kd + Ks of material `roof` is 1.74, so the surface"),
        "{messages:?}"
    );
    // With a picture, the diffuse reflectance is lower than the value of `Kd`, so a sum `Kd + Ks`
    // above 1 is possible. If a dielectric can have the `Ks`, such as 0.04, the sum does not
    // determine the dialect. With a `Ks` of 0.5 it does.
    for (ks, gloss) in [("0.04", Gloss::Phong(20.0)), ("0.5", Gloss::Metallic(0.0))] {
        for kd in ["", "Kd 1\n", "Kd 0.512\n"] {
            let wood = material("wood", &format!("{kd}map_Kd a.png\nKs {ks}\nNs 20"));
            assert_eq!(auto(&wood).gloss, gloss, "{wood}");
        }
    }
    let picture = material("a", "Kd 0.5\nmap_Ks a.png\nNs 20");
    assert_eq!(auto(&picture).gloss, Gloss::Phong(20.0));
    // The sum is printed with enough digits to show that it is above 1.
    for (kd, messages) in [
        ("0.504", " is 1.004, so"),
        ("0.5002", " is 1.0002, so"),
        ("0.7", " is 1.2, so"),
    ] {
        let (_, _, words) = read(&material("a", &format!("Kd {kd}\nKs 0.5\nNs 20")), MtlDialect::Auto);
        assert!(words[0].contains(messages), "{words:?}");
    }
    // The library is read literally if sums are at most 1, or if the user chooses the literal
    // dialect.
    let (materials, _, messages) = read(&dark, MtlDialect::Auto);
    assert_eq!((materials[0].gloss, messages.len()), (Gloss::Phong(20.0), 0));
    let exact = material("a", "Kd 0.7 0.5 0.5\nKs 0.3 0.5 0.5\nNs 20");
    assert_eq!(auto(&exact).gloss, Gloss::Phong(20.0));
    let (materials, _, messages) = read(&bright, MtlDialect::Spec);
    assert_eq!((materials[0].gloss, messages.len()), (Gloss::Phong(60.0), 0));
    let (materials, _, messages) = read(&dark, MtlDialect::Highlight);
    assert_eq!((materials[0].gloss, messages.len()), (Gloss::Metallic(0.0), 0));
    // Mirrors, glass, surfaces without a highlight and materials of the extension do not determine
    // the dialect, and keep their meaning.
    for statements in ["illum 3", "illum 5", "illum 1", "illum 7\nTf 1 1 1", "Pr 0.5"] {
        let other = material("other", &format!("Kd 0.8\nKs 0.8\nNs 20\n{statements}"));
        let alone = read(&format!("{other}{dark}"), MtlDialect::Auto).0;
        assert_eq!(alone[1].gloss, Gloss::Phong(20.0), "{statements}");
        assert_eq!(
            alone[0],
            read(&format!("{other}{bright}"), MtlDialect::Auto).0[0],
            "{statements}"
        );
    }
}

#[test]
fn highlights_of_exponent_0_have_no_effect() {
    let text = "newmtl m\nKd 0.5\nKs 0.3\nNs 0\n";
    let (materials, _, messages) = read(text, MtlDialect::Auto);
    assert_eq!(
        (materials[0].diffuse, materials[0].specular),
        (Spectrum::splat(0.5), Spectrum::ZERO)
    );
    assert!(
        messages.len() == 1 && messages[0].contains("t.mtl:4: Ks with Ns 0 is ignored"),
        "{messages:?}"
    );
    for &(name, dialect) in MtlDialect::NAMES {
        let material = &read(text, dialect).0[0];
        let keeps = matches!(dialect, MtlDialect::Spec | MtlDialect::Blender);
        assert_eq!(!material.specular.is_black(), keeps, "{name}");
    }
    let (materials, _, _) = read("newmtl m\nKd 0\nKs 0.9\nNs 0\nillum 3\n", MtlDialect::Auto);
    assert_eq!(materials[0].specular, Spectrum::splat(0.9), "a mirror");
}

/// Versions of MeshLab write opposite meanings of `Tr`. If one meaning makes most materials
/// invisible, the other meaning is used.
#[test]
fn tr_has_the_meaning_that_leaves_surfaces_visible() {
    let library = |header: &str, values: &[&str]| -> String {
        let material = |tr: &&str| format!("newmtl m\nKd 0.5 0.5 0.5\nTr {tr}\n");
        header.to_string() + &values.iter().map(material).collect::<String>()
    };
    let opacities = |text: &str, dialect| -> Vec<f32> {
        let (materials, _, _) = read(text, dialect);
        materials.iter().map(|material| material.opacity).collect()
    };
    let late = library("# Converted by Meshlab Group\n", &["0", "0", "0.25"]);
    assert_eq!(opacities(&late, MtlDialect::Auto), [1.0, 1.0, 0.75]);
    let (_, _, messages) = read(&late, MtlDialect::Auto);
    let told = "Tr is read as transparency, since as opacity it would make most materials invisible";
    assert!(
        messages[0].contains(told) && messages[0].contains("--mtl-dialect meshlab"),
        "{messages:?}"
    );
    assert_eq!(opacities(&late, MtlDialect::Meshlab), [0.0, 0.0, 0.25]);
    let early = library("# Converted by Meshlab Group\n", &["1", "1", "0"]);
    assert_eq!(opacities(&early, MtlDialect::Auto), [1.0, 1.0, 0.0]);
    // The meaning of an unknown program changes, too, but not for a single invisible material.
    let unknown = library("", &["1", "1", "0.25"]);
    assert_eq!(opacities(&unknown, MtlDialect::Auto), [1.0, 1.0, 0.25]);
    let (_, _, messages) = read(&unknown, MtlDialect::Auto);
    let told = "Tr is read as opacity, since as transparency it would make most materials invisible";
    assert!(messages[0].contains(told), "{messages:?}");
    assert_eq!(opacities(&unknown, MtlDialect::Spec), [0.0, 0.0, 0.75]);
    let one = library("", &["1", "0", "0.25"]);
    assert_eq!(opacities(&one, MtlDialect::Auto), [0.0, 1.0, 0.75]);
}

/// Exporters write the opacity 0 beside a picture of the opacity.
#[test]
fn picture_of_the_opacity_replaces_an_opacity_of_0() {
    for (opacity, told) in [("d 0", "d would make it invisible"), ("Tr 1", "Tr would make it")] {
        let text = format!("newmtl m\n{opacity}\nmap_d a.png\nnewmtl n\nTr 0\n");
        let (materials, slots, messages) = read(&text, MtlDialect::Auto);
        assert_eq!((materials[0].opacity, &slots[0][..]), (1.0, &[MapSlot::Opacity][..]));
        assert!(messages.iter().any(|message| message.contains(told)), "{messages:?}");
        assert_eq!(read(&text, MtlDialect::Spec).0[0].opacity, 0.0);
    }
    assert_eq!(auto("newmtl m\nd 0.5\nmap_d a.png\n").opacity, 0.5);
}
