// The bus between cores: one message a cycle, sources in turn; the host is the last source.
//
// A message is taken from its source when the bus is free or frees itself in the same cycle, and
// waits on the bus until its core has room. No source waits for more than one message of each other.
module bus #(
    parameter CORES = 1,
    parameter CORE = 3,
    parameter ROW = 16
) (
    input  wire clk,
    input  wire rst,
    input  wire [CORES:0] in_valid,
    output wire [CORES:0] in_ready,
    input  wire [(CORES+1)*(CORE+ROW)-1:0] in,       // {core, row} of each source
    output wire [CORES-1:0] out_valid,
    input  wire [CORES-1:0] out_ready,
    output reg  [ROW-1:0] out_row,
    output wire empty,
    output wire moved
);
    localparam SIZE = CORE + ROW;
    reg valid;
    reg [CORE-1:0] core;
    reg [CORES:0] later;                             // sources whose turn comes before the others'
    assign out_valid = valid ? {{(CORES-1){1'b0}}, 1'b1} << core : {CORES{1'b0}};
    assign moved = |(out_valid & out_ready);
    assign empty = !valid;

    wire [CORES:0] first = |(in_valid & later) ? in_valid & later : in_valid;
    wire [CORES:0] chosen = first & (~first + 1'b1); // the lowest of them, as one bit
    wire free = !valid | moved;
    assign in_ready = free ? chosen : {(CORES+1){1'b0}};

    reg [SIZE-1:0] message;
    integer i;
    always @* begin
        message = 0;
        for (i = 0; i <= CORES; i = i + 1) message = message | ({SIZE{chosen[i]}} & in[i*SIZE +: SIZE]);
    end
    always @(posedge clk)
        if (rst) begin
            valid <= 0; later <= 0;
        end else if (free) begin
            valid <= |in_valid;
            {core, out_row} <= message;
            if (|in_valid) later <= ~(chosen | (chosen - 1'b1));
        end
endmodule
