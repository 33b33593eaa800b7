//! An ablation as a CSV table, and what can be cited of one later.

use super::{Ablation, Finding, Part, Threshold};
use crate::study::Outcome;
use std::fmt::Write as _;

/// The columns of the table.
pub const HEADER: &str = "kind,part,verdict,rms_m,largest_m,end_rms_m,end_largest_m,seconds_per_second,time_share,outcome,flags,scene,setting,duration_s,times,threshold_m,threshold_by,time_noise,date,fingerprint";

/// The table: a row for the full model, one a part, and one for all that can go. Numbers round-trip,
/// and what is not known is empty. What all rows share stands in each of them.
pub fn csv(ablation: &Ablation, date: &str) -> String {
    let setting = &ablation.setting;
    let by = match ablation.threshold {
        Threshold::Asked(_) => "tolerance",
        Threshold::TimeStep(_) => "half the step",
    };
    let shared = format!(
        "{},{},{:?},{},{:?},{by},{:?},{date},{:016x}",
        quoted(&ablation.scene),
        quoted(&format!("{} at {}", setting.series(), setting.dial())),
        ablation.duration,
        ablation.times,
        ablation.threshold.length(),
        ablation.noise,
        ablation.fingerprint
    );
    let mut text = format!("{HEADER}\n");
    // Writing to a string can't fail.
    let _ = writeln!(
        text,
        "full,full model,,0.0,0.0,0.0,0.0,{:?},0.0,completed,,{shared}",
        ablation.seconds_per_second
    );
    let kinds = ablation.parts.iter().map(|finding| ("part", finding));
    let together = ablation.together.iter().map(|all| ("together", all));
    for (kind, finding) in kinds.chain(together) {
        let _ = writeln!(
            text,
            "{kind},{},{},{},{:?},{},{},{},{shared}",
            quoted(&finding.part.name),
            verdict(finding.can_go(ablation.threshold)),
            distances(finding),
            finding.seconds_per_second,
            finding
                .time_share(ablation.seconds_per_second)
                .map_or_else(String::new, |share| format!("{share:?}")),
            finding.outcome.name(),
            quoted(&flags(&finding.part)),
        );
    }
    text
}

fn distances(finding: &Finding) -> String {
    if finding.outcome != Outcome::Completed {
        return ",,,".to_owned();
    }
    let (change, end) = (finding.change, finding.end);
    let all = [change.rms, change.largest, end.rms, end.largest];
    all.map(|x| format!("{x:?}")).join(",")
}

fn verdict(can_go: bool) -> &'static str {
    if can_go { "can-go" } else { "needed" }
}

/// What takes a part out of a scene, as it is typed behind a command.
pub fn flags(part: &Part) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.=".contains(c);
    let flags = part.changes.iter().map(|change| {
        if change.chars().all(plain) {
            format!("--set {change}")
        } else {
            format!("--set '{change}'")
        }
    });
    flags.collect::<Vec<_>>().join(" ")
}

/// A text as CSV writes it, on one line.
pub(in crate::study) fn quoted(text: &str) -> String {
    let text = text.replace(['\n', '\r'], " ");
    if text.contains([',', '"']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text
    }
}

/// A row that is read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Cited {
    /// What was taken out.
    pub part: String,
    /// Whether it is all that can go, at once.
    pub together: bool,
    /// Whether the scene can do without it.
    pub can_go: bool,
    /// What that changes (m RMS); none where the run failed.
    pub rms: Option<f64>,
    /// Share of the time that it costs.
    pub time_share: Option<f64>,
    /// How the run without it ended.
    pub outcome: String,
    /// What takes it out.
    pub flags: String,
}

/// A table that is read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Citation {
    /// Of the scene that was measured.
    pub fingerprint: u64,
    /// When.
    pub date: String,
    /// By which scheme and step.
    pub setting: String,
    /// Over which time (s).
    pub duration: f64,
    /// Up to which change a part can go (m RMS).
    pub threshold: f64,
    /// The parts.
    pub rows: Vec<Cited>,
}

/// Reads a table back; none if it isn't one, or not a whole one.
pub fn read(text: &str) -> Option<Citation> {
    let mut lines = text.lines();
    if lines.next() != Some(HEADER) || !text.ends_with('\n') {
        return None;
    }
    let lines: Vec<Vec<String>> = lines.map(fields).collect::<Option<_>>()?;
    let columns: Vec<&str> = HEADER.split(',').collect();
    let at = |line: &[String], name: &str| -> Option<String> {
        let column = columns.iter().position(|column| *column == name)?;
        line.get(column).cloned()
    };
    let number = |line: &[String], name: &str| at(line, name)?.parse::<f64>().ok();
    let mut rows = Vec::new();
    for line in lines.iter().filter(|line| line[0] != "full") {
        rows.push(Cited {
            part: at(line, "part")?,
            together: at(line, "kind")? == "together",
            can_go: at(line, "verdict")? == "can-go",
            rms: number(line, "rms_m"),
            time_share: number(line, "time_share"),
            outcome: at(line, "outcome")?,
            flags: at(line, "flags")?,
        });
    }
    let first = lines.first()?;
    Some(Citation {
        fingerprint: u64::from_str_radix(&at(first, "fingerprint")?, 16).ok()?,
        date: at(first, "date")?,
        setting: at(first, "setting")?,
        duration: number(first, "duration_s")?,
        threshold: number(first, "threshold_m")?,
        rows,
    })
}

/// The fields of a line, if they are as many as the columns.
fn fields(line: &str) -> Option<Vec<String>> {
    let mut fields = vec![String::new()];
    let mut inside = false;
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        let field = fields.last_mut()?;
        match letter {
            '"' if inside && letters.peek() == Some(&'"') => {
                field.push('"');
                letters.next();
            }
            '"' => inside = !inside,
            ',' if !inside => fields.push(String::new()),
            other => field.push(other),
        }
    }
    (fields.len() == HEADER.split(',').count()).then_some(fields)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::integrator::Integrator;
    use crate::study::{Distance, Setting};

    pub(in crate::study::ablate) fn example() -> Ablation {
        let finding = |name: &str, change: &str, rms: f64, seconds: f64| Finding {
            part: Part {
                name: name.to_owned(),
                changes: vec![change.to_owned()],
            },
            change: Distance {
                rms,
                largest: 3.0 * rms,
            },
            end: Distance {
                rms: 0.5 * rms,
                largest: rms,
            },
            seconds_per_second: seconds,
            outcome: Outcome::Completed,
        };
        let mut fails = finding("drag on all motion", "cloth.a.damping.mass=0", 0.0, 0.1);
        fails.outcome = Outcome::Diverged("at step 3".to_owned());
        Ablation {
            scene: "two, \"quoted\"".to_owned(),
            fingerprint: 0x0123_4567_89ab_cdef,
            setting: Setting {
                integrator: Integrator::Verlet,
                dt: 0.004,
            },
            duration: 4.0,
            times: 10,
            seconds_per_second: 2.0,
            noise: 0.05,
            threshold: Threshold::TimeStep(0.01),
            parts: vec![
                finding(
                    "shear springs",
                    r#"cloth.a.springs=["structural", "bend"]"#,
                    0.200_01,
                    1.5,
                ),
                finding("strain limit", "strain_limit=", 0.0, 1.9),
                fails,
            ],
            together: None,
        }
    }

    #[test]
    fn a_table_is_read_back() {
        let text = csv(&example(), "2026-11-22");
        let read_back = read(&text).unwrap();
        assert_eq!(read_back.fingerprint, 0x0123_4567_89ab_cdef);
        assert_eq!(read_back.date, "2026-11-22");
        assert_eq!(read_back.setting, "verlet at 4 ms");
        assert_eq!((read_back.duration, read_back.threshold), (4.0, 0.01));
        let [shear, limit, drag] = read_back.rows.as_slice() else {
            panic!("{read_back:?}");
        };
        assert_eq!(
            shear.flags,
            r#"--set 'cloth.a.springs=["structural", "bend"]'"#
        );
        assert_eq!((shear.rms, shear.time_share), (Some(0.200_01), Some(0.25)));
        assert!(!shear.can_go && limit.can_go && !limit.together);
        assert_eq!(limit.flags, "--set strain_limit=");
        assert_eq!((drag.rms, drag.time_share), (None, None));
        assert!(!drag.can_go && drag.outcome == "diverged");
    }

    #[test]
    fn what_is_no_whole_table_is_not_read() {
        let text = csv(&example(), "2026-11-22");
        for broken in [
            "",
            "kind,part\n",
            &text[..text.len() - 30],
            &text[..text.len() - 2], // the hash of the last row is cut
            &text.replace("0123456789abcdef", "not a number"),
            &text.replace("part,strain limit,", "part,strain limit\n"),
        ] {
            assert_eq!(read(broken), None, "{broken}");
        }
    }
}
