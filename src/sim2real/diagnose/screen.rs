//! Screening: what each mechanism would change, and how much of that the misfit looks like.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Inquiry};
use crate::sim2real::identify::columns::{gram, products, slices, take_out};
use crate::sim2real::identify::{Block, State};
use crate::sim2real::{Candidate, Twin};

/// Points followed side by side: more gain no speed and cost memory.
const LANES: usize = 16;
/// Signatures shorter than this, in units of the noise and over all rows, are not excited: the recordings would look the
/// same with and without the mechanism.
const EXCITED: f64 = 3.0;

/// A refit whose mean squared residual is this many times the noise may have been bent by what is missing.
const BENT: f64 = 1.5;

/// What screening found of one candidate.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Screened {
    /// Number of the candidate.
    pub number: usize,
    /// Correlation of its projected signature with the projected residual, at its best start; 0 where it would have to act
    /// the other way round.
    pub score: f64,
    /// The part of the signature that refitting the parent's parameters could not hide.
    pub survival: f64,
    /// Whether its largest start would change what is measured by more than the noise.
    pub excited: bool,
    /// Where to begin, the most promising first: values of all parameters, the twin's own and its own.
    pub starts: Vec<Vec<f64>>,
    /// Its projected signature at the best start, of length 1.
    pub signature: DVector<f64>,
}

/// Screens every candidate that is `wanted` and that `parent` does not have.
///
/// A refit that had to do without a mechanism has been bent by it, sometimes out of all likeness: the twin with its
/// parameters as given is looked at too, where nothing has been added yet.
pub(super) fn signatures<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    parent: &Hypothesis<T>,
    wanted: impl Fn(&Candidate) -> bool + Sync,
) -> Vec<Screened> {
    let mut stands = vec![parent.fit.values.clone()];
    if parent.added.is_empty() && parent.misfits.iter().any(|m| m.sum_of_squares > BENT * m.count as f64) {
        stands.push(parent.twin.parameters().iter().map(|p| p.nominal).collect());
    }
    let grounds: Vec<Ground> = stands.par_iter().map(|values| Ground::new(inquiry, parent, values)).collect();
    let has: Vec<&str> = parent.added.iter().map(|n| inquiry.candidates[*n].about.name).collect();
    let (wider, plain): (Vec<usize>, Vec<usize>) = (0..inquiry.candidates.len())
        .filter(|number| !inquiry.candidates[*number].finishing && wanted(&inquiry.candidates[*number]))
        .filter(|number| !has.contains(&inquiry.candidates[*number].about.name))
        .filter(|number| differs(&inquiry.candidates[*number], &has))
        .partition(|number| inquiry.candidates[*number].general);
    let mut screened: Vec<Screened> =
        plain.into_par_iter().filter_map(|number| screen(inquiry, parent, number, &grounds)).collect();
    let of_wider: Vec<Screened> =
        wider.into_iter().filter_map(|number| widened(inquiry.candidates, number, &screened)).collect();
    screened.extend(of_wider);
    screened
}

/// Whether `candidate` says anything else than a plainer form of its mechanism beside what is there.
fn differs(candidate: &Candidate, has: &[&str]) -> bool {
    candidate.beside.is_empty() || candidate.beside.iter().any(|other| has.contains(other))
}

/// A wider law, of which the form of its mechanism that screening likes best is one case: it begins as that does, and what it has beyond
/// that as it may.
fn widened(candidates: &[Candidate], number: usize, screened: &[Screened]) -> Option<Screened> {
    let own = &candidates[number];
    let alike = screened.iter().filter(|one| candidates[one.number].about.name == own.about.name);
    let plain = alike.max_by(|a, b| a.score.total_cmp(&b.score))?;
    let known = &candidates[plain.number].form.parameters;
    let start = |plain: &Vec<f64>| -> Vec<f64> {
        let (twins, of_plain) = plain.split_at(plain.len() - known.len());
        let begun = own.form.parameters.iter().enumerate().map(|(k, parameter)| match known.get(k) {
            Some(same) if same.unit == parameter.unit => of_plain[k].clamp(parameter.lower, parameter.upper),
            _ if parameter.linear => parameter.nominal,
            _ => parameter.starts.first().copied().unwrap_or(parameter.nominal),
        });
        twins.iter().copied().chain(begun).collect()
    };
    Some(Screened { number, starts: plain.starts.iter().map(start).collect(), ..plain.clone() })
}

/// What a signature is compared with: the parent's residual, and the directions its parameters can move it in.
struct Ground {
    /// Values of the parent's parameters.
    values: Vec<f64>,
    /// What initial states explain, part by part.
    basis: Vec<DMatrix<f64>>,
    state: State,
    /// The parent's residual with the initial states' share taken out.
    followed: DVector<f64>,
    scale: DVector<f64>,
    hidden: DMatrix<f64>,
    residual: DVector<f64>,
}

impl Ground {
    /// Beside `parent` at these values of its parameters. Channels are brought to the same size first, so that a large misfit in one does
    /// not drown another.
    fn new<T: Twin>(inquiry: &Inquiry<'_, T>, parent: &Hypothesis<T>, values: &[f64]) -> Self {
        let problem = inquiry.problem(&parent.twin, &inquiry.evidence.compared);
        let blocks = problem.blocks();
        let state = parent.fit.state.clone();
        let evaluation = problem.evaluate(values, &state, &parent.fit.free);
        let (rows, basis) = (evaluation.measured, evaluation.initial_basis);
        let followed = problem.residuals(&[values.to_vec()], &state, &basis).pop();
        let followed = followed.unwrap_or_else(|| DVector::zeros(rows));
        let scale = scale(&followed, parent, &blocks);
        let mut jacobian = evaluation.jacobian.rows(0, rows).into_owned();
        for mut column in jacobian.column_iter_mut() {
            column.component_mul_assign(&scale);
        }
        let hidden = orthonormal(jacobian);
        let mut residual = followed.component_mul(&scale);
        without(&mut [residual.as_mut_slice()], &hidden);
        Self { values: values.to_vec(), basis, state, followed, scale, hidden, residual }
    }

    /// The signatures of points at which these `residuals` are left, projected.
    fn signatures(&self, residuals: Vec<DVector<f64>>) -> Vec<Signature> {
        let mut signatures: Vec<Signature> = residuals
            .into_iter()
            .map(|mut residual| {
                let (mut loud, mut whole) = (0.0, 0.0);
                for ((value, followed), scale) in residual.iter_mut().zip(self.followed.iter()).zip(self.scale.iter()) {
                    let signature = followed - *value;
                    loud += signature * signature;
                    *value = signature * scale;
                    whole += *value * *value;
                }
                Signature { projected: residual, loud: loud.sqrt(), whole: whole.sqrt(), length: 0.0 }
            })
            .collect();
        without(&mut signatures.iter_mut().map(|s| s.projected.as_mut_slice()).collect::<Vec<_>>(), &self.hidden);
        signatures.iter_mut().for_each(|s| s.length = s.projected.norm());
        signatures
    }
}

/// What a point of a candidate's parameters changes.
struct Signature {
    /// With channels brought to the same size, and what the parent's parameters could do taken out.
    projected: DVector<f64>,
    /// The length of the change, in units of the noise.
    loud: f64,
    /// The length with channels brought to the same size.
    whole: f64,
    /// The length of what is left once projected.
    length: f64,
}

impl Signature {
    fn usable(&self) -> bool {
        self.length > 1e-9 * self.whole && self.whole.is_finite() && self.whole > 0.0
    }
}

fn scale<T>(residual: &DVector<f64>, parent: &Hypothesis<T>, blocks: &[Block]) -> DVector<f64> {
    let mut scale = DVector::from_element(residual.len(), 0.0);
    for misfit in &parent.misfits {
        let own: Vec<&Block> = blocks.iter().filter(|b| b.channel == misfit.channel).collect();
        let squares: f64 = own.iter().map(|b| residual.rows(b.range.start, b.range.len()).norm_squared()).sum();
        let size = (squares / misfit.count.max(1) as f64).sqrt();
        for block in own {
            scale.rows_mut(block.range.start, block.range.len()).fill(if size > 0.0 { 1.0 / size } else { 0.0 });
        }
    }
    scale
}

/// An orthonormal basis of the columns' span: Gram and Schmidt, twice, for columns may be nearly alike.
fn orthonormal(columns: DMatrix<f64>) -> DMatrix<f64> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in columns.column_iter() {
        let length = column.norm();
        if !(length > 0.0 && length.is_finite()) {
            continue;
        }
        let mut left = column / length;
        for _ in 0..2 {
            for known in &basis {
                left.axpy(-known.dot(&left), known, 1.0);
            }
        }
        let rest = left.norm();
        if rest > 1e-7 {
            basis.push(left / rest);
        }
    }
    if basis.is_empty() { DMatrix::zeros(columns.nrows(), 0) } else { DMatrix::from_columns(&basis) }
}

/// Takes out of `columns` what lies along an orthonormal `basis`.
fn without(columns: &mut [&mut [f64]], basis: &DMatrix<f64>) {
    let basis = slices(basis);
    let along = products(&basis, &columns.iter().map(|column| &**column).collect::<Vec<_>>());
    take_out(columns, &basis, &along);
}

/// A point of a candidate's parameters as screening saw it.
struct Tried {
    score: f64,
    survival: f64,
    start: Vec<f64>,
    /// The length of its signature.
    length: f64,
}

fn screen<T: Twin>(inquiry: &Inquiry<'_, T>, parent: &Hypothesis<T>, number: usize, grounds: &[Ground]) -> Option<Screened> {
    let candidate = &inquiry.candidates[number];
    let trials = trials(candidate);
    let twin = parent.twin.with(candidate);
    let problem = inquiry.problem(&twin, &inquiry.evidence.compared);
    let mut best: Option<Screened> = None;
    let mut loudest = 0.0_f64;
    let mut starts: Vec<(f64, Vec<f64>)> = Vec::new();
    for ground in grounds {
        let mut tried: Vec<Tried> = Vec::new();
        for batch in trials.chunks(batch(trials.len(), trials[0].len())) {
            let thetas: Vec<Vec<f64>> =
                batch.iter().flatten().map(|point| ground.values.iter().chain(point).copied().collect()).collect();
            let mut found = ground.signatures(problem.residuals(&thetas, &ground.state, &ground.basis)).into_iter();
            for points in batch {
                let signatures: Vec<Signature> = found.by_ref().take(points.len()).collect();
                loudest = signatures.iter().map(|s| s.loud).filter(|n| n.is_finite()).fold(loudest, f64::max);
                let Some((one, signature)) = explained(candidate, points, signatures, ground) else { continue };
                // Of all points but the best the numbers are enough: signatures are as long as the recordings.
                if best.as_ref().is_none_or(|best| one.score > best.score) {
                    let (score, survival) = (one.score, one.survival);
                    best = Some(Screened { number, score, survival, excited: true, starts: Vec::new(), signature });
                }
                tried.push(one);
            }
        }
        tried.sort_by(|a, b| b.score.total_cmp(&a.score));
        let whole = |start: &[f64]| -> Vec<f64> { ground.values.iter().chain(start).copied().collect() };
        for one in &tried {
            starts.extend(scaled(candidate, one, ground).map(|start| (one.score, whole(&start))));
            starts.push((one.score, whole(&one.start)));
        }
    }
    // Stable: of equal scores the refitted twin's come first.
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let starts = starts.into_iter().map(|(_, start)| start).collect();
    best.map(|best| Screened { score: best.score.max(0.0), excited: loudest > EXCITED, starts, ..best })
}

/// How many of so many trials of so many points each are followed side by side: as many each time.
fn batch(trials: usize, points: usize) -> usize {
    let most = (LANES / points.max(1)).max(1);
    trials.div_ceil(trials.div_ceil(most).max(1)).max(1)
}

/// The points to follow: each entry holds one point, or, for a law with parameters it is proportional to, one point for
/// each of these alone.
fn trials(candidate: &Candidate) -> Vec<Vec<Vec<f64>>> {
    let parameters = &candidate.form.parameters;
    let own = |k: usize| -> Vec<f64> {
        let p = &parameters[k];
        if p.starts.is_empty() { vec![p.nominal] } else { p.starts.clone() }
    };
    let combined = (0..parameters.len()).fold(vec![Vec::new()], |so_far: Vec<Vec<f64>>, k| {
        // Those that are solved for stay out of the way until it is their turn.
        let values = if parameters[k].linear { vec![parameters[k].nominal] } else { own(k) };
        so_far.iter().flat_map(|head| values.iter().map(move |v| head.iter().copied().chain([*v]).collect())).collect()
    });
    let linear: Vec<usize> = (0..parameters.len()).filter(|k| parameters[*k].linear).collect();
    if !linear.is_empty() {
        let alone = |point: &Vec<f64>| -> Vec<Vec<f64>> {
            let with = |k: &usize| {
                let mut point = point.clone();
                point[*k] = parameters[*k].starts.first().copied().unwrap_or(parameters[*k].nominal);
                point
            };
            linear.iter().map(with).collect()
        };
        return combined.iter().map(alone).collect();
    }
    // A tenth of the way to a first start is small enough to tell the direction in which an effect begins.
    let probe = match parameters.as_slice() {
        [p] if p.smooth && p.nominal.is_finite() => {
            p.starts.first().map(|start| vec![p.nominal + 0.1 * (start - p.nominal)])
        }
        _ => None,
    };
    probe.into_iter().chain(combined).map(|point| vec![point]).collect()
}

/// How much of the misfit the signatures of `points` explain together, where that would have the parameters, and the signature of
/// it, projected and of length 1.
fn explained(
    candidate: &Candidate,
    points: &[Vec<f64>],
    signatures: Vec<Signature>,
    ground: &Ground,
) -> Option<(Tried, DVector<f64>)> {
    let parameters = &candidate.form.parameters;
    let linear: Vec<usize> = (0..parameters.len()).filter(|k| parameters[*k].linear).collect();
    let misfit = ground.residual.norm();
    if misfit <= 0.0 {
        return None;
    }
    if linear.is_empty() {
        let Signature { projected, whole, length, .. } = signatures.into_iter().next().filter(Signature::usable)?;
        let score = projected.dot(&ground.residual) / (length * misfit);
        let survival = length / whole;
        return Some((Tried { score, survival, start: points[0].clone(), length }, projected / length));
    }
    let mut used: Vec<usize> = (0..signatures.len()).filter(|i| signatures[*i].usable()).collect();
    loop {
        if used.is_empty() {
            return opposed(points, signatures.into_iter().find(Signature::usable)?);
        }
        let columns: Vec<&[f64]> = used.iter().map(|i| signatures[*i].projected.as_slice()).collect();
        let gram = gram(&columns);
        let least = 1e-12 * gram.trace();
        let weights = gram.pseudo_inverse(least).ok()? * products(&columns, &[ground.residual.as_slice()]);
        let mut start = points[0].clone();
        linear.iter().for_each(|k| start[*k] = parameters[*k].nominal);
        let mut outside = None;
        for (i, weight) in used.iter().zip(weights.iter()) {
            let (k, p) = (linear[*i], &parameters[linear[*i]]);
            start[k] = p.nominal + weight * (points[*i][k] - p.nominal);
            if !(p.lower..=p.upper).contains(&start[k]) {
                outside = outside.or(Some(*i));
            }
        }
        match outside {
            // It would have to act the other way round: it takes no part.
            Some(i) => used.retain(|other| *other != i),
            None => {
                let mut signature = DVector::zeros(ground.residual.len());
                take_out(&mut [signature.as_mut_slice()], &columns, &-&weights);
                let length = signature.norm();
                let whole: f64 = used.iter().zip(weights.iter()).map(|(i, w)| (w * signatures[*i].whole).powi(2)).sum();
                let survival = (length / whole.sqrt()).min(1.0);
                let tried = Tried { score: length / misfit, survival, start, length };
                return (length > 0.0).then(|| (tried, signature / length));
            }
        }
    }
}

/// A law that would have to act the other way round, at its first start: what refitting hides most of may turn round once
/// it is fitted jointly.
fn opposed(points: &[Vec<f64>], signature: Signature) -> Option<(Tried, DVector<f64>)> {
    let Signature { projected, whole, length, .. } = signature;
    let start = points.first()?.clone();
    Some((Tried { score: 0.0, survival: length / whole, start, length }, projected / length))
}

/// The start moved along its own direction as far as the misfit reaches, where its law has one parameter and that is of
/// some use.
fn scaled(candidate: &Candidate, tried: &Tried, ground: &Ground) -> Option<Vec<f64>> {
    let [p] = candidate.form.parameters.as_slice() else { return None };
    let reach = tried.score * ground.residual.norm();
    let factor = reach / tried.length.max(1e-300);
    let value = p.nominal + factor * (tried.start[0] - p.nominal);
    let sensible = value.is_finite() && (0.01..100.0).contains(&factor) && (factor - 1.0).abs() > 0.2;
    (sensible && p.smooth && !p.linear).then(|| vec![value.clamp(p.lower, p.upper)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::{About, Form, Parameter, Site};

    fn candidate(general: bool, parameters: Vec<Parameter>) -> Candidate {
        let about = About { name: "teeth", site: Site::Plant, title: "", law: "", source: "", remedy: "", contains: &[] };
        let form = Form { name: if general { "wide" } else { "plain" }, parameters };
        Candidate { general, form_index: usize::from(general), ..Candidate::new(about, form) }
    }

    #[test]
    fn a_form_that_differs_beside_others_alone_is_tried_beside_these() {
        let plain = candidate(false, Vec::new());
        let rubbing = Candidate { beside: &["friction", "gears"], ..plain.clone() };
        assert!(differs(&plain, &[]) && differs(&plain, &["spring"]));
        assert!(!differs(&rubbing, &[]) && !differs(&rubbing, &["spring"]) && differs(&rubbing, &["spring", "gears"]));
    }

    #[test]
    fn a_wider_law_begins_where_the_plainer_one_would() {
        let parameter = |name, unit| Parameter::new(name, unit, 0.0).within(0.0, 10.0).starting_at(&[3.0]);
        let shared = vec![parameter("depth", "N m"), parameter("number", "")];
        let wide = vec![
            parameter("deepest", "N m"),
            parameter("per_length", "1/m"),
            parameter("angle", "rad"),
            parameter("second", "N m").proportional(),
        ];
        let candidates = [candidate(false, shared), candidate(true, wide)];
        let signature = DVector::from_element(2, 0.5);
        // One value of the twin's own; then those of the plainer law, of which one lies beyond what the wider may be.
        let starts = vec![vec![0.7, 12.0, 5.0]];
        let plain = Screened { number: 0, score: 0.4, survival: 0.9, excited: true, starts, signature };
        let found = widened(&candidates, 1, std::slice::from_ref(&plain)).unwrap();
        assert_eq!(found.starts, [vec![0.7, 10.0, 3.0, 3.0, 0.0]], "same units go on; others start, or do nothing yet");
        assert_eq!((found.number, found.score, found.excited), (1, 0.4, true));
        assert!(widened(&candidates, 1, &[]).is_none());
    }
}
