//! The stages of an engine: the blocks of its data flow. The engine's struct is their only list.

/// Where blocks count that belong to no stage: what starts the stages and hands their results over.
pub(crate) const CONTROL: &str = "engine";

/// A stage: a field of the engine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stage {
    /// Name of the field, and so of the instance in the Verilog.
    pub(crate) name: &'static str,
    /// Source of its block.
    pub(crate) source: &'static str,
}

/// The source in which the ports of the engines have their comments.
pub(crate) const PORTS: &str = include_str!("stage_list.rs");

/// Declares an engine: the ports, the same for all; its stages with the file of each block; what starts the stages. From
/// the list of stages follow the fields of the struct, the rows of the tables of resources and faults, and the comments
/// of the ports in the Verilog.
macro_rules! engine {
    (
        $(#[$meta:meta])*
        pub struct $engine:ident {
            stages { $($stage:ident: $stage_type:ty => $source:literal,)+ }
            control { $($control:ident: $control_type:ty,)+ }
        }
    ) => {
        $(#[$meta])*
        #[derive(dermis_hdl_derive::Block)]
        pub struct $engine {
            /// Clock; registers change on its rising edge.
            pub clk: Signal<In, Clock>,
            /// Synchronous reset, active high.
            pub rst: Signal<In, Bit>,
            /// A taxel's code, two's complement, or a byte of an image of tables; valid with `s_axis_tvalid`.
            pub s_axis_tdata: Wire<In>,
            /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
            pub s_axis_tvalid: Signal<In, Bit>,
            /// The block accepts a beat in this cycle.
            pub s_axis_tready: Signal<Out, Bit>,
            /// The beat is the last of its frame; valid with `s_axis_tvalid`.
            pub s_axis_tlast: Signal<In, Bit>,
            /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
            pub m_axis_tdata: Wire<Out>,
            /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
            pub m_axis_tvalid: Signal<Out, Bit>,
            /// The receiver accepts a beat in this cycle.
            pub m_axis_tready: Signal<In, Bit>,
            /// The beat is the last of its frame; valid with `m_axis_tvalid`.
            pub m_axis_tlast: Signal<Out, Bit>,
            $(pub(crate) $stage: $stage_type,)+
            $(pub(crate) $control: $control_type,)+
        }

        impl $engine {
            /// The stages in the order of the data flow.
            pub(crate) const STAGES: &'static [$crate::stage_list::Stage] = &[
                $($crate::stage_list::Stage { name: stringify!($stage), source: include_str!($source) },)+
            ];
        }
    };
}

pub(crate) use engine;
