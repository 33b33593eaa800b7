//! What the built-in scenes say of themselves, at their own step.

use crate::support::{load, run_to};
use glam::DVec3;
use muslin::integrator::Integrator;
use muslin::scene::{self, BUILTIN};
use muslin::simulation::{Simulation, forecast, step_length};

/// A built-in scene as it is run by its name.
fn built_in(name: &str) -> Simulation {
    let loaded = load(name, &[]);
    let built = scene::build(&loaded).unwrap_or_else(|error| panic!("{error}"));
    let solver = &loaded.scene.solver;
    let integrator = Integrator::of(solver);
    let forecast = forecast(&built.model, &built.state);
    let dt = step_length(solver.dt, integrator, &forecast).unwrap();
    Simulation::new(built.model, built.state, integrator, dt)
}

/// Where the particles of each cloth are.
fn cloths(run: &Simulation) -> impl Iterator<Item = (&str, &[DVec3])> {
    let positions = &run.state().positions;
    let cloths = run.model().cloths.iter();
    cloths.map(|cloth| (cloth.name.as_str(), &positions[cloth.particles.clone()]))
}

#[test]
fn every_scene_starts_without_trouble() {
    for (name, _) in BUILTIN {
        let mut run = built_in(name);
        let end = 20.0 * run.dt();
        run_to(&mut run, end);
    }
}

#[test]
fn zero_length_springs_are_back_after_each_period() {
    let mut run = built_in("zero-length-spring");
    let start = run.state().positions.clone();
    for period in 1..=4 {
        run_to(&mut run, 2.0 * f64::from(period));
        for (x, x0) in run.state().positions.iter().zip(&start) {
            // dt is 1/600 of a radian, and the velocity 1.2566 m/s rounded.
            let error = x.distance(*x0);
            assert!(error < 2e-3, "{period} periods: {error} m from the start");
        }
    }
}

#[test]
fn springs_reach_twice_their_depth_and_the_damped_one_its_depth() {
    let mut run = built_in("spring");
    let mut lowest = [f64::INFINITY; 3];
    while run.state().time < 5.0 {
        run.step().unwrap();
        for (low, (_, ends)) in lowest.iter_mut().zip(cloths(&run)) {
            *low = low.min(ends[1].y);
        }
    }
    for (name, depth, exact) in [
        ("light", 0.75 - lowest[0], 2.0 * 0.0621),
        ("heavy", 0.75 - lowest[1], 2.0 * 0.2485),
        ("heavy-damped", 0.75 - run.state().positions[5].y, 0.2485),
    ] {
        assert!(
            (depth / exact - 1.0).abs() < 0.01,
            "{name}: {depth} m for {exact}"
        );
    }
}

/// The flight of a pair: as far as v t without drag, v/c (1 − exp(−c t)) with it.
#[test]
fn rust_stops_a_pair_and_oil_only_its_swing() {
    let mut run = built_in("rusty-and-oiled");
    run_to(&mut run, 4.0);
    let flown = [1.4, 1.4, 0.35 * (1.0 - (-4.0_f64).exp())];
    for ((name, ends), exact) in cloths(&run).zip(flown) {
        let distance = 1.5 - 0.5 * (ends[0] + ends[1]).y;
        assert!((distance - exact).abs() < 1e-3, "{name}: {distance} m");
    }
    let swings: Vec<f64> = run
        .model()
        .cloths
        .iter()
        .map(|cloth| {
            let [a, b] = [cloth.particles.start, cloth.particles.start + 1];
            let state = run.state();
            let span = state.positions[b] - state.positions[a];
            (state.velocities[b] - state.velocities[a]).dot(span.normalize_or_zero())
        })
        .collect();
    // They began with 1.5 m/s.
    assert!(swings[1].abs() < 0.01, "oiled: {} m/s", swings[1]);
    assert!(swings[0].abs() > 0.1, "undamped: {} m/s", swings[0]);
}

/// A strip of n springs that carries its own weight, half of a piece's at its end, is longer by
/// σ g ℓ²/2E whatever n is, and by n/8 of that if each spring has the constant of an eighth.
#[test]
fn strips_are_as_long_as_their_material_or_their_number_makes_them() {
    let mut run = built_in("spring-constants");
    run_to(&mut run, 5.0);
    let longer = 0.5 * 9.81 / (2.0 * 10.0);
    let shares = [1.0, 1.0, 1.0, 0.5, 1.0, 2.0];
    for ((name, strip), share) in cloths(&run).zip(shares) {
        let length = strip[0].y - strip[strip.len() - 1].y;
        let exact = 1.0 + share * longer;
        assert!(
            (length - exact).abs() < 2e-3,
            "{name}: {length} for {exact} m"
        );
    }
}

/// The sag of an elastic catenary of weight w a metre, with s = ℓ/2:
/// span/2 = H s/EA + H/w asinh(w s/H), sag = w s²/2EA + H/w (√(1 + (w s/H)²) − 1).
#[test]
fn a_chain_between_two_pins_is_a_catenary() {
    let (weight, half, stiffness) = (0.05 * 9.81, 0.5, 100.0);
    let reach = |h: f64| h * half / stiffness + h / weight * (weight * half / h).asinh();
    let (mut low, mut high) = (1e-3, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if reach(middle) < 0.45 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let slope: f64 = weight * half / low;
    let exact = weight * half * half / (2.0 * stiffness)
        + low / weight * ((1.0 + slope * slope).sqrt() - 1.0);
    let mut run = built_in("chain");
    run_to(&mut run, 6.0);
    let positions = &run.state().positions;
    let sag = positions[0].y - positions[25].y;
    assert!((sag - exact).abs() < 2e-4, "sag {sag} m for {exact} m");
}

#[test]
fn a_block_comes_to_rest_on_the_floor() {
    let mut run = built_in("block");
    while run.state().time < 4.0 {
        run.step().unwrap();
        let lowest = run.state().positions.iter().map(|x| x.y);
        let lowest = lowest.fold(f64::INFINITY, f64::min);
        assert!(lowest >= 0.0, "{lowest} m at {} s", run.state().time);
    }
    let speeds = run.state().velocities.iter().map(|v| v.length());
    let fastest = speeds.fold(0.0, f64::max);
    assert!(fastest < 0.05, "still moving at {fastest} m/s");
    let heights = run.state().positions.iter().map(|x| x.y);
    let top = heights.fold(0.0, f64::max);
    assert!(
        (top - 0.3).abs() < 0.02,
        "its top is at {top} m, not on a face"
    );
}

/// The stiffest strips stand out the farthest, and both laws agree.
#[test]
fn stiffer_strips_hang_less_over_the_edge() {
    let mut run = built_in("edge-springs");
    run_to(&mut run, 4.0);
    let tips: Vec<f64> = cloths(&run).map(|(_, strip)| strip[20].y).collect();
    for pair in tips.chunks(2) {
        assert!((pair[0] - pair[1]).abs() < 0.01, "two laws: {tips:?} m");
    }
    for next in tips.windows(3).step_by(2) {
        assert!(next[2] < next[0] - 0.04, "from stiff to limp: {tips:?} m");
    }
}

/// Without diagonals a sheet leans as far as gravity, atan(3/9.81) = 17°; diagonals hold it up.
#[test]
fn a_sheet_without_diagonals_leans_as_gravity_does() {
    let mut run = built_in("sheets");
    run_to(&mut run, 4.0);
    let leans: Vec<f64> = cloths(&run)
        .map(|(_, sheet)| {
            // The middle of the upper and of the lower edge.
            let way = sheet[sheet.len() - 6] - sheet[5];
            way.x.atan2(-way.y).to_degrees()
        })
        .collect();
    assert!((leans[0] - 17.0).abs() < 2.0, "{leans:?}");
    assert!(
        leans[1..].iter().all(|lean| lean.abs() < 0.7 * leans[0]),
        "{leans:?}"
    );
}
