//! Points in a plane with names: shapes by their two leading coordinates, say.

use super::axes::{Plane, range_of, with_margin};
use super::labels::Labels;
use super::legend::{Legend, Mark};
use super::scene::{Point, Rect, Scene};
use super::theme::{Theme, Tint};

/// Points of one kind.
#[derive(Debug, Clone)]
pub struct Group {
    /// Its name in the legend; empty: not in the legend.
    pub name: String,
    /// Its colour.
    pub tint: Tint,
    /// Places and names; an empty name is not written, a point that is not finite not drawn.
    pub points: Vec<([f64; 2], String)>,
}

/// Groups of points over two axes with the same unit.
#[derive(Debug, Clone, Default)]
pub struct Scatter {
    /// Name of the horizontal axis, with its unit.
    pub x: String,
    /// Name of the vertical axis.
    pub y: String,
    /// The groups, the lowest first.
    pub groups: Vec<Group>,
}

/// The points in a picture of `width` x `height` pixels, and where they lie in it. Names are written
/// beside their points where there is room.
pub fn scatter(scatter: &Scatter, width: f32, height: f32, theme: &Theme) -> (Scene, Plane) {
    let mut scene = Scene::new(width, height, theme.background);
    let entries: Vec<(Mark, &str)> = scatter
        .groups
        .iter()
        .filter(|group| !group.name.is_empty())
        .map(|group| (Mark::Dot(theme.tint(group.tint)), group.name.as_str()))
        .collect();
    let legend =
        Legend::new(&entries, width - 2.0 * theme.text, theme).unless_crowded(height, theme);
    let top = legend.height(theme).max(0.8 * theme.text + 1.0);
    let room = Rect::new(0.0, top, width - 1.2 * theme.text - 1.0, height - top);
    let [x, y] = scatter.ranges();
    let (plane, x, y) = Plane::isometric_in(room, x, y, theme);
    plane.draw_grid(&mut scene, theme, &x, &y);
    plane.draw_frame(&mut scene, theme);
    scatter.draw(&mut scene, &plane, theme);
    plane.draw_x(&mut scene, theme, &x, &scatter.x);
    plane.draw_y(&mut scene, theme, &y, &scatter.y);
    legend.draw(&mut scene, theme, plane.area.left);
    (scene, plane)
}

impl Scatter {
    fn points(&self) -> impl Iterator<Item = (&Group, [f64; 2], &str)> {
        let all = self.groups.iter().flat_map(|group| {
            let points = group.points.iter();
            points.map(move |(at, name)| (group, *at, name.as_str()))
        });
        all.filter(|(_, at, _)| at.iter().all(|value| value.is_finite()))
    }

    fn ranges(&self) -> [[f64; 2]; 2] {
        let along = |axis: usize| range_of(self.points().map(|(_, at, _)| at[axis]));
        match (along(0), along(1)) {
            (Some(x), Some(y)) => with_margin([x, y], 0.1),
            _ => [[0.0, 1.0]; 2],
        }
    }

    fn draw(&self, scene: &mut Scene, plane: &Plane, theme: &Theme) {
        for (group, at, _) in self.points() {
            scene.disc(plane.pixel(at), 3.4 * theme.unit(), theme.tint(group.tint));
        }
        let obstacles: Vec<Point> = self.points().map(|(_, at, _)| plane.pixel(at)).collect();
        let mut labels = Labels::new(plane.area, obstacles);
        for (_, at, name) in self.points().filter(|(.., name)| !name.is_empty()) {
            let place = (plane.pixel(at), 6.5 * theme.unit());
            labels.write(scene, theme, place, (name, theme.ink));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Item;

    fn named(points: &[[f64; 2]]) -> Scatter {
        let points = points
            .iter()
            .enumerate()
            .map(|(i, &at)| (at, format!("pose {i}")));
        Scatter {
            groups: vec![Group {
                name: "poses".into(),
                tint: Tint::Series(0),
                points: points.collect(),
            }],
            ..Scatter::default()
        }
    }

    #[test]
    fn points_are_drawn_where_the_plane_says() {
        let data = [[0.0, 0.0], [2.0, 1.0], [-1.0, 4.0]];
        let (scene, plane) = scatter(&named(&data), 400.0, 300.0, &Theme::light());
        for at in data {
            let drawn = scene.items.iter().any(
                |item| matches!(item, Item::Circle { centre, .. } if *centre == plane.pixel(at)),
            );
            assert!(drawn && plane.area.contains(plane.pixel(at)));
        }
    }

    #[test]
    fn one_point_none_and_points_that_are_no_numbers_are_drawn() {
        let dots = |scene: &Scene, plane: &Plane| {
            let circles = scene.items.iter().filter(
                |item| matches!(item, Item::Circle { centre, .. } if plane.area.contains(*centre)),
            );
            circles.count()
        };
        for (points, count) in [
            (vec![], 0),
            (vec![[7.0, 7.0]], 1),
            (vec![[f64::NAN, 0.0]], 0),
        ] {
            let (scene, plane) = scatter(&named(&points), 300.0, 200.0, &Theme::dark());
            assert_eq!(dots(&scene, &plane), count);
        }
    }
}
