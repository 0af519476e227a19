//! Learning-rate schedules.

use serde::{Deserialize, Serialize};

/// Learning-rate schedule: the factor on the initial learning rate, as a function of the completed fraction t of the training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Schedule {
    /// (1 − t)^0.9. Source: Chen et al. 2018 (DeepLab), "poly".
    Poly,
    /// (1 + cos πt) / 2. Source: Loshchilov & Hutter 2017.
    Cosine,
    /// Constant 1.
    Constant,
}

impl Schedule {
    /// Parses `poly`, `cosine` or `constant`.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "poly" => Ok(Self::Poly),
            "cosine" => Ok(Self::Cosine),
            "constant" => Ok(Self::Constant),
            _ => Err(format!("there is no schedule `{text}`: write poly, cosine or constant")),
        }
    }

    /// Returns the name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Poly => "poly",
            Self::Cosine => "cosine",
            Self::Constant => "constant",
        }
    }

    /// Returns the factor at the completed fraction `done`, 0 to 1. The first thirtieth is a linear warm-up, so
    /// that batch norms can settle.
    pub fn share(self, done: f64) -> f64 {
        let done = done.clamp(0.0, 1.0);
        let climb = (done * 30.0 + 0.02).min(1.0);
        climb
            * match self {
                Self::Poly => (1.0 - done).powf(0.9),
                Self::Cosine => f64::midpoint(1.0, (std::f64::consts::PI * done).cos()),
                Self::Constant => 1.0,
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_climb_then_fall_to_nothing() {
        for schedule in [Schedule::Poly, Schedule::Cosine] {
            assert!(schedule.share(0.0) < 0.03);
            assert!(schedule.share(0.04) > 0.9);
            assert!(schedule.share(1.0).abs() < 1e-9);
            assert!((1..100).all(|i| schedule.share(f64::from(i) / 100.0) > 0.0));
        }
        assert!((Schedule::Cosine.share(0.5) - 0.5).abs() < 1e-12);
        assert_eq!(Schedule::Constant.share(0.7), 1.0);
    }
}
