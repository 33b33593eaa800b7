//! An ablation in words, for people.

use super::table::{Citation, flags};
use super::{Ablation, Finding, Threshold};
use crate::study::{Outcome, digits, when};

/// A report in Markdown.
pub fn markdown(ablation: &Ablation) -> String {
    let full = ablation.seconds_per_second;
    let mut lines = vec![format!("# Which parts {} needs\n", ablation.scene)];
    lines.push(format!(
        "Each part is taken out alone, and the run without it compared with the full model {}, both by {} at {}. {}\n",
        when(ablation.times, ablation.duration),
        ablation.setting.series(),
        ablation.setting.dial(),
        rule(ablation.threshold)
    ));
    lines.push("| part | moves the cloth by (mm RMS) | largest (mm) | at the end (mm RMS) | of the time | verdict | without it |\n|---|---|---|---|---|---|---|".to_owned());
    for finding in ablation.parts.iter().chain(&ablation.together) {
        lines.push(row(finding, ablation));
    }
    lines.push(format!("\n{}", conclusion(ablation)));
    lines.push(format!(
        "\nDistances are the largest of any compared time, rounded up, and come out the same in every run. Times are the least of their rounds: {} s for a simulated second of the full model, whose rounds differed by {}: smaller shares are noise, and where one is negative the run takes longer without the part.\n",
        digits(full),
        percent(ablation.noise)
    ));
    lines.join("\n")
}

/// When a part can go.
fn rule(threshold: Threshold) -> String {
    let length = millimetres(threshold.length());
    match threshold {
        Threshold::Asked(_) => {
            format!("A part can go where that moves the cloth by at most {length} RMS, as asked.")
        }
        Threshold::TimeStep(_) => format!(
            "A part can go where that moves the cloth by at most {length} RMS, which is what halving the step does: a smaller change is lost in the error of the step."
        ),
    }
}

fn row(finding: &Finding, ablation: &Ablation) -> String {
    let can_go = finding.can_go(ablation.threshold);
    let share = finding.time_share(ablation.seconds_per_second);
    let length = |x: f64| {
        if finding.outcome == Outcome::Completed {
            up(1000.0 * x)
        } else {
            "–".to_owned()
        }
    };
    let verdict = match &finding.outcome {
        Outcome::Completed if can_go => "can go".to_owned(),
        Outcome::Completed => "needed".to_owned(),
        Outcome::Diverged(why) => format!("needed: diverges without it, {why}"),
        Outcome::TooSlow | Outcome::Stopped => {
            format!("needed: {} without it", finding.outcome.name())
        }
    };
    format!(
        "| {} | {} | {} | {} | {} | {verdict} | `{}` |",
        finding.part.name,
        length(finding.change.rms),
        length(finding.change.largest),
        length(finding.end.rms),
        share.map_or_else(|| "–".to_owned(), percent),
        flags(&finding.part)
    )
}

/// What the scene doesn't need, alone and at once.
fn conclusion(ablation: &Ablation) -> String {
    let gone: Vec<&str> = ablation
        .unneeded()
        .map(|finding| finding.part.name.as_str())
        .collect();
    if gone.is_empty() {
        return "This scene needs every part.".to_owned();
    }
    let alone = format!("This scene doesn't need: {}.", gone.join("; "));
    let Some(all) = &ablation.together else {
        return alone;
    };
    let share = all.time_share(ablation.seconds_per_second);
    match (&all.outcome, share) {
        (Outcome::Completed, Some(share)) => {
            let verdict = if all.can_go(ablation.threshold) {
                "they can go together"
            } else {
                "each can go, but not all at once"
            };
            format!(
                "{alone} Without all of them the cloth moves by {} RMS and the run takes {} of the time: {verdict}.",
                millimetres(all.change.rms),
                percent(1.0 - share)
            )
        }
        _ => format!(
            "{alone} They can't go all at once: that run {}.",
            all.outcome.name()
        ),
    }
}

/// What a table says of the scene with this fingerprint, a line a part.
pub fn citation(table: &Citation, fingerprint: u64) -> Option<Vec<String>> {
    if table.fingerprint != fingerprint {
        return None;
    }
    let mut lines = vec![format!(
        "measured on {} over {} s by {}; a part can go where that moves the cloth by at most {} RMS:",
        table.date,
        digits(table.duration),
        table.setting,
        millimetres(table.threshold)
    )];
    for row in &table.rows {
        let verdict = if row.can_go { "can go" } else { "needed" };
        let moves = row.rms.map_or_else(
            || format!("the run without it {}", row.outcome),
            |rms| format!("moves the cloth by {} RMS", millimetres(rms)),
        );
        let costs = match row.time_share {
            Some(share) if share > 0.0 => format!(", takes {} of the time", percent(share)),
            Some(_) => ", takes no time".to_owned(),
            None => String::new(),
        };
        let all = if row.together { "all at once: " } else { "" };
        let how = if row.can_go {
            format!("; {}", row.flags)
        } else {
            String::new()
        };
        lines.push(format!(
            "  {verdict}: {all}{} ({moves}{costs}{how})",
            row.part
        ));
    }
    Some(lines)
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share).replace('-', "−")
}

fn millimetres(x: f64) -> String {
    format!("{} mm", up(1000.0 * x))
}

/// A length that is at least x, with three digits.
fn up(x: f64) -> String {
    if !(x.is_finite() && x > 0.0) {
        return digits(x);
    }
    let unit = 10.0_f64.powf(x.log10().floor() - 2.0);
    // 12.3 / 0.1 is a rounding above 123.
    digits((x / unit * (1.0 - 1e-12)).ceil() * unit)
}

#[cfg(test)]
mod tests {
    use super::super::table::{csv, read, tests::example};
    use super::*;

    #[test]
    fn lengths_are_rounded_up() {
        for (x, text) in [
            (0.0, "0"),
            (12.34, "12.4"),
            (12.3, "12.3"),
            (999.1, "1000"),
            (0.031_21, "0.0313"),
        ] {
            assert_eq!(up(x), text);
        }
    }

    #[test]
    fn the_report_says_what_can_go_and_by_which_rule() {
        let text = markdown(&example());
        for words in [
            "at most 10 mm RMS, which is what halving the step does",
            "| shear springs | 201 | 601 | 101 | 25 % | needed | `--set 'cloth.a.springs=[\"structural\", \"bend\"]'` |",
            "| strain limit | 0 | 0 | 0 | 5 % | can go | `--set strain_limit=` |",
            "| drag on all motion | – | – | – | – | needed: diverges without it, at step 3 |",
            "This scene doesn't need: strain limit.",
            "differed by 5 %",
        ] {
            assert!(text.contains(words), "{words} is missing:\n{text}");
        }
    }

    #[test]
    fn a_table_is_cited_for_its_own_scene_only() {
        let example = example();
        let table = read(&csv(&example, "2026-11-22")).unwrap();
        assert_eq!(citation(&table, 1), None);
        let lines = citation(&table, example.fingerprint).unwrap();
        assert_eq!(
            lines[2],
            "  can go: strain limit (moves the cloth by 0 mm RMS, takes 5 % of the time; --set strain_limit=)"
        );
        assert!(lines[0].contains("2026-11-22 over 4 s by verlet at 4 ms"));
        assert!(lines[3].contains("needed: drag") && lines[3].contains("diverged"));
    }
}
