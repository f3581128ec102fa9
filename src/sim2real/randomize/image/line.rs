//! A row of pixels under way, each channel by itself: the widest vectors then do the same with as many pixels.

use bytemuck::{cast_slice, cast_slice_mut};
use wide::{f32x4, f32x8};

use super::view::Value;

/// Numbers that are reckoned with together, each as it would be alone: what the widest vectors of common processors take.
pub(super) const LANES: usize = 8;

/// Red, green, blue and alpha of a row, from 0 to [`Value::FULL`](super::view::sealed::Value::FULL); a grey one has the first
/// alone. There is a whole number of vectors; at what is beyond the last pixel, and at channels that are none, nothing looks.
#[derive(Debug, Default)]
pub(super) struct Line {
    /// Their place in memory is a multiple of their size: none lies across two lines of the cache.
    channels: [Vec<f32x8>; 4],
}

impl Line {
    /// Makes room for so many pixels.
    pub fn resize(&mut self, width: usize) {
        let lanes = width.div_ceil(LANES);
        self.channels.iter_mut().for_each(|channel| channel.resize(lanes, f32x8::ZERO));
    }

    /// All channels.
    #[inline(always)]
    pub fn channels(&self) -> [&[f32]; 4] {
        self.channels.each_ref().map(|channel| cast_slice(channel))
    }

    /// All channels, to change.
    #[inline(always)]
    pub fn channels_mut(&mut self) -> [&mut [f32]; 4] {
        self.channels.each_mut().map(|channel| cast_slice_mut(channel))
    }

    /// Takes a row of `C` channels side by side.
    #[inline(always)]
    pub fn take<V: Value, const C: usize>(&mut self, row: &[V]) {
        let pixels = row.as_chunks::<C>().0;
        let mut channels = self.channels_mut().map(|channel| &mut channel[..pixels.len()]);
        for (x, pixel) in pixels.iter().enumerate() {
            for (channel, value) in channels.iter_mut().zip(pixel) {
                channel[x] = value.number();
            }
        }
    }

    /// Takes pixels of four numbers each, as many as fit.
    #[inline(always)]
    pub fn take_pixels(&mut self, pixels: &[[f32; 4]]) {
        let [red, green, blue, alpha] = self.channels_mut().map(|channel| channel.as_chunks_mut::<4>().0);
        let outputs = red.iter_mut().zip(green).zip(blue).zip(alpha);
        for ((((red, green), blue), alpha), [a, b, c, d]) in outputs.zip(pixels.as_chunks::<4>().0) {
            let [r, g, b, a] = f32x4::transpose([f32x4::new(*a), f32x4::new(*b), f32x4::new(*c), f32x4::new(*d)]);
            (*red, *green, *blue, *alpha) = (r.to_array(), g.to_array(), b.to_array(), a.to_array());
        }
    }

    /// Writes a row of `C` channels side by side, cut off and rounded as the values need it.
    #[inline(always)]
    pub fn store<V: Value, const C: usize>(&self, row: &mut [V]) {
        V::store::<C>(self.channels(), row);
    }
}
