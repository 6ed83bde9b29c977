//! Stacks as they are described, and how they are made from that.

use super::{Layered, LayeredError, Level, Medium, Quantity, Surface};
use crate::{Beckmann, Conductor, ConductorFresnel, Dielectric, Diffuse, Facets, Film, Ggx, Glass};
use crate::{Microsurface, Real, Rgb};
use smallvec::{SmallVec, smallvec};

/// How rough a surface is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finish<F> {
    /// Not at all.
    Smooth,
    /// Normals distributed by GGX.
    Ggx(Ggx<F>),
    /// Normals distributed by Beckmann.
    Beckmann(Beckmann<F>),
}

/// A dielectric interface and the slab below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interface<F> {
    /// Absolute index of refraction of the medium below.
    pub ior: F,
    /// How rough it is.
    pub finish: Finish<F>,
    /// Absorption of the slab below, per channel and unit of length.
    pub absorption: Rgb<F>,
    /// Thickness of the slab below, in the same unit of length.
    pub thickness: F,
    /// The factor on its reflectance at normal incidence, white for none; see
    /// [`Glass`].
    pub reflection: Rgb<F>,
    /// The factor on what it lets through, in either direction.
    pub transmission: Rgb<F>,
    /// A thin film on it, of absolute index; then `reflection` has no say.
    pub film: Option<Film<F>>,
}

impl<F: Real> Interface<F> {
    /// An interface over a clear slab of thickness 1.
    pub fn new(ior: F, finish: Finish<F>) -> Self {
        Self {
            ior,
            finish,
            absorption: Rgb::black(),
            thickness: F::one(),
            reflection: Rgb::white(),
            transmission: Rgb::white(),
            film: None,
        }
    }
}

/// What a stack ends with.
#[derive(Clone, Debug, PartialEq)]
pub enum Base<F> {
    /// Nothing: the medium below the last interface goes on.
    Open,
    /// Metal; smooth metal is a mirror.
    Conductor {
        /// How rough it is.
        finish: Finish<F>,
        /// Its reflectance. A complex index is absolute; the other curves are
        /// those under the slab above.
        fresnel: ConductorFresnel<F>,
    },
    /// Diffuse facets; smooth ones are Lambert's surface.
    Diffuse {
        /// How rough it is.
        finish: Finish<F>,
        /// Reflectance of the facets.
        albedo: Rgb<F>,
    },
    /// Several side by side, too fine to be told apart: shares, which add up
    /// to 1, and surfaces. May be nested.
    Mix(Vec<(F, Base<F>)>),
}

/// α up to this many ε is none: directions are rounded by as much.
const LEAST_ALPHA: f64 = 8.0;

/// How far from 1 the shares of a mix may add up, in ε per surface.
const SHARE_ROUNDING: f64 = 16.0;

/// `value`, if it passes.
fn check<F: Real>(
    interface: Option<usize>,
    quantity: Quantity,
    value: F,
    passes: bool,
) -> Result<F, LayeredError> {
    if passes && value.is_finite() {
        Ok(value)
    } else {
        Err(LayeredError::Range {
            interface,
            quantity,
            value: value.as_f64(),
        })
    }
}

/// All channels of `value`, each if it passes.
fn check_rgb<F: Real>(
    interface: Option<usize>,
    quantity: Quantity,
    value: Rgb<F>,
    passes: impl Fn(F) -> bool,
) -> Result<(), LayeredError> {
    for channel in value.0 {
        check(interface, quantity, channel, passes(channel))?;
    }
    Ok(())
}

impl<F: Real> Finish<F> {
    /// A finish that is valid, and whose α are none or can be told from none.
    fn settled(self, interface: Option<usize>) -> Result<Self, LayeredError> {
        let (x, y) = match self {
            Self::Smooth => return Ok(self),
            Self::Ggx(ndf) => (ndf.alpha_x, ndf.alpha_y),
            Self::Beckmann(ndf) => (ndf.alpha_x, ndf.alpha_y),
        };
        for alpha in [x, y] {
            check(interface, Quantity::Alpha, alpha, alpha >= F::zero())?;
        }
        let least = F::of(LEAST_ALPHA) * F::epsilon();
        if x.max(y) <= least {
            return Ok(Self::Smooth);
        }
        let (alpha_x, alpha_y) = (x.max(least), y.max(least));
        Ok(match self {
            Self::Smooth => self,
            Self::Ggx(_) => Self::Ggx(Ggx { alpha_x, alpha_y }),
            Self::Beckmann(_) => Self::Beckmann(Beckmann { alpha_x, alpha_y }),
        })
    }
}

impl<F: Real> Layered<F> {
    /// A stack of `interfaces` from the top over `base`, with air above.
    ///
    /// # Errors
    /// Tells which number is out of its range or contradicts another.
    pub fn new(interfaces: &[Interface<F>], base: Base<F>) -> Result<Self, LayeredError> {
        let open = base == Base::Open;
        if interfaces.is_empty() && open {
            return Err(LayeredError::Empty);
        }
        let mut media = vec![Medium {
            ior: F::one(),
            depth: Rgb::black(),
        }];
        let mut levels = Vec::with_capacity(interfaces.len() + 1);
        for (k, interface) in interfaces.iter().enumerate() {
            let above = media[k].ior;
            levels.push(interface.level(k + 1, above)?);
            media.push(interface.medium(k + 1)?);
        }
        let last = media[interfaces.len()];
        if open {
            if last.depth.max_channel() > F::zero() {
                return Err(LayeredError::AbsorptionBelow);
            }
        } else {
            let mut surfaces = SmallVec::new();
            base.flatten(F::one(), last.ior, &mut surfaces)?;
            let mut sum = F::zero();
            for (share, _) in &mut surfaces {
                sum += *share;
                *share = sum;
            }
            levels.push(Level { surfaces });
        }
        Ok(Self { levels, media })
    }
}

impl<F: Real> Interface<F> {
    /// The surface between this slab and a medium of the index `above`.
    fn level(&self, number: usize, above: F) -> Result<Level<F>, LayeredError> {
        let number = Some(number);
        let ior = check(number, Quantity::Ior, self.ior, self.ior > F::zero())?;
        let mut facets = Glass {
            eta: ior / above,
            reflection: self.reflection,
            transmission: self.transmission,
            film: match self.film {
                Some(film) => Some(film_under(film, above, number)?),
                None => None,
            },
        };
        check(number, Quantity::Ior, facets.eta, facets.eta > F::zero())?;
        let (zero, one) = (F::zero(), F::one());
        let f0 = crate::fresnel::normal_reflectance(facets.eta);
        check_rgb(number, Quantity::Reflection, self.reflection, |c| {
            c >= zero && f0 * c <= one
        })?;
        check_rgb(number, Quantity::Transmission, self.transmission, |c| {
            c >= zero && c <= one
        })?;
        let mut finish = self.finish.settled(number)?;
        if facets.invisible().is_some() {
            facets.eta = one;
            facets.reflection = Rgb::white();
            facets.film = None;
            finish = Finish::Smooth;
        }
        let colored = facets.reflection != Rgb::white()
            || facets.transmission != Rgb::white()
            || facets.film.is_some();
        let white = Dielectric {
            eta: facets.eta,
            tint: Rgb::white(),
        };
        let surface = match (finish, colored) {
            (Finish::Smooth, false) => Surface::Interface(white),
            (Finish::Smooth, true) => Surface::Colored(facets),
            (Finish::Ggx(ndf), false) => {
                Surface::GgxDielectric(Microsurface { ndf, facets: white })
            }
            (Finish::Ggx(ndf), true) => Surface::GgxGlass(Microsurface { ndf, facets }),
            (Finish::Beckmann(ndf), false) => {
                Surface::BeckmannDielectric(Microsurface { ndf, facets: white })
            }
            (Finish::Beckmann(ndf), true) => Surface::BeckmannGlass(Microsurface { ndf, facets }),
        };
        Ok(Level {
            surfaces: smallvec![(F::one(), surface)],
        })
    }

    /// The slab below.
    fn medium(&self, number: usize) -> Result<Medium<F>, LayeredError> {
        let number = Some(number);
        let zero = F::zero();
        let thickness = self.thickness;
        check(number, Quantity::Thickness, thickness, thickness >= zero)?;
        check_rgb(number, Quantity::Absorption, self.absorption, |c| c >= zero)?;
        let depth = self.absorption * thickness;
        check_rgb(number, Quantity::Absorption, depth, |_| true)?;
        Ok(Medium {
            ior: self.ior,
            depth,
        })
    }
}

impl<F: Real> Base<F> {
    /// Adds the surfaces of a base of this `share` under a medium of index
    /// `above`; those without a share are left out.
    fn flatten(
        self,
        share: F,
        above: F,
        surfaces: &mut SmallVec<[(F, Surface<F>); 1]>,
    ) -> Result<(), LayeredError> {
        let (zero, one) = (F::zero(), F::one());
        let surface = match self {
            Self::Open => return Err(LayeredError::OpenInMix),
            Self::Conductor { finish, fresnel } => {
                let fresnel = under(fresnel, above)?;
                let facets = Conductor { fresnel };
                match finish.settled(None)? {
                    Finish::Smooth => Surface::Mirror(facets),
                    Finish::Ggx(ndf) => Surface::GgxConductor(Microsurface { ndf, facets }),
                    Finish::Beckmann(ndf) => {
                        Surface::BeckmannConductor(Microsurface { ndf, facets })
                    }
                }
            }
            Self::Diffuse { finish, albedo } => {
                reflectance(albedo)?;
                let facets = Diffuse { albedo };
                match finish.settled(None)? {
                    Finish::Smooth => Surface::Lambert(facets),
                    Finish::Ggx(ndf) => Surface::GgxDiffuse(Microsurface { ndf, facets }),
                    Finish::Beckmann(ndf) => Surface::BeckmannDiffuse(Microsurface { ndf, facets }),
                }
            }
            Self::Mix(parts) => {
                let mut sum = zero;
                for &(part, _) in &parts {
                    let fits = part >= zero && part <= one;
                    sum += check(None, Quantity::Share, part, fits)?;
                }
                let rounding = F::of(SHARE_ROUNDING * parts.len() as f64) * F::epsilon();
                if (sum - one).abs() > rounding {
                    return Err(LayeredError::Shares(sum.as_f64()));
                }
                for (part, base) in parts {
                    base.flatten(share * part / sum, above, surfaces)?;
                }
                return Ok(());
            }
        };
        if share > zero {
            surfaces.push((share, surface));
        }
        Ok(())
    }
}

/// Refuses what reflects less than nothing or more than all.
fn reflectance<F: Real>(value: Rgb<F>) -> Result<(), LayeredError> {
    check_rgb(None, Quantity::Reflectance, value, |c| {
        c >= F::zero() && c <= F::one()
    })
}

/// Refuses indices that nothing has.
fn complex_index<F: Real>(eta: Rgb<F>, k: Rgb<F>) -> Result<(), LayeredError> {
    for c in 0..3 {
        let (eta, k) = (eta.0[c], k.0[c]);
        let something = eta + k > F::zero();
        for part in [eta, k] {
            let fits = part >= F::zero() && something;
            check(None, Quantity::ComplexIndex, part, fits)?;
        }
    }
    Ok(())
}

/// The reflectance of metal under a medium of index `above`.
fn under<F: Real>(
    fresnel: ConductorFresnel<F>,
    above: F,
) -> Result<ConductorFresnel<F>, LayeredError> {
    match fresnel {
        ConductorFresnel::Constant(color) => reflectance(color)?,
        ConductorFresnel::Schlick { f0 } => reflectance(f0)?,
        ConductorFresnel::F82 { f0, f82 } => {
            reflectance(f0)?;
            reflectance(f82)?;
        }
        ConductorFresnel::Dielectric { eta, f0, f90 } => {
            check(None, Quantity::Ior, eta, eta > F::zero())?;
            reflectance(f0)?;
            reflectance(f90)?;
        }
        ConductorFresnel::Complex { eta, k } => {
            complex_index(eta, k)?;
            return Ok(ConductorFresnel::Complex {
                eta: eta * above.recip(),
                k: k * above.recip(),
            });
        }
        ConductorFresnel::Film { film, eta, k } => {
            complex_index(eta, k)?;
            return Ok(ConductorFresnel::Film {
                film: film_under(film, above, None)?,
                eta: eta * above.recip(),
                k: k * above.recip(),
            });
        }
    }
    Ok(fresnel)
}

/// A film of absolute index under a medium of index `above`.
fn film_under<F: Real>(
    film: Film<F>,
    above: F,
    interface: Option<usize>,
) -> Result<Film<F>, LayeredError> {
    let (zero, one) = (F::zero(), F::one());
    check(interface, Quantity::Ior, film.ior, film.ior > zero)?;
    check(
        interface,
        Quantity::Thickness,
        film.thickness,
        film.thickness >= zero,
    )?;
    check(
        interface,
        Quantity::Share,
        film.cover,
        film.cover >= zero && film.cover <= one,
    )?;
    Ok(film.inverted(above))
}
