//! Many runs of one assembly side by side, each with its own clock, parameters and beginnings: the lanes of an environment.

use std::fmt;
use std::ops::Range;

use super::Dynamics;
use super::{Assembly, LaneChange, LaneImage, Law, Plant, Run, Seed, Simulator, Site, Thetas, Ticks};

/// The running part of a plant of which one lane can be changed while the others go on.
///
/// # Contract
/// After [`LaneChange::Retune`] a lane moves as one that was made with these parameters. [`check_lanes`](super::check_lanes) runs it.
pub trait LaneDynamics<P: Plant>: Dynamics<P> + Clone {
    /// Changes one lane: shows `change` all that is kept by lanes. A plant's dynamics remember nothing.
    fn change(&mut self, change: &LaneChange<'_>);
}

/// Runs of an assembly, one a lane. What a lane does depends on its parameters, its state at its beginning, its seed, its own
/// times and its commands, and on nothing else: to the bit.
pub struct LaneRun<P: Plant> {
    run: Run<P>,
    /// The plant's parameters among all.
    plant: Range<usize>,
    /// Those of each law, in the order in which the laws of a site act.
    of_laws: [Vec<Range<usize>>; 3],
    /// Each mechanism's id, the number of its site, and of its law there.
    places: Vec<(&'static str, usize, usize)>,
    forms: Vec<usize>,
}

impl<P: Plant> Clone for LaneRun<P>
where
    P::Dynamics: Clone,
{
    fn clone(&self) -> Self {
        let Self { run, plant, of_laws, places, forms } = self;
        let (run, plant, of_laws) = (run.clone(), plant.clone(), of_laws.clone());
        Self { run, plant, of_laws, places: places.clone(), forms: forms.clone() }
    }
}

impl<P: Plant> fmt::Debug for LaneRun<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LaneRun").field("lanes", &self.run.states().len()).finish_non_exhaustive()
    }
}

/// An assembly whose loop is closed by a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the assembly has a controller, and in an environment the agent is the controller\nhint: leave [controller] out of the twin"
)]
pub struct LoopIsClosed;

/// Commands, the plant, observations.
fn site_number(site: Site) -> usize {
    match site {
        Site::Command => 0,
        Site::Plant => 1,
        Site::Observation => 2,
    }
}

/// Of each law, which of an assembly's parameters it has, in the order in which the laws of a site act.
#[must_use]
pub(crate) fn law_parameters<P: Plant>(assembly: &Assembly<P>) -> [Vec<Range<usize>>; 3] {
    let mut of_laws = [const { Vec::new() }; 3];
    let mut at = assembly.own().len();
    for (mechanism, form, parameters) in assembly.mechanisms() {
        of_laws[site_number(mechanism.site(form))].push(at..at + parameters.len());
        at += parameters.len();
    }
    of_laws
}

impl<P: Plant> Run<P> {
    /// Gives the laws of lane `lane` these values of all of the assembly's parameters from now on, of which `of_laws` says whose they are;
    /// what they remember stays.
    pub(crate) fn retune_laws(&mut self, of_laws: &[Vec<Range<usize>>; 3], lane: usize, values: &[f64]) {
        let change = LaneChange::Retune { lane, values };
        change_laws(&mut self.command_laws, &of_laws[0], &change);
        change_laws(&mut self.plant_laws, &of_laws[1], &change);
        change_laws(&mut self.observation_laws, &of_laws[2], &change);
    }
}

/// Changes all laws of a run, each with the parameters it has in these ranges.
fn change_laws<P: Plant>(laws: &mut [Box<dyn Law<P>>], ranges: &[Range<usize>], change: &LaneChange<'_>) {
    for (law, range) in laws.iter_mut().zip(ranges) {
        law.change(&of_range(change, range));
    }
}

/// The same change of what has the parameters in `range`.
fn of_range<'a>(change: &LaneChange<'a>, range: &Range<usize>) -> LaneChange<'a> {
    match *change {
        LaneChange::Retune { lane, values } => {
            LaneChange::Retune { lane, values: values.get(range.clone()).unwrap_or_default() }
        }
        other => other,
    }
}

impl<P: Plant> LaneRun<P>
where
    P::Dynamics: LaneDynamics<P>,
{
    /// Runs of `assembly`, all with its nominal values and in the state that `initial` describes. Each has to
    /// [`begin`](Self::begin) before it is stepped.
    ///
    /// # Errors
    /// An assembly with a controller.
    pub fn new(assembly: &Assembly<P>, lanes: usize, initial: &[f64]) -> Result<Self, LoopIsClosed> {
        let plant = assembly.plant().parameters().len();
        if assembly.own().len() != plant {
            return Err(LoopIsClosed);
        }
        let nominal: Vec<f64> = assembly.parameters().iter().map(|p| p.nominal).collect();
        let thetas = Thetas::from_lanes(&vec![nominal; lanes]);
        let run = assembly.run(&thetas, &Thetas::from_lanes(&vec![initial; lanes]), Seed(0));
        let of_laws = law_parameters(assembly);
        let (mut places, mut forms, mut laws) = (Vec::new(), Vec::new(), [0; 3]);
        for (mechanism, form, _) in assembly.mechanisms() {
            let site = site_number(mechanism.site(form));
            places.push((mechanism.about().name, site, laws[site]));
            forms.push(form);
            laws[site] += 1;
        }
        Ok(Self { run, plant: 0..plant, of_laws, places, forms })
    }

    /// Begins lane `lane` anew in `state`, with `values` of all of the assembly's parameters; what is random in it depends on `seed`.
    pub fn begin(&mut self, lane: usize, values: &[f64], state: P::State, seed: Seed) {
        self.retune(lane, values);
        self.change(&LaneChange::Forget { lane, seed });
        self.hold(lane, state);
    }

    /// Gives lane `lane` these values of all of the assembly's parameters from now on; what it remembers stays.
    pub fn retune(&mut self, lane: usize, values: &[f64]) {
        self.change(&LaneChange::Retune { lane, values });
    }

    /// Lets lane `to` go on as lane `from` is.
    pub fn copy(&mut self, from: usize, to: usize) {
        let image = LaneImage::default();
        self.change(&LaneChange::Save { lane: from, image: &image });
        self.change(&LaneChange::Load { lane: to, image: &image });
        if let Some(other) = self.run.states.get(from).cloned()
            && let Some(own) = self.run.states.get_mut(to)
        {
            *own = other;
        }
    }

    /// Lets lane `to` go on as lane `from` of `other` is, which has the same mechanisms. It takes a copy of all of `other`: between
    /// lanes of one run, [`copy`](Self::copy) does not.
    pub fn copy_from(&mut self, other: &Self, from: usize, to: usize) {
        self.adopt(&mut other.clone(), from, to);
    }

    /// The same, where `other` need not be copied. What was last observed goes with it: a lane that begins while others are under way
    /// begins in a run of its own, and is observed there.
    pub fn adopt(&mut self, other: &mut Self, from: usize, to: usize) {
        let image = LaneImage::default();
        other.change(&LaneChange::Save { lane: from, image: &image });
        self.change(&LaneChange::Load { lane: to, image: &image });
        if let (Some(seen), Some(own)) = (other.run.observations.get(from), self.run.observations.get_mut(to)) {
            own.clone_from(seen);
        }
        if let Some(state) = other.run.states.get(from) {
            self.hold(to, state.clone());
        }
    }

    /// Puts lane `lane` into `state`; what laws remember stays.
    pub fn hold(&mut self, lane: usize, state: P::State) {
        if let Some(own) = self.run.states.get_mut(lane) {
            *own = state;
        }
    }

    /// What the law of the mechanism `id` tells of itself in lane `lane`, as [`Law::told`].
    #[must_use]
    pub fn told(&self, id: &str, lane: usize) -> Option<f64> {
        let (site, law) = self.places.iter().find(|(own, ..)| *own == id).map(|(_, site, law)| (*site, *law))?;
        let laws = [&self.run.command_laws, &self.run.plant_laws, &self.run.observation_laws];
        laws[site].get(law)?.told(lane)
    }

    /// The mechanisms and forms, in the order of the assembly: lanes can be copied between runs that have the same.
    pub fn kind(&self) -> impl Iterator<Item = (&'static str, usize)> {
        self.places.iter().map(|(id, ..)| *id).zip(self.forms.iter().copied())
    }

    fn change(&mut self, change: &LaneChange<'_>) {
        self.run.dynamics.change(&of_range(change, &self.plant));
        change_laws(&mut self.run.command_laws, &self.of_laws[0], change);
        change_laws(&mut self.run.plant_laws, &self.of_laws[1], change);
        change_laws(&mut self.run.observation_laws, &self.of_laws[2], change);
    }

    /// Sends each lane its command of `commands` and lets it act for a tick of its own.
    ///
    /// # Panics
    /// If there are not as many commands and times as lanes: an error of the calling code, not of any input.
    pub fn step(&mut self, ticks: Ticks<'_>, commands: &[P::Command])
    where
        P: Plant<Input = ()>,
    {
        let run = &mut self.run;
        assert!(commands.len() == run.states.len() && ticks.times.len() == run.states.len(), "one a lane");
        run.commands.clear();
        run.commands.extend_from_slice(commands);
        for law in &mut run.command_laws {
            law.shape_each(ticks, &mut run.commands);
        }
        run.inputs.resize(run.states.len(), ());
        run.advance_each(ticks);
    }

    /// What is reported of each lane at its own time of `times` [s].
    pub fn observe(&mut self, times: &[f64]) -> &[P::Observation] {
        let run = &mut self.run;
        run.dynamics.observe(&run.states, &mut run.observations);
        for law in &mut run.observation_laws {
            law.sense_each(times, &mut run.observations);
        }
        &run.observations
    }

    /// The states, one a lane.
    #[must_use]
    pub fn states(&self) -> &[P::State] {
        self.run.states()
    }

    /// What was last reported of each lane.
    #[must_use]
    pub fn observations(&self) -> &[P::Observation] {
        &self.run.observations
    }

    /// The commands as they last arrived at the plant, one a lane.
    #[must_use]
    pub fn arriving(&self) -> &[P::Command] {
        &self.run.commands
    }
}
