//! Imports run one way: a room may use only what lies below it (docs/architecture.md).

use std::fs;
use std::path::Path;

/// Rooms from the ground up; those of one row do not know each other.
const ROWS: &[&[&str]] = &[
    &["math"],
    &["sampling", "color"],
    &["bsdf", "geometry", "sampler", "texture"],
    &["material", "light", "camera", "film"],
    &["scene", "denoise"],
    &["accel"],
    &["integrator"],
    &["io", "render"],
    &["lint"],
    &["session"],
    &["cli"],
];

#[test]
fn imports_run_downwards() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let level = |room: &str| ROWS.iter().position(|row| row.contains(&room));
    let mut rooms: Vec<String> = fs::read_dir(&root)
        .unwrap()
        .filter_map(|e| e.ok().filter(|e| e.path().is_dir()))
        .map(|e| e.file_name().into_string().unwrap())
        .collect();
    rooms.sort();
    let mut checked = 0;
    for room in &rooms {
        let own = level(room).unwrap_or_else(|| panic!("src/{room} has no row in this test"));
        for file in files(&root.join(room)) {
            let text = fs::read_to_string(&file).unwrap();
            // Tests may use what they need.
            let code = text.split("#[cfg(test)]").next().unwrap();
            for used in code.split("crate::").skip(1) {
                let other = used.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap();
                let Some(other_level) = level(other) else { continue };
                checked += 1;
                assert!(
                    other == room || other_level < own,
                    "{} uses crate::{other}",
                    file.display()
                );
            }
        }
    }
    assert!(checked > 50, "only {checked} imports were seen");
}

/// What renders, for everybody, stands on the library: commands that are no laboratory know nothing below it.
#[test]
fn the_command_line_stands_on_the_library() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/cli");
    let allowed = ["accel::Auditor", "session", "io", "render", "film", "color", "denoise"];
    for file in ["run.rs", "keeper.rs", "merge.rs", "tev.rs", "clock.rs", "progress.rs"] {
        let text = fs::read_to_string(root.join(file)).unwrap();
        for used in text.split("use crate::").skip(1) {
            let used = used.split(';').next().unwrap().replace(['{', '}'], "");
            assert!(allowed.iter().any(|a| used.starts_with(a)), "cli/{file} uses {used}");
        }
    }
}

/// All unsafe code is behind Embree's door.
#[test]
fn unsafe_code_is_in_one_folder() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for file in files(&root) {
        let inside = file.starts_with(root.join("accel/embree"));
        let text = fs::read_to_string(&file).unwrap();
        let code = text
            .lines()
            .filter(|l| !l.trim_start().starts_with("//"))
            .collect::<Vec<_>>()
            .join("\n");
        assert!(inside || !code.contains("unsafe"), "{} has unsafe code", file.display());
    }
}

fn files(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    entries
        .flat_map(|p| if p.is_dir() { files(&p) } else { vec![p] })
        .collect()
}
