//! The viewer opens a browser if there is a desktop, and works without a desktop.

use crate::support::program::{PROGRAM, lit_floor, signal};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Script `xdg-open` that saves its arguments, and the file in the first argument.
const OPEN: &str = "#!/bin/sh\nfolder=${0%/*}\nstat -c %a \"$1\" > $folder/mode\ncp \"$1\" $folder/page.html\nprintf '%s ' \"$@\" > $folder/all\nmv $folder/all $folder/arguments\n";

/// Starts a viewer with or without a desktop; returns it with its printed link.
fn start(folder: &Path, display: Option<&str>) -> (Child, String) {
    let open = folder.join("xdg-open");
    fs::write(&open, OPEN).unwrap();
    fs::set_permissions(&open, fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).args(["view", "s.toml"]).env("PATH", path);
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION"] {
        command.env_remove(name);
    }
    if let Some(display) = display {
        command.env("DISPLAY", display);
    }
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut link = String::new();
    BufReader::new(child.stdout.as_mut().unwrap())
        .read_line(&mut link)
        .unwrap();
    (child, link.trim().into())
}

fn end(mut child: Child, link: &str) {
    signal(&child, "INT");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(TcpStream::connect(address(link)).is_err(), "{link} is still served");
}

fn address(link: &str) -> &str {
    link.strip_prefix("http://").unwrap().split('/').next().unwrap()
}

#[test]
fn viewer_without_a_display_prints_the_link() {
    let folder = lit_floor();
    let (mut child, link) = start(folder.path(), None);
    let path = link.split_once(address(&link)).unwrap().1;
    let mut stream = TcpStream::connect(address(&link)).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", address(&link)).unwrap();
    let mut page = String::new();
    stream.read_to_string(&mut page).unwrap();
    assert!(
        page.starts_with("HTTP/1.1 200 ") && page.contains("<title>Embrasure</title>"),
        "{page}"
    );
    assert!(child.try_wait().unwrap().is_none());
    assert!(!folder.path().join("arguments").exists(), "a browser was opened");
    end(child, &link);
}

/// All users of a machine can read the arguments of a program, so the link is in a file that only
/// its owner can read.
#[test]
fn token_is_not_in_arguments_of_the_browser() {
    let folder = lit_floor();
    let (child, link) = start(folder.path(), Some(":99"));
    let arguments = folder.path().join("arguments");
    let begin = Instant::now();
    while !arguments.exists() {
        assert!(begin.elapsed() < Duration::from_secs(30), "no browser was opened");
        thread::sleep(Duration::from_millis(20));
    }
    let file = fs::read_to_string(arguments).unwrap();
    let token = link.trim_end_matches('/').rsplit('/').next().unwrap();
    assert!(token.len() == 32 && !file.contains(token), "{file}");
    assert_eq!(fs::read_to_string(folder.path().join("mode")).unwrap().trim(), "600");
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains(&format!("url={link}\"")), "{page}");
    end(child, &link);
    assert!(!Path::new(file.trim()).exists(), "{file} was left");
}
