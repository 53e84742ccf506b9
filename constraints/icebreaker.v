// iCEBreaker: pins and clock around the board top DERMIS_TOP, whose name the flow defines.
// Pins are in icebreaker.pcf; their names are those of the board's schematic.
module board (
  input wire clk_12mhz,
  input wire btn_n,
  input wire rx,
  output wire tx,
  output wire ledg_n,
  output wire ledr_n,
  output wire led1
);
  wire clk, locked, alive, error;

  // 12 MHz to 25.5 MHz, the board file's clock_MHz; the oscillator of the PLL runs at 816 MHz (533 to 1066 are allowed).
  SB_PLL40_PAD #(
    .FEEDBACK_PATH("SIMPLE"),
    .DIVR(4'd0),
    .DIVF(7'd67),
    .DIVQ(3'd5),
    .FILTER_RANGE(3'd1)
  ) pll (
    .PACKAGEPIN(clk_12mhz),
    .PLLOUTGLOBAL(clk),
    .LOCK(locked),
    .RESETB(1'b1),
    .BYPASS(1'b0)
  );

  assign ledg_n = !alive;
  assign ledr_n = !error;

  `DERMIS_TOP dermis (
    .clk(clk),
    .button(!btn_n | !locked),
    .uart_rx(rx),
    .uart_tx(tx),
    .alive(alive),
    .busy(led1),
    .error(error)
  );
endmodule
