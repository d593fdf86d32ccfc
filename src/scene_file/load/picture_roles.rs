//! Roles of pictures as textures, from their names.

use super::picture_names::{without_sizes, words_of};

/// Property that a texture defines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    Color,
    Roughness,
    /// Glossiness: 1 − roughness.
    Gloss,
    Metallic,
    /// Roughness in the green channel and metallic in the blue channel, as in glTF.
    Packed,
    Normal,
    /// Normal map whose green channel points down, as in DirectX.
    DirectXNormal,
    Opacity,
    Emission,
    Height,
    Occlusion,
    /// Colour or strength of the reflection, which no set uses.
    Specular,
}

/// Words at the end of file names that name a role. They are in lower case, without separators.
const WORDS: &[(Role, &[&str])] = &[
    (
        Role::Color,
        &[
            "basecolor",
            "basecolour",
            "basemap",
            "albedo",
            "albedomap",
            "alb",
            "diffuse",
            "diffusemap",
            "diff",
            "dif",
            "color",
            "colour",
            "colormap",
            "colourmap",
            "col",
            "texture",
        ],
    ),
    (Role::Roughness, &["roughness", "roughnessmap", "rough", "rgh"]),
    (Role::Gloss, &["glossiness", "gloss", "smoothness"]),
    (Role::Metallic, &["metallic", "metalness", "metal"]),
    (
        Role::Packed,
        &["metallicroughness", "occlusionroughnessmetallic", "orm", "arm"],
    ),
    (
        Role::Normal,
        &[
            "normal",
            "normals",
            "normalgl",
            "normalopengl",
            "norm",
            "nor",
            "norgl",
            "nrm",
            "nrml",
            "normalmap",
        ],
    ),
    (Role::DirectXNormal, &["normaldx", "normaldirectx", "nordx"]),
    (Role::Opacity, &["opacity", "alpha"]),
    (Role::Emission, &["emissive", "emission"]),
    (Role::Height, &["height", "heightmap", "displacement", "disp"]),
    (Role::Occlusion, &["ambientocclusion", "occlusion", "ao", "mixedao"]),
    (Role::Specular, &["specular", "specularmap", "spec", "spc"]),
];

/// Words of the name of the texture set of a picture, and role of the picture, from its name
/// without extension.
pub(super) fn role_of(stem: &str) -> Option<(Vec<String>, Role)> {
    let words = words_of(stem);
    let words = without_sizes(&words);
    // Find the longest end of the name that is a role
    for count in (1..=words.len().min(3)).rev() {
        let (set, end) = words.split_at(words.len() - count);
        let end = end.concat();
        if let Some((role, _)) = WORDS.iter().find(|(_, words)| words.contains(&&*end)) {
            return Some((without_sizes(set).to_vec(), *role));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_a_set_and_a_role() {
        for (stem, set, role) in [
            ("chair_BaseColor", "chair", Role::Color),
            ("Chair_Leg_Base_Color", "chairleg", Role::Color),
            ("Bricks052_1K-JPG_NormalDX", "bricks052", Role::DirectXNormal),
            ("rock_wall_nor_gl_4k", "rockwall", Role::Normal),
            ("rock_wall_arm_4k", "rockwall", Role::Packed),
            ("material_0_metallicRoughness", "material", Role::Packed),
            ("Cigarette_1001_Roughness", "cigarette", Role::Roughness),
            ("albedo", "", Role::Color),
            ("Plane_DefaultMaterial_BaseMap", "planedefaultmaterial", Role::Color),
            ("Wood AO", "wood", Role::Occlusion),
            ("Woman_posed_001_dif_2k", "womanposed", Role::Color),
            ("Woman_posed_001_norm_2k", "womanposed", Role::Normal),
            ("Woman_posed_001_SPEC_2k", "womanposed", Role::Specular),
            ("boot_NRM", "boot", Role::Normal),
            ("boot_DIF", "boot", Role::Color),
            ("BootNormalMap", "boot", Role::Normal),
        ] {
            let found = role_of(stem).map(|(words, role)| (words.concat(), role));
            assert_eq!(found, Some((set.to_string(), role)), "{stem}");
        }
        for stem in ["", "photo", "colorful", "normal_map_of_x", "1001"] {
            assert_eq!(role_of(stem), None, "{stem}");
        }
    }
}
