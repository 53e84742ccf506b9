// Each beat reserved with room leaves once, two cycles after it was written or when those before it have left, in order
// and unchanged, and stays until it is accepted; then its place is free again. Bit @BIT@ represents all data bits.
module proof(input clk, input again, input wants, input comes, input sample, input takes, input pick);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire room, m_valid, m_last;
  wire [95:0] m_data;
  // Beats reserved and not accepted, those of them not yet written; beats written, and moved to the output.
  reg [4:0] reserved, promised, written, put;
  wire reserve = wants && room;
  wire write = comes && promised != 5'd0;
  wire taken = m_valid && takes;
  wire [4:0] waiting = written - put;
  wire puts = (!m_valid || takes) && waiting != 5'd0;
  @TOP@__forces__leaving queue(
    .clk(clk), .rst(rst), .reserve(reserve), .room(room), .write(write), .last(!sample), .word({96{sample}}),
    .m_axis_tvalid(m_valid), .m_axis_tready(takes), .m_axis_tlast(m_last), .m_axis_tdata(m_data)
  );
  // Any one beat is tracked: in the queue, on the output, accepted.
  reg waits, stands, gone, level;
  reg [4:0] number;
  wire [4:0] before = number - put;
  reg must_stand;
  always @(posedge clk) begin
    must_stand <= !rst && (puts || (m_valid && !takes));
    if (rst) {reserved, promised, written, put, waits, stands, gone} <= 23'd0;
    else begin
      reserved <= reserved + {4'd0, reserve} - {4'd0, taken};
      promised <= promised + {4'd0, reserve} - {4'd0, write};
      written <= written + {4'd0, write};
      put <= put + {4'd0, puts};
      assert (reserved <= 5'd@PLACES@ && room == (reserved != 5'd@PLACES@));
      assert (promised <= reserved && reserved - promised == waiting + {4'd0, m_valid});
      assert (m_valid == must_stand);
      if (write && pick && !waits && !stands && !gone) begin
        {waits, level} <= {1'b1, sample};
        number <= written;
      end
      if (waits) assert (before < waiting);
      if (waits && puts && before == 5'd0) {waits, stands} <= 2'b01;
      if (stands) assert (m_data[@BIT@] == level && m_last == !level);
      if (stands && takes) {stands, gone} <= 2'b01;
    end
  end
endmodule
