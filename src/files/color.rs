//! Colours that distinguish neighbours.

/// Red, green, blue, each 0 to 1.
pub type Color = [f32; 3];

/// Hue step from one number to the next: the golden ratio, which separates any few consecutive
/// numbers well.
const STEP: f32 = 0.618_034;

/// The colour of a part, patch or body.
pub fn of_number(number: u32) -> Color {
    from_hsv((number as f32 * STEP).fract(), 0.5, 0.96)
}

/// The colour of a hue, saturation and value, each 0 to 1.
pub fn from_hsv(hue: f32, saturation: f32, value: f32) -> Color {
    // Red is high around hue 0, green around 1/3, blue around 2/3.
    [0.0, 2.0 / 3.0, 1.0 / 3.0].map(|shift| {
        let away = ((hue + shift).fract() * 6.0 - 3.0).abs() - 1.0;
        value * (1.0 - saturation * (1.0 - away.clamp(0.0, 1.0)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hues_are_where_they_belong() {
        for (hue, color) in [(0.0, [1., 0., 0.]), (1.0 / 3.0, [0., 1., 0.]), (2.0 / 3.0, [0., 0., 1.])] {
            let found = from_hsv(hue, 1.0, 1.0);
            assert!(found.iter().zip(&color).all(|(a, b): (&f32, &f32)| (a - b).abs() < 1e-5), "{found:?}");
        }
        assert_eq!(from_hsv(0.3, 0.0, 0.5), [0.5; 3]);
    }
}
