//! `#[derive(Block)]` for rust-hdl's blocks, in the place of its `#[derive(LogicBlock)]`.
//!
//! rust-hdl simulates in rounds until no signal changes. In a round of `LogicBlock` a block computes first and takes its
//! inputs after, so that a value moves by one block or one level of the hierarchy per round, and every block takes part in
//! every round. Here a value passes all levels in one round, and a block whose inputs and contents stand still is left
//! out. What the signals settle to is the same.
#![deny(missing_docs)]

use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Error, Field, GenericArgument, Ident, PathArguments, Type};

/// Implements rust-hdl's `Block` for a struct of signals and blocks, all of them named fields; a field whose name begins with
/// `_` is neither.
///
/// A round takes the inputs, calls `Logic::update`, does a round of the blocks inside, calls `update` again for what these
/// put out, and shows the other signals. A clock edge thus reaches all blocks before any of them sees what another did at
/// this edge, at whatever level of the hierarchy. The `update` of a block with a field `kernel` acts on edges and is called
/// once.
#[proc_macro_derive(Block)]
pub fn derive_block(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    let input = syn::parse_macro_input!(input as DeriveInput);
    block(&input).unwrap_or_else(Error::into_compile_error).into()
}

/// When the value of a field is taken.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    /// At the beginning: a signal from outside.
    Input,
    /// At both ends: the field `ports`, inputs and outputs together.
    Ports,
    /// In the middle: a block inside.
    Inside,
    /// In the middle, and it holds the state: the field `kernel`.
    Kernel,
    /// At the end: a signal that `update` assigns.
    Driven,
}

fn block(input: &DeriveInput) -> Result<TokenStream, Error> {
    let Data::Struct(data) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "a block is a struct"));
    };
    let mut fields: Vec<(&Ident, Part)> = Vec::new();
    for field in &data.fields {
        let Some(name) = &field.ident else {
            return Err(Error::new_spanned(field, "a block's signals and blocks have names"));
        };
        if !name.to_string().starts_with('_') {
            fields.push((name, part(name, field)));
        }
    }
    let has = |part: Part| fields.iter().any(|field| field.1 == part);
    let those = |parts: &[Part]| -> Vec<&Ident> {
        fields.iter().filter(|field| parts.contains(&field.1)).map(|field| field.0).collect()
    };
    let first = those(&[Part::Input, Part::Ports]);
    let inside = those(&[Part::Inside]);
    let last = those(&[Part::Driven, Part::Ports]);
    let all: Vec<&Ident> = fields.iter().map(|field| field.0).collect();
    let names = all.iter().map(ToString::to_string);
    // Constants reach what they drive in the first round. A kernel stands as changed until then; what has no block inside
    // that could has no state either, and takes part in every round.
    let leave = (has(Part::Kernel) || has(Part::Inside)).then(|| {
        quote! {
            if !self.has_changed() {
                return;
            }
        }
    });
    let again = (has(Part::Inside) && !has(Part::Kernel)).then(|| quote! { self.update(); });
    let block = &input.ident;
    let (generics, arguments, condition) = input.generics.split_for_impl();
    Ok(quote! {
        impl #generics rust_hdl::prelude::Block for #block #arguments #condition {
            fn connect_all(&mut self) {
                self.connect();
                #(self.#all.connect_all();)*
            }

            fn update_all(&mut self) {
                #(self.#first.update_all();)*
                #leave
                self.update();
                #(self.#inside.update_all();)*
                #again
                #(self.#last.update_all();)*
            }

            fn has_changed(&self) -> bool {
                false #(|| self.#all.has_changed())*
            }

            fn accept(&self, name: &str, probe: &mut dyn rust_hdl::core::probe::Probe) {
                probe.visit_start_scope(name, self);
                #(self.#all.accept(#names, probe);)*
                probe.visit_end_scope(name, self);
            }
        }
    })
}

fn part(name: &Ident, field: &Field) -> Part {
    if name == "kernel" {
        return Part::Kernel;
    }
    if name == "ports" {
        return Part::Ports;
    }
    let Type::Path(path) = &field.ty else { return Part::Inside };
    let Some(last) = path.path.segments.last() else { return Part::Inside };
    if last.ident != "Signal" && last.ident != "Wire" {
        return Part::Inside;
    }
    let PathArguments::AngleBracketed(arguments) = &last.arguments else { return Part::Inside };
    match arguments.args.first() {
        Some(GenericArgument::Type(Type::Path(direction))) if direction.path.is_ident("In") => Part::Input,
        _ => Part::Driven,
    }
}
