//! Sparse Cholesky factorisation (faer) on the free dofs of a block matrix.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use crate::{BlockMatrix, FemError};

/// A pivot below this fraction of its diagonal entry is round-off: the matrix is singular.
const LEAST_PIVOT: f64 = 1e-12;

/// `L L^T = A` on the free dofs. The ordering (approximate minimum degree on vertices) and the pattern of `L` are found
/// once per pattern and set of fixed dofs; values are refilled by a map.
pub(crate) struct Cholesky {
    stamp: u64,
    fixed: Vec<bool>,
    /// Dofs by number of the unknown.
    free: Vec<usize>,
    /// Lower triangle of the matrix of unknowns, by columns.
    col_starts: Vec<usize>,
    row_indices: Vec<usize>,
    values: Vec<f64>,
    /// Entry of the block values that each value comes from.
    sources: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    rhs: Vec<f64>,
    buffer: MemBuffer,
}

impl std::fmt::Debug for Cholesky {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Cholesky")
            .field("unknowns", &self.free.len())
            .field("factor", &self.factor.len())
            .finish()
    }
}

impl Cholesky {
    /// Analyses the pattern of a matrix.
    ///
    /// # Errors
    /// [`FemError::OutOfMemory`].
    pub(crate) fn analyse(a: &BlockMatrix, fixed: &[bool]) -> Result<Self, FemError> {
        let free: Vec<usize> = (0..fixed.len()).filter(|&d| !fixed[d]).collect();
        let mut number = vec![usize::MAX; fixed.len()];
        free.iter().enumerate().for_each(|(k, &d)| number[d] = k);

        let (mut col_starts, mut row_indices, mut sources) = (vec![0], Vec::new(), Vec::new());
        for &d in &free {
            // row d right of the diagonal = column d below it
            let (i, r) = (d / 3, d % 3);
            for (k, &j) in a.pattern.range(i).zip(a.pattern.cols(i)) {
                for c in 0..3 {
                    let other = 3 * j as usize + c;
                    if other >= d && !fixed[other] {
                        row_indices.push(number[other]);
                        sources.push(9 * k + 3 * r + c);
                    }
                }
            }
            col_starts.push(row_indices.len());
        }
        let n = free.len();
        let out_of_memory = FemError::OutOfMemory { dofs: n };
        let (forward, backward) = ordering(a, fixed, &number, n).ok_or(out_of_memory.clone())?;
        let symbolic = factorize_symbolic_cholesky(
            SymbolicSparseColMatRef::new_checked(n, n, &col_starts, None, &row_indices),
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(&forward, &backward, n)),
            CholeskySymbolicParams::default(),
        )
        .map_err(|_| out_of_memory)?;
        let need = StackReq::any_of(&[
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]);
        Ok(Cholesky {
            stamp: a.pattern.stamp(),
            fixed: fixed.to_vec(),
            values: vec![0.0; row_indices.len()],
            factor: vec![0.0; symbolic.len_val()],
            rhs: vec![0.0; n],
            buffer: MemBuffer::try_new(need).map_err(|_| FemError::OutOfMemory { dofs: n })?,
            free,
            col_starts,
            row_indices,
            sources,
            symbolic,
        })
    }

    /// Whether the analysis is of this pattern and these fixed dofs.
    pub(crate) fn fits(&self, a: &BlockMatrix, fixed: &[bool]) -> bool {
        self.stamp == a.pattern.stamp() && self.fixed == fixed
    }

    /// Factors the values of a matrix that [`Self::fits`].
    ///
    /// # Errors
    /// [`FemError::NotPositiveDefinite`], also if a pivot is no more than round-off.
    pub(crate) fn factor(&mut self, a: &BlockMatrix) -> Result<(), FemError> {
        let entries = a.values.as_flattened();
        self.values
            .iter_mut()
            .zip(&self.sources)
            .for_each(|(v, &s)| *v = entries[s]);
        let n = self.free.len();
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.col_starts, None, &self.row_indices);
        let exists = self.symbolic.factorize_numeric_llt(
            &mut self.factor,
            SparseColMatRef::new(pattern, &self.values),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut self.buffer),
            Default::default(),
        );
        match exists.is_ok() && self.pivots_are_safe() {
            true => Ok(()),
            false => Err(FemError::NotPositiveDefinite {
                found_by: "Cholesky factorisation",
            }),
        }
    }

    fn pivots_are_safe(&self) -> bool {
        let order = self.symbolic.perm().map(|p| p.arrays().0);
        let safe = |place: usize, root: f64| {
            let column = order.map_or(place, |o| o[place]);
            // the diagonal comes first in each column
            root * root > LEAST_PIVOT * self.values[self.col_starts[column]]
        };
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(s) => {
                let starts = s.col_ptr();
                (0..self.free.len()).all(|k| safe(k, self.factor[starts[k]]))
            }
            SymbolicCholeskyRaw::Supernodal(s) => {
                let factor = SupernodalLltRef::new(s, &self.factor);
                (0..s.n_supernodes()).all(|k| {
                    let node = factor.supernode(k);
                    let block = node.val();
                    (0..block.ncols()).all(|j| safe(node.start() + j, block[(j, j)]))
                })
            }
        }
    }

    /// `x +=` solution for `b` at free dofs; others stay.
    pub(crate) fn add_solution(&mut self, b: &[f64], x: &mut [f64]) {
        self.rhs.iter_mut().zip(&self.free).for_each(|(r, &d)| *r = b[d]);
        let n = self.free.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.rhs, n, 1),
            Par::Seq,
            MemStack::new(&mut self.buffer),
        );
        self.rhs.iter().zip(&self.free).for_each(|(r, &d)| x[d] += *r);
    }
}

/// A fill-reducing order of the unknowns, forward and backward: approximate minimum degree on the graph of vertices, the
/// free axes of a vertex together. `None` if memory runs out.
fn ordering(a: &BlockMatrix, fixed: &[bool], number: &[usize], n: usize) -> Option<(Vec<usize>, Vec<usize>)> {
    let mut vertex_number = vec![usize::MAX; a.rows()];
    let vertices: Vec<usize> = (0..a.rows())
        .filter(|&i| !fixed[3 * i..3 * i + 3].iter().all(|&f| f))
        .collect();
    vertices.iter().enumerate().for_each(|(k, &i)| vertex_number[i] = k);
    let (mut starts, mut rows) = (vec![0], Vec::new());
    for &i in &vertices {
        rows.extend(
            a.pattern
                .cols(i)
                .iter()
                .map(|&j| vertex_number[j as usize])
                .filter(|&k| k != usize::MAX),
        );
        starts.push(rows.len());
    }
    let m = vertices.len();
    let graph = SymbolicSparseColMatRef::new_checked(m, m, &starts, None, &rows);
    let mut buffer = MemBuffer::try_new(amd::order_scratch::<usize>(m, rows.len())).ok()?;
    let (mut order, mut inverse) = (vec![0; m], vec![0; m]);
    amd::order(
        &mut order,
        &mut inverse,
        graph,
        Default::default(),
        MemStack::new(&mut buffer),
    )
    .ok()?;

    let forward: Vec<usize> = order
        .iter()
        .map(|&k| vertices[k])
        .flat_map(|i| (0..3).map(move |c| 3 * i + c))
        .filter(|&d| !fixed[d])
        .map(|d| number[d])
        .collect();
    let mut backward = vec![0; n];
    forward.iter().enumerate().for_each(|(place, &k)| backward[k] = place);
    Some((forward, backward))
}
