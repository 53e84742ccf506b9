// Each code leaves once, in order, clipped to its width; a frame is complete with its last taxel, an early tlast begins it
// anew; the label is that of its first beat, and says whether a beat of the frame was spoiled; one with another identifier is told
// once in a frame, and spoils it.
module proof(
  input clk, input again, input [@WIDE@-1:0] code, input sign, input [3:0] keep, input [3:0] id, input valid, input last,
  input room, input ready
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire s_ready, m_valid, m_last, complete, clipped, partial, misframed;
  wire [@BITS@-1:0] m_data;
  wire [4:0] label;
  // The bits above the code's next one are all the same here.
  wire [31:0] word = {{(32-@WIDE@){sign}}, code};
  @BLOCK@ block(
    .clk(clk), .rst(rst), .s_axis_tdata(word), .s_axis_tkeep(keep), .s_axis_tid(id), .s_axis_tvalid(valid),
    .s_axis_tready(s_ready), .s_axis_tlast(last), .room(room), .m_axis_tdata(m_data), .m_axis_tvalid(m_valid),
    .m_axis_tready(ready), .m_axis_tlast(m_last), .label(label), .complete(complete), .clipped(clipped),
    .partial(partial), .misframed(misframed)
  );
  wire signed [31:0] value = word;
  localparam signed [31:0] MOST = @MOST@, LEAST = -MOST - 1;
  wire signed [31:0] fitting = value > MOST ? MOST : value < LEAST ? LEAST : value;
  wire taken = valid && s_ready;
  reg [@COUNT@-1:0] count;
  reg [3:0] own;
  reg spoiled, mixed, held, held_last;
  reg [@BITS@-1:0] held_code;
  wire first = count == 0;
  wire foreign = !first && id != own;
  wire bad = fitting != value || keep != 4'd15 || foreign;
  always @(posedge clk) begin
    if (rst) {count, held} <= 0;
    else begin
      assert (m_valid == held && s_ready == ((!held || ready) && room));
      if (held) assert (m_data == held_code && m_last == held_last);
      assert (complete == (taken && count == @LAST@));
      assert (clipped == (taken && fitting != value) && partial == (taken && keep != 4'd15));
      assert (misframed == (taken && (last != (count == @LAST@) || (foreign && !mixed))));
      if (complete) assert (label == {bad || (spoiled && !first), first ? id : own});
      if (taken) begin
        {held, held_code, held_last} <= {1'b1, fitting[@BITS@-1:0], last};
        count <= last || complete ? 0 : count + 1;
        spoiled <= bad || (spoiled && !first);
        mixed <= foreign || (mixed && !first);
        if (first) own <= id;
      end else if (ready) held <= 1'b0;
    end
  end
endmodule
