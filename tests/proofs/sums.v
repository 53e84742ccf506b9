// Beats of the engine pass as words, each once and unchanged, accepted two cycles after its word. With summarise, the
// beats with forces are accepted first, then four words follow, each stable until it is accepted, then the status
// passes.
module proof(input clk, input again, input run, input offer, input sample, input takes);
  reg started = 1'b0;
  always @(posedge clk) started <= 1'b1;
  wire rst = again || !started;
  (* anyconst *) reg summarise;
  // Beats of the frame accepted, words of its sums accepted, cycles since then.
  reg [7:0] taken, words, since;
  reg stands;
  wire last = taken == 8'd@LAST@;
  wire summing = summarise && taken < 8'd@TAXELS@;
  wire gives = summarise && taken == 8'd@TAXELS@ && words < 8'd4;
  wire ready, word_valid, word_last;
  // Assumed of the engine: an offered beat stays until it is accepted.
  reg holds, held;
  wire offered = holds || offer;
  wire level = holds ? held : sample;
  // Expected value of ready.
  reg granted;
  wire [95:0] word;
  reg [95:0] before;
  // Assumed of the packer: no word is accepted in the cycle after one, while the CRC processes its last byte.
  reg moved;
  wire moves = word_valid && takes && !moved;
  @BLOCK@ block(
    .clk(clk), .rst(rst), .run(run), .taken(moves), .summarise(summarise), .beat({96{level}}), .beat_valid(offered),
    .beat_last(last), .beat_ready(ready), .word(word), .word_valid(word_valid), .word_last(word_last)
  );
  always @(posedge clk) begin
    moved <= moves && !rst;
    stands <= gives && word_valid && !moves && !moved && !rst;
    before <= word;
    holds <= offered && !ready && !rst;
    held <= level;
    granted <= !rst && (summing ? run && !(offered && ready && taken == 8'd@TAXELS@ - 8'd1) : !gives && moved);
    if (rst) {taken, words, since} <= 24'd0;
    else begin
      assert (ready == granted);
      if (summing) assert (!word_valid);
      else if (gives) assert (!ready && !word_last && (word_valid || !run || since < 8'd@MOST@));
      else assert (word_valid == (run && offered && !ready) && word == {96{level}} && word_last == last);
      if (stands) assert (word == before);
      if (offered && ready) {taken, words} <= {last ? 8'd0 : taken + 8'd1, last ? 8'd0 : words};
      if (gives && moved) words <= words + 8'd1;
      since <= gives ? since + (since != 8'd255) : 8'd0;
    end
  end
endmodule
