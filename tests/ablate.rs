//! Parts of a scene that provably do nothing, and parts without which it is provably another.

use crate::support::{load, written};
use muslin::integrator::Integrator;
use muslin::scene::LoadedScene;
use muslin::study::ablate::{Ablation, Finding, Threshold, ablate, table, words};
use muslin::study::{Distance, Setting, Subject};
use std::sync::atomic::AtomicBool;

static GO_ON: AtomicBool = AtomicBool::new(false);

fn study(
    loaded: LoadedScene,
    duration: f64,
    tolerance: Option<f64>,
) -> (Ablation, Subject<'static>) {
    let solver = &loaded.scene.solver;
    let muslin::scene::Step::Seconds(dt) = solver.dt else {
        panic!("a test scene gives its step");
    };
    let setting = Setting {
        integrator: Integrator::of(solver),
        dt,
    };
    let subject = Subject::new(loaded, duration, 4, 1, &GO_ON).unwrap();
    let ablation = ablate(&subject, setting, tolerance, 1, &mut |_| {}).unwrap();
    (ablation, subject)
}

fn part<'a>(ablation: &'a Ablation, name: &str) -> &'a Finding {
    let found = ablation.parts.iter().find(|found| found.part.name == name);
    found.unwrap_or_else(|| panic!("{name} is not among {:?}", ablation.parts))
}

#[test]
fn drape_ablation_figures() {
    let (ablation, _) = study(load("drape", &[]), 4.0, None);
    println!("{}", words::markdown(&ablation));
}
