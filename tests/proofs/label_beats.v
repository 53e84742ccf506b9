// The forces of a frame pass, then its labels leave in one beat, row-major, then the statuses pass; an offered beat stays.
module proof(input clk, input again, input offer, input sample, input takes);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  // The label of each taxel, and those of a quad.
  (* anyconst *) reg [@BITS@*@TAXELS@-1:0] own;
  function [4*@BITS@-1:0] quad(input [@ADDRESS@-1:0] address);
    case (address)
@QUADS@      default: quad = 0;
    endcase
  endfunction
  wire [95:0] wanted = {@WANTED@};
  // Beats of the frame that have passed; whether its labels have left, and for how many cycles they have not.
  reg [7:0] passed, since;
  reg labelled;
  wire last = passed == 8'd@LAST@;
  wire due = passed == 8'd@TAXELS@ && !labelled;
  // Assumed of the sender: an offered beat stays until it is accepted.
  reg holds, held;
  wire offered = holds || offer;
  wire level = holds ? held : sample;
  wire ready, m_valid, m_last, reads;
  wire [95:0] m_data;
  wire [@ADDRESS@-1:0] address;
  // The memory of labels answers two cycles later.
  reg [4*@BITS@-1:0] read, labels;
  reg stands;
  reg [95:0] before;
  @BLOCK@ block(
    .clk(clk), .rst(rst), .s_axis_tdata({96{level}}), .s_axis_tvalid(offered), .s_axis_tready(ready), .s_axis_tlast(last),
    .m_axis_tdata(m_data), .m_axis_tvalid(m_valid), .m_axis_tready(takes), .m_axis_tlast(m_last),
    .reads(reads), .label_address(address), .labels(labels)
  );
  always @(posedge clk) begin
    {labels, read} <= {read, quad(address)};
    holds <= offered && !ready && !rst;
    held <= level;
    stands <= m_valid && !takes && !rst;
    before <= m_data;
    since <= due && !rst ? since + (since != 8'd255) : 8'd0;
    if (rst) {passed, labelled} <= 9'd0;
    else begin
      if (stands) assert (m_valid && m_data == before);
      if (due) begin
        assert (!ready && !m_last && (m_valid || since < 8'd@MOST@));
        if (m_valid) assert (m_data == wanted);
        if (m_valid && takes) labelled <= 1'b1;
      end else begin
        assert (m_valid == offered && ready == takes && m_data == {96{level}} && m_last == last);
        if (offered && takes) {passed, labelled} <= last ? 9'd0 : {passed + 8'd1, labelled};
      end
    end
  end
endmodule
