// PLL of the ECP5 boards: 25 MHz to 100 MHz, the boards' clock_MHz; its oscillator runs at 600 MHz (400 to 800 are allowed).
module pll_25_to_100 (
  input wire clk_25mhz,
  output wire clk,
  output wire locked
);
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
endmodule
