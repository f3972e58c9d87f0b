//! gmsh 1 (`$NOD`, `$ELM`) and 2 (ASCII, binary): one list of nodes and one of elements.

use crate::Point;

use super::data::MeshData;
use super::error::Problem;
use super::gmsh::{Builder, ElementKind};
use super::gmsh_source::Source;
use super::text::{Cursor, shown};

/// The content of a file of version 1, from its start.
pub(super) fn parse_version_1(mut cursor: Cursor) -> Result<MeshData, Problem> {
    let mut mesh = Builder::default();
    cursor.section = "$NOD".into();
    cursor.expect("$NOD")?;
    nodes(&mut cursor, &mut mesh)?;
    cursor.expect("$ENDNOD")?;
    cursor.section = "$ELM".into();
    cursor.expect("$ELM")?;
    mesh.begin_elements();
    for _ in 0..cursor.count("the number of elements", 12)? {
        cursor.integer("an element number")?;
        let kind = cursor.integer("an element type")?;
        let kind = ElementKind::new(&cursor, kind)?;
        let group = cursor.integer("a physical group")?;
        cursor.integer("an entity")?;
        let count = cursor.integer("a number of nodes")?;
        if count != kind.num_nodes() as i64 {
            return Err(cursor.problem(format!(
                "an element of {} nodes is said to have {count}",
                kind.num_nodes()
            )));
        }
        corners(&mut cursor, &mut mesh, kind, group)?;
    }
    cursor.expect("$ENDELM")?;
    mesh.finish(&cursor)
}

/// The content of a file of version 2, after the section that names the version.
pub(super) fn parse_version_2(mut cursor: Cursor) -> Result<MeshData, Problem> {
    let mut mesh = Builder::default();
    while cursor.peek().is_some() {
        let section = cursor.word("a section")?;
        cursor.section = shown(section);
        match section {
            b"$PhysicalNames" => mesh.physical_names(&mut cursor)?,
            b"$Nodes" => {
                nodes(&mut cursor, &mut mesh)?;
                cursor.expect("$EndNodes")?;
            }
            b"$Elements" => {
                mesh.begin_elements();
                for _ in 0..cursor.count("the number of elements", 8)? {
                    element_of_version_2(&mut cursor, &mut mesh)?;
                }
                cursor.expect("$EndElements")?;
            }
            _ => skip_section(&mut cursor, section)?,
        }
    }
    mesh.finish(&cursor)
}

/// The content of a binary file of version 2, from the number one that gives the order of bytes: node numbers and all of an
/// element's have 4 bytes, coordinates 8; elements stand in blocks of one kind.
pub(super) fn parse_version_2_binary(cursor: Cursor) -> Result<MeshData, Problem> {
    let mut source = Source::binary(cursor)?;
    let mut mesh = Builder::default();
    while source.cursor.peek().is_some() {
        let section = source.cursor.word("a section")?;
        source.cursor.section = shown(section);
        match section {
            b"$PhysicalNames" => mesh.physical_names(&mut source.cursor)?,
            b"$Nodes" => {
                let count = source.cursor.count("the number of nodes", 28)?;
                source.cursor.rest_of_line();
                for _ in 0..count {
                    let tag = source.node_number()?;
                    let point = Point::new(source.real("x")?, source.real("y")?, source.real("z")?);
                    mesh.node(&source.cursor, tag, point)?;
                }
                source.cursor.expect("$EndNodes")?;
            }
            b"$Elements" => {
                mesh.begin_elements();
                let mut left = source.cursor.count("the number of elements", 8)?;
                source.cursor.rest_of_line();
                while left > 0 {
                    left -= binary_block_of_elements(&mut source, &mut mesh, left)?;
                }
                source.cursor.expect("$EndElements")?;
            }
            _ => skip_section(&mut source.cursor, section)?,
        }
    }
    mesh.finish(&source.cursor)
}

/// kind, how many elements follow, how many tags each has; then number, tags and nodes of each. How many there were.
fn binary_block_of_elements(source: &mut Source, mesh: &mut Builder, left: usize) -> Result<usize, Problem> {
    let kind = source.int("an element type")?;
    let kind = ElementKind::new(&source.cursor, kind)?;
    let count = source.int("the number of elements of a block")?;
    let count = source
        .cursor
        .check_count(count, "the number of elements of a block", 4)?;
    if count == 0 || count > left {
        let text = format!("a block has {count} elements where {left} are left; 1 to {left} are accepted");
        return Err(source.cursor.problem(text));
    }
    let tags = source.int("a number of tags")?;
    let tags = source.cursor.check_count(tags, "a number of tags", 4)?;
    for _ in 0..count {
        source.int("an element number")?;
        let mut group = 0;
        for k in 0..tags {
            let tag = source.int("a tag")?;
            if k == 0 {
                group = tag;
            }
        }
        let mut nodes = [0; 4];
        for node in &mut nodes[..kind.num_nodes()] {
            *node = source.node_number()?;
        }
        mesh.element(&source.cursor, kind, &nodes[..kind.num_nodes()], &[group.abs()])?;
    }
    Ok(count)
}

/// Passes a section that is not read.
pub(super) fn skip_section(cursor: &mut Cursor, section: &[u8]) -> Result<(), Problem> {
    match section.strip_prefix(b"$") {
        Some(name) if !name.is_empty() && !name.starts_with(b"End") => {
            cursor.skip_past(&format!("$End{}", String::from_utf8_lossy(name)))
        }
        _ => Err(cursor.problem(format!(
            "found '{}' where a section ($Name) should begin",
            shown(section)
        ))),
    }
}

fn nodes(cursor: &mut Cursor, mesh: &mut Builder) -> Result<(), Problem> {
    for _ in 0..cursor.count("the number of nodes", 8)? {
        let tag = node_number(cursor)?;
        let point = Point::new(cursor.real("x")?, cursor.real("y")?, cursor.real("z")?);
        mesh.node(cursor, tag, point)?;
    }
    Ok(())
}

fn node_number(cursor: &mut Cursor) -> Result<u64, Problem> {
    cursor.number("a node number", "a whole number from 0")
}

fn element_of_version_2(cursor: &mut Cursor, mesh: &mut Builder) -> Result<(), Problem> {
    cursor.integer("an element number")?;
    let kind = cursor.integer("an element type")?;
    let kind = ElementKind::new(cursor, kind)?;
    let mut group = 0;
    for k in 0..cursor.count("a number of tags", 2)? {
        let tag = cursor.integer("a tag")?;
        if k == 0 {
            group = tag;
        }
    }
    corners(cursor, mesh, kind, group)
}

fn corners(cursor: &mut Cursor, mesh: &mut Builder, kind: ElementKind, group: i64) -> Result<(), Problem> {
    let mut nodes = [0; 4];
    for node in &mut nodes[..kind.num_nodes()] {
        *node = node_number(cursor)?;
    }
    mesh.element(cursor, kind, &nodes[..kind.num_nodes()], &[group.abs()])
}
