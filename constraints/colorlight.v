// Colorlight i5 and i9 on the extension board: pins around the board top, whose PLL is in ecp5-pll.v. `dermis bitstream`
// defines DERMIS_TOP, the top's module name. Pins are in colorlight-i5.lpf and colorlight-i9.lpf.
module board (
  input wire clk_25mhz,
  input wire reset_n,
  input wire uart_rx,
  output wire uart_tx,
  output wire led_n
);
  wire clk, locked, alive, busy, error;

  pll_25_to_100 pll (.clk_25mhz(clk_25mhz), .clk(clk), .locked(locked));

  // One lamp: it blinks, and stays lit after an error.
  assign led_n = !(alive | error);

  `DERMIS_TOP dermis (
    .clk(clk),
    .button(!reset_n | !locked),
    .uart_rx(uart_rx),
    .uart_tx(uart_tx),
    .alive(alive),
    .busy(busy),
    .error(error)
  );
endmodule
