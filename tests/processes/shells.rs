//! The program in shells: completions, manual pages, colours, signals.

use crate::support::program::{PROGRAM, command, folder, printed, refused, words};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// Environment variables that control colours; the machine may have set them.
const COLOUR: [&str; 5] = ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "TERM", "CI"];

fn embrasure(args: &[&str]) -> Output {
    let mut command = command(Path::new("."), args);
    for name in COLOUR {
        command.env_remove(name);
    }
    command.output().unwrap()
}

/// Returns true if the program `program` is on this machine. Otherwise prints that the test is
/// skipped.
fn there_is(program: &str) -> bool {
    let found = Command::new("sh")
        .args(["-c", "command -v \"$1\"", "sh", program])
        .output()
        .unwrap();
    if !found.status.success() {
        println!("skipped: what needs {program}");
    }
    found.status.success()
}

/// The commands listed in the help.
fn commands() -> Vec<String> {
    let help = printed(&embrasure(&["--help"]));
    let (_, list) = help.split_once("Every day:\n").expect("a list of commands");
    let names = list.lines().take_while(|line| *line != "Options:");
    // Continuation lines of descriptions have a larger indent.
    let names = names.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names
        .filter_map(|line| line.split_whitespace().next().map(str::to_string))
        .collect()
}

#[test]
fn every_help_has_examples() {
    let commands = commands();
    for name in ["render", "info", "completions", "man"] {
        assert!(commands.iter().any(|c| c == name), "{name} is not in {commands:?}");
    }
    for command in commands.iter().filter(|c| *c != "help") {
        let help = printed(&embrasure(&[command, "--help"]));
        let (_, examples) = help
            .split_once("Examples:\n")
            .unwrap_or_else(|| panic!("{command} has no examples"));
        assert!(examples.contains(&format!("  embrasure {command}")), "{command}");
    }
}

/// Bash executes its completion script. The other shells only parse their scripts, if they are
/// installed.
#[test]
fn shells_complete() {
    let folder = tempfile::tempdir().unwrap();
    let script = |shell: &str| {
        let out = embrasure(&["completions", shell]);
        assert!(out.status.success());
        let path = folder.path().join(shell);
        fs::write(&path, &out.stdout).unwrap();
        let words = printed(&out);
        assert!(
            words.contains("render") && words.contains("threads"),
            "{shell}: {words}"
        );
        path
    };
    let complete = "source \"$1\"; COMP_WORDS=(\"${@:2}\"); COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
        _embrasure embrasure \"${COMP_WORDS[-1]}\" \"${COMP_WORDS[-2]}\"; echo \"${COMPREPLY[@]}\"";
    let path = script("bash");
    for (typed, expected) in [
        (["embrasure", "ren"].as_slice(), "render"),
        (&["embrasure", "render", "--light-sel"], "--light-selection"),
        (&["embrasure", "completions", "fi"], "fish"),
        (
            &["embrasure", "render", "a.obj", "--light-selection", "vis"],
            "visibility",
        ),
        (&["embrasure", "develop", "a.exr", "--tone", "ag"], "agx"),
        (&["embrasure", "lab", "a.obj", "--methods", "bdp"], "bdpt"),
        (
            &["embrasure", "help", "missing-tex"],
            "missing-texture missing-texture-coordinates",
        ),
    ] {
        let args = [&["-c", complete, "bash", path.to_str().unwrap()], typed].concat();
        let out = Command::new("bash").args(args).output().unwrap();
        assert_eq!(printed(&out).trim(), expected, "{typed:?}: {}", words(&out));
    }
    for shell in ["zsh", "fish"] {
        let path = script(shell);
        let text = fs::read_to_string(&path).unwrap();
        for value in ["visibility", "aces-narkowicz", "blackman-harris"] {
            assert!(text.contains(value), "{shell}: {value}");
        }
        if there_is(shell) {
            let read = Command::new(shell).arg("-n").arg(path).output().unwrap();
            assert!(read.status.success(), "{shell}: {}", words(&read));
        }
    }
    script("elvish");
    script("powershell");
}

#[test]
fn manual_pages_are_complete() {
    let folder = tempfile::tempdir().unwrap();
    let out = embrasure(&["man", "-o", folder.path().to_str().unwrap()]);
    assert!(out.status.success(), "{}", words(&out));
    let mut pages: Vec<String> = fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    let mut expected: Vec<String> = commands()
        .iter()
        .map(|c| format!("embrasure-{c}.1"))
        .chain(["embrasure.1".to_string()])
        .collect();
    pages.sort();
    expected.sort();
    assert_eq!(pages, expected);

    for page in &pages {
        let path = folder.path().join(page);
        let source = fs::read_to_string(&path).unwrap();
        assert!(
            source.contains("\n  embrasure "),
            "{page} has no examples, line by line"
        );
        if there_is("mandoc") {
            // Ignore warnings about long lines and about the missing date.
            let out = Command::new("mandoc")
                .args(["-T", "lint", "-W", "error"])
                .arg(&path)
                .output();
            assert!(out.as_ref().unwrap().status.success(), "{page}: {out:?}");
        }
        if there_is("man") {
            let mut man = Command::new("man");
            let out = man
                .args(["--warnings", "-l"])
                .arg(&path)
                .env("MANWIDTH", "200")
                .output()
                .unwrap();
            assert!(out.status.success() && out.stderr.is_empty(), "{page}: {}", words(&out));
            let shown = printed(&out);
            assert!(
                shown.contains("--help") && shown.contains("embrasure 0."),
                "{page}: {shown}"
            );
        }
    }
    let out = embrasure(&["man"]);
    assert_eq!(out.stdout, fs::read(folder.path().join("embrasure.1")).unwrap());
    let said = refused(Path::new("."), &["man", "-o", "/no/such/folder"], 1);
    assert!(said.contains("mkdir -p"), "{said}");
}

/// A folder with a triangle.
fn triangle() -> TempDir {
    folder(&[("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")])
}

/// Output has colours on terminals that support them, unless the user decides otherwise. NO_COLOR
/// takes precedence.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn colours_are_for_terminals() {
    let folder = triangle();
    let render = "render t.obj --size 64x64 --spp 64 --threads 1";
    // Test an error of this program, an error of clap, help, and a render with its progress bar
    let cases = ["render gone.obj", "bogus", "--help", render];
    let run = |on_terminal: bool, args: &str, variables: &[(&str, &str)]| {
        let line = format!("'{PROGRAM}' {args}");
        let mut command = Command::new(if on_terminal { "script" } else { "sh" });
        for name in COLOUR {
            command.env_remove(name);
        }
        command.current_dir(folder.path()).stdin(Stdio::null());
        command.args([if on_terminal { "-qec" } else { "-c" }, &line]);
        if on_terminal {
            command.arg("/dev/null").env("TERM", "xterm");
        }
        let out = command.envs(variables.iter().copied()).output().unwrap();
        printed(&out) + &words(&out)
    };
    // Escapes for colours end in m. Escapes of the progress bar move the cursor.
    let coloured = |said: &str| {
        said.split("\x1b[").skip(1).any(|rest| {
            let end = rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';');
            end.starts_with('m')
        })
    };

    for args in cases {
        let plain = run(false, args, &[]);
        assert!(!plain.is_empty() && !plain.contains('\x1b'), "{args}: {plain:?}");
    }
    let forced = run(false, cases[0], &[("CLICOLOR_FORCE", "1")]);
    assert!(forced.starts_with("\x1b[1m\x1b[31merror:\x1b[0m "), "{forced:?}");
    let both = run(false, cases[0], &[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]);
    assert!(!coloured(&both), "{both:?}");

    if !there_is("script") {
        return;
    }
    for args in cases {
        let shown = run(true, args, &[]);
        assert!(coloured(&shown), "{args}: {shown:?}");
        for variables in [
            [("NO_COLOR", "1"), ("TERM", "xterm")].as_slice(),
            &[("NO_COLOR", "1"), ("CLICOLOR_FORCE", "1")],
            &[("TERM", "dumb")],
            &[("CLICOLOR", "0")],
        ] {
            let shown = run(true, args, variables);
            assert!(!coloured(&shown), "{args} with {variables:?}: {shown:?}");
        }
    }
}

/// A scheduler signals both the script of a job and the program, and the script forwards its signal
/// to the program. Two signals at nearly the same time therefore count as one signal. A later
/// signal counts separately.
#[cfg(unix)]
#[test]
fn signals_at_once_are_one() {
    use std::os::unix::process::ExitStatusExt;
    let folder = triangle();
    let start = || {
        let args: Vec<&str> = "render t.obj --size 512x512 --spp 1000000 --write-every 0.01s -o t.exr -q"
            .split(' ')
            .collect();
        let child = command(folder.path(), &args).spawn().unwrap();
        // The render is running as soon as the image exists.
        for _ in 0..1500 {
            if folder.path().join("t.exr").exists() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        child
    };
    let child = start();
    let twice = format!("kill -TERM {0}; sleep 0.02; kill -TERM {0}", child.id());
    assert!(Command::new("sh").args(["-c", &twice]).status().unwrap().success());
    let out = child.wait_with_output().unwrap();
    assert_eq!((out.status.code(), out.status.signal()), (Some(130), None));
    assert!(folder.path().join("t.exr").exists(), "{}", words(&out));
}
