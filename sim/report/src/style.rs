//! Colours of pictures, by role, on light and dark pages.
//!
//! Pictures are drawn in placeholder colours, one per role. In the HTML page these are replaced by CSS variables, which
//! follow the reader's light or dark theme. In SVG files they are replaced by the light theme's colours, and a style
//! sheet in the file replaces those by the dark ones where the reader's system is dark; viewers without style sheets
//! show the light ones.

use plotters::style::RGBColor;

/// The page behind everything: light and dark.
const PAGE: [&str; 2] = ["#ffffff", "#12161d"];
/// Text and axes.
pub const INK: RGBColor = RGBColor(1, 1, 1);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(2, 2, 2);
/// Positive values on maps: compression, normal force.
pub const PLUS: RGBColor = RGBColor(3, 3, 3);
/// Negative values on maps: tension.
pub const MINUS: RGBColor = RGBColor(4, 4, 4);
/// Limits and warnings.
pub const LIMIT: RGBColor = RGBColor(5, 5, 5);
/// Series; distinguishable with colour vision deficiency.
pub const SERIES: [RGBColor; 8] = [
    RGBColor(16, 0, 0),
    RGBColor(17, 0, 0),
    RGBColor(18, 0, 0),
    RGBColor(19, 0, 0),
    RGBColor(20, 0, 0),
    RGBColor(21, 0, 0),
    RGBColor(22, 0, 0),
    RGBColor(23, 0, 0),
];

/// Placeholder, CSS variable, light and dark colour of each role.
const ROLES: [(RGBColor, &str, &str, &str); 13] = [
    (INK, "ink", "#1c2330", "#e6e9ef"),
    (GRID, "grid", "#c9ced8", "#4a5364"),
    (PLUS, "plus", "#c0392b", "#ff7b6b"),
    (MINUS, "minus", "#1f6fb5", "#63b3ff"),
    (LIMIT, "limit", "#b00020", "#ff6b81"),
    (SERIES[0], "s0", "#7a7f8a", "#a3a9b5"),
    (SERIES[1], "s1", "#0072b2", "#56b4e9"),
    (SERIES[2], "s2", "#b35900", "#f0a04b"),
    (SERIES[3], "s3", "#00795a", "#2fd0a5"),
    (SERIES[4], "s4", "#8e44ad", "#cf9bea"),
    (SERIES[5], "s5", "#a3123f", "#ff8fb0"),
    (SERIES[6], "s6", "#5b6b00", "#c3d342"),
    (SERIES[7], "s7", "#12637a", "#7fdbf0"),
];

fn placeholder(RGBColor(r, g, b): RGBColor) -> String {
    format!("\"#{r:02X}{g:02X}{b:02X}\"")
}

/// The page's `:root` rules, which define the CSS variables.
pub fn variables() -> String {
    let rules = |pick: fn(&(RGBColor, &str, &'static str, &'static str)) -> &'static str| {
        ROLES.iter().map(|role| format!("--{}:{};", role.1, pick(role))).collect::<String>()
    };
    let [light, dark] = PAGE;
    format!(
        ":root{{color-scheme:light dark;--page:{light};--panel:#f5f6f8;{}}}\n\
         @media (prefers-color-scheme:dark){{:root{{--page:{dark};--panel:#1b212b;{}}}}}\n",
        rules(|role| role.2),
        rules(|role| role.3),
    )
}

/// The picture for the page: with CSS variables, scaled to the available width, with a description for screen readers.
pub fn themed(svg: &str, caption: &str) -> String {
    let mut svg = svg.to_owned();
    for role in &ROLES {
        svg = svg.replace(&placeholder(role.0), &format!("\"var(--{})\"", role.1));
    }
    let Some((head, body)) = svg.split_once('>') else { return svg };
    let box_ = head.split("viewBox=").nth(1).unwrap_or("\"0 0 1 1\"");
    let box_ = box_.split('"').nth(1).unwrap_or_default();
    format!("<svg viewBox=\"{box_}\" role=\"img\" aria-label=\"{}\">{body}", escape(caption))
}

/// The picture as an SVG file that follows the reader's light or dark theme; `title` and `description` are for screen
/// readers.
pub fn standalone(svg: &str, title: &str, description: &str) -> String {
    let [page, dark_page] = PAGE;
    let mut svg = svg.to_owned();
    let mut dark = format!("[fill=\"{page}\"]{{fill:{dark_page}}}");
    for (role, _, light_colour, dark_colour) in ROLES {
        let role = placeholder(role);
        if !svg.contains(&role) {
            continue;
        }
        svg = svg.replace(&role, &format!("\"{light_colour}\""));
        for property in ["fill", "stroke"] {
            dark.push_str(&format!("[{property}=\"{light_colour}\"]{{{property}:{dark_colour}}}"));
        }
    }
    let (title, description) = (escape(title), escape(description));
    match svg.split_once('>') {
        Some((head, body)) => format!(
            "{head} role=\"img\">\n<title>{title}</title>\n<desc>{description}</desc>\n\
             <style>@media (prefers-color-scheme:dark){{{dark}}}</style>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"{page}\"/>{body}"
        ),
        None => svg,
    }
}

/// Escapes text for use between tags or in quoted attributes.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg width=\"4\" height=\"2\" viewBox=\"0 0 4 2\" xmlns=\"x\">\n<rect fill=\"#010101\"/></svg>";

    #[test]
    fn roles_become_variables_or_light_colours() {
        let page = themed(SVG, "a < b");
        assert_eq!(
            page,
            "<svg viewBox=\"0 0 4 2\" role=\"img\" aria-label=\"a &lt; b\">\n<rect fill=\"var(--ink)\"/></svg>"
        );
        let file = standalone(SVG, "a < b", "c");
        assert!(file.contains("<title>a &lt; b</title>\n<desc>c</desc>") && file.contains("<rect fill=\"#1c2330\"/>"));
        // The dark colours of what is drawn, and of nothing else.
        let dark =
            "[fill=\"#ffffff\"]{fill:#12161d}[fill=\"#1c2330\"]{fill:#e6e9ef}[stroke=\"#1c2330\"]{stroke:#e6e9ef}}";
        assert!(file.contains(&format!("<style>@media (prefers-color-scheme:dark){{{dark}</style>")), "{file}");
        assert!(variables().contains("--ink:#e6e9ef;"));
    }

    #[test]
    fn placeholders_differ() {
        let all: std::collections::BTreeSet<String> = ROLES.iter().map(|role| placeholder(role.0)).collect();
        assert_eq!(all.len(), ROLES.len());
        // A file's style sheet tells roles, and the page, by their light colours.
        let light: std::collections::BTreeSet<&str> = ROLES.iter().map(|role| role.2).chain([PAGE[0]]).collect();
        assert_eq!(light.len(), ROLES.len() + 1);
    }
}
