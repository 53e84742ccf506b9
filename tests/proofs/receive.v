// A frame is complete after one beat per taxel, each code is at its address in the buffer until free, and an early or
// missing tlast sets framing.
module proof(
  input clk, input again, input [@BITS@-1:0] s_data, input s_valid, input s_last, input release_it, input reported
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire s_ready, full, accept, framing, positive, negative;
  wire [@BITS@-2:0] magnitude;
  wire [@BITS@-1:0] taken_word;
  wire [4*@BITS@-1:0] quad;
  // Any address and lane of the frame buffer, and the taxel that belongs there.
  (* anyconst *) reg [@ADDRESS@-1:0] address;
  (* anyconst *) reg [1:0] lane;
  reg [7:0] own;
  always @(*) begin
    case ({address, lane})
@PLACES@      default: own = 8'd255;
    endcase
  end
  wire free = full && release_it;
  @TOP@__receive block(
    .clk(clk), .rst(rst), .s_axis_tdata(s_data), .s_axis_tvalid(s_valid), .s_axis_tready(s_ready), .s_axis_tlast(s_last),
    .accept(accept), .taken_word(taken_word), .full(full), .free(free), .quad_address(address), .quad(quad), .part(1'b0),
    .magnitude(magnitude), .positive(positive), .negative(negative), .framing(framing), .reported(reported)
  );
  reg [7:0] count;
  reg [@BITS@-1:0] kept;
  reg whole, whole_before, whole_earlier, whole_earliest, broken;
  wire takes = s_valid && s_ready;
  wire at_end = count == 8'd@LAST@;
  always @(posedge clk) begin
    whole_before <= whole && !rst;
    whole_earlier <= whole_before && !rst;
    whole_earliest <= whole_earlier && !rst;
    if (rst) {count, whole, broken} <= 10'd0;
    else begin
      assert (s_ready == !whole && full == (whole && whole_before) && accept == takes && framing == broken);
      assert (count <= 8'd@LAST@);
      // A code is written one cycle after it was accepted.
      if (whole && whole_before && whole_earlier && whole_earliest)
        assert (own == 8'd255 || quad[lane * @BITS@ +: @BITS@] == kept);
      // positive and negative reflect the codes in the buffer.
      if (full && own != 8'd255 && $signed(kept) > 0) assert (positive);
      if (full && own != 8'd255 && $signed(kept) < 0) assert (negative);
      if (whole && free) whole <= 1'b0;
      if (reported) broken <= 1'b0;
      if (takes) begin
        if (count == own) kept <= @DEAD@ ? @BITS@'d0 : s_data;
        count <= s_last || at_end ? 8'd0 : count + 8'd1;
        if (at_end) whole <= 1'b1;
        if (s_last != at_end) broken <= 1'b1;
      end
    end
  end
endmodule
