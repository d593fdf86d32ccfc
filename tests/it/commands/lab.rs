//! `embrasure lab`: comparisons, written files, and its page in a browser.

use crate::support::program::{
    code, command, done, joined, lit_floor, printed, refused, run, signal, split, wait_for_work, words,
};
use crate::support::{chromium, read_rgb};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

fn replace(folder: &Path, from: &str, to: &str) {
    let old = fs::read_to_string(folder.join("s.toml")).unwrap();
    assert!(old.contains(from));
    fs::write(folder.join("s.toml"), old.replace(from, to)).unwrap();
}

/// Rows of a CSV file of the lab: the name of each row, and its numbers as text.
fn rows(path: &Path) -> Vec<(String, Vec<String>)> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("estimator,samples,seconds,relmse,efficiency,block_relmse")
    );
    let row = |line: &str| {
        let (name, numbers) = line[1..].split_once("\",").unwrap();
        (name.to_string(), numbers.split(',').map(String::from).collect())
    };
    lines.map(row).collect()
}

/// Data in the script of the HTML page at `path`.
fn data(path: &Path) -> Value {
    let page = fs::read_to_string(path).unwrap();
    let (_, rest) = page
        .split_once("<script type=\"application/json\" id=\"data\">")
        .unwrap();
    let (json, _) = rest.split_once("</script>").unwrap();
    serde_json::from_str(json).unwrap()
}

#[test]
fn the_lab_compares_the_ladder() {
    let folder = lit_floor();
    done(folder.path(), &["lab", "s.toml", "--spp", "4", "-o", "ladder"]);
    let csv = fs::read_to_string(folder.path().join("ladder.csv")).unwrap();
    assert_eq!(csv.lines().count(), 9, "{csv}");
    // Names of estimators may contain commas, so columns are counted from the end of the line.
    let error = |line: usize| -> f64 {
        let line = csv.lines().nth(line).unwrap();
        line.rsplit(',').nth(2).unwrap().parse().unwrap()
    };
    assert!(error(7) < error(2), "{csv}");
    assert!(
        fs::read_to_string(folder.path().join("ladder.md"))
            .unwrap()
            .contains("| + MIS | 4 |")
    );
    assert!(
        fs::read(folder.path().join("ladder.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );
    // Compare at equal time with an existing reference
    let reference = ["render", "s.toml", "--spp", "64", "-o", "r.exr"];
    done(folder.path(), &reference);
    // Select integrators by their names
    done(
        folder.path(),
        &split("lab s.toml --methods path,bdpt,light --spp 2 --reference r.exr -q -o methods"),
    );
    let table = fs::read_to_string(folder.path().join("methods.csv")).unwrap();
    let rows: Vec<&str> = table.lines().map(|line| line.split(',').next().unwrap()).collect();
    assert_eq!(rows, ["estimator", "\"path\"", "\"bdpt\"", "\"light\""]);
    // Names may be padded with blanks. The last unbiased estimator renders the reference, and its
    // name is printed.
    let out = done(
        folder.path(),
        &["lab", "s.toml", "--methods", "bdpt, sppm", "--spp", "1", "-o", "judged"],
    );
    assert!(
        words(&out).contains("reference: bdpt, 64 samples of other seeds"),
        "{}",
        words(&out)
    );
    let said = refused(folder.path(), &split("lab s.toml --methods whitted,sppm,vcm"), 2);
    assert!(said.contains("--reference FILE"), "{said}");
    done(
        folder.path(),
        &split("lab s.toml --methods sppm --spp 1 --reference r.exr -q -o one"),
    );
    let said = refused(folder.path(), &split("lab s.toml --methods path,nonsense"), 2);
    assert!(said.contains("nonsense") && said.contains("bdpt"), "{said}");
    let out = run(folder.path(), &split("lab s.toml --time 0.05s --reference r.exr -q"));
    assert_eq!((code(&out), words(&out).as_str()), (0, ""));
    assert!(folder.path().join("s-lab.png").exists());
    let said = refused(
        folder.path(),
        &["lab", "s.toml", "--reference", "r.exr", "--size", "8x8"],
        2,
    );
    assert!(said.contains("40x24"), "{said}");
}

/// Deep ray trees may have too many rays. They are refused before the first ray. The error has the
/// number of rays.
#[test]
fn trees_with_too_many_rays_are_refused() {
    let folder = lit_floor();
    replace(folder.path(), "samples = 4", "samples = 4\nmax_depth = 64");
    let line = "lab s.toml --methods path,distributed:tree_depth=64 --spp 4 -q";
    let said = refused(folder.path(), &split(line), 2);
    assert!(said.contains("--tree-depth") && said.contains("3.4e38 rays"), "{said}");
    done(folder.path(), &joined(&split(line), &["--max-depth", "2"]));
    // The maximum depth of paths does not set the depth of ray trees.
    done(
        folder.path(),
        &split("lab s.toml --methods path,distributed --spp 4 -q"),
    );
}

/// The page, the plot and the CSV file have the same points of the curves. The slopes are fitted to
/// these points.
#[test]
fn curves_have_the_figures_of_the_table() {
    let folder = lit_floor();
    let path = |name: &str| folder.path().join(name);
    let line = "lab s.toml --methods path,path:sampler=halton:reuse=none,naive --spp 1,10,40 --html page.html -o c";
    let out = done(folder.path(), &split(line));
    let table = rows(&path("c.csv"));
    let names = ["path", "path:sampler=halton:reuse=none", "naive"];
    let expected: Vec<(&str, &str)> = names
        .iter()
        .flat_map(|name| [(*name, "1"), (*name, "10"), (*name, "40")])
        .collect();
    let found: Vec<(&str, &str)> = table
        .iter()
        .map(|(name, numbers)| (name.as_str(), numbers[0].as_str()))
        .collect();
    assert_eq!(found, expected);
    let curves = rows(&path("c-curves.csv"));
    let samples: Vec<&str> = curves.iter().take(6).map(|(_, numbers)| numbers[0].as_str()).collect();
    assert_eq!(samples, ["1", "4", "10", "16", "40", "1"]);
    // Rows of the table are points of the curves.
    assert!(table.iter().all(|row| curves.contains(row)));

    let data = data(&path("page.html"));
    let points = data["estimators"].as_array().unwrap().iter().flat_map(|estimator| {
        let name = estimator["name"].as_str().unwrap();
        estimator["points"].as_array().unwrap().iter().map(move |point| {
            let number = |key: &str| point[key].as_f64().unwrap();
            let [error, efficiency, blocks] =
                ["relmse", "efficiency", "block_relmse"].map(|key| format!("{:.6e}", number(key)));
            let seconds = format!("{:.4}", number("seconds"));
            (
                name.to_string(),
                vec![point["samples"].to_string(), seconds, error, efficiency, blocks],
            )
        })
    });
    assert_eq!(points.collect::<Vec<_>>(), curves);

    // Read the points back from the plot, by its axes
    let svg = fs::read_to_string(path("c-curves.svg")).unwrap();
    let mut plotted = Vec::new();
    let plot = svg.split("<g class=\"plot\" data-measure=\"samples\"").nth(1).unwrap();
    let plot = plot.split("<g class=\"plot\"").next().unwrap();
    let attribute = |text: &str, name: &str| -> String {
        let (_, rest) = text.split_once(&format!("{name}=\"")).unwrap();
        rest.split('"').next().unwrap().into()
    };
    let [from, to, start, end] =
        ["data-from", "data-to", "data-start", "data-end"].map(|name| attribute(plot, name).parse::<f64>().unwrap());
    for polyline in plot.split("<polyline ").skip(1) {
        for point in attribute(polyline, "points").split(' ') {
            let x: f64 = point.split(',').next().unwrap().parse().unwrap();
            plotted.push(10f64.powf(from + (x - start) / (end - start) * (to - from)));
        }
    }
    let expected: Vec<f64> = curves.iter().map(|(_, numbers)| numbers[0].parse().unwrap()).collect();
    assert_eq!(plotted.len(), expected.len());
    assert!(
        plotted.iter().zip(&expected).all(|(x, n)| (x / n - 1.0).abs() < 1e-3),
        "{plotted:?}"
    );

    // Fit slopes to the rows of the file
    let mut of_name: BTreeMap<&str, Vec<[f64; 2]>> = BTreeMap::new();
    for (name, numbers) in &curves {
        let [n, error] = [0, 2].map(|i| numbers[i].parse::<f64>().unwrap().ln());
        of_name.entry(name).or_default().push([n, error]);
    }
    for (name, points) in of_name {
        let mean = |axis: usize| points.iter().map(|p| p[axis]).sum::<f64>() / points.len() as f64;
        let (x, y) = (mean(0), mean(1));
        let slope = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>()
            / points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>();
        let told = format!("- {name}: relMSE falls as N^{slope:.2} in samples");
        assert!(printed(&out).contains(&told), "{told}: {}", printed(&out));
        assert!(slope < -0.4, "{name}: {slope}");
    }
}

/// A snapshot is bit-identical to a render with the same number of samples. This holds within a
/// pass and at its end, and for samplers that depend on the number of samples.
#[test]
fn snapshots_equal_renders() {
    let folder = lit_floor();
    for (sampler, spp) in [("sobol", "100"), ("orthogonal", "16")] {
        let line = format!("render s.toml -q --seed 5 --spp 512 --integrator bdpt -o r-{sampler}.exr");
        done(folder.path(), &split(&line));
        let line = format!("render s.toml -q --spp {spp} --reuse none --sampler {sampler} -o x.exr");
        done(folder.path(), &split(&line));
        let line = format!(
            "lab s.toml -q --methods path:reuse=none:sampler={sampler} --spp 3,{spp} --reference r-{sampler}.exr -o lab"
        );
        done(folder.path(), &split(&line));
        let [image, reference] = ["x.exr", &format!("r-{sampler}.exr")].map(|name| read_rgb(&folder.path().join(name)));
        let rows = rows(&folder.path().join("lab.csv"));
        assert_eq!(rows[1].1[0], spp);
        let told: f64 = rows[1].1[2].parse().unwrap();
        let expected = kept_rel_mse(&image, &reference);
        assert!((told / expected - 1.0).abs() < 1e-5, "{sampler}: {told} and {expected}");
    }
}

/// relMSE without the worst 0.1 % of the pixels.
fn kept_rel_mse(image: &[Vec<f32>; 3], reference: &[Vec<f32>; 3]) -> f64 {
    let of_pixel = |i: usize| -> f64 {
        let of_channel = |c: usize| {
            let (x, r) = (f64::from(image[c][i]), f64::from(reference[c][i]));
            (x - r).powi(2) / (r * r + 0.01)
        };
        (0..3).map(of_channel).sum::<f64>() / 3.0
    };
    let mut errors: Vec<f64> = (0..image[0].len()).map(of_pixel).collect();
    errors.sort_by(f64::total_cmp);
    errors.truncate((0.999 * errors.len() as f64).ceil() as usize);
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// Methods may differ in any key of `[render]`: also in light sampling, which rebuilds the scene,
/// and in denoisers.
#[test]
fn methods_may_differ_in_any_setting() {
    let folder = lit_floor();
    let line = "lab s.toml -q --spp 16 -o m --methods path,path:light_selection=all,path:triangle_sampling=solid-angle:seed=3,path:denoise=gaussian,naive";
    done(folder.path(), &split(line));
    let rows = rows(&folder.path().join("m.csv"));
    let error: Vec<f64> = rows.iter().map(|(_, numbers)| numbers[2].parse().unwrap()).collect();
    assert_eq!(error.len(), 5);
    // All images differ.
    assert!((0..5).all(|i| (0..i).all(|j| error[i] != error[j])), "{error:?}");
    for (methods, expected) in [
        ("path:smapler=sobol", "did you mean sampler?"),
        ("path:sampler=haltn", "did you mean halton?"),
        ("bdtp", "did you mean bdpt?"),
        ("path:denoise_radius=3", "the denoiser has no radius"),
    ] {
        let said = refused(folder.path(), &["lab", "s.toml", "--methods", methods], 2);
        assert!(said.contains(expected), "{methods}: {said}");
    }
    // Images of all methods must fit into memory.
    let line = "lab s.toml --size 400x400 --spp 1000000 --max-memory 150M";
    let said = refused(folder.path(), &split(line), 1);
    assert!(
        said.contains("the pictures of all estimators take about 170.9 MB"),
        "{said}"
    );
    // A key without effect in the method is a warning.
    let line = "lab s.toml -q --spp 1 -o n --methods path,naive:light_samples=4";
    let said = words(&done(folder.path(), &split(line)));
    assert!(said.contains("naive does not use light_samples"), "{said}");
    // Camera flags are the same as in `render`.
    let differs = |more: &str| {
        done(
            folder.path(),
            &joined(&split("lab s.toml -q --spp 1 --methods path -o v"), &split(more)),
        );
        fs::read(folder.path().join("v.png")).unwrap()
    };
    assert!(differs("") != differs("--orbit 20,40 --fov 30"));
}

/// Each estimator takes at least one sample per pixel. If this sample takes longer than `--time`, a
/// message reports it.
#[test]
fn too_short_time_is_reported() {
    let folder = lit_floor();
    let line = "lab s.toml -q --size 640x400 --methods path --time 0.001s,30m -o t";
    let child = command(folder.path(), &split(line)).spawn().unwrap();
    wait_for_work(&child, Duration::from_millis(1500));
    signal(&child, "INT");
    let said = words(&child.wait_with_output().unwrap());
    assert!(
        said.contains("path: one sample per pixel takes") && said.contains("more than --time 0.001s"),
        "{said}"
    );
    assert!(!said.contains("1800"), "{said}");
}

/// An interrupt ends any method within a second. The rows of complete estimators are written. They
/// have no relMSE, because there is no reference yet.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn interrupt_writes_complete_estimators() {
    for methods in [
        "path,bdpt",
        "distributed:branching=16,path",
        "pssmlt,path",
        "irradiance-cache,path",
        "photon-map,path",
    ] {
        let folder = lit_floor();
        let line = "lab s.toml -q --size 640x400 --spp 4,100000000 --html page.html -o i --methods";
        let mut child = command(folder.path(), &joined(&split(line), &[methods]))
            .spawn()
            .unwrap();
        wait_for_work(&child, Duration::from_millis(1500));
        signal(&child, "INT");
        let start = Instant::now();
        child.wait().unwrap();
        let seconds = start.elapsed().as_secs_f64();
        let out = child.wait_with_output().unwrap();
        assert_eq!(code(&out), 130, "{methods}: {}", words(&out));
        // The program should end within a second. A loaded machine gets more time.
        assert!(seconds < 20.0, "{methods}: {seconds} s");
        let said = words(&out);
        let name = methods.split(',').next().unwrap();
        match said.contains("nothing is written") {
            true => assert!(!folder.path().join("i.csv").exists()),
            false => {
                assert!(said.contains(&format!("interrupted during `{name}`")), "{said}");
                let rows = rows(&folder.path().join("i.csv"));
                assert!(
                    rows.iter()
                        .all(|(found, numbers)| found == name && numbers[2].is_empty()),
                    "{rows:?}"
                );
                assert!(data(&folder.path().join("page.html"))["reference"].is_null());
            }
        }
    }
}

/// `path` finds no light below the water of the pool, which only photons find. The reference
/// therefore lacks light, and all results say so.
#[test]
fn reference_without_caustics_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/pool.toml");
    let line = "--size 48x40 --spp 1 --methods path,naive:max_depth=4 --html l.html -o l";
    let out = done(folder.path(), &joined(&["lab", scene], &split(line)));
    let said = words(&out);
    assert!(said.contains("warning: The reference lacks light: in "), "{said}");
    assert!(said.contains("--integrator sppm or vcm"), "{said}");
    let table = fs::read_to_string(folder.path().join("l.md")).unwrap();
    assert!(table.contains("**Warning.** The reference lacks light"), "{table}");
    let data = data(&folder.path().join("l.html"));
    let warnings: Vec<&str> = data["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_str)
        .collect();
    assert!(
        warnings
            .iter()
            .any(|text| text.starts_with("The reference lacks light")),
        "{warnings:?}"
    );
    assert!(data["witness"]["picture"].is_string());
}

/// A reference by an estimator with much noise is reported, and a converged reference is not.
#[test]
fn noisy_reference_is_reported() {
    let folder = lit_floor();
    let said = |methods: &str| {
        let line = format!("lab s.toml --spp 4 --methods {methods} -q -o n");
        words(&done(folder.path(), &split(&line)))
    };
    assert_eq!(said("naive,path"), "");
    let noisy = said("path,naive:directions=uniform");
    assert!(
        noisy.contains("warning: The reference has not converged: its own noise"),
        "{noisy}"
    );
}

/// The page needs no other files.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn page_needs_no_other_files() {
    let folder = lit_floor();
    let line = "lab s.toml -q --methods path,naive --time 0.05s,0.1s --html page.html -o p";
    done(folder.path(), &split(line));
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    for needle in [
        " src=\"",
        "<link",
        "@import",
        "url(http",
        "fetch(",
        "XMLHttpRequest",
        "{{",
    ] {
        assert!(!page.contains(needle), "{needle}");
    }
    // The only addresses are the namespace of SVG and references to papers.
    let addresses = page
        .split("http")
        .skip(1)
        .filter(|rest| rest.starts_with("://") || rest.starts_with("s://"));
    let other =
        addresses.filter(|rest| !rest.starts_with("://www.w3.org/2000/svg") && !rest.starts_with("s://doi.org/"));
    assert_eq!(other.count(), 0);
    // Each control has a name.
    for control in page.split("<input ").skip(1) {
        let before = page.split(control).next().unwrap();
        assert!(
            before.rfind("<label").unwrap() > before.rfind("</label>").unwrap_or(0),
            "{control:.60}"
        );
    }
    for button in page.split("<button ").skip(1) {
        let text = button.split('>').nth(1).unwrap().split('<').next().unwrap();
        assert!(
            button.split('>').next().unwrap().contains("aria-label=") || text.chars().all(char::is_alphabetic),
            "{button:.60}"
        );
    }
    let data = data(&folder.path().join("page.html"));
    assert_eq!(data["measure"], "seconds");
    let last = data["estimators"][0]["points"].as_array().unwrap().last().unwrap();
    assert_eq!(last["is_budget"], true);
}

/// Names of files and methods cannot end the script of the page, or become tags.
#[test]
fn names_are_text_in_the_page() {
    let folder = lit_floor();
    let name = "<b>&amp;</script>.toml".replace('/', "");
    fs::copy(folder.path().join("s.toml"), folder.path().join(&name)).unwrap();
    done(
        folder.path(),
        &[
            "lab",
            &name,
            "-q",
            "--spp",
            "1",
            "--methods",
            "path",
            "--html",
            "page.html",
            "-o",
            "n",
        ],
    );
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(!page.contains("<b>") && page.contains("&lt;b&gt;&amp;amp;&lt;script&gt;.toml"));
    assert!(
        data(&folder.path().join("page.html"))["summary"]
            .as_str()
            .unwrap()
            .contains("<b>&amp;<script>.toml")
    );
}

/// A browser shows all images of the page without a script error; radio buttons and slider select
/// the images.
#[test]
#[cfg_attr(not(chromium), ignore = "needs chromium")]
#[cfg_attr(all(chromium, not(long)), ignore = "long")]
fn a_browser_shows_the_page() {
    let folder = lit_floor();
    done(
        folder.path(),
        &split("lab s.toml -q --methods path,naive --spp 1,16 --html page.html -o p"),
    );
    // This script acts like a user of the page, and records the results.
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    let acts = "<script>
        const seen = [];
        const views = () => [...document.querySelectorAll('figure')].map((figure) => {
            const image = [...figure.querySelectorAll('img')].find((image) => !image.hidden);
            return figure.querySelector('.figures').textContent + '|' + (image ? image.className : 'none');
        });
        const choose = (selector) => document.querySelector(selector).click();
        seen.push(views());
        choose('[value=signed]'); seen.push(views());
        choose('[value=picture]');
        const slider = document.getElementById('slider');
        slider.value = 0; slider.dispatchEvent(new Event('input')); seen.push(views());
        choose('#zoom-in'); seen.push(getComputedStyle(document.querySelector('.view img')).transform);
        choose('[value=seconds]'); slider.value = slider.max; slider.dispatchEvent(new Event('input')); seen.push(views());
        document.body.dataset.seen = JSON.stringify(seen);
    </script></body>";
    fs::write(folder.path().join("acted.html"), page.replace("</body>", acts)).unwrap();
    let profile = folder.path().join("profile");
    let out = Command::new(chromium())
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
        ])
        .args([
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
        ])
        .args(["--enable-logging=stderr", "--virtual-time-budget=20000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", profile.display()))
        .arg(format!("file://{}/acted.html", folder.path().display()))
        .output()
        .unwrap();
    let [dom, log] = [&out.stdout, &out.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let errors: Vec<&str> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(errors.is_empty(), "{errors:?}");
    let attribute = |name: &str| {
        let (_, rest) = dom
            .split_once(&format!("{name}=\""))
            .unwrap_or_else(|| panic!("no {name}: {log}"));
        rest.split('"').next().unwrap().replace("&quot;", "\"")
    };
    // All images were decoded: two of estimators, and the reference.
    assert_eq!(attribute("data-pictures"), "3");
    let seen: Value = serde_json::from_str(&attribute("data-seen")).unwrap();
    let starts = |view: &Value, text: &str| view.as_str().unwrap().starts_with(text);
    assert!(
        starts(&seen[0][0], "16 samples, ") && seen[0][0].as_str().unwrap().ends_with('|'),
        "{seen}"
    );
    assert!(
        seen[1][0].as_str().unwrap().ends_with("|map") && seen[1][2].as_str().unwrap().ends_with('|'),
        "{seen}"
    );
    assert!(
        starts(&seen[2][0], "1 sample, ") && starts(&seen[2][1], "1 sample, "),
        "{seen}"
    );
    assert!(starts(&seen[3], "matrix(2, 0, 0, 2, "), "{seen}");
    assert!(starts(&seen[4][0], "16 samples, "), "{seen}");
    // The table has a row for each estimator and number of samples.
    assert_eq!(dom.matches("<th scope=\"row\">").count(), 4);
}
