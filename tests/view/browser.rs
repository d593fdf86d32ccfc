//! The page of `embrasure view` in headless Chromium. Without Chromium the tests are left out with a word, unless EMBRASURE_REQUIRE_CHROMIUM is set.

use super::Viewer;
use super::chromium::{Browser, chromium};
use crate::support::program::{assert_same_bits, done, split};
use serde_json::{Value, json};
use std::env;
use std::fs;
use std::path::Path;
use std::thread;
use std::time::Duration;
use tempfile::TempDir;

/// Whether all samples of the picture itself are shown.
const COMPLETE: &str =
    "document.documentElement.dataset.phase === 'complete' && document.documentElement.dataset.samples === '16'";
/// The pixels of the picture as they are shown, as numbers.
const CODES: &str = "[...document.getElementById('picture').getContext('2d').getImageData(0, 0, embrasure.picture.canvas.width, embrasure.picture.canvas.height).data]";
const CAMERA: &str = "JSON.stringify(embrasure.camera.now)";

/// A copy of the Cornell box that tests may change.
fn cornell_box() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in ["cornell-box.toml", "cornell-box.obj", "cornell-box.mtl"] {
        fs::copy(scenes.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

const FLAGS: &str = "cornell-box.toml --size 128x128 --spp 16";

/// What people do: look, orbit, walk, undo, inspect, change looks and materials, keep the camera; with a second page, and to the end of the render.
#[test]
fn the_page_shows_and_steers_a_render() {
    let Some(program) = chromium() else { return };
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start(&program);
    let tab = browser.open(&viewer.link(), [1280, 720]);
    browser.wait(&tab, COMPLETE);
    assert_eq!(
        browser.value(&tab, "document.getElementById('scene').textContent"),
        "cornell-box.toml"
    );

    // The page shows light as the program does.
    let codes = browser.value(&tab, CODES);
    let (_, png) = viewer.get("picture.png?exposure=0&tone=srgb");
    let expected = image::load_from_memory(&png).unwrap().to_rgb8();
    let far = expected
        .as_raw()
        .chunks_exact(3)
        .enumerate()
        .filter(|(i, rgb)| (0..3).any(|c| (codes[4 * i + c].as_i64().unwrap() - i64::from(rgb[c])).abs() > 1));
    assert_eq!(far.count(), 0, "pixels that the page shows otherwise");
    for tone in ["reinhard", "aces-narkowicz", "aces-hill", "agx"] {
        browser.value(&tab, &format!("document.getElementById('tone').value = '{tone}', document.getElementById('tone').dispatchEvent(new Event('change'))"));
        let codes = browser.value(&tab, CODES);
        let (_, png) = viewer.get(&format!("picture.png?exposure=0&tone={tone}"));
        let expected = image::load_from_memory(&png).unwrap().to_rgb8();
        let far = expected
            .as_raw()
            .chunks_exact(3)
            .enumerate()
            .filter(|(i, rgb)| (0..3).any(|c| (codes[4 * i + c].as_i64().unwrap() - i64::from(rgb[c])).abs() > 1));
        assert_eq!(far.count(), 0, "pixels that the page shows otherwise by {tone}");
    }
    browser.value(&tab, "document.getElementById('tone').value = 'srgb', document.getElementById('tone').dispatchEvent(new Event('change'))");

    // Exposure changes what is shown and costs no render.
    let dark = browser.value(&tab, CODES);
    browser.value(&tab, "document.getElementById('exposure').value = 1, document.getElementById('exposure').dispatchEvent(new Event('input'))");
    assert_ne!(browser.value(&tab, CODES), dark);
    assert_eq!(browser.value(&tab, COMPLETE), true);
    browser.value(&tab, "document.getElementById('exposure').value = 0, document.getElementById('exposure').dispatchEvent(new Event('input'))");

    // Orbit by the mouse, walk by keys, and back
    let home = browser.value(&tab, CAMERA);
    let (middle, size) = browser.picture(&tab);
    browser.drag(&tab, middle, [middle[0] + 0.1 * size[0], middle[1]]);
    browser.wait(&tab, &format!("{CAMERA} !== {home:?}", home = home.as_str().unwrap()));
    let orbited = browser.value(&tab, CAMERA);
    browser.wait(&tab, COMPLETE);
    assert_ne!(browser.value(&tab, CODES), dark);
    browser.press(&tab, "w", "KeyW");
    browser.wait(&tab, &format!("{CAMERA} !== {:?}", orbited.as_str().unwrap()));
    browser.wait(&tab, COMPLETE);
    browser.mouse(&tab, "mouseWheel", middle, json!({ "deltaX": 0, "deltaY": 120 }));
    browser.value(&tab, "for (let i = 0; i < 9; i++) embrasure.camera.undo()");
    assert_eq!(browser.value(&tab, CAMERA), home);
    browser.wait(&tab, COMPLETE);
    thread::sleep(Duration::from_millis(400));
    browser.wait(&tab, COMPLETE);
    let saved = folder.path().join("v.exr");
    fs::write(&saved, viewer.get("picture.exr").1).unwrap();
    done(folder.path(), &split(&format!("render {FLAGS} -q -o r.exr")));
    assert_same_bits(&folder.path().join("r.exr"), &saved);

    // A click says what is there, and draws the paths.
    browser.click(&tab, [middle[0], middle[1] + 0.3 * size[1]]);
    browser.wait(
        &tab,
        "document.getElementById('found').textContent.includes('Material')",
    );
    browser.wait(&tab, "document.querySelectorAll('#overlay line').length > 0");
    let facts = browser.value(&tab, "embrasure.inspector.first.material");
    assert!(facts.as_str().is_some_and(|name| !name.is_empty()), "{facts}");

    // Two pages: the other one follows.
    let other = browser.open(&viewer.link(), [1024, 768]);
    browser.wait(&other, COMPLETE);
    // Pages behind others are not drawn, and send no moves.
    browser.call(Some(&tab.0), "Page.bringToFront", json!({}));
    browser.value(&tab, "embrasure.camera.dolly(0.5)");
    browser.wait(
        &other,
        &format!("embrasure.camera.now && {CAMERA} !== {:?}", home.as_str().unwrap()),
    );
    browser.wait(&other, COMPLETE);

    // The camera is saved, and comments of the file stay.
    let before = browser.value(&tab, CAMERA);
    browser.value(&tab, "document.getElementById('save-camera').click()");
    browser.wait(&tab, "document.getElementById('message').textContent.includes('saved')");
    let text = fs::read_to_string(folder.path().join("cornell-box.toml")).unwrap();
    assert!(text.starts_with("# The Cornell box, as measured."), "{text}");
    let camera: Value = serde_json::from_str(before.as_str().unwrap()).unwrap();
    let z = camera["position"][2].as_f64().unwrap() as f32;
    let written = text.lines().find(|line| line.starts_with("position")).unwrap();
    let number: f32 = written.split([',', ']']).nth(2).unwrap().trim().parse().unwrap();
    assert_eq!(number, z, "{written}");

    // A material is changed by its control.
    browser.wait(&tab, COMPLETE);
    let before = browser.value(&tab, CODES);
    let change = "(() => { const text = document.querySelector('[data-key=\"diffuse\"]').nextElementSibling; text.value = '0.1, 0.8, 0.1'; text.dispatchEvent(new Event('change')); })()";
    browser.value(&tab, change);
    browser.wait(
        &tab,
        "document.getElementById('patch').value.includes('diffuse = [0.1, 0.8, 0.1]')",
    );
    browser.wait(&tab, COMPLETE);
    let wait = format!("{COMPLETE} && JSON.stringify({CODES}) !== {:?}", before.to_string());
    browser.wait(&tab, &wait);

    // An edited library is loaded again, a wrong one is told with its place.
    let mtl = folder.path().join("cornell-box.mtl");
    let text = fs::read_to_string(&mtl).unwrap();
    fs::write(&mtl, format!("{text}\nKd wrong\n")).unwrap();
    browser.wait(
        &tab,
        "document.getElementById('message').textContent.includes('cornell-box.mtl:')",
    );
    fs::write(&mtl, text).unwrap();
    browser.wait(
        &tab,
        "document.getElementById('message').textContent.includes('reloaded')",
    );
    browser.wait(&tab, COMPLETE);

    // The end of the render is told.
    assert_eq!(browser.value(&tab, "JSON.stringify(faults)"), "[]");
    drop(viewer);
    browser.wait(&tab, "!document.getElementById('lost').hidden");
    browser.wait(&other, "!document.getElementById('lost').hidden");
}

/// A page elsewhere cannot reach the render, and neither can one with another token.
#[test]
fn pages_elsewhere_are_refused() {
    let Some(program) = chromium() else { return };
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start(&program);
    let stranger = browser.open("data:text/html,<title>stranger</title>", [400, 300]);
    browser.wait(&stranger, "document.title === 'stranger'");
    let ask = |link: &str| {
        format!(
            "new Promise(done => {{ const s = new WebSocket('{link}'); s.onopen = () => done('open'); s.onerror = () => done('refused'); }})"
        )
    };
    let link = format!("{}socket", viewer.link().replace("http:", "ws:"));
    assert_eq!(browser.value(&stranger, &ask(&link)), "refused");
    let wrong = viewer.link().replace(&viewer.token, &"0".repeat(32));
    let tab = browser.open(&wrong, [400, 300]);
    browser.wait(
        &tab,
        "document.body.innerText.includes('open the link that the render has printed')",
    );
}

/// All controls have names for those who do not see them.
#[test]
fn controls_have_names() {
    let Some(program) = chromium() else { return };
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start(&program);
    let tab = browser.open(&format!("{}?theme=light", viewer.link()), [1280, 720]);
    browser.wait(&tab, COMPLETE);
    let mut count = 0;
    for name in ["camera", "render", "look", "inspect", "materials"] {
        browser.value(
            &tab,
            &format!("document.querySelector('[data-tab=\"{name}\"]').click()"),
        );
        browser.call(Some(&tab.0), "Accessibility.enable", json!({}));
        let tree = browser.call(Some(&tab.0), "Accessibility.getFullAXTree", json!({}));
        for node in tree["nodes"].as_array().unwrap() {
            let role = node["role"]["value"].as_str().unwrap_or_default();
            let is_control = [
                "button",
                "link",
                "slider",
                "spinbutton",
                "textbox",
                "combobox",
                "checkbox",
                "radio",
                "tab",
            ];
            if is_control.contains(&role) && node["ignored"] != true {
                let name = node["name"]["value"].as_str().unwrap_or_default().trim();
                assert!(!name.is_empty(), "a {role} without a name: {node}");
                count += 1;
            }
        }
    }
    assert!(count > 60, "{count} controls");
    // Nothing is wider than the window.
    assert_eq!(
        browser.value(&tab, "document.documentElement.scrollWidth <= innerWidth"),
        true
    );
}

/// The pictures of the guide, where EMBRASURE_SCREENSHOTS names their folder.
#[test]
fn screenshots_of_the_guide() {
    if env::var_os("EMBRASURE_SCREENSHOTS").is_none() {
        return;
    }
    let Some(program) = chromium() else { return };
    let folder = cornell_box();
    let viewer = Viewer::start(
        folder.path(),
        &split("cornell-box.toml --size 512x512 --spp 16 --denoise oidn"),
    );
    let mut browser = Browser::start(&program);
    for (theme, name) in [("dark", "view-dark.png"), ("light", "view-light.png")] {
        let tab = browser.open(&format!("{}?theme={theme}", viewer.link()), [1000, 600]);
        browser.wait(&tab, COMPLETE);
        browser.wait(&tab, "embrasure.picture.frame.channel === 'denoised'");
        if theme == "light" {
            browser.value(&tab, "document.querySelector('[data-tab=\"render\"]').click()");
        }
        thread::sleep(Duration::from_secs(2));
        browser.screenshot(&tab, name);
        if theme == "dark" {
            let (middle, size) = browser.picture(&tab);
            browser.click(&tab, [middle[0] + 0.12 * size[0], middle[1] + 0.32 * size[1]]);
            browser.wait(&tab, "document.querySelectorAll('#overlay line').length > 0");
            thread::sleep(Duration::from_secs(1));
            browser.screenshot(&tab, "view-paths.png");
        }
    }
}
