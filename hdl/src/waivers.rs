//! Waivers of Verilator warnings, as a file that Verilator reads; each stands under its reason.

/// The waivers that a design needs.
pub(crate) const WAIVERS: &str =
    "`verilator_config\n// \"Filename does not match MODULE name\": all modules of a design are in \
                                  one file.\nlint_off -rule DECLFILENAME -file \"*.v\"\n";
