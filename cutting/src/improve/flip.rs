//! The sheet passes a cell on its other side: the cell comes to belong to the other part.
//!
//! ```text
//!        v                 v
//!      // \\             /   \
//!     a --- b    ->     a === b
//! ```
//!
//! Where a sweep runs along an edge, the cells around that may be found to lie on this side and that by turns. Each would be a
//! flap when the sheet has opened, and as leaves of the sheet meet there, nothing can be done about its shape before.

use kerfem_mesh::{CellId, FacetKey};

use super::Limits;
use super::hold::{keeps_sheet, places};
use crate::workspace::{Workspace, facet_of};

/// Exchanges the three facets of the sheet that a cell has for the fourth, if it has three and the sheet stays as near to the
/// sweep as is wanted. Each edge of the cell is then in as many facets of the sheet as before or in two less, so that the sheet
/// ends where it did.
pub(super) fn flip<const N: usize>(ws: &mut Workspace<'_, N>, limits: &Limits<'_>, c: CellId) {
    let corners = ws.mesh().cell(c);
    let is_sheet = |k: &usize| ws.sheet.contains(&facet_of(&corners, *k));
    let (own, others): (Vec<usize>, Vec<usize>) = (0..N).partition(is_sheet);
    let (3, [other], false) = (own.len(), &others[..], limits.is_fixed) else {
        return;
    };
    if ws.mesh().neighbors(c)[*other].some().is_none() {
        return;
    }
    let old: Vec<FacetKey> = own.iter().map(|k| facet_of(&corners, *k)).collect();
    let new = [facet_of(&corners, *other)];
    let size = ws.mesh().local_size(corners[*other]);
    if keeps_sheet(limits, &places(ws, &old, None), &places(ws, &new, None), size) {
        ws.exchange_sheet(&old, &new);
    }
}
