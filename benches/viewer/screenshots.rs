//! Pictures of the viewer for the guide.

use super::chromium::{Browser, COMPLETE, Tab, click_on, set};
use super::viewer::{Viewer, cornell_box, two_lamps};
use crate::support::program::{done, split};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde_json::json;
use std::fs;
use std::path::Path;
use std::thread;
use std::time::Duration;

/// Size of the windows of the guide's pictures.
const WINDOW: [u32; 2] = [1120, 640];
/// Size of windows with noisy pictures, because files of large noisy pictures are large.
const SMALL_WINDOW: [u32; 2] = [1000, 600];

/// Writes the pictures into the folder `pictures`.
pub fn write(pictures: &Path) {
    let folder = cornell_box();
    let viewer = Viewer::start(
        folder.path(),
        &split("cornell-box.toml --size 512x512 --spp 16 --denoise oidn"),
    );
    let mut browser = Browser::start();
    for (theme, name) in [("dark", "view-dark.png"), ("light", "view-light.png")] {
        let tab = browser.open(&format!("{}?theme={theme}", viewer.link()), WINDOW);
        browser.wait(&tab, COMPLETE);
        browser.wait(
            &tab,
            "embrasure.picture.frame.denoised && embrasure.picture.frame.final",
        );
        browser.value(&tab, "embrasure.hints.dismiss()");
        if theme == "light" {
            browser.value(&tab, "document.querySelector('[data-tab=\"render\"]').click()");
        }
        thread::sleep(Duration::from_secs(2));
        shoot(&mut browser, &tab, &pictures.join(name));
        if theme == "dark" {
            // Select a sample whose path ends by roulette. The image also shows its shadow rays,
            // and paths that pixels share.
            browser.value(
                &tab,
                "document.getElementById('pixel-sample').value = 1, embrasure.inspector.ask([180, 480])",
            );
            browser.wait(&tab, "document.querySelectorAll('#overlay line').length > 0");
            browser.value(&tab, "document.getElementById('found').scrollIntoView()");
            thread::sleep(Duration::from_secs(1));
            shoot(&mut browser, &tab, &pictures.join("view-paths.png"));
            browser.value(&tab, "document.querySelector('[data-tab=\"materials\"]').click()");
            let (middle, size) = browser.picture(&tab);
            browser.click(&tab, [middle[0] + 0.42 * size[0], middle[1]]);
            browser.wait(&tab, "!document.getElementById('outline').hidden");
            browser.value(&tab, "document.querySelector('#material-keys details').open = true");
            thread::sleep(Duration::from_secs(1));
            shoot(&mut browser, &tab, &pictures.join("view-materials.png"));
        }
    }
    drop(viewer);

    // Show light groups, one of them green
    let folder = two_lamps();
    let viewer = Viewer::start(folder.path(), &split("cornell-box.toml --size 512x512 --spp 16"));
    let tab = browser.open(&format!("{}?theme=dark", viewer.link()), SMALL_WINDOW);
    browser.wait(&tab, COMPLETE);
    browser.value(&tab, "embrasure.hints.dismiss()");
    browser.value(&tab, "document.querySelector('[data-tab=\"lights\"]').click()");
    click_on(&mut browser, &tab, "tell-groups");
    browser.wait(
        &tab,
        &format!("{COMPLETE} && embrasure.picture.frame.groups?.length === 2"),
    );
    set(
        &mut browser,
        &tab,
        "[aria-label=\"light1, colour\"]",
        "{ value: '#60ff90' }",
    );
    set(&mut browser, &tab, "[aria-label=\"light1, stops\"]", "{ value: '1.5' }");
    set(&mut browser, &tab, "[aria-label=\"light, stops\"]", "{ value: '-2' }");
    thread::sleep(Duration::from_secs(1));
    shoot(&mut browser, &tab, &pictures.join("view-lights.png"));
    drop(viewer);

    // Compare with and without path reuse, against a reference
    let flags = "cornell-box.toml --size 512x512";
    done(
        folder.path(),
        &split(&format!("render {flags} --spp 256 --seed 7 -q -o reference.exr")),
    );
    let compare = format!("{flags} --spp 64 --compare path,path+reuse=none --reference reference.exr");
    let viewer = Viewer::start(folder.path(), &split(&compare));
    let tab = browser.open(&format!("{}?theme=light", viewer.link()), SMALL_WINDOW);
    browser.wait(&tab, "embrasure.camera.now");
    browser.value(&tab, "document.querySelector('[data-tab=\"render\"]').click()");
    browser.wait(&tab, "embrasure.compare.points.length > 12 && embrasure.picture.other");
    browser.value(&tab, "embrasure.hints.dismiss()");
    browser.value(&tab, "document.getElementById('compare-with').scrollIntoView()");
    shoot(&mut browser, &tab, &pictures.join("view-compare.png"));
    drop(viewer);

    // Show a guessed camera
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let obj = scenes.join("pawns.obj");
    done(
        folder.path(),
        &["init", obj.to_str().unwrap(), "--view", "iso", "-o", "pawns.toml"],
    );
    let viewer = Viewer::start(
        folder.path(),
        &split("pawns.toml --size 720x540 --spp 8 --denoise oidn"),
    );
    let tab = browser.open(&format!("{}?theme=light", viewer.link()), WINDOW);
    browser.wait(&tab, "embrasure.camera.now");
    click_on(&mut browser, &tab, "find-views");
    browser.wait(&tab, "document.querySelectorAll('#views button').length > 3");
    browser.wait(
        &tab,
        "document.querySelectorAll('#views img').length === document.querySelectorAll('#views button').length",
    );
    browser.value(&tab, "embrasure.hints.dismiss()");
    let camera = "{ ...embrasure.camera.now, position: [-1.2, 0.9, 3], look_at: [0, 0.35, 0], vertical_fov: 30, lens_radius: 0.08 }";
    browser.value(&tab, &format!("embrasure.camera.to({camera}), 0"));
    let complete = COMPLETE.replace("16", "8");
    browser.wait(&tab, &complete);
    click_on(&mut browser, &tab, "focus-click");
    let distance = "embrasure.camera.now.focus_distance";
    let before = browser.value(&tab, distance);
    let (middle, size) = browser.picture(&tab);
    browser.click(&tab, [middle[0] - 0.25 * size[0], middle[1] + 0.1 * size[1]]);
    browser.wait(&tab, &format!("{distance} !== {before}"));
    click_on(&mut browser, &tab, "copy-flags");
    browser.value(&tab, "embrasure.selection.clear()");
    thread::sleep(Duration::from_secs(1));
    browser.wait(&tab, &complete);
    thread::sleep(Duration::from_secs(1));
    shoot(&mut browser, &tab, &pictures.join("view-camera.png"));
}

/// Writes a screenshot of a page to a file.
fn shoot(browser: &mut Browser, tab: &Tab, file: &Path) {
    let shot = browser.call(Some(&tab.0), "Page.captureScreenshot", json!({ "format": "png" }));
    let bytes = BASE64_STANDARD.decode(shot["data"].as_str().unwrap()).unwrap();
    fs::write(file, bytes).unwrap();
}
