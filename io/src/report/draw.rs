//! A chart as SVG: labels and legend above, ticks with their grid, marks cut at the frame.

use super::chart::{Chart, Mark};
use super::curve::{path, thinned};
use super::escape::escape;
use super::palette::Ink;
use super::ticks::Ruler;

const LEFT: f64 = 58.0;
const RIGHT: f64 = 14.0;
const BELOW: f64 = 40.0;
const LINE: f64 = 17.0;
/// Mean width of a letter of the legend.
const LETTER: f64 = 6.3;
/// Pixels beyond the frame at which a curve is held: nothing there is seen.
const FAR: f64 = 5000.0;

/// The frame in pixels, and the axes over it.
struct Frame {
    top: f64,
    width: f64,
    height: f64,
    x: Ruler,
    y: Ruler,
}

impl Frame {
    /// Inside the frame, from its upper left corner.
    fn pixel(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let held = |v: f64| if v.is_nan() { v } else { v.clamp(-FAR, FAR) };
        (held(self.x.share(x) * self.width), held((1.0 - self.y.share(y)) * self.height))
    }
}

pub(super) fn svg(chart: &Chart) -> String {
    let (legend, rows) = legend(chart);
    let top = 22.0 + LINE * rows as f64;
    let width = chart.width - LEFT - RIGHT;
    let reach: Vec<(f64, f64)> = chart.marks.iter().flat_map(Mark::reach).collect();
    let frame = Frame {
        top,
        width,
        height: chart.height,
        x: Ruler::new(chart.x.range, reach.iter().map(|p| p.0), chart.x.scale, (width / 75.0) as usize),
        y: Ruler::new(
            chart.y.range,
            reach.iter().map(|p| p.1),
            chart.y.scale,
            ((chart.height / 38.0) as usize).max(4),
        ),
    };
    let height = top + chart.height + BELOW;
    let mut out = format!(
        "<svg class=\"chart\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0} {height:.0}\" width=\"{:.0}\" height=\"{height:.0}\" font-family=\"Helvetica, Arial, sans-serif\" role=\"img\"><title>{}</title>",
        chart.width,
        chart.width,
        escape(&chart.title)
    );
    out.push_str(&legend);
    out.push_str(&text(4.0, 14.0, "start", "#3c444c", 12.0, &chart.y.label));
    out.push_str(&text(LEFT + width, height - 5.0, "end", "#3c444c", 12.0, &chart.x.label));
    out.push_str(&axes(&frame));
    out.push_str(&format!(
        "<svg x=\"{LEFT}\" y=\"{top:.0}\" width=\"{width:.0}\" height=\"{:.0}\" overflow=\"hidden\">",
        chart.height
    ));
    chart.marks.iter().for_each(|mark| out.push_str(&drawn(mark, &frame)));
    out.push_str("</svg>");
    out.push_str(&format!(
        "<rect x=\"{LEFT}\" y=\"{top:.0}\" width=\"{width:.0}\" height=\"{:.0}\" fill=\"none\" stroke=\"#aab2ba\"/></svg>",
        chart.height
    ));
    out
}

fn text(x: f64, y: f64, anchor: &str, colour: &str, size: f64, words: &str) -> String {
    format!(
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"{size}\" fill=\"{colour}\">{}</text>",
        escape(words)
    )
}

fn axes(frame: &Frame) -> String {
    let mut out = String::new();
    let bottom = frame.top + frame.height;
    for (value, words) in &frame.x.ticks {
        let x = LEFT + frame.x.share(*value) * frame.width;
        out.push_str(&rule(x, frame.top, x, bottom));
        out.push_str(&text(x, bottom + 15.0, "middle", "#57606a", 11.0, words));
    }
    for (value, words) in &frame.y.ticks {
        let y = frame.top + (1.0 - frame.y.share(*value)) * frame.height;
        out.push_str(&rule(LEFT, y, LEFT + frame.width, y));
        out.push_str(&text(LEFT - 6.0, y + 4.0, "end", "#57606a", 11.0, words));
    }
    out
}

fn rule(x1: f64, y1: f64, x2: f64, y2: f64) -> String {
    format!("<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"#e6e9ec\" fill=\"none\"/>")
}

fn stroke(ink: Ink) -> String {
    let dash = ink.dash().map_or_else(String::new, |d| format!(" stroke-dasharray=\"{d}\""));
    format!(
        "stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" fill=\"none\"{dash}",
        ink.colour(),
        ink.width()
    )
}

fn drawn(mark: &Mark, frame: &Frame) -> String {
    match mark {
        Mark::Line { points, ink, .. } => {
            let d = path(thinned(points).into_iter().map(|p| frame.pixel(p)));
            format!("<path d=\"{d}\" {}/>", stroke(*ink))
        }
        Mark::Band { points, ink, .. } => {
            let known = || points.iter().filter(|p| p.1.is_finite() && p.2.is_finite());
            let there = known().map(|p| frame.pixel((p.0, p.2)));
            let back = known().rev().map(|p| frame.pixel((p.0, p.1)));
            let d = path(there.chain(back));
            if d.is_empty() {
                return d;
            }
            format!("<path d=\"{d}Z\" fill=\"{}\" fill-opacity=\"0.16\" stroke=\"none\"/>", ink.colour())
        }
        Mark::Point { label, x, y, ink } => {
            let (x, y) = frame.pixel((*x, *y));
            if !(x.is_finite() && y.is_finite()) {
                return String::new();
            }
            // Words go to the side that has room.
            let (beside, anchor) = if x > 0.7 * frame.width { (x - 8.0, "end") } else { (x + 8.0, "start") };
            format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.5\" fill=\"{}\" stroke=\"#fff\"/>{}",
                ink.colour(),
                text(beside, y - 6.0, anchor, ink.colour(), 11.0, label)
            )
        }
        Mark::Circle { centre, radius, ink, .. } => {
            let (cx, cy) = frame.pixel(*centre);
            let (rx, ry) = frame.pixel((centre.0 + radius, centre.1 - radius));
            // A circle has no shape on a logarithmic axis.
            if !(cx.is_finite() && cy.is_finite() && rx.is_finite() && ry.is_finite()) {
                return String::new();
            }
            format!(
                "<ellipse cx=\"{cx:.1}\" cy=\"{cy:.1}\" rx=\"{:.1}\" ry=\"{:.1}\" {}/>",
                (rx - cx).abs(),
                (ry - cy).abs(),
                stroke(*ink)
            )
        }
    }
}

/// The legend in as many rows as it takes.
fn legend(chart: &Chart) -> (String, usize) {
    let mut out = String::new();
    let (mut x, mut row) = (LEFT, 0);
    let entries: Vec<_> = chart.marks.iter().filter_map(Mark::legend).collect();
    for (name, ink, is_band) in &entries {
        let length = 34.0 + LETTER * name.chars().count() as f64;
        if x > LEFT && x + length > chart.width - RIGHT {
            (x, row) = (LEFT, row + 1);
        }
        let y = 22.0 + LINE * row as f64 + 5.0;
        if *is_band {
            out.push_str(&format!(
                "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"20\" height=\"9\" fill=\"{}\" fill-opacity=\"0.16\"/>",
                y - 5.0,
                ink.colour()
            ));
        } else {
            out.push_str(&format!("<path d=\"M{x:.1} {y:.1}L{:.1} {y:.1}\" {}/>", x + 20.0, stroke(*ink)));
        }
        out.push_str(&text(x + 25.0, y + 4.0, "start", "#3c444c", 11.5, name));
        x += length;
    }
    (out, if entries.is_empty() { 0 } else { row + 1 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Axis;

    #[test]
    fn names_are_escaped_and_nothing_is_not_a_number() {
        let marks = vec![
            Mark::line("<b>&", vec![(0.0, f64::NAN), (1.0, 2.0), (2.0, f64::INFINITY)], Ink::First),
            Mark::Band { name: None, points: vec![(0.0, f64::NAN, 1.0)], ink: Ink::First },
            Mark::Point { label: "\"".into(), x: f64::NAN, y: 1.0, ink: Ink::Limit },
            Mark::Circle { name: Some("Ms".into()), centre: (-1.0, 0.0), radius: 0.7, ink: Ink::Limit },
        ];
        let text = svg(&Chart::wide("<t>", Axis::fitting("time (s)"), Axis::log("<y>"), marks));
        assert!(
            text.contains("&lt;b&gt;&amp;") && text.contains("&lt;y&gt;") && !text.contains("<b>"),
            "{text}"
        );
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}
