//! gmsh 4.1, ASCII and binary: nodes and elements in blocks, one for each geometric entity.

use std::collections::BTreeMap;

use crate::Point;

use super::data::MeshData;
use super::error::Problem;
use super::gmsh::{Builder, ElementKind};
use super::gmsh_legacy::skip_section;
use super::gmsh_source::Source;
use super::text::{Cursor, shown};

/// The content of an ASCII file, after the section that names the version.
pub(super) fn parse_ascii(cursor: Cursor) -> Result<MeshData, Problem> {
    parse(Source::ascii(cursor))
}

/// The content of a binary file, from the number one that gives the order of bytes.
pub(super) fn parse_binary(cursor: Cursor) -> Result<MeshData, Problem> {
    parse(Source::binary(cursor)?)
}

/// Physical groups of each geometric entity (dimension, number).
type Entities = BTreeMap<(i64, i64), Vec<i64>>;

fn parse(mut source: Source) -> Result<MeshData, Problem> {
    let mut mesh = Builder::default();
    let mut entities = Entities::new();
    while source.cursor.peek().is_some() {
        let section = source.cursor.word("a section")?;
        source.cursor.section = shown(section);
        if source.cursor.binary && section != b"$PhysicalNames" {
            source.cursor.rest_of_line(); // numbers begin on the next line
        }
        match section {
            b"$PhysicalNames" => mesh.physical_names(&mut source.cursor)?,
            b"$Entities" => {
                entities = read_entities(&mut source)?;
                source.cursor.expect("$EndEntities")?;
            }
            b"$Nodes" => {
                nodes(&mut source, &mut mesh)?;
                source.cursor.expect("$EndNodes")?;
            }
            b"$Elements" => {
                mesh.begin_elements();
                elements(&mut source, &mut mesh, &entities)?;
                source.cursor.expect("$EndElements")?;
            }
            _ => skip_section(&mut source.cursor, section)?,
        }
    }
    mesh.finish(&source.cursor)
}

/// numPoints numCurves numSurfaces numVolumes, then for each its number, its place (points) or box (others), its physical
/// groups and (not for points) its boundary.
fn read_entities(source: &mut Source) -> Result<Entities, Problem> {
    let mut entities = Entities::new();
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = source.count("a number of entities", 8)?;
    }
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let tag = source.int("an entity")?;
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                source.real("a bound of an entity")?;
            }
            let mut groups = Vec::new();
            for _ in 0..source.count("a number of physical groups", 2)? {
                groups.push(source.int("a physical group")?.abs());
            }
            if dimension > 0 {
                for _ in 0..source.count("a number of bounding entities", 2)? {
                    source.int("a bounding entity")?;
                }
            }
            entities.insert((dimension as i64, tag), groups);
        }
    }
    Ok(entities)
}

/// numEntityBlocks numNodes minTag maxTag, then blocks: entityDim entityTag parametric numNodes, all numbers, all places.
fn nodes(source: &mut Source, mesh: &mut Builder) -> Result<(), Problem> {
    let blocks = source.count("the number of node blocks", 8)?;
    let total = source.count("the number of nodes", 8)?;
    source.size("the smallest node number")?;
    source.size("the largest node number")?;
    for _ in 0..blocks {
        let dimension = source.int("a dimension")?;
        source.int("an entity")?;
        let extra = match source.int("the mark of parametric nodes")? {
            0 => 0,
            1 => dimension.clamp(0, 3),
            mark => {
                return Err(source
                    .cursor
                    .problem(format!("the mark of parametric nodes is {mark}, not 0 or 1")));
            }
        };
        let count = source.count("the number of nodes in a block", 8)?;
        let mut tags = Vec::with_capacity(count);
        for _ in 0..count {
            tags.push(source.size("a node number")?);
        }
        for tag in tags {
            let point = Point::new(source.real("x")?, source.real("y")?, source.real("z")?);
            for _ in 0..extra {
                source.real("a parametric coordinate")?;
            }
            mesh.node(&source.cursor, tag, point)?;
        }
    }
    if mesh.num_nodes() != total {
        let read = mesh.num_nodes();
        return Err(source
            .cursor
            .problem(format!("the blocks hold {read} nodes where {total} are announced")));
    }
    Ok(())
}

/// numEntityBlocks numElements minTag maxTag, then blocks: entityDim entityTag type numElements, then number and nodes of
/// each.
fn elements(source: &mut Source, mesh: &mut Builder, entities: &Entities) -> Result<(), Problem> {
    let blocks = source.count("the number of element blocks", 8)?;
    let total = source.count("the number of elements", 4)?;
    source.size("the smallest element number")?;
    source.size("the largest element number")?;
    let mut read = 0;
    for _ in 0..blocks {
        let dimension = source.int("a dimension")?;
        let entity = source.int("an entity")?;
        let kind = source.int("an element type")?;
        let kind = ElementKind::new(&source.cursor, kind)?;
        let groups = entities.get(&(dimension, entity)).map_or(&[][..], Vec::as_slice);
        let count = source.count("the number of elements in a block", 4)?;
        for _ in 0..count {
            source.size("an element number")?;
            let mut nodes = [0; 4];
            for node in &mut nodes[..kind.num_nodes()] {
                *node = source.size("a node number")?;
            }
            mesh.element(&source.cursor, kind, &nodes[..kind.num_nodes()], groups)?;
        }
        read += count;
    }
    if read != total {
        return Err(source
            .cursor
            .problem(format!("the blocks hold {read} elements where {total} are announced")));
    }
    Ok(())
}
