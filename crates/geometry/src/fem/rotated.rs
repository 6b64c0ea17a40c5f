//! An element matrix in node-local (rotated) coordinates: `R_aᵀ K_ab R_b`, with the axes of a node's frame as the columns of
//! `R`; components after the third, such as `ψ`, are untouched.

use std::ops::Mul;

use crate::directions::Frame;
use crate::fem::{LocalMatrix, Scalar};

/// An element matrix in the local frames of its nodes; `None` stands for the coordinate axes.
#[derive(Clone, Debug)]
pub struct RotatedMatrix<'a, L, const N: usize> {
    matrix: L,
    frames: [Option<&'a Frame>; N],
}

impl<'a, L, const N: usize> RotatedMatrix<'a, L, N> {
    /// The matrix, and the frames of its nodes.
    #[inline]
    pub fn new(matrix: L, frames: [Option<&'a Frame>; N]) -> Self {
        Self { matrix, frames }
    }
}

impl<T, L, const N: usize, const C: usize> LocalMatrix<T, N, C> for RotatedMatrix<'_, L, N>
where
    T: Scalar + Mul<f64, Output = T>,
    L: LocalMatrix<T, N, C>,
{
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[T; C]; C] {
        let mut block = self.matrix.block(a, b);
        if let Some(frame) = self.frames[a] {
            let rows = block;
            for k in 0..3 {
                block[k] = std::array::from_fn(|j| (0..3).map(|i| rows[i][j] * frame.axes[k][i]).sum());
            }
        }
        if let Some(frame) = self.frames[b] {
            for row in &mut block {
                let columns = *row;
                for k in 0..3 {
                    row[k] = (0..3).map(|j| columns[j] * frame.axes[k][j]).sum();
                }
            }
        }
        block
    }

    #[inline]
    fn scalars(&self) -> Option<[[f64; N]; N]> {
        if self.frames.iter().all(Option::is_none) { self.matrix.scalars() } else { None }
    }
}
