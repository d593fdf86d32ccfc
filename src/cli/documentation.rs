//! Parts of docs/guide/reference that come from the program: tables of parameters and methods, and
//! the help of all commands. With `EMBRASURE_WRITE_DOCS=1` the tests write them.

use crate::options::{IntegratorKind, IntegratorOptions, Named, OptionGroup, Parameter};
use crate::scene_file::{
    CutSection, GroundSection, LightGroupSection, MaterialSection, ObjectSection, PRESETS, PartKeys, SceneOptions,
    Section, TextureSection,
};
use clap::CommandFactory;
use std::fs;
use std::path::{Path, PathBuf};

/// Path of the page `name` of the reference.
fn page(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("docs/guide/reference")
        .join(name)
}

/// Asserts that the page equals `expected`, or writes it.
fn assert_page(name: &str, expected: &str) {
    let page = page(name);
    if std::env::var_os("EMBRASURE_WRITE_DOCS").is_some() {
        fs::write(page, expected).unwrap();
        return;
    }
    let text = fs::read_to_string(page).unwrap();
    for (line, expected) in text.lines().zip(expected.lines()) {
        assert_eq!(line, expected, "`make reference` writes {name}");
    }
    assert_eq!(text, expected, "{name}");
}

/// Rows of a table of keys. The text `section` comes before the name of each key.
fn rows(section: &str, parameters: &[Parameter]) -> Vec<String> {
    let row = |parameter: &Parameter| {
        let mut meaning = parameter.help().to_string();
        let names = parameter.names().into_iter().map(|name| format!("`{name}`"));
        for more in [names.collect::<Vec<_>>().join(", "), parameter.range()] {
            if !more.is_empty() {
                meaning += &format!("; {more}");
            }
        }
        let detail = parameter.detail();
        if !detail.is_empty() {
            meaning += &format!(". {detail}");
        }
        let mut default = parameter.default();
        for (integrator, value) in IntegratorOptions::other_defaults(parameter.key) {
            default += &format!("; {integrator}: {value}");
        }
        // Scene files may also use the name of the flag.
        let others = parameter.keys().skip(1).filter(|_| !section.is_empty());
        let others: String = others.map(|key| format!(", `.{key}`")).collect();
        format!("| `{section}{}`{others} | {meaning} | {default} |", parameter.key)
    };
    parameters.iter().map(row).collect()
}

/// Text of the reference page `page`, with the current rows in its tables.
fn documented(page: &str) -> String {
    // Rows of the keys of the section `of`
    let options = |of: &str| -> Vec<String> {
        let groups = SceneOptions::GROUPS.iter().filter(|(section, _)| *section == of);
        groups
            .flat_map(|(_, parameters)| rows(&format!("{of}."), parameters))
            .collect()
    };
    // Start of the old rows to replace, and the new rows
    let mut tables: Vec<(String, Vec<String>)> = vec![
        ("| `camera.".into(), options("camera")),
        ("| `image.".into(), options("image")),
        ("| `render.".into(), options("render")),
        (
            "| `material.NAME.".into(),
            rows("material.NAME.", MaterialSection::KEYS),
        ),
        ("| `part.GLOB.".into(), rows("part.GLOB.", PartKeys::KEYS)),
        ("| `object.".into(), rows("object.", ObjectSection::KEYS)),
        ("| `ground.".into(), rows("ground.", GroundSection::KEYS)),
        ("| `section.".into(), rows("section.", CutSection::KEYS)),
        ("| `light_group.".into(), rows("light_group.", LightGroupSection::KEYS)),
    ];
    // Skip the first key, the file of the texture: it has no row in the table.
    for key in &TextureSection::KEYS[1..] {
        tables.push((format!("| `{}` | ", key.key), rows("", std::slice::from_ref(key))));
    }
    let mut lines: Vec<String> = Vec::new();
    for line in page.lines() {
        if let Some((_, rows)) = tables.iter_mut().find(|(start, _)| line.starts_with(start.as_str())) {
            lines.append(rows);
            continue;
        }
        let method = IntegratorKind::NAMES
            .iter()
            .find(|(name, _)| line.starts_with(&format!("| `{name}` | ")));
        let cells: Vec<&str> = line.splitn(4, " | ").collect();
        match (method, cells.as_slice()) {
            (Some((_, kind)), [name, _, rest @ ..]) => {
                let parameters = kind.parameters().iter().map(|key| format!("`{key}`"));
                let parameters: Vec<String> = parameters.collect();
                lines.push([&[*name, &parameters.join(", ")], rest].concat().join(" | "));
            }
            _ => lines.push(line.into()),
        }
    }
    lines.join("\n") + "\n"
}

#[test]
fn tables_of_parameters_are_up_to_date() {
    for name in ["scene-file.md", "integrators.md"] {
        let expected = documented(&fs::read_to_string(page(name)).unwrap());
        assert!(expected.matches("\n| `").count() > 10, "{name} has lost its table");
        assert_page(name, &expected);
    }
}

#[test]
fn presets_are_documented() {
    let name = "materials.md";
    let rows: Vec<String> = PRESETS
        .iter()
        .map(|preset| format!("| `{}` | {} | {} |", preset.name, preset.about, preset.source))
        .collect();
    let text = fs::read_to_string(page(name)).unwrap();
    let (before, table) = text
        .split_once("| preset | material | source |\n|---|---|---|\n")
        .unwrap();
    let after = table.split_once("\n\n").unwrap().1;
    let expected = format!(
        "{before}| preset | material | source |\n|---|---|---|\n{}\n\n{after}",
        rows.join("\n")
    );
    assert_page(name, &expected);
    // The picture shows a ball for each preset, in the order of the presets.
    let scene = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/presets.toml")).unwrap();
    let shown: Vec<&str> = scene
        .lines()
        .filter_map(|line| line.strip_prefix("preset = "))
        .collect();
    let names: Vec<String> = PRESETS.iter().map(|preset| format!("\"{}\"", preset.name)).collect();
    assert_eq!(shown, names);
}

// A build without the feature `view` lacks a command, so the help of this build differs from the
// page.
#[cfg(feature = "view")]
#[test]
fn help_of_all_commands_is_up_to_date() {
    /// Last line of the part that is written by hand.
    const MARK: &str = "<!-- Help of all commands; cargo test writes it. -->";
    let name = "command-line.md";
    let text = fs::read_to_string(page(name)).unwrap();
    let (by_hand, _) = text.split_once(MARK).expect("the mark is on the page");
    let mut expected = format!("{by_hand}{MARK}\n");
    let mut command = super::args::Args::program().term_width(100);
    command.build();
    for command in command.get_subcommands_mut() {
        let help = command.render_help().to_string();
        let lines: Vec<&str> = help.lines().map(str::trim_end).collect();
        expected += &format!("\n## {}\n\n```text\n{}\n```\n", command.get_name(), lines.join("\n"));
    }
    assert_page(name, &expected);
}

/// Every parameter is used by a method. Every name in a method's list is a parameter.
#[test]
fn every_parameter_has_a_reader() {
    for parameter in IntegratorOptions::PARAMETERS {
        let is_read = IntegratorKind::NAMES
            .iter()
            .any(|(_, kind)| kind.parameters().contains(&parameter.key));
        assert!(is_read || parameter.key == "integrator", "{}", parameter.key);
    }
}

/// The help of every parameter has at most 80 columns. The values and the default do not count.
#[test]
fn help_is_short() {
    for parameter in SceneOptions::GROUPS.iter().flat_map(|(_, parameters)| *parameters) {
        let help = parameter.help();
        assert!(!help.is_empty() && help.len() <= 80, "{}: {help}", parameter.key);
        assert!(!help.ends_with('.'), "{}: {help}", parameter.key);
    }
}

/// The first line of the help of every flag and argument has at most 80 columns, without the
/// default. `-h` shows this line.
#[test]
fn brief_help_is_a_line() {
    let parameters = SceneOptions::GROUPS.iter().flat_map(|(_, parameters)| *parameters);
    // Help of flags of parameters has a range at the end, so its width is not checked here.
    // `help_is_short` checks the help without the range.
    let of_parameters: Vec<&str> = parameters.map(|parameter| parameter.help()).collect();
    let program = super::args::Args::command();
    let (mut count, mut wrong) = (0, Vec::new());
    for command in program.get_subcommands() {
        for arg in command.get_arguments() {
            let name = format!("{} {}", command.get_name(), arg.get_id());
            let help = arg.get_help().map_or(String::new(), ToString::to_string);
            let text = help.split(" [default: ").next().unwrap_or_default();
            let is_of_parameter = of_parameters.iter().any(|known| text.starts_with(known));
            let columns = text.chars().count();
            let is_line = is_of_parameter || (1..=80).contains(&columns);
            if !is_line || help.contains('\n') || help.ends_with('.') {
                wrong.push(format!("{name}: {columns} columns: {help}"));
            }
            count += 1;
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 200, "{count} flags");
}
