//! The page of `embrasure view` in headless Chromium. Without Chromium the tests are ignored,
//! unless EMBRASURE_REQUIRE_CHROMIUM is set.

use super::chromium::{Browser, COMPLETE, click_on, set};
use super::link::slow_link;
use super::viewer::{Viewer, cornell_box, two_lamps};
use crate::support::program::{assert_same_bits, done, split};
use serde_json::{Value, json};
use std::fs;
use std::thread;
use std::time::Duration;

/// Script expression for the pixels that the page displays, as numbers.
const CODES: &str = "[...document.getElementById('picture').getContext('2d').getImageData(0, 0, embrasure.picture.canvas.width, embrasure.picture.canvas.height).data]";
const CAMERA: &str = "JSON.stringify(embrasure.camera.now)";

const FLAGS: &str = "cornell-box.toml --size 128x128 --spp 16";

/// Names from files are shown as text on the page, even if they contain markup.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn names_with_markup_are_text_in_the_page() {
    const MARK: &str = "<img src=x onerror=document.title=1>";
    const NAMES: [&str; 4] = [
        MARK,
        "</script><script>document.title=1</script>",
        "'\"><svg/onload=document.title=1>",
        "${document.title=1}",
    ];
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let library: String = NAMES
        .iter()
        .map(|name| format!("newmtl {name}\nKd 0.5 0.5 0.5\n"))
        .collect();
    let object = |(i, name)| format!("o {name}\nusemtl {name}\nv {i} 0 0\nv {i}.9 0 0\nv {i} 0.9 0\nf -3 -2 -1\n");
    let objects: String = NAMES.iter().enumerate().map(object).collect();
    fs::write(at("a.mtl"), library).unwrap();
    fs::write(at("a.obj"), format!("mtllib a.mtl\n{objects}")).unwrap();
    let camera = "[camera]\nposition = [0.3, 0.3, 3.0]\nlook_at = [0.3, 0.3, 0.0]\n";
    let scene = format!("{MARK}.toml");
    fs::write(
        at(&scene),
        format!("version = 1\n{camera}[[object]]\nobj = \"a.obj\"\n"),
    )
    .unwrap();

    let flags = ["--size", "64x64", "--spp", "16"];
    let viewer = Viewer::start(folder.path(), &[&[&*scene], &flags[..]].concat());
    let mut browser = Browser::start();
    let tab = browser.open(&viewer.link(), [1280, 720]);
    browser.wait(&tab, COMPLETE);
    browser.value(&tab, "embrasure.inspector.ask([32, 32])");
    browser.wait(
        &tab,
        "document.getElementById('found').textContent.includes('Material')",
    );
    let names = browser.value(
        &tab,
        "[...document.querySelectorAll('#materials button')].map((ball) => ball.textContent)",
    );
    assert_eq!(names, json!(NAMES));
    assert_eq!(
        browser.value(&tab, "document.getElementById('scene').textContent"),
        *scene
    );
    let made = "document.querySelectorAll('img[src=x], svg[onload], body script:not([src])').length";
    assert_eq!(browser.value(&tab, made), 0);
    assert_ne!(browser.value(&tab, "document.title"), "1");
}

/// The page handles the actions of a user: view, orbit, walk, undo, inspect, change display and
/// materials, save the camera. A second page follows the first, and the page shows the end of the
/// render.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn the_page_shows_and_steers_a_render() {
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start();
    let tab = browser.open(&viewer.link(), [1280, 720]);
    browser.wait(&tab, COMPLETE);
    assert_eq!(
        browser.value(&tab, "document.getElementById('scene').textContent"),
        "cornell-box.toml"
    );

    // The page converts light to display colours like the program.
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

    // Exposure changes only the display, and does not restart the render.
    let dark = browser.value(&tab, CODES);
    browser.value(&tab, "document.getElementById('exposure').value = 1, document.getElementById('exposure').dispatchEvent(new Event('input'))");
    assert_ne!(browser.value(&tab, CODES), dark);
    assert_eq!(browser.value(&tab, COMPLETE), true);
    browser.value(&tab, "document.getElementById('exposure').value = 0, document.getElementById('exposure').dispatchEvent(new Event('input'))");

    // Orbit with the mouse, walk with keys, and undo
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

    // A click selects the object and opens its material. Paths are drawn only in their tab.
    let floor = [middle[0], middle[1] + 0.45 * size[1]];
    browser.click(&tab, floor);
    browser.wait(
        &tab,
        "!document.getElementById('tab-materials').hidden && !document.getElementById('outline').hidden",
    );
    let selected = "embrasure.materials.chosen === embrasure.selection.picked.material";
    assert_eq!(browser.value(&tab, selected), true);
    assert_eq!(
        browser.value(&tab, "document.querySelectorAll('#overlay line').length"),
        0
    );
    browser.value(&tab, "document.querySelector('[data-tab=\"inspect\"]').click()");
    browser.click(&tab, floor);
    browser.wait(
        &tab,
        "document.getElementById('found').textContent.includes('Material')",
    );
    browser.wait(&tab, "document.querySelectorAll('#overlay line').length > 0");
    browser.value(&tab, "document.querySelector('[data-tab=\"camera\"]').click()");
    assert_eq!(browser.value(&tab, "document.querySelectorAll('#overlay *').length"), 0);
    browser.value(
        &tab,
        "document.querySelector('[data-tab=\"inspect\"]').click(), embrasure.inspector.ask([64, 120])",
    );
    browser.wait(&tab, "document.querySelectorAll('#overlay line').length > 0");
    browser.wait(&tab, "document.querySelectorAll('#overlay text').length > 0");
    browser.value(
        &tab,
        "document.getElementById('pixel-sample').value = 3, embrasure.inspector.ask([45, 120])",
    );
    for words in [
        "samples surface light",
        "MIS weight",
        "scatters: Lambert, pdf",
        "roulette probability",
        "shared path of pixel",
    ] {
        browser.wait(
            &tab,
            &format!("document.getElementById('vertices').textContent.includes({words:?})"),
        );
    }
    let facts = browser.value(&tab, "embrasure.inspector.first.material");
    assert!(facts.as_str().is_some_and(|name| !name.is_empty()), "{facts}");

    // Two pages are open, and the second page follows the first.
    let other = browser.open(&viewer.link(), [1024, 768]);
    browser.wait(&other, COMPLETE);
    // A page in the background is not drawn, and sends no moves. Bring the first page to the front.
    browser.call(Some(&tab.0), "Page.bringToFront", json!({}));
    browser.value(&tab, "embrasure.camera.dolly(0.5)");
    browser.wait(
        &other,
        &format!("embrasure.camera.now && {CAMERA} !== {:?}", home.as_str().unwrap()),
    );
    browser.wait(&other, COMPLETE);

    // The camera is saved, and comments of the file are kept.
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

    // A control changes a material.
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

    // Keys that the material does not set also have controls, except keys of files.
    let change = "(() => { const text = document.querySelector('details [data-key=\"emission\"]').nextElementSibling; text.value = '0.1'; text.dispatchEvent(new Event('change')); })()";
    browser.value(&tab, change);
    browser.wait(
        &tab,
        "document.getElementById('patch').value.includes('emission = 0.1')",
    );
    browser.wait(
        &tab,
        "document.querySelector('[data-key=\"emission\"]').closest('details') === null",
    );
    let count = |selector: &str| format!("document.querySelectorAll('#material-keys {selector}').length");
    assert_eq!(browser.value(&tab, &count("[data-key$=\"_map\"]")), 0);
    assert_eq!(browser.value(&tab, &count("details [data-key=\"roughness\"]")), 1);
    browser.wait(&tab, COMPLETE);

    // In the channel of ids, objects have different colours.
    set(&mut browser, &tab, "#channel", "{ value: 'id' }");
    browser.wait(
        &tab,
        "embrasure.picture.frame.channel === 'id' && embrasure.picture.frame.samples === 16",
    );
    assert_eq!(
        browser.value(&tab, "embrasure.picture.valuesAt([64.5, 100.5])"),
        json!([1, 0, 0])
    );
    let colour = browser.value(
        &tab,
        "[...document.getElementById('picture').getContext('2d').getImageData(64, 100, 1, 1).data]",
    );
    assert!(colour[0] != colour[1] && colour[3] == 255, "{colour}");
    set(&mut browser, &tab, "#channel", "{ value: 'picture' }");
    browser.wait(
        &tab,
        &format!("{COMPLETE} && embrasure.picture.frame.channel === 'picture'"),
    );

    // An edited file is reloaded. An error in it is reported with file and line.
    let obj = folder.path().join("cornell-box.obj");
    let text = fs::read_to_string(&obj).unwrap();
    fs::write(&obj, format!("{text}\nv 1e11 0 0\nf 1 2 -1\n")).unwrap();
    browser.wait(
        &tab,
        "document.getElementById('message').textContent.includes('cornell-box.obj:')",
    );
    fs::write(&obj, text).unwrap();
    browser.wait(
        &tab,
        "document.getElementById('message').textContent.includes('reloaded')",
    );
    browser.wait(&tab, COMPLETE);

    // When the viewer ends, the page shows that it has lost the viewer. Before that, no script
    // error occurred.
    assert_eq!(browser.value(&tab, "JSON.stringify(faults)"), "[]");
    drop(viewer);
    browser.wait(&tab, "!document.getElementById('lost').hidden");
    browser.wait(&other, "!document.getElementById('lost').hidden");
}

/// A page of another origin cannot reach the render. A page with a wrong token cannot reach it
/// either.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn pages_elsewhere_are_refused() {
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start();
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

/// All controls have accessible names.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn controls_have_names() {
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start();
    let tab = browser.open(&format!("{}?theme=light", viewer.link()), [1280, 720]);
    browser.wait(&tab, COMPLETE);
    let mut count = 0;
    for name in ["camera", "render", "look", "inspect", "materials", "lights"] {
        browser.value(
            &tab,
            &format!("document.querySelector('[data-tab=\"{name}\"]').click()"),
        );
        browser.value(
            &tab,
            "document.querySelectorAll('details').forEach((details) => (details.open = true))",
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
    assert!(count > 120, "{count} controls");
    // No element is wider than the window.
    assert_eq!(
        browser.value(&tab, "document.documentElement.scrollWidth <= innerWidth"),
        true
    );
}

/// On a slow link, images are packed. The page unpacks them, and shows the light of the render.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn the_page_unpacks_pictures() {
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start();
    let link = format!("http://{}/{}/", slow_link(&viewer, 1e5), viewer.token);
    let tab = browser.open(&link, [1280, 720]);
    browser.wait(&tab, COMPLETE);
    browser.wait(&tab, "embrasure.picture.frame.final");
    assert_eq!(browser.value(&tab, "embrasure.picture.frame.packed.rounding"), 0);
    let halves = browser.value(&tab, "[...embrasure.picture.frame.halves]");
    done(folder.path(), &split(&format!("render {FLAGS} -q -o r.exr")));
    let expected = super::halves_of(&folder.path().join("r.exr"));
    let halves = halves.as_array().unwrap().iter().map(|bits| bits.as_u64().unwrap());
    assert!(halves.eq(expected.iter().map(|half| u64::from(half.to_bits()))));

    // An image that cannot be unpacked is reported, and later images are shown.
    let breaks = "window.whole = DecompressionStream, window.DecompressionStream = class { constructor() { throw new Error('broken') } }";
    browser.value(&tab, &format!("{breaks}, 0"));
    click_on(&mut browser, &tab, "restart");
    browser.wait(
        &tab,
        "document.getElementById('message').textContent.includes('cannot be shown: broken')",
    );
    browser.value(&tab, "window.DecompressionStream = window.whole, 0");
    browser.value(&tab, "document.documentElement.dataset.samples = 'none'");
    click_on(&mut browser, &tab, "restart");
    browser.wait(&tab, COMPLETE);
    assert_eq!(browser.value(&tab, "JSON.stringify(faults)"), "[]");
}

/// The page changes the light of light groups without a render. Lights of the scene file have
/// controls, and changes are saved.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn lights_are_changed_in_the_page() {
    let folder = two_lamps();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start();
    let tab = browser.open(&viewer.link(), [1280, 720]);
    browser.wait(&tab, COMPLETE);
    browser.value(&tab, "document.querySelector('[data-tab=\"lights\"]').click()");
    click_on(&mut browser, &tab, "tell-groups");
    browser.wait(
        &tab,
        &format!("{COMPLETE} && embrasure.picture.frame.groups?.length === 2 && embrasure.picture.frame.final"),
    );
    let value = "embrasure.picture.valuesAt([64.5, 100.5])";
    let both: Vec<f64> = serde_json::from_value(browser.value(&tab, value)).unwrap();
    let before = browser.value(&tab, "embrasure.link.frames");
    let alone: Vec<Vec<f64>> = ["light1", "light"]
        .map(|name| {
            set(
                &mut browser,
                &tab,
                &format!("[aria-label=\"{name}, on\"]"),
                "{ checked: false }",
            );
            let rest = browser.value(&tab, value);
            set(
                &mut browser,
                &tab,
                &format!("[aria-label=\"{name}, on\"]"),
                "{ checked: true }",
            );
            serde_json::from_value(rest).unwrap()
        })
        .to_vec();
    for c in 0..3 {
        let sum = alone[0][c] + alone[1][c];
        assert!(
            (sum - both[c]).abs() < 2e-3 * both[c] && alone[0][c] > 0.0 && alone[1][c] > 0.0,
            "{both:?} {alone:?}"
        );
    }
    // A stop is a factor of two, and a colour is a factor for each channel.
    set(&mut browser, &tab, "[aria-label=\"light1, stops\"]", "{ value: '1' }");
    set(
        &mut browser,
        &tab,
        "[aria-label=\"light1, colour\"]",
        "{ value: '#00ff00' }",
    );
    let lit: Vec<f64> = serde_json::from_value(browser.value(&tab, value)).unwrap();
    let of_point = [0.0, 2.0, 0.0];
    for c in 0..3 {
        let expected = alone[0][c] + of_point[c] * alone[1][c];
        assert!((lit[c] - expected).abs() < 2e-3 * expected, "{lit:?} {alone:?}");
    }
    assert_eq!(
        browser.value(&tab, "embrasure.link.frames"),
        before,
        "a picture was sent"
    );

    click_on(&mut browser, &tab, "tell-groups");
    browser.wait(
        &tab,
        &format!("{COMPLETE} && embrasure.picture.frame.channel === 'picture'"),
    );
    set(
        &mut browser,
        &tab,
        "[data-light=\"0\"][aria-label=\"Intensity, colour\"]",
        "{ value: '#ff0000' }",
    );
    browser.wait(
        &tab,
        "document.getElementById('light-edits').value.startsWith(\"--set 'light.0.intensity=[\")",
    );
    browser.wait(&tab, "document.getElementById('light-sections').value.startsWith('# In place of light 1\\n[[light]]\\ntype = \"point\"')");
    browser.wait(&tab, COMPLETE);
    click_on(&mut browser, &tab, "save-lights");
    browser.wait(&tab, "document.getElementById('message').textContent.includes('saved')");
    let text = fs::read_to_string(folder.path().join("cornell-box.toml")).unwrap();
    assert!(text.contains("intensity = [40000, 0, 0]"), "{text}");
    browser.wait(&tab, "document.getElementById('save-lights').disabled");
    assert_eq!(browser.value(&tab, "JSON.stringify(faults)"), "[]");
}

/// The page shows the image beside another channel, beside a file, and beside another method with
/// its errors.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn page_shows_two_pictures_side_by_side() {
    let folder = cornell_box();
    done(
        folder.path(),
        &split("render cornell-box.toml --size 128x128 --spp 64 --seed 7 -q -o reference.exr"),
    );
    let viewer = Viewer::start(folder.path(), &split(&format!("{FLAGS} --reference reference.exr")));
    let mut browser = Browser::start();
    let tab = browser.open(&format!("{}?theme=light", viewer.link()), [1280, 720]);
    browser.wait(&tab, COMPLETE);
    set(&mut browser, &tab, "#split", "{ value: 'N' }");
    browser.wait(
        &tab,
        "embrasure.picture.other?.channel === 'N' && !document.getElementById('second').hidden",
    );
    assert_eq!(browser.value(&tab, "embrasure.picture.frame.channel"), "picture");
    // Drag the divider
    let at = browser.value(
        &tab,
        "(({x, y, height}) => [x + 1, y + height / 2])(document.getElementById('divider').getBoundingClientRect())",
    );
    let at = [0, 1].map(|i| at[i].as_f64().unwrap());
    browser.drag(&tab, at, [at[0] - 60.0, at[1]]);
    browser.wait(&tab, "embrasure.picture.split < 0.45");

    let png = folder.path().join("kept.png");
    fs::write(&png, viewer.get("picture.png?exposure=0&tone=srgb").1).unwrap();
    let root = browser.call(Some(&tab.0), "DOM.getDocument", json!({}));
    let query = json!({ "nodeId": root["root"]["nodeId"], "selector": "#file" });
    let input = browser.call(Some(&tab.0), "DOM.querySelector", query);
    let files = json!({ "nodeId": input["nodeId"], "files": [png] });
    browser.call(Some(&tab.0), "DOM.setFileInputFiles", files);
    browser.wait(
        &tab,
        "embrasure.picture.beside === 'file' && document.getElementById('second').width === 128",
    );
    let codes = browser.value(
        &tab,
        "[...document.getElementById('second').getContext('2d').getImageData(0, 0, 128, 128).data]",
    );
    let expected = image::open(&png).unwrap().to_rgba8();
    let far = expected.as_raw().iter().zip(codes.as_array().unwrap());
    assert_eq!(far.filter(|(code, shown)| **shown != u64::from(**code)).count(), 0);

    // Show another method beside the image
    set(&mut browser, &tab, "#compare-with", "{ value: 'path+reuse=none' }");
    click_on(&mut browser, &tab, "compare");
    browser.value(&tab, "document.querySelector('[data-tab=\"render\"]').click()");
    browser.wait(&tab, &format!("{COMPLETE} && embrasure.picture.beside === 'compared' && embrasure.picture.other?.channel === 'compared' && embrasure.picture.other.final"));
    browser.wait(&tab, "document.querySelectorAll('#errors tr').length === 3");
    browser.wait(
        &tab,
        "embrasure.compare.points.at(-1).first.error > 0 && embrasure.compare.points.at(-1).second.error > 0",
    );
    done(
        folder.path(),
        &split(&format!("render {FLAGS} --reuse none -q -o r.exr")),
    );
    let expected = super::halves_of(&folder.path().join("r.exr"));
    let halves = browser.value(&tab, "[...embrasure.picture.other.halves]");
    let halves = halves.as_array().unwrap().iter().map(|bits| bits.as_u64().unwrap());
    assert!(halves.eq(expected.iter().map(|half| u64::from(half.to_bits()))));
    click_on(&mut browser, &tab, "compare-off");
    browser.wait(
        &tab,
        "embrasure.picture.beside === '' && document.getElementById('second').hidden",
    );

    // Show the brightest samples of a pixel
    browser.wait(&tab, COMPLETE);
    click_on(&mut browser, &tab, "find-brightest");
    browser.wait(&tab, "document.querySelectorAll('#brightest button').length === 8");
    browser.value(&tab, "document.querySelector('#brightest button').click()");
    browser.wait(&tab, "embrasure.inspector.facts?.samples[0].sample === Number(document.querySelector('#brightest button').textContent)");
    assert_eq!(browser.value(&tab, "JSON.stringify(faults)"), "[]");
}

/// One finger orbits, two fingers zoom, and a tap selects.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn fingers_orbit_and_zoom_the_camera() {
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start();
    let tab = browser.open(&viewer.link(), [820, 1180]);
    browser.call(
        Some(&tab.0),
        "Emulation.setTouchEmulationEnabled",
        json!({ "enabled": true, "maxTouchPoints": 5 }),
    );
    browser.wait(&tab, COMPLETE);
    let (middle, size) = browser.picture(&tab);
    let touch = |browser: &mut Browser, kind: &str, points: &[[f64; 2]]| {
        let points: Vec<Value> = points
            .iter()
            .enumerate()
            .map(|(id, [x, y])| json!({ "x": x, "y": y, "id": id }))
            .collect();
        browser.call(
            Some(&tab.0),
            "Input.dispatchTouchEvent",
            json!({ "type": kind, "touchPoints": points }),
        );
    };
    let distance = "embrasure.camera.distance";
    let far = browser.value(&tab, distance).as_f64().unwrap();
    let home = browser.value(&tab, CAMERA);
    touch(&mut browser, "touchStart", &[middle]);
    for step in 1..=6 {
        touch(
            &mut browser,
            "touchMove",
            &[[middle[0] + 0.03 * f64::from(step) * size[0], middle[1]]],
        );
    }
    touch(&mut browser, "touchEnd", &[]);
    browser.wait(&tab, &format!("{CAMERA} !== {:?}", home.as_str().unwrap()));
    assert!(
        (browser.value(&tab, distance).as_f64().unwrap() - far).abs() < 1e-3 * far,
        "an orbit keeps the distance"
    );
    let [left, right] = [-1.0, 1.0].map(|side| move |apart: f64| [middle[0] + side * apart, middle[1]]);
    touch(&mut browser, "touchStart", &[left(40.0), right(40.0)]);
    for step in 1..=6 {
        let apart = 40.0 + 12.0 * f64::from(step);
        touch(&mut browser, "touchMove", &[left(apart), right(apart)]);
    }
    touch(&mut browser, "touchEnd", &[]);
    browser.wait(&tab, &format!("{distance} < {}", 0.8 * far));
    browser.wait(&tab, COMPLETE);
    touch(&mut browser, "touchStart", &[middle]);
    touch(&mut browser, "touchEnd", &[]);
    browser.wait(&tab, "!document.getElementById('selected').hidden");
    // If the image is larger than its area, two fingers move the image and not the camera.
    set(&mut browser, &tab, "#zoom", "{ value: '16' }");
    let camera = browser.value(&tab, CAMERA);
    touch(&mut browser, "touchStart", &[left(40.0), right(40.0)]);
    for step in 1..=6 {
        let by = 10.0 * f64::from(step);
        touch(
            &mut browser,
            "touchMove",
            &[left(40.0), right(40.0)].map(|[x, y]| [x - by, y - by]),
        );
    }
    touch(&mut browser, "touchEnd", &[]);
    let scroll = "[document.getElementById('view').scrollLeft, document.getElementById('view').scrollTop]";
    browser.wait(&tab, &format!("Math.min(...{scroll}) > 30"));
    assert_eq!(browser.value(&tab, CAMERA), camera);
    set(&mut browser, &tab, "#zoom", "{ value: 'fit' }");
    // Controls are large enough for a finger, and nothing is wider than the window.
    assert_eq!(
        browser.value(&tab, "document.documentElement.scrollWidth <= innerWidth"),
        true
    );
    assert_eq!(browser.value(&tab, "JSON.stringify(faults)"), "[]");
}
