use super::*;
use crate::mesh::Bounds;

const SQUARE: [f32; 12] = [
    -1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0,
];
const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn surface<'a>(triangles: &'a [[u32; 3]], positions: &'a [f32]) -> Surface<'a> {
    Surface {
        triangles,
        positions,
        colours: None,
    }
}

fn from_the_front(extent: f64) -> Camera {
    Camera {
        yaw: 0.0,
        pitch: 0.0,
        extent,
        ..Camera::default()
    }
}

/// Everything drawn is white on transparent black: alpha counts covered pixels.
fn covered(image: &Image) -> usize {
    image
        .rgba
        .as_chunks::<4>()
        .0
        .iter()
        .filter(|pixel| pixel[3] > 0)
        .count()
}

fn clear_style() -> Style {
    Style {
        background: [0; 4],
        ..Style::DARK
    }
}

#[test]
fn a_square_covers_its_share_without_gap_or_seam() {
    for projection in [Projection::Orthographic, Projection::Perspective(0.6)] {
        let mut image = Image::new(40, 40);
        let camera = Camera {
            projection,
            ..from_the_front(2.0)
        };
        render(
            surface(&HALVES, &SQUARE),
            &camera,
            &clear_style(),
            &mut image,
        );
        assert_eq!(covered(&image), 400);
        assert!(
            image
                .rgba
                .as_chunks::<4>()
                .0
                .iter()
                .all(|p| p[3] == 0 || p[3] == 255)
        );
    }
}

#[test]
fn the_nearer_triangle_wins_in_either_order() {
    let mut positions = SQUARE.to_vec();
    positions.extend(
        SQUARE
            .as_chunks::<3>()
            .0
            .iter()
            .flat_map(|p| [p[0], p[1], 0.5]),
    );
    let mut renderer = Renderer::default();
    let mut image = Image::new(16, 16);
    let camera = from_the_front(1.5);
    for order in [[[0, 1, 2], [4, 5, 6]], [[4, 5, 6], [0, 1, 2]]] {
        renderer.render(
            surface(&order, &positions),
            &camera,
            &Style::DARK,
            &mut image,
        );
        let hit = renderer.pick(&order, 9, 9).unwrap();
        assert_eq!(order[hit.triangle], [4, 5, 6]);
        assert!((hit.depth + 0.5).abs() < 1e-6, "height 0.5 exactly, in f32");
    }
}

/// The projection of a picked point's weights is the pixel it was picked at, to the 1/16 pixel that
/// corners are rounded to.
#[test]
fn picking_undoes_projection() {
    let mut renderer = Renderer::default();
    let mut image = Image::new(60, 40);
    for projection in [Projection::Orthographic, Projection::Perspective(0.9)] {
        let camera = Camera {
            projection,
            yaw: 0.7,
            pitch: 0.4,
            extent: 1.6,
            ..Camera::default()
        };
        renderer.render(surface(&HALVES, &SQUARE), &camera, &Style::DARK, &mut image);
        let hit = renderer.pick(&HALVES, 33, 17).unwrap();
        let mut point = [0.0; 3];
        for (corner, weight) in HALVES[hit.triangle].into_iter().zip(hit.weights) {
            for i in 0..3 {
                point[i] += f64::from(weight * SQUARE[3 * corner as usize + i]);
            }
        }
        let [x, y] = camera.project(point, 60, 40).unwrap();
        assert!((x - 33.5).abs() < 0.1 && (y - 17.5).abs() < 0.1, "{x} {y}");
        assert_eq!(renderer.pick(&HALVES, 0, 0), None);
        assert_eq!(renderer.pick(&HALVES, 60, 0), None);
    }
}

#[test]
fn framing_shows_the_whole_box_from_every_side() {
    let bounds = Bounds::of(&[-3.0, 0.0, 100.0, 1.0, 0.5, 104.0]).unwrap();
    for projection in [Projection::Orthographic, Projection::Perspective(0.8)] {
        for turn in 0..12 {
            let mut camera = Camera {
                yaw: f64::from(turn),
                pitch: 0.2 * f64::from(turn) - 1.0,
                up: if turn % 2 == 0 { Up::Y } else { Up::Z },
                projection,
                ..Camera::default()
            };
            camera.frame(&bounds, 1.5);
            for corner in camera::corners(&bounds) {
                let [x, y] = camera.project(corner, 300, 200).unwrap();
                assert!(
                    (0.0..=300.0).contains(&x) && (0.0..=200.0).contains(&y),
                    "{x} {y}"
                );
            }
        }
    }
}

/// Up on the screen is the chosen axis, and the screen's axes are orthonormal and right-handed.
#[test]
fn axes_are_a_frame() {
    for (up, axis) in [(Up::Y, 1), (Up::Z, 2)] {
        let camera = Camera {
            up,
            ..from_the_front(1.0)
        };
        assert!((camera.axes()[1][axis] - 1.0).abs() < 1e-15);
        let [r, u, n] = Camera {
            yaw: 2.0,
            pitch: -0.8,
            ..camera
        }
        .axes();
        let cross = [
            r[1] * u[2] - r[2] * u[1],
            r[2] * u[0] - r[0] * u[2],
            r[0] * u[1] - r[1] * u[0],
        ];
        assert!((0..3).all(|i| (cross[i] - n[i]).abs() < 1e-15));
    }
}

#[test]
fn size_and_place_do_not_change_the_picture() {
    let draw = |scale: f32, shift: f32| {
        let positions: Vec<f32> = SQUARE.iter().map(|value| value * scale + shift).collect();
        let camera = Camera::framing(&Bounds::of(&positions).unwrap(), 1.0);
        let mut image = Image::new(32, 32);
        render(
            surface(&HALVES, &positions),
            &camera,
            &Style::LIGHT,
            &mut image,
        );
        image
    };
    let plain = draw(1.0, 0.0);
    // powers of two scale exactly
    for scale in [(-27.0_f32).exp2(), 27.0_f32.exp2()] {
        assert_eq!(draw(scale, 0.0), plain);
    }
    assert_eq!(covered(&draw(1.0, 1024.0)), covered(&plain));
}

#[test]
fn the_back_has_its_own_colour_and_is_lit() {
    let mut image = Image::new(8, 8);
    let turned = HALVES.map(|[a, b, c]| [a, c, b]);
    let mut colours = Vec::new();
    for triangles in [HALVES, turned] {
        render(
            surface(&triangles, &SQUARE),
            &from_the_front(1.0),
            &Style::DARK,
            &mut image,
        );
        colours.push(image.rgba[4 * 27..4 * 28].to_vec());
    }
    assert!(colours.iter().all(|c| c[0] > 100), "{colours:?}");
    assert_ne!(colours[0], colours[1]);
}

#[test]
fn onion_skins_let_the_background_through() {
    let mut image = Image::new(8, 8);
    let style = Style {
        background: [0, 0, 0, 255],
        front: [200; 3],
        ambient: 1.0,
        opacity: 0.25,
        ..Style::DARK
    };
    let mut renderer = Renderer::default();
    renderer.render(
        surface(&HALVES, &SQUARE),
        &from_the_front(1.0),
        &style,
        &mut image,
    );
    assert_eq!(image.rgba[..4], [50, 50, 50, 255]);
    renderer.overlay(
        surface(&HALVES, &SQUARE),
        &from_the_front(1.0),
        &style,
        &mut image,
    );
    // 200/4 + 3/4 * 50 = 87.5
    assert_eq!(image.rgba[..4], [88, 88, 88, 255]);
}

#[test]
fn wires_run_along_edges_and_colours_replace_the_theme() {
    let mut image = Image::new(64, 64);
    let style = Style {
        ambient: 1.0,
        wire: Some(Wire {
            colour: [255, 0, 0],
            width: 1.5,
        }),
        ..Style::DARK
    };
    let blue = [[0, 0, 255]; 4];
    let square = Surface {
        colours: Some(&blue),
        ..surface(&HALVES, &SQUARE)
    };
    render(square, &from_the_front(1.0), &style, &mut image);
    let at = |x: usize, y: usize| &image.rgba[4 * (64 * y + x)..][..3];
    assert_eq!(at(40, 50), [0, 0, 255], "inside a triangle");
    assert_eq!(at(31, 32), [255, 0, 0], "on the diagonal");
}

#[test]
fn odd_input_draws_nothing_and_does_not_fail() {
    let style = clear_style();
    let mut image = Image::new(0, 5);
    render(
        surface(&HALVES, &SQUARE),
        &from_the_front(1.0),
        &style,
        &mut image,
    );
    let mut image = Image::new(20, 20);
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let mut positions = SQUARE;
        positions[0] = bad;
        render(
            surface(&HALVES, &positions),
            &from_the_front(1.0),
            &style,
            &mut image,
        );
        assert_eq!(covered(&image), 0, "both halves use vertex 0");
    }
    let behind = Camera {
        projection: Projection::Perspective(1.0),
        target: [0.0, 0.0, -50.0],
        ..from_the_front(1.0)
    };
    render(surface(&HALVES, &SQUARE), &behind, &style, &mut image);
    assert_eq!(covered(&image), 0);
    render(
        surface(&[[0, 0, 1]], &SQUARE),
        &from_the_front(1.0),
        &style,
        &mut image,
    );
    assert_eq!(covered(&image), 0);
}

#[test]
fn halving_keeps_means() {
    let mut image = Image::new(4, 3);
    image.fill([10, 20, 30, 255]);
    image.rgba[..4].copy_from_slice(&[0, 0, 0, 0]);
    let half = image.halved();
    assert_eq!((half.width, half.height), (2, 1));
    // the transparent pixel takes part in alpha only
    assert_eq!(half.rgba, [10, 20, 30, 191, 10, 20, 30, 255]);
}

#[test]
fn heat_gets_lighter_from_dark_to_yellow() {
    let mut colours = Vec::new();
    let values: Vec<f32> = (0..=20).map(|i| i as f32 / 10.0).collect();
    heat_colours(&values, 2.0, &mut colours);
    // the ends that the scale's authors publish
    assert_eq!((colours[0], colours[20]), ([68, 1, 84], [253, 231, 37]));
    let light = |c: &[u8; 3]| 2 * u32::from(c[0]) + 5 * u32::from(c[1]) + u32::from(c[2]);
    assert!(
        colours
            .windows(2)
            .all(|pair| light(&pair[0]) < light(&pair[1]))
    );
    heat_colours(&[9.0, f32::NAN], 2.0, &mut colours);
    assert_eq!(colours, [[253, 231, 37], [128; 3]]);
    heat_colours(&[3.0], 0.0, &mut colours);
    assert_eq!(colours, [[68, 1, 84]]);
}
