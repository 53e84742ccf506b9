// iCEBreaker: PLL and pins around the board top. `dermis bitstream` defines DERMIS_TOP, the top's module name, and DERMIS_SPI
// or DERMIS_UART, its link. Pins are in icebreaker.pcf, named as in the board's schematic, those of the SPI by function.
module board (
  input wire clk_12mhz,
  input wire btn_n,
`ifdef DERMIS_SPI
  input wire spi_sclk,
  input wire spi_cs_n,
  input wire spi_mosi,
  output wire spi_miso,
`else
  input wire rx,
  output wire tx,
`endif
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

`ifdef DERMIS_SPI
  // Dedicated path from the pin to a global buffer: through the fabric the clock, and with it MISO, would come late.
  wire spi_sclk_global;
  SB_GB_IO #(.PIN_TYPE(6'b000001)) sclk_pin (.PACKAGE_PIN(spi_sclk), .GLOBAL_BUFFER_OUTPUT(spi_sclk_global));
  // High impedance while not selected: other slaves may share the line.
  wire miso;
  assign spi_miso = spi_cs_n ? 1'bz : miso;
`endif

  `DERMIS_TOP dermis (
    .clk(clk),
    .button(!btn_n | !locked),
`ifdef DERMIS_SPI
    .spi_sclk(spi_sclk_global),
    .spi_cs_n(spi_cs_n),
    .spi_mosi(spi_mosi),
    .spi_miso(miso),
`else
    .uart_rx(rx),
    .uart_tx(tx),
`endif
    .alive(alive),
    .busy(led1),
    .error(error)
  );
endmodule
