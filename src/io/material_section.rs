use super::{FileError, SceneFile};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::material::{Gloss, Material};
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;

/// `[material.NAME]`: a key that is left out is 0, or the default of the model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialSection {
    /// Diffuse reflectance.
    pub diffuse: Option<Spanned<[f32; 3]>>,
    /// Factor of the glossy or mirror reflection.
    pub specular: Option<Spanned<[f32; 3]>>,
    /// How `specular` reflects: `phong`, `blinn` or `mirror`.
    pub model: Option<Spanned<String>>,
    /// Exponent of a glossy reflection.
    pub exponent: Option<Spanned<f32>>,
    /// Index of refraction of a metal, by channel; with `k`.
    pub eta: Option<Spanned<[f32; 3]>>,
    /// Extinction coefficient of a metal, by channel; with `eta`.
    pub k: Option<Spanned<[f32; 3]>>,
    /// Factor of what passes the surface.
    pub transmission: Option<Spanned<[f32; 3]>>,
    /// Index of refraction, of `transmission` and of a `blinn` reflection.
    pub ior: Option<Spanned<f32>>,
    /// Whether the surface is a sheet that light leaves straight on.
    pub thin: Option<bool>,
    /// Emitted radiance.
    pub emission: Option<Spanned<[f32; 3]>>,
}

/// Exponent of a glossy reflection that names none.
const DEFAULT_EXPONENT: f32 = 10.0;

impl MaterialSection {
    /// The material `name`; what cannot be is an error at its key in `file`.
    pub(super) fn material(&self, name: &str, file: &SceneFile) -> Result<Material, FileError> {
        let section = Named { name, file };
        let conductor = match (&self.eta, &self.k) {
            (Some(eta), Some(k)) => {
                section.check(
                    "eta",
                    eta,
                    |eta| eta.iter().all(|n| n.is_finite() && *n > 0.0),
                    "finite numbers above 0",
                )?;
                section.check(
                    "k",
                    k,
                    |k| k.iter().all(|n| n.is_finite() && *n >= 0.0),
                    "finite numbers, 0 or more",
                )?;
                Some(Fresnel::Conductor {
                    eta: *eta.get_ref(),
                    k: *k.get_ref(),
                })
            }
            (None, None) => None,
            (Some(eta), None) => return Err(section.error(eta.span(), "`eta` without `k`", "give both, or neither")),
            (None, Some(k)) => return Err(section.error(k.span(), "`k` without `eta`", "give both, or neither")),
        };
        let exponent = section.number("exponent", &self.exponent, |n| n >= 0.0, "a finite number, 0 or more")?;
        let ior = section.number("ior", &self.ior, |n| n > 0.0, "a finite number above 0")?;
        // A metal reflects by its own colour.
        let specular = section.color("specular", &self.specular)?;
        let full = if conductor.is_some() {
            Spectrum::ONE
        } else {
            Spectrum::ZERO
        };
        Ok(Material {
            name: name.into(),
            diffuse: section.color("diffuse", &self.diffuse)?.unwrap_or(Spectrum::ZERO),
            specular: specular.unwrap_or(full),
            gloss: self.gloss(&section, conductor, exponent, ior)?,
            transmission: section
                .color("transmission", &self.transmission)?
                .unwrap_or(Spectrum::ZERO),
            ior: ior.unwrap_or(Material::default().ior),
            thin: self.thin.unwrap_or(false),
            emission: section.color("emission", &self.emission)?.unwrap_or(Spectrum::ZERO),
            ..Material::default()
        })
    }

    fn gloss(
        &self,
        section: &Named,
        conductor: Option<Fresnel>,
        exponent: Option<f32>,
        ior: Option<f32>,
    ) -> Result<Gloss, FileError> {
        let model = self.model.as_ref().map_or("phong", |m| m.get_ref());
        match (model, &self.eta, &self.exponent) {
            ("phong", Some(eta), _) => {
                let help = "use model = \"blinn\", or model = \"mirror\" for a smooth metal";
                Err(section.error(eta.span(), "a Phong lobe has no Fresnel term", help))
            }
            ("phong", None, _) => Ok(Gloss::Phong(exponent.unwrap_or(DEFAULT_EXPONENT))),
            ("blinn", ..) => {
                let dielectric = ior.map(|eta| Fresnel::Dielectric { eta });
                let fresnel = conductor.or(dielectric).unwrap_or(Fresnel::Full);
                Ok(Gloss::Blinn(exponent.unwrap_or(DEFAULT_EXPONENT), fresnel))
            }
            ("mirror", _, Some(exponent)) => {
                let help = "leave it out, or use model = \"phong\" or \"blinn\"";
                Err(section.error(exponent.span(), "a mirror has no exponent", help))
            }
            ("mirror", _, None) => Ok(Gloss::Mirror(conductor.unwrap_or(Fresnel::Full))),
            (other, ..) => {
                let span = self.model.as_ref().map_or(0..0, Spanned::span);
                let message = format!("unknown model `{other}`");
                Err(section.error(span, &message, "there is phong, blinn, mirror"))
            }
        }
    }
}

/// A material's name and file, for messages.
struct Named<'a> {
    name: &'a str,
    file: &'a SceneFile,
}

impl Named<'_> {
    fn error(&self, span: Range<usize>, message: &str, help: &str) -> FileError {
        let message = format!("material `{}`: {message}", self.name);
        self.file.error(span, message).help(help)
    }

    fn check<T: std::fmt::Debug>(
        &self,
        key: &str,
        value: &Spanned<T>,
        is_good: impl Fn(&T) -> bool,
        rule: &str,
    ) -> Result<(), FileError> {
        if is_good(value.get_ref()) {
            return Ok(());
        }
        let message = format!("{key} is {:?}", value.get_ref());
        Err(self.error(value.span(), &message, &format!("write {rule}")))
    }

    fn number(
        &self,
        key: &str,
        value: &Option<Spanned<f32>>,
        is_good: impl Fn(f32) -> bool,
        rule: &str,
    ) -> Result<Option<f32>, FileError> {
        let Some(value) = value else { return Ok(None) };
        self.check(key, value, |n| n.is_finite() && is_good(*n), rule)?;
        Ok(Some(*value.get_ref()))
    }

    fn color(&self, key: &str, value: &Option<Spanned<[f32; 3]>>) -> Result<Option<Spectrum>, FileError> {
        let Some(value) = value else { return Ok(None) };
        let rule = "three finite numbers, 0 or more";
        self.check(key, value, |&c| Spectrum::from(c).is_valid(), rule)?;
        Ok(Some((*value.get_ref()).into()))
    }
}
