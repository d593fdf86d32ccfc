use super::statements::{split_keyword, statements};
use super::{FileError, Position};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::material::{Gloss, Material};
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

/// The materials of an MTL file in its order, and what of it has no effect.
///
/// Read here rather than by tobj, which panics at a colour of one number, knows no `Tf`, and tells no lines.
pub(super) fn load_mtl(path: &Path) -> Result<(Vec<Material>, Vec<String>), FileError> {
    let bytes = std::fs::read(path).map_err(|e| FileError::system(path, "cannot read the material library", &e))?;
    let text = String::from_utf8_lossy(&bytes);
    let mut sections: Vec<Section> = Vec::new();
    let mut skipped: Vec<(String, usize)> = Vec::new();
    for (line, statement) in statements(&text) {
        let (key, rest) = split_keyword(&statement);
        if key == "newmtl" {
            sections.push(Section::new(rest));
            continue;
        }
        // Statements before the first material belong to none.
        let Some(section) = sections.last_mut() else { continue };
        let known = section.set(key, rest).map_err(|(message, help)| {
            let place = FileError::new(path, format!("material `{}`: {message}", section.name));
            place.at(Position::line(line)).help(help)
        })?;
        if !known && !skipped.iter().any(|(k, _)| k == key) {
            skipped.push((key.to_string(), line));
        }
    }

    let mut warnings = Vec::new();
    if let Some((_, line)) = skipped.first() {
        let keys: Vec<&str> = skipped.iter().map(|(key, _)| key.as_str()).collect();
        let message = format!("no effect yet: {}; the first is here", keys.join(", "));
        warnings.push(FileError::new(path, message).at(Position::line(*line)).to_string());
    }
    let materials = sections.iter().map(|section| {
        let (material, remark) = section.material();
        let name = &section.name;
        warnings.extend(remark.map(|words| format!("{}: material `{name}`: {words}", path.display())));
        material
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
    illum: Option<u32>,
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

    /// Takes a statement; whether it has an effect.
    fn set(&mut self, key: &str, rest: &str) -> Result<bool, Complaint> {
        match key {
            "Kd" => self.diffuse = Some(color(key, rest)?),
            "Ks" => self.specular = Some(color(key, rest)?),
            "Ke" => self.emission = Some(color(key, rest)?),
            "Tf" => self.filter = Some(color(key, rest)?),
            "Ns" => self.exponent = Some(number(key, rest, |n| n >= 0.0, "write a finite number, 0 or more")?),
            "Ni" => self.ior = Some(number(key, rest, |n| n > 0.0, "write a finite number above 0")?),
            "d" => self.dissolve = Some(number(key, rest, is_share, "write a number from 0 to 1")?),
            "Tr" => self.transparency = Some(number(key, rest, is_share, "write a number from 0 to 1")?),
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
            "Ka" | "sharpness" => {}
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// The material, and what of it was assumed.
    fn material(&self) -> (Material, Option<String>) {
        // A material that names any colour means the others to be black; one that names none is a plain surface.
        let emission = self.emission.unwrap_or(Spectrum::ZERO);
        let names_a_color = self.specular.is_some() || self.filter.is_some() || !emission.is_black();
        let plain = if names_a_color { 0.0 } else { DEFAULT_DIFFUSE };
        let mut material = Material {
            name: self.name.clone(),
            diffuse: self.diffuse.unwrap_or(Spectrum::splat(plain)),
            specular: self.specular.unwrap_or(Spectrum::ZERO),
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

        let opacity = self.dissolve.or(self.transparency.map(|t| 1.0 - t)).unwrap_or(1.0);
        let mut remark = match (self.dissolve, self.transparency) {
            (Some(d), Some(t)) if (d - (1.0 - t)).abs() > 1e-3 => Some(format!("d is {d} but Tr is {t}; d counts")),
            _ => None,
        };
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
                    remark = remark.or(Some("glass reflects by its index of refraction; Ks is left out".into()));
                }
            }
            // A veil: part of the light goes straight on.
            _ if opacity < 1.0 => {
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
            _ => {}
        }
        (material, remark)
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
        load_mtl(&path)
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
        let veil = one("Kd 0.8\nd 0.25\nillum 2");
        assert_eq!((veil.diffuse, veil.transmission), (grey(0.2), grey(0.75)));
        assert!(veil.thin && veil.ior == 1.0);
    }

    #[test]
    fn plain_materials_are_grey_and_lamps_black() {
        assert_eq!(one("").diffuse, Spectrum::splat(DEFAULT_DIFFUSE));
        assert_eq!(one("Ke 1").diffuse, Spectrum::ZERO);
        assert_eq!(one("Ke 0 0 0").diffuse, Spectrum::splat(DEFAULT_DIFFUSE));
    }

    #[test]
    fn what_has_no_effect_is_said() {
        let (_, warnings) = load("newmtl a\nmap_Kd a.png\nPr 0.3\nnewmtl b\nmap_Kd b.png\nd 0.5\nTr 0.9\n").unwrap();
        assert!(
            warnings[0].contains("t.mtl:2: no effect yet: map_Kd, Pr;"),
            "{warnings:?}"
        );
        assert!(
            warnings[1].contains("material `b`: d is 0.5 but Tr is 0.9"),
            "{warnings:?}"
        );
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
            "illum x",
            "Kd spectral a.rfl",
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
