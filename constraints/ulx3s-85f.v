// ULX3S: pins and clock around the board top DERMIS_TOP, whose name the flow defines.
// Pins are in ulx3s-85f.lpf; their names are those of the board's manual.
module board (
  input wire clk_25mhz,
  input wire fire1,
  input wire ftdi_txd,
  output wire ftdi_rxd,
  output wire [7:0] led,
  output wire wifi_gpio0
);
  wire clk, locked;

  // 25 MHz to 100 MHz, the board file's clock_MHz; the oscillator of the PLL runs at 600 MHz (400 to 800 are allowed).
  (* FREQUENCY_PIN_CLKI = "25", FREQUENCY_PIN_CLKOP = "100" *)
  EHXPLLL #(
    .CLKI_DIV(1),
    .CLKFB_DIV(4),
    .CLKOP_DIV(6),
    .CLKOP_CPHASE(2),
    .CLKOP_FPHASE(0),
    .CLKOP_ENABLE("ENABLED"),
    .FEEDBK_PATH("CLKOP"),
    .PLLRST_ENA("DISABLED"),
    .INTFB_WAKE("DISABLED"),
    .STDBY_ENABLE("DISABLED"),
    .DPHASE_SOURCE("DISABLED"),
    .OUTDIVIDER_MUXA("DIVA")
  ) pll (
    .CLKI(clk_25mhz),
    .CLKFB(clk),
    .CLKOP(clk),
    .LOCK(locked),
    .RST(1'b0),
    .STDBY(1'b0),
    .PHASESEL0(1'b0),
    .PHASESEL1(1'b0),
    .PHASEDIR(1'b1),
    .PHASESTEP(1'b1),
    .PHASELOADREG(1'b1),
    .PLLWAKESYNC(1'b0),
    .ENCLKOP(1'b0)
  );

  // Low would let the WiFi module's boot loader take the board over.
  assign wifi_gpio0 = 1'b1;
  assign led[7:3] = 5'd0;

  `DERMIS_TOP dermis (
    .clk(clk),
    .button(fire1 | !locked),
    .uart_rx(ftdi_txd),
    .uart_tx(ftdi_rxd),
    .alive(led[0]),
    .busy(led[1]),
    .error(led[2])
  );
endmodule
