//! Values that users choose by name.

/// Values each of which has a name, as users type it.
pub trait Named: Copy + PartialEq + 'static {
    /// All of them; the first is the default.
    const NAMES: &'static [(&'static str, Self)];
}

/// Names the values of a type.
#[macro_export]
macro_rules! named {
    ($($ty:ty: $($name:literal => $value:expr),+;)*) => {
        $(impl $crate::parameter::Named for $ty {
            const NAMES: &'static [(&'static str, Self)] = &[$(($name, $value)),+];
        })*
    };
}
pub use named;

/// The name of `value` among those `known`.
pub fn name_of<T: PartialEq>(known: &[(&'static str, T)], value: T) -> &'static str {
    known.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

/// All names, with commas between them.
pub fn join_names<T>(known: &[(&str, T)]) -> String {
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// Minimum similarity of two names of which one may be meant by the other (Jaro and Winkler, 0 to 1).
const SIMILAR: f64 = 0.8;

/// The name among `known` that is most like `name`, if one may be meant.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let scored = known.into_iter().map(|k| (strsim::jaro_winkler(name, k), k));
    let best = scored.max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.filter(|(score, _)| *score >= SIMILAR).map(|(_, k)| k)
}
