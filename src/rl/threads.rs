//! Lanes split over threads: the same bits, sooner.

use super::{About, Actions, EnvError, Options, Out, VecEnv, Which, alike};

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
    pub fn new(
        lanes: usize,
        chunks: usize,
        make: impl Fn(usize) -> Result<Box<dyn VecEnv>, EnvError>,
    ) -> Result<Self, EnvError> {
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
