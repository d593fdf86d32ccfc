//! Runs the Python tests of this folder with pytest, against the program and the module that cargo
//! has built with this test.

use std::env;
use std::path::Path;
use std::process::Command;

/// Runs `command`. If the command fails, the test fails with the output of the command.
fn run(command: &mut Command) {
    let out = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let said = [&out.stdout[..], &out.stderr].map(String::from_utf8_lossy).concat();
    assert!(out.status.success(), "{command:?}: {}\n{said}", out.status);
    println!("{said}");
}

#[test]
#[cfg_attr(not(python), ignore = "the environment of scripts/setup-python is missing")]
fn python_tests_pass() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    // Cargo runs this test in target/PROFILE/deps, where it also puts the module. The program is in
    // the parent folder.
    let this = env::current_exe().unwrap();
    let deps = this.parent().unwrap();
    let package = tempfile::tempdir().unwrap();
    run(Command::new(root.join("scripts/python-package"))
        .arg(deps.join("libembrasure_python.so"))
        .arg(package.path()));
    let search = env::join_paths([package.path(), &root.join("python/tests")]).unwrap();
    run(Command::new(root.join(".deps/python/bin/python"))
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=8"])
        .arg("python/tests")
        .current_dir(root)
        .env("EMBRASURE_PROGRAM", deps.with_file_name("embrasure"))
        .env("PYTHONPATH", search));
}
