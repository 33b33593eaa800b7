//! Pins that move and pins that let go, with every scheme.

use crate::support::{IMPLICIT, PROJECTIVE, SOLVED, XPBD, distance, run_to, written};
use glam::{DQuat, DVec3};
use muslin::energy::{Energies, SCHEME};
use muslin::frame::Capture;
use muslin::integrator::Integrator;
use muslin::scene;
use muslin::simulation::{Simulation, forecast, settle};

/// Every scheme of fixed steps with a first step for the sheet below and its order; [`DOPRI5`] has none.
const SCHEMES: [(Integrator, f64, f64); 10] = [
    (Integrator::Euler, 1e-4, 0.9),
    (Integrator::SymplecticEuler, 1e-3, 0.9),
    (Integrator::Verlet, 1e-3, 1.8),
    (Integrator::Rk4, 2e-3, 3.6),
    (IMPLICIT, 5e-4, 0.9),
    (Integrator::Newton(SOLVED), 5e-4, 0.9),
    (Integrator::ImplicitMidpoint(SOLVED), 2e-3, 1.8),
    (Integrator::Bdf2(SOLVED), 1e-3, 1.8),
    (XPBD, 5e-4, 0.9),
    (PROJECTIVE, 5e-4, 0.9),
];

/// The scheme that chooses its steps.
const DOPRI5: Integrator = Integrator::Dopri5 { tolerance: 1e-6 };

/// Every scheme.
fn schemes() -> impl Iterator<Item = Integrator> {
    let fixed = SCHEMES.into_iter().map(|(scheme, ..)| scheme);
    fixed.chain([DOPRI5])
}

/// A small sheet that bends, and the pins given.
fn sheet(damping: &str, pins: &str) -> String {
    format!(
        "name = \"driven\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\nshape = {{ sheet = {{ size = [0.5, 0.5], cells = [4, 4], diagonals = \"both\" }} }}\nbending = \"discrete-shell\"\nmaterial = {{ area_density = 0.2, stretch = 20.0, bend = 1.0e-3 }}\ndamping = {{ {damping} }}\n{pins}"
    )
}

const DAMPED: &str = "mass = 0.5, stiffness = 0.002";

/// A pin with keys of its own.
fn pin(select: &str, keys: &str) -> String {
    format!("[[pin]]\ncloth = \"sheet\"\nselect = {{ {select} }}\n{keys}\n")
}

const CORNERS: &str = "corner = [\"left-near\", \"right-near\"]";
const ALL: &str = "box = [[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]]";

/// Swings and turns what it holds, in one segment of 0.4 s.
const SWING: &str = "motion = { keyframes = [{ t = 0.0 }, { t = 0.4, translate = [0.1, 0.05, -0.1], rotate = [20.0, 40.0, -30.0] }] }";

fn run(text: &str, scheme: Integrator, dt: f64) -> Simulation {
    let built = scene::build(&written("motion", text)).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(built.model, built.state, scheme, dt)
}

/// The smooth step from 0 to 1 with no slope at its ends, and its rate.
fn smooth(s: f64) -> [f64; 2] {
    [s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s)]
}

/// One answer, which each scheme approaches at its order although pins move within the step.
#[test]
fn schemes_keep_their_order_with_driven_pins() {
    let text = sheet(DAMPED, &pin(CORNERS, SWING));
    let at = |scheme: Integrator, dt: f64| {
        let mut run = run(&text, scheme, dt);
        run_to(&mut run, 0.25);
        run.state().positions.clone()
    };
    let reference = at(Integrator::Rk4, 2e-5);
    for (scheme, first, least) in SCHEMES {
        let steps = [1.0, 0.5, 0.25, 0.125].map(|share| share * first);
        let errors = steps.map(|dt| distance(&at(scheme, dt), &reference));
        let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
        let name = scheme.name();
        println!("{name}: {errors:?} m, orders {orders:.2?}");
        assert!(
            orders.iter().all(|&order| order >= least),
            "{name}: {orders:?}, {errors:?}"
        );
        assert!(errors[3] < 1e-3, "{name}: {errors:?}");
    }
}

/// However few steps are asked for, dopri5 follows driven pins, and pins that let go at the end of a step,
/// within ten times its tolerance.
#[test]
fn dopri5_follows_driven_and_released_pins() {
    for keys in [SWING.to_owned(), format!("{SWING}\nrelease = 0.125")] {
        let text = sheet(DAMPED, &pin(CORNERS, &keys));
        let at = |scheme: Integrator, dt: f64| {
            let mut run = run(&text, scheme, dt);
            run_to(&mut run, 0.25);
            assert_eq!(run.model().is_pinned(0), !keys.contains("release"));
            run.state().positions.clone()
        };
        let reference = at(Integrator::Rk4, 2e-5);
        for dt in [0.125, 0.0125] {
            let found = at(DOPRI5, dt);
            let each = found.iter().zip(&reference).map(|(a, b)| a.distance(*b));
            let error = each.fold(0.0, f64::max);
            println!("dopri5 in steps of {dt} s: {error} m");
            assert!(error < 1e-5, "steps of {dt} s: {error} m");
        }
    }
}

/// All particles held and moved: a rigid translation by the smooth step, and its rate, at every time.
#[test]
fn a_wholly_pinned_sheet_moves_as_one() {
    let shift = DVec3::new(0.3, -0.2, 0.1);
    let keys = "motion = { keyframes = [{ t = 0.1 }, { t = 0.6, translate = [0.3, -0.2, 0.1] }] }";
    let text = sheet(DAMPED, &pin(ALL, keys));
    for scheme in schemes() {
        let mut run = run(&text, scheme, 0.01);
        let starts = run.state().positions.clone();
        for step in 1..=80 {
            run.step().unwrap();
            let s = ((f64::from(step) * 0.01 - 0.1) / 0.5).clamp(0.0, 1.0);
            let [way, rate] = smooth(s);
            for (i, start) in starts.iter().enumerate() {
                let (x, v) = (run.state().positions[i], run.state().velocities[i]);
                let name = scheme.name();
                assert!(
                    (x - *start - shift * way).length() < 1e-14,
                    "{name}, step {step}: {x}"
                );
                assert!(
                    (v - shift * rate / 0.5).length() < 1e-13,
                    "{name}, step {step}: {v}"
                );
                assert!(step > 10 || x == *start, "{name}: has moved too early");
            }
        }
    }
}

/// A driven edge under strain limiting is exactly where its motion says after each step, and a pin that
/// holds still doesn't move at all.
#[test]
fn driven_particles_are_exact_and_still_ones_still() {
    let pins = pin("edge = \"left\"", SWING) + &pin("corner = [\"right-far\"]", "");
    let text = sheet(DAMPED, &pins) + "[strain_limit]\nmax = 0.05\n";
    for scheme in schemes() {
        let mut run = run(&text, scheme, 1e-3);
        let starts = run.state().positions.clone();
        let still = starts
            .iter()
            .position(|x| x.x > 0.24 && x.z > 0.24)
            .unwrap();
        let left: Vec<usize> = (0..starts.len()).filter(|&i| starts[i].x < -0.24).collect();
        assert_eq!(left.len(), 5);
        for step in 1..=400 {
            run.step().unwrap();
            let way = smooth(f64::from(step) / 400.0)[0];
            let [x, y, z] = [20.0, 40.0, -30.0_f64].map(|angle| (way * angle).to_radians());
            let turn =
                DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
            let center = DVec3::new(-0.25, 0.0, 0.0);
            for &i in &left {
                let expected =
                    center + DVec3::new(0.1, 0.05, -0.1) * way + turn * (starts[i] - center);
                let off = run.state().positions[i] - expected;
                assert!(
                    off.length() < 1e-14,
                    "{}, step {step}: {off}",
                    scheme.name()
                );
            }
            assert_eq!(
                run.state().positions[still],
                starts[still],
                "{}",
                scheme.name()
            );
            assert_eq!(
                run.state().velocities[still],
                DVec3::ZERO,
                "{}",
                scheme.name()
            );
        }
    }
}

/// A strip that is clamped along x at its left end.
fn strip(law: &str, gravity: f64, pins: &str) -> String {
    format!(
        "name = \"strip\"\nduration = 1.0\ngravity = [0.0, {gravity:?}, 0.0]\n[[cloth]]\nname = \"sheet\"\nshape = {{ sheet = {{ size = [0.2, 0.04], cells = [20, 4], diagonals = \"alternating\" }} }}\nbending = \"{law}\"\nmaterial = {{ area_density = 0.1, stretch = 500.0, bend = 3.0e-3 }}\ndamping = {{ mass = 4.0, stiffness = 0.002 }}\n{pins}"
    )
}

const LAWS: [&str; 2] = ["edge-spring", "discrete-shell"];

/// Without weight, a strip whose clamp is turned by 90° and moved rests as it was, turned and moved.
#[test]
fn a_turned_clamp_turns_the_tangent() {
    let keys = "clamp = true\nmotion = { keyframes = [{ t = 0.0 }, { t = 0.3, translate = [0.0, 0.1, 0.0], rotate = [0.0, 0.0, 90.0] }] }";
    for law in LAWS {
        let mut run = run(
            &strip(law, 0.0, &pin("edge = \"left\"", keys)),
            IMPLICIT,
            0.002,
        );
        let starts = run.state().positions.clone();
        run_to(&mut run, 0.5);
        let mut state = run.state().clone();
        let rest = settle(run.model(), &mut state, 1e-10);
        assert!(rest.found, "{law}: {rest:?}");
        let center = DVec3::new(-0.1, 0.0, 0.0);
        let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        for (x, start) in state.positions.iter().zip(&starts) {
            let expected = center + DVec3::Y * 0.1 + turn * (*start - center);
            assert!(
                (*x - expected).length() < 1e-7,
                "{law}: {x}, not {expected}"
            );
        }
    }
}

/// A clamp that is released while another pin keeps the edge: the strip hangs straight down from it.
/// Before, it left the clamp along x.
#[test]
fn a_released_clamp_lets_the_strip_hang() {
    let left = "edge = \"left\"";
    let pins = pin(left, "clamp = true\nrelease = 0.2") + &pin(left, "");
    for law in LAWS {
        let mut run = run(&strip(law, -9.81, &pins), IMPLICIT, 0.002);
        let starts = run.state().positions.clone();
        let hanging = |run: &Simulation| {
            let mut state = run.state().clone();
            let rest = settle(run.model(), &mut state, 1e-9);
            assert!(rest.found, "{law}: {rest:?}");
            state.positions
        };
        run_to(&mut run, 0.2);
        let tip = (0..starts.len()).find(|&i| starts[i].x > 0.099).unwrap();
        let clamped = hanging(&run);
        assert!(clamped[tip].x > 0.0, "{law}: {}", clamped[tip]);
        run_to(&mut run, 1.0);
        assert!(run.state().positions[tip].y < -0.1, "{law}: still up");
        let free = hanging(&run);
        for i in 0..run.model().cloth_particles() {
            let (x, s) = (free[i], starts[i]);
            assert!((x.x + 0.1).abs() < 1e-6, "{law}: {x} isn't below the edge");
            assert!((x.y + s.x + 0.1).abs() < 0.02 * 0.2, "{law}: {x} from {s}");
        }
    }
}

/// A clamp inside a cloth, released: the hinges across it bend again as all others do, so that the sheet
/// is the one that was never clamped.
#[test]
fn a_clamp_inside_a_cloth_leaves_no_trace() {
    let row = "vertices = [2, 7, 12, 17, 22]";
    for law in LAWS {
        let of = |pins: &str| {
            let text = sheet("stiffness = 0.002", pins).replace("discrete-shell", law);
            run(&text, Integrator::Verlet, 1e-3)
        };
        let mut clamped = of(&pin(row, "clamp = true\nrelease = 0.01"));
        let free = of("");
        assert!(clamped.model().particles() > free.model().particles());
        run_to(&mut clamped, 0.011);
        let [a, b] = [&clamped, &free].map(|run| {
            let n = run.model().cloth_particles();
            let mut state = run
                .model()
                .masses
                .iter()
                .map(|_| DVec3::ZERO)
                .collect::<Vec<_>>();
            for (i, x) in free.state().positions.iter().enumerate() {
                state[i] =
                    *x + DVec3::Y * (0.05 * (7.0 * x.x + 0.6).sin() * (5.0 * x.z + 1.0).cos());
            }
            let state = muslin::state::State::at_rest(state);
            let mut forces = vec![DVec3::ZERO; run.model().particles()];
            for force in run.model().forces() {
                force.add_forces(&state, &mut forces);
            }
            forces.truncate(n);
            forces
        });
        let scale = b.iter().map(|f| f.length()).fold(0.0, f64::max);
        for (a, b) in a.iter().zip(&b) {
            assert!((*a - *b).length() < 1e-13 * scale, "{law}: {a} against {b}");
        }
    }
}

/// Released in the middle of a translation, an unstrained sheet flies on as one: a parabola, or what each
/// scheme makes of it, with the velocity that it had.
#[test]
fn a_released_sheet_falls_freely() {
    let g = DVec3::Y * -9.81;
    let keys = "motion = { keyframes = [{ t = 0.0 }, { t = 0.4, translate = [0.4, 0.2, 0.0] }] }\nrelease = 0.2";
    let text = sheet("stiffness = 0.002", &pin(ALL, keys));
    let dt = 0.002;
    for scheme in schemes() {
        // Where a fall of τ ends: g τ (τ + late dt)/2.
        let late = match scheme {
            Integrator::Euler => -1.0,
            Integrator::Verlet
            | Integrator::Rk4
            | Integrator::Dopri5 { .. }
            | Integrator::ImplicitMidpoint(_) => 0.0,
            Integrator::Bdf2(_) => continue, // between: what it remembers is the pin's way
            _ => 1.0,
        };
        let mut run = run(&text, scheme, dt);
        let starts = run.state().positions.clone();
        let [way, rate] = smooth(0.5);
        let shift = DVec3::new(0.4, 0.2, 0.0);
        let velocity = shift * rate / 0.4;
        run_to(&mut run, 0.5);
        let tau: f64 = 0.3;
        for (i, start) in starts.iter().enumerate() {
            let fall = g * (0.5 * tau * (tau + late * dt));
            let expected = *start + shift * way + velocity * tau + fall;
            let (x, v) = (run.state().positions[i], run.state().velocities[i]);
            let name = scheme.name();
            assert!(
                (x - expected).length() < 1e-11,
                "{name}: {x}, not {expected}"
            );
            assert!((v - velocity - g * tau).length() < 1e-10, "{name}: {v}");
        }
        let by_itself = run.balance().dissipated_by(SCHEME);
        let mass: f64 = run.model().masses.iter().sum();
        let lost = 0.5 * mass * g.length_squared() * tau * late * dt;
        assert!(
            (by_itself - lost).abs() < 1e-10,
            "{}: {by_itself} J, not {lost} J",
            scheme.name()
        );
    }
}

/// A particle of two pins is free when both have let go.
#[test]
fn the_last_pin_counts() {
    let pins = pin(CORNERS, "release = 0.1") + &pin("corner = [\"left-near\"]", "release = 0.3");
    let mut run = run(&sheet(DAMPED, &pins), Integrator::SymplecticEuler, 0.001);
    let pinned = |run: &Simulation| (0..25).filter(|&i| run.model().is_pinned(i)).count();
    for (until, expected) in [(0.1, 2), (0.101, 1), (0.3, 1), (0.301, 0)] {
        run_to(&mut run, until);
        assert_eq!(pinned(&run), expected, "at {until} s");
    }
}

/// Shaken by one edge and undamped, a sheet gains what the pins put in, within 1 %; with damping, a
/// clamp and a release, what is left is too. All in steps so fine that the scheme itself takes nothing.
#[test]
fn pins_put_in_the_energy_that_the_sheet_gains() {
    let keys = "motion = { keyframes = [{ t = 0.0 }, { t = 0.1, translate = [0.03, 0.06, 0.0] }, { t = 0.2, translate = [0.0, -0.05, 0.02], rotate = [0.0, 0.0, 30.0] }, { t = 0.3 }] }";
    for (damping, more) in [
        ("", "clamp = false"),
        (DAMPED, "clamp = true"),
        (DAMPED, "clamp = true\nrelease = 0.15"),
    ] {
        let text = sheet(damping, &pin("edge = \"left\"", &format!("{more}\n{keys}")));
        let mut run = run(&text, Integrator::Rk4, 1e-4);
        let mut largest = 0.0_f64;
        while run.stats().steps < 4000 {
            run.step().unwrap();
            let balance = run.balance();
            let work = balance.work[0].1;
            largest = largest.max(work.abs());
            let by_itself = balance.dissipated_by(SCHEME);
            assert!(
                by_itself.abs() < 0.01 * largest + 1e-9,
                "{by_itself} J of {work} J at {} s",
                run.state().time
            );
        }
        let gained = Energies::of(run.model(), run.state()).total() - run.ledger().initial;
        println!(
            "work {:?} J, gained {gained} J, most {largest} J",
            run.ledger().work
        );
    }
}

/// A mass on a spring whose other end is moved by A s² (3 − 2 s), s = t/T: with b the way of the base,
/// u″ = ω² (b − u) has u = b − b″/ω² + (b₀″/ω²) cos ωt + (b₀‴/ω³) sin ωt. The work is what mass, base and
/// spring have.
#[test]
fn base_excitation_is_that_of_closed_form() {
    let (span, reach, stretch, density) = (0.5, 0.02, 3.0, 0.2);
    let text = format!(
        "name = \"base\"\nduration = 1.0\ngravity = [0.0, 0.0, 0.0]\n[[cloth]]\nname = \"sheet\"\nshape = {{ chain = {{ length = 1.0, links = 1 }} }}\nmaterial = {{ linear_density = {density}, stretch = {stretch:?} }}\n[[pin]]\ncloth = \"sheet\"\nselect = {{ corner = [\"left\"] }}\nmotion = {{ keyframes = [{{ t = 0.0 }}, {{ t = {span}, translate = [{reach}, 0.0, 0.0] }}] }}\n"
    );
    let (mass, k) = (0.5 * density, stretch);
    let omega = f64::sqrt(k / mass);
    let exact = |t: f64| {
        let [way, rate] = smooth(t / span);
        let b = [reach * way, reach * rate / span];
        let (third, second_0) = (-12.0 * reach / span.powi(3), 6.0 * reach / span.powi(2));
        let second = second_0 + third * t;
        let (sine, cosine) = (omega * t).sin_cos();
        let (c, d) = (second_0 / omega.powi(2), third / omega.powi(3));
        let u = b[0] - second / omega.powi(2) + c * cosine + d * sine;
        let du = b[1] - third / omega.powi(2) + omega * (d * cosine - c * sine);
        let work = 0.5 * mass * (du * du + b[1] * b[1]) + 0.5 * k * (u - b[0]).powi(2);
        (u, du, work)
    };
    for (scheme, dt, order) in [
        (Integrator::Rk4, 1e-3, 4),
        (Integrator::Verlet, 1e-3, 2),
        (Integrator::SymplecticEuler, 1e-4, 1),
        (IMPLICIT, 1e-4, 1),
    ] {
        let tolerance = (omega * dt).powi(order);
        let mut run = run(&text, scheme, dt);
        let start = run.state().positions[1].x;
        for until in [0.1, 0.25, 0.4] {
            run_to(&mut run, until);
            let (u, du, work) = exact(until);
            let (x, v) = (
                run.state().positions[1].x - start,
                run.state().velocities[1].x,
            );
            let name = scheme.name();
            assert!(
                (x - u).abs() < tolerance * reach,
                "{name}, {until} s: {x}, not {u}"
            );
            assert!(
                (v - du).abs() < tolerance * reach * omega,
                "{name}, {until} s: {v}, not {du}"
            );
            // The trapezoid of the work is of second order, whatever the scheme.
            let done = run.ledger().work[0].1;
            let off = (done / work - 1.0).abs();
            println!("{name} at {until} s: work {done:.6e} J, exact {work:.6e} J");
            assert!(
                off < tolerance.max((omega * dt).powi(2)),
                "{name}, {until} s: {done}, not {work}"
            );
        }
    }
}

/// A run that is taken up at a release goes on as the whole one does: nothing of what was held lives on in
/// a scheme's arrays. With the same bits where a step starts from the state alone; else within what a solve,
/// a tolerance or bdf2's first step leaves open.
#[test]
fn a_release_leaves_nothing_behind() {
    let pins = pin("edge = \"left\"", "clamp = true\nrelease = 0.05") + &pin(CORNERS, "");
    let text = sheet(DAMPED, &pins);
    for scheme in schemes() {
        let mut whole = run(&text, scheme, 1e-3);
        run_to(&mut whole, 0.05);
        let built = scene::build(&written("release", &text)).unwrap();
        let mut taken_up = Simulation::new(built.model, whole.state().clone(), scheme, 1e-3);
        assert_eq!(taken_up.model().released(), 1);
        for _ in 0..20 {
            whole.step().unwrap();
            taken_up.step().unwrap();
        }
        let [a, b] = [&whole, &taken_up].map(Simulation::state);
        let far = distance(&a.positions, &b.positions) + distance(&a.velocities, &b.velocities);
        // Nonlinear solves start from the last step's change, and end where their residual is small, and
        // dopri5 begins with the step that did last: 1e-13 and 1.3e-11 seen. bdf2 takes one step of first
        // order where it is taken up, which is 2.0e-3 off after it (m + m/s).
        let most = match scheme {
            Integrator::Newton(_) | Integrator::ImplicitMidpoint(_) => 1e-11,
            Integrator::Dopri5 { .. } => 1e-9,
            Integrator::Bdf2(_) => 3e-3,
            _ => 0.0,
        };
        let name = scheme.name();
        assert!(far <= most, "{name}: {far}");
    }
}

/// What will be released counts for the stable step from the start.
#[test]
fn forecasts_foresee_the_release() {
    let omega = |pins: &str| {
        let run = run(&sheet("", pins), Integrator::Verlet, 1e-3);
        forecast(run.model(), run.state()).modes[0].omega
    };
    let free = omega("");
    assert_eq!(omega(&pin(ALL, "release = 0.5")), free);
    assert!(omega(&pin(ALL, "")) < free);
}

/// Frames show released pins no more; the model's list names what moves and what lets go.
#[test]
fn frames_and_lists_follow_the_pins() {
    let keys = format!("{SWING}\nrelease = 0.02");
    let text = sheet(
        DAMPED,
        &(pin(CORNERS, &keys) + &pin("corner = [\"left-far\"]", "")),
    );
    let loaded = written("frames", &text);
    let built = scene::build(&loaded).unwrap();
    let mut run = Simulation::new(built.model, built.state, Integrator::Verlet, 1e-3);
    let (mut capture, header) = Capture::new(&loaded, &run);
    let list = &header.model_list;
    assert!(
        list.contains("- pin 0 of sheet: moves until it is released at 0.02 s\n"),
        "{list}"
    );
    assert!(!list.contains("pin 1"), "{list}");
    assert!(
        header
            .series
            .iter()
            .any(|series| series.path == "energy/work_by_pins")
    );
    for (until, expected) in [(0.02, 3), (0.021, 1)] {
        run_to(&mut run, until);
        let frame = capture.frame(&run, Vec::new(), false);
        let cloth = &frame.cloths[0];
        assert_eq!(cloth.pins.is_some(), expected < 3);
        let shown: Vec<[f32; 3]> = cloth.pin_positions(&header.cloths[0]).collect();
        let pinned = (0..25).filter(|&i| run.model().is_pinned(i));
        let places: Vec<[f32; 3]> = pinned
            .map(|i| run.state().positions[i].as_vec3().to_array())
            .collect();
        assert_eq!(shown, places);
        assert_eq!(shown.len(), expected, "at {until} s");
    }
}

/// Why a scene with these pins can't be built.
fn fault(pins: &str) -> String {
    let path = crate::support::fresh_folder("bad-pin").join("scene.toml");
    std::fs::write(&path, sheet(DAMPED, pins)).unwrap();
    let built = scene::load(&path.display().to_string(), &[])
        .and_then(|loaded| scene::build(&loaded).map(|_| ()));
    built.unwrap_err().to_string()
}

#[test]
fn bad_pins_are_explained() {
    let keyframes = |keys: &str| format!("motion = {{ keyframes = [{keys}] }}");
    for (keys, words) in [
        (keyframes(""), ["pin.0.motion.keyframes", "at least one"]),
        (
            keyframes("{ t = 0.0 }, { t = 0.0 }"),
            ["pin.0.motion.keyframes.1.t", "order of time"],
        ),
        (
            keyframes("{ t = 1.0 }, { t = 0.5 }"),
            ["pin.0.motion.keyframes.1.t", "order of time"],
        ),
        (
            keyframes("{ t = -1.0 }"),
            ["pin.0.motion.keyframes.0.t", "0 or more"],
        ),
        (
            keyframes("{ t = inf }"),
            ["pin.0.motion.keyframes.0.t", "finite"],
        ),
        (
            keyframes("{ t = 0.0, rotate = [0.0, nan, 0.0] }"),
            ["pin.0.motion.keyframes.0.rotate", "finite"],
        ),
        (
            keyframes("{ t = 0.0, turn = [0.0, 0.0, 0.0] }"),
            ["turn", "unknown"],
        ),
        ("motion = { }".into(), ["keyframes", "missing"]),
        (
            "motion = { keyframes = [{ t = 0.0 }], speed = 1.0 }".into(),
            ["speed", "unknown"],
        ),
        ("release = 0.0".into(), ["pin.0.release", "above 0"]),
        ("release = nan".into(), ["pin.0.release", "finite"]),
    ] {
        let error = fault(&pin(CORNERS, &keys));
        for word in words {
            assert!(error.contains(word), "{keys}: \"{word}\" isn't in: {error}");
        }
    }
}

/// A particle has one motion: the same turn about another centre is another one, the same translation
/// isn't.
#[test]
fn two_motions_of_a_particle_are_refused() {
    let other = SWING.replace("0.05", "0.06");
    for (second, key) in [
        (other.as_str(), "pin.1.motion"),
        ("release = 0.1", "pin.1.select"),
        (SWING, "pin.1.motion"),
    ] {
        let error = fault(&(pin(CORNERS, SWING) + &pin("corner = [\"left-near\"]", second)));
        for word in [key, "vertex 0 is held by pin 0 too", "give both the same"] {
            assert!(
                error.contains(word),
                "{second}: \"{word}\" isn't in: {error}"
            );
        }
    }
    let shift = "motion = { keyframes = [{ t = 0.0 }, { t = 0.4, translate = [0.1, 0.0, 0.0] }] }";
    let pins = pin(CORNERS, shift) + &pin("corner = [\"left-near\"]", shift);
    let shared = run(&sheet(DAMPED, &pins), Integrator::Verlet, 1e-3);
    assert_eq!(shared.model().driven().count(), 2);
}
