//! Camera images as another camera, in other light, might have taken them: domain randomization of what a policy sees.
//!
//! Images are bytes or floats from 0 to 1 (any other float is an error, NaN too), height x width x channels of 1 (grey), 3 (RGB)
//! or 4 (RGB and alpha), row by row, channels side by side, one or a batch, changed in place or into another buffer.
//! Settings are drawn uniformly from [`Ranges`], for each episode or each image; the effects act in this order:
//!
//! | effect | law | parameters | from |
//! |---|---|---|---|
//! | `blur` | a bell-shaped spread | `std` [px] | Lindeberg (1990) |
//! | `lens` | polynomial distortion, bilinear | `k1`, `k2`, `p1`, `p2` | Conrady (1919), Brown (1966) |
//! | `shift` | moved by whole pixels | `x`, `y` [px] | Yarats et al. (2021) |
//! | `exposure` | `x 2^(stops / 2.2)` | `stops` [EV] | ISO 2721 |
//! | `white_balance` | the same of red and of blue | `red`, `blue` [EV] | von Kries (1902) |
//! | `contrast` | `1/2 + gain (x - 1/2)` | `gain` | Poynton (2012) |
//! | `hue_saturation` | YIQ: I and Q turned and scaled | `hue` [degrees], `saturation` | NTSC (1953) |
//! | `brightness` | `x + offset` | `offset` | Poynton (2012) |
//! | `noise` | `x + sqrt(read^2 + shot^2 x) n` | `read`, `shot` | Foi et al. (2008) |
//! | `occlusion` | rectangles filled | `count`, `area`, `log2_aspect` | `DeVries` & Taylor (2017), Zhong et al. (2020) |
//!
//! [`EFFECTS`] is that table for programs, with bounds and plausible ranges. Values are cut off and rounded once, before
//! `occlusion`. Alpha is no light: only `lens` and `shift` touch it, and take it along with its pixel. An effect whose
//! parameters do nothing changes no bit. An image depends on the seed, the ranges, its [`ImageIndex`] and itself alone, to
//! the last bit on any machine and any number of threads: see [`ImageRandomizer`].
//!
//! # Example
//! ```
//! use trueup::sim2real::Seed;
//! use trueup::sim2real::randomize::image::{
//!     ImageError, ImageIndex, ImageMut, ImageRandomizer, Per, Ranges, Shape, Workspace,
//! };
//!
//! // All effects at half their plausible ranges, but less of a shift, and noise of a new camera for each image.
//! let ranges = Ranges::plausible().with("shift", "x", [-2.0, 2.0])?.drawn("noise", Per::Image)?.at_level(0.5)?;
//! let randomizer = ImageRandomizer::new(ranges, Seed(7));
//!
//! // What four environments show, 84 x 84 RGB, as they are in the 12th frame of their episodes.
//! let shape = Shape::new(84, 84, 3)?;
//! let mut batch = vec![128_u8; 4 * shape.values()];
//! let indices = [0, 1, 2, 3].map(|episode| ImageIndex { episode, frame: 12 });
//! let mut workspace = Workspace::new();
//! randomizer.apply(ImageMut::batch(&mut batch, 4, shape)?, &indices, &mut workspace)?;
//!
//! // One of them alone comes out the same.
//! let mut alone = vec![128_u8; shape.values()];
//! randomizer.apply(ImageMut::new(&mut alone, shape)?, &indices[2..3], &mut workspace)?;
//! assert_eq!(alone, batch[2 * shape.values()..3 * shape.values()]);
//! assert_ne!(alone, vec![128; shape.values()]);
//! # Ok::<(), ImageError>(())
//! ```

mod blur;
mod brightness;
mod colour;
mod contrast;
mod draw;
mod effect;
mod error;
mod exposure;
mod gaussian;
mod hue_saturation;
mod lens;
mod line;
mod noise;
mod occlusion;
mod randomizer;
mod ranges;
mod render;
mod rounding;
mod scene;
mod settings;
mod shift;
mod view;
mod warp;
mod white_balance;

pub use blur::Blur;
pub use brightness::Brightness;
pub use contrast::Contrast;
pub use effect::{EFFECTS, Effect, EffectParameter};
pub use error::ImageError;
pub use exposure::Exposure;
pub use hue_saturation::HueSaturation;
pub use lens::{Border, Lens};
pub use noise::Noise;
pub use occlusion::{Fill, Occlusion, Rectangle};
pub use randomizer::{ImageRandomizer, Workspace};
pub use ranges::{ImageIndex, Per, Ranges};
pub use settings::Settings;
pub use shift::Shift;
pub use view::{ImageMut, ImageView, Shape, Value};
pub use white_balance::WhiteBalance;
