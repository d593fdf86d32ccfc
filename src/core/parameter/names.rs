//! Types whose values users choose by name.

/// Types whose values have names. Users type these names.
pub trait Named: Copy + PartialEq + 'static {
    /// All values with their names. The first value is the default.
    const NAMES: &'static [(&'static str, Self)];
}

/// Implements `Named` for types.
#[macro_export]
macro_rules! named {
    ($($ty:ty: $($name:literal => $value:expr),+;)*) => {
        $(impl $crate::parameter::Named for $ty {
            const NAMES: &'static [(&'static str, Self)] = &[$(($name, $value)),+];
        })*
    };
}
pub use named;

/// Name of `value` in the list `known`.
pub fn name_of<T: PartialEq>(known: &[(&'static str, T)], value: T) -> &'static str {
    known.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

/// All names, separated by commas.
pub fn join_names<T>(known: &[(&str, T)]) -> String {
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// Minimum similarity, from 0 to 1, between a misspelled name and the name that is suggested (Jaro
/// and Winkler).
const SIMILAR: f64 = 0.8;

/// The name in `known` that is most similar to `name`; `None` if no name is similar enough.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let scored = known.into_iter().map(|k| (strsim::jaro_winkler(name, k), k));
    let best = scored.max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.filter(|(score, _)| *score >= SIMILAR).map(|(_, k)| k)
}
