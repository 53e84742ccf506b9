//! The table of standard deviations of a search, as text.

use dermis_golden::estimate::deviations::Deviations;

use super::table::markdown;

/// The table, a line per level of noise.
pub fn deviations(table: &Deviations) -> String {
    let edges: Vec<String> = table.sizes.iter().map(|size| format!("{size:.1}")).collect();
    let class = |class: usize| match (class.checked_sub(1).map(|low| &edges[low]), edges.get(class)) {
        (None, Some(high)) => format!("up to {high} taxels"),
        (Some(low), Some(high)) => format!("{low} to {high}"),
        (Some(low), None) => format!("above {low}"),
        (None, None) => "all sizes".to_owned(),
    };
    let classes: Vec<String> = (0..=edges.len()).map(class).collect();
    let head: Vec<&str> = std::iter::once("noise").chain(classes.iter().map(String::as_str)).collect();
    let cell = |[x, y, normal]: &[f64; 3]| format!("{x:.3} {y:.3}, {:.2} %", 1e2 * normal);
    let row = |(level, sigma): (&f64, &Vec<[f64; 3]>)| {
        std::iter::once(format!("{level:.1e}")).chain(sigma.iter().map(cell)).collect::<Vec<_>>()
    };
    let mut text = markdown(&head, table.levels.iter().zip(&table.sigma).map(row).collect());
    text.push_str(
        "Standard deviations of μ along x and y, of the normal force over the force; by noise over peak, and by\n",
    );
    text.push_str("normal force over that of the peak on one taxel.\n");
    text
}

/// How often the errors of frames at `levels` of noise are within a table's deviations.
pub fn deviations_covered(levels: &[f64], covered: &[[f64; 3]]) -> String {
    let share = |share: f64| format!("{:.0} %", 1e2 * share);
    let row = |(level, own): (&f64, &[f64; 3])| {
        std::iter::once(format!("{level:.1e}")).chain(own.map(share)).collect::<Vec<_>>()
    };
    let rows = levels.iter().zip(covered).map(row).collect();
    markdown(&["noise", "shear x within one", "shear y within one", "normal force within one"], rows)
}
