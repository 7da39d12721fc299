// Cores, the bus between them, and the barrier. The host writes memories while all is quiet, begins a
// step with `go`, sends its own messages, and waits for `quiet`; then it reads what it wants to know.
//
// The host's port spans the chip like the bus: a register at the cores' inputs and one after the choice
// of a core's state keep its wires out of the cores' paths.
module chip #(
    parameter CORES = 1,
    parameter LOG_COMPARTMENTS = 10,
    parameter CORE = 3,
    parameter ROW = 16,
    parameter WIDTH = 22,
    parameter LOG_QUEUE = 9,
    parameter [CORES*20-1:0] WORDS = {CORES{20'd65536}},   // of each core, core 0 in the lowest bits
    parameter [CORES*16-1:0] AXONS = {CORES{16'd4096}}
) (
    input  wire clk,
    input  wire rst,
    input  wire go,
    input  wire clear,
    output wire quiet,
    output wire [31:0] cycles,
    output wire moved,                               // a message reached a core in this cycle
    input  wire host_valid,
    output wire host_ready,
    input  wire [CORE-1:0] host_core,
    input  wire [ROW-1:0] host_row,
    input  wire [CORE-1:0] at_core,                  // whose memory is written or read
    input  wire [15:0] at,
    input  wire write,
    input  wire [2:0] select,
    input  wire [47:0] in,
    output reg  signed [23:0] read_u, read_v,        // three cycles after `at`
    output reg  read_spike
);
    localparam LAST = LOG_COMPARTMENTS - 1;
    wire [CORES:0] valid, ready;
    wire [(CORES+1)*(CORE+ROW)-1:0] sent;
    wire [CORES-1:0] idle, arrives, room, spikes;
    wire [CORES*24-1:0] u, v;
    wire [ROW-1:0] row;
    wire bus_empty;
    assign valid[CORES] = host_valid;
    assign sent[CORES*(CORE+ROW) +: CORE+ROW] = {host_core, host_row};
    assign host_ready = ready[CORES];

    reg [CORE-1:0] held_core;
    reg [15:0] held_at;
    reg [CORES-1:0] writes;
    reg [2:0] held_select;
    reg [47:0] held;
    integer k;
    always @(posedge clk) begin
        {held_core, held_at, held_select, held} <= {at_core, at, select, in};
        for (k = 0; k < CORES; k = k + 1) begin
            writes[k] <= write & at_core == k;
            if (held_core == k) {read_spike, read_v, read_u} <= {spikes[k], v[k*24 +: 24], u[k*24 +: 24]};
        end
    end

    bus #(.CORES(CORES), .CORE(CORE), .ROW(ROW)) bus (
        .clk(clk), .rst(rst), .in_valid(valid), .in_ready(ready), .in(sent), .out_valid(arrives),
        .out_ready(room), .out_row(row), .empty(bus_empty), .moved(moved));
    barrier #(.CORES(CORES)) barrier (
        .clk(clk), .rst(rst), .go(go), .idle(idle), .bus_empty(bus_empty), .quiet(quiet),
        .cycles(cycles));
    genvar i;
    generate for (i = 0; i < CORES; i = i + 1) begin : each
        core #(.NUMBER(i), .LOG_COMPARTMENTS(LOG_COMPARTMENTS), .CORE(CORE), .ROW(ROW),
               .WORDS(WORDS[i*20 +: 20]), .AXONS(AXONS[i*16 +: 16]), .WIDTH(WIDTH),
               .LOG_QUEUE(LOG_QUEUE)) core (
            .clk(clk), .rst(rst), .go(go), .clear(clear), .idle(idle[i]), .in_valid(arrives[i]),
            .in_ready(room[i]), .in_row(row), .out_valid(valid[i]), .out_ready(ready[i]),
            .out_core(sent[i*(CORE+ROW)+ROW +: CORE]), .out_row(sent[i*(CORE+ROW) +: ROW]),
            .read_at(held_at[LAST:0]), .read_u(u[i*24 +: 24]), .read_v(v[i*24 +: 24]),
            .read_spike(spikes[i]), .write(writes[i]), .select(held_select),
            .write_at(held_at), .in(held));
    end endgenerate
endmodule
