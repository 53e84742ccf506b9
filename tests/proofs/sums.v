// Beats of the engine pass as words, each once and as it is, taken when its word is; where sums are asked for, the
// forces' beats are taken first, then come four words, each of which stands until it is taken, then the status passes.
module proof(input clk, input again, input run, input offered, input sample, input takes);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  (* anyconst *) reg summarise;
  // Beats of the frame that were taken, words of its sums that were, cycles since.
  reg [7:0] taken, words, since;
  reg stands;
  wire last = taken == 8'd@LAST@;
  wire summing = summarise && taken < 8'd@TAXELS@;
  wire gives = summarise && taken == 8'd@TAXELS@ && words < 8'd4;
  wire ready, word_valid, word_last;
  wire [95:0] word;
  reg [95:0] before;
  wire moves = word_valid && takes;
  @BLOCK@ block(
    .clk(clk), .rst(rst), .run(run), .taken(moves), .summarise(summarise), .beat({96{sample}}), .beat_valid(offered),
    .beat_last(last), .beat_ready(ready), .word(word), .word_valid(word_valid), .word_last(word_last)
  );
  always @(posedge clk) begin
    stands <= gives && word_valid && !takes && !rst;
    before <= word;
    if (rst) {taken, words, since} <= 24'd0;
    else begin
      if (summing) assert (ready == run && !word_valid);
      else if (gives) assert (!ready && !word_last && (word_valid || !run || since < 8'd@MOST@));
      else assert (ready == moves && word_valid == (run && offered) && word == {96{sample}} && word_last == last);
      if (stands) assert (word == before);
      if (offered && ready) {taken, words} <= {last ? 8'd0 : taken + 8'd1, last ? 8'd0 : words};
      if (gives && moves) words <= words + 8'd1;
      since <= gives ? since + (since != 8'd255) : 8'd0;
    end
  end
endmodule
