// The bus between cores: one message in three cycles, sources in turn; the host is the last source.
//
// Choose a source, take its message, hand it to its core, which may let it wait. Each of these ends in a
// register, so that no path leads through two cores: the bus spans the chip, and its wires are the
// longest. No source waits for more than one message of each other.
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
    reg [CORES:0] granted;                           // the source that is chosen, as one bit
    reg [CORES:0] later;                             // sources whose turn comes before the others'
    assign out_valid = valid ? {{(CORES-1){1'b0}}, 1'b1} << core : {CORES{1'b0}};
    assign moved = |(out_valid & out_ready);
    assign empty = !valid;
    assign in_ready = granted;

    wire [CORES:0] first = |(in_valid & later) ? in_valid & later : in_valid;
    wire [CORES:0] chosen = first & (~first + 1'b1); // the lowest of them
    reg [SIZE-1:0] message;
    integer i;
    always @* begin
        message = 0;
        for (i = 0; i <= CORES; i = i + 1) message = message | ({SIZE{granted[i]}} & in[i*SIZE +: SIZE]);
    end
    always @(posedge clk) begin
        if (|granted) {core, out_row} <= message;
        if (rst) begin
            valid <= 0; granted <= 0; later <= 0;
        end else if (valid) valid <= !moved & core < CORES;  // one to a core that is not there is dropped
        else if (|granted) begin
            valid <= 1; granted <= 0;
        end else begin
            granted <= chosen;
            if (|in_valid) later <= ~(chosen | (chosen - 1'b1));
        end
    end
endmodule
