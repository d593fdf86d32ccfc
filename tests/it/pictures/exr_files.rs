//! EXR files: compression and half floats keep the content.

use crate::support::program::{assert_same_bits, done, folder, joined, refused, split};
use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use std::collections::BTreeMap;
use std::path::Path;
use tempfile::TempDir;

fn scene() -> TempDir {
    folder(&[
        ("wall.obj", "v -3 -2 0\nv 3 -2 0\nv 3 2 0\nv -3 2 0\nf 1 2 3 4\n"),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n[image]\nwidth = 70\nheight = 50\n\
             [[light]]\ntype = \"point\"\nposition = [1, 1, 1]\nintensity = [9, 1e7, 1]\n[[object]]\nobj = \"wall.obj\"\n",
        ),
    ])
}

/// For each channel by name: true if it stores half floats, and its values.
fn channels(path: &Path) -> BTreeMap<String, (bool, Vec<f32>)> {
    let image = read_all_flat_layers_from_file(path).unwrap();
    let channels = image.layer_data.into_iter().flat_map(|layer| layer.channel_data.list);
    let channel = |samples: FlatSamples| match samples {
        FlatSamples::F16(values) => (true, values.iter().map(|v| v.to_f32()).collect()),
        FlatSamples::F32(values) => (false, values),
        FlatSamples::U32(values) => (false, values.iter().map(|v| *v as f32).collect()),
    };
    channels.map(|c| (c.name.to_string(), channel(c.sample_data))).collect()
}

/// Renders the scene with `flags` to `output`.
fn render(folder: &Path, flags: &str, output: &str) {
    let line = format!("render s.toml -q --spp 8 --aov all {flags} -o {output}");
    done(folder, &split(&line));
}

#[test]
fn compression_changes_no_bit() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    render(folder.path(), "", "usual.exr");
    for name in ["zip", "zips", "piz", "rle", "none"] {
        render(folder.path(), &format!("--compression {name}"), "o.exr");
        assert_same_bits(&path("usual.exr"), &path("o.exr"));
    }
}

#[test]
fn half_floats_are_in_the_requested_channels() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    render(folder.path(), "", "float.exr");
    render(folder.path(), "--half picture,N --compression piz", "half.exr");
    let (float, half) = (channels(&path("float.exr")), channels(&path("half.exr")));
    assert!(float.keys().eq(half.keys()));
    for (name, (is_half, values)) in &half {
        let expected = ["R", "G", "B", "N.X", "N.Y", "N.Z"].contains(&name.as_str());
        assert_eq!(*is_half, expected, "{name}");
        for (half, float) in values.iter().zip(&float[name].1) {
            let is_right = match is_half {
                // Values too bright for a half float become the largest half float
                true if *float > 65504.0 => *half == 65504.0,
                // The allowed error is half a unit of the last of 11 bits, or half of the smallest
                // half float
                true => (float - half).abs() <= float.abs() * 2f32.powi(-11) + 2f32.powi(-25),
                false => half == float,
            };
            assert!(is_right, "{name}: {float} became {half}");
        }
    }
    assert!(float["G"].1.iter().any(|v| *v > 65504.0));

    // Channels with integers, or with values beyond the range of half floats, stay floats.
    render(folder.path(), "--half all", "all.exr");
    let all = channels(&path("all.exr"));
    let floats: Vec<&str> = all
        .iter()
        .filter(|(_, (half, _))| !half)
        .map(|(name, _)| name.as_str())
        .collect();
    let is_kept = |name: &&str| {
        ["Z", "emitted", "samples", "variance", "id", "Crypto"]
            .iter()
            .any(|kept| name.starts_with(kept))
    };
    assert!(floats.iter().all(is_kept), "{floats:?}");
    for name in ["albedo", "Z"] {
        let line = format!("render s.toml --half albedo,{name}x");
        let words = refused(folder.path(), &split(&line), 2);
        assert!(
            words.contains(&format!("{name}x")) && words.contains("picture"),
            "{words}"
        );
    }
}

/// A part has exact sums of samples, even if its image stores half floats.
#[test]
fn half_float_parts_merge_without_loss() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    let usual = split("render s.toml -q --spp 128");
    done(folder.path(), &joined(&usual, &split("-o one.exr")));
    for (samples, output) in [("0..64", "a.exr"), ("64..128", "b.exr")] {
        let flags = format!("--samples {samples} -o {output} --half all --compression piz");
        done(folder.path(), &joined(&usual, &split(&flags)));
    }
    done(folder.path(), &split("merge -q a.exr b.exr -o merged.exr"));
    assert_same_bits(&path("one.exr"), &path("merged.exr"));
    done(folder.path(), &split("merge -q a.exr b.exr --half picture -o half.exr"));
    let (one, half) = (channels(&path("one.exr")), channels(&path("half.exr")));
    assert!(half["R"].0 && !half["Z"].0 && half["Z"] == one["Z"]);
}
