//! The oldest supported Rust is the version in Debian 13. Later compilers accept newer syntax
//! without a warning. clippy reports functions that are too new, but not syntax that is too new.

use std::fs;
use std::path::{Path, PathBuf};
use syn::visit::{self, Visit};
use syn::{BinOp, Expr, ExprBinary};

/// Chains of `let` in the conditions of `if` and `while`, which Rust has since 1.88.
#[derive(Default)]
struct LetChains(usize);

impl<'ast> Visit<'ast> for LetChains {
    fn visit_expr_binary(&mut self, binary: &'ast ExprBinary) {
        let is_let = |side: &Expr| matches!(side, Expr::Let(_));
        if matches!(binary.op, BinOp::And(_)) && (is_let(&binary.left) || is_let(&binary.right)) {
            self.0 += 1;
        }
        visit::visit_expr_binary(self, binary);
    }
}

fn let_chains(text: &str) -> usize {
    let mut found = LetChains::default();
    found.visit_file(&syn::parse_file(text).unwrap());
    found.0
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn no_conditions_chain_let() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let manifest = fs::read_to_string(root.join("Cargo.toml")).unwrap();
    assert!(
        manifest.contains("rust-version = \"1.85\""),
        "a later Rust may need no such test"
    );
    let mut files = vec![root.join("build.rs")];
    for folder in ["src", "sys", "python", "tests", "examples", "benches"] {
        rust_files(&root.join(folder), &mut files);
    }
    let wrong: Vec<&PathBuf> = files
        .iter()
        .filter(|file| let_chains(&fs::read_to_string(file).unwrap()) > 0)
        .collect();
    assert!(
        wrong.is_empty(),
        "Rust 1.85 has no `&& let` in conditions: nest them in {wrong:#?}"
    );
    assert!(files.len() > 500, "{} files", files.len());
}

#[test]
fn chains_of_let_are_found() {
    assert_eq!(
        let_chains("fn f(x: Option<u8>) { if x != None && let Some(y) = x { g(y) } }"),
        1
    );
    assert_eq!(
        let_chains("fn f() { while let Some(x) = next() && x > 0 && let Ok(y) = x.get() {} }"),
        2
    );
    assert_eq!(let_chains("fn f(x: bool) { if let Some(y) = g(x && !x) {} }"), 0);
}
