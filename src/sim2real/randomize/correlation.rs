//! Parameters that are drawn together: a Gaussian copula.

use nalgebra::{DMatrix, SymmetricEigen};

use super::Target;

/// How much two parameters go together.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    /// The two.
    pub between: [Target; 2],
    /// The correlation of the Gaussian copula, between -1 and 1: that of the two themselves where both are Gaussian.
    pub coefficient: f64,
}

/// Why parameters cannot be drawn together as is asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CorrelationError {
    /// A coefficient that is none.
    #[error(
        "expected a correlation of `{first}` and `{second}` between -1 and 1, found {found}\nhint: neither end can be: two that always go together are one"
    )]
    Coefficient {
        /// The one.
        first: String,
        /// The other.
        second: String,
        /// What was found.
        found: f64,
    },
    /// A parameter that is not randomized.
    #[error("`{name}` is correlated and not randomized\nhint: {hint}")]
    Unknown {
        /// Its name.
        name: String,
        /// What may be meant.
        hint: String,
    },
    /// A pair twice, or one with itself.
    #[error("the correlation of `{first}` and `{second}` is said twice\nhint: drop one of the two")]
    Twice {
        /// The one.
        first: String,
        /// The other.
        second: String,
    },
    /// Drawn at different times.
    #[error("`{first}` and `{second}` are correlated and not drawn at the same time\nhint: give both the same `at`")]
    Apart {
        /// The one.
        first: String,
        /// The other.
        second: String,
    },
    /// No such numbers exist.
    #[error(
        "no numbers have these correlations: the matrix of {names} is not positive definite, its smallest eigenvalue is {smallest:.4}\n{matrix}\nhint: bring the coefficients nearer to 0, or give the pairs that are left out"
    )]
    NotPositiveDefinite {
        /// The parameters, in the order of the matrix.
        names: String,
        /// The matrix, a row a line.
        matrix: String,
        /// Its smallest eigenvalue.
        smallest: f64,
    },
}

/// Parameters that are drawn together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    /// Their numbers among the randomized.
    pub members: Vec<usize>,
    /// The lower triangle of the Cholesky factor of their correlations, row after row with the diagonal.
    factor: Vec<f64>,
}

impl Group {
    /// The group of `members`, which have these `names` and correlations.
    fn new(members: Vec<usize>, names: &[String], matrix: &DMatrix<f64>) -> Result<Self, CorrelationError> {
        let smallest = SymmetricEigen::new(matrix.clone()).eigenvalues.min();
        // A factor of a matrix this near to singular would be of rounding alone.
        let factor = if smallest > 1e-10 { matrix.clone().cholesky() } else { None };
        let Some(factor) = factor else {
            let row = |row: usize| {
                let cells: Vec<String> = matrix.row(row).iter().map(|cell| format!("{cell:7.3}")).collect();
                format!("  [{}]", cells.join(" "))
            };
            return Err(CorrelationError::NotPositiveDefinite {
                names: names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
                matrix: (0..matrix.nrows()).map(row).collect::<Vec<_>>().join("\n"),
                smallest,
            });
        };
        let factor = factor.l();
        let factor = (0..members.len()).flat_map(|row| (0..=row).map(move |column| (row, column))).map(|at| factor[at]);
        Ok(Self { factor: factor.collect(), members })
    }

    /// Turns independent standard normal numbers, one a member, into correlated ones.
    #[inline(always)]
    pub fn correlate<const N: usize>(&self, normal: &mut [[f64; N]]) {
        // From the last row on: each needs those before it as they were.
        let mut end = self.factor.len();
        for row in (0..normal.len()).rev() {
            let start = end - (row + 1);
            let mut sums = [0.0; N];
            for (l, z) in self.factor[start..end].iter().zip(&normal[..=row]) {
                for k in 0..N {
                    sums[k] += l * z[k];
                }
            }
            normal[row] = sums;
            end = start;
        }
    }
}

/// The groups that `correlations` make of parameters of these `names`, each drawn together; `together` says whether two are
/// drawn at the same time.
pub(super) fn groups(
    names: &[String],
    correlations: &[Correlation],
    together: impl Fn(usize, usize) -> bool,
) -> Result<Vec<Group>, CorrelationError> {
    let count = names.len();
    let mut matrix = DMatrix::<f64>::identity(count, count);
    // Which group each is in, by its least member.
    let mut group: Vec<usize> = (0..count).collect();
    for correlation in correlations {
        let [first, second] = correlation.between.each_ref().map(ToString::to_string);
        let number = |name: &str| {
            names.iter().position(|other| other == name).ok_or_else(|| CorrelationError::Unknown {
                name: name.to_owned(),
                hint: format!("randomized are {}", names.join(", ")),
            })
        };
        let (a, b) = (number(&first)?, number(&second)?);
        let found = correlation.coefficient;
        if a == b || found.is_nan() || found.abs() >= 1.0 {
            return Err(CorrelationError::Coefficient { first, second, found });
        }
        if matrix[(a, b)] != 0.0 {
            return Err(CorrelationError::Twice { first, second });
        }
        if !together(a, b) {
            return Err(CorrelationError::Apart { first, second });
        }
        (matrix[(a, b)], matrix[(b, a)]) = (found, found);
        let (from, to) = (group[a].max(group[b]), group[a].min(group[b]));
        group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
    }
    let mut all = Vec::new();
    for least in 0..count {
        let members: Vec<usize> = (0..count).filter(|k| group[*k] == least).collect();
        if members.len() > 1 {
            let part = DMatrix::from_fn(members.len(), members.len(), |i, j| matrix[(members[i], members[j])]);
            let names: Vec<String> = members.iter().map(|k| names[*k].clone()).collect();
            all.push(Group::new(members, &names, &part)?);
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Vec<String> {
        ["a", "b", "c", "d"].map(str::to_owned).to_vec()
    }

    fn pair(first: &str, second: &str, coefficient: f64) -> Correlation {
        Correlation { between: [Target::own(first), Target::own(second)], coefficient }
    }

    #[test]
    fn pairs_make_groups_and_their_factor_the_correlations() {
        let made = groups(&names(), &[pair("d", "b", 0.5), pair("b", "a", -0.3)], |_, _| true).unwrap();
        assert_eq!(made.len(), 1);
        assert_eq!(made[0].members, [0, 1, 3]);
        // L L' by what it makes of unit vectors.
        let mut columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        made[0].correlate(&mut columns);
        let product = |i: usize, j: usize| columns[i].iter().zip(columns[j]).map(|(a, b)| a * b).sum::<f64>();
        for (i, j, expected) in [(0, 0, 1.0), (1, 1, 1.0), (2, 2, 1.0), (0, 1, -0.3), (1, 2, 0.5), (0, 2, 0.0)] {
            assert!((product(i, j) - expected).abs() < 1e-12, "{i} {j}");
        }
    }

    #[test]
    fn impossible_correlations_are_refused_with_matrix_and_eigenvalue() {
        let all = [pair("a", "b", 0.9), pair("b", "c", 0.9), pair("a", "c", -0.9)];
        let text = groups(&names(), &all, |_, _| true).unwrap_err().to_string();
        // Eigenvalues of this matrix are 1.9 twice and 1 - 2 * 0.9.
        assert!(text.contains("`a`, `b`, `c`") && text.contains("-0.8000") && text.contains("0.900"), "{text}");
        let refused = |correlations: &[Correlation], together: bool| {
            let text = groups(&names(), correlations, |_, _| together).unwrap_err().to_string();
            assert!(text.contains("\nhint: "), "{text}");
            text
        };
        assert!(refused(&[pair("a", "b", 1.0)], true).contains("found 1"));
        assert!(refused(&[pair("a", "b", f64::NAN)], true).contains("found NaN"));
        assert!(refused(&[pair("a", "a", 0.5)], true).contains("`a` and `a`"));
        assert!(refused(&[pair("a", "x", 0.5)], true).contains("`x` is correlated and not randomized"));
        assert!(refused(&[pair("a", "b", 0.5), pair("b", "a", 0.5)], true).contains("twice"));
        assert!(refused(&[pair("a", "b", 0.5)], false).contains("same time"));
    }
}
