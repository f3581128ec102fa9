//! Randomization: distributions over the parameters of a plant and its mechanisms, and draws from them for as many
//! environments as there are.
//!
//! The noun is the same as everywhere: what is randomized is a parameter of a mechanism, whose nominal value does nothing, or of
//! the plant. The widest ranges that leave nothing out are guessed; the narrowest that leave nothing out are a diagnosis's
//! [`Posterior`].
//!
//! What cameras see is randomized in [`image`].

mod adr;
mod correlation;
mod distribution;
mod ensemble;
mod entry;
mod history;
pub mod image;
mod level;
mod normal;
mod posterior;
mod predictive;
mod preset;
mod randomizer;
mod stream;
mod table;
mod target;
mod within;

pub use adr::{Adr, AdrChange, AdrError, AdrRange, AdrSample, AdrSettings, Boundary, End};
pub use correlation::{Correlation, CorrelationError};
pub use distribution::{Distribution, DistributionError};
pub use ensemble::{Predicted, ensemble};
pub use history::{DrawHistory, Drawn};
pub use level::{Curriculum, CurriculumError, Level, NotALevel};
pub use normal::{normal_cdf, normal_quantile};
pub use posterior::{Posterior, PosteriorError};
pub use predictive::{BANDS, BandShare, Bands, Coverage, OUTSIDE, WIDEST, quantiles};
pub use preset::{Preset, PresetRow, Presets};
pub use randomizer::{RandomizeError, Randomizer, Turn};
pub use stream::{DrawKey, Occasion};
pub use table::DrawTable;
pub use target::{Implausible, Randomized, Redraw, Target};
pub use within::Within;
