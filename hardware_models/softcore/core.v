// A neuron core: in each step it updates its compartments and sends their spikes, while the weights
// of messages that arrive are added up for the next step.
module core #(
    parameter NUMBER = 0,
    parameter LOG_COMPARTMENTS = 10,
    parameter CORE = 3,                              // bits of a core's number
    parameter ROW = 16,                              // bits of a row's address
    parameter WORDS = 65536,                         // 16-bit words of synapse memory
    parameter AXONS = 4096,
    parameter WIDTH = 22,                            // bits of a sum, in units of 2^(22 - WIDTH)
    parameter LOG_QUEUE = 9
) (
    input  wire clk,
    input  wire rst,
    input  wire go,
    input  wire clear,
    output wire idle,
    input  wire in_valid,
    output wire in_ready,
    input  wire [ROW-1:0] in_row,
    output wire out_valid,
    input  wire out_ready,
    output wire [CORE-1:0] out_core,
    output wire [ROW-1:0] out_row,
    input  wire [LOG_COMPARTMENTS-1:0] read_at,
    output wire signed [23:0] read_u, read_v,
    output wire read_spike,
    input  wire write,
    input  wire [2:0] select,
    input  wire [15:0] write_at,
    input  wire [47:0] in
);
    localparam LAST = LOG_COMPARTMENTS - 1, AXON = 12;
    reg bank;
    always @(posedge clk) bank <= rst ? 1'b0 : bank ^ go;

    wire busy, swept_all, spike, sent_all, add, walked_all, added_all;
    wire [LAST:0] swept, target;
    wire [AXON-1:0] axon;
    wire signed [WIDTH-1:0] q, weight;
    sweep #(
`ifdef OBSERVED
        .NUMBER(NUMBER),
`endif
        .LOG_COMPARTMENTS(LOG_COMPARTMENTS), .WIDTH(WIDTH), .AXON(AXON)) sweep (
        .clk(clk), .rst(rst), .go(go), .clear(clear), .busy(busy), .swept(swept), .q(q),
        .spike(spike), .axon(axon), .idle(swept_all), .read_at(read_at), .read_u(read_u),
        .read_v(read_v), .read_spike(read_spike), .write(write), .select(select),
        .write_at(write_at[LAST:0]), .in(in));
    fanout #(.LOG_COMPARTMENTS(LOG_COMPARTMENTS), .CORE(CORE), .ROW(ROW), .AXON(AXON),
             .AXONS(AXONS)) fanout (
        .clk(clk), .rst(rst), .spike(spike), .first(axon), .out_valid(out_valid),
        .out_ready(out_ready), .out_core(out_core), .out_row(out_row), .idle(sent_all),
        .write(write & select == 3'd1), .write_at(write_at[AXON-1:0]), .in(in[CORE+ROW:0]));
    walker #(.LOG_COMPARTMENTS(LOG_COMPARTMENTS), .ROW(ROW), .WORDS(WORDS), .WIDTH(WIDTH),
             .LOG_QUEUE(LOG_QUEUE)) walker (
        .clk(clk), .rst(rst), .in_valid(in_valid), .in_ready(in_ready), .in_row(in_row),
        .add(add), .target(target), .weight(weight), .idle(walked_all),
        .write(write & select == 3'd2), .write_at(write_at[ROW-1:0]), .in(in[15:0]));
    accumulators #(.LOG_COMPARTMENTS(LOG_COMPARTMENTS), .WIDTH(WIDTH)) accumulators (
        .clk(clk), .rst(rst), .bank(bank), .add(add), .target(target), .weight(weight),
        .sweep(busy), .swept(swept), .q(q), .idle(added_all));
    assign idle = swept_all & sent_all & walked_all & added_all;

`ifdef OBSERVED
    import "DPI-C" function void softcore_event(input int core);
    always @(posedge clk) if (add) softcore_event(NUMBER);
`endif
endmodule
