//! Which series share a plot: those of one group, such as `energy`, and of one unit.
//!
//! One plot has one axis, and a count of contacts would flatten their depth in metres.

use crate::frame::Series;

/// The series of one plot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Panel<'a> {
    /// First part of their paths, such as `energy`.
    pub(super) group: &'a str,
    /// Whether they say where energy went rather than where it is.
    pub(super) flows: bool,
    /// Their unit as the labels give it, such as `J`; empty when they have none.
    pub(super) unit: &'a str,
    /// At least one.
    pub(super) series: Vec<&'a Series>,
}

impl Panel<'_> {
    /// What to call the plot: `Energy (J)`, or `Contact: deepest (mm)` for a lone series.
    pub(super) fn title(&self) -> String {
        let mut letters = self.group.chars();
        let name: String = match letters.next() {
            _ if self.flows => "Dissipated, work".to_owned(),
            Some(first) => first.to_uppercase().chain(letters).collect(),
            None => "Series".to_owned(),
        };
        match (self.series.as_slice(), self.unit) {
            ([only], _) => format!("{name}: {}", only.label),
            (_, "") => name,
            (_, unit) => format!("{name} ({unit})"),
        }
    }
}

/// The plots, in the order in which their first series come.
pub(super) fn of(series: &[Series]) -> Vec<Panel<'_>> {
    let mut panels: Vec<Panel<'_>> = Vec::new();
    for one in series {
        let group = one.path.split('/').next().unwrap_or_default();
        let unit = unit(&one.label);
        let flows = flows(&one.path);
        let known = panels
            .iter_mut()
            .find(|panel| panel.group == group && panel.unit == unit && panel.flows == flows);
        match known {
            Some(panel) => panel.series.push(one),
            None => panels.push(Panel {
                group,
                flows,
                unit,
                series: vec![one],
            }),
        }
    }
    panels
}

/// What a plot whose title has the unit calls a series.
pub(super) fn name(label: &str) -> &str {
    let unit = unit(label);
    let name = label.strip_suffix(&format!("({unit})")).unwrap_or(label);
    name.trim_end()
}

/// Whether a series is one of the energies that have gone somewhere: with those that are there it would be too much
/// for one plot.
fn flows(path: &str) -> bool {
    let name = path.strip_prefix("energy/").unwrap_or_default();
    let kinds = ["dissipated_by", "work_by", "residual", "exchanged"];
    kinds.iter().any(|kind| name.starts_with(kind))
}

/// What stands in the brackets at the end of a label.
fn unit(label: &str) -> &str {
    let inside = label.trim_end().strip_suffix(')');
    let inside = inside.and_then(|rest| rest.rsplit_once('('));
    inside.map_or("", |(_, unit)| unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_unit_a_plot() {
        let series = |path: &str, label: &str| Series {
            path: path.to_owned(),
            label: label.to_owned(),
        };
        let all = [
            series("energy/kinetic", "kinetic (J)"),
            series("contact/depth", "deepest (mm)"),
            series("energy/elastic/shear", "shear (J)"),
            series("contact/count", "contacts"),
            series("energy/work_by_pins", "work by pins (J)"),
        ];
        let titles: Vec<String> = of(&all).iter().map(Panel::title).collect();
        assert_eq!(
            titles,
            [
                "Energy (J)",
                "Contact: deepest (mm)",
                "Contact: contacts",
                "Dissipated, work: work by pins (J)"
            ]
        );
        assert_eq!(of(&all)[0].series.len(), 2);
        assert_eq!(name("elastic shear (J)"), "elastic shear");
        assert_eq!(name("contacts"), "contacts");
    }
}
