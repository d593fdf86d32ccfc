use super::Inspection;
use crate::io::{FileError, Finding, MAX_PLACES, Position, Severity};
use crate::math::excerpt_of_name;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

/// Finds materials of libraries that are defined twice or that no face uses.
pub(super) fn inspect(inspection: &Inspection) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut unused: BTreeMap<&Path, Vec<(&str, usize)>> = BTreeMap::new();
    // Compare places of definitions and not names, because faces may name a material in other
    // letter case or with other separators.
    let used: HashSet<(&Path, usize)> = inspection
        .materials
        .iter()
        .filter_map(|m| {
            let place = m.place.as_ref();
            place.map(|(file, at)| (file.as_path(), at.line))
        })
        .collect();
    // If the scene file and a library define the same name, faces use the material of the scene
    // file.
    let replaced: HashSet<&str> = inspection
        .materials
        .iter()
        .filter(|m| m.obj.is_none() && m.place.is_some())
        .map(|m| m.name.as_str())
        .collect();
    // A library that several OBJ files share is checked once.
    let mut seen = HashSet::new();
    for obj in &inspection.objs {
        let mut defined: HashMap<&str, (&Path, usize)> = HashMap::new();
        for (name, library, line) in &obj.materials {
            let (library, line) = (library.as_path(), *line);
            let is_new = seen.insert((library, line));
            if let Some((file, first)) = defined.insert(name, (library, line)).filter(|_| is_new) {
                let message = format!(
                    "material `{}` is defined twice; this definition is used, not that of {}:{first}",
                    excerpt_of_name(name),
                    file.display()
                );
                let error = FileError::new(library, message).at(Position::line(line));
                let error = error.help("rename or delete one of the definitions");
                findings.push(Finding::new(Severity::Warning, "duplicate-material", error));
            }
        }
        for (name, (library, line)) in defined {
            if !used.contains(&(library, line)) && !replaced.contains(name) {
                unused.entry(library).or_default().push((name, line));
            }
        }
    }
    for (library, mut materials) in unused {
        materials.sort_by_key(|&(_, line)| line);
        materials.dedup();
        let names: Vec<_> = materials
            .iter()
            .map(|&(name, _)| excerpt_of_name(name))
            .take(1 + MAX_PLACES)
            .collect();
        let rest = if materials.len() > names.len() { ", …" } else { "" };
        let mut places = materials.iter().map(|&(_, line)| Position::line(line));
        let Some(first) = places.next() else { continue };
        let message = format!(
            "{} that no face uses: {}{rest}",
            super::tally::counted(materials.len() as u64, "material"),
            names.join(", ")
        );
        let error = FileError::new(library, message).at(first);
        let finding = Finding::new(Severity::Note, "unused-definition", error);
        findings.push(finding.repeated(materials.len() as u64, places));
    }
    findings
}
