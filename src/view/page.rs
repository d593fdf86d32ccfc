//! The files of the page. They are written by hand, and compiled into the program. They load
//! nothing from other servers.

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Names, content types and contents of the files.
const FILES: &[(&str, &str, &str)] = &[
    ("", HTML, include_str!("page/index.html")),
    ("style.css", CSS, include_str!("page/style.css")),
    ("panel.css", CSS, include_str!("page/panel.css")),
    ("main.js", SCRIPT, include_str!("page/main.js")),
    ("link.js", SCRIPT, include_str!("page/link.js")),
    ("coding.js", SCRIPT, include_str!("page/coding.js")),
    ("lights.js", SCRIPT, include_str!("page/lights.js")),
    ("groups.js", SCRIPT, include_str!("page/groups.js")),
    ("compare.js", SCRIPT, include_str!("page/compare.js")),
    ("tone.js", SCRIPT, include_str!("page/tone.js")),
    ("picture.js", SCRIPT, include_str!("page/picture.js")),
    ("camera.js", SCRIPT, include_str!("page/camera.js")),
    ("pointer.js", SCRIPT, include_str!("page/pointer.js")),
    ("controls.js", SCRIPT, include_str!("page/controls.js")),
    ("inspect.js", SCRIPT, include_str!("page/inspect.js")),
    ("keys.js", SCRIPT, include_str!("page/keys.js")),
    ("materials.js", SCRIPT, include_str!("page/materials.js")),
    ("selection.js", SCRIPT, include_str!("page/selection.js")),
    ("views.js", SCRIPT, include_str!("page/views.js")),
    ("hints.js", SCRIPT, include_str!("page/hints.js")),
    ("ball.js", SCRIPT, include_str!("page/ball.js")),
    ("names.js", SCRIPT, include_str!("page/names.js")),
    ("fields.js", SCRIPT, include_str!("page/fields.js")),
    ("parameters.js", SCRIPT, include_str!("page/parameters.js")),
];

/// Content type and content of the file `name`.
pub(super) fn file(name: &str) -> Option<(&'static str, &'static str)> {
    let found = FILES.iter().find(|(known, ..)| *known == name);
    found.map(|(_, kind, text)| (*kind, *text))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Scripts import existing files, and the page names no other server.
    #[test]
    fn the_page_is_whole() {
        for (name, _, text) in FILES {
            for import in text.split("from \"./").skip(1) {
                let imported = import.split('"').next().unwrap();
                assert!(file(imported).is_some(), "{name} imports {imported}");
            }
            let addresses = text.replace("http://www.w3.org/2000/svg", "");
            assert!(
                !addresses.contains("http://") && !addresses.contains("https://"),
                "{name}"
            );
        }
    }
}
