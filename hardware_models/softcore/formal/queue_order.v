// For a bounded proof: a queue of two loses nothing, adds nothing, and keeps the order.
//
// A word is marked when it is pushed, at any time; it comes out after exactly as many pops as words
// were held before it. Reset holds in the first cycle.
module queue_order (
    input wire clk,
    input wire push,
    input wire pop,
    input wire in,
    input wire mark
);
    reg begun = 0;
    always @(posedge clk) begun <= 1;
    wire ready, valid, empty, head;
    queue #(.WIDTH(1), .LOG_DEPTH(1)) queue (
        .clk(clk), .rst(!begun), .push(push), .ready(ready), .in(in), .pop(pop), .valid(valid),
        .head(head), .empty(empty));

    reg [2:0] held = 0, before = 0;                  // words in it, and those before the marked one
    reg marked = 0, word = 0;
    wire comes = begun & push & ready, goes = begun & pop & valid;
    always @(posedge clk) begin
        held <= held + comes - goes;
        if (!marked & mark & comes) begin
            marked <= 1; word <= in; before <= held - goes;
        end else if (marked & goes) begin
            before <= before - 1'b1;
            if (before == 0) marked <= 0;
        end
    end
    always @* if (begun) begin
        assert (held <= 3);
        assert (ready | held >= 2);
        assert (!valid | held != 0);
        if (marked & valid & before == 0) assert (head == word);
        if (clear_of_reset) assert (empty == (held == 0));
    end
    reg clear_of_reset = 0;
    always @(posedge clk) clear_of_reset <= begun;
endmodule
