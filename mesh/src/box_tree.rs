//! A tree of bounding boxes over numbered items that follows edits.

use crate::{CellId, Point, SimplexMesh};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Point,
    /// Largest coordinates.
    pub max: Point,
}

impl Aabb {
    /// The box that contains nothing.
    pub fn empty() -> Self {
        Aabb {
            min: Point::repeat(f64::INFINITY),
            max: Point::repeat(f64::NEG_INFINITY),
        }
    }

    /// The smallest box around some points.
    pub fn around(points: impl IntoIterator<Item = Point>) -> Self {
        points.into_iter().fold(Aabb::empty(), |b, p| Aabb {
            min: b.min.inf(&p),
            max: b.max.sup(&p),
        })
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb {
            min: self.min.inf(&other.min),
            max: self.max.sup(&other.max),
        }
    }

    /// The box grown by `margin` on every side.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Aabb {
        Aabb {
            min: self.min - Point::repeat(margin),
            max: self.max + Point::repeat(margin),
        }
    }

    /// Whether the closed boxes share a point.
    #[inline]
    pub fn overlaps(&self, other: &Aabb) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    /// Squared distance from a point to the box, zero inside.
    #[inline]
    pub fn distance_squared(&self, p: &Point) -> f64 {
        (0..3)
            .map(|k| (self.min[k] - p[k]).max(p[k] - self.max[k]).max(0.0).powi(2))
            .sum()
    }

    /// The longest side.
    pub fn longest_side(&self) -> f64 {
        (self.max - self.min).max().max(0.0)
    }
}

const LEAF: usize = 8;
const NONE: u32 = u32::MAX;

#[derive(Clone, Debug)]
struct Node {
    aabb: Aabb,
    parent: u32,
    /// Children of an inner node; both `NONE` for a leaf.
    children: [u32; 2],
    items: Vec<u32>,
}

/// How many nodes a query or an update looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TouchedNodes(pub usize);

/// A binary tree of boxes. Items are numbers below `u32::MAX`; the caller keeps their boxes.
///
/// Building costs `O(n log n)`; a query or an update costs the depth times what it finds. After many edits in one place
/// the depth there grows; results do not depend on it.
#[derive(Clone, Debug)]
pub struct BoxTree {
    nodes: Vec<Node>,
    leaf_of: Vec<u32>,
}

impl BoxTree {
    /// Builds the tree over items and their boxes.
    pub fn build(boxes: impl IntoIterator<Item = (u32, Aabb)>) -> Self {
        let mut items: Vec<(u32, Aabb)> = boxes.into_iter().collect();
        let slots = items.iter().map(|(i, _)| *i as usize + 1).max().unwrap_or(0);
        let mut tree = BoxTree {
            nodes: Vec::new(),
            leaf_of: vec![NONE; slots],
        };
        tree.build_node(&mut items, NONE);
        tree
    }

    /// The tree over the cells of a mesh, by cell number, at `positions` (one for each vertex slot).
    pub fn of_cells<const N: usize>(mesh: &SimplexMesh<N>, positions: &[Point]) -> Self {
        let around = |c: CellId| Aabb::around(mesh.cell(c).map(|v| positions[v.index()]));
        BoxTree::build(mesh.cell_ids().map(|c| (c.0, around(c))))
    }

    fn build_node(&mut self, items: &mut [(u32, Aabb)], parent: u32) -> u32 {
        let id = self.nodes.len() as u32;
        let aabb = items.iter().fold(Aabb::empty(), |b, (_, a)| b.union(a));
        self.nodes.push(Node {
            aabb,
            parent,
            children: [NONE; 2],
            items: Vec::new(),
        });
        if items.len() <= LEAF {
            for (i, _) in items.iter() {
                self.leaf_of[*i as usize] = id;
            }
            self.nodes[id as usize].items = items.iter().map(|(i, _)| *i).collect();
        } else {
            let centers = Aabb::around(items.iter().map(|(_, a)| a.min + a.max));
            let axis = (centers.max - centers.min).imax();
            let half = items.len() / 2;
            items.select_nth_unstable_by(half, |(i, a), (j, b)| {
                (a.min[axis] + a.max[axis])
                    .total_cmp(&(b.min[axis] + b.max[axis]))
                    .then(i.cmp(j))
            });
            let (left, right) = items.split_at_mut(half);
            let children = [self.build_node(left, id), self.build_node(right, id)];
            self.nodes[id as usize].children = children;
        }
        id
    }

    /// Calls `found` with every item whose leaf box overlaps `query` (a superset of the items whose own box does).
    pub fn query(&self, query: &Aabb, found: impl FnMut(u32)) -> TouchedNodes {
        self.visit(|b| b.overlaps(query), found)
    }

    /// Calls `found` with every item below a leaf that `reaches` lets pass, as do all boxes above it. `reaches` must hold
    /// for a box whenever it holds for a box inside it.
    pub fn visit(&self, mut reaches: impl FnMut(&Aabb) -> bool, mut found: impl FnMut(u32)) -> TouchedNodes {
        let mut touched = 0;
        let mut stack = vec![0u32];
        while let Some(id) = stack.pop() {
            touched += 1;
            let node = &self.nodes[id as usize];
            if !reaches(&node.aabb) {
                continue;
            }
            if node.children[0] == NONE {
                node.items.iter().for_each(|&i| found(i));
            } else {
                stack.extend(node.children);
            }
        }
        TouchedNodes(touched)
    }

    /// The item nearest to a point by `distance_squared` of the caller, and that distance; ties go to the smaller item.
    pub fn nearest(&self, p: &Point, mut distance_squared: impl FnMut(u32) -> f64) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let mut stack = vec![(0u32, self.nodes[0].aabb.distance_squared(p))];
        while let Some((id, bound)) = stack.pop() {
            if best.is_some_and(|(_, d)| bound > d) {
                continue;
            }
            let node = &self.nodes[id as usize];
            if node.children[0] == NONE {
                for &i in &node.items {
                    let d = distance_squared(i);
                    if best.is_none_or(|(j, b)| d < b || (d == b && i < j)) {
                        best = Some((i, d));
                    }
                }
            } else {
                let mut next = node
                    .children
                    .map(|c| (c, self.nodes[c as usize].aabb.distance_squared(p)));
                next.sort_by(|a, b| b.1.total_cmp(&a.1));
                stack.extend(next);
            }
        }
        best
    }

    /// Removes an item; boxes above it shrink.
    pub fn remove(&mut self, item: u32, boxes: impl Fn(u32) -> Aabb) -> TouchedNodes {
        let leaf = std::mem::replace(&mut self.leaf_of[item as usize], NONE);
        if leaf == NONE {
            return TouchedNodes(0);
        }
        self.nodes[leaf as usize].items.retain(|&i| i != item);
        self.refit_up(leaf, &boxes)
    }

    /// Adds an item into the leaf of a present item `beside` (before that one is removed), or from the root down.
    pub fn insert(&mut self, item: u32, beside: Option<u32>, boxes: impl Fn(u32) -> Aabb) -> TouchedNodes {
        if self.leaf_of.len() <= item as usize {
            self.leaf_of.resize(item as usize + 1, NONE);
        }
        let known = beside.map(|b| self.leaf_of[b as usize]).filter(|&l| l != NONE);
        let leaf = known.unwrap_or_else(|| self.descend(&boxes(item)));
        self.leaf_of[item as usize] = leaf;
        self.nodes[leaf as usize].items.push(item);
        let mut touched = 0;
        if self.nodes[leaf as usize].items.len() > 2 * LEAF {
            touched += self.split_leaf(leaf, &boxes);
        }
        TouchedNodes(touched + self.refit_up(leaf, &boxes).0)
    }

    /// Recomputes the boxes above an item whose own box changed.
    pub fn update(&mut self, item: u32, boxes: impl Fn(u32) -> Aabb) -> TouchedNodes {
        match self.leaf_of[item as usize] {
            NONE => TouchedNodes(0),
            leaf => self.refit_up(leaf, &boxes),
        }
    }

    /// Recomputes every box from those of the items (`O(n)`): after the whole body has moved.
    pub fn refit(&mut self, boxes: impl Fn(u32) -> Aabb) {
        // children have larger numbers than their parents
        for id in (0..self.nodes.len()).rev() {
            self.nodes[id].aabb = self.fit(id as u32, &boxes);
        }
    }

    fn fit(&self, id: u32, boxes: &impl Fn(u32) -> Aabb) -> Aabb {
        let node = &self.nodes[id as usize];
        if node.children[0] == NONE {
            node.items.iter().fold(Aabb::empty(), |b, &i| b.union(&boxes(i)))
        } else {
            self.nodes[node.children[0] as usize]
                .aabb
                .union(&self.nodes[node.children[1] as usize].aabb)
        }
    }

    fn refit_up(&mut self, from: u32, boxes: &impl Fn(u32) -> Aabb) -> TouchedNodes {
        let (mut id, mut touched) = (from, 0);
        while id != NONE {
            touched += 1;
            let fitted = self.fit(id, boxes);
            if id != from && fitted == self.nodes[id as usize].aabb {
                break;
            }
            self.nodes[id as usize].aabb = fitted;
            id = self.nodes[id as usize].parent;
        }
        TouchedNodes(touched)
    }

    fn descend(&self, aabb: &Aabb) -> u32 {
        let center = (aabb.min + aabb.max) / 2.0;
        let mut id = 0u32;
        while self.nodes[id as usize].children[0] != NONE {
            let [a, b] = self.nodes[id as usize].children;
            let d = |c: u32| self.nodes[c as usize].aabb.distance_squared(&center);
            id = if d(b) < d(a) { b } else { a };
        }
        id
    }

    fn split_leaf(&mut self, leaf: u32, boxes: &impl Fn(u32) -> Aabb) -> usize {
        let mut items: Vec<(u32, Aabb)> = std::mem::take(&mut self.nodes[leaf as usize].items)
            .into_iter()
            .map(|i| (i, boxes(i)))
            .collect();
        items.sort_by_key(|(i, _)| *i);
        let before = self.nodes.len();
        let half = items.len() / 2;
        let centers = Aabb::around(items.iter().map(|(_, a)| a.min + a.max));
        let axis = (centers.max - centers.min).imax();
        items.sort_by(|(i, a), (j, b)| {
            (a.min[axis] + a.max[axis])
                .total_cmp(&(b.min[axis] + b.max[axis]))
                .then(i.cmp(j))
        });
        let (left, right) = items.split_at_mut(half);
        let children = [self.build_node(left, leaf), self.build_node(right, leaf)];
        self.nodes[leaf as usize].children = children;
        self.nodes.len() - before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(n: u32) -> Vec<Aabb> {
        (0..n)
            .map(|i| {
                let p = Point::new((i % 7) as f64, (i % 11) as f64 * 1.5, (i % 5) as f64 * 0.7);
                Aabb {
                    min: p,
                    max: p + Point::new(0.9, 1.0, 0.8),
                }
            })
            .collect()
    }

    #[test]
    fn queries_find_what_a_scan_finds_before_and_after_edits() {
        let mut all = boxes(200);
        let mut tree = BoxTree::build(all.iter().enumerate().map(|(i, b)| (i as u32, *b)));
        let query = Aabb {
            min: Point::new(1.2, 2.0, 0.1),
            max: Point::new(3.4, 7.0, 1.0),
        };
        let check = |tree: &BoxTree, all: &[Aabb], gone: &[u32]| {
            let mut found = Vec::new();
            tree.query(&query, |i| found.push(i));
            found.retain(|&i| all[i as usize].overlaps(&query));
            found.sort();
            let scan: Vec<u32> = (0..all.len() as u32)
                .filter(|i| !gone.contains(i) && all[*i as usize].overlaps(&query))
                .collect();
            assert_eq!(found, scan);
        };
        check(&tree, &all, &[]);
        for k in 0..60u32 {
            let b = all[17];
            all.push(Aabb {
                min: b.min + Point::repeat(0.01 * k as f64),
                max: b.max,
            });
            let snapshot = all.clone();
            tree.insert(200 + k, Some(17), |i| snapshot[i as usize]);
        }
        check(&tree, &all, &[]);
        tree.remove(17, |i| all[i as usize]);
        check(&tree, &all, &[17]);
        for b in &mut all {
            b.min *= 0.5;
            b.max *= 0.5;
        }
        tree.refit(|i| all[i as usize]);
        check(&tree, &all, &[17]);
    }
}
