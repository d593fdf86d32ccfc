//! Pages that are connected by a slow link.

use super::link::{SLOW, slow_link};
use super::{Page, Viewer};
use crate::support::program::{done, lit_floor, split};
use std::time::Instant;

/// Images are compressed for a slow link. They are frequent while the camera moves, and the
/// complete image has the light of the render without loss.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn slow_links_are_served() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &split("s.toml --size 512x384 --spp 8"));
    let mut page = Page::open_at(&viewer, &slow_link(&viewer, SLOW)).unwrap();
    let home = page.message("state")["camera"].clone();
    let is_rounded = |header: &serde_json::Value| header["packed"]["rounding"] == 4;
    // If the render is fast, the complete image may come without a preview.
    let is_of_move = |header: &serde_json::Value| header["preview"] == true || header["final"] == true;
    let moved = |page: &mut Page, x: f64| {
        let mut camera = home.clone();
        camera["position"][0] = x.into();
        camera["do"] = "camera".into();
        page.send(&camera.to_string());
        page.frame_where(is_of_move)
    };
    // The speed of the link is measured with the first images. A fast render may be complete before
    // that, so move the camera to get more images.
    let measuring = (1..=60).find(|step| is_rounded(&moved(&mut page, f64::from(*step) / 60.0).header));
    let (start, timed) = (Instant::now(), 30);
    for step in 1..=timed {
        let frame = moved(&mut page, f64::from(step) / f64::from(timed));
        assert!(frame.header["packed"].is_object(), "{}", frame.header);
    }
    let rate = f64::from(timed) / start.elapsed().as_secs_f64();
    assert!(rate > 2.0, "{rate} pictures a second");

    page.look(&home);
    // The complete image of an earlier move may still be in transit.
    let moves = measuring.expect("no picture was rounded") + timed + 1;
    let whole = page.frame_where(|h| h["moves"] == moves && h["final"] == true && h["samples"] == 8.0);
    assert_eq!(whole.header["packed"]["rounding"], 0);
    assert!(whole.bytes < 512 * 384 * 6 * 9 / 10, "{} bytes", whole.bytes);
    done(
        folder.path(),
        &split("render s.toml --size 512x384 --spp 8 -q -o r.exr"),
    );
    assert!(whole.halves().eq(super::halves_of(&folder.path().join("r.exr"))));

    // The slow page does not delay another page on a fast link.
    let mut fast = viewer.page();
    fast.send(r#"{"do":"restart"}"#);
    fast.frame_where(|h| h["final"] == true && h["samples"] == 8.0);
}
