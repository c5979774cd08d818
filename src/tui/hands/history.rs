//! Earlier and later texts of the recipe.

/// Texts remembered at most, each way.
const MOST: usize = 500;

/// The texts before and after the present one.
#[derive(Debug, Default)]
pub(super) struct History {
    past: Vec<String>,
    future: Vec<String>,
}

impl History {
    /// `text` is being replaced: what was undone before cannot be redone any more.
    pub(super) fn replaced(&mut self, text: &str) {
        self.future.clear();
        if self.past.len() == MOST {
            self.past.remove(0);
        }
        self.past.push(text.to_string());
    }

    /// Whether anything was ever replaced.
    pub(super) fn is_begun(&self) -> bool {
        !(self.past.is_empty() && self.future.is_empty())
    }

    /// The text before `present`.
    pub(super) fn undo(&mut self, present: &str) -> Option<String> {
        let text = self.past.pop()?;
        self.future.push(present.to_string());
        Some(text)
    }

    /// The text that was undone last.
    pub(super) fn redo(&mut self, present: &str) -> Option<String> {
        let text = self.future.pop()?;
        self.past.push(present.to_string());
        Some(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undo_and_redo_are_inverse_until_something_new_is_done() {
        let mut history = History::default();
        assert_eq!(history.undo("a"), None);
        history.replaced("a");
        history.replaced("b");
        assert_eq!(history.undo("c").as_deref(), Some("b"));
        assert_eq!(history.undo("b").as_deref(), Some("a"));
        assert_eq!(history.redo("a").as_deref(), Some("b"));
        assert_eq!(history.redo("b").as_deref(), Some("c"));
        assert_eq!(history.redo("c"), None);
        assert_eq!(history.undo("c").as_deref(), Some("b"));
        history.replaced("b");
        assert_eq!(history.redo("d"), None);
        assert_eq!(history.undo("d").as_deref(), Some("b"));
    }
}
