//! What the papers claim, beside what is measured on bodies of the same size and kind.

use std::fmt::Write as _;

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_mesh::{Point, TetMesh, generate, quality};

use crate::Settings;
use crate::cases::{grid, variants};
use crate::measure::{Quality, Reshaped, cut_timed, show};

type Failure = Box<dyn std::error::Error>;

pub(crate) fn run(_: &Settings) -> Result<String, Failure> {
    let mut text = String::from("## What the papers claim\n");
    steinemann(&mut text)?;
    ganovelli(&mut text)?;
    yu_gu(&mut text)?;
    Ok(text)
}

/// A surface through a body in the unit cube, nowhere along its mesh.
fn wave(height: f64, swing: f64) -> Sweep {
    grid(10, |s, t| {
        let (x, y) = (1.4 * s - 0.2, 1.4 * t - 0.2);
        Point::new(
            x,
            y,
            height + 0.06 * x - 0.04 * y + swing * (4.0 * x + 1.0).sin() * (3.0 * y).cos(),
        )
    })
}

/// The cells of a mesh with other places.
fn with_places(mesh: &TetMesh, places: Vec<Point>) -> Option<TetMesh> {
    let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index())).collect();
    TetMesh::new(places, cells).ok()
}

/// The body with its worst `r / R` brought down to `worst`, by drawing some interior vertices towards a facet of a cell
/// each: meshes of organs are not as even as those of a generator.
fn roughened(mesh: &TetMesh, worst: f64) -> Option<TetMesh> {
    let mut places = mesh.rest_positions().to_vec();
    let inside = mesh.vertex_ids().filter(|v| !mesh.is_boundary_vertex(*v)).step_by(5);
    for v in inside {
        let cell = *mesh.cells_of_vertex(v).first()?;
        let others = mesh.cell(cell).into_iter().filter(|w| *w != v);
        let foot = others.map(|w| places[w.index()]).sum::<Point>() / 3.0;
        let start = places[v.index()];
        let (mut near, mut far) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = (near + far) / 2.0;
            places[v.index()] = start + (foot - start) * middle;
            let star = mesh.cells_of_vertex(v).iter();
            let of = |c: &kerfem_mesh::CellId| quality::radius_ratio(&mesh.cell(*c).map(|w| places[w.index()]));
            let least = star.map(of).fold(f64::INFINITY, f64::min);
            if least > 3.0 * worst {
                near = middle
            } else {
                far = middle
            }
        }
        places[v.index()] = start + (foot - start) * near;
    }
    with_places(mesh, places)
}

/// S14.
fn steinemann(text: &mut String) -> Result<(), Failure> {
    writeln!(
        text,
        "\n### S14, Steinemann et al. table 1\n\nTheir organs are not available: a ball and a cylinder of about as many tets, roughened to \
         their worst r/R. Ratios are to the original.\n\n| body | row | cells | of subdivision's | min r/R | of original | Vmax/Vmin | lmax/lmin |\n|{}",
        "---|".repeat(8)
    )?;
    let paper = [
        (
            "polyp",
            [
                ("original", 136., 0.017, 25.07, 4.11),
                ("subdivision", 543., 1e-6, 6674., 35.8),
                ("hybrid", 282., 0.015, 259., 23.9),
                ("enhanced", 266., 0.017, 92.9, 12.0),
            ],
        ),
        (
            "myoma",
            [
                ("original", 277., 0.025, 11.7, 2.03),
                ("subdivision", 1772., 1e-7, 3.6e7, 540.),
                ("hybrid", 615., 0.014, 94.8, 9.7),
                ("enhanced", 599., 0.016, 52.4, 7.7),
            ],
        ),
    ];
    let ball = generate::ball_tets([0.5; 3], 0.5, 2)?;
    let rod = generate::cylinder_tets([0.5, 0.5, 0.0], [0.0, 0.0, 1.0], 0.4, 1.0, 2, 4)?;
    for ((body, rows), mesh) in paper.into_iter().zip([ball, rod]) {
        let (split, original) = (rows[1].1, rows[0].2);
        for (name, cells, ratio, volumes, edges) in rows {
            let line = [cells, cells / split, ratio, ratio / original, volumes, edges]
                .map(show)
                .join(" | ");
            writeln!(text, "| {body} | paper: {name} | {line} |")?;
        }
        let mesh = roughened(&mesh, original).ok_or("the body cannot be roughened")?;
        let own = Quality::of(&mesh);
        let sweep = wave(0.44, 0.08);
        let cells_split = Quality::of(&cut_timed(&mesh, &sweep, &CutOptions::of(Method::Subdivide), 1)?.mesh).cells;
        // a wider threshold buys fewer cells with more distance from the sweep
        let wide = CutOptions {
            snap: 0.3,
            ..CutOptions::default()
        };
        let mut all = variants();
        all.push(("hybrid+, snap .3".into(), wide));
        let all = all.into_iter().map(|(name, options)| {
            let cut = cut_timed(&mesh, &sweep, &options, 1)?;
            Ok::<_, Failure>((name, Quality::of(&cut.mesh)))
        });
        for row in std::iter::once(Ok(("original".to_owned(), own))).chain(all) {
            let (name, q) = row?;
            let line = [
                q.cells as f64,
                q.cells as f64 / cells_split as f64,
                q.min_ratio / 3.0,
                q.min_ratio / own.min_ratio,
                q.volumes,
                q.edges,
            ];
            writeln!(text, "| {body} | ours: {name} | {} |", line.map(show).join(" | "))?;
        }
    }
    Ok(())
}

/// G6.
fn ganovelli(text: &mut String) -> Result<(), Failure> {
    writeln!(
        text,
        "\n### G6, Ganovelli and O'Sullivan\n\nCells cut, cells created in their place and the mean Q = 3r/R of these; a ball of 540 tets, \
         the sweep of forty that cuts most nearly as many.\n\n| row | cut | created | per cell cut | mean Q |\n|{}",
        "---|".repeat(5)
    )?;
    let mesh = generate::ball_tets([0.5; 3], 0.5, 3)?;
    for (wanted, paper) in [(85, [(455., 0.28), (240., 0.46)]), (137, [(712., 0.35), (324., 0.38)])] {
        for ((created, q), name) in paper.into_iter().zip(["subdivision", "collapse"]) {
            writeln!(
                text,
                "| paper: {name} | {wanted} | {created} | {} | {q} |",
                show(created / wanted as f64)
            )?;
        }
        let split = |k: usize| {
            let sweep = wave(0.1 + 0.01 * k as f64, 0.05);
            let cut = cut_timed(&mesh, &sweep, &CutOptions::of(Method::Subdivide), 1)?;
            let before = Reshaped::of(&cut.mesh, &cut.outcome.change).before;
            Ok::<_, Failure>((before.abs_diff(wanted), k, sweep))
        };
        let tried = (0..40).map(split).collect::<Result<Vec<_>, _>>()?;
        let (_, _, sweep) = tried.into_iter().min_by_key(|t| (t.0, t.1)).ok_or("no sweep")?;
        for (name, options) in variants() {
            let cut = cut_timed(&mesh, &sweep, &options, 1)?;
            let r = Reshaped::of(&cut.mesh, &cut.outcome.change);
            let each = show(r.created as f64 / r.before.max(1) as f64);
            writeln!(
                text,
                "| ours: {name} | {} | {} | {each} | {} |",
                r.before,
                r.created,
                show(r.mean_ratio)
            )?;
        }
    }
    Ok(())
}

/// Y10 and Y11.
fn yu_gu(text: &mut String) -> Result<(), Failure> {
    writeln!(
        text,
        "\n### Y10, Y11, Yu and Gu tables 2 and 3\n\nCells after the cut of those before, and longest edge over inradius: smallest, largest, \
         mean, share above 200. Boxes of about as many tets, shaken; one sweep, `CUBE 2`: three that cross.\n\n| body | row | before | after | \
         of before | smallest | largest | mean | bad |\n|{}",
        "---|".repeat(9)
    )?;
    let shape = "paper, table 3 (mesh not named)";
    for (row, values) in [
        ("original", [7.90, 28.25, 12.3, 0.0]),
        ("without merging", [7.90, 850.0, 38.3, 0.026]),
        ("with merging", [7.63, 763.0, 17.8, 0.0022]),
    ] {
        writeln!(text, "| {shape} | {row} | | | | {} |", values.map(show).join(" | "))?;
    }
    // body, boxes, tets before, and what the paper has
    type Row = (&'static str, [usize; 3], usize, f64, f64, f64);
    let paper: [Row; 5] = [
        ("CUBE", [5, 5, 5], 1, 750., 1300., 1300.),
        ("CUBE 2", [5, 5, 5], 3, 750., 3840., 2418.),
        ("MEAT", [8, 8, 4], 1, 1527., 2578., 2007.),
        ("SPINE", [10, 10, 12], 1, 7221., 8461., 7832.),
        ("BUNNY", [12, 12, 12], 1, 10666., 12193., 11355.),
    ];
    for (body, cells, sweeps, before, without, with) in paper {
        for (row, after) in [("without merging", without), ("with merging", with)] {
            writeln!(
                text,
                "| {body} | paper: {row} | {before} | {after} | {} | | | | |",
                show(after / before)
            )?;
        }
        let mesh = shaken(cells).ok_or("the body cannot be shaken")?;
        let own = Quality::of(&mesh);
        let shape = |q: &Quality| [q.min_aspect, q.max_aspect, q.mean_aspect, q.bad].map(show).join(" | ");
        writeln!(
            text,
            "| {body} | ours: original | {0} | {0} | 1 | {1} |",
            own.cells,
            shape(&own)
        )?;
        for (name, options) in variants() {
            let mut now = mesh.clone();
            for sweep in three().iter().take(sweeps) {
                now = cut_timed(&now, sweep, &options, 1)?.mesh;
            }
            let q = Quality::of(&now);
            let of_before = show(q.cells as f64 / own.cells as f64);
            writeln!(
                text,
                "| {body} | ours: {name} | {} | {} | {of_before} | {} |",
                own.cells,
                q.cells,
                shape(&q)
            )?;
        }
    }
    Ok(())
}

/// A sheet across z, one across x, and one aslant.
fn three() -> [Sweep; 3] {
    let at = |s: f64| 1.4 * s - 0.2;
    [
        wave(0.46, 0.03),
        grid(6, |s, t| Point::new(0.53 + 0.05 * (3.0 * at(t)).sin(), at(s), at(t))),
        grid(1, |s, t| Point::new(at(s), at(t), 0.9 * at(t) - 0.12 * at(s) + 0.13)),
    ]
}

/// A unit cube of six tets a cell, interior vertices shaken by a fifth of a cell.
fn shaken(cells: [usize; 3]) -> Option<TetMesh> {
    let mesh = generate::box_tets([1.0; 3], cells, [0.0; 3]);
    let noise = |i: usize, axis: usize| ((12.9898 * (3 * i + axis) as f64).sin() * 43758.5453).fract();
    let places = mesh.vertex_ids().map(|v| {
        let shift = Point::from_fn(|axis, _| 0.2 * noise(v.index(), axis) / cells[axis] as f64);
        mesh.rest_position(v)
            + if mesh.is_boundary_vertex(v) {
                Point::zeros()
            } else {
                shift
            }
    });
    with_places(&mesh, places.collect())
}
