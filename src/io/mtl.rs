use super::mtl_map::{MapSlot, MapStatement};
use super::statements::{place_of, split_keyword, statements};
use super::{FileError, Finding, Findings, MAX_WRONG, Position, Severity};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::material::{Gloss, Material};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Diffuse reflectance of a surface whose material says nothing about it.
const DEFAULT_DIFFUSE: f32 = 0.8;
/// Phong exponent of a `Ks` without `Ns`.
const DEFAULT_EXPONENT: f32 = 10.0;
/// Where the format's range of `Ns` ends.
const MOST_EXPONENT: f32 = 1000.0;
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

/// A material of a file, and the textures it asks for.
#[derive(Clone, Debug)]
pub(super) struct FileMaterial {
    pub material: Material,
    pub maps: Vec<MapRequest>,
    pub library: PathBuf,
    /// Of its `newmtl`.
    pub line: usize,
}

/// A texture statement.
#[derive(Clone, Debug)]
pub(super) struct MapRequest {
    pub statement: MapStatement,
    /// Where it stands: an error without a message.
    pub place: FileError,
}

impl MapRequest {
    /// Says of the texture what is worth a warning.
    pub fn remark(&self, words: &str) -> FileError {
        let message = format!("texture `{}` {words}", self.statement.file);
        FileError {
            message,
            ..self.place.clone()
        }
    }
}

/// The materials of an MTL file in its order. Statements that are wrong are left out.
pub(super) fn load_mtl(path: &Path, dialect: MtlDialect, findings: &mut Findings) -> Vec<FileMaterial> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) => {
            let error = FileError::system(path, "cannot read the material library", &error);
            findings.add(Severity::Error, "unreadable-file", error.help("check who may read it"));
            return Vec::new();
        }
    };
    let text = String::from_utf8_lossy(&bytes);
    let mut sections: Vec<Section> = Vec::new();
    let mut skipped: Vec<(String, usize)> = Vec::new();
    let mut wrong_count = 0;
    let mut unknown: HashSet<String> = HashSet::new();
    for (line, statement) in statements(&text) {
        let (key, rest) = split_keyword(&statement);
        if key.eq_ignore_ascii_case("newmtl") {
            sections.push(Section::new(rest, line));
            continue;
        }
        // Statements before the first material belong to none.
        let Some(section) = sections.last_mut() else { continue };
        let mut wrong = |(message, help): Complaint, name: &str| {
            wrong_count += 1;
            if wrong_count > MAX_WRONG {
                return;
            }
            let error = FileError::new(path, format!("material `{name}`: {message}"));
            let error = error.at(place_of(&text, line, suspect(key, rest))).help(help);
            findings.add(Severity::Error, "wrong-statement", error);
        };
        let lower = key.to_ascii_lowercase();
        if let Some(slot) = MapSlot::of_keyword(&lower) {
            let statement = match MapStatement::parse(slot, rest) {
                Ok(statement) => statement,
                Err(message) => {
                    let help = "options come first, then the name of a picture: map_Kd -s 2 2 wall.png";
                    wrong((format!("{key}: {message}"), help), &section.name);
                    continue;
                }
            };
            skipped.extend(statement.ignored.iter().map(|option| (option.to_string(), line)));
            // The last one of a kind wins.
            section.maps.retain(|m| m.statement.slot != slot);
            section.maps.push(MapRequest {
                statement,
                place: FileError::new(path, "").at(Position::line(line)),
            });
            continue;
        }
        match section.set(&lower, key, rest) {
            Ok(true) => section.lines.push((lower, line)),
            Ok(false) if unknown.insert(key.to_string()) => skipped.push((key.to_string(), line)),
            Ok(false) => {}
            Err(complaint) => wrong(complaint, &section.name),
        }
    }

    findings.add_untold(path, wrong_count.saturating_sub(MAX_WRONG));

    if let Some((first, line)) = skipped.first() {
        let keys: Vec<&str> = skipped.iter().map(|(key, _)| key.as_str()).collect();
        let message = format!("no effect: {}; the first is here", keys.join(", "));
        let error = FileError::new(path, message).at(place_of(&text, *line, first));
        let others = skipped.iter().skip(1).map(|&(_, line)| Position::line(line));
        let finding = Finding::new(Severity::Warning, "unknown-keyword", error);
        findings.push(finding.repeated(skipped.len() as u64, others));
    }
    let resolved = dialect.resolve(&text, &sections);
    let materials = sections.into_iter().map(|section| {
        let (material, remarks) = section.material(resolved);
        for remark in remarks.into_iter().chain(section.assumed()) {
            let message = format!("material `{}`: {}", section.name, remark.words);
            let error = FileError::new(path, message).at(Position::line(section.line_of(remark.key)));
            findings.add(remark.severity, remark.code, error);
        }
        FileMaterial {
            material,
            maps: section.maps,
            library: path.to_path_buf(),
            line: section.line,
        }
    });
    materials.collect()
}

/// Of a statement that is wrong the word that likely is: the first that is no number, or all there is.
fn suspect<'a>(key: &'a str, rest: &'a str) -> &'a str {
    let is_number = |word: &&str| word.parse().is_ok_and(|n: f32| n.is_finite() && n >= 0.0);
    let mut words = rest.split_whitespace();
    let wrong = words.clone().find(|word| !is_number(word));
    wrong.or_else(|| words.next()).unwrap_or(key)
}

/// Something about a material.
struct Remark {
    severity: Severity,
    code: &'static str,
    /// The keyword it is about, in lower case.
    key: &'static str,
    words: String,
}

impl Remark {
    fn warning(code: &'static str, key: &'static str, words: impl Into<String>) -> Self {
        Self {
            severity: Severity::Warning,
            code,
            key,
            words: words.into(),
        }
    }
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
    clearcoat: f32,
    clearcoat_roughness: f32,
    sheen: f32,
    anisotropy: f32,
    /// Of a whole turn.
    anisotropy_rotation: f32,
    illum: Option<u32>,
    maps: Vec<MapRequest>,
    /// Of its `newmtl`.
    line: usize,
    /// Lines of its statements, by keyword in lower case.
    lines: Vec<(String, usize)>,
}

/// What is wrong, and the remedy.
type Complaint = (String, &'static str);

impl Section {
    fn new(name: &str, line: usize) -> Self {
        Self {
            name: name.into(),
            line,
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
            "pc" => self.clearcoat = number(key, rest, is_share, "write a number from 0 to 1")?,
            "pcr" => self.clearcoat_roughness = number(key, rest, is_share, "write a number from 0 to 1")?,
            "ps" => self.sheen = number(key, rest, is_share, "write a number from 0 to 1")?,
            "aniso" => self.anisotropy = number(key, rest, is_share, "write a number from 0 to 1")?,
            "anisor" => {
                self.anisotropy_rotation = number(key, rest, |_| true, "write a share of a whole turn")?;
            }
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

    /// The line of the last statement with this keyword, else that of the material.
    fn line_of(&self, key: &str) -> usize {
        let found = self.lines.iter().rev().find(|(k, _)| k == key);
        found.map_or(self.line, |&(_, line)| line)
    }

    /// What is taken in some way though the file says it otherwise, or not at all.
    fn assumed(&self) -> Vec<Remark> {
        let mut notes = Vec::new();
        let mut note = |code, key, words: String| {
            let severity = Severity::Note;
            let note = Remark {
                severity,
                code,
                key,
                words,
            };
            notes.push(note);
        };
        let shines = self.specular.is_some_and(|ks| !ks.is_black()) || self.has_map(MapSlot::Specular);
        let emits = self.emission.is_some_and(|ke| !ke.is_black());
        let has_holes = self.has_map(MapSlot::Opacity) || self.dissolve.is_some_and(|d| d < 1.0);
        if emits && has_holes {
            note(
                "opacity",
                "d",
                "what emits has no holes: d and map_d have no effect".into(),
            );
        }
        if let Some(ns) = self.exponent.filter(|&ns| ns > MOST_EXPONENT) {
            let words = format!("Ns is {ns}, beyond the {MOST_EXPONENT} of the format; it is taken as it is");
            note("exponent-range", "ns", words);
        }
        match self.illum {
            Some(model @ (0 | 1)) if shines => {
                note(
                    "illum",
                    "illum",
                    format!("illum {model} has no highlight: Ks has no effect"),
                );
            }
            Some(model @ (3 | 5)) if !shines => {
                note(
                    "illum",
                    "illum",
                    format!("illum {model} is a mirror, but there is no Ks: it is black"),
                );
            }
            Some(model @ (4 | 6 | 7)) => {
                if self.filter.is_none() && self.dissolve.is_none() && self.transparency.is_none() {
                    note(
                        "illum",
                        "illum",
                        format!("illum {model} is glass, but there is no Tf: it is clear"),
                    );
                }
                if self.ior.is_none() {
                    let words = format!("illum {model} is glass, but there is no Ni: it is {DEFAULT_IOR}");
                    note("illum", "illum", words);
                }
            }
            _ if shines && self.exponent.is_none() && !self.has_map(MapSlot::Exponent) => {
                note(
                    "default-exponent",
                    "ks",
                    format!("Ks without Ns: it is {DEFAULT_EXPONENT}"),
                );
            }
            _ => {}
        }
        notes
    }

    fn has_map(&self, slot: MapSlot) -> bool {
        self.maps.iter().any(|m| m.statement.slot == slot)
    }

    /// The factor of a colour: where a texture gives it, a factor that is missing or black would leave nothing of it.
    fn color(
        &self,
        [key, lower]: [&'static str; 2],
        given: Option<Spectrum>,
        slot: MapSlot,
        default: f32,
        remarks: &mut Vec<Remark>,
    ) -> Spectrum {
        match (given, self.has_map(slot)) {
            (Some(color), true) if color.is_black() => {
                remarks.push(Remark::warning("black-texture", lower, counts_alone(key)));
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
    fn opacity(&self, dialect: MtlDialect, remarks: &mut Vec<Remark>) -> f32 {
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
                let words = format!("d is {d} but Tr is {t}; {word} counts (--mtl-dialect says how `Tr` is meant)");
                remarks.push(Remark::warning("opacity", "tr", words));
            }
        }
        opacity
    }

    /// The material, and what of it was assumed.
    fn material(&self, dialect: MtlDialect) -> (Material, Vec<Remark>) {
        let mut remarks = Vec::new();
        // A material that names any colour means the others to be black; one that names none is a plain surface.
        let emission = self.emission.unwrap_or(Spectrum::ZERO);
        let emits = !emission.is_black() || self.has_map(MapSlot::Emission);
        if self.emission.is_some() && emits && emission.is_black() {
            remarks.push(Remark::warning("black-texture", "ke", counts_alone("Ke")));
        }
        let names_a_color = self.specular.is_some() || self.filter.is_some() || emits;
        let plain = if names_a_color { 0.0 } else { DEFAULT_DIFFUSE };
        let mut material = Material {
            name: self.name.clone(),
            diffuse: self.color(["Kd", "kd"], self.diffuse, MapSlot::Diffuse, plain, &mut remarks),
            specular: self.color(["Ks", "ks"], self.specular, MapSlot::Specular, 0.0, &mut remarks),
            gloss: Gloss::Phong(self.exponent.unwrap_or(DEFAULT_EXPONENT)),
            emission,
            clearcoat: self.clearcoat,
            clearcoat_roughness: self.clearcoat_roughness,
            sheen: Spectrum::splat(self.sheen),
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
        if is_physical {
            material.anisotropy = self.anisotropy;
            material.anisotropy_rotation = 360.0 * self.anisotropy_rotation.fract();
        } else if self.anisotropy > 0.0 {
            remarks.push(Remark::warning(
                "no-effect",
                "aniso",
                "aniso has no effect without Pr or Pm",
            ));
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
                    let words = "glass reflects by its index of refraction; Ks is left out";
                    remarks.push(Remark::warning("glass-reflection", "ks", words));
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

fn counts_alone(key: &str) -> String {
    format!("{key} is 0 and would make its texture black; the texture counts alone")
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
        let (materials, warnings) = load_file(&path, MtlDialect::Auto)?;
        let materials = materials.into_iter().map(|m| m.material);
        Ok((materials.collect(), warnings))
    }

    fn load_file(path: &Path, dialect: MtlDialect) -> Result<(Vec<FileMaterial>, Vec<String>), FileError> {
        let mut findings = Findings::default();
        let materials = load_mtl(path, dialect, &mut findings);
        match findings.first_error() {
            Some(error) => Err(error.clone()),
            None => Ok((materials, findings.warnings())),
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
        assert!(
            warnings[0].contains("t.mtl:2:1: no effect: disp, refl;"),
            "{warnings:?}"
        );
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
            let (materials, warnings) = load_file(&path, dialect).unwrap();
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
        let (materials, warnings) = load_file(&path, MtlDialect::Auto).unwrap();
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
    fn a_texture_of_emission_is_a_color_too() {
        let glowing = one("map_Ke a.png");
        assert_eq!((glowing.diffuse, glowing.emission), (Spectrum::ZERO, Spectrum::ZERO));
        assert_eq!(one("Ke 2\nmap_Ke a.png").emission, Spectrum::splat(2.0));
        let (_, warnings) = load("newmtl m\nKe 0 0 0\nmap_Ke a.png").unwrap();
        assert!(warnings[0].contains("Ke is 0"), "{warnings:?}");
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
            "Pc 2",
            "Pcr -1",
            "Ps 1.5",
            "aniso -0.5",
            "anisor inf",
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
