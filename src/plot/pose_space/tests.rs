use super::*;
use crate::plot::Item;
use crate::plot::scene::Segment;

/// A spiral of `count` frames, everything on it.
fn spiral(count: usize) -> PoseSpace {
    let at = |t: f64| [t * t.cos(), t * t.sin() + 100.0];
    let times: Vec<f64> = (0..=20 * count).map(|i| i as f64 / 20.0).collect();
    let frames: Vec<[f64; 2]> = (0..count).map(|i| at(i as f64)).collect();
    PoseSpace {
        curve: times.iter().map(|&t| at(t)).collect(),
        times,
        reached: frames.clone(),
        sites: frames.iter().step_by(2).copied().collect(),
        controls: frames.iter().step_by(3).copied().collect(),
        pins: vec![(2, at(1.0))],
        frames,
        ..PoseSpace::default()
    }
}

fn texts(scene: &Scene) -> impl Iterator<Item = &crate::plot::Label> {
    scene.items.iter().filter_map(|item| match item {
        Item::Text(label) => Some(label),
        _ => None,
    })
}

fn circles(scene: &Scene) -> Vec<Point> {
    let circle = |item: &Item| match item {
        Item::Circle { centre, .. } => Some(*centre),
        _ => None,
    };
    scene.items.iter().filter_map(circle).collect()
}

#[test]
fn frames_lie_where_the_plane_says() {
    let map = spiral(12);
    let (scene, plane) = pose_space(&map, 640.0, 400.0, &Theme::light());
    let circles = circles(&scene);
    for at in &map.frames {
        assert!(circles.contains(&plane.pixel(*at)));
        assert!(plane.area.contains(plane.pixel(*at)));
    }
}

#[test]
fn a_site_far_out_is_told_by_an_arrow_at_the_edge_and_moves_nothing() {
    let near = spiral(12);
    let mut far = near.clone();
    far.sites.push([1e4, -2e4]);
    let arrows = |scene: &Scene| -> Vec<Point> {
        let tips = scene.items.iter().filter_map(|item| match item {
            Item::Path {
                path,
                fill: Some(color),
                ..
            } if *color == Theme::light().series[0] => match path.0.first() {
                Some(Segment::Move(tip)) => Some(*tip),
                _ => None,
            },
            _ => None,
        });
        tips.collect()
    };
    let (without, plane) = pose_space(&near, 640.0, 400.0, &Theme::light());
    let (with, same) = pose_space(&far, 640.0, 400.0, &Theme::light());
    assert_eq!(plane.pixel([3.0, 98.0]), same.pixel([3.0, 98.0]));
    assert_eq!(arrows(&without).len(), 0);
    let tips = arrows(&with);
    assert_eq!(tips.len(), 1);
    assert!(plane.area.contains(tips[0]));
    let middle = 0.5 * (plane.area.top + plane.area.bottom());
    assert!(tips[0][1] > middle, "the site lies below the map");
}

#[test]
fn stretches_off_the_way_are_set_off_below_the_curve() {
    let map = PoseSpace {
        advice: vec![[3.0, 5.0]],
        ..spiral(12)
    };
    let theme = Theme::light();
    let (scene, plane) = pose_space(&map, 640.0, 400.0, &theme);
    let strokes = |item: &Item| match item {
        Item::Path {
            path,
            stroke: Some(stroke),
            ..
        } if stroke.color == theme.warning() => Some(path.0.clone()),
        _ => None,
    };
    let found: Vec<_> = scene.items.iter().filter_map(strokes).collect();
    let wanted = map
        .curve
        .iter()
        .zip(&map.times)
        .find(|(_, t)| **t >= 3.0)
        .unwrap();
    let start = |path: &Vec<Segment>| path.first() == Some(&Segment::Move(plane.pixel(*wanted.0)));
    assert!(found.iter().any(start));
    assert!(texts(&scene).any(|label| label.text.starts_with("off the")));
}

#[test]
fn no_two_texts_meet_and_none_leaves_the_picture() {
    for (width, height, size) in [
        (200.0, 150.0, 9.0),
        (640.0, 400.0, 12.0),
        (2400.0, 1600.0, 30.0),
    ] {
        for count in [5, 24, 204] {
            let theme = Theme::dark().with_text(size);
            let (scene, _) = pose_space(&spiral(count), width, height, &theme);
            let boxes: Vec<Rect> = texts(&scene).map(|label| label.bounds()).collect();
            for (i, one) in boxes.iter().enumerate() {
                assert!(scene.bounds().contains([one.left, one.top]), "{one:?}");
                assert!(
                    scene.bounds().contains([one.right(), one.bottom()]),
                    "{one:?}"
                );
                assert!(boxes[..i].iter().all(|other| !other.intersects(one)));
            }
        }
    }
}

#[test]
fn advised_pins_are_framed_and_named() {
    let mut map = spiral(24);
    map.advised = vec![(14, [60.0, 180.0])];
    let (scene, plane) = pose_space(&map, 640.0, 400.0, &Theme::light());
    assert!(plane.area.contains(plane.pixel([60.0, 180.0])));
    for text in ["pins advised", "14"] {
        assert!(texts(&scene).any(|label| label.text == text), "{text}");
    }
}

#[test]
fn the_legend_stands_outside_the_data() {
    let (scene, plane) = pose_space(&spiral(24), 640.0, 400.0, &Theme::light());
    let names = [
        "f(t)",
        "frames",
        "sites",
        "control points",
        "pins",
        "last frame",
    ];
    for name in names {
        let label = texts(&scene).find(|label| label.text == name);
        let bounds = label.map(|label| label.bounds());
        assert!(
            bounds.is_some_and(|bounds| !bounds.intersects(&plane.area)),
            "{name}"
        );
    }
}

#[test]
fn pins_ends_and_shown_frames_are_numbered_first() {
    let map = PoseSpace {
        shown: vec![7, 500, 0],
        ..spiral(24)
    };
    assert_eq!(map.numbered()[..6], [2, 7, 500, 0, 1, 24]);
    let (scene, _) = pose_space(&map, 640.0, 400.0, &Theme::light());
    for number in ["2", "7", "24"] {
        assert!(
            texts(&scene).any(|label| label.text == number && label.color == Theme::light().ink)
        );
    }
    assert!(!texts(&scene).any(|label| label.text == "500"));
}

#[test]
fn degenerate_maps_are_drawn() {
    let still = |count: usize| PoseSpace {
        frames: vec![[3.0, -2.0]; count],
        curve: vec![[3.0, -2.0]; 50],
        times: vec![1.0; 50],
        ..PoseSpace::default()
    };
    let broken = PoseSpace {
        frames: vec![[f64::NAN, 0.0], [1.0, f64::INFINITY]],
        controls: vec![[f64::NAN; 2]; 4],
        pins: vec![(9, [f64::NAN; 2])],
        ..PoseSpace::default()
    };
    for map in [still(1), still(2), broken, PoseSpace::default()] {
        for (width, height) in [(640.0, 400.0), (1.0, 1.0)] {
            let (scene, plane) = pose_space(&map, width, height, &Theme::light());
            assert!(
                circles(&scene)
                    .iter()
                    .flatten()
                    .all(|value| value.is_finite())
            );
            assert!(
                plane
                    .pixel([3.0, -2.0])
                    .iter()
                    .all(|value| value.is_finite())
            );
            crate::plot::raster(&scene, 1.0);
        }
    }
}

#[test]
fn the_whole_map_is_there_at_any_scale_and_place() {
    for unit in [1e-8, 1.0, 1e8] {
        let scaled = |points: &[[f64; 2]]| points.iter().map(|p| p.map(|v| v * unit)).collect();
        let map = spiral(12);
        let map = PoseSpace {
            curve: scaled(&map.curve),
            frames: scaled(&map.frames),
            times: map.times,
            ..PoseSpace::default()
        };
        let (_, plane) = pose_space(&map, 640.0, 400.0, &Theme::light());
        assert!(
            map.curve
                .iter()
                .all(|&at| plane.area.contains(plane.pixel(at)))
        );
        let (left, right) = (plane.x.pixel(-11.0 * unit), plane.x.pixel(11.0 * unit));
        assert!(right - left > 0.4 * plane.area.width, "{left} {right}");
    }
}

#[test]
fn a_window_shows_its_part_and_clips_the_rest() {
    let map = PoseSpace {
        window: Some([[0.0, 2.0], [100.0, 101.0]]),
        ..spiral(24)
    };
    let (scene, plane) = pose_space(&map, 640.0, 400.0, &Theme::light());
    assert!(plane.x.range[0] <= 0.0 && plane.x.range[1] >= 2.0);
    assert!(scene.items.contains(&Item::Clip(Some(plane.area))));
}
