//! From what settings are drawn.

use super::draw::Uniform;
use super::effect::{EFFECTS, Effect};
use super::error::ImageError;
use super::gaussian::Counter;
use super::lens::{Border, FOCAL_LENGTHS, Lens};
use super::occlusion::{Fill, Occlusion};
use super::settings::{Setting, Settings};
use crate::sim2real::{Draws, Seed};

/// Which image of a training run one is. Draws depend on the seed and this alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ImageIndex {
    /// The episode, counted over all environments: two that run side by side are two episodes.
    pub episode: u64,
    /// The image's number in it.
    pub frame: u64,
}

/// How long a setting holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Per {
    /// For all images of an episode: a camera stays the camera it is.
    Episode,
    /// For one image.
    Image,
}

/// A range for each parameter of each effect of [`EFFECTS`], from which it is drawn uniformly.
#[derive(Debug, Clone, PartialEq)]
pub struct Ranges {
    rows: Vec<Row>,
    fill: Fill,
    border: Border,
    focal_length: f32,
}

#[derive(Debug, Clone, PartialEq)]
struct Row {
    effect: &'static Effect,
    per: Per,
    ranges: Vec<[f64; 2]>,
}

impl Row {
    fn does_nothing(&self) -> bool {
        self.ranges.iter().zip(self.effect.parameters).all(|(range, p)| *range == [p.identity; 2])
    }
}

impl Ranges {
    /// Nothing is done; with [`Ranges::with`], nothing but what is named.
    #[must_use]
    pub fn none() -> Self {
        Self::of(|parameter| [parameter.identity; 2])
    }

    /// All effects, each within the plausible range of its parameters, as the registry has it. Shift and occlusion are drawn
    /// anew for each image, all else for each episode.
    #[must_use]
    pub fn plausible() -> Self {
        Self::of(|parameter| parameter.plausible)
    }

    fn of(range: impl Fn(&super::EffectParameter) -> [f64; 2]) -> Self {
        let per = |effect: &Effect| match effect.name {
            "shift" | "occlusion" => Per::Image,
            _ => Per::Episode,
        };
        let rows = EFFECTS.iter().map(|effect| Row {
            effect,
            per: per(effect),
            ranges: effect.parameters.iter().map(&range).collect(),
        });
        let Settings { lens: Lens { focal_length, .. }, occlusion: Occlusion { fill, .. }, border, .. } = Settings::NONE;
        Self { rows: rows.collect(), fill, border, focal_length }
    }

    /// The same with one parameter drawn from `range`, both ends included; a value that is to be fixed is given twice.
    ///
    /// # Errors
    /// A name that is not in the registry, or a range that is not in order or not within the parameter's bounds.
    pub fn with(mut self, effect: &str, parameter: &str, range: [f64; 2]) -> Result<Self, ImageError> {
        let row = self.row_mut(effect)?;
        let Some(at) = row.effect.parameters.iter().position(|p| p.name == parameter) else {
            let names: Vec<&str> = row.effect.parameters.iter().map(|p| p.name).collect();
            let hint = format!("it has {}", names.join(", "));
            return Err(ImageError::UnknownParameter { effect: row.effect.name, name: parameter.to_owned(), hint });
        };
        let ([low, high], known) = (range, &row.effect.parameters[at]);
        if !(low >= known.bounds[0] && low <= high && high <= known.bounds[1]) {
            let (effect, parameter, bounds) = (row.effect.name, known.name, known.bounds);
            return Err(ImageError::Range { effect, parameter, low, high, bounds });
        }
        row.ranges[at] = range;
        Ok(self)
    }

    /// The same without one effect.
    ///
    /// # Errors
    /// A name that is not in the registry.
    pub fn without(mut self, effect: &str) -> Result<Self, ImageError> {
        let row = self.row_mut(effect)?;
        row.ranges = row.effect.parameters.iter().map(|p| [p.identity; 2]).collect();
        Ok(self)
    }

    /// The same with one effect drawn for each episode, or for each image.
    ///
    /// # Errors
    /// A name that is not in the registry.
    pub fn drawn(mut self, effect: &str, per: Per) -> Result<Self, ImageError> {
        self.row_mut(effect)?.per = per;
        Ok(self)
    }

    /// The same with rectangles filled with something else.
    ///
    /// # Errors
    /// A grey that is not from 0 to 1.
    pub fn filled_with(mut self, fill: Fill) -> Result<Self, ImageError> {
        self.fill = fill;
        Occlusion { fill, ..Occlusion::NONE }.check()?;
        Ok(self)
    }

    /// The same with something else beyond the edge of images.
    ///
    /// # Errors
    /// A grey that is not from 0 to 1.
    pub fn bordered_by(mut self, border: Border) -> Result<Self, ImageError> {
        border.check()?;
        self.border = border;
        Ok(self)
    }

    /// The same for a camera of another focal length [widths of the image]: `fx / width`, or
    /// `0.5 / tan(field of view across / 2)`; 0.866 (60 degrees) unless given.
    ///
    /// # Errors
    /// A length that is not from 0.1 to 20.
    pub fn focal_length(mut self, widths: f64) -> Result<Self, ImageError> {
        self.focal_length = widths as f32;
        let lens = Lens { focal_length: self.focal_length, ..Lens::NONE };
        if (FOCAL_LENGTHS[0]..=FOCAL_LENGTHS[1]).contains(&widths) { Ok(self) } else { lens.check().map(|()| self) }
    }

    /// The same with both ends of every range nearer to where nothing is done: at `level` 0 they are there, at 1 where
    /// they were, and in between in proportion.
    ///
    /// # Errors
    /// A level that is not from 0 to 1.
    pub fn at_level(&self, level: f64) -> Result<Self, ImageError> {
        if !(0.0..=1.0).contains(&level) {
            return Err(ImageError::Level(level));
        }
        let mut scaled = self.clone();
        for row in &mut scaled.rows {
            for (range, parameter) in row.ranges.iter_mut().zip(row.effect.parameters) {
                *range = range.map(|end| parameter.identity * (1.0 - level) + end * level);
            }
        }
        Ok(scaled)
    }

    /// The range of each parameter, effect by effect in the order of [`EFFECTS`].
    pub fn iter(&self) -> impl Iterator<Item = (&'static Effect, &[[f64; 2]])> {
        self.rows.iter().map(|row| (row.effect, row.ranges.as_slice()))
    }

    fn row_mut(&mut self, effect: &str) -> Result<&mut Row, ImageError> {
        let names: Vec<&str> = EFFECTS.iter().map(|effect| effect.name).collect();
        let Some(at) = names.iter().position(|name| *name == effect) else {
            let near = names.iter().max_by(|a, b| strsim::jaro(a, effect).total_cmp(&strsim::jaro(b, effect)));
            let near = near.map(|name| format!("did you mean {name:?}? ")).unwrap_or_default();
            let hint = format!("{near}there are {}", names.join(", "));
            return Err(ImageError::UnknownEffect { name: effect.to_owned(), hint });
        };
        Ok(&mut self.rows[at])
    }
}

/// A stream an effect, so that an effect more or less changes no other effect's draws, and one for the pixels.
#[derive(Debug, Clone)]
pub(super) struct Streams {
    effects: Vec<Draws>,
    pixels: Draws,
}

impl Streams {
    pub fn new(seed: Seed) -> Self {
        let effects = EFFECTS.iter().map(|effect| seed.stream(&format!("image.{}", effect.name))).collect();
        Self { effects, pixels: seed.stream("image.pixels") }
    }
}

impl Ranges {
    /// The settings of an image.
    pub(super) fn draw(&self, streams: &mut Streams, index: ImageIndex) -> Settings {
        let image = Counter::new(index.episode).bits(index.frame);
        let mut drawn = Drawing { ranges: self, streams, episode: index.episode, image };
        let mut settings = Settings {
            blur: drawn.next(),
            lens: drawn.next(),
            shift: drawn.next(),
            exposure: drawn.next(),
            white_balance: drawn.next(),
            contrast: drawn.next(),
            hue_saturation: drawn.next(),
            brightness: drawn.next(),
            noise: drawn.next(),
            occlusion: drawn.next(),
            border: self.border,
            key: drawn.key(),
        };
        settings.lens.focal_length = self.focal_length;
        settings.occlusion.fill = self.fill;
        settings
    }
}

struct Drawing<'a> {
    ranges: &'a Ranges,
    streams: &'a mut Streams,
    episode: u64,
    image: u64,
}

impl Drawing<'_> {
    fn next<S: Setting>(&mut self) -> S {
        let effect = S::EFFECT.name;
        let rows = self.ranges.rows.iter().zip(&mut self.streams.effects);
        let Some((row, draws)) = rows.into_iter().find(|(row, _)| row.effect.name == effect) else { return S::NONE };
        if row.does_nothing() {
            return S::NONE;
        }
        let place = match row.per {
            Per::Episode => self.episode,
            Per::Image => self.image,
        };
        S::drawn(&mut Uniform::new(&row.ranges, draws, place))
    }

    fn key(&mut self) -> u64 {
        Uniform::new(&[], &mut self.streams.pixels, self.image).bits()
    }
}
