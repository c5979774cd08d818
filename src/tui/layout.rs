//! Which panels stand where, at any size of the terminal.

use ratatui::layout::{Constraint, Layout, Rect};

use super::panels::{DETAILS, MAP, MESH, PANELS, RECIPE, TIME};

/// Below this many columns or rows panels share the screen as tabs.
const TABS_BELOW: (u16, u16) = (100, 30);
/// From this many columns on there is room for words beside the pictures.
const ROOMY: u16 = 180;

/// The panels on a screen of that size and where, borders included; the last row is the status line.
pub(super) fn places(size: (u16, u16), focus: usize, enlarged: bool) -> Vec<(usize, Rect)> {
    let all = Rect::new(0, 0, size.0, size.1.saturating_sub(1));
    if enlarged {
        return vec![(focus, all)];
    }
    if tabbed(size) {
        let below = Rect::new(
            0,
            1.min(all.height),
            all.width,
            all.height.saturating_sub(1),
        );
        return vec![(focus, below)];
    }
    let [above, below] = Layout::vertical([Constraint::Fill(3), Constraint::Fill(2)]).areas(all);
    let [left, right] = Layout::horizontal([Constraint::Fill(1), Constraint::Fill(1)]).areas(above);
    let mut places = vec![(MAP, left), (MESH, right)];
    if size.0 >= ROOMY {
        let columns = [Constraint::Fill(1), Constraint::Length(56)];
        let [left, right] = Layout::horizontal(columns).areas(below);
        let [upper, lower] =
            Layout::vertical([Constraint::Fill(3), Constraint::Fill(2)]).areas(right);
        places.extend([(TIME, left), (RECIPE, upper), (DETAILS, lower)]);
    } else {
        let columns = [Constraint::Fill(3), Constraint::Fill(2)];
        let [left, right] = Layout::horizontal(columns).areas(below);
        places.extend([(TIME, left), (RECIPE, right)]);
    }
    places
}

/// Whether panels share the screen as tabs.
pub(super) fn tabbed(size: (u16, u16)) -> bool {
    size.0 < TABS_BELOW.0 || size.1 < TABS_BELOW.1
}

/// Where the names of the tabs stand in the first row: index, first column, text.
pub(super) fn tabs() -> Vec<(usize, u16, String)> {
    let mut column = 0;
    let mut tabs = Vec::new();
    for (index, panel) in PANELS.iter().enumerate() {
        let text = format!(" {} ", panel.title());
        let width = text.chars().count() as u16;
        tabs.push((index, column, text));
        column += width + 1;
    }
    tabs
}

/// Inside the border.
pub(super) fn inner(area: Rect) -> Rect {
    Rect::new(
        area.x + 1.min(area.width),
        area.y + 1.min(area.height),
        area.width.saturating_sub(2),
        area.height.saturating_sub(2),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_lie_on_the_screen_and_never_on_each_other_at_any_size() {
        let sizes = [
            (1, 1),
            (2, 2),
            (5, 3),
            (80, 24),
            (99, 60),
            (120, 36),
            (180, 30),
            (240, 70),
            (500, 200),
        ];
        for size in sizes {
            for focus in 0..PANELS.len() {
                let places = places(size, focus, false);
                let screen = Rect::new(0, 0, size.0, size.1);
                for (index, (_, area)) in places.iter().enumerate() {
                    assert_eq!(area.intersection(screen), *area, "{size:?}");
                    assert!(
                        places[..index]
                            .iter()
                            .all(|(_, other)| !other.intersects(*area))
                    );
                    let inside = inner(*area);
                    assert!(inside.is_empty() || inside.intersection(*area) == inside);
                }
                let whole = super::places(size, focus, true);
                assert_eq!((whole.len(), whole[0].0), (1, focus));
            }
        }
    }

    #[test]
    fn small_screens_show_one_panel_large_ones_all() {
        assert_eq!(places((80, 24), TIME, false).len(), 1);
        assert_eq!(places((120, 36), TIME, false).len(), 4);
        assert_eq!(places((240, 70), TIME, false).len(), PANELS.len());
    }
}
