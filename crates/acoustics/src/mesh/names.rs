//! Names of groups, in the order in which they come up.

use std::collections::HashMap;

/// Names, each once.
#[derive(Default)]
pub(super) struct Names {
    all: Vec<String>,
    numbers: HashMap<String, u32>,
}

impl Names {
    /// The number of a name, a new one if it has none.
    pub(super) fn number(&mut self, name: &str) -> u32 {
        if let Some(number) = self.numbers.get(name) {
            return *number;
        }
        let number = self.all.len() as u32;
        self.all.push(name.to_owned());
        self.numbers.insert(name.to_owned(), number);
        number
    }

    /// All of them by number.
    pub(super) fn into_all(self) -> Vec<String> {
        self.all
    }
}
