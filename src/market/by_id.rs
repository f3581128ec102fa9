//! A few things by the ids of orders, which are given in order.

use super::OrderId;

/// Things by order id, in the order of ids. There are few at a time, and new ids are the highest: a plain row of them takes less
/// time than a tree, and no memory of its own once it has grown.
#[derive(Debug, Clone)]
pub(super) struct ById<T> {
    row: Vec<(OrderId, T)>,
}

impl<T> Default for ById<T> {
    fn default() -> Self {
        Self { row: Vec::new() }
    }
}

impl<T> ById<T> {
    fn place(&self, id: OrderId) -> Result<usize, usize> {
        match self.row.last() {
            Some((last, _)) if *last < id => Err(self.row.len()),
            _ => self.row.binary_search_by_key(&id, |(own, _)| *own),
        }
    }

    pub fn get(&self, id: OrderId) -> Option<&T> {
        self.place(id).ok().map(|at| &self.row[at].1)
    }

    pub fn get_mut(&mut self, id: OrderId) -> Option<&mut T> {
        self.place(id).ok().map(|at| &mut self.row[at].1)
    }

    pub fn insert(&mut self, id: OrderId, what: T) {
        match self.place(id) {
            Ok(at) => self.row[at].1 = what,
            Err(at) => self.row.insert(at, (id, what)),
        }
    }

    pub fn remove(&mut self, id: OrderId) -> Option<T> {
        self.place(id).ok().map(|at| self.row.remove(at).1)
    }

    /// All of them, with their ids.
    pub fn iter(&self) -> impl Iterator<Item = (OrderId, &T)> {
        self.row.iter().map(|(id, what)| (*id, what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn it_does_what_a_tree_does(steps in proptest::collection::vec((0..12_u64, 0..3_u8), 0..200)) {
            let (mut row, mut tree) = (ById::default(), BTreeMap::new());
            for (k, (id, what)) in steps.into_iter().enumerate() {
                let id = OrderId(id);
                match what {
                    0 => {
                        row.insert(id, k);
                        tree.insert(id, k);
                    }
                    1 => prop_assert_eq!(row.remove(id), tree.remove(&id)),
                    _ => {
                        row.get_mut(id).into_iter().chain(tree.get_mut(&id)).for_each(|v| *v += 1);
                        prop_assert_eq!(row.get(id), tree.get(&id));
                    }
                }
                prop_assert!(row.iter().eq(tree.iter().map(|(id, v)| (*id, v))));
            }
        }
    }
}
