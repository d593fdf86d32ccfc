//! Statements of the OBJ and MTL specifications: each is read, or `check` lists it with its effect.

use crate::support::program::*;
use serde_json::Value;

/// Statements of the OBJ format (Wavefront, version 3.0) with arguments. True if the reader uses
/// the statement.
const OBJ: [(&str, bool); 43] = [
    ("v 0 0 0", true),
    ("vt 0 0", true),
    ("vn 0 0 1", true),
    ("vp 0.1 0.2", false),
    ("cstype bezier", false),
    ("deg 3 3", false),
    ("bmat u 1 0 0 1", false),
    ("step 1 1", false),
    ("p 1", false),
    ("l 1 2", false),
    ("f 1 2 3", true),
    ("curv 0 1 1 2", false),
    ("curv2 1 2", false),
    ("surf 0 1 0 1 1 2 3 4", false),
    ("parm u 0 1", false),
    ("trim 0 1 1", false),
    ("hole 0 1 1", false),
    ("scrv 0 1 1", false),
    ("sp 1", false),
    ("end", false),
    ("con 1 0 1 1 2 0 1 1", false),
    ("g part", true),
    ("s 1", true),
    ("mg 1 0.5", false),
    ("o object", true),
    ("bevel on", false),
    ("c_interp on", false),
    ("d_interp on", false),
    ("lod 3", false),
    ("maplib a.map", false),
    ("usemap wood", false),
    ("usemtl m", true),
    ("mtllib a.mtl", true),
    ("shadow_obj b.obj", false),
    ("trace_obj b.obj", false),
    ("ctech cparm 1", false),
    ("stech cparma 1 1", false),
    ("call b.obj", false),
    ("csh ls", false),
    ("bzp 1 2 3 4", false),
    ("bsp 1 2 3 4", false),
    ("cdc 1 2 3", false),
    ("res 4 4", false),
];

/// Statements of the MTL format. True if the reader uses the statement.
const MTL: [(&str, bool); 23] = [
    ("newmtl m", true),
    ("Ka 0.1 0.1 0.1", true),
    ("Kd 0.2 0.2 0.2", true),
    ("Ks 0.2 0.2 0.2", true),
    ("Ke 0 0 0", true),
    ("Tf 1 1 1", true),
    ("illum 2", true),
    ("d 1", true),
    ("Tr 0", true),
    ("Ns 10", true),
    ("Ni 1.5", true),
    ("map_Kd w.png", true),
    ("map_Ks w.png", true),
    ("map_Ns w.png", true),
    ("map_d w.png", true),
    ("bump w.png", true),
    ("sharpness 60", false),
    ("map_Ka w.png", false),
    ("map_aat on", false),
    ("decal w.png", false),
    ("disp w.png", true),
    ("refl -type sphere w.png", false),
    ("map_disp w.png", true),
];

/// Keywords in backquotes in the messages of findings, each with its line.
fn listed(findings: &[Value], file: &str) -> Vec<(String, u64)> {
    let codes = ["ignored-statement", "skipped-elements"];
    let of_list = findings.iter().filter(|finding| {
        codes.iter().any(|code| finding["code"] == *code) && finding["file"].as_str().unwrap_or("").ends_with(file)
    });
    let words = |finding: &Value| {
        let (message, line) = (
            finding["message"].as_str().unwrap().to_string(),
            finding["line"].as_u64().unwrap(),
        );
        let words: Vec<(String, u64)> = message
            .split('`')
            .skip(1)
            .step_by(2)
            .map(|word| (word.into(), line))
            .collect();
        words
    };
    of_list.flat_map(words).collect()
}

#[test]
fn each_statement_is_read_or_listed() {
    // `check` lists a superseded statement under the name of the element that replaces it.
    let listed_as = |keyword: &'static str| match keyword {
        "curv2" | "cdc" => "curv",
        "bzp" | "bsp" => "surf",
        other => other,
    };
    let begin = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\n";
    for (statements, is_obj) in [(&OBJ[..], true), (&MTL[..], false)] {
        for (statement, is_read) in statements {
            let keyword = statement.split(' ').next().unwrap();
            let (obj, mtl) = match is_obj {
                true => (
                    format!("mtllib a.mtl\nusemtl m\n{begin}{statement}\n{statement}\n"),
                    "newmtl m\nKd 0.5 0.5 0.5\n".into(),
                ),
                false => (
                    format!("mtllib a.mtl\nusemtl m\n{begin}"),
                    format!("newmtl m\n{statement}\n{statement}\n"),
                ),
            };
            let folder = folder(&[("a.obj", &obj), ("a.mtl", &mtl)]);
            write_grey_png(&folder.path().join("w.png"), &[0, 128, 255, 128]);
            let report = json(&run(folder.path(), &["check", "a.obj", "--json"]));
            let findings = report["findings"].as_array().unwrap();
            let is_unknown = |finding: &Value| {
                ["unknown-statement", "unknown-keyword"]
                    .iter()
                    .any(|code| finding["code"] == *code)
            };
            assert!(!findings.iter().any(is_unknown), "{statement}: {report:#}");
            let file = if is_obj { "a.obj" } else { "a.mtl" };
            let found = listed(findings, file);
            let line = if is_obj { 8 } else { 2 };
            let name = listed_as(keyword).to_string();
            let is_listed = found
                .iter()
                .any(|(word, at)| (word.eq_ignore_ascii_case(&name)) && *at == line);
            assert_eq!(is_listed, !is_read, "{statement}: {found:?}");
        }
    }
}

#[test]
fn the_list_has_lines_and_counts() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nbevel on\nf 1 2 3\nbevel off\nlod 3\nbevel on\n";
    let folder = folder(&[("a.obj", obj)]);
    let printed = printed(&run(folder.path(), &["check", "a.obj"]));
    assert!(
        printed.contains("a.obj:4: note: 3 statements `bevel` have no effect, the first in this line:"),
        "{printed}"
    );
    assert!(printed.contains("a.obj:7: note: `lod` has no effect:"), "{printed}");
    // Unlike `check`, `render` does not list the statements that it ignores.
    let said = words(&done(folder.path(), &split("render a.obj --size 8x8 --spp 1 -o t.png")));
    assert!(!said.contains("bevel"), "{said}");
}
