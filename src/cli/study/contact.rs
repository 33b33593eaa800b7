//! What the dial of contact is worth.

use super::{failure, own_setting};
use crate::cli::{Failure, folder};
use crate::study::Subject;
use crate::study::contact::{ROUNDS, contact, table};
use std::path::Path;

pub(super) fn run(subject: &Subject<'_>, out: &Path) -> Result<String, Failure> {
    let setting = own_setting(subject)?;
    let study = contact(subject, setting, ROUNDS, &mut |said| {
        eprintln!("{said}");
    });
    let study = study.map_err(failure)?;
    if subject.is_stopped() {
        eprintln!("stopped: {} settings are kept", study.rows.len());
    }
    let text = table::markdown(subject, &study);
    folder::write(out, "contact.csv", &table::csv(subject, &study))?;
    folder::write(out, "contact.md", &text)?;
    Ok(format!(
        "{text}\n{}: contact.csv and contact.md\n",
        out.display()
    ))
}
