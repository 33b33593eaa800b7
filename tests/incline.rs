//! Friction on an incline: what sticks, what slides, and how fast.

use crate::support::{IMPLICIT, SOLVED, load, run_to};
use glam::DVec3;
use muslin::integrator::Integrator;
use muslin::scene;
use muslin::simulation::Simulation;

const SCHEMES: [Integrator; 4] = [
    IMPLICIT,
    Integrator::Newton(SOLVED),
    Integrator::ImplicitMidpoint(SOLVED),
    Integrator::Bdf2(SOLVED),
];

/// The scene with friction of its own; the angle of its plane is 25°.
fn on_the_incline(friction: f64, scheme: Integrator) -> Simulation {
    let loaded = load(
        "incline",
        &[&format!("obstacle.plane.friction={friction:?}")],
    );
    let built = scene::build(&loaded).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(built.model, built.state, scheme, 0.002)
}

/// How far each cloth's centre has come down the incline (m).
fn slid(run: &Simulation, start: &[DVec3]) -> Vec<f64> {
    let down = DVec3::new(-ANGLE.to_radians().cos(), -ANGLE.to_radians().sin(), 0.0);
    let center = |positions: &[DVec3], cloth: &muslin::model::Cloth| {
        let own = &positions[cloth.particles.clone()];
        own.iter().sum::<DVec3>() / own.len() as f64
    };
    let each = run.model().cloths.iter();
    each.map(|cloth| (center(&run.state().positions, cloth) - center(start, cloth)).dot(down))
        .collect()
}

const ANGLE: f64 = 25.0;

/// A block and a sheet stick where μ is 1 % above tan α and slide where it is 1 % below.
#[test]
fn what_lies_on_an_incline_sticks_up_to_its_friction() {
    let critical = ANGLE.to_radians().tan();
    for scheme in SCHEMES {
        let way = |friction: f64| {
            let mut run = on_the_incline(friction, scheme);
            // The block's springs settle first, and what it slid by then comes to rest: 1 % of g sin α stops it
            // with 0.04 m/s².
            run_to(&mut run, 1.5);
            let start = run.state().positions.clone();
            run_to(&mut run, 2.5);
            slid(&run, &start)
        };
        let (sticks, slides) = (way(1.01 * critical), way(0.99 * critical));
        let name = scheme.name();
        println!("{name}: {sticks:?} m and {slides:?} m");
        // A hundredth of the friction less leaves g sin α/100 = 0.041 m/s²: 21 mm in a second.
        assert!(
            sticks.iter().all(|way| way.abs() < 1e-5),
            "{name}: {sticks:?} m"
        );
        assert!(slides.iter().all(|way| *way > 0.01), "{name}: {slides:?} m");
    }
}

/// What slides has the acceleration g (sin α − μ cos α).
#[test]
fn what_slides_has_the_acceleration_of_the_law() {
    let (sine, cosine) = ANGLE.to_radians().sin_cos();
    for scheme in SCHEMES {
        for friction in [0.0, 0.2, 0.4] {
            let mut run = on_the_incline(friction, scheme);
            run_to(&mut run, 0.3);
            let start = run.state().positions.clone();
            let mut ways = Vec::new();
            for time in [0.5, 0.7] {
                run_to(&mut run, time);
                ways.push(slid(&run, &start));
            }
            let exact = 9.81 * (sine - friction * cosine);
            for (cloth, (first, second)) in ways[0].iter().zip(&ways[1]).enumerate() {
                // Three places 0.2 s apart: s₀ − 2 s₁ + s₂ = a t².
                let measured = (second - 2.0 * first) / 0.04;
                let error = measured / exact - 1.0;
                let name = scheme.name();
                println!("{name}, μ = {friction}, cloth {cloth}: {measured} m/s², {error:.1e}");
                assert!(error.abs() < 0.01, "{name}: {measured} m/s², not {exact}");
            }
        }
    }
}
