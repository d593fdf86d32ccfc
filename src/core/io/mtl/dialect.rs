/// Dialect of a material library: what its writer means by statements whose meaning differs between programs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MtlDialect {
    /// The dialect of the program that wrote the library, as its comments or the habits of its statements show it; [`MtlDialect::Spec`] where
    /// neither does. Without a known writer, `Tr` is another word for `d` where both are equal in all materials, or where all materials would be
    /// clear, and `Ks` with `Ns 0` has no effect.
    #[default]
    Auto,
    /// The literal reading: `Ks` and `Ns` are a Phong lobe, `Tr` is 1 − d and counts where there is no `d`.
    Spec,
    /// Blender: `Ks` and `Ns` stand for the specular level and the roughness of its principled surface.
    Blender,
    /// 3ds Max: `Ks` and `Ns` stand for a highlight of lamps, maps replace colours, and `Tr` counts before `d`.
    Max,
    /// Maya: `illum 4` is written for every surface, opaque ones too, `Tf` is its opacity, and `Ks`
    /// and `Ns` stand for a highlight of lamps.
    Maya,
    /// SketchUp: `Ks` is a constant without meaning.
    Sketchup,
    /// Cinema 4D: `Ks` and `Ns` stand for a highlight of lamps.
    Cinema4d,
    /// MeshLab: `Tr` is another word for `d`, `Ks` of `Ns 0` is a constant without meaning, and
    /// another one stands for a highlight of lamps.
    Meshlab,
    /// Rhino: `Ks` and `Ns` stand for a highlight of lamps, and `Tf` is a constant without meaning.
    Rhino,
    /// Wings 3D: `Ks` and `Ns` stand for a highlight of lamps.
    Wings3d,
    /// 3dfier: `Ks` and `Ns` stand for a highlight of lamps.
    Threedfier,
    /// Assimp: `Ks` and `Ns` stand for a highlight of lamps, and `Tf` has no meaning.
    Assimp,
    /// An unknown program whose `Ks` and `Ns` stand for a highlight of lamps.
    Highlight,
}

impl MtlDialect {
    /// Each by the name that users type, the default first.
    pub const NAMES: &[(&str, Self)] = &[
        ("auto", Self::Auto),
        ("spec", Self::Spec),
        ("blender", Self::Blender),
        ("max", Self::Max),
        ("maya", Self::Maya),
        ("sketchup", Self::Sketchup),
        ("cinema4d", Self::Cinema4d),
        ("meshlab", Self::Meshlab),
        ("rhino", Self::Rhino),
        ("wings3d", Self::Wings3d),
        ("3dfier", Self::Threedfier),
        ("assimp", Self::Assimp),
        ("highlight", Self::Highlight),
    ];
}

/// Meaning of `Tr`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TrMeaning {
    /// 1 − d; `d` counts where both are given.
    Transparency,
    /// 1 − d; `Tr` counts where both are given.
    TransparencyFirst,
    /// Another word for `d`.
    Opacity,
}

/// What a material says of its opacity.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Dissolve {
    /// Value of `d`.
    pub d: Option<f32>,
    /// Value of `Tr`.
    pub tr: Option<f32>,
    /// Fourth number of `Kd`, an opacity.
    pub alpha: Option<f32>,
}

impl Dissolve {
    /// Whether the material says anything of its opacity.
    pub fn is_given(self) -> bool {
        self.d.is_some() || self.tr.is_some() || self.alpha.is_some()
    }

    /// The opacity, and a message where `d` and `Tr` contradict each other.
    pub fn opacity(self, meaning: TrMeaning) -> (f32, Option<String>) {
        let of_tr = |tr: f32| match meaning {
            TrMeaning::Opacity => tr,
            _ => 1.0 - tr,
        };
        let by_tr = self.tr.map(of_tr);
        let (counts, word, other) = match meaning {
            TrMeaning::TransparencyFirst => (by_tr.or(self.d), "Tr", self.d),
            _ => (self.d.or(by_tr), "d", by_tr),
        };
        let opacity = counts.unwrap_or(1.0);
        let contradiction = match (other, self.d, self.tr) {
            (Some(other), Some(d), Some(tr)) if (other - opacity).abs() > 1e-3 => Some(format!(
                "d is {d} but Tr is {tr}; {word} counts (--mtl-dialect says how `Tr` is meant)"
            )),
            _ => None,
        };
        (opacity * self.alpha.unwrap_or(1.0), contradiction)
    }
}

/// Whether `all` materials of a library show `Tr` to be another word for `d`: both are equal, and not 1/2, wherever both are given; or by the letter
/// nothing of the library could be seen.
pub(super) fn is_tr_opacity(all: &[Dissolve]) -> bool {
    let is_same = |dissolve: &Dissolve| match (dissolve.d, dissolve.tr) {
        (Some(d), Some(tr)) => Some((d - tr).abs() < 1e-3 && (d - 0.5).abs() > 1e-3),
        _ => None,
    };
    let pairs: Vec<bool> = all.iter().filter_map(is_same).collect();
    let all_same = !pairs.is_empty() && pairs.iter().all(|&same| same);
    let is_clear = |dissolve: &Dissolve| dissolve.d.is_none() && dissolve.tr == Some(1.0);
    let all_clear = !all.is_empty() && all.iter().all(is_clear);
    all_same || all_clear
}
