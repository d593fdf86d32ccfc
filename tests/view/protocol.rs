//! The server of `embrasure view`, tested without a browser: bit-identical images, refusals, files,
//! shutdown.

use super::{PATIENCE, Page, Viewer};
use crate::support::program::{assert_same_bits, code, done, folder, json, lit_floor, run, split, words};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};
use tungstenite::Message;

/// Maximum time of a shutdown. It is shorter than the timeout of writing to a page, 20 s
/// (`src/view/server.rs`).
const END: Duration = Duration::from_secs(15);

/// Saves the image of a viewer as a file.
fn save(viewer: &Viewer, path: &Path) {
    let (status, bytes) = viewer.get("picture.exr");
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&bytes));
    fs::write(path, bytes).unwrap();
}

/// The image of N samples equals `render --spp N`. This also holds after the camera moved away and
/// back, and after samples were added.
#[test]
fn pictures_have_the_bits_of_a_render() {
    let folder = lit_floor();
    let folder = folder.path();
    for method in ["path", "sppm --photons 500", "irradiance-cache --cache-rays 16"] {
        let flags = format!("s.toml --spp 64 --integrator {method}");
        let rendered = folder.join("r.exr");
        done(folder, &split(&format!("render {flags} -q -o r.exr")));
        let viewer = Viewer::start(folder, &split(&flags));
        let mut page = viewer.page();
        let state = page.message("state");
        page.wait_for_all();
        save(&viewer, &folder.join("v.exr"));
        assert_same_bits(&rendered, &folder.join("v.exr"));

        let home = &state["camera"];
        for step in 1..=20 {
            let mut camera = home.clone();
            camera["position"][0] = (f64::from(step) / 10.0).into();
            page.look(&camera);
        }
        page.look(home);
        page.frame_where(|header| header["preview"] == false && header["samples"] == 64.0);
        page.wait_for_all();
        save(&viewer, &folder.join("v.exr"));
        assert_same_bits(&rendered, &folder.join("v.exr"));
    }

    // Samples that exist already are kept
    let viewer = Viewer::start(folder, &split("s.toml --spp 20"));
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"set","key":"samples","value":"64"}"#);
    page.message_where("status", |s| s["phase"] == "complete" && s["target"] == 64);
    save(&viewer, &folder.join("v.exr"));
    done(folder, &split("render s.toml -q --spp 64 -o r.exr"));
    assert_same_bits(&folder.join("r.exr"), &folder.join("v.exr"));

    // Use another integrator and another size
    page.send(r#"{"do":"set","key":"integrator","value":"naive"}"#);
    page.send(r#"{"do":"set","key":"max_depth","value":"3"}"#);
    page.send(r#"{"do":"set","key":"width","value":"30"}"#);
    page.frame_where(|header| header["width"] == 30 && header["samples"] == 64.0);
    page.wait_for_all();
    save(&viewer, &folder.join("v.exr"));
    done(
        folder,
        &split("render s.toml -q --spp 64 --size 30x24 --integrator naive --max-depth 3 -o r.exr"),
    );
    assert_same_bits(&folder.join("r.exr"), &folder.join("v.exr"));

    // Use another light selection, which needs no new scene
    let flags = "s.toml --spp 16 --light-selection all";
    let viewer = Viewer::start(folder, &split(flags));
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"set","key":"lamp_samples","value":"3"}"#);
    page.frame_where(|header| header["samples"] == 16.0 && header["final"] == true);
    page.wait_for_all();
    save(&viewer, &folder.join("v.exr"));
    done(folder, &split(&format!("render {flags} -q --lamp-samples 3 -o r.exr")));
    assert_same_bits(&folder.join("r.exr"), &folder.join("v.exr"));
}

/// Images for pages have the light of the render, as 16-bit floats.
#[test]
fn pages_get_the_light_of_the_render() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    let hello = page.message("hello");
    assert!(hello["scene"] == "s.toml" && hello["triangles"] == 4, "{hello}");
    let frame = page.frame_where(|header| header["samples"] == 4.0 && header["final"] == true);
    assert_eq!(frame.header["channel"], "picture");
    done(folder.path(), &split("render s.toml -q -o r.exr"));
    let expected = super::halves_of(&folder.path().join("r.exr"));
    assert!(frame.halves().eq(expected));

    page.send(r#"{"do":"channel","name":"N"}"#);
    let normals = page.frame_where(|header| header["channel"] == "N");
    assert_eq!(normals.pixels.len(), 40 * 24 * 6);
    page.send(r#"{"do":"set","key":"denoise","value":"atrous"}"#);
    page.send(r#"{"do":"channel","name":"denoised"}"#);
    let denoised = page.frame_where(|header| header["denoised"] == true);
    assert_ne!(denoised.pixels, frame.pixels);

    let (status, png) = viewer.get("picture.png?exposure=1&tone=srgb");
    assert!(status == 200 && png.starts_with(b"\x89PNG"));
}

/// `--aov` adds channels to the saved image, as in `render`. Ids are rendered only while a page
/// shows them.
#[test]
fn additional_channels_equal_a_render() {
    let folder = lit_floor();
    let path = folder.path();
    let viewer = Viewer::start(path, &split("s.toml --aov P,uv,direct"));
    let mut page = viewer.page();
    let mut camera = page.message("state")["camera"].clone();
    let home = camera["position"][0].clone();
    page.wait_for_all();
    save(&viewer, &path.join("v.exr"));
    done(path, &split("render s.toml -q --aov P,uv,direct -o r.exr"));
    assert_same_bits(&path.join("r.exr"), &path.join("v.exr"));

    page.send(r#"{"do":"channel","name":"id"}"#);
    let ids = page.frame_where(|header| header["channel"] == "id" && header["samples"] == 4.0);
    done(path, &split("render s.toml -q --aov id -o r.exr"));
    let expected = crate::support::read_channel(&path.join("r.exr"), "id.object");
    assert!(expected.contains(&1.0) && expected.contains(&0.0), "{expected:?}");
    let found: Vec<f32> = ids.halves().step_by(3).map(|id| id.to_f32()).collect();
    assert_eq!(found, expected);
    // The channel of ids follows the moving camera.
    camera["position"][0] = 0.5.into();
    camera["do"] = "camera".into();
    page.send(&camera.to_string());
    page.frame_where(|header| header["channel"] == "id" && header["moves"] == 1);

    page.send(r#"{"do":"channel","name":"picture"}"#);
    camera["position"][0] = home;
    page.send(&camera.to_string());
    page.frame_where(|h| h["channel"] == "picture" && h["moves"] == 2 && h["preview"] == false && h["samples"] == 4.0);
    page.wait_for_all();
    save(&viewer, &path.join("w.exr"));
    assert_same_bits(&path.join("v.exr"), &path.join("w.exr"));

    let out = run(path, &split("view s.toml --no-open --aov nonsense"));
    assert!(
        code(&out) != 0 && words(&out).contains("--aov nonsense"),
        "{}",
        words(&out)
    );
}

/// Requests without the token of the link, and requests from other pages, are refused.
#[test]
fn requests_without_the_token_are_refused() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let Viewer { address, token, .. } = &viewer;
    assert_eq!(viewer.get("").0, 200);
    let wrong = "0".repeat(32);
    let upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    for (path, headers, expected) in [
        (format!("/{wrong}/"), format!("Host: {address}\r\n"), 403),
        ("/".into(), format!("Host: {address}\r\n"), 403),
        (format!("/{wrong}/socket"), format!("Host: {address}\r\n{upgrade}"), 403),
        (format!("/{token}/"), "Host: evil.example\r\n".into(), 403),
        (
            format!("/{token}/socket"),
            format!("Host: {address}\r\nOrigin: http://evil.example\r\n{upgrade}"),
            403,
        ),
        (
            format!("/{token}/socket"),
            format!("Host: {address}\r\nOrigin: null\r\n{upgrade}"),
            403,
        ),
        (
            format!("/{token}/picture.exr"),
            format!("Host: {address}\r\nOrigin: http://evil.example\r\n"),
            403,
        ),
        (
            format!("/{token}/../../etc/passwd"),
            format!("Host: {address}\r\n"),
            404,
        ),
        (format!("/{token}/s.toml"), format!("Host: {address}\r\n"), 404),
        (format!("/{token}"), format!("Host: {address}\r\n"), 308),
        (
            format!("/{token}/"),
            format!("Host: {address}\r\nX: {}\r\n", "x".repeat(40_000)),
            431,
        ),
    ] {
        let (status, body) = viewer.request(&format!("GET {path} HTTP/1.1\r\n{headers}\r\n"));
        assert_eq!(status, expected, "{path} {headers}: {}", String::from_utf8_lossy(&body));
    }
    let post = format!("POST /{token}/ HTTP/1.1\r\nHost: {address}\r\n\r\n");
    assert_eq!(viewer.request(&post).0, 405);
    assert_eq!(viewer.get("main.js").0, 200);
}

/// Connections without the token cannot block a page, because the oldest of them are closed.
#[test]
fn half_open_connections_block_no_page() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    let connect = || TcpStream::connect(&viewer.address).unwrap();
    let mut idle: Vec<TcpStream> = (0..40).map(|_| connect()).collect();
    assert_eq!(viewer.get("").0, 200);
    let mut other = viewer.page();
    // Send incomplete requests
    for stream in &mut idle {
        let _ = stream.write_all(b"GET / HTTP/1.1\r\n");
    }
    idle.extend((0..40).map(|_| connect()));
    assert_eq!(viewer.get("main.js").0, 200);
    idle[0].set_read_timeout(Some(PATIENCE)).unwrap();
    let read = idle[0].read_to_end(&mut Vec::new());
    let is_open = read.is_err_and(|error| [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()));
    assert!(!is_open, "the oldest connection is open");
    // Pages that are open stay open.
    for page in [&mut page, &mut other] {
        page.send(r#"{"do":"restart"}"#);
        page.wait_for_all();
    }
    // Connections with the token have a separate limit.
    let pages: Vec<Page> = (0..30).map(|_| viewer.page()).collect();
    assert!(Page::open(&viewer).is_err());
    drop((pages, idle));
}

/// With port 0, the link has the port that the system selected.
#[test]
fn port_0_selects_a_free_port() {
    let folder = lit_floor();
    let viewers = [0, 1].map(|_| Viewer::start(folder.path(), &split("s.toml --port 0")));
    let [one, other] = viewers.each_ref().map(|viewer| viewer.address.clone());
    assert!(one != other && !one.ends_with(":0"), "{one} {other}");
    assert_eq!(viewers[0].get("").0, 200);
}

/// Sends ten thousand invalid messages. Each is answered, or its page is closed, and the render
/// continues.
#[test]
fn invalid_messages_are_survived() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let (mut sent, mut seed) = (0, 1_u64);
    let (mut pages, mut closed) = (0, 0);
    while sent < 10_000 {
        let mut page = viewer.page();
        for _ in 0..250 {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let bytes: Vec<u8> = (0..(seed >> 40) % 60).map(|i| (seed >> (i % 50)) as u8).collect();
            let message = match (seed >> 33) % 4 {
                0 => Message::text(String::from_utf8_lossy(&bytes).into_owned()),
                1 => Message::text(format!("{{\"do\":\"camera\",\"position\":[{},0]}}", seed >> 32)),
                2 => Message::text("[".repeat((seed >> 50) as usize)),
                _ => Message::Binary(bytes.into()),
            };
            if page.socket.send(message).is_err() {
                break;
            }
            sent += 1;
        }
        // Send bytes that are not WebSocket frames
        let stream = page.socket.get_mut();
        let _ = std::io::Write::write_all(stream, &seed.to_le_bytes().repeat(20));
        pages += 1;
        closed += usize::from((0..2000).any(|_| matches!(page.socket.read(), Err(_) | Ok(Message::Close(_)))));
    }
    assert_eq!(closed, pages, "a page sends nonsense on and on");
    let mut page = viewer.page();
    page.wait_for_all();
}

/// A page gets the values of a pixel that `render --pixel --json` prints.
#[test]
fn pixels_are_inspected() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.send(r#"{"do":"inspect","x":20,"y":15,"sample":3}"#);
    let found = page.message("inspect");
    let printed = json(&done(
        folder.path(),
        &split("render s.toml --pixel 20,15 --sample 3 --json -q"),
    ));
    assert_eq!(found["facts"], printed);
    assert_eq!(printed["samples"][0]["traces"][0]["vertices"][1]["material"], "floor");
    page.send(r#"{"do":"inspect","x":40,"y":0,"sample":0}"#);
    let refused = page.message("error");
    assert!(
        refused["text"].as_str().unwrap().contains("outside the image"),
        "{refused}"
    );
}

/// Actions of one page are sent to the other page, and both show the same image.
#[test]
fn two_pages_share_one_render() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let (mut one, mut other) = (viewer.page(), viewer.page());
    let mut camera = one.message("state")["camera"].clone();
    other.message("state");
    camera["position"][1] = 2.5.into();
    one.look(&camera);
    assert_eq!(other.message("camera")["camera"], camera);
    // An image of the first camera may still be in transit to one of the pages.
    let is_whole = |header: &Value| header["moves"] != 0 && header["preview"] == false && header["samples"] == 4.0;
    let [a, b] = [&mut one, &mut other].map(|page: &mut Page| page.frame_where(is_whole));
    assert_eq!(a.pixels, b.pixels);
    // Invalid commands are errors for the page that sent them, and change nothing.
    camera["vertical_fov"] = 200.0.into();
    camera["do"] = "camera".into();
    one.send(&camera.to_string());
    let said = one.message("error");
    assert!(said["text"].as_str().unwrap().contains("vertical_fov"), "{said}");
    one.send(r#"{"do":"set","key":"samples","value":"-3"}"#);
    one.message("error");
    other.send(r#"{"do":"restart"}"#);
    other.wait_for_all();
}

/// A changed file is reloaded. An error in the file is reported with file and line, and the old
/// image stays.
#[test]
fn files_are_watched() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    page.wait_for_all();
    let before = viewer.get("picture.exr").1;
    let obj = folder.path().join("a.obj");
    let faces = fs::read_to_string(&obj).unwrap();
    fs::write(&obj, format!("{faces}v 1e11 0 0\nf 1 2 -1\n")).unwrap();
    let said = page.message("error");
    assert!(said["text"].as_str().unwrap().contains("a.obj: vertex"), "{said}");
    page.message_where("status", |status| status["phase"] == "complete");
    let rgb = |bytes: &[u8]| {
        let path = folder.path().join("now.exr");
        fs::write(&path, bytes).unwrap();
        crate::support::read_rgb(&path)
    };
    assert_eq!(rgb(&before), rgb(&viewer.get("picture.exr").1));
    let triangle = "v -1 0.2 -1\nv 1 0.2 -1\nv 0 1 -1\nusemtl floor\nf -3 -2 -1\n";
    fs::write(&obj, format!("{faces}{triangle}")).unwrap();
    page.message("note");
    page.wait_for_all();
    save(&viewer, &folder.path().join("v.exr"));
    done(folder.path(), &split("render s.toml -q -o r.exr"));
    assert_same_bits(&folder.path().join("r.exr"), &folder.path().join("v.exr"));
    assert_ne!(rgb(&before), crate::support::read_rgb(&folder.path().join("v.exr")));
}

/// A material is changed like with `--material`, and then changed back.
#[test]
fn materials_are_changed() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    let hello = page.message("hello");
    let floor = hello["materials"]
        .as_array()
        .unwrap()
        .iter()
        .find(|m| m["name"] == "floor")
        .unwrap();
    assert!(
        (floor["keys"]["diffuse"][0].as_f64().unwrap() - 0.5).abs() < 1e-6,
        "{floor}"
    );
    page.send(r#"{"do":"material","name":"floor","key":"diffuse","value":"[0.1, 0.7, 0.2]"}"#);
    page.message("note");
    page.wait_for_all();
    save(&viewer, &folder.path().join("v.exr"));
    let args = [
        "render",
        "s.toml",
        "-q",
        "-o",
        "r.exr",
        "--material",
        "floor.diffuse=[0.1, 0.7, 0.2]",
    ];
    done(folder.path(), &args);
    assert_same_bits(&folder.path().join("r.exr"), &folder.path().join("v.exr"));
    page.send(r#"{"do":"material","name":"floor","key":"colour","value":"1"}"#);
    let said = page.message("error");
    assert!(said["text"].as_str().unwrap().contains("colour"), "{said}");
    page.send(r#"{"do":"material","name":"floor","key":"roughness","value":"-1"}"#);
    let said = page.message("error");
    assert!(said["text"].as_str().unwrap().contains("roughness"), "{said}");
    page.send(r#"{"do":"reset-changes"}"#);
    page.message("note");
    page.wait_for_all();
    save(&viewer, &folder.path().join("v.exr"));
    done(folder.path(), &split("render s.toml -q -o r.exr"));
    assert_same_bits(&folder.path().join("r.exr"), &folder.path().join("v.exr"));
}

/// The camera is saved in the scene file. A render of this file equals the displayed image.
#[test]
fn cameras_are_saved() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &["s.toml"]);
    let mut page = viewer.page();
    let mut camera = page.message("state")["camera"].clone();
    camera["position"][0] = 1.25.into();
    camera["lens_radius"] = 0.05.into();
    page.look(&camera);
    page.frame_where(|header| header["preview"] == false && header["samples"] == 4.0);
    page.send(r#"{"do":"save-camera"}"#);
    page.message("note");
    page.wait_for_all();
    save(&viewer, &folder.path().join("v.exr"));
    done(folder.path(), &split("render s.toml -q -o r.exr"));
    assert_same_bits(&folder.path().join("r.exr"), &folder.path().join("v.exr"));
    page.send(r#"{"do":"views"}"#);
    let views = page.message("views")["views"].clone();
    let cameras: BTreeSet<String> = views
        .as_array()
        .unwrap()
        .iter()
        .map(|view| view["camera"].to_string())
        .collect();
    assert!(cameras.len() > 3, "{views}");
    drop(viewer);

    // A bare OBJ cannot store a camera.
    let viewer = Viewer::start(folder.path(), &["a.obj", "--size", "20x20", "--spp", "1"]);
    let mut page = viewer.page();
    page.send(r#"{"do":"save-camera"}"#);
    assert!(
        page.message("error")["text"]
            .as_str()
            .unwrap()
            .contains("embrasure init")
    );
}

/// An interrupt ends the viewer at once. With `--exit-when-closed`, the viewer also ends when the
/// last page is closed. The port is closed after that.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn interrupt_or_closed_page_ends_the_viewer() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &split("s.toml --spp 100000"));
    let address = viewer.address.clone();
    let mut page = viewer.page();
    page.message("status");
    let (code_of, time) = viewer.interrupt();
    assert_eq!(code_of, Some(130));
    assert!(time < END, "{time:?}");
    assert!(TcpStream::connect(&address).is_err());

    // While a page is reloaded, it is closed for a moment.
    let mut viewer = Viewer::start(folder.path(), &split("s.toml --exit-when-closed"));
    let close = |mut page: Page| {
        page.message("status");
        page.socket.close(None).unwrap();
    };
    close(viewer.page());
    let start = Instant::now();
    thread::sleep(Duration::from_millis(500));
    let page = viewer.page();
    thread::sleep(Duration::from_millis(3200).saturating_sub(start.elapsed()));
    assert!(viewer.child.try_wait().unwrap().is_none(), "a reload ends the render");
    close(page);
    assert_eq!(viewer.child.wait().unwrap().code(), Some(0));
}

/// Idle connections, and pages that do not read, do not delay the shutdown.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn idle_pages_do_not_delay_the_shutdown() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &split("s.toml --size 1500x1500 --spp 1"));
    let _idle = TcpStream::connect(&viewer.address).unwrap();
    let mut reader = viewer.page();
    let mut deaf = viewer.page();
    deaf.send(r#"{"do":"channel","name":"picture","second":"variance"}"#);
    reader.wait_for_all();
    // At this time the image is in transit to the page that does not read.
    thread::sleep(Duration::from_millis(500));
    let (code_of, time) = viewer.interrupt();
    assert_eq!(code_of, Some(130));
    assert!(time < END, "{time:?}");
}

/// Usage errors are reported before the server starts.
#[test]
fn invalid_view_flags_are_errors() {
    let folder = folder(&[]);
    let refused = |line: &str, part: &str| {
        let out = run(folder.path(), &split(line));
        assert_ne!(code(&out), 0, "{line}");
        assert!(words(&out).contains(part), "{line}: {}", words(&out));
    };
    refused("view none.toml --no-open", "none.toml");
    refused("view s.toml --port 65536", "--port");
    refused("view s.toml --listen nowhere", "--listen");
    let scene = lit_floor();
    let viewer = Viewer::start(scene.path(), &["s.toml"]);
    let port = viewer.address.split(':').nth(1).unwrap();
    let out = run(scene.path(), &["view", "s.toml", "--no-open", "--port", port]);
    assert_eq!(code(&out), 1);
    assert!(words(&out).contains("use another --port"), "{}", words(&out));
}
