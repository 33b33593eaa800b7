//! Continuous detection against exact arithmetic: millions of cases, most of them degenerate.
//!
//! Vertices on a grid of small integers that move to others: when they are coplanar, or collinear
//! where they always are coplanar, is an integer polynomial in time, whose roots are isolated exactly
//! in intervals of 2⁻³⁰. A contact exists exactly if the features touch at one of these, which shows
//! as a distance of less than 1e-7 at its ends, while detection is asked for a separation of 1e-3.

use glam::{DVec3, I64Vec3, dvec3};
use muslin::collision::impact::{Features, meeting};
use rayon::prelude::*;

/// Ticks of a step.
const STEP: i128 = 1 << 30;

/// Separation that detection is asked for, in cells of the grid.
const SEPARATION: f64 = 1e-3;

/// Four vertices at a step's start and end.
#[derive(Clone, Copy, Debug)]
struct Case {
    features: Features,
    start: [I64Vec3; 4],
    end: [I64Vec3; 4],
}

/// A polynomial in time: its coefficients, the constant first.
type Polynomial = [i128; 4];

impl Case {
    /// Where the vertices are after some ticks. Exact: 34 bits are enough.
    fn at(&self, tick: i128) -> [DVec3; 4] {
        std::array::from_fn(|i| {
            let place = |x0: i64, x1: i64| {
                let ticks = i128::from(x0) * (STEP - tick) + i128::from(x1) * tick;
                ticks as f64 / STEP as f64
            };
            let (x0, x1) = (self.start[i], self.end[i]);
            dvec3(place(x0.x, x1.x), place(x0.y, x1.y), place(x0.z, x1.z))
        })
    }

    /// The way from one vertex to another, as two coefficients of each coordinate.
    fn between(&self, i: usize, j: usize) -> [[i128; 2]; 3] {
        let start = (self.start[j] - self.start[i]).to_array();
        let end = (self.end[j] - self.end[i]).to_array();
        std::array::from_fn(|k| [start[k].into(), (end[k] - start[k]).into()])
    }

    /// What vanishes when features touch: the volume of the four vertices; where that is always 0, for
    /// each vertex and edge the area between them; where that is, too, the way from vertex to vertex.
    fn polynomials(&self) -> Vec<Polynomial> {
        let [u, v, w] = match self.features {
            Features::VertexFace => [self.between(1, 2), self.between(1, 3), self.between(1, 0)],
            Features::EdgeEdge => [self.between(0, 1), self.between(2, 3), self.between(0, 2)],
        };
        let area = cross(u, v);
        let volume: Polynomial = (0..3).fold([0; 4], |sum, k| add(sum, times(area[k], w[k])));
        if volume != [0; 4] {
            return vec![volume];
        }
        let pairs: &[(usize, usize, usize)] = match self.features {
            Features::VertexFace => &[(0, 1, 2), (0, 2, 3), (0, 3, 1)],
            Features::EdgeEdge => &[(0, 2, 3), (1, 2, 3), (2, 0, 1), (3, 0, 1)],
        };
        let mut all = Vec::new();
        for &(vertex, a, b) in pairs {
            all.extend(cross(self.between(a, b), self.between(a, vertex)));
            for end in [a, b] {
                all.extend(self.between(vertex, end).map(|[c, d]| [c, d, 0, 0]));
            }
        }
        all.retain(|polynomial| *polynomial != [0; 4]);
        all
    }

    /// The ticks at which a contact may exist, among them the ends of the interval around each root.
    fn critical(&self) -> Vec<i128> {
        let mut ticks = vec![0, STEP];
        for polynomial in self.polynomials() {
            ticks.extend(roots(&polynomial));
        }
        ticks.sort_unstable();
        ticks.dedup();
        ticks
    }
}

fn times(p: Polynomial, [c, d]: [i128; 2]) -> Polynomial {
    assert!(p[3] == 0 || d == 0);
    std::array::from_fn(|k| p[k] * c + if k > 0 { p[k - 1] * d } else { 0 })
}

fn add(p: Polynomial, q: Polynomial) -> Polynomial {
    std::array::from_fn(|k| p[k] + q[k])
}

fn cross(u: [[i128; 2]; 3], v: [[i128; 2]; 3]) -> [Polynomial; 3] {
    let product = |[a, b]: [i128; 2], factor| times([a, b, 0, 0], factor);
    let component = |i: usize, j: usize| {
        let back = product(u[j], v[i]);
        add(product(u[i], v[j]), back.map(|c| -c))
    };
    [component(1, 2), component(2, 0), component(0, 1)]
}

/// 2⁹⁰ p(tick / 2³⁰), exactly.
fn value(p: &Polynomial, tick: i128) -> i128 {
    ((p[3] * tick + p[2] * STEP) * tick + p[1] * STEP * STEP) * tick + p[0] * STEP * STEP * STEP
}

/// For each root in the step the two ticks around it, perhaps others: between roots of the derivative
/// a polynomial has one root at most.
fn roots(p: &Polynomial) -> Vec<i128> {
    let derivative = [p[1], 2 * p[2], 3 * p[3], 0];
    let mut ends = vec![0, STEP];
    if derivative != [0; 4] {
        ends.extend(roots(&derivative));
    }
    ends.sort_unstable();
    ends.dedup();
    let mut found = ends.clone();
    for pair in ends.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        let sign = value(p, low).signum();
        if sign * value(p, high).signum() > 0 {
            continue;
        }
        while high - low > 1 {
            let middle = (low + high) / 2;
            if value(p, middle).signum() == sign {
                low = middle;
            } else {
                high = middle;
            }
        }
        found.extend([low, high]);
    }
    found
}

/// Distance of two features: the least of all pairs of their parts that are closest inside.
fn distance(features: Features, [a, b, c, d]: [DVec3; 4]) -> f64 {
    let vertex_edge = |p: DVec3, a: DVec3, b: DVec3| {
        let along = (p - a).dot(b - a) / (b - a).length_squared();
        let inner = if along > 0.0 && along < 1.0 {
            a + (b - a) * along
        } else {
            a
        };
        (p - inner)
            .length()
            .min((p - a).length())
            .min((p - b).length())
    };
    // Cramer's rule for the point where the common perpendicular meets both.
    let (least, u, v, w) = match features {
        Features::VertexFace => (
            vertex_edge(a, b, c)
                .min(vertex_edge(a, c, d))
                .min(vertex_edge(a, d, b)),
            c - b,
            d - b,
            a - b,
        ),
        Features::EdgeEdge => (
            (vertex_edge(a, c, d).min(vertex_edge(b, c, d)))
                .min(vertex_edge(c, a, b).min(vertex_edge(d, a, b))),
            b - a,
            c - d,
            c - a,
        ),
    };
    let normal = u.cross(v);
    let square = normal.length_squared();
    let [s, t] = [
        w.cross(v).dot(normal) / square,
        u.cross(w).dot(normal) / square,
    ];
    let inside = match features {
        Features::VertexFace => s >= 0.0 && t >= 0.0 && s + t <= 1.0,
        Features::EdgeEdge => (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t),
    };
    if inside {
        least.min((w - u * s - v * t).length())
    } else {
        least
    }
}

/// Pseudo-random numbers (splitmix64, Steele, Lea and Flood 2014).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to `most`.
    fn upto(&mut self, most: i64) -> i64 {
        (self.next() % (most as u64 + 1)).cast_signed()
    }

    fn point(&mut self, most: i64) -> I64Vec3 {
        I64Vec3::new(self.upto(most), self.upto(most), self.upto(most))
    }

    /// From −1 to 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        dvec3(self.share(), self.share(), self.share())
    }
}

/// The kinds of cases. Small grids make every coincidence frequent; the rest is made on purpose.
const KINDS: [&str; 11] = [
    "random",
    "crowded",
    "at rest",
    "all move alike",
    "in a plane",
    "on a line",
    "degenerate feature",
    "parallel",
    "touching at the start",
    "touching at the end",
    "sliding",
];

fn case(features: Features, kind: usize, numbers: &mut Numbers) -> Case {
    let size = [7, 1, 2, 2, 3, 4, 3, 3, 3, 3, 3][kind];
    let mut start: [I64Vec3; 4] = std::array::from_fn(|_| numbers.point(size));
    let mut end: [I64Vec3; 4] = std::array::from_fn(|_| numbers.point(size));
    let touch = |x: &mut [I64Vec3; 4], numbers: &mut Numbers| match numbers.upto(2) {
        0 => x[0] = x[2],
        1 => x[0] = x[2] * 2 - x[3],
        _ => x[0] = x[3] + x[1] - x[2],
    };
    match kind {
        2 => end = start,
        3 => {
            let way = numbers.point(5);
            end = start.map(|x| x + way);
            end[0] += numbers.point(1);
        }
        4 => (0..4).for_each(|i| (start[i].z, end[i].z) = (1, 1)),
        5 => (0..4).for_each(|i| {
            (start[i], end[i]) = (I64Vec3::splat(start[i].x), I64Vec3::splat(end[i].x));
        }),
        6 => {
            let from = numbers.upto(1) as usize * 2;
            start[from + 1] = start[from];
            if numbers.upto(1) == 0 {
                end[from + 1] = end[from];
            }
        }
        7 => {
            start[3] = start[2] + start[1] - start[0];
            end[3] = end[2] + end[1] - end[0];
        }
        8 => touch(&mut start, numbers),
        9 => touch(&mut end, numbers),
        10 => {
            // The first vertex runs along the edge of the third and the fourth, or past its end.
            let along = start[3] - start[2];
            start[0] = start[2] - along * numbers.upto(2);
            end = start;
            end[0] = start[2] + along * numbers.upto(2);
        }
        _ => {}
    }
    Case {
        features,
        start,
        end,
    }
}

/// What the cases of one kind came to.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    cases: u32,
    touching: u32,
    met: u32,
}

fn check(case: &Case, count: &mut Count) {
    let found = meeting(
        case.features,
        case.at(0),
        case.at(STEP),
        SEPARATION,
        0.25 * SEPARATION,
    );
    count.cases += 1;
    count.met += u32::from(found.is_some());
    let ticks = case.critical();
    // Exact contacts, and besides any time at which the features are closer than the separation.
    let between = (1..8).map(|i| STEP * i / 8);
    let too_close = |&tick: &i128| distance(case.features, case.at(tick)) < 0.99 * SEPARATION;
    let touch = ticks.into_iter().find(too_close);
    count.touching += u32::from(touch.is_some());
    let first = touch
        .into_iter()
        .chain(between.filter(|tick| too_close(tick)))
        .min();
    if let Some(tick) = first {
        let time = tick as f64 / STEP as f64;
        let found = found.unwrap_or_else(|| panic!("missed at {time}: {case:?}"));
        assert!(found.time <= time, "{found:?} later than {time}: {case:?}");
    }
    if let Some(found) = found {
        let now = |i: usize| {
            let (x0, x1) = (case.start[i].as_dvec3(), case.end[i].as_dvec3());
            x0 + (x1 - x0) * found.time
        };
        let distance = distance(case.features, std::array::from_fn(now));
        assert!(
            distance < 2.0 * SEPARATION,
            "{found:?} at distance {distance}: {case:?}"
        );
    }
}

/// Counts of cases by kind; panics at the first miss, and at a meeting of features that are apart.
#[test]
fn nothing_is_missed_on_a_million_degenerate_cases() {
    for features in [Features::VertexFace, Features::EdgeEdge] {
        for (kind, name) in KINDS.iter().enumerate() {
            let parts = (0..50_u64).into_par_iter().map(|part| {
                let mut numbers = Numbers(part << 32 | (kind as u64) << 8 | features as u64);
                let mut count = Count::default();
                for _ in 0..1200 {
                    check(&case(features, kind, &mut numbers), &mut count);
                }
                count
            });
            let count = parts.reduce(Count::default, |a, b| Count {
                cases: a.cases + b.cases,
                touching: a.touching + b.touching,
                met: a.met + b.met,
            });
            println!("{features:?}, {name}: {count:?}");
            assert!(count.touching > 500, "{features:?}, {name}: {count:?}");
        }
    }
}

/// Vertices in f64, sizes from a micrometre to a kilometre, that come as close as a known distance at a
/// known time: made from the end backwards, and the distance then taken in exact arithmetic.
#[test]
fn nothing_is_missed_on_half_a_million_nearly_degenerate_cases() {
    let parts = (0..50_u64).into_par_iter().map(|part| {
        let mut numbers = Numbers(part + 1);
        let mut met = 0;
        for _ in 0..10_000 {
            let features = [Features::VertexFace, Features::EdgeEdge][numbers.upto(1) as usize];
            met += u32::from(near_degenerate(features, &mut numbers));
        }
        met
    });
    let met: u32 = parts.sum();
    println!("{met} of 500000 came close");
    assert!(met > 300_000);
}

/// 2⁴⁰ units a metre: coordinates below 4 km are exact in f64, and so is what is made of them in i128.
const UNIT: f64 = (1_u64 << 40) as f64;

/// Makes a case and checks it. Also says whether its features came closer than the separation.
fn near_degenerate(features: Features, numbers: &mut Numbers) -> bool {
    let mut power = |least: i64, most: i64| {
        10_f64.powi(i32::try_from(least + numbers.upto(most - least)).unwrap())
    };
    let (size, thin, speed) = (power(-3, 0), power(-9, 0), power(-6, 1));
    let (place, separation, off) = (power(-1, 3), power(-5, -3), power(-9, 0));
    let shares = [numbers.upto(8), numbers.upto(8)].map(|share| share * (1 << 17));
    let whole = 1_i64 << 20;
    let weights = match features {
        Features::VertexFace => {
            let [s, t] = [shares[0].min(whole - shares[1]), shares[1]];
            [whole, s + t - whole, -s, -t]
        }
        Features::EdgeEdge => [whole - shares[0], shares[0], shares[1] - whole, -shares[1]],
    };
    let tick = numbers.upto(1 << 10);
    // Thin: nearly parallel or nearly without area.
    let centre = numbers.vector() * place;
    let (long, wide) = (numbers.vector() * size, numbers.vector() * size * thin);
    let mut x: [DVec3; 4] =
        std::array::from_fn(|_| centre + long * numbers.share() + wide * numbers.share());
    let v: [DVec3; 4] = std::array::from_fn(|_| numbers.vector() * speed);
    // The vertex with the first weight goes where the closest points are `off` separations apart.
    let heaviest = usize::from(weights[0] < weights[1]);
    let sum: DVec3 = (0..4).map(|i| x[i] * weights[i] as f64).sum();
    let gap = numbers.vector() * separation * off * whole as f64;
    x[heaviest] -= (sum - gap) / weights[heaviest] as f64;
    let time = tick as f64 / 1024.0;
    let round = |x: DVec3| (x * UNIT).round() / UNIT;
    let start = std::array::from_fn(|i| round(x[i] - v[i] * time));
    let end = std::array::from_fn(|i| round(x[i] + v[i] * (1.0 - time)));
    let between = exact_between(&start, &end, &weights, tick);
    let found = meeting(features, start, end, separation, 0.25 * separation);
    let close = between < 0.999 * separation;
    if close {
        let case = (features, start, end, separation);
        let found = found.unwrap_or_else(|| panic!("missed at {time}, {between}: {case:?}"));
        assert!(found.time <= time, "{found:?} later than {time}: {case:?}");
    }
    if let Some(found) = found {
        let now = std::array::from_fn(|i| start[i] + (end[i] - start[i]) * found.time);
        let distance = distance(features, now);
        assert!(
            distance < 2.0 * separation,
            "{found:?} at {distance}: {:?}",
            (features, start, end, separation)
        );
    }
    close
}

/// |Σ wᵢ xᵢ| at a tick of 1024 in a step: an exact sum in integers, rounded once.
fn exact_between(start: &[DVec3; 4], end: &[DVec3; 4], weights: &[i64; 4], tick: i64) -> f64 {
    let along = |axis: usize| {
        let sum: i128 = (0..4)
            .map(|i| {
                let [x0, x1] = [start[i], end[i]].map(|x| (x.to_array()[axis] * UNIT) as i128);
                (x0 * i128::from(1024 - tick) + x1 * i128::from(tick)) * i128::from(weights[i])
            })
            .sum();
        sum as f64 / (UNIT * 1024.0 * f64::from(1 << 20))
    };
    dvec3(along(0), along(1), along(2)).length()
}
