//! Lanes split over threads: the same bits, sooner.

use super::{About, Actions, EnvError, Made, Options, Out, VecEnv, Which, alike};

/// Chunks of lanes, stepped side by side on the threads of rayon's current pool.
///
/// Waking a thread takes microseconds, so that a chunk should have some tens of microseconds to do at a step.
#[derive(Debug, Clone)]
pub struct Threads {
    chunks: Vec<Chunk>,
    about: About,
    lanes: usize,
    /// Numbers of an action, and of an observation.
    sizes: [usize; 2],
}

#[derive(Debug, Clone)]
struct Chunk {
    env: Box<dyn VecEnv>,
    first: usize,
    lanes: usize,
}

impl Threads {
    /// `lanes` lanes in `chunks` chunks, as even as can be; `make` gives an environment of so many lanes.
    ///
    /// # Errors
    /// [`EnvError::NoLanes`] if there is no lane or no chunk; what `make` gives.
    pub fn new(lanes: usize, chunks: usize, make: impl Fn(usize) -> Made) -> Result<Self, EnvError> {
        let count = chunks.min(lanes);
        if count == 0 {
            return Err(EnvError::NoLanes);
        }
        let mut chunks = Vec::with_capacity(count);
        for k in 0..count {
            let (first, end) = (k * lanes / count, (k + 1) * lanes / count);
            chunks.push(Chunk { env: make(end - first)?, first, lanes: end - first });
        }
        let about = chunks[0].env.about().clone();
        let sizes = [about.action.size(), about.observation.size()];
        Ok(Self { chunks, about, lanes, sizes })
    }

    /// The number of the chunk in which `lane` is.
    fn chunk_of(&self, lane: usize) -> usize {
        self.chunks.partition_point(|chunk| chunk.first <= lane) - 1
    }

    fn gather(&self, values: &mut [f64], tell: impl Fn(&dyn VecEnv, &mut [f64])) {
        for chunk in &self.chunks {
            tell(&*chunk.env, &mut values[chunk.first..][..chunk.lanes]);
        }
    }
}

impl VecEnv for Threads {
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.lanes
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        let reset = |chunk: &mut Chunk, observations: &mut [f32]| {
            let which = which.part(chunk.first, chunk.lanes);
            if !which.any() {
                return Ok(());
            }
            let seeds = seeds.map(|seeds| &seeds[chunk.first..][..chunk.lanes]);
            chunk.env.reset(which, seeds, options, observations).map_err(|error| error.moved(chunk.first))
        };
        reset_all(&mut self.chunks, observations, self.sizes[1], &reset)
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        let [action, observation] = self.sizes;
        let step = |chunk: &mut Chunk, mut out: Out<'_>| {
            let actions = actions.lanes(chunk.first, chunk.lanes, action);
            chunk.env.step(actions, &mut out).map_err(|error| error.moved(chunk.first))
        };
        step_all(&mut self.chunks, out.again(), observation, &step)
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        self.gather(values, |env, values| env.info(channel, values));
    }

    fn privileged(&self, parameter: usize, values: &mut [f64]) {
        self.gather(values, |env, values| env.privileged(parameter, values));
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        let [source, target] = [from, to].map(|lane| self.chunk_of(lane));
        let (from, to) = (from - self.chunks[source].first, to - self.chunks[target].first);
        if source == target {
            self.chunks[source].env.copy_lane(from, to);
        } else if let Ok([source, target]) = self.chunks.get_disjoint_mut([source, target]) {
            let copied = target.env.copy_lane_from(&*source.env, from, to);
            debug_assert!(copied.is_ok(), "chunks are made alike");
        }
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other = alike(self, other)?;
        let source = &other.chunks[other.chunk_of(from)];
        let target = self.chunk_of(to);
        let target = &mut self.chunks[target];
        target.env.copy_lane_from(&*source.env, from - source.first, to - target.first)
    }
}

/// Resets chunks by halves on two threads, until there is one.
fn reset_all(
    chunks: &mut [Chunk],
    observations: &mut [f32],
    size: usize,
    reset: &(impl Fn(&mut Chunk, &mut [f32]) -> Result<(), EnvError> + Sync),
) -> Result<(), EnvError> {
    if let [chunk] = chunks {
        return reset(chunk, observations);
    }
    let (left, right) = chunks.split_at_mut(chunks.len() / 2);
    let (before, after) = observations.split_at_mut(left.iter().map(|chunk| chunk.lanes).sum::<usize>() * size);
    let done = rayon::join(|| reset_all(left, before, size, reset), || reset_all(right, after, size, reset));
    done.0.and(done.1)
}

/// Steps chunks by halves on two threads, until there is one.
fn step_all(
    chunks: &mut [Chunk],
    out: Out<'_>,
    size: usize,
    step: &(impl Fn(&mut Chunk, Out<'_>) -> Result<(), EnvError> + Sync),
) -> Result<(), EnvError> {
    if let [chunk] = chunks {
        return step(chunk, out);
    }
    let (left, right) = chunks.split_at_mut(chunks.len() / 2);
    let (before, after) = out.split(left.iter().map(|chunk| chunk.lanes).sum(), size);
    let done = rayon::join(|| step_all(left, before, size, step), || step_all(right, after, size, step));
    done.0.and(done.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rl::walk::{Push, Walk};
    use crate::rl::{Buffers, TimeLimit, Wrap};

    fn threads(lanes: usize, chunks: usize) -> Threads {
        Threads::new(lanes, chunks, |lanes| Ok(Box::new(Walk::new(lanes).with(TimeLimit::new(20))?))).unwrap()
    }

    /// All that comes of 50 steps with some resets and a copy.
    fn run(mut env: impl VecEnv) -> Vec<Buffers> {
        let lanes = env.lanes();
        let mut buffers = Buffers::of(&env);
        let seeds: Vec<u64> = (0..lanes as u64).map(|lane| 7 * lane).collect();
        env.reset(Which::All, Some(&seeds), &Options::new(), &mut buffers.observations).unwrap();
        let mut all = vec![buffers.clone()];
        for step in 0..50 {
            let actions: Vec<f32> = (0..lanes).map(|lane| ((lane * 3 + step) as f32).sin()).collect();
            env.step(Actions::Continuous(&actions), &mut buffers.out()).unwrap();
            all.push(buffers.clone());
            let mask: Vec<bool> = (0..lanes).map(|lane| (lane + step) % 7 == 0).collect();
            env.reset(Which::Mask(&mask), None, &Options::new(), &mut buffers.observations).unwrap();
            env.copy_lane(step % lanes, (step * 5 + 3) % lanes);
            let [mut acted, mut seeds] = [vec![0.0; lanes], vec![0.0; lanes]];
            env.info(0, &mut acted);
            env.privileged(0, &mut seeds);
            buffers.rewards.iter_mut().zip(acted).zip(seeds).for_each(|((r, a), s)| *r += a + s);
            all.push(buffers.clone());
        }
        all
    }

    #[test]
    fn any_number_of_chunks_gives_the_same_bits() {
        let alone = run(Walk::new(13).with(TimeLimit::new(20)).unwrap());
        for chunks in [1, 2, 3, 13, 99] {
            assert_eq!(run(threads(13, chunks)), alone, "{chunks} chunks");
        }
    }

    #[test]
    fn a_failure_names_the_lane_among_all() {
        let mut env = Threads::new(5, 2, |lanes| {
            let mut push = Push::new(lanes);
            push.lane_mut(lanes - 1).fails = Some(0);
            Ok(Box::new(push))
        })
        .unwrap();
        let mut buffers = Buffers::of(&env);
        env.reset(Which::All, Some(&[0; 5]), &Options::new(), &mut buffers.observations).unwrap();
        let error = env.step(Actions::Discrete(&[1; 5]), &mut buffers.out()).unwrap_err();
        assert!(matches!(error, EnvError::Failed { lane: 1, .. }), "{error}");
        assert!(matches!(Threads::new(0, 2, |lanes| Ok(Box::new(Walk::new(lanes)))), Err(EnvError::NoLanes)));
    }

    #[test]
    fn a_lane_is_copied_between_vectors_made_alike_and_no_others() {
        let (mut one, other) = (threads(4, 2), threads(6, 3));
        one.copy_lane_from(&other, 5, 0).unwrap();
        let error = one.copy_lane_from(&Walk::new(4), 0, 0).unwrap_err().to_string();
        assert!(error.contains("`test/Walk-v0`") && error.contains("hint:"), "{error}");
        assert!(Walk::new(2).copy_lane_from(&Push::new(2), 0, 0).is_err());
        let boxed: Box<dyn VecEnv> = Box::new(Walk::new(2));
        Walk::new(2).copy_lane_from(&boxed, 1, 0).unwrap();
        assert!(boxed.clone().copy_lane_from(&Walk::new(3), 2, 0).is_ok());
    }
}
