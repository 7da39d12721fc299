// A first-in, first-out queue in block RAM, with its head in a register.
//
//     n <- n + push - pop;   head is the oldest entry while valid
//
// It holds 2^LOG_DEPTH entries and the head. A push is lost unless ready, a pop unless valid.
module queue #(
    parameter WIDTH = 16,
    parameter LOG_DEPTH = 9
) (
    input  wire clk,
    input  wire rst,
    input  wire push,
    output wire ready,
    input  wire [WIDTH-1:0] in,
    input  wire pop,
    output reg  valid,
    output reg  [WIDTH-1:0] head,
    output wire empty
);
    reg [WIDTH-1:0] memory [0:(1 << LOG_DEPTH)-1];
    // An entry can be read from the cycle after that in which it was written.
    reg [LOG_DEPTH:0] written, seen, read;
    wire [LOG_DEPTH:0] held = written - read;
    wire fetch = read != seen & (!valid | pop);
    assign ready = !held[LOG_DEPTH];
    assign empty = !valid & held == 0;

    always @(posedge clk) begin
        if (push & ready) memory[written[LOG_DEPTH-1:0]] <= in;
        if (fetch) head <= memory[read[LOG_DEPTH-1:0]];
    end
    always @(posedge clk)
        if (rst) begin
            written <= 0; seen <= 0; read <= 0; valid <= 0;
        end else begin
            written <= written + {{LOG_DEPTH{1'b0}}, push & ready};
            seen <= written;
            read <= read + {{LOG_DEPTH{1'b0}}, fetch};
            valid <= fetch | (valid & !pop);
        end
endmodule
