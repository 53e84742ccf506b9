// ULX3S: pins around the board top, whose PLL is in ecp5-pll.v. `dermis bitstream` defines DERMIS_TOP, the top's module
// name, DERMIS_SPI or DERMIS_UART, its link, and of a scene that scans its array DERMIS_ROW_BITS, the width of the row's
// address. Pins are in ulx3s-85f.lpf, named as in the board's manual, those of the SPI and the row by function.
module board (
  input wire clk_25mhz,
  input wire fire1,
`ifdef DERMIS_SPI
  input wire spi_sclk,
  input wire spi_cs_n,
  input wire spi_mosi,
  output wire spi_miso,
`else
  input wire ftdi_txd,
  output wire ftdi_rxd,
`endif
`ifdef DERMIS_ROW_BITS
  output wire [5:0] row,
  output wire adc_sclk,
  output wire adc_csn,
  output wire adc_mosi,
  input wire adc_miso,
`endif
  output wire [7:0] led,
  output wire wifi_gpio0
);
  wire clk, locked;

  pll_25_to_100 pll (.clk_25mhz(clk_25mhz), .clk(clk), .locked(locked));

  // Held high: low would let the WiFi module's boot loader take over the board.
  assign wifi_gpio0 = 1'b1;
  assign led[7:3] = 5'd0;

`ifdef DERMIS_SPI
  // High impedance while not selected: other slaves may share the line.
  wire miso;
  assign spi_miso = spi_cs_n ? 1'bz : miso;
`endif

`ifdef DERMIS_ROW_BITS
  wire [`DERMIS_ROW_BITS-1:0] address;
  assign row = address;
`endif

  `DERMIS_TOP dermis (
    .clk(clk),
    .button(fire1 | !locked),
`ifdef DERMIS_SPI
    .spi_sclk(spi_sclk),
    .spi_cs_n(spi_cs_n),
    .spi_mosi(spi_mosi),
    .spi_miso(miso),
`else
    .uart_rx(ftdi_txd),
    .uart_tx(ftdi_rxd),
`endif
`ifdef DERMIS_ROW_BITS
    .row(address),
    .adc_sclk(adc_sclk),
    .adc_cs_n(adc_csn),
    .adc_mosi(adc_mosi),
    .adc_miso(adc_miso),
`endif
    .alive(led[0]),
    .busy(led[1]),
    .error(led[2])
  );
endmodule
