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

    /// What the library `text` means, whose materials say `all`.
    pub(super) fn resolve(self, text: &str, all: &[Dissolve]) -> Self {
        if self != Self::Auto {
            return self;
        }
        let names_meshlab = || {
            let comments = text.lines().filter(|line| line.trim_start().starts_with('#'));
            comments
                .map(str::to_lowercase)
                .any(|c| c.contains("meshlab") || c.contains("vcglib"))
        };
        let is_same = |dissolve: &Dissolve| match (dissolve.d, dissolve.tr) {
            (Some(d), Some(tr)) => Some((d - tr).abs() < 1e-3 && (d - 0.5).abs() > 1e-3),
            _ => None,
        };
        let pairs: Vec<bool> = all.iter().filter_map(is_same).collect();
        let all_same = !pairs.is_empty() && pairs.iter().all(|&same| same);
        // A library in which nothing could be seen
        let is_clear = |dissolve: &Dissolve| dissolve.d.is_none() && dissolve.tr == Some(1.0);
        let all_clear = !all.is_empty() && all.iter().all(is_clear);
        match names_meshlab() || all_same || all_clear {
            true => Self::Meshlab,
            false => Self::Spec,
        }
    }
}

/// What a material says of how much of the surface is there.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Dissolve {
    /// Its `d`.
    pub d: Option<f32>,
    /// Its `Tr`.
    pub tr: Option<f32>,
}

impl Dissolve {
    /// Whether it says anything.
    pub fn is_given(self) -> bool {
        self.d.is_some() || self.tr.is_some()
    }

    /// The share of the surface that is there, as `dialect` has it; and a word where the two say different things.
    pub fn opacity(self, dialect: MtlDialect) -> (f32, Option<String>) {
        let of_tr = |tr: f32| match dialect {
            MtlDialect::Meshlab => tr,
            _ => 1.0 - tr,
        };
        let by_tr = self.tr.map(of_tr);
        let (counts, word, other) = match dialect {
            MtlDialect::Max => (by_tr.or(self.d), "Tr", self.d),
            _ => (self.d.or(by_tr), "d", by_tr),
        };
        let opacity = counts.unwrap_or(1.0);
        let contradiction = match (other, self.d, self.tr) {
            (Some(other), Some(d), Some(tr)) if (other - opacity).abs() > 1e-3 => Some(format!(
                "d is {d} but Tr is {tr}; {word} counts (--mtl-dialect says how `Tr` is meant)"
            )),
            _ => None,
        };
        (opacity, contradiction)
    }
}
