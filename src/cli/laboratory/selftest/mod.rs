//! `embrasure selftest`: renders scenes with exactly known results, with each built-in backend.
//! This shows that an installed program works with the libraries, the processor and the file system
//! of the machine.
//!
//! `cases` has the cases with their results, `scenes` has the scenes of the cases.

mod cases;
mod scenes;

use crate::cli::args::SelftestArgs;
use crate::cli::error::CliError;
use crate::cli::printing;
use crate::options::Backend;
use crate::session::BUILD;
use cases::{CASES, Case, Measurement, Probe};
use serde_json::{Value, json};
use std::process::ExitCode;
use std::time::Instant;

/// A case that was run with a backend.
struct CaseResult {
    case: &'static Case,
    backend: Backend,
    measured: Result<Measurement, CliError>,
    seconds: f64,
}

impl CaseResult {
    fn passed(&self) -> bool {
        self.measured.as_ref().is_ok_and(Measurement::passed)
    }

    fn json(&self) -> Value {
        let mut facts = json!({
            "name": self.case.name,
            "about": self.case.about,
            "backend": self.backend.name(),
            "passed": self.passed(),
            "seconds": self.seconds,
        });
        match &self.measured {
            Ok(measured) => {
                facts["expected"] = json!(measured.expected);
                facts["measured"] = json!(measured.value);
                facts["tolerance"] = json!(measured.tolerance);
            }
            Err(error) => facts["error"] = json!(error.to_string()),
        }
        facts
    }

    fn print(&self) {
        let outcome = if self.passed() { "ok" } else { "FAILED" };
        let figures = match &self.measured {
            Ok(measured) => measured.to_string(),
            Err(error) => error.to_string(),
        };
        outln!("  {outcome:<6} {:<18} {figures}", self.case.name);
    }
}

/// Runs the cases, and reports their results.
pub(in crate::cli) fn selftest(args: &SelftestArgs) -> Result<ExitCode, CliError> {
    let usual = || {
        Backend::ALL
            .iter()
            .copied()
            .filter(|&backend| backend != Backend::Brute)
    };
    let backends: Vec<Backend> = match args.backend {
        Some(backend) => vec![backend],
        // Without another built-in backend, test brute force.
        None if usual().next().is_none() => Backend::ALL.to_vec(),
        None => usual().collect(),
    };
    let mut all = Vec::new();
    for backend in backends {
        if !args.json {
            outln!("{}", backend.name());
        }
        for case in CASES.iter().filter(|case| args.full || case.is_quick) {
            let start = Instant::now();
            let measured = (case.run)(&Probe { backend });
            let seconds = start.elapsed().as_secs_f64();
            let result = CaseResult {
                case,
                backend,
                measured,
                seconds,
            };
            if !args.json {
                result.print();
            }
            all.push(result);
        }
    }
    let passed = all.iter().filter(|result| result.passed()).count();
    let failed = all.len() - passed;
    if args.json {
        let report = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "build": BUILD,
            "cases": all.iter().map(CaseResult::json).collect::<Vec<_>>(),
            "passed": passed,
            "failed": failed,
        });
        outln!("{report:#}");
    } else {
        outln!("{} passed, {failed} failed", printing::count(passed as u64, "case"));
    }
    Ok(if failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_have_names_of_their_own() {
        for (i, case) in CASES.iter().enumerate() {
            assert!(CASES[..i].iter().all(|other| other.name != case.name), "{}", case.name);
        }
    }

    #[test]
    fn wrong_answers_fail() {
        let result = |measured| CaseResult {
            case: &CASES[0],
            backend: Backend::ALL[0],
            measured,
            seconds: 0.0,
        };
        assert!(result(Ok(Measurement::near(2.001, 2.0))).passed());
        for measured in [
            Ok(Measurement::near(2.02, 2.0)),
            Ok(Measurement::near(f64::NAN, 2.0)),
            Ok(Measurement::none(1)),
            Err(CliError::Failed("no device".into())),
        ] {
            let result = result(measured);
            assert!(!result.passed() && result.json()["passed"] == json!(false));
        }
    }
}
