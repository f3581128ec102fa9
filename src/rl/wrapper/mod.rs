//! What stands between learner and environment: each wrapper written once, for one lane and for many.

mod action_latency;
mod action_scale;
mod clip;
mod delay_line;
mod dropout;
mod forbidden_zone;
mod latency;
mod layer;
mod moments;
mod noise;
mod observation_latency;
mod rate_limit;
mod recorder;
mod smoothing;
mod statistics;
mod time_limit;

pub use action_latency::ActionLatency;
pub use action_scale::ActionScale;
pub use clip::ClipActions;
pub use dropout::{Dropout, Lost};
pub use forbidden_zone::{ForbiddenZone, Intervention, ZoneOf};
pub use latency::{Latency, Redraw};
pub use layer::{ActionsMut, Layer, Wrap, Wrapped};
pub use moments::Moments;
pub use noise::ObservationNoise;
pub use observation_latency::ObservationLatency;
pub use rate_limit::RateLimit;
pub use recorder::{Recorded, RecordedActions, Recorder};
pub use smoothing::Smoothing;
pub use statistics::{EpisodeStatistics, EpisodeTotals};
pub use time_limit::TimeLimit;
