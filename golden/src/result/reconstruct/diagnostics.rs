//! Diagnostics: figures, flags and suspect taxels of a result, whatever its form.

use super::SuspectTaxel;
use crate::result::checks::Checks;
use crate::result::flags::Flag;
use crate::spec::scene::Scene;

/// Figures, flags and suspect taxels of a result, to be added to.
pub struct Diagnostics<'a> {
    /// The figures behind the flags.
    pub checks: &'a mut Checks,
    /// Flags, sorted, without duplicates.
    pub flags: &'a mut Vec<Flag>,
    /// Taxels whose readings no force explains.
    pub suspects: &'a mut Vec<SuspectTaxel>,
}

impl Diagnostics<'_> {
    /// Takes `checks` as the figures, and adds the flags that they raise.
    pub fn add_checks(&mut self, scene: &Scene, checks: Checks) {
        *self.checks = checks;
        self.raise(checks.flags(scene));
    }

    /// Adds flags.
    pub fn raise(&mut self, flags: impl IntoIterator<Item = Flag>) {
        self.flags.extend(flags);
        self.flags.sort();
        self.flags.dedup();
    }
}
