//! A twin after a fit: its parameters with the values the recordings gave them, and the document that says so.

use nalgebra::DMatrix;

use crate::io::{InputError, MechanismEntry, Quantity, TwinFile};
use crate::market::settle_trued_run;
use crate::sim2real::randomize::Posterior;
use crate::sim2real::{Assembly, Parameter, Plant, Simulator};

/// The parameters of a twin after a fit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FittedTwin {
    /// The plant's.
    pub own: Vec<Fitted>,
    /// Those of each mechanism, by its id.
    pub mechanisms: Vec<(&'static str, Vec<Fitted>)>,
    /// What the fit tells of all of them together.
    pub posterior: Posterior,
}

/// A parameter after a fit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fitted {
    pub name: String,
    pub unit: String,
    pub nominal: f64,
    pub value: f64,
    /// Standard deviation, in `unit`.
    pub std: f64,
    /// Whether no fit may move it.
    pub frozen: bool,
    /// Whether it ended at a bound.
    pub at_bound: bool,
}

impl FittedTwin {
    /// `assembly` with `values` for its parameters, their standard deviations `std` and their `correlation`, in their order.
    pub fn of<P: Plant>(assembly: &Assembly<P>, values: &[f64], std: &[f64], correlation: &DMatrix<f64>) -> Self {
        let mut estimates = values.iter().copied().zip(std.iter().copied());
        // A plant gives its own units; mechanisms declare theirs in general terms.
        let mut fitted = |parameters: &[Parameter], general: bool| -> Vec<Fitted> {
            let one = |(p, (value, std)): (&Parameter, (f64, f64))| Fitted {
                name: p.name.clone().into_owned(),
                unit: if general { assembly.unit(&p.unit) } else { p.unit.clone().into_owned() },
                nominal: p.nominal,
                value,
                std,
                frozen: p.frozen(),
                at_bound: !p.frozen() && p.at_bound(value),
            };
            parameters.iter().zip(estimates.by_ref()).map(one).collect()
        };
        let own = fitted(assembly.own(), false);
        let mechanisms =
            assembly.mechanisms().map(|(row, _, parameters)| (row.about().name, fitted(parameters, true))).collect();
        let mut fitted = Self { own, mechanisms, posterior: Posterior::default() };
        let names: Vec<String> = fitted.named().into_iter().map(|(name, _)| name).collect();
        // What no fit moves is known exactly.
        let std: Vec<f64> = fitted.named().iter().map(|(_, f)| if f.frozen { 0.0 } else { f.std }).collect();
        fitted.posterior = Posterior::of_fit(&names, values, &std, correlation);
        fitted
    }

    /// All parameters, those of a mechanism under its id and theirs (`coulomb_friction.torque`).
    pub fn named(&self) -> Vec<(String, &Fitted)> {
        let own = self.own.iter().map(|fitted| (fitted.name.clone(), fitted));
        let added = self.mechanisms.iter().flat_map(|(id, all)| all.iter().map(move |f| (format!("{id}.{}", f.name), f)));
        own.chain(added).collect()
    }

    /// `file` with these values and mechanisms. What no fit may move stays as the file has it.
    ///
    /// A commission that was an assumption of the file and has been refitted becomes a mechanism, for assumptions have no
    /// uncertainty.
    ///
    /// # Errors
    /// What [`settle_trued_run`] refuses, where the file is a run.
    pub fn document(&self, file: &TwinFile) -> Result<TwinFile, InputError> {
        let mut out = file.clone();
        for fitted in self.own.iter().filter(|fitted| !fitted.frozen) {
            let controller = out.controller.as_mut().zip(fitted.name.strip_prefix("controller."));
            match controller.and_then(|(controller, key)| controller.parameter_mut(key)) {
                Some(quantity) => *quantity = fitted.quantity(),
                None => {
                    out.parameters.insert(fitted.name.clone(), fitted.quantity());
                }
            }
        }
        let entry = |(id, all): &(&'static str, Vec<Fitted>)| {
            let brought = file.run.iter().filter_map(|run| run.twin.as_ref()).flat_map(|twin| &twin.mechanisms);
            let before = file.mechanisms.iter().chain(brought).find(|entry| entry.name == *id);
            let quantity = |fitted: &Fitted| {
                let kept = before.and_then(|entry| entry.parameter(&fitted.name)).filter(|_| fitted.frozen);
                (fitted.name.clone(), kept.cloned().unwrap_or_else(|| fitted.quantity()))
            };
            MechanismEntry { name: (*id).to_owned(), parameters: all.iter().map(quantity).collect() }
        };
        out.mechanisms = self.mechanisms.iter().map(entry).collect();
        if let Some(assumptions) = &mut out.assumptions
            && out.mechanisms.iter().any(|entry| entry.name == "commission")
        {
            assumptions.commission_bps = None;
            assumptions.commission_per_share = None;
        }
        // What was seen to move the mid of a tape is in that tape: nothing else is to be added to it.
        if self.mechanisms.iter().any(|(_, all)| all.iter().any(|fitted| fitted.name == SHOWN)) {
            match &mut out.run {
                Some(run) => run.run.shows_own_orders = run.run.shows_own_orders.or(Some(true)),
                None => {
                    let market = out.market.get_or_insert_default();
                    market.shows_own_orders = market.shows_own_orders.or(Some(true));
                }
            }
        }
        out.posterior = Some(self.posterior.clone()).filter(|posterior| !posterior.is_empty());
        settle_trued_run(&mut out)?;
        Ok(out)
    }
}

/// The parameter that laws have where a tape shows own orders.
const SHOWN: &str = "paid";

impl Fitted {
    /// The fitted value as a document gives it.
    fn quantity(&self) -> Quantity {
        // A standard deviation of 0 would say that the value is known exactly, and no fit has found that.
        if self.std.is_finite() && self.std > 0.0 {
            Quantity::with_std(self.value, self.std, &self.unit)
        } else {
            Quantity { unit: Some(self.unit.clone()), ..Quantity::bare(self.value) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Document;
    use crate::market::execution_assembly;
    use crate::robot::joint_assembly;
    use std::path::Path;

    fn joint(text: &str) -> TwinFile {
        let head = "[twin]\nmodel = \"joint\"\n[parameters]\ninertia = 95.0\nviscous_friction = 200.0\n[channels]\n\
                    command = { column = \"u\" }\nposition = { column = \"q\", unit = \"m\" }\n";
        TwinFile::parse(Document::from_text("twin.toml", format!("{head}{text}"))).unwrap()
    }

    fn read_back(file: &TwinFile) -> TwinFile {
        TwinFile::parse(Document::from_text("trued.toml", file.render(Path::new("")).unwrap())).unwrap()
    }

    #[test]
    fn a_fitted_twin_reads_back_with_the_units_of_its_axis() {
        let file = joint(
            "[[mechanism]]\nname = \"coulomb_friction\"\ntorque = 20.0\n\
             [[mechanism]]\nname = \"saturation\"\nlimit = { value = 50.0, uncertainty = 0.0 }\n",
        );
        let assembly = joint_assembly(&file).unwrap();
        let values = [96.0, 210.0, 0.0, 1.0, 21.0, 50.0];
        let mut correlated = DMatrix::identity(6, 6);
        (correlated[(0, 4)], correlated[(4, 0)]) = (-0.25, -0.25);
        let fitted = FittedTwin::of(&assembly, &values, &[0.5, 2.0, 0.0, 0.0, 0.1, 0.0], &correlated);
        assert_eq!(fitted.named()[4].0, "coulomb_friction.torque");
        let back = read_back(&fitted.document(&file).unwrap());
        let again = joint_assembly(&back).unwrap();
        assert_eq!(again.parameters().iter().map(|p| p.nominal).collect::<Vec<_>>(), values);
        assert_eq!(back.parameters["inertia"], Quantity::with_std(96.0, 0.5, "kg"));
        assert_eq!(back.mechanisms[0].parameters[0].1, Quantity::with_std(21.0, 0.1, "N"));
        assert!(!back.parameters.contains_key("gain"), "what the file leaves out and no fit moves stays out");
        assert!(again.parameters()[5].frozen());
        let posterior = back.posterior.unwrap();
        assert_eq!(posterior, fitted.posterior);
        assert_eq!(posterior.names, ["inertia", "viscous_friction", "coulomb_friction.torque"]);
        assert_eq!((posterior.std, posterior.correlation), (vec![0.5, 2.0, 0.1], vec![vec![0.0], vec![-0.25, 0.0]]));
    }

    #[test]
    fn a_refitted_commission_stands_once() {
        let text = "[twin]\nmodel = \"execution\"\n[assumptions]\nprice = \"mid\"\ncommission_bps = 0.5\n\
                    [[instrument]]\nsymbol = \"XYZ\"\ntick_size = 0.01\n";
        let file = TwinFile::parse(Document::from_text("twin.toml", text)).unwrap();
        let fitted = FittedTwin::of(&execution_assembly(&file).unwrap(), &[0.41], &[0.0], &DMatrix::identity(1, 1));
        let back = read_back(&fitted.document(&file).unwrap());
        let again = execution_assembly(&back).unwrap();
        assert_eq!((again.parameters().len(), again.parameters()[0].nominal), (1, 0.41));
        assert!(!again.parameters()[0].frozen());
    }
}
