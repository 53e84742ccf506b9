//! Tests of boards.

use std::fs;

use toml::Table;

use super::*;

#[test]
fn every_shipped_board_loads() {
    assert!(Board::names().contains(&"ulx3s-85f"));
    for name in Board::names() {
        let board = Board::load(name).unwrap();
        assert_eq!(board.name, name);
        let verilog = board.verilog_files().unwrap();
        assert!(verilog.iter().any(|(_, text)| text.contains("module board (")), "{name}");
        // Every port has its site.
        let (_, pins) = board.pin_file().unwrap();
        let ports = verilog.iter().filter_map(|(_, text)| text.split_once("module board (")?.1.split_once(");"));
        let ports: Vec<&str> = ports
            .flat_map(|(ports, _)| ports.lines())
            .filter_map(|l| l.rsplit_once("wire "))
            .map(|(_, port)| port.trim_end_matches(',').rsplit(' ').next().unwrap_or_default())
            .collect();
        assert!(!ports.is_empty() && ports.iter().all(|port| pins.contains(port)), "{name}: {ports:?}");
    }
    // 100 MHz: one cycle is 10 ns.
    let board = Board::load("ulx3s-85f").unwrap();
    assert_eq!(board.microseconds(100), 1.0);
    // Two lanes share a block RAM up to 512 words; 27 bits are split into two parts of 18.
    assert_eq!([(512, 36), (513, 36), (1025, 72), (2048, 9)].map(|(w, b)| board.block_rams_for(w, b)), [1, 2, 6, 1]);
    // Three parts of 6 bits share a word of 18; Yosys 0.23 takes as many for each of these.
    assert_eq!([(2853, 6), (1500, 20), (5000, 3), (1100, 54)].map(|(w, b)| board.block_rams_for(w, b)), [1, 2, 1, 5]);
    assert_eq!([board.multipliers_for(27, 18), board.multipliers_for(18, 18)], [2, 1]);
    // A DSP48E1 takes 25 by 18 bits; a further part has 17 bits, unsigned.
    let board = own("device = \"XC7A35T\"\nclock_MHz = 100.0\n").unwrap();
    let operands = [(25, 18), (18, 25), (26, 18), (42, 18), (43, 18), (25, 19), (43, 19)];
    assert_eq!(operands.map(|(a, b)| board.multipliers_for(a, b)), [1, 1, 2, 2, 3, 2, 6]);
}

/// The board of a file `own.toml`.
fn own(text: &str) -> Result<Board, String> {
    Board::parse("own", "own.toml", text).map_err(|error| error.to_string())
}

/// A file of a board.
const OWN: &str = "\
device = \"LFE5U-25F\"
package = \"CABGA381\"
verilog = [\"own.v\"]
pins = \"own.lpf\"
clock_MHz = 100.0
";

#[test]
fn what_the_file_states_counts_in_the_place_of_the_device() {
    let board = own(OWN).unwrap();
    let counts = |board: &Board| [board.multipliers, board.block_rams, board.luts, board.seeds];
    assert_eq!(counts(&board), [28, 56, 24288, 3]);
    assert_eq!((board.name.as_str(), board.description.as_str(), board.search_width), ("own", "own", 1));
    // A budget.
    let board = own(&format!("{OWN}multipliers = 20\nblock_rams = 40\nseeds = 1\nsearch_width = 2\n")).unwrap();
    assert_eq!(counts(&board), [20, 40, 24288, 1]);
    assert_eq!(board.search_width, 2);
    // A device that is not known, and no pins.
    let counts_of = "luts = 12000\nflip_flops = 12000\nmultipliers = 28\nblock_rams = 32\n";
    let board = own(&format!("family = \"ecp5\"\nclock_MHz = 80\n{counts_of}")).unwrap();
    assert_eq!((board.clock_MHz, board.block_rams, board.multiplier_bits), (80.0, 32, [18, 18]));
    // Such an engine has no bitstream, and an Artix-7 none either.
    let wanted = "own.toml: pins is missing; it must be the pin file beside this one, a .lpf, for a bitstream";
    assert_eq!(board.pin_file().unwrap_err().to_string(), wanted);
    let board = own("clock_MHz = 100\ndevice = \"XC7A100T\"\n").unwrap();
    let wanted = "own.toml, line 2: device: place and route of family artix7 is not run here, so there is no bitstream";
    assert_eq!(board.pin_file().unwrap_err().to_string(), wanted);
}

#[test]
fn a_board_printed_with_every_field_reads_back() {
    for name in Board::names() {
        let board = Board::load(name).unwrap();
        let text = board.to_toml().unwrap();
        let again = Board::parse(name, board.file(), &text).unwrap();
        assert_eq!(Board { own: Reader::default(), ..again }, Board { own: Reader::default(), ..board }, "{text}");
    }
}

#[test]
fn every_device_is_a_board_with_a_clock() {
    let devices = Device::all().unwrap();
    assert_eq!(devices.len(), 6);
    for device in devices {
        let board = own(&format!("device = {:?}\nclock_MHz = 50\n", device.name)).unwrap();
        assert_eq!((i64::from(board.luts), board.family), (device.count("luts"), device.family), "{}", device.name);
        assert!(board.block_rams > 0 && board.multipliers > 0 && !device.source.is_empty());
    }
}

#[test]
fn a_file_of_a_user_is_read_with_the_files_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.toml");
    let name = path.to_str().unwrap();
    let text = OWN.replace("[\"own.v\"]", "[\"parts/own.v\"]");
    fs::write(&path, &text).unwrap();
    let board = Board::load(name).unwrap();
    assert_eq!((board.name.as_str(), board.file(), board.folder()), ("own", name, folder.path()));
    let missing = |field: &str, line: usize, file: &str, error: BoardError| {
        let wanted = format!("{name}, line {line}: {field}: {}: No such file", folder.path().join(file).display());
        assert!(error.to_string().starts_with(&wanted), "{error}");
    };
    missing("verilog", 3, "parts/own.v", board.verilog_files().unwrap_err());
    missing("pins", 4, "own.lpf", board.pin_file().unwrap_err());
    fs::create_dir(folder.path().join("parts")).unwrap();
    fs::write(folder.path().join("parts/own.v"), "module board (); endmodule\n").unwrap();
    fs::write(folder.path().join("own.lpf"), "BLOCK RESETPATHS;\n").unwrap();
    assert_eq!(board.verilog_files().unwrap()[0].0, "own.v");
    assert_eq!(board.pin_file().unwrap(), ("own.lpf".to_owned(), "BLOCK RESETPATHS;\n".to_owned()));
    // Not there, too large, not text.
    let error = Board::load("nowhere/own.toml").unwrap_err().to_string();
    assert!(error.starts_with("nowhere/own.toml: cannot be read: No such file"), "{error}");
    fs::write(&path, "#".repeat(2 << 20)).unwrap();
    assert!(Board::load(name).unwrap_err().to_string().ends_with("too large for a file of a board"));
    fs::write(&path, [0xff]).unwrap();
    assert!(Board::load(name).unwrap_err().to_string().contains("own.toml: cannot be read: "));
}

#[test]
fn an_unknown_board_lists_the_known_ones() {
    let error = Board::load("ulx3s").unwrap_err().to_string();
    assert!(error.contains("\"ulx3s\"") && error.contains("ulx3s-85f") && error.contains(".toml"), "{error}");
}

#[test]
fn the_fields_are_those_of_a_board() {
    let table: Table = [("x".to_owned(), Value::Integer(1))].into_iter().collect();
    let message = Board::deserialize(Value::Table(table)).unwrap_err().to_string();
    let fields: Vec<_> = reader::FIELDS.iter().map(|(field, _)| format!("`{field}`")).collect();
    assert!(message.contains(&format!("expected one of {}\n", fields.join(", "))), "{message}");
}

#[test]
fn a_wrong_field_is_told_with_its_line_value_and_what_is_right() {
    let not = |line: usize, message: &str| format!("own.toml, line {line}: {message}");
    let file = |from: &str, to: &str| own(&OWN.replace(from, to)).unwrap_err();
    let with = |more: &str| own(&format!("{OWN}{more}\n")).unwrap_err();
    let of_device = |field: &str| format!("own.toml: {field} is missing; it must be ");
    let cases = [
        (
            file("clock_MHz = 100.0", "clock_MHz = 0.0"),
            not(5, "clock_MHz = 0.0 is not allowed; it must be a number above 0"),
        ),
        (file("clock_MHz = 100.0", "clock_MHz = nan"), not(5, "clock_MHz = nan is not allowed")),
        (file("clock_MHz = 100.0", ""), of_device("clock_MHz")),
        (file("100.0", "\"fast\""), not(5, "clock_MHz = \"fast\" is not allowed; it must be a number above 0")),
        (file("clock_MHz", "clock_Mhz"), not(5, "unknown field clock_Mhz; did you mean clock_MHz?")),
        (with("colour = \"red\""), not(6, "unknown field colour; there are: description, engine, device, ")),
        (file("= 100.0", "100.0"), not(5, "key with no value where = is wanted")),
        (file("LFE5U-25F", "LFE5U-12F"), not(1, "device = \"LFE5U-12F\" is not allowed; it must be \"LFE5U-25F\", ")),
        (file("device = \"LFE5U-25F\"\n", ""), of_device("device")),
        (
            file("device = \"LFE5U-25F\"", "family = \"ecp6\""),
            not(1, "family = \"ecp6\" is not allowed; it must be \"ecp5\""),
        ),
        (file("device = \"LFE5U-25F\"", "family = \"ecp5\""), of_device("luts")),
        (
            with("family = \"ice40\""),
            not(6, "family = \"ice40\" is not allowed; it must be \"ecp5\", that of LFE5U-25F"),
        ),
        (with("engine = \"fast\""), not(6, "engine = \"fast\" is not allowed; it must be \"parallel\" or \"serial\"")),
        (file("own.lpf", "own.pcf"), not(4, "pins = \"own.pcf\" is not allowed; it must be the pin file")),
        (file("\"own.v\"", "\"own v\""), not(3, "verilog = [\"own v\"] is not allowed; it must be a list")),
        (file("verilog = [\"own.v\"]\n", ""), of_device("verilog")),
        (file("package = \"CABGA381\"\n", ""), of_device("package")),
        (
            with("multipliers = 29"),
            not(6, "multipliers = 29 is not allowed; it must be a whole number of at least 0, and no"),
        ),
        (with("block_rams = -1"), not(6, "block_rams = -1 is not allowed; it must be ")),
        (with("luts = 0"), not(6, "luts = 0 is not allowed; it must be ")),
        (
            with("multiplier_bits = [18, 25]"),
            not(6, "multiplier_bits = [18, 25] is not allowed; it must be the widths"),
        ),
        (with("multiplier_part_bits = 0"), not(6, "multiplier_part_bits = 0 is not allowed; it must be ")),
        (
            with("multiplier_blocks = { columns = [4], rows = [13] }"),
            not(6, "multiplier_blocks = { columns = [4], rows = [13] } is not allowed; it must be columns and rows"),
        ),
        (with("multiplier_blocks = { columns = [4], rows = [] }\nmultipliers = 0"), not(6, "multiplier_blocks = ")),
        (with("multiplier_blocks = { column = [4] }"), not(6, "multiplier_blocks = { column = [4] } is not allowed; ")),
        (with("block_ram_shapes = [[512, 0]]"), not(6, "block_ram_shapes = [[512, 0]] is not allowed; it must be ")),
        (with("search_width = 3"), not(6, "search_width = 3 is not allowed; it must be 4, 2 or 1")),
        (with("placers = []"), not(6, "placers = [] is not allowed; it must be ")),
        (with("seeds = 0"), not(6, "seeds = 0 is not allowed; it must be a whole number above 0")),
        (with("uart_baud = 0"), not(6, "uart_baud = 0 is not allowed; it must be ")),
        (with("spi_MHz = -1.0"), not(6, "spi_MHz = -1.0 is not allowed; it must be a number above 0")),
    ];
    for (message, wanted) in cases {
        assert!(message.starts_with(&wanted), "{message}\n{wanted}");
    }
    // Every field can be wrong, and is told with its line.
    for (field, allowed) in reader::FIELDS {
        let own_lines: Vec<&str> = OWN.lines().filter(|line| !line.starts_with(&format!("{field} "))).collect();
        let text = format!("{field} = true\n{}\n", own_lines.join("\n"));
        let message = own(&text).unwrap_err();
        assert!(message.starts_with(&not(1, &format!("{field} = true is not allowed; it must be "))), "{message}");
        assert!(!allowed.is_empty());
    }
}

#[test]
fn energies_are_ranges_of_a_factor_of_two_at_least() {
    for (_, family) in Family::NAMES {
        let devices: Vec<Device> =
            Device::all().unwrap().into_iter().filter(|device| device.family == family).collect();
        let Some(power) = family::power_of(family).unwrap() else { continue };
        let ranges = [power.toggle_pJ, power.clock_pJ, power.product_pJ, power.block_ram_pJ, power.static_range];
        assert!(ranges.iter().all(|[lower, upper]| *lower > 0.0 && *upper >= 2.0 * lower), "{power:?}");
        assert!(!power.source.is_empty() && power.static_mW("another").is_none());
        for device in devices {
            let [lower, upper] = power.static_mW(&device.name).unwrap();
            assert!(lower > 0.0 && upper >= 2.0 * lower, "{}", device.name);
        }
    }
    assert_eq!(family::power_of(Family::Artix7).unwrap(), None);
    let own = Board::load("ulx3s-85f").unwrap();
    let [lower, upper] = own.power().unwrap().unwrap().static_mW(own.device.as_deref().unwrap()).unwrap();
    assert!(lower < 298.0 && upper > 298.0);
}
