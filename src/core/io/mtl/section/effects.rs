//! Numbers of a material that have no effect.

use super::{MAX_EXPONENT, MaterialRemark, Section};
use crate::color::Spectrum;
use crate::io::mtl::MapSlot;
use crate::material::{Gloss, Material};

/// Maximum sum of the reflected and the transmitted light of a mixture: 1, and a margin for
/// rounding.
const FULL: f32 = 1.0001;

/// Returns true if the surface transmits light with refraction.
pub(super) fn refracts(material: &Material) -> bool {
    !material.transmission.is_black() && !material.thin
}

impl Section {
    /// Returns true if `Tf` of an opaque model means partial transmission. It must be neither white
    /// nor black, which exporters write for opaque surfaces. No opacity may be given, and Kd + Ks +
    /// Tf must be at most 1.
    pub(super) fn is_mixture(&self, material: &Material) -> bool {
        let share = self
            .filter
            .filter(|&filter| filter != Spectrum::ONE && !filter.is_black());
        let sum = |filter| (material.diffuse + material.specular + filter).max_component();
        let is_opaque_model = matches!(self.illum, Some(0..=2)) && !self.dissolve.is_given();
        is_opaque_model && share.is_some_and(|filter| sum(filter) <= FULL)
    }

    /// Warnings about numbers that have no effect on the material.
    pub(super) fn lost_numbers(&self, material: &Material) -> Vec<MaterialRemark> {
        let mut remarks = Vec::new();
        let mut lost = |key, words: String| remarks.push(MaterialRemark::warning("no-effect", key, words));
        let model = self.illum.unwrap_or(2);
        let is_glass = matches!(self.illum, Some(4 | 6 | 7));
        let is_physical = self.is_physical() && !is_glass;
        let filter = self
            .filter
            .filter(|&filter| filter != Spectrum::ONE && !filter.is_black());
        if let Some(filter) = filter.filter(|_| material.transmission.is_black()) {
            let sum = (material.diffuse + material.specular + filter).max_component();
            lost(
                "tf",
                match self.illum {
                    _ if self.dissolve.is_given() => "Tf has no effect: d or Tr makes the surface opaque".into(),
                    Some(0..=2) if !is_physical => {
                        format!("Tf has no effect: Kd + Ks + Tf is {sum}, and illum {model} needs a sum of at most 1")
                    }
                    _ => format!("Tf has no effect with illum {model}; use illum 6 for a surface that transmits"),
                },
            );
        }
        if is_glass && self.filter.is_some() && self.dissolve.d.is_some_and(|d| d < 1.0) {
            lost(
                "d",
                format!("d has no effect with illum {model}: Tf sets the transmission"),
            );
        }
        let shines = self.specular.is_some_and(|ks| !ks.is_black());
        let has_picture = self.has_map(MapSlot::Specular);
        // A specular picture scales the reflection of every model, so it has an effect even with
        // `Pr` or `Pm`.
        if shines && is_physical {
            lost("ks", "Ks has no effect with Pr or Pm: Ni sets the reflection".into());
        } else if (shines || has_picture) && matches!(self.illum, Some(0 | 1)) && !is_physical {
            lost("ks", format!("Ks has no effect: illum {model} has no highlight"));
        }
        let is_mirror = matches!(material.gloss, Gloss::Mirror(_)) && !material.specular.is_black();
        if is_mirror && self.exponent.is_some_and(|ns| ns < MAX_EXPONENT) {
            lost(
                "ns",
                format!("Ns has no effect: with illum {model}, Ks is the colour of a mirror"),
            );
        }
        if is_glass && self.metallic.is_some_and(|metallic| metallic > 0.0) {
            lost("pm", format!("Pm has no effect: illum {model} is glass"));
        }
        if self.clearcoat_roughness > 0.0 && self.clearcoat == 0.0 {
            lost("pcr", "Pcr has no effect without Pc".into());
        }
        if self.anisotropy_rotation != 0.0 && self.anisotropy == 0.0 {
            lost("anisor", "anisor has no effect without aniso".into());
        }
        remarks
    }

    /// Keywords of numbers without effect on this surface, which exporters write for every surface.
    pub fn idle_numbers(&self, material: &Material) -> Vec<&'static str> {
        let is_physical = matches!(material.gloss, Gloss::Metallic(_));
        let has_highlight = !material.specular.is_black() && !is_physical;
        let refracts = refracts(material);
        let has_ior = self.ior.is_some_and(|ior| ior != 1.0) && !is_physical;
        let idle = [
            ("Ns", self.exponent.is_some() && !has_highlight),
            ("Ni", (has_ior || self.has_no_ior) && !refracts),
            ("Ka", self.ambient.is_some_and(|ka| !ka.is_black())),
        ];
        idle.into_iter()
            .filter(|(_, is_idle)| *is_idle)
            .map(|(key, _)| key)
            .collect()
    }
}
