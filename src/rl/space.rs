//! Spaces: which observations and actions there are.

use std::cmp::Ordering;

/// An array of real numbers, each within bounds of its own: a `Box` of Gymnasium, in single precision.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxSpace {
    /// Lower bound of each component, in its unit; minus infinity where there is none.
    pub low: Vec<f32>,
    /// Upper bound of each component, in its unit; infinity where there is none.
    pub high: Vec<f32>,
    /// Shape of the array, whose product is the number of components.
    pub shape: Vec<usize>,
    /// Name of each component, in the order of rows.
    pub names: Vec<String>,
    /// Unit of each component; empty for a pure number.
    pub units: Vec<String>,
}

impl BoxSpace {
    /// A vector of components, each with name, unit, lower and upper bound.
    #[must_use]
    pub fn of(components: &[(&str, &str, f32, f32)]) -> Self {
        Self {
            low: components.iter().map(|c| c.2).collect(),
            high: components.iter().map(|c| c.3).collect(),
            shape: vec![components.len()],
            names: components.iter().map(|c| c.0.to_owned()).collect(),
            units: components.iter().map(|c| c.1.to_owned()).collect(),
        }
    }

    /// The same with another component at the end, which makes the array a vector.
    #[must_use]
    pub fn and(mut self, name: impl Into<String>, unit: impl Into<String>, low: f32, high: f32) -> Self {
        self.low.push(low);
        self.high.push(high);
        self.names.push(name.into());
        self.units.push(unit.into());
        self.shape = vec![self.names.len()];
        self
    }

    /// Number of components.
    #[must_use]
    pub fn size(&self) -> usize {
        self.low.len()
    }

    /// The number of the component called `name`.
    #[must_use]
    pub fn component(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|other| other == name)
    }

    /// The first of `rows`, row after row, that is not a number or is out of bounds: its row and its component.
    #[must_use]
    pub fn outside(&self, rows: &[f32]) -> Option<(usize, usize)> {
        // Without a branch in the loop, which is run over all lanes at every step.
        let mut inside = true;
        if let ([low], [high]) = (self.low.as_slice(), self.high.as_slice()) {
            for value in rows {
                inside &= (value >= low) & (value <= high);
            }
        } else {
            for row in rows.chunks_exact(self.size().max(1)) {
                for ((value, low), high) in row.iter().zip(&self.low).zip(&self.high) {
                    inside &= (value >= low) & (value <= high);
                }
            }
        }
        if inside {
            return None;
        }
        let within = |k: &usize| (self.low[k % self.size()]..=self.high[k % self.size()]).contains(&rows[*k]);
        (0..rows.len()).find(|k| !within(k)).map(|k| (k / self.size(), k % self.size()))
    }

    /// Whether the bounds are in order, and as many as names, units and the shape say; if not, what is wrong.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(&self) -> Result<(), String> {
        let size = self.size();
        if [self.high.len(), self.names.len(), self.units.len(), self.shape.iter().product()] != [size; 4] {
            let [high, names, units] = [self.high.len(), self.names.len(), self.units.len()];
            return Err(format!(
                "{size} lower bounds, {high} upper, {names} names and {units} units for shape {:?}",
                self.shape
            ));
        }
        for k in 0..size {
            // Neither bound may be NaN.
            if self.low[k].partial_cmp(&self.high[k]).is_none_or(Ordering::is_gt) {
                return Err(format!("`{}` has bounds [{}, {}]", self.names[k], self.low[k], self.high[k]));
            }
            if self.names[k].is_empty() || self.names[..k].contains(&self.names[k]) {
                return Err(format!("component {k} has no name of its own: `{}`", self.names[k]));
            }
        }
        Ok(())
    }
}

/// The actions of an environment.
#[derive(Debug, Clone, PartialEq)]
pub enum Space {
    /// Real numbers.
    Box(BoxSpace),
    /// One of `n` choices, 0 to n - 1.
    Discrete {
        /// How many there are.
        n: usize,
        /// What is chosen.
        name: String,
    },
    /// Several choices, each 0 to n - 1 of its own.
    MultiDiscrete {
        /// How many there are of each.
        n: Vec<usize>,
        /// What is chosen by each.
        names: Vec<String>,
    },
}

impl Space {
    /// How many numbers an action has.
    #[must_use]
    pub fn size(&self) -> usize {
        match self {
            Self::Box(space) => space.size(),
            Self::Discrete { .. } => 1,
            Self::MultiDiscrete { n, .. } => n.len(),
        }
    }

    /// The space of real numbers, if it is one.
    #[must_use]
    pub fn as_box(&self) -> Option<&BoxSpace> {
        match self {
            Self::Box(space) => Some(space),
            Self::Discrete { .. } | Self::MultiDiscrete { .. } => None,
        }
    }

    /// The name of component `k`.
    #[must_use]
    pub fn name(&self, k: usize) -> &str {
        match self {
            Self::Box(space) => &space.names[k],
            Self::Discrete { name, .. } => name,
            Self::MultiDiscrete { names, .. } => &names[k],
        }
    }

    /// Whether the space is well made; if not, what is wrong.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(&self) -> Result<(), String> {
        match self {
            Self::Box(space) => space.check(),
            Self::Discrete { n: 0, .. } => Err("there is nothing to choose from".into()),
            Self::Discrete { .. } => Ok(()),
            Self::MultiDiscrete { n, names } if n.len() != names.len() => {
                Err(format!("{} choices have {} names", n.len(), names.len()))
            }
            Self::MultiDiscrete { n, .. } if n.contains(&0) => Err("there is nothing to choose from".into()),
            Self::MultiDiscrete { .. } => Ok(()),
        }
    }
}

/// Actions for lanes, row after row, shape (lanes, size of an action).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Actions<'a> {
    /// Of a [`Space::Box`].
    Continuous(&'a [f32]),
    /// Of a [`Space::Discrete`] or [`Space::MultiDiscrete`].
    Discrete(&'a [i64]),
}

impl<'a> Actions<'a> {
    /// Number of numbers over all lanes.
    #[must_use]
    pub fn len(self) -> usize {
        match self {
            Self::Continuous(values) => values.len(),
            Self::Discrete(values) => values.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The actions of `count` lanes from lane `first`, for actions of `size` numbers.
    ///
    /// # Panics
    /// If there are not as many lanes: an error of the calling code, not of any input.
    #[must_use]
    pub fn lanes(self, first: usize, count: usize, size: usize) -> Actions<'a> {
        let range = first * size..(first + count) * size;
        match self {
            Self::Continuous(values) => Actions::Continuous(&values[range]),
            Self::Discrete(values) => Actions::Discrete(&values[range]),
        }
    }

    /// The real numbers; empty where the actions are choices, which `Checked` refuses before.
    #[must_use]
    pub fn continuous(self) -> &'a [f32] {
        match self {
            Self::Continuous(values) => values,
            Self::Discrete(_) => &[],
        }
    }

    /// The choices; empty where the actions are real numbers, which `Checked` refuses before.
    #[must_use]
    pub fn discrete(self) -> &'a [i64] {
        match self {
            Self::Discrete(values) => values,
            Self::Continuous(_) => &[],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_outside_is_found_at_its_place() {
        let space = BoxSpace::of(&[("a", "m", -1.0, 1.0), ("b", "", 0.0, f32::INFINITY)]);
        assert_eq!(space.outside(&[0.0, 0.0, -1.0, 7.0, 1.0, f32::INFINITY]), None);
        assert_eq!(space.outside(&[0.0, 0.0, 0.0, -1e-9]), Some((1, 1)));
        assert_eq!(space.outside(&[0.0, 0.0, f32::NAN, 1.0]), Some((1, 0)));
        let one = BoxSpace::of(&[("a", "m", -1.0, 1.0)]);
        assert_eq!(one.outside(&[0.5; 100]), None);
        assert_eq!(one.outside(&[0.5, 0.5, 1.5]), Some((2, 0)));
        assert_eq!(one.outside(&[f32::NAN]), Some((0, 0)));
    }

    #[test]
    fn a_space_that_is_not_well_made_says_why() {
        let good = BoxSpace::of(&[("a", "m", -1.0, 1.0)]).and("b", "s", 0.0, 2.0);
        assert_eq!((good.check(), good.shape.as_slice(), good.component("b")), (Ok(()), &[2][..], Some(1)));
        let crossed = BoxSpace::of(&[("a", "m", 1.0, -1.0)]);
        assert!(crossed.check().unwrap_err().contains("`a` has bounds [1, -1]"));
        assert!(BoxSpace::of(&[("a", "m", f32::NAN, 1.0)]).check().is_err());
        assert!(BoxSpace::of(&[("a", "", 0.0, 1.0), ("a", "", 0.0, 1.0)]).check().unwrap_err().contains("name of its own"));
        assert!(BoxSpace { shape: vec![2, 2], ..good }.check().unwrap_err().contains("shape [2, 2]"));
        assert!(Space::Discrete { n: 0, name: "push".into() }.check().is_err());
        assert!(Space::MultiDiscrete { n: vec![2, 0], names: vec!["a".into(), "b".into()] }.check().is_err());
        assert!(Space::MultiDiscrete { n: vec![2], names: vec![] }.check().is_err());
    }

    #[test]
    fn actions_are_cut_by_lanes() {
        let actions = Actions::Continuous(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(actions.lanes(1, 2, 2), Actions::Continuous(&[3.0, 4.0, 5.0, 6.0]));
        assert!(actions.discrete().is_empty());
    }
}
