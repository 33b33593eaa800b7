//! Greedy colours: what may be done in any order, or at once.

/// A colour for each item, so that items of one colour share no place: the first that is new to all
/// places of the item. `items` lists each one's places, all below `places`.
pub(super) fn colors<'a>(
    places: usize,
    items: impl Iterator<Item = &'a [u32]> + Clone,
) -> Vec<usize> {
    let mut degrees = vec![0_usize; places];
    for &place in items.clone().flatten() {
        degrees[place as usize] += 1;
    }
    let most = degrees.into_iter().max().unwrap_or_default();
    let width = items.clone().map(<[u32]>::len).max().unwrap_or_default();
    // An item meets fewer than `width · most` others, so that many colours always suffice.
    let words = (width * most).div_ceil(64).max(1);
    let mut used = vec![0_u64; places * words];
    let first_free = |item: &[u32]| {
        let mut color = 0;
        for word in 0..words {
            let taken = |all: u64, &place: &u32| all | used[place as usize * words + word];
            let free = item.iter().fold(0, taken).trailing_ones();
            color = 64 * word + free as usize;
            if free < 64 {
                break;
            }
        }
        for &place in item {
            used[place as usize * words + color / 64] |= 1 << (color % 64);
        }
        color
    };
    items.map(first_free).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triples of pseudo-random places, and a hub that meets 200 others: more colours than a word has.
    #[test]
    fn items_of_one_color_share_no_place() {
        let mut items: Vec<[u32; 3]> = (0..500_u32)
            .map(|i| [i * i % 97, 100 + i * 7 % 83, 200 + i * 11 % 61])
            .collect();
        items.extend((0..200).map(|i| [99, 300 + i, 199]));
        let colors = colors(500, items.iter().map(|item| &item[..]));
        assert_eq!(colors.len(), items.len());
        let most = colors.iter().max().unwrap() + 1;
        assert!((200..=210).contains(&most), "{most} colours");
        let mut seen = vec![usize::MAX; 500 * most];
        for (i, (item, &color)) in items.iter().zip(&colors).enumerate() {
            for &place in item {
                let owner = &mut seen[place as usize * most + color];
                assert_eq!(*owner, usize::MAX, "items {i} and {owner}, colour {color}");
                *owner = i;
            }
        }
    }
}
