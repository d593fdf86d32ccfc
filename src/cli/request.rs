//! Render requests of other programs, such as the Python module (`python/`). Settings have the
//! names of the flags of `embrasure render`. Defaults, guesses and errors are the same as on the
//! command line.

use super::args::{Args, Command, RenderArgs};
use super::error::CliError;
use super::job::{Job, SceneKind, kind_of, set_load};
use crate::io::{ExrFormat, FileError, Warning};
use crate::scene_file::SceneFile;
use crate::session::{Error, Settings};
use std::path::Path;

/// Flags that are valid only on the command line. The library has functions for the same purposes.
const OF_COMMAND: [&str; 18] = [
    "audit-rays",
    "checkpoint",
    "checkpoint-interval",
    "dump-scene",
    "help",
    "json",
    "output",
    "pixel",
    "quiet",
    "resume",
    "sample",
    "stats",
    "tev",
    "verbose",
    "version",
    "warnings",
    "write-cameras",
    "write-every",
];

/// A render described by flags. Flags override the scene file, and the scene file overrides the
/// defaults.
#[derive(Clone, Debug)]
pub struct Request {
    /// The scene with the changes of the flags.
    pub scene: SceneFile,
    /// Settings of the session that renders the scene.
    pub settings: Settings,
    /// Format of EXR files.
    pub exr: ExrFormat,
    /// Maximum render time in seconds.
    pub time_limit: Option<f64>,
    /// Warnings about the flags.
    pub warnings: Vec<Warning>,
}

impl Request {
    /// Reads a `.toml` scene file, or the scene of an `.obj` file, with keys set as in
    /// [`SceneFile::load_with`].
    ///
    /// # Errors
    ///
    /// The file name does not end in `.toml` or `.obj`, or the file cannot be read.
    pub fn scene_file(path: &Path, set: &[String]) -> Result<SceneFile, FileError> {
        match kind_of(path)? {
            SceneKind::Toml => SceneFile::load_with(path, set),
            SceneKind::Obj => SceneFile::of_obj_with(path, set),
        }
    }

    /// The render of `scene` with `flags`, each `--NAME` or `--NAME=VALUE`.
    ///
    /// # Errors
    ///
    /// Unknown flags, flags that cannot be combined, and invalid values.
    pub fn new(scene: &SceneFile, flags: &[String]) -> Result<Self, Error> {
        let args = parse(scene, flags)?;
        Self::of_args(&args, scene.clone()).map_err(Error::from)
    }

    fn of_args(args: &RenderArgs, mut scene: SceneFile) -> Result<Self, CliError> {
        scene.patch_materials(&args.load.patches)?;
        scene.patch_parts(&args.load.parts)?;
        set_load(&mut scene, &args.load);
        scene.cut(&args.load.cut)?;
        let exr = args.exr.format()?;
        let job = Job::to_show_scene(args, scene)?;
        Ok(Self {
            scene: job.scene,
            settings: job.settings,
            exr,
            time_limit: job.time_limit,
            warnings: job.warnings,
        })
    }
}

fn parse(scene: &SceneFile, flags: &[String]) -> Result<RenderArgs, Error> {
    for flag in flags {
        let name = flag.trim_start_matches('-').split('=').next().unwrap_or_default();
        if OF_COMMAND.contains(&name) || name == "set" || !flag.starts_with("--") {
            return Err(Error::Refused(format!(
                "{flag}: not a setting of a render\n  help: leave it out; only the command line has this flag"
            )));
        }
    }
    let name = scene.path().unwrap_or(Path::new("scene.obj")).as_os_str();
    let words = ["embrasure", "render"].map(Into::into).into_iter();
    let words = words.chain(flags.iter().map(Into::into));
    let args = Args::of(words.chain(["--".into(), name.to_owned()]));
    let refused = |error: clap::Error| {
        let text = error.to_string();
        Error::Refused(text.strip_prefix("error: ").unwrap_or(&text).trim_end().to_string())
    };
    match args.map_err(refused)?.command {
        Some(Command::Render(args)) => Ok(*args),
        _ => Err(Error::Failed("the flags name no render".into())),
    }
}

impl From<CliError> for Error {
    fn from(error: CliError) -> Self {
        match error {
            CliError::Usage(words) => Self::Refused(words),
            CliError::File(error) => Self::File(error),
            CliError::Interrupted(words) | CliError::Failed(words) => Self::Failed(words),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(flags: &[&str]) -> Result<Request, Error> {
        let flags: Vec<String> = flags.iter().map(ToString::to_string).collect();
        Request::new(&SceneFile::of_obj(Path::new("a.obj")), &flags)
    }

    #[test]
    fn flags_are_those_of_render() {
        let request = request(&["--spp=7", "--position=-1,2,3", "--max-depth=3", "--time-limit=2"]).unwrap();
        assert_eq!(request.settings.spp, 7);
        assert_eq!(request.settings.camera.position, Some([-1.0, 2.0, 3.0].into()));
        assert_eq!(request.time_limit, Some(2.0));
        // A bare OBJ gets the same guesses as on the command line.
        assert!(request.settings.guesses.light);
    }

    #[test]
    fn flag_that_is_not_of_render_is_an_error() {
        for (flag, word) in [
            ("--output=a.exr", "only the command line"),
            ("b.obj", "only the command line"),
            ("--spp=none", "--spp"),
            ("--max-dept=3", "--max-depth"),
        ] {
            let error = request(&[flag]).err().unwrap().to_string();
            assert!(error.contains(word) && !error.starts_with("error"), "{flag}: {error}");
        }
    }

    #[test]
    fn scenes_in_code_take_keys() {
        let set = ["render.spp=3".to_string(), "light.0={type=\"point\"}".to_string()];
        let scene = SceneFile::in_code(&set).unwrap();
        assert!(scene.is_file() && scene.is_made());
        assert_eq!(scene.light.len(), 1);
        assert_eq!(Request::new(&scene, &[]).unwrap().settings.spp, 3);
        let scene = scene.with_keys(&["render.spp=4".to_string()]).unwrap();
        assert_eq!(Request::new(&scene, &[]).unwrap().settings.spp, 4);
        let error = scene.with_keys(&["render.sppp=4".to_string()]).unwrap_err();
        assert!(error.to_string().contains("sppp"), "{error}");
    }
}
