//! A section of a material library, from one `newmtl` to the next: its statements, and the
//! resulting material.

mod effects;

use super::dialect::{Dissolve, TrMeaning};
use super::map::MapSlot;
use super::reflectance::ior_of_dielectric;
use super::{DEFAULT_DIFFUSE, MapRequest, OpacityStatement};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::color::xyz::equal_energy_to_linear;
use crate::io::Severity;
use crate::material::{Gloss, Material};
use crate::math::excerpt;

/// Phong exponent of a `Ks` without `Ns`.
pub(super) const DEFAULT_EXPONENT: f32 = 10.0;
/// Maximum of `Ns` in the format.
const MAX_EXPONENT: f32 = 1000.0;
/// Index of refraction of glass without `Ni`.
pub(super) const DEFAULT_IOR: f32 = 1.5;

/// A message about a material.
pub(super) struct MaterialRemark {
    pub severity: Severity,
    pub code: &'static str,
    /// Keyword of the statement, in lower case.
    pub key: &'static str,
    pub words: String,
}

impl MaterialRemark {
    fn warning(code: &'static str, key: &'static str, words: impl Into<String>) -> Self {
        Self {
            severity: Severity::Warning,
            code,
            key,
            words: words.into(),
        }
    }
}

/// Statements of an MTL file for one material.
#[derive(Default)]
pub(crate) struct Section {
    pub name: String,
    pub diffuse: Option<Spectrum>,
    pub specular: Option<Spectrum>,
    pub ambient: Option<Spectrum>,
    emission: Option<Spectrum>,
    pub filter: Option<Spectrum>,
    pub exponent: Option<f32>,
    pub ior: Option<f32>,
    /// True if the last `Ni` is 0.
    pub(super) has_no_ior: bool,
    pub(super) dissolve: Dissolve,
    /// True if the library is read literally.
    pub(super) is_literal: bool,
    pub roughness: Option<f32>,
    pub metallic: Option<f32>,
    pub clearcoat: f32,
    /// Value of `Pc` for a full coat.
    max_clearcoat: f32,
    clearcoat_roughness: f32,
    sheen: f32,
    anisotropy: f32,
    /// Rotation of the tangent of the anisotropy, in turns.
    anisotropy_rotation: f32,
    pub illum: Option<u32>,
    /// Reflectance along the normal of a surface that is not a metal. It replaces the reflectance
    /// that follows from `ior`. Only translations of dialects set it.
    pub f0: Option<f32>,
    /// Share of the light that the surface transmits instead of reflecting it, if the surface is
    /// not a metal. Only translations of dialects set it.
    pub transmitted: Option<f32>,
    pub maps: Vec<MapRequest>,
    /// Line of the material's `newmtl`.
    pub line: usize,
    /// Lines of the material's statements, by keyword in lower case.
    pub lines: Vec<(String, usize)>,
}

/// Message of an error, and a text on how to correct it.
pub(crate) type Complaint = (String, &'static str);

impl Section {
    /// A section that begins in line `line`. `max_clearcoat` is the value of `Pc` for a full coat.
    pub fn new(name: &str, line: usize, max_clearcoat: f32) -> Self {
        Self {
            name: name.into(),
            line,
            max_clearcoat,
            ..Self::default()
        }
    }

    /// Reads a statement; `lower` is its keyword in lower case. Returns true if the keyword is
    /// known.
    ///
    /// # Errors
    ///
    /// If a value is wrong. The nearest valid value is used. If there is no such value, the
    /// statement has no effect.
    pub fn set(&mut self, lower: &str, key: &str, rest: &str) -> Result<bool, Complaint> {
        const SHARE: ([f32; 2], &str) = ([0.0, 1.0], "write a number from 0 to 1");
        let mut complaint = None;
        let mut number = |(range, help)| read(&mut complaint, number(key, rest, range, help));
        match lower {
            "ns" => {
                let exponent = number(([0.0, f32::MAX], "write a finite number, 0 or more"));
                self.exponent = exponent.or(self.exponent);
            }
            "ni" => {
                let help = "write a finite number above 0";
                match number(([f32::MIN, f32::MAX], help)) {
                    Some(ior) if ior < 0.0 => {
                        complaint = Some((format!("{key} is `{}`; it has no effect", excerpt(rest)), help));
                    }
                    // Some exporters write 0 for materials that do not refract.
                    Some(ior) => (self.ior, self.has_no_ior) = (Some(ior).filter(|_| ior > 0.0), ior == 0.0),
                    None => {}
                }
            }
            "d" => self.dissolve.d = number(SHARE).or(self.dissolve.d),
            "tr" => self.dissolve.tr = number(SHARE).or(self.dissolve.tr),
            "pr" => self.roughness = number(SHARE).or(self.roughness),
            "pm" => self.metallic = number(SHARE).or(self.metallic),
            "pc" => {
                let help = if self.max_clearcoat > 1.0 {
                    "write a finite number, 0 or more"
                } else {
                    SHARE.1
                };
                let clearcoat = number(([0.0, self.max_clearcoat], help));
                self.clearcoat = clearcoat.unwrap_or(self.clearcoat);
            }
            "pcr" => self.clearcoat_roughness = number(SHARE).unwrap_or(self.clearcoat_roughness),
            "ps" => self.sheen = number(SHARE).unwrap_or(self.sheen),
            "aniso" => self.anisotropy = number(SHARE).unwrap_or(self.anisotropy),
            "anisor" => {
                let turn = number(([f32::MIN, f32::MAX], "write a fraction of a whole turn, such as 0.25"));
                self.anisotropy_rotation = turn.unwrap_or(self.anisotropy_rotation);
            }
            "illum" => self.illum = read(&mut complaint, model(rest)).or(self.illum),
            "kd" => {
                (self.diffuse, self.dissolve.alpha) = match color_and_alpha(rest) {
                    Some((color, alpha)) => {
                        let message = format!("the fourth number of {key} is read as the opacity {alpha}");
                        complaint = Some((message, "write three numbers, and the opacity as `d`"));
                        (Some(color), Some(alpha))
                    }
                    None => (
                        read(&mut complaint, color(key, rest)).or(self.diffuse),
                        self.dissolve.alpha,
                    ),
                };
            }
            "ks" => self.specular = read(&mut complaint, color(key, rest)).or(self.specular),
            "ke" => self.emission = read(&mut complaint, color(key, rest)).or(self.emission),
            "tf" => self.filter = read(&mut complaint, color(key, rest)).or(self.filter),
            // A path tracer computes ambient light and needs no `Ka`, but some programs store
            // another value in it.
            "ka" => self.ambient = color(key, rest).ok(),
            _ => return Ok(false),
        }
        complaint.map_or(Ok(true), Err)
    }

    /// Line of the last statement with the keyword `key`, or of the material's `newmtl` if there is
    /// no such statement.
    pub fn line_of(&self, key: &str) -> usize {
        self.line_of_statement(key).unwrap_or(self.line)
    }

    /// The statement that sets the opacity.
    pub(super) fn opacity_statement(&self, tr: TrMeaning) -> Option<OpacityStatement> {
        let alpha = self.dissolve.alpha.map(|_| "kd");
        let mut keys = ["d", "tr", "tf"].into_iter().chain(alpha);
        keys.find_map(|key| {
            let line = self.line_of_statement(key)?;
            let other = match tr {
                _ if key != "tr" => None,
                TrMeaning::Opacity => Some("--mtl-dialect spec reads `Tr` as transparency"),
                _ => Some("--mtl-dialect meshlab reads `Tr` as opacity"),
            };
            Some(OpacityStatement { line, other })
        })
    }

    fn line_of_statement(&self, key: &str) -> Option<usize> {
        let mut lines = self.lines.iter().rev();
        lines.find(|(known, _)| known == key).map(|&(_, line)| line)
    }

    /// Notes about statements that are not read literally, and about assumed values.
    pub(super) fn assumed(&self) -> Vec<MaterialRemark> {
        let mut notes = Vec::new();
        let mut note = |code, key, words: String| {
            let severity = Severity::Note;
            let note = MaterialRemark {
                severity,
                code,
                key,
                words,
            };
            notes.push(note);
        };
        let shines = self.specular.is_some_and(|ks| !ks.is_black()) || self.has_map(MapSlot::Specular);
        if let Some(ns) = self.exponent.filter(|&ns| ns > MAX_EXPONENT) {
            let words = format!("Ns is {ns}, above the {MAX_EXPONENT} of the format; it is used unchanged");
            note("exponent-range", "ns", words);
        }
        match self.illum {
            Some(0 | 1) => {}
            Some(model @ (3 | 5)) if !shines => {
                note(
                    "illum",
                    "illum",
                    format!("illum {model} is a mirror, which is black without Ks"),
                );
            }
            Some(model @ (4 | 6 | 7)) => {
                if self.filter.is_none() && !self.dissolve.is_given() {
                    note(
                        "illum",
                        "illum",
                        format!("illum {model} is glass, which is clear without Tf"),
                    );
                }
                if self.ior.is_none() {
                    let words =
                        format!("illum {model} is glass, whose index of refraction is {DEFAULT_IOR} without Ni");
                    note("illum", "illum", words);
                }
            }
            _ if shines && self.exponent.is_none() && !self.has_map(MapSlot::Exponent) && self.f0.is_none() => {
                note(
                    "default-exponent",
                    "ks",
                    format!("Ks has no Ns, so the exponent of the highlight is {DEFAULT_EXPONENT}"),
                );
            }
            _ => {}
        }
        notes
    }

    pub fn has_map(&self, slot: MapSlot) -> bool {
        self.maps.iter().any(|m| m.statement.slot == slot)
    }

    /// Returns true if the material uses the metallic-roughness model.
    pub fn is_physical(&self) -> bool {
        self.roughness.is_some()
            || self.metallic.is_some()
            || self.has_map(MapSlot::Roughness)
            || self.has_map(MapSlot::Metallic)
    }

    /// Factor of a colour. If a texture gives the colour, a missing or black factor becomes 1,
    /// because it would make the texture black.
    fn color(
        &self,
        [key, lower]: [&'static str; 2],
        given: Option<Spectrum>,
        slot: MapSlot,
        default: f32,
        remarks: &mut Vec<MaterialRemark>,
    ) -> Spectrum {
        match (given, self.has_map(slot)) {
            (Some(color), true) if color.is_black() => {
                remarks.push(MaterialRemark::warning("black-texture", lower, counts_alone(key)));
                Spectrum::ONE
            }
            (None, true) => Spectrum::ONE,
            (given, _) => given.unwrap_or(Spectrum::splat(default)),
        }
    }

    /// Factor of a quantity. If only a texture sets the quantity, the factor is 1.
    fn factor(&self, given: Option<f32>, slot: MapSlot, default: f32) -> f32 {
        given.unwrap_or(if self.has_map(slot) { 1.0 } else { default })
    }

    /// The material, and messages about assumptions.
    pub(super) fn material(&self, tr: TrMeaning) -> (Material, Vec<MaterialRemark>) {
        let mut remarks = Vec::new();
        // If the material has any colour, its missing colours are black. Without any colour, it is
        // a grey diffuse surface.
        let emission = self.emission.unwrap_or(Spectrum::ZERO);
        let emits = !emission.is_black() || self.has_map(MapSlot::Emission);
        if self.emission.is_some() && emits && emission.is_black() {
            remarks.push(MaterialRemark::warning("black-texture", "ke", counts_alone("Ke")));
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

        // The PBR extension (`Pr`, `Pm`) is a separate reflection model. Glass uses only its
        // roughness.
        material.roughness = self.factor(self.roughness, MapSlot::Roughness, 0.0);
        let is_physical = self.is_physical();
        if is_physical && !matches!(self.illum, Some(4 | 6 | 7)) {
            let metallic = self.factor(self.metallic, MapSlot::Metallic, 0.0);
            material.gloss = Gloss::Metallic(metallic);
            // A dielectric that reflects nothing along its normal has no specular layer.
            let is_matte = self.f0 == Some(0.0) && metallic == 0.0;
            material.specular = Spectrum::splat(if is_matte { 0.0 } else { 1.0 });
            let ior = self.ior.filter(|&n| n > 1.0).unwrap_or(DEFAULT_IOR);
            material.ior = self
                .f0
                .map_or(ior, |f0| ior_of_dielectric(f0, self.roughness.unwrap_or(0.5)));
            if let Some(share) = self.transmitted.filter(|&share| share > 0.0) {
                self.transmit(share * (1.0 - metallic), ior, &mut material);
            }
        }
        if is_physical {
            material.anisotropy = self.anisotropy;
            material.anisotropy_rotation = 360.0 * self.anisotropy_rotation.fract();
        } else if self.anisotropy > 0.0 {
            remarks.push(MaterialRemark::warning(
                "no-effect",
                "aniso",
                "aniso has no effect without Pr or Pm",
            ));
        }

        let (mut opacity, contradiction) = self.dissolve.opacity(tr);
        remarks.extend(contradiction.map(|words| MaterialRemark::warning("opacity", "tr", words)));
        if opacity == 0.0 && self.has_map(MapSlot::Opacity) && !self.is_literal {
            // Exporters write 0 if a picture gives the opacity.
            opacity = 1.0;
            remarks.push(self.opacity_of_map());
        }
        match self.illum {
            // Glass, with Fresnel reflection. `Ks` is added if energy is left: as a Phong lobe with
            // `Ns`, except for illum 7, whose reflections are traced.
            Some(4 | 6 | 7) => {
                let dissolved = (opacity < 1.0).then(|| Spectrum::splat(1.0 - opacity));
                material.transmission = self.filter.or(dissolved).unwrap_or(Spectrum::ONE);
                material.ior = self.ior.unwrap_or(DEFAULT_IOR);
                let has_exponent = self.exponent.is_some() || self.has_map(MapSlot::Exponent);
                let is_phong = has_exponent && self.illum != Some(7) && !material.specular.is_black();
                let all = material.diffuse + material.specular + material.transmission;
                if !material.specular.is_black() && all.max_component() > 1.0 {
                    material.specular = Spectrum::ZERO;
                    let words = "Ks is ignored, since glass reflects by its index of refraction";
                    remarks.push(MaterialRemark::warning("glass-reflection", "ks", words));
                }
                if !is_phong || material.specular.is_black() {
                    material.gloss = Gloss::Mirror(Fresnel::Full);
                }
            }
            // A coloured filter with opacity: part of the light is transmitted straight and tinted
            _ if opacity < 1.0 && self.filter.is_some_and(|filter| filter != Spectrum::ONE) => {
                material.diffuse *= opacity;
                material.specular *= opacity;
                let filter = self.filter.unwrap_or(Spectrum::ONE);
                material.transmission = filter * (1.0 - opacity);
                (material.thin, material.ior) = (true, 1.0);
            }
            // A filter (`Tf`), if neither a model nor an opacity is given
            None if !self.dissolve.is_given() => {
                if let Some(filter) = self.filter {
                    material.transmission = filter;
                    (material.thin, material.ior) = self.ior.map_or((true, 1.0), |ior| (false, ior));
                }
            }
            // A mixture of Kd, Ks and Tf
            _ if self.is_mixture(&material) => {
                material.transmission = self.filter.unwrap_or(Spectrum::ZERO);
                (material.thin, material.ior) = self.ior.map_or((true, 1.0), |ior| (false, ior));
            }
            // A surface with opacity
            _ => material.opacity = opacity,
        }
        if self.has_no_ior && effects::refracts(&material) {
            remarks.push(MaterialRemark::warning(
                "no-effect",
                "ni",
                "Ni 0 has no effect, since it is no index of refraction",
            ));
        }
        remarks.extend(self.lost_numbers(&material));
        (material, remarks)
    }

    /// Note that `map_d` alone gives the opacity, since the opacity of the statements is 0.
    fn opacity_of_map(&self) -> MaterialRemark {
        let (key, word) = match self.dissolve {
            Dissolve { d: Some(_), .. } => ("d", "d"),
            Dissolve { tr: Some(_), .. } => ("tr", "Tr"),
            _ => ("kd", "the fourth number of Kd"),
        };
        let words = format!(
            "{word} would make it invisible despite map_d, so map_d alone gives the opacity (--mtl-dialect spec multiplies both)"
        );
        MaterialRemark {
            severity: Severity::Note,
            code: "opacity-of-map",
            key,
            words,
        }
    }

    /// Transmits `share` of the light that the surface would reflect. The base colour is the tint
    /// of a whole body. Because light crosses two surfaces of a body, each surface has the square
    /// root of the tint.
    fn transmit(&self, share: f32, ior: f32, material: &mut Material) {
        let [r, g, b] = material.diffuse.to_array().map(f32::sqrt);
        material.transmission = Spectrum::rgb(r, g, b) * share;
        material.diffuse *= 1.0 - share;
        material.specular *= 1.0 - share;
        material.ior = ior;
    }
}

fn counts_alone(key: &str) -> String {
    format!("{key} is 0 and would make its texture black; the texture is used without {key}")
}

/// A wrong value: the value that replaces it, if any, and the error.
type InvalidValue<T> = (Option<T>, Complaint);

/// Returns the value. If it is invalid, stores the error in `complaint` and returns the
/// replacement, if any.
fn read<T>(complaint: &mut Option<Complaint>, value: Result<T, InvalidValue<T>>) -> Option<T> {
    match value {
        Ok(value) => Some(value),
        Err((used, what)) => {
            *complaint = Some(what);
            used
        }
    }
}

/// Parses the last word as a number from `low` to `high`. Options such as `-halo` may come before
/// the number.
fn number(key: &str, rest: &str, [low, high]: [f32; 2], help: &'static str) -> Result<f32, InvalidValue<f32>> {
    let value: Option<f32> = rest.split_whitespace().next_back().and_then(|word| word.parse().ok());
    let Some(value) = value.filter(|n| n.is_finite()) else {
        return Err((None, (format!("{key} is `{}`; it has no effect", excerpt(rest)), help)));
    };
    let used = value.clamp(low, high);
    if used == value {
        Ok(value)
    } else {
        Err((
            Some(used),
            (format!("{key} is `{}`; {used} is used", excerpt(rest)), help),
        ))
    }
}

/// Parses an illumination model.
fn model(rest: &str) -> Result<u32, InvalidValue<u32>> {
    let help = "write a number from 0 to 10";
    let is_model = |n: &u32| *n <= 10;
    match rest.parse::<u32>().ok().filter(is_model) {
        Some(model) => Ok(model),
        None => {
            // Accept a whole number such as `2.0`
            let whole = rest.parse().ok().filter(|n: &f32| n.fract() == 0.0 && *n >= 0.0);
            let used = whole.map(|n| n as u32).filter(is_model);
            let effect = used.map_or("it has no effect".into(), |model| format!("{model} is used"));
            Err((used, (format!("illum is `{}`; {effect}", excerpt(rest)), help)))
        }
    }
}

/// Parses a colour: one number for a grey, or three. After `xyz` the numbers are CIE XYZ, from 0 to
/// 1 in the format, so that white is 1 1 1. Colours outside of Rec.709 are clamped.
fn color(key: &str, rest: &str) -> Result<Spectrum, InvalidValue<Spectrum>> {
    let after_xyz = rest
        .strip_prefix("xyz")
        .filter(|numbers| numbers.starts_with(char::is_whitespace));
    let color = match after_xyz {
        Some(numbers) => {
            let max = if key.eq_ignore_ascii_case("ke") { f32::MAX } else { 1.0 };
            three_numbers(numbers).map(|xyz| equal_energy_to_linear(xyz).map(|c| c.clamp(0.0, max)).into())
        }
        None => three_numbers(rest).map(Spectrum::from),
    };
    let help = "write one number or three, finite and 0 or more";
    let Some(color) = color else {
        let message = format!("{key}: `{}` is not a colour; it has no effect", excerpt(rest));
        return Err((None, (message, help)));
    };
    if color.is_valid() {
        return Ok(color);
    }
    let [r, g, b] = color.to_array().map(|n| n.max(0.0));
    let message = format!("{key}: `{}` is not a colour; `{r} {g} {b}` is used", excerpt(rest));
    Err((Some(Spectrum::rgb(r, g, b)), (message, help)))
}

/// Parses a colour of four numbers, the last of which is an opacity. `None` for any other colour.
fn color_and_alpha(rest: &str) -> Option<(Spectrum, f32)> {
    let words: Option<Vec<f32>> = rest.split_whitespace().map(|word| word.parse().ok()).collect();
    match words?[..] {
        [r, g, b, alpha] if alpha.is_finite() => {
            let color = Spectrum::rgb(r, g, b);
            color.is_valid().then_some((color, alpha.clamp(0.0, 1.0)))
        }
        _ => None,
    }
}

/// Parses three finite numbers, or one finite number, which is repeated.
fn three_numbers(words: &str) -> Option<[f32; 3]> {
    let values: Option<Vec<f32>> = words.split_whitespace().map(|word| word.parse().ok()).collect();
    let numbers = match values?[..] {
        [grey] => [grey; 3],
        [a, b, c] => [a, b, c],
        _ => return None,
    };
    numbers.iter().all(|n| n.is_finite()).then_some(numbers)
}
