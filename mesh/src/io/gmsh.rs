//! gmsh `.msh`: which version, and what all versions share.

use std::collections::{BTreeMap, HashMap};

use crate::Point;

use super::data::{Group, MeshData};
use super::error::Problem;
use super::text::{Cursor, shown};
use super::{gmsh_legacy, gmsh4};

/// Versions that are read, for messages.
const ACCEPTED: &str = "gmsh 1 ($NOD), 2 and 4.1 (ASCII, binary) are accepted";

/// The content of a `.msh` file of any version that is read.
pub(super) fn parse(bytes: &[u8]) -> Result<MeshData, Problem> {
    let mut cursor = Cursor::new(bytes);
    match cursor.peek() {
        Some(b"$NOD") => gmsh_legacy::parse_version_1(cursor),
        Some(b"$MeshFormat") => {
            cursor.word("$MeshFormat")?;
            cursor.section = "$MeshFormat".into();
            let version = cursor.word("the version")?;
            let kind = cursor.integer("the file type")?;
            let size = cursor.integer("the data size")?;
            match (version, kind) {
                (b"2" | b"2.0" | b"2.1" | b"2.2", 0) => {
                    cursor.expect("$EndMeshFormat")?;
                    gmsh_legacy::parse_version_2(cursor)
                }
                (b"2" | b"2.0" | b"2.1" | b"2.2", 1) if size == 8 => gmsh_legacy::parse_version_2_binary(cursor),
                (b"4.1", 0) => {
                    cursor.expect("$EndMeshFormat")?;
                    gmsh4::parse_ascii(cursor)
                }
                (b"4.1", 1) if size == 8 => gmsh4::parse_binary(cursor),
                _ => Err(cursor.problem(format!(
                    "version {}, file type {kind}, data size {size}; {ACCEPTED}",
                    shown(version)
                ))),
            }
        }
        Some(word) => Err(cursor.problem(format!(
            "begins with '{}', not $NOD or $MeshFormat; {ACCEPTED}",
            shown(word)
        ))),
        None => Err(cursor.problem(format!("the file is empty; {ACCEPTED}"))),
    }
}

/// A physical group: dimension and number.
pub(super) type GroupTag = (i64, i64);

/// A mesh while its file is read.
#[derive(Default)]
pub(super) struct Builder {
    data: MeshData,
    index_of_node: HashMap<u64, usize>,
    groups: BTreeMap<GroupTag, Group>,
    names: BTreeMap<GroupTag, String>,
    has_elements: bool,
    last: Option<(ElementKind, [usize; 4])>,
}

impl Builder {
    /// Takes in a node under its number in the file.
    pub(super) fn node(&mut self, cursor: &Cursor, tag: u64, point: Point) -> Result<(), Problem> {
        if !point.iter().all(|c| c.is_finite()) {
            return Err(cursor.problem(format!("node {tag} has a coordinate that is not a finite number")));
        }
        if self.index_of_node.insert(tag, self.data.points.len()).is_some() {
            return Err(cursor.problem(format!("node {tag} occurs twice; node numbers must differ")));
        }
        self.data.points.push(point);
        Ok(())
    }

    /// How many nodes there are.
    pub(super) fn num_nodes(&self) -> usize {
        self.data.points.len()
    }

    /// Says that the file has a section of elements, be it empty.
    pub(super) fn begin_elements(&mut self) {
        self.has_elements = true;
    }

    /// Takes in an element; `groups` are the numbers of its physical groups, zero for none.
    pub(super) fn element(
        &mut self,
        cursor: &Cursor,
        kind: ElementKind,
        nodes: &[u64],
        groups: &[i64],
    ) -> Result<(), Problem> {
        let mut corners = [0; 4];
        for (corner, tag) in corners.iter_mut().zip(nodes) {
            *corner = *self
                .index_of_node
                .get(tag)
                .ok_or_else(|| cursor.problem(format!("an element names node {tag}, which does not exist")))?;
        }
        let count = match kind {
            ElementKind::Tet => self.data.tets.len(),
            ElementKind::Triangle => self.data.triangles.len(),
            ElementKind::Line => self.data.segments.len(),
            ElementKind::Point => 0,
        };
        let again = self.is_again(kind, corners, count, groups);
        let index = count - usize::from(again);
        for &tag in groups.iter().filter(|&&tag| tag != 0) {
            let group = self.groups.entry((kind.dimension(), tag)).or_default();
            group.vertices.extend(&corners[..nodes.len().min(4)]);
            if let Some(members) = members(group, kind) {
                members.push(index);
            }
        }
        if again {
            return Ok(());
        }
        self.last = Some((kind, corners));
        let [a, b, c, _] = corners;
        match kind {
            ElementKind::Tet => self.data.tets.push(corners),
            ElementKind::Triangle => self.data.triangles.push([a, b, c]),
            ElementKind::Line => self.data.segments.push([a, b]),
            ElementKind::Point => {}
        }
        Ok(())
    }

    /// Whether an element is the last one, of `count`, in a further group: versions 1 and 2 write it once for each group.
    fn is_again(&mut self, kind: ElementKind, corners: [usize; 4], count: usize, groups: &[i64]) -> bool {
        let mut holds_it = |tag: &i64| match self.groups.get_mut(&(kind.dimension(), *tag)) {
            Some(group) => members(group, kind).is_some_and(|m| m.last() == Some(&(count - 1))),
            None => false,
        };
        let repeats = count > 0 && self.last == Some((kind, corners));
        repeats && !groups.is_empty() && groups.iter().all(|tag| *tag != 0 && !holds_it(tag))
    }

    /// Reads the names of physical groups: the same section in versions 2 and 4.
    pub(super) fn physical_names(&mut self, cursor: &mut Cursor) -> Result<(), Problem> {
        for _ in 0..cursor.count("the number of names", 6)? {
            let dimension = cursor.integer("a dimension")?;
            let tag = cursor.integer("a physical group")?;
            let name = cursor.rest_of_line();
            let name = String::from_utf8_lossy(name.strip_prefix(b"\"").unwrap_or(name)).into_owned();
            let name = name.strip_suffix('"').unwrap_or(&name).to_string();
            self.names.insert((dimension, tag), name);
        }
        cursor.expect("$EndPhysicalNames")
    }

    /// The mesh; groups of the same name become one.
    pub(super) fn finish(mut self, cursor: &Cursor) -> Result<MeshData, Problem> {
        if !self.has_elements {
            return Err(cursor.problem("the file ends before its section of elements"));
        }
        for (tag, group) in self.groups {
            let name = self.names.get(&tag).cloned().unwrap_or_else(|| tag.1.to_string());
            let all = self.data.groups.entry(name).or_default();
            all.vertices.extend(group.vertices);
            all.tets.extend(group.tets);
            all.triangles.extend(group.triangles);
            all.segments.extend(group.segments);
        }
        self.data.sort_groups();
        Ok(self.data)
    }
}

/// Those of a group that are of one kind; points are not kept.
fn members(group: &mut Group, kind: ElementKind) -> Option<&mut Vec<usize>> {
    match kind {
        ElementKind::Tet => Some(&mut group.tets),
        ElementKind::Triangle => Some(&mut group.triangles),
        ElementKind::Line => Some(&mut group.segments),
        ElementKind::Point => None,
    }
}

/// The elements that are read; lines and points only serve groups.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ElementKind {
    Point,
    Line,
    Triangle,
    Tet,
}

impl ElementKind {
    /// The element with gmsh's number `kind`.
    pub(super) fn new(cursor: &Cursor, kind: i64) -> Result<Self, Problem> {
        let name = match kind {
            15 => return Ok(ElementKind::Point),
            1 => return Ok(ElementKind::Line),
            2 => return Ok(ElementKind::Triangle),
            4 => return Ok(ElementKind::Tet),
            3 => "quadrangle",
            5 => "hexahedron",
            6 => "prism",
            7 => "pyramid",
            8 => "line of order 2",
            9 => "triangle of order 2",
            11 => "tetrahedron of order 2",
            _ => "element of another kind",
        };
        Err(cursor.problem(format!(
            "a {name} (gmsh element type {kind}); tetrahedra and triangles of order 1 are accepted, and lines and points \
             beside them"
        )))
    }

    /// How many nodes it has.
    pub(super) fn num_nodes(self) -> usize {
        match self {
            ElementKind::Point => 1,
            ElementKind::Line => 2,
            ElementKind::Triangle => 3,
            ElementKind::Tet => 4,
        }
    }

    fn dimension(self) -> i64 {
        self.num_nodes() as i64 - 1
    }
}
