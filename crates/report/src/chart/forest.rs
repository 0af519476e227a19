//! Forest plot: effects with error bars on a common axis with a line at zero.

use super::frame::{drawing, tenth};
use crate::axis::ticks;
use crate::number;
use furrow_base::math::ToFloat;
use maud::{Markup, html};

/// Width of a chart in its own units: larger than that of the small charts, to leave room for names.
const WIDTH: f64 = 440.0;
/// Right margin for half of a tick label.
const RIGHT: f64 = 24.0;
/// Height of a row, and of the tick labels below the last row.
const ROW: f64 = 22.0;
const FOOT: f64 = 22.0;
/// Approximate character width of a name, and maximum width of names.
const CHARACTER: f64 = 6.4;
const NAMES: f64 = 190.0;

/// One effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Name of the change.
    pub name: String,
    /// Mean effect in the chart's unit.
    pub mean: f64,
    /// Half-width of the error bar; `None` if unknown.
    pub spread: Option<f64>,
}

impl Effect {
    /// Returns `true` if zero is outside the error bar.
    fn is_beyond(&self) -> bool {
        self.spread.is_some_and(|spread| self.mean.abs() > spread)
    }

    fn ends(&self) -> (f64, f64) {
        let half = self.spread.unwrap_or(0.0);
        (self.mean - half, self.mean + half)
    }
}

/// Renders the chart, sorted by mean; empty if there are no effects. Effects whose error bar includes zero are pale.
pub fn forest(title: &str, unit: &str, effects: &[Effect]) -> Markup {
    if effects.is_empty() {
        return html! {};
    }
    let mut effects: Vec<&Effect> = effects.iter().collect();
    effects.sort_by(|a, b| a.mean.total_cmp(&b.mean));
    let longest = effects.iter().map(|effect| effect.name.chars().count()).max().unwrap_or(0);
    let left = (longest.to_f64() * CHARACTER).min(NAMES) + 16.0;
    let least = effects.iter().map(|effect| effect.ends().0).fold(0.0, f64::min);
    let most = effects.iter().map(|effect| effect.ends().1).fold(0.0, f64::max);
    let (least, most) = if least < most { (least, most) } else { (-1.0, 1.0) };
    let at = |value: f64| left + (value - least) / (most - least) * (WIDTH - left - RIGHT);
    let foot = ROW * effects.len().to_f64();
    let body = html! {
        @for tick in ticks(least, most, 5) {
            path.rung d=(format!("M{} 0V{}", tenth(at(tick)), tenth(foot))) {}
            text.tick x=(tenth(at(tick))) y=(tenth(foot + 15.0)) text-anchor="middle" { (number(tick)) }
        }
        path.zero d=(format!("M{} 0V{}", tenth(at(0.0)), tenth(foot))) {}
        @for (k, effect) in effects.iter().enumerate() { (row(effect, &at, left, ROW * (k.to_f64() + 0.5))) }
    };
    html! { figure.chart.forest { (drawing(title, unit, (WIDTH, foot + FOOT), body)) } }
}

/// One effect: name, error bar and mean.
fn row(effect: &Effect, at: &dyn Fn(f64) -> f64, left: f64, middle: f64) -> Markup {
    let (from, to) = effect.ends();
    let (from, to, mean, y) = (tenth(at(from)), tenth(at(to)), tenth(at(effect.mean)), tenth(middle));
    let shown = effect.name.chars().count().to_f64() * CHARACTER;
    // A name that does not fit is condensed, not truncated.
    let length = (shown > NAMES).then(|| tenth(NAMES));
    html! {
        g.beyond[effect.is_beyond()] data-effect=(effect.name) data-mean=(effect.mean) {
            title { (effect.name) ": " (number(effect.mean)) @if let Some(spread) = effect.spread { " ± " (number(spread)) } }
            text.name x=(tenth(left - 10.0)) y=(tenth(middle + 3.8)) text-anchor="end" textLength=[length]
                lengthAdjust=[(shown > NAMES).then_some("spacingAndGlyphs")] { (effect.name) }
            path.bar d=(format!("M{from} {y}H{to}")) {}
            circle cx=(mean) cy=(y) r="4" {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: readers compare positions by eye. Expected: the largest loss comes first; zero is between losses and
    /// gains; exactly those effects are marked that are beyond their error bar.
    #[test]
    fn effects_stand_in_order_on_one_axis() {
        let effect = |name: &str, mean, spread| Effect { name: name.into(), mean, spread };
        let all = [
            effect("flat leaves", 0.4, Some(1.0)),
            effect("no sky", -5.0, Some(2.0)),
            effect("a < b", 2.0, Some(0.5)),
            effect("once", -9.0, None),
        ];
        let svg = forest("Title", "percent", &all).0;
        let places: Vec<usize> = ["once", "no sky", "flat leaves", "a &lt; b"]
            .iter()
            .map(|name| svg.find(&format!("data-effect=\"{name}\"")).unwrap())
            .collect();
        assert!(places.is_sorted(), "{svg}");
        assert_eq!(svg.matches("class=\"beyond\"").count(), 2, "{svg}");
        let x = |part: &str| -> f64 {
            let cut = |text: &str| text.split_once(' ').and_then(|(x, _)| x.parse().ok());
            svg.split(part).nth(1).and_then(cut).unwrap_or_else(|| panic!("{part} in {svg}"))
        };
        let circle = |name: &str| -> f64 {
            let after = svg.split(&format!("data-effect=\"{name}\"")).nth(1).unwrap();
            after.split("cx=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
        };
        let zero = x("class=\"zero\" d=\"M");
        assert!(circle("no sky") < zero && zero < circle("flat leaves") && circle("flat leaves") < circle("a &lt; b"));
        assert_eq!(forest("Title", "", &[]).0, "");
    }
}
