//! All effects on one image, a row at a time.

use pulp::{Arch, NullaryFnOnce};

use super::colour::Colour;
use super::gaussian::Counter;
use super::noise::{Noise, Noisy};
use super::pixel::{Pixel, load, store};
use super::scene::Scene;
use super::settings::{Setting, Settings};
use super::view::{Shape, Value};
use super::warp::Warp;

/// Room for one image under way.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    scene: Scene,
    blurred: [Vec<Pixel>; 3],
    warp: Warp,
    line: Vec<Pixel>,
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
        if settings.is_spatial() || noise.is_some() || colour.is_some() {
            if settings.is_spatial() {
                self.take_scene::<V, C>(settings, source.unwrap_or(target), shape);
            }
            self.line.resize(shape.width, Pixel::ZERO);
            let moved = settings.moved();
            let line = &mut self.line[..shape.width];
            for y in 0..shape.height {
                let row = y * shape.width * C..(y + 1) * shape.width * C;
                if let Some(way) = moved {
                    self.scene.moved_row(y, way, line);
                } else if settings.is_warped() {
                    self.warp.sample(&self.scene, y, line);
                } else if settings.is_spatial() {
                    line.copy_from_slice(self.scene.row(y));
                } else {
                    load::<V, C>(&source.unwrap_or(target)[row.clone()], line);
                }
                shade::<C>(line, colour.as_ref(), noise.as_ref(), (y * shape.width) as u64);
                store::<V, C>(line, &mut target[row]);
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
    fn take_scene<V: Value, const C: usize>(&mut self, settings: &Settings, values: &[V], shape: Shape) {
        self.scene.take::<V, C>(values, shape);
        settings.blur.apply::<C>(&mut self.scene, &mut self.blurred);
        if settings.is_warped() {
            self.scene.surround(settings.border, V::FULL);
            if settings.moved().is_none() {
                self.warp.prepare(settings.lens, settings.shift, shape);
            }
        }
    }
}

/// What becomes of the pixels of a row where they are, of which the first has the number `first`.
#[inline(always)]
fn shade<const C: usize>(line: &mut [Pixel], colour: Option<&Colour>, noise: Option<&Noisy>, first: u64) {
    // One after the other: a pixel's way through both at once is too long for a processor to work on many pixels.
    if let Some(colour) = colour {
        line.iter_mut().for_each(|pixel| *pixel = colour.apply::<C>(*pixel));
    }
    if let Some(noise) = noise {
        line.iter_mut().zip(first..).for_each(|(pixel, at)| *pixel = noise.apply(*pixel, at));
    }
}
