//! Every integrator on every scene of `scenes/`, by this program and by another build: the same bits. `scripts/same-pictures` runs it.

use crate::support::program::{INTEGRATORS, PROGRAM, assert_same_bits};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::thread;

/// Renders by `program` into `file`; whether it did. Some scenes have no light that some integrators could find.
fn render(program: &Path, scene: &Path, flags: &str, file: &Path) -> bool {
    let mut command = Command::new(program);
    command
        .arg("render")
        .arg(scene)
        .args(flags.split(' '))
        .arg("-o")
        .arg(file);
    let out = command.output().unwrap();
    let words = String::from_utf8_lossy(&out.stderr);
    assert!(
        matches!(out.status.code(), Some(0..=2)),
        "{} {flags}: {words}",
        scene.display()
    );
    out.status.success()
}

#[test]
#[ignore = "needs another build of the program: scripts/same-pictures"]
fn pictures_are_those_of_another_build() {
    let other =
        PathBuf::from(std::env::var_os("EMBRASURE_OTHER").expect("EMBRASURE_OTHER: another build of the program"));
    let mut scenes: Vec<PathBuf> = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    scenes.sort();
    assert!(scenes.len() > 5);
    let backends: &[&str] = if cfg!(feature = "obvhs") {
        &["embree", "obvhs"]
    } else {
        &["embree"]
    };
    let mut work = Vec::new();
    for scene in &scenes {
        for backend in backends {
            for integrator in INTEGRATORS.iter().chain(&["path --reuse none"]) {
                work.push((
                    scene,
                    format!("--size 48x32 --spp 3 --photons 3000 --cache-rays 64 -q --backend {backend} --integrator {integrator}"),
                ));
            }
        }
    }
    let (count, rest, compared) = (work.len(), Mutex::new(work), Mutex::new(0));
    let run = || {
        let folder = tempfile::tempdir().unwrap();
        let [mine, theirs] = ["mine.exr", "theirs.exr"].map(|name| folder.path().join(name));
        loop {
            let Some((scene, flags)) = rest.lock().unwrap().pop() else {
                return;
            };
            let done = [(Path::new(PROGRAM), &mine), (&other, &theirs)]
                .map(|(program, file)| render(program, scene, &flags, file));
            assert_eq!(done[0], done[1], "{} {flags}: one build refuses it", scene.display());
            if done[0] {
                println!("{} {flags}", scene.display());
                assert_same_bits(&mine, &theirs);
                *compared.lock().unwrap() += 1;
            }
        }
    };
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(run);
        }
    });
    let compared = compared.into_inner().unwrap();
    println!("{compared} of {count} pictures compared: the same bits");
    assert!(2 * compared > count);
}
