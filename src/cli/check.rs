//! `embrasure check`: errors in a scene's files, assumptions, and the cost of a render.

use super::args::{RenderArgs, SceneArgs};
use super::error::CliError;
use super::job::{Job, SceneKind, kind_of, set_load};
use super::printing;
use crate::io::{DEFAULT_LIGHT, FileError, Finding, MAX_PLACES, Position, Severity};
use crate::lint;
use crate::options::CameraOptions;
use crate::scene::{Scene, SceneBuilder};
use crate::scene_file::{Inspection, SceneFile, SceneOptions, inspect_scene};
use crate::session::{CameraSettings, FoundCamera, Memory, all_threads, inspect_camera, thread_pool};
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;
use std::process::ExitCode;

/// Prints the findings about a scene. If `is_verbose` is true, also prints what a render needs
/// memory for. The exit code is 1 if there is an error.
pub(super) fn check(args: &SceneArgs, is_verbose: bool) -> Result<ExitCode, CliError> {
    let mut report = CheckReport::default();
    if let Some(file) = report.open(args)? {
        report.check_scene(args, file)?;
    }
    report.sort();
    report.gather();
    if args.json {
        outln!("{:#}", report.json(args));
    } else {
        report.print(args, is_verbose);
    }
    Ok(ExitCode::from(u8::from(report.count(Severity::Error) > 0)))
}

/// Maximum number of findings of one kind in a file that are listed one by one.
const MAX_ALIKE: usize = 12;

/// Report of `embrasure check`.
#[derive(Default)]
struct CheckReport {
    findings: Vec<Finding>,
    meshes: usize,
    triangles: u64,
    instances: usize,
    placed_triangles: u64,
    materials: usize,
    /// Power of the lights in watts, by type of light.
    power: BTreeMap<&'static str, f64>,
    memory: Option<Memory>,
}

impl CheckReport {
    /// Reads the scene file, and adds its errors to the report. Returns the readable part; `None`
    /// if no part is readable. Invalid flags are an error.
    fn open(&mut self, args: &SceneArgs) -> Result<Option<SceneFile>, CliError> {
        let file = match kind_of(&args.scene) {
            Err(error) => {
                self.add(Severity::Error, "unreadable-file", error);
                None
            }
            Ok(kind) => {
                let (file, errors) = match kind {
                    SceneKind::Toml => SceneFile::inspect(&args.scene, &args.load.set),
                    SceneKind::Obj => match SceneFile::of_obj_with(&args.scene, &args.load.set) {
                        Ok(file) => (Some(file), Vec::new()),
                        Err(error) => (None, vec![error]),
                    },
                };
                for error in errors {
                    self.add(Severity::Error, "scene-file", error);
                }
                file
            }
        };
        let Some(mut file) = file else { return Ok(None) };
        file.patch_materials(&args.load.patches)?;
        file.patch_parts(&args.load.parts)?;
        set_load(&mut file, &args.load);
        let camera = CameraSettings::of(&file);
        file.change_light(args.light.changes(), &camera.viewpoint());
        Ok(Some(file))
    }

    fn check_scene(&mut self, args: &SceneArgs, file: SceneFile) -> Result<(), CliError> {
        let pool = thread_pool(all_threads())?;
        let (inspection, linted) = pool.install(|| {
            let inspection = inspect_scene(&file, SceneBuilder::new());
            let linted = lint::inspect(&inspection, file.eye(), &|message| file.whole(message));
            (inspection, linted)
        });
        let Inspection { scene, findings, .. } = inspection;
        // If there are warnings about single faces, leave out the warning that only counts these
        // faces.
        let names = |codes: &[&str]| linted.iter().any(|f| codes.contains(&f.code));
        let names_degenerate = names(&["degenerate-face", "repeated-vertex"]);
        let names_repeated = names(&["duplicate-face", "two-sided"]);
        let names_sides = names(&["two-sided"]);
        let is_reported = |f: &Finding| match f.code {
            "degenerate-triangles" => !names_degenerate,
            "repeated-triangles" => !names_repeated,
            "two-sided" => !names_sides,
            _ => true,
        };
        // For a bare OBJ, `render` adds its own light instead of the default light.
        let is_bare = matches!(kind_of(&args.scene), Ok(SceneKind::Obj));
        let reworded = |mut f: Finding| {
            if is_bare && f.code == DEFAULT_LIGHT {
                f.error = file.whole("nothing in the scene emits light; `embrasure render` adds a studio, daylight through openings, or a lamp");
            }
            f
        };
        self.findings
            .extend(findings.into_iter().filter(is_reported).map(reworded));
        self.findings.extend(linted);

        let args = RenderArgs {
            scene: args.scene.clone(),
            ..RenderArgs::default()
        };
        let whole = file.whole("");
        self.note_defaults(&file);
        let job = match Job::to_show_scene(&args, file) {
            Ok(job) => job,
            Err(error) => {
                self.refused("wrong-setting", &whole, error);
                return Ok(());
            }
        };
        let Some(scene) = scene else { return Ok(()) };
        let job = match job.settings.clone().drawn(&job.scene, &scene, &pool) {
            Ok(settings) => Job { settings, ..job },
            Err(error) => {
                self.refused("wrong-camera", &whole, error.into());
                return Ok(());
            }
        };
        self.measure(&job, &scene);
        match job.settings.chosen_integrator().check_lights(&scene) {
            Ok(Some(warning)) => self.add(Severity::Warning, "unmet-light", job.scene.whole(warning)),
            Ok(None) => {}
            Err(error) => self.refused("unmet-light", &whole, error.into()),
        }
        match job.settings.camera_of(&job.scene, &scene, &pool) {
            Err(error) => self.refused("wrong-camera", &whole, error.into()),
            Ok(_) if scene.triangle_count() == 0 => {}
            Ok(FoundCamera { camera, .. }) => {
                let accel = job.settings.backend.build(&scene, &pool)?;
                let (accel, resolution) = (accel.as_dyn(), job.settings.resolution);
                self.findings.extend(inspect_camera(
                    &job.settings.camera,
                    (&scene, accel),
                    (&camera, resolution),
                    &|message| job.scene.whole(message),
                ));
                self.findings
                    .extend(lint::inspect_lamps(accel, &scene, &|message| job.scene.whole(message)));
            }
        }
        Ok(())
    }

    fn measure(&mut self, job: &Job, scene: &Scene) {
        self.meshes = scene.meshes().len();
        self.triangles = scene.triangle_count();
        self.instances = scene.instances().len();
        self.placed_triangles = scene.placed_triangle_count();
        self.materials = scene.materials().len();
        let radius = scene.bounds().radius();
        for light in scene.lights() {
            *self.power.entry(light.kind()).or_default() += light.power(radius);
        }
        self.memory = Some(Memory::new(scene, &job.settings));
    }

    /// Adds a note for each group of settings that the scene file does not have. Defaults are used
    /// for these settings.
    fn note_defaults(&mut self, file: &SceneFile) {
        if file.options.camera == CameraOptions::default() {
            let message = "no camera: it is guessed (`embrasure info` prints it, `embrasure views` shows others)";
            self.add(Severity::Note, "default-camera", file.whole(message));
        }
        let SceneOptions {
            size,
            sampling,
            quality,
            integrator,
            ..
        } = &file.options;
        let defaults = [
            (size.width.is_none(), "width 512"),
            (size.height.is_none(), "height 512"),
            (
                sampling.samples.is_none() && quality.quality.is_none(),
                if file.is_file() {
                    "64 samples per pixel"
                } else {
                    "quality good"
                },
            ),
            (integrator.integrator.is_none(), "integrator path"),
            (sampling.sampler.is_none(), "sampler zsobol"),
            (integrator.max_depth.is_none(), "at most 16 scattering events"),
        ];
        let taken: Vec<&str> = defaults.iter().filter(|(is, _)| *is).map(|(_, words)| *words).collect();
        if !taken.is_empty() {
            let message = format!("not given, so defaults apply: {}", taken.join(", "));
            self.add(Severity::Note, "default-setting", file.whole(message));
        }
    }

    fn add(&mut self, severity: Severity, code: &'static str, error: FileError) {
        self.findings.push(Finding::new(severity, code, error));
    }

    /// Adds the reason why a render would fail.
    fn refused(&mut self, code: &'static str, whole: &FileError, error: CliError) {
        let error = match error {
            CliError::File(error) => error,
            error => FileError {
                message: error.to_string(),
                ..whole.clone()
            },
        };
        self.add(Severity::Error, code, error);
    }

    /// Sorts the findings by file, line and column.
    fn sort(&mut self) {
        let place = |p: Option<Position>| p.map(|p| (p.line, p.column.unwrap_or(usize::MAX)));
        let key = |f: &Finding| (f.error.file.clone(), place(f.error.position));
        self.findings.sort_by_cached_key(key);
    }

    /// Replaces the findings of one kind in a file by a single finding, if there are more than
    /// [`MAX_ALIKE`].
    fn gather(&mut self) {
        type Kind = (PathBuf, &'static str);
        let kind = |f: &Finding| -> Kind { (f.error.file.clone(), f.code) };
        let mut counts: HashMap<Kind, usize> = HashMap::new();
        for finding in &self.findings {
            *counts.entry(kind(finding)).or_default() += 1;
        }
        let mut first: HashMap<Kind, usize> = HashMap::new();
        let mut gathered: Vec<Finding> = Vec::new();
        for mut finding in std::mem::take(&mut self.findings) {
            let kind = kind(&finding);
            let count = counts.get(&kind).copied().unwrap_or(0);
            // The reader of the file already limits the number of wrong statements.
            if count <= MAX_ALIKE || finding.code == "wrong-statement" {
                gathered.push(finding);
            } else if let Some(known) = first.get(&kind).and_then(|&i| gathered.get_mut(i)) {
                known.count += finding.count;
                let free = MAX_PLACES.saturating_sub(known.more.len());
                known.more.extend(finding.error.position.into_iter().take(free));
            } else {
                finding.error.message += &format!(" (and {} more findings of this kind)", count - 1);
                first.insert(kind, gathered.len());
                gathered.push(finding);
            }
        }
        self.findings = gathered;
    }

    fn count(&self, severity: Severity) -> usize {
        self.findings.iter().filter(|f| f.severity == severity).count()
    }

    fn print(&self, args: &SceneArgs, is_verbose: bool) {
        self.findings.iter().for_each(|finding| outln!("{finding}"));
        let counts = [Severity::Error, Severity::Warning, Severity::Note].map(|severity| {
            let count = self.count(severity);
            printing::count(count as u64, severity.name())
        });
        outln!("{}: {}", args.scene.display(), counts.join(", "));
        let Some(memory) = &self.memory else { return };
        let placed = match self.instances {
            0 => String::new(),
            n => format!(
                " ({} with {})",
                self.placed_triangles,
                printing::count(n as u64, "instance")
            ),
        };
        outln!(
            "  {}{placed} in {}, {}",
            printing::count(self.triangles, "triangle"),
            match self.meshes {
                1 => "1 mesh".into(),
                n => format!("{n} meshes"),
            },
            printing::count(self.materials as u64, "material")
        );
        outln!("  light: {}", self.light_words(args));
        let peak = memory.peak() as f64 / 1e6;
        let more = if is_verbose { "" } else { "; -v lists its parts" };
        outln!("  memory: about {peak:.0} MB at the peak of a render{more}");
        if is_verbose {
            let parts: Vec<String> = parts(memory)
                .iter()
                .map(|(name, bytes)| format!("{} {:.1}", name.replace('_', " "), *bytes as f64 / 1e6))
                .collect();
            outln!("    MB: {}", parts.join(", "));
        }
    }

    /// Text that lists the lights of the files with their power, or names the light that the
    /// program adds.
    fn light_words(&self, args: &SceneArgs) -> String {
        if self.findings.iter().any(|finding| finding.code == DEFAULT_LIGHT) {
            let added = match kind_of(&args.scene) {
                Ok(SceneKind::Obj) => "`embrasure render` adds light",
                _ => "white light of radiance 1 from everywhere is used",
            };
            return format!("none in the file; {added}");
        }
        let kinds: Vec<String> = self
            .power
            .iter()
            .map(|(kind, watts)| format!("{kind} {watts:.4}"))
            .collect();
        let total: f64 = self.power.values().sum();
        format!("{total:.4} W ({})", kinds.join(", "))
    }

    fn json(&self, args: &SceneArgs) -> Value {
        let mut power: serde_json::Map<String, Value> = self
            .power
            .iter()
            .map(|(kind, watts)| (kind.to_string(), json!(watts)))
            .collect();
        power.insert("total".into(), json!(self.power.values().sum::<f64>()));
        let memory = self.memory.as_ref().map(|memory| {
            let mut all: serde_json::Map<String, Value> = parts(memory)
                .iter()
                .map(|(name, bytes)| (name.to_string(), json!(bytes)))
                .collect();
            all.insert("peak".into(), json!(memory.peak()));
            all
        });
        json!({
            "scene": args.scene.display().to_string(),
            "findings": self.findings.iter().map(finding_json).collect::<Vec<_>>(),
            "summary": {
                "errors": self.count(Severity::Error),
                "warnings": self.count(Severity::Warning),
                "notes": self.count(Severity::Note),
            },
            "meshes": self.meshes,
            "triangles": self.triangles,
            "instances": self.instances,
            "placed_triangles": self.placed_triangles,
            "materials": self.materials,
            "light_power_w": power,
            "memory": memory,
        })
    }
}

/// Bytes of each part of a render's memory.
fn parts(memory: &Memory) -> [(&'static str, u64); 5] {
    [
        ("scene", memory.scene),
        ("acceleration", memory.acceleration),
        ("light", memory.light),
        ("film", memory.film),
        ("picture", memory.picture),
    ]
}

fn finding_json(finding: &Finding) -> Value {
    let error = &finding.error;
    let place = |p: &Position| json!({ "line": p.line, "column": p.column });
    json!({
        "severity": finding.severity.name(),
        "code": finding.code,
        "file": error.file.display().to_string(),
        "line": error.position.map(|p| p.line),
        "column": error.position.and_then(|p| p.column),
        "message": error.message,
        "help": error.help,
        "count": finding.count,
        "places": error.position.iter().chain(&finding.more).map(place).collect::<Vec<_>>(),
    })
}
