//! The market of a RUN.toml as an environment's: its data, venue and account, and what it draws.

use crate::io::{InputError, RunFile, randomized_twin};
use crate::market::{PreparedRun, Reference, market_presets, prepare_run, run_needs};

use super::execution::DrawnExecution;
use super::setup::MarketSetup;

impl MarketSetup {
    /// The market of `run`, with what its `[randomize]` or `[posterior]` draws anew for every episode. The run's strategy, and its
    /// seed, are not asked: an episode has its own.
    ///
    /// # Errors
    /// A run that is streamed; what [`prepare_run`] refuses, or what is refused of draws: mechanisms that need
    /// data there are none of, or that change which price orders meet.
    pub fn from_run(run: &RunFile) -> Result<Self, InputError> {
        if run.run.stream {
            let error =
                run.error(&["run", "stream"], "an episode begins anywhere in the data, and these are read while a run goes");
            return Err(error.hint("drop `stream = true`, or cut the data with `start` and `end`"));
        }
        let PreparedRun { backtest, .. } = prepare_run(run)?;
        if run.randomize.is_none() && run.posterior.is_none() {
            return Ok(Self::new(backtest));
        }
        let (venue, document) = (backtest.venue(), run.document());
        let twin = randomized_twin(venue, document, run.randomize.as_ref(), run.posterior.as_ref(), &market_presets())?;
        run_needs::check(run, &twin.assembly, backtest.instruments(), backtest.histories())?;
        if backtest.settings().reference.is_none() && Reference::suiting(&twin.assembly) != Reference::suiting(venue) {
            let message =
                "what is drawn adds a spread, so that orders meet the mid, and in the run as it is written the touch";
            return Err(run
                .error(&["randomize"], message)
                .hint("say `price` in [run], or list the mechanism with its nominal value"));
        }
        let backtest = backtest.with_venue(twin.assembly);
        Ok(Self::new(backtest).with_execution(DrawnExecution { randomizer: twin.randomizer, level: twin.level }))
    }
}
