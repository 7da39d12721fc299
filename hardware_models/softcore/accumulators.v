// The sums that arrive at compartments: two banks, which a step exchanges.
//
//     bank of the next step:   sum[target] <- sum[target] + weight     one a cycle
//     bank of this step:       q = sum[swept];   sum[swept] <- 0       one a cycle
//
// A sum is read in one cycle and written in the next, so a weight to the same target as the one
// before takes that one's sum in place of what was read. Both wrap at WIDTH bits.
module accumulators #(
    parameter LOG_COMPARTMENTS = 10,
    parameter WIDTH = 22
) (
    input  wire clk,
    input  wire rst,
    input  wire bank,                                // where weights are added
    input  wire add,
    input  wire [LOG_COMPARTMENTS-1:0] target,
    input  wire signed [WIDTH-1:0] weight,
    input  wire sweep,
    input  wire [LOG_COMPARTMENTS-1:0] swept,
    output wire signed [WIDTH-1:0] q,                // of the compartment swept a cycle before
    output wire idle
);
    localparam LAST = LOG_COMPARTMENTS - 1;
    reg added, cleared, again;
    reg [LAST:0] last_target, last_swept;
    reg signed [WIDTH-1:0] last_weight, last_sum;
    wire signed [WIDTH-1:0] read0, read1;
    wire signed [WIDTH-1:0] sum = (again ? last_sum : bank ? read1 : read0) + last_weight;
    always @(posedge clk) begin
        last_target <= target; last_weight <= weight; last_swept <= swept; last_sum <= sum;
        again <= added & target == last_target;
        added <= add & !rst; cleared <= sweep & !rst;
    end
    assign q = bank ? read0 : read1;
    assign idle = !added;

    bank #(.WIDTH(WIDTH), .LOG_DEPTH(LOG_COMPARTMENTS)) bank0 (
        .clk(clk), .read_at(bank ? swept : target), .read(read0),
        .write(bank ? cleared : added), .write_at(bank ? last_swept : last_target),
        .in(bank ? {WIDTH{1'b0}} : sum));
    bank #(.WIDTH(WIDTH), .LOG_DEPTH(LOG_COMPARTMENTS)) bank1 (
        .clk(clk), .read_at(bank ? target : swept), .read(read1),
        .write(bank ? added : cleared), .write_at(bank ? last_target : last_swept),
        .in(bank ? sum : {WIDTH{1'b0}}));
endmodule

// A memory that is read and written in every cycle; what is read comes a cycle later.
module bank #(
    parameter WIDTH = 22,
    parameter LOG_DEPTH = 10
) (
    input  wire clk,
    input  wire [LOG_DEPTH-1:0] read_at,
    output reg  [WIDTH-1:0] read,
    input  wire write,
    input  wire [LOG_DEPTH-1:0] write_at,
    input  wire [WIDTH-1:0] in
);
    reg [WIDTH-1:0] memory [0:(1 << LOG_DEPTH)-1];
    always @(posedge clk) begin
        if (write) memory[write_at] <= in;
        read <= memory[read_at];
    end
endmodule
