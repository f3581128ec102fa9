//! A drawn scene as SVG for inside an HTML page.
//!
//! The plotting library's own writer names clip paths from a process-wide counter, gives a size in pixels and spends some
//! 16 bytes a point. Here names come from the caller, the size from the page, and points are relative, to a tenth of a
//! pixel: about 7 bytes.

use std::fmt::Write as _;

use kuva::render::color::Color;
use kuva::render::render::{Primitive, Scene, TextAnchor};

/// `scene` as one `<svg>` element, described by `alt`; `id` begins the names of its clip paths.
pub(super) fn write(scene: &Scene, id: &str, alt: &str) -> String {
    let mut out = format!(
        "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\" fill=\"var(--soft)\">",
        Px(scene.width),
        Px(scene.height),
        escape(alt)
    );
    let mut clips = 0;
    for element in &scene.elements {
        element_into(&mut out, element, id, &mut clips);
    }
    out.push_str("</svg>");
    out
}

fn element_into(out: &mut String, element: &Primitive, id: &str, clips: &mut usize) {
    match element {
        Primitive::Text { x, y, content, size, anchor, rotate, bold, color } => {
            let _ = write!(out, "<text x=\"{}\" y=\"{}\" font-size=\"{size}\"", Px(*x), Px(*y));
            match anchor {
                TextAnchor::Start => {}
                TextAnchor::Middle => out.push_str(" text-anchor=\"middle\""),
                TextAnchor::End => out.push_str(" text-anchor=\"end\""),
            }
            if *bold {
                out.push_str(" font-weight=\"bold\"");
            }
            if let Some(color) = color {
                attribute(out, "fill", color);
            }
            if let Some(angle) = rotate {
                let _ = write!(out, " transform=\"rotate({} {} {})\"", Px(*angle), Px(*x), Px(*y));
            }
            let _ = write!(out, ">{}</text>", escape(&content.replace("\\$", "$")));
        }
        Primitive::Line { x1, y1, x2, y2, stroke, stroke_width, stroke_dasharray } => {
            let _ = write!(out, "<path d=\"");
            path(out, &[(*x1, *y1), (*x2, *y2)]);
            out.push('"');
            stroked(out, stroke, *stroke_width, stroke_dasharray.as_deref());
        }
        Primitive::PolyLine { points, stroke, stroke_width, stroke_dasharray } => {
            out.push_str("<path d=\"");
            path(out, points);
            out.push_str("\" fill=\"none\"");
            stroked(out, stroke, *stroke_width, stroke_dasharray.as_deref());
        }
        Primitive::Path(shape) => {
            out.push_str("<path d=\"");
            path(out, &corners(&shape.d));
            out.push_str("z\"");
            attribute(out, "fill", shape.fill.as_ref().unwrap_or(&Color::None));
            if let Some(opacity) = shape.opacity {
                let _ = write!(out, " fill-opacity=\"{opacity}\"");
            }
            stroked(out, &shape.stroke, shape.stroke_width, shape.stroke_dasharray.as_deref());
        }
        Primitive::Rect { x, y, width, height, fill, opacity, .. } => {
            let (x, y, width, height) = (Px(*x), Px(*y), Px(*width), Px(*height));
            let _ = write!(out, "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"");
            attribute(out, "fill", fill);
            if let Some(opacity) = opacity {
                let _ = write!(out, " fill-opacity=\"{opacity}\"");
            }
            out.push_str("/>");
        }
        // A dot is a line of no length with round caps: one path for all of them.
        Primitive::CircleBatch { cx, cy, r, fill, fill_opacity, .. } => {
            out.push_str("<path d=\"");
            for (x, y) in cx.iter().zip(cy) {
                let _ = write!(out, "M{} {}h0", Px(*x), Px(*y));
            }
            out.push('"');
            if let Some(opacity) = fill_opacity {
                let _ = write!(out, " stroke-opacity=\"{opacity}\"");
            }
            stroked(out, fill, 2.0 * r, None);
        }
        Primitive::ClipStart { x, y, width, height, .. } => {
            let (x, y, width, height) = (Px(*x), Px(*y), Px(*width), Px(*height));
            let _ = write!(
                out,
                "<clipPath id=\"{id}-{clips}\"><rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/></clipPath>\
                 <g clip-path=\"url(#{id}-{clips})\">"
            );
            *clips += 1;
        }
        Primitive::GroupStart { .. } => out.push_str("<g>"),
        Primitive::ClipEnd | Primitive::GroupEnd => out.push_str("</g>"),
        // Never drawn by the kinds of plot in use.
        Primitive::Circle { .. } | Primitive::RichText { .. } | Primitive::RectBatch { .. } => {}
    }
}

fn attribute(out: &mut String, name: &str, color: &Color) {
    let _ = write!(out, " {name}=\"{}\"", color.to_svg_string());
}

fn stroked(out: &mut String, stroke: &Color, width: f64, dashes: Option<&str>) {
    attribute(out, "stroke", stroke);
    let _ = write!(out, " stroke-width=\"{}\"", Px(width));
    if let Some(dashes) = dashes.filter(|d| *d != "none") {
        let _ = write!(out, " stroke-dasharray=\"{}\"", escape(dashes));
    }
    out.push_str("/>");
}

/// The first point absolute, the others relative to the one before as it was written, so that rounding does not add up.
fn path(out: &mut String, points: &[(f64, f64)]) {
    let mut before: Option<(i64, i64)> = None;
    for (x, y) in points {
        let here = (tenths(*x), tenths(*y));
        match before {
            None => {
                let _ = write!(out, "M{} {}l", Tenths(here.0), Tenths(here.1));
            }
            Some(last) => {
                let (dx, dy) = (here.0 - last.0, here.1 - last.1);
                // A minus sign separates as well as a space does.
                let space = if dx < 0 { "" } else { " " };
                let gap = if dy < 0 { "" } else { " " };
                let _ = write!(out, "{space}{}{gap}{}", Tenths(dx), Tenths(dy));
            }
        }
        before = Some(here);
    }
    if points.len() < 2 {
        out.push_str("0 0");
    }
}

/// The corners of a path of straight lines.
fn corners(d: &str) -> Vec<(f64, f64)> {
    let numbers: Vec<f64> = d.split([' ', ',', 'M', 'L', 'Z']).filter_map(|n| n.parse().ok()).collect();
    numbers.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect()
}

fn tenths(v: f64) -> i64 {
    // Far outside the canvas nothing is seen, and no number grows long.
    if v.is_finite() { (v.clamp(-20_000.0, 20_000.0) * 10.0).round() as i64 } else { 0 }
}

/// A length to a tenth of a pixel.
struct Px(f64);

impl std::fmt::Display for Px {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Tenths(tenths(self.0)).fmt(f)
    }
}

/// A number of tenths, without the zeros that SVG does not need.
struct Tenths(i64);

impl std::fmt::Display for Tenths {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let sign = if self.0 < 0 { "-" } else { "" };
        match (self.0.abs() / 10, self.0.abs() % 10) {
            (whole, 0) => write!(f, "{sign}{whole}"),
            (0, part) => write!(f, "{sign}.{part}"),
            (whole, part) => write!(f, "{sign}{whole}.{part}"),
        }
    }
}

fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_relative_and_do_not_drift() {
        let points: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i) * 0.333, 10.04)).collect();
        let mut out = String::new();
        path(&mut out, &points);
        assert!(out.starts_with("M0 10l .3 0 .4 0 .3 0"), "{}", &out[..40]);
        let numbers: Vec<f64> = out["M0 10l".len()..].split(' ').filter_map(|n| n.parse().ok()).collect();
        let end: f64 = numbers.iter().step_by(2).sum();
        assert!((end - 332.667).abs() < 0.06, "{end}");
    }

    #[test]
    fn the_writer_never_writes_what_is_not_a_number() {
        let mut out = String::new();
        path(&mut out, &[(f64::NAN, 1.0), (f64::INFINITY, -1e300)]);
        assert_eq!(out, "M0 1l 0-20001");
        assert_eq!(corners("M 1 2 L 3 4 L 5.5 -6 Z"), vec![(1.0, 2.0), (3.0, 4.0), (5.5, -6.0)]);
    }
}
