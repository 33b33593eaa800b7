//! Where energy goes: every cause against a closed form, and the remainder for every scheme.

use crate::support::{IMPLICIT, PROJECTIVE, SCHEMES, SOLVED, XPBD, load, named, run_to, written};
use glam::DVec3;
use muslin::energy::{Balance, CONTACT, FRICTION, SCHEME, STRAIN_LIMIT};
use muslin::integrator::Integrator;
use muslin::scene::{self, LoadedScene};
use muslin::simulation::{Simulation, forecast};

const MIDPOINT: Integrator = Integrator::ImplicitMidpoint(SOLVED);

fn run(loaded: &LoadedScene, scheme: Integrator, dt: f64) -> Simulation {
    let built = scene::build(loaded).unwrap_or_else(|error| panic!("{error}"));
    Simulation::new(built.model, built.state, scheme, dt)
}

/// Mass (kg), spring (N/m) and speed at the start (m/s) of [`oscillator`]: a period of 1 s.
const MASS: f64 = 0.1;
const SPRING: f64 = MASS * 4.0 * std::f64::consts::PI * std::f64::consts::PI;
const SPEED: f64 = 1.0;

/// A mass on a spring, thrown along it.
fn oscillator(damping: &str) -> LoadedScene {
    let density = 2.0 * MASS;
    let text = format!(
        "name = \"oscillator\"\nduration = 1.0\ngravity = [0.0, 0.0, 0.0]\n[[cloth]]\nname = \"mass\"\n\
         shape = {{ chain = {{ length = 1.0, links = 1 }} }}\nstart = {{ velocity = [{SPEED}, 0.0, 0.0] }}\n\
         material = {{ linear_density = {density:?}, stretch = {SPRING:?} }}\ndamping = {{ {damping} }}\n\
         [[pin]]\ncloth = \"mass\"\nselect = {{ corner = [\"left\"] }}\n"
    );
    written("oscillator", &text)
}

/// Implicit Euler takes ½ Δv · M Δv + ½ Δx · K Δx from a linear oscillator in each step.
#[test]
fn implicit_euler_takes_what_its_formula_says() {
    let loaded = oscillator("");
    for scheme in [IMPLICIT, Integrator::Newton(SOLVED), PROJECTIVE] {
        let mut run = run(&loaded, scheme, 0.01);
        let mut expected = 0.0;
        for _ in 0..100 {
            let before = run.state().clone();
            run.step().unwrap();
            let [x, v] = [
                run.state().positions[1] - before.positions[1],
                run.state().velocities[1] - before.velocities[1],
            ];
            expected += 0.5 * MASS * v.length_squared() + 0.5 * SPRING * x.length_squared();
            let taken = run.balance().dissipated_by(SCHEME);
            assert!(
                (taken - expected).abs() < 1e-6 * expected,
                "{}: {taken} J, not {expected} J",
                scheme.name()
            );
        }
        assert!(expected > 0.01, "the formula says next to nothing");
    }
}

/// What keeps the energy in the mean has taken none after whole periods; what the masses and the spring
/// exchange in each is four times the energy that there is.
#[test]
fn an_undamped_swing_exchanges_its_energy_four_times_a_period_and_loses_none() {
    let whole = 0.5 * MASS * SPEED * SPEED;
    for (scheme, tolerance) in [
        // Verlet's period is shorter by (ω dt)²/24, which leaves it no more than that off its start.
        (Integrator::Verlet, 1e-6),
        (Integrator::Rk4, 1e-6),
        (MIDPOINT, 1e-8),
    ] {
        let mut run = run(&oscillator(""), scheme, 1.0 / 1200.0);
        run_to(&mut run, 3.0);
        let balance = run.balance();
        let name = scheme.name();
        let taken = balance.dissipated_by(SCHEME) / whole;
        assert!(taken.abs() < tolerance, "{name} took {taken} of it");
        let exchanged = balance.exchanged / (12.0 * whole);
        assert!((exchanged - 1.0).abs() < 1e-3, "{name}: {exchanged}");
    }
}

/// What two dampings take of a swing, against ∫ c m v² dt and ∫ τ k v² dt of the exact motion
/// v = v₀ e^(−γt) (cos βt − γ/β sin βt), γ = (c + τ k/m)/2, β² = ω² − γ²: at second order.
#[test]
fn dampings_take_what_the_closed_form_says() {
    let (c, tau, end) = (0.8, 0.05, 0.7);
    let gamma = 0.5 * (c + tau * SPRING / MASS);
    let beta = f64::sqrt(SPRING / MASS - gamma * gamma);
    let square = |t: f64| {
        let (sine, cosine) = (beta * t).sin_cos();
        (SPEED * (-gamma * t).exp() * (cosine - gamma / beta * sine)).powi(2)
    };
    let pieces = 10_000; // Simpson's rule: far below what is asked for
    let width = end / f64::from(pieces);
    let weight = |k: i32| match k {
        0 => 1.0,
        k if k == pieces => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let each = (0..=pieces).map(|k| weight(k) * square(f64::from(k) * width));
    let integral = each.sum::<f64>() * width / 3.0;
    let exact = [c * MASS, tau * SPRING].map(|damping| damping * integral);
    let loaded = oscillator(&format!("mass = {c}, stiffness = {tau}"));
    for scheme in [
        Integrator::Verlet,
        Integrator::Rk4,
        MIDPOINT,
        Integrator::Dopri5 { tolerance: 1e-6 },
    ] {
        let errors = [0.01, 0.005, 0.0025].map(|dt| {
            let mut run = run(&loaded, scheme, dt);
            run_to(&mut run, end);
            let balance = run.balance();
            let taken =
                ["mass_damping", "stiffness_damping"].map(|name| balance.dissipated_by(name));
            assert!((taken[0] / exact[0] - taken[1] / exact[1]).abs() < 1e-9);
            (taken[1] / exact[1] - 1.0).abs()
        });
        println!("{}: {errors:?}", scheme.name());
        // dopri5 takes steps of its own: its error is that of its tolerance.
        let own = matches!(scheme, Integrator::Dopri5 { .. });
        let falls = errors.windows(2).all(|e| e[1] < 0.3 * e[0]);
        assert!(errors[0] < 0.02, "{}: {errors:?}", scheme.name());
        assert!(own || falls, "{}: {errors:?}", scheme.name());
    }
}

/// Drag alone: f · (x₁ − x₀) explains all loss but ½ m |Δv|² a step, which the Euler schemes take, or add,
/// by themselves; at any step.
#[test]
fn drag_alone_explains_all_loss() {
    let text = "name = \"flight\"\nduration = 1.0\ngravity = [0.0, 0.0, 0.0]\n[[cloth]]\nname = \"sheet\"\n\
        shape = { sheet = { size = [1.0, 1.0], cells = [4, 4] } }\nstart = { velocity = [1.0, 0.0, 0.0] }\n\
        material = { area_density = 0.2, stretch = 10.0 }\ndamping = { mass = 5.0 }\n";
    let loaded = written("flight", text);
    for (scheme, sign) in [
        (Integrator::Euler, -1.0),
        (Integrator::SymplecticEuler, 1.0),
        (MIDPOINT, 0.0),
        (IMPLICIT, 1.0),
        (Integrator::Newton(SOLVED), 1.0),
        (PROJECTIVE, 1.0),
    ] {
        let mut run = run(&loaded, scheme, 0.05);
        let mut own = 0.0;
        for _ in 0..10 {
            let before = run.state().velocities[0];
            run.step().unwrap();
            own += sign * 0.1 * run.state().velocities[0].distance_squared(before);
        }
        let balance = run.balance();
        let lost = 0.1 - balance.energies.kinetic;
        let [drag, by_itself] = ["mass_damping", SCHEME].map(|cause| balance.dissipated_by(cause));
        let name = scheme.name();
        assert!(
            (drag + own - lost).abs() < 1e-7 * lost,
            "{name}: drag took {drag} J, and {own} J more, of {lost} J"
        );
        assert!(
            (by_itself - own).abs() < 1e-7 * lost,
            "{name}: {by_itself} J, not {own} J"
        );
    }
}

const PLATE: &str = "v -9 -1 -9\nv 9 -1 -9\nv 9 0 -9\nv -9 0 -9\nv -9 -1 9\nv 9 -1 9\nv 9 0 9\nv -9 0 9\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A sheet of 0.3 m × 0.3 m over a large plate, both turned by some degrees about z.
fn over_a_plate(degrees: f64, friction: f64, gravity: f64, start: &str) -> LoadedScene {
    let folder = crate::support::fresh_folder("plate");
    std::fs::write(folder.join("plate.obj"), PLATE).unwrap();
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let at = [-0.003 * sine, 0.003 * cosine];
    let text = format!(
        "name = \"plate\"\nduration = 1.0\ngravity = [0.0, {gravity:?}, 0.0]\n\
         [[cloth]]\nname = \"sheet\"\nrotate = [0.0, 0.0, {degrees:?}]\ntranslate = [{:?}, {:?}, 0.0]\n\
         shape = {{ sheet = {{ size = [0.3, 0.3], cells = [10, 10] }} }}\n{start}\n\
         material = {{ area_density = 0.2, stretch = 200.0 }}\ndamping = {{ stiffness = 0.001 }}\n\
         [[obstacle]]\nname = \"plate\"\nshape = {{ obj = {{ path = \"plate.obj\" }} }}\n\
         rotate = [0.0, 0.0, {degrees:?}]\nfriction = {friction:?}\nthickness = 0.003\n",
        at[0], at[1]
    );
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).unwrap();
    load(&path.display().to_string(), &[])
}

/// The schemes with a step for a sheet on a plate; explicit Euler has none.
const ON_A_PLATE: [(Integrator, f64); 9] = [
    (MIDPOINT, 0.002),
    (Integrator::SymplecticEuler, 5e-5),
    (Integrator::Verlet, 5e-5),
    (Integrator::Rk4, 5e-5),
    (IMPLICIT, 0.002),
    (Integrator::Newton(SOLVED), 0.002),
    (Integrator::Bdf2(SOLVED), 0.002),
    (XPBD, 0.001),
    (PROJECTIVE, 0.002),
];

/// Friction takes μ m g cos θ for every metre that a sheet slides.
#[test]
fn friction_takes_its_force_times_the_way() {
    let (degrees, mu) = (36.0_f64, 0.5);
    let weight = 0.2 * 0.3 * 0.3 * 9.81 * degrees.to_radians().cos();
    for (scheme, dt) in ON_A_PLATE {
        let mut run = run(&over_a_plate(degrees, mu, -9.81, ""), scheme, dt);
        let center = |run: &Simulation| {
            run.state().positions.iter().sum::<DVec3>() / run.model().particles() as f64
        };
        run_to(&mut run, 0.2);
        let (start, before) = (center(&run), run.balance());
        run_to(&mut run, 0.6);
        let (way, after) = (center(&run).distance(start), run.balance());
        let taken = after.dissipated_by(FRICTION) - before.dissipated_by(FRICTION);
        let exact = mu * weight * way;
        // Answered after the step, it acts on the velocity then, and on what the particles fell.
        let tolerance = if scheme.has_contact_inside() {
            1e-6
        } else {
            0.01
        };
        let name = scheme.name();
        println!("{name}: {taken} J, closed form {exact} J over {way} m");
        assert!(
            (taken / exact - 1.0).abs() < tolerance,
            "{name}: {taken} J, not {exact} J"
        );
        assert!(after.unexplained() < 1e-9, "{name}: {after:?}");
    }
}

/// A sheet that lands flat loses the speed of its fall to contact, and μ times that of its glide to
/// friction, where that is answered after the step.
#[test]
fn an_impact_takes_the_energy_of_the_approach() {
    let (mass, mu) = (0.2 * 0.09, 0.4);
    for (scheme, dt) in ON_A_PLATE {
        let glide: f64 = if scheme.has_contact_inside() {
            0.0
        } else {
            3.0
        };
        let start = format!("start = {{ velocity = [{glide:?}, -1.0, 0.0] }}");
        let loaded = over_a_plate(0.0, mu, 0.0, &start);
        let mut built = scene::build(&loaded).unwrap();
        built.state.positions.iter_mut().for_each(|x| x.y += 0.05);
        let mut run = Simulation::new(built.model, built.state, scheme, dt);
        run_to(&mut run, 0.1);
        let balance = run.balance();
        let name = scheme.name();
        let [contact, friction] = [CONTACT, FRICTION].map(|cause| balance.dissipated_by(cause));
        let impact = 0.5 * mass;
        assert!(
            (contact / impact - 1.0).abs() < 1e-6,
            "{name}: {contact} J, not {impact} J"
        );
        // The approach of 1 m/s takes μ · 1 m/s off the glide.
        let kept = f64::max(glide - mu, 0.0);
        let rubbed = 0.5 * mass * (glide * glide - kept * kept);
        assert!(
            (friction - rubbed).abs() < 1e-6 * impact,
            "{name}: {friction} J, not {rubbed} J"
        );
        assert!(balance.unexplained() < 1e-9, "{name}: {balance:?}");
    }
}

/// A link that is 30 % too long is pulled back to its limit: the spring loses its energy between the two
/// lengths, and the ends gain the velocity of their way.
#[test]
fn a_strain_limit_takes_what_the_spring_loses_and_the_ends_do_not_gain() {
    let (rest, k, mass, dt) = (0.5, 40.0, 0.05, 0.01);
    let text = format!(
        "name = \"snap\"\nduration = 1.0\n[[cloth]]\nname = \"link\"\n\
         shape = {{ chain = {{ length = {rest:?}, links = 1 }} }}\nstart = {{ stretch = [1.3, 1.0, 1.0] }}\n\
         material = {{ linear_density = {:?}, stretch = {:?} }}\n[strain_limit]\nmax = 0.1\n",
        2.0 * mass / rest,
        k * rest
    );
    // The first step leaves the positions as they are, and gives the ends dt f/m.
    let mut run = run(&written("snap", &text), Integrator::Euler, dt);
    let before = run.state().positions.clone();
    run.step().unwrap();
    let way = run.state().positions[1] - before[1];
    assert!((way.length() - 0.1 * rest).abs() < 1e-4 * rest, "{way}");
    let pull = -DVec3::X * (k * 0.3 * rest / mass * dt);
    let fall = DVec3::Y * (-9.81 * dt);
    let kinetic = |v: DVec3| 2.0 * 0.5 * mass * v.length_squared();
    let gained = kinetic(pull + way / dt) - kinetic(pull);
    let left = 0.1 - 2.0 * (0.1 - way.length() / rest);
    let lost = 0.5 * k * rest * rest * (0.09 - left * left);
    let balance = run.balance();
    let taken = balance.dissipated_by(STRAIN_LIMIT);
    assert!(
        (taken - (lost - gained)).abs() < 1e-9 * gained,
        "{taken} J, not {lost} J less {gained} J"
    );
    assert!(balance.unexplained() < 1e-12, "{balance:?}");
    // Explicit Euler added the kinetic energy of its first velocities.
    let added = -balance.dissipated_by(SCHEME);
    let exact = kinetic(pull + fall);
    assert!(
        (added - exact).abs() < 1e-9 * exact,
        "{added} J, not {exact} J"
    );
}

/// A sheet that hangs by two corners, which swing and turn it.
fn swung(limit: &str) -> LoadedScene {
    let text = format!(
        "name = \"swung\"\nduration = 1.0\n[[cloth]]\nname = \"sheet\"\n\
         shape = {{ sheet = {{ size = [0.5, 0.5], cells = [6, 6], diagonals = \"both\" }} }}\nbending = \"discrete-shell\"\n\
         material = {{ area_density = 0.2, stretch = 50.0, bend = 1.0e-3 }}\ndamping = {{ mass = 0.5, stiffness = 0.002 }}\n\
         [[pin]]\ncloth = \"sheet\"\nselect = {{ corner = [\"left-near\", \"right-near\"] }}\n\
         motion = {{ keyframes = [{{ t = 0.0 }}, {{ t = 0.3, translate = [0.2, 0.1, -0.1], rotate = [20.0, 40.0, -30.0] }}, {{ t = 0.5 }}] }}\n{limit}"
    );
    written("swung", &text)
}

/// A poncho of few springs that reach their limit, and that is thrown on the mannequin.
fn small_drape() -> LoadedScene {
    let changes = [
        "cloth.0.shape.sheet.cells=[16, 16]",
        "cloth.0.start.velocity=[0.0, -2.0, 0.0]",
        "strain_limit.max=0.01",
    ];
    load("drape", &changes)
}

/// A step (s) that a scheme can take on a scene.
fn step_for(loaded: &LoadedScene, name: &str) -> f64 {
    let scheme = named(name);
    let built = scene::build(loaded).unwrap();
    if !scheme.is_explicit() {
        return if name == "xpbd" { 1e-3 } else { 0.004 };
    }
    // Stretched springs under a moving cloth are stiffer than at rest.
    let stable = forecast(&built.model, &built.state).stable_dt(scheme);
    (0.4 * stable).min(2e-4)
}

/// Runs a scene for a while with every scheme.
fn balances(loaded: &LoadedScene, duration: f64) -> Vec<(&'static str, Balance)> {
    let with = |name: &'static str| {
        let mut run = run(loaded, named(name), step_for(loaded, name));
        run_to(&mut run, duration);
        (name, run.balance())
    };
    SCHEMES.map(with).into()
}

/// Below 1 % of the energy exchanged is what was promised; what is booked by stage is exact, so that what
/// remains is rounding.
#[test]
fn nothing_remains_unexplained_with_any_scheme() {
    let small = |cells: &str| load("hanging-cloth", &[cells]);
    for (scene, loaded, duration) in [
        ("drape", small_drape(), 0.15),
        (
            "hanging-cloth",
            small("cloth.0.shape.sheet.cells=[8, 8]"),
            0.4,
        ),
        ("swung", swung(""), 0.5),
        (
            "swung and limited",
            swung("[strain_limit]\nmax = 0.02\n"),
            0.5,
        ),
    ] {
        for (name, balance) in balances(&loaded, duration) {
            let Balance {
                residual,
                exchanged,
                ..
            } = &balance;
            println!(
                "{scene}, {name}: {residual:.1e} J of {exchanged:.3} J: {:.3?} {:.3?}",
                balance.dissipated, balance.work
            );
            assert!(
                *exchanged > 0.01,
                "{scene}, {name}: {exchanged} J exchanged"
            );
            assert!(
                balance.unexplained() < 1e-9,
                "{scene}, {name}: {residual} J of {exchanged} J"
            );
            let causes: &[&str] = match scene {
                "drape" => &[
                    FRICTION,
                    CONTACT,
                    STRAIN_LIMIT,
                    "mass_damping",
                    "stiffness_damping",
                ],
                "swung and limited" => &[STRAIN_LIMIT],
                _ => &["mass_damping", "stiffness_damping"],
            };
            for cause in causes {
                assert!(
                    balance.dissipated_by(cause) != 0.0,
                    "{scene}, {name}: no {cause}"
                );
            }
        }
    }
}

/// The scheme's part tells what was forgotten within its stage: with schemes of second order and more it
/// is small beside what dampings and pins do.
#[test]
fn good_schemes_take_next_to_nothing_by_themselves() {
    let loaded = swung("");
    for name in ["verlet", "rk4", "dopri5", "implicit-midpoint", "bdf2"] {
        let dt = if name == "verlet" || name == "rk4" {
            1e-4
        } else {
            5e-4
        };
        let mut run = run(&loaded, named(name), dt);
        run_to(&mut run, 0.5);
        let balance = run.balance();
        let share = balance.dissipated_by(SCHEME) / balance.exchanged;
        println!("{name}: {share:.1e} of {} J", balance.exchanged);
        let damped = balance.dissipated_by("stiffness_damping") / balance.exchanged;
        assert!(damped > 0.01, "{name}: dampings took {damped}");
        assert!(share.abs() < 3e-3, "{name} took {share}");
    }
}

/// What is booked step by step, between stages that do nothing, is what the whole run shows.
#[test]
fn stages_add_up_to_the_whole() {
    for (loaded, staged) in [
        (swung(""), swung("[strain_limit]\nmax = 100.0\n")),
        (
            load("hanging-cloth", &["cloth.0.shape.sheet.cells=[8, 8]"]),
            load(
                "hanging-cloth",
                &["cloth.0.shape.sheet.cells=[8, 8]", "strain_limit.max=100"],
            ),
        ),
    ] {
        for name in SCHEMES {
            let dt = step_for(&loaded, name);
            let [whole, staged] = [&loaded, &staged].map(|loaded| {
                let mut run = run(loaded, named(name), dt);
                run_to(&mut run, 0.1);
                run.balance()
            });
            assert_eq!(whole.energies, staged.energies, "{name}");
            for (cause, joules) in &whole.dissipated {
                let other = staged.dissipated_by(cause);
                assert!(
                    (joules - other).abs() < 1e-9 * whole.exchanged,
                    "{name}, {cause}: {joules} J and {other} J"
                );
            }
            assert_eq!(staged.dissipated_by(STRAIN_LIMIT), 0.0);
        }
    }
}

/// The books have the same bits for any number of threads.
#[test]
fn books_are_the_same_for_any_number_of_threads() {
    let loaded = load(
        "drape",
        &[
            "cloth.0.shape.sheet.cells=[40, 40]",
            "strain_limit.max=0.01",
            "cloth.0.start.velocity=[0.0, -2.0, 0.0]",
        ],
    );
    for scheme in [named("implicit-euler"), named("xpbd")] {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| {
                let mut run = run(&loaded, scheme, 0.002);
                run_to(&mut run, 0.1);
                run.balance()
            })
        };
        let [one, two] = [1, 2].map(with);
        assert_eq!(one, two);
        assert!(
            one.dissipated_by(FRICTION) > 0.0 && one.dissipated_by(STRAIN_LIMIT) != 0.0,
            "{one:?}"
        );
    }
}
