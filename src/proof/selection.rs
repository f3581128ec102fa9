//! Selection of terms in a linear regression, one by one: what the baselines share.

use nalgebra::DVector;

/// What a mechanism would add, with its inner numbers fixed.
#[derive(Debug, Clone)]
pub(super) struct Term {
    pub id: &'static str,
    pub columns: Vec<DVector<f64>>,
}

/// Terms named at most.
const MOST: usize = 3;
/// A term must lower the Bayesian information criterion by this ...
const WORTH: f64 = 10.0;
/// ... and the squared error by this part, for with errors in the terms themselves the criterion alone keeps everything.
const SHARE: f64 = 0.05;

/// The names of the terms of `library` that explain `response` beside what is `known` anyway, strongest first.
pub(super) fn selected(mut response: DVector<f64>, known: Vec<DVector<f64>>, library: &[Term]) -> Vec<String> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    known.into_iter().for_each(|direction| explain(&mut basis, &mut response, direction));
    let count = response.len() as f64;
    let mut names: Vec<String> = Vec::new();
    for _ in 0..MOST {
        let before = response.norm_squared();
        let open = library.iter().filter(|term| !names.iter().any(|name| name == term.id));
        let tried = open.map(|term| {
            let after = remaining(&basis, &response, term);
            (count * (before / after.max(1e-300)).ln() - (term.columns.len() as f64 + 1.0) * count.ln(), after, term)
        });
        let Some((gain, after, term)) = tried.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if gain < WORTH || after > (1.0 - SHARE) * before {
            break;
        }
        names.push(term.id.to_owned());
        term.columns.iter().for_each(|column| explain(&mut basis, &mut response, column.clone()));
    }
    names
}

/// Takes what `direction` explains out of what is left, and `direction` into the orthonormal basis.
fn explain(basis: &mut Vec<DVector<f64>>, left: &mut DVector<f64>, mut direction: DVector<f64>) {
    let whole = direction.norm();
    for _ in 0..2 {
        basis.iter().for_each(|known| direction -= known * known.dot(&direction));
    }
    let size = direction.norm();
    if size > 1e-8 * whole {
        direction /= size;
        *left -= &direction * direction.dot(left);
        basis.push(direction);
    }
}

/// Squared error that a term would leave.
fn remaining(basis: &[DVector<f64>], left: &DVector<f64>, term: &Term) -> f64 {
    let (mut basis, mut left) = (basis.to_vec(), left.clone());
    term.columns.iter().for_each(|column| explain(&mut basis, &mut left, column.clone()));
    left.norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_that_explain_are_named_strongest_first() {
        let column = |of: fn(f64) -> f64| DVector::from_fn(200, |row, _| of(row as f64));
        let term = |id, column: &DVector<f64>| Term { id, columns: vec![column.clone()] };
        let (slow, fast, none) = (column(|x| (0.1 * x).sin()), column(|x| (1.3 * x).cos()), column(|x| (2.1 * x).sin()));
        let response = 3.0 * &fast + &slow + column(|_| 7.0) + 0.1 * column(|x| (x * x).sin());
        let library = [term("slow", &slow), term("fast", &fast), term("none", &none)];
        assert_eq!(selected(response, vec![column(|_| 1.0)], &library), ["fast", "slow"]);
        assert!(selected(column(|x| (x * x).sin()), Vec::new(), &library).is_empty());
    }
}
