//! Charts with logarithmic axes, and maps of coloured cells, as .svg and .png.

use std::ops::Range;
use std::path::Path;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{FontStyle, register_font};

use kerfem_mesh::io::IoError;

use crate::EngineError;

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

/// One picture in a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What the values are.
    pub title: String,
    /// What is drawn.
    pub drawing: Drawing,
}

/// What a panel shows.
#[derive(Clone, Debug, PartialEq)]
pub enum Drawing {
    /// Series over what runs along the lower edge, values on a logarithmic axis upwards.
    Series(Across, Vec<Series>),
    /// Numbers as coloured cells.
    Map(Map),
}

/// Numbers in a table of coloured cells, coloured by their logarithm.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// What changes from column to column, and from row to row.
    pub axes: [String; 2],
    /// Names of the columns, from the left.
    pub columns: Vec<String>,
    /// Names of the rows, from below.
    pub rows: Vec<String>,
    /// The numbers, row by row; none is black, as is what is not finite.
    pub values: Vec<Option<f64>>,
}

impl Panel {
    /// Series over an axis.
    pub fn series(title: impl Into<String>, across: Across, series: Vec<Series>) -> Panel {
        Panel {
            title: title.into(),
            drawing: Drawing::Series(across, series),
        }
    }

    fn all_series(&self) -> &[Series] {
        match &self.drawing {
            Drawing::Series(_, series) => series,
            Drawing::Map(_) => &[],
        }
    }
}

/// Writes panels side by side, `columns` in a row, as `PATH.svg` and `PATH.png`; the legend stands below.
///
/// # Errors
/// [`EngineError::Write`] if a file cannot be written.
pub fn write(path: &Path, panels: &[Panel], columns: usize) -> Result<(), EngineError> {
    let failed = |e: String| {
        EngineError::Write(IoError::Write {
            path: path.to_owned(),
            source: std::io::Error::other(e),
        })
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
    for s in panels.iter().flat_map(Panel::all_series) {
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
        true => Circle::new(place, 6, color.stroke_width(2)),
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
    let (across, series) = match &panel.drawing {
        Drawing::Series(across, series) => (across, series),
        Drawing::Map(map) => return draw_map(area, &panel.title, map),
    };
    let up = decades(series.iter().flat_map(|s| &s.points).map(|p| p.1)).unwrap_or(0.1..1.0);
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(12)
        .caption(&panel.title, ("sans-serif", 19))
        .x_label_area_size(42)
        .y_label_area_size(62);
    let grid = RGBColor(225, 225, 225);
    match across {
        Across::Log(title) => {
            let along = decades(series.iter().flat_map(|s| &s.points).map(|p| p.0)).unwrap_or(0.1..1.0);
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
            for s in series {
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
            for s in series {
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

/// A map spends all its colours on a ratio of at least this, so that what differs little looks alike.
const ALL_COLORS: f64 = 1.5;

/// Dark blue for the smallest of some numbers, yellow for the largest, by their logarithms.
fn shade(value: f64, range: &Range<f64>) -> RGBColor {
    const STOPS: [[f64; 3]; 4] = [
        [48.0, 18.0, 110.0],
        [33.0, 120.0, 150.0],
        [110.0, 205.0, 90.0],
        [253.0, 231.0, 37.0],
    ];
    let (low, high) = (range.start.ln(), range.end.ln());
    let place = if high > low {
        ((value.ln() - low) / (high - low)).clamp(0.0, 1.0)
    } else {
        0.0
    } * 3.0;
    let k = (place as usize).min(2);
    let mixed = |c: usize| STOPS[k][c] + (place - k as f64) * (STOPS[k + 1][c] - STOPS[k][c]);
    RGBColor(mixed(0) as u8, mixed(1) as u8, mixed(2) as u8)
}

/// A number in a cell of a map.
fn short(value: f64) -> String {
    match value.abs() {
        v if v != 0.0 && !(0.01..1000.0).contains(&v) => format!("{value:.0e}"),
        v if v < 10.0 => format!("{value:.2}"),
        _ => format!("{value:.0}"),
    }
}

fn draw_map<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    title: &str,
    map: &Map,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let text = |words: &str, place: (i32, i32), size: i32| {
        area.draw(&Text::new(words.to_owned(), place, ("sans-serif", size)))
    };
    let (width, height) = area.dim_in_pixel();
    let (left, top) = (120, 62);
    text(title, (left, 10), 19)?;
    text(&format!("{} (upwards)", map.axes[1]), (12, 38), 15)?;
    text(&map.axes[0], (left, height as i32 - 26), 15)?;
    let wide = (width as i32 - left - 16) / map.columns.len().max(1) as i32;
    let high = (height as i32 - top - 56) / map.rows.len().max(1) as i32;
    let seen = map.values.iter().flatten().copied().filter(|v| shown(*v));
    let range = seen.fold(f64::INFINITY..0.0, |r, v| r.start.min(v)..r.end.max(v));
    let range = range.start..range.end.max(ALL_COLORS * range.start);
    for (k, value) in map.values.iter().enumerate() {
        let (column, row) = ((k % map.columns.len()) as i32, (k / map.columns.len()) as i32);
        let x = left + column * wide;
        let y = top + (map.rows.len() as i32 - 1 - row) * high;
        let color = match value.filter(|v| v.is_finite()) {
            Some(value) if value > 0.0 => shade(value, &range),
            Some(_) => shade(range.start, &range),
            None => RGBColor(20, 20, 20),
        };
        area.draw(&Rectangle::new([(x, y), (x + wide - 2, y + high - 2)], color.filled()))?;
        let words = value.filter(|v| v.is_finite()).map_or("failed".to_owned(), short);
        let bright = u32::from(color.0) + u32::from(color.1) + u32::from(color.2) > 330;
        let style = ("sans-serif", 15)
            .into_font()
            .color(if bright { &BLACK } else { &WHITE });
        area.draw(&Text::new(words, (x + 6, y + high / 2 - 8), style))?;
    }
    // a letter is about this wide
    let fitting = |name: &str, pixels: i32| name.chars().take((pixels / 7).max(3) as usize).collect::<String>();
    for (k, name) in map.columns.iter().enumerate() {
        text(
            &fitting(name, wide - 4),
            (left + k as i32 * wide + 4, height as i32 - 48),
            14,
        )?;
    }
    for (k, name) in map.rows.iter().enumerate() {
        let y = top + (map.rows.len() - 1 - k) as i32 * high + high / 2 - 8;
        text(&fitting(name, left - 16), (12, y), 14)?;
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
            Panel::series(
                "lines",
                Across::Log("eps".into()),
                vec![line("first", 1.0), line("second", 5.0)],
            ),
            Panel::series("dots", Across::Names(vec!["this".into(), "that".into()]), vec![dots]),
            Panel {
                title: "cells".into(),
                drawing: Drawing::Map(Map {
                    axes: ["dt".into(), "young".into()],
                    columns: vec!["a".into(), "b".into()],
                    rows: vec!["c".into()],
                    values: vec![Some(12.0), None],
                }),
            },
        ]
    }

    #[test]
    fn both_files_are_written_and_hold_the_names() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("chart"), &panels(), 2).unwrap();
        let svg = std::fs::read_to_string(folder.path().join("chart.svg")).unwrap();
        for word in [
            "lines", "dots", "first", "second", "this", "that", "eps", "0.01", "young", "12", "failed",
        ] {
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
