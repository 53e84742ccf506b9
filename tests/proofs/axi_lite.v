// One access at a time: each address, with its data if it is a write, is asked once and answered once; an answer stays until
// it is taken; a read that waits goes before the next write.
module proof(
  input clk, input again, input [7:0] awaddr, input awvalid, input wbit, input wvalid, input bready, input [7:0] araddr,
  input arvalid, input rready, input cbit, input refused
);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  wire awready, wready, bvalid, arready, rvalid, select, write;
  wire [1:0] bresp, rresp;
  wire [7:0] address;
  wire [31:0] rdata, data;
  wire [3:0] strobe;
  // One bit represents those of a word, which take the same path.
  @BLOCK@ block(
    .clk(clk), .rst(rst), .s_axil_awaddr(awaddr), .s_axil_awvalid(awvalid), .s_axil_awready(awready),
    .s_axil_wdata({32{wbit}}), .s_axil_wstrb({4{wbit}}), .s_axil_wvalid(wvalid), .s_axil_wready(wready),
    .s_axil_bresp(bresp), .s_axil_bvalid(bvalid), .s_axil_bready(bready), .s_axil_araddr(araddr),
    .s_axil_arvalid(arvalid), .s_axil_arready(arready), .s_axil_rdata(rdata), .s_axil_rresp(rresp),
    .s_axil_rvalid(rvalid), .s_axil_rready(rready), .access_select(select), .access_write(write), .access_address(address),
    .access_data(data), .access_strobe(strobe), .access_content({32{cbit}}), .access_refused(refused)
  );
  // Accesses under way, the last one, its answer.
  reg writing, reading, was_write, asked, answer, error;
  reg followed = 1'b0, b_waits, r_waits, ar_waits;
  always @(posedge clk) begin
    followed <= !rst;
    b_waits <= bvalid && !bready;
    r_waits <= rvalid && !rready;
    asked <= select && !rst;
    if (asked) {answer, error} <= {cbit, refused};
    if (rst) {writing, reading, was_write} <= 3'd0;
    else begin
      assert (awready == wready && (!awready || (awvalid && wvalid)) && (!arready || arvalid));
      assert (!(awready && arready) && select == (awready || arready) && (!select || write == awready));
      if (select) assert (address == (write ? awaddr : araddr) && !writing && !reading);
      if (select && write) assert (data == {32{wbit}} && strobe == {4{wbit}});
      assert (!bvalid || writing);
      assert (!rvalid || reading);
      assert (!(writing && reading));
      if (bvalid) assert (bresp == {error, 1'b0});
      if (rvalid) assert (rresp == {error, 1'b0} && rdata == {32{answer}});
      // Nothing under way: what is offered is taken, a read first behind a write.
      if (!writing && !reading && arvalid && was_write) assert (arready);
      if (!writing && !reading && ((awvalid && wvalid) || arvalid)) assert (select);
      if (followed && b_waits) assert (bvalid);
      if (followed && r_waits) assert (rvalid);
      if (select) {writing, reading, was_write} <= {write, !write, write};
      if (bvalid && bready) writing <= 1'b0;
      if (rvalid && rready) reading <= 1'b0;
      // An answer comes two cycles after the access.
      if (followed && asked) assert (!bvalid && !rvalid);
    end
  end
endmodule
