// Simulation models of the ECP5 cells that Yosys ships as black boxes only, in the modes that this flow uses.
// Source of the behaviour: Lattice FPGA-TN-02204 (memory) and FPGA-TN-02205 (sysDSP).

// An 18x18 multiplier with optional registers at the operands and at the product, all on CLK0, enabled, without reset.
module MULT18X18D (
  input A0, A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11, A12, A13, A14, A15, A16, A17,
  input B0, B1, B2, B3, B4, B5, B6, B7, B8, B9, B10, B11, B12, B13, B14, B15, B16, B17,
  input C0, C1, C2, C3, C4, C5, C6, C7, C8, C9, C10, C11, C12, C13, C14, C15, C16, C17,
  input SIGNEDA, SIGNEDB, SOURCEA, SOURCEB, CLK0, CE0, RST0,
  output P0, P1, P2, P3, P4, P5, P6, P7, P8, P9, P10, P11, P12, P13, P14, P15, P16, P17,
  output P18, P19, P20, P21, P22, P23, P24, P25, P26, P27, P28, P29, P30, P31, P32, P33, P34, P35
);
  parameter REG_INPUTA_CLK = "NONE";
  parameter REG_INPUTA_CE = "CE0";
  parameter REG_INPUTA_RST = "RST0";
  parameter REG_INPUTB_CLK = "NONE";
  parameter REG_INPUTB_CE = "CE0";
  parameter REG_INPUTB_RST = "RST0";
  parameter REG_OUTPUT_CLK = "NONE";
  parameter REG_OUTPUT_CE = "CE0";
  parameter REG_OUTPUT_RST = "RST0";

  wire [17:0] a = {A17, A16, A15, A14, A13, A12, A11, A10, A9, A8, A7, A6, A5, A4, A3, A2, A1, A0};
  wire [17:0] b = {B17, B16, B15, B14, B13, B12, B11, B10, B9, B8, B7, B6, B5, B4, B3, B2, B1, B0};
  reg [17:0] a_register = 18'd0, b_register = 18'd0;
  wire [17:0] a_used = REG_INPUTA_CLK == "NONE" ? a : a_register;
  wire [17:0] b_used = REG_INPUTB_CLK == "NONE" ? b : b_register;
  wire signed [18:0] a_wide = {SIGNEDA & a_used[17], a_used};
  wire signed [18:0] b_wide = {SIGNEDB & b_used[17], b_used};
  wire signed [37:0] product = a_wide * b_wide;
  reg [35:0] product_register = 36'd0;
  always @(posedge CLK0) if (CE0) begin
    a_register <= RST0 ? 18'd0 : a;
    b_register <= RST0 ? 18'd0 : b;
    product_register <= RST0 ? 36'd0 : product[35:0];
  end
  assign {P35, P34, P33, P32, P31, P30, P29, P28, P27, P26, P25, P24, P23, P22, P21, P20, P19, P18, P17, P16, P15, P14,
          P13, P12, P11, P10, P9, P8, P7, P6, P5, P4, P3, P2, P1, P0} =
    REG_OUTPUT_CLK == "NONE" ? product[35:0] : product_register;
endmodule

// A block RAM of 18 kbit as 1024 words of two bytes of nine bits, with optional output registers, without resets.
// Words of 1, 2 and 4 bits use eight of a byte's nine bits. Words of 36 bits use the data pins of both ports: port A
// writes them, port B reads them, and both ports' output registers are to have the same clock and enable.
module DP16KD (
  input DIA0, DIA1, DIA2, DIA3, DIA4, DIA5, DIA6, DIA7, DIA8, DIA9, DIA10, DIA11, DIA12, DIA13, DIA14, DIA15, DIA16, DIA17,
  input ADA0, ADA1, ADA2, ADA3, ADA4, ADA5, ADA6, ADA7, ADA8, ADA9, ADA10, ADA11, ADA12, ADA13,
  input CLKA, CEA, OCEA, WEA, RSTA, CSA0, CSA1, CSA2,
  input DIB0, DIB1, DIB2, DIB3, DIB4, DIB5, DIB6, DIB7, DIB8, DIB9, DIB10, DIB11, DIB12, DIB13, DIB14, DIB15, DIB16, DIB17,
  input ADB0, ADB1, ADB2, ADB3, ADB4, ADB5, ADB6, ADB7, ADB8, ADB9, ADB10, ADB11, ADB12, ADB13,
  input CLKB, CEB, OCEB, WEB, RSTB, CSB0, CSB1, CSB2,
  output DOA0, DOA1, DOA2, DOA3, DOA4, DOA5, DOA6, DOA7, DOA8, DOA9, DOA10, DOA11, DOA12, DOA13, DOA14, DOA15, DOA16, DOA17,
  output DOB0, DOB1, DOB2, DOB3, DOB4, DOB5, DOB6, DOB7, DOB8, DOB9, DOB10, DOB11, DOB12, DOB13, DOB14, DOB15, DOB16, DOB17
);
  parameter DATA_WIDTH_A = 18;
  parameter DATA_WIDTH_B = 18;
  parameter CLKAMUX = "CLKA";
  parameter CLKBMUX = "CLKB";
  parameter REGMODE_A = "NOREG";
  parameter REGMODE_B = "NOREG";
  parameter RESETMODE = "SYNC";
  parameter ASYNC_RESET_RELEASE = "SYNC";
  parameter CSDECODE_A = "0b000";
  parameter CSDECODE_B = "0b000";
  parameter WRITEMODE_A = "NORMAL";
  parameter WRITEMODE_B = "NORMAL";
  parameter GSR = "ENABLED";
  parameter [319:0] INITVAL_00 = 320'd0;
  parameter [319:0] INITVAL_01 = 320'd0;
  parameter [319:0] INITVAL_02 = 320'd0;
  parameter [319:0] INITVAL_03 = 320'd0;
  parameter [319:0] INITVAL_04 = 320'd0;
  parameter [319:0] INITVAL_05 = 320'd0;
  parameter [319:0] INITVAL_06 = 320'd0;
  parameter [319:0] INITVAL_07 = 320'd0;
  parameter [319:0] INITVAL_08 = 320'd0;
  parameter [319:0] INITVAL_09 = 320'd0;
  parameter [319:0] INITVAL_0A = 320'd0;
  parameter [319:0] INITVAL_0B = 320'd0;
  parameter [319:0] INITVAL_0C = 320'd0;
  parameter [319:0] INITVAL_0D = 320'd0;
  parameter [319:0] INITVAL_0E = 320'd0;
  parameter [319:0] INITVAL_0F = 320'd0;
  parameter [319:0] INITVAL_10 = 320'd0;
  parameter [319:0] INITVAL_11 = 320'd0;
  parameter [319:0] INITVAL_12 = 320'd0;
  parameter [319:0] INITVAL_13 = 320'd0;
  parameter [319:0] INITVAL_14 = 320'd0;
  parameter [319:0] INITVAL_15 = 320'd0;
  parameter [319:0] INITVAL_16 = 320'd0;
  parameter [319:0] INITVAL_17 = 320'd0;
  parameter [319:0] INITVAL_18 = 320'd0;
  parameter [319:0] INITVAL_19 = 320'd0;
  parameter [319:0] INITVAL_1A = 320'd0;
  parameter [319:0] INITVAL_1B = 320'd0;
  parameter [319:0] INITVAL_1C = 320'd0;
  parameter [319:0] INITVAL_1D = 320'd0;
  parameter [319:0] INITVAL_1E = 320'd0;
  parameter [319:0] INITVAL_1F = 320'd0;
  parameter [319:0] INITVAL_20 = 320'd0;
  parameter [319:0] INITVAL_21 = 320'd0;
  parameter [319:0] INITVAL_22 = 320'd0;
  parameter [319:0] INITVAL_23 = 320'd0;
  parameter [319:0] INITVAL_24 = 320'd0;
  parameter [319:0] INITVAL_25 = 320'd0;
  parameter [319:0] INITVAL_26 = 320'd0;
  parameter [319:0] INITVAL_27 = 320'd0;
  parameter [319:0] INITVAL_28 = 320'd0;
  parameter [319:0] INITVAL_29 = 320'd0;
  parameter [319:0] INITVAL_2A = 320'd0;
  parameter [319:0] INITVAL_2B = 320'd0;
  parameter [319:0] INITVAL_2C = 320'd0;
  parameter [319:0] INITVAL_2D = 320'd0;
  parameter [319:0] INITVAL_2E = 320'd0;
  parameter [319:0] INITVAL_2F = 320'd0;
  parameter [319:0] INITVAL_30 = 320'd0;
  parameter [319:0] INITVAL_31 = 320'd0;
  parameter [319:0] INITVAL_32 = 320'd0;
  parameter [319:0] INITVAL_33 = 320'd0;
  parameter [319:0] INITVAL_34 = 320'd0;
  parameter [319:0] INITVAL_35 = 320'd0;
  parameter [319:0] INITVAL_36 = 320'd0;
  parameter [319:0] INITVAL_37 = 320'd0;
  parameter [319:0] INITVAL_38 = 320'd0;
  parameter [319:0] INITVAL_39 = 320'd0;
  parameter [319:0] INITVAL_3A = 320'd0;
  parameter [319:0] INITVAL_3B = 320'd0;
  parameter [319:0] INITVAL_3C = 320'd0;
  parameter [319:0] INITVAL_3D = 320'd0;
  parameter [319:0] INITVAL_3E = 320'd0;
  parameter [319:0] INITVAL_3F = 320'd0;

  reg [17:0] memory [0:1023];
  wire [20479:0] initial_words = {
    INITVAL_3F, INITVAL_3E, INITVAL_3D, INITVAL_3C, INITVAL_3B, INITVAL_3A, INITVAL_39, INITVAL_38,
    INITVAL_37, INITVAL_36, INITVAL_35, INITVAL_34, INITVAL_33, INITVAL_32, INITVAL_31, INITVAL_30,
    INITVAL_2F, INITVAL_2E, INITVAL_2D, INITVAL_2C, INITVAL_2B, INITVAL_2A, INITVAL_29, INITVAL_28,
    INITVAL_27, INITVAL_26, INITVAL_25, INITVAL_24, INITVAL_23, INITVAL_22, INITVAL_21, INITVAL_20,
    INITVAL_1F, INITVAL_1E, INITVAL_1D, INITVAL_1C, INITVAL_1B, INITVAL_1A, INITVAL_19, INITVAL_18,
    INITVAL_17, INITVAL_16, INITVAL_15, INITVAL_14, INITVAL_13, INITVAL_12, INITVAL_11, INITVAL_10,
    INITVAL_0F, INITVAL_0E, INITVAL_0D, INITVAL_0C, INITVAL_0B, INITVAL_0A, INITVAL_09, INITVAL_08,
    INITVAL_07, INITVAL_06, INITVAL_05, INITVAL_04, INITVAL_03, INITVAL_02, INITVAL_01, INITVAL_00};
  integer k;
  initial for (k = 0; k < 1024; k = k + 1) memory[k] = initial_words[20 * k +: 18];
  wire [17:0] write_a = {DIA17, DIA16, DIA15, DIA14, DIA13, DIA12, DIA11, DIA10, DIA9, DIA8, DIA7, DIA6, DIA5,
    DIA4, DIA3, DIA2, DIA1, DIA0};
  wire [13:0] address_a = {ADA13, ADA12, ADA11, ADA10, ADA9, ADA8, ADA7, ADA6, ADA5, ADA4, ADA3, ADA2, ADA1,
    ADA0};
  wire [17:0] write_b = {DIB17, DIB16, DIB15, DIB14, DIB13, DIB12, DIB11, DIB10, DIB9, DIB8, DIB7, DIB6, DIB5,
    DIB4, DIB3, DIB2, DIB1, DIB0};
  wire [13:0] address_b = {ADB13, ADB12, ADB11, ADB10, ADB9, ADB8, ADB7, ADB6, ADB5, ADB4, ADB3, ADB2, ADB1,
    ADB0};
  reg [17:0] read_a = 18'd0, read_b = 18'd0;
  assign {DOA17, DOA16, DOA15, DOA14, DOA13, DOA12, DOA11, DOA10, DOA9, DOA8, DOA7, DOA6, DOA5, DOA4, DOA3, DOA2, DOA1,
    DOA0} = REGMODE_A == "OUTREG" ? registered_a : read_a;
  assign {DOB17, DOB16, DOB15, DOB14, DOB13, DOB12, DOB11, DOB10, DOB9, DOB8, DOB7, DOB6, DOB5, DOB4, DOB3, DOB2, DOB1,
    DOB0} = REGMODE_B == "OUTREG" ? registered_b : read_b;
  reg [17:0] registered_a = 18'd0, registered_b = 18'd0;
  always @(posedge CLKA) if (OCEA) registered_a <= read_a;
  always @(posedge CLKB) if (OCEB) registered_b <= read_b;

  // The narrow word at `address`, out of the 18-bit word that holds it.
  function [17:0] narrow(input integer width, input [13:0] address, input [17:0] word);
    reg [8:0] octet;
    begin
      octet = address[3] ? word[17:9] : word[8:0];
      case (width)
        1: narrow = {17'd0, octet[address[2:0]]};
        2: narrow = {16'd0, octet[{address[2:1], 1'b0} +: 2]};
        4: narrow = {14'd0, octet[{address[2], 2'b00} +: 4]};
        9: narrow = {9'd0, octet};
        default: narrow = word;
      endcase
    end
  endfunction

  // The 18-bit word after `data` is written into it at `address`.
  function [17:0] merged(input integer width, input [13:0] address, input [17:0] word, input [17:0] data);
    reg [8:0] octet;
    begin
      octet = address[3] ? word[17:9] : word[8:0];
      case (width)
        1: octet[address[2:0]] = data[0];
        2: octet[{address[2:1], 1'b0} +: 2] = data[1:0];
        4: octet[{address[2], 2'b00} +: 4] = data[3:0];
        default: octet = data[8:0];
      endcase
      merged = address[3] ? {octet, word[8:0]} : {word[17:9], octet};
      if (width >= 18)
        merged = {address[1] ? data[17:9] : word[17:9], address[0] ? data[8:0] : word[8:0]};
    end
  endfunction

  generate
    if (DATA_WIDTH_A == 36) begin : wide_write
      wire [8:0] row = address_a[13:5];
      always @(posedge CLKA) if (CEA && WEA) begin
        memory[{row, 1'b0}] <= merged(18, address_a, memory[{row, 1'b0}], write_a);
        memory[{row, 1'b1}] <= merged(18, {12'd0, address_a[3:2]}, memory[{row, 1'b1}], write_b);
      end
    end else begin : port_a
      wire [17:0] word = memory[address_a[13:4]];
      wire [17:0] written = merged(DATA_WIDTH_A, address_a, word, write_a);
      always @(posedge CLKA) if (CEA && WEA) memory[address_a[13:4]] <= written;
      // A 36-bit read at port B uses this port's data pins for its lower half.
      if (DATA_WIDTH_B != 36) begin : narrow_read
        always @(posedge CLKA) if (CEA && !(WEA && WRITEMODE_A == "NORMAL"))
          read_a <= narrow(DATA_WIDTH_A, address_a, WEA && WRITEMODE_A == "WRITETHROUGH" ? written : word);
      end
    end
    if (DATA_WIDTH_B == 36) begin : wide_read
      always @(posedge CLKB) if (CEB) begin
        read_a <= memory[{address_b[13:5], 1'b0}];
        read_b <= memory[{address_b[13:5], 1'b1}];
      end
    end else begin : port_b
      wire [17:0] word = memory[address_b[13:4]];
      wire [17:0] written = merged(DATA_WIDTH_B, address_b, word, write_b);
      always @(posedge CLKB) if (CEB) begin
        if (WEB) memory[address_b[13:4]] <= written;
        if (!(WEB && WRITEMODE_B == "NORMAL"))
          read_b <= narrow(DATA_WIDTH_B, address_b, WEB && WRITEMODE_B == "WRITETHROUGH" ? written : word);
      end
    end
  endgenerate
endmodule
