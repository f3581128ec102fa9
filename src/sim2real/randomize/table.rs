//! What was drawn: a row a parameter, an entry an environment.

use crate::sim2real::Thetas;

use super::Target;

/// Values of randomized parameters for many environments, parameter after parameter: what a privileged critic is shown, and
/// what lanes of a run are given.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawTable {
    targets: Vec<Target>,
    environments: usize,
    /// Shape (parameters, environments), row after row.
    values: Vec<f64>,
}

impl DrawTable {
    /// A table in which every parameter has its nominal value.
    pub(super) fn nominal(targets: Vec<Target>, nominal: &[f64], environments: usize) -> Self {
        let values = nominal.iter().flat_map(|value| std::iter::repeat_n(*value, environments)).collect();
        Self { targets, environments, values }
    }

    /// The parameters, in the order of rows.
    #[must_use]
    pub fn targets(&self) -> &[Target] {
        &self.targets
    }

    /// Number of environments.
    #[must_use]
    pub fn environments(&self) -> usize {
        self.environments
    }

    /// The values of parameter `k`, one an environment, in its unit.
    #[must_use]
    pub fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.environments..][..self.environments]
    }

    pub(super) fn row_mut(&mut self, k: usize) -> &mut [f64] {
        &mut self.values[k * self.environments..][..self.environments]
    }

    /// The values of the parameter `target`; none where it is not randomized.
    #[must_use]
    pub fn of(&self, target: &Target) -> Option<&[f64]> {
        self.targets.iter().position(|other| other == target).map(|k| self.row(k))
    }

    /// All values of environment `i`, in the order of [`targets`](Self::targets).
    pub fn environment(&self, i: usize) -> impl Iterator<Item = f64> {
        (0..self.targets.len()).map(move |k| self.row(k)[i])
    }

    /// All values, shape (parameters, environments), row after row.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Lanes, one an environment, of a simulator whose parameters are `nominal`, of which row `k` of this table is the one
    /// numbered `places[k]`.
    ///
    /// # Panics
    /// If a place is beyond the parameters: an error of the calling code, not of any input.
    #[must_use]
    pub fn lanes(&self, nominal: &[f64], places: &[usize]) -> Thetas {
        let mut lanes = vec![nominal.to_vec(); self.environments];
        for (k, place) in places.iter().enumerate() {
            for (lane, value) in lanes.iter_mut().zip(self.row(k)) {
                lane[*place] = *value;
            }
        }
        Thetas::from_lanes(&lanes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_parameters_and_lanes_are_environments() {
        let mut table = DrawTable::nominal(vec![Target::own("a"), Target::of("m", "b")], &[1.0, 2.0], 3);
        table.row_mut(1).copy_from_slice(&[5.0, 6.0, 7.0]);
        assert_eq!(table.values(), [1.0, 1.0, 1.0, 5.0, 6.0, 7.0]);
        assert_eq!(table.of(&Target::of("m", "b")), Some(&[5.0, 6.0, 7.0][..]));
        assert_eq!(table.of(&Target::own("b")), None);
        assert_eq!(table.environment(1).collect::<Vec<_>>(), [1.0, 6.0]);
        let lanes = table.lanes(&[0.0, 8.0, 9.0], &[2, 0]);
        assert_eq!((lanes.lanes(), lanes.parameters()), (3, 3));
        assert_eq!([lanes.row(0), lanes.row(1), lanes.row(2)], [&[5.0, 6.0, 7.0], &[8.0; 3], &[1.0; 3]]);
    }
}
