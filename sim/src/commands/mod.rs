//! The `dermis` command line: arguments, commands, exit codes. Each command reads its inputs, calls what does the work
//! and prints the result.
//!
//! | module | does |
//! |---|---|
//! | [`bitstream`] | `dermis bitstream`: synthesis, place and route, compared with committed baselines |
//! | `blind_gains` | `dermis study blind-gains`: gains found from presses of unknown load |
//! | [`block`] | `dermis block`: ports, Verilog and drawn timing of the blocks |
//! | [`boards`] | `dermis boards`: built-in boards and known devices, or every field of one board |
//! | [`build`] | `dermis build`: generates the Verilog of a scene |
//! | [`calibrate`] | `dermis calibrate`: a calibration table from recordings under known stresses, or of ordinary presses |
//! | [`check`] | `dermis check`: what to expect of a scene; whether a generated folder is intact |
//! | [`cosim`] | `dermis cosim`: compares simulated hardware with the bit-true model |
//! | [`deviations`] | `dermis deviations`: standard deviations of a search |
//! | [`export`] | `dermis export`: the network of a scene as a file for other programs |
//! | [`mod@faults`] | `dermis faults`: flips single bits and counts the outcomes |
//! | [`mod@generate`] | `dermis generate`: frames with known forces from described contacts |
//! | [`guide_pages`] | `dermis guide`: tables and pictures of README and guide, made by the commands named there |
//! | [`host`] | `dermis host`: sends frames to a board over a serial port and reads back forces |
//! | [`mod@import`] | `dermis import`: recordings of real arrays as scene and frames |
//! | [`inputs`] | scene and frames from command-line arguments |
//! | `layout` | options of the layout of lines of numbers |
//! | [`live`] | `dermis live`: a local page with the newest forces of a stream, of a recording, or of a finger |
//! | [`new`] | `dermis new`: a scene for a new sensor |
//! | [`mod@noise`] | `dermis noise`: errors under noise beside the Cramér–Rao bound |
//! | [`place`] | `dermis place`: place and route of a netlist that is not of a scene and a board |
//! | [`mod@power`] | `dermis power`: the engine's power, estimated |
//! | [`reconstruct`] | `dermis reconstruct`: the forces of one frame, by a model or the hardware |
//! | `reconstruct_stream` | `dermis reconstruct --stream`: frames as lines, results as lines of JSON |
//! | [`mod@converters`] | `dermis converters`: the converters of a scan |
//! | [`mod@registers`] | `dermis registers`: the register map of a core |
//! | `scene_file` | what a command measured, written into the file of a scene |
//! | [`mod@schema`] | `dermis schema`: the fields of scenes, frames and results |
//! | [`replay`] | `dermis replay`: the frames or the results of a recording, line by line |
//! | [`mod@report`] | `dermis report`: measures, assembles the sections, writes the files |
//! | `devices` | `dermis study devices`: time and energy of a frame on CPU, microcontroller and FPGA |
//! | `sensor_faults` | `dermis study sensor-faults`: frames of faulty sensors, flagged or silently wrong |
//! | [`stability`] | `dermis stability`: errors against condition number, extreme frames |
//! | [`mod@stress`] | `dermis stress`: both streams under gaps, wrong `tlast` and resets |
//! | [`mod@study`] | `dermis study`: comparisons shown in the guide |
//! | [`table`] | `dermis table`: errors of scenes in the paper's cases |
//! | [`train`] | `dermis train`: a network for the estimators that have one |

pub mod bitstream;
mod blind_gains;
pub mod block;
pub mod boards;
pub mod build;
pub mod calibrate;
pub mod check;
mod check_noise;
mod check_rate;
mod cli;
pub mod converters;
pub mod cosim;
pub mod deviations;
mod devices;
pub mod export;
pub mod faults;
pub mod generate;
mod generate_press;
pub mod guide_pages;
pub mod host;
pub mod import;
pub mod inputs;
mod layout;
pub mod live;
mod load;
pub mod new;
pub mod noise;
pub mod place;
pub mod power;
pub mod reconstruct;
mod reconstruct_stream;
pub mod registers;
pub mod replay;
pub mod report;
mod scene_file;
pub mod schema;
mod sensor_faults;
pub mod stability;
pub mod stress;
pub mod study;
pub mod table;
pub mod train;

pub use cli::{check_arguments, main};
