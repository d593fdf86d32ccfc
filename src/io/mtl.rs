use super::mtl_map::{MapSlot, MapStatement};
use super::statements::{split_keyword, statements};
use super::{FileError, Position};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::material::{Gloss, Material};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Diffuse reflectance of a surface whose material says nothing about it.
const DEFAULT_DIFFUSE: f32 = 0.8;
/// Phong exponent of a `Ks` without `Ns`.
const DEFAULT_EXPONENT: f32 = 10.0;
/// Index of refraction of glass without `Ni`.
const DEFAULT_IOR: f32 = 1.5;

/// The material of faces that have none.
pub(super) fn default_material(name: &str) -> Material {
    Material {
        name: name.into(),
        diffuse: Spectrum::splat(DEFAULT_DIFFUSE),
        ..Material::default()
    }
}

/// Where a library named in an OBJ file lies: relative to the OBJ's folder.
pub(super) fn library_path(obj: &Path, name: &str) -> PathBuf {
    obj.parent().unwrap_or(Path::new("")).join(name)
}

/// How a library means what the format leaves open: programs that write `Tr` disagree whether 1 is clear or solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MtlDialect {
    /// As the file itself suggests: [`MtlDialect::Meshlab`] where it says that VCGLIB or MeshLab wrote it, where `d` and `Tr` are equal but for
    /// 1/2, or where all its materials would be clear; else [`MtlDialect::Spec`].
    #[default]
    Auto,
    /// `d` is the share of the surface that is there; `Tr` is 1 − d, and counts where there is no `d`.
    Spec,
    /// The same, but `Tr` counts before `d`, which 3ds Max's exporters leave at 1.
    Max,
    /// As [`MtlDialect::Spec`]: Blender writes `d` alone.
    Blender,
    /// `Tr` is another word for `d`.
    Meshlab,
}

impl MtlDialect {
    /// Each by the name that users type, the default first.
    pub const NAMES: &[(&str, Self)] = &[
        ("auto", Self::Auto),
        ("spec", Self::Spec),
        ("max", Self::Max),
        ("blender", Self::Blender),
        ("meshlab", Self::Meshlab),
    ];

    /// What the library `text` means, whose materials are `sections`.
    fn resolve(self, text: &str, sections: &[Section]) -> Self {
        if self != Self::Auto {
            return self;
        }
        let names_meshlab = || {
            let comments = text.lines().filter(|line| line.trim_start().starts_with('#'));
            comments
                .map(str::to_lowercase)
                .any(|c| c.contains("meshlab") || c.contains("vcglib"))
        };
        let is_same = |s: &Section| match (s.dissolve, s.transparency) {
            (Some(d), Some(t)) => Some((d - t).abs() < 1e-3 && (d - 0.5).abs() > 1e-3),
            _ => None,
        };
        let pairs: Vec<bool> = sections.iter().filter_map(is_same).collect();
        let all_same = !pairs.is_empty() && pairs.iter().all(|&same| same);
        // A library in which nothing could be seen
        let all_clear = !sections.is_empty()
            && sections
                .iter()
                .all(|s| s.dissolve.is_none() && s.transparency == Some(1.0));
        match names_meshlab() || all_same || all_clear {
            true => Self::Meshlab,
            false => Self::Spec,
        }
    }
}

/// A material of a library, and the textures it asks for.
#[derive(Clone, Debug)]
pub(super) struct MtlMaterial {
    pub material: Material,
    pub maps: Vec<MapRequest>,
}

/// A texture statement and where it stands.
#[derive(Clone, Debug)]
pub(super) struct MapRequest {
    pub statement: MapStatement,
    pub library: PathBuf,
    pub line: usize,
}

impl MapRequest {
    /// Says of the texture what is worth a warning.
    pub fn remark(&self, words: &str) -> FileError {
        let message = format!("texture `{}` {words}", self.statement.file);
        FileError::new(&self.library, message).at(Position::line(self.line))
    }
}

/// The materials of an MTL file in its order, and what of it has no effect.
pub(super) fn load_mtl(path: &Path, dialect: MtlDialect) -> Result<(Vec<MtlMaterial>, Vec<String>), FileError> {
    let bytes = std::fs::read(path).map_err(|e| FileError::system(path, "cannot read the material library", &e))?;
    let text = String::from_utf8_lossy(&bytes);
    let mut sections: Vec<Section> = Vec::new();
    let mut skipped: Vec<(String, usize)> = Vec::new();
    let mut unknown: HashSet<String> = HashSet::new();
    for (line, statement) in statements(&text) {
        let (key, rest) = split_keyword(&statement);
        if key.eq_ignore_ascii_case("newmtl") {
            sections.push(Section::new(rest));
            continue;
        }
        // Statements before the first material belong to none.
        let Some(section) = sections.last_mut() else { continue };
        let wrong = |(message, help): Complaint, name: &str| {
            let place = FileError::new(path, format!("material `{name}`: {message}"));
            place.at(Position::line(line)).help(help)
        };
        let lower = key.to_ascii_lowercase();
        if let Some(slot) = MapSlot::of_keyword(&lower) {
            let parsed = MapStatement::parse(slot, rest);
            let help = "options come first, then the name of a picture: map_Kd -s 2 2 wall.png";
            let statement = parsed.map_err(|e| wrong((format!("{key}: {e}"), help), &section.name))?;
            skipped.extend(statement.ignored.iter().map(|option| (option.to_string(), line)));
            // The last one of a kind wins.
            section.maps.retain(|m| m.statement.slot != slot);
            section.maps.push(MapRequest {
                statement,
                library: path.to_path_buf(),
                line,
            });
            continue;
        }
        let known = section.set(&lower, key, rest).map_err(|c| wrong(c, &section.name))?;
        if !known && unknown.insert(key.to_string()) {
            skipped.push((key.to_string(), line));
        }
    }

    let mut warnings = Vec::new();
    if let Some((_, line)) = skipped.first() {
        let keys: Vec<&str> = skipped.iter().map(|(key, _)| key.as_str()).collect();
        let message = format!("no effect: {}; the first is here", keys.join(", "));
        warnings.push(FileError::new(path, message).at(Position::line(*line)).to_string());
    }
    let resolved = dialect.resolve(&text, &sections);
    let materials = sections.into_iter().map(|section| {
        let (material, remarks) = section.material(resolved);
        let name = &section.name;
        let remarks = remarks.into_iter();
        warnings.extend(remarks.map(|words| format!("{}: material `{name}`: {words}", path.display())));
        MtlMaterial {
            material,
            maps: section.maps,
        }
    });
    let materials = materials.collect();
    Ok((materials, warnings))
}

/// What an MTL file says of one material.
#[derive(Default)]
struct Section {
    name: String,
    diffuse: Option<Spectrum>,
    specular: Option<Spectrum>,
    emission: Option<Spectrum>,
    filter: Option<Spectrum>,
    exponent: Option<f32>,
    ior: Option<f32>,
    dissolve: Option<f32>,
    transparency: Option<f32>,
    roughness: Option<f32>,
    metallic: Option<f32>,
    illum: Option<u32>,
    maps: Vec<MapRequest>,
}

/// What is wrong, and the remedy.
type Complaint = (String, &'static str);

impl Section {
    fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            ..Self::default()
        }
    }

    /// Takes a statement, whose keyword is given in lower case too; whether it has an effect.
    fn set(&mut self, lower: &str, key: &str, rest: &str) -> Result<bool, Complaint> {
        match lower {
            "kd" => self.diffuse = Some(color(key, rest)?),
            "ks" => self.specular = Some(color(key, rest)?),
            "ke" => self.emission = Some(color(key, rest)?),
            "tf" => self.filter = Some(color(key, rest)?),
            "ns" => self.exponent = Some(number(key, rest, |n| n >= 0.0, "write a finite number, 0 or more")?),
            "ni" => self.ior = Some(number(key, rest, |n| n > 0.0, "write a finite number above 0")?),
            "d" => self.dissolve = Some(number(key, rest, is_share, "write a number from 0 to 1")?),
            "tr" => self.transparency = Some(number(key, rest, is_share, "write a number from 0 to 1")?),
            "pr" => self.roughness = Some(number(key, rest, is_share, "write a number from 0 to 1")?),
            "pm" => self.metallic = Some(number(key, rest, is_share, "write a number from 0 to 1")?),
            "illum" => {
                let model = rest.parse().ok().filter(|&n: &u32| n <= 10);
                let complaint = || {
                    (
                        format!("illum `{rest}` is no illumination model"),
                        "write a number from 0 to 10",
                    )
                };
                self.illum = Some(model.ok_or_else(complaint)?);
            }
            // Ambient light is what path tracing computes; sharpness is of reflection maps.
            "ka" | "map_ka" | "sharpness" => {}
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn has_map(&self, slot: MapSlot) -> bool {
        self.maps.iter().any(|m| m.statement.slot == slot)
    }

    /// The factor of a colour: where a texture gives it, a factor that is missing or black would leave nothing of it.
    fn color(
        &self,
        key: &str,
        given: Option<Spectrum>,
        slot: MapSlot,
        default: f32,
        remarks: &mut Vec<String>,
    ) -> Spectrum {
        match (given, self.has_map(slot)) {
            (Some(color), true) if color.is_black() => {
                remarks.push(format!(
                    "{key} is 0 and would make its texture black; the texture counts alone"
                ));
                Spectrum::ONE
            }
            (None, true) => Spectrum::ONE,
            (given, _) => given.unwrap_or(Spectrum::splat(default)),
        }
    }

    /// The factor of a number: 1 where a texture gives it alone.
    fn factor(&self, given: Option<f32>, slot: MapSlot, default: f32) -> f32 {
        given.unwrap_or(if self.has_map(slot) { 1.0 } else { default })
    }

    /// The share of the surface that is there, as `dialect` has it.
    fn opacity(&self, dialect: MtlDialect, remarks: &mut Vec<String>) -> f32 {
        let of_tr = |t: f32| match dialect {
            MtlDialect::Meshlab => t,
            _ => 1.0 - t,
        };
        let (d, tr) = (self.dissolve, self.transparency.map(of_tr));
        let (counts, word, other) = match dialect {
            MtlDialect::Max => (tr.or(d), "Tr", d),
            _ => (d.or(tr), "d", tr),
        };
        let opacity = counts.unwrap_or(1.0);
        if let (Some(other), Some(d), Some(t)) = (other, self.dissolve, self.transparency) {
            if (other - opacity).abs() > 1e-3 {
                remarks.push(format!(
                    "d is {d} but Tr is {t}; {word} counts (--mtl-dialect says how `Tr` is meant)"
                ));
            }
        }
        opacity
    }

    /// The material, and what of it was assumed.
    fn material(&self, dialect: MtlDialect) -> (Material, Vec<String>) {
        let mut remarks = Vec::new();
        // A material that names any colour means the others to be black; one that names none is a plain surface.
        let emission = self.emission.unwrap_or(Spectrum::ZERO);
        let names_a_color = self.specular.is_some() || self.filter.is_some() || !emission.is_black();
        let plain = if names_a_color { 0.0 } else { DEFAULT_DIFFUSE };
        let mut material = Material {
            name: self.name.clone(),
            diffuse: self.color("Kd", self.diffuse, MapSlot::Diffuse, plain, &mut remarks),
            specular: self.color("Ks", self.specular, MapSlot::Specular, 0.0, &mut remarks),
            gloss: Gloss::Phong(self.exponent.unwrap_or(DEFAULT_EXPONENT)),
            emission,
            ..Material::default()
        };
        match self.illum {
            // Models without highlights
            Some(0 | 1) => material.specular = Spectrum::ZERO,
            Some(3 | 5) => material.gloss = Gloss::Mirror(Fresnel::Full),
            _ => {}
        }

        // The extension for metal and roughness has a model of its own; glass is only roughened.
        material.roughness = self.factor(self.roughness, MapSlot::Roughness, 0.0);
        let is_physical = self.roughness.is_some()
            || self.metallic.is_some()
            || self.has_map(MapSlot::Roughness)
            || self.has_map(MapSlot::Metallic);
        if is_physical && !matches!(self.illum, Some(4 | 6 | 7)) {
            let metallic = self.factor(self.metallic, MapSlot::Metallic, 0.0);
            material.gloss = Gloss::Metallic(metallic);
            material.specular = Spectrum::ONE;
            material.ior = self.ior.filter(|&n| n > 1.0).unwrap_or(DEFAULT_IOR);
        }

        let opacity = self.opacity(dialect, &mut remarks);
        match self.illum {
            // Glass; its reflection is Fresnel's, and Ks adds to that where there is energy left.
            Some(4 | 6 | 7) => {
                let dissolved = (opacity < 1.0).then(|| Spectrum::splat(1.0 - opacity));
                material.transmission = self.filter.or(dissolved).unwrap_or(Spectrum::ONE);
                material.ior = self.ior.unwrap_or(DEFAULT_IOR);
                material.gloss = Gloss::Mirror(Fresnel::Full);
                let all = material.diffuse + material.specular + material.transmission;
                if !material.specular.is_black() && all.max_component() > 1.0 {
                    material.specular = Spectrum::ZERO;
                    remarks.push("glass reflects by its index of refraction; Ks is left out".into());
                }
            }
            // A coloured veil: part of the light goes straight on, tinted.
            _ if opacity < 1.0 && self.filter.is_some_and(|filter| filter != Spectrum::ONE) => {
                material.diffuse *= opacity;
                material.specular *= opacity;
                let filter = self.filter.unwrap_or(Spectrum::ONE);
                material.transmission = filter * (1.0 - opacity);
                (material.thin, material.ior) = (true, 1.0);
            }
            // A filter alone, where no model and no opacity calls the surface opaque
            None if self.dissolve.is_none() && self.transparency.is_none() => {
                if let Some(filter) = self.filter {
                    material.transmission = filter;
                    (material.thin, material.ior) = self.ior.map_or((true, 1.0), |ior| (false, ior));
                }
            }
            // A surface with holes
            _ => material.opacity = opacity,
        }
        (material, remarks)
    }
}

fn is_share(n: f32) -> bool {
    (0.0..=1.0).contains(&n)
}

/// The last word as a number; options like `-halo` may come before it.
fn number(key: &str, rest: &str, is_good: fn(f32) -> bool, help: &'static str) -> Result<f32, Complaint> {
    let value: Option<f32> = rest.split_whitespace().next_back().and_then(|word| word.parse().ok());
    let good = value.filter(|&n| n.is_finite() && is_good(n));
    good.ok_or_else(|| (format!("{key} is `{rest}`"), help))
}

/// One number for a grey, or three.
fn color(key: &str, rest: &str) -> Result<Spectrum, Complaint> {
    let values: Option<Vec<f32>> = rest.split_whitespace().map(|word| word.parse().ok()).collect();
    let color = match values.as_deref() {
        Some(&[grey]) => Some(Spectrum::splat(grey)),
        Some(&[r, g, b]) => Some(Spectrum::rgb(r, g, b)),
        _ => None,
    };
    let help = "write one number or three, finite and 0 or more";
    let good = color.filter(|c| c.is_valid());
    good.ok_or_else(|| (format!("{key} is `{rest}`, which is no colour"), help))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(text: &str) -> Result<(Vec<Material>, Vec<String>), FileError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.mtl");
        std::fs::write(&path, text).unwrap();
        load_mtl(&path, MtlDialect::Auto).map(|(materials, warnings)| {
            let materials = materials.into_iter().map(|m| m.material);
            (materials.collect(), warnings)
        })
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
        // A file that leaves energy for Ks keeps it.
        assert_eq!(one("Kd 0\nKs 0.3\nTf 0.1\nillum 7").specular, grey(0.3));
        // Exporters write a filter of 1 for opaque surfaces.
        assert!(one("Kd 0.7\nTf 1 1 1\nillum 2").transmission.is_black());
        assert!(one("Kd 0.7\nTf 1 1 1\nd 1").transmission.is_black());
        // A filter alone counts; with an index it refracts.
        let filter = one("Kd 0.3\nTf 0.5\nNi 1.5");
        assert!(filter.transmission == grey(0.5) && !filter.thin);
        // Dissolving
        let holes = one("Kd 0.8\nd 0.25\nillum 2");
        assert_eq!((holes.diffuse, holes.opacity), (grey(0.8), 0.25));
        assert!(holes.transmission.is_black());
        let veil = one("Kd 0.8\nTf 0.5\nd 0.25\nillum 2");
        assert_eq!((veil.diffuse, veil.transmission), (grey(0.2), grey(0.375)));
        assert!(veil.thin && veil.ior == 1.0 && veil.opacity == 1.0);
    }

    #[test]
    fn metal_and_roughness_have_a_model_of_their_own() {
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
    fn what_has_no_effect_is_said() {
        let (_, warnings) = load("newmtl a\ndisp a.png\nrefl r.png\nnewmtl b\ndisp b.png\nd 0.5\nTr 0.9\n").unwrap();
        assert!(warnings[0].contains("t.mtl:2: no effect: disp, refl;"), "{warnings:?}");
        assert!(
            warnings[1].contains("material `b`: d is 0.5 but Tr is 0.9"),
            "{warnings:?}"
        );
    }

    #[test]
    fn transparency_goes_by_dialect() {
        let opacity = |dialect, text: &str| {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("t.mtl");
            std::fs::write(&path, text).unwrap();
            let (materials, warnings) = load_mtl(&path, dialect).unwrap();
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
            // Alone
            (Spec, "newmtl m\nTr 0.25\n", (0.75, 0)),
            (Max, "newmtl m\nTr 0.25\n", (0.75, 0)),
            (Meshlab, "newmtl m\nTr 0.25\n", (0.25, 0)),
            (Auto, "newmtl m\nTr 0.25\n", (0.75, 0)),
            (
                Auto,
                "# Wavefront material file\n# Converted by VCGLIB\nnewmtl m\nTr 0.25\n",
                (0.25, 0),
            ),
            // What says the same twice is meant so.
            (Auto, "newmtl m\nd 0.25\nTr 0.75\n", (0.25, 0)),
            (Auto, "newmtl m\nd 0.25\nTr 0.25\n", (0.25, 0)),
            (Auto, "newmtl m\nd 1\nTr 1\n", (1.0, 0)),
            (Auto, "newmtl m\nTr 1\nnewmtl n\nTr 1\n", (1.0, 0)),
            (Spec, "newmtl m\nTr 1\nnewmtl n\nTr 1\n", (0.0, 0)),
        ] {
            assert_eq!(opacity(dialect, text), expected, "{dialect:?}: {text:?}");
        }
    }

    #[test]
    fn textures_are_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.mtl");
        std::fs::write(
            &path,
            "newmtl a\nKd 0 0 0\nmap_Kd a.png\nMAP_KD -s 2 2 b c.png\nbump d.png\nmap_Ks e.png\n",
        )
        .unwrap();
        let (materials, warnings) = load_mtl(&path, MtlDialect::Auto).unwrap();
        let maps: Vec<_> = materials[0]
            .maps
            .iter()
            .map(|m| (m.statement.slot, m.statement.file.as_str(), m.line))
            .collect();
        let expected = [
            (MapSlot::Diffuse, "b c.png", 4),
            (MapSlot::Bump, "d.png", 5),
            (MapSlot::Specular, "e.png", 6),
        ];
        assert_eq!(maps, expected);
        assert_eq!(
            (materials[0].material.diffuse, materials[0].material.specular),
            (Spectrum::ONE, Spectrum::ONE)
        );
        assert!(warnings[0].contains("Kd is 0"), "{warnings:?}");
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let cases = [
            "Kd 0.5 red 0",
            "Kd 1 2",
            "Ke -1 0 0",
            "Ks nan",
            "Kd",
            "Ns -1",
            "Ni 0",
            "Ni",
            "d 1.5",
            "Tr -0.1",
            "Pr 2",
            "Pm x",
            "illum x",
            "Kd spectral a.rfl",
            "map_Kd",
            "map_Kd -s a.png",
        ];
        for statement in cases {
            let error = load(&format!("newmtl m\nKa 1\n{statement}\n")).unwrap_err();
            assert_eq!(error.position.map(|p| p.line), Some(3), "{statement}: {error}");
            let key = statement.split(' ').next().unwrap();
            assert!(
                error.message.contains(key) && error.help.is_some(),
                "{statement}: {error}"
            );
        }
    }
}
