//! How much of each movement makes an expression.

/// Amounts in decimetres, the jaw in radians, lids as shares; 0 is rest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expression {
    /// The jaw opens.
    pub(super) jaw: f64,
    /// The corners of the mouth go up (down if negative).
    pub(super) corner_up: f64,
    /// They go outwards (inwards if negative).
    pub(super) corner_out: f64,
    /// The upper lip rises.
    pub(super) upper_lip: f64,
    /// The lower lip falls.
    pub(super) lower_lip: f64,
    /// The mouth is pushed forward and made round.
    pub(super) pucker: f64,
    /// The lips close, in \[0, 1\]: at rest the mouth is a narrow slit.
    pub(super) press: f64,
    /// The brows rise beside the nose (fall if negative).
    pub(super) brow_inner: f64,
    /// They rise outside.
    pub(super) brow_outer: f64,
    /// They come together.
    pub(super) brow_knit: f64,
    /// The upper lid falls (rises if negative); with the lower lid, 1 closes the eye.
    pub(super) upper_lid: f64,
    /// The lower lid rises.
    pub(super) lower_lid: f64,
    /// The cheeks rise.
    pub(super) cheek: f64,
    /// The nostrils rise and widen.
    pub(super) nostril: f64,
}

const NEUTRAL: Expression = Expression {
    jaw: 0.0,
    corner_up: 0.0,
    corner_out: 0.0,
    upper_lip: 0.0,
    lower_lip: 0.0,
    pucker: 0.0,
    press: 1.0,
    brow_inner: 0.0,
    brow_outer: 0.0,
    brow_knit: 0.0,
    upper_lid: 0.0,
    lower_lid: 0.0,
    cheek: 0.0,
    nostril: 0.0,
};

/// What the poses of the demo `face` show, in their order.
pub const NAMES: [&str; 9] = [
    "neutral", "anger", "cry", "grin", "laugh", "rage", "sad", "smile", "surprise",
];

/// The poses, in the order of [`NAMES`].
pub(super) const POSES: [Expression; 9] = [
    NEUTRAL,
    // anger
    Expression {
        corner_up: -0.09,
        corner_out: -0.03,
        brow_inner: -0.17,
        brow_outer: 0.05,
        brow_knit: 0.08,
        nostril: 0.05,
        upper_lid: 0.25,
        lower_lid: 0.3,
        ..NEUTRAL
    },
    // cry
    Expression {
        jaw: 0.16,
        corner_up: -0.17,
        corner_out: 0.08,
        upper_lip: 0.06,
        lower_lip: 0.02,
        press: 0.0,
        brow_inner: 0.15,
        brow_outer: -0.12,
        brow_knit: 0.06,
        cheek: 0.08,
        upper_lid: 0.8,
        lower_lid: 0.8,
        ..NEUTRAL
    },
    // grin
    Expression {
        corner_up: 0.10,
        corner_out: 0.14,
        upper_lip: 0.08,
        lower_lip: 0.09,
        press: 0.0,
        brow_inner: -0.04,
        brow_outer: 0.10,
        cheek: 0.08,
        upper_lid: 0.1,
        lower_lid: 0.35,
        ..NEUTRAL
    },
    // laugh
    Expression {
        jaw: 0.30,
        corner_up: 0.20,
        corner_out: 0.10,
        upper_lip: 0.07,
        press: 0.0,
        brow_inner: 0.05,
        brow_outer: 0.09,
        cheek: 0.13,
        upper_lid: 0.75,
        lower_lid: 0.9,
        ..NEUTRAL
    },
    // rage
    Expression {
        jaw: 0.30,
        corner_up: -0.05,
        corner_out: 0.07,
        upper_lip: 0.11,
        lower_lip: 0.10,
        press: 0.0,
        brow_inner: -0.20,
        brow_outer: 0.12,
        brow_knit: 0.09,
        cheek: 0.05,
        nostril: 0.09,
        upper_lid: -0.15,
        lower_lid: 0.2,
        ..NEUTRAL
    },
    // sad
    Expression {
        corner_up: -0.14,
        pucker: 0.02,
        brow_inner: 0.16,
        brow_outer: -0.10,
        brow_knit: 0.05,
        upper_lid: 0.45,
        lower_lid: 0.0,
        ..NEUTRAL
    },
    // smile
    Expression {
        corner_up: 0.14,
        corner_out: 0.09,
        brow_inner: 0.02,
        brow_outer: 0.04,
        cheek: 0.09,
        upper_lid: 0.05,
        lower_lid: 0.35,
        ..NEUTRAL
    },
    // surprise
    Expression {
        jaw: 0.34,
        corner_out: -0.05,
        pucker: 0.03,
        upper_lip: 0.03,
        press: 0.0,
        brow_inner: 0.20,
        brow_outer: 0.20,
        upper_lid: -0.45,
        lower_lid: -0.25,
        ..NEUTRAL
    },
];
