//! The numbers of a comparison as CSV and Markdown.

use super::Comparison;
use super::curves::Measure;
use super::runs::Snapshot;
use crate::cli::printing::measured;
use std::fmt::Write;

/// Header of both CSV files.
const HEAD: &str = "estimator,samples,seconds,relmse,efficiency,block_relmse\n";

impl Comparison {
    /// CSV with a row for each estimator and budget.
    pub fn csv(&self) -> String {
        let mut text = String::from(HEAD);
        for (contender, run) in self.rendered() {
            let budgets = 0..self.budgets.len();
            let rows = budgets.filter_map(|index| run.at(index));
            rows.for_each(|snapshot| write_csv(&mut text, &contender.name, snapshot));
        }
        text
    }

    /// CSV with a row for each point of the curves.
    pub fn curves_csv(&self) -> String {
        let mut text = String::from(HEAD);
        for (contender, run) in self.rendered() {
            let rows = run.snapshots.iter();
            rows.for_each(|snapshot| write_csv(&mut text, &contender.name, snapshot));
        }
        text
    }

    /// [`Comparison::table`], and the faults of the reference.
    pub fn markdown(&self) -> String {
        let faults = self.verdict.faults.iter();
        let faults = faults.map(|fault| format!("\n**Warning.** {}\n", fault.advice()));
        self.table() + &faults.collect::<String>()
    }

    /// Markdown with the table of results, and a list of the slopes of the curves.
    pub fn table(&self) -> String {
        let mut text = String::from(
            "| estimator | samples | seconds | relMSE | relMSE of blocks | efficiency |\n|---|---|---|---|---|---|\n",
        );
        for (contender, run) in &self.runs {
            if let Some(why) = contender.refusal() {
                let _ = writeln!(text, "| {} | not rendered: {why} | | | | |", contender.name);
            }
            for snapshot in (0..self.budgets.len()).filter_map(|index| run.at(index)) {
                let _ = writeln!(
                    text,
                    "| {} | {} | {:.2} | {} | {} | {} |",
                    contender.name,
                    snapshot.samples,
                    snapshot.seconds,
                    snapshot.rel_mse.map_or(String::new(), measured),
                    snapshot.block_rel_mse.map_or(String::new(), measured),
                    snapshot.efficiency().map_or(String::new(), measured)
                );
            }
        }
        let mut slopes = String::new();
        for (contender, run) in self.rendered() {
            if let Some(words) = Measure::in_words(&run.snapshots) {
                let _ = writeln!(slopes, "- {}: {words}", contender.name);
            }
        }
        if slopes.is_empty() {
            text
        } else {
            format!("{text}\n{slopes}")
        }
    }
}

fn write_csv(text: &mut String, name: &str, snapshot: &Snapshot) {
    let _ = writeln!(
        text,
        "\"{}\",{},{:.4},{},{},{}",
        name.replace('"', "\"\""),
        snapshot.samples,
        snapshot.seconds,
        snapshot.rel_mse.map_or(String::new(), |error| format!("{error:.6e}")),
        snapshot.efficiency().map_or(String::new(), |e| format!("{e:.6e}")),
        snapshot
            .block_rel_mse
            .map_or(String::new(), |error| format!("{error:.6e}"))
    );
}
