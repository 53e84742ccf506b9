//! The objective Π over the disc of μ, with the path and result of the search and the true μ.

use anyhow::Result;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::super::measure::ObjectiveMap;
use super::super::style::{INK, LIMIT, SERIES};
use super::{note, svg, Area};

const CENTRE: (i32, i32) = (184, 166);
const RADIUS: f64 = 140.0;
/// Exponent of the colour scale: the smaller, the steeper it is near the maximum.
const DEPTH: f64 = 0.25;

/// Draws an objective map as SVG.
///
/// # Errors
/// A picture that cannot be written.
pub fn objective(map: &ObjectiveMap) -> Result<String> {
    let side = (map.values.len() as f64).sqrt() as usize;
    let half = (side / 2) as f64;
    let at = |[x, y]: [f64; 2]| {
        let scale = RADIUS / map.mu_max;
        (CENTRE.0 + (x * scale).round() as i32, CENTRE.1 + (y * scale).round() as i32)
    };
    let found = || map.values.iter().flatten();
    let best = found().copied().fold(f64::NEG_INFINITY, f64::max);
    let worst = found().copied().fold(f64::INFINITY, f64::min);
    let depth = (best - worst).max(f64::MIN_POSITIVE);
    svg(382, |area| {
        let cell = map.mu_max / half;
        for (index, value) in map.values.iter().enumerate() {
            let Some(value) = value else { continue };
            let (x, y) = ((index % side) as f64 - half, (index / side) as f64 - half);
            // A power law: the colour scale is steepest near the maximum.
            let share = (1.0 - (best - value) / depth).max(0.0).powf(1.0 / DEPTH);
            let corners = [at([(x - 0.5) * cell, (y - 0.5) * cell]), at([(x + 0.5) * cell, (y + 0.5) * cell])];
            area.draw(&Rectangle::new(corners, SERIES[1].mix(0.06 + 0.9 * share).filled()))?;
        }
        area.draw(&Circle::new(CENTRE, RADIUS as i32, INK.stroke_width(1)))?;
        if let Some(truth) = map.truth {
            cross(area, at(truth))?;
        }
        let path: Vec<(i32, i32)> = map.path.iter().map(|mu| at(*mu)).collect();
        for place in &path {
            area.draw(&Circle::new(*place, 2, INK.filled()))?;
        }
        area.draw(&PathElement::new(path.clone(), INK.stroke_width(1)))?;
        area.draw(&Circle::new(at(map.golden), 8, SERIES[2].stroke_width(2)))?;
        if let Some(end) = path.last() {
            area.draw(&Circle::new(*end, 4, INK.filled()))?;
        }
        axes(area, map)?;
        legend(area)
    })
}

fn cross(area: &Area, (x, y): (i32, i32)) -> Result<()> {
    for d in [7, -7] {
        area.draw(&PathElement::new(vec![(x - 7, y - d), (x + 7, y + d)], LIMIT.stroke_width(2)))?;
    }
    Ok(())
}

fn axes(area: &Area, map: &ObjectiveMap) -> Result<()> {
    let (r, (x, y)) = (RADIUS as i32, CENTRE);
    note(area, &format!("−{}", map.mu_max), (x - r - 6, y), HPos::Right, VPos::Center)?;
    note(area, &format!("μ1 = {}", map.mu_max), (x + r + 6, y), HPos::Left, VPos::Center)?;
    note(area, &format!("−{}", map.mu_max), (x, y - r - 12), HPos::Center, VPos::Center)?;
    note(area, &format!("μ2 = {}", map.mu_max), (x, y + r + 12), HPos::Center, VPos::Center)
}

fn legend(area: &Area) -> Result<()> {
    area.draw(&PathElement::new(vec![(16, 346), (40, 346)], INK.stroke_width(1)))?;
    area.draw(&Circle::new((40, 346), 4, INK.filled()))?;
    note(area, "path and result, bit-true", (50, 346), HPos::Left, VPos::Center)?;
    area.draw(&Circle::new((236, 346), 7, SERIES[2].stroke_width(2)))?;
    note(area, "result, golden", (250, 346), HPos::Left, VPos::Center)?;
    cross(area, (28, 368))?;
    note(area, "true shear over load", (50, 368), HPos::Left, VPos::Center)?;
    area.draw(&Rectangle::new([(229, 361), (243, 375)], SERIES[1].mix(0.9).filled()))?;
    note(area, "Π near its maximum", (250, 368), HPos::Left, VPos::Center)
}
