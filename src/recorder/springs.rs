//! Which springs are drawn.
//!
//! A spring costs about 32 bytes a frame, so a 60 × 60 sheet with all 21 000 of them would take
//! six times what its mesh takes. Beyond a few thousand only the most strained are drawn.

use crate::frame::{ClothHeader, Frame, Header, SpringDetail};

/// With fewer springs than this, [`SpringDetail::Auto`] draws all of them.
pub(super) const AUTO_ALL_BELOW: usize = 4000;
/// Otherwise it draws so many, the most strained (64 kB a frame).
pub(super) const AUTO_MOST_STRAINED: usize = 2000;

/// One spring: its absolute strain, cloth, family and number.
type Ranked = (f32, usize, usize, usize);

/// The numbers of the springs to draw, by cloth and family; each list ascends.
///
/// The structural springs of a chain, which has no mesh to show it, are always drawn. The choice
/// depends on nothing but the frame: equal strains go by cloth, family and number.
pub(super) fn choose(header: &Header, frame: &Frame) -> Vec<Vec<Vec<usize>>> {
    let detail = match header.spring_detail {
        SpringDetail::Auto if count(header) < AUTO_ALL_BELOW => SpringDetail::All,
        detail => detail,
    };
    let mut chosen: Vec<Vec<Vec<usize>>> = header
        .cloths
        .iter()
        .map(|cloth| all_or_none(cloth, detail))
        .collect();
    if detail == SpringDetail::Auto {
        for (_, cloth, family, spring) in most_strained(header, frame) {
            chosen[cloth][family].push(spring);
        }
    }
    chosen
}

/// Every spring of the families that are drawn whole.
fn all_or_none(cloth: &ClothHeader, detail: SpringDetail) -> Vec<Vec<usize>> {
    let families = cloth.springs.iter();
    let whole = |name| detail == SpringDetail::All || always(cloth, name);
    families
        .map(|family| match whole(family.name) {
            true => (0..family.pairs.len()).collect(),
            false => Vec::new(),
        })
        .collect()
}

/// Is this family the only picture of its cloth?
fn always(cloth: &ClothHeader, family: &str) -> bool {
    cloth.triangles.is_empty() && family == "structural"
}

/// Number of springs of all cloths.
fn count(header: &Header) -> usize {
    let families = header.cloths.iter().flat_map(|cloth| &cloth.springs);
    families.map(|family| family.pairs.len()).sum()
}

/// The most strained springs, by cloth, family and number.
fn most_strained(header: &Header, frame: &Frame) -> Vec<Ranked> {
    let mut ranked: Vec<Ranked> = Vec::with_capacity(count(header));
    for (c, (cloth, state)) in header.cloths.iter().zip(&frame.cloths).enumerate() {
        for (f, (family, strains)) in cloth.springs.iter().zip(&state.spring_strain).enumerate() {
            if always(cloth, family.name) {
                continue;
            }
            let drawable = strains.iter().take(family.pairs.len()).enumerate();
            ranked.extend(drawable.map(|(s, strain)| (strain.abs(), c, f, s)));
        }
    }
    let place = |r: &Ranked| (r.1, r.2, r.3);
    if ranked.len() > AUTO_MOST_STRAINED {
        ranked.select_nth_unstable_by(AUTO_MOST_STRAINED - 1, |a, b| {
            b.0.total_cmp(&a.0).then_with(|| place(a).cmp(&place(b)))
        });
        ranked.truncate(AUTO_MOST_STRAINED);
    }
    ranked.sort_unstable_by_key(place);
    ranked
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{ClothFrame, SpringFamily};

    fn scene(springs: usize, triangles: bool, detail: SpringDetail) -> (Header, Frame) {
        let family = SpringFamily {
            name: "structural",
            pairs: vec![[0, 1]; springs],
        };
        let cloth = ClothHeader {
            triangles: if triangles { vec![[0, 1, 2]] } else { vec![] },
            springs: vec![family],
            ..ClothHeader::default()
        };
        let header = Header {
            spring_detail: detail,
            cloths: vec![cloth],
            ..Header::default()
        };
        // Ties everywhere, and compression as strong as stretch.
        let strain = (0..springs).map(|s| ((s % 7) as f32) * if s % 2 == 0 { 1.0 } else { -1.0 });
        let frame = Frame {
            cloths: vec![ClothFrame {
                spring_strain: vec![strain.collect()],
                ..ClothFrame::default()
            }],
            ..Frame::default()
        };
        (header, frame)
    }

    #[test]
    fn small_scenes_show_all_and_large_ones_the_most_strained() {
        let (header, frame) = scene(AUTO_ALL_BELOW - 1, true, SpringDetail::Auto);
        assert_eq!(choose(&header, &frame)[0][0].len(), AUTO_ALL_BELOW - 1);

        let (header, frame) = scene(70_000, true, SpringDetail::Auto);
        let chosen = &choose(&header, &frame)[0][0];
        let expected: Vec<usize> = (0..AUTO_MOST_STRAINED).map(|n| 7 * n + 6).collect();
        assert_eq!(*chosen, expected, "ties go by number");
    }

    #[test]
    fn chains_are_shown_even_when_springs_are_off() {
        let (header, frame) = scene(50, false, SpringDetail::Off);
        assert_eq!(choose(&header, &frame)[0][0].len(), 50);
        let (header, frame) = scene(50, true, SpringDetail::Off);
        assert!(choose(&header, &frame)[0][0].is_empty());
    }
}
