// A chip on a board: clock, a serial line to the host, and nothing else.
//
// parameters.vh is written beside the memory image: how many cores, and how large their memories.
`include "parameters.vh"
module board #(
    parameter BAUD_CYCLES = `BAUD_CYCLES
) (
    input  wire clk,
    input  wire rx,
    output wire tx
);
    reg [3:0] since_begin = 0;
    wire rst = !since_begin[3];
    always @(posedge clk) if (rst) since_begin <= since_begin + 1'b1;

    wire in_valid, out_valid, out_ready, go, clear, quiet, host_valid, host_ready, write, read_spike;
    wire [7:0] in, out;
    wire [31:0] cycles;
    wire [`CORE-1:0] at_core;
    wire [15:0] at;
    wire [2:0] select;
    wire [47:0] data;
    wire [23:0] read_u, read_v;
    uart #(.CYCLES(BAUD_CYCLES)) uart (
        .clk(clk), .rst(rst), .rx(rx), .tx(tx), .in_valid(in_valid), .in(in),
        .out_valid(out_valid), .out_ready(out_ready), .out(out));
    host #(.CORE(`CORE)) host (
        .clk(clk), .rst(rst), .in_valid(in_valid), .in(in), .out_valid(out_valid),
        .out_ready(out_ready), .out(out), .go(go), .clear(clear), .quiet(quiet), .cycles(cycles),
        .host_valid(host_valid), .host_ready(host_ready), .at_core(at_core), .at(at),
        .select(select), .write(write), .data(data), .read_u(read_u), .read_v(read_v),
        .read_spike(read_spike));
    chip #(.CORES(`CORES), .CORE(`CORE), .LOG_COMPARTMENTS(`LOG_COMPARTMENTS), .WIDTH(`WIDTH),
           .LOG_QUEUE(`LOG_QUEUE), .WORDS(`WORDS), .AXONS(`AXONS)) chip (
        .clk(clk), .rst(rst), .go(go), .clear(clear), .quiet(quiet), .cycles(cycles), .moved(),
        .host_valid(host_valid), .host_ready(host_ready), .host_core(at_core), .host_row(at),
        .at_core(at_core), .at(at), .write(write), .select(select), .in(data), .read_u(read_u),
        .read_v(read_v), .read_spike(read_spike));
endmodule
