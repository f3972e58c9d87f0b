//! Pieces that nothing holds, in statics: found, judged, and held just enough to be solved for.

use kerfem_mesh::{Midpoints, SimplexMesh, VertexId};
use nalgebra::{DMatrix, DVector, Matrix6, SymmetricEigen, Vector3, Vector6};

/// Rigid motions whose mean square over the prescribed dofs is below this fraction of the largest are not held.
const HELD: f64 = 1e-10;
/// Loads balance if their work on a rigid motion is below this fraction of the sum of its absolute parts.
const BALANCED: f64 = 1e-9;

/// A piece of the body that can move rigidly without meeting a prescribed displacement.
#[derive(Clone, Debug)]
pub(crate) struct FreePiece {
    vertices: Vec<VertexId>,
    center: Vector3<f64>,
    length: f64,
    /// The motions: combinations of three translations and three rotations.
    motions: Vec<Vector6<f64>>,
    /// As many dofs as motions; holding them leaves exactly one state of equilibrium.
    pub(crate) held: Vec<usize>,
}

/// Displacement of a dof for a unit of each of the six rigid motions; rotations are scaled by a length.
fn row(arm: &Vector3<f64>, axis: usize) -> Vector6<f64> {
    let e = Vector3::ith(axis, 1.0);
    let turn = arm.cross(&e);
    Vector6::new(e.x, e.y, e.z, turn.x, turn.y, turn.z)
}

/// Every piece (connected through shared vertices) that the prescribed dofs leave free to move rigidly, provided that the
/// loads on it balance along its free motions.
///
/// # Errors
/// The first piece whose loads do not, in words.
pub(crate) fn free_pieces<const N: usize>(
    mesh: &SimplexMesh<N>,
    midpoints: Option<&Midpoints<N>>,
    fixed: &[bool],
    load: &[f64],
) -> Result<Vec<FreePiece>, String> {
    let pieces = pieces_by_vertices(mesh, midpoints);
    let mut free = Vec::new();
    for (number, vertices) in pieces.iter().enumerate() {
        let Some(piece) = FreePiece::new(mesh, vertices, fixed) else {
            continue;
        };
        if let Some(motion) = piece.unbalanced(mesh, fixed, load) {
            let (center, count) = (piece.center, pieces.len());
            return Err(format!(
                "piece {} of {count} ({} vertices around ({:.6}, {:.6}, {:.6})) is free to {motion}, and its loads do not \
                 balance; hold it with [[fixed]] or use a scheme with inertia",
                number + 1,
                vertices.len(),
                center.x,
                center.y,
                center.z
            ));
        }
        free.push(piece);
    }
    Ok(free)
}

/// Vertices of each piece of the mesh, connected through shared vertices, with those on its edges; in order of their smallest
/// vertex.
fn pieces_by_vertices<const N: usize>(mesh: &SimplexMesh<N>, midpoints: Option<&Midpoints<N>>) -> Vec<Vec<VertexId>> {
    let mut piece = vec![usize::MAX; mesh.vertex_slots()];
    let mut pieces = Vec::new();
    for start in mesh.vertex_ids().filter(|v| !mesh.cells_of_vertex(*v).is_empty()) {
        if piece[start.index()] != usize::MAX {
            continue;
        }
        let mut members = vec![start];
        piece[start.index()] = pieces.len();
        let mut next = 0;
        while let Some(&v) = members.get(next) {
            next += 1;
            for w in mesh.cells_of_vertex(v).iter().flat_map(|c| mesh.cell(*c)) {
                if piece[w.index()] == usize::MAX {
                    piece[w.index()] = pieces.len();
                    members.push(w);
                }
            }
        }
        pieces.push(members);
    }
    for (v, [end, _]) in midpoints.map(Midpoints::edges).unwrap_or_default() {
        pieces[piece[end.index()]].push(v);
    }
    pieces.iter_mut().for_each(|members| members.sort_unstable());
    pieces
}

impl FreePiece {
    fn new<const N: usize>(mesh: &SimplexMesh<N>, vertices: &[VertexId], fixed: &[bool]) -> Option<FreePiece> {
        let at = |v: &VertexId| mesh.rest_position(*v);
        let center = vertices.iter().map(at).sum::<Vector3<f64>>() / vertices.len() as f64;
        let length = vertices.iter().map(|v| (at(v) - center).norm()).fold(0.0, f64::max);
        let mut piece = FreePiece {
            vertices: vertices.to_vec(),
            center,
            length,
            motions: Vec::new(),
            held: Vec::new(),
        };
        let mut gram = Matrix6::zeros();
        for (_, row) in piece.rows(mesh).filter(|(d, _)| fixed[*d]) {
            gram += row * row.transpose();
        }
        let eigen = SymmetricEigen::new(gram);
        let threshold = HELD * eigen.eigenvalues.max();
        let loose = (0..6).filter(|&k| eigen.eigenvalues[k] <= threshold);
        piece.motions = loose.map(|k| eigen.eigenvectors.column(k).into_owned()).collect();
        if piece.motions.is_empty() {
            return None;
        }
        piece.held = piece.choose_dofs(mesh, fixed);
        Some(piece)
    }

    /// The rigid motions that are free, as displacements of all of so many dofs; rotations as displacements of small ones.
    pub(crate) fn motion_fields<'a, const N: usize>(
        &'a self,
        mesh: &'a SimplexMesh<N>,
        dofs: usize,
    ) -> impl Iterator<Item = Vec<f64>> + 'a {
        self.motions.iter().map(move |q| {
            let mut field = vec![0.0; dofs];
            self.rows(mesh).for_each(|(dof, row)| field[dof] = q.dot(&row));
            field
        })
    }

    fn rows<'a, const N: usize>(
        &'a self,
        mesh: &'a SimplexMesh<N>,
    ) -> impl Iterator<Item = (usize, Vector6<f64>)> + 'a {
        self.vertices.iter().flat_map(move |v| {
            let arm = (mesh.rest_position(*v) - self.center) / self.length;
            (0..3).map(move |axis| (3 * v.index() + axis, row(&arm, axis)))
        })
    }

    /// One dof for each motion: each time the one that the motions left move most.
    fn choose_dofs<const N: usize>(&self, mesh: &SimplexMesh<N>, fixed: &[bool]) -> Vec<usize> {
        let mut left = self.motions.clone();
        let mut chosen = Vec::new();
        while !left.is_empty() {
            let moved = |row: &Vector6<f64>| DVector::from_iterator(left.len(), left.iter().map(|q| q.dot(row)));
            let mut best = (0, 0.0, DVector::zeros(left.len()));
            for (dof, row) in self.rows(mesh).filter(|(d, _)| !fixed[*d]) {
                let amount = moved(&row);
                let size = amount.norm();
                if size > best.1 * (1.0 + 1e-9) {
                    best = (dof, size, amount);
                }
            }
            let (dof, size, amount) = best;
            if size <= 0.0 {
                break;
            }
            chosen.push(dof);
            left = without(&left, &(amount / size));
        }
        chosen
    }

    /// The motion along which the loads do work, in words.
    fn unbalanced<const N: usize>(&self, mesh: &SimplexMesh<N>, fixed: &[bool], load: &[f64]) -> Option<String> {
        let free = || self.rows(mesh).filter(|(d, _)| !fixed[*d]);
        // the loads' work on each of the six motions; what is not held is judged
        let mut worst = Vector6::zeros();
        for q in &self.motions {
            let (mut work, mut parts) = (0.0, 0.0);
            for (dof, row) in free() {
                let part = load[dof] * row.dot(q);
                work += part;
                parts += load[dof].abs() * row.norm();
            }
            if work.abs() > BALANCED * parts {
                worst += q * work;
            }
        }
        (worst != Vector6::zeros()).then(|| {
            let k = worst.iamax();
            let axis = ["x", "y", "z"][k % 3];
            if k < 3 {
                format!("move along {axis}")
            } else {
                format!("turn about {axis}")
            }
        })
    }

    /// Takes the rigid motions out of `u`, so that among all solutions the one with none of them (in the lumped mass) is
    /// left; for small rotations.
    pub(crate) fn remove_motions<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        fixed: &[bool],
        masses: &[f64],
        u: &mut [f64],
    ) {
        let n = self.motions.len();
        let mut gram = DMatrix::zeros(n, n);
        let mut right = DVector::zeros(n);
        for (dof, row) in self.rows(mesh) {
            let values = DVector::from_iterator(n, self.motions.iter().map(|q| q.dot(&row)));
            gram += masses[dof / 3] * &values * values.transpose();
            right += masses[dof / 3] * u[dof] * values;
        }
        let Some(cholesky) = gram.cholesky() else { return };
        let amounts = cholesky.solve(&right);
        for (dof, row) in self.rows(mesh).filter(|(d, _)| !fixed[*d]) {
            u[dof] -= self
                .motions
                .iter()
                .zip(amounts.iter())
                .map(|(q, a)| a * q.dot(&row))
                .sum::<f64>();
        }
    }
}

/// A basis of the combinations of `motions` that are orthogonal to the combination `direction` (a unit vector): the
/// columns but the first of the reflection that takes the first axis to it.
fn without(motions: &[Vector6<f64>], direction: &DVector<f64>) -> Vec<Vector6<f64>> {
    let n = motions.len();
    let mut normal = direction.clone();
    normal[0] += if direction[0] < 0.0 { -1.0 } else { 1.0 };
    let factor = 2.0 / normal.norm_squared();
    let entry = |i: usize, k: usize| f64::from(u8::from(i == k)) - factor * normal[i] * normal[k];
    (1..n).map(|k| (0..n).map(|i| motions[i] * entry(i, k)).sum()).collect()
}
