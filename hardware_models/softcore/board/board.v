// A chip, the host's port, and a link to the host: a serial line, or a FIFO to USB where FIFO is 1.
//
// parameters.vh comes with the memory image: how many cores, and how large their memories.
`include "parameters.vh"
module board #(
    parameter FIFO = 0,
    parameter BAUD_CYCLES = 15,
    parameter LOG_PATIENCE = 22
) (
    input  wire clk,
    input  wire rst,
    input  wire rx,
    output wire tx,
    input  wire rxf_n,
    input  wire txe_n,
    output wire rd_n,
    output wire wr_n,
    input  wire [7:0] data_in,
    output wire [7:0] data_out,
    output wire drive
);
    wire came, room, in_valid, in_ready, out_valid, out_ready;
    wire [7:0] octet, in, out;
    generate if (FIFO) begin : usb
        assign tx = 1'b1;
        fifo fifo (
            .clk(clk), .rst(rst), .rxf_n(rxf_n), .txe_n(txe_n), .rd_n(rd_n), .wr_n(wr_n),
            .data_in(data_in), .data_out(data_out), .drive(drive), .in_valid(came),
            .in_ready(room), .in(octet), .out_valid(out_valid), .out_ready(out_ready), .out(out));
    end else begin : serial
        assign {rd_n, wr_n, data_out, drive} = {2'b11, 8'd0, 1'b0};
        uart #(.CYCLES(BAUD_CYCLES)) uart (
            .clk(clk), .rst(rst), .rx(rx), .tx(tx), .in_valid(came), .in(octet),
            .out_valid(out_valid), .out_ready(out_ready), .out(out));
    end endgenerate

    // Bytes that come while a message waits for the bus.
    queue #(.WIDTH(8), .LOG_DEPTH(9)) queue (
        .clk(clk), .rst(rst), .push(came), .ready(room), .in(octet), .pop(in_ready),
        .valid(in_valid), .head(in), .empty());

    wire go, clear, quiet, host_valid, host_ready, write, read_spike;
    wire [31:0] cycles;
    wire [`CORE-1:0] host_core, at_core;
    wire [15:0] host_row, at;
    wire [2:0] select;
    wire [47:0] data;
    wire [23:0] read_u, read_v;
    host #(.CORE(`CORE), .LOG_COMPARTMENTS(`LOG_COMPARTMENTS), .LOG_OUTPUTS(`LOG_OUTPUTS),
           .LOG_PATIENCE(LOG_PATIENCE)) host (
        .clk(clk), .rst(rst), .in_valid(in_valid), .in_ready(in_ready), .in(in),
        .out_valid(out_valid), .out_ready(out_ready), .out(out), .go(go), .clear(clear),
        .quiet(quiet), .cycles(cycles), .host_valid(host_valid), .host_ready(host_ready),
        .host_core(host_core), .host_row(host_row), .at_core(at_core), .at(at), .write(write),
        .select(select), .data(data), .read_u(read_u), .read_v(read_v), .read_spike(read_spike));
    chip #(.CORES(`CORES), .CORE(`CORE), .LOG_COMPARTMENTS(`LOG_COMPARTMENTS), .WIDTH(`WIDTH),
           .LOG_QUEUE(`LOG_QUEUE), .WORDS(`WORDS), .AXONS(`AXONS)) chip (
        .clk(clk), .rst(rst), .go(go), .clear(clear), .quiet(quiet), .cycles(cycles), .moved(),
        .host_valid(host_valid), .host_ready(host_ready), .host_core(host_core),
        .host_row(host_row), .at_core(at_core), .at(at), .write(write), .select(select),
        .in(data), .read_u(read_u), .read_v(read_v), .read_spike(read_spike));
endmodule
