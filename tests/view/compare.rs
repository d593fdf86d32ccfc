//! Two settings side by side at equal time.

use super::Viewer;
use crate::support::program::{assert_same_bits, code, done, lit_floor, run, split, words};
use std::fs;

/// Both renders complete, and take about the same time. Their images equal the images of separate
/// renders. Errors against a reference decrease.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn two_settings_are_compared() {
    let folder = lit_floor();
    let folder = folder.path();
    done(
        folder,
        &split("render s.toml --size 96x64 --spp 512 --seed 9 -q -o reference.exr"),
    );
    let flags = "s.toml --size 96x64 --spp 256";
    let viewer = Viewer::start(
        folder,
        &split(&format!(
            "{flags} --compare path,path+reuse=none+max_depth=3 --reference reference.exr"
        )),
    );
    let mut page = viewer.page();
    let state = page.message("state");
    assert_eq!(state["compare"], "path+reuse=none+max_depth=3");
    let both = |said: &serde_json::Value| said["second"].is_object();
    let early = page.message_where("errors", both);
    let [one, other] = ["first", "second"].map(|side| early[side]["seconds"].as_f64().unwrap());
    // The times differ by at most a time slice. On a busy machine time slices are longer
    assert!((one - other).abs() < 2.0, "{early}");
    assert_eq!(early["first"]["settings"], "path");
    // Request the channel only now. The last image of a fast render may arrive before the errors,
    // and `message_where` drops images.
    page.send(r#"{"do":"channel","name":"picture","second":"compared"}"#);
    let second = page.frame_where(|h| h["channel"] == "compared" && h["final"] == true && h["samples"] == 256.0);
    page.wait_for_all();
    page.send(r#"{"do":"compare","with":"path+seed=5"}"#);
    let late = page.message_where("errors", |e| {
        e["second"]["samples"] == 256.0 && e["first"]["samples"] == 256.0
    });
    let error = |said: &serde_json::Value, side: &str| said[side]["error"].as_f64().unwrap();
    assert!(
        error(&late, "first") > 0.0 && error(&late, "first") <= error(&early, "first"),
        "{early} {late}"
    );
    assert!(late["between"].as_f64().unwrap() > 0.0, "{late}");
    page.wait_for_all();

    // Both images equal `render` with these settings.
    fs::write(folder.join("v.exr"), viewer.get("picture.exr").1).unwrap();
    done(folder, &split(&format!("render {flags} -q -o r.exr")));
    assert_same_bits(&folder.join("r.exr"), &folder.join("v.exr"));
    done(
        folder,
        &split(&format!("render {flags} --reuse none --max-depth 3 -q -o r.exr")),
    );
    assert!(second.halves().eq(super::halves_of(&folder.join("r.exr"))));

    // A moved camera applies to both renders.
    let mut camera = state["camera"].clone();
    camera["position"][0] = 0.5.into();
    page.look(&camera);
    page.message_where("errors", |e| e["second"]["samples"].as_f64() >= Some(16.0));
    page.send(r#"{"do":"compare","with":"nonsense"}"#);
    let said = page.message("error");
    assert!(
        said["text"].as_str().unwrap().contains("neither an integrator"),
        "{said}"
    );
    page.send(r#"{"do":"compare","with":null}"#);
    page.message_where("state", |state| state["compare"].is_null());
    page.wait_for_all();
}

/// The second method is progressive photon mapping, and not a variant of the first one, the path
/// tracer.
#[test]
fn photons_are_compared() {
    let folder = lit_floor();
    let viewer = Viewer::start(folder.path(), &split("s.toml --spp 16 --compare path,sppm+photons=500"));
    let mut page = viewer.page();
    page.send(r#"{"do":"channel","name":"picture","second":"compared"}"#);
    // A page that changes its channel gets the samples so far as a final image.
    let second = page.frame_where(|h| h["channel"] == "compared" && h["final"] == true && h["samples"] == 16.0);
    done(
        folder.path(),
        &split("render s.toml --spp 16 --integrator sppm --photons 500 -q -o r.exr"),
    );
    assert!(second.halves().eq(super::halves_of(&folder.path().join("r.exr"))));
}

/// Invalid comparisons are errors before the server starts.
#[test]
fn invalid_comparisons_are_errors() {
    let folder = lit_floor();
    for (line, part) in [
        ("view s.toml --no-open --compare path", "in place of two"),
        ("view s.toml --no-open --compare path,nonsense", "neither an integrator"),
        ("view s.toml --no-open --compare path,path+width=30", "different sizes"),
        ("view s.toml --no-open --compare path,path+max_depth=x", "max_depth"),
        ("view s.toml --no-open --reference none.exr", "none.exr"),
    ] {
        let out = run(folder.path(), &split(line));
        assert_ne!(code(&out), 0, "{line}");
        assert!(words(&out).contains(part), "{line}: {}", words(&out));
    }
}
