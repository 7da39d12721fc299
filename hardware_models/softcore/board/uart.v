// Bytes over a serial line: 8 bits, no parity, one stop bit, CYCLES clock cycles a bit.
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
    reg [3:0] in_left, out_left;
    reg [8:0] sending;
    assign out_ready = out_left == 0;
    always @(posedge clk) begin
        line <= {line[0], rx};
        in_valid <= 0;
        if (rst) begin
            in_left <= 0; out_left <= 0; tx <= 1;
        end else begin
            if (in_left == 0) begin
                if (!line[1]) begin                  // a start bit: look again in its middle
                    in_left <= 10; in_wait <= CYCLES / 2;
                end
            end else if (in_wait != 0) in_wait <= in_wait - 1'b1;
            else begin
                in_wait <= CYCLES - 1; in_left <= in_left - 1'b1;
                if (in_left == 1) in_valid <= line[1];
                else in <= {line[1], in[7:1]};
            end

            if (out_left == 0) begin
                tx <= !out_valid;
                if (out_valid) begin
                    sending <= {1'b1, out}; out_left <= 10; out_wait <= CYCLES - 1;
                end
            end else if (out_wait != 0) out_wait <= out_wait - 1'b1;
            else begin
                {sending, tx} <= {1'b1, sending}; out_wait <= CYCLES - 1; out_left <= out_left - 1'b1;
            end
        end
    end
endmodule
