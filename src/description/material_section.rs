use super::mtl::MapSlot;
use super::mtl::{FileMaterial, MapRequest};
use super::{FileError, MapSection, SceneFile};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::material::{Gloss, Material};
use crate::math::list;
use serde::Deserialize;
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;

/// `[material.NAME]`: a key that is left out is 0, or the default of the model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialSection {
    /// Diffuse reflectance.
    pub diffuse: Option<Spanned<[f32; 3]>>,
    /// Factor of the glossy or mirror reflection.
    pub specular: Option<Spanned<[f32; 3]>>,
    /// How `specular` reflects: `phong`, `blinn`, `ggx` or `mirror`.
    pub model: Option<Spanned<String>>,
    /// Exponent of a glossy reflection.
    pub exponent: Option<Spanned<f32>>,
    /// Roughness of `ggx` and of `transmission`.
    pub roughness: Option<Spanned<f32>>,
    /// Share of metal: `diffuse` is the base colour.
    pub metallic: Option<Spanned<f32>>,
    /// How much longer than wide highlights are, of `ggx` and of `transmission`.
    pub anisotropy: Option<Spanned<f32>>,
    /// Degrees from the direction of growing u to that of long highlights.
    pub anisotropy_rotation: Option<Spanned<f32>>,
    /// Factor of what a clear coat reflects.
    pub clearcoat: Option<Spanned<f32>>,
    /// Roughness of the clear coat.
    pub clearcoat_roughness: Option<Spanned<f32>>,
    /// Factor of what fibres scatter.
    pub sheen: Option<Spanned<[f32; 3]>>,
    /// Index of refraction of a metal, by channel; with `k`.
    pub eta: Option<Spanned<[f32; 3]>>,
    /// Extinction coefficient of a metal, by channel; with `eta`.
    pub k: Option<Spanned<[f32; 3]>>,
    /// Factor of what passes the surface.
    pub transmission: Option<Spanned<[f32; 3]>>,
    /// Index of refraction, of `transmission` and of a `blinn` or `ggx` reflection.
    pub ior: Option<Spanned<f32>>,
    /// Whether the surface is a sheet that light leaves straight on.
    pub thin: Option<bool>,
    /// Emitted radiance.
    pub emission: Option<Spanned<[f32; 3]>>,
    /// Share of the surface that is there.
    pub opacity: Option<Spanned<f32>>,
    /// Texture of `diffuse`.
    pub diffuse_map: Option<Spanned<MapSection>>,
    /// Texture of `specular`.
    pub specular_map: Option<Spanned<MapSection>>,
    /// Texture of `emission`.
    pub emission_map: Option<Spanned<MapSection>>,
    /// Texture of `exponent`.
    pub exponent_map: Option<Spanned<MapSection>>,
    /// Texture of `roughness`.
    pub roughness_map: Option<Spanned<MapSection>>,
    /// Texture of `metallic`.
    pub metallic_map: Option<Spanned<MapSection>>,
    /// Texture of `opacity`.
    pub opacity_map: Option<Spanned<MapSection>>,
    /// Heights.
    pub bump_map: Option<Spanned<MapSection>>,
    /// Normals in the frame of the texture coordinates.
    pub normal_map: Option<Spanned<MapSection>>,
}

/// Exponent of a glossy reflection that names none.
const DEFAULT_EXPONENT: f32 = 10.0;

impl MaterialSection {
    /// The material `name`; what cannot be is an error at its key in `file`.
    pub(super) fn material(&self, name: &str, file: &SceneFile) -> Result<FileMaterial, FileError> {
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
        let share = |n: f32| (0.0..=1.0).contains(&n);
        let share = |key, value| section.number(key, value, share, "a number from 0 to 1");
        let roughness = share("roughness", &self.roughness)?;
        let metallic = share("metallic", &self.metallic)?;
        let opacity = share("opacity", &self.opacity)?;
        let turn = &self.anisotropy_rotation;
        let turn = section.number("anisotropy_rotation", turn, |_| true, "a finite number")?;
        if let Some(sheen) = &self.sheen {
            let is_good = |sheen: &[f32; 3]| sheen.iter().all(|n| (0.0..=1.0).contains(n));
            section.check("sheen", sheen, is_good, "three numbers from 0 to 1")?;
        }
        // Beside a texture, a constant that is left out changes nothing; a metal reflects by its own colour.
        let color =
            |given: Option<Spectrum>, is_full| given.unwrap_or(if is_full { Spectrum::ONE } else { Spectrum::ZERO });
        let metallic = metallic.or(self.metallic_map.as_ref().map(|_| 1.0));
        let is_metal = conductor.is_some() || metallic.is_some();
        let specular = section.color("specular", &self.specular)?;
        let exponent = exponent.or(self.exponent_map.as_ref().map(|_| 1.0));
        let material = Material {
            name: name.into(),
            diffuse: color(section.color("diffuse", &self.diffuse)?, self.diffuse_map.is_some()),
            specular: color(specular, is_metal || self.specular_map.is_some()),
            gloss: self.gloss(&section, conductor, exponent, ior, metallic)?,
            roughness: roughness.unwrap_or(if self.roughness_map.is_some() { 1.0 } else { 0.0 }),
            anisotropy: share("anisotropy", &self.anisotropy)?.unwrap_or(0.0),
            anisotropy_rotation: turn.unwrap_or(0.0),
            clearcoat: share("clearcoat", &self.clearcoat)?.unwrap_or(0.0),
            clearcoat_roughness: share("clearcoat_roughness", &self.clearcoat_roughness)?.unwrap_or(0.0),
            sheen: section.color("sheen", &self.sheen)?.unwrap_or(Spectrum::ZERO),
            transmission: section
                .color("transmission", &self.transmission)?
                .unwrap_or(Spectrum::ZERO),
            ior: ior.unwrap_or(Material::default().ior),
            thin: self.thin.unwrap_or(false),
            emission: section.color("emission", &self.emission)?.unwrap_or(Spectrum::ZERO),
            opacity: opacity.unwrap_or(1.0),
            ..Material::default()
        };
        // What roughens nothing was meant otherwise.
        let has_facets = matches!(material.gloss, Gloss::Ggx(_) | Gloss::Metallic(_));
        let refracts = !material.transmission.is_black() && !material.thin;
        match place_of(&self.roughness, &self.roughness_map) {
            Some(place) if !has_facets && !refracts => {
                let help = "use model = \"ggx\", or a transmission that is not thin";
                return Err(section.error(place, "nothing here has a roughness", help));
            }
            _ => {}
        }
        match &self.anisotropy {
            Some(anisotropy) if !has_facets && !refracts => {
                let help = "use model = \"ggx\", or a transmission that is not thin";
                return Err(section.error(anisotropy.span(), "nothing here has facets", help));
            }
            _ => {}
        }
        let maps = self.maps(name, file)?;
        // The scene file tells its places itself.
        Ok(FileMaterial {
            material,
            maps,
            library: PathBuf::new(),
            line: 0,
        })
    }

    /// The textures.
    fn maps(&self, name: &str, file: &SceneFile) -> Result<Vec<MapRequest>, FileError> {
        let slots = [
            (&self.diffuse_map, MapSlot::Diffuse),
            (&self.specular_map, MapSlot::Specular),
            (&self.emission_map, MapSlot::Emission),
            (&self.exponent_map, MapSlot::Exponent),
            (&self.roughness_map, MapSlot::Roughness),
            (&self.metallic_map, MapSlot::Metallic),
            (&self.opacity_map, MapSlot::Opacity),
            (&self.bump_map, MapSlot::Bump),
            (&self.normal_map, MapSlot::Normal),
        ];
        let given = slots
            .into_iter()
            .filter_map(|(map, slot)| map.as_ref().map(|map| (map, slot)));
        given
            .map(|(map, slot)| MapSection::request(map, slot, name, file))
            .collect()
    }

    fn gloss(
        &self,
        section: &Named,
        conductor: Option<Fresnel>,
        exponent: Option<f32>,
        ior: Option<f32>,
        metallic: Option<f32>,
    ) -> Result<Gloss, FileError> {
        let has_facets = self.roughness.is_some() || self.roughness_map.is_some() || metallic.is_some();
        let default = if has_facets { "ggx" } else { "phong" };
        let model = self.model.as_ref().map_or(default, |m| m.get_ref());
        match place_of(&self.metallic, &self.metallic_map) {
            Some(place) if model != "ggx" || conductor.is_some() => {
                let help = "leave out eta and k, and any model but \"ggx\"";
                return Err(section.error(place, "metallic stands by itself", help));
            }
            _ => {}
        }
        let dielectric = ior.map(|eta| Fresnel::Dielectric { eta });
        let fresnel = conductor.or(dielectric).unwrap_or(Fresnel::Full);
        match (model, &self.eta, place_of(&self.exponent, &self.exponent_map)) {
            ("phong", Some(eta), _) => {
                let help = "use model = \"ggx\" or \"blinn\", or model = \"mirror\" for a smooth metal";
                Err(section.error(eta.span(), "a Phong lobe has no Fresnel term", help))
            }
            ("phong", None, _) => Ok(Gloss::Phong(exponent.unwrap_or(DEFAULT_EXPONENT))),
            ("blinn", ..) => Ok(Gloss::Blinn(exponent.unwrap_or(DEFAULT_EXPONENT), fresnel)),
            ("ggx" | "mirror", _, Some(place)) => {
                let help = "leave it out, or use model = \"phong\" or \"blinn\"";
                Err(section.error(place, &format!("model \"{model}\" has no exponent"), help))
            }
            ("ggx", ..) => match metallic {
                Some(metallic) => Ok(Gloss::Metallic(metallic)),
                None => Ok(Gloss::Ggx(fresnel)),
            },
            ("mirror", _, None) => Ok(Gloss::Mirror(conductor.unwrap_or(Fresnel::Full))),
            (other, ..) => {
                let span = self.model.as_ref().map_or(0..0, Spanned::span);
                let message = format!("unknown model `{other}`");
                Err(section.error(span, &message, "there is phong, blinn, ggx, mirror"))
            }
        }
    }
}

/// Where a quantity is given: its number, or else its texture.
fn place_of(number: &Option<Spanned<f32>>, map: &Option<Spanned<MapSection>>) -> Option<Range<usize>> {
    number.as_ref().map(Spanned::span).or(map.as_ref().map(Spanned::span))
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

    /// An error unless three numbers are good.
    fn check(
        &self,
        key: &str,
        value: &Spanned<[f32; 3]>,
        is_good: impl Fn(&[f32; 3]) -> bool,
        rule: &str,
    ) -> Result<(), FileError> {
        match is_good(value.get_ref()) {
            true => Ok(()),
            false => Err(self.wrong(key, value.span(), &list(value.get_ref()), rule)),
        }
    }

    /// The error of a key that has the wrong `value`.
    fn wrong(&self, key: &str, span: Range<usize>, value: &str, rule: &str) -> FileError {
        self.error(span, &format!("{key} is {value}"), &format!("write {rule}"))
    }

    fn number(
        &self,
        key: &str,
        value: &Option<Spanned<f32>>,
        is_good: impl Fn(f32) -> bool,
        rule: &str,
    ) -> Result<Option<f32>, FileError> {
        let Some(value) = value else { return Ok(None) };
        let n = *value.get_ref();
        match n.is_finite() && is_good(n) {
            true => Ok(Some(n)),
            false => Err(self.wrong(key, value.span(), &n.to_string(), rule)),
        }
    }

    fn color(&self, key: &str, value: &Option<Spanned<[f32; 3]>>) -> Result<Option<Spectrum>, FileError> {
        let Some(value) = value else { return Ok(None) };
        let rule = "three finite numbers, 0 or more";
        self.check(key, value, |&c| Spectrum::from(c).is_valid(), rule)?;
        Ok(Some((*value.get_ref()).into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;
    use crate::texture::{Channel, Mapping, Wrap};

    /// The material of a scene file whose section has these `keys`.
    fn material(keys: &str) -> Result<Material, FileError> {
        textured(keys).map(|found| found.material)
    }

    fn textured(keys: &str) -> Result<FileMaterial, FileError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        let text = format!("version = 1\n[[object]]\nobj = \"a.obj\"\n[material.m]\n{keys}\n");
        std::fs::write(&path, text).unwrap();
        let file = SceneFile::load(&path)?;
        file.material.values().next().unwrap().material("m", &file)
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
        // In the order of the slots, each with its line in the file
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
            ("diffuse_map = { file = \"a.png\", scale = 2 }", "array"),
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
                "nothing here has a roughness",
            ),
            (
                "metallic_map = \"a.png\"\nmodel = \"mirror\"",
                "metallic stands by itself",
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
            ("anisotropy = 0.5", "nothing here has facets"),
            ("anisotropy_rotation = inf", "anisotropy_rotation is"),
            ("metallic = -0.1", "metallic is -0.1"),
            ("model = \"blinn\"\nroughness = 0.5", "nothing here has a roughness"),
            (
                "model = \"phong\"\ntransmission = [1, 1, 1]\nthin = true\nroughness = 0.5",
                "nothing here",
            ),
            ("model = \"mirror\"\nmetallic = 1.0", "metallic stands by itself"),
            (
                "metallic = 1.0\neta = [1, 1, 1]\nk = [1, 1, 1]",
                "metallic stands by itself",
            ),
            ("roughness = 0.5\nexponent = 10.0", "\"ggx\" has no exponent"),
        ] {
            let error = material(keys).unwrap_err();
            assert!(error.message.contains(word), "{keys}: {error}");
            assert!(error.position.is_some_and(|p| p.line > 4), "{keys}: {error}");
        }
    }
}
