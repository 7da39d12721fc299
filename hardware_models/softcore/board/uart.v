// Bytes over a serial line: a start bit, 8 bits, the lowest first, a stop bit; CYCLES of the clock each.
//
// A byte that comes is read in the middle of its bits. There is no flow control: what comes must be taken.
module uart #(
    parameter CYCLES = 15
) (
    input  wire clk,
    input  wire rst,
    input  wire rx,
    output reg  tx,
    output reg  in_valid,                            // a byte came, for one cycle
    output reg  [7:0] in,
    input  wire out_valid,
    output wire out_ready,
    input  wire [7:0] out
);
    localparam BITS = $clog2(CYCLES + 1);
    reg [1:0] line;                                  // rx, synchronised
    reg [BITS-1:0] in_wait, out_wait;
    reg [3:0] in_left, out_left;                     // bits of a byte that are left
    reg [8:0] sending;
    assign out_ready = out_left == 0;
    always @(posedge clk) begin
        line <= {line[0], rx};
        in_valid <= 0;
        if (rst) in_left <= 0;
        else if (in_left == 0) begin
            if (!line[1]) begin
                in_left <= 10; in_wait <= CYCLES / 2 - 1;
            end
        end else if (in_wait != 0) in_wait <= in_wait - 1'b1;
        else begin
            in_wait <= CYCLES - 1; in_left <= in_left - 1'b1;
            if (in_left == 10 & line[1]) in_left <= 0;      // no start bit: a disturbance
            if (in_left == 1) in_valid <= line[1];
            else in <= {line[1], in[7:1]};
        end
    end
    always @(posedge clk)
        if (rst) begin
            out_left <= 0; tx <= 1;
        end else if (out_left == 0) begin
            tx <= !out_valid;
            if (out_valid) begin
                sending <= {1'b1, out}; out_left <= 10; out_wait <= CYCLES - 1;
            end
        end else if (out_wait != 0) out_wait <= out_wait - 1'b1;
        else begin
            {sending, tx} <= {1'b1, sending}; out_wait <= CYCLES - 1; out_left <= out_left - 1'b1;
        end
endmodule
