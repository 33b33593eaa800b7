//! Obstacles that move: what they take along, push, and let slide.

use crate::support::{IMPLICIT, PROJECTIVE, SOLVED, XPBD, run_to, written};
use glam::DVec3;
use muslin::integrator::Integrator;
use muslin::scene;
use muslin::simulation::Simulation;

/// The schemes with a step for a sheet on a table; explicit Euler has none.
const ON_A_TABLE: [(Integrator, f64); 9] = [
    (Integrator::SymplecticEuler, 1e-4),
    (Integrator::Verlet, 1e-4),
    (Integrator::Rk4, 1e-4),
    (IMPLICIT, 0.002),
    (Integrator::Newton(SOLVED), 0.002),
    (Integrator::ImplicitMidpoint(SOLVED), 0.002),
    (Integrator::Bdf2(SOLVED), 0.002),
    (XPBD, 0.001),
    (PROJECTIVE, 0.001),
];

/// A sheet of 0.3 m × 0.3 m and 18 g, as it lies on something that moves.
fn on_a_table(obstacle: &str, motion: &str) -> String {
    format!(
        "name = \"table\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\ntranslate = [0.0, 0.003, 0.0]\n\
         shape = {{ sheet = {{ size = [0.3, 0.3], cells = [6, 6] }} }}\n\
         material = {{ area_density = 0.2, stretch = 200.0 }}\ndamping = {{ stiffness = 0.001 }}\n\
         [[obstacle]]\nname = \"table\"\nthickness = 0.003\n{obstacle}\n\
         motion = {{ keyframes = [{motion}] }}\n"
    )
}

const PLANE: &str = "shape = { plane = { normal = [0.0, 1.0, 0.0] } }";

fn start(text: &str, scheme: Integrator, dt: f64) -> Simulation {
    let built = scene::build(&written("moving", text)).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(built.model, built.state, scheme, dt)
}

fn center(run: &Simulation) -> DVec3 {
    run.state().positions.iter().sum::<DVec3>() / run.model().particles() as f64
}

/// A table that goes D to the side and stops, as s²(3 − 2s), s = t/T, has its largest acceleration 6 D/T² at
/// both ends: below μ g the sheet goes along, without friction it stays behind.
#[test]
fn a_table_takes_a_sheet_along_as_far_as_friction_holds() {
    let (way, time) = (0.1, 0.5);
    let needed: f64 = 6.0 * way / (time * time * 9.81);
    let motion = format!("{{ t = 0.0 }}, {{ t = {time:?}, translate = [{way:?}, 0.0, 0.0] }}");
    for (scheme, dt) in ON_A_TABLE {
        let gone = |friction: f64| {
            let table = format!("{PLANE}\nfriction = {friction:?}");
            let mut run = start(&on_a_table(&table, &motion), scheme, dt);
            run_to(&mut run, 0.6);
            let balance = run.balance();
            assert!(
                balance.unexplained() < 1e-9,
                "{}: {balance:?}",
                scheme.name()
            );
            (center(&run).x, run)
        };
        let name = scheme.name();
        let (along, run) = gone(1.05 * needed);
        // A step's lag of what is answered after it.
        assert!((along - way).abs() < 2e-4, "{name}: {along} m, not {way} m");
        let fastest = |v: f64, w: &DVec3| v.max(w.length());
        let left = run.state().velocities.iter().fold(0.0, fastest);
        assert!(left < 1e-3, "{name}: {left} m/s left");
        let (stays, _) = gone(0.0);
        assert!(stays.abs() < 1e-9, "{name}: {stays} m without friction");
        let (slips, _) = gone(0.5 * needed);
        assert!(
            (0.2 * way..0.98 * way).contains(&slips),
            "{name}: {slips} m with half the friction needed"
        );
    }
}

/// A lift does the work m g h, and leaves the sheet at rest where it stops.
#[test]
fn a_lift_works_against_the_weight() {
    let (height, mass) = (0.2, 0.018);
    let motion = format!("{{ t = 0.0 }}, {{ t = 0.5, translate = [0.0, {height:?}, 0.0] }}");
    for (scheme, dt) in ON_A_TABLE {
        let mut run = start(&on_a_table(PLANE, &motion), scheme, dt);
        run_to(&mut run, 0.8);
        let (balance, name) = (run.balance(), scheme.name());
        let [work, exact] = [balance.work[0].1, mass * 9.81 * height];
        let contact = balance.dissipated_by("contact");
        println!("{name}: {work} J of {exact} J, contact took {contact} J");
        let lifted = center(&run).y - 0.003;
        assert!((lifted - height).abs() < 2e-4, "{name}: {lifted} m");
        // What contact moves out is lifted by it, and not by the velocity that the lift gave.
        let given = work - contact;
        // Contact answered after the step lags by one.
        let tolerance = if scheme.has_contact_inside() {
            0.005
        } else {
            0.03
        };
        assert!(
            (given / exact - 1.0).abs() < tolerance,
            "{name}: {given} J, not {exact} J"
        );
        assert!(balance.unexplained() < 1e-9, "{name}: {balance:?}");
    }
}

/// On a turntable each particle keeps its place while ω² r < μ g, and the sheet has turned with the table.
#[test]
fn a_turntable_turns_what_lies_on_it() {
    let motion = "{ t = 0.0 }, { t = 1.0, rotate = [0.0, 60.0, 0.0] }";
    for (scheme, dt) in ON_A_TABLE {
        let mut run = start(
            &on_a_table(&format!("{PLANE}\nfriction = 0.8"), motion),
            scheme,
            dt,
        );
        let before = run.state().positions.clone();
        run_to(&mut run, 1.0);
        let turn = glam::DMat3::from_rotation_y(60_f64.to_radians());
        let far = before.iter().zip(&run.state().positions);
        let far = far
            .map(|(x, y)| (turn * *x).distance(*y))
            .fold(0.0, f64::max);
        // First-order schemes go along the tangent: ω² r dt/2 a second, 0.5 mm at 4 ms.
        let name = scheme.name();
        println!("{name}: {far} m");
        assert!(far < 6e-4, "{name}: {far} m off");
    }
}

/// A ball as fast as 30 m/s goes through nothing, and takes the cloth with it.
#[test]
fn a_fast_ball_goes_through_no_cloth() {
    for (scheme, dt) in [
        (IMPLICIT, 1e-3),
        (Integrator::SymplecticEuler, 5e-6),
        (XPBD, 1e-4),
    ] {
        let text = "name = \"ball\"\nduration = 0.1\n[[cloth]]\nname = \"sheet\"\n\
            shape = { sheet = { size = [0.3, 0.3], cells = [20, 20], diagonals = \"both\" } }\n\
            material = { area_density = 0.1, stretch = 2000.0 }\ndamping = { stiffness = 0.0005 }\n\
            [[obstacle]]\nname = \"ball\"\nshape = { sphere = { center = [0.0, -0.3, 0.0], radius = 0.04 } }\n\
            motion = { keyframes = [{ t = 0.0 }, { t = 0.02, translate = [0.0, 0.4, 0.0] }] }\n";
        let mut run = start(text, scheme, dt);
        let mut deepest: f64 = 0.0;
        while run.state().time < 0.03 {
            run.step().unwrap_or_else(|diverged| panic!("{diverged}"));
            let motion = run.model().obstacles[0].motion.as_ref();
            assert!(motion.is_some());
            let ball = run.bodies().now(0, DVec3::new(0.0, -0.3, 0.0));
            let closest = run.state().positions.iter();
            let closest = closest.map(|x| x.distance(ball)).fold(f64::MAX, f64::min);
            deepest = deepest.max(0.04 - closest);
        }
        let name = scheme.name();
        println!("{name}: {deepest} m deep");
        assert!(deepest < 1e-9, "{name}: {deepest} m");
        let middle = run.state().positions[220];
        assert!(middle.y > 0.13, "{name}: the middle is at {middle}");
    }
}
