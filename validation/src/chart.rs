//! Charts with logarithmic axes, as .svg and .png.

use std::ops::Range;
use std::path::Path;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use crate::ValidationError;

/// Pixels of one panel.
const PANEL: (u32, u32) = (800, 430);

/// Colours that stay apart for most eyes (Okabe and Ito 2008).
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(150, 150, 150),
];

/// Values of one kind, in the order given; those that are not positive and finite are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Number of its colour, from zero; there are eight.
    pub color: usize,
    /// Marked by rings instead of dots, and thinner lines.
    pub open: bool,
    /// Places and values.
    pub points: Vec<(f64, f64)>,
}

/// What runs along the lower edge of a panel.
#[derive(Clone, Debug, PartialEq)]
pub enum Across {
    /// A logarithmic axis with this name; the points of a series are joined by lines.
    Log(String),
    /// Names side by side: a point at `k` belongs to the name number `k`, from zero; points are not joined.
    Names(Vec<String>),
}

/// One picture in a chart: series over an axis, values on a logarithmic axis upwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What the values are.
    pub title: String,
    /// What runs along the lower edge.
    pub across: Across,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// Writes panels side by side, `columns` in a row, as `PATH.svg` and `PATH.png`; the legend stands below.
///
/// # Errors
/// [`ValidationError::Chart`] if a file cannot be written.
pub fn write(path: &Path, panels: &[Panel], columns: usize) -> Result<(), ValidationError> {
    let failed = |e: String| ValidationError::Chart {
        file: path.to_owned(),
        reason: e,
    };
    let columns = columns.clamp(1, panels.len().max(1));
    let rows = panels.len().div_ceil(columns);
    let legend = legend_height(panels);
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32 + legend);
    register_the_font();
    let (svg, png) = (path.with_extension("svg"), path.with_extension("png"));
    let mut text = String::new();
    let drawing = SVGBackend::with_string(&mut text, size).into_drawing_area();
    draw(&drawing, panels, [rows, columns], legend).map_err(failed)?;
    drop(drawing);
    // as wide as the page that it stands in
    let fixed = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    std::fs::write(&svg, text.replacen(&fixed, "width=\"100%\"", 1)).map_err(|e| failed(e.to_string()))?;
    let drawing = BitMapBackend::new(&png, size).into_drawing_area();
    draw(&drawing, panels, [rows, columns], legend).map_err(failed)
}

/// A font of our own: the system may have none.
fn register_the_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        for style in [FontStyle::Normal, FontStyle::Bold] {
            // the bytes are those of a font, so this cannot fail
            let _ = register_font("sans-serif", style, epaint_default_fonts::UBUNTU_LIGHT);
        }
    });
}

/// The first series of each name.
fn legend_of(panels: &[Panel]) -> Vec<&Series> {
    let mut out: Vec<&Series> = Vec::new();
    for s in panels.iter().flat_map(|p| &p.series) {
        if !out.iter().any(|o| o.name == s.name) {
            out.push(s);
        }
    }
    out
}

/// Names of a legend side by side in one line.
const LEGEND_COLUMNS: usize = 4;

fn legend_height(panels: &[Panel]) -> u32 {
    24 * legend_of(panels).len().div_ceil(LEGEND_COLUMNS) as u32 + 12
}

fn draw<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panels: &[Panel],
    [rows, columns]: [usize; 2],
    below: u32,
) -> Result<(), String> {
    let text = |e: DrawingAreaErrorKind<B::ErrorType>| e.to_string();
    area.fill(&WHITE).map_err(text)?;
    let (width, height) = area.dim_in_pixel();
    let (charts, below) = area.split_vertically(height.saturating_sub(below));
    let legend = legend_of(panels);
    for (panel, area) in panels.iter().zip(charts.split_evenly((rows, columns))) {
        draw_panel(&area, panel, &legend).map_err(text)?;
    }
    for (k, series) in legend.iter().enumerate() {
        let x = (width as usize / LEGEND_COLUMNS * (k % LEGEND_COLUMNS)) as i32 + 24;
        let y = 24 * (k / LEGEND_COLUMNS) as i32 + 12;
        below.draw(&mark((x, y), series)).map_err(text)?;
        let place = (x + 12, y - 8);
        below
            .draw(&Text::new(series.name.clone(), place, ("sans-serif", 16)))
            .map_err(text)?;
    }
    area.present().map_err(text)
}

fn color(series: &Series) -> RGBColor {
    COLORS[series.color % COLORS.len()]
}

fn mark<C>(place: C, series: &Series) -> Circle<C, i32> {
    let color = color(series);
    match series.open {
        true => Circle::new(place, 5, color.stroke_width(2)),
        false => Circle::new(place, 5, color.filled()),
    }
}

fn shown(value: f64) -> bool {
    value.is_finite() && value > 0.0
}

/// The powers of ten around some values; `None` for none.
fn decades(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    let (low, high) = values
        .filter(|v| shown(*v))
        .fold((f64::INFINITY, 0.0), |(a, b), v| (f64::min(a, v), f64::max(b, v)));
    let (low, high) = (low.log10().floor(), high.log10().ceil());
    (low <= high).then(|| 10f64.powf(low)..10f64.powf(high.max(low + 1.0)))
}

/// Short form of a tick: 0.01, 1, 1e-5.
fn tick(value: &f64) -> String {
    match value.abs() {
        v if (1e-3..1e4).contains(&v) => format!("{value}"),
        _ => format!("{value:e}"),
    }
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel,
    legend: &[&Series],
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let up = decades(panel.series.iter().flat_map(|s| &s.points).map(|p| p.1)).unwrap_or(0.1..1.0);
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(12)
        .caption(&panel.title, ("sans-serif", 19))
        .x_label_area_size(42)
        .y_label_area_size(62);
    let grid = RGBColor(225, 225, 225);
    match &panel.across {
        Across::Log(title) => {
            let along = decades(panel.series.iter().flat_map(|s| &s.points).map(|p| p.0)).unwrap_or(0.1..1.0);
            let mut chart = builder.build_cartesian_2d(along.log_scale(), up.log_scale())?;
            chart
                .configure_mesh()
                .light_line_style(WHITE.mix(0.0))
                .bold_line_style(grid)
                .x_desc(title.as_str())
                .x_label_formatter(&tick)
                .y_label_formatter(&tick)
                .label_style(("sans-serif", 15))
                .draw()?;
            for s in &panel.series {
                let points: Vec<(f64, f64)> = s.points.iter().copied().filter(|p| shown(p.1)).collect();
                let width = if s.open { 1 } else { 2 };
                chart.draw_series([PathElement::new(points.clone(), color(s).stroke_width(width))])?;
                chart.draw_series(points.into_iter().map(|p| mark(p, s)))?;
            }
        }
        Across::Names(columns) => {
            let mut chart = builder.build_cartesian_2d(-0.5..columns.len() as f64 - 0.5, up.log_scale())?;
            let named = |x: &f64| {
                let k = x.round();
                let near = (x - k).abs() < 1e-6 && k >= 0.0;
                columns.get(k as usize).filter(|_| near).cloned().unwrap_or_default()
            };
            chart
                .configure_mesh()
                .light_line_style(WHITE.mix(0.0))
                .bold_line_style(grid)
                .x_labels(4 * columns.len() + 1)
                .x_label_formatter(&named)
                .y_label_formatter(&tick)
                .label_style(("sans-serif", 14))
                .draw()?;
            for s in &panel.series {
                // side by side, so that equal values do not hide each other
                let place = legend.iter().position(|l| l.name == s.name).unwrap_or(0);
                let shift = 0.08 * (place as f64 - (legend.len() as f64 - 1.0) / 2.0);
                let points = s.points.iter().filter(|p| shown(p.1)).map(|p| (p.0 + shift, p.1));
                chart.draw_series(points.map(|p| mark(p, s)))?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panels() -> Vec<Panel> {
        let line = |name: &str, factor: f64| Series {
            name: name.into(),
            color: 0,
            open: false,
            points: [1e-3, 1e-2, 0.1].map(|x| (x, factor / x)).to_vec(),
        };
        let dots = Series {
            name: "second".into(),
            color: 1,
            open: true,
            points: vec![(0.0, 3.0), (1.0, 0.0), (1.0, f64::INFINITY)],
        };
        vec![
            Panel {
                title: "lines".into(),
                across: Across::Log("eps".into()),
                series: vec![line("first", 1.0), line("second", 5.0)],
            },
            Panel {
                title: "dots".into(),
                across: Across::Names(vec!["this".into(), "that".into()]),
                series: vec![dots],
            },
        ]
    }

    #[test]
    fn both_files_are_written_and_hold_the_names() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("chart"), &panels(), 2).unwrap();
        let svg = std::fs::read_to_string(folder.path().join("chart.svg")).unwrap();
        for word in ["lines", "dots", "first", "second", "this", "that", "eps", "0.01"] {
            assert!(svg.contains(word), "{word}");
        }
        // six points of lines, one dot that can be shown, two of the legend
        assert_eq!(svg.matches("<circle").count(), 9);
        let png = std::fs::read(folder.path().join("chart.png")).unwrap();
        assert!(png.starts_with(b"\x89PNG") && png.len() > 5000);
    }

    #[test]
    fn empty_charts_and_missing_folders() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("empty"), &[], 3).unwrap();
        let nowhere = folder.path().join("no such folder").join("chart");
        let error = write(&nowhere, &panels(), 1).unwrap_err().to_string();
        assert!(error.contains("chart") && !error.contains('\n'), "{error}");
    }

    #[test]
    fn axes_span_whole_decades() {
        assert_eq!(decades([0.02, 3.0, 0.0, f64::NAN].into_iter()), Some(0.01..10.0));
        assert_eq!(decades([1.0].into_iter()), Some(1.0..10.0));
        assert_eq!(decades([0.0].into_iter()), None);
        assert_eq!(tick(&1e-6), "1e-6");
    }
}
