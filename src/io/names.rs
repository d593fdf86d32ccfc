//! Things that users name, and their names.

/// What `name` names among those `known`.
pub(crate) fn find<T: Copy>(known: &[(&str, T)], name: &str) -> Option<T> {
    known.iter().find(|(k, _)| *k == name).map(|(_, value)| *value)
}

/// The name of `value` among those `known`.
pub(crate) fn name_of<T: PartialEq>(known: &[(&'static str, T)], value: T) -> &'static str {
    known.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

/// All names, with commas between them.
pub(crate) fn join_names<T>(known: &[(&str, T)]) -> String {
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}
