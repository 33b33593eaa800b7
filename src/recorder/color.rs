//! Strain as colour: blue where compressed, linen where unstrained, red where stretched.

use rerun::Color;

/// The map's colours at equal distances from −range to +range (sRGB).
///
/// The ends are those of `ColorBrewer`'s `RdBu`; its white middle is made a light linen, since
/// most of a cloth is hardly strained and should look like cloth.
const STOPS: [[f32; 3]; 7] = [
    [33.0, 102.0, 172.0],
    [84.0, 149.0, 205.0],
    [158.0, 196.0, 226.0],
    [232.0, 227.0, 217.0],
    [244.0, 176.0, 142.0],
    [222.0, 102.0, 82.0],
    [178.0, 24.0, 43.0],
];

/// Colour of a pinned particle.
pub(super) const PIN: [u8; 3] = [70, 200, 120];
/// Colour of a particle that rests on an obstacle.
pub(super) const TOUCHING: [u8; 3] = [120, 125, 135];
/// Colour of a particle inside an obstacle.
pub(super) const PENETRATING: [u8; 3] = [255, 30, 30];
/// Colour of obstacles: neutral, so that only strain is coloured.
pub(crate) const OBSTACLE: [u8; 3] = [138, 142, 150];

/// Colours of the series of a plot, in turn.
pub(super) const SERIES: [[u8; 3]; 8] = [
    [86, 156, 230],
    [240, 170, 70],
    [100, 195, 120],
    [230, 100, 100],
    [180, 140, 230],
    [100, 205, 205],
    [235, 140, 195],
    [190, 190, 120],
];

/// Colour of `strain` (m/m) on a map that ends at ±`range`.
///
/// Strains beyond the range have the colour of the end; a NaN has the colour of zero.
pub(super) fn of_strain(strain: f32, range: f32) -> Color {
    let last = STOPS.len() - 1;
    let unit = strain / range.max(f32::MIN_POSITIVE);
    let unit = if unit.is_nan() { 0.0 } else { unit };
    let at = (unit.clamp(-1.0, 1.0) + 1.0) / 2.0 * last as f32;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 ≤ at ≤ 6
    let below = (at as usize).min(last - 1);
    let part = at - below as f32;
    let channel = |c: usize| {
        let value = STOPS[below][c] + (STOPS[below + 1][c] - STOPS[below][c]) * part;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 ≤ value ≤ 255
        let value = value.round() as u8;
        value
    };
    Color::from_rgb(channel(0), channel(1), channel(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_is_blue_linen_red_and_saturates() {
        assert_eq!(of_strain(-0.1, 0.1), Color::from_rgb(33, 102, 172));
        assert_eq!(of_strain(0.0, 0.1), Color::from_rgb(232, 227, 217));
        assert_eq!(of_strain(0.1, 0.1), Color::from_rgb(178, 24, 43));
        assert_eq!(of_strain(9.0, 0.1), of_strain(0.1, 0.1));
        assert_eq!(of_strain(f32::NAN, 0.1), of_strain(0.0, 0.1));
        assert_eq!(of_strain(0.0, 0.0), of_strain(0.0, 0.1));
    }
}
