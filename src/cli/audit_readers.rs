//! The own reader of OBJ and MTL files checked against that of the tobj crate.

use super::args::AuditArgs;
use super::error::CliError;
use std::process::ExitCode;

/// Compares the readers on all files of the scene; the exit code is 1 where a difference is not explained.
#[cfg(feature = "tobj")]
pub(super) fn audit(args: &AuditArgs) -> Result<ExitCode, CliError> {
    compared::audit(args)
}

/// Says that the second reader is not there.
#[cfg(not(feature = "tobj"))]
pub(super) fn audit(_: &AuditArgs) -> Result<ExitCode, CliError> {
    Err(CliError::Usage(
        "--readers: this program was built without tobj\n  help: build it with the feature tobj".into(),
    ))
}

#[cfg(feature = "tobj")]
mod compared {
    use crate::cli::args::{AuditArgs, LoadArgs};
    use crate::cli::error::CliError;
    use crate::cli::job::read_scene;
    use crate::cli::outputs::Outputs;
    use crate::cli::words::count;
    use crate::io::{ComparedFile, Lines, ReaderDifference, compare_readers};
    use serde_json::{Value, json};
    use std::path::{Path, PathBuf};
    use std::process::ExitCode;

    pub fn audit(args: &AuditArgs) -> Result<ExitCode, CliError> {
        let scene = read_scene(&args.scene, &LoadArgs::default())?;
        let mut outputs = Outputs::default();
        let output = args.output.as_deref();
        let output = output.map(|path| outputs.prepare("-o", path)).transpose()?;
        let objs = scene.obj_files();
        outputs.spare([&*args.scene].into_iter().chain(objs.iter().map(PathBuf::as_path)))?;
        let threads = args.threads.unwrap_or_else(crate::session::all_threads);
        let pool = crate::session::thread_pool(threads)?;
        let mut all: Vec<ComparedFile> = Vec::new();
        for path in &objs {
            for file in pool.install(|| compare_readers(path, &scene.load))? {
                if all.iter().all(|known| known.path != file.path) {
                    all.push(file);
                }
            }
        }
        outputs.spare(all.iter().map(|file| file.path.as_path()))?;
        let unexplained: u64 = all.iter().map(|file| file.unexplained_count).sum();
        let report = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "scene": args.scene.display().to_string(),
            "readers": ["own", "tobj"],
            "files": all.iter().map(json_of).collect::<Vec<_>>(),
            "unexplained": unexplained,
        });
        let text = serde_json::to_string_pretty(&report).map_err(|e| CliError::Failed(e.to_string()))?;
        if let Some(output) = &output {
            output.write(|w| std::io::Write::write_all(w, text.as_bytes()))?;
        }
        if args.json {
            outln!("{text}");
        } else {
            for file in &all {
                out!("{}", text_of(file));
            }
            let differences = if unexplained == 1 { "difference" } else { "differences" };
            outln!(
                "{}: {unexplained} unexplained {differences}",
                count(all.len() as u64, "file")
            );
        }
        Ok(match unexplained {
            0 => ExitCode::SUCCESS,
            _ => ExitCode::FAILURE,
        })
    }

    fn json_of(file: &ComparedFile) -> Value {
        let explained = file.explained.0.iter().map(|(kind, lines)| {
            let value = json!({ "count": lines.count, "lines": lines.first, "meaning": kind.words() });
            (kind.code().to_string(), value)
        });
        let unexplained = file.unexplained.iter();
        let unexplained = unexplained.map(|found| json!({ "line": found.line, "message": found.message }));
        json!({
            "file": file.path.display().to_string(),
            "faces": file.faces,
            "triangles": file.triangles,
            "materials": file.materials,
            "refused_by_own": file.refused_by_own,
            "refused_by_tobj": file.refused_by_tobj,
            "explained": explained.collect::<serde_json::Map<_, _>>(),
            "unexplained": unexplained.collect::<Vec<_>>(),
            "unexplained_count": file.unexplained_count,
        })
    }

    /// A file for people: what was compared, then a line for each kind of difference.
    fn text_of(file: &ComparedFile) -> String {
        let name = file.path.display();
        let compared = match (is_library(&file.path), &file.refused_by_own, &file.refused_by_tobj) {
            (_, Some(_), Some(_)) => "both readers find it wrong".into(),
            (true, ..) => format!("materials compared: {}", file.materials),
            (false, ..) => format!("triangles compared: {}", file.triangles),
        };
        let mut text = format!("{name}: {compared}\n");
        if let Some(refusal) = &file.refused_by_own {
            text += &format!("  the own reader finds it wrong: {refusal}\n");
        }
        if let Some(refusal) = &file.refused_by_tobj {
            text += &format!("  tobj refuses it: {refusal}\n");
        }
        for (kind, lines) in &file.explained.0 {
            text += &explained(*kind, lines);
        }
        for found in &file.unexplained {
            let place = if found.line == 0 {
                name.to_string()
            } else {
                format!("{name}:{}", found.line)
            };
            text += &format!("  unexplained: {place}: {}\n", found.message);
        }
        let more = file.unexplained_count - file.unexplained.len() as u64;
        if more > 0 {
            text += &format!("  unexplained: {more} more\n");
        }
        text
    }

    fn explained(kind: ReaderDifference, lines: &Lines) -> String {
        let shown: Vec<String> = lines.first.iter().map(usize::to_string).collect();
        let rest = if lines.count > shown.len() as u64 { ", …" } else { "" };
        let word = if lines.count == 1 { "line" } else { "lines" };
        format!(
            "  explained: {}, {} ({word} {}{rest}): {}\n",
            kind.code(),
            count(lines.count, "time"),
            shown.join(", "),
            kind.words()
        )
    }

    fn is_library(path: &Path) -> bool {
        path.extension()
            .is_none_or(|extension| !extension.eq_ignore_ascii_case("obj"))
    }
}
