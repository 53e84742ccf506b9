//! `dermis boards`: the built-in boards and the known devices, or every field of one board.

use anyhow::Result;
use clap::Args;
use dermis_golden::spec::board::{Board, Device};

use dermis_report::{self as report, BoardList, NamedBoard};

/// Arguments of `dermis boards`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  dermis boards                                      built-in boards, known devices and what they have
  dermis boards icebreaker                           every field, as a file to start your own from
  dermis boards ./my-board.toml                      your own, checked, with what its device gives
  dermis boards --json")]
pub struct Arguments {
    /// Board to check and print with every field: a built-in name, or the path of a file that ends with .toml.
    board: Option<String>,
    /// Print JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// An unknown board, a wrong file of a board, a file that it names and that is missing.
pub fn run(arguments: &Arguments) -> Result<String> {
    let Some(name) = &arguments.board else {
        let boards = Board::names().into_iter().map(Board::load).collect::<Result<Vec<_>, _>>()?;
        let list = BoardList { boards: boards.into_iter().map(NamedBoard::from).collect(), devices: Device::all()? };
        return Ok(if arguments.json { serde_json::to_string(&list)? + "\n" } else { report::boards(&list) });
    };
    let board = Board::load(name)?;
    board.verilog_files()?;
    if board.pins.is_some() {
        board.pin_file()?;
    }
    match arguments.json {
        true => Ok(serde_json::to_string(&NamedBoard::from(board))? + "\n"),
        false => Ok(format!("# {}: every field, with what the device gives.\n\n{}", board.name, board.to_toml()?)),
    }
}
