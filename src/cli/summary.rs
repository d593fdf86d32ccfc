//! Text at the start and at the end of a render.

use super::job::Job;
use super::outputs::Images;
use super::printing;
use super::stats::Stats;
use super::stop::Stop;
use crate::color::{Exposure, tone::MAX_EXPOSURE};
use crate::session::Session;

/// Prints choices of the program: the origin, the guessed camera, the distance found by
/// `--focus-at`, the distance of the eyes, the guessed light and the guessed ground.
pub(super) fn print_choices(session: &Session) {
    if let Some(list) = session.settings().camera.origin_text() {
        errln!("origin: {list} is subtracted from all positions (--origin off keeps them)");
    }
    if let Some(guess) = session.camera_guess() {
        let origin = session.settings().camera.origin;
        let flags = if session.has_fov() {
            guess.flags(origin)
        } else {
            guess.place_flags(origin)
        };
        errln!("camera: {}\n  {flags}", guess.words);
    }
    if let Some(words) = session.words_of_scale() {
        errln!("scale: {words}");
    }
    if let Some(at) = session.settings().camera.focus_at {
        let distance = session.camera_description().parameters.focus_distance;
        errln!(
            "focus: at a distance of {}, by --focus-at {},{}",
            printing::number(distance.into()),
            at.x,
            at.y
        );
    }
    let camera = &session.settings().camera;
    if let Some(stereo) = session
        .camera_description()
        .stereo
        .filter(|_| camera.eye_distance.is_none())
    {
        let unit = match camera.unit {
            Some(metres) => format!("the unit of the OBJ file is {} m", printing::number(metres.into())),
            None => "no file names the unit, and a metre is assumed".into(),
        };
        errln!(
            "stereo: the eyes are {} units (0.064 m) apart, because {unit}; --eye-distance sets another distance",
            printing::number(stereo.eye_distance.into())
        );
    }
    if let Some(words) = session.light_guess() {
        errln!("light: {words}");
    }
    if let Some(words) = session.ground_guess() {
        errln!("ground: {words}");
    }
}

/// Minimum number of triangles without normals for the note that such triangles look faceted.
const ROUND: usize = 500;

/// Prints samples, denoiser and tone curve of a picture of a bare OBJ, with the flags that change
/// them. Also prints a note if the scene looks faceted.
pub(super) fn print_picture(session: &Session) {
    let flat = session.scene().meshes().iter().filter(|mesh| mesh.normals.is_empty());
    let triangles: usize = flat.map(|mesh| mesh.triangles.len()).sum();
    if triangles >= ROUND {
        errln!("shading: triangles without normals look faceted (--smooth 40 rounds them)");
    }
    let settings = session.settings();
    let denoiser = settings
        .denoiser_name()
        .map_or(String::from("not denoised"), |denoiser| {
            format!("denoised by {denoiser}")
        });
    errln!(
        "picture: {}{} per pixel, {denoiser}, tone curve {} (--quality draft or final, --spp N, --denoise=off, --tone NAME change that)",
        if settings.noise.is_some() { "up to " } else { "" },
        printing::count(settings.spp.into(), "sample"),
        settings.curve_name(),
    );
}

/// Prints the camera with its lens.
pub(super) fn print_camera(session: &Session) {
    let camera = &session.camera_description().parameters;
    errln!(
        "camera: at {} towards {}, vertical field of view {} degrees, lens radius {}, in focus at a distance of {}",
        printing::list(&camera.position.to_array()),
        printing::list(&camera.look_at.to_array()),
        printing::number(camera.vertical_fov.into()),
        printing::number(camera.lens_radius.into()),
        printing::number(camera.focus_distance.into())
    );
}

/// Prints scene, speed and files of the render, with more details if `--verbose` is set.
pub(super) fn print(job: &Job, images: &Images, stats: &Stats, stop: Stop) {
    let names: Vec<String> = images.iter().map(|(_, o)| o.path().display().to_string()).collect();
    // A render that took all samples has a warning instead.
    let shortfall = stats.noise.filter(|_| !stop.is_complete());
    let shortfall = shortfall.and_then(|noise| noise.shortfall(stats.render_s));
    errln!(
        "{}: {}x{}, {} of {} per pixel in {:.2} s ({:.2} million samples/s, {} {}), {}{}{}{}{} -> {}",
        job.scene_path.display(),
        stats.width,
        stats.height,
        printing::number((100.0 * stats.samples as f64 / job.settings.crop().area() as f64).round() / 100.0),
        printing::count(stats.spp.into(), "sample"),
        stats.render_s,
        stats.samples as f64 / stats.render_s.max(1e-9) / 1e6,
        stats.backend,
        stats.backend_version,
        times(stats),
        stats.error.map_or(String::new(), |error| format!(
            ", relative error {}{}",
            printing::percent(error),
            if stats.denoise.is_some() {
                " before denoising"
            } else {
                ""
            }
        )),
        stop.words(),
        shortfall.map_or(String::new(), |words| format!(" ({words})")),
        match (job.settings.tone.exposure, stats.exposure) {
            (named @ (Exposure::Auto | Exposure::Studio), Some(stops)) => {
                let brighter = ((100.0 * stops).round() / 100.0 + 1.0).min(MAX_EXPOSURE);
                format!(", exposure {stops:+} ({named}; --exposure {brighter:+.2} is brighter)")
            }
            _ => String::new(),
        },
        if names.is_empty() {
            "no image".into()
        } else {
            names.join(", ")
        },
    );
    if job.verbose {
        errln!(
            "  {}, {}; load {:.3} s, guess {:.3} s, build {:.3} s, write {:.3} s, in all {:.3} s",
            printing::count(stats.triangles, "triangle"),
            printing::count(stats.lights as u64, "light"),
            stats.load_s,
            stats.guess_s,
            stats.build_s,
            stats.write_s,
            stats.total_s
        );
        errln!(
            "  rays: {} camera, {} bounce, {} shadow; {}, {}",
            stats.rays.camera,
            stats.rays.bounce,
            stats.rays.shadow,
            printing::count(stats.threads as u64, "thread"),
            stats.isa
        );
        if let Some(chains) = &stats.chains {
            errln!(
                "  chains: {} of {:.0} mutations, autocorrelation time {:.1} mutations, {:.1} % stuck in a pixel",
                chains.count,
                chains.mutations,
                chains.autocorrelation_time,
                100.0 * chains.stuck
            );
        }
        errln!(
            "  memory: scene {:.1} MB, acceleration structure {:.1} MB, peak {:.1} MB; scene hash {}",
            stats.scene_bytes as f64 / 1e6,
            stats.bvh_bytes as f64 / 1e6,
            stats.peak_rss_bytes.unwrap_or(0) as f64 / 1e6,
            stats.scene_hash,
        );
    }
}

/// Total time in seconds, and the time of each step; the steps add up to the total. Earlier runs of
/// a resumed render are not included.
fn times(stats: &Stats) -> String {
    let denoise = stats.denoise.as_ref().map_or(0.0, |denoised| denoised.seconds);
    let known = [stats.load_s, stats.guess_s, stats.build_s, denoise, stats.write_s].map(hundredths);
    let [load, guess, build, denoise, write] = known;
    let render = hundredths(stats.total_s).saturating_sub(known.iter().sum());
    let steps = [
        ("load", load),
        ("guess", guess),
        ("build", build),
        ("render", render),
        ("denoise", denoise),
        ("write", write),
    ];
    let seconds = |hundredths: u64| format!("{}.{:02}", hundredths / 100, hundredths % 100);
    let all = steps.iter().map(|(_, time)| time).sum();
    let steps = steps.iter().filter(|(_, time)| *time > 0);
    let steps: Vec<String> = steps.map(|&(step, time)| format!("{step} {}", seconds(time))).collect();
    format!("{} s in all: {}", seconds(all), steps.join(" + "))
}

/// Hundredths of a second, rounded.
fn hundredths(seconds: f64) -> u64 {
    (100.0 * seconds).round().max(0.0) as u64
}
