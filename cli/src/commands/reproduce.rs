//! `reproduce`: the paper's tables and figures, with this project's improvements beside them.
use crate::{
    commands::progress,
    outputs::{Outputs, to_file_or_stdout},
    reproduce::{self, Section, archetype, bearing_only, corridor, failover, table2},
};
use clap::{Args, ValueEnum};
use monorange_formats::Result;
use std::path::PathBuf;

/// The paper's tables and figures, computed again, with this project's improvements beside them.
///
/// Writes one page, `reproduce.html`, and every table as CSV. `all` takes a few minutes; nothing is read but the
/// seeds, and the same seeds give the same figures.
#[derive(Args, Debug)]
#[command(after_help = "\
Example:
  monorange reproduce table2 --out paper")]
pub struct Arguments {
    /// What to reproduce.
    #[arg(value_enum, default_value_t)]
    what: Experiment,
    /// Simulated drives behind figures 6 and 7.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = "monorange-reproduce")]
    out: PathBuf,
    /// Print the tables as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Experiment {
    /// Everything.
    #[default]
    All,
    /// Five points measured by hand.
    Table2,
    /// The map of a corridor over the laser's.
    Figure6,
    /// Pose errors within three standard deviations.
    Figure7,
    /// The camera in place of a laser that fails.
    Failover,
    /// Landmarks by their bearing, with and without the floor's range.
    BearingOnly,
    /// Which distribution the range error has.
    Archetype,
}

/// Runs the command.
///
/// # Errors
/// When the folder cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let wants = |experiment| arguments.what == experiment || arguments.what == Experiment::All;
    let mut sections: Vec<Section> = Vec::new();
    let spinner = progress::bar(0, "experiments");
    if wants(Experiment::Table2) {
        spinner.set_message("table 2");
        sections.push(table2::section()?);
    }
    if wants(Experiment::Figure6) || wants(Experiment::Figure7) {
        let bar = progress::bar(arguments.seeds as usize, "drives");
        let drives = corridor::drives(arguments.seeds, || bar.inc(1))?;
        bar.finish_and_clear();
        if wants(Experiment::Figure6) {
            sections.push(corridor::figure6(&drives)?);
        }
        if wants(Experiment::Figure7) {
            sections.push(corridor::figure7(&drives)?);
        }
    }
    if wants(Experiment::Failover) {
        spinner.set_message("failover");
        sections.push(failover::section()?);
    }
    if wants(Experiment::BearingOnly) {
        spinner.set_message("bearing only");
        sections.push(bearing_only::section()?);
    }
    if wants(Experiment::Archetype) {
        spinner.set_message("archetype");
        sections.push(archetype::section()?);
    }
    spinner.finish_and_clear();
    let tables = sections.iter().flat_map(|section| {
        section
            .tables
            .iter()
            .enumerate()
            .map(|(index, table)| (format!("{}-{}.csv", section.name, index + 1), table))
    });
    let tables: Vec<_> = tables.collect();
    let names: Vec<_> = tables.iter().map(|(name, _)| name.as_str()).chain(["reproduce.html"]).collect();
    let mut outputs = Outputs::of_a_run(&arguments.out, &names, "reproduce.html")?;
    let command = std::env::args().collect::<Vec<_>>().join(" ");
    outputs.write("reproduce.html", |out| out.write_all(reproduce::page(&sections, &command).as_bytes()))?;
    for (name, table) in &tables {
        outputs.write(name, |out| out.write_all(table.csv().as_bytes()))?;
    }
    outputs.commit()?;
    to_file_or_stdout(None, |to| {
        if arguments.json {
            let tables: serde_json::Map<_, _> = sections
                .iter()
                .map(|section| {
                    let tables = section.tables.iter().map(|table| {
                        serde_json::json!({ "caption": table.caption, "header": table.header, "rows": table.rows })
                    });
                    (section.name.to_owned(), tables.collect())
                })
                .collect();
            return writeln!(to, "{:#}", serde_json::Value::Object(tables));
        }
        sections.iter().try_for_each(|section| writeln!(to, "{section}"))?;
        writeln!(to, "{}", arguments.out.join("reproduce.html").display())
    })
}
