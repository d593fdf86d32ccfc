use super::section::DEFAULT_IOR;
use super::*;
use crate::bsdf::Fresnel;
use crate::material::Gloss;

fn load(text: &str) -> Result<(Vec<Material>, Vec<String>), FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.mtl");
    std::fs::write(&path, text).unwrap();
    let (materials, warnings) = load_file(&path, LibraryOptions::default())?;
    let materials = materials.into_iter().map(|m| m.material);
    Ok((materials.collect(), warnings))
}

fn load_file(path: &Path, options: LibraryOptions) -> Result<(Vec<FileMaterial>, Vec<String>), FileError> {
    let mut findings = Findings::default();
    let materials = load_mtl(path, &ObjContext::default(), options, &mut findings);
    match findings.first_error() {
        Some(error) => Err(error.clone()),
        None => Ok((materials, findings.warnings().into_iter().map(|w| w.text).collect())),
    }
}

fn one(text: &str) -> Material {
    load(&format!("newmtl m\n{text}")).unwrap().0.remove(0)
}

#[test]
fn keys_become_lobes() {
    let grey = Spectrum::splat;
    let phong = one("Kd 0.1 0.2 0.3\nKs 0.5\nNs 20\nillum 2");
    assert_eq!(
        (phong.diffuse, phong.specular),
        (Spectrum::rgb(0.1, 0.2, 0.3), grey(0.5))
    );
    assert_eq!(phong.gloss, Gloss::Phong(20.0));
    assert_eq!(one("Ks 0.9\nillum 3").gloss, Gloss::Mirror(Fresnel::Full));
    assert_eq!(one("Ks 0.9\nillum 1").specular, Spectrum::ZERO);
    // Glass
    for text in [
        "Tf 0.9\nNi 1.3\nillum 7",
        "d 0.1\nNi 1.3\nillum 4",
        "Tr 0.9\nNi 1.3\nillum 6\nKs 0.5",
    ] {
        let m = one(text);
        assert!(
            (m.transmission.max_component() - 0.9).abs() < 1e-6 && !m.thin && m.ior == 1.3,
            "{m:?}"
        );
        assert!(m.specular.is_black());
    }
    // If a file leaves energy for `Ks`, the material keeps `Ks`.
    assert_eq!(one("Kd 0\nKs 0.3\nTf 0.1\nillum 7").specular, grey(0.3));
    // With `Ns`, `Ks` is a Phong lobe, except for illum 7, whose reflections are traced.
    for (model, gloss) in [
        (4, Gloss::Phong(30.0)),
        (6, Gloss::Phong(30.0)),
        (7, Gloss::Mirror(Fresnel::Full)),
    ] {
        let mixed = one(&format!("Kd 0.3\nKs 0.2\nNs 30\nTf 0.4\nNi 1.5\nillum {model}"));
        assert_eq!(mixed.gloss, gloss, "illum {model}");
        assert_eq!((mixed.specular, mixed.transmission), (grey(0.2), grey(0.4)));
    }
    // A mixture of `Kd`, `Ks` and `Tf`; it refracts if `Ni` is given
    for (statements, thin) in [("", true), ("Ni 1.5\n", false)] {
        let mixed = one(&format!("Kd 0.7\nKs 0.2\nNs 30\nTf 0.1\n{statements}illum 2"));
        assert_eq!((mixed.diffuse, mixed.specular), (grey(0.7), grey(0.2)));
        assert_eq!((mixed.transmission, mixed.thin), (grey(0.1), thin));
        assert_eq!((mixed.gloss, mixed.opacity), (Gloss::Phong(30.0), 1.0));
    }
    // Exporters write a filter of 1 for opaque surfaces.
    assert!(one("Kd 0.7\nTf 1 1 1\nillum 2").transmission.is_black());
    assert!(one("Kd 0.7\nTf 1 1 1\nd 1").transmission.is_black());
    // A filter (`Tf`) without a model (`illum`) is used; it refracts if `Ni` is given.
    let filter = one("Kd 0.3\nTf 0.5\nNi 1.5");
    assert!(filter.transmission == grey(0.5) && !filter.thin);
    // Opacity by `d`
    let holes = one("Kd 0.8\nd 0.25\nillum 2");
    assert_eq!((holes.diffuse, holes.opacity), (grey(0.8), 0.25));
    assert!(holes.transmission.is_black());
    let filter = one("Kd 0.8\nTf 0.5\nd 0.25\nillum 2");
    assert_eq!((filter.diffuse, filter.transmission), (grey(0.2), grey(0.375)));
    assert!(filter.thin && filter.ior == 1.0 && filter.opacity == 1.0);
}

#[test]
fn metal_and_roughness_use_the_metallic_model() {
    let metal = one("Kd 0.9 0.6 0.3\nKs 0.5\nNs 250\nNi 1.45\nPr 0.25\nPm 1\nillum 2");
    assert_eq!(
        (metal.gloss, metal.roughness, metal.ior),
        (Gloss::Metallic(1.0), 0.25, 1.45)
    );
    assert_eq!(
        (metal.diffuse, metal.specular),
        (Spectrum::rgb(0.9, 0.6, 0.3), Spectrum::ONE)
    );
    let plastic = one("Kd 0.5\nPr 0.5\nNi 1");
    assert_eq!(
        (plastic.gloss, plastic.roughness, plastic.ior),
        (Gloss::Metallic(0.0), 0.5, DEFAULT_IOR)
    );
    let mapped = one("Kd 0.5\nmap_Pr r.png\nmap_Pm m.png");
    assert_eq!((mapped.gloss, mapped.roughness), (Gloss::Metallic(1.0), 1.0));
    let glass = one("Tf 1\nNi 1.5\nPr 0.3\nillum 7");
    assert_eq!((glass.roughness, glass.transmission), (0.3, Spectrum::ONE));
    assert_eq!(glass.gloss, Gloss::Mirror(Fresnel::Full));
}

#[test]
fn plain_materials_are_grey_and_lamps_black() {
    assert_eq!(one("").diffuse, Spectrum::splat(DEFAULT_DIFFUSE));
    assert_eq!(one("Ke 1").diffuse, Spectrum::ZERO);
    assert_eq!(one("Ke 0 0 0").diffuse, Spectrum::splat(DEFAULT_DIFFUSE));
}

#[test]
fn statement_without_effect_is_a_warning() {
    let (_, warnings) = load("newmtl a\ndecal a.png\nrefl r.png\nnewmtl b\ndecal b.png\nd 0.5\nTr 0.9\n").unwrap();
    assert!(
        warnings[0].contains("t.mtl:3: `refl` has no effect: reflections are computed"),
        "{warnings:?}"
    );
    assert!(
        warnings[1].contains(
            "t.mtl:2: 2 statements `decal` have no effect, the first in this line: pictures do not replace the material"
        ),
        "{warnings:?}"
    );
    assert!(
        warnings[2].contains("material `b`: d is 0.5 but Tr is 0.9"),
        "{warnings:?}"
    );
}

#[test]
fn meaning_of_tr_depends_on_the_dialect() {
    let opacity = |dialect, text: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.mtl");
        std::fs::write(&path, text).unwrap();
        let options = LibraryOptions {
            dialect,
            ..LibraryOptions::default()
        };
        let (materials, warnings) = load_file(&path, options).unwrap();
        (materials[0].material.opacity, warnings.len())
    };
    use MtlDialect::*;
    let both = "newmtl m\nKd 1\nd 0.75\nTr 0.5\n";
    for (dialect, text, expected) in [
        (Spec, both, (0.75, 1)),
        (Blender, both, (0.75, 1)),
        (Max, both, (0.5, 1)),
        (Meshlab, both, (0.75, 1)),
        (Auto, both, (0.75, 1)),
        // `Tr` without `d`
        (Spec, "newmtl m\nTr 0.25\n", (0.75, 0)),
        (Max, "newmtl m\nTr 0.25\n", (0.75, 0)),
        (Meshlab, "newmtl m\nTr 0.25\n", (0.25, 0)),
        (Auto, "newmtl m\nTr 0.25\n", (0.75, 0)),
        (
            Auto,
            "# Wavefront material file\n# Converted by VCGLIB\nnewmtl m\nTr 0.25\n",
            (0.25, 1),
        ),
        // If `d` and `Tr` agree in the literal reading, the literal reading is used.
        (Auto, "newmtl m\nd 0.25\nTr 0.75\n", (0.25, 0)),
        (Auto, "newmtl m\nd 0.25\nTr 0.25\n", (0.25, 0)),
        (Auto, "newmtl m\nd 1\nTr 1\n", (1.0, 0)),
        (Auto, "newmtl m\nTr 1\nnewmtl n\nTr 1\n", (1.0, 1)),
        (Spec, "newmtl m\nTr 1\nnewmtl n\nTr 1\n", (0.0, 0)),
    ] {
        assert_eq!(opacity(dialect, text), expected, "{dialect:?}: {text:?}");
    }
}

#[test]
fn texture_statements_become_requests() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.mtl");
    std::fs::write(
        &path,
        "newmtl a\nKd 0 0 0\nmap_Kd a.png\nMAP_KD -s 2 2 b c.png\nbump d.png\nmap_Ks e.png\n",
    )
    .unwrap();
    let (materials, warnings) = load_file(&path, LibraryOptions::default()).unwrap();
    let maps: Vec<_> = materials[0]
        .maps
        .iter()
        .map(|m| (m.statement.slot, m.statement.file.as_str(), m.place.position))
        .collect();
    let expected = [
        (MapSlot::Diffuse, "b c.png", Some(Position::line(4))),
        (MapSlot::Bump, "d.png", Some(Position::line(5))),
        (MapSlot::Specular, "e.png", Some(Position::line(6))),
    ];
    assert_eq!(maps, expected);
    assert_eq!(
        (materials[0].material.diffuse, materials[0].material.specular),
        (Spectrum::ONE, Spectrum::ONE)
    );
    assert!(warnings[0].contains("Kd is 0"), "{warnings:?}");
}

#[test]
fn layers_and_brushes_are_read() {
    let lacquer = one("Kd 0.5\nPr 0.25\nPm 1\nPc 0.75\nPcr 0.125\nPs 0.5\naniso 0.5\nanisor 0.25");
    assert_eq!((lacquer.clearcoat, lacquer.clearcoat_roughness), (0.75, 0.125));
    assert_eq!(lacquer.sheen, Spectrum::splat(0.5));
    assert_eq!((lacquer.anisotropy, lacquer.anisotropy_rotation), (0.5, 90.0));
    let (materials, warnings) = load("newmtl m\nKd 1\nPc 1\naniso 0.5").unwrap();
    assert_eq!((materials[0].clearcoat, materials[0].anisotropy), (1.0, 0.0));
    assert!(warnings[0].contains("aniso has no effect"), "{warnings:?}");
}

#[test]
fn emission_texture_makes_default_diffuse_black() {
    let glowing = one("map_Ke a.png");
    assert_eq!((glowing.diffuse, glowing.emission), (Spectrum::ZERO, Spectrum::ZERO));
    assert_eq!(one("Ke 2\nmap_Ke a.png").emission, Spectrum::splat(2.0));
    let (_, warnings) = load("newmtl m\nKe 0 0 0\nmap_Ke a.png").unwrap();
    assert!(warnings[0].contains("Ke is 0"), "{warnings:?}");
}

/// Each number without effect has a warning at its line. Reasons are the illumination model, the
/// opacity, and a sum of the scattered light above 1.
#[test]
fn number_without_effect_is_a_warning() {
    let cases = [
        (
            "Kd 0.7\nKs 0.2\nTf 0.3\nillum 2",
            "t.mtl:4: material `m`: Tf has no effect: Kd + Ks + Tf is 1.2",
        ),
        (
            "Kd 0.7\nTf 0.3\nd 1\nillum 2",
            "t.mtl:3: material `m`: Tf has no effect: d or Tr",
        ),
        (
            "Ks 0.7\nTf 0.3\nillum 3",
            "t.mtl:3: material `m`: Tf has no effect with illum 3",
        ),
        (
            "Tf 0.3\nd 0.5\nNi 1.5\nillum 6",
            "t.mtl:3: material `m`: d has no effect with illum 6",
        ),
        (
            "Kd 0.5\nKs 0.4\nNs 9\nillum 1",
            "t.mtl:3: material `m`: Ks has no effect: illum 1",
        ),
        (
            "Kd 0.5\nKs 0.4\nPr 0.5",
            "t.mtl:3: material `m`: Ks has no effect with Pr",
        ),
        (
            "Ks 0.4\nNs 9\nillum 5",
            "t.mtl:3: material `m`: Ns has no effect: with illum 5",
        ),
        (
            "Ks 0.4\nNs 9\nTf 0.5\nNi 1.5\nillum 7",
            "t.mtl:3: material `m`: Ns has no effect: with illum 7",
        ),
        ("Tf 1\nNi 1.5\nPm 1\nillum 7", "t.mtl:4: material `m`: Pm has no effect"),
        ("Kd 0.5\nPcr 0.5", "t.mtl:3: material `m`: Pcr has no effect"),
        (
            "Kd 0.5\nPr 0.5\nanisor 0.5",
            "t.mtl:4: material `m`: anisor has no effect",
        ),
    ];
    for (text, expected) in cases {
        let (_, warnings) = load(&format!("newmtl m\n{text}")).unwrap();
        assert!(
            warnings.len() == 1 && warnings[0].contains(expected),
            "{text}: {warnings:?}"
        );
    }
    // Default statements of exporters, and mixtures, have no warnings.
    for text in [
        "Kd 0.7\nKs 0.2\nNs 30\nTf 0.1\nillum 2",
        "Kd 0.7\nTf 1 1 1\nd 1\nNi 1.5\nNs 10\nKs 0\nillum 2",
        "Ks 0.95\nNs 1000\nillum 5",
        "Kd 0.3\nKs 0.2\nNs 30\nTf 0.4\nNi 1.5\nillum 6",
    ] {
        let (_, warnings) = load(&format!("newmtl m\n{text}")).unwrap();
        assert!(warnings.is_empty(), "{text}: {warnings:?}");
    }
}

/// Statements with a wrong value, and the statements that replace them, if any.
const WRONG: [(&str, &str); 23] = [
    ("Kd 0.5 red 0", ""),
    ("Kd 1 2", ""),
    ("Ke -1 0 2", "Ke 0 0 2"),
    ("Kd 1 0.5 0 0.25", "Kd 1 0.5 0\nd 0.25"),
    ("Kd 1 0.5 0 0.5\nd 0.5", "Kd 1 0.5 0\nd 0.25"),
    ("Kd 1 0.5 0 9", "Kd 1 0.5 0"),
    ("Ks nan", ""),
    ("Kd", ""),
    ("Ns -1.960784\nKs 0.5", "Ns 0\nKs 0.5"),
    ("Ns nan\nKs 0.5", "Ks 0.5"),
    ("Ni -1", ""),
    ("Ni", ""),
    ("d 1.000001", "d 1"),
    ("Tr -0.1", "Tr 0"),
    ("Pr 2", "Pr 1"),
    ("Pm x", ""),
    ("Pc 2", "Pc 1"),
    ("Pcr -1\nPc 1", "Pcr 0\nPc 1"),
    ("Ps 1.5", "Ps 1"),
    ("aniso -0.5\nPr 1", "Pr 1"),
    ("illum 2.0\nKs 0.5", "illum 2\nKs 0.5"),
    ("Tf xyz 1 1", ""),
    ("map_Kd", ""),
];

/// In the XYZ of the format, white is 1 1 1.
#[test]
fn colors_may_be_cie_xyz() {
    for (xyz, rgb) in [
        ("Kd xyz 0.25", "Kd 0.25"),
        ("Tf xyz 1 1 1\nillum 6", "Tf 1 1 1\nillum 6"),
        ("Ks xyz 0 1 0", "Ks 0 1 0"),
    ] {
        assert_eq!(one(xyz), one(rgb), "{xyz}");
    }
    let yellow = one("Kd xyz 0.8 0.9 0.1").diffuse.to_array();
    assert!(
        yellow[2] < 0.1 && yellow[1] > 0.9 && yellow.iter().all(|c| (0.0..=1.0).contains(c)),
        "{yellow:?}"
    );
    assert!(
        one("Ke xyz 9 10 2").emission.max_component() > 5.0,
        "radiance has no limit"
    );
    let (_, warnings) = load("newmtl m\nKd spectral a.rfl\n").unwrap();
    assert!(warnings[0].contains("it has no effect"), "{warnings:?}");
}

#[test]
fn wrong_value_becomes_nearest_value_or_is_ignored() {
    // If a wrong value has no nearest valid value, the value of an earlier statement is kept.
    let stay = [
        ("Ni 1.5\nNi -1\nillum 7", "Ni 1.5\nillum 7"),
        ("Kd 0.5\nKd 1 2", "Kd 0.5"),
    ];
    for (wrong, right) in WRONG.into_iter().chain(stay) {
        let (found, warnings) = load(&format!("newmtl m\nKa 1\n{wrong}\n")).unwrap();
        let (expected, others) = load(&format!("newmtl m\nKa 1\n{right}\n")).unwrap();
        assert_eq!(found, expected, "{wrong}");
        assert_eq!(warnings.len(), others.len() + 1, "{wrong}: {warnings:?}");
    }
}

#[test]
fn wrong_value_is_reported_with_its_line() {
    let strict = LibraryOptions {
        wrong_severity: Severity::Error,
        ..LibraryOptions::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.mtl");
    let more = ["anisor inf", "illum x", "Kd spectral a.rfl", "map_Kd -s a.png"];
    for statement in WRONG.iter().map(|(wrong, _)| *wrong).chain(more) {
        std::fs::write(&path, format!("newmtl m\nKa 1\n{statement}\n")).unwrap();
        let error = load_file(&path, strict).unwrap_err();
        assert_eq!(error.position.map(|p| p.line), Some(3), "{statement}: {error}");
        let key = statement.split(' ').next().unwrap();
        assert!(
            error.message.contains(key) && error.help.is_some(),
            "{statement}: {error}"
        );
    }
}

#[test]
fn lines_may_end_with_carriage_return_only() {
    let unix = load("newmtl m\nKd 0.8 0.1 0.1\nillum 1\n").unwrap();
    assert_eq!(load("newmtl m\rKd 0.8 0.1 0.1\rillum 1\r").unwrap(), unix);
    assert_eq!(load("newmtl m\r\nKd 0.8 0.1 0.1\r\nillum 1\r\n").unwrap(), unix);
}

#[test]
fn index_of_refraction_0_is_ignored() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mtl");
    std::fs::write(&path, "newmtl glass\nillum 7\nNi 0\n").unwrap();
    let mut findings = Findings::default();
    let materials = load_mtl(&path, &ObjContext::default(), LibraryOptions::default(), &mut findings);
    assert_eq!(materials[0].material.ior, section::DEFAULT_IOR);
    let warning = findings.iter().find(|f| f.severity == Severity::Warning).unwrap();
    assert!(
        warning.to_string().contains("a.mtl:3: warning: material `glass`: Ni 0"),
        "{warning}"
    );
}
