/// Dialect of a material library: the meaning of statements that differs between programs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MtlDialect {
    /// Dialect of the program that wrote the library, recognised by comments or by typical
    /// statements. If the program is unknown, [`MtlDialect::Spec`] is used, but `Ks` with `Ns 0`
    /// has no effect. `Tr` then means `d` if both are equal in all materials, or if all materials
    /// would otherwise be fully transparent. Of any program, `Tr` gets the other meaning if its
    /// usual meaning makes most materials invisible.
    #[default]
    Auto,
    /// The literal reading: `Ks` and `Ns` are a Phong lobe. `Tr` is 1 − d and is used if there is
    /// no `d`.
    Spec,
    /// Blender: `Ks` and `Ns` are the specular level and the roughness of its principled surface.
    Blender,
    /// 3ds Max: `Ks` and `Ns` are a highlight that reflects only lamps. Maps replace colours. `Tr`
    /// has priority over `d`.
    Max,
    /// Maya: `illum 4` is written for every surface, including opaque ones. `Tf` is the opacity,
    /// and `Ks` and `Ns` are a highlight that reflects only lamps.
    Maya,
    /// SketchUp: `Ks` is a constant without meaning.
    Sketchup,
    /// Cinema 4D: `Ks` and `Ns` are a highlight that reflects only lamps.
    Cinema4d,
    /// MeshLab: `Tr` means `d`. `Ks` with `Ns 0` is a constant without meaning; any other `Ks` is a
    /// highlight that reflects only lamps.
    Meshlab,
    /// Rhino: `Ks` and `Ns` are a highlight that reflects only lamps. `Tf` is a constant without
    /// meaning.
    Rhino,
    /// Wings 3D: `Ks` and `Ns` are a highlight that reflects only lamps.
    Wings3d,
    /// 3dfier: `Ks` and `Ns` are a highlight that reflects only lamps.
    Threedfier,
    /// Assimp: `Ks` and `Ns` are a highlight that reflects only lamps. `Tf` has no meaning.
    Assimp,
    /// An unknown program with `Ks` and `Ns` as a highlight that reflects only lamps.
    Highlight,
}

impl MtlDialect {
    /// Names of the dialects, as users type them. The default is first.
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
    /// `Tr` is 1 − d. `d` has priority if both are given.
    Transparency,
    /// `Tr` is 1 − d. `Tr` has priority if both are given.
    TransparencyFirst,
    /// `Tr` is equal to `d`.
    Opacity,
}

impl TrMeaning {
    /// Description of the meaning for users. `is_visible` is true if most materials would be
    /// invisible with the other meaning.
    pub fn words(self, is_visible: bool) -> &'static str {
        match (self, is_visible) {
            (Self::Opacity, false) => "Tr is read as opacity",
            (Self::Opacity, true) => {
                "Tr is read as opacity, since as transparency it would make most materials invisible"
            }
            (_, false) => "Tr is read as transparency",
            (_, true) => {
                "Tr is read as transparency, since as opacity it would make most materials invisible (--mtl-dialect meshlab reads it as opacity)"
            }
        }
    }
}

/// Opacity statements of a material.
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
    /// Returns true if the material has a statement of its opacity.
    pub fn is_given(self) -> bool {
        self.d.is_some() || self.tr.is_some() || self.alpha.is_some()
    }

    /// The opacity, and a message if `d` and `Tr` contradict each other.
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
                "d is {d} but Tr is {tr}; {word} is used (--mtl-dialect sets the meaning of `Tr`)"
            )),
            _ => None,
        };
        (opacity * self.alpha.unwrap_or(1.0), contradiction)
    }
}

/// Returns true if the opacities `all` of a library show that `Tr` means `d`. This is the case if
/// both are equal, and not 1/2, in all materials that have both. It is also the case if every
/// material would be fully transparent with `Tr` = 1 − d.
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

/// The other meaning of `Tr`, if `usual` makes more than half of the materials of a library
/// invisible, and the other meaning makes fewer invisible: programs hardly ever write invisible
/// surfaces, and versions of a program differ in the meaning. `None` if `usual` is right.
pub(super) fn visible_meaning(usual: TrMeaning, all: &[Dissolve]) -> Option<TrMeaning> {
    let other = match usual {
        TrMeaning::Opacity => TrMeaning::Transparency,
        _ => TrMeaning::Opacity,
    };
    let invisible = |meaning| all.iter().filter(|dissolve| dissolve.opacity(meaning).0 == 0.0).count();
    let count = invisible(usual);
    (2 * count > all.len() && invisible(other) < count).then_some(other)
}
