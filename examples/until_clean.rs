//! Renders a scene file until its relative error is low enough, and prints the progress:
//!
//! ```text
//! cargo run --release --example until_clean -- scenes/cornell-box.toml 0.05 out/clean
//! ```

use embrasure::prelude::*;
use std::error::Error;
use std::sync::atomic::{AtomicBool, Ordering};

/// Stops the render after the first pass with a low enough error.
struct Watcher {
    level: f64,
    is_clean: AtomicBool,
}

impl Observer for Watcher {
    fn progress(&self, _samples: u64) {}

    fn passed(&self, film: &Film) {
        let Some(error) = film.relative_error() else { return };
        let spp = film.samples() / film.crop().area();
        println!("{spp:5} samples per pixel: relative error {error:.4}");
        self.is_clean.store(error <= self.level, Ordering::Relaxed);
    }

    fn should_stop(&self) -> bool {
        self.is_clean.load(Ordering::Relaxed)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [scene, level, stem] = args.as_slice() else {
        return Err(
            "three arguments are expected: a scene file, a relative error, and a file name without its extension"
                .into(),
        );
    };

    let level: f64 = level.parse()?;

    // Use the settings of the scene file; flags of the command line are fields of the settings.
    let file = SceneFile::load(scene)?;
    let mut settings = Settings::of(&file);
    settings.spp = 4096;
    let [exr, png] = ["exr", "png"].map(|extension| Output::prepare(format!("{stem}.{extension}")));
    let outputs = [
        (Format::Exr(ExrFormat::default()), exr?),
        (Format::Png(settings.tone), png?),
    ];

    let session = Session::load(&file, settings, &())?;
    session
        .warnings()
        .iter()
        .for_each(|warning| eprintln!("warning: {warning}"));
    let renderer = session.renderer()?;
    let mut state = renderer.start();
    let watcher = Watcher {
        level,
        is_clean: AtomicBool::new(false),
    };
    let outcome = renderer.render(&mut state, &watcher);
    if outcome == Outcome::Complete && !watcher.should_stop() {
        eprintln!("warning: all samples are taken, and the error is higher yet");
    }

    let metadata = renderer.metadata(&state, outcome == Outcome::Complete);
    match renderer
        .write(&state, &renderer.develop(&state), &outputs, &metadata)
        .into_iter()
        .next()
    {
        Some(failure) => Err(failure.into()),
        None => Ok(()),
    }
}
