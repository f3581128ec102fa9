//! All effects on one image, some rows at a time.

use std::ops::Range;

use pulp::{Arch, NullaryFnOnce};
use wide::f32x8;

use super::gaussian::Counter;
use super::line::Line;
use super::noise::Noise;
use super::scene::Scene;
use super::settings::{Setting, Settings, Way};
use super::view::{Shape, Value};
use super::warp::{Pair, Warp};

/// How many rows go through the effects at a time: about 512 pixels, enough that what is done once for all of them does not
/// count, and few enough for the nearest memory.
fn band(shape: Shape) -> usize {
    (512 / shape.width).max(1)
}

/// Room for one image under way.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    scene: Scene,
    blurred: [Vec<f32x8>; 3],
    warp: Warp,
    moved: Vec<f32>,
    seen: Vec<Pair>,
    line: Line,
}

/// All effects on one image, with the widest vectors of the processor: what is not inlined into it is compiled without.
struct Rendering<'a, V> {
    scratch: &'a mut Scratch,
    settings: &'a Settings,
    source: Option<&'a [V]>,
    target: &'a mut [V],
    shape: Shape,
}

impl<V: Value> NullaryFnOnce for Rendering<'_, V> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { scratch, settings, source, target, shape } = self;
        match shape.channels {
            1 => scratch.render_channels::<V, 1>(settings, source, target, shape),
            3 => scratch.render_channels::<V, 3>(settings, source, target, shape),
            _ => scratch.render_channels::<V, 4>(settings, source, target, shape),
        }
    }
}

impl Scratch {
    /// Writes `source`, or what `target` is, into `target` with all effects.
    pub fn render<V: Value>(&mut self, settings: &Settings, source: Option<&[V]>, target: &mut [V], shape: Shape) {
        Arch::new().dispatch(Rendering { scratch: self, settings, source, target, shape });
    }

    #[inline(always)]
    fn render_channels<V: Value, const C: usize>(
        &mut self,
        settings: &Settings,
        source: Option<&[V]>,
        target: &mut [V],
        shape: Shape,
    ) {
        let colour = settings.colour(C).map(|map| map.ready(V::FULL));
        let noise = (settings.noise != Noise::NONE).then(|| settings.noise.ready(settings.key, V::FULL));
        let way = settings.way();
        if way != Way::Straight || noise.is_some() || colour.is_some() {
            if way != Way::Straight {
                self.take_scene::<V, C>(settings, way, source.unwrap_or(target), shape);
            }
            let rows = band(shape);
            for start in (0..shape.height).step_by(rows) {
                let rows = start..shape.height.min(start + rows);
                let part = start * shape.width * C..rows.end * shape.width * C;
                self.take_rows::<V, C>(way, rows, &source.unwrap_or(target)[part.clone()], shape);
                if let Some(colour) = &colour {
                    colour.apply::<C>(&mut self.line);
                }
                if let Some(noise) = &noise {
                    noise.apply::<C>(&mut self.line, (start * shape.width) as u64);
                }
                self.line.store::<V, C>(&mut target[part]);
            }
        } else if let Some(source) = source {
            target.copy_from_slice(source);
        }
        if !settings.occlusion.is_clear() {
            settings.occlusion.apply::<V, C>(target, shape, Counter::new(!settings.key));
        }
    }

    /// The image as lens and shift find it.
    #[inline(always)]
    fn take_scene<V: Value, const C: usize>(&mut self, settings: &Settings, way: Way, values: &[V], shape: Shape) {
        self.scene.resize(shape);
        settings.blur.take::<V, C>(values, &mut self.scene, &mut self.blurred);
        self.scene.surround::<C>(settings.border, V::FULL);
        if way == Way::Warped {
            self.warp.begin(settings.lens, settings.shift, shape, band(shape));
        }
    }

    /// The light of some rows, of which the image has `values`.
    #[inline(always)]
    fn take_rows<V: Value, const C: usize>(&mut self, way: Way, rows: Range<usize>, values: &[V], shape: Shape) {
        self.line.resize(rows.len() * shape.width);
        match way {
            Way::Straight => self.line.take::<V, C>(values),
            Way::Moved(by) => {
                self.moved.resize(values.len(), 0.0);
                for (y, moved) in rows.clone().zip(self.moved.chunks_exact_mut(shape.width * C)) {
                    self.scene.moved_row::<C>(y, by, moved);
                }
                self.line.take::<f32, C>(&self.moved);
            }
            Way::Warped => {
                self.warp.prepare::<C>(rows.clone(), shape);
                self.warp.sample::<C>(&self.scene, rows, &mut self.seen);
                self.line.take_pixels(self.seen.as_flattened().as_chunks().0);
            }
        }
    }
}
