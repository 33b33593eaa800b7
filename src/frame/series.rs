//! The time series of a run: what they are called, and their values.

use crate::collision::Findings;
use crate::simulation::Simulation;

/// Path, label with unit, and value of every series, in a fixed order.
pub(super) fn series(
    simulation: &Simulation,
    findings: Option<&Findings>,
    error: Option<f64>,
    step_ms: f64,
) -> Vec<(String, String, f64)> {
    let stats = simulation.stats();
    let balance = simulation.balance();
    let energies = &balance.energies;
    let mut all = Vec::new();
    let mut add = |path: String, label: String, value: f64| all.push((path, label, value));
    let mut energy = |name: &str, value: f64| {
        add(
            format!("energy/{name}"),
            format!("{} (J)", name.replace('_', " ")),
            value,
        );
    };
    energy("kinetic", energies.kinetic);
    energy("gravitational", energies.gravitational);
    for (family, value) in &energies.elastic {
        energy(&format!("elastic_{family}"), *value);
    }
    energy("total", energies.total());
    for (cause, value) in &balance.dissipated {
        energy(&format!("dissipated_by_{cause}"), *value);
    }
    for (cause, value) in &balance.work {
        energy(&format!("work_by_{cause}"), *value);
    }
    energy("residual", balance.residual);
    energy("exchanged", balance.exchanged);
    add(
        "strain/max".into(),
        "largest strain (m/m)".into(),
        stats.strain,
    );
    add(
        "strain/mean".into(),
        "mean |strain| (m/m)".into(),
        mean_strain(simulation),
    );
    if let Some(findings) = findings {
        contact(simulation, findings, &mut add);
    }
    add(
        "solver/iterations".into(),
        "solver iterations a step".into(),
        f64::from(stats.solve.iterations),
    );
    add(
        "solver/step_time".into(),
        "wall time of a step (ms)".into(),
        step_ms,
    );
    if let Some(error) = error {
        let label = "time step, estimated (m)".into();
        add("error/time_step".into(), label, error);
    }
    all
}

/// Mean of |ε| over structural and shear springs; 0 without springs.
pub fn mean_strain(simulation: &Simulation) -> f64 {
    let positions = &simulation.state().positions;
    let springs = simulation.model().weave().flat_map(|batch| &batch.springs);
    let (sum, count) = springs.fold((0.0, 0.0), |(sum, count), s| {
        (sum + s.strain(positions).abs(), count + 1.0)
    });
    sum / f64::max(count, 1.0)
}

/// What the audit found: in all obstacles, in each of several, and in cloth.
fn contact(
    simulation: &Simulation,
    findings: &Findings,
    add: &mut impl FnMut(String, String, f64),
) {
    let model = simulation.model();
    let bodies = model.obstacles.iter().zip(&findings.bodies);
    if !model.obstacles.is_empty() {
        add(
            "contact/depth".into(),
            "deepest penetration (m)".into(),
            findings.depth(),
        );
        let several = model.obstacles.len() > 1;
        for (obstacle, found) in bodies.filter(|_| several) {
            add(
                format!("contact/depth_in_{}", obstacle.name.replace('/', "-")),
                format!("in {} (m)", obstacle.name),
                found.depth,
            );
        }
        add(
            "contact/count".into(),
            "particles in contact".into(),
            number(simulation.contacts().list.len()),
        );
        add(
            "contact/inside".into(),
            "particles inside".into(),
            f64::from(findings.inside()),
        );
        add(
            "contact/crossings".into(),
            "edges crossing".into(),
            f64::from(findings.crossings()),
        );
    }
    let tangled = simulation.tangled();
    if tangled.at_start > 0 {
        add(
            "contact/tangled".into(),
            "particles still tangled".into(),
            number(tangled.now),
        );
    }
    if model.self_collision.is_some() {
        add(
            "contact/cloth_crossings".into(),
            "cloth crossing cloth".into(),
            f64::from(findings.cloth_crossings),
        );
    }
}

#[expect(clippy::cast_precision_loss, reason = "counts stay far below 2⁵³")]
fn number(count: usize) -> f64 {
    count as f64
}
