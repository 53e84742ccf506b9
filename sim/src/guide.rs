//! Guide: pages for people who use Dermis or extend it; [`index`] lists them by task.
//!
//! The pages are the Markdown files of `docs`, readable in a Git web view as well. A link between pages is written
//! `[text][page.md]` with a definition at the page's end, which names the file. Here the definitions of `links!` stand
//! before a page's own, and Markdown takes the first of two: they name the page's module.

/// Definitions of the links of all pages, as Markdown.
macro_rules! links {
    ($($file:literal $page:ident,)*) => {
        concat!($("[", $file, "]: crate::guide::", stringify!($page), "\n",)* "[format.md]: dermis_golden::wire::link\n\n")
    };
}

/// A module for each page, all with the same definitions of links.
macro_rules! modules {
    ($all:tt $($file:literal $page:ident,)*) => { $(modules! { @one $all $file $page })* };
    (@one { $($all:tt)* } $file:literal $page:ident) => {
        #[doc = links!($($all)*)]
        #[doc = include_str!(concat!("../../docs/", $file))]
        pub mod $page {}
    };
}

/// The pages: file in `docs`, module here.
macro_rules! pages {
    ($($list:tt)*) => { modules! { { $($list)* } $($list)* } };
}

pages! {
    "index.md" index,
    "your-sensor.md" your_sensor,
    "recordings.md" recordings,
    "live.md" live,
    "ros.md" ros,
    "files.md" files,
    "python.md" python,
    "c.md" c,
    "learning.md" learning,
    "accuracy.md" accuracy,
    "limits.md" limits,
    "over-time.md" over_time,
    "partitions.md" partitions,
    "stability.md" stability,
    "robustness.md" robustness,
    "boards.md" boards,
    "your-board.md" your_board,
    "in-your-soc.md" in_your_soc,
    "microcontroller.md" microcontroller,
    "devices.md" devices,
    "method.md" method,
    "formats.md" formats,
    "architecture.md" architecture,
    "architecture/scan.md" scan,
    "architecture/prepare.md" prepare,
    "architecture/receive.md" receive,
    "architecture/choose.md" choose,
    "architecture/normalise.md" normalise,
    "architecture/fold.md" fold,
    "architecture/pass.md" pass,
    "architecture/estimate.md" estimate,
    "architecture/rescale.md" rescale,
    "architecture/relax.md" relax,
    "architecture/contacts.md" contacts,
    "architecture/unfold.md" unfold,
    "architecture/search.md" search,
    "architecture/forces.md" forces,
    "architecture/send.md" send,
    "architecture/resultants.md" resultants,
    "architecture/blocks.md" blocks,
    "glossary.md" glossary,
}
