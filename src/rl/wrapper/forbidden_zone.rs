//! Values that must not be.

use super::layer::{ActionsMut, Layer, copy_row, neutral, refused};
use crate::rl::{About, Actions, EnvError, Episodes, InfoChannel, Out, Space, Which};

/// Of what a value is forbidden, by the name of its component.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ZoneOf {
    /// Of an action.
    Action(String),
    /// Of what is observed, as this layer sees it.
    Observation(String),
}

/// What happens where a value is forbidden.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Intervention {
    /// The action becomes the end of the zone on the side it was on a step before: it cannot cross the zone.
    Clip,
    /// The action becomes the end of the zone that is nearest to it.
    Project,
    /// The reward of the step is less by so much.
    Penalize(f64),
    /// The episode terminates with this step.
    Terminate,
}

/// An open interval of a component of actions or observations in which a value must not be. How many steps of an episode were in it
/// is told by an info channel of its own.
#[derive(Debug, Clone)]
pub struct ForbiddenZone {
    of: ZoneOf,
    low: f32,
    high: f32,
    then: Intervention,
    /// Number of the component, and of all components.
    component: usize,
    size: usize,
    neutral: f32,
    last: Vec<f32>,
    inside: Vec<bool>,
    count: Vec<u32>,
}

impl ForbiddenZone {
    /// Values above `low` and below `high` are forbidden, in the unit of the component; an end may be infinite.
    #[must_use]
    pub fn new(of: ZoneOf, low: f32, high: f32, then: Intervention) -> Self {
        let (last, inside, count) = (Vec::new(), Vec::new(), Vec::new());
        Self { of, low, high, then, component: 0, size: 0, neutral: 0.0, last, inside, count }
    }

    fn forbids(&self, value: f32) -> bool {
        value > self.low && value < self.high
    }

    /// The end of the zone that `value` within it is moved to, for an action that was `last` a step before.
    fn moved(&self, value: f32, last: f32) -> f32 {
        let [below, above] = [self.low.is_finite(), self.high.is_finite()];
        let down = match self.then {
            Intervention::Clip => last <= self.low,
            _ => value - self.low <= self.high - value,
        };
        if (down && below) || !above { self.low } else { self.high }
    }

    fn prepare_action(&mut self, about: &About, name: &str) -> Result<(), EnvError> {
        let Space::Box(space) = &about.action else {
            return Err(refused::<Self>(
                about,
                "its actions are choices",
                "leave it out, or forbid values of an observation",
            ));
        };
        let Some(component) = space.component(name) else {
            let remedy = format!("there are {}", space.names.join(", "));
            return Err(refused::<Self>(about, format!("its actions have no component `{name}`"), remedy));
        };
        (self.component, self.size) = (component, space.size());
        let (low, high) = (space.low[component], space.high[component]);
        let rest = neutral(&[low], &[high])[0];
        if matches!(self.then, Intervention::Clip | Intervention::Project) {
            // An end that is no action is none to move to.
            let end = |end: f32, out: f32| if end >= low && end <= high { end } else { out };
            (self.low, self.high) = (end(self.low, f32::NEG_INFINITY), end(self.high, f32::INFINITY));
            if self.low.is_infinite() && self.high.is_infinite() {
                let why = format!("all of `{name}`, [{low}, {high}], is forbidden");
                return Err(refused::<Self>(about, why, "leave room for an action"));
            }
        }
        let nearest = Self { then: Intervention::Project, ..self.clone() };
        self.neutral = if self.forbids(rest) { nearest.moved(rest, rest) } else { rest };
        Ok(())
    }

    fn prepare_observation(&mut self, about: &About, name: &str) -> Result<(), EnvError> {
        let Some(component) = about.observation.component(name) else {
            let remedy = format!("there are {}", about.observation.names.join(", "));
            return Err(refused::<Self>(about, format!("it has no observation `{name}`"), remedy));
        };
        if matches!(self.then, Intervention::Clip | Intervention::Project) {
            let why = format!("`{name}` is observed, and cannot be moved");
            return Err(refused::<Self>(about, why, "penalize or terminate, or forbid values of an action"));
        }
        (self.component, self.size) = (component, about.observation.size());
        Ok(())
    }
}

impl Layer for ForbiddenZone {
    const NAME: &'static str = "a forbidden zone";
    const SHAPES: bool = true;

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        if self.low.partial_cmp(&self.high).is_none_or(std::cmp::Ordering::is_ge) {
            let why = format!("there is nothing between {} and {}", self.low, self.high);
            return Err(refused::<Self>(about, why, "give the lower end first"));
        }
        if let Intervention::Penalize(penalty) = self.then {
            if !(penalty >= 0.0 && penalty.is_finite()) {
                return Err(refused::<Self>(about, format!("the penalty is {penalty}"), "give 0 or more"));
            }
            about.reward_range.0 -= penalty;
        }
        let name = match self.of.clone() {
            ZoneOf::Action(name) => self.prepare_action(about, &name).map(|()| name),
            ZoneOf::Observation(name) => self.prepare_observation(about, &name).map(|()| name),
        }?;
        about.info.push(InfoChannel::new(format!("steps_in_forbidden_{name}"), "steps"));
        self.last = vec![self.neutral; lanes];
        self.inside = vec![false; lanes];
        self.count = vec![0; lanes];
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, _: &Episodes, _: &mut [f32]) {
        for lane in which.iter(self.last.len()) {
            (self.last[lane], self.inside[lane], self.count[lane]) = (self.neutral, false, 0);
        }
    }

    fn shape(&mut self, actions: &mut ActionsMut<'_>) {
        if matches!(self.of, ZoneOf::Observation(_)) {
            return;
        }
        for lane in 0..self.last.len() {
            let value = actions.continuous()[lane * self.size + self.component];
            self.inside[lane] = self.forbids(value);
            let mut end = value;
            match self.then {
                Intervention::Clip => {
                    // On the side of the last action: also where it would be beyond the zone.
                    let crossed = if self.last[lane] <= self.low { value > self.low } else { value < self.high };
                    if crossed {
                        end = self.moved(value, self.last[lane]);
                        self.inside[lane] = true;
                    }
                }
                Intervention::Project if self.inside[lane] => end = self.moved(value, self.last[lane]),
                Intervention::Project | Intervention::Penalize(_) | Intervention::Terminate => {}
            }
            self.last[lane] = end;
            actions.continuous()[lane * self.size + self.component] = end;
        }
    }

    fn sense(&mut self, _: Actions<'_>, out: &mut Out<'_>) {
        for lane in 0..self.last.len() {
            if matches!(self.of, ZoneOf::Observation(_)) {
                self.inside[lane] = self.forbids(out.observations[lane * self.size + self.component]);
            }
            if self.inside[lane] {
                self.count[lane] = self.count[lane].saturating_add(1);
                match self.then {
                    Intervention::Penalize(penalty) => out.rewards[lane] -= penalty,
                    Intervention::Terminate => out.terminated[lane] = true,
                    Intervention::Clip | Intervention::Project => {}
                }
            }
        }
    }

    fn info(&self, _: usize, values: &mut [f64]) {
        values.iter_mut().zip(&self.count).for_each(|(value, count)| *value = (*count).into());
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        copy_row(&mut self.last, other.map(|other| other.last.as_slice()), 1, from, to);
        copy_row(&mut self.inside, other.map(|other| other.inside.as_slice()), 1, from, to);
        copy_row(&mut self.count, other.map(|other| other.count.as_slice()), 1, from, to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Wrap, Wrapped};
    use super::*;
    use crate::rl::walk::{Push, Walk, acting};
    use crate::rl::{Buffers, Options, VecEnv};

    fn zone(low: f32, high: f32, then: Intervention) -> Wrapped<Walk, ForbiddenZone> {
        Walk::new(1).with(ForbiddenZone::new(ZoneOf::Action("push".into()), low, high, then)).unwrap()
    }

    #[test]
    fn a_projected_action_goes_to_the_nearest_end() {
        let actions = [[0.2], [0.3], [0.44], [0.46], [0.6], [0.9]];
        let acted = acting(zone(0.3, 0.6, Intervention::Project), &actions);
        assert_eq!(acted, [[0.2], [0.3], [0.3], [0.6], [0.6], [0.9]]);
        // An end that is outside the action space is none.
        assert_eq!(acting(zone(0.5, 2.0, Intervention::Project), &[[0.9], [0.4]]), [[0.5], [0.4]]);
        // Where 0 itself is forbidden, the episode begins at an end.
        assert_eq!(acting(zone(-0.1, 0.2, Intervention::Clip), &[[0.5]]), [[-0.1]]);
    }

    #[test]
    fn a_clipped_action_does_not_cross_the_zone() {
        let env = zone(0.3, 0.6, Intervention::Clip);
        let acted = acting(env.clone(), &[[0.2], [0.5], [0.9], [-1.0]]);
        assert_eq!(acted, [[0.2], [0.3], [0.3], [-1.0]]);
        let acted = acting(zone(-0.6, -0.3, Intervention::Clip), &[[-0.5], [-0.9]]);
        assert_eq!(acted, [[-0.3], [-0.3]]);
    }

    #[test]
    fn a_penalty_and_an_end_are_those_of_the_steps_inside_and_are_counted() {
        let run = |then, actions: &[f32]| {
            let mut env = zone(0.3, 0.6, then);
            let mut plain = Walk::new(1);
            let (mut buffers, mut other) = (Buffers::of(&env), Buffers::of(&plain));
            env.reset(Which::All, Some(&[1]), &Options::new(), &mut buffers.observations).unwrap();
            plain.reset(Which::All, Some(&[1]), &Options::new(), &mut other.observations).unwrap();
            let mut steps = Vec::new();
            for action in actions {
                env.step(Actions::Continuous(&[*action]), &mut buffers.out()).unwrap();
                plain.step(Actions::Continuous(&[*action]), &mut other.out()).unwrap();
                steps.push(((other.rewards[0] - buffers.rewards[0]).round(), buffers.terminated[0]));
            }
            let mut count = [0.0];
            env.info(env.about().channel("steps_in_forbidden_push").unwrap(), &mut count);
            (steps, count[0])
        };
        let (steps, count) = run(Intervention::Penalize(2.0), &[0.2, 0.4, 0.3, 0.5]);
        assert_eq!((steps, count), (vec![(0.0, false), (2.0, false), (0.0, false), (2.0, false)], 2.0));
        let (steps, count) = run(Intervention::Terminate, &[0.2, 0.4]);
        assert_eq!((steps, count), (vec![(0.0, false), (0.0, true)], 1.0));
        assert_eq!(zone(0.3, 0.6, Intervention::Penalize(2.0)).about().reward_range, (-102.0, 0.0));
    }

    #[test]
    fn what_is_observed_can_end_an_episode() {
        let of = ZoneOf::Observation("position".into());
        let zone = ForbiddenZone::new(of, 0.35, f32::INFINITY, Intervention::Terminate);
        let mut env = Walk::new(2).with(zone).unwrap();
        let mut buffers = Buffers::of(&env);
        env.reset(Which::All, Some(&[1, 2]), &Options::new(), &mut buffers.observations).unwrap();
        while !buffers.terminated[0] {
            assert!(buffers.observations[0] <= 0.35);
            env.step(Actions::Continuous(&[1.0, -1.0]), &mut buffers.out()).unwrap();
        }
        assert!(buffers.observations[0] > 0.35 && !buffers.terminated[1]);
    }

    #[test]
    fn what_cannot_be_forbidden_is_refused() {
        let refused = |of: ZoneOf, low, high, then| {
            Walk::new(1).with(ForbiddenZone::new(of, low, high, then)).unwrap_err().to_string()
        };
        let (action, position) = (ZoneOf::Action("push".into()), ZoneOf::Observation("position".into()));
        assert!(refused(action.clone(), 0.5, 0.5, Intervention::Clip).contains("nothing between 0.5 and 0.5"));
        assert!(refused(action.clone(), f32::NAN, 0.5, Intervention::Clip).contains("nothing between NaN"));
        assert!(refused(action.clone(), -2.0, 2.0, Intervention::Project).contains("all of `push`, [-1, 1], is forbidden"));
        assert!(refused(action, 0.0, 0.5, Intervention::Penalize(-1.0)).contains("the penalty is -1"));
        assert!(refused(ZoneOf::Action("pull".into()), 0.0, 0.5, Intervention::Clip).contains("hint: there are push"));
        assert!(refused(position, 0.0, 0.5, Intervention::Project).contains("cannot be moved"));
        assert!(refused(ZoneOf::Observation("speed".into()), 0.0, 0.5, Intervention::Terminate).contains("position, steps"));
        let zone = ForbiddenZone::new(ZoneOf::Action("way".into()), 0.0, 0.5, Intervention::Clip);
        assert!(Push::new(1).with(zone).unwrap_err().to_string().contains("choices"));
    }
}
