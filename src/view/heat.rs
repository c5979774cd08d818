//! Numbers per vertex as colours, along viridis: even steps of lightness, told apart with any kind of
//! colour vision and in grey.

/// Writes a colour for each value: dark at 0, yellow from `top` on. Values that are not numbers are
/// grey; with a `top` that is not above 0 all values count as 0.
pub fn heat_colours(values: &[f32], top: f32, colours: &mut Vec<[u8; 3]>) {
    colours.clear();
    colours.extend(values.iter().map(|&value| heat(value, top)));
}

fn heat(value: f32, top: f32) -> [u8; 3] {
    if value.is_nan() {
        return [128; 3];
    }
    let share = if top > 0.0 {
        f64::from(value / top)
    } else {
        0.0
    };
    let colour = colorous::VIRIDIS.eval_continuous(share.clamp(0.0, 1.0));
    [colour.r, colour.g, colour.b]
}
