//! Isotropic linear elastic material.

use kerfem_mesh::{Point, quality::cell_volume};

use crate::FemError;

/// What a planar body does along z.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Plane {
    /// No strain along z: a slice of a long body.
    #[default]
    Strain,
    /// No stress along z: a thin sheet.
    Stress,
}

/// Young's modulus, Poisson's ratio and density of an isotropic material; for planar bodies also what happens along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    young: f64,
    poisson: f64,
    density: f64,
    plane: Plane,
    thickness: f64,
}

impl Material {
    /// What slots that never held a cell contain.
    pub(crate) const UNUSED: Material = Material {
        young: 1.0,
        poisson: 0.0,
        density: 1.0,
        plane: Plane::Strain,
        thickness: 1.0,
    };

    /// A material from `young` (Pa, > 0), `poisson` (-1 < poisson < 0.5) and `density` (kg/m³, > 0), all finite.
    ///
    /// # Errors
    /// Names the first number out of range and what is accepted.
    pub fn new(young: f64, poisson: f64, density: f64) -> Result<Self, FemError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        if !positive(young) {
            return Err(FemError::Young(young));
        }
        if !(poisson > -1.0 && poisson < 0.5) {
            return Err(FemError::Poisson(poisson));
        }
        if !positive(density) {
            return Err(FemError::Density(density));
        }
        Ok(Material {
            young,
            poisson,
            density,
            plane: Plane::Strain,
            thickness: 1.0,
        })
    }

    /// The same material in a planar body of the given `thickness` (m, > 0, finite) along z; without this, plane strain of a
    /// slice one metre thick. Tetrahedra take no notice.
    ///
    /// # Errors
    /// [`FemError::Thickness`].
    pub fn in_plane(self, plane: Plane, thickness: f64) -> Result<Self, FemError> {
        match thickness.is_finite() && thickness > 0.0 {
            true => Ok(Material {
                plane,
                thickness,
                ..self
            }),
            false => Err(FemError::Thickness(thickness)),
        }
    }

    /// Young's modulus (Pa).
    #[inline]
    pub fn young(&self) -> f64 {
        self.young
    }

    /// Poisson's ratio.
    #[inline]
    pub fn poisson(&self) -> f64 {
        self.poisson
    }

    /// Density at rest (kg/m³).
    #[inline]
    pub fn density(&self) -> f64 {
        self.density
    }

    /// What a planar body does along z.
    #[inline]
    pub fn plane(&self) -> Plane {
        self.plane
    }

    /// Thickness of a planar body (m).
    #[inline]
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Signed rest volume (m³) of a cell of this material with corners at `p` (m): of a triangle its area in the plane
    /// times the thickness.
    #[inline]
    pub fn volume_of_cell<const N: usize>(&self, p: &[Point; N]) -> f64 {
        if N == 3 {
            cell_volume(p) * self.thickness
        } else {
            cell_volume(p)
        }
    }

    /// First Lamé parameter `E nu / ((1 + nu) (1 - 2 nu))` (Pa); negative for a negative Poisson's ratio.
    #[inline]
    pub fn lambda(&self) -> f64 {
        self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))
    }

    /// The law of a cell, see [`Lame`].
    #[inline]
    pub(crate) fn lame<const N: usize>(&self) -> Lame {
        Lame {
            lambda: self.lambda_of_cell::<N>(),
            mu: self.mu(),
        }
    }

    /// The factor of `tr(e) I` in the stress of a cell (Pa), where a triangle has the trace in the plane:
    /// [`Self::lambda`], except in plane stress `2 lambda mu / (lambda + 2 mu)`, that is `E nu / (1 - nu²)`.
    #[inline]
    fn lambda_of_cell<const N: usize>(&self) -> f64 {
        if N == 3 && self.plane == Plane::Stress {
            self.young * self.poisson / (1.0 - self.poisson * self.poisson)
        } else {
            self.lambda()
        }
    }

    /// Second Lamé parameter, the shear modulus `E / (2 (1 + nu))` (Pa).
    #[inline]
    pub fn mu(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }
}

/// The two numbers of an isotropic law, stress `2 mu e + lambda tr(e) I` with the trace in the plane for a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Lame {
    /// First Lamé parameter (Pa), see [`Material::lambda_of_cell`].
    pub(crate) lambda: f64,
    /// Second Lamé parameter (Pa).
    pub(crate) mu: f64,
}

impl Lame {
    /// Both numbers times a factor.
    #[inline]
    pub(crate) fn times(&self, factor: f64) -> Lame {
        Lame {
            lambda: self.lambda * factor,
            mu: self.mu * factor,
        }
    }

    /// Stress of the linear model, `mu (H + H^T) + lambda tr(H) I` (Pa), row-major.
    #[inline]
    pub(crate) fn linear_stress(&self, h: &[f64; 9]) -> [f64; 9] {
        let pressure = self.lambda * (h[0] + h[4] + h[8]);
        let mut p = [0.0; 9];
        for i in 0..3 {
            for j in 0..3 {
                p[3 * i + j] = self.mu * (h[3 * i + j] + h[3 * j + i]);
            }
            p[4 * i] += pressure;
        }
        p
    }

    /// Energy of the linear model over a `volume` (m³), `V (mu e:e + lambda/2 tr^2 e)` with `e = sym H` (J).
    #[inline]
    pub(crate) fn linear_energy(&self, volume: f64, h: &[f64; 9]) -> f64 {
        let p = self.linear_stress(h);
        0.5 * volume * p.iter().zip(h).map(|(p, h)| p * h).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lame_parameters_of_steel() {
        let m = Material::new(210e9, 0.3, 7850.0).unwrap();
        assert!((m.mu() - 80.769_230_769e9).abs() < 1.0);
        assert!((m.lambda() - 121.153_846_153e9).abs() < 1.0);
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        assert_eq!(Material::new(0.0, 0.3, 1.0), Err(FemError::Young(0.0)));
        assert_eq!(
            Material::new(f64::INFINITY, 0.3, 1.0),
            Err(FemError::Young(f64::INFINITY))
        );
        assert_eq!(Material::new(1.0, 0.5, 1.0), Err(FemError::Poisson(0.5)));
        assert_eq!(Material::new(1.0, -1.0, 1.0), Err(FemError::Poisson(-1.0)));
        assert!(Material::new(1.0, f64::NAN, 1.0).is_err());
        let told = Material::new(1.0, 0.2, -4.0).unwrap_err().to_string();
        assert!(told.contains("-4") && told.contains("greater than 0"));
    }
}
