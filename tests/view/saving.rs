//! Saving to the scene file, while other programs change files at the same time.

use super::{PATIENCE, Page, Viewer};
use crate::support::program::{assert_same_bits, done, lit_floor, split};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
#[cfg(unix)]
use std::process::Command;
use std::time::Instant;
use tempfile::TempDir;
use tungstenite::Message;

fn material(name: &str, key: &str, value: &str) -> Value {
    json!({ "do": "material", "name": name, "key": key, "value": value })
}

/// Sends commands in one packet, so that the viewer reads most of them together.
fn send_at_once(page: &mut Page, commands: &[Value]) {
    for command in commands {
        page.socket.write(Message::text(command.to_string())).unwrap();
    }
    page.socket.flush().unwrap();
}

/// Answer to a save: a note or an error with the word "saved".
fn answer(page: &mut Page) -> String {
    let start = Instant::now();
    loop {
        assert!(start.elapsed() < PATIENCE, "no answer");
        match page.next() {
            Message::Text(text) => {
                let value: Value = serde_json::from_str(&text).unwrap();
                let said = value["text"].as_str().unwrap_or_default();
                if ["note", "error"].contains(&value["type"].as_str().unwrap()) && said.contains("saved") {
                    return said.into();
                }
            }
            Message::Binary(bytes) => page.shown(&super::Frame::of(&bytes)),
            _ => {}
        }
    }
}

fn scene_text(folder: &Path) -> String {
    fs::read_to_string(folder.join("s.toml")).unwrap()
}

/// Asserts that the page shows the same image as a `render` of the files.
fn assert_shows_files(viewer: &Viewer, page: &mut Page, folder: &Path) {
    page.wait_for_all();
    fs::write(folder.join("v.exr"), viewer.get("picture.exr").1).unwrap();
    done(folder, &split("render s.toml -q -o r.exr"));
    assert_same_bits(&folder.join("r.exr"), &folder.join("v.exr"));
}

#[test]
fn unloaded_edit_is_not_saved() {
    let folder = lit_floor();
    let before = scene_text(folder.path());
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    for (key, value) in [
        ("roughness", "-5"),
        ("diffuse", "\"/etc/passwd\""),
        ("diffuse", "/etc/passwd"),
        ("model", "nonsense"),
        ("roughness", "[1"),
    ] {
        let save = json!({ "do": "save-changes" });
        send_at_once(&mut page, &[material("floor", key, value), save]);
        let said = answer(&mut page);
        assert!(said.starts_with("The changes are not saved: "), "{value}: {said}");
        assert_eq!(scene_text(folder.path()), before, "{value}");
    }
    // Edits that can be loaded are saved, except edits that came after the save.
    let edits = [
        material("floor", "diffuse", "[0.1, 0.7, 0.2]"),
        json!({ "do": "save-changes" }),
        material("floor", "roughness", "-5"),
    ];
    send_at_once(&mut page, &edits);
    let said = answer(&mut page);
    assert!(said.contains("The changes are saved in s.toml."), "{said}");
    let text = scene_text(folder.path());
    assert!(text.ends_with("[patch.floor]\ndiffuse = [0.1, 0.7, 0.2]\n"), "{text}");
    page.message("error");
    assert_shows_files(&viewer, &mut page, folder.path());
}

/// A flag of the viewer may hide an error of the file. A save does not write a scene that `render`
/// would refuse, unless the old scene also needed the flag.
#[test]
fn saved_scene_is_checked_as_render_reads_it() {
    let folder = lit_floor();
    let text = scene_text(folder.path()) + "[[light]]\ntype = \"point\"\nposition = [0, 2, 1]\nintensity = [1, 1, 1]\n";
    fs::write(folder.path().join("s.toml"), &text).unwrap();
    let flags = [
        "s.toml",
        "--set",
        "light.0.type=spot",
        "--set",
        "light.0.look_at=[0, 0, 0]",
        "--set",
        "light.0.angle=30",
    ];
    let viewer = Viewer::start(folder.path(), &flags);
    let mut page = viewer.page();
    page.wait_for_all();
    // Only spot lights have this key
    page.send(r#"{"do":"light","index":0,"key":"angle","value":"20"}"#);
    page.message("note");
    page.send(r#"{"do":"save-changes"}"#);
    let said = answer(&mut page);
    assert!(
        said.starts_with("The changes are not saved: s.toml:") && said.contains("angle"),
        "{said}"
    );
    assert_eq!(scene_text(folder.path()), text);
    drop(viewer);

    let broken = text.replace("[1, 1, 1]", "[-1, 1, 1]");
    fs::write(folder.path().join("s.toml"), broken).unwrap();
    let viewer = Viewer::start(folder.path(), &["s.toml", "--set", "light.0.intensity=[1, 1, 1]"]);
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"save-camera"}"#);
    page.send(&material("floor", "diffuse", "[0.1, 0.7, 0.2]").to_string());
    page.send(r#"{"do":"save-changes"}"#);
    for what in ["camera is", "changes are"] {
        let said = answer(&mut page);
        assert!(said.starts_with(&format!("The {what} saved")), "{said}");
    }
}

/// Two viewers that save at the same time keep both changes.
#[test]
fn simultaneous_saves_keep_all_changes() {
    let folder = lit_floor();
    let viewers = [0, 1].map(|_| Viewer::start(folder.path(), &["s.toml"]));
    let mut pages = viewers.each_ref().map(Viewer::page);
    for round in 1..=6 {
        let values = [format!("[0.1, 0.2, 0.{round}]"), format!("[0.4, 0.3, 0.{round}]")];
        for ((page, name), value) in pages.iter_mut().zip(["floor", "lamp"]).zip(&values) {
            page.send(&material(name, "diffuse", value).to_string());
            page.message("note");
        }
        for page in &mut pages {
            page.send(r#"{"do":"save-changes"}"#);
        }
        for page in &mut pages {
            let said = answer(page);
            assert!(said.contains("are saved"), "{said}");
        }
        let text = scene_text(folder.path());
        for value in &values {
            assert!(text.contains(value), "round {round}: {value}\n{text}");
        }
    }
}

/// A change by an editor that the viewer has not noticed yet is kept. A broken file of an editor is
/// also kept.
#[test]
fn save_keeps_changes_of_an_editor() {
    let folder = lit_floor();
    let scene = folder.path().join("s.toml");
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(&material("floor", "diffuse", "[0.1, 0.7, 0.2]").to_string());
    page.message("note");
    let text = scene_text(folder.path()).replace("samples = 4", "samples = 9 # by an editor");
    fs::write(&scene, &text).unwrap();
    page.send(r#"{"do":"save-changes"}"#);
    let said = answer(&mut page);
    assert!(said.contains("are saved"), "{said}");
    let saved = scene_text(folder.path());
    assert_eq!(saved, text + "\n[patch.floor]\ndiffuse = [0.1, 0.7, 0.2]\n");
    page.message_where("status", |status| status["target"] == 9);
    assert_shows_files(&viewer, &mut page, folder.path());

    let broken = saved.replace("samples = 9", "samples = nine");
    fs::write(&scene, &broken).unwrap();
    page.send(r#"{"do":"save-camera"}"#);
    let said = answer(&mut page);
    assert!(said.starts_with("The camera is not saved: s.toml:"), "{said}");
    assert_eq!(scene_text(folder.path()), broken);
}

/// The viewer loads files that an editor saved directly before and after a save of the viewer.
#[test]
fn changes_beside_a_save_are_loaded() {
    let folder = lit_floor();
    let (scene, mtl) = (folder.path().join("s.toml"), folder.path().join("a.mtl"));
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    let library = fs::read_to_string(&mtl).unwrap();
    fs::write(&mtl, library.replace("0.5 0.4 0.3", "0.05 0.4 0.3")).unwrap();
    page.send(r#"{"do":"save-camera"}"#);
    assert!(answer(&mut page).contains("is saved"));
    let text = scene_text(folder.path());
    fs::write(&scene, text.replace("samples = 4", "samples = 9")).unwrap();
    page.message_where("note", |note| note["text"].as_str().unwrap().contains("reloaded"));
    page.message_where("status", |status| {
        status["phase"] == "complete" && status["target"] == 9
    });
    assert_shows_files(&viewer, &mut page, folder.path());
}

/// A file that changes during loading is loaded again. The scene has many triangles without area,
/// which make the loading slow.
#[test]
fn changes_while_the_scene_loads_are_loaded() {
    let folder = lit_floor();
    let obj = folder.path().join("a.obj");
    let line = "v 0 0 0\nf -1 -1 -1\n".repeat(800_000);
    fs::write(&obj, fs::read_to_string(&obj).unwrap() + &line).unwrap();
    let mtl = folder.path().join("a.mtl");
    let library = fs::read_to_string(&mtl).unwrap();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    fs::write(&obj, fs::read_to_string(&obj).unwrap() + "# changed\n").unwrap();
    page.message_where("status", |status| status["phase"] == "loading");
    // The program may read the file before or after this time
    std::thread::sleep(std::time::Duration::from_millis(100));
    fs::write(&mtl, library.replace("0.5 0.4 0.3", "0.05 0.4 0.3")).unwrap();
    for _ in 0..2 {
        page.message_where("note", |note| note["text"].as_str().unwrap().contains("reloaded"));
    }
    assert_shows_files(&viewer, &mut page, folder.path());
}

/// A saved scene file keeps its permissions, byte-order mark and line breaks; hard links are
/// reported.
#[cfg(unix)]
#[test]
fn saved_scene_keeps_permissions_and_line_breaks() {
    use std::os::unix::fs::PermissionsExt;
    let folder = lit_floor();
    let scene = folder.path().join("s.toml");
    let text = format!("\u{feff}{}", scene_text(folder.path()).replace('\n', "\r\n"));
    fs::write(&scene, &text).unwrap();
    fs::set_permissions(&scene, fs::Permissions::from_mode(0o600)).unwrap();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.send(r#"{"do":"save-camera"}"#);
    let said = answer(&mut page);
    assert_eq!(said, "The camera is saved in s.toml.");
    assert_eq!(fs::metadata(&scene).unwrap().permissions().mode() & 0o777, 0o600);
    let saved = scene_text(folder.path());
    assert!(
        saved.starts_with("\u{feff}version = 1\r\n") && saved != text,
        "{saved:?}"
    );
    assert_eq!(saved.matches('\n').count(), saved.matches("\r\n").count(), "{saved:?}");
    fs::hard_link(&scene, folder.path().join("other.toml")).unwrap();
    page.send(r#"{"do":"save-camera"}"#);
    let said = answer(&mut page);
    assert!(said.contains("is saved") && said.contains("hard links"), "{said}");
    assert_shows_files(&viewer, &mut page, folder.path());
}

/// If the scene file is replaced by a pipe, the save is refused, and the viewer continues.
#[cfg(unix)]
#[test]
fn pipe_as_scene_file_is_refused() {
    let folder = lit_floor();
    let scene = folder.path().join("s.toml");
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.send(&material("floor", "diffuse", "[0.1, 0.7, 0.2]").to_string());
    page.message("note");
    page.wait_for_all();
    fs::remove_file(&scene).unwrap();
    assert!(Command::new("mkfifo").arg(&scene).status().unwrap().success());
    for part in ["camera", "changes"] {
        page.send(&json!({ "do": format!("save-{part}") }).to_string());
        let said = answer(&mut page);
        assert!(
            said.contains("not saved") && said.contains("not a regular file"),
            "{said}"
        );
    }
    assert_eq!(viewer.interrupt().0, Some(130));
}

/// If the scene file is a symbolic link, a save keeps the link.
#[cfg(unix)]
#[test]
fn save_of_a_linked_scene_keeps_the_link() {
    let folder: TempDir = lit_floor();
    let path = |name: &str| folder.path().join(name);
    std::os::unix::fs::symlink("s.toml", path("link.toml")).unwrap();
    let viewer = Viewer::start(folder.path(), &["link.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"save-camera"}"#);
    assert!(answer(&mut page).contains("is saved"));
    assert!(fs::symlink_metadata(path("link.toml")).unwrap().is_symlink());
    assert!(scene_text(folder.path()).contains("look_at = [0.0, 0.3, 0.0]"));
}
