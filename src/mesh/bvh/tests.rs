//! Against all boxes one by one.

use super::build::HALVED_FROM;
use super::{Bounds, Bvh, DEEPEST, Drift};
use crate::mesh::Aabb;
use glam::{DVec3, dvec3};

/// Numbers in 0..1 from a fixed seed (Steele, Lea and Flood 2014, splitmix64).
struct Random(u64);

impl Random {
    #[expect(clippy::cast_precision_loss, reason = "53 bits are exact")]
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn point(&mut self) -> DVec3 {
        dvec3(self.next(), self.next(), self.next())
    }

    fn boxes(&mut self, count: usize, size: f64) -> Vec<Aabb> {
        let mut one = || {
            let low = self.point();
            Aabb::around([low, low + size * self.point()])
        };
        (0..count).map(|_| one()).collect()
    }
}

/// Lists that a hierarchy has to stand, each with its name.
fn lists() -> Vec<(&'static str, Vec<Aabb>)> {
    let mut random = Random(7);
    let line = (0..3000).map(|i| Aabb::around([DVec3::X * f64::from(i)]));
    let powers = (0..900).map(|i| Aabb::around([DVec3::X * 2.0_f64.powi(i), DVec3::ZERO]));
    let mut huge = random.boxes(50, 0.1);
    huge.push(Aabb::around([DVec3::MIN, DVec3::MAX]));
    let mut list = vec![
        ("none", Vec::new()),
        ("equal", vec![Aabb::around([DVec3::ZERO, DVec3::ONE]); 2500]),
        ("coincident points", vec![Aabb::around([DVec3::ONE]); 5000]),
        ("points on a line", line.collect()),
        ("powers of two", powers.collect()),
        ("one without end", huge),
        ("flat", random.boxes(400, 0.1)),
        ("large", random.boxes(3000, 0.05)),
    ];
    for flat in &mut list[6].1 {
        flat.min.y = 0.5;
        flat.max.y = 0.5;
    }
    for count in 1..40 {
        list.push(("few", random.boxes(count, 0.3)));
    }
    list
}

/// Whether a hierarchy may take two boxes for overlapping: up to rounding to single precision, or
/// beyond 10¹⁸ m.
fn nearly_overlap(one: Aabb, other: Aabb) -> bool {
    let margin = |b: Aabb| {
        let largest = b.min.abs().max(b.max.abs()).max_element();
        if largest > 1e18 {
            f64::INFINITY
        } else {
            1e-6 * largest + 1e-30
        }
    };
    one.grown(margin(one)).overlaps(other.grown(margin(other)))
}

/// Nothing missing, nothing twice, nothing that isn't close.
fn check_found<T: Ord + Copy + std::fmt::Debug>(
    what: &str,
    mut found: Vec<T>,
    expected: impl Iterator<Item = T>,
    near: impl Fn(T) -> bool,
) {
    found.sort_unstable();
    let twice = found.windows(2).find(|two| two[0] == two[1]);
    assert!(twice.is_none(), "{what}: {twice:?}");
    let missed = expected.filter(|one| found.binary_search(one).is_err());
    assert_eq!(missed.min(), None, "{what}: missed");
    let wrong = found.iter().find(|&&one| !near(one));
    assert!(wrong.is_none(), "{what}: {wrong:?} are apart");
}

fn check_overlapping(name: &str, tree: &Bvh, boxes: &[Aabb], query: &Aabb) {
    let mut found = Vec::new();
    tree.overlapping(query, |item| found.push(item));
    let all = (0_u32..).zip(boxes);
    let expected = all
        .filter(|(_, b)| b.overlaps(*query))
        .map(|(item, _)| item);
    let what = format!("{name}, {} boxes, {query:?}", boxes.len());
    check_found(&what, found, expected, |item| {
        nearly_overlap(boxes[item as usize], *query)
    });
}

fn check_nearest(name: &str, tree: &Bvh, boxes: &[Aabb], p: DVec3, reach: f64) {
    let mut asked = 0;
    let mut found = f64::INFINITY;
    tree.nearest(p, reach * reach, |item, bound| {
        asked += 1;
        let distance = boxes[item as usize].distance_squared(p);
        if distance < bound {
            found = distance;
            distance
        } else {
            bound
        }
    });
    let all = boxes.iter().map(|b| b.distance_squared(p));
    let expected = all.fold(f64::INFINITY, f64::min);
    let within = expected < reach * reach;
    assert_eq!(
        found,
        if within { expected } else { f64::INFINITY },
        "{name} at {p}"
    );
    assert!(asked <= boxes.len(), "{name}: {asked} of {}", boxes.len());
}

fn check_pairs(name: &str, tree: &Bvh, boxes: &[Aabb], other: &Bvh, others: &[Aabb]) {
    let (mut own, mut crossed) = (Vec::new(), Vec::new());
    for part in 0..tree.parts() {
        tree.self_pairs(part, |a, b| own.push((a, b)));
        tree.pairs(part, other, |a, b| crossed.push((a, b)));
    }
    let what = format!("{name}, {} boxes", boxes.len());
    let at = |item: u32| boxes[item as usize];
    let count = u32::try_from(boxes.len()).unwrap();
    let ordered = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
    let expected = ordered.filter(|&(a, b)| at(a).overlaps(at(b)));
    check_found(&what, own, expected, |(a, b)| {
        a < b && nearly_overlap(at(a), at(b))
    });
    let across = (0..count).flat_map(|a| (0_u32..).zip(others).map(move |b| (a, b)));
    let expected = across
        .filter(|&(a, (_, b))| at(a).overlaps(*b))
        .map(|(a, (b, _))| (a, b));
    check_found(&what, crossed, expected, |(a, b)| {
        nearly_overlap(at(a), others[b as usize])
    });
}

#[test]
fn answers_are_those_of_brute_force_also_after_motion() {
    let mut random = Random(1);
    let others = random.boxes(300, 0.2);
    let other = Bvh::new(&others);
    for (name, mut boxes) in lists() {
        let mut tree = Bvh::new(&boxes);
        assert_eq!(
            (tree.len(), tree.is_empty()),
            (boxes.len(), boxes.is_empty())
        );
        for moved in [false, true] {
            if moved {
                for one in &mut boxes {
                    let shift = 0.3 * (random.point() - 0.5);
                    *one = Aabb {
                        min: one.min + shift,
                        max: one.max + shift,
                    };
                }
                tree.refit(&boxes);
            }
            for query in random.boxes(30, 0.3) {
                check_overlapping(name, &tree, &boxes, &query);
                check_overlapping(name, &tree, &boxes, &Aabb::around([query.min]));
                for reach in [0.02, 0.5, f64::MAX] {
                    check_nearest(name, &tree, &boxes, 3.0 * query.min - 1.0, reach);
                }
            }
            let all = Aabb {
                min: DVec3::NEG_INFINITY,
                max: DVec3::INFINITY,
            };
            check_overlapping(name, &tree, &boxes, &all);
            check_pairs(name, &tree, &boxes, &other, &others);
        }
    }
}

/// Pairs that move against each other by more than `most` and overlap on their way, of boxes and their moves at the way's
/// beginning and end. With a tolerance below zero fewer are.
fn drifting(boxes: &[Aabb], moves: &[[DVec3; 2]], most: f64, tolerance: f64) -> Vec<(u32, u32)> {
    let at = |i: usize, time: f64| {
        let shift = moves[i][0].lerp(moves[i][1], time);
        boxes[i].min + shift..boxes[i].max + shift
    };
    let mut all = Vec::new();
    for (a, b) in (0..boxes.len()).flat_map(|a| (a + 1..boxes.len()).map(move |b| (a, b))) {
        let apart = |time: usize| (moves[a][time] - moves[b][time]).length();
        let overlap = |time: f64| {
            let (one, other) = (at(a, time), at(b, time));
            let both = one.end.min(other.end) - one.start.max(other.start);
            both.min_element() >= -tolerance
        };
        let meets = (0..=50_u32).any(|k| overlap(f64::from(k) / 50.0));
        if apart(0).max(apart(1)) > most - tolerance && meets {
            all.push((u32::try_from(a).unwrap(), u32::try_from(b).unwrap()));
        }
    }
    all
}

#[test]
fn what_drifts_is_found_and_what_moves_together_is_not() {
    let mut random = Random(11);
    let (count, most) = (400, 0.02);
    let boxes: Vec<Aabb> = random.boxes(count, 0.1);
    let boxes: Vec<Aabb> = boxes.iter().map(|one| one.grown(0.03)).collect();
    let places = Bvh::new(&boxes);
    let shifted = |i: u32, by: DVec3| {
        let one = &boxes[i as usize];
        Aabb::around([one.min + by, one.max + by])
    };
    for speed in [0.0, 0.01, 0.05, 0.5] {
        // A common motion over three times the boxes' extent, and some of each item's own.
        let mut moves: Vec<[DVec3; 2]> = (0..count)
            .map(|_| [0.0, 3.0].map(|far| DVec3::splat(far) + speed * (random.point() - 0.5)))
            .collect();
        let mut trees = [0, 1].map(|time| {
            let mut tree = [places.clone(), places.clone()];
            tree[0].refit_with(|i| shifted(i, moves[i as usize][time]));
            tree[1].refit_with(|i| Aabb::around([moves[i as usize][time]]));
            tree
        });
        let found = drifted(&trees);
        let expected = drifting(&boxes, &moves, most, -1e-5);
        println!("speed {speed}: {} of {} pairs", found.len(), expected.len());
        assert!((speed > 0.02) != expected.is_empty());
        let at = |i: u32, time: usize| moves[i as usize][time];
        check_found("drift", found, expected.into_iter(), |(a, b)| {
            let apart = |time: usize| (at(a, time) - at(b, time)).length();
            a < b && apart(0).max(apart(1)) > most - 1e-5
        });
        // A few end elsewhere: pairs with one of them are found, and no others.
        let changed = |i: u32| i % 50 == 7;
        for i in (0..400).filter(|&i| changed(i)) {
            moves[i as usize][1] += 0.1 * (random.point() - 0.5);
        }
        let end = |i: u32| moves[i as usize][1];
        let [at, moved] = &mut trees[1];
        at.refit_changed(|i| changed(i).then(|| Bounds::around(&shifted(i, end(i)))));
        moved.refit_changed(|i| changed(i).then(|| Bounds::around(&Aabb::around([end(i)]))));
        let found = drifted(&trees);
        let expected = drifting(&boxes, &moves, most, -1e-5);
        let expected = expected
            .into_iter()
            .filter(|&(a, b)| changed(a) || changed(b));
        assert!(!found.is_empty());
        check_found("changed", found, expected, |(a, b)| {
            let apart = |time: usize| (moves[a as usize][time] - moves[b as usize][time]).length();
            (changed(a) || changed(b)) && a < b && apart(0).max(apart(1)) > most - 1e-5
        });
    }
}

/// What a search finds, of boxes and moves at the beginning of a way and at its end.
fn drifted([first, last]: &[[Bvh; 2]; 2]) -> Vec<(u32, u32)> {
    let drift = Drift {
        at: [&first[0], &last[0]],
        moves: [&first[1], &last[1]],
        most: 0.02,
    };
    let mut found = Vec::new();
    for part in 0..first[0].parts() {
        drift.pairs(part, |a, b| found.push((a, b)));
    }
    found
}

#[test]
fn a_query_looks_at_few_items() {
    let mut random = Random(3);
    let boxes = random.boxes(30_000, 0.02);
    let tree = Bvh::new(&boxes);
    let mut asked = 0;
    for _ in 0..1000 {
        let p = random.point();
        tree.nearest(p, f64::MAX, |item, bound| {
            asked += 1;
            boxes[item as usize].distance_squared(p).min(bound)
        });
    }
    // Where boxes are this dense, a point is in one or close to it; 1.6 a query are asked.
    assert!(asked < 2500, "{asked} of 30 000 in 1000 queries");
    assert!((32..35).contains(&tree.parts()), "{}", tree.parts());
}

#[test]
fn a_point_that_is_none_asks_nothing() {
    let tree = Bvh::new(&Random(5).boxes(1000, 0.1));
    for p in [DVec3::NAN, dvec3(0.5, f64::NAN, 0.5)] {
        tree.nearest(p, f64::MAX, |item, _| panic!("{p} asks for {item}"));
    }
}

#[test]
fn the_depth_is_bounded_for_the_worst_that_fits() {
    // Boxes each 16 times the last: every split by bins cuts off one. 1e-300 to 1e300 in 2⁴.
    let boxes: Vec<Aabb> = (-250..250)
        .flat_map(|i| [Aabb::around([DVec3::ONE * 16.0_f64.powi(i), DVec3::ZERO]); 9])
        .collect();
    let tree = Bvh::new(&boxes);
    let mut found = 0;
    tree.overlapping(&Aabb::around([DVec3::ZERO]), |_| found += 1);
    assert_eq!(found, boxes.len());
    let mut level = vec![1; tree.nodes.len()];
    for (node, children) in tree.nodes.iter().map(|node| node.children).enumerate() {
        for child in children.into_iter().filter_map(|child| child.known().err()) {
            level[child] = level[node] + 1;
        }
    }
    let deepest = level.iter().max().unwrap();
    assert!(
        (HALVED_FROM + 1..=DEEPEST).contains(deepest),
        "{deepest} levels"
    );
}
