//! Checks the AXI4-Stream rule that a valid beat stays unchanged until it is accepted.

use dermis_hdl::device::Outputs;

/// The rule, as reported when it is violated.
pub(crate) const STABILITY_RULE: &str = "a valid beat must stay unchanged until it is accepted";

/// Data, `tlast`, and `tid` where there are several arrays.
type Offer = ([i32; 3], bool, usize);

/// The beat that was valid but not accepted in the previous cycle, if any.
#[derive(Default)]
pub(crate) struct StabilityCheck(Option<Offer>);

impl StabilityCheck {
    /// Observes one cycle of the output: returns the transferred beat, if any, and whether [`STABILITY_RULE`] holds.
    pub(crate) fn observe(&mut self, outputs: &Outputs, m_ready: bool) -> (Option<Offer>, bool) {
        let offered = outputs.m_valid.then_some((outputs.m_data, outputs.m_last, outputs.m_array));
        let stable = self.0.is_none() || offered == self.0;
        self.0 = offered.filter(|_| !m_ready);
        (offered.filter(|_| m_ready), stable)
    }

    /// Whether a valid beat waits for ready.
    pub(crate) fn is_pending(&self) -> bool {
        self.0.is_some()
    }
}
