//! `muslin export`: the state of a recording as a table.

use super::Failure;
use super::args::ExportArgs;
use super::output::same_file;
use crate::export::write_csv;
use crate::replay::{At, read_checkpoint};
use anyhow::{Context as _, anyhow};
use std::io::{BufWriter, Write as _};

pub(super) fn run(args: &ExportArgs) -> Result<(), Failure> {
    let at = match args.at.as_str() {
        "last" => At::Last,
        time => At::Time(time.parse().map_err(|fault| {
            Failure::Input(anyhow!("--at {time}: {fault}; write `last` or seconds"))
        })?),
    };
    if matches!(at, At::Time(time) if !time.is_finite()) {
        return Err(Failure::Input(anyhow!(
            "--at {}: write `last` or seconds",
            args.at
        )));
    }
    if same_file(&args.csv, &args.recording) {
        return Err(Failure::Input(anyhow!(
            "--csv {}: that is the recording; choose another",
            args.csv.display()
        )));
    }
    let checkpoint = read_checkpoint(&args.recording, at).map_err(Failure::input)?;
    let path = args.csv.display();
    let unwritable = || format!("{path} can't be written; choose another with --csv");
    let file = std::fs::File::create(&args.csv)
        .with_context(unwritable)
        .map_err(Failure::Input)?;
    let mut out = BufWriter::new(file);
    write_csv(&checkpoint, &mut out)
        .and_then(|()| out.flush())
        .with_context(unwritable)
        .map_err(Failure::Run)?;
    let rows: usize = checkpoint
        .cloths
        .iter()
        .map(|cloth| cloth.particles.len())
        .sum();
    println!("{path}: {rows} particles at t = {} s", checkpoint.time);
    Ok(())
}
