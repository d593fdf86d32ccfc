//! First minute of a user with a bare OBJ (an OBJ file without a scene file): pixels at once, the
//! exposure of `render`, selection by click, and views as images.

use super::chromium::{Browser, click_on};
use super::viewer::{Page, Viewer, cornell_box};
use super::{Frame, PATIENCE};
use crate::support::program::{done, folder, split};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::Message;

const FLAGS: &str = "pawns.obj --size 96x72 --spp 16";
/// Script expression that is true if the page shows the denoised image of all samples.
const DENOISED: &str = "document.documentElement.dataset.phase === 'complete' && document.documentElement.dataset.samples === '16' && document.documentElement.dataset.denoised === 'true' && embrasure.picture.frame.final";

/// A folder with a copy of the pawns, a bare OBJ.
fn pawns() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in ["pawns.obj", "pawns.mtl"] {
        fs::copy(scenes.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// OBJ text of `count` squares.
fn squares(count: usize) -> String {
    let mut text = String::new();
    for i in 0..count {
        let (x, y) = (i % 1000, i / 1000);
        text += &format!("v {x} {y} 0\nv {x}.9 {y} 0\nv {x}.9 {y}.9 0\nv {x} {y}.9 0\nf -4 -3 -2 -1\n");
    }
    text
}

/// Headers of all images up to the first for which `is_last` returns true.
fn headers_until(page: &mut Page, is_last: impl Fn(&Value) -> bool) -> Vec<Value> {
    let (start, mut headers) = (Instant::now(), Vec::new());
    while start.elapsed() < PATIENCE {
        if let Message::Binary(bytes) = page.next() {
            let frame = Frame::of(&bytes);
            page.shown(&frame);
            headers.push(frame.header);
            if headers.last().is_some_and(&is_last) {
                return headers;
            }
        }
    }
    panic!("no such picture: {headers:?}");
}

/// A page gets pixels before the denoiser is done. The first pixels are a smaller image, and
/// denoised pixels come later.
#[test]
fn pixels_come_before_the_denoiser() {
    let folder = pawns();
    let viewer = Viewer::start(
        folder.path(),
        &split("pawns.obj --size 640x480 --spp 16 --denoise=atrous"),
    );
    let mut page = viewer.page();
    page.send(r#"{"do":"channel","name":"denoised"}"#);
    let headers = headers_until(&mut page, |h| h["denoised"] == true && h["final"] == true);
    assert_eq!(headers[0]["preview"], true, "{:?}", headers[0]);
    assert!(headers[0]["width"].as_u64() < Some(640), "{:?}", headers[0]);
    let of_channel: Vec<&Value> = headers.iter().filter(|h| h["channel"] == "denoised").collect();
    let noisy = of_channel.iter().position(|h| h["denoised"] == false).unwrap();
    let clean = of_channel.iter().position(|h| h["denoised"] == true).unwrap();
    assert!(noisy < clean, "{of_channel:?}");
    // After the first denoised image, no noisy image follows.
    let after = of_channel[clean..].iter().filter(|h| h["denoised"] == false);
    assert_eq!(after.count(), 0, "{of_channel:?}");
    // A page that is opened later also gets a denoised image.
    let mut late = viewer.page();
    late.send(r#"{"do":"channel","name":"denoised"}"#);
    late.frame_where(|h| h["denoised"] == true && h["final"] == true);
}

/// The link works before the scene is loaded: the page shows the loading step and its progress. An
/// unreadable file ends the viewer with the reason.
#[test]
fn loading_progress_is_shown() {
    let folder = folder(&[("a.obj", &squares(300_000))]);
    let start = Instant::now();
    let mut viewer = Viewer::start(folder.path(), &split("a.obj --size 64x48 --spp 1"));
    let linked = start.elapsed();
    let mut page = viewer.page();
    let mut told: Vec<Value> = Vec::new();
    loop {
        let Message::Text(text) = page.next() else { continue };
        let message: Value = serde_json::from_str(&text).unwrap();
        match message["type"].as_str().unwrap() {
            "hello" => break,
            "status" => told.push(message),
            _ => {}
        }
    }
    let loaded = start.elapsed();
    assert!(linked < loaded / 2, "the link came after {linked:?} of {loaded:?}");
    assert!(told.iter().all(|status| status["phase"] == "loading"), "{told:?}");
    let does = |words: &str| told.iter().any(|s| s["doing"].as_str().unwrap().contains(words));
    assert!(does("finding camera and light") && does("building"), "{told:?}");
    let shares = told.iter().map(|status| status["share"].as_f64().unwrap());
    assert!(shares.clone().all(|share| (0.0..=1.0).contains(&share)), "{told:?}");
    // A page that is opened later gets no message about loading.
    page.message_where("status", |status| status["phase"] == "complete");
    let status = viewer.page().message("status");
    assert_ne!(status["phase"], "loading");
    viewer.child.kill().unwrap();

    fs::write(folder.path().join("a.obj"), squares(300_000) + "v 1e11 0 0\nf 1 2 -1\n").unwrap();
    let mut viewer = Viewer::start(folder.path(), &split("a.obj --size 64x48 --spp 1"));
    let mut page = viewer.page();
    let error = page.message("error");
    assert!(error["text"].as_str().unwrap().contains("a.obj: vertex"), "{error}");
    assert_eq!(viewer.child.wait().unwrap().code(), Some(1));
}

/// An interrupt ends the viewer during loading.
#[test]
fn interrupt_ends_the_loading() {
    let folder = folder(&[("a.obj", &squares(600_000))]);
    let viewer = Viewer::start(folder.path(), &split("a.obj --size 64x48 --spp 1"));
    let (code, time) = viewer.interrupt();
    assert!(code == Some(130) || code == Some(0), "{code:?}");
    assert!(time < Duration::from_secs(10), "{time:?}");
}

/// The image of a bare OBJ on the page has the codes of the PNG of `render`: exposure, tone curve
/// and denoiser are equal.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn the_page_shows_the_png_of_render() {
    let folder = pawns();
    done(
        folder.path(),
        &split(&format!("render {FLAGS} --denoise=atrous -q -o r.png")),
    );
    let expected = image::open(folder.path().join("r.png")).unwrap().to_rgb8();
    let viewer = Viewer::start(folder.path(), &split(&format!("{FLAGS} --denoise=atrous")));
    let mut browser = Browser::start();
    let tab = browser.open(&viewer.link(), [1280, 800]);
    browser.wait(&tab, DENOISED);
    // With all samples, the exposure equals the exposure of the final image.
    let exposure = browser.value(&tab, "embrasure.picture.look.exposure").as_f64().unwrap();
    assert!(exposure != 0.0, "the studio has an exposure");
    let codes = browser.value(
        &tab,
        "[...document.getElementById('picture').getContext('2d').getImageData(0, 0, 96, 72).data]",
    );
    let far = expected.as_raw().chunks_exact(3).enumerate();
    let far = far.filter(|(i, rgb)| (0..3).any(|c| (codes[4 * i + c].as_i64().unwrap() - i64::from(rgb[c])).abs() > 1));
    assert_eq!(
        far.count(),
        0,
        "pixels that the page shows otherwise at {exposure} stops"
    );
    // The user changes the exposure by metering, and changes it back
    browser.value(&tab, "document.querySelector('[data-tab=\"look\"]').click()");
    assert_eq!(
        browser.value(&tab, "document.getElementById('exposure-of-render').innerText"),
        "As render\nin use"
    );
    click_on(&mut browser, &tab, "meter");
    browser.wait(&tab, "!document.getElementById('exposure-of-render').disabled");
    click_on(&mut browser, &tab, "exposure-of-render");
    assert_eq!(
        browser.value(&tab, "embrasure.picture.look.exposure").as_f64().unwrap(),
        exposure
    );
}

/// A background has the same codes on the page as in the PNG file, for any exposure and tone curve.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
fn page_backgrounds_match_the_png() {
    for background in ["#ffc356", "transparent"] {
        let flags = format!("{FLAGS} --tone agx --denoise=off --background {background}");
        let flags = split(&flags);
        let folder = pawns();
        done(
            folder.path(),
            &[&["render"], &flags[..], &["-q", "-o", "r.png"]].concat(),
        );
        let expected = image::open(folder.path().join("r.png")).unwrap().to_rgba8();
        let viewer = Viewer::start(folder.path(), &flags);
        let mut browser = Browser::start();
        let tab = browser.open(&viewer.link(), [1280, 800]);
        browser.wait(
            &tab,
            "document.documentElement.dataset.phase === 'complete' && document.documentElement.dataset.samples === '16' && embrasure.picture.frame?.final",
        );
        let codes = browser.value(
            &tab,
            "[...document.getElementById('picture').getContext('2d').getImageData(0, 0, 96, 72).data]",
        );
        let codes: Vec<i64> = codes
            .as_array()
            .unwrap()
            .iter()
            .map(|code| code.as_i64().unwrap())
            .collect();
        // Canvases store premultiplied colours.
        let premultiplied = |rgba: &[i64]| [0, 1, 2].map(|c| rgba[c] * rgba[3] / 255);
        let far = codes
            .chunks_exact(4)
            .zip(expected.as_raw().chunks_exact(4))
            .filter(|(page, file)| {
                let file: Vec<i64> = file.iter().map(|&code| i64::from(code)).collect();
                let (own, other) = (premultiplied(page), premultiplied(&file));
                (page[3] - file[3]).abs() > 1 || (0..3).any(|c| (own[c] - other[c]).abs() > 2)
            });
        assert_eq!(far.count(), 0, "pixels that differ over {background}");
    }
}

/// A pixel with a surface has an object, a material and an outline. The background has none of
/// these.
#[test]
fn pixels_are_picked() {
    let folder = cornell_box();
    let viewer = Viewer::start(folder.path(), &split("cornell-box.toml --size 128x128 --spp 1"));
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"pick","x":64,"y":122}"#);
    let found = page.message("pick");
    page.send(r#"{"do":"inspect","x":64,"y":122,"sample":0}"#);
    let facts = page.message("inspect");
    let surface = &facts["facts"]["samples"][0]["traces"][0]["vertices"][1];
    assert_eq!(
        [&found["object"], &found["material"]],
        [&surface["object"], &surface["material"]]
    );
    let runs = found["outline"]["runs"].as_array().unwrap();
    let cells = runs.iter().map(|run| run.as_u64().unwrap());
    assert_eq!(found["outline"]["size"], json!([128, 128]));
    assert_eq!(cells.clone().sum::<u64>(), 128 * 128);
    // The picked cell belongs to the outline.
    let (at, mut end) = (122 * 128 + 64, 0);
    let run = cells.clone().position(|run| {
        end += run;
        end > at
    });
    assert_eq!(run.unwrap() % 2, 1, "{found}");

    page.send(r#"{"do":"pick","x":128,"y":0}"#);
    let refused = page.message("error");
    assert!(
        refused["text"].as_str().unwrap().contains("outside the image"),
        "{refused}"
    );
    let folder = pawns();
    let viewer = Viewer::start(folder.path(), &split("pawns.obj --size 64x48 --spp 1"));
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"pick","x":1,"y":1}"#);
    let nothing = page.message("pick");
    assert!(
        nothing["material"].is_null() && nothing["outline"].is_null(),
        "{nothing}"
    );
}

/// Each view of `embrasure views` has an image. The image of the render stays bit-identical to the
/// image of `render`.
#[test]
fn views_are_pictures() {
    let folder = pawns();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut page = viewer.page();
    page.wait_for_all();
    page.send(r#"{"do":"views"}"#);
    let list = page.message("views");
    let flags: Vec<&str> = list["views"]
        .as_array()
        .unwrap()
        .iter()
        .map(|view| view["flags"].as_str().unwrap())
        .collect();
    let printed = done(folder.path(), &split("views pawns.obj --size 96x72 --json"));
    let printed: Value = serde_json::from_slice(&printed.stdout).unwrap();
    let printed: Vec<&str> = printed
        .as_array()
        .unwrap()
        .iter()
        .map(|view| view["flags"].as_str().unwrap())
        .collect();
    assert_eq!(flags, printed);
    let mut pictures = Vec::new();
    for i in 0..flags.len() {
        let message = page.message("view-picture");
        assert_eq!(message["index"], i);
        let png = BASE64_STANDARD.decode(message["image"].as_str().unwrap()).unwrap();
        let picture = image::load_from_memory(&png).unwrap().to_rgb8();
        assert_eq!(picture.dimensions(), (224, 168));
        pictures.push(picture);
    }
    assert_ne!(pictures[0], pictures[1]);
    let mean =
        pictures[0].as_raw().iter().map(|&code| f64::from(code)).sum::<f64>() / pictures[0].as_raw().len() as f64;
    assert!((60.0..200.0).contains(&mean), "mean {mean}");

    let saved = folder.path().join("v.exr");
    fs::write(&saved, viewer.get("picture.exr").1).unwrap();
    done(folder.path(), &split(&format!("render {FLAGS} -q -o r.exr")));
    crate::support::program::assert_same_bits(&folder.path().join("r.exr"), &saved);
}

/// While pictures of views are rendered, the denoised image stays.
#[test]
fn denoised_picture_stays_during_views() {
    let folder = pawns();
    let viewer = Viewer::start(folder.path(), &split(&format!("{FLAGS} --denoise=atrous")));
    let mut page = viewer.page();
    page.send(r#"{"do":"channel","name":"denoised"}"#);
    page.frame_where(|h| h["denoised"] == true && h["final"] == true);
    page.send(r#"{"do":"views"}"#);
    let count = page.message("views")["views"].as_array().unwrap().len();
    let mut pictures = 0;
    while pictures < count {
        match page.next() {
            Message::Text(text) => pictures += usize::from(text.contains("view-picture")),
            Message::Binary(bytes) => assert_ne!(Frame::of(&bytes).header["denoised"], false),
            _ => {}
        }
    }
    page.send(r#"{"do":"pick","x":48,"y":50}"#);
    let found = page.message("pick");
    assert!(found["material"].is_string(), "{found}");
}

/// In a stereo picture a pixel belongs to the view of its eye.
#[test]
fn pixels_of_stereo_pictures_are_picked() {
    let folder = cornell_box();
    let flags = "cornell-box.toml --stereo side-by-side --size 128x64 --spp 1";
    let viewer = Viewer::start(folder.path(), &split(flags));
    let mut page = viewer.page();
    page.wait_for_all();
    let mut found = Vec::new();
    for x in [32, 96] {
        page.send(&format!(r#"{{"do":"pick","x":{x},"y":61}}"#));
        found.push(page.message("pick"));
    }
    assert!(found[0]["material"].is_string(), "{}", found[0]);
    assert_eq!(found[0]["material"], found[1]["material"]);
    // The outline has cells in both halves.
    let runs = found[0]["outline"]["runs"].as_array().unwrap();
    let runs = runs.iter().map(|run| run.as_u64().unwrap() as usize).enumerate();
    let cells: Vec<bool> = runs.flat_map(|(i, run)| vec![i % 2 == 1; run]).collect();
    assert_eq!(found[0]["outline"]["size"], json!([128, 64]));
    assert!(cells[61 * 128 + 32] && cells[61 * 128 + 96]);
}

/// Textures of materials are served as thumbnails, and other files are not.
#[test]
fn textures_are_thumbnails() {
    let folder = folder(&[
        ("a.mtl", "newmtl m\nKd 1 1 1\nmap_Kd t.png\n"),
        (
            "a.obj",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n",
        ),
    ]);
    let mut texture = image::RgbImage::new(200, 100);
    for (x, _, pixel) in texture.enumerate_pixels_mut() {
        *pixel = image::Rgb(if x < 100 { [200, 10, 10] } else { [10, 10, 200] });
    }
    texture.save(folder.path().join("t.png")).unwrap();
    let viewer = Viewer::start(folder.path(), &split("a.obj --size 32x32 --spp 1"));
    let mut page = viewer.page();
    let hello = page.message("hello");
    let texture = &hello["materials"][0]["textures"][0];
    assert_eq!(
        (&texture["key"], &texture["size"]),
        (&json!("diffuse_map"), &json!([200, 100]))
    );
    let mean = [0, 1, 2].map(|c| texture["mean"][c].as_f64().unwrap());
    assert!((mean[0] - mean[2]).abs() < 0.02 && mean[1] < 0.01, "{mean:?}");
    let (status, png) = viewer.get(&format!("texture.png?id={}", texture["id"]));
    assert_eq!(status, 200);
    let small = image::load_from_memory(&png).unwrap().to_rgb8();
    assert_eq!(small.dimensions(), (96, 48));
    for (x, expected) in [(20, [200, 10, 10]), (75, [10, 10, 200])] {
        let found = small.get_pixel(x, 24).0;
        assert!(
            (0..3).all(|c| found[c].abs_diff(expected[c]) < 6),
            "{found:?} {expected:?}"
        );
    }
    assert_eq!(viewer.get("texture.png?id=99").0, 409);
    assert_eq!(viewer.get("texture.png?id=../t").0, 404);
    assert_eq!(viewer.get("texture.png").0, 404);
}

/// Mouse and key hints are shown over the first image. The first action hides them, and this
/// browser does not show them again.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn hints_are_shown_once() {
    let folder = pawns();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start();
    let tab = browser.open(&viewer.link(), [1280, 800]);
    let shown = "!document.getElementById('hints').hidden";
    browser.wait(&tab, shown);
    assert_eq!(browser.value(&tab, "document.getElementById('loading').hidden"), true);
    let (middle, _) = browser.picture(&tab);
    browser.click(&tab, middle);
    browser.wait(&tab, "document.getElementById('hints').hidden");
    let again = browser.open(&viewer.link(), [900, 700]);
    browser.wait(&again, DENOISED);
    assert_eq!(browser.value(&again, shown), false);
    click_on(&mut browser, &again, "help");
    assert_eq!(browser.value(&again, shown), true);
}

/// A disabled button has the reason in its text and title. Fields have names, keys and sliders.
/// Presets of the program have preview balls.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn disabled_controls_have_a_reason() {
    let folder = pawns();
    let viewer = Viewer::start(folder.path(), &split(FLAGS));
    let mut browser = Browser::start();
    let tab = browser.open(&viewer.link(), [900, 700]);
    browser.wait(&tab, DENOISED);
    let silent = "[...document.querySelectorAll('button:disabled')].filter((b) => !b.querySelector('.why')?.textContent || !b.title.includes(b.querySelector('.why').textContent)).map((b) => b.id)";
    assert_eq!(browser.value(&tab, silent), json!([]));
    let save = browser.value(&tab, "document.getElementById('save-camera').textContent");
    assert!(save.as_str().unwrap().contains("embrasure init"), "{save}");

    // Each key from the program has a readable name.
    let unnamed = "import('./names.js').then(({ isNamed }) => [...document.querySelectorAll('#material-keys code, #parameters code')].map((c) => c.textContent).filter((key) => !isNamed(key)))";
    browser.value(
        &tab,
        "document.querySelectorAll('details').forEach((details) => (details.open = true))",
    );
    assert_eq!(browser.value(&tab, unnamed), json!([]));
    let keys = browser.value(
        &tab,
        "document.querySelectorAll('#material-keys code, #parameters code').length",
    );
    assert!(keys.as_u64().unwrap() > 50, "{keys}");
    // Keys with a range have a slider and a number.
    for key in ["roughness", "metallic", "clearcoat", "opacity"] {
        let field = format!("document.querySelector('[data-key=\"{key}\"]').closest('.field')");
        let inputs = format!("[...{field}.querySelectorAll('input')].map((input) => input.type)");
        assert_eq!(browser.value(&tab, &inputs), json!(["range", "number"]), "{key}");
    }
    // A slider sends the number that is displayed.
    browser.value(
        &tab,
        "document.querySelector('[data-tab=\"materials\"]').click(), embrasure.materials.choose('red')",
    );
    browser.value(
        &tab,
        "(() => { const slider = document.querySelector('[data-key=\"roughness\"]').closest('.field').querySelector('[type=range]'); slider.value = 0.3; for (const kind of ['input', 'change']) slider.dispatchEvent(new Event(kind, { bubbles: true })); })()",
    );
    browser.wait(
        &tab,
        "document.getElementById('patch').value.includes('roughness = 0.3')",
    );
    browser.wait(&tab, "document.getElementById('reset-materials').disabled === false");
    browser.wait(
        &tab,
        "document.getElementById('save-materials').textContent.includes('bare OBJ')",
    );

    // Presets in the form that the program sends
    let presets = "[{ name: 'gold', keys: { model: 'mirror', eta: [0.143, 0.375, 1.442], k: [3.983, 2.386, 1.603] } }, { name: 'frosted-glass' }, { name: 'plastic', about: 'glossy blue plastic', keys: { diffuse: '#2f6fb4', metallic: 0 } }]";
    browser.value(
        &tab,
        &format!("embrasure.materials.build(embrasure.materials.list, embrasure.materials.keys, {presets}), 0"),
    );
    let balls = browser.value(
        &tab,
        "[...document.querySelectorAll('#presets button')].map((ball) => ball.textContent)",
    );
    assert_eq!(balls, json!(["gold", "frosted glass", "plastic"]));
    let plastic = browser.value(
        &tab,
        "(() => { const c = document.querySelectorAll('#presets canvas')[2]; return [...c.getContext('2d').getImageData(c.width / 2, c.height / 2, 1, 1).data]; })()",
    );
    assert!(plastic[2].as_u64() > plastic[0].as_u64(), "{plastic}");
    let gold = browser.value(
        &tab,
        "(() => { const c = document.querySelector('#presets canvas'); return [...c.getContext('2d').getImageData(c.width / 2, c.height / 2, 1, 1).data]; })()",
    );
    let [r, g, b, alpha] = [0, 1, 2, 3].map(|c| gold[c].as_u64().unwrap());
    assert!(r > g && g > b && alpha == 255, "{gold}");
    browser.value(
        &tab,
        "window.sent = [], embrasure.link.send = (command) => command.do === 'material' && window.sent.push(command), document.querySelector('#presets button').click()",
    );
    let sent = json!([{ "do": "material", "name": "red", "key": "preset", "value": "gold" }]);
    assert_eq!(browser.value(&tab, "window.sent"), sent);
    assert_eq!(browser.value(&tab, "JSON.stringify(faults)"), "[]");
}
