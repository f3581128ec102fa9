//! The contract of laws and dynamics in the lanes of an environment, as a function.

use super::check::Violation;
use super::{
    Assembly, Clock, LaneDynamics, LaneRun, Mechanism, Observation, Plant, Recording, Registry, Seed, Stimulus, Thetas,
    Ticks,
};

/// What a lane reports, row by row.
type Seen = Vec<Vec<f64>>;

/// Runs `mechanism`, in each of its forms that `plant` is open to, in lanes that begin at different times, and holds each to what
/// it does alone: after a lane before it had other parameters and was under way, with its parameters changed on the way, and as
/// the copy of another. The commands are those of `recording`, which must move the plant.
///
/// # Errors
/// The first line of the contract that is broken.
pub fn check_lanes<P: Plant<Input = ()>>(
    mechanism: &'static dyn Mechanism<P>,
    plant: &P,
    registry: Registry<P>,
    recording: &Recording<P::Stimulus>,
) -> Result<(), Violation>
where
    P::Dynamics: LaneDynamics<P>,
{
    let typical = plant.typical(std::slice::from_ref(recording));
    for (index, form) in mechanism.forms(&typical).into_iter().enumerate() {
        if !plant.open_to(mechanism.site(index)) || !mechanism.applies(index, plant, &recording.stimulus) {
            continue;
        }
        let fail = |what: String| {
            Err(Violation { subject: mechanism.about().name.to_owned(), what: format!("form `{}` {what}", form.name) })
        };
        // Values at which it acts, and others.
        let own = |share: f64| -> Vec<f64> {
            let acting = form.parameters.iter().map(|p| {
                let start = *p.starts.last().unwrap_or(&p.nominal);
                (share * start).clamp(p.lower, p.upper)
            });
            plant.parameters().into_iter().map(|p| p.nominal).chain(acting).collect()
        };
        let trial = Trial::new(plant, registry, mechanism, index, recording);
        let Some(trial) = trial else { return fail("does not run in lanes".into()) };
        let (values, mut others) = (own(1.0), own(0.8));
        others[0] *= 1.25;
        let alone = trial.follow(1, |run, row| trial.begin_at(run, row, 0, 0, &values));
        let among = trial.follow(3, |run, row| {
            trial.begin_at(run, row, 0, 0, &others);
            // The lane in the middle was under way, with other parameters, for a part of the rows before.
            trial.begin_at(run, row, 0, 1, &others);
            trial.begin_at(run, row, trial.late, 1, &values);
            trial.begin_at(run, row, 0, 2, &values);
        });
        let rows = trial.rows - trial.late;
        if among[1][trial.late..] != alone[0][..rows] {
            return fail("does not begin anew in a lane as it begins alone".into());
        }
        if among[2] != alone[0] {
            return fail("differs in a lane beside others".into());
        }
        let retuned = trial.follow(2, |run, row| {
            trial.begin_at(run, row, 0, 0, &others);
            trial.begin_at(run, row, 0, 1, &values);
            if row == trial.late {
                run.retune(0, &values);
                run.copy(0, 1);
            }
        });
        if retuned[0][trial.late..] != retuned[1][trial.late..] {
            return fail("does not go on in a copy as in its original".into());
        }
        let kept = trial.follow(1, |run, row| trial.begin_at(run, row, 0, 0, &others));
        if retuned[0][..trial.late] != kept[0][..trial.late] || retuned[0] == kept[0] {
            return fail("does not change with its parameters, or changes before".into());
        }
        // Changed before anything is remembered, it is as if it had begun with them.
        let early = trial.follow(1, |run, row| {
            trial.begin_at(run, row, 0, 0, &others);
            if row == 0 {
                run.retune(0, &values);
            }
        });
        if early[0] != alone[0] {
            return fail("remembers the parameters it had before they were changed".into());
        }
    }
    Ok(())
}

struct Trial<'a, P: Plant> {
    assembly: Assembly<P>,
    recording: &'a Recording<P::Stimulus>,
    /// Length of rows and of steps of integration [s].
    spacing: f64,
    substeps: usize,
    rows: usize,
    /// Row at which a lane begins late.
    late: usize,
    initial: Vec<f64>,
}

impl<'a, P: Plant<Input = ()>> Trial<'a, P>
where
    P::Dynamics: LaneDynamics<P>,
{
    fn new(
        plant: &P,
        registry: Registry<P>,
        mechanism: &'static dyn Mechanism<P>,
        form: usize,
        recording: &'a Recording<P::Stimulus>,
    ) -> Option<Self> {
        let parameters = mechanism.forms(&Default::default())[form].parameters.clone();
        let assembly = Assembly::new(plant.clone(), registry).with_mechanism(mechanism, form, parameters);
        let spacing = recording.time.get(1)? - recording.time[0];
        let substeps = match plant.clock() {
            Clock::Event => return None,
            clock => clock.substeps(spacing),
        };
        let rows = recording.len();
        let initial = plant.initial_parameters(recording, 0).into_iter().map(|p| p.nominal).collect();
        Some(Self { assembly, recording, spacing, substeps, rows, late: rows / 3, initial })
    }

    /// Begins lane `lane` in the row `first`, if that is `row`; its seed is always the same.
    fn begin_at(&self, run: &mut LaneRun<P>, row: usize, first: usize, lane: usize, values: &[f64]) {
        if row == first {
            let dynamics = self.assembly.plant().dynamics(&Thetas::single(values).block(0, self.assembly.own().len()));
            let Some(state) = super::Dynamics::initial(&dynamics, &Thetas::single(&self.initial)).pop() else { return };
            if row == 0 {
                run.begin(lane, values, state, Seed(9));
            } else if let Ok(mut first) = LaneRun::new(&self.assembly, 1, &self.initial) {
                // As environments do it: in a run that has never taken a step.
                first.begin(0, values, state, Seed(9));
                run.adopt(&mut first, 0, lane);
            }
        }
    }

    /// What each of `lanes` lanes reports; `change` is told the row that is about to begin. The lane numbered 1 of three begins
    /// its clock and its commands anew in the row `late`.
    fn follow(&self, lanes: usize, mut change: impl FnMut(&mut LaneRun<P>, usize)) -> Vec<Seen> {
        let Ok(mut run) = LaneRun::new(&self.assembly, lanes, &self.initial) else { return Vec::new() };
        let mut seen = vec![Vec::new(); lanes];
        let channels = self.assembly.plant().channels().len();
        let step = self.spacing / self.substeps as f64;
        for row in 0..self.rows {
            change(&mut run, row);
            let own = |lane: usize| if lanes == 3 && lane == 1 && row >= self.late { row - self.late } else { row };
            let times = |part: usize| -> Vec<f64> {
                (0..lanes).map(|lane| (own(lane) * self.substeps + part) as f64 * step).collect()
            };
            for (lane, observation) in run.observe(&times(0)).iter().enumerate() {
                seen[lane].push((0..channels).map(|k| observation.channel(k)).collect());
            }
            let commands: Vec<P::Command> = (0..lanes).map(|lane| self.recording.stimulus.command(own(lane))).collect();
            for part in 0..self.substeps {
                run.step(Ticks { step, times: &times(part) }, &commands);
            }
        }
        seen
    }
}
