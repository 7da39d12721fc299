// From a spike to messages: the list of output axons that its compartment points to, in order.
//
//     axon  {last, core, row}
//
// The queue has room for a spike of every compartment, so an update never waits.
module fanout #(
    parameter LOG_COMPARTMENTS = 10,
    parameter CORE = 3,                              // bits of a core's number
    parameter ROW = 16,
    parameter AXON = 12,                             // bits of the place of an axon
    parameter AXONS = 4096
) (
    input  wire clk,
    input  wire rst,
    input  wire spike,
    input  wire [AXON-1:0] first,
    output reg  out_valid,
    input  wire out_ready,
    output wire [CORE-1:0] out_core,
    output wire [ROW-1:0] out_row,
    output wire idle,
    input  wire write,
    input  wire [AXON-1:0] write_at,
    input  wire [CORE+ROW:0] in
);
    wire waiting, drained;
    wire [AXON-1:0] begins;
    wire start = waiting & !out_valid;
    queue #(.WIDTH(AXON), .LOG_DEPTH(LOG_COMPARTMENTS)) spikes (
        .clk(clk), .rst(rst), .push(spike), .ready(), .in(first),
        .pop(start), .valid(waiting), .head(begins), .empty(drained));

    reg [CORE+ROW:0] memory [0:AXONS-1];
    reg [CORE+ROW:0] axon;
    reg [AXON-1:0] at;
    wire taken = out_valid & out_ready;
    wire [AXON-1:0] next = start ? begins : at + 1'b1;
    wire last;
    assign {last, out_core, out_row} = axon;
    assign idle = drained & !out_valid;
    always @(posedge clk) begin
        if (write) memory[write_at] <= in;
        if (start | taken) begin
            axon <= memory[next]; at <= next;
        end
    end
    always @(posedge clk)
        if (rst) out_valid <= 0;
        else if (start) out_valid <= 1;
        else if (taken & last) out_valid <= 0;
endmodule
